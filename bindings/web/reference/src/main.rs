//! What the page must show, computed by the core on the host.
//!
//! ```text
//! fingerpad-web-reference steps MODEL.fpm MOTIONS        ten 32-bit floats a motion on; writes 16 words a response
//! fingerpad-web-reference path MODEL.fpm PATH.csv DT_S   a path of the plane in steps of DT_S; likewise
//! fingerpad-web-reference refusal FILE                   why a file is no model, in the core's words
//! fingerpad-web-reference bench MODEL.fpm MOTIONS        ns a step, as JSON
//! ```

use std::error::Error;
use std::io::Write;
use std::time::Instant;

use fingerpad::effects::find;
use fingerpad::{Contact, EffectSlot, Effects, Model, ModelFile, Motion, Pose, Posed, Response, SPRINGS, Surroundings};

/// Laws with which the page's sliders act where a file has none of their own, in this order, at their typical size.
const DRIVEN: [&str; 3] = ["hydration_bell", "speed_log", "temperature"];

type Failure = Box<dyn Error>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["steps", model, motions] => write_out(&replay(&read(model)?, &read_motions(motions)?)?),
        ["path", model, path, dt] => write_out(&replay(&read(model)?, &along(path, dt.parse()?)?)?),
        ["refusal", file] => {
            match ModelFile::new(&std::fs::read(file)?) {
                Ok(_) => println!("accepted"),
                Err(error) => println!("{error}"),
            }
            Ok(())
        }
        ["bench", model, motions] => bench(&read(model)?, &read_motions(motions)?),
        _ => Err("usage: steps MODEL MOTIONS | path MODEL PATH DT_S | refusal FILE | bench MODEL MOTIONS".into()),
    }
}

fn read(model: &str) -> Result<ModelFile, Failure> {
    Ok(ModelFile::new(&std::fs::read(model)?)?)
}

fn read_motions(file: &str) -> Result<Vec<[f32; 10]>, Failure> {
    let bytes = std::fs::read(file)?;
    let numbers: Vec<f32> = bytes.chunks_exact(4).map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
    Ok(numbers.chunks_exact(10).map(|motion| std::array::from_fn(|i| motion[i])).collect())
}

/// The effects of a file and those that the page adds.
fn slots(file: &ModelFile) -> Vec<EffectSlot> {
    let mut slots = file.file().effects.to_vec();
    for law in DRIVEN.iter().filter_map(|name| find(name)) {
        if file.file().effects.iter().all(|slot| slot.kind != law.kind) {
            let mut slot = EffectSlot { kind: law.kind, ..EffectSlot::default() };
            for (value, parameter) in slot.values.iter_mut().zip(law.parameters) {
                *value = parameter.typical as f32;
            }
            slots.push(slot);
        }
    }
    slots
}

/// A contact with spin, effects and a pose that changes.
struct Finger<'a> {
    model: Model<'a>,
    posed: Posed<'a>,
    pose: Pose,
    effects: Effects<'a>,
    contact: Contact<SPRINGS, 2>,
}

impl<'a> Finger<'a> {
    fn new(file: &'a ModelFile, slots: &'a [EffectSlot]) -> Result<Self, Failure> {
        let model = file.file().model;
        let fitted = Pose { pitch_deg: model.data().pose.pitch_deg, roll_deg: 0.0 };
        let (posed, effects) = (model.posed(fitted)?, Effects::new(slots)?);
        Ok(Self { model, posed, pose: fitted, effects, contact: Contact::default() })
    }

    fn step(&mut self, motion: &[f32; 10]) -> Response {
        let &[depth_mm, x, y, spin, dt_s, pitch_deg, roll_deg, hydration_au, temperature_c, speed] = motion;
        let pose = Pose { pitch_deg, roll_deg };
        if pose != self.pose
            && let Ok(posed) = self.model.posed(pose)
        {
            (self.posed, self.pose) = (posed, pose);
        }
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad: spin, dt_s };
        let speed_mm_s = if speed > 0.0 { Some(speed) } else { None };
        let around = Surroundings { hydration_au, temperature_c, speed_mm_s, ..Surroundings::default() };
        self.effects.step(&self.posed, &mut self.contact, around, motion)
    }
}

/// The words of every response.
fn replay(file: &ModelFile, motions: &[[f32; 10]]) -> Result<Vec<u32>, Failure> {
    let slots = slots(file);
    let mut finger = Finger::new(file, &slots)?;
    let mut words = Vec::with_capacity(16 * motions.len());
    for motion in motions {
        let r = finger.step(motion);
        let [centre_x, centre_y] = finger.posed.friction_centre_mm(finger.contact.state.depth_mm());
        let numbers = [r.normal_force_n, r.friction_n[0], r.friction_n[1], r.stick_ratio, r.friction_limit_n];
        let places = [r.spin_moment_n_mm, r.pressure_centre_mm[0], r.pressure_centre_mm[1], r.contact_area_mm2];
        let bands = [r.band_normal_n, r.band_friction_n, centre_x, centre_y];
        words.extend(numbers.iter().chain([&r.slip_margin]).chain(&places).chain(&bands).map(|x| x.to_bits()));
        words.extend([r.regime as u32, u32::from(r.status.0)]);
    }
    Ok(words)
}

fn write_out(words: &[u32]) -> Result<(), Failure> {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Ok(std::io::stdout().write_all(&bytes)?)
}

/// A path of the plane, straight between rows, as motions of `dt_s`: each increment is a difference in 64 bits, rounded once.
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
fn bench(file: &ModelFile, motions: &[[f32; 10]]) -> Result<(), Failure> {
    let slots = slots(file);
    let mut finger = Finger::new(file, &slots)?;
    let mut best = f64::INFINITY;
    for _ in 0..30 {
        let start = Instant::now();
        for motion in motions {
            std::hint::black_box(finger.step(std::hint::black_box(motion)));
        }
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{{\"row\":\"rust\",\"ns_per_step\":{:.1}}}", best * 1e9 / motions.len() as f64);
    Ok(())
}
