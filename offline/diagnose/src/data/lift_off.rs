//! Rows in which a finger is lifted off: tissue that has relaxed unloads along another path than it was loaded along, and without a law of
//! relaxation the model has one path for both.
//!
//! Main function: [`lift_off`].

use crate::data::outliers::Flags;
use crate::data::runs::{Run, RunSet};

/// Fall of the depth, as a share of the largest one of the contact, within which a depth is held: noise and drift of a held load.
const HELD: f64 = 0.03;
/// Rate of unloading, in largest depths per time of contact, up to which a depth counts as held: half of a triangle of
/// pressing and unloading is faster, a load that is lowered all along the slide is not.
const SLOW: f64 = 1.5;
/// Time after a row in which the depth must be held, as a share of the time of contact.
const LOOK_AHEAD: f64 = 0.05;
/// Least depth, as a share of the largest one of the contact, of a row that is held: a lift-off ends slowly.
const LEAST_DEPTH: f64 = 0.25;

/// The rows of each contact after the last row from which the depth is held, all three readings of each.
pub fn lift_off(set: &RunSet) -> Flags {
    set.runs.iter().map(of_run).collect()
}

fn of_run(run: &Run) -> Vec<[bool; 3]> {
    let mut flags = vec![[false; 3]; run.rows.len()];
    let touches = |i: usize| run.rows[i].depth_mm > 0.0;
    let mut first = 0;
    while first < run.rows.len() {
        let end = (first..run.rows.len()).find(|i| !touches(*i)).unwrap_or(run.rows.len());
        if let Some(last) = last_held(run, first, end) {
            flags[last + 1..end].fill([true; 3]);
        }
        first = end + 1;
    }
    flags
}

/// The last row of the contact in rows `first..end` to which the depth was held; `None` where it never is.
fn last_held(run: &Run, first: usize, end: usize) -> Option<usize> {
    let rows = &run.rows[first..end];
    let deepest_mm = rows.iter().map(|row| row.depth_mm).fold(0.0, f64::max);
    let contact_s = rows.last()?.t_s - rows[0].t_s;
    let held_to = |i: usize| {
        let until_s = rows[i].t_s + LOOK_AHEAD * contact_s;
        let to = (i + 1..rows.len()).take_while(|j| *j == i + 1 || rows[*j].t_s <= until_s).last()?;
        let fall_mm = |j: usize| rows[i].depth_mm - rows[j].depth_mm;
        let falls = |j: usize| fall_mm(j) > HELD.max(SLOW * (rows[j].t_s - rows[i].t_s) / contact_s) * deepest_mm;
        let is_held = rows[i].depth_mm >= LEAST_DEPTH * deepest_mm && !(i + 1..=to).any(falls);
        // The rows after it up to the first one that is not as deep.
        let level = (to + 1..rows.len()).take_while(|j| fall_mm(*j) <= HELD * deepest_mm);
        is_held.then(|| first + level.last().unwrap_or(to))
    };
    (0..rows.len()).rev().find_map(held_to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::outliers::count;
    use crate::data::runs::{Labels, RawRow};

    /// A run with these depths, `hz` rows a second, and a slide while it is in contact.
    fn flagged(hz: f64, seconds: f64, depth_mm: impl Fn(f64) -> f64) -> (usize, Vec<bool>) {
        let row = |i: usize| {
            let t_s = i as f64 / hz;
            // A pattern of 5 um that has no period in common with the motion.
            let noise_mm = 0.005 * ((91.7 * t_s).sin() + (37.1 * t_s).cos());
            RawRow::bare(2, t_s, depth_mm(t_s) + noise_mm, [t_s, 0.0], [0.5, 0.2, 0.0])
        };
        let rows = (0..(hz * seconds) as usize).map(row).collect();
        let set = RunSet::from_rows("runs.csv".into(), vec![(Labels::default(), rows)]).unwrap();
        let flags = lift_off(&set);
        (count(&flags) / 3, flags[0].iter().map(|f| f[0]).collect())
    }

    /// Press in half a second, hold for nine, lift in half a second; air before and after.
    fn stroke(t: f64) -> f64 {
        -0.1 + (2.2 * t).min(1.1).min((10.0 - t) * 2.2).max(0.0)
    }

    #[test]
    fn a_lift_off_is_flagged_at_any_rate_and_what_comes_before_it_is_not() {
        for hz in [12.5, 50.0, 240.0] {
            let (rows, flags) = flagged(hz, 11.0, stroke);
            let [least, most] = [0.40, 0.455].map(|seconds| (seconds * hz) as usize);
            assert!(rows + 2 >= least && rows <= most + 1, "{hz}: {rows} of {least} to {most}");
            let first = flags.iter().position(|f| *f).unwrap();
            assert!(first as f64 / hz > 9.45, "{hz}: {first}");
        }
        // A lift-off that the log does not follow to its end.
        let (rows, _) = flagged(50.0, 9.8, stroke);
        assert!((10..=15).contains(&rows), "{rows}");
        // Each contact of a run has its own.
        let (rows, _) = flagged(50.0, 22.0, |t| stroke(t % 11.0));
        assert!((36..=46).contains(&rows), "{rows}");
        // Half of a triangle of pressing and unloading.
        let (rows, _) = flagged(50.0, 10.0, |t| 0.2 * t.min(10.0 - t));
        assert!((200..=250).contains(&rows), "{rows}");
    }

    #[test]
    fn holds_steps_and_slow_loads_stay() {
        for depth_mm in [
            (|t| stroke(t.min(9.0))) as fn(f64) -> f64,
            |t| if t < 5.0 { 1.0 } else { 0.6 },
            |t| 1.0 - 0.07 * t,
            |t| 0.8 + 0.1 * (0.8 * t).sin(),
            |t| (2.0 * t).min(1.0),
        ] {
            let (rows, flags) = flagged(50.0, 11.0, depth_mm);
            assert_eq!(rows, 0, "{:?}", flags.iter().position(|f| *f));
        }
    }
}
