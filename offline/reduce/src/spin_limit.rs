//! Limit of friction and moment together, from the finite elements in full slip.
//!
//! Main type: [`SpinLimit`]. Uses replay.

use fingerpad::Regime;
use fingerpad::build::{DataOf, Line, ParamsOf};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};

use super::Run;
use super::replay::{replay, spin_moment};

/// Least depth of the rows of the fit, share of the largest depth. At smaller depths both limits are small and their quotients inaccurate.
const SHALLOW: f64 = 0.1;
/// Bounds of the share of all springs' moment, at any depth.
const SHARE: [f64; 2] = [0.5, 1.0];
/// Largest rise, share of the largest depth.
const RISE_MAX: f64 = 0.5;
/// Start of the search for share, rise and cross term, and centre of the prior.
const START: [f64; 3] = [0.95, 0.05, 0.0];
/// Standard deviations of the prior on the three numbers, which matters where the rows do not determine them.
const PRIOR: [f64; 3] = [3.0, 0.3, 3.0];
/// Step of the finite differences.
const DIFFERENCE: f64 = 1e-5;

/// The limit f² + (m/s)² + c |f| |m/s| = 1 of friction f over its limit and moment m over that of all springs on theirs. The share s
/// rises over depth d as 1 − exp(−d/r) to its value at large depths: in a light contact the rim carries a smaller part of the load than in
/// the bed of springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinLimit {
    /// s at large depths.
    pub share: f64,
    /// r over the largest depth of the tables; 0 for the same share at every depth.
    pub rise: f64,
    /// c.
    pub cross: f64,
}

impl SpinLimit {
    /// Least-squares fit to the rows of `runs` in full slip of the finite elements. Without such rows, the full moment of the springs and an
    /// ellipsoid.
    pub fn of<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> Self {
        let rows: Vec<FullSlip> = runs.iter().flat_map(|run| in_full_slip(data, run)).collect();
        if rows.is_empty() {
            return Self { share: 1.0, rise: 0.0, cross: 0.0 };
        }
        let minimiser = LevenbergMarquardt::new().with_ftol(1e-9).with_xtol(1e-9);
        let (found, _) = minimise(&mut Limits { rows: &rows }, &START, &minimiser);
        Self::within(&found)
    }

    /// From share, rise and cross term, each clamped to its bounds.
    fn within(numbers: &[f64]) -> Self {
        let [share, rise, cross] = [numbers[0], numbers[1], numbers[2]];
        Self { share: share.clamp(SHARE[0], SHARE[1]), rise: rise.clamp(0.0, RISE_MAX), cross: cross.clamp(0.0, 1.0) }
    }

    /// s at a depth over the largest.
    fn share_at(self, depth_share: f64) -> f64 {
        let risen = if self.rise > 0.0 { -(-depth_share / self.rise).exp_m1() } else { 1.0 };
        (self.share * risen).clamp(SHARE[0], SHARE[1])
    }

    /// Writes it into the parameters of a model.
    pub fn put<const M: usize, const N: usize>(self, params: &mut ParamsOf<M, N, f64>) {
        params.spin_cross = self.cross;
        for (i, node) in params.nodes.iter_mut().enumerate() {
            node.spin_limit_share = self.share_at(i as f64 / (N - 1) as f64);
        }
    }
}

/// The fit: a residual is the distance of a row from the limit.
struct Limits<'a> {
    rows: &'a [FullSlip],
}

impl Problem for Limits<'_> {
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        let limit = SpinLimit::within(at);
        let missed = |row: &FullSlip| {
            let (f, m) = (row.friction, row.of_springs / limit.share_at(row.depth_share));
            (f * f + m * m + limit.cross * f * m).sqrt() - 1.0
        };
        let prior = [0, 1, 2].map(|k| 0.01 * (at[k] - START[k]) / PRIOR[k]);
        Some(self.rows.iter().map(missed).chain(prior).collect())
    }

    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        let here = self.residuals(at)?;
        let mut column = |k: usize| {
            let mut to = at.to_vec();
            to[k] += DIFFERENCE;
            let there = self.residuals(&to)?;
            Some(there.iter().zip(&here).map(|(t, h)| (t - h) / DIFFERENCE).collect())
        };
        (0..at.len()).map(&mut column).collect()
    }
}

/// Friction and moment of a contact in full slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullSlip {
    /// Depth over the largest of the tables.
    pub depth_share: f64,
    /// Friction over the model's limit.
    pub friction: f64,
    /// Moment over the model's limit under spin alone.
    pub moment: f64,
    /// Moment over that of all springs on their limit.
    pub of_springs: f64,
}

/// The rows of a run in full slip of the finite elements.
pub fn in_full_slip<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, run: &Run) -> Vec<FullSlip> {
    let model = data.model_unchecked();
    let mut out = Vec::new();
    for (sample, r) in run.samples.iter().zip(&replay(&model, run)) {
        let Some(moment) = spin_moment(sample) else { continue };
        let depth_mm = f64::from(sample.depth_mm);
        if sample.regime != Regime::Slip || depth_mm < SHALLOW * data.depth_max || r.regime == Regime::NoContact {
            continue;
        }
        let x = depth_mm * data.cells_per_mm;
        let i = (x as usize).min(N - 1);
        let row = &data.rows[i];
        let at = |line: &Line<f64>| line.value + line.change * (x - i as f64).min(1.0);
        let [fx, fy] = sample.friction_n.map(f64::from);
        let moment = moment - at(&row.friction_centre) * fy;
        let moment = moment.abs() / at(&row.spin_limit);
        let [left, right] = [i, i + 1].map(|node| data.spin_limit_share(node));
        out.push(FullSlip {
            depth_share: depth_mm / data.depth_max,
            friction: fx.hypot(fy) / r.friction_limit_n,
            moment,
            of_springs: moment * (left + (right - left) * (x - i as f64)),
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Kind, Sample, Turned};
    use fingerpad::build::Params;
    use fingerpad::{NODES, SPRINGS};
    use fingerpad_fe::experiment::RigidBodySettings;
    use fingerpad_fe::load_path::{Drive, Path};

    type Data = DataOf<SPRINGS, NODES, f64>;

    /// The fit recovers a planted limit, also with 2 % of noise; without rows it returns the full moment of the springs.
    #[test]
    fn a_planted_limit_is_found() {
        let data = Params::example().try_build().unwrap().cast::<f64>();
        let planted = SpinLimit { share: 0.93, rise: 0.12, cross: 0.31 };
        for (noise, bound) in [(0.0, 0.01), (0.02, 0.04)] {
            let run = run_on(&data, planted, noise);
            let found = SpinLimit::of(&data, &[&run]);
            let off = [found.share - planted.share, found.rise - planted.rise].map(f64::abs);
            assert!(off[0].max(off[1]) < bound && (found.cross - planted.cross).abs() < 2.0 * bound, "{found:?}");
        }
        assert_eq!(SpinLimit::of(&data, &[]), SpinLimit { share: 1.0, rise: 0.0, cross: 0.0 });
    }

    /// A run whose rows are in full slip, on a given limit.
    fn run_on(data: &Data, planted: SpinLimit, noise: f64) -> Run {
        let sample = |k: usize| {
            let depth_mm = 0.3 + 0.15 * (k / 9) as f32;
            let (m, f) = ((k % 9) as f64 * std::f64::consts::FRAC_PI_2 / 8.0).sin_cos();
            let wobble = 1.0 + noise * ((7 * k % 11) as f64 / 5.0 - 1.0);
            let length = wobble / (1.0 + planted.cross * f * m).sqrt();
            let x = f64::from(depth_mm) * data.cells_per_mm;
            let row = &data.rows[x as usize];
            let at = |line: &Line<f64>| line.value + line.change * (x - x.floor());
            let friction = length * f * at(&row.limit) * at(&row.limit_ratio);
            let share = planted.share_at(f64::from(depth_mm) / data.depth_max);
            let moment = length * m * share / data.spin_limit_share(x as usize) * at(&row.spin_limit);
            Sample {
                t_s: 1.0 + k as f32,
                depth_mm,
                slide_mm: [0.0, 3.0 + 0.3 * k as f32],
                normal_force_n: 0.3,
                friction_n: [0.0, friction as f32],
                contact_area_mm2: 50.0,
                stick_ratio: 0.0,
                regime: Regime::Slip,
                turned: Some(Turned {
                    moment_n_mm: [0.0, 0.0, (moment + at(&row.friction_centre) * friction) as f32],
                    ..Turned::default()
                }),
            }
        };
        let start = Sample { t_s: 0.0, depth_mm: 0.0, slide_mm: [0.0; 2], ..sample(0) };
        Run {
            name: "planted".into(),
            kind: Kind::SpinSlide,
            held_out: false,
            settings_hash: String::new(),
            body: RigidBodySettings::default(),
            path: Path::new([Drive::Displacement; 3], vec![]),
            samples: std::iter::once(start).chain((0..90).map(sample)).collect(),
            ended_early: None,
            cpu_s: 0.0,
        }
    }
}
