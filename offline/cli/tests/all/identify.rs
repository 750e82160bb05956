//! `identify`: a folder of subjects, a run that resumes, a study by Snakemake or a job array.

use std::fs;
use std::process::Command;

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::Config;
use fingerpad_identify::{Evaluator, Hooks, Query, Settings, StateCache, Steady};

use crate::common::{COARSE, Folder, package};

const HEAD: &str = "depth_mm,normal_force_n,friction_coefficient,contact_area_mm2\n";

/// The cheapest finger with the search settings that suit shallow slides.
fn quick() -> String {
    format!("{COARSE}[identify.simplex]\nstarts = [[0.086, 0.46]]\n")
}

/// A table of shallow slides with this first coefficient of friction.
fn subject(first: &str) -> String {
    format!("{HEAD}0.4,0.055,{first},20\n0.5,0.078,2.35,27\n0.6,0.105,2.15,33\n")
}

/// Rows of a table that the finger of `COARSE` itself made under a law.
fn planted(lambda: f64, beta: f64) -> String {
    let config: Config = toml::from_str(COARSE).unwrap();
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
fn a_folder_of_tables_in_shares_and_collected() {
    let folder = Folder::with(&[("quick.toml", &quick())]);
    // Anna's skin is the stronger one, and Bert's strength grows less with pressure.
    folder.write("subjects/anna.csv", format!("{HEAD}{}", planted(0.086, 0.46)));
    folder.write("subjects/bert.csv", format!("\u{feff}{HEAD}{}", planted(0.03, 0.3)).replace('\n', "\r\n"));
    let study = "identify --config quick.toml --data subjects --out study --fast --no-prediction";
    folder.done(&format!("{study} --task 1/2"));
    assert!(folder.exists("study/anna/report.html") && !folder.exists("study/bert"));
    folder.refused(&format!("{study} --collect"), &["without a result: bert"]);
    folder.done(&format!("{study} --task 2/2"));
    let (stdout, _) = folder.done(study);
    assert_eq!(stdout.matches("finished before").count(), 2, "{stdout}");
    let population = folder.json("study/population.json");
    let names: Vec<_> = population["subjects"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!(names, ["anna", "bert"]);
    let found = |k: usize, what: &str| population["subjects"][k][what].as_f64().unwrap();
    for (k, [strength_kpa, beta]) in [[7.517, 0.46], [6.121, 0.3]].into_iter().enumerate() {
        assert!((found(k, "beta") - beta).abs() < 0.03, "{population}");
        assert!((found(k, "tau_ref_kpa") / strength_kpa - 1.0).abs() < 0.03, "{population}");
        assert!((found(k, "stiffness") - 1.0).abs() < 0.03, "{population}");
    }

    // The states of a lost report are not computed again.
    fs::remove_file(folder.path("study/anna/report.json")).unwrap();
    let (stdout, _) = folder.done(&format!("{study} --task 1/2"));
    assert!(stdout.contains("steady states were found before"), "{stdout}");
    let stages = folder.json("study/anna/report.json")["stages"].clone();
    assert!(stages.as_array().unwrap().iter().all(|s| s["states"] == 0), "{stages}");
}

/// As the Snakefile runs it: one share for each table, then the summary, with the same options.
#[test]
#[ignore = "nightly"]
fn published_constants_are_collected_over_subjects() {
    let folder = Folder::with(&[("quick.toml", COARSE)]);
    for (name, first) in [("anna", "2.6"), ("bert", "2.7")] {
        folder.write(&format!("subjects/{name}.csv"), subject(first));
    }
    for step in ["--task 1/2", "--task 2/2", "--collect"] {
        let study = "identify --config quick.toml --data subjects --out study --published --no-prediction";
        folder.done(&format!("{study} {step}"));
    }
    let population = folder.json("study/population.json");
    let subjects = population["subjects"].as_array().unwrap();
    assert_eq!(subjects.len(), 2);
    for subject in subjects {
        assert!(subject["law_searched"] == false && subject["beta"] == RubberFriction::default().beta, "{population}");
    }
    let spreads: Vec<_> = population["spreads"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!(spreads, ["stiffness factor", "depth offset, mm"]);
    let page = folder.text("study/population.html");
    assert!(page.contains("2 of 2 subjects have the published law"), "{page}");
}

/// A table whose friction falls so steeply that the law's strength falls with pressure: its slides are found.
#[test]
#[ignore = "nightly"]
fn a_strength_that_falls_with_pressure_has_its_slides() {
    let folder = Folder::with(&[("quick.toml", &quick()), ("t.csv", &subject("2.7"))]);
    folder.done("identify --config quick.toml --data t.csv --fast --no-prediction --out o");
    let report = folder.json("o/report.json");
    // The calibration slides under the power through F/A over N/A, whose exponent is -0.47.
    assert!(report["calibration"]["law"]["beta"].as_f64().unwrap() < -0.4, "{}", report["calibration"]["law"]);
    assert!(report["law"]["regularisation"]["pressure_mpa"].as_f64().unwrap() >= 1e-4);
}

/// The study by Snakemake, which is installed from PyPI into the test's own environment.
#[test]
#[ignore = "weekly"]
#[cfg(unix)]
fn snakemake_does_a_population_study() {
    let folder = Folder::with(&[("quick.toml", &quick())]);
    let at = folder.path("");
    let done = |command: &mut Command| {
        let output = command.current_dir(&at).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{command:?}: {text}");
        text
    };
    done(Command::new("python3").args(["-m", "venv", "env"]));
    done(Command::new(at.join("env/bin/pip")).args(["install", "--quiet", "snakemake"]));
    for (name, first) in [("anna", "2.6"), ("bert", "2.7"), ("carl", "2.65")] {
        folder.write(&format!("tables/{name}.csv"), subject(first));
    }
    let snakemake = || {
        let mut command = Command::new(at.join("env/bin/snakemake"));
        command.arg("--snakefile").arg(package().join("cluster/Snakefile")).args(["--cores", "2", "--config"]);
        let program = concat!("fingerpad=", env!("CARGO_BIN_EXE_fingerpad"));
        command.args(["tables=tables", "out=study", "jobs=1", program]);
        command.arg("options=--config quick.toml --fast --no-prediction");
        command.env("HOME", &at).env("XDG_CACHE_HOME", at.join("cache"));
        command
    };
    done(&mut snakemake());
    assert_eq!(folder.json("study/population.json")["subjects"].as_array().unwrap().len(), 3);
    assert!(folder.exists("study/population.html"));
    assert!(done(&mut snakemake()).contains("Nothing to be done"));
}

/// The scripts of the job arrays, with the scheduler's variables set by hand.
#[test]
#[cfg(unix)]
fn a_job_array_hands_its_share_on() {
    let identify = "identify --data tables dir --out out --jobs 2";
    let design = "finger --design full --out my runs --jobs 2";
    for (script, words, printed) in [
        ("fingerpad", &["tables dir", "out", "--fast"][..], format!("{identify} --task 3/8 --fast\n")),
        ("fingerpad", &["tables dir", "out", "--collect"], format!("{identify} --collect\n")),
        ("design", &["my runs", "--config", "f.toml"], format!("{design} --task 3/8 --config f.toml\n")),
        ("design", &["my runs", "--check"], format!("{design} --check\n")),
    ] {
        let mut command = Command::new("bash");
        command.arg(package().join(format!("cluster/{script}.sbatch"))).args(words);
        command.env("FINGERPAD", "echo").env("SLURM_CPUS_PER_TASK", "2").current_dir(std::env::temp_dir());
        let output = command.env("SLURM_ARRAY_TASK_ID", "3").env("SLURM_ARRAY_TASK_COUNT", "8").output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(String::from_utf8(output.stdout).unwrap(), printed);
    }
}
