//! `fingerpad pad`: the reduced model for every pose and body, from the finger's compliance and a few finite-element runs.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use fingerpad_fe::contact::Outline;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_formats::atomic_write;
use fingerpad_reduce::pad::{FitLimits, MOST_PATCHES, MadePad, PadSettings, PadSize, make_pad};
use fingerpad_reduce::{Run, Tip, outline};

use super::progress::during;
use super::reduce::read_runs;
use super::{Failure, Model, Outputs, make_finger, make_finger_for};

/// Make the pad of a finger: the reduced model for every pose, every rigid body and the forces of a hand
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad pad --out my-pad.fpm                    from the runs that ship with the program
  fingerpad pad --patches 24 --out small.fpm        smaller and faster on a microcontroller
  fingerpad pad --mesh-preset medium --runs runs --out mine.fpm
                                                    from a folder of runs that `reduce --design` made

`eval --model my-pad.fpm` follows paths with it, in every pose and on other bodies.

A pad is patches of the fingertip's skin on the finger's own compliance, which comes from one factorisation of its stiffness at
rest; what nonlinear runs decide, 40 numbers, is fitted to some of them. Runs that are held out are not seen by the fit: the errors
that the command prints are along them. The model file holds pad, bands and these errors.")]
pub struct Args {
    /// Model file to write
    #[arg(long, value_name = "PAD.fpm")]
    out: PathBuf,
    /// Folder of finite-element runs of this finger [default: those that ship with the program, of the default settings]
    #[arg(long, value_name = "DIR")]
    runs: Option<PathBuf>,
    /// Patches, nearly: they come in mirrored pairs
    #[arg(long, value_name = "N", default_value_t = 37, value_parser = patches)]
    patches: usize,
    /// Runs to fit to, shared out over the kinds of motion by their number; each kind gives at least 15 % of N. All
    /// that are not held out give the bands
    #[arg(long, value_name = "N", default_value_t = 80)]
    fit_runs: usize,
    /// Patience of the fit: evaluations for each number at most
    #[arg(long, value_name = "N", default_value_t = 20)]
    patience: usize,
    /// Replace a file at --out, also a model
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    model: Model,
}

/// A number of patches for which pads are made.
fn patches(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (6..=MOST_PATCHES - 2).contains(&count) => Ok(count),
        _ => Err(format!("must be a whole number from 6 to {}", MOST_PATCHES - 2)),
    }
}

/// Depth of the paths whose contacts the patches share out, on a tip of the shipped finger's size, mm. Deeper contacts lie on the same patches and on the bulk's stiffening:
/// patches for their whole skin would be too large for the usual ones.
const SKIN_MM: f64 = 3.0;

/// Largest depth of a path, mm; that of a path which a force drives is not known.
fn deepest_mm(path: &load_path::Path) -> f64 {
    match path.drives[0] {
        load_path::Drive::Displacement => path.waypoints.iter().map(|w| w.normal).fold(0.0, f64::max),
        load_path::Drive::Force => f64::INFINITY,
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut config = args.model.config()?;
    if args.runs.is_none() && args.model.mesh_preset.is_none() {
        // The mesh of the runs that ship.
        config.mesh_preset = MeshPreset::Medium;
    }
    Outputs::beside(args.model.inputs(&config))
        .file("--out", Some(args.out.as_path()), Vec::new())
        .force(args.force)
        .prepare()?;
    let runs = read_runs(args.runs.as_deref())?;
    let hash = fingerpad_reduce::settings_hash(&config)?;
    if let Some(other) = runs.iter().find(|run| run.settings_hash != hash) {
        return Err(Failure::Input(anyhow!(
            "run {} is of other settings ({}) than this finger ({hash}): take the --config, --shape and --mesh-preset of its design",
            other.name,
            other.settings_hash
        )));
    }
    let settings = PadSettings {
        size: PadSize { patches: args.patches },
        runs: args.fit_runs,
        limits: FitLimits { patience: args.patience, hold: false },
        ..PadSettings::default()
    };
    write(&make(&config, &runs, settings)?.0, &args.out)
}

/// Makes the pad of a finger from its runs and prints the errors along held-out runs; returns the finger's surface too.
pub(super) fn make(config: &Config, runs: &[Run], settings: PadSettings) -> Result<(MadePad, Outline), Failure> {
    let tip = Tip::of(&make_finger(config)?.0, &config.tissue, &config.friction)?;
    let skin_mm = SKIN_MM * tip.length;
    let paths: Vec<&load_path::Path> =
        runs.iter().map(|run| &run.path).filter(|path| deepest_mm(path) <= skin_mm).collect();
    let finger = make_finger_for(config, &paths)?.0;
    let outline = outline(&finger);
    let settings = PadSettings { tip, friction: config.friction, ..settings };
    let made = during("fit of the pad", |_| make_pad(&finger, &outline, runs, &settings))?;
    print_summary(&made);
    Ok((made, outline))
}

/// Writes the model file of a pad.
pub(super) fn write(made: &MadePad, out: &Path) -> Result<(), Failure> {
    let bytes = made.file()?;
    atomic_write(out, |w| w.write_all(&bytes))?;
    println!("{}: {} bytes", out.display(), bytes.len());
    Ok(())
}

fn print_summary(made: &MadePad) {
    let [fitted, of_bands] = made.meta.fitted_runs;
    println!(
        "{} patches, fitted to {fitted} runs, bands by {of_bands}; along the held-out runs:",
        made.model.patches.len()
    );
    println!(
        "{:<18} {:>4} {:>9} {:>11} {:>7} {:>10} {:>16}",
        "kind", "runs", "normal %", "friction %", "stick", "centre mm", "within bands %"
    );
    for (kind, s) in &made.meta.held_out {
        let [normal, friction] = s.in_band.map(|share| 100.0 * share);
        println!(
            "{kind:<18} {:>4} {:>9.2} {:>11.2} {:>7.3} {:>10.3} {normal:>9.1} {friction:>6.1}",
            s.runs,
            100.0 * s.normal,
            100.0 * s.friction,
            s.stick,
            s.centre_mm
        );
    }
}
