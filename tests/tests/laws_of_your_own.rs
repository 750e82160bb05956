//! A law of the user's own in the diagnosis: a hidden electroadhesion is named with its file of laws and refused without.

use fingerpad_diagnose::{
    DiagnoseError, Diagnosis, Evidence, LawsFile, Options, PlanConstraints, RunSet, SelectionSettings, Verdict,
    corrected_model, diagnose, replay_all,
};
use fingerpad_tests::synthetic_truth::Random;
use fingerpad_tests::synthetic_truth::effects::Effect as Hidden;
use fingerpad_tests::synthetic_truth::loggers::Logger;
use fingerpad_tests::synthetic_truth::protocol::Stroke;
use fingerpad_tests::synthetic_truth::score::{reference, shipped};
use fingerpad_tests::synthetic_truth::sets::{Case, Hide, case, record};

const ELECTROADHESION: &str = r#"
[[column]]
name = "voltage_v"
unit = "V"
range = [0, 200]

[[law]]
name = "electroadhesion"
acts_on = "strength"
formula = "gain * (voltage_v / 100)^2"
confused_with = ["hydration_bell"]
parameter = [{ name = "gain", unit = "", range = [0, 1], typical = 0.05 }]
"#;

/// Gain of a hidden effect whose 90th percentile is 10 %: voltages are even from 0 to 200 V.
const GAIN: f64 = 0.1 / (1.8 * 1.8);

/// How the runs were taken.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Protocol {
    Clean,
    /// Every second stroke turns back; coarse clock, spikes, lost rows, two rates.
    Disturbed,
}

fn laws() -> LawsFile {
    LawsFile::parse("mine.toml".as_ref(), ELECTROADHESION).unwrap()
}

/// The measured runs of a case under a voltage that differs from stroke to stroke. The simulator knows no voltage: a strength
/// that falls in proportion to the temperature, which is set to what the voltage does, stands in for it.
fn under_voltage(case: &Case, protocol: Protocol, seed: u64, gain: f64) -> RunSet {
    let mut random = Random::new(seed ^ 0xE1EC);
    let in_proportion = [Hidden { name: "temperature", amplitude: 1.0, shape: [0.0; 2], form: 1.0 }];
    let voltages: Vec<f64> = case.strokes.iter().map(|_| 200.0 * random.unit()).collect();
    let mut next = voltages.iter();
    let readings = &mut |stroke: &Stroke, scatter: &_| {
        let voltage = next.next().expect("a voltage for each stroke") / 100.0;
        let mut charged = stroke.clone();
        charged.plan.temperature_c = 32.0 + gain * voltage * voltage;
        case.finger.readings(&charged, &in_proportion, scatter)
    };
    let mut set = record(&case.strokes, &case.noise, &mut random, "measured", None, readings);
    for (run, voltage) in set.runs.iter_mut().zip(&voltages) {
        run.rows.iter_mut().for_each(|row| row.own[0] = *voltage);
    }
    if protocol == Protocol::Disturbed {
        set = Logger::OPERATOR.log(&set, &mut random);
    }
    set.recognise(&laws().own_columns());
    set
}

fn case_under(protocol: Protocol, seed: u64) -> Case {
    let mut case = case(seed, Hide::Nothing, 0.0, 0, 60, true);
    if protocol == Protocol::Disturbed {
        let mut plans: Vec<_> = case.strokes.iter().map(|s| s.plan.clone()).collect();
        plans.iter_mut().step_by(2).for_each(|p| p.reverse = true);
        case.strokes = fingerpad_tests::synthetic_truth::protocol::strokes(&plans, 30);
        case.calibration = Logger::OPERATOR.log(&case.calibration, &mut Random::new(seed));
    }
    case
}

fn diagnosed(calibration: &RunSet, measured: &RunSet, own: LawsFile) -> (Diagnosis, Evidence) {
    let settings = SelectionSettings { laws: own.with_library(), ..SelectionSettings::default() };
    let options =
        Options { settings, errors: Vec::new(), model: "shipped".into(), plan: PlanConstraints::default(), own };
    let open = || Ok::<_, DiagnoseError>(None);
    diagnose(calibration, measured, &reference(), &options, open, &mut |_| ()).unwrap()
}

fn named(report: &Diagnosis) -> Vec<&str> {
    report.effects.iter().map(|e| e.law.as_str()).collect()
}

/// At 10 %. A logger with spikes, lost rows and a coarse clock may cost the name; another name must never come of it.
#[test]
fn a_hidden_electroadhesion_is_named_with_its_law_and_nothing_else_without() {
    for (protocol, seeds, least) in [(Protocol::Clean, 301..304, 3), (Protocol::Disturbed, 301..306, 3)] {
        let mut count = 0;
        for seed in seeds {
            let case = case_under(protocol, seed);
            let measured = under_voltage(&case, protocol, seed, GAIN);
            let (report, _) = diagnosed(&case.calibration, &measured, laws());
            let (bare, _) = diagnosed(&case.calibration, &measured, LawsFile::default());
            let [with, without] = [&report, &bare].map(|r| (r.verdict, named(r)));
            println!("{protocol:?} seed {seed}: {with:?}; without: {without:?}");
            assert!(matches!(bare.verdict, Verdict::UnexplainedStructure | Verdict::None), "{without:?}");
            assert!(report.effects.iter().all(|e| e.law == "electroadhesion"), "{with:?}");
            if report.verdict == Verdict::Named {
                let gain = &report.effects[0].parameters[0];
                println!("  gain {:.4} {:.4?}, truth {GAIN:.4}", gain.value, gain.ci95);
                assert!((gain.value / GAIN - 1.0).abs() < 0.25, "{gain:?}");
                count += 1;
            }
        }
        assert!(count >= least, "{protocol:?}: {count} named");
    }
}

#[test]
fn a_file_of_laws_names_nothing_where_its_column_does_nothing() {
    for seed in [311, 312] {
        let case = case_under(Protocol::Clean, seed);
        let measured = under_voltage(&case, Protocol::Clean, seed, 0.0);
        let (report, _) = diagnosed(&case.calibration, &measured, laws());
        assert_eq!((report.verdict, named(&report)), (Verdict::None, vec![]), "{seed}");
    }
}

/// The corrected file through the core, its table among it, leaves of the runs what the report says.
#[test]
fn the_corrected_file_runs_the_law_as_a_table() {
    let case = case_under(Protocol::Clean, 321);
    let measured = under_voltage(&case, Protocol::Clean, 321, 3.0 * GAIN);
    let (report, evidence) = diagnosed(&case.calibration, &measured, laws());
    assert_eq!(named(&report), ["electroadhesion"]);
    let made = corrected_model(shipped().file().model.data(), &reference(), &evidence).unwrap();
    let [table] = &made.tables[..] else { panic!("{:?}", made.tables) };
    println!("{table}");
    assert!(
        table.largest_error <= 2e-3 * table.largest_change && (table.ranges[0][1] - 200.0).abs() < 1e-3,
        "{table:?}"
    );
    let file = fingerpad::ModelFile::new(&made.bytes).unwrap();
    let file = file.file();
    let [column] = file.columns else { panic!("{:?}", file.columns) };
    assert_eq!((column.name(), column.unit(), column.low, column.high), ("voltage_v", "V", 0.0, 200.0));
    let effects = fingerpad::Effects::of_file(&file).unwrap();
    let (rms_n, _) = replay_all(&file.model, &effects, &evidence.checked_set);
    let (without_n, _) = replay_all(&file.model, &fingerpad::Effects::new(&[]).unwrap(), &evidence.checked_set);
    println!("core {rms_n:.5?} N, without effects {without_n:.5?} N, report {:?} N", report.holdout.rms_after_n);
    assert_eq!(rms_n, made.rms_n);
    for k in 1..3 {
        assert!(rms_n[k] < 0.5 * without_n[k], "{k}: {rms_n:?} {without_n:?}");
    }
}
