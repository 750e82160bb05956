//! Writes the scores of the present core along the stored runs into the shipped model files, and the bands of the pad, which are
//! made from the runs that are not held out. All other numbers are kept.
//!
//! `cargo xtask scores` runs this if the bits of a step have changed, but no model is to be fitted.

use std::path::{Path, PathBuf};

use fingerpad::File;
use fingerpad::build::Data;
use fingerpad::host::PadModelFile;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::pad::{PadMeta, PadModel};
use fingerpad_reduce::{Meta, Run};
use fingerpad_tests::Failure;

fn main() -> Result<(), Failure> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(data.join("runs"))?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    files.retain(|file| file.extension().is_some_and(|ending| ending == "fprun"));
    files.sort();
    let runs: Vec<Run> =
        files.iter().map(|file| Ok(Run::from_bytes(&std::fs::read(file)?, file)?)).collect::<Result<_, Failure>>()?;
    rescore(&data.join("models/fingertip.fpm"), &runs)?;
    rescore_pad(&data.join("models/fingertip-pad.fpm"), &runs)
}

fn rescore(path: &Path, runs: &[Run]) -> Result<(), Failure> {
    let bytes = std::fs::read(path)?;
    let mut aligned = vec![0u64; bytes.len().div_ceil(8)];
    let whole: &mut [u8] = bytemuck::cast_slice_mut(&mut aligned);
    whole[..bytes.len()].copy_from_slice(&bytes);
    let file = File::from_bytes(&whole[..bytes.len()]).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut meta: Meta = serde_json::from_str(file.meta)?;
    let of_fit = |run: &&Run| run.settings_hash == meta.settings_hash && run.is_representable();
    let of_fit: Vec<Run> = runs.iter().filter(of_fit).cloned().collect();
    meta.rescore(&file.model, &of_fit);
    let text = serde_json::to_string(&meta)?;
    let mut out = vec![0; Data::file_length(file.effects, &text)];
    file.model.data().write_file(file.effects, &text, &mut out)?;
    std::fs::write(path, out)?;
    println!("{}: {:?}", path.display(), meta.held_out);
    Ok(())
}

fn rescore_pad(path: &Path, runs: &[Run]) -> Result<(), Failure> {
    let file = PadModelFile::new(&std::fs::read(path)?).map_err(|e| format!("{}: {e}", path.display()))?;
    let pad = file.file().pad;
    let mut meta: PadMeta = serde_json::from_str(file.file().meta)?;
    let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
    let outline = config.finger()?.0.outline.ok_or("the shipped finger has a smooth surface")?;
    let (held_out, of_fit): (Vec<&Run>, Vec<&Run>) = runs
        .iter()
        .filter(|run| run.settings_hash == meta.settings_hash && run.samples.len() > 3)
        .partition(|run| run.held_out);
    let mut model = PadModel::of(&pad);
    model.set_bands(&of_fit, &outline);
    meta.fitted_runs[1] = of_fit.len();
    meta.rescore(&model, &held_out, &outline, &config.friction);
    std::fs::write(path, model.file(pad.relaxation(), &serde_json::to_string(&meta)?)?)?;
    println!("{}: {:?}", path.display(), meta.held_out);
    Ok(())
}
