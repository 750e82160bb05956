//! Evaluation of steady slides by finite elements: one slide per depth, side by side on threads, cached.

use std::{
    collections::BTreeMap,
    sync::{
        Mutex,
        atomic::{AtomicU32, Ordering},
    },
};

use rayon::prelude::*;

use super::settings::Settings;
use super::{
    CalibrationParameter, Effort, IdentifyError, Limits, Place, Slider, Start, Steady,
    state_cache::{Key, StateCache, key_of},
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::{Config, pad_height_mm};
use fingerpad_fe::load_path::{Finger, Problem};
use fingerpad_fe::mesh::{self, FingertipShape};
use nalgebra::Matrix3;

/// Standard errors by which a depth may move in a joint fit, at most.
const DEPTH_ERRORS: f64 = 3.0;

/// The caller's hooks into a run: progress and interruption.
pub struct Hooks<'a> {
    /// False interrupts the run; called before every equilibrium.
    pub go_on: &'a (dyn Fn() -> bool + Sync),
    /// Receives progress: the stage's name, and a line about it.
    pub report_progress: &'a (dyn Fn(&str, &str) + Sync),
}

/// A steady slide to be evaluated.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Query {
    /// Depth, mm, > 0.
    pub depth_mm: f64,
    /// Law.
    pub law: RubberFriction,
    /// Factor on every stiffness of the finger (tissue, nail, joint, and the contact's penalty), > 0.
    pub stiffness: f64,
}

impl Query {
    /// This slide on the finger of stiffness 1, whose forces and pressures are `1/stiffness` times as large.
    fn unscaled(&self) -> Place {
        let (s, law) = (self.stiffness, self.law);
        Place {
            depth_mm: self.depth_mm,
            law: RubberFriction {
                lambda: law.lambda * s.powf(law.beta - 1.0),
                tau0_mpa: law.tau0_mpa / s,
                regular_pressure_mpa: law.regular_pressure_mpa / s,
                ..law
            },
        }
    }

    fn scaled(&self, mut steady: Steady) -> Steady {
        steady.normal_force_n *= self.stiffness;
        steady.friction_x_n *= self.stiffness;
        for [pressure, _] in &mut steady.pressure {
            *pressure *= self.stiffness;
        }
        steady
    }
}

/// A slot with the slides to be evaluated there, one after the other.
type SlotQueries = (usize, Vec<Query>);

/// Treatment of a slide that is not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// Everything is tried, and a failure is the evaluation's.
    Fails,
    /// Everything is tried, and the slide is left out.
    Sought,
    /// It is left out if the move from a known slide is difficult.
    LeftOut,
}

/// Evaluator of steady slides: the settings, cache and threads that all finite-element models of a run share.
pub struct Evaluator<'a> {
    /// Mesh preset, tissue, numerics; its shape is the one to begin with.
    pub config: &'a Config,
    /// Calibration and identification.
    pub settings: &'a Settings,
    /// Cache of finished states.
    pub cache: StateCache,
    /// The caller's hooks.
    pub hooks: &'a Hooks<'a>,
    /// Last equilibrium of each slot (index of a depth), from which the next model there starts.
    starts: Mutex<BTreeMap<usize, Start>>,
    pool: rayon::ThreadPool,
    effort: Mutex<Effort>,
    found: AtomicU32,
}

impl<'a> Evaluator<'a> {
    /// An evaluator with `jobs` threads.
    pub fn new(
        config: &'a Config,
        settings: &'a Settings,
        cache: StateCache,
        hooks: &'a Hooks<'a>,
        jobs: usize,
    ) -> Self {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().expect("threads can be started");
        Self {
            config,
            settings,
            cache,
            hooks,
            starts: Mutex::default(),
            pool,
            effort: Mutex::default(),
            found: AtomicU32::new(0),
        }
    }

    /// Cost of all slides so far.
    pub fn effort(&self) -> Effort {
        *self.effort.lock().expect("no panic while locked")
    }

    /// Number of states that were computed, not read from the cache.
    pub fn computed(&self) -> u32 {
        self.found.load(Ordering::Relaxed)
    }

    /// A finger of `shape` with a pad for presses of up to `deepest_mm`, at most the shape's own: the smaller, the faster.
    ///
    /// # Errors
    /// [`IdentifyError::Mesh`], [`IdentifyError::Body`].
    pub fn finger(&self, shape: &FingertipShape, deepest_mm: f64) -> Result<Finger, IdentifyError> {
        let tip = mesh::fingertip(shape, &self.config.mesh_preset.divisions())?;
        mesh::check(&tip.mesh)?;
        let height_mm = pad_height_mm(deepest_mm).min(tip.pad_height_mm());
        Ok(Finger::new(tip.with_pad_for(&[Matrix3::identity()], height_mm), &self.config.tissue)?)
    }

    /// The deepest press of a table's depths under all settings, mm: with the largest offset of a calibration and
    /// several standard errors of a depth; as deep as the shape's pad allows if F/N is computed over a range of forces.
    pub fn deepest_mm(&self, depths_mm: &[f64]) -> f64 {
        if self.settings.prediction.curve {
            return f64::INFINITY;
        }
        let varied = self.settings.calibration.vary.iter().filter(|v| v.name == CalibrationParameter::DepthOffsetMm);
        let offset = varied.map(|v| v.bounds()[1]).fold(0.0, f64::max);
        let joint = &self.settings.joint;
        let errors = if joint.enabled { DEPTH_ERRORS * joint.depth_mm } else { 0.0 };
        depths_mm.iter().copied().fold(0.0, f64::max) + offset + errors
    }

    /// Hash of everything that a shape's states depend on besides depth, law and stiffness.
    pub(crate) fn key(&self, shape: &FingertipShape) -> Key {
        let config = self.config;
        key_of(&(
            env!("CARGO_PKG_VERSION"),
            shape,
            config.mesh_preset,
            &config.tissue,
            config.numerics,
            self.settings.tolerance.to_bits(),
        ))
    }

    /// Steady slides on a finger of `shape` that is made for them; the states of a slot follow one another.
    ///
    /// # Errors
    /// [`IdentifyError`] of the first slide that fails.
    pub fn on_shape(
        &self,
        shape: &FingertipShape,
        queries: &[(usize, Vec<Query>)],
    ) -> Result<Vec<Vec<Steady>>, IdentifyError> {
        self.slides_on(shape, queries, Missing::Fails).map(all)
    }

    /// The same; none if there is no slide and `missing` leaves it out.
    ///
    /// # Errors
    /// As of [`FeModel::slides`].
    pub fn slides_on(
        &self,
        shape: &FingertipShape,
        queries: &[(usize, Vec<Query>)],
        missing: Missing,
    ) -> Result<Vec<Vec<Option<Steady>>>, IdentifyError> {
        let key = self.key(shape);
        if let Some(known) = self.cached(&key, queries) {
            return Ok(known);
        }
        let deepest_mm = queries.iter().flat_map(|(_, list)| list).map(|q| q.depth_mm).fold(0.0, f64::max);
        let finger = self.finger(shape, deepest_mm)?;
        let problem = self.config.problem(&finger);
        FeModel { evaluator: self, shape: shape.clone(), problem: &problem, key, sliders: BTreeMap::new(), from: None }
            .slides(queries, missing)
    }

    /// Keeps a state that was computed.
    fn keep(&self, id: Key, steady: Steady) -> Result<Steady, IdentifyError> {
        self.cache.put(id, &steady)?;
        self.found.fetch_add(1, Ordering::Relaxed);
        Ok(steady)
    }

    fn cached(&self, finger: &Key, queries: &[(usize, Vec<Query>)]) -> Option<Vec<Vec<Option<Steady>>>> {
        let state = |q| self.cache.get(&key_of(&(finger, q))).map(Some);
        queries.iter().map(|(_, list)| list.iter().map(state).collect()).collect()
    }
}

/// Finite-element model of one finger, with a slide per slot (a slot is a depth, or a sequence of nearby ones).
pub struct FeModel<'a> {
    evaluator: &'a Evaluator<'a>,
    shape: FingertipShape,
    problem: &'a Problem<'a>,
    key: Key,
    sliders: BTreeMap<usize, Slider<'a>>,
    /// Equilibria per slot from which a model that runs beside others starts. Without them a model starts from the
    /// evaluator's last equilibria and updates these.
    from: Option<BTreeMap<usize, Start>>,
}

impl<'a> FeModel<'a> {
    /// The model of `problem`, whose finger has the shape `shape`.
    pub fn new(evaluator: &'a Evaluator<'a>, shape: &FingertipShape, problem: &'a Problem<'a>) -> Self {
        Self {
            evaluator,
            shape: shape.clone(),
            problem,
            key: evaluator.key(shape),
            sliders: BTreeMap::new(),
            from: None,
        }
    }

    /// Another model of this finger for a concurrent search. It starts from the present equilibria, independently of
    /// other models, and changes no other model's start.
    pub fn beside(&self) -> Self {
        let from = Some(self.evaluator.starts.lock().expect("no panic while locked").clone());
        Self { shape: self.shape.clone(), sliders: BTreeMap::new(), from, ..*self }
    }

    /// The finger's shape.
    pub fn shape(&self) -> &FingertipShape {
        &self.shape
    }

    /// Steady slides, slots side by side; the states of a slot follow one another.
    ///
    /// # Errors
    /// [`IdentifyError`] of the first slide that fails.
    pub fn steady(&mut self, queries: &[(usize, Vec<Query>)]) -> Result<Vec<Vec<Steady>>, IdentifyError> {
        self.slides(queries, Missing::Fails).map(all)
    }

    /// Steady slides as [`Self::steady`] gives them; none if there is no slide and `missing` leaves it out.
    ///
    /// # Errors
    /// [`IdentifyError`] of the first slide that fails, unless it is left out.
    pub fn slides(
        &mut self,
        queries: &[(usize, Vec<Query>)],
        missing: Missing,
    ) -> Result<Vec<Vec<Option<Steady>>>, IdentifyError> {
        if let Some(known) = self.evaluator.cached(&self.key, queries) {
            return Ok(known);
        }
        self.put_on_the_plane(queries)?;
        let (evaluator, key, leads) = (self.evaluator, self.key, self.from.is_none());
        let mut work: Vec<(usize, &SlotQueries, Slider<'a>, Vec<Option<Steady>>)> = queries
            .iter()
            .enumerate()
            .map(|(k, item)| (k, item, self.sliders.remove(&item.0).expect("put there just now"), Vec::new()))
            .collect();
        // The slides that took longest so far first; the deepest first before any has run.
        work.sort_by_key(|(k, _, slider, _)| std::cmp::Reverse((slider.effort.iterations, *k)));
        let result = evaluator.pool.install(|| {
            work.par_iter_mut().with_max_len(1).try_for_each(|(_, (slot, list), slider, out)| {
                let before = slider.effort;
                let result = list.iter().try_for_each(|query| {
                    let id = key_of(&(&key, query));
                    out.push(match evaluator.cache.get(&id) {
                        Some(steady) => Some(steady),
                        None => match self::go(slider, query.unscaled(), missing) {
                            Ok(steady) => Some(evaluator.keep(id, query.scaled(steady))?),
                            Err(error) if missing != Missing::Fails && error.is_local() => None,
                            Err(error) => return Err(error),
                        },
                    });
                    Ok(())
                });
                evaluator.effort.lock().expect("no panic while locked").add(&slider.effort.since(&before));
                if leads {
                    evaluator.starts.lock().expect("no panic while locked").insert(*slot, slider.start());
                }
                result
            })
        });
        work.sort_by_key(|(k, ..)| *k);
        let states = work
            .into_iter()
            .map(|(_, (slot, _), slider, states)| {
                self.sliders.insert(*slot, slider);
                states
            })
            .collect();
        result.map(|()| states)
    }

    /// A slider in contact for every slot: at the slot's previous state, else by a press without friction.
    fn put_on_the_plane(&mut self, queries: &[(usize, Vec<Query>)]) -> Result<(), IdentifyError> {
        let evaluator = self.evaluator;
        let mut cold: Vec<(usize, Place)> = Vec::new();
        for (slot, list) in queries {
            if self.sliders.contains_key(slot) {
                continue;
            }
            let mut slider = Slider::new(self.problem, evaluator.settings.tolerance, evaluator.hooks.go_on);
            let start = match &self.from {
                Some(from) => from.get(slot).cloned(),
                None => evaluator.starts.lock().expect("no panic while locked").get(slot).cloned(),
            };
            if !start.is_some_and(|start| slider.restart(&start)) {
                let mut place = list[0].unscaled();
                place.law = RubberFriction { lambda: 0.0, tau0_mpa: 0.0, ..place.law };
                cold.push((*slot, place));
            }
            self.sliders.insert(*slot, slider);
        }
        // One press passes all depths.
        cold.sort_by(|a, b| a.1.depth_mm.total_cmp(&b.1.depth_mm));
        let Some(&(first, _)) = cold.first() else { return Ok(()) };
        let mut press = self.sliders.remove(&first).expect("inserted above");
        let mut pressed = Vec::new();
        for &(slot, place) in &cold {
            press.go(place, Limits::Pass)?;
            pressed.push((slot, press.start()));
        }
        self.sliders.insert(first, press);
        for (slot, start) in &pressed {
            self.sliders.get_mut(slot).expect("inserted above").restart(start);
        }
        Ok(())
    }
}

/// States none of which may be missing.
fn all(states: Vec<Vec<Option<Steady>>>) -> Vec<Vec<Steady>> {
    let list = |list: Vec<Option<Steady>>| list.into_iter().map(|s| s.expect("a failure is an error")).collect();
    states.into_iter().map(list).collect()
}

/// Moves the slider to a place. If the move from its last equilibrium fails, it lifts off and presses again, unless the
/// place may be left out.
fn go(slider: &mut Slider, to: Place, missing: Missing) -> Result<Steady, IdentifyError> {
    if missing == Missing::LeftOut {
        return slider.go(to, Limits::Shun);
    }
    match slider.go(to, Limits::Stop) {
        Err(error) if error.is_local() => {
            let start = slider.start();
            slider.lift();
            let free = RubberFriction { lambda: 0.0, tau0_mpa: 0.0, ..to.law };
            let again = slider.go(Place { law: free, ..to }, Limits::Pass).and_then(|_| slider.go(to, Limits::Pass));
            again.map_err(|again| {
                slider.restart(&start);
                if again.is_local() { error } else { again }
            })
        }
        other => other,
    }
}
