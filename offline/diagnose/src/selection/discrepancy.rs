//! Correction for model discrepancy: where the baseline's form is wrong, the effect-free calibration runs show the same
//! pattern as the measured ones, and what they show of a candidate law is taken off its evidence.
//!
//! Main type: [`ModelDiscrepancy`].

use crate::data::median::median;
use crate::data::runs::Run;
use crate::laws::{Column, Place};
use crate::selection::scan::{GridPoint, columns_of};
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::Fit;
use crate::statistics::products::dot;
use crate::statistics::projection::Projection;
use crate::statistics::sign_flips::Score;
use crate::statistics::task::Task;

/// The effect-free runs at their own optimum.
pub struct ModelDiscrepancy<'a> {
    /// The calibration's task.
    pub task: Task<'a>,
    /// Its fit.
    pub fit: Fit,
    /// Derivatives there.
    pub derivatives: Derivatives,
}

impl ModelDiscrepancy<'_> {
    /// Scores of candidates on the effect-free runs, where their drivers move as they do in the measured set: contrasts
    /// between runs that the calibration does not have say nothing of the baseline's form.
    pub fn scores(
        &self,
        grid: &[GridPoint],
        task: &Task<'_>,
        null: &Fit,
        derivatives: &Derivatives,
    ) -> Vec<Option<Score>> {
        let measured = task.runs;
        let spread = |runs: &[Run], column: Column| {
            let values: Vec<f64> = runs.iter().map(|r| r.value(column).max(1e-3).ln()).collect();
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
        };
        let moves_alike = |column: Column| {
            // Drag by speed looks like a strength that depends on area, which the baseline's form can have wrong.
            column == Column::Speed
                || (column == Column::Dwell && spread(measured, column) < 2.0 * spread(self.task.runs, column) + 0.05)
        };
        let projection = Projection::at(&self.task, &self.fit, &self.derivatives);
        let prediction = self.task.predict_at(&self.fit.parameters, &self.fit.laws, &self.fit.random_effects);
        grid.iter()
            .map(|candidate| {
                if !candidate.start.law.drivers.iter().all(|d| STROKE.contains(d) || moves_alike(*d)) {
                    return None;
                }
                let columns = columns_of(&self.task, &self.fit, &prediction, &candidate.start);
                let raw: f64 = columns.iter().map(|c| dot(c, c)).fold(0.0, f64::max);
                let projected: Vec<_> = columns.iter().map(|c| projection.project(c)).collect();
                let score = projection.score(&projected.iter().collect::<Vec<_>>(), raw * 1e-3)?;
                if candidate.start.law.place == Place::Drag {
                    score.transferred(self.share_at_own_speed(candidate, task, null, derivatives))
                } else {
                    Some(score)
                }
            })
            .collect()
    }

    /// Coefficient of drag that a force which looks like a drag of coefficient 1 in the effect-free runs would be given in
    /// the measured runs.
    ///
    /// An error of form is a force that does not depend on speed. Carried over as a coefficient, it would grow with the
    /// speed and hide a drag in the fast runs.
    fn share_at_own_speed(&self, candidate: &GridPoint, task: &Task<'_>, null: &Fit, derivatives: &Derivatives) -> f64 {
        let rows = self.task.runs.iter().flat_map(|r| &r.rows);
        let Some(own) = median(rows.map(|r| r.speed_mm_s).filter(|v| *v > 0.0)) else { return 0.0 };
        let mut runs = task.runs.to_vec();
        for row in runs.iter_mut().flat_map(|r| &mut r.rows).filter(|r| r.speed_mm_s > 0.0) {
            row.speed_mm_s = own;
        }
        let slow = Task::new(&runs, task.reference, task.prior.clone(), task.sigma_n.clone(), task.variances);
        let prediction = slow.predict_at(&null.parameters, &null.laws, &null.random_effects);
        let projection = Projection::at(task, null, derivatives);
        let error = projection.project(&columns_of(&slow, null, &prediction, &candidate.start)[0]);
        let drag = projection.project(&candidate.columns[0]);
        drag.product(&error) / Projection::size(&drag).max(1e-300)
    }
}

/// Columns along which the baseline's form itself can be wrong.
const STROKE: [Column; 4] = [Column::Depth, Column::ContactTime, Column::Slide, Column::Direction];
