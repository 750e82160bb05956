//! Reasons for which a diagnosis is impossible.

use std::path::PathBuf;

/// Why no diagnosis could be made. Every message names the file and, where there is one, row and column.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The data cannot carry a diagnosis.
    #[error("{}: {problem}", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// The problem, with row and column.
        problem: String,
    },
    /// The baseline could not be fitted.
    #[error("{}: the baseline does not fit the calibration runs: {problem}", path.display())]
    Calibration {
        /// The calibration file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// The corrected model could not be made.
    #[error("corrected model: {0}")]
    Model(String),
}
