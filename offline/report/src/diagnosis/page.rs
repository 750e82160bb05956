//! The page of a diagnosis: the verdict first, then its evidence, then the next experiment.

use std::fmt::Write as _;

use super::words;
use crate::html::{Picture, STYLE, cell, escape, figure, fonts, prose};
use crate::numbers::{fixed, significant};
use fingerpad_diagnose::Diagnosis;

/// The page as one file.
pub fn page(report: &Diagnosis, pictures: &[Picture]) -> String {
    let title = escape(&words::title(report));
    let files: Vec<String> = report.input.iter().map(words::input).collect();
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>fingerpad diagnose: {title}</title>\n<style>\n{STYLE}{}</style>\n\
         </head>\n<body>\n<main class=\"diagnosis\">\n<header>\n<h1>{title}</h1>\n<p class=\"meta\">{} · baseline {} · seed {} · fingerpad {}</p>\n</header>\n\
         <p class=\"number\">{}</p>\n<p class=\"verdict\">{}</p>\n",
        fonts(),
        escape(&files.join(" · ")),
        escape(&report.baseline.model),
        report.seed,
        escape(&report.version),
        prose(&words::number(report)),
        prose(&words::verdict(report)),
    );
    let (first, rest) = pictures.split_at(pictures.len().min(1));
    let cautions = words::cautions(report);
    // One red line, and only if the result may be due to a mistake in the files.
    let red = cautions.first().filter(|(kind, _)| *kind == "warning");
    if let Some((_, caution)) = red {
        let _ = writeln!(out, "<p class=\"warning\">{}</p>", prose(caution));
    }
    first.iter().for_each(|picture| figure(&mut out, 1, picture));
    out += &effects(report);
    let notes = &cautions[usize::from(red.is_some())..];
    if !notes.is_empty() {
        out += "<h2>Notes on the files</h2>\n<ul>\n";
        for (_, note) in notes {
            let _ = writeln!(out, "<li>{}</li>", prose(note));
        }
        out += "</ul>\n";
    }
    out += "<section>\n";
    for (i, picture) in rest.iter().enumerate() {
        figure(&mut out, i + 2, picture);
    }
    out += "</section>\n";
    out += &next(report);
    out += &tables(report);
    out += "<footer>\n<h2>Basis of this result</h2>\n<ol>\n\
            <li>The run, not the row, is the statistical unit: gain, offset and touch point of a run are random effects, \
            their variances are estimated together with the model.</li>\n\
            <li>The baseline was calibrated on runs without an effect; its covariance and a stated drift are carried \
            along. A change of scale alone is never called an effect.</li>\n\
            <li>Effects act inside the model (strength, stiffness, depth, reading); a law is claimed only if the \
            protocol distinguishes it from the others.</li>\n\
            <li>Held-out runs were read after the verdict.</li>\n</ol>\n\
            <p><code>report.json</code> holds every number of this page; every figure is beside it as a PNG file.</p>\n\
            </footer>\n</main>\n</body>\n</html>\n";
    out
}

/// The page of a diagnosis that has sentences instead of figures.
pub fn reduced(report: &Diagnosis, sentences: &[String], picture: Option<&Picture>) -> String {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>fingerpad diagnose</title>\n<style>\n{STYLE}{}</style>\n\
         </head>\n<body>\n<main>\n<h1>Verdict: {}</h1>\n",
        fonts(),
        words::word(report)
    );
    for (_, caution) in words::cautions(report) {
        let _ = writeln!(out, "<p class=\"warning\">{}</p>", prose(&caution));
    }
    for sentence in sentences {
        let _ = writeln!(out, "<p>{}</p>", prose(sentence));
    }
    out += &effects(report);
    if let Some(picture) = picture {
        figure(&mut out, 1, picture);
    }
    out + &next(report) + "</main>\n</body>\n</html>\n"
}

fn effects(report: &Diagnosis) -> String {
    let mut out = String::new();
    for e in &report.effects {
        let _ = write!(
            out,
            "<h2>{} <span class=\"meta\">({})</span></h2>\n{}<div class=\"side\">\n<table>\n<thead><tr><th class=\"name\">parameter</th>\
             <th>value</th><th>95 % interval</th><th class=\"name\">unit</th></tr></thead>\n<tbody>\n",
            escape(&words::plain(&e.law)),
            escape(&words::plain(&e.family)),
            e.own.as_ref().map_or_else(String::new, |own| {
                format!("<p class=\"formula\">A law of your own: <code>{}</code></p>\n", escape(&words::formula(own)))
            })
        );
        for p in &e.parameters {
            let _ = writeln!(
                out,
                "<tr><td>{}</td>{}{}<td>{}</td></tr>",
                escape(&p.name),
                cell(&significant(p.value, 4)),
                cell(&format!("{} to {}", significant(p.ci95[0], 3), significant(p.ci95[1], 3))),
                escape(&p.unit)
            );
        }
        out += "</tbody>\n</table>\n<table>\n<thead><tr><th class=\"name\">candidate</th><th class=\"name\">family</th>\
                <th>Δ 2LL</th><th>separation λ</th></tr></thead>\n<tbody>\n";
        for c in &e.candidates {
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td>{}{}</tr>",
                escape(&words::plain(&c.law)),
                escape(&words::plain(&c.family)),
                cell(&fixed(c.delta_2ll, 1)),
                cell(&if c.law == e.law { "–".into() } else { fixed(c.lambda_rival, 1) })
            );
        }
        let _ = write!(
            out,
            "</tbody>\n</table>\n</div>\n<p class=\"meta\">gain {} in 2 log likelihood ({} expected under this protocol); \
             p = {:.1e} by the model over all laws and shapes{}{}</p>\n",
            fixed(e.gain_2ll, 1),
            fixed(e.lambda_detect, 1),
            e.p_model,
            sign_flips(report, e.p_runs),
            if e.against_calibration { " (not a test here: the evidence lies against the calibration)" } else { "" }
        );
    }
    out
}

/// The p of the sign flips, if there are runs to be flipped.
fn sign_flips(report: &Diagnosis, p_runs: f64) -> String {
    if report.holdout.method.starts_with("none") {
        return String::new();
    }
    format!(", {} by sign flips over runs", fixed(p_runs, 3))
}

fn next(report: &Diagnosis) -> String {
    let Some(plan) = &report.next_experiment else { return String::new() };
    let mut out = format!(
        "<h2>Next experiment</h2>\n<p>These strokes vary {}; a blank cell is the reference condition. The same table is in \
         <code>next_experiment.csv</code>.</p>\n<table>\n<thead><tr>",
        escape(&plan.factor)
    );
    for head in [
        "",
        "depth, mm",
        "speed, mm/s",
        "direction, °",
        "hold, s",
        "moisture, a.u.",
        "temperature, °C",
        "length, mm",
        "rest before, s",
        "new block",
        "reverse",
    ] {
        let _ = write!(out, "<th>{head}</th>");
    }
    let own = super::own_columns(plan);
    own.iter().for_each(|name| out += &format!("<th>{}</th>", escape(name)));
    out += "</tr></thead>\n<tbody>\n";
    let number = |v: Option<f64>| cell(&v.map_or_else(String::new, |v| v.to_string()));
    let flag = |v: Option<bool>| {
        cell(match v {
            Some(true) => "yes",
            Some(false) => "no",
            None => "",
        })
    };
    for (i, r) in plan.runs.iter().enumerate() {
        out += "<tr>";
        out += &cell(&(i + 1).to_string());
        for v in [
            r.depth_mm,
            r.speed_mm_s,
            r.direction_deg,
            r.dwell_s,
            r.hydration_au,
            r.temperature_c,
            r.length_mm,
            r.rest_before_s,
        ] {
            out += &number(v);
        }
        out += &(flag(r.new_block) + &flag(r.reverse));
        own.iter().for_each(|name| out += &number(r.own.get(*name).copied()));
        out += "</tr>\n";
    }
    out += "</tbody>\n</table>\n";
    if !plan.prices.is_empty() {
        out += "<table>\n<caption>Other experiments that would separate them, and their cost.</caption>\n<thead><tr>\
                <th class=\"name\">varied</th><th>separation λ</th><th>minutes</th></tr></thead>\n<tbody>\n";
        for p in &plan.prices {
            let _ = writeln!(
                out,
                "<tr><td>{}</td>{}{}</tr>",
                escape(&p.factor),
                cell(&fixed(p.lambda_rival_expected, 0)),
                cell(&fixed(p.minutes, 0))
            );
        }
        out += "</tbody>\n</table>\n";
    }
    out
}

fn tables(report: &Diagnosis) -> String {
    let mut out = "<section class=\"tables\">\n<h2>Regions with large residuals before any effect</h2>\n<table>\n<thead><tr><th class=\"name\">column</th>\
                   <th>from</th><th>to</th><th class=\"name\">unit</th><th class=\"name\">channel</th><th>mean, %</th><th>z over runs</th><th>runs</th><th class=\"name\">calibrated there</th></tr></thead>\n<tbody>\n"
        .to_owned();
    for r in &report.disagreement.regions {
        let _ = writeln!(
            out,
            "<tr><td>{}</td>{}{}<td>{}</td><td>{}</td>{}{}{}<td>{}</td></tr>",
            escape(&r.column),
            cell(&significant(r.from, 3)),
            cell(&significant(r.to, 3)),
            escape(&r.unit),
            escape(&r.channel),
            cell(&fixed(100.0 * r.mean_relative, 1)),
            cell(&fixed(r.z, 1)),
            cell(&r.runs.to_string()),
            if r.outside_calibration { "no" } else { "yes" }
        );
    }
    if report.disagreement.regions.is_empty() {
        out += "<tr><td colspan=\"9\">none</td></tr>\n";
    }
    let n = &report.noise;
    let _ = write!(
        out,
        "</tbody>\n</table>\n<h2>Noise and baseline</h2>\n<p>Row noise {} mN and {} % of the force; scatter between runs: stiffness {} %, \
         strength {} %, touch point {} µm, offsets {} mN (from the {}). Rescale of the measured finger: stiffness {}, strength {}. \
         Misfit of the baseline on the calibration runs over their noise: normal {}, x {}, y {}.</p>\n<table>\n<thead><tr>\
         <th class=\"name\">freedom</th><th>measured set</th><th>±</th><th>calibration</th><th>±</th></tr></thead>\n<tbody>\n",
        fixed(1000.0 * n.additive_n, 1),
        fixed(100.0 * n.multiplicative, 1),
        fixed(100.0 * n.run_gain_normal, 1),
        fixed(100.0 * n.run_gain_friction, 1),
        fixed(1000.0 * n.depth_zero_mm, 0),
        fixed(1000.0 * n.run_offset_n, 1),
        escape(&n.source),
        fixed(report.baseline.rescale.stiffness, 3),
        fixed(report.baseline.rescale.strength, 3),
        fixed(report.baseline.calibration_misfit[0], 2),
        fixed(report.baseline.calibration_misfit[1], 2),
        fixed(report.baseline.calibration_misfit[2], 2),
    );
    for p in &report.baseline.parameters {
        let _ = writeln!(
            out,
            "<tr><td>{}</td>{}{}{}{}</tr>",
            escape(&words::plain(&p.name)),
            cell(&fixed(p.value, 3)),
            cell(&fixed(p.sd, 3)),
            cell(&fixed(p.calibrated, 3)),
            cell(&fixed(p.calibrated_sd, 3))
        );
    }
    out + "</tbody>\n</table>\n</section>\n"
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
        assert!(!reduced(&found.report, &found.sentences, None).contains("sign flips"));
        found.report.holdout.method = "k-fold by run".into();
        assert!(reduced(&found.report, &found.sentences, None).contains("sign flips over runs"));
    }
}
