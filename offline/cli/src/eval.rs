//! `fingerpad eval`: the reduced model, through the core, along a path.

use std::path::PathBuf;

use anyhow::Context;
use fingerpad::{Effects, ModelFile, Surroundings};
use fingerpad_diagnose::{Correction, replay_all};
use fingerpad_formats as formats;
use fingerpad_reduce::{simulate_path, simulate_path_with_effects};

use super::Failure;

/// Follow a path of the plane with the reduced model
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm\\n0,0,0,0\\n1,1,0,0\\n3,1,4,0\\n' > path.csv
  fingerpad eval --model model.fpm --path path.csv --out response.csv
  fingerpad eval --model corrected.fpm --runs holdout.csv --out predicted.csv

Paths are those of `simulate`: depth_mm or normal_force_n, slides or friction_x_n and friction_y_n. The response has the
columns of `simulate` and friction_limit_n, slip_margin, band_normal_n, band_friction_n: the half-widths within which
95 % of the finite-element runs lie that the fit did not see. Steps are at most 0.02 mm; all arithmetic is that of the
package on the microcontroller. A force out of reach leaves the nearest state and the status load_not_reached.

--runs takes measured runs as `diagnose` does, state columns included, writes prediction and residual of every row, and
prints the root mean square residual: for the corrected.fpm of a diagnosis the gap after of its report.")]
pub struct Args {
    /// Model file
    #[arg(long, value_name = "MODEL.fpm")]
    model: PathBuf,
    /// Path of the plane (CSV)
    #[arg(long, value_name = "PATH.csv", required_unless_present = "runs")]
    path: Option<PathBuf>,
    /// Measured runs (CSV) in place of a path
    #[arg(long, value_name = "RUNS.csv", conflicts_with = "path")]
    runs: Option<PathBuf>,
    /// Moisture of the skin along the path, corneometer units, where the model has that effect
    #[arg(long, default_value_t = 35.0)]
    hydration_au: f32,
    /// Temperature of the skin along the path, °C, where the model has that effect
    #[arg(long, default_value_t = 32.0)]
    temperature_c: f32,
    /// Width of the finger, mm, where the model has that effect
    #[arg(long, default_value_t = 16.0)]
    finger_width_mm: f32,
    /// Clock of the series at the start of the path, s, where the model has a drift
    #[arg(long, default_value_t = 0.0)]
    series_s: f32,
    /// Contact time since the last rest along the path, s, where the model has that effect; counted from the path unless said
    #[arg(long)]
    occlusion_s: Option<f32>,
    /// Response to write (CSV)
    #[arg(long, value_name = "RESPONSE.csv")]
    out: PathBuf,
}

/// A model file from disk, refused with its reason.
pub fn read_model(path: &std::path::Path) -> Result<ModelFile, Failure> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string()).map_err(Failure::Input)?;
    ModelFile::new(&bytes)
        .map_err(|error| Failure::Input(anyhow::Error::new(error).context(path.display().to_string())))
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let file = read_model(&args.model)?;
    if let Some(runs) = &args.runs {
        return along_runs(args, &file, runs);
    }
    let Some(path_file) = &args.path else { return Err(Failure::Input(anyhow::anyhow!("--path is missing"))) };
    let path = fingerpad_fe::load_path::path_csv::read(path_file)?;
    let mixed = path.drives[1] != path.drives[2];
    if mixed {
        return Err(Failure::Input(anyhow::anyhow!(
            "{}: one slide is driven by displacement and the other by force; the reduced model drives both alike",
            path_file.display()
        )));
    }
    let file = file.file();
    let rows = if file.effects.is_empty() {
        simulate_path(&file.model, &path)
    } else {
        let effects = Effects::new(file.effects)
            .map_err(|error| Failure::Input(anyhow::Error::new(error).context(args.model.display().to_string())))?;
        let surroundings = Surroundings {
            hydration_au: args.hydration_au,
            temperature_c: args.temperature_c,
            finger_width_mm: args.finger_width_mm,
            series_s: args.series_s,
            occlusion_s: args.occlusion_s,
            ..Surroundings::default()
        };
        simulate_path_with_effects(&file.model, &effects, surroundings, &path).ok_or_else(|| {
            Failure::Input(anyhow::anyhow!(
                "{}: driven by force; {} has effects, which know motions alone",
                path_file.display(),
                args.model.display()
            ))
        })?
    };
    let responses: Vec<_> = rows.iter().map(|r| r.response).collect();
    let extra: Vec<_> =
        rows.iter().map(|r| [r.friction_limit_n, r.slip_margin, r.band_normal_n, r.band_friction_n]).collect();
    fingerpad_fe::load_path::response_csv::write_with_extra(&args.out, &responses, &extra)?;
    println!("{}: {} rows", args.out.display(), rows.len());
    Ok(())
}

/// Prediction and residual of measured runs, in the conditions that were recorded.
fn along_runs(args: &Args, file: &ModelFile, path: &std::path::Path) -> Result<(), Failure> {
    let mut set = super::diagnose::read(path)?;
    let file = file.file();
    // A diagnosis that corrected columns with reading errors left the way in the file.
    let corrections: Vec<Correction> = serde_json::from_str::<serde_json::Value>(file.meta)
        .ok()
        .and_then(|meta| serde_json::from_value(meta.get("column_corrections")?.clone()).ok())
        .unwrap_or_default();
    corrections.iter().for_each(|c| c.apply(&mut set));
    let effects = Effects::new(file.effects)
        .map_err(|error| Failure::Input(anyhow::Error::new(error).context(args.model.display().to_string())))?;
    let (rms_n, predicted) = replay_all(&file.model, &effects, &set);
    formats::atomic_write(&args.out, |out| {
        writeln!(
            out,
            "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n,residual_normal_n,residual_x_n,residual_y_n"
        )?;
        let mut at = predicted.chunks_exact(3);
        for run in &set.runs {
            for ((row, [x, y]), reading) in run.rows.iter().zip(&run.slide_mm).zip(&run.force_n) {
                let p = at.next().expect("three numbers a row");
                let left: [f64; 3] = std::array::from_fn(|k| reading[k] - p[k]);
                let name = if run.labels.run.contains([',', '"']) {
                    format!("\"{}\"", run.labels.run.replace('"', "\"\""))
                } else {
                    run.labels.run.clone()
                };
                writeln!(
                    out,
                    "{name},{},{},{x},{y},{},{},{},{},{},{}",
                    row.t_s, row.depth_mm, p[0], p[1], p[2], left[0], left[1], left[2]
                )?;
            }
        }
        Ok(())
    })?;
    println!(
        "{}: {} runs, {} rows; root mean square residual normal {:.5}, x {:.5}, y {:.5} N",
        args.out.display(),
        set.runs.len(),
        set.rows(),
        rms_n[0],
        rms_n[1],
        rms_n[2]
    );
    Ok(())
}
