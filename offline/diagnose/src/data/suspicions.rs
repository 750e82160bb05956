//! Units and signs that the readings themselves call into doubt, each with the factor and the option that would correct it.
//!
//! A file that contradicts itself (two clocks, two speeds) is refused; values that no finger has are warned of. Every rule
//! looks for values that lie outside of the ranges that experiments on fingers have, so that correct files raise none.
//!
//! Main functions: [`suspicions`] (of measured runs), [`of_trace`] (of forces alone).

use fingerpad_formats::significant;

use crate::data::csv_text::short;
use crate::data::median;
use crate::data::runs::{Run, RunSet};
use crate::data::trace_csv::TraceRow;
use crate::error::DiagnoseError;
use crate::laws::{Column, Row};
use crate::schema::Caution;

/// A range of a column's values that is another unit's.
struct Rule {
    /// Column of the runs.
    column: Column,
    /// Values, as the median over runs, that have this unit.
    range: [f64; 2],
    /// The unit.
    unit: &'static str,
    /// What makes its values ours.
    conversion: &'static str,
    /// What the column has usually.
    usual: &'static str,
}

const fn rule(
    column: Column,
    range: [f64; 2],
    unit: &'static str,
    conversion: &'static str,
    usual: &'static str,
) -> Rule {
    Rule { column, range, unit, conversion, usual }
}

const SKIN: &str = "skin has 15 to 45 °C";
const WIDTH: &str = "fingertips are 8 to 30 mm wide";

const RULES: [Rule; 7] = [
    rule(Column::Temperature, [55.0, 200.0], "F", "subtracting 32 and the factor 5/9", SKIN),
    rule(Column::Temperature, [200.0, 400.0], "K", "subtracting 273.15", SKIN),
    rule(Column::Width, [0.9, 4.0], "cm", "the factor 10", WIDTH),
    rule(Column::Width, [0.3, 0.9], "in", "the factor 25.4", WIDTH),
    rule(Column::Width, [0.003, 0.05], "m", "the factor 1000", WIDTH),
    rule(Column::Width, [3e3, 5e4], "um", "the factor 0.001", WIDTH),
    rule(Column::Hydration, [1e-3, 1.3], "fraction", "the factor 130", "corneometers read 5 to 130 a.u."),
];

/// Normal force over depth that no fingertip has, N/mm, and gram-force has: the fingertip of the shipped model has 0.5 at
/// 0.9 mm, human fingertips stay below 5. Above it the forces are refused.
const GRAM_FORCE_N_PER_MM: [f64; 2] = [15.0, 100.0];
/// Friction over normal force beyond which one of them is in another unit.
const POSSIBLE_FRICTION: [f64; 2] = [0.01, 50.0];
/// Speed below which, and contact time above which, a clock that nothing contradicts is in milliseconds: mm/s and s.
const MILLISECONDS: [f64; 2] = [0.02, 600.0];

/// Median of the finite values.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    median::median(values.filter(|v| v.is_finite()))
}

fn caution(set: &RunSet, column: &str, text: &str) -> Caution {
    Caution {
        kind: "unit".into(),
        role: String::new(),
        column: column.into(),
        text: format!("{}: {column}: {text}", set.path.display()),
    }
}

/// What the readings of a set call into doubt; the role is left to the caller.
///
/// # Errors
/// [`DiagnoseError::Unusable`] for columns that contradict each other.
pub fn suspicions(set: &RunSet) -> Result<Vec<Caution>, DiagnoseError> {
    let clock_is_checked = clocks(set)?;
    speeds(set)?;
    let mut out: Vec<Caution> = if clock_is_checked { None } else { milliseconds(set) }.into_iter().collect();
    out.extend(RULES.iter().filter_map(|rule| out_of_range(set, rule)));
    out.extend(forces(set));
    Ok(out)
}

fn out_of_range(set: &RunSet, rule: &Rule) -> Option<Caution> {
    let value = median(set.runs.iter().map(|r| r.value(rule.column)))?;
    let [low, high] = rule.range;
    (value >= low && value < high).then(|| {
        let column = rule.column.name();
        let text = format!(
            "{} in the median of the runs, where {}; {} would make it plausible: is it in another unit? --unit {}={} \
             converts it.",
            significant(value, 3),
            rule.usual,
            rule.conversion,
            short(column),
            rule.unit
        );
        caution(set, column, &text)
    })
}

/// Units of time with their length in seconds.
const TIMES: [(&str, f64); 3] = [("ms", 1e-3), ("us", 1e-6), ("min", 60.0)];

/// Compares the clock with the columns that follow it. Returns whether one of them confirms it.
fn clocks(set: &RunSet) -> Result<bool, DiagnoseError> {
    let in_contact = |run: &Run| -> Option<(Row, Row)> {
        let first = run.rows.iter().find(|r| r.depth_mm > 0.0)?;
        let last = run.rows.iter().rev().find(|r| r.depth_mm > 0.0)?;
        Some((*first, *last))
    };
    let over = |of: fn(&Row) -> f64| {
        let ratio = |(a, b): (Row, Row)| (b.t_s - a.t_s) / (of(&b) - of(&a));
        median(set.runs.iter().filter_map(in_contact).map(ratio).filter(|r| *r > 0.0))
    };
    let hold = |run: &Run| -> Option<f64> {
        let deep = 0.98 * run.depth_mm();
        let from = run.rows.iter().find(|r| r.depth_mm >= deep)?;
        let to = run.rows.iter().position(|r| r.speed_mm_s > 0.0)?.checked_sub(1)?;
        let held_s = run.rows[to].t_s - from.t_s;
        (held_s > 0.0 && from.dwell_s > 0.0).then(|| held_s / from.dwell_s)
    };
    let columns = [
        ("contact_time_s", over(|r| r.contact_time_s), 1.02),
        ("occlusion_time_s", over(|r| r.occlusion_s), 1.02),
        ("dwell_s", median(set.runs.iter().filter_map(hold)), 2.0),
    ];
    for (column, ratio, within) in columns {
        let Some(ratio) = ratio else { continue };
        let is = |factor: f64| ratio < factor * within && ratio > factor / within;
        for (unit, seconds) in TIMES {
            let wrong = if is(1.0 / seconds) {
                "t_s"
            } else if is(seconds) {
                column
            } else {
                continue;
            };
            return Err(DiagnoseError::Unusable {
                path: set.path.clone(),
                problem: format!(
                    "line {}, columns t_s and {column}: t_s counts {} where {column} counts 1: {wrong} is in {unit}; \
                     --unit {}={unit} converts it",
                    set.runs[0].line,
                    significant(ratio, 3),
                    short(wrong)
                ),
            });
        }
    }
    // Without a column of its own the contact time is derived from the clock.
    let derived =
        |run: &Run| in_contact(run).is_some_and(|(a, b)| b.t_s - a.t_s == b.contact_time_s - a.contact_time_s);
    Ok(columns[1].1.is_some() || columns[2].1.is_some() || !set.runs.iter().all(derived))
}

/// Speed of a run by its positions and clock, mm/s.
fn speed_of_positions(run: &Run) -> Option<f64> {
    let sliding = (1..run.rows.len()).filter(|i| run.rows[*i].speed_mm_s > 0.0);
    median(sliding.map(|i| {
        let [x, y] = run.increment(i);
        x.hypot(y) / (run.rows[i].t_s - run.rows[i - 1].t_s)
    }))
}

/// Compares the speed that the file states with that of its positions.
fn speeds(set: &RunSet) -> Result<(), DiagnoseError> {
    let ratio = |run: &Run| Some(speed_of_positions(run)? / run.value(Column::Speed));
    let Some(ratio) = median(set.runs.iter().filter_map(ratio).filter(|r| *r > 0.0)) else { return Ok(()) };
    let is = |factor: f64| ratio < 1.3 * factor && ratio > factor / 1.3;
    let ways = [
        (1e-3, "--unit speed=um/s if the positions are right, --unit t=ms if the speed is"),
        (1e3, "--unit speed=m/s converts it"),
        (10.0, "--unit speed=cm/s converts it"),
    ];
    let Some((_, way)) = ways.iter().find(|(factor, _)| is(*factor)) else { return Ok(()) };
    Err(DiagnoseError::Unusable {
        path: set.path.clone(),
        problem: format!(
            "line {}, column speed_mm_s: positions and clock give {} times the speed that the column states: {way}",
            set.runs[0].line,
            significant(ratio, 3)
        ),
    })
}

/// A clock whose runs are slower and longer than those of experiments on fingers.
fn milliseconds(set: &RunSet) -> Option<Caution> {
    let speed = median(set.runs.iter().filter_map(speed_of_positions))?;
    let seconds = median(set.runs.iter().map(|run| {
        let mut times = run.rows.iter().filter(|r| r.depth_mm > 0.0).map(|r| r.t_s);
        let first = times.next().unwrap_or(f64::NAN);
        times.next_back().map_or(f64::NAN, |last| last - first)
    }))?;
    (speed < MILLISECONDS[0] && seconds > MILLISECONDS[1]).then(|| {
        let text = format!(
            "a run's contact lasts {} s in the median and the plate slides at {} mm/s; the factor 0.001 would make both \
             plausible: is the clock in ms? --unit t=ms converts it.",
            significant(seconds, 3),
            significant(speed, 2)
        );
        caution(set, "t_s", &text)
    })
}

/// Forces that gram-force would explain, and friction of another unit than the normal force.
fn forces(set: &RunSet) -> Vec<Caution> {
    let stiffness = |run: &Run| {
        let read = run.rows.iter().zip(&run.force_n).filter(|(_, f)| f[0].is_finite());
        let (row, force) = read.max_by(|a, b| a.0.depth_mm.total_cmp(&b.0.depth_mm))?;
        Some(force[0] / row.depth_mm)
    };
    let mut out = Vec::new();
    let [low, high] = GRAM_FORCE_N_PER_MM;
    if let Some(n_per_mm) = median(set.runs.iter().filter_map(stiffness)).filter(|v| *v >= low && *v < high) {
        let text = format!(
            "{} N per mm of depth in the median of the runs, where fingertips have 0.2 to 5; the factor 0.00981 would make \
             it plausible: are the forces in gram-force? --unit normal=gf,x=gf,y=gf converts them.",
            significant(n_per_mm, 2)
        );
        out.push(caution(set, "normal_force_n", &text));
    }
    let coefficient = |run: &Run| {
        let slides = |(row, _): &(&Row, &[f64; 3])| row.turn_mm > 1.0 && row.depth_mm > 0.0;
        median(run.rows.iter().zip(&run.force_n).filter(slides).map(|(_, f)| f[1].hypot(f[2]) / f[0].abs()))
    };
    let [low, high] = POSSIBLE_FRICTION;
    if let Some(ratio) = median(set.runs.iter().filter_map(coefficient)).filter(|v| !(*v >= low && *v < high)) {
        let text = format!(
            "friction is {} times the normal force in the median of the runs, where fingers have 0.1 to 5: are \
             normal_force_n and friction_x_n, friction_y_n in different units? --unit x=mN,y=mN, for example, converts them.",
            significant(ratio, 2)
        );
        out.push(caution(set, "friction_x_n", &text));
    }
    out
}

/// Largest force of a trace, its 95th percentile, that fingers on a force plate have, N.
const TRACE_N: [f64; 2] = [0.02, 50.0];

/// What a trace of forces alone calls into doubt, one sentence each.
pub fn of_trace(rows: &[TraceRow]) -> Vec<String> {
    let size = |f: &[f64; 3]| f.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mut sizes: Vec<f64> = rows.iter().map(|r| size(&r.force_n)).collect();
    sizes.sort_by(f64::total_cmp);
    let largest = sizes[sizes.len() * 19 / 20];
    let mut out = Vec::new();
    let [low, high] = TRACE_N;
    if largest < low {
        out.push(format!(
            "The forces reach {} N only, where fingers press with tenths of a newton and more; the factor 1000 would make \
             them plausible: are they in N already (no --unit), or in kN?",
            significant(largest, 2)
        ));
    } else if largest > high {
        out.push(format!(
            "The forces reach {} N; the factors 0.001 (mN) or 0.00981 (gram-force) would make them plausible: \
             --unit normal=mN,x=mN,y=mN or normal=gf,x=gf,y=gf converts them.",
            significant(largest, 3)
        ));
    }
    out.extend(exchanged_axes(rows, largest));
    out
}

/// A normal force that changes its sign in contact, beside a tangential one that is larger and never does.
fn exchanged_axes(rows: &[TraceRow], largest_n: f64) -> Option<String> {
    let firm: Vec<[f64; 3]> = rows
        .iter()
        .map(|r| r.force_n)
        .filter(|f| f.iter().map(|v| v * v).sum::<f64>().sqrt() > 0.3 * largest_n)
        .collect();
    if firm.len() < 20 {
        return None;
    }
    let count = firm.len() as f64;
    // Share of the firm rows with the sign that fewer of them have, and the median size.
    let fewer = |k: usize| {
        let up = firm.iter().filter(|f| f[k] > 0.0).count() as f64 / count;
        up.min(1.0 - up)
    };
    let middle = |k: usize| median(firm.iter().map(|f| f[k].abs())).unwrap_or(0.0);
    let other = [1, 2].into_iter().filter(|k| fewer(*k) < 0.02).max_by(|a, b| middle(*a).total_cmp(&middle(*b)))?;
    (fewer(0) > 0.1 && middle(other) > middle(0)).then(|| {
        let name = ["x", "y"][other - 1];
        format!(
            "The normal force has the other sign in {} % of the rows in firm contact, while {name} never changes its sign and is \
             larger: are the axes exchanged? --map gives each column its axis.",
            significant(100.0 * fewer(0), 2)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::checks::tests::set;
    use crate::data::runs::RawRow;

    /// Eight strokes with all state columns at usual values.
    fn usual(change: impl Fn(&mut RawRow)) -> RunSet {
        set(|row| {
            // A stroke a minute apart, a row each 0.1 s: 3 mm/s.
            row.t_s *= 0.1;
            row.contact_time_s = row.t_s;
            row.occlusion_time_s = row.t_s + 3.0;
            (row.hydration_au, row.temperature_c, row.finger_width_mm) = (35.0, 32.0, 16.0);
            change(row);
        })
    }

    #[test]
    fn usual_runs_raise_no_suspicion() {
        assert!(suspicions(&usual(|_| ())).unwrap().is_empty());
        assert!(suspicions(&set(|_| ())).unwrap().is_empty());
    }

    #[test]
    fn values_of_another_unit_are_told_with_their_factor_and_option() {
        type Change = fn(&mut RawRow);
        let cases: [(Change, &str, &str); 8] = [
            (|r| r.temperature_c += 273.15, "temperature_c", "--unit temperature=K"),
            (|r| r.temperature_c = 1.8 * r.temperature_c + 32.0, "temperature_c", "--unit temperature=F"),
            (|r| r.finger_width_mm *= 0.1, "finger_width_mm", "--unit finger_width=cm"),
            (|r| r.finger_width_mm *= 1e-3, "finger_width_mm", "--unit finger_width=m"),
            (|r| r.hydration_au /= 130.0, "hydration_au", "--unit hydration=fraction"),
            (|r| r.force_n = r.force_n.map(|f| 101.97 * f), "normal_force_n", "--unit normal=gf,x=gf,y=gf"),
            (|r| (r.force_n[1], r.force_n[2]) = (1e3 * r.force_n[1], 1e3 * r.force_n[2]), "friction_x_n", "mN"),
            (
                |r| {
                    r.t_s *= 1e4;
                    (r.contact_time_s, r.occlusion_time_s) = (f64::NAN, f64::NAN);
                },
                "t_s",
                "--unit t=ms",
            ),
        ];
        for (change, column, said) in cases {
            let found = suspicions(&usual(change)).unwrap();
            assert_eq!(found.len(), 1, "{said}: {found:?}");
            assert!(found[0].column == column && found[0].text.contains(said), "{found:?}");
        }
    }

    #[test]
    fn columns_that_contradict_the_clock_are_refused() {
        type Change = fn(&mut RawRow);
        let cases: [(Change, &str); 4] = [
            (|r| r.t_s *= 1e3, "contact_time_s counts 1: t_s is in ms; --unit t=ms"),
            (|r| r.contact_time_s *= 1e3, "contact_time_s is in ms; --unit contact_time=ms"),
            (
                |r| (r.t_s, r.contact_time_s) = (1e3 * r.t_s, 1e3 * r.contact_time_s),
                "occlusion_time_s counts 1: t_s is in ms",
            ),
            (|r| r.speed_mm_s = 3000.0, "--unit speed=um/s"),
        ];
        for (change, said) in cases {
            let message = suspicions(&usual(change)).unwrap_err().to_string();
            assert!(message.contains(said), "{message}");
        }
    }

    #[test]
    fn forces_alone_in_another_unit_or_on_other_axes_are_told() {
        // A finger that presses with 0.5 to 1.5 N and moves in circles.
        let trace = |of: fn([f64; 3]) -> [f64; 3]| -> Vec<TraceRow> {
            let row = |i: i32| {
                let angle = 0.1 * f64::from(i);
                let normal = 1.0 + 0.5 * (0.03 * f64::from(i)).sin();
                TraceRow { t_s: 0.01 * f64::from(i), force_n: of([normal, 0.6 * angle.cos(), 0.6 * angle.sin()]) }
            };
            (0..400).map(row).collect()
        };
        assert!(of_trace(&trace(|f| f)).is_empty());
        for (of, said) in [
            ((|f| f.map(|v| 1e-3 * v)) as fn([f64; 3]) -> [f64; 3], "in N already"),
            (|f| f.map(|v| 1e3 * v), "normal=mN"),
            (|[n, x, y]| [x, n, y], "axes exchanged"),
            (|[n, x, y]| [y, x, n], "y never changes its sign"),
        ] {
            let found = of_trace(&trace(of));
            assert!(found.len() == 1 && found[0].contains(said), "{said}: {found:?}");
        }
    }
}
