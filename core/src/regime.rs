//! Regimes and status flags of a contact, shared by host and target.

use core::fmt::Write;

use bytemuck::CheckedBitPattern;

/// Regime of the contact as a whole.
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

    /// The regime of a number, as `regime as u32` gives it.
    pub fn numbered(number: u32) -> Option<Self> {
        [Self::NoContact, Self::Stick, Self::PartialSlip, Self::Slip]
            .into_iter()
            .find(|regime| *regime as u32 == number)
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
pub struct Status(pub u32);

bitflags::bitflags! {
    impl Status: u32 {
        /// The solver had to pass a limit point of the structure with viscous stabilisation.
        const STABILISED = 1;
        /// Depth or slide was NaN or infinite; the step was taken without it, as if that axis stood still.
        const BAD_INPUT = 1 << 1;
        /// The time step was not a positive number.
        const BAD_TIME_STEP = 1 << 2;
        /// Depth above the range of the fit; the response is that of the largest depth.
        const DEPTH_ABOVE_RANGE = 1 << 3;
        /// The slide of one step exceeded 64 mm and was cut to that.
        const LARGE_INCREMENT = 1 << 4;
        /// A force-driven step could not reach the prescribed force.
        const LOAD_NOT_REACHED = 1 << 5;
        /// The motion has a spin, but the state of the contact is one without spin; the step was made without it.
        const SPIN_IGNORED = 1 << 6;
        /// The contact's memory was inconsistent (a number that is not finite or out of its range, or a pad of another number of patches)
        /// and was reset; the response is that of a finger without contact, and the next step starts a new contact.
        const MEMORY_LOST = 1 << 7;
        /// A value of an effect was outside its range and was limited or left out: adhesion above the normal force, a force that is not finite.
        const EFFECT_HELD = 1 << 8;
        /// A pose outside the range of the fit; the response is that of the nearest pose within it.
        const POSE_OUT_OF_RANGE = 1 << 9;
        /// A pad did not reach equilibrium within the iterations of a step: the step is too large or the body too sharp. The response is
        /// that of the best iteration, and the next step continues from it.
        const NOT_CONVERGED = 1 << 10;
        /// The body is too sharp for the patches of the pad; the response is that of a body with the least radius
        /// ([`crate::pad::Pad::least_radii_mm`]).
        const BODY_TOO_SHARP = 1 << 11;
        /// The contact began inside the body; its depth counts from where it began (see [`crate::frames`]).
        const BEGAN_INSIDE = 1 << 12;
        /// The contact, as a disk of its area about the centre of pressure, reaches beyond the edge of the face, where the model has a face
        /// as well.
        const BEYOND_EDGE = 1 << 13;
    }
}

impl Status {
    /// No flag.
    pub const OK: Self = Self(0);

    /// Both sets of flags together.
    pub const fn with(self, other: Self) -> Self {
        self.union(other)
    }
}

impl core::fmt::Display for Status {
    /// `ok`, or the names of the flags joined by `+`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if *self == Self::OK {
            return f.write_str("ok");
        }
        for (i, (name, _)) in self.iter_names().enumerate() {
            if i > 0 {
                f.write_str("+")?;
            }
            name.chars().try_for_each(|letter| f.write_char(letter.to_ascii_lowercase()))?;
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
    fn flags_are_written_by_name() {
        assert_eq!(std::format!("{}", Status::OK), "ok");
        let both = Status::POSE_OUT_OF_RANGE.with(Status::BAD_INPUT);
        assert_eq!(std::format!("{both}"), "bad_input+pose_out_of_range");
        assert!(both.contains(Status::BAD_INPUT) && !both.contains(Status::STABILISED));
        assert_eq!(both, Status::POSE_OUT_OF_RANGE | Status::BAD_INPUT);
    }

    /// A number, as files have it.
    #[cfg(feature = "serde")]
    #[test]
    fn flags_are_one_number_in_json() {
        let both = Status::BAD_INPUT.with(Status::LARGE_INCREMENT);
        assert_eq!(serde_json::to_string(&both).unwrap(), "18");
        assert_eq!(serde_json::from_str::<Status>("18").unwrap(), both);
    }

    #[test]
    fn spellings_round_trip() {
        for regime in [Regime::NoContact, Regime::Stick, Regime::PartialSlip, Regime::Slip] {
            assert_eq!(regime.as_str().parse(), Ok(regime));
        }
        assert!("sliding".parse::<Regime>().is_err());
    }
}
