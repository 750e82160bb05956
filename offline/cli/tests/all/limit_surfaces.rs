//! `export --format limit-surface` of beds and pads: tables and meshes.

use crate::common::Folder;
use crate::models::{PAD, SHIPPED};

/// A folder with the shipped models.
fn models() -> Folder {
    let folder = Folder::new();
    folder.write("bed.fpm", SHIPPED);
    folder.write("pad.fpm", PAD);
    folder
}

/// Rows of a table: the direction; friction along x and y, moment and normal force.
fn rows(folder: &Folder, options: &str) -> Vec<([f64; 3], [f64; 4])> {
    let (text, _) = folder.done(&format!("export --format limit-surface --out - {options}"));
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
    let folder = models();
    for model in ["bed.fpm", "pad.fpm"] {
        let coefficients = ["0.5", "1.5"].map(|depth| {
            let rows = rows(&folder, &format!("--model {model} --depth-mm {depth}"));
            assert_eq!(rows.len(), 642);
            for (direction, [x, y, moment, normal]) in &rows {
                assert!(x * direction[0] + y * direction[1] + moment / 3.0 * direction[2] > 0.0 && *normal > 0.0);
            }
            rows.iter().map(|(_, [x, y, _, normal])| x.hypot(*y) / normal).fold(0.0, f64::max)
        });
        assert!([1.0, coefficients[1], coefficients[0], 3.0].is_sorted_by(|a, b| a < b), "{coefficients:?}");
    }
}

/// A pose changes the pad's surface; the mesh has the table's points.
#[test]
fn a_mesh_holds_the_points_of_the_table() {
    let folder = models();
    let pose = "--pitch-deg 50 --roll-deg -15";
    let turned = rows(&folder, pose);
    assert_ne!(turned, rows(&folder, "--model pad.fpm"));
    let (mesh, _) = folder.done(&format!("export --format limit-surface-obj {pose} --out -"));
    let numbers = |line: &str| -> Vec<f64> { line.split(' ').map(|number| number.parse().unwrap()).collect() };
    let points: Vec<_> = mesh.lines().filter_map(|line| line.strip_prefix("v ")).map(numbers).collect();
    assert_eq!(points.len(), turned.len());
    for (point, (_, [x, y, moment, _])) in points.iter().zip(&turned) {
        for (found, wanted) in point.iter().zip([x, y, &(moment / 3.0)]) {
            assert!((found - wanted).abs() < 2e-6, "{point:?}");
        }
    }
    assert_eq!(mesh.lines().filter(|line| line.starts_with("f ")).count(), 1280);
}
