//! Smooth curves over depth that a model file gives, from which the parameters count.
//!
//! Main type: [`ReferenceCurves`].

use fingerpad::build::{DataOf, Line, Row};
use nalgebra::{DMatrix, DVector};

use crate::model::{ELEMENTS, MIDDLE_MM, ODD_SHAPE, SmoothModel};
use crate::parameter::{Parameter, Parameters};

/// Least and largest yield position of the elements, over the mean slip length.
const YIELD_RANGE: [f64; 2] = [0.3, 3.6];
/// Yield position at which the bell of the shares has its middle.
const YIELD_MIDDLE: f64 = 1.43;
/// Width of that bell in the logarithm of the yield position.
const YIELD_WIDTH: f64 = 0.55;

/// Least and largest logarithm of the exponent that spreads the yield positions, as they are taken from a model file.
const SPREAD_RANGE: [f64; 2] = [-1.5, 1.0];

/// Area over depth of the finger in Table 1 of Yoshida et al. 2011, A = 65.0 d^1.007 mm²: the fit of its four points.
const TABLE_AREA: [f64; 2] = [65.0, 1.007];
/// Standard deviation of the logarithm of the area between fingers at one depth. The area is proportional to the radius
/// of the pad, and the radius to the finger's width, which scatters by about as much among adults.
const OTHER_AREA_SD: f64 = 0.08;

/// Curves over depth through the tables of a model file, and the elements to start from.
#[derive(Clone, Debug)]
pub struct ReferenceCurves {
    ln_normal: [f64; 4],
    ln_strength: [f64; 4],
    ln_tangential: [f64; 4],
    ln_area: [f64; 4],
    /// Yield position and share of the strength of each element, before the parameters act.
    yields: [[f64; 2]; ELEMENTS],
    /// The parameters' values for the finger of the file.
    pub mean: Parameters,
    /// Standard deviation of the logarithm of the area, which forces do not determine.
    pub ln_area_sd: f64,
}

impl ReferenceCurves {
    /// The curves of a model file's numbers.
    ///
    /// `own`: whether the file's finger is the measured finger. Otherwise the contact area of a measured finger from
    /// the literature is taken, with its scatter, because forces do not determine the area, and yield positions of a
    /// spread from which the parameters reach other fingers.
    pub fn from_model_data<const M: usize, const N: usize>(data: &DataOf<M, N>, own: bool) -> Self {
        let n = data.rows.len();
        let cell = f64::from(data.depth_max) / (n - 1) as f64;
        let fit = |value: &dyn Fn(&Row<M>) -> f64| -> [f64; 4] {
            let points: Vec<(f64, f64)> = (1..n)
                .map(|i| (i as f64 * cell, value(&data.rows[i]).ln()))
                .filter(|(depth_mm, _)| *depth_mm > 0.12)
                .collect();
            fit_curve(&points)
        };
        let middle = middle_node(data);
        let row = &data.rows[middle];
        let at = |line: &Line| f64::from(line.value);
        let mut mean = Parameters::ZERO;
        mean[Parameter::StiffnessRatioY] = f64::from(row.stiffness_y.value / row.stiffness_x.value).ln();
        mean[Parameter::PressCoupling] = f64::from(row.press_slide.slope) / cell;
        mean[Parameter::NormalPerFrictionX] = mean[Parameter::PressCoupling];
        let [shear_x, shear_y] = normal_per_full_shear(data);
        mean[Parameter::NormalShearX] = shear_x;
        mean[Parameter::NormalShearY] = shear_y;
        // The strength along x is 1 + e times, along y 1 - e times the mean.
        let along = |row: &Row<M>| 2.0 / (1.0 + at(&row.limit_ratio));
        mean[Parameter::EvenDirectionCos] = along(row) - 1.0;
        mean[Parameter::OddXPerMm] = -at(&row.limit_shift) / ((1.0 - ODD_SHAPE) * cell * middle as f64);
        mean[Parameter::LoadExponent] = f64::from(data.pressure_exponent);
        let ln_area = if own {
            fit(&|r| at(&r.area))
        } else {
            [TABLE_AREA[0].ln() + TABLE_AREA[1] * MIDDLE_MM.ln(), TABLE_AREA[1], 0.0, 0.0]
        };
        let yields = yields();
        if own {
            mean[Parameter::YieldSpread] = spread_of(data, row, &yields);
        }
        // If friction lags behind its limit in a straight slide, the area between the two is the energy in full slip
        // over the stiffness. It is kept the same, so that there is no step where a spring touches.
        let spread = spread_out(&yields, mean[Parameter::YieldSpread]);
        let energy = moment(&spread, 1) * moment(&spread, -1) / moment(&spread, 0).powi(2);
        let stiffness = |row: &Row<M>| energy * at(&row.limit).powi(2) / (2.0 * shear_energy_n_mm(data, row));
        Self {
            ln_normal: fit(&|r| at(&r.normal)),
            ln_strength: fit(&|r| at(&r.limit) / along(r)),
            ln_tangential: fit(&stiffness),
            ln_area,
            yields,
            mean,
            ln_area_sd: if own { 0.0 } else { OTHER_AREA_SD },
        }
    }

    /// The smooth model with these values of the parameters.
    pub fn model(&self, values: &Parameters) -> SmoothModel {
        use Parameter as P;
        let sum = |a: &[f64; 4], more: [f64; 4]| -> [f64; 4] { std::array::from_fn(|i| a[i] + more[i]) };
        SmoothModel {
            ln_normal: sum(
                &self.ln_normal,
                [P::NormalScale, P::NormalDepthExponent, P::NormalDepthSlope, P::NormalDepthCurvature]
                    .map(|p| values[p]),
            ),
            ln_strength: sum(
                &self.ln_strength,
                [P::StrengthScale, P::StrengthDepthExponent, P::StrengthDepthSlope, P::StrengthDepthCurvature]
                    .map(|p| values[p]),
            ),
            ln_tangential: sum(
                &self.ln_tangential,
                [values[P::TangentialScale], values[P::TangentialDepthExponent], values[P::TangentialDepthSlope], 0.0],
            ),
            ln_area: self.ln_area,
            elements: self.elements(values),
            ln_stiffness_ratio_y: [values[P::StiffnessRatioY], values[P::StiffnessRatioYExponent]],
            press_coupling: [values[P::PressCoupling], values[P::PressCouplingSlope]],
            press_coupling_y: values[P::PressCouplingY],
            normal_per_friction: [values[P::NormalPerFrictionX], values[P::NormalPerFrictionY]],
            normal_shear: [values[P::NormalShearX], values[P::NormalShearY]],
            odd_x_per_mm: values[P::OddXPerMm],
            load_exponent: values[P::LoadExponent],
            even_direction: [values[P::EvenDirectionCos], values[P::EvenDirectionSin]],
            even_direction_slope: values[P::EvenDirectionCosSlope],
            odd_direction: [values[P::OddDirectionCos], values[P::OddDirectionSin]],
        }
    }

    /// 1/yield position and share of the strength of each element; the shares sum to 1 and the mean slip length is 1.
    fn elements(&self, values: &Parameters) -> [[f64; 2]; ELEMENTS] {
        let mut yields = self.yields;
        let spread = values[Parameter::YieldSpread].clamp(-4.0, 1.5).exp();
        let [tilt, bow, twist] = [Parameter::YieldTilt, Parameter::YieldBow, Parameter::YieldTwist].map(|p| values[p]);
        let (mut strength, mut softness) = (0.0, 0.0);
        for (k, slot) in yields.iter_mut().enumerate() {
            let t = 2.0 * k as f64 / (ELEMENTS - 1) as f64 - 1.0;
            slot[0] = slot[0].powf(spread);
            slot[1] *= (tilt * t + bow * (t * t - 0.4) + twist * t * (t * t - 0.6)).clamp(-4.0, 4.0).exp();
            strength += slot[1];
        }
        for slot in &mut yields {
            slot[1] /= strength;
            softness += slot[1] / slot[0];
        }
        yields.map(|[y, w]| [1.0 / (y * softness), w])
    }
}

/// The node of a model file's tables that is nearest to 0.9 mm.
pub(crate) fn middle_node<const M: usize, const N: usize>(data: &DataOf<M, N>) -> usize {
    ((MIDDLE_MM * f64::from(data.cells_per_mm)).round() as usize).min(N - 1)
}

/// Energy of the springs in full slip along x over half the stiffness, mm².
fn full_slip_mm2<const M: usize, const N: usize>(data: &DataOf<M, N>, row: &Row<M>) -> f64 {
    data.springs.iter().zip(&row.radius).map(|(s, r)| f64::from(s.stiffness) * f64::from(r.value).powi(2)).sum()
}

/// Energy of the springs in full slip along x, N mm.
fn shear_energy_n_mm<const M: usize, const N: usize>(data: &DataOf<M, N>, row: &Row<M>) -> f64 {
    0.5 * f64::from(row.stiffness_x.value) * full_slip_mm2(data, row)
}

/// Share by which full shear along x and y raises the normal force of a model file at 0.9 mm: the change of the shear energy
/// with depth.
pub(crate) fn normal_per_full_shear<const M: usize, const N: usize>(data: &DataOf<M, N>) -> [f64; 2] {
    let row = &data.rows[middle_node(data)];
    let per_stiffness = 0.5 * full_slip_mm2(data, row) * f64::from(data.cells_per_mm) / f64::from(row.normal.value);
    let [x, y] = [row.stiffness_x, row.stiffness_y].map(|k| f64::from(k.slope) * per_stiffness);
    [x, y / f64::from(row.anisotropy.value).powi(2)]
}

/// Sum of the shares of the strength times a power of the yield positions.
fn moment(yields: &[[f64; 2]], power: i32) -> f64 {
    yields.iter().map(|[y, w]| w * y.powi(power)).sum()
}

/// Yield positions with a logarithm of the exponent that spreads them.
fn spread_out(yields: &[[f64; 2]; ELEMENTS], spread: f64) -> [[f64; 2]; ELEMENTS] {
    yields.map(|[y, w]| [y.powf(spread.exp()), w])
}

/// The spread at which the yield positions vary about their mean as the yield slides of a model file's springs do.
fn spread_of<const M: usize, const N: usize>(data: &DataOf<M, N>, row: &Row<M>, yields: &[[f64; 2]; ELEMENTS]) -> f64 {
    let varies = |yields: &[[f64; 2]]| moment(yields, 2) * moment(yields, 0) / moment(yields, 1).powi(2);
    let springs = data.springs.iter().zip(&row.radius).map(|(s, r)| {
        let slide = f64::from(r.value);
        [slide, f64::from(s.stiffness) * slide]
    });
    let wanted = varies(&springs.collect::<Vec<_>>());
    let [mut low, mut high] = SPREAD_RANGE;
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if varies(&spread_out(yields, middle)) < wanted { low = middle } else { high = middle }
    }
    low
}

/// Yield positions, even in the logarithm, and shares of the strength, a bell over it: a start from which the parameters
/// reach other fingers. The few elements of a model file, made for its own finger, are no better one.
fn yields() -> [[f64; 2]; ELEMENTS] {
    let at = |k: usize| {
        (YIELD_RANGE[0].ln() + (YIELD_RANGE[1] / YIELD_RANGE[0]).ln() * k as f64 / (ELEMENTS - 1) as f64).exp()
    };
    std::array::from_fn(|k| {
        let z = (at(k) / YIELD_MIDDLE).ln() / YIELD_WIDTH;
        [at(k), (-0.5 * z * z).exp()]
    })
}

/// Coefficients of the least-squares curve through points (depth, logarithm of the value), mm.
fn fit_curve(points: &[(f64, f64)]) -> [f64; 4] {
    let a = DMatrix::from_fn(points.len(), 4, |i, j| {
        let depth_mm = points[i].0;
        if j == 1 { (depth_mm / MIDDLE_MM).ln() } else { (depth_mm - MIDDLE_MM).powi([0, 0, 1, 2][j]) }
    });
    let b = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let normal = a.transpose() * &a + DMatrix::identity(4, 4) * 1e-9;
    let x = normal.cholesky().expect("positive definite").solve(&(a.transpose() * b));
    [x[0], x[1], x[2], x[3]]
}
