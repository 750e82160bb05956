//! The reduced model that `fingerpad build` adds to its results.

use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::follow_path;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_identify::population::Share;
use fingerpad_reduce::{self as reduce, DesignSettings, Run};

use super::build::Args;
use super::{Failure, bar, go_on, make_finger_for, run_failure, show};

/// The path of the design that is run again and compared with what is stored.
const AGAIN: &str = "straight-00";

/// The reduced model of this finger: from stored runs of these settings, with `--full` from runs made here.
pub(super) fn reduction(args: &Args, config: &Config, design: &DesignSettings) -> Result<(), Failure> {
    let hash = reduce::settings_hash(config)?;
    let made = args.out.join("design");
    if args.full {
        super::design::run(config, design, &made, Share::ALL, args.jobs)?;
    }
    let folder = if args.full { Some(made.as_path()) } else { args.runs.as_deref() };
    let all = super::reduce::read_runs(folder)?;
    // Runs of the same finger on another mesh serve where there are none on this one; the comparison below tells by how much
    // they differ.
    let other_meshes = [MeshPreset::Default, MeshPreset::Medium, MeshPreset::Fine, MeshPreset::Coarse]
        .map(|mesh_preset| reduce::settings_hash(&Config { mesh_preset, ..config.clone() }));
    let mut hashes = vec![hash.clone()];
    hashes.extend(other_meshes.into_iter().collect::<Result<Vec<_>, _>>()?);
    let found = hashes.iter().find(|hash| all.iter().any(|run| run.settings_hash == **hash));
    let runs: Vec<Run> = all.into_iter().filter(|run| Some(&run.settings_hash) == found).collect();
    if runs.is_empty() {
        let place = folder.map_or("the program".into(), |f| f.display().to_string());
        println!("no reduced model: {place} has no runs of settings {hash}; --full makes them");
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
    super::reduce::fit::<{ fingerpad::SPRINGS }>(
        &super::reduce::representable(runs),
        config.friction.beta,
        &fingerpad_reduce::Settings::default(),
        &args.out.join("model.fpm"),
    )?;
    Ok(())
}
