//! All that a contact of a pad remembers.
//!
//! Main types: [`PadState`], [`PatchState`]. Uses vector.

use crate::Error;
use crate::math::{Elementary, add};

use super::Pad;
use super::vector::{Bulk, Rounded, Vec3, zeros};

/// What stands for no share of the strength.
pub(crate) const APART: f32 = 2.0;
/// Slide that counts as much as a turn by 1 rad, mm.
const TURN_MM: f32 = 5.0;
/// Least and largest strength factor.
const STRENGTH_FACTOR: [f32; 2] = [0.1, 5.0];

/// All that a contact remembers, for a pad of up to `P` patches. [`PadState::new`] is a finger in the air.
///
/// Plain data: copy it to go back to it, or use [`PadState::write_bytes`]. A state belongs to one pad, one tuning and one body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct PadState<const P: usize, T = f32> {
    /// Coordinates of the bulk.
    pub(crate) bulk: Bulk<T>,
    /// Change of the bulk in the last step, and the motion that brought it: depth, slides (mm), spin, pitch and roll (rad).
    pub(crate) drift: Bulk<T>,
    pub(crate) motion: [T; 6],
    /// Factor of the last tangent stiffness.
    pub(crate) factor: Rounded,
    /// Where each patch is held: the point of the surface over this place of the body's tangent plane, mm.
    pub(crate) anchors: [[T; 2]; P],
    /// Used share of the strength of each patch that touched at the last step, negative if it was falling then; of the others
    /// [`APART`] and how far they are from touching at least, mm.
    pub(crate) used: [T; P],
    /// Place of the body's apex along the axes of the plane, from the point about which poses turn, mm: a number and what it lacks.
    pub(crate) shift: [[T; 2]; 2],
    /// Angle of the body about the normal, rad, likewise.
    pub(crate) angle: [T; 2],
    /// The point about which poses turn, finger's frame, mm.
    pub(crate) pivot: Vec3<T>,
    /// Depth, mm, and pitch from the neutral one and roll, rad, of the last step.
    pub(crate) depth: T,
    pub(crate) tilt: [T; 2],
    pub(crate) strength_factor: T,
    /// Bound of how far the last motion brought the body nearer to any patch, mm.
    pub(crate) travel: T,
    /// [`IN_CONTACT`] and [`FACTORED`].
    pub(crate) flags: u32,
}

/// Flag: the last step left the finger in contact.
const IN_CONTACT: u32 = 1;
/// Flag: there is a factor of the tangent stiffness.
const FACTORED: u32 = 2;

// SAFETY: `repr(C)` over 32-bit floats, an even number of u16 and one u32: no padding, and any bits are a value.
#[allow(unsafe_code)]
unsafe impl<const P: usize> bytemuck::Zeroable for PadState<P> {}
// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl<const P: usize> bytemuck::Pod for PadState<P> {}

impl<const P: usize, T: Elementary> PadState<P, T> {
    /// A finger in the air over a plane.
    ///
    /// # Errors
    /// [`Error::Shape`] for a pad of more than `P` patches.
    pub fn new(pad: &Pad<'_, T>) -> Result<Self, Error> {
        let patches = pad.patches.len();
        if patches > P {
            return Err(Error::Shape { elements: patches as u32, nodes: P as u32 });
        }
        Ok(Self::in_the_air())
    }

    /// A finger in the air over a plane.
    pub(crate) fn in_the_air() -> Self {
        Self {
            bulk: zeros(),
            drift: zeros(),
            motion: zeros(),
            factor: Rounded::NOTHING,
            anchors: [zeros(); P],
            used: zeros(),
            shift: [zeros(); 2],
            angle: zeros(),
            pivot: zeros(),
            depth: T::of(0.0),
            tilt: zeros(),
            strength_factor: T::of(1.0),
            travel: T::of(0.0),
            flags: 0,
        }
    }

    /// A finger in the air over a body whose apex lies under first touch in a pose, and about which the finger turns.
    ///
    /// # Errors
    /// As [`PadState::new`].
    pub fn over(pad: &Pad<'_, T>, pose_deg: [T; 2]) -> Result<Self, Error> {
        let mut state = Self::new(pad)?;
        state.tilt = pad.tilt(pose_deg).0;
        // In the neutral pose it is the origin, which the fitted heights meet within their error.
        if state.tilt != zeros() {
            state.pivot = pad.fitted_first_touch_point_mm(pose_deg);
        }
        Ok(state)
    }

    /// Sets the factor by which all strengths are multiplied from the next step on: what moisture, speed or dwell make of the friction.
    ///
    /// Range 0.1 to 5; anything else is moved to the nearer end and NaN changes nothing. Returns the factor in use.
    pub fn set_strength_factor(&mut self, factor: T) -> T {
        if factor.is_number() {
            let [least, most] = STRENGTH_FACTOR.map(T::of);
            self.strength_factor = if factor < least { least } else { factor.at_most(most) };
        }
        self.strength_factor
    }

    /// The factor on all strengths; 1 unless set.
    pub fn strength_factor(&self) -> T {
        self.strength_factor
    }

    /// Whether the last step left the finger in contact.
    pub fn in_contact(&self) -> bool {
        self.flags & IN_CONTACT != 0
    }

    pub(crate) fn is_factored(&self) -> bool {
        self.flags & FACTORED != 0
    }

    pub(crate) fn set_factored(&mut self, is_factored: bool) {
        self.flags = if is_factored { self.flags | FACTORED } else { self.flags & !FACTORED };
    }

    /// Begins a contact with nothing known of the stiffness.
    pub(crate) fn touch(&mut self) {
        self.flags = IN_CONTACT;
    }

    /// Forgets the contact; where the body is stays known.
    pub(crate) fn lift_off(&mut self) {
        self.flags = 0;
    }

    /// Forgets all but the strength factor, where that is in order.
    pub(crate) fn forget(&mut self) {
        let factor = self.strength_factor;
        *self = Self::in_the_air();
        self.set_strength_factor(factor);
    }

    /// Whether the strength factor is one that can be set.
    pub(crate) fn is_consistent(&self) -> bool {
        let [least, most] = STRENGTH_FACTOR;
        self.strength_factor.is_between(least, most)
    }
}

impl<const P: usize, T: Elementary> PadState<P, T> {
    /// Starts a step from where the bulk would be if it went on as before, in a motion that goes on. At rest it starts where it is.
    pub(crate) fn foresee(&mut self, motion: [T; 6]) {
        let arm = T::of(TURN_MM);
        let product = |a: &[T; 6], b: &[T; 6]| {
            a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + arm * arm * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
        };
        let before = product(&self.motion, &self.motion);
        let share = product(&motion, &self.motion) / (before + T::of(f32::MIN_POSITIVE));
        // What turns back or speeds up goes its own way.
        if share >= T::of(0.5) && share <= T::of(1.5) {
            self.bulk = core::array::from_fn(|k| self.bulk[k] + share * self.drift[k]);
        }
        self.motion = motion;
    }

    /// Moves and turns the body.
    pub(crate) fn carry(&mut self, slide: [T; 2], spin: T) {
        let [x, y] = [self.shift[0][0], self.shift[1][0]];
        let way = if spin == T::of(0.0) {
            slide
        } else {
            let (sin, _) = spin.sin_cos();
            let (half_sin, half_cos) = (T::of(0.5) * spin).sin_cos();
            // 1 − cos without loss of digits.
            let less = T::of(2.0) * half_sin * half_sin;
            [
                half_cos * slide[0] - half_sin * slide[1] - less * x - sin * y,
                half_sin * slide[0] + half_cos * slide[1] + sin * x - less * y,
            ]
        };
        for (part, way) in self.shift.iter_mut().zip(way) {
            let (sum, low) = add(part[0], part[1], way);
            *part = [sum, low];
        }
        let (sum, low) = add(self.angle[0], self.angle[1], spin);
        let turn = T::of(core::f32::consts::TAU);
        // What the turn in single precision lacks.
        let rest = T::of(-1.748_455_6e-7);
        self.angle = if sum > T::of(core::f32::consts::PI) {
            [sum - turn, low - rest]
        } else if sum < T::of(-core::f32::consts::PI) {
            [sum + turn, low + rest]
        } else {
            [sum, low]
        };
    }

    /// Puts the origin of a plane where the finger is.
    pub(crate) fn move_origin(&mut self) {
        let (sin, cos) = self.angle[0].sin_cos();
        let [x, y] = [self.shift[0][0], self.shift[1][0]];
        let by = [cos * x + sin * y, cos * y - sin * x];
        for anchor in &mut self.anchors {
            *anchor = [anchor[0] + by[0], anchor[1] + by[1]];
        }
        self.shift = [zeros(); 2];
    }
}

/// What one patch bears, see [`Pad::patch_states`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PatchState<T = f32> {
    /// Its middle now, along the axes of the plane from the point about which poses turn, mm.
    pub place_mm: [T; 3],
    /// Mean pressure over its own area, MPa.
    pub pressure_mpa: T,
    /// Mean traction along x and y of the plane over its own area, MPa.
    pub traction_mpa: [T; 2],
    /// Area in contact, mm².
    pub contact_area_mm2: T,
    /// Share of that area which sticks.
    pub stick_ratio: T,
    /// Share of its strength that friction uses.
    pub used: T,
}
