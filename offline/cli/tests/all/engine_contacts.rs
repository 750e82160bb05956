//! `export --format mujoco-contact`, `newton-contact` and `drake-hydroelastic` of pads: text and JSON, and what is refused.

use std::path::Path;

use crate::common::Folder;
use crate::models::{PAD, SHIPPED};

/// The files that `test_own_contact.py`, `test_drake_contact.py` and `test_newton.py` simulate are those that the program writes, to the rounding of other processors.
#[test]
fn simulated_contacts_are_what_the_program_writes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let files = [
        ("mujoco-contact", "mujoco/tests/contact"),
        ("drake-hydroelastic", "mujoco/tests/drake"),
        ("newton-contact", "warp/tests/newton"),
    ];
    for (tip, (format, stored)) in ["fingertip", "silicone-dome"].iter().flat_map(|tip| files.map(|file| (tip, file))) {
        let folder = Folder::new();
        folder.write("pad.fpm", std::fs::read(root.join(format!("data/models/{tip}-pad.fpm"))).unwrap());
        let (text, _) = folder.done(&format!("export --format {format}-json --model pad.fpm --out -"));
        let stored = root.join(format!("bindings/{stored}_{tip}.json"));
        let stored = std::fs::read_to_string(stored).unwrap();
        let (written, stored): (serde_json::Value, serde_json::Value) =
            (serde_json::from_str(&text).unwrap(), serde_json::from_str(&stored).unwrap());
        for (key, value) in stored.as_object().unwrap() {
            let numbers = |value: &serde_json::Value| -> Vec<f64> {
                value.as_array().map_or(vec![value.clone()], Clone::clone).iter().filter_map(|x| x.as_f64()).collect()
            };
            for (found, wanted) in numbers(&written[key]).iter().zip(numbers(value)) {
                assert!((found - wanted).abs() <= 1e-3 * (wanted.abs() + 0.01), "{tip} {key}: {found} {wanted}");
            }
        }
    }
}

#[test]
fn a_class_of_geoms_states_its_errors() {
    let folder = Folder::new();
    let (text, _) =
        folder.done("export --format mujoco-contact --load-n 0.5 --inverse-mass-per-kg 50 --pitch-deg 45 --out -");
    for part in [
        "Load 0.5000 N at a depth of",
        "friction limit ",
        "cannot stick",
        "50 1/kg",
        "condim=\"4\"",
        "priority=\"1\"",
        "solimp=",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(text.starts_with("<!--") && text.ends_with("</mujoco>\n"));
}

/// Newton's configuration has the names of its `ShapeConfig`, and the torsion that its solvers lack is stated.
#[test]
fn a_configuration_of_newton_states_its_errors() {
    let folder = Folder::new();
    let (text, _) = folder.done("export --format newton-contact --load-n 0.5 --inverse-mass-per-kg 50 --out -");
    for part in [
        "Load 0.5000 N",
        "friction limit ",
        "cannot stick",
        "no torsional friction",
        "torsional limit 100.0 %",
        "ShapeConfig(ke=",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let (text, _) = folder.done("export --format newton-contact-json --load-n 0.5 --inverse-mass-per-kg 50 --out -");
    let numbers: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |key: &str| numbers[key].as_f64().unwrap();
    assert!((number("ke") * 1e-3 * number("depth_mm") - 0.5).abs() < 1e-9);
    assert!((number("kd").powi(2) - 4.0 * number("ke") / 50.0).abs() < 1e-6 * number("ke"));
    assert_eq!(numbers["engine"], "newton");
}

#[test]
fn a_geometry_of_drake_states_its_errors() {
    let folder = Folder::new();
    let (text, _) = folder.done("export --format drake-hydroelastic --out -");
    for part in
        ["torsional limit ", "stiction tolerance", "<drake:hydroelastic_modulus>", "<drake:hunt_crossley_dissipation>"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(text.starts_with("<!--") && text.ends_with("</collision>\n"));
}

#[test]
fn what_has_no_such_contact_is_refused() {
    let folder = Folder::new();
    folder.write("bed.fpm", SHIPPED);
    folder.write("pad.fpm", PAD);
    for (options, reason) in [
        ("--format mujoco-contact --model bed.fpm", "bed.fpm: a bed of springs; this format takes a pad"),
        ("--format mujoco-contact --load-n 40", "load in N 40: the allowed range is 0.02 to"),
        ("--format mujoco-contact --depth-mm 1", "--depth-mm 1: only --format limit-surface"),
        ("--format mujoco-contact-json --pitch-deg 80", "pitch in degrees 80: the allowed range is 10 to 70"),
        ("--format json --load-n 1 --model bed.fpm", "--load-n 1: only --format mujoco-contact"),
        ("--format drake-hydroelastic --load-n 40", "load in N 40: the allowed range is 0.02 to"),
        ("--format newton-contact --model bed.fpm", "bed.fpm: a bed of springs; this format takes a pad"),
        ("--format limit-surface --inverse-mass-per-kg 1", "--inverse-mass-per-kg 1: only --format mujoco-contact"),
    ] {
        folder.refused(&format!("export {options} --out -"), &[reason]);
    }
}
