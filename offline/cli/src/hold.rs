//! `fingerpad identify --hold`: branches of relaxing tissue from a ramp and hold.

use std::path::Path;

use fingerpad_identify::hold::{Estimate, Fit, Hold};

use super::Failure;

/// Durations of the hold over the time of a branch below which the branch may not have ended.
const LEAST_TIMES: f64 = 3.0;

/// Reads a ramp and hold, and prints shares and times with their intervals.
pub fn run(file: &Path, branches: u8) -> Result<(), Failure> {
    let hold = Hold::read(file)?;
    print(file, &hold.fit(usize::from(branches)));
    Ok(())
}

fn print(file: &Path, fit: &Fit) {
    println!(
        "{}: {} rows, hold of {:.3} s; root mean square residual {:.2} mN",
        file.display(),
        fit.rows,
        fit.hold_s,
        1e3 * fit.rms_n
    );
    println!(
        "relaxed force {:.4} N at the depth of the hold, with the depth as d^{:.3} exp({:+.3} d)",
        fit.relaxed_force_n, fit.exponent, fit.rate_per_mm
    );
    println!("{:<24} {:<28}", "share (95 %)", "time, s (95 %)");
    for branch in &fit.branches {
        let cell = |e: Estimate| format!("{:.4} ± {:.4}", e.value, e.half_width);
        let note = match (branch.share.is_poor(), branch.time_s.is_poor()) {
            (false, false) => "",
            (true, false) => "share poorly determined",
            (false, true) => "time poorly determined",
            (true, true) => "poorly determined",
        };
        println!("{:<24} {:<28} {note}", cell(branch.share), cell(branch.time_s));
        if branch.time_s.value * LEAST_TIMES > fit.hold_s {
            eprintln!(
                "warning: the hold of {:.3} s is shorter than {LEAST_TIMES} times the branch of {:.3} s: hold longer",
                fit.hold_s, branch.time_s.value
            );
        }
    }
    let text = |branch: &fingerpad_identify::hold::FittedBranch| {
        format!("{:.4}:{:.5}", branch.share.value, branch.time_s.value)
    };
    let list: Vec<String> = fit.branches.iter().map(text).collect();
    println!("--relaxation {}", if list.is_empty() { "none".into() } else { list.join(",") });
}
