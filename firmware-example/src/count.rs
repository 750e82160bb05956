//! Instructions per call, counted with SysTick.
//!
//! Under `qemu-system-arm -icount shift=10` an instruction lasts 1024 ns and a tick of SysTick 40 ns, so that one
//! instruction is 25.6 ticks, exactly and repeatably. On silicon ticks are cycles.

use core::hint::black_box;

use cortex_m::peripheral::{SYST, syst::SystClkSource};

/// Least, mean and most over the calls of one kernel.
#[derive(Clone, Copy, defmt::Format)]
pub struct Count {
    pub least: u32,
    pub mean: u32,
    pub most: u32,
}

/// What is counted: one call on the memory `C` with a sample of inputs.
pub type Kernel<C> = extern "C" fn(&mut C, &[f32; 4]);

/// Starts the counter without its interrupt.
pub fn start(syst: &mut SYST) {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(0xff_ffff);
    syst.clear_current();
    syst.disable_interrupt();
    syst.enable_counter();
}

#[inline(never)]
fn one<C>(kernel: Kernel<C>, memory: &mut C, sample: &[f32; 4]) -> u32 {
    let before = SYST::get_current();
    kernel(memory, sample);
    let after = SYST::get_current();
    before.wrapping_sub(after) & 0xff_ffff
}

extern "C" fn empty<C>(memory: &mut C, sample: &[f32; 4]) {
    black_box((memory, sample));
}

fn instructions(ticks: u32) -> u32 {
    (ticks * 10 + 128) / 256
}

/// Counts `kernel` over `samples`, less what calling an empty one costs.
pub fn count<C>(kernel: Kernel<C>, memory: &mut C, samples: &[[f32; 4]]) -> Count {
    let kernel = black_box(kernel);
    let nothing = instructions(one(black_box(empty::<C> as Kernel<C>), memory, &[0.0; 4]));
    let mut result = Count { least: u32::MAX, mean: 0, most: 0 };
    for sample in samples {
        let n = instructions(one(kernel, memory, sample)).saturating_sub(nothing);
        result.least = result.least.min(n);
        result.most = result.most.max(n);
        result.mean += n;
    }
    result.mean = (result.mean + samples.len() as u32 / 2) / samples.len() as u32;
    result
}

/// Instructions of one call in a program under `-icount shift=3`, in which an instruction lasts a fifth of a tick; to a multiple of
/// 5, reading the counter included.
pub fn instructions_in(call: impl FnOnce()) -> u32 {
    let before = SYST::get_current();
    call();
    5 * (before.wrapping_sub(SYST::get_current()) & 0xff_ffff)
}

/// A loop of `n` turns that takes exactly 2 n + 1 instructions: the counter's own check.
#[inline(never)]
pub fn known_loop(n: u32) -> u32 {
    let before = SYST::get_current();
    // SAFETY: counts a register down; touches nothing else.
    unsafe { core::arch::asm!("2: subs {0}, #1", "bne 2b", inout(reg) n => _) };
    let after = SYST::get_current();
    instructions(before.wrapping_sub(after) & 0xff_ffff)
}
