//! What the core answers of a pad, and a pad of more patches.

use bytemuck::Pod;
use fingerpad::frames::{Finger, FrameContact, FrameResponse, Shape};
use fingerpad::host::PadModelFile;
use fingerpad::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use fingerpad::pad::{Body, Cylinder, Edge, Memory, Pad, PadMemory, PadState, Patch, Sphere};
use fingerpad::{Error, Motion, Relaxation, Tuning};

use crate::answers::{RANGE, forces};
use crate::requests::words;

/// Patches up to which the C library's states are the small ones, and those for which the others have room.
const FEW: usize = 37;
const ROOM: usize = 64;
/// Patches that are halved.
const HALVED: usize = 20;

/// A pad of which the last patches lie there in two halves.
pub fn halved(file: &PadModelFile) -> Result<PadModelFile, Error> {
    let file = file.file();
    let (whole, split) = file.pad.patches.split_at(file.pad.patches.len() - HALVED);
    let half = |patch: &Patch| Patch {
        area_mm2: 0.5 * patch.area_mm2,
        compliance_mm_per_n: patch.compliance_mm_per_n.map(|c| 2.0 * c),
        ..*patch
    };
    let patches: Vec<Patch> = whole.iter().copied().chain(split.iter().flat_map(|patch| [half(patch); 2])).collect();
    let pad = Pad::new(&patches, file.pad.numbers);
    let mut bytes = vec![0; pad.file_length(file.meta)];
    pad.write_file(file.meta, &mut bytes)?;
    PadModelFile::new(&bytes)
}

/// A pad of which the tissue relaxes.
pub fn relaxing(file: &PadModelFile) -> Result<PadModelFile, Error> {
    let (pad, meta) = (file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED), file.file().meta);
    let mut bytes = vec![0; pad.file_length(meta)];
    pad.write_file(meta, &mut bytes)?;
    PadModelFile::new(&bytes)
}

/// A pad in use and a contact of it. States of both sizes, where both have room for it, must do the same.
struct PadTeller<'a, A, B> {
    file: &'a PadModelFile,
    pad: Pad<'a>,
    body: Body,
    state: Option<PadState<FEW, f32, A>>,
    roomy: PadState<ROOM, f32, B>,
    framed: FrameContact<PadState<ROOM, f32, B>>,
}

/// What a story asks of a pad.
pub trait TellsPad {
    fn patch_count(&self) -> usize;
    fn tune(&mut self, factors: [f32; 3]) -> String;
    fn begin(&mut self, kind: u32, numbers: [f32; 5]) -> String;
    fn factor(&mut self, factor: f32) -> String;
    fn step(&mut self, numbers: [f32; 7]) -> String;
    fn patches(&self) -> String;
    fn shape(&mut self, kind: u32, numbers: [f32; 5]) -> String;
    fn pose(&mut self, numbers: [f32; 8]) -> String;
    fn save(&mut self) -> String;
}

/// The teller of a file's pad.
pub fn teller(file: &PadModelFile) -> Box<dyn TellsPad + '_> {
    if file.file().pad.relaxation().is_some() {
        Box::new(PadTeller::<PadMemory<FEW>, PadMemory<ROOM>>::new(file))
    } else {
        Box::new(PadTeller::<(), ()>::new(file))
    }
}

/// A shape by its kind in `fingerpad.h`, if it can be.
pub fn shape_of(kind: u32, numbers: [f32; 5]) -> Option<Shape> {
    let [a, b, c, edge_radius_mm, angle_deg] = numbers.map(f64::from);
    let shape = match kind {
        0 => Ok(Shape::plane()),
        1 => Shape::sphere(a),
        2 => Shape::ellipsoid([a, b, c]),
        3 => Shape::capsule(a, b),
        4 => Shape::cylinder(a, b),
        5 => Shape::edge(a, angle_deg),
        6 => Shape::cuboid([a, b, c], edge_radius_mm),
        _ => return None,
    };
    shape.ok()
}

/// A step of a contact in frames.
pub fn pose<S: Clone, F: Finger<S, Scalar = f32>>(
    framed: &mut FrameContact<S>,
    finger: &F,
    numbers: [f32; 8],
) -> String {
    let [x, y, z, w, i, j, k, _] = numbers.map(f64::from);
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    let body = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    let FrameResponse { on_finger, on_body, depth_mm, pose_deg, face, response, .. } =
        framed.step(finger, &body, numbers[7]);
    let wrenches = [on_finger.force_n, on_finger.moment_n_mm, on_body.force_n, on_body.moment_n_mm].concat();
    words(&wrenches) + &words(&[depth_mm, pose_deg[0], pose_deg[1]]) + &format!(" {face}") + &forces(&response)
}

pub fn range(holds: bool) -> String {
    if holds { "0".to_owned() } else { RANGE.to_string() }
}

impl<'a, A: Memory<FEW, f32>, B: Memory<ROOM, f32>> PadTeller<'a, A, B> {
    fn new(file: &'a PadModelFile) -> Self {
        let fitted = file.file().pad;
        Self {
            file,
            pad: fitted,
            body: Body::Plane,
            state: PadState::fresh(&fitted).ok(),
            roomy: PadState::fresh(&fitted).expect("a pad of at most 64 patches"),
            framed: FrameContact::new(&fitted, Shape::plane()).expect("a pad of at most 64 patches"),
        }
    }
}

impl<A: Memory<FEW, f32> + Pod, B: Memory<ROOM, f32> + Pod> TellsPad for PadTeller<'_, A, B> {
    fn patch_count(&self) -> usize {
        self.pad.patches.len()
    }

    fn tune(&mut self, [size, stiffness, lambda]: [f32; 3]) -> String {
        match self.file.file().pad.tuned(Tuning { size, stiffness, lambda }) {
            Ok(pad) => self.pad = pad,
            Err(Error::Range { .. }) => return RANGE.to_string(),
            Err(other) => return other.to_string(),
        }
        range(true)
    }

    fn begin(&mut self, kind: u32, [radius_mm, axis_deg, angle_deg, pitch_deg, roll_deg]: [f32; 5]) -> String {
        let body = match kind {
            0 => Ok(Body::Plane),
            1 => Sphere::new(radius_mm).map(Body::Sphere),
            2 => Cylinder::new(radius_mm, axis_deg).map(Body::Cylinder),
            3 => Edge::new(radius_mm, axis_deg, angle_deg).map(Body::Edge),
            _ => return range(false),
        };
        let Ok(body) = body else { return range(false) };
        self.body = body;
        let (pose, pad) = ([pitch_deg, roll_deg], self.pad);
        let over_plane = kind == 0;
        self.state = if over_plane { PadState::fresh(&pad).ok() } else { PadState::fresh_over(&pad, pose).ok() };
        let roomy = if over_plane { PadState::fresh(&pad) } else { PadState::fresh_over(&pad, pose) };
        self.roomy = roomy.expect("a pad of at most 64 patches");
        range(true)
    }

    fn factor(&mut self, factor: f32) -> String {
        if !(0.1..=5.0).contains(&factor) {
            return range(false);
        }
        if let Some(state) = &mut self.state {
            state.set_strength_factor(factor);
        }
        self.roomy.set_strength_factor(factor);
        range(true)
    }

    fn step(&mut self, [depth_mm, x, y, spin_increment_rad, pitch, roll, dt_s]: [f32; 7]) -> String {
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s };
        let answered = forces(&self.pad.step(&mut self.roomy, &self.body, motion, [pitch, roll]));
        if let Some(state) = &mut self.state {
            let small = forces(&self.pad.step(state, &self.body, motion, [pitch, roll]));
            assert_eq!(answered, small, "room for more patches changes the answer");
        }
        answered
    }

    fn patches(&self) -> String {
        let patches = self.pad.patch_states(&self.roomy, &self.body);
        let row = |p: &fingerpad::pad::PatchState| {
            let ([x, y, z], [along, across]) = (p.place_mm, p.traction_mpa);
            words(&[x, y, z, p.pressure_mpa, along, across, p.contact_area_mm2, p.stick_ratio, p.used])
        };
        patches.iter().take(self.patch_count()).map(row).collect()
    }

    fn shape(&mut self, kind: u32, numbers: [f32; 5]) -> String {
        let Some(shape) = shape_of(kind, numbers) else { return range(false) };
        self.framed = FrameContact::new(&self.pad, shape).expect("a pad of at most 64 patches");
        range(true)
    }

    fn pose(&mut self, numbers: [f32; 8]) -> String {
        pose(&mut self.framed, &self.pad, numbers)
    }

    fn save(&mut self) -> String {
        let pad = self.pad.checksum();
        match &mut self.state {
            Some(state) => saved(pad, state),
            None => saved(pad, &mut self.roomy),
        }
    }
}

fn saved<const P: usize, M: Memory<P, f32> + Pod>(pad: u32, state: &mut PadState<P, f32, M>) -> String {
    let mut bytes = vec![0; PadState::<P, f32, M>::SAVED_BYTES];
    state.write_bytes(pad, &mut bytes).expect("the buffer has that length");
    *state = PadState::read_bytes(pad, &bytes).expect("what was written can be read");
    bytes.iter().fold(" ".to_owned(), |text, byte| text + &format!("{byte:02x}"))
}
