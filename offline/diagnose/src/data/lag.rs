//! Runs whose force readings lag behind the position readings: by a delay, and by a first-order low-pass of the force sensor.
//!
//! The motion is moved, not the readings: each reading is compared with the motion that the finger made `delay_s` earlier, interpolated
//! between the rows. The low-pass acts on the predicted forces (`Stroke::filter`), which are needed between the rows where they change
//! fast.
//!
//! Main type: [`Lag`]; main functions: [`with_lag`], [`lagged`].

use crate::data::runs::{Run, RunSet};
use crate::laws::Row;

/// How the force channels lag behind the position channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lag {
    /// Pure delay, s; negative where the positions lag behind the forces.
    pub delay_s: f64,
    /// Time constant of a first-order low-pass of the forces, s. It is negative only in a difference of two lags.
    pub time_constant_s: f64,
}

impl Lag {
    /// Mean delay of the response, s.
    pub fn total_s(&self) -> f64 {
        self.delay_s + self.time_constant_s
    }
}

/// Deviation from a straight motion between its neighbours from which on a row is a corner of the motion, mm.
const CORNER_MM: f64 = 2e-4;
/// Longest slide or change of depth between two forces that are low-passed, mm, and the path after a turn in which it counts.
const FILTER_STEP_MM: f64 = 0.08;
const AFTER_TURN_MM: f64 = 2.5;
/// Most rows that are put between two.
const MOST_BETWEEN: usize = 12;
/// Times that differ by less are the same, s.
const SAME_S: f64 = 1e-9;

/// The set with a lag on top of the one that its runs have. Rows without readings are added where the motion turns and, for the low-pass, where forces change fast.
pub fn with_lag(set: &RunSet, lag: Lag) -> RunSet {
    if lag == Lag::default() {
        return set.clone();
    }
    RunSet { runs: set.runs.iter().map(|run| lagged(run, lag).0).collect(), ..set.clone() }
}

/// The run with a lag on top of the one that it has, and the places of its former rows in it.
pub fn lagged(run: &Run, lag: Lag) -> (Run, Vec<usize>) {
    let motion = Motion::of(run);
    let mut times: Vec<(f64, Option<usize>)> = run.rows.iter().enumerate().map(|(i, r)| (r.t_s, Some(i))).collect();
    let (first_s, last_s) = (times[0].0, times[times.len() - 1].0);
    let corners = motion.corners().map(|t| (t + lag.delay_s, None)).filter(|(t, _)| *t > first_s && *t < last_s);
    times.extend(corners);
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A corner at the time of a reading has a row already.
    let near = |a: f64, b: f64| (a - b).abs() < SAME_S;
    let mut keep = (0..times.len())
        .map(|k| {
            let beside = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|j| times.get(j));
            times[k].1.is_some() || !beside.into_iter().any(|other| near(other.0, times[k].0))
        })
        .collect::<Vec<bool>>()
        .into_iter();
    times.retain(|_| keep.next() == Some(true));
    let mut out = Run {
        rows: Vec::with_capacity(2 * times.len()),
        slide_mm: Vec::with_capacity(2 * times.len()),
        force_n: Vec::with_capacity(2 * times.len()),
        time_constant_s: (run.time_constant_s + lag.time_constant_s).max(0.0),
        ..run.clone()
    };
    let mut places = Vec::with_capacity(run.rows.len());
    let mut before: Option<(Row, [f64; 2])> = None;
    for (t_s, origin) in times {
        let (row, slide_mm) = motion.at(t_s, lag.delay_s);
        if let Some((last, from_mm)) = before.filter(|_| out.time_constant_s > 0.0) {
            let way_mm = (slide_mm[0] - from_mm[0]).hypot(slide_mm[1] - from_mm[1]);
            let way_mm = if row.turn_mm - way_mm > AFTER_TURN_MM { 0.0 } else { way_mm };
            let way_mm = way_mm.max((row.depth_mm - last.depth_mm).abs());
            let parts = ((way_mm / FILTER_STEP_MM).ceil().max(1.0) as usize).min(MOST_BETWEEN);
            for k in 1..parts {
                let between_s = last.t_s + (t_s - last.t_s) * k as f64 / parts as f64;
                out.push(motion.at(between_s, lag.delay_s), None);
            }
        }
        if origin.is_some() {
            places.push(out.rows.len());
        }
        out.push((row, slide_mm), origin.map(|i| run.force_n[i]));
        before = Some((row, slide_mm));
    }
    (out, places)
}

impl Run {
    fn push(&mut self, (row, slide_mm): (Row, [f64; 2]), force_n: Option<[f64; 3]>) {
        self.rows.push(row);
        self.slide_mm.push(slide_mm);
        self.force_n.push(force_n.unwrap_or([f64::NAN; 3]));
    }
}

/// The motion of a run, a polygon over time: its rows, and corners between two of them.
struct Motion {
    rows: Vec<(Row, [f64; 2])>,
}

impl Motion {
    fn of(run: &Run) -> Self {
        let rows = run.rows.iter().copied().zip(run.slide_mm.iter().copied()).collect();
        let coarse = Self { rows };
        let mut fine = coarse.rows.clone();
        for i in 1..coarse.rows.len().saturating_sub(2) {
            fine.extend(coarse.corners_between(i));
        }
        fine.sort_by(|a, b| a.0.t_s.total_cmp(&b.0.t_s));
        Self { rows: fine }
    }

    /// Time and the three positions of a row.
    fn place(&self, i: usize) -> (f64, [f64; 3]) {
        let (row, slide_mm) = &self.rows[i];
        (row.t_s, [row.depth_mm, slide_mm[0], slide_mm[1]])
    }

    /// Corners between row i and the next one: where depth or slide stops or starts. Followed on at its own velocity, the motion before
    /// meets the motion after it there.
    fn corners_between(&self, i: usize) -> Vec<(Row, [f64; 2])> {
        let [(t0, p0), (t1, p1), (t2, p2), (t3, p3)] = [i - 1, i, i + 1, i + 2].map(|j| self.place(j));
        let mut out = Vec::new();
        for of in [0..1, 1..3] {
            // Along the change of velocity.
            let velocity =
                |from: (f64, [f64; 3]), to: (f64, [f64; 3]), k: usize| (to.1[k] - from.1[k]) / (to.0 - from.0);
            let (mut product, mut square) = (0.0, 0.0);
            for k in of.clone() {
                let [u, w, v] =
                    [((t0, p0), (t1, p1)), ((t1, p1), (t2, p2)), ((t2, p2), (t3, p3))].map(|(a, b)| velocity(a, b, k));
                product += (w - v) * (u - v);
                square += (u - v) * (u - v);
            }
            let step_s = t2 - t1;
            // Share of the step that the motion before takes, and how far a straight way misses the corner.
            let share = product / square.max(1e-300);
            let off_mm = square.sqrt() * step_s * share * (1.0 - share);
            if !(share > 0.0 && share < 1.0 && off_mm > CORNER_MM) {
                continue;
            }
            let t_s = t1 + share * step_s;
            let (mut row, mut slide_mm) = self.at(t_s, 0.0);
            for k in of {
                let at = p1[k] + velocity((t0, p0), (t1, p1), k) * share * step_s;
                if k == 0 { row.depth_mm = at } else { slide_mm[k - 1] = at }
            }
            let left_mm = (self.rows[i + 1].1[0] - slide_mm[0]).hypot(self.rows[i + 1].1[1] - slide_mm[1]);
            row.path_mm = (self.rows[i + 1].0.path_mm - left_mm).max(0.0);
            row.turn_mm = (self.rows[i + 1].0.turn_mm - left_mm).max(0.0);
            out.push((row, slide_mm));
        }
        out
    }

    /// Times of the rows before which the motion differs from that after them.
    fn corners(&self) -> impl Iterator<Item = f64> {
        (1..self.rows.len().saturating_sub(1)).filter(|i| self.is_corner(*i)).map(|i| self.rows[i].0.t_s)
    }

    fn is_corner(&self, i: usize) -> bool {
        let [(t0, p0), (t1, p1), (t2, p2)] = [i - 1, i, i + 1].map(|j| self.place(j));
        let share = (t1 - t0) / (t2 - t0).max(SAME_S);
        (0..3).any(|k| (p0[k] + share * (p2[k] - p0[k]) - p1[k]).abs() > CORNER_MM)
    }

    /// State and displacement, mm, that a reading at a time belongs to: those of `delay_s` earlier. Before the first row and after the last
    /// one the motion rests.
    fn at(&self, t_s: f64, delay_s: f64) -> (Row, [f64; 2]) {
        let rows = &self.rows;
        let moved_s = t_s - delay_s;
        let after = rows.partition_point(|r| r.0.t_s < moved_s);
        if after == 0 || after == rows.len() {
            let (row, slide_mm) = rows[after.min(rows.len() - 1)];
            return (Row { t_s, ..row }, slide_mm);
        }
        let ((a, from), (b, to)) = (&rows[after - 1], &rows[after]);
        let left = (b.t_s - moved_s) / (b.t_s - a.t_s);
        let between = |a: f64, b: f64| b + left * (a - b);
        let short_mm = left * (to[0] - from[0]).hypot(to[1] - from[1]);
        // A column that is not known before has the value after.
        let column = |a: f64, b: f64| if a.is_finite() { between(a, b) } else { b };
        let row = Row {
            t_s,
            depth_mm: between(a.depth_mm, b.depth_mm),
            occlusion_s: column(a.occlusion_s, b.occlusion_s),
            hydration_au: column(a.hydration_au, b.hydration_au),
            temperature_c: column(a.temperature_c, b.temperature_c),
            own: std::array::from_fn(|k| column(a.own[k], b.own[k])),
            contact_time_s: b.contact_time_s - (b.t_s - moved_s),
            path_mm: (b.path_mm - short_mm).max(0.0),
            turn_mm: (b.turn_mm - short_mm).max(0.0),
            ..*b
        };
        (row, [between(from[0], to[0]), between(from[1], to[1])])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow, run_of};

    /// A press of 1 mm in 0.1 s, a slide to 3 mm at 10 mm/s and back at 5 mm/s.
    fn motion(t_s: f64) -> (f64, f64) {
        let slide = if t_s < 0.4 { 10.0 * (t_s - 0.1).max(0.0) } else { 3.0 - 5.0 * (t_s - 0.4) };
        ((10.0 * t_s).min(1.0), slide)
    }

    fn run() -> Run {
        let row = |i: usize| {
            let t_s = 0.01 * i as f64;
            let (depth_mm, slide) = motion(t_s);
            RawRow::bare(i, t_s, depth_mm, [slide, 0.0], [1.0, 0.5, 0.0])
        };
        let mut run = run_of("m.csv".as_ref(), Labels::default(), &(0..100).map(row).collect::<Vec<_>>()).unwrap();
        run.rows.iter_mut().for_each(|row| row.own[0] = 50.0 * row.t_s);
        run
    }

    #[test]
    fn readings_keep_their_time_and_get_the_earlier_motion() {
        let run = run();
        for delay_s in [0.003, 0.02, 0.0175, -0.006] {
            for time_constant_s in [0.0, 0.01] {
                let (moved, places) = lagged(&run, Lag { delay_s, time_constant_s });
                assert_eq!(places.len(), run.rows.len());
                assert!(moved.rows.windows(2).all(|pair| pair[0].t_s < pair[1].t_s));
                for (i, place) in places.iter().enumerate() {
                    let row = &moved.rows[*place];
                    assert!(row.t_s == run.rows[i].t_s && moved.force_n[*place] == run.force_n[i]);
                    let (depth_mm, slide) = motion((row.t_s - delay_s).clamp(0.0, 0.99));
                    assert!((row.depth_mm - depth_mm).abs() < 1e-9, "{delay_s} {i}: {row:?}");
                    let own = 50.0 * (row.t_s - delay_s).clamp(0.0, 0.99);
                    assert!((row.own[0] - own).abs() < 1e-9, "{delay_s} {i}: {row:?}");
                    assert!((moved.slide_mm[*place][0] - slide).abs() < 1e-9, "{delay_s} {i}");
                }
                // The turn has a row of its own, and the path is that of the plate.
                let farthest = moved.slide_mm.iter().map(|s| s[0]).fold(0.0, f64::max);
                assert!((farthest - 3.0).abs() < 1e-9, "{farthest}");
                let readings = moved.force_n.iter().filter(|f| f[0].is_finite()).count();
                assert_eq!(readings, run.rows.len());
                let turn = moved.rows.iter().position(|r| r.along[0] < 0.0).unwrap();
                assert!(moved.rows[turn].turn_mm < 0.06 && moved.slide_mm[turn][0] < 3.0);
                // Forces that are low-passed change little from row to row after touch and turn.
                let steps = moved.slide_mm.windows(2).zip(&moved.rows[1..]).filter(|(_, r)| r.turn_mm < 2.0);
                let longest = steps.map(|(s, _)| (s[1][0] - s[0][0]).abs()).fold(0.0, f64::max);
                assert!(longest < if time_constant_s > 0.0 { 0.081 } else { 0.101 }, "{longest}");
            }
        }
    }

    #[test]
    fn no_lag_leaves_the_set() {
        let set = RunSet::from_rows(
            "m.csv".into(),
            vec![(Labels::default(), vec![RawRow::bare(2, 0.0, 1.0, [0.0; 2], [1.0; 3]); 2])],
        );
        let set = set.unwrap();
        let same = with_lag(&set, Lag::default());
        assert_eq!(format!("{:?}", same.runs[0].rows), format!("{:?}", set.runs[0].rows));
    }
}
