//! The model file that a command starts from.

use std::path::Path;

use anyhow::Context;
use fingerpad::ModelFile;

use super::Failure;

/// The model that ships.
const SHIPPED: &[u8] = include_bytes!("../data/models/fingertip.fpm");

/// A model file and its name; without a path the one that ships.
pub fn load(path: Option<&Path>) -> Result<(ModelFile, String), Failure> {
    match path {
        None => {
            let file = ModelFile::new(SHIPPED)
                .map_err(|e| Failure::Numerics(anyhow::anyhow!("the model that ships cannot be used: {e}")))?;
            Ok((file, "fingertip.fpm (shipped)".into()))
        }
        Some(path) => {
            let place = || path.display().to_string();
            let bytes = std::fs::read(path).with_context(place).map_err(Failure::Input)?;
            let file = ModelFile::new(&bytes).with_context(place).map_err(Failure::Input)?;
            Ok((file, path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())))
        }
    }
}
