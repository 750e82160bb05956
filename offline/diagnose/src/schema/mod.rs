//! The report `report.json` in the form `fingerpad-diagnosis/1`: plain data, read and written by serde.
//!
//! Main type: [`Diagnosis`]. May use: laws (the description of their tables).

mod fit_quality;
mod group;
mod next_experiment;
mod repeated;

use serde::{Deserialize, Serialize};

use crate::laws::{OwnFormula, TableSummary};

pub use fit_quality::{CrossValidationError, Region};
pub use group::{FingerAlone, FingerSize, GroupDiagnosis, GroupVerdict, SharedLaw, SharedSize};
pub use next_experiment::{FACTORS, Factor, FactorPrice, NextExperiment, PlannedRun, minutes};
pub use repeated::{LeftOut, NotSimulated, Power, PowerCell, Rate, Stability};

/// The answer of a diagnosis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is missing that the data could show.
    #[default]
    None,
    /// Each missing effect has one family.
    Named,
    /// At least one effect has competitors that the protocol cannot separate.
    Ambiguous,
    /// Something is there that no law of the library covers.
    UnexplainedStructure,
}

/// −2 log likelihood or evidence up to which two explanations are not distinguished: odds of 20 to 1.
pub const INDISTINGUISHABLE: f64 = 6.0;
/// p of what an explanation leaves below which it leaves a structure.
pub const STRUCTURE_P: f64 = 1e-3;

impl Verdict {
    /// The verdict on weighed explanations.
    ///
    /// * `left`: whether the best one leaves a structure
    /// * `claimed`: whether an effect stands out
    /// * `open`: whether another explanation is not distinguished from it
    pub fn of(left: bool, claimed: bool, open: bool) -> Self {
        match (left, claimed, open) {
            (true, ..) => Self::UnexplainedStructure,
            (_, false, _) => Self::None,
            (.., true) => Self::Ambiguous,
            (.., false) => Self::Named,
        }
    }

    /// Whether effects are claimed.
    pub fn is_claim(self) -> bool {
        matches!(self, Self::Named | Self::Ambiguous)
    }
}

/// A parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// Name, as in the contract.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// A law that may be the missing effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CandidateLaw {
    /// Law.
    pub law: String,
    /// Family.
    pub family: String,
    /// −2 log likelihood above the best law's.
    pub delta_2ll: f64,
    /// Separation from the best law under the present protocol.
    pub lambda_rival: f64,
}

/// A missing effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectFound {
    /// Best candidate.
    pub law: String,
    /// Its family.
    pub family: String,
    /// What it does to the model, with its parameters by their names; empty where no law of the library or of a user's file has it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub formula: String,
    /// Parameters, fitted inside the model.
    pub parameters: Vec<FittedParameter>,
    /// 90th percentile of the relative change of force.
    pub size_p90_relative: f64,
    /// Gain in 2 log likelihood.
    pub gain_2ll: f64,
    /// The p that `--alpha` is compared with: `p_model` and `p_runs` together.
    #[serde(default)]
    pub p: f64,
    /// Model-based p over the whole grid of laws and shapes.
    pub p_model: f64,
    /// Sign-flip p over runs and the library.
    pub p_runs: f64,
    /// Whether the evidence lies in the comparison with the calibration; then `p_runs` is no test.
    pub against_calibration: bool,
    /// Whether measured runs lie outside the calibration in what drives it.
    pub outside_calibration: bool,
    /// Expected gain under this protocol.
    pub lambda_detect: f64,
    /// The best law first, then those that cannot be excluded.
    pub candidates: Vec<CandidateLaw>,
    /// The formula, where it is a law of a user's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own: Option<OwnFormula>,
}

/// Where baseline and measurement differ before any effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Disagreement {
    /// Root mean square residual of normal, x, y, N.
    pub rms_n: [f64; 3],
    /// Residual that a perfect model would leave: row noise and scatter between runs.
    pub floor_rms_n: [f64; 3],
    /// Quotient.
    pub ratio: [f64; 3],
    /// Regions that stand out without the claimed effects: along the drivers of named ones, then the others, strongest first.
    pub regions: Vec<Region>,
    /// Along the driver of the first claimed effect the regions in which the readings lie farthest below and above the model without it.
    #[serde(default)]
    pub along_driver: Option<[Region; 2]>,
}

/// A parameter of the baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaselineParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// After the refit on the measured set.
    pub value: f64,
    /// Standard deviation.
    pub sd: f64,
    /// On the calibration set.
    pub calibrated: f64,
    /// Standard deviation there.
    pub calibrated_sd: f64,
}

/// A change of scale between the calibration and the measured set; never an effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rescale {
    /// Factor on the normal force.
    pub stiffness: f64,
    /// Factor on the strength.
    pub strength: f64,
}

/// The baseline after the refit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// Model file.
    pub model: String,
    /// The smooth model's parameters.
    pub parameters: Vec<BaselineParameter>,
    /// Scales.
    pub rescale: Rescale,
    /// Residual of the baseline within the calibration runs over their noise: normal, x, y; 1 is a fit to the noise.
    pub calibration_misfit: [f64; 3],
}

/// Noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NoiseFound {
    /// Row noise, N.
    pub additive_n: f64,
    /// Row noise, share of the force.
    pub multiplicative: f64,
    /// Scatter between runs of the stiffness.
    pub run_gain_normal: f64,
    /// Scatter between runs of the strength.
    pub run_gain_friction: f64,
    /// Scatter between runs of the offsets, N.
    pub run_offset_n: f64,
    /// Scatter between runs of the touch point, mm.
    pub depth_zero_mm: f64,
    /// Factors on the variances of normal, x, y by which errors that are alike in neighbouring rows outweigh independent ones; 1 without.
    #[serde(default = "independent")]
    pub correlation: [f64; 3],
    /// `calibration`.
    pub source: String,
}

/// A law that the calibration runs follow. It belongs to the finger and to the model of every file, and is no missing effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerLawFound {
    /// Law.
    pub law: String,
    /// Its family.
    pub family: String,
    /// Parameters as calibrated.
    pub parameters: Vec<FittedParameter>,
    /// Gain in 2 log likelihood on the calibration runs.
    pub gain_2ll: f64,
}

/// A lag of the forces behind the positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InstrumentLag {
    /// `calibration`: found there and taken out of every file; `measured`: that of the measured runs, where it differs.
    pub source: String,
    /// Mean delay of the forces, s: delay and time constant together.
    pub lag_s: f64,
    /// 95 % interval of the mean delay, s.
    pub ci95_s: [f64; 2],
    /// Pure delay, s; negative where the positions lag.
    pub delay_s: f64,
    /// Time constant of a first-order low-pass, s.
    pub time_constant_s: f64,
    /// Gain in 2 log likelihood over the file without it.
    pub gain_2ll: f64,
}

/// Factors of rows whose errors are independent.
fn independent() -> [f64; 3] {
    [1.0; 3]
}

/// The test of one law.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LawTest {
    /// Law.
    pub law: String,
    /// Family.
    pub family: String,
    /// Gain in 2 log likelihood over the baseline alone.
    pub gain_2ll: f64,
    /// Model-based p over the grid.
    pub p_model: f64,
    /// Sign-flip p over the library.
    pub p_runs: f64,
    /// Whether it would pass as the first law.
    pub significant: bool,
    /// Whether the set can test it.
    pub testable: bool,
    /// Why not.
    pub reason: String,
}

/// Structure that no law explains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnexplainedFound {
    /// Whether measured runs lie outside the calibration in its column.
    #[serde(default)]
    pub outside_calibration: bool,
    /// Whether it counts.
    pub significant: bool,
    /// Column.
    pub column: String,
    /// `normal` or `friction`.
    pub channel: String,
    /// Gain.
    pub gain: f64,
    /// Model-based p over all bases.
    pub p_model: f64,
    /// Sign-flip p over all bases.
    pub p_runs: f64,
    /// Its size: root mean square of what it changes of the channel over the rows in contact, N; of scatter between runs what exceeds the
    /// calibration's.
    #[serde(default)]
    pub size_n: f64,
    /// The same over the root mean square of the force.
    #[serde(default)]
    pub size_relative: f64,
    /// The part of the column in which the channel's residual is largest; none for a column that is a product, or the run.
    #[serde(default)]
    pub largest_at: Option<Region>,
    /// Scatter between runs over what the calibration and the declared reading errors explain.
    pub scatter_ratio: ScatterRatio,
    /// Laws that took part of it and are not claimed.
    pub partial: Vec<CandidateLaw>,
}

impl UnexplainedFound {
    /// Places the structure by the map of what is left: the part of its column in which the channel is farthest off.
    pub(crate) fn place(&mut self, map_after: &[Region]) {
        let ours = |r: &&Region| r.column == self.column && r.channel == self.channel;
        let size = |r: &Region| r.mean_relative.abs();
        self.largest_at = map_after.iter().filter(ours).max_by(|a, b| size(a).total_cmp(&size(b))).cloned();
    }

    /// Where the rest lies that the laws leave on held-out runs: in the channel that is farthest above its noise floor, and between runs
    /// where these scatter.
    ///
    /// * `lag`: a lag that was found beside the laws
    /// * `force_n`: root mean square of normal force and friction over the rows in contact, N
    pub(crate) fn locate(&mut self, held_out: &CrossValidationError, lag: Option<&EffectFound>, force_n: [f64; 2]) {
        let ratio = |k: usize| held_out.rms_after_n[k] / held_out.floor_rms_n[k].max(1e-12);
        let (channels, name, force) = if ratio(0) > ratio(1).max(ratio(2)) {
            (0..1, "normal", force_n[0])
        } else {
            (1..3, "friction", force_n[1])
        };
        self.channel = name.into();
        let excess = |k: usize| held_out.rms_after_n[k].powi(2) - held_out.floor_rms_n[k].powi(2);
        self.size_n = channels.map(excess).sum::<f64>().max(0.0).sqrt();
        self.size_relative = self.size_n / force.max(1e-12);
        if self.column.is_empty() || self.scatter_ratio.normal.max(self.scatter_ratio.friction) > 2.0 {
            self.column = "run_id".into();
        }
        self.partial.extend(lag.into_iter().map(|lag| CandidateLaw {
            law: lag.law.clone(),
            family: lag.family.clone(),
            delta_2ll: -lag.gain_2ll,
            lambda_rival: 0.0,
        }));
    }
}

/// Scatter between runs over that of the calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScatterRatio {
    /// Of the stiffness.
    pub normal: f64,
    /// Of the strength.
    pub friction: f64,
}

/// What the finite elements say of a named effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Confirmed {
    /// Their gap shrinks to at most one and a half noise floors.
    Yes,
    /// It shrinks and stays above that.
    InPart,
    /// It does not shrink: nothing is said for the effect nor against it.
    #[default]
    Open,
    /// It grows.
    No,
}

/// Gap that is left after over that before, at most, where it has shrunk: the quotient of two residuals scatters by some ten per cent.
const SHRUNK: f64 = 0.9;
/// Noise floors that may be left of an effect that is confirmed.
const CLOSED: f64 = 1.5;

/// The finite-element model with the effect in its law: what it leaves of a part of the
/// strokes. Three numbers: normal, x, y.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeConfirmation {
    /// The finding.
    #[serde(default)]
    pub confirmed: Confirmed,
    /// Mesh preset.
    pub mesh: String,
    /// Before, N.
    pub rms_before_n: [f64; 3],
    /// After, N.
    pub rms_after_n: [f64; 3],
    /// Floor, N.
    pub floor_rms_n: [f64; 3],
    /// Geometry of the finite-element finger.
    pub shape: String,
    /// The set that the strokes were taken from: `holdout` or `measured`.
    pub set: String,
    /// The strokes that were run.
    pub runs: Vec<String>,
    /// Those that were to be run and for which no equilibrium was found.
    pub without_equilibrium: Vec<String>,
    /// The calibration strokes that the finite-element finger was fitted to.
    pub calibration_runs: Vec<String>,
    /// Root mean square residual of these, N.
    pub calibration_rms_n: [f64; 3],
    /// Factor on the tissue's stiffness that they asked for, at 0.9 mm.
    pub stiffness: f64,
    /// Factor on tau_crit that they asked for, at 0.9 mm.
    pub strength: f64,
    /// The reduced baseline on the same strokes before, N.
    pub reduced_before_n: [f64; 3],
    /// With the effect, N.
    pub reduced_after_n: [f64; 3],
}

impl FeConfirmation {
    /// The worst channel's residual before and after, in noise floors.
    pub fn gap(&self) -> [f64; 2] {
        [self.rms_before_n, self.rms_after_n].map(|rms_n| self.in_floors(rms_n))
    }

    /// The same of the reduced model.
    pub fn reduced_gap(&self) -> [f64; 2] {
        [self.reduced_before_n, self.reduced_after_n].map(|rms_n| self.in_floors(rms_n))
    }

    fn in_floors(&self, rms_n: [f64; 3]) -> f64 {
        (0..3).map(|k| rms_n[k] / self.floor_rms_n[k].max(1e-12)).fold(0.0, f64::max)
    }

    /// The same with the finding that follows from the gap.
    pub fn judged(self) -> Self {
        let [before, after] = self.gap();
        let confirmed = if after * SHRUNK > before {
            Confirmed::No
        } else if after > before * SHRUNK {
            Confirmed::Open
        } else if after > CLOSED {
            Confirmed::InPart
        } else {
            Confirmed::Yes
        };
        Self { confirmed, ..self }
    }
}

/// A file that went in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFile {
    /// `calibration`, `measured` or `holdout`.
    pub role: String,
    /// Its name without folders.
    pub file: String,
    /// SHA-256.
    pub sha256: String,
    /// Rows in the file.
    pub rows: usize,
    /// Runs in the file.
    pub runs: usize,
    /// Remarks of the reader.
    pub notes: Vec<String>,
}

/// Kind of a [`Caution`] on which no corrected model may rest.
pub const IMPLAUSIBLE: &str = "implausible";

/// A remark on the files that is reported before the verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Caution {
    /// `exchanged`, `unit`, `implausible`, `ignored_column`, `thinned`, `lift_off`, `reading`, `sensor_rail`, `spikes`, `outside_calibration`,
    /// `one_axis`, `few_runs`, `clock`, `too_small` or `scatter`.
    pub kind: String,
    /// `calibration`, `measured` or `holdout`.
    pub role: String,
    /// Column that it is about; empty if it is about rows.
    pub column: String,
    /// The sentence.
    pub text: String,
}

impl Diagnosis {
    /// What cannot be, of which the answer is no more than a symptom.
    pub fn implausible(&self) -> Option<&Caution> {
        self.cautions.iter().find(|caution| caution.kind == IMPLAUSIBLE)
    }
}

/// A column in a regression of run means, without a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// `friction` (over load, in full slip) or `normal` (at the end of the press).
    pub channel: String,
    /// Column.
    pub column: String,
    /// p of the partial F test.
    pub p: f64,
    /// Root mean square over the runs of what the column alone explains, as a share of the force.
    pub size_relative: f64,
}

/// A witness beside the verdict: regressions of run means on their columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Witness {
    /// p below which a column is seen.
    pub level: f64,
    /// Where it contradicts the verdict, as ends of a sentence; empty where both agree or it cannot tell.
    pub disagrees: Vec<String>,
    /// Every column in every channel.
    pub tests: Vec<Seen>,
}

/// How far the verdict can be relied on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Confidence {
    /// The witness contradicts it, or something in the files is implausible.
    Low,
    /// Nothing contradicts it; the witness does not see what it names, or could not look.
    #[default]
    Moderate,
    /// The witness says the same.
    High,
}

/// The report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// `fingerpad-diagnosis/1`.
    pub schema: String,
    /// The answer in a line, as the page has it.
    #[serde(default)]
    pub title: String,
    /// The answer.
    pub verdict: Verdict,
    /// How far it can be relied on.
    #[serde(default)]
    pub confidence: Confidence,
    /// What a regression without a model says beside it.
    #[serde(default)]
    pub witness: Witness,
    /// What is to be known of the files before it.
    pub cautions: Vec<Caution>,
    /// One entry per missing effect, strongest first.
    pub effects: Vec<EffectFound>,
    /// Before any effect.
    pub disagreement: Disagreement,
    /// The baseline.
    pub baseline: Baseline,
    /// The noise.
    pub noise: NoiseFound,
    /// Lags of the forces behind the positions; none where none was found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instrument: Vec<InstrumentLag>,
    /// Laws that the calibration runs follow; none where none was found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub finger_laws: Vec<FingerLawFound>,
    /// Every law.
    pub tests: Vec<LawTest>,
    /// After the accepted effects.
    pub unexplained: UnexplainedFound,
    /// Runs that no fit saw.
    pub holdout: CrossValidationError,
    /// What simulated repetitions of these runs would show; only where it was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<Power>,
    /// How the verdict holds when runs are left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stability: Option<Stability>,
    /// The finite-element model with the effect.
    pub fe_confirmation: Option<FeConfirmation>,
    /// What to do next, in one sentence.
    #[serde(default)]
    pub next_step: String,
    /// Strokes that would settle an ambiguous verdict.
    pub next_experiment: Option<NextExperiment>,
    /// The model file with the effect.
    pub corrected_model: Option<String>,
    /// Root mean square residual of the core with this file on the held-out runs (on the measured ones where there are
    /// none), N.
    pub corrected_rms_n: Option<[f64; 3]>,
    /// How laws of the user's own stand in the corrected model.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub corrected_tables: Vec<TableSummary>,
    /// Files of the diagnosis.
    pub input: Vec<InputFile>,
    /// Seed.
    pub seed: u64,
    /// Version of the program.
    pub version: String,
    /// Wall time, s.
    pub elapsed_s: f64,
}
