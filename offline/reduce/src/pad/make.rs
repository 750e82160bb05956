//! From finite-element runs to the model file of a pad.

use std::collections::BTreeMap;

use fingerpad::pad::{Law, Numbers, Patch};
use fingerpad::{Relaxation, Response};
use fingerpad_fe::contact::{Outline, RubberFriction};
use fingerpad_fe::load_path::Finger;
use serde::{Deserialize, Serialize};

use super::score::ANGLE_DEG;
use super::{FitLimits, FittedNumbers, PadModel, PadScores, PadSize, fit, pad, replay, score_runs};
use crate::{Kind, ReduceError, Run, Sample, Tip};

/// Settings of the fit of a pad.
#[derive(Clone, Debug)]
pub struct PadSettings {
    /// Number of patches.
    pub size: PadSize,
    /// Number of runs to fit to. They are divided among the kinds of motion in proportion to their numbers of runs, with at least 15 % for
    /// each kind. The bands use all runs that are not held out.
    pub runs: usize,
    /// Limits of the fit.
    pub limits: FitLimits,
    /// The tip, by whose sizes the numbers of the fit are scaled.
    pub tip: Tip,
    /// Friction law of the runs.
    pub friction: RubberFriction,
}

impl Default for PadSettings {
    fn default() -> Self {
        Self {
            size: PadSize { patches: 37 },
            runs: 80,
            limits: FitLimits { patience: 20, hold: false },
            tip: Tip::default(),
            friction: RubberFriction::default(),
        }
    }
}

/// Provenance of a pad in its model file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PadMeta {
    /// Version of this library.
    pub version: String,
    /// Hash of the settings of the runs.
    pub settings_hash: String,
    /// Number of runs of the fit, and of the bands; the latter include the former.
    pub fitted_runs: [usize; 2],
    /// Fitted numbers.
    #[serde(rename = "tuning")]
    pub fitted: FittedNumbers,
    /// Errors along held-out runs, which neither the fit nor the bands used, by kind.
    pub held_out: BTreeMap<String, PadScores>,
}

impl PadMeta {
    /// Replaces the errors by those of the present core along `held_out` runs.
    pub fn rescore(&mut self, model: &PadModel, held_out: &[&Run], outline: &Outline, law: &RubberFriction) {
        let mut by_kind: BTreeMap<String, Vec<&Run>> = BTreeMap::new();
        for run in held_out {
            by_kind.entry(run.kind.as_str().to_owned()).or_default().push(run);
        }
        self.held_out =
            by_kind.into_iter().map(|(kind, runs)| (kind, score_runs(model, &runs, outline, law))).collect();
    }
}

/// A pad with its provenance.
pub struct MadePad {
    /// The pad in double precision.
    pub model: PadModel,
    /// Provenance.
    pub meta: PadMeta,
    /// Branches of its force.
    pub relaxation: Relaxation,
}

impl MadePad {
    /// The bytes of its model file.
    ///
    /// # Errors
    /// [`ReduceError::Model`] for numbers that the core refuses.
    pub fn file(&self) -> Result<Vec<u8>, ReduceError> {
        self.model.file(&self.relaxation, &serde_json::to_string(&self.meta).expect("plain numbers and text"))
    }
}

impl PadModel {
    /// The bytes of its model file.
    ///
    /// * `relaxation`: branches of its force
    /// * `meta`: provenance, JSON
    ///
    /// # Errors
    /// [`ReduceError::Model`] for numbers that the core refuses.
    pub fn file(&self, relaxation: &Relaxation, meta: &str) -> Result<Vec<u8>, ReduceError> {
        let patches: Vec<Patch> = self.patches.iter().map(single_patch).collect();
        let numbers = single_numbers(&self.numbers);
        let pad = fingerpad::pad::Pad::new(&patches, &numbers).with_relaxation(*relaxation);
        pad.check()?;
        let mut bytes = vec![0; pad.file_length(meta)];
        pad.write_file(meta, &mut bytes)?;
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
        band_body: single(&n.band_body),
        band_deep: single(&n.band_deep),
        band_light_n: n.band_light_n.each_ref().map(single),
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

/// Computes and fits the pad of a finger.
///
/// * `runs`: runs of that finger, including held-out ones
///
/// # Errors
/// [`ReduceError::Fit`] if the finger has no support, or without runs to fit to.
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
    let at_rest = pad(finger, outline, settings.size, settings.tip.length, deepest(&of_fit))?;
    let chosen = shared_out(&of_fit, settings.runs);
    let fitted = fit(&at_rest, &chosen, outline, settings);
    let mut model = at_rest.fitted(&fitted);
    model.set_bands(&of_fit, outline);
    let mut meta = PadMeta {
        version: env!("CARGO_PKG_VERSION").into(),
        settings_hash: runs.first().map_or_else(String::new, |run| run.settings_hash.clone()),
        fitted_runs: [chosen.len(), of_fit.len()],
        fitted,
        held_out: BTreeMap::new(),
    };
    meta.rescore(&model, &held_out, outline, &settings.friction);
    Ok(MadePad { model, meta, relaxation: Relaxation::none() })
}

/// Least number of runs of each kind in a fit, share of the wanted number of runs; all runs of the kind if it has fewer.
const LEAST_OF_A_KIND: f64 = 0.15;

/// Selects the runs to fit to, evenly spaced within each kind: about `most`, with the least number of each kind.
fn shared_out<'a>(runs: &[&'a Run], most: usize) -> Vec<&'a Run> {
    let mut fitted = Vec::new();
    for kind in Kind::ALL {
        let own: Vec<&Run> = runs.iter().copied().filter(|run| run.kind == kind).collect();
        let share = (most * own.len()).div_ceil(runs.len().max(1));
        let count = share.max((LEAST_OF_A_KIND * most as f64).ceil() as usize).min(own.len());
        // True for `count` places, evenly spread.
        let is_fitted = |k: usize| (k + 1) * count / own.len() > k * count / own.len();
        fitted.extend(own.iter().enumerate().filter(|(k, _)| is_fitted(*k)).map(|(_, run)| *run));
    }
    fitted
}

/// Share of the rows of every kind of run within a band.
const COVERAGE: f64 = 0.95;
/// Least number of errors for which a kind of run has its own quantile.
const FEW: usize = 60;
/// Stick ratios at which a band is defined, each for one class of rows.
const CLASSES: [f64; 3] = [0.0, 0.5, 1.0];
/// Stick ratios between the classes.
const PARTS: [f64; 2] = [0.15, 0.85];
/// Depth above which the core's bands grow with depth, mm.
const DEEP_MM: f64 = 2.6;
/// Normal force below which a contact is light, N; errors of light contacts are not proportional to the force.
const LIGHT_N: f64 = 0.02;

/// The quantities of a row of a run from which the bands follow.
struct Row {
    /// Errors of the normal force and of friction along x and y, N.
    errors: [f64; 3],
    normal: f64,
    limit: f64,
    stick: f64,
    is_away: bool,
    kind: Kind,
}

impl Row {
    fn class(&self) -> usize {
        PARTS.iter().filter(|part| self.stick > **part).count()
    }
}

/// Rows of a run below the depth above which bands grow.
fn shallow_rows(model: &PadModel, run: &Run, outline: &Outline) -> Vec<Row> {
    let neutral = model.numbers.neutral_pitch_deg;
    let row = |(s, r): (&Sample, Response<f64>)| {
        let (normal, limit) = (r.normal_force_n, r.friction_limit_n);
        let (stick, is_away) = (r.stick_ratio, is_away(s, neutral));
        let row = Row { errors: off(s, &r), normal, limit, stick, is_away, kind: run.kind };
        let is_shallow = f64::from(s.depth_mm) < DEEP_MM;
        (normal > 0.0 && limit > 0.0 && s.normal_force_n > 0.0 && is_shallow).then_some(row)
    };
    run.samples.iter().zip(replay(model, run, outline)).filter_map(row).collect()
}

/// Errors of the normal force and of friction along x and y, N.
pub(super) fn off(s: &Sample, r: &Response<f64>) -> [f64; 3] {
    let [x, y] = [0, 1].map(|k| (r.friction_n[k] - f64::from(s.friction_n[k])).abs());
    [(r.normal_force_n - f64::from(s.normal_force_n)).abs(), x, y]
}

fn is_away(s: &Sample, neutral_pitch_deg: f64) -> bool {
    s.turned.is_some_and(|t| {
        (f64::from(t.pitch_deg) - neutral_pitch_deg).abs() > ANGLE_DEG || f64::from(t.roll_deg).abs() > ANGLE_DEG
    })
}

impl PadModel {
    /// Sets the bands so that they contain 95 % of the rows of each kind of run.
    ///
    /// * `runs`: without held-out ones
    pub fn set_bands(&mut self, runs: &[&Run], outline: &Outline) {
        let numbers = &mut self.numbers;
        (numbers.band_body, numbers.band_deep) = ([0.0; 2], [0.0; 2]);
        self.set_bands_on_plane(runs, outline);
        let (curved, flat): (Vec<&Run>, Vec<&Run>) = runs.iter().partition(|run| !run.body.is_plane());
        self.numbers.band_deep = added(self, &flat, outline, |numbers| &mut numbers.band_deep);
        self.numbers.band_body = added(self, &curved, outline, |numbers| &mut numbers.band_body);
    }

    /// Sets the bands of contacts with a plane, without the additions for depth and curved bodies.
    fn set_bands_on_plane(&mut self, runs: &[&Run], outline: &Outline) {
        let on_plane = runs.iter().filter(|run| run.body.is_plane());
        let (light, rest): (Vec<Row>, Vec<Row>) =
            on_plane.flat_map(|run| shallow_rows(self, run, outline)).partition(|row| row.normal < LIGHT_N);
        let of_light = [false, true].map(|away| {
            let own = || light.iter().filter(move |row| row.is_away == away);
            // The median of the errors of friction. In some rows of light contacts the error is as large as friction itself; a width that
            // contains these rows would double the bands of larger contacts.
            [
                widest(own(), &|row| vec![row.errors[0]]),
                median(own().flat_map(|row| [row.errors[1], row.errors[2]]).collect()),
            ]
        });
        let least = |row: &Row, k: usize| of_light[usize::from(row.is_away)][k];
        let of_normal = |row: &Row| vec![(row.errors[0] - least(row, 0)).max(0.0) / row.normal];
        let of_friction = |row: &Row| [1, 2].map(|k| (row.errors[k] - least(row, 1)).max(0.0) / row.limit).to_vec();
        let widths = |of: &dyn Fn(&Row) -> Vec<f64>| {
            let [neutral, away] = [false, true].map(|away| {
                std::array::from_fn(|class| {
                    widest(rest.iter().filter(|row| row.is_away == away && row.class() == class), of)
                })
            });
            beside(neutral, away).map(parabola)
        };
        let (band_normal, band_friction) = (widths(&of_normal), widths(&of_friction));
        let numbers = &mut self.numbers;
        (numbers.band_normal, numbers.band_friction) = (band_normal, band_friction);
        let [neutral, away] = of_light;
        numbers.band_light_n = beside(neutral, away);
    }
}

/// Widths in the neutral pose, and the additions for other poses.
fn beside<const K: usize>(neutral: [f64; K], away: [f64; K]) -> [[f64; K]; 2] {
    [neutral, std::array::from_fn(|k| (away[k] - neutral[k]).max(0.0))]
}

/// The largest of the widths that the kinds of run and all rows together need for the coverage. Kinds with few rows have no width of their
/// own.
fn widest<'a>(rows: impl Iterator<Item = &'a Row>, errors: &dyn Fn(&Row) -> Vec<f64>) -> f64 {
    let mut by_kind: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for row in rows {
        by_kind.entry(row.kind.as_str()).or_default().extend(errors(row));
    }
    let all = quantile(by_kind.values().flatten().copied().collect());
    by_kind.into_values().filter(|own| own.len() >= FEW).map(quantile).fold(all, f64::max)
}

/// Parabola over the stick ratio through the widths of the three classes: constant, factors of the ratio and of its square. The middle
/// width is increased where the parabola would be negative.
fn parabola([slip, middle, stick]: [f64; 3]) -> [f64; 3] {
    let [_, m, _] = CLASSES;
    let middle = middle.max(0.25 * (slip + stick));
    let square = (stick - slip - (middle - slip) / m) / (1.0 - m);
    [slip, stick - slip - square, square]
}

/// Fits an addition to the bands: for each row the missing width without the addition, over the width that an addition of 1 gives.
///
/// * `numbers`: the addition to both bands within the numbers of a pad
fn added(
    model: &PadModel,
    runs: &[&Run],
    outline: &Outline,
    numbers: impl Fn(&mut Numbers<f64>) -> &mut [f64; 2],
) -> [f64; 2] {
    let (mut without, mut with) = (model.clone(), model.clone());
    (*numbers(&mut without.numbers), *numbers(&mut with.numbers)) = ([0.0; 2], [1.0; 2]);
    let mut needed: [Vec<f64>; 2] = Default::default();
    for run in runs {
        let answers = replay(&without, run, outline).into_iter().zip(replay(&with, run, outline));
        for (s, (plain, wide)) in run.samples.iter().zip(answers) {
            let [normal, x, y] = off(s, &plain);
            let mut need = |k: usize, error: f64, plain: f64, wide: f64| {
                // Rows on which the addition has little influence do not determine it.
                if wide - plain > NOTICED * wide {
                    needed[k].push((error - plain).max(0.0) / (wide - plain));
                }
            };
            need(0, normal, plain.band_normal_n, wide.band_normal_n);
            need(1, x, plain.band_friction_n, wide.band_friction_n);
            need(1, y, plain.band_friction_n, wide.band_friction_n);
        }
    }
    needed.map(quantile)
}

/// A row determines an addition if an addition of 1 is more than this share of its band.
const NOTICED: f64 = 0.5;

/// The [`COVERAGE`] quantile of the values; 0 for an empty list.
fn quantile(values: Vec<f64>) -> f64 {
    ranked(values, COVERAGE)
}

fn median(values: Vec<f64>) -> f64 {
    ranked(values, 0.5)
}

fn ranked(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (share * values.len() as f64).ceil() as usize;
    values.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
}
