//! One finger whose step takes and returns plain numbers, for control loops.
//!
//! Main types: [`Finger`], [`Response`]. Uses contacts and group.

use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict};

use crate::contacts::Contacts;
use crate::error;
use crate::group::{FORCES, Group, REGIME, RESPONSE, Row};
use crate::model::Model;

/// One contact; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct Finger {
    group: Mutex<Box<dyn Group>>,
    /// `Fingers` of one contact, which holds model, body and pose; its own state is not used.
    settings: Py<PyAny>,
    /// A step of a bed is shorter than releasing the interpreter.
    is_bed: bool,
}

impl Finger {
    /// The contact of `Fingers` of one, in its state.
    fn of(fingers: Bound<'_, PyAny>) -> PyResult<Self> {
        let py = fingers.py();
        let contacts = fingers.getattr("_contacts")?.cast_into::<Contacts>()?;
        let contacts = contacts.get();
        let group = py.detach(|| contacts.lock().copy());
        let is_bed = fingers.getattr("model")?.is_instance_of::<Model>();
        Ok(Self { group: Mutex::new(group), settings: fingers.unbind(), is_bed })
    }

    /// The contact. Nothing that holds it needs the interpreter.
    fn lock(&self) -> MutexGuard<'_, Box<dyn Group>> {
        self.group.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn setting<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.settings.bind(py).getattr(name)
    }
}

/// Content of a pickled finger: its settings and its saved state.
type Pickled<'py> = (Py<PyAny>, Bound<'py, PyBytes>);

#[pymethods]
impl Finger {
    #[new]
    #[pyo3(signature = (model, *, spin=false, body=None, pitch_deg=None, roll_deg=None))]
    fn new(
        model: Bound<'_, PyAny>,
        spin: bool,
        body: Option<Bound<'_, PyAny>>,
        pitch_deg: Option<f32>,
        roll_deg: Option<f32>,
    ) -> PyResult<Self> {
        let py = model.py();
        let options = PyDict::new(py);
        options.set_item("spin", spin)?;
        options.set_item("body", body)?;
        options.set_item("pitch_deg", pitch_deg)?;
        options.set_item("roll_deg", roll_deg)?;
        Self::of(py.import("fingerpad._fingers")?.getattr("Fingers")?.call((model, 1), Some(&options))?)
    }

    #[getter]
    fn model<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.setting(py, "model")
    }

    #[getter]
    fn body<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.setting(py, "body")
    }

    #[getter]
    fn spin<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.setting(py, "spin")
    }

    #[pyo3(signature = (depth_mm, slide_x_mm=0.0, slide_y_mm=0.0, spin_rad=0.0, *, dt_s=1e-3, strength_factor=None, pitch_deg=None, roll_deg=None))]
    #[allow(clippy::too_many_arguments)]
    fn step(
        &self,
        py: Python<'_>,
        depth_mm: f32,
        slide_x_mm: f32,
        slide_y_mm: f32,
        spin_rad: f32,
        dt_s: f32,
        strength_factor: Option<f32>,
        pitch_deg: Option<f32>,
        roll_deg: Option<f32>,
    ) -> PyResult<Response> {
        if self.is_bed && (pitch_deg.is_some() || roll_deg.is_some()) {
            let refuse = py.import("fingerpad._fingers")?.getattr("refuse_pose")?;
            refuse.call1((self.setting(py, "model")?, pitch_deg, roll_deg))?;
        }
        let row = Row {
            depth_mm: &[depth_mm],
            slide_x_mm: &[slide_x_mm],
            slide_y_mm: &[slide_y_mm],
            spin_rad: &[spin_rad],
            strength_factor: strength_factor.as_slice(),
            pitch_deg: pitch_deg.as_slice(),
            roll_deg: roll_deg.as_slice(),
            dt_s,
            ..Row::REST
        };
        let mut words = [0; RESPONSE];
        if self.is_bed {
            self.lock().step(0, &row, &mut words)
        } else {
            py.detach(|| self.lock().step(0, &row, &mut words))
        }
        .map_err(error::model)?;
        Ok(Response { words })
    }

    #[getter]
    fn depth_mm(&self) -> f32 {
        self.lock().state().0[0]
    }

    #[getter]
    fn strength_factor(&self) -> f32 {
        self.lock().state().1[0]
    }

    fn reset(&self) {
        self.lock().reset(&[true]);
    }

    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.lock().save()?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn restore(&self, data: &[u8]) -> PyResult<()> {
        Ok(self.lock().restore(data)?)
    }

    fn copy(&self, py: Python<'_>) -> Self {
        Self { group: Mutex::new(self.lock().copy()), settings: self.settings.clone_ref(py), is_bed: self.is_bed }
    }

    fn fingers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let fingers = self.settings.bind(py).call_method0("copy")?;
        fingers.call_method1("restore", (self.save(py)?,))?;
        Ok(fingers)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<fingerpad.Finger: depth {:.4} mm, of {}>", self.depth_mm(), self.settings.bind(py).repr()?))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let py = slf.py();
        let unpickle = py.import("fingerpad._pickle")?.getattr("finger")?;
        Ok((unpickle, (slf.get().settings.clone_ref(py), slf.get().save(py)?)))
    }

    #[staticmethod]
    fn _of(fingers: Bound<'_, PyAny>) -> PyResult<Self> {
        Self::of(fingers)
    }
}

/// Result of one step of a finger; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct Response {
    words: [u32; RESPONSE],
}

impl Response {
    fn float(&self, place: usize) -> f32 {
        f32::from_bits(self.words[place])
    }
}

/// A class of `fingerpad._fingers`, looked up once.
fn class<'py>(py: Python<'py>, once: &'static PyOnceLock<Py<PyAny>>, name: &str) -> PyResult<&'py Bound<'py, PyAny>> {
    let found =
        once.get_or_try_init(py, || Ok::<_, PyErr>(py.import("fingerpad._fingers")?.getattr(name)?.unbind()))?;
    Ok(found.bind(py))
}

#[pymethods]
impl Response {
    #[getter]
    fn normal_force_n(&self) -> f32 {
        self.float(0)
    }

    #[getter]
    fn friction_x_n(&self) -> f32 {
        self.float(1)
    }

    #[getter]
    fn friction_y_n(&self) -> f32 {
        self.float(2)
    }

    #[getter]
    fn spin_moment_n_mm(&self) -> f32 {
        self.float(3)
    }

    #[getter]
    fn slip_margin(&self) -> f32 {
        self.float(4)
    }

    #[getter]
    fn stick_ratio(&self) -> f32 {
        self.float(5)
    }

    #[getter]
    fn regime<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        static REGIME_CLASS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
        class(py, &REGIME_CLASS, "Regime")?.call1((self.words[REGIME],))
    }

    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        static STATUS_CLASS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
        class(py, &STATUS_CLASS, "Status")?.call1((self.words[REGIME + 1],))
    }

    #[getter]
    fn friction_limit_n(&self) -> f32 {
        self.float(FORCES)
    }

    #[getter]
    fn contact_area_mm2(&self) -> f32 {
        self.float(FORCES + 1)
    }

    #[getter]
    fn pressure_centre_x_mm(&self) -> f32 {
        self.float(FORCES + 2)
    }

    #[getter]
    fn pressure_centre_y_mm(&self) -> f32 {
        self.float(FORCES + 3)
    }

    #[getter]
    fn band_normal_n(&self) -> f32 {
        self.float(FORCES + 4)
    }

    #[getter]
    fn band_friction_n(&self) -> f32 {
        self.float(FORCES + 5)
    }

    #[getter]
    fn tangential_friction_x_n(&self) -> f32 {
        self.float(FORCES + 6)
    }

    #[getter]
    fn tangential_friction_y_n(&self) -> f32 {
        self.float(FORCES + 7)
    }

    #[getter]
    fn tilt_moment_x_n_mm(&self) -> f32 {
        self.float(FORCES + 8)
    }

    #[getter]
    fn tilt_moment_y_n_mm(&self) -> f32 {
        self.float(FORCES + 9)
    }

    #[getter]
    fn slip_margin_relaxed(&self) -> f32 {
        self.float(FORCES + 10)
    }

    /// The response as an array of one record of `RESPONSE`.
    fn to_record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let bytes: Vec<u8> = self.words.iter().flat_map(|word| word.to_ne_bytes()).collect();
        py.import("fingerpad._fingers")?.getattr("record_of")?.call1((PyBytes::new(py, &bytes),))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.words == other.words
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        self.words.hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let status = fingerpad::Status(self.words[REGIME + 1]);
        // A zero that rounding made negative is written without its sign.
        let force = |place: usize| (f64::from(self.float(place)) * 1e4).round() / 1e4 + 0.0;
        Ok(format!(
            "<fingerpad.Response: {}, normal force {:.4} N, friction x {:.4} N, y {:.4} N, moment {:.4} N mm, slip margin {:.3}, \
             stick ratio {:.3}, status {status}>",
            self.regime(py)?.getattr("name")?,
            force(0),
            force(1),
            force(2),
            force(3),
            self.float(4),
            self.float(5),
        ))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Vec<u32>,))> {
        Ok((py.import("fingerpad._native")?.getattr("Response")?.getattr("_of")?, (self.words.to_vec(),)))
    }

    #[staticmethod]
    fn _of(words: [u32; RESPONSE]) -> Self {
        Self { words }
    }
}
