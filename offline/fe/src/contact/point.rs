//! One contact point: what the motion of its face and of the plane make of it.

use nalgebra::Vector3;

use super::{ContactState, Plane, PointState, Sliding, Totals};

/// A quadrature point of a face: shape functions, their gradients over the face's coordinates, weight.
pub(super) struct RulePoint {
    pub shape: [f64; 4],
    pub gradient: [[f64; 2]; 4],
    pub weight: f64,
}

/// The quadrature point `rule` of a face under `penalty` (MPa/mm), or None where it bears no pressure.
pub(super) fn contact_point(
    rule: &RulePoint,
    state: &PointState,
    motion: &FaceMotion,
    penalty: f64,
) -> Option<ContactPoint> {
    let x = &motion.x;
    let penetration = motion.plane[2] - interpolate(&rule.shape, x, 2);
    let pressure = state.multiplier + penalty * penetration;
    let (tangent_xi, tangent_eta) = tangents(&rule.gradient, x);
    let jacobian = tangent_xi.y * tangent_eta.x - tangent_xi.x * tangent_eta.y;
    if !(pressure > 0.0) || !(jacobian > 0.0) {
        return None;
    }
    let gap_before = interpolate(&rule.shape, &motion.x_before, 2) - motion.plane_before[2];
    Some(ContactPoint {
        penalty,
        penetration,
        pressure,
        tangent_xi,
        tangent_eta,
        area: jacobian * rule.weight,
        motion: [0, 1].map(|k| (motion.plane[k] - motion.plane_before[k]) - interpolate(&rule.shape, &motion.moved, k)),
        seen: SeenMotion::of(state, gap_before, motion.plane[2] - motion.plane_before[2]),
    })
}

/// Motion of a face and of the plane in an increment.
pub(super) struct FaceMotion {
    /// Positions of the corners, mm, now and at the start of the increment.
    pub x: [Vector3<f64>; 4],
    x_before: [Vector3<f64>; 4],
    /// `x - x_before`.
    moved: [Vector3<f64>; 4],
    pub plane: Plane,
    plane_before: Plane,
}

impl FaceMotion {
    pub fn new(face: &[usize; 4], last: &ContactState, position: &[Vector3<f64>], plane: Plane) -> Self {
        let (x, x_before) = (face.map(|n| position[n]), face.map(|n| last.position[n]));
        let moved = std::array::from_fn(|a| x[a] - x_before[a]);
        Self { x, x_before, moved, plane, plane_before: last.plane }
    }
}

/// A quadrature point of a face that bears pressure.
pub(super) struct ContactPoint {
    /// Pressure per penetration, MPa/mm.
    penalty: f64,
    /// Depth of the skin behind the plane, mm.
    pub penetration: f64,
    /// MPa, > 0.
    pub pressure: f64,
    /// Derivatives of the position over the face's coordinates, mm.
    tangent_xi: Vector3<f64>,
    tangent_eta: Vector3<f64>,
    /// Area that the point stands for, on the plane, mm².
    pub area: f64,
    /// Motion of the plane along itself less that of the skin in the increment, mm.
    motion: [f64; 2],
    /// How much of `motion` is slip.
    seen: SeenMotion,
}

impl ContactPoint {
    /// Slip of the increment, mm.
    pub fn slip_step(&self) -> [f64; 2] {
        self.motion.map(|step| self.seen.share * step)
    }

    /// Elastic slip before the return map, mm.
    pub fn trial_slip(&self, state: &PointState) -> [f64; 2] {
        let step = self.slip_step();
        [0, 1].map(|k| state.elastic_slip[k] + step[k])
    }

    /// Adds a point's part to the derivative of its face's residual over the positions of the face's nodes.
    pub fn add_tangent(
        &self,
        rule: &RulePoint,
        traction: Vector3<f64>,
        change: &TractionChange,
        block: &mut [[f64; 12]; 12],
    ) {
        let ContactPoint { tangent_xi, tangent_eta, area, penalty, .. } = *self;
        let TractionChange { by_slip, by_pressure, .. } = change;
        for b in 0..4 {
            // Change of traction and of area with the position of node b; the area changes with x and y alone.
            let n = rule.shape[b];
            let [b_xi, b_eta] = rule.gradient[b];
            let d_traction = [
                Vector3::new(-by_slip[0][0], -by_slip[1][0], 0.0) * (n * area),
                Vector3::new(-by_slip[0][1], -by_slip[1][1], 0.0) * (n * area),
                Vector3::new(by_pressure[0], by_pressure[1], 1.0) * (-penalty * n * area),
            ];
            let d_area = [
                (tangent_xi.y * b_eta - b_xi * tangent_eta.y) * rule.weight,
                (b_xi * tangent_eta.x - tangent_xi.x * b_eta) * rule.weight,
                0.0,
            ];
            for k in 0..3 {
                let column = d_traction[k] + traction * d_area[k];
                for a in 0..4 {
                    let value = column * (-rule.shape[a]);
                    let target = &mut block[3 * b + k];
                    target[3 * a] += value.x;
                    target[3 * a + 1] += value.y;
                    target[3 * a + 2] += value.z;
                }
            }
        }
    }

    /// Derivative of a point's force over the plane's x, y and z, N/mm.
    pub fn change_with_plane(&self, change: &TractionChange) -> [Vector3<f64>; 3] {
        let TractionChange { by_slip, by_pressure, by_share } = change;
        [
            Vector3::new(by_slip[0][0], by_slip[1][0], 0.0) * self.area,
            Vector3::new(by_slip[0][1], by_slip[1][1], 0.0) * self.area,
            Vector3::new(by_pressure[0], by_pressure[1], 1.0) * (self.penalty * self.area)
                + Vector3::new(by_share[0], by_share[1], 0.0) * (self.seen.share_per_advance * self.area),
        ]
    }
}

/// Derivatives of a point's tangential traction.
pub(super) struct TractionChange {
    /// Over the motion of the plane along itself, MPa/mm, shape (2, 2).
    by_slip: [[f64; 2]; 2],
    /// Over the pressure.
    by_pressure: [f64; 2],
    /// Over the share of the motion that is slip, MPa.
    by_share: [f64; 2],
}

impl TractionChange {
    pub fn of(point: &ContactPoint, sliding: &Sliding) -> Self {
        let (stiffness, step) = (&sliding.by_slip, point.motion);
        Self {
            by_slip: stiffness.map(|row| row.map(|s| s * point.seen.share)),
            by_pressure: sliding.by_pressure,
            by_share: [0, 1].map(|k| stiffness[k][0] * step[0] + stiffness[k][1] * step[1]),
        }
    }
}

impl Totals {
    /// Adds a point whose elastic slip was `trial`, mm, before the return map.
    pub(super) fn add(&mut self, point: &ContactPoint, sliding: &Sliding, trial: [f64; 2]) {
        let Sliding { traction, elastic_slip, .. } = sliding;
        self.penetration = self.penetration.max(point.penetration);
        let plastic = (0..2).map(|k| traction[k] * (trial[k] - elastic_slip[k])).sum::<f64>();
        self.min_dissipation_density = self.min_dissipation_density.min(plastic);
        self.dissipation += plastic * point.area;
        let stored = (0..2).map(|k| traction[k] * elastic_slip[k]).sum::<f64>();
        self.elastic_energy += 0.5 * stored * point.area;
        self.force += Vector3::new(traction[0], traction[1], point.pressure) * point.area;
        self.area += point.area;
    }
}

/// Part of an increment's motion that is slip of a contact point: all of it, or what is left after the plane has
/// reached the point.
struct SeenMotion {
    /// 0 to 1.
    share: f64,
    /// Derivative of `share` over the plane's advance, 1/mm.
    share_per_advance: f64,
}

impl SeenMotion {
    /// * `gap`, mm: at the start of the increment
    /// * `advance`, mm: of the plane toward the finger in the increment
    fn of(state: &PointState, gap: f64, advance: f64) -> Self {
        if state.pressure > 0.0 || !(gap > 0.0) || !(advance > 0.0) {
            return Self { share: 1.0, share_per_advance: 0.0 };
        }
        if gap >= advance {
            // The skin came to the plane rather than the plane to the skin: the less the plane advanced, the less does
            // its advance say of when. Smooth to the whole motion of a slide at fixed depth.
            let part = advance / gap;
            return Self { share: 1.0 - part * part, share_per_advance: -2.0 * part / gap };
        }
        Self { share: 1.0 - gap / advance, share_per_advance: gap / (advance * advance) }
    }
}

pub(super) fn interpolate(shape: &[f64; 4], values: &[Vector3<f64>; 4], k: usize) -> f64 {
    shape[0] * values[0][k] + shape[1] * values[1][k] + shape[2] * values[2][k] + shape[3] * values[3][k]
}

fn tangents(gradient: &[[f64; 2]; 4], x: &[Vector3<f64>; 4]) -> (Vector3<f64>, Vector3<f64>) {
    let mut sums = (Vector3::zeros(), Vector3::zeros());
    for a in 0..4 {
        sums.0 += x[a] * gradient[a][0];
        sums.1 += x[a] * gradient[a][1];
    }
    sums
}
