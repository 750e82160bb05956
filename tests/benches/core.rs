//! Nanoseconds on the host for the calls whose instructions `cargo xtask thumb count` counts: each step depends on the
//! one before.

#[path = "../../firmware-example/src/rivals.rs"]
mod rivals;

use divan::{Bencher, black_box, counter::ItemsCount};
use fingerpad::build::{Params, ParamsOf};
use fingerpad::host::{Forces, Motions};
use fingerpad::{Drive, Grip, Motion, Normal, Regime, State, StateOf, Status, Tangential, Tuning, step};

fn main() {
    divan::main();
}

/// Presses, slides, turns: one motion after the other, repeated.
fn motions() -> impl Iterator<Item = Motion> {
    (0u32..).map(|i| {
        let turn = (i / 256) % 4;
        let slide = [[0.01, 0.0], [0.0, 0.012], [-0.011, 0.004], [0.003, -0.01]][turn as usize];
        let depth_mm = 1.0 + 0.4 * ((i % 512) as f32 / 256.0 - 1.0).abs();
        Motion { depth_mm, slide_increment_mm: slide, spin_increment_rad: 0.0, dt_s: 1e-3 }
    })
}

/// With `P` = 2 the contact's memory is one with spin.
fn steps<const M: usize, const P: usize>(bencher: Bencher) {
    // Springs of the same stiffness, which touch one after the other.
    let spring = |j: usize| (1.0 / M as f32, 0.8 * j as f32 / M as f32);
    let data = ParamsOf::<M, 37>::example_with(std::array::from_fn(spring)).try_build().expect("the example is valid");
    let model = data.model().expect("the example is valid");
    let mut state = StateOf::<M, P>::default();
    let mut motions = motions();
    bencher.bench_local(move || step(&model, &mut state, black_box(motions.next().expect("endless"))));
}

#[divan::bench(consts = [3, 4, 5, 6, 8])]
fn step_with_springs<const M: usize>(bencher: Bencher) {
    steps::<M, 1>(bencher);
}

#[divan::bench(consts = [3, 4])]
fn step_with_spin<const M: usize>(bencher: Bencher) {
    steps::<M, 2>(bencher);
}

fn rival(bencher: Bencher, one: extern "C" fn(&mut rivals::Rivals, &[f32; 4])) {
    let mut rivals = rivals::Rivals::default();
    let mut motions = motions();
    bencher.bench_local(move || {
        let Motion { depth_mm, slide_increment_mm: [x, y], dt_s, .. } = motions.next().expect("endless");
        one(&mut rivals, black_box(&[depth_mm, x, y, dt_s]));
        rivals.out
    });
}

#[divan::bench]
fn rival_lugre_powf_bilinear(bencher: Bencher) {
    rival(bencher, rivals::lugre);
}

#[divan::bench]
fn rival_interpn_powf_nalgebra_iwan(bencher: Bencher) {
    rival(bencher, rivals::crates);
}

#[divan::bench]
fn rival_network_3_16_16_3(bencher: Bencher) {
    rival(bencher, rivals::network);
}

#[divan::bench]
fn step_driven_by_normal_force(bencher: Bencher) {
    let data = Params::example().try_build().expect("the example is valid");
    let model = data.model().expect("the example is valid");
    let mut state = State::default();
    let mut motions = motions();
    bencher.bench_local(move || {
        let motion = motions.next().expect("endless");
        let drive = Drive {
            normal: Normal::ForceN(black_box(0.4 * motion.depth_mm)),
            tangential: Tangential::SlideIncrementMm(motion.slide_increment_mm),
            spin_increment_rad: 0.0,
            dt_s: motion.dt_s,
        };
        model.step_driven(&mut state, drive)
    });
}

#[divan::bench]
fn least_grip(bencher: Bencher) {
    let data = Params::example().try_build().expect("the example is valid");
    let model = data.model().expect("the example is valid");
    bencher.bench_local(move || -> Grip { model.least_grip(black_box([0.3, 0.1]), 0.2, 1.0) });
}

#[divan::bench]
fn tuned(bencher: Bencher) {
    let data = Params::example().try_build().expect("the example is valid");
    let model = data.model().expect("the example is valid");
    bencher.bench_local(move || model.tuned(black_box(Tuning { stiffness: 1.3, ..Tuning::default() })));
}

/// Contacts of a batch.
const CONTACTS: usize = 4096;

/// Presses, slides and turns of many contacts, each elsewhere on its path; with noise of 10 µm if `disturbed`.
fn crowd(disturbed: bool) -> impl Iterator<Item = [Vec<f32>; 3]> {
    let noise = |k: usize| if disturbed { ((k * 7919 % 1009) as f32 / 504.5 - 1.0) * 0.01 } else { 0.0 };
    let one: Vec<Motion> = motions().take(1024).collect();
    let all: Vec<_> = (0..1024)
        .map(|k| {
            let of = |number: fn(&Motion) -> f32, from: usize| -> Vec<f32> {
                (0..CONTACTS).map(|i| number(&one[(k + 37 * i) % 1024]) + noise(k * CONTACTS + i + from)).collect()
            };
            [of(|m| m.depth_mm, 0), of(|m| m.slide_increment_mm[0], 3), of(|m| m.slide_increment_mm[1], 5)]
        })
        .collect();
    (0usize..).map(move |k| all[k % 1024].clone())
}

/// Steps of all contacts, together or one by one.
fn crowded<const P: usize>(bencher: Bencher, together: bool, disturbed: bool) {
    let data = Params::example().try_build().expect("the example is valid");
    let model = data.model().expect("the example is valid");
    let mut states = vec![StateOf::<4, P>::default(); CONTACTS];
    let mut numbers = [const { Vec::new() }; 6].map(|mut n: Vec<f32>| {
        n.resize(CONTACTS, 0.0);
        n
    });
    let (mut regime, mut status) = (vec![Regime::NoContact; CONTACTS], vec![Status::OK; CONTACTS]);
    let mut motions = crowd(disturbed);
    bencher.counter(ItemsCount::new(CONTACTS)).with_inputs(|| motions.next().expect("endless")).bench_local_refs(
        |[depth, x, y]| {
            let mut forces = Forces::of(numbers.each_mut().map(|of_kind| &mut of_kind[..]), &mut regime, &mut status);
            if together {
                let motions = Motions { depth_mm: depth, slide_x_mm: x, slide_y_mm: y, spin_rad: &[], dt_s: 1e-3 };
                model.step_batch(&mut states, motions, &mut forces).expect("slices of one length");
                return;
            }
            for (i, state) in states.iter_mut().enumerate() {
                let motion = Motion {
                    depth_mm: depth[i],
                    slide_increment_mm: [x[i], y[i]],
                    spin_increment_rad: 0.0,
                    dt_s: 1e-3,
                };
                let r = step(&model, state, motion);
                forces.normal_force_n[i] = r.normal_force_n;
                [forces.friction_x_n[i], forces.friction_y_n[i]] = r.friction_n;
                forces.spin_moment_n_mm[i] = r.spin_moment_n_mm;
                forces.slip_margin[i] = r.slip_margin;
                forces.stick_ratio[i] = r.stick_ratio;
                forces.regime[i] = r.regime;
                forces.status[i] = r.status;
            }
        },
    );
}

#[divan::bench(args = [false, true])]
fn contacts_4096_one_by_one(bencher: Bencher, disturbed: bool) {
    crowded::<1>(bencher, false, disturbed);
}

#[divan::bench(args = [false, true])]
fn contacts_4096_step_batch(bencher: Bencher, disturbed: bool) {
    crowded::<1>(bencher, true, disturbed);
}

#[divan::bench(args = [false, true])]
fn contacts_4096_step_batch_with_spin(bencher: Bencher, disturbed: bool) {
    crowded::<2>(bencher, true, disturbed);
}
