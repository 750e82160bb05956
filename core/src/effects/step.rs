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
use crate::tuning::STIFFNESS_FACTOR;
use crate::{Error, FileOf, ModelOf, Motion, Response, Status, step};

/// Least value of a slot where it must be positive.
const LEAST_POSITIVE: f32 = 1e-6;
/// One over the contact area at which adhesion and drag are given, 1/mm².
const PER_AREA: f32 = 1.0 / REFERENCE_AREA_MM2 as f32;

/// Largest force of an effect, N.
const LARGEST_N: f32 = 1e3;

/// A force of an effect, or `otherwise` and a flag where it is not a number or larger than any finger's.
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

// Written out, since derived ones would ask the same of the library, which is a name only.
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

    /// Declares a rest of the finger in the air: the time of occlusion starts again from zero.
    pub fn rested<const M: usize, const P: usize>(contact: &mut Contact<M, P>) {
        contact.rested();
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
    /// for a value beyond 1e6, a scale that is not positive and a node of a table beyond the range of what it changes.
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
    /// Strength laws multiply the strength factor of `contact.state`, stiffness laws the stiffness of the model as it is
    /// tuned, the depth offset is added where there is contact and read by the laws after it, adhesion is taken off the
    /// normal force, drag added along the motion. Every law's factor is held at 0.1 or above. Bad surroundings (NaN) leave the law out. The laws of the sensor are not in
    /// the response, which is the force on the finger; see [`Effects::reading`].
    ///
    /// Drag raises the friction limit by its size, and the slip margin is then the same reserve in newtons over that larger
    /// limit. Adhesion leaves friction and its limit as they are.
    ///
    /// What leads beyond its range is held there and flagged by [`Status::EFFECT_HELD`]: a strength factor beyond 0.1 to 5 or
    /// a stiffness factor beyond 0.2 to 5, both with the caller's; a normal force below 0; a force that is not a number or beyond
    /// 1000 N, which is left out; a table beyond the range of its driver, and one without it, which is left out.
    pub fn step<const M: usize, const N: usize, const P: usize>(
        &self,
        model: &ModelOf<'_, M, N>,
        contact: &mut Contact<M, P>,
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
                let limit = stiffened.limit_at(depth_mm) * strength;
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
            // Drag comes on top of what friction can bear, whatever its direction.
            response.friction_n = [fx + drag * cos, fy + drag * sin];
            let limit = response.friction_limit_n;
            response.friction_limit_n = limit + drag.abs();
            if drag != 0.0 && limit > 0.0 {
                response.slip_margin *= limit / response.friction_limit_n;
            }
        }
        response
    }

    /// What a sensor with the file's tare and cross-talk reads of a response: normal, x, y, N; in the air too. Tables of the
    /// sensor are read under no conditions; see [`Effects::reading_under`].
    pub fn reading(&self, response: &Response) -> [f32; 3] {
        self.reading_at(response, &Conditions::default())
    }

    /// The same where tables say what the sensor makes of temperature, time or a column of the user's own. The speed that they
    /// may read is the nominal one of the surroundings.
    pub fn reading_under<const M: usize, const P: usize>(
        &self,
        response: &Response,
        contact: &Contact<M, P>,
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
        let ([tare, tare_x, tare_y], [to_x, to_y]) = (change.reading_n, change.cross);
        [normal + tare, x + tare_x + to_x * normal, y + tare_y + to_y * normal]
    }
}
