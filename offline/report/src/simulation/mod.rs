//! The report of a run along a path: page, numbers, figures.
//!
//! Main types: [`SimulationReport`], [`render`]; [`default_map_rows`] chooses the rows of a path whose fields are kept.
//! Computes no physics: it draws the records. Numbers that are not finite or not recorded are left out. May use: fe.

mod along;
mod loops;
mod maps;
mod page;
mod rows;
mod series;
#[cfg(test)]
mod tests;
mod words;

use serde::Serialize;

use super::{Check, Picture, Provenance, Rendered, ReportError};
use fingerpad_fe::load_path::{Cost, Response, Trajectory, Work};
use fingerpad_fe::mesh::Mesh;
pub use rows::default_map_rows;

/// Everything that the report of a run along a path is made of.
#[derive(Clone, Debug, Default)]
pub struct SimulationReport {
    /// Name of the path's file.
    pub path_name: String,
    /// Times of the path's rows, s.
    pub row_times_s: Vec<f64>,
    /// Address of the response's file, relative to the page; None if there is no file.
    pub response_link: Option<String>,
    /// Settings of the run; its stages are not shown.
    pub provenance: Provenance,
    /// All settings as a configuration file (TOML).
    pub settings: String,
    /// The run. Its snapshots belong to the first of `map_rows` in their order.
    pub trajectory: Trajectory,
    /// Rows of the path, from 0, whose contact is drawn.
    pub map_rows: Vec<usize>,
    /// Checks on the numerics of the run.
    pub checks: Vec<Check>,
    /// Why the run ended before its path did.
    pub ended_early: Option<String>,
}

/// The numbers of `report.json`.
#[derive(Serialize)]
struct Numbers<'a> {
    path: &'a str,
    provenance: &'a Provenance,
    settings: &'a str,
    responses: &'a [Response],
    /// Rows of the path, from 1, whose contact is drawn.
    map_rows: Vec<usize>,
    maps: Vec<MapNumbers>,
    cost: Cost,
    work: Work,
    checks: &'a [Check],
    warnings: Vec<String>,
}

/// The numbers of one set of contact maps.
#[derive(Clone, Debug, Serialize)]
struct MapNumbers {
    /// Letter that marks it in the figures.
    letter: char,
    /// Row of the path, from 1.
    row: usize,
    peak_pressure_kpa: f64,
    peak_traction_kpa: f64,
    /// Of the faces' mean slips since first contact.
    largest_slip_mm: f64,
    response: Response,
}

/// Rows of the response, marked in every figure by a letter.
#[derive(Clone, Debug)]
struct Marks(Vec<(char, Response)>);

impl Marks {
    fn of(maps: &[MapNumbers]) -> Self {
        Self(maps.iter().map(|m| (m.letter, m.response)).collect())
    }
}

/// Makes page, numbers and figures.
///
/// * `mesh`: the mesh of all snapshots
///
/// # Errors
/// [`ReportError::OtherMesh`] if a snapshot does not fit the mesh.
pub fn render(report: &SimulationReport, mesh: &Mesh) -> Result<Rendered, ReportError> {
    let trajectory = &report.trajectory;
    for snapshot in &trajectory.snapshots {
        super::check_snapshot(snapshot, mesh)?;
    }
    let maps = maps::numbers(report);
    let marks = Marks::of(&maps);
    let warnings = words::warnings(report);

    let (responses, marks) = (&trajectory.responses[..], &marks);
    let width = |narrow| if narrow { along::NARROW } else { along::WIDE };
    let along = |narrow| along::Along { responses, marks, width: width(narrow) };
    let loops = |narrow| loops::Loops { responses, marks, width: width(narrow) };
    let title = "The response along the path";
    let mut figures = vec![Picture::wide_and_narrow("along", title, words::along_caption(marks), along)];
    if loops(false).any() {
        let title = "Forces against the motion that makes them";
        figures.push(Picture::wide_and_narrow("loops", title, words::loops_caption(), loops));
    }
    let sets = maps::draw(trajectory, mesh, &maps);
    let html = page::page(report, &warnings, &figures, &sets);
    figures.extend(sets.into_iter().flat_map(|set| set.pictures));
    let numbers = Numbers {
        path: &report.path_name,
        provenance: &report.provenance,
        settings: &report.settings,
        responses: &trajectory.responses,
        map_rows: report.map_rows.iter().map(|row| row + 1).collect(),
        maps,
        cost: trajectory.cost,
        work: trajectory.work,
        checks: &report.checks,
        warnings,
    };
    let json = serde_json::to_string_pretty(&numbers)? + "\n";
    Ok(Rendered { html, json, figures })
}
