//! Embeds the stored runs of `data/runs`, so that the program finds them from every folder. Sets `repository` for the tests
//! of the pages, which a published package does not hold.

use std::{env, fs, path::Path};

fn main() {
    println!("cargo::rustc-check-cfg=cfg(repository)");
    if Path::new("../../docs").is_dir() {
        println!("cargo::rustc-cfg=repository");
    }
    let folder = fs::canonicalize("data/runs").expect("the package holds data/runs");
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut files: Vec<_> = fs::read_dir(&folder).expect("a folder").map(|e| e.expect("an entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "fprun"));
    files.sort();
    let entries: String = files
        .iter()
        .map(|file| format!("({:?}, include_bytes!({file:?})),\n", file.file_name().expect("a name")))
        .collect();
    let out = env::var("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("shipped_runs.rs"), format!("&[\n{entries}]\n")).expect("a writable folder");
}
