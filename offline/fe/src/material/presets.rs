//! Materials of robot fingertips by name, each with the source of its numbers.
//!
//! Main type: [`Preset`]. Uses the laws.

use serde::{Deserialize, Deserializer, de::Error};

use super::{Material, NeoHooke};

/// A material by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Its name in flags and files.
    pub name: &'static str,
    /// Young's modulus at small strain, MPa.
    pub young_mpa: f64,
    /// Source of the modulus, year.
    pub source: &'static str,
}

/// Young's modulus of a neo-Hookean rubber over its stress at 100 % of strain: E = 3 mu and stress mu (2 - 1/4).
const OF_STRESS_AT_100_PERCENT: f64 = 3.0 / 1.75;
/// Pounds per square inch, MPa.
const PSI_MPA: f64 = 0.006_894_757;
const SMOOTH_ON: &str = "stress at 100 % of strain of the maker's data sheet (Smooth-On), as neo-Hookean rubber";

/// The materials. No source states a Poisson's ratio.
pub const PRESETS: [Preset; 4] = [
    Preset { name: "ecoflex-00-30", young_mpa: 10.0 * PSI_MPA * OF_STRESS_AT_100_PERCENT, source: SMOOTH_ON },
    Preset { name: "dragon-skin-10", young_mpa: 22.0 * PSI_MPA * OF_STRESS_AT_100_PERCENT, source: SMOOTH_ON },
    Preset { name: "dragon-skin-30", young_mpa: 86.0 * PSI_MPA * OF_STRESS_AT_100_PERCENT, source: SMOOTH_ON },
    Preset {
        name: "sylgard-184",
        young_mpa: 1.32,
        source: "cured at 25 °C; 2.97 MPa at 200 °C (Johnston et al. 2014, J. Micromech. Microeng. 24:035017)",
    },
];

/// Poisson's ratio of all of them: assumed, nearly incompressible as rubber is.
pub const ASSUMED_POISSON: f64 = 0.49;

impl Preset {
    /// The material of a name.
    ///
    /// # Errors
    /// The names there are.
    pub fn named(name: &str) -> Result<Self, String> {
        PRESETS
            .into_iter()
            .find(|preset| preset.name == name)
            .ok_or_else(|| format!("no material `{name}`; there are {}", PRESETS.map(|preset| preset.name).join(", ")))
    }

    /// Its law.
    pub fn material(self) -> Material {
        Material::NeoHooke(NeoHooke::from_young(self.young_mpa, ASSUMED_POISSON))
    }
}

/// A material by name, or by the table of its law.
pub(crate) fn named_or_table<'de, D: Deserializer<'de>>(from: D) -> Result<Material, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Given {
        Name(String),
        Table(toml::Table),
    }
    match Given::deserialize(from)? {
        Given::Name(name) => Preset::named(&name).map(Preset::material).map_err(D::Error::custom),
        Given::Table(table) => table.try_into().map_err(D::Error::custom),
    }
}
