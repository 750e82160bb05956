//! The 10-node tetrahedron.
//!
//! The displacement is linear on each of twelve sub-tetrahedra: one at every corner, and eight around the centre of the
//! octahedron between them, whose displacement is the mean of the six edge nodes' (the composite tetrahedron of Guo,
//! Ortiz, Belytschko & Repetto 2000; Thoutireddy, Molinari, Repetto & Ortiz 2002; Ostien, Foulk, Mota & Veilleux 2016).
//! They give the mean deformation gradient of the element and its volume. The variation of the gradient over the
//! element is that of the quadratic displacement. The projection of the twelve gradients on linear functions, as in
//! these papers, gives three quarters of that variation: a Hertz contact of ten nodes a radius is then 1.0 % too soft,
//! with the quadratic's 0.6 %. Cook's membrane of 8 x 8 cells is 1.6 and 2.3 % too stiff.
//!
//! The dilatation is one of the element, like that of the hexahedra: the volume of the twelve deformed parts over that
//! of the undeformed ones. The volumes of all elements so sum to that inside the body's surface for any positions of
//! the nodes inside, and a uniform pressure has no stiffness of its own, of either sign.
//!
//! A single element has three modes without stiffness besides the rigid motions: the quadratic conformal maps `2 (a .
//! x) x - a |x|²`, whose strain is a dilatation alone, linear over the element; the element resists its mean only. They
//! are no modes of a mesh. On a face that two elements share, their maps agree only with equal `a` across the line
//! between the two points about which the dilatations have no mean; with three neighbours around an element no mode
//! remains.
//!
//! On a face the displacement is linear on four triangles, so that every node of a face has a positive share of a
//! uniform pressure (corner 1/12, edge 1/4). Contact at nodes needs it; the plain quadratic tetrahedron has a share of
//! 0 at the corners.

use fingerpad_formats::mesh;
use nalgebra::{Matrix3, RowVector3, Vector3};

use super::kernel::{Batch, PointsOf};

/// 10-node tetrahedra with 4 points.
pub type Tet10 = Batch<10, 4>;

/// The linear triangles of the four faces, counter-clockwise from outside.
const SURFACE: [[usize; 3]; 16] = [
    [0, 6, 4],
    [6, 2, 5],
    [4, 5, 1],
    [6, 5, 4],
    [0, 4, 7],
    [4, 1, 8],
    [7, 8, 3],
    [4, 8, 7],
    [1, 5, 8],
    [5, 2, 9],
    [8, 9, 3],
    [5, 9, 8],
    [2, 6, 9],
    [6, 0, 7],
    [9, 7, 3],
    [6, 7, 9],
];

impl Tet10 {
    /// Batch of tetrahedra (VTK_QUADRATIC_TETRA order), straight or curved; None if a part of one has no positive
    /// volume.
    pub fn new(elements: &[[u32; 10]], positions: &[Vector3<f64>]) -> Option<Self> {
        let mut batch = Self::with_points(elements, |nodes| points(nodes.map(|n| positions[n as usize])))?;
        batch.surface = &SURFACE;
        Some(batch)
    }
}

/// Volumes and shape gradients of the four points: those of the quadratic shape functions, moved so that their mean is
/// that of the linear parts.
fn points(places: [Vector3<f64>; 10]) -> PointsOf<10, 4> {
    let (whole, mean) = of_parts(places)?;
    // The rule of degree 2.
    let off = (5.0 - 5f64.sqrt()) / 20.0;
    let (mut volumes, mut gradients) = ([0.0; 4], [[Vector3::zeros(); 10]; 4]);
    for q in 0..4 {
        (volumes[q], gradients[q]) =
            quadratic(places, std::array::from_fn(|k| if k == q { 1.0 - 3.0 * off } else { off }))?;
    }
    let sum: f64 = volumes.iter().sum();
    let volumes = volumes.map(|volume| volume * whole / sum);
    for a in 0..10 {
        let own: Vector3<f64> = (0..4).map(|q| gradients[q][a] * (volumes[q] / whole)).sum();
        gradients.iter_mut().for_each(|gradient| gradient[a] += mean[a] - own);
    }
    Some((volumes, gradients.map(|point| point.map(Into::into))))
}

/// Volume of the twelve parts and the mean of their shape gradients; None if one has no positive volume.
fn of_parts(places: [Vector3<f64>; 10]) -> Option<(f64, [Vector3<f64>; 10])> {
    let (mut whole, mut integral) = (0.0, [Vector3::zeros(); 10]);
    for (part, corners) in mesh::Tet10::PARTS.into_iter().zip(mesh::Tet10::parts_of(places)) {
        let (volume, gradient) = linear(corners)?;
        whole += volume;
        for (n, gradient) in part.into_iter().zip(gradient) {
            match n {
                mesh::Tet10::CENTRE => integral[4..].iter_mut().for_each(|sum| *sum += gradient * (volume / 6.0)),
                _ => integral[n] += gradient * volume,
            }
        }
    }
    Some((whole, integral.map(|sum| sum / whole)))
}

/// Jacobian and gradients of the quadratic shape functions at barycentric coordinates; None if it is not positive.
fn quadratic(places: [Vector3<f64>; 10], at: [f64; 4]) -> Option<(f64, [Vector3<f64>; 10])> {
    const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
    let mut by_coordinate = [[0.0; 4]; 10];
    for k in 0..4 {
        by_coordinate[k][k] = 4.0 * at[k] - 1.0;
    }
    for (edge, [a, b]) in EDGES.into_iter().enumerate() {
        by_coordinate[4 + edge][a] = 4.0 * at[b];
        by_coordinate[4 + edge][b] = 4.0 * at[a];
    }
    let reference = by_coordinate.map(|g| RowVector3::new(g[1] - g[0], g[2] - g[0], g[3] - g[0]));
    let jacobian: Matrix3<f64> = places.iter().zip(&reference).map(|(x, g)| x * g).sum();
    let determinant = jacobian.determinant();
    let inverse = jacobian.try_inverse()?;
    (determinant > 0.0).then(|| (determinant, reference.map(|g| (g * inverse).transpose())))
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
    use nalgebra::DMatrix;

    use super::super::Tangent;
    use super::*;
    use crate::material::Ogden;

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
                assert!(SURFACE.contains(&[a, b, c]));
                let area = (nodes[b] - nodes[a]).cross(&(nodes[c] - nodes[a])) / 2.0;
                [a, b, c].into_iter().for_each(|n| expected[n] += area / 3.0);
            }
        }
        for a in 0..10 {
            let force: Vector3<f64> = (0..4).map(|q| Vector3::from(gradients[q][a]) * volumes[q]).sum();
            assert!((force - expected[a]).amax() < 1e-14, "node {a}: {force} {}", expected[a]);
        }
    }

    #[test]
    fn the_volume_is_that_of_the_deformed_parts() {
        let nodes = tetrahedron(0.05);
        let batch = Tet10::new(&NODES, &nodes).unwrap();
        let (v, _) = batch.enclosed(&batch.gather(&nodes));
        let parts: f64 =
            mesh::Tet10::parts_of(std::array::from_fn(|n| nodes[n])).map(|p| linear(p).unwrap().0).iter().sum();
        assert!((v.to_array()[0] / parts - 1.0).abs() < 1e-14, "{v} {parts}");
        assert!((batch.volumes()[0] / parts - 1.0).abs() < 1e-14);
    }

    /// Stiffness of a mesh of one law, shape (3 nodes, 3 nodes), N/mm, with its nodes at `places`.
    fn stiffness(elements: &[[u32; 10]], rest: &[Vector3<f64>], places: &[Vector3<f64>]) -> DMatrix<f64> {
        let mut whole = DMatrix::zeros(3 * rest.len(), 3 * rest.len());
        let mut tangent = Tangent::new();
        for element in elements {
            Tet10::new(&[*element], rest).unwrap().tangent(&LAW, places, &mut tangent);
            for (a, b) in (0..10).flat_map(|a| (0..=a).map(move |b| (a, b))) {
                for (i, k) in (0..3).flat_map(|i| [0, 1, 2].map(|k| (i, k))) {
                    let entry = tangent.block[a][b][i][k].to_array()[0];
                    let [row, column] = [(a, i), (b, k)].map(|(n, i)| 3 * element[n] as usize + i);
                    whole[(row, column)] += entry;
                    if a != b {
                        whole[(column, row)] += entry;
                    }
                }
            }
        }
        whole
    }

    /// Ascending.
    fn eigenvalues(matrix: DMatrix<f64>) -> Vec<f64> {
        let mut eigenvalues: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
        eigenvalues.sort_by(f64::total_cmp);
        eigenvalues
    }

    /// Number of motions without stiffness, and the least stiffness of the others over the shear modulus times a length
    /// of 1 mm.
    fn free_motions(elements: &[[u32; 10]], nodes: &[Vector3<f64>]) -> (usize, f64) {
        let all = eigenvalues(stiffness(elements, nodes, nodes));
        let free = all.iter().filter(|e| e.abs() < 1e-11).count();
        (free, all[free] / LAW.mu_mpa)
    }

    #[test]
    fn a_tetrahedron_with_neighbours_has_no_motion_without_stiffness_but_the_rigid_ones() {
        let mut nodes = tetrahedron(0.0);
        let mut elements = NODES.to_vec();
        let mut found = vec![free_motions(&elements, &nodes)];
        for face in crate::mesh::TET10_FACES {
            // The neighbour across this face: its last corner is the mirror image of this element's.
            let [a, b, c, ab, bc, ca] = face.map(|n| n as u32);
            let opposite = (0..4).find(|n| !face.contains(n)).unwrap();
            let corners = [a, b, c].map(|n| nodes[n as usize]);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
            let apex = nodes[opposite] - normal * (2.0 * normal.dot(&(nodes[opposite] - corners[0])));
            let first = nodes.len() as u32;
            nodes.push(apex);
            nodes.extend(corners.map(|corner| (corner + apex) / 2.0));
            elements.push([a, b, c, first, ab, bc, ca, first + 1, first + 2, first + 3]);
            found.push(free_motions(&elements, &nodes));
        }
        // Each neighbour removes some of the three conformal maps.
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [9, 8, 7, 6, 6]);
        assert!(found[4].1 > 1e-3, "{found:?}");
    }

    #[test]
    fn a_quadratic_displacement_has_its_own_variation_of_the_gradient() {
        let nodes = tetrahedron(0.0);
        let (volumes, gradients) = points(std::array::from_fn(|n| nodes[n])).unwrap();
        // u = (b . x)², whose gradient is 2 (b . x) b.
        let b = Vector3::new(0.3, -0.7, 0.5);
        let slope = |q: usize| -> Vector3<f64> {
            nodes.iter().zip(&gradients[q]).map(|(x, g)| Vector3::from(*g) * b.dot(x).powi(2)).sum()
        };
        let off = (5.0 - 5f64.sqrt()) / 20.0;
        let place =
            |q: usize| (0..4).map(|k| nodes[k] * if k == q { 1.0 - 3.0 * off } else { off }).sum::<Vector3<f64>>();
        for q in 1..4 {
            let expected = b * (2.0 * b.dot(&(place(q) - place(0))));
            assert!((slope(q) - slope(0) - expected).amax() < 1e-13 && volumes[q] > 0.0);
        }
    }

    /// A block of 48 tetrahedra, its nodes off their places by up to `amplitude_mm`, those on its outside along it only.
    fn block(amplitude_mm: f64) -> crate::mesh::Mesh {
        use crate::mesh::block;
        let axis = [0.0, 1.0, 2.2];
        let mut mesh = block::into_second_order(&block::into_tets(&block::block(&axis, &axis, &axis)));
        block::distort(&mut mesh, amplitude_mm, 11);
        mesh
    }

    #[test]
    fn a_mesh_has_no_motion_without_stiffness_but_the_rigid_ones() {
        for amplitude_mm in [0.0, 0.05] {
            let mesh = block(amplitude_mm);
            let elements: Vec<[u32; 10]> = mesh.tets10.iter().map(|t| t.nodes).collect();
            let (free, least) = free_motions(&elements, &mesh.nodes);
            assert!(free == 6 && least > 0.01, "{free} {least}");
        }
    }

    #[test]
    fn a_pressure_of_many_shear_moduli_has_no_stiffness_of_its_own() {
        let mesh = block(0.05);
        let elements: Vec<[u32; 10]> = mesh.tets10.iter().map(|t| t.nodes).collect();
        let mut held = vec![false; mesh.nodes.len()];
        ["x0", "x1", "y0", "y1", "z0", "z1"]
            .into_iter()
            .flat_map(|s| mesh.node_set(s))
            .for_each(|n| held[*n as usize] = true);
        let free: Vec<usize> = (0..3 * held.len()).filter(|dof| !held[dof / 3]).collect();
        let least = |scale: f64| {
            let places: Vec<_> = mesh.nodes.iter().map(|x| x * scale).collect();
            let inner = stiffness(&elements, &mesh.nodes, &places).select_rows(&free).select_columns(&free);
            eigenvalues(inner)[0] / LAW.mu_mpa
        };
        // A bulk modulus of 59 shear moduli: a pressure of 9 of them, then a tension.
        let [squeezed, rest, drawn] = [0.95, 1.0, 1.05].map(least);
        assert!(
            rest > 0.1 && (squeezed / rest - 1.0).abs() < 0.3 && (drawn / rest - 1.0).abs() < 0.3,
            "{squeezed} {rest} {drawn}"
        );
    }

    #[test]
    fn an_element_turned_inside_out_in_part_is_refused() {
        let mut nodes = tetrahedron(0.0);
        nodes[4] = nodes[1] + (nodes[1] - nodes[0]) * 0.1;
        assert!(Tet10::new(&NODES, &nodes).is_none());
    }
}
