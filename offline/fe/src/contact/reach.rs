//! Where the rigid body first touches the undeformed finger in any pose.

use std::fmt;
use std::sync::{Arc, Mutex};

use nalgebra::{Rotation3, Vector3};

use super::{Plane, RigidBody};

/// The undeformed finger as far as first touch is concerned.
#[derive(Clone)]
pub enum Outline {
    /// Points of the surface, mm.
    Points {
        /// Points that may touch in the poses of a path.
        points: Vec<Vector3<f64>>,
        /// Height at which the plane of the neutral pose meets the body's lowest point, which need not be one of `points`.
        neutral_mm: f64,
    },
    /// A smooth surface: its lowest point along a direction, mm. Its lowest point along z is the origin.
    Smooth(Arc<dyn Fn(&Vector3<f64>) -> Vector3<f64> + Send + Sync>),
}

impl Outline {
    /// Of the points of a mesh.
    ///
    /// * `points`: points that may touch in the poses of a path
    /// * `body`: every point of the undeformed body, whose lowest one in the neutral pose the plane touches first, at
    ///   height 0
    pub fn of_points(points: Vec<Vector3<f64>>, body: &[Vector3<f64>]) -> Self {
        let neutral_mm = body.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        Self::Points { points, neutral_mm }
    }

    /// The lowest point along `normal`; None of no points.
    pub fn lowest(&self, normal: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Points { points, .. } => {
                points.iter().copied().min_by(|a, b| a.dot(normal).total_cmp(&b.dot(normal)))
            }
            Self::Smooth(lowest) => Some(lowest(normal)),
        }
    }

    fn neutral_mm(&self) -> f64 {
        if let Self::Points { neutral_mm, .. } = self { *neutral_mm } else { 0.0 }
    }
}

/// Half the range of directions in which first touch is looked for, as tangents of angles: 79 degrees.
const WIDEST: f64 = 5.0;
/// Directions along each of two axes in the first search, and half of those in the later ones, which look at a part of it.
const FIRST: i32 = 40;
const LATER: i32 = 4;
/// Shrinking of the searched range from one search to the next, and the range at which it ends.
const SHRINKS: f64 = 0.35;
const NARROWEST: f64 = 1e-9;

/// Height of the body's apex at first touch in any pose, and the point about which poses turn.
pub struct Reach {
    outline: Outline,
    body: RigidBody,
    pivot_mm: Vector3<f64>,
    /// The last heights that were searched for, with their poses.
    known: Mutex<Vec<(Rotation3<f64>, f64)>>,
}

/// Heights that are kept.
const KEPT: usize = 8;

impl Reach {
    /// Reach of the plane, which turns about the point under first touch in the neutral pose: the origin.
    pub fn of_plane(outline: Outline) -> Self {
        Self { outline, body: RigidBody::Plane, pivot_mm: Vector3::zeros(), known: Mutex::default() }
    }

    /// Reach of a body that starts at `start`.
    ///
    /// A plane is the same everywhere; it turns about the origin. Any other body has its apex under first touch in the pose
    /// in which it starts, and turns about that point.
    pub fn new(outline: Outline, body: RigidBody, start: &Plane) -> Self {
        let tilt = start.tilt();
        let pivot_mm = match body {
            RigidBody::Plane => Vector3::zeros(),
            // The neutral pose has its first touch at the origin by definition, for any nodes.
            _ if tilt.angle() == 0.0 => Vector3::zeros(),
            _ => outline.lowest(&(tilt * Vector3::z())).unwrap_or_default(),
        };
        Self { outline, body, pivot_mm, known: Mutex::default() }
    }

    /// The undeformed surface.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// The body.
    pub fn body(&self) -> &RigidBody {
        &self.body
    }

    /// The point about which poses turn, finger's frame, mm.
    pub fn pivot_mm(&self) -> Vector3<f64> {
        self.pivot_mm
    }

    /// Height of the apex over the pivot, along the normal of the tilted body, at first touch, mm.
    pub fn height_mm(&self, tilt: &Rotation3<f64>) -> f64 {
        let normal = tilt * Vector3::z();
        if self.body.is_plane() {
            let Some(lowest) = self.outline.lowest(&normal).filter(|_| tilt.angle() != 0.0) else { return 0.0 };
            return lowest.dot(&normal) - self.outline.neutral_mm();
        }
        let known = |known: &Vec<(Rotation3<f64>, f64)>| known.iter().find(|(of, _)| of == tilt).map(|(_, h)| *h);
        if let Some(height) = self.known.lock().ok().and_then(|list| known(&list)) {
            return height;
        }
        let height = self.search(tilt);
        if let Ok(mut list) = self.known.lock() {
            list.truncate(KEPT - 1);
            list.insert(0, (*tilt, height));
        }
        height
    }

    /// The least height of the finger's points over the body, along the normal.
    fn search(&self, tilt: &Rotation3<f64>) -> f64 {
        let over = |x: &Vector3<f64>| {
            let y = tilt.inverse_transform_vector(&(x - self.pivot_mm));
            self.body.height_mm(y.x, y.y).map_or(f64::INFINITY, |height| y.z - height)
        };
        let Outline::Smooth(lowest) = &self.outline else {
            let Outline::Points { points, neutral_mm } = &self.outline else { return 0.0 };
            let least = points.iter().map(over).fold(f64::INFINITY, f64::min);
            // The mesh's facets leave a gap at first touch in the neutral pose, at which depth is zero.
            return if least.is_finite() { least - neutral_mm } else { 0.0 };
        };
        // Where two bodies touch their normals are opposite: those of a body that is the same along an axis lie across it.
        let (first, second) = match self.body.axis_deg() {
            Some(axis_deg) => {
                let (sin, cos) = axis_deg.to_radians().sin_cos();
                (Vector3::new(-sin, cos, 0.0), None)
            }
            None => (Vector3::x(), Some(Vector3::y())),
        };
        let in_direction = |u: f64, v: f64| {
            let normal = Vector3::z() + first * u + second.map_or(Vector3::zeros(), |second| second * v);
            over(&lowest(&(tilt * normal.normalize())))
        };
        let (mut at, mut least) = ((0.0, 0.0), in_direction(0.0, 0.0));
        // Between two convex bodies there is one place of first touch, which a small search finds.
        let hollow = self.body.may_be_hollow();
        let (mut range, mut count) = if hollow { (WIDEST, FIRST) } else { (1.0, LATER) };
        while range > NARROWEST {
            let middle = at;
            let across = if second.is_some() { count } else { 0 };
            for i in -count..=count {
                for j in -across..=across {
                    let step = |k: i32| range * f64::from(k) / f64::from(count);
                    let place = (middle.0 + step(i), middle.1 + step(j));
                    let height = in_direction(place.0, place.1);
                    if height < least {
                        (at, least) = (place, height);
                    }
                }
            }
            range *= if count == FIRST { 2.0 / f64::from(FIRST) } else { SHRINKS };
            count = LATER;
        }
        least
    }
}

/// Of a plane whose poses touch nothing: sufficient for paths without pitch and roll.
impl Default for Reach {
    fn default() -> Self {
        Self::of_plane(Outline::of_points(Vec::new(), &[]))
    }
}

impl fmt::Debug for Reach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reach").field("body", &self.body).field("pivot_mm", &self.pivot_mm).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A superellipsoid that is flat below, as a fingertip is.
    fn flat_below() -> Outline {
        Outline::Smooth(Arc::new(|normal: &Vector3<f64>| {
            let (half, n) = (Vector3::new(9.0, 8.0, 7.0), 2.8);
            let dual = n / (n - 1.0);
            let pull = normal.component_mul(&half);
            let drop = pull.iter().map(|p| p.abs().powf(dual)).sum::<f64>().powf(1.0 / dual);
            let at = pull.map(|p| -p.signum() * (p.abs() / drop).powf(dual - 1.0)).component_mul(&half);
            at + Vector3::new(0.0, 0.0, 7.0)
        }))
    }

    /// Height and its slope over an angle are smooth in the angle: the work of a body that turns counts on it.
    #[test]
    fn the_height_of_first_touch_is_found_to_many_digits() {
        for body in [
            RigidBody::Sphere { radius_mm: 10.0 },
            RigidBody::Cylinder { radius_mm: 10.0, axis_deg: 30.0 },
            RigidBody::Edge { radius_mm: 4.0, axis_deg: 60.0, angle_deg: 120.0 },
        ] {
            let reach = Reach::new(flat_below(), body.clone(), &Plane::default());
            let height = |roll: f64| {
                let plane = Plane::new([0.0, 0.0, 0.0, 0.0, 0.03, roll]);
                reach.height_mm(&plane.tilt())
            };
            for roll in [0.01, 0.02, 0.05] {
                // The sum of three slopes over small steps is that over their whole.
                let step = 1e-4;
                let ends: Vec<f64> = (0..4).map(|k| height(roll + step * f64::from(k))).collect();
                let third = (ends[3] - 3.0 * ends[2] + 3.0 * ends[1] - ends[0]).abs();
                assert!(third < 3e-8, "{body:?}, roll {roll}: {third:e}, {ends:?}");
            }
        }
    }
}
