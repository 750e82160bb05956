//! All laws on a grid of shapes, by tangents of the model.

use super::chance::Score;
use super::fit::{Fit, Task};
use super::laws::{Column, Law, Place};
use super::runs::RunSet;
use super::space::{Clean, Space};
use super::walk::Active;

/// A law at one shape of the grid.
pub struct Candidate {
    /// The law with a typical size and this shape.
    pub start: Active,
    /// Columns of its linear parameters, over the row noise.
    pub columns: Vec<Vec<f64>>,
}

/// A candidate's clean columns and score at a fit.
pub struct Scored {
    /// Index of the candidate.
    pub candidate: usize,
    /// Clean columns.
    pub clean: Vec<Clean>,
    /// The score; `None` without information.
    pub score: Option<Score>,
}

/// Why a law cannot be tested on a set.
pub fn obstacle(law: &Law, set: &RunSet) -> Option<String> {
    for &column in law.drivers {
        if !set.has(column) {
            return Some(format!("{} is not recorded", column.name()));
        }
        let least = match column.name() {
            "hydration_au" => 1.0,
            "temperature_c" | "finger_width_mm" => 0.1,
            "occlusion_time_s" => 0.2,
            _ => 0.0,
        };
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

/// Candidates for some laws, with columns at a fit.
pub fn candidates(task: &Task<'_>, fit: &Fit, laws: &[&'static Law]) -> Vec<Candidate> {
    let prediction = task.predict_at(&fit.theta, &fit.laws, &fit.modes);
    let mut out = Vec::new();
    for &law in laws {
        for shape in law.shapes {
            let start = start_of(law, shape);
            let columns = columns_of(task, fit, &prediction, &start);
            out.push(Candidate { start, columns });
        }
    }
    out
}

/// A law at zero size with the given shape.
pub fn start_of(law: &'static Law, shape: &[f64]) -> Active {
    let mut values = vec![0.0; law.linear];
    values.extend_from_slice(shape);
    Active { law, values }
}

/// Columns of the linear parameters of a law that is not in force.
///
/// The step is small: where runs draw far apart, the curvature of a larger one would look like information within the
/// runs, and hide a law that acts between them.
pub fn columns_of(task: &Task<'_>, fit: &Fit, prediction: &[f64], start: &Active) -> Vec<Vec<f64>> {
    (0..start.law.linear)
        .map(|k| {
            let step = 0.004 * start.law.parameters[k].typical;
            let mut laws = fit.laws.clone();
            let mut one = start.clone();
            one.values[k] = step;
            laws.push(one);
            task.column(&task.predict_at(&fit.theta, &laws, &fit.modes), prediction, step)
        })
        .collect()
}

/// Scores of all candidates.
pub fn scored(space: &Space<'_>, candidates: &[Candidate]) -> Vec<Scored> {
    let mut cleaned = space.clean_all(candidates.iter().flat_map(|c| &c.columns)).into_iter();
    candidates
        .iter()
        .enumerate()
        .map(|(i, candidate)| {
            let raw: f64 = candidate.columns.iter().map(|c| super::products::dot(c, c)).fold(0.0, f64::max);
            let clean: Vec<Clean> = cleaned.by_ref().take(candidate.columns.len()).collect();
            let score = space.score(&clean.iter().collect::<Vec<_>>(), raw * 1e-3);
            Scored { candidate: i, clean, score }
        })
        .collect()
}
