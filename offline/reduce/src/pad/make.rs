//! From finite-element runs to the model file of a pad.

use std::collections::BTreeMap;

use fingerpad::Response;
use fingerpad::pad::{Law, Numbers, Patch};
use fingerpad_fe::contact::Outline;
use fingerpad_fe::load_path::Finger;
use serde::{Deserialize, Serialize};

use super::score::ANGLE_DEG;
use super::{FitLimits, PadModel, PadScores, PadSize, Tuning, fit, pad, replay, score_runs};
use crate::{ReduceError, Run, Sample};

/// How a pad is made.
#[derive(Clone, Copy, Debug)]
pub struct PadSettings {
    /// Patches.
    pub size: PadSize,
    /// Runs to fit to, at most; the other ones that may be fitted to give the bands.
    pub runs: usize,
    /// How long the fit may take.
    pub limits: FitLimits,
    /// What the fit starts from.
    pub start: Tuning,
}

impl Default for PadSettings {
    fn default() -> Self {
        Self {
            size: PadSize { patches: 37 },
            runs: 80,
            limits: FitLimits { patience: 20, hold: false },
            start: Tuning::default(),
        }
    }
}

/// What a pad's model file says of where it comes from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PadMeta {
    /// Version of this library.
    pub version: String,
    /// Hash of the settings of the runs.
    pub settings_hash: String,
    /// Runs that it was fitted to, and that gave the bands.
    pub fitted_runs: [usize; 2],
    /// What was fitted.
    pub tuning: Tuning,
    /// Errors along runs that neither the fit nor the bands have seen, by kind.
    pub held_out: BTreeMap<String, PadScores>,
    /// Share of the rows of these runs within the bands: normal force and friction; all rows, then those in the neutral pose and those in
    /// others.
    pub coverage: [[f64; 2]; 3],
}

impl PadMeta {
    /// Replaces the errors by those of the present core along `held_out` runs.
    pub fn rescore(&mut self, model: &PadModel, held_out: &[&Run], outline: &Outline) {
        let mut by_kind: BTreeMap<String, Vec<&Run>> = BTreeMap::new();
        for run in held_out {
            by_kind.entry(run.kind.as_str().to_owned()).or_default().push(run);
        }
        self.held_out = by_kind.into_iter().map(|(kind, runs)| (kind, score_runs(model, &runs, outline))).collect();
        self.coverage = coverage(model, held_out, outline);
    }
}

/// A pad with its provenance.
pub struct MadePad {
    /// The pad in double precision.
    pub model: PadModel,
    /// Where it comes from.
    pub meta: PadMeta,
}

impl MadePad {
    /// The bytes of its model file.
    ///
    /// # Errors
    /// [`ReduceError::Model`] for numbers that the core refuses.
    pub fn file(&self) -> Result<Vec<u8>, ReduceError> {
        let patches: Vec<Patch> = self.model.patches.iter().map(single_patch).collect();
        let numbers = single_numbers(&self.model.numbers);
        let pad = fingerpad::pad::Pad { patches: &patches, numbers: &numbers };
        pad.check()?;
        let meta = serde_json::to_string(&self.meta).expect("plain numbers and text");
        let mut bytes = vec![0; pad.file_length(&meta)];
        pad.write_file(&meta, &mut bytes)?;
        Ok(bytes)
    }
}

fn single<const K: usize>(values: &[f64; K]) -> [f32; K] {
    values.map(|x| x as f32)
}

fn single_patch(patch: &Patch<f64>) -> Patch {
    Patch {
        middle_mm: single(&patch.middle_mm),
        area_mm2: patch.area_mm2 as f32,
        spread_mm: single(&patch.spread_mm),
        modes: patch.modes.each_ref().map(single),
        compliance_mm_per_n: single(&patch.compliance_mm_per_n),
    }
}

fn single_numbers(n: &Numbers<f64>) -> Numbers {
    let law = &n.law;
    Numbers {
        rigid: n.rigid.each_ref().map(single),
        squash: single(&n.squash),
        reach: n.reach as f32,
        middle_mm: single(&n.middle_mm),
        first_touch_mm: single(&n.first_touch_mm),
        neutral_pitch_deg: n.neutral_pitch_deg as f32,
        pitch_range_deg: single(&n.pitch_range_deg),
        roll_max_deg: n.roll_max_deg as f32,
        depth_max_mm: n.depth_max_mm as f32,
        band_normal: n.band_normal.each_ref().map(single),
        band_friction: n.band_friction.each_ref().map(single),
        law: Law {
            softness: single(&law.softness),
            stiffening: single(&law.stiffening),
            flattening_mpa: single(&law.flattening_mpa),
            area: single(&law.area),
            friction: single(&law.friction),
            onset: law.onset as f32,
            lift: law.lift.each_ref().map(single),
            turn: law.turn as f32,
        },
    }
}

/// Makes the pad of a finger.
///
/// * `runs`: of that finger, held-out ones among them
///
/// # Errors
/// [`ReduceError::Fit`] where the finger is not held, or there are no runs to fit to.
pub fn make_pad(
    finger: &Finger,
    outline: &Outline,
    runs: &[Run],
    settings: &PadSettings,
) -> Result<MadePad, ReduceError> {
    let of_fit: Vec<&Run> = runs.iter().filter(|run| !run.held_out && run.samples.len() > 3).collect();
    let held_out: Vec<&Run> = runs.iter().filter(|run| run.held_out && run.samples.len() > 3).collect();
    if of_fit.is_empty() {
        return Err(ReduceError::Fit("no runs to fit the pad to".into()));
    }
    let deepest =
        |runs: &[&Run]| runs.iter().flat_map(|run| &run.samples).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let at_rest = pad(finger, outline, settings.size, deepest(&of_fit))?;
    let every = of_fit.len().div_ceil(settings.runs.max(1)).max(1);
    let fitted: Vec<&Run> = of_fit.iter().copied().step_by(every).collect();
    let tuning = fit(&at_rest, &settings.start, &fitted, outline, settings.limits);
    let mut model = at_rest.tuned(&tuning);
    let others: Vec<&Run> =
        of_fit.iter().copied().enumerate().filter(|(k, _)| k % every != 0).map(|(_, run)| run).collect();
    let of_bands = if others.is_empty() { &fitted } else { &others };
    band(&mut model, of_bands, outline);
    let mut meta = PadMeta {
        version: env!("CARGO_PKG_VERSION").into(),
        settings_hash: runs.first().map_or_else(String::new, |run| run.settings_hash.clone()),
        fitted_runs: [fitted.len(), of_bands.len()],
        tuning,
        held_out: BTreeMap::new(),
        coverage: [[0.0; 2]; 3],
    };
    meta.rescore(&model, &held_out, outline);
    Ok(MadePad { model, meta })
}

/// Share of rows within a band.
const COVERAGE: f64 = 0.955;
/// Stick ratios of the three classes of rows by which a band is made, and where they part.
const CLASSES: [f64; 3] = [0.0, 0.5, 1.0];
const PARTS: [f64; 2] = [0.15, 0.85];

/// Errors of a row over what its bands are a share of: normal force, friction along x and y.
fn shares(s: &Sample, r: &Response<f64>) -> Option<[f64; 3]> {
    let (normal, limit) = (r.normal_force_n, r.friction_limit_n);
    if !(normal > 0.0 && limit > 0.0 && s.normal_force_n > 0.0) {
        return None;
    }
    let friction = [0, 1].map(|k| (r.friction_n[k] - f64::from(s.friction_n[k])).abs() / limit);
    Some([(normal - f64::from(s.normal_force_n)).abs() / normal, friction[0], friction[1]])
}

fn is_away(s: &Sample, neutral_pitch_deg: f64) -> bool {
    s.turned.is_some_and(|t| {
        (f64::from(t.pitch_deg) - neutral_pitch_deg).abs() > ANGLE_DEG || f64::from(t.roll_deg).abs() > ANGLE_DEG
    })
}

/// Sets the bands to what holds [`COVERAGE`] of the rows of each class.
fn band(model: &mut PadModel, runs: &[&Run], outline: &Outline) {
    let neutral = model.numbers.neutral_pitch_deg;
    let mut errors: [[[Vec<f64>; 3]; 2]; 2] = Default::default();
    // Other bodies have larger errors of their own.
    for run in runs.iter().filter(|run| run.body.is_plane()) {
        for (s, r) in run.samples.iter().zip(replay(model, run, outline)) {
            let Some([normal, x, y]) = shares(s, &r) else { continue };
            let class = PARTS.iter().filter(|part| r.stick_ratio > **part).count();
            let away = usize::from(is_away(s, neutral));
            errors[0][away][class].push(normal);
            errors[1][away][class].extend([x, y]);
        }
    }
    let widths = errors.map(|by_pose| by_pose.map(|by_class| by_class.map(quantile)));
    let parabola = |[slip, middle, stick]: [f64; 3]| {
        let [_, m, _] = CLASSES;
        let square = (stick - slip - (middle - slip) / m) / (1.0 - m);
        [slip, stick - slip - square, square]
    };
    let bands = widths.map(|[neutral, away]| {
        let more: [f64; 3] = std::array::from_fn(|k| (away[k] - neutral[k]).max(0.0));
        [parabola(neutral), parabola(more)]
    });
    [model.numbers.band_normal, model.numbers.band_friction] = bands;
}

/// What [`COVERAGE`] of the values do not exceed; 0 of none.
fn quantile(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (COVERAGE * values.len() as f64).ceil() as usize;
    values.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
}

fn coverage(model: &PadModel, runs: &[&Run], outline: &Outline) -> [[f64; 2]; 3] {
    let neutral = model.numbers.neutral_pitch_deg;
    let mut counts = [[[0.0; 2]; 2]; 3];
    for run in runs.iter().filter(|run| run.body.is_plane()) {
        for (s, r) in run.samples.iter().zip(replay(model, run, outline)) {
            let Some([normal, x, y]) = shares(s, &r) else { continue };
            let (most_normal, most_friction) =
                (r.band_normal_n / r.normal_force_n, r.band_friction_n / r.friction_limit_n);
            let inside = [
                f64::from(u8::from(normal <= most_normal)),
                0.5 * (f64::from(u8::from(x <= most_friction)) + f64::from(u8::from(y <= most_friction))),
            ];
            let class = 1 + usize::from(is_away(s, neutral));
            for class in [0, class] {
                for (count, inside) in counts[class].iter_mut().zip(inside) {
                    count[0] += inside;
                    count[1] += 1.0;
                }
            }
        }
    }
    counts.map(|class| class.map(|[inside, all]| inside / f64::max(all, 1.0)))
}
