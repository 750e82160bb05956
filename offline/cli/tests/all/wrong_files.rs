//! Files of measured runs with the mistakes of a user: accepted files, refused files, warnings.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;

use crate::common::{refused, run, write};

const MEASURED: &str = include_str!("../../data/examples/measured.csv");
const CALIBRATION: &str = include_str!("../../data/examples/calibration.csv");

/// The text with another value in each cell of some columns.
fn changed(text: &str, columns: &[&str], of: impl Fn(f64) -> f64) -> String {
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let places: Vec<usize> =
        columns.iter().map(|name| header.split(',').position(|h| h == *name).expect("a column of the file")).collect();
    lines.fold(format!("{header}\n"), |mut out, line| {
        let cells = line.split(',').enumerate();
        let cells = cells.map(|(k, cell)| match places.contains(&k) {
            true => of(cell.parse().unwrap()).to_string(),
            false => cell.to_owned(),
        });
        out += &(cells.collect::<Vec<_>>().join(",") + "\n");
        out
    })
}

const ARGUMENTS: [&str; 7] = ["diagnose", "--calibration", "c.csv", "--measured", "m.csv", "--out", "d"];

/// A folder with both files.
fn folder(calibration: &str, measured: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "c.csv", calibration);
    write(folder.path(), "m.csv", measured);
    folder
}

/// The result for the files: standard output without notes, and `report.json`.
fn answer(at: &Path) -> (String, serde_json::Value) {
    let (code, stdout, stderr) = run(&ARGUMENTS, at);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    let report = fs::read_to_string(at.join("d/report.json")).unwrap();
    (stdout, serde_json::from_str(&report).unwrap())
}

/// Verdict and effects of a report.
fn verdict(report: &serde_json::Value) -> (serde_json::Value, serde_json::Value) {
    (report["verdict"].clone(), report["effects"].clone())
}

#[test]
fn every_clear_dialect_gives_the_same_diagnosis_and_is_reported() {
    let plain = folder(CALIBRATION, MEASURED);
    let wanted = verdict(&answer(plain.path()).1);
    assert_eq!(wanted.0, "named");
    let units = |text: &str| text.replacen('\n', "\n,[s],mm,mm,mm,N,N,N,s,s,s,a.u.,°C,mm\n", 1);
    for (measured, note) in [
        (MEASURED.replace(',', ";").replace('.', ","), "m.csv: read as semicolon-separated with decimal commas."),
        (MEASURED.replace(',', "\t"), "m.csv: read as tab-separated."),
        (units(MEASURED), "m.csv: line 2: a row of units, which are those of the columns."),
    ] {
        let folder = folder(CALIBRATION, &measured);
        let (stdout, report) = answer(folder.path());
        assert!(stdout.starts_with(&format!("note: {note}")), "{stdout}");
        assert_eq!(verdict(&report), wanted, "{note}");
        assert!(fs::read_to_string(folder.path().join("d/report.html")).unwrap().contains(note));
        let check = [&ARGUMENTS[..5], &["--check"]].concat();
        assert!(run(&check, folder.path()).1.contains(note), "{note}");
    }
}

#[test]
fn a_file_that_cannot_be_read_says_what_is_wrong_with_line_and_option() {
    let header = |from: &str, to: &str| MEASURED.replacen(from, to, 1);
    let below = |row: &str| MEASURED.replacen('\n', &format!("\n{row}\n"), 1);
    for (measured, expected) in [
        (header("friction_y_n", "t_s"), &["m.csv:1", "`t_s` occurs twice", "cells 2 and 8"][..]),
        (header("run_id", "RUN_ID"), &["m.csv:1", "`RUN_ID`", "upper and lower case", "--map run=RUN_ID"]),
        (header("-0.2,", "\"-0,2\","), &["m.csv:2", "`depth_mm`", "`-0,2`", "decimal comma", "write -0.2"]),
        (header("-0.2,", "-0,2,"), &["m.csv:2", "15 cells", "14", "decimal comma is a separator"]),
        (below(",s,um,mm,mm,mN,N,N,s,s,s,au,C,mm"), &["m.csv:2", "`um`", "add --unit depth=um,normal=mN"]),
        (below(",s,furlong,mm,mm,N,N,N,s,s,s,au,C,mm"), &["m.csv:2", "`furlong`", "neither a number nor a unit"]),
        (
            MEASURED.replace(',', ";").replacen("-0.2;", "-0,2;", 1),
            &["m.csv:2", "`-0.0041` has a decimal point", "line 2 has a decimal comma (`-0,2`)"],
        ),
        (header("t_s,depth_mm,", "t_s;depth_mm,"), &["m.csv:1", "commas and semicolons"]),
        (changed(MEASURED, &["depth_mm"], |v| -v), &["depth_mm", "--map depth=-depth_mm"]),
        (changed(MEASURED, &["depth_mm"], |v| 1000.0 * v), &["up to 1518 mm", "--unit depth=um"]),
    ] {
        let folder = folder(CALIBRATION, &measured);
        refused(&ARGUMENTS, folder.path(), expected);
        assert!(!folder.path().join("d/report.json").exists());
    }
    let folder = folder(CALIBRATION, "");
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(MEASURED.as_bytes()).unwrap();
    let packed = encoder.finish().unwrap();
    for kept in [packed.len() / 2, packed.len() - 4] {
        fs::write(folder.path().join("m.csv"), &packed[..kept]).unwrap();
        refused(&ARGUMENTS, folder.path(), &["m.csv:", "the gzip file is truncated"]);
    }
}

/// A column that is ignored because of its name alone may be an important one.
#[test]
fn a_column_whose_name_is_nearly_ours_is_warned_of() {
    let folder = folder(CALIBRATION, &MEASURED.replacen("hydration_au", "Hydration_AU", 1));
    let (stdout, _) = answer(folder.path());
    assert!(stdout.starts_with("warning: m.csv: column `Hydration_AU` is not read"), "{stdout}");
    assert!(stdout.contains("--map hydration=Hydration_AU"), "{stdout}");
}

#[test]
fn runs_of_the_fit_are_refused_as_held_out_ones_under_any_name() {
    let folder = folder(CALIBRATION, MEASURED);
    let at = folder.path();
    let lines: Vec<&str> = MEASURED.lines().collect();
    // Two runs of the fit under other names beside fourteen that are not.
    let mut part: Vec<String> = include_str!("../../data/examples/holdout.csv").lines().map(str::to_owned).collect();
    part.extend(lines[1..61].iter().map(|l| l.replacen("measured", "another", 1)));
    write(at, "part.csv", &(part.join("\n") + "\n"));
    write(at, "renamed.csv", &MEASURED.replace("\nmeasured", "\nx"));
    for (holdout, expected) in [
        ("m.csv", &["m.csv: line 2", "these runs were part of the fit", "run_id measured0, measured1"][..]),
        ("c.csv", &["these runs were part of the fit", "calibration0", "and 8 more"]),
        ("renamed.csv", &["renamed.csv", "x0 (there measured0)"]),
        ("part.csv", &["part.csv", "run_id another0 (there measured0), another1 (there measured1)"]),
    ] {
        refused(&[&ARGUMENTS[..], &["--holdout", holdout]].concat(), at, expected);
        assert!(!at.join("d/report.json").exists());
    }
    refused(
        &["diagnose", "--calibration", "c.csv", "--measured", "c.csv", "--out", "d"],
        at,
        &["these runs are calibration runs too", "calibration0"],
    );
}

#[test]
fn exchanged_files_are_refused() {
    let folder = folder(MEASURED, CALIBRATION);
    refused(&ARGUMENTS, folder.path(), &["c.csv", "are exchanged", "hydration_au", "hydration_bell"]);
    assert!(!folder.path().join("d/report.json").exists());
}

/// Without the column of the effect nothing can be named in exchanged roles; the report then states that the files are
/// inconclusive.
#[test]
fn files_that_look_exchanged_are_warned_of() {
    let renamed = |text: &str| text.replacen("hydration_au", "nothing", 1);
    let folder = folder(&renamed(MEASURED), &renamed(CALIBRATION));
    let (stdout, report) = answer(folder.path());
    assert!(stdout.starts_with("warning: The calibration runs (c.csv) vary speed_mm_s"), "{stdout}");
    assert!(!stdout.contains("Nothing is missing") && stdout.contains("are inconclusive"), "{stdout}");
    assert_eq!(report["cautions"][0]["kind"], "exchanged");
    let page = fs::read_to_string(folder.path().join("d/report.html")).unwrap();
    assert!(!page.contains("Nothing is missing") && page.contains("are --calibration and --measured exchanged?"));
}

#[test]
fn values_of_another_unit_are_warned_of_with_the_option_that_converts_them() {
    const FORCES: [&str; 3] = ["normal_force_n", "friction_x_n", "friction_y_n"];
    type Change = fn(f64) -> f64;
    let cases: [(&[&str], Change, &str, &str); 5] = [
        (&["temperature_c"], |v| v + 273.15, "temperature_c", "temperature=K"),
        (&["temperature_c"], |v| 1.8 * v + 32.0, "temperature_c", "temperature=F"),
        (&["finger_width_mm"], |v| 0.1 * v, "finger_width_mm", "finger_width=cm"),
        (&["hydration_au"], |v| v / 130.0, "hydration_au", "hydration=fraction"),
        (&FORCES, |v| v / 9.806_65e-3, "normal_force_n", "normal=gf,x=gf,y=gf"),
    ];
    let plain = folder(CALIBRATION, MEASURED);
    let (_, plain) = answer(plain.path());
    let amplitude = |report: &serde_json::Value| report["effects"][0]["parameters"][0]["value"].as_f64().unwrap();
    for (columns, change, column, option) in cases {
        let folder = folder(&changed(CALIBRATION, columns, change), &changed(MEASURED, columns, change));
        let (stdout, report) = answer(folder.path());
        assert!(stdout.starts_with(&format!("warning: c.csv: {column}:")), "{stdout}");
        assert!(stdout.contains(&format!("--unit {option} converts")), "{stdout}");
        assert_eq!(report["cautions"].as_array().unwrap().iter().filter(|c| c["kind"] == "unit").count(), 2);
        assert!(fs::read_to_string(folder.path().join("d/report.html")).unwrap().contains(&format!("--unit {option}")));
        // The option gives the diagnosis of the plain files.
        let (code, stdout, stderr) = run(&[&ARGUMENTS[..], &["--unit", option]].concat(), folder.path());
        assert!(code == Some(0) && !stdout.contains("warning:"), "{stdout}{stderr}");
        let report: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(folder.path().join("d/report.json")).unwrap()).unwrap();
        assert_eq!(report["verdict"], "named", "{option}");
        // Rounding decides over a reading near the bound of spikes.
        assert!((amplitude(&report) / amplitude(&plain) - 1.0).abs() < 0.03, "{option}: {}", amplitude(&report));
    }
}

#[test]
fn columns_that_contradict_each_other_are_refused() {
    for (column, of, expected) in [
        (
            "t_s",
            (|v| 1000.0 * v) as fn(f64) -> f64,
            &["t_s counts 1000 where contact_time_s counts 1", "--unit t=ms"][..],
        ),
        ("friction_x_n", |v| -v, &["friction along x points against the motion", "--map x=-friction_x_n"]),
        ("friction_y_n", |v| -v, &["friction along y points against the motion", "--map y=-friction_y_n"]),
    ] {
        let folder = folder(&changed(CALIBRATION, &[column], of), &changed(MEASURED, &[column], of));
        refused(&ARGUMENTS, folder.path(), expected);
    }
}

#[test]
fn forces_alone_in_another_unit_or_on_other_axes_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let name = "July3_2_force_data_1.csv";
    let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/human_texture_exploration").join(name);
    fs::copy(packed, folder.path().join("t.csv")).unwrap();
    let arguments = ["diagnose", "--force-only", "--measured", "t.csv", "--out", "d", "--map"];
    for (more, expected) in [
        (&["normal=-Fz,x=Fx,y=Fy,t=Timestamp"][..], None),
        (
            &["normal=-Fz,x=Fx,y=Fy,t=Timestamp", "--unit", "normal=mN,x=mN,y=mN"],
            Some("are they in N already (no --unit)"),
        ),
        (&["normal=-Fx,x=-Fz,y=Fy,t=Timestamp"], Some("are the axes exchanged?")),
        (&["normal=-Fy,x=Fx,y=-Fz,t=Timestamp"], Some("are the axes exchanged?")),
    ] {
        let (code, stdout, stderr) = run(&[&arguments[..], more].concat(), folder.path());
        assert_eq!(code, Some(0), "{stderr}");
        let warned = stdout.starts_with("warning: t.csv: ");
        assert!(warned == expected.is_some() && expected.is_none_or(|part| stdout.contains(part)), "{stdout}");
        let page = fs::read_to_string(folder.path().join("d/report.html")).unwrap();
        assert_eq!(page.contains("class=\"warning\">The"), warned);
    }
}

#[test]
fn copies_of_runs_change_nothing_and_are_reported() {
    let plain = folder(CALIBRATION, MEASURED);
    let wanted = verdict(&answer(plain.path()).1);
    let (header, rows) = MEASURED.split_once('\n').unwrap();
    let mut many = format!("{header}\n");
    for copy in 0..1200 {
        rows.lines().for_each(|line| _ = writeln!(many, "k{copy}{line}"));
    }
    let folder = folder(CALIBRATION, &many);
    let (stdout, report) = answer(folder.path());
    assert!(stdout.starts_with("note: m.csv: 19184 of 19200 runs repeat another run of the file"), "{stdout}");
    assert_eq!(verdict(&report), wanted);
    let page = fs::read_to_string(folder.path().join("d/report.html")).unwrap();
    assert!(page.contains("19184 of 19200 runs repeat"));
}
