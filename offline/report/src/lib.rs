//! Finished results become a page (`report.html`), its numbers (`report.json`) and its figures (PNG).
//!
//! Main types: [`BuildReport`], [`DepthResult`], [`Check`], [`Rendered`]; main function: [`render`]. Computes no
//! physics: it reads, subtracts and averages its inputs, and leaves out numbers that are not finite. Returns text and
//! bytes; the caller writes the files. May use: slide, mesh, identify, reduce, diagnose.

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
mod reduced;
mod reduced_pairs;
pub mod simulation;
#[cfg(test)]
mod synthetic;
pub mod table;
mod traces;

use serde::{Deserialize, Serialize};

use fingerpad_fe::load_path::{Snapshot, Trajectory};
use fingerpad_fe::mesh::Mesh;
use fingerpad_reduce::Agreement;
pub use numbers::{
    Comparison, DepthNumbers, Differences, MapNumbers, Numbers, PaperFit, PressPoint, Range, Secant, SlidePoint,
};

pub use reduced::{PairRow, PathPair, ReducedReport, SizePoint, render_reduced};
pub use reduced_pairs::reduced_report;
pub use traces::{Trace, TraceChart, traces_png};

/// Why a report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure could not be drawn or encoded.
    #[error("drawing a figure: {0}")]
    Draw(String),
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

/// A report, ready to be written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rendered {
    /// `report.html`: one self-contained page.
    pub html: String,
    /// `report.json`: every number that the page shows.
    pub json: String,
    /// The figures, PNG or SVG: file name and bytes.
    pub figures: Vec<(String, Vec<u8>)>,
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
    let mut pictures = Vec::new();
    let mut figures = Vec::new();
    let mut add = |name: &str, title: String, caption: String, png: Vec<u8>, svg: Option<String>| {
        figures.push((format!("{name}.png"), png.clone()));
        pictures.push(html::Picture { name: name.to_owned(), title, caption, png, svg });
    };

    let figure = curves::Figure2 { numbers: &numbers };
    let title = "Friction coefficient against normal force (Figure 2 of the paper)";
    add("figure2", title.into(), captions::figure2(&numbers), canvas::png(&figure)?, Some(canvas::svg(&figure)?));

    let figure = curves::NormalArea { numbers: &numbers };
    let title = "Normal force and contact area against depth";
    add(
        "normal_area",
        title.into(),
        captions::normal_area(&numbers),
        canvas::png(&figure)?,
        Some(canvas::svg(&figure)?),
    );

    let figure = curves::Travel { numbers: &numbers };
    let title = "Friction, stick ratio and normal force along the path";
    add("travel", title.into(), captions::travel(&numbers), canvas::png(&figure)?, Some(canvas::svg(&figure)?));

    for (scale, result, depth) in contact_maps::per_depth(report, &numbers, mesh) {
        let figure = contact_maps::ContactMaps { scale, maps: result };
        let title = format!("Pressure and stick under the finger, depth {} mm", numbers::fixed(depth.depth_mm, 2));
        let name = format!("contact_{}mm", numbers::fixed(depth.depth_mm, 2));
        add(&name, title, captions::contact(depth), canvas::png(&figure)?, None);
    }

    let figure = mesh_view::MeshView::of(report, mesh);
    add("mesh", "The mesh".into(), captions::mesh(&numbers, &figure), canvas::png(&figure)?, None);

    let html = html::page(&numbers, &pictures);
    let json = serde_json::to_string_pretty(&numbers)? + "\n";
    Ok(Rendered { html, json, figures })
}

/// The picture of a mesh alone, PNG: cut open at y = 0, and the pad from below.
///
/// # Errors
/// [`ReportError::Draw`].
pub fn mesh_picture(mesh: &Mesh) -> Result<Vec<u8>, ReportError> {
    canvas::png(&mesh_view::MeshView::of(&BuildReport::default(), mesh))
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
