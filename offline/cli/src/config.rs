//! The configuration file: one section for each library that a command calls.

use std::path::Path;

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::{Config, ConfigError, Experiment, RigidBodySettings, Shape, read_toml};
use fingerpad_fe::load_path::{Numerics, Tissue};
use fingerpad_fe::mesh::{MeshPreset, imported::ImportedGeometry, volume::VolumeGeometry};
use fingerpad_reduce::DesignSettings;
use serde::{Deserialize, Serialize};

/// The sections of a configuration file; a section or key that is absent has its default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConfigFile {
    shape: Shape,
    mesh_preset: MeshPreset,
    #[serde(skip_serializing_if = "Option::is_none")]
    volume: Option<VolumeGeometry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    imported: Option<ImportedGeometry>,
    #[serde(skip_serializing_if = "RigidBodySettings::is_plane")]
    rigid_body: RigidBodySettings,
    tissue: Tissue,
    friction: RubberFriction,
    numerics: Numerics,
    experiment: Experiment,
    identify: fingerpad_identify::Settings,
    design: DesignSettings,
}

/// The sections by library: finite elements, identification, design of experiments.
pub type Sections = (Config, fingerpad_identify::Settings, DesignSettings);

impl ConfigFile {
    /// All settings in one file.
    pub fn of(fe: &Config, identify: &fingerpad_identify::Settings, design: &DesignSettings) -> Self {
        let Config { shape, mesh_preset, volume, imported, rigid_body, tissue, friction, numerics, experiment } =
            fe.clone();
        Self {
            shape,
            mesh_preset,
            volume,
            imported,
            rigid_body,
            tissue,
            friction,
            numerics,
            experiment,
            identify: identify.clone(),
            design: design.clone(),
        }
    }

    /// Reads a file; the files that it names are looked for beside it.
    ///
    /// # Errors
    /// [`ConfigError`] with file, line and value.
    pub fn read(path: &Path) -> Result<Sections, ConfigError> {
        let (mut config, identify, design) = read_toml::<Self>(path)?.parts();
        config.relative_to(path.parent().unwrap_or(Path::new("")));
        Ok((config, identify, design))
    }

    fn parts(self) -> Sections {
        let Self {
            shape,
            mesh_preset,
            volume,
            imported,
            rigid_body,
            tissue,
            friction,
            numerics,
            experiment,
            identify,
            design,
        } = self;
        let config =
            Config { shape, mesh_preset, volume, imported, rigid_body, tissue, friction, numerics, experiment };
        (config, identify, design)
    }
}
