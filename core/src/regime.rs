//! The words that host and target share for what a contact does.

/// What the contact as a whole is doing.
///
/// The spellings of [`Regime::as_str`] are those of every CSV column and JSON key of the project.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Regime {
    /// No point of the pad touches the plane.
    #[default]
    NoContact,
    /// Stick ratio at least 0.99.
    Stick,
    /// Part of the contact slips.
    PartialSlip,
    /// Stick ratio at most 0.01.
    Slip,
}

impl Regime {
    /// Classifies a contact by its stick ratio (stuck area over contact area, 0 to 1).
    ///
    /// `in_contact` is whether there is any contact area at all. A NaN stick ratio is `PartialSlip`.
    pub fn classify(in_contact: bool, stick_ratio: f32) -> Self {
        if !in_contact {
            Self::NoContact
        } else if stick_ratio >= 0.99 {
            Self::Stick
        } else if stick_ratio <= 0.01 {
            Self::Slip
        } else {
            Self::PartialSlip
        }
    }

    /// The spelling used in files: `no_contact`, `stick`, `partial_slip` or `slip`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::NoContact => "no_contact",
            Self::Stick => "stick",
            Self::PartialSlip => "partial_slip",
            Self::Slip => "slip",
        }
    }
}

impl core::fmt::Display for Regime {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.as_str())
    }
}

impl core::str::FromStr for Regime {
    type Err = ();
    fn from_str(s: &str) -> Result<Self, ()> {
        [Self::NoContact, Self::Stick, Self::PartialSlip, Self::Slip]
            .into_iter()
            .find(|regime| regime.as_str() == s)
            .ok_or(())
    }
}

/// Flags that qualify a response; none set is `ok`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(transparent))]
pub struct Status(pub u16);

impl Status {
    /// Nothing to remark.
    pub const OK: Self = Self(0);
    /// The solver had to pass a limit point of the structure with viscous stabilisation.
    pub const STABILISED: Self = Self(1);

    const NAMES: [(Self, &'static str); 1] = [(Self::STABILISED, "stabilised")];

    /// Both sets of flags together.
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all flags of `other` are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl core::fmt::Display for Status {
    /// `ok`, or the names of the flags joined by `+`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if *self == Self::OK {
            return f.write_str("ok");
        }
        let mut first = true;
        for (flag, name) in Self::NAMES {
            if self.contains(flag) {
                if !first {
                    f.write_str("+")?;
                }
                f.write_str(name)?;
                first = false;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_belong_to_the_outer_regimes() {
        assert_eq!(Regime::classify(false, 1.0), Regime::NoContact);
        assert_eq!(Regime::classify(true, 0.99), Regime::Stick);
        assert_eq!(Regime::classify(true, 0.5), Regime::PartialSlip);
        assert_eq!(Regime::classify(true, 0.01), Regime::Slip);
        assert_eq!(Regime::classify(true, f32::NAN), Regime::PartialSlip);
    }

    #[test]
    fn spellings_round_trip() {
        for regime in [Regime::NoContact, Regime::Stick, Regime::PartialSlip, Regime::Slip] {
            assert_eq!(regime.as_str().parse(), Ok(regime));
        }
        assert!("sliding".parse::<Regime>().is_err());
    }
}
