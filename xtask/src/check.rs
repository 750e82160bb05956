//! While working, `cargo xtask check`: format, Clippy and unit tests of changed packages and of those that depend on them, and four quick
//! tests across packages.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use serde::Deserialize;

use crate::shell::{command, output, root, sh};
use crate::{install, rust};

/// Options of `cargo xtask check`.
#[derive(clap::Args)]
pub struct Args {
    /// Check the changes since this commit; without it, the uncommitted ones
    #[arg(long, value_name = "COMMIT", default_value = "HEAD")]
    since: String,
    /// Check all packages
    #[arg(long)]
    all: bool,
}

/// Tests that run for every change: one of contact, one of friction, one diagnosis, and the directions of the packages.
const ALWAYS: &str = "layout:: cases::hertz cases::mindlin diagnose::clear_effects_are_named_and_shrink_the_gap";
/// Files at the root that belong to every package.
const OF_ALL: [&str; 4] = ["Cargo.toml", "Cargo.lock", "rustfmt.toml", ".cargo/config.toml"];

/// Runs the checks one after the other; the first failure ends them.
pub fn main(args: &Args) -> Result<()> {
    let packages = Packages::read()?;
    let changed =
        if args.all { packages.0.keys().cloned().collect() } else { packages.changed(&changed_files(&args.since)?) };
    let affected = packages.with_dependents(&changed);
    println!("changed: {}", changed.into_iter().collect::<Vec<_>>().join(", "));
    println!("checked: {}", affected.iter().map(String::as_str).collect::<Vec<_>>().join(", "));
    let selection: String = affected.iter().map(|name| format!(" --package {name}")).collect();
    let mut costs = vec![timed("format", rust::format)?];
    if !affected.is_empty() {
        install::component("clippy", "clippy")?;
        let clippy = format!("cargo clippy --all-targets{selection} -- --deny warnings");
        costs.push(timed("clippy", || sh(".", &clippy))?);
        costs.push(timed("unit tests", || sh(".", &format!("cargo test --lib --bins{selection}")))?);
    }
    if affected.contains("fingerpad") {
        costs.push(timed("core", || sh(".", "cargo test --package fingerpad --test all"))?);
    }
    costs.push(timed("cases", || sh(".", &format!("cargo test --package fingerpad-tests --test all -- {ALWAYS}")))?);
    println!("{}", costs.join("\n"));
    Ok(())
}

fn timed(name: &str, step: impl FnOnce() -> Result<()>) -> Result<String> {
    let start = Instant::now();
    step()?;
    Ok(format!("{name:<12} {:>6.1} s", start.elapsed().as_secs_f64()))
}

/// Files that differ from a commit, those that git does not track yet included; paths from the root.
fn changed_files(since: &str) -> Result<Vec<PathBuf>> {
    let tracked = output(&mut command(".", &format!("git diff --name-only {since}")))?;
    let new = output(&mut command(".", "git ls-files --others --exclude-standard"))?;
    Ok(tracked.lines().chain(new.lines()).map(PathBuf::from).collect())
}

/// The packages of the workspace: folder from the root, and names of the packages that it uses.
struct Packages(BTreeMap<String, (PathBuf, BTreeSet<String>)>);

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Described>,
}

#[derive(Deserialize)]
struct Described {
    name: String,
    manifest_path: PathBuf,
    dependencies: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    name: String,
}

impl Packages {
    fn read() -> Result<Self> {
        let text = output(&mut command(".", "cargo metadata --no-deps --format-version 1"))?;
        let metadata: Metadata = serde_json::from_str(&text)?;
        let package = |of: Described| -> Result<_> {
            let folder = of.manifest_path.parent().unwrap_or(Path::new("")).strip_prefix(root())?.to_path_buf();
            Ok((of.name, (folder, of.dependencies.into_iter().map(|used| used.name).collect())))
        };
        Ok(Self(metadata.packages.into_iter().map(package).collect::<Result<_>>()?))
    }

    /// The packages that files belong to.
    fn changed(&self, files: &[PathBuf]) -> BTreeSet<String> {
        let all = files.iter().any(|file| OF_ALL.iter().any(|name| file == Path::new(name)));
        let changed =
            |(_, (folder, _)): &(&String, &(PathBuf, _))| all || files.iter().any(|file| file.starts_with(folder));
        self.0.iter().filter(changed).map(|(name, _)| name.clone()).collect()
    }

    /// The same with everything that uses them, directly or not.
    fn with_dependents(&self, names: &BTreeSet<String>) -> BTreeSet<String> {
        let users = self.0.iter().filter(|(_, (_, uses))| !uses.is_disjoint(names)).map(|(name, _)| name.clone());
        let more: BTreeSet<String> = users.chain(names.iter().cloned()).collect();
        if more.len() == names.len() { more } else { self.with_dependents(&more) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_reaches_what_uses_it() {
        let package = |name: &str, folder: &str, uses: &[&str]| {
            (name.to_owned(), (PathBuf::from(folder), uses.iter().map(|&name| name.to_owned()).collect()))
        };
        let packages = Packages(BTreeMap::from([
            package("core", "core", &["serde"]),
            package("fe", "offline/fe", &["core"]),
            package("cli", "offline/cli", &["fe"]),
            package("formats", "offline/formats", &[]),
        ]));
        let affected = |files: &[&str]| -> Vec<String> {
            let files: Vec<PathBuf> = files.iter().map(PathBuf::from).collect();
            packages.with_dependents(&packages.changed(&files)).into_iter().collect()
        };
        assert_eq!(affected(&["core/src/lib.rs"]), ["cli", "core", "fe"]);
        assert_eq!(affected(&["offline/fe/src/lib.rs", "README.md"]), ["cli", "fe"]);
        assert_eq!(affected(&["docs/model.md", "bindings/c/src/lib.rs"]), [""; 0]);
        assert_eq!(affected(&["Cargo.lock"]).len(), 4);
    }
}
