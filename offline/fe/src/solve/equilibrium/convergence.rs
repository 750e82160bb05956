//! Control of a search for equilibrium: when the factor is renewed, how exactly contact is solved, when the search ends
//! without a result.

use super::residual::Residual;
use crate::solve::increment::{SolveError, SolverSettings};

/// Residual over contact force after the first iteration above which it is no measure of a rate.
///
/// The first step moves the pad by as much as the plane. Its quadratic error is multiplied by the bulk modulus, on fine
/// meshes thousands of contact forces high. The next iteration removes it with a fresh factor or an old one, and a
/// factor made there serves no iteration after that one.
const FIRST_RESIDUAL: f64 = 10.0;

/// Assumed ratio of the residual over the last one with a kept factor whose quality is unknown.
const USUAL_RATE: f64 = 0.35;

/// Residual over the last one, with a new factor and near equilibrium, above which the factor changes to double
/// precision.
const SINGLE_CONTRACTION: f64 = 0.7;

/// Error of the contact problem over the displacement of its dofs by contact, below which it is rounding.
pub(super) const CONTACT_ROUNDING: f64 = 8e-13;

/// Residual over the last one above which the error of the contact problem, if there is one, is taken for the cause.
const CONTACT_CONTRACTION: f64 = 0.5;

/// Residual over contact force below which a search without progress continues: the factor may still change to double
/// precision.
const NEAR_EQUILIBRIUM: f64 = 1e-4;

/// Residual over the last one with a new factor above which the search is abandoned.
const DIVERGENCE: f64 = 4.0;

/// History of the search, with the resulting decisions on the factor and on the contact subproblem.
pub(super) struct Convergence {
    pub iteration: u32,
    /// Norms of the last two residuals, N; infinite if they are no measure of a rate.
    pub previous: f64,
    pub before: f64,
    /// Whether the factor is to be renewed.
    pub factor_is_stale: bool,
    /// Whether the last iteration had a new factor.
    pub factor_is_new: bool,
    /// Whether the residual grew much although the factor was new.
    pub diverges: bool,
    /// Displacement of the contact dofs in the last iteration, mm.
    pub displacement_scale: f64,
    /// Whether the last correction was not taken whole.
    pub was_cut: bool,
    /// Whether parts of the contact area are held for the rest of the search.
    pub holds_areas: bool,
    /// Contact subproblems, one after the other, that ended without a solution.
    pub unsolved: usize,
    /// Least residual so far, N, and the iterations since then.
    pub least: f64,
    pub idle: u32,
    /// Allowed and last error of the contact subproblem, mm.
    pub contact_tolerance: f64,
    pub contact_error: f64,
}

impl Convergence {
    pub fn new() -> Self {
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
            least: f64::INFINITY,
            idle: 0,
            contact_tolerance: f64::INFINITY,
            contact_error: 0.0,
        }
    }

    /// Ends a search that takes too long or is not finite.
    pub fn check(&mut self, residual: &Residual, settings: &SolverSettings) -> Result<(), SolveError> {
        let progresses = residual.norm < self.least || residual.norm < NEAR_EQUILIBRIUM * residual.reference;
        self.idle = if progresses { 0 } else { self.idle + 1 };
        self.least = self.least.min(residual.norm);
        let gives_up = self.iteration as usize >= settings.max_iterations
            || self.unsolved >= settings.max_unsolved_contacts
            || self.idle >= settings.max_idle_iterations
            || !residual.norm.is_finite();
        if gives_up { Err(self.stalled(residual, settings)) } else { Ok(()) }
    }

    pub fn stalled(&self, residual: &Residual, settings: &SolverSettings) -> SolveError {
        SolveError::Stalled {
            iterations: self.iteration,
            residual: residual.norm / residual.reference,
            tolerance: settings.tolerance,
        }
    }

    /// Judges by the new residual whether the factor is stale and how exact contact must be solved; returns whether the
    /// factor is to turn to double precision.
    pub fn judge(&mut self, residual: &Residual, settings: &SolverSettings) -> bool {
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
            // Good and bad iterations alternate (a displacement of the soft modes leaves a residual of the stiff ones,
            // which the next iteration removes), so that the rate is that of the last two.
            let rate = match (self.before.is_finite(), self.previous.is_finite()) {
                (true, _) => (norm / self.before).sqrt(),
                (false, true) => contraction,
                (false, false) => USUAL_RATE,
            };
            // Iterations still needed at this rate, against the cost of a new factor.
            let left = (settings.tolerance * reference / norm).ln() / rate.min(0.999).ln();
            if left > settings.refresh_cost_iterations {
                self.factor_is_stale = true;
            }
            needs_double = self.factor_is_new
                && contraction > SINGLE_CONTRACTION
                && norm < 0.01 * reference
                && !contact_may_be_rough;
            self.diverges = self.factor_is_new && contraction > DIVERGENCE;
        }
        self.factor_is_stale |= needs_double;
        // The guess hardly strains the stiff modes: its residual is no measure of a rate.
        self.before = if self.factor_is_new || self.iteration <= 1 { f64::INFINITY } else { self.previous };
        let is_no_measure = self.iteration == 1 && norm > FIRST_RESIDUAL * reference;
        self.previous = if is_no_measure { f64::INFINITY } else { norm };
        self.factor_is_new = false;
        needs_double
    }

    pub fn factor_renewed(&mut self) {
        self.factor_is_stale = false;
        self.factor_is_new = true;
    }
}
