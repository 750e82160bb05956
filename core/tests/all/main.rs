//! The integration tests of the core in one binary: `cargo test -p fingerpad --test all properties::` runs those of one file.

mod batch;
mod calibration;
#[path = "../common/mod.rs"]
mod common;
mod control_loop;
mod effect_steps;
mod effects;
mod events;
mod file;
mod frame_patches;
mod frames;
mod gallery;
mod haptics;
mod held_load;
mod margin;
mod pad_driven;
mod pad_margin;
mod pads;
mod properties;
mod recipe;
mod relaxation;
mod relaxed_margin;
mod relaxing_memory;
mod requests;
mod step_length;
mod stick_ratio;
mod watch;
