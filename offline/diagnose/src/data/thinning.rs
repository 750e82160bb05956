//! Fewer rows of long runs and fewer runs of long files: what keeps the shape of a run and the proportions of a protocol.
//!
//! Nothing is picked by a stride, which a periodic motion or protocol would turn into a choice of one phase. Rows: touches,
//! turns of the plate and the ends of a run stay, and between them one row at random in each of equal parts of time, motion
//! and change of force. Runs: a random sample, drawn within each kind of run. The same file gives the same sample.
//!
//! Main function: [`rows_to_keep`]; main type: [`RunSample`].

use std::collections::HashMap;

use crate::data::content::mixed;
use crate::data::runs::Run;
use crate::laws::Column;
use crate::laws::run_columns::{self, RunColumn};

/// Way back from which on a motion has turned, share of its range and mm.
const TURN: (f64, f64) = (0.02, 0.01);

/// Motion and readings of a row.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Clock, s.
    pub t_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Displacement of the plate, mm.
    pub slide_mm: [f64; 2],
    /// Readings, N; NaN where one is left out.
    pub force_n: [f64; 3],
}

/// A number from 0 to 1 of a seed and a count.
fn uniform(seed: u64, count: u64) -> f64 {
    (mixed(mixed(0xF1A6, seed), count) >> 11) as f64 / (1u64 << 53) as f64
}

/// Rows of a run to be kept, in order: all where these are at most `most`.
///
/// Returns the rows, and the number of turns and touches that are not among them because they alone would be too many.
pub fn rows_to_keep(rows: &[Sample], most: usize, seed: u64) -> (Vec<usize>, usize) {
    if rows.len() <= most {
        return ((0..rows.len()).collect(), 0);
    }
    let mut events = events(rows);
    let room = most / 2;
    let lost = events.len().saturating_sub(room);
    if lost > 0 {
        let part = |k: usize| k * events.len() / room;
        let pick = |k: usize| part(k) + (uniform(seed, k as u64) * (part(k + 1) - part(k)) as f64) as usize;
        events = (0..room).map(|k| events[pick(k)]).collect();
    }
    let measure = measure(rows, (rows.len() / most).max(1));
    let parts = most - events.len();
    let mut keep = events;
    let mut start = 0;
    for part in 0..parts {
        let end = measure.partition_point(|m| *m < (part + 1) as f64 / parts as f64).clamp(start, rows.len());
        if end > start {
            keep.push(
                start + ((uniform(seed, (most + part) as u64) * (end - start) as f64) as usize).min(end - start - 1),
            );
        }
        start = end;
    }
    keep.sort_unstable();
    keep.dedup();
    (keep, lost)
}

/// First and last row, the rows on both sides of a touch or lift, and those at which depth or slide turns.
fn events(rows: &[Sample]) -> Vec<usize> {
    let last = rows.len() - 1;
    let mut out = vec![0, last];
    out.extend(
        (1..=last).filter(|i| (rows[*i].depth_mm > 0.0) != (rows[i - 1].depth_mm > 0.0)).flat_map(|i| [i - 1, i]),
    );
    out.extend(turns(rows, |r| [r.depth_mm, 0.0]));
    out.extend(turns(rows, |r| r.slide_mm));
    out.sort_unstable();
    out.dedup();
    out
}

/// Rows at which a position is farthest from where it turned before.
fn turns(rows: &[Sample], of: fn(&Sample) -> [f64; 2]) -> Vec<usize> {
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let start = of(&rows[0]);
    let range = rows.iter().map(|r| distance(of(r), start)).fold(0.0, f64::max);
    let back = (TURN.0 * range).max(TURN.1);
    let (mut from, mut farthest) = (start, 0);
    let mut out = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let (now, reached) = (distance(of(row), from), distance(of(&rows[farthest]), from));
        if now >= reached {
            farthest = i;
        } else if reached - now > back && distance(of(row), of(&rows[farthest])) > back {
            out.push(farthest);
            (from, farthest) = (of(&rows[farthest]), i);
        }
    }
    out
}

/// Share of the run up to each row: a quarter each of time, depth, slide and change of force.
///
/// * `window`: rows on either side over which readings are averaged, so that noise is no change
fn measure(rows: &[Sample], window: usize) -> Vec<f64> {
    let mut smooth: Vec<[f64; 3]> = Vec::with_capacity(rows.len());
    let mut sums = vec![[0.0; 4]];
    for row in rows {
        let mut sum = sums[sums.len() - 1];
        if row.force_n.iter().all(|f| f.is_finite()) {
            (0..3).for_each(|k| sum[k] += row.force_n[k]);
            sum[3] += 1.0;
        }
        sums.push(sum);
    }
    for i in 0..rows.len() {
        let (a, b) = (sums[i.saturating_sub(window)], sums[(i + window + 1).min(rows.len())]);
        let count = b[3] - a[3];
        smooth.push(if count > 0.0 {
            [0, 1, 2].map(|k| (b[k] - a[k]) / count)
        } else {
            smooth.last().copied().unwrap_or_default()
        });
    }
    let step = |i: usize| {
        let (a, b) = (&rows[i - 1], &rows[i]);
        let force = (0..3).map(|k| (smooth[i][k] - smooth[i - 1][k]).abs()).sum::<f64>();
        let slide = (b.slide_mm[0] - a.slide_mm[0]).hypot(b.slide_mm[1] - a.slide_mm[1]);
        [b.t_s - a.t_s, (b.depth_mm - a.depth_mm).abs(), slide, force]
    };
    let mut whole = [0.0; 4];
    let mut so_far = vec![[0.0; 4]];
    for i in 1..rows.len() {
        whole.iter_mut().zip(step(i)).for_each(|(sum, part)| *sum += part);
        so_far.push(whole);
    }
    let there = whole.iter().filter(|w| **w > 0.0).count().max(1) as f64;
    so_far.iter().map(|at| (0..4).filter(|k| whole[*k] > 0.0).map(|k| at[k] / whole[k]).sum::<f64>() / there).collect()
}

/// Runs of a kind among which the sample draws in one go.
const BLOCK: usize = 64;

/// A random sample of runs that come one after the other: each gets a number from 0 to 1, and those below a share stay. Of
/// each 64 runs of a kind the numbers are a permutation, so that every share down to 1/64 keeps the kinds' proportions.
#[derive(Default)]
pub struct RunSample {
    kinds: HashMap<u64, (u64, Vec<usize>)>,
}

impl RunSample {
    /// The number of the next run.
    pub fn number(&mut self, run: &Run) -> f64 {
        let kind = kind(run);
        let (count, order) = self.kinds.entry(kind).or_default();
        let place = (*count % BLOCK as u64) as usize;
        if place == 0 {
            *order = (0..BLOCK).collect();
            for i in (1..BLOCK).rev() {
                let other = (uniform(kind, *count + i as u64) * (i + 1) as f64) as usize;
                order.swap(i, other.min(i));
            }
        }
        let within = uniform(!kind, *count);
        *count += 1;
        (order[place] as f64 + within) / BLOCK as f64
    }
}

/// The kind of a run: its condition and subject, and coarse steps of what is set or recorded.
fn kind(run: &Run) -> u64 {
    let text = |hash: u64, text: &str| text.bytes().fold(mixed(hash, text.len() as u64), |h, b| mixed(h, u64::from(b)));
    let places = [(Column::Depth, 0.1), (Column::Direction, 45.0), (Column::Slide, 2.0)];
    let places = places.into_iter().map(|(column, step)| run.value(column) / step);
    let condition = |(column, known): (Column, &RunColumn)| {
        let ((by_logarithm, scatter), value) = (known.condition?, run.value(column));
        Some(if by_logarithm { value.max(1e-6).log2() } else { value / (2.0 * scatter) })
    };
    let conditions = run_columns::law_columns().filter_map(condition);
    let start = text(text(0, &run.labels.condition), &run.labels.subject);
    places
        .chain(conditions)
        .fold(start, |h, v| mixed(h, if v.is_finite() { v.round() as i64 as u64 } else { u64::MAX }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow, run_of};

    /// A press to 1 mm, a slide back and forth with `turns` turns, a lift.
    fn stroke(rows: usize, turns: usize) -> Vec<Sample> {
        (0..rows)
            .map(|i| {
                let share = i as f64 / (rows - 1) as f64;
                let depth_mm = (10.0 * share - 0.5).min(9.5 - 10.0 * share).min(1.0);
                let phase = ((share - 0.2) / 0.6).clamp(0.0, 1.0) * (turns as f64 + 1.0);
                let slide = if phase.rem_euclid(2.0) < 1.0 { phase.fract() } else { 1.0 - phase.fract() };
                let slide = if phase >= turns as f64 + 1.0 { f64::from(turns.is_multiple_of(2)) } else { slide };
                Sample {
                    t_s: 5.0 * share,
                    depth_mm,
                    slide_mm: [3.0 * slide, 0.0],
                    force_n: [depth_mm.max(0.0), slide, 0.0],
                }
            })
            .collect()
    }

    #[test]
    fn turns_touches_and_ends_stay_and_no_stride_is_left() {
        for rows in [1_000, 5_000, 40_000] {
            let run = stroke(rows, 7);
            let (keep, lost) = rows_to_keep(&run, 240, 1);
            assert!(keep.len() <= 240 && keep.len() > 150 && lost == 0, "{rows}: {}", keep.len());
            assert!(keep[0] == 0 && keep[keep.len() - 1] == rows - 1);
            let touches: Vec<usize> =
                (1..rows).filter(|i| (run[*i].depth_mm > 0.0) != (run[i - 1].depth_mm > 0.0)).collect();
            assert_eq!(touches.len(), 2);
            assert!(touches.iter().all(|i| keep.contains(i) && keep.contains(&(i - 1))));
            // The path along the kept rows is that along all rows.
            let path = |rows: &[usize]| {
                rows.windows(2).map(|w| (run[w[1]].slide_mm[0] - run[w[0]].slide_mm[0]).abs()).sum::<f64>()
            };
            let all: Vec<usize> = (0..rows).collect();
            assert!((path(&keep) / path(&all) - 1.0).abs() < 1e-9, "{} {}", path(&keep), path(&all));
            let steps: std::collections::BTreeSet<usize> = keep.windows(2).map(|w| w[1] - w[0]).collect();
            assert!(steps.len() > 5, "{steps:?}");
        }
    }

    #[test]
    fn a_sudden_force_gets_rows_of_its_own() {
        let mut run = stroke(5_000, 0);
        // Within 1 % of the time friction falls to a fifth and comes back.
        run[2_500..2_550].iter_mut().for_each(|r| r.force_n[1] *= 0.2);
        let (keep, _) = rows_to_keep(&run, 240, 1);
        assert!(keep.iter().filter(|i| (2_460..2_590).contains(*i)).count() >= 8);
    }

    #[test]
    fn turns_that_alone_are_too_many_are_sampled_and_counted() {
        let (keep, lost) = rows_to_keep(&stroke(20_000, 400), 240, 1);
        assert!(keep.len() <= 240 && lost > 250, "{} {lost}", keep.len());
    }

    #[test]
    fn a_sample_of_a_periodic_protocol_keeps_its_proportions() {
        let run = |kind: usize| {
            let row = |i: usize| RawRow::bare(2, i as f64, 0.3 + 0.25 * kind as f64, [i as f64, 0.0], [1.0; 3]);
            run_of("m.csv".as_ref(), Labels::default(), &(0..4).map(row).collect::<Vec<_>>()).unwrap()
        };
        let runs: Vec<Run> = (0..16).map(run).collect();
        let mut sample = RunSample::default();
        let mut kept = [0; 16];
        for i in 0..19_200 {
            kept[i % 16] += usize::from(sample.number(&runs[i % 16]) < 1.0 / 16.0);
        }
        assert!(kept.iter().all(|k| (72..=79).contains(k)), "{kept:?}");
    }
}
