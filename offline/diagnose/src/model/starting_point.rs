//! Starting point of the calibration's fit: scales of the curves by medians over rows, tangential stiffness by a search along a
//! line.

use fingerpad_smooth::{Parameter, Parameters, ReferenceCurves};

use crate::data::median::median;
use crate::data::runs::RunSet;
use crate::model::prediction::predict_runs;

/// Parameters of the reference with the scales of normal force, strength and tangential stiffness that a set of runs has.
///
/// Far from a finger's stiffness the elements' yield points have slopes of the wrong sign, and a fit that starts there
/// gives the misfit to the variances between runs.
pub fn starting_point(set: &RunSet, reference: &ReferenceCurves) -> Parameters {
    let mut parameters = reference.mean;
    let model = reference.model(&parameters);
    let (mut normal, mut strength) = (Vec::new(), Vec::new());
    for run in &set.runs {
        let full_path = run.rows.last().map_or(0.0, |r| r.path_mm);
        for (row, [n, x, y]) in run.rows.iter().zip(&run.force_n) {
            if row.depth_mm < 0.3 * run.depth_mm() || row.depth_mm <= 0.0 {
                continue;
            }
            let at = model.at_depth(row.depth_mm);
            if *n > 0.0 {
                normal.push((n / at.normal_n).ln());
            }
            let friction = x.hypot(*y);
            if row.path_mm > 0.6 * full_path && row.path_mm > 0.0 && friction > 0.0 {
                strength.push((friction / at.strength_n).ln());
            }
        }
    }
    for (scale, values) in [(Parameter::NormalScale, normal), (Parameter::StrengthScale, strength)] {
        parameters[scale] += median(values).unwrap_or(0.0).clamp(-3.0, 3.0);
    }
    let readings: Vec<f64> = set.runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()).collect();
    let from = parameters[Parameter::TangentialScale];
    let misfit = |shift: f64| {
        let mut trial = parameters;
        trial[Parameter::TangentialScale] = from + shift;
        let found = predict_runs(&reference.model(&trial), &set.runs, &[]);
        // Absolute values: a row far off must not decide.
        readings
            .iter()
            .zip(&found)
            .enumerate()
            .filter(|(i, (y, _))| i % 3 != 0 && !y.is_nan())
            .map(|(_, (y, p))| (y - p).abs())
            .sum::<f64>()
    };
    let tried = (-8..=12).map(|k| 0.25 * f64::from(k)).map(|shift| (misfit(shift), shift));
    parameters[Parameter::TangentialScale] += tried.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |best| best.1);
    parameters
}
