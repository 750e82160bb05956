//! The model file of a pad in use: load, tune, describe, and the rigid bodies that it touches.

use core::ffi::c_char;

use fingerpad::pad::{Body, Cylinder, Edge, Pad, PadFile, Sphere};
use fingerpad::{BRANCHES, Branch, Relaxation, Tuning};

use crate::codes::{FINGERPAD_NOT_SET_UP, FINGERPAD_NULL, FINGERPAD_RANGE, FINGERPAD_SHAPE, answer, code};
use crate::pad_state::state_bytes;
use crate::pad_steps::{RELAXING, Steps};
use crate::pointer::{exclusive, items, shared, write};

/// Patches of the usual pad.
pub const FEW: usize = 37;
/// Most patches of a pad, two more than the program `fingerpad finger` makes at most.
pub const FINGERPAD_PATCHES_MAX: usize = 64;
/// Most branches of tissue that relaxes.
pub const FINGERPAD_BRANCHES_MAX: usize = 3;
const _: () = assert!(FINGERPAD_BRANCHES_MAX == BRANCHES);

/// A plane: the value of `kind` in a body.
pub const FINGERPAD_BODY_PLANE: u32 = 0;
/// A sphere; a bowl with a negative radius.
pub const FINGERPAD_BODY_SPHERE: u32 = 1;
/// A circular cylinder along the tangent plane; a trough with a negative radius.
pub const FINGERPAD_BODY_CYLINDER: u32 = 2;
/// Two planes that meet in a rounded edge, which points at the finger.
pub const FINGERPAD_BODY_EDGE: u32 = 3;

/// The model file of a pad in use: every pose of the finger, on planes, spheres, cylinders and edges. Set it up with
/// `fingerpad_pad_load`; the file must stay where it is. May be copied, and read by several threads as long as none changes it.
#[repr(C)]
pub struct fingerpad_pad {
    opaque: [u64; 14],
}

/// What a pad's file says of itself.
#[repr(C)]
pub struct fingerpad_pad_info {
    /// Number of patches of skin.
    pub patches: u32,
    /// Largest depth for which the pad was fitted, mm, for the finger in use.
    pub depth_max_mm: f32,
    /// Pitch in which the finger's axes are those of the plane, degrees.
    pub neutral_pitch_deg: f32,
    /// Least pitch of the fit, degrees.
    pub pitch_min_deg: f32,
    /// Largest pitch of the fit, degrees.
    pub pitch_max_deg: f32,
    /// Largest roll of the fit to either side, degrees.
    pub roll_max_deg: f32,
    /// Checksum of the numbers; a saved state contains it.
    pub checksum: u32,
    /// Bytes of a saved state: 1312 for a pad of up to 37 patches, else FINGERPAD_PAD_STATE_BYTES. Of tissue that relaxes 2864, else
    /// FINGERPAD_RELAXING_PAD_STATE_BYTES.
    pub state_bytes: u32,
    /// The file's description, JSON in UTF-8 without an end mark, inside the file.
    pub meta: *const c_char,
    /// Its length in bytes.
    pub meta_length: usize,
    /// Number of branches of tissue that relaxes; 0 for tissue that does not. Their states are `fingerpad_relaxing_pad_state`.
    pub branches: u32,
}

/// A branch of tissue that relaxes: a stiffness that forgets.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_branch {
    /// Its stiffness over that of the relaxed tissue, 0 to 100.
    pub share: f32,
    /// The time in which it forgets, s: 1e-5 to 1e5.
    pub time_s: f32,
}

/// The rigid body that a pad touches. Its apex is the point with the tangent plane that depth, slide and pose refer to. Numbers
/// that a kind has no use for are not read.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_body {
    /// FINGERPAD_BODY_PLANE, FINGERPAD_BODY_SPHERE, FINGERPAD_BODY_CYLINDER or FINGERPAD_BODY_EDGE.
    pub kind: u32,
    /// Radius of sphere, cylinder or the edge's rounding, mm: 0.1 to 1e6. Negative for a bowl or a trough.
    pub radius_mm: f32,
    /// Direction of the axis of a cylinder or of an edge in the tangent plane, from x towards y, degrees: -180 to 180.
    pub axis_deg: f32,
    /// Angle between the faces of an edge inside the body, degrees: 1 to 179.
    pub angle_deg: f32,
}

/// Mark of a pad that was loaded.
const LOADED: u32 = 0x4650_5021;

/// What is inside of a `fingerpad_pad`.
#[repr(C)]
pub struct LoadedPad {
    /// Read before anything else: whatever lies there is a number.
    mark: u32,
    /// The pad as it is used.
    pub pad: Pad<'static>,
    meta: &'static str,
    /// `RELAXING`, where the pad comes from a function for tissue that relaxes.
    relaxing: Option<&'static [Steps; 2]>,
}

const _: () = {
    assert!(size_of::<LoadedPad>() <= size_of::<fingerpad_pad>());
    assert!(align_of::<LoadedPad>() <= align_of::<fingerpad_pad>());
};

impl LoadedPad {
    /// The kind of its states: whether the tissue relaxes, and whether they are of the smaller size.
    pub fn kind(&self) -> (bool, bool) {
        (self.pad.relaxation().is_some(), self.pad.patches.len() <= FEW)
    }

    /// The steps of its states where its tissue relaxes.
    pub fn relaxing_steps(&self) -> Result<Option<&'static Steps>, i32> {
        let (relaxes, is_small) = self.kind();
        if !relaxes {
            return Ok(None);
        }
        let [few, many] = self.relaxing.ok_or(FINGERPAD_NOT_SET_UP)?;
        Ok(Some(if is_small { few } else { many }))
    }

    /// Checksum of the numbers.
    pub fn checksum(&self) -> u32 {
        self.pad.checksum()
    }
}

impl fingerpad_body {
    /// The body, if its numbers are in range.
    pub fn checked(self) -> Result<Body, i32> {
        let Self { kind, radius_mm, axis_deg, angle_deg } = self;
        let body = match kind {
            FINGERPAD_BODY_PLANE => Ok(Body::Plane),
            FINGERPAD_BODY_SPHERE => Sphere::new(radius_mm).map(Body::Sphere),
            FINGERPAD_BODY_CYLINDER => Cylinder::new(radius_mm, axis_deg).map(Body::Cylinder),
            FINGERPAD_BODY_EDGE => Edge::new(radius_mm, axis_deg, angle_deg).map(Body::Edge),
            _ => return Err(FINGERPAD_RANGE),
        };
        body.map_err(|_| FINGERPAD_RANGE)
    }
}

/// A pad that was loaded.
#[inline(always)]
pub unsafe fn loaded_pad<'a>(pad: *const fingerpad_pad) -> Result<&'a LoadedPad, i32> {
    // SAFETY: the caller's promise; the mark is a number whatever lies there.
    if *unsafe { shared(pad.cast::<u32>()) }? != LOADED {
        return Err(FINGERPAD_NOT_SET_UP);
    }
    // SAFETY: the mark stands only where `fingerpad_pad_load` has written, or in a copy of that.
    unsafe { shared(pad.cast::<LoadedPad>()) }
}

/// Checks a pad's model file and prepares a pad that reads it in place: `length` bytes at an address divisible by 4, which live
/// and stay unchanged as long as the pad. Takes some 20 instructions a byte.
///
/// Returns FINGERPAD_OK, or why the file is refused; then the pad is as one that was unloaded. FINGERPAD_SECTION: the file has no
/// pad in it; if it is the file of a bed, use `fingerpad_model_load`. FINGERPAD_SHAPE: more than FINGERPAD_PATCHES_MAX patches.
/// A pad whose file has branches can be described; for contacts of it use `fingerpad_relaxing_pad_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_load(pad: *mut fingerpad_pad, file: *const u8, length: usize) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { load(pad, file, length, None) })
}

/// The same, also for contacts of tissue that relaxes by the branches of its file. Only a program with this function or `fingerpad_pad_relax`
/// contains the steps of such tissue.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_pad_load(pad: *mut fingerpad_pad, file: *const u8, length: usize) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { load(pad, file, length, Some(&RELAXING)) })
}

unsafe fn load(
    pad: *mut fingerpad_pad,
    file: *const u8,
    length: usize,
    relaxing: Option<&'static [Steps; 2]>,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    unsafe { write(pad, fingerpad_pad { opaque: [0; 14] }) }?;
    if file.is_null() {
        return Err(FINGERPAD_NULL);
    }
    // SAFETY: the caller's promise.
    let bytes = unsafe { items(file, length) }?;
    let file = PadFile::from_bytes(bytes).map_err(code)?;
    if file.pad.patches.len() > FINGERPAD_PATCHES_MAX {
        return Err(FINGERPAD_SHAPE);
    }
    let inside = LoadedPad { mark: LOADED, pad: file.pad, meta: file.meta, relaxing };
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(pad.cast::<LoadedPad>(), inside) }
}

/// Marks a pad as not set up, so that using it after its file is gone is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_unload(pad: *mut fingerpad_pad) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write(pad, fingerpad_pad { opaque: [0; 14] }) })
}

/// Changes the pad to another finger, counted from the fitted one: factors on size (0.5 to 2), tissue stiffness (0.2 to 5) and
/// lambda (0.1 to 10). A state belongs to one tuning: initialise it again afterwards.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_tune(pad: *mut fingerpad_pad, size: f32, stiffness: f32, lambda: f32) -> i32 {
    let tuned = || {
        // SAFETY: the caller's promise.
        let in_use = unsafe { loaded_pad(pad) }?.pad.tuned(Tuning { size, stiffness, lambda }).map_err(code)?;
        // SAFETY: as for `loaded_pad`.
        let inside = unsafe { exclusive(pad.cast::<LoadedPad>()) }?;
        inside.pad = in_use;
        Ok(())
    };
    answer(tuned())
}

/// The branches of a list, checked.
pub fn relaxation_of(branches: &[fingerpad_branch]) -> Result<Relaxation, i32> {
    let mut list = [Branch::default(); BRANCHES];
    let used = list.get_mut(..branches.len()).ok_or(FINGERPAD_SHAPE)?;
    for (slot, branch) in used.iter_mut().zip(branches) {
        *slot = Branch { share: branch.share, time_s: branch.time_s };
    }
    Relaxation::new(used).map_err(code)
}

/// Gives the tissue other branches than the file's, at most FINGERPAD_BRANCHES_MAX; none with a `count` of 0. Held at a depth the force then
/// falls as 1 plus the sum of share times exp(-t / time). A state belongs to one such choice: initialise it again afterwards.
///
/// The times 0.004, 0.07 and 1.4 s are those of a human finger (Pawluk and Howe 1999). Shares of 1, 0.6 and 0.6 are assumed: measure them.
///
/// Returns FINGERPAD_OK, or FINGERPAD_SHAPE for too many, FINGERPAD_RANGE; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_relax(
    pad: *mut fingerpad_pad,
    branches: *const fingerpad_branch,
    count: usize,
) -> i32 {
    let relaxed = || {
        // SAFETY: the caller's promise.
        let (loaded, branches) = unsafe { (loaded_pad(pad)?, items(branches, count)?) };
        let in_use = loaded.pad.with_relaxation(relaxation_of(branches)?);
        // SAFETY: as for `loaded_pad`.
        let inside = unsafe { exclusive(pad.cast::<LoadedPad>()) }?;
        (inside.pad, inside.relaxing) = (in_use, Some(&RELAXING));
        Ok(())
    };
    answer(relaxed())
}

/// What a pad's file says of itself.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_describe(pad: *const fingerpad_pad, info: *mut fingerpad_pad_info) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad) }.and_then(|loaded| {
        let fitted = &loaded.pad;
        let [pitch_min_deg, pitch_max_deg] = fitted.numbers.pitch_range_deg;
        let says = fingerpad_pad_info {
            patches: fitted.patches.len() as u32,
            depth_max_mm: loaded.pad.depth_max_mm(),
            neutral_pitch_deg: fitted.numbers.neutral_pitch_deg,
            pitch_min_deg,
            pitch_max_deg,
            roll_max_deg: fitted.numbers.roll_max_deg,
            checksum: loaded.checksum(),
            state_bytes: state_bytes(loaded) as u32,
            meta: loaded.meta.as_ptr().cast(),
            meta_length: loaded.meta.len(),
            branches: fitted.relaxation().branches().iter().filter(|branch| branch.share != 0.0).count() as u32,
        };
        // SAFETY: the caller's promise.
        unsafe { write(info, says) }
    }))
}

/// The point of the undeformed finger that a plane touches first in a pose, into an array of three numbers: mm along the finger's
/// axes from the finger's origin, which touches first in the neutral pose (within 0.1 mm, the error of the fit). Depth 0 of a pose
/// is where the plane passes through this point. A pose beyond those of the fit gives the point of the nearest of them.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE if the pitch or the roll is NaN or infinite; then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_pad_first_touch(
    pad: *const fingerpad_pad,
    pitch_deg: f32,
    roll_deg: f32,
    place_mm: *mut f32,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad) }.and_then(|loaded| {
        if !(pitch_deg.is_finite() && roll_deg.is_finite()) {
            return Err(FINGERPAD_RANGE);
        }
        // SAFETY: the caller's promise; an array of three is aligned as its numbers.
        unsafe { write(place_mm.cast::<[f32; 3]>(), loaded.pad.first_touch_point_mm([pitch_deg, roll_deg])) }
    }))
}
