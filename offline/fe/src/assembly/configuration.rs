//! Configuration of the body: positions of its nodes, pose of its rigid part.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Positions of all nodes and the pose of the rigid body.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Configuration {
    /// Current positions, mm.
    pub x: Vec<Vector3<f64>>,
    /// Current position of the rigid body's reference point, mm.
    pub rigid_centre: Vector3<f64>,
    /// Rotation of the rigid body.
    pub rigid_rotation: Rotation3<f64>,
}

/// Rotation vector of a rotation, exact to rounding also for small rotations (an arc cosine of its trace is not, and
/// can be NaN).
pub fn rotation_vector(rotation: &Rotation3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_rotation_matrix(rotation).scaled_axis()
}

/// Symmetric part of the derivative of a rotation vector over a spatial rotation.
pub(super) fn inverse_left_jacobian_symmetric(theta: Vector3<f64>) -> Matrix3<f64> {
    let angle = theta.norm();
    let factor = if angle < 1e-4 { 1.0 / 12.0 } else { (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle) };
    let cross = theta.cross_matrix();
    Matrix3::identity() + cross * cross * factor
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_vector_keeps_small_rotations() {
        let axis = Vector3::new(0.6, -0.48, 0.64);
        for angle in [0.0, 1e-14, 1e-10, 1e-7, 1e-3, 0.7, 2.0, 3.0] {
            let error = rotation_vector(&Rotation3::new(axis * angle)) - axis * angle;
            assert!(error.norm() <= 4e-16 + 1e-14 * angle, "{angle}: {error}");
        }
    }
}
