//! The state of a contact of a pad.
//!
//! Main types: [`PadState`], [`PatchState`]. Uses vector.

use crate::math::{Elementary, add};
use crate::{Error, Regime, Response, Status};

use super::Pad;
use super::memory::{Memory, PadMemory};
use super::step::axes;
use super::vector::{Bulk, Rounded, zeros};

/// Values of [`PadState::reserve`] from here on belong to patches without contact.
pub(crate) const APART: f32 = 2.0;
/// Slide that is equivalent to a rotation by 1 rad where motions are compared, mm.
const TURN_MM: f32 = 5.0;
/// Least and largest strength factor.
const STRENGTH_FACTOR: [f32; 2] = [0.1, 5.0];

/// The state of a contact, for a pad of up to `P` patches. [`PadState::new`] returns a finger without contact.
///
/// Plain data: a copy restores an earlier state, and [`PadState::write_bytes`] saves one. A state belongs to one pad, one tuning and one
/// body.
///
/// * `M`: memory of the tissue. `()`: the finger follows its relaxed tissue, and the time step has no influence; see [`RelaxingPadState`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct PadState<const P: usize, T = f32, M = ()> {
    /// Coordinates of the bulk.
    pub(crate) bulk: Bulk<T>,
    /// Change of the bulk in the last step.
    pub(crate) drift: Bulk<T>,
    /// Motion of the last step: depth, slides (mm), spin, pitch and roll (rad).
    pub(crate) motion: [T; 6],
    /// Factor of the tangent stiffness of this or an earlier step.
    pub(crate) factor: Rounded,
    /// Anchor of each patch: the point of the surface over this place of the body's tangent plane, mm.
    pub(crate) anchors: [[T; 2]; P],
    /// For each patch that touched at the last step, its reserve: the bound of its stretch minus the stretch, mm, the least value of this
    /// fall, or minus the largest value of this rise. For the others, [`APART`] plus a lower bound of their distance from contact, mm.
    pub(crate) reserve: [T; P],
    /// Stretch of each patch where its reserve began to rise, body's axes, mm; zero if it has reached its bound since.
    pub(crate) turn: [[T; 2]; P],
    /// Place of the body's apex along the axes of the plane, from the centre of rotation, mm: compensated sums, high and low part.
    pub(crate) shift: [[T; 2]; 2],
    /// Angle of the body about the normal, rad, a compensated sum.
    pub(crate) angle: [T; 2],
    /// Centre of rotation of poses, finger's frame, mm.
    pub(crate) pivot: [T; 3],
    /// Depth of the last step, mm.
    pub(crate) depth: T,
    /// Pitch relative to the neutral one and roll of the last step, rad.
    pub(crate) tilt: [T; 2],
    /// Factor of all strengths.
    pub(crate) strength_factor: T,
    /// Shift of the body near first touch in the last step, mm.
    pub(crate) approach: T,
    /// Overlap of a certain place with the body, mm: shows that the body is another one.
    pub(crate) probe: T,
    /// The response of the last step, if the contact is at [`REST`].
    rest: Rest<T>,
    /// What the tissue remembers.
    pub(crate) memory: M,
    /// Number of patches of its pad.
    pub(crate) patches: u32,
    /// [`IN_CONTACT`], [`FACTORED`] and [`REST`].
    pub(crate) flags: u32,
}

/// The state of a contact of a finger whose tissue relaxes; made by [`PadState::relaxing`].
pub type RelaxingPadState<const P: usize, T = f32> = PadState<P, T, PadMemory<P, T>>;

/// A response with the status `ok`, as plain data.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
struct Rest<T> {
    numbers: [T; 16],
    regime: u32,
}

/// Flag: the finger was in contact at the end of the last step.
const IN_CONTACT: u32 = 1;
/// Flag: the factor of the tangent stiffness is valid.
const FACTORED: u32 = 2;
/// Flag: the last step changed nothing, and neither does the next one without motion.
const REST: u32 = 4;
/// All flags.
pub(crate) const FLAGS: u32 = IN_CONTACT | FACTORED | REST;

// SAFETY: `repr(C)` over 32-bit floats, an even number of u16 and u32: no padding, and any bits are a value.
#[allow(unsafe_code)]
unsafe impl<const P: usize, M: bytemuck::Zeroable> bytemuck::Zeroable for PadState<P, f32, M> {}
// SAFETY: as above; a memory is plain too.
#[allow(unsafe_code)]
unsafe impl<const P: usize, M: bytemuck::Pod> bytemuck::Pod for PadState<P, f32, M> {}

impl<const P: usize, T: Elementary> PadState<P, T> {
    /// A finger without contact, over a plane.
    ///
    /// # Errors
    /// [`Error::Shape`] for a pad of more than `P` patches.
    pub fn new(pad: &Pad<'_, T>) -> Result<Self, Error> {
        Self::fresh(pad)
    }

    /// A finger without contact over a body whose apex lies under the point of first touch in a pose. The finger then rotates about that
    /// point.
    ///
    /// # Errors
    /// As [`PadState::new`].
    pub fn over(pad: &Pad<'_, T>, pose_deg: [T; 2]) -> Result<Self, Error> {
        Self::fresh_over(pad, pose_deg)
    }
}

impl<const P: usize, T: Elementary> RelaxingPadState<P, T> {
    /// A finger without contact, over a plane, whose tissue relaxes.
    ///
    /// # Errors
    /// As [`PadState::new`].
    pub fn relaxing(pad: &Pad<'_, T>) -> Result<Self, Error> {
        Self::fresh(pad)
    }

    /// As [`PadState::over`].
    ///
    /// # Errors
    /// As [`PadState::new`].
    pub fn relaxing_over(pad: &Pad<'_, T>, pose_deg: [T; 2]) -> Result<Self, Error> {
        Self::fresh_over(pad, pose_deg)
    }
}

impl<const P: usize, T: Elementary, M: Memory<P, T>> PadState<P, T, M> {
    /// [`PadState::new`] or [`PadState::relaxing`], whichever `M` asks for.
    ///
    /// # Errors
    /// As [`PadState::new`].
    pub fn fresh(pad: &Pad<'_, T>) -> Result<Self, Error> {
        let patches = pad.patches.len();
        if patches > P {
            return Err(Error::Shape { elements: patches as u32, nodes: P as u32 });
        }
        Ok(Self::without_contact(patches))
    }

    /// [`PadState::over`] or [`PadState::relaxing_over`].
    ///
    /// # Errors
    /// As [`PadState::new`].
    pub fn fresh_over(pad: &Pad<'_, T>, pose_deg: [T; 2]) -> Result<Self, Error> {
        let mut state = Self::fresh(pad)?;
        state.tilt = pad.tilt(pose_deg).0;
        // In the neutral pose this point is the origin; the fitted heights give it within their error only.
        if state.tilt != zeros() {
            state.pivot = pad.fitted_first_touch_point_mm(&axes(state.tilt)).into();
        }
        Ok(state)
    }

    /// A finger without contact, over a plane.
    pub(crate) fn without_contact(patches: usize) -> Self {
        Self {
            bulk: zeros(),
            drift: zeros(),
            motion: zeros(),
            factor: Rounded::NOTHING,
            anchors: [zeros(); P],
            reserve: zeros(),
            turn: [zeros(); P],
            shift: [zeros(); 2],
            angle: zeros(),
            pivot: zeros(),
            depth: T::of(0.0),
            tilt: zeros(),
            strength_factor: T::of(1.0),
            approach: T::of(0.0),
            probe: T::of(0.0),
            rest: Rest { numbers: zeros(), regime: 0 },
            memory: M::fresh(),
            patches: patches as u32,
            flags: 0,
        }
    }

    /// Sets the factor of all strengths from the next step on: the influence of moisture, speed or dwell on friction.
    ///
    /// Range 0.1 to 5; a value outside is replaced by the nearer end, and NaN changes nothing. Returns the factor in use.
    pub fn set_strength_factor(&mut self, factor: T) -> T {
        if factor.is_number() {
            let [least, most] = STRENGTH_FACTOR.map(T::of);
            let factor = if factor < least { least } else { factor.at_most(most) };
            if factor != self.strength_factor {
                self.strength_factor = factor;
                self.flags &= !REST;
            }
        }
        self.strength_factor
    }

    /// The factor of all strengths; 1 unless set.
    pub fn strength_factor(&self) -> T {
        self.strength_factor
    }

    /// Whether the finger was in contact at the end of the last step.
    pub fn in_contact(&self) -> bool {
        self.flags & IN_CONTACT != 0
    }

    pub(crate) fn is_factored(&self) -> bool {
        self.flags & FACTORED != 0
    }

    pub(crate) fn set_factored(&mut self, is_factored: bool) {
        self.flags = if is_factored { self.flags | FACTORED } else { self.flags & !FACTORED };
    }

    /// The response of every step without motion, if the contact is at rest.
    pub(crate) fn resting_response(&self) -> Option<Response<T>> {
        if self.flags & REST == 0 {
            return None;
        }
        let [
            normal,
            x,
            y,
            tangential_x,
            tangential_y,
            stick_ratio,
            limit,
            margin,
            spin,
            about_x,
            about_y,
            centre_x,
            centre_y,
            ..,
        ] = self.rest.numbers;
        let [.., contact_area_mm2, band_normal_n, band_friction_n] = self.rest.numbers;
        Some(Response {
            normal_force_n: normal,
            friction_n: [x, y],
            tangential_friction_n: [tangential_x, tangential_y],
            stick_ratio,
            friction_limit_n: limit,
            slip_margin: margin,
            // Nothing changes any more.
            slip_margin_relaxed: margin,
            spin_moment_n_mm: spin,
            tilt_moment_n_mm: [about_x, about_y],
            pressure_centre_mm: [centre_x, centre_y],
            contact_area_mm2,
            band_normal_n,
            band_friction_n,
            regime: Regime::numbered(self.rest.regime)?,
            status: Status::OK,
        })
    }

    /// Keeps the response of a contact at rest.
    pub(crate) fn rest(&mut self, response: Option<&Response<T>>) {
        let Some(r) = response else {
            self.flags &= !REST;
            return;
        };
        let ([x, y], [tangential_x, tangential_y]) = (r.friction_n, r.tangential_friction_n);
        let ([about_x, about_y], [centre_x, centre_y]) = (r.tilt_moment_n_mm, r.pressure_centre_mm);
        let (normal, limit, margin, spin) = (r.normal_force_n, r.friction_limit_n, r.slip_margin, r.spin_moment_n_mm);
        let (stick_ratio, area, bands) = (r.stick_ratio, r.contact_area_mm2, [r.band_normal_n, r.band_friction_n]);
        self.rest.numbers = [
            normal,
            x,
            y,
            tangential_x,
            tangential_y,
            stick_ratio,
            limit,
            margin,
            spin,
            about_x,
            about_y,
            centre_x,
            centre_y,
            area,
            bands[0],
            bands[1],
        ];
        self.rest.regime = r.regime as u32;
        self.flags |= REST;
    }

    /// Begins a contact, without a factor of the stiffness.
    pub(crate) fn touch(&mut self) {
        self.flags = IN_CONTACT;
    }

    /// Ends the contact; position and angle of the body are kept.
    pub(crate) fn end_contact(&mut self) {
        self.flags = 0;
    }

    /// Resets everything but the strength factor, which is kept if it is valid, for a pad of so many patches.
    pub(crate) fn reset(&mut self, patches: usize) {
        let factor = self.strength_factor;
        *self = Self::without_contact(patches);
        self.set_strength_factor(factor);
    }

    /// Whether the state is one of a pad of so many patches, and has a strength factor within its range.
    pub(crate) fn is_consistent(&self, patches: usize) -> bool {
        let [least, most] = STRENGTH_FACTOR;
        patches == self.patches as usize && patches <= P && self.strength_factor.is_between(least, most)
    }

    /// Initial guess of a step: extrapolates the bulk where the motion continues that of the last step.
    pub(crate) fn extrapolate(&mut self, motion: [T; 6]) {
        let arm = T::of(TURN_MM);
        let product = |a: &[T; 6], b: &[T; 6]| {
            a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + arm * arm * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
        };
        let before = product(&self.motion, &self.motion);
        let share = product(&motion, &self.motion) / (before + T::of(f32::MIN_POSITIVE));
        // No extrapolation where the motion reverses, turns or changes its speed much.
        if share >= T::of(0.5) && share <= T::of(1.5) {
            self.bulk = core::array::from_fn(|k| self.bulk[k] + share * self.drift[k]);
        }
        self.motion = motion;
    }

    /// Moves the body by a slide, mm, and turns it by a spin, rad: a curved body about its apex, a plane, which is the same everywhere, about
    /// the foot, so that its origin goes round.
    pub(crate) fn move_body(&mut self, slide: [T; 2], spin: T, is_plane: bool) {
        let [x, y] = [self.shift[0][0], self.shift[1][0]];
        let displacement = if !is_plane || spin == T::of(0.0) {
            slide
        } else {
            let (sin, _) = spin.sin_cos();
            let (half_sin, half_cos) = (T::of(0.5) * spin).sin_cos();
            // 1 − cos without cancellation.
            let less = T::of(2.0) * half_sin * half_sin;
            [
                half_cos * slide[0] - half_sin * slide[1] - less * x - sin * y,
                half_sin * slide[0] + half_cos * slide[1] + sin * x - less * y,
            ]
        };
        for (part, displacement) in self.shift.iter_mut().zip(displacement) {
            let (sum, low) = add(part[0], part[1], displacement);
            *part = [sum, low];
        }
        let (sum, low) = add(self.angle[0], self.angle[1], spin);
        let turn = T::of(core::f32::consts::TAU);
        // A full turn minus its value in single precision.
        let rest = T::of(-1.748_455_6e-7);
        self.angle = if sum > T::of(core::f32::consts::PI) {
            [sum - turn, low - rest]
        } else if sum < T::of(-core::f32::consts::PI) {
            [sum + turn, low + rest]
        } else {
            [sum, low]
        };
    }

    /// Moves the origin of a plane to the finger.
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

/// Load and contact of one patch, see [`Pad::patch_states`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PatchState<T = f32> {
    /// Present place of its middle, along the axes of the plane from the centre of rotation of poses, mm.
    pub place_mm: [T; 3],
    /// Mean pressure over its own area, MPa.
    pub pressure_mpa: T,
    /// Mean traction along x and y of the plane over its own area, MPa.
    pub traction_mpa: [T; 2],
    /// Area in contact, mm².
    pub contact_area_mm2: T,
    /// Stuck share of that area.
    pub stick_ratio: T,
    /// Friction over strength.
    pub used: T,
}
