//! Runs the tables of `tests/cases`: arguments, files, exit code and texts.
//!
//! A table is a TOML file. Its entries are tests: each has a folder of its own, in which its steps run in their order.
//!
//! ```toml
//! [[name_of_the_test]]
//! files."p.csv" = "t_s,depth_mm\n0,0\n"
//! run = "eval --path p.csv --out r.csv"
//! stderr = ["p.csv", "slide_x_mm"]
//! absent = "r.csv"
//! ```

use std::collections::BTreeMap;
use std::slice;

use serde::Deserialize;
use serde_json::Value;

use crate::common::{Folder, changed, packaged};
use crate::models::made;

macro_rules! tables {
    ($($name:ident),*) => {
        $(#[test] fn $name() { check(include_str!(concat!("../cases/", stringify!($name), ".toml"))); })*
    };
}

tables!(build, diagnose, eval, export, finger, identify, mesh, models, places, simulate);

/// One command, or one for each row.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Step {
    /// Files that are written first; see [`content`].
    files: BTreeMap<String, List>,
    /// Command lines without the name of the program.
    run: List,
    /// A row: the text of `file`, or with `base` an edit of it; without `file` the text that replaces `{}` everywhere.
    /// The other cells are texts on standard error.
    rows: Vec<Vec<String>>,
    file: Option<String>,
    base: List,
    /// Exit code; 2 if absent.
    code: Option<i32>,
    /// Texts of the output, see [`fits`]; `holds` has those of files.
    stdout: List,
    stderr: List,
    holds: BTreeMap<String, List>,
    /// Files that exist, that do not exist, and that are as before.
    present: List,
    absent: List,
    unchanged: List,
    /// `file:/json/pointer` or `file:column` (its last row): a value or `[low, high]`. `-` is standard output.
    values: BTreeMap<String, Value>,
    /// Most CPU time of a command.
    cpu_s: Option<u32>,
}

/// One text or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum List {
    One(String),
    Many(Vec<String>),
}

impl Default for List {
    fn default() -> Self {
        Self::Many(Vec::new())
    }
}

impl List {
    fn all(&self) -> &[String] {
        match self {
            Self::One(text) => slice::from_ref(text),
            Self::Many(texts) => texts,
        }
    }
}

fn check(table: &str) {
    let tests: BTreeMap<String, Vec<Step>> = toml::from_str(table).unwrap();
    let mut wrong = String::new();
    for (name, steps) in tests {
        let folder = Folder::new();
        for step in steps {
            step.problems(&folder).iter().for_each(|problem| wrong += &format!("{name}: {problem}\n"));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

impl Step {
    fn problems(&self, folder: &Folder) -> Vec<String> {
        self.files.iter().for_each(|(name, source)| folder.write(name, content(folder, source.all())));
        let one = [Vec::new()];
        let rows = if self.rows.is_empty() { &one[..] } else { &self.rows[..] };
        let mut problems = Vec::new();
        for row in rows {
            let (cell, texts) = row.split_first().map_or(("", row.as_slice()), |(cell, texts)| (cell.as_str(), texts));
            if let Some(file) = &self.file {
                folder.write(file, content(folder, &[self.base.all(), &[cell.to_owned()]].concat()));
            }
            for line in self.run.all() {
                let line = if self.file.is_none() { line.replace("{}", cell) } else { line.clone() };
                problems.extend(self.problem(folder, &line, cell, texts));
            }
        }
        problems
    }

    /// Runs one command; what was wanted and what came.
    fn problem(&self, folder: &Folder, line: &str, cell: &str, texts: &[String]) -> Option<String> {
        let before = self.unchanged.all().iter().map(|name| folder.contents(name)).collect::<Vec<_>>();
        let (code, stdout, stderr) = match self.cpu_s {
            Some(most) => folder.run_limited(line, most),
            None => folder.run(line),
        };
        let mut wanted = Vec::new();
        let mut want = |so: bool, what: String| wanted.extend((!so).then_some(what));
        let expected = self.code.unwrap_or(2);
        want(code == Some(expected), format!("exit code {expected}, not {code:?}"));
        for (name, text, parts) in
            [("stdout", &stdout, self.stdout.all()), ("stderr", &stderr, self.stderr.all()), ("stderr", &stderr, texts)]
        {
            for part in parts.iter().map(|part| part.replace("{}", cell)) {
                want(fits(text, &part), format!("{name} `{part}`"));
            }
        }
        for (name, parts) in &self.holds {
            let bytes = folder.contents(name).remove(name).unwrap_or_default();
            let text = String::from_utf8_lossy(&bytes);
            parts.all().iter().for_each(|part| want(fits(&text, part), format!("{name} `{part}`")));
        }
        self.present.all().iter().for_each(|name| want(folder.exists(name), format!("a file {name}")));
        self.absent.all().iter().for_each(|name| want(!folder.exists(name), format!("no file {name}")));
        for (name, before) in self.unchanged.all().iter().zip(before) {
            want(folder.contents(name) == before, format!("an unchanged {name}"));
        }
        for (place, value) in &self.values {
            let found = found(folder, &stdout, place);
            let within = |ends: &Vec<Value>| found.as_f64() >= ends[0].as_f64() && found.as_f64() <= ends[1].as_f64();
            want(value.as_array().map_or(found == *value, within), format!("{place} {value}, not {found}"));
        }
        let what = if self.file.is_some() { format!(" with {cell:?}") } else { String::new() };
        (!wanted.is_empty()).then(|| {
            format!("`fingerpad {line}`{what}\n  wanted: {}\n  came:   {}{}", wanted.join("; "), stdout, stderr)
        })
    }
}

/// Whether a text has the part; after `!` it must not have it, after `^` it begins with it, after `=` it is it.
fn fits(text: &str, part: &str) -> bool {
    match part.split_at_checked(1) {
        Some(("!", part)) => !text.contains(part),
        Some(("^", part)) => text.starts_with(part),
        Some(("=", part)) => text == part,
        _ => text.contains(part),
    }
}

/// The content of a file: text, `@` and a file of the package, `@made/` and one of `models.rs`, or `@half/` and one of
/// the folder, which is cut. Edits follow: `old => new` for the first place, `old =>> new` for all, `column *= factor`.
fn content(folder: &Folder, source: &[String]) -> Vec<u8> {
    let (source, edits) = source.split_first().expect("a source");
    let bytes = match source.strip_prefix('@').map(|name| (name, name.split_once('/'))) {
        None => source.clone().into_bytes(),
        Some((_, Some(("made", name)))) => made(name),
        Some((_, Some(("half", name)))) => folder.bytes(name)[..folder.bytes(name).len() / 2].to_vec(),
        Some((name, _)) => packaged(name),
    };
    edits.iter().fold(bytes, |bytes, edit| {
        let text = String::from_utf8(bytes).unwrap();
        let has = |old: &str| assert!(text.contains(old), "no `{old}` in {source}");
        let edited = if let Some((old, new)) = edit.split_once(" =>> ") {
            has(old);
            text.replace(old, new)
        } else if let Some((old, new)) = edit.split_once(" => ") {
            has(old);
            text.replacen(old, new, 1)
        } else {
            let (column, factor) = edit.split_once(" *= ").expect("an edit");
            let factor: f64 = factor.parse().unwrap();
            changed(&text, &[column], |v| factor * v)
        };
        edited.into_bytes()
    })
}

/// The value at a place of a file or of standard output.
fn found(folder: &Folder, stdout: &str, place: &str) -> Value {
    let (file, at) = place.split_once(':').expect("file:place");
    match at.starts_with('/') {
        true if file == "-" => serde_json::from_str::<Value>(stdout).unwrap_or_default().pointer(at).cloned(),
        true => folder.json(file).pointer(at).cloned(),
        false => Some(folder.last(file, at).into()),
    }
    .unwrap_or_default()
}
