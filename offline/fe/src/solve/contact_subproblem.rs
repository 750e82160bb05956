//! The contact subproblem of one equilibrium iteration: the bulk is linear, the contact is not.
//!
//! With `G` the compliance of the contact dofs and `y` their displacement without contact forces, find the displacement
//! `x` with `h(x) = x − y + G f(x) = 0`, `f` the contact residual; a force-driven coordinate of the plane is a further
//! unknown, and the balance of its force or moment a further equation. Newton's method with the exact non-symmetric
//! tangent on the dofs of nodes in contact, backtracking on |h|.

use nalgebra::Vector3;

use super::contact_system::{ContactSystem, KeptFactor};
use super::equilibrium::imbalance;
use super::increment::{SolveError, WRENCH_OF};
use super::linear::Factor;
use crate::contact::{ContactState, Evaluation, Friction, NodeTangent, Parts, Plane, Surface, Tangential, Twist};

/// Allowed residual of the solution of a Newton step: a share of the subproblem's tolerance, or of the right-hand side
/// if that is more.
const STEP_ERROR: f64 = 0.3;
const LEAST_STEP_ERROR: f64 = 1e-4;

/// Growth of |h| above which a search has diverged.
const LOST: f64 = 1e6;

/// Largest penetration of a node that starts to touch, mm.
const FIRST_TOUCH_MM: f64 = 1e-7;

/// Constants during the iterations.
#[derive(Clone, Copy)]
pub(super) struct ContactSubproblem<'a> {
    pub surface: &'a Surface,
    pub friction: &'a Friction,
    pub last: &'a ContactState,
    pub factor: &'a Factor,
    /// Parts of the contact area.
    pub parts: Parts<'a>,
    /// Positions of the surface nodes at x = 0.
    pub base: &'a [Vector3<f64>],
    /// Contact dofs (first of three, 0 based among them) that move each surface node, with their weights.
    pub slots: &'a [Vec<(usize, f64)>],
    /// Contact dofs that are held.
    pub held: &'a [bool],
    /// Stiffness that the factor holds on top of the bulk's, per contact dof, N/mm; taken off again here.
    pub shift: &'a [f64],
    /// Unloaded displacement, mm.
    pub y: &'a [f64],
    /// Force (N) or moment (N mm) that a coordinate driven by it must reach.
    pub force_target: [Option<f64>; 6],
    /// Convergence: |h| in mm.
    pub tolerance: f64,
    pub max_iterations: usize,
}

pub(super) struct Solution {
    pub x: Vec<f64>,
    pub plane: Plane,
    /// Contact residual less the shift's force on the contact dofs, N.
    pub force: Vec<f64>,
    pub iterations: usize,
    /// |h| that is left, mm.
    pub norm: f64,
}

/// Treatment of a step after which the residual is larger.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Steps {
    /// It is shortened, as long as that helps.
    Shortened,
    /// It is accepted.
    Whole,
}

struct Trial {
    x: Vec<f64>,
    plane: Plane,
    positions: Vec<Vector3<f64>>,
    evaluation: Evaluation,
    force: Vec<f64>,
    h: Vec<f64>,
    /// Violation of the balance of driven forces and moments, mm by `force_scale`.
    balance: [f64; 6],
    norm: f64,
}

impl Trial {
    /// Nodes that carry a force.
    fn touching(&self) -> impl Iterator<Item = usize> {
        let residual = self.evaluation.residual.iter().enumerate();
        residual.filter(|(_, force)| **force != Vector3::zeros()).map(|(node, _)| node)
    }
}

impl ContactSubproblem<'_> {
    fn positions(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        let moved = |base: &Vector3<f64>, slots: &[(usize, f64)]| {
            slots.iter().fold(*base, |place, &(s, weight)| place + Vector3::new(x[s], x[s + 1], x[s + 2]) * weight)
        };
        self.base.iter().zip(self.slots).map(|(base, slots)| moved(base, slots)).collect()
    }

    fn gather(&self, nodal: &[Vector3<f64>]) -> Vec<f64> {
        let mut out = vec![0.0; self.y.len()];
        for (value, slots) in nodal.iter().zip(self.slots) {
            for &(s, weight) in slots {
                for k in self.free(s) {
                    out[s + k] += weight * value[k];
                }
            }
        }
        out
    }

    /// Components in which the dofs from `slot` on are not held.
    fn free(&self, slot: usize) -> impl Iterator<Item = usize> + '_ {
        (0..3).filter(move |&k| !self.held[slot + k])
    }

    /// Calls `entry` with row, column and value of every entry of the contact's tangent over the contact dofs.
    fn for_tangent(&self, at: &Trial, mut entry: impl FnMut(usize, usize, f64)) {
        for tangent in &at.evaluation.tangents {
            for &(to, to_weight) in &self.slots[tangent.node] {
                for &(by, by_weight) in &self.slots[tangent.by] {
                    for column in self.free(by) {
                        for row in self.free(to) {
                            entry(to + row, by + column, to_weight * by_weight * tangent.block[(row, column)]);
                        }
                    }
                }
            }
        }
    }

    fn trial(&self, x: Vec<f64>, plane: Plane, force_scale: f64, tangential: Tangential) -> Trial {
        let positions = self.positions(&x);
        let evaluation =
            self.surface.evaluate(self.friction, self.last, self.parts, &positions, &plane, tangential, true);
        let mut force = self.gather(&evaluation.residual);
        for ((f, x), shift) in force.iter_mut().zip(&x).zip(self.shift) {
            *f -= shift * x;
        }
        let mut h: Vec<f64> = x.iter().zip(self.y).map(|(x, y)| x - y).collect();
        // Far from the solution nodes may touch whose compliance is missing.
        let is_far = force[..self.factor.compliant_from()].iter().any(|force| *force != 0.0);
        if !is_far {
            self.factor.add_compliance_times(&force, &mut h);
        }
        let balance =
            imbalance(&evaluation.wrench, &self.force_target, self.surface.size_mm()).map(|force| force * force_scale);
        let square = h.iter().map(|v| v * v).sum::<f64>() + balance.iter().map(|v| v * v).sum::<f64>();
        let norm = if is_far { f64::INFINITY } else { square.sqrt() };
        Trial { x, plane, positions, evaluation, force, h, balance, norm }
    }

    /// Solves from the guess `x`, `plane`; with `predict_stick` the first linearisation lets no stuck point slip.
    ///
    /// `kept` is the factor that solved earlier steps of the increment; `go_on` is called before every iteration and
    /// may end the search.
    pub fn solve(
        &self,
        x: Vec<f64>,
        plane: Plane,
        predict_stick: bool,
        kept: &mut KeptFactor,
        go_on: &mut dyn FnMut() -> Result<(), SolveError>,
    ) -> Result<Solution, SolveError> {
        let predicted = if predict_stick { Tangential::Stick } else { Tangential::Law };
        let solved = |solution: &Solution| solution.norm <= self.tolerance;
        let mut found = self.search(x.clone(), plane, predicted, Steps::Shortened, kept, go_on)?;
        let mut iterations = found.iterations;
        let mut try_other = |x: Vec<f64>, plane: Plane, tangential, steps, found: &mut Solution| {
            let other = self.search(x, plane, tangential, steps, kept, go_on)?;
            iterations += other.iterations;
            // With constant tangential forces the solution is a different one.
            if tangential != Tangential::Held && other.norm < found.norm {
                *found = other;
                return Ok(None);
            }
            Ok::<_, SolveError>(Some(other))
        };
        if !solved(&found) {
            // The residual grows wherever a node starts to touch, even on the path to the solution: whole steps may
            // find it.
            try_other(x.clone(), plane, predicted, Steps::Whole, &mut found)?;
        }
        if !solved(&found) && !matches!(self.friction, Friction::Off) {
            // With strong friction, normal and tangential iterations may mislead each other: the normal forces are
            // solved first.
            let normal = try_other(x, plane, Tangential::Held, Steps::Whole, &mut found)?;
            if let Some(Solution { x, plane, .. }) = normal.filter(solved) {
                try_other(x.clone(), plane, Tangential::Law, Steps::Shortened, &mut found)?;
                if !solved(&found) {
                    try_other(x, plane, Tangential::Law, Steps::Whole, &mut found)?;
                }
            }
        }
        found.iterations = iterations;
        Ok(found)
    }

    fn search(
        &self,
        x: Vec<f64>,
        plane: Plane,
        tangential: Tangential,
        steps: Steps,
        kept: &mut KeptFactor,
        go_on: &mut dyn FnMut() -> Result<(), SolveError>,
    ) -> Result<Solution, SolveError> {
        let force_scale = self.force_scale();
        let mut current = self.trial(x, plane, force_scale, tangential);
        let mut iterations = 0;
        let lost = LOST * current.norm;
        while (iterations == 0 || current.norm > self.tolerance && current.norm < lost)
            && iterations < self.max_iterations
        {
            go_on()?;
            let predicted = tangential == Tangential::Stick && iterations == 0;
            let further = if tangential == Tangential::Stick { Tangential::Law } else { tangential };
            iterations += 1;
            let Some((dx, d_plane)) = self.newton_step(&current, force_scale, kept) else { break };
            let mut scale = 1.0;
            let next = loop {
                let x = current.x.iter().zip(&dx).map(|(x, d)| x + scale * d).collect();
                let place = std::array::from_fn(|k| current.plane.at[k] + scale * d_plane[k]);
                let plane = self.last.plane.moved_to(place);
                let trial = self.trial(self.settled(&current, x, &plane), plane, force_scale, further);
                // The predictor's step must not be shortened: its residual is that of another branch.
                if predicted || steps == Steps::Whole || trial.norm < current.norm * (1.0 - 0.1 * scale) {
                    break trial;
                }
                scale *= 0.5;
                if scale < 1.0 / 128.0 {
                    break trial;
                }
            };
            current = next;
        }
        let Trial { x, plane, force, norm, .. } = current;
        Ok(Solution { x, plane, force, iterations, norm })
    }

    /// The displacements `x` after a step from `before`, on a curved body with nodes moved along its normal so that normal forces
    /// change as they do to first order.
    ///
    /// A micrometre of penetration has more force than the whole contact. A node that touches keeps the gap of the
    /// linear step where the body curves away from it or towards it, and a node that starts to touch does so with next to none.
    fn settled(&self, before: &Trial, mut x: Vec<f64>, plane: &Plane) -> Vec<f64> {
        let body = self.surface.body();
        if body.is_plane() {
            return x;
        }
        let (frame_before, frame) = (self.surface.frame(&before.plane), self.surface.frame(plane));
        let positions = self.positions(&x);
        for (node, slots) in self.slots.iter().enumerate() {
            // A node that hangs between others follows them.
            let &[(slot, 1.0)] = slots.as_slice() else { continue };
            let (from, to) = (frame_before.to_plane(&before.positions[node]), frame.to_plane(&positions[node]));
            let (left, reached) = (body.spot(&from), body.spot(&to));
            let touch_mm = self.surface.touching_gap_mm(node, self.last);
            let gap_mm = if left.gap_mm < touch_mm {
                left.gap_mm + left.normal.dot(&(to - from))
            } else if reached.gap_mm < touch_mm {
                reached.gap_mm.max(touch_mm - FIRST_TOUCH_MM)
            } else {
                continue;
            };
            let step = frame.from_plane(&reached.at_gap(gap_mm)) - positions[node];
            self.free(slot).for_each(|k| x[slot + k] += step[k]);
        }
        x
    }

    /// Factor from an imbalance of driven forces to a displacement norm: the pad's compliance under an even load.
    fn force_scale(&self) -> f64 {
        let n = self.y.len();
        if n == 0 || self.force_target.iter().all(Option::is_none) {
            return 1.0;
        }
        let first = self.factor.compliant_from();
        let load: Vec<f64> = (0..n).map(|j| f64::from(u8::from(j >= first && j % 3 == 2))).collect();
        let mut moved = vec![0.0; n];
        self.factor.add_compliance_times(&load, &mut moved);
        let sum: f64 = moved.iter().skip(2).step_by(3).sum();
        let nodes = (n - first) as f64 / 3.0;
        sum / (nodes * nodes) * nodes.sqrt()
    }

    /// Newton step of all contact dofs and of the plane. None if the system is singular, or if the search diverged so
    /// far that nodes touch whose compliance is missing.
    fn newton_step(&self, at: &Trial, force_scale: f64, kept: &mut KeptFactor) -> Option<(Vec<f64>, [f64; 6])> {
        let driven: Vec<Driven> =
            (0..6).filter(|&k| self.force_target[k].is_some()).map(|k| self.driven(at, k)).collect();
        let is_far = |node: usize| self.slots[node].iter().any(|&(slot, _)| slot < self.factor.compliant_from());
        if at.evaluation.tangents.iter().any(|tangent| is_far(tangent.node) || is_far(tangent.by)) {
            return None;
        }
        let system = self.system(at, &driven, force_scale);
        let mut rhs: Vec<f64> = system.active.iter().map(|&i| -at.h[i]).collect();
        rhs.extend(driven.iter().map(|driven| -at.balance[driven.coordinate]));
        let tolerance = (STEP_ERROR * self.tolerance).max(LEAST_STEP_ERROR * at.norm);
        let step = kept.solve(&system, self.y.len(), &rhs, tolerance);
        if step.iter().any(|v| !v.is_finite()) {
            return None;
        }
        Some(self.whole_step(at, &system, &driven, &step))
    }

    /// The dofs of nodes in contact and those with a shift, and the place of each contact dof among them (usize::MAX
    /// without one).
    fn active(&self, at: &Trial) -> (Vec<usize>, Vec<usize>) {
        let n = self.y.len();
        let mut index = vec![usize::MAX; n];
        let mut active = Vec::new();
        let of_tangents = at.evaluation.tangents.iter().flat_map(|t| &self.slots[t.by]).flat_map(|&(s, _)| s..s + 3);
        let shifted = (0..n).filter(|&j| self.shift[j] != 0.0);
        for j in of_tangents.filter(|&j| !self.held[j]).chain(shifted) {
            if index[j] == usize::MAX {
                index[j] = active.len();
                active.push(j);
            }
        }
        (active, index)
    }

    /// How the contact changes with a force-driven coordinate.
    fn driven(&self, at: &Trial, coordinate: usize) -> Driven {
        let foot = self.surface.frame(&at.plane).foot();
        let twist = at.plane.twist(coordinate, &self.surface.reach);
        let nodal = self.surface.change_with_plane(&at.evaluation, &at.positions, &foot, &twist);
        Driven { coordinate, residual: self.gather(&nodal), nodal, twist }
    }

    /// Derivative of the driven component `coordinate` of the wrench over positions of nodes: terms of a sum, each with its
    /// node, over the length of the surface for moments.
    fn wrench_rows(&self, at: &Trial, coordinate: usize) -> Vec<(usize, Vector3<f64>)> {
        let frame = self.surface.frame(&at.plane);
        let foot = frame.foot();
        let component = WRENCH_OF[coordinate];
        let axis = frame.axis(component % 3);
        // The force is minus the residual.
        let row = |tangent: &NodeTangent| {
            if component < 3 {
                return (tangent.by, -(tangent.block.transpose() * axis));
            }
            let arm = at.positions[tangent.node] - foot;
            (tangent.by, -(tangent.block.transpose() * axis.cross(&arm)) / self.surface.size_mm())
        };
        let mut rows: Vec<(usize, Vector3<f64>)> = at.evaluation.tangents.iter().map(row).collect();
        if component >= 3 {
            let by_arm = |residual: &Vector3<f64>| -residual.cross(&axis) / self.surface.size_mm();
            rows.extend(at.touching().map(|node| (node, by_arm(&at.evaluation.residual[node]))));
        }
        rows
    }

    /// Derivative of the driven component `coordinate` of the wrench over the coordinate `driven`.
    fn wrench_change(&self, at: &Trial, coordinate: usize, driven: &Driven) -> f64 {
        let frame = self.surface.frame(&at.plane);
        let foot = frame.foot();
        let component = WRENCH_OF[coordinate];
        let axis = frame.axis(component % 3);
        // The axes of the wrenches turn with pitch and roll only, and the foot does not go along with slide and spin.
        let tilts = driven.coordinate >= crate::contact::plane::PITCH;
        let turn = if tilts { driven.twist.turn } else { Vector3::zeros() };
        let moves_foot = tilts || driven.coordinate == crate::contact::plane::DEPTH;
        let foot_motion = if moves_foot { driven.twist.motion } else { Vector3::zeros() };
        let mut sum = Vector3::zeros();
        for node in at.touching() {
            let force = -at.evaluation.residual[node];
            let change = -driven.nodal[node];
            sum += if component < 3 {
                change - turn.cross(&force)
            } else {
                let arm = at.positions[node] - foot;
                (arm.cross(&change) - foot_motion.cross(&force) - turn.cross(&arm.cross(&force)))
                    / self.surface.size_mm()
            };
        }
        sum.dot(&axis)
    }

    /// The linear system of the Newton step.
    fn system(&self, at: &Trial, driven: &[Driven], force_scale: f64) -> ContactSystem {
        let (active, index) = self.active(at);
        let mut entries = Vec::new();
        self.for_tangent(at, |row, column, value| entries.push((index[row] as u32, index[column] as u32, value)));
        let shifted = active.iter().enumerate().filter(|(_, j)| self.shift[**j] != 0.0);
        entries.extend(shifted.map(|(c, &j)| (c as u32, c as u32, -self.shift[j])));
        let balance = |of: &Driven| {
            let mut balance = vec![0.0; active.len()];
            for (node, row) in self.wrench_rows(at, of.coordinate) {
                for &(slot, weight) in &self.slots[node] {
                    for k in self.free(slot) {
                        balance[index[slot + k]] += force_scale * weight * row[k];
                    }
                }
            }
            balance.extend(driven.iter().map(|by| force_scale * self.wrench_change(at, of.coordinate, by)));
            balance
        };
        let balances = driven.iter().map(balance).collect();
        let residual = |driven: &Driven| active.iter().map(|&j| driven.residual[j]).collect();
        let driven = driven.iter().map(residual).collect();
        ContactSystem::new(self.factor, active, &entries, driven, balances)
    }

    /// The step of all contact dofs and of the plane from that of the unknowns: dx = -h - G df where no force changes.
    fn whole_step(&self, at: &Trial, system: &ContactSystem, driven: &[Driven], step: &[f64]) -> (Vec<f64>, [f64; 6]) {
        let (moved, turned) = step.split_at(system.active.len());
        let mut d_plane = [0.0; 6];
        driven.iter().zip(turned).for_each(|(driven, &step)| d_plane[driven.coordinate] = step);
        let mut d_force = vec![0.0; self.y.len()];
        system.active.iter().zip(system.force_change(step)).for_each(|(&j, force)| d_force[j] = force);
        let mut dx = at.h.clone();
        self.factor.add_compliance_times(&d_force, &mut dx);
        dx.iter_mut().for_each(|dx| *dx = -*dx);
        // The residual of the active dofs' equations is not multiplied by the contact's stiffness again.
        system.active.iter().zip(moved).for_each(|(&j, &moved)| dx[j] = moved);
        (dx, d_plane)
    }
}

/// A force-driven coordinate of the plane and the change of the contact forces with it.
struct Driven {
    coordinate: usize,
    twist: Twist,
    /// Derivative of the residual of each surface node.
    nodal: Vec<Vector3<f64>>,
    /// The same, contact dofs.
    residual: Vec<f64>,
}
