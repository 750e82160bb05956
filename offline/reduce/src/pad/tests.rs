use fingerpad::pad::{PadState, Plane};
use fingerpad::{Motion, Response};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use nalgebra::Vector3;

use super::*;

/// The default finger on a coarse mesh, in 24 patches.
fn coarse() -> PadModel {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let finger = config.finger().unwrap().0;
    pad(&finger, &finger.outline.clone().unwrap(), PadSize { patches: 24 }, 3.0).unwrap().tuned(&Tuning::default())
}

/// A pad under way: place of the plane by coordinates (mm and rad), of which pitch is that from the neutral one.
struct Trip<'a> {
    pad: Pad<'a, f64>,
    state: PadState<MOST_PATCHES, f64>,
    at: [f64; 6],
    last: Response<f64>,
    /// Work of the plane on the finger without changes of the pose, and what goes in and out, mJ.
    work: [f64; 2],
}

impl<'a> Trip<'a> {
    fn new(model: &'a PadModel) -> Self {
        let pad = model.pad();
        let state = PadState::new(&pad).unwrap();
        Self { pad, state, at: [0.0, 0.0, -0.5, 0.0, 0.0, 0.0], last: Response::default(), work: [0.0; 2] }
    }

    /// Goes straight to slide x, y, depth, spin, pitch, roll.
    fn to(&mut self, to: [f64; 6], steps: usize) {
        let from = self.at;
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let next: [f64; 6] = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
            let way: [f64; 6] = std::array::from_fn(|k| next[k] - self.at[k]);
            self.at = next;
            let motion = Motion {
                depth_mm: next[2],
                slide_increment_mm: [way[0], way[1]],
                spin_increment_rad: way[3],
                dt_s: 1e-3,
            };
            let pose = [self.pad.numbers.neutral_pitch_deg + next[4].to_degrees(), next[5].to_degrees()];
            let answer = self.pad.step(&mut self.state, &Plane, motion, pose);
            let mean = |of: &dyn Fn(&Response<f64>) -> f64| 0.5 * (of(&self.last) + of(&answer));
            let done = mean(&|a| a.normal_force_n) * way[2]
                + mean(&|a| a.friction_n[0]) * way[0]
                + mean(&|a| a.friction_n[1]) * way[1]
                + mean(&|a| a.spin_moment_n_mm) * way[3];
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
        let [x, y, z] = patch.middle_mm;
        let mirror = Vector3::new(x, -y, z);
        assert!(pad.patches.iter().any(|p| (Vector3::from(p.middle_mm) - mirror).norm() < 1e-6), "{mirror}");
        assert!(patch.compliance_mm_per_n.iter().all(|c| *c > 0.0), "{:?}", patch.compliance_mm_per_n);
    }
    let mut trip = Trip::new(&pad);
    trip.to([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 20);
    // The finite elements of this mesh have 0.28 N; nothing here was fitted to them.
    assert!((0.2..0.36).contains(&trip.last.normal_force_n), "{}", trip.last.normal_force_n);
    assert!(trip.last.friction_n[1].abs() < 1e-6 * trip.last.normal_force_n, "a press is symmetric: {:?}", trip.last);
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
            after.push(nalgebra::Vector2::from(trip.last.friction_n));
        }
        let first = after[9];
        let drift = (after[59] - first).norm() / first.norm();
        assert!(drift < 2e-3, "{name}: {drift:.1e} in 50 cycles");
        assert!(first.norm() > 0.5 * trip.last.friction_limit_n * 0.2, "{name}: the load is there");
    }
}
