//! Residuals over the driver of a law, with the fitted law as a curve.
//!
//! Main types: [`DriverPlot`], [`Along`].

use crate::data::runs::Run;
use crate::laws::run_columns;
use crate::laws::{Column, Place, Row};
use crate::model::active_law::{ActiveLaw, set_fitted, to_fitted};
use crate::model::prediction::predict_runs;
use crate::model::random_effects::RandomEffect;
use crate::statistics::fit::Fit;
use crate::verdict::decision::Decision;
use crate::verdict::intervals::FORM_ERROR;

/// Residual over a driver, for a figure.
#[derive(Clone, Debug, Default)]
pub struct DriverPlot {
    /// The law.
    pub law: String,
    /// Column.
    pub column: String,
    /// Channel of the residual.
    pub channel: String,
    /// Driver, relative residual without the effect, the law's relative change there: of each run, or of each row where the driver changes
    /// within a stroke.
    pub points: Vec<[f64; 3]>,
    /// Scatter of a run's residual that the calibration explains, relative, one standard deviation; 0 where points are rows.
    pub run_sd: f64,
    /// Driver, the law's relative change, and half of its 95 % band, rising in the driver.
    pub curve: Vec<[f64; 3]>,
}

/// Slide since touch and since the last turn from which on friction shows the strength, mm: before, it is what the turn left of the friction
/// in the other direction.
pub const FULL_SLIP_MM: f64 = 1.0;
/// Points of a curve.
const CURVE: usize = 48;
/// Runs at which a curve over a column of runs is computed.
const CURVE_RUNS: usize = 5;

impl DriverPlot {
    /// The plot of one of the laws of a decision.
    ///
    /// * `others`: the other laws in force
    /// * `without`, `with`: predictions without the law and with it, N
    /// * `at`: place of its first parameter in the fit's covariance
    /// * `quantile`: standard deviations to the end of a 95 % interval
    pub fn of(
        decision: &Decision<'_>,
        (active, others): (&ActiveLaw, &[ActiveLaw]),
        [without, with]: [&[f64]; 2],
        (at, quantile): (usize, f64),
    ) -> Self {
        let along = Along::of(active);
        let (task, fit) = (&decision.task, &decision.selection.fit);
        let points = along.relative(task.runs, without, &[&task.readings_n, with]);
        let nudged = nudged(active, fit, at);
        let laws = |own: &ActiveLaw| [others, std::slice::from_ref(own)].concat();
        let curve: Vec<Vec<f64>> = if along.in_stroke {
            let moved: Vec<Vec<f64>> =
                nudged.iter().map(|(law, _)| task.predict(&fit.parameters, &laws(law))).collect();
            let mut values = vec![task.readings_n.as_slice(), with];
            values.extend(moved.iter().map(Vec::as_slice));
            let rows = along.relative(task.runs, without, &values);
            let mut bins: Vec<Vec<f64>> = rows.chunks(rows.len().div_ceil(CURVE).max(1)).map(mean).collect();
            bins.iter_mut().for_each(|bin| _ = bin.remove(1));
            bins
        } else {
            let spread = along.spread_runs(task.runs, &points);
            let model = task.reference.model(&fit.parameters);
            let at_value = |x: f64| {
                let runs: Vec<Run> = spread.iter().map(|run| along.moved(run, x)).collect();
                let predict = |law: &ActiveLaw| predict_runs(&model, &runs, &laws(law));
                let moved: Vec<Vec<f64>> =
                    std::iter::once(active).chain(nudged.iter().map(|(law, _)| law)).map(predict).collect();
                let values: Vec<&[f64]> = moved.iter().map(Vec::as_slice).collect();
                let list = along.relative(&runs, &predict_runs(&model, &runs, others), &values);
                (!list.is_empty()).then(|| [&[x], &mean(&list)[1..]].concat())
            };
            let ends = [points.first(), points.last()].map(|p| p.map_or(0.0, |p| p[0]));
            let step = (ends[1] - ends[0]) / (CURVE - 1) as f64;
            (0..CURVE).filter_map(|i| at_value(ends[0] + step * i as f64)).collect()
        };
        let band = |point: &Vec<f64>| {
            let slope = |k: usize| (point[2 + k] - point[1]) / nudged[k].1;
            let n = nudged.len();
            let variance: f64 = (0..n * n)
                .map(|i| (i / n, i % n))
                .map(|(i, j)| slope(i) * slope(j) * fit.covariance[(at + i, at + j)])
                .sum();
            [point[0], point[1], quantile * variance.max(0.0).sqrt().hypot(FORM_ERROR * point[1])]
        };
        let effect = if along.normal { RandomEffect::Stiffness } else { RandomEffect::Strength };
        Self {
            law: active.law.name.into(),
            column: along.column.name().into(),
            channel: if along.normal { "normal force" } else { "friction along the motion" }.into(),
            points: points.into_iter().map(|p| [p[0], p[1], p[2]]).collect(),
            run_sd: if along.in_stroke { 0.0 } else { decision.expected_variances[effect.index()].sqrt() },
            curve: curve.iter().map(band).collect(),
        }
    }
}

/// The law with each of its parameters moved by a part of its standard deviation, and by how much on the scale on which it is fitted.
fn nudged(active: &ActiveLaw, fit: &Fit, at: usize) -> Vec<(ActiveLaw, f64)> {
    let one = |k: usize| {
        let step = 0.1 * fit.covariance[(at + k, at + k)].max(1e-12).sqrt();
        let by = |step: f64| {
            let mut moved = active.clone();
            set_fitted(&mut moved, k, to_fitted(active, k) + step);
            let step = to_fitted(&moved, k) - to_fitted(active, k);
            (moved, step)
        };
        // A parameter at its upper bound moves down.
        [by(step), by(-step)].into_iter().find(|(_, step)| *step != 0.0).unwrap_or_else(|| (active.clone(), 1.0))
    };
    (0..active.values.len()).map(one).collect()
}

/// Mean of each entry over a list.
fn mean(list: &[Vec<f64>]) -> Vec<f64> {
    let sum = |k: usize| list.iter().map(|v| v[k]).sum::<f64>() / list.len() as f64;
    (0..list.first().map_or(0, Vec::len)).map(sum).collect()
}

/// What residuals are plotted over, and of which force.
struct Along {
    /// The law's first driver.
    column: Column,
    /// Whether the normal force is compared; else friction along the motion.
    normal: bool,
    /// Whether the column changes within a stroke.
    in_stroke: bool,
}

impl Along {
    fn of(active: &ActiveLaw) -> Self {
        let column = active.law.drivers.first().copied().unwrap_or(Column::Depth);
        Self {
            column,
            normal: matches!(active.law.place, Place::Stiffness | Place::Depth | Place::Rim),
            in_stroke: matches!(column, Column::Slide | Column::ContactTime | Column::Depth),
        }
    }

    /// Driver, then each of `values` less `without`, relative to `without`: in each row for a driver that changes within a stroke,
    /// otherwise the sums over a run. Rising in the driver; rows in which a value is missing are left out.
    fn relative(&self, runs: &[Run], without: &[f64], values: &[&[f64]]) -> Vec<Vec<f64>> {
        let mut out: Vec<Vec<f64>> = Vec::new();
        let mut i = 0;
        for run in runs {
            let mut sums = vec![0.0; values.len() + 1];
            for row in &run.rows {
                let force = |v: &[f64]| {
                    if self.normal { v[i] } else { v[i + 1] * row.along[0] + v[i + 2] * row.along[1] }
                };
                let base = force(without);
                let changes: Vec<f64> = values.iter().map(|v| force(v) - base).collect();
                i += 3;
                let compared = row.depth_mm > 0.0 && base > 0.02 && (self.normal || row.path_mm > 0.0);
                if !compared || changes.iter().any(|c| !c.is_finite()) {
                    continue;
                }
                if self.in_stroke {
                    let x = run_columns::value(self.column, row);
                    out.push(std::iter::once(x).chain(changes.iter().map(|c| c / base)).collect());
                } else if self.normal || row.path_mm.min(row.turn_mm) > FULL_SLIP_MM {
                    sums.iter_mut().zip(std::iter::once(base).chain(changes)).for_each(|(sum, v)| *sum += v);
                }
            }
            if sums[0] > 0.0 {
                let x = run.value(self.column);
                out.push(std::iter::once(x).chain(sums[1..].iter().map(|s| s / sums[0])).collect());
            }
        }
        out.sort_by(|a, b| a[0].total_cmp(&b[0]));
        out
    }

    /// A few of the runs that have a point, spread over the driver.
    fn spread_runs<'r>(&self, runs: &'r [Run], points: &[Vec<f64>]) -> Vec<&'r Run> {
        let mut list: Vec<&Run> =
            runs.iter().filter(|run| points.iter().any(|p| p[0] == run.value(self.column))).collect();
        list.sort_by(|a, b| a.value(self.column).total_cmp(&b.value(self.column)));
        let step = list.len().div_ceil(CURVE_RUNS).max(1);
        list.into_iter().skip(step / 2).step_by(step).collect()
    }

    /// A run whose driver has another value; the motion stays.
    fn moved(&self, run: &Run, x: f64) -> Run {
        let (mut out, by) = (run.clone(), x - run.value(self.column));
        let state = run_columns::states().find(|(column, _)| *column == self.column);
        let set = |row: &mut Row| match (self.column, state) {
            // A clock of the skin does not run before touch.
            (column, Some((_, set))) => set(row, (run_columns::value(column, row) + by).max(0.0)),
            (Column::Time, _) => row.t_s += by,
            (Column::Speed, _) if row.speed_mm_s > 0.0 => row.speed_mm_s = x,
            (Column::Direction, _) => row.double_angle = [(2.0 * x.to_radians()).cos(), (2.0 * x.to_radians()).sin()],
            (Column::Own { place, .. }, _) => row.own[usize::from(place)] += by,
            _ => {}
        };
        out.rows.iter_mut().for_each(set);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow, run_of};
    use crate::laws::find;

    /// Friction of 0.5 N that a law raises by a fifth: after a turn it passes zero later, which is no weaker friction.
    #[test]
    fn a_turn_is_no_part_of_the_residual_over_a_state() {
        let slide = |t: f64| if t <= 0.3 { 10.0 * t } else { 6.0 - 10.0 * t };
        let row = |i: usize| {
            let t = 0.01 * i as f64;
            RawRow {
                hydration_au: 50.0,
                contact_time_s: t,
                ..RawRow::bare(i, t, 1.0, [slide(t), 0.0], [1.0, 0.5, 0.0])
            }
        };
        let rows: Vec<RawRow> = (0..=60).map(row).collect();
        let run = run_of("m.csv".as_ref(), Labels::default(), &rows).unwrap();
        let friction = |limit: f64| -> Vec<f64> {
            // Elastic with 2.4 N/mm from the turn on.
            let at = |row: &crate::laws::Row| {
                let turned = row.along[0] < 0.0;
                let along = if turned { (2.4 * row.turn_mm - limit).min(limit) } else { limit };
                [1.0, along * row.along[0], 0.0]
            };
            run.rows.iter().flat_map(at).collect()
        };
        let (without, with) = (friction(0.5), friction(0.6));
        let law = find("hydration_bell").unwrap();
        let active = ActiveLaw { law, values: law.parameters.iter().map(|p| p.typical).collect() };
        let points = Along::of(&active).relative(&[run], &without, &[&with, &with]);
        let [hydration, residual, fitted] = points[0][..] else { panic!("{points:?}") };
        assert_eq!(points.len(), 1);
        assert_eq!(hydration, 50.0);
        assert!((residual - 0.2).abs() < 1e-9 && (fitted - residual).abs() < 1e-12, "{residual} {fitted}");
    }
}
