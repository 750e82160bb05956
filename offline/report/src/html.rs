//! The page: verdict and Figure 2 first, then figures, checks, provenance, limits.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::numbers::{Comparison, Numbers, ReducedNumbers, fixed, signed, significant};
use super::{captions, font};

/// A figure with its words.
pub struct Picture {
    /// Name of its file without ending.
    pub name: String,
    /// Title.
    pub title: String,
    /// Caption.
    pub caption: String,
    /// PNG file.
    pub png: Vec<u8>,
    /// The same as `<svg>`, if that is the better form; two of them for wide and narrow pages.
    pub svg: Option<String>,
}

/// The sheet of every page.
pub(super) const STYLE: &str = include_str!("page.css");

/// Limits of the model that every report lists.
const LEFT_OUT: [&str; 6] = [
    "One finger: the shape is parametric, not an image of the subject measured in Table 1.",
    "The skin is a smooth layer: no fingerprint ridges, no hair, no separate epidermis and dermis.",
    "Tissue is elastic and the motion quasi-static: no viscosity, no inertia, no dependence on speed.",
    "Friction depends on pressure and elastic slip only: no moisture, no adhesion, no wear, no ageing of the contact.",
    "The plane is rigid and smooth.",
    "Table 1 gives means of three trials without their spread, so no difference here has an error bar.",
];

/// Fonts that the figures are set in.
pub(super) fn fonts() -> String {
    let face = |weight, data: &[u8]| {
        format!(
            "@font-face{{font-family:\"{}\";font-weight:{weight};src:url(data:font/ttf;base64,{}) format(\"truetype\")}}\n",
            font::FAMILY,
            BASE64.encode(data)
        )
    };
    face(400, font::REGULAR) + &face(700, font::BOLD)
}

/// Escapes text for a page.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Escapes running text and keeps numbers and their units on one line.
pub(super) fn prose(text: &str) -> String {
    [" mm", " %", " N/mm", " kPa"].iter().fold(escape(text), |t, unit| t.replace(unit, &unit.replace(' ', "\u{a0}")))
}

/// A cell with a number.
pub(super) fn cell(text: &str) -> String {
    format!("<td class=\"num\">{text}</td>")
}

fn number(v: Option<f64>, decimals: usize) -> String {
    cell(&fixed(v.unwrap_or(f64::NAN), decimals))
}

/// The page as one file.
pub fn page(numbers: &Numbers, pictures: &[Picture]) -> String {
    let p = &numbers.provenance;
    let mut out = String::new();
    let fonts = fonts();
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>fingerpad: friction of a fingertip against Table 1</title>\n<style>\n{STYLE}{fonts}</style>\n</head>\n<body>\n<main>\n\
         <header>\n<h1>Friction of a fingertip: finite elements against Table 1</h1>\n\
         <p class=\"meta\">shape {} ({} bones) · mesh {} · λ = {} MPa<sup>1−β</sup>, β = {} · fingerpad {} · settings {}</p>\n\
         </header>\n",
        escape(&p.shape),
        escape(&p.bones),
        escape(&p.mesh_preset),
        significant(p.friction.lambda, 3),
        significant(p.friction.beta, 3),
        escape(&p.program_version),
        escape(&p.settings_hash),
    );
    let (first, rest) = pictures.split_first().map_or((None, pictures), |(f, r)| (Some(f), r));
    let _ = write!(
        out,
        "<section class=\"first\">\n<div>\n<p class=\"verdict\">{}</p>\n{}</div>\n",
        prose(&captions::verdict(numbers)),
        verdict_table(numbers)
    );
    if let Some(picture) = first {
        figure(&mut out, 1, picture);
    }
    out += "</section>\n<section>\n";
    for (i, picture) in rest.iter().enumerate() {
        figure(&mut out, i + 2, picture);
    }
    out += "</section>\n";
    out += &tables(numbers);
    out += "<footer>\n<h2 id=\"limits\">What the model leaves out</h2>\n<ol>\n";
    for sentence in LEFT_OUT.iter().copied().chain(numbers.left_out.iter().map(String::as_str)) {
        let _ = writeln!(out, "<li>{}</li>", escape(sentence));
    }
    out += "</ol>\n<p>Measured: Table 1 of H. Yoshida, M. Tada, M. Mochimaru, Molecular &amp; Cellular Biomechanics 8(1), 2011, \
            61–72. Every number of this page stands in <code>report.json</code>, every figure beside it as a PNG file.</p>\n\
            </footer>\n</main>\n</body>\n</html>\n";
    out
}

pub(super) fn figure(out: &mut String, number: usize, picture: &Picture) {
    let title = escape(&picture.title);
    let _ = writeln!(out, "<figure id=\"{}\">", escape(&picture.name));
    match &picture.svg {
        Some(svg) => out.push_str(&svg.replace("<svg ", &format!("<svg aria-label=\"{title}\" "))),
        None => {
            let _ =
                writeln!(out, "<img alt=\"{title}\" src=\"data:image/png;base64,{}\">", BASE64.encode(&picture.png));
        }
    }
    let caption = prose(&picture.caption);
    let _ = write!(out, "<figcaption><b>Figure {number}. {title}.</b> {caption}</figcaption>\n</figure>\n");
}

fn verdict_table(numbers: &Numbers) -> String {
    let mut out = "<table>\n<caption>Table 1 against this model; difference in percent of the measured value.</caption>\n<thead>\n\
                   <tr><th rowspan=\"2\">depth<br>mm</th><th colspan=\"3\">normal force, N</th>\
                   <th colspan=\"3\">contact area, mm²</th><th colspan=\"3\">friction F/N</th></tr>\n<tr>"
        .to_owned();
    out += &"<th>meas.</th><th>model</th><th>diff. %</th>".repeat(3);
    out += "</tr>\n</thead>\n<tbody>\n";
    for d in &numbers.depths {
        let three = |c: &Comparison, decimals| {
            let difference =
                cell(&signed(c.difference_percent.unwrap_or(f64::NAN), 1)).replace("\"num\"", "\"num diff\"");
            number(c.measured, decimals) + &number(c.model, decimals) + &difference
        };
        let _ = writeln!(
            out,
            "<tr>{}{}{}{}</tr>",
            cell(&fixed(d.depth_mm, 2)),
            three(&d.normal_force_n, 3),
            three(&d.contact_area_mm2, 1),
            three(&d.friction_coefficient, 2)
        );
    }
    if numbers.depths.is_empty() {
        out += "<tr><td colspan=\"10\">no depth was run</td></tr>\n";
    }
    out + "</tbody>\n</table>\n"
}

fn reduced_table(reduced: &ReducedNumbers) -> String {
    let mut out = format!(
        "<h2>Reduced model {} along the same motions</h2>\n<table>\n<caption>Difference from the finite elements over all rows of \
         a run; percent of the largest value of the run.</caption>\n<thead><tr><th rowspan=\"2\">depth, mm</th>\
         <th colspan=\"4\">normal force</th><th colspan=\"4\">friction</th></tr>\n<tr>",
        escape(&reduced.model)
    );
    out += &"<th>RMS, N</th><th>RMS, %</th><th>largest, N</th><th>largest, %</th>".repeat(2);
    out += "</tr></thead>\n<tbody>\n";
    for d in &reduced.depths {
        out += "<tr>";
        out += &cell(&fixed(d.depth_mm, 2));
        for (n, percent) in [(d.normal_n, d.normal_percent), (d.friction_n, d.friction_percent)] {
            for (n, percent) in n.into_iter().zip(percent) {
                out += &number(n, 4);
                out += &number(percent, 2);
            }
        }
        out += "</tr>\n";
    }
    out + "</tbody>\n</table>\n"
}

fn tables(numbers: &Numbers) -> String {
    let p = &numbers.provenance;
    let mut out = "<section class=\"tables\">\n<h2>Per depth</h2>\n<table>\n<thead><tr><th>depth, mm</th>\
                   <th>pressed, no slide: N, N</th><th>kinetic: N, N</th><th>kinetic F/N</th>\
                   <th>F/N, law over frictionless pressure</th><th>difference, %</th><th>full slip from, mm</th>\
                   <th>largest friction, N</th><th>slide, mm</th><th>stick ratio at its end</th><th>F/N at its end</th>\
                   </tr></thead>\n<tbody>\n"
        .to_owned();
    for d in &numbers.depths {
        out += "<tr>";
        out += &cell(&fixed(d.depth_mm, 2));
        out += &number(d.pressed_normal_force_n, 3);
        out += &number(d.normal_force_n.model, 3);
        out += &number(d.friction_coefficient.model, 3);
        out += &number(d.frictionless_friction_coefficient, 3);
        out += &cell(&signed(d.frictionless_difference_percent.unwrap_or(f64::NAN), 1));
        match d.full_slip_travel_mm {
            Some(slide) => out += &cell(&fixed(slide, 2)),
            None => out += "<td class=\"num\">not reached</td>",
        }
        out += &number(d.peak_friction_n, 3);
        out += &number(d.travel_mm, 2);
        out += &number(d.final_stick_ratio, 3);
        out += &number(d.final_friction_coefficient, 3);
        out += "</tr>\n";
    }
    out += "</tbody>\n</table>\n<table>\n<thead><tr><th>depth, mm</th><th>increments</th><th>cutbacks</th><th>iterations</th>\
            <th>factorisations</th><th>CPU, s</th><th>work of the plane, mJ</th><th>dissipated by slip, mJ</th>\
            <th>stabilisation, mJ</th></tr></thead>\n<tbody>\n";
    for d in &numbers.depths {
        let c = &d.cost;
        out += "<tr>";
        out += &cell(&fixed(d.depth_mm, 2));
        for count in [c.increments, c.cutbacks, c.iterations, c.factorisations] {
            out += &cell(&count.to_string());
        }
        out += &cell(&fixed(c.cpu_s, 1));
        for work in [d.work.plane_mj, d.work.friction_mj, d.work.stabilisation_mj] {
            out += &cell(&fixed(work, 4));
        }
        out += "</tr>\n";
    }
    out += "</tbody>\n</table>\n";
    if let Some(reduced) = &numbers.reduced {
        out += &reduced_table(reduced);
    }
    if !numbers.checks.is_empty() {
        out += "<h2>Checks of this run</h2>\n<table>\n<thead><tr><th class=\"name\">check</th><th>value</th><th>bound</th>\
                <th>unit</th><th></th></tr></thead>\n<tbody>\n";
        for c in &numbers.checks {
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
        out += "</tbody>\n</table>\n";
    }
    out += "<h2>Provenance</h2>\n<div class=\"side\">\n<table>\n<tbody>\n";
    let m = &p.mesh;
    let counts = [
        ("nodes", m.nodes),
        ("hexahedra", m.hexes),
        ("tetrahedra", m.tets),
        ("pad faces", m.pad_faces),
        ("free degrees of freedom", m.free_dofs),
    ];
    for (name, count) in counts {
        let _ = writeln!(out, "<tr><td>{name}</td>{}<td></td></tr>", cell(&count.to_string()));
    }
    let f = &p.friction;
    let constants =
        [("λ", f.lambda, "MPa^(1−β)"), ("β", f.beta, ""), ("τ₀", f.tau0_mpa, "MPa"), ("γ_crit", f.gamma_crit_mm, "mm")];
    let quality = p.quality.iter().map(|q| (q.name.as_str(), q.value, q.unit.as_str()));
    for (name, value, unit) in quality.chain(constants) {
        let _ = writeln!(
            out,
            "<tr><td>{}</td>{}<td>{}</td></tr>",
            escape(name),
            cell(&significant(value, 4)),
            escape(unit)
        );
    }
    out += "</tbody>\n</table>\n<table>\n<thead><tr><th class=\"name\">stage</th><th>wall, s</th><th>CPU, s</th></tr></thead>\n<tbody>\n";
    let total = ("all", numbers.total_wall_s, numbers.total_cpu_s);
    for (name, wall, cpu) in p.stages.iter().map(|s| (s.name.as_str(), s.wall_s, s.cpu_s)).chain([total]) {
        let _ = writeln!(out, "<tr><td>{}</td>{}{}</tr>", escape(name), cell(&fixed(wall, 1)), cell(&fixed(cpu, 1)));
    }
    out + "</tbody>\n</table>\n</div>\n</section>\n"
}
