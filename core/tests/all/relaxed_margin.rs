//! Tissue that relaxes: the margin that is left when it has relaxed, of the shipped pad and the shipped bed.

use crate::common::{shipped, shipped_pad};
use crate::relaxation::{P, POSE_DEG, disturbed, press};
use fingerpad::pad::{Body, Cylinder, Orthotropy, PadOn, PadState, Plane, RelaxingPadState, Sphere};
use fingerpad::{
    Drivable, Drive, Motion, Normal, Relaxation, RelaxingState, Response, SPRINGS, State, StateOf, Status, Tangential,
};

/// A finger is pressed quickly and held at its depth under a tangential load, `share` of `limit`, that of relaxed tissue, N. Returns
/// `slip_margin` and `slip_margin_relaxed` at the start of the load, and the step in which the finger slips.
fn slips_at<S: Clone, F: Drivable<S>>(finger: &F, limit: f32, share: f32) -> ((f32, f32), Option<i32>) {
    let mut state = finger.fresh().unwrap();
    for k in 1..=50 {
        finger.step(&mut state, press(1.2 * k as f32 / 50.0, 1e-3));
    }
    let mut drive = Drive {
        normal: Normal::DepthMm(1.2),
        tangential: Tangential::FrictionN([share * limit, 0.0]),
        spin_increment_rad: 0.0,
        dt_s: 0.01,
    };
    let mut told = (0.0, 0.0);
    for k in 1..=500 {
        drive.dt_s = if k < 20 { 2e-3 } else { 0.01 };
        drive.tangential = Tangential::FrictionN([share * limit * (k as f32 / 20.0).min(1.0), 0.0]);
        let r = finger.step_driven(&mut state, drive).response;
        if k == 20 {
            told = (r.slip_margin, r.slip_margin_relaxed);
        }
        if k > 20 && r.friction_n[0] < 0.98 * share * limit {
            return (told, Some(k));
        }
    }
    (told, None)
}

#[test]
fn a_load_that_holds_now_slips_when_the_finger_has_relaxed() {
    fn check<S: Clone, F: Drivable<S>>(name: &str, finger: &F, limit: f32) {
        let ((margin, relaxed), held) = slips_at(finger, limit, 0.8);
        assert!(held.is_none() && margin > 0.25 && (relaxed - 0.2).abs() < 0.03, "{name} {margin} {relaxed} {held:?}");
        let ((margin, relaxed), held) = slips_at(finger, limit, 1.05);
        assert!(margin > 0.15 && relaxed == 0.0 && held.is_some_and(|k| k > 50), "{name} {margin} {relaxed} {held:?}");
    }
    let (file, data) = (shipped_pad(), shipped());
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let finger = PadOn { pad, body: &Plane, pose_deg: POSE_DEG };
    let limit = pad.step(&mut PadState::<P>::new(&pad).unwrap(), &Plane, press(1.2, 1.0), POSE_DEG).friction_limit_n;
    check::<RelaxingPadState<P>, _>("pad", &finger, limit);
    let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    // The limit of a bed depends on the direction.
    let mut state = State::default();
    model.step(&mut state, press(1.2, 1.0));
    let limit = model.step(&mut state, Motion { slide_increment_mm: [0.1, 0.0], ..press(1.2, 1.0) }).friction_limit_n;
    check::<RelaxingState<1>, _>("bed", &model, limit);
    check::<RelaxingState<2>, _>("bed with spin", &model, limit);
}

/// A bed is pressed and loaded; `slip_margin_relaxed` of the first moment is the margin after a long hold.
#[test]
fn the_margin_of_a_bed_that_is_left_is_that_after_a_long_hold() {
    let data = shipped();
    let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    for (depth, load) in [(0.5, [0.05, 0.05]), (1.5, [0.3, -0.1]), (1.2, [-0.1, 0.1])] {
        let mut state = RelaxingState::<2>::relaxing();
        for k in 1..=40 {
            model.step(&mut state, press(depth * k as f32 / 40.0, 1e-3));
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
            told = model.step_driven(&mut state, drive).response;
            assert!(told.status == Status::OK, "{told:?}");
        }
        assert!(told.slip_margin > told.slip_margin_relaxed + 0.05 && told.slip_margin_relaxed > 0.1, "{told:?}");
        let mut r = told;
        drive.dt_s = 2e-3;
        let mut t = 0.0;
        while t < 140.0 {
            r = model.step_driven(&mut state, drive).response;
            assert!(r.status == Status::OK, "{t} s: {r:?}");
            t += drive.dt_s;
            drive.dt_s = (1.05 * drive.dt_s).min(2.0);
        }
        let off = (r.slip_margin - told.slip_margin_relaxed).abs();
        assert!(off < 0.02 * (1.0 - r.slip_margin), "{depth} {load:?}: told {told:?}, found {r:?}");
        assert!((r.slip_margin - r.slip_margin_relaxed).abs() < 1e-3, "{r:?}");
    }
    let mut plain = StateOf::<SPRINGS, 2>::default();
    let mut state = RelaxingState::<2>::relaxing();
    for (motion, _) in disturbed(3000, 11) {
        let r = model.step(&mut plain, motion);
        assert_eq!(r.slip_margin.to_bits(), r.slip_margin_relaxed.to_bits());
        let r = model.step(&mut state, motion);
        assert!((0.0..=1.0).contains(&r.slip_margin_relaxed) && (0.0..=1.0).contains(&r.stick_ratio), "{r:?}");
    }
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
