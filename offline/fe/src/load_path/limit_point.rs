//! Passing a limit point: viscous steps at a fixed target until equilibrium holds without them.

use crate::solve::{Guess, SolveError, Solver, State, Stats, Target, Watch};

/// How viscous steps are taken past a limit point.
#[derive(Clone, Copy, Debug)]
pub struct LimitPointRule {
    /// Viscous steps before the passage is given up.
    pub max_steps: usize,
    /// Factor on the viscosity after a step that was found.
    pub release: f64,
    /// Factor on the viscosity after a step that was not found.
    pub hold: f64,
    /// Viscosity (share of the undeformed stiffness) above which the passage is given up.
    pub largest: f64,
}

/// Viscosity of the first step, share of the undeformed stiffness.
const FIRST_VISCOSITY: f64 = 1e-3;
/// Viscosity below which equilibrium is tried without it.
const FREE_BELOW: f64 = 1e-2;

/// An equilibrium beyond a limit point.
pub struct Passage {
    /// The equilibrium.
    pub state: State,
    /// Work of the plane on the way, mJ.
    pub plane_work_mj: f64,
    /// Dissipated by slip on the way, mJ.
    pub friction_work_mj: f64,
    /// Put into the elastic slip by changes of pressure and contact area on the way, mJ.
    pub pressure_work_mj: f64,
}

/// Steps from `from`, which lies before a limit point, to an equilibrium at `target`; None if none is found.
///
/// `as_last` turns a state into the one that the next step starts from.
///
/// # Errors
/// [`SolveError::Interrupted`].
pub fn pass_limit_point(
    solver: &mut Solver,
    from: &State,
    target: Target,
    rule: &LimitPointRule,
    as_last: &dyn Fn(&State) -> State,
    stats: &mut Stats,
    watch: Watch,
) -> Result<Option<Passage>, SolveError> {
    let (mut state, mut friction_work_mj, mut plane_work_mj, mut pressure_work_mj) = (from.clone(), 0.0, 0.0, 0.0);
    let mut viscosity = FIRST_VISCOSITY;
    for _ in 0..rule.max_steps {
        match solver.damped_step(&as_last(&state), target, viscosity, stats, watch) {
            Ok(next) => {
                friction_work_mj += next.totals.dissipation;
                pressure_work_mj += next.totals.elastic_energy_by_pressure;
                plane_work_mj += plane_work_mj_between(solver, &state, &next);
                state = next;
                viscosity *= rule.release;
            }
            Err(SolveError::Interrupted) => return Err(SolveError::Interrupted),
            Err(_) => viscosity *= rule.hold,
        }
        if viscosity > rule.largest {
            return Ok(None);
        }
        if viscosity < FREE_BELOW {
            let guess = Guess { follows_plane: true, ..Guess::at(&state) };
            match solver.step(&as_last(&state), target, guess, stats, watch) {
                Ok(next) => {
                    friction_work_mj += next.totals.dissipation;
                    pressure_work_mj += next.totals.elastic_energy_by_pressure;
                    plane_work_mj += plane_work_mj_between(solver, &state, &next);
                    return Ok(Some(Passage { state: next, plane_work_mj, friction_work_mj, pressure_work_mj }));
                }
                Err(SolveError::Interrupted) => return Err(SolveError::Interrupted),
                Err(_) => {}
            }
        }
    }
    Ok(None)
}

/// Work of the plane on the finger between two states, mJ, by the trapezoidal rule.
pub(super) fn plane_work_mj_between(solver: &Solver, a: &State, b: &State) -> f64 {
    let forces = |state: &State| solver.surface().generalised_forces(&state.contact.plane, &state.totals);
    let (at_a, at_b) = (forces(a), forces(b));
    (0..6).map(|k| 0.5 * (at_a[k] + at_b[k]) * (b.contact.plane.at[k] - a.contact.plane.at[k])).sum()
}
