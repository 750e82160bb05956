//! Errors of an identification.

use fingerpad_fe::assembly::BodyError;
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::ConfigError;
use fingerpad_fe::mesh::MeshError;
use fingerpad_fe::solve::SolveError;

/// Why an identification has no result.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The table does not suffice for the request.
    #[error("{0}")]
    Table(String),
    /// A setting that cannot be.
    #[error("identify.{key}: {problem}")]
    Setting {
        /// Its key in the configuration.
        key: String,
        /// The problem with it.
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
    /// In a steady slide the plane reached skin beside the pad.
    #[error(
        "a steady slide at depth {depth_mm:.4} mm reaches {below_mm:.4} mm into skin beside the faces that may touch"
    )]
    BesidePad {
        /// Depth, mm.
        depth_mm: f64,
        /// Depth of the skin behind the plane, mm.
        below_mm: f64,
    },
    /// Too many of the slides around a table's depths were not found.
    #[error("only {0} steady slides were found around the table's depths, too few for a regression")]
    TooFewSlides(usize),
    /// A fit ended without a minimum.
    #[error("{what}: {problem} after {evaluations} evaluations, residual {residual:.3e}")]
    Fit {
        /// Name of the fit.
        what: String,
        /// Reason of its end.
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
    Cache {
        /// The file.
        path: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The caller requested the end; finished states are kept.
    #[error("interrupted")]
    Interrupted,
}

impl IdentifyError {
    /// Whether the error belongs to one point of the search, so that other points may succeed.
    pub fn is_local(&self) -> bool {
        matches!(self, Self::Steady { .. } | Self::BesidePad { .. } | Self::Mesh(_) | Self::Body(_))
    }
}
