//! The tests of the program in one binary. What arguments, files, exit code and texts describe is in the tables of
//! `tests/cases`; the modules here compute, interrupt or compare runs. `cargo test --release -p fingerpad-cli --test all tables::`
//! runs the tables.

mod commands;
mod common;
mod confirm_fe;
mod design;
mod diagnosed_logs;
#[cfg(repository)]
mod docs;
mod engine_contacts;
mod eval_and_simulate;
mod first_hour;
mod help_examples;
mod identify;
mod limit_surfaces;
mod models;
mod own_columns;
mod pads;
mod pages;
mod simulate;
mod tables;
mod tips;
mod wrong_files;
