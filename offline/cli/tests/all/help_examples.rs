//! Every example of every `--help` is parsed; the slow tier runs them too. One that takes long is stopped once it computes.

#![cfg(unix)]

use std::{
    env, fs,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

/// Time after which a running example counts as right.
const LONG_ENOUGH: Duration = Duration::from_secs(3);

const PACKAGE: &str = env!("CARGO_MANIFEST_DIR");

fn help(command: &str) -> String {
    let mut fingerpad = Command::new(env!("CARGO_BIN_EXE_fingerpad"));
    fingerpad.args(command.split_whitespace().chain(["--help"]));
    let output = fingerpad.output().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap()
}

/// The examples of a command, without the remarks behind them.
fn examples(command: &str) -> Vec<String> {
    let help = help(command);
    let (_, section) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("{command} has no examples"));
    let section = section.split("\n\n").next().unwrap();
    // A command continues behind a backslash; remarks are indented further.
    let whole = section.replace(" \\\n      ", " ");
    let lines: Vec<&str> = whole.lines().collect();
    let starts = ["  fingerpad ", "  printf ", "      "];
    assert!(lines.iter().all(|line| starts.iter().any(|start| line.starts_with(start))), "{command}: {lines:#?}");
    let lines = lines.into_iter().map(str::trim);
    let of_shell = lines.filter(|line| line.starts_with("fingerpad ") || line.starts_with("printf "));
    of_shell.map(|line| line.split("  ").next().unwrap().to_owned()).collect()
}

/// Puts the files that the examples name into a folder.
fn prepare(at: &Path) {
    let data = Path::new(PACKAGE).join("data");
    let copy = |from: &Path, to: &str| {
        fs::create_dir_all(at.join(to).parent().unwrap()).unwrap();
        fs::copy(from, at.join(to)).unwrap();
    };
    for model in ["model.fpm", "corrected.fpm"] {
        copy(&data.join("models/fingertip.fpm"), model);
    }
    copy(&data.join("models/fingertip-pad.fpm"), "pad.fpm");
    crate::common::charged::charged(&at.join("charged.fpm"));
    for table in ["data/yoshida2011.csv", "my.csv", "subjects/anna.csv", "subjects/bert.csv"] {
        copy(&data.join("yoshida2011.csv"), table);
    }
    copy(&data.join("human_texture_exploration/July3_1_force_data_1.csv"), "t.csv");
    for entry in fs::read_dir(data.join("runs")).unwrap() {
        let file = entry.unwrap().path();
        copy(&file, &format!("runs/{}", file.file_name().unwrap().to_string_lossy()));
    }
    for (name, files) in [
        ("calibration_d", &["calibration.csv", "c.csv"][..]),
        ("set_17", &["measured.csv", "m.csv"]),
        ("set_15", &["h.csv", "holdout.csv"]),
    ] {
        let packed = Path::new(PACKAGE).join(format!("tests/fe_sets/{name}.csv.gz"));
        for file in files {
            let mut unpacked = fs::File::create(at.join(file)).unwrap();
            let mut text = flate2::read::GzDecoder::new(fs::File::open(&packed).unwrap());
            std::io::copy(&mut text, &mut unpacked).unwrap();
        }
    }
    // The same with a column of another name.
    for (file, renamed) in [("c.csv", "c0.csv"), ("m.csv", "m0.csv")] {
        let text = fs::read_to_string(at.join(file)).unwrap();
        fs::write(at.join(renamed), text.replacen("run_id", "Trial", 1)).unwrap();
    }
    // Runs to be appended, and files of a sensor that is mounted upside down.
    let text = fs::read_to_string(at.join("h.csv")).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    let rows: String = rows.lines().map(|row| format!("next-{row}\n")).collect();
    fs::write(at.join("n.csv"), format!("{head}\n{rows}")).unwrap();
    for (file, turned) in [("c.csv", "c1.csv"), ("m.csv", "m1.csv")] {
        let text = fs::read_to_string(at.join(file)).unwrap();
        let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let names = [("normal_force_n", "Fz", true), ("friction_x_n", "Fx", false), ("friction_y_n", "Fy", true)];
        let lines = text.lines().enumerate().map(|(line, row)| {
            let cells = row.split(',').zip(&head).map(|(cell, column)| match names.iter().find(|n| n.0 == *column) {
                Some((_, name, _)) if line == 0 => (*name).to_owned(),
                Some((.., true)) => (-cell.parse::<f64>().unwrap()).to_string(),
                _ => cell.to_owned(),
            });
            cells.collect::<Vec<_>>().join(",") + "\n"
        });
        fs::write(at.join(turned), lines.collect::<String>()).unwrap();
    }
    // Three fingers: parts of the measured runs.
    let text = fs::read_to_string(at.join("m.csv")).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    let run_of = |row: &str| row.split(',').next().unwrap_or_default().to_owned();
    let mut names: Vec<String> = rows.lines().map(run_of).collect();
    names.dedup();
    for finger in 0..3 {
        let own = |row: &&str| names.iter().position(|name| *name == run_of(row)).unwrap() % 3 == finger;
        let rows: Vec<&str> = rows.lines().filter(own).collect();
        fs::write(at.join(format!("finger{finger}.csv")), format!("{head}\n{}\n", rows.join("\n"))).unwrap();
    }
    let list = "finger,calibration,measured\nanna,c.csv,finger0.csv\nbert,c.csv,finger1.csv\ncarl,c.csv,finger2.csv\n";
    fs::write(at.join("fingers.csv"), list).unwrap();
    let wear = "[[law]]\nname = \"wear\"\nacts_on = \"strength\"\nformula = \"-loss * path_mm / 50\"\n\
                parameter = [{ name = \"loss\", unit = \"\", range = [0, 0.5], typical = 0.05 }]\n";
    fs::write(at.join("laws.toml"), wear).unwrap();
    for name in ["fixed.toml", "mine.toml"] {
        fs::write(at.join(name), "[tissue.bone]\nkind = \"fixed\"\n").unwrap();
    }
    for line in [
        "mesh --mesh-preset coarse --out theirs.msh",
        "phantom --voxels 256 64 64 --out scan.nii.gz",
        "phantom --voxels 256 64 64 --out finger.nrrd",
    ] {
        let arguments = line.split_whitespace();
        let made = Command::new(env!("CARGO_BIN_EXE_fingerpad")).args(arguments).current_dir(at).output().unwrap();
        assert!(made.status.success());
    }
}

/// Runs a line as a shell does; the error is its output.
fn runs(line: &str, at: &Path) -> Result<(), String> {
    let program = Path::new(env!("CARGO_BIN_EXE_fingerpad")).parent().unwrap();
    let path = format!("{}:{}", program.display(), env::var("PATH").unwrap());
    let printed = at.join(".output");
    let mut child = Command::new("sh")
        .args(["-c", &format!("exec {line}").replace("exec printf", "printf")])
        .env("PATH", path)
        .current_dir(at)
        .stdout(Stdio::null())
        .stderr(fs::File::create(&printed).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if start.elapsed() > LONG_ENOUGH => {
                child.kill().unwrap();
                child.wait().unwrap();
                return Ok(());
            }
            None => std::thread::park_timeout(Duration::from_millis(5)),
        }
    };
    let printed = fs::read_to_string(printed).unwrap();
    // Shares that have not run cannot be collected: the line itself is accepted.
    if status.success() || line.ends_with("--collect") && printed.contains("no finished subject") {
        Ok(())
    } else {
        Err(printed)
    }
}

/// Commands of the program.
const COMMANDS: [&str; 13] = [
    "simulate", "pad", "bed", "retune", "eval", "export", "mesh", "phantom", "diagnose", "reduce", "finger",
    "identify", "build",
];

/// A line ends where the next word would not fit, or with its paragraph: no text is broken twice.
#[test]
fn help_is_broken_once_at_the_width_of_the_terminal() {
    for command in COMMANDS {
        for columns in [80, 110] {
            let mut fingerpad = Command::new(env!("CARGO_BIN_EXE_fingerpad"));
            let output = fingerpad.args([command, "--help"]).env("COLUMNS", columns.to_string()).output().unwrap();
            let text = String::from_utf8(output.stdout).unwrap();
            let (_, below) = text.split_once("Examples:\n").unwrap();
            for line in below.lines() {
                assert!(line.chars().count() <= columns, "{command}, {columns} columns: {line}");
            }
            for paragraph in below.split("\n\n").skip(1) {
                let lines: Vec<&str> = paragraph.trim_end().lines().collect();
                for pair in lines.windows(2) {
                    let next = pair[1].split(' ').next().unwrap().chars().count();
                    let fits = pair[0].chars().count() + 1 + next <= columns;
                    assert!(!fits, "{command}, {columns} columns: broken after `{}`", pair[0]);
                }
            }
        }
    }
}

/// Clap refuses unknown options and values before it reaches `--help`.
#[test]
fn every_example_of_every_help_is_parsed() {
    let parsed = |words: &[&str]| {
        let mut fingerpad = Command::new(env!("CARGO_BIN_EXE_fingerpad"));
        fingerpad.args(words).arg("--help").output().unwrap().status.success()
    };
    for command in COMMANDS {
        for line in examples(command).iter().filter_map(|line| line.strip_prefix("fingerpad ")) {
            let words: Vec<&str> = line.split(['<', '>']).next().unwrap().split_whitespace().collect();
            assert!(parsed(&words), "{line}");
            assert!(!parsed(&[&words[..], &["--no-such-option"]].concat()), "{line} with an unknown option");
        }
    }
}

#[test]
#[ignore = "slow: minutes; `cargo xtask test --slow` runs it"]
fn every_example_of_every_help_runs() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let design = tempfile::tempdir().unwrap();
    let mut count = 0;
    for command in COMMANDS {
        for line in examples(command) {
            // A design that is stopped leaves few runs, of other settings than those that are there for the fit.
            let place = if command == "reduce" && line.contains("--design") { design.path() } else { folder.path() };
            if let Err(printed) = runs(&line, place) {
                panic!("`{line}`: {printed}");
            }
            count += 1;
        }
    }
    assert!(count >= 30, "{count} examples");
}

#[test]
fn every_command_has_tested_examples() {
    let all = help("");
    COMMANDS.iter().for_each(|command| assert!(all.contains(&format!("  {command} ")), "{command}"));
    let listed = all.split_once("Commands:\n").unwrap().1.lines().take_while(|l| !l.is_empty());
    // The second line of a description is indented further.
    let listed = listed.filter(|l| !l.starts_with("   ")).count();
    assert_eq!(listed, COMMANDS.len() + 1, "a command without a test of its examples, `help` aside: {all}");
}

#[test]
fn the_program_says_its_version_and_its_commands() {
    let printed = |argument: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_fingerpad")).arg(argument).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(printed("--version"), format!("fingerpad {}\n", env!("CARGO_PKG_VERSION")));
    assert_eq!(printed("help"), help(""));
    for command in ["build", "diagnose", "simulate", "eval"] {
        assert!(printed("help").contains(command));
    }
}
