//! What a command will write, checked before it computes anything.
//!
//! Main type: [`Outputs`]. Missing folders are made, places that cannot be written are refused, and no output may be a
//! file that the command reads.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow};

use super::Failure;
use super::results::{self, listed};

/// Files that a command reads and places that it will write, each with the flag that names it.
#[derive(Default)]
pub struct Outputs {
    inputs: Vec<(&'static str, PathBuf)>,
    files: Vec<(&'static str, PathBuf)>,
    folders: Vec<Folder>,
}

/// A folder that will be written into.
struct Folder {
    flag: &'static str,
    path: PathBuf,
    /// Names of what is written there; one that ends in `/` stands for everything in that folder.
    names: &'static [&'static str],
    /// Whether the folder may hold a user's own files, which stay.
    shared: bool,
}

impl Outputs {
    /// The files of `inputs` will be read, as far as they are given and exist.
    pub fn beside<'a>(inputs: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>) -> Self {
        let given = |(flag, path): (_, Option<&Path>)| path.filter(|p| p.exists()).map(|p| (flag, p.to_path_buf()));
        Self { inputs: inputs.into_iter().filter_map(given).collect(), ..Self::default() }
    }

    /// A file will be written.
    pub fn file(mut self, flag: &'static str, path: Option<&Path>) -> Self {
        self.files.extend(path.map(|p| (flag, p.to_path_buf())));
        self
    }

    /// Files will be written into a folder that belongs to the command alone.
    ///
    /// * `names`: what is written there and could be an input; a name that ends in `/` stands for a folder
    pub fn folder(mut self, flag: &'static str, path: &Path, names: &'static [&'static str]) -> Self {
        self.folders.push(Folder { flag, path: path.to_path_buf(), names, shared: false });
        self
    }

    /// The files `names` will be written into a folder that may hold other files as well.
    pub fn shared_folder(mut self, flag: &'static str, path: &Path, names: &'static [&'static str]) -> Self {
        self.folders.push(Folder { flag, path: path.to_path_buf(), names, shared: true });
        self
    }

    /// Refuses what cannot be written or would destroy an input; makes the folders.
    ///
    /// Errors: [`Failure::Input`] with flag and path.
    pub fn prepare(self) -> Result<(), Failure> {
        self.check().map_err(Failure::Input)
    }

    fn check(&self) -> anyhow::Result<()> {
        for (i, (flag, path)) in self.files.iter().enumerate() {
            if path.is_dir() {
                return Err(anyhow!("{flag} {}: is a folder; a file is to be written there", path.display()));
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
