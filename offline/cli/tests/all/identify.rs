//! `fingerpad identify` on its command line: refused tables, a folder of subjects, an interrupted run that resumes.

use std::{fs, path::Path, process::Command};

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::Config;
use fingerpad_identify::{Evaluator, Hooks, Query, Settings, StateCache, Steady};

fn run(arguments: &[&str], folder: &Path) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_fingerpad")).args(arguments).current_dir(folder).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}

const HEAD: &str = "depth_mm,normal_force_n,friction_coefficient,contact_area_mm2\n";
/// Shallow slides of a finger that is cheap to run.
const FINGER: &str = "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n";
/// The matching search settings.
const SEARCH: &str = "[identify.simplex]\nstarts = [[0.086, 0.46]]\n";
const SUBJECT: &str = "0.4,0.055,2.6,20\n0.5,0.078,2.35,27\n0.6,0.105,2.15,33\n";

/// Rows of a table that the finger of `FINGER` itself made under a law.
fn planted(lambda: f64, beta: f64) -> String {
    let config: Config = toml::from_str(FINGER).unwrap();
    let hooks = Hooks { go_on: &|| true, report_progress: &|_, _| {} };
    let settings = Settings::default();
    let evaluator = Evaluator::new(&config, &settings, StateCache::default(), &hooks, 1);
    let law = RubberFriction { lambda, beta, ..config.friction };
    let query = |depth_mm| Query { depth_mm, law, stiffness: 1.0 };
    let queries: Vec<_> =
        [0.5, 0.65, 0.8].into_iter().enumerate().map(|(slot, depth)| (slot, vec![query(depth)])).collect();
    let states = evaluator.on_shape(&config.fingertip_shape().unwrap(), &queries).unwrap();
    let row = |s: &Steady| {
        let [n, mu, a] = [s.normal_force_n, s.friction_coefficient(), s.contact_area_mm2];
        format!("{},{n:.6},{mu:.6},{a:.5}\n", s.depth_mm)
    };
    states.iter().flatten().map(row).collect()
}

#[test]
fn degenerate_tables_are_refused_with_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (rows, expected) in [
        ("0.75,0.12,2.46,49.4\n", &["t.csv", "1 row(s)", "0.75 mm"][..]),
        ("1,0.2,2,60\n1,0.21,2,61\n1,0.19,2.1,60\n", &["t.csv", "one depth, 1 mm"]),
        ("0.75,12.2,2.46,49.4\n1,20.2,2,62.8\n", &["t.csv:2", "normal_force_n", "12.2", "grams"]),
        ("49.4,0.12,2.46,0.75\n62.8,0.198,2,1\n", &["t.csv:2", "depth_mm", "49.4", "swapped"]),
        ("0.75,2.46,0.12,49.4\n1.5,1.42,0.454,97.7\n", &["t.csv", "normal_force_n", "swapped"]),
        ("0.75,0.12,2.46,\"1,049.4\"\n", &["t.csv:2", "contact_area_mm2", "1,049.4", "thousands"]),
        ("0.75,0.12,2.46,thick\n1,0.2,2,60\n", &["t.csv:2", "contact_area_mm2", "thick"]),
        ("0.5,0.1,0,40\n1.0,0.2,0,60\n", &["t.csv", "friction_coefficient is 0"]),
    ] {
        write(at, "t.csv", &format!("{HEAD}{rows}"));
        let (code, _, stderr) = run(&["identify", "--data", "t.csv", "--mesh-preset", "coarse", "--out", "o"], at);
        assert_eq!(code, Some(2), "{rows}: {stderr}");
        for part in expected {
            assert!(stderr.contains(part), "no `{part}` in: {stderr}");
        }
        assert!(!at.join("o/report.json").exists());
    }
    write(at, "t.csv", "depth_mm,friction_coefficient\n0.75,2.46\n1,2\n");
    let (code, _, stderr) = run(&["identify", "--data", "t.csv", "--mesh-preset", "coarse", "--out", "o"], at);
    assert!(code == Some(2) && stderr.contains("t.csv:1: no column `normal_force_n`"), "{stderr}");
    for (section, expected) in [
        ("[identify.region]\nbeta = [0.5, 0.1]\n", "region.beta"),
        ("[identify]\nconfidence = 1.5\n", "confidence"),
        ("[identify.simplex]\nstarts = [[-1.0, 0.4]]\n", "simplex.starts"),
        ("[[identify.calibration.vary]]\nname = \"nose\"\n", "nose"),
    ] {
        write(at, "bad.toml", section);
        let (code, _, stderr) = run(&["identify", "--config", "bad.toml", "--mesh-preset", "coarse", "--out", "o"], at);
        assert!(code == Some(2) && stderr.contains(expected), "{section}: {stderr}");
    }
    for arguments in [&["identify", "--task", "1/2"][..], &["identify", "--data", ".", "--task", "3/2"]] {
        assert_eq!(run(arguments, at).0, Some(2), "{arguments:?}");
    }
}

#[test]
fn a_folder_of_tables_in_shares_and_collected() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::create_dir(at.join("subjects")).unwrap();
    write(at, "quick.toml", &format!("{FINGER}{SEARCH}"));
    // Anna's skin is the stronger one, and Bert's strength grows less with pressure.
    write(at, "subjects/anna.csv", &format!("{HEAD}{}", planted(0.086, 0.46)));
    write(at, "subjects/bert.csv", &format!("\u{feff}{HEAD}{}", planted(0.03, 0.3)).replace('\n', "\r\n"));
    let with = |more: &[&'static str]| {
        let mut all = vec!["identify", "--config", "quick.toml", "--data", "subjects", "--out", "study"];
        all.extend(["--fast", "--no-prediction"]);
        all.extend(more);
        all
    };
    let (code, stdout, stderr) = run(&with(&["--task", "1/2"]), at);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert!(at.join("study/anna/report.html").exists() && !at.join("study/bert").exists());

    let (code, _, stderr) = run(&with(&["--collect"]), at);
    assert!(code == Some(2) && stderr.contains("without a result: bert"), "{stderr}");

    let (code, _, stderr) = run(&with(&["--task", "2/2"]), at);
    assert_eq!(code, Some(0), "{stderr}");
    let (code, stdout, stderr) = run(&with(&[]), at);
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(stdout.matches("finished before").count(), 2, "{stdout}");
    let read = |file: &str| -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(at.join(file)).unwrap()).unwrap()
    };
    let population = read("study/population.json");
    let names: Vec<_> = population["subjects"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!(names, ["anna", "bert"]);
    let found = |k: usize, what: &str| population["subjects"][k][what].as_f64().unwrap();
    for (k, [strength_kpa, beta]) in [[7.517, 0.46], [6.121, 0.3]].into_iter().enumerate() {
        assert!((found(k, "beta") - beta).abs() < 0.03, "{population}");
        assert!((found(k, "tau_ref_kpa") / strength_kpa - 1.0).abs() < 0.03, "{population}");
        assert!((found(k, "stiffness") - 1.0).abs() < 0.03, "{population}");
    }

    // The states of a lost report are not computed again.
    fs::remove_file(at.join("study/anna/report.json")).unwrap();
    let (code, stdout, _) = run(&with(&["--task", "1/2"]), at);
    assert_eq!(code, Some(0));
    assert!(stdout.contains("steady states were found before"), "{stdout}");
    let stages = read("study/anna/report.json")["stages"].clone();
    assert!(stages.as_array().unwrap().iter().all(|s| s["states"] == 0), "{stages}");
}

/// As the Snakefile runs it: one share for each table, then the summary, with the same options.
#[test]
fn published_constants_are_collected_over_subjects() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::create_dir(at.join("subjects")).unwrap();
    write(at, "quick.toml", FINGER);
    for (name, first) in [("anna", "2.6"), ("bert", "2.7")] {
        write(at, &format!("subjects/{name}.csv"), &format!("{HEAD}{}", SUBJECT.replace("2.6", first)));
    }
    for step in [&["--task", "1/2"][..], &["--task", "2/2"], &["--collect"]] {
        let study = ["identify", "--config", "quick.toml", "--data", "subjects", "--out", "study"];
        let arguments = [&study[..], step, &["--published", "--no-prediction"]].concat();
        let (code, stdout, stderr) = run(&arguments, at);
        assert_eq!(code, Some(0), "{stdout}{stderr}");
    }
    let text = fs::read_to_string(at.join("study/population.json")).unwrap();
    let population: serde_json::Value = serde_json::from_str(&text).unwrap();
    let subjects = population["subjects"].as_array().unwrap();
    assert_eq!(subjects.len(), 2);
    for subject in subjects {
        assert!(subject["law_searched"] == false && subject["beta"] == RubberFriction::default().beta, "{population}");
    }
    let spreads: Vec<_> = population["spreads"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!(spreads, ["stiffness factor", "depth offset, mm"]);
    let page = fs::read_to_string(at.join("study/population.html")).unwrap();
    assert!(page.contains("2 of 2 subjects have the published law"), "{page}");
}

#[test]
fn it_explains_itself_with_examples() {
    let (code, stdout, _) = run(&["identify", "--help"], Path::new("."));
    assert!(code == Some(0) && stdout.contains("Examples:") && stdout.contains("--task"), "{stdout}");
}

/// A table whose friction falls so steeply that the law's strength falls with pressure: its slides are found.
#[test]
fn a_strength_that_falls_with_pressure_has_its_slides() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "quick.toml", &format!("{FINGER}{SEARCH}"));
    write(at, "t.csv", &format!("{HEAD}{}", SUBJECT.replace("2.6", "2.7")));
    let (code, stdout, stderr) =
        run(&["identify", "--config", "quick.toml", "--data", "t.csv", "--fast", "--no-prediction", "--out", "o"], at);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    let report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("o/report.json")).unwrap()).unwrap();
    // The calibration slides under the power through F/A over N/A, whose exponent is -0.47.
    assert!(report["calibration"]["law"]["beta"].as_f64().unwrap() < -0.4, "{}", report["calibration"]["law"]);
    assert!(report["law"]["regularisation"]["pressure_mpa"].as_f64().unwrap() >= 1e-4);
}

/// The study by Snakemake, which is installed into the test's own environment.
#[test]
#[ignore = "installs Snakemake from PyPI; run by `cargo test --release -p fingerpad-cli --test all snakemake -- --ignored`"]
#[cfg(unix)]
fn snakemake_does_a_population_study() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let done = |command: &mut Command| {
        let output = command.current_dir(at).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{command:?}: {text}");
        text
    };
    done(Command::new("python3").args(["-m", "venv", "env"]));
    done(Command::new(at.join("env/bin/pip")).args(["install", "--quiet", "snakemake"]));
    fs::create_dir(at.join("tables")).unwrap();
    write(at, "quick.toml", &format!("{FINGER}{SEARCH}"));
    for (name, first) in [("anna", "2.6"), ("bert", "2.7"), ("carl", "2.65")] {
        write(at, &format!("tables/{name}.csv"), &format!("{HEAD}{}", SUBJECT.replace("2.6", first)));
    }
    let program = concat!("fingerpad=", env!("CARGO_BIN_EXE_fingerpad"));
    let snakemake = || {
        let mut command = Command::new(at.join("env/bin/snakemake"));
        command.args(["--snakefile", concat!(env!("CARGO_MANIFEST_DIR"), "/cluster/Snakefile"), "--cores", "2"]);
        command.args(["--config", "tables=tables", "out=study", "jobs=1", program]);
        command.arg("options=--config quick.toml --fast --no-prediction");
        command.env("HOME", at).env("XDG_CACHE_HOME", at.join("cache"));
        command
    };
    done(&mut snakemake());
    let population: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("study/population.json")).unwrap()).unwrap();
    assert_eq!(population["subjects"].as_array().unwrap().len(), 3);
    assert!(at.join("study/population.html").exists());
    assert!(done(&mut snakemake()).contains("Nothing to be done"));
}

/// The job array's script, with the scheduler's variables set by hand.
#[test]
#[cfg(unix)]
fn the_job_array_hands_its_share_on() {
    let folder = tempfile::tempdir().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/cluster/fingerpad.sbatch");
    let printed = |more: &[&str]| {
        let output = Command::new("bash")
            .arg(script)
            .args(["tables dir", "out"])
            .args(more)
            .env("FINGERPAD", "echo")
            .env("SLURM_ARRAY_TASK_ID", "3")
            .env("SLURM_ARRAY_TASK_COUNT", "8")
            .env("SLURM_CPUS_PER_TASK", "4")
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(printed(&["--fast"]), "identify --data tables dir --out out --jobs 4 --task 3/8 --fast\n");
    assert_eq!(printed(&["--collect"]), "identify --data tables dir --out out --jobs 4 --collect\n");
}
