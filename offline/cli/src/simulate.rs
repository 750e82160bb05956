//! `fingerpad simulate`: the finite-element model along a path.

use std::{
    fs,
    path::{Path, PathBuf},
};

use std::time::Duration;

use anyhow::Context;
use fingerpad_fe::load_path::{Checkpoint, Trajectory, follow_path_from};

use super::{Failure, Model, Outputs, bar, go_on, keeping, make_finger_for, run_failure, show};

/// Follow a path of the plane with the finite-element model.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm\\n0,0,0,0\\n1,1,0,0\\n3,1,4,0\\n' > path.csv
  fingerpad simulate --path path.csv --mesh-preset coarse --out response.csv
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg\\n0,0,0,0,0\\n1,1,0,0,0\\n2,1,0,0,20\\n' > twist.csv
  fingerpad simulate --path twist.csv --mesh-preset coarse --out twist_response.csv
  fingerpad simulate --path path.csv --shape a --lambda 1.5 --beta 1 --out coulomb.csv --vtu fields

The path has the columns t_s, depth_mm, slide_x_mm, slide_y_mm, straight between rows; normal_force_n in place of
depth_mm, friction_x_n and friction_y_n in place of the slides, drive by force. spin_deg (turn of the plane about its
normal, counter-clockwise from above), pitch_deg (angle of the finger to the plane, 10 to 70) and roll_deg (-30 to 30)
may follow, or spin_moment_n_mm, moment_y_n_mm and moment_x_n_mm in their place; without them the finger keeps the pose
of its shape. The response has a row at least at every row of the path.

The folders of --out and --vtu are made if they are missing. Files of an earlier series of the same name in the folder
of --vtu are removed. A run that is stopped or finds no equilibrium keeps the rows before in RESPONSE.partial.csv.")]
pub struct Args {
    /// Path of the plane (CSV)
    #[arg(long, value_name = "PATH.csv")]
    path: PathBuf,
    /// Response to write (CSV)
    #[arg(long, value_name = "RESPONSE.csv")]
    out: PathBuf,
    #[command(flatten)]
    model: Model,
    /// Factor of the friction law, MPa^(1-beta)
    #[arg(long, value_name = "L")]
    lambda: Option<f64>,
    /// Exponent of the friction law
    #[arg(long, value_name = "B", allow_negative_numbers = true)]
    beta: Option<f64>,
    /// Pressure-independent strength, MPa
    #[arg(long, value_name = "T")]
    tau0_mpa: Option<f64>,
    /// Elastic slip at the strength, mm
    #[arg(long, value_name = "G")]
    gamma_crit_mm: Option<f64>,
    /// Folder for ParaView files, two per row of the path, with a .pvd
    #[arg(long, value_name = "DIR")]
    vtu: Option<PathBuf>,
    /// Press without friction until the first row that slides
    #[arg(long)]
    frictionless_press: bool,
}

/// Time between two saves of an unfinished run.
const CHECKPOINT_PERIOD: Duration = Duration::from_secs(5);

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut config = args.model.config()?;
    let law = &mut config.friction;
    for (flag, value, target, least) in [
        ("lambda", args.lambda, &mut law.lambda, 0.0),
        ("beta", args.beta, &mut law.beta, f64::NEG_INFINITY),
        ("tau0-mpa", args.tau0_mpa, &mut law.tau0_mpa, 0.0),
        ("gamma-crit-mm", args.gamma_crit_mm, &mut law.gamma_crit_mm, f64::MIN_POSITIVE),
    ] {
        if let Some(value) = value {
            if !(value.is_finite() && value >= least) {
                return Err(Failure::Input(anyhow::anyhow!("--{flag} {value}: not a valid value")));
            }
            *target = value;
        }
    }
    config.numerics.load_steps.friction_while_pressing &= !args.frictionless_press;
    let path = fingerpad_fe::load_path::path_csv::read(&args.path)?;
    let partial = args.out.with_extension("partial.csv");
    let outputs =
        Outputs::beside(args.model.inputs(&config).into_iter().chain([("--path", Some(args.path.as_path()))]))
            .file("--out", Some(&args.out))
            .file("--out", Some(&partial));
    match &args.vtu {
        Some(folder) => outputs.folder("--vtu", folder, &[]).prepare()?,
        None => outputs.prepare()?,
    }
    let (finger, _) = make_finger_for(&config, &[&path])?;
    config.check_path(&path, &finger).map_err(|e| Failure::Input(anyhow::anyhow!("{}: {e}", args.path.display())))?;
    let snapshots: Vec<usize> = if args.vtu.is_some() { (0..path.waypoints.len()).collect() } else { Vec::new() };
    let bar = bar("simulate".into());
    let _keeping = keeping();
    let checkpoint_file = args.out.with_extension("checkpoint");
    let hash = config.hash()?;
    let checkpoint = Checkpoint { file: &checkpoint_file, period: CHECKPOINT_PERIOD, key: &hash };
    let result = follow_path_from(&config.problem(&finger), &path, &snapshots, checkpoint, &mut |progress| {
        show(&bar, &progress);
        go_on()
    });
    bar.finish_and_clear();
    let save = |trajectory: &Trajectory, out: &Path| -> Result<(), Failure> {
        fingerpad_fe::load_path::response_csv::write(out, &trajectory.responses)?;
        if let Some(folder) = &args.vtu {
            let name = out.file_stem().map_or("fields".into(), |s| s.to_string_lossy());
            remove_series(folder, &name).map_err(Failure::Input)?;
            fingerpad_fe::load_path::vtu::write_series(folder, &name, &finger.mesh, &trajectory.snapshots)?;
        }
        Ok(())
    };
    match result {
        Ok(trajectory) => {
            save(&trajectory, &args.out)?;
            let cost = &trajectory.cost;
            println!(
                "{}: {} rows; {} increments, {} iterations, {} cut back, {:.1} s CPU",
                args.out.display(),
                trajectory.responses.len(),
                cost.increments,
                cost.iterations,
                cost.cutbacks,
                cost.cpu_s
            );
            Ok(())
        }
        Err(mut error) => {
            // What was reached goes beside the output, under a name that nobody takes for the whole.
            let mut kept = "nothing was kept".to_owned();
            let reached = error.take_reached();
            if !reached.responses.is_empty() {
                save(&reached, &partial)?;
                kept = format!("{} rows kept in {}", reached.responses.len(), partial.display());
            }
            Err(run_failure(error, &args.path.display().to_string(), kept))
        }
    }
}

/// Removes the files of an earlier series: `NAME.pvd`, `NAME_0000.vtu`, `NAME_pad_0000.vtu` and so on.
fn remove_series(folder: &Path, name: &str) -> anyhow::Result<()> {
    let of_series = |file: &str| {
        let Some(rest) = file.strip_prefix(name) else { return false };
        let number = rest.strip_suffix(".vtu").map(|r| r.strip_prefix("_pad").unwrap_or(r));
        let digits = number.and_then(|n| n.strip_prefix('_'));
        rest == ".pvd" || digits.is_some_and(|d| d.len() >= 4 && d.bytes().all(|b| b.is_ascii_digit()))
    };
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let file = entry.with_context(|| folder.display().to_string())?.path();
        if file.file_name().is_some_and(|f| of_series(&f.to_string_lossy())) {
            fs::remove_file(&file).with_context(|| file.display().to_string())?;
        }
    }
    Ok(())
}
