//! Rows that no force explains: spikes of the logger, and readings at the sensor's rail.
//!
//! A spike lies off the rows on both of its sides by far more than the noise. An effect does not: it moves a row together
//! with at least one of its neighbours [outliers against neighbours: Hampel 1974]. Such readings become NaN, a reading
//! that is not there; the row keeps its place in the motion.
//!
//! Main type: [`Flags`]; main functions: [`spikes`], [`rails`], [`without`].

use crate::data::median::{median, noise_from_neighbours};
use crate::data::runs::{Run, RunSet};

/// Readings to be left out, normal, x and y of each row, by run.
pub type Flags = Vec<Vec<[bool; 3]>>;

/// Distance from the neighbours, in standard deviations, from which a row is a spike.
const SPIKE: f64 = 6.0;
/// Rounds in which spikes are looked for that others beside them had hidden.
const ROUNDS: usize = 4;
/// Least noise, in stated standard deviations: below, a coarse sensor's steps would look like spikes.
const LEAST_SCALE: f64 = 0.3;
/// Largest number of spikes per row of a set: more is no fault of single rows.
const MOST_SPIKES: f64 = 0.2;

/// Readings that are spikes.
///
/// * `residual_n`: readings less a prediction, three a row, N
/// * `sigma_n`: standard deviation of the row noise, N
pub fn spikes(set: &RunSet, residual_n: &[f64], sigma_n: &[f64]) -> Flags {
    let over_noise =
        |n: &mut dyn Iterator<Item = f64>| -> Vec<f64> { n.zip(sigma_n).map(|(v, s)| v / s.max(1e-9)).collect() };
    let scaled = over_noise(&mut residual_n.iter().copied());
    // What an effect adds at a turn or an onset may lie off its neighbours; the reading itself does not.
    let readings = over_noise(&mut set.runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()));
    let scale = noise_scale(set, &scaled);
    let mut series = [scaled, readings];
    let mut flags: Flags = set.runs.iter().map(|run| vec![[false; 3]; run.rows.len()]).collect();
    flag_off(set, &mut series, off_both_sides, scale.map(|s| SPIKE * s), &mut flags);
    keep_onsets(set, &mut flags);
    let clear = count(&flags);
    if clear as f64 > LEAST_SHARE * 3.0 * set.rows() as f64 {
        let share = clear as f64 / (3 * set.rows()) as f64;
        let [scaled, _] = series;
        let least = scale.map(|s| HIDDEN_SPIKE * s);
        for distance in [off_both_sides, off_both_middles, off_end, off_air] {
            let mut more = flags.clone();
            let mut left = scaled.clone();
            leave_out(&mut left, &flags);
            flag_off(set, &mut [left], distance, least, &mut more);
            add_where_rare(set, &more, share, &mut flags);
        }
        flag_alone(set, &mut flags);
    }
    if count(&flags) as f64 > MOST_SPIKES * set.rows() as f64 {
        flags.iter_mut().flatten().for_each(|f| *f = [false; 3]);
    }
    flags
}

/// Rows on either side among which a reading must have another one of its channel.
const NEAR: usize = 2;

/// Flags the readings without another one near them: of a logger that makes spikes, none of these can be distinguished from one.
fn flag_alone(set: &RunSet, flags: &mut Flags) {
    for (run, flags) in set.runs.iter().zip(flags) {
        let rows = run.rows.len();
        let readable: Vec<[bool; 3]> =
            run.force_n.iter().zip(&*flags).map(|(f, flag)| [0, 1, 2].map(|k| f[k].is_finite() && !flag[k])).collect();
        for (row, flag) in flags.iter_mut().enumerate() {
            let near = || (row.saturating_sub(NEAR)..rows.min(row + NEAR + 1)).filter(|i| *i != row);
            for k in 0..3 {
                flag[k] |= readable[row][k] && near().all(|i| !readable[i][k]);
            }
        }
    }
}

/// How far the reading of a row lies off what is around it, in standard deviations, by the readings of its run's rows.
type Distance = fn(&Run, usize, &dyn Fn(usize) -> f64) -> f64;

/// Takes flagged readings out of a series.
fn leave_out(values: &mut [f64], flags: &Flags) {
    for (value, flag) in values.iter_mut().zip(flags.iter().flatten().flatten()) {
        if *flag {
            *value = f64::NAN;
        }
    }
}

/// Flags the readings whose distance exceeds `least` in every series, round by round, and takes them out of the series.
fn flag_off(set: &RunSet, series: &mut [Vec<f64>], distance: Distance, least: [f64; 3], flags: &mut Flags) {
    for _ in 0..ROUNDS {
        let off: Vec<_> = series.iter().map(|values| distances(set, distance, values)).collect();
        let mut found = 0;
        let mut at = 0;
        for (run, flags) in flags.iter_mut().enumerate() {
            for (row, flags) in flags.iter_mut().enumerate() {
                for k in 0..3 {
                    if off.iter().all(|o| o[run][row][k] > least[k]) {
                        flags[k] = true;
                        series.iter_mut().for_each(|values| values[at + k] = f64::NAN);
                        found += 1;
                    }
                }
                at += 3;
            }
        }
        if found == 0 {
            break;
        }
    }
}

/// Share of clear spikes from which on a logger is taken to make spikes everywhere.
const LEAST_SHARE: f64 = 0.002;
/// Distance of the residual alone, in standard deviations, from which a reading on a slope is a spike of such a logger.
const HIDDEN_SPIKE: f64 = 8.0;

/// Parts of a stroke: air, pressing, the path in which friction builds up, free sliding.
const PARTS: usize = 4;

fn part(run: &Run, row: usize) -> usize {
    let row = &run.rows[row];
    if !(row.depth_mm > 0.0) {
        0
    } else if row.turn_mm <= 0.0 {
        1
    } else if row.turn_mm < ONSET_MM {
        2
    } else {
        3
    }
}

/// Adds flags in the parts of a stroke where they are no more frequent than the logger's clear spikes: on a slope a spike
/// hides between its neighbours, but what comes more often there is the finger's.
fn add_where_rare(set: &RunSet, more: &Flags, share: f64, flags: &mut Flags) {
    let (mut readings, mut added) = ([0.0; PARTS], [0usize; PARTS]);
    for ((run, more), own) in set.runs.iter().zip(more).zip(&*flags) {
        for row in 0..run.rows.len() {
            readings[part(run, row)] += 3.0;
            added[part(run, row)] += (0..3).filter(|k| more[row][*k] && !own[row][*k]).count();
        }
    }
    let rare: [bool; PARTS] = std::array::from_fn(|k| added[k] as f64 <= share * readings[k] + 2.0);
    for ((run, more), own) in set.runs.iter().zip(more).zip(flags) {
        for row in (0..run.rows.len()).filter(|row| rare[part(run, *row)]) {
            own[row] = more[row];
        }
    }
}

/// Path since touch or the last turn within which friction builds up, mm.
const ONSET_MM: f64 = 1.0;
/// How much more often than elsewhere readings may be flagged at the onset before they are taken as the finger's.
const OFTEN: f64 = 3.0;

/// Takes back the flags at the onset of sliding where these are far more frequent than elsewhere: a logger's spikes know
/// nothing of the stroke, a sharp peak of static friction does.
fn keep_onsets(set: &RunSet, flags: &mut Flags) {
    let onset = |run: usize, row: usize| {
        let row = &set.runs[run].rows[row];
        row.depth_mm > 0.0 && row.turn_mm < ONSET_MM
    };
    let (mut readings, mut flagged) = ([0.0f64; 2], [0.0f64; 2]);
    for (run, flags) in flags.iter().enumerate() {
        for (row, flags) in flags.iter().enumerate() {
            let place = usize::from(onset(run, row));
            readings[place] += 3.0;
            flagged[place] += flags.iter().filter(|f| **f).count() as f64;
        }
    }
    let share = [0, 1].map(|k| flagged[k] / readings[k].max(1.0));
    // Two flags more are chance.
    if flagged[1] > OFTEN * share[0] * readings[1] + 2.0 {
        for (run, flags) in flags.iter_mut().enumerate() {
            let at_onset = flags.iter_mut().enumerate().filter(|(row, _)| onset(run, *row));
            at_onset.for_each(|(_, flags)| *flags = [false; 3]);
        }
    }
}

/// The distance of each reading.
fn distances(set: &RunSet, distance: Distance, scaled: &[f64]) -> Vec<Vec<[f64; 3]>> {
    let mut at = 0;
    let of_run = |run: &Run| {
        let start = at;
        at += 3 * run.rows.len();
        let channel = |k: usize| move |row: usize| scaled[start + 3 * row + k];
        (0..run.rows.len()).map(|row| std::array::from_fn(|k| distance(run, row, &channel(k)))).collect()
    };
    set.runs.iter().map(of_run).collect()
}

/// Noise of each channel in the stated standard deviations, by what neighbouring rows leave of a straight line.
fn noise_scale(set: &RunSet, scaled: &[f64]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let mut sizes = Vec::new();
        let mut at = 0;
        for run in &set.runs {
            let own: Vec<f64> = (0..run.rows.len()).map(|row| scaled[at + 3 * row + k]).collect();
            at += 3 * run.rows.len();
            sizes.extend(own.windows(3).map(|w| (w[1] - 0.5 * (w[0] + w[2])).abs()).filter(|d| d.is_finite()));
        }
        noise_from_neighbours(sizes).max(LEAST_SCALE)
    })
}

/// Number of readings to be left out.
pub fn count(flags: &Flags) -> usize {
    flags.iter().flatten().flatten().filter(|f| **f).count()
}

/// How far a row, or the pair that it makes with the row after it, lies off the nearer ones of two rows on either side,
/// where it lies off both sides the same way.
fn off_both_sides(run: &Run, row: usize, of: &dyn Fn(usize) -> f64) -> f64 {
    let rows = run.rows.len();
    let in_contact = |i: usize| run.rows[i].depth_mm > 0.0;
    let smaller = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
    let off = |first: usize, last: usize| {
        let nearest = |near: &[usize]| {
            let least = |i: &usize| (first..=last).map(|own| of(own) - of(*i)).min_by(smaller);
            near.iter().filter_map(least).filter(|d| d.is_finite()).min_by(smaller)
        };
        let before: Vec<usize> = (first.saturating_sub(2)..first).collect();
        let after: Vec<usize> = (last + 1..rows.min(last + 3)).collect();
        match (nearest(&before), nearest(&after)) {
            (Some(a), Some(b)) if a * b > 0.0 => a.abs().min(b.abs()),
            // At a run's ends there is one side. Where the plate touches between the rows, an effect sets them apart too.
            (Some(a), None) | (None, Some(a)) => {
                let near = before.iter().chain(&after).copied();
                let alike: Vec<usize> = near.filter(|i| in_contact(*i) == in_contact(first)).collect();
                let level = nearest(&alike).map_or(0.5 * a.abs(), f64::abs);
                // A slope ends as a slope: beside the rows next to it the line through them counts.
                match (&before[..], &after[..]) {
                    (&[far, near], []) | ([], &[near, far]) => level.min((of(first) - 2.0 * of(near) + of(far)).abs()),
                    _ => level,
                }
            }
            _ => 0.0,
        }
    };
    // Two spikes in a row hide each other; as a pair they have to lie off by twice as much.
    let pair = if row > 1 && row + 3 < rows { 0.5 * off(row, row + 1) } else { 0.0 };
    off(row, row).max(pair)
}

/// Rows on either side of which the middle reading is taken.
const MIDDLE_OF: usize = 3;

/// How far a row lies off the middle one of the three readings before it and of the three after it, where it lies off both
/// the same way. Spikes with one good row between them, which hide each other from their neighbours, show so.
fn off_both_middles(run: &Run, row: usize, of: &dyn Fn(usize) -> f64) -> f64 {
    let own = of(row);
    let middle = |near: &mut dyn Iterator<Item = usize>| {
        let readings: Vec<f64> = near.map(of).filter(|v| v.is_finite()).take(MIDDLE_OF).collect();
        if readings.len() == MIDDLE_OF { Some(own - median(readings)?) } else { None }
    };
    match (middle(&mut (0..row).rev()), middle(&mut (row + 1..run.rows.len()))) {
        (Some(a), Some(b)) if a * b > 0.0 => a.abs().min(b.abs()),
        _ => 0.0,
    }
}

/// How far the last two readings of a run lie off the middle one of the three before them, the nearer one, where both lie
/// off the same way: beside each other they hide, and no reading comes after them.
fn off_end(run: &Run, row: usize, of: &dyn Fn(usize) -> f64) -> f64 {
    let read: Vec<usize> = (0..run.rows.len()).rev().filter(|i| of(*i).is_finite()).take(2 + MIDDLE_OF).collect();
    if read.len() < 2 + MIDDLE_OF || !read[..2].contains(&row) {
        return 0.0;
    }
    let Some(before) = median(read[2..].iter().map(|i| of(*i))) else { return 0.0 };
    let [a, b] = [0, 1].map(|k| of(read[k]) - before);
    if a * b > 0.0 { a.abs().min(b.abs()) } else { 0.0 }
}

/// How far a row in the air lies off the reading 0 that a tared sensor has there; 0 in contact.
fn off_air(run: &Run, row: usize, of: &dyn Fn(usize) -> f64) -> f64 {
    if run.rows[row].depth_mm > 0.0 { 0.0 } else { of(row).abs() }
}

/// A channel that ends at its largest size in many rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Rail {
    /// Channel: normal, x, y.
    pub channel: usize,
    /// The reading, N.
    pub force_n: f64,
    /// Rows with it.
    pub rows: usize,
    /// Runs with it.
    pub runs: usize,
}

/// Fewest rows at a rail.
const LEAST_AT_RAIL: usize = 8;

/// The rails of a set: a largest or least reading that comes again and again, more often than the one next to it, as no
/// force with noise does.
pub fn rails(set: &RunSet) -> Vec<Rail> {
    let mut out = Vec::new();
    for channel in 0..3 {
        for sign in [1.0, -1.0] {
            let readings = || set.runs.iter().flat_map(|r| &r.force_n).map(move |f| sign * f[channel]);
            let end = readings().fold(f64::NEG_INFINITY, f64::max);
            let next = readings().filter(|f| *f < end).fold(f64::NEG_INFINITY, f64::max);
            let count = |value: f64| readings().filter(|f| *f == value).count();
            let (rows, beside) = (count(end), count(next));
            // A channel that reads one value throughout (a sensor without that axis) has no rail.
            if rows >= LEAST_AT_RAIL && rows > 3 * beside && rows < set.rows() / 2 && end.abs() > 0.0 {
                let force_n = sign * end;
                let runs = set.runs.iter().filter(|r| r.force_n.iter().any(|f| f[channel] == force_n)).count();
                out.push(Rail { channel, force_n, rows, runs });
            }
        }
    }
    out
}

/// Readings at one of the rails.
pub fn at_rail(set: &RunSet, rails: &[Rail]) -> Flags {
    let railed = |f: &[f64; 3]| std::array::from_fn(|k| rails.iter().any(|r| r.channel == k && f[k] == r.force_n));
    set.runs.iter().map(|run| run.force_n.iter().map(railed).collect()).collect()
}

/// The set with the flagged readings NaN.
pub fn without(set: &RunSet, flags: &Flags) -> RunSet {
    let mut out = set.clone();
    for (run, flags) in out.runs.iter_mut().zip(flags) {
        for (force_n, flags) in run.force_n.iter_mut().zip(flags) {
            for (f, flag) in force_n.iter_mut().zip(flags) {
                if *flag {
                    *f = f64::NAN;
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow};

    /// Presses to 0.6 to 1.3 mm with normal forces of 1 N/mm and a little noise.
    fn set(change: impl Fn(usize, usize, &mut RawRow)) -> RunSet {
        let run = |r: usize| {
            let rows = (0..30).map(|i| {
                let depth_mm = (0.6 + 0.1 * r as f64) * (i.min(10) as f64) / 10.0;
                let noise = 0.001 * (((r * 31 + i * 17) % 13) as f64 - 6.0);
                let mut row = RawRow::bare(
                    2,
                    i as f64,
                    depth_mm,
                    [0.2 * (i.max(10) - 10) as f64, 0.0],
                    [depth_mm + noise, noise, -noise],
                );
                change(r, i, &mut row);
                row
            });
            (Labels { run: format!("r{r}"), ..Labels::default() }, rows.collect())
        };
        RunSet::from_rows("runs.csv".into(), (0..8).map(run).collect()).unwrap()
    }

    fn residual(set: &RunSet) -> Vec<f64> {
        let rows = set.runs.iter().flat_map(|r| r.rows.iter().zip(&r.force_n));
        rows.flat_map(|(row, f)| [f[0] - row.depth_mm.max(0.0), f[1], f[2]]).collect()
    }

    #[test]
    fn spikes_are_flagged_and_steps_and_slopes_are_not() {
        let spiked = set(|r, i, row| {
            row.force_n[0] += if [(2, 12), (5, 20), (5, 21)].contains(&(r, i)) { 0.3 } else { 0.0 };
            // A step and a slope, as effects make them.
            row.force_n[1] += if i > 15 { 0.4 } else { 0.0 };
            row.force_n[2] += 0.05 * i as f64;
        });
        let left = residual(&spiked);
        let flags = spikes(&spiked, &left, &vec![0.004; left.len()]);
        let found: Vec<(usize, usize)> =
            (0..8).flat_map(|r| (0..30).map(move |i| (r, i))).filter(|(r, i)| flags[*r][*i][0]).collect();
        assert_eq!(found, [(2, 12), (5, 20), (5, 21)]);
        assert_eq!(count(&flags), 3);
        assert!(without(&spiked, &flags).runs[2].force_n[12][0].is_nan());
    }

    #[test]
    fn a_peak_at_the_onset_of_every_run_is_the_fingers() {
        let peaked = set(|_, i, row| row.force_n[1] += if i == 12 { 0.3 } else { 0.0 });
        let left = residual(&peaked);
        assert_eq!(count(&spikes(&peaked, &left, &vec![0.004; left.len()])), 0);
    }

    #[test]
    fn a_spike_on_a_slope_is_found_where_the_logger_makes_spikes() {
        let clear = [(1, 14), (2, 20), (3, 25), (6, 22)];
        let found = |clear: &[(usize, usize)], peaked: bool| {
            let spiked = set(|r, i, row| {
                row.force_n[0] += if clear.contains(&(r, i)) { 0.3 } else { 0.0 };
                // Between its neighbours while pressing, far off what the others foretell.
                row.force_n[0] += if (r, i) == (4, 5) { 0.08 } else { 0.0 };
                // Friction builds up in a step with a corner of its own, which comes in every run.
                row.force_n[1] += if i > 11 { 0.5 } else { 0.0 };
                row.force_n[1] += if peaked && i == 12 { -0.3 } else { 0.0 };
            });
            let mut left = residual(&spiked);
            let step = |(at, v): (usize, &mut f64)| *v -= if at % 3 == 1 && at / 3 % 30 > 11 { 0.5 } else { 0.0 };
            left.iter_mut().enumerate().for_each(step);
            let flags = spikes(&spiked, &left, &vec![0.004; left.len()]);
            (flags[4][5][0], count(&flags))
        };
        assert_eq!(found(&clear, false), (true, 5));
        assert_eq!(found(&[], false), (false, 0));
        assert_eq!(found(&clear, true), (true, 5));
    }

    #[test]
    fn spikes_with_a_good_row_between_them_and_spikes_in_the_air_are_found_where_the_logger_makes_spikes() {
        let clear = [(1, 14), (2, 20), (3, 25), (6, 22)];
        let found = |clear: &[(usize, usize)], step: f64| {
            let spiked = set(|r, i, row| {
                row.force_n[0] += if clear.contains(&(r, i)) { 0.3 } else { 0.0 };
                row.force_n[1] += if [(4, 18), (4, 20)].contains(&(r, i)) { 0.6 } else { 0.0 };
                row.force_n[2] += if [(5, 0), (5, 1)].contains(&(r, i)) { 0.2 } else { 0.0 };
                row.depth_mm -= if i < 3 { 1.0 } else { 0.0 };
                // What comes in every run on either side of a row is the finger's.
                row.force_n[2] += if i > 14 { step } else { 0.0 };
            });
            let left: Vec<f64> = residual(&spiked)
                .into_iter()
                .enumerate()
                .map(|(at, v)| if at % 90 < 9 && at % 3 == 0 { 0.0 } else { v })
                .collect();
            let flags = spikes(&spiked, &left, &vec![0.004; left.len()]);
            ([flags[4][18][1], flags[4][19][1], flags[4][20][1], flags[5][0][2], flags[5][1][2]], count(&flags))
        };
        assert_eq!(found(&clear, 0.5), ([true, false, true, true, true], 8));
        // A logger without clear spikes makes no hidden ones.
        assert_eq!(found(&[], 0.5), ([false; 5], 0));
    }

    #[test]
    fn two_spikes_at_the_end_of_a_run_are_found_where_the_logger_makes_spikes() {
        let clear = [(1, 14), (2, 20), (3, 25), (6, 22)];
        let found = |clear: &[(usize, usize)], first: f64, last: f64| {
            let spiked = set(|r, i, row| {
                row.force_n[0] += if clear.contains(&(r, i)) { 0.3 } else { 0.0 };
                row.force_n[2] += if (r, i) == (4, 28) { first } else { 0.0 };
                row.force_n[2] += if (r, i) == (4, 29) { last } else { 0.0 };
            });
            let flags = spikes(&spiked, &residual(&spiked), &vec![0.004; 3 * spiked.rows()]);
            ([flags[4][28][2], flags[4][29][2]], count(&flags))
        };
        assert_eq!(found(&clear, -0.551, -0.534), ([true; 2], 6));
        // A logger without clear spikes makes no hidden ones, and what both rows do not share is the last one's alone.
        assert_eq!(found(&[], -0.551, -0.534), ([false; 2], 0));
        assert_eq!(found(&clear, 0.0, -0.534), ([false, true], 5));
    }

    #[test]
    fn a_rail_is_found_and_a_plateau_of_a_coarse_sensor_is_not() {
        let railed = set(|_, _, row| row.force_n[0] = row.force_n[0].min(0.9));
        let [rail] = &rails(&railed)[..] else { panic!("{:?}", rails(&railed)) };
        assert_eq!((rail.channel, rail.force_n), (0, 0.9));
        assert!(rail.rows > 60 && rail.runs == 5, "{rail:?}");
        let coarse = set(|_, _, row| row.force_n = row.force_n.map(|f| (f / 0.01).round() * 0.01));
        assert_eq!(rails(&coarse), []);
    }

    /// With none elsewhere, two flags at the onset of sliding are chance and stay, three are the finger's and go.
    #[test]
    fn flags_at_the_onset_are_the_fingers_where_they_are_frequent() {
        let set = set(|_, _, _| ());
        for (flagged, left) in [(2, 2), (3, 0)] {
            let mut flags: Flags = set.runs.iter().map(|run| vec![[false; 3]; run.rows.len()]).collect();
            (0..flagged).for_each(|run| flags[run][12] = [true, false, false]);
            keep_onsets(&set, &mut flags);
            assert_eq!(flags.iter().flatten().flatten().filter(|flag| **flag).count(), left);
        }
    }
}
