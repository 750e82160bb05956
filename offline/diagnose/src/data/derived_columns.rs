//! Columns of a file of laws that are computed from other ones: a derivative over time, or an earlier value.
//!
//! They are computed from the rows that are kept of a run, between which a column changes linearly. A row whose source is not known has
//! none. Main function: [`compute_derived`].

use fingerpad::effects::tables;
use fingerpad_formats::significant;

use crate::data::runs::{Run, RunSet};
use crate::error::DiagnoseError;
use crate::laws::drivers::{Derived, Rule};
use crate::laws::{OWN, OwnColumn, Row};

/// Fills in the computed columns of all runs.
///
/// # Errors
/// [`DiagnoseError::Unusable`] with run, time and value where one leaves the range in which its formulas hold.
pub fn compute_derived(set: &mut RunSet, own: &[OwnColumn]) -> Result<(), DiagnoseError> {
    let computed =
        own.iter().take(OWN).enumerate().filter_map(|(place, column)| Some((place, column, column.derived?)));
    for (place, column, derived) in computed {
        for run in &mut set.runs {
            let values = values(&run.rows, derived);
            let [low, high] = column.range;
            if let Some(row) = values.iter().position(|v| *v < low || *v > high) {
                return Err(DiagnoseError::Unusable {
                    path: set.path.clone(),
                    problem: beyond(run, row, values[row], column),
                });
            }
            run.rows.iter_mut().zip(values).for_each(|(row, value)| row.own[place] = value);
        }
    }
    Ok(())
}

fn beyond(run: &Run, row: usize, value: f64, column: &OwnColumn) -> String {
    let [low, high] = column.range;
    format!(
        "run `{}` from line {}, at t_s {}: the computed column `{}` is {} and outside {low} to {high} {}, the range in the file of laws",
        run.labels.run,
        run.line,
        significant(run.rows[row].t_s, 8),
        column.name,
        significant(value, 6),
        column.unit
    )
}

/// The values of a computed column in each row.
fn values(rows: &[Row], Derived { source, rule }: Derived) -> Vec<f64> {
    let known: Vec<(f64, f64)> =
        rows.iter().map(|row| (row.t_s, tables::driver(source, row).unwrap_or(f64::NAN))).collect();
    match rule {
        Rule::Rate => (0..known.len()).map(|i| slope(&known, i)).collect(),
        Rule::Delayed(delay_s) => known.iter().map(|(t_s, _)| at(&known, t_s - delay_s)).collect(),
    }
}

/// Derivative over time in a row: that of the parabola through it and the rows on either side, at an end that of the straight line.
fn slope(known: &[(f64, f64)], i: usize) -> f64 {
    let rate = |(a, from): (f64, f64), (b, to): (f64, f64)| if b > a { (to - from) / (b - a) } else { 0.0 };
    let here = known[i];
    match (i.checked_sub(1).map(|k| known[k]), known.get(i + 1).copied()) {
        (Some(before), Some(after)) => {
            let (left, right) = (here.0 - before.0, after.0 - here.0);
            let share = if left + right > 0.0 { left / (left + right) } else { 0.5 };
            (1.0 - share) * rate(before, here) + share * rate(here, after)
        }
        (Some(before), None) => rate(before, here),
        (None, Some(after)) => rate(here, after),
        (None, None) => 0.0,
    }
}

/// The value at a time, linear between rows; before the first row that one's.
fn at(known: &[(f64, f64)], t_s: f64) -> f64 {
    let after = known.partition_point(|(t, _)| *t < t_s);
    match (after.checked_sub(1).map(|k| known[k]), known.get(after)) {
        (Some((a, from)), Some((b, to))) => from + (to - from) * (t_s - a) / (b - a),
        (None, Some((_, value))) => *value,
        (Some((_, value)), None) => value,
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::column_map::ColumnMap;
    use crate::data::runs_csv;
    use crate::laws::LawsFile;
    use crate::test_file;

    const LAWS: &str = "[[column]]\nname = \"voltage_v\"\nunit = \"V\"\nrange = [0, 200]\n\n\
        [[column]]\nname = \"voltage_rate\"\nunit = \"V/s\"\nrange = [-500, 500]\nrate_of = \"voltage_v\"\n\n\
        [[column]]\nname = \"late_v\"\nunit = \"V\"\nrange = [0, 200]\ndelayed = \"voltage_v\"\ndelay_s = 0.25\n\n\
        [[law]]\nname = \"mine\"\nacts_on = \"strength\"\nformula = \"gain * late_v / 100 * exp(-(voltage_rate / 100)^2)\"\n\
        parameter = [{ name = \"gain\", unit = \"\", range = [0, 1], typical = 0.1 }]\n";

    /// 60 rows of 0.1 s, the plate turns back at 3.03 s; the voltage is `volts(t)`.
    fn read(volts: impl Fn(f64) -> f64) -> Result<RunSet, String> {
        let laws = LawsFile::parse("mine.toml".as_ref(), LAWS).unwrap();
        let mut text =
            "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n,voltage_v\n".to_owned();
        for i in 0..60 {
            let t = 0.1 * f64::from(i);
            text += &format!("a,{t},{},{},0,0.5,0.2,0,{}\n", t.min(1.0), t.min(6.06 - t), volts(t));
        }
        let map = ColumnMap::parse_with(laws.columns, None, None, "").unwrap();
        runs_csv::read_mapped(&test_file(".csv", text.as_bytes()), &map, &mut |_| true).map_err(|e| e.to_string())
    }

    #[test]
    fn rates_and_delays_are_those_of_the_source() {
        let set = read(|t| 100.0 + 50.0 * t.sin()).unwrap();
        assert_eq!(set.recorded.iter().filter(|c| matches!(c, crate::laws::Column::Own { .. })).count(), 3);
        let rows = &set.runs[0].rows;
        // One row more than the file has: the turn.
        assert!(rows.len() == 61 && rows.iter().any(|row| (row.t_s - 3.03).abs() < 1e-6));
        for row in &rows[1..rows.len() - 1] {
            let [_, rate, late, _] = row.own;
            assert!((rate - 50.0 * row.t_s.cos()).abs() < 0.3, "{} {rate}", row.t_s);
            let expected = 100.0 + 50.0 * (row.t_s - 0.25).max(0.0).sin();
            assert!((late - expected).abs() < 0.2, "{} {late} {expected}", row.t_s);
        }
    }

    #[test]
    fn a_computed_value_beyond_its_range_is_refused_with_run_time_and_value() {
        let message = read(|t| if t > 2.0 { 200.0 } else { 0.0 }).unwrap_err();
        for word in ["run `a`", "t_s 2", "`voltage_rate`", "-500 to 500 V/s"] {
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn runs_without_the_source_are_refused_by_the_computed_column() {
        let laws = LawsFile::parse("mine.toml".as_ref(), LAWS).unwrap();
        let mut set = read(|_| 100.0).unwrap();
        set.recorded.clear();
        let message = crate::data::own_columns::require(&set, &laws).unwrap_err().to_string();
        assert!(message.contains("`late_v` is missing") && message.contains("what it is computed from"), "{message}");
    }

    #[test]
    fn contradictions_are_refused_with_their_line() {
        let refused = |from: &str, to: &str, words: &[&str]| {
            let text = LAWS.replace(from, to);
            assert_ne!(text, LAWS, "{from}");
            let message = LawsFile::parse("mine.toml".as_ref(), &text).unwrap_err().to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        };
        refused("unit = \"V/s\"", "unit = \"V\"", &["line 6", "contradictory units", "V s^-1"]);
        refused("rate_of = \"voltage_v\"", "rate_of = \"current_a\"", &["line 6", "`current_a` is neither"]);
        refused("delay_s = 0.25", "", &["line 12", "either rate_of, or delayed and delay_s"]);
        refused("delay_s = 0.25", "delay_s = -1", &["line 12", "delay_s -1"]);
        refused("delayed = \"voltage_v\"", "delayed = \"voltage_rate\"", &["line 12", "`voltage_rate` is neither"]);
    }

    /// A finger that is stiffer while it is released than while it is pressed gives back more work than it took.
    #[test]
    fn a_stiffness_that_depends_on_the_rate_of_depth_is_refused() {
        let text = "[[column]]\nname = \"press_mm_s\"\nunit = \"mm/s\"\nrange = [-20, 20]\nrate_of = \"depth_mm\"\n\n[[law]]\n\
            name = \"mine\"\nacts_on = \"TARGET\"\nformula = \"gain * press_mm_s / 10\"\n\
            parameter = [{ name = \"gain\", unit = \"\", range = [-0.3, 0.3], typical = 0.1 }]\n";
        let of = |target: &str| LawsFile::parse("mine.toml".as_ref(), &text.replace("TARGET", target));
        assert!(of("strength").is_ok());
        assert!(of("stiffness").unwrap_err().to_string().contains("free energy"));
    }
}
