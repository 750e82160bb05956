//! The commands of the documents: every command of README and the pages is parsed; nightly runs them too. Links lead to
//! pages and headings that exist.
//!
//! A command is a line of a fenced `sh` block. Those of a page run in their order in one temporary folder that holds a
//! copy of `data`, so that a later one may use the output of an earlier one. `cargo run --release --` and `fingerpad`
//! mean the program as it was just built.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::common::{Folder, package};

/// Commands that take too long to be run here, by their beginning and why; they are parsed and their input is looked for.
const LONG: &[(&str, &str)] = &[
    ("fingerpad identify --data data/yoshida2011.csv --out", "the paper's simplex: a quarter of an hour of CPU"),
    ("fingerpad identify --data data/yoshida2011.csv --fast", "the default mesh: minutes of CPU"),
    ("fingerpad identify --data data/yoshida2011.csv --joint", "the default mesh: minutes of CPU"),
    ("fingerpad identify --data data/yoshida2011.csv --force-zero", "seven calibrations: a minute of CPU"),
    ("fingerpad identify --published", "the default mesh: a minute of CPU"),
    ("fingerpad finger --design full", "hundreds of finite-element paths"),
    ("fingerpad finger --design stored", "the fit of a bed or a pad: minutes of CPU"),
    ("fingerpad finger --config data/silicone.toml --mesh-preset coarse --out silicone", "half a minute of CPU"),
    ("fingerpad finger --dome 10", "half a minute of CPU"),
    (
        "fingerpad diagnose runs --calibration data/examples/calibration.csv --measured data/examples/measured.csv --confirm-fe",
        "strokes of the finite elements: a minute of CPU",
    ),
    (
        "fingerpad diagnose runs --calibration data/examples/calibration.csv --measured data/examples/measured.csv --holdout data/examples/holdout.csv --confirm-fe",
        "strokes of the finite elements: five minutes of CPU",
    ),
    ("cargo ", "builds other programs; the commands of cargo and of the chores are parsed"),
];

/// Words of a command before a file that must be there.
const INPUTS: [&str; 12] = [
    "--path",
    "--config",
    "--data",
    "--calibration",
    "--measured",
    "--holdout",
    "--model",
    "--runs",
    "check",
    "trace",
    "table",
    "group",
];

/// The problems of all commands of all pages.
fn problems(commands: impl Fn(&str) -> Vec<String>, check: impl Fn(&str) -> Result<String, String>) -> String {
    let mut wrong = String::new();
    for page in pages() {
        for command in commands(&fs::read_to_string(&page).unwrap()) {
            if let Err(problem) = check(&command) {
                wrong += &format!("{}: {command}\n    {problem}\n", page.display());
            }
        }
    }
    wrong
}

#[test]
fn every_command_of_the_documents_is_parsed() {
    let root = root();
    let wrong = problems(fenced, |command| {
        inputs(command, |file| !file.starts_with("data/") || root.join(file).exists())?;
        accepts(command)
    });
    // Commands within a sentence have placeholders for files; their options must exist all the same.
    let wrong = wrong + &problems(inline, accepts);
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
#[ignore = "nightly"]
fn every_command_of_the_documents_runs() {
    let mut used = BTreeSet::new();
    let mut wrong = Vec::new();
    for page in pages() {
        let folder = sandbox();
        for command in fenced(&fs::read_to_string(&page).unwrap()) {
            let long = LONG.iter().find(|(beginning, _)| command.starts_with(beginning));
            used.extend(long.map(|(beginning, _)| *beginning));
            let result = if long.is_some() { parse(&folder, &command) } else { run(&folder, &command) };
            println!("{}: {command}: {result:?}", page.display());
            wrong.extend(result.err().map(|problem| format!("{}: {command}\n    {problem}", page.display())));
        }
    }
    let unused: Vec<_> = LONG.iter().filter(|(beginning, _)| !used.contains(beginning)).collect();
    assert!(unused.is_empty(), "no document has a command that begins like this: {unused:?}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Formulas stand in the library; the page has the same, and they name each of their parameters.
#[test]
fn the_table_of_laws_has_the_formulas_of_the_library() {
    let text = fs::read_to_string(root().join("docs/diagnose.md")).unwrap();
    for law in fingerpad::effects::LAWS {
        let row = format!("| {} | {} | {} |", law.name, law.family, law.formula);
        assert!(text.contains(&row), "docs/diagnose.md does not have: {row}");
        let words: Vec<&str> = law.formula.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).collect();
        assert!(law.parameters.iter().all(|p| words.contains(&p.name)), "{row}");
    }
}

#[test]
fn every_link_leads_somewhere() {
    let mut wrong = Vec::new();
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for link in links.filter(|link| !link.contains("://") && !link.contains(['[', ' '])) {
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let there = match fs::read_to_string(&target) {
                Ok(text) => heading.is_empty() || headings(&text).contains(heading),
                Err(_) => heading.is_empty() && target.exists(),
            };
            wrong.extend((!there).then(|| format!("{}: {link}", page.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The checks themselves: each of these mistakes is found, and the same text without it passes.
#[test]
fn a_mistake_in_a_command_is_seen() {
    let folder = sandbox();
    let text =
        "Text.\n```sh\nfingerpad eval --model data/models/fingertip.fpm \\\n    --path p.csv --out r.csv  # why\n```\n";
    assert_eq!(fenced(text), ["fingerpad eval --model data/models/fingertip.fpm --path p.csv --out r.csv"]);
    assert_eq!(inline("a `fingerpad mesh\n--out F` b `--json` c"), ["fingerpad mesh --out F"]);

    let eval = "fingerpad eval --model data/models/fingertip.fpm --path data/examples/path.csv --out r.csv";
    run(&folder, eval).unwrap();
    parse(&folder, eval).unwrap();
    for (from, to, expected) in
        [("--model", "--modle", "--modle"), ("path.csv", "paht.csv", "paht.csv"), ("eval", "evaluate", "evaluate")]
    {
        let bad = eval.replace(from, to);
        for problem in [run(&folder, &bad).unwrap_err(), parse(&folder, &bad).unwrap_err()] {
            assert!(problem.contains(expected), "{bad}: {problem}");
        }
    }
    for (good, bad) in [
        ("cargo xtask bench calculix", "cargo xtask bench calculux"),
        ("cargo xtask thumb run control", "cargo xtask thumb walk control"),
        ("cargo xtask verify hertz", "cargo xtask verify herz"),
        ("cargo run --release -- build --jobs 2", "cargo run --release -- build --job-count 2"),
        ("cargo test -p fingerpad-tests --test all", "cargo test -p fingerpad-tests --test al"),
        (
            "cargo run --release -p fingerpad --example document",
            "cargo run --release -p fingerpad-fe --example document",
        ),
        ("cargo install --path offline/cli", "cargo install --path offline/client"),
        ("cargo build --release", "cargo build --relase"),
    ] {
        parse(&folder, good).unwrap();
        parse(&folder, bad).expect_err(bad);
    }
}

/// The documented first diagnosis finds the effect that `data/examples/SOURCE.md` names, and prints the text of the page. The finite elements
/// are left out here; nightly runs the whole command.
#[test]
fn the_first_diagnosis_finds_what_the_examples_hide() {
    let folder = sandbox();
    let page = fs::read_to_string(root().join("docs/first-diagnosis.md")).unwrap();
    let command = &fenced(&page)[0];
    let without = command.replace(" --confirm-fe --shape d --mesh-preset coarse", "");
    assert_ne!(&without, command);
    let printed = run(&folder, &without).unwrap();
    let shown = page.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(printed.lines().next(), shown.lines().next());
    let named = printed.lines().find(|line| line.starts_with("Missing: ")).unwrap();
    assert!(shown.replace('\n', " ").contains(named), "{named}");
    let report = folder.json("diagnosis/report.json");
    assert_eq!(report["verdict"], "named");
    assert_eq!(report["effects"].as_array().unwrap().len(), 1);
    assert_eq!(report["effects"][0]["law"], "hydration_bell");
}

fn root() -> PathBuf {
    package().join("../..").canonicalize().unwrap()
}

/// README, the page for contributors, and all other pages, in a fixed order.
fn pages() -> Vec<PathBuf> {
    let root = root();
    let mut pages = vec![root.join("README.md"), root.join("CONTRIBUTING.md")];
    for folder in ["docs", "docs/notes", "docs/pictures", "core", "core/docs", "firmware-example", "data/examples"] {
        let files = fs::read_dir(root.join(folder)).into_iter().flatten().map(|entry| entry.unwrap().path());
        pages.extend(files.filter(|file| file.extension().is_some_and(|e| e == "md")));
    }
    pages[2..].sort();
    pages
}

/// The commands of the fenced `sh` blocks: lines joined at a backslash, comments taken off.
fn fenced(text: &str) -> Vec<String> {
    let blocks = text.split("\n```").skip(1).step_by(2).filter_map(|block| block.strip_prefix("sh\n"));
    let lines = blocks.flat_map(|block| block.replace("\\\n", " ").lines().map(str::to_owned).collect::<Vec<_>>());
    let bare =
        lines.map(|line| line.split(" #").next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" "));
    bare.filter(|line| !line.is_empty() && !line.starts_with('#')).collect()
}

/// Code within sentences that is a command, without those that leave something out.
fn inline(text: &str) -> Vec<String> {
    let sentences: String = text.split("\n```").step_by(2).collect();
    let spans =
        sentences.split('`').skip(1).step_by(2).map(|span| span.split_whitespace().collect::<Vec<_>>().join(" "));
    let spans = spans.map(|span| span.split(" > ").next().unwrap_or_default().to_owned());
    let commands = spans.filter(|span| span.starts_with("fingerpad ") || span.starts_with("cargo "));
    commands.filter(|span| !span.contains(['[', '…', '<'])).collect()
}

/// Anchors of a page's headings, as they are made for links.
fn headings(text: &str) -> BTreeSet<String> {
    let titles = text
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| line.trim_start_matches('#').trim().to_lowercase());
    let anchor = |c: char| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    };
    titles.map(|title| title.chars().filter_map(anchor).collect()).collect()
}

/// A folder with a copy of `data`.
fn sandbox() -> Folder {
    let folder = Folder::new();
    copy(&root().join("data"), &folder.path("data"));
    folder
}

/// Runs a command of `fingerpad`; returns its standard output.
fn run(folder: &Folder, command: &str) -> Result<String, String> {
    let line =
        command.strip_prefix("fingerpad ").ok_or("is neither run nor on the list of those that are only parsed")?;
    printed(&mut folder.command(line))
}

/// Whether a command would be accepted: its options exist, and so do the files that it reads.
fn parse(folder: &Folder, command: &str) -> Result<String, String> {
    inputs(command, |file| folder.exists(file))?;
    accepts(command)
}

/// Whether those files are there that a command reads.
fn inputs(command: &str, there: impl Fn(&str) -> bool) -> Result<(), String> {
    let words: Vec<&str> = command.split(' ').collect();
    let ours = words[0] == "fingerpad" || words.starts_with(&["cargo", "run", "--release", "--"]);
    let made_here = words.contains(&"--design").then_some("--runs");
    let inputs = words.windows(2).filter(|pair| ours && INPUTS.contains(&pair[0]) && made_here != Some(pair[0]));
    match inputs.map(|pair| pair[1]).find(|file| !there(file)) {
        Some(file) => Err(format!("{file} is not there")),
        None => Ok(()),
    }
}

/// Whether the options of a command exist.
fn accepts(command: &str) -> Result<String, String> {
    let words: Vec<&str> = command.split(' ').collect();
    match words[..] {
        ["fingerpad", ref rest @ ..] | ["cargo", "run", "--release", "--", ref rest @ ..] => {
            printed(Command::new(env!("CARGO_BIN_EXE_fingerpad")).args(rest).arg("--help"))
        }
        ["cargo", "xtask", "bench", "bindings" | "core" | "mujoco"] => Ok(String::new()),
        ["cargo", "xtask", "verify", ref rest @ ..] => verification_cases(rest),
        ["cargo", "xtask", "bench", name, ref rest @ ..] => {
            let (name, verb) =
                if name == "calculix" { (name.to_owned(), Some("bench")) } else { (format!("bench_{name}"), None) };
            printed(program(&name, "fingerpad-tests")?.args(verb).args(rest).arg("--help"))
        }
        ["cargo", "xtask", ref rest @ ..] => printed(program("xtask", "xtask")?.args(rest).arg("--help")),
        ["cargo", "install", "--path", folder] => {
            let found = root().join(folder).join("Cargo.toml").exists();
            found.then(String::new).ok_or(format!("{folder} is no package"))
        }
        ["cargo", ref rest @ ..] => cargo(rest),
        _ => Err("is no command that is known here".into()),
    }
}

/// A command of cargo: its own options, the package and the target that it names, the options of the program it runs.
fn cargo(words: &[&str]) -> Result<String, String> {
    let (own, handed_on) = match words.iter().position(|word| *word == "--") {
        Some(at) => (&words[..at], &words[at + 1..]),
        None => (words, &[][..]),
    };
    printed(Command::new(env!("CARGO")).current_dir(root()).args(own).arg("--help"))?;
    let value = |names: &[&str]| own.windows(2).find(|pair| names.contains(&pair[0])).map(|pair| pair[1]);
    let Some(package) = value(&["-p", "--package"]) else { return Ok(String::new()) };
    let metadata = ["metadata", "--no-deps", "--offline", "--format-version", "1"];
    let metadata = printed(Command::new(env!("CARGO")).current_dir(root()).args(metadata))?;
    let metadata: Value = serde_json::from_str(&metadata).map_err(|e| e.to_string())?;
    let packages = metadata["packages"].as_array().ok_or("no packages")?;
    let found = packages.iter().find(|p| p["name"] == package).ok_or(format!("there is no package {package}"))?;
    for kind in ["bin", "test", "bench", "example"] {
        let Some(name) = value(&[&format!("--{kind}")]) else { continue };
        let mut targets = found["targets"].as_array().into_iter().flatten();
        if !targets.any(|t| t["name"] == name && t["kind"][0] == kind) {
            return Err(format!("{package} has no {kind} {name}"));
        }
        if kind == "bin" {
            return match name {
                "verify" => verification_cases(handed_on),
                _ => printed(program(name, package)?.args(handed_on).arg("--help")),
            };
        }
    }
    Ok(String::new())
}

/// Names of verification cases, as the program lists them.
fn verification_cases(words: &[&str]) -> Result<String, String> {
    let list = printed(program("verify", "fingerpad-tests")?.arg("--list"))?;
    for word in words.iter().filter(|word| !["--list", "--quick"].contains(word)) {
        if !list.lines().any(|line| line.starts_with(word)) {
            return Err(format!("there is no case {word}"));
        }
    }
    Ok(list)
}

/// Another program of the workspace: in the folder of this one if tests of the whole workspace have built it; else
/// built now.
fn program(name: &str, package: &str) -> Result<Command, String> {
    let ours = Path::new(env!("CARGO_BIN_EXE_fingerpad"));
    let program = ours.with_file_name(name).with_extension(std::env::consts::EXE_EXTENSION);
    if !program.exists() {
        let folder = ours.parent().and_then(Path::file_name).and_then(|name| name.to_str());
        let profile = folder.filter(|name| *name != "debug").unwrap_or("dev");
        let arguments = ["build", "--quiet", "--profile", profile, "--package", package, "--bin", name];
        printed(Command::new(env!("CARGO")).current_dir(root()).args(arguments))?;
    }
    Ok(Command::new(program))
}

/// The standard output of a command; its standard error if it fails.
fn printed(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| error.to_string())?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).unwrap()),
        }
    }
}
