//! `fingerpad diagnose --confirm-fe` that is stopped, by Ctrl-C and hard: finished strokes are not run again, and the
//! report is that of a run in one go.

#![cfg(unix)]

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};
use std::{fs, thread};

/// Unpacks a stored set of the finite-element finger.
fn unpack(name: &str, folder: &Path) -> String {
    let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fe_sets").join(format!("{name}.csv.gz"));
    let mut text = String::new();
    flate2::read::GzDecoder::new(fs::File::open(packed).unwrap()).read_to_string(&mut text).unwrap();
    let file = format!("{name}.csv");
    fs::write(folder.join(&file), text).unwrap();
    file
}

fn diagnose(folder: &Path, out: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_fingerpad"))
        .args(["diagnose", "--calibration", "calibration_d.csv", "--measured", "set_17.csv"])
        .args(["--confirm-fe", "--fe-strokes", "2", "--shape", "d", "--out", out])
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Finished strokes with the time of their writing.
fn strokes(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let Ok(entries) = fs::read_dir(folder.join("fe")) else { return BTreeMap::new() };
    let files = entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "json"));
    files.map(|p| (p.clone(), fs::metadata(&p).unwrap().modified().unwrap())).collect()
}

fn wait_for(child: &mut Child, folder: &Path, least: usize) {
    let start = Instant::now();
    while strokes(folder).len() < least {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself with {} strokes", strokes(folder).len());
        assert!(start.elapsed() < Duration::from_secs(900), "no stroke is finished");
        thread::park_timeout(Duration::from_millis(5));
    }
}

fn report(folder: &Path) -> serde_json::Value {
    let mut report: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("report.json")).unwrap()).unwrap();
    report.as_object_mut().unwrap().remove("elapsed_s").expect("a time");
    report
}

fn ended(child: Child) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = child.wait_with_output().unwrap();
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn a_stopped_confirmation_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    unpack("calibration_d", at);
    unpack("set_17", at);
    let (half, whole) = (at.join("half"), at.join("whole"));

    let mut child = diagnose(at, "half");
    wait_for(&mut child, &half, 1);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let (code, stderr) = ended(child);
    assert_eq!(code, Some(130), "{stderr}");
    assert!(stderr.contains("finished strokes are kept in half/fe"), "{stderr}");
    let first = strokes(&half);
    assert!(report(&half)["fe_confirmation"].is_null(), "the report is written without the confirmation");
    assert!(half.join("report.html").exists() && half.join("corrected.fpm").exists());

    let mut child = diagnose(at, "half");
    wait_for(&mut child, &half, first.len() + 1);
    child.kill().unwrap();
    child.wait().unwrap();
    let second = strokes(&half);
    let (code, stderr) = ended(diagnose(at, "half"));
    assert_eq!(code, Some(0), "{stderr}");
    let last = strokes(&half);
    for (file, written) in first.iter().chain(&second) {
        assert_eq!(last.get(file), Some(written), "{} was run again", file.display());
    }

    let (code, stderr) = ended(diagnose(at, "whole"));
    assert_eq!(code, Some(0), "{stderr}");
    let names =
        |folder: &Path| -> Vec<_> { strokes(folder).into_keys().map(|p| p.file_name().unwrap().to_owned()).collect() };
    assert_eq!(names(&half), names(&whole));
    assert!(last.len() > second.len() && second.len() > first.len());
    assert!(report(&whole)["fe_confirmation"]["runs"].is_array());
    assert_eq!(report(&half), report(&whole));
}
