use super::*;
use crate::{Motion, Regime, Relaxation, Response, Status, Tuning};

const N: usize = EXAMPLE_PATCHES;

/// Reproducible pseudo-random numbers.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 33) as f64 / f64::from(1u32 << 31))
    }
}

/// A contact along a path. Positions are slide x and y and depth (mm), spin, pitch relative to the neutral one, and roll (rad).
#[derive(Clone)]
struct PathRun<'a, B, M = ()> {
    pad: Pad<'a, f64>,
    body: B,
    state: PadState<N, f64, M>,
    dt_s: f64,
    at: [f64; 6],
    last: Response<f64>,
    /// Work of the body on the finger, and the sum of its magnitudes over the steps, mJ.
    work: [f64; 2],
}

const START: [f64; 6] = [0.0, 0.0, -0.5, 0.0, 0.0, 0.0];

impl<'a, B: Surface<f64>> PathRun<'a, B> {
    fn new(pad: Pad<'a, f64>, body: B) -> Self {
        let state = if body.is_plane() {
            PadState::new(&pad).unwrap()
        } else {
            PadState::over(&pad, [pad.numbers.neutral_pitch_deg, 0.0]).unwrap()
        };
        Self { pad, body, state, dt_s: 1e-3, at: START, last: Response::default(), work: [0.0; 2] }
    }

    /// The same finger, whose tissue relaxes.
    fn relaxing(&self, relaxation: Relaxation<f64>) -> PathRun<'a, B, PadMemory<N, f64>>
    where
        B: Clone,
    {
        let pad = self.pad.with_relaxation(relaxation);
        let state = RelaxingPadState::fresh_over(&pad, [pad.numbers.neutral_pitch_deg, 0.0]).unwrap();
        let (body, at, last) = (self.body.clone(), START, Response::default());
        PathRun { pad, body, state, dt_s: 1e-3, at, last, work: [0.0; 2] }
    }
}

impl<B: Surface<f64>, M: Memory<N, f64>> PathRun<'_, B, M> {
    fn height(&self, at: &[f64; 6]) -> f64 {
        let normal = [-at[4].sin(), at[4].cos() * at[5].sin(), at[4].cos() * at[5].cos()];
        let pivot: f64 = normal.iter().zip(&self.state.pivot).map(|(a, b)| a * b).sum();
        self.pad.first_touch_mm(&normal) - pivot + at[2]
    }

    /// Force along the plane's axes, and moment about the centre of rotation of poses.
    fn wrench(&self, at: &[f64; 6], r: &Response<f64>) -> ([f64; 3], [f64; 3]) {
        let ([x, y], [about_x, about_y]) = (r.friction_n, r.tilt_moment_n_mm);
        let height = self.height(at);
        ([x, y, r.normal_force_n], [about_x - height * y, about_y + height * x, r.spin_moment_n_mm])
    }

    fn step(&mut self, next: [f64; 6]) {
        let travel: [f64; 6] = core::array::from_fn(|k| next[k] - self.at[k]);
        let motion = Motion {
            depth_mm: next[2],
            slide_increment_mm: [travel[0], travel[1]],
            spin_increment_rad: travel[3],
            dt_s: self.dt_s,
        };
        let pose = [self.pad.numbers.neutral_pitch_deg + next[4].to_degrees(), next[5].to_degrees()];
        let response = self.pad.step(&mut self.state, &self.body, motion, pose);
        let (before, after) = (self.wrench(&self.at, &self.last), self.wrench(&next, &response));
        let mean = |k: usize| (0.5 * (before.0[k] + after.0[k]), 0.5 * (before.1[k] + after.1[k]));
        // Rotation of the plane relative to the finger, from the changes of pitch, roll and spin.
        let pitch = 0.5 * (self.at[4] + next[4]);
        let rise = self.height(&next) - self.height(&self.at);
        let rotated = [-travel[5] * pitch.cos(), -travel[4], travel[3] + travel[5] * pitch.sin()];
        // A curved body spins about its apex: the point of it at the foot goes round.
        let [x, y] = [0, 1].map(|k| if self.body.is_plane() { 0.0 } else { 0.5 * (self.at[k] + next[k]) });
        let foot = [travel[0] + travel[3] * y, travel[1] - travel[3] * x];
        let mut done = mean(0).0 * foot[0] + mean(1).0 * foot[1] + mean(2).0 * rise;
        for (k, rotated) in rotated.iter().enumerate() {
            done += mean(k).1 * rotated;
        }
        self.work[0] += done;
        self.work[1] += done.abs();
        self.last = response;
        self.at = next;
    }

    /// Moves along a straight line to a position.
    fn to(&mut self, to: [f64; 6], steps: usize) {
        let from = self.at;
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            self.step(core::array::from_fn(|k| from[k] + share * (to[k] - from[k])));
        }
    }
}

/// Runs a check on every body.
macro_rules! on_every_body {
    ($pad:expr, $check:ident) => {{
        $check("plane", PathRun::new($pad, Plane));
        $check("sphere", PathRun::new($pad, Sphere::new(8.0).unwrap()));
        $check("bowl", PathRun::new($pad, Sphere::new(-40.0).unwrap()));
        $check("cylinder", PathRun::new($pad, Cylinder::new(10.0, 53.0).unwrap()));
        $check("edge", PathRun::new($pad, Edge::new(2.0, 37.0, 106.0).unwrap()));
    }};
}

/// In full stick the forces are the derivatives of the stored energy over all six coordinates of the body.
#[test]
fn forces_are_the_slopes_of_the_energy() {
    let mut example = ExamplePad::new().cast::<f64>();
    example.numbers.law.friction = [500.0, 0.46];
    fn check<B: Surface<f64> + Clone>(name: &str, mut run: PathRun<'_, B>) {
        run.to([0.0, 0.0, 0.9, 0.0, 0.0, 0.0], 60);
        run.to([0.4, -0.2, 1.0, 0.1, 0.06, -0.05], 60);
        let energy = |run: &PathRun<'_, B>| run.pad.energy_mj(&run.state, &run.body);
        let both = [0, 1, 2, 3, 4, 5].map(|k| {
            let step = 2e-4;
            let moved = |by: f64| {
                let mut other = run.clone();
                let mut to = other.at;
                to[k] += by;
                other.work = [0.0; 2];
                other.to(to, 1);
                (energy(&other), other.work[0])
            };
            let (up, down) = (moved(step), moved(-step));
            (up.0 - down.0, up.1 - down.1)
        });
        let largest = both.iter().map(|(_, done)| done.abs()).fold(0.0, f64::max);
        for (k, (stored, done)) in both.into_iter().enumerate() {
            assert!((stored - done).abs() < 5e-4 * largest, "{name}, coordinate {k}: stored {stored:e}, work {done:e}");
        }
    }
    on_every_body!(example.pad(), check);
}

#[test]
fn closed_paths_yield_no_work() {
    let example = ExamplePad::new().cast::<f64>();
    fn check<B: Surface<f64> + Clone>(name: &str, start: PathRun<'_, B>) {
        let mut random = Random(11);
        for path in 0..20 {
            let mut run = start.clone();
            run.to([0.0, 0.0, random.between(0.2, 1.5), 0.0, 0.0, 0.0], 60);
            for _ in 0..5 {
                let strength = random.between(0.5, 1.5);
                run.state.set_strength_factor(strength);
                let to = [
                    random.between(-1.0, 1.0),
                    random.between(-1.0, 1.0),
                    random.between(0.1, 1.5),
                    random.between(-0.3, 0.3),
                    random.between(-0.2, 0.2),
                    random.between(-0.2, 0.2),
                ];
                run.to(to, 150);
            }
            run.to([0.0, 0.0, run.at[2], 0.0, 0.0, 0.0], 150);
            run.to(START, 150);
            let [work, exchanged] = run.work;
            assert!(work > -1e-3 * exchanged, "{name}, path {path}: {work:e} of {exchanged:e} mJ");
            assert!(work < exchanged, "friction dissipates a part");
        }
    }
    on_every_body!(example.pad(), check);
    on_every_body!(example.pad().with_orthotropy(Orthotropy::new(0.4, 35.0).unwrap().cast()), check);
}

/// Tissue that relaxes takes work whatever the time steps are, those that are none included: more than stays stored when it has relaxed.
#[test]
fn relaxing_tissue_yields_no_work_at_any_pace() {
    let example = ExamplePad::new().cast::<f64>();
    let exact = example.pad().with_effort(Effort { evaluations: 200, tolerance: 1e-5 });
    fn check<B: Surface<f64> + Clone>(name: &str, start: PathRun<'_, B>) {
        let mut random = Random(17);
        for path in 0..paths() {
            let times = [1e-4, 1e-2, 1.0].map(|least| least * 100f64.powf(random.between(0.0, 1.0)));
            let shares = [2.0, 1.0, 3.0].map(|most| random.between(0.0, most));
            let branches = core::array::from_fn(|i| crate::Branch { share: shares[i], time_s: times[i] });
            let mut run = start.relaxing(Relaxation { branches });
            for corner in 0..8 {
                run.state.set_strength_factor(random.between(0.5, 1.5));
                let to = match corner {
                    7 => START,
                    _ => [
                        random.between(-1.0, 1.0),
                        random.between(-1.0, 1.0),
                        random.between(-0.2, 1.5),
                        random.between(-0.3, 0.3),
                        random.between(-0.2, 0.2),
                        random.between(-0.2, 0.2),
                    ],
                };
                let pace = 10f64.powf(random.between(-5.0, -1.0));
                let from = run.at;
                for step in 1..=100 {
                    let share = f64::from(step) / 100.0;
                    run.dt_s = match random.between(0.0, 40.0) as usize {
                        0 => 0.0,
                        1 => f64::NAN,
                        2 => -1.0,
                        3 => 1e8,
                        _ => pace,
                    };
                    run.step(core::array::from_fn(|k| from[k] + share * (to[k] - from[k])));
                }
                let ([work, exchanged], stored) = (run.work, run.pad.energy_mj(&run.state, &run.body));
                assert!(
                    work - stored > -1e-5 * exchanged || exchanged < 0.1,
                    "{name}, path {path}: {work:e} of {exchanged:e} mJ, {stored:e} stored"
                );
            }
            assert!(run.work[0] > 0.02 * run.work[1], "{name}, path {path}: {:?}", run.work);
        }
    }
    on_every_body!(exact, check);
}

/// Paths on each body; `FINGERPAD_PATHS` asks for more.
fn paths() -> usize {
    std::env::var("FINGERPAD_PATHS").map_or(12, |count| count.parse().unwrap())
}

/// A static load below its limit remains after many small cycles of any coordinate, and does not drift after the first cycles.
#[test]
fn a_static_load_remains_under_small_cycles() {
    let example = ExamplePad::new().cast::<f64>();
    fn check<B: Surface<f64> + Clone>(name: &str, start: PathRun<'_, B>) {
        let circle = |k: usize, size: f64| {
            let angle = k as f64 * core::f64::consts::FRAC_PI_4;
            [0.0, 0.0, 0.0, 0.0, size * angle.sin(), size * angle.cos()]
        };
        let circles: std::vec::Vec<[f64; 6]> = (0..8).map(|k| circle(k, 9e-3)).collect();
        let all: std::vec::Vec<[f64; 6]> = (0..8)
            .map(|k| {
                let mut c = circle(k, 9e-3);
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                (c[0], c[2], c[3]) = (0.01 * sign, 0.01 * sign, 0.01 * sign);
                c
            })
            .collect();
        for (cycle_name, cycle) in [
            ("depth", std::vec![[0.0, 0.0, 0.05, 0.0, 0.0, 0.0], [0.0, 0.0, -0.05, 0.0, 0.0, 0.0]]),
            ("slide", std::vec![[0.01, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, -0.01, 0.0, 0.0, 0.0, 0.0]]),
            ("spin", std::vec![[0.0, 0.0, 0.0, 0.01, 0.0, 0.0], [0.0, 0.0, 0.0, -0.01, 0.0, 0.0]]),
            ("pose", circles),
            ("all", all),
        ] {
            let mut run = start.clone();
            run.to([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 40);
            run.to([0.2, 0.1, 1.0, 0.0, 0.0, 0.0], 40);
            let position = run.at;
            let load = run.last.friction_n;
            let mut after = std::vec::Vec::new();
            for _ in 0..200 {
                for change in &cycle {
                    run.to(core::array::from_fn(|k| position[k] + change[k]), 1);
                }
                run.to(position, 1);
                after.push(run.last.friction_n);
            }
            let size = |f: [f64; 2]| f[0].hypot(f[1]);
            let off = |a: [f64; 2], b: [f64; 2]| size([a[0] - b[0], a[1] - b[1]]) / run.last.friction_limit_n;
            let drift = off(after[199], after[9]);
            assert!(drift < 1e-3, "{name}, {cycle_name}: {drift:.1e} in 190 cycles");
            assert!(size(after[199]) > 0.6 * size(load), "{name}, {cycle_name}: the load is there");
        }
    }
    on_every_body!(example.pad(), check);
}

#[test]
fn single_precision_follows_double_precision_and_rest_keeps_its_bits() {
    let example = ExamplePad::new();
    let twin = example.cast::<f64>();
    let mut state = PadState::<N>::new(&example.pad()).unwrap();
    let mut twin_state = PadState::<N, f64>::new(&twin.pad()).unwrap();
    let mut worst: f64 = 0.0;
    for k in 0..4000 {
        let t = f64::from(k) * 1e-3;
        let motion = Motion {
            depth_mm: 0.8 + 0.5 * (3.0 * t).sin(),
            slide_increment_mm: [3e-3 * (2.0 * t).cos(), -2e-3 * (1.3 * t).sin()],
            spin_increment_rad: 4e-4 * (2.2 * t).sin(),
            dt_s: 1e-3,
        };
        let pose = [30.0 + 8.0 * (1.7 * t).sin(), 6.0 * (2.9 * t).sin()];
        let b = twin.pad().step(&mut twin_state, &Plane, motion, pose);
        let single = Motion {
            depth_mm: motion.depth_mm as f32,
            slide_increment_mm: motion.slide_increment_mm.map(|x| x as f32),
            spin_increment_rad: motion.spin_increment_rad as f32,
            dt_s: 1e-3,
        };
        let single_pose = pose.map(|x| x as f32);
        let a = example.pad().step(&mut state, &Plane, single, single_pose);
        let off = (f64::from(a.friction_n[0]) - b.friction_n[0]).hypot(f64::from(a.friction_n[1]) - b.friction_n[1]);
        worst = worst.max(off / b.friction_limit_n.max(1e-3));
        worst = worst.max((f64::from(a.normal_force_n) - b.normal_force_n).abs() / b.normal_force_n.max(1e-3));
        if k % 100 == 99 {
            let still = Motion { depth_mm: single.depth_mm, dt_s: 1e-3, ..Motion::default() };
            // Patches may still slip in the first step at rest; after it nothing moves.
            example.pad().step(&mut state, &Plane, still, single_pose);
            let first = example.pad().step(&mut state, &Plane, still, single_pose);
            let rest = state;
            for _ in 0..19 {
                let again = example.pad().step(&mut state, &Plane, still, single_pose);
                assert_eq!(again, first, "step {k}");
                assert_eq!(state, rest, "step {k}");
            }
            // The twin takes the same steps at rest: they reduce the error of equilibrium of both.
            let still = Motion { depth_mm: motion.depth_mm, dt_s: 1e-3, ..Motion::default() };
            for _ in 0..21 {
                twin.pad().step(&mut twin_state, &Plane, still, pose);
            }
        }
    }
    assert!(worst < 2e-3, "{worst:e}");
}

#[test]
fn bad_input_is_flagged_and_harmless() {
    let example = ExamplePad::new();
    let pad = example.pad();
    let mut state = PadState::<N>::new(&pad).unwrap();
    let press = Motion { depth_mm: 1.0, dt_s: 1e-3, ..Motion::default() };
    let before = pad.step(&mut state, &Plane, press, [30.0, 0.0]);
    assert_eq!(before.status, Status::OK);
    // Patches that slip in the last moving step stick from the next step on.
    let before = Response { ..pad.step(&mut state, &Plane, press, [30.0, 0.0]) };
    for (motion, pose, flag) in [
        (Motion { depth_mm: f32::NAN, ..press }, [30.0, 0.0], Status::BAD_INPUT),
        (Motion { slide_increment_mm: [0.0, f32::INFINITY], ..press }, [30.0, 0.0], Status::BAD_INPUT),
        (Motion { spin_increment_rad: f32::NAN, ..press }, [30.0, 0.0], Status::BAD_INPUT),
        (Motion { dt_s: 0.0, ..press }, [30.0, 0.0], Status::BAD_TIME_STEP),
        (press, [f32::NAN, 0.0], Status::BAD_INPUT),
    ] {
        let r = pad.step(&mut state, &Plane, motion, pose);
        assert_eq!(r.status, flag, "{motion:?}");
        assert_eq!(Response { status: Status::OK, ..r }, before, "{motion:?}");
    }
    let r = pad.step(&mut state, &Plane, Motion { depth_mm: 9.0, ..press }, [80.0, 0.0]);
    assert_eq!(r.status, Status::DEPTH_ABOVE_RANGE.with(Status::POSE_OUT_OF_RANGE));
    assert!(r.normal_force_n.is_finite() && r.normal_force_n > before.normal_force_n);
    let r = pad.step(&mut state, &Plane, Motion { slide_increment_mm: [1e6, 0.0], ..press }, [30.0, 0.0]);
    assert_eq!(r.status, Status::LARGE_INCREMENT);
    // A patch that comes into contact during this step has not slipped yet.
    assert!(r.stick_ratio < 0.2, "{}", r.stick_ratio);
    let r = pad.step(&mut state, &Plane, Motion { depth_mm: -1.0, ..press }, [30.0, 0.0]);
    assert_eq!(r, Response::default());
}

/// A press that is taken back brings no slip, while a slide that goes on and one that turns back slip in part.
#[test]
fn a_press_that_is_taken_back_sticks() {
    let example = ExamplePad::new().cast::<f64>();
    let mut run = PathRun::new(example.pad(), Plane);
    run.to([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 50);
    run.to([0.5, 0.0, 1.0, 0.0, 0.0, 0.0], 50);
    assert_eq!(run.last.regime, Regime::PartialSlip, "{}", run.last.stick_ratio);
    run.to([0.5, 0.0, 1.2, 0.0, 0.0, 0.0], 20);
    run.to([0.5, 0.0, 1.05, 0.0, 0.0, 0.0], 15);
    assert_eq!(run.last.regime, Regime::Stick, "{}", run.last.stick_ratio);
    run.to([0.5, 0.0, 1.0, 0.0, 0.0, 0.0], 5);
    run.to([0.6, 0.0, 1.0, 0.0, 0.0, 0.0], 10);
    assert_eq!(run.last.regime, Regime::PartialSlip, "{}", run.last.stick_ratio);
    run.to([0.55, 0.0, 1.0, 0.0, 0.0, 0.0], 5);
    assert_eq!(run.last.regime, Regime::Stick, "{}", run.last.stick_ratio);
    run.to([-0.4, 0.0, 1.0, 0.0, 0.0, 0.0], 95);
    assert_eq!(run.last.regime, Regime::PartialSlip, "{}", run.last.stick_ratio);
}

/// A long slide loses no precision, and a plane that keeps sliding is in steady slip.
#[test]
fn a_long_slide_is_steady() {
    let example = ExamplePad::new();
    let pad = example.pad();
    let mut state = PadState::<N>::new(&pad).unwrap();
    let mut friction = [0.0; 2];
    for k in 0..100_000 {
        let motion = Motion { depth_mm: 1.0, slide_increment_mm: [0.02, 0.01], dt_s: 1e-3, ..Motion::default() };
        let r = pad.step(&mut state, &Plane, motion, [30.0, 0.0]);
        if k == 1000 {
            friction = r.friction_n;
            assert_eq!(r.regime, Regime::Slip);
        } else if k > 1000 {
            assert!((r.friction_n[0] - friction[0]).abs() < 2e-3 * friction[0], "{k}: {:?} {friction:?}", r.friction_n);
        }
    }
}

/// The residual of the solver is the gradient of the stored energy over the bulk.
#[test]
fn the_residual_is_the_gradient_of_the_energy_over_the_bulk() {
    let mut example = ExamplePad::new().cast::<f64>();
    example.numbers.law.friction = [500.0, 0.46];
    fn check<B: Surface<f64> + Clone>(name: &str, mut run: PathRun<'_, B>) {
        run.to([0.0, 0.0, 0.9, 0.0, 0.0, 0.0], 60);
        run.to([0.4, -0.2, 1.0, 0.1, 0.06, -0.05], 60);
        // A state away from equilibrium.
        (0..MODES).for_each(|k| run.state.bulk[k] += 0.02 * (k as f64 + 0.5).sin());
        let residual = run.pad.residual(&run.state, &run.body);
        for (k, residual) in residual.into_iter().enumerate() {
            let energy = |by: f64| {
                let mut state = run.state;
                state.bulk[k] += by;
                run.pad.energy_mj(&state, &run.body)
            };
            let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
            assert!((slope - residual).abs() < 1e-5, "{name}, coordinate {k}: {slope:e} {residual:e}");
        }
    }
    on_every_body!(example.pad(), check);
}

/// A step that is too large for the iterations is flagged, and later steps find equilibrium again.
#[test]
fn a_step_without_equilibrium_is_flagged() {
    let mut example = ExamplePad::new();
    example.numbers.law.friction = [500.0, 0.46];
    let pad = example.pad();
    let mut state = PadState::<N>::new(&pad).unwrap();
    let press = Motion { depth_mm: 1.5, dt_s: 1e-3, ..Motion::default() };
    pad.step(&mut state, &Plane, press, [30.0, 0.0]);
    let far = Motion { slide_increment_mm: [60.0, 60.0], spin_increment_rad: 3.0, ..press };
    let r = pad.step(&mut state, &Plane, far, [50.0, 20.0]);
    assert_eq!(r.status, Status::NOT_CONVERGED, "{r:?}");
    let gone = Motion { depth_mm: -1.0, ..press };
    pad.step(&mut state, &Plane, gone, [30.0, 0.0]);
    let r = pad.step(&mut state, &Plane, press, [30.0, 0.0]);
    assert_eq!(r.status, Status::OK, "{r:?}");
}

/// After the memory was overwritten, the next steps either reset and flag it or return finite responses.
#[test]
fn overwritten_memory_is_reset_or_sound() {
    let example = ExamplePad::new();
    let pad = example.pad();
    let mut seed = 11u64;
    let mut bits = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 32) as u32
    };
    let at =
        |depth_mm: f32, x: f32| Motion { depth_mm, slide_increment_mm: [x, 0.01], dt_s: 1e-3, ..Motion::default() };
    let (mut lost, mut kept) = (0, 0);
    for case in 0..3000 {
        let mut state = PadState::<EXAMPLE_PATCHES>::new(&pad).unwrap();
        for _ in 0..3 {
            pad.step(&mut state, &Plane, at(0.9, 0.05), [30.0, 0.0]);
        }
        let words: &mut [u32] = bytemuck::cast_slice_mut(core::slice::from_mut(&mut state));
        for _ in 0..=case % 3 {
            let place = bits() as usize % words.len();
            words[place] = match bits() % 4 {
                0 => bits(),
                1 => f32::NAN.to_bits(),
                2 => f32::MAX.to_bits(),
                _ => (1e3 * (bits() as f32 / 2e9 - 1.0)).to_bits(),
            };
        }
        let mut was_lost = false;
        for k in 0..4 {
            let r = pad.step(&mut state, &Plane, at(0.9, 0.02 * k as f32), [32.0, 4.0]);
            was_lost |= r.status.contains(crate::Status::MEMORY_LOST);
            let numbers = [r.normal_force_n, r.friction_n[0], r.friction_n[1], r.spin_moment_n_mm, r.contact_area_mm2];
            assert!(numbers.iter().all(|x| x.is_finite()) && r.normal_force_n >= 0.0, "{case}: {r:?}");
            assert!((0.0..=1.0).contains(&r.stick_ratio) && (0.0..=1.0).contains(&r.slip_margin), "{case}: {r:?}");
        }
        (lost, kept) = (lost + u32::from(was_lost), kept + u32::from(!was_lost));
    }
    assert!(lost > 100 && kept > 100, "{lost} {kept}");
}

/// For another size, stiffness and lambda, `tuned` agrees with a pad whose numbers are all converted one by one.
#[test]
fn a_tuned_pad_is_the_pad_of_the_other_finger() {
    let example = ExamplePad::new().cast::<f64>();
    let pad = example.pad();
    let (s, e, lambda) = (1.25, 2.0, 0.75);
    let tuning = Tuning { size: s as f32, stiffness: e as f32, lambda: lambda as f32 };
    let tuned = pad.tuned(tuning).unwrap();
    let mut other = ExamplePad::new().cast::<f64>();
    // Coordinates of the bulk are square roots of energies.
    let root = f64::sqrt(e * s * s * s);
    let scaled = |row: [f64; MODES], by: f64| row.map(|x| x * by);
    for patch in &mut other.patches {
        patch.middle_mm = patch.middle_mm.map(|x| x * s);
        patch.area_mm2 *= s * s;
        patch.spread_mm = patch.spread_mm.map(|x| x * s);
        patch.modes = patch.modes.map(|row| scaled(row, s / root));
        patch.compliance_mm_per_n = patch.compliance_mm_per_n.map(|c| c / (e * s));
    }
    let numbers = &mut other.numbers;
    for (k, row) in numbers.rigid.iter_mut().enumerate() {
        *row = scaled(*row, if k < 3 { s / root } else { 1.0 / root });
    }
    numbers.squash = numbers.squash.map(|x| x / (e * s));
    numbers.reach *= s / root;
    numbers.middle_mm = numbers.middle_mm.map(|x| x * s);
    numbers.first_touch_mm = numbers.first_touch_mm.map(|x| x * s);
    numbers.depth_max_mm *= s;
    let law = &mut numbers.law;
    law.stiffening = [law.stiffening[0] * e, law.stiffening[1] / (s * s)];
    law.flattening_mpa = law.flattening_mpa.map(|x| x * e);
    law.friction[0] *= lambda;
    for axis in &mut law.lift {
        for (k, x) in axis.iter_mut().enumerate() {
            // Products of two translations, of a translation and a rotation, of two rotations.
            *x *= [1.0 / s, 1.0 / s, s, 1.0 / s, 1.0, 1.0, 1.0 / s, s, s, 1.0, 1.0, s][k];
        }
    }
    let other = other.pad();
    assert!((tuned.depth_max_mm() - other.numbers.depth_max_mm).abs() < 1e-6);
    let body = Sphere::new(12.0).unwrap();
    let mut states = [&tuned, &other].map(|pad| PadState::<N, f64>::over(pad, [30.0, 0.0]).unwrap());
    let mut largest = [0.0f64; 3];
    for k in 0..60 {
        let x = if k % 30 < 20 { 0.05 } else { -0.06 };
        let motion = Motion {
            depth_mm: 0.9 + 0.01 * f64::from(k),
            slide_increment_mm: [x, 0.02],
            spin_increment_rad: 0.01,
            dt_s: 1e-3,
        };
        let pose = [30.0 + 0.2 * f64::from(k), 3.0];
        let [before, after] = &mut states;
        let a = tuned.step(before, &body, motion, pose);
        let b = other.step(after, &body, motion, pose);
        let limit = b.friction_limit_n;
        largest[0] = largest[0].max((a.normal_force_n - b.normal_force_n).abs() / b.normal_force_n);
        for k in 0..2 {
            largest[1] = largest[1].max((a.friction_n[k] - b.friction_n[k]).abs() / limit);
            largest[1] = largest[1].max((a.pressure_centre_mm[k] - b.pressure_centre_mm[k]).abs() / 10.0);
        }
        largest[2] = largest[2].max((a.spin_moment_n_mm - b.spin_moment_n_mm).abs() / (limit * 5.0));
        assert_eq!(a.regime, b.regime, "{k}");
    }
    assert!(largest.iter().all(|x| *x < 2e-3), "{largest:?}");
    for (tuning, what) in [
        (Tuning { size: 3.0, ..tuning }, crate::error::Field::Size),
        (Tuning { stiffness: f32::NAN, ..tuning }, crate::error::Field::Stiffness),
        (Tuning { lambda: 0.0, ..tuning }, crate::error::Field::Lambda),
    ] {
        assert!(matches!(pad.tuned(tuning), Err(crate::Error::Range { what: found, .. }) if found == what));
    }
}

/// After a long slide or spin, friction and moment are the point of the limit surface of that motion. No other motion takes more work from
/// them than from its own point.
#[test]
fn full_slip_ends_on_the_limit_surface() {
    let example = ExamplePad::new().cast::<f64>();
    let orthotropic = example.pad().with_orthotropy(Orthotropy::new(0.6, 35.0).unwrap().cast());
    let motion = |[x, y, spin]: [f64; 3]| Motion {
        depth_mm: 1.0,
        slide_increment_mm: [x, y],
        spin_increment_rad: spin,
        dt_s: 1e-3,
    };
    let steps = [[0.05, 0.0, 0.0], [-0.02, 0.04, 0.0], [0.0, 0.0, 0.02], [0.01, 0.0, 0.02]];
    for (pad, step) in [example.pad(), orthotropic].into_iter().flat_map(|pad| steps.map(|step| (pad, step))) {
        let mut state = PadState::<N, f64>::new(&pad).unwrap();
        assert_eq!(pad.full_slip(&state, &Plane, step), [0.0; 3]);
        let mut last = Response::default();
        for _ in 0..200 {
            last = pad.step(&mut state, &Plane, motion(step), [30.0, 0.0]);
        }
        // The spin of the motion is about the point under first touch.
        let limit = pad.full_slip(&state, &Plane, step);
        let found = [last.friction_n[0], last.friction_n[1], last.spin_moment_n_mm];
        let scale = [last.friction_limit_n, last.friction_limit_n, 3.0 * last.friction_limit_n];
        for k in 0..3 {
            assert!((found[k] - limit[k]).abs() < 0.02 * scale[k], "{step:?}: {found:?} {limit:?}");
        }
        // The work along any motion is at most that of the limit surface.
        for of in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [-1.0, 0.3, -0.5], [0.0, 0.0, 1.0]] {
            let most = pad.full_slip(&state, &Plane, of);
            let work = |f: &[f64; 3]| f[0] * of[0] + f[1] * of[1] + f[2] * of[2];
            assert!(work(&found) <= work(&most) * (1.0 + 1e-3) + 1e-9, "{step:?} {of:?}");
        }
    }
    assert_eq!(orthotropic.full_slip(&PadState::<N, f64>::new(&orthotropic).unwrap(), &Plane, [0.0; 3]), [0.0; 3]);
}
