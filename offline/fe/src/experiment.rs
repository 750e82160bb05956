//! The experiment of the main job: press to each measured depth, slide until the friction is kinetic.
//!
//! Main types: [`Config`], [`Experiment`].
//! May use: load_path and what it may use; `fingerpad-formats` for label volumes and imported meshes.

use std::path::{Path as FilePath, PathBuf};

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::contact::{LawError, Plane, RubberFriction, plane};
use crate::load_path::{
    BoneKind, Checkpoint, Clearance, Drive, Finger, LoadPathError, Numerics, OnProgress, Path, PathEnd, PressLimit,
    Problem, Tissue, Trajectory, Waypoint, follow_path, follow_path_from, follow_path_on, follow_to_end,
    neutral_pitch_deg, press_limits,
};
use crate::mesh::{
    self, Fingertip, FingertipShape, MeshError, MeshPreset,
    imported::{ImportError, ImportReport, ImportedGeometry, RawMesh, imported_fingertip},
    volume::{LabelVolume, VolumeError, VolumeGeometry, VolumeReport, volume_fingertip},
};
use fingerpad_formats as formats;

/// What is run: geometry, materials, law, numerics, depths.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Shape of the fingertip: the name of one that comes with the program, or a geometry file.
    pub shape: Shape,
    /// Resolution of its mesh.
    pub mesh_preset: MeshPreset,
    /// In place of a shape: a labelled volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<VolumeGeometry>,
    /// In place of a shape: a mesh of another program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imported: Option<ImportedGeometry>,
    /// Materials and bones.
    pub tissue: Tissue,
    /// Friction law.
    pub friction: RubberFriction,
    /// Contact, equilibrium, increments.
    pub numerics: Numerics,
    /// Depths and slide.
    pub experiment: Experiment,
}

/// Where a shape comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Shape(pub String);

impl Default for Shape {
    fn default() -> Self {
        Self("e".into())
    }
}

/// Where a fingertip came from, and how well that went.
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
    /// Speed of press and slide, mm/s; the model has no rate effects, it sets the time column.
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

/// Why a configuration cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not valid TOML or has a key or value that is not understood; the message names line and value.
    #[error("{}: {message}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// What is wrong, with line and column.
        message: String,
    },
    /// Depths that cannot be pressed.
    #[error("experiment.depths_mm: {0}")]
    Depths(String),
    /// A friction law that is none of skin.
    #[error("friction: {0}")]
    Friction(LawError),
    /// A path that cannot be followed.
    #[error("data row {row}: {problem}")]
    Path {
        /// Row, from 1.
        row: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// The shape cannot be meshed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The geometry's file cannot be read.
    #[error(transparent)]
    Geometry(#[from] formats::Error),
    /// The volume cannot be meshed.
    #[error("{}: {source}", path.display())]
    Volume {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<VolumeError>,
    },
    /// The mesh of another program cannot be used.
    #[error("{}: {source}", path.display())]
    Import {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<ImportError>,
    },
    /// Deformable bones that the mesh does not have, or not joined to the tissue.
    #[error(
        "tissue.bone.kind = \"deformable\" needs bones of elements that share their nodes with the tissue; in the \
         imported mesh they are left out or meshed apart: use \"fixed\" or \"floating\""
    )]
    BonesNotMeshed,
    /// Named soft regions where the geometry has none.
    #[error(
        "tissue.regions.{0}: {1} has the soft regions skin and subcutaneous only; others come with an imported mesh"
    )]
    NoSuchRegion(String, &'static str),
    /// Both a volume and a mesh.
    #[error("`volume` and `imported` are both given; a finger has one geometry")]
    TwoGeometries,
    /// The body cannot be assembled.
    #[error(transparent)]
    Body(#[from] crate::assembly::BodyError),
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
        if !FingertipShape::NAMES.contains(&self.shape.0.as_str()) {
            self.shape.0 = folder.join(&self.shape.0).display().to_string();
        }
        let files = [self.volume.as_mut().map(|v| &mut v.file), self.imported.as_mut().map(|i| &mut i.file)];
        files.into_iter().flatten().for_each(|file| *file = folder.join(&*file));
    }

    /// What the geometry is called: the shape's name, or the file of a volume or mesh.
    pub fn geometry_name(&self) -> String {
        let file = self.volume.as_ref().map(|v| &v.file).or(self.imported.as_ref().map(|i| &i.file));
        file.map_or(self.shape.0.clone(), |file| file.display().to_string())
    }

    /// The geometry.
    ///
    /// # Errors
    /// [`ConfigError::Mesh`] if there is no such shape or its numbers do not make a finger.
    pub fn fingertip_shape(&self) -> Result<FingertipShape, ConfigError> {
        if FingertipShape::NAMES.contains(&self.shape.0.as_str()) {
            return Ok(FingertipShape::named(&self.shape.0)?);
        }
        let path = PathBuf::from(&self.shape.0);
        if path.extension().is_none() {
            // Not a file: let the library say which names there are.
            return Ok(FingertipShape::named(&self.shape.0)?);
        }
        let text = std::fs::read_to_string(&path).map_err(|source| ConfigError::File { path, source })?;
        Ok(FingertipShape::from_toml(&self.shape.0, &text)?)
    }

    /// The mesh, checked, and where it came from.
    ///
    /// # Errors
    /// [`ConfigError`]: of the shape, of the file, or of what the file holds.
    pub fn fingertip(&self) -> Result<(Fingertip, Origin), ConfigError> {
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
            (None, Some(settings)) => {
                let soft_regions: Vec<String> = self.tissue.regions.keys().cloned().collect();
                let made = imported_fingertip(&read_mesh(settings)?, settings, &soft_regions)
                    .map_err(|e| ConfigError::Import { path: settings.file.clone(), source: Box::new(e) })?;
                let hollow = settings.sets.bone.is_some() || settings.sets.proximal_bone.is_some();
                if self.tissue.bone.kind == BoneKind::Deformable && (hollow || made.report.attached_nodes > 0) {
                    return Err(ConfigError::BonesNotMeshed);
                }
                Ok((made.fingertip, Origin::Imported(made.report)))
            }
            (None, None) => {
                let shape = self.fingertip_shape()?;
                Ok((mesh::fingertip(&shape, &self.mesh_preset.divisions())?, Origin::Shape(Box::new(shape))))
            }
        }
    }

    /// Mesh and body, checked; the friction law too, before the seconds that a mesh takes.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn finger(&self) -> Result<(Finger, mesh::FirstTouch), ConfigError> {
        self.friction.check().map_err(ConfigError::Friction)?;
        let (fingertip, _) = self.fingertip()?;
        let touch = fingertip.touch;
        Ok((Finger::new(fingertip, &self.tissue)?, touch))
    }

    /// As [`Self::finger`], with a pad of the faces that may touch on these paths: the fewer, the faster.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn finger_for(&self, paths: &[&Path]) -> Result<(Finger, mesh::FirstTouch), ConfigError> {
        self.finger_reaching(paths, 1.0)
    }

    /// As [`Self::finger_for`], with a pad that reaches `factor` times as high: for paths on which skin beside the pad
    /// comes to the plane.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn finger_reaching(&self, paths: &[&Path], factor: f64) -> Result<(Finger, mesh::FirstTouch), ConfigError> {
        self.friction.check().map_err(ConfigError::Friction)?;
        let (fingertip, _) = self.fingertip()?;
        let touch = fingertip.touch;
        let rotations = rotations(paths, neutral_pitch_deg(&touch));
        // A driven force leaves the depth open: then the geometry's own pad says how high the skin may touch in any pose.
        let height_mm = deepest_mm(paths).map_or(fingertip.pad_height_mm(), pad_height_mm);
        let fingertip = fingertip.with_pad_for(&rotations, factor * height_mm);
        Ok((Finger::new(fingertip, &self.tissue)?, touch))
    }

    /// Refuses depths that are not numbers, do not rise, or reach the bone or the held section.
    ///
    /// # Errors
    /// [`ConfigError::Depths`].
    pub fn check_depths(&self, depths_mm: &[f64], finger: &Finger) -> Result<(), ConfigError> {
        let refuse = |message: String| Err(ConfigError::Depths(message));
        if depths_mm.is_empty() {
            return refuse("no depth given".into());
        }
        let mut last = 0.0;
        for &depth in depths_mm {
            if !(depth.is_finite() && depth > last) {
                return refuse(format!("{depth} mm after {last} mm: depths must be numbers that rise from 0"));
            }
            last = depth;
        }
        Clearance::of(finger).refusal(last).map_or(Ok(()), refuse)
    }

    /// Refuses a path that leads to what holds the finger, or to numbers that no fingertip bears.
    ///
    /// # Errors
    /// [`ConfigError::Path`] names the first such row.
    pub fn check_path(&self, path: &Path, finger: &Finger) -> Result<(), ConfigError> {
        let clearance = Clearance::of(finger);
        for (k, point) in path.waypoints.iter().enumerate() {
            let refuse = |problem| Err(ConfigError::Path { row: k + 1, problem });
            if let Some(problem) = path.refused_pose(k) {
                return refuse(problem);
            }
            let by_depth = path.drives[0] == Drive::Displacement;
            if by_depth
                && path.turns.is_none()
                && let Some(problem) = clearance.refusal(point.normal)
            {
                return refuse(format!("depth_mm {problem}"));
            }
            if by_depth
                && !path.turns.is_none()
                && let Some(problem) = Clearance::refusal_in_pose(finger, path, k)
            {
                return refuse(problem);
            }
            let keys = [("normal_force_n", point.normal), ("friction_x_n", point.x), ("friction_y_n", point.y)];
            for ((key, value), drive) in keys.into_iter().zip(path.drives) {
                if drive == Drive::Force && !(value.abs() <= LARGEST_FORCE_N) {
                    return refuse(format!(
                        "{key} {value} N: at most {LARGEST_FORCE_N} N, beyond which the pulp is pressed to the bone"
                    ));
                }
            }
            for ((key, value), drive) in
                [("slide_x_mm", point.x), ("slide_y_mm", point.y)].into_iter().zip(&path.drives[1..])
            {
                if *drive == Drive::Displacement && !(value.abs() <= LONGEST_SLIDE_MM) {
                    return refuse(format!(
                        "{key} {value} mm: at most {LONGEST_SLIDE_MM} mm; a slide is steady after some millimetres"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Hash of everything that the results depend on: the settings, the shape's numbers, the program's version.
    ///
    /// # Errors
    /// As [`Self::fingertip_shape`].
    pub fn hash(&self) -> Result<String, ConfigError> {
        let shape = self.fingertip_shape()?;
        let all = (env!("CARGO_PKG_VERSION"), shape, self.mesh_preset, &self.tissue, self.friction, self.numerics);
        let mut text = serde_json::to_string(&(all, &self.experiment)).expect("plain numbers");
        // Where a file lies does not matter, what it holds does.
        if let Some(settings) = &self.volume {
            let settings_only = VolumeGeometry { file: PathBuf::new(), ..settings.clone() };
            text += &format!("{settings_only:?}{:?}", read_volume(settings)?);
        }
        if let Some(settings) = &self.imported {
            let settings_only = ImportedGeometry { file: PathBuf::new(), ..settings.clone() };
            text += &format!("{settings_only:?}{:?}", read_mesh(settings)?);
        }
        Ok(Sha256::digest(text).iter().take(8).map(|b| format!("{b:02x}")).collect())
    }

    /// The problem of a finger.
    pub fn problem<'a>(&self, finger: &'a Finger) -> Problem<'a> {
        Problem {
            body: &finger.body,
            pad_faces: &finger.mesh.pad_faces,
            half: finger.half.as_ref().filter(|_| self.numerics.symmetry.is_auto()),
            friction: Some(self.friction),
            penalty: self.numerics.contact,
            settings: self.numerics.solver,
            load_steps: self.numerics.load_steps,
            neutral_pitch_deg: finger.neutral_pitch_deg,
            obstacles: &finger.obstacles,
            beside_pad: &finger.beside_pad,
            clearance_mm: Clearance::of(finger).depth_mm,
        }
    }
}

/// Reads a TOML file into a type that says which keys there are.
///
/// # Errors
/// [`ConfigError::File`], or [`ConfigError::Toml`] with line and value.
pub fn read_toml<T: serde::de::DeserializeOwned>(path: &FilePath) -> Result<T, ConfigError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| ConfigError::File { path: path.to_path_buf(), source })?;
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

/// Height up to which skin is taken to touch, share of the deepest press and more, mm: the rim of a contact lies at half the
/// depth, since the skin around it gives way; a run in which other skin is reached ends with an error.
const PAD_SHARE: f64 = 0.8;
const PAD_MARGIN_MM: f64 = 0.2;
/// Turn between two poses whose pads are united, rad.
const POSE_STEP_RAD: f64 = 0.09;
/// Turn that a driven moment may give, rad.
const MOMENT_TURN_RAD: f64 = 0.17;

/// Height over first touch up to which skin may touch in a press this deep, mm.
pub fn pad_height_mm(deepest_mm: f64) -> f64 {
    PAD_SHARE * deepest_mm + PAD_MARGIN_MM
}

/// The deepest press of paths, mm; None where a driven force leaves the depth open.
fn deepest_mm(paths: &[&Path]) -> Option<f64> {
    let is_open = paths.iter().any(|path| path.drives[0] == Drive::Force);
    let depths = paths.iter().flat_map(|path| &path.waypoints).map(|point| point.normal);
    (!is_open).then(|| depths.fold(0.0, f64::max))
}

/// Rotations of the finger along paths.
fn rotations(paths: &[&Path], neutral_pitch_deg: f64) -> Vec<Matrix3<f64>> {
    let mut rotations = Vec::new();
    for path in paths {
        let drives = path.coordinate_drives();
        let mut turns: Vec<[f64; 2]> = Vec::new();
        for at in (0..path.waypoints.len()).map(|row| path.coordinates(row, neutral_pitch_deg)) {
            let [pitch, roll] = [plane::PITCH, plane::ROLL].map(|k| match drives[k] {
                Drive::Displacement => [at[k], at[k]],
                Drive::Force => [-MOMENT_TURN_RAD, MOMENT_TURN_RAD],
            });
            for turn in [[pitch[0], roll[0]], [pitch[1], roll[1]]] {
                let from = *turns.last().unwrap_or(&turn);
                let steps = ((turn[0] - from[0]).hypot(turn[1] - from[1]) / POSE_STEP_RAD).ceil().max(1.0);
                turns.extend((1..=steps as usize).map(|i| {
                    let share = i as f64 / steps;
                    [0, 1].map(|k| from[k] + share * (turn[k] - from[k]))
                }));
            }
        }
        turns.dedup();
        rotations.extend(
            turns
                .into_iter()
                .map(|[pitch, roll]| Plane::new([0.0, 0.0, 0.0, 0.0, pitch, roll]).tilt().inverse().into_inner()),
        );
    }
    rotations
}

/// Largest force that may be driven, N. The hardest press of a fingertip is some 50 N, and long before it the pulp is
/// flat on the bone.
const LARGEST_FORCE_N: f64 = 100.0;
/// Longest slide that may be driven, mm.
const LONGEST_SLIDE_MM: f64 = 1000.0;

/// Slides at which fields are kept, mm, if the slide is as long.
const SNAPSHOT_SLIDES_MM: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 6.0];

/// Presses to `depth_mm` through the lesser depths of the experiment, as a press on all of them does; `from` is where it
/// goes on from, if a lesser depth was pressed to before.
///
/// # Errors
/// [`LoadPathError`], with what was reached.
pub fn press(
    config: &Config,
    finger: &Finger,
    depth_mm: f64,
    from: Option<&PathEnd>,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<PathEnd, LoadPathError> {
    let path = Path::new([Drive::Displacement; 3], press_waypoints(&config.experiment, depth_mm));
    follow_to_end(&config.problem(finger), &path, from, checkpoint, progress)
}

/// Presses to `depth_mm` as [`press`] does, then slides from proximal to distal; fields at five slides. `from` is where the
/// press ends, if it was made before: the numbers are the same. With a checkpoint the run goes on from what is saved there.
///
/// # Errors
/// [`LoadPathError`], with what was reached.
pub fn press_and_slide(
    config: &Config,
    finger: &Finger,
    depth_mm: f64,
    from: Option<&PathEnd>,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<Trajectory, LoadPathError> {
    let experiment = &config.experiment;
    let mut waypoints = press_waypoints(experiment, depth_mm);
    let pressed = waypoints.len() - 1;
    let press_s = waypoints[pressed].t_s;
    let mut slides: Vec<f64> =
        SNAPSHOT_SLIDES_MM.into_iter().filter(|&s| s > 0.0 && s < experiment.slide_mm - 1e-9).collect();
    slides.push(experiment.slide_mm);
    waypoints.extend(slides.iter().map(|&x| Waypoint {
        t_s: press_s + x / experiment.speed_mm_s,
        normal: depth_mm,
        x,
        y: 0.0,
    }));
    let snapshots: Vec<usize> = (pressed..waypoints.len()).collect();
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let problem = config.problem(finger);
    match (from, checkpoint) {
        (Some(from), checkpoint) => follow_path_on(&problem, &path, &snapshots, from, checkpoint, progress),
        (None, Some(checkpoint)) => follow_path_from(&problem, &path, &snapshots, checkpoint, progress),
        (None, None) => follow_path(&problem, &path, &snapshots, progress),
    }
}

/// Corners of a press to `depth_mm` through the lesser depths of the experiment.
fn press_waypoints(experiment: &Experiment, depth_mm: f64) -> Vec<Waypoint> {
    let lesser = experiment.depths_mm.iter().copied().filter(|&depth| depth < depth_mm - 1e-9);
    let depths = [0.0].into_iter().chain(lesser).chain([depth_mm]);
    depths.map(|depth| Waypoint { t_s: depth / experiment.speed_mm_s, normal: depth, x: 0.0, y: 0.0 }).collect()
}

/// Normal force, area and the law's integral over the frictionless pressure at each depth.
///
/// # Errors
/// [`LoadPathError`].
pub fn frictionless(
    config: &Config,
    finger: &Finger,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<Vec<PressLimit>, LoadPathError> {
    let problem = config.problem(finger);
    press_limits(&problem, &config.friction, &config.experiment.depths_mm, checkpoint, progress)
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
