//! Where refits with a law more start: the best shapes of the grid, with the sizes of their linear estimates.

use crate::laws::Law;
use crate::model::active_law::ActiveLaw;
use crate::selection::scan::{GridPoint, ScoredGridPoint};
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::sign_flips::Score;
use crate::statistics::task::Task;

/// Fits a law beside those in force, from a shape of the grid and the linear estimate of its size.
pub fn refine(task: &Task<'_>, fit: &Fit, derivatives: &Derivatives, start: &ActiveLaw, most: usize) -> Fit {
    let mut laws = fit.laws.clone();
    let mut one = start.clone();
    // At a size of exactly zero the derivative with respect to the shape is zero.
    for k in 0..one.law.linear {
        if one.values[k] == 0.0 {
            one.values[k] = 0.02 * one.law.parameters[k].typical;
        }
    }
    laws.push(one);
    task.fit_near(FitStart { laws, ..FitStart::from(fit) }, derivatives, most)
}

/// Whether the linear estimate of a law that acts one way only (a pull-off pulls, a bell is a bell) has the other sign.
pub fn wrong_way(law: &Law, score: &Score) -> bool {
    law.linear == 1 && law.parameters[0].low >= 0.0 && score.estimate().0[0] < 0.0
}

/// A grid point with the size that its linear estimate gives.
fn sized(point: &GridPoint, scored: &ScoredGridPoint) -> ActiveLaw {
    let mut start = point.start.clone();
    let Some(score) = &scored.score else { return start };
    if score.columns() == start.law.linear {
        let k = score.columns();
        let mut sum = score.from_prior.clone();
        for g in score.per_run.chunks_exact(k) {
            for (s, g) in sum.iter_mut().zip(g) {
                *s += g;
            }
        }
        for a in 0..k {
            let p = &start.law.parameters[a];
            let value: f64 = (0..k).map(|b| score.inverse[(a, b)] * sum[b]).sum();
            let bound = 8.0 * p.typical.abs();
            start.values[a] = value.clamp((-bound).max(p.low), bound.min(p.high));
        }
    }
    start
}

/// Starts of a law that are worth a refit, best first: its best shapes of the grid.
pub fn starts(grid: &[GridPoint], scores: &[ScoredGridPoint], law: &Law, most: usize) -> Vec<(f64, ActiveLaw)> {
    let mut list: Vec<(f64, ActiveLaw)> = scores
        .iter()
        .filter(|s| grid[s.grid_point].start.law == law)
        .filter_map(|s| s.score.as_ref().map(|score| (s, score)))
        .filter(|(_, score)| !wrong_way(law, score))
        .map(|(s, score)| (score.gain(), sized(&grid[s.grid_point], s)))
        .collect();
    list.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Two shape parameters make valleys that one start does not cross.
    list.truncate(if law.parameters.len() - law.linear > 1 { most + 2 } else { most });
    list
}
