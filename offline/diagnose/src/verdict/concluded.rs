//! The verdict after runs that no fit saw.
//!
//! Main type: [`Concluded`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::lag::with_lag;
use crate::data::runs::{Run, RunSet};
use crate::error::DiagnoseError;
use crate::laws::find;
use crate::schema::{Caution, CrossValidationError, Verdict};
use crate::statistics::calibration::Calibration;
use crate::verdict::calibrated::Calibrated;
use crate::verdict::cross_validation::{by_folds, on_file, ratio_with_free_strength};
use crate::verdict::selected::Selected;

/// What is claimed, and how well runs that no fit saw are predicted with it.
pub struct Concluded {
    /// The verdict.
    pub verdict: Verdict,
    /// Whether names were taken back for the gap that they leave.
    pub taken_back: bool,
    /// The errors of prediction.
    pub holdout: CrossValidationError,
    /// The held-out runs, cleaned and corrected; without them every fifth measured run was left out in turn.
    pub held_out: Option<RunSet>,
    /// The calibration with the drift that was decided on.
    pub calibration: Calibration,
}

impl Concluded {
    /// Predicts held-out runs, and takes names back that leave most of the gap.
    ///
    /// # Errors
    /// [`DiagnoseError`] where too little is left of the held-out runs.
    pub fn new(
        held_out: Option<RunSet>,
        calibrated: &Calibrated,
        selected: &Selected<'_, '_>,
        reference: &ReferenceCurves,
        cautions: &mut Vec<Caution>,
    ) -> Result<Self, DiagnoseError> {
        let Selected { decision, before, lagging, lag_effect, verdict: claimed } = *selected;
        let calibration = calibrated.calibration.drifting(decision.drift);
        let variances = &decision.expected_variances;
        let (null, full, null_before) = (&decision.selection.null, selected.fit(claimed), &before.selection.null);
        let mut held_out = held_out.map(|set| calibrated.held_out(&set, reference, cautions)).transpose()?;
        // Before a lag that is an effect, the error is that without it.
        let error = match &mut held_out {
            Some(held) => {
                let without =
                    lag_effect.map(|_| on_file(held, reference, &calibration, variances, null_before, null_before));
                if let Some(differing) = lagging {
                    *held = with_lag(held, differing.lag.lag);
                }
                on_file(held, reference, &calibration, variances, null, full).instead_of(without)
            }
            None => {
                let without = lag_effect
                    .map(|_| by_folds(before.set, reference, &calibration, variances, null_before, null_before));
                by_folds(decision.set, reference, &calibration, variances, null, full).instead_of(without)
            }
        };
        let holdout = error.or_refused();
        let drift = find(DRIFT).expect("a law of the library");
        let drifts = decision.selection.accepted().iter().any(|active| active.law.family == drift.family);
        let untested =
            held_out.as_ref().filter(|held| claimed.is_claim() && drifts && !shares_clock(held, decision.set));
        let verdict = match untested {
            Some(held) if holdout.ratio_after > LARGEST_GAP => {
                bounded_by_gap(claimed, ratio_with_free_strength(held, reference, &calibration, variances, full, drift))
            }
            _ => bounded_by_gap(claimed, holdout.ratio_after),
        };
        cautions.extend(untested.map(|_| Caution {
            kind: "clock".into(),
            role: "holdout".into(),
            column: "t_s".into(),
            text: "The held-out runs cannot test what drifts over the clock: they do not lie within the session of the measured runs. The other \
                   laws were tested with level and drift of the strength left free. Hold out runs from between the measured ones."
                .into(),
        }));
        let taken_back = verdict != claimed;
        let holdout = if taken_back { holdout.without_correction() } else { holdout };
        Ok(Self { verdict, taken_back, holdout, held_out, calibration })
    }
}

/// Law of a strength that drifts evenly over the clock of a session; its family has the other laws of that.
const DRIFT: &str = "strength_drift";

/// Share of a session by which held-out runs may lie outside it.
const BEYOND: f64 = 0.1;

/// Whether held-out runs lie within the session of the measured runs. A finger makes one run at a time, so that runs at the same time are of
/// two sessions.
fn shares_clock(held: &RunSet, measured: &RunSet) -> bool {
    let spans = |set: &RunSet| -> Vec<[f64; 2]> {
        let ends = |run: &Run| [run.rows[0].t_s, run.rows[run.rows.len() - 1].t_s];
        set.runs.iter().map(ends).collect()
    };
    let (held, measured) = (spans(held), spans(measured));
    let from = measured.iter().map(|span| span[0]).fold(f64::INFINITY, f64::min);
    let to = measured.iter().map(|span| span[1]).fold(f64::NEG_INFINITY, f64::max);
    let margin = BEYOND * (to - from);
    held.iter().all(|own| {
        let at_once = |other: &[f64; 2]| own[0] < other[1] && other[0] < own[1];
        own[0] > from - margin && own[1] < to + margin && !measured.iter().any(at_once)
    })
}

/// Residual on runs that no fit saw, in noise floors, up to which the laws that were found count as the explanation.
const LARGEST_GAP: f64 = 2.0;

/// The verdict where the laws leave a gap on held-out runs: names that leave most of it are no explanation.
fn bounded_by_gap(verdict: Verdict, ratio_after: f64) -> Verdict {
    if verdict == Verdict::Named && ratio_after > LARGEST_GAP { Verdict::UnexplainedStructure } else { verdict }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_stand_beside_an_open_gap() {
        assert_eq!(bounded_by_gap(Verdict::Named, 1.9), Verdict::Named);
        assert_eq!(bounded_by_gap(Verdict::Named, 2.1), Verdict::UnexplainedStructure);
        for other in [Verdict::None, Verdict::Ambiguous, Verdict::UnexplainedStructure] {
            assert_eq!(bounded_by_gap(other, 9.0), other);
        }
    }
}
