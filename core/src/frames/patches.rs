//! A pad as a tactile skin: place, pressure, shear and slip of each patch, in the finger's frame.
//!
//! Main type: [`FramePatch`]; main function: [`FrameContact::patches`]. Uses pad.

use nalgebra::Vector3;

use crate::math::{Elementary, Scalar};
use crate::pad::{Memory, Pad, PadState};

use super::{Finger, FrameContact, about_origin, in_body, level_axes, out, wide};

/// One patch of the skin as a taxel of a tactile sensor: where it is, and what the body does to it.
///
/// Over all patches, `force_n` adds up to the force on the finger ([`super::FrameResponse::on_finger`]), and `place_mm` x `force_n` plus
/// `moment_n_mm` to its moment.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FramePatch<T = f32> {
    /// Its middle in the finger's frame, mm: where the contact has moved it; of a finger in the air at rest.
    pub place_mm: [T; 3],
    /// Force of the body on it along the axes of the finger's frame, N.
    pub force_n: [T; 3],
    /// Moment of the body on it about its middle, N mm: pressure is not even over a patch.
    pub moment_n_mm: [T; 3],
    /// Mean pressure over its own area, MPa; positive into the finger.
    pub pressure_mpa: T,
    /// Mean friction over its own area along the finger and across it, MPa: along x and y of the face's plane, as
    /// [`crate::Response::friction_n`].
    pub shear_mpa: [T; 2],
    /// Its own area, mm².
    pub area_mm2: T,
    /// Area of it in contact, mm².
    pub contact_area_mm2: T,
    /// Stuck share of the area in contact: 1 stick, 0 slip and without contact.
    pub stick_ratio: T,
    /// Friction over the largest friction that it can carry.
    pub used: T,
}

impl<const P: usize, T: Elementary, M: Memory<P, T>, R: Elementary> FrameContact<PadState<P, T, M>, R> {
    /// The patches of a pad after the last step, in the order of [`Pad::patches`]. Cannot fail, panic or allocate, whatever the memory.
    ///
    /// Without contact all is zero but place and area. Costs as much as one iteration of a step. The sums hold to rounding, with two
    /// exceptions. On a curved face a patch that slips ends beside where its load was found: the sums are off by up to 2 % in that step, and
    /// by rounding after a few steps at rest. Deeper than twice the depth of the fit moments differ.
    pub fn patches(&self, pad: &Pad<'_, T>) -> [FramePatch<T>; P] {
        let zero = T::of(0.0);
        let mut patches = [FramePatch::default(); P];
        let neutral: [T; 2] = Finger::<PadState<P, T, M>>::neutral_deg(pad);
        let level = level_axes(neutral.map(R::near));
        let size = pad.units.length;
        for (to, patch) in patches.iter_mut().zip(pad.patches) {
            let middle = Vector3::from(patch.middle_mm) * size;
            *to = FramePatch {
                place_mm: out(&(level * wide(&middle))),
                area_mm2: patch.area_mm2 * (size * size),
                ..FramePatch::default()
            };
        }
        let is_sound = self.is_sound() && self.shape.is_sound() && self.site.is_finite();
        let Some(chosen) = self.chosen().filter(|_| is_sound) else { return patches };
        let face = chosen.face(&self.shape);
        let stand = face.stand(&self.site);
        let tilt = [stand.pitch, stand.roll].map(Scalar::near);
        let held = Finger::<PadState<P, T, M>>::hold(pad, tilt);
        let lowest = Finger::<PadState<P, T, M>>::lowest_mm(pad, &held.normal, held.tilt, &held);
        let foot = pad.depth_mm(&self.state) - lowest;
        let own = |v: Vector3<T>| level * self.site.axes.tr_mul(&in_body(&stand, &v));
        pad.visit_patches(&self.state, &face.body(), |index, patch, [force, about_foot]| {
            let Some(to) = patches.get_mut(index) else { return };
            let place: Vector3<R> = own(Vector3::from(patch.place_mm));
            to.place_mm = out(&place);
            if !(patch.contact_area_mm2 > zero) {
                return;
            }
            let moment = own(about_origin::<PadState<P, T, M>, _>(pad, &held, tilt, foot, &force, about_foot));
            let force = own(force);
            to.force_n = out(&force);
            to.moment_n_mm = out(&(moment - place.cross(&force)));
            (to.pressure_mpa, to.shear_mpa) = (patch.pressure_mpa, patch.traction_mpa);
            (to.contact_area_mm2, to.stick_ratio, to.used) = (patch.contact_area_mm2, patch.stick_ratio, patch.used);
        });
        patches
    }
}
