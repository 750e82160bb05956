//! The main experiment: press to each measured depth, slide until the friction is kinetic.
//!
//! Main types: [`Config`], [`Experiment`]. May use: load_path and the modules that it uses; `fingerpad-formats` for
//! label volumes and imported meshes.

mod check;
mod error;
mod pad;
mod rigid_body;
mod runs;

pub use error::ConfigError;
pub use pad::pad_height_mm;
pub use rigid_body::{BodyKind, RigidBodySettings};
pub use runs::{frictionless, press, press_and_slide};

use std::ops::RangeInclusive;
use std::path::{Path as FilePath, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::contact::RubberFriction;
use crate::load_path::{BoneKind, Clearance, Drive, Finger, Numerics, Path, Problem, Tissue, Waypoint};
use crate::mesh::{
    self, Fingertip, FingertipShape, FlatPad, MeshPreset,
    imported::{ImportReport, ImportedGeometry, RawMesh, imported_fingertip},
    volume::{LabelVolume, VolumeGeometry, VolumeReport, volume_fingertip},
};
use fingerpad_formats as formats;

/// Settings of the experiment: geometry, materials, law, numerics, depths.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Shape of the fingertip: the name of a built-in one, or a geometry file.
    pub shape: Shape,
    /// Resolution of its mesh.
    pub mesh_preset: MeshPreset,
    /// In place of a shape: a labelled volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<VolumeGeometry>,
    /// In place of a shape: a mesh of another program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imported: Option<ImportedGeometry>,
    /// The rigid body; excluded from the settings' hash if it is the plane.
    #[serde(skip_serializing_if = "RigidBodySettings::is_plane")]
    pub rigid_body: RigidBodySettings,
    /// Materials and bones.
    pub tissue: Tissue,
    /// Friction law.
    pub friction: RubberFriction,
    /// Contact, equilibrium, increments.
    pub numerics: Numerics,
    /// Depths and slide.
    pub experiment: Experiment,
}

/// Source of a shape.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Shape(pub String);

impl Default for Shape {
    fn default() -> Self {
        Self("e".into())
    }
}

/// The numbers of a parametric fingertip.
#[derive(Serialize)]
#[serde(untagged)]
enum Solid {
    Shape(Box<FingertipShape>),
    Flat(FlatPad),
}

/// Source of a fingertip, and the quality of its import.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// A parametric shape.
    Shape(Box<FingertipShape>),
    /// A labelled volume; the shape is the template nearest to it.
    Volume(Box<FingertipShape>, VolumeReport),
    /// A mesh of another program.
    Imported(ImportReport),
}

/// Depths and slide of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Experiment {
    /// Depths, mm, rising.
    pub depths_mm: Vec<f64>,
    /// Slide from proximal to distal, mm.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub slide_mm: f64,
    /// Speed of press and slide, mm/s; without branches of the tissue it sets the time column only.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub speed_mm_s: f64,
}

impl Experiment {
    /// The press to the deepest of the depths that are numbers.
    pub fn deepest_press(&self) -> Path {
        press_to(self.depths_mm.iter().copied().filter(|depth| depth.is_finite()).fold(0.0, f64::max))
    }
}

/// A press to `depth_mm`.
pub fn press_to(depth_mm: f64) -> Path {
    let corner = |t_s, normal| Waypoint { t_s, normal, x: 0.0, y: 0.0 };
    Path::new([Drive::Displacement; 3], vec![corner(0.0, 0.0), corner(1.0, depth_mm)])
}

impl Default for Experiment {
    /// Yoshida et al. 2011: four depths, 2 mm/s; 6 mm of slide.
    fn default() -> Self {
        Self { depths_mm: vec![0.75, 1.0, 1.25, 1.5], slide_mm: 6.0, speed_mm_s: 2.0 }
    }
}

impl Config {
    /// Reads a configuration file; the files that it names are looked for beside it.
    ///
    /// # Errors
    /// [`ConfigError`] with file, line and value.
    pub fn read(path: &FilePath) -> Result<Self, ConfigError> {
        let mut config: Self = read_toml(path)?;
        config.relative_to(path.parent().unwrap_or(FilePath::new("")));
        Ok(config)
    }

    /// Takes the files that the configuration names as standing beside it, in `folder`.
    pub fn relative_to(&mut self, folder: &FilePath) {
        if !(FingertipShape::is_name(&self.shape.0) || self.shape.0.starts_with("flat:")) {
            self.shape.0 = folder.join(&self.shape.0).display().to_string();
        }
        let files = [
            self.volume.as_mut().map(|v| &mut v.file),
            self.imported.as_mut().map(|i| &mut i.file),
            self.rigid_body.file.as_mut(),
        ];
        files.into_iter().flatten().for_each(|file| *file = folder.join(&*file));
    }

    /// Name of the geometry: the shape's name, or the file of a volume or mesh.
    pub fn geometry_name(&self) -> String {
        let file = self.volume.as_ref().map(|v| &v.file).or(self.imported.as_ref().map(|i| &i.file));
        file.map_or(self.shape.0.clone(), |file| file.display().to_string())
    }

    /// The geometry.
    ///
    /// # Errors
    /// [`ConfigError::Mesh`] if there is no such shape or its numbers do not make a finger.
    pub fn fingertip_shape(&self) -> Result<FingertipShape, ConfigError> {
        if FingertipShape::is_name(&self.shape.0) {
            return Ok(FingertipShape::named(&self.shape.0)?);
        }
        if FlatPad::named(&self.shape.0)?.is_some() {
            return Err(ConfigError::FlatPad(self.shape.0.clone()));
        }
        let path = PathBuf::from(&self.shape.0);
        if path.extension().is_none() {
            // Not a file: the library's error lists the names.
            return Ok(FingertipShape::named(&self.shape.0)?);
        }
        let text = std::fs::read_to_string(&path).map_err(|source| ConfigError::File { path, source })?;
        Ok(FingertipShape::from_toml(&self.shape.0, &text)?)
    }

    /// The checked mesh and its source.
    ///
    /// # Errors
    /// [`ConfigError`]: of the shape, of the file, or of the file's contents.
    pub fn fingertip(&self) -> Result<(Fingertip, Origin), ConfigError> {
        if let Some((section, doubt)) = self.tissue.doubts().into_iter().find(|(_, doubt)| doubt.is_refused) {
            return Err(ConfigError::Stiffness { section, problem: doubt.sentence });
        }
        if let (Some(name), None) = (self.tissue.regions.keys().next(), &self.imported) {
            let geometry = if self.volume.is_some() { "a label volume" } else { "a parametric fingertip" };
            return Err(ConfigError::NoSuchRegion(name.clone(), geometry));
        }
        match (&self.volume, &self.imported) {
            (Some(_), Some(_)) => Err(ConfigError::TwoGeometries),
            (Some(settings), None) => {
                let made = volume_fingertip(&read_volume(settings)?, settings, &self.mesh_preset.divisions());
                let made =
                    made.map_err(|e| ConfigError::Volume { path: settings.file.clone(), source: Box::new(e) })?;
                Ok((made.fingertip, Origin::Volume(Box::new(made.template), made.report)))
            }
            (None, Some(settings)) => self.import(&read_mesh(settings)?, settings, &settings.file),
            (None, None) => {
                if let Some(pad) = FlatPad::named(&self.shape.0)? {
                    let (raw, settings) = pad.mesh(&self.mesh_preset.divisions());
                    return self.import(&raw, &settings, FilePath::new(&self.shape.0));
                }
                let shape = self.fingertip_shape()?;
                Ok((mesh::fingertip(&shape, &self.mesh_preset.divisions())?, Origin::Shape(Box::new(shape))))
            }
        }
    }

    /// The fingertip of a mesh, of which errors name `source`.
    fn import(
        &self,
        raw: &RawMesh,
        settings: &ImportedGeometry,
        source: &FilePath,
    ) -> Result<(Fingertip, Origin), ConfigError> {
        let soft_regions: Vec<String> = self.tissue.regions.keys().cloned().collect();
        let made = imported_fingertip(raw, settings, &soft_regions)
            .map_err(|e| ConfigError::Import { path: source.to_path_buf(), source: Box::new(e) })?;
        let hollow = settings.sets.bone.is_some() || settings.sets.proximal_bone.is_some();
        if self.tissue.bone.kind == BoneKind::Deformable && (hollow || made.report.attached_nodes > 0) {
            return Err(ConfigError::BonesNotMeshed);
        }
        Ok((made.fingertip, Origin::Imported(made.report)))
    }

    /// Mesh and body, checked; the friction law too, before the seconds that a mesh takes.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn finger(&self) -> Result<(Finger, mesh::FirstTouch), ConfigError> {
        self.friction.check().map_err(ConfigError::Friction)?;
        let (fingertip, _) = self.fingertip()?;
        let touch = fingertip.touch;
        Ok((self.touching(Finger::new(fingertip, &self.tissue)?)?, touch))
    }

    /// The finger with the rigid body of the settings.
    fn touching(&self, finger: Finger) -> Result<Finger, ConfigError> {
        Ok(Finger { rigid_body: self.rigid_body.read()?, ..finger })
    }

    /// Hash of everything that the results depend on: the settings, the shape's numbers, the program's version.
    ///
    /// # Errors
    /// As [`Self::fingertip_shape`].
    pub fn hash(&self) -> Result<String, ConfigError> {
        let shape = match FlatPad::named(&self.shape.0)? {
            Some(pad) => Solid::Flat(pad),
            None => Solid::Shape(Box::new(self.fingertip_shape()?)),
        };
        let all = (env!("CARGO_PKG_VERSION"), shape, self.mesh_preset, &self.tissue, self.friction, self.numerics);
        let mut text = serde_json::to_string(&(all, &self.experiment)).expect("plain numbers");
        // The content of a file enters the hash, its path does not.
        if let Some(settings) = &self.volume {
            let settings_only = VolumeGeometry { file: PathBuf::new(), ..settings.clone() };
            text += &format!("{settings_only:?}{:?}", read_volume(settings)?);
        }
        if let Some(settings) = &self.imported {
            let settings_only = ImportedGeometry { file: PathBuf::new(), ..settings.clone() };
            text += &format!("{settings_only:?}{:?}", read_mesh(settings)?);
        }
        if !self.rigid_body.is_plane() {
            text += &format!("{:?}", self.rigid_body.read()?);
        }
        Ok(Sha256::digest(text).iter().take(8).map(|b| format!("{b:02x}")).collect())
    }

    /// Factor on the penalty of contact: stiffness over thickness of the finger over those of the human one, so that the
    /// penalty is neither lost in the tissue's stiffness nor hides it. 1 for all fingers near the human one, whose runs are
    /// stored.
    fn penalty_factor(&self, thickness_mm: f64) -> f64 {
        let thickness = if thickness_mm.is_finite() { thickness_mm / HUMAN_THICKNESS_MM } else { 1.0 };
        let factor = self.tissue.stiffness() / thickness;
        if HUMAN_PENALTY_SERVES.contains(&factor) { 1.0 } else { factor }
    }

    /// The problem of a finger.
    pub fn problem<'a>(&self, finger: &'a Finger) -> Problem<'a> {
        let clearance_mm = Clearance::of(finger).depth_mm;
        let mut penalty = self.numerics.contact;
        penalty.penalty_mpa_per_mm *= self.penalty_factor(clearance_mm);
        Problem {
            body: &finger.body,
            pad_faces: (&finger.mesh).into(),
            rigid_body: finger.rigid_body.clone(),
            outline: finger.outline.clone(),
            half: finger.half.as_ref().filter(|_| self.numerics.symmetry.is_auto()),
            friction: Some(self.friction),
            penalty,
            settings: self.numerics.solver,
            load_steps: self.numerics.load_steps,
            neutral_pitch_deg: finger.neutral_pitch_deg,
            obstacles: &finger.obstacles,
            beside_pad: &finger.beside_pad,
            clearance_mm,
            relaxation: finger.relaxation,
            observed: None,
        }
    }
}

/// Height of the bone above first touch in the human finger, mm.
const HUMAN_THICKNESS_MM: f64 = 6.5;
/// Stiffness over thickness, over those of the human finger, at which its penalty serves.
const HUMAN_PENALTY_SERVES: RangeInclusive<f64> = 0.1..=100.0;

/// Configurations of the fingers that ship, by the names that stand for their files: the paper's finger, which is the default,
/// and the same finger with tissue that stiffens.
pub const SHIPPED: [(&str, &str); 2] = [("human", ""), ("human-stiffening", include_str!("human-stiffening.toml"))];

/// Reads a TOML file, or what ships under its name, into a type that defines the keys.
///
/// # Errors
/// [`ConfigError::File`], or [`ConfigError::Toml`] with line and value.
pub fn read_toml<T: serde::de::DeserializeOwned>(path: &FilePath) -> Result<T, ConfigError> {
    let shipped = SHIPPED.iter().find(|(name, _)| path == FilePath::new(name));
    let text = match shipped {
        Some((_, text)) => (*text).to_owned(),
        None => {
            std::fs::read_to_string(path).map_err(|source| ConfigError::File { path: path.to_path_buf(), source })?
        }
    };
    toml::from_str(&text).map_err(|e| ConfigError::Toml { path: path.to_path_buf(), message: e.to_string() })
}

fn read_volume(settings: &VolumeGeometry) -> Result<LabelVolume, ConfigError> {
    Ok(formats::volume::read(&settings.file)?)
}

fn read_mesh(settings: &ImportedGeometry) -> Result<RawMesh, ConfigError> {
    let path = &settings.file;
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("inp") => Ok(formats::inp_reader::read(path)?),
        Some("msh") => Ok(formats::msh_reader::read(path)?),
        _ => {
            let problem = "the name of an imported mesh ends in .inp or .msh".into();
            Err(formats::Error::Content { path: path.clone(), problem }.into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_depends_on_what_a_volume_holds_and_not_on_where_it_lies() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.nrrd"), dir.path().join("b.nii"));
        let mut volume = LabelVolume::new([2, 2, 2], [0.5, 0.5, 0.5], vec![0, 1, 2, 3, 0, 1, 2, 3]);
        formats::volume::write(&a, &volume).unwrap();
        formats::volume::write(&b, &volume).unwrap();
        let hash = |file: &FilePath, noise: f64| {
            let geometry = VolumeGeometry { file: file.into(), noise, ..Default::default() };
            Config { volume: Some(geometry), ..Config::default() }.hash().unwrap()
        };
        let first = hash(&a, 1.0);
        assert_eq!(first, hash(&b, 1.0));
        assert_ne!(first, hash(&a, 1.5));
        assert_ne!(first, Config::default().hash().unwrap());
        volume.labels[0] = 1;
        formats::volume::write(&a, &volume).unwrap();
        assert_ne!(first, hash(&a, 1.0));
    }

    /// The hash of stored runs is over this text.
    #[test]
    fn materials_of_today_are_hashed_as_ever() {
        let elastic = "\"bone\":{\"kind\":\"floating\",\"elastic\":{\"young_mpa\":10000.0,\"poisson\":0.3},\
                       \"joint\":{\"translation_n_per_mm\":1.0,\"rotation_nmm_per_rad\":50.0}}";
        let expected = format!(
            "{{\"skin\":{{\"mu_mpa\":0.034,\"alpha\":1.4,\"d_per_mpa\":1.0}},\
             \"subcutaneous\":{{\"mu_mpa\":0.00684,\"alpha\":1.4,\"d_per_mpa\":10.0}},\
             \"nail\":{{\"young_mpa\":100.0,\"poisson\":0.3}},{elastic}}}"
        );
        assert_eq!(serde_json::to_string(&Tissue::default()).unwrap(), expected);
        let same: Config = toml::from_str("[tissue.skin]\nkind = \"ogden\"\nmu_mpa = 0.034\n").unwrap();
        assert_eq!(same.hash().unwrap(), Config::default().hash().unwrap());
        for text in [
            "[tissue.skin]\nkind = \"neo_hooke\"\nmu_mpa = 0.034\nd_per_mpa = 1.0\n",
            "[tissue.regions.gel]\n\
            kind = \"elastic\"\nyoung_mpa = 0.1\npoisson = 0.45\n",
        ] {
            let other: Config = toml::from_str(text).unwrap();
            assert_ne!(other.hash().unwrap(), same.hash().unwrap());
        }
    }

    #[test]
    fn files_count_from_the_folder_of_the_configuration() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("c.toml");
        std::fs::write(&path, "volume = { file = \"sub/v.nrrd\", distal_axis = \"-k\" }\n").unwrap();
        let config = Config::read(&path).unwrap();
        assert_eq!(config.volume.as_ref().unwrap().file, dir.path().join("sub/v.nrrd"));
        assert!(config.geometry_name().ends_with("v.nrrd"));
        let printed = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<Config>(&printed).unwrap(), config);
    }
}
