//! Several fingers together: sentences, a table of sizes, and a forest plot.

use std::fmt::Write as _;

use fingerpad_diagnose::{FingerAlone, GroupDiagnosis, GroupVerdict, SharedLaw, SharedSize};

use super::words::{name, plain};
use crate::html::escape;
use crate::numbers::{fixed, significant};

/// A size with its interval.
fn with_interval(size: &SharedSize) -> String {
    let unit = if size.unit.is_empty() { String::new() } else { format!(" {}", size.unit) };
    let [low, high] = size.ci95.map(|end| significant(end, 3));
    format!("{} {}{unit} (95 %: {low} to {high})", plain(&size.name), significant(size.mean, 3))
}

/// How far the fingers differ in a size.
fn heterogeneity(size: &SharedSize) -> String {
    format!(
        "Between fingers it scatters by {} beyond the errors of the single sizes (I² {} %, p for equal fingers {}).",
        significant(size.sd_between_fingers, 2),
        fixed(100.0 * size.i_squared, 0),
        significant(size.p_heterogeneity, 2)
    )
}

fn law_sentence(law: &SharedLaw) -> String {
    let sizes: Vec<String> = law.sizes.iter().map(with_interval).collect();
    format!(
        "{}: {}; gain {} over {} fingers.",
        plain(&law.law),
        sizes.join(", "),
        fixed(law.gain_2ll, 0),
        law.gains_2ll.len()
    )
}

/// The answer in sentences.
pub fn sentences(report: &GroupDiagnosis) -> Vec<String> {
    let alone = |finger: &FingerAlone| {
        let laws: Vec<String> = finger.laws.iter().map(|law| plain(law)).collect();
        let laws = if laws.is_empty() { String::new() } else { format!(" ({})", laws.join(", ")) };
        format!("{}: {}{laws} by itself.", finger.finger, plain(name(finger.verdict)))
    };
    let mut out: Vec<String> = report.fingers.iter().map(alone).collect();
    let best = report.laws.first();
    let answer = match (report.verdict, best) {
        (GroupVerdict::None, Some(best)) => {
            format!("No shared law: the best one has a gain of {} over all fingers.", fixed(best.gain_2ll, 0))
        }
        (GroupVerdict::None, None) => "No shared law: no law can be tested in three fingers.".into(),
        (GroupVerdict::Shared, Some(best)) => format!("All fingers share {}", law_sentence(best)),
        (GroupVerdict::Ambiguous, Some(_)) => {
            let laws: Vec<String> = report.laws.iter().map(law_sentence).collect();
            format!("All fingers share one of these laws, which they cannot separate. {}", laws.join(" "))
        }
        (GroupVerdict::Differs, Some(best)) => {
            format!("One law stands out, and its mean size may be zero: the fingers differ. {}", law_sentence(best))
        }
        (_, None) => String::new(),
    };
    out.push(answer);
    if let Some(best) = best.filter(|_| report.verdict != GroupVerdict::None) {
        out.extend(best.sizes.iter().map(heterogeneity));
    }
    for finger in &report.fingers {
        out.extend(
            finger.cautions.iter().map(|caution| format!("{}, {}: {}", finger.finger, caution.role, caution.text)),
        );
    }
    out
}

/// Sizes of all fingers and their mean as CSV.
pub fn sizes_csv(report: &GroupDiagnosis) -> String {
    let mut out = String::from("law,parameter,unit,finger,value,ci95_low,ci95_high\n");
    for law in &report.laws {
        for size in &law.sizes {
            let fingers = size.fingers.iter().map(|f| (f.finger.as_str(), f.value, f.ci95));
            for (finger, value, [low, high]) in fingers.chain([("all", size.mean, size.ci95)]) {
                let _ = writeln!(out, "{},{},{},{finger},{value},{low},{high}", law.law, size.name, size.unit);
            }
        }
    }
    out
}

/// Forest plot of the first size of the best law as SVG: every finger with its interval, and the mean.
pub fn forest(report: &GroupDiagnosis) -> Option<String> {
    const WIDTH: f64 = 640.0;
    const LEFT: f64 = 150.0;
    const ROW: f64 = 24.0;
    const TOP: f64 = 34.0;
    let law = report.laws.first()?;
    let size = law.sizes.first()?;
    let rows: Vec<(&str, f64, [f64; 2])> = size
        .fingers
        .iter()
        .map(|f| (f.finger.as_str(), f.value, f.ci95))
        .chain([("all fingers", size.mean, size.ci95)])
        .collect();
    let low = rows.iter().map(|r| r.2[0]).fold(0.0, f64::min);
    let high = rows.iter().map(|r| r.2[1]).fold(0.0, f64::max);
    let span = (high - low).max(1e-12);
    let x = |value: f64| LEFT + (WIDTH - LEFT - 20.0) * (value - low) / span;
    let height = TOP + ROW * rows.len() as f64 + 34.0;
    let bottom = height - 30.0;
    let unit = if size.unit.is_empty() { String::new() } else { format!(", {}", size.unit) };
    let title = escape(&format!("{}: {}{unit}, with 95 % intervals", plain(&law.law), plain(&size.name)));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<text x=\"10\" y=\"18\">{title}</text>\n\
         <line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{TOP}\" y2=\"{bottom:.1}\" stroke=\"#888\" stroke-dasharray=\"3 3\"/>\n",
        x(0.0)
    );
    for (i, (name, value, [from, to])) in rows.iter().enumerate() {
        let y = TOP + ROW * (i as f64 + 0.5);
        let colour = if i + 1 == rows.len() { "#c0392b" } else { "#4a6fa5" };
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n\
             <line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"{colour}\" stroke-width=\"2\"/>\n\
             <circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>",
            LEFT - 12.0,
            y + 4.0,
            escape(name),
            x(*from),
            x(*to),
            x(*value)
        );
    }
    for value in [low, 0.0, high] {
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            x(value).clamp(LEFT, WIDTH - 24.0),
            height - 12.0,
            significant(value, 2)
        );
    }
    out.push_str("</svg>\n");
    Some(out)
}
