//! The composite 10-node tetrahedron.
//!
//! The displacement is linear on each of twelve sub-tetrahedra: one at every corner, and eight around the centre of the
//! octahedron that they leave, whose displacement is the mean of the six edge nodes'. The deformation gradient is the
//! projection of the piecewise constant one on linear functions of the element (Thoutireddy, Molinari, Repetto & Ortiz
//! 2002; Guo, Ortiz, Belytschko & Repetto 2000; Ostien, Foulk, Mota & Veilleux 2016), taken at four points. The
//! dilatation is averaged over the element like that of the hexahedra, but for a share of the volumetric law that every
//! point keeps: an average alone leaves three modes of an element without stiffness.
//!
//! On a face the displacement is linear on four triangles, so that every node of a face has a positive share of a
//! uniform pressure (corner 1/12, edge 1/4), which the plain quadratic tetrahedron (corner 0) has not: contact at nodes
//! needs it.

use fingerpad_formats::mesh;
use nalgebra::{Matrix4, Vector3, Vector4};

use super::kernel::{Batch, PointsOf};

/// Composite 10-node tetrahedra with 4 points.
pub type Tet10 = Batch<10, 4>;

/// Share of the volumetric law that the points keep.
const POINT_SHARE: f64 = 0.05;

/// Barycentric coordinates of the ten nodes and the centre.
const PLACES: [[f64; 4]; 11] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
    [0.5, 0.5, 0.0, 0.0],
    [0.0, 0.5, 0.5, 0.0],
    [0.5, 0.0, 0.5, 0.0],
    [0.5, 0.0, 0.0, 0.5],
    [0.0, 0.5, 0.0, 0.5],
    [0.0, 0.0, 0.5, 0.5],
    [0.25, 0.25, 0.25, 0.25],
];

impl Tet10 {
    /// Batch of tetrahedra (VTK_QUADRATIC_TETRA order), straight or curved; None if a part of one has no positive
    /// volume.
    pub fn new(elements: &[[u32; 10]], positions: &[Vector3<f64>]) -> Option<Self> {
        let mut batch = Self::with_points(elements, |nodes| points(nodes.map(|n| positions[n as usize])))?;
        batch.point_share = POINT_SHARE;
        Some(batch)
    }
}

/// Volumes and projected shape gradients of the four points.
fn points(places: [Vector3<f64>; 10]) -> PointsOf<10, 4> {
    // Integrals over the element of the four linear functions, of their products, and of them times shape gradients.
    let (mut integral, mut product, mut moment) = (Vector4::zeros(), Matrix4::zeros(), [[Vector3::zeros(); 10]; 4]);
    for (part, corners) in mesh::Tet10::PARTS.into_iter().zip(mesh::Tet10::parts_of(places)) {
        let (volume, gradient) = linear(corners)?;
        let values = part.map(|n| Vector4::from(PLACES[n]));
        let sum: Vector4<f64> = values.iter().sum();
        integral += sum * (volume / 4.0);
        let squares: Matrix4<f64> = values.iter().map(|v| v * v.transpose()).sum();
        product += (sum * sum.transpose() + squares) * (volume / 20.0);
        for (n, gradient) in part.into_iter().zip(gradient) {
            for (moment, value) in moment.iter_mut().zip(sum.iter()) {
                let share = gradient * (value * volume / 4.0);
                match n {
                    mesh::Tet10::CENTRE => moment[4..].iter_mut().for_each(|m| *m += share / 6.0),
                    _ => moment[n] += share,
                }
            }
        }
    }
    let to_linear = product.try_inverse()?;
    // Points of the four-point rule; their volumes integrate the linear functions exactly on curved elements too.
    let off = (5.0 - 5f64.sqrt()) / 20.0;
    let values = Matrix4::from_element(off) + Matrix4::identity() * (1.0 - 4.0 * off);
    let volumes = values.try_inverse()? * integral;
    let mut gradients = [[[0.0; 3]; 10]; 4];
    for q in 0..4 {
        let weights = to_linear * values.column(q);
        for a in 0..10 {
            gradients[q][a] = (0..4).map(|beta| moment[beta][a] * weights[beta]).sum::<Vector3<f64>>().into();
        }
    }
    volumes.iter().all(|v| *v > 0.0).then_some((volumes.into(), gradients))
}

/// Volume and shape gradients of a 4-node tetrahedron; None if its volume is not positive.
fn linear(corners: [Vector3<f64>; 4]) -> Option<(f64, [Vector3<f64>; 4])> {
    let [a, b, c] = [1, 2, 3].map(|n| corners[n] - corners[0]);
    let six_volumes = a.cross(&b).dot(&c);
    let others = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|g| g / six_volumes);
    let first = -(others[0] + others[1] + others[2]);
    (six_volumes > 0.0).then_some((six_volumes / 6.0, [first, others[0], others[1], others[2]]))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Matrix3};

    use super::super::{Constitutive, Tangent};
    use super::*;
    use crate::material::{Ogden, SaintVenantKirchhoff};

    /// An irregular tetrahedron whose edge nodes lie `bulge` off their edges' middles.
    fn tetrahedron(bulge: f64) -> Vec<Vector3<f64>> {
        let corners = [[0.0, 0.0, 0.1], [1.3, 0.1, 0.0], [0.2, 1.1, -0.1], [0.3, 0.2, 0.9]].map(Vector3::<f64>::from);
        let mut nodes = corners.to_vec();
        for (n, [a, b]) in [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]].into_iter().enumerate() {
            let turn = n as f64;
            let off = Vector3::new(turn.sin(), turn.cos(), (2.0 * turn).sin()) * bulge;
            nodes.push((corners[a] + corners[b]) / 2.0 + off);
        }
        nodes
    }

    const NODES: [[u32; 10]; 1] = [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]];
    const LAW: Ogden = Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 };

    #[test]
    fn parts_fill_the_element_and_gradients_reproduce_linear_fields() {
        for bulge in [0.0, 0.05] {
            let nodes = tetrahedron(bulge);
            let (volumes, gradients) = points(NODES[0].map(|n| nodes[n as usize])).unwrap();
            if bulge == 0.0 {
                let whole = linear([0, 1, 2, 3].map(|n: usize| nodes[n])).unwrap().0;
                assert!(volumes.iter().all(|v| (v / whole - 0.25).abs() < 1e-14), "{volumes:?} of {whole}");
            }
            for gradient in gradients {
                let sum: Matrix3<f64> = nodes.iter().zip(gradient).map(|(x, g)| x * Vector3::from(g).transpose()).sum();
                assert!((sum - Matrix3::identity()).amax() < 1e-13, "{sum}");
                assert!(gradient.iter().map(|g| Vector3::from(*g)).sum::<Vector3<f64>>().amax() < 1e-13);
            }
        }
    }

    #[test]
    fn uniform_stress_gives_every_node_of_a_face_the_share_of_linear_triangles() {
        let nodes = tetrahedron(0.0);
        let (volumes, gradients) = points(NODES[0].map(|n| nodes[n as usize])).unwrap();
        let mut expected = [Vector3::zeros(); 10];
        for face in crate::mesh::TET10_FACES {
            for triangle in crate::mesh::FACE_TRIANGLES {
                let [a, b, c] = triangle.map(|n| face[n]);
                let area = (nodes[b] - nodes[a]).cross(&(nodes[c] - nodes[a])) / 2.0;
                [a, b, c].into_iter().for_each(|n| expected[n] += area / 3.0);
            }
        }
        for a in 0..10 {
            let force: Vector3<f64> = (0..4).map(|q| Vector3::from(gradients[q][a]) * volumes[q]).sum();
            assert!((force - expected[a]).amax() < 1e-14, "node {a}: {force} {}", expected[a]);
        }
    }

    /// Eigenvalues of the stiffness, ascending, N/mm.
    fn eigenvalues(law: &impl Constitutive) -> Vec<f64> {
        let nodes = tetrahedron(0.0);
        let mut tangent = Tangent::new();
        Tet10::new(&NODES, &nodes).unwrap().tangent(law, &nodes, &mut tangent);
        let full = DMatrix::from_fn(30, 30, |r, c| {
            let (a, b, i, k) = (r / 3, c / 3, r % 3, c % 3);
            let entry = if a >= b { tangent.block[a][b][i][k] } else { tangent.block[b][a][k][i] };
            entry.to_array()[0]
        });
        let mut eigenvalues: Vec<f64> = full.symmetric_eigenvalues().iter().copied().collect();
        eigenvalues.sort_by(f64::total_cmp);
        eigenvalues
    }

    #[test]
    fn only_rigid_motions_are_free_of_stiffness() {
        let young_mpa = 0.1;
        let whole = eigenvalues(&SaintVenantKirchhoff { young_mpa, poisson: 0.3 });
        assert!(whole[5].abs() < 1e-12 && whole[6] > 1e-3 * young_mpa, "{whole:?}");
        // A mean dilatation alone would not see the three quadratic conformal maps x (b.x) - b |x|^2/2, whose strain is a
        // dilatation alone, linear over the element.
        let soft = eigenvalues(&LAW);
        assert!(soft[5].abs() < 1e-12 && soft[6] > 1e-3 * LAW.mu_mpa, "{soft:?}");
    }

    #[test]
    fn an_element_turned_inside_out_in_part_is_refused() {
        let mut nodes = tetrahedron(0.0);
        nodes[4] = nodes[1] + (nodes[1] - nodes[0]) * 0.1;
        assert!(Tet10::new(&NODES, &nodes).is_none());
    }
}
