//! Typical mistakes of a new user: places of outputs, missing settings; progress and interruption.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::Child;
use std::time::{Duration, Instant};

use crate::common::{CALIBRATION, COARSE, Folder, MEASURED, ended, fe_set, signal};

const TABLE: &str = include_str!("../../data/yoshida2011.csv");
const HEAD: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm\n";

#[test]
#[cfg(unix)]
fn a_link_is_the_file_that_it_leads_to() {
    let folder = Folder::with(&[("p.csv", &format!("{HEAD}0,0,0,0\n1,1,0,0\n"))]);
    std::os::unix::fs::symlink("p.csv", folder.path("link.csv")).unwrap();
    folder.refused("eval --path link.csv --out p.csv", &["--out p.csv", "link.csv"]);
    folder.refused("eval --path p.csv --out link.csv", &["--out link.csv", "p.csv"]);
}

#[test]
fn missing_folders_are_made_and_an_older_series_goes() {
    let folder = Folder::with(&[("c.toml", COARSE), ("two.csv", &format!("{HEAD}0,0,0,0\n1,0.3,0,0\n"))]);
    folder.write("p.csv", format!("{HEAD}0,0,0,0\n1,0.3,0,0\n2,0.3,0.05,0\n"));
    let simulate = |path: &str| {
        folder.done(&format!("simulate --path {path} --config c.toml --out new/deep/r.csv --vtu more/fields"));
        folder.names("more/fields")
    };
    let three = simulate("p.csv");
    assert_eq!(three.len(), 7, "{three:?}");
    folder.write("more/fields/mine.vtu", "");
    let two = ["mine.vtu", "r.pvd", "r_0000.vtu", "r_0001.vtu", "r_pad_0000.vtu", "r_pad_0001.vtu"];
    assert_eq!(simulate("two.csv"), two);
    folder.done("eval --path p.csv --out eval/r.csv");
}

#[test]
fn a_response_is_drawn_also_where_the_run_ends_early() {
    let folder = Folder::with(&[("c.toml", COARSE)]);
    folder.write("p.csv", format!("{HEAD}0,0,0,0\n1,0.3,0,0\n2,0.3,0.1,0\n3,0.3,0.05,0\n4,-0.1,0.05,0\n"));
    let simulate = "simulate --path p.csv --config c.toml --out new/r.csv --report new";
    let (printed, _) = folder.done(simulate);
    assert!(printed.contains("new/report.html"), "{printed}");
    let maps = || folder.names("new/figures").iter().filter(|name| name.ends_with("_pressure.svg")).count();
    // The end of the press, the turn, the last row that presses.
    assert_eq!(maps(), 3);
    let page = folder.text("new/report.html");
    assert!(page.contains("href=\"r.csv\"") && page.contains("friction_while_pressing = true"));
    folder.done(&format!("{simulate} --map-rows 3 --vtu fields"));
    assert_eq!(maps(), 1, "the maps of the earlier report go");
    let report = folder.json("new/report.json");
    assert_eq!(report["maps"][0]["row"], 3);
    let drawn = &report["maps"][0]["response"];
    assert_eq!((drawn["t_s"].as_f64(), drawn["slide_x_mm"].as_f64()), (Some(2.0), Some(0.1)));

    // Excessive friction or moment: the run ends, its rows are kept and drawn.
    for (path, message) in [
        ("t_s,depth_mm,friction_x_n,friction_y_n\n0,0,0,0\n1,0.3,0,0\n2,0.3,5,0\n", "friction force of 5.0000 N"),
        (
            "t_s,depth_mm,slide_x_mm,slide_y_mm,spin_moment_n_mm\n0,0,0,0,0\n1,0.3,0,0,0\n2,0.3,0,0,9\n",
            "spin moment of 9.0000 N mm, beyond what friction holds here (0.",
        ),
    ] {
        folder.write("p.csv", path);
        let (code, _, stderr) = folder.run(simulate);
        assert!(code == Some(3) && stderr.contains("rows kept in new/r.partial.csv"), "{code:?} {stderr}");
        assert!(stderr.contains("row 2 drives") && stderr.contains(message), "{stderr}");
        let rows = folder.text("new/r.partial.csv");
        assert!(rows.lines().count() > 5, "{rows}");
    }
    let page = folder.text("new/report.html");
    assert!(page.contains("The run ended before its path did") && page.contains("href=\"r.partial.csv\""));
}

/// Diagnoses twice into `d`, the second time with the input `d/mine.csv` there.
fn diagnose_twice(line: &str, input: &str) {
    let folder = Folder::with(&[("c.csv", CALIBRATION), ("in.csv", input), ("e/report.html", "mine")]);
    folder.done(&format!("diagnose {line} in.csv --out d"));
    let mut expected = folder.names("d");
    // As if an earlier diagnosis had written more.
    let list = folder.text("d/files.txt");
    folder.write("d/files.txt", list.replace("report.json", "report.json\nold.fpm\nold.svg\n../in.csv"));
    ["d/old.fpm", "d/old.svg", "d/mine.svg"].iter().for_each(|old| folder.write(old, ""));
    folder.write("d/mine.csv", input);
    folder.done(&format!("diagnose {line} d/mine.csv --out d"));
    expected.extend(["mine.csv".into(), "mine.svg".into()]);
    expected.sort();
    assert_eq!(folder.names("d"), expected);
    assert!(folder.exists("in.csv"), "a list never leads out of its folder");

    folder.refused(&format!("diagnose {line} in.csv --out e"), &["e/report.html", "files.txt"]);
    assert_eq!(folder.text("e/report.html"), "mine");
    folder.write("d/next_experiment.csv", input);
    let itself = format!("diagnose {line} d/next_experiment.csv --out d");
    folder.refused(&itself, &["--out d", "next_experiment.csv"]);
}

#[test]
fn a_folder_holds_one_result_and_foreign_files_stay() {
    diagnose_twice("--stability-groups 0 --calibration c.csv --measured", MEASURED);
}

#[test]
#[ignore = "nightly"]
fn a_folder_holds_one_result_of_a_table() {
    diagnose_twice("--mesh-preset coarse --table", TABLE);
}

#[test]
fn material_constants_that_are_left_out_keep_their_defaults() {
    let folder = Folder::new();
    let settings = |text: &str| -> toml::Value {
        folder.write("s.toml", text);
        toml::from_str(&folder.done("build --config s.toml --print-config").0).unwrap()
    };
    let usual = settings("");
    for (table, key, value) in [
        ("skin", "mu_mpa", 0.05),
        ("skin", "alpha", 2.5),
        ("subcutaneous", "d_per_mpa", 4.0),
        ("nail", "poisson", 0.4),
        ("bone.elastic", "poisson", 0.2),
        ("bone.elastic", "young_mpa", 900.0),
        ("bone.joint", "rotation_nmm_per_rad", 20.0),
    ] {
        let found = settings(&format!("[tissue.{table}]\n{key} = {value:?}\n"));
        let mut expected = usual.clone();
        let material = table.split('.').fold(&mut expected["tissue"], |t, key| &mut t[key]);
        assert_ne!(material[key].as_float(), Some(value));
        material[key] = value.into();
        assert_eq!(found, expected, "{table}.{key}");
    }
}

#[test]
fn our_own_deck_is_imported_without_its_plane() {
    let folder = Folder::new();
    folder.done("mesh --mesh-preset coarse --deck --out deck.inp");
    let (printed, _) = folder.done("mesh --imported deck.inp --out back.vtu");
    for part in ["the plane (1 element(s) of the set PLANE)", "0 elements turned", "0 nodes merged"] {
        assert!(printed.contains(part), "{printed}");
    }
    let region = |text: &str, name: &str| text.lines().find(|l| l.trim_start().starts_with(name)).unwrap().to_owned();
    let (direct, _) = folder.done("mesh --mesh-preset coarse --out direct.vtu");
    for name in ["skin:", "subcutaneous tissue:", "nail:"] {
        assert_eq!(region(&printed, name), region(&direct, name));
    }
    folder.done("mesh --imported deck.inp --out again.inp");
}

#[test]
fn a_cause_is_printed_once() {
    let folder = Folder::new();
    for line in [
        "eval --path none.csv --out r.csv",
        "eval --model none.fpm --path none.csv --out r.csv",
        "mesh --imported none.msh --out r.vtu",
        "diagnose --table none.csv --out d",
        "build --config none.toml",
    ] {
        let (code, _, stderr) = folder.run(line);
        let counts = (stderr.matches("No such file").count(), stderr.lines().count());
        assert_eq!((code, counts), (Some(2), (1, 1)), "{line}: {stderr}");
    }
}

#[test]
fn a_run_shows_its_progress_where_there_is_no_terminal() {
    let folder = Folder::with(&[("p.csv", &format!("{HEAD}0,0,0,0\n1,1.5,0,0\n9,1.5,60,0\n19,1.5,-60,0\n"))]);
    let mut child = folder.command("simulate --path p.csv --mesh-preset default --out r.csv").spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let line = lines.find(|line| line.contains("increment")).expect("a line of the progress");
    assert!(line.starts_with("simulate: ") && line.contains(" %, increment "), "{line}");
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Waits until a program has worked for so long, however busy the machine is; without `/proc` for so long by the clock.
#[cfg(unix)]
fn after_cpu_s(child: &Child, cpu_s: f64) {
    let used_s = || -> Option<f64> {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
        // User and system time in hundredths of a second, 12 and 13 fields after the name in brackets.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks: Option<f64> = fields.get(11..13)?.iter().map(|field| field.parse::<f64>().ok()).sum();
        Some(0.01 * ticks?)
    };
    let began = Instant::now();
    while used_s().unwrap_or_else(|| began.elapsed().as_secs_f64()) < cpu_s && began.elapsed() < Duration::from_secs(60)
    {
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Reads standard output up to the end of a text.
#[cfg(unix)]
fn read_up_to(child: &mut Child, text: &str) {
    let mut read = String::new();
    let mut bytes = BufReader::new(child.stdout.as_mut().unwrap()).bytes();
    while !read.ends_with(text) {
        read.push(bytes.next().unwrap_or_else(|| panic!("{read}")).unwrap().into());
    }
}

/// Every long command ends with 130 soon after an interruption; `finger` finds the shipped runs from any folder.
#[test]
#[cfg(unix)]
fn signals_end_every_long_command_soon() {
    let folder = Folder::with(&[("c.csv", &fe_set("calibration_d")), ("m.csv", &fe_set("set_17"))]);
    folder.write("p.csv", format!("{HEAD}0,0,0,0\n1,1.5,0,0\n3,1.5,60,0\n"));
    for (name, line) in [
        ("-TERM", "simulate --path p.csv --mesh-preset default --out r.csv"),
        ("-INT", "finger --design stored --only bed --out made"),
        ("-TERM", "diagnose --calibration c.csv --measured m.csv --confirm-fe --out d"),
        ("-INT", "identify --mesh-preset coarse --out id --jobs 1"),
        ("-TERM", "phantom --voxels 800 700 700 --out p.nrrd"),
        ("-INT", "finger --design full --mesh-preset coarse --out all --jobs 1"),
    ] {
        let mut child = folder.command(line).spawn().unwrap();
        if line.contains("stored") {
            read_up_to(&mut child, "262 runs of settings");
        }
        after_cpu_s(&child, 0.5);
        assert!(child.try_wait().unwrap().is_none(), "{line} ended by itself");
        let asked = Instant::now();
        signal(&child, name);
        let (code, stdout, stderr) = ended(child);
        let took = asked.elapsed();
        assert_eq!(code, Some(130), "{line}: {stdout}{stderr}");
        assert!(stderr.contains("interrupted"), "{stderr}");
        // A second where nothing else runs.
        assert!(took < Duration::from_secs(10), "{line}: {took:?}");
    }
    for unfinished in ["r.csv", "made/model.fpm", "id/report.html", "p.nrrd"] {
        assert!(!folder.exists(unfinished), "{unfinished}");
    }
    let names = folder.names("");
    assert!(!names.iter().any(|name| name.starts_with(".partial")), "{names:?}");
}
