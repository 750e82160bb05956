//! What is hidden: every law of the library, written again from its formula, and effects that no library has.

use std::f64::consts::{PI, TAU};

use super::protocol::{Moment, Stroke};

/// The state of a row.
pub struct At<'a> {
    /// The stroke.
    pub stroke: &'a Stroke,
    /// Times, depth and motion.
    pub moment: &'a Moment,
    /// Elastic load, N.
    pub normal_n: f64,
}

/// What effects do to a row.
pub struct Influence {
    /// Factor on tau_crit.
    pub strength: f64,
    /// Factor on the stiffness.
    pub stiffness: f64,
    /// Added to the depth, mm.
    pub depth_mm: f64,
    /// Drag coefficient, N s/mm.
    pub drag_n_s_mm: f64,
    /// Pull-off, N.
    pub adhesion_n: f64,
    /// Bias of the readings, N.
    pub bias_n: [f64; 3],
    /// Cross-talk into x, y.
    pub cross: [f64; 2],
}

impl Default for Influence {
    fn default() -> Self {
        Self {
            strength: 1.0,
            stiffness: 1.0,
            depth_mm: 0.0,
            drag_n_s_mm: 0.0,
            adhesion_n: 0.0,
            bias_n: [0.0; 3],
            cross: [0.0; 2],
        }
    }
}

/// Names of the laws of the library, in the order in which the cases go through them.
pub const LIBRARY: [(&str, &str); 17] = [
    ("hydration_bell", "moisture"),
    ("speed_log", "speed"),
    ("speed_stribeck", "speed"),
    ("viscous_drag", "speed"),
    ("anisotropy", "direction"),
    ("normal_relaxation", "normal_relaxation"),
    ("contact_ageing", "ageing"),
    ("static_peak", "static_peak"),
    ("occlusion_growth", "occlusion"),
    ("adhesion", "adhesion"),
    ("depth_zero_offset", "depth_zero"),
    ("tare_bias", "tare"),
    ("cross_talk", "cross_talk"),
    ("stiffness_drift", "stiffness_drift"),
    ("subject_size", "subject_size"),
    ("strain_stiffening", "strain_stiffening"),
    ("temperature", "temperature"),
];

/// The place of a law in [`LIBRARY`].
///
/// # Panics
/// If the library has no such law.
pub fn place(name: &str) -> usize {
    LIBRARY.iter().position(|law| law.0 == name).expect("a law of the library")
}

/// Effects outside the library.
pub const OUTSIDE: [&str; 6] =
    ["periodic_texture", "patch", "slow_clock", "saturation", "depth_speed_product", "direction_harmonic"];

/// A hidden effect: its name, amplitude, up to three shape numbers, and how far its form is off.
#[derive(Clone, Debug)]
pub struct Effect {
    /// Name.
    pub name: &'static str,
    /// Amplitude, in the law's unit.
    pub amplitude: f64,
    /// Shape numbers in the order of the contract.
    pub shape: [f64; 2],
    /// Exponent on the argument of exponentials; 1 is the exact form.
    pub form: f64,
}

impl Effect {
    /// Acts on a row.
    pub fn act(&self, at: &At<'_>, to: &mut Influence) {
        let (a, [b, c]) = (self.amplitude, self.shape);
        let fade = |x: f64| (-x.max(0.0).powf(self.form)).exp();
        let p = &at.stroke.plan;
        let mut strength = 1.0;
        let mut stiffness = 1.0;
        match self.name {
            "hydration_bell" => {
                let g = |h: f64| (-0.5 * ((h - b) / c).abs().powf(2.0 * self.form)).exp();
                strength += a * (g(p.hydration_au) - g(35.0));
            }
            "speed_log" if at.moment.speed_mm_s > 0.0 => strength += a * (at.moment.speed_mm_s / 2.0).ln(),
            "speed_stribeck" if at.moment.speed_mm_s > 0.0 => {
                strength += a * (fade(at.moment.speed_mm_s / b) - fade(2.0 / b));
            }
            "viscous_drag" => to.drag_n_s_mm += a,
            "anisotropy" => strength += a * (2.0 * (at.moment.direction - b * PI / 180.0)).cos(),
            "normal_relaxation" => {
                let unrelaxed = at.stroke.unrelaxed(at.moment.t_s, |since_s| fade(since_s / b));
                stiffness -= a * (1.0 - unrelaxed);
            }
            "contact_ageing" => strength += a * (1.0 + p.dwell_s / b).ln() * fade(at.moment.path_mm / c),
            "static_peak" => strength += a * fade(at.moment.path_mm / b),
            "occlusion_growth" => strength += a * (1.0 - fade(at.moment.occlusion_s / b)),
            "adhesion" => to.adhesion_n += a,
            "depth_zero_offset" => to.depth_mm += a,
            "tare_bias" => {
                to.bias_n[0] += a;
                to.bias_n[1] += a * b;
                to.bias_n[2] += a * c;
            }
            "cross_talk" => {
                to.cross[0] += a;
                to.cross[1] += a * b;
            }
            "strength_drift" => strength += a * at.moment.t_s / 3600.0,
            "stiffness_drift" => stiffness += a * at.moment.t_s / 3600.0,
            "subject_size" => stiffness *= (p.width_mm / 16.0).powf(a),
            "strain_stiffening" if at.moment.depth_mm > 0.0 => stiffness *= (a * (at.moment.depth_mm - 0.8)).exp(),
            "temperature" => strength += a * (p.temperature_c - 32.0),
            "periodic_texture" => strength += a * (TAU * at.moment.position_mm[0] / b + c).sin(),
            "patch" => {
                let r2 = (at.moment.position_mm[0] - b).powi(2) + (at.moment.position_mm[1] - c).powi(2);
                strength += a * (-0.5 * r2 / 0.8).exp();
            }
            "slow_clock" => stiffness += a * (TAU * at.moment.t_s / b + c).sin(),
            "saturation" => strength *= 1.0 / (1.0 + a * (at.normal_n / 0.3).powi(3)),
            "depth_speed_product" if at.moment.speed_mm_s > 0.0 => {
                strength += a * (at.moment.speed_mm_s / 2.0).ln() * (at.moment.depth_mm - 1.0);
            }
            "direction_harmonic" => strength += a * (3.0 * at.moment.direction + b).cos(),
            _ => {}
        }
        to.strength *= f64::max(strength, 0.1);
        to.stiffness *= f64::max(stiffness, 0.1);
    }
}
