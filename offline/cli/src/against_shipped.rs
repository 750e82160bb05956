//! The runs of `fingerpad build` beside the reduced model that ships.

use fingerpad::host::ModelFile;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::{self as reduce, Agreement, Difference, Meta};
use fingerpad_report::{DepthResult, ReducedModel};

use super::{Failure, model};

/// Presets of the mesh, the nearest to the default first.
const PRESETS: [MeshPreset; 4] = [MeshPreset::Default, MeshPreset::Medium, MeshPreset::Fine, MeshPreset::Coarse];

/// Provenance of a model file that a fit has written; None for any other.
pub(super) fn meta_of(file: &ModelFile) -> Option<Meta> {
    serde_json::from_str(file.file().meta).ok()
}

/// The model that ships against the runs; None if it was fitted to another finger: shape, tissue or friction law. Mesh and
/// numerics may differ.
pub(super) fn compare_shipped(config: &Config, depths: &[DepthResult]) -> Result<Option<ReducedModel>, Failure> {
    let (file, name) = model::load(None)?;
    let Some(meta) = meta_of(&file) else { return Ok(None) };
    for mesh_preset in PRESETS {
        let same = Config { mesh_preset, numerics: Default::default(), ..config.clone() };
        if reduce::settings_hash(&same)? == meta.settings_hash {
            let model = file.file().model;
            let agreement = |depth: &DepthResult| reduce::agreement(&model, &depth.trajectory.responses);
            return Ok(Some(ReducedModel { name, depths: depths.iter().map(agreement).collect() }));
        }
    }
    Ok(None)
}

/// Prints the errors of a model along the runs.
pub(super) fn print_reduced(depths: &[DepthResult], reduced: &ReducedModel) {
    println!("\nreduced model {} less finite elements, over all rows of a depth", reduced.name);
    println!("          normal force                         friction");
    println!("depth     RMS, N   (%)   largest, N   (%)      RMS, N   (%)   largest, N   (%)");
    for (depth, Agreement { normal, friction }) in depths.iter().zip(&reduced.depths) {
        let of = |d: &Difference| {
            let [rms, largest] = d.percent();
            format!("{:8.4} {rms:5.2} {:12.4} {largest:5.2}", d.rms_n, d.largest_n)
        };
        println!("{:4.2} mm {}    {}", depth.depth_mm, of(normal), of(friction));
    }
}
