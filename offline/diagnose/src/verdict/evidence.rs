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
use crate::schema::Region;
use crate::statistics::calibration::Calibration;
use crate::statistics::fit::Fit;
use crate::verdict::calibrated::Calibrated;
use crate::verdict::concluded::Concluded;
use crate::verdict::cross_validation::noise_floor_n;
use crate::verdict::decision::Decision;
use crate::verdict::regions::residual_map;
use crate::verdict::selected::Selected;
use crate::verdict::traces::{ForceTrace, worst_traces};

/// Fits, sets and maps of a diagnosis, beyond its report.
pub struct Evidence {
    /// Residual map before any effect.
    pub map_before: Vec<Region>,
    /// With the claimed effects.
    pub map_after: Vec<Region>,
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
    /// * `drivers`: the plots of the claimed effects
    pub fn new(
        calibrated: &Calibrated,
        selected: &Selected<'_, '_>,
        concluded: Concluded,
        own: &LawsFile,
        drivers: Vec<DriverPlot>,
    ) -> Self {
        let Selected { decision, before, .. } = *selected;
        let Concluded { verdict, held_out, calibration, .. } = concluded;
        let (null, full) = (&decision.selection.null, selected.fit(verdict));
        let floor_n = noise_floor_n(&decision.task, &null.parameters, &null.laws, &decision.expected_variances);
        let map_of = |decision: &Decision<'_>, fit: &Fit| {
            residual_map(decision.set, own, &decision.task.residual_without_random_effects_n(fit))
        };
        let mut sets = vec![&calibrated.calibration_set, decision.set];
        sets.extend(held_out.as_ref());
        Self {
            own: with_ranges_of(own, &sets),
            traces: worst_traces(&decision.task, decision.set, &calibration.fit, [null, full], &floor_n, 3),
            map_before: map_of(before, &before.selection.null),
            map_after: map_of(decision, full),
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

/// Residual without the effect, and the effect, along the law's first driver.
pub fn driver_plot(set: &RunSet, active: &ActiveLaw, without: &[f64], with: &[f64], readings: &[f64]) -> DriverPlot {
    let column = active.law.drivers.first().copied().unwrap_or(Column::Depth);
    let in_stroke = matches!(column, Column::Slide | Column::ContactTime | Column::Depth);
    let normal = matches!(active.law.place, Place::Stiffness | Place::Depth | Place::Rim);
    let mut points = Vec::new();
    let mut at = 0;
    for run in &set.runs {
        let (mut sum, mut n) = ([0.0; 2], 0.0);
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
            let pair = [(measure(readings) - base) / base, (measure(with) - base) / base];
            if in_stroke {
                let x = match column {
                    Column::Slide => row.path_mm,
                    Column::ContactTime => row.contact_time_s,
                    _ => row.depth_mm,
                };
                points.push([x, pair[0], pair[1]]);
            } else if normal || row.path_mm > 1.0 {
                sum = [sum[0] + pair[0], sum[1] + pair[1]];
                n += 1.0;
            }
        }
        if n > 0.0 {
            points.push([run.value(column), sum[0] / n, sum[1] / n]);
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
