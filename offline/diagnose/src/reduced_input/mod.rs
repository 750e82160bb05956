//! Diagnoses from less than measured runs with depth: a trace of forces alone; the form of a report without runs.
//!
//! Main types: [`ReducedDiagnosis`], [`Plot`]; main functions: [`diagnose_forces`], [`reduced_report`].
//! May use: schema, statistics (tail probabilities, damped steps), data, laws (their names).

mod air;
mod forces;
mod tare;

pub use forces::diagnose_forces;

use crate::schema::{
    Baseline, Confidence, CrossValidationError, Diagnosis, Disagreement, NoiseFound, Rescale, ScatterRatio,
    UnexplainedFound, Verdict, Witness,
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
        title: String::new(),
        verdict,
        confidence: Confidence::default(),
        witness: Witness::default(),
        cautions: Vec::new(),
        effects: Vec::new(),
        disagreement: Disagreement {
            rms_n: rms_n[0],
            floor_rms_n: floor_n,
            ratio: std::array::from_fn(|k| if floor_n[k] > 0.0 { rms_n[0][k] / floor_n[k] } else { 0.0 }),
            regions: Vec::new(),
            along_driver: None,
        },
        baseline: Baseline {
            model: model.into(),
            parameters: Vec::new(),
            rescale: Rescale { stiffness: 1.0, strength: 1.0 },
            calibration_misfit: [0.0; 3],
        },
        instrument: Vec::new(),
        finger_laws: Vec::new(),
        noise: NoiseFound {
            additive_n: 0.0,
            multiplicative: 0.0,
            run_gain_normal: 0.0,
            run_gain_friction: 0.0,
            run_offset_n: 0.0,
            depth_zero_mm: 0.0,
            correlation: [1.0; 3],
            source: "residual".into(),
        },
        tests: Vec::new(),
        unexplained: UnexplainedFound {
            outside_calibration: false,
            significant: false,
            column: String::new(),
            channel: String::new(),
            gain: 0.0,
            p_model: 1.0,
            p_runs: 1.0,
            size_n: 0.0,
            size_relative: 0.0,
            largest_at: None,
            scatter_ratio: ScatterRatio { normal: 1.0, friction: 1.0 },
            partial: Vec::new(),
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
        power: None,
        stability: None,
        fe_confirmation: None,
        next_step: String::new(),
        next_experiment: None,
        corrected_model: None,
        corrected_rms_n: None,
        corrected_tables: Vec::new(),
        input: Vec::new(),
        seed: 0,
        version: env!("CARGO_PKG_VERSION").into(),
        elapsed_s: 0.0,
    }
}
