//! A model as an FMI 3.0 co-simulation unit (FMU): a zip file with description, binary for this machine, sources and the model.
//!
//! Main function: [`pack`]. The unit itself is `bindings/fmu`, compiled by this package's build script. Uses core.

mod description;

use std::io::{Cursor, Write as _};

use fingerpad::ModelFile;
use toml::{Table, Value};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The unit for the machine that this program was compiled for; empty where there is none.
const UNIT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/unit"));
/// Sources: names and contents.
const SOURCES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/fmu_sources.rs"));
/// The workspace from which the Rust sources take their versions.
const WORKSPACE: &str = include_str!("../../../Cargo.toml");

/// Why a model could not be packed.
#[derive(Debug, thiserror::Error)]
pub enum FmuError {
    /// The program was compiled for a system for which the unit is not compiled with it.
    #[error(
        "this program has no co-simulation unit for {platform} inside; bindings/fmu/README.md tells how to build one"
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

/// The FMU of a model, as the bytes of its file; `name` is told in the description.
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
        ("sources/rust/Cargo.toml".to_owned(), workspace().into_bytes()),
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

/// The workspace's file with no more than what the Rust sources of an FMU need of it.
fn workspace() -> String {
    let whole: Table = WORKSPACE.parse().expect("cargo has read it");
    let part = |name: &str| whole["workspace"][name].clone();
    let mut dependencies = part("dependencies");
    if let Value::Table(dependencies) = &mut dependencies {
        dependencies.retain(|_, dependency| dependency.get("path").is_none());
    }
    let mut workspace = Table::new();
    workspace.insert("resolver".into(), part("resolver"));
    workspace.insert("members".into(), Value::from(vec!["core"]));
    workspace.insert("exclude".into(), Value::from(vec!["bindings/c"]));
    workspace.insert("package".into(), part("package"));
    workspace.insert("dependencies".into(), dependencies);
    let mut file = Table::new();
    file.insert("workspace".into(), Value::Table(workspace));
    toml::to_string(&file).expect("a table of strings, arrays and tables")
}
