//! Measured runs through the core: a model file's predicted readings.

use fingerpad::{Effects, ModelOf};
use fingerpad_smooth::replay_stroke;

use crate::data::runs::{Run, RunSet};
use crate::model::prediction::stroke_of;
use crate::model::residual_sums::ResidualSums;

/// Predicted readings of a run, three per row, N: normal, x, y; appended to `out`.
pub fn replay<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    run: &Run,
    out: &mut Vec<f64>,
) {
    replay_stroke(model, effects, &stroke_of(run), out);
}

/// Root mean square of readings less prediction over all rows of a set, N: normal, x, y; and the predictions.
pub fn replay_all<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    set: &RunSet,
) -> ([f64; 3], Vec<f64>) {
    let mut out = Vec::with_capacity(3 * set.rows());
    let mut sums = ResidualSums::default();
    for run in &set.runs {
        let from = out.len();
        replay(model, effects, run, &mut out);
        let readings = run.force_n.iter().flatten();
        sums.add(readings.zip(&out[from..]).map(|(y, p)| y - p));
    }
    (sums.rms(), out)
}
