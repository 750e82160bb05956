//! A column of the user's own: `eval` follows it bit for bit as the core steps by hand; errors of a law in `diagnose`.

use fingerpad::host::ModelFile;
use fingerpad::{Contact, Effects, Motion, Response, SPRINGS, Surroundings};

use crate::common::{Folder, fe_set};
use crate::models::made;

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
fn by_hand(model: &[u8], rows: &[[f64; 4]]) -> Vec<[f32; 3]> {
    let file = ModelFile::new(model).unwrap();
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
    let (model, rows) = (made("charged.fpm"), rows());
    // A constant voltage changes the result, in the same way as a column of that value.
    let constant: Vec<[f64; 4]> = rows.iter().map(|[t, depth, x, _]| [*t, *depth, *x, 120.0]).collect();
    let plain = path_csv(&rows).lines().fold(String::new(), |text, line| {
        let cells: Vec<&str> = line.split(',').collect();
        text + &[cells[0], cells[1], cells[3], cells[4]].join(",") + "\n"
    });
    let paths = [("path.csv", path_csv(&rows)), ("constant.csv", path_csv(&constant)), ("plain.csv", plain)];
    let folder = Folder::with(&paths.each_ref().map(|(name, text)| (*name, text.as_str())));
    folder.write("charged.fpm", &model);
    let eval = "eval --model charged.fpm --path";
    let (_, stderr) = folder.done(&format!("{eval} path.csv --out r.csv"));
    assert_eq!(stderr, "");
    let found = ["normal_force_n", "friction_x_n", "friction_y_n"].map(|name| folder.column("r.csv", name));
    let wanted = by_hand(&model, &rows);
    assert_eq!(found[0].len(), wanted.len());
    for (k, wanted) in wanted.iter().enumerate() {
        assert_eq!([0, 1, 2].map(|c| found[c][k]), wanted.map(f64::from), "row {k}");
    }
    folder.done(&format!("{eval} constant.csv --out a.csv"));
    folder.done(&format!("{eval} plain.csv --column voltage_v=120 --out b.csv"));
    assert!(folder.bytes("a.csv") == folder.bytes("b.csv") && folder.bytes("a.csv") != folder.bytes("r.csv"));
}

/// Measured runs with a voltage in every row; row 200 has this one.
fn charged_runs(volts: &str) -> String {
    let cell = |k: usize| match k {
        0 => "voltage_v".to_owned(),
        200 => volts.to_owned(),
        _ => (k % 150).to_string(),
    };
    fe_set("set_17").lines().enumerate().map(|(k, line)| format!("{line},{}\n", cell(k))).collect()
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
    let folder =
        Folder::with(&[("good.toml", LAWS), ("c.csv", &fe_set("calibration_d")), ("bare.csv", &fe_set("set_17"))]);
    folder.write("m.csv", charged_runs("12.5"));
    folder.write("far.csv", charged_runs("900"));
    let diagnose = "diagnose --calibration c.csv --stability-groups 0 --out d --laws";
    folder.done(&format!("{diagnose} good.toml --measured m.csv"));
    let earlier = folder.contents("d");
    assert!(
        ["d/report.json", "d/corrected.fpm"].iter().all(|name| earlier.contains_key(*name)),
        "{:?}",
        earlier.keys()
    );
    let formula = "gain * (voltage_v / 100)^2";
    let active = LAWS.replace("strength", "stiffness");
    for (laws, from, to, expected) in [
        (
            LAWS,
            formula,
            "gain * 10 / voltage_v",
            &["line 10", "character 11", "divided by zero", "voltage_v = 0 V"][..],
        ),
        (LAWS, formula, "gain * volts", &["line 10", "character 8", "`volts`"]),
        (LAWS, formula, "gain * (voltage_v - path_mm)", &["line 10", "contradictory units", "V and mm"]),
        (LAWS, "name = \"voltage_v\"", "name = \"voltage_mm\"", &["line 2", "`voltage_mm`", "says mm"]),
        (LAWS, "range = [0, 200]", "range = [0, 200]\nsettle_s = -4", &["line 2", "settle_s -4"]),
        (LAWS, "name = \"voltage_v\"", "name = \"voltage_between_finger_and_plate_v\"", &["line 2", "31 bytes"]),
        (active.as_str(), formula, "gain * (path_mm / 50)", &["bad.toml: line 10", "free energy"]),
    ] {
        assert!(laws.contains(from));
        folder.write("bad.toml", laws.replacen(from, to, 1));
        folder.refused(&format!("{diagnose} bad.toml --measured m.csv"), &[&["bad.toml"], expected].concat());
        assert_eq!(folder.contents("d"), earlier, "{to}");
    }
    for (measured, expected) in [
        ("bare.csv", &["bare.csv: line 1", "`voltage_v` is missing", "`mine`", "--map voltage_v="][..]),
        ("far.csv", &["far.csv:201", "`voltage_v`", "`900`", "0 to 200 V"]),
        ("m.csv --can-set depth,volts", &["--can-set volts", "none of depth", "voltage_v"]),
    ] {
        folder.refused(&format!("{diagnose} good.toml --measured {measured}"), expected);
        assert_eq!(folder.contents("d"), earlier, "{measured}");
    }
    let (stdout, _) = folder.done(&format!("{diagnose} good.toml --measured m.csv --can-set voltage_v --check"));
    let line = stdout.lines().find(|line| line.starts_with("voltage_v: ")).expect("a line of the voltage");
    assert!(line.starts_with("voltage_v: calibration not recorded; measured ") && line.ends_with(" V"), "{line}");
    assert!(stdout.contains("mine: can be tested"), "{stdout}");
    assert_eq!(folder.contents("d"), earlier);
}
