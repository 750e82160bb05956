//! The integration tests of the program in one binary: `cargo test --release -p fingerpad-cli --test all eval::` runs those of
//! one file. `docs.rs` is a binary of its own, since the published package does not contain it.

mod commands;
#[path = "../common/mod.rs"]
mod common;
mod confirm_fe;
mod design;
mod diagnosed_logs;
mod eval_and_simulate;
mod first_hour;
mod geometry_commands;
mod help_examples;
mod identify;
mod limit_surfaces;
mod own_columns;
mod pads;
mod probes;
mod rigid_bodies;
mod wrong_files;
