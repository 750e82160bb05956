//! `export --format mujoco-contact` of pads: MJCF and JSON, and what is refused.

use std::path::Path;

use crate::common::Folder;
use crate::models::{PAD, SHIPPED};

/// The files that `bindings/mujoco/tests/test_own_contact.py` simulates are those that the program writes, to the rounding of other processors.
#[test]
fn simulated_contacts_are_what_the_program_writes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for tip in ["fingertip", "silicone-dome"] {
        let folder = Folder::new();
        folder.write("pad.fpm", std::fs::read(root.join(format!("data/models/{tip}-pad.fpm"))).unwrap());
        let (text, _) = folder.done("export --format mujoco-contact-json --model pad.fpm --out -");
        let stored = std::fs::read_to_string(root.join(format!("bindings/mujoco/tests/contact_{tip}.json"))).unwrap();
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
        ("--format limit-surface --inverse-mass-per-kg 1", "--inverse-mass-per-kg 1: only --format mujoco-contact"),
    ] {
        folder.refused(&format!("export {options} --out -"), &[reason]);
    }
}
