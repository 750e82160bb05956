//! A model as an FMI 3.0 co-simulation unit (FMU): a zip file with description, binary for this machine, sources and the model.
//!
//! Main function: [`pack`]. The unit itself is `bindings/fmu`, compiled by this package's build script. Uses core.

mod description;

use std::io::{Cursor, Write as _};

use fingerpad::host::ModelFile;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The unit for the machine that this program was compiled for; empty where there is none.
const UNIT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/unit"));
/// Sources: names and contents.
const SOURCES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/fmu_sources.rs"));
/// Why a model could not be packed.
#[derive(Debug, thiserror::Error)]
pub enum FmuError {
    /// The program was compiled for a system for which the unit is not compiled with it.
    #[error(
        "this program has no co-simulation unit for {platform} inside; bindings/fmu/README.md describes how to build one"
    )]
    NoUnit {
        /// The system as FMI names it.
        platform: String,
    },
    /// The archive could not be written.
    #[error("the archive: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// A file of the archive could not be written.
    #[error("the archive: {0}")]
    File(#[from] std::io::Error),
}

/// The FMU of a model, as the bytes of its file; `name` is written to the description.
///
/// # Errors
/// [`FmuError`].
pub fn pack(model: &ModelFile, name: &str) -> Result<Vec<u8>, FmuError> {
    let platform = platform();
    if UNIT.is_empty() {
        return Err(FmuError::NoUnit { platform });
    }
    let description = description::model_description(&model.file(), name);
    let binary = format!("binaries/{platform}/fingerpad.{}", if cfg!(target_os = "macos") { "dylib" } else { "so" });
    let mut files: Vec<(String, Vec<u8>)> = vec![
        ("modelDescription.xml".to_owned(), description.into_bytes()),
        ("resources/model.fpm".to_owned(), model.bytes().to_vec()),
        (binary, UNIT.to_vec()),
        ("sources/buildDescription.xml".to_owned(), description::BUILD_DESCRIPTION.as_bytes().to_vec()),
    ];
    files.extend(SOURCES.iter().map(|(name, bytes)| (format!("sources/{name}"), bytes.to_vec())));
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in &files {
        let mode = if name.starts_with("binaries") { 0o755 } else { 0o644 };
        let options =
            SimpleFileOptions::default().compression_method(CompressionMethod::Deflated).unix_permissions(mode);
        zip.start_file(name.as_str(), options)?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// This machine as FMI 3.0 names it.
fn platform() -> String {
    let system = if cfg!(target_os = "macos") { "darwin" } else { std::env::consts::OS };
    format!("{}-{system}", std::env::consts::ARCH)
}
