//! `fingerpad eval`: the reduced model, through the core, along a path.

use std::path::PathBuf;

use anyhow::Context;
use fingerpad::{Effects, Surroundings};
use fingerpad_offline::{
    io,
    reduce::{ModelFile, follow, follow_with_effects},
};

use super::Failure;

/// Follow a path of the plane with the reduced model
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm\\n0,0,0,0\\n1,1,0,0\\n3,1,4,0\\n' > path.csv
  fingerpad eval --model model.fpm --path path.csv --out response.csv

Paths are those of `simulate`: depth_mm or normal_force_n, slides or friction_x_n and friction_y_n. The response has the
columns of `simulate` and friction_limit_n, slip_margin, band_normal_n, band_friction_n: the half-widths within which
95 % of the finite-element runs lie that the fit did not see. Steps are at most 0.02 mm; all arithmetic is that of the
package on the microcontroller. A force out of reach leaves the nearest state and the status load_not_reached.")]
pub struct Args {
    /// Model file
    #[arg(long, value_name = "MODEL.fpm")]
    model: PathBuf,
    /// Path of the plane (CSV)
    #[arg(long, value_name = "PATH.csv")]
    path: PathBuf,
    /// Moisture of the skin along the path, corneometer units, where the model has that effect
    #[arg(long, default_value_t = 35.0)]
    hydration_au: f32,
    /// Temperature of the skin along the path, °C, where the model has that effect
    #[arg(long, default_value_t = 32.0)]
    temperature_c: f32,
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
    let path = io::path_csv::read(&args.path)?;
    let mixed = path.drives[1] != path.drives[2];
    if mixed {
        return Err(Failure::Input(anyhow::anyhow!(
            "{}: one slide is driven by displacement and the other by force; the reduced model drives both alike",
            args.path.display()
        )));
    }
    let file = file.file();
    let rows = if file.effects.is_empty() {
        follow(&file.model, &path)
    } else {
        let effects = Effects::new(file.effects)
            .map_err(|error| Failure::Input(anyhow::Error::new(error).context(args.model.display().to_string())))?;
        let surroundings = Surroundings { hydration_au: args.hydration_au, temperature_c: args.temperature_c };
        follow_with_effects(&file.model, &effects, surroundings, &path).ok_or_else(|| {
            Failure::Input(anyhow::anyhow!(
                "{}: driven by force; {} has effects, which know motions alone",
                args.path.display(),
                args.model.display()
            ))
        })?
    };
    let responses: Vec<_> = rows.iter().map(|r| r.response).collect();
    let extra: Vec<_> =
        rows.iter().map(|r| [r.friction_limit_n, r.slip_margin, r.band_normal_n, r.band_friction_n]).collect();
    io::response_csv::write_with_extra(&args.out, &responses, &extra)?;
    println!("{}: {} rows", args.out.display(), rows.len());
    Ok(())
}
