//! Runs verification cases in full and prints their table.
//!
//! `verify [--list] [--quick] [name...]`; a name may be the beginning of several. Exit code 1 when any check fails.

use std::process::ExitCode;

use cpu_time::ThreadTime;
use fingerpad_tests::{CASES, Case, Check, Effort, table};

fn main() -> ExitCode {
    let mut effort = Effort::Full;
    let mut names = Vec::new();
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--list" => {
                for case in CASES {
                    println!("{:<28} {}", case.name, case.about);
                }
                return ExitCode::SUCCESS;
            }
            "--quick" => effort = Effort::Quick,
            name if !name.starts_with('-') && CASES.iter().any(|case| case.name.starts_with(name)) => {
                names.push(name.to_owned());
            }
            other => {
                eprintln!("unknown case or option {other}; --list names the cases");
                return ExitCode::from(2);
            }
        }
    }
    let wanted = |case: &&Case| names.is_empty() || names.iter().any(|name| case.name.starts_with(name.as_str()));
    println!("case | quantity | value | reference | difference | pass bound | verdict");
    let mut failed = 0;
    for case in CASES.iter().filter(wanted) {
        let clock = ThreadTime::now();
        match std::panic::catch_unwind(|| (case.run)(effort)).unwrap_or_else(|_| Err("a check failed".into())) {
            Ok(checks) => {
                failed += checks.iter().filter(|check| !check.passes()).count();
                print!("{}", table(case.name, &checks));
            }
            Err(error) => {
                failed += 1;
                println!("{:<18} | {error} | FAIL", case.name);
            }
        }
        print!("{}", table(case.name, &[Check::reported("CPU time (s)", clock.elapsed().as_secs_f64())]));
    }
    if failed > 0 {
        println!("{failed} checks failed");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
