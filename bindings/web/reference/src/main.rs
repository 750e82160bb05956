//! What the page must show, computed by the core on the host.
//!
//! ```text
//! fingerpad-web-reference steps PAD.fpm BODY MOTIONS        ten 32-bit floats a motion on; writes 15 words a response
//! fingerpad-web-reference path PAD.fpm BODY PATH.csv DT_S   a path of the body in steps of DT_S; likewise
//! fingerpad-web-reference refusal FILE                      why a file is no pad, in the core's words
//! fingerpad-web-reference bench PAD.fpm BODY MOTIONS        us a step, as JSON
//! ```
//!
//! BODY is kind, radius, axis, angle, pitch and roll, as in `2,10,90,0,30,0`: plane 0, sphere 1, cylinder 2, edge 3. After the last
//! response come the nine floats of each patch.

use std::error::Error;
use std::io::Write;
use std::time::Instant;

use fingerpad::effects::hydration_bell::HydrationBell;
use fingerpad::effects::speed_log::SpeedLog;
use fingerpad::effects::temperature::Temperature;
use fingerpad::effects::{Change, Conditions, Effect, VALUES};
use fingerpad::host::PadModelFile;
use fingerpad::pad::{Body, Cylinder, Edge, Pad, RelaxingPadState, Sphere};
use fingerpad::{Motion, Response, Status};

/// Patches of the pads that are stepped here.
const PATCHES: usize = 64;

type Failure = Box<dyn Error>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["steps", pad, body, motions] => write_out(&replay(&read(pad)?, body, &read_motions(motions)?)?),
        ["path", pad, body, path, dt] => write_out(&replay(&read(pad)?, body, &along(path, dt.parse()?)?)?),
        ["refusal", file] => {
            match PadModelFile::new(&std::fs::read(file)?) {
                Ok(_) => println!("accepted"),
                Err(error) => println!("{error}"),
            }
            Ok(())
        }
        ["bench", pad, body, motions] => bench(&read(pad)?, body, &read_motions(motions)?),
        _ => {
            Err("usage: steps PAD BODY MOTIONS | path PAD BODY PATH DT_S | refusal FILE | bench PAD BODY MOTIONS"
                .into())
        }
    }
}

fn read(pad: &str) -> Result<PadModelFile, Failure> {
    Ok(PadModelFile::new(&std::fs::read(pad)?)?)
}

fn read_motions(file: &str) -> Result<Vec<[f32; 10]>, Failure> {
    let bytes = std::fs::read(file)?;
    let numbers: Vec<f32> = bytes.chunks_exact(4).map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
    Ok(numbers.chunks_exact(10).map(|motion| std::array::from_fn(|i| motion[i])).collect())
}

/// A contact over a body, on a skin that changes.
struct Finger<'a> {
    pad: Pad<'a>,
    body: Body,
    contact: RelaxingPadState<PATCHES>,
}

impl<'a> Finger<'a> {
    fn new(pad: Pad<'a>, body: &str) -> Result<Self, Failure> {
        let numbers: Vec<f32> = body.split(',').map(str::parse).collect::<Result<_, _>>()?;
        let [kind, radius_mm, axis_deg, angle_deg, pitch_deg, roll_deg] = numbers[..] else {
            return Err("a body has six numbers".into());
        };
        let body = match kind as u32 {
            0 => Body::Plane,
            1 => Body::Sphere(Sphere::new(radius_mm).map_err(|e| e.to_string())?),
            2 => Body::Cylinder(Cylinder::new(radius_mm, axis_deg).map_err(|e| e.to_string())?),
            3 => Body::Edge(Edge::new(radius_mm, axis_deg, angle_deg).map_err(|e| e.to_string())?),
            _ => return Err("no such body".into()),
        };
        let is_plane = body == Body::Plane;
        let pose = [pitch_deg, roll_deg];
        let contact =
            if is_plane { RelaxingPadState::relaxing(&pad)? } else { RelaxingPadState::relaxing_over(&pad, pose)? };
        Ok(Self { pad, body, contact })
    }

    fn step(&mut self, motion: &[f32; 10]) -> Response {
        let &[depth_mm, x, y, spin_increment_rad, dt_s, pitch, roll, hydration_au, temperature_c, speed] = motion;
        let moved = (x * x + y * y).sqrt();
        let moves = depth_mm > 0.0 && moved > 1e-6 && moved < 1e3;
        let counted = if dt_s > 0.0 && dt_s < 1e3 { moved / dt_s } else { 0.0 };
        let speed_mm_s = match moves {
            true if speed > 0.0 => speed,
            true => counted,
            false => 0.0,
        };
        let at = Conditions { hydration_au, temperature_c, speed_mm_s, ..Conditions::default() };
        let mut change = Change::default();
        act::<HydrationBell>(&at, &mut change);
        act::<SpeedLog>(&at, &mut change);
        act::<Temperature>(&at, &mut change);
        let is_held = self.contact.set_strength_factor(change.strength) != change.strength;
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s };
        let mut r = self.pad.step(&mut self.contact, &self.body, motion, [pitch, roll]);
        if is_held {
            r.status = r.status.with(Status::EFFECT_HELD);
        }
        r
    }
}

/// A law of the skin with the parameters that its source gives as typical.
fn act<E: Effect>(at: &Conditions<f32>, change: &mut Change<f32>) {
    let mut values = [0.0; VALUES];
    for (value, parameter) in values.iter_mut().zip(E::LAW.parameters) {
        *value = parameter.typical as f32;
    }
    E::act(&values, at, change);
}

/// The words of every response, and at the end the patches.
fn replay(file: &PadModelFile, body: &str, motions: &[[f32; 10]]) -> Result<Vec<u32>, Failure> {
    let mut finger = Finger::new(file.file().pad, body)?;
    let mut words = Vec::with_capacity(15 * motions.len());
    for motion in motions {
        let r = finger.step(motion);
        let numbers = [r.normal_force_n, r.friction_n[0], r.friction_n[1], r.stick_ratio, r.friction_limit_n];
        let places = [r.spin_moment_n_mm, r.pressure_centre_mm[0], r.pressure_centre_mm[1], r.contact_area_mm2];
        let bands = [r.band_normal_n, r.band_friction_n, r.slip_margin_relaxed];
        words.extend(numbers.iter().chain([&r.slip_margin]).chain(&places).chain(&bands).map(|x| x.to_bits()));
        words.extend([r.regime as u32, r.status.0]);
    }
    for p in &finger.pad.patch_states(&finger.contact, &finger.body)[..finger.pad.patches.len()] {
        let ([x, y, z], [tx, ty]) = (p.place_mm, p.traction_mpa);
        let numbers = [x, y, z, p.pressure_mpa, tx, ty, p.contact_area_mm2, p.stick_ratio, p.used];
        words.extend(numbers.map(f32::to_bits));
    }
    Ok(words)
}

fn write_out(words: &[u32]) -> Result<(), Failure> {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Ok(std::io::stdout().write_all(&bytes)?)
}

/// A path of the body, straight between rows, as motions of `dt_s`: each increment is a difference in 64 bits, rounded once.
fn along(path: &str, dt_s: f64) -> Result<Vec<[f32; 10]>, Failure> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().ok_or("an empty path")?.split(',').collect();
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(str::parse).collect()).collect::<Result<_, _>>()?;
    let (first, last) = (rows.first().ok_or("no rows")?, rows.last().ok_or("no rows")?);
    let column = |name: &str| header.iter().position(|h| *h == name);
    let t = column("t_s").ok_or("no t_s")?;
    let at = |k: usize, time: f64| -> [f64; 6] {
        let (from, to) = (&rows[k], &rows[k + 1]);
        let share = ((time - from[t]) / (to[t] - from[t])).clamp(0.0, 1.0);
        ["depth_mm", "slide_x_mm", "slide_y_mm", "spin_deg", "pitch_deg", "roll_deg"].map(|name| {
            let plain = if name == "pitch_deg" { 30.0 } else { 0.0 };
            column(name).map_or(plain, |c| from[c] + (to[c] - from[c]) * share)
        })
    };
    let steps = ((last[t] - first[t]) / dt_s).ceil() as usize;
    let (mut motions, mut k, mut before) = (Vec::new(), 0, at(0, first[t]));
    for i in 0..=steps {
        let time = (first[t] + i as f64 * dt_s).min(last[t]);
        while k + 2 < rows.len() && rows[k + 1][t] < time {
            k += 1;
        }
        let now = at(k, time);
        let turn = (now[3] - before[3]) * (std::f64::consts::PI / 180.0);
        let moved = [now[0], now[1] - before[1], now[2] - before[2], turn, dt_s, now[4], now[5], 35.0, 32.0, 0.0];
        motions.push(moved.map(|x| x as f32));
        before = now;
    }
    Ok(motions)
}

/// Best of some rounds over the motions.
fn bench(file: &PadModelFile, body: &str, motions: &[[f32; 10]]) -> Result<(), Failure> {
    let mut finger = Finger::new(file.file().pad, body)?;
    let mut best = f64::INFINITY;
    for _ in 0..30 {
        let start = Instant::now();
        for motion in motions {
            std::hint::black_box(finger.step(std::hint::black_box(motion)));
        }
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{{\"row\":\"rust\",\"us_per_step\":{:.2}}}", best * 1e6 / motions.len() as f64);
    Ok(())
}
