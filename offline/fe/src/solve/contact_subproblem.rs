//! The contact subproblem of one equilibrium iteration: the bulk is linear, the contact is not.
//!
//! With `G` the compliance of the contact dofs and `y` where they would go without contact forces, find the
//! displacement `x` with `h(x) = x − y + G f(x) = 0`, `f` the contact residual; a force-driven axis adds the
//! plane's coordinate as an unknown and the force balance as an equation. Newton's method with the exact
//! non-symmetric tangent on the dofs of faces in contact, backtracking on |h|.

use nalgebra::Vector3;

use super::increment::SolveError;
use super::linear::{DenseLu, Factor};
use crate::contact::{ContactState, Evaluation, Friction, Plane, Surface};

/// What stays the same during the iterations.
pub(super) struct ContactSubproblem<'a> {
    pub surface: &'a Surface,
    pub friction: &'a Friction,
    pub last: &'a ContactState,
    pub factor: &'a Factor,
    /// Positions of the surface nodes at x = 0.
    pub base: &'a [Vector3<f64>],
    /// First contact dof (0 based among contact dofs) of each surface node; None if it does not move freely.
    pub slot: &'a [Option<usize>],
    /// Contact dofs that are held.
    pub held: &'a [bool],
    /// Stiffness that the factor holds on top of the bulk's, per contact dof, N/mm; taken off again here.
    pub shift: &'a [f64],
    /// Unloaded displacement, mm.
    pub y: &'a [f64],
    /// Force that a force-driven axis (x, y, z) must reach, N.
    pub force_target: [Option<f64>; 3],
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

struct Trial {
    x: Vec<f64>,
    plane: Plane,
    evaluation: Evaluation,
    force: Vec<f64>,
    h: Vec<f64>,
    /// Violation of the force balance of driven axes, mm by `force_scale`.
    balance: [f64; 3],
    norm: f64,
}

impl ContactSubproblem<'_> {
    fn positions(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        self.base
            .iter()
            .zip(self.slot)
            .map(|(base, slot)| match slot {
                Some(s) => base + Vector3::new(x[*s], x[s + 1], x[s + 2]),
                None => *base,
            })
            .collect()
    }

    fn gather(&self, nodal: &[Vector3<f64>]) -> Vec<f64> {
        let mut out = vec![0.0; self.y.len()];
        for (value, slot) in nodal.iter().zip(self.slot) {
            if let Some(s) = slot {
                for k in 0..3 {
                    if !self.held[s + k] {
                        out[s + k] = value[k];
                    }
                }
            }
        }
        out
    }

    fn trial(&self, x: Vec<f64>, plane: Plane, force_scale: f64, predict: bool, tangent: bool) -> Trial {
        let evaluation = self.surface.evaluate(self.friction, self.last, &self.positions(&x), plane, predict, tangent);
        let mut force = self.gather(&evaluation.residual);
        for ((f, x), shift) in force.iter_mut().zip(&x).zip(self.shift) {
            *f -= shift * x;
        }
        let mut h: Vec<f64> = x.iter().zip(self.y).map(|(x, y)| x - y).collect();
        self.factor.add_compliance_times(&force, &mut h);
        let balance = std::array::from_fn(|k| {
            self.force_target[k].map_or(0.0, |target| (evaluation.force[k] - target) * force_scale)
        });
        let norm = (h.iter().map(|v| v * v).sum::<f64>() + balance.iter().map(|v| v * v).sum::<f64>()).sqrt();
        Trial { x, plane, evaluation, force, h, balance, norm }
    }

    /// Solves from the guess `x`, `plane`; with `predict_stick` the first linearisation lets no stuck point slip.
    ///
    /// `go_on` is asked before every iteration.
    pub fn solve(
        &self,
        x: Vec<f64>,
        plane: Plane,
        predict_stick: bool,
        go_on: &mut dyn FnMut() -> Result<(), SolveError>,
    ) -> Result<Solution, SolveError> {
        let force_scale = self.force_scale();
        let mut current = self.trial(x, plane, force_scale, predict_stick, true);
        let mut iterations = 0;
        while (iterations == 0 || !(current.norm <= self.tolerance)) && iterations < self.max_iterations {
            go_on()?;
            let predicted = predict_stick && iterations == 0;
            iterations += 1;
            let Some((dx, d_plane)) = self.newton_step(&current, force_scale) else { break };
            let mut scale = 1.0;
            let next = loop {
                let x = current.x.iter().zip(&dx).map(|(x, d)| x + scale * d).collect();
                let plane = std::array::from_fn(|k| current.plane[k] + scale * d_plane[k]);
                let trial = self.trial(x, plane, force_scale, false, true);
                // The predictor's step must not be shortened: its residual is that of another branch.
                if predicted || trial.norm < current.norm * (1.0 - 0.1 * scale) {
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

    /// What turns an imbalance of driven forces into a displacement norm: the pad's compliance under an even load.
    fn force_scale(&self) -> f64 {
        let n = self.y.len();
        if n == 0 || self.force_target.iter().all(Option::is_none) {
            return 1.0;
        }
        let vertical = |j: usize| self.factor.compliance_column(j).iter().skip(2).step_by(3).sum::<f64>();
        let sum: f64 = (2..n).step_by(3).map(vertical).sum();
        let nodes = n as f64 / 3.0;
        sum / (nodes * nodes) * nodes.sqrt()
    }

    /// Newton step of all contact dofs and of the plane; None if the system is singular.
    fn newton_step(&self, at: &Trial, force_scale: f64) -> Option<(Vec<f64>, Plane)> {
        let unknowns = self.unknowns(at);
        let plane_force: Vec<Vec<f64>> = unknowns.driven.iter().map(|&k| self.force_per_plane(at, k)).collect();
        let (matrix, size) = self.system(at, &unknowns, &plane_force, force_scale);
        let mut step: Vec<f64> = unknowns.active.iter().map(|&i| -at.h[i]).collect();
        step.extend(unknowns.driven.iter().map(|&k| -at.balance[k]));
        DenseLu::new(&matrix, size).solve(&mut step);
        if step.iter().any(|v| !v.is_finite()) {
            return None;
        }
        Some(self.whole_step(at, &unknowns, &plane_force, &step))
    }

    /// The dofs of faces in contact, those with a shift, and the force-driven axes.
    fn unknowns(&self, at: &Trial) -> Unknowns {
        let n = self.y.len();
        let mut index = vec![usize::MAX; n];
        let mut active = Vec::new();
        for tangent in &at.evaluation.tangents {
            for node in self.surface.faces[tangent.face] {
                if let Some(slot) = self.slot[node] {
                    for k in 0..3 {
                        if index[slot + k] == usize::MAX && !self.held[slot + k] {
                            index[slot + k] = active.len();
                            active.push(slot + k);
                        }
                    }
                }
            }
        }
        for j in 0..n {
            if self.shift[j] != 0.0 && index[j] == usize::MAX {
                index[j] = active.len();
                active.push(j);
            }
        }
        let driven = (0..3).filter(|&k| self.force_target[k].is_some()).collect();
        Unknowns { index, active, driven }
    }

    /// Contact dof of row or column `a` of a face's tangent, if it moves freely.
    fn face_dof(&self, face: usize, a: usize) -> Option<usize> {
        let node = self.surface.faces[face][a / 3];
        self.slot[node].map(|s| s + a % 3).filter(|&d| !self.held[d])
    }

    /// Derivative of the contact residual over the plane's coordinate `axis`, contact dofs, N/mm.
    fn force_per_plane(&self, at: &Trial, axis: usize) -> Vec<f64> {
        let nodal: Vec<Vector3<f64>> = at.evaluation.plane_columns.iter().map(|c| c[axis]).collect();
        self.gather(&nodal)
    }

    /// The matrix of the Newton step, column-major, and its size: equations of the active dofs, then force balances.
    fn system(&self, at: &Trial, unknowns: &Unknowns, plane_force: &[Vec<f64>], force_scale: f64) -> (Vec<f64>, usize) {
        let Unknowns { index, active, driven } = unknowns;
        let (na, size) = (active.len(), active.len() + driven.len());
        // Rows of G on the active dofs, contiguous per column.
        let mut g = vec![0.0; na * na];
        for (c, &j) in active.iter().enumerate() {
            let column = self.factor.compliance_column(j);
            for (r, &i) in active.iter().enumerate() {
                g[c * na + r] = column[i];
            }
        }
        let mut matrix = vec![0.0; size * size];
        for (c, &j) in active.iter().enumerate() {
            let target = &mut matrix[c * size..c * size + na];
            if self.shift[j] != 0.0 {
                for (t, s) in target.iter_mut().zip(&g[c * na..(c + 1) * na]) {
                    *t -= s * self.shift[j];
                }
            }
            target[c] += 1.0;
        }
        // d(balance_k)/d(column) = -force_scale * sum over nodes of the residual's component k.
        for tangent in &at.evaluation.tangents {
            for column in 0..12 {
                let Some(j) = self.face_dof(tangent.face, column) else { continue };
                let c = index[j];
                let target = &mut matrix[c * size..(c + 1) * size];
                for row in 0..12 {
                    let value = tangent.block[column][row];
                    if value == 0.0 {
                        continue;
                    }
                    if let Some(i) = self.face_dof(tangent.face, row) {
                        let source = &g[index[i] * na..(index[i] + 1) * na];
                        for (t, s) in target[..na].iter_mut().zip(source) {
                            *t += s * value;
                        }
                    }
                    if let Some(place) = driven.iter().position(|&k| k == row % 3) {
                        target[na + place] -= force_scale * value;
                    }
                }
            }
        }
        for (p, &k) in driven.iter().enumerate() {
            let target = &mut matrix[(na + p) * size..(na + p + 1) * size];
            for (c, &j) in active.iter().enumerate() {
                if plane_force[p][j] != 0.0 {
                    for (t, s) in target[..na].iter_mut().zip(&g[c * na..(c + 1) * na]) {
                        *t += s * plane_force[p][j];
                    }
                }
            }
            for (q, &axis) in driven.iter().enumerate() {
                let sum = at.evaluation.plane_columns.iter().map(|column| column[k][axis]).sum::<f64>();
                target[na + q] = -force_scale * sum;
            }
        }
        (matrix, size)
    }

    /// The step of all contact dofs and of the plane from that of the unknowns: dx = -h - G df.
    fn whole_step(&self, at: &Trial, unknowns: &Unknowns, plane_force: &[Vec<f64>], step: &[f64]) -> (Vec<f64>, Plane) {
        let Unknowns { index, active, driven } = unknowns;
        let mut d_plane = [0.0; 3];
        for (p, &k) in driven.iter().enumerate() {
            d_plane[k] = step[active.len() + p];
        }
        let mut d_force = vec![0.0; self.y.len()];
        for (c, &j) in active.iter().enumerate() {
            d_force[j] -= self.shift[j] * step[c];
        }
        for tangent in &at.evaluation.tangents {
            for column in 0..12 {
                let Some(j) = self.face_dof(tangent.face, column) else { continue };
                for row in 0..12 {
                    if let Some(i) = self.face_dof(tangent.face, row) {
                        d_force[i] += tangent.block[column][row] * step[index[j]];
                    }
                }
            }
        }
        for (p, &k) in driven.iter().enumerate() {
            for (d, f) in d_force.iter_mut().zip(&plane_force[p]) {
                *d += f * d_plane[k];
            }
        }
        let mut dx = at.h.clone();
        self.factor.add_compliance_times(&d_force, &mut dx);
        for d in &mut dx {
            *d = -*d;
        }
        (dx, d_plane)
    }
}

/// Unknowns of a Newton step.
struct Unknowns {
    /// Place of each contact dof among the active ones; usize::MAX if it is none.
    index: Vec<usize>,
    /// Active contact dofs.
    active: Vec<usize>,
    /// Force-driven axes of the plane.
    driven: Vec<usize>,
}
