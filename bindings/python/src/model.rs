//! A model that owns its numbers.
//!
//! Main type: [`Model`].

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

use fingerpad::effects::{LAWS, tables::TABLE};
use fingerpad::{Data, EffectSlot, Error, Grip, ModelFile, PadModelFile, TableColumn, Tuning};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
use crate::pad::{self, Pad};

/// The model that ships.
const SHIPPED: &[u8] = include_bytes!("../../../data/models/fingertip.fpm");

/// Does the same with a model as fitted or retuned; `?` leaves for a tuning that is refused.
macro_rules! with_model {
    ($data:expr, $tuning:expr, |$model:ident| $work:expr) => {
        match $tuning {
            None => {
                let $model = $data.model_unchecked();
                $work
            }
            Some(tuning) => {
                let $model = $data.model_unchecked().tuned(tuning)?;
                $work
            }
        }
    };
}
pub(crate) use with_model;

/// A fitted model: a file's numbers, checked and copied; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct Model {
    bytes: Vec<u8>,
    meta: String,
    effects: Vec<EffectSlot>,
    columns: Vec<TableColumn>,
    pub data: Arc<Data>,
    pub tuning: Option<Tuning>,
}

impl Model {
    /// Takes a file's bytes.
    fn new(bytes: &[u8]) -> Result<Self, Error> {
        let file = ModelFile::new(bytes)?;
        let file = file.file();
        Ok(Self {
            bytes: bytes.to_vec(),
            meta: file.meta.to_owned(),
            effects: file.effects.to_vec(),
            columns: file.columns.to_vec(),
            data: Arc::new(*file.model.data()),
            tuning: None,
        })
    }
}

/// Text of the error for a file that is no bed.
fn error_text(bytes: &[u8], error: &Error) -> String {
    match error {
        Error::Section { .. } if PadModelFile::new(bytes).is_ok() => {
            "a pad, not a bed of springs: use fingerpad.load, or Pad in place of Model".to_owned()
        }
        other => other.to_string(),
    }
}

/// What a file or its bytes hold: a [`Model`] or a [`Pad`].
#[pyfunction]
pub fn load<'py>(py: Python<'py>, source: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (bytes, place) = match source.cast::<PyBytes>() {
        Ok(bytes) => (bytes.as_bytes().to_vec(), String::new()),
        Err(_) => {
            let path: PathBuf = source.extract()?;
            (error::read(&path)?, format!("{}: ", path.display()))
        }
    };
    let refused = |text: String| error::model_text(format!("{place}{text}"));
    match Pad::new(&bytes) {
        Ok(pad) => Ok(Bound::new(py, pad)?.into_any()),
        // No pad: what is wrong with a bed the reader of beds says.
        Err(Error::Section { id: [b'P', b'A', b'D', b'N'] }) => {
            let model = Model::new(&bytes).map_err(|e| refused(e.to_string()))?;
            Ok(Bound::new(py, model)?.into_any())
        }
        Err(error) => Err(refused(pad::error_text(&error))),
    }
}

/// What a model is made from anew: its file and, of a tuned one, size, stiffness, lambda, tau0 in MPa.
type Pickled<'py> = (Bound<'py, PyBytes>, Option<[f32; 4]>);

#[pymethods]
impl Model {
    #[staticmethod]
    fn from_bytes(data: &[u8]) -> PyResult<Self> {
        Self::new(data).map_err(|e| error::model_text(error_text(data, &e)))
    }

    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        let bytes = error::read(&path)?;
        Self::new(&bytes).map_err(|e| error::model_text(format!("{}: {}", path.display(), error_text(&bytes, &e))))
    }

    #[staticmethod]
    fn shipped() -> PyResult<Self> {
        Self::from_bytes(SHIPPED)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.bytes)
    }

    #[getter]
    fn springs(&self) -> usize {
        self.data.springs.len()
    }

    #[getter]
    fn depth_max_mm(&self) -> PyResult<f32> {
        let depth = || -> Result<f32, Error> { Ok(with_model!(self.data, self.tuning, |model| model.depth_max_mm())) };
        depth().map_err(error::model)
    }

    #[getter]
    fn pose_deg(&self) -> (f32, f32) {
        self.data.pose_deg.into()
    }

    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.meta,))
    }

    #[getter]
    fn effects(&self) -> Vec<(String, Vec<f32>)> {
        let name = |kind: u32| match LAWS.iter().find(|law| law.kind == kind) {
            Some(law) => law.name.to_owned(),
            None if kind == TABLE => "table".to_owned(),
            None => format!("baseline_{kind}"),
        };
        self.effects.iter().map(|slot| (name(slot.kind), slot.values.to_vec())).collect()
    }

    #[getter]
    fn own_columns(&self) -> Vec<(&str, &str, (f32, f32), f32)> {
        self.columns.iter().map(|c| (c.name(), c.unit(), (c.low, c.high), c.reference)).collect()
    }

    #[getter]
    fn tuning(&self) -> (f32, f32, f32, f32) {
        let Tuning { size, stiffness, lambda, tau0_mpa } = self.tuning.unwrap_or_default();
        (size, stiffness, lambda, tau0_mpa)
    }

    #[pyo3(signature = (*, size=1.0, stiffness=1.0, lambda_factor=1.0, tau0_mpa=0.0))]
    fn tuned(&self, size: f32, stiffness: f32, lambda_factor: f32, tau0_mpa: f32) -> PyResult<Self> {
        error::check_tuning(size, stiffness, lambda_factor)?;
        if !(0.0..=0.1).contains(&tau0_mpa) {
            return Err(error::model_text(format!("tau0_mpa: {tau0_mpa} is not between 0 and 0.1")));
        }
        let tuning = Tuning { size, stiffness, lambda: lambda_factor, tau0_mpa };
        self.data.model_unchecked().tuned(tuning).map_err(error::model)?;
        Ok(Self {
            bytes: self.bytes.clone(),
            meta: self.meta.clone(),
            effects: self.effects.clone(),
            columns: self.columns.clone(),
            data: self.data.clone(),
            tuning: Some(tuning),
        })
    }

    #[pyo3(signature = (friction_x_n, friction_y_n=0.0, *, margin=0.0, strength_factor=1.0))]
    fn least_grip(
        &self,
        friction_x_n: f32,
        friction_y_n: f32,
        margin: f32,
        strength_factor: f32,
    ) -> PyResult<(f32, f32, u16)> {
        let load = [friction_x_n, friction_y_n];
        let grip = || -> Result<Grip, Error> {
            Ok(with_model!(self.data, self.tuning, |model| model.least_grip(load, margin, strength_factor)))
        };
        let Grip { depth_mm, normal_force_n, status } = grip().map_err(error::model)?;
        Ok((depth_mm, normal_force_n, status.0))
    }

    fn __repr__(&self) -> String {
        let words = if self.tuning.is_some() { ", tuned" } else { "" };
        let (depth, (pitch, roll)) = (self.depth_max_mm().unwrap_or(f32::NAN), self.pose_deg());
        format!(
            "<fingerpad.Model: {} springs, depth 0 to {depth:.2} mm, pitch {pitch} deg, roll {roll} deg, {} effects{words}>",
            self.springs(),
            self.effects.len()
        )
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.bytes == other.bytes && self.tuning() == other.tuning()
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.bytes.hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let py = slf.py();
        let this = slf.get();
        let values = this.tuning.map(|t| [t.size, t.stiffness, t.lambda, t.tau0_mpa]);
        let unpickle = py.import("fingerpad._pickle")?.getattr("model")?;
        Ok((unpickle, (this.to_bytes(py), values)))
    }
}
