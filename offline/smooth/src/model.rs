//! The smooth model of one finger on one device: curves over depth and the elements' shares.
//!
//! Main types: [`SmoothModel`], [`DepthValues`] (its curves at one depth).

/// Elements of the model.
pub const ELEMENTS: usize = 10;
/// Depth at which the scales are taken, mm.
pub const MIDDLE_MM: f64 = 0.9;
/// Share of the fourth power in the part of the friction that is odd along x.
pub const ODD_SHAPE: f64 = 0.5;
/// Largest depth to which the curves hold, mm; each continues beyond it as a power of the depth.
pub(crate) const DEEPEST_MM: f64 = 2.7;
/// Range of u = ln(depth / 0.9 mm) from 0.18 to 2.7 mm, within which shares of the strength and the ratio of the stiffness
/// change with depth.
pub const U_RANGE: [f64; 2] = [-1.6, 1.098_612_288_668_109_8];
/// Least exponent of a curve over depth outside that range.
pub(crate) const LEAST_EXPONENT: f64 = 0.1;

/// The smooth model of one finger on one device.
///
/// A curve over the depth d is a power law with an exponential of the depth: its logarithm is
/// c0 + c1 ln(d / 0.9 mm) + c2 (d - 0.9 mm) + c3 (d - 0.9 mm)². A blunt tip touches as a power of the depth (Hertz 1882; Sneddon 1965), and
/// tissue stiffens exponentially (Fung 1967).
#[derive(Clone, Debug)]
pub struct SmoothModel {
    /// Coefficients of ln N0; N0 is the normal force without shear, N.
    pub ln_normal: [f64; 4],
    /// The same of the strength L, the friction in full slip, N.
    pub ln_strength: [f64; 4],
    /// The same of the tangential stiffness K along x, N/mm.
    pub ln_tangential: [f64; 4],
    /// The same of the contact area, mm².
    pub ln_area: [f64; 4],
    /// 1/yield position (over the mean slip length L/K) and share of the strength of each element.
    pub elements: [[f64; 2]; ELEMENTS],
    /// Logarithm of the tangential stiffness along y over that along x at 0.9 mm, and its slope over u.
    pub ln_stiffness_ratio_y: [f64; 2],
    /// Slide along x per depth while pressing, mm/mm, and its change with depth, 1/mm.
    pub press_coupling: [f64; 2],
    /// Slide along y per depth while pressing, mm/mm.
    pub press_coupling_y: f64,
    /// Normal force per friction along x and y.
    pub normal_per_friction: [f64; 2],
    /// Share by which full shear along x and y raises the normal force.
    pub normal_shear: [f64; 2],
    /// Part of the friction along x that is odd in the direction, per mm of depth.
    pub odd_x_per_mm: f64,
    /// Exponent of the strength in the tissue's stiffness at fixed depth.
    pub load_exponent: f64,
    /// Strength over direction: shares that go with cos 2θ and sin 2θ.
    pub even_direction: [f64; 2],
    /// Change of the first of them with u: a contact grows longer and wider by different shares.
    pub even_direction_slope: f64,
    /// Strength over direction: shares that go with cos θ and sin θ.
    pub odd_direction: [f64; 2],
}

/// The model's curves at one depth.
#[derive(Clone, Copy, Debug, Default)]
pub struct DepthValues {
    /// Normal force without shear, N.
    pub normal_n: f64,
    /// Friction in full slip, N.
    pub strength_n: f64,
    /// Tangential stiffness along x, N/mm.
    pub tangential_n_mm: f64,
    /// Contact area, mm².
    pub area_mm2: f64,
    /// Tangential stiffness along y over that along x.
    pub stiffness_ratio_y: f64,
    /// Slide along x and y that pressing from touch to this depth amounts to, mm.
    pub pressed_mm: [f64; 2],
}

/// A curve at a depth > 0, mm.
///
/// * `u`: ln(depth / 0.9 mm), and the same held within [`U_RANGE`]
fn curve(c: &[f64; 4], depth_mm: f64, [u, inside]: [f64; 2]) -> f64 {
    let up_to_mm = depth_mm.min(DEEPEST_MM);
    let from_middle = up_to_mm - MIDDLE_MM;
    let exponent = if u > inside { c[1] + up_to_mm * (c[2] + 2.0 * c[3] * from_middle) } else { c[1] };
    let value = c[0] + c[1] * inside + from_middle * (c[2] + c[3] * from_middle);
    (value + exponent.max(LEAST_EXPONENT) * (u - inside)).exp()
}

impl SmoothModel {
    /// Relative change of the strength in a direction of motion, at a depth > 0, mm.
    ///
    /// * `double_angle`: cosine and sine of twice the direction
    /// * `direction`: cosine and sine of the direction
    pub fn direction_gain(&self, depth_mm: f64, double_angle: [f64; 2], direction: [f64; 2]) -> f64 {
        let u = (depth_mm / MIDDLE_MM).ln().clamp(U_RANGE[0], U_RANGE[1]);
        (self.even_direction[0] + self.even_direction_slope * u) * double_angle[0]
            + self.even_direction[1] * double_angle[1]
            + self.odd_direction[0] * direction[0]
            + self.odd_direction[1] * direction[1]
    }

    /// The curves at a depth > 0, mm.
    pub fn at_depth(&self, depth_mm: f64) -> DepthValues {
        let u = (depth_mm / MIDDLE_MM).ln();
        let inside = u.clamp(U_RANGE[0], U_RANGE[1]);
        let at = |c: &[f64; 4]| curve(c, depth_mm, [u, inside]);
        DepthValues {
            normal_n: at(&self.ln_normal),
            strength_n: at(&self.ln_strength),
            tangential_n_mm: at(&self.ln_tangential),
            area_mm2: at(&self.ln_area),
            stiffness_ratio_y: (self.ln_stiffness_ratio_y[0] + self.ln_stiffness_ratio_y[1] * inside).exp(),
            pressed_mm: [
                depth_mm * (self.press_coupling[0] + 0.5 * self.press_coupling[1] * depth_mm),
                depth_mm * self.press_coupling_y,
            ],
        }
    }
}
