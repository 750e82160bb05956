//! The program behind `cargo xtask experiments`: the page of one experiment, with its figure, and unknown names.

use std::process::Command;

fn run(folder: &std::path::Path, args: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_experiments")).arg("--out").arg(folder).args(args).output().unwrap()
}

#[test]
fn an_experiment_has_a_table_and_a_figure_of_each_finger() {
    let dir = tempfile::tempdir().unwrap();
    let output = run(dir.path(), &["--coarse", "indentation", "load"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(dir.path().join("experiments.md")).unwrap();
    for part in [
        "Mesh `coarse`",
        "Published: about 82 %",
        "| displacement at 1 N over that at 5.2 N, % (fitted) | 72 to 92 | **4",
    ] {
        assert!(page.contains(part), "no {part} in {page}");
    }
    // The order is that of the list, not that of the arguments.
    assert!(page.find("experiment_load_paper.svg") < page.find("experiment_indentation_paper.svg"));
    assert!(!page.contains("NaN") && !page.contains("inf"), "{page}");
    for figure in ["load_paper", "indentation_paper", "indentation_stiffening"] {
        let path = dir.path().join(format!("pictures/experiment_{figure}.svg"));
        assert!(std::fs::read(path).unwrap().starts_with(b"<svg xmlns="));
    }
}

#[test]
fn an_unknown_experiment_is_refused_with_those_there_are() {
    let dir = tempfile::tempdir().unwrap();
    let output = run(dir.path(), &["idnentation"]);
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && printed.contains("idnentation: no such experiment; there are stick, "),
        "{printed}"
    );
}
