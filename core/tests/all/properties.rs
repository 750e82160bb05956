//! What must hold for every model and every path.

use crate::common::books::keep;
use crate::common::{DisturbedPath, Noise, any_model, closed_path, disturbed_path, example, models, motion, run};
use fingerpad::build::{Data, Params, ParamsOf};
use fingerpad::{
    Error, ForceResponse, ForceState, ForceStateOf, ModelOf, Motion, Regime, Response, SPRINGS, STATE_BYTES, SpinState,
    State, StateOf, Status, state_bytes, step,
};
use proptest::prelude::*;

/// Everything a response promises whatever the input. A strength factor and a tuning raise the limit up to `strength` times.
fn assert_sane(data: &Data, strength: f32, r: &Response) {
    let deepest = &data.rows[data.rows.len() - 1];
    let [x, y] = r.friction_n;
    assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 4e-7), "{r:?}");
    assert!((0.0..=1.0).contains(&r.slip_margin), "{r:?}");
    assert!((0.0..=1.0).contains(&r.stick_ratio), "{r:?}");
    assert!(r.friction_limit_n >= 0.0 && r.friction_limit_n <= 3.0 * strength * deepest.limit.value, "{r:?}");
    let others = [r.spin_moment_n_mm, r.pressure_centre_mm[0], r.normal_force_n];
    assert!(others.iter().all(|v| v.is_finite()) && r.normal_force_n >= 0.0, "{r:?}");
    assert!(
        [r.contact_area_mm2, r.band_normal_n, r.band_friction_n].iter().all(|v| *v >= 0.0 && v.is_finite()),
        "{r:?}"
    );
    assert!(!r.status.contains(Status::MEMORY_LOST), "{r:?}");
}

fn saved<const P: usize>(state: &StateOf<SPRINGS, P>) -> Vec<u8> {
    let mut bytes = vec![0; state_bytes(SPRINGS, P)];
    state.write_bytes(7, &mut bytes).unwrap();
    bytes
}

/// A step of forces alone and a step agree bit by bit.
fn same_forces(alone: &ForceResponse, r: &Response) {
    let bits = |r: &ForceResponse| {
        let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
        let numbers = [r.normal_force_n, x, y, r.friction_limit_n, r.slip_margin, r.spin_moment_n_mm];
        let more = [centre_x, centre_y, r.contact_area_mm2];
        (numbers.map(f32::to_bits), more.map(f32::to_bits), r.status)
    };
    assert_eq!(bits(alone), bits(&(*r).into()), "{alone:?} {r:?}");
}

/// Runs a disturbed path and looks at every answer; flags need a cause.
fn follow<const P: usize>(data: &Data, path: &DisturbedPath) {
    let plain = data.model().unwrap();
    let (mut state, mut forces) = (StateOf::<SPRINGS, P>::default(), ForceStateOf::<SPRINGS, P>::default());
    for at in &path.0 {
        state.set_strength_factor(at.factor);
        forces.set_strength_factor(at.factor);
        let model = plain.tuned(at.tuning).unwrap();
        let r = step(&model, &mut state, at.motion);
        same_forces(&model.step_forces(&mut forces, at.motion), &r);
        assert_sane(data, 5.0 * 10.0 * 4.0 * 5.0 * 8.0, &r);
        assert!(
            StateOf::<SPRINGS, P>::read_bytes(7, &saved(&state)).is_ok_and(|again| again == state),
            "{at:?} {state:?}"
        );
        let deep = at.motion.depth_mm > model.depth_max_mm() * (1.0 - 1e-6);
        let may = if deep { Status::DEPTH_ABOVE_RANGE } else { Status::OK };
        assert!(may.contains(r.status), "{at:?} {r:?}");
    }
}

proptest! {
    // 256 cases; `cargo xtask test` sets `PROPTEST_CASES=2000` and `cargo xtask test --slow` 20 000.
    #![proptest_config(ProptestConfig { max_local_rejects: 10_000_000, ..ProptestConfig::default() })]

    /// The plane's work and that of changing the strength cover the energy that the contact holds, at every moment of a path
    /// on which the depth is noisy and the strength changes. Bound of the rounding: 1e-6 of what went back and forth.
    #[test]
    fn no_path_yields_work(data in any_model(), path in disturbed_path(false, false)) {
        let books = keep::<1>(&data, &path.0);
        prop_assert!(books.from_nothing <= 1e-6 * books.turnover, "{books:?}");
    }

    /// The same with spin.
    #[test]
    fn no_path_with_spin_yields_work(data in any_model(), path in disturbed_path(true, false)) {
        let books = keep::<2>(&data, &path.0);
        prop_assert!(books.from_nothing <= 1e-6 * books.turnover, "{books:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { max_local_rejects: 10_000_000, ..ProptestConfig::default() })]

    /// The same while the finger is retuned, on the models in use.
    #[test]
    fn no_retuned_path_yields_work(path in disturbed_path(true, true)) {
        for (name, data) in models() {
            for books in [keep::<1>(&data, &path.0), keep::<2>(&data, &path.0)] {
                prop_assert!(books.from_nothing <= 1e-6 * books.turnover, "{name} {books:?}");
            }
        }
    }

    #[test]
    fn disturbed_paths_are_answered(drawn in any_model(), path in disturbed_path(true, true)) {
        let drawn = ("drawn", drawn.0);
        for (_, data) in models().into_iter().chain([drawn]) {
            let mut flat = path.clone();
            flat.0.iter_mut().for_each(|at| at.motion.spin_increment_rad = 0.0);
            follow::<1>(&data, &flat);
            follow::<2>(&data, &path);
        }
    }

    /// Jumps of depth over six decades in one step, with slides: sane answers, and a state that can be restored.
    #[test]
    fn jumps_of_depth_are_answered(
        data in any_model(),
        jumps in prop::collection::vec((-6.0f32..0.4, -3.0f32..3.0, -3.0f32..3.0), 2..30),
    ) {
        let model = data.model().unwrap();
        let mut state = State::default();
        for (decades, x, y) in jumps {
            let r = step(&model, &mut state, motion(10f32.powf(decades), x, y));
            assert_sane(&data, 1.0, &r);
            prop_assert_eq!(State::from_bytes(&data, &state.to_bytes(&data)), Ok(state));
        }
    }

    /// Any bit pattern, alone or in the middle of a path, with a strength of any bits.
    #[test]
    fn any_bits_are_answered(words in prop::collection::vec(any::<[u32; 6]>(), 1..20), depth in -0.1f32..2.6) {
        for (_, data) in models() {
            let model = data.model().unwrap();
            let (mut state, mut spun, mut forces) = (State::default(), SpinState::default(), ForceState::default());
            step(&model, &mut state, motion(depth, 0.3, -0.2));
            model.step_forces(&mut forces, motion(depth, 0.3, -0.2));
            step(&model, &mut spun, motion(depth, 0.3, -0.2));
            for w in &words {
                let f = w.map(f32::from_bits);
                state.set_strength_factor(f[5]);
                spun.set_strength_factor(f[5]);
                forces.set_strength_factor(f[5]);
                let input =
                    Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: f[3], dt_s: f[4] };
                let flat = Motion { spin_increment_rad: 0.0, ..input };
                let answers = [(step(&model, &mut state, flat), false), (step(&model, &mut spun, input), true)];
                same_forces(&model.step_forces(&mut forces, flat), &answers[0].0);
                for (r, spins) in answers {
                    assert_sane(&data, 5.0, &r);
                    let good = f[..3].iter().all(|f| f.is_finite()) && (!spins || f[3].is_finite());
                    prop_assert_eq!(r.status.contains(Status::BAD_INPUT), !good, "{:?} {:?}", input, r);
                    // In the air nothing depends on time, and a depth of no number keeps the contact as it is.
                    prop_assert_eq!(r.status.contains(Status::BAD_TIME_STEP), !(f[4] > 0.0 && f[4].is_finite()));
                }
                let r = step(&model, &mut state, motion(1.0, 0.01, 0.0));
                assert_sane(&data, 5.0, &r);
                same_forces(&model.step_forces(&mut forces, motion(1.0, 0.01, 0.0)), &r);
                assert_sane(&data, 5.0, &step(&model, &mut spun, motion(1.0, 0.01, 0.0)));
            }
        }
    }

    #[test]
    fn a_saved_state_goes_on_bit_for_bit(path in closed_path(), at in 0.0f64..1.0) {
        for (_, data) in models() {
            let model = data.model().unwrap();
            let stop = ((path.len() - 1) as f64 * at) as usize;
            let mut a = run(&data, &path[..=stop], |_, _| {});
            let bytes: [u8; STATE_BYTES] = a.to_bytes(&data);
            let mut b = State::from_bytes(&data, &bytes).unwrap();
            prop_assert_eq!(a, b);
            for p in &path[stop..] {
                let m = motion(p[0] as f32, 0.02, -0.01);
                prop_assert_eq!(step(&model, &mut a, m), step(&model, &mut b, m));
            }
            let mut broken = bytes;
            broken[stop % STATE_BYTES] ^= 0x10;
            prop_assert!(State::from_bytes(&data, &broken).is_err());
        }
    }

    /// A path mirrored in y gives the mirrored answer to the last bit; no finger is taken for left or right.
    #[test]
    fn mirrored_in_y(data in any_model(), path in closed_path()) {
        let mirrored: Vec<_> = path.iter().map(|p| [p[0], p[1], -p[2]]).collect();
        let mut straight = vec![];
        run(&data, &path, |_, r| straight.push(*r));
        let mut straight = straight.iter();
        run(&data, &mirrored, |_, r| {
            let mut turned = *r;
            turned.friction_n[1] = -turned.friction_n[1];
            turned.tangential_friction_n[1] = turned.friction_n[1];
            turned.tilt_moment_n_mm[0] = -turned.tilt_moment_n_mm[0];
            turned.spin_moment_n_mm = -turned.spin_moment_n_mm;
            turned.pressure_centre_mm[1] = -turned.pressure_centre_mm[1];
            assert_eq!(Some(&turned), straight.next());
        });
    }

    /// A contact that may spin and does not is the plain contact, up to rounding.
    #[test]
    fn without_spin_pairs_are_single_springs(data in any_model(), path in closed_path()) {
        let model = data.model().unwrap();
        let (mut single, mut pairs) = (State::default(), SpinState::default());
        for pair in path.windows(2) {
            let m = motion(pair[1][0] as f32, (pair[1][1] - pair[0][1]) as f32, (pair[1][2] - pair[0][2]) as f32);
            let (a, b) = (step(&model, &mut single, m), step(&model, &mut pairs, m));
            close(&a, &b, 2e-6)?;
            // A turn is noticed beyond 10 um, which rounding may put off by a step.
            prop_assert!((a.stick_ratio - b.stick_ratio).abs() < 0.02, "{a:?} {b:?}");
        }
    }

    /// The twin in double precision: to 1e-4 of the limit, and 3e-6 N by which springs may exceed it in single.
    #[test]
    fn the_double_twin_agrees(path in closed_path()) {
        let twin = twin_of(&Params::example()).try_build().unwrap();
        let (data, twin) = (example(), twin);
        let (model, precise) = (data.model().unwrap(), twin.model().unwrap());
        let (mut a, mut b) = (State::default(), StateOf::<SPRINGS, 1, f64>::default());
        for pair in path.windows(2) {
            let m = motion(pair[1][0] as f32, (pair[1][1] - pair[0][1]) as f32, (pair[1][2] - pair[0][2]) as f32);
            let wide = Motion {
                depth_mm: f64::from(m.depth_mm),
                slide_increment_mm: m.slide_increment_mm.map(f64::from),
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            let (r, s) = (step(&model, &mut a, m), step(&precise, &mut b, wide));
            let apart = (f64::from(r.friction_n[0]) - s.friction_n[0]).hypot(f64::from(r.friction_n[1]) - s.friction_n[1]);
            prop_assert!(apart <= 1e-4 * s.friction_limit_n + 3e-6, "{r:?} {s:?}");
            prop_assert!((f64::from(r.normal_force_n) - s.normal_force_n).abs() <= 1e-4 * s.normal_force_n + 3e-6, "{r:?} {s:?}");
        }
    }

    /// Increments that add up to nothing lead back, in position and force, whatever their order and number, while all sticks.
    #[test]
    fn increments_that_add_up_to_nothing_lead_back(
        depth in 0.3f32..2.0, seed in any::<u64>(), size in -9.0f32..-3.0, x in -0.1f32..0.1, y in -0.1f32..0.1,
    ) {
        // Springs that all touch at once, so that none is near its limit.
        let params: Params = ParamsOf::example_with([(0.25, 0.0); SPRINGS]);
        let data = params.try_build().unwrap();
        let model = data.model().unwrap();
        let mut state = State::default();
        step(&model, &mut state, motion(depth, 0.0, 0.0));
        let before = step(&model, &mut state, motion(depth, x, y));
        let (mut noise, size) = (Noise(seed), 10f32.powf(size));
        let there: Vec<[f32; 2]> = (0..2000).map(|_| [size * noise.next(), size * noise.next()]).collect();
        for [x, y] in &there {
            step(&model, &mut state, motion(depth, *x, *y));
        }
        // Back in the same order, not the reverse.
        let mut after = before;
        for [x, y] in &there {
            after = step(&model, &mut state, motion(depth, -x, -y));
        }
        for i in 0..2 {
            let apart = (after.friction_n[i] - before.friction_n[i]).abs();
            prop_assert!(apart <= 1.2e-7 * before.friction_n[i].abs() + 1e-9, "{apart} {size} {before:?} {after:?}");
        }
    }
}

/// Forces agree to a share of the limit.
fn close(a: &Response, b: &Response, share: f32) -> Result<(), TestCaseError> {
    let allowed = share * a.friction_limit_n + 1e-7;
    let [x, y] = [0, 1].map(|i| (a.friction_n[i] - b.friction_n[i]).abs());
    prop_assert!(x <= allowed && y <= allowed, "{a:?} {b:?}");
    prop_assert!((a.normal_force_n - b.normal_force_n).abs() <= share * a.normal_force_n + 1e-7, "{a:?} {b:?}");
    Ok(())
}

/// The same parameters in double precision.
fn twin_of(params: &Params) -> fingerpad::build::ParamsOf<SPRINGS, { fingerpad::NODES }, f64> {
    let wide = |x: f32| f64::from(x);
    fingerpad::build::ParamsOf {
        depth_max_mm: params.depth_max_mm.into(),
        stiffness_n_mm: params.stiffness_n_mm.map(wide),
        springs: params.springs.map(|s| fingerpad::build::SpringParams {
            stiffness_share: s.stiffness_share.into(),
            sharpness: s.sharpness.into(),
            centre_mm: s.centre_mm.into(),
            arm_mm: s.arm_mm.map(wide),
        }),
        nodes: params.nodes.map(|n| fingerpad::build::Node {
            normal_force_n: n.normal_force_n.into(),
            contact_area_mm2: n.contact_area_mm2.into(),
            stiffness_slope_n_mm2: n.stiffness_slope_n_mm2.map(wide),
            yield_slide_mm: n.yield_slide_mm.map(wide),
            strength_ratio: n.strength_ratio.into(),
            tilt_x: n.tilt_x.into(),
            press_coupling: n.press_coupling.into(),
            area_share: n.area_share.map(wide),
            pressure_centre_mm: n.pressure_centre_mm.into(),
            spin_limit_share: n.spin_limit_share.into(),
            band_normal_n: n.band_normal_n.into(),
        }),
        odd_per_mm: params.odd_per_mm.into(),
        area_tilt: params.area_tilt.into(),
        pressure_centre_per_n: params.pressure_centre_per_n.map(f64::from),
        spin_cross: params.spin_cross.into(),
        slip_lead: params.slip_lead.map(f64::from),
        band_normal_middle: params.band_normal_middle.into(),
        band_normal_slip: params.band_normal_slip.into(),
        band_friction_stick: params.band_friction_stick.into(),
        band_friction_middle: params.band_friction_middle.into(),
        band_friction_slip: params.band_friction_slip.into(),
        pressure_exponent: params.pressure_exponent.into(),
        pose_deg: params.pose_deg.map(f64::from),
    }
}

/// A contact brought to `depth` and slid.
fn slid<const P: usize>(
    model: &ModelOf<'_, SPRINGS, { fingerpad::NODES }>,
    depth: f32,
    slide: [f32; 2],
) -> (StateOf<SPRINGS, P>, Response) {
    let mut state = StateOf::default();
    for i in 1..=100 {
        step(model, &mut state, motion(depth * 0.01 * i as f32, 0.0, 0.0));
    }
    let mut r = Response::default();
    for _ in 0..100 {
        r = step(model, &mut state, motion(depth, 0.01 * slide[0], 0.01 * slide[1]));
    }
    (state, r)
}

/// What a user pays who only wants forces, and one who also wants the stick ratio; README has these numbers.
#[test]
fn a_state_has_the_bytes_that_are_stated() {
    assert_eq!(size_of::<ForceState>(), 64);
    assert_eq!([size_of::<State>(), size_of::<SpinState>()], [108, 140]);
}

#[test]
fn a_state_is_refused_by_another_model_and_another_version() {
    let data = example();
    let other = Params { depth_max_mm: 2.4, ..Params::example() }.try_build().unwrap();
    let (state, _) = slid::<1>(&data.model().unwrap(), 1.0, [0.3, 0.1]);
    let bytes = state.to_bytes(&data);
    assert_eq!(State::from_bytes(&data, &bytes), Ok(state));
    let expected = other.checksum();
    assert_eq!(State::from_bytes(&other, &bytes), Err(Error::OtherModel { found: data.checksum(), expected }));
    let mut old = bytes;
    old[0] = 1;
    let end = STATE_BYTES - 4;
    let checksum = crc32(&old[..end]);
    old[end..].copy_from_slice(&checksum.to_le_bytes());
    assert_eq!(State::from_bytes(&data, &old), Err(Error::Version { found: 1 }));
}

/// The checksum of zlib and Ethernet, a bit at a time.
fn crc32(bytes: &[u8]) -> u32 {
    let shift = |crc: u32| if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| shift(crc)))
}

#[test]
fn a_held_load_keeps_its_bits() {
    for (name, data) in models() {
        let model = data.model().unwrap();
        for (slide, regime) in [(0.005, Regime::Stick), (0.5, Regime::PartialSlip), (30.0, Regime::Slip)] {
            let (mut state, r) = slid::<1>(&model, 1.0, [slide, 0.6 * slide]);
            assert_eq!(r.regime, regime, "{name} {slide} {r:?}");
            let first = step(&model, &mut state, motion(1.0, 0.0, 0.0));
            let before = state;
            for _ in 0..1_000_000 {
                assert_eq!(step(&model, &mut state, motion(1.0, 0.0, 0.0)), first);
            }
            assert_eq!(state, before);
        }
    }
}

/// The same at many depths, loads and strengths, for fewer steps.
#[test]
fn nothing_moves_at_any_depth() {
    for (_, data) in models() {
        let model = data.model().unwrap();
        for i in 1..5000 {
            let depth = i as f32 * 0.000_511;
            let mut state = SpinState::default();
            state.set_strength_factor(0.3 + 0.0007 * i as f32);
            step(&model, &mut state, motion(depth, 0.0, 0.0));
            let turned =
                Motion { spin_increment_rad: 1e-4 * i as f32, ..motion(depth, 0.002 * i as f32, -0.001 * i as f32) };
            step(&model, &mut state, turned);
            step(&model, &mut state, motion(depth, 0.0, 0.0));
            let before = state;
            for _ in 0..50 {
                step(&model, &mut state, motion(depth, 0.0, 0.0));
            }
            assert_eq!(state, before, "{depth}");
        }
    }
}

#[test]
fn deeper_is_never_less() {
    for (name, data) in models() {
        let model = data.model().unwrap();
        let deepest = data.depth_max;
        let mut last = Response::default();
        for i in 0..=1_050_000 {
            let r = step(&model, &mut State::default(), motion(i as f32 * 1e-6 * deepest, 0.0, 0.0));
            assert!(r.normal_force_n >= last.normal_force_n * (1.0 - 1e-6), "{name} {i} {r:?} {last:?}");
            assert!(r.contact_area_mm2 >= last.contact_area_mm2 * (1.0 - 1e-6), "{name} {i}");
            assert!(r.friction_limit_n >= last.friction_limit_n * (1.0 - 1e-6), "{name} {i}");
            // Continuous at nodes and at touch: no jump over a millionth of the range.
            assert!(r.normal_force_n - last.normal_force_n <= 2e-5, "{name} {i} {r:?} {last:?}");
            last = r;
        }
        assert!(last.status.contains(Status::DEPTH_ABOVE_RANGE));
    }
}

#[test]
fn lift_off_is_continuous_and_forgets() {
    for (_, data) in models() {
        let model = data.model().unwrap();
        let (mut state, mut r) = slid::<1>(&model, 1.0, [2.0, 1.0]);
        let mut depth = 1.0f32;
        while depth > 1e-6 {
            depth *= 0.9;
            r = step(&model, &mut state, motion(depth, 0.0, 0.0));
        }
        assert!(r.normal_force_n < 1e-5 && r.friction_n[0] < 1e-4, "{r:?}");
        r = step(&model, &mut state, motion(0.0, 0.0, 0.0));
        assert_eq!(r, Response::IN_THE_AIR);
        assert_eq!(state, State::default());
    }
}

#[test]
fn tuning_scales() {
    use fingerpad::Tuning;
    let data = example();
    let model = data.model().unwrap();
    let same = model.tuned(Tuning::default()).unwrap();
    // Friction that grows as the stiffness: a bigger, stiffer finger is exactly similar.
    let tuning = Tuning { size: 1.5, stiffness: 2.0, lambda: 2f32.powf(1.0 - data.pressure_exponent) };
    let big = model.tuned(tuning).unwrap();
    let (mut a, mut b, mut c) = (State::default(), State::default(), State::default());
    for i in 1..400 {
        let (d, x) = (0.004 * i as f32, 0.01);
        let ra = step(&model, &mut a, motion(d, x, 0.5 * x));
        assert_eq!(ra, step(&same, &mut b, motion(d, x, 0.5 * x)));
        let rc = step(&big, &mut c, motion(1.5 * d, 1.5 * x, 0.75 * x));
        let pairs = [
            (rc.normal_force_n, 4.5 * ra.normal_force_n),
            (rc.friction_n[0], 4.5 * ra.friction_n[0]),
            (rc.friction_n[1], 4.5 * ra.friction_n[1]),
            (rc.contact_area_mm2, 2.25 * ra.contact_area_mm2),
        ];
        for (found, wanted) in pairs {
            assert!((found - wanted).abs() <= 1e-4 * wanted + 1e-6, "{i} {found} {wanted}");
        }
    }
    let slippery = model.tuned(Tuning { lambda: 0.5, ..Tuning::default() }).unwrap();
    let full = slid::<1>(&model, 1.0, [20.0, 0.0]).1;
    let half = slid::<1>(&slippery, 1.0, [20.0, 0.0]).1;
    assert!((half.friction_n[0] / full.friction_n[0] - 0.5).abs() < 1e-5);
    let (mut state, _) = slid::<1>(&model, 1.0, [20.0, 0.0]);
    state.set_strength_factor(0.5);
    let factor = step(&model, &mut state, motion(1.0, 0.0, 0.0));
    assert!((factor.friction_n[0] / full.friction_n[0] - 0.5).abs() < 1e-5);
    assert!(model.tuned(Tuning { size: f32::NAN, ..Tuning::default() }).is_err());
}
