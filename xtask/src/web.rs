//! The page: compile the core for the browser, put the folder together, test it, take its picture.
//!
//! Main type: [`Action`]. Also opens the pages of the book. Uses `thumb::tools` for the compiler and `install` for what is missing.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Subcommand;

use crate::thumb::tools::{Compiler, Route, cargo_command};
use crate::{install, root, run};

/// Folder of the page's workspace, from the repository's root.
const WEB: &str = "bindings/web";
const TARGET: &str = "wasm32-unknown-unknown";
const PICTURE: &str = "docs/pictures/page.png";

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
    /// Build, then all tests in headless Chromium
    Test,
    /// Build, then the picture of README
    Picture,
    /// Build, then ns a step in Chromium and on the host, as lines of JSON
    Bench,
}

/// Entry of the chore.
pub fn main(args: &Args) -> Result<()> {
    match args.action.unwrap_or(Action::Build) {
        Action::Build => build(),
        Action::Test => test(),
        Action::Picture => {
            build()?;
            chromium()?;
            node(&["pictures.js", "--readme"], Some(PICTURE))
        }
        Action::Bench => {
            build()?;
            chromium()?;
            reference()?;
            node(&["bench.js"], None)
        }
    }
}

/// Builds the page and tests it; a module with a panic in it must be seen as one.
pub fn test() -> Result<()> {
    let tools = Compiler::prepare(Route::Auto, TARGET)?;
    packages()?;
    compile(&tools, &["--features", "panics"])?;
    let refused = Command::new("node").current_dir(root().join(WEB).join("test")).arg("build.js").output()?;
    let says = String::from_utf8_lossy(&refused.stderr);
    ensure!(
        !refused.status.success() && says.contains("the module imports"),
        "a module that panics should be refused: {says}"
    );
    build()?;
    chromium()?;
    reference()?;
    node(&["--test", "--test-reporter=spec", "package.test.js", "page.test.js"], None)
}

/// Opens every page of a built book in Chromium, wide and narrow; writes pictures of them to a folder, if one is given.
pub fn book(site: &Path, pictures: Option<&Path>) -> Result<()> {
    packages()?;
    chromium()?;
    let mut node = Command::new("node");
    node.current_dir(root().join(WEB).join("test")).arg("book.js").arg(std::path::absolute(site)?);
    if let Some(folder) = pictures {
        node.arg(std::path::absolute(folder)?);
    }
    run(&mut node)
}

/// Builds the page and the npm package; returns the folder of the package.
pub fn npm_package() -> Result<PathBuf> {
    build()?;
    Ok(root().join(WEB).join("target/npm"))
}

fn build() -> Result<()> {
    let tools = Compiler::prepare(Route::Auto, TARGET)?;
    packages()?;
    compile(&tools, &[])?;
    node(&["build.js"], None)?;
    println!("{WEB}/site: python3 -m http.server --directory {WEB}/site");
    Ok(())
}

fn compile(tools: &Compiler, extra: &[&str]) -> Result<()> {
    tools.build(WEB, TARGET, &[&["--locked", "--package", "fingerpad-web"], extra].concat())
}

/// The program with which the page's bits are compared.
fn reference() -> Result<()> {
    let mut cargo = cargo_command();
    cargo.current_dir(root().join(WEB));
    run(cargo.args(["build", "--release", "--locked", "--package", "fingerpad-web-reference"]))
}

/// Node and the packages that the lock file names.
fn packages() -> Result<()> {
    if !install::succeeds(Command::new("npm").arg("--version")) {
        install::debian(&["nodejs", "npm"], "apt-get install nodejs npm")?;
    }
    let folder = root().join(WEB).join("test");
    // npm writes this list when it has installed all; the lock file is older then.
    let installed = folder.join("node_modules/.package-lock.json").metadata().and_then(|list| list.modified());
    let locked =
        folder.join("package-lock.json").metadata().and_then(|lock| lock.modified()).context("package-lock.json")?;
    if installed.is_ok_and(|installed| installed >= locked) {
        return Ok(());
    }
    run(Command::new("npm").current_dir(folder).args(["ci", "--no-audit", "--no-fund", "--ignore-scripts"]))
}

fn chromium() -> Result<()> {
    if std::env::var_os("CHROMIUM").is_some() || install::succeeds(Command::new("/usr/bin/chromium").arg("--version")) {
        return Ok(());
    }
    install::debian(&["chromium"], "apt-get install chromium, or set CHROMIUM to a Chromium's path")
}

/// Runs a script of the test's folder, with a file from the repository's root as its last word.
fn node(words: &[&str], file: Option<&str>) -> Result<()> {
    let mut node = Command::new("node");
    node.current_dir(root().join(WEB).join("test")).args(words).args(file.map(|file| root().join(file)));
    run(&mut node)
}
