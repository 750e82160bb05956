//! Errors of a reduction.

use std::path::PathBuf;

/// Why a reduced model cannot be made or used.
#[derive(Debug, thiserror::Error)]
pub enum ReduceError {
    /// A file that is not a stored run, or a damaged one.
    #[error("{}: {problem}", path.display())]
    Run {
        /// The file.
        path: PathBuf,
        /// The problem with it.
        problem: String,
    },
    /// Invalid settings of the design of experiments.
    #[error("design.{key} = {value}: {problem}")]
    Design {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The problem with it.
        problem: String,
    },
    /// Runs that do not belong together, or too few runs.
    #[error("{0}")]
    Runs(String),
    /// Numbers that the core refuses as a model.
    #[error("the numbers of the model are invalid: {0}")]
    Model(#[from] fingerpad::Error),
    /// A pose out of a pad's range.
    #[error("{axis} of {value}°: the pad's range is {}° to {}°", range[0], range[1])]
    Pose {
        /// Pitch or roll.
        axis: &'static str,
        /// Its value, degrees.
        value: f64,
        /// Least and largest value, degrees.
        range: [f64; 2],
    },
    /// A model that cannot be retuned.
    #[error("{0}")]
    Retune(String),
    /// The fit ended without a result.
    #[error("the fit failed: {0}")]
    Fit(String),
}
