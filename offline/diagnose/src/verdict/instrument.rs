//! The lag between forces and positions as a report has it: that of the instrument, which the calibration shows and which is taken out, and
//! a lag of the measured runs that differs from it, which is an effect of its own (`force_lag`).
//!
//! Main type: [`Differing`]; main functions: [`differing`], [`found`], [`effect`].

use crate::data::lag::{Lag, with_lag};
use crate::data::runs::RunSet;
use crate::schema::{CandidateLaw, EffectFound, FittedParameter, InstrumentLag};
use crate::statistics::calibration::Calibration;
use crate::statistics::fit::FitStart;
use crate::statistics::lag::{BEYOND_FORM, LagEstimate, estimate, form_sd_s};
use crate::statistics::tails::minus_ln_p;
use crate::verdict::basis::Basis;
use crate::verdict::decision::Decision;
use crate::verdict::intervals::NORMAL_95;
use crate::verdict::sizes::size_p90;

/// Name and family of the effect.
pub const FORCE_LAG: &str = "force_lag";

/// A lag of the measured runs on top of the calibration's, and the runs with it.
pub struct Differing {
    /// The difference.
    pub lag: LagEstimate,
    /// The measured runs with their own lag.
    pub set: RunSet,
    /// Whether the difference is more than the errors of form of both files' lags, and the calibration runs do not have the measured
    /// runs' lag: one that is too short to count in them may be the same.
    pub is_effect: bool,
}

/// A lag by which the measured runs differ from the calibration.
///
/// * `plain`: the decision of the measured runs with the calibration's lag
pub fn differing(plain: &Decision<'_>, basis: &Basis<'_>) -> Option<Differing> {
    let Basis { calibration, reference, .. } = basis;
    let start = FitStart::from(&plain.selection.null);
    let lag = estimate(plain.set, calibration, reference, &calibration.prior(), start)?;
    let is_long = lag.lag.total_s().abs() > BEYOND_FORM * lag.sd_s.hypot(form_sd_s(basis.effect_free));
    let is_effect = is_long && {
        let same = with_lag(basis.effect_free, lag.lag);
        let (prior, start) = (Calibration::before(reference), FitStart::from(&calibration.fit));
        estimate(&same, calibration, reference, &prior, start).is_some()
    };
    Some(Differing { set: with_lag(plain.set, lag.lag), lag, is_effect })
}

/// What is reported of a lag.
///
/// * `before`: the lag that the set had already
pub fn found(source: &str, estimate: &LagEstimate, before: Lag) -> InstrumentLag {
    let delay_s = before.delay_s + estimate.lag.delay_s;
    let time_constant_s = before.time_constant_s + estimate.lag.time_constant_s;
    let (lag_s, half_s) = (delay_s + time_constant_s, NORMAL_95 * estimate.sd_s);
    InstrumentLag {
        source: source.into(),
        lag_s,
        ci95_s: [lag_s - half_s, lag_s + half_s],
        delay_s,
        time_constant_s,
        gain_2ll: estimate.gain_2ll,
    }
}

/// The effect by which the measured runs differ from the calibration.
///
/// * `without`, `with`: the decisions of the measured runs with the calibration's lag and with their own
pub fn effect(differing: &Differing, without: &Decision<'_>, with: &Decision<'_>) -> EffectFound {
    let estimate = &differing.lag;
    let half_s = NORMAL_95 * estimate.sd_s;
    let lag_s = estimate.lag.total_s();
    let (rows, before) = of_readings(without);
    let (_, after) = of_readings(with);
    let p_model = (-minus_ln_p(estimate.gain_2ll, 2)).exp();
    EffectFound {
        law: FORCE_LAG.into(),
        family: FORCE_LAG.into(),
        formula: "reading(t) = force(t − lag_s)".into(),
        parameters: vec![FittedParameter {
            name: "lag_s".into(),
            value: lag_s,
            unit: "s".into(),
            ci95: [lag_s - half_s, lag_s + half_s],
        }],
        size_p90_relative: size_p90(&rows, &before, &after),
        gain_2ll: estimate.gain_2ll,
        p: p_model,
        p_model,
        p_runs: 1.0,
        against_calibration: true,
        outside_calibration: false,
        lambda_detect: estimate.gain_2ll,
        candidates: vec![CandidateLaw {
            law: FORCE_LAG.into(),
            family: FORCE_LAG.into(),
            delta_2ll: 0.0,
            lambda_rival: 0.0,
        }],
        own: None,
    }
}

/// The rows with readings, those that a set has with every lag, and their predictions without a law.
fn of_readings(decision: &Decision<'_>) -> (RunSet, Vec<f64>) {
    let null = &decision.selection.null;
    let prediction_n = decision.task.predict(&null.parameters, &null.laws);
    let mut out = decision.set.clone();
    let mut kept = Vec::new();
    let mut predicted = prediction_n.chunks_exact(3);
    for run in &mut out.runs {
        let is_read: Vec<bool> = run.force_n.iter().map(|f| f.iter().any(|f| f.is_finite())).collect();
        let mut read = is_read.iter().copied();
        run.rows.retain(|_| read.next() == Some(true));
        kept.extend(is_read.iter().zip(predicted.by_ref()).filter(|(read, _)| **read).flat_map(|(_, p)| p));
    }
    (out, kept)
}
