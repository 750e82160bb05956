//! Every candidate alone and in pairs, checked by the finite elements, each depth left out in turn; and the verdict.
//!
//! Main type: [`Candidate`]; main functions: [`search`], [`weigh`].

use fingerpad_diagnose::{INDISTINGUISHABLE, STRUCTURE_P, Verdict};
use serde::Serialize;

use super::effects::{Effect, Values};
use super::fit::{Fitted, Task, rms_percent};
use super::measured::MeasuredTable;
use super::reading::Elastic;
use crate::IdentifyError;

/// Rounds in which a fit and the finite elements at its end settle.
const CHECK_ROUNDS: usize = 3;
/// Change of a correction (of a logarithm) below which they have.
const SETTLED: f64 = 0.003;
/// Pairs that are checked by the finite elements: the best by the regression surface.
const CHECKED_PAIRS: usize = 6;
/// Excess of a pair's cost beyond which it is not checked.
const FAR: f64 = 12.0;

/// Effects beside the finger's constants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Name; of a pair both names joined by `+`, of the finger's constants alone `constants`.
    pub name: String,
    /// The fit beside the constants of the finger.
    #[serde(flatten)]
    pub fitted: Fitted,
    /// Root mean square gap with the effects free and the finger as calibrated, %.
    pub alone_rms_percent: f64,
    /// Root mean square error at depths that were left out and predicted, %; none if too little is left to fit.
    pub left_out_rms_percent: Option<f64>,
    /// −2 log evidence above that of the best candidate.
    pub delta_2le: f64,
    /// Names of the other candidates that explain the table as well.
    pub explains_as_much: Vec<String>,
    /// Whether the numbers are those of finite elements at the fit's end; otherwise of the regression.
    pub by_finite_elements: bool,
}

impl Candidate {
    fn has(&self, name: &str) -> bool {
        self.fitted.effects.iter().any(|e| e.name == name)
    }

    fn is_within(&self, other: &Self) -> bool {
        self.fitted.effects.len() < other.fitted.effects.len() && self.fitted.effects.iter().all(|e| other.has(e.name))
    }

    /// Whether its effects include a constant of the finger, which is in every model.
    fn names_a_constant(&self) -> bool {
        self.fitted.effects.iter().any(|e| e.is_constant())
    }
}

/// The finite elements at the values of a fit; none if a slide is not found. Tests have surfaces only.
pub type Check<'c> = dyn FnMut(&Values) -> Result<Option<Vec<Elastic>>, IdentifyError> + 'c;

/// The finger's constants alone, then every effect, then every pair, in the order of the effects.
///
/// * `effects`: those that can be tested
pub fn search(task: &Task, effects: &[&'static Effect], check: &mut Check) -> Result<Vec<Candidate>, IdentifyError> {
    let mut models = vec![vec![]];
    models.extend(effects.iter().map(|e| vec![*e]));
    models.extend((0..effects.len()).flat_map(|i| effects[i + 1..].iter().map(move |b| vec![effects[i], *b])));
    let mut out: Vec<Candidate> = models.iter().map(|model| task.candidate(model, false)).collect::<Result<_, _>>()?;
    for k in to_check(&out) {
        out[k] = checked(task.clone(), &models[k], check)?;
    }
    Ok(out)
}

/// A candidate whose fit and the finite elements at its end agree.
fn checked(mut task: Task, effects: &[&'static Effect], check: &mut Check) -> Result<Candidate, IdentifyError> {
    let mut settled = false;
    for _ in 0..CHECK_ROUNDS {
        let fitted = task.fit(effects)?;
        let Some(exact) = check(&fitted.values)? else { break };
        let next = task.shifted(&fitted.values, &exact);
        let before = |k: usize| task.shift.get(k).map_or([0.0; 3], |shift| shift.1);
        let changes = next.shift.iter().enumerate().flat_map(|(k, (_, new))| [0, 1, 2].map(|q| new[q] - before(k)[q]));
        let moved = changes.fold(0.0, |most: f64, change| most.max(change.abs()));
        (task, settled) = (next, true);
        if moved < SETTLED {
            break;
        }
    }
    task.candidate(effects, settled)
}

/// Indices of the candidates that the finite elements check: all without a pair; the best pairs that hold no effect which
/// explains as much by itself; and the best effect with errors of single depths, which no table is free of.
fn to_check(candidates: &[Candidate]) -> Vec<usize> {
    let cost = |k: &usize| candidates[*k].fitted.cost;
    let by_cost = |a: &usize, b: &usize| cost(a).total_cmp(&cost(b));
    let least = (0..candidates.len()).map(|k| cost(&k)).fold(f64::INFINITY, f64::min);
    let (singles, pairs): (Vec<usize>, Vec<usize>) =
        (0..candidates.len()).partition(|k| candidates[*k].fitted.effects.len() < 2);
    let near = |k: &&usize| cost(k) < least + INDISTINGUISHABLE;
    let suffices =
        |pair: &usize| singles[1..].iter().filter(near).any(|k| candidates[*k].is_within(&candidates[*pair]));
    // A constant in a pair adds no freedom, because the constants are fitted anyway.
    let of_interest = |k: &&usize| !candidates[**k].names_a_constant() && !suffices(k) && cost(k) < least + FAR;
    let mut checked: Vec<usize> = pairs.iter().filter(of_interest).copied().collect();
    checked.sort_by(by_cost);
    checked.truncate(CHECKED_PAIRS);
    let named =
        singles[1..].iter().filter(|k| !candidates[**k].names_a_constant() && !candidates[**k].has("depth_errors"));
    if let Some(best) = named.copied().min_by(by_cost) {
        let beside = |k: &&usize| candidates[best].is_within(&candidates[**k]) && candidates[**k].has("depth_errors");
        checked.extend(pairs.iter().filter(beside));
    }
    [singles, checked].concat()
}

impl Task<'_> {
    fn candidate(&self, effects: &[&'static Effect], by_finite_elements: bool) -> Result<Candidate, IdentifyError> {
        let fitted = self.fit(effects)?;
        let alone_rms_percent = match effects {
            [] => rms_percent(&self.numbers, &self.predict(&self.start)),
            _ => self.fit_from(effects, false, self.start.clone())?.rms_percent,
        };
        let name = effects.iter().map(|e| e.name).collect::<Vec<_>>().join("+");
        Ok(Candidate {
            name: if name.is_empty() { "constants".into() } else { name },
            alone_rms_percent,
            left_out_rms_percent: self.leave_out(&fitted)?,
            fitted,
            delta_2le: 0.0,
            explains_as_much: Vec::new(),
            by_finite_elements,
        })
    }

    /// Fits without each depth in turn and predicts it.
    fn leave_out(&self, fitted: &Fitted) -> Result<Option<f64>, IdentifyError> {
        let mut sum = 0.0;
        for slot in 0..self.table.depths_mm.len() {
            let mut part = self.clone();
            part.numbers.retain(|m| m.slot != slot);
            if part.numbers.len() < fitted.freedoms.min(4) {
                return Ok(None);
            }
            // An error of this depth alone cannot be estimated from the others; its prior sets it to zero.
            let refit = part.fit_from(&fitted.effects, true, fitted.values.clone())?;
            let own: Vec<_> = self.numbers.iter().copied().filter(|m| m.slot == slot).collect();
            sum += rms_percent(&own, &refit.readings).powi(2) * own.len() as f64;
        }
        Ok(Some((sum / self.numbers.len() as f64).sqrt()))
    }
}

/// Gain over the finger's constants alone that the best explanation needs before any is reported, and the gain for
/// naming a single one. It is an evidence, from which the number of parameters is already taken off.
const GAIN: f64 = 8.0;
/// Factor on assumed errors beyond which nothing explains the table: cells off by 12 %.
const ASSUMED_NOISE: f64 = 2.4;

/// The verdict on the candidates, of which the first is the one without effects; and the indices of those that the table
/// cannot distinguish from the best one, which is the first. Where no effect is claimed that is the one without.
pub fn weigh(table: &MeasuredTable, candidates: &[Candidate]) -> (Verdict, Vec<usize>) {
    let cost = |k: usize| candidates[k].fitted.cost;
    let judged = || (0..candidates.len()).filter(|k| !candidates[*k].names_a_constant());
    let top = judged().map(cost).fold(f64::INFINITY, f64::min);
    let near: Vec<usize> = judged().filter(|k| cost(*k) < top + INDISTINGUISHABLE).collect();
    // Of two explanations one of which holds the other, the smaller one suffices.
    let needless = |k: &usize| near.iter().any(|other| candidates[*other].is_within(&candidates[*k]));
    let mut contenders: Vec<usize> = near.iter().copied().filter(|k| !needless(k)).collect();
    // The fewest effects first.
    let effects = |k: usize| candidates[k].fitted.effects.len();
    contenders.sort_by(|a, b| effects(*a).cmp(&effects(*b)).then(cost(*a).total_cmp(&cost(*b))));
    let best = &candidates[contenders[0]].fitted;
    let left = if table.has_spread() { best.p_misfit < STRUCTURE_P } else { best.noise > ASSUMED_NOISE };
    let claimed = !best.effects.is_empty() && cost(0) - top >= GAIN;
    let verdict = Verdict::of(left, claimed, contenders.len() > 1 || cost(0) - best.cost < GAIN);
    (verdict, if verdict == Verdict::None { vec![0] } else { contenders })
}
