//! The state of a run on the disk, so that a run that was killed resumes in the middle of its path.

use std::path::Path as FilePath;
use std::time::{Duration, Instant};

use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use super::Path;

/// File and interval of the saved states of a run.
///
/// A run that resumes from a saved state gives the same numbers, bit for bit, as an uninterrupted one; only the times
/// in its cost differ. The file is removed when the run ends, unless it was interrupted.
#[derive(Clone, Copy, Debug)]
pub struct Checkpoint<'a> {
    /// The file.
    pub file: &'a FilePath,
    /// Time between two saves.
    pub period: Duration,
    /// Identifies all settings of the run besides its path, such as their hash; a file of another key is not used.
    pub key: &'a str,
}

/// Version of the saved data.
const FORMAT: u32 = 6;

/// The saves of one run.
pub(super) struct Saves<'a> {
    checkpoint: Checkpoint<'a>,
    key: String,
    last_write: Instant,
    /// The state to be written, with the key.
    bytes: Option<Vec<u8>>,
}

impl<'a> Saves<'a> {
    pub fn new(checkpoint: Checkpoint<'a>, path: &Path, snapshots: &[usize], is_half: bool) -> Self {
        let run = serde_json::to_string(&(FORMAT, checkpoint.key, path, snapshots, is_half)).expect("plain numbers");
        let key = Sha256::digest(run).iter().map(|byte| format!("{byte:02x}")).collect();
        Self { checkpoint, key, last_write: Instant::now(), bytes: None }
    }

    /// The saved state of this run; None if there is no such file, or one of another run.
    pub fn read<T: DeserializeOwned>(&self) -> Option<T> {
        let bytes = std::fs::read(self.checkpoint.file).ok()?;
        let (key, rest): (String, &[u8]) = postcard::take_from_bytes(&bytes).ok()?;
        (key == self.key).then(|| postcard::from_bytes(rest).ok()).flatten()
    }

    /// Takes the state at the end of an increment, and saves it if the interval has passed.
    ///
    /// Within an increment the run changes its own starting point (the factor, the step size): only the state at the
    /// end of an increment gives the same numbers again.
    pub fn take<T: Serialize>(&mut self, state: &T) -> Result<(), fingerpad_formats::Error> {
        self.bytes = Some(postcard::to_stdvec(&(&self.key, state)).expect("plain numbers"));
        if self.last_write.elapsed() >= self.checkpoint.period { self.write() } else { Ok(()) }
    }

    /// Saves the last state taken, in place of an earlier file.
    pub fn write(&mut self) -> Result<(), fingerpad_formats::Error> {
        if let Some(bytes) = self.bytes.take() {
            fingerpad_formats::atomic_write(self.checkpoint.file, |w| w.write_all(&bytes))?;
            self.last_write = Instant::now();
        }
        Ok(())
    }

    /// Removes the file.
    pub fn remove(&self) {
        // A file that is not there, or cannot be removed, changes no result: its key would have to be right.
        let _ = std::fs::remove_file(self.checkpoint.file);
    }
}
