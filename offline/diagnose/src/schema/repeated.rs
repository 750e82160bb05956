//! What repeated decisions of one protocol show: the power of its runs, and the stability of its verdict.

use serde::{Deserialize, Serialize};

use super::Verdict;

/// A count of sets with its share and the interval of the share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Sets that count.
    pub count: usize,
    /// Sets in all.
    pub sets: usize,
    /// 95 % interval of the share [Wilson 1927].
    pub ci95: [f64; 2],
}

impl Rate {
    /// The rate of `count` in `sets`; without a set its interval is 0 to 1.
    pub fn of(count: usize, sets: usize) -> Self {
        const Z: f64 = 1.96;
        let n = sets as f64;
        if sets == 0 {
            return Self { count, sets, ci95: [0.0, 1.0] };
        }
        let share = count as f64 / n;
        let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        Self { count, sets, ci95: [(middle - half).max(0.0), (middle + half).min(1.0)] }
    }

    /// Share of the sets; NaN without a set.
    pub fn share(&self) -> f64 {
        self.count as f64 / self.sets as f64
    }
}

/// Simulated sets with one effect of one size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PowerCell {
    /// Law; `all` for the sum over the laws.
    pub law: String,
    /// Its family.
    pub family: String,
    /// Size: the 90th percentile of the relative change of a force.
    pub size_p90_relative: f64,
    /// Sets whose verdict is another one than `none`.
    pub detected: Rate,
    /// Sets in which the family is named, and it alone.
    pub named: Rate,
    /// Sets in which another family is named alone.
    pub misnamed: Rate,
}

/// A law or a size that was not simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotSimulated {
    /// Law.
    pub law: String,
    /// Size; 0 for all sizes.
    pub size_p90_relative: f64,
    /// Why.
    pub reason: String,
}

/// What simulated repetitions of the measured runs show, from the calibrated model, noise and scatter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Power {
    /// Sets without an effect whose verdict is another one than `none`.
    pub false_alarm: Rate,
    /// All laws together, by size.
    pub by_size: Vec<PowerCell>,
    /// Each law at each size.
    pub cells: Vec<PowerCell>,
    /// What was not simulated.
    pub not_simulated: Vec<NotSimulated>,
    /// Sets in all.
    pub sets: usize,
    /// Wall time, s.
    pub elapsed_s: f64,
    /// Whether it was interrupted before its time was over.
    pub interrupted: bool,
    /// Seed.
    pub seed: u64,
}

/// The decision with some of the measured runs left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The runs that were left out.
    pub runs: Vec<String>,
    /// The verdict without them.
    pub verdict: Verdict,
    /// Laws that are named or lead their candidates, strongest first.
    pub laws: Vec<String>,
    /// Gain of the strongest law in 2 log likelihood; without a law that of the strongest test.
    pub gain_2ll: f64,
}

/// How the verdict holds when each part of the measured runs is left out in turn (a jackknife by groups of runs).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// The decision with all runs.
    pub all: LeftOut,
    /// The decisions with one group of runs left out.
    pub groups: Vec<LeftOut>,
    /// Groups without which verdict and families are the same.
    pub kept: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wilson's interval of 0 of 10 and of 9 of 10, from the table of Newcombe 1998 and by hand.
    #[test]
    fn intervals_are_those_of_wilson() {
        for (count, sets, low, high) in [(0, 10, 0.0, 0.2775), (9, 10, 0.5958, 0.9821), (81, 263, 0.2553, 0.3662)] {
            let [a, b] = Rate::of(count, sets).ci95;
            assert!((a - low).abs() < 5e-4 && (b - high).abs() < 5e-4, "{count} of {sets}: {a} {b}");
        }
        assert_eq!(Rate::of(0, 0).ci95, [0.0, 1.0]);
    }
}
