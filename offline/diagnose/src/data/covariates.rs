//! State columns that are read with an error: the column is replaced by its best guess given the others.
//!
//! With true value h = Z g + e, var e = tau², and reading h + error of declared variance s², the best guess is
//! Z g + tau²/(tau² + s²) (reading − Z g) (regression calibration, Carroll et al. 2006). A noisy column then no longer
//! loses against a clean one that only accompanies it.

use nalgebra::{DMatrix, DVector};

use crate::data::runs::RunSet;
use crate::laws::run_columns;
use crate::laws::{Column, Row};

/// A declared error of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CovariateError {
    /// The column.
    pub column: Column,
    /// Standard deviation of a reading.
    pub sd: f64,
}

/// Repeatability of a corneometer, a.u.: 2 to 3 % of its scale of 0 to 120.
pub const CORNEOMETER_SD_AU: f64 = 2.0;

/// How a column is corrected; learned on one set, applied to others.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Correction {
    column: Column,
    others: Vec<Column>,
    centre: Vec<f64>,
    slope: Vec<f64>,
    shrink: f64,
    /// Standard deviation of what error remains in the corrected column.
    pub left_sd: f64,
}

fn set_value(row: &mut Row, column: Column, value: f64) {
    if let Some((_, set)) = run_columns::states().find(|(c, _)| *c == column) {
        set(row, value);
    }
}

impl Correction {
    /// Learns the correction of a column; `None` where it is not recorded, constant or without error.
    pub fn learn(set: &RunSet, error: CovariateError) -> Option<Self> {
        if !set.has(error.column) || !(error.sd > 0.0) || !(set.spread(error.column) > 0.0) || set.runs.len() < 6 {
            return None;
        }
        let others: Vec<Column> = [Column::Time, Column::Temperature, Column::Hydration, Column::Width]
            .into_iter()
            .filter(|c| *c != error.column && set.has(*c) && set.spread(*c) > 1e-9)
            .collect();
        let n = set.runs.len();
        let mut centre = vec![0.0; others.len() + 1];
        for run in &set.runs {
            centre[0] += run.value(error.column) / n as f64;
            for (k, c) in others.iter().enumerate() {
                centre[k + 1] += run.value(*c) / n as f64;
            }
        }
        let z = DMatrix::from_fn(n, others.len(), |i, k| set.runs[i].value(others[k]) - centre[k + 1]);
        let h = DVector::from_fn(n, |i, _| set.runs[i].value(error.column) - centre[0]);
        let mut gram = z.transpose() * &z;
        for k in 0..others.len() {
            gram[(k, k)] *= 1.0 + 1e-9;
        }
        let slope = gram.cholesky().map(|c| c.solve(&(z.transpose() * &h)))?;
        let left = &h - &z * &slope;
        let total = left.norm_squared() / (n as f64 - others.len() as f64 - 1.0).max(1.0);
        let own = (total - error.sd * error.sd).max(0.0);
        let shrink = own / (own + error.sd * error.sd);
        Some(Self {
            column: error.column,
            others,
            centre,
            slope: slope.iter().copied().collect(),
            shrink,
            left_sd: shrink.sqrt() * error.sd,
        })
    }

    /// Replaces the column by its best guess.
    pub fn apply(&self, set: &mut RunSet) {
        for run in &mut set.runs {
            let reading = run.value(self.column);
            let guess: f64 = self.centre[0]
                + self
                    .others
                    .iter()
                    .enumerate()
                    .map(|(k, c)| self.slope[k] * (run.value(*c) - self.centre[k + 1]))
                    .sum::<f64>();
            let value = guess + self.shrink * (reading - guess);
            if value.is_finite() {
                for row in &mut run.rows {
                    set_value(row, self.column, value);
                }
            }
        }
    }

    /// Moves the column of a corrected set from its best guess to a value that the truth may have.
    ///
    /// * `normal`: draws a standard normal
    pub fn scatter(&self, set: &mut RunSet, normal: &mut dyn FnMut() -> f64) {
        for run in &mut set.runs {
            let value = run.value(self.column) + self.left_sd * normal();
            for row in &mut run.rows {
                set_value(row, self.column, value);
            }
        }
    }

    /// A row with another value of the column.
    pub fn shift(&self, row: &mut Row, by: f64) {
        set_value(row, self.column, run_columns::value(self.column, row) + by);
    }

    /// The column that is corrected.
    pub fn column(&self) -> Column {
        self.column
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow};

    /// A reading that scatters by its error only is its mean, far from zero as that may be; one that scatters far more is itself.
    #[test]
    fn a_reading_moves_to_the_mean_as_far_as_it_is_error() {
        for (spread, moves) in [(1.0, 1.0), (40.0, 0.0)] {
            let reading = |run: usize| 50.0 + spread * if run.is_multiple_of(2) { 1.0 } else { -1.0 };
            let run = |r: usize| {
                let row = |i: usize| {
                    let depth_mm = 0.1 * i as f64;
                    let bare = RawRow::bare(2, i as f64, depth_mm, [0.0; 2], [depth_mm, 0.0, 0.0]);
                    RawRow { hydration_au: reading(r), ..bare }
                };
                (Labels { run: format!("r{r}"), ..Labels::default() }, (0..10).map(row).collect())
            };
            let mut set = RunSet::from_rows("runs.csv".into(), (0..8).map(run).collect()).unwrap();
            let error = CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU };
            Correction::learn(&set, error).unwrap().apply(&mut set);
            for (k, run) in set.runs.iter().enumerate() {
                let want = moves * 50.0 + (1.0 - moves) * reading(k);
                let found = run.value(Column::Hydration);
                assert!((found - want).abs() < 0.2, "{spread}: {found} for {want}");
            }
        }
    }
}
