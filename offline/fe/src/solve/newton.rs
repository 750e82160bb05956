//! One increment: from a state in equilibrium to the next for a given motion of the plane.

use nalgebra::Vector3;

use super::{
    increment::{Axis, Damping, Settings, SolveError, State, Stats, Target},
    inner::Inner,
    linear::Factor,
};
use crate::assembly::{Body, BodyError, Configuration};
use crate::contact::{ContactState, Friction, PenaltySettings, Plane, Surface, Totals};

/// Residual over contact force after the first iteration above which the factor is renewed at once.
///
/// The first step moves the pad by as much as the plane, and its quadratic error stands in the bulk modulus, several
/// contact forces high; the next iteration takes it off whether the factor is fresh or not. Only more than that says
/// that the factor is bad.
const FIRST_RESIDUAL: f64 = 10.0;

/// Residual over the last one, with a new factor and near equilibrium, above which single precision is given up.
const SINGLE_CONTRACTION: f64 = 0.7;

/// Error of the contact problem over the way that contact pushes its dofs, below which there is rounding.
const CONTACT_ROUNDING: f64 = 2e-12;

/// Share of the residual's tolerance (or of a thousandth of the residual, if that is more) that the contact problem may
/// leave. Its error is a length; the penalty makes a force of it.
const CONTACT_ERROR: f64 = 0.1;

/// Residual over the last one above which what the contact problem left is taken for the cause, if it left anything.
const CONTACT_CONTRACTION: f64 = 0.5;

/// What is out of balance, N.
struct Residual {
    /// All dofs.
    total: Vec<f64>,
    /// The contact's own part, contact dofs.
    contact: Vec<f64>,
    /// Norm of `total` and of the imbalance of driven forces.
    norm: f64,
    /// Norm of `contact`.
    contact_norm: f64,
}

/// Body, surface, law and the factor that they share from increment to increment.
pub struct Solver<'a> {
    pub(super) body: &'a Body,
    pub(super) surface: Surface,
    pub(super) friction: Friction,
    pub(super) penalty: PenaltySettings,
    pub(super) settings: Settings,
    pub(super) factor: Factor,
    pub(super) factor_is_set: bool,
    pub(super) slot: Vec<Option<usize>>,
    pub(super) held: Vec<bool>,
    pub(super) shift: Vec<f64>,
    pub(super) viscosity: Vec<f64>,
    pub(super) undeformed_stiffness: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// Force on a node per penetration where it touches, N/mm.
    pub(super) penalty_stiffness: f64,
}

impl<'a> Solver<'a> {
    /// Solver of `body` whose `faces` (mesh node numbers, counter-clockwise from outside) may touch the plane.
    pub fn new(
        body: &'a Body,
        faces: &[[u32; 4]],
        friction: Friction,
        penalty: PenaltySettings,
        settings: Settings,
    ) -> Self {
        let surface = Surface::new(faces, &penalty);
        let first = body.dofs.first_contact_dof;
        let slot = surface
            .nodes
            .iter()
            .map(|&node| body.dofs.node_dof(node).filter(|&dof| dof >= first).map(|dof| dof - first))
            .collect();
        let contact = body.dofs.count - first;
        let mut held = vec![false; contact];
        for &dof in &body.dofs.held {
            if dof >= first {
                held[dof - first] = true;
            }
        }
        let factor = Factor::analyse(&body.dofs.pattern, contact);
        let area: f64 = faces.iter().map(|face| face_area(face.map(|n| body.undeformed().x[n as usize]))).sum();
        let penalty_stiffness = penalty.penalty_mpa_per_mm * area / surface.nodes.len() as f64;
        Self {
            body,
            surface,
            friction,
            penalty,
            settings,
            factor,
            factor_is_set: false,
            slot,
            held,
            shift: vec![0.0; contact],
            viscosity: Vec::new(),
            undeformed_stiffness: Vec::new(),
            values: Vec::new(),
            penalty_stiffness,
        }
    }

    /// The surface with its faces.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The law in force.
    pub fn friction(&self) -> &Friction {
        &self.friction
    }

    /// Changes the law from here on; the elastic slip of contact points is kept.
    pub fn set_friction(&mut self, friction: Friction) {
        self.friction = friction;
    }

    /// Entries of the bulk factor.
    pub fn factor_entries(&self) -> usize {
        self.factor.entries()
    }

    /// The undeformed body before contact, the plane at `plane`.
    pub fn initial_state(&self, plane: Plane) -> State {
        let configuration = self.body.undeformed().clone();
        let contact = self.surface.initial_state(self.surface_positions(&configuration), plane);
        State { configuration, contact, totals: Totals::default() }
    }

    pub(super) fn surface_positions(&self, configuration: &Configuration) -> Vec<Vector3<f64>> {
        self.surface.nodes.iter().map(|&n| configuration.x[n as usize]).collect()
    }

    /// The next state, held back by viscous forces: not yet in equilibrium, on its way there.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn damped_step(
        &mut self,
        last: &State,
        target: Target,
        coefficient: f64,
        stats: &mut Stats,
    ) -> Result<State, SolveError> {
        let damping = Damping { coefficient, from: &last.configuration };
        let guess = last.configuration.clone();
        self.damping_diagonal();
        self.factor_is_set = false;
        let result = self.equilibrium(&last.contact, target, guess, last.contact.plane, false, Some(damping), stats);
        self.factor_is_set = false;
        result
    }

    /// Motion of the free nodes between two configurations, dof order; zero for the rigid body.
    fn motion(&self, to: &Configuration, from: &Configuration) -> Vec<f64> {
        let mut out = vec![0.0; self.body.dofs.count];
        for (node, (a, b)) in to.x.iter().zip(&from.x).enumerate() {
            if let Some(dof) = self.body.dofs.node_dof(node as u32) {
                for k in 0..3 {
                    out[dof + k] = a[k] - b[k];
                }
            }
        }
        out
    }

    fn internal_forces(
        &self,
        at: &Configuration,
        damping: Option<Damping>,
        out: &mut Vec<f64>,
    ) -> Result<(), BodyError> {
        self.body.residual(at, out)?;
        if let Some(damping) = damping {
            for ((out, du), k) in out.iter_mut().zip(self.motion(at, damping.from)).zip(&self.viscosity) {
                *out += damping.coefficient * k * du;
            }
        }
        Ok(())
    }

    /// The next state in equilibrium.
    ///
    /// * `guess`: where to start; its fixed nodes hold their prescribed positions.
    /// * `plane`: guess of the plane's place (matters for force-driven axes).
    /// * `guess_slides`: the guess already follows the plane's motion (extrapolation), so that the stick predictor
    ///   is not needed.
    ///
    /// # Errors
    /// [`SolveError`]; `last` is untouched and the increment can be tried again with a smaller step.
    pub fn step(
        &mut self,
        last: &State,
        target: Target,
        guess: Configuration,
        plane: Plane,
        guess_slides: bool,
        stats: &mut Stats,
    ) -> Result<State, SolveError> {
        let mut reference = last.contact.clone();
        let mut state = self.equilibrium(&reference, target, guess, plane, guess_slides, None, stats)?;
        if self.penalty.augment {
            for _ in 0..self.settings.max_augmentations {
                if state.totals.penetration <= self.penalty.penetration_tolerance_mm {
                    break;
                }
                self.surface.augment(&mut reference, &state.contact);
                let plane = state.contact.plane;
                state = self.equilibrium(&reference, target, state.configuration, plane, true, None, stats)?;
            }
        }
        Ok(state)
    }

    #[expect(clippy::too_many_arguments, reason = "a private step with all that it depends on")]
    fn equilibrium(
        &mut self,
        last: &ContactState,
        target: Target,
        guess: Configuration,
        plane: Plane,
        guess_slides: bool,
        damping: Option<Damping>,
        stats: &mut Stats,
    ) -> Result<State, SolveError> {
        let body = self.body;
        let first = body.dofs.first_contact_dof;
        let mut plane: Plane = std::array::from_fn(|k| match target[k] {
            Axis::Displacement(place) => place,
            Axis::Force(_) => plane[k],
        });
        let force_target = target.map(|axis| match axis {
            Axis::Displacement(_) => None,
            Axis::Force(force) => Some(force),
        });
        let mut at = guess;
        let mut internal = Vec::new();
        self.internal_forces(&at, damping, &mut internal)?;
        let (mut previous, mut before) = (f64::INFINITY, f64::INFINITY);
        let mut slow = 0;
        let mut fresh = false;
        let mut iteration = 0;
        let mut displacement_scale = 0.0f64;
        let mut unsolved = 0;
        // What the contact problem may leave and what it left last, mm.
        let (mut contact_tolerance, mut contact_error) = (f64::INFINITY, 0.0);
        loop {
            let Residual { total, contact, norm: residual, contact_norm } =
                self.residual(&at, &internal, last, plane, force_target);
            let reference = contact_norm.max(self.settings.force_floor_n);
            stats.residual = residual / reference;
            if residual <= self.settings.tolerance * reference {
                let (contact, totals) = self.surface.commit(&self.friction, last, &self.surface_positions(&at), plane);
                return Ok(State { configuration: at, contact, totals });
            }
            let gives_up =
                iteration as usize >= self.settings.max_iterations || unsolved >= self.settings.max_unsolved_contacts;
            if gives_up || !residual.is_finite() {
                return Err(SolveError::Stalled {
                    iterations: iteration,
                    residual: residual / reference,
                    tolerance: self.settings.tolerance,
                });
            }
            if iteration > 1 {
                let contact_may_be_rough = residual > CONTACT_CONTRACTION * previous
                    && unsolved == 0
                    && contact_error > CONTACT_ROUNDING * displacement_scale;
                if contact_may_be_rough {
                    contact_tolerance = 0.01 * contact_error;
                }
                let contraction = residual / previous;
                // Good and bad iterations alternate (a displacement of the soft modes leaves a residual of the stiff
                // ones, which the next iteration takes off), so that the rate is that of the last two.
                let rate = if before.is_finite() { (residual / before).sqrt() } else { contraction };
                // Iterations still needed at this rate, against what a new factor costs.
                let left = (self.settings.tolerance * reference / residual).ln() / rate.min(0.999).ln();
                if left > self.settings.refresh_cost_iterations {
                    slow = 2;
                }
                if fresh && contraction > SINGLE_CONTRACTION && residual < 0.01 * reference && !contact_may_be_rough {
                    self.factor.use_double_precision();
                    slow = 2;
                }
                if contraction > 4.0 && fresh {
                    return Err(SolveError::Stalled {
                        iterations: iteration,
                        residual: residual / reference,
                        tolerance: self.settings.tolerance,
                    });
                }
            } else if iteration == 1 && residual > FIRST_RESIDUAL * reference {
                slow = 2;
            }
            // The guess hardly strains the stiff modes: its residual says nothing of a rate.
            before = if fresh || iteration <= 1 { f64::INFINITY } else { previous };
            previous = residual;
            fresh = false;
            if !self.factor_is_set || slow >= 2 {
                self.refresh(&at, last, plane, damping, stats)?;
                slow = 0;
                fresh = true;
            }

            // Only what is out of balance goes through the factor, whose precision then limits no result.
            let mut work = total;
            self.factor.forward(&mut work);
            let mut y = work[first..].to_vec();
            self.factor.contact_backward(&mut y);
            for v in &mut y {
                *v = -*v;
            }
            self.factor.add_compliance_times(&contact, &mut y);
            let base = self.surface_positions(&at);
            let mut x = vec![0.0; y.len()];
            let mut predict = false;
            if iteration == 0 && !guess_slides {
                predict = self.predict(last, &base, plane, &mut x);
            }
            if iteration == 0 {
                // Without contact forces the contact dofs would move by y.
                displacement_scale = y.iter().map(|y| y * y).sum::<f64>().sqrt();
            }
            let inner = Inner {
                surface: &self.surface,
                friction: &self.friction,
                last,
                factor: &self.factor,
                base: &base,
                slot: &self.slot,
                held: &self.held,
                shift: &self.shift,
                y: &y,
                force_target,
                tolerance: (0.02 * self.settings.tolerance * displacement_scale)
                    .min(
                        CONTACT_ERROR * (self.settings.tolerance * reference).max(1e-3 * residual)
                            / self.penalty_stiffness,
                    )
                    .min(contact_tolerance)
                    .max(CONTACT_ROUNDING * displacement_scale),
                max_iterations: self.settings.max_contact_iterations,
            };
            let solution = inner.solve(x, plane, predict);
            stats.iterations += 1;
            stats.contact_iterations += solution.iterations as u32;
            contact_error = solution.norm;
            unsolved = if solution.iterations < self.settings.max_contact_iterations { 0 } else { unsolved + 1 };
            displacement_scale = solution.x.iter().zip(&y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt();
            let mut force = solution.force;
            for (force, at_start) in force.iter_mut().zip(&contact) {
                *force -= at_start;
            }
            self.factor.contact_forward(&mut force);
            for (w, f) in work[first..].iter_mut().zip(&force) {
                *w += f;
            }
            self.factor.backward(&mut work);

            // Shorten the step while an element is inside out or, once the contact is in balance, the residual grows.
            let mut scale = -1.0;
            let next = loop {
                let trial = body.advance(&at, &work, scale);
                let moved = std::array::from_fn(|k| plane[k] - scale * (solution.plane[k] - plane[k]));
                let failure = match self.internal_forces(&trial, damping, &mut internal) {
                    Ok(()) => {
                        let grows = iteration > 0
                            && scale < -0.2
                            && self.residual(&trial, &internal, last, moved, force_target).norm
                                > self.settings.growth * residual;
                        if !grows {
                            plane = moved;
                            break trial;
                        }
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
            };
            if scale > -1.0 {
                slow = 2;
            }
            at = next;
            iteration += 1;
        }
    }

    /// Guess of the contact dofs: points in contact follow the plane, along it only where they stick.
    ///
    /// Returns whether anything was in contact.
    fn predict(&self, last: &ContactState, base: &[Vector3<f64>], plane: Plane, x: &mut [f64]) -> bool {
        let per_face = self.surface.points_per_face();
        let mut touching = false;
        let mut sticks = vec![false; base.len()];
        let mut touches = vec![false; base.len()];
        for (f, face) in self.surface.faces.iter().enumerate() {
            let points = &last.points[f * per_face..(f + 1) * per_face];
            let in_contact = points.iter().filter(|p| p.pressure > 0.0).count();
            if in_contact == 0 {
                continue;
            }
            touching = true;
            let stuck = points.iter().filter(|p| p.stuck).count();
            for &n in face {
                touches[n] = true;
                sticks[n] |= 2 * stuck >= in_contact;
            }
        }
        for (n, slot) in self.slot.iter().enumerate() {
            let Some(s) = *slot else { continue };
            let from = last.position[n] - base[n];
            if touches[n] {
                x[s + 2] = from.z + plane[2] - last.plane[2];
                if sticks[n] {
                    x[s] = from.x + plane[0] - last.plane[0];
                    x[s + 1] = from.y + plane[1] - last.plane[1];
                }
            }
        }
        touching
    }

    fn residual(
        &self,
        at: &Configuration,
        internal: &[f64],
        last: &ContactState,
        plane: Plane,
        force_target: [Option<f64>; 3],
    ) -> Residual {
        let first = self.body.dofs.first_contact_dof;
        let evaluation = self.surface.evaluate(&self.friction, last, &self.surface_positions(at), plane, false, false);
        let mut contact = vec![0.0; internal.len() - first];
        for (f, slot) in evaluation.residual.iter().zip(&self.slot) {
            if let Some(s) = slot {
                for k in 0..3 {
                    if !self.held[s + k] {
                        contact[s + k] += f[k];
                    }
                }
            }
        }
        let mut total = internal.to_vec();
        for (total, f) in total[first..].iter_mut().zip(&contact) {
            *total += f;
        }
        let mut sum: f64 = total.iter().map(|r| r * r).sum();
        for k in 0..3 {
            if let Some(target) = force_target[k] {
                sum += (evaluation.force[k] - target).powi(2);
            }
        }
        let contact_norm = contact.iter().map(|f| f * f).sum::<f64>().sqrt();
        Residual { total, contact, norm: sum.sqrt(), contact_norm }
    }
}

/// Area of a quadrilateral, half the cross product of its diagonals.
fn face_area(corners: [Vector3<f64>; 4]) -> f64 {
    0.5 * (corners[2] - corners[0]).cross(&(corners[3] - corners[1])).norm()
}
