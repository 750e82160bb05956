//! Typical mistakes of a new user: places of outputs, units, missing settings; progress and interruption.

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _},
    path::Path,
    process::{Child, Command},
    time::{Duration, Instant},
};

use crate::common::{fingerpad, refused, run, write};

fn done(arguments: &[&str], folder: &Path) -> (String, String) {
    let (code, stdout, stderr) = run(arguments, folder);
    assert_eq!(code, Some(0), "{arguments:?}: {stdout}{stderr}");
    (stdout, stderr)
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

const TABLE: &str = include_str!("../../data/yoshida2011.csv");
const HEAD: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm\n";

/// A path that presses to `depth` and slides by `slide`.
fn path(depth: &str, slide: &str) -> String {
    format!("{HEAD}0,0,0,0\n1,{depth},0,0\n3,{depth},{slide},0\n")
}

#[test]
fn an_output_never_overwrites_an_input() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let text = path("1", "1");
    write(at, "p.csv", &text);
    write(at, "r.partial.csv", &text);
    write(at, "c.toml", "mesh_preset = \"coarse\"\n");
    for (arguments, message) in [
        (&["eval", "--path", "p.csv", "--out", "p.csv"][..], &["--out p.csv", "overwrite", "--path"][..]),
        (&["eval", "--path", "p.csv", "--out", "./new/../p.csv"], &["p.csv", "--path"]),
        (&["simulate", "--path", "p.csv", "--config", "c.toml", "--out", "p.csv"], &["overwrite", "--path"]),
        (&["simulate", "--path", "p.csv", "--config", "c.toml", "--out", "c.toml"], &["overwrite", "--config"]),
        // Where an interrupted run would keep its rows.
        (&["simulate", "--path", "r.partial.csv", "--config", "c.toml", "--out", "r.csv"], &["r.partial.csv"]),
        (&["mesh", "--config", "c.toml", "--out", "m.vtu", "--picture", "m.vtu"], &["--picture m.vtu", "--out"]),
        (&["build", "--table", "p.csv", "--config", "c.toml", "--out", "p.csv"], &["p.csv"]),
    ] {
        fs::create_dir_all(at.join("new")).unwrap();
        refused(arguments, at, message);
        assert_eq!(fs::read_to_string(at.join("p.csv")).unwrap(), text, "{arguments:?}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("p.csv", at.join("link.csv")).unwrap();
        refused(&["eval", "--path", "link.csv", "--out", "p.csv"], at, &["--out p.csv", "link.csv"]);
        refused(&["eval", "--path", "p.csv", "--out", "link.csv"], at, &["--out link.csv", "p.csv"]);
    }
    done(&["mesh", "--config", "c.toml", "--out", "m.inp"], at);
    let mesh = fs::read(at.join("m.inp")).unwrap();
    refused(&["mesh", "--imported", "m.inp", "--out", "m.inp"], at, &["--out m.inp", "--imported"]);
    assert_eq!(fs::read(at.join("m.inp")).unwrap(), mesh);
    done(&["export", "--format", "json", "--out", "model.json"], at);
    fs::write(at.join("model.fpm"), include_bytes!("../../data/models/fingertip.fpm")).unwrap();
    let itself = ["export", "--model", "model.fpm", "--format", "c", "--out", "model.fpm"];
    refused(&itself, at, &["--out model.fpm", "--model"]);
    // A folder of results that holds an input under a name of the result.
    fs::create_dir(at.join("id")).unwrap();
    write(at, "id/calibrated.toml", "mesh_preset = \"coarse\"\n");
    let itself = ["identify", "--config", "id/calibrated.toml", "--out", "id"];
    refused(&itself, at, &["--out id", "calibrated.toml", "--config"]);
}

#[test]
fn places_that_cannot_be_written_are_refused_before_computing() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "p.csv", &path("1", "40"));
    write(at, "t.csv", TABLE);
    fs::create_dir(at.join("folder.csv")).unwrap();
    let start = Instant::now();
    let simulate = ["simulate", "--path", "p.csv"];
    for (more, message) in [
        (&["--out", "folder.csv"][..], &["--out folder.csv", "is a folder"][..]),
        (&["--out", "p.csv/r.csv"], &["--out p.csv/r.csv", "cannot be"]),
        (&["--out", "r.csv", "--vtu", "t.csv"], &["--vtu t.csv", "is a file"]),
        (&["--out", "r.csv", "--vtu", "t.csv/fields"], &["--vtu t.csv/fields", "cannot be made"]),
        (&["--out", "r.csv", "--report", "t.csv"], &["--report t.csv", "is a file"]),
        (&["--out", "r.csv", "--report", "d", "--map-rows", "2,4"], &["--map-rows 4", "p.csv", "rows 1 to 3"]),
        (&["--out", "r.csv", "--report", "d", "--map-rows", "0"], &["--map-rows 0", "rows 1 to 3"]),
        (&["--out", "r.csv", "--report", "d", "--map-rows", "last"], &["--map-rows", "last"]),
        (&["--out", "r.csv", "--map-rows", "2"], &["--report <DIR>"]),
    ] {
        refused(&[&simulate[..], more].concat(), at, message);
    }
    for arguments in [
        &["build", "--out", "t.csv/out"][..],
        &["build", "--fit", "--runs", "none", "--out", "out"],
        &["identify", "--out", "t.csv/out"],
        &["diagnose", "--table", "t.csv", "--out", "t.csv/out"],
        &["diagnose", "--table", "t.csv", "--out", "d", "--report", "t.csv/r.json"],
        &["reduce", "--design", "--runs", "t.csv/runs"],
        &["reduce", "--out", "t.csv/model.fpm"],
        &["phantom", "--out", "t.csv/p.nrrd"],
        &["mesh", "--out", "m.vtu", "--picture", "t.csv/p.png"],
    ] {
        let (code, _, stderr) = run(arguments, at);
        assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
        assert!(!stderr.contains(".partial"), "{stderr}");
    }
    // Every one of these would compute for seconds to minutes.
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    assert!(!at.join("r.csv").exists() && !at.join("m.vtu").exists());
}

#[test]
fn missing_folders_are_made_and_an_older_series_goes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "p.csv", &format!("{HEAD}0,0,0,0\n1,0.3,0,0\n2,0.3,0.05,0\n"));
    write(at, "c.toml", "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n");
    let simulate = |path: &str| {
        let (out, fields) = ("new/deep/r.csv", "more/fields");
        done(&["simulate", "--path", path, "--config", "c.toml", "--out", out, "--vtu", fields], at);
        names(&at.join(fields))
    };
    let three = simulate("p.csv");
    assert_eq!(three.len(), 7, "{three:?}");
    write(at, "more/fields/mine.vtu", "");
    write(at, "two.csv", &format!("{HEAD}0,0,0,0\n1,0.3,0,0\n"));
    let two = ["mine.vtu", "r.pvd", "r_0000.vtu", "r_0001.vtu", "r_pad_0000.vtu", "r_pad_0001.vtu"];
    assert_eq!(simulate("two.csv"), two);
    done(&["eval", "--path", "p.csv", "--out", "eval/r.csv"], at);
}

#[test]
fn a_response_is_drawn_also_where_the_run_ends_early() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.toml", "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n");
    write(at, "p.csv", &format!("{HEAD}0,0,0,0\n1,0.3,0,0\n2,0.3,0.1,0\n3,0.3,0.05,0\n4,-0.1,0.05,0\n"));
    let simulate = ["simulate", "--path", "p.csv", "--config", "c.toml", "--out", "new/r.csv", "--report", "new"];
    let (printed, _) = done(&simulate, at);
    assert!(printed.contains("new/report.html"), "{printed}");
    let maps = || names(&at.join("new/figures")).into_iter().filter(|name| name.ends_with("_pressure.png")).count();
    // The end of the press, the turn, the last row that presses.
    assert_eq!(maps(), 3);
    let page = fs::read_to_string(at.join("new/report.html")).unwrap();
    assert!(page.contains("href=\"r.csv\"") && page.contains("friction_while_pressing = true"));
    done(&[&simulate[..], &["--map-rows", "3", "--vtu", "fields"]].concat(), at);
    assert_eq!(maps(), 1, "the maps of the earlier report go");
    let report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("new/report.json")).unwrap()).unwrap();
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
        write(at, "p.csv", path);
        let (code, _, stderr) = run(&simulate, at);
        assert!(code == Some(3) && stderr.contains("rows kept in new/r.partial.csv"), "{code:?} {stderr}");
        assert!(stderr.contains("row 2 drives") && stderr.contains(message), "{stderr}");
        let rows = fs::read_to_string(at.join("new/r.partial.csv")).unwrap();
        assert!(rows.lines().count() > 5, "{rows}");
    }
    let page = fs::read_to_string(at.join("new/report.html")).unwrap();
    assert!(page.contains("The run ended before its path did") && page.contains("href=\"r.partial.csv\""));
}

#[test]
fn a_folder_holds_one_result_and_foreign_files_stay() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "t.csv", TABLE);
    let diagnose = ["diagnose", "--table", "t.csv", "--mesh-preset", "coarse", "--out", "d"];
    done(&diagnose, at);
    let first = names(&at.join("d"));
    // As if an earlier diagnosis had named an effect.
    let list = fs::read_to_string(at.join("d/files.txt")).unwrap();
    write(at, "d/files.txt", &list.replace("table.png", "table.png\ncorrected.fpm\nmap_after.png\n../t.csv"));
    for old in ["corrected.fpm", "map_after.png", "mine.png"] {
        write(at, &format!("d/{old}"), "");
    }
    done(&diagnose, at);
    let mut expected = first;
    expected.push("mine.png".into());
    expected.sort();
    assert_eq!(names(&at.join("d")), expected);
    assert!(at.join("t.csv").exists(), "a list never leads out of its folder");

    fs::create_dir(at.join("e")).unwrap();
    write(at, "e/report.html", "mine");
    refused(&["diagnose", "--table", "t.csv", "--out", "e"], at, &["e/report.html", "files.txt"]);
    assert_eq!(fs::read_to_string(at.join("e/report.html")).unwrap(), "mine");

    write(at, "d/mine.csv", TABLE);
    done(&["diagnose", "--table", "d/mine.csv", "--mesh-preset", "coarse", "--out", "d"], at);
    fs::copy(at.join("t.csv"), at.join("d/next_experiment.csv")).unwrap();
    refused(&["diagnose", "--table", "d/next_experiment.csv", "--out", "d"], at, &["--out d", "next_experiment.csv"]);

    // A folder of a build is not one of an identification.
    fs::create_dir(at.join("b")).unwrap();
    write(at, "b/run.json", "{\"settings_hash\": \"0\", \"program_version\": \"0\", \"config\": {}}");
    let (code, _, stderr) = run(&["identify", "--mesh-preset", "coarse", "--out", "b"], at);
    assert!(code == Some(2) && stderr.contains("not a folder of this command"), "{stderr}");
}

#[test]
fn material_constants_that_are_left_out_keep_their_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let settings = |text: &str| -> toml::Value {
        write(at, "s.toml", text);
        toml::from_str(&done(&["build", "--config", "s.toml", "--print-config"], at).0).unwrap()
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
    write(at, "s.toml", "[tissue.skin]\nmu = 0.05\n");
    refused(&["build", "--config", "s.toml", "--print-config"], at, &["s.toml", "line 2", "mu", "mu_mpa"]);
}

#[test]
fn eval_reports_its_flags_and_requires_units() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (text, message) in [
        (
            path("50", "4"),
            &["depth_above_range in 491 of 543 rows", "row 53 of the response", "(5.1360 mm)", "micrometres"][..],
        ),
        (path("0.001", "0.004"), &["0.001", "in metres"]),
        (path("-1", "4"), &["no row touches", "0 at most", "sign"]),
        (
            format!("{}0,0,0,0\n1,0.2,0,0\n3,0.2,9,0\n", HEAD.replace("slide", "friction").replace("_y_mm", "_y_n"))
                .replace("friction_x_mm", "friction_x_n"),
            &["load_not_reached in", "out of reach"],
        ),
    ] {
        write(at, "p.csv", &text);
        let (_, stderr) = done(&["eval", "--path", "p.csv", "--out", "r.csv"], at);
        for part in message {
            assert!(stderr.contains(part), "no `{part}` in: {stderr}");
        }
    }
    write(at, "p.csv", &path("1", "4"));
    assert_eq!(done(&["eval", "--path", "p.csv", "--out", "r.csv"], at).1, "");
}

#[test]
fn absurd_sizes_are_answered_in_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let start = Instant::now();
    let eval = ["eval", "--path", "p.csv", "--out", "r.csv"];
    write(at, "p.csv", &path("1", "1e6"));
    refused(&eval, at, &["p.csv", "data row 3", "slide_x_mm 1000000 mm: at most 1000 mm"]);
    let there_and_back: String =
        (1..60).map(|t| format!("{t},1,{},0\n", if t % 2 == 0 { -900 } else { 900 })).collect();
    write(at, "p.csv", &format!("{HEAD}0,1,0,0\n{there_and_back}"));
    refused(&eval, at, &["p.csv", "5.3e6 steps", "at most 1e6", "divide it"]);
    let voxels = ["phantom", "--voxels", "100000", "100000", "100000", "--out", "p.nrrd"];
    refused(&voxels, at, &["--voxels 100000 100000 100000", "1.00e15 voxels", "5e8"]);
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    assert!(!at.join("r.csv").exists() && !at.join("p.nrrd").exists());
}

#[test]
fn our_own_deck_is_imported_without_its_plane() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(&["mesh", "--mesh-preset", "coarse", "--deck", "--out", "deck.inp"], at);
    let (printed, _) = done(&["mesh", "--imported", "deck.inp", "--out", "back.vtu"], at);
    assert!(printed.contains("the plane (1 element(s) of the set PLANE)"), "{printed}");
    assert!(printed.contains("0 elements turned") && printed.contains("0 nodes merged"), "{printed}");
    let region = |text: &str, name: &str| text.lines().find(|l| l.trim_start().starts_with(name)).unwrap().to_owned();
    let (direct, _) = done(&["mesh", "--mesh-preset", "coarse", "--out", "direct.vtu"], at);
    for name in ["skin:", "subcutaneous:", "nail:"] {
        assert_eq!(region(&printed, name), region(&direct, name));
    }
    done(&["mesh", "--imported", "deck.inp", "--out", "again.inp"], at);
}

#[test]
fn a_cause_is_printed_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for arguments in [
        &["eval", "--path", "none.csv", "--out", "r.csv"][..],
        &["eval", "--model", "none.fpm", "--path", "none.csv", "--out", "r.csv"],
        &["mesh", "--imported", "none.msh", "--out", "r.vtu"],
        &["diagnose", "--table", "none.csv", "--out", "d"],
        &["build", "--config", "none.toml"],
    ] {
        let (code, _, stderr) = run(arguments, at);
        assert_eq!(code, Some(2), "{stderr}");
        assert_eq!(stderr.matches("No such file").count(), 1, "{arguments:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    }
}

/// Waits for a line on standard error that `wanted` accepts.
fn wait_for_line(child: &mut Child, wanted: impl Fn(&str) -> bool) -> String {
    let mut seen = String::new();
    for line in BufReader::new(child.stderr.take().unwrap()).lines() {
        let line = line.unwrap();
        if wanted(&line) {
            return line;
        }
        seen += &(line + "\n");
    }
    panic!("it ended without the line: {seen}");
}

#[test]
fn a_run_shows_its_progress_where_there_is_no_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "p.csv", &format!("{HEAD}0,0,0,0\n1,1.5,0,0\n9,1.5,60,0\n19,1.5,-60,0\n"));
    let mut child =
        fingerpad(&["simulate", "--path", "p.csv", "--mesh-preset", "default", "--out", "r.csv"], at).spawn().unwrap();
    let line = wait_for_line(&mut child, |line| line.contains("increment"));
    assert!(line.starts_with("simulate: ") && line.contains(" %, increment "), "{line}");
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Unpacks a stored set of the finite-element finger.
fn unpack(name: &str, folder: &Path, file: &str) {
    let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fe_sets").join(format!("{name}.csv.gz"));
    let mut text = String::new();
    flate2::read::GzDecoder::new(fs::File::open(packed).unwrap()).read_to_string(&mut text).unwrap();
    write(folder, file, &text);
}

/// Every long command ends with 130 soon after an interruption; `reduce` finds the shipped runs from any folder.
#[test]
#[cfg(unix)]
fn signals_end_every_long_command_within_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    unpack("calibration_d", at, "c.csv");
    unpack("set_17", at, "m.csv");
    write(at, "p.csv", &path("1.5", "60"));
    for (signal, arguments) in [
        ("-TERM", &["simulate", "--path", "p.csv", "--mesh-preset", "default", "--out", "r.csv"][..]),
        ("-INT", &["reduce", "--out", "model.fpm"]),
        ("-TERM", &["diagnose", "--calibration", "c.csv", "--measured", "m.csv", "--confirm-fe", "--out", "d"]),
        ("-INT", &["identify", "--mesh-preset", "coarse", "--out", "id", "--jobs", "1"]),
        ("-TERM", &["phantom", "--voxels", "800", "700", "700", "--out", "p.nrrd"]),
        ("-INT", &["reduce", "--design", "--mesh-preset", "coarse", "--runs", "runs", "--jobs", "1"]),
    ] {
        let mut child = fingerpad(arguments, at).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(700));
        assert!(child.try_wait().unwrap().is_none(), "{arguments:?} ended by itself");
        let asked = Instant::now();
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let took = asked.elapsed();
        let [stdout, stderr] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
        assert_eq!(output.status.code(), Some(130), "{arguments:?}: {stdout}{stderr}");
        assert!(stderr.contains("interrupted"), "{stderr}");
        // A second, and one more for a machine that is busy with other tests.
        assert!(took < Duration::from_secs(2), "{arguments:?}: {took:?}");
        if arguments[..2] == ["reduce", "--out"] {
            assert!(stdout.contains("262 runs of settings"), "{stdout}");
        }
    }
    for unfinished in ["r.csv", "model.fpm", "id/report.html", "p.nrrd"] {
        assert!(!at.join(unfinished).exists(), "{unfinished}");
    }
    assert!(!names(at).iter().any(|name| name.starts_with(".partial")), "{:?}", names(at));
}
