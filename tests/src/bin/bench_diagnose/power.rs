//! Predicted power against counted: what sets simulated from a calibration say of the protocol, and what the diagnosis of the
//! simulators' own sets does.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use fingerpad_diagnose::{PowerSettings, Rate, Redecision, SelectionSettings, power};
use fingerpad_tests::synthetic_truth::effects::LIBRARY;
use fingerpad_tests::synthetic_truth::score::{Class, classified, reference, run_with_evidence};
use fingerpad_tests::synthetic_truth::score_sets::ScoreSet;
use fingerpad_tests::synthetic_truth::sets::{Hide, Wanted, make};

use crate::Args;

/// What was counted and predicted for one set.
struct Compared {
    of: Wanted,
    class: Class,
    /// Simulated sets of its law: number, detected, named, named wrongly.
    predicted: [usize; 4],
    /// Simulated sets without an effect: number, false alarms.
    alarms: [usize; 2],
    seconds: f64,
}

/// Compares the two on the single effects and the sets without one.
pub fn compare(wanted: &[ScoreSet], args: &Args, sets: usize) {
    let all = wanted.iter().map(|set| set.of);
    let jobs: Vec<Wanted> = all.filter(|of| matches!(of.hide, Hide::Law(_) | Hide::Nothing)).collect();
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Compared>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..args.threads {
            scope.spawn(|| {
                while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)).copied() {
                    let compared = one(job, sets);
                    let mut list = done.lock().expect("no thread panics with it");
                    list.push(compared);
                    if list.len().is_multiple_of(20) {
                        eprintln!("{} of {}", list.len(), jobs.len());
                    }
                }
            });
        }
    });
    let done = done.into_inner().expect("all threads are done");
    print(&done, args);
}

fn one(of: Wanted, sets: usize) -> Compared {
    let Wanted { seed, hide, size, .. } = of;
    let made = make(of);
    let (report, evidence) = run_with_evidence(&made.calibration, &made.measured, None);
    let class = classified(&made, &report);
    let (reference, settings) = (reference(), SelectionSettings::default());
    let again = Redecision::new(&evidence, &reference, &settings);
    let (laws, sizes) = match hide {
        Hide::Law(i) => (vec![LIBRARY[i].0], vec![size]),
        _ => (vec!["no law"], vec![0.1]),
    };
    let cells = sizes.len() * if matches!(hide, Hide::Law(_)) { 2 } else { 1 };
    let started = std::time::Instant::now();
    let settings = PowerSettings { seconds: 600.0, sizes, laws, threads: 1, seed };
    let found = power(&again, &settings, &|counted, _| {
        if counted < sets * cells { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    let predicted = found
        .cells
        .first()
        .map_or([0; 4], |cell| [cell.named.sets, cell.detected.count, cell.named.count, cell.misnamed.count]);
    let alarms = [found.false_alarm.sets, found.false_alarm.count];
    Compared { of, class, predicted, alarms, seconds: started.elapsed().as_secs_f64() / found.sets.max(1) as f64 }
}

fn rate(count: usize, sets: usize) -> String {
    let rate = Rate::of(count, sets);
    let [low, high] = rate.ci95.map(|p| 100.0 * p);
    format!("{:5.1} % ({low:.1} to {high:.1}; {count} of {sets})", 100.0 * rate.share())
}

fn print(done: &[Compared], args: &Args) {
    for simulator in args.simulator.kinds() {
        let own: Vec<&Compared> = done.iter().filter(|c| c.of.simulator == *simulator).collect();
        println!("{simulator:?} simulator: predicted from the calibrations | counted");
        for size in [0.03, 0.10, 0.30] {
            let cell: Vec<&Compared> =
                own.iter().copied().filter(|c| matches!(c.of.hide, Hide::Law(_)) && c.of.size == size).collect();
            if cell.is_empty() {
                continue;
            }
            let sum = |k: usize| cell.iter().map(|c| c.predicted[k]).sum::<usize>();
            let count = |f: &dyn Fn(Class) -> bool| cell.iter().filter(|c| f(c.class)).count();
            let row = |what: &str, k: usize, counted: usize| {
                println!("  {:>3.0} % {what:9} {} | {}", 100.0 * size, rate(sum(k), sum(0)), rate(counted, cell.len()));
            };
            row("detected", 1, count(&|c| c != Class::Nothing));
            row("named", 2, count(&|c| c == Class::Exact));
            row("misnamed", 3, count(&|c| c == Class::Wrong));
            if args.verbose {
                for (i, (law, _)) in LIBRARY.iter().enumerate() {
                    let of_law: Vec<&&Compared> = cell.iter().filter(|c| c.of.hide == Hide::Law(i)).collect();
                    let sum = |k: usize| of_law.iter().map(|c| c.predicted[k]).sum::<usize>();
                    let counted = of_law.iter().filter(|c| c.class == Class::Exact).count();
                    println!("      {law:18} named {} of {} | {counted} of {}", sum(2), sum(0), of_law.len());
                }
            }
        }
        let alarms = |k: usize| own.iter().map(|c| c.alarms[k]).sum::<usize>();
        let none: Vec<&&Compared> = own.iter().filter(|c| c.of.hide == Hide::Nothing).collect();
        let counted = none.iter().filter(|c| c.class != Class::Nothing).count();
        println!("  false alarms    {} | {}", rate(alarms(1), alarms(0)), rate(counted, none.len()));
        let mut seconds: Vec<f64> = own.iter().map(|c| c.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        println!("  a simulated set: median {:.2} s", seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN));
    }
}
