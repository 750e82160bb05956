//! Lays out the sources of the co-simulation unit as an FMU holds them, compiles the unit from them for this machine, and embeds
//! both, so that a program can hand them on from every folder.
//!
//! The folder `sources` links to the unit's C, the C library and the core. Cargo would leave a file `Cargo.toml` there out of the
//! published package; the three are called `manifest.toml`.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use toml::{Table, Value};

/// What an FMU's folder `sources` holds: where it is in this package, and where there.
const FROM_TO: [(&str, &str); 14] = [
    ("sources/unit", ""),
    ("sources/c/fingerpad.h", "fingerpad.h"),
    ("LICENSE-MIT", "LICENSE-MIT"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
    ("sources/c/src", "rust/bindings/c/src"),
    ("sources/c/fingerpad.h", "rust/bindings/c/fingerpad.h"),
    ("sources/c/manifest.toml", "rust/bindings/c/Cargo.toml"),
    ("sources/c/lock.toml", "rust/bindings/c/Cargo.lock"),
    ("sources/c/build.rs", "rust/bindings/c/build.rs"),
    ("sources/c/story/src", "rust/bindings/c/story/src"),
    ("sources/c/story/manifest.toml", "rust/bindings/c/story/Cargo.toml"),
    ("sources/core/src", "rust/core/src"),
    ("sources/core/README.md", "rust/core/README.md"),
    ("sources/core/manifest.toml", "rust/core/Cargo.toml"),
];

fn main() {
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    let sources = out.join("sources");
    lay_out(&sources);
    embed(&sources, &out.join("fmu_sources.rs"));
    compile_unit(&sources, &out);
}

/// Copies the sources to `to`, with what they need of the workspace's file.
fn lay_out(to: &Path) {
    if to.exists() {
        fs::remove_dir_all(to).expect("a folder of this build");
    }
    for (from, name) in FROM_TO {
        copy(&watched(from), &to.join(name));
    }
    let workspace = fs::read_to_string(watched("sources/workspace.toml")).expect("the workspace's file");
    fs::write(to.join("rust/Cargo.toml"), part_of(&workspace)).expect("a writable folder");
}

/// A path of this package, links followed; the build runs again when it changes.
fn watched(path: &str) -> PathBuf {
    let real = fs::canonicalize(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    println!("cargo::rerun-if-changed={}", real.display());
    real
}

/// Copies a file, or a folder with all that is in it.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        files_of(from).iter().for_each(|file| copy(file, &to.join(file.file_name().expect("it has a name"))));
        return;
    }
    fs::create_dir_all(to.parent().expect("in a folder")).expect("a writable folder");
    fs::copy(from, to).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
}

/// The workspace's file with no more than what the core needs of it.
fn part_of(workspace: &str) -> String {
    let whole: Table = workspace.parse().expect("cargo has read it");
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

/// Writes the list of the sources: their names and bytes.
fn embed(sources: &Path, list: &Path) {
    let entry = |file: &PathBuf| {
        let name = file.strip_prefix(sources).expect("inside").to_string_lossy().replace('\\', "/");
        format!("({name:?}, include_bytes!({file:?})),\n")
    };
    let entries: String = all_files_of(sources).iter().map(entry).collect();
    fs::write(list, format!("&[\n{entries}]\n")).expect("a writable folder");
}

/// The unit as a shared library in `OUT_DIR`; an empty file where there is no C compiler of the usual kind, where documentation is
/// made without a network for what the C library needs (docs.rs), and where a build asks for none.
fn compile_unit(sources: &Path, out: &Path) {
    let target = env::var("TARGET").expect("cargo sets it");
    let unit = out.join("unit");
    let without = ["DOCS_RS", "FINGERPAD_FMU_WITHOUT_UNIT"].map(|name| {
        println!("cargo::rerun-if-env-changed={name}");
        env::var_os(name).is_some()
    });
    if target.contains("windows") || without.contains(&true) {
        fs::write(&unit, []).expect("a writable folder");
        return;
    }
    let library = compile_c_library(&sources.join("rust/bindings/c"), &target, &out.join("c_library"));
    let mut cc = Command::new(env::var("CC").unwrap_or_else(|_| "cc".into()));
    cc.args(["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-s"]);
    cc.arg("-I").arg(sources.join("fmi")).arg("-I").arg(sources);
    cc.arg(sources.join("fingerpad_fmu.c")).arg(sources.join("unused.c")).arg(library).arg("-o").arg(&unit);
    if target.contains("linux") {
        cc.args(["-Wl,--gc-sections", "-Wl,--exclude-libs,ALL"]);
    }
    let status = cc.status().expect("a C compiler, which the linker of Rust programs comes with");
    assert!(status.success(), "the co-simulation unit does not compile");
}

/// The C library for `target`, for every processor of its family, in a build of its own.
fn compile_c_library(folder: &Path, target: &str, built: &Path) -> PathBuf {
    let mut cargo = Command::new(env::var("CARGO").expect("cargo sets it"));
    // The flags and wrappers of the build that runs this are for this machine and for its lints.
    for name in ["CARGO_ENCODED_RUSTFLAGS", "RUSTC_WRAPPER", "RUSTC_WORKSPACE_WRAPPER"] {
        cargo.env_remove(name);
    }
    cargo
        .current_dir(folder)
        .env("RUSTFLAGS", "-Ctarget-cpu=generic")
        .env("CARGO_PROFILE_RELEASE_DEBUG", "0")
        .args(["rustc", "--quiet", "--lib", "--release", "--locked", "--no-default-features"])
        .args(["--crate-type", "staticlib", "--target", target, "--target-dir"])
        .arg(built);
    assert!(cargo.status().expect("cargo runs").success(), "the C library does not compile");
    built.join(target).join("release/libfingerpad_c.a")
}

/// The files of a folder, by name.
fn files_of(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<_> = entries.map(|e| e.expect("an entry").path()).collect();
    files.sort();
    files
}

/// The files of a folder and of the folders in it.
fn all_files_of(folder: &Path) -> Vec<PathBuf> {
    let (folders, mut files): (Vec<_>, Vec<_>) = files_of(folder).into_iter().partition(|path| path.is_dir());
    files.extend(folders.iter().flat_map(|folder| all_files_of(folder)));
    files
}
