//! Values of laws as they are reported, with 95 % intervals.
//!
//! Main function: [`parameters`].

use fingerpad_smooth::Parameter;
use nalgebra::{Matrix2, Vector2};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::laws::{Place, Reported};
use crate::model::active_law::{ActiveLaw, is_log};
use crate::schema::FittedParameter;
use crate::selection::forward::Selection;

/// Standard deviations to the end of a 95 % interval of a normal distribution.
pub const NORMAL_95: f64 = 1.96;

/// Place of the first accepted law's first parameter in the covariance of the fit.
pub fn first_place(selection: &Selection) -> usize {
    let own = &selection.fit.laws[..selection.finger_laws];
    Parameter::COUNT + own.iter().map(|active| active.values.len()).sum::<usize>()
}

/// Accepted laws whose linear parameters have intervals that all hold zero.
///
/// * `gains_2ll`: gain of each law over leaving it out
pub fn without_amplitude(selection: &Selection, gains_2ll: &[f64], runs: usize, ln_area_sd: f64) -> Vec<usize> {
    let fit = &selection.fit;
    let quantile = quantile(runs, fit.laws.iter().map(|a| a.values.len()).sum());
    let mut at = first_place(selection);
    let mut out = Vec::new();
    for (index, active) in selection.accepted().iter().enumerate() {
        // Amplitude and axis are fitted as two components; the amplitude is the first of what is reported.
        let amplitudes = if active.law.reported == Reported::AmplitudeAndAxis { 1 } else { active.law.linear };
        let fitted = parameters(active, &fit.covariance, at, quantile, ln_area_sd, gains_2ll[index]);
        if fitted[..amplitudes].iter().all(|p| p.ci95[0] <= 0.0 && p.ci95[1] >= 0.0) {
            out.push(index);
        }
        at += active.values.len();
    }
    out
}

/// Error of a parameter, as a share of it, that the baseline's form leaves beside the noise: about what other fingers
/// of known truth showed.
pub const FORM_ERROR: f64 = 0.025;

/// Standard deviations to the end of a 95 % interval: Student's t.
pub fn student_95(degrees: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees).map_or(NORMAL_95, |t| t.inverse_cdf(0.975))
}

/// The same, with runs as the units from which the scatter is known.
pub fn quantile(runs: usize, parameters: usize) -> f64 {
    student_95(runs.saturating_sub(parameters + 3).max(2) as f64)
}

/// Values as they are reported with 95 % intervals; `at` is the place of the law's first parameter in the covariance.
///
/// An amplitude that trades with a shape has no symmetric interval: its end towards zero is where the likelihood puts it,
/// which falls by `gain_2ll` on the whole way to zero (its signed root taken as linear).
pub fn parameters(
    active: &ActiveLaw,
    covariance: &nalgebra::DMatrix<f64>,
    at: usize,
    quantile: f64,
    ln_area_sd: f64,
    gain_2ll: f64,
) -> Vec<FittedParameter> {
    let n = active.values.len();
    let form = FORM_ERROR.hypot(match active.law.place {
        Place::Drag => ln_area_sd,
        Place::Rim => 0.5 * ln_area_sd,
        _ => 0.0,
    });
    let reported = active.law.report(&active.values);
    (0..n)
        .map(|k| {
            let p = &active.law.parameters[k];
            let sd_own =
                covariance[(at + k, at + k)].max(0.0).sqrt().hypot(if is_log(active, k) { FORM_ERROR } else { 0.0 });
            let ci95 = if is_log(active, k) {
                [reported[k] * (-quantile * sd_own).exp(), reported[k] * (quantile * sd_own).exp()]
            } else if active.law.reported == Reported::AmplitudeAndAxis {
                polar(active, covariance, at, k, quantile)
            } else {
                let half = quantile * sd_own.hypot(form * reported[k]);
                let mut ends = [reported[k] - half, reported[k] + half];
                if active.law.linear == 1 && ends[0] * ends[1] <= 0.0 && gain_2ll > quantile * quantile {
                    ends[usize::from(reported[k] < 0.0)] = reported[k] * (1.0 - quantile / gain_2ll.sqrt());
                }
                ends
            };
            FittedParameter { name: p.name.into(), value: reported[k], unit: p.unit.into(), ci95 }
        })
        .collect()
}

/// Range of the amplitude or the axis over the ellipse of confidence of their Cartesian pair, which is their profile
/// likelihood's interval: where the protocol sees one of the two only, the amplitude has a floor and no ceiling, which
/// no derivative at the optimum shows.
fn polar(active: &ActiveLaw, covariance: &nalgebra::DMatrix<f64>, at: usize, k: usize, quantile: f64) -> [f64; 2] {
    const POINTS: usize = 720;
    let reported = active.law.report(&active.values);
    let form = (FORM_ERROR * reported[0]).powi(2);
    let pair = Matrix2::from_fn(|i, j| covariance[(at + i, at + j)] + if i == j { form } else { 0.0 });
    let Some(root) = pair.cholesky().map(|c| c.l()) else { return [f64::NEG_INFINITY, f64::INFINITY] };
    let mean = Vector2::new(active.values[0], active.values[1]);
    let origin_within = root.solve_lower_triangular(&mean).is_none_or(|z| z.norm() <= quantile);
    let (mut low, mut high) = (0.0f64, 0.0f64);
    for i in 0..POINTS {
        let (s, c) = (std::f64::consts::TAU * i as f64 / POINTS as f64).sin_cos();
        let edge = mean + root * Vector2::new(c, s) * quantile;
        let d = active.law.report(edge.as_slice())[k] - reported[k];
        let d = if k == 1 { (d + 90.0).rem_euclid(180.0) - 90.0 } else { d };
        (low, high) = (low.min(d), high.max(d));
    }
    if origin_within {
        (low, high) = if k == 1 { (-90.0, 90.0) } else { (-reported[0], high) };
    }
    [reported[k] + low, reported[k] + high]
}
