//! Measured runs as the smooth model takes them, and its predictions with laws and random effects.
//!
//! Main type: [`Perturbation`]; main functions: [`strokes_of`], [`changes`], [`predict_runs`].

use std::sync::{Arc, Mutex};

use fingerpad::Surroundings;
use fingerpad_smooth::{ModelChange, Sample, SimulationInputs, SmoothModel, Stroke, Trajectories};

use crate::data::runs::Run;
use crate::laws::Row;
use crate::model::active_law::ActiveLaw;
use crate::model::random_effects::{RandomEffect, RandomEffects};
use crate::model::relaxation::{branch_of, factors};

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

/// The changes of the model by one law, in every row of the runs: the numbers that it changes, each with its place in [`numbers`] and a
/// value per row. A law changes one or two of them.
type ChangesByLaw = Arc<Vec<(usize, Vec<f64>)>>;

/// Changes by single laws, as they were computed last: of the laws in force most predictions move one.
#[derive(Default)]
pub struct KnownChanges(Mutex<Vec<(ActiveLaw, ChangesByLaw)>>);

impl KnownChanges {
    /// Laws whose changes are kept.
    const MOST: usize = 16;

    fn of(&self, runs: &[Run], active: &ActiveLaw) -> ChangesByLaw {
        let held = || self.0.lock().expect("no thread panics with it");
        let taken = {
            let mut known = held();
            let place = known.iter().position(|(k, _)| std::ptr::eq(k.law, active.law) && k.values == active.values);
            place.map(|place| known.remove(place))
        };
        let (active, changes) = taken.unwrap_or_else(|| (active.clone(), Arc::new(by_law(runs, active))));
        let mut known = held();
        known.push((active, changes.clone()));
        let oldest = known.len().saturating_sub(Self::MOST);
        known.drain(..oldest);
        changes
    }
}

/// The numbers of a change. Of several laws the first [`MULTIPLIED`] multiply, all others add up, as laws do it themselves.
fn numbers(change: &mut ModelChange) -> [&mut f64; 11] {
    // All fields by name: a new one has to say how laws combine in it.
    let ModelChange { strength, stiffness, depth_mm, reading_n: [n, x, y], cross: [cx, cy], gain, drag_n, adhesion_n } =
        change;
    [strength, stiffness, depth_mm, n, x, y, cx, cy, gain, drag_n, adhesion_n]
}

/// How many numbers of a change are factors.
const MULTIPLIED: usize = 2;
/// Place of the stiffness among them.
const STIFFNESS: usize = 1;

fn by_law(runs: &[Run], active: &ActiveLaw) -> Vec<(usize, Vec<f64>)> {
    if let Some(branch) = branch_of(active) {
        let held = |factor: f64| {
            let mut change = ModelChange::default();
            change.stiffen(factor);
            change.stiffness
        };
        return vec![(STIFFNESS, runs.iter().flat_map(|run| factors(run, branch)).map(held).collect())];
    }
    let rows = runs.iter().map(|r| r.rows.len()).sum();
    let untouched = numbers(&mut ModelChange::default()).map(|v| *v);
    let mut columns = untouched.map(|_| Vec::new());
    for (i, row) in runs.iter().flat_map(|run| &run.rows).enumerate() {
        let mut change = ModelChange::default();
        active.law.apply(&active.values, row, &mut change);
        for ((column, value), usual) in columns.iter_mut().zip(numbers(&mut change)).zip(untouched) {
            if *value != usual && column.is_empty() {
                column.resize(rows, usual);
            }
            if let Some(place) = column.get_mut(i) {
                *place = *value;
            }
        }
    }
    columns.into_iter().enumerate().filter(|(_, column)| !column.is_empty()).collect()
}

/// Changes of the model in every row, run by run: by a perturbation, by the run's random effects, and by laws.
pub fn changes(
    runs: &[Run],
    laws: &[ActiveLaw],
    random_effects: &RandomEffects,
    perturbation: Perturbation,
    known: &KnownChanges,
) -> Vec<ModelChange> {
    let by_laws: Vec<ChangesByLaw> = laws.iter().map(|active| known.of(runs, active)).collect();
    let mut out = Vec::with_capacity(runs.iter().map(|r| r.rows.len()).sum());
    for (i, run) in runs.iter().enumerate() {
        let own = random_effects.get(i).copied().unwrap_or_default();
        let uniform = ModelChange {
            strength: perturbation.strength * own[RandomEffect::Strength.index()].exp(),
            stiffness: perturbation.stiffness * own[RandomEffect::Stiffness.index()].exp(),
            depth_mm: perturbation.depth_mm + own[RandomEffect::DepthZero.index()],
            ..ModelChange::default()
        };
        let (from, to) = (out.len(), out.len() + run.rows.len());
        out.resize(to, uniform);
        for (number, values) in by_laws.iter().flat_map(|by_law| by_law.iter()) {
            for (change, value) in out[from..].iter_mut().zip(&values[from..to]) {
                let place = &mut *numbers(change)[*number];
                *place = if *number < MULTIPLIED { *place * value } else { *place + value };
            }
        }
    }
    out
}

/// Predicted readings of runs under laws and without random effects, three a row, N: normal, x, y.
pub fn predict_runs(model: &SmoothModel, runs: &[Run], laws: &[ActiveLaw]) -> Vec<f64> {
    let strokes = strokes_of(runs);
    let changes = changes(runs, laws, &RandomEffects::new(), Perturbation::default(), &KnownChanges::default());
    SimulationInputs::new(&Trajectories::new(strokes), changes).predict_n(model)
}
