//! Power and stability of a diagnosis on its page, and as sentences that the command prints as well.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use super::words::{name, plain};
use crate::html::{captioned_table, escape};
use fingerpad_diagnose::{Diagnosis, NotSimulated, Power, PowerCell, Rate, Stability};

fn percent(share: f64) -> String {
    format!("{:.0}", 100.0 * share)
}

/// A rate in a table: count, sets, and the interval of the share.
fn rate(rate: &Rate) -> String {
    rate_of(rate, "")
}

/// A rate in a sentence: count and number of `things`, and the interval of the share.
fn rate_of(rate: &Rate, things: &str) -> String {
    let [low, high] = rate.ci95.map(percent);
    format!("{} of {}{things} ({low} to {high} %)", rate.count, rate.sets)
}

/// Size of the effect in the sentence.
const SIZE: f64 = 0.1;

/// The power in sentences: that of the named laws at a size of 10 %, or of all laws; then false alarms.
pub fn power_sentence(found: &Power, report: &Diagnosis) -> String {
    let of_size = |list: &[PowerCell], law: &str| {
        let nearest = |c: &&PowerCell| (c.size_p90_relative / SIZE).ln().abs();
        let cells = list.iter().filter(|c| c.law == law && c.named.sets > 0);
        cells.min_by(|a, b| nearest(a).total_cmp(&nearest(b))).cloned()
    };
    let sentence = |cell: &PowerCell, what: &str| {
        format!(
            "With these runs, {what} of {} % would have been named in {} and detected in {}.",
            percent(cell.size_p90_relative),
            rate_of(&cell.named, " simulated sets"),
            rate(&cell.detected)
        )
    };
    let named = report.effects.iter().filter_map(|effect| {
        let cell = of_size(&found.cells, &effect.law)?;
        Some(sentence(&cell, &format!("an effect of the law `{}`", plain(&effect.law))))
    });
    let all = of_size(&found.by_size, "all").map(|cell| sentence(&cell, "an effect of any law that they can test"));
    let mut sentences: Vec<String> = named.chain(all).collect();
    if found.false_alarm.sets > 0 {
        sentences.push(format!("Without an effect, {} raise a false alarm.", rate(&found.false_alarm)));
    }
    let end = if found.interrupted { ", interrupted" } else { "" };
    sentences.push(format!(
        "({} simulated sets in {:.0} s{end}; intervals 95 %; the model's form is taken as exact.)",
        found.sets, found.elapsed_s
    ));
    sentences.join(" ")
}

/// The stability in one sentence.
pub fn stability_sentence(found: &Stability) -> String {
    let (kept, all) = (found.kept, found.groups.len());
    if kept == all {
        return format!("The verdict is the same whichever of {all} groups of the measured runs is left out.");
    }
    let mut others: Vec<String> = Vec::new();
    for group in found.groups.iter().filter(|g| g.verdict != found.all.verdict || g.laws != found.all.laws) {
        let laws: Vec<String> = group.laws.iter().map(|law| plain(law)).collect();
        let verdict = plain(name(group.verdict));
        let outcome = if laws.is_empty() { verdict } else { format!("{verdict} ({})", laws.join(", ")) };
        if !others.contains(&outcome) {
            others.push(outcome);
        }
    }
    format!(
        "The verdict stays the same for {kept} of {all} groups of the measured runs that are left out in turn; without the others it \
         is {}.",
        others.join("; or ")
    )
}

/// Table of the power: a row a law, columns of naming at each size.
fn power_table(found: &Power) -> Markup {
    let sizes: Vec<f64> = found.by_size.iter().map(|c| c.size_p90_relative).collect();
    let cells = || found.by_size.iter().chain(&found.cells);
    let mut laws: Vec<&str> = Vec::new();
    for cell in cells() {
        if !laws.contains(&cell.law.as_str()) {
            laws.push(&cell.law);
        }
    }
    let of = |law: &str, size: f64| {
        let cell = cells().find(|c| c.law == law && c.size_p90_relative == size && c.named.sets > 0);
        cell.map_or_else(|| "–".into(), |c| rate(&c.named))
    };
    let not_simulated = |n: &NotSimulated| {
        let size = n.size_p90_relative;
        let at = if size > 0.0 { format!(" at {} %", percent(size)) } else { String::new() };
        format!("{}{at} ({})", plain(&n.law), n.reason)
    };
    html! {
        h2 { "What these runs can show" }
        (captioned_table(
            "Simulated sets with one effect: how many name it alone, and the 95 % interval of that share.",
            html! { th.name { "law" } @for size in &sizes { th { (percent(*size)) " %" } } },
            html! { @for law in laws { tr { td { (plain(law)) } @for size in &sizes { td { (of(law, *size)) } } } } },
        ))
        @if !found.not_simulated.is_empty() {
            p.meta { "Not simulated: " (found.not_simulated.iter().map(not_simulated).collect::<Vec<_>>().join("; ")) "." }
        }
    }
}

/// The picture of the stability: the gain of the strongest law without each group of runs, as SVG.
pub fn stability_picture(found: &Stability) -> String {
    const WIDTH: f64 = 640.0;
    const HEIGHT: f64 = 260.0;
    const LEFT: f64 = 60.0;
    const TOP: f64 = 30.0;
    const BOTTOM: f64 = 50.0;
    let most = found.groups.iter().chain([&found.all]).map(|g| g.gain_2ll).fold(1.0, f64::max) * 1.1;
    let height = HEIGHT - TOP - BOTTOM;
    let y = |gain: f64| TOP + height * (1.0 - gain.max(0.0) / most);
    let step = (WIDTH - LEFT - 20.0) / found.groups.len().max(1) as f64;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<text x=\"{LEFT}\" y=\"16\">Gain of the strongest law, 2 log likelihood, without each group of runs; \
         line: with all runs</text>\n"
    );
    for (i, group) in found.groups.iter().enumerate() {
        let same = group.verdict == found.all.verdict && group.laws == found.all.laws;
        let (x, top) = (LEFT + step * (i as f64 + 0.15), y(group.gain_2ll));
        let fill = if same { "#4a6fa5" } else { "#c0392b" };
        let laws = if group.laws.is_empty() { String::new() } else { format!(": {}", group.laws.join(", ")) };
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"><title>{}</title></rect>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            0.7 * step,
            TOP + height - top,
            escape(&format!("without {}: {}{laws}", group.runs.join(", "), plain(name(group.verdict)))),
            x + 0.35 * step,
            HEIGHT - BOTTOM + 16.0,
            i + 1
        );
    }
    let line = y(found.all.gain_2ll);
    let _ = write!(
        out,
        "<line x1=\"{LEFT}\" x2=\"{0}\" y1=\"{line:.1}\" y2=\"{line:.1}\" stroke=\"#222\" stroke-dasharray=\"4 3\"/>\n\
         <text x=\"{1}\" y=\"{2:.1}\" text-anchor=\"end\">{3:.0}</text>\n<text x=\"{1}\" y=\"{4:.1}\" text-anchor=\"end\">0</text>\n\
         <text x=\"{LEFT}\" y=\"{5}\">group that is left out; red: another verdict</text>\n</svg>\n",
        WIDTH - 20.0,
        LEFT - 6.0,
        line + 4.0,
        found.all.gain_2ll,
        TOP + height + 4.0,
        HEIGHT - 12.0
    );
    out
}

/// Sentences under the verdict.
pub fn sentences(report: &Diagnosis) -> impl Iterator<Item = String> {
    let stability = report.stability.iter().map(stability_sentence);
    stability.chain(report.power.iter().map(|found| power_sentence(found, report)))
}

/// The table of the power and the picture of the stability.
pub fn section(report: &Diagnosis) -> Markup {
    html! {
        @if let Some(found) = &report.power { section.tables { (power_table(found)) } }
        @if let Some(found) = &report.stability {
            figure {
                (PreEscaped(stability_picture(found)))
                figcaption {
                    "The decision without each group of the measured runs. A single group that carries the verdict shows \
                     as a low or a red bar."
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fingerpad_diagnose::{LeftOut, Verdict};

    use super::*;

    fn left_out(verdict: Verdict, laws: &[&str], gain_2ll: f64) -> LeftOut {
        LeftOut { runs: vec!["a<b".into()], verdict, laws: laws.iter().map(|l| (*l).into()).collect(), gain_2ll }
    }

    #[test]
    fn another_verdict_is_told_and_red() {
        let named = |gain| left_out(Verdict::Named, &["speed_log"], gain);
        let mut found = Stability { all: named(50.0), groups: vec![named(40.0); 9], kept: 9 };
        assert!(stability_sentence(&found).contains("same whichever of 9"));
        assert!(!stability_picture(&found).contains("#c0392b"));
        found.groups.push(left_out(Verdict::None, &[], 20.0));
        let sentence = stability_sentence(&found);
        assert!(sentence.contains("9 of 10") && sentence.contains("it is none."), "{sentence}");
        let picture = stability_picture(&found);
        assert!(picture.contains("#c0392b") && picture.contains("a&lt;b") && picture.matches("<rect").count() == 10);
    }
}
