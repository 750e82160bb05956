//! A parametric fingertip fitted to the borders of the labels: the template of the mesh's grid. It only has to be near;
//! later steps correct its errors.

use fingerpad_least_squares::{LevenbergMarquardt, Problem, TerminationReason, minimise};
use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::super::surface::{Body, Taper};
use super::error::VolumeError;

/// Parameters: value, prior value, and standard deviation of the prior.
struct Parameter {
    start: f64,
    spread: f64,
}

/// A prior as heavy as points this far off, mm, at first and in the end: it determines only the directions that the
/// points do not.
const PRIOR_MM: [f64; 2] = [0.01, 1e-4];
/// More points than this do not help.
const MOST_POINTS: usize = 8000;

/// A point of the labels' border: the surface crosses the step somewhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) place: Vector3<f64>,
    /// Step between the two voxels, in the finger's frame, mm.
    pub(super) step: Vector3<f64>,
}

/// Weight of errors within the resolution of the voxels, relative to those beyond it.
const OPEN: f64 = 0.02;

struct Fit<'a, F: Fn(&[f64]) -> (Body, Vector3<f64>) + Sync> {
    points: &'a [Sample],
    /// Whether errors within the resolution of the voxels count little, or like all others.
    within_voxels: bool,
    parameters: &'a [Parameter],
    body: F,
}

impl<F: Fn(&[f64]) -> (Body, Vector3<f64>) + Sync> Fit<'_, F> {
    fn residuals_at(&self, at: &[f64]) -> DVector<f64> {
        let (body, shift) = (self.body)(at);
        let weight = PRIOR_MM[usize::from(self.within_voxels)] * (self.points.len() as f64).sqrt();
        let distance = |sample: &Sample| {
            let point = sample.place - shift;
            let distance = body.distance(&point);
            if !self.within_voxels {
                return distance;
            }
            let open = 0.5 * body.normal(&point).dot(&sample.step).abs();
            distance - (1.0 - OPEN) * distance.clamp(-open, open)
        };
        let distances: Vec<f64> = self.points.par_iter().map(distance).collect();
        let priors = self.parameters.iter().zip(at.iter()).map(|(p, v)| weight * (v - p.start) / p.spread);
        DVector::from_iterator(self.points.len() + at.len(), distances.into_iter().chain(priors))
    }
}

impl<F: Fn(&[f64]) -> (Body, Vector3<f64>) + Sync> Problem for Fit<'_, F> {
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        Some(self.residuals_at(at).as_slice().to_vec()).filter(|r| r.iter().all(|v| v.is_finite()))
    }

    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        let column = |c: usize| {
            let step = 1e-5 * self.parameters[c].spread;
            let moved = |sign: f64| {
                let mut at = at.to_vec();
                at[c] += sign * step;
                self.residuals_at(&at)
            };
            ((moved(1.0) - moved(-1.0)) / (2.0 * step)).as_slice().to_vec()
        };
        Some((0..at.len()).map(column).collect())
    }
}

/// Fits the parameters; returns them and the root mean square distance of the points, mm.
fn fit(
    what: &str,
    points: &[Sample],
    parameters: &[Parameter],
    body: impl Fn(&[f64]) -> (Body, Vector3<f64>) + Sync,
) -> Result<(Vec<f64>, f64), VolumeError> {
    if points.len() < 10 * parameters.len() {
        return Err(VolumeError::Fit(format!("{what} has only {} border points", points.len())));
    }
    let sparse: Vec<_> = points.iter().copied().step_by(points.len().div_ceil(MOST_POINTS)).collect();
    let mut at: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    let mut problem = Fit { points: &sparse, within_voxels: false, parameters, body };
    // First by plain distances; then without the errors of the voxels' terraces, which all have the same sign on a
    // flat.
    for within_voxels in [false, true] {
        problem.within_voxels = within_voxels;
        let tolerance = if within_voxels { 1e-6 } else { 1e-8 };
        let (solved, report) =
            minimise(&mut problem, &at, &LevenbergMarquardt::new().with_tol(tolerance).with_patience(8));
        at = solved;
        let stopped_early = within_voxels && report.termination == TerminationReason::LostPatience;
        if !(report.termination.was_successful() || stopped_early) {
            return Err(VolumeError::Fit(format!("{what}: {:?}", report.termination)));
        }
    }
    problem.within_voxels = false;
    let residuals = problem.residuals_at(&at);
    let rms = (residuals.rows(0, sparse.len()).norm_squared() / sparse.len() as f64).sqrt();
    Ok((at, rms))
}

/// The outer surface found: in a frame whose origin is the cut's middle.
pub(super) struct OuterFit {
    pub(super) body: Body,
    /// Origin of the finger's frame relative to that of the points, mm; its x is the tip's less the length.
    pub(super) shift: Vector3<f64>,
    pub(super) rms_mm: f64,
}

/// Keeps exponents in the range in which the template is defined.
fn exponent(value: f64) -> f64 {
    value.clamp(2.0, 6.0)
}

/// Fits the outer surface to border points.
///
/// * `points`: mm, x distal, z dorsal; the finger's tip near x = `length_mm`, its axis near y = z = 0
/// * `half`: half width and half thickness of the shaft, roughly, mm
pub(super) fn outer(points: &[Sample], length_mm: f64, half: [f64; 2]) -> Result<OuterFit, VolumeError> {
    let [a, b] = half;
    let of = |start: f64, spread: f64| Parameter { start, spread };
    let parameters = [
        of(a, 2.0),
        of(b, 2.0),
        of(length_mm, 2.0),
        of(1.5 * b, 4.0),
        of(2.5, 1.0),
        of(2.2, 0.6),
        of(0.15, 0.3),
        of(length_mm - 17.0, 3.0),
        of(4.0, 2.0),
        of(0.0, 1.0),
        of(0.0, 1.0),
    ];
    let body = |v: &[f64]| {
        let taper = Taper { slope: v[6].max(0.0), start_mm: v[7], blend_mm: v[8].max(1.0) };
        let body = Body {
            a: v[0].max(1.0),
            b: v[1].max(1.0),
            axis_z: 0.0,
            tip_x: v[2],
            cap: v[3].max(2.0),
            n: exponent(v[4]),
            m: exponent(v[5]),
            taper,
        };
        (body, Vector3::new(0.0, v[9], v[10]))
    };
    let (found, rms_mm) = fit("the skin", points, &parameters, body)?;
    let (mut body, mut shift) = body(&found);
    shift.x = body.tip_x - length_mm;
    body.tip_x -= shift.x;
    body.taper.start_mm -= shift.x;
    Ok(OuterFit { body, shift, rms_mm })
}

/// Fits the bones' surface to border points in the finger's frame.
pub(super) fn bone(points: &[Sample], taper: Taper, length_mm: f64) -> Result<(Body, f64), VolumeError> {
    let most = |f: fn(&Vector3<f64>) -> f64| points.iter().map(|p| f(&p.place)).fold(f64::NEG_INFINITY, f64::max);
    let tip = most(|p| p.x);
    let shaft: Vec<f64> =
        points.iter().map(|p| p.place).filter(|p| p.x < 0.6 * length_mm).map(|p| p.z - taper.height(p.x)).collect();
    let middle = shaft.iter().sum::<f64>() / shaft.len().max(1) as f64;
    let of = |start: f64, spread: f64| Parameter { start, spread };
    let parameters = [
        of(most(|p| p.y).max(0.5), 1.0),
        of(2.0, 1.0),
        of(middle, 1.0),
        of(tip, 1.0),
        of(7.0, 3.0),
        of(2.2, 0.6),
        of(2.4, 0.6),
    ];
    let body = |v: &[f64]| {
        let body = Body {
            a: v[0].max(0.3),
            b: v[1].max(0.3),
            axis_z: v[2],
            tip_x: v[3],
            cap: v[4].max(1.0),
            n: exponent(v[5]),
            m: exponent(v[6]),
            taper,
        };
        (body, Vector3::zeros())
    };
    let (found, rms) = fit("the bone", points, &parameters, body)?;
    Ok((body(&found).0, rms))
}
