//! Writes the C header beside this file whenever the library changes.

fn main() {
    #[cfg(feature = "header")]
    write_header();
}

#[cfg(feature = "header")]
fn write_header() {
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let config = cbindgen::Config::from_file("cbindgen.toml").expect("cbindgen.toml lies beside build.rs");
    cbindgen::Builder::new()
        .with_config(config)
        .with_src(format!("{here}/src/lib.rs"))
        .generate()
        .expect("the library's types can be written in C")
        .write_to_file(format!("{here}/fingerpad.h"));
    println!("cargo:rerun-if-changed=src");
    println!("cargo:rerun-if-changed=cbindgen.toml");
    println!("cargo:rerun-if-changed=fingerpad.h");
}
