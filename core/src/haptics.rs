//! What a sampled loop of a haptic device needs to be calm on the model of a finger.
//!
//! Main functions: [`press_stiffness_n_per_mm`], [`least_damping_n_s_per_m`]. Uses frames.
//!
//! A model yields no work, but a force that is held over a sample and comes late does: a spring of stiffness K, sampled with period T, gives
//! away as much as a damper of −K T/2 (Colgate and Schenkel 1997, J. Robot. Syst. 14:37), and of −K T more for each sample by which the force
//! is late. Device, hand and renderer together must have that much damping.

use crate::Error;
use crate::Motion;
use crate::frames::Finger;
use crate::math::Scalar;
use crate::pad::Body;

/// Change of depth over which the stiffness is taken, mm.
const SMALL_MM: f32 = 0.01;

/// Stiffness of a finger that a plane presses in its neutral pose, N/mm, at a depth.
///
/// * `S`: state of a contact of the finger, such as [`crate::State`] or [`crate::pad::PadState`]
///
/// # Errors
/// Those of [`Finger::fresh`].
pub fn press_stiffness_n_per_mm<S, F: Finger<S>>(finger: &F, depth_mm: F::Scalar) -> Result<F::Scalar, Error> {
    let mut state = finger.fresh()?;
    let mut press = |depth_mm| {
        let motion = Motion { depth_mm, dt_s: F::Scalar::of(1e-3), ..Motion::default() };
        finger.advance(&mut state, &Body::Plane, motion, finger.neutral_deg()).normal_force_n
    };
    let small = F::Scalar::of(SMALL_MM);
    let [less, more] = [press(depth_mm), press(depth_mm + small)];
    Ok((more - less) / small)
}

/// Least damping of device, hand and renderer together, N s/m, at which a contact of this stiffness does not vibrate by itself.
///
/// * `stiffness_n_per_mm`: of the contact, such as [`press_stiffness_n_per_mm`], where the virtual body is held directly
/// * `period_s`: time from sample to sample
/// * `late_samples`: samples by which the force comes later than at once: 1 for a loop that computes during the sample
pub fn least_damping_n_s_per_m<T: Scalar>(stiffness_n_per_mm: T, period_s: T, late_samples: u16) -> T {
    T::of(1000.0) * stiffness_n_per_mm * period_s * (T::of(0.5) + T::of(f32::from(late_samples)))
}
