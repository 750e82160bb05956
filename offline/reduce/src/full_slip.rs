//! Friction of a bed of springs in full slip, bound to a law of the normal force.
//!
//! Main type: [`FullSlipLaw`]. The strengths of the springs then follow from the normal force at each depth; the fit decides only how they
//! are shared out. Uses runs and `fingerpad`.

use fingerpad::build::ParamsOf;
use nalgebra::{Matrix3, Vector3};

use super::Run;
use crate::parameterisation::{ALLOWED, ODD_MAX, REACH, YIELD_MAX_MM};

/// Friction over normal force in full slip where the plane moves along +x, along −x and along y, over the normal force N in N:
/// exp(a + b ln N + c ln² N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullSlipLaw([[f64; 3]; 3]);

/// Largest stick ratio of full slip.
const SLIPS: f32 = 0.02;
/// Largest angle between a slide and an axis, as its sine.
const ALONG: f32 = 0.1;
/// Least number of rows for a law with a slope, and normal force of a row over the largest.
const FEW: usize = 6;
const LOADED: f64 = 0.01;
/// Weight of the prior that keeps the slope and the bend of a law of few rows small, in rows.
const PRIOR: [f64; 3] = [0.0, 0.02, 0.2];
/// Most changes of the yield slides at a depth, and their relative change at the end.
const ROUNDS: usize = 60;
const BOUND: f64 = 1e-5;
/// Most iterations for the yield slides at a depth, which the normal force depends on, and their relative change at the end.
const MOST_ROUNDS: usize = 200;
const FOUND: f64 = 1e-7;
/// Largest factor on the yield slides of a fit.
const LONGEST: f64 = 100.0;
/// Bounds of the tilt of a limit and of the strength ratio, within those of the core.
const TILT: f64 = 0.249;
const RATIO: [f64; 2] = [0.51, 1.95];

impl FullSlipLaw {
    /// Coulomb's law.
    pub fn coulomb(lambda: f64) -> Self {
        Self([[lambda.ln(), 0.0, 0.0]; 3])
    }

    /// The law of the rows in full slip of runs in one pose on a plane; None if there are too few of them.
    pub fn of(runs: &[(&Run, f64)]) -> Option<Self> {
        let mut rows: [Vec<[f64; 3]>; 3] = Default::default();
        let largest =
            runs.iter().flat_map(|(run, _)| &run.samples).map(|s| f64::from(s.normal_force_n)).fold(0.0, f64::max);
        for (run, weight) in runs.iter().filter(|(run, _)| !run.spins()) {
            for pair in run.samples.windows(2) {
                let [x, y] = [0, 1].map(|k| pair[1].slide_mm[k] - pair[0].slide_mm[k]);
                let sample = &pair[1];
                let friction = f64::from(sample.friction_n[0].hypot(sample.friction_n[1]));
                let normal = f64::from(sample.normal_force_n);
                if sample.stick_ratio > SLIPS || !(friction > 0.0 && normal > LOADED * largest) {
                    continue;
                }
                let direction = match (x, y) {
                    _ if y.abs() < ALONG * x => 0,
                    _ if y.abs() < -ALONG * x => 1,
                    _ if x.abs() < ALONG * y.abs() => 2,
                    _ => continue,
                };
                rows[direction].push([normal.ln(), (friction / normal).ln(), *weight]);
            }
        }
        if rows.iter().any(|rows| rows.len() < FEW) {
            // Without slides along each of the axes one law is that of all directions.
            let all: Vec<[f64; 3]> = rows.concat();
            return (all.len() >= FEW).then(|| Self([parabola(&all); 3]));
        }
        Some(Self(rows.map(|rows| parabola(&rows))))
    }

    fn coefficient(&self, direction: usize, normal_n: f64) -> f64 {
        let ([a, b, c], log) = (self.0[direction], normal_n.ln());
        (a + log * (b + log * c)).exp()
    }

    /// Sets the yield slides, the tilt and the strength ratio at each depth, so that friction in full slip follows the law.
    pub fn bind<const M: usize, const N: usize>(&self, params: &mut ParamsOf<M, N, f64>) {
        let rows = params.build_unchecked().rows;
        let shares = params.springs.map(|spring| spring.stiffness_share);
        let all: f64 = shares.iter().sum();
        let q = params.odd_per_mm;
        let most_mm = YIELD_MAX_MM.min(ALLOWED * ODD_MAX / (REACH * q.abs()).max(1e-9));
        let mut last = [0.0; M];
        for (node, row) in params.nodes.iter_mut().zip(&rows).skip(1) {
            let [kx, ky] = [row.stiffness_x.value, row.stiffness_y.value];
            let target_of = |normal: f64, k: usize| self.coefficient(k, normal) * normal / kx;
            for _ in 0..ROUNDS {
                let moment = |power: i32| {
                    shares.iter().zip(&node.yield_slide_mm).map(|(k, r)| k / all * r.powi(power)).sum::<f64>()
                };
                let [first, second, third] = [1, 2, 3].map(moment);
                if !(first > 0.0) || !(node.normal_force_n > 0.0) {
                    break;
                }
                let [slope_x, slope_y] = node.stiffness_slope_n_mm2;
                // Yield slides ahead, back and across, over those of the fit. From 0 the search ends at the least of its roots: with
                // friction the normal force rises, and with it the limit.
                let mut slides = [0.0; 3];
                for _ in 0..MOST_ROUNDS {
                    let [ahead, back, across] = slides;
                    let along = |slide: f64| slide * (first - q * slide * second);
                    let energy = |slide: f64| slide * slide * (0.5 * second - q / 3.0 * slide * third);
                    let normals = [
                        node.normal_force_n + node.press_coupling * kx * along(ahead) + slope_x * energy(ahead),
                        node.normal_force_n + node.press_coupling * kx * along(-back) + slope_x * energy(-back),
                        node.normal_force_n + slope_y * 0.5 * second * (across * kx / ky).powi(2),
                    ];
                    let target = |k: usize| target_of(normals[k].max(0.05 * node.normal_force_n), k);
                    // slide (first − q slide second) = target, the root that is near target / first.
                    let root = |target: f64, q: f64| {
                        let under = (first * first - 4.0 * q * second * target).max(0.0);
                        2.0 * target / (first + under.sqrt())
                    };
                    let next =
                        [root(target(0), q), root(target(1), -q), target(2) / first].map(|slide| slide.min(LONGEST));
                    let is_found = next.iter().zip(&slides).all(|(next, last)| (next - last).abs() <= FOUND * next);
                    slides = next;
                    if is_found {
                        break;
                    }
                }
                let [ahead, back, across] = slides;
                let scale = (ahead * back).sqrt();
                node.tilt_x = (0.5 * (ahead - back) / scale).clamp(-TILT, TILT);
                node.strength_ratio = (across / scale).clamp(RATIO[0], RATIO[1]);
                // No spring yields earlier at a larger depth, and none later than any may: the others make up for it.
                let bounded = |slide: f64, last: f64| (scale * slide).max(last).min(most_mm);
                let slides = std::array::from_fn(|j| bounded(node.yield_slide_mm[j], last[j]));
                let is_bound = (0..M).all(|j| (slides[j] - node.yield_slide_mm[j]).abs() <= BOUND * slides[j]);
                node.yield_slide_mm = slides;
                if is_bound {
                    break;
                }
            }
            last = node.yield_slide_mm;
        }
        // Nothing is known of the limit at first touch but its shape.
        let [first, next, ..] = params.nodes.as_mut_slice() else { return };
        (first.tilt_x, first.strength_ratio) = (next.tilt_x, next.strength_ratio);
    }
}

/// Weighted least squares of a parabola; the prior is at a constant.
fn parabola(rows: &[[f64; 3]]) -> [f64; 3] {
    let weight: f64 = rows.iter().map(|[_, _, weight]| weight).sum();
    let mut matrix = Matrix3::from_diagonal(&Vector3::from(PRIOR.map(|prior| prior * weight / rows.len() as f64)));
    let mut right = Vector3::zeros();
    for [log, value, weight] in rows {
        let powers = Vector3::new(1.0, *log, log * log);
        matrix += powers * powers.transpose() * *weight;
        right += powers * (weight * value);
    }
    matrix.lu().solve(&right).map_or([0.0; 3], Into::into)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use fingerpad::{Motion, State};

    use super::*;
    use crate::parameterisation::{InitialGuess, Parameterisation, rounded};

    /// Friction over normal force of a bed in full slip, at depths between the nodes and in eight directions.
    #[test]
    fn a_bed_bound_to_coulombs_law_obeys_it() {
        let layout = Parameterisation::new(12, 4, 2.5, 1.0);
        let mut theta = layout.start(&[0.0, 0.1, 0.8, 1.1], &InitialGuess::of_a_finger());
        // Couplings, tilt and odd stiffness as those of a fit.
        let of_forces = layout.of_forces(4);
        theta[of_forces.end - 12..of_forces.end].iter_mut().for_each(|number| *number = 0.1);
        let mut params = layout.params::<4, 37>(&theta);
        FullSlipLaw::coulomb(0.7).bind(&mut params);
        let data = rounded(&params).try_build().unwrap();
        let model = data.model().unwrap();
        for depth_mm in [0.02, 0.1, 0.33, 0.7, 1.2, 2.4] {
            for direction in 0..8 {
                let (sin, cos) = (TAU * f64::from(direction) / 8.0).sin_cos();
                let mut state = State::default();
                let mut last = fingerpad::Response::IN_THE_AIR;
                for k in 0..1500 {
                    let slide = if k > 10 { 0.01 } else { 0.0 };
                    let slide_increment_mm = [slide * cos as f32, slide * sin as f32];
                    let motion = Motion { depth_mm, slide_increment_mm, dt_s: 1e-3, ..Motion::default() };
                    last = fingerpad::step(&model, &mut state, motion);
                }
                let ratio = last.friction_n[0].hypot(last.friction_n[1]) / last.normal_force_n;
                // The law is imposed along the axes; between them the limit is an ellipse.
                let most = if direction % 2 == 0 { 3e-3 } else { 1e-2 };
                assert!((ratio / 0.7 - 1.0).abs() < most, "{depth_mm} mm, direction {direction}: {ratio}");
            }
        }
    }

    #[test]
    fn a_law_is_found_in_rows() {
        let rows: Vec<[f64; 3]> =
            (1..40).map(|k| 0.1 * f64::from(k)).map(|n: f64| [n.ln(), (0.5 * n.powf(-0.2)).ln(), 1.0]).collect();
        let law = FullSlipLaw([parabola(&rows); 3]);
        for normal in [0.2, 1.0, 3.0] {
            assert!((law.coefficient(1, normal) / (0.5 * f64::powf(normal, -0.2)) - 1.0).abs() < 5e-3);
        }
    }
}
