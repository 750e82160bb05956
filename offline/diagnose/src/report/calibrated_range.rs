//! Where the measured runs leave what the calibration covers: directions, depths, speeds.
//!
//! Main type: [`CalibratedRange`].

use crate::data::runs::{Run, RunSet};
use crate::laws::{Column, Law};
use crate::schema::{Caution, EffectFound, Region, UnexplainedFound};

/// Angle to the next calibrated direction beyond which a direction is not covered, degrees: half of a quarter turn, less
/// what directions scatter.
const FAR_DEG: f64 = 30.0;
/// Factor on the largest depth up to which it is covered.
const DEEPER: f64 = 1.05;
/// Factor on the range of speeds up to which it is covered.
const FASTER: f64 = 1.5;

/// What the calibration runs cover.
pub struct CalibratedRange {
    directions_deg: Vec<f64>,
    depth_max_mm: f64,
    speed_mm_s: [f64; 2],
}

fn slides(run: &Run) -> bool {
    run.rows.iter().any(|r| r.path_mm > 0.05)
}

/// Smallest angle between two directions, degrees.
fn between(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(360.0);
    d.min(360.0 - d)
}

impl CalibratedRange {
    /// The range of a calibration set.
    pub fn of(set: &RunSet) -> Self {
        let sliding = || set.runs.iter().filter(|r| slides(r));
        // A stroke and its way back are two directions.
        let rows = sliding().flat_map(|r| &r.rows).filter(|r| r.turn_mm > 0.5);
        let mut directions_deg: Vec<f64> = Vec::new();
        for angle in rows.map(|r| r.along[1].atan2(r.along[0]).to_degrees()) {
            if directions_deg.iter().all(|d| between(*d, angle) > 2.0) {
                directions_deg.push(angle);
            }
        }
        let speeds = || sliding().map(|r| r.value(Column::Speed)).filter(|v| *v > 0.0);
        Self {
            directions_deg,
            depth_max_mm: set.runs.iter().map(Run::depth_mm).fold(0.0, f64::max),
            speed_mm_s: [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)],
        }
    }

    /// Whether a value of a column lies outside.
    pub fn is_outside(&self, column: Column, value: f64) -> bool {
        match column {
            Column::Direction => {
                !self.directions_deg.is_empty() && self.directions_deg.iter().all(|d| between(*d, value) > FAR_DEG)
            }
            Column::Depth => value > DEEPER * self.depth_max_mm,
            Column::Speed => {
                let [slow, fast] = self.speed_mm_s;
                fast > 0.0 && value > 0.0 && (value > FASTER * fast || value < slow / FASTER)
            }
            _ => false,
        }
    }

    /// The axis, degrees from x, on which all calibrated directions lie; `None` where they span the plane.
    fn one_axis_deg(&self) -> Option<f64> {
        let first = *self.directions_deg.first()?;
        let on_axis = |d: &f64| between(*d, first) < 15.0 || between(*d, first) > 165.0;
        self.directions_deg.iter().all(on_axis).then_some(first)
    }

    /// Columns in which runs of a set lie outside, with the number of these runs.
    fn outside(&self, set: &RunSet) -> Vec<(Column, usize)> {
        [Column::Direction, Column::Depth, Column::Speed]
            .into_iter()
            .map(|column| {
                let out = |r: &&Run| (column == Column::Depth || slides(r)) && self.is_outside(column, r.value(column));
                (column, set.runs.iter().filter(out).count())
            })
            .filter(|(_, runs)| *runs > 0)
            .collect()
    }

    /// The remarks on a measured set that come before anything else.
    pub fn cautions(&self, measured: &RunSet) -> Vec<Caution> {
        let caution = |kind: &str, column: &str, text: String| Caution {
            kind: kind.into(),
            role: "measured".into(),
            column: column.into(),
            text,
        };
        let mut out: Vec<Caution> = self.outside(measured).into_iter().map(|(column, runs)| {
            let has = match column {
                Column::Direction => {
                    let mut list = self.directions_deg.clone();
                    list.sort_by(f64::total_cmp);
                    format!("slides at {} degrees", list.iter().map(|d| format!("{d:.0}")).collect::<Vec<_>>().join(", "))
                }
                Column::Depth => format!("presses to {:.2} mm", self.depth_max_mm),
                _ if self.speed_mm_s[1] - self.speed_mm_s[0] < 5e-4 => format!("slides at {:.3} mm/s", self.speed_mm_s[0]),
                _ => format!("slides at {:.3} to {:.3} mm/s", self.speed_mm_s[0], self.speed_mm_s[1]),
            };
            let name = column.name();
            caution(
                "outside_calibration",
                name,
                format!(
                    "{runs} of {} measured runs {} outside the calibration in {name}, which {has}: what depends on {name} \
                     there rests on the measured runs and the form of the model alone.",
                    measured.runs.len(),
                    if runs == 1 { "lies" } else { "lie" }
                ),
            )
        }).collect();
        if let Some(axis) = self.one_axis_deg() {
            out.push(caution(
                "one_axis",
                "direction_deg",
                format!(
                    "The calibration slides along one axis only ({axis:.0} degrees from x): it does not show how stiffness \
                     and strength depend on the direction, nor of the noise of the force across, which is taken as that along \
                     the axis."
                ),
            ));
        }
        out
    }

    /// Marks regions, effects and unexplained structure whose evidence lies outside.
    pub fn mark(
        &self,
        measured: &RunSet,
        laws: &[&Law],
        regions: &mut [Region],
        effects: &mut [EffectFound],
        unexplained: &mut UnexplainedFound,
    ) {
        let columns = [Column::Direction, Column::Depth, Column::Speed];
        for region in regions {
            let column = columns.iter().find(|c| c.name() == region.column);
            region.outside_calibration = column.is_some_and(|c| self.is_outside(*c, 0.5 * (region.from + region.to)));
        }
        let outside = self.outside(measured);
        for effect in effects {
            let law = laws.iter().find(|l| l.name == effect.law);
            effect.outside_calibration =
                law.is_some_and(|l| l.drivers.iter().any(|d| outside.iter().any(|(column, _)| column == d)));
        }
        // The column may be a product of two.
        let in_column = |(column, _): &(Column, usize)| unexplained.column.contains(column.name());
        unexplained.outside_calibration = unexplained.significant && outside.iter().any(in_column);
    }
}
