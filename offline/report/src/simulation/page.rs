//! The page of a run: summary, figures, maps, rows, numerics, settings.

use maud::{Markup, html};

use super::maps::MapSet;
use super::{SimulationReport, words};
use crate::Picture;
use crate::html::{cell, checks_table, document, figures, image, prose, quantity, table};
use crate::numbers::{fixed, significant};
use fingerpad_fe::load_path::Response;

/// Most rows of the path that are listed.
const MOST_ROWS: usize = 60;

/// The page as one file.
pub fn page(report: &SimulationReport, warnings: &[String], pictures: &[Picture], sets: &[MapSet]) -> String {
    let p = &report.provenance;
    let responses = &report.trajectory.responses;
    let main = html! {
        main {
            header {
                h1 { "A finger along " (report.path_name) }
                p.meta {
                    "shape " (p.shape) " (" (p.bones) " bones) · mesh " (p.mesh_preset) ", " (p.mesh.nodes) " nodes"
                    " · λ = " (significant(p.friction.lambda, 3)) " MPa" sup { "1−β" }
                    ", β = " (significant(p.friction.beta, 3))
                    " · fingerpad " (p.program_version) " · settings " (p.settings_hash)
                }
            }
            p.verdict { (prose(&words::verdict(responses))) }
            @for warning in warnings { p.warning { (prose(warning)) } }
            @if let Some(link) = &report.response_link {
                p { "All " (responses.len()) " rows: " a href=(address(link)) { (link) } "." }
            }
            section { (figures(1, pictures)) }
            @if !sets.is_empty() {
                h2 { "The contact" }
                p { (prose(words::MAPS)) }
                @for set in sets { (contact(set)) }
            }
            (rows(report, sets))
            (numerics(report))
            h2 { "Settings" }
            details {
                summary { "the whole configuration; " code { "--config" } " takes it" }
                pre { (report.settings) }
            }
            footer {
                p {
                    "Every number of this page stands in " code { "report.json" }
                    ", every figure beside it as an SVG file."
                }
            }
        }
    };
    document(&format!("fingerpad simulate: {}", report.path_name), main)
}

/// A path as an address: signs that mean something else there are coded.
fn address(path: &str) -> String {
    [('%', "%25"), (' ', "%20"), ('#', "%23"), ('?', "%3F"), ('\\', "/")]
        .iter()
        .fold(path.to_owned(), |text, (sign, code)| text.replace(*sign, code))
}

/// The maps of one row, with its numbers.
fn contact(set: &MapSet) -> Markup {
    let (n, r) = (&set.numbers, &set.numbers.response);
    let caption = format!(
        "Row {} of the path, {} s: depth {} mm, slide {}, {} mm; normal force {} N, friction {}, {} N; {} mm² of contact, stick \
         ratio {}. Largest pressure {} kPa, traction {} kPa, slip {} mm.",
        n.row,
        significant(r.t_s, 4),
        fixed(r.depth_mm, 3),
        fixed(r.slide_x_mm, 3),
        fixed(r.slide_y_mm, 3),
        fixed(r.normal_force_n, 4),
        fixed(r.friction_x_n, 4),
        fixed(r.friction_y_n, 4),
        fixed(r.contact_area_mm2, 1),
        fixed(r.stick_ratio, 3),
        fixed(n.peak_pressure_kpa, 1),
        fixed(n.peak_traction_kpa, 1),
        fixed(n.largest_slip_mm, 3)
    );
    html! {
        figure.of-maps #{ "contact_" (n.letter) } {
            div.maps { @for picture in &set.pictures { (image(picture)) } }
            figcaption { b { (n.letter) "." } " " (prose(&caption)) }
        }
    }
}

/// The response at the rows of the path.
fn rows(report: &SimulationReport, sets: &[MapSet]) -> Markup {
    let responses = &report.trajectory.responses;
    let at = |t_s: &f64| responses.iter().rfind(|r| r.t_s == *t_s);
    let found: Vec<(usize, &Response)> =
        report.row_times_s.iter().map(at).enumerate().filter_map(|(k, r)| r.map(|r| (k + 1, r))).collect();
    let heads = html! {
        th { "row" } th {} th { "t, s" } th { "depth, mm" } th { "slide x, mm" } th { "slide y, mm" } th { "normal force, N" }
        th { "friction x, N" } th { "friction y, N" } th { "contact, mm²" } th { "stick ratio" } th.name { "regime" }
        th.name { "status" }
    };
    let rows = html! {
        @for (row, r) in found.iter().take(MOST_ROWS) {
            tr {
                (cell(row))
                td { @if let Some(set) = sets.iter().find(|s| s.numbers.row == *row) { (set.numbers.letter) } }
                @for length in [r.t_s, r.depth_mm, r.slide_x_mm, r.slide_y_mm] { (cell(fixed(length, 3))) }
                @for force in [r.normal_force_n, r.friction_x_n, r.friction_y_n] { (cell(fixed(force, 4))) }
                (cell(fixed(r.contact_area_mm2, 1))) (cell(fixed(r.stick_ratio, 3))) td { (r.regime) } td { (r.status) }
            }
        }
    };
    html! {
        h2 { "Rows of the path" }
        (table(heads, rows))
        @if found.len() > MOST_ROWS { p.meta { (found.len() - MOST_ROWS) " more rows are in the response." } }
    }
}

/// Effort and work of the run, and its checks.
fn numerics(report: &SimulationReport) -> Markup {
    let (c, w) = (&report.trajectory.cost, &report.trajectory.work);
    html! {
        h2 { "Numerics" }
        div.side {
            table {
                tbody {
                    (quantity("increments", c.increments, "")) (quantity("increments cut back", c.cutbacks, ""))
                    (quantity("equilibrium iterations", c.iterations, ""))
                    (quantity("factorisations", c.factorisations, ""))
                    (quantity("CPU time", significant(c.cpu_s, 4), "s"))
                    (quantity("work of the body", significant(w.plane_mj, 4), "mJ"))
                    (quantity("dissipated by slip", significant(w.friction_mj, 4), "mJ"))
                    (quantity("dissipated by stabilisation", significant(w.stabilisation_mj, 4), "mJ"))
                }
            }
            @if !report.checks.is_empty() { (checks_table(&report.checks)) }
        }
    }
}
