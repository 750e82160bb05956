//! Flags of a robot's fingertip: dimensions, material and friction in place of a configuration file.
//!
//! Main type: [`TipFlags`].

use anyhow::anyhow;
use clap::builder::PossibleValuesParser;
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Bone, BoneKind};
use fingerpad_fe::material::{ASSUMED_POISSON, Material, NeoHooke, PRESETS, Preset};

use super::Failure;

/// A fingertip by its dimensions.
#[derive(clap::Args)]
#[command(next_help_heading = "Fingertip of a robot")]
pub struct TipFlags {
    /// Cylinder with a half-sphere of this radius at its end, on a core of the same form, in place of a shape; with --core-mm,
    /// a material and --mu
    #[arg(long, visible_alias = "dome", value_name = "RADIUS", conflicts_with_all = ["shape", "volume", "imported"], requires = "core_mm")]
    dome_mm: Option<f64>,
    /// Radius of the rigid core of --dome-mm
    #[arg(long, visible_alias = "core", value_name = "RADIUS", requires = "dome_mm")]
    core_mm: Option<f64>,
    /// Length of --dome-mm from the section where it is held to its tip [default: twice the radius]
    #[arg(long, value_name = "LENGTH", requires = "dome_mm")]
    length_mm: Option<f64>,
    /// Flat pad of gel on a rigid plate in place of a shape: length, width, thickness and, if given, the radius of its crown
    /// (default 100, assumed)
    #[arg(long, visible_alias = "flat", value_name = "L,W,T[,R]", conflicts_with_all = ["shape", "volume", "imported", "dome_mm"])]
    flat_mm: Option<String>,
    /// Material of all soft tissue, on a fixed core
    #[arg(long, value_name = "NAME", value_parser = names(), conflicts_with = "young_mpa")]
    material: Option<String>,
    /// The same by its Young's modulus, MPa
    #[arg(long, visible_alias = "young", value_name = "E", value_parser = positive)]
    young_mpa: Option<f64>,
    /// Poisson's ratio of --young-mpa and --material [default: 0.49, assumed]
    #[arg(long, value_name = "NU", value_parser = poisson)]
    poisson: Option<f64>,
    /// Coefficient of Coulomb friction, in place of the friction law
    #[arg(long, value_name = "MU", value_parser = positive)]
    mu: Option<f64>,
}

/// The names of materials.
fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(PRESETS.map(|preset| preset.name))
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if number > 0.0 && f64::is_finite(number) => Ok(number),
        _ => Err("must be a positive number".into()),
    }
}

fn poisson(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if number > 0.0 && number < 0.5 => Ok(number),
        _ => Err("must be a number between 0 and 0.5".into()),
    }
}

impl TipFlags {
    /// Puts the tip into a configuration.
    ///
    /// * `has_file`: whether there is a configuration file, which may give material and friction
    pub fn put(&self, config: &mut Config, has_file: bool) -> Result<(), Failure> {
        let dome = self.dome_mm.zip(self.core_mm).map(|(radius, core)| {
            let length = self.length_mm.map_or_else(String::new, |length| format!(",{length}"));
            format!("dome:{radius},{core}{length}")
        });
        let shape = dome.or_else(|| self.flat_mm.as_ref().map(|numbers| format!("flat:{numbers}")));
        let has_material = self.material.is_some() || self.young_mpa.is_some();
        if let Some(shape) = shape {
            let missing = [
                (has_material, "--material NAME or --young-mpa E: a shape does not state its material"),
                (
                    self.mu.is_some(),
                    "--mu MU: friction follows from no shape and no material; measure it, or assume one",
                ),
            ];
            if let Some((_, what)) = missing.into_iter().find(|(is_given, _)| !(*is_given || has_file)) {
                return Err(Failure::Input(anyhow!("missing {what}")));
            }
            config.shape.0 = shape;
            (config.volume, config.imported) = (None, None);
        }
        let preset = self.material.as_deref().map(Preset::named).transpose().map_err(|e| Failure::Input(anyhow!(e)))?;
        let young_mpa = self.young_mpa.or(preset.map(|preset| preset.young_mpa));
        match (young_mpa, self.poisson) {
            (Some(young_mpa), poisson) => {
                let poisson = poisson.unwrap_or(ASSUMED_POISSON);
                let law = Material::NeoHooke(NeoHooke::from_young(young_mpa, poisson));
                (config.tissue.skin, config.tissue.subcutaneous) = (law, law);
                config.tissue.bone = Bone { kind: BoneKind::Fixed, ..config.tissue.bone };
                if let Some(preset) = preset {
                    eprintln!("note: {}: E = {young_mpa:.3} MPa, {}", preset.name, preset.source);
                }
                if self.poisson.is_none() {
                    eprintln!("note: Poisson's ratio {ASSUMED_POISSON}, assumed");
                }
            }
            (None, Some(_)) => return Err(Failure::Input(anyhow!("--poisson without --young-mpa or --material"))),
            (None, None) => {}
        }
        if let Some(mu) = self.mu {
            config.friction = RubberFriction { lambda: mu, beta: 1.0, tau0_mpa: 0.0, ..config.friction };
        }
        Ok(())
    }
}
