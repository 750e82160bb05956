//! The result of an identification with everything that its report shows.

use serde::{Deserialize, Serialize};

use super::{
    FingerPoint, LawPoint, Mapping, Point, SimplexRun,
    confidence::{Interval, Map},
};

/// Model beside measurement at one row of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Modelled {
    /// Depth of the table, mm.
    pub depth_mm: f64,
    /// Depth at which the model was run (offset and shift added), mm.
    pub model_depth_mm: f64,
    /// Normal force, N.
    pub normal_force_n: f64,
    /// Contact area, mm².
    pub contact_area_mm2: f64,
    /// F/N.
    pub friction_coefficient: f64,
    /// Model over measured less 1, %.
    pub normal_force_difference_percent: f64,
    /// Model over measured contact area less 1, %; none if the area was not measured.
    pub contact_area_difference_percent: Option<f64>,
    /// Model over measured F/N less 1, %.
    pub friction_coefficient_difference_percent: f64,
}

/// A finger with a law beside the whole table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelDataComparison {
    /// lambda, MPa^(1 - beta).
    pub lambda: f64,
    /// beta.
    pub beta: f64,
    /// tau_0, MPa.
    pub tau0_mpa: f64,
    /// One entry per row of the table.
    pub rows: Vec<Modelled>,
    /// Sum of squared differences of F/N, unweighted.
    pub sum_of_squares: f64,
}

/// A fitted parameter of the finger or the law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// Its name in words.
    pub name: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Value before the fit.
    pub start: f64,
    /// Value.
    pub value: f64,
    /// Standard error; none if the data do not determine it.
    pub standard_error: Option<f64>,
    /// Bounds of the fit.
    pub bounds: [f64; 2],
    /// Whether the value is at one of them.
    pub at_bound: bool,
}

/// Calibration of the finger, or the joint fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerOutcome {
    /// Parameters that varied.
    pub fitted: Vec<FittedParameter>,
    /// Correlations of these parameters, in their order.
    pub correlation: Vec<Vec<f64>>,
    /// The finger found.
    pub finger: FingerPoint,
    /// Law during (calibration) or found by (joint) the fit.
    pub law: LawPoint,
    /// Error found of each row's depth, mm; zeros in a calibration.
    pub depth_shifts_mm: Vec<f64>,
    /// The table beside the model at that law.
    pub comparison: ModelDataComparison,
    /// Root mean square of the weighted residuals (1: as large as the stated errors).
    pub rms: f64,
    /// Root mean square before the fit.
    pub rms_before: f64,
    /// Evaluations of all depths, derivatives not counted.
    pub evaluations: usize,
    /// The minimiser's end in words.
    pub ended: String,
}

/// The fast route.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FastOutcome {
    /// Space mapping, step by step.
    pub mappings: Vec<Mapping>,
    /// Evaluations of all depths by Gauss–Newton, derivatives included.
    pub gauss_newton_evaluations: usize,
    /// Law at the end of Gauss–Newton.
    pub gauss_newton: Mapping,
    /// Evaluations of the direct search from there; 0 if there was none, as when tau_0 is searched for as well.
    pub direct_evaluations: usize,
    /// Law at the end.
    pub law: LawPoint,
    /// Its sum of squares.
    pub sum_of_squares: f64,
}

/// A constant with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Constant {
    /// Name of the constant.
    pub name: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Value.
    pub value: f64,
    /// The search region's bound that the value is at, in the constant's unit; none inside the region.
    pub at_bound: Option<f64>,
    /// Standard error of the linearised fit; none if flat or without degrees of freedom.
    pub standard_error: Option<f64>,
    /// Interval by profile likelihood at the confidence level; none without degrees of freedom.
    pub interval: Option<Interval>,
}

/// The law found and its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawOutcome {
    /// The law.
    pub law: LawPoint,
    /// Strength at 5 kPa, beta and, if it was freed, tau_0.
    pub constants: Vec<Constant>,
    /// lambda, MPa^(1 - beta): derived from strength and exponent.
    pub lambda: f64,
    /// lambda over the ends of beta's interval, strength at its best for each; its unit changes along the interval.
    pub lambda_range: Option<[f64; 2]>,
    /// Correlation of ln strength and beta, linearised.
    pub correlation: f64,
    /// Correlation of ln lambda and beta, linearised: the reason why lambda itself is not fitted. None if the table
    /// leaves a direction of the two constants undetermined.
    pub correlation_of_lambda: Option<f64>,
    /// Regularisation of the law and its influence.
    pub regularisation: Regularisation,
    /// Standard error of a friction coefficient, given or estimated from the misfit.
    pub coefficient_error: Option<f64>,
    /// Whether the errors of the coefficients were given.
    pub error_is_known: bool,
    /// Confidence level.
    pub confidence: f64,
    /// Likelihood over strength and exponent; none without degrees of freedom.
    pub map: Option<Map>,
    /// Largest difference of the surrogate that drew region and intervals from finite elements, at the ends of the
    /// intervals, % of F/N; none if the finite elements found no slide.
    pub region_check_percent: Vec<Option<f64>>,
    /// The table beside the model.
    pub comparison: ModelDataComparison,
    /// Remarks on the numbers, in sentences.
    pub remarks: Vec<String>,
}

/// The pressure below which the power of the law is replaced by a parabola through the origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Regularisation {
    /// That pressure, MPa.
    pub pressure_mpa: f64,
    /// Share of it with which the slides were made again: the smallest of 0.5, 0.7, 0.85 with which there is a slide.
    pub probed_share: f64,
    /// Largest change of F/N then, % of it; none if there is no slide with any of these.
    pub probed_percent: Option<f64>,
}

impl Regularisation {
    /// Effect of a smaller regularisation pressure, in words that follow "with".
    pub fn effect(&self) -> String {
        let share = 100.0 * self.probed_share;
        match self.probed_percent {
            Some(percent) => format!("{share:.0} % of that F/N changes by at most {percent:.2} %"),
            None => format!("{share:.0} % of that no steady slide is found"),
        }
    }
}

/// Test whether the table distinguishes tau_0 from beta.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tau0Outcome {
    /// Best law with tau_0 free, on the surrogate.
    pub law: LawPoint,
    /// Its sum of squares.
    pub sum_of_squares: f64,
    /// That of the best law with tau_0 held.
    pub sum_of_squares_held: f64,
    /// tau_0's share of the strength at 5 kPa, and the least sum of squares and best beta there.
    pub profile: Vec<[f64; 3]>,
    /// Shares that the table allows at the confidence level; none without degrees of freedom.
    pub allowed: Option<Interval>,
    /// The verdict.
    pub sentence: String,
}

/// The exponent against the zero of the normal force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceZeroOutcome {
    /// Fits, one for each zero.
    pub points: Vec<ForceZeroPoint>,
    /// The result as a sentence.
    pub sentence: String,
}

/// Finger and law fitted to the table without one zero of the normal force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceZeroPoint {
    /// Assumed reading of the sensor without load, N.
    pub normal_force_offset_n: f64,
    /// Calibrated factor on every stiffness.
    pub stiffness: f64,
    /// Calibrated depth offset, mm.
    pub depth_offset_mm: f64,
    /// Strength at 5 kPa, kPa.
    pub tau_ref_kpa: f64,
    /// lambda, MPa^(1 - beta).
    pub lambda: f64,
    /// Exponent.
    pub beta: f64,
    /// Root mean square difference of all numbers of the table, as they were read, %.
    pub rms_percent: f64,
}

/// A depth that was left out and predicted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Measured normal force, N.
    pub normal_force_n: f64,
    /// Measured F/N.
    pub measured: f64,
    /// Law fitted to the other depths.
    pub law: LawPoint,
    /// F/N predicted: by finite elements at that depth, by finite elements at the measured normal force (between
    /// their depths), by F = c N^(2/3) and by F = c N^n fitted to the other depths; none if there is no slide.
    pub predicted: [Option<f64>; 4],
    /// Differences of these four from the measured, %.
    pub differences_percent: [Option<f64>; 4],
}

/// A point of the curve F/N over N.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Depth of the model, mm.
    pub depth_mm: f64,
    /// Normal force, N.
    pub normal_force_n: f64,
    /// F/N.
    pub friction_coefficient: f64,
    /// Contact area, mm².
    pub contact_area_mm2: f64,
}

/// The curve F/N over N and its end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Finite elements, in rising force.
    pub points: Vec<CurvePoint>,
    /// Powers n of F/N ~ N^n at the curve's lower and upper end.
    pub exponents: [f64; 2],
    /// Continuation to the requested forces, by these powers: N, F/N. Not computed by finite elements.
    pub continued: Vec<[f64; 2]>,
    /// Reasons why the curve ends at its lower and upper end.
    pub ends: Vec<String>,
}

/// A published finding beside this model's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Published {
    /// The finding.
    pub finding: String,
    /// Its source.
    pub source: String,
    /// Their number.
    pub published: f64,
    /// This model's.
    pub ours: f64,
    /// Conditions of our number.
    pub conditions: String,
}

/// Effect of a change of one input at one depth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensitivity {
    /// The input.
    pub input: String,
    /// Its unit; empty for a pure number, `%` for a relative change.
    pub unit: String,
    /// Change, in that unit: less and more.
    pub change: [f64; 2],
    /// Depth of the table, mm.
    pub depth_mm: f64,
    /// Change of N by each, %; none if it failed.
    pub normal_force_percent: [Option<f64>; 2],
    /// Change of A, %.
    pub contact_area_percent: [Option<f64>; 2],
    /// Change of F/N, %.
    pub friction_coefficient_percent: [Option<f64>; 2],
}

/// Time of a stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// Wall time, s.
    pub wall_s: f64,
    /// CPU time of the process, s.
    pub cpu_s: f64,
    /// Steady states that were computed.
    pub states: u32,
    /// Equilibria, cut steps, iterations, factorisations.
    pub effort: super::Effort,
}

/// The error surface of the simplex: sum of squares over lambda and beta, by the surrogate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// ln lambda, rising.
    pub ln_lambda: Vec<f64>,
    /// beta, rising.
    pub beta: Vec<f64>,
    /// Sum of squared differences, shape (beta, lambda).
    pub sum_of_squares: Vec<Vec<f64>>,
}

/// Provenance of a result: program, settings, table, mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the table.
    pub table: String,
    /// Shape before calibration.
    pub shape: String,
    /// Model of the bones: fixed, floating or deformable.
    pub bones: String,
    /// Mesh preset.
    pub mesh_preset: String,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Hash of settings and table.
    pub settings_hash: String,
    /// Version of the program.
    pub program_version: String,
}

/// The result of an identification.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Provenance.
    pub provenance: Provenance,
    /// The table.
    pub table: Vec<Point>,
    /// Published constants on the finger before its calibration.
    pub published_before: ModelDataComparison,
    /// Published constants on the calibrated finger.
    pub published: ModelDataComparison,
    /// Calibration; none if it was off.
    pub calibration: Option<FingerOutcome>,
    /// Simplex runs.
    pub simplex: Vec<SimplexRun>,
    /// The best of them continued in ln strength and beta, with finer tolerances.
    pub refined: Option<SimplexRun>,
    /// Fast route; none with published constants alone.
    pub fast: Option<FastOutcome>,
    /// Difference of the continued simplex from the fast route: relative in strength, absolute in beta.
    pub routes_differ: Option<[f64; 2]>,
    /// The law found; none with published constants alone.
    pub law: Option<LawOutcome>,
    /// Test of tau_0.
    pub tau0: Option<Tau0Outcome>,
    /// The exponent against the zero of the normal force.
    pub force_zero: Option<ForceZeroOutcome>,
    /// Error surface.
    pub surface: Option<Surface>,
    /// Joint fit.
    pub joint: Option<FingerOutcome>,
    /// Depths left out and predicted.
    pub left_out: Vec<LeftOut>,
    /// F/N over N.
    pub curve: Option<Curve>,
    /// Published checks.
    pub checks: Vec<Published>,
    /// Sensitivities.
    pub sensitivities: Vec<Sensitivity>,
    /// Largest penetration of any state, mm: contact is by penalty alone.
    pub penetration_mm: f64,
    /// Times.
    pub stages: Vec<Stage>,
}

impl Outcome {
    /// Depths of the calibrated model that correspond to the table's, mm, rising.
    pub fn calibrated_depths_mm(&self) -> Vec<f64> {
        let mut depths: Vec<f64> = self.published.rows.iter().map(|r| r.model_depth_mm).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup();
        depths
    }
}
