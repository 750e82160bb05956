//! `export --format limit-surface` of beds and pads: tables and meshes, and refusals with value and range.

use std::path::Path;
use std::process::{Command, Output};

const PAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/models/fingertip-pad.fpm");
const BED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/models/fingertip.fpm");

fn export(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fingerpad")).current_dir(folder).arg("export").args(words).output().unwrap()
}

/// Friction along x and y, moment and normal force of each row, and its direction.
fn rows(output: &Output) -> Vec<([f64; 3], [f64; 4])> {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let mut lines = text.lines();
    let columns = "direction_x,direction_y,direction_spin,friction_x_n,friction_y_n,spin_moment_n_mm,normal_force_n";
    assert_eq!(lines.next(), Some(columns));
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        (std::array::from_fn(|k| numbers[k]), std::array::from_fn(|k| numbers[k + 3]))
    };
    lines.map(row).collect()
}

/// Every load opposes the finger's slip, and friction over normal force falls with depth, as the law has it.
#[test]
fn tables_of_both_kinds_of_model() {
    let dir = tempfile::tempdir().unwrap();
    for model in [BED, PAD] {
        let mut coefficients = Vec::new();
        for depth in ["0.5", "1.5"] {
            let words = ["--model", model, "--format", "limit-surface", "--depth-mm", depth, "--out", "-"];
            let rows = rows(&export(dir.path(), &words));
            assert_eq!(rows.len(), 642);
            for (direction, [x, y, moment, normal]) in &rows {
                assert!(x * direction[0] + y * direction[1] + moment / 3.0 * direction[2] > 0.0 && *normal > 0.0);
            }
            let largest = rows.iter().map(|(_, [x, y, _, normal])| x.hypot(*y) / normal).fold(0.0, f64::max);
            coefficients.push(largest);
        }
        assert!(
            1.0 < coefficients[1] && coefficients[1] < coefficients[0] && coefficients[0] < 3.0,
            "{coefficients:?}"
        );
    }
}

/// A pose changes the pad's surface; the mesh has the table's points.
#[test]
fn a_mesh_holds_the_points_of_the_table() {
    let dir = tempfile::tempdir().unwrap();
    let pose = ["--pitch-deg", "50", "--roll-deg", "-15", "--out", "-"];
    let turned = rows(&export(dir.path(), &[&["--format", "limit-surface"], &pose[..]].concat()));
    let neutral = rows(&export(dir.path(), &["--model", PAD, "--format", "limit-surface", "--out", "-"]));
    assert_ne!(turned, neutral);
    let mesh = export(dir.path(), &[&["--format", "limit-surface-obj"], &pose[..]].concat());
    let mesh = String::from_utf8(mesh.stdout).unwrap();
    let points: Vec<Vec<f64>> = mesh
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect())
        .collect();
    assert_eq!(points.len(), turned.len());
    for (point, (_, [x, y, moment, _])) in points.iter().zip(&turned) {
        for (found, wanted) in point.iter().zip([x, y, &(moment / 3.0)]) {
            assert!((found - wanted).abs() < 2e-6, "{point:?}");
        }
    }
    assert_eq!(mesh.lines().filter(|line| line.starts_with("f ")).count(), 1280);
}

#[test]
fn refusals_name_flag_value_and_range() {
    let dir = tempfile::tempdir().unwrap();
    for (words, says) in [
        (&["--format", "limit-surface", "--depth-mm", "0"][..], "depth in mm 0: the allowed range is 0.1 to "),
        (&["--format", "limit-surface", "--depth-mm", "-1"], "depth in mm -1: the allowed range is 0.1 to "),
        (&["--format", "limit-surface", "--depth-mm", "NaN"], "depth in mm NaN: the allowed range is 0.1 to "),
        (&["--format", "limit-surface", "--pitch-deg", "80"], "pitch in degrees 80: the allowed range is 10 to 70"),
        (&["--format", "limit-surface", "--roll-deg", "31"], "roll in degrees 31: the allowed range is -30 to 30"),
        (
            &["--model", BED, "--format", "limit-surface", "--pitch-deg", "40"],
            "--pitch-deg 40: fingertip.fpm is a bed of springs",
        ),
        (&["--format", "json", "--depth-mm", "1"], "--depth-mm 1: only --format limit-surface"),
    ] {
        let output = export(dir.path(), &[words, &["--out", "limit.csv"]].concat());
        let printed = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {printed}");
        assert!(printed.contains(says), "{words:?}: {printed}");
        assert!(!dir.path().join("limit.csv").exists());
    }
}
