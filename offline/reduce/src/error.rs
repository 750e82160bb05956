//! Errors of a reduction.

use std::path::PathBuf;

/// Why a reduced model cannot be made or used.
#[derive(Debug, thiserror::Error)]
pub enum ReduceError {
    /// A stored run that is not one, or damaged.
    #[error("{}: {problem}", path.display())]
    Run {
        /// The file.
        path: PathBuf,
        /// The problem with it.
        problem: String,
    },
    /// Settings that make no design of experiments.
    #[error("design.{key} = {value}: {problem}")]
    Design {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The problem with it.
        problem: String,
    },
    /// Runs that do not belong together or do not suffice.
    #[error("{0}")]
    Runs(String),
    /// The fit found no model that `fingerpad` accepts.
    #[error("the fitted numbers are no model: {0}")]
    Model(#[from] fingerpad::Error),
    /// A friction law whose slip lengths the model's table cannot hold.
    #[error(
        "friction.beta = {pressure_exponent}: the slip length (friction limit over tangential stiffness) of a round pad \
         grows as depth^((1 + beta)/2), {ratio:.0} times from the first to the last node of the reduced model's table; \
         at most {} times can be held, that is beta up to {largest_exponent:.2}",
        fingerpad::SLIP_LENGTH_RATIO_MAX
    )]
    SlipLengthOfLaw {
        /// beta of the law.
        pressure_exponent: f64,
        /// Longest slip length over the shortest, estimated.
        ratio: f64,
        /// Largest beta that is not refused.
        largest_exponent: f64,
    },
    /// Runs whose slip lengths the model's table cannot hold.
    #[error(
        "the friction limit of these runs grows as depth^{limit_exponent:.1} and their tangential stiffness as \
         depth^{stiffness_exponent:.1}, so that the longest slip length (limit over stiffness) is {ratio:.0} times the \
         shortest; the reduced model holds at most {} times. The usual causes are a friction law that rises steeply with \
         pressure (here friction.beta = {pressure_exponent}) and a mesh too coarse for the contact at small depths",
        fingerpad::SLIP_LENGTH_RATIO_MAX
    )]
    SlipLengthOfRuns {
        /// Longest slip length over the shortest.
        ratio: f64,
        /// Exponent of the limit over depth.
        limit_exponent: f64,
        /// Exponent of the tangential stiffness over depth.
        stiffness_exponent: f64,
        /// beta of the runs' friction law.
        pressure_exponent: f64,
    },
    /// The fit ended without an answer.
    #[error("the fit failed: {0}")]
    Fit(String),
}
