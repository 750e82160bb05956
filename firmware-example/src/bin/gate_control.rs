//! Does on purpose what the core must not: panics, computes with doubles, takes the library's square root. The checks of
//! symbols must find all three here, or they prove nothing. Never run.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use fingerpad_firmware as _;

unsafe extern "C" {
    fn sqrtf(x: f32) -> f32;
}

#[entry]
fn main() -> ! {
    let numbers = black_box([1.0f32, 2.0, 3.0]);
    loop {
        let x = numbers[black_box(1usize)];
        black_box(f64::from(x) * black_box(1.5f64));
        // SAFETY: a number in, a number out. The argument may be negative, so that the library's root is linked.
        black_box(unsafe { sqrtf(black_box(x)) });
    }
}
