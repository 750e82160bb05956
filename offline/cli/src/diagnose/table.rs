//! `fingerpad diagnose table`: a measured table against the finite elements.

use std::path::Path;
use std::time::Instant;

use anyhow::anyhow;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_formats::ColumnNames;
use fingerpad_identify::table_diagnosis::{self, Finding, Input, MeasuredTable};
use fingerpad_identify::{Hooks, IdentifyError, Settings, StateCache, table_csv};
use fingerpad_reduce::DesignSettings;
use fingerpad_report as report;

use super::arguments::TableArgs;
use super::input_files::trace_input;
use super::result_files::{prepare, write_files};
use crate::config::ConfigFile;
use crate::progress::counter;
use crate::{Failure, go_on, keeping};

/// Files of a diagnosis of a table beside the report.
pub const CORRECTED_CONFIG: &str = "corrected.toml";
pub const CORRECTED_SHAPE: &str = "corrected_shape.toml";
pub const CORRECTED_TABLE: &str = "corrected_table.csv";
pub const SIDE_BY_SIDE: &str = "side_by_side.csv";
/// Steady slides that were computed, in a folder of their own; kept for the next run.
const STATES: &str = "fe/steady_slides.bin";

/// Diagnoses a table against the finite elements.
pub fn run(args: &TableArgs) -> Result<(), Failure> {
    let (model, path, out) = (&args.finger, args.file.as_path(), args.output.out.as_path());
    let (map, unit) = (args.columns.map.as_deref(), args.columns.unit.as_deref());
    let names =
        &ColumnNames::parse(map, unit, &table_csv::KNOWN).map_err(|problem| Failure::Input(anyhow!(problem)))?;
    let configured = model.config()?;
    prepare(&args.output, [("--table", Some(path))].into_iter().chain(model.inputs(&configured)), &[out])?;
    let started = Instant::now();
    let (mut config, settings, design) = model.settings()?;
    if model.mesh_preset.is_none() && model.config.is_none() {
        config.mesh_preset = MeshPreset::Medium;
    }
    let rows = table_csv::read_partial(path, names, config.tissue.stiffness())?;
    table_csv::notes(path, names).iter().for_each(|note| eprintln!("note: {}: {note}", path.display()));
    let count = rows.len();
    let named = |problem: String| Failure::Input(anyhow!("{}: {problem}", path.display()));
    let table = MeasuredTable::new(rows).map_err(|e| named(e.to_string()))?;
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let bar = counter("finite elements", 1, "slides");
    let hooks = Hooks {
        go_on: &|| go_on().is_continue(),
        report_progress: &|_, line| {
            if let Some((done, all)) = line.split_once('/')
                && let (Ok(done), Ok(all)) = (done.parse(), all.parse())
            {
                bar.set(done, all, String::new());
            }
        },
    };
    let _keeping = keeping();
    let kept = out.join(STATES);
    let folder = kept.parent().expect("a file in a folder").to_path_buf();
    std::fs::create_dir_all(&folder).map_err(|source| fingerpad_formats::Error::File { path: folder, source })?;
    let cache = StateCache::open(&kept)?;
    let input = Input { config: &config, settings: &settings, table, jobs };
    let result = table_diagnosis::diagnose(&input, cache, &hooks);
    bar.finish_and_clear();
    let mut finding = result.map_err(|error| match error {
        IdentifyError::Interrupted => Failure::Interrupted(format!("finished slides are kept in {}", kept.display())),
        IdentifyError::Table(problem) => named(problem),
        other => other.into(),
    })?;
    let diagnosis = &mut finding.report.diagnosis;
    diagnosis.input = vec![trace_input(path, count, count, &finding.sentences)?];
    diagnosis.elapsed_s = started.elapsed().as_secs_f64();
    let files = files(&finding, &config, &settings, &design, path)?;
    let rendered = report::diagnosis::table::render(&finding).map_err(|e| Failure::Numerics(e.into()))?;
    let diagnosis = &finding.report.diagnosis;
    write_files(&args.output, rendered, diagnosis.next_experiment.as_ref(), files)?;
    println!("{}: verdict: {}", path.display(), report::diagnosis::word(diagnosis));
    finding.sentences.iter().for_each(|s| println!("{s}"));
    Ok(())
}

/// The corrected configuration, its shape if that changed, and both tables.
fn files(
    finding: &Finding,
    given: &Config,
    settings: &Settings,
    design: &DesignSettings,
    path: &Path,
) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let toml = |e: toml::ser::Error| Failure::Input(e.into());
    let mut files = Vec::new();
    let mut config = finding.corrected.config.clone();
    if let Some(shape) = &finding.corrected.shape {
        let text = toml::to_string(shape).map_err(toml)?;
        let text = format!("# Shape of the finger that explains {} best.\n{text}", path.display());
        files.push((CORRECTED_SHAPE.to_owned(), text.into_bytes()));
        config.shape.0 = CORRECTED_SHAPE.into();
    } else if Path::new(&given.shape.0).exists() {
        // The file is looked for beside the configuration, which lies in another folder.
        let place = std::fs::canonicalize(&given.shape.0).map_err(|e| Failure::Input(e.into()))?;
        config.shape.0 = place.display().to_string();
    }
    let verdict = report::diagnosis::word(&finding.report.diagnosis);
    let mut head = format!("# Finger and law that explain {} best; verdict: {verdict}.\n", path.display());
    finding.corrected.left_out.iter().for_each(|note| head += &format!("# Not in this file: {note}.\n"));
    let text = toml::to_string(&ConfigFile::of(&config, settings, design)).map_err(toml)?;
    files.push((CORRECTED_CONFIG.to_owned(), (head + &text).into_bytes()));
    files.push((CORRECTED_TABLE.to_owned(), finding.corrected_csv.clone().into_bytes()));
    files.push((SIDE_BY_SIDE.to_owned(), finding.side_by_side_csv.clone().into_bytes()));
    Ok(files)
}
