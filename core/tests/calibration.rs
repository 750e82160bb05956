//! Calibration on the device, against fingers of known tuning and against finite elements.

mod common;

use common::{Noise, models, motion};
use fingerpad::calibration::{Calibrated, Calibration, Measured, NotCalibrated, Settings};
use fingerpad::{Model, State, Status, Tuning, step};

/// What is wrong with the readings.
#[derive(Clone, Copy, Debug, Default)]
struct Disturbance {
    noise: f32,
    spikes: bool,
    encoder_mm: f32,
    late_mm: f32,
}

/// Corners: depth and slide along x.
const GUIDE: &[[f32; 2]] =
    &[[0.6, 0.0], [-0.2, 0.0], [1.8, 0.0], [-0.2, 0.0], [1.0, 0.0], [1.0, 6.0], [1.0, 3.0], [1.0, 4.0]];

/// Walks through the corners in steps of 1 um.
fn calibrate<'a>(
    model: &Model<'a>,
    truth: Tuning,
    corners: &[[f32; 2]],
    disturbance: Disturbance,
    settings: Settings,
) -> Calibration<'a, 4, 37> {
    let finger = model.tuned(truth).unwrap();
    let mut state = State::default();
    let mut calibration = Calibration::<4, 37>::new(model, settings).unwrap();
    let (mut here, mut noise, mut k) = ([-0.2f32, 0.0], Noise(7), 0u32);
    for to in corners {
        let n = (1000.0 * (to[0] - here[0]).abs().max((to[1] - here[1]).abs())).ceil().max(1.0);
        let by = [(to[0] - here[0]) / n, (to[1] - here[1]) / n];
        for i in 1..=n as u32 {
            let depth = here[0] + by[0] * i as f32;
            // The finger touches late: its depth is less than the device has it.
            let r = step(&finger, &mut state, motion(depth - disturbance.late_mm, by[1], 0.0));
            k += 1;
            let spike = if disturbance.spikes && k % 97 == 0 { 3.0 * noise.next() } else { 0.0 };
            let mut reading = |f: f32| f * (1.0 + disturbance.noise * 1.73 * noise.next()) + spike;
            let measured = Measured {
                normal_force_n: reading(r.normal_force_n),
                friction_n: [reading(r.friction_n[0]), reading(r.friction_n[1])],
            };
            let seen = motion(depth + disturbance.encoder_mm * noise.next(), by[1], 0.0);
            calibration.step(seen, measured);
        }
        here = *to;
    }
    let mut w = 0;
    while calibration.result() == Err(NotCalibrated::Unsettled) && w < 20000 { calibration.work(); w += 1; }
    calibration
}

#[test]
fn table() {
    let truths = [
        [1.0, 1.0, 1.0],
        [1.2, 1.5, 0.7],
        [0.8, 0.6, 1.6],
        [1.0, 3.0, 0.5],
        [1.3, 0.5, 2.0],
        [0.85, 2.0, 3.0],
    ];
    let clean = Disturbance::default();
    let cases = [
        ("clean", clean),
        ("1 %", Disturbance { noise: 0.01, encoder_mm: 0.001, ..clean }),
        ("5 %", Disturbance { noise: 0.05, encoder_mm: 0.001, ..clean }),
        ("5 % spikes", Disturbance { noise: 0.05, encoder_mm: 0.001, spikes: true, ..clean }),
        ("late", Disturbance { noise: 0.01, late_mm: 0.08, ..clean }),
        ("all", Disturbance { noise: 0.05, encoder_mm: 0.005, spikes: true, late_mm: 0.08 }),
    ];
    for (name, data) in models() {
        let model = data.model().unwrap();
        for [size, stiffness, lambda] in truths {
            let truth = Tuning { size, stiffness, lambda, tau0_mpa: 0.0 };
            for (case, disturbance) in cases {
                let c = calibrate(&model, truth, GUIDE, disturbance, Settings::default());
                let f = c.so_far();
                let off = [f.tuning.size / size, f.tuning.stiffness / stiffness, f.tuning.lambda / lambda].map(|x| 100.0 * (x - 1.0));
                println!("{name} {size} {stiffness} {lambda} {case:10} off {off:6.1?} se {:5.1?} offset {:.3} +- {:.3} {:?}", f.tuning_error.map(|e| 100.0*e), f.depth_offset_mm, f.depth_offset_error_mm, c.result().err());
            }
        }
    }
    let _ = (Status::OK, NotCalibrated::NoContact, None::<Calibrated>);
}
