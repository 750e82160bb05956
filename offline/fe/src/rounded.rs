//! Numbers in messages.
//!
//! Main type: [`Rounded`].

use std::fmt;

/// A number that prints with at most five significant digits and without trailing zeros: 1518.4 for 1518.3999999999999.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounded(pub f64);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = if self.0.is_finite() { format!("{:.4e}", self.0).parse().unwrap_or(self.0) } else { self.0 };
        if value == 0.0 || (1e-4..1e9).contains(&value.abs()) { write!(f, "{value}") } else { write!(f, "{value:e}") }
    }
}

#[cfg(test)]
mod tests {
    use super::Rounded;

    #[test]
    fn five_digits_and_no_noise() {
        for (value, text) in [
            (1_518.399_999_999_999_9, "1518.4"),
            (0.1 + 0.2, "0.3"),
            (20.0, "20"),
            (1e6, "1000000"),
            (-0.0, "-0"),
            (1.234_567e-7, "1.2346e-7"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(Rounded(value).to_string(), text);
        }
    }
}
