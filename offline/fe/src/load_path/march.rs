//! Load steps along a path: adaptive increments, cut back and tried again where equilibrium is not found.

use std::ops::ControlFlow;

use cpu_time::ThreadTime;
use fingerpad::{Regime, Status};
use nalgebra::{Rotation3, Vector3};

use super::{Cost, Drive, FaceState, Path, Response, Snapshot, Trajectory, Waypoint};
use crate::assembly::{Body, Configuration, rotation_vector};
use crate::contact::{Friction, FrictionLaw, PenaltySettings, Plane, RubberFriction};
use crate::solve::{Axis, Settings, SolveError, Solver, State, Stats, Target};

/// Sizes of the increments.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MarchSettings {
    /// Largest increment of depth without friction, mm.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_depth_step_mm: f64,
    /// Largest increment of depth while friction acts, mm: the shear that a press leaves behind is of first order in it.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_depth_step_with_friction_mm: f64,
    /// Largest increment of slide, mm.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_slide_step_mm: f64,
    /// Largest increment of a driven force, N.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_force_step_n: f64,
    /// An increment is not cut below this share of the largest.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub min_step_share: f64,
    /// Whether friction acts from the first touch on, or only from the first row of the path that slides.
    pub friction_while_pressing: bool,
}

impl Default for MarchSettings {
    fn default() -> Self {
        Self {
            max_depth_step_mm: 0.25,
            max_depth_step_with_friction_mm: 0.08,
            max_slide_step_mm: 0.2,
            max_force_step_n: 0.1,
            min_step_share: 1e-4,
            friction_while_pressing: true,
        }
    }
}

/// Everything that a run needs besides body and path.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The body.
    pub body: &'a Body,
    /// Faces that may touch the plane, as mesh node numbers.
    pub pad_faces: &'a [[u32; 4]],
    /// Friction law; None presses and slides without friction.
    pub friction: Option<RubberFriction>,
    /// Contact.
    pub penalty: PenaltySettings,
    /// Equilibrium.
    pub settings: Settings,
    /// Increments.
    pub march: MarchSettings,
}

/// How far a run has come, told after every increment.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Done share of the path, 0 to 1, by length.
    pub share: f64,
    /// Cost so far.
    pub cost: Cost,
    /// Last response.
    pub response: Response,
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum MarchError {
    /// The path cannot be followed.
    #[error("path: {0}")]
    Path(String),
    /// An increment failed however small.
    #[error(
        "no equilibrium beyond t = {t_s} s (depth {depth_mm:.4} mm, slide {slide_x_mm:.4}, {slide_y_mm:.4} mm, row {row}): \
         increment {increment} of {step_share:.1e} of the largest step failed: {source}"
    )]
    Stuck {
        /// Time of the last equilibrium, s.
        t_s: f64,
        /// Depth there, mm.
        depth_mm: f64,
        /// Slide there, mm.
        slide_x_mm: f64,
        /// Slide there, mm.
        slide_y_mm: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Number of the increment.
        increment: u32,
        /// Size of the last attempt.
        step_share: f64,
        /// The last failure.
        source: SolveError,
        /// What was reached.
        reached: Box<Trajectory>,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted {
        /// What was reached.
        reached: Box<Trajectory>,
    },
}

/// Follows `path` and records a response at every increment and a snapshot at the rows listed in `snapshots`.
///
/// `progress` is called after every increment and may break.
///
/// # Errors
/// [`MarchError`], with what was reached.
pub fn march(
    problem: &Problem,
    path: &Path,
    snapshots: &[usize],
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Trajectory, MarchError> {
    let mut runner = Runner::new(problem, path)?;
    runner.record();
    if snapshots.contains(&0) {
        runner.snapshot();
    }
    for row in 1..path.waypoints.len() {
        runner.segment(row, progress)?;
        if snapshots.contains(&row) {
            runner.snapshot();
        }
    }
    Ok(runner.trajectory)
}

/// Follows `path` with a friction law that changes along it: `law_at` gives that of a time, s. Friction acts from the
/// first touch on.
///
/// # Errors
/// As [`march`].
pub fn march_with_law(
    problem: &Problem,
    path: &Path,
    law_at: &dyn Fn(f64) -> RubberFriction,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Trajectory, MarchError> {
    let mut runner = Runner::new(problem, path)?;
    runner.law_at = Some(law_at);
    runner.record();
    for row in 1..path.waypoints.len() {
        runner.segment(row, progress)?;
    }
    Ok(runner.trajectory)
}

/// What a frictionless press says of friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PressLimit {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Normal force, N.
    pub normal_force_n: f64,
    /// Contact area, mm².
    pub contact_area_mm2: f64,
    /// Integral of the friction law over the frictionless pressure, N.
    pub friction_limit_n: f64,
    /// Largest penetration, mm.
    pub penetration_mm: f64,
}

/// Presses without friction to each of `depths_mm` (rising) and integrates `law` over the pressure found.
///
/// # Errors
/// [`MarchError`], as [`march`].
pub fn press_limits(
    problem: &Problem,
    law: &RubberFriction,
    depths_mm: &[f64],
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Vec<PressLimit>, MarchError> {
    let frictionless = Problem { friction: None, ..problem.clone() };
    let corner = |(k, &depth): (usize, &f64)| Waypoint { t_s: k as f64, normal: depth, x: 0.0, y: 0.0 };
    let waypoints = [0.0].iter().chain(depths_mm).enumerate().map(corner).collect();
    let path = Path { drives: [Drive::Displacement; 3], waypoints };
    let mut runner = Runner::new(&frictionless, &path)?;
    let mut limits = Vec::new();
    for row in 1..path.waypoints.len() {
        runner.segment(row, progress)?;
        let response = response(&runner.solver, &runner.state, runner.time_s, runner.status);
        let points = &runner.state.contact.points;
        limits.push(PressLimit {
            depth_mm: response.depth_mm,
            normal_force_n: response.normal_force_n,
            contact_area_mm2: response.contact_area_mm2,
            friction_limit_n: points.iter().map(|p| law.strength(p.pressure).0 * p.area).sum(),
            penetration_mm: runner.state.totals.penetration,
        });
    }
    Ok(limits)
}

/// An increment cut below this share of the largest is taken for a limit point.
const STABILISE_BELOW: f64 = 5e-3;
/// Viscous increments before a snap is given up.
const SNAP_STEPS: usize = 60;

struct Runner<'a> {
    problem: &'a Problem<'a>,
    path: &'a Path,
    /// The friction law of a time, where it changes along the path.
    law_at: Option<&'a dyn Fn(f64) -> RubberFriction>,
    solver: Solver<'a>,
    state: State,
    time_s: f64,
    /// The state before the last increment and the size of that increment, for extrapolation.
    before: Option<(Configuration, Plane, f64)>,
    /// Step size as a share of the largest.
    pace: f64,
    trajectory: Trajectory,
    clock: ThreadTime,
    length_done: f64,
    length: f64,
    status: Status,
}

impl<'a> Runner<'a> {
    fn new(problem: &'a Problem<'a>, path: &'a Path) -> Result<Self, MarchError> {
        if path.waypoints.len() < 2 {
            return Err(MarchError::Path(format!("{} rows; at least 2 are needed", path.waypoints.len())));
        }
        for (row, pair) in path.waypoints.windows(2).enumerate() {
            if !(pair[1].t_s > pair[0].t_s) {
                return Err(MarchError::Path(format!("time does not grow at row {}: {}", row + 1, pair[1].t_s)));
            }
        }
        let start = &path.waypoints[0];
        let place = |drive: Drive, value: f64| if drive == Drive::Displacement { value } else { 0.0 };
        let plane =
            [place(path.drives[1], start.x), place(path.drives[2], start.y), place(path.drives[0], start.normal)];
        let friction = problem.friction.map_or(Friction::Off, Friction::On);
        let solver = Solver::new(problem.body, problem.pad_faces, friction, problem.penalty, problem.settings);
        let state = solver.initial_state(plane);
        let mut runner = Self {
            problem,
            path,
            law_at: None,
            solver,
            state,
            time_s: start.t_s,
            before: None,
            pace: 1.0,
            trajectory: Trajectory::default(),
            clock: ThreadTime::now(),
            length_done: 0.0,
            length: 0.0,
            status: Status::OK,
        };
        runner.length = (1..path.waypoints.len()).map(|row| runner.steps_of(row)).sum();
        Ok(runner)
    }

    /// The law that acts on the way to this row.
    fn friction_of(&self, row: usize) -> Friction {
        let slides = || self.path.waypoints[..=row].windows(2).any(|w| w[0].x != w[1].x || w[0].y != w[1].y);
        match self.problem.friction {
            Some(law) if self.problem.march.friction_while_pressing || slides() => Friction::On(law),
            _ => Friction::Off,
        }
    }

    /// Length of a segment in largest steps.
    fn steps_of(&self, row: usize) -> f64 {
        let (a, b) = (&self.path.waypoints[row - 1], &self.path.waypoints[row]);
        let march = &self.problem.march;
        let step = |drive: Drive, largest: f64| match drive {
            Drive::Displacement => largest,
            Drive::Force => march.max_force_step_n,
        };
        let depth_step = match self.friction_of(row) {
            Friction::On(_) => march.max_depth_step_with_friction_mm,
            Friction::Off => march.max_depth_step_mm,
        };
        let normal = (b.normal - a.normal).abs() / step(self.path.drives[0], depth_step);
        let x = (b.x - a.x) / step(self.path.drives[1], march.max_slide_step_mm);
        let y = (b.y - a.y) / step(self.path.drives[2], march.max_slide_step_mm);
        normal.max(x.hypot(y)).max(1e-3)
    }

    fn segment(&mut self, row: usize, progress: &mut dyn FnMut(Progress) -> ControlFlow<()>) -> Result<(), MarchError> {
        let (from, to) = (self.path.waypoints[row - 1], self.path.waypoints[row]);
        let steps = self.steps_of(row);
        self.solver.set_friction(self.friction_of(row));
        self.before = None;
        self.pace = self.pace.max(0.1);
        let mut done = 0.0f64;
        while done < steps {
            let left = steps - done;
            // Even out the last steps so that none is tiny.
            let size = if self.pace >= left { left } else { left / (left / self.pace - 1e-9).ceil() };
            let share = if size >= left { 1.0 } else { (done + size) / steps };
            let point = interpolate(&from, &to, share);
            match self.increment(&point, size) {
                Ok(()) => {
                    done = if share == 1.0 { steps } else { done + size };
                    self.record();
                    let report = Progress {
                        share: ((self.length_done + done) / self.length).min(1.0),
                        cost: self.trajectory.cost,
                        response: *self.trajectory.responses.last().expect("just recorded"),
                    };
                    if progress(report).is_break() {
                        return Err(MarchError::Interrupted {
                            reached: Box::new(std::mem::take(&mut self.trajectory)),
                        });
                    }
                }
                Err(source) => {
                    self.trajectory.cost.cutbacks += 1;
                    self.before = None;
                    self.pace = 0.4 * size;
                    if self.pace < STABILISE_BELOW && self.snap(&point) {
                        // The structure has snapped to another equilibrium; go on from there at a modest pace.
                        self.pace = 0.2;
                        done = if share == 1.0 { steps } else { done + size };
                        self.record();
                        continue;
                    }
                    if self.pace < self.problem.march.min_step_share {
                        let [x, y, z] = self.state.contact.plane;
                        return Err(MarchError::Stuck {
                            t_s: self.time_s,
                            depth_mm: z,
                            slide_x_mm: x,
                            slide_y_mm: y,
                            row,
                            increment: self.trajectory.cost.increments + 1,
                            step_share: size,
                            source,
                            reached: Box::new(std::mem::take(&mut self.trajectory)),
                        });
                    }
                }
            }
        }
        self.length_done += steps;
        Ok(())
    }

    fn increment(&mut self, point: &Waypoint, size: f64) -> Result<(), SolveError> {
        if let Some(law_at) = self.law_at {
            self.solver.set_friction(Friction::On(law_at(point.t_s)));
        }
        let target = self.target(point);
        let mut plane = self.state.contact.plane;
        let (guess, extrapolated) = match &self.before {
            Some((before, plane_before, last_size)) if size <= 2.0 * last_size => {
                let ratio = size / last_size;
                for (place, before) in plane.iter_mut().zip(plane_before) {
                    *place += (*place - before) * ratio;
                }
                (extrapolate(self.problem.body, before, &self.state.configuration, ratio), true)
            }
            _ => (self.state.configuration.clone(), false),
        };
        if self.path.drives[0] == Drive::Force && self.state.totals.force.z <= 0.0 {
            // Before the first touch a force has no depth: start from a small penetration.
            let lowest = self.state.contact.position.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
            plane[2] = lowest + 0.02;
        }
        let mut stats = Stats::default();
        let result = self.solver.step(&self.state, target, guess, plane, extrapolated, &mut stats);
        let cost = &mut self.trajectory.cost;
        cost.iterations += stats.iterations;
        cost.factorisations += stats.factorisations;
        cost.cpu_s = self.clock.elapsed().as_secs_f64();
        let next = result?;
        self.trajectory.work.plane_mj += plane_work_between(&self.state, &next);
        self.trajectory.work.friction_mj += next.totals.dissipation;
        let cost = &mut self.trajectory.cost;
        cost.max_penetration_mm = cost.max_penetration_mm.max(next.totals.penetration);
        cost.min_dissipation_mpa_mm = cost.min_dissipation_mpa_mm.min(next.totals.min_dissipation_density);
        cost.max_residual = cost.max_residual.max(stats.residual);
        let before = std::mem::replace(&mut self.state, next);
        self.before = Some((before.configuration, before.contact.plane, size));
        self.time_s = point.t_s;
        self.trajectory.cost.increments += 1;
        self.pace = match stats.iterations {
            0..=6 => (1.5 * size).clamp(self.pace, 1.0),
            7..=14 => self.pace,
            _ => 0.6 * size,
        };
        Ok(())
    }

    /// Steps past a limit point: viscous increments at a fixed target until equilibrium holds without them.
    ///
    /// Returns whether it was reached; the state is untouched if not.
    fn snap(&mut self, point: &Waypoint) -> bool {
        let target = self.target(point);
        let (mut state, mut friction_work, mut plane_work) = (self.state.clone(), 0.0, 0.0);
        let energy_before = self.problem.body.energy(&state.configuration).0;
        let mut coefficient = 1e-3;
        let mut stats = Stats::default();
        for _ in 0..SNAP_STEPS {
            match self.solver.damped_step(&state, target, coefficient, &mut stats) {
                Ok(next) => {
                    friction_work += next.totals.dissipation;
                    plane_work += plane_work_between(&state, &next);
                    state = next;
                    coefficient *= 0.5;
                }
                Err(_) => coefficient *= 8.0,
            }
            if coefficient > 1e3 {
                return false;
            }
            let guess = state.configuration.clone();
            let plane = state.contact.plane;
            if coefficient < 1e-2
                && let Ok(next) = self.solver.step(&state, target, guess, plane, true, &mut stats)
            {
                friction_work += next.totals.dissipation;
                plane_work += plane_work_between(&state, &next);
                self.trajectory.work.plane_mj += plane_work;
                self.trajectory.work.friction_mj += friction_work;
                // What neither the body nor friction has: the viscous forces' work, the time integration's own included.
                let stored = self.problem.body.energy(&next.configuration).0 - energy_before;
                self.trajectory.work.stabilisation_mj += (plane_work - friction_work - stored).max(0.0);
                self.trajectory.cost.increments += 1;
                self.trajectory.cost.iterations += stats.iterations;
                self.trajectory.cost.factorisations += stats.factorisations;
                self.status = self.status.with(Status::STABILISED);
                self.state = next;
                self.time_s = point.t_s;
                return true;
            }
        }
        false
    }

    fn target(&self, point: &Waypoint) -> Target {
        let axis = |drive: Drive, value: f64| match drive {
            Drive::Displacement => Axis::Displacement(value),
            Drive::Force => Axis::Force(value),
        };
        [
            axis(self.path.drives[1], point.x),
            axis(self.path.drives[2], point.y),
            axis(self.path.drives[0], point.normal),
        ]
    }

    fn record(&mut self) {
        let response = response(&self.solver, &self.state, self.time_s, self.status);
        self.trajectory.responses.push(response);
        self.status = Status::OK;
    }

    fn snapshot(&mut self) {
        let response = *self.trajectory.responses.last().expect("recorded before");
        self.trajectory.snapshots.push(snapshot(self.problem.body, &self.solver, &self.state, response));
    }
}

/// Work of the plane on the finger between two states, mJ, by the trapezoidal rule.
fn plane_work_between(a: &State, b: &State) -> f64 {
    let step: [f64; 3] = std::array::from_fn(|k| b.contact.plane[k] - a.contact.plane[k]);
    ((a.totals.force + b.totals.force) * 0.5).dot(&Vector3::from(step))
}

fn interpolate(a: &Waypoint, b: &Waypoint, share: f64) -> Waypoint {
    if share >= 1.0 {
        return *b;
    }
    let mix = |a: f64, b: f64| a + share * (b - a);
    Waypoint { t_s: mix(a.t_s, b.t_s), normal: mix(a.normal, b.normal), x: mix(a.x, b.x), y: mix(a.y, b.y) }
}

/// `to` continued by `ratio` times the motion from `from`.
fn extrapolate(body: &Body, from: &Configuration, to: &Configuration, ratio: f64) -> Configuration {
    let mut next = to.clone();
    for (x, (a, b)) in next.x.iter_mut().zip(from.x.iter().zip(&to.x)) {
        *x += (b - a) * ratio;
    }
    next.rigid_centre += (to.rigid_centre - from.rigid_centre) * ratio;
    let turn = rotation_vector(&(to.rigid_rotation * from.rigid_rotation.inverse()));
    next.rigid_rotation = Rotation3::new(turn * ratio) * to.rigid_rotation;
    body.follow(&mut next);
    next
}

fn response(solver: &Solver, state: &State, t_s: f64, status: Status) -> Response {
    let totals = &state.totals;
    let [slide_x_mm, slide_y_mm, depth_mm] = state.contact.plane;
    let contact_area_mm2 = solver.surface().contact_areas(&state.contact).iter().map(|a| a[0]).sum();
    let in_contact = totals.area > 0.0;
    let stick_ratio = if in_contact { totals.stuck_area / totals.area } else { 0.0 };
    let centre = |k: usize| if in_contact { totals.pressure_moment[k] / totals.force.z } else { f64::NAN };
    Response {
        t_s,
        depth_mm,
        slide_x_mm,
        slide_y_mm,
        normal_force_n: totals.force.z,
        friction_x_n: totals.force.x,
        friction_y_n: totals.force.y,
        contact_area_mm2,
        stick_ratio,
        regime: Regime::classify(in_contact, stick_ratio as f32),
        status,
        centre_of_pressure_mm: [centre(0), centre(1)],
    }
}

fn snapshot(body: &Body, solver: &Solver, state: &State, response: Response) -> Snapshot {
    let areas = solver.surface().contact_areas(&state.contact);
    let per_face = solver.surface().points_per_face();
    let faces = state
        .contact
        .points
        .chunks(per_face)
        .zip(areas)
        .map(|(points, [inside, whole])| {
            let area: f64 = points.iter().map(|p| p.area).sum();
            let mean = |value: &dyn Fn(&crate::contact::PointState) -> f64| {
                if area > 0.0 { points.iter().map(|p| p.area * value(p)).sum::<f64>() / area } else { 0.0 }
            };
            let over_face = if whole > 0.0 { area / whole } else { 0.0 };
            FaceState {
                pressure_mpa: mean(&|p| p.pressure) * over_face,
                traction_mpa: [mean(&|p| p.traction[0]) * over_face, mean(&|p| p.traction[1]) * over_face],
                slip_mm: [mean(&|p| p.slip[0]), mean(&|p| p.slip[1])],
                contact_fraction: if whole > 0.0 { inside / whole } else { 0.0 },
                stick_fraction: mean(&|p| f64::from(u8::from(p.stuck))),
            }
        })
        .collect();
    let undeformed = &body.undeformed().x;
    Snapshot {
        response,
        displacement_mm: state.configuration.x.iter().zip(undeformed).map(|(x, x0)| x - x0).collect(),
        faces,
        strain_energy_density_mpa: body.energy(&state.configuration).1,
    }
}
