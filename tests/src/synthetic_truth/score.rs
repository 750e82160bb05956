//! One case judged: what the diagnosis said against what was hidden.

use std::sync::OnceLock;

use cpu_time::ThreadTime;
use fingerpad::host::ModelFile;
use fingerpad_diagnose::{
    CORNEOMETER_SD_AU, CovariateError, DiagnoseError, Diagnosis, EffectFound, Evidence, LawsFile, Options,
    PlanConstraints, PlannedRun, RunSet, SelectionSettings, Verdict, diagnose, laws::Column,
};

use fingerpad_smooth::ReferenceCurves;

use super::Random;
use super::effects::LIBRARY;
use super::protocol::{Plan, strokes};
use super::sets::{Case, measure};

/// How a verdict stands to the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Class {
    /// The set of names is the truth.
    Exact,
    /// Ambiguous, with the truth among the candidates.
    AmbiguousWithTruth,
    /// Ambiguous without it.
    AmbiguousWithout,
    /// Some of the truth, nothing wrong.
    Part,
    /// The truth and a name too many.
    Extra,
    /// Named, and wrong.
    Wrong,
    /// Unexplained structure.
    Unexplained,
    /// Nothing missing.
    Nothing,
    /// Nothing is hidden, and what is named the finger does by itself in all files.
    OfFinger,
    /// The files were refused.
    Refused,
}

/// A judged case.
#[derive(Clone, Debug)]
pub struct Scored {
    /// How it ended.
    pub class: Class,
    /// The report.
    pub report: Diagnosis,
    /// Processor time of the diagnosis, s.
    pub seconds: f64,
    /// The same with its page and all pictures, s.
    pub seconds_with_page: f64,
    /// Relative error of the first parameter, where the law itself is right.
    pub amplitude_error: Option<f64>,
    /// Whether its interval covers the truth.
    pub covered: Option<bool>,
    /// The lag of the forces, where one was found.
    pub lag: Option<LagScored>,
}

/// A lag that was found, against the true one.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct LagScored {
    /// Found less true, s.
    pub error_s: f64,
    /// Whether the interval covers the true one.
    pub covered: bool,
    /// Half the interval's width, s.
    pub half_s: f64,
}

/// The curves that the diagnosis starts from: those of the model that ships, as without `--model`.
pub fn reference() -> ReferenceCurves {
    static REFERENCE: OnceLock<ReferenceCurves> = OnceLock::new();
    REFERENCE.get_or_init(|| ReferenceCurves::from_model_data(shipped().file().model.data(), false)).clone()
}

/// The model that ships.
pub fn shipped() -> ModelFile {
    ModelFile::new(include_bytes!("../../../data/models/fingertip.fpm")).expect("it ships")
}

/// Diagnoses sets in memory.
pub fn run(calibration: &RunSet, measured: &RunSet, holdout: Option<&RunSet>) -> Diagnosis {
    run_with_evidence(calibration, measured, holdout).0
}

/// The same with what figures and further runs need.
pub fn run_with_evidence(calibration: &RunSet, measured: &RunSet, holdout: Option<&RunSet>) -> (Diagnosis, Evidence) {
    try_run(calibration, measured, holdout, PlanConstraints::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The same where the next experiment keeps to what the laboratory can do, with the error of files that carry no diagnosis.
///
/// # Errors
/// What [`diagnose`] refuses.
pub fn try_run(
    calibration: &RunSet,
    measured: &RunSet,
    holdout: Option<&RunSet>,
    plan: PlanConstraints,
) -> Result<(Diagnosis, Evidence), DiagnoseError> {
    let options = Options {
        settings: SelectionSettings::default(),
        errors: vec![CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU }],
        model: "shipped".into(),
        plan,
        own: LawsFile::default(),
    };
    let open = || Ok(holdout.cloned());
    diagnose(calibration, measured, &reference(), &options, open, &mut |_| ())
}

fn family(name: &str) -> &str {
    LIBRARY.iter().find(|l| l.0 == name).map_or("outside", |l| l.1)
}

/// * `own`: families of laws that the finger follows by itself; naming one is neither asked nor wrong
fn classify(report: &Diagnosis, truth: &[&str], own: &[&str]) -> Class {
    let named = report.effects.iter().map(|e| e.family.as_str());
    let best: Vec<&str> = named.filter(|family| truth.contains(family) || !own.contains(family)).collect();
    let of_finger = best.len() < report.effects.len();
    let all = |a: &[&str], b: &[&str]| a.iter().all(|x| b.contains(x));
    match report.verdict {
        Verdict::None => Class::Nothing,
        Verdict::UnexplainedStructure => Class::Unexplained,
        Verdict::Named if truth.is_empty() && best.is_empty() => Class::OfFinger,
        Verdict::Named if all(&best, truth) && all(truth, &best) => Class::Exact,
        Verdict::Named if all(&best, truth) => Class::Part,
        Verdict::Named if all(truth, &best) && (of_finger || !truth.is_empty()) => Class::Extra,
        Verdict::Named => Class::Wrong,
        Verdict::Ambiguous => {
            let within = |t: &&str| report.effects.iter().any(|e| e.candidates.iter().any(|c| c.family == **t));
            let is_own = |e: &EffectFound| e.candidates.iter().any(|c| own.contains(&c.family.as_str()));
            if !truth.is_empty() && truth.iter().all(within) {
                Class::AmbiguousWithTruth
            } else if truth.is_empty() && report.effects.iter().all(is_own) {
                Class::OfFinger
            } else {
                Class::AmbiguousWithout
            }
        }
    }
}

/// How the report of a case stands to its truth.
pub fn classified(case: &Case, report: &Diagnosis) -> Class {
    let mut truth: Vec<&str> = case.truth.iter().map(|e| family(e.name)).collect();
    truth.extend((case.lag_s[1] != case.lag_s[0]).then_some("force_lag"));
    classify(report, &truth, case.finger.own_families())
}

/// Diagnoses and judges a case.
pub fn score(case: &Case) -> Scored {
    score_within(case, PlanConstraints::default())
}

/// The same where the next experiment keeps to what the laboratory can do.
pub fn score_within(case: &Case, plan: PlanConstraints) -> Scored {
    let started = ThreadTime::now();
    let (report, evidence) =
        try_run(&case.calibration, &case.measured, Some(&case.holdout), plan).unwrap_or_else(|error| panic!("{error}"));
    let seconds = started.elapsed().as_secs_f64();
    fingerpad_report::diagnosis::render(&report, &evidence).expect("figures of finite numbers");
    let seconds_with_page = started.elapsed().as_secs_f64();
    let class = classified(case, &report);
    let of_source = |source: &str| report.instrument.iter().find(|found| found.source == source);
    let lag = ["calibration", "measured"].into_iter().zip(case.lag_s).find_map(|(source, lag_s)| {
        let found = of_source(source)?;
        let [low, high] = found.ci95_s;
        Some(LagScored {
            error_s: found.lag_s - lag_s,
            covered: low <= lag_s && lag_s <= high,
            half_s: 0.5 * (high - low),
        })
    });
    let (mut amplitude_error, mut covered) = (None, None);
    if let ([hidden], Some(effect)) = (&case.truth[..], report.effects.first())
        && effect.law == hidden.name
    {
        let p = &effect.parameters[0];
        amplitude_error = Some((p.value / hidden.amplitude - 1.0).abs());
        covered = Some(p.ci95[0] <= hidden.amplitude && hidden.amplitude <= p.ci95[1]);
    }
    Scored { class, report, seconds, seconds_with_page, amplitude_error, covered, lag }
}

/// A proposed run as the laboratory does it; what is missing is at reference conditions.
fn plan_of(run: &PlannedRun) -> Plan {
    let r = Plan::reference();
    Plan {
        depth_mm: run.depth_mm.unwrap_or(r.depth_mm),
        speed_mm_s: run.speed_mm_s.unwrap_or(r.speed_mm_s),
        direction: run.direction_deg.unwrap_or(0.0).to_radians(),
        dwell_s: run.dwell_s.unwrap_or(r.dwell_s),
        hydration_au: run.hydration_au.unwrap_or(r.hydration_au),
        temperature_c: run.temperature_c.unwrap_or(r.temperature_c),
        width_mm: r.width_mm,
        length_mm: run.length_mm.unwrap_or(r.length_mm),
        reverse: run.reverse.unwrap_or(false),
        rest_s: run.rest_before_s.unwrap_or(60.0).max(if run.new_block == Some(true) { 60.0 } else { 0.0 }),
    }
}

/// Runs the proposed strokes on the same hidden truth, merges them and diagnoses again: how it ends, and the report on all runs.
pub fn settle(case: &Case, report: &Diagnosis) -> Option<(Class, Diagnosis)> {
    let plan = report.next_experiment.as_ref()?;
    let mut plans: Vec<Plan> = plan.runs.iter().map(plan_of).collect();
    case.protocol.turn(&mut plans, false);
    let mut more = strokes(&plans, 30);
    let start = case.measured.runs.iter().flat_map(|r| &r.rows).map(|r| r.t_s).fold(0.0, f64::max);
    for stroke in &mut more {
        stroke.rows.iter_mut().for_each(|r| r.t_s += start);
    }
    let mut random = Random::new(case.seed ^ 0xABCD);
    let set = measure(&*case.finger, &more, &case.truth, &case.noise, &mut random, "next", case.dropped);
    let set = case.protocol.log(set, false, &mut random).set;
    let mut joint = case.measured.clone();
    joint.runs.extend(set.runs);
    let report = run(&case.calibration, &joint, Some(&case.holdout));
    let truth: Vec<&str> = case.truth.iter().map(|e| family(e.name)).collect();
    Some((classify(&report, &truth, case.finger.own_families()), report))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic_truth::effects::place;
    use crate::synthetic_truth::sets::{Hide, case};

    /// A law is named where it closes the gap on held-out runs. Where these runs have something else as well, the same law is a part of
    /// unexplained structure: it is not claimed and makes no correction.
    #[test]
    fn no_name_stands_beside_a_gap_of_two_noise_floors() {
        let made = case(1, Hide::Law(place("temperature")), 0.3, 0, 60, true);
        let (named, _) = run_with_evidence(&made.calibration, &made.measured, Some(&made.holdout));
        assert_eq!((named.verdict, named.effects.len()), (Verdict::Named, 1));
        assert!(named.holdout.ratio_after < 2.0);
        let mut other = made.holdout.clone();
        other.runs.iter_mut().flat_map(|run| &mut run.force_n).for_each(|force| force[0] *= 1.5);
        let (open, evidence) = run_with_evidence(&made.calibration, &made.measured, Some(&other));
        println!("{:?} {:?}", open.holdout, open.unexplained);
        assert_eq!(open.verdict, Verdict::UnexplainedStructure);
        assert!(open.effects.is_empty() && !evidence.has_claims());
        assert!(open.holdout.ratio_after > 2.0 && open.holdout.rms_after_n == open.holdout.rms_before_n);
        assert_eq!(open.unexplained.channel, "normal");
        assert!(!open.unexplained.column.is_empty());
        assert_eq!(open.unexplained.partial[0].law, named.effects[0].law);
    }

    /// Naming what the finger does in all files is neither a false alarm nor a wrong name; it does not replace what is hidden.
    #[test]
    fn laws_of_the_finger_itself_are_true_statements() {
        let made = case(1, Hide::Law(16), 0.3, 0, 20, true);
        let (found, _) = run_with_evidence(&made.calibration, &made.measured, None);
        let family = found.effects[0].family.clone();
        let own: &[&str] = &[&family];
        for (truth, own, class) in [
            (&[family.as_str()] as &[&str], &[] as &[&str], Class::Exact),
            (&[family.as_str()], own, Class::Exact),
            (&[], own, Class::OfFinger),
            (&["speed"], own, Class::Part),
            (&[], &["speed"], Class::Wrong),
            (&["speed"], &[], Class::Wrong),
        ] {
            assert_eq!(classify(&found, truth, own), class, "{truth:?} {own:?}");
        }
    }
}
