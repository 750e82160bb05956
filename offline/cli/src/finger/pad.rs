//! The pad of a finger: the reduced model for every pose and body, from the finger's compliance and a few finite-element runs.

use std::path::Path;

use fingerpad_fe::contact::Outline;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path;
use fingerpad_formats::atomic_write;
use fingerpad_reduce::pad::{MOST_PATCHES, MadePad, PadSettings, make_pad};
use fingerpad_reduce::{Run, Tip, outline};

use crate::progress::during;
use crate::{Failure, make_finger, make_finger_for};

/// A number of patches for which pads are made.
pub(super) fn patches(text: &str) -> Result<usize, String> {
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
