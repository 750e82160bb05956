//! What is known of strength and stiffness: a weight for each twin, and a normal distribution of the stiffness factor under it.
//!
//! Main types: [`Evidence`], [`Posterior`]. Uses stick and math.

use super::stick::Stick;
use crate::math::{Elementary, Scalar, sqrt};

/// Sums of the evidence of one twin, with A the measured and B the twin's innovation: A · B / S and B · B / S.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    pub(super) cross: f32,
    pub(super) square: f32,
}

/// Bound of the sums, so that the square of one is finite.
const EVIDENCE_MAX: f32 = 1e15;

impl Evidence {
    pub(super) fn add(&mut self, kept: f32, cross: f32, square: f32) {
        self.cross = (self.cross * kept + cross).clamp(-EVIDENCE_MAX, EVIDENCE_MAX);
        self.square = (self.square * kept + square).not_negative().at_most(EVIDENCE_MAX);
    }
}

/// A normal distribution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normal {
    pub(super) mean: f32,
    pub(super) variance: f32,
}

/// Largest logarithm of the twins' ratio of strength and stiffness factor; the least one is as far below 0.
const RATIO_MAX: f64 = 1.44;
/// e to the power of the least logarithm.
const RATIO_LEAST: f32 = 0.236_927_76;

/// Steps of a geometric series of ratios.
struct Steps<const TWINS: usize>;

impl<const TWINS: usize> Steps<TWINS> {
    const OF_LOGARITHM: f64 = {
        assert!(TWINS >= 5 && TWINS % 2 == 1, "an odd number of twins, at least 5: the middle one has the ratio 1");
        2.0 * RATIO_MAX / (TWINS - 1) as f64
    };
    const STEP: f32 = Self::OF_LOGARITHM as f32;
    /// e to the power of a step.
    const GROWTH: f32 = {
        let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
        while k < 20.0 {
            term *= Self::OF_LOGARITHM / k;
            sum += term;
            k += 1.0;
        }
        sum as f32
    };
}

/// Logarithm and value of the twins' ratio of strength and stiffness factor.
pub(super) fn ratios<const TWINS: usize>() -> impl Iterator<Item = (f32, f32)> {
    let start = -((TWINS / 2) as f32) * Steps::<TWINS>::STEP;
    let mut ratio = RATIO_LEAST;
    (0..TWINS).map(move |k| {
        let this = ratio;
        ratio *= Steps::<TWINS>::GROWTH;
        (start + Steps::<TWINS>::STEP * k as f32, this)
    })
}

/// The distribution of the strength factor: a sum of bells, one for each twin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posterior<const TWINS: usize> {
    weight: [f32; TWINS],
    centre: [f32; TWINS],
    /// One over the width of the bell.
    per_width: [f32; TWINS],
    /// Logarithm of the strength factor.
    pub(super) logarithm: Normal,
    pub(super) stiffness: Normal,
    /// The twin of the largest weight.
    pub(super) best: usize,
}

/// Width of the bell 6 t (1 − t) over its standard deviation.
const WIDTH: f32 = 4.472;
/// Weight of a twin over the largest below which it is excluded.
const POSSIBLE: f32 = 1e-3;
/// Range of the quantiles.
const LEAST: f32 = 0.1;
const MOST: f32 = 8.0;
/// Halvings of that range: to 3.4 %, and a straight line within.
const HALVINGS: u32 = 7;

impl<const TWINS: usize> Posterior<TWINS> {
    /// * `stiffness`: prior of the stiffness factor
    /// * `spread`: standard deviation of the logarithm of the ratio of strength and stiffness
    /// * `stick`: the present stick ratio, if it is measured
    pub(super) fn new(evidence: &[Evidence; TWINS], stiffness: Normal, spread: f32, stick: Option<&Stick>) -> Self {
        let certainty = 1.0 / stiffness.variance;
        let mut this = Self {
            weight: [0.0; TWINS],
            centre: [1.0; TWINS],
            per_width: [1.0; TWINS],
            logarithm: Normal { mean: 0.0, variance: spread * spread },
            stiffness,
            best: TWINS / 2,
        };
        let mut factors = [Normal { mean: 1.0, variance: 0.0 }; TWINS];
        let cells = this.weight.iter_mut().zip(&mut factors).zip(evidence).zip(ratios::<TWINS>());
        for (((weight, factor), evidence), (logarithm, _)) in cells {
            let precision = certainty + evidence.square;
            let pull = certainty * stiffness.mean + evidence.cross;
            let mean = pull / precision;
            // The logarithm of the weight, less what all have in common.
            let gained = 0.5 * (pull * mean - certainty * stiffness.mean * stiffness.mean);
            let unlikely = logarithm / spread;
            *weight = gained - 0.5 * Elementary::ln(precision * stiffness.variance) - 0.5 * unlikely * unlikely;
            *factor = Normal { mean: mean.clamp(0.3, 3.0), variance: 1.0 / precision };
        }
        if let Some(stick) = stick {
            for ((weight, factor), (_, ratio)) in this.weight.iter_mut().zip(&factors).zip(ratios::<TWINS>()) {
                *weight += stick.likelihood(ratio * factor.mean);
            }
        }
        let mut most = f32::MIN;
        for (k, weight) in this.weight.iter().enumerate() {
            if *weight > most {
                (most, this.best) = (*weight, k);
            }
        }
        let mut total = 0.0;
        for weight in &mut this.weight {
            *weight = Elementary::exp(*weight - most);
            total += *weight;
        }
        let per_total = 1.0 / total;
        let (mut first, mut second) = ([0.0f32; 2], [0.0f32; 2]);
        let cells =
            this.weight.iter_mut().zip(&mut this.centre).zip(&mut this.per_width).zip(&factors).zip(ratios::<TWINS>());
        for ((((weight, centre), per_width), factor), (logarithm, ratio)) in cells {
            *weight *= per_total;
            *centre = ratio * factor.mean;
            let grid = Steps::<TWINS>::STEP * factor.mean;
            let spread = factor.variance + grid * grid * (1.0 / 12.0);
            *per_width = 1.0 / (WIDTH * ratio * sqrt(spread.magnitude()));
            let log_strength = logarithm + Elementary::ln(factor.mean);
            let square = spread / (factor.mean * factor.mean);
            first[0] += *weight * log_strength;
            second[0] += *weight * (log_strength * log_strength + square);
            first[1] += *weight * factor.mean;
            second[1] += *weight * (factor.mean * factor.mean + factor.variance);
        }
        let [logarithm, stiffness] =
            [0, 1].map(|k| Normal { mean: first[k], variance: (second[k] - first[k] * first[k]).max(1e-6) });
        (this.logarithm, this.stiffness) = (logarithm, stiffness);
        this
    }

    /// The strength factor under a twin that is not excluded.
    pub(super) fn possible(&self, twin: usize) -> Option<f32> {
        let [most, weight] = [self.best, twin].map(|k| self.weight.get(k).copied().unwrap_or(0.0));
        if weight > POSSIBLE * most { self.centre.get(twin).copied() } else { None }
    }

    /// Probability that the strength factor is below a value.
    pub(super) fn below(&self, strength: f32) -> f32 {
        let mut sum = 0.0;
        for ((weight, centre), per_width) in self.weight.iter().zip(&self.centre).zip(&self.per_width) {
            let t = (0.5 + (strength - centre) * per_width).not_negative().at_most(1.0);
            sum += weight * (t * t * (3.0 - 2.0 * t));
        }
        sum.not_negative().at_most(1.0)
    }

    /// The strength factor below which a share of the distribution lies.
    pub(super) fn quantile(&self, share: f32) -> f32 {
        let (mut low, mut high) = ((LEAST, 0.0), (MOST, 1.0));
        for _ in 0..HALVINGS {
            let middle = sqrt((low.0 * high.0).magnitude());
            let below = self.below(middle);
            if below < share {
                low = (middle, below);
            } else {
                high = (middle, below);
            }
        }
        let place = (share - low.1) / (high.1 - low.1).max(1e-6);
        low.0 + (high.0 - low.0) * place.not_negative().at_most(1.0)
    }
}
