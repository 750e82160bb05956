//! The design of experiments from the command line: shares, resuming after a kill, refused inputs.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::common::{fingerpad, refused, run, write};
use fingerpad_reduce::Run;

/// A design of few paths on the coarse mesh.
const FEW: &str = "mesh_preset = \"coarse\"\n[design]\naxis_depths_mm = [0.4]\ndepth_mm = [0.3, 0.6]\npose_depth_max_mm = 0.5\n\
    [design.paths]\npress = [1, 1]\nstraight = [0, 0]\nreversal = [0, 0]\nturn = [0, 0]\ndepth = [0, 0]\noblique = [0, 0]\n\
    random = [0, 0]\nvibration = [2, 0]\nspin = [1, 0]\nspin_slide = [0, 0]\nspin_reversal = [0, 0]\npose = [0, 0]\n\
    pose_change = [0, 0]\nforce = [0, 0]\nforce_step = [0, 0]\nwide_pose = [0, 0]\nwide_pose_change = [0, 0]\n";
const PATHS: usize = 9;

fn runs(folder: &Path) -> BTreeSet<String> {
    let Ok(entries) = fs::read_dir(folder) else { return BTreeSet::new() };
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.ends_with(".fprun")).collect()
}

fn read(file: &Path) -> Run {
    Run { cpu_s: 0.0, ..Run::from_bytes(&fs::read(file).unwrap(), file).unwrap() }
}

/// Runs finished before a kill are kept and not repeated; the shares divide the rest; a run does not depend on the
/// order of the runs.
#[test]
#[cfg(unix)]
fn a_killed_design_goes_on_in_shares() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "few.toml", FEW);
    let design = ["reduce", "--design", "--config", "few.toml", "--jobs", "1", "--runs"];
    let mut child = fingerpad(&[&design[..], &["a"]].concat(), at).spawn().unwrap();
    let started = Instant::now();
    while runs(&at.join("a")).len() < 2 {
        assert!(started.elapsed() < Duration::from_secs(300), "no run after five minutes");
        std::thread::sleep(Duration::from_millis(20));
    }
    Command::new("kill").args(["-9", &child.id().to_string()]).status().unwrap();
    child.wait().unwrap();
    let kept = runs(&at.join("a"));
    assert!(kept.len() < PATHS, "the design ended before it was killed");
    let written = |name: &String| fs::metadata(at.join("a").join(name)).unwrap().modified().unwrap();
    let times: Vec<_> = kept.iter().map(written).collect();
    refused(&[&design[..], &["a", "--check"]].concat(), at, &["a: ", "paths are missing", "vibration-01"]);

    for share in ["1/3", "2/3", "3/3"] {
        let before = runs(&at.join("a"));
        let arguments = [&design[..], &["a", "--task", share]].concat();
        let (code, stdout, stderr) = run(&arguments, at);
        assert_eq!(code, Some(0), "{stdout}{stderr}");
        assert!(runs(&at.join("a")).len() >= before.len());
        let (code, stdout, _) = run(&[&arguments[..], &["--check"]].concat(), at);
        assert_eq!(code, Some(0), "{stdout}");
    }
    assert_eq!(kept.iter().map(written).collect::<Vec<_>>(), times, "finished runs are left alone");
    let (code, stdout, stderr) = run(&[&design[..], &["a", "--check"]].concat(), at);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert!(stdout.contains("9 of 9 paths are there, 0 ended early"), "{stdout}");

    // The vibrations share press and slide in one go, which the killed and shared design did in parts.
    let (code, stdout, stderr) = run(&[&design[..], &["b"]].concat(), at);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert_eq!(runs(&at.join("a")), runs(&at.join("b")));
    for name in runs(&at.join("a")) {
        assert_eq!(read(&at.join("a").join(&name)), read(&at.join("b").join(&name)), "{name}");
    }
    let spin = read(&at.join("a").join(runs(&at.join("a")).iter().find(|name| name.starts_with("spin")).unwrap()));
    let turned: Vec<_> = spin.samples.iter().map(|s| s.turned.unwrap()).collect();
    assert!(turned.iter().any(|t| t.spin_deg.abs() > 5.0 && t.spin_deg * t.moment_n_mm[2] > 0.0), "{turned:?}");
    assert!(turned.iter().all(|t| t.pitch_deg == 30.0 && t.roll_deg == 0.0));
}

#[test]
fn shares_and_sizes_that_are_none_are_refused_by_name_and_value() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let design = ["reduce", "--design", "--mesh-preset", "coarse", "--runs", "runs"];
    for task in ["0/3", "4/3", "1", "1/0", "-1/2", "a/b"] {
        let value = format!("--task={task}");
        refused(&[&design[..], &[&value]].concat(), at, &[task, "K/N"]);
    }
    refused(&["reduce", "--runs", "runs", "--task", "1/2", "--out", "m.fpm"], at, &["--design"]);
    refused(&[&design[..], &["--task", "1/2", "--out", "m.fpm"]].concat(), at, &["--task", "--out"]);
    for (text, expected) in [
        ("depth_mm = [0.01, 2.5]", &["design.depth_mm", "[0.01, 2.5]", "0.15"][..]),
        ("pitch_deg = [5, 40]", &["design.pitch_deg", "[5.0, 40.0]"]),
        ("depth_mm = [0.3, 9.0]", &["[design]: path ", "mm reaches"]),
        ("depths = 3", &["c.toml", "depths"]),
        ("[design.paths]\nspin = [-1, 0]", &["c.toml", "-1"]),
        ("[design.paths]\nspin = [1, 5000]", &["design.paths.spin", "[1, 5000]"]),
    ] {
        write(at, "c.toml", &format!("[design]\n{text}\n"));
        refused(&[&design[..], &["--config", "c.toml"]].concat(), at, expected);
    }
    assert!(runs(&at.join("runs")).is_empty());
}

/// The job array's script, with the scheduler's variables set by hand.
#[test]
#[cfg(unix)]
fn the_job_array_hands_its_share_on() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/cluster/design.sbatch");
    let printed = |more: &[&str]| {
        let mut command = Command::new("bash");
        command.args([script, "my runs"]).args(more).env("FINGERPAD", "echo").env("SLURM_CPUS_PER_TASK", "2");
        let output = command.env("SLURM_ARRAY_TASK_ID", "3").env("SLURM_ARRAY_TASK_COUNT", "8").output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let config = ["--config", "f.toml"];
    assert_eq!(printed(&config), "reduce --design --runs my runs --jobs 2 --task 3/8 --config f.toml\n");
    assert_eq!(printed(&["--check"]), "reduce --design --runs my runs --jobs 2 --check\n");
}
