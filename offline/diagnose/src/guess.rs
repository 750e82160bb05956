//! Where the calibration's fit starts: scales by medians of single rows, tangential stiffness by a search along a line.

use super::base::Reference;
use super::runs::RunSet;
use super::walk::{Modes, Nudge, walk_all};

/// Places of ln normal scale, ln strength scale and ln tangential stiffness among the freedoms.
const SCALES: [usize; 3] = [0, 4, 7];

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Freedoms of the reference with the three scales of a set of runs.
///
/// Far from a finger's stiffness the elements' yield points have slopes of the wrong sign, and a fit that starts there
/// gives the misfit to the runs' scatter.
pub fn guess(set: &RunSet, reference: &Reference) -> Vec<f64> {
    let mut theta = reference.mean.to_vec();
    let base = reference.with(&theta);
    let (mut normal, mut strength) = (Vec::new(), Vec::new());
    for run in &set.runs {
        let way = run.rows.last().map_or(0.0, |r| r.path_mm);
        for (row, [n, x, y]) in run.rows.iter().zip(&run.force_n) {
            if row.depth_mm < 0.3 * run.depth_mm() || row.depth_mm <= 0.0 {
                continue;
            }
            let at = base.at(row.depth_mm);
            if *n > 0.0 {
                normal.push((n / at.normal_n).ln());
            }
            let friction = x.hypot(*y);
            if row.path_mm > 0.6 * way && row.path_mm > 0.0 && friction > 0.0 {
                strength.push((friction / at.strength_n).ln());
            }
        }
    }
    for (place, values) in [(SCALES[0], normal), (SCALES[1], strength)] {
        theta[place] += median(values).unwrap_or(0.0).clamp(-3.0, 3.0);
    }
    let readings: Vec<f64> = set.runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()).collect();
    let from = theta[SCALES[2]];
    let misfit = |shift: f64| {
        let mut trial = theta.clone();
        trial[SCALES[2]] = from + shift;
        let found = walk_all(&reference.with(&trial), &[], &Modes::new(), Nudge::default(), &set.runs);
        // Absolute values: a row far off must not decide.
        readings
            .iter()
            .zip(&found)
            .enumerate()
            .filter(|(i, _)| i % 3 != 0)
            .map(|(_, (y, p))| (y - p).abs())
            .sum::<f64>()
    };
    let tried = (-8..=12).map(|k| 0.25 * f64::from(k)).map(|shift| (misfit(shift), shift));
    theta[SCALES[2]] += tried.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |best| best.1);
    theta
}
