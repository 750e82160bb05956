//! The page of a finger: its models beside its finite elements.

use std::path::Path;

use fingerpad::Motion;
use fingerpad::build::Data;
use fingerpad::host::PadModelFile;
use fingerpad::pad::{Pad, PadState, PatchState, Plane};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{self, Drive, Snapshot, Waypoint};
use fingerpad_fe::mesh::Mesh;
use fingerpad_reduce::pad::MOST_PATCHES;
use fingerpad_reduce::{self as reduce, CurvePoint, Group, Kind, ReduceError, Run, Sample, Settings, Verdict};
use fingerpad_report::{self as report, StickMap, TipModels, TipReport};

use super::make::Models;
use super::runs::follow;
use crate::progress::during;
use crate::{Bars, Failure, LARGER_PADS, make_finger_for, results};

/// Stick ratios of the finite elements at which the contact is shown.
const SHOWN: [f64; 4] = [0.9, 0.6, 0.3, 0.02];
/// Length of the page's slides over that of the middle slide of the runs, so that they end in full slip, and their parts whose ends are rows.
const LONGER: f64 = 2.5;
const PARTS: usize = 40;
/// Iterations after which a slide of the page ends early.
const MOST_ITERATIONS: u32 = 400;
/// Longest step of the pad, mm.
const STEP_MM: f64 = 0.05;

/// Writes page, numbers and figures; with settings for a `curve` beds of other sizes are fitted for it, which takes minutes: the page is
/// written before without them.
pub(super) fn write(folder: &Path, models: &Models, config: &Config, curve: Option<&Settings>) -> Result<(), Failure> {
    let file = models
        .pad
        .as_ref()
        .map(|(pad, ..)| -> Result<PadModelFile, ReduceError> { Ok(PadModelFile::new(&pad.file()?)?) });
    let file = file.transpose()?;
    let pad = file.as_ref().map(|file| file.file().pad);
    let shown = shown(config, &models.runs, pad.as_ref())?;
    let write = |sizes: &[CurvePoint]| -> Result<(), Failure> {
        let page = report_of(models, config, pad.as_ref(), &shown.slides, sizes)?;
        let rendered = report::render_tip(&page, &shown.mesh, &shown.maps).map_err(|e| Failure::Numerics(e.into()))?;
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

/// The finite elements that the page needs beside the runs.
struct Shown {
    mesh: Mesh,
    /// The contact of finite elements and pad along a slide along x.
    maps: Vec<StickMap>,
    /// Slides along x and y from rest.
    slides: Vec<Run>,
}

/// Follows slides along x and y as deep as the middle one of the straight slides of the runs, as far as the finite elements can.
fn shown(config: &Config, runs: &[Run], pad: Option<&Pad<'_>>) -> Result<Shown, Failure> {
    let end = |run: &Run| {
        run.samples.last().map_or([0.0; 2], |s| [s.depth_mm, s.slide_mm[0].hypot(s.slide_mm[1])].map(f64::from))
    };
    let is_straight = |run: &&Run| run.kind == Kind::Straight && run.is_representable() && run.ended_early.is_none();
    let mut straight: Vec<&Run> = runs.iter().filter(is_straight).collect();
    straight.sort_by(|a, b| end(a)[0].total_cmp(&end(b)[0]));
    let Some(middle) = straight.get(straight.len() / 2) else {
        return Ok(Shown { mesh: make_finger_for(config, &[])?.0.mesh, maps: Vec::new(), slides: Vec::new() });
    };
    let paths = [[1.0, 0.0], [0.0, 1.0]].map(|direction| slide(end(middle), direction));
    let (finger, _) = config.finger_reaching(&paths.each_ref(), LARGER_PADS[0])?;
    let (mut maps, mut slides) = (Vec::new(), Vec::new());
    for (axis, path) in paths.into_iter().enumerate() {
        let rows: Vec<usize> = if axis == 0 { (2..path.waypoints.len()).collect() } else { Vec::new() };
        let mut problem = config.problem(&finger);
        problem.half = problem.half.filter(|_| path.is_symmetric());
        let name = format!("slide along {}", ["x", "y"][axis]);
        let found = follow(&problem, (&name, &path), &rows, None, &Bars::default(), MOST_ITERATIONS)?;
        let trajectory = found.trajectory;
        let patches = pad.filter(|_| axis == 0).map(|pad| patches_along(pad, &path)).unwrap_or_default();
        slides.push(Run {
            name,
            ended_early: found.ended_early,
            samples: trajectory.responses.iter().map(Sample::from).collect(),
            path,
            ..(*middle).clone()
        });
        let mut snapshots: Vec<(usize, Snapshot)> = trajectory.snapshots.into_iter().enumerate().collect();
        for stick in SHOWN {
            let far = |(_, s): &(usize, Snapshot)| (s.response.stick_ratio - stick).abs();
            let nearest = (0..snapshots.len()).min_by(|a, b| far(&snapshots[*a]).total_cmp(&far(&snapshots[*b])));
            let Some((k, elements)) = nearest.map(|at| snapshots.remove(at)) else { break };
            maps.push(StickMap { elements, patches: patches.get(k).cloned().unwrap_or_default() });
        }
    }
    maps.sort_by(|a, b| a.elements.response.slide_x_mm.total_cmp(&b.elements.response.slide_x_mm));
    Ok(Shown { mesh: finger.mesh, maps, slides })
}

/// A press, and a slide from rest in short parts.
fn slide([depth_mm, slide_mm]: [f64; 2], [x, y]: [f64; 2]) -> load_path::Path {
    let at = |part: usize| LONGER * slide_mm * part as f64 / PARTS as f64;
    let place =
        |t_s: usize, normal: f64, slide_mm: f64| Waypoint { t_s: t_s as f64, normal, x: x * slide_mm, y: y * slide_mm };
    let parts = (1..=PARTS).map(|part| place(1 + part, depth_mm, at(part)));
    let waypoints = [place(0, 0.0, 0.0), place(1, depth_mm, 0.0)].into_iter().chain(parts).collect();
    load_path::Path::new([Drive::Displacement; 3], waypoints)
}

/// The patches of a pad at each slide of a path.
fn patches_along(pad: &Pad<'_>, path: &load_path::Path) -> Vec<Vec<PatchState>> {
    let Ok(mut state) = PadState::<MOST_PATCHES>::new(pad) else { return Vec::new() };
    let pose = [pad.numbers.neutral_pitch_deg, 0.0];
    let mut maps = Vec::new();
    for pair in path.waypoints.windows(2) {
        let (deeper, further) = (pair[1].normal - pair[0].normal, pair[1].x - pair[0].x);
        let steps = (deeper.max(further) / STEP_MM).ceil().max(1.0) as usize;
        for step in 1..=steps {
            let depth_mm = (pair[0].normal + deeper * step as f64 / steps as f64) as f32;
            let slide_increment_mm = [(further / steps as f64) as f32, 0.0];
            pad.step(
                &mut state,
                &Plane,
                Motion { depth_mm, slide_increment_mm, dt_s: 1e-3, ..Motion::default() },
                pose,
            );
        }
        if further > 0.0 {
            maps.push(pad.patch_states(&state, &Plane)[..pad.patches.len()].to_vec());
        }
    }
    maps
}
