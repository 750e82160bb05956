//! `simulate --body`: the body of the flags is the body of the run, and invalid bodies are refused.

use std::process::{Command, Output};

fn simulate(folder: &std::path::Path, body: &[&str]) -> Output {
    std::fs::write(folder.join("path.csv"), "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,0.8,0,0\n").unwrap();
    let fixed = ["simulate", "--path", "path.csv", "--mesh-preset", "coarse", "--out", "out.csv", "--force"];
    Command::new(env!("CARGO_BIN_EXE_fingerpad")).current_dir(folder).args(fixed).args(body).output().unwrap()
}

/// Normal force and area at the end.
fn end(folder: &std::path::Path, body: &[&str]) -> [f64; 2] {
    let output = simulate(folder, body);
    assert!(output.status.success(), "{body:?}: {}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(folder.join("out.csv")).unwrap();
    let last: Vec<&str> = text.lines().last().unwrap().split(',').collect();
    [last[4], last[7]].map(|cell| cell.parse().unwrap())
}

#[test]
fn rounder_bodies_press_less_and_a_hollow_more() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let plane = end(folder, &[]);
    let sphere = end(folder, &["--body", "sphere", "--radius-mm", "10"]);
    let cylinder = end(folder, &["--body", "cylinder", "--radius-mm", "10", "--axis-deg", "90"]);
    let bowl = end(folder, &["--body", "sphere", "--radius-mm", "-80"]);
    for k in 0..2 {
        assert!(
            sphere[k] < cylinder[k] && cylinder[k] < plane[k] && plane[k] < bowl[k],
            "{sphere:?} {cylinder:?} {plane:?} {bowl:?}"
        );
    }
    // A flat field of heights is the plane; the section of a configuration is the flag.
    let flat: String = (0..25).map(|k| format!("{},{},0\n", 10 * (k % 5) - 20, 10 * (k / 5) - 20)).collect();
    std::fs::write(folder.join("flat.csv"), "x_mm,y_mm,height_mm\n".to_owned() + &flat).unwrap();
    let heights = end(folder, &["--body", "flat.csv"]);
    assert!((heights[0] / plane[0] - 1.0).abs() < 1e-4 && (heights[1] / plane[1] - 1.0).abs() < 1e-4, "{heights:?}");
    std::fs::write(folder.join("c.toml"), "[rigid_body]\nkind = \"sphere\"\nradius_mm = 10.0\n").unwrap();
    assert_eq!(end(folder, &["--config", "c.toml"]), sphere);
}

#[test]
fn bodies_that_cannot_be_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    for (body, named) in [
        (&["--body", "shpere"][..], "--body shpere"),
        (&["--body", "sphere"][..], "radius_mm is missing"),
        (&["--body", "edge", "--radius-mm", "-1"][..], "radius_mm = -1"),
        (&["--radius-mm", "5"][..], "radius_mm = 5"),
        (&["--body", "sphere", "--radius-mm", "-5"][..], "the rigid body would reach"),
    ] {
        let output = simulate(dir.path(), body);
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{body:?}: {printed}");
        assert!(printed.contains(named), "{body:?}: {printed}");
    }
    let fine = simulate(dir.path(), &["--body", "edge", "--radius-mm", "0.5"]);
    assert!(String::from_utf8_lossy(&fine.stderr).contains("warning: the radius of the body"));
    std::fs::write(dir.path().join("c.toml"), "[rigid_body]\nkind = \"sphere\"\nradius_mm = 10.0\n").unwrap();
    let build = Command::new(env!("CARGO_BIN_EXE_fingerpad"))
        .current_dir(dir.path())
        .args(["build", "--config", "c.toml", "--mesh-preset", "coarse", "--out", "b"])
        .output()
        .unwrap();
    assert_eq!(build.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&build.stderr).contains("supports the plane only"));
}
