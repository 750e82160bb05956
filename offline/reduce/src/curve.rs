//! Accuracy against cost: the fit repeated with other numbers of springs and table nodes.
//!
//! Main type: [`CurvePoint`]. Uses fit, score.

use serde::{Deserialize, Serialize};

use super::{FitProgress, ReduceError, Run, Scores, Settings, fit, score};
use fingerpad_fe::contact::RubberFriction;

/// One size of the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Springs.
    pub springs: usize,
    /// Table nodes.
    pub nodes: usize,
    /// Bytes of the model's numbers.
    pub bytes: usize,
    /// Errors along the held-out paths.
    pub held_out: Scores,
}

fn point<const M: usize, const N: usize>(
    runs: &[Run],
    friction: &RubberFriction,
    settings: &Settings,
) -> Result<CurvePoint, ReduceError> {
    let fitted = fit::<M, N>(runs, &[], friction, settings, &FitProgress::default())?;
    let data = fitted.params.try_build()?;
    let scores = score(&data.model()?, runs);
    Ok(CurvePoint { springs: M, nodes: N, bytes: size_of_val(&data), held_out: Scores::of(&scores, |s| s.held_out) })
}

/// Fits models of several sizes: springs 2 to 8 with the default's nodes, and fewer and more nodes with its springs.
///
/// Runs that a bed of springs does not represent are left out. Before each fit `go_on` receives the finished share; the fits continue
/// if it returns true.
///
/// # Errors
/// As [`fit`].
pub fn curve(
    runs: &[Run],
    friction: &RubberFriction,
    settings: &Settings,
    mut go_on: impl FnMut(f64) -> bool,
) -> Result<Vec<CurvePoint>, ReduceError> {
    type Fit = fn(&[Run], &RubberFriction, &Settings) -> Result<CurvePoint, ReduceError>;
    let sizes: [Fit; 8] = [
        point::<2, 37>,
        point::<3, 37>,
        point::<4, 37>,
        point::<5, 37>,
        point::<6, 37>,
        point::<8, 37>,
        point::<4, 25>,
        point::<4, 49>,
    ];
    let runs: Vec<Run> = runs.iter().filter(|run| run.is_representable()).cloned().collect();
    let mut points = Vec::with_capacity(sizes.len());
    for (i, size) in sizes.iter().enumerate() {
        if !go_on(i as f64 / sizes.len() as f64) {
            break;
        }
        points.push(size(&runs, friction, settings)?);
    }
    Ok(points)
}
