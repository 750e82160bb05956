//! The same pad for another finger: size, stiffness and friction changed at run time by a change of units.
//!
//! Main types: [`PadTuning`], [`TunedPad`]. Uses step.

use crate::error::Field;
use crate::math::Elementary;
use crate::{Error, Motion, Response};

use super::body::Surface;
use super::{Pad, PadState, PatchState};

/// How a finger differs from the one that a pad is of.
///
/// Lengths scale with `size`, pressures with `stiffness` (e), local friction with `lambda`. The law
/// tau = lambda sigma^beta keeps its form under such a change of units, with lambda e^(beta − 1) in place of lambda, so that the result is
/// exact for geometrically similar fingers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PadTuning {
    /// Factor on all lengths, 0.5 to 2.
    pub size: f32,
    /// Factor on the tissue's stiffness, 0.2 to 5.
    pub stiffness: f32,
    /// Factor on lambda, 0.1 to 10.
    pub lambda: f32,
}

impl Default for PadTuning {
    /// The finger that the pad is of.
    fn default() -> Self {
        Self { size: 1.0, stiffness: 1.0, lambda: 1.0 }
    }
}

/// A pad for another finger, made by [`Pad::tuned`].
#[derive(Clone, Copy, Debug)]
pub struct TunedPad<'a, T = f32> {
    pad: Pad<'a, T>,
    /// Factor on lengths, and one over it.
    length: T,
    per_length: T,
    /// Factors on pressures and on the strength in the pad's own units.
    pressure: T,
    strength: T,
}

/// A body in the pad's own units.
struct InUnits<'a, B, T> {
    body: &'a B,
    length: T,
    per_length: T,
}

impl<T: Elementary, B: Surface<T>> Surface<T> for InUnits<'_, B, T> {
    fn overlap(&self, place: &[T; 3]) -> (T, [T; 3]) {
        let (overlap, slope) = self.body.overlap(&place.map(|x| x * self.length));
        (overlap * self.per_length, slope)
    }
    fn height(&self, place: [T; 2]) -> T {
        self.body.height(place.map(|x| x * self.length)) * self.per_length
    }
    fn is_plane(&self) -> bool {
        self.body.is_plane()
    }
}

impl<'a, T: Elementary> Pad<'a, T> {
    /// The same pad for another finger. A state belongs to one tuning.
    ///
    /// # Errors
    /// [`Error::Range`] with the factor.
    pub fn tuned(&self, tuning: PadTuning) -> Result<TunedPad<'a, T>, Error> {
        let PadTuning { size, stiffness, lambda } = tuning;
        let ranges = [
            (Field::Size, size, 0.5, 2.0),
            (Field::Stiffness, stiffness, 0.2, 5.0),
            (Field::Lambda, lambda, 0.1, 10.0),
        ];
        for (what, value, low, high) in ranges {
            if !(value >= low && value <= high) {
                return Err(Error::Range { what, index: 0, value });
            }
        }
        let [_, beta] = self.numbers.law.friction;
        let length = T::of(size);
        let softened = if stiffness == 1.0 { T::of(1.0) } else { T::of(stiffness).power(beta - T::of(1.0)) };
        Ok(TunedPad {
            pad: Pad { patches: self.patches, numbers: self.numbers },
            length,
            per_length: T::of(1.0) / length,
            pressure: T::of(stiffness),
            strength: T::of(lambda) * softened,
        })
    }
}

impl<'a, T: Elementary> TunedPad<'a, T> {
    /// The pad without the tuning.
    pub fn pad(&self) -> Pad<'a, T> {
        Pad { patches: self.pad.patches, numbers: self.pad.numbers }
    }

    /// Largest depth for which the pad was fitted, mm.
    pub fn depth_max_mm(&self) -> T {
        self.pad.numbers.depth_max_mm * self.length
    }

    /// A finger in the air over a body whose apex lies under first touch in a pose; see [`PadState::over`].
    ///
    /// # Errors
    /// [`Error::Shape`] for a pad of more than `P` patches.
    pub fn over<const P: usize>(&self, pose_deg: [T; 2]) -> Result<PadState<P, T>, Error> {
        PadState::over(&self.pad, pose_deg)
    }

    /// The point of the undeformed finger that a plane touches first in a pose; see [`Pad::first_touch_point_mm`].
    pub fn first_touch_point_mm(&self, pose_deg: [T; 2]) -> [T; 3] {
        self.pad.first_touch_point_mm(pose_deg).map(|x| x * self.length)
    }

    fn in_units<'b, B: Surface<T>>(&self, body: &'b B) -> InUnits<'b, B, T> {
        InUnits { body, length: self.length, per_length: self.per_length }
    }

    /// Advances a contact by one step; see [`Pad::step`].
    pub fn step<const P: usize>(
        &self,
        state: &mut PadState<P, T>,
        body: &impl Surface<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> Response<T> {
        let motion = Motion {
            depth_mm: motion.depth_mm * self.per_length,
            slide_increment_mm: motion.slide_increment_mm.map(|x| x * self.per_length),
            ..motion
        };
        let r = self.pad.step_with(state, &self.in_units(body), motion, pose_deg, self.strength);
        let force = self.pressure * self.length * self.length;
        Response {
            normal_force_n: r.normal_force_n * force,
            friction_n: r.friction_n.map(|x| x * force),
            friction_limit_n: r.friction_limit_n * force,
            spin_moment_n_mm: r.spin_moment_n_mm * (force * self.length),
            pressure_centre_mm: r.pressure_centre_mm.map(|x| x * self.length),
            contact_area_mm2: r.contact_area_mm2 * (self.length * self.length),
            band_normal_n: r.band_normal_n * force,
            band_friction_n: r.band_friction_n * force,
            ..r
        }
    }

    /// What each patch bears after the last step; see [`Pad::patch_states`].
    pub fn patch_states<const P: usize>(&self, state: &PadState<P, T>, body: &impl Surface<T>) -> [PatchState<T>; P] {
        self.pad.patch_states_with(state, &self.in_units(body), self.strength).map(|patch| PatchState {
            place_mm: patch.place_mm.map(|x| x * self.length),
            pressure_mpa: patch.pressure_mpa * self.pressure,
            traction_mpa: patch.traction_mpa.map(|x| x * self.pressure),
            contact_area_mm2: patch.contact_area_mm2 * (self.length * self.length),
            ..patch
        })
    }

    /// Friction and moment if all patches that touch slipped under a motion; see [`Pad::full_slip`].
    pub fn full_slip<const P: usize>(
        &self,
        state: &PadState<P, T>,
        body: &impl Surface<T>,
        [x, y, turn]: [T; 3],
    ) -> [T; 3] {
        let motion = [x * self.per_length, y * self.per_length, turn];
        let [fx, fy, moment] = self.pad.full_slip_with(state, &self.in_units(body), motion, self.strength);
        let force = self.pressure * self.length * self.length;
        [fx * force, fy * force, moment * (force * self.length)]
    }
}
