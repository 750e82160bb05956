//! Puts memory.x where the linker looks for it and the recording into a table.
use std::{env, fmt::Write, fs, path::PathBuf};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("memory.x", out.join("memory.x")).expect("memory.x lies beside build.rs");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed=memory.x");

    let csv = fs::read_to_string("recording.csv").expect("recording.csv lies beside build.rs");
    let mut table = String::from("&[\n");
    for line in csv.lines().skip(1) {
        let (_time, counts) = line.split_once(',').expect("t_ms,depth_um,slide_x_um,slide_y_um");
        writeln!(table, "    [{counts}],").expect("a string grows");
    }
    table.push_str("]\n");
    fs::write(out.join("recording.rs"), table).expect("OUT_DIR can be written");
    println!("cargo:rerun-if-changed=recording.csv");
}
