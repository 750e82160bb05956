//! The outputs of a command, checked before it computes anything.
//!
//! Main types: [`Outputs`], [`Mark`]. Missing folders are made. Paths that cannot be written are refused, as is an
//! output that the command also reads. A file that the command did not write is kept unless `--force` is given. The
//! name `-` means standard input and standard output.

use std::{
    fs,
    io::{self, BufWriter, Read as _, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow};
use fingerpad_formats::atomic_write;

use super::Failure;
use super::results::{self, listed};

/// Files that a command reads and places that it will write, each with the flag that names it.
#[derive(Default)]
pub struct Outputs {
    inputs: Vec<(&'static str, PathBuf)>,
    files: Vec<(&'static str, PathBuf)>,
    /// By which an earlier file of the same command is recognised, of each of `files`.
    marks: Vec<Vec<Mark>>,
    /// Whether files that the command did not write are replaced; None for a command without that flag.
    force: Option<bool>,
    folders: Vec<Folder>,
}

/// The text by which a file is recognised as one that a command wrote.
pub struct Mark {
    /// First bytes.
    pub begins: String,
    /// Text within the first [`HEAD_BYTES`].
    pub holds: &'static str,
}

impl Mark {
    /// Of files that begin so.
    pub fn beginning(begins: impl Into<String>) -> Self {
        Self { begins: begins.into(), holds: "" }
    }

    /// Of files that begin so and then hold a text.
    pub fn holding(begins: impl Into<String>, holds: &'static str) -> Self {
        Self { begins: begins.into(), holds }
    }

    fn is_on(&self, head: &[u8]) -> bool {
        let holds = self.holds.as_bytes();
        head.starts_with(self.begins.as_bytes())
            && (holds.is_empty() || head.windows(holds.len()).any(|window| window == holds))
    }
}

/// Bytes of a file in which marks are looked for.
const HEAD_BYTES: u64 = 16 << 10;

/// A folder that will be written into.
struct Folder {
    flag: &'static str,
    path: PathBuf,
    /// Names of the outputs there; one that ends in `/` covers everything in that folder.
    names: &'static [&'static str],
    /// Whether the folder may hold a user's own files, which are kept.
    shared: bool,
}

impl Outputs {
    /// The files of `inputs` will be read, as far as they are given and exist.
    pub fn beside<'a>(inputs: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>) -> Self {
        let given = |(flag, path): (_, Option<&Path>)| path.filter(|p| p.exists()).map(|p| (flag, p.to_path_buf()));
        Self { inputs: inputs.into_iter().filter_map(given).collect(), ..Self::default() }
    }

    /// A file will be written.
    ///
    /// * `marks`: an existing file that has one of them is an earlier output and is replaced
    pub fn file(mut self, flag: &'static str, path: Option<&Path>, marks: Vec<Mark>) -> Self {
        if let Some(path) = path {
            self.files.push((flag, path.to_path_buf()));
            self.marks.push(marks);
        }
        self
    }

    /// A file that will be written, or standard output if it is called `-`.
    pub fn stream(self, flag: &'static str, path: &Path, marks: Vec<Mark>) -> Self {
        self.file(flag, Some(path).filter(|path| !is_standard(path)), marks)
    }

    /// Whether files that the command did not write are replaced.
    pub fn force(self, force: bool) -> Self {
        Self { force: Some(force), ..self }
    }

    /// Declares files in a folder that belongs to the command alone.
    ///
    /// * `names`: names of outputs that could be an input; a name that ends in `/` is a folder
    pub fn folder(mut self, flag: &'static str, path: &Path, names: &'static [&'static str]) -> Self {
        self.folders.push(Folder { flag, path: path.to_path_buf(), names, shared: false });
        self
    }

    /// The files `names` will be written into a folder that may hold other files as well.
    pub fn shared_folder(mut self, flag: &'static str, path: &Path, names: &'static [&'static str]) -> Self {
        self.folders.push(Folder { flag, path: path.to_path_buf(), names, shared: true });
        self
    }

    /// Refuses paths that cannot be written and outputs that would destroy an input; makes the folders.
    ///
    /// # Errors
    /// [`Failure::Input`] with flag and path.
    pub fn prepare(self) -> Result<(), Failure> {
        self.check().map_err(Failure::Input)
    }

    fn check(&self) -> anyhow::Result<()> {
        for (i, ((flag, path), marks)) in self.files.iter().zip(&self.marks).enumerate() {
            if path.is_dir() {
                return Err(anyhow!("{flag} {}: is a folder; a file is to be written there", path.display()));
            }
            if is_standard(path) {
                return Err(anyhow!("{flag} -: this command does not write to standard output"));
            }
            // A pipe or a device is written as it is and destroys nothing.
            if is_stream(path) {
                continue;
            }
            let place = place(path);
            if let Some((input, read)) = self.inputs.iter().find(|(_, read)| self::place(read) == place) {
                return Err(overwrites(flag, path, input, read));
            }
            if let Some((other, _)) = self.files[..i].iter().find(|(_, other)| self::place(other) == place) {
                return Err(anyhow!("{flag} {}: is the file of {other} as well: give another", path.display()));
            }
            if self.force != Some(true) && path.exists() && !is_earlier(path, marks) {
                let force = if self.force.is_some() { ", or --force to replace it" } else { "" };
                return Err(anyhow!(
                    "{flag} {}: exists and was not written by this command: give another {flag}{force}",
                    path.display()
                ));
            }
        }
        for folder in &self.folders {
            self.check_folder(folder)?;
        }
        for (flag, path) in self.files.iter().filter(|(_, path)| !is_stream(path)) {
            let folder = path.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
            make(folder).with_context(|| format!("{flag} {}", path.display()))?;
        }
        for Folder { flag, path, .. } in &self.folders {
            make(path).with_context(|| format!("{flag} {}", path.display()))?;
        }
        Ok(())
    }

    fn check_folder(&self, Folder { flag, path, names, shared }: &Folder) -> anyhow::Result<()> {
        if path.exists() && !path.is_dir() {
            return Err(anyhow!("{flag} {}: is a file; a folder is needed", path.display()));
        }
        let own = listed(path);
        let root = place(path);
        let is_of_result = |other: &Path| {
            let place = place(other);
            let Ok(inside) = place.strip_prefix(&root) else { return false };
            let inside = inside.to_string_lossy();
            let named = |name: &&str| *name == inside || name.ends_with('/') && inside.starts_with(*name);
            names.iter().any(named) || own.iter().any(|o| *o == inside)
        };
        if let Some((input, read)) = self.inputs.iter().find(|(_, read)| is_of_result(read)) {
            return Err(overwrites(flag, path, input, read));
        }
        if let Some((other, file)) = self.files.iter().find(|(_, file)| is_of_result(file)) {
            return Err(anyhow!("{other} {}: is a file of the result in {flag}: give another", file.display()));
        }
        if *shared { results::check(path, names) } else { Ok(()) }
    }
}

fn overwrites(flag: &str, path: &Path, input: &str, read: &Path) -> anyhow::Error {
    anyhow!("{flag} {}: would overwrite {}, which {input} reads: give another {flag}", path.display(), read.display())
}

/// Whether a path means standard input or output.
pub fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// Reader of an input: standard input for `-`.
pub fn input(path: &Path) -> &Path {
    if is_standard(path) { Path::new("/dev/stdin") } else { path }
}

/// Writes an output: to standard output for `-`, else to a file that is complete or not there.
///
/// # Errors
/// [`Failure::Input`] with the place.
pub fn write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    if !is_standard(path) {
        return Ok(atomic_write(path, fill)?);
    }
    let mut out = BufWriter::new(io::stdout().lock());
    match fill(&mut out).and_then(|()| out.flush()) {
        // The reader has closed the pipe.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        done => done.context("standard output").map_err(Failure::Input),
    }
}

/// Prints a line about an output: on standard error if the output itself is on standard output.
pub fn say(out: &Path, line: &str) {
    if is_standard(out) { eprintln!("{line}") } else { println!("{line}") }
}

/// Whether a file is empty or has one of the marks.
fn is_earlier(path: &Path, marks: &[Mark]) -> bool {
    let mut head = Vec::new();
    let Ok(()) = fs::File::open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head).map(|_| ())) else {
        return false;
    };
    let mut unpacked = Vec::new();
    if head.starts_with(&[0x1f, 0x8b]) {
        // The truncated rest gives an error after the bytes that matter.
        let _ = flate2::read::GzDecoder::new(&head[..]).take(HEAD_BYTES).read_to_end(&mut unpacked);
    }
    head.is_empty() || marks.iter().any(|mark| mark.is_on(&head) || mark.is_on(&unpacked))
}

fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
}

/// Where a path leads, links followed as far as they exist.
fn place(path: &Path) -> PathBuf {
    if let Ok(place) = fs::canonicalize(path) {
        return place;
    }
    match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) if parent != Path::new("") => place(parent).join(name),
        (_, Some(name)) => fs::canonicalize(".").unwrap_or_default().join(name),
        _ => path.to_path_buf(),
    }
}

/// Makes a folder and tries whether a file can be made in it.
fn make(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("the folder {} cannot be made", folder.display()))?;
    tempfile::tempfile_in(folder).with_context(|| format!("the folder {} cannot be written", folder.display()))?;
    Ok(())
}
