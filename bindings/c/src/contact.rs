//! A contact with the effects of its model's file.

use fingerpad::{Contact, SPRINGS, Surroundings};

use crate::codes::{FINGERPAD_RANGE, FINGERPAD_SECTION, answer};
use crate::model::{fingerpad_model, loaded};
use crate::pointer::{check, exclusive, shared, write};
use crate::state::{set_strength_factor, set_up};
use crate::types::{fingerpad_motion, fingerpad_response, read_back};

/// All that a contact with effects remembers: a state, and the clocks and paths that effects read. Set it up with
/// `fingerpad_contact_init`. Plain memory: copy it to go back to it.
#[repr(C)]
pub struct fingerpad_contact {
    opaque: [u32; 39],
}

/// Conditions that effects depend on and a motion does not contain. `fingerpad_surroundings_default` gives the reference state.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_surroundings {
    /// Moisture of the skin, corneometer units.
    pub hydration_au: f32,
    /// Temperature of the skin, degrees Celsius.
    pub temperature_c: f32,
    /// Width of the finger, mm.
    pub finger_width_mm: f32,
    /// Clock of the series in which the tissue drifts, s.
    pub series_s: f32,
    /// Hold before sliding, s; NaN: counted from the motion.
    pub dwell_s: f32,
    /// Contact time since the last rest, s; NaN: counted from the motion.
    pub occlusion_s: f32,
    /// Nominal speed of the plane where it moves, mm/s; NaN: computed from the motion.
    pub speed_mm_s: f32,
    /// Columns of the user's own that tables of the model file read, in the order of `fingerpad_model_own_column`;
    /// `fingerpad_model_surroundings` gives the values of the calibration.
    pub own: [f32; 4],
}

type Memory = Contact<SPRINGS>;

// Floats throughout: whatever lies there are numbers.
const _: () = {
    assert!(size_of::<Memory>() == size_of::<fingerpad_contact>());
    assert!(align_of::<Memory>() == align_of::<fingerpad_contact>());
};

unsafe fn memory<'a>(contact: *mut fingerpad_contact) -> Result<&'a mut Memory, i32> {
    // SAFETY: the caller's promise; any bits are a contact.
    let contact: &mut Memory = unsafe { exclusive(contact.cast()) }?;
    set_up(&mut contact.state)?;
    Ok(contact)
}

/// The reference state of a library without a model: 35 corneometer units, 32 degrees Celsius, 16 mm, times and speed counted
/// from the motion, 0 for columns of the user's own.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_surroundings_default(surroundings: *mut fingerpad_surroundings) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write(surroundings, reference_state()) })
}

/// The reference state of a model: the same, with the values of the calibration for columns of the user's own.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_surroundings(
    model: *const fingerpad_model,
    surroundings: *mut fingerpad_surroundings,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded(model) }.and_then(|loaded| {
        let mut reference = reference_state();
        for (to, column) in reference.own.iter_mut().zip(loaded.columns) {
            *to = column.reference;
        }
        // SAFETY: the caller's promise.
        unsafe { write(surroundings, reference) }
    }))
}

fn reference_state() -> fingerpad_surroundings {
    let Surroundings { hydration_au, temperature_c, finger_width_mm, series_s, dwell_s, occlusion_s, speed_mm_s, own } =
        Surroundings::default();
    let or_counted = |value: Option<f32>| value.unwrap_or(f32::NAN);
    fingerpad_surroundings {
        hydration_au,
        temperature_c,
        finger_width_mm,
        series_s,
        dwell_s: or_counted(dwell_s),
        occlusion_s: or_counted(occlusion_s),
        speed_mm_s: or_counted(speed_mm_s),
        own,
    }
}

impl From<fingerpad_surroundings> for Surroundings {
    fn from(s: fingerpad_surroundings) -> Self {
        let given = |value: f32| if value.is_nan() { None } else { Some(value) };
        Self {
            hydration_au: s.hydration_au,
            temperature_c: s.temperature_c,
            finger_width_mm: s.finger_width_mm,
            series_s: s.series_s,
            dwell_s: given(s.dwell_s),
            occlusion_s: given(s.occlusion_s),
            speed_mm_s: given(s.speed_mm_s),
            own: s.own,
        }
    }
}

/// A finger in the air, all clocks at 0, with a strength factor of 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_contact_init(contact: *mut fingerpad_contact) -> i32 {
    // SAFETY: the caller's promise; size and alignment were checked above.
    answer(unsafe { write(contact.cast(), Memory::default()) })
}

/// The caller's factor on all strengths, 0.1 to 5; the effects' comes on top of it. Returns FINGERPAD_OK, or FINGERPAD_RANGE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_contact_set_strength_factor(contact: *mut fingerpad_contact, factor: f32) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { memory(contact).and_then(|contact| set_strength_factor::<_, 1, ()>(&mut contact.state, factor)) })
}

/// Declares a rest of the finger in the air: the time of occlusion starts again from zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_contact_record_rest(contact: *mut fingerpad_contact) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { memory(contact) }.map(fingerpad::Effects::record_rest))
}

/// Advances a contact by one step with the effects of the model's file; bad surroundings (NaN) leave their effect out.
///
/// Returns FINGERPAD_OK, or FINGERPAD_SECTION if the file has effects that this library does not know, FINGERPAD_NULL,
/// FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_contact_step(
    model: *const fingerpad_model,
    contact: *mut fingerpad_contact,
    surroundings: fingerpad_surroundings,
    motion: fingerpad_motion,
    response: *mut fingerpad_response,
) -> i32 {
    let stepped = || {
        // SAFETY: the caller's promise.
        let (loaded, contact) = unsafe { (loaded(model)?, memory(contact)?) };
        check(response)?;
        let effects = loaded.effects.ok_or(FINGERPAD_SECTION)?;
        let (surroundings, motion) = (surroundings.into(), motion.into());
        let forces = effects.step(&loaded.model, contact, surroundings, motion);
        // SAFETY: the caller's promise.
        unsafe { write(response, forces.into()) }
    };
    answer(stepped())
}

/// What a sensor with the file's tare and cross-talk reads of a response: normal, x and y, N, into an array of three. Where
/// tables say what the sensor makes of temperature, time or a column of the user's own, see `fingerpad_contact_reading_under`.
///
/// Returns FINGERPAD_OK, FINGERPAD_SECTION as above, or FINGERPAD_RANGE for a response whose regime is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_contact_reading(
    model: *const fingerpad_model,
    response: *const fingerpad_response,
    reading_n: *mut f32,
) -> i32 {
    let read = || {
        // SAFETY: the caller's promise.
        let (model, response) = unsafe { (loaded(model)?, shared(response)?) };
        let effects = model.effects.ok_or(FINGERPAD_SECTION)?;
        let response = read_back(response).ok_or(FINGERPAD_RANGE)?;
        // SAFETY: the caller's promise; an array of three is aligned as its numbers.
        unsafe { write(reading_n.cast::<[f32; 3]>(), effects.reading(&response)) }
    };
    answer(read())
}

/// The same under surroundings, after a step of the contact that gave the response.
///
/// Returns FINGERPAD_OK, or what `fingerpad_contact_reading` returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_contact_reading_under(
    model: *const fingerpad_model,
    contact: *const fingerpad_contact,
    surroundings: fingerpad_surroundings,
    response: *const fingerpad_response,
    reading_n: *mut f32,
) -> i32 {
    let read = || {
        // SAFETY: the caller's promise; any bits are a contact.
        let (model, contact) = unsafe { (loaded(model)?, shared::<Memory>(contact.cast())?) };
        set_up(&mut contact.state.clone())?;
        // SAFETY: the caller's promise.
        let response = read_back(unsafe { shared(response) }?).ok_or(FINGERPAD_RANGE)?;
        let effects = model.effects.ok_or(FINGERPAD_SECTION)?;
        let reading = effects.reading_under(&response, contact, &surroundings.into());
        // SAFETY: the caller's promise; an array of three is aligned as its numbers.
        unsafe { write(reading_n.cast::<[f32; 3]>(), reading) }
    };
    answer(read())
}
