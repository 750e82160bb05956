//! Contacts as Python sees them: a lock around a [`Bed`], the interpreter released while it computes.
//!
//! Main type: [`Contacts`].

use std::sync::{Mutex, MutexGuard, PoisonError};

use fingerpad::events::{Change, WatchSettings};
use fingerpad::{Pose, SPRINGS};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1, PyReadwriteArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::bed::{Bed, BedOf, DRIVEN, FORCES, Given, RESPONSE, Row};
use crate::error;
use crate::model::{ACCURATE, Model, Numbers};

/// Steps of single contacts between two looks for Ctrl-C: some milliseconds.
const STEPS_BETWEEN_LOOKS: usize = 1 << 16;

/// Contacts of one model.
#[pyclass(frozen, module = "fingerpad._native")]
pub struct Contacts {
    bed: Mutex<Box<dyn Bed>>,
    count: usize,
}

type Matrix<'py> = PyReadonlyArray2<'py, f32>;

/// Numbers of all steps and contacts, a row a step; empty where there are none.
struct Inputs<'a> {
    depth_mm: &'a [f32],
    slide_x_mm: &'a [f32],
    slide_y_mm: &'a [f32],
    spin_rad: &'a [f32],
    strength_factor: &'a [f32],
    pitch_deg: &'a [f32],
    roll_deg: &'a [f32],
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
                dt_s,
            }
        })
    }
}

fn wrong_length(expected: usize, found: usize) -> PyErr {
    error::input(format!("{found} numbers where {expected} are needed"))
}

impl Contacts {
    /// The contacts, once no other thread steps them. Called without the interpreter, which that thread may need.
    fn lock(&self) -> MutexGuard<'_, Box<dyn Bed>> {
        self.bed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does `step` for every row. Whatever ends it early (Ctrl-C, a pose that is refused) leaves the contacts as they were.
    fn advance(
        &self,
        inputs: &Inputs,
        out: &mut [u32],
        step: impl Fn(&mut dyn Bed, &Row, &mut [u32]) -> Result<(), fingerpad::Error>,
    ) -> PyResult<()> {
        let rows = inputs.dt_s.len();
        if rows == 0 || self.count == 0 {
            return Ok(());
        }
        let mut bed = self.lock();
        inputs.rows().try_for_each(|row| bed.check_poses(&row)).map_err(error::model)?;
        let before = (rows > 1).then(|| bed.copy());
        let words = out.len() / rows;
        let mut since_look = 0;
        for (row, out) in inputs.rows().zip(out.chunks_exact_mut(words)) {
            let mut looked = Ok(());
            if since_look >= STEPS_BETWEEN_LOOKS {
                since_look = 0;
                looked = Python::attach(|py| py.check_signals());
            }
            since_look += self.count;
            let done = looked.and_then(|()| step(&mut **bed, &row, out).map_err(error::model));
            if let Err(error) = done {
                if let Some(before) = before {
                    *bed = before;
                }
                return Err(error);
            }
        }
        Ok(())
    }
}

#[pymethods]
impl Contacts {
    #[new]
    fn new(model: &Model, count: usize, spin: bool) -> Self {
        let bed: Box<dyn Bed> = match (&model.numbers, spin) {
            (Numbers::Default(data), false) => Box::new(BedOf::<SPRINGS, 1>::new(data.clone(), model.tuning, count)),
            (Numbers::Default(data), true) => Box::new(BedOf::<SPRINGS, 2>::new(data.clone(), model.tuning, count)),
            (Numbers::Accurate(data), false) => Box::new(BedOf::<ACCURATE, 1>::new(data.clone(), model.tuning, count)),
            (Numbers::Accurate(data), true) => Box::new(BedOf::<ACCURATE, 2>::new(data.clone(), model.tuning, count)),
        };
        Self { bed: Mutex::new(bed), count }
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
        py.detach(|| self.advance(&inputs, out, |bed, row, out| bed.step(row, out)))
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
        pitch_deg: Option<Matrix<'py>>,
        roll_deg: Option<Matrix<'py>>,
        by_normal_force: bool,
        by_friction: bool,
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
        py.detach(|| self.advance(&inputs, out, |bed, row, out| bed.step_driven(row, given, out)))
    }

    fn gradient<'py>(
        &self,
        py: Python<'py>,
        direction: Matrix<'py>,
        pose: Option<(f32, f32)>,
        mut out: PyReadwriteArray1<'py, f32>,
    ) -> PyResult<()> {
        let (direction, out) = (direction.as_slice()?, out.as_slice_mut()?);
        for (expected, found) in [(3 * self.count, direction.len()), (9 * self.count, out.len())] {
            if expected != found {
                return Err(wrong_length(expected, found));
            }
        }
        let pose = pose.map(|(pitch_deg, roll_deg)| Pose { pitch_deg, roll_deg });
        py.detach(|| self.lock().gradient(direction, pose, out)).map_err(error::model)
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
        let bytes = py.detach(|| self.lock().save()).map_err(error::model)?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn restore(&self, py: Python<'_>, data: &[u8]) -> PyResult<()> {
        py.detach(|| self.lock().restore(data)).map_err(error::model)
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
        py.detach(|| self.lock().watch(settings));
    }

    /// Ticks, contacts and names of what changed.
    fn take_events(&self, py: Python<'_>) -> Vec<(u32, u32, &'static str)> {
        let events = py.detach(|| self.lock().take_events());
        events.into_iter().map(|(contact, event)| (event.tick, contact, name(event.change))).collect()
    }

    fn copy(&self, py: Python<'_>) -> Self {
        Self { bed: Mutex::new(py.detach(|| self.lock().copy())), count: self.count }
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
