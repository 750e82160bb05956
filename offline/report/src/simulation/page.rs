//! The page of a run: summary, figures, maps, rows, numerics, settings.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::maps::MapSet;
use super::{SimulationReport, words};
use crate::html::{Picture, STYLE, cell, escape, figure, fonts, prose};
use crate::numbers::{fixed, significant};
use fingerpad_fe::load_path::Response;

/// Most rows of the path that are listed.
const MOST_ROWS: usize = 60;

/// The page as one file.
pub fn page(report: &SimulationReport, warnings: &[String], pictures: &[Picture], sets: &[MapSet]) -> String {
    let p = &report.provenance;
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>fingerpad simulate: {path}</title>\n<style>\n{STYLE}{}</style>\n\
         </head>\n<body>\n<main>\n<header>\n<h1>A finger along {path}</h1>\n<p class=\"meta\">shape {} ({} bones) · mesh {}, {} \
         nodes · λ = {} MPa<sup>1−β</sup>, β = {} · fingerpad {} · settings {}</p>\n</header>\n<p class=\"verdict\">{}</p>\n",
        fonts(),
        escape(&p.shape),
        escape(&p.bones),
        escape(&p.mesh_preset),
        p.mesh.nodes,
        significant(p.friction.lambda, 3),
        significant(p.friction.beta, 3),
        escape(&p.program_version),
        escape(&p.settings_hash),
        prose(&words::verdict(&report.trajectory.responses)),
        path = escape(&report.path_name),
    );
    for warning in warnings {
        let _ = writeln!(out, "<p class=\"warning\">{}</p>", prose(warning));
    }
    if let Some(link) = &report.response_link {
        let rows = report.trajectory.responses.len();
        let _ = writeln!(out, "<p>All {rows} rows: <a href=\"{}\">{}</a>.</p>", escape(&address(link)), escape(link));
    }
    out += "<section>\n";
    for (i, picture) in pictures.iter().enumerate() {
        figure(&mut out, i + 1, picture);
    }
    out += "</section>\n";
    contact(&mut out, sets);
    rows(&mut out, report, sets);
    numerics(&mut out, report);
    let _ = write!(
        out,
        "<h2>Settings</h2>\n<details>\n<summary>the whole configuration; <code>--config</code> takes it</summary>\n<pre>{}</pre>\n\
         </details>\n<footer>\n<p>Every number of this page stands in <code>report.json</code>, every figure beside it as a PNG \
         file.</p>\n</footer>\n</main>\n</body>\n</html>\n",
        escape(&report.settings)
    );
    out
}

/// A path as an address: signs that mean something else there are coded.
fn address(path: &str) -> String {
    [('%', "%25"), (' ', "%20"), ('#', "%23"), ('?', "%3F"), ('\\', "/")]
        .iter()
        .fold(path.to_owned(), |text, (sign, code)| text.replace(*sign, code))
}

fn contact(out: &mut String, sets: &[MapSet]) {
    if sets.is_empty() {
        return;
    }
    let _ = writeln!(out, "<h2>The contact</h2>\n<p>{}</p>", prose(words::MAPS));
    for set in sets {
        let (n, r) = (&set.numbers, &set.numbers.response);
        let _ = writeln!(out, "<figure class=\"of-maps\" id=\"contact_{}\">\n<div class=\"maps\">", n.letter);
        for picture in &set.pictures {
            let data = BASE64.encode(&picture.png);
            let _ = writeln!(out, "<img alt=\"{}\" src=\"data:image/png;base64,{data}\">", escape(&picture.title));
        }
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
        let _ = writeln!(out, "</div>\n<figcaption><b>{}.</b> {}</figcaption>\n</figure>", n.letter, prose(&caption));
    }
}

/// The response at the rows of the path.
fn rows(out: &mut String, report: &SimulationReport, sets: &[MapSet]) {
    let responses = &report.trajectory.responses;
    let at = |t_s: &f64| responses.iter().rfind(|r| r.t_s == *t_s);
    let found: Vec<(usize, &Response)> =
        report.row_times_s.iter().map(at).enumerate().filter_map(|(k, r)| r.map(|r| (k + 1, r))).collect();
    *out += "<h2>Rows of the path</h2>\n<table>\n<thead><tr><th>row</th><th></th><th>t, s</th><th>depth, mm</th><th>slide x, mm</th>\
             <th>slide y, mm</th><th>normal force, N</th><th>friction x, N</th><th>friction y, N</th><th>contact, mm²</th>\
             <th>stick ratio</th><th class=\"name\">regime</th><th class=\"name\">status</th></tr></thead>\n<tbody>\n";
    for (row, r) in found.iter().take(MOST_ROWS) {
        let letter =
            sets.iter().find(|s| s.numbers.row == *row).map_or(String::new(), |s| s.numbers.letter.to_string());
        let numbers = [
            fixed(r.t_s, 3),
            fixed(r.depth_mm, 3),
            fixed(r.slide_x_mm, 3),
            fixed(r.slide_y_mm, 3),
            fixed(r.normal_force_n, 4),
            fixed(r.friction_x_n, 4),
            fixed(r.friction_y_n, 4),
            fixed(r.contact_area_mm2, 1),
            fixed(r.stick_ratio, 3),
        ];
        let cells: String = numbers.iter().map(|n| cell(n)).collect();
        let _ = writeln!(
            out,
            "<tr>{}<td>{letter}</td>{cells}<td>{}</td><td>{}</td></tr>",
            cell(&row.to_string()),
            r.regime,
            r.status
        );
    }
    *out += "</tbody>\n</table>\n";
    if found.len() > MOST_ROWS {
        let _ = writeln!(out, "<p class=\"meta\">{} more rows are in the response.</p>", found.len() - MOST_ROWS);
    }
}

fn numerics(out: &mut String, report: &SimulationReport) {
    let (c, w) = (&report.trajectory.cost, &report.trajectory.work);
    *out += "<h2>Numerics</h2>\n<div class=\"side\">\n<table>\n<tbody>\n";
    let counts = [
        ("increments", f64::from(c.increments), ""),
        ("increments cut back", f64::from(c.cutbacks), ""),
        ("equilibrium iterations", f64::from(c.iterations), ""),
        ("factorisations", f64::from(c.factorisations), ""),
    ];
    for (name, value, unit) in counts {
        let _ = writeln!(out, "<tr><td>{name}</td>{}<td>{unit}</td></tr>", cell(&fixed(value, 0)));
    }
    let works = [
        ("CPU time", c.cpu_s, "s"),
        ("work of the body", w.plane_mj, "mJ"),
        ("dissipated by slip", w.friction_mj, "mJ"),
        ("dissipated by stabilisation", w.stabilisation_mj, "mJ"),
    ];
    for (name, value, unit) in works {
        let _ = writeln!(out, "<tr><td>{name}</td>{}<td>{unit}</td></tr>", cell(&significant(value, 4)));
    }
    *out += "</tbody>\n</table>\n";
    if !report.checks.is_empty() {
        *out += "<table>\n<thead><tr><th class=\"name\">check</th><th>value</th><th>bound</th><th>unit</th><th></th></tr></thead>\n\
                 <tbody>\n";
        for c in &report.checks {
            let (class, word) = if c.passed { ("pass", "passed") } else { ("fail", "failed") };
            let _ = writeln!(
                out,
                "<tr><td>{}</td>{}{}<td>{}</td><td class=\"{class}\">{word}</td></tr>",
                escape(&c.name),
                cell(&significant(c.value, 3)),
                cell(&significant(c.bound, 3)),
                escape(&c.unit)
            );
        }
        *out += "</tbody>\n</table>\n";
    }
    *out += "</div>\n";
}
