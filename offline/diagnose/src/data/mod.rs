//! Measured runs: readers, checks, and state columns that are read with an error.
//!
//! Main types: [`RunSet`](runs::RunSet) (the runs of a file), [`Run`](runs::Run), [`Correction`](covariates::Correction).
//! May use: schema (cautions), laws (the columns and rows that they read), `fingerpad-formats`.

pub mod checks;
pub mod clock;
pub mod column_map;
mod column_places;
pub mod content;
pub mod covariates;
pub mod csv_text;
mod derived_columns;
pub mod lag;
pub mod lift_off;
pub mod median;
pub mod outliers;
pub mod own_columns;
pub mod rotation;
mod run_assembler;
pub mod runs;
pub mod runs_csv;
pub mod suspicions;
pub mod thinning;
pub mod trace_csv;
pub mod turns;
mod workbook;
pub mod yardsticks;
