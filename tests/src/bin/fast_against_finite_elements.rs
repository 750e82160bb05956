//! Writes the table of the reduced models against the finite elements, the tables of its page, and the page's picture.
//!
//! `cargo xtask regenerate reference`

use std::path::Path;

use fingerpad_report::traces_svg;
use fingerpad_tests::fast_against_finite_elements::{
    Failure, Models, PAGE, TABLE, charts, chosen_runs, from_csv, to_csv, with_tables,
};

const PICTURE: &str = "docs/pictures/fast-against-finite-elements.svg";

fn main() -> Result<(), Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let write = |file: &str, bytes: &[u8]| -> Result<(), Failure> {
        std::fs::write(root.join(file), bytes).map_err(|e| format!("{file}: {e}"))?;
        println!("{file}: {} bytes", bytes.len());
        Ok(())
    };
    let models = Models::read(&root)?;
    let runs = chosen_runs(&root.join("data/runs"))?;
    let entries: Vec<_> = runs.iter().map(|run| models.entry(run.clone())).collect();
    let csv = to_csv(&entries);
    write(TABLE, csv.as_bytes())?;
    // From the numbers of the table, so that a reader of the table finds those of the page.
    let entries = from_csv(&csv, runs)?;
    let page = std::fs::read_to_string(root.join(PAGE)).map_err(|e| format!("{PAGE}: {e}"))?;
    write(PAGE, with_tables(&page, &entries)?.as_bytes())?;
    write(PICTURE, traces_svg(&charts(&entries)).as_bytes())
}
