//! Turns of the plate that lie between two rows.
//!
//! A logger that reads at a constant rate does not depend on the motion: the plate goes on after a row, turns, and is on its way back at the
//! next one. Friction after the turn has more path behind it than the straight way between the rows shows. The plate's place before the turn
//! and after it, each followed on at its own velocity, meet at the turn.
//!
//! Main function: [`with_turns`].

use crate::data::median::median;
use crate::data::runs::RawRow;

/// Slides shorter than this are no motion, mm.
const STILL_MM: f64 = 1e-6;
/// Longest way beyond the rows, in usual steps, up to which the plate turned; one that went farther rested.
const MOST_STEPS: f64 = 4.0;
/// Way between two rows, in usual steps, from which rows were lost between them.
const LOST_ROWS: f64 = 1.5;
/// Way lost at a turn, in usual steps, from which on the friction after it does not follow from the positions.
const LOST_STEPS: f64 = 0.5;
/// Median time between rows over its tenth percentile, up to which a clock makes the rows.
const CLOCKED: f64 = 1.05;
/// Jumps of the speed from row to row, as share of it, above which a turn is known to a step only.
const UNEVEN: f64 = 0.06;
/// Cosine between two velocities below which the plate turned.
const TURNED: f64 = 0.3;
/// Steps from which a velocity comes at most, and the share by which they may differ.
const STEPS: usize = 4;
const EVEN: f64 = 0.1;
/// Share of the time between two rows by which a turn may seem to lie outside; then it is at the row.
const OUTSIDE: f64 = 0.25;

/// Path after a turn in which friction still depends on where it was, mm: twice that in which it builds up from rest
/// [Masing 1926], which in a deep contact is 1.2 mm.
const FORGOTTEN_MM: f64 = 2.5;

/// The rows, with a row without readings at each turn between two of them.
///
/// * `clock_s`: step of the clock, 0 for an exact one. Where the plate moves farther in it than between rows, the place of a turn is not
///   known: no row is added, and the friction after every turn is left out until it has forgotten the turn.
///
/// Where rows follow the motion rather than a clock, they may stand at the turns themselves; where the speed of the plate jumps from row
/// to row, because the clock is coarse or the position noisy, the place of a turn is known to a step. A turn among lost rows gets its row
/// then and the friction after it is left out; others stay as they are.
pub fn with_turns(raw: &[RawRow], clock_s: f64) -> Vec<RawRow> {
    let motion = Motion { raw };
    let usual_mm = motion.usual_mm();
    let mut turns = motion.turns();
    let usual_s = motion.usual_s();
    let is_coarse = usual_s.is_finite() && clock_s >= usual_s && clock_s > 0.0;
    let is_known = motion.is_clocked() && motion.unevenness() <= UNEVEN;
    turns.retain(|turn| {
        is_coarse || turn.beyond_mm <= MOST_STEPS * usual_mm && (is_known || turn.is_among_lost(usual_mm))
    });
    let mut turns = turns.into_iter().peekable();
    let mut out: Vec<RawRow> = Vec::with_capacity(raw.len() + 1);
    let mut since_lost_mm = f64::INFINITY;
    for (i, row) in raw.iter().enumerate() {
        let mut row = *row;
        if let Some(turn) = turns.next_if(|turn| turn.before <= i) {
            if is_coarse || !is_known {
                since_lost_mm = 0.0;
            }
            if let Some(between) = turn.row.filter(|_| !is_coarse) {
                out.push(between);
            }
        }
        if i > 0 {
            since_lost_mm += length(motion.step(i));
        }
        if since_lost_mm < FORGOTTEN_MM {
            (row.force_n[1], row.force_n[2]) = (f64::NAN, f64::NAN);
        }
        out.push(row);
    }
    out
}

/// A turn before a row.
struct Turn {
    before: usize,
    /// Slower of the two velocities that meet there, mm/s.
    slower_mm_s: f64,
    /// How far the plate went beyond the row before it, from that row to the one after it, and by how much farther than straight, mm.
    beyond_mm: f64,
    way_mm: f64,
    lost_mm: f64,
    /// The row to be added; none where the turn is at a row.
    row: Option<RawRow>,
}

impl Turn {
    /// Whether rows were lost around it, and with them a way that friction remembers.
    fn is_among_lost(&self, usual_mm: f64) -> bool {
        self.row.is_some() && self.way_mm >= LOST_ROWS * usual_mm && self.lost_mm >= LOST_STEPS * usual_mm
    }
}

struct Motion<'a> {
    raw: &'a [RawRow],
}

impl Motion<'_> {
    /// Way from the row before, mm.
    fn step(&self, i: usize) -> [f64; 2] {
        [0, 1].map(|k| self.raw[i].slide_mm[k] - self.raw[i - 1].slide_mm[k])
    }

    /// Velocity from the row before, mm/s.
    fn velocity(&self, i: usize) -> [f64; 2] {
        let seconds = self.raw[i].t_s - self.raw[i - 1].t_s;
        self.step(i).map(|way| way / seconds)
    }

    /// Rows in contact to which the plate moved.
    fn moving(&self) -> impl Iterator<Item = usize> {
        (1..self.raw.len()).filter(|i| self.raw[*i].depth_mm > 0.0 && length(self.step(*i)) > STILL_MM)
    }

    /// Median way between rows, mm; infinite without motion.
    fn usual_mm(&self) -> f64 {
        median(self.moving().map(|i| length(self.step(i)))).unwrap_or(f64::INFINITY)
    }

    /// Median time between rows in motion, s.
    fn usual_s(&self) -> f64 {
        median(self.moving().map(|i| self.raw[i].t_s - self.raw[i - 1].t_s)).unwrap_or(f64::INFINITY)
    }

    /// Whether a clock makes the rows: most of them are the same time apart, some of them lost.
    fn is_clocked(&self) -> bool {
        let mut apart: Vec<f64> = self.moving().map(|i| self.raw[i].t_s - self.raw[i - 1].t_s).collect();
        apart.sort_by(f64::total_cmp);
        let at = |share: f64| apart.get((share * apart.len() as f64) as usize).copied().unwrap_or(f64::INFINITY);
        at(0.5) <= CLOCKED * at(0.1)
    }

    /// How much the speed jumps along straight ways, median over the run, as share of it.
    fn unevenness(&self) -> f64 {
        let straight = |i: &usize| {
            let [a, b] = [*i, i + 1].map(|k| self.velocity(k));
            dot(a, b) > 0.9 * length(a) * length(b)
        };
        // Of independent errors a second difference has 2.45 times that of one.
        let jumps = (2..self.raw.len().saturating_sub(1))
            // Neither the step in which the plate set off nor one with a turn.
            .filter(|i| length(self.step(i - 1)) > STILL_MM && [i - 1, *i].iter().all(straight))
            .map(|i| [i - 1, i, i + 1].map(|k| length(self.velocity(k))))
            .map(|[a, b, c]| (a - 2.0 * b + c).abs() / 2.45 / b.max(STILL_MM));
        median(jumps).filter(|uneven| uneven.is_finite()).unwrap_or(0.0)
    }

    /// Velocity over as many even steps as there are: those that end at row `i`, or those that begin at it.
    fn even_velocity(&self, i: usize, forward: bool) -> Option<[f64; 2]> {
        let last = self.raw.len() - 1;
        let step = |k: usize| if forward { i + k } else { i + 1 - k };
        let there = |k: usize| if forward { i + k <= last } else { i >= k };
        if !there(1) {
            return None;
        }
        let first = self.velocity(step(1));
        let mut count = 1;
        while count < STEPS
            && there(count + 1)
            && length(minus(self.velocity(step(count + 1)), first)) < EVEN * length(first)
        {
            count += 1;
        }
        let [from, to] = if forward { [i, i + count] } else { [i - count, i] };
        let seconds = self.raw[to].t_s - self.raw[from].t_s;
        Some([0, 1].map(|k| (self.raw[to].slide_mm[k] - self.raw[from].slide_mm[k]) / seconds))
    }

    /// The turns, in the order of the rows.
    fn turns(&self) -> Vec<Turn> {
        let mut out: Vec<Turn> = Vec::new();
        for i in 2..self.raw.len().saturating_sub(1) {
            let Some(turn) = self.turn(i) else { continue };
            // The steps beside the one with the turn are whole, so that their velocities are the fastest that meet.
            match out.last_mut() {
                Some(last) if last.before + 2 >= i => {
                    if turn.slower_mm_s > last.slower_mm_s {
                        *last = turn;
                    }
                }
                _ => out.push(turn),
            }
        }
        out
    }

    /// The turn between row `i` and the one before, if the velocities beside them meet there.
    fn turn(&self, i: usize) -> Option<Turn> {
        let (before, after) = (&self.raw[i - 1], &self.raw[i]);
        if !self.raw[i - 2..=i + 1].iter().all(|row| row.depth_mm > 0.0) {
            return None;
        }
        let (there, back) = (self.even_velocity(i - 1, false)?, self.even_velocity(i, true)?);
        let (fast, slow) = (length(there).max(length(back)), length(there).min(length(back)));
        if !(slow > STILL_MM) || dot(there, back) > TURNED * fast * slow {
            return None;
        }
        let seconds = after.t_s - before.t_s;
        let change = minus(back, there);
        // Where the two lines of place over time are nearest to each other.
        let gap = minus(after.slide_mm, before.slide_mm);
        let apart = [0, 1].map(|k| gap[k] - back[k] * seconds);
        let late_s = -dot(apart, change) / dot(change, change);
        let share = late_s / seconds;
        if !(share > -OUTSIDE && share < 1.0 + OUTSIDE) {
            return None;
        }
        let slower_mm_s = slow;
        let beyond_mm = late_s.max(0.0) * length(there);
        let way_mm = beyond_mm + (seconds - late_s).max(0.0) * length(back);
        let at_row = !(share > 1e-3 && share < 1.0 - 1e-3);
        let place = if self.slows_down(i) {
            self.crest(i)?
        } else {
            [0, 1].map(|k| {
                let on = before.slide_mm[k] + there[k] * late_s;
                let from = after.slide_mm[k] - back[k] * (seconds - late_s);
                0.5 * (on + from)
            })
        };
        let at = |a: f64, b: f64| a + share * (b - a);
        let between = |of: fn(&RawRow) -> f64| at(of(before), of(after));
        let own = std::array::from_fn(|k| at(before.own[k], after.own[k]));
        let row = RawRow {
            t_s: before.t_s + late_s,
            depth_mm: between(|r| r.depth_mm),
            slide_mm: place,
            force_n: [f64::NAN; 3],
            contact_time_s: between(|r| r.contact_time_s),
            occlusion_time_s: between(|r| r.occlusion_time_s),
            hydration_au: between(|r| r.hydration_au),
            temperature_c: between(|r| r.temperature_c),
            own,
            ..*after
        };
        let lost_mm = way_mm - length(gap);
        Some(Turn { before: i, slower_mm_s, beyond_mm, way_mm, lost_mm, row: (!at_row).then_some(row) })
    }

    /// Whether the plate slows down towards the turn and speeds up after it, rather than turning at once.
    fn slows_down(&self, i: usize) -> bool {
        let speed = |k: usize| length(self.velocity(k));
        i >= 3
            && i + 2 < self.raw.len()
            && speed(i - 1) < (1.0 - EVEN) * speed(i - 2)
            && speed(i + 1) < (1.0 - EVEN) * speed(i + 2)
    }

    /// Farthest place of a plate that slows down: the crest of the parabola through the rows beside the turn.
    fn crest(&self, i: usize) -> Option<[f64; 2]> {
        let out = self.velocity(i - 1);
        let along = |row: &RawRow| dot(row.slide_mm, out) / length(out);
        // The farthest of the two rows beside the turn and its neighbours.
        let top = if along(&self.raw[i]) > along(&self.raw[i - 1]) { i } else { i - 1 };
        let [a, b, c] = [top - 1, top, top + 1].map(|k| (self.raw[k].t_s - self.raw[top].t_s, &self.raw[k]));
        let (before, after) = (along(a.1) - along(b.1), along(c.1) - along(b.1));
        // along = slope t + bend t² from the middle row.
        let bend = (before / a.0 - after / c.0) / (a.0 - c.0);
        let slope = before / a.0 - bend * a.0;
        if !(bend < 0.0) {
            return None;
        }
        let rise = -0.25 * slope * slope / bend;
        Some([0, 1].map(|k| b.1.slide_mm[k] + rise * out[k] / length(out)))
    }
}

fn length(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate that is at `place` along x, a row each 0.1 s from `phase_s` on; the rows from `lost` on are missing until `again`.
    fn rows(place: impl Fn(f64) -> f64, phase_s: f64, lost: usize, again: usize) -> Vec<RawRow> {
        let row = |i: usize| {
            let t_s = phase_s + 0.1 * i as f64;
            RawRow::bare(i, t_s, 1.0, [place(t_s), 0.0], [1.0, 0.5, 0.0])
        };
        (0..40).filter(|i| *i < lost || *i >= again).map(row).collect()
    }

    /// Out at 2 mm/s to 3 mm and back at another speed.
    fn there_and_back(t_s: f64) -> f64 {
        if t_s < 1.5 { 2.0 * t_s } else { 3.0 - 1.6 * (t_s - 1.5) }
    }

    fn added(raw: &[RawRow]) -> Option<RawRow> {
        let found = with_turns(raw, 0.0);
        assert!(found.len() <= raw.len() + 1 && found.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "{found:?}");
        assert!(found.iter().filter(|r| raw.iter().any(|old| old.t_s == r.t_s)).all(|r| r.force_n[1] == 0.5));
        found.into_iter().find(|r| r.force_n[0].is_nan())
    }

    #[test]
    fn a_turn_between_rows_is_where_the_ways_before_and_after_it_meet() {
        for phase_s in [0.013, 0.04, 0.05, 0.077] {
            for (lost, again) in [(40, 40), (13, 17), (15, 16), (14, 16), (13, 18)] {
                let turn =
                    added(&rows(there_and_back, phase_s, lost, again)).unwrap_or_else(|| panic!("{phase_s} {lost}"));
                assert!((turn.slide_mm[0] - 3.0).abs() < 1e-9 && (turn.t_s - 1.5).abs() < 1e-9, "{phase_s} {turn:?}");
            }
        }
        // One at a row, and rows that are missing on a straight way, add nothing.
        for (phase_s, lost, again) in [(0.0, 40, 40), (0.04, 4, 9)] {
            let raw = rows(if lost == 4 { |t_s: f64| 2.0 * t_s } else { there_and_back }, phase_s, lost, again);
            assert!(added(&raw).is_none(), "{phase_s} {lost}");
        }
    }

    #[test]
    fn a_plate_that_swings_turns_at_the_crest() {
        for phase_s in [0.0, 0.03, 0.06] {
            let raw = rows(|t_s| 3.0 - 3.0 * (t_s - 2.0).cos(), phase_s, 40, 40);
            let raw: Vec<RawRow> = raw.into_iter().filter(|r| r.t_s > 2.3).collect();
            // It starts at rest at 2 s and would be farthest at 2 + pi, after the last row.
            assert!(added(&raw).is_none());
            let raw = rows(|t_s| 3.0 * (t_s - 2.0).cos(), phase_s, 40, 40);
            let turn = added(&raw);
            assert!(turn.is_some() || phase_s == 0.0, "a row stands at the crest of phase 0");
            assert!(turn.is_none_or(|turn| (turn.slide_mm[0] - 3.0).abs() < 1e-3), "{phase_s}: {turn:?}");
        }
    }

    #[test]
    fn a_corner_is_found_and_a_rest_is_none() {
        let mut raw = rows(|t_s| t_s.min(1.52), 0.0, 40, 40);
        raw.iter_mut().for_each(|r| r.slide_mm[1] = (r.t_s - 1.52).max(0.0));
        let corner = added(&raw).unwrap();
        assert!((corner.slide_mm[0] - 1.52).abs() < 1e-9 && corner.slide_mm[1].abs() < 1e-9, "{corner:?}");
        // A plate that rests before it goes on the same way, or back, has not turned beyond its rows.
        let resting = rows(|t_s| if t_s < 1.0 { 2.0 * t_s } else { (2.0 * t_s - 1.0).max(2.0) }, 0.0, 40, 40);
        assert!(added(&resting).is_none());
        let mut logger_rests = rows(there_and_back, 0.0, 16, 30);
        logger_rests.retain(|r| r.t_s < 1.55 || r.t_s > 2.9);
        logger_rests.iter_mut().filter(|r| r.t_s > 2.0).for_each(|r| r.t_s += 3.0);
        assert!(added(&logger_rests).is_none());
    }

    #[test]
    fn a_clock_that_cannot_place_a_turn_takes_the_friction_after_it() {
        let raw = rows(there_and_back, 0.04, 40, 40);
        let found = with_turns(&raw, 0.3);
        assert_eq!(found.len(), raw.len());
        assert!(found.iter().any(|r| r.force_n[1].is_nan()) && found.iter().all(|r| r.force_n[0].is_finite()));
    }
}
