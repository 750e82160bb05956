use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use nalgebra::{Rotation2, Vector2};

use super::patches::tilt;
use super::*;

/// The default finger on a coarse mesh, in 24 patches.
fn coarse() -> Pad {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let finger = config.finger().unwrap().0;
    pad(&finger, &finger.outline.clone().unwrap(), PadSize { patches: 24 }).unwrap()
}

/// A pad under way: place of the plane by coordinates, mm and rad.
struct Trip<'a> {
    pad: &'a Pad,
    law: Law,
    contact: Contact,
    at: [f64; 6],
    shift: Vector2<f64>,
    last: Answer,
    /// Work of the plane on the finger without changes of the pose, and what goes in and out, mJ.
    work: [f64; 2],
}

impl<'a> Trip<'a> {
    fn new(pad: &'a Pad) -> Self {
        let at = [0.0, 0.0, -0.5, 0.0, 0.0, 0.0];
        let contact = Contact::new(pad);
        Self { pad, law: Law::default(), contact, at, shift: Vector2::zeros(), last: Answer::default(), work: [0.0; 2] }
    }

    /// Goes straight to slide x, y, depth, spin, pitch, roll.
    fn to(&mut self, to: [f64; 6], steps: usize) {
        let from = self.at;
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let next: [f64; 6] = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
            let way: [f64; 6] = std::array::from_fn(|k| next[k] - self.at[k]);
            self.shift =
                Rotation2::new(way[3]) * self.shift + Rotation2::new(0.5 * way[3]) * Vector2::new(way[0], way[1]);
            self.at = next;
            let tilt = tilt(next[4], next[5]);
            let place = Place { tilt, depth_mm: next[2], shift: self.shift, spin: next[3] };
            let answer = self.contact.step(self.pad, &self.law, &place);
            let mean = |of: &dyn Fn(&Answer) -> f64| 0.5 * (of(&self.last) + of(&answer));
            let done = mean(&|a| a.normal_n) * way[2]
                + mean(&|a| a.friction_n.x) * way[0]
                + mean(&|a| a.friction_n.y) * way[1]
                + mean(&|a| a.moment_n_mm.z) * way[3];
            self.work[0] += done;
            self.work[1] += done.abs();
            self.last = answer;
        }
    }
}

#[test]
fn the_modes_hold_nearly_all_of_the_compliance_of_a_contact() {
    let pad = coarse();
    assert!((20..=28).contains(&pad.patches.len()), "{}", pad.patches.len());
    // Patches come in mirrored pairs.
    for patch in &pad.patches {
        let mirror = Vector3::new(patch.middle.x, -patch.middle.y, patch.middle.z);
        assert!(pad.patches.iter().any(|p| (p.middle - mirror).norm() < 1e-6), "{}", patch.middle);
        assert!(patch.compliance.iter().all(|c| *c > 0.0), "{:?}", patch.compliance);
    }
    let mut trip = Trip::new(&pad);
    trip.to([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 20);
    // The finite elements of this mesh have 0.28 N; nothing here was fitted to them.
    assert!((0.2..0.36).contains(&trip.last.normal_n), "{}", trip.last.normal_n);
    assert!(trip.last.friction_n.y.abs() < 1e-6 * trip.last.normal_n, "a press is symmetric: {:?}", trip.last);
}

/// Over closed paths in depth, slide and spin, from the air back to the air, the plane's work is what friction dissipates.
#[test]
fn closed_paths_do_not_yield_work() {
    let pad = coarse();
    let mut seed = 7u64;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((seed >> 33) as f64 / f64::from(1u32 << 31))
    };
    for path in 0..12 {
        let mut trip = Trip::new(&pad);
        trip.to([0.0, 0.0, random(0.2, 1.5), 0.0, 0.0, 0.0], 40);
        for _ in 0..6 {
            let corner = [random(-1.0, 1.0), random(-1.0, 1.0), random(0.1, 1.5), random(-0.4, 0.4), 0.0, 0.0];
            trip.to(corner, 60);
        }
        trip.to([0.0, 0.0, trip.at[2], 0.0, 0.0, 0.0], 60);
        trip.to([0.0, 0.0, -0.5, 0.0, 0.0, 0.0], 60);
        let [work, exchanged] = trip.work;
        assert!(work > -1e-3 * exchanged, "path {path}: {work} of {exchanged} mJ");
        assert!(work < exchanged, "friction dissipates a part");
    }
}

/// A load that is held below its limit is still there after many small cycles of depth, spin and pose, circles included, and what a cycle
/// leaves does not change after the first ones.
#[test]
fn a_held_load_shakes_down() {
    let pad = coarse();
    for (name, cycle) in [
        ("depth", vec![[0.0, 0.0, 0.02, 0.0, 0.0, 0.0], [0.0, 0.0, -0.02, 0.0, 0.0, 0.0]]),
        ("spin", vec![[0.0, 0.0, 0.0, 0.01, 0.0, 0.0], [0.0, 0.0, 0.0, -0.01, 0.0, 0.0]]),
        (
            "circle of the pose",
            (0..8)
                .map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4)
                .map(|a| [0.0, 0.0, 0.0, 0.0, 9e-3 * a.sin(), 9e-3 * a.cos()])
                .collect(),
        ),
    ] {
        let mut trip = Trip::new(&pad);
        trip.to([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 20);
        trip.to([0.3, 0.1, 1.0, 0.0, 0.0, 0.0], 20);
        let held = trip.at;
        let mut after = Vec::new();
        for _ in 0..60 {
            for change in &cycle {
                trip.to(std::array::from_fn(|k| held[k] + change[k]), 2);
            }
            trip.to(held, 2);
            after.push(trip.last.friction_n);
        }
        let first = after[9];
        let drift = (after[59] - first).norm() / first.norm();
        assert!(drift < 2e-3, "{name}: {drift:.1e} in 50 cycles");
        assert!(first.norm() > 0.5 * trip.last.strength_n * 0.2, "{name}: the load is there");
    }
}
