//! The reduced model for C. No allocation, no panic; the caller owns all memory.
#![no_std]
#![allow(non_camel_case_types)]

use core::slice;

use fingerpad::{
    Error, Model, ModelOf, Motion, Pose, Posed, STATE_BYTES, Scaled, SpinState, State, StateOf, Tuned, Tuning,
};
use panic_never as _;

/// Bytes of a saved state.
pub const FINGERPAD_STATE_BYTES: usize = 120;
/// Bytes of a saved state of a contact that spins.
pub const FINGERPAD_SPIN_STATE_BYTES: usize = 152;

/// A model ready to step. Load it with `fingerpad_model_load`; the file must stay where it is.
#[repr(C)]
pub struct fingerpad_model {
    opaque: [u64; 10],
}

/// A model in another pose. Write it with `fingerpad_model_pose`; the file must stay where it is.
#[repr(C)]
pub struct fingerpad_posed_model {
    opaque: [u64; 10],
}

/// All that a contact remembers. Plain memory: copy it to go back to it in the same program; `fingerpad_state_save` makes
/// bytes that can be checked when they are read.
#[repr(C)]
pub struct fingerpad_state {
    opaque: [u32; 27],
}

/// The same of a contact that also spins.
#[repr(C)]
pub struct fingerpad_spin_state {
    opaque: [u32; 35],
}

/// What the plane does in one step.
#[repr(C)]
pub struct fingerpad_motion {
    /// Depth at the end of the step, mm.
    pub depth_mm: f32,
    /// Slide of the plane during the step, mm.
    pub slide_x_mm: f32,
    /// Slide of the plane during the step, mm.
    pub slide_y_mm: f32,
    /// Turn of the plane about its normal through the point under first touch during the step, rad, counter-clockwise seen
    /// from the finger. Only `fingerpad_spin_step` follows it; `fingerpad_step` flags it.
    pub spin_rad: f32,
    /// Length of the step, s.
    pub dt_s: f32,
}

/// Forces that the plane exerts on the finger.
#[repr(C)]
pub struct fingerpad_response {
    /// N
    pub normal_force_n: f32,
    /// N
    pub friction_x_n: f32,
    /// N
    pub friction_y_n: f32,
    /// Stuck area over contact area.
    pub stick_ratio: f32,
    /// Largest friction in the direction of the present one, N
    pub friction_limit_n: f32,
    /// 1 less the share of its limit that the load uses; with spin the load is friction and moment together.
    pub slip_margin: f32,
    /// About the plane's normal through the point under first touch, N mm; without spin that of friction along y alone.
    pub spin_moment_n_mm: f32,
    /// From the point under first touch, mm
    pub pressure_centre_x_mm: f32,
    /// From the point under first touch, mm
    pub pressure_centre_y_mm: f32,
    /// mm²
    pub contact_area_mm2: f32,
    /// Half-width of the 95 % band, N
    pub band_normal_n: f32,
    /// Half-width of the 95 % band, N
    pub band_friction_n: f32,
    /// 0 no contact, 1 stick, 2 partial slip, 3 slip
    pub regime: u16,
    /// Flags: 2 bad input, 4 bad time step, 8 depth above range, 16 large increment, 64 spin ignored, 128 memory lost and
    /// begun anew
    pub status: u16,
}

/// The least grip that holds a load.
#[repr(C)]
pub struct fingerpad_grip {
    /// mm
    pub depth_mm: f32,
    /// N
    pub normal_force_n: f32,
    /// 0, 2 bad input, 32 not even the largest depth holds the load
    pub status: u16,
}

const _: () = {
    assert!(size_of::<Tuned<'static>>() <= size_of::<fingerpad_model>());
    assert!(align_of::<Tuned<'static>>() <= align_of::<fingerpad_model>());
    assert!(size_of::<Posed<'static>>() <= size_of::<fingerpad_posed_model>());
    assert!(align_of::<Posed<'static>>() <= align_of::<fingerpad_posed_model>());
    assert!(size_of::<State>() == size_of::<fingerpad_state>());
    assert!(align_of::<State>() == align_of::<fingerpad_state>());
    assert!(size_of::<SpinState>() == size_of::<fingerpad_spin_state>());
    assert!(align_of::<SpinState>() == align_of::<fingerpad_spin_state>());
    assert!(STATE_BYTES == FINGERPAD_STATE_BYTES);
    // Version, model and checksum come to the memory's own words in both.
    assert!(FINGERPAD_STATE_BYTES - size_of::<State>() == FINGERPAD_SPIN_STATE_BYTES - size_of::<SpinState>());
};

fn code(error: Error) -> i32 {
    match error {
        Error::Magic => 1,
        Error::Version { .. } => 2,
        Error::Length { .. } => 3,
        Error::Checksum => 4,
        Error::Alignment => 5,
        Error::Shape { .. } => 6,
        Error::Section { .. } => 7,
        Error::Range { .. } => 8,
        Error::NotMonotone { .. } => 9,
        Error::NotPassive { .. } => 10,
        Error::Buffer { .. } => 11,
        Error::OtherModel { .. } => 12,
        // An error of a later version of the core.
        _ => 13,
    }
}

fn step<const POSED: bool, const P: usize>(
    model: &ModelOf<'static, { fingerpad::SPRINGS }, { fingerpad::NODES }, Scaled<f32, POSED>>,
    state: &mut StateOf<{ fingerpad::SPRINGS }, P>,
    motion: fingerpad_motion,
) -> fingerpad_response {
    let fingerpad_motion { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s } = motion;
    let slide_increment_mm = [slide_x_mm, slide_y_mm];
    let r = fingerpad::step(model, state, Motion { depth_mm, slide_increment_mm, spin_increment_rad: spin_rad, dt_s });
    fingerpad_response {
        normal_force_n: r.normal_force_n,
        friction_x_n: r.friction_n[0],
        friction_y_n: r.friction_n[1],
        stick_ratio: r.stick_ratio,
        friction_limit_n: r.friction_limit_n,
        slip_margin: r.slip_margin,
        spin_moment_n_mm: r.spin_moment_n_mm,
        pressure_centre_x_mm: r.pressure_centre_mm[0],
        pressure_centre_y_mm: r.pressure_centre_mm[1],
        contact_area_mm2: r.contact_area_mm2,
        band_normal_n: r.band_normal_n,
        band_friction_n: r.band_friction_n,
        regime: r.regime as u16,
        status: r.status.0,
    }
}

fn save<const P: usize>(model: &Tuned<'static>, state: &StateOf<{ fingerpad::SPRINGS }, P>, bytes: &mut [u8]) -> i32 {
    state.write_bytes(model.data().checksum(), bytes).map_or_else(code, |_| 0)
}

fn restore<const P: usize>(
    model: &Tuned<'static>,
    state: &mut StateOf<{ fingerpad::SPRINGS }, P>,
    bytes: &[u8],
) -> i32 {
    match StateOf::read_bytes(model.data().checksum(), bytes) {
        Ok(saved) => {
            *state = saved;
            0
        }
        Err(error) => code(error),
    }
}

/// Checks a model file and prepares a model that reads it in place. Returns 0, or: 1 not a model file, 2 version,
/// 3 length, 4 checksum, 5 not at an address divisible by 4, 6 other numbers of springs or nodes, 7 section missing,
/// 8 value out of range, 9 table not monotone, 10 not passive.
///
/// # Safety
/// `model` points to memory for a model, `file` to `length` bytes that live and stay unchanged as long as the model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_load(model: *mut fingerpad_model, file: *const u8, length: usize) -> i32 {
    // SAFETY: the caller's promise.
    let bytes: &'static [u8] = unsafe { slice::from_raw_parts(file, length) };
    match Model::from_bytes(bytes).and_then(|model| model.tuned(Tuning::default())) {
        Ok(loaded) => {
            // SAFETY: the caller's promise; size and alignment were checked above.
            unsafe { model.cast::<Tuned<'static>>().write(loaded) };
            0
        }
        Err(error) => code(error),
    }
}

/// Changes the model to another finger: factors on size, stiffness and lambda, and tau_0 in MPa. Returns 0, or 8 if a
/// value is out of range; then nothing changes.
///
/// # Safety
/// `model` was loaded.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_tune(
    model: *mut fingerpad_model,
    size: f32,
    stiffness: f32,
    lambda: f32,
    tau0_mpa: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    let model = unsafe { &mut *model.cast::<Tuned<'static>>() };
    match model.tuned(Tuning { size, stiffness, lambda, tau0_mpa }) {
        Ok(tuned) => {
            *model = tuned;
            0
        }
        Err(error) => code(error),
    }
}

/// Writes into `posed` the model in another pose: pitch of the finger against the plane, 10 to 70 degrees, and roll, -30 to 30.
/// `model` is that of the fitted pose. Returns 0, or 8 for a pose out of range or a model that knows one pose alone; then
/// nothing is written. A state may be carried over.
///
/// # Safety
/// `model` was loaded, `posed` points to memory for a posed model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_pose(
    model: *const fingerpad_model,
    posed: *mut fingerpad_posed_model,
    pitch_deg: f32,
    roll_deg: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    let model = unsafe { &*model.cast::<Tuned<'static>>() };
    match model.posed(Pose { pitch_deg, roll_deg }) {
        Ok(to) => {
            // SAFETY: the caller's promise; size and alignment were checked above.
            unsafe { posed.cast::<Posed<'static>>().write(to) };
            0
        }
        Err(error) => code(error),
    }
}

/// Advances a contact by one step in another pose. Cannot fail, whatever the motion.
///
/// # Safety
/// `posed` was written by `fingerpad_model_pose`, `state` was initialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_posed_step(
    posed: *const fingerpad_posed_model,
    state: *mut fingerpad_state,
    motion: fingerpad_motion,
) -> fingerpad_response {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*posed.cast::<Posed<'static>>(), &mut *state.cast::<State>()) };
    step(model, state, motion)
}

/// A finger in the air.
///
/// # Safety
/// `state` points to memory for a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_init(state: *mut fingerpad_state) {
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { state.cast::<State>().write(State::default()) }
}

/// Sets the factor on all strengths, 0.1 to 5; returns the factor in use.
///
/// # Safety
/// `state` was initialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_set_strength_factor(state: *mut fingerpad_state, factor: f32) -> f32 {
    // SAFETY: the caller's promise.
    unsafe { &mut *state.cast::<State>() }.set_strength_factor(factor)
}

/// Writes a state as FINGERPAD_STATE_BYTES bytes with version, checksum of the model and checksum of its own. The model's checksum is
/// computed each time, some 20 instructions a byte of the file. Returns 0.
///
/// # Safety
/// `model` was loaded, `state` was initialised, `bytes` points to FINGERPAD_STATE_BYTES bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_save(
    model: *const fingerpad_model,
    state: *const fingerpad_state,
    bytes: *mut u8,
) -> i32 {
    // SAFETY: the caller's promise.
    let bytes = unsafe { slice::from_raw_parts_mut(bytes, FINGERPAD_STATE_BYTES) };
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*model.cast::<Tuned<'static>>(), &*state.cast::<State>()) };
    save(model, state, bytes)
}

/// Reads a state that `fingerpad_state_save` wrote with the same model file. Returns 0, or: 2 version, 3 length, 4 damaged, 8 a
/// value that no step leaves behind, 12 saved with another model; then the state stays as it was.
///
/// # Safety
/// `model` was loaded, `state` was initialised, `bytes` points to `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_state_restore(
    model: *const fingerpad_model,
    state: *mut fingerpad_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    let bytes = unsafe { slice::from_raw_parts(bytes, length) };
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*model.cast::<Tuned<'static>>(), &mut *state.cast::<State>()) };
    restore(model, state, bytes)
}

/// Advances a contact by one step. Cannot fail, whatever the motion.
///
/// # Safety
/// `model` was loaded, `state` was initialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_step(
    model: *const fingerpad_model,
    state: *mut fingerpad_state,
    motion: fingerpad_motion,
) -> fingerpad_response {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*model.cast::<Tuned<'static>>(), &mut *state.cast::<State>()) };
    #[cfg(feature = "panics")]
    core::hint::black_box([0u8; 4][core::hint::black_box(motion.depth_mm as usize)]);
    step(model, state, motion)
}

/// A finger in the air whose contact will also spin.
///
/// # Safety
/// `state` points to memory for a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_init(state: *mut fingerpad_spin_state) {
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { state.cast::<SpinState>().write(SpinState::default()) }
}

/// Sets the factor on all strengths, 0.1 to 5; returns the factor in use.
///
/// # Safety
/// `state` was initialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_set_strength_factor(
    state: *mut fingerpad_spin_state,
    factor: f32,
) -> f32 {
    // SAFETY: the caller's promise.
    unsafe { &mut *state.cast::<SpinState>() }.set_strength_factor(factor)
}

/// Writes a state as FINGERPAD_SPIN_STATE_BYTES bytes with version, checksum of the model and checksum of its own. The model's checksum is
/// computed each time, some 20 instructions a byte of the file. Returns 0.
///
/// # Safety
/// `model` was loaded, `state` was initialised, `bytes` points to FINGERPAD_SPIN_STATE_BYTES bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_save(
    model: *const fingerpad_model,
    state: *const fingerpad_spin_state,
    bytes: *mut u8,
) -> i32 {
    // SAFETY: the caller's promise.
    let bytes = unsafe { slice::from_raw_parts_mut(bytes, FINGERPAD_SPIN_STATE_BYTES) };
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*model.cast::<Tuned<'static>>(), &*state.cast::<SpinState>()) };
    save(model, state, bytes)
}

/// Reads a state that `fingerpad_spin_state_save` wrote with the same model file. Returns 0, or: 2 version, 3 length, 4 damaged, 8 a
/// value that no step leaves behind, 12 saved with another model; then the state stays as it was.
///
/// # Safety
/// `model` was loaded, `state` was initialised, `bytes` points to `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_state_restore(
    model: *const fingerpad_model,
    state: *mut fingerpad_spin_state,
    bytes: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    let bytes = unsafe { slice::from_raw_parts(bytes, length) };
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*model.cast::<Tuned<'static>>(), &mut *state.cast::<SpinState>()) };
    restore(model, state, bytes)
}

/// Advances a contact that also spins by one step; takes about twice as long as `fingerpad_step`. Cannot fail.
///
/// # Safety
/// `model` was loaded, `state` was initialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_spin_step(
    model: *const fingerpad_model,
    state: *mut fingerpad_spin_state,
    motion: fingerpad_motion,
) -> fingerpad_response {
    // SAFETY: the caller's promise.
    let (model, state) = unsafe { (&*model.cast::<Tuned<'static>>(), &mut *state.cast::<SpinState>()) };
    step(model, state, motion)
}

/// The least depth and normal force at which friction of `load` leaves the slip margin `margin`.
///
/// # Safety
/// `model` was loaded.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_least_grip(
    model: *const fingerpad_model,
    load_x_n: f32,
    load_y_n: f32,
    margin: f32,
    strength_factor: f32,
) -> fingerpad_grip {
    // SAFETY: the caller's promise.
    let model = unsafe { &*model.cast::<Tuned<'static>>() };
    let grip = model.least_grip([load_x_n, load_y_n], margin, strength_factor);
    fingerpad_grip { depth_mm: grip.depth_mm, normal_force_n: grip.normal_force_n, status: grip.status.0 }
}
