//! A step driven by forces instead of displacements.

use fingerpad::{Drive, Driven, Normal, Tangential};

use crate::codes::answer;
use crate::model::fingerpad_model;
use crate::pointer::{check, write};
use crate::state::{Tissue, fingerpad_state, memory};
use crate::types::{fingerpad_motion, fingerpad_response};

/// What is prescribed in one step: depth or normal force, slide or friction.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_drive {
    /// 0: `depth_mm` is prescribed; else `normal_force_n`.
    pub by_normal_force: u16,
    /// 0: `slide_x_mm` and `slide_y_mm` are prescribed; else `friction_x_n` and `friction_y_n`.
    pub by_friction: u16,
    /// Depth at the end of the step, mm.
    pub depth_mm: f32,
    /// Normal force at the end of the step, N.
    pub normal_force_n: f32,
    /// Slide along x during the step, mm.
    pub slide_x_mm: f32,
    /// Slide along y during the step, mm.
    pub slide_y_mm: f32,
    /// Friction along x at the end of the step, N.
    pub friction_x_n: f32,
    /// Friction along y at the end of the step, N.
    pub friction_y_n: f32,
    /// Turn of the plane during the step, rad.
    pub spin_rad: f32,
    /// Length of the step, s.
    pub dt_s: f32,
}

impl From<fingerpad_drive> for Drive {
    fn from(drive: fingerpad_drive) -> Self {
        let by_depth = drive.by_normal_force == 0;
        let by_slide = drive.by_friction == 0;
        Self {
            normal: if by_depth { Normal::DepthMm(drive.depth_mm) } else { Normal::ForceN(drive.normal_force_n) },
            tangential: if by_slide {
                Tangential::SlideIncrementMm([drive.slide_x_mm, drive.slide_y_mm])
            } else {
                Tangential::FrictionN([drive.friction_x_n, drive.friction_y_n])
            },
            spin_increment_rad: drive.spin_rad,
            dt_s: drive.dt_s,
        }
    }
}

/// Advances a contact by one step driven by displacement or force in each direction; a held load does not creep. A force out
/// of reach gives the nearest state and FINGERPAD_STATUS_LOAD_NOT_REACHED. `motion` becomes the motion that led there; it may
/// be null. Takes 3 to 12 times as long as `fingerpad_step`.
///
/// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_step_driven(
    model: *const fingerpad_model,
    state: *mut fingerpad_state,
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { step_driven::<_, 1, ()>(model, state, drive, response, motion) })
}

pub unsafe fn step_driven<C, const P: usize, R: Tissue<P>>(
    model: *const fingerpad_model,
    state: *mut C,
    drive: fingerpad_drive,
    response: *mut fingerpad_response,
    motion: *mut fingerpad_motion,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (R::model(model)?, memory::<C, P, R>(state)?) };
    check(response)?;
    if !motion.is_null() {
        check(motion)?;
    }
    let Driven { response: forces, motion: led } = model.model().step_driven(state, drive.into());
    if !motion.is_null() {
        // SAFETY: the caller's promise.
        unsafe { write(motion, led.into()) }?;
    }
    // SAFETY: the caller's promise.
    unsafe { write(response, forces.into()) }
}
