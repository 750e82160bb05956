//! The next experiment in the report.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Strokes that are proposed as the next experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// The pairs of families that it separates.
    pub separates: Vec<[String; 2]>,
    /// Column that the strokes vary, or `all`.
    pub factor: String,
    /// Least separation that is to be expected.
    pub lambda_rival_expected: f64,
    /// Time that the strokes take with rests and with setting what they vary, minutes.
    pub minutes: f64,
    /// What each factor can do alone, or all together, and its price, cheapest first.
    pub prices: Vec<FactorPrice>,
    /// The strokes, in this order.
    pub runs: Vec<PlannedRun>,
}

/// The best plan that varies a factor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FactorPrice {
    /// Column that the plan varies, or `all`.
    pub factor: String,
    /// Least separation that is to be expected.
    pub lambda_rival_expected: f64,
    /// Time, minutes.
    pub minutes: f64,
}

/// A stroke to be run; missing values are those of the reference conditions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlannedRun {
    /// Depth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Speed, mm/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// Direction, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction_deg: Option<f64>,
    /// Hold before sliding, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dwell_s: Option<f64>,
    /// Moisture of the skin to be reached, a.u.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hydration_au: Option<f64>,
    /// Temperature of the skin to be reached, °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Length of the stroke, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    /// Rest in the air before it, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_before_s: Option<f64>,
    /// Whether a new block begins: the finger has recovered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub new_block: Option<bool>,
    /// Whether the stroke goes back at its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reverse: Option<bool>,
    /// Columns of the user's own, in their units.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub own: BTreeMap<String, f64>,
}

/// Time that a stroke takes beside its rest and its hold, s: to set it up, press, slide and lift.
const STROKE_S: f64 = 30.0;

/// Time that strokes take with their rests and holds, minutes.
pub fn minutes(runs: &[PlannedRun]) -> f64 {
    let seconds = |r: &PlannedRun| r.rest_before_s.unwrap_or(60.0) + r.dwell_s.unwrap_or(1.0) + STROKE_S;
    runs.iter().map(seconds).sum::<f64>() / 60.0
}
