//! The rule by which a law is accepted.
//!
//! Main types: [`SelectionSettings`], [`SignFlipP`], [`SearchedCells`]; main functions: [`decisive_p`], [`is_significant`].

use crate::laws::{Column, LAWS, Law};
use crate::statistics::sign_flips::Score;
use crate::statistics::tails::minus_ln_p;

/// Library, level and seed of the tests.
#[derive(Clone, Copy, Debug)]
pub struct SelectionSettings {
    /// Level of a law: the largest `decisive_p` with which it is accepted.
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

/// Whether a law is accepted: a gain beyond the Bayesian information criterion's penalty, and a [`decisive_p`] up to alpha.
pub fn is_significant(
    settings: &SelectionSettings,
    law: &Law,
    gain: f64,
    runs: usize,
    p_model: f64,
    p_runs: SignFlipP,
) -> bool {
    gain > (runs as f64).ln() * law.parameters.len() as f64
        && (p_runs.by_calibration || p_runs.p <= few_runs(law))
        && decisive_p(p_model, p_runs) <= settings.alpha
}

/// The p of a law, from that by the model and that of the sign flips: the least of three combinations, in which the stronger test makes up
/// for the weaker one. With 0.01 the flips may have 0.01, 0.25 or 0.5 where the model has 0.003, 1e-4 or 1e-9; a smaller p asks more of
/// both. Evidence that lies in the calibration has the model's alone, ten times.
pub fn decisive_p(p_model: f64, p_runs: SignFlipP) -> f64 {
    if p_runs.by_calibration {
        return (10.0 * p_model).min(1.0);
    }
    let flips = p_runs.p;
    let combined = [(flips, 0.3), ((4e-4 * flips).sqrt(), 1e-2), ((2e-4 * flips).sqrt(), 1e-7)];
    combined.into_iter().map(|(of_runs, share)| of_runs.max(p_model / share)).fold(1.0, f64::min)
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

/// The loosest model-based p at which any law stands.
pub fn loosest(settings: &SelectionSettings) -> f64 {
    0.3 * settings.alpha
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_decides_over_both_tests_together() {
        let p = |p_model, p| decisive_p(p_model, SignFlipP { p, by_calibration: false });
        // At the default level these are the edges of the rule.
        for (p_model, flips) in [(3e-3, 0.01), (1e-4, 0.25), (1e-9, 0.5)] {
            assert!((p(p_model, flips) - 0.01).abs() < 1e-12, "{p_model} {flips}");
            assert!(p(1.01 * p_model, flips) > 0.01 && p(p_model, 1.01 * flips) > 0.01, "{p_model} {flips}");
        }
        // A p of the flips of 0.016 never passes at 0.001, however small that of the model is.
        assert!((0.001..0.01).contains(&p(1e-80, 0.016)));
        assert_eq!(decisive_p(1e-4, SignFlipP { p: 1.0, by_calibration: true }), 1e-3);
    }
}
