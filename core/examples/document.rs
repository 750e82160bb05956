//! Prints what `core/docs/fpm-format.md` says of a model file: its first bytes, the test vectors, the digest of a million steps.
//! `cargo run -p fingerpad --example document -- FILE.fpm`

use fingerpad::{File, Motion, Regime, State, step};

#[path = "../tests/common/golden.rs"]
mod golden;
#[path = "../tests/common/vectors.rs"]
mod vectors;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: document FILE.fpm")?;
    let bytes = std::fs::read(path)?;
    let words = vectors::aligned(&bytes);
    let model = File::from_bytes(&bytemuck::cast_slice(&words)[..bytes.len()]).map_err(|e| e.to_string())?.model;
    println!("{} bytes, M = {}, N = {}\n", bytes.len(), model.data().springs.len(), model.data().rows.len());
    for line in bytes[..64].chunks(32) {
        let words: Vec<String> =
            line.chunks(4).map(|word| word.iter().map(|b| format!("{b:02x}")).collect::<String>()).collect();
        println!("{}", words.join(" "));
    }
    println!();
    let mut state = State::default();
    for (depth_mm, x, y) in [
        (0.5, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (1.0, 1.5, 0.0),
        (1.0, 0.0, 2.0),
        (0.7, -0.25, 0.0),
        (3.0, 0.0, 0.0),
        (1.0, f32::NAN, 0.125),
        (0.0, 0.0, 0.0),
    ] {
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad: 0.0, dt_s: 1e-3 };
        let r = step(&model, &mut state, motion);
        let bits = vectors::words(&r).map(|word| format!("{word:08x}"));
        let regime = [Regime::NoContact, Regime::Stick, Regime::PartialSlip, Regime::Slip]
            .iter()
            .position(|k| *k == r.regime)
            .unwrap_or(9);
        println!("{depth_mm} {x} {y} | {} {regime} {}", bits.join(" "), r.status.0);
    }
    println!("\ngolden: {:x}", golden::digest(&model, 1_000_000));
    Ok(())
}
