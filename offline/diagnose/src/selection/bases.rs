//! Smooth bases of every column, by which structure is sought that no law explains.
//!
//! Main type: [`BasisGroup`]. A basis modulates strength or stiffness inside the model.

use std::f64::consts::TAU;

use crate::data::runs::RunSet;
use crate::laws::run_columns;
use crate::laws::{Column, Row};
use crate::model::random_effects::RandomEffect;
use crate::statistics::derivatives::Derivatives;
use crate::statistics::task::Task;

/// A group of modulations along one column, tested together.
pub struct BasisGroup {
    /// Column of the runs.
    pub column: String,
    /// `normal` or `friction`.
    pub channel: &'static str,
    /// Number among the groups that lie along the stroke, where the baseline's form can be wrong.
    pub along_stroke: Option<usize>,
    /// One column of observations per basis, over the row noise.
    pub columns: Vec<Vec<f64>>,
}

/// A basis function: value at (number of the run, number of the row, the row).
type Basis<'a> = Box<dyn Fn(usize, usize, &Row) -> f64 + 'a>;

/// A modulation of strength or stiffness by m(run, row, values of the row), over the row noise.
///
/// `uniform`: response of the readings to a uniform change, a random effect's column. It is scaled row by row, which
/// neglects the memory of elements that stick.
fn modulated(task: &Task<'_>, uniform: &[f64], m: &dyn Fn(usize, usize, &Row) -> f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(uniform.len());
    for (index, run) in task.runs.iter().enumerate() {
        for (i, row) in run.rows.iter().enumerate() {
            let factor = m(index, i, row);
            let at = out.len();
            out.extend(uniform[at..at + 3].iter().map(|u| u * factor));
        }
    }
    out
}

/// Ranks of the runs' values of a column, mapped to −1 to 1.
fn ranks(set: &RunSet, column: Column) -> Option<Vec<f64>> {
    let values: Vec<f64> = set.runs.iter().map(|r| r.value(column)).collect();
    if values.iter().any(|v| !v.is_finite()) || !(set.spread(column) > 1e-9) {
        return None;
    }
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut out = vec![0.0; values.len()];
    let n = values.len() as f64;
    let mut i = 0;
    while i < order.len() {
        // Equal values share the middle of their ranks.
        let mut j = i;
        while j + 1 < order.len() && values[order[j + 1]] == values[order[i]] {
            j += 1;
        }
        let rank = (2.0 * (i + j) as f64 / 2.0 + 1.0) / n - 1.0;
        for k in i..=j {
            out[order[k]] = rank;
        }
        i = j + 1;
    }
    Some(out)
}

/// Columns whose patterns run along a stroke.
const STROKE_COLUMNS: [&str; 7] =
    ["direction_deg", "slide", "contact_time_s", "slide_x_mm", "slide_y_mm", "slide_x_mm,slide_y_mm", "depth_mm"];

/// All groups of a set; only those along the stroke if `only_strokes`.
pub fn basis_groups(task: &Task<'_>, set: &RunSet, derivatives: &Derivatives, only_strokes: bool) -> Vec<BasisGroup> {
    let mut groups = Groups { task, derivatives, only_strokes, strokes: 0, list: Vec::new() };
    let has = |c: &Column| set.has(*c);
    let ranked: Vec<(Column, Vec<f64>)> =
        run_columns::of_runs().chain([Column::Depth]).filter(has).filter_map(|c| Some((c, ranks(set, c)?))).collect();
    groups.add_polynomials(&ranked);
    groups.add_slow_waves(&ranked);
    groups.add_directions();
    groups.add_places();
    groups.add_decays();
    groups.add_products(&ranked);
    groups.list
}

/// Groups on their way.
struct Groups<'a> {
    task: &'a Task<'a>,
    derivatives: &'a Derivatives,
    only_strokes: bool,
    /// Number of groups along the stroke so far.
    strokes: usize,
    list: Vec<BasisGroup>,
}

/// A basis with one value a run.
fn per_run<'a>(values: Vec<f64>) -> Basis<'a> {
    Box::new(move |run, _, _| values[run])
}

impl Groups<'_> {
    /// Adds a group that modulates strength or stiffness.
    fn add(&mut self, column: &str, acts_on: RandomEffect, functions: Vec<Basis<'_>>) {
        let is_stroke = STROKE_COLUMNS.contains(&column);
        if self.only_strokes && !is_stroke {
            return;
        }
        let uniform = self.derivatives.random_effects.column(acts_on);
        let columns = functions.iter().map(|f| modulated(self.task, uniform, f.as_ref())).collect();
        let channel = if acts_on == RandomEffect::Strength { "friction" } else { "normal" };
        let along_stroke = is_stroke.then(|| {
            self.strokes += 1;
            self.strokes
        });
        self.list.push(BasisGroup { column: column.to_owned(), channel, along_stroke, columns });
    }

    /// Cubics in the rank of each column that is one value a run.
    fn add_polynomials(&mut self, ranked: &[(Column, Vec<f64>)]) {
        for (column, r) in ranked {
            for acts_on in [RandomEffect::Strength, RandomEffect::Stiffness] {
                let power = |p: i32| per_run(r.iter().map(|x| x.powi(p)).collect());
                self.add(column.name(), acts_on, vec![power(1), power(2), power(3)]);
            }
        }
    }

    /// Slow waves of the clock.
    fn add_slow_waves(&mut self, ranked: &[(Column, Vec<f64>)]) {
        let Some((_, r)) = ranked.iter().find(|(c, _)| *c == Column::Time) else { return };
        for waves in [1.5, 2.5, 3.5, 5.0, 7.0] {
            for acts_on in [RandomEffect::Strength, RandomEffect::Stiffness] {
                let wave = |shift: f64| per_run(r.iter().map(|x| (TAU * 0.5 * waves * x + shift).sin()).collect());
                self.add("t_s", acts_on, vec![wave(0.0), wave(TAU / 4.0)]);
            }
        }
    }

    /// Harmonics of the direction.
    fn add_directions(&mut self) {
        for harmonic in [1.0, 3.0, 4.0] {
            let wave = |shift: f64| -> Basis<'_> {
                Box::new(move |_, _, row| {
                    if row.along == [0.0; 2] {
                        0.0
                    } else {
                        (harmonic * row.along[1].atan2(row.along[0]) + shift).cos()
                    }
                })
            };
            self.add("direction_deg", RandomEffect::Strength, vec![wave(0.0), wave(-TAU / 4.0)]);
        }
    }

    /// Position of the plate: waves along x and y, and bumps.
    fn add_places(&mut self) {
        let runs = self.task.runs;
        for period in [0.6, 0.8, 1.05, 1.4, 1.9, 2.6, 3.6] {
            for (axis, column) in ["slide_x_mm", "slide_y_mm"].into_iter().enumerate() {
                let wave = |shift: f64| -> Basis<'_> {
                    Box::new(move |run, i, row| {
                        if row.path_mm > 0.0 { (TAU * runs[run].slide_mm[i][axis] / period + shift).sin() } else { 0.0 }
                    })
                };
                self.add(column, RandomEffect::Strength, vec![wave(0.0), wave(TAU / 4.0)]);
            }
        }
        for cx in [-3.0, -1.0, 1.0, 3.0] {
            let bump = |cy: f64| -> Basis<'_> {
                Box::new(move |run, i, _| {
                    let [x, y] = runs[run].slide_mm[i];
                    (-0.5 * ((x - cx).powi(2) + (y - cy).powi(2)) / 1.4).exp()
                })
            };
            let bumps = vec![bump(-3.0), bump(-1.0), bump(1.0), bump(3.0)];
            self.add("slide_x_mm,slide_y_mm", RandomEffect::Strength, bumps);
        }
    }

    /// Decays within a stroke, with path and time.
    fn add_decays(&mut self) {
        for length in [0.3, 1.0, 3.0] {
            let decay: Basis<'_> = Box::new(move |_, _, row| (-row.path_mm / length).exp());
            self.add("slide", RandomEffect::Strength, vec![decay]);
        }
        for time in [0.3, 1.5, 8.0] {
            let decay: Basis<'_> = Box::new(move |_, _, row| (-row.contact_time_s.max(0.0) / time).exp());
            self.add("contact_time_s", RandomEffect::Stiffness, vec![decay]);
        }
    }

    /// Products of the ranks of each pair of columns.
    fn add_products(&mut self, ranked: &[(Column, Vec<f64>)]) {
        for (i, (a, ranks_a)) in ranked.iter().enumerate() {
            for (b, ranks_b) in &ranked[i + 1..] {
                let product: Vec<f64> = ranks_a.iter().zip(ranks_b).map(|(a, b)| a * b).collect();
                let name = format!("{} x {}", a.name(), b.name());
                self.add(&name, RandomEffect::Strength, vec![per_run(product.clone())]);
                self.add(&name, RandomEffect::Stiffness, vec![per_run(product)]);
            }
        }
    }
}
