//! The verification cases at the effort of a test; `verify` runs them in full.

use fingerpad_tests::{CASES, Effort, table};

fn holds(name: &str) {
    let case = CASES.iter().find(|case| case.name == name).expect("a case of this name");
    let checks = (case.run)(Effort::Quick).unwrap_or_else(|error| panic!("{name}: {error}"));
    let table = table(name, &checks);
    println!("{table}");
    assert!(!checks.is_empty() && checks.iter().all(|check| check.passes()), "\n{table}");
}

#[test]
fn hertz() {
    holds("hertz");
}

#[test]
fn hertz_curved() {
    holds("hertz_curved");
}

#[test]
fn mindlin() {
    holds("mindlin");
}

#[test]
fn spin() {
    holds("spin");
}

#[test]
fn full_slip() {
    holds("full_slip");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn limit_surface() {
    holds("limit_surface");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn hemisphere() {
    holds("hemisphere");
}

#[test]
fn creep() {
    holds("creep");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn elastic_slip() {
    holds("elastic_slip");
}

#[test]
fn penalty() {
    holds("penalty");
}

#[test]
fn regularisation() {
    holds("regularisation");
}

#[test]
fn step_size() {
    holds("step_size");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn loops() {
    holds("loops");
}

#[test]
fn depth_cycles() {
    holds("depth_cycles");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn arch() {
    holds("arch");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn turn_in_full_slip() {
    holds("turn_in_full_slip");
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn hard_paths() {
    holds("hard_paths");
}

#[test]
fn volume() {
    holds("volume");
}

#[test]
fn imported() {
    holds("imported");
}

#[test]
fn direct_slip() {
    holds("direct_slip");
}

#[test]
fn twin() {
    holds("twin");
}

#[test]
fn noise() {
    holds("noise");
}
