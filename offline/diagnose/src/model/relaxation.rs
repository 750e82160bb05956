//! One branch of the finger's tissue along a run: what the law `normal_relaxation` means where a press takes time, and where the finger
//! rises and comes back.
//!
//! A branch of the share g = f / (1 − f) of the relaxed stiffness remembers a force nu, which follows the relaxed force N of the depth:
//!
//! ```text
//! nu' = (N − nu) / tau          factor on the stiffness = 1 − f nu / N
//! ```
//!
//! For a press in no time this is the law's formula. Where the force would be negative the skin is off the plate, and nu falls with tau / (1 − f).
//!
//! Main function: [`factors`].

use crate::data::runs::Run;
use crate::model::active_law::ActiveLaw;

/// Name of the law.
const LAW: &str = "normal_relaxation";
/// Exponent of the relaxed force over depth. The shipped human fingers have 1.6 to 2.0 from 0.5 to 2 mm.
const EXPONENT: f64 = 1.8;

/// Fraction and time, s, of a law that is a branch.
pub fn branch_of(active: &ActiveLaw) -> Option<[f64; 2]> {
    let [fraction, time_s] = active.values[..] else { return None };
    (active.law.name == LAW).then_some([fraction, time_s])
}

/// Factor on the stiffness in each row of a run.
///
/// A run that was recorded from within contact starts with an even press to there.
pub fn factors(run: &Run, [fraction, time_s]: [f64; 2]) -> Vec<f64> {
    let relaxed = |depth_mm: f64| depth_mm.max(0.0).powf(EXPONENT);
    let first = &run.rows[0];
    let mut before = (first.t_s - first.contact_time_s.max(0.0), 0.0);
    let mut remembered = 0.0;
    let of_row = |row: &crate::laws::Row| {
        let (since_s, pressed) = (row.t_s - before.0, relaxed(row.depth_mm));
        let parts = (since_s / time_s).max(0.0);
        let in_air = remembered * (-(1.0 - fraction) * parts).exp();
        let skin = fraction * in_air;
        if pressed > skin {
            // Exact where the relaxed force is linear in time.
            let mean = if parts > 1e-9 { -(-parts).exp_m1() / parts } else { 1.0 };
            remembered = pressed - (before.1 - remembered) * (-parts).exp() - (pressed - before.1) * mean;
        } else {
            remembered = in_air;
        }
        before = (row.t_s, pressed.max(skin));
        if pressed > 0.0 { 1.0 - fraction * remembered / pressed } else { 1.0 }
    };
    run.rows.iter().map(of_row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow, run_of};
    use crate::laws::find;

    fn run(rows: impl Iterator<Item = (f64, f64)>) -> Run {
        let raw = |(t_s, depth_mm)| RawRow::bare(2, t_s, depth_mm, [0.0; 2], [0.5, 0.0, 0.0]);
        run_of("m.csv".as_ref(), Labels::default(), &rows.map(raw).collect::<Vec<_>>()).unwrap()
    }

    /// A press in no time gives the law's own formula.
    #[test]
    fn a_quick_press_is_the_law() {
        let law = find(LAW).unwrap();
        let rows = [(0.0, -0.1), (1e-6, 1.0)].into_iter().chain((1..60).map(|k| (0.1 * f64::from(k), 1.0)));
        let run = run(rows);
        let found = factors(&run, [0.3, 1.4]);
        for (row, factor) in run.rows.iter().zip(found).skip(2) {
            let mut change = fingerpad_smooth::ModelChange::default();
            law.apply(&[0.3, 1.4], row, &mut change);
            assert!((factor - change.stiffness).abs() < 1e-5, "{} {factor} {}", row.t_s, change.stiffness);
        }
    }

    /// A press of 2 s forgets on the way; relaxed tissue that rises carries less than on the way down; a finger that comes back after a long
    /// time in the air is as before.
    #[test]
    fn a_branch_remembers_the_way() {
        let way = |t: f64| match t {
            t if t < 2.0 => 0.5 * t,
            t if t < 12.0 => 1.0,
            t if t < 12.5 => 1.0 - (t - 12.0),
            t if t < 13.0 => 0.5,
            t if t < 13.2 => 0.5 - 5.0 * (t - 13.0),
            t if t < 60.0 => -0.5,
            t => (0.5 * (t - 60.0)).min(1.0),
        };
        let run = run((0..6500).map(|k| 0.01 * f64::from(k)).map(|t| (t, way(t))));
        let found = factors(&run, [0.4, 1.0]);
        let at = |t: f64| found[(100.0 * t).round() as usize];
        // Between that of a quick press and that of relaxed tissue.
        assert!(at(2.0) > 0.6 + 0.4 * f64::exp(-2.0) && at(2.0) < 0.9, "{}", at(2.0));
        assert!((at(11.9) - 0.6).abs() < 1e-3, "{}", at(11.9));
        assert!(at(12.5) < 0.4, "{}", at(12.5));
        assert!(at(13.0) > at(12.5));
        assert!((at(60.5) - at(0.5)).abs() < 1e-6 && (at(62.0) - at(2.0)).abs() < 1e-6, "{} {}", at(60.5), at(0.5));
    }
}
