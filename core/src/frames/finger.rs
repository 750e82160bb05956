//! The models of a finger behind one interface.
//!
//! Main trait: [`Finger`], for [`Pad`] and [`RoundBed`]. Uses pad and step.

use nalgebra::{Matrix3, Vector3};

use crate::math::{Elementary, Scalar};
use crate::memory as bed;
use crate::pad::{Body, Memory, Pad, PadState, axes};
use crate::{Error, ModelOf, Motion, Response, StateOf, step};

/// A pose of the finger as its model follows it.
pub struct Held<T> {
    /// Pitch and roll against the neutral pose, rad.
    pub tilt: [T; 2],
    /// Whether the model follows pitch and roll, or holds them at the end of its range.
    pub follows: [bool; 2],
    /// Pitch and roll of the finger as it stands, degrees.
    pub pose_deg: [T; 2],
    /// The normal of the plane in this pose, along the finger's level axes.
    pub normal: Vector3<T>,
    /// The point of the finger that a plane touches first in this pose, along the same axes, mm.
    pub touch: Vector3<T>,
}

/// A model of a finger that can touch bodies in frames; `S` is the state of a contact.
///
/// Its level axes are those of the plane in the neutral pose.
pub trait Finger<S> {
    /// Precision of the model.
    type Scalar: Elementary;
    /// Whether it touches curved faces and edges.
    const TOUCHES_CURVED: bool;

    /// A finger without contact.
    ///
    /// # Errors
    /// [`Error::Shape`] if the state has too little room.
    fn fresh(&self) -> Result<S, Error>;
    /// Ends a contact; the strength factor is kept.
    fn restart(&self, state: &mut S);
    /// Whether the last step left the finger in contact.
    fn in_contact(&self, state: &S) -> bool;
    /// Pitch and roll of the neutral pose, degrees.
    fn neutral_deg(&self) -> [Self::Scalar; 2];
    /// The largest depth of the fit, mm.
    fn depth_max_mm(&self) -> Self::Scalar;
    /// How the model follows a pose: pitch and roll against level, rad.
    fn hold(&self, tilt: [Self::Scalar; 2]) -> Held<Self::Scalar>;
    /// Distance of the lowest point of the finger below its origin, along a normal that is given in level axes or by a pose, mm.
    fn lowest_mm(
        &self,
        normal: &Vector3<Self::Scalar>,
        tilt: [Self::Scalar; 2],
        held: &Held<Self::Scalar>,
    ) -> Self::Scalar;
    /// Derivatives of [`Self::lowest_mm`] over pitch and roll, mm/rad.
    fn lowest_slopes_mm(&self, tilt: [Self::Scalar; 2], held: &Held<Self::Scalar>) -> [Self::Scalar; 2];
    /// One step on a body.
    fn advance(
        &self,
        state: &mut S,
        body: &Body<Self::Scalar>,
        motion: Motion<Self::Scalar>,
        pose_deg: [Self::Scalar; 2],
    ) -> Response<Self::Scalar>;
}

/// A small angle, rad.
const SMALL_RAD: f32 = 0.01;

impl<T: Elementary> Pad<'_, T> {
    /// The point that a plane touches first, along level axes, mm.
    fn touch_mm(&self, axes: &Matrix3<T>) -> Vector3<T> {
        self.fitted_first_touch_point_mm(axes) * self.units.length
    }
}

impl<const P: usize, T: Elementary, M: Memory<P, T>> Finger<PadState<P, T, M>> for Pad<'_, T> {
    type Scalar = T;
    const TOUCHES_CURVED: bool = true;

    fn fresh(&self) -> Result<PadState<P, T, M>, Error> {
        PadState::fresh(self)
    }
    fn restart(&self, state: &mut PadState<P, T, M>) {
        state.reset(self.patches.len());
    }
    fn in_contact(&self, state: &PadState<P, T, M>) -> bool {
        state.in_contact()
    }
    fn neutral_deg(&self) -> [T; 2] {
        [self.numbers.neutral_pitch_deg, T::of(0.0)]
    }
    fn depth_max_mm(&self) -> T {
        self.numbers.depth_max_mm * self.units.length
    }
    fn hold(&self, tilt: [T; 2]) -> Held<T> {
        let degrees = T::of(180.0) / T::half_turn();
        let pose_deg = [self.numbers.neutral_pitch_deg + degrees * tilt[0], degrees * tilt[1]];
        let (held, _) = self.tilt(pose_deg);
        let axes = axes(held);
        let follows = [0, 1].map(|k| (held[k] - tilt[k]).magnitude() < T::of(1e-5));
        Held { tilt: held, follows, pose_deg, normal: axes.row(2).transpose(), touch: self.touch_mm(&axes) }
    }
    fn lowest_mm(&self, normal: &Vector3<T>, _: [T; 2], held: &Held<T>) -> T {
        -normal.dot(&held.touch)
    }
    fn lowest_slopes_mm(&self, tilt: [T; 2], held: &Held<T>) -> [T; 2] {
        let ([pitch_sin, pitch_cos], [roll_sin, roll_cos]) =
            (<[T; 2]>::from(tilt[0].sin_cos()), <[T; 2]>::from(tilt[1].sin_cos()));
        let normal = Vector3::new(-pitch_sin, pitch_cos * roll_sin, pitch_cos * roll_cos);
        let by_pitch = Vector3::new(-pitch_cos, -pitch_sin * roll_sin, -pitch_sin * roll_cos);
        let by_roll = Vector3::new(T::of(0.0), pitch_cos * roll_cos, -pitch_cos * roll_sin);
        // While one angle is held the point that touches still moves with the other one, and not along the plane.
        let (small, zero) = (T::of(SMALL_RAD), T::of(0.0));
        let moves = |follows: bool, [pitch, roll]: [T; 2]| {
            let at = |sign: T| self.touch_mm(&axes([held.tilt[0] + sign * pitch, held.tilt[1] + sign * roll]));
            if follows { normal.dot(&(at(T::of(1.0)) - at(T::of(-1.0)))) / (small + small) } else { zero }
        };
        [
            -by_pitch.dot(&held.touch) - moves(held.follows[0], [small, zero]),
            -by_roll.dot(&held.touch) - moves(held.follows[1], [zero, small]),
        ]
    }
    fn advance(
        &self,
        state: &mut PadState<P, T, M>,
        body: &Body<T>,
        motion: Motion<T>,
        pose_deg: [T; 2],
    ) -> Response<T> {
        self.step(state, body, motion, pose_deg)
    }
}

/// A bed of springs on a finger that is round along and across, so that its lowest point, and with it depth, depends on pitch and roll. All
/// else is that of the bed's own pose.
#[derive(Clone, Copy, Debug)]
pub struct RoundBed<'a, const M: usize, const N: usize, T: Scalar = f32> {
    /// The bed.
    pub model: ModelOf<'a, M, N, T>,
    /// Radius of the finger along and across, mm.
    pub radius_mm: [T; 2],
}

impl<'a, const M: usize, const N: usize, T: Scalar> RoundBed<'a, M, N, T> {
    /// A bed on a finger with a radius of 21 mm.
    pub fn new(model: ModelOf<'a, M, N, T>) -> Self {
        Self { model, radius_mm: [T::of(21.0); 2] }
    }
}

impl<const M: usize, const N: usize, const P: usize, T: Elementary, R: bed::Memory<M, P, T>> Finger<StateOf<M, P, T, R>>
    for RoundBed<'_, M, N, T>
{
    type Scalar = T;
    const TOUCHES_CURVED: bool = false;

    fn fresh(&self) -> Result<StateOf<M, P, T, R>, Error> {
        Ok(StateOf::default())
    }
    fn restart(&self, state: &mut StateOf<M, P, T, R>) {
        let factor = state.strength_factor();
        *state = StateOf::default();
        state.set_strength_factor(factor);
    }
    fn in_contact(&self, state: &StateOf<M, P, T, R>) -> bool {
        state.in_contact()
    }
    fn neutral_deg(&self) -> [T; 2] {
        self.model.data.pose_deg
    }
    fn depth_max_mm(&self) -> T {
        self.model.depth_max_mm()
    }
    fn hold(&self, tilt: [T; 2]) -> Held<T> {
        let (degrees, zero) = (T::of(180.0) / T::half_turn(), T::of(0.0));
        let [pitch, roll] = self.model.data.pose_deg;
        Held {
            tilt: [zero; 2],
            follows: [false; 2],
            pose_deg: [pitch + degrees * tilt[0], roll + degrees * tilt[1]],
            normal: Vector3::new(zero, zero, T::of(1.0)),
            touch: Vector3::zeros(),
        }
    }
    fn lowest_mm(&self, _: &Vector3<T>, tilt: [T; 2], _: &Held<T>) -> T {
        let [by_pitch, by_roll] = [0, 1].map(|k| {
            let (half_sin, _) = (T::of(0.5) * tilt[k]).sin_cos();
            T::of(2.0) * self.radius_mm[k] * half_sin * half_sin
        });
        by_pitch + by_roll
    }
    fn lowest_slopes_mm(&self, tilt: [T; 2], _: &Held<T>) -> [T; 2] {
        [0, 1].map(|k| self.radius_mm[k] * tilt[k].sin_cos().0)
    }
    fn advance(&self, state: &mut StateOf<M, P, T, R>, _: &Body<T>, motion: Motion<T>, _: [T; 2]) -> Response<T> {
        step(&self.model, state, motion)
    }
}
