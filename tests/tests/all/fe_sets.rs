//! Hidden sets from the finite-element finger with an effect inside its law (`tests/data/fe_sets`, made by
//! `make_fe_sets`): other shapes and meshes than the shipped model's, 18 strokes each.

use std::collections::BTreeMap;

use fingerpad_diagnose::{Confirmed, RunSet, Verdict};
use fingerpad_tests::synthetic_truth::effects::LIBRARY;
use fingerpad_tests::synthetic_truth::fe_sets::{confirm, sets};
use fingerpad_tests::synthetic_truth::score::{run, run_with_evidence};

#[test]
fn effects_inside_the_finite_element_law_are_named() {
    let mut calibrations: BTreeMap<String, RunSet> = BTreeMap::new();
    let (mut laws, mut right, mut wrong, mut alarms) = (0, 0, 0, 0);
    for set in sets() {
        let calibration = calibrations.entry(set.shape.clone()).or_insert_with(|| set.calibration());
        let report = run(calibration, &set.measured(), None);
        let hidden = LIBRARY.iter().find(|l| l.0 == set.law);
        let families: Vec<&str> = report.effects.iter().map(|e| e.family.as_str()).collect();
        let lone = report.verdict == Verdict::Named;
        match hidden {
            Some((_, family)) => {
                laws += 1;
                right += usize::from(lone && families == [*family]);
                wrong += usize::from(lone && !families.contains(family));
            }
            None => alarms += usize::from(lone),
        }
        let parameters: Vec<String> = report
            .effects
            .iter()
            .map(|e| {
                let candidates: Vec<&str> = e.candidates.iter().map(|c| c.law.as_str()).collect();
                format!("{candidates:?} {:.3}", e.parameters[0].value)
            })
            .collect();
        println!(
            "{} shape {} hidden {} {}: {:?} {parameters:?} partial {:?} column {} misfit {:.2?} held out {:.2} -> {:.2}",
            set.file,
            set.shape,
            set.law,
            set.amplitude,
            report.verdict,
            report.unexplained.partial.iter().map(|p| p.law.as_str()).collect::<Vec<_>>(),
            report.unexplained.column,
            report.baseline.calibration_misfit,
            report.holdout.ratio_before,
            report.holdout.ratio_after,
        );
        assert!(report.holdout.ratio_after <= report.holdout.ratio_before, "{}", set.file);
    }
    println!("{right} of {laws} laws named alone and right, {wrong} wrong, {alarms} lone names without a law");
    assert!(wrong == 0 && alarms == 0, "{wrong} wrong, {alarms} without a law");
    // One less than 18 strokes gave when this was written; the aim is nine of ten.
    assert!(right >= 13, "{right} of {laws}");
}

/// The finite elements' own gap closes down to the floor. `cargo xtask bench confirm` does it for all sets.
#[test]
#[ignore = "nightly"]
fn the_finite_elements_confirm_what_was_named() {
    let set = sets().into_iter().find(|s| s.law == "strain_stiffening").unwrap();
    let (report, evidence) = run_with_evidence(&set.calibration(), &set.measured(), None);
    assert_eq!(report.effects.len(), 1);
    let fe = confirm(&evidence, &set.shape, 8, 2);
    println!("{fe:?}");
    assert!(fe.without_equilibrium.is_empty() && fe.runs.len() == 8, "{fe:?}");
    assert_eq!(fe.confirmed, Confirmed::Yes, "{:?}", fe.gap());
}
