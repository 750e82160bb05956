//! Writes the tables and the picture of the page on surfaces of unknown friction.
//!
//! `cargo xtask regenerate reference`

use std::path::Path;

use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad_report::traces_svg;
use fingerpad_tests::fast_against_finite_elements::put_tables;
use fingerpad_tests::margin::{Failure, PAGE, chart, tables};

const PICTURE: &str = "docs/pictures/margin.svg";
/// Experiments of a line.
const NUMBER: usize = 200;

fn main() -> Result<(), Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let file = ModelFile::new(&std::fs::read(root.join("data/models/fingertip.fpm"))?)?;
    let model = file.file().model;
    let pad = PadModelFile::new(&std::fs::read(root.join("data/models/fingertip-pad.fpm"))?)?;
    let tables = tables(&model, &pad.file().pad, &root, NUMBER)?;
    for (name, table) in &tables {
        println!("{name}\n{table}");
    }
    let page = std::fs::read_to_string(root.join(PAGE))?;
    std::fs::write(root.join(PAGE), put_tables(&page, PAGE, tables)?)?;
    std::fs::write(root.join(PICTURE), traces_svg(&[chart(&model, &root)?]))?;
    Ok(())
}
