//! Tissue that relaxes: the shipped pad and the shipped bed with branches, against closed forms.

use crate::common::{Double, Noise, example, shipped, shipped_pad};
use fingerpad::build::{DataOf, Node, ParamsOf};
use fingerpad::pad::{Body, Memory, PadState, Plane, RelaxingPadState, Sphere};
use fingerpad::{
    BedMemory, Branch, Elementary, ForceStateOf, Model, ModelOf, Motion, Regime, Relaxation, RelaxingState,
    RelaxingStateOf, Response, SPRINGS, Scalar, StateOf,
};

pub const P: usize = 40;
pub const POSE_DEG: [f32; 2] = [30.0, 0.0];

pub fn press<T: Scalar>(depth_mm: T, dt_s: T) -> Motion<T> {
    Motion { depth_mm, dt_s, ..Motion::default() }
}

/// A finger on a surface so rough that all of it sticks: one step to a depth, mm, in a time, s.
fn pressed<'a, M: Memory<P, T> + 'a, T: Elementary, B: fingerpad::pad::Surface<T>>(
    pad: &'a fingerpad::pad::Pad<'a, T>,
    body: &'a B,
    state: PadState<P, T, M>,
) -> impl FnMut(T, T) -> Response<T> + 'a {
    let mut state = rough(state);
    move |depth, dt_s| pad.step(&mut state, body, press(depth, dt_s), POSE_DEG.map(T::of))
}

/// The same of a bed.
fn bed_pressed<'a, const N: usize, T: Elementary>(
    model: &'a ModelOf<'a, SPRINGS, N, T>,
) -> impl FnMut(T, T) -> Response<T> + 'a {
    let mut state = RelaxingStateOf::<SPRINGS, 1, T>::relaxing();
    state.set_strength_factor(T::of(5.0));
    move |depth, dt_s| model.step(&mut state, press(depth, dt_s))
}

/// The same bed without time.
pub fn slow_bed<'a, const N: usize, T: Elementary>(
    model: &'a ModelOf<'a, SPRINGS, N, T>,
) -> impl FnMut(T, T) -> Response<T> + 'a {
    let mut state = StateOf::<SPRINGS, 1, T>::default();
    state.set_strength_factor(T::of(5.0));
    move |depth, dt_s| model.step(&mut state, press(depth, dt_s))
}

/// Sum of shares times what `of` makes of a time.
pub fn sum(of: impl Fn(f64) -> f64) -> f64 {
    Relaxation::HUMAN_ASSUMED.branches().iter().map(|b| f64::from(b.share) * of(f64::from(b.time_s))).sum()
}

/// A finger in the air on a surface so rough that all of it sticks: slip in a press depends on its speed.
fn rough<M: Memory<P, T>, T: Elementary>(mut state: PadState<P, T, M>) -> PadState<P, T, M> {
    state.set_strength_factor(T::half_turn() + T::half_turn());
    state
}

/// Slides, presses, turns and tilts.
pub fn disturbed(steps: usize, seed: u64) -> Vec<(Motion, [f32; 2])> {
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

/// The same of beds, with spin and without, and of their forces alone; a branch of share 0 is none.
#[test]
fn without_branches_and_long_after_their_times_a_bed_gives_the_bits_of_relaxed_tissue() {
    fn check<const S: usize>(model: &Model<'_>, timed: &Model<'_>, dt_s: f32) {
        let (mut plain, mut relaxing) = (StateOf::<SPRINGS, S>::default(), RelaxingState::<S>::relaxing());
        let (mut touched, mut random) = (0, Noise(4));
        for (k, (motion, _)) in disturbed(4000, 3).into_iter().enumerate() {
            if k % 100 == 0 {
                let factor = 1.0 + 0.5 * random.next();
                plain.set_strength_factor(factor);
                relaxing.set_strength_factor(factor);
            }
            let slide = motion.slide_increment_mm.map(|s| 3.0 * s);
            let motion = Motion { slide_increment_mm: slide, ..motion };
            let a = model.step(&mut plain, motion);
            let b = timed.step(&mut relaxing, Motion { dt_s, ..motion });
            assert_eq!(format!("{a:?}"), format!("{b:?}"), "{dt_s} step {k}");
            touched += usize::from(a.regime != Regime::NoContact);
        }
        assert!(touched > 2000, "{touched}");
    }
    let zero = Relaxation::new(&[Branch { share: 0.0, time_s: 1.0 }]).unwrap();
    for data in [shipped(), example()] {
        let model = data.model().unwrap();
        assert!(model.with_relaxation(&zero).unwrap().relaxation().is_none());
        let timed = model.with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
        for (timed, dt_s) in [(&model, 1e-3), (&timed, 1000.0)] {
            check::<1>(&model, timed, dt_s);
            check::<2>(&model, timed, dt_s);
        }
        // Forces alone are those of a step.
        let (mut whole, mut forces) =
            (RelaxingState::<1>::relaxing(), ForceStateOf::<SPRINGS, 1, f32, BedMemory<SPRINGS>>::default());
        for (motion, _) in disturbed(2000, 5) {
            let a = timed.step(&mut whole, Motion { spin_increment_rad: 0.0, ..motion });
            let b = timed.step_forces(&mut forces, Motion { spin_increment_rad: 0.0, ..motion });
            assert_eq!(
                (a.normal_force_n, a.friction_n, a.slip_margin),
                (b.normal_force_n, b.friction_n, b.slip_margin)
            );
        }
    }
}

/// Pressed at once and held, the force falls as 1 plus the sum of the shares times exp(-t / time); the area stays, and the limit follows the
/// pressure.
///
/// * `most`: largest relative error
fn check_hold<T: Elementary>(
    name: &str,
    [depth, beta]: [T; 2],
    relaxed: &Response<T>,
    mut go: impl FnMut(T, T) -> Response<T>,
    most: f64,
) {
    let over_relaxed = |part: fn(&Response<T>) -> T, r: &Response<T>| (part(r) / part(relaxed)).to_f64();
    let mut response = go(depth, T::of(1e-7));
    let (mut t, mut dt) = (T::of(1e-7).to_f64(), 2e-4f32);
    while t < 20.0 {
        let over = sum(|time| (-t / time).exp()) + 1.0;
        let found = over_relaxed(|r| r.normal_force_n, &response);
        assert!((found / over - 1.0).abs() < most, "{name}, {t} s: {found}, exact {over}");
        let limit = over_relaxed(|r| r.friction_limit_n, &response);
        assert!((limit / over.powf(beta.to_f64()) - 1.0).abs() < most, "{name}, {t} s: limit {limit}");
        let area = over_relaxed(|r| r.contact_area_mm2, &response);
        assert!((area - 1.0).abs() < most, "{name}, {t} s: area {area}");
        // The friction of now over the limit that is left.
        let one = T::of(1.0);
        let used = (one - response.slip_margin).to_f64() * limit;
        let told = (one - response.slip_margin_relaxed).to_f64();
        assert!((told - used).abs() <= most * used + 1e-7, "{name}, {t} s: {told}, exact {used}");
        response = go(depth, T::of(dt));
        t += T::of(dt).to_f64();
        dt = (dt * 1.05).min(0.1);
    }
}

#[test]
fn a_held_press_relaxes_as_its_branches_do() {
    let file = shipped_pad();
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let [_, beta] = pad.numbers.law.friction;
    for (depth, body) in [(0.6, Body::Plane), (1.5, Body::Plane), (1.5, Body::Sphere(Sphere::new(12.0).unwrap()))] {
        let relaxed = pressed(&pad, &body, PadState::<P>::new(&pad).unwrap())(depth, 1.0);
        // On a ball the anchors go round with the surface.
        let (most, at_last) = if body == Body::Plane { (3e-3, 1e-3) } else { (1e-2, 1e-2) };
        let mut state = rough(RelaxingPadState::<P>::relaxing(&pad).unwrap());
        let mut go = |depth, dt_s| pad.step(&mut state, &body, press(depth, dt_s), POSE_DEG);
        check_hold(&format!("{body:?} {depth} mm"), [depth, beta], &relaxed, &mut go, most);
        // Long after, nothing changes any more, and the steps cost nothing.
        let mut response = go(depth, 0.1);
        for _ in 0..400 {
            response = go(depth, 0.1);
        }
        let rests = state;
        for dt_s in [1e-4, 1e-3, 10.0] {
            assert_eq!(pad.step(&mut state, &body, press(depth, dt_s), POSE_DEG), response);
        }
        assert_eq!(state, rests);
        assert!((response.normal_force_n / relaxed.normal_force_n - 1.0).abs() < at_last, "{response:?} {relaxed:?}");
    }
}

#[test]
fn a_held_press_of_a_bed_relaxes_as_its_branches_do() {
    let (data, relaxation) = (shipped().cast::<f64>(), Relaxation::HUMAN_ASSUMED.cast());
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    for depth in [0.3, 1.5] {
        let relaxed = slow_bed(&model)(depth, 1.0);
        let go = bed_pressed(&model);
        check_hold(&format!("bed, {depth} mm"), [depth, data.pressure_exponent], &relaxed, go, 1e-10);
    }
    // In single precision the bits come to rest.
    let data = shipped();
    let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    let relaxed = slow_bed(&model)(1.5, 1.0);
    let mut state = RelaxingState::<1>::relaxing();
    state.set_strength_factor(5.0);
    let mut go = |depth, dt_s| model.step(&mut state, press(depth, dt_s));
    check_hold("bed in f32", [1.5, data.pressure_exponent], &relaxed, &mut go, 1e-5);
    for _ in 0..400 {
        go(1.5, 0.1);
    }
    let (rests, response) = (state, model.step(&mut state, press(1.5, 0.1)));
    for _ in 0..10 {
        assert_eq!(model.step(&mut state, press(1.5, 0.1)), response);
    }
    assert_eq!(state, rests);
}

/// One spring, slid at once and held: its force is that of its stretch times 1 plus the sum of the shares times exp(-t / time).
#[test]
fn a_held_slide_of_a_bed_relaxes_as_its_branches_do() {
    let mut data = shipped().cast::<f64>();
    data.odd = 0.0;
    let relaxation = Relaxation::HUMAN_ASSUMED.cast();
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    let mut state = RelaxingStateOf::<SPRINGS, 2, f64>::relaxing();
    state.set_strength_factor(5.0);
    model.step(&mut state, press(1.2, 1e-7));
    for _ in 0..400 {
        model.step(&mut state, press(1.2, 0.1));
    }
    let slide = [0.03, -0.02];
    let moved = Motion { depth_mm: 1.2, slide_increment_mm: slide, spin_increment_rad: 2e-3, dt_s: 1e-7 };
    let mut slow = StateOf::<SPRINGS, 2, f64>::default();
    slow.set_strength_factor(5.0);
    model.step(&mut slow, press(1.2, 1.0));
    let relaxed = model.step(&mut slow, moved);
    let mut r = model.step(&mut state, moved);
    let (mut t, mut dt) = (1e-7, 2e-4);
    while t < 20.0 {
        let over = sum(|time| (-t / time).exp()) + 1.0;
        for (now, relaxed) in r.friction_n.iter().zip(relaxed.friction_n) {
            assert!((now / relaxed / over - 1.0).abs() < 1e-10, "{t} s: {now} {relaxed}, exact {over}");
        }
        assert!((r.spin_moment_n_mm / relaxed.spin_moment_n_mm / over - 1.0).abs() < 1e-10, "{t} s: {r:?}");
        assert_eq!(r.regime, Regime::Stick);
        // Friction and moment of now over the limits that are left.
        let (used, told) = (1.0 - r.slip_margin, 1.0 - r.slip_margin_relaxed);
        let gain = r.friction_limit_n / relaxed.friction_limit_n;
        assert!((told / used / gain - 1.0).abs() < 1e-10 && r.spin_moment_n_mm.abs() > 0.03, "{t} s: {r:?}");
        r = model.step(&mut state, press(1.2, dt));
        t += dt;
        dt = (dt * 1.05).min(0.1);
    }
}

/// A branch is not held up by rounding: with steps of a hundred-thousandth of its time it forgets all the same.
fn check_small_steps(name: &str, relaxed_n: f32, mut go: impl FnMut(f32, f32) -> Response) {
    let mut force = 0.0;
    // 2 s, ten times the time.
    for _ in 0..200_000 {
        force = go(1.0, 1e-5).normal_force_n;
    }
    assert!((force / relaxed_n - 1.0).abs() < 5e-4, "{name}: {force} {relaxed_n}");
}

#[test]
fn small_steps_do_not_stop_a_slow_branch() {
    let slow = Relaxation::new(&[Branch { share: 1.0, time_s: 0.2 }]).unwrap();
    let (file, data) = (shipped_pad(), shipped());
    let pad = file.file().pad.with_relaxation(slow);
    let relaxed = pressed(&pad, &Plane, PadState::<P>::new(&pad).unwrap())(1.0, 1.0).normal_force_n;
    check_small_steps("pad", relaxed, pressed(&pad, &Plane, RelaxingPadState::<P>::relaxing(&pad).unwrap()));
    let model = data.model().unwrap().with_relaxation(&slow).unwrap();
    check_small_steps("bed", slow_bed(&model)(1.0, 1.0).normal_force_n, bed_pressed(&model));
}

/// A ramp of depth: the hereditary integral over the quasi-static curve.
fn check_ramp(
    name: &str,
    mm_per_s: f32,
    mut slow: impl FnMut(f32, f32) -> Response,
    mut go: impl FnMut(f32, f32) -> Response,
) {
    const STEPS: usize = 2000;
    let depth = |k: usize| 1.2 * k as f32 / STEPS as f32;
    let dt = 1.2 / STEPS as f32 / mm_per_s;
    let mut before = 0.0;
    let mut late = [0.0; 3];
    for k in 1..=STEPS {
        let relaxed = f64::from(slow(depth(k), dt).normal_force_n);
        let found = f64::from(go(depth(k), dt).normal_force_n);
        let mut exact = relaxed;
        for (late, branch) in late.iter_mut().zip(Relaxation::HUMAN_ASSUMED.branches()) {
            // Part of the force of a branch that is left, for a force that rises evenly within the step.
            let x = f64::from(dt) / f64::from(branch.time_s);
            *late = *late * (-x).exp() + (relaxed - before) * (1.0 - (-x).exp()) / x;
            exact += f64::from(branch.share) * *late;
        }
        before = relaxed;
        // Near first touch the normal force of a pad is not that of the patches.
        if k > STEPS / 2 {
            let off = (found / exact - 1.0).abs();
            assert!(off < 5e-3, "{name}, {mm_per_s} mm/s, {} mm: {found}, exact {exact}", depth(k));
        }
    }
    let rise = before;
    let faster =
        late.iter().zip(Relaxation::HUMAN_ASSUMED.branches()).map(|(l, b)| l * f64::from(b.share)).sum::<f64>();
    assert!(faster > if mm_per_s < 0.5 { 0.02 * rise } else { 0.2 * rise });
}

/// For speeds over four decades.
#[test]
fn a_ramp_is_the_integral_over_its_past() {
    let (file, data) = (shipped_pad(), shipped());
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    for mm_per_s in [0.1f32, 1.0, 10.0, 100.0, 1000.0] {
        let slow = pressed(&pad, &Plane, PadState::<P>::new(&pad).unwrap());
        check_ramp("pad", mm_per_s, slow, pressed(&pad, &Plane, RelaxingPadState::<P>::relaxing(&pad).unwrap()));
        check_ramp("bed", mm_per_s, slow_bed(&model), bed_pressed(&model));
    }
}

/// Nodes of the tables of a bed whose normal force is that of a sphere.
const HERTZ: usize = 1001;

/// A bed with the normal force d^1.5, N, at depths d up to 2 mm: Hertz's sphere.
fn hertz() -> Box<DataOf<SPRINGS, HERTZ, f64>> {
    let mut params = Box::new(ParamsOf::<SPRINGS, HERTZ>::example_with([(0.25, 0.0); SPRINGS]));
    params.depth_max_mm = 2.0;
    for (i, node) in params.nodes.iter_mut().enumerate() {
        let depth = 2.0 * i as f32 / (HERTZ - 1) as f32;
        *node = Node { normal_force_n: depth.powf(1.5), ..*node };
    }
    Box::new(params.build_unchecked().cast())
}

/// Dawson's integral exp(-y²) times the integral of exp(t²) from 0 to y.
fn dawson(y: f64) -> f64 {
    integral(0.0, y, |t| (t * t - y * y).exp())
}

/// By Simpson's rule.
fn integral(from: f64, to: f64, of: impl Fn(f64) -> f64) -> f64 {
    const PARTS: usize = 4000;
    let h = (to - from) / PARTS as f64;
    let weight = |k: usize| if k == 0 || k == PARTS { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
    (0..=PARTS).map(|k| weight(k) * of(from + h * k as f64)).sum::<f64>() * h / 3.0
}

/// A sphere pressed at constant speed: Lee and Radok (1960), J. Appl. Mech. 27 (1960) 438.
#[test]
fn a_sphere_is_pressed_as_lee_and_radok_say() {
    let (data, relaxation) = (hertz(), Relaxation::HUMAN_ASSUMED.cast());
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    for (steps, most) in [(200, 5e-3), (1000, 1.5e-3)] {
        for t_end in [1e-3, 0.02, 0.3, 5.0] {
            let mut go = bed_pressed(&model);
            let (speed, dt): (f64, f64) = (1.5 / t_end, t_end / f64::from(steps));
            let mut worst = 0.0f64;
            for k in 1..=steps {
                let t = dt * f64::from(k);
                let found = go(speed * t, dt).normal_force_n;
                if k % 50 == 0 {
                    let late = sum(|time| time.powf(1.5) * ((t / time).sqrt() - dawson((t / time).sqrt())));
                    let exact = speed.powf(1.5) * (t.powf(1.5) + 1.5 * late);
                    worst = worst.max((found - exact).abs());
                }
            }
            let peak = go(1.5, 1e-9).normal_force_n;
            println!("{steps} steps, {t_end} s: {:.5} of the peak", worst / peak);
            assert!(worst < most * peak, "{steps} steps, {t_end} s: {worst} of {peak}");
        }
    }
}

/// A sphere pressed and drawn back at the same speed: Ting (1966), J. Appl. Mech. 33 (1966) 845. In his solution each place of the contact
/// separates on its own; a bed has one gap.
#[test]
fn a_sphere_is_drawn_back_about_as_ting_says() {
    let (data, relaxation) = (hertz(), Relaxation::HUMAN_ASSUMED.cast());
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    let g = |t: f64| 1.0 + sum(|time| (-t / time).exp());
    for t_m in [2e-3, 0.05, 1.0] {
        let (speed, steps) = (1.5 / t_m, 1000);
        let dt = t_m / f64::from(steps);
        let mut go = bed_pressed(&model);
        let (mut peak, mut worst) = (0.0f64, 0.0f64);
        for k in 1..=2 * steps {
            let t = dt * f64::from(k);
            let depth = speed * if t <= t_m { t } else { 2.0 * t_m - t };
            let found = go(depth, dt).normal_force_n;
            peak = peak.max(found);
            if k <= steps || k % 40 != 0 {
                continue;
            }
            // The contact is that of the rising depth at t1.
            let back = integral(t_m, t, |s| g(t - s));
            let (mut low, mut high) = (0.0, t_m);
            for _ in 0..50 {
                let t1 = 0.5 * (low + high);
                if integral(t1, t_m, |s| g(t - s)) > back { low = t1 } else { high = t1 }
            }
            let all = integral(0.0, t_m, |s| g(t - s));
            // Substituting s = r² evens out the slope of the root at 0.
            let force = |t1: f64| integral(0.0, t1.sqrt(), |r| g(t - r * r) * 1.5 * r * 2.0 * r) * speed.powf(1.5);
            let exact = if all <= back { 0.0 } else { force(low) };
            worst = worst.max((found - exact).abs());
        }
        println!("{t_m} s: {:.4} of the peak", worst / peak);
        assert!(worst < 0.06 * peak, "{t_m} s: {worst} of {peak}");
    }
}

/// A small vibration of the depth: storage and loss of the force.
fn check_vibration(name: &str, hz: f64, mut go: impl FnMut(f64, f64) -> Response<f64>) {
    let mut go = |depth: f64, dt_s: f64| go(depth, dt_s).normal_force_n;
    let omega = core::f64::consts::TAU * hz;
    // The steps are short beside the shortest time too.
    let steps = (1000.0 / hz).max(400.0) as usize;
    let dt = 1.0 / (hz * steps as f64);
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
    println!("{name}, {hz} Hz: storage {:.5}, loss {:.4} of the exact one", storage / stored, loss / lost);
    assert!((storage / stored - 1.0).abs() < 0.01, "{name}, {hz} Hz: storage {storage}, exact {stored}");
    assert!((loss / lost - 1.0).abs() < 0.05, "{name}, {hz} Hz: loss {loss}, exact {lost}");
}

/// Over 0.1 to 100 Hz.
#[test]
fn a_vibration_stores_and_loses_as_its_branches_do() {
    let (double, data, relaxation) = (Double::new(), shipped().cast::<f64>(), Relaxation::HUMAN_ASSUMED.cast());
    let pad = double.pad().with_relaxation(relaxation);
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    for hz in [0.1, 1.0, 10.0, 100.0] {
        check_vibration("pad", hz, pressed(&pad, &Plane, RelaxingPadState::<P, f64>::relaxing(&pad).unwrap()));
        check_vibration("bed", hz, bed_pressed(&model));
    }
}

/// A static friction below its limit, relaxed, after small cycles of depth, slide or spin: it does not fall with their number.
fn check_cycles(many: u32) {
    let data = shipped().cast::<f64>();
    let relaxation = Relaxation::HUMAN_ASSUMED.cast();
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    for (name, size) in [("depth", [0.1, 0.0, 0.0]), ("slide", [0.0, 0.05, 0.0]), ("spin", [0.0, 0.0, 0.01])] {
        let mut state = RelaxingStateOf::<SPRINGS, 2, f64>::relaxing();
        let mut go = |depth, x, spin, dt_s| {
            let motion = Motion { depth_mm: depth, slide_increment_mm: [x, 0.0], spin_increment_rad: spin, dt_s };
            model.step(&mut state, motion)
        };
        for k in 1..=100 {
            go(0.01 * f64::from(k), 0.0, 0.0, 1e-3);
        }
        for _ in 0..60 {
            go(1.0, 0.01, 0.0, 1e-3);
        }
        for _ in 0..600 {
            go(1.0, 0.0, 0.0, 0.1);
        }
        let mut kept = [0.0; 2];
        let mut last = [0.0; 2];
        for cycle in 1..=many {
            let mut r = Response::default();
            for k in 1..=20 {
                let phase = (core::f64::consts::TAU * f64::from(k) / 20.0).sin();
                let [deeper, x, spin] = size.map(|size| size * phase);
                r = go(1.0 + deeper, x - last[0], spin - last[1], 2.5e-3);
                last = [x, spin];
            }
            if cycle == 100 {
                kept[0] = r.friction_n[0];
            }
            kept[1] = r.friction_n[0];
        }
        println!("{name}: {} N after 100 cycles, {} N after {many}", kept[0], kept[1]);
        assert!(kept[0] > 0.05 && (kept[1] / kept[0] - 1.0).abs() < 1e-3, "{name}: {kept:?}");
    }
}

#[test]
fn vibration_does_not_release_a_static_load() {
    check_cycles(1000);
}

#[test]
#[ignore = "nightly"]
fn vibration_does_not_release_a_static_load_in_1e5_cycles() {
    check_cycles(100_000);
}

/// The peak of a second press over that of the first, after a pause, s.
fn check_lag(name: &str, mut go: impl FnMut(f32, f32) -> Response) {
    let mut peak = |pause_s: f32| {
        let mut to = |from: f32, to: f32, dt: f32| {
            let mut r = Response::default();
            for k in 1..=100 {
                r = go(from + (to - from) * k as f32 / 100.0, dt);
            }
            r.normal_force_n
        };
        to(-0.1, -0.1, 1.0);
        let first = to(-0.1, 1.0, 1e-4);
        to(1.0, 1.0, 1e-2);
        assert_eq!(to(1.0, -0.1, 1e-4), 0.0);
        to(-0.1, -0.1, pause_s / 100.0);
        to(-0.1, 1.0, 1e-4) / first
    };
    let peaks = [0.01, 0.1, 1.0, 20.0].map(&mut peak);
    assert!(peaks.is_sorted() && peaks[0] < 0.75 && (peaks[3] - 1.0).abs() < 2e-3, "{name}: {peaks:?}");
}

#[test]
fn a_touch_soon_after_a_press_meets_skin_that_lags() {
    let (file, data) = (shipped_pad(), shipped());
    let pad = file.file().pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
    let mut state = RelaxingPadState::<P>::relaxing(&pad).unwrap();
    check_lag("pad", |depth, dt_s| pad.step(&mut state, &Plane, press(depth, dt_s), POSE_DEG));
    let model = data.model().unwrap().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    check_lag("bed", bed_pressed(&model));
}
