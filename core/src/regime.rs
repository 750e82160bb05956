//! The words that host and target share for what a contact does.

use bytemuck::CheckedBitPattern;

/// What the contact as a whole is doing.
///
/// The spellings of [`Regime::as_str`] are those of every CSV column and JSON key of the project.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, CheckedBitPattern)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u8)]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(transparent))]
pub struct Status(pub u16);

impl Status {
    /// Nothing to remark.
    pub const OK: Self = Self(0);
    /// The solver had to pass a limit point of the structure with viscous stabilisation.
    pub const STABILISED: Self = Self(1);
    /// Depth or slide was NaN or infinite; the step was taken without it, as if that axis stood still.
    pub const BAD_INPUT: Self = Self(1 << 1);
    /// The time step was not a positive number.
    pub const BAD_TIME_STEP: Self = Self(1 << 2);
    /// Deeper than the model was fitted; the answer is that of the largest depth.
    pub const DEPTH_ABOVE_RANGE: Self = Self(1 << 3);
    /// The slide of one step exceeded 64 mm and was cut to that.
    pub const LARGE_INCREMENT: Self = Self(1 << 4);
    /// A force-driven step could not reach the force asked for.
    pub const LOAD_NOT_REACHED: Self = Self(1 << 5);
    /// The motion spins and the contact's memory does not know spin; the step was taken without it.
    pub const SPIN_IGNORED: Self = Self(1 << 6);
    /// The contact's memory held what is no number and was begun anew; forces are those of a fresh contact.
    pub const MEMORY_LOST: Self = Self(1 << 7);
    /// An effect led beyond its range and was held there: a pull beyond the normal force, a force that is no number.
    pub const EFFECT_HELD: Self = Self(1 << 8);

    /// A pose beyond those that the model was fitted in; the answer is that of the nearest of them.
    pub const POSE_OUT_OF_RANGE: Self = Self(1 << 9);

    const NAMES: [(Self, &'static str); 10] = [
        (Self::STABILISED, "stabilised"),
        (Self::BAD_INPUT, "bad_input"),
        (Self::BAD_TIME_STEP, "bad_time_step"),
        (Self::DEPTH_ABOVE_RANGE, "depth_above_range"),
        (Self::LARGE_INCREMENT, "large_increment"),
        (Self::LOAD_NOT_REACHED, "load_not_reached"),
        (Self::SPIN_IGNORED, "spin_ignored"),
        (Self::MEMORY_LOST, "memory_lost"),
        (Self::EFFECT_HELD, "effect_held"),
        (Self::POSE_OUT_OF_RANGE, "pose_out_of_range"),
    ];

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
