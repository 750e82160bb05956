//! Turns of the plate that lie between two rows because the logger lost some.
//!
//! Positions tell the straight way between two rows only. Where the plate went on, turned and came back in between, the
//! friction after the turn has more path behind it than they show; the plate's speed tells how much.
//!
//! Main function: [`with_lost_turns`].

use crate::data::runs::RawRow;

/// Path between two rows, in usual steps, from which rows were lost between them.
const LOST_ROWS: f64 = 1.5;
/// Path lost at a turn, in usual steps, from which on the friction after it is another than the positions tell.
const LOST_STEPS: f64 = 0.5;
/// Path lost at a turn, in usual steps, beyond which the plate did not go on but rest.
const MOST_STEPS: f64 = 8.0;

/// Path after a turn in which friction still depends on where it was, mm: twice that in which it builds up from rest
/// [Masing 1926], which in a deep contact is 1.2 mm.
const FORGOTTEN_MM: f64 = 2.5;

/// The rows with a row without readings at each turn that was lost. The turn's place is known to a step only, so that the
/// friction after it is left out until it has forgotten the turn.
///
/// * `speed_mm_s`: of the plate while it slides; 0 where it is not known
/// * `clock_s`: step of the clock; where the plate moves farther in it than between rows, no row is added, and the friction
///   after every turn is left out
pub fn with_lost_turns(raw: &[RawRow], speed_mm_s: f64, clock_s: f64) -> Vec<RawRow> {
    let step = |i: usize| [0, 1].map(|k| raw[i].slide_mm[k] - raw[i - 1].slide_mm[k]);
    let length = |s: [f64; 2]| s[0].hypot(s[1]);
    let mut lengths: Vec<f64> =
        (1..raw.len()).filter(|i| raw[*i].depth_mm > 0.0).map(|i| length(step(i))).filter(|l| *l > 1e-6).collect();
    lengths.sort_by(f64::total_cmp);
    let usual_mm = lengths.get(lengths.len() / 2).copied().unwrap_or(f64::INFINITY);
    let mut out: Vec<RawRow> = Vec::with_capacity(raw.len() + 1);
    let mut since_lost_mm = f64::INFINITY;
    for (i, row) in raw.iter().enumerate() {
        let mut row = *row;
        // The first row after a turn may lie farther out than the last one before it; then the next one leads back.
        let turned = |i: usize| i < raw.len() && raw[i].depth_mm > 0.0 && turns(step(i - 1), step(i));
        if i >= 2 && row.depth_mm > 0.0 && (turned(i) || turned(i + 1)) {
            if turned(i) && speed_mm_s * clock_s >= usual_mm {
                since_lost_mm = 0.0;
            } else if let Some(turn) = lost_turn([step(i - 1), step(i)], [&raw[i - 1], &row], speed_mm_s, usual_mm) {
                out.push(turn);
                since_lost_mm = 0.0;
            }
        }
        if i > 0 {
            since_lost_mm += length(step(i));
        }
        if since_lost_mm < FORGOTTEN_MM {
            (row.force_n[1], row.force_n[2]) = (f64::NAN, f64::NAN);
        }
        out.push(row);
    }
    out
}

/// Whether the second step leads back.
fn turns(first: [f64; 2], second: [f64; 2]) -> bool {
    first[0] * second[0] + first[1] * second[1] < 0.3 * first[0].hypot(first[1]) * second[0].hypot(second[1])
}

/// The turning point between two rows, where the plate's speed says that it was farther out than the first of them.
fn lost_turn(steps: [[f64; 2]; 2], [before, after]: [&RawRow; 2], speed_mm_s: f64, usual_mm: f64) -> Option<RawRow> {
    let [way_there, back] = steps;
    let there_mm = way_there[0].hypot(way_there[1]);
    if !(there_mm > 1e-6 && before.depth_mm > 0.0) {
        return None;
    }
    let out = way_there.map(|v| v / there_mm);
    let along_mm = back[0] * out[0] + back[1] * out[1];
    let seconds = after.t_s - before.t_s;
    let gone_mm = speed_mm_s * seconds;
    let lost_mm = gone_mm - back[0].hypot(back[1]);
    let most_mm = MOST_STEPS * usual_mm;
    // About as long a way as the plate can have gone is missing.
    if gone_mm < LOST_ROWS * usual_mm || lost_mm < LOST_STEPS * usual_mm || lost_mm > most_mm {
        return None;
    }
    let beyond_mm = 0.5 * (gone_mm + along_mm);
    let share = beyond_mm / gone_mm;
    let between = |of: fn(&RawRow) -> f64| of(before) + share * (of(after) - of(before));
    Some(RawRow {
        t_s: between(|r| r.t_s),
        depth_mm: between(|r| r.depth_mm),
        slide_mm: [0, 1].map(|k| before.slide_mm[k] + beyond_mm * out[k]),
        force_n: [f64::NAN; 3],
        contact_time_s: between(|r| r.contact_time_s),
        occlusion_time_s: between(|r| r.occlusion_time_s),
        ..*after
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate at 2 mm/s out to 3 mm and back, a row each 0.1 s; the rows from `lost` on are missing until `again`.
    fn rows(lost: usize, again: usize) -> Vec<RawRow> {
        let row = |i: usize| {
            let way = 0.2 * i as f64;
            RawRow::bare(i, 0.1 * i as f64, 1.0, [if way > 3.0 { 6.0 - way } else { way }, 0.0], [1.0, 0.5, 0.0])
        };
        (0..40).filter(|i| *i < lost || *i >= again).map(row).collect()
    }

    #[test]
    fn a_lost_turn_comes_back_where_the_speed_puts_it() {
        let found = with_lost_turns(&rows(13, 18), 2.0, 0.0);
        let turn = found.iter().find(|r| r.force_n[0].is_nan()).unwrap();
        assert!((turn.slide_mm[0] - 3.0).abs() < 1e-9 && (turn.t_s - 1.5).abs() < 1e-9, "{turn:?}");
        // Rows lost on a straight way add nothing, nor does a whole run; nor does a coarse clock.
        for (lost, again, clock_s) in [(4, 9, 0.0), (40, 40, 0.0), (13, 18, 0.3)] {
            let whole = rows(lost, again);
            let found = with_lost_turns(&whole, 2.0, clock_s);
            assert_eq!(found.len(), whole.len(), "{lost} {again}");
            // A clock that cannot place the turn takes the friction after it, not the normal force.
            let left_out = found.iter().filter(|r| r.force_n[1].is_nan()).count();
            assert_eq!(left_out > 0, clock_s > 0.0, "{lost} {again}");
            assert!(found.iter().all(|r| r.force_n[0].is_finite()));
        }
    }

    #[test]
    fn a_turn_beyond_the_first_row_after_it_and_one_with_a_single_lost_row_come_back_too() {
        // The plate turns at 3 mm, after the row of 1.5 s. Without rows 13 to 16 the next position is beyond the last one.
        for (lost, again) in [(13, 17), (15, 16), (14, 16)] {
            let found = with_lost_turns(&rows(lost, again), 2.0, 0.0);
            let turn = found.iter().find(|r| r.force_n[0].is_nan()).unwrap_or_else(|| panic!("{lost} {again}"));
            assert!((turn.slide_mm[0] - 3.0).abs() < 1e-9 && (turn.t_s - 1.5).abs() < 1e-9, "{lost} {again} {turn:?}");
            let way_back_mm = |r: &RawRow| if r.t_s > 1.5 { 3.0 - r.slide_mm[0] } else { f64::INFINITY };
            // The turn's place is known to a step, and so is where it is forgotten.
            let clear = |r: &&RawRow| r.force_n[0].is_finite() && (way_back_mm(r) - FORGOTTEN_MM).abs() > 0.6;
            for row in found.iter().filter(clear) {
                assert_eq!(row.force_n[1].is_nan(), way_back_mm(row) < FORGOTTEN_MM, "{lost} {again}: {row:?}");
            }
        }
        // A plate that rests before it goes on the same way has not turned.
        let mut resting = rows(40, 40);
        resting.truncate(14);
        resting.iter_mut().skip(8).for_each(|r| r.t_s += 0.3);
        assert_eq!(with_lost_turns(&resting, 2.0, 0.0).len(), resting.len());
    }
}
