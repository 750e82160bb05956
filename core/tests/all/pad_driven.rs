//! A pad driven by forces: loads are carried, kept and refused; derivatives and the least grip hold in steps.

use crate::common::{Noise, shipped, shipped_pad};
use fingerpad::pad::{Body, Cylinder, Edge, PadOn, PadState, Sphere};
use fingerpad::{Drivable, Drive, FingerModel, Motion, Normal, Response, SpinState, Status, Tangential, Tuning};

const P: usize = 40;

const DT_S: f32 = 1e-3;

fn bodies() -> [Body; 4] {
    [
        Body::Plane,
        Body::Sphere(Sphere::new(10.0).unwrap()),
        Body::Cylinder(Cylinder::new(12.0, 30.0).unwrap()),
        Body::Edge(Edge::new(4.0, 0.0, 110.0).unwrap()),
    ]
}

fn loaded(normal_n: f32, friction_n: [f32; 2]) -> Drive {
    Drive {
        normal: Normal::ForceN(normal_n),
        tangential: Tangential::FrictionN(friction_n),
        spin_increment_rad: 0.0,
        dt_s: DT_S,
    }
}

/// Loads that wander within what the finger holds are carried within 1e-3; a load that stays leaves no bit changed.
#[test]
fn loads_are_carried_without_creep() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let mut random = Noise(71);
    for body in &bodies() {
        for pose_deg in [[30.0, 0.0], [45.0, 12.0]] {
            let finger = PadOn { pad, body, pose_deg };
            let mut state = PadState::<P>::new(&pad).unwrap();
            let mut from = [0.5f32, 0.0, 0.0];
            for round in 0..12 {
                let normal = 0.5 + 0.3 * random.next();
                let to = [normal, 0.3 * normal * random.next(), 0.3 * normal * random.next()];
                let mut drive = loaded(0.0, [0.0; 2]);
                let mut r = Response::default();
                // A load changes within a few steps.
                for k in 1..=4 {
                    let [normal, x, y] = core::array::from_fn(|i| from[i] + (to[i] - from[i]) * k as f32 / 4.0);
                    drive = loaded(normal, [x, y]);
                    r = finger.step_driven(&mut state, drive).response;
                    assert_eq!(r.status, Status::OK, "{body:?} {pose_deg:?} {round}: {drive:?} {r:?}");
                }
                from = to;
                let [normal, x, y] = to;
                assert!((r.normal_force_n - normal).abs() < 1e-3 * normal, "{round}: {drive:?} {r:?}");
                let [dx, dy] = [r.friction_n[0] - x, r.friction_n[1] - y];
                assert!(dx.abs().max(dy.abs()) < 1e-3 * r.friction_limit_n, "{round}: {drive:?} {r:?}");
                // A few steps at rest end in the same bits.
                let mut rests = finger.step_driven(&mut state, drive);
                for _ in 0..6 {
                    rests = finger.step_driven(&mut state, drive);
                }
                let kept = state;
                for _ in 0..50 {
                    assert_eq!(finger.step_driven(&mut state, drive), rests);
                }
                assert_eq!(state, kept);
                assert_eq!(
                    (rests.motion.slide_increment_mm, rests.motion.depth_mm),
                    ([0.0; 2], finger.pad.depth_mm(&kept))
                );
            }
        }
    }
}

/// What no depth and no slide yields is flagged; friction stays within its limit, and the finger lets go and touches again.
#[test]
fn loads_out_of_reach_are_flagged() {
    let file = shipped_pad();
    let pad = file.file().pad;
    for body in &bodies() {
        let finger = PadOn { pad, body, pose_deg: [30.0, 0.0] };
        let mut state = PadState::<P>::new(&pad).unwrap();
        finger.step_driven(&mut state, loaded(0.6, [0.0; 2]));
        for friction_n in [[5.0, 0.0], [0.0, -5.0]] {
            let r = finger.step_driven(&mut state, loaded(0.6, friction_n)).response;
            assert!(r.status.contains(Status::LOAD_NOT_REACHED), "{body:?} {friction_n:?} {r:?}");
            let [x, y] = r.tangential_friction_n;
            assert!(x.hypot(y) <= 1.001 * r.friction_limit_n && (0.0..=1.0).contains(&r.slip_margin), "{r:?}");
        }
        let r = finger.step_driven(&mut state, loaded(1e4, [0.0; 2])).response;
        assert!(r.status.contains(Status::LOAD_NOT_REACHED), "{r:?}");
        let r = finger.step_driven(&mut state, loaded(-1.0, [0.0; 2])).response;
        assert_eq!((r.normal_force_n, r.friction_n), (0.0, [0.0; 2]));
        let before = state;
        let r = finger.step_driven(&mut state, loaded(f32::NAN, [0.0, f32::INFINITY])).response;
        assert!(
            r.status.contains(Status::BAD_INPUT) && finger.pad.depth_mm(&state) == finger.pad.depth_mm(&before),
            "{r:?}"
        );
        let first = finger.step_driven(&mut state, loaded(0.4, [0.0; 2])).response;
        let [x, y] = first.friction_n;
        let r = finger.step_driven(&mut state, loaded(0.4, [x + 0.03, y + 0.03])).response;
        assert!((r.normal_force_n - 0.4).abs() < 1e-3 && r.status == Status::OK, "{body:?} {first:?} {r:?}");
    }
}

/// The derivatives foretell a further motion in their direction, on all bodies, before and in slip.
#[test]
fn derivatives_foretell_a_further_motion() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let mut random = Noise(5);
    let mut checked = 0;
    for body in &bodies() {
        let finger = PadOn { pad, body, pose_deg: [35.0, -8.0] };
        let mut state = PadState::<P>::new(&pad).unwrap();
        let mut depth_mm = 0.9;
        for k in 0..40 {
            let slide_increment_mm = [0.15 * random.next(), 0.15 * random.next()];
            depth_mm = (depth_mm + 0.1 * random.next()).clamp(0.5, 1.6);
            let r: Response =
                finger.step(&mut state, Motion { depth_mm, slide_increment_mm, dt_s: DT_S, ..Motion::default() });
            if k < 4 {
                continue;
            }
            let way: [f32; 3] = core::array::from_fn(|_| random.next());
            let gradient = finger.gradient(&state, way);
            let forces = |by: f32| {
                let mut moved = state;
                let [deeper, x, y] = way.map(|part| part * by);
                let motion =
                    Motion { depth_mm: depth_mm + deeper, slide_increment_mm: [x, y], dt_s: DT_S, ..Motion::default() };
                let r: Response = finger.step(&mut moved, motion);
                [r.normal_force_n, r.friction_n[0], r.friction_n[1]]
            };
            let (near, far) = (forces(3e-3), forces(9e-3));
            let rows = [gradient.normal_n_mm, gradient.friction_n_mm[0], gradient.friction_n_mm[1]];
            for ((row, near), far) in rows.iter().zip(near).zip(far) {
                let foretold: f32 = row.iter().zip(way).map(|(d, part)| d * part * 6e-3).sum();
                let size = 6e-3 * r.normal_force_n.max(0.2) * 3.0;
                assert!(
                    (far - near - foretold).abs() < 0.1 * size,
                    "{body:?} {k}: {row:?} {way:?} {near} {far} {foretold}"
                );
            }
            checked += 1;
        }
    }
    assert_eq!(checked, 4 * 36);
    let mut state = PadState::<P>::new(&pad).unwrap();
    let finger = PadOn { pad, body: &Body::Plane, pose_deg: [30.0, 0.0] };
    assert_eq!(finger.gradient(&state, [1.0; 3]).normal_n_mm, [0.0; 3]);
    finger.step_driven(&mut state, loaded(0.5, [0.0; 2]));
    let sticks = finger.gradient(&state, [0.0; 3]);
    assert!(sticks.friction_n_mm[0][1] > 0.1 && sticks.friction_n_mm[1][2] > 0.1, "{sticks:?}");
}

/// At the least grip the load is held with its margin, and at 6 % less depth it is not.
#[test]
fn the_least_grip_holds_its_load() {
    let file = shipped_pad();
    let pad = file.file().pad;
    for (k, body) in bodies().iter().enumerate() {
        let finger = PadOn { pad, body, pose_deg: [30.0 + 5.0 * k as f32, 0.0] };
        let (load_n, margin, factor) = ([0.15, -0.1], 0.3, 1.2);
        let grip = finger.least_grip::<P>(load_n, margin, factor);
        assert!(grip.status == Status::OK && grip.depth_mm > 0.1 && grip.depth_mm < pad.depth_max_mm(), "{grip:?}");
        let under = |depth: f32| {
            let mut state: PadState<P> = finger.fresh().unwrap();
            state.set_strength_factor(factor);
            for k in 1..=200 {
                finger.step(&mut state, Motion { depth_mm: depth * k as f32 / 200.0, dt_s: DT_S, ..Motion::default() });
            }
            let mut r = Response::default();
            for k in 1..=20 {
                let tangential = Tangential::FrictionN(load_n.map(|f| f * k as f32 / 20.0));
                let drive = Drive { normal: Normal::DepthMm(depth), tangential, spin_increment_rad: 0.0, dt_s: DT_S };
                r = finger.step_driven(&mut state, drive).response;
            }
            r
        };
        let r = under(grip.depth_mm);
        assert!((r.normal_force_n / grip.normal_force_n - 1.0).abs() < 0.05, "{r:?} {grip:?}");
        let safe = 1.0 - (1.0 - margin) * (1.0 - r.band_friction_n / r.friction_limit_n);
        assert!(r.slip_margin > margin.max(safe - 0.03), "{body:?} {r:?} {grip:?}");
        assert!(under(0.94 * grip.depth_mm).slip_margin < safe, "{body:?} {grip:?}");
    }
    let finger = PadOn { pad, body: &Body::Plane, pose_deg: [30.0, 0.0] };
    assert_eq!(finger.least_grip::<P>([0.0; 2], 0.2, 1.0), Default::default());
    assert!(finger.least_grip::<P>([50.0, 0.0], 0.2, 1.0).status.contains(Status::LOAD_NOT_REACHED));
    assert!(finger.least_grip::<P>([f32::NAN, 0.0], 0.2, 1.0).status.contains(Status::BAD_INPUT));
}

/// One function drives both models: a load in steps, saved on the way and tuned.
fn carried<S: Clone + PartialEq + core::fmt::Debug, F: Drivable<S>>(finger: &F) -> Response {
    let tuning = Tuning { stiffness: 1.2, ..Tuning::default() };
    let finger = finger.tuned(tuning).unwrap();
    let mut state = finger.fresh().unwrap();
    finger.set_strength_factor(&mut state, 1.1);
    finger.step_driven(&mut state, loaded(0.5, [0.05, 0.0]));
    let mut bytes = [0; 4096];
    let length = finger.save(&state, 7, &mut bytes).unwrap();
    let mut restored = finger.restore(7, &bytes[..length]).unwrap();
    assert_eq!(restored, state);
    assert!(finger.restore(8, &bytes[..length]).is_err());
    let drive = loaded(0.6, [0.1, 0.05]);
    let driven = finger.step_driven(&mut state, drive);
    assert_eq!(finger.step_driven(&mut restored, drive), driven);
    assert!(finger.in_contact(&state) && finger.depth_mm(&state) < finger.depth_max_mm());
    driven.response
}

#[test]
fn both_models_are_driven_alike() {
    let file = shipped_pad();
    let pad = PadOn { pad: file.file().pad, body: &Body::Plane, pose_deg: [30.0, 0.0] };
    let bed = shipped();
    for r in [carried::<PadState<P>, _>(&pad), carried::<SpinState, _>(&bed.model().unwrap())] {
        assert!((r.normal_force_n - 0.6).abs() < 1e-3 && (r.friction_n[0] - 0.1).abs() < 1e-3, "{r:?}");
    }
}
