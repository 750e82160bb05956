//! The program on its command line: refused inputs with their messages, and the files kept after an interruption.

use std::{
    fs,
    path::Path,
    process::{Child, Command},
    time::{Duration, Instant},
};

use crate::common::{fingerpad, refused, run, write};

const PATH: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,0.5,0,0\n2,0.5,0.4,0\n";
const QUICK: &str = "mesh_preset = \"coarse\"\n[experiment]\ndepths_mm = [0.4, 0.6, 0.8]\nslide_mm = 1.5\n";

#[test]
fn configurations_are_refused_with_file_line_and_value() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (text, expected) in [
        ("mesh_preset = \"coarse\"\nlambda = 3\n", &["bad.toml", "line 2", "lambda"][..]),
        ("[friction]\nlambda = -0.1\n", &["bad.toml", "line 2", "-0.1"]),
        ("[friction]\ngamma_crit_mm = nan\n", &["bad.toml", "line 2", "NaN"]),
        ("[friction]\ngamma_crit_m = 6e-6\n", &["bad.toml", "line 2", "gamma_crit_m"]),
        ("[tissue.skin]\nmu_mpa = 0\n", &["bad.toml", "line 2", "0"]),
        ("mesh_preset = \"dense\"\n", &["bad.toml", "line 1", "dense", "coarse"]),
        ("[tissue.skin]\nkind = \"elastic\"\nyoung_mpa = 0.1\npoisson = 0.5\n", &["bad.toml", "line 4", "0.5"]),
        ("[tissue.skin]\nkind = \"neo_hooke\"\nmu_mpa = 0.1\nd_per_mpa = 1\nalpha = 2\n", &["bad.toml", "alpha = 2"]),
        (
            "[tissue.skin]\nkind = \"yeoh\"\nc10_mpa = 0.2\nc20_mpa = -0.1\nc30_mpa = 0\nd_per_mpa = 1\n",
            &["bad.toml", "line 1", "not stable (Drucker)", "from 0.5 to 2"],
        ),
        ("[tissue.regions.gel]\nmu_mpa = 0.1\nalpha = 2\npoisson = 0.4\n", &["tissue.regions.gel", "imported mesh"]),
        ("[experiment]\ndepths_mm = [0.5, nan]\n", &["depths_mm", "NaN"]),
        ("[experiment]\ndepths_mm = [0.5, 25.0]\n", &["depths_mm", "25 mm reaches the held section"]),
        ("[experiment]\ndepths_mm = [1.0, 0.5]\n", &["depths_mm", "0.5"]),
        ("shape = \"zz\"\n", &["zz"]),
        ("shape = \"none.toml\"\n", &["none.toml"]),
    ] {
        write(at, "bad.toml", text);
        refused(&["build", "--config", "bad.toml", "--mesh-preset", "coarse"], at, expected);
        assert!(!at.join("out/report.html").exists(), "{text}");
    }
    refused(&["build", "--config", "missing.toml"], at, &["missing.toml"]);
}

#[test]
fn geometry_files_are_refused_with_file_line_and_value() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shape = include_str!("../../data/geometry/a.toml");
    for (from, to, expected) in [
        (
            "skin_thickness_mm = 0.5",
            "skin_thickness_mm = -0.5",
            &["f.toml", "line 18", "skin_thickness_mm", "-0.5"][..],
        ),
        ("skin_thickness_mm = 0.5", "skin_thickness_m = 0.0005", &["f.toml", "skin_thickness_m"]),
        ("\nlength_mm = 25.0", "\nlength_mm = 2.5", &["f.toml", "line", "length_mm"]),
    ] {
        assert!(shape.contains(from));
        write(at, "f.toml", &shape.replacen(from, to, 1));
        refused(&["mesh", "--shape", "f.toml", "--out", "f.vtu"], at, expected);
        assert!(!at.join("f.vtu").exists());
    }
}

#[test]
fn paths_and_tables_are_refused_with_file_line_column_and_value() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let header = "t_s,depth_mm,slide_x_mm,slide_y_mm\n";
    for (text, expected) in [
        ("", &["p.csv"][..]),
        (header, &["p.csv"]),
        ("t_s,depth_mm,slide_x_mm\n0,0,0\n1,1,0\n", &["p.csv", "slide_y_mm"]),
        ("t_s,depth_m,slide_x_mm,slide_y_mm\n0,0,0,0\n1,1,0,0\n", &["p.csv", "depth_m"]),
        (&format!("{header}0,0,0,0\n1,nan,0,0\n"), &["p.csv", "3", "depth_mm", "nan"]),
        (&format!("{header}0,0,0,0\n1,1e3x,0,0\n"), &["p.csv", "3", "depth_mm", "1e3x"]),
        (&format!("{header}0,0,0,0\n1,1,0\n"), &["p.csv", "3"]),
        (&format!("{header}0,0,0,0\n1,1,0,0\n1,1,1,0\n"), &["p.csv", "4", "t_s"]),
        (&format!("{header}0,0,0,0\n1,20,0,0\n"), &["p.csv", "20", "held section"]),
    ] {
        write(at, "p.csv", text);
        refused(&["simulate", "--path", "p.csv", "--mesh-preset", "coarse", "--out", "r.csv"], at, expected);
        assert!(!at.join("r.csv").exists());
    }
    write(at, "t.csv", "depth_mm,normal_force_n,friction_coefficient,contact_area_mm2\n0.5,-1,2,40\n");
    refused(&["build", "--table", "t.csv", "--mesh-preset", "coarse"], at, &["t.csv", "2", "normal_force_n", "-1"]);
    refused(&["simulate", "--path", "p.csv", "--out", "r.csv", "--lambda", "NaN"], at, &["lambda", "NaN"]);
    refused(&["simulate", "--out", "r.csv"], at, &["--path"]);
}

#[test]
fn a_solve_that_does_not_converge_says_where_and_keeps_what_it_reached() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "p.csv", PATH);
    write(at, "hard.toml", "mesh_preset = \"coarse\"\n[numerics.solver]\nmax_iterations = 1\n");
    let (code, _, stderr) = run(&["simulate", "--path", "p.csv", "--config", "hard.toml", "--out", "r.csv"], at);
    assert_eq!(code, Some(3), "{stderr}");
    for part in ["increment", "residual", "tolerance", "depth"] {
        assert!(stderr.contains(part), "no `{part}` in: {stderr}");
    }
    assert!(!at.join("r.csv").exists());
    assert!(at.join("r.partial.csv").exists(), "{stderr}");
}

#[test]
#[cfg(unix)]
fn a_full_disk_leaves_nothing_that_looks_finished() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // A limit on the size of files simulates a full disk.
    let mesh = format!(
        "ulimit -f 1; trap '' XFSZ; exec {} mesh --mesh-preset coarse --out m.vtu",
        env!("CARGO_BIN_EXE_fingerpad")
    );
    let output = Command::new("sh").args(["-c", &mesh]).current_dir(at).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("m.vtu"), "{stderr}");
    assert_eq!(fs::read_dir(at).unwrap().count(), 0, "nothing half-written");
}

/// Pieces that a build has finished.
fn finished(at: &Path) -> usize {
    let is_piece = |entry: &fs::DirEntry| entry.path().extension().is_some_and(|e| e == "bin");
    fs::read_dir(at.join("out/runs")).map_or(0, |entries| entries.flatten().filter(is_piece).count())
}

/// Starts a build of three depths on one thread and waits for its first finished piece.
fn half_a_build(at: &Path) -> Child {
    write(at, "quick.toml", QUICK);
    let mut child = fingerpad(&["build", "--config", "quick.toml", "--jobs", "1"], at).spawn().unwrap();
    let start = Instant::now();
    while finished(at) == 0 {
        assert!(child.try_wait().unwrap().is_none(), "the build ended by itself");
        assert!(start.elapsed() < Duration::from_secs(300), "no piece is finished");
        std::thread::park_timeout(Duration::from_millis(5));
    }
    child
}

/// The report without the values that differ from run to run.
fn numbers(at: &Path) -> serde_json::Value {
    let mut report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("out/report.json")).unwrap()).unwrap();
    strip_times(&mut report);
    report
}

fn strip_times(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(map) => {
            map.retain(|key, _| !key.ends_with("wall_s") && !key.ends_with("cpu_s"));
            map.values_mut().for_each(strip_times);
        }
        serde_json::Value::Array(list) => list.iter_mut().for_each(strip_times),
        _ => {}
    }
}

#[test]
fn a_killed_build_goes_on_where_it_was_and_refuses_other_settings() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut child = half_a_build(at);
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = finished(at);
    assert!((1..4).contains(&kept), "{kept} pieces were finished");
    assert!(!at.join("out/report.html").exists());

    let (code, stdout, stderr) = run(&["build", "--config", "quick.toml"], at);
    assert_eq!(code, Some(0), "{stderr}");
    assert!(stdout.contains(&format!("{kept} of 4 pieces were finished before")), "{stdout}");
    let resumed = numbers(at);

    fs::remove_dir_all(at.join("out")).unwrap();
    let (code, stdout, _) = run(&["build", "--config", "quick.toml"], at);
    assert_eq!(code, Some(0));
    assert!(!stdout.contains("finished before"), "{stdout}");
    assert_eq!(resumed, numbers(at));

    write(at, "other.toml", &QUICK.replace("1.5", "1.6"));
    refused(&["build", "--config", "other.toml"], at, &["out", "other settings"]);
    assert_eq!(resumed, numbers(at), "the refused run changed the folder");
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_build_with_130_and_keeps_finished_depths() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let child = half_a_build(at);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("kept"), "{stderr}");
    assert!(finished(at) >= 1);
}

#[test]
fn every_command_explains_itself_with_examples() {
    let folder = tempfile::tempdir().unwrap();
    for command in ["build", "simulate", "mesh"] {
        let (code, stdout, _) = run(&[command, "--help"], folder.path());
        assert_eq!(code, Some(0));
        assert!(stdout.contains("Examples:") && stdout.contains(&format!("fingerpad {command}")), "{stdout}");
    }
}

/// `fingerpad ... | head -1`: output to a closed pipe is dropped, the work continues.
#[test]
fn a_reader_that_goes_away_ends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = fingerpad(&["mesh", "--mesh-preset", "coarse", "--out", "m.vtu"], folder.path()).spawn().unwrap();
    drop(child.stdout.take());
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(folder.path().join("m.vtu").exists());

    // The reader closes the pipe in the middle of a line.
    let mut child = fingerpad(&["build", "--print-config"], folder.path()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));

    #[cfg(target_os = "linux")]
    {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = fingerpad(&["build", "--print-config"], folder.path()).stdout(full).output().unwrap();
        let printed = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && printed.contains("standard output"), "{printed}");
    }
}

#[test]
fn a_build_compares_the_shipped_model_with_its_runs_and_fits_none() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "quick.toml", QUICK);
    let build = |config| {
        let (code, stdout, stderr) = run(&["build", "--config", config, "--out", config.trim_end_matches(".toml")], at);
        assert_eq!(code, Some(0), "{stderr}");
        stdout
    };
    let printed = build("quick.toml");
    assert!(
        printed.contains("reduced model fingertip.fpm (shipped)") && !printed.contains("another mesh"),
        "{printed}"
    );
    assert!(!at.join("quick/model.fpm").exists() && !printed.contains("fit"), "{printed}");
    let report = |folder: &str| -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(at.join(folder).join("report.json")).unwrap()).unwrap()
    };
    let depths = &report("quick")["reduced"]["depths"];
    assert_eq!(depths.as_array().unwrap().len(), 3);
    for (depth, depth_mm) in depths.as_array().unwrap().iter().zip([0.4, 0.6, 0.8]) {
        assert_eq!(depth["depth_mm"], depth_mm);
        for quantity in ["normal_percent", "friction_percent"] {
            let [rms, largest] = [0, 1].map(|k| depth[quantity][k].as_f64().unwrap());
            // The model is of a finer mesh.
            assert!(rms > 0.0 && rms < 10.0 && largest >= rms && largest < 25.0, "{depth}");
        }
    }
    assert!(fs::read_to_string(at.join("quick/report.html")).unwrap().contains("Reduced model fingertip.fpm"));
    assert!(build("quick.toml").contains("4 of 4 pieces were finished before"));

    // Another friction law is another finger; other numerics are not.
    write(at, "law.toml", &format!("{QUICK}[friction]\nlambda = 0.3\n"));
    let printed = build("law.toml");
    assert!(printed.contains("the reduced model that ships is of another finger"), "{printed}");
    assert!(report("law")["reduced"].is_null());
    write(at, "numerics.toml", &format!("{QUICK}[numerics.solver]\nmax_iterations = 60\n"));
    assert!(build("numerics.toml").contains("reduced model fingertip.fpm (shipped)"));
}

#[test]
fn numbers_of_threads_are_checked_and_estimates_count_cores() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for jobs in ["0", "1000000", "-1", "many"] {
        for command in [&["build"][..], &["reduce", "--design", "--runs", "r"], &["finger", "--out", "f"]] {
            let jobs = format!("--jobs={jobs}");
            refused(&[command, &["--mesh-preset", "coarse", &jobs]].concat(), at, &["--jobs", "from 1 to 1024"]);
        }
    }
    let finger = ["finger", "--mesh-preset", "coarse", "--out", "f", "--estimate", "--jobs", "1000"];
    let (code, stdout, stderr) = run(&finger, at);
    assert_eq!(code, Some(0), "{stderr}");
    let cores = std::thread::available_parallelism().unwrap().get();
    assert!(!stdout.contains(" 0 s") && stdout.contains(&format!("of {cores} cores")), "{stdout}");
}
