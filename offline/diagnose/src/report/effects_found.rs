//! The claimed effects as the report lists them: parameters with intervals, sizes, candidates.

use fingerpad_smooth::Parameter;

use crate::model::active_law::ActiveLaw;
use crate::report::driver_plot::DriverPlot;
use crate::schema::{CandidateLaw, EffectFound, FingerLawFound};
use crate::selection::acceptance::decisive_p;
use crate::statistics::calibration::Calibration;
use crate::verdict::decision::{Decision, families};
use crate::verdict::intervals::{first_place, parameters, quantile};
use crate::verdict::sizes::size_p90;

/// The claimed effects, strongest first, each with its figure.
pub fn effects(decision: &Decision<'_>) -> (Vec<EffectFound>, Vec<DriverPlot>) {
    let Decision { set, selection, .. } = decision;
    let fit = &selection.fit;
    let with = decision.task.predict(&fit.parameters, &fit.laws);
    let quantile = quantile(set.runs.len(), fit.laws.iter().map(|a| a.values.len()).sum());
    let mut at = first_place(selection);
    let mut out: Vec<(EffectFound, DriverPlot)> = Vec::new();
    for (index, hypotheses) in decision.hypotheses.iter().enumerate() {
        let (others, active) = &selection.laws_without(index);
        let without = decision.task.predict(&fit.parameters, others);
        let e = &selection.evidence[index];
        let effect = EffectFound {
            law: active.law.name.into(),
            family: active.law.family.into(),
            formula: active.law.formula.into(),
            parameters: parameters(
                active,
                &fit.covariance,
                at,
                quantile,
                decision.task.reference.ln_area_sd,
                hypotheses.gain_2ll,
            ),
            size_p90_relative: size_p90(set, &without, &with),
            gain_2ll: e.gain_2ll,
            p: decisive_p(e.p_model, e.p_runs),
            p_model: e.p_model,
            p_runs: e.p_runs.p,
            against_calibration: e.p_runs.by_calibration,
            outside_calibration: false,
            own: None,
            lambda_detect: hypotheses.lambda_detect,
            candidates: hypotheses
                .candidates
                .iter()
                .map(|c| CandidateLaw {
                    law: c.active.law.name.into(),
                    family: c.active.law.family.into(),
                    delta_2ll: c.delta_2ll,
                    lambda_rival: c.lambda_rival,
                })
                .collect(),
        };
        debug_assert_eq!(families(hypotheses)[0], active.law.family);
        let plot = DriverPlot::of(decision, (active, others), [&without, &with], (at, quantile));
        at += active.values.len();
        out.push((effect, plot));
    }
    out.sort_by(|a, b| b.0.gain_2ll.total_cmp(&a.0.gain_2ll));
    out.into_iter().unzip()
}

/// The finger's own laws as calibrated.
pub fn calibrated_laws(calibration: &Calibration, ln_area_sd: f64) -> Vec<FingerLawFound> {
    let fit = &calibration.fit;
    let quantile = quantile(calibration.runs, fit.laws.iter().map(|a| a.values.len()).sum());
    let mut at = Parameter::COUNT;
    let found = |(active, gain_2ll): (&ActiveLaw, &f64)| {
        let parameters = parameters(active, &fit.covariance, at, quantile, ln_area_sd, *gain_2ll);
        at += active.values.len();
        FingerLawFound {
            law: active.law.name.into(),
            family: active.law.family.into(),
            parameters,
            gain_2ll: *gain_2ll,
        }
    };
    fit.laws.iter().zip(&calibration.law_gains_2ll).map(found).collect()
}
