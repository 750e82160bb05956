//! Checks of numbers while they are read from a file, so that the message can name the line. Units are mm, N, s, MPa
//! throughout; names of keys, flags and columns end in their unit.

use serde::{Deserialize, Deserializer, de::Error};

/// A finite number.
pub fn finite<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    check(from, "a finite number", |v| v.is_finite())
}

/// A finite number greater than zero.
pub fn positive<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    check(from, "a finite number greater than 0", |v| v > 0.0)
}

/// A finite number not less than zero.
pub fn non_negative<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    check(from, "a finite number not less than 0", |v| v >= 0.0)
}

/// A finite number other than zero.
pub fn non_zero<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    check(from, "a finite number other than 0", |v| v != 0.0)
}

/// Poisson's ratio of a soft solid.
pub fn strict_poisson<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    check(from, "a number between 0 and 0.5, both excluded", |v| v > 0.0 && v < 0.5)
}

/// Poisson's ratio.
pub fn poisson<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    check(from, "a number between -1 and 0.5", |v| v > -1.0 && v < 0.5)
}

fn check<'de, D: Deserializer<'de>>(from: D, wanted: &str, holds: impl Fn(f64) -> bool) -> Result<f64, D::Error> {
    let value = f64::deserialize(from)?;
    if value.is_finite() && holds(value) {
        Ok(value)
    } else {
        Err(D::Error::custom(format!("{value} is not {wanted}")))
    }
}
