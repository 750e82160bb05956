//! Isochoric Ogden law with one term and with several.

use wide::f64x8;

use super::eigen::jacobi;
use super::principal::{AXIS_PAIRS, Principal, stress_on};
use super::{Hyperelastic, Moduli, Sym};

/// Ogden law of one term (Ogden 1972).
///
/// `U = 2 mu/alpha² (l1^alpha + l2^alpha + l3^alpha − 3) + (J − 1)²/D`, `l_k = J^(-1/3) lambda_k` the isochoric
/// principal stretches. `alpha = 2` is the neo-Hookean law with shear modulus `mu`; the small-strain shear
/// modulus is `mu` for every `alpha`, the bulk modulus `2/D`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Ogden {
    /// Shear modulus, MPa, > 0.
    pub mu_mpa: f64,
    /// Exponent, not 0.
    pub alpha: f64,
    /// Compressibility, 1/MPa, > 0.
    pub d_per_mpa: f64,
}

/// Most terms of an [`OgdenSeries`]; as many as other programs take.
pub const MOST_OGDEN_TERMS: usize = 6;

/// One term `2 mu/alpha² (l1^alpha + l2^alpha + l3^alpha − 3)` of an Ogden law.
///
/// Ogden's own 1972 form is `m/alpha (...)`; from it `mu = m alpha/2`.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OgdenTerm {
    /// Its part of the shear modulus, MPa; may be negative where the sum over the terms is not.
    #[serde(deserialize_with = "fingerpad_formats::units::finite")]
    pub mu_mpa: f64,
    /// Exponent, not 0.
    #[serde(deserialize_with = "fingerpad_formats::units::non_zero")]
    pub alpha: f64,
}

/// Ogden law of several terms (Ogden 1972): `U = sum_i 2 mu_i/alpha_i² (l1^alpha_i + l2^alpha_i + l3^alpha_i − 3) +
/// (J − 1)²/D`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OgdenSeries {
    terms: [OgdenTerm; MOST_OGDEN_TERMS],
    count: usize,
    d_per_mpa: f64,
}

impl OgdenSeries {
    /// The law of these terms; None for none, or for more than [`MOST_OGDEN_TERMS`].
    ///
    /// * `d_per_mpa`: compressibility, 1/MPa, > 0
    pub fn new(terms: &[OgdenTerm], d_per_mpa: f64) -> Option<Self> {
        let mut all = [OgdenTerm::default(); MOST_OGDEN_TERMS];
        all.get_mut(..terms.len())?.copy_from_slice(terms);
        (!terms.is_empty()).then_some(Self { terms: all, count: terms.len(), d_per_mpa })
    }

    /// Its terms, one to [`MOST_OGDEN_TERMS`].
    pub fn terms(&self) -> &[OgdenTerm] {
        &self.terms[..self.count]
    }
}

impl serde::Serialize for OgdenSeries {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        let mut table = to.serialize_struct("OgdenSeries", 2)?;
        table.serialize_field("terms", self.terms())?;
        table.serialize_field("d_per_mpa", &self.d_per_mpa)?;
        table.end()
    }
}

impl Ogden {
    fn term(&self) -> OgdenTerm {
        OgdenTerm { mu_mpa: self.mu_mpa, alpha: self.alpha }
    }
}

impl Hyperelastic for Ogden {
    fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8 {
        let (squares, _) = jacobi(b);
        self.term().energy(&logarithms(&squares, j))
    }

    fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8> {
        let (squares, axes) = jacobi(b);
        let (tau, _) = self.term().principal_stress(&logarithms(&squares, j));
        stress_on(&tau, &axes)
    }

    fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli {
        let (squares, axes) = jacobi(b);
        self.term().principal(&squares, &logarithms(&squares, j)).on(&axes)
    }

    fn shear_mpa(&self) -> f64 {
        self.mu_mpa
    }

    fn d_per_mpa(&self) -> f64 {
        self.d_per_mpa
    }

    fn stiffened(self, factor: f64) -> Self {
        Self { mu_mpa: self.mu_mpa * factor, d_per_mpa: self.d_per_mpa / factor, ..self }
    }
}

impl Hyperelastic for OgdenSeries {
    fn energy(&self, b: &Sym<f64x8>, j: f64x8) -> f64x8 {
        let (squares, _) = jacobi(b);
        let logarithms = logarithms(&squares, j);
        self.terms().iter().fold(f64x8::ZERO, |sum, term| sum + term.energy(&logarithms))
    }

    fn stress(&self, b: &Sym<f64x8>, j: f64x8) -> Sym<f64x8> {
        let (squares, axes) = jacobi(b);
        let logarithms = logarithms(&squares, j);
        let mut tau = [f64x8::ZERO; 3];
        for term in self.terms() {
            let (of_term, _) = term.principal_stress(&logarithms);
            (0..3).for_each(|k| tau[k] += of_term[k]);
        }
        stress_on(&tau, &axes)
    }

    fn moduli(&self, b: &Sym<f64x8>, j: f64x8) -> Moduli {
        let (squares, axes) = jacobi(b);
        let logarithms = logarithms(&squares, j);
        let mut terms = self.terms().iter().map(|term| term.principal(&squares, &logarithms));
        let first = terms.next().expect("a series has a term");
        terms.fold(first, |sum, term| sum.plus(&term)).on(&axes)
    }

    fn shear_mpa(&self) -> f64 {
        self.terms().iter().map(|term| term.mu_mpa).sum()
    }

    fn d_per_mpa(&self) -> f64 {
        self.d_per_mpa
    }

    fn stiffened(mut self, factor: f64) -> Self {
        self.terms.iter_mut().for_each(|term| term.mu_mpa *= factor);
        Self { d_per_mpa: self.d_per_mpa / factor, ..self }
    }
}

/// `2 ln l_k` of the isochoric stretches, from the squares of the stretches.
fn logarithms(squares: &[f64x8; 3], j: f64x8) -> [f64x8; 3] {
    let mean = j.ln() * f64x8::splat(2.0 / 3.0);
    std::array::from_fn(|k| squares[k].ln() - mean)
}

impl OgdenTerm {
    fn energy(&self, logarithms: &[f64x8; 3]) -> f64x8 {
        let power = self.powers(logarithms);
        (power[0] + power[1] + power[2] - f64x8::splat(3.0))
            * f64x8::splat(2.0 * self.mu_mpa / (self.alpha * self.alpha))
    }

    /// `l_k^alpha` of the isochoric stretches.
    fn powers(&self, logarithms: &[f64x8; 3]) -> [f64x8; 3] {
        let half = f64x8::splat(0.5 * self.alpha);
        std::array::from_fn(|k| (logarithms[k] * half).exp())
    }

    /// Principal Kirchhoff stresses and `beta_A = (2 mu/alpha) l_A^alpha`.
    fn principal_stress(&self, logarithms: &[f64x8; 3]) -> ([f64x8; 3], [f64x8; 3]) {
        let factor = f64x8::splat(2.0 * self.mu_mpa / self.alpha);
        let power = self.powers(logarithms);
        let beta: [f64x8; 3] = std::array::from_fn(|k| power[k] * factor);
        let mean = (beta[0] + beta[1] + beta[2]) * f64x8::splat(1.0 / 3.0);
        (std::array::from_fn(|k| beta[k] - mean), beta)
    }

    /// Stresses and moduli on the principal axes; the quotient that becomes 0/0 at equal stretches is evaluated
    /// as a ratio of hyperbolic sines, so that no stretch state is special.
    #[inline(always)]
    fn principal(&self, squares: &[f64x8; 3], logarithms: &[f64x8; 3]) -> Principal {
        let (tau, beta) = self.principal_stress(logarithms);
        let alpha = f64x8::splat(self.alpha);
        let third = f64x8::splat(1.0 / 3.0);
        let sum_ninth = (beta[0] + beta[1] + beta[2]) * f64x8::splat(1.0 / 9.0);
        let mut normal = [[f64x8::ZERO; 3]; 3];
        for a in 0..3 {
            for e in 0..3 {
                normal[a][e] = alpha * (sum_ninth - (beta[a] + beta[e]) * third);
                if a == e {
                    normal[a][e] += alpha * beta[a] - (tau[a] + tau[a]);
                }
            }
        }
        let shear = AXIS_PAIRS
            .map(|(a, e)| self.divided_difference(squares[a], squares[e], beta[a], beta[e]) * squares[e] - tau[e]);
        Principal { tau, normal, shear }
    }

    /// `(beta_A − beta_B)/(lambda_A² − lambda_B²)`, smooth through equal stretches.
    fn divided_difference(&self, a: f64x8, b: f64x8, beta_a: f64x8, beta_b: f64x8) -> f64x8 {
        // With half the log difference d = (ln l_A − ln l_B)/2 and geometric means:
        // (beta_A − beta_B)/(a − b) = sqrt(beta_A beta_B/(a b)) sinh(alpha d)/sinh(2 d).
        let diff = a - b;
        let near = diff.abs().simd_lt((a + b) * f64x8::splat(0.5e-2));
        let direct = (beta_a - beta_b) / near.select(f64x8::ONE, diff);
        let x = diff / (a + b); // = tanh(2 d)
        let two_d = x * (f64x8::ONE + x * x * (f64x8::splat(1.0 / 3.0) + x * x * f64x8::splat(0.2)));
        let d2 = two_d * two_d * f64x8::splat(0.25);
        let al2 = self.alpha * self.alpha;
        let numerator = f64x8::ONE + d2 * (f64x8::splat(al2 / 6.0) + d2 * f64x8::splat(al2 * al2 / 120.0));
        let denominator = f64x8::ONE + d2 * (f64x8::splat(4.0 / 6.0) + d2 * f64x8::splat(16.0 / 120.0));
        // 2 mu/alpha must keep its sign under the root.
        let sign = f64x8::splat((self.mu_mpa * self.alpha).signum());
        let series =
            sign * (beta_a * beta_b / (a * b)).sqrt() * f64x8::splat(0.5 * self.alpha) * numerator / denominator;
        near.select(series, direct)
    }
}
