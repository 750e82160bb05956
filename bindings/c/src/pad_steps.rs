//! What is done with a contact of a pad, for each kind of its states: few patches or many, tissue that relaxes or does not.
//!
//! Main type: [`Steps`]; main macro: `by_kind`.

use fingerpad::pad::{Body, Memory, PadMemory, PadOn, PadState, RelaxingPadState};
use fingerpad::{Drivable, Driven, Motion};

use crate::codes::{FINGERPAD_BUFFER, FINGERPAD_RANGE};
use crate::driven::fingerpad_drive;
use crate::pad::{FEW, FINGERPAD_PATCHES_MAX, LoadedPad, fingerpad_body};
use crate::pad_state::{
    fingerpad_pad_motion, fingerpad_pad_state, fingerpad_patch, memory, memory_to_read, write_fresh,
};
use crate::pointer::{check, write};
use crate::requests::fingerpad_gradient;
use crate::types::{fingerpad_motion, fingerpad_response};

/// What is done with a state of tissue that relaxes. A program reaches it through its pads alone, so that one which makes no such pad does
/// not contain it.
#[allow(clippy::type_complexity)]
pub struct Steps {
    pub init: unsafe fn(&LoadedPad, *mut fingerpad_pad_state, Option<[f32; 2]>) -> Result<(), i32>,
    pub step: unsafe fn(
        &LoadedPad,
        *mut fingerpad_pad_state,
        fingerpad_body,
        fingerpad_pad_motion,
        *mut fingerpad_response,
    ) -> Result<(), i32>,
    pub step_driven: unsafe fn(
        &LoadedPad,
        *mut fingerpad_pad_state,
        fingerpad_body,
        [f32; 2],
        fingerpad_drive,
        *mut fingerpad_response,
        *mut fingerpad_motion,
    ) -> Result<(), i32>,
    pub write_gradient: unsafe fn(
        &LoadedPad,
        *const fingerpad_pad_state,
        fingerpad_body,
        [f32; 3],
        *mut fingerpad_gradient,
    ) -> Result<(), i32>,
    pub write_patches: unsafe fn(
        &LoadedPad,
        *const fingerpad_pad_state,
        fingerpad_body,
        *mut fingerpad_patch,
        usize,
    ) -> Result<(), i32>,
    #[cfg(not(target_os = "none"))]
    pub frame_step: unsafe fn(
        &LoadedPad,
        *mut crate::frames::fingerpad_frame_contact,
        &crate::frames::fingerpad_pose,
        f32,
        *mut crate::frames::fingerpad_frame_response,
    ) -> Result<(), i32>,
    #[cfg(not(target_os = "none"))]
    pub frame_patches: unsafe fn(
        &LoadedPad,
        *const crate::frames::fingerpad_frame_contact,
        *mut crate::frames::fingerpad_frame_patch,
        usize,
    ) -> Result<(), i32>,
}

impl Steps {
    const fn relaxing<const P: usize>() -> Self
    where
        for<'a> PadOn<'a, Body>: Drivable<RelaxingPadState<P>>,
    {
        Self {
            init: init::<P, PadMemory<P>>,
            step: step::<P, PadMemory<P>>,
            step_driven: step_driven::<P, PadMemory<P>>,
            write_gradient: write_gradient::<P, PadMemory<P>>,
            write_patches: write_patches::<P, PadMemory<P>>,
            #[cfg(not(target_os = "none"))]
            frame_step: crate::frames::frame_step::<P, PadMemory<P>>,
            #[cfg(not(target_os = "none"))]
            frame_patches: crate::frames::frame_patches::<P, PadMemory<P>>,
        }
    }
}

/// For few patches and for many.
pub static RELAXING: [Steps; 2] = [Steps::relaxing::<FEW>(), Steps::relaxing::<FINGERPAD_PATCHES_MAX>()];

/// Calls a function that `Steps` names, of the kind of a pad's states.
macro_rules! by_kind {
    ($call:ident($pad:expr $(, $argument:expr)*)) => {
        match ($pad.relaxing_steps()?, $pad.kind().1) {
            (Some(steps), _) => (steps.$call)($pad $(, $argument)*),
            (None, true) => $call::<{ $crate::pad::FEW }, ()>($pad $(, $argument)*),
            (None, false) => $call::<{ $crate::pad::FINGERPAD_PATCHES_MAX }, ()>($pad $(, $argument)*),
        }
    };
}
pub(crate) use by_kind;

// Not inlined, so that a pad of few patches needs the stack of a step of few alone.
#[inline(never)]
pub unsafe fn step<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    state: *mut fingerpad_pad_state,
    body: fingerpad_body,
    motion: fingerpad_pad_motion,
    response: *mut fingerpad_response,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let state = unsafe { memory::<PadState<P, f32, M>>(state) }?;
    check(response)?;
    let fingerpad_pad_motion { depth_mm, slide_x_mm, slide_y_mm, spin_rad, pitch_deg, roll_deg, dt_s } = motion;
    let motion = Motion { depth_mm, slide_increment_mm: [slide_x_mm, slide_y_mm], spin_increment_rad: spin_rad, dt_s };
    let forces = pad.pad.step(state, &body.checked()?, motion, [pitch_deg, roll_deg]);
    // SAFETY: the caller's promise.
    unsafe { write(response, forces.into()) }
}

#[inline(never)]
pub unsafe fn step_driven<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    state: *mut fingerpad_pad_state,
    body: fingerpad_body,
    pose_deg: [f32; 2],
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> Result<(), i32>
where
    for<'a> PadOn<'a, Body>: Drivable<PadState<P, f32, M>>,
{
    // SAFETY: the caller's promise.
    let state = unsafe { memory(state) }?;
    check(response)?;
    if !motion.is_null() {
        check(motion)?;
    }
    let finger = PadOn { pad: pad.pad, body: &body.checked()?, pose_deg };
    let Driven { response: forces, motion: led } = finger.step_driven(state, drive.into());
    if !motion.is_null() {
        // SAFETY: the caller's promise.
        unsafe { write(motion, led.into()) }?;
    }
    // SAFETY: the caller's promise.
    unsafe { write(response, forces.into()) }
}

#[inline(never)]
pub unsafe fn write_gradient<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    state: *const fingerpad_pad_state,
    body: fingerpad_body,
    motion_mm: [f32; 3],
    gradient: *mut fingerpad_gradient,
) -> Result<(), i32>
where
    for<'a> PadOn<'a, Body>: Drivable<PadState<P, f32, M>>,
{
    // SAFETY: the caller's promise.
    let state = unsafe { memory_to_read::<PadState<P, f32, M>>(state) }?;
    let finger = PadOn { pad: pad.pad, body: &body.checked()?, pose_deg: pad.pad.pose_deg(state) };
    // SAFETY: the caller's promise.
    unsafe { write(gradient, finger.gradient(state, motion_mm).into()) }
}

#[inline(never)]
pub unsafe fn write_patches<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    state: *const fingerpad_pad_state,
    body: fingerpad_body,
    out: *mut fingerpad_patch,
    count: usize,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let state = unsafe { memory_to_read::<PadState<P, f32, M>>(state) }?;
    // SAFETY: the caller's promise.
    unsafe { write_all(pad, out, count, pad.pad.patch_states(state, &body.checked()?)) }
}

/// Writes the patches of a pad where there is room for `count` of them.
pub unsafe fn write_all<C: From<T>, T, const P: usize>(
    pad: &LoadedPad,
    out: *mut C,
    count: usize,
    patches: [T; P],
) -> Result<(), i32> {
    check(out)?;
    if count < pad.pad.patches.len() {
        return Err(FINGERPAD_BUFFER);
    }
    for (i, (patch, _)) in patches.into_iter().zip(pad.pad.patches).enumerate() {
        // SAFETY: the caller's promise: there is room for `count` of them, which need not hold a patch yet.
        unsafe { write(out.add(i), patch.into()) }?;
    }
    Ok(())
}

/// A fresh state over a plane, or over a body in a pose.
pub unsafe fn init<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    state: *mut fingerpad_pad_state,
    over_deg: Option<[f32; 2]>,
) -> Result<(), i32> {
    let fresh = match over_deg {
        None => PadState::<P, f32, M>::fresh(&pad.pad),
        Some(pose) if pose.iter().all(|angle| angle.is_finite()) => PadState::fresh_over(&pad.pad, pose),
        Some(_) => return Err(FINGERPAD_RANGE),
    };
    // SAFETY: the caller's promise.
    unsafe { write_fresh(state, fresh) }
}
