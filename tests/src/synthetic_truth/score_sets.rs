//! The sets of the score and what became of each, one line of JSON a set, so that a run can go on where it stopped.
//!
//! Main types: [`ScoreSet`] (what is asked), [`Outcome`] (what was found); function [`sets`].

use fingerpad_diagnose::{Diagnosis, EffectFound, PlanConstraints, PlannedRun, Verdict, check};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Random;
use super::effects::{LIBRARY, OUTSIDE};
use super::loggers::Protocol;
use super::oracle::{Separation, separation};
use super::score::{Class, score_within, settle};
use super::sets::{CALIBRATION_RUNS, Case, Hide, Wanted, make};
use super::simulator::SimulatorKind;

/// How a laboratory works.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Practice {
    /// Calibration and measured runs along ±x and ±y, randomised or with correlations of 0.7.
    FourDirections,
    /// All runs along +x, randomised or with correlations of 0.7.
    OneAxis,
    /// Two directions, one dwell, correlations of 0.97.
    Careless,
    /// A logger with equal time stamps, spikes, lost rows and two rates.
    Operator,
    /// Five to 500 runs, directions over the plane.
    RunCounts,
}

impl Practice {
    /// All five.
    pub const ALL: [Self; 5] = [Self::FourDirections, Self::OneAxis, Self::Careless, Self::Operator, Self::RunCounts];

    fn protocol(self) -> Protocol {
        match self {
            Self::FourDirections => Protocol::FourDirections,
            Self::OneAxis => Protocol::OneAxis,
            Self::Careless | Self::RunCounts => Protocol::Plane,
            Self::Operator => Protocol::Operator,
        }
    }
}

/// What is hidden in a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Nothing.
    Nothing,
    /// One law.
    Single,
    /// Two laws.
    Pair,
    /// An effect that the library does not have, or one whose column is not recorded.
    Outside,
}

/// A set to be made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoreSet {
    /// Who makes the readings.
    pub simulator: SimulatorKind,
    /// How the laboratory works.
    pub practice: Practice,
    /// What sort of thing is hidden.
    pub kind: Kind,
    /// What is hidden.
    pub hide: Hide,
    /// Its size.
    pub size: f64,
    /// Level of confounding.
    pub level: usize,
    /// Measured runs.
    pub runs: usize,
    /// Seed of all that is drawn.
    pub seed: u64,
}

/// What became of a set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// What was asked.
    pub set: ScoreSet,
    /// The hidden effects with amplitude and shape.
    pub hidden: Vec<String>,
    /// What was named, with value and candidates.
    pub found: Vec<String>,
    /// How the verdict stands to the truth.
    pub class: Class,
    /// The oracle's separation from nothing and from the nearest rival; none for pairs and where nothing is hidden.
    pub oracle: Option<[f64; 2]>,
    /// Standard deviation of the amplitude that the oracle would estimate, as a share of it.
    pub oracle_amplitude_sd: Option<f64>,
    /// Relative error of the amplitude.
    pub amplitude_error: Option<f64>,
    /// Whether the interval covers the amplitude, where the law's form is exact.
    pub covered: Option<bool>,
    /// Held-out residual over floor before and after, worst channel; none where the files were refused.
    pub held_out: Option<[f64; 2]>,
    /// How the verdict stands once the proposed strokes are run, where some are proposed and the truth is a candidate.
    pub settled: Option<Class>,
    /// Whether the proposed strokes keep to what the laboratory can do.
    pub plan_kept: Option<bool>,
    /// The factor that the proposed strokes vary, and the separation that they are expected to give.
    #[serde(default)]
    pub plan: Option<(String, f64)>,
    /// What was named once they were run.
    #[serde(default)]
    pub found_with_plan: Vec<String>,
    /// Promises of the report that it broke.
    #[serde(default)]
    pub broken: Broken,
    /// Processor time of the diagnosis, s.
    pub seconds: f64,
    /// The same with its page and all pictures, s.
    #[serde(default)]
    pub seconds_with_page: f64,
}

/// What a report must never do, and whether it did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Broken {
    /// A name of which every amplitude's interval holds zero.
    pub name_without_amplitude: bool,
    /// The verdict `none` with a law's test significant.
    pub none_with_evidence: bool,
    /// Scatter between runs above twice the expected that the report does not mention.
    pub silent_scatter: bool,
}

impl Broken {
    /// Looks through a report.
    pub fn of(report: &Diagnosis) -> Self {
        let ratio = &report.unexplained.scatter_ratio;
        Self {
            name_without_amplitude: report.effects.iter().any(is_without_amplitude),
            none_with_evidence: report.verdict == Verdict::None && report.tests.iter().any(|t| t.significant),
            silent_scatter: ratio.normal.max(ratio.friction) > 2.0
                && report.cautions.iter().all(|c| c.kind != "scatter"),
        }
    }
}

/// Whether the intervals of all amplitudes of an effect hold zero: of the sensor's laws all parameters are amplitudes, of the
/// others the first one is.
fn is_without_amplitude(effect: &EffectFound) -> bool {
    let amplitudes =
        if ["tare_bias", "cross_talk"].contains(&effect.law.as_str()) { effect.parameters.len() } else { 1 };
    effect.parameters[..amplitudes].iter().all(|p| p.ci95[0] <= 0.0 && p.ci95[1] >= 0.0)
}

impl Outcome {
    /// Whether a perfect analyst could name it alone, or say that the library does not have it.
    pub fn required(&self) -> bool {
        let Some([detect, rival]) = self.oracle else { return false };
        // The oracle has the column that the laboratory did not record. Without it, what the library leaves of an effect that
        // is one factor a run is scatter between runs.
        let of_scatter = match self.set.hide {
            Hide::Unrecorded(law) if LIBRARY[law].0 != "contact_ageing" => scatter_that_shows(self.set.runs),
            _ => 0.0,
        };
        rival > of_scatter && Separation { detect, rival, amplitude_sd: 0.0 }.required()
    }
}

/// Level at which scatter between runs above that of the calibration counts.
const SCATTER_LEVEL: f64 = 1e-3;

/// Squared distance in standard deviations, one a run, from which scatter shows above that of the calibration: by the F test
/// of the two variances, of which the calibration's is known from its runs only.
fn scatter_that_shows(runs: usize) -> f64 {
    let degrees = |runs: usize| runs as f64 - 3.0;
    let ratio =
        FisherSnedecor::new(degrees(runs), degrees(CALIBRATION_RUNS)).map(|f| f.inverse_cdf(1.0 - SCATTER_LEVEL));
    runs as f64 * (ratio.expect("degrees of freedom above 0") - 1.0)
}

/// Numbers of measured runs from five to 500.
const RUN_COUNTS: [usize; 8] = [5, 8, 12, 20, 40, 120, 250, 500];
/// Sets without an effect of each simulator and practice.
const NOTHING: usize = 50;

/// All sets of a seed in an order that mixes them, so that the first of them are a fair sample.
pub fn sets(seed: u64, simulators: &[SimulatorKind]) -> Vec<ScoreSet> {
    let mut out = Vec::new();
    for simulator in SimulatorKind::ALL {
        for practice in Practice::ALL {
            let mut add = |kind, hide, size| {
                let level = if practice == Practice::Careless { 2 } else { (out.len() + out.len() / 8) % 2 };
                let runs = if practice == Practice::RunCounts { RUN_COUNTS[out.len() % 8] } else { 60 };
                out.push(ScoreSet { simulator, practice, kind, hide, size, level, runs, seed: 0 });
            };
            (0..NOTHING).for_each(|_| add(Kind::Nothing, Hide::Nothing, 0.0));
            for size in [0.03, 0.10, 0.30] {
                (0..LIBRARY.len()).for_each(|law| add(Kind::Single, Hide::Law(law), size));
            }
            for size in [0.10, 0.30] {
                (0..OUTSIDE.len()).for_each(|k| add(Kind::Outside, Hide::Outside(k), size));
                [0, 6, 8, 14, 16].into_iter().for_each(|law| add(Kind::Outside, Hide::Unrecorded(law), size));
            }
        }
        for size in [0.10, 0.30] {
            for i in 0..LIBRARY.len() {
                for j in 0..i {
                    let (practice, kind, hide) = (Practice::FourDirections, Kind::Pair, Hide::Pair(i, j));
                    out.push(ScoreSet { simulator, practice, kind, hide, size, level: 0, runs: 60, seed: 0 });
                }
            }
        }
    }
    for (place, set) in out.iter_mut().enumerate() {
        set.seed = 1_000_000 * (seed + 1) + place as u64;
    }
    // Fisher and Yates's shuffle.
    let mut random = Random::new(seed);
    for last in (1..out.len()).rev() {
        out.swap(last, random.pick(last + 1));
    }
    out.retain(|set| simulators.contains(&set.simulator));
    out
}

/// What the laboratory of a set can do: every second one can set depth, speed, dwell and direction only, and rests 30 s.
fn constraints(set: &ScoreSet) -> PlanConstraints {
    if set.seed.is_multiple_of(2) {
        return PlanConstraints { can_set: None, least_rest_s: 2.0 };
    }
    let can_set = ["depth_mm", "speed_mm_s", "dwell_s", "direction_deg"].map(str::to_owned).to_vec();
    PlanConstraints { can_set: Some(can_set), least_rest_s: 30.0 }
}

/// Whether strokes keep to what the laboratory can do.
fn keeps(plan: &PlanConstraints, run: &PlannedRun) -> bool {
    let may = |column: &str, value: Option<f64>| {
        value.is_none() || plan.can_set.as_ref().is_none_or(|list| list.iter().any(|c| c == column))
    };
    run.rest_before_s.is_none_or(|s| s >= plan.least_rest_s)
        && may("depth_mm", run.depth_mm)
        && may("speed_mm_s", run.speed_mm_s)
        && may("dwell_s", run.dwell_s)
        && may("direction_deg", run.direction_deg)
        && may("hydration_au", run.hydration_au)
        && may("temperature_c", run.temperature_c)
}

/// Makes a set, diagnoses it, and judges the answer.
pub fn judge(set: ScoreSet) -> Outcome {
    let case = make(wanted(&set));
    let oracle = matches!(set.kind, Kind::Single | Kind::Outside).then(|| separation(&case));
    judged(set, &case, oracle)
}

/// The same, where the oracle, which takes most of the time, is asked only if proposed strokes are to settle the set.
pub fn judge_if_ambiguous(set: ScoreSet) -> Outcome {
    let case = make(wanted(&set));
    let out = judged(set, &case, None);
    let oracle = out.plan_kept.map(|_| separation(&case));
    Outcome { oracle: oracle.map(|o| [o.detect, o.rival]), oracle_amplitude_sd: oracle.map(|o| o.amplitude_sd), ..out }
}

fn judged(set: ScoreSet, case: &Case, oracle: Option<Separation>) -> Outcome {
    let hidden = case.truth.iter().map(|e| format!("{} {:.4} {:.2?}", e.name, e.amplitude, e.shape)).collect();
    let mut out = Outcome {
        set,
        hidden,
        found: Vec::new(),
        class: Class::Refused,
        oracle: oracle.map(|o| [o.detect, o.rival]),
        oracle_amplitude_sd: oracle.map(|o| o.amplitude_sd),
        amplitude_error: None,
        covered: None,
        held_out: None,
        settled: None,
        plan_kept: None,
        plan: None,
        found_with_plan: Vec::new(),
        broken: Broken::default(),
        seconds: 0.0,
        seconds_with_page: 0.0,
    };
    if check(&case.measured).is_err() {
        return out;
    }
    let plan = constraints(&set);
    let scored = score_within(case, plan.clone());
    out.class = scored.class;
    out.seconds = scored.seconds;
    out.seconds_with_page = scored.seconds_with_page;
    out.found = found(&scored.report);
    out.broken = Broken::of(&scored.report);
    out.held_out = Some([scored.report.holdout.ratio_before, scored.report.holdout.ratio_after]);
    out.amplitude_error = scored.amplitude_error;
    out.covered = scored.covered.filter(|_| case.exact_form);
    if scored.class == Class::AmbiguousWithTruth
        && let Some(next) = &scored.report.next_experiment
    {
        out.plan_kept = Some(next.runs.iter().all(|r| keeps(&plan, r)));
        out.plan = Some((next.factor.clone(), next.lambda_rival_expected));
        let again = settle(case, &scored.report);
        out.settled = again.as_ref().map(|again| again.class);
        out.found_with_plan = again.map_or_else(Vec::new, |again| found(&again.report));
    }
    out
}

/// The case of a set.
pub fn wanted(set: &ScoreSet) -> Wanted {
    let ScoreSet { simulator, practice, hide, size, level, runs, seed, .. } = *set;
    let exact_form = seed.is_multiple_of(2);
    Wanted { simulator, protocol: practice.protocol(), seed, hide, size, level, runs, exact_form }
}

/// What was named, and what is structure that nothing explains.
fn found(r: &Diagnosis) -> Vec<String> {
    let effects = r.effects.iter().map(|e| {
        let candidates: Vec<&str> = e.candidates.iter().map(|c| c.law.as_str()).collect();
        let p = &e.parameters[0];
        format!("{} {:.4} {:.4?} gain {:.0} of {candidates:?}", e.law, p.value, p.ci95, e.gain_2ll)
    });
    let u = &r.unexplained;
    let left = format!(
        "left: {} {} gain {:.0} scatter {:.2} {:.2} partial {:?}",
        u.column,
        u.channel,
        u.gain,
        u.scatter_ratio.normal,
        u.scatter_ratio.friction,
        u.partial.iter().map(|p| p.law.as_str()).collect::<Vec<_>>()
    );
    let tests = r.tests.iter().filter(|t| t.testable && t.gain_2ll > 10.0);
    let tests = tests.map(|t| format!("test: {} gain {:.0} p {:.0e} {:.3}", t.law, t.gain_2ll, t.p_model, t.p_runs));
    effects.chain([left]).chain(tests).collect()
}

#[cfg(test)]
mod tests {
    use super::scatter_that_shows;

    #[test]
    fn scatter_shows_from_where_the_f_table_says() {
        // Tables of the F distribution: at (3, 25) and (3, 30) degrees of freedom 7.45 and 7.05 leave 0.1 %, at (30, 25) and
        // (30, 30) 3.52 and 3.22; the calibration has 27.
        for (runs, low, high) in [(6, 7.05, 7.45), (33, 3.22, 3.52)] {
            let ratio = 1.0 + scatter_that_shows(runs) / runs as f64;
            assert!((low..high).contains(&ratio), "{runs}: {ratio}");
        }
    }
}
