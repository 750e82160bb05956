//! Reduction of runs to a model file: fit, error band, replay, the core's check, provenance.
//!
//! Main types: [`Reduced`], [`Meta`]. Uses all other modules of this crate.

use std::collections::BTreeMap;

use fingerpad::build::{DataOf, EffectSlot, ParamsOf, Sections};
use fingerpad::{ModelOf, NODES, Relaxation, SPRINGS};
use serde::{Deserialize, Serialize};

use super::band::{Band, Coverage};
use super::fit::minimisations;
use super::{FitProgress, Kind, ReduceError, Run, RunScore, Scores, Settings, fit, score};
use fingerpad_fe::contact::RubberFriction;

/// Contents of a model file's META section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Meta {
    /// A name.
    pub name: String,
    /// Whether the numbers come from a fit.
    pub fitted: bool,
    /// Version of the program that wrote the file.
    pub program_version: String,
    /// Hash of the finite-element settings behind the runs.
    pub settings_hash: String,
    /// Ranges of the fit.
    pub ranges: Ranges,
    /// Paths of the fit and paths held out, by finite elements.
    pub paths: [usize; 2],
    /// Number of paths of a pad that the fit used in addition.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub paths_of_pad: usize,
    /// Errors along the held-out paths.
    pub held_out: Scores,
    /// The same for each kind of motion.
    pub kinds: BTreeMap<String, KindScores>,
    /// Share of held-out rows within the band, over all and in stick, partial slip, slip; each half of the held-out
    /// paths against a band from the other half.
    pub coverage: [Coverage; 4],
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde requires a reference")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Meta {
    /// Replaces the errors by those of the present core.
    pub fn rescore<const M: usize, const N: usize>(&mut self, model: &ModelOf<'_, M, N>, runs: &[Run]) {
        let scores = score(model, runs);
        (self.held_out, self.kinds) = (Scores::of(&scores, |s| s.held_out), kinds(&scores));
    }
}

/// Errors along the held-out paths of one kind: a few numbers of [`Scores`], rounded to three digits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KindScores {
    /// Paths.
    pub paths: usize,
    /// [`Scores::normal_of_range`].
    pub normal: f64,
    /// [`Scores::friction_of_limit`].
    pub friction: f64,
    /// [`Scores::moment_of_limit`].
    pub moment: f64,
}

/// Ranges of depth, slide, force and history that the runs cover.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    /// Depth, mm.
    pub depth_mm: [f64; 2],
    /// Longest slide from where the path began, mm.
    pub slide_mm: f64,
    /// Largest normal force, N.
    pub normal_force_n: f64,
    /// Kinds of history in the runs.
    pub histories: Vec<String>,
}

/// A reduced model with its scores and provenance.
#[derive(Clone, Debug)]
pub struct Reduced<const M: usize = SPRINGS> {
    /// Parameters, band included.
    pub params: ParamsOf<M, NODES>,
    /// The numbers in the form that a step reads, accepted by `DataOf::check`.
    pub data: DataOf<M, NODES>,
    /// Provenance.
    pub meta: Meta,
    /// Errors along all runs, those of the fit and held-out ones.
    pub scores: Vec<RunScore>,
    /// Half the sum of squares of normal force and friction at the start and at the end of the fit.
    pub cost: [f64; 2],
    /// Why the minimiser stopped.
    pub ended: String,
    /// Branches of its force.
    pub relaxation: Relaxation,
}

/// Fits, replays and checks a model of `M` springs.
///
/// * `beside`: runs of a pad of the same finger that the fit uses in addition, see [`crate::pad::runs_for_bed`]
/// * `friction`: friction law of the runs
///
/// # Errors
/// [`ReduceError::Runs`] if runs of different settings are mixed or too few or not representable, [`ReduceError::Fit`],
/// [`ReduceError::Model`] if the core refuses the numbers.
pub fn reduce<const M: usize>(
    runs: &[Run],
    beside: &[Run],
    friction: &RubberFriction,
    settings: &Settings,
    progress: &FitProgress<'_>,
) -> Result<Reduced<M>, ReduceError> {
    let first = runs.first().ok_or_else(|| ReduceError::Runs("no runs: make them with --design".into()))?;
    if let Some(other) = runs.iter().find(|r| r.settings_hash != first.settings_hash) {
        return Err(ReduceError::Runs(format!(
            "runs of different settings: {} has {}, {} has {}",
            first.name, first.settings_hash, other.name, other.settings_hash
        )));
    }
    if let Some(other) = runs.iter().find(|r| !r.is_representable()) {
        return Err(ReduceError::Runs(format!(
            "{} drives the spin of the plane by a moment, which the reduced model does not support; leave it out of the fit",
            other.name
        )));
    }
    let pose_deg = pose_of(runs)?;
    // The last stage replays all runs for bands and scores.
    progress.expect(minimisations(M, settings) + 1);
    let fitted = fit::<M, NODES>(runs, beside, friction, settings, progress)?;
    let mut params = fitted.params;
    let plain = params.try_build()?;
    let model = plain.model()?;
    let scores = score(&model, runs);
    let held_out: Vec<&Run> = runs.iter().filter(|r| r.held_out).collect();
    // Test of the band: each half of the held-out runs is compared with a band from the other half.
    let halves: [Vec<&Run>; 2] =
        [0, 1].map(|half| held_out.iter().enumerate().filter(|(i, _)| i % 2 == half).map(|(_, r)| *r).collect());
    let crossed = |from: usize, on: usize| -> Result<[Coverage; 4], ReduceError> {
        let mut params = fitted.params;
        Band::of(&model, &halves[from]).put(&mut params);
        let data = params.try_build()?;
        Ok(Coverage::of(&data.model()?, &halves[on]))
    };
    let (a, b) = (crossed(0, 1)?, crossed(1, 0)?);
    Band::of(&model, &held_out).put(&mut params);
    params.pose_deg = pose_deg;
    let data = params.try_build()?;
    let meta = Meta {
        name: "fingertip".into(),
        fitted: true,
        program_version: env!("CARGO_PKG_VERSION").into(),
        settings_hash: first.settings_hash.clone(),
        ranges: ranges(runs),
        paths: [runs.len() - held_out.len(), held_out.len()],
        paths_of_pad: beside.len(),
        held_out: Scores::of(&scores, |s| s.held_out),
        kinds: kinds(&scores),
        coverage: std::array::from_fn(|i| a[i].together(b[i])),
    };
    Ok(Reduced { params, data, meta, scores, cost: fitted.cost, ended: fitted.ended, relaxation: Relaxation::none() })
}

/// The common pose of all runs, degrees; that of the shipped finger if the runs do not contain their pose.
fn pose_of(runs: &[Run]) -> Result<[f32; 2], ReduceError> {
    let mut found: Option<(&Run, [f32; 2])> = None;
    for run in runs.iter().filter(|run| run.samples.iter().any(|sample| sample.turned.is_some())) {
        let Some(pose_deg) = run.pose_deg() else {
            return Err(ReduceError::Runs(format!("{} changes its pose, but a bed of springs has one pose", run.name)));
        };
        match found {
            None => found = Some((run, pose_deg)),
            Some((other, of_other)) if of_other != pose_deg => {
                return Err(ReduceError::Runs(format!(
                    "a bed of springs has one pose, but {} is in pitch {}° and roll {}°, {} in {}° and {}°",
                    other.name, of_other[0], of_other[1], run.name, pose_deg[0], pose_deg[1]
                )));
            }
            Some(_) => {}
        }
    }
    Ok(found.map_or([30.0, 0.0], |(_, pose_deg)| pose_deg))
}

fn kinds(scores: &[RunScore]) -> BTreeMap<String, KindScores> {
    let of = |kind: &Kind| {
        let s = Scores::of(scores, |s| s.held_out && s.kind == *kind);
        let [normal, friction, moment] =
            [s.normal_of_range, s.friction_of_limit, s.moment_of_limit].map(|v| (1e5 * v).round() / 1e5);
        (s.paths > 0).then(|| (kind.as_str().to_owned(), KindScores { paths: s.paths, normal, friction, moment }))
    };
    Kind::ALL.iter().filter_map(of).collect()
}

fn ranges(runs: &[Run]) -> Ranges {
    let samples = || runs.iter().flat_map(|r| &r.samples);
    let most = |of: &dyn Fn(&super::Sample) -> f32| f64::from(samples().map(of).fold(0.0, f32::max));
    let kinds = Kind::ALL.iter().filter(|kind| runs.iter().any(|r| r.kind == **kind));
    Ranges {
        depth_mm: [0.0, most(&|s| s.depth_mm)],
        slide_mm: most(&|s| s.slide_mm[0].hypot(s.slide_mm[1])),
        normal_force_n: most(&|s| s.normal_force_n),
        histories: kinds.map(|k| k.as_str().to_owned()).collect(),
    }
}

impl<const M: usize> Reduced<M> {
    /// The model file's bytes, with the slots of `effects`.
    ///
    /// # Errors
    /// [`ReduceError::Model`] if the file does not read back as the same model.
    pub fn file(&self, effects: &[EffectSlot]) -> Result<Vec<u8>, ReduceError> {
        let meta = serde_json::to_string(&self.meta).expect("plain numbers and text");
        let relaxation = Some(&self.relaxation).filter(|branches| branches.is_some());
        let sections = Sections { relaxation, ..Sections::default() };
        let mut bytes = vec![0; DataOf::<M, NODES>::file_length_with(effects, sections, &meta)];
        self.data.write_file_with(effects, sections, &meta, &mut bytes)?;
        Ok(bytes)
    }
}
