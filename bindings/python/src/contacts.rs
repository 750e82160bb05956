//! Contacts as Python sees them: a lock around a [`Group`], the interpreter released while it computes.
//!
//! Main type: [`Contacts`].

use std::marker::PhantomData;
use std::sync::{Mutex, MutexGuard, PoisonError};

use bytemuck::Pod;
use fingerpad::events::{Change, WatchSettings};
use fingerpad::frames::Shape;
use fingerpad::pad::{Memory, PadMemory};
use fingerpad::{BedMemory, SPRINGS};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1, PyReadwriteArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::bed::{Springs, Tissue};
use crate::error::{self, wrong_length};
use crate::frames::{self, BedOf, FRAMES, PadOf, Placed, Pose};
use crate::group::{DRIVEN, FORCES, Given, Group, RESPONSE, Row};
use crate::model::Model;
use crate::pad::{self, Pad, Patches};

/// Contacts of one model.
#[pyclass(frozen, module = "fingerpad._native")]
pub struct Contacts {
    group: Mutex<Box<dyn Group>>,
    count: usize,
    /// Of a pad.
    patches: usize,
}

type Matrix<'py> = PyReadonlyArray2<'py, f32>;

/// Numbers of all steps and contacts, a row a step; empty where there are none.
#[derive(Default)]
struct Inputs<'a> {
    depth_mm: &'a [f32],
    slide_x_mm: &'a [f32],
    slide_y_mm: &'a [f32],
    spin_rad: &'a [f32],
    strength_factor: &'a [f32],
    pitch_deg: &'a [f32],
    roll_deg: &'a [f32],
    poses: &'a [Pose],
    dt_s: &'a [f32],
    count: usize,
}

impl<'a> Inputs<'a> {
    /// The slices of arrays that have a row for each of `dt_s`.
    fn new(
        count: usize,
        dt_s: &'a PyReadonlyArray1<f32>,
        motion: [&'a Matrix; 3],
        more: [&'a Option<Matrix>; 4],
    ) -> PyResult<Self> {
        let dt_s = dt_s.as_slice()?;
        let length = dt_s.len() * count;
        let whole = |array: &'a Matrix| -> PyResult<&'a [f32]> {
            let slice = array.as_slice()?;
            if slice.len() == length { Ok(slice) } else { Err(wrong_length(length, slice.len())) }
        };
        let or_none = |array: &'a Option<Matrix>| array.as_ref().map_or(Ok(&[][..]), whole);
        let [depth, x, y] = motion;
        let [spin, strength, pitch, roll] = more;
        Ok(Self {
            depth_mm: whole(depth)?,
            slide_x_mm: whole(x)?,
            slide_y_mm: whole(y)?,
            spin_rad: or_none(spin)?,
            strength_factor: or_none(strength)?,
            pitch_deg: or_none(pitch)?,
            roll_deg: or_none(roll)?,
            poses: &[],
            dt_s,
            count,
        })
    }

    fn rows(&self) -> impl Iterator<Item = Row<'a>> {
        self.dt_s.iter().enumerate().map(|(k, &dt_s)| {
            let of = |slice: &'a [f32]| slice.get(self.count * k..self.count * (k + 1)).unwrap_or(&[]);
            Row {
                depth_mm: of(self.depth_mm),
                slide_x_mm: of(self.slide_x_mm),
                slide_y_mm: of(self.slide_y_mm),
                spin_rad: of(self.spin_rad),
                strength_factor: of(self.strength_factor),
                pitch_deg: of(self.pitch_deg),
                roll_deg: of(self.roll_deg),
                poses: self.poses.get(self.count * k..self.count * (k + 1)).unwrap_or(&[]),
                dt_s,
            }
        })
    }
}

fn no_room(count: usize) -> PyErr {
    error::input(format!("count: there is no memory for {count} fingers"))
}

impl Contacts {
    fn of(group: Box<dyn Group>, count: usize, patches: usize) -> Self {
        Self { group: Mutex::new(group), count, patches }
    }

    /// The contacts, once no other thread steps them. Called without the interpreter, which that thread may need.
    pub fn lock(&self) -> MutexGuard<'_, Box<dyn Group>> {
        self.group.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Steps all contacts along every row, and looks for Ctrl-C on the way, which leaves the contacts as they were.
    fn advance(&self, inputs: &Inputs, out: &mut [u32]) -> PyResult<()> {
        let rows = inputs.dt_s.len();
        if rows == 0 || self.count == 0 {
            return Ok(());
        }
        let mut group = self.lock();
        let most = group.steps_between_looks();
        let before = (rows > 1 || self.count > most).then(|| group.copy());
        let words = out.len() / (rows * self.count);
        let mut since_look = 0;
        for (row, out) in inputs.rows().zip(out.chunks_exact_mut(words * self.count)) {
            for start in (0..self.count).step_by(most) {
                let end = (start + most).min(self.count);
                let mut looked = Ok(());
                if since_look >= most {
                    since_look = 0;
                    looked = Python::attach(|py| py.check_signals());
                }
                since_look += end - start;
                let (row, out) = (row.part(start, end), &mut out[words * start..words * end]);
                let done = looked.and_then(|()| group.step(start, &row, out).map_err(error::model));
                if let Err(error) = done {
                    if let Some(before) = before {
                        *group = before;
                    }
                    return Err(error);
                }
            }
        }
        Ok(())
    }
}

#[pymethods]
impl Contacts {
    #[staticmethod]
    fn of_bed(model: &Model, count: usize, spin: bool) -> PyResult<Self> {
        fn of<const P: usize, R: Tissue<P>>(model: &Model, count: usize) -> PyResult<Box<dyn Group>> {
            let made = Springs::<P, R>::new(model.bed.clone(), count);
            Ok(Box::new(made.ok_or_else(|| no_room(count))?))
        }
        let made = match (spin, model.bed.relaxation.is_some()) {
            (false, false) => of::<1, ()>,
            (true, false) => of::<2, ()>,
            (false, true) => of::<1, BedMemory<SPRINGS>>,
            (true, true) => of::<2, BedMemory<SPRINGS, 2>>,
        };
        Ok(Self::of(made(model, count)?, count, 0))
    }

    /// * `kind`, `numbers`, `description`: the body's class, its radius (mm), axis and angle (degrees), and its description in words
    /// * `poses_deg`: pitch and roll of each contact
    #[staticmethod]
    fn of_pad(
        pad: &Pad,
        kind: &str,
        numbers: [f32; 3],
        description: String,
        poses_deg: PyReadonlyArray2<'_, f32>,
    ) -> PyResult<Self> {
        fn of<const P: usize, M: Memory<P, f32> + Pod + Send>(
            pad: &Pad,
            body: fingerpad::pad::Body,
            description: String,
            poses_deg: &[[f32; 2]],
        ) -> PyResult<Box<dyn Group>> {
            let made = Patches::<P, M>::new(pad, body, description, poses_deg.to_vec()).map_err(error::model)?;
            Ok(Box::new(made.ok_or_else(|| no_room(poses_deg.len()))?))
        }
        let body = pad::body(kind, numbers).ok_or_else(|| error::input(format!("body: {kind} is none")))?;
        let poses_deg = poses_deg.as_slice()?.as_chunks::<2>().0;
        let patches = pad.patches();
        let few = patches <= pad::USUAL;
        let made = match (few, pad.relaxes()) {
            (true, false) => of::<{ pad::USUAL }, ()>,
            (false, false) => of::<{ pad::MOST }, ()>,
            (true, true) => of::<{ pad::USUAL }, PadMemory<{ pad::USUAL }>>,
            (false, true) => of::<{ pad::MOST }, PadMemory<{ pad::MOST }>>,
        };
        let group = made(pad, body, description, poses_deg)?;
        Ok(Self::of(group, poses_deg.len(), patches))
    }

    /// Of the frames of a Model or a Pad and of bodies of a shape: its kind and its sizes.
    #[staticmethod]
    fn in_frames(model: &Bound<'_, PyAny>, kind: &str, sizes: Vec<f64>, count: usize) -> PyResult<Self> {
        fn of<O: frames::Owner>(owner: O, shape: Shape, count: usize) -> PyResult<Box<dyn Group>> {
            Ok(Box::new(Placed::new(owner, shape, count).map_err(error::model)?.ok_or_else(|| no_room(count))?))
        }
        let shape =
            frames::shape(kind, &sizes).ok_or_else(|| error::input(format!("shape: a {kind} of {sizes:?} is none")))?;
        let mut patches = 0;
        let group = if let Ok(pad) = model.cast::<Pad>() {
            fn of_pad<const P: usize, M: Memory<P, f32> + Send + 'static>(
                pad: &Pad,
                shape: Shape,
                count: usize,
            ) -> PyResult<Box<dyn Group>> {
                let (tables, tuning) = (pad.tables.clone(), pad.tuning);
                of(PadOf::<P, M> { tables, tuning, memory: PhantomData }, shape, count)
            }
            let pad = pad.get();
            patches = pad.patches();
            let made = match (patches <= pad::USUAL, pad.relaxes()) {
                (true, false) => of_pad::<{ pad::USUAL }, ()>,
                (false, false) => of_pad::<{ pad::MOST }, ()>,
                (true, true) => of_pad::<{ pad::USUAL }, PadMemory<{ pad::USUAL }>>,
                (false, true) => of_pad::<{ pad::MOST }, PadMemory<{ pad::MOST }>>,
            };
            made(pad, shape, count)?
        } else {
            let model = model.cast::<Model>()?.get();
            let bed = model.bed.clone();
            match bed.relaxation.is_some() {
                false => of(BedOf::<()> { bed, memory: PhantomData }, shape, count)?,
                true => of(BedOf::<BedMemory<SPRINGS, 2>> { bed, memory: PhantomData }, shape, count)?,
            }
        };
        Ok(Self::of(group, count, patches))
    }

    /// One step of contacts in frames; a row of `poses` each.
    fn step_frames<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray2<'py, f64>,
        strength_factor: Option<Matrix<'py>>,
        dt_s: PyReadonlyArray1<'py, f32>,
        mut out: PyReadwriteArray2<'py, u32>,
    ) -> PyResult<()> {
        let (poses, out) = (poses.as_slice()?.as_chunks().0, out.as_slice_mut()?);
        let strength_factor = strength_factor.as_ref().map_or(Ok(&[][..]), |array| array.as_slice())?;
        let dt_s = dt_s.as_slice()?;
        for (expected, found) in [(self.count, poses.len()), (FRAMES * self.count, out.len()), (1, dt_s.len())] {
            if expected != found {
                return Err(wrong_length(expected, found));
            }
        }
        let inputs = Inputs { strength_factor, poses, dt_s, count: self.count, ..Inputs::default() };
        py.detach(|| self.advance(&inputs, out))
    }

    /// Takes up the state of other contacts of the same kind and count.
    fn take_up(&self, py: Python<'_>, other: &Self) {
        py.detach(|| {
            let copy = other.lock().copy();
            *self.lock() = copy;
        });
    }

    #[allow(clippy::too_many_arguments)]
    fn run<'py>(
        &self,
        py: Python<'py>,
        depth_mm: Matrix<'py>,
        slide_x_mm: Matrix<'py>,
        slide_y_mm: Matrix<'py>,
        spin_rad: Option<Matrix<'py>>,
        strength_factor: Option<Matrix<'py>>,
        pitch_deg: Option<Matrix<'py>>,
        roll_deg: Option<Matrix<'py>>,
        dt_s: PyReadonlyArray1<'py, f32>,
        mut out: PyReadwriteArray2<'py, u32>,
    ) -> PyResult<()> {
        let motion = [&depth_mm, &slide_x_mm, &slide_y_mm];
        let inputs = Inputs::new(self.count, &dt_s, motion, [&spin_rad, &strength_factor, &pitch_deg, &roll_deg])?;
        let out = out.as_slice_mut()?;
        let steps = inputs.depth_mm.len();
        if ![FORCES, RESPONSE].contains(&(out.len() / steps.max(1))) && steps > 0 {
            return Err(wrong_length(RESPONSE * steps, out.len()));
        }
        py.detach(|| self.advance(&inputs, out))
    }

    #[allow(clippy::too_many_arguments)]
    fn step_driven<'py>(
        &self,
        py: Python<'py>,
        normal: Matrix<'py>,
        along_x: Matrix<'py>,
        along_y: Matrix<'py>,
        spin_rad: Option<Matrix<'py>>,
        strength_factor: Option<Matrix<'py>>,
        by_normal_force: bool,
        by_friction: bool,
        pitch_deg: Option<Matrix<'py>>,
        roll_deg: Option<Matrix<'py>>,
        dt_s: PyReadonlyArray1<'py, f32>,
        mut out: PyReadwriteArray2<'py, u32>,
    ) -> PyResult<()> {
        let given = Given { normal_force: by_normal_force, friction: by_friction };
        let more = [&spin_rad, &strength_factor, &pitch_deg, &roll_deg];
        let inputs = Inputs::new(self.count, &dt_s, [&normal, &along_x, &along_y], more)?;
        let out = out.as_slice_mut()?;
        if out.len() != DRIVEN * inputs.depth_mm.len() {
            return Err(wrong_length(DRIVEN * inputs.depth_mm.len(), out.len()));
        }
        py.detach(|| match inputs.rows().next() {
            Some(row) => Ok(self.lock().step_driven(&row, given, out)?),
            None => Ok(()),
        })
    }

    fn gradient<'py>(
        &self,
        py: Python<'py>,
        direction: Matrix<'py>,
        mut out: PyReadwriteArray1<'py, f32>,
    ) -> PyResult<()> {
        let (direction, out) = (direction.as_slice()?, out.as_slice_mut()?);
        for (expected, found) in [(3 * self.count, direction.len()), (9 * self.count, out.len())] {
            if expected != found {
                return Err(wrong_length(expected, found));
            }
        }
        Ok(py.detach(|| self.lock().gradient(direction, out))?)
    }

    /// Friction and moment of each contact in full slip under each row of `motion`, three floats each.
    fn limit_surface<'py>(
        &self,
        py: Python<'py>,
        motion: Matrix<'py>,
        mut out: PyReadwriteArray1<'py, f32>,
    ) -> PyResult<()> {
        let (motions, out) = (motion.as_slice()?.as_chunks::<3>().0, out.as_slice_mut()?);
        if out.len() != 3 * motions.len() * self.count {
            return Err(wrong_length(3 * motions.len() * self.count, out.len()));
        }
        if out.is_empty() {
            return Ok(());
        }
        Ok(py.detach(|| self.lock().limit_surface(motions, out.as_chunks_mut().0))?)
    }

    /// State of the patches, one after the other.
    fn patches<'py>(&self, py: Python<'py>, mut out: PyReadwriteArray1<'py, f32>) -> PyResult<()> {
        let (expected, out) = (self.lock().patch_floats() * self.patches * self.count, out.as_slice_mut()?);
        if out.len() != expected {
            return Err(wrong_length(expected, out.len()));
        }
        if self.patches > 0 {
            py.detach(|| self.lock().patches(out));
        }
        Ok(())
    }

    fn state(&self, py: Python<'_>) -> (Vec<f32>, Vec<f32>) {
        py.detach(|| self.lock().state())
    }

    fn reset(&self, py: Python<'_>, which: PyReadonlyArray1<'_, bool>) -> PyResult<()> {
        let which = which.as_slice()?;
        py.detach(|| self.lock().reset(which));
        Ok(())
    }

    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.lock().save())?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn restore(&self, py: Python<'_>, data: &[u8]) -> PyResult<()> {
        Ok(py.detach(|| self.lock().restore(data))?)
    }

    #[allow(clippy::too_many_arguments)]
    fn watch(
        &self,
        py: Python<'_>,
        first_slip: f32,
        sure_slip: f32,
        full_slip: f32,
        partial_restick: f32,
        restick: f32,
        looks: u8,
        contact_looks: u8,
    ) {
        let settings =
            WatchSettings { first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks };
        py.detach(|| self.lock().watches().start(settings, self.count));
    }

    /// Ticks, contacts and names of the changes.
    fn take_events(&self, py: Python<'_>) -> Vec<(u32, u32, &'static str)> {
        let events = py.detach(|| self.lock().watches().take());
        events.into_iter().map(|(contact, event)| (event.tick, contact, name(event.change))).collect()
    }

    fn copy(&self, py: Python<'_>) -> Self {
        Self::of(py.detach(|| self.lock().copy()), self.count, self.patches)
    }
}

/// The spelling of a change in files.
fn name(change: Change) -> &'static str {
    match change {
        Change::Touch => "touch",
        Change::FirstSlip => "first_slip",
        Change::FullSlip => "full_slip",
        Change::Restick => "restick",
        Change::LiftOff => "lift_off",
    }
}
