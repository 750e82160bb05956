//! The law's constants from friction coefficients: residuals, space mapping, Gauss–Newton.

use super::{
    IdentifyError, LawPoint, Region, Steady, Table,
    bounded_least_squares::{Model, Solution, Stop, Variable, minimise},
    surrogate::{AlignedSurrogate, FrictionModel, PressureSurrogate, log_slopes},
};
use fingerpad_fe::contact::RubberFriction;

/// Measured friction coefficients with their weights, and the search region of the law.
#[derive(Clone, Debug)]
pub struct Target {
    /// Measured friction coefficients.
    pub coefficients: Vec<f64>,
    /// Slot (depth) of each.
    pub slots: Vec<usize>,
    /// One over the standard error of each; all 1 if it is not known.
    pub weights: Vec<f64>,
    /// Whether `weights` are known errors.
    pub known: bool,
    /// Search region of the constants.
    pub region: Region,
    /// Whether tau_0 is searched for.
    pub free_tau0: bool,
}

impl Target {
    /// All rows of a table.
    pub fn of(table: &Table, percent: Option<f64>, region: Region, free_tau0: bool) -> Self {
        let coefficients: Vec<f64> = table.points.iter().map(|p| p.friction_coefficient).collect();
        let weight = |mu: &f64| percent.map_or(1.0, |percent| 100.0 / (percent * mu));
        Self {
            weights: coefficients.iter().map(weight).collect(),
            coefficients,
            slots: table.slot.clone(),
            known: percent.is_some(),
            region,
            free_tau0,
        }
    }

    /// Only some of the rows.
    pub fn only(&self, rows: &[usize]) -> Self {
        let take = |from: &[f64]| rows.iter().map(|&i| from[i]).collect();
        Self {
            coefficients: take(&self.coefficients),
            weights: take(&self.weights),
            slots: rows.iter().map(|&i| self.slots[i]).collect(),
            ..self.clone()
        }
    }

    /// Number of constants.
    pub fn constants(&self) -> usize {
        if self.free_tau0 { 3 } else { 2 }
    }

    /// Bounds of the coordinates.
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let mut bounds = vec![self.region.tau_ref_kpa.map(f64::ln), self.region.beta];
        if self.free_tau0 {
            bounds.push([0.0, 0.999]);
        }
        bounds
    }

    /// Weighted differences of modelled coefficients (per slot) from the measured ones.
    pub fn residuals(&self, model: &[f64]) -> Vec<f64> {
        let rows = self.coefficients.iter().zip(&self.slots).zip(&self.weights);
        rows.map(|((mu, &slot), w)| w * (model[slot] - mu)).collect()
    }

    /// Sum of their squares.
    pub fn sum_of_squares(&self, model: &[f64]) -> f64 {
        self.residuals(model).iter().map(|r| r * r).sum()
    }
}

/// Residuals over coordinates, some of which may be pinned.
pub struct LawModel<'a> {
    /// Friction coefficients of a law.
    pub friction: &'a mut dyn FrictionModel,
    /// Measured coefficients.
    pub target: &'a Target,
    /// Constants that are not searched for.
    pub fixed: LawPoint,
    /// Value of every coordinate that is held.
    pub pinned: Vec<Option<f64>>,
    /// Coordinates at which derivatives were taken last, and their columns.
    pub differentiated: Option<(Vec<f64>, Vec<Vec<f64>>)>,
}

/// Move over which derivatives are not taken again: their relative change is about as large.
const SAME_SLOPE: f64 = 1e-3;

impl LawModel<'_> {
    /// All coordinates from the free ones.
    fn coordinates(&self, x: &[f64]) -> Vec<f64> {
        let mut free = x.iter();
        self.pinned.iter().map(|p| p.unwrap_or_else(|| *free.next().expect("as many as are free"))).collect()
    }

    fn point(&self, x: &[f64]) -> LawPoint {
        self.fixed.at(&self.coordinates(x))
    }
}

impl Model for LawModel<'_> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, IdentifyError> {
        let point = self.point(x);
        Ok(self.target.residuals(&self.friction.coefficients(&point)?))
    }

    fn jacobian(&mut self, x: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError> {
        if let Some((at, columns)) = &self.differentiated
            && at.iter().zip(x).all(|(a, b)| (a - b).abs() <= SAME_SLOPE)
        {
            return Ok(columns.clone());
        }
        let point = self.point(x);
        let value = self.friction.coefficients(&point)?;
        let slopes = log_slopes(self.friction, &point, self.target.free_tau0)?;
        let column = |slope: &Vec<f64>| {
            let rows = self.target.slots.iter().zip(&self.target.weights);
            rows.map(|(&slot, w)| w * value[slot] * slope[slot]).collect()
        };
        let free = slopes.iter().zip(&self.pinned).filter(|(_, pinned)| pinned.is_none());
        let columns: Vec<Vec<f64>> = free.map(|(slope, _)| column(slope)).collect();
        self.differentiated = Some((x.to_vec(), columns.clone()));
        Ok(columns)
    }
}

/// Constants that fit best, from `start`.
///
/// # Errors
/// [`IdentifyError`] of the model or the fit.
pub fn fit(
    what: &str,
    friction: &mut dyn FrictionModel,
    target: &Target,
    start: &LawPoint,
    pinned: &[Option<f64>],
    stop: Stop,
) -> Result<(LawPoint, Solution), IdentifyError> {
    let x = start.coordinates(target.free_tau0);
    let pinned: Vec<Option<f64>> = (0..x.len()).map(|k| pinned.get(k).copied().flatten()).collect();
    let bounds = target.bounds();
    let variables: Vec<Variable> =
        (0..x.len()).filter(|&k| pinned[k].is_none()).map(|k| Variable { value: x[k], bounds: bounds[k] }).collect();
    let mut model = LawModel { friction, target, fixed: *start, pinned, differentiated: None };
    if variables.is_empty() {
        let residuals = model.residuals(&[])?;
        let solution = Solution { values: vec![], residuals, jacobian: vec![], evaluations: 1, ended: "pinned".into() };
        return Ok((model.point(&[]), solution));
    }
    let solution = minimise(what, &mut model, &variables, stop)?;
    Ok((model.point(&solution.values), solution))
}

/// Residuals and derivatives at `law`, as the solution of a fit that ended there.
///
/// # Errors
/// [`IdentifyError`] of the model.
pub fn solution_at(
    friction: &mut dyn FrictionModel,
    target: &Target,
    law: &LawPoint,
    ended: String,
    evaluations: usize,
) -> Result<Solution, IdentifyError> {
    let values = law.coordinates(target.free_tau0);
    let pinned = vec![None; values.len()];
    let mut model = LawModel { friction, target, fixed: *law, pinned, differentiated: None };
    let (residuals, jacobian) = (model.residuals(&values)?, model.jacobian(&values)?);
    Ok(Solution { values, residuals, jacobian, evaluations, ended })
}

/// One step of the space mapping.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Mapping {
    /// Constants at which the finite elements were evaluated.
    pub law: LawPoint,
    /// Sum of squares there.
    pub sum_of_squares: f64,
}

/// Gives steady states of all slots at a law.
pub type States<'s> = dyn FnMut(&LawPoint) -> Result<Vec<Steady>, IdentifyError> + 's;

/// Longest step of the space mapping in any coordinate.
const LONGEST: f64 = 0.4;

/// Space mapping: fits the law over the pressure of the last finite-element states until they are those of the law.
///
/// The pressure of one law predicts the coefficients of the next one with an error, which is learned: the surrogate's slope is corrected
/// so that it joins the last two finite-element states [Broyden 1965; Bandler et al. 1995, aggressive space mapping].
///
/// # Errors
/// [`IdentifyError`] of the finite elements at the start, or of a fit.
pub fn space_mapping(
    states: &mut States,
    base: RubberFriction,
    target: &Target,
    start: &LawPoint,
    tolerance: f64,
    most: usize,
) -> Result<(Vec<Mapping>, Vec<Steady>), IdentifyError> {
    let mut law = *start;
    let mut found = states(&law)?;
    let mut path = Vec::new();
    let mut correction = vec![vec![0.0; found.len()]; target.constants()];
    loop {
        let coefficients: Vec<f64> = found.iter().map(Steady::friction_coefficient).collect();
        path.push(Mapping { law, sum_of_squares: target.sum_of_squares(&coefficients) });
        if path.len() > most {
            return Ok((path, found));
        }
        let mut mapped = AlignedSurrogate::corrected(&found, base, law, correction.clone());
        let stop = Stop { tolerance: 1e-10, evaluations: 200 };
        let (mut next, _) = fit("space mapping", &mut mapped, target, &law, &[], stop)?;
        let x = law.coordinates(target.free_tau0);
        let moved = |next: &LawPoint| {
            let y = next.coordinates(target.free_tau0);
            x.iter().zip(&y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        if moved(&next) < tolerance {
            return Ok((path, found));
        }
        // The pressure of one law is no estimate for a far one.
        let share = LONGEST / moved(&next);
        if share < 1.0 {
            let y = next.coordinates(target.free_tau0);
            next = next.at(&x.iter().zip(&y).map(|(a, b)| a + share * (b - a)).collect::<Vec<_>>());
        }
        // If the finite elements find no slide, half of the step.
        loop {
            match states(&next) {
                Ok(states) => {
                    correct(&mut correction, base, (&law, &found), (&next, &states))?;
                    found = states;
                    law = next;
                    break;
                }
                Err(error) if error.is_local() && moved(&next) > tolerance => {
                    let y = next.coordinates(target.free_tau0);
                    next = next.at(&x.iter().zip(&y).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<_>>());
                }
                Err(error) => return Err(error),
            }
        }
    }
}

/// Broyden's update of the slopes' correction, so that the surrogate over the states `to` has the value of `from`.
fn correct(
    correction: &mut [Vec<f64>],
    base: RubberFriction,
    from: (&LawPoint, &[Steady]),
    to: (&LawPoint, &[Steady]),
) -> Result<(), IdentifyError> {
    let mut over = PressureSurrogate { states: to.1, base };
    let (own_from, own_to) = (over.coefficients(from.0)?, over.coefficients(to.0)?);
    let free_tau0 = correction.len() > 2;
    let (x, y) = (from.0.coordinates(free_tau0), to.0.coordinates(free_tau0));
    let moved: Vec<f64> = x.iter().zip(&y).map(|(x, y)| y - x).collect();
    let length: f64 = moved.iter().map(|d| d * d).sum();
    for (depth, (a, b)) in from.1.iter().zip(to.1).enumerate() {
        let exact = (b.friction_coefficient() / a.friction_coefficient()).ln();
        let predicted = (own_to[depth] / own_from[depth]).ln();
        let known: f64 = correction.iter().zip(&moved).map(|(c, d)| c[depth] * d).sum();
        for (c, d) in correction.iter_mut().zip(&moved) {
            c[depth] += (exact - predicted - known) * d / length;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States whose pressure grows with friction, as a finger's does.
    fn states_at(law: &LawPoint) -> Vec<Steady> {
        let friction = law.friction(&RubberFriction::default());
        [0.0025, 0.0035, 0.005, 0.006]
            .iter()
            .map(|p0| {
                let p = p0 * (1.0 + 0.02 * law.tau_ref_kpa + 0.05 * law.beta);
                let pressure: Vec<[f64; 2]> = (1..=5).map(|i| [p * 0.4 * f64::from(i), 10.0]).collect();
                let mut state = Steady {
                    normal_force_n: pressure.iter().map(|[p, a]| p * a).sum(),
                    pressure,
                    ..Default::default()
                };
                state.friction_x_n = state.friction_limit_n(&friction);
                state
            })
            .collect()
    }

    #[test]
    fn space_mapping_recovers_planted_constants_in_few_evaluations() {
        let planted = LawPoint { tau_ref_kpa: 7.5, beta: 0.46, tau0_share: 0.0 };
        let target = Target {
            coefficients: states_at(&planted).iter().map(Steady::friction_coefficient).collect(),
            slots: vec![0, 1, 2, 3],
            weights: vec![1.0; 4],
            known: false,
            region: Region::default(),
            free_tau0: false,
        };
        let start = LawPoint { tau_ref_kpa: 5.0, beta: 0.1, tau0_share: 0.0 };
        let mut states = |law: &LawPoint| Ok(states_at(law));
        let (path, _) = space_mapping(&mut states, RubberFriction::default(), &target, &start, 1e-6, 20).unwrap();
        let end = path.last().unwrap().law;
        assert!((end.tau_ref_kpa / 7.5 - 1.0).abs() < 1e-4 && (end.beta - 0.46).abs() < 1e-4, "{path:?}");
        assert!(path.len() < 9, "{}", path.len());
    }
}
