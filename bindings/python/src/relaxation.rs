//! Branches of tissue that relaxes, as Python gives and sees them.
//!
//! Main type: [`Branches`].

use fingerpad::{Branch, Error, Field, Relaxation};
use pyo3::prelude::*;

use crate::error;

/// Branches of tissue that relaxes: a preset, or shares and times, s.
#[derive(FromPyObject)]
pub enum Branches {
    Name(String),
    List(Vec<(f32, f32)>),
}

impl Branches {
    /// The branches if all of them are within their ranges.
    pub fn checked(self) -> PyResult<Relaxation> {
        let branches: Vec<Branch> = match self {
            Self::Name(name) if name == "human-assumed" => Relaxation::HUMAN_ASSUMED.branches().to_vec(),
            Self::Name(name) => {
                return Err(error::input(format!("branches: {name:?} is neither \"human-assumed\" nor a list")));
            }
            Self::List(list) => list.into_iter().map(|(share, time_s)| Branch { share, time_s }).collect(),
        };
        Relaxation::new(&branches).map_err(|e| match e {
            Error::Range { what: Field::RelaxationShare, index, value } => {
                error::input(format!("branches: share {value} of branch {index} is not between 0 and 100"))
            }
            Error::Range { index, value, .. } => {
                error::input(format!("branches: time {value} s of branch {index} is not between 1e-5 and 1e5 s"))
            }
            _ => error::input(format!("branches: {}; at most {}", branches.len(), fingerpad::BRANCHES)),
        })
    }
}

/// Shares and times of the branches that are used.
pub fn listed(relaxation: &Relaxation) -> Vec<(f32, f32)> {
    let used = relaxation.branches().iter().filter(|branch| branch.share != 0.0);
    used.map(|branch| (branch.share, branch.time_s)).collect()
}

/// What a description of a finger says of its branches.
pub fn in_words(relaxation: &Relaxation) -> &'static str {
    match *relaxation {
        relaxation if !relaxation.is_some() => "",
        Relaxation::HUMAN_ASSUMED => ", relaxes (human-assumed: its shares are assumed)",
        _ => ", relaxes",
    }
}
