//! Finished results become a page (`report.html`), its numbers (`report.json`) and its figures (SVG).
//!
//! Main types: [`BuildReport`], [`DepthResult`], [`Check`], [`Rendered`]; main function: [`render`]. Computes no
//! physics: it reads, subtracts and averages its inputs, and leaves out numbers that are not finite. Returns text; the
//! caller writes the files. May use: slide, mesh, identify, reduce, diagnose.

mod axes;
mod canvas;
mod captions;
mod colour;
mod contact_maps;
mod curves;
pub mod diagnosis;
mod font;
mod html;
pub mod identify;
mod mesh_view;
mod numbers;
mod pad_view;
pub mod simulation;
#[cfg(test)]
mod synthetic;
mod tip;
mod tip_charts;
mod tip_maps;
mod traces;

use serde::{Deserialize, Serialize};

use canvas::Figure;
use fingerpad_fe::load_path::{Snapshot, Trajectory};
use fingerpad_fe::mesh::Mesh;
use fingerpad_reduce::Agreement;
pub use numbers::{
    Comparison, DepthNumbers, Differences, MapNumbers, Numbers, PaperFit, PressPoint, Range, Secant, SlidePoint,
};

pub use tip::{ChartGroup, TipReport, render_tip};
pub use tip_charts::{TipModels, bed_table, tip_charts};
pub use tip_maps::StickMap;
pub use traces::{Hue, Trace, TraceChart, traces_svg};

/// Why a report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A snapshot was computed on another mesh.
    #[error(
        "the snapshot at slide {slide_mm} mm, depth {depth_mm} mm has {nodes} nodes and {faces} pad faces, \
         the mesh {mesh_nodes} and {mesh_faces}"
    )]
    OtherMesh {
        /// Depth of the snapshot, mm.
        depth_mm: f64,
        /// Slide of the snapshot, mm.
        slide_mm: f64,
        /// Nodes of the snapshot.
        nodes: usize,
        /// Pad faces of the snapshot.
        faces: usize,
        /// Nodes of the mesh.
        mesh_nodes: usize,
        /// Pad faces of the mesh.
        mesh_faces: usize,
    },
    /// The numbers could not be written as JSON.
    #[error("report.json: {0}")]
    Json(#[from] serde_json::Error),
}

/// Everything that the report of the main job is made of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BuildReport {
    /// Settings, program and duration of the run.
    pub provenance: Provenance,
    /// One run (press, then slide) per depth, in rising depth.
    pub depths: Vec<DepthResult>,
    /// Checks on the numerics that belong to this run.
    pub checks: Vec<Check>,
    /// Friction coefficient of the model between and beyond the depths, in rising force; may be empty.
    pub continuous: Vec<FrictionPoint>,
    /// Limits of the model in addition to those of every report; full sentences.
    pub left_out: Vec<String>,
    /// A reduced model along the same motions; None if there is none of this finger.
    pub reduced: Option<ReducedModel>,
}

/// A reduced model that was replayed along the motions of the runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReducedModel {
    /// Name of its file.
    pub name: String,
    /// Its difference from the run of each depth, in the order of the depths.
    pub depths: Vec<Agreement>,
}

/// Settings, program and duration of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the fingertip's shape.
    pub shape: String,
    /// How the bones are held: `fixed`, `floating` or `deformable`.
    pub bones: String,
    /// Mesh preset.
    pub mesh_preset: String,
    /// Hash of the settings.
    pub settings_hash: String,
    /// Version of the program.
    pub program_version: String,
    /// Sizes of the mesh and of the problem.
    pub mesh: MeshCounts,
    /// Quality of the mesh, e.g. worst scaled Jacobian, volumes, sizes.
    pub quality: Vec<Quantity>,
    /// Constants of the friction law.
    pub friction: FrictionConstants,
    /// Times of the stages of the job, in their order.
    pub stages: Vec<Stage>,
}

/// Sizes of the mesh and of the problem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshCounts {
    /// Nodes.
    pub nodes: usize,
    /// Hexahedra.
    pub hexes: usize,
    /// Tetrahedra.
    pub tets: usize,
    /// Faces that may touch the plane.
    pub pad_faces: usize,
    /// Degrees of freedom that are neither fixed nor tied.
    pub free_dofs: usize,
}

/// A named number.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit; empty for a pure number.
    pub unit: String,
}

/// Constants of tau_crit = tau_0 + lambda sigma^beta.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrictionConstants {
    /// lambda, MPa^(1 - beta).
    pub lambda: f64,
    /// beta, a pure number.
    pub beta: f64,
    /// tau_0, MPa.
    pub tau0_mpa: f64,
    /// Elastic slip at which the traction reaches tau_crit, mm.
    pub gamma_crit_mm: f64,
    /// Strength across the axis of the skin over that along it; none if friction is isotropic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across_over_along: Option<f64>,
    /// Angle of that axis, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin_axis_deg: Option<f64>,
}

/// Time of one stage of the job.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// Wall time, s.
    pub wall_s: f64,
    /// CPU time, s.
    pub cpu_s: f64,
}

/// Steady values of one depth: measured, or of the model at the end of its slide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Steady {
    /// Normal force, N.
    pub normal_force_n: f64,
    /// Kinetic friction over normal force.
    pub friction_coefficient: f64,
    /// Contact area, mm².
    pub contact_area_mm2: f64,
}

/// One depth: the run, its results, the measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthResult {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Press, then slide. Its snapshots at this depth (at 0, 0.5, 1, 2 and 6 mm of slide) become maps.
    pub trajectory: Trajectory,
    /// The model's kinetic state; NaN if there is none.
    pub kinetic: Steady,
    /// F/N estimated as the friction law integrated over the frictionless pressure of this depth.
    pub frictionless_friction_coefficient: Option<f64>,
    /// Table 1 at this depth.
    pub measured: Option<Steady>,
}

/// A point of the friction coefficient's curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrictionPoint {
    /// Normal force, N.
    pub normal_force_n: f64,
    /// Kinetic friction over normal force.
    pub friction_coefficient: f64,
}

/// A check with its bound.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// The checked quantity.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Unit of value and bound; empty for a pure number.
    pub unit: String,
    /// The bound on the value's size.
    pub bound: f64,
    /// Whether the bound was kept.
    pub passed: bool,
}

/// A figure with its words.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Name of its file without ending.
    pub name: String,
    /// Title.
    pub title: String,
    /// Caption.
    pub caption: String,
    /// The figure as `<svg>`.
    pub svg: String,
    /// The same for narrow pages, if that differs.
    pub narrow: Option<String>,
}

impl Picture {
    fn new(name: &str, title: impl Into<String>, caption: impl Into<String>, figure: &impl Figure) -> Self {
        let svg = canvas::svg(figure);
        Self { name: name.into(), title: title.into(), caption: caption.into(), svg, narrow: None }
    }

    /// A figure that is drawn once for wide pages (argument false) and once for narrow ones.
    fn wide_and_narrow<F: Figure>(
        name: &str,
        title: impl Into<String>,
        caption: impl Into<String>,
        figure: impl Fn(bool) -> F,
    ) -> Self {
        let narrow = Some(canvas::svg(&figure(true)));
        Self { narrow, ..Self::new(name, title, caption, &figure(false)) }
    }

    /// Name and content of its file.
    pub fn file(&self) -> (String, Vec<u8>) {
        (format!("{}.svg", self.name), standalone(&self.svg).into_bytes())
    }
}

/// An `<svg>` element as a file of its own.
fn standalone(svg: &str) -> String {
    svg.replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1)
}

/// A report, ready to be written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rendered {
    /// `report.html`: one self-contained page.
    pub html: String,
    /// `report.json`: every number that the page shows.
    pub json: String,
    /// The figures of the page.
    pub figures: Vec<Picture>,
}

impl Rendered {
    /// Name and content of its files, the page last: figures in `folder`, `name.json`, `name.html`.
    pub fn files(self, folder: &str, name: &str) -> Vec<(String, Vec<u8>)> {
        let figures = self.figures.iter().map(Picture::file);
        let mut files: Vec<_> = figures.map(|(name, svg)| (format!("{folder}{name}"), svg)).collect();
        files.push((format!("{name}.json"), self.json.into_bytes()));
        files.push((format!("{name}.html"), self.html.into_bytes()));
        files
    }
}

/// Makes page, numbers and figures.
///
/// * `report`: results; a number that is missing or not finite shows as a dash or is left out of a figure
/// * `mesh`: the mesh of all snapshots
///
/// # Errors
/// [`ReportError::OtherMesh`] if a snapshot does not fit the mesh.
pub fn render(report: &BuildReport, mesh: &Mesh) -> Result<Rendered, ReportError> {
    for snapshot in report.depths.iter().flat_map(|d| &d.trajectory.snapshots) {
        check_snapshot(snapshot, mesh)?;
    }
    let numbers = Numbers::of(report);
    let numbers = &numbers;
    let columns = |narrow: bool| if narrow { 1 } else { 2 };
    let (areas, travel) = (curves::normal_area(numbers), curves::travel(numbers));
    let mut figures = vec![
        Picture::wide_and_narrow(
            "figure2",
            "Friction coefficient against normal force (Figure 2 of the paper)",
            captions::figure2(numbers),
            |narrow| curves::Figure2 { numbers, narrow },
        ),
        Picture::wide_and_narrow(
            "normal_area",
            "Normal force and contact area against depth",
            captions::normal_area(numbers),
            |narrow| traces::Charts { charts: &areas, columns: columns(narrow) },
        ),
        Picture::wide_and_narrow(
            "travel",
            "Friction, stick ratio and normal force along the path",
            captions::travel(numbers),
            |narrow| traces::Charts { charts: &travel, columns: columns(narrow) },
        ),
    ];
    for (scale, maps, depth) in contact_maps::per_depth(report, numbers, mesh) {
        let depth_mm = numbers::fixed(depth.depth_mm, 2);
        let title = format!("Pressure and stick under the finger, depth {depth_mm} mm");
        let figure = |narrow| contact_maps::ContactMaps { scale: &scale, maps: &maps, narrow };
        let name = format!("contact_{depth_mm}mm");
        figures.push(Picture::wide_and_narrow(&name, title, captions::contact(depth), figure));
    }
    let view = mesh_view::MeshView::of(report.depths.iter().flat_map(|d| &d.trajectory.snapshots), mesh);
    let caption = captions::mesh(numbers, &view);
    figures.push(Picture::wide_and_narrow("mesh", "The mesh", caption, |narrow| view.in_columns(columns(narrow))));
    let json = serde_json::to_string_pretty(numbers)? + "\n";
    Ok(Rendered { html: html::page(numbers, &figures), json, figures })
}

/// The picture of a mesh alone, as an SVG file: cut open at y = 0, and the pad from below.
pub fn mesh_picture(mesh: &Mesh) -> String {
    standalone(&canvas::svg(&mesh_view::MeshView::of(std::iter::empty(), mesh).in_columns(2)))
}

fn check_snapshot(snapshot: &Snapshot, mesh: &Mesh) -> Result<(), ReportError> {
    let (nodes, faces) = (snapshot.displacement_mm.len(), snapshot.faces.len());
    let mesh_faces = mesh.pad_faces.len() + mesh.pad_triangles.len();
    if (nodes, faces) == (mesh.nodes.len(), mesh_faces) {
        return Ok(());
    }
    Err(ReportError::OtherMesh {
        depth_mm: snapshot.response.depth_mm,
        slide_mm: snapshot.response.slide_x_mm.hypot(snapshot.response.slide_y_mm),
        nodes,
        faces,
        mesh_nodes: mesh.nodes.len(),
        mesh_faces,
    })
}

#[cfg(test)]
mod tests;
