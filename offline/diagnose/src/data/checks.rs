//! Checks whether sets can carry a diagnosis at all: enough runs, possible units, signs and axes. A message names file, line
//! and column.

use fingerpad_formats::significant;

use crate::data::content::repeated;
use crate::data::median::median;
use crate::data::runs::{Run, RunSet};
use crate::error::DiagnoseError;

/// Fewest runs of a set. With four, every flip of whole runs is one of eight, and nothing could stand.
pub const LEAST_RUNS: usize = 5;

fn unusable(set: &RunSet, problem: String) -> DiagnoseError {
    DiagnoseError::Unusable { path: set.path.clone(), problem }
}

/// Depth and reading of the deepest row of a run that has a reading.
fn deepest(run: &Run) -> (f64, [f64; 3]) {
    let read = (0..run.rows.len()).filter(|i| !run.force_n[*i][0].is_nan());
    let i = read.max_by(|a, b| run.rows[*a].depth_mm.total_cmp(&run.rows[*b].depth_mm)).unwrap_or(0);
    (run.rows[i].depth_mm, run.force_n[i])
}

/// Whether the normal force in contact is below zero by more than half of the largest reading. A depth that is turned round has no
/// such force at its positive values, where the finger is in the air.
fn force_is_turned(set: &RunSet) -> bool {
    let rows = set.runs.iter().flat_map(|run| run.rows.iter().zip(&run.force_n)).filter(|(_, f)| !f[0].is_nan());
    let (mut largest, mut least, mut in_contact, mut negative) = (0.0f64, 0.0f64, 0usize, 0usize);
    for (row, [normal, ..]) in rows {
        largest = largest.max(normal.abs());
        if row.depth_mm > 0.0 {
            least = least.min(*normal);
            in_contact += 1;
            negative += usize::from(*normal < 0.0);
        }
    }
    -least > 0.5 * largest && 2 * negative > in_contact
}

/// Checks one set.
pub fn check(set: &RunSet) -> Result<(), DiagnoseError> {
    if set.runs.len() < LEAST_RUNS {
        return Err(unusable(
            set,
            format!(
                "line {}, column run_id: {} run{} where at least {LEAST_RUNS} are needed: the run is the statistical unit",
                set.runs.last().map_or(1, |r| r.line),
                set.runs.len(),
                if set.runs.len() == 1 { "" } else { "s" }
            ),
        ));
    }
    if force_is_turned(set) {
        return Err(unusable(
            set,
            format!(
                "line {}, column normal_force_n: the force is negative in contact, and normal_force_n is the push on the finger: turn \
                 the column round with --map normal=-normal_force_n (a minus sign before its name in the file), or give the \
                 orientation of the sensor with --sensor-rpy-deg",
                set.runs[0].line
            ),
        ));
    }
    if depth_is_turned(set) {
        return Err(unusable(
            set,
            format!(
                "line {}, column depth_mm: the normal force grows as depth falls, and depth_mm is to be positive into the \
                 finger: turn the column round with --map depth=-depth_mm (a minus sign before its name in the file)",
                set.runs[0].line
            ),
        ));
    }
    for run in &set.runs {
        if run.rows.iter().all(|r| !(r.depth_mm > 0.0)) {
            return Err(unusable(
                set,
                format!(
                    "line {}, column depth_mm: run `{}` never touches (depth_mm <= 0 in all its rows)",
                    run.line, run.labels.run
                ),
            ));
        }
    }
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for row in set.runs.iter().flat_map(|r| &r.rows).filter(|r| r.depth_mm > 0.0) {
        least = least.min(row.depth_mm);
        most = most.max(row.depth_mm);
    }
    if !(most - least > 0.02 * most) {
        return Err(unusable(
            set,
            format!(
                "line {}, column depth_mm: {} in every contact row; a constant depth cannot calibrate how force depends on it",
                set.runs[0].line,
                significant(least, 4)
            ),
        ));
    }
    units_within(set)?;
    columns(set)?;
    friction_follows_motion(set)
}

/// Refuses a set with runs of another one.
///
/// * `part_of`: what these runs are to the other set, as the middle of a sentence
pub fn check_distinct(set: &RunSet, other: &RunSet, part_of: &str) -> Result<(), DiagnoseError> {
    const NAMED: usize = 8;
    let found = repeated(set, other);
    let Some(first) = found.first() else { return Ok(()) };
    let names: Vec<String> = found
        .iter()
        .take(NAMED)
        .map(|r| if r.run == r.of { r.run.clone() } else { format!("{} (there {})", r.run, r.of) })
        .collect();
    let more = found.len() - names.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    Err(unusable(
        set,
        format!(
            "line {}: these runs {part_of} ({}): run_id {}{more}",
            first.line,
            other.path.display(),
            names.join(", ")
        ),
    ))
}

/// Whether depth is positive away from the finger: in most runs the row of the least depth is in the air by its depth, and
/// has more normal force than the deepest row.
fn depth_is_turned(set: &RunSet) -> bool {
    let is_turned = |run: &Run| {
        let by_depth = |a: &usize, b: &usize| run.rows[*a].depth_mm.total_cmp(&run.rows[*b].depth_mm);
        let read = || (0..run.rows.len()).filter(|i| run.force_n[*i][0].is_finite());
        let (Some(lowest), Some(highest)) = (read().min_by(by_depth), read().max_by(by_depth)) else { return false };
        run.rows[lowest].depth_mm < 0.0 && run.force_n[lowest][0] > run.force_n[highest][0]
    };
    2 * set.runs.iter().filter(|run| is_turned(run)).count() > set.runs.len()
}

/// A run whose depth, force or slide is hundreds of times that of the others has another unit.
fn units_within(set: &RunSet) -> Result<(), DiagnoseError> {
    type Quantity = (&'static str, fn(&Run) -> f64);
    let quantities: [Quantity; 3] = [
        ("depth_mm", |r| deepest(r).0),
        ("normal_force_n", |r| deepest(r).1[0].abs()),
        ("slide_x_mm, slide_y_mm", |r| r.slide_mm.iter().map(|s| s[0].hypot(s[1])).fold(0.0, f64::max)),
    ];
    for (column, of) in quantities {
        let Some(middle) = median(set.runs.iter().map(of).filter(|v| *v > 0.0)) else { continue };
        for run in &set.runs {
            let v = of(run);
            if v > 200.0 * middle || (column == "depth_mm" && v > 0.0 && v < middle / 200.0) {
                return Err(unusable(
                    set,
                    format!(
                        "line {}, column {column}: {v:.4} in run `{}` where the others have about {middle:.4}: mixed units?",
                        run.line, run.labels.run
                    ),
                ));
            }
        }
    }
    Ok(())
}

/// Least share of the friction on an axis by which its sign is judged.
const LEAST_OF_AXIS: f64 = 0.15;

/// Friction on the finger points along the plane's motion, so that its sign and its axes can be checked.
///
/// Shares are sums over sliding rows of the friction along the motion, over those of its size.
fn friction_follows_motion(set: &RunSet) -> Result<(), DiagnoseError> {
    let (mut size, mut along, mut exchanged) = (0.0, 0.0, 0.0);
    // Size and share along the motion of each axis alone.
    let mut axes = [[0.0; 2]; 2];
    for run in &set.runs {
        for (row, [_, x, y]) in run.rows.iter().zip(&run.force_n) {
            if row.depth_mm > 0.0 && row.speed_mm_s > 0.0 && row.turn_mm > 1.0 && !x.is_nan() {
                size += x.hypot(*y);
                along += x * row.along[0] + y * row.along[1];
                exchanged += y * row.along[0] + x * row.along[1];
                for (axis, force) in axes.iter_mut().zip([(x, row.along[0]), (y, row.along[1])]) {
                    axis[0] += (force.0 * force.1).abs();
                    axis[1] += force.0 * force.1;
                }
            }
        }
    }
    let (along, exchanged) = (along / size, exchanged / size);
    let line = set.runs[0].line;
    if along < 0.5 && exchanged > 0.8 {
        return Err(unusable(
            set,
            format!(
                "line {line}, columns friction_x_n and friction_y_n: friction lies across the motion (share along it \
                 {along:.2}, {exchanged:.2} with x and y exchanged): are the axes of force or slide exchanged?"
            ),
        ));
    }
    for (axis, [size_of, along_of]) in axes.into_iter().enumerate() {
        if along >= -0.5 && size_of > LEAST_OF_AXIS * size && along_of < -0.5 * size_of {
            let (name, other) = (["x", "y"][axis], ["y", "x"][axis]);
            return Err(unusable(
                set,
                format!(
                    "line {line}, column friction_{name}_n: friction along {name} points against the motion of the plate (share \
                     {:.2}), along {other} with it: turn the sign of friction_{name}_n or slide_{name}_mm, with a minus sign as in \
                     --map {name}=-friction_{name}_n",
                    along_of / size_of
                ),
            ));
        }
    }
    if along < -0.5 {
        return Err(unusable(
            set,
            format!(
                "line {line}, columns friction_x_n and friction_y_n: friction points against the motion of the plane (share \
                 {along:.2}); it is to be positive along it: turn the signs of the forces or of the slides"
            ),
        ));
    }
    Ok(())
}

/// The normal force must grow with depth, and nothing else may do so in its place.
fn columns(set: &RunSet) -> Result<(), DiagnoseError> {
    let mut rows: Vec<(f64, [f64; 3])> = Vec::new();
    for run in &set.runs {
        for (row, force) in run.rows.iter().zip(&run.force_n) {
            if row.depth_mm > 0.0 && !force[0].is_nan() {
                rows.push((row.depth_mm, *force));
            }
        }
    }
    let correlation = |of: &dyn Fn(&[f64; 3]) -> f64| {
        let n = rows.len() as f64;
        let (mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (d, f) in &rows {
            let y = of(f);
            sx += d;
            sy += y;
            sxx += d * d;
            sxy += d * y;
            syy += y * y;
        }
        (sxy - sx * sy / n) / ((sxx - sx * sx / n) * (syy - sy * sy / n)).max(1e-300).sqrt()
    };
    let line = set.runs[0].line;
    let normal = correlation(&|f| f[0]);
    if normal < -0.5 {
        return Err(unusable(
            set,
            format!(
                "line {line}, column normal_force_n: it falls as depth grows (correlation {normal:.2}); it is to be positive when the plane presses"
            ),
        ));
    }
    for (channel, name) in [(1, "friction_x_n"), (2, "friction_y_n")] {
        let other = correlation(&|f| f[channel]);
        if normal < 0.4 && other > 0.6 {
            return Err(unusable(
                set,
                format!(
                    "line {line}, columns normal_force_n and {name}: depth goes with {name} (correlation {other:.2}) and hardly with normal_force_n ({normal:.2}): are the columns exchanged?"
                ),
            ));
        }
    }
    if normal < 0.2 {
        return Err(unusable(
            set,
            format!(
                "line {line}, column normal_force_n: it hardly depends on depth_mm (correlation {normal:.2}): is it the right column?"
            ),
        ));
    }
    Ok(())
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow};

    /// Eight presses to 0.5 to 1.2 mm with slides in eight directions; normal force 0.5 N/mm, friction half of it.
    pub fn set(change: impl Fn(&mut RawRow)) -> RunSet {
        let stroke = |run: usize| {
            let (depth, angle) = (0.5 + 0.1 * run as f64, 0.7 * run as f64);
            let rows = (0..20).map(|i| {
                let slide = 0.3 * f64::from(i.max(8) - 8);
                let depth_mm = depth * f64::from(i.min(8)) / 8.0;
                let friction = if slide > 0.0 { 0.25 * depth_mm } else { 0.0 };
                let mut row = RawRow::bare(
                    2,
                    f64::from(i),
                    depth_mm,
                    [slide * angle.cos(), slide * angle.sin()],
                    [0.5 * depth_mm, friction * angle.cos(), friction * angle.sin()],
                );
                change(&mut row);
                row
            });
            (Labels { run: format!("r{run}"), ..Labels::default() }, rows.collect())
        };
        RunSet::from_rows("runs.csv".into(), (0..8).map(stroke).collect()).unwrap()
    }

    fn refusal(change: impl Fn(&mut RawRow)) -> String {
        check(&set(change)).unwrap_err().to_string()
    }

    #[test]
    fn five_runs_are_enough_and_four_are_not() {
        let all = set(|_| ());
        assert!(check(&all.subset(|run| run < 5)).is_ok());
        let message = check(&all.subset(|run| run < 4)).unwrap_err().to_string();
        assert!(message.contains("4 runs where at least 5 are needed"), "{message}");
    }

    #[test]
    fn axes_and_signs_of_friction_are_checked_against_the_motion() {
        // Slides along x and y alone, as a device that has no other axis makes them.
        let along_x = |row: &mut RawRow| {
            row.slide_mm = [row.slide_mm[0].hypot(row.slide_mm[1]), 0.0];
            row.force_n = [row.force_n[0], row.force_n[1].hypot(row.force_n[2]), 0.0];
        };
        assert!(check(&set(along_x)).is_ok());
        let message = refusal(|row| {
            along_x(row);
            row.force_n.swap(1, 2);
        });
        assert!(message.contains("axes") && message.contains("exchanged"), "{message}");
        let message = refusal(|row| row.force_n.swap(1, 2));
        assert!(message.contains("axes") && message.contains("exchanged"), "{message}");
        let message = refusal(|row| row.force_n = [row.force_n[0], -row.force_n[1], -row.force_n[2]]);
        assert!(message.contains("against the motion"), "{message}");
        for (axis, said) in [(1, "--map x=-friction_x_n"), (2, "--map y=-friction_y_n")] {
            let message = refusal(|row| row.force_n[axis] = -row.force_n[axis]);
            assert!(message.contains(said), "{message}");
        }
    }

    #[test]
    fn a_depth_of_the_wrong_sign_gets_a_hint() {
        let message = refusal(|row| row.depth_mm = -row.depth_mm);
        assert!(message.contains("--map depth=-depth_mm"), "{message}");
        // Some rows that hover above the finger do not hide it.
        let message = refusal(|row| row.depth_mm = if row.depth_mm > 0.0 { -row.depth_mm } else { 0.2 });
        assert!(message.contains("--map depth=-depth_mm"), "{message}");
        let message = refusal(|row| row.depth_mm = 0.9 + 1e-9 * row.depth_mm);
        assert!(message.contains("depth_mm: 0.9 in every contact row"), "{message}");
    }
}
