//! Several subjects: shares of the work, and statistics of their constants.

use serde::{Deserialize, Serialize};

use super::{Outcome, REFERENCE_MPA};

/// The K-th of N shares, K from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// K.
    pub index: usize,
    /// N.
    pub of: usize,
}

impl std::str::FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, of)) if 1 <= index && index <= of => Ok(Self { index, of }),
            _ => Err(format!("`{text}` is not K/N with 1 <= K <= N")),
        }
    }
}

impl Share {
    /// Everything.
    pub const ALL: Self = Self { index: 1, of: 1 };

    /// Whether item `i` (from 0) is of this share.
    pub fn has(&self, i: usize) -> bool {
        i % self.of == self.index - 1
    }
}

/// One subject in short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subject {
    /// Name: the table's file name without ending.
    pub name: String,
    /// Whether the law was searched for; otherwise it is the published one.
    pub law_searched: bool,
    /// Strength at 5 kPa, kPa.
    pub tau_ref_kpa: f64,
    /// Its standard error.
    pub tau_ref_error_kpa: Option<f64>,
    /// beta.
    pub beta: f64,
    /// Its standard error.
    pub beta_error: Option<f64>,
    /// lambda, MPa^(1 - beta).
    pub lambda: f64,
    /// Stiffness factor of the finger.
    pub stiffness: f64,
    /// Depth offset, mm.
    pub depth_offset_mm: f64,
    /// Largest difference of F/N, %.
    pub worst_friction_percent: f64,
    /// Largest difference of N, %.
    pub worst_normal_force_percent: f64,
}

impl Subject {
    /// Summary of an outcome; under the published law if none was searched for.
    pub fn of(name: &str, outcome: &Outcome) -> Self {
        let law = outcome.law.as_ref();
        let comparison = law.map_or(&outcome.published, |law| &law.comparison);
        let worst =
            |of: fn(&super::outcome::Modelled) -> f64| comparison.rows.iter().map(|r| of(r).abs()).fold(0.0, f64::max);
        let finger = outcome.calibration.as_ref().map(|c| &c.finger);
        let error = |k: usize| law.and_then(|law| law.constants[k].standard_error);
        let published = 1e3 * (comparison.tau0_mpa + comparison.lambda * REFERENCE_MPA.powf(comparison.beta));
        Self {
            name: name.to_owned(),
            law_searched: law.is_some(),
            tau_ref_kpa: law.map_or(published, |law| law.law.tau_ref_kpa),
            tau_ref_error_kpa: error(0),
            beta: law.map_or(comparison.beta, |law| law.law.beta),
            beta_error: error(1),
            lambda: law.map_or(comparison.lambda, |law| law.lambda),
            stiffness: finger.map_or(1.0, |f| f.stiffness),
            depth_offset_mm: finger.map_or(0.0, |f| f.depth_offset_mm),
            worst_friction_percent: worst(|r| r.friction_coefficient_difference_percent),
            worst_normal_force_percent: worst(|r| r.normal_force_difference_percent),
        }
    }
}

/// Variation of a number over subjects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Name of the number with its unit.
    pub name: String,
    /// Mean.
    pub mean: f64,
    /// Standard deviation over subjects; none for one subject.
    pub deviation: Option<f64>,
    /// Part of the deviation that the subjects' own standard errors do not explain; none if these are unknown.
    pub between_subjects: Option<f64>,
    /// Least.
    pub least: f64,
    /// Median.
    pub median: f64,
    /// Largest.
    pub most: f64,
}

/// A population.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Population {
    /// Subjects, by name.
    pub subjects: Vec<Subject>,
    /// Tables without a result, by name.
    pub missing: Vec<String>,
    /// Variation of the constants; those of the law over the subjects whose law was searched for.
    pub spreads: Vec<Spread>,
    /// Correlation of ln strength and beta over subjects whose law was searched for; none below three or where one of the
    /// two does not vary.
    pub correlation: Option<f64>,
}

impl Population {
    /// The population of these subjects.
    pub fn of(mut subjects: Vec<Subject>, missing: Vec<String>) -> Self {
        subjects.sort_by(|a, b| a.name.cmp(&b.name));
        type Pick = (&'static str, fn(&Subject) -> f64, fn(&Subject) -> Option<f64>);
        let picks: [Pick; 5] = [
            ("strength at 5 kPa, kPa", |s| s.tau_ref_kpa, |s| s.tau_ref_error_kpa),
            ("beta", |s| s.beta, |s| s.beta_error),
            ("ln lambda (unit depends on beta)", |s| s.lambda.ln(), |_| None),
            ("stiffness factor", |s| s.stiffness, |_| None),
            ("depth offset, mm", |s| s.depth_offset_mm, |_| None),
        ];
        let searched: Vec<Subject> = subjects.iter().filter(|s| s.law_searched).cloned().collect();
        let spreads = picks
            .iter()
            .enumerate()
            .map(|(i, pick)| (if i < 3 { &searched } else { &subjects }, pick))
            .filter(|(over, _)| !over.is_empty())
            .map(|(over, (name, value, error))| spread(name, over, value, error))
            .collect();
        let correlation = correlation(&searched);
        Self { subjects, missing, spreads, correlation }
    }

    /// A sentence on the correlation of strength and exponent, or on why there is none.
    pub fn correlation_statement(&self) -> String {
        match self.correlation {
            Some(r) => format!("correlation of ln strength and beta over subjects: {r:.2}"),
            None if self.subjects.iter().filter(|s| s.law_searched).count() < 3 => {
                "correlation of ln strength and beta over subjects: needs three subjects at least".into()
            }
            None => "correlation of ln strength and beta over subjects: undefined, because all subjects have the same \
                     strength or the same beta (are their tables copies of one another?)"
                .into(),
        }
    }
}

/// Spread relative to the mean below which subjects are equal up to rounding.
const ALIKE: f64 = 1e-9;

/// Correlation of ln strength and beta; none below three subjects or where one of the two is the same in all.
fn correlation(subjects: &[Subject]) -> Option<f64> {
    let pairs: Vec<[f64; 2]> = subjects.iter().map(|s| [s.tau_ref_kpa.ln(), s.beta]).collect();
    let mean = [0, 1].map(|k| pairs.iter().map(|p| p[k]).sum::<f64>() / pairs.len() as f64);
    let sum = |i: usize, j: usize| pairs.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f64>();
    let varies = |k: usize| pairs.iter().any(|p| (p[k] - mean[k]).abs() > ALIKE * (1.0 + mean[k].abs()));
    (subjects.len() > 2 && varies(0) && varies(1)).then(|| sum(0, 1) / (sum(0, 0) * sum(1, 1)).sqrt())
}

fn spread(
    name: &str,
    subjects: &[Subject],
    value: &fn(&Subject) -> f64,
    error: &fn(&Subject) -> Option<f64>,
) -> Spread {
    let mut values: Vec<f64> = subjects.iter().map(value).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let variance = (n > 1).then(|| values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1) as f64);
    let errors: Option<Vec<f64>> = subjects.iter().map(error).collect();
    let own = errors.map(|e| e.iter().map(|e| e * e).sum::<f64>() / n as f64);
    Spread {
        name: name.to_owned(),
        mean,
        deviation: variance.map(f64::sqrt),
        between_subjects: variance.zip(own).map(|(all, own)| (all - own).max(0.0).sqrt()),
        least: values[0],
        median: if n % 2 == 1 { values[n / 2] } else { 0.5 * (values[n / 2 - 1] + values[n / 2]) },
        most: values[n - 1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_cover_everything_once() {
        for of in 1..6 {
            for i in 0..20 {
                assert_eq!((1..=of).filter(|&index| Share { index, of }.has(i)).count(), 1);
            }
        }
        assert_eq!("2/3".parse(), Ok(Share { index: 2, of: 3 }));
        for bad in ["0/3", "4/3", "3", "a/b", "1/"] {
            assert!(bad.parse::<Share>().is_err(), "{bad}");
        }
    }

    #[test]
    fn spread_between_subjects_is_what_their_errors_leave() {
        let subject = |name: &str, beta: f64| Subject {
            law_searched: true,
            name: name.into(),
            tau_ref_kpa: 7.0 + beta,
            tau_ref_error_kpa: None,
            beta,
            beta_error: Some(0.1),
            lambda: 0.08,
            stiffness: 1.0,
            depth_offset_mm: 0.0,
            worst_friction_percent: 1.0,
            worst_normal_force_percent: 2.0,
        };
        let population = Population::of(vec![subject("b", 0.5), subject("a", 0.3), subject("c", 0.1)], vec![]);
        assert_eq!(population.subjects[0].name, "a");
        let beta = &population.spreads[1];
        assert!((beta.mean - 0.3).abs() < 1e-12 && (beta.deviation.unwrap() - 0.2).abs() < 1e-12);
        assert!((beta.between_subjects.unwrap() - (0.04f64 - 0.01).sqrt()).abs() < 1e-12);
        assert_eq!(population.spreads[0].between_subjects, None);
        assert!((population.correlation.unwrap() - 1.0).abs() < 1e-2);
        assert!(population.correlation_statement().ends_with(": 1.00"));
        let equal = Population::of(["a", "b", "c"].map(|name| subject(name, 0.3)).to_vec(), vec![]);
        assert_eq!(equal.correlation, None);
        assert!(equal.correlation_statement().contains("same"), "{}", equal.correlation_statement());
        let pair = Population::of(vec![subject("a", 0.3), subject("b", 0.3)], vec![]);
        assert!(pair.correlation_statement().contains("three subjects"));
    }
}
