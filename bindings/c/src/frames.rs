//! One finger against one rigid body from the frames of both: a pose in, wrenches out.

use fingerpad::frames::{Finger, FrameContact, FramePatch, FrameResponse, RoundBed, Shape, Wrench};
use fingerpad::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use fingerpad::pad::{Memory, Pad, PadState};
use fingerpad::{Error, RelaxingState, SPRINGS, SpinState, StateOf};

use crate::codes::{FINGERPAD_BUFFER, FINGERPAD_NOT_SET_UP, FINGERPAD_RANGE, answer, code};
use crate::model::{fingerpad_model, loaded_any};
use crate::pad::{LoadedPad, fingerpad_pad, loaded_pad};
use crate::pad_state::{Few, Kind, Many, RelaxingFew, RelaxingMany, with_kind};
use crate::pad_steps::{by_kind, write_all};
use crate::pointer::{check, exclusive, shared, write};
use crate::state::Tissue;
use crate::types::fingerpad_response;

/// The plane z = 0, the body below it: the value of `kind` in a shape. It has no sizes.
pub const FINGERPAD_SHAPE_PLANE: u32 = 0;
/// A sphere about the origin; `size_mm[0]` is its radius.
pub const FINGERPAD_SHAPE_SPHERE: u32 = 1;
/// An ellipsoid about the origin; `size_mm` are its semi-axes along x, y and z.
pub const FINGERPAD_SHAPE_ELLIPSOID: u32 = 2;
/// A cylinder about z with round ends; `size_mm` are its radius and half its length without the ends.
pub const FINGERPAD_SHAPE_CAPSULE: u32 = 3;
/// A cylinder about z with flat ends; `size_mm` are its radius and half its length.
pub const FINGERPAD_SHAPE_CYLINDER: u32 = 4;
/// Two faces that meet in a rounded edge along x, on which the origin lies, z out between them; `size_mm[0]` is the radius of the rounding,
/// `angle_deg` the angle inside the body.
pub const FINGERPAD_SHAPE_EDGE: u32 = 5;
/// A box about the origin; `size_mm` are half its extents, `edge_radius_mm` rounds its edges.
pub const FINGERPAD_SHAPE_BOX: u32 = 6;

/// The shape of a rigid body in a frame of its own.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_shape {
    /// FINGERPAD_SHAPE_PLANE and so on.
    pub kind: u32,
    /// Sizes as the kind states, mm: 0.1 to 1e6.
    pub size_mm: [f64; 3],
    /// Radius of the edges of a box, mm: 0.1 to 1e6.
    pub edge_radius_mm: f64,
    /// Angle between the faces of an edge, degrees: 1 to 179.
    pub angle_deg: f64,
}

/// Pose of a body in the finger's frame. That frame is the bone's: x along the finger from proximal to distal, z out of the pad's surface
/// into the finger, y to complete a right-handed frame; the origin is where a plane first touches in the neutral pose.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_pose {
    /// Place of the body's origin, mm.
    pub position_mm: [f64; 3],
    /// Its orientation, in the order w, x, y, z, of unit length: rotates vectors of the body's frame into the finger's.
    pub quaternion: [f64; 4],
}

/// Force and moment about the origin of a frame, along its axes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_wrench {
    /// Force, N.
    pub force_n: [f32; 3],
    /// Moment, N mm.
    pub moment_n_mm: [f32; 3],
}

/// Forces and state of a contact after a step.
#[repr(C)]
pub struct fingerpad_frame_response {
    /// What the body exerts on the finger, in the finger's frame.
    pub on_finger: fingerpad_wrench,
    /// What the finger exerts on the body, in the body's frame.
    pub on_body: fingerpad_wrench,
    /// Depth of the body in the finger as the model has it, mm; 0 where the finger stands over no face.
    pub depth_mm: f32,
    /// Pitch of the finger against the face, degrees.
    pub pitch_deg: f32,
    /// Its roll, degrees.
    pub roll_deg: f32,
    /// The face: 0 for none; 1 for a plane, a sphere, an ellipsoid and an edge; of a box 1 to 6 for +x, +y, +z, -x, -y, -z and 7 to 18 for
    /// its edges; of a capsule and a cylinder 1 for the side, 2 and 3 for the ends at +z and -z.
    pub face: u32,
    /// The response of the model, along the axes of the face's plane.
    pub response: fingerpad_response,
    /// Room for later fields; 0.
    pub reserved: [u32; 8],
}

/// One patch of the skin as a taxel of a tactile sensor. Over all patches of a pad the forces add up to `on_finger` of the response, and
/// `place_mm` x `force_n` plus `moment_n_mm` to its moment.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_frame_patch {
    /// Its middle in the finger's frame, mm: where the contact has moved it; of a finger in the air at rest.
    pub place_mm: [f32; 3],
    /// Force of the body on it along the axes of the finger's frame, N.
    pub force_n: [f32; 3],
    /// Moment of the body on it about its middle, N mm: pressure is not even over a patch.
    pub moment_n_mm: [f32; 3],
    /// Mean pressure over its own area, MPa; positive into the finger.
    pub pressure_mpa: f32,
    /// Mean friction over its own area along the finger and across it, MPa: along x and y of the face's plane, as `friction_x_n` and
    /// `friction_y_n` of a response.
    pub shear_mpa: [f32; 2],
    /// Its own area, mm².
    pub area_mm2: f32,
    /// Area of it in contact, mm².
    pub contact_area_mm2: f32,
    /// Stuck share of the area in contact: 1 stick, 0 slip and without contact.
    pub stick_ratio: f32,
    /// Friction over the largest friction that it can carry.
    pub used: f32,
}

/// All that a finger remembers of its contact with one body: room for any bed, and for any pad that does not relax. Set it up with
/// `fingerpad_frame_init_pad` or `fingerpad_frame_init_bed`. It belongs to one finger and one body. Plain memory: copy it, or its first
/// `fingerpad_frame_bytes`, to go back to it in the same program.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_frame_contact {
    opaque: [u64; 288],
}

/// The same for pads that relax. Set it up with `fingerpad_relaxing_frame_init_pad`, for any pad, and hand `&contact` of it to every function.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_relaxing_frame_contact {
    /// Its beginning, which stands for it.
    pub contact: fingerpad_frame_contact,
    more: [u64; 316],
}

/// What is inside of a `fingerpad_frame_contact`: numbers throughout, so that any bits are one.
#[repr(C)]
struct Marked<S> {
    mark: u32,
    room: u32,
    /// Of a bed: radius of its finger along and across, mm.
    radius_mm: [f32; 2],
    contact: FrameContact<S>,
}

impl<S: Held> Marked<S> {
    /// Bytes up to the end of the state, which is last.
    fn bytes(&self) -> usize {
        size_of::<Self>() - (size_of::<S>().next_multiple_of(align_of::<Self>()) - size_of::<S>())
    }

    fn reshape(&mut self, shape: Shape, moved: &Isometry3<f64>) -> Result<(), i32> {
        if !S::TOUCHES_CURVED && !shape.is_flat() {
            return Err(FINGERPAD_RANGE);
        }
        self.contact.reshape(shape, moved);
        Ok(())
    }
}

/// States that a contact may hold: the marks of such contacts, and whether the model touches curved faces.
trait Held: Clone {
    const MARK: u32;
    const TOUCHES_CURVED: bool;
}

impl<const P: usize, M: Memory<P, f32>> Held for PadState<P, f32, M> {
    // Another letter than that of a state alone.
    const MARK: u32 = <Self as Kind>::MARK ^ 0x1500;
    const TOUCHES_CURVED: bool = true;
}

impl<R: Tissue<2>> Held for StateOf<SPRINGS, 2, f32, R> {
    const MARK: u32 = if size_of::<R>() == 0 { 0x4650_4601 } else { 0x4650_4602 };
    const TOUCHES_CURVED: bool = false;
}

/// Radius of the finger of a bed, mm.
const ROUND_MM: f32 = 21.0;

const _: () = {
    assert!(size_of::<Marked<Many>>() <= size_of::<fingerpad_frame_contact>());
    assert!(size_of::<Marked<RelaxingMany>>() <= size_of::<fingerpad_relaxing_frame_contact>());
    assert!(size_of::<Marked<RelaxingState<2>>>() <= size_of::<fingerpad_frame_contact>());
    assert!(align_of::<Marked<RelaxingMany>>() <= align_of::<fingerpad_frame_contact>());
};

impl fingerpad_shape {
    fn checked(&self) -> Result<Shape, i32> {
        let [a, b, _] = self.size_mm;
        let shape = match self.kind {
            FINGERPAD_SHAPE_PLANE => Ok(Shape::plane()),
            FINGERPAD_SHAPE_SPHERE => Shape::sphere(a),
            FINGERPAD_SHAPE_ELLIPSOID => Shape::ellipsoid(self.size_mm),
            FINGERPAD_SHAPE_CAPSULE => Shape::capsule(a, b),
            FINGERPAD_SHAPE_CYLINDER => Shape::cylinder(a, b),
            FINGERPAD_SHAPE_EDGE => Shape::edge(a, self.angle_deg),
            FINGERPAD_SHAPE_BOX => Shape::cuboid(self.size_mm, self.edge_radius_mm),
            _ => return Err(FINGERPAD_RANGE),
        };
        shape.map_err(|_| FINGERPAD_RANGE)
    }
}

impl From<&fingerpad_pose> for Isometry3<f64> {
    fn from(pose: &fingerpad_pose) -> Self {
        let ([w, x, y, z], [along, across, up]) = (pose.quaternion, pose.position_mm);
        // A quaternion that is not of unit length is found out by whoever takes the pose.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        Isometry3::from_parts(Translation3::new(along, across, up), rotation)
    }
}

impl From<Wrench> for fingerpad_wrench {
    fn from(wrench: Wrench) -> Self {
        Self { force_n: wrench.force_n, moment_n_mm: wrench.moment_n_mm }
    }
}

impl From<FrameResponse> for fingerpad_frame_response {
    fn from(felt: FrameResponse) -> Self {
        let [pitch_deg, roll_deg] = felt.pose_deg;
        Self {
            on_finger: felt.on_finger.into(),
            on_body: felt.on_body.into(),
            depth_mm: felt.depth_mm,
            pitch_deg,
            roll_deg,
            face: felt.face.into(),
            response: felt.response.into(),
            reserved: [0; 8],
        }
    }
}

impl From<FramePatch> for fingerpad_frame_patch {
    fn from(patch: FramePatch) -> Self {
        Self {
            place_mm: patch.place_mm,
            force_n: patch.force_n,
            moment_n_mm: patch.moment_n_mm,
            pressure_mpa: patch.pressure_mpa,
            shear_mpa: patch.shear_mpa,
            area_mm2: patch.area_mm2,
            contact_area_mm2: patch.contact_area_mm2,
            stick_ratio: patch.stick_ratio,
            used: patch.used,
        }
    }
}

/// Writes a contact of a finger that touches nothing.
unsafe fn init<S: Held, F: Finger<S, Scalar = f32>>(
    finger: &F,
    shape: fingerpad_shape,
    contact: *mut fingerpad_frame_contact,
) -> Result<(), i32> {
    let fresh = FrameContact::new(finger, shape.checked()?).map_err(refused)?;
    let marked = Marked { mark: S::MARK, room: 0, radius_mm: [ROUND_MM; 2], contact: fresh };
    // SAFETY: the caller's promise; size and alignment were checked above.
    unsafe { write(contact.cast(), marked) }
}

fn refused(error: Error) -> i32 {
    if error == Error::Curved { FINGERPAD_RANGE } else { code(error) }
}

/// A contact to change, if it holds this state.
unsafe fn held<'a, S: Held>(contact: *mut fingerpad_frame_contact) -> Result<Option<&'a mut Marked<S>>, i32> {
    // SAFETY: the caller's promise; the mark is a number whatever lies there.
    if *unsafe { shared(contact.cast::<u32>()) }? != S::MARK {
        return Ok(None);
    }
    // SAFETY: the mark stands only where such a contact was written, or in a copy of that.
    Ok(Some(unsafe { exclusive(contact.cast::<Marked<S>>()) }?))
}

/// Does the same with a contact of a bed.
macro_rules! with_bed_contact {
    ($contact:expr, $held:ident => $action:expr) => {
        if let Some($held) = unsafe { held::<SpinState>($contact) }? {
            $action
        } else {
            let $held = unsafe { held::<RelaxingState<2>>($contact) }?.ok_or(FINGERPAD_NOT_SET_UP)?;
            $action
        }
    };
}

/// Does the same with a contact of any kind.
macro_rules! with_contact {
    ($contact:expr, $held:ident => $action:expr) => {
        if let Some($held) = unsafe { held::<Few>($contact) }? {
            $action
        } else if let Some($held) = unsafe { held::<Many>($contact) }? {
            $action
        } else if let Some($held) = unsafe { held::<RelaxingFew>($contact) }? {
            $action
        } else if let Some($held) = unsafe { held::<RelaxingMany>($contact) }? {
            $action
        } else {
            with_bed_contact!($contact, $held => $action)
        }
    };
}

/// A step, if the contact holds this state. Not inlined, so that a pad of few patches needs the stack of such a step alone.
#[inline(never)]
unsafe fn step<S: Held, F: Finger<S, Scalar = f32>>(
    finger: &F,
    contact: *mut fingerpad_frame_contact,
    body: &fingerpad_pose,
    dt_s: f32,
    response: *mut fingerpad_frame_response,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    let held = unsafe { held::<S>(contact) }?.ok_or(FINGERPAD_NOT_SET_UP)?;
    check(response)?;
    // SAFETY: the caller's promise.
    unsafe { write(response, held.contact.step(finger, &body.into(), dt_s).into()) }
}

/// The same of a pad.
pub unsafe fn frame_step<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    contact: *mut fingerpad_frame_contact,
    body: &fingerpad_pose,
    dt_s: f32,
    response: *mut fingerpad_frame_response,
) -> Result<(), i32> {
    // SAFETY: the caller's promise.
    unsafe { step::<PadState<P, f32, M>, Pad<'_>>(&pad.pad, contact, body, dt_s, response) }
}

/// The patches of a pad. Not inlined, as a step.
#[inline(never)]
pub unsafe fn frame_patches<const P: usize, M: Memory<P, f32>>(
    pad: &LoadedPad,
    contact: *const fingerpad_frame_contact,
    out: *mut fingerpad_frame_patch,
    count: usize,
) -> Result<(), i32> {
    // SAFETY: the caller's promise; nothing is changed.
    let held = unsafe { held::<PadState<P, f32, M>>(contact.cast_mut()) }?.ok_or(FINGERPAD_NOT_SET_UP)?;
    // SAFETY: the caller's promise.
    unsafe { write_all(pad, out, count, held.contact.patches(&pad.pad)) }
}

/// Does the same with the kind of state of a bed, `S`.
macro_rules! with_bed {
    ($model:expr, $S:ident => $action:expr) => {
        if $model.relaxes() {
            type $S = RelaxingState<2>;
            $action
        } else {
            type $S = SpinState;
            $action
        }
    };
}

/// A finger in the air that is to touch a body of this shape, with the model of a pad and a strength factor of 1.
///
/// Returns FINGERPAD_OK, or FINGERPAD_BUFFER for a pad whose tissue relaxes (use `fingerpad_relaxing_frame_init_pad`), FINGERPAD_RANGE for a
/// kind that is none or a size out of its range, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP for the pad; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_init_pad(
    pad: *const fingerpad_pad,
    shape: fingerpad_shape,
    contact: *mut fingerpad_frame_contact,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad) }.and_then(|pad| match pad.kind() {
        (true, _) => Err(FINGERPAD_BUFFER),
        // SAFETY: the caller's promise.
        kind => with_kind!(kind, S => unsafe { init::<S, _>(&pad.pad, shape, contact) }),
    }))
}

/// The same for any pad. FINGERPAD_NOT_SET_UP also as `fingerpad_relaxing_pad_state_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_relaxing_frame_init_pad(
    pad: *const fingerpad_pad,
    shape: fingerpad_shape,
    contact: *mut fingerpad_relaxing_frame_contact,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad) }.and_then(|pad| {
        pad.relaxing_steps()?;
        // SAFETY: the caller's promise.
        with_kind!(pad.kind(), S => unsafe { init::<S, _>(&pad.pad, shape, contact.cast()) })
    }))
}

/// The same with the model of a bed, which touches planes and the faces of boxes: FINGERPAD_RANGE for another shape. A bed is of one pose
/// of the finger. In another one its depth alone changes, by that of a round finger, see `fingerpad_frame_set_bed_radius`. Its tissue may
/// relax; initialise the contact again after `fingerpad_model_relax`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_init_bed(
    model: *const fingerpad_model,
    shape: fingerpad_shape,
    contact: *mut fingerpad_frame_contact,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_any(model) }.and_then(|model| {
        let bed = RoundBed::new(model.model());
        // SAFETY: the caller's promise.
        with_bed!(model, S => unsafe { init::<S, _>(&bed, shape, contact) })
    }))
}

/// As `fingerpad_state_set_strength_factor`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_set_strength_factor(
    contact: *mut fingerpad_frame_contact,
    factor: f32,
) -> i32 {
    let set = || {
        // SAFETY: the caller's promise.
        let used = with_contact!(contact, held => held.contact.state_mut().set_strength_factor(factor));
        if used == factor { Ok(()) } else { Err(FINGERPAD_RANGE) }
    };
    answer(set())
}

/// Sets the radius of a bed's finger along and across, mm: how depth changes when the finger tilts. A fresh contact has 21 mm.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a radius that is not within 0 and 1000 mm, FINGERPAD_NOT_SET_UP for any contact but one of a
/// bed, FINGERPAD_NULL or FINGERPAD_ALIGNMENT; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_set_bed_radius(
    contact: *mut fingerpad_frame_contact,
    along_mm: f32,
    across_mm: f32,
) -> i32 {
    let set = || {
        // SAFETY: the caller's promise.
        let used = with_bed_contact!(contact, held => &mut held.radius_mm);
        let radius_mm = [along_mm, across_mm];
        if !radius_mm.iter().all(|radius| (0.0..=1000.0).contains(radius)) {
            return Err(FINGERPAD_RANGE);
        }
        *used = radius_mm;
        Ok(())
    };
    answer(set())
}

/// Ends a contact, and has the body count as another shape from the next step on: for a body that is known by its shape near the finger
/// alone, such as a mesh. `moved` is the pose of the new shape's frame in that of the old one. The place of the finger and the strength factor
/// are kept.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a shape that cannot be, or that a bed does not touch, FINGERPAD_NOT_SET_UP, FINGERPAD_NULL or
/// FINGERPAD_ALIGNMENT; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_reshape(
    contact: *mut fingerpad_frame_contact,
    shape: fingerpad_shape,
    moved: *const fingerpad_pose,
) -> i32 {
    let reshaped = || {
        // SAFETY: the caller's promise.
        let moved = unsafe { shared(moved) }?.into();
        let shape = shape.checked()?;
        with_contact!(contact, held => held.reshape(shape, &moved))
    };
    answer(reshaped())
}

/// Bytes at the beginning of a contact that hold all that it remembers: copied into another one they are that contact. 0 for one that was not
/// set up.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_bytes(contact: *const fingerpad_frame_contact) -> usize {
    let bytes = || Ok::<_, i32>(with_contact!(contact.cast_mut(), held => held.bytes()));
    bytes().unwrap_or(0)
}

/// Moves a contact on by one step of `dt_s` seconds: `body` is the pose of the body in the finger's frame at its end. The library finds the
/// face that the finger meets, and turns the change of the pose into the motion of the model and its response into forces and moments.
///
/// A pose that is not finite, or a quaternion that is not of unit length within 0.05 %, is flagged as FINGERPAD_STATUS_BAD_INPUT and not
/// taken. A contact begins near the surface: no deeper than the finger came closer in the step, and 1 mm; else
/// FINGERPAD_STATUS_BEGAN_INSIDE, until slip has raised it to the surface. The first step takes the pose as it is.
///
/// Returns FINGERPAD_OK, or FINGERPAD_NOT_SET_UP, FINGERPAD_NULL or FINGERPAD_ALIGNMENT; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_step_pad(
    pad: *const fingerpad_pad,
    contact: *mut fingerpad_frame_contact,
    body: *const fingerpad_pose,
    dt_s: f32,
    response: *mut fingerpad_frame_response,
) -> i32 {
    let stepped = || {
        // SAFETY: the caller's promise.
        let (pad, body) = unsafe { (loaded_pad(pad)?, shared(body)?) };
        // SAFETY: the caller's promise.
        unsafe { by_kind!(frame_step(pad, contact, body, dt_s, response)) }
    };
    answer(stepped())
}

/// The same with the model of a bed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_step_bed(
    model: *const fingerpad_model,
    contact: *mut fingerpad_frame_contact,
    body: *const fingerpad_pose,
    dt_s: f32,
    response: *mut fingerpad_frame_response,
) -> i32 {
    let stepped = || {
        // SAFETY: the caller's promise.
        let (model, body) = unsafe { (loaded_any(model)?, shared(body)?) };
        // SAFETY: the caller's promise.
        let radius_mm = with_bed_contact!(contact, held => held.radius_mm);
        let bed = RoundBed { model: model.model(), radius_mm };
        // SAFETY: the caller's promise.
        with_bed!(model, S => unsafe { step::<S, _>(&bed, contact, body, dt_s, response) })
    };
    answer(stepped())
}

/// Writes the patches of a pad after the last step to an array of `count` patches: a tactile skin in the finger's frame. The first `patches`
/// of `fingerpad_pad_info` are written. Without contact all is 0 but place and area. Costs as much as a round of a step, and 2 to 8 kB more
/// stack than one.
///
/// The sums hold to rounding. On a curved face a patch that slips ends beside where its load was found: the sums are off by up to 2 % in that
/// step, and by rounding after a few steps at rest.
///
/// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `count` is less than that number, FINGERPAD_NOT_SET_UP also for a contact of another pad or of a
/// bed, which has no patches, FINGERPAD_NULL or FINGERPAD_ALIGNMENT; then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_frame_patches(
    pad: *const fingerpad_pad,
    contact: *const fingerpad_frame_contact,
    patches: *mut fingerpad_frame_patch,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { loaded_pad(pad).and_then(|pad| by_kind!(frame_patches(pad, contact, patches, count))) })
}
