//! Friction coefficients without finite elements: a law integrated over pressures that finite elements found.

use nalgebra::{DMatrix, Matrix2, Vector2};

use super::{IdentifyError, LawPoint, Steady};
use fingerpad_fe::contact::RubberFriction;

/// Gives the friction coefficient at every depth for a law.
pub trait FrictionModel {
    /// F/N per depth.
    ///
    /// # Errors
    /// [`IdentifyError`]; a surrogate has none.
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError>;

    /// Announces the laws that will be evaluated, in any order: finite elements use their threads better on many at once.
    fn prepare(&mut self, _laws: &[LawPoint]) {}
}

/// The law over the pressure of states at one law, normal forces taken as unchanged.
///
/// Exact at the law of the states; elsewhere it leaves out that pressure and normal force change with friction.
#[derive(Clone, Debug)]
pub struct PressureSurrogate<'a> {
    /// States, one per depth.
    pub states: &'a [Steady],
    /// Elastic slip and regularisation of the law.
    pub base: RubberFriction,
}

impl FrictionModel for PressureSurrogate<'_> {
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
        let law = law.friction(&self.base);
        Ok(self.states.iter().map(|s| s.friction_limit_n(&law) / s.normal_force_n).collect())
    }
}

/// [`PressureSurrogate`], corrected so that value and slope at one law are those of the finite elements.
#[derive(Clone, Debug)]
pub struct AlignedSurrogate<'a> {
    over: PressureSurrogate<'a>,
    at: Vec<f64>,
    /// Logarithm of finite elements over surrogate at `at`, per depth.
    shift: Vec<f64>,
    /// Its derivative over the coordinates: shape (coordinates, depths).
    slope: Vec<Vec<f64>>,
    /// Correction by finite elements at other laws; none before [`Self::correct_at`].
    correction: Option<ScatteredCorrection>,
    fixed: LawPoint,
}

/// Derivatives of ln(F/N) over the coordinates, shape (coordinates, depths), by central differences.
///
/// # Errors
/// [`IdentifyError`] of the first evaluation that fails.
pub fn log_slopes(
    model: &mut dyn FrictionModel,
    at: &LawPoint,
    free_tau0: bool,
) -> Result<Vec<Vec<f64>>, IdentifyError> {
    let x = at.coordinates(free_tau0);
    let width = |k: usize| if k == 2 { 0.02 } else { 0.01 };
    let sides =
        (0..x.len()).flat_map(|k| [(k, 1.0), (k, -1.0)]).filter(|&(k, sign)| x[k] + sign * width(k) >= 0.0 || k < 2);
    let sides: Vec<LawPoint> = sides
        .map(|(k, sign)| {
            let mut moved = x.clone();
            moved[k] += sign * width(k);
            at.at(&moved)
        })
        .collect();
    model.prepare(&sides);
    (0..x.len())
        .map(|k| {
            let h = width(k);
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

impl<'a> AlignedSurrogate<'a> {
    /// AlignedSurrogate at `at`.
    ///
    /// * `states`: finite-element states there
    /// * `slopes`: their derivatives of ln(F/N), from [`log_slopes`]
    pub fn new(states: &'a [Steady], base: RubberFriction, at: LawPoint, slopes: &[Vec<f64>]) -> Self {
        let mut over = PressureSurrogate { states, base };
        let own = log_slopes(&mut over, &at, slopes.len() > 2).expect("a surrogate does not fail");
        let correction = slopes.iter().zip(own).map(|(fe, own)| fe.iter().zip(own).map(|(a, b)| a - b).collect());
        Self::corrected(states, base, at, correction.collect())
    }

    /// With the states' value at `at` and a correction of the slopes, shape (coordinates, depths).
    pub fn corrected(states: &'a [Steady], base: RubberFriction, at: LawPoint, slope: Vec<Vec<f64>>) -> Self {
        let mut over = PressureSurrogate { states, base };
        let value = over.coefficients(&at).expect("a surrogate does not fail");
        Self {
            at: at.coordinates(slope.len() > 2),
            shift: states.iter().zip(value).map(|(s, v)| (s.friction_coefficient() / v).ln()).collect(),
            slope,
            correction: None,
            fixed: at,
            over,
        }
    }

    /// Corrects it so that it meets the finite elements at other laws as well.
    ///
    /// * `known`: laws with the finite elements' F/N per depth. Below five laws nothing is corrected.
    ///
    /// Returns the largest relative difference at them before.
    pub fn correct_at(&mut self, known: &[(LawPoint, Vec<f64>)]) -> f64 {
        self.correction = None;
        let mut away = vec![[0.0; 2]];
        let mut differences = vec![vec![0.0; self.shift.len()]];
        for (law, exact) in known {
            away.push(self.away(law));
            let predicted = self.coefficients(law).expect("a surrogate does not fail");
            differences.push(exact.iter().zip(predicted).map(|(a, b)| (a / b).ln()).collect());
        }
        if known.len() >= 5 {
            self.correction = ScatteredCorrection::through(&away, &differences);
        }
        differences.iter().flatten().fold(0.0, |worst, d| worst.max(d.abs()))
    }

    /// Distance of a law in ln strength and beta.
    fn away(&self, law: &LawPoint) -> [f64; 2] {
        let x = law.coordinates(self.at.len() > 2);
        [x[0] - self.at[0], x[1] - self.at[1]]
    }
}

/// A surface per depth through values at scattered points of the plane: a parabola and cubes of the distances.
///
/// F/N of a mesh has kinks where a contact point touches or opens, which no parabola follows. The cubes' share is the
/// smallest that meets all points (Duchon 1977); it is zero if the values lie on a parabola.
#[derive(Clone, Debug)]
struct ScatteredCorrection {
    /// Turns the plane so that the points scatter evenly.
    whiten: Matrix2<f64>,
    /// Points, whitened.
    points: Vec<Vector2<f64>>,
    /// Factors of the cubes, then of the parabola's terms; shape (points + 6, depths).
    factors: DMatrix<f64>,
}

impl ScatteredCorrection {
    /// Values of shape (points, depths); none if the points lie on one line.
    fn through(points: &[[f64; 2]], values: &[Vec<f64>]) -> Option<Self> {
        let scatter: Matrix2<f64> = points.iter().map(|p| Vector2::from(*p) * Vector2::from(*p).transpose()).sum();
        let whiten = (scatter / points.len() as f64).cholesky()?.l().try_inverse()?;
        let points: Vec<_> = points.iter().map(|p| whiten * Vector2::from(*p)).collect();
        let n = points.len();
        let mut matrix = DMatrix::zeros(n + 6, n + 6);
        for (i, p) in points.iter().enumerate() {
            for (j, term) in terms(&points, p).into_iter().enumerate() {
                matrix[(i, j)] = term;
                if j >= n {
                    matrix[(j, i)] = term;
                }
            }
        }
        let depths = values[0].len();
        let wanted = DMatrix::from_fn(n + 6, depths, |i, depth| if i < n { values[i][depth] } else { 0.0 });
        let factors = matrix.svd(true, true).solve(&wanted, 1e-10).ok()?;
        Some(Self { whiten, points, factors })
    }

    fn value(&self, at: [f64; 2], depth: usize) -> f64 {
        let terms = terms(&self.points, &(self.whiten * Vector2::from(at)));
        terms.iter().zip(self.factors.column(depth).iter()).map(|(a, b)| a * b).sum()
    }
}

fn terms(points: &[Vector2<f64>], at: &Vector2<f64>) -> Vec<f64> {
    let cubes = points.iter().map(|p| (at - p).norm().powi(3));
    cubes.chain([1.0, at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y]).collect()
}

impl FrictionModel for AlignedSurrogate<'_> {
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
        let law = if self.at.len() > 2 { *law } else { LawPoint { tau0_share: self.fixed.tau0_share, ..*law } };
        let mut out = self.over.coefficients(&law)?;
        let x = law.coordinates(self.at.len() > 2);
        let d: Vec<f64> = x.iter().zip(&self.at).map(|(x, at)| x - at).collect();
        for (depth, value) in out.iter_mut().enumerate() {
            let linear: f64 = d.iter().zip(&self.slope).map(|(d, slope)| slope[depth] * d).sum();
            let correction = self.correction.as_ref().map_or(0.0, |correction| correction.value([d[0], d[1]], depth));
            *value *= (self.shift[depth] + linear + correction).exp();
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Replaces finite elements: pressure and normal force that change with the law.
    struct Coupled(Vec<Steady>);

    impl FrictionModel for Coupled {
        fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
            let mut over = PressureSurrogate { states: &self.0, base: RubberFriction::default() };
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
        let mut aligned = AlignedSurrogate::new(&states, RubberFriction::default(), at, &slopes);
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
        let apart = |aligned: &mut AlignedSurrogate, coupled: &mut Coupled| {
            let (a, b) = (aligned.coefficients(&far).unwrap()[1], coupled.coefficients(&far).unwrap()[1]);
            (a / b - 1.0).abs()
        };
        let before = apart(&mut aligned, &mut coupled);
        aligned.correct_at(&known);
        assert!(apart(&mut aligned, &mut coupled) < 0.3 * before, "{before}");
        for (law, exact) in &known {
            let predicted = aligned.coefficients(law).unwrap();
            assert!(predicted.iter().zip(exact).all(|(a, b)| (a / b - 1.0).abs() < 1e-10), "{law:?}");
        }
        aligned.correct_at(&known[..4]);
        assert_eq!(apart(&mut aligned, &mut coupled), before);

        let mut plain = PressureSurrogate { states: &states, base: RubberFriction::default() };
        let apart = plain.coefficients(&near).unwrap()[0] / coupled.coefficients(&near).unwrap()[0] - 1.0;
        assert!(apart.abs() > 1e-3);
    }
}
