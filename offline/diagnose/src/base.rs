//! The baseline: the reduced model's form with the freedoms that another finger or device needs.
//!
//! Main types: [`Reference`] (smooth curves of a model file), [`Base`] (the same with the freedoms applied).

use fingerpad::DataOf;
use nalgebra::{DMatrix, DVector};

/// A freedom of the baseline.
pub struct Freedom {
    /// Name, with unit where it has one.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Standard deviation between devices and fingers, before calibration.
    pub between: f64,
    /// Standard deviation between the calibration and the measured set of one finger.
    pub drift: f64,
}

const fn freedom(name: &'static str, unit: &'static str, between: f64, drift: f64) -> Freedom {
    Freedom { name, unit, between, drift }
}

/// Number of freedoms.
pub const FREEDOMS: usize = 30;

/// The freedoms, in the order of the parameter vector; all are 0 for the finger of the model file, except where a
/// mean is taken from it.
pub static FREEDOM: [Freedom; FREEDOMS] = [
    freedom("ln_normal_scale", "", 1.0, 0.10),
    freedom("normal_depth_exponent", "", 0.5, 0.02),
    freedom("normal_depth_curvature", "", 0.2, 0.01),
    freedom("normal_depth_cubic", "", 0.1, 0.005),
    freedom("ln_strength_scale", "", 1.0, 0.10),
    freedom("strength_depth_exponent", "", 0.4, 0.02),
    freedom("strength_depth_curvature", "", 0.15, 0.01),
    freedom("ln_tangential_stiffness", "", 1.0, 0.05),
    freedom("tangential_depth_exponent", "", 0.4, 0.02),
    freedom("tangential_depth_curvature", "", 0.15, 0.01),
    freedom("ln_stiffness_ratio_y", "", 0.5, 0.03),
    freedom("ln_yield_spread", "", 0.7, 0.05),
    freedom("yield_tilt", "", 0.8, 0.10),
    freedom("yield_bow", "", 0.8, 0.10),
    freedom("press_coupling", "mm/mm", 0.05, 0.002),
    freedom("press_coupling_slope", "1/mm", 0.02, 0.001),
    freedom("normal_per_friction_x", "", 0.1, 0.004),
    freedom("normal_per_friction_y", "", 0.03, 0.004),
    freedom("normal_shear_x", "", 0.1, 0.006),
    freedom("normal_shear_y", "", 0.1, 0.006),
    freedom("odd_x_per_mm", "1/mm", 0.03, 0.003),
    freedom("load_exponent_at_fixed_depth", "", 0.10, 0.02),
    freedom("even_direction_cos", "", 0.020, 0.002),
    freedom("even_direction_sin", "", 0.010, 0.002),
    freedom("strength_depth_cubic", "", 0.1, 0.005),
    freedom("yield_twist", "", 0.8, 0.10),
    freedom("odd_direction_cos", "", 0.020, 0.002),
    freedom("odd_direction_sin", "", 0.010, 0.002),
    freedom("even_direction_cos_slope", "", 0.030, 0.004),
    freedom("stiffness_ratio_y_exponent", "", 0.15, 0.02),
];

/// Freedoms that the elements do not feel: the normal force's curve and what friction adds to the readings.
pub const READ_ONLY: [usize; 9] = [0, 1, 2, 3, 16, 17, 18, 19, 20];
/// Place of the load's exponent among the freedoms.
pub const LOAD_EXPONENT: usize = 21;

/// Elements of the baseline.
pub const ELEMENTS: usize = 10;
/// Depth at which the scales are taken, mm.
pub const MIDDLE_MM: f64 = 0.9;
/// Share of the fourth power in the friction that is odd along x.
pub const ODD_SHAPE: f64 = 0.5;

/// Least and largest yield position.
const YIELDS: [f64; 2] = [0.3, 3.6];
/// Middle of the shares' bell over the yield positions, and its width in the logarithm.
const YIELD_MIDDLE: f64 = 1.43;
const YIELD_WIDTH: f64 = 0.55;

/// Smooth curves over the logarithm of depth, taken from a model file.
#[derive(Clone, Debug)]
pub struct Reference {
    normal: [f64; 4],
    strength: [f64; 4],
    tangential: [f64; 4],
    area: [f64; 4],
    yields: [[f64; 2]; ELEMENTS],
    /// Mean of the freedoms for this file.
    pub mean: [f64; FREEDOMS],
    /// Standard deviation of the logarithm of the area, which forces do not tell.
    pub area_sd: f64,
}

/// Area over depth of the finger in Table 1 of Yoshida et al. 2011, A = 65.0 d^1.007 mm²: the fit of its four points.
const TABLE_AREA: [f64; 2] = [65.0, 1.007];
/// How far the area of another finger at the same depth lies from it: the area goes with the radius of the pad, and
/// that with the finger's width, of which grown-ups' scatter by about so much.
const OTHER_AREA_SD: f64 = 0.08;

impl Reference {
    /// The curves of a model. `own_area`: take the model's area, otherwise that of a measured finger: forces do not
    /// tell the area.
    pub fn of<const M: usize, const N: usize>(data: &DataOf<M, N>, own_area: bool) -> Self {
        let n = data.rows.len();
        let cell = f64::from(data.depth_max) / (n - 1) as f64;
        let fit = |value: fn(&fingerpad::Row) -> f32| -> [f64; 4] {
            let points: Vec<(f64, f64)> = (1..n)
                .map(|i| (((i as f64) * cell / MIDDLE_MM).ln(), f64::from(value(&data.rows[i])).ln()))
                .filter(|(u, _)| *u > -2.0)
                .collect();
            cubic(&points)
        };
        let middle = ((MIDDLE_MM / cell).round() as usize).min(n - 1);
        let row = &data.rows[middle];
        let at = |line: &fingerpad::Line| f64::from(line.value);
        let mut mean = [0.0; FREEDOMS];
        mean[10] = 2.0 * at(&row.stiffness_anisotropy).ln();
        mean[14] = at(&row.press_coupling);
        mean[16] = at(&row.press_coupling);
        // Energy of full shear, times twice the stiffness, over the normal force.
        let energy: f64 = data.elements.iter().map(|e| f64::from(e.energy)).sum();
        let full_shear = energy * at(&row.limit).powi(2) / at(&row.normal);
        mean[18] = at(&row.normal_shear_x) * full_shear;
        mean[19] = at(&row.normal_shear_y) * full_shear / at(&row.strength_anisotropy).powi(2);
        // The term's effect in full slip along x is that of the core's shifted circle.
        mean[20] = -at(&row.yield_shift) / ((1.0 - ODD_SHAPE) * cell * middle as f64);
        mean[21] = f64::from(data.pressure_exponent);
        let area = if own_area {
            fit(|r| r.area.value)
        } else {
            [TABLE_AREA[0].ln() + TABLE_AREA[1] * MIDDLE_MM.ln(), TABLE_AREA[1], 0.0, 0.0]
        };
        Self {
            normal: fit(|r| r.normal.value),
            strength: fit(|r| r.limit.value),
            tangential: fit(|r| r.stiffness.value),
            area,
            yields: yields(),
            mean,
            area_sd: if own_area { 0.0 } else { OTHER_AREA_SD },
        }
    }

    /// The baseline with the freedoms at `theta`.
    pub fn with(&self, theta: &[f64]) -> Base {
        let add = |a: &[f64; 4], more: [f64; 4]| -> [f64; 4] { std::array::from_fn(|i| a[i] + more[i]) };
        let mut yields = self.yields;
        let spread = theta[11].clamp(-4.0, 1.5).exp();
        let (mut strength, mut softness) = (0.0, 0.0);
        for (k, slot) in yields.iter_mut().enumerate() {
            let t = 2.0 * k as f64 / (ELEMENTS - 1) as f64 - 1.0;
            slot[0] = slot[0].powf(spread);
            slot[1] *=
                (theta[12] * t + theta[13] * (t * t - 0.4) + theta[25] * t * (t * t - 0.6)).clamp(-4.0, 4.0).exp();
            strength += slot[1];
        }
        for slot in &mut yields {
            slot[1] /= strength;
            softness += slot[1] / slot[0];
        }
        let elements = yields.map(|[y, w]| [1.0 / (y * softness), w]);
        Base {
            normal: add(&self.normal, [theta[0], theta[1], theta[2], theta[3]]),
            strength: add(&self.strength, [theta[4], theta[5], theta[6], theta[24]]),
            tangential: add(&self.tangential, [theta[7], theta[8], theta[9], 0.0]),
            area: self.area,
            elements,
            ratio: [theta[10], theta[29]],
            press: [theta[14], theta[15]],
            normal_per_friction: [theta[16], theta[17]],
            normal_shear: [theta[18], theta[19]],
            odd: theta[20],
            load_exponent: theta[21],
            even: [theta[22], theta[23]],
            even_slope: theta[28],
            first: [theta[26], theta[27]],
        }
    }
}

/// Yield positions, even in the logarithm, and shares of the strength, a bell over it: a start from which the freedoms
/// reach other fingers. A file's few elements, made for its own finger, are no better one.
fn yields() -> [[f64; 2]; ELEMENTS] {
    let at = |k: usize| (YIELDS[0].ln() + (YIELDS[1] / YIELDS[0]).ln() * k as f64 / (ELEMENTS - 1) as f64).exp();
    std::array::from_fn(|k| {
        let z = (at(k) / YIELD_MIDDLE).ln() / YIELD_WIDTH;
        [at(k), (-0.5 * z * z).exp()]
    })
}

/// Least-squares cubic through points.
pub fn cubic(points: &[(f64, f64)]) -> [f64; 4] {
    let a = DMatrix::from_fn(points.len(), 4, |i, j| points[i].0.powi(j as i32));
    let b = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let normal = a.transpose() * &a + DMatrix::identity(4, 4) * 1e-9;
    let x = normal.cholesky().expect("positive definite").solve(&(a.transpose() * b));
    [x[0], x[1], x[2], x[3]]
}

/// The baseline of one finger and device.
#[derive(Clone, Debug)]
pub struct Base {
    /// Coefficients of ln N0 over u = ln(d / 0.9 mm).
    pub normal: [f64; 4],
    /// The same of the strength L.
    pub strength: [f64; 4],
    /// The same of the tangential stiffness K.
    pub tangential: [f64; 4],
    /// The same of the contact area.
    pub area: [f64; 4],
    /// 1/yield position and share of the strength.
    pub elements: [[f64; 2]; ELEMENTS],
    /// Logarithm of the tangential stiffness along y over that along x, and its slope over u.
    pub ratio: [f64; 2],
    /// Slide per depth while pressing: constant and slope.
    pub press: [f64; 2],
    /// Normal force per friction along x, y.
    pub normal_per_friction: [f64; 2],
    /// Share by which full shear along x, y raises the normal force.
    pub normal_shear: [f64; 2],
    /// Odd share per mm of depth.
    pub odd: f64,
    /// Exponent of the strength in the stiffness at fixed depth.
    pub load_exponent: f64,
    /// Direction dependence of the strength, cos and sin of twice the angle.
    pub even: [f64; 2],
    /// Slope of the first of them over u: a contact grows longer and wider by different shares.
    pub even_slope: f64,
    /// The same over the angle itself.
    pub first: [f64; 2],
}

/// Normal force, strength, tangential stiffness, area at one depth.
#[derive(Clone, Copy, Debug, Default)]
pub struct AtDepth {
    /// N.
    pub normal_n: f64,
    /// N.
    pub strength_n: f64,
    /// N/mm.
    pub tangential_n_mm: f64,
    /// mm².
    pub area_mm2: f64,
    /// Tangential stiffness along y over that along x.
    pub ratio: f64,
    /// Slide that pressing to this depth amounts to, mm.
    pub pressed_mm: f64,
}

/// Bounds of u between which the cubics hold; beyond them a straight line goes on.
pub const U: [f64; 2] = [-1.6, 1.1];

fn poly(c: &[f64; 4], u: f64, inside: f64) -> f64 {
    let value = c[0] + inside * (c[1] + inside * (c[2] + inside * c[3]));
    if u == inside {
        return value;
    }
    value + (u - inside) * (c[1] + inside * (2.0 * c[2] + 3.0 * inside * c[3])).max(0.1)
}

impl Base {
    /// What the strength at a depth gains in a direction of motion, share.
    pub fn turned(&self, depth_mm: f64, double_angle: [f64; 2], along: [f64; 2]) -> f64 {
        let u = (depth_mm / MIDDLE_MM).ln().clamp(U[0], U[1]);
        (self.even[0] + self.even_slope * u) * double_angle[0]
            + self.even[1] * double_angle[1]
            + self.first[0] * along[0]
            + self.first[1] * along[1]
    }

    /// The curves at a depth > 0, mm.
    pub fn at(&self, depth_mm: f64) -> AtDepth {
        let u = (depth_mm / MIDDLE_MM).ln();
        let inside = u.clamp(U[0], U[1]);
        AtDepth {
            normal_n: poly(&self.normal, u, inside).exp(),
            strength_n: poly(&self.strength, u, inside).exp(),
            tangential_n_mm: poly(&self.tangential, u, inside).exp(),
            area_mm2: poly(&self.area, u, inside).exp(),
            ratio: (self.ratio[0] + self.ratio[1] * inside).exp(),
            pressed_mm: depth_mm * (self.press[0] + 0.5 * self.press[1] * depth_mm),
        }
    }
}
