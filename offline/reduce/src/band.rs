//! The error band: the half-widths that contain 95 % of the rows that the fit did not use.
//!
//! Main types: [`Band`], [`Coverage`]. The normal force's half-width is a table over depth times a parabola in the stick
//! ratio; that of each friction component a parabola in the stick ratio times the limit. Uses replay, runs.

use fingerpad::build::ParamsOf;
use fingerpad::{ModelOf, Regime, Response};
use serde::{Deserialize, Serialize};

use super::replay::replay;
use super::{Run, Sample};

/// Share of rows that the band must contain.
pub const TARGET: f64 = 0.955;
/// Depth bins of the normal force's table.
const BINS: usize = 5;
/// Least half-width of the normal force, N; far above the rounding of the file's numbers.
const NORMAL_FLOOR_N: f64 = 2e-4;

/// Widest band of friction, share of the limit: a bed so wrong has no use, and the core takes no wider one.
const WIDEST: f64 = 10.0;

/// Shares of rows that lie within the band.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Rows with contact.
    pub rows: usize,
    /// Normal force.
    pub normal: f64,
    /// Friction, both components counted.
    pub friction: f64,
}

/// Half-widths of the bands, in the form of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Depths of the bins' middles, mm, and half-widths of the normal force in full stick there, N.
    pub normal: Vec<(f64, f64)>,
    /// Half-width of the normal force at stick ratios of 0.5 and 0 over that in full stick.
    pub normal_shape: [f64; 2],
    /// Half-width of friction at stick ratios of 1, 0.5 and 0, share of the limit.
    pub friction: [f64; 3],
}

/// One row in contact: depth, stick ratio and regime of the model, and the model's errors.
struct BandRow {
    depth: f64,
    stick: f64,
    regime: Regime,
    normal: f64,
    friction: [f64; 2],
}

fn rows<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[&Run]) -> Vec<BandRow> {
    let row = |(s, r): (&Sample, Response)| {
        let limit = strength_of(model, s.depth_mm);
        (r.regime != Regime::NoContact).then(|| BandRow {
            depth: f64::from(s.depth_mm),
            stick: f64::from(r.stick_ratio),
            regime: r.regime,
            normal: f64::from((r.normal_force_n - s.normal_force_n).abs()),
            friction: [0, 1].map(|k| f64::from((r.friction_n[k] - s.friction_n[k]).abs()) / limit),
        })
    };
    runs.iter().flat_map(|run| run.samples.iter().zip(replay(model, run)).filter_map(row).collect::<Vec<_>>()).collect()
}

/// The strength, N, of which the core's friction band is a share.
fn strength_of<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, depth_mm: f32) -> f64 {
    let data = model.data();
    let x = (depth_mm / data.depth_max * (N - 1) as f32).clamp(0.0, (N - 1) as f32);
    let row = &data.rows[x as usize];
    f64::from(row.limit.value + row.limit.change * (x - x.floor())).max(1e-9)
}

/// The `share` quantile; 0 for an empty list.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}

/// The parabola in the stick ratio that is 1 at 1 and takes the values of `shape` at 0.5 and 0.
fn bow(stick: f64, [middle, slip]: [f64; 2]) -> f64 {
    let [rate, bend] = [4.0 * middle - 3.0 * slip - 1.0, 2.0 * slip + 2.0 - 4.0 * middle];
    slip + stick * (rate + stick * bend)
}

const REGIMES: [Regime; 3] = [Regime::Stick, Regime::PartialSlip, Regime::Slip];

/// Sum over the regimes of the squared distance of their coverage from the target.
fn unevenness(rows: &[BandRow], within: impl Fn(&BandRow) -> (usize, usize)) -> f64 {
    REGIMES
        .iter()
        .map(|regime| {
            let (n, inside) =
                rows.iter().filter(|r| r.regime == *regime).map(&within).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
            if n == 0 { 0.0 } else { (inside as f64 / n as f64 - TARGET).powi(2) }
        })
        .sum()
}

/// Candidates for the values at stick ratios of 0.5 and 0, evenly spaced in their logarithm, whose parabola stays well above 0.
fn shapes() -> impl Iterator<Item = [f64; 2]> {
    let values = || (-16..=16).map(|i| 1.2f64.powi(i));
    let high = |shape: &[f64; 2]| (0..=20).all(|i| bow(0.05 * f64::from(i), *shape) > 0.2 * shape[1].min(1.0));
    values().flat_map(move |middle| values().map(move |slip| [middle, slip])).filter(high)
}

impl Band {
    /// The band that contains 95 % of the rows of `runs`, in the shape whose coverage is most even over the regimes.
    pub fn of<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[&Run]) -> Self {
        let rows = rows(model, runs);
        let mut order: Vec<&BandRow> = rows.iter().collect();
        order.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let bins: Vec<&[&BandRow]> = order.chunks(order.len().div_ceil(BINS).max(1)).collect();
        let table = |shape: [f64; 2]| -> Vec<(f64, f64)> {
            bins.iter()
                .map(|bin| {
                    let width = quantile(bin.iter().map(|r| r.normal / bow(r.stick, shape)).collect(), TARGET);
                    (bin.iter().map(|r| r.depth).sum::<f64>() / bin.len() as f64, width.max(NORMAL_FLOOR_N))
                })
                .collect()
        };
        let best =
            |cost: &dyn Fn([f64; 2]) -> f64| shapes().min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or([1.0; 2]);
        let normal_shape = best(&|shape| {
            let table = table(shape);
            unevenness(&rows, |r| (1, usize::from(r.normal <= interpolate(&table, r.depth) * bow(r.stick, shape))))
        });
        let stick_width = |shape: [f64; 2]| {
            let scaled = rows.iter().flat_map(|r| r.friction.map(|e| e / bow(r.stick, shape))).collect();
            quantile(scaled, TARGET)
        };
        let shape = best(&|shape| {
            let width = stick_width(shape);
            unevenness(&rows, |r| (2, r.friction.iter().filter(|e| **e <= width * bow(r.stick, shape)).count()))
        });
        let width = stick_width(shape);
        Self { normal: table(normal_shape), normal_shape, friction: [width, width * shape[0], width * shape[1]] }
    }

    /// Writes the band into parameters.
    pub fn put<const M: usize, const N: usize>(&self, params: &mut ParamsOf<M, N>) {
        let cell = f64::from(params.depth_max_mm) / (N - 1) as f64;
        for (i, node) in params.nodes.iter_mut().enumerate() {
            node.band_normal_n = interpolate(&self.normal, cell * i as f64) as f32;
        }
        [params.band_normal_middle, params.band_normal_slip] = self.normal_shape.map(|f| f as f32);
        [params.band_friction_stick, params.band_friction_middle, params.band_friction_slip] =
            self.friction.map(|share| share.min(WIDEST) as f32);
    }
}

/// Linear between points, constant beyond them.
fn interpolate(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|p| p.0 <= x);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(p), None) | (None, Some(p)) => p.1,
        (None, None) => 0.0,
    }
}

impl Coverage {
    /// Shares of rows of `runs` within the model's own band, over all and in each regime (stick,
    /// partial slip, slip).
    pub fn of<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[&Run]) -> [Self; 4] {
        let mut counts = [[0usize; 3]; 4];
        for run in runs {
            for (s, r) in run.samples.iter().zip(replay(model, run)) {
                let Some(regime) = REGIMES.iter().position(|k| *k == r.regime) else { continue };
                let normal = usize::from((r.normal_force_n - s.normal_force_n).abs() <= r.band_normal_n);
                let friction =
                    (0..2).filter(|&k| (r.friction_n[k] - s.friction_n[k]).abs() <= r.band_friction_n).count();
                for place in [0, regime + 1] {
                    counts[place][0] += 1;
                    counts[place][1] += normal;
                    counts[place][2] += friction;
                }
            }
        }
        counts.map(|[n, normal, friction]| {
            let share = |k: usize, of: usize| if of > 0 { k as f64 / of as f64 } else { 0.0 };
            Self { rows: n, normal: share(normal, n), friction: share(friction, 2 * n) }
        })
    }

    /// The coverage of the union of two disjoint sets of rows.
    pub fn together(self, other: Self) -> Self {
        let (a, b) = (self.rows as f64, other.rows as f64);
        let mean = |x: f64, y: f64| if a + b > 0.0 { (a * x + b * y) / (a + b) } else { 0.0 };
        Self {
            rows: self.rows + other.rows,
            normal: mean(self.normal, other.normal),
            friction: mean(self.friction, other.friction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parabola_takes_its_values_and_none_of_those_tried_touches_0() {
        assert_eq!([1.0, 0.5, 0.0].map(|s| bow(s, [3.0, 2.0])), [1.0, 3.0, 2.0]);
        assert!(shapes().count() > 300);
        assert!(shapes().all(|shape| (0..=1000).all(|i| bow(1e-3 * f64::from(i), shape) > 0.0)));
    }

    #[test]
    fn quantiles_and_tables() {
        assert_eq!(quantile((0..=100).map(f64::from).collect(), 0.95), 95.0);
        assert_eq!(quantile(vec![], 0.95), 0.0);
        let points = [(1.0, 2.0), (2.0, 4.0)];
        assert_eq!([0.0, 1.5, 9.0].map(|x| interpolate(&points, x)), [2.0, 3.0, 4.0]);
    }
}
