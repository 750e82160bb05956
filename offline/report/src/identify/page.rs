//! The page of an identification: the result first, then figures and tables.

use maud::{Markup, Render, html};

use super::super::Picture;
use super::super::html::{captioned_table, cell, document, figures, heads, prose};
use super::super::numbers::{fixed, significant};
use super::table_figures::percent;
use fingerpad_identify::{
    LawPoint, Outcome, SimplexRun,
    outcome::{Constant, FastOutcome, FingerOutcome, ForceZeroOutcome, LawOutcome, ModelDataComparison, Stage},
    population::Population,
};

fn header(title: &str, meta: impl Render) -> Markup {
    html! { header { h1 { (title) } p.meta { (meta) } } }
}

fn num(v: f64, decimals: usize) -> Markup {
    cell(fixed(v, decimals))
}

fn optional(v: Option<f64>, decimals: usize) -> Markup {
    num(v.unwrap_or(f64::NAN), decimals)
}

fn table(caption: impl Render, names: &[&str], rows: Markup) -> Markup {
    captioned_table(caption, heads(names), rows)
}

/// A constant as text of the first sentence.
fn constant_text(c: &Constant) -> String {
    let unit = if c.unit.is_empty() { String::new() } else { format!(" {}", c.unit) };
    let error = c.standard_error.map_or("no standard error".into(), |e| format!("± {}", significant(e, 2)));
    let interval = match &c.interval {
        None => String::new(),
        Some(i) if i.is_flat() => ", not determined by this table".into(),
        Some(i) => {
            let end = |v: f64, bounded: bool| if bounded { fixed(v, 3) } else { "the search’s bound".to_owned() };
            format!(", interval {} to {}", end(i.low, i.bounded[0]), end(i.high, i.bounded[1]))
        }
    };
    format!("{} {}{unit} ({error}{interval})", c.name, fixed(c.value, 3))
}

fn verdict(o: &Outcome) -> String {
    let worst = |a: &ModelDataComparison| {
        a.rows.iter().map(|r| r.friction_coefficient_difference_percent.abs()).fold(0.0, f64::max)
    };
    match &o.law {
        Some(law) => {
            let constants: Vec<String> = law.constants.iter().map(constant_text).collect();
            format!(
                "{}; λ = {} MPa^(1−β) follows from them. F/N is met within {} % at every row; the published constants \
                 on the same finger miss it by up to {} %.",
                constants.join("; "),
                significant(law.lambda, 3),
                fixed(worst(&law.comparison), 1),
                fixed(worst(&o.published), 1)
            )
        }
        None => format!(
            "Published constants, nothing searched for: F/N differs by up to {} % on the finger as given and {} % on the calibrated one.",
            fixed(worst(&o.published_before), 1),
            fixed(worst(&o.published), 1)
        ),
    }
}

fn compare(title: &str, o: &Outcome, a: &ModelDataComparison) -> Markup {
    let caption = html! {
        (title) ": λ = " (significant(a.lambda, 4)) " MPa" sup { "1−β" } ", β = " (fixed(a.beta, 4)) ", τ₀ = "
        (fixed(1e3 * a.tau0_mpa, 3)) " kPa; sum of squared differences of F/N " (significant(a.sum_of_squares, 3))
    };
    let heads = html! {
        (heads(&["depth, mm", "run at, mm", "N meas., N", "N model", "diff. %", "A meas., mm²", "A model", "diff. %"]))
        (heads(&["F/N meas.", "F/N model", "diff. %"]))
    };
    let rows = html! {
        @for (r, p) in a.rows.iter().zip(&o.table) {
            tr {
                (num(p.depth_mm, 2)) (num(r.model_depth_mm, 3))
                (num(p.normal_force_n, 3)) (num(r.normal_force_n, 3))
                (cell(percent(Some(r.normal_force_difference_percent))))
                (optional(p.contact_area_mm2, 1)) (num(r.contact_area_mm2, 1))
                (cell(percent(r.contact_area_difference_percent)))
                (num(p.friction_coefficient, 3)) (num(r.friction_coefficient, 3))
                (cell(percent(Some(r.friction_coefficient_difference_percent))))
            }
        }
    };
    captioned_table(caption, heads, rows)
}

fn finger(title: &str, fit: &FingerOutcome) -> Markup {
    let caption = format!(
        "{title}: root mean square of the weighted residuals {} (before {}); {} evaluations, {}",
        fixed(fit.rms, 2),
        fixed(fit.rms_before, 2),
        fit.evaluations,
        fit.ended
    );
    let rows = html! {
        @for f in &fit.fitted {
            tr {
                td { (f.name) } (num(f.start, 3)) (num(f.value, 4)) (optional(f.standard_error, 4)) td { (f.unit) }
                td { @if f.at_bound { "at its bound" } }
            }
        }
    };
    table(caption, &["", "before", "value", "standard error", "unit", ""], rows)
}

/// The page as one file.
pub fn page(o: &Outcome, pictures: &[Picture]) -> String {
    let p = &o.provenance;
    let title = "From a measured table to the friction law";
    let meta = html! {
        (p.table) " · shape " (p.shape) " (" (p.bones) " bones) · mesh " (p.mesh_preset) ", " (p.nodes) " nodes"
        " · fingerpad " (p.program_version) " · settings " (p.settings_hash)
    };
    let main = html! {
        main {
            (header(title, meta))
            p.verdict { (prose(&verdict(o))) }
            (figures(1, pictures))
            section.tables {
                h2 { "Against the table" }
                @if let Some(law) = &o.law { (compare("Identified law", o, &law.comparison)) }
                @if let Some(joint) = &o.joint { (compare("Joint fit", o, &joint.comparison)) }
                @if o.calibration.is_some() { (compare("Published constants, finger calibrated", o, &o.published)) }
                (compare("Published constants, finger as given", o, &o.published_before))
                h2 { "The finger" }
                @if let Some(fit) = &o.calibration { (finger("Calibration on normal force and area", fit)) }
                @if let Some(joint) = &o.joint { (finger("Joint fit of finger, depths and law", joint)) }
                @if let Some(law) = &o.law { (law_tables(o, law)) }
                (prediction_tables(o))
                (stage_table(o))
            }
        }
    };
    document(&format!("fingerpad: {title}"), main)
}

/// The identified law: constants, remarks, and the searches that found it.
fn law_tables(o: &Outcome, law: &LawOutcome) -> Markup {
    let checks: Vec<String> =
        law.region_check_percent.iter().map(|c| c.map_or("no slide".into(), |c| fixed(c, 2))).collect();
    let correlation = law.correlation_of_lambda.map_or("not determined".into(), |r| fixed(r, 4));
    html! {
        h2 { "The law and how sure it is" }
        (constants_table(law))
        p {
            "λ = " (significant(law.lambda, 4)) " MPa" sup { "1−β" } " is derived; its correlation with β is " (correlation)
            ", that of ln strength with β " (fixed(law.correlation, 3)) ". Region and intervals are drawn by a surrogate that \
             is corrected to the finite elements at and around the best law; at the intervals’ ends its F/N differs from \
             finite elements by " (checks.join(", ")) " %. Below " (significant(1e3 * law.regularisation.pressure_mpa, 2))
            " kPa the power is replaced by a parabola through the origin; with " (law.regularisation.effect()) "."
        }
        @for remark in &law.remarks { p { (prose(remark)) } }
        @if let Some(tau0) = &o.tau0 { p { (prose(&tau0.sentence)) } }
        @if let Some(zero) = &o.force_zero { (force_zero_table(zero)) }
        @if !o.simplex.is_empty() { (simplex_table(&o.simplex)) }
        @if let Some(fast) = &o.fast { (fast_route_table(fast)) }
        @if let (Some(run), Some([strength, beta])) = (&o.refined, o.routes_differ) {
            p {
                "Continued from its best end in ln strength and β to tolerances of 1e-6, the simplex differs from the fast \
                 route by " (significant(strength, 2)) " of the strength at 5 kPa and by " (significant(beta, 2)) " in β, after "
                (run.visits.len()) " evaluations; its sum of squares is " (significant(run.sum_of_squares, 5)) "."
            }
        }
    }
}

/// Constants of the law with their intervals.
fn constants_table(law: &LawOutcome) -> Markup {
    let rows = html! {
        @for c in &law.constants {
            @let (low, high) = c.interval.as_ref().map_or((f64::NAN, f64::NAN), |i| (i.low, i.high));
            @let open = match c.interval.as_ref().map_or([true; 2], |i| i.bounded) {
                [true, true] => "",
                [false, false] => "both ends are the search’s bounds: flat",
                [false, true] => "lower end is the search’s bound",
                [true, false] => "upper end is the search’s bound",
            };
            tr {
                td { (c.name) } (num(c.value, 4)) (optional(c.standard_error, 4)) (num(low, 4)) (num(high, 4))
                td { (c.unit) } td { (open) }
            }
        }
    };
    let errors = if law.error_is_known { "errors as given" } else { "errors from the misfit" };
    let caption = format!("{:.0} % intervals by profile likelihood, {errors}", 100.0 * law.confidence);
    table(caption, &["", "value", "standard error", "from", "to", "unit", ""], rows)
}

/// The exponent over the assumed zero of the normal force.
fn force_zero_table(zero: &ForceZeroOutcome) -> Markup {
    let rows = html! {
        @for p in &zero.points {
            tr {
                (num(1e3 * p.normal_force_offset_n, 1)) (cell(significant(p.lambda, 3))) (num(p.beta, 3))
                (num(p.stiffness, 3)) (num(p.depth_offset_mm, 3)) (num(p.rms_percent, 1))
            }
        }
    };
    let heads = ["zero, mN", "λ", "β", "stiffness", "depth offset, mm", "all numbers, %"];
    html! { (table("β against the zero of the normal force", &heads, rows)) p { (prose(&zero.sentence)) } }
}

/// The search of the paper.
fn simplex_table(runs: &[SimplexRun]) -> Markup {
    let rows = html! {
        @for r in runs {
            tr {
                (num(r.start[0], 4)) (num(r.start[1], 3)) (cell(significant(r.end[0], 5))) (num(r.end[1], 5))
                (cell(significant(r.sum_of_squares, 4))) (cell(r.visits.len())) (cell(r.turned_back)) td { (r.stopped) }
            }
        }
    };
    let heads = ["start λ", "start β", "end λ", "end β", "sum of squares", "evaluations", "turned back", "stopped by"];
    table("The paper’s search: downhill simplex on λ and β", &heads, rows)
}

/// The searches of the fast route.
fn fast_route_table(fast: &FastOutcome) -> Markup {
    let step = |name: &str, law: &LawPoint, sum_of_squares: f64| {
        html! {
            tr { td { (name) } (num(law.tau_ref_kpa, 5)) (num(law.beta, 5)) (cell(significant(sum_of_squares, 5))) }
        }
    };
    let newton = format!("Gauss–Newton, {} evaluations", fast.gauss_newton_evaluations);
    let direct = format!("direct search, {} evaluations", fast.direct_evaluations);
    let rows = html! {
        @for m in &fast.mappings { (step("space mapping", &m.law, m.sum_of_squares)) }
        (step(&newton, &fast.gauss_newton.law, fast.gauss_newton.sum_of_squares))
        @if fast.direct_evaluations > 0 { (step(&direct, &fast.law, fast.sum_of_squares)) }
    };
    table("The fast route", &["", "strength at 5 kPa, kPa", "β", "sum of squares"], rows)
}

fn prediction_tables(o: &Outcome) -> Markup {
    html! {
        @if !o.left_out.is_empty() { h2 { "Predictions" } (left_out_table(o)) }
        @if !o.checks.is_empty() {
            (table("Published findings that were not fitted", &["", "model", "published", "source", "conditions"], html! {
                @for c in &o.checks {
                    tr { td { (c.finding) } (num(c.ours, 3)) (num(c.published, 3)) td { (c.source) } td { (c.conditions) } }
                }
            }))
        }
        @if let Some(curve) = &o.curve {
            @for (side, end) in ["Downwards", "Upwards"].iter().zip(&curve.ends) {
                p { (side) " the curve ends: " (end) "." }
            }
        }
        @if !o.sensitivities.is_empty() { (sensitivity_table(o)) }
    }
}

/// Each depth predicted from the others.
fn left_out_table(o: &Outcome) -> Markup {
    let heads = html! {
        (heads(&["left out, mm", "N, N", "F/N measured", "at its depth", "%", "at its N", "%"]))
        th { "c N" sup { "2/3" } } th { "%" } th { "c N" sup { "n" } } th { "%" }
    };
    let rows = html! {
        @for l in &o.left_out {
            tr {
                (num(l.depth_mm, 2)) (num(l.normal_force_n, 3)) (num(l.measured, 3))
                @for (v, d) in l.predicted.into_iter().zip(l.differences_percent) { (optional(v, 3)) (cell(percent(d))) }
            }
        }
    };
    captioned_table("One depth left out, law or power fitted to the others, F/N predicted", heads, rows)
}

fn sensitivity_table(o: &Outcome) -> Markup {
    let heads = html! {
        (heads(&["input", "change", "depth, mm", "N: less, %", "more, %", "A: less, %", "more, %"]))
        (heads(&["F/N: less, %", "more, %"]))
    };
    let rows = html! {
        @for s in &o.sensitivities {
            @let all = [s.normal_force_percent, s.contact_area_percent, s.friction_coefficient_percent];
            tr {
                td { (s.input) } td { "±" (significant(s.change[1], 2)) " " (s.unit) } (num(s.depth_mm, 2))
                @for v in all.into_iter().flatten() { (cell(percent(v))) }
            }
        }
    };
    captioned_table("Sensitivities of the steady slide", heads, rows)
}

fn stage_table(o: &Outcome) -> Markup {
    let sum = |of: fn(&Stage) -> f64| o.stages.iter().map(of).sum::<f64>();
    let rows = html! {
        @for s in &o.stages {
            @let e = &s.effort;
            tr {
                td { (s.name) } (num(s.wall_s, 1)) (num(s.cpu_s, 1)) (cell(s.states)) (cell(e.solves)) (cell(e.cutbacks))
                (cell(e.iterations)) (cell(e.factorisations))
            }
        }
        tr { td { "all" } (num(sum(|s| s.wall_s), 1)) (num(sum(|s| s.cpu_s), 1)) }
    };
    let heads = ["", "wall, s", "CPU, s", "states", "equilibria", "cut back", "iterations", "factorisations"];
    let caption = format!("Times; largest penetration of any steady state {} µm", fixed(1e3 * o.penetration_mm, 2));
    html! { h2 { "Cost" } (table(caption, &heads, rows)) }
}

/// The page of a population.
pub fn population(p: &Population, pictures: &[Picture]) -> String {
    let title = "Several subjects";
    let published = p.subjects.iter().filter(|s| !s.law_searched).count();
    let main = html! {
        main {
            (header(title, format!("{} subjects", p.subjects.len())))
            (figures(1, pictures))
            section.tables {
                h2 { "How the constants vary" }
                (spread_table(p))
                @if published > 0 {
                    p { (published) " of " (p.subjects.len()) " subjects have the published law, none was searched for." }
                }
                p { (prose(&p.correlation_statement())) "." }
                @if !p.missing.is_empty() { p.fail { "Without a result: " (p.missing.join(", ")) "." } }
                (subject_table(p))
            }
        }
    };
    document(&format!("fingerpad: {title}"), main)
}

fn spread_table(p: &Population) -> Markup {
    let rows = html! {
        @for s in &p.spreads {
            tr {
                td { (s.name) } (num(s.mean, 4)) (optional(s.deviation, 4)) (optional(s.between_subjects, 4))
                (num(s.least, 4)) (num(s.median, 4)) (num(s.most, 4))
            }
        }
    };
    let heads = ["", "mean", "standard deviation", "of it between subjects", "least", "median", "largest"];
    table("Between subjects: spread without the fits’ own errors", &heads, rows)
}

fn subject_table(p: &Population) -> Markup {
    let rows = html! {
        @for s in &p.subjects {
            tr {
                td { (s.name) } (num(s.tau_ref_kpa, 3)) (optional(s.tau_ref_error_kpa, 3)) (num(s.beta, 3))
                (optional(s.beta_error, 3)) (cell(significant(s.lambda, 3))) (num(s.stiffness, 3))
                (num(s.depth_offset_mm, 3)) (num(s.worst_friction_percent, 1)) (num(s.worst_normal_force_percent, 1))
            }
        }
    };
    let heads =
        ["subject", "τ(5 kPa), kPa", "±", "β", "±", "λ", "stiffness", "offset, mm", "worst F/N, %", "worst N, %"];
    table("Subjects", &heads, rows)
}
