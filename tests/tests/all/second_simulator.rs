//! The half-space finger against analysis: its load, its full slip, its partial slip and reversal, its symmetry.

use fingerpad_tests::synthetic_truth::Random;
use fingerpad_tests::synthetic_truth::half_space_finger::{HalfSpaceFinger, POISSON};
use fingerpad_tests::synthetic_truth::laboratory::Scatter;
use fingerpad_tests::synthetic_truth::protocol::{Plan, Stroke, StrokeRow, strokes};
use fingerpad_tests::synthetic_truth::simulator::{Simulator, Stepped};

/// Presses to a depth, then slides through the places along x, one row each.
fn slide(depth_mm: f64, places_mm: &[f64]) -> Stroke {
    let row = |t_s: f64, depth_mm: f64, x: f64| StrokeRow {
        t_s,
        depth_mm,
        slide_mm: [x, 0.0],
        contact_s: t_s,
        occlusion_s: t_s,
    };
    let mut rows = vec![row(0.0, -0.2, 0.0), row(1.0, depth_mm, 0.0)];
    rows.extend(places_mm.iter().enumerate().map(|(i, x)| row(2.0 + i as f64, depth_mm, *x)));
    Stroke { plan: Plan { depth_mm, ..Plan::reference() }, rows }
}

fn readings(finger: &HalfSpaceFinger, stroke: &Stroke) -> Vec<[f64; 3]> {
    finger.readings(stroke, &[], &Scatter::default())
}

/// Sliding freely, friction is the integral of tau_0 + alpha p: tau_0 A + alpha N, for any form of the pressure.
#[test]
fn full_slip_carries_the_integral_of_the_law() {
    for seed in 0..6 {
        let mut random = Random::new(seed);
        let mut finger = HalfSpaceFinger::random(&mut random);
        (finger.rise, finger.incline) = (0.0, [0.0; 2]);
        for depth_mm in [0.3, 0.9, 1.5] {
            let plan = Plan { depth_mm, direction: random.between(0.0, 6.2), length_mm: 12.0, ..Plan::reference() };
            let last = *readings(&finger, &strokes(&[plan], 30)[0]).last().unwrap();
            let wanted = finger.tau0_mpa * finger.area(depth_mm) + finger.alpha * finger.load(depth_mm);
            let found = last[1].hypot(last[2]);
            println!("seed {seed}, {depth_mm} mm: friction {found:.6} N, tau_0 A + alpha N {wanted:.6} N");
            assert!((found / wanted - 1.0).abs() < 2e-3, "seed {seed}");
            let curve = finger.load_n * ((finger.load_rate * depth_mm).exp() - 1.0) / (finger.load_rate.exp() - 1.0);
            assert!((last[0] / curve - 1.0).abs() < 1e-9, "seed {seed}: {} {curve}", last[0]);
        }
    }
}

/// Round contact, tau = alpha p: Cattaneo's and Mindlin's partial slip, and Mindlin and Deresiewicz's on the way back.
#[test]
fn partial_slip_and_reversal_are_mindlins() {
    for seed in 10..14 {
        let mut finger = HalfSpaceFinger::random(&mut Random::new(seed)).round();
        finger.tau0_mpa = 0.0;
        let depth_mm = 1.0;
        let limit = finger.alpha * finger.load(depth_mm);
        let radius = (finger.area(depth_mm) / std::f64::consts::PI).sqrt();
        let slip_mm = 3.0 * limit * (2.0 - POISSON) / (16.0 * finger.shear_mpa * radius);
        let mindlin = |x: f64| limit * (1.0 - (1.0 - (x / slip_mm).min(1.0)).powf(1.5));
        let turn_mm = 0.8 * slip_mm;
        let places: Vec<f64> =
            (1..=16).chain((0..16).rev()).map(|k| f64::from(k) / 16.0 * turn_mm).chain([-turn_mm]).collect();
        let found = readings(&finger, &slide(depth_mm, &places));
        for (i, x) in places.iter().enumerate() {
            let wanted = if i < 16 { mindlin(*x) } else { mindlin(turn_mm) - 2.0 * mindlin((turn_mm - x) / 2.0) };
            let off = (found[i + 2][1] - wanted) / limit;
            println!(
                "seed {seed} x {x:.3} mm: {:.4} N, Mindlin {wanted:.4} N, off {:.1} % of the limit",
                found[i + 2][1],
                100.0 * off
            );
            assert!(off.abs() < 0.04, "seed {seed} x {x}");
            assert!(found[i + 2][2].abs() < 1e-6 * limit, "a round finger pushes along the slide alone");
        }
    }
}

/// While all sticks, the tangential stiffness is 8 G a / (2 − nu), and a reversal is reversible.
#[test]
fn sticking_is_elastic() {
    let mut finger = HalfSpaceFinger::random(&mut Random::new(20)).round();
    finger.tau0_mpa = 1.0;
    let radius = (finger.area(1.0) / std::f64::consts::PI).sqrt();
    let stiffness = 8.0 * finger.shear_mpa * radius / (2.0 - POISSON);
    let found = readings(&finger, &slide(1.0, &[0.2, 0.4, 0.0]));
    println!("{} N/mm, 8 G a / (2 - nu) {stiffness} N/mm", found[3][1] / 0.4);
    assert!((found[3][1] / 0.4 / stiffness - 1.0).abs() < 0.04);
    assert!((found[2][1] * 2.0 - found[3][1]).abs() < 1e-5 * found[3][1] && found[4][1].abs() < 1e-5);
}

/// A closed path costs work, never gives any, with pressing, tilt and lean.
#[test]
fn closed_paths_dissipate() {
    for seed in 30..34 {
        let mut random = Random::new(seed);
        let finger = HalfSpaceFinger::random(&mut random);
        let mut places: Vec<f64> = (0..30).map(|_| random.between(-1.0, 1.0)).collect();
        places.push(places[9]);
        let found = readings(&finger, &slide(1.2, &places));
        let work: f64 =
            (10..places.len()).map(|i| (places[i] - places[i - 1]) * (found[i + 1][1] + found[i + 2][1]) / 2.0).sum();
        println!("seed {seed}: {work:.4} N mm over the closed path");
        assert!(work > 0.0, "seed {seed}");
    }
}
