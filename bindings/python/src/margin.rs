//! The margin to slip on a surface of unknown friction, from measured force and motion.
//!
//! Main types: [`MarginObserver`], [`Margin`]. Uses the core's observers of a bed and of a pad.

use std::sync::{Arc, Mutex, PoisonError};

use fingerpad::build::Data;
use fingerpad::margin::{self, Known, Observable, Observer, PadObserver, Reading, Settings};
use fingerpad::pad::{Body, PadOn};
use fingerpad::{Error, NODES, SPRINGS};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;
use crate::model::Model;
use crate::pad::{self, Pad, Tables};

/// An observer of any finger.
trait Observing: Send {
    fn step(&mut self, reading: Reading) -> margin::Margin;
}

impl<F: Observable<S> + Send, S: Copy + Send, const TWINS: usize> Observing for Observer<F, S, TWINS>
where
    F::Tables: Send,
{
    fn step(&mut self, reading: Reading) -> margin::Margin {
        Observer::step(self, reading)
    }
}

/// The numbers that an observer reads.
#[expect(dead_code, reason = "kept, not read")]
enum Numbers {
    Bed(Arc<Data>),
    Pad(Arc<Tables>, Arc<Body>),
}

/// A reference to what an [`Arc`] keeps.
///
/// # Safety
/// It must not be used after the last clone of the `Arc` is gone.
unsafe fn kept<T>(arc: &Arc<T>) -> &'static T {
    // SAFETY: the caller's promise.
    unsafe { &*Arc::as_ptr(arc) }
}

/// Observer of one contact; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct MarginObserver {
    // Before the numbers that it reads, so that it goes first.
    core: Mutex<Box<dyn Observing>>,
    _numbers: Numbers,
}

impl MarginObserver {
    fn of_bed(model: &Model, settings: Settings) -> PyResult<Self> {
        if model.bed.relaxation.is_some() {
            return Err(error::input("model: section RELX: an observer takes a bed whose tissue does not relax"));
        }
        let data = Arc::clone(&model.bed.data);
        // SAFETY: `_numbers` keeps it as long as the observer is there.
        let numbers = unsafe { kept(&data) };
        let finger = numbers.model_unchecked().tuned(model.bed.tuning).map_err(error::model)?;
        let core = margin::MarginObserver::<SPRINGS, NODES>::new(&finger, settings).map_err(refused)?;
        Ok(Self { core: Mutex::new(Box::new(core)), _numbers: Numbers::Bed(data) })
    }

    fn of_pad(pad: &Pad, settings: Settings, body: Body, pose_deg: [f32; 2]) -> PyResult<Self> {
        fn of<const P: usize>(finger: &PadOn<'static, Body>, settings: Settings) -> PyResult<Box<dyn Observing>> {
            Ok(Box::new(PadObserver::<'static, Body, P>::new(finger, settings).map_err(refused)?))
        }
        if pad.relaxes() {
            return Err(error::input("pad: section RELX: an observer takes a pad whose tissue does not relax"));
        }
        let (tables, body) = (Arc::clone(&pad.tables), Arc::new(body));
        // SAFETY: `_numbers` keeps both as long as the observer is there.
        let (numbers, on) = unsafe { (kept(&tables), kept(&body)) };
        let finger = PadOn { pad: numbers.pad().tuned(pad.tuning).map_err(error::model)?, body: on, pose_deg };
        let few = pad.patches() <= pad::USUAL;
        let core = if few { of::<{ pad::USUAL }>(&finger, settings) } else { of::<{ pad::MOST }>(&finger, settings) }?;
        Ok(Self { core: Mutex::new(core), _numbers: Numbers::Pad(tables, body) })
    }
}

/// A setting out of its range.
fn refused(error: Error) -> PyErr {
    error::input(error.to_string())
}

#[pymethods]
impl MarginObserver {
    #[new]
    #[pyo3(signature = (model, *, body=None, pitch_deg=None, roll_deg=None, model_error=None, strength=None, stiffness=None, force_lag_s=0.0, play_mm=0.0, drift=0.0, tare_n=None, tare_drift_n=0.0, confidence=None, ahead_s=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        model: &Bound<'_, PyAny>,
        body: Option<Bound<'_, PyAny>>,
        pitch_deg: Option<f32>,
        roll_deg: Option<f32>,
        model_error: Option<f32>,
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
        let usual = if model.is_instance_of::<Pad>() { Settings::for_pad() } else { Settings::default() };
        let settings = Settings {
            model_error: model_error.unwrap_or(usual.model_error),
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
        // `Fingers` checks model, body and pose.
        let py = model.py();
        let options = PyDict::new(py);
        options.set_item("body", body)?;
        options.set_item("pitch_deg", pitch_deg)?;
        options.set_item("roll_deg", roll_deg)?;
        let fingers = py.import("fingerpad._fingers")?.getattr("Fingers")?.call((model, 1), Some(&options))?;
        if let Ok(pad) = model.cast::<Pad>() {
            let body = fingers.getattr("body")?;
            let kind = body.get_type().name()?.to_string();
            let numbers = py.import("fingerpad._bodies")?.getattr("numbers")?.call1((&body,))?.extract()?;
            let body = pad::body(&kind, numbers).ok_or_else(|| error::input(format!("body: {kind} is none")))?;
            let neutral = pad.get().neutral_pitch_deg();
            return Self::of_pad(pad.get(), settings, body, [pitch_deg.unwrap_or(neutral), roll_deg.unwrap_or(0.0)]);
        }
        Self::of_bed(model.cast::<Model>()?.get(), settings)
    }

    #[pyo3(signature = (normal_force_n, friction_x_n, friction_y_n, slide_x_mm, slide_y_mm, *, dt_s=1e-3, normal_variance_n2=25e-6, friction_covariance_n2=(25e-6, 25e-6, 0.0), slide_covariance_mm2=(25e-6, 25e-6, 0.0), stick_ratio=0.0, stick_variance=0.0, spin_rad=0.0, spin_moment_n_mm=0.0, spin_variance_n2_mm2=0.0))]
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
        spin_rad: f32,
        spin_moment_n_mm: f32,
        spin_variance_n2_mm2: f32,
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
            spin_increment_rad: spin_rad,
            spin_moment_n_mm,
            spin_variance_n2_mm2,
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
