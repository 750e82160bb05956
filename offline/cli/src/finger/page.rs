//! The page of a finger: its models beside its finite elements.

use std::path::Path;

use fingerpad::Relaxation;
use fingerpad::build::Data;
use fingerpad::host::PadModelFile;
use fingerpad::pad::Pad;
use fingerpad_fe::experiment::Config;
use fingerpad_reduce::{self as reduce, CurvePoint, Group, ReduceError, Run, Settings, Verdict};
use fingerpad_report::{self as report, TipModels, TipReport};

use super::full_slips::FullSlips;
use super::make::Models;
use crate::progress::during;
use crate::{Failure, results};

/// Writes page, numbers and figures; with settings for a `curve` beds of other sizes are fitted for it, which takes minutes: the page is
/// written before without them.
pub(super) fn write(
    folder: &Path,
    models: &Models,
    config: &Config,
    slides: &FullSlips,
    curve: Option<&Settings>,
) -> Result<(), Failure> {
    let file = models
        .pad
        .as_ref()
        .map(|(pad, ..)| -> Result<PadModelFile, ReduceError> { Ok(PadModelFile::new(&pad.file()?)?) });
    let file = file.transpose()?;
    // The page compares relaxed tissue.
    let pad = file.as_ref().map(|file| file.file().pad.with_relaxation(Relaxation::none()));
    let maps = slides.maps(pad.as_ref());
    let write = |sizes: &[CurvePoint]| -> Result<(), Failure> {
        let page = report_of(models, config, pad.as_ref(), &slides.runs, sizes)?;
        let rendered = report::render_tip(&page, &slides.mesh, &maps).map_err(|e| Failure::Numerics(e.into()))?;
        let figures = rendered.figures.len();
        results::write(folder, &rendered.files("", "reduced"))?;
        println!("{}: {figures} figures", folder.join("reduced.html").display());
        Ok(())
    };
    write(&[])?;
    if let Some(settings) = curve {
        let points = during("other sizes", |set_activity| {
            reduce::curve(&models.runs, &config.friction, settings, |share| {
                set_activity(&format!("other sizes, {:.0} %", 100.0 * share));
                true
            })
        })?;
        write(&points)?;
    }
    Ok(())
}

fn report_of(
    models: &Models,
    config: &Config,
    pad: Option<&Pad<'_>>,
    slides: &[Run],
    sizes: &[CurvePoint],
) -> Result<TipReport, Failure> {
    let bed = models.bed.as_ref().map(|(bed, _)| bed.data.model()).transpose().map_err(ReduceError::from)?;
    let outline = models.pad.as_ref().map(|(_, outline, _)| outline);
    let charted = TipModels { pad: pad.zip(outline), bed: bed.as_ref() };
    let law = &config.friction;
    let text = |name: &str, value: String| (name.to_owned(), value);
    let mut provenance = vec![
        text("Mesh", format!("{:?}", config.mesh_preset).to_lowercase()),
        text("Friction", format!("lambda {} MPa^(1 - beta), beta {}", law.lambda, law.beta)),
        text("Runs of finite elements", models.runs.len().to_string()),
        text("Settings of the runs", reduce::settings_hash(config)?),
        text("Program", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    if let Some((made, ..)) = &models.pad {
        let [fitted, of_bands] = made.meta.fitted_runs;
        let patches = made.model.patches.len();
        provenance.push(text("Pad", format!("{patches} patches, fitted to {fitted} runs, bands by {of_bands}")));
    }
    if let Some((bed, _)) = &models.bed {
        let [fitted, held_out] = bed.meta.paths;
        let of_pad = bed.meta.paths_of_pad;
        let depth = bed.meta.ranges.depth_mm;
        let runs = format!("fitted to {fitted} runs and {of_pad} paths of the pad, {held_out} held out");
        let bytes = size_of::<Data>();
        provenance.push(text("Bed", format!("{runs}; depths to {:.2} mm; {bytes} bytes of numbers", depth[1])));
    }
    let runs: Vec<Run> = models.runs.iter().chain(slides).cloned().collect();
    let grade = |(name, verdict): (&str, &Verdict)| {
        format!("{name} {}", verdict.worst(|group| group == Group::Neutral).as_str())
    };
    let grades: Vec<String> = models.named().map(grade).collect();
    Ok(TipReport {
        headline: format!("In the neutral pose: {}", grades.join(", ")),
        name: config.geometry_name(),
        verdict_in_words: models.named().map(|(name, verdict)| verdict.sentence(name)).collect(),
        verdict: models.verdicts(),
        bed: models.bed.as_ref().map_or_else(Vec::new, |(bed, _)| report::bed_table(bed)),
        provenance,
        groups: report::tip_charts(&runs, charted, sizes),
    })
}
