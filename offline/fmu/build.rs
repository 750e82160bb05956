//! Compiles the co-simulation unit for this machine and embeds it with its sources, so that a program can hand them on from every
//! folder.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

fn main() {
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    let root = fs::canonicalize("../..").expect("the repository");
    embed_sources(&root, &out.join("fmu_sources.rs"));
    compile_unit(&root, &out);
}

/// What an FMU's folder `sources` holds: the unit in C, the header, and the Rust behind it.
fn embed_sources(root: &Path, list: &Path) {
    let mut named = Vec::new();
    let mut folder = |from: &str, to: &str| {
        println!("cargo::rerun-if-changed={}", root.join(from).display());
        for file in all_files_of(&root.join(from)) {
            let name = file.strip_prefix(root.join(from)).expect("inside").to_string_lossy().replace('\\', "/");
            named.push((format!("{to}{name}"), file));
        }
    };
    folder("bindings/fmu", "");
    folder("core/src", "rust/core/src/");
    folder("bindings/c/src", "rust/bindings/c/src/");
    folder("bindings/c/story", "rust/bindings/c/story/");
    for (from, to) in [
        ("bindings/c/fingerpad.h", "fingerpad.h"),
        ("bindings/c/fingerpad.h", "rust/bindings/c/fingerpad.h"),
        ("bindings/c/Cargo.toml", "rust/bindings/c/Cargo.toml"),
        ("bindings/c/Cargo.lock", "rust/bindings/c/Cargo.lock"),
        ("bindings/c/build.rs", "rust/bindings/c/build.rs"),
        ("core/Cargo.toml", "rust/core/Cargo.toml"),
        ("core/README.md", "rust/core/README.md"),
        ("LICENSE-MIT", "LICENSE-MIT"),
        ("LICENSE-APACHE", "LICENSE-APACHE"),
    ] {
        println!("cargo::rerun-if-changed={}", root.join(from).display());
        named.push((to.to_owned(), root.join(from)));
    }
    let entries: String = named.iter().map(|(name, file)| format!("({name:?}, include_bytes!({file:?})),\n")).collect();
    fs::write(list, format!("&[\n{entries}]\n")).expect("a writable folder");
}

/// The unit as a shared library in `OUT_DIR`; an empty file where there is no C compiler of the usual kind.
fn compile_unit(root: &Path, out: &Path) {
    let target = env::var("TARGET").expect("cargo sets it");
    let unit = out.join("unit");
    if target.contains("windows") {
        fs::write(&unit, []).expect("a writable folder");
        return;
    }
    let built = out.join("c_library");
    let library = compile_c_library(&root.join("bindings/c"), &target, &built);
    let folder = root.join("bindings/fmu");
    let mut cc = Command::new(env::var("CC").unwrap_or_else(|_| "cc".into()));
    cc.args(["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-s"]);
    cc.arg("-I").arg(folder.join("fmi")).arg("-I").arg(root.join("bindings/c"));
    cc.arg(folder.join("fingerpad_fmu.c")).arg(folder.join("unused.c")).arg(library).arg("-o").arg(&unit);
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
    for name in ["CARGO_ENCODED_RUSTFLAGS", "RUSTFLAGS", "RUSTC_WRAPPER", "RUSTC_WORKSPACE_WRAPPER"] {
        cargo.env_remove(name);
    }
    cargo
        .current_dir(folder)
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
