//! Where the grid points of the capped box lie: the same grid on the outer surface, on the bone and on a
//! box inside the bone, and lines between them. Frame of the finger, mm.

use nalgebra::Vector3;

use super::boundary_curves::{Meridian, SectionArc, graded};
use super::first_touch::FirstTouch;
use super::grid::Point;
use super::surface::Body;
use super::{Divisions, FingertipShape};

/// Choices that place the grid: a search over all shapes and presets for the worst scaled Jacobian, with the gradings
/// and the edge of the tip held where the pad needs them.
mod choice {
    /// Where the palmar edge runs on the outer section, as a fraction of its half outline.
    pub const OUTER_PALMAR_EDGE: f64 = 0.32;
    /// The dorsal edge runs along the nail's lateral edge, but within these fractions.
    pub const OUTER_DORSAL_EDGE: [f64; 2] = [0.62, 0.82];
    /// The same on the bone.
    pub const BONE_EDGES: [f64; 2] = [0.25, 0.72];
    /// Size of the section at the palmar edge of the tip, relative to the shaft's.
    pub const OUTER_TIP: f64 = 0.52;
    /// The same on the bone.
    pub const BONE_TIP: f64 = 0.45;
    /// Dorsal offset of the middle of the tip, per half thickness.
    pub const OUTER_TIP_SHIFT: f64 = 0.47;
    /// The same on the bone.
    pub const BONE_TIP_SHIFT: f64 = 0.02;
    /// Size of the tip's square relative to the outline that it replaces.
    pub const TIP_SQUARE: f64 = 0.79;
    /// Bulge of the sides of the outer tip's square.
    pub const OUTER_BULGE: f64 = 0.22;
    /// The same on the bone.
    pub const BONE_BULGE: f64 = 0.15;
    /// The same of the box inside the bone: opens its corners to 120 degrees, where three cells meet.
    pub const CORE_BULGE: f64 = 0.118;
    /// Exponent with which outlines become squares toward the tip.
    pub const MORPH: f64 = 3.1;
    /// Size of the box inside the bone, relative to the bone.
    pub const CORE: f64 = 0.48;
    /// Length of the box's distal part, relative to that of the bone up to its tip's edge.
    pub const CORE_LENGTH: f64 = 0.94;
    /// Reach of the grading across the pad, mm.
    pub const REACH_ACROSS: f64 = 3.4;
    /// Reach of the grading along the pad, mm.
    pub const REACH_ALONG: f64 = 5.0;
    /// Ratio of the dorsal to the palmar row height on the sides and on the tip.
    pub const ROW_RATIO: f64 = 1.5;
    /// Ratio of the deepest to the shallowest subcutaneous layer.
    pub const LAYER_RATIO: f64 = 1.7;
    /// Length of the lines' tangents at both ends, relative to the distance; 0 makes them straight.
    pub const BEND: f64 = 0.2;
}

/// One body with the grid on it.
struct Sheet {
    body: Body,
    section: SectionArc,
    /// Palmar and dorsal edge, as fractions of the half outline.
    edges: [f64; 2],
    /// Dorsal offset of the tip's middle, per half thickness.
    tip_shift: f64,
    /// Bulge of the tip's square.
    bulge: f64,
    /// `sigma` of the last ring.
    sigma_tip: f64,
    /// x and `sigma` of each ring; `sigma` is 1 in the shaft.
    rings: Vec<(f64, f64)>,
    /// Columns on the palmar and on the dorsal side, -1..1.
    columns: [Vec<f64>; 2],
    /// Rows, 0..1.
    rows: Vec<f64>,
}

impl Sheet {
    /// A sheet without rings, columns and rows yet; `tip` is the section's scale at the tip's palmar edge.
    fn new(body: Body, edges: [f64; 2], [tip, tip_shift, bulge]: [f64; 3]) -> Self {
        let section = SectionArc::new(&body);
        let sigma_tip = (tip + tip_shift) / (choice::TIP_SQUARE + tip_shift);
        Self {
            body,
            section,
            edges,
            tip_shift,
            bulge,
            sigma_tip,
            rings: vec![],
            columns: [vec![], vec![]],
            rows: vec![],
        }
    }

    /// Columns and rows of a grid point, both -1..1, as on the square.
    fn square(&self, [_, j, k]: Point) -> [f64; 2] {
        let up = self.rows[k];
        [self.columns[0][j] * (1.0 - up) + self.columns[1][j] * up, 2.0 * up - 1.0]
    }

    /// Relative position (p, q) of a grid point on the ring `sigma`: the section's outline at 1, morphing
    /// into a bulged square at the tip.
    fn relative(&self, point: Point, sigma: f64) -> [f64; 2] {
        let [_, j, k] = point;
        let [low, high] = self.edges;
        let last = self.columns[0].len() - 1;
        let fraction = if k == 0 {
            low * self.columns[0][j]
        } else if k == self.rows.len() - 1 {
            self.columns[1][j].signum() * (1.0 - (1.0 - high) * self.columns[1][j].abs())
        } else {
            let side = if j == 0 { -1.0 } else { 1.0 };
            side * (low + (high - low) * self.rows[k])
        };
        let square = self.squareness(sigma);
        let [eta, zeta] = bulged(self.square(point), self.bulge);
        let [mut p, mut q] = [choice::TIP_SQUARE * eta, choice::TIP_SQUARE * zeta];
        if j == 0 || j == last || k == 0 || k == self.rows.len() - 1 {
            let [op, oq] = self.section.at(fraction);
            [p, q] = [square * p + (1.0 - square) * op, square * q + (1.0 - square) * oq];
        }
        [sigma * p, self.tip_shift * (1.0 - sigma) + sigma * q]
    }

    /// Interpolation of the ring between circle and square: 0 in the shaft, 1 at the tip's edge.
    fn squareness(&self, sigma: f64) -> f64 {
        ((1.0 - sigma) / (1.0 - self.sigma_tip)).min(1.0).powf(choice::MORPH)
    }

    /// Ring whose palmar middle has this section scale.
    fn sigma_at(&self, scale: f64) -> f64 {
        let palmar = |sigma: f64| {
            let square = self.squareness(sigma);
            sigma * (1.0 - square + square * choice::TIP_SQUARE) - self.tip_shift * (1.0 - sigma)
        };
        let (mut low, mut high) = (self.sigma_tip, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if palmar(middle) < scale { low = middle } else { high = middle }
        }
        high
    }

    /// Rings at these x of the proximal shaft, then at these lengths along the palmar meridian from the
    /// last of them.
    fn set_rings(&mut self, shaft: &[f64], meridian: &Meridian, lengths: &[f64]) {
        self.rings = shaft.iter().map(|&x| (x, 1.0)).collect();
        for &length in &lengths[1..] {
            let (x, scale) = meridian.at(length);
            let sigma = if scale < 1.0 { self.sigma_at(scale) } else { 1.0 };
            self.rings.push((x, sigma));
        }
    }

    /// Position of a surface grid point on the body.
    fn position(&self, point: Point) -> Vector3<f64> {
        let (x, sigma) = self.rings[point[0]];
        let [p, q] = self.relative(point, sigma);
        if sigma >= 1.0 {
            return self.body.point(x, p, q);
        }
        self.body.point(self.body.x_at_scale(self.body.section_norm(p, q)), p, q)
    }
}

/// Positions of all grid points of a fingertip.
pub(super) struct Mapping {
    outer: Sheet,
    bone: Sheet,
    /// x where the distal bone begins.
    distal_mm: f64,
    skin_mm: f64,
    layers: [usize; 3],
}

impl Mapping {
    pub(super) fn new(shape: &FingertipShape, divisions: &Divisions, touch: &FirstTouch) -> Self {
        let mut outer = Sheet::new(
            Body::outer(shape),
            [choice::OUTER_PALMAR_EDGE, dorsal_edge(shape)],
            [choice::OUTER_TIP, choice::OUTER_TIP_SHIFT, choice::OUTER_BULGE],
        );
        let mut bone = Sheet::new(
            Body::bone(shape),
            choice::BONE_EDGES,
            [choice::BONE_TIP, choice::BONE_TIP_SHIFT, choice::BONE_BULGE],
        );

        let half = choice::OUTER_PALMAR_EDGE * outer.section.length();
        let across = graded(divisions.columns, 2.0 * half, half, choice::REACH_ACROSS);
        let fine: Vec<f64> = across.iter().map(|s| s / half - 1.0).collect();
        let even: Vec<f64> = (0..=divisions.columns).map(|j| 2.0 * j as f64 / divisions.columns as f64 - 1.0).collect();
        let mixed: Vec<f64> = fine.iter().zip(&even).map(|(f, e)| 0.5 * (f + e)).collect();
        let growing = |ratio: f64| -> Vec<f64> {
            (0..=divisions.rows).map(|k| growth(k as f64 / divisions.rows as f64, ratio)).collect()
        };
        outer.columns = [fine, even.clone()];
        outer.rows = growing(choice::ROW_RATIO);
        bone.columns = [mixed, even];
        bone.rows = growing(choice::ROW_RATIO.sqrt());

        let (gap, distal) = (shape.joint_start_mm, shape.joint_end_mm);
        let even =
            |from: f64, to: f64, count: usize| (0..count).map(move |i| from + (to - from) * i as f64 / count as f64);
        let mut shaft: Vec<f64> = even(0.0, gap, divisions.proximal_rings).collect();
        shaft.extend(even(gap, distal, divisions.joint_rings));
        shaft.push(distal);

        let outer_meridian = Meridian::new(&outer.body, distal, -1.0);
        let bone_meridian = Meridian::new(&bone.body, distal, -1.0);
        let length = outer_meridian.length_to_scale(choice::OUTER_TIP);
        let center = outer_meridian.length_to_x(touch.point_mm.x).min(length);
        let lengths = graded(divisions.distal_rings, length, center, choice::REACH_ALONG);
        let shrink = bone_meridian.length_to_scale(choice::BONE_TIP) / length;
        let bone_lengths: Vec<f64> = lengths.iter().map(|s| s * shrink).collect();
        outer.set_rings(&shaft, &outer_meridian, &lengths);
        bone.set_rings(&shaft, &bone_meridian, &bone_lengths);
        let layers = [divisions.bone_layers, divisions.subcutaneous_layers, divisions.skin_layers];
        Self { outer, bone, distal_mm: distal, skin_mm: shape.skin_thickness_mm, layers }
    }

    /// Position of a grid point in the box inside the bone.
    pub(super) fn core(&self, point: Point) -> Vector3<f64> {
        let (x, sigma) = self.bone.rings[point[0]];
        let [p, q] = bulged(self.bone.square(point), choice::CORE_BULGE);
        let size = choice::CORE * sigma;
        let beyond = x - self.distal_mm;
        if beyond <= 0.0 {
            return self.bone.body.point(x, size * p, size * q);
        }
        // The last ring is a copy of the bone's tip, drawn back; the rings before it bend less and less.
        let last = self.bone.rings.len() - 1;
        let tip = self.bone.position([last, point[1], point[2]]).x - self.bone.rings[last].0;
        let part = beyond / (self.bone.rings[last].0 - self.distal_mm);
        let x = self.distal_mm + choice::CORE_LENGTH * (beyond + part * part * choice::CORE * tip);
        self.bone.body.point(x, size * p, size * q)
    }

    /// Positions of a surface grid point's line from the first level outside the box to the outer surface.
    pub(super) fn line(&self, point: Point) -> Vec<Vector3<f64>> {
        let (core, bone, outer) = (self.core(point), self.bone_position(point), self.outer_position(point));
        let (bone_normal, normal) = (self.bone.body.normal(&bone), self.outer.body.normal(&outer));
        self.line_between(core, [bone, bone_normal], [outer, normal])
    }

    /// Position of a surface grid point on the bone.
    pub(super) fn bone_position(&self, point: Point) -> Vector3<f64> {
        self.bone.position(point)
    }

    /// Position of a surface grid point on the skin's outside.
    pub(super) fn outer_position(&self, point: Point) -> Vector3<f64> {
        self.outer.position(point)
    }

    /// Size of the box inside the bone, relative to the bone.
    pub(super) fn core_size() -> f64 {
        choice::CORE
    }

    /// A line from a point of the box over the bone to the skin's outside, both given with their outward normals.
    pub(super) fn line_between(
        &self,
        core: Vector3<f64>,
        [bone, bone_normal]: [Vector3<f64>; 2],
        [outer, normal]: [Vector3<f64>; 2],
    ) -> Vec<Vector3<f64>> {
        let inner = outer - self.skin_mm * normal;
        let distance = (inner - bone).norm() * choice::BEND;
        let [bone_layers, soft_layers, skin_layers] = self.layers;
        let part = |l: usize, layers: usize| l as f64 / layers as f64;
        let mut line = Vec::with_capacity(self.layers.iter().sum());
        line.extend((1..=bone_layers).map(|l| core.lerp(&bone, part(l, bone_layers))));
        line.extend((1..=soft_layers).map(|l| {
            let t = 1.0 - growth(1.0 - part(l, soft_layers), choice::LAYER_RATIO);
            hermite(t, bone, distance * bone_normal, inner, distance * normal)
        }));
        line.extend((1..=skin_layers).map(|l| inner.lerp(&outer, part(l, skin_layers))));
        line
    }
}

/// Where the nail's lateral edge runs on the outer section, as a fraction of its half outline.
fn dorsal_edge(shape: &FingertipShape) -> f64 {
    let [least, most] = choice::OUTER_DORSAL_EDGE;
    let section = SectionArc::new(&Body::outer(shape));
    section.fraction_at(std::f64::consts::PI - shape.nail_half_angle_deg.to_radians()).clamp(least, most)
}

/// A square (-1..1) with sides bulged: they lie at 1 in their middles and at 1 - `bulge` at the corners.
fn bulged([eta, zeta]: [f64; 2], bulge: f64) -> [f64; 2] {
    [eta * (1.0 - bulge * zeta * zeta), zeta * (1.0 - bulge * eta * eta)]
}

/// 0..1 to 0..1 with steps growing smoothly to `ratio` times the first.
fn growth(t: f64, ratio: f64) -> f64 {
    if (ratio - 1.0).abs() < 1e-9 { t } else { (ratio.powf(t) - 1.0) / (ratio - 1.0) }
}

/// Cubic from `from` to `to` with these tangents.
fn hermite(t: f64, from: Vector3<f64>, leave: Vector3<f64>, to: Vector3<f64>, arrive: Vector3<f64>) -> Vector3<f64> {
    let s = 1.0 - t;
    from * (s * s * (1.0 + 2.0 * t)) + leave * (t * s * s) + to * (t * t * (3.0 - 2.0 * t)) - arrive * (t * t * s)
}
