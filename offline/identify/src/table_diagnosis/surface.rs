//! The elastic response between computed steady slides: a regression over depth, law and bone clearance.
//!
//! Main type: [`FittedSurface`]. The regressed quantities are the logarithms of normal force and area, and that of the
//! mean shear stress over the law's strength at the mean pressure, which varies far less than friction itself. On a
//! mesh contact grows point by point, so that the responses have kinks of a per cent; the regression goes through their
//! middle.

use nalgebra::DMatrix;

use fingerpad_fe::contact::{FrictionLaw, RubberFriction};

use super::reading::{Elastic, ElasticPlace, Surface};
use crate::LawPoint;

/// Terms of the regression over depth and law, and over depth and bone clearance.
const LAW_TERMS: usize = 18;
const BONE_TERMS: usize = 4;

/// A regression of the finite elements' responses.
#[derive(Clone, Debug)]
pub struct FittedSurface {
    base: RubberFriction,
    /// Middle of the depths (logarithm) and of the laws.
    middle: (f64, LawPoint),
    /// Ranges of ln depth, ln strength, beta and share of tau_0 beyond which it is continued along its edge's slope.
    range: [[f64; 2]; 4],
    /// Coefficients of the three logarithms; shape (terms, 3).
    law: DMatrix<f64>,
    bone: Option<DMatrix<f64>>,
    /// Root mean square residuals of the three logarithms.
    pub rms: [f64; 3],
}

/// The three logarithms that are regressed.
fn logarithms(elastic: &Elastic, law: &LawPoint, base: &RubberFriction) -> [f64; 3] {
    let pressure = elastic.normal_n / elastic.area_mm2;
    let stress = elastic.friction_n / elastic.area_mm2;
    let strength = law.friction(base).strength(pressure).0;
    [elastic.normal_n.ln(), elastic.area_mm2.ln(), (stress / strength).ln()]
}

impl FittedSurface {
    /// The regression through `answers`; one with another bone clearance than 0 requires one with clearance 0 at the
    /// same law.
    ///
    /// None if there are fewer responses than terms.
    pub fn through(answers: &[(ElasticPlace, Elastic)], base: RubberFriction) -> Option<Self> {
        let (plain, moved): (Vec<_>, Vec<_>) = answers.iter().partition(|(place, _)| place.bone_mm == 0.0);
        if plain.len() < LAW_TERMS + 4 {
            return None;
        }
        let coordinates: Vec<[f64; 4]> = plain.iter().map(|(place, _)| coordinates(place)).collect();
        let range: [[f64; 2]; 4] = std::array::from_fn(|k| {
            let values = || coordinates.iter().map(|c| c[k]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        });
        let first = &plain[0].0;
        let middle = (0.5 * (range[0][0] + range[0][1]), first.law);
        let mut out = Self { base, middle, range, law: DMatrix::zeros(LAW_TERMS, 3), bone: None, rms: [0.0; 3] };
        let matrix = DMatrix::from_fn(plain.len(), LAW_TERMS, |i, j| out.law_terms(&coordinates[i])[j]);
        let wanted = DMatrix::from_fn(plain.len(), 3, |i, k| logarithms(&plain[i].1, &plain[i].0.law, &base)[k]);
        out.law = solve(&matrix, &wanted)?;
        let left = &matrix * &out.law - &wanted;
        out.rms = std::array::from_fn(|k| (left.column(k).norm_squared() / plain.len() as f64).sqrt());
        if moved.len() >= BONE_TERMS {
            let terms = |i: usize| out.bone_terms(self::coordinates(&moved[i].0)[0], moved[i].0.bone_mm);
            let matrix = DMatrix::from_fn(moved.len(), BONE_TERMS, |i, j| terms(i)[j]);
            // Against the response at the same depth and law without the change, so that the kinks of the mesh at one
            // place do not count twice.
            let wanted = DMatrix::from_fn(moved.len(), 3, |i, k| {
                let (place, elastic) = moved[i];
                let same = plain.iter().find(|(p, _)| p.depth_mm == place.depth_mm && p.law == place.law);
                let from = same.map_or_else(|| out.at(&ElasticPlace { bone_mm: 0.0, ..place }), |(_, e)| *e);
                logarithms(&elastic, &place.law, &base)[k] - logarithms(&from, &place.law, &base)[k]
            });
            out.bone = Some(solve(&matrix, &wanted)?);
        }
        Some(out)
    }

    /// Whether the bone clearance has an effect in it.
    pub fn has_bone_terms(&self) -> bool {
        self.bone.is_some()
    }

    fn away(&self, c: &[f64; 4]) -> [f64; 4] {
        let (depth, law) = &self.middle;
        [c[0] - depth, c[1] - law.tau_ref_kpa.ln(), c[2] - law.beta, c[3] - law.tau0_share]
    }

    fn law_terms(&self, coordinates: &[f64; 4]) -> [f64; LAW_TERMS] {
        let [t, u, b, s] = self.away(coordinates);
        [
            1.0,
            t,
            t * t,
            t * t * t,
            u,
            u * t,
            u * u,
            u * t * t,
            b,
            b * t,
            b * b,
            b * t * t,
            u * b,
            s,
            s * t,
            s * s,
            s * u,
            s * b,
        ]
    }

    fn bone_terms(&self, ln_depth: f64, bone_mm: f64) -> [f64; BONE_TERMS] {
        let t = ln_depth - self.middle.0;
        [bone_mm, bone_mm * t, bone_mm * t * t, bone_mm * bone_mm]
    }

    /// The three logarithms at coordinates inside the range, or continued linearly from its edge.
    fn logarithms_at(&self, c: &[f64; 4]) -> [f64; 3] {
        let inside: [f64; 4] = std::array::from_fn(|k| c[k].clamp(self.range[k][0], self.range[k][1]));
        let value = |at: &[f64; 4]| {
            let terms = self.law_terms(at);
            [0, 1, 2].map(|q| self.law.column(q).iter().zip(&terms).map(|(c, t)| c * t).sum::<f64>())
        };
        let mut out = value(&inside);
        for k in 0..4 {
            let beyond = c[k] - inside[k];
            if beyond != 0.0 {
                let step = 0.02 * (self.range[k][1] - self.range[k][0]) * -beyond.signum();
                let mut back = inside;
                back[k] += step;
                let (here, inner) = (value(&inside), value(&back));
                for q in 0..3 {
                    out[q] += beyond * (inner[q] - here[q]) / step;
                }
            }
        }
        out
    }
}

fn coordinates(place: &ElasticPlace) -> [f64; 4] {
    [place.depth_mm.max(1e-3).ln(), place.law.tau_ref_kpa.ln(), place.law.beta, place.law.tau0_share]
}

/// Least squares of all columns; none if the matrix is not of full rank.
fn solve(matrix: &DMatrix<f64>, wanted: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let svd = matrix.clone().svd(true, true);
    let largest = svd.singular_values.max();
    if !(svd.singular_values.min() > 1e-9 * largest) {
        return None;
    }
    svd.solve(wanted, 0.0).ok()
}

impl Surface for FittedSurface {
    fn at(&self, place: &ElasticPlace) -> Elastic {
        let c = coordinates(place);
        let mut logs = self.logarithms_at(&c);
        if let Some(bone) = &self.bone {
            let ln_depth = c[0].clamp(self.range[0][0], self.range[0][1]);
            let terms = self.bone_terms(ln_depth, place.bone_mm);
            (0..3).for_each(|k| logs[k] += bone.column(k).iter().zip(&terms).map(|(c, t)| c * t).sum::<f64>());
        }
        let (normal_n, area_mm2) = (logs[0].exp(), logs[1].exp());
        let strength = place.law.friction(&self.base).strength(normal_n / area_mm2).0;
        Elastic { normal_n, area_mm2, friction_n: logs[2].exp() * strength * area_mm2 }
    }
}

/// A surface with corrections of the three forces' logarithms per slot: those that finite elements at one point gave.
pub struct Corrected<'a> {
    /// The surface.
    pub surface: &'a dyn Surface,
    /// Depths of the slots at the point, mm.
    pub depths_mm: Vec<f64>,
    /// Added to ln N, ln A, ln F of the slot whose depth is nearest.
    pub shift: Vec<[f64; 3]>,
}

impl Surface for Corrected<'_> {
    fn at(&self, place: &ElasticPlace) -> Elastic {
        let plain = self.surface.at(place);
        let away = |k: &usize| (self.depths_mm[*k] - place.depth_mm).abs();
        let near = (0..self.depths_mm.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
        let shift = near.map_or([0.0; 3], |k| self.shift[k]);
        Elastic {
            normal_n: plain.normal_n * shift[0].exp(),
            area_mm2: plain.area_mm2 * shift[1].exp(),
            friction_n: plain.friction_n * shift[2].exp(),
        }
    }
}
