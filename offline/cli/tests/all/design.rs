//! `finger --design full`: a design that is killed, goes on in shares and is checked.

use std::fs;
use std::time::{Duration, Instant};

use fingerpad_reduce::Run;

use crate::common::Folder;

/// A design of few paths on the coarse mesh.
const FEW: &str = "mesh_preset = \"coarse\"\n[design]\naxis_depths_mm = [0.4]\ndepth_mm = [0.3, 0.6]\npose_depth_max_mm = 0.5\n\
    [design.paths]\npress = [1, 1]\nstraight = [0, 0]\nreversal = [0, 0]\nturn = [0, 0]\ndepth = [0, 0]\noblique = [0, 0]\n\
    random = [0, 0]\nvibration = [2, 0]\nspin = [1, 0]\nspin_slide = [0, 0]\nspin_reversal = [0, 0]\npose = [0, 0]\n\
    pose_change = [0, 0]\nforce = [0, 0]\nforce_step = [0, 0]\nwide_pose = [0, 0]\nwide_pose_change = [0, 0]\n";
const PATHS: usize = 9;

/// Names of the finished runs in a folder.
fn runs(folder: &Folder, inside: &str) -> Vec<String> {
    folder.names(inside).into_iter().filter(|name| name.ends_with(".fprun")).collect()
}

/// Runs finished before a kill are kept and not repeated; the shares divide the rest; a run does not depend on the
/// order of the runs.
#[test]
fn a_killed_design_goes_on_in_shares() {
    let folder = Folder::with(&[("few.toml", FEW)]);
    let design = "finger --design full --config few.toml --jobs 1 --out f --runs";
    let mut child = folder.command(&format!("{design} a")).spawn().unwrap();
    let started = Instant::now();
    while runs(&folder, "a").len() < 2 {
        assert!(started.elapsed() < Duration::from_secs(300), "no run after five minutes");
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = runs(&folder, "a");
    assert!(kept.len() < PATHS, "the design ended before it was killed");
    let written = |name: &String| fs::metadata(folder.path("a").join(name)).unwrap().modified().unwrap();
    let times: Vec<_> = kept.iter().map(written).collect();
    folder.refused(&format!("{design} a --check"), &["a: ", "paths are missing", "vibration-01"]);

    for share in ["1/3", "2/3", "3/3"] {
        let before = runs(&folder, "a").len();
        folder.done(&format!("{design} a --task {share}"));
        assert!(runs(&folder, "a").len() >= before);
        folder.done(&format!("{design} a --task {share} --check"));
    }
    assert_eq!(kept.iter().map(written).collect::<Vec<_>>(), times, "finished runs are left alone");
    let (stdout, _) = folder.done(&format!("{design} a --check"));
    assert!(stdout.contains("9 of 9 paths are there, 0 ended early"), "{stdout}");

    // The vibrations share press and slide in one go, which the killed and shared design did in parts.
    folder.done(&format!("{design} b --task 1/1"));
    assert_eq!(runs(&folder, "a"), runs(&folder, "b"));
    let read = |inside: &str, name: &str| {
        let run = Run::from_bytes(&folder.bytes(&format!("{inside}/{name}")), &folder.path(name)).unwrap();
        Run { cpu_s: 0.0, ..run }
    };
    for name in runs(&folder, "a") {
        assert_eq!(read("a", &name), read("b", &name), "{name}");
    }
    let spin = read("a", runs(&folder, "a").iter().find(|name| name.starts_with("spin")).unwrap());
    let turned: Vec<_> = spin.samples.iter().map(|s| s.turned.unwrap()).collect();
    assert!(turned.iter().any(|t| t.spin_deg.abs() > 5.0 && t.spin_deg * t.moment_n_mm[2] > 0.0), "{turned:?}");
    assert!(turned.iter().all(|t| t.pitch_deg == 30.0 && t.roll_deg == 0.0));
}
