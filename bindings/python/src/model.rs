//! A model that owns its numbers.
//!
//! Main type: [`Model`].

use std::path::PathBuf;
use std::sync::Arc;

use fingerpad::effects::{LAWS, tables::TABLE};
use fingerpad::{DataOf, EffectSlot, Error, FileOf, Grip, NODES, Pose, SPRINGS, TableColumn, Tuning};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;

/// The model that ships.
const SHIPPED: &[u8] = include_bytes!("../../../data/models/fingertip.fpm");

/// Springs of the accurate model.
pub const ACCURATE: usize = 6;

/// The numbers of a model of either size.
#[derive(Clone)]
pub enum Numbers {
    /// The default model.
    Default(Arc<DataOf<SPRINGS, NODES>>),
    /// The accurate one.
    Accurate(Arc<DataOf<ACCURATE, NODES>>),
}

/// Does the same with the numbers of either size.
macro_rules! with_numbers {
    ($numbers:expr, |$data:ident| $work:expr) => {
        match $numbers {
            $crate::model::Numbers::Default($data) => $work,
            $crate::model::Numbers::Accurate($data) => $work,
        }
    };
}

/// Does the same with a model as fitted, retuned, or posed; `?` leaves for a tuning or a pose that is refused.
macro_rules! with_model {
    ($data:expr, $tuning:expr, $pose:expr, |$model:ident| $work:expr) => {{
        let fitted = $data.model_unchecked();
        match ($tuning, $pose) {
            (None, None) => {
                let $model = fitted;
                $work
            }
            (Some(tuning), None) => {
                let $model = fitted.tuned(tuning)?;
                $work
            }
            (None, Some(pose)) => {
                let $model = fitted.posed(pose)?;
                $work
            }
            (Some(tuning), Some(pose)) => {
                let $model = fitted.tuned(tuning)?.posed(pose)?;
                $work
            }
        }
    }};
}
pub(crate) use with_model;

/// A fitted model: a file's numbers, checked and copied; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct Model {
    bytes: Vec<u8>,
    meta: String,
    effects: Vec<EffectSlot>,
    columns: Vec<TableColumn>,
    pub numbers: Numbers,
    pub tuning: Option<Tuning>,
}

impl Model {
    /// Takes a file's bytes.
    fn new(bytes: &[u8]) -> Result<Self, Error> {
        let mut words = vec![0u64; bytes.len().div_ceil(8)];
        let aligned: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
        aligned[..bytes.len()].copy_from_slice(bytes);
        let aligned: &[u8] = &bytemuck::cast_slice(&words)[..bytes.len()];
        let (numbers, effects, columns, meta) = match FileOf::<SPRINGS, NODES>::from_bytes(aligned) {
            Ok(file) => (Numbers::Default(Arc::new(*file.model.data())), file.effects, file.columns, file.meta),
            Err(refused @ Error::Shape { elements, .. }) if elements as usize == ACCURATE => {
                let file = FileOf::<ACCURATE, NODES>::from_bytes(aligned).map_err(|error| match error {
                    Error::Shape { .. } => refused,
                    other => other,
                })?;
                (Numbers::Accurate(Arc::new(*file.model.data())), file.effects, file.columns, file.meta)
            }
            Err(error) => return Err(error),
        };
        let (effects, columns) = (effects.to_vec(), columns.to_vec());
        Ok(Self { meta: meta.to_owned(), effects, columns, bytes: bytes.to_vec(), numbers, tuning: None })
    }
}

/// What a model is made from anew: its file and, of a tuned one, size, stiffness, lambda, tau0 in MPa.
type Pickled<'py> = (Bound<'py, PyBytes>, Option<[f32; 4]>);

#[pymethods]
impl Model {
    #[staticmethod]
    fn from_bytes(data: &[u8]) -> PyResult<Self> {
        Self::new(data).map_err(error::model)
    }

    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let told = |text: String| format!("{}: {text}", path.display());
        let bytes = std::fs::read(&path).map_err(|e| error::raise(py, "InputError", told(e.to_string())))?;
        Self::new(&bytes).map_err(|e| error::raise(py, "ModelError", told(e.to_string())))
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
        with_numbers!(&self.numbers, |data| data.springs.len())
    }

    #[getter]
    fn depth_max_mm(&self) -> PyResult<f32> {
        let depth = || -> Result<f32, Error> {
            with_numbers!(&self.numbers, |data| with_model!(data, self.tuning, None::<Pose>, |model| Ok(
                model.depth_max_mm()
            )))
        };
        depth().map_err(error::model)
    }

    #[getter]
    fn pitch_deg(&self) -> f32 {
        with_numbers!(&self.numbers, |data| data.pose.pitch_deg)
    }

    #[getter]
    fn knows_poses(&self) -> bool {
        with_numbers!(&self.numbers, |data| data.pose.knows_poses())
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
        let tuning = Tuning { size, stiffness, lambda: lambda_factor, tau0_mpa };
        with_numbers!(&self.numbers, |data| data.model_unchecked().tuned(tuning).map(|_| ())).map_err(error::model)?;
        Ok(Self {
            bytes: self.bytes.clone(),
            meta: self.meta.clone(),
            effects: self.effects.clone(),
            columns: self.columns.clone(),
            numbers: self.numbers.clone(),
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
        let grip = || -> Result<Grip, Error> {
            with_numbers!(&self.numbers, |data| with_model!(data, self.tuning, None::<Pose>, |model| Ok(
                model.least_grip([friction_x_n, friction_y_n], margin, strength_factor)
            )))
        };
        let Grip { depth_mm, normal_force_n, status } = grip().map_err(error::model)?;
        Ok((depth_mm, normal_force_n, status.0))
    }

    fn __repr__(&self) -> String {
        let words = if self.tuning.is_some() { ", tuned" } else { "" };
        let depth = self.depth_max_mm().unwrap_or(f32::NAN);
        format!("<fingerpad.Model: {} springs, to {depth} mm, {} effects{words}>", self.springs(), self.effects.len())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let py = slf.py();
        let this = slf.get();
        let values = this.tuning.map(|t| [t.size, t.stiffness, t.lambda, t.tau0_mpa]);
        let unpickle = py.import("fingerpad._pickle")?.getattr("model")?;
        Ok((unpickle, (this.to_bytes(py), values)))
    }
}
