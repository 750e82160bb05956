//! A folder of results that holds one result only.
//!
//! The folder's list, [`LIST`], names every file that was written there. The next result removes exactly these files;
//! all others belong to the user and are kept.

use std::{
    fs,
    path::{Component, Path},
};

use anyhow::Context;
use fingerpad_formats::atomic_write;

use super::Failure;

/// Name of the list.
pub const LIST: &str = "files.txt";

/// First line of the list.
const HEADER: &str = "# Files of this result, written by fingerpad; the next result in this folder removes them.";

/// Files that an earlier result left in a folder, by its list.
pub fn listed(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join(LIST)).unwrap_or_default();
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Vec::new();
    }
    // An edited list must not lead out of the folder.
    let inside =
        |name: &&str| !name.is_empty() && Path::new(name).components().all(|c| matches!(c, Component::Normal(_)));
    lines.filter(inside).map(str::to_owned).collect()
}

/// Refuses a folder that holds one of `names` from another source than an earlier result. A name that ends in `/` is a
/// folder; it belongs to a result if the list names a file in it.
///
/// # Errors
/// The conflicting file.
pub fn check(folder: &Path, names: &[&str]) -> anyhow::Result<()> {
    let own = listed(folder);
    let is_own = |name: &str| own.iter().any(|o| o == name || name.ends_with('/') && o.starts_with(name));
    match names.iter().find(|name| folder.join(name).exists() && !is_own(name)) {
        None => Ok(()),
        Some(name) => anyhow::bail!(
            "{}: is there and not of a result that this program wrote ({LIST} does not name it): remove it, or give \
             another folder",
            folder.join(name).display()
        ),
    }
}

/// Writes a result in place of the earlier one.
///
/// * `files`: names within the folder, with `/`, and contents; the page last, so that it never refers to missing files
///
/// # Errors
/// [`Failure::Input`] with the file.
pub fn write(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    let place = |path: &Path| path.display().to_string();
    // The page is removed first and the list last: an interruption at any point leaves no mixture.
    for name in listed(folder).iter().rev() {
        let old = folder.join(name);
        if old.exists() {
            fs::remove_file(&old).with_context(|| place(&old)).map_err(Failure::Input)?;
        }
    }
    let mut list = format!("{HEADER}\n");
    for (name, _) in files {
        list += &format!("{name}\n");
    }
    atomic_write(&folder.join(LIST), |w| w.write_all(list.as_bytes()))?;
    for (name, content) in files {
        let file = folder.join(name);
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent).with_context(|| place(parent)).map_err(Failure::Input)?;
        }
        atomic_write(&file, |w| w.write_all(content))?;
    }
    Ok(())
}
