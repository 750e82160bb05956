//! The report of the reduced model from the runs and the fit: every run again through the core.
//!
//! May use reduce.

use fingerpad::ModelOf;
use fingerpad::build::Data;

use super::reduced::{PairRow, PathPair, ReducedReport, SizePoint};
use fingerpad_reduce::{CurvePoint, Kind, Reduced, Run, Scores, replay, strength};

/// Collects the data of the section.
///
/// * `verdict`: rows of the verdict with the columns `fingerpad_reduce::COLUMNS`; may be empty
///
/// # Errors
/// `fingerpad::Error` if the model is refused, which a finished reduction never is.
pub fn reduced_report(
    runs: &[Run],
    reduced: &Reduced,
    curve: &[CurvePoint],
    verdict: &[Vec<String>],
) -> Result<ReducedReport, fingerpad::Error> {
    let model = reduced.data.model()?;
    let meta = &reduced.meta;
    let coverage: Vec<String> = ["all", "stick", "partial slip", "slip"]
        .iter()
        .zip(&meta.coverage)
        .map(|(name, c)| format!("{name}: {:.1} / {:.1} %", 100.0 * c.normal, 100.0 * c.friction))
        .collect();
    let text = |name: &str, value: String| (name.to_owned(), value);
    Ok(ReducedReport {
        provenance: vec![
            text("Settings of the finite-element runs", meta.settings_hash.clone()),
            text("Program", meta.program_version.clone()),
            text("Paths in the fit, held out", format!("{}, {}", meta.paths[0], meta.paths[1])),
            text("Depth, mm", format!("{} to {:.2}", meta.ranges.depth_mm[0], meta.ranges.depth_mm[1])),
            text("Longest slide, mm", format!("{:.2}", meta.ranges.slide_mm)),
            text("Held-out rows within the band of 95 %, normal force / friction", coverage.join("; ")),
            text("Bytes of the model's numbers", size_of::<Data>().to_string()),
        ],
        verdict: verdict.to_vec(),
        table: table(reduced),
        // Pages show the pose of the fit.
        pairs: runs.iter().filter(|run| run.is_representable()).map(|run| pair(&model, run)).collect(),
        worst: meta.held_out.worst_friction.1.clone(),
        sizes: curve.iter().map(size).collect(),
    })
}

fn size(point: &CurvePoint) -> SizePoint {
    SizePoint {
        size: [point.springs, point.nodes],
        friction_percent: 100.0 * point.held_out.friction_of_limit,
        normal_percent: 100.0 * point.held_out.normal_of_range,
        stick_percent: 100.0 * point.held_out.stick_turned,
        default: point.springs == fingerpad::SPRINGS && point.nodes == fingerpad::NODES,
    }
}

fn table(reduced: &Reduced) -> Vec<Vec<String>> {
    let head = [
        "Paths",
        "number",
        "normal force, RMS of its range",
        "friction, RMS of the limit",
        "stick ratio, straight",
        "stick ratio, after turns",
        "regime right",
        "worst friction",
    ];
    let row = |name: &str, s: &Scores| {
        vec![
            name.to_owned(),
            s.paths.to_string(),
            format!("{:.2} %", 100.0 * s.normal_of_range),
            format!("{:.2} %", 100.0 * s.friction_of_limit),
            format!("{:.3}", s.stick_straight),
            format!("{:.3}", s.stick_turned),
            format!("{:.1} %", 100.0 * s.regime_right),
            format!("{:.1} % ({})", 100.0 * s.worst_friction.0, s.worst_friction.1),
        ]
    };
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.push(row("fit", &Scores::of(&reduced.scores, |s| !s.held_out)));
    rows.push(row("held out", &reduced.meta.held_out));
    for kind in Kind::ALL {
        let scores = Scores::of(&reduced.scores, |s| s.held_out && s.kind == kind);
        if scores.paths > 0 {
            rows.push(row(&format!("held out, {}", kind.as_str()), &scores));
        }
    }
    rows
}

fn pair<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, run: &Run) -> PathPair {
    let mut way_mm = 0.0;
    let mut before = run.samples.first().copied();
    let rows = run.samples.iter().zip(replay(model, run)).map(|(s, r)| {
        if let Some(b) = before.replace(*s) {
            let slide = (s.slide_mm[0] - b.slide_mm[0]).hypot(s.slide_mm[1] - b.slide_mm[1]);
            way_mm += f64::from(slide.hypot(s.depth_mm - b.depth_mm));
        }
        PairRow {
            way_mm,
            depth_mm: s.depth_mm.into(),
            slide_mm: s.slide_mm.map(f64::from),
            normal_force_n: [s.normal_force_n.into(), r.normal_force_n.into()],
            friction_n: [s.friction_n.map(f64::from), r.friction_n.map(f64::from)],
            stick_ratio: [s.stick_ratio.into(), r.stick_ratio.into()],
            band_n: [r.band_normal_n.into(), r.band_friction_n.into()],
            limit_n: strength(model, s.depth_mm),
        }
    });
    PathPair { name: run.name.clone(), kind: run.kind.as_str().into(), held_out: run.held_out, rows: rows.collect() }
}
