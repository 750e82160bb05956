//! Evidence behind a report: what figures, the corrected model and the confirmation by finite elements need.
//!
//! Main types: [`Evidence`], [`DriverPlot`].

use fingerpad_smooth::Parameters;

use crate::data::covariates::Correction;
use crate::data::own_columns::with_ranges_of;
use crate::data::runs::RunSet;
use crate::laws::{Column, LawsFile, Place};
use crate::model::active_law::ActiveLaw;
use crate::model::random_effects::PerEffect;
use crate::statistics::calibration::Calibration;
use crate::verdict::calibrated::Calibrated;
use crate::verdict::concluded::Concluded;
use crate::verdict::cross_validation::noise_floor_n;
use crate::verdict::regions::Maps;
use crate::verdict::selected::Selected;
use crate::verdict::traces::{ForceTrace, worst_traces};

/// Fits, sets and maps of a diagnosis, beyond its report.
pub struct Evidence {
    /// Where simulation and measurement disagree, without and with the claimed effects.
    pub maps: Maps,
    /// For each claimed effect the residual without it, and the fitted law, along its driver.
    pub drivers: Vec<DriverPlot>,
    /// Forces of the worst runs beside the models.
    pub traces: Vec<ForceTrace>,
    /// The smooth model's parameters, fitted with the claimed laws.
    pub parameters: Parameters,
    /// The laws in force: the finger's own, then the claimed ones.
    pub laws: Vec<ActiveLaw>,
    /// The smooth model's parameters, fitted without the claimed laws.
    pub parameters_before: Parameters,
    /// The laws in force then: the finger's own.
    pub laws_before: Vec<ActiveLaw>,
    /// Laws of the user's own, with the ranges of their drivers in these sets.
    pub own: LawsFile,
    /// Noise, scatter and parameters of the calibration.
    pub calibration: Calibration,
    /// Variances between runs that calibration and reading errors explain.
    pub expected_variances: PerEffect,
    /// How columns with reading errors were corrected.
    pub corrections: Vec<Correction>,
    /// The measured runs as they were decided, columns with errors corrected, without a lag of their own.
    pub decided_set: RunSet,
    /// The calibration runs.
    pub calibration_set: RunSet,
    /// The held-out runs, or the measured ones where there are none; columns with errors corrected.
    pub checked_set: RunSet,
    /// Which of the two: `holdout` or `measured`.
    pub checked: String,
}

impl Evidence {
    /// The evidence of a conclusion.
    ///
    /// * `own`: laws of the user's file
    /// * `drivers`: the plots of the claimed effects, with the maps
    pub fn new(
        calibrated: &Calibrated,
        selected: &Selected<'_, '_>,
        concluded: Concluded,
        own: &LawsFile,
        (drivers, maps): (Vec<DriverPlot>, Maps),
    ) -> Self {
        let Selected { decision, .. } = *selected;
        let Concluded { verdict, held_out, calibration, .. } = concluded;
        let (null, full) = (&decision.selection.null, selected.fit(verdict));
        let floor_n = noise_floor_n(&decision.task, &null.parameters, &null.laws, &decision.expected_variances);
        let mut sets = vec![&calibrated.calibration_set, decision.set];
        sets.extend(held_out.as_ref());
        Self {
            own: with_ranges_of(own, &sets),
            traces: worst_traces(&decision.task, decision.set, &calibration.fit, [null, full], &floor_n, 3),
            maps,
            drivers,
            parameters: full.parameters,
            laws: full.laws.clone(),
            parameters_before: null.parameters,
            laws_before: null.laws.clone(),
            expected_variances: decision.expected_variances,
            decided_set: calibrated.measured.clone(),
            checked: if held_out.is_some() { "holdout" } else { "measured" }.into(),
            checked_set: held_out.unwrap_or_else(|| decision.set.clone()),
            calibration_set: calibrated.calibration_set.clone(),
            calibration,
            corrections: calibrated.corrections.clone(),
        }
    }

    /// Whether any law is claimed.
    pub fn has_claims(&self) -> bool {
        self.laws.len() > self.laws_before.len()
    }
}

/// Residual over a driver, for a figure.
pub struct DriverPlot {
    /// The law.
    pub law: String,
    /// Column.
    pub column: String,
    /// Channel of the residual.
    pub channel: String,
    /// Driver, relative residual without the effect, the law's relative change there.
    pub points: Vec<[f64; 3]>,
}

/// Slide since touch and since the last turn from which on friction shows the strength, mm: before, it is what the turn left of the friction
/// in the other direction.
pub const FULL_SLIP_MM: f64 = 1.0;

/// Residual without the effect, and the effect, along the law's first driver: relative to the prediction in each row for a driver that
/// changes within a stroke, otherwise the sums over a run relative to that of the predictions.
pub fn driver_plot(set: &RunSet, active: &ActiveLaw, without: &[f64], with: &[f64], readings: &[f64]) -> DriverPlot {
    let column = active.law.drivers.first().copied().unwrap_or(Column::Depth);
    let in_stroke = matches!(column, Column::Slide | Column::ContactTime | Column::Depth);
    let normal = matches!(active.law.place, Place::Stiffness | Place::Depth | Place::Rim);
    let mut points = Vec::new();
    let mut at = 0;
    for run in &set.runs {
        let mut sums = [0.0; 3];
        for row in &run.rows {
            let i = at;
            at += 3;
            let measure = |v: &[f64]| {
                if normal { v[i] } else { v[i + 1] * row.along[0] + v[i + 2] * row.along[1] }
            };
            let base = measure(without);
            let read = measure(readings).is_finite();
            let usable = read && row.depth_mm > 0.0 && base > 0.02 && (normal || row.path_mm > 0.0);
            if !usable {
                continue;
            }
            let pair = [measure(readings) - base, measure(with) - base];
            if in_stroke {
                let x = match column {
                    Column::Slide => row.path_mm,
                    Column::ContactTime => row.contact_time_s,
                    _ => row.depth_mm,
                };
                points.push([x, pair[0] / base, pair[1] / base]);
            } else if normal || row.path_mm.min(row.turn_mm) > FULL_SLIP_MM {
                sums = [sums[0] + pair[0], sums[1] + pair[1], sums[2] + base];
            }
        }
        if sums[2] > 0.0 {
            points.push([run.value(column), sums[0] / sums[2], sums[1] / sums[2]]);
        }
    }
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    DriverPlot {
        law: active.law.name.into(),
        column: column.name().into(),
        channel: if normal { "normal force" } else { "friction along the motion" }.into(),
        points,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow, run_of};
    use crate::laws::find;

    /// Friction of 0.5 N that a law raises by a fifth: after a turn it passes zero later, which is no weaker friction.
    #[test]
    fn a_turn_is_no_part_of_the_residual_over_a_state() {
        let slide = |t: f64| if t <= 0.3 { 10.0 * t } else { 6.0 - 10.0 * t };
        let row = |i: usize| {
            let t = 0.01 * i as f64;
            RawRow {
                hydration_au: 50.0,
                contact_time_s: t,
                ..RawRow::bare(i, t, 1.0, [slide(t), 0.0], [1.0, 0.5, 0.0])
            }
        };
        let rows: Vec<RawRow> = (0..=60).map(row).collect();
        let run = run_of("m.csv".as_ref(), Labels::default(), &rows).unwrap();
        let friction = |limit: f64| -> Vec<f64> {
            // Elastic with 2.4 N/mm from the turn on.
            let at = |row: &crate::laws::Row| {
                let turned = row.along[0] < 0.0;
                let along = if turned { (2.4 * row.turn_mm - limit).min(limit) } else { limit };
                [1.0, along * row.along[0], 0.0]
            };
            run.rows.iter().flat_map(at).collect()
        };
        let (without, with) = (friction(0.5), friction(0.6));
        let set = RunSet {
            runs: vec![run.clone()],
            ..RunSet::from_rows("m.csv".into(), vec![(Labels::default(), rows)]).unwrap()
        };
        let law = find("hydration_bell").unwrap();
        let active = ActiveLaw { law, values: law.parameters.iter().map(|p| p.typical).collect() };
        let plot = driver_plot(&set, &active, &without, &with, &with);
        let [[hydration, residual, fitted]] = plot.points[..] else { panic!("{:?}", plot.points) };
        assert_eq!(hydration, 50.0);
        assert!((residual - 0.2).abs() < 1e-9 && (fitted - residual).abs() < 1e-12, "{residual} {fitted}");
    }
}
