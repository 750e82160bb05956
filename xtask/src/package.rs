//! The published crates: packed, unpacked in a workspace of their own, checked and tested there.
//!
//! Main functions: [`test()`] (every file in place, everything compiles), [`tests()`] (their tests), [`pack`].

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use flate2::read::GzDecoder;
use toml::{Table, Value};

use crate::shell::{command, root, run, sh};

const VERSION: &str = env!("CARGO_PKG_VERSION");
const CORE: &str = "fingerpad";
/// Files of every package besides its sources.
const FILES: [&str; 5] = ["Cargo.lock", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];
/// Further files of the core's package.
const CORE_FILES: [&str; 4] =
    ["docs/fpm-format.md", "docs/add-an-effect.md", "tests/data/fingertip.fpm", "tests/data/law-vectors.csv"];
/// Size limit of a registry, in bytes.
const MOST: u64 = 10 << 20;

/// Packs all, and compiles all with their tests from the packages.
pub fn test() -> Result<()> {
    in_packages("cargo check --profile gate --workspace --all-targets")
}

/// Runs the tests of all packages from their packed archives.
pub fn tests() -> Result<()> {
    in_packages("cargo test --profile gate --workspace")
}

fn in_packages(line: &str) -> Result<()> {
    let workspace = unpack()?;
    // The packages of the workspace share this build of third-party crates.
    run(command(&workspace, line).env("CARGO_TARGET_DIR", root().join("target")))
}

/// Packs all into a folder.
pub fn pack(out: &Path) -> Result<()> {
    pack_all()?;
    fs::create_dir_all(out)?;
    for name in published()? {
        let file = format!("{}.crate", folder_of(&name));
        fs::copy(root().join("target/package").join(&file), out.join(&file))?;
    }
    Ok(())
}

/// The archives of all packages in `target/package`; nothing is compiled.
fn pack_all() -> Result<()> {
    sh(".", "cargo package --workspace --allow-dirty --no-verify --exclude fingerpad-tests --exclude xtask")
}

/// Packs all and unpacks them into one workspace, in which each is taken by the others from its package.
fn unpack() -> Result<PathBuf> {
    pack_all()?;
    let workspace = root().join("target/package/unpacked");
    if workspace.exists() {
        fs::remove_dir_all(&workspace)?;
    }
    fs::create_dir_all(&workspace)?;
    let names = published()?;
    for name in &names {
        let packed = root().join("target/package").join(format!("{}.crate", folder_of(name)));
        let file = File::open(&packed).with_context(|| packed.display().to_string())?;
        let bytes = file.metadata()?.len();
        ensure!(bytes <= MOST, "{}: {bytes} bytes, and a registry takes {MOST}", packed.display());
        let mut archive = tar::Archive::new(GzDecoder::new(file));
        // Every package has the same date in its files; cargo would reuse its build of an earlier one.
        archive.set_preserve_mtime(false);
        archive.unpack(&workspace)?;
        for file in FILES.iter().chain(if name == CORE { &CORE_FILES[..] } else { &[] }) {
            let there = fs::symlink_metadata(workspace.join(folder_of(name)).join(file));
            let there = there.is_ok_and(|meta| meta.is_file() && meta.len() > 0);
            ensure!(there, "the package {name} has no file {file}, or an empty one");
        }
    }
    fs::write(workspace.join("Cargo.toml"), toml::to_string(&manifest(&names)?)?)?;
    fs::copy(root().join("Cargo.lock"), workspace.join("Cargo.lock"))?;
    println!("{} packages in {}", names.len(), workspace.display());
    Ok(workspace)
}

/// The names of the published packages: all to which the workspace's manifest gives a folder.
fn published() -> Result<Vec<String>> {
    let manifest = workspace_manifest()?;
    let dependencies = manifest["workspace"]["dependencies"].as_table().context("no dependencies")?;
    let libraries = dependencies.iter().filter(|(_, what)| what.get("path").is_some()).map(|(name, _)| name.clone());
    // Nothing in the workspace depends on the program.
    Ok(libraries.chain(["fingerpad-cli".to_owned()]).collect())
}

fn workspace_manifest() -> Result<Table> {
    Ok(fs::read_to_string(root().join("Cargo.toml"))?.parse()?)
}

/// A workspace of the packages.
fn manifest(names: &[String]) -> Result<Table> {
    let folders: Vec<String> = names.iter().map(|name| folder_of(name)).collect();
    let patch = |name: &String| (name.clone(), Table::from_iter([("path".to_owned(), folder_of(name).into())]).into());
    let patches: Table = names.iter().map(patch).collect();
    let workspace = [("resolver".to_owned(), Value::from("3")), ("members".to_owned(), folders.into())];
    Ok(Table::from_iter([
        ("workspace".to_owned(), Value::from(Table::from_iter(workspace))),
        ("patch".to_owned(), Table::from_iter([("crates-io".to_owned(), patches.into())]).into()),
    ]))
}

fn folder_of(name: &str) -> String {
    format!("{name}-{VERSION}")
}
