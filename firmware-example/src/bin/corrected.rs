//! A `corrected.fpm` of `fingerpad diagnose`, effects and all; `cargo run -p fingerpad --example strokes` must print the same.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::File;
use fingerpad_firmware::{exit, strokes::digest};

#[entry]
fn main() -> ! {
    let file = File::from_bytes(fingerpad::include_fpm!("../../corrected.fpm"));
    let Ok(Ok(digest)) = file.map(|file| digest(&file, 2_000)) else { exit(Err(())) };
    defmt::println!("corrected: {=u32:x}", digest);
    exit(Ok(()))
}
