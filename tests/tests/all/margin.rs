//! The observer of the margin to slip against finite elements that no fit has seen: a short form of the page's tables.

use std::path::Path;

use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad_tests::margin::poses::errors_in_poses;
use fingerpad_tests::margin::score::{Alarm, Errors, LIMITS_N, Lab, announcements, errors};
use fingerpad_tests::margin::truth::{Sensors, Truth};
use fingerpad_tests::margin::{OTHER_LAMBDA, stored};

/// Margins 0.25 and 0.05 in `MARGINS`.
const QUARTER: usize = 3;
const LATE: usize = 5;

#[test]
fn the_strength_is_known_and_slip_announced_before_it_comes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let file = ModelFile::new(&std::fs::read(root.join("data/models/fingertip.fpm")).unwrap()).unwrap();
    let model = file.file().model;
    let mut runs = stored(&model, &root.join("data/runs"), true).unwrap().straight;
    runs.extend(Truth::read(&model, &std::fs::read_to_string(root.join(OTHER_LAMBDA)).unwrap()));
    assert!(runs.len() > 4);
    let sensors = Sensors::of(5.0, 5.0);
    let found = errors(&mut Lab::new(model, runs.clone(), LIMITS_N, 3), &sensors, 30, false);
    let [quarter, late] = [QUARTER, LATE].map(|k| found[k]);
    println!("{quarter:?} {late:?}");
    assert!(quarter.rms() < 0.3 && late.rms() < 0.22, "{} {}", quarter.rms(), late.rms());
    assert!(quarter.covered[0] >= 0.9 * quarter.number && quarter.safe >= 0.9 * quarter.number, "{quarter:?}");
    let found = announcements(&mut Lab::new(model, runs, LIMITS_N, 4), &sensors, 30, &[Alarm::Observer]);
    println!("{found:?}");
    assert!(found[0].before * 10 >= 9 * found[0].slips && found[0].false_ones <= 1, "{found:?}");
    assert!(found[0].median_lead_mm() > 0.3, "{found:?}");
}

/// In the finger's own pose the pad's band holds the margin where that of a bed of another pose does not, and all that slips is announced.
#[test]
#[ignore = "nightly"]
fn a_pad_knows_the_margin_in_other_poses() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let file = ModelFile::new(&std::fs::read(root.join("data/models/fingertip.fpm")).unwrap()).unwrap();
    let pad = PadModelFile::new(&std::fs::read(root.join("data/models/fingertip-pad.fpm")).unwrap()).unwrap();
    let sensors = Sensors::of(5.0, 5.0);
    let [of_pad, of_bed] =
        errors_in_poses(&file.file().model, &pad.file().pad, &root.join("data/runs"), &sensors).unwrap();
    for (name, (errors, announced)) in [("pad", &of_pad), ("bed", &of_bed)] {
        println!("{name} {announced:?} {errors:#?}");
    }
    let covers = |errors: &[Errors; 6]| {
        let sum = |of: fn(&Errors) -> f64| errors[1..].iter().map(of).sum::<f64>();
        sum(|e| e.covered[1]) / sum(|e| e.number)
    };
    let [pad, bed] = [&of_pad, &of_bed].map(|(errors, _)| covers(errors));
    assert!(pad > 0.88 && pad > bed + 0.08, "{pad} {bed}");
    let [announced, slips] = of_pad.1;
    assert!(slips >= 30 && 20 * announced >= 19 * slips, "{announced} of {slips}");
}
