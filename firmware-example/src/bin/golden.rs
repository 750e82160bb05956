//! Prints the digest of a million steps; `cargo run -p fingerpad --example document` must print the same.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad_firmware::{exit, golden::digest, model};

#[entry]
fn main() -> ! {
    let Ok(model) = model() else { exit(Err(())) };
    defmt::println!("golden: {=u32:x}", digest(&model, 1_000_000));
    exit(Ok(()))
}
