//! Candidate designs of the next experiment, fifteen strokes each, and the rows that they would give.

use crate::data::runs::{Labels, RawRow, RunSet};
use crate::laws::{Column, OWN};
use crate::schema::PlannedRun;

/// Strokes of a design.
pub const STROKES: usize = 15;

/// Depths of shallow strokes over the least depth of the others.
const SHALLOW: [f64; 2] = [0.35, 0.55];

/// Shares of a range in an order that does not follow the clock, evenly.
fn even() -> Vec<f64> {
    (0..STROKES).map(|i| ((i * 7) % STROKES) as f64 / (STROKES - 1) as f64).collect()
}

/// Most strokes at the ends of a range, some in the middle: what grows along a factor shows there.
fn ends() -> Vec<f64> {
    (0..STROKES).map(|i| [0.0, 1.0, 0.5, 1.0, 0.0][i % 5]).collect()
}

/// A stroke on a finger that has rested.
fn fresh() -> PlannedRun {
    PlannedRun { rest_before_s: Some(60.0), new_block: Some(true), ..PlannedRun::default() }
}

/// One factor over its range.
fn single(shares: &[f64], [low, high]: [f64; 2], logarithmic: bool, set: fn(&mut PlannedRun, f64)) -> Vec<PlannedRun> {
    shares
        .iter()
        .map(|share| {
            let v = if logarithmic { low * (high / low).powf(*share) } else { low + (high - low) * share };
            let mut run = fresh();
            set(&mut run, (v * 1000.0).round() / 1000.0);
            run
        })
        .collect()
}

/// The designs that are compared, each with the factor that it varies; `depth_mm`: least and largest of the depths at hand.
pub fn candidate_designs(set: &RunSet, depth_mm: [f64; 2]) -> Vec<(&'static str, Vec<PlannedRun>)> {
    let mut out = Vec::new();
    for shares in [even(), ends()] {
        let mut add = |name: &'static str, range, logarithmic, set: fn(&mut PlannedRun, f64)| {
            out.push((name, single(&shares, range, logarithmic, set)));
        };
        add("dwell_s", [0.3, 30.0], true, |r, v| r.dwell_s = Some(v));
        add("depth_mm", depth_mm, false, |r, v| r.depth_mm = Some(v));
        add("speed_mm_s", [0.5, 20.0], true, |r, v| r.speed_mm_s = Some(v));
        if set.has(Column::Hydration) {
            add("hydration_au", [15.0, 75.0], false, |r, v| r.hydration_au = Some(v));
        }
        if set.has(Column::Temperature) {
            add("temperature_c", [27.0, 36.0], false, |r, v| r.temperature_c = Some(v));
        }
    }
    // Shallow strokes alone: an error of the touch point shows most in their friction, a pull-off not at all.
    let shallow = SHALLOW.map(|s| s * depth_mm[0]);
    out.push(("depth_mm", single(&even(), shallow, false, |r, v| r.depth_mm = Some(v))));
    out.push(("direction_deg", single(&even(), [0.0, 336.0], false, |r, v| r.direction_deg = Some(v))));
    out.push((
        "reverse",
        single(&even(), [3.0, 8.0], false, |r, v| {
            r.length_mm = Some(v);
            r.reverse = Some(true);
        }),
    ));
    out.push((
        "rest_before_s",
        (0..STROKES)
            .map(|i| {
                let new = i % 5 == 0;
                PlannedRun {
                    rest_before_s: Some(if new { 120.0 } else { 2.0 }),
                    new_block: Some(new),
                    ..PlannedRun::default()
                }
            })
            .collect(),
    ));
    out.push(("t_s", vec![PlannedRun { rest_before_s: Some(240.0), ..fresh() }; STROKES]));
    // All factors at once: each in an order of its own, and each at its ends, by columns of a Hadamard matrix that stay
    // orthogonal to each other but for the row that is left out [Plackett & Burman 1946].
    let orders: fn(usize, usize) -> f64 = |i, k| {
        const STEP: [usize; 5] = [2, 4, 8, 11, 13];
        ((i * STEP[k] + STEP[k]) % STROKES) as f64 / (STROKES - 1) as f64
    };
    let corners: fn(usize, usize) -> f64 = |i, k| {
        const COLUMN: [usize; 5] = [1, 2, 4, 8, 15];
        f64::from(((i + 1) & COLUMN[k]).count_ones() % 2)
    };
    for share in [orders, corners] {
        let all = (0..STROKES).map(|i| {
            let at = |k: usize, [low, high]: [f64; 2]| low + (high - low) * share(i, k);
            let round = |v: f64| (v * 100.0).round() / 100.0;
            PlannedRun {
                depth_mm: Some(round(at(0, depth_mm))),
                speed_mm_s: Some(round(0.5 * 40f64.powf(at(1, [0.0, 1.0])))),
                direction_deg: Some((24 * (7 * i + 7)) as f64 % 360.0),
                dwell_s: Some(round(0.3 * 100f64.powf(at(2, [0.0, 1.0])))),
                hydration_au: set.has(Column::Hydration).then(|| round(at(3, [15.0, 75.0]))),
                temperature_c: set.has(Column::Temperature).then(|| round(at(4, [27.0, 36.0]))),
                rest_before_s: Some(if i % 4 == 0 { 60.0 } else { 2.0 }),
                new_block: Some(i % 4 == 0),
                ..PlannedRun::default()
            }
        });
        out.push(("all", all.collect()));
    }
    out
}

/// What the laboratory can do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanConstraints {
    /// Columns that may be varied, with `length_mm` and `rest_before_s`; all where `None`.
    pub can_set: Option<Vec<String>>,
    /// Least rest before a stroke, s.
    pub least_rest_s: f64,
}

/// Rest in which moisture or temperature of the skin settle at another value, s.
const STATE_REST_S: f64 = 300.0;

impl PlanConstraints {
    fn allows(&self, factor: &str) -> bool {
        self.can_set.as_ref().is_none_or(|list| list.iter().any(|c| c == factor))
    }

    /// A design as the laboratory can do it; `None` where what it varies cannot be set.
    ///
    /// Moisture and temperature rise from stroke to stroke, with time to settle: nobody sets them anew at will.
    pub fn apply(&self, factor: &str, mut runs: Vec<PlannedRun>) -> Option<Vec<PlannedRun>> {
        let varies = if factor == "reverse" { "length_mm" } else { factor };
        if !(factor == "all" || factor == "t_s" || self.allows(varies)) {
            return None;
        }
        if factor == "rest_before_s" && runs.iter().all(|r| r.rest_before_s.is_some_and(|s| s <= self.least_rest_s)) {
            return None;
        }
        for run in &mut runs {
            let keep = |column: &str, value: &mut Option<f64>| {
                if !self.allows(column) {
                    *value = None;
                }
            };
            keep("depth_mm", &mut run.depth_mm);
            keep("speed_mm_s", &mut run.speed_mm_s);
            keep("direction_deg", &mut run.direction_deg);
            keep("dwell_s", &mut run.dwell_s);
            keep("hydration_au", &mut run.hydration_au);
            keep("temperature_c", &mut run.temperature_c);
            run.rest_before_s = run.rest_before_s.map(|s| s.max(self.least_rest_s));
        }
        let state = |r: &PlannedRun| [r.hydration_au, r.temperature_c];
        if runs.iter().any(|r| state(r) != [None; 2]) {
            let key = |r: &PlannedRun| r.hydration_au.or(r.temperature_c).unwrap_or(0.0);
            runs.sort_by(|a, b| key(a).total_cmp(&key(b)));
            let mut before = [None; 2];
            for run in &mut runs {
                if state(run) != before {
                    run.rest_before_s = Some(run.rest_before_s.unwrap_or(0.0).max(STATE_REST_S));
                    run.new_block = Some(true);
                }
                before = state(run);
            }
        }
        Some(runs)
    }
}

/// Conditions of a stroke where the design says nothing.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceConditions {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Speed of pressing, mm/s.
    pub press_mm_s: f64,
    /// Length of a stroke, mm.
    pub length_mm: f64,
    /// Clock at which the first begins, s.
    pub start_s: f64,
    /// Width of the finger, mm.
    pub width_mm: f64,
    /// Columns of the user's own.
    pub own: [f64; OWN],
}

/// Rows that a design would give; readings are 0.
pub fn rows_of(plan: &[PlannedRun], conditions: ReferenceConditions) -> Vec<(Labels, Vec<RawRow>)> {
    let mut clock = conditions.start_s;
    let mut occluded = 0.0;
    plan.iter()
        .enumerate()
        .map(|(i, run)| {
            let rest = run.rest_before_s.unwrap_or(60.0);
            clock += rest.max(1.0);
            if run.new_block.unwrap_or(rest >= 30.0) {
                occluded = 0.0;
            }
            let depth = run.depth_mm.unwrap_or(conditions.depth_mm);
            let (speed, dwell) = (run.speed_mm_s.unwrap_or(2.0), run.dwell_s.unwrap_or(1.0));
            let length = run.length_mm.unwrap_or(conditions.length_mm);
            let (s, c) = run.direction_deg.unwrap_or(0.0).to_radians().sin_cos();
            let press_s = depth / conditions.press_mm_s;
            let mut points = vec![(-0.1, -0.2, 0.0), (-0.03, -0.05, 0.0)];
            for k in 1..=6 {
                points.push((press_s * f64::from(k) / 6.0, depth * f64::from(k) / 6.0, 0.0));
            }
            points.push((press_s + dwell, depth, 0.0));
            let total = if run.reverse == Some(true) { 1.5 } else { 1.0 } * length;
            for k in 1..=16 {
                let path = total * (f64::from(k) / 16.0).powf(1.3);
                let place = if path > length { 2.0 * length - path } else { path };
                points.push((press_s + dwell + path / speed, depth, place));
            }
            let rows = points
                .iter()
                .map(|&(t, depth_mm, place)| RawRow {
                    line: 0,
                    t_s: clock + t,
                    depth_mm,
                    slide_mm: [place * c, place * s],
                    force_n: [0.0; 3],
                    contact_time_s: t,
                    speed_mm_s: speed,
                    direction_deg: f64::NAN,
                    dwell_s: dwell,
                    occlusion_time_s: occluded + t.max(0.0),
                    hydration_au: run.hydration_au.unwrap_or(35.0),
                    temperature_c: run.temperature_c.unwrap_or(32.0),
                    finger_width_mm: conditions.width_mm,
                    own: conditions.own,
                })
                .collect();
            let end = points[points.len() - 1].0;
            clock += end;
            occluded += end;
            (Labels { run: format!("next{i}"), ..Labels::default() }, rows)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::minutes;

    #[test]
    fn plans_keep_to_what_the_laboratory_can_do() {
        let limits = PlanConstraints {
            can_set: Some(vec!["depth_mm".into(), "speed_mm_s".into(), "dwell_s".into()]),
            least_rest_s: 30.0,
        };
        let moist = PlannedRun { hydration_au: Some(40.0), rest_before_s: Some(2.0), ..PlannedRun::default() };
        assert_eq!(limits.apply("hydration_au", vec![moist.clone()]), None);
        let all = PlannedRun { depth_mm: Some(1.0), ..moist.clone() };
        let [run] = &limits.apply("all", vec![all]).unwrap()[..] else { panic!() };
        assert_eq!((run.depth_mm, run.hydration_au, run.rest_before_s), (Some(1.0), None, Some(30.0)));
        // Where moisture may be set it rises, and has time to.
        let strokes = [60.0, 20.0, 40.0].map(|h| PlannedRun { hydration_au: Some(h), ..moist.clone() });
        let runs = PlanConstraints::default().apply("hydration_au", strokes.to_vec()).unwrap();
        assert!(runs.windows(2).all(|p| p[0].hydration_au < p[1].hydration_au));
        assert!(runs.iter().all(|r| r.rest_before_s >= Some(STATE_REST_S)));
        assert!(minutes(&runs) > 15.0);
    }
}
