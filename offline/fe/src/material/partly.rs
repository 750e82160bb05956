//! A material's table in a settings file: keys that are left out keep the named material's defaults.

use std::collections::BTreeMap;

use fingerpad_formats::units::{finite, non_zero, poisson, positive, strict_poisson};
use serde::{Deserialize, Deserializer, de::Error};

use super::hyperelastic::d_of_poisson;
use super::{
    Hyperelastic, MOST_OGDEN_TERMS, Material, MooneyRivlin, NeoHooke, Ogden, OgdenSeries, OgdenTerm, STABLE_STRETCHES,
    SaintVenantKirchhoff, Yeoh, first_instability,
};

/// Which law a table gives.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    #[default]
    Ogden,
    Elastic,
    NeoHooke,
    MooneyRivlin,
    Yeoh,
    SaintVenantKirchhoff,
}

impl Kind {
    /// Its name and keys.
    fn keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Ogden => ("ogden", &["mu_mpa", "alpha", "terms", "d_per_mpa", "poisson"]),
            Self::Elastic => ("elastic", &["young_mpa", "poisson"]),
            Self::NeoHooke => ("neo_hooke", &["mu_mpa", "d_per_mpa", "poisson"]),
            Self::MooneyRivlin => ("mooney_rivlin", &["c10_mpa", "c01_mpa", "d_per_mpa", "poisson"]),
            Self::Yeoh => ("yeoh", &["c10_mpa", "c20_mpa", "c30_mpa", "d_per_mpa", "poisson"]),
            Self::SaintVenantKirchhoff => ("saint_venant_kirchhoff", &["young_mpa", "poisson"]),
        }
    }
}

/// Every key that a table of a soft region's law may have.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Keys {
    kind: Kind,
    #[serde(deserialize_with = "some_positive")]
    mu_mpa: Option<f64>,
    #[serde(deserialize_with = "some_non_zero")]
    alpha: Option<f64>,
    #[serde(deserialize_with = "some_positive")]
    d_per_mpa: Option<f64>,
    #[serde(deserialize_with = "some_strict_poisson")]
    poisson: Option<f64>,
    #[serde(deserialize_with = "some_positive")]
    young_mpa: Option<f64>,
    #[serde(deserialize_with = "some_finite")]
    c10_mpa: Option<f64>,
    #[serde(deserialize_with = "some_finite")]
    c01_mpa: Option<f64>,
    #[serde(deserialize_with = "some_finite")]
    c20_mpa: Option<f64>,
    #[serde(deserialize_with = "some_finite")]
    c30_mpa: Option<f64>,
    terms: Option<Vec<OgdenTerm>>,
}

impl Keys {
    /// The law; parameters absent from a one-term Ogden law are those of `default`.
    fn material(&self, default: Option<Ogden>) -> Result<Material, String> {
        self.refuse_keys_of_other_laws()?;
        match self.kind {
            Kind::Ogden => self.ogden(default),
            Kind::Elastic => {
                let (young_mpa, poisson) =
                    (self.need("young_mpa", self.young_mpa)?, self.need("poisson", self.poisson)?);
                stable(NeoHooke::from_young(young_mpa, poisson)).map(Material::NeoHooke)
            }
            Kind::NeoHooke => {
                let mu_mpa = self.need("mu_mpa", self.mu_mpa)?;
                stable(NeoHooke { mu_mpa, d_per_mpa: self.d_per_mpa(mu_mpa)? }).map(Material::NeoHooke)
            }
            Kind::MooneyRivlin => {
                let (c10_mpa, c01_mpa) = (self.need("c10_mpa", self.c10_mpa)?, self.need("c01_mpa", self.c01_mpa)?);
                let shear_mpa = positive_shear("2 (c10_mpa + c01_mpa)", 2.0 * (c10_mpa + c01_mpa))?;
                let d_per_mpa = self.d_per_mpa(shear_mpa)?;
                stable(MooneyRivlin { c10_mpa, c01_mpa, d_per_mpa }).map(Material::MooneyRivlin)
            }
            Kind::Yeoh => {
                let c10_mpa = self.need("c10_mpa", self.c10_mpa)?;
                let (c20_mpa, c30_mpa) = (self.need("c20_mpa", self.c20_mpa)?, self.need("c30_mpa", self.c30_mpa)?);
                let d_per_mpa = self.d_per_mpa(positive_shear("2 c10_mpa", 2.0 * c10_mpa)?)?;
                stable(Yeoh { c10_mpa, c20_mpa, c30_mpa, d_per_mpa }).map(Material::Yeoh)
            }
            Kind::SaintVenantKirchhoff => Ok(Material::Linear(SaintVenantKirchhoff {
                young_mpa: self.need("young_mpa", self.young_mpa)?,
                poisson: self.need("poisson", self.poisson)?,
            })),
        }
    }

    fn ogden(&self, default: Option<Ogden>) -> Result<Material, String> {
        let Some(terms) = &self.terms else {
            let mu_mpa = self.need("mu_mpa", self.mu_mpa.or(default.map(|law| law.mu_mpa)))?;
            let alpha = self.need("alpha", self.alpha.or(default.map(|law| law.alpha)))?;
            let usual = default.filter(|_| self.d_per_mpa.is_none() && self.poisson.is_none());
            let d_per_mpa = usual.map_or_else(|| self.d_per_mpa(mu_mpa), |law| Ok(law.d_per_mpa))?;
            return stable(Ogden { mu_mpa, alpha, d_per_mpa }).map(Material::Ogden);
        };
        if self.mu_mpa.is_some() || self.alpha.is_some() {
            return Err("`terms` beside `mu_mpa` or `alpha`: give either the terms or the constants of one term".into());
        }
        let shear_mpa = positive_shear("the sum of mu_mpa over `terms`", terms.iter().map(|term| term.mu_mpa).sum())?;
        let d_per_mpa = self.d_per_mpa(shear_mpa)?;
        if let [OgdenTerm { mu_mpa, alpha }] = terms[..] {
            return stable(Ogden { mu_mpa, alpha, d_per_mpa }).map(Material::Ogden);
        }
        let law = OgdenSeries::new(terms, d_per_mpa)
            .ok_or_else(|| format!("`terms` has {} terms; an Ogden law has 1 to {MOST_OGDEN_TERMS}", terms.len()))?;
        stable(law).map(Material::OgdenSeries)
    }

    fn refuse_keys_of_other_laws(&self) -> Result<(), String> {
        let numbers = [
            ("mu_mpa", self.mu_mpa),
            ("alpha", self.alpha),
            ("d_per_mpa", self.d_per_mpa),
            ("poisson", self.poisson),
            ("young_mpa", self.young_mpa),
            ("c10_mpa", self.c10_mpa),
            ("c01_mpa", self.c01_mpa),
            ("c20_mpa", self.c20_mpa),
            ("c30_mpa", self.c30_mpa),
        ];
        let terms = self.terms.as_ref().map(|_| "terms".to_owned());
        let given = numbers.into_iter().filter_map(|(key, value)| Some((key, format!("{key} = {}", value?))));
        let mut given = given.chain(terms.map(|text| ("terms", text)));
        let (kind, allowed) = self.kind.keys();
        match given.find(|(key, _)| !allowed.contains(key)) {
            None => Ok(()),
            Some((_, text)) => {
                Err(format!("`{text}` is no key of kind = \"{kind}\", which has {}", allowed.join(", ")))
            }
        }
    }

    fn need(&self, key: &str, value: Option<f64>) -> Result<f64, String> {
        let (kind, keys) = self.kind.keys();
        value.ok_or_else(|| format!("`{key}` is missing: kind = \"{kind}\" has {}", keys.join(", ")))
    }

    /// Compressibility of a law with this shear modulus, 1/MPa.
    fn d_per_mpa(&self, shear_mpa: f64) -> Result<f64, String> {
        match (self.d_per_mpa, self.poisson) {
            (Some(d_per_mpa), None) => Ok(d_per_mpa),
            (None, Some(poisson)) => Ok(d_of_poisson(shear_mpa, poisson)),
            (None, None) => Err("`d_per_mpa` (2 over the bulk modulus) or `poisson` is missing".into()),
            (Some(d), Some(nu)) => {
                Err(format!("d_per_mpa = {d} and poisson = {nu} are both given; one follows from the other"))
            }
        }
    }
}

fn positive_shear(what: &str, shear_mpa: f64) -> Result<f64, String> {
    if shear_mpa > 0.0 && shear_mpa.is_finite() {
        return Ok(shear_mpa);
    }
    Err(format!("the shear modulus, {what}, is {shear_mpa} MPa; it must be a finite number greater than 0"))
}

/// Refuses a law that is not stable in the range of stretches of tissue and rubber.
fn stable<L: Hyperelastic>(law: L) -> Result<L, String> {
    let [low, high] = STABLE_STRETCHES;
    match first_instability(&law) {
        None => Ok(law),
        Some([a, b, c]) => Err(format!(
            "the law is not stable (Drucker): at principal stretches {a:.3}, {b:.3}, {c:.3} stress falls while strain \
             grows; it must be stable for all stretches from {low} to {high}"
        )),
    }
}

fn some_positive<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    positive(from).map(Some)
}

fn some_finite<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    finite(from).map(Some)
}

fn some_non_zero<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    non_zero(from).map(Some)
}

fn some_poisson<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    poisson(from).map(Some)
}

fn some_strict_poisson<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    strict_poisson(from).map(Some)
}

impl<'de> Deserialize<'de> for Material {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Keys::deserialize(from)?.material(None).map_err(D::Error::custom)
    }
}

/// The law of a soft region; parameters absent from a one-term Ogden law are those of `default`.
pub fn soft<'de, D: Deserializer<'de>>(from: D, default: Ogden) -> Result<Material, D::Error> {
    Keys::deserialize(from)?.material(Some(default)).map_err(D::Error::custom)
}

/// The keys of [`SaintVenantKirchhoff`] that a file gives.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SaintVenantKirchhoffKeys {
    #[serde(default, deserialize_with = "some_positive")]
    young_mpa: Option<f64>,
    #[serde(default, deserialize_with = "some_poisson")]
    poisson: Option<f64>,
}

/// A Saint Venant-Kirchhoff material; parameters absent from the file are those of `default`.
pub fn saint_venant_kirchhoff<'de, D: Deserializer<'de>>(
    from: D,
    default: SaintVenantKirchhoff,
) -> Result<SaintVenantKirchhoff, D::Error> {
    let keys = SaintVenantKirchhoffKeys::deserialize(from)?;
    Ok(SaintVenantKirchhoff {
        young_mpa: keys.young_mpa.unwrap_or(default.young_mpa),
        poisson: keys.poisson.unwrap_or(default.poisson),
    })
}

/// Names that no soft region of its own may have: those of the regions and sets that every fingertip has.
const TAKEN: [&str; 9] =
    ["skin", "subcutaneous", "bone", "proximal_bone", "nail", "pad", "nail_fix", "proximal_fix", "plane"];

/// Laws of named soft regions.
pub fn regions<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeMap<String, Material>, D::Error> {
    let laws = BTreeMap::<String, Material>::deserialize(from)?;
    match laws.keys().find(|name| name.is_empty() || TAKEN.iter().any(|taken| name.eq_ignore_ascii_case(taken))) {
        None => Ok(laws),
        Some(name) => Err(D::Error::custom(format!(
            "a soft region of its own cannot be called `{name}`; {} are regions and sets of every fingertip",
            TAKEN.join(", ")
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load_path::Tissue;

    fn tissue(text: &str) -> Result<Tissue, String> {
        toml::from_str(text).map_err(|e: toml::de::Error| e.to_string())
    }

    fn skin(keys: &str) -> Result<Material, String> {
        tissue(&format!("[skin]\n{keys}")).map(|tissue| tissue.skin)
    }

    #[test]
    fn every_kind_is_read_and_comes_back_from_what_is_printed() {
        let ogden = |mu_mpa, alpha, d_per_mpa| Material::Ogden(Ogden { mu_mpa, alpha, d_per_mpa });
        let terms = [(0.4, 1.3), (-0.01, 0.5)].map(|(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha });
        let series = Material::OgdenSeries(OgdenSeries::new(&terms, 0.5).unwrap());
        let yeoh = Yeoh { c10_mpa: 0.2, c20_mpa: -0.001, c30_mpa: 1e-4, d_per_mpa: 0.5 };
        for (keys, law) in [
            ("alpha = 2.5", ogden(0.034, 2.5, 1.0)),
            ("kind = 'ogden'\nd_per_mpa = 3", ogden(0.034, 1.4, 3.0)),
            ("mu_mpa = 0.1\npoisson = 0.25", ogden(0.1, 1.4, 12.0)),
            ("terms = [{ mu_mpa = 0.1, alpha = 3 }]\nd_per_mpa = 2", ogden(0.1, 3.0, 2.0)),
            ("terms = [{ mu_mpa = 0.4, alpha = 1.3 }, { mu_mpa = -0.01, alpha = 0.5 }]\nd_per_mpa = 0.5", series),
            (
                "kind = 'neo_hooke'\nmu_mpa = 0.5\nd_per_mpa = 2",
                Material::NeoHooke(NeoHooke { mu_mpa: 0.5, d_per_mpa: 2.0 }),
            ),
            // mu = 1/2.5, K = 1/1.5, D = 3.
            (
                "kind = 'elastic'\nyoung_mpa = 1\npoisson = 0.25",
                Material::NeoHooke(NeoHooke { mu_mpa: 0.4, d_per_mpa: 3.0 }),
            ),
            (
                "kind = 'mooney_rivlin'\nc10_mpa = 0.3\nc01_mpa = 0.2\npoisson = 0.25",
                Material::MooneyRivlin(MooneyRivlin { c10_mpa: 0.3, c01_mpa: 0.2, d_per_mpa: 1.2 }),
            ),
            ("kind = 'yeoh'\nc10_mpa = 0.2\nc20_mpa = -0.001\nc30_mpa = 1e-4\nd_per_mpa = 0.5", Material::Yeoh(yeoh)),
            (
                "kind = 'saint_venant_kirchhoff'\nyoung_mpa = 1\npoisson = 0.25",
                Material::Linear(SaintVenantKirchhoff { young_mpa: 1.0, poisson: 0.25 }),
            ),
        ] {
            let found = skin(keys).unwrap();
            let numbers = |law: &Material| serde_json::to_value(law).unwrap();
            assert_eq!(std::mem::discriminant(&found), std::mem::discriminant(&law), "{keys}");
            let (found_numbers, expected) = (numbers(&found).to_string(), numbers(&law).to_string());
            assert!(found == law || found_numbers == expected, "{keys}: {found_numbers} instead of {expected}");
            let printed = toml::to_string(&Tissue { skin: found, ..Tissue::default() }).unwrap();
            assert_eq!(tissue(&printed).unwrap().skin, found, "{printed}");
        }
    }

    #[test]
    fn wrong_keys_and_values_are_refused_by_name_value_and_bound() {
        for (keys, message) in [
            ("mu_mpa = -1", &["line 2", "-1 is not a finite number greater than 0"][..]),
            ("alpha = 0", &["line 2", "0 is not a finite number other than 0"]),
            ("kind = 'hooke'", &["line 2", "hooke", "mooney_rivlin"]),
            ("kind = 'elastic'\nyoung_mpa = 1\npoisson = 0.5", &["line 4", "0.5 is not a number between 0 and 0.5"]),
            ("kind = 'elastic'\nyoung_mpa = 1\npoisson = 0", &["line 4", "both excluded"]),
            ("kind = 'elastic'\nyoung_mpa = 1", &["`poisson` is missing", "elastic"]),
            (
                "kind = 'neo_hooke'\nmu_mpa = 1\nalpha = 2\nd_per_mpa = 1",
                &["`alpha = 2` is no key of kind = \"neo_hooke\""],
            ),
            ("kind = 'neo_hooke'\nmu_mpa = 1", &["`d_per_mpa` (2 over the bulk modulus) or `poisson` is missing"]),
            ("mu_mpa = 1\nd_per_mpa = 1\npoisson = 0.4", &["d_per_mpa = 1 and poisson = 0.4 are both given"]),
            ("kind = 'yeoh'\nc10_mpa = -0.2\nc20_mpa = 0\nc30_mpa = 0\nd_per_mpa = 1", &["2 c10_mpa, is -0.4 MPa"]),
            (
                "kind = 'yeoh'\nc10_mpa = 0.2\nc20_mpa = -0.1\nc30_mpa = 0\nd_per_mpa = 1",
                &["not stable (Drucker): at principal stretches 1.", "from 0.5 to 2"],
            ),
            ("kind = 'mooney_rivlin'\nc10_mpa = 0.2\nc01_mpa = -0.1\nd_per_mpa = 1", &["not stable (Drucker)"]),
            ("terms = []\nd_per_mpa = 1", &["the sum of mu_mpa over `terms`, is", "greater than 0"]),
            ("terms = [{ mu_mpa = 1, alpha = 2 }]\nalpha = 1\nd_per_mpa = 1", &["`terms` beside"]),
            ("terms = [{ mu_mpa = 1, alpha = 0 }]\nd_per_mpa = 1", &["line 2", "other than 0"]),
            ("terms = [{ mu_mpa = 1, alfa = 2 }]\nd_per_mpa = 1", &["line 2", "alfa"]),
        ] {
            let error = skin(keys).unwrap_err();
            for part in message {
                assert!(error.contains(part), "{keys}:\n{error}\nlacks {part}");
            }
        }
        let seven = ["{ mu_mpa = 1, alpha = 2 }"; 7].join(", ");
        let error = skin(&format!("terms = [{seven}]\nd_per_mpa = 1")).unwrap_err();
        assert!(error.contains("`terms` has 7 terms; an Ogden law has 1 to 6"), "{error}");
    }

    #[test]
    fn named_regions_need_whole_laws_and_names_of_their_own() {
        let law = "kind = 'elastic'\nyoung_mpa = 0.6\npoisson = 0.49";
        let found = tissue(&format!("[regions.core]\n{law}\n[regions.'inner gel']\n{law}")).unwrap();
        assert_eq!(found.regions.keys().collect::<Vec<_>>(), ["core", "inner gel"]);
        let error = tissue("[regions.core]\nalpha = 2").unwrap_err();
        assert!(error.contains("`mu_mpa` is missing"), "{error}");
        for name in ["skin", "Nail", "pad", "PLANE"] {
            let error = tissue(&format!("[regions.{name}]\n{law}")).unwrap_err();
            assert!(error.contains(&format!("cannot be called `{name}`")), "{error}");
        }
    }
}
