//! The verdict: the candidates that explain the table, and whether it can distinguish them.
//!
//! Main type: [`Answer`].

use fingerpad_diagnose::Verdict;

use super::measured::MeasuredTable;
use super::search::Candidate;

/// Difference of costs (−2 log evidence) up to which two explanations cannot be distinguished: odds of 20 to 1.
pub const APART: f64 = 6.0;
/// Gain over the finger's constants alone that the best explanation needs before any is reported, and the gain for
/// naming a single one.
const GAIN: f64 = 8.0;
/// Probability of the misfit under the stated errors below which nothing explains the table.
const MISFIT: f64 = 1e-3;
/// Factor on assumed errors beyond which nothing explains the table: cells off by 12 %.
const ASSUMED_NOISE: f64 = 2.4;

/// The verdict on the candidates.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// Index of the best model among the candidates; the constants alone if no effect is claimed.
    pub best: usize,
    /// Indices of the models that the table cannot distinguish from the best one, which is the first.
    pub contenders: Vec<usize>,
}

impl Answer {
    /// Weighs the candidates, of which the first is the one without effects.
    pub fn of(table: &MeasuredTable, candidates: &[Candidate]) -> Self {
        let cost = |k: usize| candidates[k].fitted.cost;
        let effects = |k: usize| &candidates[k].fitted.model.effects;
        // A constant of the finger is in every model; with others its name adds nothing.
        let judged: Vec<usize> =
            (0..candidates.len()).filter(|&k| !effects(k).iter().any(|e| e.is_constant())).collect();
        let top = judged.iter().map(|&k| cost(k)).fold(f64::INFINITY, f64::min);
        let near: Vec<usize> = judged.iter().copied().filter(|&k| cost(k) < top + APART).collect();
        // Of two explanations one of which holds the other, the smaller one suffices.
        let within = |a: usize, b: usize| {
            effects(a).len() < effects(b).len() && effects(a).iter().all(|e| effects(b).contains(e))
        };
        let mut contenders: Vec<usize> =
            near.iter().copied().filter(|&k| !near.iter().any(|&other| within(other, k))).collect();
        // The fewest effects first.
        contenders.sort_by(|a, b| effects(*a).len().cmp(&effects(*b).len()).then(cost(*a).total_cmp(&cost(*b))));
        let best = contenders[0];
        let verdict = if misfits(table, &candidates[best]) {
            Verdict::UnexplainedStructure
        } else if effects(best).is_empty() || cost(0) - top < GAIN {
            Verdict::None
        } else if contenders.len() == 1 && cost(0) - cost(best) >= GAIN {
            Verdict::Named
        } else {
            Verdict::Ambiguous
        };
        match verdict {
            Verdict::None => Self { verdict, best: 0, contenders: vec![0] },
            _ => Self { verdict, best, contenders },
        }
    }
}

/// Whether the residual of a model exceeds the errors.
fn misfits(table: &MeasuredTable, candidate: &Candidate) -> bool {
    if table.has_spread() { candidate.fitted.p_misfit < MISFIT } else { candidate.fitted.noise > ASSUMED_NOISE }
}
