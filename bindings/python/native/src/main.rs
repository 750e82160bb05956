//! The core without Python, for its tests and measurements.
//!
//! `native bed MODEL.fpm spin|plain` and `native pad PAD.fpm BODY RADIUS AXIS ANGLE PITCH ROLL` read rows of eight little-endian floats
//! (depth, slide x, slide y, spin, dt, strength factor, pitch, roll; beds pass the last two over) and write the nineteen words of each
//! response, and of a pad behind them the nine floats of each of its patches. PITCH and ROLL are the pose over the body's apex.
//! `native frames bed|pad MODEL.fpm SHAPE SIZE...` reads rows of nine little-endian doubles (position and quaternion w, x, y, z of the body in
//! the finger's frame, dt, strength factor) and writes 35 words: those of the response, force and moment on finger and body, depth, pitch,
//! roll, face.

use std::io::{BufWriter, Read, StdoutLock, Write};

use fingerpad::frames::{Finger, FrameContact, RoundBed, Shape};
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use fingerpad::pad::{Body, Cylinder, Edge, Memory, Pad, PadMemory, PadState, Plane, Sphere, Surface};
use fingerpad::{BedMemory, Model, Motion, RelaxingState, Response, SpinState, StateOf};

type Failure = Box<dyn std::error::Error>;

/// Patches of the pads that are stepped here.
const PATCHES: usize = 37;

type Relaxing = PadState<PATCHES, f32, PadMemory<PATCHES>>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["bed", model, spin] => {
            let file = load(model)?;
            let model = file.file().model;
            match (spin, model.relaxation().is_some()) {
                ("plain", false) => on_bed::<1, ()>(&model),
                ("plain", true) => on_bed::<1, BedMemory<4>>(&model),
                (_, false) => on_bed::<2, ()>(&model),
                (_, true) => on_bed::<2, BedMemory<4, 2>>(&model),
            }
        }
        ["pad", model, body, radius, axis, angle, pitch, roll] => {
            let file = PadModelFile::new(&std::fs::read(model)?)?;
            let pad = file.file().pad;
            let (radius_mm, axis_deg): (f32, f32) = (radius.parse()?, axis.parse()?);
            let pose = [pitch.parse()?, roll.parse()?];
            match body {
                "Plane" => over(&pad, &Plane, None),
                "Sphere" => over(&pad, &Sphere::new(radius_mm)?, Some(pose)),
                "Cylinder" => over(&pad, &Cylinder::new(radius_mm, axis_deg)?, Some(pose)),
                "Edge" => over(&pad, &Body::Edge(Edge::new(radius_mm, axis_deg, angle.parse()?)?), Some(pose)),
                _ => Err(format!("{body} is no body").into()),
            }
        }
        ["frames", kind, model, shape, ..] => {
            let sizes = words[4..].iter().map(|size| size.parse()).collect::<Result<Vec<f64>, _>>()?;
            let shape = match (shape, &sizes[..]) {
                ("plane", []) => Shape::plane(),
                ("sphere", &[radius]) => Shape::sphere(radius)?,
                ("cylinder", &[radius, half_length]) => Shape::cylinder(radius, half_length)?,
                ("cuboid", &[x, y, z, edge_radius]) => Shape::cuboid([x, y, z], edge_radius)?,
                _ => return Err(format!("{shape} of {sizes:?} is no shape").into()),
            };
            if kind == "bed" {
                let file = load(model)?;
                let model = file.file().model;
                let bed = RoundBed::new(model);
                return if model.relaxation().is_some() {
                    in_frames::<RelaxingState<2>, _>(&bed, shape, |state, factor| _ = state.set_strength_factor(factor))
                } else {
                    in_frames::<SpinState, _>(&bed, shape, |state, factor| _ = state.set_strength_factor(factor))
                };
            }
            let file = PadModelFile::new(&std::fs::read(model)?)?;
            let pad = file.file().pad;
            if pad.relaxation().is_some() {
                in_frames::<Relaxing, _>(&pad, shape, |state, factor| _ = state.set_strength_factor(factor))
            } else {
                in_frames::<PadState<PATCHES>, _>(&pad, shape, |state, factor| _ = state.set_strength_factor(factor))
            }
        }
        _ => Err("usage: native bed MODEL.fpm spin|plain, native pad PAD.fpm BODY RADIUS AXIS ANGLE PITCH ROLL, \
                  or native frames bed|pad MODEL.fpm SHAPE SIZE..."
            .into()),
    }
}

fn load(path: &str) -> Result<ModelFile, Failure> {
    Ok(ModelFile::relaxing(&std::fs::read(path)?)?)
}

/// Motion, strength factor and pose of every row on standard input.
fn rows() -> Result<Vec<(Motion, f32, [f32; 2])>, Failure> {
    let mut bytes = Vec::new();
    std::io::stdin().read_to_end(&mut bytes)?;
    let row = |row: &[u8; 32]| {
        let number = |i: usize| f32::from_le_bytes(std::array::from_fn(|k| row[4 * i + k]));
        let [depth_mm, x, y, spin_increment_rad, dt_s, strength, pitch, roll] = std::array::from_fn(number);
        (Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s }, strength, [pitch, roll])
    };
    Ok(bytes.as_chunks::<32>().0.iter().map(row).collect())
}

fn on_bed<const P: usize, R: fingerpad::Memory<4, P, f32>>(model: &Model) -> Result<(), Failure> {
    let mut state = StateOf::<4, P, f32, R>::default();
    let mut out = BufWriter::new(std::io::stdout().lock());
    for (motion, strength, _) in rows()? {
        state.set_strength_factor(strength);
        write(&mut out, &words(&model.step(&mut state, motion)))?;
    }
    Ok(out.flush()?)
}

/// A pad on a body in a pose, with the memory that its tissue needs.
fn over(pad: &Pad<'_>, body: &impl Surface<f32>, pose: Option<[f32; 2]>) -> Result<(), Failure> {
    fn fresh<M: Memory<PATCHES, f32>>(
        pad: &Pad<'_>,
        pose: Option<[f32; 2]>,
    ) -> Result<PadState<PATCHES, f32, M>, Failure> {
        Ok(pose.map_or_else(|| PadState::fresh(pad), |pose| PadState::fresh_over(pad, pose))?)
    }
    if pad.relaxation().is_some() {
        on_pad(pad, body, fresh::<PadMemory<PATCHES>>(pad, pose)?)
    } else {
        on_pad(pad, body, fresh::<()>(pad, pose)?)
    }
}

fn on_pad<M: Memory<PATCHES, f32>>(
    pad: &Pad<'_>,
    body: &impl Surface<f32>,
    mut state: PadState<PATCHES, f32, M>,
) -> Result<(), Failure> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    for (motion, strength, pose) in rows()? {
        state.set_strength_factor(strength);
        write(&mut out, &words(&pad.step(&mut state, body, motion, pose)))?;
        for p in &pad.patch_states(&state, body)[..pad.patches.len()] {
            let ([x, y, z], [tx, ty]) = (p.place_mm, p.traction_mpa);
            let floats = [x, y, z, p.pressure_mpa, tx, ty, p.contact_area_mm2, p.stick_ratio, p.used];
            write(&mut out, &floats.map(f32::to_bits))?;
        }
    }
    Ok(out.flush()?)
}

fn in_frames<S: Clone, F: Finger<S, Scalar = f32>>(
    finger: &F,
    shape: Shape,
    set_strength_factor: impl Fn(&mut S, f32),
) -> Result<(), Failure> {
    let mut bytes = Vec::new();
    std::io::stdin().read_to_end(&mut bytes)?;
    let mut contact = FrameContact::new(finger, shape)?;
    let mut out = BufWriter::new(std::io::stdout().lock());
    for row in bytes.as_chunks::<8>().0.as_chunks::<9>().0 {
        let [x, y, z, w, i, j, k, dt_s, factor] = row.map(f64::from_le_bytes);
        let turn = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
        set_strength_factor(contact.state_mut(), factor as f32);
        let r = contact.step(finger, &Isometry3::from_parts(Translation3::new(x, y, z), turn), dt_s as f32);
        let (finger, body) = (r.on_finger, r.on_body);
        let wrenches = [finger.force_n, finger.moment_n_mm, body.force_n, body.moment_n_mm];
        write(&mut out, &words(&r.response))?;
        write(&mut out, &wrenches.concat().into_iter().map(f32::to_bits).collect::<Vec<_>>())?;
        write(&mut out, &[r.depth_mm, r.pose_deg[0], r.pose_deg[1]].map(f32::to_bits))?;
        write(&mut out, &[r.face.into()])?;
    }
    Ok(out.flush()?)
}

fn write(out: &mut BufWriter<StdoutLock>, words: &[u32]) -> std::io::Result<()> {
    words.iter().try_for_each(|word| out.write_all(&word.to_le_bytes()))
}

fn words(r: &Response) -> [u32; 19] {
    let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
    let first = [r.normal_force_n, x, y, r.spin_moment_n_mm, r.slip_margin, r.stick_ratio].map(f32::to_bits);
    let rest = [r.friction_limit_n, r.contact_area_mm2, centre_x, centre_y, r.band_normal_n, r.band_friction_n];
    let rest = rest.map(f32::to_bits);
    let mut words = [0; 19];
    words[..6].copy_from_slice(&first);
    words[6] = r.regime as u32;
    words[7] = r.status.0;
    words[8..14].copy_from_slice(&rest);
    let ([friction_x, friction_y], [about_x, about_y]) = (r.tangential_friction_n, r.tilt_moment_n_mm);
    words[14..].copy_from_slice(&[friction_x, friction_y, about_x, about_y, r.slip_margin_relaxed].map(f32::to_bits));
    words
}
