//! A finger that pitches and rolls against the plane, in contact and under noise.

use crate::common::{Noise, models, motion};
use fingerpad::{Data, Motion, Pose, Response, SpinState, State, step};

/// The shipped model, which knows poses.
fn shipped() -> Data {
    models().into_iter().find(|(name, _)| *name == "shipped").expect("the shipped file reads").1
}

/// A contact in the fitted pose, pressed to 1 mm and slid along x, away from full slip.
fn slid(data: &Data) -> (State, Response) {
    let model = data.model().unwrap();
    let posed = model.posed(fitted(data)).unwrap();
    let mut state = State::default();
    let mut r = step(&posed, &mut state, motion(1.0, 0.0, 0.0));
    for _ in 0..100 {
        r = step(&posed, &mut state, motion(1.0, 0.006, 0.0));
    }
    (state, r)
}

fn fitted(data: &Data) -> Pose {
    Pose { pitch_deg: data.pose.pitch_deg, roll_deg: 0.0 }
}

/// Without spin the numbers are the same. With it a model in a pose also turns the springs' stretch with the plane.
#[test]
fn the_fitted_pose_is_the_plain_model() {
    let data = shipped();
    let (plain, posed) = (data.model().unwrap(), data.model().unwrap().posed(fitted(&data)).unwrap());
    for (spin, tolerance) in [(0.0, 2e-5), (1e-3, 0.02)] {
        let (mut a, mut b) = (SpinState::default(), SpinState::default());
        let mut noise = Noise(11);
        for i in 0..5000 {
            let motion = Motion {
                spin_increment_rad: spin * noise.next(),
                ..motion(1.0 + 0.9 * (0.01 * i as f32).sin(), 0.02 * noise.next(), 0.01)
            };
            let [a, b] = [step(&plain, &mut a, motion), step(&posed, &mut b, motion)];
            let close = |a: f32, b: f32| (a - b).abs() <= tolerance * (1.0 + a.abs());
            assert!(
                close(a.normal_force_n, b.normal_force_n) && close(a.friction_limit_n, b.friction_limit_n),
                "{a:?} {b:?}"
            );
            assert!(close(a.friction_n[0], b.friction_n[0]) && close(a.friction_n[1], b.friction_n[1]), "{a:?} {b:?}");
        }
    }
}

/// Poses over the range of the fit, its corners among them.
fn poses(data: &Data) -> Vec<Pose> {
    let [least, most] = data.pose.pitch_range_deg;
    let roll = data.pose.roll_max_deg;
    let pitches = (0..=6).map(|i| least + (most - least) * i as f32 / 6.0);
    pitches.flat_map(|pitch_deg| (-3..=3).map(move |k| Pose { pitch_deg, roll_deg: roll * k as f32 / 3.0 })).collect()
}

/// Poses that come one after the other in a hand that is disturbed: noise of 0.01 degrees, jumps, poses out of the range of the fit and
/// what is no number.
fn disturbed_poses(data: &Data) -> Vec<Pose> {
    let mut noise = Noise(23);
    let mut at = fitted(data);
    let mut next = |i: usize| {
        let jumps = i.is_multiple_of(50);
        if jumps {
            at = Pose { pitch_deg: 40.0 + 33.0 * noise.next(), roll_deg: 33.0 * noise.next() };
        }
        let [pitch, roll] = [0.01 * noise.next(), 0.01 * noise.next()];
        match i % 397 {
            0 => Pose { pitch_deg: f32::NAN, ..at },
            1 => Pose { roll_deg: f32::NEG_INFINITY, ..at },
            _ => Pose { pitch_deg: at.pitch_deg + pitch, roll_deg: at.roll_deg + roll },
        }
    };
    (0..20_000).map(&mut next).collect()
}

/// A contact that is pressed, slid and spun in one pose after the other: single precision tells what double does, and refuses what
/// that refuses. Clean poses all over the range of the fit, then disturbed ones.
#[test]
fn a_pose_is_the_same_in_single_and_double_precision() {
    let data = shipped();
    let twin = data.cast::<f64>();
    let (model, twin) = (data.model().unwrap(), twin.model_unchecked());
    let mut refused = 0;
    let mut most = 0.0f64;
    for pose in poses(&data).into_iter().chain(disturbed_poses(&data)) {
        let (posed, twin) = match (model.posed(pose), twin.posed(pose)) {
            (Ok(posed), Ok(twin)) => (posed, twin),
            (a, b) => {
                assert!(a.is_err() && b.is_err(), "{pose:?}");
                refused += 1;
                continue;
            }
        };
        let (mut a, mut b) = (SpinState::default(), fingerpad::StateOf::<4, 2, f64>::default());
        for (depth, slide, spin) in
            [(0.3f32, [0.0f32, 0.0], 0.0f32), (1.0, [0.25, -0.125], 0.0), (1.5, [0.5, 0.5], 0.03125)]
        {
            let motion = Motion { spin_increment_rad: spin, slide_increment_mm: slide, ..motion(depth, 0.0, 0.0) };
            let wide = Motion {
                depth_mm: f64::from(depth),
                slide_increment_mm: slide.map(f64::from),
                spin_increment_rad: f64::from(spin),
                dt_s: f64::from(motion.dt_s),
            };
            let [a, b] = [step(&posed, &mut a, motion).into_double(), step(&twin, &mut b, wide).into_double()];
            let limit = b[1];
            let scales = [b[0], limit, limit, limit, 3.0 * limit, b[5]];
            for ((a, b), scale) in a.into_iter().zip(b).zip(scales) {
                most = most.max((a - b).abs() / scale);
            }
        }
    }
    println!("largest difference: {most:e} of force, limit, limit times 3 mm or area; {refused} poses refused");
    assert!(most < 1e-5 && refused > 100);
}

/// Numbers of a response in double precision.
trait IntoDouble {
    /// Normal force, limit, friction along x and y, moment, area.
    fn into_double(self) -> [f64; 6];
}

impl<T: Into<f64>> IntoDouble for Response<T> {
    fn into_double(self) -> [f64; 6] {
        let [x, y] = self.friction_n;
        let moment = self.spin_moment_n_mm;
        [self.normal_force_n, self.friction_limit_n, x, y, moment, self.contact_area_mm2].map(Into::into)
    }
}

/// A band tells a contact that has rolled from one that stays: rolled by 20 degrees and back it is that of a pose that changed,
/// under noise of 0.01 degrees that of one that stays.
#[test]
fn a_band_knows_whether_the_contact_has_rolled() {
    let data = shipped();
    let model = data.model().unwrap();
    let Pose { pitch_deg, .. } = fitted(&data);
    let at = |roll_deg: f32| model.posed(Pose { pitch_deg: pitch_deg + 5.0, roll_deg }).unwrap();
    let mut state = State::default();
    let still = step(&at(5.0), &mut state, motion(1.0, 0.0, 0.0));
    let [[stays, rate, bend], [rolled, rolled_rate, rolled_bend]] = [data.pose.band[0], data.pose.band_rolled[0]];
    let share = |stick: f32, full: f32| {
        stays + stick * (rate + stick * bend) + full * (rolled + stick * (rolled_rate + stick * rolled_bend))
    };
    // What the pose adds is this share of the normal force.
    let own = |r: &Response, full: f32| r.band_normal_n - share(r.stick_ratio, full) * r.normal_force_n;
    let plain = own(&still, 0.0) / still.normal_force_n;
    let mut noise = Noise(5);
    for _ in 0..10_000 {
        let r = step(&at(5.0 + 0.01 * noise.next()), &mut state, motion(1.0, 0.0, 0.0));
        assert!((r.band_normal_n - still.band_normal_n).abs() < 0.02 * still.band_normal_n, "{r:?} {still:?}");
    }
    let mut r = still;
    for k in (0..=100).chain((0..100).rev()) {
        r = step(&at(5.0 + 0.2 * k as f32), &mut state, motion(1.0, 0.0, 0.0));
    }
    assert!((own(&r, 1.0) / r.normal_force_n - plain).abs() < 0.05 * share(r.stick_ratio, 1.0), "{r:?} {still:?}");
}

/// Force, area and limit rise with depth from the depth of touch on, in every pose, with 1 um of noise on the depth or without.
#[test]
fn a_contact_grows_with_depth_in_every_pose() {
    let data = shipped();
    let model = data.model().unwrap();
    for pose in poses(&data) {
        let posed = model.posed(pose).unwrap();
        for noisy in [0.0, 1e-3] {
            let (mut state, mut noise) = (State::default(), Noise(3));
            let mut before = Response::default();
            for i in 1..=60 {
                let depth_mm = 0.025 * i as f32 + noisy * noise.next();
                let r = step(&posed, &mut state, motion(depth_mm, 0.0, 0.0));
                let rises = r.normal_force_n >= before.normal_force_n && r.contact_area_mm2 >= before.contact_area_mm2;
                assert!(
                    rises && r.friction_limit_n >= 0.9 * before.friction_limit_n,
                    "{pose:?} {depth_mm}: {before:?} {r:?}"
                );
                assert!(r.normal_force_n - before.normal_force_n < 0.2, "{pose:?} {depth_mm}: {before:?} {r:?}");
                before = r;
            }
            assert!(before.normal_force_n > 0.02, "{pose:?}: {before:?}");
        }
    }
}

/// Closed paths of depth and slide in a pose that stays take work and give none, wide ones that slip and narrow ones that all but
/// stick, in both senses, with vibration of 1 um or without, and with spins.
#[test]
fn closed_paths_in_a_pose_yield_no_work() {
    let data = shipped().cast::<f64>();
    let model = data.model_unchecked();
    for pose in poses(&shipped()) {
        let posed = model.posed(pose).unwrap();
        for (amplitude, noise, spin) in [(1.0, 0.0, 0.0), (1.0, 1e-3, 0.0), (1.0, 1e-3, 0.2), (0.08, 0.0, 0.0)] {
            for sense in [1.0, -1.0] {
                let [work, moved] = closed_path(&posed, [amplitude, noise, spin, sense]);
                let of = format!("{pose:?}, amplitude {amplitude}, noise {noise} mm, spin {spin}, sense {sense}");
                assert!(work > -1e-3 * moved, "{of}: {work} of {moved} N mm");
            }
        }
    }
}

/// Work taken by the second and third round of a closed path, and the sum of its magnitudes, N mm.
fn closed_path(
    posed: &fingerpad::ModelOf<'_, 4, 37, fingerpad::Scaled<f64, true>, f64>,
    [amplitude, noise, spin, sense]: [f64; 4],
) -> [f64; 2] {
    const STEPS: i32 = 4000;
    let at = |t: f64| {
        let [depth, x, y] = [(t + 0.3).sin(), (t + 1.9).sin(), (t + 1.0).cos()];
        [1.0 + 0.3 * amplitude * depth, 0.8 * amplitude * x, 0.6 * amplitude * y, spin * y]
    };
    let (mut state, mut random) = (fingerpad::StateOf::<4, 2, f64>::default(), Noise(7));
    let (mut work, mut moved) = (0.0, 0.0f64);
    let mut from = at(0.0);
    for i in 0..=3 * STEPS {
        let mut to = at(sense * std::f64::consts::TAU * f64::from(i) / f64::from(STEPS));
        if i % STEPS != 0 {
            to[0] += noise * f64::from(random.next());
        }
        let motion = Motion {
            depth_mm: to[0],
            slide_increment_mm: [to[1] - from[1], to[2] - from[2]],
            spin_increment_rad: to[3] - from[3],
            dt_s: 1e-3,
        };
        let r = posed.step(&mut state, motion);
        if i > STEPS {
            let forces = [r.normal_force_n, r.friction_n[0], r.friction_n[1], r.spin_moment_n_mm];
            let by: f64 = (0..4).map(|k| forces[k] * (to[k] - from[k])).sum();
            work += by;
            moved += by.abs();
        }
        from = to;
    }
    [work, moved]
}

/// Reversals and a spin in every pose under 1 um of noise on depth and slide and a tenth of a degree on the pose end near where
/// they end without, and never beyond the limit.
#[test]
fn noise_in_a_pose_hardly_moves_friction() {
    let data = shipped();
    let model = data.model().unwrap();
    for pose in poses(&data) {
        let run = |amplitude: f32| {
            let (mut state, mut noise) = (SpinState::default(), Noise(9));
            let mut last = Response::default();
            for i in 0..1200 {
                let [pitch, roll] = [0.1, 0.1].map(|deg: f32| 1e3 * amplitude * deg * noise.next());
                let pose = Pose {
                    pitch_deg: (pose.pitch_deg + pitch).clamp(10.0, 70.0),
                    roll_deg: (pose.roll_deg + roll).clamp(-30.0, 30.0),
                };
                let slide = [0.004, -0.004, 0.0][i / 400] + amplitude * noise.next();
                let spin_increment_rad = if i >= 800 { 5e-4 } else { 0.0 };
                let motion =
                    Motion { spin_increment_rad, ..motion(1.0 + amplitude * noise.next(), slide, 0.5 * slide) };
                last = step(&model.posed(pose).unwrap(), &mut state, motion);
                let friction = last.friction_n[0].hypot(last.friction_n[1]);
                assert!(friction <= 1.02 * last.friction_limit_n + 1e-4, "{pose:?} {i}: {last:?}");
            }
            last
        };
        let (clean, noisy) = (run(0.0), run(1e-3));
        let apart = (0..2).map(|k| clean.friction_n[k] - noisy.friction_n[k]).fold(0.0, f32::hypot);
        assert!(apart < 0.1 * clean.friction_limit_n, "{pose:?}: {clean:?} {noisy:?}");
    }
}

/// Rolling takes part of a load along; the same cycle again takes nothing more.
#[test]
fn rolling_to_and_fro_costs_once() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut state, before) = slid(&data);
    let mut kept = vec![];
    for _ in 0..50 {
        for k in 1..=400i32 {
            let roll_deg = 0.1 * (100 - (k % 400 - 200).abs()) as f32;
            let posed = model.posed(Pose { roll_deg, ..fitted(&data) }).unwrap();
            let r = step(&posed, &mut state, motion(1.0, 0.0, 0.0));
            if k == 400 || k == 100 {
                kept.push(r.friction_n[0] / before.friction_n[0]);
            }
        }
    }
    assert!(kept[1] > 0.3 && kept[1] < 0.95, "{kept:?}");
    assert_eq!(kept[3], kept[99]);
}

/// Noise of a tenth of a degree with vibration of 1 um in depth and slide: the load stays.
#[test]
fn a_held_load_stays_under_noise_on_the_pose() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut state, before) = slid(&data);
    let mut noise = Noise(5);
    let mut share = vec![];
    for i in 1..=200_000 {
        let pose = Pose { pitch_deg: data.pose.pitch_deg + 0.1 * noise.next(), roll_deg: 0.1 * noise.next() };
        let r = step(&model.posed(pose).unwrap(), &mut state, motion(1.0 + 1e-3 * noise.next(), 0.0, 0.0));
        if i == 2_000 || i == 200_000 {
            share.push(r.friction_n[0] / before.friction_n[0]);
        }
    }
    let r = step(&model.posed(fitted(&data)).unwrap(), &mut state, motion(1.0, 0.0, 0.0));
    share.push(r.friction_n[0] / before.friction_n[0]);
    println!("friction kept after 2000 and 200 000 steps, and at rest: {share:?}");
    assert!((share[0] - share[1]).abs() < 0.01, "{share:?}");
    assert!(share[2] > 0.95, "{share:?}");
}

/// With half a degree of noise on the pose while the slide vibrates by 50 to 400 um to either side: a cycle costs once.
#[test]
fn a_held_load_stays_while_slide_and_pose_vibrate() {
    let data = shipped();
    let model = data.model().unwrap();
    let poses = [(0.0, 0.0), (15.0, 0.0), (0.0, 15.0)];
    for ((pitch, roll), far_mm) in poses.into_iter().flat_map(|pose| [0.05, 0.15, 0.4].map(|far| (pose, far))) {
        let rest = Pose { pitch_deg: data.pose.pitch_deg + pitch, roll_deg: roll };
        let at_rest = model.posed(rest).unwrap();
        let mut state = State::default();
        let mut noise = Noise(9);
        for _ in 0..200 {
            step(&at_rest, &mut state, motion(1.0, 1e-3, 0.0));
        }
        let mut kept = vec![];
        for cycle in 0..=2000 {
            if [0, 10, 100, 2000].contains(&cycle) {
                kept.push(step(&at_rest, &mut state, motion(1.0, 0.0, 0.0)).friction_n[0]);
            }
            for share in [0.5, 0.5, -0.5, -0.5, -0.5, -0.5, 0.5, 0.5] {
                let pitch_deg = rest.pitch_deg + 0.5 * noise.next();
                let pose = Pose { pitch_deg, roll_deg: rest.roll_deg + 0.5 * noise.next() };
                step(&model.posed(pose).unwrap(), &mut state, motion(1.0, share * far_mm, 0.0));
            }
        }
        println!("{rest:?}, {far_mm} mm: friction before and after 10, 100, 2000 cycles {kept:?}");
        assert!(kept[3] > 0.85 * kept[0] && (kept[3] - kept[2]).abs() < 0.02 * kept[0], "{rest:?} {far_mm}: {kept:?}");
    }
}

/// The gradient of a posed and retuned model against small steps both ways: the mean of what it says at both ends.
#[test]
fn the_gradient_knows_the_pose() {
    let data = shipped().cast::<f64>();
    let plain = data.model_unchecked();
    let tuned = plain.tuned(fingerpad::Tuning { tau0_mpa: 0.003, size: 1.1, ..Default::default() }).unwrap();
    for pose in [Pose { pitch_deg: 45.0, roll_deg: -12.0 }, Pose { pitch_deg: 20.0, roll_deg: 8.0 }] {
        let model = tuned.posed(pose).unwrap();
        for slide in [0.3, 4.0] {
            let mut state = fingerpad::StateOf::<4, 2, f64>::default();
            let at = |depth_mm: f64, x: f64| Motion {
                depth_mm,
                slide_increment_mm: [x, 0.5 * x],
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            model.step(&mut state, at(1.012, 0.0));
            for _ in 0..100 {
                model.step(&mut state, at(1.012, 0.01 * slide));
            }
            for direction in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.2, 0.8]] {
                let h = 1e-4;
                let by = |depth_mm: f64| Motion {
                    slide_increment_mm: [h * direction[1], h * direction[2]],
                    ..at(depth_mm + h * direction[0], 0.0)
                };
                // A first step brings springs that slip to the end of the slack that their limit has.
                let mut moved = state;
                let before = model.step(&mut moved, by(1.012));
                let g = model.gradient(&moved, direction);
                let depth_mm = moved.depth_mm();
                let after = model.step(&mut moved, by(depth_mm));
                let rate = |row: [f64; 3]| row.iter().zip(direction).map(|(g, d)| g * d).sum::<f64>();
                let is = [
                    after.normal_force_n - before.normal_force_n,
                    after.friction_n[0] - before.friction_n[0],
                    after.friction_n[1] - before.friction_n[1],
                ]
                .map(|d| d / h);
                let said = [rate(g.normal_n_mm), rate(g.friction_n_mm[0]), rate(g.friction_n_mm[1])];
                for (is, said) in is.into_iter().zip(said) {
                    assert!((is - said).abs() < 2e-3 + 0.01 * is.abs(), "{pose:?} {slide} {direction:?}: {is} {said}");
                }
            }
        }
    }
}
