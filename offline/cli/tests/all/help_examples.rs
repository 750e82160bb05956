//! Every example of every `--help` is parsed; nightly runs them too. One that takes long is stopped once it computes.

#![cfg(unix)]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs, path::Path};

use crate::common::{Folder, fe_set, package};
use crate::models::made;

/// Time after which a running example counts as right.
const LONG_ENOUGH: Duration = Duration::from_secs(3);

/// Runs the program with the width of a terminal; its standard output.
fn printed(line: &str, columns: usize) -> String {
    let folder = Folder::new();
    let output = folder.command(line).env("COLUMNS", columns.to_string()).output().unwrap();
    assert!(output.status.success(), "{line}");
    String::from_utf8(output.stdout).unwrap()
}

/// The examples of a command, without the remarks behind them.
fn examples(command: &str) -> Vec<String> {
    let help = printed(&format!("{command} --help"), 100);
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

/// A folder with the files that the examples name.
fn prepared() -> Folder {
    let folder = Folder::new();
    let data = package().join("data");
    let copy = |from: &str, to: &str| folder.write(to, fs::read(data.join(from)).unwrap());
    ["model.fpm", "corrected.fpm"].iter().for_each(|model| copy("models/fingertip.fpm", model));
    copy("models/fingertip-pad.fpm", "pad.fpm");
    copy("examples/hold.csv", "hold.csv");
    folder.write("charged.fpm", made("charged.fpm"));
    for table in ["data/yoshida2011.csv", "my.csv", "subjects/anna.csv", "subjects/bert.csv"] {
        copy("yoshida2011.csv", table);
    }
    copy("human_texture_exploration/July3_1_force_data_1.csv", "t.csv");
    // A log of a finger that presses and is dragged until it slips.
    let log = (0..80).map(|k| {
        let (t, normal) = (0.02 * f64::from(k), 0.03 * f64::from(k.min(20)));
        let slide = 0.02 * f64::from((k - 20).max(0));
        format!("{t:.2},{normal:.3},{:.3},0,{slide:.3},0\n", (0.8 * slide).min(0.5))
    });
    let head = "t_s,normal_force_n,friction_x_n,friction_y_n,slide_x_mm,slide_y_mm\n".to_owned();
    folder.write("log.csv", head + &log.collect::<String>());
    for entry in fs::read_dir(data.join("runs")).unwrap() {
        let run = format!("runs/{}", entry.unwrap().file_name().to_string_lossy());
        copy(&run, &run);
    }
    let [calibration, measured, holdout] = ["calibration_d", "set_17", "set_15"].map(fe_set);
    // The same with a column of another name, and of a sensor that is mounted upside down.
    let renamed = |text: &str| text.replacen("run_id", "Trial", 1);
    let turned = |text: &str| {
        let text = crate::common::changed(text, &["normal_force_n", "friction_y_n"], |v| -v);
        [("normal_force_n", "Fz"), ("friction_x_n", "Fx"), ("friction_y_n", "Fy")]
            .iter()
            .fold(text, |text, (ours, theirs)| text.replacen(ours, theirs, 1))
    };
    for (text, names) in [
        (&calibration, ["calibration.csv", "c.csv", "c0.csv", "c1.csv"]),
        (&measured, ["measured.csv", "m.csv", "m0.csv", "m1.csv"]),
    ] {
        let contents = [text.clone(), text.clone(), renamed(text), turned(text)];
        names.iter().zip(contents).for_each(|(name, content)| folder.write(name, content));
    }
    // Runs to be appended.
    ["h.csv", "holdout.csv"].iter().for_each(|name| folder.write(name, &holdout));
    let (head, rows) = holdout.split_once('\n').unwrap();
    let rows: String = rows.lines().map(|row| format!("next-{row}\n")).collect();
    folder.write("n.csv", format!("{head}\n{rows}"));
    // Three fingers: parts of the measured runs.
    let (head, rows) = measured.split_once('\n').unwrap();
    let run_of = |row: &str| row.split(',').next().unwrap_or_default().to_owned();
    let mut names: Vec<String> = rows.lines().map(run_of).collect();
    names.dedup();
    for finger in 0..3 {
        let own = |row: &&str| names.iter().position(|name| *name == run_of(row)).unwrap() % 3 == finger;
        let rows: Vec<&str> = rows.lines().filter(own).collect();
        folder.write(&format!("finger{finger}.csv"), format!("{head}\n{}\n", rows.join("\n")));
    }
    let list = "finger,calibration,measured\nanna,c.csv,finger0.csv\nbert,c.csv,finger1.csv\ncarl,c.csv,finger2.csv\n";
    folder.write("fingers.csv", list);
    let wear = "[[law]]\nname = \"wear\"\nacts_on = \"strength\"\nformula = \"-loss * path_mm / 50\"\n\
                parameter = [{ name = \"loss\", unit = \"\", range = [0, 0.5], typical = 0.05 }]\n";
    folder.write("laws.toml", wear);
    ["fixed.toml", "mine.toml"].iter().for_each(|name| folder.write(name, "[tissue.bone]\nkind = \"fixed\"\n"));
    folder.done("mesh --mesh-preset coarse --out theirs.msh");
    folder.done("phantom --voxels 256 64 64 --out scan.nii.gz");
    folder.done("phantom --voxels 256 64 64 --out finger.nrrd");
    folder
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

/// Commands of the program, without `help`; the second line of a description is indented further.
fn commands() -> Vec<String> {
    let help = printed("--help", 100);
    let listed = help.split_once("Commands:\n").unwrap().1.lines().take_while(|line| !line.is_empty());
    let names = listed.filter_map(|line| line.strip_prefix("  ")?.split_once("  ").map(|(name, _)| name.to_owned()));
    let verbs = ["finger make", "finger bed", "finger retune"].map(str::to_owned);
    names.filter(|name| !name.is_empty() && name != "help").chain(verbs).collect()
}

/// Those whose help has examples: `finger make` is `finger`, whose examples it would repeat.
fn with_examples() -> impl Iterator<Item = String> {
    commands().into_iter().filter(|command| command != "finger make")
}

/// A line ends where the next word would not fit, or with its paragraph: no text is broken twice.
#[test]
fn help_is_broken_once_at_the_width_of_the_terminal() {
    for command in with_examples() {
        for columns in [80, 110] {
            let text = printed(&format!("{command} --help"), columns);
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
    for command in with_examples() {
        for line in examples(&command).iter().filter_map(|line| line.strip_prefix("fingerpad ")) {
            let words: Vec<&str> = line.split(['<', '>']).next().unwrap().split_whitespace().collect();
            assert!(parsed(&words), "{line}");
            assert!(!parsed(&[&words[..], &["--no-such-option"]].concat()), "{line} with an unknown option");
        }
    }
}

#[test]
#[ignore = "nightly"]
fn every_example_of_every_help_runs() {
    let folder = prepared();
    let mut count = 0;
    for command in with_examples() {
        for line in examples(&command) {
            if let Err(printed) = runs(&line, &folder.path("")) {
                panic!("`{line}`: {printed}");
            }
            count += 1;
        }
    }
    assert!(count >= 30, "{count} examples");
}

#[test]
fn the_program_says_its_version_and_its_commands() {
    assert_eq!(printed("--version", 100), format!("fingerpad {}\n", env!("CARGO_PKG_VERSION")));
    assert_eq!(printed("help", 100), printed("--help", 100));
    // Few enough to be remembered.
    let count = commands().iter().filter(|command| !command.contains(' ')).count();
    assert!((8..10).contains(&count), "{:?}", commands());
}
