//! Units by what fingers are like: a few lengths, forces and times of a file beside those of fingers, and beside those of the other file
//! of the same finger.
//!
//! Each yardstick is the logarithm of a median over runs, with a normal scatter between fingers and a narrower one between two files of
//! one finger. Every unit that a group of columns may have shifts some of them; the unit, and the file that has it, under which they
//! are most likely is proposed where it is far more likely than ours.
//!
//! Main function: [`check_units`].

use fingerpad_formats::significant;
use fingerpad_formats::unit::{Unit, units_of};

use crate::data::csv_text::short;
use crate::data::median::median;
use crate::data::runs::{Run, RunSet};
use crate::error::DiagnoseError;
use crate::schema::Caution;

/// A quantity by which files are compared.
struct Yardstick {
    /// What it is.
    words: &'static str,
    /// Its unit.
    unit: &'static str,
    /// Its middle value in fingers, the standard deviation of its logarithm between fingers, and between files of one finger.
    usual: [f64; 3],
    /// Its value in a run.
    of: fn(&Run) -> Option<f64>,
    /// Powers of depth, slide, normal force, friction and time in it.
    powers: [f64; 5],
}

/// Exponent of the normal force in the depth, roughly.
const EXPONENT: f64 = 1.7;

const YARDSTICKS: [Yardstick; 8] = [
    Yardstick {
        words: "the normal force at 1 mm of depth",
        unit: " N",
        usual: [0.6, 0.9, 0.35],
        of: |run| deepest(run).map(|(depth_mm, normal_n)| normal_n / depth_mm.powf(EXPONENT)),
        powers: [-EXPONENT, 0.0, 1.0, 0.0, 0.0],
    },
    Yardstick {
        words: "friction over normal force",
        unit: "",
        usual: [0.9, 0.9, 0.45],
        of: friction_over_normal,
        powers: [0.0, 0.0, -1.0, 1.0, 0.0],
    },
    Yardstick {
        words: "the path of the onset of sliding",
        unit: " mm",
        usual: [1.0, 1.2, 0.5],
        of: onset_mm,
        powers: [0.0, 1.0, 1.0, -1.0, 0.0],
    },
    Yardstick {
        words: "the depth of a run",
        unit: " mm",
        usual: [1.0, 0.8, 0.7],
        of: |run| deepest(run).map(|(depth_mm, _)| depth_mm),
        powers: [1.0, 0.0, 0.0, 0.0, 0.0],
    },
    Yardstick {
        words: "the normal force of a run",
        unit: " N",
        usual: [0.5, 1.2, 0.9],
        of: |run| deepest(run).map(|(_, normal_n)| normal_n),
        powers: [0.0, 0.0, 1.0, 0.0, 0.0],
    },
    Yardstick {
        words: "the speed of the plate",
        unit: " mm/s",
        usual: [4.0, 1.8, 1.5],
        of: speed_mm_s,
        powers: [0.0, 1.0, 0.0, 0.0, -1.0],
    },
    Yardstick {
        words: "the time in contact",
        unit: " s",
        usual: [5.0, 1.8, 1.2],
        of: contact_s,
        powers: [0.0, 0.0, 0.0, 0.0, 1.0],
    },
    Yardstick {
        words: "the path of a run",
        unit: " mm",
        usual: [5.0, 1.3, 1.0],
        of: |run| Some(path_mm(run)),
        powers: [0.0, 1.0, 0.0, 0.0, 0.0],
    },
];

/// Columns that share a unit, and what of depth, slide, normal force, friction and time they are.
const GROUPS: [(&[&str], [f64; 5]); 7] = [
    (&["depth_mm"], [1.0, 0.0, 0.0, 0.0, 0.0]),
    (&["slide_x_mm", "slide_y_mm"], [0.0, 1.0, 0.0, 0.0, 0.0]),
    (&["depth_mm", "slide_x_mm", "slide_y_mm"], [1.0, 1.0, 0.0, 0.0, 0.0]),
    (&["normal_force_n", "friction_x_n", "friction_y_n"], [0.0, 0.0, 1.0, 1.0, 0.0]),
    (&["normal_force_n"], [0.0, 0.0, 1.0, 0.0, 0.0]),
    (&["friction_x_n", "friction_y_n"], [0.0, 0.0, 0.0, 1.0, 0.0]),
    (&["t_s"], [0.0, 0.0, 0.0, 0.0, 1.0]),
];
/// Units that no logger of a finger writes.
const NOT_LOGGED: [&str; 2] = ["min", "nm"];

/// Gain in 2 log likelihood from which on a unit is proposed.
const PROPOSED: f64 = 4.0;
/// The same for a part of the forces of both files: a sensor has one unit, and only other fingers speak for another one.
const PROPOSED_FOR_A_PART: f64 = 9.0;
/// Gain from which on a file that has another unit than the other one is refused: two files of one finger are alike.
const REFUSED: f64 = 12.0;
/// Gain from which on two files of one unit are refused: no finger is like them.
const IMPOSSIBLE: f64 = 40.0;
/// Gains below the best one within which other units are named as well.
const AS_LIKELY: f64 = 3.0;
/// Factor of the normal force at one depth between two files of a finger from which on its gain is called into doubt.
const LARGEST_GAIN: f64 = 1.9;

/// Depth and normal force of the deepest row that has a reading.
fn deepest(run: &Run) -> Option<(f64, f64)> {
    let read = run.rows.iter().zip(&run.force_n).filter(|(row, force)| row.depth_mm > 0.0 && !force[0].is_nan());
    let (row, force) = read.max_by(|a, b| a.0.depth_mm.total_cmp(&b.0.depth_mm))?;
    Some((row.depth_mm, force[0].abs()))
}

fn path_mm(run: &Run) -> f64 {
    run.rows.iter().map(|row| row.path_mm).fold(0.0, f64::max)
}

/// Friction of a reading.
fn friction_n(force_n: &[f64; 3]) -> f64 {
    force_n[1].hypot(force_n[2])
}

/// Median of a function of the readings in the last third of the path.
fn at_the_end(run: &Run, of: impl Fn(&[f64; 3]) -> f64) -> Option<f64> {
    let from_mm = 2.0 / 3.0 * path_mm(run);
    let late = run.rows.iter().zip(&run.force_n).filter(|(row, _)| row.path_mm > from_mm && row.depth_mm > 0.0);
    median(late.map(|(_, force)| of(force)).filter(|v| v.is_finite()))
}

fn friction_over_normal(run: &Run) -> Option<f64> {
    at_the_end(run, |force| friction_n(force) / force[0].abs())
}

/// Path on which friction rises to half of its value at the end of the run, over the ratio of the forces there: a compliance, which the
/// friction coefficient does not change.
fn onset_mm(run: &Run) -> Option<f64> {
    let half_n = 0.5 * at_the_end(run, friction_n)?;
    let slides = |i: &usize| run.rows[*i].path_mm > 0.0 && friction_n(&run.force_n[*i]) >= half_n;
    let after = (1..run.rows.len()).find(slides)?;
    let [from_mm, to_mm] = [after - 1, after].map(|i| run.rows[i].path_mm);
    let [low_n, high_n] = [after - 1, after].map(|i| friction_n(&run.force_n[i]));
    let share = ((half_n - low_n) / (high_n - low_n)).clamp(0.0, 1.0);
    Some((from_mm + share * (to_mm - from_mm)) * run.force_n[after][0].abs() / half_n)
}

fn contact_s(run: &Run) -> Option<f64> {
    let mut times = run.rows.iter().filter(|row| row.depth_mm > 0.0).map(|row| row.t_s);
    let first = times.next()?;
    times.next_back().map(|last| last - first)
}

/// Speed of a run by its positions and clock, mm/s.
pub fn speed_mm_s(run: &Run) -> Option<f64> {
    let sliding = (1..run.rows.len()).filter(|i| run.rows[*i].speed_mm_s > 0.0);
    let speeds = sliding.map(|i| {
        let [x, y] = run.increment(i);
        x.hypot(y) / (run.rows[i].t_s - run.rows[i - 1].t_s)
    });
    median(speeds.filter(|v| v.is_finite()))
}

/// Logarithms of the yardsticks of a file; NaN where it does not show one.
type Measures = [f64; YARDSTICKS.len()];

fn measures(set: &RunSet) -> Measures {
    YARDSTICKS.each_ref().map(|yardstick| {
        let values = set.runs.iter().filter_map(yardstick.of).filter(|v| v.is_finite() && *v > 0.0);
        median(values).map_or(f64::NAN, f64::ln)
    })
}

/// Sum of the squares of the known ones.
fn known(squares: impl Iterator<Item = f64>) -> f64 {
    squares.filter(|v| v.is_finite()).map(|v| v * v).sum()
}

/// How far a file is from fingers, and two files from one another.
fn far_from_fingers(of: &Measures) -> f64 {
    known((0..of.len()).map(|i| {
        let [middle, sd, _] = YARDSTICKS[i].usual;
        (of[i] - middle.ln()) / sd
    }))
}

fn apart(a: &Measures, b: &Measures) -> f64 {
    known((0..a.len()).map(|i| (a[i] - b[i]) / YARDSTICKS[i].usual[2]))
}

/// A unit that columns may have in one of the files or in both.
struct Proposal {
    columns: &'static [&'static str],
    unit: &'static Unit,
    /// Whether the first and the second file have it.
    files: [bool; 2],
    gain: f64,
    /// Yardsticks of both files in that unit.
    converted: [Measures; 2],
}

fn in_unit(of: &Measures, powers: &[f64; 5], factor: f64) -> Measures {
    std::array::from_fn(|i| {
        let power: f64 = YARDSTICKS[i].powers.iter().zip(powers).map(|(a, b)| a * b).sum();
        of[i] + power * factor.ln()
    })
}

/// The units that make the files more likely, the likeliest first.
fn proposals(files: &[Measures; 2]) -> Vec<Proposal> {
    let far = |[a, b]: &[Measures; 2]| apart(a, b) + 0.5 * (far_from_fingers(a) + far_from_fingers(b));
    let as_they_are = far(files);
    let mut out = Vec::new();
    for (columns, powers) in GROUPS {
        for unit in units_of(columns[0]).skip(1).filter(|unit| !NOT_LOGGED.contains(&unit.name)) {
            for have in [[true, false], [false, true], [true, true]] {
                let of = |k: usize| if have[k] { in_unit(&files[k], &powers, unit.factor) } else { files[k] };
                let converted = [of(0), of(1)];
                out.push(Proposal { columns, unit, files: have, gain: as_they_are - far(&converted), converted });
            }
        }
    }
    out.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    out
}

/// Doubts about the units of two files of one finger, each with the option that converts them.
///
/// * `roles`: of the files, as `--unit` takes them
/// * `judged`: whether the units of the first file were judged before, beside another one
///
/// # Errors
/// [`DiagnoseError::Unusable`] where one file has another unit than the other one beyond doubt, or no finger is like them.
pub fn check_units(sets: [&RunSet; 2], roles: [&str; 2], judged: bool) -> Result<Option<Caution>, DiagnoseError> {
    let files = sets.map(measures);
    let mut all = proposals(&files);
    all.retain(|proposal| !(judged && proposal.files[0]));
    let is_proposed = |proposal: &&Proposal| {
        let is_part = matches!(proposal.columns, ["normal_force_n"] | ["friction_x_n", ..]);
        proposal.gain >= if is_part && proposal.files == [true, true] { PROPOSED_FOR_A_PART } else { PROPOSED }
    };
    let Some(best) = all.iter().find(is_proposed) else {
        return Ok(gain_of_sensor(sets, &files));
    };
    let alike = |other: &&Proposal| {
        other.gain > best.gain - AS_LIKELY && other.columns == best.columns && other.files == best.files
    };
    let options: Vec<String> = all.iter().filter(alike).map(|proposal| option(proposal, sets, roles)).collect();
    let options = options.join(" or ");
    let which = usize::from(!best.files[0]);
    let (columns, one) = (best.columns.join(", "), best.files != [true, true]);
    let said = evidence(best, &files, sets, which);
    let text = format!("{columns}: {said}: are they in another unit? {options} converts them.");
    if best.gain >= if one { REFUSED } else { IMPOSSIBLE } {
        let problem = format!("line {}, column {text}", sets[which].runs[0].line);
        return Err(DiagnoseError::Unusable { path: sets[which].path.clone(), problem });
    }
    let paths = if one {
        sets[which].path.display().to_string()
    } else {
        sets.map(|set| set.path.display().to_string()).join(" and ")
    };
    Ok(Some(caution(best.columns[0], format!("{paths}: {text}"))))
}

fn caution(column: &str, text: String) -> Caution {
    Caution { kind: "unit".into(), role: String::new(), column: column.into(), text }
}

/// The option that converts the columns, in the unit of the file: units that were given already are replaced.
fn option(proposal: &Proposal, sets: [&RunSet; 2], roles: [&str; 2]) -> String {
    let which = usize::from(!proposal.files[0]);
    let prefix = if proposal.files == [true, true] { String::new() } else { format!("{}:", roles[which]) };
    let of = |column: &&str| {
        let factor = proposal.unit.factor * sets[which].factor(column);
        let unit = units_of(column).find(|unit| (unit.factor / factor).ln().abs() < 0.01);
        format!(
            "{prefix}{}={}",
            short(column),
            unit.map_or_else(|| significant(factor, 3), |unit| unit.name.to_owned())
        )
    };
    format!("--unit {}", proposal.columns.iter().map(of).collect::<Vec<_>>().join(","))
}

/// The yardstick that the unit brings closest to the other file or to fingers: its value, what it is compared with, and its value in that
/// unit.
fn evidence(best: &Proposal, files: &[Measures; 2], sets: [&RunSet; 2], which: usize) -> String {
    let one = best.files != [true, true];
    let other = |i: usize| if one { files[1 - which][i] } else { YARDSTICKS[i].usual[0].ln() };
    let sd = |i: usize| YARDSTICKS[i].usual[if one { 2 } else { 1 }];
    let closer = |i: usize| {
        let square = |of: f64| ((of - other(i)) / sd(i)).powi(2);
        let gain = square(files[which][i]) - square(best.converted[which][i]);
        if gain.is_finite() { gain } else { f64::NEG_INFINITY }
    };
    let i = (0..YARDSTICKS.len()).max_by(|a, b| closer(*a).total_cmp(&closer(*b))).unwrap_or(0);
    let Yardstick { words, unit, .. } = YARDSTICKS[i];
    let number = |ln: f64| format!("{}{unit}", significant(ln.exp(), 3));
    let beside = if one { format!("in {}", sets[1 - which].path.display()) } else { "in fingers about".into() };
    format!(
        "{words} is {} in the median of the runs, {beside} {}, and {} with the factor {}",
        number(files[which][i]),
        number(other(i)),
        number(best.converted[which][i]),
        significant(best.unit.factor, 4)
    )
}

/// A factor between the normal forces of both files that is no unit's.
fn gain_of_sensor(sets: [&RunSet; 2], files: &[Measures; 2]) -> Option<Caution> {
    let gain = (files[1][0] - files[0][0]).exp();
    (!(1.0 / LARGEST_GAIN..=LARGEST_GAIN).contains(&gain)).then(|| {
        let text = format!(
            "{}: normal_force_n: at one depth it is {} times that of {} in the median of the runs, more than a finger changes: has the \
             sensor or its amplifier another gain, or is it another finger?",
            sets[1].path.display(),
            significant(gain, 3),
            sets[0].path.display()
        );
        caution("normal_force_n", text)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::checks::tests::set;
    use crate::data::runs::RawRow;

    const ROLES: [&str; 2] = ["calibration", "measured"];

    /// Eight strokes at 3 mm/s; with `other` those of a faster plate on a moister and softer finger.
    fn strokes(other: bool, change: impl Fn(&mut RawRow)) -> RunSet {
        set(|row| {
            row.t_s *= if other { 0.03 } else { 0.1 };
            let [stiffness, friction] = if other { [0.9, 1.1] } else { [1.0, 1.0] };
            row.force_n = [stiffness * row.force_n[0], friction * row.force_n[1], friction * row.force_n[2]];
            change(row);
        })
    }

    /// A row whose columns of a group stand in another unit.
    fn in_other_unit(row: &mut RawRow, columns: &[&str], factor: f64) {
        for column in columns {
            match *column {
                "depth_mm" => row.depth_mm /= factor,
                "slide_x_mm" => row.slide_mm[0] /= factor,
                "slide_y_mm" => row.slide_mm[1] /= factor,
                "normal_force_n" => row.force_n[0] /= factor,
                "friction_x_n" => row.force_n[1] /= factor,
                "friction_y_n" => row.force_n[2] /= factor,
                _ => row.t_s /= factor,
            }
        }
    }

    fn units() -> impl Iterator<Item = (&'static [&'static str], &'static Unit)> {
        GROUPS.into_iter().flat_map(|(columns, _)| {
            units_of(columns[0])
                .skip(1)
                .filter(|unit| !NOT_LOGGED.contains(&unit.name))
                .map(move |unit| (columns, unit))
        })
    }

    fn option_of(prefix: &str, columns: &[&str], unit: &str) -> String {
        columns.iter().map(|column| format!("{prefix}{}={unit}", short(column))).collect::<Vec<_>>().join(",")
    }

    #[test]
    fn a_unit_of_one_file_is_proposed_for_that_file() {
        let files = [strokes(false, |_| ()), strokes(true, |_| ())];
        assert_eq!(check_units([&files[0], &files[1]], ROLES, false).unwrap(), None);
        for (columns, unit) in units() {
            for which in [0, 1] {
                let turned = strokes(which == 1, |row| in_other_unit(row, columns, unit.factor));
                let mut sets = [&files[0], &files[1]];
                sets[which] = &turned;
                let message = check_units(sets, ROLES, false).unwrap_err().to_string();
                let option = format!("--unit {}", option_of(&format!("{}:", ROLES[which]), columns, unit.name));
                assert!(message.contains(&option), "{option}: {message}");
            }
        }
    }

    #[test]
    fn a_unit_of_both_files_is_proposed_and_beyond_doubt_refused() {
        for (columns, unit) in units() {
            let sets = [false, true].map(|other| strokes(other, |row| in_other_unit(row, columns, unit.factor)));
            let found = check_units([&sets[0], &sets[1]], ROLES, false);
            let option = format!("--unit {}", option_of("", columns, unit.name));
            // Where the first file was judged before, no unit of it is proposed again.
            if let Ok(Some(caution)) = check_units([&sets[0], &sets[1]], ROLES, true) {
                assert!(!caution.text.contains(&format!("{option} converts")), "{option}: {}", caution.text);
            }
            match found {
                Err(error) => assert!(error.to_string().contains(&option), "{option}: {error}"),
                Ok(Some(caution)) => assert!(caution.text.contains(&option), "{option}: {}", caution.text),
                // A quarter of the friction is that of an oiled finger.
                Ok(None) => assert_eq!((columns, unit.name), (&["friction_x_n", "friction_y_n"][..], "lbf")),
            }
        }
    }

    #[test]
    fn a_unit_that_was_given_is_replaced_by_the_right_one_and_a_gain_is_no_unit() {
        let calibration = strokes(false, |_| ());
        // A clock in us, read with --unit t=ms.
        let mut measured = strokes(true, |row| row.t_s *= 1e3);
        measured.factors = vec![("t_s".into(), 1e-3)];
        let message = check_units([&calibration, &measured], ROLES, false).unwrap_err().to_string();
        assert!(message.contains("--unit measured:t=us converts"), "{message}");
        let halved = strokes(true, |row| row.force_n = row.force_n.map(|f| 0.5 * f));
        let text = check_units([&calibration, &halved], ROLES, false).unwrap().unwrap().text;
        assert!(text.contains("at one depth it is 0.45 times") && text.contains("another gain"), "{text}");
    }
}
