//! Sums of the elements' forces and stiffnesses over the dofs that move their nodes.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::super::configuration::{inverse_left_jacobian_symmetric, rotation_vector};
use super::super::group::{BlockPlace, Group};
use super::Body;
use crate::assembly::{Configuration, Deformed};
use crate::element::Tangent;

impl Body {
    /// Adds the forces of a group's elements (N, dof order); returns its smallest det F.
    pub(super) fn add_forces<const N: usize, const Q: usize>(
        &self,
        group: &Group<N, Q>,
        deformed: Deformed,
        out: &mut [f64],
    ) -> f64 {
        let at = deformed.at;
        let forces = group.forces(deformed);
        let lanes: [[[f64; 8]; 3]; N] = forces.force.map(|node| node.map(|f| f.to_array()));
        match &group.plain {
            Some(scatter) => {
                for a in 0..N {
                    for lane in 0..group.batch.len {
                        let dof = scatter.dof[a][lane];
                        if dof != usize::MAX {
                            for i in 0..3 {
                                out[dof + i] += lanes[a][i][lane];
                            }
                        }
                    }
                }
            }
            None => {
                for (a, lanes) in lanes.iter().enumerate() {
                    for lane in 0..group.batch.len {
                        let node = group.batch.nodes[a][lane];
                        let force = Vector3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane]);
                        for part in self.dofs.parts(node, at.x[node as usize] - at.rigid_centre) {
                            let contribution = part.matrix.transpose() * force;
                            for i in 0..part.width {
                                out[part.dof + i] += contribution[i];
                            }
                        }
                    }
                }
            }
        }
        let min_j = forces.min_j.to_array();
        min_j[..group.batch.len].iter().fold(f64::INFINITY, |m, &j| if j < m || j.is_nan() { j } else { m })
    }

    /// Adds the stiffness of a group's elements, `tangent`, to the values on the pattern of the dofs.
    pub(super) fn add_tangent<const N: usize, const Q: usize>(
        &self,
        group: &Group<N, Q>,
        at: &Configuration,
        tangent: &Tangent<N>,
        values: &mut [f64],
    ) {
        match &group.plain {
            Some(scatter) => {
                let mut pair = 0;
                for a in 0..N {
                    for b in 0..=a {
                        let block: [[[f64; 8]; 3]; 3] = tangent.block[a][b].map(|row| row.map(|v| v.to_array()));
                        for lane in 0..group.batch.len {
                            match scatter.place[pair][lane] {
                                BlockPlace::None => {}
                                BlockPlace::Straight(place) => {
                                    for c in 0..3 {
                                        for i in 0..3 {
                                            values[place[c] as usize + i] += block[i][c][lane];
                                        }
                                    }
                                }
                                BlockPlace::Transposed(place) => {
                                    for c in 0..3 {
                                        for i in 0..3 {
                                            values[place[c] as usize + i] += block[c][i][lane];
                                        }
                                    }
                                }
                                BlockPlace::Diagonal(place) => {
                                    for c in 0..3 {
                                        for i in c..3 {
                                            values[place[c] as usize + i - c] += block[i][c][lane];
                                        }
                                    }
                                }
                            }
                        }
                        pair += 1;
                    }
                }
            }
            None => {
                for lane in 0..group.batch.len {
                    self.add_constrained(group, at, tangent, lane, values);
                }
            }
        }
    }

    /// Adds `T^T K T` of one element whose nodes follow others.
    fn add_constrained<const N: usize, const Q: usize>(
        &self,
        group: &Group<N, Q>,
        at: &Configuration,
        tangent: &Tangent<N>,
        lane: usize,
        values: &mut [f64],
    ) {
        let mut dofs: Vec<usize> = Vec::new();
        let mut parts = Vec::new();
        for a in 0..N {
            let node = group.batch.nodes[a][lane];
            for part in self.dofs.parts(node, at.x[node as usize] - at.rigid_centre) {
                dofs.extend(part.dof..part.dof + part.width);
                parts.push((a, part));
            }
        }
        dofs.sort_unstable();
        dofs.dedup();
        let mut follow: DMatrix<f64> = DMatrix::zeros(3 * N, dofs.len());
        for (a, part) in &parts {
            let first = dofs.binary_search(&part.dof).expect("listed above");
            for i in 0..3 {
                for k in 0..part.width {
                    follow[(3 * a + i, first + k)] += part.matrix[(i, k)];
                }
            }
        }
        let mut k: DMatrix<f64> = DMatrix::zeros(3 * N, 3 * N);
        for a in 0..N {
            for b in 0..=a {
                for i in 0..3 {
                    for j in 0..3 {
                        let value = tangent.block[a][b][i][j].to_array()[lane];
                        k[(3 * a + i, 3 * b + j)] = value;
                        k[(3 * b + j, 3 * a + i)] = value;
                    }
                }
            }
        }
        let reduced: DMatrix<f64> = follow.transpose() * k * &follow;
        for (c, &column) in dofs.iter().enumerate() {
            for (r, &row) in dofs.iter().enumerate().skip(c) {
                values[self.dofs.entry(row, column)] += reduced[(r, c)];
            }
        }
    }

    /// Second derivative of the rigid motion times the forces on it, and the joint's stiffness.
    pub(super) fn add_rigid_geometry(&self, deformed: Deformed, values: &mut [f64]) {
        let at = deformed.at;
        let Some(dof) = self.dofs.rigid_dof else { return };
        let mut nodal = vec![Vector3::zeros(); at.x.len()];
        for group in self.hexes.iter().filter(|g| g.plain.is_none()) {
            group.accumulate(&group.forces(deformed), &mut nodal);
        }
        for group in self.tets.iter().filter(|g| g.plain.is_none()) {
            group.accumulate(&group.forces(deformed), &mut nodal);
        }
        let mut geometric = Matrix3::zeros();
        for (node, _) in &self.rigid_arms {
            let arm = at.x[*node as usize] - at.rigid_centre;
            let force = nodal[*node as usize];
            let outer = arm * force.transpose();
            geometric += (outer + outer.transpose()) * 0.5 - Matrix3::identity() * arm.dot(&force);
        }
        geometric +=
            inverse_left_jacobian_symmetric(rotation_vector(&at.rigid_rotation)) * self.joint.rotation_nmm_per_rad;
        for c in 0..3 {
            values[self.dofs.entry(dof + c, dof + c)] += self.joint.translation_n_per_mm;
            for r in c..3 {
                values[self.dofs.entry(dof + 3 + r, dof + 3 + c)] += geometric[(r, c)];
            }
        }
    }
}
