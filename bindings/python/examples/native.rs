//! The core without Python, for its tests and measurements.
//!
//! `native steps MODEL.fpm spin|plain` reads rows of eight little-endian floats (depth, slide x, slide y, spin, dt, strength factor,
//! pitch, roll; a pitch that is NaN stands for the fitted pose) and writes the fourteen words of each response.

use std::io::{Read, Write};

use fingerpad::{Model, ModelFile, Motion, Pose, Response, StateOf};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["steps", model, "plain"] => steps::<1>(&load(model)?.file().model),
        ["steps", model, "spin"] => steps::<2>(&load(model)?.file().model),
        _ => Err("usage: native steps MODEL.fpm spin|plain".into()),
    }
}

fn load(path: &str) -> Result<ModelFile, Failure> {
    Ok(ModelFile::new(&std::fs::read(path)?)?)
}

fn steps<const P: usize>(model: &Model) -> Result<(), Failure> {
    let mut bytes = Vec::new();
    std::io::stdin().read_to_end(&mut bytes)?;
    let mut state = StateOf::<4, P>::default();
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for row in bytes.as_chunks::<32>().0 {
        let number = |i: usize| f32::from_le_bytes(std::array::from_fn(|k| row[4 * i + k]));
        let [depth_mm, x, y, spin_increment_rad, dt_s, strength, pitch_deg, roll_deg] = std::array::from_fn(number);
        state.set_strength_factor(strength);
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s };
        let response = match pitch_deg.is_nan() {
            true => model.step(&mut state, motion),
            false => model.posed(Pose { pitch_deg, roll_deg })?.step(&mut state, motion),
        };
        for word in words(&response) {
            out.write_all(&word.to_le_bytes())?;
        }
    }
    Ok(out.flush()?)
}

fn words(r: &Response) -> [u32; 14] {
    let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
    let first = [r.normal_force_n, x, y, r.spin_moment_n_mm, r.slip_margin, r.stick_ratio].map(f32::to_bits);
    let rest = [r.friction_limit_n, r.contact_area_mm2, centre_x, centre_y, r.band_normal_n, r.band_friction_n];
    let rest = rest.map(f32::to_bits);
    let mut words = [0; 14];
    words[..6].copy_from_slice(&first);
    words[6] = r.regime as u32;
    words[7] = u32::from(r.status.0);
    words[8..].copy_from_slice(&rest);
    words
}
