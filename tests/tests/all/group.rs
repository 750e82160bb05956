//! Several fingers in one analysis, each with a geometry, a calibration and scatter of its own.

use fingerpad_diagnose::{
    CORNEOMETER_SD_AU, CovariateError, DiagnoseError, FingerSets, GroupDiagnosis, GroupVerdict, LawsFile, Options,
    PlanConstraints, SelectionSettings, Verdict, diagnose_group, laws::Column,
};
use fingerpad_tests::synthetic_truth::effects::LIBRARY;
use fingerpad_tests::synthetic_truth::score::reference;
use fingerpad_tests::synthetic_truth::sets::{Hide, case};

/// Fingers of the first simulator with these seeds and sizes of a law; size 0 for none.
fn fingers(law: &str, seeds_and_sizes: &[(u64, f64)]) -> Vec<FingerSets> {
    let place = LIBRARY.iter().position(|l| l.0 == law).expect("a law of the library");
    let one = |&(seed, size): &(u64, f64)| {
        let hide = if size > 0.0 { Hide::Law(place) } else { Hide::Nothing };
        let made = case(seed, hide, size, 0, 30, true);
        FingerSets { name: format!("finger {seed}"), calibration: made.calibration, measured: made.measured }
    };
    seeds_and_sizes.iter().map(one).collect()
}

fn diagnosed(fingers: &[FingerSets]) -> Result<GroupDiagnosis, DiagnoseError> {
    let options = Options {
        settings: SelectionSettings::default(),
        errors: vec![CovariateError { column: Column::Hydration, sd: CORNEOMETER_SD_AU }],
        model: "shipped".into(),
        plan: PlanConstraints::default(),
        own: LawsFile::default(),
    };
    let report = diagnose_group(fingers, &reference(), &options, &mut |_| {})?;
    for law in &report.laws {
        println!("{} gain {:.0} {:.0?} p {:.1e}", law.law, law.gain_2ll, law.gains_2ll, law.p_model);
        law.sizes.iter().for_each(|s| println!("  {s:?}"));
    }
    println!(
        "{:?}, alone {:?}",
        report.verdict,
        report.fingers.iter().map(|f| (f.verdict, &f.laws)).collect::<Vec<_>>()
    );
    Ok(report)
}

/// An effect of 3 % that single fingers show too weakly to be named is named for four together, and its size is that of all.
#[test]
fn fingers_show_together_what_one_alone_does_not() {
    let fingers = fingers("temperature", &[(900, 0.03), (901, 0.03), (902, 0.03), (903, 0.03)]);
    let report = diagnosed(&fingers).unwrap();
    assert_eq!(report.verdict, GroupVerdict::Shared);
    assert_eq!(report.laws[0].law, "temperature");
    let named = report.fingers.iter().filter(|f| f.verdict == Verdict::Named).count();
    assert!(named < 4, "each finger names it by itself");
    let [low, high] = report.laws[0].sizes[0].ci95;
    assert!(low * high > 0.0);
}

/// Without an effect nothing is shared. Runs of one finger under two names are refused.
#[test]
fn fingers_without_an_effect_share_none() {
    let mut group = fingers("temperature", &[(910, 0.0), (911, 0.0), (912, 0.0), (913, 0.0)]);
    assert_eq!(diagnosed(&group).unwrap().verdict, GroupVerdict::None);
    group[1].measured = group[0].measured.clone();
    let refused = diagnosed(&group).unwrap_err().to_string();
    assert!(refused.contains("another finger"), "{refused}");
}

/// Fingers with the same law of very different sizes share it, and their difference is reported.
#[test]
fn different_sizes_are_reported_as_heterogeneity() {
    let of = |sizes: [f64; 4]| {
        let list: Vec<(u64, f64)> = sizes.iter().enumerate().map(|(k, s)| (920 + k as u64, *s)).collect();
        let report = diagnosed(&fingers("viscous_drag", &list)).unwrap();
        assert_ne!(report.verdict, GroupVerdict::None);
        assert_eq!(report.laws[0].law, "viscous_drag");
        let size = &report.laws[0].sizes[0];
        (size.sd_between_fingers / size.mean.abs(), size.p_heterogeneity)
    };
    let (unequal, p) = of([0.05, 0.1, 0.3, 0.3]);
    let (equal, _) = of([0.1; 4]);
    println!("scatter over mean: {unequal:.2} (p {p:.1e}) and {equal:.2}");
    assert!(p < 1e-3 && unequal > 2.0 * equal && unequal > 0.3);
}
