//! Steps with effects against plain ones and the numbers of `data/law-vectors.csv`.

use fingerpad::build::{EffectSlot, Params};
use fingerpad::effects::baseline::SHEAR;
use fingerpad::{
    BedMemory, Contact, Effects, Memory, Motion, Relaxation, Response, SPRINGS, State, Surroundings, Tuning, step,
};

fn run(slots: &[EffectSlot], surroundings: Surroundings) -> [Response; 2] {
    let data = Params::example().try_build().unwrap();
    let model = data.model().unwrap();
    let effects = Effects::new(slots).unwrap();
    let mut contact = Contact::<SPRINGS>::default();
    let mut go = |depth_mm, x| {
        let motion = Motion { depth_mm, slide_increment_mm: [x, 0.0], spin_increment_rad: 0.0, dt_s: 0.01 };
        effects.step(&model, &mut contact, surroundings, motion)
    };
    for i in 1..=50 {
        go(0.02 * i as f32, 0.0);
    }
    let held = go(1.0, 0.0);
    let mut last = held;
    for _ in 0..1000 {
        last = go(1.0, 0.02);
    }
    [held, last]
}

#[test]
fn without_slots_it_is_the_plain_step() {
    let data = Params::example().try_build().unwrap();
    let model = data.model().unwrap();
    let (mut contact, mut state) = (Contact::<SPRINGS>::default(), State::default());
    for i in 0..500 {
        let motion = Motion {
            depth_mm: 0.003 * i as f32,
            slide_increment_mm: [0.01, -0.004],
            spin_increment_rad: 0.0,
            dt_s: 0.01,
        };
        let effects = Effects::new(&[]).unwrap();
        let a = effects.step(&model, &mut contact, Surroundings::default(), motion);
        assert_eq!(a, step(&model, &mut state, motion));
    }
}

#[test]
fn strength_laws_scale_the_friction_of_full_slip() {
    let plain = run(&[], Surroundings::default())[1].friction_n[0];
    let slot = |kind, a, b, c| EffectSlot { kind, reserved: 0, values: [a, b, c, 0.0, 0.0, 0.0] };
    // Numbers of data/law-vectors.csv.
    let moist = Surroundings { hydration_au: 60.0, ..Surroundings::default() };
    let cold = Surroundings { temperature_c: 29.0, ..Surroundings::default() };
    for (slot, surroundings, factor) in [
        (slot(1, 0.3, 55.0, 15.0), moist, 1.160_454_2),
        (slot(2, 0.05, 0.0, 0.0), Surroundings::default(), 1.0),
        (slot(17, 0.03, 0.0, 0.0), cold, 0.91),
        (slot(5, 0.075, 0.129_903_81, 0.0), Surroundings::default(), 1.075),
    ] {
        let found = run(&[slot], surroundings)[1].friction_n[0] / plain;
        assert!((found - factor).abs() < 2e-3 * factor, "{} {found} {factor}", slot.kind);
    }
}

#[test]
fn relaxation_softens_and_adhesion_pulls() {
    let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
    let [plain, _] = run(&[], Surroundings::default());
    let [held, late] = run(&[slot(6, 0.2, 1.4)], Surroundings::default());
    assert!(held.normal_force_n < plain.normal_force_n && late.normal_force_n < 0.85 * plain.normal_force_n);
    let [sticky, _] = run(&[slot(10, 0.015, 0.0)], Surroundings::default());
    let pull = plain.normal_force_n - sticky.normal_force_n;
    assert!((pull - 0.015 * (plain.contact_area_mm2 / 63.5).sqrt()).abs() < 1e-5, "{pull}");
}

#[test]
fn laws_of_finger_series_and_motion() {
    let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
    let [plain, slid] = run(&[], Surroundings::default());
    // Numbers of data/law-vectors.csv.
    let wide = Surroundings { finger_width_mm: 18.0, ..Surroundings::default() };
    let late = Surroundings { series_s: 1800.0, ..Surroundings::default() };
    for (slot, surroundings, factor) in [(slot(15, -1.5, 0.0), wide, 0.838_052_5), (slot(14, -0.2, 0.0), late, 0.9)] {
        let found = run(&[slot], surroundings)[0].normal_force_n / plain.normal_force_n;
        assert!((found - factor).abs() < 2e-3 * factor, "{} {found} {factor}", slot.kind);
    }
    // 0.02 mm in 0.01 s, far beyond the 0.2 mm over which drag builds up.
    let found = run(&[slot(4, 0.01, 0.0)], Surroundings::default())[1].friction_n[0] - slid.friction_n[0];
    let wanted = 0.01 * 2.0 * slid.contact_area_mm2 / 63.5;
    assert!((found - wanted).abs() < 1e-4 * wanted, "{found} {wanted}");
}

#[test]
fn the_sensors_laws_are_in_its_readings_alone() {
    let tare = EffectSlot { kind: 12, reserved: 0, values: [0.01, -0.02, 0.03, 0.0, 0.0, 0.0] };
    let cross = EffectSlot { kind: 13, reserved: 0, values: [0.02, -0.01, 0.0, 0.0, 0.0, 0.0] };
    let [_, plain] = run(&[], Surroundings::default());
    let [_, found] = run(&[tare, cross], Surroundings::default());
    assert_eq!(found, plain);
    let slots = [tare, cross];
    let [n, x, y] = Effects::new(&slots).unwrap().reading(&found);
    let normal = plain.normal_force_n;
    assert!((n - normal - 0.01).abs() < 1e-6);
    assert!((x - plain.friction_n[0] - 0.02 * normal + 0.02).abs() < 1e-6);
    assert!((y - plain.friction_n[1] + 0.01 * normal - 0.03).abs() < 1e-6);
    assert_eq!(Effects::new(&slots).unwrap().reading(&Response::default()), [0.01, -0.02, 0.03]);
}

#[test]
fn the_callers_strength_and_tuning_stay() {
    let data = Params::example().try_build().unwrap();
    let model = data.model().unwrap();
    let tuning = Tuning { size: 1.1, stiffness: 1.5, lambda: 1.2 };
    let tuned = model.tuned(tuning).unwrap();
    let softened = model.tuned(Tuning { stiffness: 1.5 * 0.8, ..tuning }).unwrap();
    let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
    // Relaxed to 0.8 within a millisecond, and 0.91 of the strength for the cold.
    let slots = [slot(6, 0.2, 1e-5), slot(17, 0.03, 0.0)];
    let effects = Effects::new(&slots).unwrap();
    let cold = Surroundings { temperature_c: 29.0, ..Surroundings::default() };
    let (mut contact, mut state) = (Contact::<SPRINGS>::default(), State::default());
    contact.state.set_strength_factor(1.3);
    state.set_strength_factor(1.3 * 0.91);
    for i in 0..800 {
        let depth_mm = (0.01 * i as f32).min(1.0);
        let slide = if i < 200 { 0.0 } else { 0.02 };
        let motion = Motion { depth_mm, slide_increment_mm: [slide, 0.0], spin_increment_rad: 0.0, dt_s: 0.01 };
        let a = effects.step(&tuned, &mut contact, cold, motion);
        let b = step(&softened, &mut state, motion);
        assert_eq!(contact.state.strength_factor(), 1.3);
        for (a, b) in [(a.normal_force_n, b.normal_force_n), (a.friction_n[0], b.friction_n[0])] {
            assert!((a - b).abs() <= 1e-5 * b.abs() + 1e-7, "step {i}: {a} {b}");
        }
    }
}

#[test]
fn laws_without_a_place_here_and_bad_scales_are_refused() {
    for (kind, b) in [(21, 1.0), (99, 1.0), (6, 0.0), (3, -1.0), (3, f32::NAN)] {
        let slot = EffectSlot { kind, reserved: 0, values: [0.1, b, 1.0, 0.0, 0.0, 0.0] };
        assert!(Effects::new(&[slot]).is_err(), "{kind} {b}");
    }
}

/// The normal force with friction rises by the same share in full slip, whether the tissue has relaxed or is pressed quickly.
#[test]
fn shear_reads_the_limit_under_the_present_pressure() {
    fn slips<R: Memory<SPRINGS, 1, f32>>(slots: &[EffectSlot]) -> Response {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
        let (effects, mut contact) = (Effects::new(slots).unwrap(), Contact::<SPRINGS, 1, R>::default());
        let mut last = Response::default();
        for k in 0..600 {
            // Along y, where springs have no odd term.
            let slide_increment_mm = [0.0, if k < 100 { 0.0 } else { 0.02 }];
            let depth_mm = 0.01 * (k + 1).min(100) as f32;
            let motion = Motion { depth_mm, slide_increment_mm, spin_increment_rad: 0.0, dt_s: 1e-6 };
            last = effects.step(&model, &mut contact, Surroundings::default(), motion);
        }
        last
    }
    let slot = EffectSlot { kind: SHEAR, reserved: 0, values: [0.0, 0.0, 0.0, 0.2, 0.2, 0.0] };
    let rise = |[with, without]: [Response; 2]| with.normal_force_n / without.normal_force_n;
    let quick = [&[slot][..], &[]].map(slips::<BedMemory<SPRINGS>>);
    let relaxed = [&[slot][..], &[]].map(slips::<()>);
    assert!(quick[1].friction_n[1] > 1.2 * relaxed[1].friction_n[1]);
    assert!((rise(quick) - rise(relaxed)).abs() < 2e-3, "{} {}", rise(quick), rise(relaxed));
}
