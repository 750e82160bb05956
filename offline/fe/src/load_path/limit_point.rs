//! Passing a limit point: viscous steps at a fixed target until equilibrium holds without them.

use crate::solve::{Axis, Guess, SolveError, Solver, State, Stats, Target, Watch};

/// Rule of the viscous steps past a limit point.
#[derive(Clone, Copy, Debug)]
pub struct LimitPointRule {
    /// Viscous steps before the passage is abandoned.
    pub max_steps: usize,
    /// Factor on the viscosity after a step that was found.
    pub release: f64,
    /// Factor on the viscosity after a step that was not found.
    pub hold: f64,
    /// Viscosity (share of the undeformed stiffness) above which the passage is abandoned.
    pub largest: f64,
    /// Largest energy gain of one step on a passage that no work accounts for, as a share of the plane's work; infinite
    /// where `as_last` of [`pass_limit_point`] makes another state, whose energy is not that of the step before.
    ///
    /// Viscous forces only dissipate. A step that gains energy is too long for them, and would end at the unstable
    /// equilibrium that the body has to leave.
    pub gained_share: f64,
}

/// Viscosity of the first step, share of the undeformed stiffness.
const FIRST_VISCOSITY: f64 = 1e-3;
/// Viscosity below which equilibrium is tried without it.
const FREE_BELOW: f64 = 1e-2;

/// Share of the plane's work in an increment that may be unaccounted for; beyond it the increment has jumped over a
/// limit point.
///
/// The error of the trapezoidal rule is a fifth of the work at a first touch (force with the power 1.5 of depth), and
/// most of the work in a snap.
const LOST_SHARE: f64 = 0.3;

/// Share of the stored energy below which a loss is rounding: an increment under a constant load does almost no work,
/// and its stored energy is the difference of two energies.
const ROUNDING_SHARE: f64 = 1e-12;

/// Refuses an increment with a force-driven coordinate that passed a limit point in one step: the body snaps there, and
/// the released energy would silently be missing from the sum of works.
///
/// # Errors
/// [`SolveError::LimitPoint`].
pub fn check_no_jump(solver: &Solver, from: &State, to: &State, target: &Target) -> Result<(), SolveError> {
    if target.0.iter().all(|axis| matches!(axis, Axis::Displacement(_))) {
        return Ok(());
    }
    let works_mj = plane_works_mj_between(solver, from, to);
    let (before_mj, after_mj) = (stored_mj(solver, from), stored_mj(solver, to));
    let taken_mj = to.totals.dissipation - to.totals.elastic_energy_by_pressure + after_mj - before_mj;
    let lost_mj = works_mj.iter().sum::<f64>() - taken_mj;
    let size_mj: f64 = works_mj.iter().map(|work| work.abs()).sum();
    let largest_mj = (LOST_SHARE * size_mj).max(ROUNDING_SHARE * before_mj.max(after_mj));
    if lost_mj > largest_mj { Err(SolveError::LimitPoint { lost_mj }) } else { Ok(()) }
}

/// Energy of the body and of the elastic slip, mJ.
fn stored_mj(solver: &Solver, state: &State) -> f64 {
    solver.energy_mj(&state.configuration) + state.totals.elastic_energy
}

/// An equilibrium beyond a limit point.
pub struct Passage {
    /// The equilibrium.
    pub state: State,
    /// Work of the plane during the passage, mJ.
    pub plane_work_mj: f64,
    /// Dissipated by slip during the passage, mJ.
    pub friction_work_mj: f64,
    /// Put into the elastic slip by changes of pressure and contact area during the passage, mJ.
    pub pressure_work_mj: f64,
    /// Work that neither the body stores nor friction dissipates, mJ: that of the viscous forces, the time
    /// integration's own included.
    pub viscous_work_mj: f64,
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
    let before_mj = stored_mj(solver, from);
    let mut passage = Passage {
        state: from.clone(),
        plane_work_mj: 0.0,
        friction_work_mj: 0.0,
        pressure_work_mj: 0.0,
        viscous_work_mj: 0.0,
    };
    let mut viscosity = FIRST_VISCOSITY;
    for _ in 0..rule.max_steps {
        let further = match solver.damped_step(&as_last(&passage.state), target, viscosity, stats, watch) {
            Ok(next) => passage.on(solver, next, before_mj, rule),
            Err(SolveError::Interrupted) => return Err(SolveError::Interrupted),
            Err(_) => None,
        };
        let Some(further) = further else {
            viscosity *= rule.hold;
            if viscosity > rule.largest {
                return Ok(None);
            }
            continue;
        };
        passage = further;
        viscosity *= rule.release;
        if viscosity < FREE_BELOW {
            let guess = Guess { follows_plane: true, ..Guess::at(&passage.state) };
            match solver.step(&as_last(&passage.state), target, guess, stats, watch) {
                Ok(next) => {
                    if let Some(end) = passage.on(solver, next, before_mj, rule) {
                        return Ok(Some(end));
                    }
                }
                Err(SolveError::Interrupted) => return Err(SolveError::Interrupted),
                Err(_) => {}
            }
        }
    }
    Ok(None)
}

impl Passage {
    /// The passage with one more step; `before_mj` was stored at its start. None if the step gains energy that no work
    /// accounts for.
    fn on(&self, solver: &Solver, next: State, before_mj: f64, rule: &LimitPointRule) -> Option<Self> {
        let plane_work_mj = self.plane_work_mj + plane_work_mj_between(solver, &self.state, &next);
        let friction_work_mj = self.friction_work_mj + next.totals.dissipation;
        let pressure_work_mj = self.pressure_work_mj + next.totals.elastic_energy_by_pressure;
        let stored_mj = stored_mj(solver, &next) - before_mj;
        let viscous_work_mj = plane_work_mj + pressure_work_mj - friction_work_mj - stored_mj;
        let adds = self.viscous_work_mj - viscous_work_mj > rule.gained_share * plane_work_mj.abs();
        (!adds).then_some(Self { state: next, plane_work_mj, friction_work_mj, pressure_work_mj, viscous_work_mj })
    }
}

/// Work of the plane on the finger between two states, mJ, by the trapezoidal rule.
pub(super) fn plane_work_mj_between(solver: &Solver, a: &State, b: &State) -> f64 {
    plane_works_mj_between(solver, a, b).iter().sum()
}

/// The same by coordinates.
fn plane_works_mj_between(solver: &Solver, a: &State, b: &State) -> [f64; 6] {
    let forces = |state: &State| solver.surface().generalised_forces(&state.contact.plane, &state.totals);
    let (at_a, at_b) = (forces(a), forces(b));
    std::array::from_fn(|k| 0.5 * (at_a[k] + at_b[k]) * (b.contact.plane.at[k] - a.contact.plane.at[k]))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::assembly::{Body, Joint, Material, Supports};
    use crate::contact::plane::DEPTH;
    use crate::contact::{Friction, PenaltySettings};
    use crate::material::Ogden;
    use crate::mesh::block::{block, coordinates};
    use crate::solve::{SolverSettings, unwatched};

    #[test]
    fn an_increment_under_a_force_whose_work_is_nowhere_is_refused_with_the_work() {
        let line = coordinates(-1.0, 1.0, 2, 1.0);
        let mesh = block(&line, &line, &coordinates(0.0, 1.0, 2, 1.0));
        let supports = Supports {
            fixed: mesh.node_set("z1").to_vec(),
            contact: mesh.node_set("z0").to_vec(),
            ..Default::default()
        };
        let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
        let body = Body::new(&mesh, |_| Some(soft), &supports, Vector3::zeros(), Joint::default()).unwrap();
        let penalty = PenaltySettings::default();
        let mut solver = Solver::new(&body, &mesh.pad_faces, Friction::Off, penalty, SolverSettings::default());
        let mut state = solver.initial_state([0.0; 3]);
        let mut before = state.clone();
        for step in 1..=6 {
            let target = Target::place([0.0, 0.0, 0.02 * f64::from(step), 0.0, 0.0, 0.0]);
            let guess = Guess { follows_plane: true, ..Guess::at(&state) };
            before = state;
            state = solver.step(&before, target, guess, &mut Stats::default(), &mut unwatched).unwrap();
        }
        let force_n = state.totals.force.z;
        assert!(force_n > 0.01, "{force_n} N");
        let mut under_force = Target::place(state.contact.plane.at);
        under_force.0[DEPTH] = Axis::Force(force_n);
        assert_eq!(check_no_jump(&solver, &before, &state, &under_force), Ok(()));

        // The plane falls on by 1 mm under the same force, and the body takes nothing of it.
        let mut fallen = state.clone();
        fallen.contact.plane.at[DEPTH] += 1.0;
        match check_no_jump(&solver, &state, &fallen, &under_force) {
            Err(SolveError::LimitPoint { lost_mj }) => {
                assert!((lost_mj - force_n).abs() < 1e-9 * force_n, "{lost_mj} mJ of {force_n} N times 1 mm");
            }
            other => panic!("{other:?}"),
        }
        // On unloading nothing is lost, and a plane with prescribed motion has no energy of its own to lose.
        assert_eq!(check_no_jump(&solver, &fallen, &state, &under_force), Ok(()));
        assert_eq!(check_no_jump(&solver, &state, &fallen, &Target::place(fallen.contact.plane.at)), Ok(()));
    }
}
