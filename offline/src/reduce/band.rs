//! The error band: how wide it must be for 95 % of what the fit did not see to lie within.
//!
//! Main types: [`Band`], [`Coverage`]. The normal force's half-width is a table over depth times a straight line in
//! the stick ratio; that of each friction component a straight line in the stick ratio times the limit. Uses replay,
//! runs.

use fingerpad::{ModelOf, ParamsOf, Regime, Response};
use serde::{Deserialize, Serialize};

use super::replay::replay;
use super::{Run, Sample};

/// Share of rows that the band is made to cover.
pub const TARGET: f64 = 0.955;
/// Depth bins of the normal force's table.
const BINS: usize = 5;
/// Least half-width of the normal force, N: what the file's floats resolve is far below.
const NORMAL_FLOOR_N: f64 = 2e-4;

/// What share of rows lies within the band.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Rows with contact.
    pub rows: usize,
    /// Normal force.
    pub normal: f64,
    /// Friction, both components counted.
    pub friction: f64,
}

/// Half-widths, ready to be put into parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Depths of the bins' middles, mm, and half-widths of the normal force in full stick there, N.
    pub normal: Vec<(f64, f64)>,
    /// Half-width of the normal force in full slip over that in full stick.
    pub normal_slip: f64,
    /// Half-width of friction in full stick and full slip, share of the limit.
    pub friction: [f64; 2],
}

/// One row in contact: what the model says of it and how wrong it is.
struct Row {
    depth: f64,
    stick: f64,
    regime: Regime,
    normal: f64,
    friction: [f64; 2],
}

fn rows<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[&Run]) -> Vec<Row> {
    let row = |(s, r): (&Sample, Response)| {
        let limit = strength_of(model, s.depth_mm);
        (r.regime != Regime::NoContact).then(|| Row {
            depth: f64::from(s.depth_mm),
            stick: f64::from(r.stick_ratio),
            regime: r.regime,
            normal: f64::from((r.normal_force_n - s.normal_force_n).abs()),
            friction: [0, 1].map(|k| f64::from((r.friction_n[k] - s.friction_n[k]).abs()) / limit),
        })
    };
    runs.iter().flat_map(|run| run.samples.iter().zip(replay(model, run)).filter_map(row).collect::<Vec<_>>()).collect()
}

/// The strength L that the core's friction band is a share of.
fn strength_of<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, depth_mm: f32) -> f64 {
    let data = model.data();
    let x = (depth_mm / data.depth_max * (N - 1) as f32).clamp(0.0, (N - 1) as f32);
    let row = &data.rows[x as usize];
    f64::from(row.limit.value + row.limit.change * (x - x.floor())).max(1e-9)
}

/// The `share` quantile; 0 of nothing.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}

fn line(stick: f64, at_slip: f64) -> f64 {
    1.0 + (at_slip - 1.0) * (1.0 - stick)
}

const REGIMES: [Regime; 3] = [Regime::Stick, Regime::PartialSlip, Regime::Slip];

/// How far the coverage of every regime is from the target, and that of all.
fn unevenness(rows: &[Row], within: impl Fn(&Row) -> (usize, usize)) -> f64 {
    REGIMES
        .iter()
        .map(|regime| {
            let (n, inside) =
                rows.iter().filter(|r| r.regime == *regime).map(&within).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
            if n == 0 { 0.0 } else { (inside as f64 / n as f64 - TARGET).powi(2) }
        })
        .sum()
}

/// Slopes that are tried for the dependence on the stick ratio, evenly in their logarithm.
fn slopes() -> impl Iterator<Item = f64> {
    (-24..=24).map(|i| 1.15f64.powi(i)).filter(|s| *s <= 19.0)
}

impl Band {
    /// The narrowest even band over `runs`.
    pub fn of<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[&Run]) -> Self {
        let rows = rows(model, runs);
        let mut order: Vec<&Row> = rows.iter().collect();
        order.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let bins: Vec<&[&Row]> = order.chunks(order.len().div_ceil(BINS).max(1)).collect();
        let table = |slip: f64| -> Vec<(f64, f64)> {
            bins.iter()
                .map(|bin| {
                    let width = quantile(bin.iter().map(|r| r.normal / line(r.stick, slip)).collect(), TARGET);
                    (bin.iter().map(|r| r.depth).sum::<f64>() / bin.len() as f64, width.max(NORMAL_FLOOR_N))
                })
                .collect()
        };
        let best = |cost: &dyn Fn(f64) -> f64| slopes().min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(1.0);
        let normal_slip = best(&|slip| {
            let table = table(slip);
            unevenness(&rows, |r| (1, usize::from(r.normal <= interpolate(&table, r.depth) * line(r.stick, slip))))
        });
        let stick_width = |slip: f64| {
            let scaled = rows.iter().flat_map(|r| r.friction.map(|e| e / line(r.stick, slip))).collect();
            quantile(scaled, TARGET)
        };
        let slip = best(&|slip| {
            let width = stick_width(slip);
            unevenness(&rows, |r| (2, r.friction.iter().filter(|e| **e <= width * line(r.stick, slip)).count()))
        });
        let width = stick_width(slip);
        Self { normal: table(normal_slip), normal_slip, friction: [width, width * slip] }
    }

    /// Puts the band into parameters.
    pub fn put<const M: usize, const N: usize>(&self, params: &mut ParamsOf<M, N>) {
        let cell = f64::from(params.depth_max_mm) / (N - 1) as f64;
        for (i, node) in params.nodes.iter_mut().enumerate() {
            node.band_normal_n = interpolate(&self.normal, cell * i as f64) as f32;
        }
        params.band_normal_slip = self.normal_slip as f32;
        [params.band_friction_stick, params.band_friction_slip] = self.friction.map(|f| f as f32);
    }
}

/// Straight between points, constant beyond them.
fn interpolate(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|p| p.0 <= x);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(p), None) | (None, Some(p)) => p.1,
        (None, None) => 0.0,
    }
}

impl Coverage {
    /// Shares of rows of `runs` within the band that the model itself tells, over all and in each regime (stick,
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

    /// The coverages of two disjoint sets of rows together.
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
    fn quantiles_and_tables() {
        assert_eq!(quantile((0..=100).map(f64::from).collect(), 0.95), 95.0);
        assert_eq!(quantile(vec![], 0.95), 0.0);
        let points = [(1.0, 2.0), (2.0, 4.0)];
        assert_eq!([0.0, 1.5, 9.0].map(|x| interpolate(&points, x)), [2.0, 3.0, 4.0]);
    }
}
