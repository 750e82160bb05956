//! The library of effects against `data/law-vectors.csv`, in itself, and under any slots and surroundings.

use crate::common::{example, motion};
use fingerpad::build::EffectSlot;
use fingerpad::effects::{Change, Conditions, LAWS, Law, Library, Standard, VALUES, baseline, find, tables};
use fingerpad::{Contact, Effects, Error, Field, Motion, Response, SPRINGS, Status, Surroundings};
use proptest::prelude::*;

/// Laws, parameters, inputs and outputs that every implementation of a law must give; a file of the repository.
const VECTORS: &str = include_str!("../data/law-vectors.csv");

#[test]
fn every_law_has_vectors_and_agrees_with_them_in_both_precisions() {
    let (_, lines) = VECTORS.split_once('\n').unwrap();
    crate::common::law_vectors::check::<Standard>(LAWS, lines);
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
    own: [0.0; 4],
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
    // An axis of -30 degrees is reported as 150.
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

fn slot(kind: u32, values: [f32; 3]) -> EffectSlot {
    let [a, b, c] = values;
    EffectSlot { kind, reserved: 0, values: [a, b, c, 0.0, 0.0, 0.0] }
}

/// A contact at 1 mm in full slip with some effects, 0.02 mm in 10 ms.
fn slides(slots: &[EffectSlot], surroundings: Surroundings) -> Response {
    let data = example();
    let model = data.model().unwrap();
    let (effects, mut contact, mut r) =
        (Effects::new(slots).unwrap(), Contact::<SPRINGS>::default(), Response::default());
    for i in 0..600 {
        let slide = if i < 5 { 0.0 } else { 0.02 };
        r = effects.step(&model, &mut contact, surroundings, Motion { dt_s: 0.01, ..motion(1.0, slide, 0.0) });
    }
    r
}

#[test]
fn values_beyond_all_laws_are_refused_by_name() {
    for value in [3e38, f32::INFINITY, f32::NAN, -2e6] {
        let error = Effects::new(&[slot(4, [0.01, 0.0, 0.0]), slot(10, [0.0, value, 0.0])]).unwrap_err();
        assert!(matches!(error, Error::Range { what: Field::EffectValue, index: 7, .. }), "{error:?}");
    }
}

#[test]
fn drag_raises_the_limit_and_keeps_the_reserve() {
    let plain = slides(&[], Surroundings::default());
    let dragged = slides(&[slot(4, [0.1, 0.0, 0.0])], Surroundings::default());
    let drag = dragged.friction_n[0] - plain.friction_n[0];
    assert!(drag > 0.2 * plain.friction_n[0], "{drag}");
    assert!((dragged.friction_limit_n - plain.friction_limit_n - drag).abs() < 1e-5 * drag);
    let reserve = |r: &Response| r.slip_margin * r.friction_limit_n;
    assert!((reserve(&dragged) - reserve(&plain)).abs() < 1e-6, "{dragged:?} {plain:?}");
    assert_eq!(dragged.status, Status::OK);
}

#[test]
fn a_speed_that_is_no_number_leaves_the_drag_out_and_says_so() {
    let unknown = Surroundings { speed_mm_s: Some(f32::NAN), ..Surroundings::default() };
    let r = slides(&[slot(4, [0.1, 0.0, 0.0])], unknown);
    assert_eq!(r.friction_n, slides(&[], unknown).friction_n);
    assert_eq!(r.status, Status::EFFECT_HELD);
}

#[test]
fn adhesion_beyond_the_normal_force_is_held_at_nothing() {
    let r = slides(&[slot(10, [1.0, 0.0, 0.0])], Surroundings::default());
    assert_eq!((r.normal_force_n, r.status), (0.0, Status::EFFECT_HELD));
}

#[test]
fn a_strength_beyond_the_range_is_held_there_and_flagged() {
    let cold = Surroundings { temperature_c: 0.0, ..Surroundings::default() };
    assert_eq!(slides(&[slot(17, [-0.3, 0.0, 0.0])], cold).status, Status::EFFECT_HELD);
    assert_eq!(slides(&[slot(17, [0.01, 0.0, 0.0])], cold).status, Status::OK);
}

proptest! {
    /// Any tables that are not refused, under any drivers: finite numbers, and what leads beyond a table is flagged.
    #[test]
    fn any_tables_are_answered(
        target in 0u32..7,
        driver in 0u32..18,
        nodes in 1u32..12,
        low in -5.0f32..5.0,
        per_unit in 0.01f32..100.0,
        values in prop::collection::vec(-1.0f32..4.5, 3..24),
        own in prop::array::uniform4(any::<u32>()),
        motions in prop::collection::vec((-0.5f32..2.5, -0.2f32..0.2, any::<u32>()), 1..40),
    ) {
        let mut section = vec![driver as f32, nodes as f32, low, per_unit, 0.0, 1.0, 0.0, 1.0];
        section.extend(&values);
        let slot = EffectSlot { kind: tables::TABLE, reserved: 0, values: [target as f32, 0.0, 0.0, 0.0, 0.0, 0.0] };
        let slots = [slot];
        let Ok(effects) = Effects::<Standard>::with_tables(&slots, &section) else { return Ok(()) };
        prop_assert!(target < 6 && driver < 17 && (2..12).contains(&nodes) && nodes as usize <= values.len());
        let own = own.map(f32::from_bits);
        let around = Surroundings { own, ..Surroundings::default() };
        let data = example();
        let (model, mut contact) = (data.model().unwrap(), Contact::<SPRINGS>::default());
        for (depth, x, time) in motions {
            let motion = Motion { dt_s: f32::from_bits(time), ..motion(depth, x, 0.0) };
            let r = effects.step(&model, &mut contact, around, motion);
            let [x, y] = r.friction_n;
            prop_assert!(r.normal_force_n.is_finite() && x.is_finite() && y.is_finite(), "{r:?}");
            prop_assert!(effects.reading_under(&r, &contact, &around).iter().all(|f| f.is_finite()));
            // A driver well below its axis, and one that is not a number.
            let v = own.get((driver as usize).wrapping_sub(13)).copied().unwrap_or(low);
            if target < 3 && depth > 0.0 && !(v >= low - 1.0) {
                prop_assert!(r.status.contains(Status::EFFECT_HELD), "{v} {r:?}");
            }
        }
    }
}

proptest! {
    /// Any slots that are not refused, in any surroundings: numbers within what they promise.
    #[test]
    fn any_effects_are_answered(
        slots in prop::collection::vec((1u32..18, any::<[u32; 6]>(), any::<bool>()), 0..5),
        baseline in any::<[u32; 6]>(),
        around in any::<[u32; 7]>(),
        motions in prop::collection::vec((-0.2f32..2.6, -0.5f32..0.5, -0.5f32..0.5, any::<u32>()), 1..30),
    ) {
        let tame = |bits: [u32; 6], tame: bool| bits.map(|b| if tame { (b >> 8) as f32 / 1e7 } else { f32::from_bits(b) });
        let slots: Vec<_> =
            slots.into_iter().map(|(kind, bits, is_tame)| EffectSlot { kind, reserved: 0, values: tame(bits, is_tame) })
                .chain([EffectSlot { kind: 33, reserved: 0, values: tame(baseline, false) }])
                .filter(|s| Effects::new(&[*s]).is_ok()).collect();
        let effects = Effects::new(&slots).unwrap();
        let f = around.map(f32::from_bits);
        let around = Surroundings {
            hydration_au: f[0], temperature_c: f[1], finger_width_mm: f[2], series_s: f[3],
            dwell_s: Some(f[4]), occlusion_s: Some(f[5]), speed_mm_s: Some(f[6]), own: [f[0], f[3], f[5], f[6]],
        };
        let data = example();
        let (model, mut contact) = (data.model().unwrap(), Contact::<SPRINGS>::default());
        for (depth, x, y, time) in motions {
            let motion = Motion { dt_s: f32::from_bits(time), ..motion(depth, x, y) };
            let r = effects.step(&model, &mut contact, around, motion);
            let [x, y] = r.friction_n;
            prop_assert!(r.normal_force_n >= 0.0 && r.normal_force_n.is_finite(), "{r:?}");
            prop_assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-6) && r.friction_limit_n.is_finite(), "{r:?}");
            prop_assert!((0.0..=1.0).contains(&r.slip_margin) && (0.0..=1.0).contains(&r.stick_ratio), "{r:?}");
            prop_assert!(!r.status.contains(Status::MEMORY_LOST), "{r:?}");
        }
    }
}

/// A contact with spin takes the laws as one without does: a warmer skin holds a larger slide and a larger turn, by the law's
/// factor. In full slip the friction has no moment about the friction centre.
#[test]
fn effects_act_on_a_contact_that_spins() {
    let data = example();
    let model = data.model().unwrap();
    let slots = [EffectSlot { kind: 17, reserved: 0, values: [0.03, 0.0, 0.0, 0.0, 0.0, 0.0] }];
    let effects = Effects::new(&slots).unwrap();
    let after = |temperature_c: f32, slide: [f32; 2], spin: f32| {
        let mut contact = Contact::<SPRINGS, 2>::default();
        let around = Surroundings { temperature_c, ..Surroundings::default() };
        let mut r = Response::default();
        for i in 0..600 {
            let moves = if i < 5 { 0.0 } else { 1.0 };
            let way = Motion { spin_increment_rad: moves * spin, ..motion(1.0, moves * slide[0], moves * slide[1]) };
            r = effects.step(&model, &mut contact, around, way);
        }
        r
    };
    for slide in [[0.02, 0.0], [0.0, 0.02]] {
        let [rest, warm] = [32.0, 42.0].map(|t| after(t, slide, 0.0));
        let [x, y] = model.friction_centre_mm(1.0);
        let size = |r: &Response| r.friction_n[0].hypot(r.friction_n[1]);
        assert!((size(&warm) / size(&rest) - 1.3).abs() < 1e-3, "{warm:?} {rest:?}");
        let about = warm.spin_moment_n_mm - x * warm.friction_n[1] + y * warm.friction_n[0];
        assert!(about.abs() < 1e-3 * size(&warm), "{about}");
    }
    let [rest, warm] = [32.0, 42.0].map(|t| after(t, [0.0; 2], 0.005).spin_moment_n_mm);
    assert!((warm / rest - 1.3).abs() < 1e-3, "{warm} {rest}");
}
