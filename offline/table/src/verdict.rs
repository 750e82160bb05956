//! The answer: which candidates explain the table, and whether it can tell them apart.
//!
//! Main type: [`Answer`].

use fingerpad_diagnose::Verdict;

use super::measured::MeasuredTable;
use super::parameters::Effect;
use super::search::Candidate;

/// Difference of costs (−2 log evidence) up to which two explanations cannot be told apart: odds of 20 to 1.
pub const APART: f64 = 6.0;
/// Gain that an effect must bring over the finger's constants alone.
const GAIN: f64 = 8.0;
/// Probability of the misfit under the stated errors below which nothing explains the table.
const MISFIT: f64 = 1e-3;
/// Factor on assumed errors beyond which nothing explains the table: cells off by 12 %.
const ASSUMED_NOISE: f64 = 2.4;

/// What the candidates come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// Index of the best model among the candidates; the constants alone where nothing is claimed.
    pub best: usize,
    /// Indices of the models that the table cannot tell from the best one, itself first.
    pub contenders: Vec<usize>,
}

impl Answer {
    /// Weighs the candidates, of which the first is the one without effects.
    pub fn of(table: &MeasuredTable, candidates: &[Candidate]) -> Self {
        let cost = |k: usize| candidates[k].fitted.cost;
        // A constant of the finger is in every model; with others its name adds nothing.
        let judged: Vec<usize> = (0..candidates.len())
            .filter(|&k| !candidates[k].fitted.model.effects.iter().any(|e| e.is_constant()))
            .filter(|&k| candidates[k].fitted.model.effects.len() < 2 || candidates[k].checked || !candidates[0].checked)
            .collect();
        let by_cost = |a: &usize, b: &usize| cost(*a).total_cmp(&cost(*b));
        let top = judged.iter().copied().min_by(by_cost).expect("the model without effects is among them");
        let near: Vec<usize> = judged.iter().copied().filter(|&k| cost(k) < cost(top) + APART).collect();
        // The fewest effects that explain as much.
        let size = |k: &usize| candidates[*k].fitted.model.effects.len();
        let least = near.iter().map(size).min().expect("the best is near itself");
        let mut contenders: Vec<usize> = near.iter().copied().filter(|k| size(k) == least).collect();
        contenders.sort_by(by_cost);
        let best = contenders[0];
        let unexplained = misfits(table, &candidates[best]);
        let gain = cost(0) - cost(best);
        let verdict = if unexplained {
            Verdict::UnexplainedStructure
        } else if least == 0 || gain < GAIN {
            Verdict::None
        } else if contenders.len() == 1 && shared(candidates, &near) == candidates[best].fitted.model.effects {
            Verdict::Named
        } else {
            Verdict::Ambiguous
        };
        match verdict {
            Verdict::None => Self { verdict, best: 0, contenders: vec![0] },
            _ => Self { verdict, best, contenders: if verdict == Verdict::Named { vec![best] } else { in_order(&near, best, by_cost) } },
        }
    }
}

fn in_order(near: &[usize], best: usize, by_cost: impl Fn(&usize, &usize) -> std::cmp::Ordering) -> Vec<usize> {
    let mut out: Vec<usize> = near.iter().copied().filter(|k| *k != best).collect();
    out.sort_by(by_cost);
    out.insert(0, best);
    out
}

/// Effects that every one of the models has.
fn shared(candidates: &[Candidate], models: &[usize]) -> Vec<Effect> {
    let effects = |k: usize| &candidates[k].fitted.model.effects;
    let mut out = effects(models[0]).clone();
    out.retain(|e| models.iter().all(|k| effects(*k).contains(e)));
    out
}

/// Whether a model leaves more than the errors allow.
fn misfits(table: &MeasuredTable, candidate: &Candidate) -> bool {
    if table.has_spread() { candidate.fitted.p_misfit < MISFIT } else { candidate.fitted.noise > ASSUMED_NOISE }
}
