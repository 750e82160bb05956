//! The load along the plane that friction can carry: the minimum, over all motions of the plane, of the dissipation by
//! their slip.

use nalgebra::{Matrix3, Vector3};

use super::Drive;
use crate::contact::{FrictionLaw, Surface, plane};
use crate::solve::State;

/// Iterations of the search for the motion that dissipates least; it converges linearly, and some digits suffice.
const ITERATIONS: usize = 40;
/// Slip below which a point's dissipation counts as that of this slip, share of the largest.
const LEAST_SLIP: f64 = 1e-6;

/// Strengths of the points of a contact, for motions of the body along x and y and about the normal through the foot.
///
/// On a curved body the pressures press along those motions too; they are taken as they are.
pub(super) struct FrictionLimit {
    /// Slip over the motion and strength (N) of every point in contact.
    points: Vec<(Matrix3<f64>, f64)>,
    /// Forces along x and y (N) and moment (N mm) of the pressures.
    by_pressure: Vector3<f64>,
    /// Whether force along x, along y and moment are driven; the plane is held in the others.
    driven: [bool; 3],
}

/// Which of force along x, force along y and moment about the normal drive the plane.
pub(super) fn driven(drives: &[Drive; 6]) -> [bool; 3] {
    [plane::X, plane::Y, plane::SPIN].map(|k| drives[k] == Drive::Force)
}

impl FrictionLimit {
    /// Of a state of a model that makes up `copies` of itself.
    pub fn of(surface: &Surface, law: &dyn FrictionLaw, state: &State, copies: f64, driven: [bool; 3]) -> Self {
        let frame = surface.frame(&state.contact.plane);
        let foot = frame.foot();
        let mut limit = Self { points: Vec::new(), by_pressure: Vector3::zeros(), driven };
        for (node, place) in state.contact.nodes.iter().zip(&state.contact.position).filter(|(node, _)| node.area > 0.0)
        {
            let normal = frame.along_axes(&frame.to_finger(&surface.body().spot(place).normal));
            let motion = motion_at(&frame.along_axes(&(frame.from_plane(place) - foot)));
            limit.by_pressure += motion.tr_mul(&normal) * (copies * node.normal_force_n);
            let along = Matrix3::identity() - normal * normal.transpose();
            limit.points.push((along * motion, copies * law.strength(node.pressure_mpa()).0 * node.area));
        }
        limit
    }

    /// Factor on a driven load (N, N, N mm) up to which friction holds it; infinite for no load.
    ///
    /// By the theorem of the upper bound: the least dissipation over all motions in which the load's power is 1, less the power
    /// of the pressures, found by weighted squares whose weights are the strengths over the last slip. It holds if the
    /// strength does not change with the direction of slip.
    pub fn factor(&self, load: &Vector3<f64>) -> f64 {
        self.factor_beside(load, &self.by_pressure)
    }

    /// The same beside another load that the pressures take.
    fn factor_beside(&self, load: &Vector3<f64>, by_pressure: &Vector3<f64>) -> f64 {
        let of_driven = |v: &Vector3<f64>| Vector3::from_fn(|k, _| if self.driven[k] { v[k] } else { 0.0 });
        let (load, by_pressure) = (of_driven(load), of_driven(by_pressure));
        if load == Vector3::zeros() {
            return f64::INFINITY;
        }
        let arm = self.points.iter().map(|(slip, _)| slip.column(2).norm()).fold(0.0, f64::max).max(1e-3);
        let mut motion = Vector3::new(load.x, load.y, load.z / (arm * arm));
        motion /= load.dot(&motion);
        for _ in 0..ITERATIONS {
            let slips = self.points.iter().map(|(slip, _)| (slip * motion).norm());
            let least = LEAST_SLIP * slips.fold(0.0, f64::max);
            let mut weighted = Matrix3::zeros();
            for (slip, strength) in &self.points {
                weighted += slip.tr_mul(slip) * (strength / (slip * motion).norm().max(least));
            }
            for k in (0..3).filter(|&k| !self.driven[k]) {
                weighted.row_mut(k).fill(0.0);
                weighted.column_mut(k).fill(0.0);
                weighted[(k, k)] = 1.0;
            }
            let Some(factor) = weighted.cholesky() else { break };
            let (by_load, by_pressure) = (factor.solve(&load), factor.solve(&by_pressure));
            motion = by_load * ((1.0 + load.dot(&by_pressure)) / load.dot(&by_load)) - by_pressure;
        }
        let dissipated: f64 = self.points.iter().map(|(slip, strength)| strength * (slip * motion).norm()).sum();
        dissipated + by_pressure.dot(&motion)
    }

    /// Share of the strengths that a state's load along the plane uses: its force, or the driven load.
    pub fn used(&self, state: &State, copies: f64) -> f64 {
        let force = copies * state.totals.force;
        let strength: f64 = self.points.iter().map(|(_, strength)| strength).sum();
        let load = Vector3::new(force.x, force.y, copies * state.totals.moment.z) - self.by_pressure;
        (load.xy().norm() / strength).max(1.0 / self.factor_beside(&load, &Vector3::zeros()))
    }
}

/// Motion of a body at `arm` from the foot over its motion along x and y (mm) and about the normal (rad).
fn motion_at(arm: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x, 0.0, 0.0, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of even strength 1 N in all, of radius 2 mm about (x, 0).
    fn ring(x: f64, driven: [bool; 3]) -> FrictionLimit {
        let count = 400;
        let points = (0..count).map(|k| {
            let (sin, cos) = (2.0 * std::f64::consts::PI * f64::from(k) / f64::from(count)).sin_cos();
            (motion_at(&Vector3::new(x + 2.0 * cos, 2.0 * sin, 0.0)), 1.0 / f64::from(count))
        });
        FrictionLimit { points: points.collect(), by_pressure: Vector3::zeros(), driven }
    }

    #[test]
    fn a_ring_holds_force_moment_and_both() {
        let all = [true; 3];
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        close(ring(0.0, all).factor(&Vector3::new(0.6, -0.8, 0.0)), 1.0);
        close(ring(0.0, all).factor(&Vector3::new(0.0, 0.0, -4.0)), 0.5);
        // Fixed along x and y the plane turns about its foot, at any position of the ring; free it turns about the
        // middle.
        let arm: f64 = ring(5.0, all).points.iter().map(|(slip, s)| slip.column(2).norm() * s).sum();
        assert!(arm > 5.1);
        close(ring(5.0, [false, false, true]).factor(&Vector3::new(0.0, 0.0, 1.0)), arm);
        close(ring(5.0, all).factor(&Vector3::new(0.0, 0.0, 1.0)), 2.0);
        // A force at an offset of half the radius: the sum over the ring about the pole that dissipates least.
        let both = ring(0.0, all).factor(&Vector3::new(1.0, 0.0, 1.0));
        let about = |pole: f64| {
            let load = Vector3::new(1.0, 0.0, 1.0);
            let motion = Vector3::new(pole, 0.0, 1.0);
            let points = ring(0.0, all).points;
            points.iter().map(|(slip, s)| s * (slip * motion).norm()).sum::<f64>() / load.dot(&motion)
        };
        let least = (0..4000).map(|k| about(0.01 * f64::from(k))).fold(f64::INFINITY, f64::min);
        close(both, least);
        assert!(both < 0.95 && both > 1.0 / 1.5);
        assert_eq!(ring(0.0, all).factor(&Vector3::zeros()), f64::INFINITY);
    }
}
