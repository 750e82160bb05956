//! The same decision for other readings or fewer runs of one protocol; the calibration is kept.
//!
//! Main types: [`Redecision`], [`Outcome`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::runs::RunSet;
use crate::model::prior::Drift;
use crate::report::evidence::Evidence;
use crate::schema::Verdict;
use crate::selection::acceptance::SelectionSettings;
use crate::verdict::basis::Basis;
use crate::verdict::decision::families;
use crate::verdict::instrument::FORCE_LAG;
use crate::verdict::selected::Selected;

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

/// Protocol and basis of a diagnosis, with which further sets are decided.
pub struct Redecision<'a> {
    /// The measured runs, with columns corrected and the calibration's lag.
    pub set: &'a RunSet,
    /// What they were decided on.
    pub basis: Basis<'a>,
}

impl<'a> Redecision<'a> {
    /// After a diagnosis with these curves and settings.
    pub fn new(evidence: &'a Evidence, reference: &'a ReferenceCurves, settings: &'a SelectionSettings) -> Self {
        let calibration = evidence.calibration.drifting(Drift::Small);
        let basis = Basis::new(&evidence.calibration_set, reference, calibration, &evidence.corrections, settings);
        Self { set: &evidence.decided_set, basis }
    }

    /// Decides a set of this protocol.
    pub fn outcome(&self, set: &RunSet) -> Outcome {
        self.basis.select(set, Outcome::of)
    }
}

impl Outcome {
    fn of(selected: &Selected<'_, '_>) -> Self {
        let Selected { decision, lag_effect, verdict, .. } = *selected;
        let mut strongest: Vec<(f64, &'static str, &'static str)> = decision
            .hypotheses
            .iter()
            .map(|h| (h.gain_2ll, h.candidates[0].active.law.name, h.candidates[0].active.law.family))
            .chain(lag_effect.map(|d| (d.lag.gain_2ll, FORCE_LAG, FORCE_LAG)))
            .collect();
        strongest.sort_by(|a, b| b.0.total_cmp(&a.0));
        let tests = decision.selection.tests.iter().map(|t| t.gain_2ll).fold(0.0, f64::max);
        Self {
            verdict,
            gain_2ll: strongest.first().map_or(tests, |s| s.0),
            effects: if verdict.is_claim() { strongest.iter().map(|s| (s.1, s.2)).collect() } else { Vec::new() },
            candidates: decision.hypotheses.iter().flat_map(families).collect(),
        }
    }
}
