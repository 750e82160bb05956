//! Simulates the power of a diagnosis and decides again without groups of runs, each with a bar.

use std::sync::atomic::{AtomicUsize, Ordering};

use fingerpad_diagnose::{Power, PowerSettings, Redecision, Stability, power, stability};

use crate::interrupt::{go_on, keeping};
use crate::progress::{bar, counter};

/// Simulates the power, with a bar; Ctrl-C ends it with the sets that were counted.
pub fn simulate_power(again: &Redecision<'_>, settings: &PowerSettings) -> Power {
    let _keeping = keeping();
    let bar = bar("power".into());
    let found = power(again, settings, &|sets, share| {
        bar.set_share(share);
        bar.say(format!("{sets} simulated sets"));
        go_on()
    });
    bar.finish_and_clear();
    found
}

/// Decides with each group of runs left out, with a bar.
pub fn leave_out_groups(again: &Redecision<'_>, groups: usize, threads: usize) -> Option<Stability> {
    let bar = counter("stability", groups + 1, "decisions");
    let done = AtomicUsize::new(0);
    let found = stability(again, groups, threads, &|| {
        done.fetch_add(1, Ordering::Relaxed);
        bar.count();
    });
    bar.finish_and_clear();
    found
}
