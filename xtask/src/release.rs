//! All packages of a first release in one folder, for a person to upload: crates, Python wheels, the npm package, the C library.
//!
//! Main function: [`main`]. Uses `package`, `binding`, `web` and `c`.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use crate::shell::{command, root, run};
use crate::{binding, c, package, web};

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Files that state the version, and the words before it.
const STATED: [(&str, &str); 5] = [
    ("bindings/mujoco/pyproject.toml", "version = \""),
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
    ensure!(!out.exists(), "{} exists already", out.display());
    for (file, before) in STATED {
        let text = fs::read_to_string(root().join(file)).with_context(|| file.to_owned())?;
        let stated = format!("{before}{VERSION}");
        ensure!(text.contains(&stated), "{file}: no `{stated}`, the version in Cargo.toml");
    }
    package::pack(&out.join("crates"))?;
    binding::release(&out.join("python"))?;
    fs::create_dir_all(out.join("npm"))?;
    let npm = web::build()?;
    run(command(".", "npm pack --pack-destination").arg(out.join("npm")).arg(npm))?;
    c::release(&out.join(format!("fingerpad-c-{VERSION}")))?;
    for folder in ["crates", "python", "npm", ""] {
        for entry in fs::read_dir(out.join(folder))? {
            let entry = entry?.path();
            let bytes = if entry.is_dir() { c::size(&entry)? } else { entry.metadata()?.len() };
            println!("{:>10.3} MB  {}", bytes as f64 / 1e6, entry.strip_prefix(&out).unwrap_or(&entry).display());
        }
    }
    println!("{}: the steps that upload it are in CONTRIBUTING.md", out.display());
    Ok(())
}
