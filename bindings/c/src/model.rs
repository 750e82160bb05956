//! A model file in use: load, tune, pose, ask.

use core::ffi::c_char;

use fingerpad::{Effects, File, Model, Pose, Posed, TableColumn, Tuned, Tuning};

use crate::codes::{FINGERPAD_NOT_SET_UP, FINGERPAD_NULL, FINGERPAD_RANGE, answer, code};
use crate::pointer::{exclusive, items, shared, write};

/// A model file in use. Set it up with `fingerpad_model_load`; the file must stay where it is. May be copied, and read by
/// several threads as long as none changes it.
#[repr(C)]
pub struct fingerpad_model {
    opaque: [u64; 34],
}

/// What a model file says of itself.
#[repr(C)]
pub struct fingerpad_model_info {
    /// Largest depth for which the model was fitted, mm, for the finger and pose in use.
    pub depth_max_mm: f32,
    /// Pitch of the pose in which it was fitted, degrees.
    pub fitted_pitch_deg: f32,
    /// 1 if it knows other poses, else 0.
    pub knows_poses: u32,
    /// Number of effects in the file.
    pub effects: u32,
    /// Checksum of the numbers, by which a saved state knows its model.
    pub checksum: u32,
    /// The file's description, JSON in UTF-8 without an end mark, inside the file.
    pub meta: *const c_char,
    /// Its length in bytes.
    pub meta_length: usize,
    /// Number of columns of the user's own that tables of the file read: `fingerpad_model_own_column` tells which.
    pub own_columns: u32,
}

/// A column of the user's own (a voltage, a humidity) that tables of a model file read.
#[repr(C)]
pub struct fingerpad_own_column {
    /// Its name, UTF-8, ending with a zero.
    pub name: [c_char; 32],
    /// Its unit, UTF-8, ending with a zero; empty for a pure number.
    pub unit: [c_char; 16],
    /// Least value for which the tables hold.
    pub low: f32,
    /// Largest value for which they hold.
    pub high: f32,
    /// The value under which the model was calibrated.
    pub reference: f32,
}

/// A model as it is used: of the fitted pose, or of another one.
pub enum Used {
    Fitted(Tuned<'static>),
    Posed(Posed<'static>),
}

/// Mark of a model that was loaded.
const LOADED: u32 = 0x4650_4d21;

/// What is inside of a `fingerpad_model`.
#[repr(C)]
pub struct Loaded {
    /// Read before anything else: whatever lies there is a number.
    mark: u32,
    /// Whether there is a pose other than the fitted one.
    pose: Option<Pose>,
    tuning: Tuning,
    pub used: Used,
    /// None if the file has effects that this library does not know.
    pub effects: Option<Effects<'static>>,
    /// Number of effects in the file.
    slots: u32,
    /// Columns of the user's own.
    pub columns: &'static [TableColumn],
    meta: &'static str,
}

const _: () = {
    assert!(size_of::<Loaded>() <= size_of::<fingerpad_model>());
    assert!(align_of::<Loaded>() <= align_of::<fingerpad_model>());
};

/// Does the same with a model of the fitted pose and with one of another pose.
macro_rules! with_model {
    ($loaded:expr, $model:ident => $action:expr) => {
        match &$loaded.used {
            $crate::model::Used::Fitted($model) => $action,
            $crate::model::Used::Posed($model) => $action,
        }
    };
}
pub(crate) use with_model;

impl Loaded {
    /// The numbers of the file.
    fn model(&self) -> Model<'static> {
        with_model!(self, model => model.data().model_unchecked())
    }

    /// The same finger and pose after a change of either.
    fn use_as(&mut self, tuning: Tuning, pose: Option<Pose>) -> Result<(), i32> {
        let tuned = self.model().tuned(tuning).map_err(code)?;
        self.used = match pose {
            None => Used::Fitted(tuned),
            Some(pose) => Used::Posed(tuned.posed(pose).map_err(code)?),
        };
        (self.tuning, self.pose) = (tuning, pose);
        Ok(())
    }

    /// Checksum of the numbers.
    pub fn checksum(&self) -> u32 {
        with_model!(self, model => model.data().checksum())
    }
}

/// A model that was loaded.
#[inline(always)]
pub unsafe fn loaded<'a>(model: *const fingerpad_model) -> Result<&'a Loaded, i32> {
    // SAFETY: the caller's promise; the mark is a number whatever lies there.
    if *unsafe { shared(model.cast::<u32>()) }? != LOADED {
        return Err(FINGERPAD_NOT_SET_UP);
    }
    // SAFETY: the mark stands only where `fingerpad_model_load` has written, or in a copy of that.
    unsafe { shared(model.cast::<Loaded>()) }
}

/// The same to change.
unsafe fn loaded_mut<'a>(model: *mut fingerpad_model) -> Result<&'a mut Loaded, i32> {
    // SAFETY: as for `loaded`.
    unsafe { loaded(model) }?;
    // SAFETY: as for `loaded`.
    unsafe { exclusive(model.cast::<Loaded>()) }
}

/// Checks a model file and prepares a model that reads it in place: `length` bytes at an address divisible by 4, which live and
/// stay unchanged as long as the model. Takes some 20 instructions a byte.
///
/// Returns FINGERPAD_OK, or why the file is refused; then the model is as one that was unloaded.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_load(model: *mut fingerpad_model, file: *const u8, length: usize) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { load(model, file, length) })
}

unsafe fn load(model: *mut fingerpad_model, file: *const u8, length: usize) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    unsafe { write(model, fingerpad_model { opaque: [0; 34] }) }?;
    if file.is_null() {
        return Err(FINGERPAD_NULL);
    }
    // SAFETY: the caller's promise.
    let bytes = unsafe { items(file, length) }?;
    let file = File::from_bytes(bytes).map_err(code)?;
    let tuning = Tuning::default();
    let tuned = file.model.tuned(tuning).map_err(code)?;
    let effects = Effects::of_file(&file).ok();
    let (slots, columns, meta) = (file.effects.len() as u32, file.columns, file.meta);
    let inside = Loaded { mark: LOADED, pose: None, tuning, used: Used::Fitted(tuned), effects, slots, columns, meta };
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(model.cast::<Loaded>(), inside) }
}

/// Marks a model as not set up, so that using it after its file is gone is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_unload(model: *mut fingerpad_model) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write(model, fingerpad_model { opaque: [0; 34] }) })
}

/// Changes the model to another finger, counted from the fitted one: factors on size (0.5 to 2), tissue stiffness (0.2 to 5)
/// and lambda (0.1 to 10), and tau_0 in MPa (0 to 0.1). The pose stays.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_tune(
    model: *mut fingerpad_model,
    size: f32,
    stiffness: f32,
    lambda: f32,
    tau0_mpa: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_mut(model) }.and_then(|model| {
        let pose = model.pose;
        model.use_as(Tuning { size, stiffness, lambda, tau0_mpa }, pose)
    }))
}

/// Brings the model into another pose: pitch of the finger against the plane, 10 to 70 degrees, and roll, -30 to 30. A state
/// may be carried over. The fitted pose is `fitted_pitch_deg` of `fingerpad_model_info` with roll 0.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a pose out of range or a model that knows one pose alone; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_pose(model: *mut fingerpad_model, pitch_deg: f32, roll_deg: f32) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_mut(model) }.and_then(|model| {
        let is_fitted = pitch_deg == model.model().data().pose.pitch_deg && roll_deg == 0.0;
        let tuning = model.tuning;
        model.use_as(tuning, if is_fitted { None } else { Some(Pose { pitch_deg, roll_deg }) })
    }))
}

/// What a model file says of itself.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_describe(
    model: *const fingerpad_model,
    info: *mut fingerpad_model_info,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded(model) }.and_then(|loaded| {
        let pose = &loaded.model().data().pose;
        let says = fingerpad_model_info {
            depth_max_mm: with_model!(loaded, model => model.depth_max_mm()),
            fitted_pitch_deg: pose.pitch_deg,
            knows_poses: u32::from(pose.knows_poses()),
            effects: loaded.slots,
            checksum: loaded.checksum(),
            meta: loaded.meta.as_ptr().cast(),
            meta_length: loaded.meta.len(),
            own_columns: loaded.columns.len() as u32,
        };
        // SAFETY: the caller's promise.
        unsafe { write(info, says) }
    }))
}

/// Column `index` of the user's own that tables of the file read. Its value goes to `own[index]` of the surroundings.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE where the file has no column of that index; then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_own_column(
    model: *const fingerpad_model,
    index: u32,
    column: *mut fingerpad_own_column,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded(model) }.and_then(|loaded| {
        let found = loaded.columns.get(index as usize).ok_or(FINGERPAD_RANGE)?;
        let (name, unit) = found.bytes();
        let says = fingerpad_own_column {
            name: name.map(|byte| byte as c_char),
            unit: unit.map(|byte| byte as c_char),
            low: found.low,
            high: found.high,
            reference: found.reference,
        };
        // SAFETY: the caller's promise.
        unsafe { write(column, says) }
    }))
}
