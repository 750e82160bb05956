//! Several fingers together: sentences, a table of sizes, and a forest plot.

use std::fmt::Write as _;

use fingerpad_diagnose::{FingerAlone, GroupDiagnosis, GroupVerdict, SharedLaw, SharedSize};

use super::words::{name, plain};
use crate::Picture;
use crate::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use crate::colour::{ESTIMATE, GREY, MODEL};
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

/// Forest plot of the first size of the best law: every finger with its interval, and the mean.
pub fn forest(report: &GroupDiagnosis) -> Option<Picture> {
    let law = report.laws.first()?;
    let size = law.sizes.first()?;
    let unit = if size.unit.is_empty() { String::new() } else { format!(", {}", size.unit) };
    let title = format!("{}: {}{unit}, with 95 % intervals", plain(&law.law), plain(&size.name));
    Some(Picture::new("group_sizes", title.as_str(), "", &Forest { size, title: &title }))
}

struct Forest<'a> {
    size: &'a SharedSize,
    title: &'a str,
}

/// Height of a finger's row and of the title above all rows, px.
const ROW: f64 = 24.0;
const TOP: f64 = 34.0;

impl Figure for Forest<'_> {
    fn size(&self) -> (u32, u32) {
        (640, (TOP + ROW * (self.size.fingers.len() + 1) as f64 + 34.0) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let fingers = self.size.fingers.iter().map(|f| (f.finger.as_str(), f.value, f.ci95, MODEL));
        let all = ("all fingers", self.size.mean, self.size.ci95, ESTIMATE);
        let rows: Vec<_> = fingers.chain([all]).collect();
        let low = rows.iter().map(|r| r.2[0]).fold(0.0, f64::min);
        let high = rows.iter().map(|r| r.2[1]).fold(0.0, f64::max);
        let (left, right, bottom) = (150.0, 620.0, TOP + ROW * rows.len() as f64);
        let x = |value: f64| left + (right - left) * (value - low) / (high - low).max(1e-12);
        canvas.text(self.title, (10.0, 14.0), Text::BODY);
        canvas.line(&[(x(0.0), TOP), (x(0.0), bottom)], Line { colour: GREY, width: 1.0, dash: Some((3.0, 3.0)) });
        for (i, (name, value, [from, to], colour)) in rows.into_iter().enumerate() {
            let y = TOP + ROW * (i as f64 + 0.5);
            canvas.text(name, (left - 12.0, y), Text { h: HPos::Right, ..Text::BODY });
            canvas.line(&[(x(from), y), (x(to), y)], Line::solid(colour, 2.0));
            canvas.marker(Marker::Circle, (x(value), y), 3.3, colour, true);
        }
        for value in [low, 0.0, high] {
            let at = (x(value).clamp(left, right - 4.0), bottom + 14.0);
            canvas.text(&significant(value, 2), at, Text { h: HPos::Center, ..Text::BODY });
        }
    }
}
