//! Prints the digest of a million steps; `cargo run -p fingerpad --example document` must print the same. Steps of a pad must come to what
//! they do on the host.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::pad::ExamplePad;
use fingerpad_firmware::{exit, golden::digest, golden_pad, model};

#[entry]
fn main() -> ! {
    let Ok(model) = model() else { exit(Err(())) };
    defmt::println!("golden: {=u32:x}", digest(&model, 1_000_000));
    let found = golden_pad::digest(&ExamplePad::new().pad(), golden_pad::STEPS);
    if found != golden_pad::DIGEST {
        defmt::println!("pad: {=u32:x} in place of {=u32:x}", found, golden_pad::DIGEST);
        exit(Err(()))
    }
    exit(Ok(()))
}
