//! The page of a diagnosis: the verdict first, then its evidence, then the next experiment.

use maud::{Markup, html};

use super::{repeated, words};
use crate::Picture;
use crate::html::{captioned_table, cell, document, figures, heads, prose, table};
use crate::numbers::{fixed, significant};
use fingerpad_diagnose::{Diagnosis, DriverPlot, EffectFound, FACTORS, Factor, PlannedRun};

/// The page as one file; pictures of drivers come first, in the order of `drivers`.
pub fn page(report: &Diagnosis, drivers: &[DriverPlot], pictures: &[Picture]) -> String {
    let headline = words::headline(report);
    let files: Vec<String> = report.input.iter().map(words::input).collect();
    let (first, rest) = pictures.split_at(drivers.len().min(pictures.len()));
    let cautions = words::cautions(report);
    // One red line, and only if the result may be due to a mistake in the files.
    let red = cautions.first().filter(|(kind, _)| *kind == "warning");
    let notes = &cautions[usize::from(red.is_some())..];
    let notes_on_files = html! {
        @if !notes.is_empty() {
            div { h2 { "Notes on the files" } ul { @for (_, note) in notes { li { (prose(note)) } } } }
        }
    };
    let main = html! {
        main.diagnosis {
            header {
                p.meta {
                    (files.join(" · ")) " · baseline " (report.baseline.model) " · seed " (report.seed)
                    " · fingerpad " (report.version)
                }
                h1 { (prose(&headline)) }
            }
            p.verdict { (prose(&words::details(report))) }
            @if let Some((_, caution)) = red { p.warning { (prose(caution)) } }
            @if !report.next_step.is_empty() { p { b { "Next: " } (prose(&report.next_step)) } }
            p.meta {
                (prose(&words::confidence(report)))
                @for sentence in repeated::sentences(report) { " " (prose(&sentence)) }
            }
            @for e in &report.effects {
                @let place = drivers.iter().position(|d| d.law == e.law).filter(|i| *i < first.len());
                section.pair {
                    @if let Some(i) = place { (figures(i + 1, &first[i..=i])) }
                    div { (effect(report, e)) }
                }
            }
            (in_pairs(first.len() + 1, rest, &notes_on_files))
            (next(report))
            section.pair { div { (regions(report)) } div { (noise(report)) } }
            @if let Some(found) = &report.power { section.tables { (repeated::power_table(found)) } }
            footer { (basis()) }
        }
    };
    document(&format!("fingerpad diagnose: {headline}"), main)
}

/// Figures numbered from `first` on: those that need the whole width below each other, others side by side where the page is wide. Text
/// follows the last of these.
fn in_pairs(first: usize, pictures: &[Picture], text: &Markup) -> Markup {
    let is_wide = |p: &Picture| matches!(p.name.as_str(), "map_before" | "map_after" | "traces");
    let mut at = first;
    let mut groups = Vec::new();
    for group in pictures.chunk_by(|a, b| !is_wide(a) && !is_wide(b)) {
        groups.push((at, group, group.iter().any(is_wide)));
        at += group.len();
    }
    let last_is_wide = groups.last().is_none_or(|(.., is_wide)| *is_wide);
    html! {
        @for (i, (first, group, is_wide)) in groups.iter().enumerate() {
            @if *is_wide {
                (figures(*first, group))
            } @else {
                section.pair { (figures(*first, group)) @if i + 1 == groups.len() { (text) } }
            }
        }
        @if last_is_wide { (text) }
    }
}

/// How a diagnosis decides.
fn basis() -> Markup {
    html! {
        h2 { "Basis of this result" }
        ol {
            li {
                "The run, not the row, is the statistical unit: gain, offset and touch point of a run are random effects, \
                 their variances are estimated together with the model."
            }
            li {
                "The baseline was calibrated on runs without an effect; its covariance and a stated drift are carried \
                 along. A change of scale alone is never called an effect."
            }
            li {
                "Effects act inside the model (strength, stiffness, depth, reading); a law is claimed only if the \
                 protocol distinguishes it from the others."
            }
            li { "A file of held-out runs is read after the laws are chosen; it may take a name back, and gives none." }
        }
        p { code { "report.json" } " holds every number of this page; every figure is beside it as an SVG file." }
    }
}

/// The page of a diagnosis that has sentences instead of figures; `more` follows the next experiment.
pub fn reduced(report: &Diagnosis, sentences: &[String], pictures: &[Picture], more: &Markup) -> String {
    let files: Vec<String> = report.input.iter().map(words::input).collect();
    let headline = words::headline(report);
    let main = html! {
        main.diagnosis {
            header { p.meta { (files.join(" · ")) " · fingerpad " (report.version) } h1 { (prose(&headline)) } }
            @for (_, caution) in words::cautions(report) { p.warning { (prose(&caution)) } }
            section.pair {
                (figures(1, pictures))
                div {
                    @for sentence in sentences { p { (prose(sentence)) } }
                    @if !report.next_step.is_empty() { p { b { "Next: " } (prose(&report.next_step)) } }
                    @for e in &report.effects { (effect(report, e)) }
                }
            }
            (next(report))
            (more)
        }
    };
    document(&format!("fingerpad diagnose: {headline}"), main)
}

/// An effect: its formula, then with the fitted numbers, their intervals, and its evidence.
fn effect(report: &Diagnosis, e: &EffectFound) -> Markup {
    html! {
        h2 { (words::plain(&e.law)) @if e.family != e.law { " " span.meta { "(" (words::plain(&e.family)) ")" } } }
        @if !e.formula.is_empty() {
            p.formula { @if e.own.is_some() { "A law of your own: " } code { (e.formula) } }
            p.formula { "Fitted: " code { (words::fitted(e)) } }
        }
        (parameters(e))
        @if e.candidates.len() > 1 { (candidates(e)) }
        p.meta {
            "gain " (significant(e.gain_2ll, 3)) " in 2 log likelihood"
            // Without runs there is nothing to be flipped, and no protocol that lets expect a gain.
            @if report.holdout.method.starts_with("none") {
                "; p = " (significant(e.p_model, 2)) " by the model over all laws and shapes"
            } @else {
                " (" (significant(e.lambda_detect, 3)) " expected under this protocol); p = " (significant(e.p, 2)) " decides: "
                (significant(e.p_model, 2)) " by the model over all laws and shapes, " (fixed(e.p_runs, 3)) " by sign flips over runs"
                @if e.against_calibration { " (not a test here: the evidence lies against the calibration)" }
            }
        }
    }
}

fn parameters(effect: &EffectFound) -> Markup {
    let heads = html! { th.name { "parameter" } th { "value" } th { "95 % interval" } th.name { "unit" } };
    let rows = html! {
        @for p in &effect.parameters {
            tr {
                td { (prose(&p.name)) } (cell(significant(p.value, 3)))
                (cell(p.ci95.map(|end| significant(end, 3)).join(" to "))) td { (p.unit) }
            }
        }
    };
    table(heads, rows)
}

fn candidates(effect: &EffectFound) -> Markup {
    let heads = html! { th.name { "candidate" } th.name { "family" } th { "Δ 2LL" } th { "separation λ" } };
    let rows = html! {
        @for c in &effect.candidates {
            tr {
                td { (words::plain(&c.law)) } td { (words::plain(&c.family)) } (cell(fixed(c.delta_2ll, 1)))
                (cell(if c.law == effect.law { "–".into() } else { fixed(c.lambda_rival, 1) }))
            }
        }
    };
    table(heads, rows)
}

fn next(report: &Diagnosis) -> Markup {
    let Some(plan) = &report.next_experiment else { return html! {} };
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| significant(v, 3));
    let flag = |v: Option<bool>| v.map_or("", |v| if v { "yes" } else { "no" }).to_owned();
    let column = |head: &str, of: &dyn Fn(&PlannedRun) -> String| {
        (head.to_owned(), plan.runs.iter().map(of).collect::<Vec<String>>())
    };
    let factor = |f: &Factor| column(&words::axis(f.name, f.unit()), &|r| number(f.value(r)));
    let mut columns: Vec<_> = FACTORS.iter().map(factor).collect();
    columns.push(column("new block", &|r| flag(r.new_block)));
    columns.push(column("reverse", &|r| flag(r.reverse)));
    columns.extend(super::own_columns(plan).iter().map(|name| column(name, &|r| number(r.own.get(*name).copied()))));
    // What no stroke sets has no column.
    columns.retain(|(_, cells)| cells.iter().any(|text| !text.is_empty()));
    let heads = html! { th {} @for (head, _) in &columns { th { (head) } } };
    let strokes = html! {
        @for i in 0..plan.runs.len() { tr { (cell(i + 1)) @for (_, cells) in &columns { (cell(&cells[i])) } } }
    };
    html! {
        h2 { "Next experiment" }
        p {
            "These strokes vary " (words::axis(&plan.factor, "")) "; a blank cell is the reference condition. The same table is in "
            code { "next_experiment.csv" } "."
        }
        (table(heads, strokes))
        @if !plan.prices.is_empty() {
            (captioned_table("Other experiments that would separate them, and their cost.", html! {
                th.name { "varied" } th { "separation λ" } th { "minutes" }
            }, html! {
                @for p in &plan.prices {
                    tr { td { (words::axis(&p.factor, "")) } (cell(fixed(p.lambda_rival_expected, 0))) (cell(fixed(p.minutes, 0))) }
                }
            }))
        }
    }
}

fn regions(report: &Diagnosis) -> Markup {
    let heads = html! {
        th.name { "column" } th.name { "part" } th.name { "force" } th { "mean, %" } th { "z" } th.minor { "runs" }
        th.name.minor { "calibrated" }
    };
    let rows = html! {
        @for r in &report.disagreement.regions {
            tr {
                td { (words::axis(&r.column, "")) }
                td.part { (words::range(r).0) }
                td { (r.channel) } (cell(fixed(100.0 * r.mean_relative, 1))) (cell(fixed(r.z, 1))) td.num.minor { (r.runs) }
                td.minor { (if r.outside_calibration { "no" } else { "yes" }) }
            }
        }
        @if report.disagreement.regions.is_empty() { tr { td colspan="7" { "none" } } }
    };
    html! { h2 { "Regions with large residuals without the effect" } (table(heads, rows)) p.meta { "z: mean over its standard error, over runs." } }
}

fn noise(report: &Diagnosis) -> Markup {
    let (n, baseline) = (&report.noise, &report.baseline);
    let [normal, x, y] = baseline.calibration_misfit.map(|misfit| fixed(misfit, 2));
    let heads = html! { th.name { "freedom" } (heads(&["measured set", "±", "calibration", "±"])) };
    let rows = html! {
        @for p in &baseline.parameters {
            tr {
                td { (words::plain(&p.name)) }
                @for number in [p.value, p.sd, p.calibrated, p.calibrated_sd] { (cell(fixed(number, 3))) }
            }
        }
    };
    html! {
        h2 { "Noise and baseline" }
        p {
            "Row noise " (fixed(1000.0 * n.additive_n, 1)) " mN and " (fixed(100.0 * n.multiplicative, 1)) " % of the force; \
             scatter between runs: stiffness " (fixed(100.0 * n.run_gain_normal, 1)) " %, strength "
            (fixed(100.0 * n.run_gain_friction, 1)) " %, touch point " (fixed(1000.0 * n.depth_zero_mm, 0)) " µm, offsets "
            (fixed(1000.0 * n.run_offset_n, 1)) " mN (from the " (n.source) "). Rescale of the measured finger: stiffness "
            (fixed(baseline.rescale.stiffness, 3)) ", strength " (fixed(baseline.rescale.strength, 3))
            ". Misfit of the baseline on the calibration runs over their noise: normal " (normal) ", x " (x) ", y " (y) "."
        }
        details { summary { "All freedoms of the baseline" } (table(heads, rows)) }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fingerpad_diagnose::{ColumnMap, diagnose_forces, trace_csv};

    use super::*;

    #[test]
    fn a_trace_without_runs_mentions_no_sign_flips() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/human_texture_exploration/July3_1_force_data_1.csv");
        let trace = trace_csv::read(
            Path::new(path),
            &ColumnMap::parse(Some("normal=-Fz,x=Fx,y=Fy,t=Timestamp"), None).unwrap(),
        )
        .unwrap();
        let mut found = diagnose_forces(&trace, 0.01);
        assert!(!reduced(&found.report, &found.sentences, &[], &html! {}).contains("sign flips"));
        found.report.holdout.method = "k-fold by run".into();
        assert!(reduced(&found.report, &found.sentences, &[], &html! {}).contains("sign flips over runs"));
    }
}
