//! The margin to slip on a surface of unknown friction, from measured force and motion.
//!
//! Main types: [`MarginObserver`], [`Margin`]. Uses the core's observer.

use std::sync::{Arc, Mutex, PoisonError};

use fingerpad::build::Data;
use fingerpad::margin::{Known, MarginObserver as Core, Reading, Settings};
use fingerpad::{NODES, SPRINGS};
use pyo3::prelude::*;

use crate::error;
use crate::model::Model;

/// Observer of one contact; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct MarginObserver {
    // Before the numbers that it reads, so that it goes first.
    core: Mutex<Core<'static, SPRINGS, NODES>>,
    _data: Arc<Data>,
}

#[pymethods]
impl MarginObserver {
    #[new]
    #[pyo3(signature = (model, *, strength=None, stiffness=None, force_lag_s=0.0, play_mm=0.0, drift=0.0, tare_n=None, tare_drift_n=0.0, confidence=None, ahead_s=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        model: &Model,
        strength: Option<f32>,
        stiffness: Option<f32>,
        force_lag_s: f32,
        play_mm: f32,
        drift: f32,
        tare_n: Option<f32>,
        tare_drift_n: f32,
        confidence: Option<f32>,
        ahead_s: Option<f32>,
    ) -> PyResult<Self> {
        let usual = Settings::default();
        let settings = Settings {
            strength: strength.unwrap_or(usual.strength),
            stiffness: stiffness.unwrap_or(usual.stiffness),
            force_lag_s,
            play_mm,
            drift,
            tare_n: tare_n.unwrap_or(usual.tare_n),
            tare_drift_n,
            confidence: confidence.unwrap_or(usual.confidence),
            ahead_s: ahead_s.unwrap_or(usual.ahead_s),
            ..usual
        };
        if model.bed.relaxation.is_some() {
            return Err(error::input("model: section RELX: an observer takes a bed whose tissue does not relax"));
        }
        let data = Arc::clone(&model.bed.data);
        // SAFETY: the numbers lie where the count of references keeps them, as long as `_data` does, which outlives the observer.
        let numbers: &'static Data = unsafe { &*Arc::as_ptr(&data) };
        let finger = numbers.model_unchecked().tuned(model.bed.tuning).map_err(error::model)?;
        let core = Core::new(&finger, settings).map_err(|e| error::input(e.to_string()))?;
        Ok(Self { core: Mutex::new(core), _data: data })
    }

    #[pyo3(signature = (normal_force_n, friction_x_n, friction_y_n, slide_x_mm, slide_y_mm, *, dt_s=1e-3, normal_variance_n2=25e-6, friction_covariance_n2=(25e-6, 25e-6, 0.0), slide_covariance_mm2=(25e-6, 25e-6, 0.0), stick_ratio=0.0, stick_variance=0.0))]
    #[allow(clippy::too_many_arguments)]
    fn step(
        &self,
        normal_force_n: f32,
        friction_x_n: f32,
        friction_y_n: f32,
        slide_x_mm: f32,
        slide_y_mm: f32,
        dt_s: f32,
        normal_variance_n2: f32,
        friction_covariance_n2: (f32, f32, f32),
        slide_covariance_mm2: (f32, f32, f32),
        stick_ratio: f32,
        stick_variance: f32,
    ) -> Margin {
        let m = self.core.lock().unwrap_or_else(PoisonError::into_inner).step(Reading {
            normal_force_n,
            friction_n: [friction_x_n, friction_y_n],
            slide_increment_mm: [slide_x_mm, slide_y_mm],
            normal_variance_n2,
            friction_covariance_n2: friction_covariance_n2.into(),
            slide_covariance_mm2: slide_covariance_mm2.into(),
            stick_ratio,
            stick_variance,
            dt_s,
        });
        Margin {
            strength_factor: m.strength_factor,
            strength_low: m.strength_low,
            strength_high: m.strength_high,
            slip_margin: m.slip_margin,
            margin_low: m.margin_low,
            margin_high: m.margin_high,
            slip_chance: m.slip_chance,
            stiffness_factor: m.stiffness_factor,
            information: m.information,
            known: match m.known {
                Known::NoContact => "no_contact",
                Known::Prior => "prior",
                Known::Part => "part",
                Known::Strength => "strength",
            },
            surface_changed: m.surface_changed,
            status: m.status.0,
        }
    }
}

/// What is known of the surface after a reading; see `_native.pyi`.
#[pyclass(frozen, get_all, module = "fingerpad")]
pub struct Margin {
    strength_factor: f32,
    strength_low: f32,
    strength_high: f32,
    slip_margin: f32,
    margin_low: f32,
    margin_high: f32,
    slip_chance: f32,
    stiffness_factor: f32,
    information: f32,
    known: &'static str,
    surface_changed: bool,
    status: u32,
}
