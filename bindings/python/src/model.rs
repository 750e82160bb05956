//! A model that owns its numbers.
//!
//! Main type: [`Model`].

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

use fingerpad::build::{Data, EffectSlot, Sections, TableColumn};
use fingerpad::effects::{LAWS, tables::TABLE};
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::{Error, Grip, Motion, Relaxation, State, Tuning};
use numpy::{PyReadonlyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
use crate::pad::{self, Pad};
use crate::relaxation::{Branches, in_words, listed};
use crate::shipped;

/// The numbers of a bed, its branches and its tuning.
#[derive(Clone)]
pub struct Bed {
    pub data: Arc<Data>,
    pub relaxation: Relaxation,
    pub tuning: Tuning,
}

impl Bed {
    /// The model for the finger of the tuning.
    pub fn model(&self) -> Result<fingerpad::Model<'_>, Error> {
        self.data.model_unchecked().with_relaxation_unchecked(&self.relaxation).tuned(self.tuning)
    }
}

/// A fitted model: a file's numbers, checked and copied; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct Model {
    bytes: Vec<u8>,
    meta: String,
    effects: Vec<EffectSlot>,
    columns: Vec<TableColumn>,
    pub bed: Bed,
}

impl Model {
    /// The model for the finger of the tuning.
    fn in_use(&self) -> PyResult<fingerpad::Model<'_>> {
        self.bed.model().map_err(error::model)
    }

    /// Takes a file's bytes.
    fn new(bytes: &[u8]) -> Result<Self, Error> {
        let file = ModelFile::relaxing(bytes)?;
        let file = file.file();
        let relaxation = file.model.relaxation().copied().unwrap_or_else(Relaxation::none);
        Ok(Self {
            bytes: bytes.to_vec(),
            meta: file.meta.to_owned(),
            effects: file.effects.to_vec(),
            columns: file.columns.to_vec(),
            bed: Bed { data: Arc::new(*file.model.data()), relaxation, tuning: Tuning::default() },
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

/// The [`Model`] or [`Pad`] of a file or of its bytes.
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
        // No pad: the reader of beds reports the errors of a bed.
        Err(Error::Section { id: [b'P', b'A', b'D', b'N'] }) => {
            let model = Model::new(&bytes).map_err(|e| refused(e.to_string()))?;
            Ok(Bound::new(py, model)?.into_any())
        }
        Err(error) => Err(refused(pad::error_text(&error))),
    }
}

/// Content of a pickled model: its file and size, stiffness, lambda.
type Pickled<'py> = (Bound<'py, PyBytes>, [f32; 3]);

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
    #[pyo3(signature = (name="human"))]
    fn shipped(name: &str) -> PyResult<Self> {
        Self::from_bytes(shipped::files(name)?.bed)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.bytes)
    }

    #[getter]
    fn springs(&self) -> usize {
        self.bed.data.springs.len()
    }

    #[getter]
    fn depth_max_mm(&self) -> PyResult<f32> {
        Ok(self.in_use()?.depth_max_mm())
    }

    #[getter]
    fn normal_force_max_n(&self) -> PyResult<f32> {
        let motion = |depth_mm| Motion { depth_mm, slide_increment_mm: [0.0; 2], spin_increment_rad: 0.0, dt_s: 1e-3 };
        let model = self.in_use()?;
        Ok(model.step(&mut State::default(), motion(model.depth_max_mm())).normal_force_n)
    }

    #[getter]
    fn pose_deg(&self) -> (f32, f32) {
        self.bed.data.pose_deg.into()
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
    fn tuning(&self) -> (f32, f32, f32) {
        let Tuning { size, stiffness, lambda } = self.bed.tuning;
        (size, stiffness, lambda)
    }

    #[pyo3(signature = (*, size=1.0, stiffness=1.0, lambda_factor=1.0))]
    fn tuned(&self, size: f32, stiffness: f32, lambda_factor: f32) -> PyResult<Self> {
        error::check_tuning(size, stiffness, lambda_factor)?;
        let tuning = Tuning { size, stiffness, lambda: lambda_factor };
        let bed = Bed { tuning, ..self.bed.clone() };
        bed.model().map_err(error::model)?;
        Ok(Self {
            bytes: self.bytes.clone(),
            meta: self.meta.clone(),
            effects: self.effects.clone(),
            columns: self.columns.clone(),
            bed,
        })
    }

    /// Shares and times of the branches.
    #[getter]
    fn relaxation(&self) -> Vec<(f32, f32)> {
        listed(&self.bed.relaxation)
    }

    fn relaxing(&self, branches: Branches) -> PyResult<Self> {
        let relaxation = branches.checked()?;
        let file = ModelFile::relaxing(&self.bytes).map_err(error::model)?;
        let file = file.file();
        let sections = Sections {
            tables: file.tables,
            columns: file.columns,
            relaxation: relaxation.is_some().then_some(&relaxation),
        };
        let mut bytes = vec![0; Data::file_length_with(file.effects, sections, file.meta)];
        self.bed.data.write_file_with(file.effects, sections, file.meta, &mut bytes).map_err(error::model)?;
        let mut made = Self::new(&bytes).map_err(error::model)?;
        made.bed.tuning = self.bed.tuning;
        Ok(made)
    }

    #[pyo3(signature = (friction_x_n, friction_y_n=None, *, margin=None, strength_factor=None))]
    fn least_grip<'py>(
        slf: &Bound<'py, Self>,
        friction_x_n: Bound<'py, PyAny>,
        friction_y_n: Option<Bound<'py, PyAny>>,
        margin: Option<Bound<'py, PyAny>>,
        strength_factor: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let over_arrays = slf.py().import("fingerpad._grip")?.getattr("least_grip")?;
        over_arrays.call1((slf, friction_x_n, friction_y_n, margin, strength_factor))
    }

    /// Depths (mm), normal forces (N) and statuses of the least grips for rows of friction along x and y (N), margins and strength
    /// factors.
    fn _least_grips<'py>(
        &self,
        py: Python<'py>,
        given: [PyReadonlyArray1<'py, f32>; 4],
        mut depth_mm: PyReadwriteArray1<'py, f32>,
        mut normal_force_n: PyReadwriteArray1<'py, f32>,
        mut status: PyReadwriteArray1<'py, u32>,
    ) -> PyResult<()> {
        let [x, y, margin, factor] = &given;
        let (x, y, margin, factor) = (x.as_slice()?, y.as_slice()?, margin.as_slice()?, factor.as_slice()?);
        let (depth, normal, status) =
            (depth_mm.as_slice_mut()?, normal_force_n.as_slice_mut()?, status.as_slice_mut()?);
        let lengths = [y.len(), margin.len(), factor.len(), depth.len(), normal.len(), status.len()];
        if let Some(found) = lengths.into_iter().find(|length| *length != x.len()) {
            return Err(error::wrong_length(x.len(), found));
        }
        let model = self.in_use()?;
        py.detach(|| {
            for i in 0..x.len() {
                let grip: Grip = model.least_grip([x[i], y[i]], margin[i], factor[i]);
                (depth[i], normal[i], status[i]) = (grip.depth_mm, grip.normal_force_n, grip.status.0);
            }
        });
        Ok(())
    }

    fn __repr__(&self) -> String {
        let words = if self.bed.tuning == Tuning::default() { "" } else { ", tuned" };
        let (depth, (pitch, roll)) = (self.depth_max_mm().unwrap_or(f32::NAN), self.pose_deg());
        let force = self.normal_force_max_n().unwrap_or(f32::NAN);
        format!(
            "<fingerpad.Model: {} springs, depth 0 to {depth:.2} mm, normal force 0 to {force:.2} N, pitch {pitch} deg, roll {roll} deg, \
             {} effects{words}{}>",
            self.springs(),
            self.effects.len(),
            in_words(&self.bed.relaxation)
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
        let unpickle = py.import("fingerpad._pickle")?.getattr("model")?;
        Ok((unpickle, (this.to_bytes(py), this.tuning().into())))
    }
}
