//! Friction coefficients without finite elements: a law integrated over pressures that finite elements found.

use nalgebra::{DMatrix, DVector};

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
    /// Second-order terms of the first two coordinates per depth (11, 12, 22); none before [`Self::bend`].
    curvature: Vec<[f64; 3]>,
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
        let own = log_slopes(&mut over, &at, slopes.len() > 2).expect("a surrogate does not fail");
        let correction = slopes.iter().zip(own).map(|(fe, own)| fe.iter().zip(own).map(|(a, b)| a - b).collect());
        Self::corrected(states, base, at, correction.collect())
    }

    /// With the states' value at `at` and a correction of the slopes, shape (coordinates, depths).
    pub fn corrected(states: &'a [Steady], base: RubberFriction, at: LawPoint, slope: Vec<Vec<f64>>) -> Self {
        let mut over = OverPressure { states, base };
        let value = over.coefficients(&at).expect("a surrogate does not fail");
        Self {
            at: at.coordinates(slope.len() > 2),
            shift: states.iter().zip(value).map(|(s, v)| (s.friction_coefficient() / v).ln()).collect(),
            slope,
            curvature: Vec::new(),
            fixed: at,
            over,
        }
    }

    /// Corrects its slope and curvature so that it meets finite elements at other laws as well, by least squares.
    ///
    /// * `known`: laws with the finite elements' F/N per depth. Below five laws nothing is corrected.
    ///
    /// Returns the largest relative difference that is left at them.
    pub fn bend(&mut self, known: &[(LawPoint, Vec<f64>)]) -> f64 {
        let coordinates = |law: &LawPoint| {
            let x = law.coordinates(self.at.len() > 2);
            (0..2).map(|k| x[k] - self.at[k]).collect::<Vec<f64>>()
        };
        let terms: Vec<[f64; 5]> = known
            .iter()
            .map(|(law, _)| coordinates(law))
            .map(|d| [d[0], d[1], d[0] * d[0], d[0] * d[1], d[1] * d[1]])
            .collect();
        let differences: Vec<Vec<f64>> = known
            .iter()
            .map(|(law, exact)| {
                let told = self.coefficients(law).expect("a surrogate does not fail");
                exact.iter().zip(told).map(|(a, b)| (a / b).ln()).collect()
            })
            .collect();
        let worst = |left: &dyn Fn(usize, usize) -> f64| {
            let all = (0..known.len()).flat_map(|i| (0..self.shift.len()).map(move |depth| (i, depth)));
            all.map(|(i, depth)| left(i, depth).abs()).fold(0.0, f64::max)
        };
        if known.len() < 5 {
            return worst(&|i, depth| differences[i][depth]);
        }
        let matrix = DMatrix::from_fn(known.len(), 5, |i, k| terms[i][k]);
        let svd = matrix.clone().svd(true, true);
        let fits: Vec<DVector<f64>> = (0..self.shift.len())
            .map(|depth| {
                let wanted = DVector::from_iterator(known.len(), differences.iter().map(|row| row[depth]));
                svd.solve(&wanted, 1e-9).expect("both factors were asked for")
            })
            .collect();
        let left = worst(&|i, depth| differences[i][depth] - (matrix.row(i) * &fits[depth])[0]);
        self.curvature.resize(self.shift.len(), [0.0; 3]);
        for (depth, fit) in fits.iter().enumerate() {
            for k in 0..2 {
                self.slope[k][depth] += fit[k];
            }
            for k in 0..3 {
                self.curvature[depth][k] += fit[2 + k];
            }
        }
        left
    }
}

impl Friction for Aligned<'_> {
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
        let law = if self.at.len() > 2 { *law } else { LawPoint { tau0_share: self.fixed.tau0_share, ..*law } };
        let mut out = self.over.coefficients(&law)?;
        let x = law.coordinates(self.at.len() > 2);
        let d: Vec<f64> = x.iter().zip(&self.at).map(|(x, at)| x - at).collect();
        for (depth, value) in out.iter_mut().enumerate() {
            let linear: f64 = d.iter().zip(&self.slope).map(|(d, slope)| slope[depth] * d).sum();
            let [a, b, c] = self.curvature.get(depth).copied().unwrap_or_default();
            *value *= (self.shift[depth] + linear + a * d[0] * d[0] + b * d[0] * d[1] + c * d[1] * d[1]).exp();
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
        // Known at a ring of laws around, it is right between and a little beyond them as well.
        let known: Vec<_> = (0..8)
            .map(|i| {
                let (s, c) = (0.785 * f64::from(i)).sin_cos();
                let law = at.at(&[at.tau_ref_kpa.ln() + 0.2 * c, at.beta + 0.3 * s]);
                (law, coupled.coefficients(&law).unwrap())
            })
            .collect();
        let far = at.at(&[at.tau_ref_kpa.ln() - 0.1, at.beta + 0.25]);
        let apart = |aligned: &mut Aligned, coupled: &mut Coupled| {
            let (a, b) = (aligned.coefficients(&far).unwrap()[1], coupled.coefficients(&far).unwrap()[1]);
            (a / b - 1.0).abs()
        };
        let before = apart(&mut aligned, &mut coupled);
        assert!(aligned.bend(&known) < 1e-3);
        assert!(apart(&mut aligned, &mut coupled) < 0.3 * before, "{before}");
        assert!(aligned.bend(&known[..4]) < 1e-3);

        let mut plain = OverPressure { states: &states, base: RubberFriction::default() };
        let apart = plain.coefficients(&near).unwrap()[0] / coupled.coefficients(&near).unwrap()[0] - 1.0;
        assert!(apart.abs() > 1e-3);
    }
}
