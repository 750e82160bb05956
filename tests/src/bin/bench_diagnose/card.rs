//! The score card of one protocol.

use std::collections::BTreeMap;

use fingerpad_tests::synthetic_truth::effects::{LIBRARY, OUTSIDE};
use fingerpad_tests::synthetic_truth::score::Class;
use fingerpad_tests::synthetic_truth::sets::Hide;

use crate::{Args, Done};

fn name(hide: Hide) -> String {
    match hide {
        Hide::Nothing => "nothing".into(),
        Hide::Law(i) => LIBRARY[i].0.into(),
        Hide::Pair(i, j) => format!("{} + {}", LIBRARY[i].0, LIBRARY[j].0),
        Hide::Outside(i) => OUTSIDE[i].into(),
        Hide::Unrecorded(i) => format!("{} (unrecorded)", LIBRARY[i].0),
    }
}

fn percent(hits: usize, of: usize) -> String {
    if of == 0 { "-".into() } else { format!("{:.0} % ({hits} of {of})", 100.0 * hits as f64 / of as f64) }
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

type Sets<'a> = Vec<&'a Done>;

fn of<'a>(done: &'a [Done], kind: &str) -> Sets<'a> {
    done.iter().filter(|d| d.job.kind == kind).collect()
}

fn count(list: &[&Done], f: &dyn Fn(&Done) -> bool) -> usize {
    list.iter().filter(|d| f(d)).count()
}

fn wrong(d: &Done) -> bool {
    d.scored.class == Class::Wrong
}

/// Sets whose hidden effect alone was named.
fn right(done: &[Done]) -> Sets<'_> {
    of(done, "single").into_iter().filter(|d| d.scored.class == Class::Exact).collect()
}

/// The same with the form of the library's law and an interval.
fn exact(done: &[Done]) -> Sets<'_> {
    right(done).into_iter().filter(|d| d.exact_form && d.scored.covered.is_some()).collect()
}

/// Prints the card.
pub fn card(done: &[Done], args: &Args) {
    println!("{} sets; seeds {} ..", done.len(), done.first().map_or(0, |d| d.job.seed));
    println!(
        "required: an oracle with the simulator's tangents separates it from nothing by 40 and from any other family by 25"
    );
    by_size_and_level(done);
    singles(done);
    lags(done);
    without_effect(done);
    pairs_and_others(done);
    let mut times: Vec<f64> = done.iter().map(|d| d.scored.seconds).collect();
    println!(
        "\na diagnosis: median {:.2} s, p90 {:.2} s of processor time",
        quantile(&mut times, 0.5),
        quantile(&mut times, 0.9),
    );
    if args.verbose {
        unexpected(done);
        noise(done);
        far_off(done);
    }
}

/// Single effects by size and level of noise.
fn by_size_and_level(done: &[Done]) {
    println!(
        "\nsize level | required exact | all 17: exact, with truth, none, part or extra, unexplained, wrong | before -> after, worst channel, median"
    );
    for size in [0.03, 0.10, 0.30] {
        for level in 0..3 {
            let cell: Vec<&Done> =
                of(done, "single").into_iter().filter(|d| d.job.size == size && d.job.level == level).collect();
            if cell.is_empty() {
                continue;
            }
            let required: Vec<&Done> =
                cell.iter().copied().filter(|d| d.oracle.is_some_and(|o| o.required())).collect();
            let class = |c: Class| count(&cell, &|d| d.scored.class == c);
            let mut before: Vec<f64> = cell.iter().map(|d| d.scored.report.holdout.ratio_before).collect();
            let mut after: Vec<f64> = cell.iter().map(|d| d.scored.report.holdout.ratio_after).collect();
            println!(
                "{:>3.0} %  {level}   | {:>18} | {}, {}, {}, {}, {}, {} | {:.2} -> {:.2}",
                100.0 * size,
                percent(count(&required, &|d| d.scored.class == Class::Exact), required.len()),
                class(Class::Exact),
                class(Class::AmbiguousWithTruth),
                class(Class::Nothing),
                class(Class::Part) + class(Class::Extra),
                class(Class::Unexplained),
                class(Class::Wrong) + class(Class::AmbiguousWithout),
                quantile(&mut before, 0.5),
                quantile(&mut after, 0.5),
            );
        }
    }
}

/// Single effects as a whole.
fn singles(done: &[Done]) {
    let single = of(done, "single");
    println!("\nwrong single name, all single sets: {}", percent(count(&single, &wrong), single.len()));
    let twins: Vec<&Done> =
        single.iter().copied().filter(|d| d.oracle.is_some_and(|o| o.indistinguishable())).collect();
    let lone = |d: &Done| matches!(d.scored.class, Class::Exact | Class::Wrong | Class::Extra | Class::Part);
    println!("lone name although indistinguishable: {}", percent(count(&twins, &lone), twins.len()));
    let detectable: Vec<&Done> =
        single.iter().copied().filter(|d| d.job.level == 2 && d.oracle.is_some_and(|o| o.detect > 40.0)).collect();
    let inside = |d: &Done| matches!(d.scored.class, Class::Exact | Class::AmbiguousWithTruth);
    println!(
        "level 2, truth among the candidates when detectable: {}",
        percent(count(&detectable, &inside), detectable.len())
    );
    let settled: Vec<&Done> = single.iter().copied().filter(|d| d.settled.is_some()).collect();
    println!(
        "ambiguous settled by the proposed strokes: {}",
        percent(count(&settled, &|d| d.settled == Some(Class::Exact)), settled.len())
    );
    let right = right(done);
    let mut after: Vec<f64> = right.iter().map(|d| d.scored.report.holdout.ratio_after).collect();
    println!(
        "held-out RMS over floor after the right name, worst channel: median {:.2}, p90 {:.2}; above before: {}",
        quantile(&mut after, 0.5),
        quantile(&mut after, 0.9),
        percent(
            count(&right, &|d| d.scored.report.holdout.ratio_after > d.scored.report.holdout.ratio_before),
            right.len()
        ),
    );
    let ten: Vec<&Done> = right.iter().copied().filter(|d| d.job.size == 0.10 && d.job.level < 2).collect();
    let mut errors: Vec<f64> = ten.iter().filter_map(|d| d.scored.amplitude_error).collect();
    println!(
        "amplitude error at 10 %, levels 0 and 1: median {:.1} %, p90 {:.1} % ({})",
        100.0 * quantile(&mut errors, 0.5),
        100.0 * quantile(&mut errors, 0.9),
        errors.len()
    );
    let exact = exact(done);
    println!(
        "95 % interval covers, exact forms: {}",
        percent(count(&exact, &|d| d.scored.covered == Some(true)), exact.len())
    );
}

/// Sets without an effect.
fn without_effect(done: &[Done]) {
    let none = of(done, "none");
    println!(
        "\nnothing missing: false alarm {}; lone wrong name {}",
        // A lag of the measured runs alone is named rightly.
        percent(
            count(&none, &|d| !matches!(d.scored.class, Class::Nothing | Class::Exact | Class::OfFinger)),
            none.len()
        ),
        percent(count(&none, &wrong), none.len())
    );
    let of_finger = |d: &Done| d.scored.class == Class::OfFinger;
    println!(
        "nothing missing: laws named that the finger follows in all files {}",
        percent(count(&none, &of_finger), none.len())
    );
    let mut left: Vec<f64> = none.iter().map(|d| d.scored.report.holdout.ratio_after).collect();
    let [middle, most] = [0.5, 1.0].map(|share| quantile(&mut left, share));
    println!("nothing missing: held-out RMS over floor, worst channel: median {middle:.2}, largest {most:.2}");
    let with_spikes = |d: &Done| d.scored.report.cautions.iter().any(|c| c.kind == "spikes");
    let is_red = |d: &Done| {
        let cautions = fingerpad_report::diagnosis::cautions(&d.scored.report);
        cautions.iter().any(|(word, text)| *word == "warning" && text.contains("far off the rows"))
    };
    println!(
        "nothing missing: note about spikes {}; as a red warning {}",
        percent(count(&none, &with_spikes), none.len()),
        percent(count(&none, &is_red), none.len())
    );
}

/// Pairs, effects outside the library, drivers that are not recorded.
fn pairs_and_others(done: &[Done]) {
    for size in [0.10, 0.30] {
        let at = |kind: &str| of(done, kind).into_iter().filter(|d| d.job.size == size).collect::<Vec<_>>();
        let (pairs, outside, lost) = (at("pair"), at("outside"), at("unrecorded"));
        println!("size {:.0} %", 100.0 * size);
        println!(
            "  pairs, both named: {}; wrong name {}",
            percent(count(&pairs, &|d| d.scored.class == Class::Exact), pairs.len()),
            percent(count(&pairs, &wrong), pairs.len())
        );
        println!(
            "  outside the library, unexplained structure: {}",
            percent(count(&outside, &|d| d.scored.class == Class::Unexplained), outside.len())
        );
        let law = |d: &Done| !d.scored.report.effects.is_empty();
        println!(
            "  driver not recorded: unexplained structure {}, a law named {}",
            percent(count(&lost, &|d| d.scored.class == Class::Unexplained), lost.len()),
            percent(count(&lost, &law), lost.len())
        );
    }
}

/// Sets that did not end as they should, and the number of each class.
fn unexpected(done: &[Done]) {
    let mut seen: BTreeMap<Class, usize> = BTreeMap::new();
    for d in done {
        *seen.entry(d.scored.class).or_default() += 1;
        let wanted = match d.job.kind {
            "none" => Class::Nothing,
            "outside" | "unrecorded" => Class::Unexplained,
            _ => Class::Exact,
        };
        if d.scored.class != wanted {
            one(d);
        }
    }
    println!("{seen:?}");
}

/// A set in three lines.
fn one(d: &Done) {
    let r = &d.scored.report;
    let laws: Vec<String> = r
        .effects
        .iter()
        .map(|e| {
            format!(
                "{} {:.3} gain {:.0} [{}]",
                e.law,
                e.parameters[0].value,
                e.gain_2ll,
                e.candidates
                    .iter()
                    .map(|c| format!("{} {:.1}/{:.1}", c.law, c.delta_2ll, c.lambda_rival))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        })
        .collect();
    println!(
        "{} {} {:.0} % level {} {:?} {:?} oracle {} | {} {} {} gain {:.0} p {:.0e} {:.3} ratio {:.1}/{:.1}",
        d.job.seed,
        name(d.job.hide),
        100.0 * d.job.size,
        d.job.level,
        d.scored.class,
        d.settled,
        d.oracle.map_or(String::new(), |o| format!("{:.0}/{:.0}", o.detect, o.rival)),
        laws.join("; "),
        r.unexplained.column,
        r.unexplained.channel,
        r.unexplained.gain,
        r.unexplained.p_model,
        r.unexplained.p_runs,
        r.unexplained.scatter_ratio.normal,
        r.unexplained.scatter_ratio.friction
    );
    let mut tests: Vec<_> = r.tests.iter().filter(|t| t.testable).collect();
    tests.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
    let best: Vec<String> = tests
        .iter()
        .take(4)
        .map(|t| format!("{} {:.0} p {:.0e} {:.3}", t.law, t.gain_2ll, t.p_model, t.p_runs))
        .collect();
    let partial: Vec<String> = r.unexplained.partial.iter().map(|p| format!("{} {:.0}", p.law, p.delta_2ll)).collect();
    let plans = r.next_experiment.iter().flat_map(|n| &n.prices);
    let plans: Vec<String> =
        plans.map(|p| format!("{} {:.0} in {:.0} min", p.factor, p.lambda_rival_expected, p.minutes)).collect();
    println!(
        "    hidden {} | best {} | partial {} | plan {} of {}",
        d.truth.join(", "),
        best.join("; "),
        partial.join(", "),
        r.next_experiment.as_ref().map_or("none", |n| &n.factor),
        plans.join("; ")
    );
}

/// Intervals that do not cover, amplitudes that are off, predictions that became worse.
fn far_off(done: &[Done]) {
    let (exact, right) = (exact(done), right(done));
    for d in exact.iter().filter(|d| d.scored.covered == Some(false)) {
        println!(
            "not covered: {} {} {:.0} % level {}: {:.2} half-widths, error {:.1} %",
            d.job.seed,
            name(d.job.hide),
            100.0 * d.job.size,
            d.job.level,
            d.scored.half_widths.unwrap_or(f64::NAN),
            100.0 * d.scored.amplitude_error.unwrap_or(f64::NAN)
        );
    }
    for d in right.iter().filter(|d| d.scored.amplitude_error.is_some_and(|e| e > 0.15)) {
        println!(
            "amplitude off: {} {} {:.0} % level {}: {:.0} %, {:.2} half-widths; hidden {}",
            d.job.seed,
            name(d.job.hide),
            100.0 * d.job.size,
            d.job.level,
            100.0 * d.scored.amplitude_error.unwrap_or(f64::NAN),
            d.scored.half_widths.unwrap_or(f64::NAN),
            d.truth.join(", ")
        );
    }
    for d in right.iter().filter(|d| d.scored.report.holdout.ratio_after > d.scored.report.holdout.ratio_before) {
        let h = &d.scored.report.holdout;
        println!(
            "after above before: {} {} {:.0} % level {}: {:?} -> {:?} floor {:?}",
            d.job.seed,
            name(d.job.hide),
            100.0 * d.job.size,
            d.job.level,
            h.rms_before_n,
            h.rms_after_n,
            h.floor_rms_n
        );
    }
}

/// The noise that the calibrations found over that of the laboratories.
fn noise(done: &[Done]) {
    type Pair = fn(&Done) -> [f64; 2];
    let pairs: [(&str, Pair); 6] = [
        ("stiffness", |d| [d.scored.report.noise.run_gain_normal, d.noise.gain[0]]),
        ("strength", |d| [d.scored.report.noise.run_gain_friction, d.noise.gain[1]]),
        ("touch point", |d| [d.scored.report.noise.depth_zero_mm, d.noise.depth_mm]),
        ("offsets", |d| [d.scored.report.noise.run_offset_n, d.noise.offset_n]),
        ("rows, additive", |d| [d.scored.report.noise.additive_n, d.noise.additive_n]),
        ("rows, multiplicative", |d| [d.scored.report.noise.multiplicative, d.noise.multiplicative]),
    ];
    for (what, pair) in pairs {
        let mut ratios: Vec<f64> = done.iter().map(pair).map(|[found, hidden]| (found / hidden).powi(2)).collect();
        let [low, middle, high] = [0.25, 0.5, 0.75].map(|share| quantile(&mut ratios, share));
        println!("variance of {what} found over hidden: quartiles {low:.2}, {middle:.2}, {high:.2}");
    }
}

/// Lags of the forces that were found, against the true ones.
fn lags(done: &[Done]) {
    let found: Vec<_> = done.iter().filter_map(|d| d.scored.lag).collect();
    if found.is_empty() {
        return;
    }
    let n = found.len() as f64;
    let mean = found.iter().map(|l| l.error_s).sum::<f64>() / n;
    let rms = (found.iter().map(|l| l.error_s.powi(2)).sum::<f64>() / n).sqrt();
    let half = found.iter().map(|l| l.half_s).sum::<f64>() / n;
    let covered = found.iter().filter(|l| l.covered).count();
    println!(
        "\nlag of the forces: found in {} of {} sets; found less true {:.2} ms in the mean, {:.2} ms RMS; 95 % interval +-{:.2} ms, covers {} of {}",
        found.len(),
        done.len(),
        1e3 * mean,
        1e3 * rms,
        1e3 * half,
        covered,
        found.len()
    );
    let each: Vec<String> = found.iter().map(|l| format!("{:.2}", 1e3 * l.error_s)).collect();
    println!("each, ms: {}", each.join(" "));
}
