//! Contacts driven by forces: a load held under noise on the normal force, and an object at rest between two fingers.

use fingerpad::{Drive, Model, Normal, State, Tangential, step};

use crate::row::{Noise, Row, motion};

const LOAD_N: f64 = 0.3;

/// Drives a contact by normal force and friction and adds up its slide.
struct Held<'a> {
    model: &'a Model<'a>,
    state: State,
    way_mm: f64,
}

impl Held<'_> {
    /// Holds the load at a normal force.
    fn drive(&mut self, normal_n: f64) {
        self.drive_to(normal_n, LOAD_N);
    }

    fn drive_to(&mut self, normal_n: f64, friction_n: f64) {
        let drive = Drive {
            normal: Normal::ForceN(normal_n as f32),
            tangential: Tangential::FrictionN([friction_n as f32, 0.0]),
            spin_increment_rad: 0.0,
            dt_s: 1e-3,
        };
        self.way_mm += f64::from(self.model.step_driven(&mut self.state, drive).motion.slide_increment_mm[0]);
    }
}

/// A contact that holds the load at a slip margin of 0.4, and its normal force, N.
fn holding<'a>(model: &'a Model<'a>) -> (Held<'a>, f64) {
    let mut normal = 0.05;
    loop {
        let mut held = Held { model, state: State::default(), way_mm: 0.0 };
        for percent in 0..=100 {
            held.drive_to(normal, 0.01 * f64::from(percent) * LOAD_N);
        }
        let depth = f64::from(held.state.depth_mm());
        let response = step(model, &mut held.state, motion(depth, [0.0; 2]));
        if response.slip_margin > 0.4 || normal > 100.0 {
            held.way_mm = 0.0;
            return (held, normal);
        }
        normal *= 1.02;
    }
}

/// 0.3 N of friction held under noise on the normal force: the displacement.
pub fn rows(model: &Model<'_>, steps: u32, seed: u64) -> Vec<Row> {
    let mut rows = vec![];
    for (percent, marks) in [(1.0, [10.0, 3.0]), (5.0, [40.0, 12.0])] {
        let (mut held, normal) = holding(model);
        let mut random = Noise::new(seed);
        let mut way_at_half = 0.0;
        for i in 0..steps {
            held.drive(normal * (1.0 + 0.01 * percent * random.uniform()));
            if i + 1 == steps / 2 {
                held.drive(normal);
                way_at_half = held.way_mm;
            }
        }
        held.drive(normal);
        let what = format!("0.3 N held under {percent} % uniform noise on the normal force");
        rows.push(Row::new(format!("{what}: displacement"), 1e3 * held.way_mm.abs(), marks, "um"));
        let late = 1e3 * (held.way_mm - way_at_half).abs();
        rows.push(Row::new(
            format!("{what}: of it in the second half"),
            late,
            [0.02 * marks[0], 0.02 * marks[1]],
            "um",
        ));
    }
    for percent in [1.0, 5.0] {
        let (mut held, normal) = holding(model);
        let mut replay = Held { model, state: held.state, way_mm: 0.0 };
        let (mut random, mut least) = (Noise::new(seed + 7), normal);
        for _ in 0..steps {
            let now = normal * (1.0 + 0.01 * percent * random.gaussian()).max(0.1);
            held.drive(now);
            if now < least {
                least = now;
                replay.drive(least);
                replay.drive(normal);
            }
        }
        held.drive(normal);
        let beyond = 100.0 * (held.way_mm / replay.way_mm - 1.0);
        println!(
            "    (Gaussian noise of {percent} %: displacement {:.2} um, least force {:.3} of the mean)",
            1e3 * held.way_mm,
            least / normal
        );
        rows.push(Row::new(
            format!("the same, {percent} % Gaussian: displacement beyond that at the least force so far"),
            beyond,
            [5.0, 1.0],
            "%",
        ));
    }
    rows
}

/// Two fingers hold an object of 45 g; it falls into its place and then rests: how fast it still moves.
pub fn rest_in_a_loop(model: &Model<'_>) -> Vec<Row> {
    const MASS_KG: f64 = 0.045;
    const GRAVITY_MM_S2: f64 = 9810.0;
    const DEPTH_MM: f64 = 1.5;
    let mut rows = vec![];
    for milliseconds in [0.1, 1.0, 5.0] {
        let dt = 1e-3 * milliseconds;
        let mut fingers = [State::default(); 2];
        for finger in &mut fingers {
            step(model, finger, motion(DEPTH_MM, [0.0; 2]));
        }
        let (mut velocity, mut place, mut rested) = (0.0f64, 0.0f64, 0.0);
        let steps = (40.0 / dt) as u64;
        for i in 0..steps {
            let increment = (velocity * dt) as f32;
            place += f64::from(increment);
            let friction: f64 = fingers
                .iter_mut()
                .map(|f| f64::from(step(model, f, motion(DEPTH_MM, [f64::from(increment), 0.0])).friction_n[0]))
                .sum();
            // N is kg m/s²; the air and the joints take a tenth of critical damping.
            let damping = 2.0 * 0.1 * (2.0 * 250.0 * MASS_KG).sqrt() / MASS_KG;
            velocity += dt * (GRAVITY_MM_S2 - 1e3 * friction / MASS_KG - damping * velocity);
            if i == steps / 2 {
                rested = place;
            }
        }
        let speed = 1e3 * (place - rested).abs() / (0.5 * 40.0);
        rows.push(Row::new(
            format!("object of 45 g between two fingers, {milliseconds} ms: drift at rest"),
            speed,
            [1e-3, 0.0],
            "um/s",
        ));
    }
    rows
}
