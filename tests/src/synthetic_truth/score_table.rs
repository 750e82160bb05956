//! The score as a table: counts with Wilson's 95 % intervals against what must pass and what is to be reached.
//!
//! Main function: [`table`].

use std::fmt::Write as _;

use fingerpad_diagnose::Rate;

use super::score::{Class, LagScored};
use super::score_sets::{Kind, NOISE, Outcome, Practice, ScoreSet};
use super::sets::Wanted;
use super::simulator::SimulatorKind;

/// How a number stands to its aims; `more`: whether more is better.
fn verdict(value: f64, [pass, reach]: [f64; 2], more: bool) -> &'static str {
    let beyond = |aim: f64| if more { value >= aim } else { value <= aim };
    match (beyond(reach), beyond(pass)) {
        (true, _) => "reached",
        (_, true) => "passes",
        _ => "misses",
    }
}

fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

const HEADING: &str = "| what | count | value (95 % interval) | pass | reach | |\n|---|---|---|---|---|---|\n";

type Choice<'a> = &'a dyn Fn(&Outcome) -> bool;

/// A row of a share: `hits` of those chosen; no row without a set.
fn share(out: &mut String, what: &str, list: &[&Outcome], hit: Choice<'_>, aims: [f64; 2], more: bool) {
    let of = list.len();
    if of == 0 {
        return;
    }
    let hits = list.iter().filter(|o| hit(o)).count();
    let value = hits as f64 / of as f64;
    let [low, high] = Rate::of(hits, of).ci95.map(|x| 100.0 * x);
    let [pass, reach] = aims.map(|x| 100.0 * x);
    let _ = writeln!(
        out,
        "| {what} | {hits} of {of} | {:.1} % ({low:.1} to {high:.1}) | {pass} % | {reach} % | {} |",
        100.0 * value,
        verdict(value, aims, more)
    );
}

/// A row of a number of which less is better.
fn number(out: &mut String, what: &str, values: Vec<f64>, at: f64, scale: f64, aims: [f64; 2]) {
    let of = values.len();
    if of == 0 {
        return;
    }
    let value = quantile(values, at) * scale;
    let [pass, reach] = aims;
    let _ = writeln!(out, "| {what} | {of} sets | {value:.3} | {pass} | {reach} | {} |", verdict(value, aims, false));
}

fn single(o: &Outcome) -> bool {
    o.set.kind() == Kind::Single
}

/// Whether the library does not have what is hidden, or the files not its column.
fn outside(o: &Outcome) -> bool {
    matches!(o.set.kind(), Kind::Outside | Kind::Unrecorded)
}

/// Whether the files could be read and all that was hidden was named, nothing else.
fn exact(o: &Outcome) -> bool {
    o.class == Class::Exact
}

/// The whole table over what has been judged, then its parts by simulator and practice, then what missed.
pub fn table(all: &[Outcome]) -> String {
    let of = |f: &dyn Fn(&Outcome) -> bool| all.iter().filter(|o| f(o)).collect::<Vec<&Outcome>>();
    let mut out = format!("{} sets judged\n\n{HEADING}", all.len());
    for (what, size, aims) in
        [("10 %", 0.10, [0.98, 0.995]), ("30 %", 0.30, [0.98, 0.995]), ("3 %", 0.03, [0.85, 0.92])]
    {
        let list = of(&|o| single(o) && o.set.of.size == size && o.required());
        share(&mut out, &format!("{what}, required, named alone"), &list, &exact, aims, true);
    }
    let nothing = of(&|o| o.set.kind() == Kind::Nothing && o.class != Class::Refused);
    share(&mut out, "false alarm", &nothing, &is_alarm, [0.01, 0.0], false);
    let named = of(&|o| !outside(o) && o.class != Class::Refused);
    share(&mut out, "wrong lone name", &named, &|o| o.class == Class::Wrong, [0.005, 0.0], false);
    for (size, aims) in [(0.30, [0.95, 0.99]), (0.10, [0.85, 0.92])] {
        let list = of(&|o| o.set.kind() == Kind::Pair && o.set.of.size == size);
        share(&mut out, &format!("pairs, {:.0} %, both named", 100.0 * size), &list, &exact, aims, true);
    }
    for (what, kind) in [("outside the library", Kind::Outside), ("driver not recorded", Kind::Unrecorded)] {
        let what = format!("{what}, required, unexplained");
        let list = of(&|o| o.set.kind() == kind && o.required());
        share(&mut out, &what, &list, &|o| o.class == Class::Unexplained, [0.95, 0.99], true);
    }
    let ten = of(&|o| single(o) && o.set.of.size == 0.10 && o.required() && exact(o) && o.amplitude_error.is_some());
    let errors: Vec<f64> = ten.iter().filter_map(|o| o.amplitude_error).collect();
    // Half of normal errors are below 0.6745 standard deviations, nine tenths below 1.645.
    let by_oracle = |z: f64| ten.iter().filter_map(|o| o.oracle_amplitude_sd).map(|sd| z * sd).collect::<Vec<f64>>();
    number(&mut out, "amplitude error at 10 %, median, %", errors.clone(), 0.5, 100.0, [5.0, 3.0]);
    // A hidden law of another form has no such amplitude: what is fitted is that of the nearest law of the library.
    let exact_forms = ten.iter().filter(|o| o.covered.is_some()).filter_map(|o| o.amplitude_error).collect();
    number(
        &mut out,
        "of it sets whose hidden law has the library's form, median, %",
        exact_forms,
        0.5,
        100.0,
        [5.0, 3.0],
    );
    number(&mut out, "amplitude error at 10 %, 90th percentile, %", errors, 0.9, 100.0, [20.0, 12.0]);
    // Nine tenths of normal errors of such a standard deviation are below a fifth.
    let can_tell = |o: &&&Outcome| o.oracle_amplitude_sd.is_some_and(|sd| 1.645 * sd < 0.2);
    let errors: Vec<f64> = ten.iter().filter(can_tell).filter_map(|o| o.amplitude_error).collect();
    for (what, at, aims) in [("median", 0.5, [5.0, 3.0]), ("90th percentile", 0.9, [20.0, 12.0])] {
        let what = format!("of it sets of which the oracle's own 90th percentile is below 20 %, {what}, %");
        number(&mut out, &what, errors.clone(), at, 100.0, aims);
    }
    let best = quantile(by_oracle(0.6745), 0.5) * 100.0;
    if !ten.is_empty() {
        let what = "the same of the oracle, which is given the finger, median, %";
        let _ = writeln!(out, "| {what} | {} sets | {best:.3} | | | |", ten.len());
    }
    let covered = of(&|o| single(o) && exact(o) && o.covered.is_some());
    share(&mut out, "95 % intervals cover, exact forms", &covered, &|o| o.covered == Some(true), [0.93, 0.95], true);
    let after: Vec<f64> =
        of(&|o| single(o) && exact(o) && o.required()).iter().filter_map(|o| o.held_out.map(|h| h[1])).collect();
    number(&mut out, "held-out over floor, median", after.clone(), 0.5, 1.0, [1.07, 1.03]);
    number(&mut out, "held-out over floor, 90th percentile", after, 0.9, 1.0, [1.25, 1.15]);
    settled(&mut out, all);
    let read = of(&|o| o.class != Class::Refused);
    let promises: [(&str, Choice<'_>); 3] = [
        ("a name whose amplitude's interval holds zero", &|o| o.broken.name_without_amplitude),
        ("`none` with significant evidence", &|o| o.broken.none_with_evidence),
        ("scatter above twice the expected, silent", &|o| o.broken.silent_scatter),
    ];
    for (what, broken) in promises {
        share(&mut out, what, &read, broken, [0.0, 0.0], false);
    }
    let sixty = of(&|o| o.set.of.runs == 60 && o.class != Class::Refused);
    for (what, seconds) in
        [("page and all pictures", (|o| o.seconds_with_page) as fn(&Outcome) -> f64), ("no pictures", |o| o.seconds)]
    {
        let what = format!("60 runs x 30 rows, {what}, median of one core's time, s");
        number(&mut out, &what, sixty.iter().map(|o| seconds(o)).collect(), 0.5, 1.0, [0.3, 0.1]);
    }
    out + &parts(all) + &by_level(all) + &instruments(all) + &misses(all)
}

/// Whether a set without an effect has a name. Naming a lag of the measured runs or what the finger does in all files is right.
fn is_alarm(o: &Outcome) -> bool {
    !matches!(o.class, Class::Nothing | Class::Exact | Class::OfFinger)
}

/// Single effects by size and level of confounding.
fn by_level(all: &[Outcome]) -> String {
    let mut out = "\n| size, level | required, named alone | all: exact, ambiguous with the truth, nothing, part or extra, unexplained, wrong | held-out over floor, median |\n|---|---|---|---|\n".to_owned();
    for (size, level) in [0.03, 0.10, 0.30].into_iter().flat_map(|size| [0, 1, 2].map(|level| (size, level))) {
        let cell: Vec<&Outcome> =
            all.iter().filter(|o| single(o) && o.set.of.size == size && o.set.of.level == level).collect();
        if cell.is_empty() {
            continue;
        }
        let count = |classes: &[Class]| cell.iter().filter(|o| classes.contains(&o.class)).count();
        let required: Vec<&&Outcome> = cell.iter().filter(|o| o.required()).collect();
        let held_out = |k: usize| quantile(cell.iter().filter_map(|o| o.held_out.map(|h| h[k])).collect(), 0.5);
        let _ = writeln!(
            out,
            "| {:.0} %, {level} | {} of {} | {}, {}, {}, {}, {}, {} | {:.2} -> {:.2} |",
            100.0 * size,
            required.iter().filter(|o| exact(o)).count(),
            required.len(),
            count(&[Class::Exact]),
            count(&[Class::AmbiguousWithTruth]),
            count(&[Class::Nothing]),
            count(&[Class::Part, Class::Extra]),
            count(&[Class::Unexplained]),
            count(&[Class::Wrong, Class::AmbiguousWithout]),
            held_out(0),
            held_out(1)
        );
    }
    out
}

/// What was found of the sensor and of the laboratory: lags, spikes, noise; and laws of the finger itself.
fn instruments(all: &[Outcome]) -> String {
    let mut out = String::new();
    let found: Vec<_> = all.iter().filter_map(|o| o.lag).collect();
    if !found.is_empty() {
        let mean = |of: &dyn Fn(&LagScored) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
        let _ = writeln!(
            out,
            "\nlag of the forces: found in {} of {} sets; found less true {:.2} ms in the mean, {:.2} ms RMS; 95 % interval +-{:.2} ms, covers {}",
            found.len(),
            all.len(),
            1e3 * mean(&|l| l.error_s),
            1e3 * mean(&|l| l.error_s.powi(2)).sqrt(),
            1e3 * mean(&|l| l.half_s),
            found.iter().filter(|l| l.covered).count()
        );
    }
    let nothing: Vec<&Outcome> = all.iter().filter(|o| o.set.kind() == Kind::Nothing).collect();
    let count = |hit: Choice<'_>| nothing.iter().filter(|o| hit(o)).count();
    let _ = writeln!(
        out,
        "\n{} sets without an effect: laws that the finger follows in all files named in {}; note about spikes in {}, as a red warning in {}",
        nothing.len(),
        count(&|o| o.class == Class::OfFinger),
        count(&|o| o.spikes[0]),
        count(&|o| o.spikes[1])
    );
    for (k, what) in NOISE.iter().enumerate() {
        let at = |share| quantile(all.iter().filter_map(|o| o.noise.map(|n| n[k])).collect(), share);
        let [low, middle, high] = [0.25, 0.5, 0.75].map(at);
        let _ = writeln!(out, "variance of {what} found over hidden: quartiles {low:.2}, {middle:.2}, {high:.2}");
    }
    out
}

/// Whether a plan that keeps its constraints settled a set.
fn is_settled(o: &Outcome) -> bool {
    o.plan_kept == Some(true) && o.settled == Some(Class::Exact)
}

/// The row of the ambiguous sets.
fn settled(out: &mut String, all: &[Outcome]) {
    let planned: Vec<&Outcome> = all.iter().filter(|o| o.plan_kept.is_some()).collect();
    let what = "ambiguous, settled by a plan that keeps its constraints";
    share(out, what, &planned, &is_settled, [0.90, 0.95], true);
}

/// The ambiguous sets alone: how many a plan settled, and each of them with its plan.
pub fn settling(all: &[Outcome]) -> String {
    let mut out = format!("{} sets judged\n\n{HEADING}", all.len());
    settled(&mut out, all);
    for o in all.iter().filter(|o| o.plan_kept.is_some()) {
        let _ = writeln!(
            out,
            "\n{}: {:?}, plan {:?} kept {:?}, oracle {:.0?}\n  hidden {}\n  {}\n  with the plan: {}",
            named(&o.set),
            o.settled,
            o.plan,
            o.plan_kept,
            o.oracle.unwrap_or_default(),
            o.hidden.join(", "),
            o.found.join("; "),
            o.found_with_plan.join("; ")
        );
    }
    out
}

/// The shares by simulator and practice.
fn parts(all: &[Outcome]) -> String {
    let mut out = "\n| simulator, practice | 10 and 30 %, required | 3 %, required | false alarms | wrong lone names | outside, not recorded | refused |\n|---|---|---|---|---|---|---|\n".to_owned();
    let mut seen: Vec<(SimulatorKind, Practice)> = Vec::new();
    for o in all {
        let here = (o.set.of.simulator, o.set.practice);
        seen.extend((!seen.contains(&here)).then_some(here));
    }
    seen.sort_by_key(|here| format!("{here:?}"));
    for (simulator, practice) in seen {
        let here = |o: &&Outcome| (o.set.of.simulator, o.set.practice) == (simulator, practice);
        let part = |chosen: Choice<'_>, hit: Choice<'_>| {
            let list: Vec<&Outcome> = all.iter().filter(here).filter(|o| chosen(o)).collect();
            format!("{} of {}", list.iter().filter(|o| hit(o)).count(), list.len())
        };
        let single = |o: &Outcome| single(o) && o.required();
        let read = |o: &Outcome| o.class != Class::Refused;
        let cells = [
            part(&|o| single(o) && o.set.of.size > 0.05, &exact),
            part(&|o| single(o) && o.set.of.size < 0.05, &exact),
            part(&|o| o.set.kind() == Kind::Nothing && read(o), &is_alarm),
            part(&|o| !outside(o) && read(o), &|o| o.class == Class::Wrong),
            part(&|o| outside(o) && o.required(), &|o| o.class == Class::Unexplained),
            part(&|_| true, &|o| !read(o)),
        ];
        let _ = writeln!(out, "| {simulator:?}, {practice:?} | {} |", cells.join(" | "));
    }
    out
}

/// What identifies a set: its seed, and what was hidden how and in how many runs.
fn named(set: &ScoreSet) -> String {
    let ScoreSet { practice, of: Wanted { seed, simulator, size, level, runs, .. } } = set;
    format!("{seed} {simulator:?} {practice:?} {:.0} % level {level} runs {runs}", 100.0 * size)
}

/// Each set that is not as wanted.
fn misses(all: &[Outcome]) -> String {
    let mut out = "\nNot as wanted:\n".to_owned();
    for o in all {
        let wanted = match o.set.kind() {
            Kind::Nothing => !is_alarm(o) || o.class == Class::Refused,
            Kind::Single => (o.class == Class::Exact || !o.required()) && o.class != Class::Wrong,
            Kind::Pair => o.class == Class::Exact,
            Kind::Outside | Kind::Unrecorded => o.class == Class::Unexplained || !o.required(),
        };
        if !wanted || (o.plan_kept.is_some() && !is_settled(o)) {
            let _ = writeln!(
                out,
                "{} {:?} settled {:?} | {} | {} | oracle {:.0?}",
                named(&o.set),
                o.class,
                o.settled,
                o.hidden.join(", "),
                o.found.join("; "),
                o.oracle.unwrap_or_default()
            );
        }
    }
    out
}
