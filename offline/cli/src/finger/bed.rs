//! `fingerpad finger bed`: a bed of springs in any pose, from a pad.

use std::path::PathBuf;

use anyhow::anyhow;
use fingerpad_fe::contact::RubberFriction;
use fingerpad_reduce::pad::{PadMeta, runs_in_pose};
use fingerpad_reduce::{DesignSettings, Settings, is_retuned};

use super::springs::{fit, write};
use crate::model::{self, Loaded};
use crate::{Failure, Outputs};

/// Make a bed of springs from a pad, in any pose
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad finger bed --pitch-deg 40 --out steep.fpm                from the shipped pad, half a minute
  fingerpad finger bed --pad pad.fpm --pitch-deg 45 --roll-deg 15 --out rolled.fpm

A bed of springs takes 300 to 700 instructions a step and has one pose of the finger on a plane. This command fits one to
paths of a pad in the given pose: presses, slides, turns, changes of depth, noise, spin. No finite elements are run. Half
of the paths are left out of the fit; the printed errors and the bands are those along them, against the pad. The pad's
own errors in that pose come on top (docs/pad.md). A bed is symmetric about the finger's middle plane, so that its error
grows with the roll; a warning says where the pad should be used instead.")]
pub struct Args {
    /// Model file of the pad; without it the pad that ships with the program
    #[arg(long, value_name = "PAD.fpm")]
    pad: Option<PathBuf>,
    /// Pitch of the finger, degrees [default: the neutral one of the pad]
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    pitch_deg: Option<f64>,
    /// Roll of the finger, degrees
    #[arg(long, value_name = "A", default_value_t = 0.0, allow_negative_numbers = true)]
    roll_deg: f64,
    /// Model file to write
    #[arg(long, value_name = "MODEL.fpm")]
    out: PathBuf,
    /// Fits from beside the best one so far; the best on the paths of the fit is kept
    #[arg(long, value_name = "N", default_value_t = 0)]
    restarts: usize,
    /// Replace a file at --out, also a model
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (file, name) = match &args.pad {
        None => model::shipped_pad().map(|(pad, name)| (Loaded::Pad(pad), name))?,
        path => model::load_any(path.as_deref())?,
    };
    let Loaded::Pad(file) = file else {
        return Err(Failure::Input(anyhow!("--pad {name}: a bed of springs; this command takes a pad")));
    };
    Outputs::beside([("--pad", args.pad.as_deref())])
        .file("--out", Some(args.out.as_path()), Vec::new())
        .force(args.force)
        .prepare()?;
    let file = file.file();
    if file.pad.orthotropy().is_some() {
        return Err(Failure::Input(anyhow!(
            "--pad {name}: its friction is orthotropic (section ORTH), which a bed does not represent"
        )));
    }
    let numbers = file.pad.numbers;
    let pose_deg = [args.pitch_deg.unwrap_or_else(|| numbers.neutral_pitch_deg.into()), args.roll_deg];
    let mut settings = DesignSettings::default();
    settings.depth_mm[1] = settings.depth_mm[1].min(numbers.depth_max_mm.into());
    let mut hash = serde_json::from_str::<PadMeta>(file.meta).map_or_else(|_| String::new(), |meta| meta.settings_hash);
    if is_retuned(file.meta) {
        hash.push_str("-retuned");
    }
    let runs = runs_in_pose(&file.pad, pose_deg, &settings, &hash)?;
    println!("{name} in pitch {}° and roll {}°", pose_deg[0], pose_deg[1]);
    let [lambda, beta] = numbers.law.friction.map(f64::from);
    let friction = RubberFriction { lambda, beta, ..RubberFriction::default() };
    let settings = Settings { restarts: args.restarts, ..Settings::default() };
    let mut reduced = fit(&runs, &[], &friction, &settings)?;
    reduced.relaxation = *file.pad.relaxation();
    write(&reduced, &runs, &args.out)?;
    let scores = reduced.meta.held_out;
    let errors = [("friction", scores.friction_of_limit, 0.08), ("the spin moment", scores.moment_of_limit, 0.25)];
    for (what, error, most) in errors.into_iter().filter(|(_, error, most)| error > most) {
        eprintln!(
            "warning: {what} differs from the pad's by {:.0} % of its limit (RMS; a good bed stays below {:.0} %): use the pad in this pose",
            100.0 * error,
            100.0 * most
        );
    }
    Ok(())
}
