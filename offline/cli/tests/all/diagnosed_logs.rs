//! `diagnose` on logs of laboratories and robots: forces in the frame of a sensor, runs that are appended.

use serde_json::Value;

use crate::common::{CALIBRATION, Folder, HOLDOUT, MEASURED};

const FORCES: [&str; 3] = ["friction_x_n", "friction_y_n", "normal_force_n"];
const IN_FILE: [&str; 3] = ["Fx", "Fy", "Fz"];
const FILES: &str = "diagnose --calibration c.csv --measured m.csv";
/// Columns of the readings of a sensor in its own frame.
const MAP: &str = "--map x=Fx,y=Fy,normal=Fz";

/// Without the groups that are left out, which take most of the time.
fn diagnose(folder: &Folder, options: &str, out: &str) -> (String, Value) {
    let (stdout, _) = folder.done(&format!("{FILES} {options} --stability-groups 0 --out {out}"));
    let mut report = folder.json(&format!("{out}/report.json"));
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
    let folder = Folder::with(&[("c.csv", CALIBRATION), ("m.csv", MEASURED)]);
    let (_, plain) = diagnose(&folder, "", "plain");
    assert_eq!(plain["verdict"], "named");
    let turned = matrix([172.0, -14.0, 35.0]);
    folder.write("c.csv", in_sensor_frame(CALIBRATION, turned));
    folder.write("m.csv", in_sensor_frame(MEASURED, turned));
    // Without the rotation the normal force points the wrong way.
    folder.refused(&format!("{FILES} {MAP} --out wrong"), &["c.csv", "column normal_force_n", "--sensor-rpy-deg"]);
    let nine = turned.iter().flatten().map(|v| format!("{v:.9}")).collect::<Vec<_>>().join(",");
    for flag in ["--sensor-rpy-deg 172,-14,35".to_owned(), format!("--sensor-matrix {nine}")] {
        let (_, report) = diagnose(&folder, &format!("{MAP} {flag}"), "turned");
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
        assert!(notes.contains(&format!("turned from the sensor's frame by {flag}")), "{notes}");
    }
}

#[test]
fn forces_alone_are_turned_too() {
    let trace = include_str!("../../data/human_texture_exploration/July3_2_force_data_1.csv");
    let folder = Folder::with(&[("t.csv", trace)]);
    let turned = matrix([90.0, 0.0, 20.0]);
    let column = |name: &str| trace.lines().next().unwrap().split(',').position(|h| h.trim() == name).unwrap();
    let places = ["Timestamp", "Fx", "Fy", "Fz"].map(column);
    let mut text = "t,A,B,C\n".to_owned();
    for line in trace.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let [t, x, y, z] = places.map(|k| cells[k]);
        let force_n = [x.parse::<f64>().unwrap(), y.parse().unwrap(), -z.parse::<f64>().unwrap()];
        let [a, b, c] = [0, 1, 2].map(|k| (0..3).map(|i| turned[i][k] * force_n[i]).sum::<f64>());
        text += &format!("{t},{a},{b},{c}\n");
    }
    folder.write("turned.csv", text);
    let of = |options: &str| {
        let (stdout, _) = folder.done(&format!("diagnose --force-only --out d {options}"));
        (folder.json("d/report.json"), stdout)
    };
    let (plain, _) = of("--measured t.csv --map normal=-Fz,x=Fx,y=Fy,t=Timestamp");
    let (report, stdout) = of("--measured turned.csv --map t=t,x=A,y=B,normal=C --sensor-rpy-deg 90,0,20");
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
    let folder = Folder::with(&[("c.csv", CALIBRATION), ("h.csv", HOLDOUT), ("m.csv", MEASURED)]);
    let (_, mut all) = diagnose(&folder, "--holdout h.csv", "all");
    folder.write("m.csv", part(MEASURED, |run| run < 7));
    folder.write("n1.csv", part(MEASURED, |run| (7..12).contains(&run)));
    folder.write("n2.csv", part(MEASURED, |run| run >= 12));
    let (_, few) = diagnose(&folder, "--holdout h.csv", "grown");
    assert_ne!(few["effects"], all["effects"]);
    let (stdout, mut grown) = diagnose(&folder, "--holdout h.csv --append n1.csv n2.csv", "grown");
    assert!(stdout.contains("With 9 more measured runs: "), "{stdout}");
    assert!(stdout.contains(" became named (hydration bell)."), "{stdout}");
    let [of_all, of_grown] = [&mut all, &mut grown].map(|r| r.as_object_mut().unwrap().remove("input").unwrap());
    assert_eq!(all, grown);
    let roles: Vec<&str> = of_grown.as_array().unwrap().iter().map(|i| i["role"].as_str().unwrap()).collect();
    assert_eq!(roles, ["calibration", "measured", "appended", "appended", "holdout"]);
    let runs: u64 = of_grown.as_array().unwrap()[1..4].iter().map(|i| i["runs"].as_u64().unwrap()).sum();
    assert_eq!(Some(runs), of_all[1]["runs"].as_u64());

    // A clock that was started again.
    let last = part(MEASURED, |run| run >= 12);
    let restarted = last.lines().enumerate().map(|(line, row)| {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        if line > 0 {
            cells[1] = format!("{:.4}", cells[1].parse::<f64>().unwrap() - 644.3814);
        }
        cells.join(",") + "\n"
    });
    folder.write("r.csv", restarted.collect::<String>());
    folder.write("m.csv", part(MEASURED, |run| run < 12));
    let start = last.lines().nth(1).unwrap().split(',').nth(1).unwrap();
    let options = format!("--holdout h.csv --append r.csv --append-start-s {start}");
    let (_, shifted) = diagnose(&folder, &options, "shifted");
    let [a, b] = [&shifted, &grown].map(|report| number(report, "/effects/0/parameters/0/value"));
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
}

#[test]
fn appended_files_that_do_not_belong_there_are_refused() {
    let next = part(MEASURED, |run| run >= 12);
    let folder = Folder::with(&[
        ("c.csv", CALIBRATION),
        ("m.csv", &part(MEASURED, |run| run < 12)),
        ("n.csv", &next),
        ("same.csv", &next.replace("measured12", "measured3")),
        ("late.csv", &part(MEASURED, |run| run == 3).replace("measured3", "again")),
        ("bare.csv", next.lines().next().unwrap()),
        ("calibration.csv", &part(CALIBRATION, |run| run < 3).replace("calibration", "more")),
    ]);
    for (more, words) in [
        ("same.csv", &["same.csv:2", "run_id", "measured3", "an earlier file"][..]),
        ("late.csv", &["late.csv", "t_s", "overlaps", "m.csv", "--append-start-s"]),
        ("bare.csv", &["bare.csv", "1"]),
        ("none.csv", &["none.csv"]),
        ("calibration.csv --append-start-s 2000", &["are calibration runs too"]),
        ("n.csv --append-start-s 1,2", &["--append-start-s: 2 times for 1 file"]),
        ("n.csv --append-start-s nan", &["--append-start-s NaN"]),
    ] {
        folder.refused(&format!("{FILES} --out d --append {more}"), words);
    }
    folder.refused("diagnose --force-only --measured m.csv --append n.csv --out d", &[]);
}

/// The runs with six rows of a lift-off at the end of each; relaxed tissue pushes back with half of the force that it had at the same
/// depth on the way in.
fn lifted(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let names: Vec<&str> = lines[0].split(',').collect();
    let run = |line: &str| line.split(',').next().unwrap().to_owned();
    let mut out = format!("{}\n", lines[0]);
    for (k, line) in lines.iter().enumerate().skip(1) {
        out += &format!("{line}\n");
        let is_last = lines.get(k + 1).is_none_or(|next| run(next) != run(line));
        let time = |k: usize| lines[k].split(',').nth(1).unwrap().parse::<f64>().unwrap();
        for step in (1..=6).filter(|_| is_last).map(f64::from) {
            let (left, later_s) = (1.0 - step / 6.0, step * (time(k) - time(k - 1)));
            let cell = |(cell, name): (&str, &&str)| match *name {
                "t_s" | "contact_time_s" | "occlusion_time_s" => (cell.parse::<f64>().unwrap() + later_s).to_string(),
                "depth_mm" => (cell.parse::<f64>().unwrap() * left).to_string(),
                name if FORCES.contains(&name) => (cell.parse::<f64>().unwrap() * 0.5 * left * left).to_string(),
                _ => cell.to_owned(),
            };
            out += &(line.split(',').zip(&names).map(cell).collect::<Vec<_>>().join(",") + "\n");
        }
    }
    out
}

#[test]
fn rows_of_the_lift_off_are_left_out_with_a_note() {
    let folder = Folder::with(&[("c.csv", CALIBRATION), ("m.csv", MEASURED)]);
    let (_, plain) = diagnose(&folder, "", "plain");
    folder.write("c.csv", lifted(CALIBRATION));
    folder.write("m.csv", lifted(MEASURED));
    let (stdout, report) = diagnose(&folder, "", "lifted");
    for role in ["calibration", "measured"] {
        assert!(
            stdout.contains(&format!("note: 80 rows of 16 runs of the {role} set after the last hold")),
            "{stdout}"
        );
    }
    assert_eq!(report["verdict"], plain["verdict"]);
    assert_eq!(report["effects"][0]["law"], plain["effects"][0]["law"]);
    let pointer = "/effects/0/parameters/0/value";
    let [found, wanted] = [&report, &plain].map(|report| number(report, pointer));
    assert!((found / wanted - 1.0).abs() < 0.05, "{found} {wanted}");
}
