//! The integration tests of the workspace in one binary: `cargo test --release -p fingerpad-tests --test all shipped::` runs
//! those of one file.

mod add_an_effect;
mod cad;
mod cases;
mod diagnose;
mod drift;
mod experiments;
mod false_alarms;
mod fast_against_finite_elements;
mod fe_sets;
mod finger_laws;
mod group;
mod laws_files;
mod laws_of_your_own;
mod layout;
mod margin;
mod pads;
mod protocols;
mod second_simulator;
mod shipped;
mod table;
