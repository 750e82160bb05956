//! Errors of a pad along finite-element runs.

use serde::{Deserialize, Serialize};

use fingerpad::Response;
use fingerpad_fe::contact::{Outline, RubberFriction};

use super::make::off;
use super::{PadModel, replay};
use crate::score::outside_band;
use crate::{Run, Sample};

/// Errors, RMS over the rows of runs.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct PadScores {
    /// Number of runs.
    pub runs: usize,
    /// Normal force over the run's largest.
    pub normal: f64,
    /// Friction over the run's largest friction.
    pub friction: f64,
    /// Friction over the limit in the same row.
    pub friction_of_limit: f64,
    /// Stick ratio.
    pub stick: f64,
    /// Centre of pressure, mm, where the normal force is above a tenth of the run's largest.
    pub centre_mm: f64,
    /// Spin moment over the largest friction times 3 mm.
    pub moment: f64,
    /// Area over the run's largest.
    pub area: f64,
    /// Share of the rows with the right regime. Rows whose finite-element stick ratio is near a threshold between regimes are left out.
    #[serde(default)]
    pub regime_right: f64,
    /// Share of the rows within the bands of the normal force and of each component of friction.
    #[serde(default)]
    pub in_band: [f64; 2],
}

/// Errors of deep contacts by depth, RMS.
#[derive(Clone, Copy, Debug, Default)]
pub struct DepthScores {
    /// Number of rows.
    pub rows: usize,
    /// Normal force over its own value.
    pub normal: f64,
    /// Mean of the signed error of the normal force over its value.
    pub normal_mean: f64,
    /// Friction over the run's largest.
    pub friction: f64,
}

/// Scores of the rows of `runs` between two depths, mm.
///
/// * `law`: friction law of the runs
pub fn score_depths(
    model: &PadModel,
    runs: &[&Run],
    outline: &Outline,
    law: &RubberFriction,
    [least, most]: [f64; 2],
) -> DepthScores {
    let mut sums = DepthScores::default();
    for run in runs {
        let [_, friction, _] = largest(run, [law.lambda, law.beta]);
        for (s, a) in run.samples.iter().zip(replay(model, run, outline)) {
            let normal = f64::from(s.normal_force_n);
            if !(least..most).contains(&f64::from(s.depth_mm)) || normal <= 0.0 {
                continue;
            }
            let e = errors(s, &a);
            sums.rows += 1;
            sums.normal += (e[0] / normal).powi(2);
            sums.normal_mean += e[0] / normal;
            sums.friction += (e[1] * e[1] + e[2] * e[2]) / (friction * friction);
        }
    }
    let rows = sums.rows.max(1) as f64;
    DepthScores {
        rows: sums.rows,
        normal: (sums.normal / rows).sqrt(),
        normal_mean: sums.normal_mean / rows,
        friction: (sums.friction / rows).sqrt(),
    }
}

/// Largest normal force, friction (at least half of the strength under an even pressure), area of a run.
///
/// * `law`: lambda, MPa^(1 − beta), and beta
pub(crate) fn largest(run: &Run, [lambda, beta]: [f64; 2]) -> [f64; 3] {
    run.samples.iter().fold([1e-9; 3], |most, s| {
        let friction = f64::from(s.friction_n[0]).hypot(s.friction_n[1].into());
        let (normal, area) = (f64::from(s.normal_force_n).max(0.0), f64::from(s.contact_area_mm2));
        let half = 0.5 * lambda * normal.powf(beta) * area.powf(1.0 - beta);
        [most[0].max(normal), most[1].max(friction).max(half), most[2].max(area)]
    })
}

/// Whether the strengths of a pad are fitted to a law. Under Coulomb's law they follow from the normal forces.
pub(crate) fn is_free(law: &RubberFriction) -> bool {
    law.beta != 1.0 || law.tau0_mpa != 0.0
}

/// Largest stick ratio of full slip: of the finite elements, and of a pad.
const SLIPS: [f64; 2] = [0.01, 0.05];

/// Friction of a row in full slip over that of the finite elements at the same normal force, a logarithm.
pub(super) fn full_slip(s: &Sample, a: &Response<f64>, law: &RubberFriction) -> Option<f64> {
    let of_fe = f64::from(s.friction_n[0]).hypot(s.friction_n[1].into());
    let (of_pad, normal) = (a.friction_n[0].hypot(a.friction_n[1]), f64::from(s.normal_force_n));
    let slips = f64::from(s.stick_ratio) < SLIPS[0] && a.stick_ratio < SLIPS[1];
    // The area of a contact grows with the normal force to the power of about two thirds.
    let exponent = law.beta + 2.0 / 3.0 * (1.0 - law.beta);
    let is_loaded = of_fe.min(of_pad) > 0.0 && normal.min(a.normal_force_n) > 0.0;
    (slips && is_loaded).then(|| (of_pad / of_fe).ln() - exponent * (a.normal_force_n / normal).ln())
}

/// Errors of a row: normal force, friction x and y (N), stick, centre x and y (mm), spin moment (N mm), area.
pub(super) fn errors(s: &Sample, a: &Response<f64>) -> [f64; 8] {
    let [x, y] = [0, 1].map(|k| a.friction_n[k] - f64::from(s.friction_n[k]));
    let normal = f64::from(s.normal_force_n);
    let moment = s.turned.map_or([0.0; 3], |t| t.moment_n_mm.map(f64::from));
    let centre = |moment: f64| if normal > 1e-6 { moment / normal } else { 0.0 };
    let centre_fe = [centre(-moment[1]), centre(moment[0])];
    [
        a.normal_force_n - normal,
        x,
        y,
        a.stick_ratio - f64::from(s.stick_ratio),
        a.pressure_centre_mm[0] - centre_fe[0],
        a.pressure_centre_mm[1] - centre_fe[1],
        a.spin_moment_n_mm - moment[2],
        a.contact_area_mm2 - f64::from(s.contact_area_mm2),
    ]
}

/// Angle from the neutral pose above which a row counts as one in another pose, degrees.
pub(super) const ANGLE_DEG: f64 = 0.5;

/// Scores over runs.
///
/// * `law`: friction law of the runs
pub fn score_runs(model: &PadModel, runs: &[&Run], outline: &Outline, law: &RubberFriction) -> PadScores {
    let (mut sums, mut rows, mut centres, mut lights, mut regimes) = ([0.0; 8], 0.0, 0.0, 0.0, [0.0; 2]);
    let (mut inside, mut with_band) = ([0.0; 2], 0.0);
    for run in runs {
        let [normal, friction, area] = largest(run, [law.lambda, law.beta]);
        for (s, a) in run.samples.iter().zip(replay(model, run, outline)) {
            if s.normal_force_n <= 0.0 {
                continue;
            }
            let e = errors(s, &a);
            rows += 1.0;
            sums[0] += (e[0] / normal).powi(2);
            let squared = e[1] * e[1] + e[2] * e[2];
            sums[1] += squared / (friction * friction);
            if a.friction_limit_n > 0.05 * friction {
                sums[2] += squared / (a.friction_limit_n * a.friction_limit_n);
                lights += 1.0;
            }
            sums[3] += e[3] * e[3];
            if f64::from(s.normal_force_n) > 0.1 * normal {
                sums[4] += e[4] * e[4] + e[5] * e[5];
                centres += 1.0;
            }
            if a.normal_force_n > 0.0 {
                let [of_normal, x, y] = off(s, &a);
                let is_in = |error: f64, band: f64| f64::from(u8::from(error <= band));
                inside[0] += is_in(of_normal, a.band_normal_n);
                inside[1] += 0.5 * (is_in(x, a.band_friction_n) + is_in(y, a.band_friction_n));
                with_band += 1.0;
            }
            sums[5] += (e[6] / (3.0 * friction)).powi(2);
            sums[6] += (e[7] / area).powi(2);
            if outside_band(s.stick_ratio) {
                regimes[0] += f64::from(u8::from(a.regime == s.regime));
                regimes[1] += 1.0;
            }
        }
    }
    let rms = |sum: f64, rows: f64| if rows > 0.0 { (sum / rows).sqrt() } else { 0.0 };
    PadScores {
        runs: runs.len(),
        normal: rms(sums[0], rows),
        friction: rms(sums[1], rows),
        friction_of_limit: rms(sums[2], lights),
        stick: rms(sums[3], rows),
        centre_mm: rms(sums[4], centres),
        moment: rms(sums[5], rows),
        area: rms(sums[6], rows),
        in_band: inside.map(|rows| rows / f64::max(with_band, 1.0)),
        regime_right: if regimes[1] > 0.0 { regimes[0] / regimes[1] } else { 1.0 },
    }
}
