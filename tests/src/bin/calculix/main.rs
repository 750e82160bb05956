//! Our fingertip against CalculiX: `verify` compares forces on the same mesh, `bench` the CPU time.
#![cfg(unix)]

mod bench;
mod verify;

use std::process::ExitCode;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use fingerpad_fe::compare_ccx::Runner;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::calculix::PENALTY_MPA_PER_MM;

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// Forces of a press and of a Coulomb slide; fails if a row does in which both have the same element
    Verify,
    /// CPU time of a press and of a press and slide, shape A
    Bench,
}

/// Our fingertip against CalculiX, bones fixed.
#[derive(Parser)]
struct Arguments {
    what: What,
    /// Coarse meshes only
    #[arg(long)]
    quick: bool,
    /// Time limit of each run of CalculiX by the clock, s; a slide of `bench` that it cuts is extrapolated [default: 3600,
    /// of `bench` 1800]
    #[arg(long)]
    timeout_s: Option<u64>,
}

fn main() -> ExitCode {
    let Arguments { what, quick, timeout_s } = Arguments::parse();
    let version = Runner::default().version().unwrap_or_else(|e| panic!("{e}"));
    println!("CalculiX: {version}, C3D8R, SPOOLES, 1 thread; penalty {PENALTY_MPA_PER_MM} MPa/mm in both");
    let presets = [MeshPreset::Coarse, MeshPreset::Medium];
    let presets = if quick { &presets[..1] } else { &presets[..] };
    let limit = |default_s| Duration::from_secs(timeout_s.unwrap_or(default_s));
    let passes = match what {
        What::Verify => verify::run(presets, limit(3600)),
        What::Bench => bench::run(presets[presets.len() - 1], limit(1800)),
    };
    if passes { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
