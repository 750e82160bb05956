//! Verification cases by name.

mod sphere;

use crate::Check;

/// How much a case may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Seconds; for tests.
    Quick,
    /// Up to minutes; for `verify`.
    Full,
}

/// Why a case has no numbers.
pub type Failure = Box<dyn std::error::Error>;

/// A verification case.
pub struct Case {
    /// What it is asked for by.
    pub name: &'static str,
    /// What it shows, with shape, mesh and settings.
    pub about: &'static str,
    /// The case itself.
    pub run: fn(Effort) -> Result<Vec<Check>, Failure>,
}

/// All cases.
pub const CASES: &[Case] = &[
    Case { name: "hertz", about: "paraboloid on the plane, frictionless, exact far field", run: sphere::hertz },
    Case { name: "mindlin", about: "Cattaneo-Mindlin, Coulomb, nu 0.499, exact far field", run: sphere::mindlin },
    Case { name: "full_slip", about: "lambda sigma^beta on the Hertz pressure in full slip", run: sphere::full_slip },
];
