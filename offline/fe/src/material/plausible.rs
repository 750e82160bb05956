//! Stiffnesses that only another unit explains.

use super::Material;
use fingerpad_formats::significant;

/// Kinds of solids with the Young's moduli that they have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stiffness {
    /// Skin, silicone, gel.
    Soft,
    /// Nail.
    Nail,
    /// Bone, core.
    Bone,
    /// A region of linear law, which may be soft or stiff.
    Linear,
}

impl Stiffness {
    /// That of the law of a soft region.
    pub fn of_law(law: &Material) -> Self {
        if matches!(law, Material::Linear(_)) { Self::Linear } else { Self::Soft }
    }

    /// Moduli that are usual, and those beyond which a value is refused, MPa.
    fn ranges(self) -> ([f64; 2], [f64; 2]) {
        match self {
            Self::Soft => ([0.005, 20.0], [1e-4, 1e3]),
            Self::Nail => ([20.0, 2e4], [1e-3, 1e6]),
            Self::Bone => ([50.0, 3e5], [1e-3, 2e6]),
            Self::Linear => ([0.005, 3e5], [1e-4, 2e6]),
        }
    }

    /// What a Young's modulus looks like, if it is unusual, and whether it must be refused.
    pub fn doubt(self, young_mpa: f64) -> Option<Doubt> {
        let ([low, high], [least, most]) = self.ranges();
        if (low..=high).contains(&young_mpa) {
            return None;
        }
        let what = match self {
            Self::Soft => "skin, silicone and gels",
            Self::Nail => "nails",
            Self::Bone => "bones and rigid cores",
            Self::Linear => "solids",
        };
        let guesses: Vec<String> = [("Pa", 1e-6), ("kPa", 1e-3), ("GPa", 1e3)]
            .into_iter()
            .map(|(unit, factor)| (unit, young_mpa * factor))
            .filter(|(_, young_mpa)| (low..=high).contains(young_mpa))
            .map(|(unit, young_mpa)| format!("in {unit} ({} MPa)", significant(young_mpa, 6)))
            .collect();
        let question = if guesses.is_empty() { String::new() } else { format!("; is it {}?", guesses.join(" or ")) };
        Some(Doubt {
            sentence: format!(
                "Young's modulus is {} MPa, and {what} have {} to {} MPa{question}",
                significant(young_mpa, 6),
                significant(low, 3),
                significant(high, 3)
            ),
            is_refused: !(least..=most).contains(&young_mpa),
        })
    }
}

/// A value that is probably in another unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// Value, usual values, and what it would be in another unit.
    pub sentence: String,
    /// Whether nothing can be computed with it.
    pub is_refused: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_units_are_recognised_and_the_value_in_mpa_is_proposed() {
        for (young, refused, proposed) in [
            // 30 kPa, 0.6 MPa and 3 MPa in Pa, kPa and GPa.
            (30e3, true, "; is it in Pa (0.03 MPa)?"),
            (30.0, false, "; is it in kPa (0.03 MPa)?"),
            (3e-5, true, "; is it in GPa (0.03 MPa)?"),
            (600e3, true, "; is it in Pa (0.6 MPa)?"),
            (600.0, false, "; is it in kPa (0.6 MPa)?"),
            (6e-4, false, "; is it in GPa (0.6 MPa)?"),
            (3e6, true, "; is it in Pa (3 MPa)?"),
            (3e3, true, "; is it in kPa (3 MPa)?"),
            (3e-3, false, "; is it in GPa (3 MPa)?"),
            (10e3, true, "; is it in Pa (0.01 MPa) or in kPa (10 MPa)?"),
            (1e-9, true, " to 20 MPa"),
        ] {
            let doubt = Stiffness::Soft.doubt(young).unwrap();
            assert!(doubt.is_refused == refused && doubt.sentence.ends_with(proposed), "{doubt:?}");
        }
        for young in [0.01, 0.03, 0.6, 3.0, 10.0] {
            assert_eq!(Stiffness::Soft.doubt(young), None);
        }
        for (kind, gpa) in [(Stiffness::Bone, 17.0), (Stiffness::Nail, 2.0)] {
            let doubt = kind.doubt(gpa).unwrap();
            let proposed = format!("in GPa ({} MPa)", 1e3 * gpa);
            assert!(!doubt.is_refused && doubt.sentence.contains(&proposed), "{doubt:?}");
            assert!(kind.doubt(gpa * 1e9).unwrap().is_refused);
            assert_eq!(kind.doubt(gpa * 1e3), None);
            assert_eq!(Stiffness::Linear.doubt(gpa * 1e3), None);
        }
    }
}
