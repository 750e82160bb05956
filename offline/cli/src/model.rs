//! The model file that a command starts from.

use std::path::Path;

use anyhow::Context;
use fingerpad::Error;
use fingerpad::host::{ModelFile, PadModelFile};

use super::Failure;

/// The bed and the pad that ship.
const SHIPPED: &[u8] = include_bytes!("../data/models/fingertip.fpm");
const SHIPPED_PAD: &[u8] = include_bytes!("../data/models/fingertip-pad.fpm");

/// A bed of springs or a pad.
pub enum Loaded {
    /// A bed.
    Bed(ModelFile),
    /// A pad.
    Pad(PadModelFile),
}

/// A model file of a pad, or of a bed whose tissue does not relax, and its name; without a path the bed that ships.
pub fn load_any(path: Option<&Path>) -> Result<(Loaded, String), Failure> {
    any(path, ModelFile::new)
}

/// The same for a command that follows the tissue of a bed in time.
pub fn load_in_time(path: Option<&Path>) -> Result<(Loaded, String), Failure> {
    any(path, ModelFile::relaxing)
}

fn any(path: Option<&Path>, read: fn(&[u8]) -> Result<ModelFile, Error>) -> Result<(Loaded, String), Failure> {
    if let Some(path) = path {
        let place = || path.display().to_string();
        let bytes = std::fs::read(path).with_context(place).map_err(Failure::Input)?;
        match PadModelFile::new(&bytes) {
            Ok(pad) => return Ok((Loaded::Pad(pad), name_of(path))),
            // Not a pad; the reader of beds reports any defect of a bed.
            Err(Error::Section { id: [b'P', b'A', b'D', b'N'] }) => {}
            Err(error) => return Err(Failure::Input(anyhow::Error::new(error).context(place()))),
        }
    }
    bed(path, read).map(|(file, name)| (Loaded::Bed(file), name))
}

/// The pad that ships and its name.
pub fn shipped_pad() -> Result<(PadModelFile, String), Failure> {
    let file = PadModelFile::new(SHIPPED_PAD)
        .map_err(|e| Failure::Numerics(anyhow::anyhow!("the pad that ships cannot be used: {e}")))?;
    Ok((file, "fingertip-pad.fpm (shipped)".into()))
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// A model file of a bed whose tissue does not relax and its name; without a path the one that ships.
pub fn load(path: Option<&Path>) -> Result<(ModelFile, String), Failure> {
    bed(path, ModelFile::new)
}

fn bed(path: Option<&Path>, read: fn(&[u8]) -> Result<ModelFile, Error>) -> Result<(ModelFile, String), Failure> {
    match path {
        None => {
            let file = ModelFile::new(SHIPPED)
                .map_err(|e| Failure::Numerics(anyhow::anyhow!("the model that ships cannot be used: {e}")))?;
            Ok((file, "fingertip.fpm (shipped)".into()))
        }
        Some(path) => {
            let place = || path.display().to_string();
            let bytes = std::fs::read(path).with_context(place).map_err(Failure::Input)?;
            if PadModelFile::new(&bytes).is_ok() {
                return Err(Failure::Input(anyhow::anyhow!(
                    "{}: a pad; this command takes the bed of springs that `reduce` and `finger` write",
                    place()
                )));
            }
            let file = read(&bytes).with_context(place).map_err(Failure::Input)?;
            Ok((file, name_of(path)))
        }
    }
}
