//! The one loop of the score: make a set, diagnose it, judge the answer. An outcome is one line of JSON, so that a run can go on
//! where it stopped.
//!
//! Main types: [`ScoreSet`] (what is asked), [`Outcome`] (what was found); functions [`sets`], [`card`] and [`judge_all`].

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use fingerpad_diagnose::{Diagnosis, EffectFound, PlanConstraints, PlannedRun, Verdict, check};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Random;
use super::effects::{LIBRARY, OUTSIDE};
use super::loggers::Protocol;
use super::oracle::{Separation, separation};
use super::score::{Class, LagScored, score_within, settle};
use super::sets::{CALIBRATION_RUNS, Case, Hide, Wanted, make};
use super::simulator::SimulatorKind;

/// How a laboratory works.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// A protocol of the card.
    Card(Protocol),
}

impl Practice {
    /// The five of the score.
    pub const ALL: [Self; 5] = [Self::FourDirections, Self::OneAxis, Self::Careless, Self::Operator, Self::RunCounts];

    fn protocol(self) -> Protocol {
        match self {
            Self::FourDirections => Protocol::FourDirections,
            Self::OneAxis => Protocol::OneAxis,
            Self::Careless | Self::RunCounts => Protocol::Plane,
            Self::Operator => Protocol::Operator,
            Self::Card(protocol) => protocol,
        }
    }
}

/// What is hidden in a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// Nothing.
    #[value(name = "none")]
    Nothing,
    /// One law.
    Single,
    /// Two laws.
    Pair,
    /// An effect that the library does not have.
    Outside,
    /// A law whose column is not recorded.
    Unrecorded,
}

/// A set to be made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoreSet {
    /// How the laboratory works.
    pub practice: Practice,
    /// What is to be made.
    pub of: Wanted,
}

impl ScoreSet {
    /// What is hidden.
    pub fn kind(&self) -> Kind {
        match self.of.hide {
            Hide::Nothing => Kind::Nothing,
            Hide::Law(_) => Kind::Single,
            Hide::Pair(..) => Kind::Pair,
            Hide::Outside(_) => Kind::Outside,
            Hide::Unrecorded(_) => Kind::Unrecorded,
        }
    }
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
    /// The lag of the forces, where one was found.
    pub lag: Option<LagScored>,
    /// Whether spikes are mentioned, and whether as a red warning.
    pub spikes: [bool; 2],
    /// Variances of the noise that the calibration found over those of the laboratory, in the order of [`NOISE`].
    pub noise: Option<[f64; 6]>,
    /// Whether the interval covers the amplitude, where the law's form is exact.
    pub covered: Option<bool>,
    /// Held-out residual over floor before and after, worst channel; none where the files were refused.
    pub held_out: Option<[f64; 2]>,
    /// How the verdict stands once the proposed strokes are run, where some are proposed and the truth is a candidate.
    pub settled: Option<Class>,
    /// Whether the proposed strokes keep to what the laboratory can do.
    pub plan_kept: Option<bool>,
    /// The factor that the proposed strokes vary, and the separation that they are expected to give.
    pub plan: Option<(String, f64)>,
    /// What was named once they were run.
    pub found_with_plan: Vec<String>,
    /// Promises of the report that it broke.
    pub broken: Broken,
    /// Processor time of the diagnosis, s.
    pub seconds: f64,
    /// The same with its page and all pictures, s.
    pub seconds_with_page: f64,
}

/// What [`Outcome::noise`] compares.
pub const NOISE: [&str; 6] =
    ["stiffness", "strength", "touch point", "offsets", "rows, additive", "rows, multiplicative"];

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
        let of_scatter = match self.set.of.hide {
            Hide::Unrecorded(law) if LIBRARY[law].0 != "contact_ageing" => scatter_that_shows(self.set.of.runs),
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

/// Laws whose column a laboratory could fail to record.
const UNRECORDED: [usize; 5] = [0, 6, 8, 14, 16];

/// All sets of a seed in an order that mixes them, so that the first of them are a fair sample.
pub fn sets(seed: u64, simulators: &[SimulatorKind]) -> Vec<ScoreSet> {
    let mut out: Vec<ScoreSet> = Vec::new();
    let mut add = |simulator: SimulatorKind, practice: Practice, hide: Hide, size: f64| {
        let place = out.len();
        let level = match practice {
            _ if matches!(hide, Hide::Pair(..)) => 0,
            Practice::Careless => 2,
            _ => (place + place / 8) % 2,
        };
        let runs = if practice == Practice::RunCounts { RUN_COUNTS[place % 8] } else { 60 };
        let seed = 1_000_000 * (seed + 1) + place as u64;
        let protocol = practice.protocol();
        out.push(ScoreSet {
            practice,
            of: Wanted { exact_form: seed.is_multiple_of(2), simulator, protocol, seed, hide, size, level, runs },
        });
    };
    for simulator in SimulatorKind::ALL {
        for practice in Practice::ALL {
            (0..NOTHING).for_each(|_| add(simulator, practice, Hide::Nothing, 0.0));
            for size in [0.03, 0.10, 0.30] {
                (0..LIBRARY.len()).for_each(|law| add(simulator, practice, Hide::Law(law), size));
            }
            for size in [0.10, 0.30] {
                (0..OUTSIDE.len()).for_each(|k| add(simulator, practice, Hide::Outside(k), size));
                UNRECORDED.into_iter().for_each(|law| add(simulator, practice, Hide::Unrecorded(law), size));
            }
        }
        for size in [0.10, 0.30] {
            let pairs = (0..LIBRARY.len()).flat_map(|i| (0..i).map(move |j| Hide::Pair(i, j)));
            pairs.for_each(|pair| add(simulator, Practice::FourDirections, pair, size));
        }
    }
    // Fisher and Yates's shuffle.
    let mut random = Random::new(seed);
    for last in (1..out.len()).rev() {
        out.swap(last, random.pick(last + 1));
    }
    out.retain(|set| simulators.contains(&set.of.simulator));
    out
}

const PAIRS: [(usize, usize); 16] = [
    (0, 13),
    (1, 11),
    (4, 13),
    (5, 8),
    (7, 12),
    (3, 14),
    (16, 9),
    (15, 4),
    (2, 6),
    (0, 5),
    (8, 12),
    (1, 7),
    (10, 0),
    (14, 4),
    (16, 5),
    (6, 13),
];

/// The sets of the card: a simulator under one protocol, each cell `repeats` times.
pub fn card(seed: u64, simulator: SimulatorKind, protocol: Protocol, repeats: u64) -> Vec<ScoreSet> {
    let mut out = Vec::new();
    let mut add = |hide, size, level, runs| {
        let seed = 40_001 + 100_000 * seed + out.len() as u64;
        let of = Wanted { simulator, protocol, seed, hide, size, level, runs, exact_form: seed.is_multiple_of(2) };
        out.push(ScoreSet { practice: Practice::Card(protocol), of });
    };
    for _ in 0..repeats {
        for (size, level) in [0.03, 0.10, 0.30].into_iter().flat_map(|size| [0, 1, 2].map(|level| (size, level))) {
            (0..LIBRARY.len()).for_each(|law| add(Hide::Law(law), size, level, 60));
        }
        for (level, k) in (0..3).flat_map(|level| (0..16).map(move |k| (level, k))) {
            add(Hide::Nothing, 0.0, level, [40, 60, 100, 60][k % 4]);
        }
        for size in [0.10, 0.30] {
            PAIRS.into_iter().for_each(|(i, j)| add(Hide::Pair(i, j), size, 0, 60));
            (0..2 * OUTSIDE.len()).for_each(|k| add(Hide::Outside(k / 2), size, 0, 60));
            for law in UNRECORDED {
                [0, 1].into_iter().for_each(|level| add(Hide::Unrecorded(law), size, level, 60));
            }
        }
    }
    out
}

/// What the laboratory of a set can do: every second one can set depth, speed, dwell and direction only, and rests 30 s.
fn constraints(set: &ScoreSet) -> PlanConstraints {
    if set.of.seed.is_multiple_of(2) {
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

/// Judges the sets that `file` does not hold yet, on some threads, and returns the outcomes of all in their order. A line that a
/// stop cut short is judged again.
///
/// * `lazy`: the oracle, which takes most of the time, is asked only where proposed strokes are to settle a set
///
/// # Errors
/// A file that cannot be read or written, or holds other lines.
pub fn judge_all(
    wanted: &[ScoreSet],
    file: Option<&Path>,
    threads: usize,
    lazy: bool,
) -> Result<Vec<Outcome>, Box<dyn std::error::Error>> {
    let mut done: Vec<Outcome> = Vec::new();
    let mut stored = None;
    if let Some(path) = file {
        let text = if path.exists() { fs::read_to_string(path)? } else { String::new() };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        done = text[..whole].lines().map(serde_json::from_str).collect::<Result<_, _>>()?;
        done.retain(|o| wanted.contains(&o.set));
        let file = fs::OpenOptions::new().create(true).append(true).open(path)?;
        file.set_len(whole as u64)?;
        stored = Some(file);
        eprintln!("{} of {} sets are in {}", done.len(), wanted.len(), path.display());
    }
    let left: Vec<ScoreSet> = wanted.iter().filter(|set| done.iter().all(|o| o.set != **set)).copied().collect();
    let (next, out) = (AtomicUsize::new(0), Mutex::new((stored, done)));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(set) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = judge(*set, lazy);
                    let (file, done) = &mut *out.lock().expect("no thread panics with it");
                    if let Some(file) = file {
                        let line = serde_json::to_string(&outcome).expect("plain numbers") + "\n";
                        file.write_all(line.as_bytes()).expect("the file can be written to");
                    }
                    done.push(outcome);
                    if done.len().is_multiple_of(20) {
                        eprintln!("{} of {}", done.len(), wanted.len());
                    }
                }
            });
        }
    });
    let (_, mut done) = out.into_inner()?;
    done.sort_by_key(|o| wanted.iter().position(|set| *set == o.set));
    Ok(done)
}

/// Makes a set, diagnoses it, and judges the answer; `lazy` as in [`judge_all`].
pub fn judge(set: ScoreSet, lazy: bool) -> Outcome {
    let case = make(set.of);
    let has_oracle = matches!(set.kind(), Kind::Single | Kind::Outside | Kind::Unrecorded);
    let mut out = judged(set, &case);
    if has_oracle && (!lazy || out.plan_kept.is_some()) {
        let oracle = separation(&case);
        out.oracle = Some([oracle.detect, oracle.rival]);
        out.oracle_amplitude_sd = Some(oracle.amplitude_sd);
    }
    out
}

fn judged(set: ScoreSet, case: &Case) -> Outcome {
    let hidden = case.truth.iter().map(|e| format!("{} {:.4} {:.2?}", e.name, e.amplitude, e.shape)).collect();
    let mut out = Outcome {
        set,
        hidden,
        found: Vec::new(),
        class: Class::Refused,
        oracle: None,
        oracle_amplitude_sd: None,
        lag: None,
        spikes: [false; 2],
        noise: None,
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
    out.lag = scored.lag;
    out.spikes = [
        scored.report.cautions.iter().any(|c| c.kind == "spikes"),
        fingerpad_report::diagnosis::cautions(&scored.report)
            .iter()
            .any(|(word, text)| *word == "warning" && text.contains("far off the rows")),
    ];
    let (found_noise, noise) = (&scored.report.noise, &case.noise);
    let ratios = [
        found_noise.run_gain_normal / noise.gain[0],
        found_noise.run_gain_friction / noise.gain[1],
        found_noise.depth_zero_mm / noise.depth_mm,
        found_noise.run_offset_n / noise.offset_n,
        found_noise.additive_n / noise.additive_n,
        found_noise.multiplicative / noise.multiplicative,
    ];
    out.noise = Some(ratios.map(|r| r * r));
    out.covered = scored.covered.filter(|_| case.exact_form);
    if scored.class == Class::AmbiguousWithTruth
        && let Some(next) = &scored.report.next_experiment
    {
        out.plan_kept = Some(next.runs.iter().all(|r| keeps(&plan, r)));
        out.plan = Some((next.factor.clone(), next.lambda_rival_expected));
        let again = settle(case, &scored.report);
        out.settled = again.as_ref().map(|(class, _)| *class);
        out.found_with_plan = again.map_or_else(Vec::new, |(_, report)| found(&report));
    }
    out
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
