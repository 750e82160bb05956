//! A contact from the pose of a body in the finger's frame: pose in, force and moment on finger and body out.
//!
//! Main functions: [`set_shape`], [`step_frame`]. Uses the pad in use and the core's frames. Poses are in double precision.

use fingerpad::Error;
use fingerpad::frames::{FrameContact, FrameResponse, Shape};
use fingerpad::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use fingerpad::pad::RelaxingPadState;

use crate::{PATCHES, RESULT, Shared, finger, words};

/// Numbers of a pose, more than a shape has; see [`pose`].
const POSE: usize = 7;
/// Words of a response in frames before those of the model; see [`frame_result`].
const FRAME: usize = 16;

/// Memory of one contact.
type Contact = FrameContact<RelaxingPadState<PATCHES>>;

static NUMBERS: Shared<[f64; POSE]> = Shared::new([0.0; POSE]);
static CONTACT: Shared<Option<Contact>> = Shared::new(None);
static FRAME_RESULT: Shared<[u32; FRAME + RESULT]> = Shared::new([0; FRAME + RESULT]);

/// Ends the contact: the pad that it belongs to is no longer in use.
pub fn forget() {
    // SAFETY: one thread, and nothing else borrows it.
    unsafe { *CONTACT.0.get() = None }
}

/// Where the numbers of a call of [`set_shape`] or [`step_frame`] are written, 64-bit floats: the sizes of a shape; or a pose of the body in
/// the finger's frame, x, y, z, mm, and quaternion w, x, y, z.
#[unsafe(no_mangle)]
pub extern "C" fn pose() -> *mut f64 {
    NUMBERS.0.get().cast()
}

/// Where [`step_frame`] writes: force, N, and moment, N mm, on the finger in its frame, then on the body in its own; depth, mm; pitch and
/// roll, degrees; the face as a whole number; then a response as in [`crate::results`].
#[unsafe(no_mangle)]
pub extern "C" fn frame_result() -> *const u32 {
    FRAME_RESULT.0.get().cast_const().cast()
}

/// Begins a contact with a body of a shape: a plane (0), a sphere (1), an ellipsoid (2), a capsule (3), a cylinder (4), an edge (5) or a box
/// (6). At [`pose`] are three sizes, mm, the radius of a box's edges, mm, and the angle of an edge, degrees, as in the C header. Returns 0;
/// or 1 for numbers of which no shape can be made, and then everything stays as it was.
#[unsafe(no_mangle)]
pub extern "C" fn set_shape(kind: u32) -> u32 {
    let Some(finger) = finger() else { return 1 };
    // SAFETY: one thread; the page writes between calls only, and nothing else borrows these.
    let (numbers, contact) = unsafe { (&*NUMBERS.0.get(), &mut *CONTACT.0.get()) };
    let begun = shape(kind, numbers).and_then(|shape| FrameContact::new(&finger.pad, shape));
    let Ok(begun) = begun else { return 1 };
    *contact = Some(begun);
    0
}

fn shape(kind: u32, &[a, b, c, edge_radius_mm, angle_deg, ..]: &[f64; POSE]) -> Result<Shape, Error> {
    match kind {
        0 => Ok(Shape::plane()),
        1 => Shape::sphere(a),
        2 => Shape::ellipsoid([a, b, c]),
        3 => Shape::capsule(a, b),
        4 => Shape::cylinder(a, b),
        5 => Shape::edge(a, angle_deg),
        6 => Shape::cuboid([a, b, c], edge_radius_mm),
        _ => Err(Error::Curved),
    }
}

/// Moves the contact on by one step of `dt_s` to the pose at [`pose`]; returns how many steps were made. Cannot fail, whatever the numbers.
///
/// * `strength_factor`: on the friction, 0.1 to 5 (held there), kept for later steps; NaN leaves it as it was
#[unsafe(no_mangle)]
pub extern "C" fn step_frame(dt_s: f32, strength_factor: f32) -> u32 {
    // SAFETY: one thread; the page writes between calls only, and nothing else borrows these.
    let (numbers, contact, out) = unsafe { (&*NUMBERS.0.get(), &mut *CONTACT.0.get(), &mut *FRAME_RESULT.0.get()) };
    let (Some(finger), Some(contact)) = (finger(), contact) else { return 0 };
    contact.state_mut().set_strength_factor(strength_factor);
    let &[x, y, z, w, i, j, k] = numbers;
    // A quaternion that is not of unit length is found out in the step.
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    let body = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    *out = frame_words(&contact.step(&finger.pad, &body, dt_s));
    1
}

fn frame_words(r: &FrameResponse) -> [u32; FRAME + RESULT] {
    let wrenches = [r.on_finger.force_n, r.on_finger.moment_n_mm, r.on_body.force_n, r.on_body.moment_n_mm];
    let [pitch_deg, roll_deg] = r.pose_deg;
    let numbers = wrenches.iter().flatten().copied().chain([r.depth_mm, pitch_deg, roll_deg]).map(f32::to_bits);
    let all = numbers.chain([u32::from(r.face)]).chain(words(&r.response, r.response.status));
    let mut out = [0; FRAME + RESULT];
    for (word, number) in out.iter_mut().zip(all) {
        *word = number;
    }
    out
}
