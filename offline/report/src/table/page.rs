//! The page of a diagnosis of a table: one number first, then the cells, the candidates, and the next experiment.

use maud::{Markup, html};

use crate::Picture;
use crate::diagnosis::word;
use crate::html::{cell, difference, document, figures, prose, table};
use crate::numbers::{fixed, signed, significant};
use fingerpad_diagnose::Verdict;
use fingerpad_identify::table_diagnosis::{CandidateReport, Finding, QUANTITIES, TableSection};

/// The page as one file.
pub fn page(finding: &Finding, pictures: &[Picture]) -> String {
    let (report, section) = (&finding.report.diagnosis, &finding.report.table);
    let title = headline(report.verdict, section);
    let files: Vec<&str> = report.input.iter().map(|f| f.file.as_str()).collect();
    let fe = &section.finite_elements;
    let [force, area, friction] = fe.regression_percent.map(|percent| fixed(percent, 1));
    let main = html! {
        main.diagnosis {
            header {
                p.meta {
                    (files.join(" · ")) " · shape " (fe.shape) " · mesh " (fe.mesh_preset) " (" (fe.nodes) " nodes)"
                    " · fingerpad " (report.version)
                }
                h1 { (prose(&title)) }
            }
            p.verdict { (prose(&first_sentence(section))) }
            p { "Verdict: " code { (word(report)) } }
            (figures(1, &pictures[..1]))
            section.pair { (figures(2, &pictures[1..])) div { (steps(section)) } }
            (cells(section))
            (candidates(section))
            section.pair {
                div { (sentences("What this table does not determine", &section.cannot_tell)) }
                div { (sentences("The experiment that would decide", &section.decides)) }
            }
            @if let Some(plan) = &report.next_experiment {
                @let depths = plan.runs.iter().filter_map(|r| r.depth_mm).map(|d| format!("{} mm", fixed(d, 2)));
                p {
                    "Strokes, after 60 s of rest each: " (prose(&depths.collect::<Vec<_>>().join(", "))) ". In "
                    code { "next_experiment.csv" } "."
                }
            }
            footer {
                h2 { "Basis of this result" }
                p {
                    (fe.computed) " steady slides by finite elements were computed; a regression through them (off by "
                    (force) " % in normal force, " (area) " % in area, " (friction) " % in friction) carried the fits, \
                     whose ends were computed by finite elements again. Every number stands in " code { "report.json" }
                    ", the table side by side in " code { "side_by_side.csv" } ", without what the instruments add in "
                    code { "corrected_table.csv" } ", finger and law in " code { "corrected.toml" } "."
                }
            }
        }
    };
    document(&format!("fingerpad diagnose: {title}"), main)
}

fn sentences(heading: &str, sentences: &[String]) -> Markup {
    html! {
        h2 { (heading) }
        ul { @for sentence in sentences { li { (prose(sentence)) } } }
    }
}

/// The verdict in words, with the gap before and after in per cent.
fn headline(verdict: Verdict, section: &TableSection) -> String {
    let gap = |name: &str| section.steps.iter().find(|s| s.name == name).map(|s| s.rms_percent);
    let after = gap("corrected").or(gap("constants")).unwrap_or(f64::NAN);
    let names: Vec<String> =
        section.contenders.iter().take(2).map(|c| c.replace('_', " ").replace('+', " and ")).collect();
    let more = if section.contenders.len() > 2 { " or another" } else { "" };
    let finding = match verdict {
        Verdict::None => "Nothing is missing: the finger's constants explain the table".into(),
        Verdict::Named => format!("Missing: {}", names.first().map_or("", String::as_str)),
        Verdict::Ambiguous => format!("Missing: {}{more}, and this table cannot tell which", names.join(" or ")),
        Verdict::UnexplainedStructure => "Unexplained: no candidate brings the gap down to the errors".into(),
    };
    let [before, after] = [gap("as_given").unwrap_or(f64::NAN), after].map(|percent| significant(percent, 2));
    format!("{finding}. The gap falls from {before} to {after} %.")
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

fn steps(section: &TableSection) -> Markup {
    let (p, c) = (&section.published, &section.corrected);
    let heads = html! { th.name { "free parameters" } th { "numbers fitted" } th { "gap, %" } };
    let rows = html! {
        @for step in &section.steps {
            tr { td { (prose(&step.words)) } (cell(step.freedoms)) (cell(fixed(step.rms_percent, 1))) }
        }
    };
    html! {
        h2 { "The gap, step by step" }
        (table(heads, rows))
        p {
            "λ " (significant(p.lambda, 3)) " → " (significant(c.lambda, 3)) " MPa" sup { "1−β" }
            ", β " (fixed(p.beta, 2)) " → " (fixed(c.beta, 2))
            ", τ₀ " (fixed(1e3 * p.tau0_mpa, 2)) " → " (fixed(1e3 * c.tau0_mpa, 2)) " kPa"
            ", stiffness factor " (fixed(section.calibrated_stiffness, 3)) " → " (fixed(section.corrected_stiffness, 3))
            ", depth offset " (signed(section.calibrated_depth_offset_mm, 3)) " → "
            (signed(section.corrected_depth_offset_mm, 3)) " mm."
        }
    }
}

fn cells(section: &TableSection) -> Markup {
    let heads = html! {
        th { "depth" br; "mm" } th.name { "quantity" } th { "measured" }
        th { "published" } th { "gap, %" } th.minor { "calibrated" } th.minor { "gap, %" } th { "corrected" } th { "gap, %" }
        th.minor { "measured without" br; "the instruments' share" }
    };
    let rows = html! {
        @for c in &section.cells {
            @let decimals = if c.quantity == QUANTITIES[1] { 1 } else { 3 };
            tr {
                (cell(fixed(c.depth_mm, 2)))
                td { (c.quantity.trim_end_matches("_n").trim_end_matches("_mm2").replace('_', " ")) }
                (cell(fixed(c.measured, decimals)))
                (cell(fixed(c.as_given, decimals))) (difference(c.as_given_percent))
                td.num.minor { (fixed(c.calibrated, decimals)) } td.num.diff.minor { (signed(c.calibrated_percent, 1)) }
                (cell(fixed(c.corrected, decimals))) (difference(c.corrected_percent))
                td.num.minor { (fixed(c.measured_corrected, decimals)) }
            }
        }
    };
    html! { h2 { "Cell by cell" } (table(heads, rows)) }
}

fn candidates(section: &TableSection) -> Markup {
    let mut list: Vec<&CandidateReport> = section.candidates.iter().collect();
    list.sort_by(|a, b| a.effects.len().cmp(&b.effects.len()).then(a.delta_2le.total_cmp(&b.delta_2le)));
    let heads = html! {
        th.name { "candidate" } th.name { "values" } th { "numbers" br; "fitted" } th { "gap left, %" } th { "alone, %" }
        th { "depths left" br; "out, %" } th { "evidence" br; "behind best" } th { "explained as" br; "much by" }
        th.name { "ends by" }
    };
    let rows = html! {
        @for c in list {
            tr {
                td { (c.name.replace('+', " + ")) }
                td { (prose(&c.parameters.iter().map(value).collect::<Vec<_>>().join(", "))) }
                (cell(c.freedoms)) (cell(fixed(c.rms_percent, 1))) (cell(fixed(c.alone_rms_percent, 1)))
                (cell(c.left_out_rms_percent.map_or_else(|| "–".into(), |v| fixed(v, 1))))
                (cell(fixed(c.delta_2le, 1))) (cell(format!("{} others", c.explains_as_much.len())))
                td { (if c.by_finite_elements { "finite elements" } else { "regression" }) }
            }
        }
    };
    html! { h2 { "Every candidate, alone and in pairs" } details { summary { "Table" } (table(heads, rows)) } }
}
