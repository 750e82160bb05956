//! All packages of a release in one folder, for a person to upload: crates, Python wheels, the npm package, the C library.
//!
//! Main function: [`main`]. Uses `package`, `wheel`, `web` and `c_release`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{c_release, package, root, run, web, wheel};

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Files that state the version, and the words before it.
const STATED: [(&str, &str); 4] = [
    ("bindings/python/pyproject.toml", "version = \""),
    ("bindings/warp/pyproject.toml", "version = \""),
    ("CITATION.cff", "version: "),
    ("CHANGELOG.md", "## "),
];

/// Options of `cargo xtask release`.
#[derive(clap::Args)]
pub struct Args {
    /// Folder to make; it must not exist yet
    #[arg(long, value_name = "FOLDER", default_value = concat!("target/release-", env!("CARGO_PKG_VERSION")))]
    out: PathBuf,
}

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    let out = std::path::absolute(&args.out)?;
    ensure!(!out.exists(), "{} is there already", out.display());
    check_version()?;
    package::pack(&out.join("crates"))?;
    wheel::release(&out.join("python"))?;
    let npm = out.join("npm");
    fs::create_dir_all(&npm)?;
    run(Command::new("npm").args(["pack", "--pack-destination"]).arg(&npm).arg(web::npm_package()?))?;
    c_release::release(&out.join(format!("fingerpad-c-{VERSION}")))?;
    list(&out)
}

/// Every file that states the version must state this one.
fn check_version() -> Result<()> {
    for (file, before) in STATED {
        let text = fs::read_to_string(root().join(file)).with_context(|| file.to_owned())?;
        ensure!(
            text.contains(&format!("{before}{VERSION}")),
            "{file}: no `{before}{VERSION}`, the version in Cargo.toml"
        );
    }
    package::check_recipe()?;
    let changes = fs::read_to_string(root().join("CHANGELOG.md"))?;
    if changes.contains(&format!("## {VERSION}, not yet published")) {
        println!("note: CHANGELOG.md has no date for {VERSION} yet");
    }
    Ok(())
}

/// Prints what was made, with sizes.
fn list(out: &Path) -> Result<()> {
    let mut entries: Vec<PathBuf> = Vec::new();
    for folder in ["crates", "python", "npm"] {
        for entry in fs::read_dir(out.join(folder))? {
            entries.push(entry?.path());
        }
    }
    entries.push(out.join(format!("fingerpad-c-{VERSION}")));
    entries.sort();
    for entry in &entries {
        let bytes = if entry.is_dir() { c_release::size(entry)? } else { entry.metadata()?.len() };
        let name = entry.strip_prefix(out).unwrap_or(entry);
        println!("{:>10.3} MB  {}", bytes as f64 / 1e6, name.display());
    }
    println!("{}: {} packages; the steps that upload them are in CONTRIBUTING.md", out.display(), entries.len());
    Ok(())
}
