//! Power and stability of a diagnosis on its page, and as sentences that the command prints as well.

use maud::{Markup, html};

use super::figures::width;
use super::words::{name, plain};
use crate::Picture;
use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Figure, HPos, Line, Text};
use crate::colour::{Colour, INK, MODEL, rgb};
use crate::html::captioned_table;
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

/// A group without which the verdict is another one.
const OTHER: Colour = rgb(0xc0392b);
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
pub fn power_table(found: &Power) -> Markup {
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

/// The picture of the stability.
pub fn stability_picture(found: &Stability) -> Picture {
    let caption = "Gain of the strongest law without each group of the measured runs; red: another verdict. A single group \
                   that carries the verdict shows as a low or a red bar.";
    let title = "The decision without each group of the measured runs";
    Picture::wide_and_narrow("stability", title, caption, |narrow| GroupGains(found, width(narrow)))
}

/// Bars of the gain of the strongest law without each group of runs, a line with all runs; with the figure's width, px.
struct GroupGains<'a>(&'a Stability, f64);

impl Figure for GroupGains<'_> {
    fn size(&self) -> (u32, u32) {
        (self.1 as u32, 260)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let Stability { all, groups, .. } = self.0;
        let gains = groups.iter().chain([all]).map(|group| group.gain_2ll.max(0.0));
        let panel = Panel {
            left: 60.0,
            top: 40.0,
            width: self.1 - 76.0,
            height: 160.0,
            x: Axis::bare([0.0, groups.len().max(1) as f64]),
            y: Axis::covering("gain in 2 log likelihood; line: with all runs", [0.0, 1.0], gains, 5),
        };
        panel.grid(canvas);
        for (i, group) in groups.iter().enumerate() {
            let same = group.verdict == all.verdict && group.laws == all.laws;
            let (left, top) = panel.at(i as f64 + 0.15, group.gain_2ll.max(0.0));
            let (right, bottom) = panel.at(i as f64 + 0.85, 0.0);
            let laws = if group.laws.is_empty() { String::new() } else { format!(": {}", group.laws.join(", ")) };
            let title = format!("without {}: {}{laws}", group.runs.join(", "), plain(name(group.verdict)));
            let fill = if same { MODEL } else { OTHER };
            canvas.titled(&title, |canvas| canvas.rect(left, top, right - left, bottom - top, fill));
            let style = Text { h: HPos::Center, ..Text::BODY };
            canvas.text(&(i + 1).to_string(), (0.5 * (left + right), bottom + 12.0), style);
        }
        let ends = [0.0, panel.x.max()].map(|x| panel.at(x, all.gain_2ll.max(0.0)));
        canvas.line(&ends, Line { colour: INK, width: 1.0, dash: Some((4.0, 3.0)) });
        let note = "group that is left out; red: another verdict";
        canvas.text(note, (panel.left, 246.0), Text::BODY);
    }
}

/// Sentences under the verdict.
pub fn sentences(report: &Diagnosis) -> impl Iterator<Item = String> {
    let stability = report.stability.iter().map(stability_sentence);
    stability.chain(report.power.iter().map(|found| power_sentence(found, report)))
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
        assert!(!stability_picture(&found).svg.contains("#c0392b"));
        found.groups.push(left_out(Verdict::None, &[], 20.0));
        let sentence = stability_sentence(&found);
        assert!(sentence.contains("9 of 10") && sentence.contains("it is none."), "{sentence}");
        let picture = stability_picture(&found).svg;
        assert!(
            picture.contains("#c0392b") && picture.contains("a&lt;b") && picture.matches("<title>").count() == 10,
            "{picture}"
        );
    }
}
