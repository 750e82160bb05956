//! Candidate designs of the next experiment, fifteen strokes each, and the rows that they would give.

use crate::data::runs::{Labels, RawRow, RunSet};
use crate::laws::{OWN, OwnColumn};
use crate::schema::{FACTORS, Factor, PlannedRun};

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

/// A share of a range, in equal ratios or steps.
fn at((range, in_equal_ratios): ([f64; 2], bool), share: f64) -> f64 {
    let [low, high] = range;
    if in_equal_ratios { low * (high / low).powf(share) } else { low + (high - low) * share }
}

/// One factor over its range.
fn single(shares: &[f64], range: ([f64; 2], bool), set: impl Fn(&mut PlannedRun, f64)) -> Vec<PlannedRun> {
    let stroke = |share: &f64| {
        let mut run = fresh();
        set(&mut run, (at(range, *share) * 1000.0).round() / 1000.0);
        run
    };
    shares.iter().map(stroke).collect()
}

/// The designs that are compared, each with the factor that it varies; columns of the user's own are varied over their range.
///
/// * `depth_mm`: least and largest of the depths at hand
pub fn candidate_designs<'a>(
    set: &RunSet,
    depth_mm: [f64; 2],
    own: &'a [OwnColumn],
) -> Vec<(&'a str, Vec<PlannedRun>)> {
    let is_recorded = |f: &Factor| f.settle_s == 0.0 || set.recorded.iter().any(|column| column.name() == f.name);
    let range = |f: Factor| Some(((f.of, f.name), if f.name == "depth_mm" { (depth_mm, false) } else { f.range? }));
    let factors: Vec<_> = FACTORS.into_iter().filter(is_recorded).filter_map(range).collect();
    let mut out: Vec<(&str, Vec<PlannedRun>)> = Vec::new();
    for shares in [even(), ends()] {
        for column in own.iter().filter(|column| column.derived.is_none()) {
            let set = |r: &mut PlannedRun, v: f64| {
                r.own.insert(column.name.clone(), v);
            };
            out.push((&column.name, single(&shares, (column.range, false), set)));
        }
        for ((of, name), range) in &factors {
            out.push((name, single(&shares, *range, |r, v| *of(r) = Some(v))));
        }
    }
    // Shallow strokes alone: an error of the touch point shows most in their friction, a pull-off not at all.
    let shallow = SHALLOW.map(|s| s * depth_mm[0]);
    out.push(("depth_mm", single(&even(), (shallow, false), |r, v| r.depth_mm = Some(v))));
    out.push(("direction_deg", single(&even(), ([0.0, 336.0], false), |r, v| r.direction_deg = Some(v))));
    out.push((
        "reverse",
        single(&even(), ([3.0, 8.0], false), |r, v| {
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
    let orders_of_own: fn(usize, usize) -> f64 = |i, k| {
        const STEP: [usize; OWN] = [1, 14, 7, 4];
        ((i * STEP[k] + 5 * k) % STROKES) as f64 / (STROKES - 1) as f64
    };
    let corners_of_own: fn(usize, usize) -> f64 = |i, k| {
        const COLUMN: [usize; OWN] = [3, 5, 6, 9];
        f64::from(((i + 1) & COLUMN[k]).count_ones() % 2)
    };
    for (share, of_own) in [(orders, orders_of_own), (corners, corners_of_own)] {
        let all = (0..STROKES).map(|i| {
            let round = |v: f64| (v * 100.0).round() / 100.0;
            let mut run = PlannedRun {
                direction_deg: Some((24 * (7 * i + 7)) as f64 % 360.0),
                rest_before_s: Some(if i % 4 == 0 { 60.0 } else { 2.0 }),
                new_block: Some(i % 4 == 0),
                own: own
                    .iter()
                    .enumerate()
                    .map(|(k, c)| (c.name.clone(), round(c.range[0] + (c.range[1] - c.range[0]) * of_own(i, k))))
                    .collect(),
                ..PlannedRun::default()
            };
            for (k, ((of, _), range)) in factors.iter().enumerate() {
                *of(&mut run) = Some(round(at(*range, share(i, k))));
            }
            run
        });
        out.push(("all", all.collect()));
    }
    out
}

/// What the laboratory can do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanConstraints {
    /// Columns that may be varied, those of the user's own, `length_mm` and `rest_before_s` among them; all where `None`.
    pub can_set: Option<Vec<String>>,
    /// Least rest before a stroke, s.
    pub least_rest_s: f64,
}

/// Rest after which a finger has recovered as after a pause of the session, s.
const BLOCK_REST_S: f64 = 300.0;

/// What a stroke sets that takes time to settle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slow {
    factor: usize,
    value: f64,
    settle_s: f64,
}

/// What of a stroke takes time to settle, the slowest first.
fn slow(run: &PlannedRun, own: &[OwnColumn]) -> Vec<Slow> {
    let state = FACTORS.iter().filter(|f| f.settle_s > 0.0).map(|f| (f.value(run), f.settle_s));
    let of_own = own.iter().map(|c| (run.own.get(&c.name).copied(), c.settle_s));
    let all = state.chain(of_own).enumerate();
    let mut out: Vec<Slow> = all
        .filter_map(|(factor, (value, settle_s))| value.map(|value| Slow { factor, value, settle_s }))
        .filter(|s| s.settle_s > 0.0)
        .collect();
    out.sort_by(|a, b| b.settle_s.total_cmp(&a.settle_s));
    out
}

impl PlanConstraints {
    fn allows(&self, factor: &str) -> bool {
        self.can_set.as_ref().is_none_or(|list| list.iter().any(|c| c == factor))
    }

    /// A design as the laboratory can do it; `None` where what it varies cannot be set.
    ///
    /// What takes time to settle (moisture, temperature, a column of the user's own that says so) rises from stroke to stroke,
    /// and has that time: no laboratory sets it again at will.
    pub fn apply(&self, factor: &str, mut runs: Vec<PlannedRun>, own: &[OwnColumn]) -> Option<Vec<PlannedRun>> {
        let varies = if factor == "reverse" { "length_mm" } else { factor };
        if !(factor == "all" || factor == "t_s" || self.allows(varies)) {
            return None;
        }
        if factor == "rest_before_s" && runs.iter().all(|r| r.rest_before_s.is_some_and(|s| s <= self.least_rest_s)) {
            return None;
        }
        for run in &mut runs {
            for factor in FACTORS.iter().filter(|f| f.name != "rest_before_s" && !self.allows(f.name)) {
                *(factor.of)(run) = None;
            }
            run.own.retain(|column, _| self.allows(column));
            run.rest_before_s = run.rest_before_s.map(|s| s.max(self.least_rest_s));
        }
        runs.sort_by(|a, b| {
            let slowest = |r: &PlannedRun| slow(r, own).first().map_or(0.0, |s| s.value);
            slowest(a).total_cmp(&slowest(b))
        });
        let mut before: Vec<Slow> = Vec::new();
        for run in &mut runs {
            let settling = slow(run, own);
            let changed = settling.iter().filter(|s| !before.contains(s)).map(|s| s.settle_s);
            let settle_s = changed.fold(0.0, f64::max);
            if settle_s > 0.0 {
                run.rest_before_s = Some(run.rest_before_s.unwrap_or(0.0).max(settle_s));
            }
            if settle_s >= BLOCK_REST_S {
                run.new_block = Some(true);
            }
            before = settling;
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

/// Rows that a design would give; readings are 0. `own`: columns of the user's own, in the order of the conditions.
pub fn rows_of(plan: &[PlannedRun], conditions: ReferenceConditions, own: &[OwnColumn]) -> Vec<(Labels, Vec<RawRow>)> {
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
            let mut of_own = conditions.own;
            for (to, column) in of_own.iter_mut().zip(own) {
                *to = run.own.get(&column.name).copied().unwrap_or(*to);
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
                    own: of_own,
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
        assert_eq!(limits.apply("hydration_au", vec![moist.clone()], &[]), None);
        let all = PlannedRun { depth_mm: Some(1.0), ..moist.clone() };
        let [run] = &limits.apply("all", vec![all], &[]).unwrap()[..] else { panic!() };
        assert_eq!((run.depth_mm, run.hydration_au, run.rest_before_s), (Some(1.0), None, Some(30.0)));
        // Where moisture may be set it rises, and has time to.
        let strokes = [60.0, 20.0, 40.0].map(|h| PlannedRun { hydration_au: Some(h), ..moist.clone() });
        let runs = PlanConstraints::default().apply("hydration_au", strokes.to_vec(), &[]).unwrap();
        assert!(runs.windows(2).all(|p| p[0].hydration_au < p[1].hydration_au));
        assert!(runs.iter().all(|r| r.rest_before_s >= Some(BLOCK_REST_S)));
        assert!(minutes(&runs) > 15.0);
    }

    /// Where all factors are varied, each stays within its range and reaches both of its ends.
    #[test]
    fn factors_stay_within_their_ranges() {
        let set = RunSet::from_rows(std::path::PathBuf::new(), Vec::new()).unwrap();
        let factors: [(fn(&PlannedRun) -> Option<f64>, [f64; 2]); 3] =
            [(|run| run.depth_mm, [0.4, 1.2]), (|run| run.speed_mm_s, [0.5, 20.0]), (|run| run.dwell_s, [0.3, 30.0])];
        let designs = candidate_designs(&set, [0.4, 1.2], &[]);
        for (_, plan) in designs.iter().filter(|(name, _)| *name == "all") {
            for (value, [low, high]) in factors {
                let values: Vec<f64> = plan.iter().filter_map(value).collect();
                assert!(values.iter().all(|v| (low..=high).contains(v)), "{values:?}");
                assert!(values.contains(&low) && values.contains(&high), "{values:?}");
            }
        }
    }

    #[test]
    fn columns_of_the_users_own_are_varied_where_they_may_be_and_have_their_time_to_settle() {
        let column = |name: &str, range, settle_s| OwnColumn {
            derived: None,
            name: name.into(),
            unit: "V".into(),
            range,
            reference: range[0],
            settle_s,
        };
        let own = vec![column("voltage_v", [0.0, 200.0], 0.0), column("bias_v", [-5.0, 5.0], 600.0)];
        let set = RunSet::from_rows(std::path::PathBuf::new(), Vec::new()).unwrap();
        let designs = candidate_designs(&set, [0.4, 1.2], &own);
        let constraints = |names: &[&str]| PlanConstraints {
            can_set: Some(names.iter().map(|n| (*n).to_owned()).collect()),
            least_rest_s: 2.0,
        };
        for (name, settle_s) in [("voltage_v", 60.0), ("bias_v", 600.0)] {
            let (_, plan) = designs.iter().find(|(factor, _)| *factor == name).unwrap();
            let runs = constraints(&[name]).apply(name, plan.clone(), &own).unwrap();
            let mut values: Vec<f64> = runs.iter().map(|r| r.own[name]).collect();
            assert!(runs.iter().all(|r| r.rest_before_s == Some(settle_s)), "{name}: {runs:?}");
            assert_eq!(values.windows(2).all(|p| p[0] <= p[1]), name == "bias_v", "{values:?}");
            values.sort_by(f64::total_cmp);
            let [low, high] = own.iter().find(|c| c.name == name).unwrap().range;
            assert_eq!((values[0], values[STROKES - 1]), (low, high));
            assert_eq!(constraints(&["depth_mm"]).apply(name, plan.clone(), &own), None);
            // The same number of strokes and holds: the price is the rest.
            assert!((minutes(&runs) - (settle_s + 31.0) * STROKES as f64 / 60.0).abs() < 1e-9);
        }
        let (_, all) = designs.iter().find(|(factor, _)| *factor == "all").unwrap();
        let runs = constraints(&["voltage_v", "speed_mm_s"]).apply("all", all.clone(), &own).unwrap();
        assert!(runs.iter().all(|r| r.own.len() == 1 && r.speed_mm_s.is_some() && r.depth_mm.is_none()), "{runs:?}");
        let conditions = ReferenceConditions {
            depth_mm: 1.0,
            press_mm_s: 2.0,
            length_mm: 5.0,
            start_s: 0.0,
            width_mm: 16.0,
            own: [7.0, 1.5, f64::NAN, f64::NAN],
        };
        for (run, (_, rows)) in runs.iter().zip(rows_of(&runs, conditions, &own)) {
            assert!(rows.iter().all(|row| row.own[..2] == [run.own["voltage_v"], 1.5]), "{:?}", rows[0].own);
        }
    }
}
