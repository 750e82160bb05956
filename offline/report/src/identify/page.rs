//! The page of an identification: the result first, then figures and tables.

use std::fmt::Write as _;

use super::super::html::{Picture, STYLE, cell, escape, figure, fonts, prose};
use super::super::numbers::{fixed, significant};
use super::table_figures::percent;
use fingerpad_identify::{
    Outcome, SimplexRun,
    outcome::{Constant, FastOutcome, FingerOutcome, ForceZeroOutcome, LawOutcome, ModelDataComparison},
    population::Population,
};

fn head(title: &str, meta: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>fingerpad: {title}</title>\n\
         <style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n<p class=\"meta\">{meta}</p>\n</header>\n",
        fonts()
    )
}

fn row(cells: impl IntoIterator<Item = String>) -> String {
    format!("<tr>{}</tr>\n", cells.into_iter().collect::<String>())
}

fn name(text: &str) -> String {
    format!("<td>{}</td>", escape(text))
}

fn num(v: f64, decimals: usize) -> String {
    cell(&fixed(v, decimals))
}

fn optional(v: Option<f64>, decimals: usize) -> String {
    num(v.unwrap_or(f64::NAN), decimals)
}

fn table(caption: &str, heads: &[&str], body: String) -> String {
    let heads: String = heads.iter().map(|h| format!("<th>{h}</th>")).collect();
    format!(
        "<table>\n<caption>{caption}</caption>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"
    )
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

fn compare(title: &str, o: &Outcome, a: &ModelDataComparison) -> String {
    let caption = format!(
        "{title}: λ = {} MPa<sup>1−β</sup>, β = {}, τ₀ = {} kPa; sum of squared differences of F/N {}",
        significant(a.lambda, 4),
        fixed(a.beta, 4),
        fixed(1e3 * a.tau0_mpa, 3),
        significant(a.sum_of_squares, 3)
    );
    let heads = [
        "depth, mm",
        "run at, mm",
        "N meas., N",
        "N model",
        "diff. %",
        "A meas., mm²",
        "A model",
        "diff. %",
        "F/N meas.",
        "F/N model",
        "diff. %",
    ];
    let body = a
        .rows
        .iter()
        .zip(&o.table)
        .map(|(r, p)| {
            row([
                num(p.depth_mm, 2),
                num(r.model_depth_mm, 3),
                num(p.normal_force_n, 3),
                num(r.normal_force_n, 3),
                cell(&percent(Some(r.normal_force_difference_percent))),
                optional(p.contact_area_mm2, 1),
                num(r.contact_area_mm2, 1),
                cell(&percent(r.contact_area_difference_percent)),
                num(p.friction_coefficient, 3),
                num(r.friction_coefficient, 3),
                cell(&percent(Some(r.friction_coefficient_difference_percent))),
            ])
        })
        .collect();
    table(&caption, &heads, body)
}

fn finger(title: &str, fit: &FingerOutcome) -> String {
    let caption = format!(
        "{title}: root mean square of the weighted residuals {} (before {}); {} evaluations, {}",
        fixed(fit.rms, 2),
        fixed(fit.rms_before, 2),
        fit.evaluations,
        escape(&fit.ended)
    );
    let body = fit
        .fitted
        .iter()
        .map(|f| {
            row([
                name(&f.name),
                num(f.start, 3),
                num(f.value, 4),
                optional(f.standard_error, 4),
                format!("<td>{}</td>", escape(&f.unit)),
                name(if f.at_bound { "at its bound" } else { "" }),
            ])
        })
        .collect();
    table(&caption, &["", "before", "value", "standard error", "unit", ""], body)
}

/// The page as one file.
pub fn page(o: &Outcome, pictures: &[Picture]) -> String {
    let p = &o.provenance;
    let meta = format!(
        "{} · shape {} ({} bones) · mesh {}, {} nodes · fingerpad {} · settings {}",
        escape(&p.table),
        escape(&p.shape),
        escape(&p.bones),
        escape(&p.mesh_preset),
        p.nodes,
        escape(&p.program_version),
        escape(&p.settings_hash)
    );
    let mut out = head("From a measured table to the friction law", &meta);
    let _ = writeln!(out, "<p class=\"verdict\">{}</p>", prose(&verdict(o)));
    for (i, picture) in pictures.iter().enumerate() {
        figure(&mut out, i + 1, picture);
    }
    out += "<section class=\"tables\">\n<h2>Against the table</h2>\n";
    if let Some(law) = &o.law {
        out += &compare("Identified law", o, &law.comparison);
    }
    if let Some(joint) = &o.joint {
        out += &compare("Joint fit", o, &joint.comparison);
    }
    if o.calibration.is_some() {
        out += &compare("Published constants, finger calibrated", o, &o.published);
    }
    out += &compare("Published constants, finger as given", o, &o.published_before);
    out += "<h2>The finger</h2>\n";
    if let Some(calibration) = &o.calibration {
        out += &finger("Calibration on normal force and area", calibration);
    }
    if let Some(joint) = &o.joint {
        out += &finger("Joint fit of finger, depths and law", joint);
    }
    out += &law_tables(o);
    out += &prediction_tables(o);
    out += &stage_table(o);
    out + "</section>\n</main>\n</body>\n</html>\n"
}

/// The identified law: constants, remarks, and the searches that found it.
fn law_tables(o: &Outcome) -> String {
    let mut out = String::new();
    let Some(law) = &o.law else { return out };
    out += "<h2>The law and how sure it is</h2>\n";
    out += &constants_table(law);
    let checks: Vec<String> =
        law.region_check_percent.iter().map(|c| c.map_or("no slide".into(), |c| fixed(c, 2))).collect();
    let _ = writeln!(
        out,
        "<p>λ = {} MPa<sup>1−β</sup> is derived; its correlation with β is {}, that of ln strength with β {}. Region and \
         intervals are drawn by a surrogate that is corrected to the finite elements at and around the best law; at the \
         intervals’ ends its F/N differs from finite elements by {} %. Below {} kPa the power is replaced by a \
         parabola through the origin; with {}.</p>",
        significant(law.lambda, 4),
        law.correlation_of_lambda.map_or("not determined".into(), |r| fixed(r, 4)),
        fixed(law.correlation, 3),
        checks.join(", "),
        significant(1e3 * law.regularisation.pressure_mpa, 2),
        law.regularisation.effect()
    );
    for remark in law.remarks.iter().map(String::as_str).chain(o.tau0.as_ref().map(|t| t.sentence.as_str())) {
        let _ = writeln!(out, "<p>{}</p>", prose(remark));
    }
    if let Some(zero) = &o.force_zero {
        out += &force_zero_table(zero);
    }
    if !o.simplex.is_empty() {
        out += &simplex_table(&o.simplex);
    }
    if let Some(fast) = &o.fast {
        out += &fast_route_table(fast);
    }
    if let (Some(run), Some([strength, beta])) = (&o.refined, o.routes_differ) {
        let _ = writeln!(
            out,
            "<p>Continued from its best end in ln strength and β to tolerances of 1e-6, the simplex differs from the fast \
             route by {} of the strength at 5 kPa and by {} in β, after {} evaluations; its sum of squares is {}.</p>",
            significant(strength, 2),
            significant(beta, 2),
            run.visits.len(),
            significant(run.sum_of_squares, 5)
        );
    }
    out
}

/// Constants of the law with their intervals.
fn constants_table(law: &LawOutcome) -> String {
    let body = law
        .constants
        .iter()
        .map(|c| {
            let (low, high) = c.interval.as_ref().map_or((f64::NAN, f64::NAN), |i| (i.low, i.high));
            let open = c.interval.as_ref().map_or("", |i| match i.bounded {
                [true, true] => "",
                [false, false] => "both ends are the search’s bounds: flat",
                [false, true] => "lower end is the search’s bound",
                [true, false] => "upper end is the search’s bound",
            });
            row([
                name(&c.name),
                num(c.value, 4),
                optional(c.standard_error, 4),
                num(low, 4),
                num(high, 4),
                format!("<td>{}</td>", escape(&c.unit)),
                name(open),
            ])
        })
        .collect();
    let errors = if law.error_is_known { "errors as given" } else { "errors from the misfit" };
    let caption = format!("{:.0} % intervals by profile likelihood, {errors}", 100.0 * law.confidence);
    table(&caption, &["", "value", "standard error", "from", "to", "unit", ""], body)
}

/// The exponent over the assumed zero of the normal force.
fn force_zero_table(zero: &ForceZeroOutcome) -> String {
    let body = (zero.points.iter())
        .map(|p| {
            row([
                num(1e3 * p.normal_force_offset_n, 1),
                cell(&significant(p.lambda, 3)),
                num(p.beta, 3),
                num(p.stiffness, 3),
                num(p.depth_offset_mm, 3),
                num(p.rms_percent, 1),
            ])
        })
        .collect();
    let heads = ["zero, mN", "λ", "β", "stiffness", "depth offset, mm", "all numbers, %"];
    let mut out = table("β against the zero of the normal force", &heads, body);
    let _ = writeln!(out, "<p>{}</p>", prose(&zero.sentence));
    out
}

/// The search of the paper.
fn simplex_table(runs: &[SimplexRun]) -> String {
    let body = runs
        .iter()
        .map(|r| {
            row([
                num(r.start[0], 4),
                num(r.start[1], 3),
                cell(&significant(r.end[0], 5)),
                num(r.end[1], 5),
                cell(&significant(r.sum_of_squares, 4)),
                cell(&r.visits.len().to_string()),
                cell(&r.turned_back.to_string()),
                name(&r.stopped),
            ])
        })
        .collect();
    let heads = ["start λ", "start β", "end λ", "end β", "sum of squares", "evaluations", "turned back", "stopped by"];
    table("The paper’s search: downhill simplex on λ and β", &heads, body)
}

/// The searches of the fast route.
fn fast_route_table(fast: &FastOutcome) -> String {
    let mut body: String = fast
        .mappings
        .iter()
        .map(|m| {
            row([
                name("space mapping"),
                num(m.law.tau_ref_kpa, 5),
                num(m.law.beta, 5),
                cell(&significant(m.sum_of_squares, 5)),
            ])
        })
        .collect();
    body += &row([
        name(&format!("Gauss–Newton, {} evaluations", fast.gauss_newton_evaluations)),
        num(fast.gauss_newton.law.tau_ref_kpa, 5),
        num(fast.gauss_newton.law.beta, 5),
        cell(&significant(fast.gauss_newton.sum_of_squares, 5)),
    ]);
    if fast.direct_evaluations > 0 {
        body += &row([
            name(&format!("direct search, {} evaluations", fast.direct_evaluations)),
            num(fast.law.tau_ref_kpa, 5),
            num(fast.law.beta, 5),
            cell(&significant(fast.sum_of_squares, 5)),
        ]);
    }
    table("The fast route", &["", "strength at 5 kPa, kPa", "β", "sum of squares"], body)
}

fn prediction_tables(o: &Outcome) -> String {
    let mut out = String::new();
    if !o.left_out.is_empty() {
        out += "<h2>Predictions</h2>\n";
        let heads = [
            "left out, mm",
            "N, N",
            "F/N measured",
            "at its depth",
            "%",
            "at its N",
            "%",
            "c N<sup>2/3</sup>",
            "%",
            "c N<sup>n</sup>",
            "%",
        ];
        let body = o
            .left_out
            .iter()
            .map(|l| {
                let pairs = l.predicted.into_iter().zip(l.differences_percent);
                let pairs = pairs.flat_map(|(v, d)| [optional(v, 3), cell(&percent(d))]);
                row([num(l.depth_mm, 2), num(l.normal_force_n, 3), num(l.measured, 3)].into_iter().chain(pairs))
            })
            .collect();
        out += &table("One depth left out, law or power fitted to the others, F/N predicted", &heads, body);
    }
    if !o.checks.is_empty() {
        let body = o
            .checks
            .iter()
            .map(|c| row([name(&c.finding), num(c.ours, 3), num(c.published, 3), name(&c.source), name(&c.conditions)]))
            .collect();
        out += &table(
            "Published findings that were not fitted",
            &["", "model", "published", "source", "conditions"],
            body,
        );
    }
    if let Some(curve) = &o.curve {
        let sides = ["Downwards", "Upwards"];
        for (side, end) in sides.iter().zip(&curve.ends) {
            let _ = writeln!(out, "<p>{side} the curve ends: {}.</p>", escape(end));
        }
    }
    if !o.sensitivities.is_empty() {
        let heads = [
            "input",
            "change",
            "depth, mm",
            "N: less, %",
            "more, %",
            "A: less, %",
            "more, %",
            "F/N: less, %",
            "more, %",
        ];
        let body = o
            .sensitivities
            .iter()
            .map(|s| {
                let change = format!("±{} {}", significant(s.change[1], 2), s.unit);
                let all = [s.normal_force_percent, s.contact_area_percent, s.friction_coefficient_percent];
                let values = all.into_iter().flatten().map(|v| cell(&percent(v)));
                row([name(&s.input), name(&change), num(s.depth_mm, 2)].into_iter().chain(values))
            })
            .collect();
        out += &table("Sensitivities of the steady slide", &heads, body);
    }
    out
}

fn stage_table(o: &Outcome) -> String {
    let line = |n: &str, wall: f64, cpu: f64, states: u32, e: [u32; 4]| {
        let counts = std::iter::once(states).chain(e).map(|v| cell(&v.to_string()));
        row([name(n), num(wall, 1), num(cpu, 1)].into_iter().chain(counts))
    };
    let mut body: String = o
        .stages
        .iter()
        .map(|s| {
            let e = &s.effort;
            line(&s.name, s.wall_s, s.cpu_s, s.states, [e.solves, e.cutbacks, e.iterations, e.factorisations])
        })
        .collect();
    let sum = |of: fn(&fingerpad_identify::outcome::Stage) -> f64| o.stages.iter().map(of).sum::<f64>();
    body += &row([name("all"), num(sum(|s| s.wall_s), 1), num(sum(|s| s.cpu_s), 1)]);
    let heads = ["", "wall, s", "CPU, s", "states", "equilibria", "cut back", "iterations", "factorisations"];
    let caption = format!("Times; largest penetration of any steady state {} µm", fixed(1e3 * o.penetration_mm, 2));
    format!("<h2>Cost</h2>\n{}", table(&caption, &heads, body))
}

/// The page of a population.
pub fn population(p: &Population, pictures: &[Picture]) -> String {
    let mut out = head("Several subjects", &format!("{} subjects", p.subjects.len()));
    for (i, picture) in pictures.iter().enumerate() {
        figure(&mut out, i + 1, picture);
    }
    let body = p
        .spreads
        .iter()
        .map(|s| {
            row([
                name(&s.name),
                num(s.mean, 4),
                optional(s.deviation, 4),
                optional(s.between_subjects, 4),
                num(s.least, 4),
                num(s.median, 4),
                num(s.most, 4),
            ])
        })
        .collect();
    out += "<section class=\"tables\">\n<h2>How the constants vary</h2>\n";
    let heads = ["", "mean", "standard deviation", "of it between subjects", "least", "median", "largest"];
    out += &table("Between subjects: spread without the fits’ own errors", &heads, body);
    let published = p.subjects.iter().filter(|s| !s.law_searched).count();
    if published > 0 {
        let _ = writeln!(
            out,
            "<p>{published} of {} subjects have the published law, none was searched for.</p>",
            p.subjects.len()
        );
    }
    let _ = writeln!(out, "<p>{}.</p>", prose(&p.correlation_statement()));
    if !p.missing.is_empty() {
        let _ = writeln!(out, "<p class=\"fail\">Without a result: {}.</p>", escape(&p.missing.join(", ")));
    }
    let body = p
        .subjects
        .iter()
        .map(|s| {
            row([
                name(&s.name),
                num(s.tau_ref_kpa, 3),
                optional(s.tau_ref_error_kpa, 3),
                num(s.beta, 3),
                optional(s.beta_error, 3),
                cell(&significant(s.lambda, 3)),
                num(s.stiffness, 3),
                num(s.depth_offset_mm, 3),
                num(s.worst_friction_percent, 1),
                num(s.worst_normal_force_percent, 1),
            ])
        })
        .collect();
    let heads =
        ["subject", "τ(5 kPa), kPa", "±", "β", "±", "λ", "stiffness", "offset, mm", "worst F/N, %", "worst N, %"];
    out += &table("Subjects", &heads, body);
    out + "</section>\n</main>\n</body>\n</html>\n"
}
