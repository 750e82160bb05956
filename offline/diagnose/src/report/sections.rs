//! The sections of the report, from a decision and its calibration.

use fingerpad_smooth::Parameter;

use crate::laws::LawsFile;
use crate::model::random_effects::RandomEffect;
use crate::model::residual_sums::ResidualSums;
use crate::plan::candidate_designs::PlanConstraints;
use crate::plan::next_experiment::{HypothesisPair, propose};
use crate::report::regions::{Maps, strongest};
use crate::schema::{
    Baseline, BaselineParameter, CandidateLaw, Caution, CrossValidationError, Disagreement, EffectFound, IMPLAUSIBLE,
    LawTest, NextExperiment, NoiseFound, Rescale, STRUCTURE_P, ScatterRatio, UnexplainedFound, Verdict,
};
use crate::selection::lack_of_fit::LEAST_SIZE;
use crate::statistics::calibration::Calibration;
use crate::statistics::fit::Fit;
use crate::statistics::tails::LEAST_GAIN;
use crate::verdict::cross_validation::{noise_floor_n, worst};
use crate::verdict::decision::{Decision, LawWeight};

/// The strokes that would separate the competing laws of an ambiguous verdict.
pub fn next_experiment(
    decision: &Decision<'_>,
    constraints: &PlanConstraints,
    own: &LawsFile,
) -> Option<NextExperiment> {
    if decision.verdict != Verdict::Ambiguous {
        return None;
    }
    let mut pairs = Vec::new();
    for (index, place) in decision.hypotheses.iter().enumerate() {
        let own = place.candidates[0].active.law.family;
        let mut seen = vec![own];
        for competitor in &place.candidates[1..] {
            if !seen.contains(&competitor.active.law.family) {
                seen.push(competitor.active.law.family);
                let index = decision.selection.finger_laws + index;
                pairs.push(HypothesisPair { index, competitor: &competitor.active });
            }
        }
    }
    propose(&decision.task, decision.set, &decision.selection.fit, &pairs, constraints, &own.columns)
}

/// How far baseline and measurement differ before any effect, and where.
pub fn disagreement(decision: &Decision<'_>, maps: &Maps) -> Disagreement {
    let null = &decision.selection.null;
    let (mut rms, mut floor) = (ResidualSums::default(), ResidualSums::default());
    rms.add(decision.task.residual_without_random_effects_n(null).into_iter());
    floor.add(noise_floor_n(&decision.task, &null.parameters, &null.laws, &decision.expected_variances).into_iter());
    let (rms_n, floor_rms_n) = (rms.rms(), floor.rms());
    Disagreement {
        ratio: std::array::from_fn(|k| worst(&[rms_n[k]; 3], &[floor_rms_n[k]; 3])),
        regions: strongest(&maps.before, &maps.named, 12),
        along_driver: maps.along_driver(),
        rms_n,
        floor_rms_n,
    }
}

/// The smooth model after the refit on the measured set. `model`: name of the file it starts from.
pub fn baseline(decision: &Decision<'_>, calibration: &Calibration, model: &str) -> Baseline {
    let null = &decision.selection.null;
    let sd = |fit: &Fit, p: Parameter| fit.covariance[(p.index(), p.index())].max(0.0).sqrt();
    let change = |p: Parameter| (null.parameters[p] - calibration.fit.parameters[p]).exp();
    Baseline {
        model: model.to_owned(),
        parameters: Parameter::all()
            .map(|p| BaselineParameter {
                name: p.info().name.into(),
                unit: p.info().unit.into(),
                value: null.parameters[p],
                sd: sd(null, p),
                calibrated: calibration.fit.parameters[p],
                calibrated_sd: sd(&calibration.fit, p),
            })
            .collect(),
        rescale: Rescale { stiffness: change(Parameter::NormalScale), strength: change(Parameter::StrengthScale) },
        calibration_misfit: calibration.misfit,
    }
}

/// Noise of rows and runs in the calibration.
pub fn noise(calibration: &Calibration) -> NoiseFound {
    let mean = |of: &dyn Fn(usize) -> f64| ((0..3).map(|k| of(k).powi(2)).sum::<f64>() / 3.0).sqrt();
    let variance = |effect: RandomEffect| calibration.fit.variances[effect.index()];
    let offsets = [RandomEffect::OffsetNormal, RandomEffect::OffsetX, RandomEffect::OffsetY].map(variance);
    NoiseFound {
        additive_n: mean(&|k| calibration.noise[k].additive_n),
        multiplicative: mean(&|k| calibration.noise[k].multiplicative),
        run_gain_normal: variance(RandomEffect::Stiffness).sqrt(),
        run_gain_friction: variance(RandomEffect::Strength).sqrt(),
        run_offset_n: ((offsets[0] + offsets[1] + offsets[2]) / 3.0).sqrt(),
        depth_zero_mm: variance(RandomEffect::DepthZero).sqrt(),
        correlation: calibration.correlation,
        source: "calibration".into(),
    }
}

/// The test of every law.
pub fn tests(decision: &Decision<'_>) -> Vec<LawTest> {
    decision
        .selection
        .tests
        .iter()
        .map(|t| LawTest {
            law: t.law.name.into(),
            family: t.law.family.into(),
            gain_2ll: t.gain_2ll,
            p_model: t.p_model,
            p_runs: t.p_runs.p,
            significant: t.why_untestable.is_none() && t.significant,
            testable: t.why_untestable.is_none(),
            reason: t.why_untestable.clone().unwrap_or_default(),
        })
        .collect()
}

/// Scatter between runs beyond twice what the calibration explains.
pub fn scatter_caution(decision: &Decision<'_>) -> Option<Caution> {
    let u = &decision.lack_of_fit;
    let cause = if u.p_scatter < STRUCTURE_P {
        "the form of what is named is not exact, single runs were garbled, or something else is there too.".to_owned()
    } else {
        format!("chance alone does that in {:.1} % of sets with so few runs.", 100.0 * u.p_scatter)
    };
    u.scatter_ratio.iter().any(|ratio| *ratio > 2.0).then(|| Caution {
        kind: "scatter".into(),
        role: "measured".into(),
        column: "run_id".into(),
        text: format!(
            "With what is named in the model, runs still scatter by {:.1} (normal) and {:.1} (friction) times the variance that \
             the calibration explains: {cause}",
            u.scatter_ratio[0], u.scatter_ratio[1]
        ),
    })
}

/// Largest scatter of runs of a calibration that a finger and its mounting have: of the touch point, mm, and of the forces.
const LARGEST_SCATTER_MM: f64 = 0.1;
const LARGEST_SCATTER: f64 = 0.15;
/// Largest change of the forces by an effect of a finger.
const LARGEST_SIZE: f64 = 1.0;
/// Least residual of runs that no fit saw, in noise floors: the floor is no measure of runs that scatter less than half as much.
const LEAST_RATIO: f64 = 0.5;

/// What no finger does: a calibration with more scatter, effects larger than the forces, residuals far below the floor. No corrected model may
/// rest on it. The first part of a sentence, up to the colon, is the title of the page.
pub fn implausible_cautions(
    noise: &NoiseFound,
    effects: &[EffectFound],
    holdout: &CrossValidationError,
) -> Vec<Caution> {
    let mut out = Vec::new();
    let mut caution = |role: &str, text: String| {
        out.push(Caution {
            kind: IMPLAUSIBLE.into(),
            role: role.into(),
            column: if role == "calibration" { "run_id" } else { "" }.into(),
            text: format!("{text} No corrected model is written."),
        });
    };
    let gain = noise.run_gain_normal.max(noise.run_gain_friction);
    if noise.depth_zero_mm > LARGEST_SCATTER_MM || gain > LARGEST_SCATTER {
        caution(
            "calibration",
            format!(
                "The calibration runs scatter by {:.2} mm of touch point and {:.0} % of force, where a finger and its mounting have at most \
                 {LARGEST_SCATTER_MM} mm and {:.0} %: they have an effect, a mistake in a column, or a finger that the model does not \
                 represent.",
                noise.depth_zero_mm,
                100.0 * gain,
                100.0 * LARGEST_SCATTER
            ),
        );
    }
    // A sensor may have any gain.
    for effect in effects.iter().filter(|e| e.size_p90_relative > LARGEST_SIZE && e.law != "force_gain") {
        caution(
            "measured",
            format!(
                "{} would change the forces by {:.0} %: a mistake in the files or in the model's form, no effect of a finger.",
                effect.law.replace('_', " "),
                100.0 * effect.size_p90_relative
            ),
        );
    }
    if holdout.ratio_after < LEAST_RATIO {
        caution(
            if holdout.method == "file" { "holdout" } else { "measured" },
            format!(
                "The residual is {:.2} times the noise floor: the calibration runs scatter far more than these runs, so the floor hides \
                 misfit, and effects smaller than it were not looked for.",
                holdout.ratio_after
            ),
        );
    }
    out
}

/// Laws that stand out from chance and are smaller than the model is exact.
pub fn too_small_cautions(decision: &Decision<'_>) -> impl Iterator<Item = Caution> {
    let u = &decision.lack_of_fit;
    let structure = u.is_too_small.then(|| Caution {
        kind: "too_small".into(),
        role: "measured".into(),
        column: u.column.clone(),
        text: format!(
            "{} depends on {} beyond chance (gain {:.0}), by {:.1} mN or {:.2} % of it only, less than the {:.1} % to which the form of {} \
             can be trusted: it does not count.",
            if u.channel == "normal" { "The normal force" } else { "Friction" },
            u.column,
            u.gain,
            1000.0 * u.size_n,
            100.0 * u.size_relative,
            100.0 * u.least_size,
            if u.least_size > LEAST_SIZE { "the named effect" } else { "the model" }
        ),
    });
    let laws = decision.too_small.iter().map(|weight| {
        let LawWeight { law, gain_2ll, beside, .. } = weight;
        let why = if weight.share < LEAST_SIZE {
            format!(
                "would change the forces by {:.2} % only, less than the {:.1} % to which the model's form can be trusted",
                100.0 * weight.share,
                100.0 * LEAST_SIZE
            )
        } else if let Some(other) = beside {
            format!("would change the forces by {:.1} % only, and the form of {} may be off by as much", 100.0 * weight.share, other.name)
        } else {
            format!(
                "by {:.1} standard deviations only, where {:.0} are asked of a name: the model's form may be off by as much",
                gain_2ll.max(0.0).sqrt(),
                LEAST_GAIN.sqrt()
            )
        };
        Caution {
            kind: "too_small".into(),
            role: "measured".into(),
            column: String::new(),
            text: format!("{} stands out from chance, but {why}: it is not named.", law.name),
        }
    });
    laws.chain(structure)
}

/// Structure that the accepted laws leave.
///
/// * `verdict`: that of the report, which held-out runs may have changed
pub fn unexplained(decision: &Decision<'_>, verdict: Verdict) -> UnexplainedFound {
    let u = &decision.lack_of_fit;
    // Evidence for a law that no refit confirms is structure along its driver.
    let law = decision.selection.tests.iter().find(|t| t.significant).filter(|_| !u.significant);
    let unexplained = verdict == Verdict::UnexplainedStructure;
    let column = law.filter(|_| unexplained).and_then(|t| t.law.drivers.first());
    UnexplainedFound {
        outside_calibration: false,
        significant: unexplained,
        column: column.map_or_else(|| u.column.clone(), |c| c.name().into()),
        channel: u.channel.clone(),
        gain: u.gain,
        p_model: u.p_model.min(u.p_scatter),
        p_runs: u.p_runs,
        size_n: u.size_n,
        size_relative: u.size_relative,
        largest_at: None,
        scatter_ratio: ScatterRatio { normal: u.scatter_ratio[0], friction: u.scatter_ratio[1] },
        partial: if unexplained { partial(decision) } else { Vec::new() },
    }
}

/// Laws that take a part of unexplained structure and are not claimed.
fn partial(decision: &Decision<'_>) -> Vec<CandidateLaw> {
    decision
        .hypotheses
        .iter()
        .map(|c| CandidateLaw {
            law: c.candidates[0].active.law.name.into(),
            family: c.candidates[0].active.law.family.into(),
            delta_2ll: -c.gain_2ll,
            lambda_rival: 0.0,
        })
        .collect()
}
