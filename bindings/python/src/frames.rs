//! Contacts of fingers with rigid bodies of one shape, from the poses of the bodies in the frames of the fingers.
//!
//! Main type: [`Placed`], for [`PadOf`] and [`BedOf`]. Uses the core's frames.

use std::marker::PhantomData;
use std::sync::Arc;

use fingerpad::frames::{Finger, FrameContact, FrameResponse, RoundBed, Shape};
use fingerpad::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use fingerpad::pad::{Memory, Pad as PadInPlace, PadState};
use fingerpad::{Error, NODES, SPRINGS, StateOf, Tuning};

use crate::bed::Tissue;
use crate::group::{FRAME_PATCH, Group, RESPONSE, Row, Watches, states, write_floats, write_response};
use crate::model::Bed;
use crate::pad::Tables;

/// Words of a response: those of the model, then force and moment on the finger and on the body, depth, pitch, roll, and the face.
pub const FRAMES: usize = RESPONSE + 16;

/// Position, mm, and quaternion (w, x, y, z) of a body in the frame of its finger.
pub type Pose = [f64; 7];

/// The shape of a kind from its sizes, which Python has checked.
pub fn shape(kind: &str, sizes: &[f64]) -> Option<Shape> {
    Some(match (kind, sizes) {
        ("plane", []) => Shape::plane(),
        ("sphere", &[radius]) => Shape::sphere(radius).ok()?,
        ("ellipsoid", &[x, y, z]) => Shape::ellipsoid([x, y, z]).ok()?,
        ("capsule", &[radius, half_length]) => Shape::capsule(radius, half_length).ok()?,
        ("cylinder", &[radius, half_length]) => Shape::cylinder(radius, half_length).ok()?,
        ("edge", &[radius, angle_deg]) => Shape::edge(radius, angle_deg).ok()?,
        ("cuboid", &[x, y, z, edge_radius]) => Shape::cuboid([x, y, z], edge_radius).ok()?,
        _ => return None,
    })
}

/// A model that owns its numbers.
pub trait Owner: Clone + Send + 'static {
    type State: Clone + Send;
    type Finger<'a>: Finger<Self::State, Scalar = f32>;
    /// The model in place.
    fn finger(&self) -> Result<Self::Finger<'_>, Error>;
    /// Depth, mm, and strength factor.
    fn depth_and_factor(&self, state: &Self::State) -> (f32, f32);
    fn set_strength_factor(state: &mut Self::State, factor: f32);
    /// The patches of contacts, [`FRAME_PATCH`] floats each; none of a bed.
    fn patches(&self, _contacts: &[FrameContact<Self::State>], _out: &mut [f32]) {}
}

/// A pad of at most `P` patches.
#[derive(Clone)]
pub struct PadOf<const P: usize, M> {
    pub tables: Arc<Tables>,
    pub tuning: Tuning,
    pub memory: PhantomData<M>,
}

impl<const P: usize, M: Memory<P, f32> + Send + 'static> Owner for PadOf<P, M> {
    type State = PadState<P, f32, M>;
    type Finger<'a> = PadInPlace<'a>;

    fn finger(&self) -> Result<PadInPlace<'_>, Error> {
        self.tables.pad().tuned(self.tuning)
    }
    fn depth_and_factor(&self, state: &Self::State) -> (f32, f32) {
        (self.finger().map_or(0.0, |pad| pad.depth_mm(state)), state.strength_factor())
    }
    fn set_strength_factor(state: &mut Self::State, factor: f32) {
        state.set_strength_factor(factor);
    }
    fn patches(&self, contacts: &[FrameContact<Self::State>], out: &mut [f32]) {
        let Ok(pad) = self.finger() else { return };
        for (contact, out) in contacts.iter().zip(out.chunks_exact_mut(FRAME_PATCH * pad.patches.len())) {
            for (p, out) in contact.patches(&pad).iter().zip(out.as_chunks_mut::<FRAME_PATCH>().0) {
                let vectors = [p.place_mm, p.force_n, p.moment_n_mm];
                let [x, y] = p.shear_mpa;
                out[..9].copy_from_slice(vectors.as_flattened());
                let rest = [p.pressure_mpa, x, y, p.area_mm2, p.contact_area_mm2, p.stick_ratio, p.used];
                out[9..].copy_from_slice(&rest);
            }
        }
    }
}

/// A bed of springs, with spin.
#[derive(Clone)]
pub struct BedOf<R> {
    pub bed: Bed,
    pub memory: PhantomData<R>,
}

impl<R: Tissue<2>> Owner for BedOf<R> {
    type State = StateOf<SPRINGS, 2, f32, R>;
    type Finger<'a> = RoundBed<'a, SPRINGS, NODES>;

    fn finger(&self) -> Result<RoundBed<'_, SPRINGS, NODES>, Error> {
        Ok(RoundBed::new(self.bed.model()?))
    }
    fn depth_and_factor(&self, state: &Self::State) -> (f32, f32) {
        (state.depth_mm(), state.strength_factor())
    }
    fn set_strength_factor(state: &mut Self::State, factor: f32) {
        state.set_strength_factor(factor);
    }
}

/// Contacts of a model, each with a body of its own, all of one shape.
#[derive(Clone)]
pub struct Placed<O: Owner> {
    owner: O,
    fresh: FrameContact<O::State>,
    contacts: Vec<FrameContact<O::State>>,
    watches: Watches,
}

impl<O: Owner> Placed<O> {
    /// Contacts in the air; none where there is no memory for them.
    pub fn new(owner: O, shape: Shape, count: usize) -> Result<Option<Self>, Error> {
        let fresh = FrameContact::new(&owner.finger()?, shape)?;
        let contacts = states(fresh.clone(), count);
        Ok(contacts.map(|contacts| Self { owner, fresh, contacts, watches: Watches::default() }))
    }
}

impl<O: Owner> Group for Placed<O> {
    fn steps_between_looks(&self) -> usize {
        1 << 10
    }

    fn step(&mut self, first: usize, row: &Row, out: &mut [u32]) -> Result<(), Error> {
        let finger = self.owner.finger()?;
        let contacts = self.contacts[first..].iter_mut().zip(row.poses).zip(out.chunks_exact_mut(FRAMES));
        for (i, ((contact, pose), out)) in contacts.enumerate() {
            if let Some(factor) = row.strength_factor.get(i) {
                O::set_strength_factor(contact.state_mut(), *factor);
            }
            write_frame(&contact.step(&finger, &isometry(pose), row.dt_s), out);
        }
        self.watches.look(first, out, FRAMES);
        Ok(())
    }

    fn state(&self) -> (Vec<f32>, Vec<f32>) {
        self.contacts.iter().map(|contact| self.owner.depth_and_factor(contact.state())).unzip()
    }

    fn reset(&mut self, which: &[bool]) {
        for (contact, _) in self.contacts.iter_mut().zip(which).filter(|(_, chosen)| **chosen) {
            *contact = self.fresh.clone();
        }
    }

    fn watches(&mut self) -> &mut Watches {
        &mut self.watches
    }

    fn copy(&self) -> Box<dyn Group> {
        Box::new(self.clone())
    }

    fn patches(&self, out: &mut [f32]) {
        self.owner.patches(&self.contacts, out);
    }

    fn patch_floats(&self) -> usize {
        FRAME_PATCH
    }
}

/// A pose as it is; the core checks its quaternion.
fn isometry(&[x, y, z, w, i, j, k]: &Pose) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)))
}

fn write_frame(r: &FrameResponse, out: &mut [u32]) {
    let (model, rest) = out.split_at_mut(RESPONSE);
    write_response(&r.response, model);
    let wrenches = [r.on_finger.force_n, r.on_finger.moment_n_mm, r.on_body.force_n, r.on_body.moment_n_mm];
    write_floats::<12>(std::array::from_fn(|k| wrenches[k / 3][k % 3]), rest);
    write_floats([r.depth_mm, r.pose_deg[0], r.pose_deg[1]], &mut rest[12..]);
    rest[15] = r.face.into();
}
