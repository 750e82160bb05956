//! Smallest program: links the core, asks it one question, exits with a status.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::Regime;

#[entry]
fn main() -> ! {
    let regime = Regime::classify(true, core::hint::black_box(0.5));
    defmt::info!("stick ratio 0.5 is {=str}", regime.as_str());
    fingerpad_firmware::exit(if regime == Regime::PartialSlip { Ok(()) } else { Err(()) })
}
