//! Which faces of the skin may touch the plane in poses of the finger.

use nalgebra::{Matrix3, Vector3};

use super::{FACE_TRIANGLES, Fingertip, Mesh, set};

/// Outer faces that may touch the plane in one of several poses: the union over the poses of the faces that look at the
/// plane and have a node lower than `reach_mm` over the lowest node of that pose. Indices into `outer_faces`,
/// ascending.
///
/// * `outer_faces`: faces of the skin's outside, counter-clockwise seen from outside: four corners of a hexahedron, or
///   three of a 10-node tetrahedron and the nodes between them
/// * `rotations`: turns of the finger from the frame of the mesh about the point under first touch (its origin)
/// * `reach_mm`: travel of the plane beyond first touch of each pose, with a margin
pub fn touching_faces(mesh: &Mesh, outer_faces: &[&[u32]], rotations: &[Matrix3<f64>], reach_mm: f64) -> Vec<usize> {
    let views: Vec<_> = rotations
        .iter()
        .map(|rotation| {
            let height = move |x: &Vector3<f64>| (rotation * x).z;
            let nodes = outer_faces.iter().flat_map(|face| face.iter()).map(|&n| height(&mesh.nodes[n as usize]));
            let lowest = nodes.fold(f64::INFINITY, f64::min);
            let normal: Vector3<f64> = rotation.transpose() * Vector3::z();
            move |x: &Vector3<f64>| (height(x) - lowest, normal)
        })
        .collect();
    near_faces(mesh, outer_faces, &views, reach_mm)
}

/// Outer faces that look at a rigid body and have a node nearer to it than `reach_mm` in one of several views of it.
/// Each of the `views` gives the gap of a place and the body's normal there. Indices into `outer_faces`, ascending.
fn near_faces(
    mesh: &Mesh,
    outer_faces: &[&[u32]],
    views: &[impl Fn(&Vector3<f64>) -> (f64, Vector3<f64>)],
    reach_mm: f64,
) -> Vec<usize> {
    let mut touching = vec![false; outer_faces.len()];
    for view in views {
        for (touching, face) in touching.iter_mut().zip(outer_faces) {
            let p: Vec<Vector3<f64>> = face.iter().map(|&node| mesh.nodes[node as usize]).collect();
            // The product of a quadrilateral's diagonals, or of a triangle's edges.
            let last = if p.len() == 4 { p[3] } else { p[2] };
            let outward = (p[2] - p[0]).cross(&(last - p[1]));
            *touching |= p.iter().map(view).any(|(gap, normal)| gap < reach_mm && outward.dot(&normal) < 0.0);
        }
    }
    (0..outer_faces.len()).filter(|&face| touching[face]).collect()
}

impl Fingertip {
    /// Height over first touch up to which [`touching_faces`] has to look to find the whole pad in the pose of the mesh,
    /// mm.
    pub fn pad_height_mm(&self) -> f64 {
        let low = |face: &[u32]| face.iter().map(|&n| self.mesh.nodes[n as usize].z).fold(f64::INFINITY, f64::min);
        let (quads, triangles) = (self.mesh.pad_faces.iter(), self.mesh.pad_triangles.iter());
        let (least, most) = (quads.map(|f| low(f)).chain(triangles.map(|f| low(f))))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), z| (least.min(z), most.max(z)));
        (most - least) * (1.0 + 1e-9)
    }

    /// The fingertip with the faces that may touch in these poses as its pad; arguments as in [`touching_faces`].
    #[must_use]
    pub fn with_pad_for(self, rotations: &[Matrix3<f64>], reach_mm: f64) -> Self {
        let faces = touching_faces(&self.mesh, &self.outer(), rotations, reach_mm);
        self.with_pad(&faces)
    }

    /// The fingertip with a pad of those faces that are nearer than `reach_mm` to a rigid body in one of several views.
    /// Each view gives the gap of a place and the body's normal there.
    #[must_use]
    pub fn with_pad_near(self, views: &[impl Fn(&Vector3<f64>) -> (f64, Vector3<f64>)], reach_mm: f64) -> Self {
        let faces = near_faces(&self.mesh, &self.outer(), views, reach_mm);
        self.with_pad(&faces)
    }

    /// Outer faces: quadrilaterals, then triangles.
    fn outer(&self) -> Vec<&[u32]> {
        let quads = self.outer_faces.iter().map(<[u32; 4]>::as_slice);
        quads.chain(self.outer_triangles.iter().map(<[u32; 6]>::as_slice)).collect()
    }

    /// The fingertip with these outer faces as its pad, ascending.
    fn with_pad(mut self, faces: &[usize]) -> Self {
        let (quads, triangles) = faces.split_at(faces.partition_point(|&face| face < self.outer_faces.len()));
        self.mesh.pad_faces = quads.iter().map(|&face| self.outer_faces[face]).collect();
        let triangles = triangles.iter().map(|&face| self.outer_triangles[face - self.outer_faces.len()]);
        self.mesh.pad_triangles = triangles.flat_map(|face| FACE_TRIANGLES.map(|t| t.map(|n| face[n]))).collect();
        let tied: std::collections::BTreeSet<u32> = self.mesh.ties.iter().map(|tie| tie.slave).collect();
        let mut nodes = self.mesh.pad_nodes();
        nodes.retain(|node| !tied.contains(node));
        self.mesh.node_sets.insert(set::PAD.into(), nodes);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fingertip, FingertipShape, MeshPreset, fingertip};
    use nalgebra::Rotation3;

    fn tip(shape: &FingertipShape) -> Fingertip {
        fingertip(shape, &MeshPreset::Coarse.divisions()).unwrap()
    }

    fn slices(faces: &[[u32; 4]]) -> Vec<&[u32]> {
        faces.iter().map(<[u32; 4]>::as_slice).collect()
    }

    #[test]
    fn without_a_turn_they_are_the_pad() {
        let shape = FingertipShape::default();
        let Fingertip { mesh, outer_faces, .. } = tip(&shape);
        let found = touching_faces(&mesh, &slices(&outer_faces), &[Matrix3::identity()], shape.pad_height_mm);
        let pad = |face: &[u32; 4]| mesh.pad_faces.contains(face);
        // The pad's faces have their middle below the height, these a node.
        let height = |face: &[u32; 4]| face.iter().map(|&n| mesh.nodes[n as usize].z).fold(f64::INFINITY, f64::min);
        assert!(outer_faces.iter().enumerate().all(|(i, face)| !pad(face) || found.contains(&i)));
        assert!(found.iter().all(|&i| height(&outer_faces[i]) < shape.pad_height_mm + 0.01));
    }

    #[test]
    fn on_a_sphere_they_move_with_the_turn() {
        let radius = 8.0;
        let Fingertip { mesh, outer_faces, .. } = tip(&FingertipShape::round(radius));
        let (reach, center) = (1.0, Vector3::new(0.0, 0.0, radius));
        let turns = [0.0, 0.35].map(|angle| Rotation3::from_axis_angle(&Vector3::x_axis(), angle).into_inner());
        let slices = slices(&outer_faces);
        let found = touching_faces(&mesh, &slices, &turns, reach);
        let each: Vec<Vec<usize>> = turns.iter().map(|turn| touching_faces(&mesh, &slices, &[*turn], reach)).collect();
        for (turn, touching) in turns.iter().zip(&each) {
            // A cap about the direction that the turn makes the plane's: sagitta `reach`, a face wider at most.
            let down = turn.transpose() * -Vector3::z();
            let off = |n: u32| (mesh.nodes[n as usize] - center).normalize().angle(&down) * radius;
            let rim = (1.0 - reach / radius).acos() * radius;
            for (i, face) in outer_faces.iter().enumerate() {
                let near = face.iter().map(|&n| off(n)).fold(f64::INFINITY, f64::min);
                assert_eq!(touching.contains(&i), near < rim, "face {i}: {near} mm from the middle, rim {rim} mm");
            }
        }
        let mut union: Vec<usize> = each.concat();
        union.sort_unstable();
        union.dedup();
        assert_eq!(found, union);
        assert!(found.len() > each[0].len() && found.len() < each[0].len() + each[1].len());
    }
}
