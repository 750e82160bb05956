//! The times of the steps, kept in `target/gates.json` from one run to the next.
//!
//! Main type: [`Times`]. Independent of the steps' content.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

/// Growth over the last run above which it is reported, and the least growth that is not noise, s.
const GROWTH: f64 = 1.25;
const LEAST_GROWTH_S: f64 = 2.0;

/// The last two runs of every step.
#[derive(Default, Serialize, Deserialize)]
pub struct Times {
    steps: BTreeMap<String, Runs>,
}

#[derive(Serialize, Deserialize)]
struct Runs {
    last: StepRun,
    before: Option<StepRun>,
}

/// One run of a step.
#[derive(Clone, Serialize, Deserialize)]
struct StepRun {
    seconds: f64,
    passed: bool,
    /// Commit that was checked out, short.
    commit: String,
    /// Mean number of runnable processes over the last minute when the step ended.
    load: Option<f64>,
    /// When it ended, s since 1970.
    ended_s: u64,
}

impl Times {
    fn file(root: &Path) -> PathBuf {
        root.join("target/gates.json")
    }

    /// The stored times; none in a fresh clone.
    pub fn read(root: &Path) -> Result<Self> {
        let file = Self::file(root);
        match fs::read(&file) {
            Ok(bytes) => serde_json::from_slice(&bytes).with_context(|| file.display().to_string()),
            Err(_) => Ok(Self::default()),
        }
    }

    /// Stores the run of a step. Two processes may do this at once: each holds the file's lock meanwhile.
    pub fn store(root: &Path, name: &str, time: Duration, passed: bool) -> Result<()> {
        fs::create_dir_all(root.join("target"))?;
        let lock = fs::File::create(root.join("target/gates.lock"))?;
        lock.lock()?;
        let mut times = Self::read(root)?;
        let last =
            StepRun { seconds: time.as_secs_f64(), passed, commit: commit(root), load: load(), ended_s: now_s() };
        // A failed run ended early: the next one is not compared with it.
        let before =
            times.steps.remove(name).and_then(|runs| if runs.last.passed { Some(runs.last) } else { runs.before });
        times.steps.insert(name.to_owned(), Runs { last, before });
        let text = serde_json::to_string_pretty(&times)? + "\n";
        Ok(fs::write(Self::file(root), text)?)
    }

    /// Prints these steps beside their runs before; `wall` is the time of all by the clock, which ends now.
    pub fn print(&self, names: &[String], wall: Duration) {
        let start_s = now_s().saturating_sub(wall.as_secs() + 1);
        println!("\n{:<14} {:>8} {:>8}", "step", "seconds", "before");
        for name in names {
            let Some(Runs { last, before }) = self.steps.get(name).filter(|runs| runs.last.ended_s >= start_s) else {
                println!("{name:<14} {:>8}", "not run");
                continue;
            };
            let earlier = before.as_ref().map_or_else(|| "-".to_owned(), |run| format!("{:.1}", run.seconds));
            let note = match before {
                _ if !last.passed => "  failed".to_owned(),
                Some(run) if grew(run.seconds, last.seconds) => {
                    format!("  {:+.0} % over {}", 100.0 * (last.seconds / run.seconds - 1.0), run.commit)
                }
                _ => String::new(),
            };
            println!("{name:<14} {:>8.1} {earlier:>8}{note}", last.seconds);
        }
        println!("{:<14} {:>8.1}", "by the clock", wall.as_secs_f64());
    }
}

fn grew(before: f64, now: f64) -> bool {
    now > GROWTH * before && now - before > LEAST_GROWTH_S
}

fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

fn commit(root: &Path) -> String {
    let out = Command::new("git").current_dir(root).args(["rev-parse", "--short", "HEAD"]).output();
    out.map_or_else(|_| String::new(), |out| String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

fn load() -> Option<f64> {
    fs::read_to_string("/proc/loadavg").ok()?.split(' ').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_compared_with_the_last_one_that_passed() {
        let folder = tempfile::tempdir().unwrap();
        let store = |seconds: f64, passed| {
            Times::store(folder.path(), "format", Duration::from_secs_f64(seconds), passed).unwrap();
            let runs = Times::read(folder.path()).unwrap().steps.remove("format").unwrap();
            (runs.last.seconds, runs.before.map(|run| run.seconds))
        };
        assert_eq!(store(10.0, true), (10.0, None));
        assert_eq!(store(11.0, true), (11.0, Some(10.0)));
        assert_eq!(store(3.0, false), (3.0, Some(11.0)));
        assert_eq!(store(12.0, true), (12.0, Some(11.0)));
        assert!(grew(10.0, 13.0) && !grew(10.0, 12.0) && !grew(1.0, 2.5));
    }
}
