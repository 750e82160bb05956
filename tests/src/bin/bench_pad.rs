//! The pad against finite-element runs: errors by kind of motion.

use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::pad::{FitLimits, Host, PadScores, PadSize, Tuning, fit, pad, score_runs};
use fingerpad_reduce::{Kind, Run};

#[derive(Parser)]
#[command(about = "Errors of the pad along stored runs", name = "bench_pad")]
struct Args {
    /// Folders of runs
    folders: Vec<PathBuf>,
    /// Patches
    #[arg(long, default_value_t = 37)]
    patches: usize,
    /// Every which run of the fit is fitted to; 0 fits nothing
    #[arg(long, default_value_t = 6)]
    every: usize,
    /// Patience of the fit
    #[arg(long, default_value_t = 2)]
    patience: usize,
    /// Law to start from (JSON)
    #[arg(long)]
    law: Option<PathBuf>,
    /// Kind of runs of which each has a line of its own
    #[arg(long, value_name = "KIND")]
    each: Option<String>,
    /// Depth for which the pad is made, mm
    #[arg(long, default_value_t = 3.0)]
    depth: f64,
}

fn deepest(run: &Run) -> f64 {
    let by_depth = run.path.drives[0] == Drive::Displacement;
    if by_depth { run.path.waypoints.iter().map(|w| w.normal).fold(0.0, f64::max) } else { f64::INFINITY }
}

/// A line of the table.
fn line(name: &str, s: &PadScores) -> String {
    format!(
        "{name:<22} {:>4} {:>7.2} {:>7.2} {:>7.2} {:>7.3} {:>7.3} {:>7.2} {:>7.2}",
        s.runs,
        100.0 * s.normal,
        100.0 * s.friction,
        100.0 * s.friction_of_limit,
        s.stick,
        s.centre_mm,
        100.0 * s.moment,
        100.0 * s.area
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
    let mut runs = Vec::new();
    for folder in &args.folders {
        for entry in std::fs::read_dir(folder)? {
            let file = entry?.path();
            if file.extension().is_some_and(|e| e == "fprun") {
                let run = Run::from_bytes(&std::fs::read(&file)?, &file)?;
                if run.samples.len() > 3 {
                    runs.push(run);
                }
            }
        }
    }
    runs.sort_by(|a, b| a.name.cmp(&b.name));
    let start = Instant::now();
    let paths: Vec<&Path> = runs.iter().filter(|r| deepest(r) <= args.depth).map(|r| &r.path).collect();
    let finger = config.finger_for(&paths)?.0;
    let outline = finger.outline.clone().ok_or("a smooth finger")?;
    let at_rest = pad(&finger, &outline, PadSize { patches: args.patches }, args.depth)?;
    println!(
        "{} patches in {:.1} s, from what {} paths touch",
        at_rest.patches.len(),
        start.elapsed().as_secs_f64(),
        paths.len()
    );
    let host = Host { outline: &outline };
    let mut tuning = match &args.law {
        Some(file) => serde_json::from_str(&std::fs::read_to_string(file)?)?,
        None => Tuning::default(),
    };
    if args.every > 0 {
        let of_fit: Vec<&Run> = runs.iter().filter(|r| !r.held_out).step_by(args.every).collect();
        let start = Instant::now();
        println!("before: {:?}", score_runs(&at_rest.tuned(&tuning), &of_fit, &host));
        println!("{:.1} s", start.elapsed().as_secs_f64());
        tuning = fit(&at_rest, &tuning, &of_fit, &host, FitLimits { patience: args.patience });
        println!("fit to {} runs in {:.0} s", of_fit.len(), start.elapsed().as_secs_f64());
        println!("after: {:?}", score_runs(&at_rest.tuned(&tuning), &of_fit, &host));
    }
    println!("{}", serde_json::to_string(&tuning)?);
    println!(
        "{:<22} {:>4} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7}",
        "held out", "runs", "N %", "F %", "F lim %", "stick", "cop mm", "M %", "A %"
    );
    for kind in Kind::ALL {
        let own: Vec<&Run> = runs.iter().filter(|r| r.held_out && r.kind == kind).collect();
        if own.is_empty() {
            continue;
        }
        let model = at_rest.tuned(&tuning);
        println!("{}", line(kind.as_str(), &score_runs(&model, &own, &host)));
        if args.each.as_deref() == Some(kind.as_str()) {
            for run in own {
                println!(
                    "{}",
                    line(&format!("  {} {:?}", run.name, run.body.kind), &score_runs(&model, &[run], &host))
                );
            }
        }
    }
    Ok(())
}
