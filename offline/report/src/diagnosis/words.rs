//! The sentences of a diagnosis; every verdict has its own.

use crate::numbers::{fixed, significant};
use fingerpad_diagnose::laws::run_columns;
use fingerpad_diagnose::{
    Caution, Confidence, Confirmed, CrossValidationError, Diagnosis, EffectFound, FeConfirmation, FingerLawFound,
    FittedParameter, InputFile, InstrumentLag, LawsFile, Region, Verdict, Witness,
};

/// A law's or a family's name in running text.
pub fn plain(name: &str) -> String {
    name.replace('_', " ")
}

/// A column in running text.
pub fn column(name: &str) -> String {
    match name {
        "slide" => "the path of the plate".into(),
        "t_s" => "the clock".into(),
        "run_id" => "the run itself".into(),
        other => other.to_owned(),
    }
}

fn families(effect: &EffectFound) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for c in &effect.candidates {
        let name = plain(&c.family);
        if !list.contains(&name) {
            list.push(name);
        }
    }
    list
}

/// The law of an effect, or the candidates for it.
fn candidates(effect: &EffectFound) -> String {
    match &families(effect)[..] {
        [] | [_] => plain(&effect.law),
        several => format!("{} (these runs cannot tell which)", several.join(" or ")),
    }
}

/// A parameter's name without the unit in which it ends.
fn without_unit(name: &str) -> &str {
    const UNITS: [&str; 10] =
        ["_n_s_per_mm", "_per_hour", "_per_mm", "_per_c", "_mm_s", "_deg", "_mm", "_au", "_n", "_s"];
    UNITS.iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name)
}

/// Misfit of the calibration above which its noise is not reached, over the noise between neighbouring rows.
const MISFIT: f64 = 1.5;

/// A sentence if the baseline does not fit the calibration runs to their noise.
fn calibration_note(misfit: [f64; 3]) -> String {
    let worst = misfit.into_iter().fold(0.0, f64::max);
    if worst < MISFIT {
        return String::new();
    }
    format!(
        " The baseline does not fit the calibration runs to their noise: it leaves {} times the noise between neighbouring \
         rows; what it gets wrong there may look like an effect or hide one.",
        fixed(worst, 1)
    )
}

fn size(effect: &EffectFound) -> String {
    // Of a law with several amplitudes, the first whose interval excludes zero is printed.
    let listed = effect.parameters.iter().find(|p| p.ci95[0] > 0.0 || p.ci95[1] < 0.0);
    let p = listed.unwrap_or(&effect.parameters[0]);
    let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
    format!(
        "{} {}{unit} (95 %: {} to {}), {} % of the force at its 90th percentile",
        plain(without_unit(&p.name)),
        significant(p.value, 3),
        significant(p.ci95[0], 3),
        significant(p.ci95[1], 3),
        fixed(100.0 * effect.size_p90_relative, 0)
    )
}

/// The formula of an effect with its fitted numbers; a negative one is in brackets.
pub fn fitted(effect: &EffectFound) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let number = |name: &str| {
        let p = effect.parameters.iter().find(|p| p.name == name)?;
        let number = significant(p.value, 3);
        Some(if p.value < 0.0 { format!("({number})") } else { number })
    };
    let (mut out, mut rest) = (String::new(), effect.formula.as_str());
    while let Some(start) = rest.find(is_name) {
        let end = rest[start..].find(|c| !is_name(c)).map_or(rest.len(), |n| start + n);
        let name = &rest[start..end];
        out += &rest[..start];
        out += &number(name).unwrap_or_else(|| name.to_owned());
        rest = &rest[end..];
    }
    out + rest
}

/// Unit of a column: one of the program's or of a user's file.
pub fn unit<'a>(name: &str, own: &'a LawsFile) -> &'a str {
    let known = run_columns::law_columns().find(|(c, _)| c.name() == name).map(|(_, known)| known.unit);
    known.or(own.columns.iter().find(|c| c.name == name).map(|c| c.unit.as_str())).unwrap_or("")
}

/// A column as an axis names it: in words, with its unit.
pub fn axis(name: &str, unit: &str) -> String {
    let ending = format!("_{}", unit.to_lowercase().replace(['°', '/'], ""));
    let bare = || name.strip_suffix("_mm").or(name.strip_suffix("_s")).or(name.strip_suffix(&ending)).unwrap_or(name);
    let plain = run_columns::law_columns().find(|(c, _)| c.name() == name).map_or_else(bare, |(_, known)| known.words);
    let unit = if unit == "degree" { "°" } else { unit };
    let comma = if unit.is_empty() { "" } else { ", " };
    format!("{}{comma}{unit}", plain.replace('_', " "))
}

/// An input file, with its size if it has runs.
pub fn input(file: &InputFile) -> String {
    if file.runs == 0 {
        return format!("{} {}", file.role, file.file);
    }
    format!("{} {} ({} runs, {} rows)", file.role, file.file, file.runs, file.rows)
}

/// The verdict as one paragraph, with what is missing and its size.
pub fn verdict(report: &Diagnosis) -> String {
    paragraph(report, true)
}

/// The verdict as one paragraph below its headline and beside the formulas, which have what is missing and its size.
pub fn details(report: &Diagnosis) -> String {
    let has_headline = matches!(report.verdict, Verdict::Named | Verdict::None);
    paragraph(report, !has_headline || report.implausible().is_some())
}

fn paragraph(report: &Diagnosis, with_list: bool) -> String {
    let doubt = if report.implausible().is_some() {
        "This would be the answer if the files and the model could be trusted, which they cannot: "
    } else {
        ""
    };
    let answer = answer(report, with_list);
    doubt.to_owned() + answer.trim_start() + &outside_note(report) + &finger_note(report) + &instrument_note(report)
}

/// How far the verdict can be relied on, with the regression that needs no model.
pub fn confidence(report: &Diagnosis) -> String {
    let Witness { tests, disagrees, level } = &report.witness;
    let seen: Vec<String> = tests
        .iter()
        .filter(|t| t.p < *level)
        .map(|t| format!("{} on {} (p {:.0e})", t.channel.replace("normal", "normal force"), column(&t.column), t.p))
        .collect();
    let sees = if seen.is_empty() { "no dependence".into() } else { format!("a dependence of {}", seen.join(", ")) };
    let word = match report.confidence {
        Confidence::High => "high",
        Confidence::Moderate => "moderate",
        Confidence::Low => "low",
    };
    let witness = match (tests.is_empty(), disagrees.is_empty()) {
        (true, _) => "there are too few runs for a regression of run means beside it".into(),
        (_, true) => format!("a regression of run means without the model finds {sees}"),
        (_, false) => format!("a regression of run means without the model disagrees: {}", disagrees.join(", and ")),
    };
    format!("Confidence: {word}; {witness}.")
}

/// A sentence about the laws that the calibration runs follow.
fn finger_note(report: &Diagnosis) -> String {
    let with_values = |law: &FingerLawFound| {
        let value = |p: &FittedParameter| {
            let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
            format!("{} {}{unit}", plain(without_unit(&p.name)), significant(p.value, 3))
        };
        let values: Vec<String> = law.parameters.iter().map(value).collect();
        format!("{} ({})", plain(&law.law), values.join(", "))
    };
    let laws: Vec<String> = report.finger_laws.iter().map(with_values).collect();
    if laws.is_empty() {
        return String::new();
    }
    format!(
        " The calibration runs show {} too: that belongs to the finger, the model has it in every file, and it does not count as \
         missing.",
        laws.join(" and ")
    )
}

/// Sentences about lags between forces and positions.
fn instrument_note(report: &Diagnosis) -> String {
    let sentence = |lag: &InstrumentLag| {
        let ms = |s: f64| significant(1000.0 * s, 3);
        let [low, high] = lag.ci95_s.map(ms);
        let interval = format!("{} ms (95 %: {low} to {high})", ms(lag.lag_s));
        if lag.source == "measured" {
            format!(" In the measured runs the forces lag {interval} behind the positions.")
        } else {
            format!(
                " In the calibration the forces lag {interval} behind the positions, as behind a filter or on another clock; all files \
                 are compared with this lag."
            )
        }
    };
    report.instrument.iter().map(sentence).collect()
}

/// How near the model comes to runs that no fit saw, as a sentence.
fn gap(gap: &CrossValidationError) -> String {
    let [before, after] = [gap.ratio_before, gap.ratio_after].map(|ratio| significant(ratio, 2));
    match before == after {
        true => format!("The gap is {before} times the noise floor."),
        false => format!("The gap falls from {before} to {after} times the noise floor."),
    }
}

/// The verdict in words with size and gap, or what cannot be; a report that comes with a title has that.
pub fn headline(report: &Diagnosis) -> String {
    if !report.title.is_empty() {
        return report.title.clone();
    }
    if let Some(Caution { text, .. }) = report.implausible() {
        let finding = text.split_once(':').map_or(text.as_str(), |(finding, _)| finding);
        return format!("No result: {}{}", finding[..1].to_lowercase(), &finding[1..]);
    }
    let share = |e: &EffectFound, names: String| {
        format!("{names}, {} % of the force", significant(100.0 * e.size_p90_relative, 2))
    };
    let finding = match report.verdict {
        Verdict::None if look_exchanged(report) => return "No result: the files look exchanged".into(),
        Verdict::None => "Nothing is missing that these runs could show".into(),
        Verdict::Named | Verdict::Ambiguous => {
            let list: Vec<String> = report.effects.iter().map(|e| share(e, candidates(e))).collect();
            format!("Missing: {}", list.join("; and "))
        }
        Verdict::UnexplainedStructure => {
            let u = &report.unexplained;
            let size =
                format!("{} mN ({} %)", significant(1000.0 * u.size_n, 3), significant(100.0 * u.size_relative, 2));
            let channel = if u.channel == "normal" { "the normal force" } else { "friction" };
            let at = u.largest_at.as_ref().map_or_else(String::new, |r| format!(", most at {}", range(r).0));
            match u.column.as_str() {
                "run_id" => format!("Unexplained: {channel} scatters between runs by {size}"),
                column => format!("Unexplained: {channel} depends on {} by {size}{at}", axis(column, "")),
            }
        }
    };
    // Without a noise floor there is no gap.
    if report.holdout.ratio_before > 0.0 { format!("{finding}. {}", gap(&report.holdout)) } else { finding }
}

/// A sentence if evidence for the verdict lies outside the calibration.
fn outside_note(report: &Diagnosis) -> String {
    let laws: Vec<String> = report.effects.iter().filter(|e| e.outside_calibration).map(|e| plain(&e.law)).collect();
    if report.unexplained.outside_calibration {
        " The measured runs leave the calibration there: it may be the form of the model, which no calibration run has tested."
            .into()
    } else if !laws.is_empty() {
        format!(" Part of the evidence for {} lies outside the calibration.", laws.join(" and "))
    } else {
        String::new()
    }
}

/// The runs of the gap: those of a file neither chose nor fitted what is claimed, those of folds chose it.
fn unseen(gap: &CrossValidationError) -> String {
    if gap.method == "file" {
        format!("{} runs that neither chose nor fitted it", gap.runs)
    } else {
        format!("the {} measured runs, each predicted by a fit without it (they chose what is fitted)", gap.runs)
    }
}

/// A part of a column with its unit, and the residual there.
pub fn range(region: &Region) -> (String, String) {
    let unit = match region.unit.as_str() {
        "" => String::new(),
        "degree" => "°".into(),
        unit => format!(" {unit}"),
    };
    let sign = if region.mean_relative < 0.0 { "−" } else { "+" };
    let [from, to] = [region.from, region.to].map(|end| significant(end, 3));
    let size = fixed(100.0 * region.mean_relative.abs(), 0);
    (format!("{from} to {to}{unit}"), format!("({sign}{size} %)"))
}

/// The same with the column and what is measured there beside the model.
fn part(region: &Region) -> String {
    let (range, size) = range(region);
    format!("{} {range} {size}", column(&region.column))
}

/// A sentence about where simulation and measurement disagree without the first effect: least and most along its driver.
fn place(report: &Diagnosis) -> String {
    match &report.disagreement.along_driver {
        Some([low, high]) => format!(
            " Without it, measured {} is off the model most at {} and {}.",
            match low.channel.as_str() {
                "normal" => "normal force",
                _ => "friction",
            },
            part(low),
            part(high)
        ),
        None => String::new(),
    }
}

fn answer(report: &Diagnosis, with_list: bool) -> String {
    let gap = &report.holdout;
    let runs = unseen(gap);
    let closing = if gap.refused_after_n.is_some() {
        format!(
            "No correction is made and no corrected.fpm written: on {runs}, the worst channel's residual is {} times the noise floor without \
             the effect and no less with it.",
            fixed(gap.ratio_before, 2)
        )
    } else {
        format!(
            "On {runs}, the worst channel's residual goes from {} (as calibrated) over {} (refitted) to {} times the noise floor.",
            fixed(gap.ratio_calibrated, 2),
            fixed(gap.ratio_before, 2),
            fixed(gap.ratio_after, 2)
        )
    };
    match report.verdict {
        Verdict::None if look_exchanged(report) => {
            "These files are inconclusive: the measured runs vary none of the conditions that the calibration runs vary."
                .into()
        }
        Verdict::None => format!(
            "{}After the refit of the baseline the residual is {} times the noise floor in \
             the worst channel of {runs}.",
            if with_list { "Nothing is missing that these runs could show. " } else { "" },
            fixed(gap.ratio_before, 2)
        ),
        Verdict::Named => {
            let list: Vec<String> = report.effects.iter().map(|e| format!("{} ({})", candidates(e), size(e))).collect();
            let list = if with_list { format!("Missing: {}.", list.join("; and ")) } else { String::new() };
            format!("{list}{} {closing}", place(report))
        }
        Verdict::Ambiguous => {
            let list: Vec<String> = report.effects.iter().map(|e| families(e).join(" or ")).collect();
            let next = report.next_experiment.as_ref().map_or_else(String::new, |n| {
                format!(
                    " The {} strokes below (varying {}; {} minutes) are expected to separate them by {} in 2 log likelihood.",
                    n.runs.len(),
                    n.factor,
                    fixed(n.minutes, 0),
                    fixed(n.lambda_rival_expected, 0)
                )
            });
            format!(
                "Something is missing, and this protocol cannot separate its candidates: {}. The model carries the \
                 first candidate.{next} {closing}",
                list.join("; and ")
            )
        }
        Verdict::UnexplainedStructure => {
            let u = &report.unexplained;
            let partial = if u.partial.is_empty() {
                String::new()
            } else {
                let names: Vec<String> = u.partial.iter().map(|c| plain(&c.law)).collect();
                format!(" {} would take a part of it and is not claimed.", names.join(" with "))
            };
            let left = report.holdout.ratio_after;
            let gap = if left > 2.0 {
                format!(" On {runs}, the worst channel's residual is {} times the noise floor.", fixed(left, 2))
            } else {
                String::new()
            };
            format!(
                "Something is there, and none of the known laws is it: {} depends on {} by {} mN or {} % of it{} (gain {}), and the scatter \
                 between runs is {} (normal) and {} (friction) times what the calibration explains.{gap}{partial}",
                if u.channel == "normal" { "the normal force" } else { "friction" },
                column(&u.column),
                fixed(1000.0 * u.size_n, 1),
                fixed(100.0 * u.size_relative, 1),
                u.largest_at.as_ref().map_or_else(String::new, |r| format!(", most at {}", part(r))),
                fixed(u.gain, 0),
                fixed(u.scatter_ratio.normal, 1),
                fixed(u.scatter_ratio.friction, 1)
            )
        }
    }
}

/// Name of the verdict in the report.
pub fn word(report: &Diagnosis) -> &'static str {
    name(report.verdict)
}

/// Name of a verdict in a report.
pub fn name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::None => "none",
        Verdict::Named => "named",
        Verdict::Ambiguous => "ambiguous",
        Verdict::UnexplainedStructure => "unexplained_structure",
    }
}

/// The lines that the command prints.
pub fn summary(report: &Diagnosis) -> String {
    let fe = report.fe_confirmation.as_ref().map_or_else(String::new, |fe| format!("\n{}", confirmation(fe)));
    let first: String = cautions(report).iter().map(|(kind, text)| format!("{kind}: {text}\n")).collect();
    let doubt = report.implausible().map_or_else(String::new, |_| format!(" ({})", headline(report)));
    format!(
        "{first}verdict: {}{doubt}\n{}\n{}{fe}\nNext: {}",
        word(report),
        verdict(report),
        confidence(report),
        report.next_step
    )
}

/// The finding of the finite elements, in one or two sentences.
pub fn confirmation(fe: &FeConfirmation) -> String {
    let [before, after] = fe.gap();
    let finding = match fe.confirmed {
        Confirmed::Yes => "confirm it",
        Confirmed::InPart => "are closer to the runs with it, but above the floor",
        Confirmed::Open if before <= 1.5 => "neither confirm nor contradict it, since there is no gap to close",
        Confirmed::Open => "neither confirm nor contradict it, since their gap does not shrink",
        Confirmed::No => "contradict it",
    };
    let seen = if fe.set == "holdout" { "" } else { ", to which the effect was fitted" };
    let [reduced_before, reduced_after] = fe.reduced_gap();
    let lost = if fe.without_equilibrium.is_empty() {
        String::new()
    } else {
        format!(" No equilibrium was found for {}.", fe.without_equilibrium.join(", "))
    };
    format!(
        "The finite elements (shape {}, {} mesh) {finding}: with the effect inside their law the worst channel's residual changes from {} \
         to {} times the noise floor on {} strokes of the {} set{seen}; the reduced model goes from {} to {} on the same.{lost}",
        fe.shape,
        fe.mesh,
        fixed(before, 2),
        fixed(after, 2),
        fe.runs.len(),
        fe.set,
        fixed(reduced_before, 2),
        fixed(reduced_after, 2)
    )
}

/// Kinds of cautions, in their order on the page.
const FIRST: [&str; 13] = [
    "exchanged",
    "unit",
    "implausible",
    "ignored_column",
    "thinned",
    "lift_off",
    "reading",
    "sensor_rail",
    "clock",
    "outside_calibration",
    "one_axis",
    "scatter",
    "spikes",
];
/// Kinds of cautions, from the first on, after which the verdict may rest on a mistake in the files.
const WARNINGS: usize = 4;

/// Lines printed before the verdict, each with the word `warning` or `note`: cautions in the order of their weight, then a
/// calibration that misses its noise.
pub fn cautions(report: &Diagnosis) -> Vec<(&'static str, String)> {
    let place = |kind: &str| FIRST.iter().position(|k| *k == kind).unwrap_or(FIRST.len());
    let mut list: Vec<_> = report.cautions.iter().collect();
    list.sort_by_key(|c| place(&c.kind));
    let misfit = calibration_note(report.baseline.calibration_misfit);
    let word = |kind: &str| if place(kind) < WARNINGS { "warning" } else { "note" };
    let listed = list.into_iter().map(|c| (word(&c.kind), c.text.clone()));
    let list: Vec<_> = listed.chain((!misfit.is_empty()).then(|| ("warning", misfit.trim().to_owned()))).collect();
    let (warnings, notes): (Vec<_>, Vec<_>) = list.into_iter().partition(|(word, _)| *word == "warning");
    warnings.into_iter().chain(notes).collect()
}

/// Whether calibration and measured runs look exchanged, so that the absence of an effect means nothing.
pub fn look_exchanged(report: &Diagnosis) -> bool {
    report.cautions.iter().any(|c| c.kind == "exchanged")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_named_without_the_unit_that_follows_its_value() {
        assert_eq!(plain(without_unit("coefficient_n_s_per_mm")), "coefficient");
        assert_eq!(plain(without_unit("pull_off_n")), "pull off");
        assert_eq!(plain(without_unit("amplitude_per_e_fold")), "amplitude per e fold");
    }

    #[test]
    fn columns_of_the_users_own_have_their_unit_on_an_axis() {
        assert_eq!(axis("voltage_v", "V"), "voltage, V");
        assert_eq!(axis("frame_temperature_c", "°C"), "frame temperature, °C");
        assert_eq!(axis("grade", ""), "grade");
        assert_eq!(axis("dwell_s", "s"), "hold, s");
    }

    #[test]
    fn a_formula_has_the_fitted_numbers_in_place_of_its_parameters() {
        let parameter =
            |name: &str, value| FittedParameter { name: name.into(), value, unit: String::new(), ci95: [0.0; 2] };
        let effect = EffectFound {
            law: "mine".into(),
            family: "mine".into(),
            formula: "strength × (1 + slope ln(v/2) + slope_2), s the slopes".into(),
            parameters: vec![parameter("slope", -0.123_456), parameter("slope_2", 2.0)],
            size_p90_relative: 0.1,
            gain_2ll: 50.0,
            p: 0.0,
            p_model: 0.0,
            p_runs: 0.0,
            against_calibration: false,
            outside_calibration: false,
            lambda_detect: 50.0,
            candidates: Vec::new(),
            own: None,
        };
        assert_eq!(fitted(&effect), "strength × (1 + (−0.123) ln(v/2) + 2.00), s the slopes");
    }

    #[test]
    fn a_calibration_that_misses_its_noise_says_so() {
        assert_eq!(calibration_note([1.1, 1.2, 1.0]), "");
        assert!(calibration_note([1.1, 9.84, 1.0]).contains("9.8 times the noise"));
    }
}
