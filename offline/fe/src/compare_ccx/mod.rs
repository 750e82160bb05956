//! CalculiX as a second opinion: the same mesh, materials and contact as a deck, run by `ccx`, read back.
//!
//! Main types: [`Deck`], [`Step`], [`Runner`], [`Run`]; [`like_for_like`] has the same problem for this program.
//! Differences from this program: hexahedra are C3D8R (full integration locks), contact is penalty at face points
//! without augmentation, friction is Coulomb with a constant stick slope. Reads CalculiX's files; solves nothing. May
//! use: mesh, material, load_path (for the problem), `fingerpad-formats` (for the mesh part of a deck and atomic
//! writing). Unix only.

mod dat;
mod deck;
pub mod like_for_like;
mod run;

pub use deck::{Contact, Deck, Friction, Settings, Step};
pub use run::{PACKAGE, Point, Run, Runner};

/// Why there is no result of CalculiX.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// There is no such program.
    #[error("`{program}` was not found: install CalculiX (Debian and Ubuntu package `{PACKAGE}`)")]
    NotInstalled {
        /// The name looked for on PATH.
        program: String,
    },
    /// The problem cannot be written as a deck.
    #[error("deck: {0}")]
    Deck(String),
    /// The operating system refused.
    #[error("{what}: {source}")]
    System {
        /// The attempted operation.
        what: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// It ran, and stopped before the end; the output up to then is kept.
    #[error("CalculiX stopped after {} of {expected} outputs, {} iterations and {:.1} CPU s: {reason}", partial.points.len(), partial.iterations, partial.cpu_s)]
    Stopped {
        /// Its own words, or the time limit.
        reason: String,
        /// Outputs that the deck requests.
        expected: usize,
        /// Everything up to there.
        partial: Box<Run>,
    },
    /// Unexpected output of CalculiX.
    #[error("{file}:{line}: {problem}")]
    Output {
        /// File in the run's folder.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Description of the defect.
        problem: String,
    },
}

#[cfg(test)]
mod tests;
