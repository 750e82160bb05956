//! `build` and standard streams: files kept after an interruption, a full disk, a reader that goes away.

use std::fs;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::{Folder, ended, signal};

const QUICK: &str = "mesh_preset = \"coarse\"\n[experiment]\ndepths_mm = [0.4, 0.6, 0.8]\nslide_mm = 1.5\n";

#[test]
#[cfg(unix)]
fn a_full_disk_leaves_nothing_that_looks_finished() {
    let folder = Folder::new();
    // A limit on the size of files simulates a full disk.
    let program = env!("CARGO_BIN_EXE_fingerpad");
    let mesh = format!("ulimit -f 1; trap '' XFSZ; exec {program} mesh --mesh-preset coarse --out m.vtu");
    let output = Command::new("sh").args(["-c", &mesh]).current_dir(folder.path("")).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("m.vtu"), "{stderr}");
    assert_eq!(folder.names(""), [""; 0], "nothing half-written");
}

/// Number of pieces that a build has finished.
fn finished(folder: &Folder) -> usize {
    folder.names("out/runs").iter().filter(|name| name.ends_with(".bin")).count()
}

/// Starts a build of three depths on one thread and waits for its first finished piece.
fn half_a_build(folder: &Folder) -> Child {
    let mut child = folder.command("build --config quick.toml --jobs 1").spawn().unwrap();
    let start = Instant::now();
    while finished(folder) == 0 {
        assert!(child.try_wait().unwrap().is_none(), "the build ended by itself");
        assert!(start.elapsed() < Duration::from_secs(300), "no piece is finished");
        std::thread::park_timeout(Duration::from_millis(5));
    }
    child
}

/// The report without the values that differ from run to run.
fn numbers(folder: &Folder) -> Value {
    let mut report = folder.json("out/report.json");
    strip_times(&mut report);
    report
}

fn strip_times(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|key, _| !key.ends_with("wall_s") && !key.ends_with("cpu_s"));
            map.values_mut().for_each(strip_times);
        }
        Value::Array(list) => list.iter_mut().for_each(strip_times),
        _ => {}
    }
}

#[test]
fn a_killed_build_goes_on_where_it_was_and_refuses_other_settings() {
    let folder = Folder::with(&[("quick.toml", QUICK), ("other.toml", &QUICK.replace("1.5", "1.6"))]);
    let mut child = half_a_build(&folder);
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = finished(&folder);
    assert!((1..4).contains(&kept), "{kept} pieces were finished");
    assert!(!folder.exists("out/report.html"));

    let (stdout, _) = folder.done("build --config quick.toml");
    assert!(stdout.contains(&format!("{kept} of 4 pieces were finished before")), "{stdout}");
    let resumed = numbers(&folder);

    fs::remove_dir_all(folder.path("out")).unwrap();
    let (stdout, _) = folder.done("build --config quick.toml");
    assert!(!stdout.contains("finished before"), "{stdout}");
    assert_eq!(resumed, numbers(&folder));

    folder.refused("build --config other.toml", &["out", "other settings"]);
    assert_eq!(resumed, numbers(&folder), "the refused run changed the folder");
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_build_with_130_and_keeps_finished_depths() {
    let folder = Folder::with(&[("quick.toml", QUICK)]);
    let child = half_a_build(&folder);
    signal(&child, "-INT");
    let (code, _, stderr) = ended(child);
    assert_eq!(code, Some(130), "{stderr}");
    assert!(stderr.contains("kept"), "{stderr}");
    assert!(finished(&folder) >= 1);
}

/// `fingerpad ... | head -1`: output to a closed pipe is dropped, the work continues.
#[test]
fn a_reader_that_goes_away_ends_nothing() {
    let folder = Folder::new();
    let mut child = folder.command("mesh --mesh-preset coarse --out m.vtu").spawn().unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(folder.exists("m.vtu"));

    // The reader closes the pipe in the middle of a line.
    let mut child = folder.command("build --print-config").spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));

    #[cfg(target_os = "linux")]
    {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let (code, _, stderr) = ended(folder.command("build --print-config").stdout(full).spawn().unwrap());
        assert!(code == Some(2) && stderr.contains("standard output"), "{stderr}");
    }
}

#[test]
fn a_build_compares_the_shipped_model_with_its_runs_and_fits_none() {
    let folder = Folder::with(&[("quick.toml", QUICK)]);
    let build = |name: &str| folder.done(&format!("build --config {name}.toml --out {name}")).0;
    let printed = build("quick");
    let shipped = "reduced model fingertip.fpm (shipped)";
    assert!(printed.contains(shipped) && !printed.contains("another mesh"), "{printed}");
    assert!(!folder.exists("quick/model.fpm") && !printed.contains("fit"), "{printed}");
    let report = folder.json("quick/report.json");
    let depths = report["reduced"]["depths"].as_array().unwrap();
    assert_eq!(depths.len(), 3);
    for (depth, depth_mm) in depths.iter().zip([0.4, 0.6, 0.8]) {
        assert_eq!(depth["depth_mm"], depth_mm);
        for quantity in ["normal_percent", "friction_percent"] {
            let [rms, largest] = [0, 1].map(|k| depth[quantity][k].as_f64().unwrap());
            // The model is of a finer mesh.
            assert!(rms > 0.0 && rms < 10.0 && largest >= rms && largest < 25.0, "{depth}");
        }
    }
    assert!(folder.text("quick/report.html").contains("Reduced model fingertip.fpm"));
    assert!(build("quick").contains("4 of 4 pieces were finished before"));

    // Another friction law is another finger; other numerics are not.
    let one = QUICK.replace("[0.4, 0.6, 0.8]", "[0.4]");
    folder.write("law.toml", format!("{one}[friction]\nlambda = 0.3\n"));
    let printed = build("law");
    assert!(printed.contains("the reduced model that ships is of another finger"), "{printed}");
    assert!(folder.json("law/report.json")["reduced"].is_null());
    folder.write("numerics.toml", format!("{one}[numerics.solver]\nmax_iterations = 60\n"));
    assert!(build("numerics").contains(shipped));
}

#[test]
fn estimates_count_cores() {
    let folder = Folder::new();
    let (stdout, _) = folder.done("finger --mesh-preset coarse --out f --estimate --jobs 1000");
    assert!(folder.names("").is_empty(), "an estimate leaves nothing");
    let cores = std::thread::available_parallelism().unwrap().get();
    assert!(!stdout.contains(" 0 s") && stdout.contains(&format!("of {cores} cores")), "{stdout}");
}

/// A tip of other sizes than the shipped finger's: every path is within its reach.
#[test]
fn the_silicone_tip_of_the_pages_is_estimated() {
    let folder = Folder::with(&[("silicone.toml", include_str!("../../data/silicone.toml"))]);
    let command = "finger --config silicone.toml --mesh-preset coarse --out tip --estimate";
    let (stdout, _) = folder.done(command);
    assert!(stdout.contains("21 paths"), "{stdout}");
    // Depths that a file states are kept, and refused where they lead into the core.
    folder.write("silicone.toml", folder.text("silicone.toml") + "[design]\ndeep_mm = [2.6, 5.1]\n");
    folder.refused(command, &["deep-00", "reaches the bone", "leave out the depths of [design]"]);
}
