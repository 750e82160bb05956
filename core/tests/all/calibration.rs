//! Calibration on the device: fingers of known tuning, a finger of finite elements, and motions that do not suffice.

use crate::common::{Noise, models, motion};
use fingerpad::build::Data;
use fingerpad::calibration::{Calibrated, Calibration, Measured, NotCalibrated, Settings};
use fingerpad::{Model, Motion, Response, State, Tuning, step};

type Calibrator<'a> = Calibration<'a, 4, 37>;

/// What is wrong with the readings: noise of the forces, standard deviation in shares, a spike in every 97th reading, noise of
/// the depth, mm, and the depth at which the finger touches, mm.
#[derive(Clone, Copy, Debug, Default)]
struct Disturbance {
    noise: f32,
    spikes: bool,
    encoder_mm: f32,
    late_mm: f32,
}

/// The motions of the guide as corners (depth and slide along x, mm), with a turn in the slide.
const GUIDE: &[[f32; 2]] =
    &[[0.6, 0.0], [-0.2, 0.0], [1.8, 0.0], [-0.2, 0.0], [1.0, 0.0], [1.0, 6.0], [1.0, 3.0], [1.0, 4.0]];

/// Goes along the corners in steps of 1 um from the air.
fn along(corners: &[[f32; 2]], mut each: impl FnMut(Motion)) {
    let mut here = [-0.2f32, 0.0];
    for to in corners {
        let n = (1000.0 * (to[0] - here[0]).abs().max((to[1] - here[1]).abs())).ceil().max(1.0);
        let by = [(to[0] - here[0]) / n, (to[1] - here[1]) / n];
        for i in 1..=n as u32 {
            each(motion(here[0] + by[0] * i as f32, by[1], 0.0));
        }
        here = *to;
    }
}

/// A calibration of a finger of that tuning along the corners.
fn calibrate<'a>(
    model: &Model<'a>,
    truth: Tuning,
    corners: &[[f32; 2]],
    disturbance: Disturbance,
    settings: Settings,
) -> Calibrator<'a> {
    let finger = model.tuned(truth).unwrap();
    let (mut state, mut noise, mut count) = (State::default(), Noise(7), 0u32);
    let mut calibration = Calibrator::new(model, settings);
    along(corners, |m| {
        let r = step(&finger, &mut state, Motion { depth_mm: m.depth_mm - disturbance.late_mm, ..m });
        count += 1;
        let spike = if disturbance.spikes && count.is_multiple_of(97) { 3.0 * noise.next() } else { 0.0 };
        // Uniform noise has 1/√3 of its half-width as standard deviation.
        let mut reading = |force: f32| force * (1.0 + disturbance.noise * 3.0f32.sqrt() * noise.next()) + spike;
        let friction_n = r.friction_n.map(&mut reading);
        let measured = Measured { normal_force_n: reading(r.normal_force_n), friction_n };
        calibration.step(Motion { depth_mm: m.depth_mm + disturbance.encoder_mm * noise.next(), ..m }, measured);
    });
    settle(calibration)
}

/// The idle time after the motions.
fn settle(mut calibration: Calibrator<'_>) -> Calibrator<'_> {
    for _ in 0..40 * 160 {
        if calibration.result() != Err(NotCalibrated::Unsettled) {
            break;
        }
        calibration.work();
    }
    calibration
}

/// Largest errors of normal force and friction of a model against another along a path that the calibration has not seen, shares
/// of the largest force.
fn unseen(found: &Model<'_>, truth: &Model<'_>) -> [f32; 2] {
    let path: &[[f32; 2]] = &[[1.4, 0.0], [1.4, -2.0], [0.8, -1.0], [0.8, 2.0], [1.2, 2.0], [1.2, 1.0]];
    let (mut a, mut b) = (State::default(), State::default());
    let (mut most, mut apart) = ([0.0f32; 2], [0.0f32; 2]);
    along(path, |m| {
        let forces = |r: Response| [r.normal_force_n, r.friction_n[0]];
        let (found, true_) = (forces(step(found, &mut a, m)), forces(step(truth, &mut b, m)));
        for k in 0..2 {
            most[k] = most[k].max(true_[k].abs());
            apart[k] = apart[k].max((found[k] - true_[k]).abs());
        }
    });
    [apart[0] / most[0], apart[1] / most[1]]
}

fn tuning([size, stiffness, lambda]: [f32; 3]) -> Tuning {
    Tuning { size, stiffness, lambda }
}

/// The table: errors of what was found, and of forces on a path not seen, clean beside disturbed.
#[test]
fn fingers_are_found_through_noise_spikes_turns_and_a_late_touch() {
    let truths = [[1.0, 1.0, 1.0], [1.2, 1.5, 0.7], [0.8, 0.6, 1.6], [1.0, 3.0, 0.5], [0.85, 2.0, 3.0]];
    let clean = Disturbance::default();
    let late = Disturbance { noise: 0.01, late_mm: 0.08, ..clean };
    // Bounds on size, stiffness, lambda, offset in mm, and unseen forces.
    let cases = [
        ("clean", clean, [0.035, 0.025, 0.025, 0.01, 0.02]),
        (
            "1 %, encoder 1 um",
            Disturbance { noise: 0.01, encoder_mm: 0.001, ..clean },
            [0.035, 0.025, 0.025, 0.01, 0.02],
        ),
        (
            "5 %, encoder 1 um",
            Disturbance { noise: 0.05, encoder_mm: 0.001, ..clean },
            [0.035, 0.025, 0.025, 0.012, 0.02],
        ),
        ("1 %, touch 80 um late", late, [0.035, 0.025, 0.025, 0.012, 0.02]),
        (
            "5 %, late, spikes, encoder 5 um",
            Disturbance { noise: 0.05, encoder_mm: 0.005, spikes: true, late_mm: 0.08 },
            [0.07, 0.03, 0.05, 0.015, 0.04],
        ),
    ];
    let mut beyond = vec![];
    println!("model, truth, case: size, stiffness, lambda in % off (standard error); offset um; unseen N, F in %");
    for (name, data) in models() {
        let model = data.model().unwrap();
        for (truth, (case, disturbance, bounds)) in truths.iter().flat_map(|t| cases.iter().map(move |c| (t, c))) {
            let calibration = calibrate(&model, tuning(*truth), GUIDE, *disturbance, Settings::default());
            let found = calibration.result().unwrap_or_else(|e| panic!("{name} {truth:?} {case}: {e}"));
            let Tuning { size, stiffness, lambda, .. } = found.tuning;
            let off = [size / truth[0], stiffness / truth[1], lambda / truth[2]].map(|x| x - 1.0);
            let offset = found.depth_offset_mm + disturbance.late_mm;
            let [n, f] = unseen(&calibration.model().unwrap(), &model.tuned(tuning(*truth)).unwrap());
            let percent = off.map(|x| 100.0 * x);
            let errors = found.tuning_error.map(|x| 100.0 * x);
            println!(
                "{name} {truth:?} {case:32} {percent:5.1?} ({errors:.1?}) {:5.1} ({:.1}) {:.1} {:.1}",
                1e3 * offset,
                1e3 * found.depth_offset_error_mm,
                100.0 * n,
                100.0 * f
            );
            let all = [off[0], off[1], off[2], offset, n.max(f)];
            if all.iter().zip(bounds).any(|(x, bound)| x.abs() > *bound) {
                beyond.push(format!("{name} {truth:?} {case}: {all:?} {bounds:?}"));
            }
        }
    }
    assert!(beyond.is_empty(), "{beyond:#?}");
}

/// The standard errors are those that repetitions show, within a factor of three, and the mean is off by less.
#[test]
fn standard_errors_are_those_of_repetitions() {
    let data: Data = models().pop().unwrap().1;
    let model = data.model().unwrap();
    let truth = tuning([1.1, 1.4, 0.8]);
    let finger = model.tuned(truth).unwrap();
    let mut sums = [[0.0f64; 2]; 3];
    let mut reported = [0.0f64; 3];
    let repetitions = 12;
    for seed in 0..repetitions {
        let (mut state, mut noise) = (State::default(), Noise(1000 + seed));
        let mut calibration = Calibrator::new(&model, Settings::default());
        along(GUIDE, |m| {
            let r = step(&finger, &mut state, m);
            let mut reading = |force: f32| force * (1.0 + 0.2 * noise.next());
            let friction_n = r.friction_n.map(&mut reading);
            calibration.step(m, Measured { normal_force_n: reading(r.normal_force_n), friction_n });
        });
        let found = settle(calibration).result().unwrap();
        let values = [found.tuning.size / 1.1, found.tuning.stiffness / 1.4, found.tuning.lambda / 0.8];
        for k in 0..3 {
            let off = f64::from(values[k]) - 1.0;
            sums[k] = [sums[k][0] + off, sums[k][1] + off * off];
            reported[k] += f64::from(found.tuning_error[k]) / repetitions as f64;
        }
    }
    for k in 0..3 {
        let mean = sums[k][0] / repetitions as f64;
        let deviation = (sums[k][1] / repetitions as f64 - mean * mean).sqrt();
        println!("unknown {k}: mean off {mean:.4}, deviation {deviation:.4}, reported {:.4}", reported[k]);
        // The reported error allows for the model's own, which is the same in each repetition.
        assert!(
            deviation < 1.5 * reported[k] && mean.abs() < 2.5 * reported[k] && reported[k] < 0.06,
            "{k} {mean} {deviation} {reported:?}"
        );
    }
}

/// Rows of depth, slide x, slide y, normal force, friction x, friction y: a press, one with a slide that turns, one with a long slide; then what
/// the calibration does not see.
fn finite_elements() -> [Vec<[f32; 6]>; 2] {
    let mut parts = [vec![], vec![]];
    let mut names = 0;
    for line in include_str!("../data/calibration-fe.csv").lines().filter(|line| !line.starts_with('#')) {
        if line.starts_with("depth_mm") {
            names += 1;
        } else {
            let numbers: Vec<f32> = line.split(',').map(|x| x.parse().unwrap()).collect();
            parts[names - 1].push(numbers.try_into().unwrap());
        }
    }
    parts
}

/// Root mean square errors of normal force and friction of a model on the rows, shares of the largest; lengths of the rows times
/// `size`, forces times `force`.
fn apart(model: &Model<'_>, rows: &[[f32; 6]], size: f32, force: f32) -> [f32; 2] {
    let mut state = State::default();
    let (mut square, mut most) = ([0.0f32; 2], [0.0f32; 2]);
    for pair in rows.windows(2) {
        let by = [1, 2].map(|i| size * (pair[1][i] - pair[0][i]));
        let r = step(model, &mut state, motion(size * pair[1][0], by[0], by[1]));
        let [n, x, y] = [3, 4, 5].map(|i| force * pair[1][i]);
        let off = [r.normal_force_n - n, (r.friction_n[0] - x).hypot(r.friction_n[1] - y)];
        for (k, force) in [n, x.hypot(y)].into_iter().enumerate() {
            square[k] += off[k] * off[k] / (rows.len() - 1) as f32;
            most[k] = most[k].max(force);
        }
    }
    [square[0].sqrt() / most[0], square[1].sqrt() / most[1]]
}

/// Finite elements of the model's finger, made another finger by the rules of similarity: lengths times s, stresses times e, so
/// forces times e s², and lambda times e^(1 − beta).
#[test]
fn a_finger_of_finite_elements_is_found() {
    let (name, data) = models().pop().unwrap();
    assert_eq!(name, "shipped");
    let model = data.model().unwrap();
    let [seen, unseen] = finite_elements();
    let disturbances =
        [("clean", 0.0, 0.0), ("1 %, touch 60 um late", 0.01, 0.06), ("5 %, touch 60 um late", 0.05, 0.06)];
    for (size, stiffness) in [(1.0f32, 1.0f32), (1.25, 0.7), (0.8, 2.0)] {
        let lambda = stiffness.powf(1.0 - data.pressure_exponent);
        let force = stiffness * size * size;
        for (case, noise_share, late_mm) in disturbances {
            let mut noise = Noise(5);
            let mut calibration = Calibrator::new(&model, Settings::default());
            for pair in seen.windows(2) {
                // Rows lie some 50 um apart: a device has readings in between.
                // Between the runs the finger leaves at once.
                let parts = if pair[1][0] < -0.05 { 1 } else { 16 };
                let at = |i: usize, part: i32| pair[0][i] + (pair[1][i] - pair[0][i]) * part as f32 / parts as f32;
                for part in 1..=parts {
                    let by = [1, 2].map(|i| size * (at(i, part) - at(i, part - 1)));
                    let mut reading = |i| force * at(i, part) * (1.0 + noise_share * 3.0f32.sqrt() * noise.next());
                    let measured = Measured { normal_force_n: reading(3), friction_n: [reading(4), reading(5)] };
                    calibration.step(motion(size * at(0, part) + late_mm, by[0], by[1]), measured);
                }
            }
            let calibration = settle(calibration);
            let found =
                calibration.result().unwrap_or_else(|e| panic!("{size} {case}: {e} {:?}", calibration.estimate()));
            let Tuning { size: s, stiffness: e, lambda: l, .. } = found.tuning;
            let off = [s / size, e / stiffness, l / lambda].map(|x| 100.0 * (x - 1.0));
            let errors = found.tuning_error.map(|e| 100.0 * e);
            let [n, f] = apart(&calibration.model().unwrap(), &unseen, size, force);
            let untuned = apart(&model.tuned(Tuning::default()).unwrap(), &unseen, size, force);
            println!(
                "size {size} stiffness {stiffness} {case:22} {off:5.1?} % ({errors:.1?}), offset {:.3} mm ({:.3}), unseen rms {n:.4} {f:.4}, untuned {untuned:.3?}",
                found.depth_offset_mm, found.depth_offset_error_mm
            );
            assert!(off.iter().all(|x| x.abs() < 10.0), "{size} {case}: {off:?}");
            assert!((found.depth_offset_mm + late_mm).abs() < 0.02, "{size} {case}: {found:?}");
            assert!(n < 0.015 && f < 0.03, "{size} {case}: {n} {f}");
        }
    }
}

#[test]
fn motions_that_do_not_suffice_are_named() {
    use NotCalibrated::{FewPresses, NoContact, NoSlip, OneDepth, OutOfRange, Uncertain};
    for (name, data) in models() {
        let model = data.model().unwrap();
        let truth = tuning([1.1, 1.3, 0.8]);
        let known = Settings { depth_offset_mm: 0.0, ..Settings::default() };
        let run = |corners, settings| calibrate(&model, truth, corners, Disturbance::default(), settings).result();
        assert_eq!(run(&[[-0.1, 5.0]], known), Err(NoContact), "{name}");
        let few = run(&[[1.5, 0.0], [1.5, 6.0]], known);
        assert_eq!(few, Err(FewPresses { presses: 1, needed: 2 }), "{name}");
        let few = run(&[[1.5, 0.0], [-0.1, 0.0], [0.8, 0.0], [0.8, 6.0]], Settings::default());
        assert_eq!(few, Err(FewPresses { presses: 2, needed: 3 }), "{name}");
        let short = run(&[[1.5, 0.0], [-0.1, 0.0], [1.0, 0.0], [1.0, 0.3]], known);
        assert!(matches!(short, Err(NoSlip { slipped_mm }) if slipped_mm < 0.2), "{name} {short:?}");
        let pressed = run(&[[1.5, 0.0], [-0.1, 0.0], [1.0, 0.0]], known);
        assert!(matches!(pressed, Err(NoSlip { .. })), "{name} {pressed:?}");
        let sufficed = run(&[[1.5, 0.0], [-0.1, 0.0], [1.0, 0.0], [1.0, 6.0]], known).unwrap();
        assert!((sufficed.tuning.lambda / truth.lambda - 1.0).abs() < 0.06, "{name} {sufficed:?}");
        assert!(sufficed.depth_offset_mm.abs() < 1e-6, "{name} {sufficed:?}");
        // Wanted better than the band of the model lets one know.
        let strict = run(&[[1.5, 0.0], [-0.1, 0.0], [1.0, 0.0], [1.0, 6.0]], Settings { wanted: 1e-3, ..known });
        assert!(matches!(strict, Err(Uncertain { .. })), "{name} {strict:?}");

        // Two fingers that appear at their depth.
        let mut calibration = Calibrator::new(&model, known);
        let measured = Measured { normal_force_n: 0.5, friction_n: [0.0; 2] };
        for _ in 0..2 {
            calibration.step(motion(-0.1, 0.0, 0.0), Measured::default());
            for i in 0..400 {
                calibration.step(motion(1.0 + 1e-4 * i as f32, 0.0, 0.0), measured);
            }
        }
        let one = settle(calibration).result();
        assert!(matches!(one, Err(OneDepth { shallowest_mm, .. }) if shallowest_mm > 0.9), "{name} {one:?}");

        // Forces in other units.
        let (mut state, mut calibration) = (State::default(), Calibrator::new(&model, known));
        along(GUIDE, |m| {
            let r = step(&model, &mut state, m);
            let friction_n = r.friction_n.map(|f| 1e3 * f);
            calibration.step(m, Measured { normal_force_n: 1e3 * r.normal_force_n, friction_n });
        });
        let units = settle(calibration).result();
        assert!(matches!(units, Err(OutOfRange { .. } | NotCalibrated::Unsettled)), "{name} {units:?}");
    }
}

/// Readings that are not numbers change nothing.
#[test]
fn bad_readings_are_left_out() {
    let (_, data) = models().pop().unwrap();
    let model = data.model().unwrap();
    let finger = model.tuned(tuning([1.1, 0.8, 1.2])).unwrap();
    let run = |bad: bool| -> Calibrated {
        let (mut state, mut calibration) = (State::default(), Calibrator::new(&model, Settings::default()));
        let mut count = 0u32;
        along(GUIDE, |m| {
            let r = step(&finger, &mut state, m);
            let measured = Measured { normal_force_n: r.normal_force_n, friction_n: r.friction_n };
            calibration.record(m, measured);
            count += 1;
            if bad && count.is_multiple_of(5) {
                let none = [f32::NAN, f32::INFINITY, -f32::INFINITY][count as usize % 3];
                calibration.record(Motion { depth_mm: none, ..m }, measured);
                calibration.record(Motion { slide_increment_mm: [0.0, none], ..m }, measured);
                calibration.record(m, Measured { normal_force_n: none, ..measured });
                calibration.record(m, Measured { friction_n: [none, 0.0], ..measured });
            }
            calibration.work();
        });
        settle(calibration).result().unwrap()
    };
    assert_eq!(run(true), run(false));
}

/// Any bits whatever: no panic, and the estimate stays within its range.
#[test]
fn any_bits_leave_a_finger_in_range() {
    let (_, data) = models().pop().unwrap();
    let model = data.model().unwrap();
    let mut calibration = Calibration::<4, 37, 24>::new(&model, Settings::default());
    let mut seed = 3u64;
    let mut bits = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let raw = (seed >> 32) as u32;
        // A third of any bits, a third near what a finger does, a third of its order.
        match raw % 3 {
            0 => f32::from_bits(raw),
            1 => (raw >> 8) as f32 / (1 << 24) as f32,
            _ => (raw >> 8) as f32 / (1 << 22) as f32 - 2.0,
        }
    };
    for _ in 0..200_000 {
        let m =
            Motion { depth_mm: bits(), slide_increment_mm: [bits(), bits()], spin_increment_rad: bits(), dt_s: bits() };
        calibration.step(m, Measured { normal_force_n: bits(), friction_n: [bits(), bits()] });
        let Calibrated { tuning: t, depth_offset_mm, tuning_error, .. } = calibration.estimate();
        assert!(
            (0.5..=2.0).contains(&t.size) && (0.2..=5.0).contains(&t.stiffness) && (0.1..=10.0).contains(&t.lambda)
        );
        assert!(depth_offset_mm.abs() <= 0.5 && tuning_error.iter().all(|e| *e >= 0.0));
        let _ = calibration.result();
    }
}
