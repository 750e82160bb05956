//! The rule by which a law is accepted.
//!
//! Main types: [`SelectionSettings`], [`SignFlipP`], [`SearchedCells`]; main function: [`is_significant`].

use crate::laws::{Column, LAWS, Law};
use crate::statistics::sign_flips::Score;
use crate::statistics::tails::minus_ln_p;

/// Library, level and seed of the tests.
#[derive(Clone, Copy, Debug)]
pub struct SelectionSettings {
    /// Level of the sign-flip test.
    pub alpha: f64,
    /// Seed of the sign flips.
    pub seed: u64,
    /// The library: laws that are tested, and that compete with each other.
    pub laws: &'static [&'static Law],
}

impl Default for SelectionSettings {
    fn default() -> Self {
        Self { alpha: 0.01, seed: 1, laws: LAWS }
    }
}

/// The p of the sign flips.
#[derive(Clone, Copy, Debug)]
pub struct SignFlipP {
    /// Share of sign flips that reach the score.
    pub p: f64,
    /// Whether the evidence lies in the calibration, so that flips of the measured runs speak neither for nor against.
    pub by_calibration: bool,
}

/// Whether a law is accepted: a gain beyond the Bayesian information criterion's penalty, and three combinations of
/// model-based p and sign-flip p, of which the stricter one may make up for the other.
pub fn is_significant(
    settings: &SelectionSettings,
    law: &Law,
    gain: f64,
    runs: usize,
    p_model: f64,
    p_runs: SignFlipP,
) -> bool {
    let penalised = gain - (runs as f64).ln() * law.parameters.len() as f64 > 0.0;
    if p_runs.by_calibration {
        return penalised && p_model <= against_calibration(settings);
    }
    penalised
        && p_runs.p <= few_runs(law)
        && ((p_runs.p <= settings.alpha && p_model <= loosest(settings))
            || (p_model <= 1e-2 * settings.alpha && p_runs.p <= 0.25)
            || (p_model <= 1e-7 * settings.alpha && p_runs.p <= 0.5))
}

/// Largest p of the sign flips of a law that fades along the stroke. At the onset of sliding a baseline's form is known
/// least: what shows there in a few runs only is no such law.
pub const LARGEST_P_ALONG_STROKE: f64 = 0.05;

/// Largest p of the sign flips, by which evidence may rest on few runs.
fn few_runs(law: &Law) -> f64 {
    if law.drivers.contains(&Column::Slide) { LARGEST_P_ALONG_STROKE } else { 1.0 }
}

/// Share of a gain that comes from the calibration's prior from which on the evidence is called the calibration's.
pub const BY_CALIBRATION: f64 = 0.3;

/// Numbers of scores for the Bonferroni correction: of laws that show against the calibration, and of all.
#[derive(Clone, Copy, Debug)]
pub struct SearchedCells {
    calibration: f64,
    runs: f64,
}

impl SearchedCells {
    /// Before any scan of a grid of so many points.
    pub fn all(grid: usize) -> Self {
        Self { calibration: 1.0, runs: grid.max(1) as f64 }
    }

    /// From the scores of a scan.
    pub fn of(scores: &[Score]) -> Self {
        let calibration = scores.iter().filter(|s| s.prior_share() > BY_CALIBRATION && s.minus_ln_p() > 1.0).count();
        Self { calibration: calibration.max(1) as f64, runs: scores.len().max(1) as f64 }
    }

    /// Model-based p of a gain.
    pub fn p(&self, gain: f64, parameters: usize, by_calibration: bool) -> f64 {
        let cells = if by_calibration { self.calibration } else { self.runs };
        (cells * (-minus_ln_p(gain.max(0.0), parameters)).exp()).min(1.0)
    }
}

/// The model-based p at which a law stands whose evidence lies against the calibration.
pub fn against_calibration(settings: &SelectionSettings) -> f64 {
    0.1 * settings.alpha
}

/// The loosest model-based p at which any law stands: what a law that came in by a swap must reach, too.
pub fn loosest(settings: &SelectionSettings) -> f64 {
    0.3 * settings.alpha
}
