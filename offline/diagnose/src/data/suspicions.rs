//! Units and signs that columns by themselves call into doubt, each with the factor and the option that would correct it.
//!
//! A file that contradicts itself (two clocks, two speeds) is refused; values that no finger has are warned of. Every rule
//! looks for values that lie outside of the ranges that experiments on fingers have, so that correct files raise none.
//!
//! Main functions: [`suspicions`] (of measured runs), [`of_trace`] (of forces alone).

use fingerpad_formats::significant;
use fingerpad_formats::unit::{Unit, units_of};

use crate::data::csv_text::short;
use crate::data::median;
use crate::data::runs::{Run, RunSet};
use crate::data::trace_csv::TraceRow;
use crate::data::yardsticks::speed_mm_s;
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
    clocks(set)?;
    speeds(set)?;
    Ok(RULES.iter().filter_map(|rule| out_of_range(set, rule)).collect())
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

/// Compares the clock with the columns that follow it.
fn clocks(set: &RunSet) -> Result<(), DiagnoseError> {
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
        for Unit { name: unit, factor: seconds, .. } in units_of("t_s").skip(1).copied() {
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
    Ok(())
}

/// Compares the speed that the file states with that of its positions.
fn speeds(set: &RunSet) -> Result<(), DiagnoseError> {
    let ratio = |run: &Run| Some(speed_mm_s(run)? / run.value(Column::Speed));
    let Some(ratio) = median(set.runs.iter().filter_map(ratio).filter(|r| *r > 0.0)) else { return Ok(()) };
    // What the factor of a column's unit does to the ratio.
    let ways = [("speed_mm_s", 1.0), ("t_s", 1.0), ("slide_x_mm", -1.0)].into_iter().flat_map(|(column, power)| {
        units_of(column).skip(1).map(move |unit| (column, unit.name, unit.factor.powf(power)))
    });
    let options: Vec<String> = ways
        .filter(|(_, _, factor)| (ratio / factor).ln().abs() < 1.3f64.ln())
        .map(|(column, unit, _)| match column {
            "slide_x_mm" => format!("--unit slide_x={unit},slide_y={unit}"),
            column => format!("--unit {}={unit}", short(column)),
        })
        .collect();
    if options.is_empty() {
        return Ok(());
    }
    Err(DiagnoseError::Unusable {
        path: set.path.clone(),
        problem: format!(
            "line {}, column speed_mm_s: positions and clock give {} times the speed that the column states: {}, whichever column is in \
             that unit, converts it",
            set.runs[0].line,
            significant(ratio, 3),
            options.join(" or ")
        ),
    })
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
    out.extend(clock_of_trace(rows));
    out.extend(exchanged_axes(rows, largest));
    out
}

/// Steps between rows that a trace of a moving finger has, s.
const TRACE_STEP_S: [f64; 2] = [5e-5, 0.3];

/// A clock whose steps are longer than those of a moving finger's log.
fn clock_of_trace(rows: &[TraceRow]) -> Option<String> {
    let step_s = median(rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).filter(|step| *step > 0.0))?;
    let [least_s, most_s] = TRACE_STEP_S;
    let fits = |unit: &&Unit| (least_s..most_s).contains(&(step_s * unit.factor));
    let unit = units_of("t_s").skip(1).find(fits).filter(|_| step_s > most_s)?;
    Some(format!(
        "The rows are {} s apart; the factor {} would make that plausible: is the clock in {name}? --unit t={name} converts it.",
        significant(step_s, 3),
        unit.factor,
        name = unit.name
    ))
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
        let cases: [(Change, &str, &str); 5] = [
            (|r| r.temperature_c += 273.15, "temperature_c", "--unit temperature=K"),
            (|r| r.temperature_c = 1.8 * r.temperature_c + 32.0, "temperature_c", "--unit temperature=F"),
            (|r| r.finger_width_mm *= 0.1, "finger_width_mm", "--unit finger_width=cm"),
            (|r| r.finger_width_mm *= 1e-3, "finger_width_mm", "--unit finger_width=m"),
            (|r| r.hydration_au /= 130.0, "hydration_au", "--unit hydration=fraction"),
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
        let cases: [(Change, &str); 7] = [
            (|r| r.t_s *= 1e9, "contact_time_s counts 1: t_s is in ns; --unit t=ns"),
            (|r| r.t_s *= 1e3, "contact_time_s counts 1: t_s is in ms; --unit t=ms"),
            (|r| r.contact_time_s *= 1e3, "contact_time_s is in ms; --unit contact_time=ms"),
            (
                |r| (r.t_s, r.contact_time_s) = (1e3 * r.t_s, 1e3 * r.contact_time_s),
                "occlusion_time_s counts 1: t_s is in ms",
            ),
            (|r| r.speed_mm_s = 3000.0, "--unit speed=um/s or --unit t=ms or --unit slide_x=m,slide_y=m"),
            (|r| r.speed_mm_s = 30.0, "--unit slide_x=cm,slide_y=cm"),
            (|r| r.speed_mm_s = 76.2, "--unit slide_x=in,slide_y=in"),
        ];
        for (change, said) in cases {
            let message = suspicions(&usual(change)).unwrap_err().to_string();
            assert!(message.contains(said), "{message}");
        }
    }

    #[test]
    fn forces_alone_in_another_unit_or_on_another_clock_or_axes_are_told() {
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
        for (unit, factor) in [("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
            let mut rows = trace(|f| f);
            rows.iter_mut().for_each(|row| row.t_s *= factor);
            let found = of_trace(&rows);
            assert!(found.len() == 1 && found[0].contains(&format!("--unit t={unit} converts")), "{unit}: {found:?}");
        }
    }
}
