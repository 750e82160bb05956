//! Tissue that relaxes: the shipped pad with branches, against closed forms.

use crate::common::{Double, Noise, shipped_pad};
use fingerpad::pad::{
    Body, Cylinder, Edge, Memory, Orthotropy, PadFile, PadOn, PadState, Plane, RelaxingPadState, Sphere,
    relaxing_pad_state_bytes,
};
use fingerpad::{
    Branch, Drivable, Drive, Elementary, Error, Field, Motion, Normal, Regime, Relaxation, Response, Status, Tangential,
};

const P: usize = 40;
const POSE_DEG: [f32; 2] = [30.0, 0.0];

fn press(depth_mm: f32, dt_s: f32) -> Motion {
    Motion { depth_mm, dt_s, ..Motion::default() }
}

/// Sum of shares times what `of` makes of a time.
fn sum(of: impl Fn(f64) -> f64) -> f64 {
    Relaxation::HUMAN_ASSUMED.branches().iter().map(|b| f64::from(b.share) * of(f64::from(b.time_s))).sum()
}

/// A finger in the air on a surface so rough that all of it sticks: slip in a press depends on its speed.
fn rough<M: Memory<P, T>, T: Elementary>(mut state: PadState<P, T, M>) -> PadState<P, T, M> {
    state.set_strength_factor(T::half_turn() + T::half_turn());
    state
}

/// Slides, presses, turns and tilts.
fn disturbed(steps: usize, seed: u64) -> Vec<(Motion, [f32; 2])> {
    let mut random = Noise(seed);
    (0..steps)
        .map(|k| {
            let t = 0.02 * k as f32;
            let motion = Motion {
                depth_mm: 0.9 + 1.1 * (1.3 * t).sin(),
                slide_increment_mm: [0.03 * (0.7 * t).sin() + 0.004 * random.next(), 0.02 * (1.1 * t).cos()],
                spin_increment_rad: 0.01 * (0.9 * t).sin(),
                dt_s: 1e-3,
            };
            (motion, [35.0 + 15.0 * (0.4 * t).sin(), 10.0 * (0.6 * t).sin()])
        })
        .collect()
}

#[test]
fn without_branches_and_long_after_their_times_the_bits_are_those_of_relaxed_tissue() {
    let file = shipped_pad();
    let pad = file.file().pad;
    for body in [Body::Plane, Body::Sphere(Sphere::new(12.0).unwrap())] {
        for (relaxation, dt_s) in [(Relaxation::none(), 1e-3), (Relaxation::HUMAN_ASSUMED, 1000.0)] {
            let timed = pad.with_relaxation(relaxation);
            let (mut plain, mut relaxing) =
                (PadState::<P>::new(&pad).unwrap(), RelaxingPadState::<P>::relaxing(&pad).unwrap());
            let mut touched = 0;
            for (k, (motion, pose_deg)) in disturbed(1500, 3).into_iter().enumerate() {
                let a = pad.step(&mut plain, &body, motion, pose_deg);
                let b = timed.step(&mut relaxing, &body, Motion { dt_s, ..motion }, pose_deg);
                assert_eq!(a, b, "{body:?} {dt_s} step {k}");
                touched += usize::from(a.regime != Regime::NoContact);
            }
            assert!(touched > 800, "{touched}");
        }
    }
}

/// Pressed at once and held, the force falls as 1 plus the sum of the shares times exp(-t / time); the area stays, and the limit follows the
/// pressure.
#[test]
fn a_held_press_relaxes_as_its_branches_do() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let [_, beta] = pad.numbers.law.friction;
    for (depth, body) in [(0.6, Body::Plane), (1.5, Body::Plane), (1.5, Body::Sphere(Sphere::new(12.0).unwrap()))] {
        let mut slow = rough(PadState::<P>::new(&pad).unwrap());
        let relaxed = pad.step(&mut slow, &body, press(depth, 1.0), POSE_DEG);
        let mut state = rough(RelaxingPadState::<P>::relaxing(&pad).unwrap());
        let mut response = pad.step(&mut state, &body, press(depth, 1e-7), POSE_DEG);
        let (mut t, mut dt) = (0.0, 2e-4);
        while t < 20.0 {
            let over = sum(|time| (-t / time).exp()) + 1.0;
            let found = f64::from(response.normal_force_n / relaxed.normal_force_n);
            // On a ball the anchors go round with the surface.
            let most = if body == Body::Plane { 3e-3 } else { 1e-2 };
            assert!((found / over - 1.0).abs() < most, "{body:?} {depth} mm, {t} s: {found}, exact {over}");
            let limit = f64::from(response.friction_limit_n / relaxed.friction_limit_n);
            assert!((limit / over.powf(f64::from(beta)) - 1.0).abs() < most, "{depth} mm, {t} s: {limit}");
            let area = f64::from(response.contact_area_mm2 / relaxed.contact_area_mm2);
            assert!((area - 1.0).abs() < most, "{depth} mm, {t} s: area {area}");
            // The friction of now over the limit that is left.
            let used = f64::from((1.0 - response.slip_margin) * response.friction_limit_n / relaxed.friction_limit_n);
            let told = f64::from(1.0 - response.slip_margin_relaxed);
            assert!((told / used - 1.0).abs() < most, "{t} s: {told}, exact {used}");
            response = pad.step(&mut state, &body, press(depth, dt), POSE_DEG);
            t += f64::from(dt);
            dt = (dt * 1.05).min(0.1);
        }
        // Long after, nothing changes any more, and the steps cost nothing.
        for _ in 0..400 {
            response = pad.step(&mut state, &body, press(depth, 0.1), POSE_DEG);
        }
        let rests = state;
        for dt_s in [1e-4, 1e-3, 10.0] {
            assert_eq!(pad.step(&mut state, &body, press(depth, dt_s), POSE_DEG), response);
        }
        assert_eq!(state, rests);
        let most = if body == Body::Plane { 1e-3 } else { 1e-2 };
        assert!((response.normal_force_n / relaxed.normal_force_n - 1.0).abs() < most, "{response:?} {relaxed:?}");
    }
}

/// A branch is not held up by rounding: with steps of a hundred-thousandth of its time it forgets all the same.
#[test]
fn small_steps_do_not_stop_a_slow_branch() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::new(&[Branch { share: 1.0, time_s: 0.2 }]).unwrap());
    let mut slow = rough(PadState::<P>::new(&pad).unwrap());
    let relaxed = pad.step(&mut slow, &Plane, press(1.0, 1.0), POSE_DEG).normal_force_n;
    let mut state = rough(RelaxingPadState::<P>::relaxing(&pad).unwrap());
    let mut force = 0.0;
    // 2 s, ten times the time.
    for _ in 0..200_000 {
        force = pad.step(&mut state, &Plane, press(1.0, 1e-5), POSE_DEG).normal_force_n;
    }
    assert!((force / relaxed - 1.0).abs() < 5e-4, "{force} {relaxed}");
}

/// A ramp of depth: the hereditary integral over the quasi-static curve, for speeds over four decades.
#[test]
fn a_ramp_is_the_integral_over_its_past() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    const STEPS: usize = 2000;
    for mm_per_s in [0.1f32, 1.0, 10.0, 100.0, 1000.0] {
        let depth = |k: usize| 1.2 * k as f32 / STEPS as f32;
        let dt = 1.2 / STEPS as f32 / mm_per_s;
        let (mut slow, mut state) =
            (rough(PadState::<P>::new(&pad).unwrap()), rough(RelaxingPadState::<P>::relaxing(&pad).unwrap()));
        let mut before = 0.0;
        let mut late = [0.0; 3];
        for k in 1..=STEPS {
            let relaxed = f64::from(pad.step(&mut slow, &Plane, press(depth(k), dt), POSE_DEG).normal_force_n);
            let found = f64::from(pad.step(&mut state, &Plane, press(depth(k), dt), POSE_DEG).normal_force_n);
            let mut exact = relaxed;
            for (late, branch) in late.iter_mut().zip(Relaxation::HUMAN_ASSUMED.branches()) {
                // Part of the force of a branch that is left, for a force that rises evenly within the step.
                let x = f64::from(dt) / f64::from(branch.time_s);
                *late = *late * (-x).exp() + (relaxed - before) * (1.0 - (-x).exp()) / x;
                exact += f64::from(branch.share) * *late;
            }
            before = relaxed;
            // Near first touch the normal force is not that of the patches.
            if k > STEPS / 2 {
                assert!((found / exact - 1.0).abs() < 5e-3, "{mm_per_s} mm/s, {} mm: {found}, exact {exact}", depth(k));
            }
        }
        let rise = before;
        let faster =
            late.iter().zip(Relaxation::HUMAN_ASSUMED.branches()).map(|(l, b)| l * f64::from(b.share)).sum::<f64>();
        assert!(faster > if mm_per_s < 0.5 { 0.02 * rise } else { 0.2 * rise });
    }
}

/// A small vibration of the depth: storage and loss of the force over 0.1 to 100 Hz.
#[test]
fn a_vibration_stores_and_loses_as_its_branches_do() {
    let double = Double::new();
    let pad = double.pad().with_relaxation(Relaxation::HUMAN_ASSUMED.cast());
    for hz in [0.1, 1.0, 10.0, 100.0] {
        let omega = core::f64::consts::TAU * hz;
        // The steps are short beside the shortest time too.
        let steps = (1000.0 / hz).max(400.0) as usize;
        let dt = 1.0 / (hz * steps as f64);
        let mut state = rough(RelaxingPadState::<P, f64>::relaxing(&pad).unwrap());
        let mut go = |depth: f64, dt_s: f64| {
            let motion = Motion { depth_mm: depth, slide_increment_mm: [0.0; 2], spin_increment_rad: 0.0, dt_s };
            pad.step(&mut state, &Plane, motion, POSE_DEG.map(f64::from)).normal_force_n
        };
        // Held until it has relaxed, and stiffness of the relaxed tissue.
        let start = go(1.0, 1000.0);
        let stiffness = (go(1.002, 1e3) - go(0.998, 1e3)) / 0.004;
        go(1.0, 1e3);
        let (mut storage, mut loss) = (0.0, 0.0);
        let cycles = (7.0 * hz).ceil().max(2.0) as usize;
        for k in 0..cycles * steps {
            let phase = omega * dt * (k + 1) as f64;
            let force = go(1.0 + 0.002 * phase.sin(), dt) - start;
            if k >= (cycles - 1) * steps {
                storage += force * phase.sin() * 2.0 / steps as f64 / 0.002;
                loss += force * phase.cos() * 2.0 / steps as f64 / 0.002;
            }
        }
        let part = |f: fn(f64) -> f64| sum(|time| f(omega * time) / (1.0 + (omega * time).powi(2))) * stiffness;
        let (stored, lost) = (stiffness + part(|x| x * x), part(|x| x));
        assert!((storage / stored - 1.0).abs() < 0.01, "{hz} Hz: storage {storage}, exact {stored}");
        assert!((loss / lost - 1.0).abs() < 0.05, "{hz} Hz: loss {loss}, exact {lost}");
    }
}

/// A grip at a held depth: the load that the first moment holds slips seconds later, and the margin of the relaxed tissue says so at once.
#[test]
fn a_load_that_holds_now_slips_when_the_finger_has_relaxed() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let finger = PadOn { pad, body: &Plane, pose_deg: POSE_DEG };
    let slips_at = |share: f32| {
        let mut state = RelaxingPadState::<P>::relaxing(&pad).unwrap();
        let mut slow = PadState::<P>::new(&pad).unwrap();
        let limit = pad.step(&mut slow, &Plane, press(1.2, 1.0), POSE_DEG).friction_limit_n;
        for k in 1..=50 {
            pad.step(&mut state, &Plane, press(1.2 * k as f32 / 50.0, 1e-3), POSE_DEG);
        }
        let mut drive = Drive {
            normal: Normal::DepthMm(1.2),
            tangential: Tangential::FrictionN([share * limit, 0.0]),
            spin_increment_rad: 0.0,
            dt_s: 0.01,
        };
        let mut told = None;
        for k in 1..=500 {
            drive.dt_s = if k < 20 { 2e-3 } else { 0.01 };
            drive.tangential = Tangential::FrictionN([share * limit * (k as f32 / 20.0).min(1.0), 0.0]);
            let r = finger.step_driven(&mut state, drive).response;
            if k == 20 {
                told = Some((r.slip_margin, r.slip_margin_relaxed));
            }
            if k > 20 && r.friction_n[0] < 0.95 * share * limit {
                return (told.unwrap(), Some(k));
            }
        }
        (told.unwrap(), None)
    };
    let ((margin, relaxed), held) = slips_at(0.8);
    assert!(held.is_none() && margin > 0.25 && (relaxed - 0.2).abs() < 0.03, "{margin} {relaxed} {held:?}");
    let ((margin, relaxed), held) = slips_at(1.05);
    assert!(margin > 0.15 && relaxed == 0.0 && held.is_some_and(|k| k > 50), "{margin} {relaxed} {held:?}");
}

/// A body is pressed and loaded along the skin. At the first moment `slip_margin_relaxed` predicts the margin of later. Then the load is held for
/// 100 times the longest time of the tissue, and the margin at the end is compared with the prediction.
#[test]
fn the_margin_that_is_left_is_that_after_a_long_hold() {
    let file = shipped_pad();
    let ratio = Orthotropy::new(0.6, 30.0).unwrap();
    for orthotropy in [Orthotropy::isotropic(), ratio] {
        let pad = file.file().pad.with_orthotropy(orthotropy).with_relaxation(Relaxation::HUMAN_ASSUMED);
        for (body, depth, load) in [
            (Body::Plane, 0.5, [0.05, 0.05]),
            (Body::Plane, 1.5, [0.3, -0.1]),
            (Body::Sphere(Sphere::new(12.0).unwrap()), 1.5, [0.0, 0.15]),
            (Body::Cylinder(Cylinder::new(15.0, 20.0).unwrap()), 1.0, [-0.12, 0.05]),
        ] {
            let finger = PadOn { pad, body: &body, pose_deg: POSE_DEG };
            let mut state = RelaxingPadState::<P>::relaxing_over(&pad, POSE_DEG).unwrap();
            for k in 1..=40 {
                pad.step(&mut state, &body, press(depth * k as f32 / 40.0, 1e-3), POSE_DEG);
            }
            let mut drive = Drive {
                normal: Normal::DepthMm(depth),
                tangential: Tangential::FrictionN([0.0; 2]),
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            let mut told = Response::default();
            for k in 1..=10 {
                drive.tangential = Tangential::FrictionN(load.map(|part| part * k as f32 / 10.0));
                told = finger.step_driven(&mut state, drive).response;
            }
            assert!(told.slip_margin > told.slip_margin_relaxed + 0.1 && told.slip_margin_relaxed > 0.1, "{told:?}");
            let mut r = told;
            drive.dt_s = 2e-3;
            let mut t = 0.0;
            while t < 140.0 {
                r = finger.step_driven(&mut state, drive).response;
                t += drive.dt_s;
                drive.dt_s = (1.2 * drive.dt_s).min(20.0);
            }
            let off = (r.slip_margin - told.slip_margin_relaxed).abs();
            assert!(off < 0.02 * (1.0 - r.slip_margin), "{body:?} {depth} {load:?}: told {told:?}, found {r:?}");
            assert!((r.slip_margin - r.slip_margin_relaxed).abs() < 1e-4, "{r:?}");
        }
    }
    // Without branches the two are one, on every step of a disturbed path.
    let pad = file.file().pad;
    let mut state = PadState::<P>::new(&pad).unwrap();
    for (motion, pose_deg) in disturbed(500, 11) {
        let r = pad.step(&mut state, &Plane, motion, pose_deg);
        assert_eq!(r.slip_margin.to_bits(), r.slip_margin_relaxed.to_bits());
    }
    let relaxing = pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let mut state = RelaxingPadState::<P>::relaxing(&pad).unwrap();
    for (motion, pose_deg) in disturbed(1500, 12) {
        let r = relaxing.step(&mut state, &Plane, motion, pose_deg);
        assert!((0.0..=1.0).contains(&r.slip_margin_relaxed), "{r:?}");
    }
}

#[test]
fn a_touch_soon_after_a_press_meets_skin_that_lags() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let peak = |pause_s: f32| {
        let mut state = RelaxingPadState::<P>::relaxing(&pad).unwrap();
        let mut go = |from: f32, to: f32, dt: f32| {
            let mut r = Response::default();
            for k in 1..=100 {
                r = pad.step(&mut state, &Plane, press(from + (to - from) * k as f32 / 100.0, dt), POSE_DEG);
            }
            r.normal_force_n
        };
        let first = go(-0.1, 1.0, 1e-4);
        go(1.0, 1.0, 1e-2);
        assert_eq!(go(1.0, -0.1, 1e-4), 0.0);
        go(-0.1, -0.1, pause_s / 100.0);
        go(-0.1, 1.0, 1e-4) / first
    };
    let peaks = [0.01, 0.1, 1.0, 20.0].map(peak);
    assert!(peaks.is_sorted() && peaks[0] < 0.75 && (peaks[3] - 1.0).abs() < 2e-3, "{peaks:?}");
}

#[test]
fn time_steps_that_are_none_are_flagged_and_freeze_the_memory() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let mut state = RelaxingPadState::<P>::relaxing(&pad).unwrap();
    for k in 1..=20 {
        pad.step(&mut state, &Plane, press(0.05 * k as f32, 1e-3), POSE_DEG);
    }
    let held = pad.step(&mut state, &Plane, press(1.0, 1e-3), POSE_DEG);
    let mut moved = state;
    for dt_s in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e30] {
        let r = pad.step(&mut state, &Plane, press(1.0, dt_s), POSE_DEG);
        assert!(r.status.contains(Status::BAD_TIME_STEP), "{dt_s}");
        // Within the tolerance of the equilibrium.
        assert!((r.normal_force_n / held.normal_force_n - 1.0).abs() < 1e-4, "{dt_s}: {r:?} {held:?}");
    }
    let [a, b] = [&mut state, &mut moved].map(|s| pad.step(s, &Plane, press(1.0, 0.05), POSE_DEG).normal_force_n);
    assert!((a / b - 1.0).abs() < 1e-4 && a < 0.9 * held.normal_force_n, "{a} {b}");
}

#[test]
fn a_file_and_a_saved_state_keep_branches_and_memory() {
    let file = shipped_pad();
    let plain = file.file().pad;
    let pad = plain.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let mut words = vec![0u64; 4096];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
    let length = pad.write_file("{}", bytes).unwrap();
    assert_eq!(length, pad.file_length("{}"));
    let read = PadFile::from_bytes(&bytes[..length]).unwrap().pad;
    assert_eq!((read.relaxation(), read.patches, read.numbers), (pad.relaxation(), pad.patches, pad.numbers));
    assert_ne!(pad.checksum(), plain.checksum());
    let refused = PadFile::from_bytes(&bytes[..length]).unwrap().without_branches().map(|_| ());
    assert_eq!(refused, Err(Error::Section { id: *b"RELX" }));
    // A file of tissue that does not relax is that of before.
    let before = plain.write_file(file.file().meta, bytes).unwrap();
    assert_eq!(&bytes[..before], include_bytes!("../data/fingertip-pad.fpm"));

    let body = Edge::new(4.0, 20.0, 110.0).unwrap();
    let mut state = RelaxingPadState::<P>::relaxing_over(&pad, POSE_DEG).unwrap();
    for (motion, pose_deg) in disturbed(150, 5) {
        pad.step(&mut state, &body, motion, pose_deg);
    }
    let mut saved = vec![0; relaxing_pad_state_bytes(P)];
    assert_eq!(state.write_bytes(pad.checksum(), &mut saved), Ok(saved.len()));
    let mut again = RelaxingPadState::<P>::read_bytes(pad.checksum(), &saved).unwrap();
    assert_eq!(again, state);
    for (motion, pose_deg) in disturbed(20, 9) {
        let [a, b] = [&mut state, &mut again].map(|s| pad.step(s, &body, motion, pose_deg));
        assert_eq!(a, b);
    }
    assert!(PadState::<P>::read_bytes(pad.checksum(), &saved).is_err(), "a state without memory has another length");
}

#[test]
fn bad_branches_are_refused_by_name_and_value() {
    let refused = |share: f32, time_s: f32| match Relaxation::new(&[
        Branch { share: 0.5, time_s: 1.0 },
        Branch { share, time_s },
    ]) {
        Err(Error::Range { what, index: 1, value }) => (what, value.to_bits()),
        other => panic!("{other:?}"),
    };
    for share in [-0.1, f32::NAN, f32::INFINITY, 1e6] {
        assert_eq!(refused(share, 1.0), (Field::RelaxationShare, share.to_bits()));
    }
    for time_s in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(refused(0.5, time_s), (Field::RelaxationTime, time_s.to_bits()));
    }
    assert_eq!(Relaxation::new(&[Branch::default(); 4]), Err(Error::Shape { elements: 4, nodes: 3 }));
}
