//! The page of a diagnosis of a table: one number first, then the cells, the candidates, and the next experiment.

use std::fmt::Write as _;

use crate::diagnosis::word;
use crate::html::{Picture, STYLE, cell, escape, figure, fonts, prose};
use crate::numbers::{fixed, signed, significant};
use fingerpad_diagnose::Verdict;
use fingerpad_table::{CandidateReport, Finding, QUANTITIES, TableSection};

/// The page as one file.
pub fn page(finding: &Finding, pictures: &[Picture]) -> String {
    let (report, section) = (&finding.report.diagnosis, &finding.report.table);
    let title = match report.verdict {
        Verdict::None => "The finite elements explain the table",
        Verdict::Named => "The missing effect has a name",
        Verdict::Ambiguous => "More than one effect would explain the table",
        Verdict::UnexplainedStructure => "Something that no candidate explains",
    };
    let files: Vec<&str> = report.input.iter().map(|f| f.file.as_str()).collect();
    let fe = &section.finite_elements;
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>fingerpad diagnose: {title}</title>\n<style>\n{STYLE}{}</style>\n\
         </head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n<p class=\"meta\">{} · shape {} · mesh {} ({} nodes) · fingerpad {}</p>\n\
         </header>\n<p class=\"verdict\">{}</p>\n<p>Verdict: <code>{}</code></p>\n",
        fonts(),
        escape(&files.join(" · ")),
        escape(&fe.shape),
        escape(&fe.mesh_preset),
        fe.nodes,
        escape(&report.version),
        prose(&first_sentence(section)),
        word(report),
    );
    figure(&mut out, 1, &pictures[0]);
    out += &steps(section);
    out += &cells(section);
    figure(&mut out, 2, &pictures[1]);
    out += &candidates(section);
    for (heading, sentences) in [
        ("What this table does not determine", &section.cannot_tell),
        ("The experiment that would decide", &section.decides),
    ] {
        let _ = writeln!(out, "<h2>{heading}</h2>\n<ul>");
        for sentence in sentences {
            let _ = writeln!(out, "<li>{}</li>", prose(sentence));
        }
        out += "</ul>\n";
    }
    if let Some(plan) = &report.next_experiment {
        let depths: Vec<String> =
            plan.runs.iter().filter_map(|r| r.depth_mm).map(|d| format!("{} mm", fixed(d, 2))).collect();
        let _ = writeln!(
            out,
            "<p>Strokes, after 60 s of rest each: {}. In <code>next_experiment.csv</code>.</p>",
            prose(&depths.join(", "))
        );
    }
    let _ = writeln!(
        out,
        "<footer>\n<h2>Basis of this result</h2>\n<p>{} steady slides by finite elements were computed; a regression through \
         them (off by {} % in normal force, {} % in area, {} % in friction) carried the fits, whose ends were computed by \
         finite elements again. Every number stands in <code>report.json</code>, the table side by side in \
         <code>side_by_side.csv</code>, without what the instruments add in <code>corrected_table.csv</code>, finger and law in \
         <code>corrected.toml</code>.</p>\n</footer>\n</main>\n</body>\n</html>",
        fe.computed,
        fixed(fe.regression_percent[0], 1),
        fixed(fe.regression_percent[1], 1),
        fixed(fe.regression_percent[2], 1),
    );
    out
}

/// The number that matters, in one sentence.
fn first_sentence(section: &TableSection) -> String {
    let gap = |name: &str| section.steps.iter().find(|s| s.name == name).map(|s| fixed(s.rms_percent, 1));
    let as_given = gap("as_given").unwrap_or_default();
    let best = section.contenders.first().map_or("constants", String::as_str);
    match (gap("corrected"), gap("constants")) {
        (Some(after), Some(constants)) => {
            let candidate = section.candidates.iter().find(|c| c.name == best);
            let values: Vec<String> = candidate.iter().flat_map(|c| &c.parameters).map(value).collect();
            format!(
                "With {} ({}) the gap between simulation and table falls from {as_given} % to {after} %; \
                 the finger's stiffness, touch point and strength alone leave {constants} %.",
                best.replace('_', " ").replace('+', " and "),
                values.join(", "),
            )
        }
        (_, constants) => format!(
            "The finger's stiffness, touch point and strength alone bring the gap between simulation and table from \
             {as_given} % to {} %; no effect is needed beside them.",
            constants.unwrap_or_default()
        ),
    }
}

fn value(p: &fingerpad_diagnose::FittedParameter) -> String {
    let (v, unit) = if p.unit == "N" { (1e3 * p.value, "mN") } else { (p.value, p.unit.as_str()) };
    format!(
        "{} {} {unit}",
        p.name.replace('_', " ").trim_end_matches(" n"),
        signed(v, if unit == "mN" { 0 } else { 2 })
    )
    .trim()
    .into()
}

fn steps(section: &TableSection) -> String {
    let mut out =
        "<h2>The gap, step by step</h2>\n<table>\n<thead><tr><th class=\"name\">free parameters</th><th>numbers fitted</th>\
                   <th>gap, %</th></tr></thead>\n<tbody>\n"
            .to_owned();
    for step in &section.steps {
        let _ = writeln!(
            out,
            "<tr><td>{}</td>{}{}</tr>",
            prose(&step.words),
            cell(&step.freedoms.to_string()),
            cell(&fixed(step.rms_percent, 1))
        );
    }
    let (p, c) = (&section.published, &section.corrected);
    let _ = writeln!(
        out,
        "</tbody>\n</table>\n<p>λ {} → {} MPa<sup>1−β</sup>, β {} → {}, τ₀ {} → {} kPa, stiffness factor {} → {}, depth offset {} → \
         {} mm.</p>",
        significant(p.lambda, 3),
        significant(c.lambda, 3),
        fixed(p.beta, 2),
        fixed(c.beta, 2),
        fixed(1e3 * p.tau0_mpa, 2),
        fixed(1e3 * c.tau0_mpa, 2),
        fixed(section.calibrated_stiffness, 3),
        fixed(section.corrected_stiffness, 3),
        signed(section.calibrated_depth_offset_mm, 3),
        signed(section.corrected_depth_offset_mm, 3),
    );
    out
}

fn cells(section: &TableSection) -> String {
    let mut out = "<h2>Cell by cell</h2>\n<table>\n<thead><tr><th>depth<br>mm</th><th class=\"name\">quantity</th><th>measured</th>\
                   <th>published</th><th>gap, %</th><th>calibrated</th><th>gap, %</th><th>corrected</th><th>gap, %</th>\
                   <th>measured without<br>the instruments' share</th></tr></thead>\n<tbody>\n"
        .to_owned();
    for c in &section.cells {
        let decimals = if c.quantity == QUANTITIES[1] { 1 } else { 3 };
        let pair = |model: f64, percent: f64| {
            cell(&fixed(model, decimals)) + &cell(&signed(percent, 1)).replace("\"num\"", "\"num diff\"")
        };
        let name = c.quantity.trim_end_matches("_n").trim_end_matches("_mm2").replace('_', " ");
        let _ = writeln!(
            out,
            "<tr>{}<td>{}</td>{}{}{}{}{}</tr>",
            cell(&fixed(c.depth_mm, 2)),
            escape(&name),
            cell(&fixed(c.measured, decimals)),
            pair(c.as_given, c.as_given_percent),
            pair(c.calibrated, c.calibrated_percent),
            pair(c.corrected, c.corrected_percent),
            cell(&fixed(c.measured_corrected, decimals)),
        );
    }
    out + "</tbody>\n</table>\n"
}

fn candidates(section: &TableSection) -> String {
    let mut list: Vec<&CandidateReport> = section.candidates.iter().collect();
    list.sort_by(|a, b| a.effects.len().cmp(&b.effects.len()).then(a.delta_2le.total_cmp(&b.delta_2le)));
    let mut out = "<h2>Every candidate, alone and in pairs</h2>\n<details><summary>Table</summary>\n<table>\n<thead><tr><th class=\"name\">\
                   candidate</th><th class=\"name\">values</th><th>numbers<br>fitted</th><th>gap left, %</th><th>alone, %</th><th>depths left<br>out, %</th>\
                   <th>evidence<br>behind best</th><th>explained as<br>much by</th><th class=\"name\">ends by</th></tr></thead>\n<tbody>\n"
        .to_owned();
    for c in list {
        let values: Vec<String> = c.parameters.iter().map(value).collect();
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{}</td>{}{}{}{}{}{}<td>{}</td></tr>",
            escape(&c.name.replace('+', " + ")),
            prose(&values.join(", ")),
            cell(&c.freedoms.to_string()),
            cell(&fixed(c.rms_percent, 1)),
            cell(&fixed(c.alone_rms_percent, 1)),
            cell(&c.left_out_rms_percent.map_or_else(|| "–".into(), |v| fixed(v, 1))),
            cell(&fixed(c.delta_2le, 1)),
            cell(&format!("{} others", c.explains_as_much.len())),
            if c.by_finite_elements { "finite elements" } else { "regression" },
        );
    }
    out + "</tbody>\n</table>\n</details>\n"
}
