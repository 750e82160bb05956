//! From files to a verdict, in this order: [`Checked`](checked::Checked), [`Calibrated`](calibrated::Calibrated) with its
//! [`Basis`](basis::Basis), [`Decision`](decision::Decision), [`Selected`](selected::Selected), [`Concluded`](concluded::Concluded).
//!
//! May use: data, laws, model, plan (its constraints), schema, selection, statistics.

pub mod basis;
pub mod calibrated;
pub mod checked;
pub mod cleaning;
pub mod concluded;
pub mod cross_validation;
pub mod decision;
mod in_air;
pub mod instrument;
pub mod intervals;
pub mod options;
pub mod selected;
pub mod sizes;
