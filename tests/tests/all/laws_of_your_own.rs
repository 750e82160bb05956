//! A law of the user's own in the diagnosis: a hidden electroadhesion is named with its file of laws and refused without, also one
//! that follows the voltage late or its rate.

use std::f64::consts::TAU;

use fingerpad_diagnose::confirm::{FeRow, FeStroke, FingerScale};
use fingerpad_diagnose::laws::{Column, find};
use fingerpad_diagnose::{
    ActiveLaw, ColumnMap, DiagnoseError, Diagnosis, Evidence, LawsFile, Options, PlanConstraints, RunSet,
    SelectionSettings, Verdict, corrected_model, diagnose, replay_all, runs_csv,
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_tests::synthetic_truth::Random;
use fingerpad_tests::synthetic_truth::csv;
use fingerpad_tests::synthetic_truth::effects::Effect as Hidden;
use fingerpad_tests::synthetic_truth::fe_sets::{self, confirm};
use fingerpad_tests::synthetic_truth::loggers::{self, Logger};
use fingerpad_tests::synthetic_truth::protocol::{Stroke, logged_strokes};
use fingerpad_tests::synthetic_truth::score::{reference, shipped};
use fingerpad_tests::synthetic_truth::sets::{Case, Hide, case, case_of, record};

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

/// The measured runs of a case under a voltage that differs from stroke to stroke. The simulator has no voltage. It is
/// replaced by a strength that falls in proportion to the temperature, which is set to the voltage's influence.
fn under_voltage(case: &Case, protocol: Protocol, seed: u64, gain: f64) -> RunSet {
    let mut random = Random::new(seed ^ 0xE1EC);
    let voltages: Vec<f64> = case.strokes.iter().map(|_| 200.0 * random.unit()).collect();
    under_voltages(case, protocol, &mut random, gain, &voltages)
}

/// The same under given voltages, one a stroke.
fn under_voltages(case: &Case, protocol: Protocol, random: &mut Random, gain: f64, voltages: &[f64]) -> RunSet {
    let in_proportion = [Hidden { name: "temperature", amplitude: 1.0, shape: [0.0; 2], form: 1.0 }];
    let mut next = voltages.iter();
    let readings = &mut |stroke: &Stroke, scatter: &_| {
        let voltage = next.next().expect("a voltage for each stroke") / 100.0;
        let mut charged = stroke.clone();
        charged.plan.temperature_c = 32.0 + gain * voltage * voltage;
        case.finger.readings(&charged, &in_proportion, scatter)
    };
    let mut set = record(&case.strokes, &case.noise, random, "measured", None, readings);
    for (run, voltage) in set.runs.iter_mut().zip(voltages) {
        run.rows.iter_mut().for_each(|row| row.own[0] = *voltage);
    }
    if protocol == Protocol::Disturbed {
        set = Logger::OPERATOR.log(&set, random);
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
    diagnosed_within(calibration, measured, own, PlanConstraints::default())
}

fn diagnosed_within(
    calibration: &RunSet,
    measured: &RunSet,
    own: LawsFile,
    plan: PlanConstraints,
) -> (Diagnosis, Evidence) {
    let settings = SelectionSettings { laws: own.with_library(), ..SelectionSettings::default() };
    let options = Options { settings, errors: Vec::new(), model: "shipped".into(), plan, own };
    let open = || Ok::<_, DiagnoseError>(None);
    diagnose(calibration, measured, &reference(), &options, open, &mut |_| ()).unwrap()
}

fn named(report: &Diagnosis) -> Vec<&str> {
    report.effects.iter().map(|e| e.law.as_str()).collect()
}

/// At 10 %, under a faultless logger and under one with spikes, lost rows and a coarse clock.
#[test]
#[ignore = "nightly"]
fn a_hidden_electroadhesion_is_named_with_its_law_and_nothing_else_without() {
    for (protocol, seeds) in [(Protocol::Clean, 301..304), (Protocol::Disturbed, 301..306)] {
        for seed in seeds {
            let case = case_under(protocol, seed);
            let measured = under_voltage(&case, protocol, seed, GAIN);
            let (report, _) = diagnosed(&case.calibration, &measured, laws());
            let (bare, _) = diagnosed(&case.calibration, &measured, LawsFile::default());
            let [with, without] = [&report, &bare].map(|r| (r.verdict, named(r)));
            println!("{protocol:?} seed {seed}: {with:?}; without: {without:?}");
            assert!(matches!(bare.verdict, Verdict::UnexplainedStructure | Verdict::None), "{without:?}");
            assert_eq!(with, (Verdict::Named, vec!["electroadhesion"]), "{protocol:?} seed {seed}");
            let gain = &report.effects[0].parameters[0];
            println!("  gain {:.4} {:.4?}, truth {GAIN:.4}", gain.value, gain.ci95);
            assert!((gain.value / GAIN - 1.0).abs() < 0.25, "{gain:?}");
        }
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

/// Laws of a voltage that changes within a run: of its value 0.3 s before, of its rate, and of its value now.
const CHANGING_VOLTAGE: &str = r#"
[[column]]
name = "voltage_v"
unit = "V"
range = [0, 200]

[[column]]
name = "late_v"
unit = "V"
range = [0, 200]
delayed = "voltage_v"
delay_s = 0.3

[[column]]
name = "voltage_rate"
unit = "V/s"
range = [-400, 400]
rate_of = "voltage_v"

[[law]]
name = "late"
acts_on = "strength"
formula = "gain * (late_v / 100)^2"
confused_with = ["prompt", "rate"]
parameter = [{ name = "gain", unit = "", range = [0, 1], typical = 0.05 }]

[[law]]
name = "rate"
acts_on = "strength"
formula = "gain * (voltage_rate / 100)^2"
confused_with = ["prompt", "late"]
parameter = [{ name = "gain", unit = "", range = [0, 1], typical = 0.05 }]

[[law]]
name = "prompt"
acts_on = "strength"
formula = "gain * (voltage_v / 100)^2"
confused_with = ["late", "rate"]
parameter = [{ name = "gain", unit = "", range = [0, 1], typical = 0.05 }]
"#;

/// Measured runs at 100 rows a second whose strength follows a swinging voltage by a law of the file above, through the logger of the
/// case; `law` of size 0 is no effect.
fn under_changing_voltage(case: &Case, seed: u64, law: &str, size: f64) -> RunSet {
    let mut random = Random::new(seed ^ 0xE1EC);
    let rate = case.protocol.rate(seed, false).expect("a constant rate");
    let plans: Vec<_> = case.strokes.iter().map(|s| s.plan.clone()).collect();
    let logged = logged_strokes(&plans, rate.rate_hz, rate.lifts, &mut random);
    let (strokes, read): (Vec<Stroke>, Vec<_>) = logged.into_iter().map(|l| (l.stroke, l.read)).unzip();
    let phases: Vec<f64> = strokes.iter().map(|_| TAU * random.unit()).collect();
    let omega = TAU / 3.0;
    let voltage = |t_s: f64, phase: f64| 100.0 + 80.0 * (omega * t_s + phase).sin();
    let strength = |t_s: f64, phase: f64| match law {
        "late" => size * (voltage(t_s - 0.3, phase) / 100.0).powi(2),
        "rate" => size * (0.8 * omega * (omega * t_s + phase).cos()).powi(2),
        _ => size * (voltage(t_s, phase) / 100.0).powi(2),
    };
    // The simulator has no voltage: it is replaced by a contact time, of which the strength is 2 - exp(-time); never below 1.
    let by_contact_time = [Hidden { name: "occlusion_growth", amplitude: 1.0, shape: [1.0, 0.0], form: 1.0 }];
    let mut next = phases.iter();
    let set = record(&strokes, &case.noise, &mut random, "measured", None, &mut |stroke, scatter| {
        let phase = *next.next().expect("a phase for each stroke");
        let mut charged = stroke.clone();
        charged.rows.iter_mut().for_each(|row| row.occlusion_s = -(-strength(row.t_s, phase)).ln_1p());
        let times: Vec<f64> = stroke.rows.iter().map(|row| row.t_s).collect();
        let signed = case.finger.readings(&charged, &by_contact_time, scatter);
        rate.through(&times, signed)
    });
    let text = csv::text(&set);
    let mut lines = text.lines();
    let mut out = format!("{},voltage_v\n", lines.next().expect("a header"));
    for ((run, phase), read) in set.runs.iter().zip(&phases).zip(&read) {
        let lines: Vec<&str> = lines.by_ref().take(run.rows.len()).collect();
        for i in read {
            out += &format!("{},{}\n", lines[*i], voltage(run.rows[*i].t_s, *phase));
        }
    }
    let path = std::env::temp_dir().join(format!("changing-voltage-{law}-{seed}-{}.csv", std::process::id()));
    std::fs::write(&path, out).unwrap();
    let laws = LawsFile::parse("mine.toml".as_ref(), CHANGING_VOLTAGE).unwrap();
    let map = ColumnMap::parse_with(laws.columns, None, None, "").unwrap();
    let read = runs_csv::read_mapped(&path, &map, &mut |_| true).unwrap();
    std::fs::remove_file(&path).unwrap();
    read
}

/// A law of the derivative of a column and one of an earlier value, at 100 rows a second with and without a lag of the forces.
#[test]
#[ignore = "nightly"]
fn laws_of_a_rate_and_of_an_earlier_value_are_named_and_not_that_of_the_value_now() {
    for (protocol, seed, law, size) in [
        (loggers::Protocol::Uniform100, 341, "late", 0.06),
        (loggers::Protocol::Lag, 342, "late", 0.06),
        (loggers::Protocol::Lag, 343, "rate", 0.06),
        (loggers::Protocol::Lag, 344, "prompt", 0.06),
        (loggers::Protocol::Lag, 345, "prompt", 0.0),
    ] {
        let case = case_of(protocol, seed, Hide::Nothing, 0.0, 0, 60, true);
        let measured = under_changing_voltage(&case, seed, law, size);
        let laws = LawsFile::parse("mine.toml".as_ref(), CHANGING_VOLTAGE).unwrap();
        let (report, _) = diagnosed(&case.calibration, &measured, laws);
        println!("{protocol:?} {seed} {law}: {:?} {:?}, lag {:?}", report.verdict, named(&report), report.instrument);
        if size == 0.0 {
            assert_eq!((report.verdict, named(&report)), (Verdict::None, vec![]));
            continue;
        }
        assert_eq!((report.verdict, named(&report)), (Verdict::Named, vec![law]), "{protocol:?} {seed}");
        let found = &report.effects[0].parameters[0];
        println!("  {:.4} {:.4?}, truth {size}", found.value, found.ci95);
        assert!((found.value / size - 1.0).abs() < 0.25, "{found:?}");
    }
}

/// The corrected file through the core, its table included, gives the residual of the runs that the report states.
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
    let file = fingerpad::host::ModelFile::new(&made.bytes).unwrap();
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

/// A second law, of the humidity of the air, which takes a quarter of an hour to settle.
const HUMID_AIR: &str = r#"
[[column]]
name = "humidity_percent"
unit = "%"
range = [40, 60]
settle_s = 900

[[law]]
name = "humid_air"
acts_on = "strength"
formula = "share * ((humidity_percent - 40) / 10)^2"
confused_with = ["electroadhesion"]
parameter = [{ name = "share", unit = "", range = [0, 1], typical = 0.05 }]
"#;

/// A voltage that rose with the humidity of the air: no protocol can distinguish the two until either is set
/// independently.
#[test]
fn the_next_experiment_sets_allowed_columns_and_reports_their_cost() {
    let laws = LawsFile::parse("mine.toml".as_ref(), &format!("{ELECTROADHESION}{HUMID_AIR}")).unwrap();
    let case = case_under(Protocol::Clean, 331);
    let mut measured = under_voltage(&case, Protocol::Clean, 331, 3.0 * GAIN);
    measured.runs.iter_mut().flat_map(|run| &mut run.rows).for_each(|row| row.own[1] = 40.0 + row.own[0] / 10.0);
    measured.recognise(&laws.own_columns());
    let plan = |can_set: &[&str]| {
        let can_set = Some(can_set.iter().map(|c| (*c).to_owned()).collect());
        let constraints = PlanConstraints { can_set, least_rest_s: 5.0 };
        let (report, _) = diagnosed_within(&case.calibration, &measured, laws.clone(), constraints);
        assert_eq!(report.verdict, Verdict::Ambiguous, "{:?}", named(&report));
        let mut candidates: Vec<&str> = report.effects[0].candidates.iter().map(|c| c.law.as_str()).collect();
        candidates.sort_unstable();
        assert_eq!(candidates, ["electroadhesion", "humid_air"]);
        let next = report.next_experiment.expect("a plan");
        println!("{}: {:.0} in {:.0} min; {:?}", next.factor, next.lambda_rival_expected, next.minutes, next.prices);
        next
    };
    let next = plan(&["voltage_v", "humidity_percent", "speed_mm_s"]);
    let price = |factor: &str| next.prices.iter().find(|p| p.factor == factor).expect("its price");
    let [voltage, humidity, speed] = ["voltage_v", "humidity_percent", "speed_mm_s"].map(price);
    // Either column separates the two; an effect that does not change with either adds nothing to the present runs.
    let added = [voltage, humidity].map(|p| p.lambda_rival_expected - speed.lambda_rival_expected);
    assert!(added.iter().all(|a| *a > 100.0), "{:?}", next.prices);
    // Of fifteen even values of the humidity each has its quarter of an hour, where the voltage has the rest of a minute.
    assert!(humidity.minutes > voltage.minutes + 30.0 && voltage.minutes < 25.0, "{:?}", next.prices);
    let next = plan(&["voltage_v"]);
    let volts: Vec<f64> = next.runs.iter().map(|r| r.own["voltage_v"]).collect();
    assert!(volts.contains(&0.0) && volts.contains(&200.0), "{volts:?}");
    assert!(next.runs.iter().all(|r| r.own.len() == 1 && r.speed_mm_s.is_none()), "{:?}", next.runs);
    // If neither may be set, the plan uses the other columns, and separates less.
    let without = plan(&["speed_mm_s"]);
    assert!(without.runs.iter().all(|r| r.own.is_empty()), "{:?}", without.runs);
    assert!(without.lambda_rival_expected < next.lambda_rival_expected - 100.0, "{:?}", without.prices);
}

/// A law of the plate's temperature, with the part of the model that it acts on.
fn plate(acts_on: &str, formula: &str, parameter: &str) -> LawsFile {
    let text = format!(
        "[[column]]\nname = \"plate_temperature_c\"\nunit = \"°C\"\nrange = [15, 45]\nreference = 32\n\n[[law]]\nname = \"plate\"\n\
         acts_on = \"{acts_on}\"\nformula = \"{formula}\"\nparameter = [{{ {parameter} }}]\n"
    );
    LawsFile::parse("plate.toml".as_ref(), &text).unwrap()
}

/// Runs whose temperature is the plate's, under a column of the user's own, and not the skin's.
fn of_the_plate(set: &RunSet, laws: &LawsFile) -> RunSet {
    let mut set = set.clone();
    set.recorded.retain(|column| *column != Column::Temperature);
    for row in set.runs.iter_mut().flat_map(|run| &mut run.rows) {
        (row.own[0], row.temperature_c) = (row.temperature_c, f64::NAN);
    }
    set.recognise(&laws.own_columns());
    set
}

/// A law of a file acts on a stroke of the finite elements like the library's law of the same form, in every place.
#[test]
fn the_finite_elements_take_a_law_of_a_file_as_the_librarys() {
    let slope = "name = \"slope\", unit = \"1/°C\", range = [-0.1, 0.1], typical = 0.01";
    let drift = "name = \"drift\", unit = \"1/s\", range = [-1e-4, 1e-4], typical = 1e-5";
    let offset = "name = \"offset_mm\", unit = \"mm\", range = [-0.3, 0.3], typical = 0.05";
    let bias = "name = \"bias_n\", unit = \"N\", range = [-0.3, 0.3], typical = 0.05";
    let friction = RubberFriction::default();
    let scale = FingerScale::default();
    let recorded = fe_sets::sets().iter().find(|s| s.law == "temperature").unwrap().measured();
    for (acts_on, formula, parameter, value, library, values) in [
        ("strength", "slope * (plate_temperature_c - 32)", slope, -0.04, "temperature", vec![-0.04]),
        ("stiffness", "drift * t_s * (1 + 0 * plate_temperature_c / 32)", drift, 5e-5, "stiffness_drift", vec![0.18]),
        ("depth", "offset_mm * min(plate_temperature_c / 15, 1)", offset, 0.08, "depth_zero_offset", vec![0.08]),
        ("reading_normal", "bias_n * min(plate_temperature_c / 15, 1)", bias, 0.03, "tare_bias", vec![0.03, 0.0, 0.0]),
    ] {
        let laws = plate(acts_on, formula, parameter);
        let set = of_the_plate(&recorded, &laws);
        let own = [ActiveLaw { law: laws.laws[0].law, values: vec![value] }];
        let known = [ActiveLaw { law: find(library).unwrap(), values }];
        let mut acts = false;
        for (run, plain) in set.runs.iter().zip(&recorded.runs) {
            let kept: Vec<usize> = (0..run.rows.len()).collect();
            let stroke = |run, laws| FeStroke::new(run, &kept, laws, &scale, None, friction);
            let [with, wanted, without] = [stroke(run, &own), stroke(plain, &known), stroke(plain, &[])];
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
            let forces = vec![FeRow { force_n: [0.5, 0.2, -0.1], area_mm2: 40.0, stick_ratio: 0.0 }; kept.len()];
            let [read, read_wanted, read_without] = [&with, &wanted, &without].map(|s| s.readings(&forces, 1.0));
            for (k, (w, want)) in with.path.waypoints.iter().zip(&wanted.path.waypoints).enumerate() {
                assert!(near(w.normal, want.normal), "{acts_on} row {k}: depth {} {}", w.normal, want.normal);
                for t_s in [w.t_s - 0.013, w.t_s] {
                    let [a, b, c] = [&with, &wanted, &without].map(|s| s.law_at(t_s));
                    assert!(near(a.lambda, b.lambda) && near(a.tau0_mpa, b.tau0_mpa), "{acts_on} row {k}: {a:?} {b:?}");
                    acts |= a != c;
                }
                acts |= w.normal != without.path.waypoints[k].normal;
            }
            for ((a, b), c) in read.iter().zip(&read_wanted).zip(&read_without) {
                assert!((0..3).all(|k| near(a[k], b[k])), "{acts_on}: {a:?} {b:?}");
                acts |= a != c;
            }
        }
        assert!(acts, "{acts_on} does nothing");
    }
}

/// The finite elements' own gap closes with a law of a file: the stored set whose strength falls with the temperature, which
/// here is the plate's and a column of the user's own.
#[test]
#[ignore = "nightly"]
fn the_finite_elements_confirm_a_law_of_a_file() {
    let laws = plate(
        "strength",
        "slope * (plate_temperature_c - 32)",
        "name = \"slope\", unit = \"1/°C\", range = [-0.1, 0.1], typical = -0.01",
    );
    let set = fe_sets::sets().into_iter().find(|s| s.law == "temperature").unwrap();
    let [calibration, measured] = [set.calibration(), set.measured()].map(|s| of_the_plate(&s, &laws));
    let (report, evidence) = diagnosed(&calibration, &measured, laws);
    assert_eq!((report.verdict, named(&report)), (Verdict::Named, vec!["plate"]));
    let slope = &report.effects[0].parameters[0];
    assert!(slope.ci95[0] <= set.amplitude && set.amplitude <= slope.ci95[1], "{slope:?}");
    let fe = confirm(&evidence, &set.shape, 3, 2);
    let worst = |rms: [f64; 3]| (0..3).map(|k| rms[k] / fe.floor_rms_n[k]).fold(0.0, f64::max);
    let (before, after) = (worst(fe.rms_before_n), worst(fe.rms_after_n));
    println!("{before:.2} -> {after:.2} times the floor; {fe:?}");
    assert!(fe.runs.len() == 3 && after < 0.7 * before, "{before} -> {after}");
}
