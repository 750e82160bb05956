//! `pad` and `eval` on a pad: from runs to a file to a response, on every body; invalid inputs are refused.

use std::path::Path;
use std::process::{Command, Output};

const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/models/fingertip-pad.fpm");
const BED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/models/fingertip.fpm");

fn fingerpad(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fingerpad")).current_dir(folder).args(words).output().unwrap()
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The last value of a column.
fn last(folder: &Path, name: &str) -> f64 {
    let text = std::fs::read_to_string(folder.join("out.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let at = header.iter().position(|h| *h == name).unwrap();
    text.lines().last().unwrap().split(',').nth(at).unwrap().parse().unwrap()
}

fn eval(folder: &Path, path: &str, more: &[&str]) -> Output {
    std::fs::write(folder.join("path.csv"), path).unwrap();
    let words = ["eval", "--model", SHIPPED, "--path", "path.csv", "--out", "out.csv", "--force"];
    fingerpad(folder, &[&words[..], more].concat())
}

const STROKE: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,1,0,0\n3,1,4,0\n";

#[test]
fn a_pad_answers_on_every_body_and_on_a_smaller_one_with_less() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let mut normal = Vec::new();
    for body in [
        &[][..],
        &["--body", "sphere", "--radius-mm", "10000"],
        &["--body", "sphere", "--radius-mm", "40"],
        &["--body", "cylinder", "--radius-mm", "10", "--axis-deg", "90"],
        &["--body", "sphere", "--radius-mm", "10"],
    ] {
        let output = eval(folder, STROKE, body);
        assert!(output.status.success(), "{body:?}: {}", printed(&output));
        normal.push(last(folder, "normal_force_n"));
        assert!(last(folder, "friction_x_n") > 0.0);
        assert!(last(folder, "band_normal_n") > 0.0);
    }
    assert!((normal[1] / normal[0] - 1.0).abs() < 5e-3, "a huge sphere is a plane: {normal:?}");
    assert!(normal.windows(2).skip(1).all(|pair| pair[1] < 0.95 * pair[0]), "{normal:?}");
}

/// A driven force is met, and the same motion by displacement gives it back.
#[test]
fn forces_drive_depth_and_slides() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let path = "t_s,normal_force_n,friction_x_n,friction_y_n\n0,0,0,0\n1,0.5,0,0\n2,0.5,0.2,-0.1\n3,0.8,0.2,0.1\n";
    let output = eval(folder, path, &[]);
    assert!(output.status.success(), "{}", printed(&output));
    for (name, wanted) in [("normal_force_n", 0.8), ("friction_x_n", 0.2), ("friction_y_n", 0.1)] {
        assert!((last(folder, name) - wanted).abs() < 1e-3, "{name}: {}", last(folder, name));
    }
    let output = eval(folder, "t_s,normal_force_n,friction_x_n,friction_y_n\n0,0,0,0\n1,0.5,0,0\n2,0.5,5,0\n", &[]);
    assert!(output.status.success() && printed(&output).contains("load_not_reached"), "{}", printed(&output));
}

#[test]
fn what_a_pad_cannot_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let refused = |output: &Output, what: &str| {
        assert_eq!(output.status.code(), Some(2), "{}", printed(output));
        assert!(printed(output).contains(what), "{what}: {}", printed(output));
    };
    refused(&eval(folder, STROKE, &["--temperature-c", "30"]), "is a pad, which has no effects");
    refused(&eval(folder, STROKE, &["--body", "groove", "--radius-mm", "3"]), "a pad takes a plane");
    refused(
        &fingerpad(
            folder,
            &["eval", "--model", BED, "--path", "path.csv", "--body", "sphere", "--radius-mm", "9", "--out", "b.csv"],
        ),
        "a bed of springs supports the plane only",
    );
    refused(
        &fingerpad(folder, &["export", "--model", SHIPPED, "--format", "json", "--out", "m.json"]),
        "a pad; this command takes the bed",
    );
    // The message says that the file is damaged.
    let mut bytes = std::fs::read(SHIPPED).unwrap();
    bytes[4000] ^= 1;
    std::fs::write(folder.join("bad.fpm"), bytes).unwrap();
    refused(
        &fingerpad(folder, &["eval", "--model", "bad.fpm", "--path", "path.csv", "--out", "b.csv"]),
        "checksum wrong",
    );
    // Runs of another finger.
    refused(&fingerpad(folder, &["pad", "--shape", "b", "--out", "pad.fpm"]), "of other settings");
    refused(&fingerpad(folder, &["pad", "--patches", "3", "--out", "pad.fpm"]), "from 6 to 62");
}

/// Forces of a retuned file, by the scaling of a finger that is similar: N ~ stiffness size² at a depth that grows with the size.
#[test]
fn another_finger_is_a_change_of_units() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let (size, stiffness) = (1.25, 2.0);
    let words = ["--size", "1.25", "--stiffness", "2", "--lambda", "0.8", "--out"];
    for model in [SHIPPED, BED] {
        let retune = [&["retune", "--model", model], &words[..], &["other.fpm"]].concat();
        let output = fingerpad(folder, &retune);
        assert!(output.status.success(), "{}", printed(&output));
        assert_eq!(fingerpad(folder, &retune).status.code(), Some(2), "a model is not replaced without a request");
        let stroke = |model: &str, size: f64| -> [f64; 3] {
            let path =
                format!("t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,{size},0,0\n3,{size},{},0\n", 4.0 * size);
            std::fs::write(folder.join("path.csv"), path).unwrap();
            let output =
                fingerpad(folder, &["eval", "--model", model, "--path", "path.csv", "--out", "out.csv", "--force"]);
            assert!(output.status.success(), "{}", printed(&output));
            ["normal_force_n", "friction_x_n", "contact_area_mm2"].map(|name| last(folder, name))
        };
        let (fitted, other) = (stroke(model, 1.0), stroke("other.fpm", size));
        let [normal, friction, area] = std::array::from_fn(|k| other[k] / fitted[k]);
        // Friction is a smaller share of the stiffness, so that the contact is sheared less.
        assert!((normal / (stiffness * size * size) - 1.0).abs() < 0.03, "{normal}");
        assert!((area / (size * size) - 1.0).abs() < 0.05, "{area}");
        // lambda stiffness^beta size², with a beta between 0.4 and 0.6.
        let beta = (friction / (0.8 * size * size)).ln() / stiffness.ln();
        assert!((0.4..0.6).contains(&beta), "{beta}");
        std::fs::remove_file(folder.join("other.fpm")).unwrap();
    }
    for (words, message) in [
        (&["retune", "--size", "3", "--out", "o.fpm"][..], "must be a number from 0.5 to 2"),
        (&["retune", "--stiffness", "0.5", "--out", "o.fpm"], "could create energy"),
        (&["bed", "--pitch-deg", "80", "--out", "o.fpm"], "pitch of 80°: the pad's range is 10° to 70°"),
        (&["bed", "--pad", BED, "--out", "o.fpm"], "this command takes a pad"),
    ] {
        let output = fingerpad(folder, words);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", printed(&output));
        assert!(printed(&output).contains(message), "{words:?}: {}", printed(&output));
    }
}

/// A bed at a pitch of 40 degrees beside the pad that it is made from.
#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn a_bed_in_another_pose_follows_its_pad() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let output = fingerpad(folder, &["bed", "--pitch-deg", "40", "--restarts", "0", "--out", "bed.fpm"]);
    assert!(output.status.success(), "{}", printed(&output));
    let path = "t_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg,pitch_deg\n0,0,0,0,0,40\n1,1.2,0,0,0,40\n\
                2,1.2,1,0.5,0,40\n3,0.8,-1,1,5,40\n4,1.5,-1,3,5,40\n";
    std::fs::write(folder.join("path.csv"), path).unwrap();
    let mut found = Vec::new();
    for model in ["bed.fpm", SHIPPED] {
        let output =
            fingerpad(folder, &["eval", "--model", model, "--path", "path.csv", "--out", "out.csv", "--force"]);
        assert!(output.status.success(), "{}", printed(&output));
        found.push(["normal_force_n", "friction_x_n", "friction_y_n"].map(|name| last(folder, name)));
    }
    let limit = found[1][1].hypot(found[1][2]);
    assert!((found[0][0] / found[1][0] - 1.0).abs() < 0.06, "{found:?}");
    assert!((1..3).all(|k| (found[0][k] - found[1][k]).abs() < 0.1 * limit), "{found:?}");
}

/// A small pad with a short fit. The program writes the file, prints its errors and refuses to replace it.
#[test]
fn a_pad_is_made_from_the_runs_that_ship() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let output =
        fingerpad(folder, &["pad", "--patches", "12", "--fit-runs", "4", "--patience", "1", "--out", "pad.fpm"]);
    assert!(output.status.success(), "{}", printed(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("combined") && text.contains("within bands %"), "{text}");
    let output = fingerpad(folder, &["pad", "--out", "pad.fpm"]);
    assert_eq!(output.status.code(), Some(2), "a model is not replaced without a request: {}", printed(&output));
}
