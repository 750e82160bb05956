//! The same decision for other readings or fewer runs of one protocol; the calibration is kept.
//!
//! Main types: [`Redecision`], [`Outcome`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::runs::RunSet;
use crate::model::prior::Drift;
use crate::schema::Verdict;
use crate::selection::acceptance::SelectionSettings;
use crate::statistics::calibration::Calibration;
use crate::verdict::decision::{decide, families};
use crate::verdict::evidence::Evidence;
use crate::verdict::instrument::{self, FORCE_LAG};

/// What a decision says, without its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The verdict.
    pub verdict: Verdict,
    /// Law and family of each effect, strongest first.
    pub effects: Vec<(&'static str, &'static str)>,
    /// Families of all candidates.
    pub candidates: Vec<&'static str>,
    /// Gain of the strongest law in 2 log likelihood; without a law that of the strongest test.
    pub gain_2ll: f64,
}

impl Outcome {
    /// Families of the effects, sorted.
    pub fn families(&self) -> Vec<&'static str> {
        let mut list: Vec<&'static str> = self.effects.iter().map(|e| e.1).collect();
        list.sort_unstable();
        list.dedup();
        list
    }
}

/// Calibration, protocol and settings of a diagnosis, with which further sets are decided.
pub struct Redecision<'a> {
    /// The evidence of the diagnosis.
    pub evidence: &'a Evidence,
    /// Its calibration with the small drift, from which a decision starts.
    pub calibration: Calibration,
    /// Reference curves.
    pub reference: &'a ReferenceCurves,
    /// Level, seed and laws.
    pub settings: &'a SelectionSettings,
}

impl<'a> Redecision<'a> {
    /// After a diagnosis with these curves and settings.
    pub fn new(evidence: &'a Evidence, reference: &'a ReferenceCurves, settings: &'a SelectionSettings) -> Self {
        Self { evidence, calibration: evidence.calibration.drifting(Drift::Small), reference, settings }
    }

    /// The measured runs, with columns corrected and the calibration's lag.
    pub fn set(&self) -> &RunSet {
        &self.evidence.decided_set
    }

    /// Decides a set of this protocol.
    pub fn outcome(&self, set: &RunSet) -> Outcome {
        let Self { evidence, calibration, reference, settings } = self;
        let effect_free = &evidence.calibration_set;
        let decided = |set| decide(set, effect_free, reference, calibration, &evidence.corrections, settings);
        let plain = decided(set);
        let differing = instrument::differing(set, reference, calibration, &plain.selection.null);
        let with_own_lag = differing.as_ref().map(|differing| (differing, decided(&differing.set)));
        let chosen = instrument::chosen(&plain, with_own_lag.as_ref(), effect_free);
        let decision = chosen.decision;
        let mut strongest: Vec<(f64, &'static str, &'static str)> = decision
            .hypotheses
            .iter()
            .map(|h| (h.gain_2ll, h.candidates[0].active.law.name, h.candidates[0].active.law.family))
            .chain(chosen.lag_effect.map(|d| (d.lag.gain_2ll, FORCE_LAG, FORCE_LAG)))
            .collect();
        strongest.sort_by(|a, b| b.0.total_cmp(&a.0));
        let is_claimed = matches!(chosen.verdict, Verdict::Named | Verdict::Ambiguous);
        let tests = decision.selection.tests.iter().map(|t| t.gain_2ll).fold(0.0, f64::max);
        Outcome {
            verdict: chosen.verdict,
            gain_2ll: strongest.first().map_or(tests, |s| s.0),
            effects: if is_claimed { strongest.iter().map(|s| (s.1, s.2)).collect() } else { Vec::new() },
            candidates: decision.hypotheses.iter().flat_map(families).collect(),
        }
    }
}
