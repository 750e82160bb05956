//! The pad beside held-out runs of the finite elements: rolling, a wobble, curved bodies, deep presses.

use std::path::Path;

use fingerpad::Response;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::pad::{PadModel, replay};
use fingerpad_reduce::{Run, Sample};
use fingerpad_report::{Trace, TraceChart, traces_svg};

use crate::Failure;

/// A picture: file name and SVG.
type Picture = (&'static str, String);

/// Draws them.
///
/// # Errors
/// A run that is not there or cannot be read.
pub fn along_runs(model: &PadModel, folder: &Path) -> Result<Vec<Picture>, Failure> {
    let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
    let outline = config.finger()?.0.outline.ok_or("a smooth finger")?;
    let both = |name: &str| -> Result<(Run, Vec<Response<f64>>), Failure> {
        let run = find(folder, name)?;
        let answers = replay(model, &run, &outline);
        Ok((run, answers))
    };
    let over_time = |title: &str, name: &str| -> Result<[TraceChart; 2], Failure> {
        let (run, answers) = both(name)?;
        let time = |s: &Sample| f64::from(s.t_s);
        Ok([
            pair(&format!("{title}: normal force ({name})"), "Time t, s", &run, &answers, &time, &NORMAL),
            pair(&format!("{title}: friction ({name})"), "Time t, s", &run, &answers, &time, &FRICTION),
        ])
    };
    let on_body = |title: &str, name: &str| -> Result<TraceChart, Failure> {
        let (run, answers) = both(name)?;
        let time = |s: &Sample| f64::from(s.t_s);
        Ok(pair(&format!("{title}: friction ({name})"), "Time t, s", &run, &answers, &time, &FRICTION))
    };
    let (run, answers) = both("deep-07h")?;
    let depth = |s: &Sample| f64::from(s.depth_mm);
    let deep = [
        pair("Pressed deep: normal force (deep-07h)", "Depth d, mm", &run, &answers, &depth, &NORMAL),
        on_body("The same", "deep-07h")?,
    ];
    let bodies = [
        on_body("Ball of 20 mm", "body-07h")?,
        on_body("Rod of 20 mm", "body-04h")?,
        on_body("Edge rounded by 2 mm", "body-05h")?,
    ];
    let pictures: [(_, Vec<TraceChart>); 4] = [
        ("pad-rolling.svg", over_time("Rolling on a table", "combined-00h")?.into()),
        ("pad-wobble.svg", over_time("Wobbling", "combined-03h")?.into()),
        ("pad-bodies.svg", bodies.into()),
        ("pad-deep.svg", deep.into()),
    ];
    Ok(pictures.map(|(name, charts)| (name, traces_svg(&charts))).into())
}

/// The plotted quantity: its label, and its values by the finite elements and by the pad.
struct Quantity {
    label: &'static str,
    of_elements: fn(&Sample) -> f64,
    of_pad: fn(&Response<f64>) -> f64,
}

const NORMAL: Quantity = Quantity {
    label: "Normal force N, newton",
    of_elements: |s| f64::from(s.normal_force_n),
    of_pad: |r| r.normal_force_n,
};

const FRICTION: Quantity = Quantity {
    label: "Friction F, newton",
    of_elements: |s| f64::from(s.friction_n[0].hypot(s.friction_n[1])),
    of_pad: |r| r.friction_n[0].hypot(r.friction_n[1]),
};

fn pair(
    title: &str,
    over: &str,
    run: &Run,
    answers: &[Response<f64>],
    x: &dyn Fn(&Sample) -> f64,
    quantity: &Quantity,
) -> TraceChart {
    let elements = run.samples.iter().map(|s| [x(s), (quantity.of_elements)(s)]).collect();
    let of_pad = run.samples.iter().zip(answers).map(|(s, r)| [x(s), (quantity.of_pad)(r)]).collect();
    let trace = |name: &str, points, is_dots| Trace { name: name.to_owned(), points, is_dots, ..Trace::default() };
    TraceChart {
        title: title.to_owned(),
        labels: [over.to_owned(), quantity.label.to_owned()],
        traces: vec![trace("pad", of_pad, false), trace("finite elements", elements, true)],
        ..TraceChart::default()
    }
}

/// The run of a name, with any settings.
fn find(folder: &Path, name: &str) -> Result<Run, Failure> {
    for entry in std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))? {
        let file = entry?.path();
        if file.file_name().is_some_and(|f| f.to_string_lossy().starts_with(&format!("{name}."))) {
            return Ok(Run::from_bytes(&std::fs::read(&file)?, &file)?);
        }
    }
    Err(format!("{}: no run {name}", folder.display()).into())
}
