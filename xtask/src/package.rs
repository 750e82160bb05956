//! The published crate of the core: packed, unpacked in a folder outside this workspace, tested there.

use std::fs::File;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use flate2::read::GzDecoder;

use crate::{cargo, root, run};

/// What the crate must hold beside its sources.
const FILES: [&str; 8] = [
    "Cargo.lock",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "docs/fpm-format.md",
    "docs/add-an-effect.md",
    "tests/data/fingertip.fpm",
    "tests/data/law-vectors.csv",
];

/// Packs the core and runs its tests from the package.
pub fn test() -> Result<()> {
    // Its own build is left out here: the tests below build it.
    cargo(&["package", "--package", "fingerpad", "--allow-dirty", "--no-verify"], &[])?;
    let name = concat!("fingerpad-", env!("CARGO_PKG_VERSION"));
    let packed = root().join("target/package").join(format!("{name}.crate"));
    let folder = tempfile::tempdir()?;
    let file = File::open(&packed).with_context(|| packed.display().to_string())?;
    let mut archive = tar::Archive::new(GzDecoder::new(file));
    // Every package has the same date in its files; cargo would take what it built of an earlier one.
    archive.set_preserve_mtime(false);
    archive.unpack(folder.path())?;
    let unpacked = folder.path().join(name);
    for file in FILES {
        let there = std::fs::symlink_metadata(unpacked.join(file)).is_ok_and(|meta| meta.is_file() && meta.len() > 0);
        ensure!(there, "the package has no file {file}");
    }
    run(Command::new(env!("CARGO"))
        .current_dir(&unpacked)
        .env("CARGO_TARGET_DIR", root().join("target/package/tests"))
        .args(["test", "--release", "--locked", "--features", "frame,serde,std"]))
}
