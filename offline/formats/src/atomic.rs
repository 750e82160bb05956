//! Writing a file so that it is either whole or not there.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use super::Error;

/// Files that are being written, under their temporary names.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file beside its final place and renames it there once all of it is on the disk.
///
/// On any error the old content of `path`, if any, is untouched and the partial file is removed. A link is followed:
/// the file it points to is replaced. Other kinds of files (a pipe, `/dev/stdout`) are written directly.
///
/// # Errors
/// [`Error::File`] with `path`; an error of `fill` is wrapped the same way.
pub fn atomic_write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    write(path, fill).map_err(|source| Error::File { path: path.to_path_buf(), source })
}

/// Removes the temporary files of all unfinished writes of this process, for a program that ends in the middle of them.
pub fn discard_unfinished() {
    discard(|_| true);
}

fn discard(those: impl Fn(&Path) -> bool) {
    for file in unfinished().extract_if(.., |file| those(file)) {
        // One that is already in its final place is no longer under this name.
        let _ = fs::remove_file(file);
    }
}

fn write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    // Replacing a device node by a file would be worse than a half-written stream.
    if fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir()) {
        let mut out = BufWriter::new(fs::OpenOptions::new().write(true).open(path)?);
        fill(&mut out)?;
        return out.flush();
    }
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    if target.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".partial-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // tempfile's own default is private to the owner; a result is an ordinary file, less the umask.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    fs::metadata(folder)?;
    // The crate's own message names the temporary file, which the user does not know.
    let file = builder.tempfile_in(folder).map_err(|error| io::Error::from(error.kind()))?;
    let name = file.path().to_path_buf();
    unfinished().push(name.clone());
    let written = fill_and_rename(file, &target, fill);
    unfinished().retain(|other| *other != name);
    written
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

fn fill_and_rename(
    file: NamedTempFile,
    target: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(target).map_err(|e| e.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.csv");
        atomic_write(&path, |w| w.write_all(b"old")).unwrap();
        let error = atomic_write(&path, |w| {
            w.write_all(&[b'x'; 100_000])?;
            Err(std::io::Error::other("cut off"))
        })
        .unwrap_err();
        assert!(error.to_string().ends_with("a.csv: cut off"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(dir.path()), ["a.csv"]);
    }

    #[test]
    fn an_unfinished_file_is_discarded() {
        let dir = tempfile::tempdir().unwrap();
        let (path, mut seen) = (dir.path().join("a.csv"), Vec::new());
        let error = atomic_write(&path, |_| {
            seen = names(dir.path());
            // Those of other tests of this process stay.
            discard(|file| file.starts_with(dir.path()));
            assert_eq!(names(dir.path()), [""; 0]);
            Ok(())
        });
        assert!(seen.len() == 1 && seen[0].starts_with(".partial-"), "{seen:?}");
        assert!(error.is_err() && !path.exists());
    }

    #[test]
    fn a_missing_folder_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("no/such/a.csv");
        let error = atomic_write(&path, |w| w.write_all(b"x")).unwrap_err();
        assert!(error.to_string().contains("no/such/a.csv: "), "{error}");
        assert!(!error.to_string().contains(".partial-"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_with_the_path() {
        let error = atomic_write(Path::new("/dev/full"), |w| w.write_all(b"x")).unwrap_err();
        assert!(error.to_string().starts_with("/dev/full: No space left on device"), "{error}");
        assert!(!fs::metadata("/dev/full").unwrap().is_file());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_results_are_readable_by_others() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let (target, link) = (dir.path().join("target"), dir.path().join("link"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        atomic_write(&link, |w| w.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        let reference = dir.path().join("reference");
        fs::write(&reference, "").unwrap();
        let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&target), mode(&reference));
    }
}
