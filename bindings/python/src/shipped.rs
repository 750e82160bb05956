//! Models of the fingers that ship.

use pyo3::PyResult;

use crate::error;

/// A finger's files.
pub struct Files {
    name: &'static str,
    /// Its pad.
    pub pad: &'static [u8],
    /// Its bed of springs.
    pub bed: &'static [u8],
}

const FINGERS: [Files; 2] = [
    Files {
        name: "human",
        pad: include_bytes!("../../../data/models/fingertip-pad.fpm"),
        bed: include_bytes!("../../../data/models/fingertip.fpm"),
    },
    Files {
        name: "human-stiffening",
        pad: include_bytes!("../../../data/models/human-stiffening-pad.fpm"),
        bed: include_bytes!("../../../data/models/human-stiffening.fpm"),
    },
];

/// The files of a finger by its name.
pub fn files(name: &str) -> PyResult<&'static Files> {
    FINGERS.iter().find(|files| files.name == name).ok_or_else(|| {
        let names = FINGERS.map(|files| files.name).join(", ");
        error::input(format!("{name}: no finger of this name ships; there are {names}"))
    })
}
