//! A step with the effects of a model file.
//!
//! Main type: [`Effects`]. Uses library, contact, baseline and the plain step.

use core::marker::PhantomData;

use super::{
    Change, Conditions, Contact, Library, Place, REFERENCE_AREA_MM2, Standard, Surroundings, VALUES, baseline, tables,
};
use crate::build::EffectSlot;
use crate::error::Field;
use crate::math::{Scalar, sqrt};
use crate::memory::Memory;
use crate::tuning::STIFFNESS_FACTOR;
use crate::{Error, FileOf, ModelOf, Motion, Response, Status, step};

/// Least value of a slot where it must be positive.
const LEAST_POSITIVE: f32 = 1e-6;
/// One over the contact area at which adhesion and drag are given, 1/mm².
const PER_AREA: f32 = 1.0 / REFERENCE_AREA_MM2 as f32;

/// Largest force of an effect, N.
const LARGEST_N: f32 = 1e3;

/// A force of an effect, or `otherwise` and a flag where it is not finite or is larger than any force of a finger.
fn held(force: f32, otherwise: f32, status: &mut Status) -> f32 {
    if force.abs() <= LARGEST_N {
        return force;
    }
    *status = status.with(Status::EFFECT_HELD);
    otherwise
}

/// The effects of a model file, by a library: that of this crate, or another one.
pub struct Effects<'a, L = Standard> {
    slots: &'a [EffectSlot],
    tables: &'a [f32],
    library: PhantomData<L>,
}

// Written out, because derived implementations would require the same traits of the library, which is a marker type.
impl<L> Copy for Effects<'_, L> {}
impl<L> Clone for Effects<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<L> core::fmt::Debug for Effects<'_, L> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.slots.fmt(f)
    }
}

impl<'a> Effects<'a> {
    /// The effects of some slots, by the library of this crate.
    ///
    /// # Errors
    /// Those of [`Effects::of`].
    pub fn new(slots: &'a [EffectSlot]) -> Result<Self, Error> {
        Self::of(slots)
    }

    /// The effects of a model file, its tables among them, by the library of this crate.
    ///
    /// # Errors
    /// Those of [`Effects::with_tables`].
    pub fn of_file<const M: usize, const N: usize>(file: &FileOf<'a, M, N>) -> Result<Self, Error> {
        Self::with_tables(file.effects, file.tables)
    }

    /// Records a rest of the finger without contact: the time of occlusion restarts at zero.
    pub fn record_rest<const M: usize, const P: usize, R: Memory<M, P, f32>>(contact: &mut Contact<M, P, R>) {
        contact.record_rest();
    }
}

impl<'a, L: Library> Effects<'a, L> {
    /// Checks slots without tables against a library.
    ///
    /// # Errors
    /// Those of [`Effects::with_tables`].
    pub fn of(slots: &'a [EffectSlot]) -> Result<Self, Error> {
        Self::with_tables(slots, &[])
    }

    /// Checks the slots of a file, and the tables that they name, against a library.
    ///
    /// * `tables`: the file's section of tables, [`FileOf::tables`]
    ///
    /// # Errors
    /// [`Error::Section`] for a law that the library does not have and for a table that is not whole, [`Error::Range`]
    /// for a value beyond 1e6, a scale that is not positive and a node of a table beyond the range of its target.
    pub fn with_tables(slots: &'a [EffectSlot], tables: &'a [f32]) -> Result<Self, Error> {
        for (i, slot) in slots.iter().enumerate() {
            slot.check(i)?;
            if baseline::knows(slot.kind) {
                continue;
            }
            if slot.kind == tables::TABLE {
                tables::check(slot, i, tables)?;
                continue;
            }
            let Some(rules) = L::rules(slot.kind) else { return Err(Error::Section { id: *b"EFFX" }) };
            for (k, (&value, positive)) in slot.values.iter().zip(rules.positive).enumerate() {
                if positive && !(value > LEAST_POSITIVE) {
                    return Err(Error::Range { what: Field::EffectValue, index: (VALUES * i + k) as u16, value });
                }
            }
        }
        Ok(Self { slots, tables, library: PhantomData })
    }

    /// Advances a contact by one step with the effects. Cannot fail, panic or allocate, whatever the input.
    ///
    /// Strength laws multiply the strength factor of `contact.state`, and stiffness laws the stiffness of the tuned model. The depth offset
    /// is added in contact, and later laws read the sum. Adhesion is subtracted from the normal force, and drag is added along the motion.
    /// The factor of every law is at least 0.1. A law that reads NaN from the surroundings is left out. The response is the force on the
    /// finger, without the laws of the sensor; see [`Effects::reading`].
    ///
    /// Drag raises the friction limit by its magnitude; the slip margin is then the same reserve in newtons over that larger limit. Adhesion
    /// does not change friction and its limit.
    ///
    /// [`Status::EFFECT_HELD`] flags values that are limited to their range: a strength factor outside 0.1 to 5 or a stiffness factor outside
    /// 0.2 to 5, both including the caller's; a normal force below 0; a table outside the range of its driver. It also flags values that are
    /// left out: a force that is not finite or above 1000 N, and a table without its driver.
    pub fn step<const M: usize, const N: usize, const P: usize, R: Memory<M, P, f32>>(
        &self,
        model: &ModelOf<'_, M, N>,
        contact: &mut Contact<M, P, R>,
        surroundings: Surroundings,
        motion: Motion,
    ) -> Response {
        let touches = motion.depth_mm > 0.0;
        let mut at = contact.advance(&surroundings, &motion);
        let mut change = Change::default();
        let (mut shear, mut is_beyond) = (None, false);
        for slot in self.slots {
            match slot.kind {
                baseline::DIRECTION => change.strengthen(baseline::direction(&slot.values, &at)),
                baseline::SHEAR => shear = Some(&slot.values),
                tables::TABLE => is_beyond |= tables::apply(slot, self.tables, false, &at, &mut change),
                kind => L::apply(kind, &slot.values, &at, &mut change),
            }
            if touches {
                at.depth_mm = motion.depth_mm + change.depth_mm;
            }
        }
        let own = contact.state.strength_factor();
        let strength = contact.state.set_strength_factor(own * change.strength);
        let is_held = strength != own * change.strength
            || !STIFFNESS_FACTOR.contains(&change.stiffness)
            || (is_beyond && touches);
        let motion = Motion { depth_mm: at.depth_mm, ..motion };
        let stiffened = model.stiffened(change.stiffness);
        let mut response = step(&stiffened, &mut contact.state, motion);
        contact.state.set_strength_factor(own);
        if is_held {
            response.status = response.status.with(Status::EFFECT_HELD);
        }
        if touches && !self.slots.is_empty() {
            let ([fx, fy], [cos, sin]) = (response.friction_n, at.along);
            if let Some(shear) = shear {
                let depth_mm = contact.state.depth_mm();
                let limit = stiffened.limit_at(depth_mm) * strength * stiffened.gain_of_last_step(&contact.state);
                let plain = response.normal_force_n;
                let sheared = baseline::shear(shear, plain, [fx, fy], limit, depth_mm);
                response.normal_force_n = held(sheared, plain, &mut response.status);
            }
            let area = response.contact_area_mm2.abs() * PER_AREA;
            let drag = held(change.drag_n * area, 0.0, &mut response.status);
            let pull = held(change.adhesion_n * sqrt(area), 0.0, &mut response.status);
            let normal = response.normal_force_n - pull;
            if normal < 0.0 {
                response.status = response.status.with(Status::EFFECT_HELD);
            }
            response.normal_force_n = normal.not_negative();
            // Drag is added to the friction limit, whatever its direction.
            response.friction_n = [fx + drag * cos, fy + drag * sin];
            let limit = response.friction_limit_n;
            response.friction_limit_n = limit + drag.abs();
            if drag != 0.0 && limit > 0.0 {
                let share = limit / response.friction_limit_n;
                response.slip_margin *= share;
                response.slip_margin_relaxed *= share;
            }
            return response.on_plane();
        }
        response
    }

    /// The reading of a sensor with the file's tare and cross-talk for a response: normal, x, y, N; also without contact. Tables of the sensor
    /// are read at default conditions; see [`Effects::reading_under`].
    pub fn reading(&self, response: &Response) -> [f32; 3] {
        self.reading_at(response, &Conditions::default())
    }

    /// The same with tables of the sensor over temperature, time or user-defined columns. Tables over speed read the nominal speed of the
    /// surroundings.
    pub fn reading_under<const M: usize, const P: usize, R: Memory<M, P, f32>>(
        &self,
        response: &Response,
        contact: &Contact<M, P, R>,
        surroundings: &Surroundings,
    ) -> [f32; 3] {
        let speed_mm_s = surroundings.speed_mm_s.unwrap_or(0.0);
        self.reading_at(response, &contact.conditions(surroundings, contact.state.depth_mm(), speed_mm_s))
    }

    fn reading_at(&self, response: &Response, at: &Conditions<f32>) -> [f32; 3] {
        let mut change = Change::default();
        for slot in self.slots {
            if L::rules(slot.kind).is_some_and(|rules| rules.place == Place::Reading) {
                L::apply(slot.kind, &slot.values, &Conditions::default(), &mut change);
            } else if slot.kind == tables::TABLE {
                tables::apply(slot, self.tables, true, at, &mut change);
            }
        }
        let (normal, [x, y]) = (response.normal_force_n, response.friction_n);
        change.reading([normal, x, y])
    }
}
