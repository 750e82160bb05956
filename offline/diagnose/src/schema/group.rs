//! The report of several fingers, in the form `fingerpad-group/1`.

use serde::{Deserialize, Serialize};

use super::{Caution, FittedParameter, Verdict};

/// What several fingers show together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GroupVerdict {
    /// No law stands out of all fingers together.
    None,
    /// One law stands out, and the interval of its mean size over fingers excludes zero.
    Shared,
    /// The same, with laws of other families that explain the fingers as well.
    Ambiguous,
    /// A law stands out, and the fingers differ so much in it that its mean size may be zero.
    Differs,
}

/// The size of a law in one finger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerSize {
    /// Name of the finger.
    pub finger: String,
    /// Size.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// One size parameter of a shared law over all fingers: a meta-analysis of random effects [DerSimonian & Laird 1986], with
/// the interval of the mean of Hartung & Knapp 2001.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SharedSize {
    /// Name of the parameter.
    pub name: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Mean over fingers.
    pub mean: f64,
    /// 95 % interval of the mean, with the fingers as units.
    pub ci95: [f64; 2],
    /// Standard deviation between fingers beyond the errors of the single sizes.
    pub sd_between_fingers: f64,
    /// Cochran's Q.
    pub q: f64,
    /// Its p for fingers of one size.
    pub p_heterogeneity: f64,
    /// Share of the scatter that is not error of the single sizes, I² [Higgins & Thompson 2002].
    pub i_squared: f64,
    /// The single fingers.
    pub fingers: Vec<FingerSize>,
}

/// A law with one shape for all fingers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SharedLaw {
    /// Law.
    pub law: String,
    /// Its family.
    pub family: String,
    /// Shape parameters, those of the best point of the grid.
    pub shape: Vec<FittedParameter>,
    /// Gain in 2 log likelihood over all fingers, without what an error of the baseline's form explains.
    pub gain_2ll: f64,
    /// The gains of the single fingers.
    pub gains_2ll: Vec<f64>,
    /// Model-based p over all laws and shapes.
    pub p_model: f64,
    /// The sizes.
    pub sizes: Vec<SharedSize>,
}

/// What one finger shows by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerAlone {
    /// Name of the finger.
    pub finger: String,
    /// Runs of calibration and measured file.
    pub runs: [usize; 2],
    /// Verdict of this finger by itself, without held-out runs.
    pub verdict: Verdict,
    /// Laws that are named or candidates.
    pub laws: Vec<String>,
    /// Factors on normal force and strength against its own calibration.
    pub rescale: super::Rescale,
    /// Laws of the finger itself.
    pub finger_laws: Vec<String>,
    /// What the files do not support.
    pub cautions: Vec<Caution>,
}

/// Several fingers in one analysis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupDiagnosis {
    /// `fingerpad-group/1`.
    pub schema: String,
    /// The answer.
    pub verdict: GroupVerdict,
    /// The shared law first, then laws of other families that cannot be excluded; without a shared law the best one.
    pub laws: Vec<SharedLaw>,
    /// The fingers.
    pub fingers: Vec<FingerAlone>,
    /// Seed of the sign flips of the single fingers.
    pub seed: u64,
    /// Version of the program.
    pub version: String,
}
