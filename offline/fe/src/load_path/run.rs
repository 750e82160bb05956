//! The run along a path: increments of the plane's motion, recorded as responses.

mod increments;
mod segment;

use std::cell::Cell;
use std::ops::ControlFlow;

use cpu_time::ThreadTime;
use fingerpad::Status;
use nalgebra::Vector3;

use self::segment::{Point, check};
use super::checkpoint::{Checkpoint, Saves};
use super::driven;
use super::friction_limit::{self, FrictionLimit};
use super::path_end::RunOptions;
use super::response::{response, snapshot};
use super::settings::{LoadPathError, OnProgress, Problem, Progress};
use super::steady_slip::continues_straight;
use super::stepping::{Standing, StepRule, load_along};
use super::{Cost, Drive, Model, Path, PressLimit, Trajectory};
use crate::assembly::{Configuration, TissueMemory, TissueStep};
use crate::contact::{Coordinates, Friction, FrictionLaw, Plane, RubberFriction, plane};
use crate::solve::{Axis, FactorRecord, SolveError, Solver, State, Stats};

/// How step sizes follow from the iterations; a size of 1 is the largest step of [`super::LoadSettings`] but in steady slip.
const STEPS: StepRule =
    StepRule { easy_iterations: 6, after_hard: 0.6, cut: 0.4, limit_point_below: 5e-3, after_limit_point: 0.2 };
/// Least size of the first step of a row.
const LEAST_FIRST_SIZE: f64 = 0.1;
/// Share of a normal force by which its target may exceed it and count as the same.
const FORCE_ROUNDING: f64 = 1e-3;
/// Iterations without progress after which an increment under a driven force along the plane is cut.
const IDLE_ITERATIONS: u32 = 6;
/// Factor on a load below which friction surely does not hold it: its limit changes little with the pressures.
const SURELY_BEYOND: f64 = 0.9;
/// Size of a step above which one that friction is predicted not to hold is not tried.
const LEAST_PREDICTED: f64 = 0.05;
/// Share of the strength that must be used for a failed step to count as the limit of friction.
const USED_STRENGTH: f64 = 0.9;

/// State of a run along a path: all data of a checkpoint besides the factor.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct RunState {
    /// Row being approached, and whether its increments have started.
    pub row: usize,
    row_has_begun: bool,
    /// State of the stepping on the path to the row.
    standing: Standing,
    /// Largest size of a step at present: 1, and more in steady slip.
    largest_size: f64,
    pub state: State,
    /// Whether coordinates that a force or a moment drives are held, since contact does not carry them yet.
    is_held: bool,
    time_s: f64,
    /// The state before the last increment and the size of that increment, for extrapolation.
    before: Option<(Configuration, Plane, f64)>,
    /// Length of the rows done, in largest steps.
    length_done: f64,
    /// Flags of the next response.
    status: Status,
    pub trajectory: Trajectory,
    pub limits: Vec<PressLimit>,
    /// Memory of tissue that relaxes.
    tissue: Option<TissueMemory>,
}

/// A run along a path.
pub(super) struct Run<'a, 'p> {
    problem: &'a Problem<'a>,
    pub model: Model<'a>,
    pub path: &'a Path,
    /// Rows at which the field is kept.
    pub snapshots: &'a [usize],
    /// The friction law of a time, if it changes along the path.
    law_at: Option<&'a dyn Fn(f64) -> RubberFriction>,
    /// A law whose integral over the pressure is taken at every row.
    limit_law: Option<&'a RubberFriction>,
    solver: Solver<'a>,
    run: RunState,
    saves: Option<Saves<'a>>,
    progress: OnProgress<'p>,
    clock: ThreadTime,
    /// CPU time before this session, s.
    earlier_cpu_s: f64,
    /// Length of the whole path and of the segment to the row being approached, in largest steps.
    length: f64,
    row_length: f64,
}

impl<'a, 'p> Run<'a, 'p> {
    pub fn new(
        problem: &'a Problem<'a>,
        path: &'a Path,
        options: &RunOptions<'a>,
        progress: OnProgress<'p>,
    ) -> Result<Self, LoadPathError> {
        check(path)?;
        let drives = path.coordinate_drives();
        let start = path.coordinates(0, problem.neutral_pitch_deg);
        let plane = Plane::new(std::array::from_fn(|k| if drives[k] == Drive::Displacement { start[k] } else { 0.0 }));
        let friction = problem.friction.map_or(Friction::Off, Friction::On);
        let model = problem.model(path);
        let mut settings = problem.settings;
        if drives[plane::X] == Drive::Force || drives[plane::Y] == Drive::Force || drives[plane::SPIN] == Drive::Force {
            // Most steps without equilibrium lead beyond friction; a shorter one finds out faster than a long search.
            settings.max_idle_iterations = settings.max_idle_iterations.min(IDLE_ITERATIONS);
        }
        let mut solver = Solver::new(model.body, model.pad_faces, friction, problem.penalty, settings);
        solver.set_rigid_body(problem.rigid_body.clone(), problem.outline.clone(), &plane);
        let state = solver.initial_state(plane);
        let mut run = Self {
            problem,
            model,
            path,
            snapshots: options.snapshots,
            law_at: options.law_at,
            limit_law: options.limit_law,
            solver,
            run: RunState {
                row: 0,
                row_has_begun: false,
                standing: Standing { done: 0.0, size: 1.0 },
                largest_size: 1.0,
                state,
                is_held: true,
                time_s: path.waypoints[0].t_s,
                before: None,
                length_done: 0.0,
                status: Status::OK,
                trajectory: Trajectory::default(),
                limits: Vec::new(),
                tissue: model.body.memory(&problem.relaxation),
            },
            saves: None,
            progress,
            clock: ThreadTime::now(),
            earlier_cpu_s: 0.0,
            length: 0.0,
            row_length: 0.0,
        };
        run.length = (1..path.waypoints.len()).map(|row| run.length_of(row)).sum();
        Ok(run)
    }

    /// Saves the run by `checkpoint`, and resumes from a saved state of this very run.
    pub fn keep(&mut self, checkpoint: Checkpoint<'a>) -> Result<(), LoadPathError> {
        let saves = Saves::new(checkpoint, self.path, self.snapshots, self.model.half.is_some());
        if let Some((run, factor)) = saves.read::<(RunState, FactorRecord)>()
            && run.state.configuration.x.len() == self.run.state.configuration.x.len()
        {
            let reached = run.trajectory.clone();
            // If a factor cannot be made again, the run restarts from its start.
            if let Err(SolveError::Interrupted) = self.resume(run, &factor) {
                return Err(LoadPathError::Interrupted { reached: Box::new(reached) });
            }
        }
        self.saves = Some(saves);
        Ok(())
    }

    /// Restores the state that this run, or another along the same path, had with this factor.
    ///
    /// # Errors
    /// [`SolveError`] if the factor cannot be made again; the run is then unchanged.
    pub fn resume(&mut self, run: RunState, factor: &FactorRecord) -> Result<(), SolveError> {
        self.solver.set_friction(self.friction_of(run.row));
        let response = run.trajectory.responses.last().copied().unwrap_or_default();
        let report = Progress { share: 0.0, cost: run.trajectory.cost, response };
        let progress = &mut self.progress;
        self.solver.restore_factor(factor, &mut |_| progress(report))?;
        self.earlier_cpu_s = run.trajectory.cost.cpu_s;
        self.run = run;
        Ok(())
    }

    /// Whether nothing was done yet.
    pub fn is_at_start(&self) -> bool {
        self.run.trajectory.responses.is_empty()
    }

    /// Follows the path to its end; returns the state of the run and the record of its factor.
    pub fn follow(mut self) -> Result<(RunState, FactorRecord), LoadPathError> {
        let result = self.follow_rows();
        if !matches!(result, Err(LoadPathError::Interrupted { .. }))
            && let Some(saves) = &self.saves
        {
            saves.remove();
        }
        result.map(|()| (self.run, self.solver.factor_record()))
    }

    fn follow_rows(&mut self) -> Result<(), LoadPathError> {
        if self.is_at_start() {
            self.record();
            self.end_row();
        }
        while self.run.row < self.path.waypoints.len() {
            self.go_to_row()?;
            self.end_row();
        }
        Ok(())
    }

    fn go_to_row(&mut self) -> Result<(), LoadPathError> {
        self.row_length = self.length_of(self.run.row);
        self.solver.set_friction(self.friction_of(self.run.row));
        if !self.run.row_has_begun {
            self.run.before = None;
            if !continues_straight(self.path, self.run.row) {
                self.run.largest_size = 1.0;
            }
            let size = self.run.standing.size.clamp(LEAST_FIRST_SIZE, self.run.largest_size);
            self.run.standing = Standing { done: 0.0, size };
            self.run.row_has_begun = true;
        }
        let (length, standing) = (self.row_length, self.run.standing);
        self.run.standing.size = load_along(self, &STEPS, length, standing)?;
        self.run.length_done += length;
        Ok(())
    }

    /// Records the requested data of the row that was reached, and proceeds to the next row.
    pub fn end_row(&mut self) {
        let run = &mut self.run;
        if self.snapshots.contains(&run.row) {
            let response = *run.trajectory.responses.last().expect("recorded before");
            let tissue = run.tissue.as_ref().map(TissueMemory::present);
            let field = snapshot(&self.model, &self.solver, &run.state, tissue.as_ref(), response);
            run.trajectory.snapshots.push(field);
        }
        if let Some(law) = self.limit_law.filter(|_| run.row > 0) {
            let response = run.trajectory.responses.last().expect("recorded before");
            run.limits.push(PressLimit {
                depth_mm: response.depth_mm,
                normal_force_n: response.normal_force_n,
                contact_area_mm2: response.contact_area_mm2,
                friction_limit_n: self.model.copies() * strength_n(law, &run.state),
                penetration_mm: run.state.totals.penetration,
            });
        }
        run.row += 1;
        run.row_has_begun = false;
    }

    /// The law that acts on the segment to this row.
    fn friction_of(&self, row: usize) -> Friction {
        let slides = || {
            self.path.waypoints[..=row].windows(2).any(|w| w[0].x != w[1].x || w[0].y != w[1].y)
                || self.turns_until(row)
        };
        match self.problem.friction {
            Some(law) if self.problem.load_steps.friction_while_pressing || slides() => Friction::On(law),
            _ => Friction::Off,
        }
    }

    /// Whether the plane turns on the segment to this row or before.
    fn turns_until(&self, row: usize) -> bool {
        let turns = |row: usize| self.corner(row)[plane::SPIN..] != self.corner(0)[plane::SPIN..];
        (1..=row).any(turns)
    }

    /// Solves, with many progress reports within; adds the cost.
    fn solve<T>(
        &mut self,
        stats: &mut Stats,
        search: impl FnOnce(
            &mut Solver<'a>,
            &RunState,
            &mut Stats,
            &mut dyn FnMut(&Stats) -> ControlFlow<()>,
        ) -> Result<T, SolveError>,
    ) -> Result<T, SolveError> {
        let last_response = self.run.trajectory.responses.last().copied().unwrap_or_default();
        let share = self.share();
        let (clock, earlier_cpu_s) = (&self.clock, self.earlier_cpu_s);
        let so_far = Cell::new(self.run.trajectory.cost);
        let with = |stats: &Stats| {
            let mut cost: Cost = so_far.get();
            cost.iterations += stats.iterations;
            cost.factorisations += stats.factorisations;
            cost.cpu_s = earlier_cpu_s + clock.elapsed().as_secs_f64();
            cost
        };
        let progress = &mut self.progress;
        let result = search(&mut self.solver, &self.run, stats, &mut |stats| {
            progress(Progress { share, cost: with(stats), response: last_response })
        });
        self.run.trajectory.cost = with(stats);
        result
    }

    /// Done share of the path.
    fn share(&self) -> f64 {
        ((self.run.length_done + self.run.standing.done) / self.length).min(1.0)
    }

    /// Whether a force along the contact or a moment is driven, and to another value than 0 at this place.
    fn drives_a_force_along(&self, at: &Coordinates) -> bool {
        let drives = self.path.coordinate_drives();
        (0..6).any(|k| k != plane::DEPTH && drives[k] == Drive::Force && at[k] != 0.0)
    }

    fn record(&mut self) {
        let response = response(self.problem, &self.model, &self.run.state, self.run.time_s, self.run.status);
        self.run.trajectory.responses.push(response);
        if let Some(observed) = self.problem.observed {
            let tissue = self.run.tissue.as_ref().map(TissueMemory::present);
            let reading = observed.read(&self.model, (&self.run.state.configuration, tissue.as_ref()));
            self.run.trajectory.readings.push(reading);
        }
        self.run.status = Status::OK;
    }

    /// Stress of a step to a time, s, if the tissue relaxes.
    fn tissue_until(&self, t_s: f64) -> Option<TissueStep> {
        self.run.tissue.as_ref().map(|memory| memory.step(t_s - self.run.time_s))
    }

    /// Ends a step at the present state.
    fn end_at(&mut self, t_s: f64) {
        let run = &mut self.run;
        if let Some(memory) = &mut run.tissue {
            self.model.body.remember(memory, t_s - run.time_s, &run.state.configuration);
        }
        run.time_s = t_s;
    }

    fn reached(&mut self) -> Box<Trajectory> {
        Box::new(std::mem::take(&mut self.run.trajectory))
    }

    fn interrupted(&mut self) -> LoadPathError {
        if let Some(Err(error)) = self.saves.as_mut().map(Saves::write) {
            return error.into();
        }
        LoadPathError::Interrupted { reached: self.reached() }
    }

    /// Whether the plane has reached the finger's supports.
    fn meets_obstacle(&self) -> bool {
        let place = &self.run.state.contact.plane;
        let frame = self.solver.surface().frame(place);
        let body = self.solver.surface().body();
        (body.is_plane() && place.at[plane::DEPTH] >= self.problem.clearance_mm)
            || self.problem.obstacles.iter().any(|x| body.spot(&frame.to_plane(x)).gap_mm <= 0.0)
    }

    /// Factor on the load along the plane of a point up to which friction at the present pressures holds it; infinite where
    /// the pressures grow on the way to the point.
    fn friction_factor(&self, limit: &FrictionLimit, point: &Point) -> f64 {
        let state = &self.run.state;
        let presses_on = match self.target(point).0[plane::DEPTH] {
            Axis::Displacement(depth) => depth > state.contact.plane.at[plane::DEPTH],
            // The force of a model of half the finger is half of it.
            Axis::Force(force) => force > (1.0 + FORCE_ROUNDING) * state.totals.force.z,
        };
        if presses_on { f64::INFINITY } else { limit.factor(&along(point.at)) }
    }

    fn friction_limit(&self) -> Option<FrictionLimit> {
        let driven = friction_limit::driven(&self.path.coordinate_drives());
        let (surface, copies) = (self.solver.surface(), self.model.copies());
        let limit = || FrictionLimit::of(surface, self.solver.friction(), &self.run.state, copies, driven);
        driven.contains(&true).then(limit)
    }

    /// Whether a step is not worth a trial: friction does not hold the load that it leads to.
    fn is_beyond_friction(&self, point: &Point) -> bool {
        !self.run.is_held && self.friction_limit().is_some_and(|limit| self.friction_factor(&limit, point) < 1.0)
    }

    /// Refuses a driven load along the plane that friction cannot hold, after a step that failed for `error`.
    fn check_friction(&mut self, share: f64, error: &SolveError) -> Result<(), LoadPathError> {
        let Some(limit) = self.friction_limit().filter(|_| *error != SolveError::BeyondStrength) else { return Ok(()) };
        let (state, copies) = (&self.run.state, self.model.copies());
        let (next, last) = (self.point(share), self.point(1.0));
        let end = along(last.at);
        let is_in_air = *error == SolveError::OutOfContact && !driven::touches(state);
        // The walls of a hollow body may take what friction does not hold.
        let fails = if self.problem.rigid_body.may_be_hollow() && !is_in_air {
            self.friction_factor(&limit, &next) < 1.0
                && limit.used(state, copies) >= USED_STRENGTH
                && (share * self.row_length - self.run.standing.done) < LEAST_PREDICTED
        } else {
            self.friction_factor(&limit, &next) < 1.0 && limit.used(state, copies) >= USED_STRENGTH
                || self.friction_factor(&limit, &last) < SURELY_BEYOND
                    && self.friction_factor(&limit, &next) * SURELY_BEYOND < 1.0
                || is_in_air && limit.factor(&end) < 1.0
        };
        if !fails {
            return Ok(());
        }
        let (t_s, row, normal_force_n) = (self.run.time_s, self.run.row, copies * state.totals.force.z);
        let driven = friction_limit::driven(&self.path.coordinate_drives());
        let holds = limit.factor(&end);
        let force = driven[0].then_some(end.x).into_iter().chain(driven[1].then_some(end.y));
        let force_n = force.map(|f| f * f).sum::<f64>().sqrt();
        let reached = self.reached();
        Err(if driven[2] && end.z != 0.0 {
            LoadPathError::BeyondFrictionMoment {
                t_s,
                row,
                wanted_n_mm: end.z,
                with_n: force_n,
                holds_n_mm: holds * end.z,
                normal_force_n,
                reached,
            }
        } else {
            let holds_n = holds * force_n;
            LoadPathError::BeyondFriction { t_s, row, wanted_n: force_n, holds_n, normal_force_n, reached }
        })
    }
}

/// Loads along x, along y and about the normal.
fn along(at: Coordinates) -> Vector3<f64> {
    Vector3::new(at[plane::X], at[plane::Y], at[plane::SPIN])
}

/// Integral of a law's strength over the pressure of a state, N.
fn strength_n(law: &dyn FrictionLaw, state: &State) -> f64 {
    state.contact.nodes.iter().map(|n| law.strength(n.pressure_mpa()).0 * n.area).sum()
}
