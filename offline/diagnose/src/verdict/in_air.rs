//! Evidence for a law in the rows before touch: the finger is not in them, and so no error of its model's form.
//!
//! Main function: [`gain_in_air`].

use crate::data::runs::RunSet;

/// Fewest runs with rows in the air from which their scatter is known.
const LEAST_RUNS: usize = 8;

/// Gain in 2 log likelihood by which a law explains the readings before touch. The run is the unit, with a normal scatter
/// of unknown size of each channel's means.
///
/// * `without_n`, `with_n`: predictions of the set without and with the law, three a row, N
pub fn gain_in_air(set: &RunSet, without_n: &[f64], with_n: &[f64]) -> f64 {
    let (mut runs, mut before, mut after) = ([0usize; 3], [0.0f64; 3], [0.0f64; 3]);
    let mut at = 0;
    for run in &set.runs {
        let air: Vec<usize> = (0..run.rows.len()).filter(|row| !(run.rows[*row].depth_mm > 0.0)).collect();
        for k in 0..3 {
            let left = |prediction: &[f64]| -> Option<f64> {
                let off = air.iter().map(|row| run.force_n[*row][k] - prediction[at + 3 * row + k]);
                let read: Vec<f64> = off.filter(|v| v.is_finite()).collect();
                (!read.is_empty()).then(|| read.iter().sum::<f64>() / read.len() as f64)
            };
            if let (Some(a), Some(b)) = (left(without_n), left(with_n)) {
                runs[k] += 1;
                before[k] += a * a;
                after[k] += b * b;
            }
        }
        at += 3 * run.rows.len();
    }
    let gain = |k: usize| runs[k] as f64 * (before[k].max(1e-300) / after[k].max(1e-300)).ln();
    (0..3).filter(|k| runs[*k] >= LEAST_RUNS).map(gain).sum()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::data::runs::{Labels, RawRow};

    /// Runs with three rows in the air and three in contact, whose readings of x are those of `x_n` in either.
    fn set(runs: usize, x_n: impl Fn(usize, bool) -> f64) -> RunSet {
        let run = |r: usize| {
            let row = |i: usize| {
                RawRow::bare(
                    2 + i,
                    0.1 * i as f64,
                    if i < 3 { -0.1 } else { 0.2 * i as f64 },
                    [0.0; 2],
                    [f64::NAN, x_n(r, i < 3), if i == 0 { f64::NAN } else { 0.0 }],
                )
            };
            (Labels { run: format!("r{r}"), ..Labels::default() }, (0..6).map(row).collect())
        };
        RunSet::from_rows(PathBuf::from("air.csv"), (0..runs).map(run).collect()).expect("rows in order")
    }

    #[test]
    fn a_bias_gains_by_what_the_air_shows_of_it_and_by_nothing_else() {
        // Means of runs that scatter by ±2 mN about a bias of 1.5 mN: n ln((2² + 1.5²) / 2²).
        let scatter = |r: usize| if r.is_multiple_of(2) { 2e-3 } else { -2e-3 };
        let gain = |set: &RunSet, bias_n: f64| {
            let with: Vec<f64> = (0..3 * set.rows()).map(|i| if i % 3 == 1 { bias_n } else { 0.0 }).collect();
            gain_in_air(set, &vec![0.0; with.len()], &with)
        };
        let biased = set(20, |r, _| 1.5e-3 + scatter(r));
        assert!((gain(&biased, 1.5e-3) / (20.0 * (6.25f64 / 4.0).ln()) - 1.0).abs() < 1e-9);
        assert!(gain(&biased, -1.5e-3) < 0.0);
        // What shows in contact only may be the finger's, and few runs do not determine their scatter.
        let of_finger = set(20, |r, in_air| scatter(r) + if in_air { 0.0 } else { 1.5e-3 });
        assert!(gain(&of_finger, 1.5e-3) < 0.0);
        assert_eq!(gain(&set(LEAST_RUNS - 1, |r, _| 1.5e-3 + scatter(r)), 1.5e-3), 0.0);
    }
}
