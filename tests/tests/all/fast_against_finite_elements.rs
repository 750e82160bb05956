//! The published table of the reduced models against the finite elements: its motions through the shipped models again.

use std::path::{Path, PathBuf};

use fingerpad_tests::fast_against_finite_elements::{
    Entry, MODELS, Models, PAGE, TABLE, chosen_runs, elements, from_csv, with_tables,
};
use fingerpad_tests::verify;

/// What makes the table, the page and the picture again.
const MEND: &str = "a model has changed; run `cargo xtask reference`";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn table() -> Vec<Entry> {
    from_csv(&std::fs::read_to_string(root().join(TABLE)).unwrap()).unwrap()
}

#[test]
fn the_models_give_the_forces_of_the_table_along_its_motions() {
    let models = Models::read(&root()).unwrap();
    let mut rows = [0; MODELS.len()];
    for stated in table() {
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
fn the_table_holds_the_chosen_runs_of_the_finite_elements() {
    let (table, stored) = (table(), chosen_runs(&root().join("data/runs")).unwrap());
    let names = |runs: &mut dyn Iterator<Item = &fingerpad_reduce::Run>| -> Vec<String> {
        runs.map(|run| format!("{} {:?} {:?}", run.name, run.kind, run.body)).collect()
    };
    assert_eq!(names(&mut table.iter().map(|entry| &entry.run)), names(&mut stored.iter()));
    let mut apart: f64 = 0.0;
    for (entry, run) in table.iter().zip(&stored) {
        assert_eq!(entry.run.samples.len(), run.samples.len(), "{}", run.name);
        for (a, b) in entry.run.samples.iter().zip(&run.samples) {
            assert_eq!((a.t_s, a.depth_mm, a.slide_mm), (b.t_s, b.depth_mm, b.slide_mm), "{}", run.name);
            let (a, b) = (elements(a), elements(b));
            apart = (0..4).map(|k| (a[k] - b[k]).abs()).fold(apart, f64::max);
        }
    }
    verify("fast against finite elements", "rounding of the forces", apart, 6e-6);
}

#[test]
fn the_page_shows_the_numbers_of_the_table() {
    let page = std::fs::read_to_string(root().join(PAGE)).unwrap();
    let with = with_tables(&page, &table()).unwrap();
    let differs = page.lines().zip(with.lines()).find(|(a, b)| a != b);
    assert!(page == with, "{PAGE}: {differs:?}: {MEND}");
}
