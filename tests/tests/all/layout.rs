//! The crates' directions: which package of this workspace may use which other one.

use std::collections::BTreeSet;
use std::process::Command;

use serde_json::{Value, json};

const CORE: &str = "fingerpad";
const FORMATS: &str = "fingerpad-formats";
const LEAST_SQUARES: &str = "fingerpad-least-squares";
const LINEAR: &str = "fingerpad-linear";
const MESH: &str = "fingerpad-mesh";
const FE: &str = "fingerpad-fe";
const FMU: &str = "fingerpad-fmu";
const IDENTIFY: &str = "fingerpad-identify";
const REDUCE: &str = "fingerpad-reduce";
const SMOOTH: &str = "fingerpad-smooth";
const DIAGNOSE: &str = "fingerpad-diagnose";
const REPORT: &str = "fingerpad-report";
const CLI: &str = "fingerpad-cli";
const TESTS: &str = "fingerpad-tests";
const XTASK: &str = "xtask";

const LIBRARIES: &[&str] =
    &[CORE, FORMATS, LEAST_SQUARES, LINEAR, MESH, FE, IDENTIFY, REDUCE, SMOOTH, DIAGNOSE, REPORT, FMU];

/// Each package and the packages of this workspace that it may use, for its library, its build script and its own tests.
const MAY_USE: [(&str, &[&str]); 15] = [
    (CORE, &[]),
    (FORMATS, &[]),
    (LEAST_SQUARES, &[]),
    (LINEAR, &[]),
    (MESH, &[FORMATS, LEAST_SQUARES]),
    (FE, &[CORE, FORMATS, LINEAR, MESH]),
    (IDENTIFY, &[DIAGNOSE, FE, FORMATS, LEAST_SQUARES]),
    (REDUCE, &[FE, FORMATS, LEAST_SQUARES, CORE]),
    (SMOOTH, &[CORE, LEAST_SQUARES]),
    (DIAGNOSE, &[CORE, FORMATS, SMOOTH, FE]),
    (REPORT, &[IDENTIFY, REDUCE, DIAGNOSE, FE, FORMATS, CORE, SMOOTH]),
    (FMU, &[CORE]),
    (CLI, LIBRARIES),
    (TESTS, &[CORE, FORMATS, LEAST_SQUARES, FE, IDENTIFY, REDUCE, SMOOTH, DIAGNOSE, REPORT, CLI, XTASK]),
    (XTASK, &[CORE, FORMATS, FE, IDENTIFY, REDUCE, SMOOTH, DIAGNOSE, REPORT, CLI]),
];

/// Contradictions between `cargo metadata` and the table, one line each.
fn contradictions(metadata: &Value) -> Vec<String> {
    let packages = metadata["packages"].as_array().expect("cargo metadata lists packages");
    let name = |value: &Value| value["name"].as_str().expect("packages and dependencies have names").to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    let mut found = Vec::new();
    for package in packages {
        let from = name(package);
        let Some((_, allowed)) = MAY_USE.iter().find(|row| row.0 == from) else {
            found.push(format!("{from} is not in the table of packages"));
            continue;
        };
        for dependency in package["dependencies"].as_array().expect("a package lists its dependencies") {
            let to = name(dependency);
            if ours.contains(&to) && !allowed.contains(&to.as_str()) {
                let kind = dependency["kind"].as_str().unwrap_or("normal");
                found.push(format!("{from} -> {to} ({kind} dependency): {from} may use only {allowed:?}"));
            }
        }
    }
    found
        .extend(MAY_USE.iter().filter(|row| !ours.contains(row.0)).map(|row| format!("there is no package {}", row.0)));
    found
}

/// Standard output of cargo.
fn cargo(words: &[&str]) -> String {
    let out = Command::new(env!("CARGO")).current_dir(env!("CARGO_MANIFEST_DIR")).args(words).output().unwrap();
    assert!(out.status.success(), "cargo {words:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

#[test]
fn the_crates_have_one_direction() {
    let metadata = serde_json::from_str(&cargo(&["metadata", "--no-deps", "--format-version", "1"])).unwrap();
    let found = contradictions(&metadata);
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// The core takes either of two versions of nalgebra; the lock names the one that the host crates are held to.
#[test]
fn one_nalgebra_is_compiled() {
    let tree = ["tree", "--package", CLI, "--edges", "normal,build", "--prefix", "none", "--format", "{p}"];
    let tree = cargo(&tree);
    let versions: BTreeSet<&str> =
        tree.lines().filter_map(|line| line.strip_prefix("nalgebra ")?.split(" ").next()).collect();
    assert_eq!(versions.len(), 1, "{versions:?}: set the version of `fingerpad` in Cargo.lock to that of the others");
}

/// The workspace of the table, in which every package uses all that it may.
fn allowed_workspace() -> Value {
    let package = |(name, uses): &(&str, &[&str])| {
        let external = json!({ "name": "serde", "kind": null });
        let ours = uses.iter().map(|to| json!({ "name": to, "kind": null }));
        json!({ "name": name, "dependencies": ours.chain([external]).collect::<Vec<_>>() })
    };
    json!({ "packages": MAY_USE.iter().map(package).collect::<Vec<_>>() })
}

fn add(metadata: &mut Value, from: &str, to: &str, kind: Value) {
    let packages = metadata["packages"].as_array_mut().unwrap();
    let package = packages.iter_mut().find(|package| package["name"] == from).unwrap();
    package["dependencies"].as_array_mut().unwrap().push(json!({ "name": to, "kind": kind }));
}

#[test]
fn what_the_table_allows_passes_and_has_no_circle() {
    assert_eq!(contradictions(&allowed_workspace()), Vec::<String>::new());
    // Packages are removed one by one; each uses only packages that were removed before.
    let mut left: Vec<_> = MAY_USE.to_vec();
    while !left.is_empty() {
        let names: Vec<&str> = left.iter().map(|row| row.0).collect();
        left.retain(|row| row.1.iter().any(|to| names.contains(to)));
        assert!(left.len() < names.len(), "a circle among {names:?}");
    }
}

#[test]
fn a_forbidden_arrow_is_named() {
    for (from, to, kind) in [
        (DIAGNOSE, IDENTIFY, Value::Null),
        (FE, REDUCE, Value::Null),
        (REPORT, FMU, json!("build")),
        (FORMATS, TESTS, json!("dev")),
        (CLI, XTASK, Value::Null),
        (CORE, FORMATS, json!("dev")),
    ] {
        let mut metadata = allowed_workspace();
        add(&mut metadata, from, to, kind.clone());
        let found = contradictions(&metadata);
        let arrow = format!("{from} -> {to} ({} dependency)", kind.as_str().unwrap_or("normal"));
        assert!(found.len() == 1 && found[0].starts_with(&arrow), "{arrow}: {found:?}");
    }
}

#[test]
fn a_package_without_a_place_is_named() {
    let mut metadata = allowed_workspace();
    metadata["packages"][1]["name"] = json!("fingerpad-utils");
    let found = contradictions(&metadata);
    assert!(found.contains(&"fingerpad-utils is not in the table of packages".to_owned()), "{found:?}");
    assert!(found.contains(&format!("there is no package {FORMATS}")), "{found:?}");
}
