//! Eight runs at once against one run at a time, written down as plainly as it can be.

use fingerpad::Surroundings;

use super::elements::inverse_square_root;
use super::*;
use crate::model::{DepthValues, ELEMENTS};
use crate::reference::ReferenceCurves;
use crate::trajectory::{Sample, Stroke};

/// One run, sample by sample and element by element.
fn alone(model: &SmoothModel, changes: &[ModelChange], stroke: &Stroke, out: &mut Vec<f64>) {
    struct Memory {
        force: [[f64; 2]; ELEMENTS],
        at: DepthValues,
        depth: f64,
    }
    let air = || Memory { force: [[0.0; 2]; ELEMENTS], at: DepthValues::default(), depth: 0.0 };
    let mut memory = air();
    for (sample, change) in stroke.samples.iter().zip(changes) {
        let depth = if sample.depth_mm > 0.0 { sample.depth_mm + change.depth_mm } else { sample.depth_mm };
        let [b_n, b_x, b_y] = change.reading_n;
        if depth <= 0.0 {
            memory = air();
            out.extend([b_n, b_x, b_y]);
            continue;
        }
        let strength = change.strength
            * (1.0 + model.direction_gain(depth, sample.double_angle, sample.direction))
            * change.stiffness.powf(model.load_exponent);
        let slide = sample.slide_mm;
        let steps = ((depth - memory.depth).abs() / 0.08).ceil().clamp(1.0, 12.0);
        let from = memory.depth;
        for k in 1..=steps as usize {
            let d = if k == steps as usize { depth } else { from + (depth - from) * k as f64 / steps };
            let mut at = model.at_depth(d);
            at.strength_n *= strength;
            at.tangential_n_mm *= change.stiffness;
            let mut keep = memory.at.strength_n / at.strength_n;
            if at.tangential_n_mm < memory.at.tangential_n_mm {
                keep *= at.tangential_n_mm / memory.at.tangential_n_mm;
            }
            let per_slip = at.tangential_n_mm / at.strength_n;
            let [x, y] = [0, 1].map(|k| slide[k] / steps + at.pressed_mm[k] - memory.at.pressed_mm[k]);
            let (x, y) = (x * per_slip, y * per_slip * at.stiffness_ratio_y);
            for (u, [inverse_yield, _]) in memory.force.iter_mut().zip(&model.elements) {
                let [mut ux, mut uy] = [u[0] * keep + x * inverse_yield, u[1] * keep + y * inverse_yield];
                let square = ux * ux + uy * uy;
                if square > 1.0 {
                    // Back to the limit along the slip of an element whose stiffness along y is the ratio times that along x.
                    let lack = 1.0 - at.stiffness_ratio_y;
                    let along_y = square * square + square - 2.0 * lack * uy * uy;
                    ux *= along_y - lack * (square * square - square);
                    uy *= along_y;
                    let length = ux.hypot(uy);
                    (ux, uy) = (ux / length, uy / length);
                }
                *u = [ux, uy];
            }
            (memory.at, memory.depth) = (at, d);
        }
        let mean = |k: usize| memory.force.iter().zip(&model.elements).map(|(u, e)| e[1] * u[k]).sum::<f64>();
        let (mx, my) = (mean(0), mean(1));
        let fx = memory.at.strength_n * (mx - model.odd_x_per_mm * depth * (mx.powi(2) - ODD_SHAPE * mx.powi(4)));
        let fy = memory.at.strength_n * my;
        let area = memory.at.area_mm2 / REFERENCE_AREA_MM2;
        let [s, p] = [model.normal_shear, model.normal_per_friction];
        let normal =
            memory.at.normal_n * change.stiffness * (1.0 + s[0] * mx * mx + s[1] * my * my) + p[0] * fx + p[1] * fy
                - change.adhesion_n * area.sqrt();
        let drag = change.drag_n * area;
        let gain = 1.0 + change.gain;
        out.push(gain * normal + b_n);
        out.push(gain * (fx + drag * sample.direction[0] + change.cross[0] * normal) + b_x);
        out.push(gain * (fy + drag * sample.direction[1] + change.cross[1] * normal) + b_y);
    }
}

/// Numbers from 0 to 1 (splitmix64, Steele et al. 2014).
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Strokes of any length, some of which leave the skin within or begin in contact.
fn strokes(next: &mut impl FnMut() -> f64, n: usize) -> Vec<Stroke> {
    let mut one = |i: usize| {
        let samples = 3 + (27.0 * next()) as usize;
        let (mut t_s, mut depth_mm) = (0.0, if i.is_multiple_of(4) { 0.5 } else { -0.2 });
        let samples = (0..samples)
            .map(|_| {
                t_s += 0.01 + next();
                depth_mm = if next() < 0.06 { -0.1 } else { (depth_mm + 0.8 * (next() - 0.3)).clamp(-0.2, 2.6) };
                let slide_mm = [0.6 * (next() - 0.5), 0.6 * (next() - 0.5)];
                let angle = slide_mm[1].atan2(slide_mm[0]);
                Sample {
                    t_s,
                    depth_mm,
                    slide_mm,
                    double_angle: [(2.0 * angle).cos(), (2.0 * angle).sin()],
                    direction: [angle.cos(), angle.sin()],
                    surroundings: Surroundings::default(),
                }
            })
            .collect();
        Stroke { start_s: 0.0, samples, time_constant_s: 0.0 }
    };
    (0..n).map(&mut one).collect()
}

/// Changes for each sample: none, of the model alone, or of readings too.
fn changes(next: &mut impl FnMut() -> f64, strokes: &[Stroke], kind: u64) -> Vec<ModelChange> {
    let mut around = |middle: f64, width: f64| middle + width * (next() - 0.5);
    let samples = strokes.iter().flat_map(|s| &s.samples);
    samples
        .map(|_| match kind {
            0 => ModelChange::default(),
            1 => ModelChange {
                strength: around(1.0, 0.4),
                stiffness: around(1.0, 0.4),
                depth_mm: around(0.0, 0.1),
                ..ModelChange::default()
            },
            _ => ModelChange {
                strength: around(1.0, 0.4),
                stiffness: around(1.0, 0.4),
                depth_mm: around(0.0, 0.1),
                reading_n: [around(0.0, 0.1), around(0.0, 0.1), around(0.0, 0.1)],
                cross: [around(0.0, 0.1), around(0.0, 0.1)],
                gain: around(0.0, 0.1),
                drag_n: around(0.0, 0.05),
                adhesion_n: around(0.0, 0.05),
            },
        })
        .collect()
}

fn reference() -> ReferenceCurves {
    let file = include_bytes!("../../data/models/fingertip.fpm");
    let file = fingerpad::host::ModelFile::new(file).unwrap();
    ReferenceCurves::from_model_data(file.file().model.data(), true)
}

#[test]
fn eight_runs_at_once_give_what_each_gives_alone() {
    let reference = reference();
    for seed in 1..=24 {
        let mut next = uniform(seed);
        let n = 1 + (20.0 * next()) as usize;
        let strokes = strokes(&mut next, n);
        let mut values = reference.mean;
        for p in Parameter::all() {
            values[p] += 0.2 * p.info().sd_between_fingers * (next() - 0.5);
        }
        let model = reference.model(&values);
        let changes = changes(&mut next, &strokes, seed % 3);
        let trajectories = Trajectories::new(strokes.clone());
        // An earlier simulation with other changes shifts the depths of the trajectory.
        let other = ModelChange { depth_mm: 0.07, ..ModelChange::default() };
        let _ = SimulationInputs::new(&trajectories, vec![other; changes.len()]).predict_n(&model);
        let found = SimulationInputs::new(&trajectories, changes.clone()).predict_n(&model);
        let (mut expected, mut first) = (Vec::new(), 0);
        for stroke in &strokes {
            let own = &changes[first..first + stroke.samples.len()];
            alone(&model, own, stroke, &mut expected);
            // The other runs of a batch have no influence on a run.
            let one = std::slice::from_ref(stroke);
            let single = SimulationInputs::new(&Trajectories::new(one.to_vec()), own.to_vec()).predict_n(&model);
            assert_eq!(single, found[3 * first..3 * (first + own.len())], "seed {seed}");
            first += own.len();
        }
        assert_eq!(found.len(), expected.len());
        let scale = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        assert!(scale > 0.1, "seed {seed}: nothing happens");
        for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
            assert!((a - b).abs() <= 1e-12 * scale, "seed {seed}, observation {i}: {a} against {b}");
        }
    }
}

#[test]
fn parameters_of_the_readings_leave_the_elements_as_they_are() {
    let reference = reference();
    let mut next = uniform(99);
    let strokes = strokes(&mut next, 11);
    let plain = changes(&mut next, &strokes, 0);
    let inputs = SimulationInputs::new(&Trajectories::new(strokes), plain);
    let history = inputs.element_history(&reference.model(&reference.mean));
    for p in Parameter::all() {
        let mut values = reference.mean;
        values[p] += 0.01;
        let model = reference.model(&values);
        let same = inputs.readings_n(&model, &history) == inputs.predict_n(&model);
        assert_eq!(same, !inputs.history_depends_on(p), "{}", p.info().name);
    }
}

#[test]
fn curves() {
    let mut next = uniform(5);
    let (mut exp, mut ln, mut root) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..100_000 {
        let (x, d) = (60.0 * (next() - 0.5), 1e-3 + 3.0 * next());
        let found = f64x8::splat(x).exp().to_array()[0];
        exp = exp.max((found / x.exp() - 1.0).abs());
        let found = inverse_square_root(f64x8::splat(x.exp())).to_array()[0];
        root = root.max((found * (0.5 * x).exp() - 1.0).abs());
        let found = f64x8::splat(d).ln().to_array()[0];
        ln = ln.max((found - d.ln()).abs() / d.ln().abs().max(1e-3));
    }
    println!("exp {exp:e}, ln {ln:e}, inverse root {root:e}");
    assert!(exp < 1e-15 && ln < 1e-15 && root < 1e-15, "{exp:e} {ln:e} {root:e}");
}

/// The low-pass of a sensor against its response to a ramp that starts from rest, y = s (t - tau (1 - exp(-t / tau))),
/// on uneven steps; and a constant force, which it does not change.
#[test]
fn the_low_pass_of_a_sensor_is_exact_on_ramps() {
    let times: Vec<f64> = (0..60).map(|i| 0.01 * f64::from(i) + 0.004 * f64::from(i % 3)).collect();
    let sample = |t_s: &f64| Sample {
        t_s: *t_s,
        depth_mm: 1.0,
        slide_mm: [0.0; 2],
        double_angle: [0.0; 2],
        direction: [0.0; 2],
        surroundings: Default::default(),
    };
    let stroke = Stroke { start_s: 0.0, samples: times.iter().map(sample).collect(), time_constant_s: 0.03 };
    let mut readings: Vec<f64> = times.iter().flat_map(|t| [2.0 * t, 0.7, -t]).collect();
    Stroke::filter(&stroke.low_pass(), &mut readings);
    for (t, reading) in times.iter().zip(readings.chunks_exact(3)) {
        let ramp = t - 0.03 * (1.0 - (-t / 0.03).exp());
        assert!((reading[0] - 2.0 * ramp).abs() < 1e-12 && (reading[2] + ramp).abs() < 1e-12, "{t}: {reading:?}");
        assert!((reading[1] - 0.7).abs() < 1e-12, "{t}");
    }
}
