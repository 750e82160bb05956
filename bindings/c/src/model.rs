//! The model file of a bed in use: load, tune, describe.

use core::ffi::c_char;

use fingerpad::build::{EffectSlot, TableColumn};
use fingerpad::{Effects, File, Model, Relaxation, Tuning};

use crate::codes::{FINGERPAD_NOT_SET_UP, FINGERPAD_NULL, FINGERPAD_RANGE, answer, code};
use crate::pad::{fingerpad_branch, relaxation_of};
use crate::pointer::{exclusive, items, shared, write};

/// The model file of a bed of springs in use: one pose of the finger, on a plane. Set it up with `fingerpad_model_load`; the file
/// must stay where it is. May be copied, and read by several threads as long as none changes it.
#[repr(C)]
pub struct fingerpad_model {
    opaque: [u64; 18],
}

/// What a model file says of itself.
#[repr(C)]
pub struct fingerpad_model_info {
    /// Largest depth for which the model was fitted, mm, for the finger in use.
    pub depth_max_mm: f32,
    /// Pitch of the finger against the plane in the one pose that the model is of, degrees.
    pub pitch_deg: f32,
    /// Its roll, degrees.
    pub roll_deg: f32,
    /// Number of effects in the file.
    pub effects: u32,
    /// Checksum of the numbers; a saved state contains it.
    pub checksum: u32,
    /// The file's description, JSON in UTF-8 without an end mark, inside the file.
    pub meta: *const c_char,
    /// Its length in bytes.
    pub meta_length: usize,
    /// Number of columns of the user's own that tables of the file read; `fingerpad_model_own_column` describes each.
    pub own_columns: u32,
    /// Number of branches of tissue that relaxes; 0 for tissue that does not. Their states are `fingerpad_relaxing_state`.
    pub branches: u32,
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

/// Mark of a model that was loaded, and of one whose tissue relaxes.
const LOADED: u32 = 0x4650_4d21;
const RELAXING: u32 = 0x4650_4d22;

/// What is inside of a `fingerpad_model`.
#[repr(C)]
pub struct Loaded {
    /// Read before anything else: whatever lies there is a number.
    mark: u32,
    /// The model as it is used, without its branches.
    pub model: Model<'static>,
    /// None if the file has effects that this library does not know.
    pub effects: Option<Effects<'static>>,
    /// Effects in the file.
    slots: &'static [EffectSlot],
    /// Columns of the user's own.
    pub columns: &'static [TableColumn],
    meta: &'static str,
    relaxation: Relaxation,
}

const _: () = {
    assert!(size_of::<Loaded>() <= size_of::<fingerpad_model>());
    assert!(align_of::<Loaded>() <= align_of::<fingerpad_model>());
};

impl Loaded {
    /// The model as it is used. Its branches lie beside it, because it may be copied.
    #[inline(always)]
    pub fn model(&self) -> Model<'_> {
        self.model.with_relaxation_unchecked(&self.relaxation)
    }

    /// Checksum of the numbers and the branches.
    pub fn checksum(&self) -> u32 {
        self.model().checksum()
    }

    /// Whether its tissue relaxes.
    #[cfg(not(target_os = "none"))]
    pub fn relaxes(&self) -> bool {
        self.mark == RELAXING
    }

    /// Takes branches that were checked.
    fn relax(&mut self, relaxation: Relaxation) {
        self.relaxation = relaxation;
        self.mark = if relaxation.is_some() { RELAXING } else { LOADED };
    }
}

/// A model that was loaded and whose tissue does not relax.
#[inline(always)]
pub unsafe fn loaded<'a>(model: *const fingerpad_model) -> Result<&'a Loaded, i32> {
    // SAFETY: the caller's promise; the mark is a number whatever lies there.
    if *unsafe { shared(model.cast::<u32>()) }? != LOADED {
        return Err(FINGERPAD_NOT_SET_UP);
    }
    // SAFETY: the mark stands only where `fingerpad_model_load` has written, or in a copy of that.
    unsafe { shared(model.cast::<Loaded>()) }
}

/// The same of any tissue.
#[inline(always)]
pub unsafe fn loaded_any<'a>(model: *const fingerpad_model) -> Result<&'a Loaded, i32> {
    // SAFETY: as for `loaded`.
    if ![LOADED, RELAXING].contains(unsafe { shared(model.cast::<u32>()) }?) {
        return Err(FINGERPAD_NOT_SET_UP);
    }
    // SAFETY: as for `loaded`.
    unsafe { shared(model.cast::<Loaded>()) }
}

/// The same to change.
unsafe fn loaded_mut<'a>(model: *mut fingerpad_model) -> Result<&'a mut Loaded, i32> {
    // SAFETY: as for `loaded`.
    unsafe { loaded_any(model) }?;
    // SAFETY: as for `loaded`.
    unsafe { exclusive(model.cast::<Loaded>()) }
}

/// Checks a model file and prepares a model that reads it in place: `length` bytes at an address divisible by 4, which live and
/// stay unchanged as long as the model. Takes some 20 instructions a byte.
///
/// Returns FINGERPAD_OK, or why the file is refused; then the model is as one that was unloaded. FINGERPAD_SECTION: the file has
/// no bed in it; if it is the file of a pad, use `fingerpad_pad_load`, and if its tissue relaxes, `fingerpad_relaxing_model_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_load(model: *mut fingerpad_model, file: *const u8, length: usize) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { load(model, file, length, File::from_bytes) })
}

/// The same, also for tissue that relaxes by the branches of its file. With such tissue the functions of `fingerpad_relaxing_state`,
/// `fingerpad_relaxing_spin_state` and `fingerpad_frame_contact`, describe, tune and least grip work; all others return FINGERPAD_NOT_SET_UP.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_model_load(
    model: *mut fingerpad_model,
    file: *const u8,
    length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { load(model, file, length, File::relaxing) })
}

unsafe fn load(
    model: *mut fingerpad_model,
    file: *const u8,
    length: usize,
    read: fn(&'static [u8]) -> Result<File<'static>, fingerpad::Error>,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    unsafe { write(model, fingerpad_model { opaque: [0; 18] }) }?;
    if file.is_null() {
        return Err(FINGERPAD_NULL);
    }
    // SAFETY: the caller's promise.
    let bytes = unsafe { items(file, length) }?;
    let file = read(bytes).map_err(code)?;
    let effects = Effects::of_file(&file).ok();
    let (slots, columns, meta) = (file.effects, file.columns, file.meta);
    let relaxation = file.model.relaxation().copied().unwrap_or_else(Relaxation::none);
    let mut inside = Loaded { mark: LOADED, model: file.model, effects, slots, columns, meta, relaxation };
    inside.relax(relaxation);
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(model.cast::<Loaded>(), inside) }
}

/// Marks a model as not set up, so that using it after its file is gone is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_unload(model: *mut fingerpad_model) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write(model, fingerpad_model { opaque: [0; 18] }) })
}

/// Changes the model to another finger, counted from the fitted one: factors on size (0.5 to 2), tissue stiffness (0.2 to 5)
/// and lambda (0.1 to 10).
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_tune(
    model: *mut fingerpad_model,
    size: f32,
    stiffness: f32,
    lambda: f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_mut(model) }.and_then(|loaded| {
        let fitted = loaded.model.data().model_unchecked();
        loaded.model = fitted.tuned(Tuning { size, stiffness, lambda }).map_err(code)?;
        Ok(())
    }))
}

/// Gives the tissue other branches than the file's, as `fingerpad_pad_relax`; none with a `count` of 0. A state belongs to one such choice:
/// initialise it again afterwards. See `fingerpad_relaxing_model_load` for what works with such a model.
///
/// Returns FINGERPAD_OK, or FINGERPAD_SHAPE for too many, FINGERPAD_RANGE, also for shares with which a fast press would exceed the range of
/// the bed's springs, FINGERPAD_SECTION for a file with the effect `normal_relaxation`; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_relax(
    model: *mut fingerpad_model,
    branches: *const fingerpad_branch,
    count: usize,
) -> i32 {
    let relaxed = || {
        // SAFETY: the caller's promise.
        let (loaded, branches) = unsafe { (loaded_mut(model)?, items(branches, count)?) };
        let relaxation = relaxation_of(branches)?;
        let Loaded { model, slots: effects, columns, meta, .. } = *loaded;
        File { model, effects, tables: &[], columns, meta }.with_relaxation(&relaxation).map_err(code)?;
        loaded.relax(relaxation);
        Ok(())
    };
    answer(relaxed())
}

/// What a model file says of itself.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_model_describe(
    model: *const fingerpad_model,
    info: *mut fingerpad_model_info,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_any(model) }.and_then(|loaded| {
        let [pitch_deg, roll_deg] = loaded.model.data().pose_deg;
        let says = fingerpad_model_info {
            depth_max_mm: loaded.model.depth_max_mm(),
            pitch_deg,
            roll_deg,
            effects: loaded.slots.len() as u32,
            checksum: loaded.checksum(),
            meta: loaded.meta.as_ptr().cast(),
            meta_length: loaded.meta.len(),
            own_columns: loaded.columns.len() as u32,
            branches: loaded.relaxation.branches().iter().filter(|branch| branch.share != 0.0).count() as u32,
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
