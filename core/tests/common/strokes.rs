//! Strokes of a model with effects, boiled down to one number that host and target must share.
//!
//! Compiled by path into the example `strokes` and into the firmware.

use fingerpad::{Contact, Effects, Error, File, Motion, SPRINGS, Surroundings};

/// Digest of what a sensor reads along `strokes` strokes of 500 steps: press, hold, slide, turn back, lift; moisture,
/// temperature, width, clock and direction are others each time.
///
/// # Errors
/// Those of [`Effects::new`].
pub fn digest(file: &File<'_>, strokes: u32) -> Result<u32, Error> {
    let effects = Effects::new(file.effects)?;
    let mut contact = Contact::<SPRINGS>::default();
    let mut seed = 5u32;
    let mut unit = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32
    };
    let mut digest = 0x811c_9dc5u32;
    for _ in 0..strokes {
        let around = Surroundings {
            hydration_au: 20.0 + 50.0 * unit(),
            temperature_c: 27.0 + 9.0 * unit(),
            finger_width_mm: 14.0 + 5.0 * unit(),
            series_s: 3600.0 * unit(),
            ..Surroundings::default()
        };
        let (depth, vx, vy) = (0.4 + 1.2 * unit(), 0.08 * unit() - 0.04, 0.08 * unit() - 0.04);
        for i in 0..500 {
            let (share, sign) = match i {
                0..100 => (i as f32 / 100.0, 0.0),
                100..150 => (1.0, 0.0),
                150..350 => (1.0, 1.0),
                350..450 => (1.0, -1.0),
                _ => ((490 - i) as f32 / 40.0, 0.0),
            };
            let motion = Motion {
                depth_mm: depth * share,
                slide_increment_mm: [sign * vx, sign * vy],
                spin_increment_rad: 0.0,
                dt_s: 0.004,
            };
            let response = effects.step(&file.model, &mut contact, around, motion);
            for value in effects.reading(&response) {
                digest = (digest ^ value.to_bits()).wrapping_mul(0x0100_0193).rotate_left(5);
            }
        }
    }
    Ok(digest)
}
