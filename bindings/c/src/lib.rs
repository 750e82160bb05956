//! The real-time models for C: bed and pad. No allocation, no panic, no global state; the caller owns all memory.
//!
//! Each function checks its pointers and handles before it changes anything, and returns a code ([`codes`]). What C sees
//! is in [`types`] (plain numbers) and beside the functions (memory whose inside is the library's own). The C header is
//! written from here by `build.rs`.
#![no_std]
#![allow(non_camel_case_types)]
// The obligations of the caller are the same for all functions. They are checked as far as possible and stated once in the
// header's preface.
#![allow(clippy::missing_safety_doc)]

mod batch;
mod codes;
mod contact;
mod driven;
mod forces;
// Poses are in double precision, which a microcontroller has in software only.
#[cfg(not(target_os = "none"))]
mod frames;
mod margin;
mod model;
mod pad;
mod pad_state;
mod pad_steps;
mod pointer;
mod relaxing;
mod requests;
mod spin;
mod state;
mod step;
mod types;
mod watch;

use panic_never as _;
