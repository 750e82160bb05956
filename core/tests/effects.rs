//! The library of effects against `data/law-vectors.csv`, and in itself.

#[path = "common/law_vectors.rs"]
mod law_vectors;

use fingerpad::effects::{Change, Conditions, LAWS, Law, Library, Standard, VALUES, baseline, find};

/// Laws, parameters, inputs and outputs that every implementation of a law must give; a file of the repository.
const VECTORS: &str = include_str!("data/law-vectors.csv");

#[test]
fn every_law_has_vectors_and_agrees_with_them_in_both_precisions() {
    let (_, lines) = VECTORS.split_once('\n').unwrap();
    law_vectors::check::<Standard>(LAWS, lines);
}

#[test]
fn laws_are_whole() {
    for (i, law) in LAWS.iter().enumerate() {
        assert_eq!(law.kind as usize, i + 1);
        assert!(law.kind < baseline::DIRECTION);
        assert_eq!(find(law.name), Some(*law));
        assert_eq!(LAWS.iter().filter(|other| other.name == law.name).count(), 1);
        assert!(law.linear >= 1 && law.linear <= law.parameters.len() && law.parameters.len() <= VALUES);
        assert!(!law.source.is_empty() && !law.shapes.is_empty());
        for (k, p) in law.parameters.iter().enumerate() {
            assert!(p.low < p.high && p.typical != 0.0, "{} {}", law.name, p.name);
            // The fit takes its logarithm, and the linear ones as they are.
            assert!(!p.positive || (p.low > 0.0 && k >= law.linear), "{} {}", law.name, p.name);
        }
        for shape in law.shapes {
            assert_eq!(shape.len(), law.parameters.len() - law.linear, "{}", law.name);
            for (p, v) in law.parameters[law.linear..].iter().zip(*shape) {
                assert!(p.low <= *v && *v <= p.high, "{} {} {v}", law.name, p.name);
            }
        }
        for other in law.confused_with {
            assert!(find(other).is_some(), "{} names {other}", law.name);
        }
    }
}

/// Conditions under which every law acts.
const AT: Conditions<f64> = Conditions {
    t_s: 900.0,
    depth_mm: 1.2,
    contact_time_s: 3.0,
    speed_mm_s: 7.0,
    double_angle: [0.6, 0.8],
    along: [1.0, 0.0],
    path_mm: 0.4,
    turn_mm: 0.4,
    dwell_s: 2.0,
    occlusion_s: 9.0,
    hydration_au: 60.0,
    temperature_c: 29.0,
    width_mm: 18.0,
};

/// What a law does there with a size and its first shape.
fn change(law: &Law, size: f64) -> Change<f64> {
    let mut values = vec![0.0; law.linear];
    values.extend_from_slice(law.shapes[0]);
    values[0] = size;
    let mut change = Change::default();
    law.apply(&values, &AT, &mut change);
    change
}

#[test]
fn no_size_no_effect_and_no_factor_below_the_floor() {
    for law in LAWS {
        assert_eq!(change(law, 0.0), Change::default(), "{}", law.name);
        assert_ne!(change(law, law.parameters[0].typical), Change::default(), "{}", law.name);
        let least = change(law, -1e3);
        assert!(least.strength >= 0.1 && least.stiffness >= 0.1, "{}", law.name);
    }
}

#[test]
fn a_driver_that_is_not_known_leaves_the_law_out() {
    let unknown = Conditions { hydration_au: f64::NAN, temperature_c: f64::NAN, width_mm: f64::NAN, ..AT };
    for name in ["hydration_bell", "temperature", "subject_size"] {
        let mut change = Change::default();
        find(name).unwrap().apply(&[0.3, 55.0, 15.0], &unknown, &mut change);
        assert_eq!(change, Change::default(), "{name}");
    }
}

#[test]
fn reported_and_fitted_parameters_are_each_others_inverse() {
    for law in LAWS {
        let reported: Vec<f64> = law.parameters.iter().map(|p| p.typical).collect();
        let again = law.report(&law.fitted(&reported));
        for (a, b) in reported.iter().zip(again) {
            assert!((a - b).abs() < 1e-12 * a.abs(), "{} {a} {b}", law.name);
        }
    }
    // An axis of -30 degrees is told as 150.
    let anisotropy = find("anisotropy").unwrap();
    assert!((anisotropy.report(&anisotropy.fitted(&[0.2, -30.0]))[1] - 150.0).abs() < 1e-12);
}

#[test]
fn slots_are_held_to_their_laws_rules() {
    for law in LAWS {
        let rules = Standard::rules(law.kind).unwrap();
        assert_eq!(rules.place, law.place);
        for (k, p) in law.parameters.iter().enumerate() {
            assert_eq!(rules.positive[k], p.positive);
        }
    }
    assert_eq!(Standard::rules(0), None);
    assert_eq!(Standard::rules(LAWS.len() as u32 + 1), None);
}
