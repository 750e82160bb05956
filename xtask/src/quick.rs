//! The quick tier, `cargo xtask check`: changed packages and those that depend on them, in the dev profile, which
//! compiles incrementally.
//!
//! Main function: [`main`]. Uses `gates` for the formatting.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::times::Times;
use crate::{gates, install, root, run};

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
const ALWAYS: [&str; 4] =
    ["layout::", "cases::hertz", "cases::mindlin", "diagnose::clear_effects_are_named_and_shrink_the_gap"];
/// The package that holds them.
const TESTS: &str = "fingerpad-tests";
/// The package with integration tests that take seconds.
const CORE: &str = "fingerpad";

/// Runs the quick tier.
pub fn main(args: &Args) -> Result<()> {
    let start = Instant::now();
    let packages = Packages::read()?;
    let changed = if args.all { packages.names() } else { packages.changed(&changed_files(&args.since)?) };
    let affected = packages.with_dependents(&changed);
    let list = |names: &BTreeSet<String>| names.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
    match affected.is_empty() {
        true => println!("no package changed since {}", args.since),
        false => println!("changed: {}; with dependent packages: {}", list(&changed), list(&affected)),
    }
    let selection: Vec<&str> = affected.iter().flat_map(|name| ["--package", name]).collect();
    let mut steps: Vec<(&str, Vec<&str>)> = Vec::new();
    if !affected.is_empty() {
        steps.push(("clippy", [&["clippy", "--all-targets"], &selection[..], &["--", "--deny", "warnings"]].concat()));
        steps.push(("unit", [&["test", "--lib", "--bins"], &selection[..]].concat()));
    }
    if affected.contains(CORE) {
        steps.push(("core", vec!["test", "--package", CORE, "--test", "all"]));
    }
    steps.push(("cases", [&["test", "--package", TESTS, "--test", "all", "--"], &ALWAYS[..]].concat()));

    let mut names = vec!["check-format".to_owned()];
    let mut outcome = timed("check-format", gates::format);
    for (name, words) in steps {
        if outcome.is_err() {
            break;
        }
        if name == "clippy" {
            install::component("clippy", "clippy")?;
        }
        let name = format!("check-{name}");
        outcome = timed(&name, || run(Command::new(env!("CARGO")).current_dir(root()).args(words)));
        names.push(name);
    }
    Times::read(&root())?.print(&names, start.elapsed());
    outcome
}

fn timed(name: &str, step: impl FnOnce() -> Result<()>) -> Result<()> {
    println!("== {name}");
    let start = Instant::now();
    let outcome = step();
    Times::store(&root(), name, start.elapsed(), outcome.is_ok())?;
    outcome
}

/// Files that differ from a commit, those that git does not track yet included; paths from the root.
fn changed_files(since: &str) -> Result<Vec<PathBuf>> {
    let git = |words: &[&str]| -> Result<String> {
        let out = Command::new("git").current_dir(root()).args(words).output().context("git")?;
        ensure!(out.status.success(), "git {words:?}: {}", String::from_utf8_lossy(&out.stderr).trim());
        Ok(String::from_utf8(out.stdout)?)
    };
    let lists = [git(&["diff", "--name-only", since])?, git(&["ls-files", "--others", "--exclude-standard"])?];
    Ok(lists.iter().flat_map(|list| list.lines()).map(PathBuf::from).collect())
}

/// The packages of the workspace: their folders from the root, and which use which.
struct Packages(BTreeMap<String, Package>);

struct Package {
    folder: PathBuf,
    uses: BTreeSet<String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Described>,
    workspace_root: PathBuf,
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
        let words = ["metadata", "--no-deps", "--format-version", "1"];
        let out = Command::new(env!("CARGO")).current_dir(root()).args(words).output()?;
        ensure!(out.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&out.stderr));
        let metadata: Metadata = serde_json::from_slice(&out.stdout)?;
        let mut packages = BTreeMap::new();
        for Described { name, manifest_path, dependencies } in metadata.packages {
            let folder = manifest_path.parent().context("a manifest without a folder")?;
            let folder = folder.strip_prefix(&metadata.workspace_root)?.to_path_buf();
            packages.insert(name, Package { folder, uses: dependencies.into_iter().map(|d| d.name).collect() });
        }
        Ok(Self(packages))
    }

    fn names(&self) -> BTreeSet<String> {
        self.0.keys().cloned().collect()
    }

    /// The packages that files belong to; a manifest or a lock file at the root belongs to all of them.
    fn changed(&self, files: &[PathBuf]) -> BTreeSet<String> {
        let at_root = ["Cargo.toml", "Cargo.lock", "rustfmt.toml", ".cargo/config.toml"];
        if files.iter().any(|file| at_root.iter().any(|name| file == Path::new(name))) {
            return self.names();
        }
        let owner = |file: &PathBuf| self.0.iter().find(|(_, package)| file.starts_with(&package.folder));
        files.iter().filter_map(owner).map(|(name, _)| name.clone()).collect()
    }

    /// The same with everything that uses them, directly or not.
    fn with_dependents(&self, names: &BTreeSet<String>) -> BTreeSet<String> {
        let mut all = names.clone();
        loop {
            let more = self.0.iter().filter(|(name, package)| !all.contains(*name) && !package.uses.is_disjoint(&all));
            let more: Vec<String> = more.map(|(name, _)| name.clone()).collect();
            if more.is_empty() {
                return all;
            }
            all.extend(more);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_reaches_what_uses_it() {
        let package = |folder: &str, uses: &[&str]| Package {
            folder: folder.into(),
            uses: uses.iter().map(|&name| name.to_owned()).collect(),
        };
        let packages = Packages(BTreeMap::from([
            ("core".to_owned(), package("core", &["serde"])),
            ("fe".to_owned(), package("offline/fe", &["core"])),
            ("cli".to_owned(), package("offline/cli", &["fe"])),
            ("formats".to_owned(), package("offline/formats", &[])),
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
