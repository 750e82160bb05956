//! A number beside its reference.

use std::cell::RefCell;

thread_local! {
    /// What [`verify`](crate::verify) has recorded in this thread.
    pub(crate) static RECORDED: RefCell<Vec<Check>> = const { RefCell::new(Vec::new()) };
}

/// One row of the verification table.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The compared quantity, with its unit.
    pub quantity: String,
    /// Its value.
    pub value: f64,
    /// Its reference value.
    pub reference: f64,
    /// Distance as the bound counts it.
    pub difference: f64,
    /// How the distance is bounded.
    pub bound: Bound,
}

/// Criterion of a check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// |value − reference| <= bound * |reference|.
    Relative(f64),
    /// |value − reference| <= bound.
    Absolute(f64),
    /// value >= reference.
    AtLeast,
    /// value <= reference.
    AtMost,
    /// Reported without a criterion.
    Reported,
}

impl Check {
    /// `value` within `bound` of `reference`, relative.
    pub fn relative(quantity: impl Into<String>, value: f64, reference: f64, bound: f64) -> Self {
        let difference = value / reference - 1.0;
        Self { quantity: quantity.into(), value, reference, difference, bound: Bound::Relative(bound) }
    }

    /// `value` within `bound` of `reference`, in its unit.
    pub fn absolute(quantity: impl Into<String>, value: f64, reference: f64, bound: f64) -> Self {
        let difference = value - reference;
        Self { quantity: quantity.into(), value, reference, difference, bound: Bound::Absolute(bound) }
    }

    /// `value` not below `reference`.
    pub fn at_least(quantity: impl Into<String>, value: f64, reference: f64) -> Self {
        Self { quantity: quantity.into(), value, reference, difference: value - reference, bound: Bound::AtLeast }
    }

    /// `value` not above `reference`.
    pub fn at_most(quantity: impl Into<String>, value: f64, reference: f64) -> Self {
        Self { quantity: quantity.into(), value, reference, difference: value - reference, bound: Bound::AtMost }
    }

    /// A number without a verdict.
    pub fn reported(quantity: impl Into<String>, value: f64) -> Self {
        Self { quantity: quantity.into(), value, reference: f64::NAN, difference: f64::NAN, bound: Bound::Reported }
    }

    /// Whether the bound is met; NaN never passes.
    pub fn passes(&self) -> bool {
        match self.bound {
            Bound::Relative(bound) | Bound::Absolute(bound) => self.difference.abs() <= bound,
            Bound::AtLeast => self.value >= self.reference,
            Bound::AtMost => self.value <= self.reference,
            Bound::Reported => true,
        }
    }

    fn cells(&self) -> [String; 5] {
        let number = |v: f64| if v.is_nan() { "-".into() } else { short(v) };
        let (difference, bound) = match self.bound {
            Bound::Relative(bound) => (format!("{:+.3} %", 100.0 * self.difference), format!("{} %", 100.0 * bound)),
            Bound::Absolute(bound) => (short(self.difference), short(bound)),
            Bound::AtLeast => (short(self.difference), ">= reference".into()),
            Bound::AtMost => (short(self.difference), "<= reference".into()),
            Bound::Reported => ("-".into(), "-".into()),
        };
        [self.quantity.clone(), number(self.value), number(self.reference), difference, bound]
    }
}

fn short(v: f64) -> String {
    if v == 0.0 || (1e-2..1e4).contains(&v.abs()) { format!("{v:.5}") } else { format!("{v:.3e}") }
}

/// Lines `case | quantity | value | reference | difference | pass bound | verdict`.
pub fn table(case: &str, checks: &[Check]) -> String {
    let mut out = String::new();
    for check in checks {
        let verdict = match (check.bound, check.passes()) {
            (Bound::Reported, _) => "",
            (_, true) => "pass",
            (_, false) => "FAIL",
        };
        let [quantity, value, reference, difference, bound] = check.cells();
        out += &format!(
            "{case:<18} | {quantity:<58} | {value:>11} | {reference:>11} | {difference:>11} | {bound:>12} | {verdict}\n"
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_kept_and_nan_fails() {
        assert!(Check::relative("", 1.009, 1.0, 0.01).passes());
        assert!(!Check::relative("", 1.011, 1.0, 0.01).passes());
        assert!(!Check::relative("", f64::NAN, 1.0, 0.01).passes());
        assert!(!Check::at_most("", f64::NAN, 1.0).passes());
        assert!(!Check::at_least("", -1e-9, 0.0).passes());
    }
}
