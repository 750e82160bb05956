//! What the effect-free runs show of a candidate: errors of the baseline's form, which the measured runs show too.
//!
//! Main type: [`Plain`].

use super::chance::Score;
use super::fit::{Fit, Task};
use super::laws::{Column, Place};
use super::products::dot;
use super::runs::Run;
use super::scan::{Candidate, columns_of};
use super::select::space_at;
use super::space::Space;
use super::tangents::Tangents;

/// The effect-free runs at their own optimum: where the baseline's form is wrong, they show it too.
pub struct Plain<'a> {
    /// The calibration's task.
    pub task: Task<'a>,
    /// Its fit.
    pub fit: Fit,
    /// Tangents there.
    pub tangents: Tangents,
}

impl Plain<'_> {
    /// Scores of candidates on the effect-free runs, where their drivers move as they do in the measured set: contrasts
    /// between runs that the calibration does not have say nothing of the baseline's form.
    pub fn scores(&self, grid: &[Candidate], task: &Task<'_>, null: &Fit, tangents: &Tangents) -> Vec<Option<Score>> {
        let measured = task.runs;
        let spread = |runs: &[Run], column: Column| {
            let values: Vec<f64> = runs.iter().map(|r| r.value(column).max(1e-3).ln()).collect();
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
        };
        let alike = |column: Column| {
            // Drag by speed looks like a strength that depends on area, which the baseline's form can have wrong.
            column == Column::Speed
                || (column == Column::Dwell && spread(measured, column) < 2.0 * spread(self.task.runs, column) + 0.05)
        };
        let space = space_at(&self.task, &self.fit, &self.tangents);
        let prediction = self.task.predict_at(&self.fit.theta, &self.fit.laws, &self.fit.modes);
        grid.iter()
            .map(|candidate| {
                if !candidate.start.law.drivers.iter().all(|d| STROKE.contains(d) || alike(*d)) {
                    return None;
                }
                let columns = columns_of(&self.task, &self.fit, &prediction, &candidate.start);
                let raw: f64 = columns.iter().map(|c| dot(c, c)).fold(0.0, f64::max);
                let clean: Vec<_> = columns.iter().map(|c| space.clean(c)).collect();
                let score = space.score(&clean.iter().collect::<Vec<_>>(), raw * 1e-3)?;
                if candidate.start.law.place == Place::Drag {
                    score.carried(self.share_at_own_speed(candidate, task, null, tangents))
                } else {
                    Some(score)
                }
            })
            .collect()
    }

    /// What of a drag is left in the measured runs of a force that, in the effect-free runs, looks like it.
    ///
    /// An error of form is a force that does not know of speed. As a coefficient times the speed it would grow with it,
    /// and hide a drag in the fast runs.
    fn share_at_own_speed(&self, candidate: &Candidate, task: &Task<'_>, null: &Fit, tangents: &Tangents) -> f64 {
        let rows = self.task.runs.iter().flat_map(|r| &r.rows);
        let mut speeds: Vec<f64> = rows.map(|r| r.speed_mm_s).filter(|v| *v > 0.0).collect();
        speeds.sort_by(f64::total_cmp);
        let Some(&own) = speeds.get(speeds.len() / 2) else { return 0.0 };
        let mut runs = task.runs.to_vec();
        for row in runs.iter_mut().flat_map(|r| &mut r.rows).filter(|r| r.speed_mm_s > 0.0) {
            row.speed_mm_s = own;
        }
        let slow = Task::new(&runs, task.reference, task.prior.clone(), task.sigma_n.clone(), task.variances);
        let prediction = slow.predict_at(&null.theta, &null.laws, &null.modes);
        let space = space_at(task, null, tangents);
        let error = space.clean(&columns_of(&slow, null, &prediction, &candidate.start)[0]);
        let drag = space.clean(&candidate.columns[0]);
        drag.product(&error) / Space::size(&drag).max(1e-300)
    }
}

/// Columns along which the baseline's form itself can be wrong.
const STROKE: [Column; 4] = [Column::Depth, Column::ContactTime, Column::Slide, Column::Direction];
