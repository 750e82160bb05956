//! Steady full slip at one depth, solved for directly.
//!
//! A rate-independent finger that has slid far enough no longer deforms: every contact point slips along the plane's
//! motion and carries its strength. That state depends on depth and law alone, not on the path to it, so it is solved
//! for directly: the elastic slip of every contact point is set far beyond its limit along +x, and the return map then
//! yields the strength along +x for any increment.

use nalgebra::{Rotation3, Vector3};

use super::{
    IdentifyError,
    history::{History, distance},
};
use fingerpad_fe::assembly::Configuration;
use fingerpad_fe::contact::plane::DEPTH;
use fingerpad_fe::contact::{Friction, FrictionLaw, PenaltySettings, Plane, RubberFriction};
use fingerpad_fe::load_path::{
    BESIDE_PAD_MM, FailedStep, LimitPointRule, LoadSteps, Model, Problem, Standing, StepRule, below_beside_pad_mm,
    load_along, pass_limit_point,
};
use fingerpad_fe::solve::{Axis, Guess, SolveError, Solver, SolverSettings, State, Stats, Target};
use std::ops::ControlFlow;

/// Elastic slip of every contact point before the return map, mm: its direction is then +x within 1e-8.
const SATURATED_MM: f64 = 1e9;
/// Step sizes; a size of 1 is the whole move.
const STEPS: StepRule =
    StepRule { easy_iterations: 7, after_hard: 0.7, cut: 0.5, limit_point_below: 1.0 / 20.0, after_limit_point: 0.1 };
/// How a limit point is passed.
const LIMIT_POINT: LimitPointRule =
    LimitPointRule { max_steps: 12, release: 0.4, hold: 10.0, largest: 1e2, gained_share: f64::INFINITY };
/// Equilibrium iterations after which a move is abandoned; a successful move takes ten to fifty.
const MOST_MOVE_ITERATIONS: u32 = 200;
/// The same of a move to a place that may be left out.
const FEW_MOVE_ITERATIONS: u32 = 40;
/// Equilibrium iterations without progress after which a step is abandoned: a smaller one is cheaper.
const IDLE_ITERATIONS: u32 = 8;

/// Response of a steady slide at one depth.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Steady {
    /// Travel of the plane from first touch, mm.
    pub depth_mm: f64,
    /// Normal force, N.
    pub normal_force_n: f64,
    /// Friction along x, the plane's motion, N.
    pub friction_x_n: f64,
    /// Contact area, mm².
    pub contact_area_mm2: f64,
    /// Largest penetration, mm.
    pub penetration_mm: f64,
    /// Pressure (MPa) and area (mm²) of every contact point.
    pub pressure: Vec<[f64; 2]>,
}

impl Steady {
    /// F/N; NaN without contact.
    pub fn friction_coefficient(&self) -> f64 {
        self.friction_x_n / self.normal_force_n
    }

    /// Integral of `law` over this state's pressure, N.
    pub fn friction_limit_n(&self, law: &RubberFriction) -> f64 {
        self.pressure.iter().map(|&[p, area]| law.strength(p).0 * area).sum()
    }
}

/// Place of a requested steady state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Law; `lambda = 0` and `tau0_mpa = 0` is a press without friction.
    pub law: RubberFriction,
}

/// Treatment of a limit point within a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limits {
    /// Ends without a result, and early, if the move is difficult.
    Shun,
    /// Ends without a result.
    Stop,
    /// Steps over one by viscous steps.
    Pass,
}

/// Cost of a computation.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Effort {
    /// Equilibria found.
    pub solves: u32,
    /// Equilibria that failed and were tried with a smaller step.
    pub cutbacks: u32,
    /// Equilibrium iterations.
    pub iterations: u32,
    /// Factorisations of the bulk stiffness.
    pub factorisations: u32,
}

impl Effort {
    /// Adds another's.
    pub fn add(&mut self, other: &Self) {
        self.solves += other.solves;
        self.cutbacks += other.cutbacks;
        self.iterations += other.iterations;
        self.factorisations += other.factorisations;
    }

    /// The difference from `before`.
    pub fn since(&self, before: &Self) -> Self {
        Self {
            solves: self.solves - before.solves,
            cutbacks: self.cutbacks - before.cutbacks,
            iterations: self.iterations - before.iterations,
            factorisations: self.factorisations - before.factorisations,
        }
    }
}

/// A finger on the plane that moves from one steady state to the next.
pub struct Slider<'a> {
    model: Model<'a>,
    /// Nodes of the skin's outside that the plane must not reach.
    beside_pad: &'a [u32],
    solver: Solver<'a>,
    state: State,
    at: Place,
    history: History,
    max_depth_step_mm: f64,
    go_on: &'a (dyn Fn() -> bool + Sync),
    /// Cost so far.
    pub effort: Effort,
}

/// A state to go on from, on this finger or on one of another shape whose mesh has as many nodes.
#[derive(Clone)]
pub struct Start {
    displacement_mm: Vec<Vector3<f64>>,
    rigid_shift_mm: Vector3<f64>,
    rigid_rotation: Rotation3<f64>,
    at: Place,
}

impl Start {
    /// Its depth, mm.
    pub fn depth_mm(&self) -> f64 {
        self.at.depth_mm
    }
}

impl<'a> Slider<'a> {
    /// A finger before contact.
    ///
    /// Its contact is by penalty alone, so that a state depends on its place only and not on the path to it.
    ///
    /// * `tolerance`: residual over contact force
    /// * `go_on`: false stops a move with [`IdentifyError::Interrupted`]
    pub fn new(problem: &Problem<'a>, tolerance: f64, go_on: &'a (dyn Fn() -> bool + Sync)) -> Self {
        let law = RubberFriction { lambda: 0.0, tau0_mpa: 0.0, ..problem.friction.unwrap_or_default() };
        let penalty = PenaltySettings { augment: false, ..problem.penalty };
        // A step that needs more than this is cheaper in two.
        let settings = SolverSettings {
            tolerance,
            max_iterations: 25,
            max_contact_iterations: 25,
            max_unsolved_contacts: 3,
            max_idle_iterations: IDLE_ITERATIONS,
            ..problem.settings
        };
        let model = problem.symmetric_model();
        let mut solver = Solver::new(model.body, model.pad_faces, Friction::On(law), penalty, settings);
        solver.set_rigid_body(problem.rigid_body.clone(), problem.outline.clone(), &Plane::default());
        let state = solver.initial_state([0.0; 3]);
        Self {
            model,
            beside_pad: problem.beside_pad,
            solver,
            state,
            at: Place { depth_mm: 0.0, law },
            history: History::default(),
            max_depth_step_mm: problem.load_steps.max_depth_step_mm,
            go_on,
            effort: Effort::default(),
        }
    }

    /// The state now.
    pub fn start(&self) -> Start {
        let (now, before) = (&self.state.configuration, self.model.body.undeformed());
        Start {
            displacement_mm: now.x.iter().zip(&before.x).map(|(x, x0)| x - x0).collect(),
            rigid_shift_mm: now.rigid_centre - before.rigid_centre,
            rigid_rotation: now.rigid_rotation,
            at: self.at,
        }
    }

    /// Continues from `start`; false, and nothing changed, if its mesh is another one.
    ///
    /// On another shape this is a guess that the next move brings into equilibrium.
    pub fn restart(&mut self, start: &Start) -> bool {
        let before = self.model.body.undeformed();
        if before.x.len() != start.displacement_mm.len() {
            return false;
        }
        let mut configuration = Configuration {
            x: before.x.iter().zip(&start.displacement_mm).map(|(x0, u)| x0 + u).collect(),
            rigid_centre: before.rigid_centre + start.rigid_shift_mm,
            rigid_rotation: start.rigid_rotation,
        };
        self.model.body.follow(&mut configuration);
        self.stand(start.at, configuration);
        true
    }

    /// Puts the finger into a configuration of a place.
    fn stand(&mut self, at: Place, configuration: Configuration) {
        self.state = self.solver.guessed_state(configuration, [0.0, 0.0, at.depth_mm]);
        self.at = at;
    }

    /// Takes the finger off the plane.
    pub fn lift(&mut self) {
        self.state = self.solver.initial_state([0.0; 3]);
        let law = RubberFriction { lambda: 0.0, tau0_mpa: 0.0, ..self.at.law };
        self.at = Place { depth_mm: 0.0, law };
    }

    /// Brings the state to equilibrium at `to`, in as few steps as converge.
    ///
    /// # Errors
    /// [`IdentifyError::Steady`] with the failure of the smallest step, [`IdentifyError::BesidePad`] or
    /// [`IdentifyError::Interrupted`]; the slider is then unchanged.
    pub fn go(&mut self, to: Place, limits: Limits) -> Result<Steady, IdentifyError> {
        if to != self.at || self.state.totals.force.z == 0.0 {
            let start = self.start();
            // From the nearest state, which need not be the last one.
            let wanted = self.coordinates(&to);
            if let Some((place, configuration, far)) = self.history.nearest(&wanted)
                && limits != Limits::Pass
                && far < 0.7 * distance(&self.coordinates(&self.at), &wanted)
            {
                self.stand(place, configuration);
            }
            if let Err(error) = self.move_to(to, limits) {
                self.restart(&start);
                return Err(error);
            }
            let below_mm = below_beside_pad_mm(self.beside_pad, &self.model, self.solver.surface(), &self.state);
            if below_mm > BESIDE_PAD_MM {
                self.restart(&start);
                return Err(IdentifyError::BesidePad { depth_mm: to.depth_mm, below_mm });
            }
        }
        Ok(self.steady())
    }

    fn move_to(&mut self, to: Place, limits: Limits) -> Result<(), IdentifyError> {
        let from = self.at;
        let size = self.first_share(&from, &to);
        let passages_left = u32::from(limits == Limits::Pass);
        let most_iterations = if limits == Limits::Shun { FEW_MOVE_ITERATIONS } else { MOST_MOVE_ITERATIONS };
        let mut moving = Move { slider: self, from, to, iterations: 0, most_iterations, passages_left, failed: false };
        load_along(&mut moving, &STEPS, 1.0, Standing { done: 0.0, size }).map(|_| ())
    }

    /// Solves, with many calls that may end it; adds the effort.
    fn solve<T>(
        &mut self,
        search: impl FnOnce(
            &mut Solver<'a>,
            &State,
            &mut Stats,
            &mut dyn FnMut(&Stats) -> ControlFlow<()>,
        ) -> Result<T, SolveError>,
    ) -> (Result<T, SolveError>, u32) {
        let mut stats = Stats::default();
        let go_on = self.go_on;
        let mut watch = |_: &Stats| if go_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
        let result = search(&mut self.solver, &self.state, &mut stats, &mut watch);
        self.effort.iterations += stats.iterations;
        self.effort.factorisations += stats.factorisations;
        (result, stats.iterations)
    }

    /// Takes up an equilibrium found at a place.
    fn take(&mut self, at: Place, state: State) {
        self.effort.solves += 1;
        self.state = state;
        self.at = at;
        self.history.keep(self.coordinates(&at), at, &self.state.configuration);
    }

    /// A place in steps that are likely to converge.
    fn coordinates(&self, place: &Place) -> [f64; 3] {
        let strength = place.law.strength(MIDDLE_MPA).0;
        // A strength step of 1.5 kPa shears the pulp by some tenths of a millimetre.
        [place.depth_mm / self.max_depth_step_mm, strength / 0.0015, place.law.beta * strength / 0.003]
    }

    /// First share of a move that is likely to converge.
    fn first_share(&self, from: &Place, to: &Place) -> f64 {
        let [a, b] = [from, to].map(|place| self.coordinates(place));
        let far: f64 = (0..3).map(|k| (b[k] - a[k]).abs()).sum();
        // Between states that are known a prediction reaches farther than the last state.
        1.0 / far.min(2.0 * self.history.distance(&b)).max(1.0)
    }

    fn steady(&self) -> Steady {
        let State { contact, totals, .. } = &self.state;
        let copies = self.model.copies();
        let nodes = contact.nodes.iter().filter(|n| n.area > 0.0);
        Steady {
            depth_mm: contact.plane.at[DEPTH],
            normal_force_n: copies * totals.force.z,
            friction_x_n: copies * totals.force.x,
            contact_area_mm2: copies * totals.area,
            penetration_mm: totals.penetration,
            pressure: nodes.map(|n| [n.pressure_mpa(), copies * n.area]).collect(),
        }
    }
}

/// A move from one place to another.
struct Move<'s, 'a> {
    slider: &'s mut Slider<'a>,
    from: Place,
    to: Place,
    /// Equilibrium iterations of the move so far.
    iterations: u32,
    /// Iterations after which a failure ends the move.
    most_iterations: u32,
    /// Limit points that may still be passed.
    passages_left: u32,
    /// Whether the last step failed.
    failed: bool,
}

impl Move<'_, '_> {
    fn place(&self, share: f64) -> Place {
        if share == 1.0 { self.to } else { between(&self.from, &self.to, share) }
    }
}

/// The plane at a place.
fn target(place: &Place) -> Target {
    [Axis::Displacement(0.0), Axis::Displacement(0.0), Axis::Displacement(place.depth_mm)].into()
}

impl LoadSteps for Move<'_, '_> {
    type Error = IdentifyError;

    fn try_step(&mut self, share: f64, _: f64) -> Result<u32, SolveError> {
        let place = self.place(share);
        let slider = &mut *self.slider;
        let prediction =
            slider.history.predict(slider.model.body, &slider.coordinates(&place)).filter(|_| !self.failed);
        let (configuration, led) = prediction.unwrap_or_else(|| (slider.state.configuration.clone(), false));
        let follows_plane = led || place.depth_mm == slider.at.depth_mm;
        let guess = Guess { configuration, plane: [0.0, 0.0, place.depth_mm].into(), follows_plane };
        slider.solver.set_friction(Friction::On(place.law));
        let (result, iterations) = slider
            .solve(|solver, state, stats, watch| solver.step(&saturated(state), target(&place), guess, stats, watch));
        self.iterations += iterations;
        slider.take(place, result?);
        self.failed = false;
        Ok(iterations)
    }

    fn failed(&mut self, _: f64, error: &SolveError) -> Result<(), IdentifyError> {
        if *error == SolveError::Interrupted {
            return Err(IdentifyError::Interrupted);
        }
        self.slider.effort.cutbacks += 1;
        self.failed = true;
        Ok(())
    }

    fn exceeds_iteration_budget(&self) -> bool {
        self.iterations > self.most_iterations
    }

    fn pass_limit_point(&mut self, share: f64) -> Result<bool, IdentifyError> {
        if self.exceeds_iteration_budget() || self.passages_left == 0 {
            return Ok(false);
        }
        self.passages_left -= 1;
        let place = self.place(share);
        let (result, _) = self.slider.solve(|solver, state, stats, watch| {
            pass_limit_point(solver, state, target(&place), &LIMIT_POINT, &saturated, stats, watch)
        });
        let Ok(passage) = result else { return Err(IdentifyError::Interrupted) };
        let Some(passage) = passage else { return Ok(false) };
        // The history before the limit point belongs to another branch.
        self.slider.history.clear();
        self.slider.take(place, passage.state);
        Ok(true)
    }

    fn give_up(&mut self, step: FailedStep) -> Result<(), IdentifyError> {
        if !step.at_limit_point {
            return Ok(());
        }
        let Place { depth_mm, law } = self.place(step.share);
        Err(IdentifyError::Steady { depth_mm, law, cause: step.error })
    }

    fn accepted(&mut self, _: Standing) -> Result<(), IdentifyError> {
        Ok(())
    }
}

/// The state with the elastic slip of every contact node far beyond its limit.
fn saturated(state: &State) -> State {
    let mut state = state.clone();
    for node in &mut state.contact.nodes {
        node.elastic_slip = Vector3::new(SATURATED_MM, 0.0, 0.0);
        node.multiplier = 0.0;
    }
    state
}

/// Pressure at which laws are compared, MPa.
const MIDDLE_MPA: f64 = 0.004;

/// The place at `share` of the move: depth and strengths at two pressures are linear in it, so that no law within the
/// move is stronger than both ends.
fn between(from: &Place, to: &Place, share: f64) -> Place {
    let mix = |a: f64, b: f64| a + share * (b - a);
    let at = |law: &RubberFriction| law.lambda * MIDDLE_MPA.powf(law.beta);
    let beta = if at(&from.law) == 0.0 { to.law.beta } else { mix(from.law.beta, to.law.beta) };
    let lambda = mix(at(&from.law), at(&to.law)) / MIDDLE_MPA.powf(beta);
    let tau0_mpa = mix(from.law.tau0_mpa, to.law.tau0_mpa);
    Place { depth_mm: mix(from.depth_mm, to.depth_mm), law: RubberFriction { lambda, beta, tau0_mpa, ..to.law } }
}
