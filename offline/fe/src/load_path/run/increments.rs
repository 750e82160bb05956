//! The increments of a run: attempts, cut-backs, passages of limit points.

use super::{LEAST_PREDICTED, Run};
use crate::contact::{Friction, Sharpness, plane};
use crate::load_path::beside_pad::{BESIDE_PAD_MM, below_beside_pad_mm};
use crate::load_path::driven;
use crate::load_path::limit_point::{LimitPointRule, check_no_jump, pass_limit_point, plane_work_mj_between};
use crate::load_path::settings::{LoadPathError, Progress};
use crate::load_path::stepping::{FailedStep, LoadSteps, Standing};
use crate::solve::{SolveError, State, Stats};
use fingerpad::Status;

/// How a limit point is passed.
const LIMIT_POINT: LimitPointRule =
    LimitPointRule { max_steps: 300, release: 0.5, hold: 4.0, largest: 1e3, gained_share: 0.01 };

impl LoadSteps for Run<'_, '_> {
    type Error = LoadPathError;

    fn try_step(&mut self, share: f64, size: f64) -> Result<u32, SolveError> {
        let point = self.point(share);
        if let Some(law_at) = self.law_at {
            self.solver.set_friction(Friction::On(law_at(point.t_s)));
        }
        self.solver.set_tissue(self.tissue_until(point.t_s));
        let (target, guess) = (self.target(&point), self.guess(size));
        let mut stats = Stats::default();
        if size > LEAST_PREDICTED && self.is_beyond_friction(&point) {
            return Err(SolveError::BeyondStrength);
        }
        let driven::Step { states, is_held } = self.solve(&mut stats, |solver, run, stats, watch| {
            driven::step(solver, &run.state, run.is_held, target, guess, stats, watch)
        })?;
        let end = states.last().expect("at least one");
        let lacks_force = is_held && (driven::touches(end) || self.drives_a_force_along(&point.at));
        if share == 1.0 && lacks_force {
            return Err(if driven::touches(end) { SolveError::NotReleased } else { SolveError::OutOfContact });
        }
        // Tissue that relaxes dissipates, which is no jump.
        if self.run.tissue.is_none() {
            check_no_jump(&self.solver, states.iter().rev().nth(1).unwrap_or(&self.run.state), end, &target)?;
        }
        let largest_size = self.largest_size_after(end);
        let run = &mut self.run;
        run.largest_size = largest_size;
        run.is_held = is_held;
        if lacks_force {
            run.status = run.status.with(Status::LOAD_NOT_REACHED);
        }
        let copies = self.model.copies();
        let start = (run.state.configuration.clone(), run.state.contact.plane, size);
        for next in states {
            let (work, cost) = (&mut run.trajectory.work, &mut run.trajectory.cost);
            work.plane_mj += copies * plane_work_mj_between(&self.solver, &run.state, &next);
            work.friction_mj += copies * next.totals.dissipation;
            work.pressure_mj += copies * next.totals.elastic_energy_by_pressure;
            cost.max_penetration_mm = cost.max_penetration_mm.max(next.totals.penetration);
            cost.min_dissipation_mj = cost.min_dissipation_mj.min(next.totals.min_dissipation_mj);
            run.state = next;
        }
        let cost = &mut run.trajectory.cost;
        cost.max_residual = cost.max_residual.max(stats.residual);
        cost.increments += 1;
        run.before = Some(start);
        self.end_at(point.t_s);
        Ok(stats.iterations)
    }

    fn largest_size(&self) -> f64 {
        self.run.largest_size
    }

    fn failed(&mut self, share: f64, error: &SolveError) -> Result<(), LoadPathError> {
        if *error == SolveError::Interrupted {
            return Err(self.interrupted());
        }
        self.run.trajectory.cost.cutbacks += 1;
        self.run.before = None;
        self.check_friction(share, error)
    }

    fn exceeds_iteration_budget(&self) -> bool {
        false
    }

    fn pass_limit_point(&mut self, share: f64) -> Result<bool, LoadPathError> {
        let point = self.point(share);
        let target = self.target(&point);
        self.solver.set_tissue(self.tissue_until(point.t_s));
        let mut stats = Stats::default();
        let passage = self.solve(&mut stats, |solver, run, stats, watch| {
            pass_limit_point(solver, &run.state, target, &LIMIT_POINT, &State::clone, stats, watch)
        });
        let Ok(passage) = passage else { return Err(self.interrupted()) };
        let Some(passage) = passage else { return Ok(false) };
        // Without contact nothing resists a driven force.
        if !driven::touches(&passage.state) && self.drives_a_force_along(&[1.0; 6]) {
            return Ok(false);
        }
        let (copies, run) = (self.model.copies(), &mut self.run);
        let work = &mut run.trajectory.work;
        work.plane_mj += copies * passage.plane_work_mj;
        work.friction_mj += copies * passage.friction_work_mj;
        work.pressure_mj += copies * passage.pressure_work_mj;
        work.stabilisation_mj += copies * passage.viscous_work_mj.max(0.0);
        run.trajectory.cost.increments += 1;
        run.status = run.status.with(Status::STABILISED);
        run.state = passage.state;
        run.is_held = false;
        self.end_at(point.t_s);
        Ok(true)
    }

    fn give_up(&mut self, step: FailedStep) -> Result<(), LoadPathError> {
        if step.next_size >= self.problem.load_steps.min_step_share {
            return Ok(());
        }
        let [x, y, z, ..] = self.run.state.contact.plane.at;
        Err(LoadPathError::NoEquilibrium {
            t_s: self.run.time_s,
            depth_mm: z,
            slide_x_mm: x,
            slide_y_mm: y,
            row: self.run.row,
            increment: self.run.trajectory.cost.increments + 1,
            step_share: step.size,
            cause: step.error,
            reached: self.reached(),
        })
    }

    fn accepted(&mut self, standing: Standing) -> Result<(), LoadPathError> {
        if self.meets_obstacle() {
            let last = self.run.trajectory.responses.last().copied().unwrap_or_default();
            return Err(LoadPathError::NotClear {
                t_s: last.t_s,
                row: self.run.row,
                clearance_mm: self.problem.clearance_mm,
                normal_force_n: last.normal_force_n,
                reached: self.reached(),
            });
        }
        let below_mm =
            below_beside_pad_mm(self.problem.beside_pad, &self.model, self.solver.surface(), &self.run.state);
        if below_mm > BESIDE_PAD_MM {
            return Err(LoadPathError::BesidePad {
                t_s: self.run.time_s,
                row: self.run.row,
                depth_mm: self.run.state.contact.plane.at[plane::DEPTH],
                below_mm,
                reached: self.reached(),
            });
        }
        if let Some(Sharpness { face_mm, radius_mm, is_inside_out }) =
            self.solver.surface().sharpest_contact(&self.run.state.contact)
        {
            if is_inside_out {
                let t_s = self.run.trajectory.responses.last().map_or(0.0, |last| last.t_s);
                return Err(LoadPathError::InsideOut {
                    t_s,
                    row: self.run.row,
                    face_mm,
                    radius_mm,
                    reached: self.reached(),
                });
            }
            if face_mm > radius_mm {
                self.run.status = self.run.status.with(Status::BODY_TOO_SHARP);
            }
        }
        if self.solver.surface().leaves_heights(&self.run.state.contact) {
            self.run.status = self.run.status.with(Status::BEYOND_EDGE);
        }
        self.run.standing = standing;
        self.record();
        if let Some(saves) = &mut self.saves {
            saves.take(&(&self.run, self.solver.factor_record()))?;
        }
        let report = Progress {
            share: self.share(),
            cost: self.run.trajectory.cost,
            response: *self.run.trajectory.responses.last().expect("just recorded"),
        };
        if (self.progress)(report).is_break() { Err(self.interrupted()) } else { Ok(()) }
    }
}
