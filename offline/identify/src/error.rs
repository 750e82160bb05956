//! What can go wrong between a table and its constants.

use fingerpad_fe::assembly::BodyError;
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::ConfigError;
use fingerpad_fe::mesh::MeshError;
use fingerpad_fe::solve::SolveError;

/// Why an identification has no result.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The table cannot tell what is asked of it.
    #[error("{0}")]
    Table(String),
    /// A setting that cannot be.
    #[error("identify.{key}: {problem}")]
    Setting {
        /// Its key in the configuration.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A steady slide was not found.
    #[error(
        "no steady slide at depth {depth_mm:.4} mm with lambda {:.4e}, beta {:.4}, tau_0 {:.2e} MPa: {cause}",
        law.lambda, law.beta, law.tau0_mpa
    )]
    Steady {
        /// Depth, mm.
        depth_mm: f64,
        /// Law.
        law: RubberFriction,
        /// The last failure.
        cause: SolveError,
    },
    /// A fit ended without a minimum.
    #[error("{what}: {problem} after {evaluations} evaluations, residual {residual:.3e}")]
    Fit {
        /// Which fit.
        what: String,
        /// Why it ended.
        problem: String,
        /// Evaluations of all residuals.
        evaluations: usize,
        /// Root of the sum of squares.
        residual: f64,
    },
    /// The shape cannot be meshed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The body cannot be assembled.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The configuration cannot be run.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The file of finished states cannot be used.
    #[error("{path}: {source}")]
    StateCache {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The caller asked to stop; finished states are kept.
    #[error("interrupted")]
    Interrupted,
}

impl IdentifyError {
    /// Whether another place in the search may succeed where this one failed.
    pub fn is_local(&self) -> bool {
        matches!(self, Self::Steady { .. } | Self::Mesh(_) | Self::Body(_))
    }
}
