//! Requests of a controller besides steps: derivatives, the least grip.

use fingerpad::{Gradient, Grip};

use crate::codes::answer;
use crate::model::{fingerpad_model, loaded_any};
use crate::pointer::write;
use crate::state::{Tissue, fingerpad_spin_state, fingerpad_state, memory_to_read};

/// Derivatives of the forces for a motion that goes on, N/mm; each with depth, slide x and slide y.
#[repr(C)]
pub struct fingerpad_gradient {
    /// Of the normal force.
    pub normal_n_mm: [f32; 3],
    /// Of friction along x.
    pub friction_x_n_mm: [f32; 3],
    /// Of friction along y.
    pub friction_y_n_mm: [f32; 3],
}

/// The least grip that holds a load.
#[repr(C)]
pub struct fingerpad_grip {
    /// Depth to press to, mm.
    pub depth_mm: f32,
    /// Normal force there with the load applied, N.
    pub normal_force_n: f32,
    /// FINGERPAD_STATUS_LOAD_NOT_REACHED if not even the largest depth holds the load, FINGERPAD_STATUS_BAD_INPUT if a number
    /// was none; 0 otherwise.
    pub status: u32,
}

impl From<Gradient> for fingerpad_gradient {
    fn from(gradient: Gradient) -> Self {
        let Gradient { normal_n_mm, friction_n_mm: [friction_x_n_mm, friction_y_n_mm] } = gradient;
        Self { normal_n_mm, friction_x_n_mm, friction_y_n_mm }
    }
}

impl From<Grip> for fingerpad_grip {
    fn from(grip: Grip) -> Self {
        Self { depth_mm: grip.depth_mm, normal_force_n: grip.normal_force_n, status: grip.status.0 }
    }
}

/// The gradient at a state for a motion that goes on in the direction (depth, slide x, slide y; any length). One-sided where
/// the law has kinks: springs on their limit slip if the direction loads them further; with zeros all springs stick. 0 without
/// contact, and 0 along depth beyond the tables. NaN in the direction counts as 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_gradient(
    model: *const fingerpad_model,
    state: *const fingerpad_state,
    depth_mm: f32,
    slide_x_mm: f32,
    slide_y_mm: f32,
    gradient: *mut fingerpad_gradient,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write_gradient::<_, 1, ()>(model, state, [depth_mm, slide_x_mm, slide_y_mm], gradient) })
}

/// As `fingerpad_state_gradient`, at a fixed angle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_gradient(
    model: *const fingerpad_model,
    state: *const fingerpad_spin_state,
    depth_mm: f32,
    slide_x_mm: f32,
    slide_y_mm: f32,
    gradient: *mut fingerpad_gradient,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write_gradient::<_, 2, ()>(model, state, [depth_mm, slide_x_mm, slide_y_mm], gradient) })
}

pub unsafe fn write_gradient<C, const P: usize, R: Tissue<P>>(
    model: *const fingerpad_model,
    state: *const C,
    direction: [f32; 3],
    out: *mut fingerpad_gradient,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (R::model(model)?, memory_to_read::<C, P, R>(state)?) };
    // SAFETY: the caller's promise.
    unsafe { write(out, model.model().gradient(state, direction).into()) }
}

/// The least depth and normal force at which friction of the load, N, leaves the slip margin `margin` (0 to 0.95), even if the
/// finger holds less than the model says by the half-width of its 95 % band; `strength_factor` as in
/// `fingerpad_state_set_strength_factor`. Tissue that relaxes has relaxed then: the grip holds the load for good.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_least_grip(
    model: *const fingerpad_model,
    load_x_n: f32,
    load_y_n: f32,
    margin: f32,
    strength_factor: f32,
    grip: *mut fingerpad_grip,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_any(model) }.and_then(|model| {
        let found = model.model.least_grip([load_x_n, load_y_n], margin, strength_factor);
        // SAFETY: the caller's promise.
        unsafe { write(grip, found.into()) }
    }))
}
