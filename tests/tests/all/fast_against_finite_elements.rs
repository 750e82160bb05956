//! The published table of the reduced models against the finite elements: its runs through the shipped models again, and its page.

use std::path::{Path, PathBuf};

use fingerpad_tests::fast_against_finite_elements::{
    COLUMNS_OF_RUN, MODELS, Models, PAGE, TABLE, chosen_runs, from_csv, to_csv, with_tables,
};

/// What makes the table, the page and the picture again.
const MEND: &str = "a model has changed; run `cargo xtask regenerate reference`";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn the_models_give_the_forces_of_the_table_along_the_chosen_runs() {
    let models = Models::read(&root()).unwrap();
    let runs = chosen_runs(&root().join("data/runs")).unwrap();
    let text = std::fs::read_to_string(root().join(TABLE)).unwrap();
    let table = from_csv(&text, runs).unwrap();
    let of_run = |line: &str| line.split(',').take(COLUMNS_OF_RUN).collect::<Vec<_>>().join(",");
    for (made, stored) in to_csv(&table).lines().zip(text.lines()) {
        assert_eq!(of_run(made), of_run(stored), "{MEND}");
    }
    let mut rows = [0; MODELS.len()];
    for stated in table {
        let found = models.entry(stated.run.clone());
        for (k, (model, _)) in MODELS.iter().enumerate() {
            let name = format!("{} by {model}", stated.run.name);
            assert_eq!(found.forces[k].is_some(), stated.forces[k].is_some(), "{name}: {MEND}");
            let (Some(found), Some(stated)) = (&found.forces[k], &stated.forces[k]) else { continue };
            assert_eq!(found.len(), stated.len(), "{name}: {MEND}");
            rows[k] += found.len();
            for (row, (f, s)) in found.iter().zip(stated).enumerate() {
                let apart = (0..4).map(|i| (f[i] - s[i]).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-4, "{name}, row {row}: {f:?}, the table has {s:?}: {MEND}");
            }
        }
    }
    println!("rows of each model: {rows:?}");
    assert!(rows[0] > 500 && rows.iter().all(|n| *n >= rows[0]), "{rows:?}");
}

#[test]
fn the_page_shows_the_numbers_of_the_table() {
    let runs = chosen_runs(&root().join("data/runs")).unwrap();
    let table = from_csv(&std::fs::read_to_string(root().join(TABLE)).unwrap(), runs).unwrap();
    let page = std::fs::read_to_string(root().join(PAGE)).unwrap();
    let with = with_tables(&page, &table).unwrap();
    let differs = page.lines().zip(with.lines()).find(|(a, b)| a != b);
    assert!(page == with, "{PAGE}: {differs:?}: {MEND}");
}
