//! The score of both simulators in five practices, or of its ambiguous sets alone.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use fingerpad_tests::synthetic_truth::score_sets::{self, Kind, Outcome, ScoreSet};
use fingerpad_tests::synthetic_truth::score_table::{settling, table};
use fingerpad_tests::synthetic_truth::sets::Hide;

use crate::Args;

/// Judges the sets that the file does not hold yet, and prints the table of all that it holds.
pub fn whole_score(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    let name = if args.ambiguous { "ambiguous" } else { "score" };
    let path = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("target/diagnose-{name}-{}.jsonl", args.seed)));
    let mut wanted = score_sets::sets(args.seed, args.simulator.kinds());
    wanted.retain(|set| args.only.is_empty() || args.only.contains(&set.seed));
    wanted.retain(|set| !args.ambiguous || set.kind == Kind::Single);
    wanted.retain(|set| args.kinds.is_empty() || args.kinds.iter().any(|kind| kind == name_of(set)));
    wanted.truncate(args.sets.unwrap_or(usize::MAX));
    let (stored, done) = known(&path, &wanted)?;
    let left: Vec<ScoreSet> = wanted.iter().filter(|set| done.iter().all(|o| o.set != **set)).copied().collect();
    eprintln!("seed {}: {} of {} sets are in {}", args.seed, done.len(), wanted.len(), path.display());
    let (next, out) = (AtomicUsize::new(0), Mutex::new((stored, done)));
    std::thread::scope(|scope| {
        for _ in 0..args.threads {
            scope.spawn(|| {
                while let Some(set) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let judge = if args.ambiguous { score_sets::judge_if_ambiguous } else { score_sets::judge };
                    let outcome = judge(*set);
                    let line = serde_json::to_string(&outcome).expect("plain numbers") + "\n";
                    let (file, done) = &mut *out.lock().expect("no thread panics with it");
                    file.write_all(line.as_bytes()).expect("the file can be written to");
                    done.push(outcome);
                    if done.len().is_multiple_of(20) {
                        eprintln!("{} of {}", done.len(), wanted.len());
                    }
                }
            });
        }
    });
    let (_, done) = out.into_inner()?;
    println!("seed {}, {}", args.seed, if args.ambiguous { settling(&done) } else { table(&done) });
    Ok(())
}

/// The name of a set's kind among the arguments.
fn name_of(set: &ScoreSet) -> &'static str {
    match (set.kind, set.hide) {
        (Kind::Nothing, _) => "none",
        (Kind::Single, _) => "single",
        (Kind::Pair, _) => "pair",
        (Kind::Outside, Hide::Unrecorded(_)) => "unrecorded",
        (Kind::Outside, _) => "outside",
    }
}

/// The file, ready for further lines, and what it holds of the wanted sets. A line that a stop cut short is judged again.
fn known(path: &PathBuf, wanted: &[ScoreSet]) -> Result<(fs::File, Vec<Outcome>), Box<dyn std::error::Error>> {
    let stored = if path.exists() { fs::read_to_string(path)? } else { String::new() };
    let whole = stored.rfind('\n').map_or(0, |end| end + 1);
    let mut done: Vec<Outcome> = stored[..whole].lines().map(serde_json::from_str).collect::<Result<_, _>>()?;
    done.retain(|o| wanted.contains(&o.set));
    let file = fs::OpenOptions::new().create(true).append(true).open(path)?;
    file.set_len(whole as u64)?;
    Ok((file, done))
}
