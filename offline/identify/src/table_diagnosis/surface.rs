//! The elastic response between computed steady slides: a regression over depth, law and bone clearance.
//!
//! Main type: [`FittedSurface`]. The regressed quantities are the logarithms of normal force and area, and that of the
//! mean shear stress over the law's strength at the mean pressure, which varies far less than friction itself. On a
//! mesh contact grows point by point, so that the responses have kinks of a per cent; the regression goes through their
//! middle.

use nalgebra::DMatrix;

use fingerpad_fe::contact::{FrictionLaw, RubberFriction};

use super::reading::{Elastic, ElasticPlace};
use crate::LawPoint;

/// Terms of the regression over depth and law, and those of the bone clearance.
const LAW_TERMS: usize = 18;
const BONE_TERMS: usize = 4;

/// A regression of the finite elements' responses.
#[derive(Clone, Debug)]
pub struct FittedSurface {
    base: RubberFriction,
    /// Ln depth, ln strength, beta, share of tau_0 and bone clearance at the middle.
    middle: [f64; 5],
    /// Their ranges; beyond these the regression is continued along its edge's slope.
    range: [[f64; 2]; 5],
    /// Coefficients of the three logarithms; shape (terms, 3).
    coefficients: DMatrix<f64>,
    /// Root mean square residuals of the three logarithms.
    pub rms: [f64; 3],
}

impl FittedSurface {
    /// The regression through `answers`, the first of which is at the middle law: of depth and law through those with the
    /// given bone clearance, of the bone clearance through what it leaves of the others.
    ///
    /// None if there are fewer responses than terms.
    pub fn through(answers: &[(ElasticPlace, Elastic)], base: RubberFriction) -> Option<Self> {
        let (plain, moved): (Vec<_>, Vec<_>) = answers.iter().copied().partition(|(place, _)| place.bone_mm == 0.0);
        let range = std::array::from_fn(|k| {
            let ends = answers.iter().map(|(place, _)| coordinates(place)[k]);
            [ends.clone().fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max)]
        });
        let [least, most]: [f64; 2] = range[0];
        let mut middle = coordinates(&plain.first()?.0);
        middle[0] = 0.5 * (least + most);
        let mut out = Self { base, middle, range, coefficients: DMatrix::zeros(LAW_TERMS, 3), rms: [0.0; 3] };
        let (law, left) = out.regression(&plain, 0, LAW_TERMS)?;
        out.rms = std::array::from_fn(|k| (left.column(k).norm_squared() / plain.len() as f64).sqrt());
        out.coefficients = law;
        if moved.len() >= BONE_TERMS {
            let (bone, _) = out.regression(&moved, LAW_TERMS, BONE_TERMS)?;
            out.coefficients = out.coefficients.resize_vertically(LAW_TERMS + BONE_TERMS, 0.0);
            out.coefficients.rows_mut(LAW_TERMS, BONE_TERMS).copy_from(&bone);
        }
        Some(out)
    }

    /// Coefficients of some terms by least squares, and what they leave; none if the responses do not determine them.
    fn regression(
        &self,
        answers: &[(ElasticPlace, Elastic)],
        first: usize,
        count: usize,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let matrix = DMatrix::from_fn(answers.len(), count, |i, j| self.terms(&coordinates(&answers[i].0))[first + j]);
        let wanted = DMatrix::from_fn(answers.len(), 3, |i, k| {
            let (place, elastic) = &answers[i];
            self.logarithms(elastic, &place.law)[k] - self.logarithms_at(&coordinates(place))[k]
        });
        let svd = matrix.clone().svd(true, true);
        if answers.len() < count || !(svd.singular_values.min() > 1e-9 * svd.singular_values.max()) {
            return None;
        }
        let coefficients = svd.solve(&wanted, 0.0).ok()?;
        let left = &matrix * &coefficients - &wanted;
        Some((coefficients, left))
    }

    /// Whether the bone clearance has an effect in it.
    pub fn has_bone_terms(&self) -> bool {
        self.coefficients.nrows() > LAW_TERMS
    }

    /// The three logarithms that are regressed.
    fn logarithms(&self, [normal_n, area_mm2, friction_n]: &Elastic, law: &LawPoint) -> [f64; 3] {
        let strength = law.friction(&self.base).strength(normal_n / area_mm2).0;
        [normal_n.ln(), area_mm2.ln(), (friction_n / area_mm2 / strength).ln()]
    }

    fn terms(&self, at: &[f64; 5]) -> [f64; LAW_TERMS + BONE_TERMS] {
        let [t, u, b, s, g] = std::array::from_fn(|k| at[k] - self.middle[k]);
        let of_depth = [1.0, t, t * t, t * t * t, u, u * t, u * u, u * t * t, b, b * t, b * b];
        let others = [b * t * t, u * b, s, s * t, s * s, s * u, s * b, g, g * t, g * t * t, g * g];
        std::array::from_fn(|k| if k < 11 { of_depth[k] } else { others[k - 11] })
    }

    /// The three logarithms at coordinates inside the range, or continued linearly from its edge.
    fn logarithms_at(&self, at: &[f64; 5]) -> [f64; 3] {
        let inside: [f64; 5] = std::array::from_fn(|k| at[k].clamp(self.range[k][0], self.range[k][1]));
        let value = |at: &[f64; 5]| {
            let terms = self.terms(at);
            [0, 1, 2].map(|q| self.coefficients.column(q).iter().zip(&terms).map(|(c, t)| c * t).sum::<f64>())
        };
        let here = value(&inside);
        let mut out = here;
        for k in (0..5).filter(|k| at[*k] != inside[*k]) {
            let beyond = at[k] - inside[k];
            let step = 0.02 * (self.range[k][1] - self.range[k][0]) * -beyond.signum();
            let mut back = inside;
            back[k] += step;
            let inner = value(&back);
            (0..3).for_each(|q| out[q] += beyond * (inner[q] - here[q]) / step);
        }
        out
    }

    /// The response at a place.
    pub fn at(&self, place: &ElasticPlace) -> Elastic {
        let [normal, area, stress] = self.logarithms_at(&coordinates(place)).map(f64::exp);
        let strength = place.law.friction(&self.base).strength(normal / area).0;
        [normal, area, stress * strength * area]
    }
}

fn coordinates(place: &ElasticPlace) -> [f64; 5] {
    let LawPoint { tau_ref_kpa, beta, tau0_share } = place.law;
    [place.depth_mm.max(1e-3).ln(), tau_ref_kpa.ln(), beta, tau0_share, place.bone_mm]
}
