//! A model file that a host program owns, at an address where it can be read in place. Needs the feature `std`.
//!
//! Main type: [`ModelFile`]. Uses model_file.

use std::vec::Vec;

use crate::{Error, File};

/// The bytes of a model file, checked and aligned.
#[derive(Clone, Debug)]
pub struct ModelFile {
    words: Vec<u64>,
    length: usize,
}

impl ModelFile {
    /// Takes a model file's bytes.
    ///
    /// # Errors
    /// What [`crate::FileOf::from_bytes`] says of them.
    pub fn new(bytes: &[u8]) -> Result<Self, Error> {
        let words = bytes
            .chunks(8)
            .map(|chunk| u64::from_ne_bytes(std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0))))
            .collect();
        let file = Self { words, length: bytes.len() };
        File::from_bytes(file.bytes())?;
        Ok(file)
    }

    /// The bytes, at an address divisible by 8.
    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.length]
    }

    /// Model, effects and provenance, in place.
    pub fn file(&self) -> File<'_> {
        File::from_bytes(self.bytes()).expect("checked by `new`, and nothing has changed it since")
    }
}
