//! Score card of `fingerpad diagnose` on hidden sets from an independent simulator.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use fingerpad_tests::synthetic_truth::csv;
use fingerpad_tests::synthetic_truth::effects::{LIBRARY, OUTSIDE};
use fingerpad_tests::synthetic_truth::laboratory::Noise;
use fingerpad_tests::synthetic_truth::loggers::Protocol;
use fingerpad_tests::synthetic_truth::oracle::{Separation, separation};
use fingerpad_tests::synthetic_truth::score::{Class, Scored, score, settle};
use fingerpad_tests::synthetic_truth::score_sets::{self, Outcome, ScoreSet};
use fingerpad_tests::synthetic_truth::score_table::table;
use fingerpad_tests::synthetic_truth::sets::{Hide, Wanted, make};
use fingerpad_tests::synthetic_truth::simulator::SimulatorKind;

#[derive(Parser)]
#[command(about = "Score card of the diagnosis on hidden sets", name = "cargo xtask bench diagnose")]
struct Args {
    /// Sets per law and cell of single effects
    #[arg(long, default_value_t = 1)]
    repeats: u64,
    /// Added to every seed: another number gives other sets
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Only these kinds: single, none, pair, outside, unrecorded
    #[arg(long, value_delimiter = ',')]
    kinds: Vec<String>,
    /// Who makes the readings
    #[arg(long, value_enum, default_value = "first")]
    simulator: Simulators,
    /// The whole score of both simulators in five practices instead; goes on where it stopped
    #[arg(long)]
    score: bool,
    /// The score's first sets only, in an order that mixes all kinds
    #[arg(long)]
    sets: Option<usize>,
    /// The score's file, a line a set [default: target/diagnose-score-SEED.jsonl]
    #[arg(long)]
    out: Option<PathBuf>,
    /// How the laboratory moves and logs
    #[arg(long, value_enum, default_value = "plane")]
    protocol: Protocol,
    /// Only sizes from this on
    #[arg(long, default_value_t = 0.0)]
    least_size: f64,
    /// Threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Only the sets of these seeds
    #[arg(long, value_delimiter = ',')]
    only: Vec<u64>,
    /// Write the files of every set to this folder
    #[arg(long)]
    dump: Option<PathBuf>,
    /// Print every set that is not as wanted
    #[arg(long)]
    verbose: bool,
}

/// Who makes the readings.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Simulators {
    /// Bristles on one spring, strength a power of the pressure
    First,
    /// An elastic half-space under an elliptic contact, strength tau_0 + alpha p
    Second,
    /// One after the other
    Both,
}

impl Simulators {
    fn kinds(self) -> &'static [SimulatorKind] {
        match self {
            Self::First => &SimulatorKind::ALL[..1],
            Self::Second => &SimulatorKind::ALL[1..],
            Self::Both => &SimulatorKind::ALL,
        }
    }
}

/// A set to be made.
#[derive(Clone, Copy)]
struct Job {
    simulator: SimulatorKind,
    seed: u64,
    kind: &'static str,
    hide: Hide,
    size: f64,
    level: usize,
    runs: usize,
}

struct Done {
    job: Job,
    scored: Scored,
    oracle: Option<Separation>,
    settled: Option<Class>,
    exact_form: bool,
    truth: Vec<String>,
    noise: Noise,
}

const PAIRS: [(usize, usize); 16] = [
    (0, 13),
    (1, 11),
    (4, 13),
    (5, 8),
    (7, 12),
    (3, 14),
    (16, 9),
    (15, 4),
    (2, 6),
    (0, 5),
    (8, 12),
    (1, 7),
    (10, 0),
    (14, 4),
    (16, 5),
    (6, 13),
];

fn jobs(args: &Args) -> Vec<Job> {
    args.simulator.kinds().iter().flat_map(|simulator| jobs_of(*simulator, args)).collect()
}

fn jobs_of(simulator: SimulatorKind, args: &Args) -> Vec<Job> {
    let mut out = Vec::new();
    let mut seed = 40_000 + 100_000 * args.seed;
    let mut add = |kind, hide, size, level, runs| {
        seed += 1;
        out.push(Job { simulator, seed, kind, hide, size, level, runs });
    };
    for _ in 0..args.repeats {
        for size in [0.03, 0.10, 0.30] {
            for level in 0..3 {
                for law in 0..LIBRARY.len() {
                    add("single", Hide::Law(law), size, level, 60);
                }
            }
        }
        for level in 0..3 {
            for k in 0..16 {
                add("none", Hide::Nothing, 0.0, level, [40, 60, 100, 60][k % 4]);
            }
        }
        for size in [0.10, 0.30] {
            for (i, j) in PAIRS {
                add("pair", Hide::Pair(i, j), size, 0, 60);
            }
            for k in 0..OUTSIDE.len() {
                add("outside", Hide::Outside(k), size, 0, 60);
                add("outside", Hide::Outside(k), size, 0, 60);
            }
            for law in [0, 6, 8, 14, 16] {
                add("unrecorded", Hide::Unrecorded(law), size, 0, 60);
                add("unrecorded", Hide::Unrecorded(law), size, 1, 60);
            }
        }
    }
    if !args.only.is_empty() {
        out.retain(|j| args.only.contains(&j.seed));
    }
    out.retain(|j| j.kind == "none" || j.size >= args.least_size);
    if !args.kinds.is_empty() {
        out.retain(|j| args.kinds.iter().any(|k| k == j.kind));
    }
    out
}

fn name(hide: Hide) -> String {
    match hide {
        Hide::Nothing => "nothing".into(),
        Hide::Law(i) => LIBRARY[i].0.into(),
        Hide::Pair(i, j) => format!("{} + {}", LIBRARY[i].0, LIBRARY[j].0),
        Hide::Outside(i) => OUTSIDE[i].into(),
        Hide::Unrecorded(i) => format!("{} (unrecorded)", LIBRARY[i].0),
    }
}

/// The score: judges what the file does not hold yet, prints the table of all that it holds.
fn whole_score(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    let path = args.out.clone().unwrap_or_else(|| format!("target/diagnose-score-{}.jsonl", args.seed).into());
    let mut wanted = score_sets::sets(args.seed, args.simulator.kinds());
    wanted.retain(|set| args.only.is_empty() || args.only.contains(&set.seed));
    wanted.truncate(args.sets.unwrap_or(usize::MAX));
    let stored = if path.exists() { fs::read_to_string(&path)? } else { String::new() };
    // A line that a stop cut short is judged again.
    let whole = stored.rfind('\n').map_or(0, |end| end + 1);
    let mut done: Vec<Outcome> = stored[..whole].lines().map(serde_json::from_str).collect::<Result<_, _>>()?;
    done.retain(|o| wanted.contains(&o.set));
    let file = fs::OpenOptions::new().create(true).truncate(false).write(true).open(&path)?;
    file.set_len(whole as u64)?;
    let known: Vec<ScoreSet> = done.iter().map(|o| o.set).collect();
    let left: Vec<ScoreSet> = wanted.iter().filter(|set| !known.contains(set)).copied().collect();
    eprintln!("seed {}: {} of {} sets are in {}", args.seed, known.len(), wanted.len(), path.display());
    let (next, out) = (AtomicUsize::new(0), Mutex::new((fs::File::options().append(true).open(&path)?, done)));
    std::thread::scope(|scope| {
        for _ in 0..args.threads {
            scope.spawn(|| {
                while let Some(set) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = score_sets::judge(*set);
                    let line = serde_json::to_string(&outcome).expect("plain numbers") + "\n";
                    let (file, done) = &mut *out.lock().expect("no thread panics with it");
                    file.write_all(line.as_bytes()).expect("the file can be written to");
                    done.push(outcome);
                    if done.len().is_multiple_of(20) {
                        eprintln!("{} of {}", done.len(), wanted.len());
                    }
                }
            });
        }
    });
    let (_, done) = out.into_inner()?;
    println!("seed {}, {}", args.seed, table(&done));
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    if args.score {
        return whole_score(&args);
    }
    let jobs = jobs(&args);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Done)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..args.threads {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(i).copied() else { break };
                    let exact_form = job.seed % 2 == 0;
                    let Job { simulator, seed, hide, size, level, runs, .. } = job;
                    let protocol = args.protocol;
                    let made = make(Wanted { simulator, protocol, seed, hide, size, level, runs, exact_form });
                    if let Some(folder) = &args.dump {
                        for (set, role) in [(&made.calibration, "c"), (&made.measured, "m"), (&made.holdout, "h")] {
                            let path = folder.join(format!("{}_{role}.csv", job.seed));
                            std::fs::write(path, csv::text(set)).expect("the folder can be written to");
                        }
                    }
                    let oracle = (job.kind == "single").then(|| separation(&made));
                    let scored = score(&made);
                    let settled = settle(&made, &scored.report).filter(|_| job.kind == "single");
                    let mut list = done.lock().expect("no thread panics with it");
                    let truth =
                        made.truth.iter().map(|e| format!("{} {:.4} {:.2?}", e.name, e.amplitude, e.shape)).collect();
                    list.push((i, Done { job, scored, oracle, settled, exact_form, truth, noise: made.noise }));
                    if list.len().is_multiple_of(20) {
                        eprintln!("{} of {}", list.len(), jobs.len());
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().expect("all threads are done");
    done.sort_by_key(|d| d.0);
    let done: Vec<Done> = done.into_iter().map(|d| d.1).collect();
    card(&done, &args);
    Ok(())
}

fn percent(hits: usize, of: usize) -> String {
    if of == 0 { "-".into() } else { format!("{:.0} % ({hits} of {of})", 100.0 * hits as f64 / of as f64) }
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

fn card(done: &[Done], args: &Args) {
    let of = |kind: &str| done.iter().filter(move |d| d.job.kind == kind).collect::<Vec<_>>();
    let count = |list: &[&Done], f: &dyn Fn(&Done) -> bool| list.iter().filter(|d| f(d)).count();
    println!("{} sets; seeds {} ..", done.len(), done.first().map_or(0, |d| d.job.seed));
    println!(
        "required: an oracle with the simulator's tangents separates it from nothing by 40 and from any other family by 25"
    );
    println!(
        "\nsize level | required exact | all 17: exact, with truth, none, part or extra, unexplained, wrong | before -> after, worst channel, median"
    );
    for size in [0.03, 0.10, 0.30] {
        for level in 0..3 {
            let cell: Vec<&Done> =
                of("single").into_iter().filter(|d| d.job.size == size && d.job.level == level).collect();
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
    let single = of("single");
    let wrong = |d: &Done| matches!(d.scored.class, Class::Wrong);
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
    let right: Vec<&Done> = single.iter().copied().filter(|d| d.scored.class == Class::Exact).collect();
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
    let exact: Vec<&Done> = right.iter().copied().filter(|d| d.exact_form && d.scored.covered.is_some()).collect();
    println!(
        "95 % interval covers, exact forms: {}",
        percent(count(&exact, &|d| d.scored.covered == Some(true)), exact.len())
    );

    let none = of("none");
    println!(
        "\nnothing missing: false alarm {}; lone wrong name {}",
        percent(count(&none, &|d| d.scored.class != Class::Nothing), none.len()),
        percent(count(&none, &wrong), none.len())
    );
    for size in [0.10, 0.30] {
        let at = |kind: &str| of(kind).into_iter().filter(|d| d.job.size == size).collect::<Vec<_>>();
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
    let mut times: Vec<f64> = done.iter().map(|d| d.scored.seconds).collect();
    println!(
        "\na diagnosis: median {:.2} s, p90 {:.2} s of processor time",
        quantile(&mut times, 0.5),
        quantile(&mut times, 0.9),
    );
    if args.verbose {
        let mut seen: BTreeMap<Class, usize> = BTreeMap::new();
        for d in done {
            *seen.entry(d.scored.class).or_default() += 1;
            let wanted = match d.job.kind {
                "none" => Class::Nothing,
                "outside" | "unrecorded" => Class::Unexplained,
                _ => Class::Exact,
            };
            if d.scored.class != wanted {
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
                let partial: Vec<String> =
                    r.unexplained.partial.iter().map(|p| format!("{} {:.0}", p.law, p.delta_2ll)).collect();
                let plans = r.next_experiment.iter().flat_map(|n| &n.prices);
                let plans: Vec<String> = plans
                    .map(|p| format!("{} {:.0} in {:.0} min", p.factor, p.lambda_rival_expected, p.minutes))
                    .collect();
                println!(
                    "    hidden {} | best {} | partial {} | plan {} of {}",
                    d.truth.join(", "),
                    best.join("; "),
                    partial.join(", "),
                    r.next_experiment.as_ref().map_or("none", |n| &n.factor),
                    plans.join("; ")
                );
            }
        }
        println!("{seen:?}");
        noise(done);
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
