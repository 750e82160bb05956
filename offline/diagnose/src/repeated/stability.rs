//! Stability of a verdict: the decision with each group of measured runs left out in turn [delete-d jackknife: Shao & Wu
//! 1989].
//!
//! Main function: [`stability`].

use std::convert::Infallible;

use fingerpad_formats::in_threads;

use crate::repeated::redecision::{Outcome, Redecision};
use crate::schema::{LeftOut, Stability};
use crate::statistics::sign_flips::RandomSigns;

/// Fewest runs with which a set is decided.
const FEWEST_RUNS: usize = 5;

/// Most rows of a run in these decisions, which are many. They are compared with one another alone.
const ROWS: usize = 80;
/// Rows from which on runs have fewer than that, down to the rows that the shape of a run needs.
const ALL_ROWS: usize = 4800;
/// Rows that the shape of a run needs.
const SHAPE: usize = 30;

/// Decides the measured set without each of `groups` groups of its runs, on `threads` threads. Each run is in one group; the
/// groups are drawn by the seed of the diagnosis, so that no regular protocol loses a condition at once. `None` where fewer
/// than two groups can be left out.
pub fn stability(again: &Redecision<'_>, groups: usize, threads: usize, tick: &(dyn Fn() + Sync)) -> Option<Stability> {
    let set = again.set;
    let runs = set.runs.len();
    let groups = groups.min(runs);
    if groups < 2 || runs - runs.div_ceil(groups) < FEWEST_RUNS {
        return None;
    }
    let rows = (ALL_ROWS / runs).clamp(SHAPE, ROWS);
    let group_of = grouping(runs, groups, again.basis.settings.seed);
    // The last one is the set as it is.
    let outcomes = in_threads(0..=groups, threads.clamp(1, groups + 1), |group| {
        let mut part = set.subset(|run| group_of[run] != group);
        part.runs.iter_mut().for_each(|run| {
            run.thin(rows);
        });
        let outcome = again.outcome(&part);
        tick();
        Ok::<_, Infallible>(outcome)
    });
    let mut done: Vec<(usize, Outcome)> =
        outcomes.unwrap_or_else(|never| match never {}).into_iter().enumerate().collect();
    let (_, all) = done.pop()?;
    let kept = done.iter().filter(|(_, o)| o.verdict == all.verdict && o.families() == all.families()).count();
    let left_out = |outcome: &Outcome, group: usize| LeftOut {
        runs: (0..runs).filter(|run| group_of[*run] == group).map(|run| set.runs[run].labels.run.clone()).collect(),
        verdict: outcome.verdict,
        laws: outcome.effects.iter().map(|e| e.0.to_owned()).collect(),
        gain_2ll: outcome.gain_2ll,
    };
    Some(Stability {
        all: left_out(&all, groups),
        groups: done.iter().map(|(group, outcome)| left_out(outcome, *group)).collect(),
        kept,
    })
}

/// The group of each run: groups of nearly equal size, drawn at random [Fisher & Yates].
fn grouping(runs: usize, groups: usize, seed: u64) -> Vec<usize> {
    let mut random = RandomSigns::new(seed ^ 0x5AB1);
    let mut out: Vec<usize> = (0..runs).map(|run| run % groups).collect();
    for i in (1..runs).rev() {
        out.swap(i, (random.bits() % (i as u64 + 1)) as usize);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_is_in_one_of_equal_groups() {
        for (runs, groups) in [(60, 10), (16, 10), (7, 3)] {
            let group_of = grouping(runs, groups, 1);
            let sizes: Vec<usize> = (0..groups).map(|g| group_of.iter().filter(|of| **of == g).count()).collect();
            assert_eq!(sizes.iter().sum::<usize>(), runs);
            assert!(sizes.iter().all(|size| *size == runs / groups || *size == runs / groups + 1), "{sizes:?}");
            // Not the protocol's own period.
            assert_ne!(group_of, (0..runs).map(|run| run % groups).collect::<Vec<_>>());
        }
    }
}
