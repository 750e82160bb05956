//! The board: everything that differs between QEMU's mps2-an386 and a real microcontroller.
//!
//! To move to another board change this file and `memory.x`; the binaries do not change.
#![no_std]

pub mod convert;
pub mod count;
#[path = "../../core/tests/common/golden.rs"]
pub mod golden;
#[path = "../../core/tests/common/golden_pad.rs"]
pub mod golden_pad;
pub mod grip;
pub mod noise;
pub mod rivals;
#[path = "../../core/tests/common/strokes.rs"]
pub mod strokes;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_semihosting::debug;
use defmt_semihosting as _;
use fingerpad::pad::{Pad, PadFile};
use fingerpad::{Error, Model};

/// Clock of the core and of SysTick, Hz. STM32F407 at full speed: 168_000_000.
pub const CORE_CLOCK_HZ: u32 = 25_000_000;

/// The model that all programs run. Replace the file to run another finger.
pub fn model() -> Result<Model<'static>, Error> {
    Model::from_bytes(fingerpad::include_fpm!("../../data/models/fingertip.fpm"))
}

/// Most patches of the pad.
pub const PATCHES: usize = 38;

/// The pad that the programs run which need other poses or bodies.
pub fn pad() -> Result<Pad<'static>, Error> {
    Ok(PadFile::from_bytes(fingerpad::include_fpm!("../../data/models/fingertip-pad.fpm"))?.pad)
}

/// Starts SysTick so that its exception comes `rate_hz` times a second.
pub fn start_tick(syst: &mut SYST, rate_hz: u32) {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(CORE_CLOCK_HZ / rate_hz - 1);
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
}

/// Ticks of the core clock since the last SysTick exception.
pub fn ticks_since_exception() -> u32 {
    SYST::get_reload() - SYST::get_current()
}

/// Ends the program with status 0 (`Ok`) or 1 (`Err`). On a board without a debugger it stops here.
pub fn exit(result: Result<(), ()>) -> ! {
    debug::exit(match result {
        Ok(()) => debug::EXIT_SUCCESS,
        Err(()) => debug::EXIT_FAILURE,
    });
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    defmt::error!("panic: {}", defmt::Display2Format(info));
    exit(Err(()))
}

defmt::timestamp!("");
