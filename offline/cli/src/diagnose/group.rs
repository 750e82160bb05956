//! `fingerpad diagnose group`: several fingers in one analysis.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use fingerpad_diagnose::{FEWEST, FingerSets, diagnose_group};
use fingerpad_report::{Picture, diagnosis::group};
use serde::Deserialize;

use super::arguments::GroupArgs;
use super::input_files::read_mapped;
use crate::progress::during;
use crate::{Failure, Outputs, results};

/// Results of a group.
const JSON: &str = "group.json";
const SIZES: &str = "group_sizes.csv";
const FOREST: &str = "group_sizes.svg";
const NAMES: &[&str] = &[JSON, SIZES, FOREST];

/// A line of the list of fingers; files are relative to the list's folder.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    finger: String,
    calibration: PathBuf,
    measured: PathBuf,
}

/// Reads the list of fingers.
fn read_list(path: &Path) -> anyhow::Result<Vec<Line>> {
    let place = path.display();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(path)?;
    let lines: Vec<Line> = reader
        .deserialize()
        .enumerate()
        .map(|(i, line)| {
            line.with_context(|| format!("{place}: finger {}: columns are finger, calibration, measured", i + 1))
        })
        .collect::<Result<_, _>>()?;
    if lines.len() < FEWEST {
        return Err(anyhow!("{place}: {} fingers; how far fingers differ shows from {FEWEST} on", lines.len()));
    }
    for (i, line) in lines.iter().enumerate() {
        if let Some(other) = lines[..i].iter().find(|other| other.finger == line.finger) {
            return Err(anyhow!("{place}: finger `{}` stands there twice", other.finger));
        }
    }
    Ok(lines)
}

/// Diagnoses the fingers of a list.
pub fn run(args: &GroupArgs) -> Result<(), Failure> {
    let (path, analysis) = (args.list.as_path(), &args.analysis);
    let (_, reference, options) = analysis.model_and_options()?;
    let maps = [analysis.column_map(&options.own, "calibration")?, analysis.column_map(&options.own, "measured")?];
    let lines = read_list(path).map_err(Failure::Input)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let files: Vec<[PathBuf; 2]> =
        lines.iter().map(|line| [&line.calibration, &line.measured].map(|file| folder.join(file))).collect();
    let inputs = files.iter().flatten().map(|file| ("--group", Some(file.as_path())));
    let given = [("--group", Some(path)), ("--model", analysis.model.as_deref()), ("--laws", analysis.laws.as_deref())];
    Outputs::beside(inputs.chain(given)).shared_folder("--out", &args.out, NAMES).prepare()?;
    let mut fingers = Vec::new();
    for (line, [calibration, measured]) in lines.iter().zip(&files) {
        fingers.push(FingerSets {
            name: line.finger.clone(),
            calibration: read_mapped(calibration, &maps[0])?,
            measured: read_mapped(measured, &maps[1])?,
        });
    }
    let report = during("group", |tell| diagnose_group(&fingers, &reference, &options, &mut |stage| tell(stage)))?;
    let json = serde_json::to_string_pretty(&report).map_err(|e| Failure::Numerics(e.into()))?;
    let mut written =
        vec![(JSON.to_owned(), (json + "\n").into_bytes()), (SIZES.to_owned(), group::sizes_csv(&report).into_bytes())];
    written.extend(group::forest(&report).iter().map(Picture::file));
    results::write(&args.out, &written)?;
    group::sentences(&report).iter().for_each(|sentence| println!("{sentence}"));
    Ok(())
}
