//! A handle on a sampled contact: calm with the damping of the rule, and not with less.

use crate::common::{shipped, shipped_pad};
use fingerpad::frames::{Finger, RoundBed};
use fingerpad::haptics::{least_damping_n_s_per_m, press_stiffness_n_per_mm};
use fingerpad::pad::{Body, PadState, RelaxingPadState};
use fingerpad::{Branch, Motion, Relaxation, State};

/// After this time all tissue has relaxed, s.
const RELAXED_S: f64 = 1e3;
/// Parts of a sample in which the handle is integrated.
const PARTS: usize = 40;

/// A handle on a sampled contact.
struct Handle {
    mass_t: f64,
    period_s: f64,
    /// Samples by which the force comes late.
    late: u16,
    damping_n_s_per_m: f64,
}

/// Growth of the vibration of a handle that rests at a depth, on relaxed tissue, and is given a push.
fn growth<S, F: Finger<S, Scalar = f32>>(finger: &F, depth_mm: f64, handle: &Handle) -> f64 {
    let Handle { mass_t, period_s, late, damping_n_s_per_m } = *handle;
    let mut state = finger.fresh().unwrap();
    let mut after = |depth_mm: f64, dt_s: f64| {
        let motion = Motion { depth_mm: depth_mm as f32, dt_s: dt_s as f32, ..Motion::default() };
        f64::from(finger.advance(&mut state, &Body::Plane, motion, finger.neutral_deg()).normal_force_n)
    };
    after(depth_mm, RELAXED_S);
    let load = after(depth_mm, RELAXED_S);
    let mut force = |depth_mm: f64| after(depth_mm, period_s);
    let (mut at, mut speed) = (depth_mm, 0.5);
    let mut queue = vec![load; usize::from(late)];
    let samples = (0.4 / period_s) as usize;
    let mut largest = [0.0f64; 2];
    for k in 0..samples {
        queue.push(force(at));
        let acts = queue.remove(0);
        let dt = period_s / PARTS as f64;
        for _ in 0..PARTS {
            speed += (load - acts - 1e-3 * damping_n_s_per_m * speed) / mass_t * dt;
            at += speed * dt;
        }
        let part = if k < samples / 4 { 0 } else { usize::from(k >= 3 * samples / 4) };
        if k < samples / 4 || k >= 3 * samples / 4 {
            largest[part] = largest[part].max((at - depth_mm).abs());
        }
    }
    largest[1] / largest[0]
}

/// * `more`: damping beyond the rule that the finger needs, N s/m
fn holds<S, F: Finger<S, Scalar = f32>>(name: &str, finger: &F, depth_mm: f32, more: f64) {
    let stiffness = press_stiffness_n_per_mm(finger, depth_mm).unwrap();
    for period_s in [1e-3f32, 2.5e-4] {
        for late in [0, 1] {
            let least = f64::from(least_damping_n_s_per_m(stiffness, period_s, late));
            let handle =
                |damping_n_s_per_m: f64| Handle { mass_t: 100e-6, period_s: period_s.into(), late, damping_n_s_per_m };
            let grown = |share: f64| growth(finger, depth_mm.into(), &handle(share));
            println!(
                "{name}, {depth_mm} mm, {period_s} s, {late} late: {stiffness} N/mm, {least:.3} N s/m, {:.3} {:.3}",
                grown(0.7 * least),
                grown(1.3 * least + more)
            );
            assert!(
                grown(1.3 * least + more) < 0.98 && grown(0.7 * least) > 1.02,
                "{name}, {depth_mm} mm, {period_s} s, {late} samples late"
            );
        }
    }
}

#[test]
fn a_handle_is_calm_with_the_damping_of_the_rule() {
    let data = shipped();
    let bed = RoundBed::new(data.model().unwrap());
    let file = shipped_pad();
    for depth_mm in [1.0, 2.0] {
        holds::<State, _>("bed", &bed, depth_mm, 0.0);
    }
    for depth_mm in [1.0, 2.0, 3.0] {
        // Its equilibrium is found within a tolerance, which gives away a little as well.
        holds::<PadState<40>, _>("pad", &file.file().pad, depth_mm, 0.03);
    }
}

/// 50 g on a load of 1 N and a device without damping. The tissue damps what the sampled loop gives away at 1 kHz and not at 500 Hz; a
/// slow branch alone damps less than its stiffness adds.
#[test]
fn tissue_that_relaxes_damps_a_sampled_handle() {
    let file = shipped_pad();
    let pad = file.file().pad;
    // The depth of 1 N.
    let depth_mm = 2.02;
    let handle = |period_s: f64| Handle { mass_t: 50e-6, period_s, late: 0, damping_n_s_per_m: 0.0 };
    let slow = Relaxation::new(&[Branch { share: 0.6, time_s: 1.4 }]).unwrap();
    let grown = |relaxation: Relaxation, period_s: f64| {
        growth::<RelaxingPadState<40>, _>(&pad.with_relaxation(relaxation), depth_mm, &handle(period_s))
    };
    let elastic = growth::<PadState<40>, _>(&pad, depth_mm, &handle(1e-3));
    let [tissue, coarse] = [1e-3, 2e-3].map(|period_s| grown(Relaxation::HUMAN_ASSUMED, period_s));
    let slow = grown(slow, 1e-3);
    println!("elastic {elastic:.3}, human-assumed {tissue:.4}, at 500 Hz {coarse:.3}, slow branch alone {slow:.3}");
    assert!(tissue < 0.1 && elastic > 3.0 && slow > 1.5 * elastic && coarse > 3.0);
}
