//! The shipped models scored again, and the documents that hold their bytes.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::shell::{command, output, root, run, sh};
use crate::weekly;

const FILE: &str = "data/models/fingertip.fpm";
pub const PROGRAM: &str = "cargo run --release --package fingerpad-cli --";

/// The scores of the shipped models with the present core; then the documented bytes.
pub fn scores() -> Result<()> {
    run(&mut weekly::program("rescore_models"))?;
    document()
}

/// Updates the documented vectors, size and digest to the model file.
pub fn document() -> Result<()> {
    let line = format!("cargo run --quiet --release --package fingerpad --example document -- {FILE}");
    let printed = output(&mut command(".", &line))?;
    let parts: Vec<&str> = printed.trim().split("\n\n").collect();
    let [size, hex, vectors, golden] = parts[..] else { bail!("unexpected output: {printed}") };
    let document = root().join("core/docs/fpm-format.md");
    let mut text = fs::read_to_string(&document)?;
    let digest = golden.trim_start_matches("golden: ");
    for (from, to, new) in [
        ("`data/models/fingertip.fpm` has ", ", and starts", size),
        ("```hex\n", "\n```", hex),
        ("```vectors\n", "\n```", vectors),
        ("have the digest `", "`", digest),
    ] {
        let start = text.find(from).with_context(|| format!("{}: no {from}", document.display()))? + from.len();
        let end = start + text[start..].find(to).with_context(|| format!("{}: no {to}", document.display()))?;
        text.replace_range(start..end, new);
    }
    fs::write(&document, text)?;
    println!("{size}, digest {digest}: in {}", document.display());
    Ok(())
}

/// The corrected model of the firmware: the shipped one after a diagnosis of a stored set (drag inside the finite elements).
pub fn corrected() -> Result<()> {
    let dir = root().join("target/corrected");
    fs::create_dir_all(&dir)?;
    for name in ["calibration_d.csv", "set_05.csv"] {
        let packed = root().join("tests/data/fe_sets").join(format!("{name}.gz"));
        let mut from = flate2::read::GzDecoder::new(fs::File::open(packed)?);
        std::io::copy(&mut from, &mut fs::File::create(dir.join(name))?)?;
    }
    let at = "target/corrected";
    sh(".", &format!("{PROGRAM} diagnose --calibration {at}/calibration_d.csv --measured {at}/set_05.csv --out {at}"))?;
    let to = Path::new("firmware-example/corrected.fpm");
    fs::copy(dir.join("corrected.fpm"), root().join(to))?;
    println!("{}", to.display());
    Ok(())
}
