//! The page of a fingertip: its reduced models beside its finite elements.
//!
//! Main type: [`TipReport`]; main function: [`render_tip`]. Computes nothing: its charts come from [`super::tip_charts`].

use fingerpad_fe::mesh::Mesh;
use fingerpad_reduce::{COLUMNS, GOOD};
use maud::{Markup, html};
use serde::Serialize;

use super::html::{document, figures, image, prose};
use super::mesh_view::MeshView;
use super::tip_maps::{StickMap, StickMaps};
use super::traces::{Charts, TraceChart};
use super::{Picture, Rendered, ReportError, check_snapshot};

/// Charts that belong together.
#[derive(Clone, Debug, Serialize)]
pub struct ChartGroup {
    /// Name of its file without ending.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// What is drawn.
    pub caption: String,
    /// The charts.
    pub charts: Vec<TraceChart>,
}

/// Everything that the page shows but its maps.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TipReport {
    /// Name of the tip's geometry.
    pub name: String,
    /// The verdict in the fewest words.
    pub headline: String,
    /// The verdict in words, for each model.
    pub verdict_in_words: Vec<String>,
    /// The verdict on each model and kind of motion, rows with the columns of `fingerpad_reduce::COLUMNS`.
    pub verdict: Vec<Vec<String>>,
    /// Errors of the bed of springs by kind of motion: heading and rows; may be empty.
    pub bed: Vec<Vec<String>>,
    /// Tip, settings, versions, counts: name and value.
    pub provenance: Vec<(String, String)>,
    /// The charts.
    pub groups: Vec<ChartGroup>,
}

/// Makes page, numbers and figures.
///
/// * `mesh`: the mesh of all snapshots
/// * `maps`: the contact along a slide; may be empty
///
/// # Errors
/// [`ReportError::OtherMesh`] if a snapshot does not fit the mesh.
pub fn render_tip(report: &TipReport, mesh: &Mesh, maps: &[StickMap]) -> Result<Rendered, ReportError> {
    for map in maps {
        check_snapshot(&map.elements, mesh)?;
    }
    let section = MeshView::of(maps.iter().map(|map| &map.elements), mesh);
    let caption =
        "The mesh of the finite elements; cut open, the soft layer lies between the pad and the bone or core.";
    let columns = |narrow: bool| section.in_columns(if narrow { 1 } else { 2 });
    let mut pictures = vec![Picture::wide_and_narrow("tip_section", "The tip", caption, columns)];
    for group in report.groups.iter().filter(|group| !group.charts.is_empty()) {
        let charts = |narrow: bool| Charts { charts: &group.charts, columns: if narrow { 1 } else { 2 } };
        pictures.push(Picture::wide_and_narrow(group.name, group.title, &*group.caption, charts));
    }
    if let Some(maps) = StickMaps::of(maps, mesh) {
        let caption = "Stick and slip in the contact at one depth along a slide in x: the finite elements above, the pad's patches below, \
                       each as a disc of its area in contact.";
        pictures.push(Picture::wide_and_narrow("tip_stick", "Where it sticks", caption, |narrow| {
            maps.in_columns(if narrow { 2 } else { 4 })
        }));
    }
    let json = serde_json::to_string_pretty(report)? + "\n";
    Ok(Rendered { html: page(report, &pictures), json, figures: pictures })
}

/// What the verdict compares, and its limits.
fn verdict_text() -> String {
    let [normal, friction, stick] = GOOD.map(|limit| 100.0 * limit);
    format!(
        "Errors along paths that no fit has seen, as root mean square over the path's largest value. Good: normal force {normal:.0} %, \
         friction {friction:.0} %, stick ratio {:.1}; usable: twice that.",
        stick / 100.0
    )
}

/// Heads of columns of which the first are names.
fn heads(names: &[impl AsRef<str>]) -> Markup {
    let class = |name: &str| if ["model", "motions", "paths", "verdict"].contains(&name) { "name" } else { "" };
    html! { @for name in names { th class=(class(name.as_ref())) { (name.as_ref()) } } }
}

fn rows(rows: &[Vec<String>]) -> Markup {
    let class = |cell: &str| match cell {
        "good" => "pass",
        "not usable" => "fail",
        number if number.starts_with(|c: char| c.is_ascii_digit()) => "num",
        _ => "",
    };
    html! { @for row in rows { tr { @for cell in row { td class=(class(cell)) { (cell) } } } } }
}

fn page(report: &TipReport, pictures: &[Picture]) -> String {
    let (section, rest) = pictures.split_at(pictures.len().min(1));
    let (head, bed) = report.bed.split_at(report.bed.len().min(1));
    let main = html! {
        main {
            h1 { "Fingertip " (report.name) ": reduced models against finite elements" }
            div.first {
                div {
                    p.number { (report.headline) }
                    @for sentence in &report.verdict_in_words { p.verdict { (prose(sentence)) } }
                    p.meta { (prose(&verdict_text())) }
                }
                @for picture in section { figure id=(picture.name) { (image(picture)) figcaption { (picture.caption) } } }
            }
            table {
                thead { tr { (heads(&COLUMNS)) } }
                tbody { (rows(&report.verdict)) }
            }
            (figures(1, rest))
            @if !bed.is_empty() {
                h2 { "The bed of springs by kind of motion" }
                table { thead { tr { @for row in head { (heads(row)) } } } tbody { (rows(bed)) } }
            }
            h2 { "Provenance" }
            table { tbody { @for (name, value) in &report.provenance { tr { td { (name) } td { (value) } } } } }
        }
    };
    document("fingerpad: a fingertip", main)
}
