//! Why a configuration cannot be run.

use std::path::PathBuf;

use crate::contact::LawError;
use crate::mesh::{MeshError, imported::ImportError, volume::VolumeError};
use fingerpad_formats as formats;

/// Why a configuration cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file is not valid TOML or has a key or value that is not understood; the message names line and value.
    #[error("{}: {message}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// The parser's message, with line and column.
        message: String,
    },
    /// Depths that cannot be pressed.
    #[error("experiment.depths_mm: {0}")]
    Depths(String),
    /// A friction law that is implausible for skin.
    #[error("friction: {0}")]
    Friction(LawError),
    /// A stiffness of no finger.
    #[error("{section}: {problem}")]
    Stiffness {
        /// Section of the configuration.
        section: String,
        /// Value, usual values, and what it would be in another unit.
        problem: String,
    },
    /// A rigid body that cannot be.
    #[error("rigid_body: {0}")]
    RigidBody(String),
    /// A path that cannot be followed.
    #[error("data row {row}: {problem}")]
    Path {
        /// Row, from 1.
        row: usize,
        /// Description of the defect.
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
    /// Named soft regions of a geometry without such regions.
    #[error(
        "tissue.regions.{0}: {1} has the soft regions skin and subcutaneous only; other regions need an imported mesh"
    )]
    NoSuchRegion(String, &'static str),
    /// A flat pad where the numbers of a parametric fingertip are needed.
    #[error(
        "shape `{0}`: a flat pad has no numbers of a fingertip; this command needs a dome, a shape by name or a geometry file"
    )]
    FlatPad(String),
    /// Both a volume and a mesh.
    #[error("`volume` and `imported` are both given; a finger has one geometry")]
    TwoGeometries,
    /// The body cannot be assembled.
    #[error(transparent)]
    Body(#[from] crate::assembly::BodyError),
}
