//! `pad`, `bed`, `retune` and `eval` on a pad: from runs to a file to a response, on every body.

use std::fs;

use crate::common::Folder;
use crate::models::{PAD, SHIPPED};

/// A folder with both shipped models and a path.
fn models(path: &str) -> Folder {
    let folder = Folder::with(&[("p.csv", path)]);
    folder.write("pad.fpm", PAD);
    folder.write("bed.fpm", SHIPPED);
    folder
}

const EVAL: &str = "eval --path p.csv --out r.csv --force --model";
const STROKE: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,1,0,0\n3,1,4,0\n";

#[test]
fn a_pad_answers_on_every_body_and_on_a_smaller_one_with_less() {
    let folder = models(STROKE);
    let normal = [
        "",
        "--body sphere --radius-mm 10000",
        "--body sphere --radius-mm 40",
        "--body cylinder --radius-mm 10 --axis-deg 90",
        "--body sphere --radius-mm 10",
    ]
    .map(|body| {
        folder.done(&format!("{EVAL} pad.fpm {body}"));
        assert!(folder.last("r.csv", "friction_x_n") > 0.0 && folder.last("r.csv", "band_normal_n") > 0.0);
        folder.last("r.csv", "normal_force_n")
    });
    assert!((normal[1] / normal[0] - 1.0).abs() < 5e-3, "a huge sphere is a plane: {normal:?}");
    assert!(normal.windows(2).skip(1).all(|pair| pair[1] < 0.95 * pair[0]), "{normal:?}");
}

/// A driven force is met; one beyond friction is flagged.
#[test]
fn forces_drive_depth_and_slides() {
    let head = "t_s,normal_force_n,friction_x_n,friction_y_n\n0,0,0,0\n1,0.5,0,0\n";
    let folder = models(&format!("{head}2,0.5,0.2,-0.1\n3,0.8,0.2,0.1\n"));
    folder.done(&format!("{EVAL} pad.fpm"));
    for (name, wanted) in [("normal_force_n", 0.8), ("friction_x_n", 0.2), ("friction_y_n", 0.1)] {
        let found = folder.last("r.csv", name);
        assert!((found - wanted).abs() < 1e-3, "{name}: {found}");
    }
    folder.write("p.csv", format!("{head}2,0.5,5,0\n"));
    let (_, stderr) = folder.done(&format!("{EVAL} pad.fpm"));
    assert!(stderr.contains("load_not_reached"), "{stderr}");
}

/// Forces of a retuned file, by the scaling of a finger that is similar: N ~ stiffness size² at a depth that grows with the size.
#[test]
fn another_finger_is_a_change_of_units() {
    let folder = models("");
    let (size, stiffness) = (1.25, 2.0);
    for model in ["pad.fpm", "bed.fpm"] {
        let retune = format!("finger retune --model {model} --size 1.25 --stiffness 2 --lambda 0.8 --out other.fpm");
        folder.done(&retune);
        assert_eq!(folder.run(&retune).0, Some(2), "a model is not replaced without a request");
        let stroke = |model: &str, size: f64| {
            let rows = format!("0,0,0,0\n1,{size},0,0\n3,{size},{},0\n", 4.0 * size);
            folder.write("p.csv", "t_s,depth_mm,slide_x_mm,slide_y_mm\n".to_owned() + &rows);
            folder.done(&format!("{EVAL} {model}"));
            ["normal_force_n", "friction_x_n", "contact_area_mm2"].map(|name| folder.last("r.csv", name))
        };
        let (fitted, other) = (stroke(model, 1.0), stroke("other.fpm", size));
        let [normal, friction, area] = std::array::from_fn(|k| other[k] / fitted[k]);
        // Friction is a smaller share of the stiffness, so that the contact is sheared less.
        assert!((normal / (stiffness * size * size) - 1.0).abs() < 0.03, "{normal}");
        assert!((area / (size * size) - 1.0).abs() < 0.05, "{area}");
        // lambda stiffness^beta size², with a beta between 0.4 and 0.6.
        let beta = (friction / (0.8 * size * size)).ln() / stiffness.ln();
        assert!((0.4..0.6).contains(&beta), "{beta}");
        fs::remove_file(folder.path("other.fpm")).unwrap();
    }
}

/// A bed at a pitch of 40 degrees beside the pad that it is made from.
#[test]
#[ignore = "nightly"]
fn a_bed_in_another_pose_follows_its_pad() {
    let folder = models(
        "t_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg,pitch_deg\n0,0,0,0,0,40\n1,1.2,0,0,0,40\n\
         2,1.2,1,0.5,0,40\n3,0.8,-1,1,5,40\n4,1.5,-1,3,5,40\n",
    );
    folder.done("finger bed --pitch-deg 40 --restarts 0 --out turned.fpm");
    let found = ["turned.fpm", "pad.fpm"].map(|model| {
        folder.done(&format!("{EVAL} {model}"));
        ["normal_force_n", "friction_x_n", "friction_y_n"].map(|name| folder.last("r.csv", name))
    });
    let limit = found[1][1].hypot(found[1][2]);
    assert!((found[0][0] / found[1][0] - 1.0).abs() < 0.06, "{found:?}");
    assert!((1..3).all(|k| (found[0][k] - found[1][k]).abs() < 0.1 * limit), "{found:?}");
}

/// A small pad with a short fit, of tissue that relaxes. The program writes the file and prints its errors and branches; a hold relaxes
/// by less than the tissue.
#[test]
#[ignore = "nightly"]
fn a_pad_is_made_from_the_runs_that_ship() {
    let folder = Folder::new();
    let (text, said) = folder.done(
        "finger --design stored --only pad --patches 12 --fit-runs 4 --patience 1 --relaxation 2:0.1 --out made --accept",
    );
    assert!(text.contains("combined") && text.contains("within bands %"), "{text}");
    assert!(text.contains("the tissue with 2:0.1") && !said.contains("assumed"), "{text}{said}");
    assert!(folder.exists("made/pad.fpm") && !folder.exists("made/model.fpm"));
    folder.write("p.csv", "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n0.0001,1,0,0\n9,1,0,0\n");
    folder.done("eval --path p.csv --model made/pad.fpm --out r.csv");
    let normal = folder.column("r.csv", "normal_force_n");
    let fall = normal.iter().copied().fold(0.0, f64::max) / normal[normal.len() - 1];
    assert!((2.0..2.95).contains(&fall), "{fall}");
}
