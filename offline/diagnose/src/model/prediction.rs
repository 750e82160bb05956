//! Measured runs as the smooth model takes them, and its predictions with laws and random effects.
//!
//! Main type: [`Perturbation`]; main functions: [`strokes_of`], [`changes`], [`predict_runs`].

use fingerpad::Surroundings;
use fingerpad_smooth::{ModelChange, Sample, SimulationInputs, SmoothModel, Stroke, Trajectories};

use crate::data::runs::Run;
use crate::laws::Row;
use crate::model::active_law::ActiveLaw;
use crate::model::random_effects::{RandomEffect, RandomEffects};

/// A small uniform change of all runs, by which derivatives with respect to the random effects are taken.
#[derive(Clone, Copy, Debug)]
pub struct Perturbation {
    /// Factor on the stiffness.
    pub stiffness: f64,
    /// Factor on the strength.
    pub strength: f64,
    /// Added to the depth, mm.
    pub depth_mm: f64,
}

impl Default for Perturbation {
    fn default() -> Self {
        Self { stiffness: 1.0, strength: 1.0, depth_mm: 0.0 }
    }
}

/// State of skin and room in a row; what is not recorded has the core's reference value.
fn surroundings(row: &Row) -> Surroundings {
    let reference = Surroundings::default();
    let known = |v: f64, or: f32| if v.is_finite() { v as f32 } else { or };
    let some = |v: f64| v.is_finite().then_some(v as f32);
    Surroundings {
        hydration_au: known(row.hydration_au, reference.hydration_au),
        temperature_c: known(row.temperature_c, reference.temperature_c),
        finger_width_mm: known(row.width_mm, reference.finger_width_mm),
        series_s: row.t_s as f32,
        dwell_s: some(row.dwell_s),
        occlusion_s: some(row.occlusion_s),
        speed_mm_s: (row.speed_mm_s > 0.0).then_some(row.speed_mm_s as f32),
        own: row.own.map(|v| v as f32),
    }
}

/// The motion of a run. One that was recorded from within contact starts with the press to there.
pub fn stroke_of(run: &Run) -> Stroke {
    let first = &run.rows[0];
    let before_s = if first.depth_mm > 0.0 { first.contact_time_s.max(1e-3) } else { 1e-3 };
    let sample = |(i, row): (usize, &Row)| Sample {
        t_s: row.t_s,
        depth_mm: row.depth_mm,
        slide_mm: if i == 0 && row.depth_mm <= 0.0 { [0.0; 2] } else { run.increment(i) },
        double_angle: row.double_angle,
        direction: row.along,
        surroundings: surroundings(row),
    };
    Stroke {
        start_s: first.t_s - before_s,
        samples: run.rows.iter().enumerate().map(sample).collect(),
        time_constant_s: run.time_constant_s,
    }
}

/// The motions of runs.
pub fn strokes_of(runs: &[Run]) -> Vec<Stroke> {
    runs.iter().map(stroke_of).collect()
}

/// The change of the model in one row with the laws on top of another change.
fn with_laws(laws: &[ActiveLaw], row: &Row, mut change: ModelChange) -> ModelChange {
    for active in laws {
        active.law.apply(&active.values, row, &mut change);
    }
    change
}

/// Changes of the model in every row, run by run: by a perturbation, by the run's random effects, and by laws.
pub fn changes(
    runs: &[Run],
    laws: &[ActiveLaw],
    random_effects: &RandomEffects,
    perturbation: Perturbation,
) -> Vec<ModelChange> {
    let mut out = Vec::with_capacity(runs.iter().map(|r| r.rows.len()).sum());
    for (i, run) in runs.iter().enumerate() {
        let own = random_effects.get(i).copied().unwrap_or_default();
        let uniform = ModelChange {
            strength: perturbation.strength * own[RandomEffect::Strength.index()].exp(),
            stiffness: perturbation.stiffness * own[RandomEffect::Stiffness.index()].exp(),
            depth_mm: perturbation.depth_mm + own[RandomEffect::DepthZero.index()],
            ..ModelChange::default()
        };
        out.extend(run.rows.iter().map(|row| with_laws(laws, row, uniform)));
    }
    out
}

/// Predicted readings of runs under laws and without random effects, three a row, N: normal, x, y.
pub fn predict_runs(model: &SmoothModel, runs: &[Run], laws: &[ActiveLaw]) -> Vec<f64> {
    let strokes = strokes_of(runs);
    let changes = changes(runs, laws, &RandomEffects::new(), Perturbation::default());
    SimulationInputs::new(&Trajectories::new(strokes), changes).predict_n(model)
}
