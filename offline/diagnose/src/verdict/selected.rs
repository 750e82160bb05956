//! The decision that stands: that of the measured runs as they are, or with a lag of their own.
//!
//! Main type: [`Selected`]; main function: [`Basis::select`].

use crate::data::runs::RunSet;
use crate::schema::{EffectFound, Verdict};
use crate::statistics::fit::Fit;
use crate::statistics::tails::LEAST_GAIN;
use crate::verdict::basis::Basis;
use crate::verdict::decision::Decision;
use crate::verdict::instrument::{self, Differing};

/// What the measured runs miss.
pub struct Selected<'d, 'a> {
    /// The decision that stands.
    pub decision: &'d Decision<'a>,
    /// The decision before any effect, a lag of their own among the effects.
    pub before: &'d Decision<'a>,
    /// The lag of their own with which the runs were decided.
    pub lagging: Option<&'d Differing>,
    /// The same where it is an effect.
    pub lag_effect: Option<&'d Differing>,
    /// The verdict, a lag that is an effect among its names.
    pub verdict: Verdict,
}

impl<'d, 'a> Selected<'d, 'a> {
    /// Chooses between the decision of the measured runs as they are and that with a lag of their own.
    fn new(plain: &'d Decision<'a>, with_own_lag: Option<&'d (&'d Differing, Decision<'a>)>) -> Self {
        let (decision, lagging) = match with_own_lag {
            Some((differing, with)) if explains_more(with, plain) => (with, Some(*differing)),
            _ => (plain, None),
        };
        let lag_effect = lagging.filter(|differing| differing.is_effect);
        let before = if lag_effect.is_some() { plain } else { decision };
        let verdict = match decision.verdict {
            Verdict::None if lag_effect.is_some() => Verdict::Named,
            other => other,
        };
        Self { decision, before, lagging, lag_effect, verdict }
    }

    /// The fit with the laws that `verdict` claims.
    pub fn fit(&self, verdict: Verdict) -> &'d Fit {
        let selection = &self.decision.selection;
        if verdict.is_claim() { &selection.fit } else { &selection.null }
    }

    /// The lag as an effect.
    pub fn lag(&self) -> Option<EffectFound> {
        self.lag_effect.map(|differing| instrument::effect(differing, self.before, self.decision))
    }
}

impl Basis<'_> {
    /// Decides a set, with a lag of its own where it has one, and hands the result to `then`.
    pub fn select<T>(&self, set: &RunSet, then: impl FnOnce(&Selected<'_, '_>) -> T) -> T {
        let plain = self.decide(set);
        let differing = instrument::differing(&plain, self);
        let with_own_lag = differing.as_ref().map(|differing| (differing, self.decide(&differing.set)));
        then(&Selected::new(&plain, with_own_lag.as_ref()))
    }
}

/// Whether a lag of the measured runs explains them better than the laws that were found without it.
fn explains_more(with_lag: &Decision<'_>, without: &Decision<'_>) -> bool {
    let [with, without] = [with_lag, without].map(|d| d.task.minus_2ll_of_readings(&d.selection.fit));
    with + LEAST_GAIN < without
}
