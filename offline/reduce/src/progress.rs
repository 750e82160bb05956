//! Progress of a fit: the number of finished minimisations, and the iterations of the present one.
//!
//! Main type: [`FitProgress`].

use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts the minimisations of a fit and reports each iteration.
pub struct FitProgress<'a> {
    done: AtomicUsize,
    all: AtomicUsize,
    iteration: AtomicUsize,
    report: &'a (dyn Fn(FitStage) + Sync),
}

/// Progress of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FitStage {
    /// Number of finished minimisations.
    pub done: usize,
    /// Number of minimisations of the whole fit.
    pub all: usize,
    /// Iterations of the present one.
    pub iteration: usize,
}

impl<'a> FitProgress<'a> {
    /// Calls `report` at each iteration.
    pub fn new(report: &'a (dyn Fn(FitStage) + Sync)) -> Self {
        Self { done: AtomicUsize::new(0), all: AtomicUsize::new(0), iteration: AtomicUsize::new(0), report }
    }

    /// Sets the number of minimisations.
    pub(crate) fn expect(&self, all: usize) {
        self.all.store(all, Ordering::Relaxed);
        self.send();
    }

    /// One minimisation is finished.
    pub(crate) fn finish_one(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.iteration.store(0, Ordering::Relaxed);
        self.send();
    }

    /// One more iteration of the present minimisation.
    pub(crate) fn iterate(&self) {
        self.iteration.fetch_add(1, Ordering::Relaxed);
        self.send();
    }

    fn send(&self) {
        let of = |number: &AtomicUsize| number.load(Ordering::Relaxed);
        (self.report)(FitStage { done: of(&self.done), all: of(&self.all), iteration: of(&self.iteration) });
    }
}

impl Default for FitProgress<'_> {
    /// Reports nothing.
    fn default() -> Self {
        Self::new(&|_| {})
    }
}
