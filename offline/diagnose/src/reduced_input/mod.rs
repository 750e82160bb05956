//! Diagnoses from less than measured runs with depth: a trace of forces alone; the form of a report without runs.
//!
//! Main types: [`ReducedDiagnosis`], [`Plot`]; main functions: [`diagnose_forces`], [`reduced_report`].
//! May use: schema, statistics (tail probabilities, damped steps), data, laws (their names).

mod air;
mod forces;
mod tare;

pub use forces::diagnose_forces;

use crate::schema::{
    Baseline, CrossValidationError, Diagnosis, Disagreement, NoiseFound, Rescale, ScatterRatio, UnexplainedFound,
    Verdict,
};

/// A diagnosis from less than measured runs: a report, sentences, and one figure.
pub struct ReducedDiagnosis {
    /// The report.
    pub report: Diagnosis,
    /// Sentences of its page.
    pub sentences: Vec<String>,
    /// The figure.
    pub plot: Option<Plot>,
}

/// Points and curves of a figure.
pub struct Plot {
    /// Title over the figure.
    pub title: String,
    /// Caption under it.
    pub caption: String,
    /// Name of the axis to the right.
    pub x: String,
    /// Name of the axis upwards.
    pub y: String,
    /// Whether both axes have one scale.
    pub square: bool,
    /// Names and places of points.
    pub points: Vec<(String, Vec<[f64; 2]>)>,
    /// Names and corners of curves.
    pub curves: Vec<(String, Vec<[f64; 2]>)>,
}

/// A report without effects, parameters and tests.
///
/// * `rms_n`: root mean square residual before and after the effect, N
/// * `floor_n`: that of the noise, N
pub fn reduced_report(
    verdict: Verdict,
    model: &str,
    rms_n: [[f64; 3]; 2],
    floor_n: [f64; 3],
    method: &str,
    runs: usize,
) -> Diagnosis {
    let ratio =
        |r: [f64; 3]| (0..3).map(|k| if floor_n[k] > 0.0 { r[k] / floor_n[k] } else { 0.0 }).fold(0.0, f64::max);
    Diagnosis {
        schema: "fingerpad-diagnosis/1".into(),
        verdict,
        disagreement: Disagreement {
            rms_n: rms_n[0],
            floor_rms_n: floor_n,
            ratio: std::array::from_fn(|k| if floor_n[k] > 0.0 { rms_n[0][k] / floor_n[k] } else { 0.0 }),
            ..Disagreement::default()
        },
        baseline: Baseline {
            model: model.into(),
            rescale: Rescale { stiffness: 1.0, strength: 1.0 },
            ..Baseline::default()
        },
        noise: NoiseFound { correlation: [1.0; 3], source: "residual".into(), ..NoiseFound::default() },
        unexplained: UnexplainedFound {
            p_model: 1.0,
            p_runs: 1.0,
            scatter_ratio: ScatterRatio { normal: 1.0, friction: 1.0 },
            ..UnexplainedFound::default()
        },
        holdout: CrossValidationError {
            method: method.into(),
            runs,
            rms_calibrated_n: rms_n[0],
            rms_before_n: rms_n[0],
            rms_after_n: rms_n[1],
            floor_rms_n: floor_n,
            ratio_calibrated: ratio(rms_n[0]),
            ratio_before: ratio(rms_n[0]),
            ratio_after: ratio(rms_n[1]),
            refused_after_n: None,
        },
        version: env!("CARGO_PKG_VERSION").into(),
        ..Diagnosis::default()
    }
}
