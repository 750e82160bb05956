//! Every candidate alone and in pairs, checked by the finite elements, each depth left out in turn.
//!
//! Main function: [`search`].

use super::TableError;
use super::finite_elements::FiniteElements;
use super::fit::{Fitted, Model, Task, rms_percent};
use super::measured::MeasuredTable;
use super::parameters::{Effect, Values};
use super::reading::{Elastic, Surface, place_of, predict};
use super::surface::{Corrected, FittedSurface};
use super::verdict::APART;

/// Rounds in which a fit and the finite elements at its end settle.
const CHECK_ROUNDS: usize = 3;
/// Change of a correction (of a logarithm) below which they have.
const SETTLED: f64 = 0.003;
/// Pairs that are checked by the finite elements: the best by the regression surface.
const CHECKED_PAIRS: usize = 6;
/// Excess of a pair's cost beyond which it is not checked.
const FAR: f64 = 12.0;

/// A model, fitted.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The fit beside the constants of the finger.
    pub fitted: Fitted,
    /// Root mean square difference where the effects alone move, %.
    pub alone_rms_percent: f64,
    /// Root mean square error at depths left out and predicted, %; `None` if too little is left to fit.
    pub left_out_rms_percent: Option<f64>,
    /// Whether the numbers are those of finite elements at the fit's end, not of the surface.
    pub checked: bool,
}

/// The finite elements at the ends of the fits, if there are any; tests have surfaces only.
pub type Check<'c> = dyn FnMut(&Values) -> Result<Option<Vec<Elastic>>, TableError> + 'c;

/// Inputs of the search.
pub struct Search<'a> {
    /// Table, start, prior.
    pub task: Task<'a>,
    /// The regression.
    pub surface: &'a dyn Surface,
    /// Effects that can be tested.
    pub effects: Vec<Effect>,
}

/// Effects that the table and the finger allow to test, and why others are not.
pub fn testable(table: &MeasuredTable, surface: &FittedSurface) -> (Vec<Effect>, Vec<(Effect, String)>) {
    let mut no = Vec::new();
    let (force, friction) = (table.has(0), table.has(2));
    for effect in Effect::ALL {
        let lacking = match effect {
            Effect::NormalForceZero | Effect::Adhesion if !force && !friction => "no column of forces",
            Effect::SensorTilt | Effect::Tau0 | Effect::Exponent if !friction => "no column friction_coefficient",
            Effect::TissueStiffness | Effect::StrainStiffening if !force => "no column normal_force_n",
            Effect::Geometry if !surface.has_bone_terms() => {
                "the finger's geometry has no bone clearance that can be varied"
            }
            _ => continue,
        };
        no.push((effect, lacking.to_owned()));
    }
    (Effect::ALL.into_iter().filter(|e| no.iter().all(|(n, _)| n != e)).collect(), no)
}

impl Search<'_> {
    /// The finger's constants alone, then every effect, then every pair, in the order of [`Effect::ALL`].
    ///
    /// # Errors
    /// [`TableError`].
    pub fn run(&self, check: &mut Check) -> Result<Vec<Candidate>, TableError> {
        let effects: Vec<Effect> = self.effects.clone();
        let mut models = vec![vec![]];
        models.extend(effects.iter().map(|e| vec![*e]));
        for (i, a) in effects.iter().enumerate() {
            models.extend(effects[i + 1..].iter().map(|b| vec![*a, *b]));
        }
        let mut out: Vec<Candidate> = Vec::new();
        for effects in &models {
            out.push(self.candidate(effects, self.surface, false)?);
        }
        for k in self.to_check(&out) {
            out[k] = self.checked(&models[k], check)?;
        }
        Ok(out)
    }

    /// All without a pair; the best pairs that hold no effect which explains as much by itself; and the best effect with
    /// errors of single depths, which no table is free of.
    fn to_check(&self, candidates: &[Candidate]) -> Vec<usize> {
        let cost = |k: &usize| candidates[*k].fitted.cost;
        let effects = |k: &usize| &candidates[*k].fitted.model.effects;
        let least = (0..candidates.len()).map(|k| cost(&k)).fold(f64::INFINITY, f64::min);
        let singles: Vec<usize> = (0..candidates.len()).filter(|k| effects(k).len() < 2).collect();
        let near = |e: &Effect| singles.iter().any(|k| effects(k) == &[*e] && cost(k) < least + APART);
        // A constant in a pair adds no freedom, because the constants are fitted anyway.
        let own = |k: &usize| effects(k).len() == 2 && !effects(k).iter().any(|e| e.is_constant() || near(e));
        let mut pairs: Vec<usize> = (0..candidates.len()).filter(|k| own(k) && cost(k) < least + FAR).collect();
        pairs.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        pairs.truncate(CHECKED_PAIRS);
        let free = singles.iter().filter(|k| effects(k).iter().any(|e| !e.is_constant() && *e != Effect::DepthErrors));
        let best = free.min_by(|a, b| cost(a).total_cmp(&cost(b))).map(|k| effects(k)[0]);
        let with_depths = |k: &usize| {
            effects(k).len() == 2
                && best.is_some_and(|b| effects(k).contains(&b) && effects(k).contains(&Effect::DepthErrors))
        };
        let mut out = singles;
        out.extend(pairs);
        out.extend((0..candidates.len()).filter(with_depths));
        out
    }

    /// A model on a surface.
    fn candidate(&self, effects: &[Effect], surface: &dyn Surface, checked: bool) -> Result<Candidate, TableError> {
        let model = Model::beside_constants(effects);
        let fitted = self.task.fit(surface, &model)?;
        let alone = self.task.fit_from(surface, &Model::alone(effects), self.task.start.clone())?;
        let left_out_rms_percent = self.leave_out(surface, &model, &fitted.values)?;
        Ok(Candidate { fitted, alone_rms_percent: alone.rms_percent, left_out_rms_percent, checked })
    }

    /// A model whose fit and the finite elements at its end agree.
    fn checked(&self, effects: &[Effect], check: &mut Check) -> Result<Candidate, TableError> {
        let model = Model::beside_constants(effects);
        let depths = &self.task.table.depths_mm;
        let mut shift = vec![[0.0; 3]; depths.len()];
        let mut at = depths.clone();
        let mut settled = false;
        for _ in 0..CHECK_ROUNDS {
            let surface = Corrected { surface: self.surface, depths_mm: at.clone(), shift: shift.clone() };
            let fitted = self.task.fit(&surface, &model)?;
            let Some(exact) = check(&fitted.values)? else { break };
            let places: Vec<_> = (0..depths.len()).map(|k| place_of(&fitted.values, depths[k], k).0).collect();
            at = places.iter().map(|p| p.depth_mm).collect();
            let mut moved: f64 = 0.0;
            for (k, place) in places.iter().enumerate() {
                let plain = self.surface.at(place);
                let (a, b) = (exact[k], plain);
                let new = [a.normal_n / b.normal_n, a.area_mm2 / b.area_mm2, a.friction_n / b.friction_n].map(f64::ln);
                (0..3).for_each(|q| moved = moved.max((new[q] - shift[k][q]).abs()));
                shift[k] = new;
            }
            settled = true;
            if moved < SETTLED {
                break;
            }
        }
        self.candidate(effects, &Corrected { surface: self.surface, depths_mm: at, shift }, settled)
    }

    /// Fits without each depth in turn and predicts it.
    fn leave_out(&self, surface: &dyn Surface, model: &Model, from: &Values) -> Result<Option<f64>, TableError> {
        let table = self.task.table;
        let mut sum = 0.0;
        for slot in 0..table.depths_mm.len() {
            let part = self.task.without(slot);
            if part.numbers.len() < model.free(table.depths_mm.len()).len().min(4) {
                return Ok(None);
            }
            let fitted = part.fit_from(surface, model, from.clone())?;
            // An error of this depth alone cannot be estimated from the others; its prior sets it to zero.
            let readings = predict(surface, &fitted.values, &table.depths_mm);
            let own: Vec<_> = self.task.numbers.iter().copied().filter(|m| m.slot == slot).collect();
            sum += rms_percent(&own, &readings).powi(2) * own.len() as f64;
        }
        Ok(Some((sum / self.task.numbers.len() as f64).sqrt()))
    }
}

/// The finite elements at the values of a fit; `None` if one of the slides is not found.
///
/// # Errors
/// [`TableError`].
pub fn exact(fe: &mut FiniteElements, depths_mm: &[f64], values: &Values) -> Result<Option<Vec<Elastic>>, TableError> {
    let places: Vec<_> = (0..depths_mm.len()).map(|k| place_of(values, depths_mm[k], k).0).collect();
    if places.iter().any(|p| p.depth_mm > fe.deepest_mm || !(p.depth_mm > 0.1)) {
        return Ok(None);
    }
    // Strain stiffening gives each depth a law of its own on the unscaled finger.
    Ok(fe.at(0, &places)?.into_iter().collect())
}
