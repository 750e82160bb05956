//! Several fingers in one analysis: a law that they share, each finger with a baseline and a calibration of its own.
//!
//! The evidence for each law at each shape of the grid is added over the fingers, so that effects count that no finger could show
//! by itself. The best laws are refitted in every finger with one shape for all. Their sizes are combined with the finger as
//! the unit, and their heterogeneity is reported.
//!
//! Main types: [`FingerSets`]; main function: [`diagnose_group`].

use fingerpad_smooth::{Parameter, ReferenceCurves};

use crate::data::checks::check_distinct;
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::laws::Law;
use crate::model::active_law::{ActiveLaw, weak_prior};
use crate::model::finger_law::FingerLaw;
use crate::report::exchanged;
use crate::schema::{
    Caution, FingerAlone, FingerSize, FittedParameter, GroupDiagnosis, GroupVerdict, Rescale, SharedLaw, SharedSize,
    Verdict,
};
use crate::selection::acceptance::loosest;
use crate::selection::forward::ROUNDS;
use crate::selection::scan::{GridPoint, ScoredGridPoint, grid_of, scored};
use crate::selection::starts::wrong_way;
use crate::statistics::fit::FitStart;
use crate::statistics::projection::Projection;
use crate::statistics::tails::{LEAST_GAIN, minus_ln_p};
use crate::verdict::calibrated::Calibrated;
use crate::verdict::checked::Checked;
use crate::verdict::decision::{Decision, families};
use crate::verdict::instrument::FORCE_LAG;
use crate::verdict::intervals::NORMAL_95;
use crate::verdict::intervals::{FORM_ERROR, student_95};
use crate::verdict::options::Options;

/// The runs of one finger.
pub struct FingerSets {
    /// Its name.
    pub name: String,
    /// Runs without an effect.
    pub calibration: RunSet,
    /// Runs to be explained.
    pub measured: RunSet,
}

/// What the runs of one finger are that stand in another too.
const IN_OTHER: &str = "are runs of another finger of the group too, and a run is used once";
/// Fewest fingers whose sizes say how far fingers differ.
pub const FEWEST: usize = 3;
/// Laws that are refitted.
const REFITTED: usize = 5;
/// Difference in 2 log likelihood within which a law of another family cannot be excluded.
const CLOSE: f64 = 6.0;
/// Standard deviation of a shape parameter that is held, on its fitted scale.
const HELD: f64 = 1e-3;

/// Diagnoses several fingers. `stage` names what begins.
///
/// # Errors
/// [`DiagnoseError`] for sets that cannot carry a diagnosis.
pub fn diagnose_group(
    fingers: &[FingerSets],
    reference: &ReferenceCurves,
    options: &Options,
    stage: &mut dyn FnMut(&str),
) -> Result<GroupDiagnosis, DiagnoseError> {
    for (i, finger) in fingers.iter().enumerate() {
        // Runs that stand in two fingers would count twice.
        for other in &fingers[..i] {
            check_distinct(&finger.measured, &other.measured, IN_OTHER)?;
        }
    }
    let mut prepared = Vec::new();
    for finger in fingers {
        stage(&format!("calibrating {}", finger.name));
        let checked = Checked::new(&finger.calibration, &finger.measured, &options.own)?;
        let exchanged = exchanged::look(&checked, reference, options)?;
        let mut calibrated = Calibrated::new(&checked, reference, options)?;
        let cautions = checked.cautions.into_iter().chain(exchanged).chain(calibrated.cautions.clone()).collect();
        stage(&format!("looking for a lag of {}", finger.name));
        let lagging = calibrated.basis(reference, &options.settings).select(&calibrated.measured, |selected| {
            selected.lagging.map(|differing| (differing.set.clone(), selected.lag_effect.is_some()))
        });
        let has_lag = lagging.as_ref().is_some_and(|(_, is_effect)| *is_effect);
        if let Some((set, _)) = lagging {
            calibrated.measured = set;
        }
        prepared.push(OneFinger { name: &finger.name, calibrated, has_lag, cautions });
    }
    let mut alone = Vec::new();
    for finger in &prepared {
        stage(&format!("comparing laws of {}", finger.name));
        alone.push(Scanned::new(finger, reference, options));
    }
    stage("combining fingers");
    let mut ranked = ranking(&alone);
    ranked.truncate(REFITTED);
    let cells = alone.iter().map(|finger| finger.grid.len()).max().unwrap_or(1).max(1);
    let mut laws: Vec<SharedLaw> =
        ranked.iter().filter_map(|point| shared_law(&alone, point, reference, cells)).collect();
    laws.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
    let verdict = verdict_of(&mut laws, options);
    Ok(GroupDiagnosis {
        schema: "fingerpad-group/1".into(),
        verdict,
        laws,
        fingers: alone.iter().map(Scanned::by_itself).collect(),
        seed: options.settings.seed,
        version: env!("CARGO_PKG_VERSION").into(),
    })
}

/// The verdict; of the laws, best first, those that it rests on are kept.
fn verdict_of(laws: &mut Vec<SharedLaw>, options: &Options) -> GroupVerdict {
    let Some(best) = laws.first().cloned() else { return GroupVerdict::None };
    if !(best.gain_2ll >= LEAST_GAIN && best.p_model <= loosest(&options.settings)) {
        laws.truncate(1);
        return GroupVerdict::None;
    }
    let mut seen = Vec::new();
    laws.retain(|law| {
        let is_new = !seen.contains(&law.family);
        seen.push(law.family.clone());
        is_new && law.gain_2ll > best.gain_2ll - CLOSE
    });
    let excludes_zero = |size: &SharedSize| size.ci95[0] * size.ci95[1] > 0.0;
    if !best.sizes.iter().any(excludes_zero) {
        GroupVerdict::Differs
    } else if laws.len() > 1 {
        GroupVerdict::Ambiguous
    } else {
        GroupVerdict::Shared
    }
}

/// A finger with its calibration.
struct OneFinger<'f> {
    name: &'f str,
    /// The measured runs have their own lag, where one differs from the calibration's.
    calibrated: Calibrated,
    /// Whether such a lag is an effect.
    has_lag: bool,
    /// What is to be said of its files.
    cautions: Vec<Caution>,
}

/// A finger with its own decision and the evidence of every law at every shape.
struct Scanned<'a> {
    finger: &'a OneFinger<'a>,
    decision: Decision<'a>,
    grid: Vec<GridPoint>,
    scores: Vec<ScoredGridPoint>,
}

impl<'a> Scanned<'a> {
    fn new(finger: &'a OneFinger<'a>, reference: &'a ReferenceCurves, options: &'a Options) -> Self {
        let calibrated = &finger.calibrated;
        let decision = calibrated.basis(reference, &options.settings).decide(&calibrated.measured);
        let selection = &decision.selection;
        let mut testable: Vec<&'static Law> = Vec::new();
        for point in &selection.grid {
            if testable.last() != Some(&point.start.law) {
                testable.push(point.start.law);
            }
        }
        let grid = grid_of(&decision.task, &selection.null, &testable);
        let projection = Projection::at(&decision.task, &selection.null, &selection.null_derivatives);
        let scores = scored(&projection, &grid);
        Self { finger, decision, grid, scores }
    }

    /// Gain of a point of the grid, the same without an error of the baseline's form, and its number of columns.
    fn gain(&self, point: &ActiveLaw) -> Option<(f64, f64, usize)> {
        let found = self.scores.iter().find(|s| self.grid[s.grid_point].start == *point)?;
        let score = found.score.as_ref()?;
        if wrong_way(point.law, score) {
            return Some((0.0, 0.0, score.columns()));
        }
        let of_form = self.decision.selection.of_form[found.grid_point].as_ref();
        Some((score.gain(), score.excess(of_form), score.columns()))
    }

    /// The size of a law at a held shape with its standard deviation, for each size parameter, and its gain.
    fn refitted(&self, point: &ActiveLaw, reference: &ReferenceCurves) -> (Vec<[f64; 2]>, f64) {
        let null = &self.decision.selection.null;
        let mut task =
            self.finger.calibrated.calibration.drifting(self.decision.drift).task(self.decision.set, reference);
        let sd = |k: usize| if k < point.law.linear { weak_prior(point, k).1 } else { HELD };
        let place: usize = Parameter::COUNT + null.laws.iter().map(|active| active.values.len()).sum::<usize>();
        task.finger_laws.push(FingerLaw { active: point.clone(), sd: (0..point.values.len()).map(sd).collect() });
        let mut start = FitStart::from(null);
        start.laws.push(point.clone());
        let (fit, _) = task.fit(start, ROUNDS);
        let values = &fit.laws[fit.laws.len() - 1].values;
        let sizes = (0..point.law.linear).map(|k| {
            let sd = fit.covariance[(place + k, place + k)].max(0.0).sqrt();
            [values[k], sd.hypot(FORM_ERROR * values[k])]
        });
        (sizes.collect(), null.minus_2ll - fit.minus_2ll)
    }

    fn by_itself(&self) -> FingerAlone {
        let Decision { set, verdict, selection, hypotheses, .. } = &self.decision;
        let Calibrated { calibration_set, calibration, .. } = &self.finger.calibrated;
        let has_lag = self.finger.has_lag;
        let verdict = if has_lag && *verdict == Verdict::None { Verdict::Named } else { *verdict };
        let mut laws: Vec<String> = Vec::new();
        if verdict.is_claim() {
            laws.extend(has_lag.then(|| FORCE_LAG.into()));
            laws.extend(hypotheses.iter().flat_map(families).map(str::to_owned));
        }
        let change = |p: Parameter| (selection.null.parameters[p] - calibration.fit.parameters[p]).exp();
        FingerAlone {
            finger: self.finger.name.into(),
            runs: [calibration_set, set].map(|set| set.runs.len()),
            verdict,
            laws,
            rescale: Rescale { stiffness: change(Parameter::NormalScale), strength: change(Parameter::StrengthScale) },
            cautions: self.finger.cautions.clone(),
            finger_laws: calibration.fit.laws.iter().map(|active| active.law.name.to_owned()).collect(),
        }
    }
}

/// The best shape of every law over all fingers, best law first.
fn ranking(fingers: &[Scanned<'_>]) -> Vec<ActiveLaw> {
    let mut best: Vec<(f64, ActiveLaw)> = Vec::new();
    let mut tried: Vec<&ActiveLaw> = Vec::new();
    for point in fingers.iter().flat_map(|finger| &finger.grid).map(|point| &point.start) {
        if tried.contains(&point) {
            continue;
        }
        tried.push(point);
        let gains: Vec<(f64, f64, usize)> = fingers.iter().filter_map(|finger| finger.gain(point)).collect();
        if gains.len() < FEWEST {
            continue;
        }
        let size = minus_ln_p(gains.iter().map(|g| g.1).sum(), gains.iter().map(|g| g.2).sum());
        match best.iter_mut().find(|b| b.1.law == point.law) {
            Some(other) if other.0 < size => *other = (size, point.clone()),
            Some(_) => {}
            None => best.push((size, point.clone())),
        }
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.into_iter().filter(|b| b.0 > 0.0).map(|b| b.1).collect()
}

/// A law at a shape in all fingers that can test it; `None` where these are too few.
fn shared_law(
    fingers: &[Scanned<'_>],
    point: &ActiveLaw,
    reference: &ReferenceCurves,
    cells: usize,
) -> Option<SharedLaw> {
    let (mut names, mut sizes, mut gains, mut columns) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for finger in fingers {
        let Some((gain, excess, of_finger)) = finger.gain(point) else { continue };
        let (found, refitted) = finger.refitted(point, reference);
        // The baseline's error of form has the same share of the refit's gain as of the scan's.
        let share = if gain > 0.0 { (excess / gain).clamp(0.0, 1.0) } else { 1.0 };
        names.push(finger.finger.name.to_owned());
        gains.push(share * refitted.max(0.0));
        sizes.push(found);
        columns += of_finger;
    }
    if names.len() < FEWEST {
        return None;
    }
    let law = point.law;
    let gain_2ll: f64 = gains.iter().sum();
    let shape = law.parameters.iter().enumerate().skip(law.linear).map(|(k, p)| FittedParameter {
        name: p.name.into(),
        value: point.values[k],
        unit: p.unit.into(),
        ci95: [point.values[k]; 2],
    });
    let of_size = |k: usize| {
        let of_fingers: Vec<[f64; 2]> = sizes.iter().map(|finger| finger[k]).collect();
        combined(law.parameters[k].name, law.parameters[k].unit, &names, &of_fingers)
    };
    Some(SharedLaw {
        law: law.name.into(),
        family: law.family.into(),
        shape: shape.collect(),
        gain_2ll,
        gains_2ll: gains,
        p_model: (cells as f64 * (-minus_ln_p(gain_2ll, columns)).exp()).min(1.0),
        sizes: (0..law.linear).map(of_size).collect(),
    })
}

/// Sizes of several fingers, each with its standard deviation, as one [DerSimonian & Laird 1986; Hartung & Knapp 2001].
fn combined(name: &str, unit: &str, names: &[String], sizes: &[[f64; 2]]) -> SharedSize {
    let degrees = (sizes.len() - 1) as f64;
    let sum = |of: &dyn Fn(&[f64; 2]) -> f64| sizes.iter().map(of).sum::<f64>();
    let weight = |s: &[f64; 2]| s[1].powi(-2);
    let fixed = sum(&|s| weight(s) * s[0]) / sum(&weight);
    let q = sum(&|s| weight(s) * (s[0] - fixed).powi(2));
    let scale = sum(&weight) - sum(&|s| weight(s).powi(2)) / sum(&weight);
    let between = ((q - degrees) / scale).max(0.0);
    let weight = |s: &[f64; 2]| 1.0 / (s[1].powi(2) + between);
    let mean = sum(&|s| weight(s) * s[0]) / sum(&weight);
    let scatter = sum(&|s| weight(s) * (s[0] - mean).powi(2)) / degrees;
    // Fingers that agree by chance better than their own errors say nothing more than these do.
    let half = student_95(degrees) * (scatter.max(1.0) / sum(&weight)).sqrt();
    let of_finger = |(name, [value, sd]): (&String, &[f64; 2])| FingerSize {
        finger: name.clone(),
        value: *value,
        ci95: [value - NORMAL_95 * sd, value + NORMAL_95 * sd],
    };
    SharedSize {
        name: name.into(),
        unit: unit.into(),
        mean,
        ci95: [mean - half, mean + half],
        sd_between_fingers: between.sqrt(),
        q,
        p_heterogeneity: (-minus_ln_p(q, sizes.len() - 1)).exp().min(1.0),
        i_squared: if q > degrees { (q - degrees) / q } else { 0.0 },
        fingers: names.iter().zip(sizes).map(of_finger).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of Borenstein et al. 2009, "Introduction to Meta-Analysis", table 14.1: six studies, DerSimonian and Laird's
    /// variance between them 0.037, mean 0.358, Q 12.003, I² 58.3 %. The studies' effects and variances are printed with three
    /// decimals (a variance of 0.011 is within 5 %), which moves Q by 2 %.
    #[test]
    fn sizes_are_combined_as_in_a_published_example() {
        let effects = [0.095, 0.277, 0.367, 0.664, 0.462, 0.185];
        let variances = [0.033f64, 0.031, 0.050, 0.011, 0.043, 0.023];
        let sizes: Vec<[f64; 2]> = effects.iter().zip(variances).map(|(e, v)| [*e, v.sqrt()]).collect();
        let names: Vec<String> = (0..6).map(|k| format!("study {k}")).collect();
        let found = combined("g", "", &names, &sizes);
        println!("{found:?}");
        assert!((found.q / 12.003 - 1.0).abs() < 0.03, "{}", found.q);
        assert!((found.sd_between_fingers.powi(2) - 0.037).abs() < 1e-3);
        assert!((found.mean - 0.358).abs() < 1e-3);
        assert!((found.i_squared - 0.583).abs() < 0.02);
    }
}
