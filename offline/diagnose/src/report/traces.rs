//! Forces of the worst runs beside the three models: as calibrated, refitted, with the effect.
//!
//! Main type: [`ForceTrace`].

use crate::data::runs::RunSet;
use crate::statistics::fit::Fit;
use crate::statistics::task::Task;

/// Forces of a run: normal, and friction along the motion, N.
pub struct ForceTrace {
    /// The run.
    pub run: String,
    /// Time since the run's first row, s.
    pub t_s: Vec<f64>,
    /// When the plate slides in contact, from and to, s.
    pub slides_s: Vec<[f64; 2]>,
    /// Readings of each row; NaN where one is left out.
    pub readings_n: Vec<[f64; 2]>,
    /// Predictions as calibrated, refitted, and with the claimed effects.
    pub models_n: [Vec<[f64; 2]>; 3],
}

/// The runs that the refitted baseline misses most, worst first.
///
/// * `floor_n`: standard deviation of every observation under a perfect model, N
pub fn worst_traces(
    task: &Task<'_>,
    set: &RunSet,
    calibrated: &Fit,
    [null, full]: [&Fit; 2],
    floor_n: &[f64],
    most: usize,
) -> Vec<ForceTrace> {
    let models = [calibrated, null, full].map(|fit| task.predict(&fit.parameters, &fit.laws));
    let misses = |run: usize| {
        let mut squares: Vec<f64> = task
            .layout
            .range(run)
            .map(|i| ((task.readings_n[i] - models[1][i]) / floor_n[i]).powi(2))
            .filter(|s| s.is_finite())
            .collect();
        squares.sort_by(f64::total_cmp);
        squares.iter().sum::<f64>() / squares.len().max(1) as f64
    };
    let mut order: Vec<usize> = (0..set.runs.len()).collect();
    order.sort_by(|a, b| misses(*b).total_cmp(&misses(*a)));
    order.truncate(most);
    order
        .into_iter()
        .map(|k| {
            let (run, start) = (&set.runs[k], task.layout.range(k).start);
            let pairs = |values: &[f64]| -> Vec<[f64; 2]> {
                let of_row = |i: usize| {
                    let v = &values[start + 3 * i..start + 3 * i + 3];
                    let [c, s] = run.rows[i].along;
                    [v[0], v[1] * c + v[2] * s]
                };
                (0..run.rows.len()).map(of_row).collect()
            };
            let t_s: Vec<f64> = run.rows.iter().map(|row| row.t_s - run.rows[0].t_s).collect();
            let mut slides_s: Vec<[f64; 2]> = Vec::new();
            // A row slides where the plate moved since the row before.
            for (i, _) in run.rows.iter().enumerate().filter(|(i, row)| *i > 0 && row.speed_mm_s > 0.0) {
                match slides_s.last_mut().filter(|slide| slide[1] == t_s[i - 1]) {
                    Some(slide) => slide[1] = t_s[i],
                    None => slides_s.push([t_s[i - 1], t_s[i]]),
                }
            }
            ForceTrace {
                run: run.labels.run.clone(),
                t_s,
                slides_s,
                readings_n: pairs(&task.readings_n),
                models_n: [&models[0], &models[1], &models[2]].map(|m| pairs(m)),
            }
        })
        .collect()
}
