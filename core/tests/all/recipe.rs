//! `core/docs/add-an-effect.md`, followed: its example is compiled as it stands there and runs beside the library's effects.

#[path = "../recipe/sebum_film.rs"]
mod sebum_film;

// What a file in `core/src/effects` finds in the module above it.
use fingerpad::effects::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

use fingerpad::build::{EffectSlot, Params};
use fingerpad::effects::{LAWS, Library, Standard};
use fingerpad::{Contact, Effects, Error, Field, Motion, SPRINGS, Surroundings};
use sebum_film::SebumFilm;

const DOCUMENT: &str = include_str!("../../docs/add-an-effect.md");
const LIST: &str = include_str!("../../src/effects/mod.rs");

/// The document's only block of a language.
fn block(language: &str) -> &'static str {
    let (_, block) = DOCUMENT.split_once(&format!("\n```{language}\n")).unwrap();
    block.split_once("```").unwrap().0
}

#[test]
fn the_documents_file_is_the_one_that_is_compiled() {
    assert_eq!(block("rust"), include_str!("../recipe/sebum_film.rs"));
}

#[test]
fn the_documents_line_is_one_like_those_of_the_list() {
    let line = |law: &Law| {
        let word = |w: &str| w[..1].to_uppercase() + &w[1..];
        format!("    {}::{},\n", law.name, law.name.split('_').map(word).collect::<String>())
    };
    for law in LAWS {
        assert!(LIST.contains(&line(law)), "{}", law.name);
    }
    assert_eq!(block("text"), line(&SebumFilm::LAW));
    assert_eq!(SebumFilm::LAW.kind as usize, LAWS.len() + 1, "the next number");
}

#[test]
fn the_documents_vectors_are_those_of_its_formula() {
    crate::common::law_vectors::check::<SebumFilm>(&[&SebumFilm::LAW], block("csv"));
    crate::common::law_vectors::check::<(Standard, SebumFilm)>(&[&SebumFilm::LAW], block("csv"));
}

#[test]
fn the_example_runs_in_the_core_beside_the_others() {
    const COLD: Surroundings = Surroundings {
        hydration_au: 35.0,
        temperature_c: 29.0,
        finger_width_mm: 16.0,
        series_s: 300.0,
        dwell_s: None,
        occlusion_s: None,
        speed_mm_s: None,
        own: [0.0; 4],
    };
    fn slid<L: Library>(slots: &[EffectSlot]) -> f32 {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let effects = Effects::<L>::of(slots).unwrap();
        let mut contact = Contact::<SPRINGS>::default();
        let mut friction = 0.0;
        for i in 0..1000 {
            let slide = if i < 100 { 0.0 } else { 0.02 };
            let depth_mm = (0.01 * i as f32).min(1.0);
            let motion = Motion { depth_mm, slide_increment_mm: [slide, 0.0], spin_increment_rad: 0.0, dt_s: 0.01 };
            friction = effects.step(&model, &mut contact, COLD, motion).friction_n[0];
        }
        friction
    }
    let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
    let (film, cold) = (slot(21, 0.2, 600.0), slot(17, 0.03, 0.0));
    let plain = slid::<Standard>(&[]);
    for (found, wanted) in [
        (slid::<SebumFilm>(&[film]), 0.921_306_13),
        (slid::<(Standard, SebumFilm)>(&[film]), 0.921_306_13),
        (slid::<(Standard, SebumFilm)>(&[cold, film]), 0.921_306_13 * 0.91),
    ] {
        assert!((found / plain - wanted).abs() < 1e-5, "{} {wanted}", found / plain);
    }
    // The library of this crate does not know it, and a time of decay must be positive.
    assert!(Effects::new(&[film]).is_err());
    let error = Effects::<(Standard, SebumFilm)>::of(&[cold, slot(21, 0.2, 0.0)]).unwrap_err();
    assert_eq!(error, Error::Range { what: Field::EffectValue, index: 6 + 1, value: 0.0 });
}
