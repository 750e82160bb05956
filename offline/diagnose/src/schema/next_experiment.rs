//! The next experiment in the report.

use std::collections::BTreeMap;

use crate::laws::run_columns::run_columns;
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

/// A number that a plan may set in a stroke.
pub struct Factor {
    /// Name of its column.
    pub name: &'static str,
    /// Its unit, where it is no column of runs.
    own_unit: &'static str,
    /// Its place in a stroke.
    pub of: fn(&mut PlannedRun) -> &mut Option<f64>,
    /// The range over which plans vary it, and whether in equal ratios; what has none is varied in ways of its own.
    pub range: Option<([f64; 2], bool)>,
    /// Rest in which it settles at another value, s. A state that takes such time is varied only where runs record it.
    pub settle_s: f64,
}

const fn factor(name: &'static str, of: fn(&mut PlannedRun) -> &mut Option<f64>) -> Factor {
    Factor { name, own_unit: "", of, range: None, settle_s: 0.0 }
}

impl Factor {
    const fn over(self, range: [f64; 2], in_equal_ratios: bool, settle_s: f64) -> Self {
        Self { range: Some((range, in_equal_ratios)), settle_s, ..self }
    }

    /// What the command line calls it: the first word of its name.
    pub fn short(&self) -> &'static str {
        self.name.split('_').next().unwrap_or(self.name)
    }

    /// Its unit.
    pub fn unit(&self) -> &'static str {
        run_columns().iter().find(|known| known.name == self.name).map_or(self.own_unit, |known| known.unit)
    }

    /// Its value in a stroke, where the plan sets it.
    pub fn value(&self, run: &PlannedRun) -> Option<f64> {
        *(self.of)(&mut run.clone())
    }
}

/// The numbers that plans set, in the order of their columns in a file of strokes.
pub const FACTORS: [Factor; 8] = [
    factor("depth_mm", |r| &mut r.depth_mm),
    factor("speed_mm_s", |r| &mut r.speed_mm_s).over([0.5, 20.0], true, 0.0),
    factor("direction_deg", |r| &mut r.direction_deg),
    factor("dwell_s", |r| &mut r.dwell_s).over([0.3, 30.0], true, 0.0),
    factor("hydration_au", |r| &mut r.hydration_au).over([15.0, 75.0], false, 300.0),
    factor("temperature_c", |r| &mut r.temperature_c).over([27.0, 36.0], false, 300.0),
    Factor { own_unit: "mm", ..factor("length_mm", |r| &mut r.length_mm) },
    Factor { own_unit: "s", ..factor("rest_before_s", |r| &mut r.rest_before_s) },
];

/// Time that a stroke takes beside its rest and its hold, s: to set it up, press, slide and lift.
const STROKE_S: f64 = 30.0;

/// Time that strokes take with their rests and holds, minutes.
pub fn minutes(runs: &[PlannedRun]) -> f64 {
    let seconds = |r: &PlannedRun| r.rest_before_s.unwrap_or(60.0) + r.dwell_s.unwrap_or(1.0) + STROKE_S;
    runs.iter().map(seconds).sum::<f64>() / 60.0
}
