//! What identifies the rows of a run, whatever the run is called and whenever it was measured.
//!
//! Main types: [`Content`], [`ContentOf`] (built row by row); main functions: [`repeated`], [`near_copies`].

use std::collections::{BTreeSet, HashMap};

use crate::data::runs::{RawRow, Run, RunSet};

/// Most row hashes that are kept of a run: those of the smallest value, the same ones in every copy of it.
const KEPT: usize = 16;
/// Shared rows from which on two runs are one: three readings that agree to the last digit do not agree by chance.
const SHARED: usize = 4;

/// Hashes of a run's rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Content {
    /// Of all rows with their state columns; the clock is left out.
    pub whole: u64,
    /// Of the sliding rows (of all rows in contact where none slides): depth, slide and readings.
    rows: Vec<u64>,
}

/// The content of a run that is read row by row.
#[derive(Default)]
pub struct ContentOf {
    whole: u64,
    sliding: BTreeSet<u64>,
    pressed: BTreeSet<u64>,
}

/// A hash with another number mixed in (the finaliser of splitmix64, Steele et al. 2014).
pub fn mixed(hash: u64, number: u64) -> u64 {
    let z = hash.rotate_left(23) ^ number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl ContentOf {
    /// Adds a row.
    pub fn push(&mut self, row: &RawRow) {
        // Adding zero makes -0 and 0 one number.
        let of = |start: u64, values: &[f64]| values.iter().fold(start, |h, v| mixed(h, (v + 0.0).to_bits()));
        let [x, y] = row.slide_mm;
        let [n, fx, fy] = row.force_n;
        let hash = of(0, &[row.depth_mm, x, y, n, fx, fy]);
        let state = [row.dwell_s, row.hydration_au, row.temperature_c, row.finger_width_mm];
        self.whole = mixed(self.whole, of(of(hash, &state), &row.own));
        if row.depth_mm > 0.0 {
            let smallest = if x == 0.0 && y == 0.0 { &mut self.pressed } else { &mut self.sliding };
            smallest.insert(hash);
            if smallest.len() > KEPT {
                smallest.pop_last();
            }
        }
    }

    /// The content of the rows so far.
    pub fn finish(self) -> Content {
        let rows = if self.sliding.len() < SHARED { self.pressed } else { self.sliding };
        Content { whole: self.whole, rows: rows.into_iter().collect() }
    }
}

impl Content {
    /// The content of rows.
    pub fn of(rows: &[RawRow]) -> Self {
        let mut content = ContentOf::default();
        rows.iter().for_each(|row| content.push(row));
        content.finish()
    }
}

/// A run that repeats one of another set.
pub struct Repeat {
    /// The run.
    pub run: String,
    /// Line of its first row.
    pub line: usize,
    /// The run that it repeats.
    pub of: String,
}

/// Runs of a set whose rows, or a good part of them, stand in another set too, under whatever name. Runs that the reader
/// left out count on both sides.
pub fn repeated(set: &RunSet, other: &RunSet) -> Vec<Repeat> {
    let mut owner: HashMap<u64, &str> = HashMap::new();
    for (run, _, content) in other.contents() {
        content.rows.iter().for_each(|row| _ = owner.insert(*row, run));
    }
    let mut out = Vec::new();
    for (run, line, content) in set.contents() {
        let mut shared: HashMap<&str, usize> = HashMap::new();
        content.rows.iter().filter_map(|row| owner.get(row)).for_each(|of| *shared.entry(of).or_default() += 1);
        let most = shared.into_iter().max_by_key(|(of, count)| (*count, std::cmp::Reverse(*of)));
        if let Some((of, _)) = most.filter(|(_, count)| *count >= SHARED) {
            out.push(Repeat { run: run.to_owned(), line, of: of.to_owned() });
        }
    }
    out
}

/// Difference of forces over the scatter of neighbouring rows below which two runs of one motion are one run: a repetition differs by 1.4 and
/// more.
const NEAR: f64 = 0.4;
/// Positions that are one, mm.
const SAME_MM: f64 = 1e-6;

/// Whether each run repeats an earlier one row by row, with forces that differ by less than the sensor scatters.
pub fn near_copies(runs: &[Run]) -> Vec<bool> {
    let forces = |run: &Run| -> Vec<f64> { run.force_n.iter().flatten().copied().collect() };
    // A channel's second difference has six times the variance of its rows.
    let square_n2 = |of: &[f64]| mean_square((6..of.len()).map(|k| of[k - 6] - 2.0 * of[k - 3] + of[k])) / 6.0;
    let known: Vec<(Vec<f64>, f64)> = runs.iter().map(forces).map(|of| (of.clone(), square_n2(&of))).collect();
    let is_copy = |i: usize, j: usize| {
        let same = |a: f64, b: f64| (a - b).abs() < SAME_MM;
        let rows = runs[i].rows.iter().zip(&runs[j].rows);
        let moved = runs[i].slide_mm.iter().zip(&runs[j].slide_mm);
        let different_n = || mean_square(known[i].0.iter().zip(&known[j].0).map(|(a, b)| a - b));
        runs[i].rows.len() == runs[j].rows.len()
            && rows.clone().all(|(a, b)| same(a.depth_mm, b.depth_mm))
            && moved.clone().all(|(a, b)| same(a[0], b[0]) && same(a[1], b[1]))
            && different_n() < NEAR * NEAR * known[i].1.min(known[j].1)
    };
    (0..runs.len()).map(|i| (0..i).any(|j| is_copy(i, j))).collect()
}

/// Mean square of the finite ones of some values.
fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0usize), |(sum, count), v| (sum + v * v, count + 1));
    sum / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::Labels;

    /// Runs of thirty rows with noise of their own from a seed; `shift` moves the clock.
    fn set(name: &str, seeds: std::ops::Range<u64>, shift: f64, rows: std::ops::Range<usize>) -> RunSet {
        let noise = |seed: u64, row: usize| (mixed(mixed(7, seed), row as u64) % 1000) as f64 * 1e-4;
        let run = |seed: u64| {
            let row = |i: usize| {
                let force = [0.5 + noise(seed, i), 0.2 + noise(seed, 100 + i), noise(seed, 200 + i)];
                RawRow::bare(2 + i, shift + i as f64, 1.0, [0.1 * i as f64, 0.0], force)
            };
            (Labels { run: format!("{name}{seed}"), ..Labels::default() }, rows.clone().map(row).collect())
        };
        RunSet::from_rows(format!("{name}.csv").into(), seeds.map(run).collect()).unwrap()
    }

    #[test]
    fn copies_of_runs_are_found_under_other_names_clocks_and_in_part() {
        let fit = set("m", 0..8, 0.0, 0..30);
        assert!(repeated(&set("h", 8..16, 0.0, 0..30), &fit).is_empty());
        let all = repeated(&set("h", 0..8, 5e3, 0..30), &fit);
        assert_eq!(all.iter().map(|r| (r.run.as_str(), r.of.as_str())).next(), Some(("h0", "m0")));
        assert_eq!(all.len(), 8);
        assert_eq!(repeated(&set("h", 6..10, 0.0, 0..30), &fit).len(), 2);
        assert_eq!(repeated(&set("h", 0..8, 0.0, 8..24), &fit).len(), 8, "half of each run");
    }

    #[test]
    fn a_copy_whose_forces_differ_by_less_than_the_noise_is_found_and_a_repetition_is_none() {
        let mut runs = set("m", 0..4, 0.0, 0..30).runs;
        // The rows scatter by 29 mN; the copies differ by up to 5 mN, and by as much again.
        for (of, by) in [(1, 5e-6), (2, 5e-5)] {
            let mut copy = runs[of].clone();
            let noise = |k: usize| by * (mixed(of as u64, k as u64) % 1000) as f64;
            copy.force_n.iter_mut().flatten().enumerate().for_each(|(k, f)| *f += noise(k));
            runs.push(copy);
        }
        assert_eq!(near_copies(&runs), [false, false, false, false, true, false]);
    }
}
