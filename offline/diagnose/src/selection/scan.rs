//! Scan of the library: all laws on a grid of shapes, by derivatives of the model with respect to their sizes.
//!
//! Main types: [`GridPoint`], [`ScoredGridPoint`].

use crate::data::runs::RunSet;
use crate::laws::run_columns;
use crate::laws::{Column, Law, Place};
use crate::model::active_law::ActiveLaw;
use crate::statistics::fit::Fit;
use crate::statistics::products::dot;
use crate::statistics::projection::{ProjectedColumn, Projection};
use crate::statistics::sign_flips::Score;
use crate::statistics::task::Task;

/// A law at one shape of the grid.
pub struct GridPoint {
    /// The law with this shape and size 0.
    pub start: ActiveLaw,
    /// Columns of its linear parameters, over the row noise.
    pub columns: Vec<Vec<f64>>,
}

/// A grid point as a fit sees it.
pub struct ScoredGridPoint {
    /// Index of the grid point.
    pub grid_point: usize,
    /// Its columns, nuisance projected out.
    pub projected: Vec<ProjectedColumn>,
    /// Its score; `None` where the runs have no information on it.
    pub score: Option<Score>,
}

/// Why a law cannot be tested on a set; `None` where it can.
pub fn why_untestable(law: &Law, set: &RunSet) -> Option<String> {
    for &column in law.drivers {
        if let Column::Own { name, .. } = column
            && set.has(column)
            && !varies(set, column)
        {
            return Some(format!("{name} does not vary"));
        }
        if !set.has(column) {
            return Some(format!("{} is not recorded", column.name()));
        }
        let least = run_columns::of(column).map_or(0.0, |known| known.least_spread);
        if least > 0.0 && set.spread(column) < least {
            return Some(format!(
                "{} hardly varies: standard deviation over runs {:.3}",
                column.name(),
                set.spread(column)
            ));
        }
    }
    if law.place == Place::Strength || law.place == Place::Drag {
        let sliding = set.runs.iter().filter(|r| r.rows.iter().any(|w| w.path_mm > 0.05)).count();
        if sliding < 3 {
            return Some(format!("only {sliding} runs slide"));
        }
    }
    let (slow, fast) = set
        .runs
        .iter()
        .flat_map(|r| &r.rows)
        .filter(|r| r.speed_mm_s > 0.0)
        .fold((f64::INFINITY, 0.0f64), |(a, b), r| (a.min(r.speed_mm_s), b.max(r.speed_mm_s)));
    if law.drivers.contains(&Column::Speed) && !(fast > 1.15 * slow) {
        return Some("speed_mm_s hardly varies".to_owned());
    }
    if law.drivers.contains(&Column::Direction) {
        let (mut c, mut s, mut n) = (0.0, 0.0, 0.0);
        for run in &set.runs {
            let row = run.rows.iter().rev().find(|r| r.along != [0.0; 2]);
            if let Some(row) = row {
                c += row.double_angle[0];
                s += row.double_angle[1];
                n += 1.0;
            }
        }
        if !(f64::hypot(c, s) < 0.98 * n) {
            return Some("direction_deg lies on one axis".to_owned());
        }
    }
    None
}

/// Whether a column has more than one value in contact.
fn varies(set: &RunSet, column: Column) -> bool {
    let Column::Own { place, .. } = column else { return true };
    let rows = set.runs.iter().flat_map(|r| &r.rows).filter(|row| row.depth_mm > 0.0);
    let mut values = rows.map(|row| row.own[usize::from(place)]);
    let first = values.next();
    values.any(|v| Some(v) != first)
}

/// The grid of some laws, with columns at a fit.
pub fn grid_of(task: &Task<'_>, fit: &Fit, laws: &[&'static Law]) -> Vec<GridPoint> {
    let prediction = task.predict_at(&fit.parameters, &fit.laws, &fit.random_effects);
    let mut out = Vec::new();
    for &law in laws {
        for shape in law.shapes {
            let start = start_of(law, shape);
            let columns = columns_of(task, fit, &prediction, &start);
            out.push(GridPoint { start, columns });
        }
    }
    out
}

/// A law at zero size with the given shape.
pub fn start_of(law: &'static Law, shape: &[f64]) -> ActiveLaw {
    let mut values = vec![0.0; law.linear];
    values.extend_from_slice(shape);
    ActiveLaw { law, values }
}

/// Columns of the linear parameters of a law that is not in force.
///
/// The step is small: where the random effects of the runs are large, the curvature over a larger step would look like
/// information within the runs, and hide a law that acts between them.
pub fn columns_of(task: &Task<'_>, fit: &Fit, prediction: &[f64], start: &ActiveLaw) -> Vec<Vec<f64>> {
    (0..start.law.linear)
        .map(|k| {
            let step = 0.004 * start.law.parameters[k].typical;
            let mut laws = fit.laws.clone();
            let mut one = start.clone();
            one.values[k] = step;
            laws.push(one);
            task.difference_column(&task.predict_at(&fit.parameters, &laws, &fit.random_effects), prediction, step)
        })
        .collect()
}

/// Scores of all grid points.
pub fn scored(projection: &Projection<'_>, grid: &[GridPoint]) -> Vec<ScoredGridPoint> {
    let mut projected = projection.project_all(grid.iter().flat_map(|g| &g.columns)).into_iter();
    grid.iter()
        .enumerate()
        .map(|(i, point)| {
            let raw: f64 = point.columns.iter().map(|c| dot(c, c)).fold(0.0, f64::max);
            let own: Vec<ProjectedColumn> = projected.by_ref().take(point.columns.len()).collect();
            let score = projection.score(&own.iter().collect::<Vec<_>>(), raw * 1e-3);
            ScoredGridPoint { grid_point: i, projected: own, score }
        })
        .collect()
}
