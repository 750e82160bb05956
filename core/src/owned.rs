//! A model file that a host program owns, at an address where it can be read in place. Needs the feature `std`.
//!
//! Main types: [`ModelFile`] of a bed, [`PadModelFile`] of a pad. Uses model_file and pad.

use std::vec::Vec;

use crate::pad::PadFile;
use crate::{Error, File};

/// Bytes at an address divisible by 8.
#[derive(Clone, Debug)]
struct Words {
    words: Vec<u64>,
    length: usize,
}

impl Words {
    fn new(bytes: &[u8]) -> Self {
        let words = bytes
            .chunks(8)
            .map(|chunk| u64::from_ne_bytes(std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0))))
            .collect();
        Self { words, length: bytes.len() }
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.length]
    }
}

/// The bytes of a model file, checked and aligned.
#[derive(Clone, Debug)]
pub struct ModelFile(Words);

impl ModelFile {
    /// Takes a model file's bytes.
    ///
    /// # Errors
    /// As [`crate::FileOf::from_bytes`].
    pub fn new(bytes: &[u8]) -> Result<Self, Error> {
        let words = Words::new(bytes);
        File::from_bytes(words.bytes())?;
        Ok(Self(words))
    }

    /// The same for those that follow the tissue in time.
    ///
    /// # Errors
    /// As [`crate::FileOf::relaxing`].
    pub fn relaxing(bytes: &[u8]) -> Result<Self, Error> {
        let words = Words::new(bytes);
        File::relaxing(words.bytes())?;
        Ok(Self(words))
    }

    /// The bytes, at an address divisible by 8.
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    /// Model, effects and provenance, in place.
    pub fn file(&self) -> File<'_> {
        File::relaxing(self.bytes()).expect("checked by `new`, and nothing has changed it since")
    }
}

/// The bytes of a pad's model file, checked and aligned.
#[derive(Clone, Debug)]
pub struct PadModelFile(Words);

impl PadModelFile {
    /// Takes a model file's bytes.
    ///
    /// # Errors
    /// As [`PadFile::from_bytes`].
    pub fn new(bytes: &[u8]) -> Result<Self, Error> {
        let words = Words::new(bytes);
        PadFile::from_bytes(words.bytes())?;
        Ok(Self(words))
    }

    /// The bytes, at an address divisible by 8.
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    /// Pad and provenance, in place.
    pub fn file(&self) -> PadFile<'_> {
        PadFile::from_bytes(self.bytes()).expect("checked by `new`, and nothing has changed it since")
    }
}
