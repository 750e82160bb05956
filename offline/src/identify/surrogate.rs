//! Friction coefficients without finite elements: a law integrated over pressures that finite elements found.

use super::{IdentifyError, LawPoint, Steady};
use crate::contact::RubberFriction;

/// Gives the friction coefficient at every depth for a law.
pub trait Friction {
    /// F/N per depth.
    ///
    /// # Errors
    /// [`IdentifyError`]; a surrogate has none.
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError>;
}

/// The law over the pressure of states at one law, normal forces taken as unchanged.
///
/// Exact at the law of the states; elsewhere it leaves out that pressure and normal force change with friction.
#[derive(Clone, Debug)]
pub struct OverPressure<'a> {
    /// States, one per depth.
    pub states: &'a [Steady],
    /// Elastic slip and regularisation of the law.
    pub base: RubberFriction,
}

impl Friction for OverPressure<'_> {
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
        let law = law.friction(&self.base);
        Ok(self.states.iter().map(|s| s.friction_limit_n(&law) / s.normal_force_n).collect())
    }
}

/// [`OverPressure`], corrected so that value and slope at one law are those of the finite elements.
#[derive(Clone, Debug)]
pub struct Aligned<'a> {
    over: OverPressure<'a>,
    at: Vec<f64>,
    /// Logarithm of finite elements over surrogate at `at`, per depth.
    shift: Vec<f64>,
    /// Its derivative over the coordinates: shape (coordinates, depths).
    slope: Vec<Vec<f64>>,
    fixed: LawPoint,
}

/// Derivatives of ln(F/N) over the coordinates, shape (coordinates, depths), by central differences.
///
/// # Errors
/// [`IdentifyError`] of the first evaluation that fails.
pub fn log_slopes(model: &mut dyn Friction, at: &LawPoint, free_tau0: bool) -> Result<Vec<Vec<f64>>, IdentifyError> {
    let x = at.coordinates(free_tau0);
    (0..x.len())
        .map(|k| {
            let h = if k == 2 { 0.02 } else { 0.01 };
            let mut side = |sign: f64| {
                let mut moved = x.clone();
                moved[k] += sign * h;
                model.coefficients(&at.at(&moved))
            };
            let up = side(1.0);
            // tau_0 cannot be negative.
            let down = if k == 2 && x[k] < h { None } else { Some(side(-1.0)) };
            let local = |e: &IdentifyError| e.is_local();
            let (from, to, width) = match (down, up) {
                (Some(Ok(down)), Ok(up)) => (down, up, 2.0 * h),
                // One side has no slide: the other one with the middle.
                (Some(Ok(down)), Err(error)) if local(&error) => (down, side(0.0)?, h),
                (None, Ok(up)) => (side(0.0)?, up, h),
                (Some(Err(error)), Ok(up)) if local(&error) => (side(0.0)?, up, h),
                (Some(Err(error)), _) | (_, Err(error)) => return Err(error),
            };
            Ok(from.iter().zip(&to).map(|(a, b)| (b / a).ln() / width).collect())
        })
        .collect()
}

impl<'a> Aligned<'a> {
    /// Aligned at `at`.
    ///
    /// * `states`: finite-element states there
    /// * `slopes`: their derivatives of ln(F/N), from [`log_slopes`]
    pub fn new(states: &'a [Steady], base: RubberFriction, at: LawPoint, slopes: &[Vec<f64>]) -> Self {
        let mut over = OverPressure { states, base };
        let free_tau0 = slopes.len() > 2;
        let own = log_slopes(&mut over, &at, free_tau0).expect("a surrogate does not fail");
        let value = over.coefficients(&at).expect("a surrogate does not fail");
        Self {
            at: at.coordinates(free_tau0),
            shift: states.iter().zip(value).map(|(s, v)| (s.friction_coefficient() / v).ln()).collect(),
            slope: slopes.iter().zip(own).map(|(fe, own)| fe.iter().zip(own).map(|(a, b)| a - b).collect()).collect(),
            fixed: at,
            over,
        }
    }
}

impl Friction for Aligned<'_> {
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
        let law = if self.at.len() > 2 { *law } else { LawPoint { tau0_share: self.fixed.tau0_share, ..*law } };
        let mut out = self.over.coefficients(&law)?;
        let x = law.coordinates(self.at.len() > 2);
        for (depth, value) in out.iter_mut().enumerate() {
            let linear: f64 = (0..x.len()).map(|k| self.slope[k][depth] * (x[k] - self.at[k])).sum();
            *value *= (self.shift[depth] + linear).exp();
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stands for finite elements: pressure and normal force that change with the law.
    struct Coupled(Vec<Steady>);

    impl Friction for Coupled {
        fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
            let mut over = OverPressure { states: &self.0, base: RubberFriction::default() };
            Ok(over.coefficients(law)?.iter().map(|mu| mu / (1.0 + 0.1 * mu)).collect())
        }
    }

    #[test]
    fn alignment_takes_value_and_slope() {
        let state = |p: f64, n: f64| Steady {
            normal_force_n: n,
            pressure: vec![[p, 0.6 * n / p], [0.5 * p, 0.8 * n / p]],
            ..Default::default()
        };
        let mut coupled = Coupled(vec![state(0.003, 0.1), state(0.006, 0.5)]);
        let at = LawPoint { tau_ref_kpa: 7.0, beta: 0.4, tau0_share: 0.0 };
        let slopes = log_slopes(&mut coupled, &at, false).unwrap();
        let mut states = coupled.0.clone();
        for (state, mu) in states.iter_mut().zip(coupled.coefficients(&at).unwrap()) {
            state.friction_x_n = mu * state.normal_force_n;
        }
        let mut aligned = Aligned::new(&states, RubberFriction::default(), at, &slopes);
        let near = LawPoint { tau_ref_kpa: 7.1, beta: 0.43, ..at };
        for (a, b) in aligned.coefficients(&near).unwrap().iter().zip(coupled.coefficients(&near).unwrap()) {
            assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        }
        let mut plain = OverPressure { states: &states, base: RubberFriction::default() };
        let apart = plain.coefficients(&near).unwrap()[0] / coupled.coefficients(&near).unwrap()[0] - 1.0;
        assert!(apart.abs() > 1e-3);
    }
}
