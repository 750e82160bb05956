//! What must hold for every model and every path.

mod common;

use common::{any_model, closed_path, run, run_with};
use fingerpad::{Data, Model, Motion, Params, Regime, Response, STATE_BYTES, State, Status, step};
use proptest::prelude::*;

fn example() -> Data {
    Params::example().try_build().unwrap()
}

fn motion(depth: f32, x: f32, y: f32) -> Motion {
    Motion { depth_mm: depth, slide_increment_mm: [x, y], spin_increment_rad: 0.0, dt_s: 1e-3 }
}

/// Everything a response promises whatever the input.
fn assert_sane(model: &Model<'_>, r: &Response) {
    let [x, y] = r.friction_n;
    assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 2e-7), "{r:?}");
    assert!((0.0..=1.0).contains(&r.slip_margin), "{r:?}");
    assert!((0.0..=1.0).contains(&r.stick_ratio), "{r:?}");
    let deepest = step(model, &mut State::default(), motion(100.0, 0.0, 0.0));
    assert!(r.normal_force_n >= 0.0 && r.normal_force_n <= 1.5 * deepest.normal_force_n, "{r:?}");
    assert!(r.friction_limit_n <= 5.5 * deepest.friction_limit_n, "{r:?}");
    assert!(r.contact_area_mm2 >= 0.0 && r.contact_area_mm2 <= 2.0 * deepest.contact_area_mm2, "{r:?}");
    assert!(r.band_normal_n >= 0.0 && r.band_friction_n >= 0.0, "{r:?}");
    assert!(r.band_normal_n.is_finite() && r.band_friction_n.is_finite(), "{r:?}");
}

fn cases(default: u32) -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

proptest! {
    // 1e5 paths; `PROPTEST_CASES=1000000` for more.
    #![proptest_config(ProptestConfig { cases: cases(100_000), max_local_rejects: 10_000_000, ..ProptestConfig::default() })]

    /// The plane's work over a closed path from air to air, normal plus tangential, each step with the force at its
    /// end, at any constant strength factor. Bound of the rounding: 1e-6 of the work that went back and forth.
    #[test]
    fn no_closed_path_yields_work(data in any_model(), strength in 0.2f32..2.0, path in closed_path()) {
        let (mut work, mut turnover) = (0.0f64, 0.0f64);
        run_with(&data, strength, &path, |by, r| {
            let force = [r.normal_force_n, r.friction_n[0], r.friction_n[1]].map(f64::from);
            for i in 0..3 {
                work += force[i] * by[i];
                turnover += (force[i] * by[i]).abs();
            }
        });
        prop_assert!(work >= -1e-6 * turnover, "{work} of {turnover} mJ");
    }

}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(2000), ..ProptestConfig::default() })]

    #[test]
    fn responses_are_sane(data in any_model(), path in closed_path()) {
        let model = data.model().unwrap();
        run(&data, &path, |_, r| assert_sane(&model, r));
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
            assert_sane(&model, &r);
            prop_assert_eq!(State::from_bytes(&state.to_bytes()), Ok(state));
        }
    }

    /// Any bit pattern, alone or in the middle of a path.
    #[test]
    fn any_bits_are_answered(words in prop::collection::vec(any::<[u32; 4]>(), 1..20), depth in -0.1f32..2.6) {
        let data = example();
        let model = data.model().unwrap();
        let mut state = State::default();
        step(&model, &mut state, motion(depth, 0.3, -0.2));
        for w in words {
            let f = w.map(f32::from_bits);
            let input = Motion { depth_mm: f[0], slide_increment_mm: [f[1], f[2]], spin_increment_rad: 0.0, dt_s: f[3] };
            let r = step(&model, &mut state, input);
            assert_sane(&model, &r);
            let good = f[0].is_finite() && f[1].is_finite() && f[2].is_finite();
            prop_assert_eq!(r.status.contains(Status::BAD_INPUT), !good, "{:?} {:?}", input, r);
            let time = f[3] > 0.0 && f[3].is_normal();
            prop_assert_eq!(r.status.contains(Status::BAD_TIME_STEP), !time);
            assert_sane(&model, &step(&model, &mut state, motion(1.0, 0.01, 0.0)));
        }
    }

    #[test]
    fn saved_state_goes_on_bit_for_bit(path in closed_path(), at in 0.0f64..1.0) {
        let data = example();
        let model = data.model().unwrap();
        let stop = ((path.len() - 1) as f64 * at) as usize;
        let mut a = run(&data, &path[..=stop], |_, _| {});
        let bytes: [u8; STATE_BYTES] = a.to_bytes();
        let mut b = State::from_bytes(&bytes).unwrap();
        prop_assert_eq!(a, b);
        for p in &path[stop..] {
            let m = motion(p[0] as f32, 0.02, -0.01);
            prop_assert_eq!(step(&model, &mut a, m), step(&model, &mut b, m));
        }
        let mut broken = bytes;
        broken[stop % STATE_BYTES] ^= 0x10;
        prop_assert!(State::from_bytes(&broken).is_err());
    }

    /// One step against a hundred. Along y it is the same up to rounding; along x the odd compliance takes a step as if
    /// everything stuck; oblique slides turn while elements yield, which one step only approximates.
    #[test]
    fn step_size_does_not_matter_on_straight_slides(depth in 0.2f32..2.4, length in 0.05f32..6.0, direction in 0u32..24) {
        let mut plain = Params::example();
        plain.odd_compliance_mm_n2 = 0.0;
        for (data, along_x) in [(plain.try_build().unwrap(), 0.001), (example(), 0.02)] {
        let model = data.model().unwrap();
        let angle = direction as f32 * core::f32::consts::TAU / 24.0;
        let (s, c) = angle.sin_cos();
        let mut one = State::default();
        let mut many = State::default();
        step(&model, &mut one, motion(depth, 0.0, 0.0));
        step(&model, &mut many, motion(depth, 0.0, 0.0));
        let a = step(&model, &mut one, motion(depth, length * c, length * s));
        let mut b = a;
        for _ in 0..100 {
            b = step(&model, &mut many, motion(depth, length * c / 100.0, length * s / 100.0));
        }
        let error = (a.friction_n[0] - b.friction_n[0]).hypot(a.friction_n[1] - b.friction_n[1]);
        let allowed = match direction {
            6 | 18 => 0.001,
            0 | 12 => along_x,
            _ => 0.05,
        };
        prop_assert!(error <= allowed * a.friction_limit_n, "{} {a:?} {b:?}", error / a.friction_limit_n);
        }
    }

    /// Where the model is isotropic, a turned path gives a turned force.
    #[test]
    fn rotation(path in closed_path(), angle in 0.0f64..6.3) {
        let mut params = Params::example();
        params.odd_compliance_mm_n2 = 0.0;
        for node in &mut params.nodes {
            node.stiffness_ratio = 1.0;
            node.press_coupling = 0.0;
            node.tilt_x = 0.0;
            node.strength_ratio = 1.0;
            node.normal_shear_y_n = node.normal_shear_x_n;
        }
        let data = params.try_build().unwrap();
        let (s, c) = angle.sin_cos();
        let turned: Vec<_> = path.iter().map(|p| [p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]]).collect();
        let mut straight = vec![];
        run(&data, &path, |_, r| straight.push(*r));
        let mut i = 0;
        run(&data, &turned, |_, r| {
            let a = straight[i];
            let [x, y] = a.friction_n.map(f64::from);
            let error = (c * x - s * y - f64::from(r.friction_n[0])).hypot(s * x + c * y - f64::from(r.friction_n[1]));
            assert!(error <= 1e-3 * f64::from(a.friction_limit_n), "{a:?} {r:?}");
            assert!((a.normal_force_n - r.normal_force_n).abs() <= 1e-3 * a.normal_force_n);
            i += 1;
        });
    }
}

#[test]
fn a_held_load_does_not_drift() {
    let data = example();
    let model = data.model().unwrap();
    for (slide, regime) in [(0.02, Regime::Stick), (1.0, Regime::PartialSlip), (30.0, Regime::Slip)] {
        let mut state = State::default();
        for i in 1..=100 {
            step(&model, &mut state, motion(0.01 * i as f32, 0.0, 0.0));
        }
        let mut r = Response::default();
        for _ in 0..100 {
            r = step(&model, &mut state, motion(1.0, slide / 100.0, 0.6 * slide / 100.0));
        }
        assert_eq!(r.regime, regime);
        let first = step(&model, &mut state, motion(1.0, 0.0, 0.0));
        let before = state;
        for _ in 0..1_000_000 {
            r = step(&model, &mut state, motion(1.0, 0.0, 0.0));
        }
        assert_eq!(state, before);
        assert_eq!(r, first);
    }
}

/// The same at many depths and loads, for fewer steps.
#[test]
fn nothing_moves_at_any_depth() {
    let data = example();
    let model = data.model().unwrap();
    for i in 1..5000 {
        let depth = i as f32 * 0.000_511;
        let mut state = State::default();
        state.set_strength_factor(0.3 + 0.0007 * i as f32);
        step(&model, &mut state, motion(depth, 0.0, 0.0));
        step(&model, &mut state, motion(depth, 0.002 * i as f32, -0.001 * i as f32));
        step(&model, &mut state, motion(depth, 0.0, 0.0));
        let before = state;
        for _ in 0..50 {
            step(&model, &mut state, motion(depth, 0.0, 0.0));
        }
        assert_eq!(state, before, "{depth}");
    }
}

#[test]
fn deeper_is_never_less() {
    let data = example();
    let model = data.model().unwrap();
    let mut last = Response::default();
    for i in 0..=2_600_000 {
        let r = step(&model, &mut State::default(), motion(i as f32 * 1e-6, 0.0, 0.0));
        // The press coupling takes a few parts in 1e7 of the normal force back and forth.
        assert!(r.normal_force_n >= last.normal_force_n * (1.0 - 1e-6), "{i} {r:?} {last:?}");
        assert!(r.contact_area_mm2 >= last.contact_area_mm2 * (1.0 - 1e-6), "{i}");
        assert!(r.friction_limit_n >= last.friction_limit_n * (1.0 - 1e-6), "{i}");
        // Continuous at nodes and at touch: no jump over a micrometre's thousandth.
        assert!(r.normal_force_n - last.normal_force_n <= 6e-6, "{i} {r:?} {last:?}");
        last = r;
    }
    assert!(last.status.contains(Status::DEPTH_ABOVE_RANGE));
}

#[test]
fn lift_off_is_continuous_and_forgets() {
    let data = example();
    let model = data.model().unwrap();
    let mut state = State::default();
    step(&model, &mut state, motion(1.0, 2.0, 1.0));
    let mut r = Response::default();
    let mut depth = 1.0f32;
    while depth > 1e-7 {
        depth *= 0.9;
        r = step(&model, &mut state, motion(depth, 0.0, 0.0));
    }
    assert!(r.normal_force_n < 1e-6 && r.friction_n[0] < 1e-5, "{r:?}");
    r = step(&model, &mut state, motion(0.0, 0.0, 0.0));
    assert_eq!(r.regime, Regime::NoContact);
    assert_eq!(state, State::default());
}

#[test]
fn steady_slip_opposes_the_motion() {
    let mut params = Params::example();
    for node in &mut params.nodes {
        node.tilt_x = 0.0;
    }
    let deepest = params.nodes.last().unwrap();
    let largest = 0.24 / (deepest.friction_limit_n * deepest.tangential_stiffness_n_mm);
    for (odd, allowed) in [(0.0, 0.01), (largest, 0.02)] {
        params.odd_compliance_mm_n2 = odd;
        let data = params.try_build().unwrap();
        let model = data.model().unwrap();
        for degrees in (0..360).step_by(5) {
            let (s, c) = (degrees as f32).to_radians().sin_cos();
            for slide in [0.003, 0.03, 0.3] {
                let mut state = State::default();
                let mut r = Response::default();
                for _ in 0..(150.0 / slide) as u32 {
                    r = step(&model, &mut state, motion(1.0, slide * c, slide * s));
                }
                let across = (r.friction_n[1] * c - r.friction_n[0] * s) / r.friction_limit_n;
                assert!(across.abs() < allowed, "{odd} {degrees} {slide}: {across}");
            }
        }
    }
}

#[test]
fn tuning_scales() {
    use fingerpad::Tuning;
    let data = example();
    let model = data.model().unwrap();
    let same = model.tuned(Tuning::default()).unwrap();
    let big = model.tuned(Tuning { size: 1.5, stiffness: 2.0, ..Tuning::default() }).unwrap();
    let (mut a, mut b, mut c) = (State::default(), State::default(), State::default());
    for i in 1..400 {
        let (d, x) = (0.004 * i as f32, 0.01);
        let ra = step(&model, &mut a, motion(d, x, 0.5 * x));
        let rb = step(&same, &mut b, motion(d, x, 0.5 * x));
        assert_eq!(ra, rb);
        // With the exponent 1 a stiffer, bigger finger would be exactly similar; here the strengths differ.
        let rc = step(&big, &mut c, motion(1.5 * d, 1.5 * x, 0.75 * x));
        assert!((rc.contact_area_mm2 / (2.25 * ra.contact_area_mm2) - 1.0).abs() < 0.05);
    }
    let slippery = model.tuned(Tuning { lambda: 0.5, ..Tuning::default() }).unwrap();
    let full = step(&model, &mut State::default(), motion(1.0, 20.0, 0.0));
    let half = step(&slippery, &mut State::default(), motion(1.0, 20.0, 0.0));
    assert!((half.friction_n[0] / full.friction_n[0] - 0.5).abs() < 1e-5);
    let mut state = State::default();
    state.set_strength_factor(0.5);
    let factor = step(&model, &mut state, motion(1.0, 20.0, 0.0));
    assert!((factor.friction_n[0] / full.friction_n[0] - 0.5).abs() < 1e-5);
    assert!(model.tuned(Tuning { size: f32::NAN, ..Tuning::default() }).is_err());
}
