//! A pad that owns its numbers, and contacts of it on one rigid body.
//!
//! Main types: [`Pad`], [`Patches`].

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

use bytemuck::Pod;
use fingerpad::host::PadModelFile;
use fingerpad::pad::{
    Body, Cylinder, Edge, Memory, Numbers, Orthotropy, Pad as PadInPlace, PadOn, PadState, Patch, PatchState, Plane,
    Sphere, Surface,
};
use fingerpad::{Error, Grip, Relaxation, Tuning};
use numpy::{PyReadonlyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
use crate::group::{
    DRIVEN, FORCES, Given, Group, PATCH, Refused, Row, Watches, drive_all, gradients, states, write_response,
};
use crate::relaxation::{Branches, in_words, listed};
use crate::shipped;

/// Patches of the human finger.
pub const USUAL: usize = 37;
/// Steps of a press from the air to the largest depth.
const PRESS_STEPS: usize = 100;
/// Most patches of a pad.
pub const MOST: usize = 128;

/// The numbers of a pad.
pub struct Tables {
    patches: Vec<Patch>,
    numbers: Numbers,
    relaxation: Relaxation,
    orthotropy: Orthotropy,
}

impl Tables {
    /// The pad as fitted.
    pub fn pad(&self) -> PadInPlace<'_> {
        PadInPlace::new(&self.patches, &self.numbers).with_relaxation(self.relaxation).with_orthotropy(self.orthotropy)
    }
}

/// A fitted pad: a file's numbers, checked and copied; see `_native.pyi`.
#[pyclass(frozen, module = "fingerpad")]
pub struct Pad {
    bytes: Vec<u8>,
    meta: String,
    pub tables: Arc<Tables>,
    pub tuning: Tuning,
}

impl Pad {
    /// Takes a file's bytes.
    pub fn new(bytes: &[u8]) -> Result<Self, Error> {
        let file = PadModelFile::new(bytes)?;
        let file = file.file();
        let patches = file.pad.patches.to_vec();
        if patches.len() > MOST {
            return Err(Error::Shape { elements: patches.len() as u32, nodes: MOST as u32 });
        }
        let (relaxation, orthotropy) = (*file.pad.relaxation(), *file.pad.orthotropy());
        let tables = Arc::new(Tables { patches, numbers: *file.pad.numbers, relaxation, orthotropy });
        Ok(Self { bytes: bytes.to_vec(), meta: file.meta.to_owned(), tables, tuning: Tuning::default() })
    }

    /// Whether its states remember.
    pub fn relaxes(&self) -> bool {
        self.tables.relaxation.is_some()
    }

    fn size(&self) -> f32 {
        self.tuning.size
    }
}

/// Content of a pickled pad: its file and, if it is tuned, size, stiffness and lambda.
type Pickled<'py> = (Bound<'py, PyBytes>, [f32; 3]);

/// Text of the error for a file that is no pad.
pub fn error_text(error: &Error) -> String {
    match error {
        Error::Section { id: [b'P', b'A', b'D', b'N'] } => {
            "a bed of springs, not a pad: use fingerpad.load, or Model in place of Pad".to_owned()
        }
        Error::Shape { elements, nodes } if *nodes != 0 => format!("{elements} patches; at most {nodes} are used here"),
        Error::Shape { elements, .. } => format!("a pad of {elements} modes; another number is used here"),
        other => other.to_string(),
    }
}

#[pymethods]
impl Pad {
    #[staticmethod]
    fn from_bytes(data: &[u8]) -> PyResult<Self> {
        Self::new(data).map_err(|e| error::model_text(error_text(&e)))
    }

    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        let bytes = error::read(&path)?;
        Self::new(&bytes).map_err(|e| error::model_text(format!("{}: {}", path.display(), error_text(&e))))
    }

    #[staticmethod]
    #[pyo3(signature = (name="human"))]
    fn shipped(name: &str) -> PyResult<Self> {
        Self::from_bytes(shipped::files(name)?.pad)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.bytes)
    }

    #[getter]
    pub fn patches(&self) -> usize {
        self.tables.patches.len()
    }

    #[getter]
    fn patch_areas_mm2(&self) -> Vec<f32> {
        let size = self.size();
        self.tables.patches.iter().map(|patch| patch.area_mm2 * (size * size)).collect()
    }

    #[getter]
    fn depth_max_mm(&self) -> f32 {
        self.tables.numbers.depth_max_mm * self.size()
    }

    #[getter]
    fn normal_force_max_n(&self) -> PyResult<f32> {
        fn at<const P: usize>(pad: &Pad) -> Result<f32, Error> {
            let pose_deg = [pad.neutral_pitch_deg(), 0.0];
            let Some(mut finger) = Patches::<P, ()>::new(pad, Body::Plane, String::new(), vec![pose_deg])? else {
                return Ok(f32::NAN);
            };
            let mut out = [0; FORCES];
            for k in 1..=PRESS_STEPS {
                let depth_mm = pad.depth_max_mm() * (k as f32 / PRESS_STEPS as f32);
                let row =
                    Row { depth_mm: &[depth_mm], slide_x_mm: &[0.0], slide_y_mm: &[0.0], dt_s: 1e-3, ..Row::REST };
                finger.step(0, &row, &mut out)?;
            }
            Ok(f32::from_bits(out[0]))
        }
        let force = if self.patches() <= USUAL { at::<USUAL>(self) } else { at::<MOST>(self) };
        force.map_err(error::model)
    }

    #[getter]
    fn pitch_range_deg(&self) -> (f32, f32) {
        self.tables.numbers.pitch_range_deg.into()
    }

    #[getter]
    fn roll_range_deg(&self) -> (f32, f32) {
        let most = self.tables.numbers.roll_max_deg;
        (-most, most)
    }

    #[getter]
    pub fn neutral_pitch_deg(&self) -> f32 {
        self.tables.numbers.neutral_pitch_deg
    }

    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.meta,))
    }

    #[getter]
    fn tuning(&self) -> (f32, f32, f32) {
        let Tuning { size, stiffness, lambda } = self.tuning;
        (size, stiffness, lambda)
    }

    #[pyo3(signature = (*, size=1.0, stiffness=1.0, lambda_factor=1.0))]
    fn tuned(&self, size: f32, stiffness: f32, lambda_factor: f32) -> PyResult<Self> {
        error::check_tuning(size, stiffness, lambda_factor)?;
        let tuning = Tuning { size, stiffness, lambda: lambda_factor };
        self.tables.pad().tuned(tuning).map_err(error::model)?;
        Ok(Self { bytes: self.bytes.clone(), meta: self.meta.clone(), tables: self.tables.clone(), tuning })
    }

    /// Shares and times of the branches.
    #[getter]
    fn relaxation(&self) -> Vec<(f32, f32)> {
        listed(&self.tables.relaxation)
    }

    fn relaxing(&self, branches: Branches) -> PyResult<Self> {
        let pad = self.tables.pad().with_relaxation(branches.checked()?);
        let mut bytes = vec![0; pad.file_length(&self.meta)];
        pad.write_file(&self.meta, &mut bytes).map_err(error::model)?;
        Ok(Self { tuning: self.tuning, ..Self::new(&bytes).map_err(error::model)? })
    }

    #[pyo3(signature = (friction_x_n, friction_y_n=None, *, margin=None, strength_factor=None, pitch_deg=None, roll_deg=None, body=None))]
    #[allow(clippy::too_many_arguments)]
    fn least_grip<'py>(
        slf: &Bound<'py, Self>,
        friction_x_n: Bound<'py, PyAny>,
        friction_y_n: Option<Bound<'py, PyAny>>,
        margin: Option<Bound<'py, PyAny>>,
        strength_factor: Option<Bound<'py, PyAny>>,
        pitch_deg: Option<Bound<'py, PyAny>>,
        roll_deg: Option<Bound<'py, PyAny>>,
        body: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let over_arrays = slf.py().import("fingerpad._grip")?.getattr("pad_least_grip")?;
        over_arrays.call1((slf, friction_x_n, friction_y_n, margin, strength_factor, pitch_deg, roll_deg, body))
    }

    /// As of a bed, with rows of pitch and roll (degrees) as well, on a body of a kind with its numbers.
    #[allow(clippy::too_many_arguments)]
    fn _least_grips<'py>(
        &self,
        py: Python<'py>,
        kind: &str,
        numbers: [f32; 3],
        given: [PyReadonlyArray1<'py, f32>; 6],
        mut depth_mm: PyReadwriteArray1<'py, f32>,
        mut normal_force_n: PyReadwriteArray1<'py, f32>,
        mut status: PyReadwriteArray1<'py, u32>,
    ) -> PyResult<()> {
        let body = body(kind, numbers).ok_or_else(|| error::input(format!("body: {kind} is none")))?;
        let (depth, normal, status) =
            (depth_mm.as_slice_mut()?, normal_force_n.as_slice_mut()?, status.as_slice_mut()?);
        let mut columns = [&[][..]; 6];
        for (column, given) in columns.iter_mut().zip(&given) {
            *column = given.as_slice()?;
        }
        let lengths = columns.map(<[f32]>::len).into_iter().chain([normal.len(), status.len()]);
        if let Some(found) = lengths.into_iter().find(|length| *length != depth.len()) {
            return Err(error::wrong_length(depth.len(), found));
        }
        let pad = self.tables.pad().tuned(self.tuning).map_err(error::model)?;
        let [x, y, margin, factor, pitch, roll] = columns;
        for i in 0..depth.len() {
            py.check_signals()?;
            let finger = PadOn { pad, body: &body, pose_deg: [pitch[i], roll[i]] };
            let grip: Grip = py.detach(|| finger.least_grip::<MOST>([x[i], y[i]], margin[i], factor[i]));
            (depth[i], normal[i], status[i]) = (grip.depth_mm, grip.normal_force_n, grip.status.0);
        }
        Ok(())
    }

    fn __repr__(&self) -> String {
        let ((low, high), most) = (self.pitch_range_deg(), self.tables.numbers.roll_max_deg);
        let words = if self.tuning == Tuning::default() { "" } else { ", tuned" };
        let relaxes = in_words(&self.tables.relaxation);
        format!(
            "<fingerpad.Pad: {} patches, depth 0 to {:.2} mm, normal force 0 to {:.2} N on a plane at pitch {} deg, pitch {low} to {high} deg, \
             roll {} to {most} deg{words}{relaxes}>",
            self.patches(),
            self.depth_max_mm(),
            self.normal_force_max_n().unwrap_or(f32::NAN),
            self.neutral_pitch_deg(),
            -most
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
        let unpickle = py.import("fingerpad._pickle")?.getattr("pad")?;
        Ok((unpickle, (this.to_bytes(py), this.tuning().into())))
    }
}

/// The rigid body of a kind, from its radius (mm), axis and angle (degrees), which Python has checked.
pub fn body(kind: &str, [radius_mm, axis_deg, angle_deg]: [f32; 3]) -> Option<Body> {
    Some(match kind {
        "Plane" => Body::Plane,
        "Sphere" => Body::Sphere(Sphere::new(radius_mm).ok()?),
        "Cylinder" => Body::Cylinder(Cylinder::new(radius_mm, axis_deg).ok()?),
        "Edge" => Body::Edge(Edge::new(radius_mm, axis_deg, angle_deg).ok()?),
        _ => return None,
    })
}

/// Contacts of a pad of at most `P` patches on one body.
#[derive(Clone)]
pub struct Patches<const P: usize, M> {
    tables: Arc<Tables>,
    tuning: Tuning,
    body: Body,
    /// Body and tuning in words: a saved state belongs to one of each.
    description: String,
    /// Poses in which the body's apex lies under first touch, and of steps that name none: pitch and roll, degrees.
    poses_deg: Vec<[f32; 2]>,
    states: Vec<PadState<P, f32, M>>,
    watches: Watches,
}

impl<const P: usize, M: Memory<P, f32> + Pod + Send> Patches<P, M> {
    /// Contacts in the air, one for each pose; none where there is no memory for them.
    pub fn new(pad: &Pad, body: Body, description: String, poses_deg: Vec<[f32; 2]>) -> Result<Option<Self>, Error> {
        let (tables, tuning) = (pad.tables.clone(), pad.tuning);
        let Some(states) = states(PadState::fresh(&tables.pad())?, poses_deg.len()) else { return Ok(None) };
        let (size, stiffness, lambda) = pad.tuning();
        let description = format!("{description}, size {size}, stiffness {stiffness}, lambda {lambda}");
        let mut made = Self { tables, tuning, body, description, poses_deg, states, watches: Watches::default() };
        made.reset(&vec![true; made.states.len()]);
        Ok(Some(made))
    }

    fn pad(&self) -> PadInPlace<'_> {
        self.tables.pad().tuned(self.tuning).expect("`Pad::tuned` has checked the factors")
    }

    /// Head of saved states: body and tuning in words behind their length.
    fn head(&self) -> Vec<u8> {
        let length = self.description.len() as u16;
        [&length.to_le_bytes(), self.description.as_bytes()].concat()
    }

    /// A contact in the air over the body. In a plane every pose turns about the same point.
    fn in_the_air(&self, pose_deg: [f32; 2]) -> PadState<P, f32, M> {
        let pad = self.pad();
        let made = if self.body == Body::Plane { PadState::fresh(&pad) } else { PadState::fresh_over(&pad, pose_deg) };
        made.expect("`new` has made one of as many patches")
    }
}

/// Head of saved states; empty if they end before its end.
fn head_of(bytes: &[u8]) -> &[u8] {
    let length = bytes.first_chunk().map_or(usize::MAX, |length| 2 + usize::from(u16::from_le_bytes(*length)));
    bytes.get(..length).unwrap_or(&[])
}

/// Advances contacts on one body.
fn step_all<const P: usize, M: Memory<P, f32>, B: Surface<f32>>(
    pad: &PadInPlace<'_>,
    body: &B,
    (states, poses_deg): (&mut [PadState<P, f32, M>], &[[f32; 2]]),
    row: &Row,
    out: &mut [u32],
) {
    let words = out.len() / states.len().max(1);
    for (i, (state, out)) in states.iter_mut().zip(out.chunks_exact_mut(words)).enumerate() {
        if let Some(factor) = row.strength_factor.get(i) {
            state.set_strength_factor(*factor);
        }
        let [pitch, roll] = poses_deg[i];
        let pose = [row.pitch_deg.get(i).copied().unwrap_or(pitch), row.roll_deg.get(i).copied().unwrap_or(roll)];
        write_response(&pad.step(state, body, row.motion(i), pose), out);
    }
}

impl<const P: usize, M: Memory<P, f32> + Pod + Send> Group for Patches<P, M> {
    fn steps_between_looks(&self) -> usize {
        1 << 10
    }

    fn step(&mut self, first: usize, row: &Row, out: &mut [u32]) -> Result<(), Error> {
        let count = row.depth_mm.len();
        let words = out.len() / count.max(1);
        let tables = self.tables.clone();
        let pad = tables.pad().tuned(self.tuning)?;
        let contacts = (&mut self.states[first..first + count], &self.poses_deg[first..first + count]);
        match self.body {
            Body::Plane => step_all(&pad, &Plane, contacts, row, out),
            body => step_all(&pad, &body, contacts, row, out),
        }
        self.watches.look(first, out, words);
        Ok(())
    }

    fn state(&self) -> (Vec<f32>, Vec<f32>) {
        let pad = self.pad();
        self.states.iter().map(|state| (pad.depth_mm(state), state.strength_factor())).unzip()
    }

    fn reset(&mut self, which: &[bool]) {
        for (i, _) in which.iter().enumerate().take(self.states.len()).filter(|(_, chosen)| **chosen) {
            self.states[i] = self.in_the_air(self.poses_deg[i]);
        }
    }

    fn save(&self) -> Result<Vec<u8>, Refused> {
        let (one, pad) = (PadState::<P, f32, M>::SAVED_BYTES, self.tables.pad().checksum());
        let mut bytes = self.head();
        let head = bytes.len();
        bytes.resize(head + one * self.states.len(), 0);
        for (state, out) in self.states.iter().zip(bytes[head..].chunks_exact_mut(one)) {
            state.write_bytes(pad, out)?;
        }
        Ok(bytes)
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), Refused> {
        let (one, pad) = (PadState::<P, f32, M>::SAVED_BYTES, self.tables.pad().checksum());
        let found = head_of(bytes);
        let states = &bytes[found.len()..];
        let expected = one * self.states.len();
        if found.is_empty() || states.len() != expected {
            let (expected, found) = (self.head().len() + expected, bytes.len());
            return Err(Error::Length { expected: expected as u32, found: found as u32 }.into());
        }
        let restored: Vec<_> =
            states.chunks_exact(one).map(|saved| PadState::read_bytes(pad, saved)).collect::<Result<_, _>>()?;
        if found != self.head() {
            let found = String::from_utf8_lossy(&found[2..]);
            return Err(Refused::Text(format!("the state was saved with {found}; here it is {}", self.description)));
        }
        self.states = restored;
        Ok(())
    }

    fn watches(&mut self) -> &mut Watches {
        &mut self.watches
    }

    fn copy(&self) -> Box<dyn Group> {
        Box::new(self.clone())
    }

    fn step_driven(&mut self, row: &Row, given: Given, out: &mut [u32]) -> Result<(), Refused> {
        let tables = self.tables.clone();
        let pad = tables.pad().tuned(self.tuning)?;
        let body = self.body;
        let contacts = self.states.iter_mut().zip(&self.poses_deg).enumerate().map(|(i, (state, pose))| {
            let [pitch, roll] = *pose;
            let pose_deg =
                [row.pitch_deg.get(i).copied().unwrap_or(pitch), row.roll_deg.get(i).copied().unwrap_or(roll)];
            (PadOn { pad, body: &body, pose_deg }, state)
        });
        drive_all(contacts, row, given, out);
        self.watches.look(0, out, DRIVEN);
        Ok(())
    }

    fn gradient(&self, direction: &[f32], out: &mut [f32]) -> Result<(), Refused> {
        let pad = self.pad();
        let on = |state| (PadOn { pad, body: &self.body, pose_deg: pad.pose_deg(state) }, state);
        gradients(self.states.iter().map(on), direction, out);
        Ok(())
    }

    fn limit_surface(&self, motions: &[[f32; 3]], out: &mut [[f32; 3]]) -> Result<(), Refused> {
        let pad = self.pad();
        for (state, out) in self.states.iter().zip(out.chunks_exact_mut(motions.len())) {
            for (motion, out) in motions.iter().zip(out) {
                *out = pad.full_slip(state, &self.body, *motion);
            }
        }
        Ok(())
    }

    fn patches(&self, out: &mut [f32]) {
        let pad = self.pad();
        for (state, out) in self.states.iter().zip(out.chunks_exact_mut(PATCH * pad.patches.len())) {
            let patches = pad.patch_states(state, &self.body);
            for (patch, out) in patches.iter().zip(out.as_chunks_mut::<PATCH>().0) {
                let PatchState { place_mm: [x, y, z], pressure_mpa, traction_mpa: [tx, ty], .. } = *patch;
                *out = [x, y, z, pressure_mpa, tx, ty, patch.contact_area_mm2, patch.stick_ratio, patch.used];
            }
        }
    }
}
