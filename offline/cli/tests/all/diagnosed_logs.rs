//! `fingerpad diagnose` on logs as laboratories and robots have them: forces in the frame of a sensor, runs that are appended.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{refused, run, write};

const CALIBRATION: &str = include_str!("../../data/examples/calibration.csv");
const MEASURED: &str = include_str!("../../data/examples/measured.csv");
const HOLDOUT: &str = include_str!("../../data/examples/holdout.csv");
const FORCES: [&str; 3] = ["friction_x_n", "friction_y_n", "normal_force_n"];
const IN_FILE: [&str; 3] = ["Fx", "Fy", "Fz"];
/// Columns of the readings of a sensor in its own frame.
const MAP: [&str; 2] = ["--map", "x=Fx,y=Fy,normal=Fz"];

/// Without the groups that are left out, which take most of the time.
fn diagnose(more: &[&str], folder: &Path, out: &str) -> (String, Value) {
    let files = ["diagnose", "--calibration", "c.csv", "--measured", "m.csv"];
    let arguments = [&files[..], more, &["--stability-groups", "0", "--out", out]].concat();
    let (code, stdout, stderr) = run(&arguments, folder);
    assert_eq!(code, Some(0), "{arguments:?}: {stdout}{stderr}");
    let mut report: Value = serde_json::from_slice(&fs::read(folder.join(out).join("report.json")).unwrap()).unwrap();
    report.as_object_mut().unwrap().remove("elapsed_s");
    (stdout, report)
}

/// The matrix Rz(yaw) Ry(pitch) Rx(roll), written down element by element.
fn matrix([roll_deg, pitch_deg, yaw_deg]: [f64; 3]) -> [[f64; 3]; 3] {
    let [(sr, cr), (sp, cp), (sy, cy)] = [roll_deg, pitch_deg, yaw_deg].map(|a| a.to_radians().sin_cos());
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

/// The runs as a sensor of this orientation logs them.
fn in_sensor_frame(text: &str, turned: [[f64; 3]; 3]) -> String {
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let places = FORCES.map(|name| head.iter().position(|h| *h == name).unwrap());
    let mut names: Vec<&str> = head.clone();
    (0..3).for_each(|k| names[places[k]] = IN_FILE[k]);
    let mut out = names.join(",") + "\n";
    for line in text.lines().skip(1) {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let force_n = places.map(|place| cells[place].parse::<f64>().unwrap());
        // The transpose leads from the contact frame to that of the sensor.
        let logged = [0, 1, 2].map(|k| (0..3).map(|i| turned[i][k] * force_n[i]).sum::<f64>());
        (0..3).for_each(|k| cells[places[k]] = logged[k].to_string());
        out += &(cells.join(",") + "\n");
    }
    out
}

fn number(report: &Value, pointer: &str) -> f64 {
    report.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} in {report}"))
}

#[test]
fn forces_in_the_frame_of_a_sensor_give_the_diagnosis_of_those_in_the_contact_frame() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.csv", CALIBRATION);
    write(at, "m.csv", MEASURED);
    let (_, plain) = diagnose(&[], at, "plain");
    assert_eq!(plain["verdict"], "named");
    let angles = [172.0, -14.0, 35.0];
    let turned = matrix(angles);
    write(at, "c.csv", &in_sensor_frame(CALIBRATION, turned));
    write(at, "m.csv", &in_sensor_frame(MEASURED, turned));
    // Without the rotation the normal force points the wrong way.
    let files = ["diagnose", "--calibration", "c.csv", "--measured", "m.csv"];
    refused(
        &[&files[..], &MAP, &["--out", "wrong"]].concat(),
        at,
        &["c.csv", "column normal_force_n", "--sensor-rpy-deg"],
    );
    let nine = turned.iter().flatten().map(|v| format!("{v:.9}")).collect::<Vec<_>>().join(",");
    for (flag, value) in [("--sensor-rpy-deg", "172,-14,35"), ("--sensor-matrix", &nine)] {
        let (_, report) = diagnose(&[&MAP[..], &[flag, value]].concat(), at, "turned");
        assert_eq!(report["verdict"], plain["verdict"]);
        assert_eq!(report["effects"][0]["law"], plain["effects"][0]["law"]);
        // Readings in the frame of the sensor are not multiples of 0.0001 N any more, which the estimate of the noise sees: a part of
        // the interval. A wrong angle is far beyond it.
        let ends = ["/effects/0/parameters/0/ci95/0", "/effects/0/parameters/0/ci95/1"];
        let [low, high] = ends.map(|pointer| number(&plain, pointer));
        let [found, wanted] = [&report, &plain].map(|report| number(report, "/effects/0/parameters/0/value"));
        assert!((found - wanted).abs() < 0.15 * (high - low), "{flag}: {found} {wanted}, {low} to {high}");
        for (pointer, share) in [("/effects/0/gain_2ll", 0.03), ("/disagreement/ratio/1", 0.01)] {
            let [found, wanted] = [&report, &plain].map(|report| number(report, pointer));
            assert!((found / wanted - 1.0).abs() < share, "{flag}: {pointer} {found} {wanted}");
        }
        let notes = report["input"][1]["notes"].to_string();
        assert!(notes.contains(&format!("turned from the sensor's frame by {flag} {value}")), "{notes}");
    }
}

#[test]
fn rotations_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.csv", CALIBRATION);
    write(at, "m.csv", MEASURED);
    let files = ["diagnose", "--calibration", "c.csv", "--measured", "m.csv", "--check"];
    for (more, words) in [
        (
            ["--sensor-matrix", "1,0,0,0,1,0,0,0,-1"],
            ["--sensor-matrix 1,0,0,0,1,0,0,0,-1", "left-handed (determinant -1"],
        ),
        (["--sensor-matrix", "1,0,0.2,0,1,0,0,0,1"], ["not orthogonal", "rows 1 and 1 have the product 1.04"]),
        (["--sensor-matrix", "1,0,0"], ["--sensor-matrix 1,0,0: 3 numbers where 9", "rows of the matrix"]),
        (["--sensor-rpy-deg", "0,90"], ["--sensor-rpy-deg 0,90: 2 numbers where 3", "roll, pitch and yaw"]),
        (["--sensor-rpy-deg", "0,0,east"], ["`east`", "not a number"]),
    ] {
        refused(&[&files[..], &more].concat(), at, &words);
    }
    let both = ["--sensor-rpy-deg", "0,0,0", "--sensor-matrix", "1,0,0,0,1,0,0,0,1"];
    refused(&[&files[..], &both].concat(), at, &["cannot be used with"]);
}

#[test]
fn forces_alone_are_turned_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let trace = include_str!("../../data/human_texture_exploration/July3_2_force_data_1.csv");
    write(at, "t.csv", trace);
    let turned = matrix([90.0, 0.0, 20.0]);
    let head: Vec<&str> = trace.lines().next().unwrap().split(',').map(str::trim).collect();
    let place = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let [t, x, y, z] = ["Timestamp", "Fx", "Fy", "Fz"].map(place);
    let mut text = "t,A,B,C\n".to_owned();
    for line in trace.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let [x, y, z] = [x, y, z].map(|k| cells[k].parse::<f64>().unwrap());
        let force_n = [x, y, -z];
        let [a, b, c] = [0, 1, 2].map(|k| (0..3).map(|i| turned[i][k] * force_n[i]).sum::<f64>());
        text += &format!("{},{a},{b},{c}\n", cells[t]);
    }
    write(at, "turned.csv", &text);
    let of = |file: &str, more: &[&str]| {
        let arguments = [&["diagnose", "--force-only", "--measured", file][..], more, &["--out", "d"]].concat();
        let (code, stdout, stderr) = run(&arguments, at);
        assert_eq!(code, Some(0), "{stderr}");
        let report: Value = serde_json::from_slice(&fs::read(at.join("d/report.json")).unwrap()).unwrap();
        (report, stdout)
    };
    let (plain, _) = of("t.csv", &["--map", "normal=-Fz,x=Fx,y=Fy,t=Timestamp"]);
    let (report, stdout) = of("turned.csv", &["--map", "t=t,x=A,y=B,normal=C", "--sensor-rpy-deg", "90,0,20"]);
    assert_eq!(report["verdict"], plain["verdict"]);
    assert_eq!(plain["verdict"], "named");
    let sizes = |report: &Value| -> Vec<f64> {
        let parameters = report["effects"][0]["parameters"].as_array().unwrap();
        parameters.iter().map(|p| p["value"].as_f64().unwrap()).collect()
    };
    for (a, b) in sizes(&report).iter().zip(sizes(&plain)) {
        assert!((a - b).abs() < 2e-3, "{a} {b}");
    }
    assert!(stdout.contains("--sensor-rpy-deg 90,0,20"), "{stdout}");
}

/// The runs of a file from one on, or up to it, with its header.
fn part(text: &str, keep: impl Fn(usize) -> bool) -> String {
    let (head, rows) = text.split_once('\n').unwrap();
    let (mut run, mut number, mut out) = ("", 0, format!("{head}\n"));
    for row in rows.lines() {
        let name = row.split(',').next().unwrap();
        if name != run {
            (run, number) = (name, number + 1);
        }
        if keep(number - 1) {
            out += &format!("{row}\n");
        }
    }
    out
}

#[test]
fn appended_runs_give_the_diagnosis_of_one_file_with_all_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.csv", CALIBRATION);
    write(at, "h.csv", HOLDOUT);
    write(at, "m.csv", MEASURED);
    let (_, mut all) = diagnose(&["--holdout", "h.csv"], at, "all");
    write(at, "m.csv", &part(MEASURED, |run| run < 7));
    write(at, "n1.csv", &part(MEASURED, |run| (7..12).contains(&run)));
    write(at, "n2.csv", &part(MEASURED, |run| run >= 12));
    let (_, few) = diagnose(&["--holdout", "h.csv"], at, "grown");
    assert_ne!(few["effects"], all["effects"]);
    let (stdout, mut grown) = diagnose(&["--holdout", "h.csv", "--append", "n1.csv", "n2.csv"], at, "grown");
    assert!(stdout.contains("With 9 more measured runs: "), "{stdout}");
    assert!(stdout.contains(" became named (hydration bell)."), "{stdout}");
    let [of_all, of_grown] = [&mut all, &mut grown].map(|r| r.as_object_mut().unwrap().remove("input").unwrap());
    assert_eq!(all, grown);
    let roles: Vec<&str> = of_grown.as_array().unwrap().iter().map(|i| i["role"].as_str().unwrap()).collect();
    assert_eq!(roles, ["calibration", "measured", "appended", "appended", "holdout"]);
    let runs: u64 = of_grown.as_array().unwrap()[1..4].iter().map(|i| i["runs"].as_u64().unwrap()).sum();
    assert_eq!(Some(runs), of_all[1]["runs"].as_u64());

    // A clock that was started again.
    let restarted: Vec<String> = part(MEASURED, |run| run >= 12)
        .lines()
        .enumerate()
        .map(|(line, row)| {
            let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
            if line > 0 {
                cells[1] = format!("{:.4}", cells[1].parse::<f64>().unwrap() - 644.3814);
            }
            cells.join(",")
        })
        .collect();
    let start = part(MEASURED, |run| run == 12).lines().nth(1).unwrap().split(',').nth(1).unwrap().to_owned();
    write(at, "m.csv", &part(MEASURED, |run| run < 12));
    write(at, "r.csv", &(restarted.join("\n") + "\n"));
    let (_, shifted) =
        diagnose(&["--holdout", "h.csv", "--append", "r.csv", "--append-start-s", &start], at, "shifted");
    let [a, b] = [&shifted, &grown].map(|report| number(report, "/effects/0/parameters/0/value"));
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
}

#[test]
fn appended_files_that_do_not_belong_there_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.csv", CALIBRATION);
    write(at, "m.csv", &part(MEASURED, |run| run < 12));
    let next = part(MEASURED, |run| run >= 12);
    write(at, "n.csv", &next);
    write(at, "same.csv", &next.replace("measured12", "measured3"));
    write(at, "late.csv", &part(MEASURED, |run| run == 3).replace("measured3", "again"));
    write(at, "bare.csv", next.lines().next().unwrap());
    write(at, "calibration.csv", &part(CALIBRATION, |run| run < 3).replace("calibration", "more"));
    let files = ["diagnose", "--calibration", "c.csv", "--measured", "m.csv", "--out", "d", "--append"];
    for (more, words) in [
        (&["same.csv"][..], &["same.csv:2", "run_id", "measured3", "an earlier file"][..]),
        (&["late.csv"], &["late.csv", "t_s", "overlaps", "m.csv", "--append-start-s"]),
        (&["bare.csv"], &["bare.csv", "1"]),
        (&["none.csv"], &["none.csv"]),
        (&["calibration.csv", "--append-start-s", "2000"], &["are calibration runs too"]),
        (&["n.csv", "--append-start-s", "1,2"], &["--append-start-s: 2 times for 1 file"]),
        (&["n.csv", "--append-start-s", "nan"], &["--append-start-s NaN"]),
    ] {
        refused(&[&files[..], more].concat(), at, words);
    }
    let (code, ..) = run(&["diagnose", "--force-only", "--measured", "m.csv", "--append", "n.csv", "--out", "d"], at);
    assert_eq!(code, Some(2));
}
