//! `fingerpad eval` with a model that reads a column of the user's own: along a path, bit for bit as the core steps by hand.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::Path;

use crate::common::charged::charged;
use crate::common::{refused, run, write};
use fingerpad::host::ModelFile;
use fingerpad::{Contact, Effects, Motion, Response, SPRINGS, Surroundings};

/// Rows of a path: time, depth, slide along x, voltage. Each step is shorter than the 0.02 mm that are made at once, but for the
/// last, which is 0.1 mm in six.
fn rows() -> Vec<[f64; 4]> {
    let mut rows = vec![[0.0, 0.0, 0.0, 0.0]];
    rows.extend((1..=50).map(|k| [0.02 * f64::from(k), 0.015 * f64::from(k), 0.0, 4.0 * f64::from(k)]));
    // Reversals under a voltage that jumps.
    rows.extend((1..=80).map(|k| {
        let slide = 0.5 * (0.025 * f64::from(k)).sin();
        [1.0 + 0.01 * f64::from(k), 0.75, slide, if k % 7 < 3 { 200.0 } else { 2.5 * f64::from(k % 80) }]
    }));
    let [t, depth, slide, _] = rows[rows.len() - 1];
    rows.push([t + 0.3, depth, slide + 0.1, 10.0]);
    rows
}

fn path_csv(rows: &[[f64; 4]]) -> String {
    let line = |[t, depth, x, volts]: &[f64; 4]| format!("{t},{depth},{volts},{x},0\n");
    "t_s,depth_mm,voltage_v,slide_x_mm,slide_y_mm\n".to_owned() + &rows.iter().map(line).collect::<String>()
}

/// Normal force, friction x and y of the core along the rows.
fn by_hand(model: &Path, rows: &[[f64; 4]]) -> Vec<[f32; 3]> {
    let file = ModelFile::new(&fs::read(model).unwrap()).unwrap();
    let file = file.file();
    let effects = Effects::of_file(&file).unwrap();
    let mut contact = Contact::<SPRINGS>::default();
    let (mut around, mut at) = (Surroundings::default(), rows[0]);
    let mut step = |to: [f64; 4], dt: f64| -> [f32; 3] {
        around.series_s += dt as f32;
        around.own[0] = to[3] as f32;
        let motion = Motion {
            depth_mm: to[1] as f32,
            slide_increment_mm: [(to[2] - at[2]) as f32, 0.0],
            spin_increment_rad: 0.0,
            dt_s: dt as f32,
        };
        at = to;
        let response: Response = effects.step(&file.model, &mut contact, around, motion);
        effects.reading_under(&response, &contact, &around)
    };
    let mut out = vec![step(rows[0], 1e-3)];
    for pair in rows.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let longest = (to[1] - from[1]).abs().max((to[2] - from[2]).abs());
        let steps = (longest / f64::from(0.02f32)).ceil().max(1.0) as u32;
        for k in 1..=steps {
            let share = f64::from(k) / f64::from(steps);
            let mix = |i: usize| if k == steps { to[i] } else { from[i] + share * (to[i] - from[i]) };
            let reading = step([0, 1, 2, 3].map(mix), (to[0] - from[0]) / f64::from(steps));
            if k == steps || k % 5 == 0 {
                out.push(reading);
            }
        }
    }
    out
}

#[test]
fn a_column_of_the_path_drives_the_table_as_the_core_does_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    charged(&at.join("charged.fpm"));
    let rows = rows();
    write(at, "path.csv", &path_csv(&rows));
    let (code, _, stderr) = run(&["eval", "--model", "charged.fpm", "--path", "path.csv", "--out", "response.csv"], at);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let response = fs::read_to_string(at.join("response.csv")).unwrap();
    let head: Vec<&str> = response.lines().next().unwrap().split(',').collect();
    let columns = ["normal_force_n", "friction_x_n", "friction_y_n"]
        .map(|name| head.iter().position(|h| *h == name).unwrap_or_else(|| panic!("no {name} in {head:?}")));
    let wanted = by_hand(&at.join("charged.fpm"), &rows);
    let found: Vec<[f64; 3]> = response
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            columns.map(|c| cells[c].parse().unwrap())
        })
        .collect();
    assert_eq!(found.len(), wanted.len());
    for (k, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
        assert_eq!(*found, wanted.map(f64::from), "row {k}");
    }
    // A constant voltage changes the result, in the same way as a column of that value.
    let constant: Vec<[f64; 4]> = rows.iter().map(|[t, depth, x, _]| [*t, *depth, *x, 120.0]).collect();
    write(at, "constant.csv", &path_csv(&constant));
    let plain = path_csv(&rows).lines().fold(String::new(), |text, line| {
        let cells: Vec<&str> = line.split(',').collect();
        text + &[cells[0], cells[1], cells[3], cells[4]].join(",") + "\n"
    });
    write(at, "plain.csv", &plain);
    for (arguments, out) in
        [(&["--path", "constant.csv"][..], "a.csv"), (&["--path", "plain.csv", "--column", "voltage_v=120"], "b.csv")]
    {
        let all = [&["eval", "--model", "charged.fpm", "--out", out][..], arguments].concat();
        assert_eq!(run(&all, at).0, Some(0));
    }
    let [a, b] = ["a.csv", "b.csv"].map(|name| fs::read_to_string(at.join(name)).unwrap());
    assert!(a == b && a != response);
}

#[test]
fn a_path_that_lacks_the_column_or_has_it_twice_or_out_of_range_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    charged(&at.join("charged.fpm"));
    write(at, "bare.csv", "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,1,0,0\n");
    write(at, "far.csv", "t_s,depth_mm,slide_x_mm,slide_y_mm,voltage_v\n0,0,0,0,0\n1,1,0,0,1200\n");
    write(at, "good.csv", "t_s,depth_mm,slide_x_mm,slide_y_mm,voltage_v\n0,0,0,0,0\n1,1,0,0,100\n");
    write(at, "r.csv", "an earlier response\n");
    let eval = |path: &'static str, more: &[&'static str], expected: &[&str]| {
        let arguments = [&["eval", "--model", "charged.fpm", "--path", path, "--out", "r.csv"][..], more].concat();
        refused(&arguments, at, expected);
        assert_eq!(fs::read_to_string(at.join("r.csv")).unwrap(), "an earlier response\n", "{arguments:?}");
    };
    eval("bare.csv", &[], &["bare.csv: line 1", "`voltage_v` is missing", "charged.fpm", "--column voltage_v=20"]);
    eval("far.csv", &[], &["far.csv:3", "`voltage_v`", "`1200`", "0 to 200 V"]);
    eval("good.csv", &["--column", "voltage_v=5"], &["--column voltage_v=5", "good.csv has that column"]);
    eval("bare.csv", &["--column", "voltage_v=-5"], &["voltage_v=-5", "0 to 200 V"]);
    eval("bare.csv", &["--column", "volts=5"], &["volts=5", "it reads voltage_v"]);
    eval("bare.csv", &["--column", "voltage_v=5", "--column", "voltage_v=6"], &["voltage_v=6", "twice"]);
    // The shipped model reads none: the column is unknown to it.
    refused(&["eval", "--path", "good.csv", "--out", "r.csv"], at, &["good.csv:1", "voltage_v"]);
}

/// Runs of a stored set with a voltage in every row, or without one.
fn runs(at: &Path, packed: &str, name: &str, volts: Option<&str>) {
    let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fe_sets").join(packed);
    let mut text = String::new();
    flate2::read::GzDecoder::new(fs::File::open(packed).unwrap()).read_to_string(&mut text).unwrap();
    let text = match volts {
        None => text,
        Some(volts) => text.lines().enumerate().fold(String::new(), |out, (k, line)| {
            let cell = match k {
                0 => "voltage_v".to_owned(),
                200 => volts.to_owned(),
                _ => (k % 150).to_string(),
            };
            out + line + "," + &cell + "\n"
        }),
    };
    write(at, name, &text);
}

/// Names and contents of a folder's files.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&p).unwrap())).collect()
}

const LAWS: &str = r#"
[[column]]
name = "voltage_v"
unit = "V"
range = [0, 200]

[[law]]
name = "mine"
acts_on = "strength"
formula = "gain * (voltage_v / 100)^2"
parameter = [{ name = "gain", unit = "", range = [0, 1], typical = 0.05 }]
"#;

#[test]
fn errors_of_a_law_or_its_column_name_the_place_and_keep_an_earlier_diagnosis() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    runs(at, "calibration_d.csv.gz", "c.csv", None);
    runs(at, "set_17.csv.gz", "bare.csv", None);
    runs(at, "set_17.csv.gz", "m.csv", Some("12.5"));
    runs(at, "set_17.csv.gz", "far.csv", Some("900"));
    write(at, "good.toml", LAWS);
    let diagnose = |measured: &'static str, laws: &'static str, more: &[&'static str]| {
        let words = ["diagnose", "--calibration", "c.csv", "--measured", measured, "--laws", laws, "--out", "d"];
        [&words[..], more].concat()
    };
    let (code, _, stderr) = run(&diagnose("m.csv", "good.toml", &[]), at);
    assert_eq!(code, Some(0), "{stderr}");
    let earlier = contents(&at.join("d"));
    assert!(earlier.contains_key("report.json") && earlier.contains_key("corrected.fpm"), "{:?}", earlier.keys());
    let formula = "gain * (voltage_v / 100)^2";
    for (from, to, expected) in [
        (formula, "gain * 10 / voltage_v", &["line 10", "character 11", "divided by zero", "voltage_v = 0 V"][..]),
        (formula, "gain * volts", &["line 10", "character 8", "`volts`"]),
        (formula, "gain * (voltage_v - path_mm)", &["line 10", "contradictory units", "V and mm"]),
        ("name = \"voltage_v\"", "name = \"voltage_mm\"", &["line 2", "`voltage_mm`", "says mm"]),
        ("range = [0, 200]", "range = [0, 200]\nsettle_s = -4", &["line 2", "settle_s -4"]),
        ("name = \"voltage_v\"", "name = \"voltage_between_finger_and_plate_v\"", &["line 2", "31 bytes"]),
    ] {
        assert!(LAWS.contains(from));
        write(at, "bad.toml", &LAWS.replacen(from, to, 1));
        refused(&diagnose("m.csv", "bad.toml", &[]), at, &[&["bad.toml"], expected].concat());
        assert_eq!(contents(&at.join("d")), earlier, "{to}");
    }
    let active = LAWS.replace("strength", "stiffness").replace(formula, "gain * (path_mm / 50)");
    write(at, "bad.toml", &active);
    refused(&diagnose("m.csv", "bad.toml", &[]), at, &["bad.toml: line 10", "free energy"]);
    let more: [(&'static str, &[&'static str], &[&str]); 3] = [
        ("bare.csv", &[], &["bare.csv: line 1", "`voltage_v` is missing", "`mine`", "--map voltage_v="]),
        ("far.csv", &[], &["far.csv:201", "`voltage_v`", "`900`", "0 to 200 V"]),
        ("m.csv", &["--can-set", "depth,volts"], &["--can-set volts", "none of depth", "voltage_v"]),
    ];
    for (measured, more, expected) in more {
        refused(&diagnose(measured, "good.toml", more), at, expected);
        assert_eq!(contents(&at.join("d")), earlier, "{measured} {more:?}");
    }
    let (code, stdout, stderr) = run(&diagnose("m.csv", "good.toml", &["--can-set", "voltage_v", "--check"]), at);
    assert_eq!(code, Some(0), "{stderr}");
    let line = stdout.lines().find(|line| line.starts_with("voltage_v: ")).expect("a line of the voltage");
    assert!(line.starts_with("voltage_v: calibration not recorded; measured ") && line.ends_with(" V"), "{line}");
    assert!(stdout.contains("mine: can be tested"), "{stdout}");
    assert_eq!(contents(&at.join("d")), earlier);
}
