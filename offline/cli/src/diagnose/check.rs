//! `fingerpad diagnose check`: what is in the files, before any diagnosis.

use anyhow::anyhow;
use fingerpad_diagnose::{Survey, SurveyError, survey};

use super::arguments::CheckFiles;
use crate::Failure;

/// Prints what was understood of every file.
pub fn run(args: &CheckFiles) -> Result<(), Failure> {
    let look = |path: &std::path::PathBuf| survey(path, args.columns.map.as_deref(), args.columns.unit.as_deref());
    let found: Result<Vec<Survey>, SurveyError> = args.files.iter().map(look).collect();
    let found = found.map_err(|error| Failure::Input(anyhow!(error)))?;
    if args.json {
        let json = serde_json::to_string_pretty(&found).map_err(|e| Failure::Numerics(e.into()))?;
        println!("{json}");
    } else {
        found.iter().flat_map(Survey::lines).for_each(|line| println!("{line}"));
    }
    Ok(())
}
