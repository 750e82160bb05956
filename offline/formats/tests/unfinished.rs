//! A process that ends in the middle of a write leaves no file. Alone in its file: it discards the writes of the whole
//! process.

use std::fs;
use std::path::Path;

use fingerpad_formats::{atomic_write, discard_unfinished};

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn an_unfinished_file_is_discarded() {
    let dir = tempfile::tempdir().unwrap();
    let (path, mut seen) = (dir.path().join("a.csv"), Vec::new());
    let error = atomic_write(&path, |_| {
        seen = names(dir.path());
        discard_unfinished();
        assert_eq!(names(dir.path()), [""; 0]);
        Ok(())
    });
    assert!(seen.len() == 1 && seen[0].starts_with(".partial-"), "{seen:?}");
    assert!(error.is_err() && !path.exists());
}
