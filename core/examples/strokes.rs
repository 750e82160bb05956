//! Prints the digest of strokes of a model file with effects; the firmware's program `corrected` must print the same.
//! `cargo run -p fingerpad --example strokes -- FILE.fpm`

use fingerpad::File;

#[path = "../tests/common/strokes.rs"]
mod strokes;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: strokes FILE.fpm")?;
    let bytes = std::fs::read(path)?;
    let words: Vec<u64> = bytes
        .chunks(8)
        .map(|chunk| u64::from_ne_bytes(std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0))))
        .collect();
    let file = File::from_bytes(&bytemuck::cast_slice(&words)[..bytes.len()]).map_err(|e| e.to_string())?;
    println!("corrected: {:x}", strokes::digest(&file, 2_000).map_err(|e| e.to_string())?);
    Ok(())
}
