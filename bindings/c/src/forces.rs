//! A contact of which only forces are needed: set up, strength, step.

use fingerpad::{ForceResponse, ForceState};

use crate::codes::{FINGERPAD_NOT_SET_UP, FINGERPAD_RANGE, answer};
use crate::model::{fingerpad_model, loaded};
use crate::pointer::{check, exclusive, write};
use crate::types::fingerpad_motion;

/// All that the forces of a contact depend on, without the history of its slip: 64 bytes in place of 108. Set it up with
/// `fingerpad_force_state_init`. Plain memory: copy it to go back to it.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_force_state {
    opaque: [u32; 16],
}

// A state is floats throughout: whatever lies there are numbers.
const _: () = {
    assert!(size_of::<ForceState>() == size_of::<fingerpad_force_state>());
    assert!(align_of::<ForceState>() == align_of::<fingerpad_force_state>());
};

/// The part of `fingerpad_response` that needs no history of slip: no stick ratio, regime and bands.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_force_response {
    /// Normal force, N, not negative.
    pub normal_force_n: f32,
    /// Friction along x, N; it points along the plane's motion.
    pub friction_x_n: f32,
    /// Friction along y, N.
    pub friction_y_n: f32,
    /// Largest friction in the direction of the present one, N; 0 without contact.
    pub friction_limit_n: f32,
    /// 1 less the share of its limit that friction uses; 0 without contact.
    pub slip_margin: f32,
    /// Moment of the friction along y about the plane's normal through the point under first touch, N mm.
    pub spin_moment_n_mm: f32,
    /// Centre of pressure along x from the point under first touch, mm.
    pub pressure_centre_x_mm: f32,
    /// Centre of pressure along y from the point under first touch, mm.
    pub pressure_centre_y_mm: f32,
    /// Contact area, mm².
    pub contact_area_mm2: f32,
    /// Flags FINGERPAD_STATUS_..., 0 for none.
    pub status: u32,
}

impl From<ForceResponse> for fingerpad_force_response {
    #[inline(always)]
    fn from(r: ForceResponse) -> Self {
        Self {
            normal_force_n: r.normal_force_n,
            friction_x_n: r.friction_n[0],
            friction_y_n: r.friction_n[1],
            friction_limit_n: r.friction_limit_n,
            slip_margin: r.slip_margin,
            spin_moment_n_mm: r.spin_moment_n_mm,
            pressure_centre_x_mm: r.pressure_centre_mm[0],
            pressure_centre_y_mm: r.pressure_centre_mm[1],
            contact_area_mm2: r.contact_area_mm2,
            status: r.status.0,
        }
    }
}

/// A state to change. One that was not set up has a strength factor that cannot be set.
#[inline(always)]
unsafe fn memory<'a>(state: *mut fingerpad_force_state) -> Result<&'a mut ForceState, i32> {
    // SAFETY: the caller's promise; any bits are a state.
    let state: &mut ForceState = unsafe { exclusive(state.cast()) }?;
    if (0.1..=5.0).contains(&state.strength_factor()) { Ok(state) } else { Err(FINGERPAD_NOT_SET_UP) }
}

/// A finger in the air, with a strength factor of 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_force_state_init(state: *mut fingerpad_force_state) -> i32 {
    // SAFETY: the caller's promise; size and alignment were checked above.
    answer(unsafe { write(state.cast(), ForceState::default()) })
}

/// As `fingerpad_state_set_strength_factor`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_force_state_set_strength_factor(
    state: *mut fingerpad_force_state,
    factor: f32,
) -> i32 {
    let set = || {
        // SAFETY: the caller's promise.
        let state = unsafe { memory(state) }?;
        if !(0.1..=5.0).contains(&factor) {
            return Err(FINGERPAD_RANGE);
        }
        state.set_strength_factor(factor);
        Ok(())
    };
    answer(set())
}

/// Advances a contact by one step; the forces are those of `fingerpad_step`, bit by bit, with about a third fewer instructions.
///
/// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_step_forces(
    model: *const fingerpad_model,
    state: *mut fingerpad_force_state,
    motion: fingerpad_motion,
    response: *mut fingerpad_force_response,
) -> i32 {
    let step = || {
        // SAFETY: the caller's promise.
        let (model, state) = unsafe { (loaded(model)?, memory(state)?) };
        check(response)?;
        // SAFETY: the caller's promise.
        unsafe { write(response, model.model.step_forces(state, motion.into()).into()) }
    };
    answer(step())
}
