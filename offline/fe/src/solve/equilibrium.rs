//! The search for one equilibrium: Newton's method with a bulk factor that is kept while it is accurate enough.
//!
//! Each iteration solves the contact subproblem exactly on the factor's compliance, moves the body, and judges the
//! factor by the residual.

mod convergence;
mod residual;

use nalgebra::Vector3;

use self::convergence::{CONTACT_ROUNDING, Convergence};
use self::residual::Residual;
pub(super) use self::residual::imbalance;
use super::{
    Solver,
    contact_subproblem::{ContactSubproblem, Solution},
    contact_system::KeptFactor,
    increment::{Axis, Damping, Guess, SolveError, State, Stats, Target, Watch},
};
use crate::assembly::Configuration;
use crate::contact::plane::{DEPTH, PITCH, ROLL};
use crate::contact::{ContactState, Parts, Plane};

/// Share of the residual's tolerance (or of a thousandth of the residual, if that is more) that the error of the
/// contact problem may have. Its error is a length; the penalty converts it to a force.
const CONTACT_ERROR: f64 = 0.1;

/// Residual over contact force below which the nodes' parts of the contact area follow the nodes within an iteration.
/// Farther from equilibrium they are computed before each iteration and constant within it.
const FOLLOWED_RESIDUAL: f64 = 0.1;

/// Iterations after which the parts are held in a search in which they do not follow.
const AREA_ITERATIONS: u32 = 5;

/// Iterations of a contact subproblem after which the nodes' parts of the contact area no longer follow the nodes: with
/// a node on the verge of opening the iterations might not end.
const FOLLOWED_ITERATIONS: usize = 15;

/// Share of the contact area by which the parts that were held may be off at equilibrium.
const AREA_ERROR: f64 = 0.02;

/// The same on a curved body, where the parts are held more often. Parts that are off move strength from node to node in the
/// next increment: after a reversal, 1 % of the area slips a contact by a micrometre that should stick.
const AREA_ERROR_OF_CURVED: f64 = 1e-4;

/// How often parts that are off at equilibrium are recomputed before an increment is abandoned.
const AREA_RENEWALS: u32 = 4;

/// Inputs of one search for equilibrium.
pub(super) struct Increment<'a> {
    /// The contact at the start of the increment.
    last: &'a ContactState,
    target: Target,
    /// Force (N) or moment (N mm) that a coordinate driven by it must reach.
    force_target: [Option<f64>; 6],
    damping: Option<Damping<'a>>,
}

impl<'a> Increment<'a> {
    pub fn new(last: &'a ContactState, target: Target, damping: Option<Damping<'a>>) -> Self {
        let force_target = target.0.map(|axis| match axis {
            Axis::Displacement(_) => None,
            Axis::Force(force) => Some(force),
        });
        Self { last, target, force_target, damping }
    }

    /// The plane at `guess` in its force-driven coordinates, at its target in the others.
    fn plane(&self, guess: &Plane) -> Plane {
        self.last.plane.moved_to(std::array::from_fn(|k| match self.target.0[k] {
            Axis::Displacement(place) => place,
            Axis::Force(_) => guess.at[k],
        }))
    }
}

/// State of the search.
struct Iterate {
    at: Configuration,
    plane: Plane,
    /// Internal forces at `at`, N.
    internal: Vec<f64>,
    /// Held parts of the contact area, mm²; None if they follow the positions.
    held_areas: Option<Vec<f64>>,
}

impl Iterate {
    fn parts(&self) -> Parts<'_> {
        self.held_areas.as_deref().map_or(Parts::Followed, Parts::Held)
    }
}

/// A correction of the configuration (dof order, to be subtracted) and the plane's new place.
struct Correction {
    step: Vec<f64>,
    plane: Plane,
}

impl Solver<'_> {
    /// The equilibrium of `increment`, sought from `guess`. The parts of the contact area follow the nodes; if this
    /// finds none, they are constant within an iteration. A search that failed with a factor of an earlier increment is
    /// repeated with a new one.
    pub(super) fn equilibrium(
        &mut self,
        increment: &Increment,
        guess: Guess,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<State, SolveError> {
        self.contact_factor = KeptFactor::default();
        // A curved body comes nearer by a slide too.
        let is_plane = self.surface.body().is_plane();
        let nears = |k: usize| !is_plane || [DEPTH, PITCH, ROLL].contains(&k);
        self.plane_gives_way = (0..6).any(|k| nears(k) && increment.force_target[k].is_some());
        let had_factor = self.factor_is_set;
        let mut found = self.search(increment, guess.clone(), true, stats, watch);
        if had_factor && matches!(found, Err(SolveError::Stiffness(_) | SolveError::Body(_))) {
            self.factor_is_set = false;
            found = self.search(increment, guess.clone(), true, stats, watch);
        }
        match found {
            Err(SolveError::Stalled { .. }) => self.search(increment, guess, false, stats, watch),
            found => found,
        }
    }

    fn search(
        &mut self,
        increment: &Increment,
        guess: Guess,
        follows: bool,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<State, SolveError> {
        let Guess { configuration, plane, follows_plane } = guess;
        let mut iterate =
            Iterate { at: configuration, plane: increment.plane(&plane), internal: Vec::new(), held_areas: None };
        self.internal_forces(&iterate.at, increment.damping, &mut iterate.internal)?;
        // A guess does not contain the touching nodes yet.
        iterate.held_areas = Some(self.areas_at_guess(&iterate, increment.last));
        let mut convergence = Convergence { holds_areas: !follows, ..Convergence::new() };
        let mut renewals = 0;
        loop {
            go_on(watch, stats)?;
            if convergence.iteration > 0 && !convergence.holds_areas {
                iterate.held_areas = None;
            } else if !follows && (1..AREA_ITERATIONS).contains(&convergence.iteration) && !convergence.was_cut {
                iterate.held_areas = Some(self.areas(&iterate, increment.last));
            }
            let mut residual = self.residual(&iterate, increment);
            let converged = |residual: &Residual| residual.norm <= self.settings.tolerance * residual.reference;
            if convergence.iteration == 0 && follows && converged(&residual) {
                iterate.held_areas = None;
                residual = self.residual(&iterate, increment);
            }
            stats.residual = residual.norm / residual.reference;
            if converged(&residual) {
                // Parts that were held while the contact opened for an iteration belong to no equilibrium.
                let areas = self.areas(&iterate, increment.last);
                let off = iterate.held_areas.as_ref().map_or(0.0, |held| share_off(held, &areas));
                if off <= self.area_error() || renewals == AREA_RENEWALS && off <= AREA_ERROR {
                    return Ok(self.committed(iterate, increment.last));
                }
                if renewals == AREA_RENEWALS {
                    return Err(convergence.stalled(&residual, &self.settings));
                }
                renewals += 1;
                iterate.held_areas = Some(areas);
                residual = self.residual(&iterate, increment);
            }
            if iterate.held_areas.is_none() && residual.norm > FOLLOWED_RESIDUAL * residual.reference {
                iterate.held_areas = Some(self.areas(&iterate, increment.last));
            }
            convergence.check(&residual, &self.settings)?;
            if convergence.judge(&residual, &self.settings) {
                // There is none in this precision yet, even if the search ends here.
                self.factor.use_double_precision();
                self.factor_is_set = false;
            }
            if convergence.diverges {
                return Err(convergence.stalled(&residual, &self.settings));
            }
            if !self.factor_is_set || convergence.factor_is_stale {
                self.refresh(&iterate.at, increment.last, &iterate.plane, increment.damping, stats, watch)?;
                convergence.factor_renewed();
            }
            let norm = residual.norm;
            let correction =
                self.correction(&mut iterate, residual, increment, follows_plane, &mut convergence, stats, watch)?;
            let whole = self.move_by(&mut iterate, &correction, increment, convergence.iteration > 0, norm)?;
            convergence.factor_is_stale |= !whole;
            convergence.was_cut = !whole;
            convergence.iteration += 1;
        }
    }

    /// Share of the contact area by which parts that were held should be off at most.
    fn area_error(&self) -> f64 {
        if self.surface.body().is_plane() { AREA_ERROR } else { AREA_ERROR_OF_CURVED }
    }

    /// The state of an iterate in equilibrium.
    fn committed(&self, iterate: Iterate, last: &ContactState) -> State {
        let positions = self.surface_positions(&iterate.at);
        let areas = iterate.held_areas.unwrap_or_else(|| self.surface.areas(last, &positions, &iterate.plane));
        let (contact, totals) = self.surface.commit(&self.friction, last, &areas, &positions, iterate.plane);
        State { configuration: iterate.at, contact, totals }
    }

    /// Solves the linear bulk with the contact subproblem on it.
    #[expect(clippy::too_many_arguments, reason = "a private step with all that it depends on")]
    fn correction(
        &mut self,
        iterate: &mut Iterate,
        residual: Residual,
        increment: &Increment,
        follows_plane: bool,
        convergence: &mut Convergence,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<Correction, SolveError> {
        self.complete_compliance(&iterate.at, increment.last, &iterate.plane);
        let first = self.body.dofs.first_contact_dof;
        // Only the imbalance goes through the factor, whose precision then limits no result.
        let mut work = residual.total;
        self.factor.forward(&mut work);
        let mut y = work[first..].to_vec();
        self.factor.contact_backward(&mut y);
        // Nodes far from the plane do not move in the contact subproblem.
        let (far, near) = y.split_at_mut(self.factor.compliant_from());
        far.fill(0.0);
        near.iter_mut().for_each(|v| *v = -*v);
        self.factor.add_compliance_times(&residual.contact, &mut y);
        if convergence.iteration == 0 {
            // Without contact forces the contact dofs would move by y.
            convergence.displacement_scale = y.iter().map(|y| y * y).sum::<f64>().sqrt();
        }
        let base = self.surface_positions(&iterate.at);
        let mut x = vec![0.0; y.len()];
        let predict = convergence.iteration == 0
            && self.predict(increment.last, &base, &iterate.plane, follows_plane, &mut x)
            && !follows_plane;
        let subproblem = ContactSubproblem {
            surface: &self.surface,
            friction: &self.friction,
            last: increment.last,
            factor: &self.factor,
            parts: Parts::Followed,
            base: &base,
            slots: &self.slots,
            held: &self.held,
            shift: &self.shift,
            y: &y,
            force_target: increment.force_target,
            tolerance: self.contact_tolerance(residual.norm, residual.reference, convergence),
            max_iterations: self.settings.max_contact_iterations,
        };
        let mut go_on = || go_on(watch, stats);
        let followed = iterate.held_areas.is_none();
        let mut kept = std::mem::take(&mut self.contact_factor);
        let solved = self.contact_solution(subproblem, x, iterate, predict, &mut kept, &mut go_on);
        self.contact_factor = kept;
        let (solution, iterations, solved) = solved?;
        convergence.holds_areas |= followed && iterate.held_areas.is_some();
        stats.iterations += 1;
        stats.contact_iterations += iterations as u32;
        let Solution { x, plane, mut force, norm, .. } = solution;
        convergence.contact_error = norm;
        convergence.unsolved = if solved { 0 } else { convergence.unsolved + 1 };
        convergence.displacement_scale = x.iter().zip(&y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt();
        for (force, at_start) in force.iter_mut().zip(&residual.contact) {
            *force -= at_start;
        }
        self.factor.contact_forward(&mut force);
        for (w, f) in work[first..].iter_mut().zip(&force) {
            *w += f;
        }
        self.factor.backward(&mut work);
        Ok(Correction { step: work, plane })
    }

    /// Solves the contact subproblem, with parts of the area that follow the positions unless they are held. If no
    /// solution is found so, the parts are held from then on. Also returns the total number of iterations and whether a
    /// solution was found.
    fn contact_solution(
        &self,
        subproblem: ContactSubproblem,
        x: Vec<f64>,
        iterate: &mut Iterate,
        predict: bool,
        kept: &mut KeptFactor,
        go_on: &mut dyn FnMut() -> Result<(), SolveError>,
    ) -> Result<(Solution, usize, bool), SolveError> {
        let (plane, most) = (iterate.plane, subproblem.max_iterations);
        let mut iterations = 0;
        if iterate.held_areas.is_none() {
            let most = most.min(FOLLOWED_ITERATIONS);
            let followed = ContactSubproblem { max_iterations: most, ..subproblem };
            let solution = followed.solve(x.clone(), plane, predict, kept, go_on)?;
            iterations = solution.iterations;
            if solution.norm <= followed.tolerance {
                return Ok((solution, iterations, true));
            }
            iterate.held_areas = Some(self.areas(iterate, subproblem.last));
        }
        let held = ContactSubproblem { parts: iterate.parts(), ..subproblem };
        let solution = held.solve(x, plane, predict, kept, go_on)?;
        let solved = solution.norm <= held.tolerance;
        iterations += solution.iterations;
        Ok((solution, iterations, solved))
    }

    /// Allowed error of the contact subproblem, mm.
    fn contact_tolerance(&self, norm: f64, reference: f64, convergence: &Convergence) -> f64 {
        let &Convergence { displacement_scale, contact_tolerance, .. } = convergence;
        (0.02 * self.settings.tolerance * displacement_scale)
            .min(CONTACT_ERROR * (self.settings.tolerance * reference).max(1e-3 * norm) / self.penalty_stiffness)
            .min(contact_tolerance)
            .max(CONTACT_ROUNDING * displacement_scale)
    }

    /// Moves by the correction, less while an element is inside out or, with `watch_growth`, the residual outgrows `norm`.
    ///
    /// Returns whether it was the whole correction.
    fn move_by(
        &self,
        iterate: &mut Iterate,
        correction: &Correction,
        increment: &Increment,
        watch_growth: bool,
        norm: f64,
    ) -> Result<bool, SolveError> {
        let mut scale = -1.0;
        let mut internal = std::mem::take(&mut iterate.internal);
        loop {
            let at = self.body.advance(&iterate.at, &correction.step, scale);
            let (from, to) = (&iterate.plane.at, &correction.plane.at);
            let plane = increment.last.plane.moved_to(std::array::from_fn(|k| from[k] - scale * (to[k] - from[k])));
            let failure = match self.internal_forces(&at, increment.damping, &mut internal) {
                Ok(()) => {
                    let trial = Iterate { at, plane, internal, held_areas: iterate.held_areas.take() };
                    let grows = watch_growth
                        && scale < -0.2
                        && self.residual(&trial, increment).norm > self.settings.growth * norm;
                    if !grows {
                        *iterate = trial;
                        return Ok(scale == -1.0);
                    }
                    internal = trial.internal;
                    iterate.held_areas = trial.held_areas;
                    None
                }
                Err(error) => Some(error),
            };
            scale *= 0.5;
            if let Some(error) = failure
                && scale > -0.05
            {
                return Err(error.into());
            }
        }
    }

    /// Parts of the contact area at an iterate.
    fn areas(&self, iterate: &Iterate, last: &ContactState) -> Vec<f64> {
        self.surface.areas(last, &self.surface_positions(&iterate.at), &iterate.plane)
    }

    /// The same at a guess, which need not follow the plane: with the nodes in contact moved to their previous places
    /// relative to it.
    fn areas_at_guess(&self, iterate: &Iterate, last: &ContactState) -> Vec<f64> {
        let mut positions = self.surface_positions(&iterate.at);
        let frame = self.surface.frame(&iterate.plane);
        let body = self.surface.body();
        let touching = last.nodes.iter().zip(&last.position).zip(&mut positions);
        for ((_, before), x) in touching.filter(|((node, _), _)| node.normal_force_n > 0.0) {
            let here = body.spot(&frame.to_plane(x));
            *x = frame.from_plane(&here.at_gap(body.spot(before).gap_mm));
        }
        self.surface.areas(last, &positions, &iterate.plane)
    }

    /// Guess of the contact dofs: nodes in contact follow the rigid body, along it only where the guess of the configuration does
    /// not follow it already. Nodes that slip do so too: their friction then starts from its last value, whichever way the
    /// path turns. On a curved body an extrapolation straight on would leave it, or penetrate far into it.
    ///
    /// Returns whether anything was in contact.
    fn predict(
        &self,
        last: &ContactState,
        base: &[Vector3<f64>],
        plane: &Plane,
        follows_plane: bool,
        x: &mut [f64],
    ) -> bool {
        let (frame, body) = (self.surface.frame(plane), self.surface.body());
        let mut touching = false;
        for (node, slots) in self.slots.iter().enumerate() {
            let before = &last.nodes[node];
            let touched = before.normal_force_n > 0.0;
            touching |= touched;
            // A node that hangs between others follows them.
            let &[(s, 1.0)] = slots.as_slice() else { continue };
            let here = body.spot(&frame.to_plane(&base[node]));
            let place = if !touched {
                // A node that did not touch before starts on the surface, without force, however deep the guess puts it.
                if here.gap_mm >= 0.0 {
                    continue;
                }
                here.point
            } else if !follows_plane {
                last.position[node]
            } else {
                here.at_gap(body.spot(&last.position[node]).gap_mm)
            };
            let step = frame.from_plane(&place) - base[node];
            for k in 0..3 {
                if !self.held[s + k] {
                    x[s + k] = step[k];
                }
            }
        }
        touching
    }
}

/// Share of the contact area by which parts that were held differ from those at equilibrium.
fn share_off(held: &[f64], now: &[f64]) -> f64 {
    let difference: f64 = held.iter().zip(now).map(|(a, b)| (a - b).abs()).sum();
    difference / now.iter().sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Calls `watch`, which may end the search.
pub(super) fn go_on(
    watch: &mut dyn FnMut(&Stats) -> std::ops::ControlFlow<()>,
    stats: &Stats,
) -> Result<(), SolveError> {
    if watch(stats).is_break() { Err(SolveError::Interrupted) } else { Ok(()) }
}
