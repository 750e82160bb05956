//! `fingerpad phantom`: the parametric fingertip as a labelled volume.

use std::path::PathBuf;

use fingerpad_fe::experiment::ConfigError;
use fingerpad_fe::mesh::volume::{PhantomSettings, label, phantom};
use fingerpad_formats as formats;

use super::{Failure, Mark, Model, Outputs, progress};

/// Write the parametric fingertip as a labelled volume (outside 0, soft tissue 1, bone 2, nail 3).
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad phantom --out finger.nrrd                          512 x 128 x 128 voxels
  fingerpad phantom --shape a --out finger.nii.gz              NIfTI
  fingerpad phantom --voxels 200 100 60 --out flat.nrrd        flat voxels
  fingerpad mesh --volume finger.nrrd --out finger.vtu         and back to a mesh")]
pub struct Args {
    #[command(flatten)]
    model: Model,
    /// Volume to write; its ending decides the format: .nrrd (gzip), .nii or .nii.gz
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Voxels along the finger, across it and up
    #[arg(long, num_args = 3, value_names = ["NX", "NY", "NZ"])]
    voxels: Option<Vec<usize>>,
    /// Size of the volume, mm
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    extent_mm: Option<Vec<f64>>,
    /// Air before the tip, mm
    #[arg(long, value_name = "MM")]
    margin_mm: Option<f64>,
    /// Leave the nail out of the labels
    #[arg(long)]
    no_nail: bool,
    /// Replace a file at --out that this command did not write
    #[arg(long)]
    force: bool,
}

/// Most voxels of a volume, a byte each.
const MOST_VOXELS: u128 = 500_000_000;

/// Description in the headers of these volumes.
const LABELS: &str = "labels: 0 outside, 1 soft tissue, 2 bone, 3 nail";

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let config = args.model.config()?;
    if config.volume.is_some() || config.imported.is_some() {
        return Err(Failure::Input(anyhow::anyhow!("a phantom is made of a parametric shape: give --shape")));
    }
    let mut settings = PhantomSettings { nail: !args.no_nail, ..Default::default() };
    if let Some(&[x, y, z]) = args.voxels.as_deref() {
        settings.voxels = [x, y, z];
    }
    if let Some(&[x, y, z]) = args.extent_mm.as_deref() {
        settings.extent_mm = [x, y, z];
    }
    settings.margin_mm = args.margin_mm.unwrap_or(settings.margin_mm);
    if !(settings.margin_mm.is_finite() && settings.margin_mm >= 0.0) {
        return Err(Failure::Input(anyhow::anyhow!("--margin-mm {}: must be a number from 0", settings.margin_mm)));
    }
    let shape = config.fingertip_shape()?;
    formats::volume::check_name(&args.out)?;
    let [i, j, k] = settings.voxels;
    let voxels = [i, j, k].iter().map(|n| *n as u128).product::<u128>();
    if voxels > MOST_VOXELS {
        return Err(Failure::Input(anyhow::anyhow!(
            "--voxels {i} {j} {k}: {voxels:.2e} voxels; at most {MOST_VOXELS:.0e} are written",
            voxels = voxels as f64,
            MOST_VOXELS = MOST_VOXELS as f64
        )));
    }
    // NIfTI begins with the length of its header, 348.
    let marks = vec![Mark::holding("NRRD", LABELS), Mark::holding("\u{5c}\u{1}\0\0", LABELS)];
    let outputs = Outputs::beside(args.model.inputs(&config)).file("--out", Some(&args.out), marks);
    outputs.force(args.force).prepare()?;
    let volume = progress::during("voxels", |_| phantom(&shape, &settings)).map_err(ConfigError::from)?;
    progress::during("writing", |_| formats::volume::write(&args.out, &volume))?;
    let [hx, hy, hz] = settings.spacing_mm();
    println!("{}: {i} x {j} x {k} voxels of {hx:.4} x {hy:.4} x {hz:.4} mm", args.out.display());
    let names =
        [(label::OUTSIDE, "outside"), (label::SOFT, "soft tissue"), (label::BONE, "bone"), (label::NAIL, "nail")];
    let counts = volume.counts();
    for (label, name) in names.into_iter().filter(|(label, _)| counts.contains_key(label)) {
        let voxels = counts[&label];
        println!("label {label} {name:>12}: {voxels:>9} voxels, {:>9.1} mm³", voxels as f64 * hx * hy * hz);
    }
    Ok(())
}
