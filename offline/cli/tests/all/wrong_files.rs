//! `diagnose`: files in other dialects and units give the diagnosis of the plain ones; repeated runs are found.

use std::fmt::Write as _;
use std::io::Write as _;

use serde_json::Value;

use crate::common::{CALIBRATION, Folder, HOLDOUT, MEASURED, changed};

/// Without the groups that are left out, which take most of the time.
const DIAGNOSE: &str = "diagnose --calibration c.csv --measured m.csv --stability-groups 0 --out d";

fn files(calibration: &str, measured: &str) -> Folder {
    Folder::with(&[("c.csv", calibration), ("m.csv", measured)])
}

/// Standard output and report of the diagnosis.
fn answer(folder: &Folder, options: &str) -> (String, Value) {
    let (stdout, _) = folder.done(&format!("{DIAGNOSE} {options}"));
    (stdout, folder.json("d/report.json"))
}

/// Verdict and effects of a report.
fn verdict(report: &Value) -> [Value; 2] {
    ["verdict", "effects"].map(|name| report[name].clone())
}

#[test]
fn every_clear_dialect_gives_the_same_diagnosis_and_is_reported() {
    let wanted = verdict(&answer(&files(CALIBRATION, MEASURED), "").1);
    assert_eq!(wanted[0], "named");
    let units = MEASURED.replacen('\n', "\n,[s],mm,mm,mm,N,N,N,s,s,s,a.u.,°C,mm\n", 1);
    for (measured, note) in [
        (MEASURED.replace(',', ";").replace('.', ","), "m.csv: read as semicolon-separated with decimal commas."),
        (MEASURED.replace(',', "\t"), "m.csv: read as tab-separated."),
        (units, "m.csv: line 2: a row of units, which are those of the columns."),
    ] {
        let folder = files(CALIBRATION, &measured);
        let (stdout, report) = answer(&folder, "");
        assert!(stdout.starts_with(&format!("note: {note}")), "{stdout}");
        assert_eq!(verdict(&report), wanted, "{note}");
        assert!(folder.text("d/report.html").contains(note));
        assert!(folder.run("diagnose --calibration c.csv --measured m.csv --check").1.contains(note), "{note}");
    }
}

/// A law is named if its p is at most alpha; the flips alone would not name this one at 0.01.
#[test]
fn alpha_decides() {
    let folder = files(CALIBRATION, MEASURED);
    let (printed, report) = answer(&folder, "");
    let p = report["effects"][0]["p"].as_f64().unwrap();
    // How many flips exceed the score hangs on rounding, and so on the processor.
    assert!((1e-4..0.01).contains(&p), "{p}");
    assert!(
        printed.contains("Confidence: high; a regression of run means without the model finds a dependence"),
        "{printed}"
    );
    assert!(report["title"].as_str().unwrap().starts_with("Missing: hydration bell"), "{}", report["title"]);
    let (printed, report) = answer(&folder, &format!("--alpha {}", 0.9 * p));
    assert_ne!(report["verdict"], "named", "{printed}");
    assert!(report["effects"].as_array().unwrap().is_empty() && !folder.path("d/corrected.fpm").exists());
}

#[test]
fn a_truncated_gzip_file_is_refused() {
    let folder = files(CALIBRATION, "");
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(MEASURED.as_bytes()).unwrap();
    let packed = encoder.finish().unwrap();
    for kept in [packed.len() / 2, packed.len() - 4] {
        folder.write("m.csv", &packed[..kept]);
        folder.refused(DIAGNOSE, &["m.csv:", "the gzip file is truncated"]);
    }
}

#[test]
fn runs_of_the_fit_are_refused_as_held_out_ones_under_any_name() {
    let folder = files(CALIBRATION, MEASURED);
    // Two runs of the fit under other names beside fourteen that are not.
    let another = MEASURED.lines().skip(1).take(60).map(|line| line.replacen("measured", "another", 1) + "\n");
    folder.write("part.csv", HOLDOUT.to_owned() + &another.collect::<String>());
    folder.write("renamed.csv", MEASURED.replace("\nmeasured", "\nx"));
    for (holdout, expected) in [
        ("m.csv", &["m.csv: line 2", "these runs were part of the fit", "run_id measured0, measured1"][..]),
        ("c.csv", &["these runs were part of the fit", "calibration0", "and 8 more"]),
        ("renamed.csv", &["renamed.csv", "x0 (there measured0)"]),
        ("part.csv", &["part.csv", "run_id another0 (there measured0), another1 (there measured1)"]),
    ] {
        folder.refused(&format!("{DIAGNOSE} --holdout {holdout}"), expected);
        assert!(!folder.exists("d/report.json"));
    }
}

#[test]
fn forces_of_another_unit_are_warned_of_with_the_option_that_converts_them() {
    other_units(4..5);
}

#[test]
#[ignore = "nightly"]
fn values_of_another_unit_are_warned_of_with_the_option_that_converts_them() {
    other_units(0..4);
}

fn other_units(cases: std::ops::Range<usize>) {
    const FORCES: [&str; 3] = ["normal_force_n", "friction_x_n", "friction_y_n"];
    type Change = fn(f64) -> f64;
    let all: [(&[&str], Change, &str, &str); 5] = [
        (&["temperature_c"], |v| v + 273.15, "temperature_c", "temperature=K"),
        (&["temperature_c"], |v| 1.8 * v + 32.0, "temperature_c", "temperature=F"),
        (&["finger_width_mm"], |v| 0.1 * v, "finger_width_mm", "finger_width=cm"),
        (&["hydration_au"], |v| v / 130.0, "hydration_au", "hydration=fraction"),
        (&FORCES, |v| v / 9.806_65e-3, "normal_force_n", "normal=gf,x=gf,y=gf"),
    ];
    let amplitude = |report: &Value| report["effects"][0]["parameters"][0]["value"].as_f64().unwrap();
    let plain = amplitude(&answer(&files(CALIBRATION, MEASURED), "").1);
    for (columns, change, column, option) in all[cases].iter().copied() {
        let folder = files(&changed(CALIBRATION, columns, change), &changed(MEASURED, columns, change));
        let (stdout, report) = answer(&folder, "");
        assert!(stdout.starts_with("warning: c.csv") && stdout.contains(&format!(": {column}")), "{stdout}");
        assert!(stdout.contains(&format!("--unit {option} ")), "{stdout}");
        assert!(report["cautions"].as_array().unwrap().iter().any(|c| c["kind"] == "unit"), "{report}");
        let page = folder.text("d/report.html").replace("<code>", "").replace("</code>", "");
        assert!(page.contains(&format!("--unit {option}")));
        // The option gives the diagnosis of the plain files.
        let (stdout, report) = answer(&folder, &format!("--unit {option}"));
        assert!(!stdout.contains("warning:"), "{stdout}");
        assert_eq!(report["verdict"], "named", "{option}");
        // Rounding decides over a reading near the bound of spikes.
        assert!((amplitude(&report) / plain - 1.0).abs() < 0.03, "{option}: {}", amplitude(&report));
    }
}

#[test]
fn copies_of_runs_change_nothing_and_are_reported() {
    copied(20);
}

#[test]
#[ignore = "nightly"]
fn thousands_of_copies_change_nothing_and_are_reported() {
    copied(1200);
}

/// Diagnoses a file that holds the sixteen measured runs many times.
fn copied(times: usize) {
    let wanted = verdict(&answer(&files(CALIBRATION, MEASURED), "").1);
    let (header, rows) = MEASURED.split_once('\n').unwrap();
    let mut many = format!("{header}\n");
    for copy in 0..times {
        rows.lines().for_each(|line| _ = writeln!(many, "k{copy}{line}"));
    }
    let folder = files(CALIBRATION, &many);
    let (stdout, report) = answer(&folder, "");
    let note = format!("{} of {} runs repeat", 16 * times - 16, 16 * times);
    assert!(stdout.starts_with(&format!("note: m.csv: {note} another run of the file")), "{stdout}");
    assert_eq!(verdict(&report), wanted);
    assert!(folder.text("d/report.html").contains(&note));
}
