//! Error of a response by its mesh: bounds from the number of faces that the contact covers.

use std::f64::consts::PI;

use super::Response;
use crate::mesh::Mesh;

/// Errors of a contact of one face, as shares; they fall with the root of the number of faces. Nine tenths of the errors are within them,
/// on `coarse` and `medium` against finer meshes: presses of 0.3 to 2 mm, slides, oblique slides and spins on the plane, on balls of 5 and
/// 10 mm, on a cylinder of 8 mm and on an edge of 2 mm.
const OF_ONE_FACE: MeshError = MeshError {
    normal_force_n: 0.2,
    friction_n: 0.22,
    contact_area_mm2: 0.5,
    stick_ratio: 0.4,
    moment_n_mm: 0.1,
    centre_mm: 0.1,
};
/// Share of the normal force below which friction has errors of its own, that do not fall with it.
const LEAST_FRICTION: f64 = 0.3;

/// Bounds of the errors that the size of the faces leaves in a response.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshError {
    /// Of the normal force, N.
    pub normal_force_n: f64,
    /// Of the friction force, N.
    pub friction_n: f64,
    /// Of the contact area, mm².
    pub contact_area_mm2: f64,
    /// Of the stick ratio.
    pub stick_ratio: f64,
    /// Of a moment, N mm.
    pub moment_n_mm: f64,
    /// Of the centre of pressure, mm.
    pub centre_mm: f64,
}

/// Mean size of the faces of a mesh that may touch, mm: the root of their area. None without faces of four corners.
pub fn face_mm(mesh: &Mesh) -> Option<f64> {
    let place = |node: u32| mesh.nodes[node as usize];
    let size = |face: &[u32; 4]| {
        let [a, b, c, d] = face.map(place);
        (0.5 * (c - a).cross(&(d - b)).norm()).sqrt()
    };
    let count = mesh.pad_faces.len();
    (count > 0).then(|| mesh.pad_faces.iter().map(size).sum::<f64>() / count as f64)
}

impl MeshError {
    /// Of a response with contact on a mesh whose faces have this size, mm.
    pub fn of(response: &Response, face_mm: f64) -> Self {
        let Response { normal_force_n, contact_area_mm2, friction_x_n, friction_y_n, .. } = *response;
        let share = face_mm / contact_area_mm2.sqrt();
        let radius_mm = (contact_area_mm2 / PI).sqrt();
        let friction_n = friction_x_n.hypot(friction_y_n).max(LEAST_FRICTION * normal_force_n);
        Self {
            normal_force_n: share * OF_ONE_FACE.normal_force_n * normal_force_n,
            friction_n: share * OF_ONE_FACE.friction_n * friction_n,
            contact_area_mm2: share * OF_ONE_FACE.contact_area_mm2 * contact_area_mm2,
            stick_ratio: share * OF_ONE_FACE.stick_ratio,
            moment_n_mm: share * OF_ONE_FACE.moment_n_mm * normal_force_n.max(friction_n) * radius_mm,
            centre_mm: share * OF_ONE_FACE.centre_mm * radius_mm,
        }
    }
}
