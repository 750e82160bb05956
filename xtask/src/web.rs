//! The page: compile the core for the browser, put the folder together, test it, take its picture.
//!
//! Main type: [`Action`]. Also opens the pages of the book. Uses `thumb::tools` for the compiler, `c` for the
//! story of the bindings and `install` for what is missing.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Subcommand;

use crate::shell::{command, refusal, root, run, sh};
use crate::thumb::tools::{Compiler, Route};
use crate::{c, install};

/// Folder of the page's workspace, and of its tests, from the repository's root.
const WEB: &str = "bindings/web";
const TEST: &str = "bindings/web/test";
const TARGET: &str = "wasm32-unknown-unknown";

/// Options of `cargo xtask web`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
}

/// What can be done with the page.
#[derive(Clone, Copy, Subcommand)]
enum Action {
    /// The static folder `bindings/web/site` and the npm package `bindings/web/target/npm` (the default)
    Build,
    /// Build, then the picture of README
    Picture,
    /// Build, then ns a step in Chromium and on the host, as lines of JSON
    Bench,
}

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    build()?;
    match args.action.unwrap_or(Action::Build) {
        Action::Build => Ok(()),
        Action::Picture => {
            pages()?;
            run(command(TEST, "node pictures.js --readme").arg(root().join("docs/pictures/page.png")))
        }
        Action::Bench => {
            pages()?;
            sh(TEST, "node bench.js")
        }
    }
}

/// The module and the npm package in Node.
pub fn gate() -> Result<()> {
    build()?;
    // Its bits, not its speed.
    run(reference().env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16"))?;
    let story = tempfile::tempdir()?;
    c::tell_story(story.path())?;
    run(command(TEST, "node --test --test-reporter=spec package.test.js").env("STORY", story.path()))
}

/// The page in headless Chromium; a module with a panic in it must be refused.
pub fn nightly() -> Result<()> {
    compile("--features panics")?;
    let says = refusal(&mut command(TEST, "node build.js"))?;
    ensure!(says.contains("the module imports"), "a module that panics should be refused: {says}");
    build()?;
    pages()?;
    sh(TEST, "node --test --test-reporter=spec page.test.js")
}

/// Opens every page of a built book in Chromium, wide and narrow; writes pictures of them to a folder, if one is given.
pub fn book(site: &Path, pictures: Option<&Path>) -> Result<()> {
    packages()?;
    chromium()?;
    let mut node = command(TEST, "node book.js");
    node.arg(std::path::absolute(site)?);
    if let Some(folder) = pictures {
        node.arg(std::path::absolute(folder)?);
    }
    run(&mut node)
}

/// Builds the page and the npm package; returns the folder of the package.
pub fn build() -> Result<PathBuf> {
    compile("")?;
    sh(TEST, "node build.js")?;
    println!("{WEB}/site: python3 -m http.server --directory {WEB}/site");
    Ok(root().join(WEB).join("target/npm"))
}

/// Chromium, and the program with which the page is compared.
fn pages() -> Result<()> {
    run(&mut reference())?;
    chromium()
}

/// Builds the program that has the bits of the core on the host.
fn reference() -> Command {
    command(WEB, "cargo build --release --locked --package fingerpad-web-reference")
}

fn compile(extra: &str) -> Result<()> {
    packages()?;
    Compiler::prepare(Route::Auto, TARGET)?.build(WEB, TARGET, &format!("--locked --package fingerpad-web {extra}"))
}

/// The browser that the variable CHROMIUM names, or Debian's.
fn chromium() -> Result<()> {
    if std::env::var_os("CHROMIUM").is_some() { Ok(()) } else { install::programs(&["chromium"]) }
}

/// Node and the packages that the lock file names.
fn packages() -> Result<()> {
    install::programs(&["npm"])?;
    let changed = |name: &str| root().join(TEST).join(name).metadata().and_then(|file| file.modified());
    // npm writes this list when it has installed all; the lock file is older then.
    let locked = changed("package-lock.json").context("package-lock.json")?;
    if changed("node_modules/.package-lock.json").is_ok_and(|installed| installed >= locked) {
        return Ok(());
    }
    install::retry(|| command(TEST, "npm ci --no-audit --no-fund --ignore-scripts"))
}
