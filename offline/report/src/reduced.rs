//! The section on the reduced model: its responses over those of the finite-element model, and their differences.
//!
//! Main types: [`ReducedReport`], [`PathPair`]; [`render_reduced`] makes page, numbers and figures. Computes nothing
//! but histograms.

use fingerpad_reduce::{COLUMNS, GOOD};
use maud::html;
use serde::{Deserialize, Serialize};

use super::axes::{Axis, Panel, legend_text};
use super::canvas::{Canvas, Figure, Line, Marker, Text};
use super::colour::{Colour, ESTIMATE, GREY, INK, SERIES};
use super::html::{document, figures};
use super::{Picture, Rendered, ReportError};

/// One row of a path: position, and the results of each model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairRow {
    /// Length of the plane's path so far, mm.
    pub way_mm: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Slide, mm.
    pub slide_mm: [f64; 2],
    /// Normal force of the finite-element and of the reduced model, N.
    pub normal_force_n: [f64; 2],
    /// Friction of both, N.
    pub friction_n: [[f64; 2]; 2],
    /// Stick ratio of both.
    pub stick_ratio: [f64; 2],
    /// Half-widths of the band: normal force, each friction component, N.
    pub band_n: [f64; 2],
    /// Friction limit at the depth, N.
    pub limit_n: f64,
}

/// A path run by both models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathPair {
    /// Its name.
    pub name: String,
    /// Kind of the path.
    pub kind: String,
    /// Whether the path was left out of the fit.
    pub held_out: bool,
    /// Its rows.
    pub rows: Vec<PairRow>,
}

/// A size of the model on the curve of accuracy against cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizePoint {
    /// Elements and table nodes.
    pub size: [usize; 2],
    /// Friction error on held-out paths, % of the limit.
    pub friction_percent: f64,
    /// Normal-force error, % of the range.
    pub normal_percent: f64,
    /// Stick-ratio error after turns, %.
    pub stick_percent: f64,
    /// Whether it is the default.
    pub default: bool,
}

/// Everything that the section shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReducedReport {
    /// Settings' hash, versions, counts: name and value.
    pub provenance: Vec<(String, String)>,
    /// The verdict on each model and kind of motion, rows with the columns of `fingerpad_reduce::COLUMNS`; may be empty.
    pub verdict: Vec<Vec<String>>,
    /// The accuracy table: heading and rows.
    pub table: Vec<Vec<String>>,
    /// All paths.
    pub pairs: Vec<PathPair>,
    /// Name of the worst held-out path.
    pub worst: String,
    /// Accuracy against cost; may be empty.
    pub sizes: Vec<SizePoint>,
}

fn cap(way: &[PairRow]) -> f64 {
    way.last().map_or(0.0, |r| r.way_mm)
}

fn legend(canvas: &mut Canvas, at: (f64, f64)) {
    canvas.marker(Marker::Circle, (at.0, at.1), 3.5, INK, false);
    legend_text(canvas, (at.0 + 12.0, at.1), "finite elements");
    canvas.line(&[(at.0 + 120.0, at.1), (at.0 + 144.0, at.1)], Line::solid(INK, 2.0));
    legend_text(canvas, (at.0 + 152.0, at.1), "reduced model, through the core");
}

/// Draws one series of both models: points and line.
fn both(canvas: &mut Canvas, panel: &Panel, rows: impl Iterator<Item = (f64, [f64; 2])>, colour: Colour) {
    let rows: Vec<_> = rows.collect();
    let line: Vec<_> = rows.iter().map(|(x, y)| panel.at(*x, y[1])).collect();
    canvas.line(&line, Line::solid(colour, 2.0));
    for (x, y) in &rows {
        canvas.marker(Marker::Circle, panel.at(*x, y[0]), 3.0, colour, false);
    }
}

/// Friction along straight slides: the backbone, both models.
struct Backbone<'a>(Vec<&'a PathPair>, &'a str, usize);

impl Figure for Backbone<'_> {
    fn size(&self) -> (u32, u32) {
        (760, 480)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let Self(pairs, label, axis) = self;
        let slid =
            |p: &PathPair| -> Vec<PairRow> { p.rows.iter().filter(|r| r.slide_mm != [0.0; 2]).copied().collect() };
        let all: Vec<PairRow> = pairs.iter().flat_map(|p| slid(p)).collect();
        let x = Axis::covering(label, [0.0, 0.0], all.iter().map(|r| r.slide_mm[*axis]), 8);
        let values = all.iter().flat_map(|r| r.friction_n.map(|f| f[*axis]));
        let y = Axis::covering("Friction, N", [0.0, 0.0], values, 8);
        let panel = Panel { left: 60.0, top: 56.0, width: 590.0, height: 360.0, x, y };
        panel.draw(canvas);
        legend(canvas, (250.0, 18.0));
        let mut ends = Vec::new();
        for (i, pair) in pairs.iter().enumerate() {
            let rows = slid(pair);
            let Some(last) = rows.last() else { continue };
            let colour = SERIES[i % SERIES.len()];
            both(canvas, &panel, rows.iter().map(|r| (r.slide_mm[*axis], r.friction_n.map(|f| f[*axis]))), colour);
            if last.slide_mm[*axis] > 0.0 {
                let y = panel.at(0.0, last.friction_n[1][*axis]).1;
                ends.push((y, format!("{:.1} mm", last.depth_mm), colour));
            }
        }
        panel.label_ends(canvas, ends);
    }
}

/// Hysteresis: friction against slide along the path's main direction.
struct Loops<'a>(Vec<&'a PathPair>);

impl Figure for Loops<'_> {
    fn size(&self) -> (u32, u32) {
        (980, 400)
    }

    fn draw(&self, canvas: &mut Canvas) {
        legend(canvas, (330.0, 18.0));
        for (k, pair) in self.0.iter().enumerate() {
            let far = pair
                .rows
                .iter()
                .max_by(|a, b| a.slide_mm[0].hypot(a.slide_mm[1]).total_cmp(&b.slide_mm[0].hypot(b.slide_mm[1])));
            let Some(far) = far else { continue };
            let length = far.slide_mm[0].hypot(far.slide_mm[1]).max(1e-9);
            let along = |v: [f64; 2]| (v[0] * far.slide_mm[0] + v[1] * far.slide_mm[1]) / length;
            let rows: Vec<_> = pair.rows.iter().map(|r| (along(r.slide_mm), r.friction_n.map(along))).skip(1).collect();
            let label = format!("Slide along its direction, mm ({})", pair.name);
            let x = Axis::covering(&label, [0.0, 0.0], rows.iter().map(|r| r.0), 5);
            let y = Axis::covering("Friction, N", [0.0, 0.0], rows.iter().flat_map(|r| r.1), 6);
            let panel = Panel { left: 60.0 + 315.0 * k as f64, top: 62.0, width: 240.0, height: 270.0, x, y };
            panel.draw(canvas);
            both(canvas, &panel, rows.into_iter(), SERIES[k % SERIES.len()]);
        }
    }
}

/// Friction, normal force and stick ratio along a path.
struct Along<'a>(&'a PathPair);

impl Figure for Along<'_> {
    fn size(&self) -> (u32, u32) {
        (760, 760)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let rows = &self.0.rows;
        legend(canvas, (250.0, 16.0));
        let x = |label: &str| Axis::covering(label, [0.0, 0.0], std::iter::once(cap(rows)), 8);
        let panels: [(&str, Vec<(&str, Vec<[f64; 2]>, Option<usize>)>); 3] = [
            (
                "Friction, N",
                vec![
                    ("x", rows.iter().map(|r| r.friction_n.map(|f| f[0])).collect(), Some(1)),
                    ("y", rows.iter().map(|r| r.friction_n.map(|f| f[1])).collect(), Some(1)),
                ],
            ),
            ("Normal force, N", vec![("", rows.iter().map(|r| r.normal_force_n).collect(), Some(0))]),
            ("Stick ratio", vec![("", rows.iter().map(|r| r.stick_ratio).collect(), None)]),
        ];
        for (k, (name, series)) in panels.iter().enumerate() {
            let values = series.iter().flat_map(|s| s.1.iter().flatten().copied());
            let y = Axis::covering(name, [0.0, 0.0], values, 5);
            let label = if k == 2 { "Path of the plane, mm" } else { "" };
            let panel = Panel { left: 60.0, top: 60.0 + 232.0 * k as f64, width: 640.0, height: 160.0, x: x(label), y };
            panel.draw(canvas);
            for (j, (axis, values, band)) in series.iter().enumerate() {
                let colour = SERIES[(k + j) % SERIES.len()];
                if let Some(b) = band {
                    for sign in [-1.0, 1.0] {
                        let edge: Vec<_> = rows
                            .iter()
                            .zip(values)
                            .map(|(r, v)| panel.at(r.way_mm, v[1] + sign * r.band_n[*b]))
                            .collect();
                        canvas.line(&edge, Line { colour, width: 0.8, dash: Some((3.0, 3.0)) });
                    }
                }
                both(canvas, &panel, rows.iter().zip(values).map(|(r, v)| (r.way_mm, *v)), colour);
                if let (Some(last), false) = (values.last(), axis.is_empty()) {
                    let at = panel.at(cap(rows), last[1]);
                    canvas.text(axis, (at.0 + 8.0, at.1), Text { bold: true, colour, ..Text::BODY });
                }
            }
        }
    }
}

/// Errors of all held-out rows.
struct Histogram(Vec<(&'static str, Vec<f64>, f64)>);

impl Figure for Histogram {
    fn size(&self) -> (u32, u32) {
        (980, 330)
    }

    fn draw(&self, canvas: &mut Canvas) {
        const BINS: usize = 41;
        for (k, (label, errors, reach)) in self.0.iter().enumerate() {
            let mut counts = [0usize; BINS];
            for e in errors {
                let place = ((e / reach * 0.5 + 0.5) * BINS as f64).floor();
                counts[(place.max(0.0) as usize).min(BINS - 1)] += 1;
            }
            let share = |n: usize| 100.0 * n as f64 / errors.len().max(1) as f64;
            let x = Axis::covering(label, [-reach, *reach], std::iter::empty(), 4);
            let y = Axis::covering("Rows, %", [0.0, 0.0], counts.iter().map(|n| share(*n)), 5);
            let panel = Panel { left: 55.0 + 315.0 * k as f64, top: 40.0, width: 255.0, height: 220.0, x, y };
            panel.draw(canvas);
            for (i, n) in counts.iter().enumerate() {
                let edge = |i: usize| (2.0 * i as f64 / BINS as f64 - 1.0) * reach;
                let (a, b) = (panel.at(edge(i), share(*n)), panel.at(edge(i + 1), 0.0));
                canvas.rect(a.0 + 0.5, a.1, b.0 - a.0 - 1.0, b.1 - a.1, SERIES[k % SERIES.len()]);
            }
        }
    }
}

/// Accuracy against springs.
struct Sizes<'a>(&'a [SizePoint]);

impl Figure for Sizes<'_> {
    fn size(&self) -> (u32, u32) {
        (760, 420)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let x = Axis::covering("Springs", [2.0, 8.0], std::iter::empty(), 7);
        let values = self.0.iter().flat_map(|p| [p.friction_percent, p.normal_percent, p.stick_percent]);
        let y = Axis::covering("RMS error on held-out paths, %", [0.0, 0.0], values, 6);
        let panel = Panel { left: 60.0, top: 50.0, width: 520.0, height: 300.0, x, y };
        panel.draw(canvas);
        let default_nodes = self.0.iter().find(|p| p.default).map_or(25, |p| p.size[1]);
        let mut line: Vec<&SizePoint> = self.0.iter().filter(|p| p.size[1] == default_nodes).collect();
        line.sort_by_key(|p| p.size[0]);
        type Of = fn(&SizePoint) -> f64;
        let series: [(&str, Of, Marker); 3] = [
            ("friction, of the limit", |p| p.friction_percent, Marker::Circle),
            ("normal force, of the range", |p| p.normal_percent, Marker::Square),
            ("stick ratio after turns", |p| p.stick_percent, Marker::Triangle),
        ];
        let mut ends = Vec::new();
        for (k, (name, of, marker)) in series.iter().enumerate() {
            let colour = SERIES[k];
            let points: Vec<_> = line.iter().map(|p| panel.at(p.size[0] as f64, of(p))).collect();
            canvas.line(&points, Line::solid(colour, 2.0));
            for (p, at) in line.iter().zip(&points) {
                canvas.marker(*marker, *at, 4.5, colour, p.default);
            }
            for p in self.0.iter().filter(|p| p.size[1] != default_nodes) {
                canvas.marker(Marker::Diamond, panel.at(p.size[0] as f64, of(p)), 2.5, GREY, false);
            }
            if let Some(last) = points.last() {
                ends.push((last.1, (*name).to_owned(), colour));
            }
        }
        for p in &line {
            let at = panel.at(p.size[0] as f64, panel.y.max());
            let colour = if p.default { ESTIMATE } else { GREY };
            canvas.text(&format!("M {}", p.size[0]), (at.0 - 10.0, at.1 + 8.0), Text { colour, ..Text::BODY });
        }
        panel.label_ends(canvas, ends);
    }
}

fn straight(report: &ReducedReport, axis: usize) -> Vec<&PathPair> {
    let along = |p: &&PathPair| {
        p.kind == "straight"
            && p.rows.last().is_some_and(|r| r.slide_mm[1 - axis].abs() < 1e-3 && r.slide_mm[axis] != 0.0)
    };
    report.pairs.iter().filter(along).collect()
}

/// Makes the section's page, numbers and figures.
///
/// # Errors
/// [`ReportError::Json`].
pub fn render_reduced(report: &ReducedReport) -> Result<Rendered, ReportError> {
    let held_out = || report.pairs.iter().filter(|p| p.held_out);
    let rows = || held_out().flat_map(|p| &p.rows).filter(|r| r.normal_force_n[0] > 0.0);
    let mut figures = Vec::new();
    let axes = [("Slide along x, mm", "reduced_backbone_x"), ("Slide along y, mm", "reduced_backbone_y")];
    for (axis, (label, name)) in axes.into_iter().enumerate() {
        let pairs = straight(report, axis);
        if !pairs.is_empty() {
            let caption = "Straight slides at six depths, in both directions.";
            figures.push(Picture::new(name, "Straight slides", caption, &Backbone(pairs, label, axis)));
        }
    }
    let loops: Vec<&PathPair> = held_out().filter(|p| p.kind == "reversal").take(3).collect();
    let caption = "Reversals that were left out of the fit.";
    figures.push(Picture::new("reduced_loops", "Reversals", caption, &Loops(loops)));
    let errors = Histogram(vec![
        (
            "Friction error, % of the limit",
            rows()
                .flat_map(|r| [0, 1].map(|k| 100.0 * (r.friction_n[1][k] - r.friction_n[0][k]) / r.limit_n))
                .collect(),
            10.0,
        ),
        (
            "Normal-force error, %",
            rows()
                .filter(|r| r.normal_force_n[0] > 0.02)
                .map(|r| 100.0 * (r.normal_force_n[1] / r.normal_force_n[0] - 1.0))
                .collect(),
            10.0,
        ),
        ("Stick-ratio error", rows().map(|r| r.stick_ratio[1] - r.stick_ratio[0]).collect(), 0.5),
    ]);
    figures.push(Picture::new("reduced_errors", "Errors", "All rows of the held-out paths.", &errors));
    if let Some(worst) = report.pairs.iter().find(|p| p.name == report.worst) {
        let caption = "The held-out path with the largest friction error; dashed: the model's own 95 % band.";
        figures.push(Picture::new("reduced_worst", "The worst path", caption, &Along(worst)));
    }
    if !report.sizes.is_empty() {
        let caption = "Accuracy against cost; filled: the default; diamonds: other numbers of table nodes.";
        figures.push(Picture::new("reduced_sizes", "Accuracy and size", caption, &Sizes(&report.sizes)));
    }
    let json = serde_json::to_string_pretty(report)? + "\n";
    Ok(Rendered { html: page(report, &figures), json, figures })
}

/// What the verdict compares, and its limits.
fn verdict_text() -> String {
    let [normal, friction, stick] = GOOD;
    format!(
        "Errors along paths that no fit has seen, as root mean square over the path's largest value. Good: normal force {:.0} %, \
         friction {:.0} %, stick ratio {stick:.1}; usable: twice that.",
        100.0 * normal,
        100.0 * friction
    )
}

fn page(report: &ReducedReport, pictures: &[Picture]) -> String {
    let (head, rows) = report.table.split_at(report.table.len().min(1));
    let main = html! {
        main {
            h1 { "The reduced model against the finite-element model" }
            @if !report.verdict.is_empty() {
                h2 { "Verdict" }
                p { (verdict_text()) }
                table {
                    tr { @for name in COLUMNS { th { (name) } } }
                    @for row in &report.verdict { tr { @for cell in row { td { (cell) } } } }
                }
                h2 { "The bed of springs" }
            }
            table {
                @for row in head { tr { @for cell in row { th { (cell) } } } }
                @for row in rows { tr { @for cell in row { td { (cell) } } } }
            }
            (figures(1, pictures))
            dl { @for (name, value) in &report.provenance { dt { (name) } dd { (value) } } }
        }
    };
    document("fingerpad: the reduced model", main)
}
