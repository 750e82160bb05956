//! `--confirm-fe` over all stored sets of the finite-element finger: its own gap before and after the named effect.

use std::time::Instant;

use clap::Parser;
use fingerpad_diagnose::Confirmed;
use fingerpad_tests::synthetic_truth::fe_sets::{confirm, sets};
use fingerpad_tests::synthetic_truth::score::run_with_evidence;

#[derive(Parser)]
#[command(about = "The finite elements with the named effect, on the stored sets", name = "cargo xtask bench confirm")]
struct Args {
    /// Strokes that are run, as many again of the calibration
    #[arg(long, default_value_t = 8)]
    strokes: usize,
    /// Threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Only the sets of these laws
    #[arg(long, value_delimiter = ',')]
    laws: Vec<String>,
}

fn main() {
    let args = Args::parse();
    println!("residual over floor, worst channel: finite elements before, after; reduced before, after");
    let (mut claimed, mut confirmed, mut open) = (0, 0, 0);
    for set in sets().into_iter().filter(|s| args.laws.is_empty() || args.laws.contains(&s.law)) {
        let started = Instant::now();
        let (report, evidence) = run_with_evidence(&set.calibration(), &set.measured(), None);
        let hidden = if set.law.is_empty() { "nothing" } else { &set.law };
        let named: Vec<&str> = report.effects.iter().map(|e| e.law.as_str()).collect();
        if named.is_empty() {
            println!("{:<14} {hidden:<18} {:?}", set.file.trim_end_matches(".csv.gz"), report.verdict);
            continue;
        }
        let fe = confirm(&evidence, &set.shape, args.strokes, args.threads);
        let ([before, after], [reduced_before, reduced_after]) = (fe.gap(), fe.reduced_gap());
        claimed += 1;
        confirmed += usize::from(fe.confirmed == Confirmed::Yes);
        open += usize::from(fe.confirmed == Confirmed::Open);
        let mn = |rms: [f64; 3]| rms.map(|v| format!("{:.1}", 1000.0 * v)).join(" ");
        println!(
            "{:<14} {hidden:<18} {:?} {named:?} {:?}: {:.2} -> {:.2}; {:.2} -> {:.2}; mN (normal, x, y) {} -> {}, floor {}, calibration {}; \
             stiffness {:.3}, strength {:.3}; {:.0} s",
            set.file.trim_end_matches(".csv.gz"),
            report.verdict,
            fe.confirmed,
            before,
            after,
            reduced_before,
            reduced_after,
            mn(fe.rms_before_n),
            mn(fe.rms_after_n),
            mn(fe.floor_rms_n),
            mn(fe.calibration_rms_n),
            fe.stiffness,
            fe.strength,
            started.elapsed().as_secs_f64()
        );
    }
    println!("of {claimed} that claim an effect {confirmed} are confirmed; in {open} the gap does not shrink");
}
