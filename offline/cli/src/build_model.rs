//! The reduced model in the results of `fingerpad build`: comparison with the shipped model and, with `--fit`, a new fit.

use std::path::Path;

use fingerpad::host::ModelFile;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::follow_path;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_identify::population::Share;
use fingerpad_reduce::{self as reduce, Agreement, DesignSettings, Difference, Grade, Meta, Run};
use fingerpad_report::{DepthResult, ReducedModel};

use super::build::Args;
use super::{Failure, bar, go_on, make_finger_for, model, run_failure, show};

/// The path of the design that is rerun and compared with the stored run.
const AGAIN: &str = "straight-00";

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

/// The reduced models of this finger: a bed from stored runs of these settings or, with `--full`, from runs made here; without stored
/// runs a pad and a bed as `finger` makes them.
pub(super) fn reduction(args: &Args, config: &Config, design: &DesignSettings) -> Result<(), Failure> {
    let design = &super::finger::with_tip(config, design)?;
    let hash = reduce::settings_hash(config)?;
    let made = args.out.join("design");
    if args.full {
        super::design::run(config, design, &made, Share::ALL, args.jobs)?;
    }
    let folder = if args.full { Some(made.as_path()) } else { args.runs.as_deref() };
    let all = super::reduce::read_runs(folder)?;
    // If no runs exist for this mesh, those of the same finger on another mesh are used; the comparison below prints
    // the difference.
    let other_meshes = PRESETS.map(|mesh_preset| reduce::settings_hash(&Config { mesh_preset, ..config.clone() }));
    let mut hashes = vec![hash.clone()];
    hashes.extend(other_meshes.into_iter().collect::<Result<Vec<_>, _>>()?);
    let found = hashes.iter().find(|hash| all.iter().any(|run| run.settings_hash == **hash));
    let runs: Vec<Run> = all.into_iter().filter(|run| Some(&run.settings_hash) == found).collect();
    if runs.is_empty() && args.runs.is_none() {
        println!("no stored runs of settings {hash}: a quick design, as by `fingerpad finger`");
        super::design::run(config, &design.clone().quick(), &made, Share::ALL, args.jobs)?;
        let files = ["pad.fpm", "model.fpm"].map(|name| args.out.join(name));
        let models = super::finger::models(config, &made, design, true)?;
        models.print();
        if models.grade() == Grade::NotUsable {
            eprintln!("warning: the reduced models are not usable and are not written; `fingerpad finger` has more");
            return Ok(());
        }
        return models.write([&files[0], &files[1]]);
    }
    if runs.is_empty() {
        let place = folder.map_or("the program".into(), |f| f.display().to_string());
        println!("no reduced model: {place} has no runs of settings {hash}");
        return Ok(());
    }
    let runs = super::reduce::representable(runs);
    let model_file = args.out.join("model.fpm");
    if !args.full && is_fitted(&model_file, &runs) {
        println!("{} was fitted to these runs before", model_file.display());
        return Ok(());
    }
    if found.is_some_and(|found| *found != hash) {
        println!("the stored runs behind the reduced model are of this finger on another mesh");
    }
    if !args.full
        && let Some(stored) = runs.iter().find(|run| run.name == AGAIN)
    {
        let (finger, _) = make_finger_for(config, &[&stored.path])?;
        let bar = bar(AGAIN.into());
        let again = follow_path(&config.problem(&finger), &stored.path, &[], &mut |progress| {
            show(&bar, &progress);
            go_on()
        });
        bar.finish_and_clear();
        let again = again.map_err(|e| run_failure(e, AGAIN, "the results so far are kept".into()))?;
        let [normal, friction] = stored.difference(&again.responses);
        println!(
            "stored run {AGAIN} made again: normal force within {:.2} %, friction within {:.2} % of their largest",
            100.0 * normal,
            100.0 * friction
        );
    }
    let reduced = super::reduce::fit(&runs, &[], &config.friction, &fingerpad_reduce::Settings::default())?;
    super::reduce::write(&reduced, &runs, &model_file)
}

/// Whether a file is the model that this program fits to these runs.
fn is_fitted(file: &Path, runs: &[Run]) -> bool {
    let model = std::fs::read(file).ok().and_then(|bytes| ModelFile::new(&bytes).ok());
    let Some(meta) = model.as_ref().and_then(meta_of) else { return false };
    let plain = || runs.iter().filter(|run| run.is_representable());
    let held_out = plain().filter(|run| run.held_out).count();
    let of_same_runs = meta.paths == [plain().count() - held_out, held_out]
        && runs.first().is_some_and(|run| run.settings_hash == meta.settings_hash);
    of_same_runs && meta.program_version == env!("CARGO_PKG_VERSION")
}
