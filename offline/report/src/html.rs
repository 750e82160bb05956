//! The page: verdict and Figure 2 first, then figures, checks, provenance, limits.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use super::numbers::{Comparison, Numbers, ReducedNumbers, fixed, signed, significant};
use super::{Check, Picture, captions, font};

/// The style sheet.
const STYLE: &str = include_str!("page.css");

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
fn fonts() -> String {
    let face = |weight, data: &[u8]| {
        format!(
            "@font-face{{font-family:\"{}\";font-weight:{weight};src:url(data:font/ttf;base64,{}) format(\"truetype\")}}\n",
            font::FAMILY,
            BASE64.encode(data)
        )
    };
    face(400, font::REGULAR) + &face(700, font::BOLD)
}

/// A page as one file: `main` is its content.
pub(super) fn document(title: &str, main: Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(fonts())) }
            }
            body { (main) }
        }
    };
    page.into_string()
}

/// Running text: numbers stay on one line with their units, and names with underscores are in code type.
pub(super) fn prose(text: &str) -> Markup {
    let text =
        [" mm", " %", " N/mm", " kPa"].iter().fold(text.to_owned(), |t, u| t.replace(u, &u.replace(' ', "\u{a0}")));
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let parts =
        text.split_inclusive(|c| !is_name(c)).map(|part| part.split_at(part.trim_end_matches(|c| !is_name(c)).len()));
    html! { @for (name, after) in parts { @if name.contains('_') { code { (name) } } @else { (name) } (after) } }
}

/// A cell with a number.
pub(super) fn cell(number: impl Render) -> Markup {
    html! { td.num { (number) } }
}

/// A cell with a difference in percent.
pub(super) fn difference(percent: f64) -> Markup {
    html! { td.num.diff { (signed(percent, 1)) } }
}

/// A row with the name, the value and the unit of a quantity.
pub(super) fn quantity(name: &str, value: impl Render, unit: &str) -> Markup {
    html! { tr { td { (name) } (cell(value)) td { (unit) } } }
}

/// Figures with their captions, numbered from `first` on.
pub(super) fn figures(first: usize, pictures: &[Picture]) -> Markup {
    html! {
        @for (number, picture) in (first..).zip(pictures) {
            figure id=(picture.name) {
                (image(picture))
                figcaption {
                    b { "Figure " (number) ". " (picture.title) "." } " " (prose(&picture.caption))
                }
            }
        }
    }
}

/// A figure without its caption.
pub(super) fn image(picture: &Picture) -> Markup {
    let labelled =
        |svg: &str| PreEscaped(svg.replacen("<svg ", &format!("<svg aria-label=\"{}\" ", escape(&picture.title)), 1));
    html! {
        @match &picture.narrow {
            Some(narrow) => { div.wide { (labelled(&picture.svg)) } div.narrow { (labelled(narrow)) } }
            None => (labelled(&picture.svg)),
        }
    }
}

/// Escapes text for SVG.
pub(super) fn escape(text: &str) -> String {
    html! { (text) }.into_string()
}

/// Heads of columns with numbers.
pub(super) fn heads(names: &[&str]) -> Markup {
    html! { @for name in names { th { (name) } } }
}

/// A table of rows below heads.
pub(super) fn table(heads: Markup, rows: Markup) -> Markup {
    html! { table { thead { tr { (heads) } } tbody { (rows) } } }
}

/// A table with a row for each item and the heads of its columns; numbers are in all columns but those that end in `:`.
pub(super) fn listing<T>(items: &[T], columns: &[(&str, fn(&T) -> String)]) -> Markup {
    let heads = html! {
        @for (head, _) in columns {
            @if let Some(name) = head.strip_suffix(':') { th.name { (name) } } @else { th { (head) } }
        }
    };
    let rows = html! {
        @for item in items {
            tr { @for (head, of) in columns { @if head.ends_with(':') { td { (prose(&of(item))) } } @else { (cell(of(item))) } } }
        }
    };
    table(heads, rows)
}

/// A table of rows below heads and a caption.
pub(super) fn captioned_table(caption: impl Render, heads: Markup, rows: Markup) -> Markup {
    html! { table { caption { (caption) } thead { tr { (heads) } } tbody { (rows) } } }
}

/// A table of checks with their bounds.
pub(super) fn checks_table(checks: &[Check]) -> Markup {
    let heads = html! { th.name { "check" } (heads(&["value", "bound", "unit", ""])) };
    let rows = html! {
        @for c in checks {
            tr {
                td { (c.name) } (cell(significant(c.value, 3))) (cell(significant(c.bound, 3))) td { (c.unit) }
                @if c.passed { td.pass { "passed" } } @else { td.fail { "failed" } }
            }
        }
    };
    table(heads, rows)
}

fn number(v: Option<f64>, decimals: usize) -> Markup {
    cell(fixed(v.unwrap_or(f64::NAN), decimals))
}

/// The page as one file.
pub fn page(numbers: &Numbers, pictures: &[Picture]) -> String {
    let p = &numbers.provenance;
    let (first, rest) = pictures.split_at(pictures.len().min(1));
    let left_out = LEFT_OUT.iter().copied().chain(numbers.left_out.iter().map(String::as_str));
    let main = html! {
        main {
            header {
                h1 { "Friction of a fingertip: finite elements against Table 1" }
                p.meta {
                    "shape " (p.shape) " (" (p.bones) " bones) · mesh " (p.mesh_preset)
                    " · λ = " (significant(p.friction.lambda, 3)) " MPa" sup { "1−β" }
                    ", β = " (significant(p.friction.beta, 3))
                    " · fingerpad " (p.program_version) " · settings " (p.settings_hash)
                }
            }
            section.first {
                div { p.verdict { (prose(&captions::verdict(numbers))) } (verdict_table(numbers)) }
                (figures(1, first))
            }
            section { (figures(2, rest)) }
            (tables(numbers))
            footer {
                h2 #limits { "What the model leaves out" }
                ol { @for sentence in left_out { li { (sentence) } } }
                p {
                    "Measured: Table 1 of H. Yoshida, M. Tada, M. Mochimaru, Molecular & Cellular Biomechanics 8(1), 2011, \
                     61–72. Every number of this page stands in " code { "report.json" }
                    ", every figure beside it as an SVG file."
                }
            }
        }
    };
    document("fingerpad: friction of a fingertip against Table 1", main)
}

fn verdict_table(numbers: &Numbers) -> Markup {
    let three = |c: &Comparison, decimals| {
        let percent = c.difference_percent.unwrap_or(f64::NAN);
        html! { (number(c.measured, decimals)) (number(c.model, decimals)) (difference(percent)) }
    };
    html! {
        table {
            caption { "Table 1 against this model; difference in percent of the measured value." }
            thead {
                tr {
                    th rowspan="2" { "depth" br; "mm" }
                    @for head in ["normal force, N", "contact area, mm²", "friction F/N"] { th colspan="3" { (head) } }
                }
                tr { @for _ in 0..3 { (heads(&["meas.", "model", "diff. %"])) } }
            }
            tbody {
                @for d in &numbers.depths {
                    tr {
                        (cell(fixed(d.depth_mm, 2)))
                        (three(&d.normal_force_n, 3)) (three(&d.contact_area_mm2, 1)) (three(&d.friction_coefficient, 2))
                    }
                }
                @if numbers.depths.is_empty() { tr { td colspan="10" { "no depth was run" } } }
            }
        }
    }
}

fn reduced_table(reduced: &ReducedNumbers) -> Markup {
    html! {
        h2 { "Reduced model " (reduced.model) " along the same motions" }
        table {
            caption {
                "Difference from the finite elements over all rows of a run; percent of the largest value of the run."
            }
            thead {
                tr { th rowspan="2" { "depth, mm" } th colspan="4" { "normal force" } th colspan="4" { "friction" } }
                tr { @for _ in 0..2 { (heads(&["RMS, N", "RMS, %", "largest, N", "largest, %"])) } }
            }
            tbody {
                @for d in &reduced.depths {
                    tr {
                        (cell(fixed(d.depth_mm, 2)))
                        @for (n, percent) in [(d.normal_n, d.normal_percent), (d.friction_n, d.friction_percent)] {
                            @for (n, percent) in n.into_iter().zip(percent) { (number(n, 4)) (number(percent, 2)) }
                        }
                    }
                }
            }
        }
    }
}

fn tables(numbers: &Numbers) -> Markup {
    html! {
        section.tables {
            h2 { "Per depth" }
            (friction_table(numbers))
            (cost_table(numbers))
            @if let Some(reduced) = &numbers.reduced { (reduced_table(reduced)) }
            @if !numbers.checks.is_empty() { h2 { "Checks of this run" } (checks_table(&numbers.checks)) }
            (provenance(numbers))
        }
    }
}

/// Forces, friction and stick of each depth.
fn friction_table(numbers: &Numbers) -> Markup {
    let heads = html! {
        th { "depth, mm" } th { "pressed, no slide: N, N" } th { "kinetic: N, N" } th { "kinetic F/N" }
        th { "F/N, law over frictionless pressure" } th { "difference, %" } th { "full slip from, mm" }
        th { "largest friction, N" } th { "slide, mm" } th { "stick ratio at its end" } th { "F/N at its end" }
    };
    let rows = html! {
        @for d in &numbers.depths {
            tr {
                (cell(fixed(d.depth_mm, 2))) (number(d.pressed_normal_force_n, 3)) (number(d.normal_force_n.model, 3))
                (number(d.friction_coefficient.model, 3)) (number(d.frictionless_friction_coefficient, 3))
                (cell(signed(d.frictionless_difference_percent.unwrap_or(f64::NAN), 1)))
                (cell(d.full_slip_travel_mm.map_or("not reached".into(), |slide| fixed(slide, 2))))
                (number(d.peak_friction_n, 3)) (number(d.travel_mm, 2)) (number(d.final_stick_ratio, 3))
                (number(d.final_friction_coefficient, 3))
            }
        }
    };
    table(heads, rows)
}

/// Numerical effort and work of each depth.
fn cost_table(numbers: &Numbers) -> Markup {
    let heads = html! {
        th { "depth, mm" } th { "increments" } th { "cutbacks" } th { "iterations" } th { "factorisations" }
        th { "CPU, s" } th { "work of the plane, mJ" } th { "dissipated by slip, mJ" } th { "stabilisation, mJ" }
    };
    let rows = html! {
        @for (d, c) in numbers.depths.iter().map(|d| (d, &d.cost)) {
            tr {
                (cell(fixed(d.depth_mm, 2)))
                (cell(c.increments)) (cell(c.cutbacks)) (cell(c.iterations)) (cell(c.factorisations))
                (cell(fixed(c.cpu_s, 1))) (cell(fixed(d.work.plane_mj, 4))) (cell(fixed(d.work.friction_mj, 4)))
                (cell(fixed(d.work.stabilisation_mj, 4)))
            }
        }
    };
    table(heads, rows)
}

/// Mesh, law and times.
fn provenance(numbers: &Numbers) -> Markup {
    let p = &numbers.provenance;
    let (m, f) = (&p.mesh, &p.friction);
    let total = ("all", numbers.total_wall_s, numbers.total_cpu_s);
    let stages = p.stages.iter().map(|s| (s.name.as_str(), s.wall_s, s.cpu_s)).chain([total]);
    html! {
        h2 { "Provenance" }
        div.side {
            table {
                tbody {
                    (quantity("nodes", m.nodes, "")) (quantity("hexahedra", m.hexes, ""))
                    (quantity("tetrahedra", m.tets, "")) (quantity("pad faces", m.pad_faces, ""))
                    (quantity("free degrees of freedom", m.free_dofs, ""))
                    @for q in &p.quality { (quantity(&q.name, significant(q.value, 4), &q.unit)) }
                    (quantity("λ", significant(f.lambda, 4), "MPa^(1−β)")) (quantity("β", significant(f.beta, 4), ""))
                    (quantity("τ₀", significant(f.tau0_mpa, 4), "MPa"))
                    (quantity("γ_crit", significant(f.gamma_crit_mm, 4), "mm"))
                    @if let (Some(ratio), Some(axis_deg)) = (f.across_over_along, f.skin_axis_deg) {
                        (quantity("strength across over along the skin's axis", significant(ratio, 4), ""))
                        (quantity("angle of that axis", significant(axis_deg, 4), "°"))
                    }
                }
            }
            (table(html! { th.name { "stage" } (heads(&["wall, s", "CPU, s"])) }, html! {
                @for (name, wall, cpu) in stages {
                    tr { td { (name) } (cell(fixed(wall, 1))) (cell(fixed(cpu, 1))) }
                }
            }))
        }
    }
}
