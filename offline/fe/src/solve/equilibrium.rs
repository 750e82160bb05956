//! The search for one equilibrium: Newton's method with a bulk factor that is kept while it serves.
//!
//! Each iteration solves the contact subproblem exactly on the factor's compliance, moves the body, and judges by the
//! residual how well the factor still serves.

use nalgebra::Vector3;

use super::{
    Solver,
    contact_subproblem::{ContactSubproblem, Solution},
    increment::{Axis, Damping, Guess, SolveError, SolverSettings, State, Stats, Target, WRENCH_OF, Watch},
};
use crate::assembly::Configuration;
use crate::contact::{ContactState, Parts, Plane};

/// Residual over contact force after the first iteration above which the factor is renewed at once.
///
/// The first step moves the pad by as much as the plane, and its quadratic error stands in the bulk modulus, several
/// contact forces high; the next iteration takes it off whether the factor is fresh or not. Only more than that says
/// that the factor is bad.
const FIRST_RESIDUAL: f64 = 10.0;

/// Residual over the last one, with a new factor and near equilibrium, above which single precision is given up.
const SINGLE_CONTRACTION: f64 = 0.7;

/// Error of the contact problem over the way that contact pushes its dofs, below which there is rounding.
const CONTACT_ROUNDING: f64 = 8e-13;

/// Share of the residual's tolerance (or of a thousandth of the residual, if that is more) that the contact problem may
/// leave. Its error is a length; the penalty makes a force of it.
const CONTACT_ERROR: f64 = 0.1;

/// Residual over the last one above which what the contact problem left is taken for the cause, if it left anything.
const CONTACT_CONTRACTION: f64 = 0.5;

/// Residual over contact force below which the nodes' parts of the contact area follow the nodes within an iteration: farther
/// from equilibrium they are taken anew before each.
const FOLLOWED_RESIDUAL: f64 = 0.1;

/// Iterations after which the parts are held in a search in which they do not follow.
const AREA_ITERATIONS: u32 = 5;

/// Iterations of a contact subproblem after which the nodes' parts of the contact area follow the nodes no more: one on
/// the verge of opening could go on for ever.
const FOLLOWED_ITERATIONS: usize = 15;

/// Share of the contact area by which the parts that were held may be off at equilibrium.
const AREA_ERROR: f64 = 0.02;

/// How often parts that are off at equilibrium are taken anew before an increment is given up.
const AREA_RENEWALS: u32 = 4;

/// What is out of balance, N.
pub(super) struct Residual {
    /// All dofs.
    total: Vec<f64>,
    /// The contact's own part, contact dofs.
    contact: Vec<f64>,
    /// Norm of `total` and of the imbalance of driven forces.
    norm: f64,
    /// Contact force that `norm` is held against: the norm of `contact`, or the force floor.
    reference: f64,
}

/// Residual over the last one with a new factor above which the search is given up.
const DIVERGENCE: f64 = 4.0;

/// What one search for equilibrium is given.
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

/// Where the search stands.
struct Iterate {
    at: Configuration,
    plane: Plane,
    /// Internal forces at `at`, N.
    internal: Vec<f64>,
    /// Parts of the contact area where they are held, mm²; None where they follow the positions.
    held_areas: Option<Vec<f64>>,
}

impl Iterate {
    fn parts(&self) -> Parts<'_> {
        self.held_areas.as_deref().map_or(Parts::Followed, Parts::Held)
    }
}

/// How the search has gone so far, and what it says of the factor and of the contact subproblem.
struct Convergence {
    iteration: u32,
    /// Norms of the last two residuals, N; infinite where they say nothing of a rate.
    previous: f64,
    before: f64,
    /// Whether the factor is to be renewed.
    factor_is_stale: bool,
    /// Whether the last iteration had a new factor.
    factor_is_new: bool,
    /// Whether the residual grew much although the factor was new.
    diverges: bool,
    /// How far contact pushed its dofs in the last iteration, mm.
    displacement_scale: f64,
    /// Whether the last correction was not taken whole.
    was_cut: bool,
    /// Whether parts of the contact area are held for the rest of the search.
    holds_areas: bool,
    /// Contact subproblems, one after the other, that ended without a solution.
    unsolved: usize,
    /// What the contact subproblem may leave and what it left last, mm.
    contact_tolerance: f64,
    contact_error: f64,
}

impl Convergence {
    fn new() -> Self {
        Self {
            iteration: 0,
            previous: f64::INFINITY,
            before: f64::INFINITY,
            factor_is_stale: false,
            factor_is_new: false,
            diverges: false,
            displacement_scale: 0.0,
            was_cut: false,
            holds_areas: false,
            unsolved: 0,
            contact_tolerance: f64::INFINITY,
            contact_error: 0.0,
        }
    }

    /// Gives up a search that has taken too long or does not stay finite.
    fn check(&self, residual: &Residual, settings: &SolverSettings) -> Result<(), SolveError> {
        let gives_up = self.iteration as usize >= settings.max_iterations
            || self.unsolved >= settings.max_unsolved_contacts
            || !residual.norm.is_finite();
        if gives_up { Err(self.stalled(residual, settings)) } else { Ok(()) }
    }

    fn stalled(&self, residual: &Residual, settings: &SolverSettings) -> SolveError {
        SolveError::Stalled {
            iterations: self.iteration,
            residual: residual.norm / residual.reference,
            tolerance: settings.tolerance,
        }
    }

    /// Judges by the new residual whether the factor is stale and how exact contact must be solved; returns whether the
    /// factor is to turn to double precision.
    fn judge(&mut self, residual: &Residual, settings: &SolverSettings) -> bool {
        let Residual { norm, reference, .. } = *residual;
        let mut needs_double = false;
        if self.iteration > 1 {
            let contact_may_be_rough = norm > CONTACT_CONTRACTION * self.previous
                && self.unsolved == 0
                && self.contact_error > CONTACT_ROUNDING * self.displacement_scale;
            if contact_may_be_rough {
                self.contact_tolerance = 0.01 * self.contact_error;
            }
            let contraction = norm / self.previous;
            // Good and bad iterations alternate (a displacement of the soft modes leaves a residual of the stiff
            // ones, which the next iteration takes off), so that the rate is that of the last two.
            let rate = if self.before.is_finite() { (norm / self.before).sqrt() } else { contraction };
            // Iterations still needed at this rate, against what a new factor costs.
            let left = (settings.tolerance * reference / norm).ln() / rate.min(0.999).ln();
            if left > settings.refresh_cost_iterations {
                self.factor_is_stale = true;
            }
            needs_double = self.factor_is_new
                && contraction > SINGLE_CONTRACTION
                && norm < 0.01 * reference
                && !contact_may_be_rough;
            self.diverges = self.factor_is_new && contraction > DIVERGENCE;
        } else if self.iteration == 1 && norm > FIRST_RESIDUAL * reference {
            self.factor_is_stale = true;
        }
        self.factor_is_stale |= needs_double;
        // The guess hardly strains the stiff modes: its residual says nothing of a rate.
        self.before = if self.factor_is_new || self.iteration <= 1 { f64::INFINITY } else { self.previous };
        self.previous = norm;
        self.factor_is_new = false;
        needs_double
    }

    fn factor_renewed(&mut self) {
        self.factor_is_stale = false;
        self.factor_is_new = true;
    }
}

/// A correction of the configuration (dof order, to be subtracted) and the plane's new place.
struct Correction {
    step: Vec<f64>,
    plane: Plane,
}

impl Solver<'_> {
    /// The equilibrium of `increment`, sought from `guess`: with parts of the contact area that follow the nodes and, where
    /// none is found so, with parts that are held.
    pub(super) fn equilibrium(
        &mut self,
        increment: &Increment,
        guess: Guess,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<State, SolveError> {
        match self.search(increment, guess.clone(), true, stats, watch) {
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
        // A guess does not know yet what touches.
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
                if !iterate.held_areas.as_ref().is_some_and(|held| are_off(held, &areas)) {
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
                self.factor.use_double_precision();
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
        let first = self.body.dofs.first_contact_dof;
        // Only what is out of balance goes through the factor, whose precision then limits no result.
        let mut work = residual.total;
        self.factor.forward(&mut work);
        let mut y = work[first..].to_vec();
        self.factor.contact_backward(&mut y);
        for v in &mut y {
            *v = -*v;
        }
        self.factor.add_compliance_times(&residual.contact, &mut y);
        if convergence.iteration == 0 {
            // Without contact forces the contact dofs would move by y.
            convergence.displacement_scale = y.iter().map(|y| y * y).sum::<f64>().sqrt();
        }
        let base = self.surface_positions(&iterate.at);
        let mut x = vec![0.0; y.len()];
        let predict =
            convergence.iteration == 0 && !follows_plane && self.predict(increment.last, &base, &iterate.plane, &mut x);
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
        let (solution, iterations, solved) = self.contact_solution(subproblem, x, iterate, predict, &mut go_on)?;
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

    /// Solves the contact subproblem, with parts of the area that follow the positions unless they are held or no solution is
    /// found so, which has them held from here on. Also returns the iterations in all and whether a solution was found.
    fn contact_solution(
        &self,
        subproblem: ContactSubproblem,
        x: Vec<f64>,
        iterate: &mut Iterate,
        predict: bool,
        go_on: &mut dyn FnMut() -> Result<(), SolveError>,
    ) -> Result<(Solution, usize, bool), SolveError> {
        let (plane, most) = (iterate.plane, subproblem.max_iterations);
        let mut iterations = 0;
        if iterate.held_areas.is_none() {
            let most = most.min(FOLLOWED_ITERATIONS);
            let followed = ContactSubproblem { max_iterations: most, ..subproblem };
            let solution = followed.solve(x.clone(), plane, predict, go_on)?;
            iterations = solution.iterations;
            if iterations < most {
                return Ok((solution, iterations, true));
            }
            iterate.held_areas = Some(self.areas(iterate, subproblem.last));
        }
        let held = ContactSubproblem { parts: iterate.parts(), ..subproblem };
        let solution = held.solve(x, plane, predict, go_on)?;
        let solved = solution.iterations < most;
        iterations += solution.iterations;
        Ok((solution, iterations, solved))
    }

    /// What the contact subproblem may leave, mm.
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

    /// The same at a guess, which need not follow the plane: with the nodes in contact brought to where they stood over it.
    fn areas_at_guess(&self, iterate: &Iterate, last: &ContactState) -> Vec<f64> {
        let mut positions = self.surface_positions(&iterate.at);
        let frame = self.surface.frame(&iterate.plane);
        let touching = last.nodes.iter().zip(&last.position).zip(&mut positions);
        for ((_, before), x) in touching.filter(|((node, _), _)| node.normal_force_n > 0.0) {
            let here = frame.to_plane(x);
            *x = frame.from_plane(&Vector3::new(here.x, here.y, before.z));
        }
        self.surface.areas(last, &positions, &iterate.plane)
    }

    /// Guess of the contact dofs: nodes in contact follow the plane, along it only where they stick.
    ///
    /// Returns whether anything was in contact.
    fn predict(&self, last: &ContactState, base: &[Vector3<f64>], plane: &Plane, x: &mut [f64]) -> bool {
        let frame = self.surface.frame(plane);
        let mut touching = false;
        for (node, slots) in self.slots.iter().enumerate() {
            let before = &last.nodes[node];
            if !(before.normal_force_n > 0.0) {
                continue;
            }
            touching = true;
            // A node that hangs between others follows them.
            let &[(s, 1.0)] = slots.as_slice() else { continue };
            let mut place = last.position[node];
            if !before.stuck {
                let here = frame.to_plane(&base[node]);
                (place.x, place.y) = (here.x, here.y);
            }
            let step = frame.from_plane(&place) - base[node];
            for k in 0..3 {
                if !self.held[s + k] {
                    x[s + k] = step[k];
                }
            }
        }
        touching
    }

    fn residual(&self, iterate: &Iterate, increment: &Increment) -> Residual {
        let Iterate { at, plane, internal, .. } = iterate;
        let first = self.body.dofs.first_contact_dof;
        let positions = self.surface_positions(at);
        let parts = iterate.parts();
        let evaluation = self.surface.evaluate(&self.friction, increment.last, parts, &positions, plane, false, false);
        let mut contact = vec![0.0; internal.len() - first];
        for (f, slots) in evaluation.residual.iter().zip(&self.slots) {
            for &(s, weight) in slots {
                for k in (0..3).filter(|&k| !self.held[s + k]) {
                    contact[s + k] += weight * f[k];
                }
            }
        }
        let mut total = internal.clone();
        for (total, f) in total[first..].iter_mut().zip(&contact) {
            *total += f;
        }
        let mut sum: f64 = total.iter().map(|r| r * r).sum();
        for imbalance in imbalance(&evaluation.wrench, &increment.force_target, self.surface.size_mm()) {
            sum += imbalance * imbalance;
        }
        let contact_norm = contact.iter().map(|f| f * f).sum::<f64>().sqrt();
        Residual { total, contact, norm: sum.sqrt(), reference: contact_norm.max(self.settings.force_floor_n) }
    }
}

/// What driven forces and moments are off their targets, N; moments over `length_mm`.
pub(super) fn imbalance(wrench: &[f64; 6], target: &[Option<f64>; 6], length_mm: f64) -> [f64; 6] {
    std::array::from_fn(|k| {
        let component = WRENCH_OF[k];
        let length = if component < 3 { 1.0 } else { length_mm };
        target[k].map_or(0.0, |target| (wrench[component] - target) / length)
    })
}

/// Whether parts of the contact area that were held differ too much from those at equilibrium.
fn are_off(held: &[f64], now: &[f64]) -> bool {
    let difference: f64 = held.iter().zip(now).map(|(a, b)| (a - b).abs()).sum();
    difference > AREA_ERROR * now.iter().sum::<f64>()
}

/// Asks `watch` whether to go on.
pub(super) fn go_on(
    watch: &mut dyn FnMut(&Stats) -> std::ops::ControlFlow<()>,
    stats: &Stats,
) -> Result<(), SolveError> {
    if watch(stats).is_break() { Err(SolveError::Interrupted) } else { Ok(()) }
}
