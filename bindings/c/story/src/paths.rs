//! The paths: a clean one (press, slide, hold, lift) and a disturbed one (noise, vibration, reversals, changing strength, spin,
//! poses, nonsense), with every request on the way.

use fingerpad::ModelFile;

use crate::told::Request;

/// Seed of the disturbances.
pub const SEED: u32 = 20_111;

const DT_S: f32 = 1e-3;

/// Numbers from 0 to 1.
struct Noise(u32);

impl Noise {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0
    }

    fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    /// From −`most` to `most`.
    fn about(&mut self, most: f32) -> f32 {
        most * (2.0 * self.unit() - 1.0)
    }
}

/// Clean and disturbed with the shipped model, then both with the other one, which has effects and tables over a voltage.
pub fn story(shipped: &ModelFile) -> Vec<Request> {
    let pitch_deg = shipped.file().model.data().pose.pitch_deg;
    let mut told = vec![Request::Model(0)];
    clean(&mut told);
    told.push(Request::Model(0));
    disturbed(&mut told, pitch_deg, &mut Noise(SEED));
    told.push(Request::Model(1));
    clean(&mut told);
    disturbed(&mut told, pitch_deg, &mut Noise(SEED + 1));
    told
}

/// The clean path alone.
pub fn clean_story() -> Vec<Request> {
    let mut told = Vec::new();
    clean(&mut told);
    told
}

/// The disturbed path alone, about the pose of a model.
pub fn disturbed_story(model: &ModelFile) -> Vec<Request> {
    let mut told = Vec::new();
    disturbed(&mut told, model.file().model.data().pose.pitch_deg, &mut Noise(SEED));
    told
}

fn step(depth_mm: f32, x: f32, y: f32, spin: f32) -> Request {
    Request::Step([depth_mm, x, y, spin, DT_S])
}

/// Press to 1 mm, slide 2 mm obliquely, hold, lift.
fn clean(told: &mut Vec<Request>) {
    told.extend((1..=100).map(|k| step(0.01 * k as f32, 0.0, 0.0, 0.0)));
    told.extend((0..200).map(|_| step(1.0, 0.01, 0.002, 0.0)));
    told.extend((0..20).map(|_| step(1.0, 0.0, 0.0, 0.0)));
    told.extend([Request::Gradient([0.0, 1.0, 0.2]), Request::Grip([0.1, 0.05, 0.2, 1.0]), Request::Save]);
    told.extend((0..=100).map(|k| step(1.0 - 0.01 * k as f32, 0.0, 0.0, 0.0)));
}

fn disturbed(told: &mut Vec<Request>, pitch_deg: f32, noise: &mut Noise) {
    let (mut depth, mut target, mut slide, mut spin) = (0.0f32, 1.0f32, [0.0f32; 2], 0.0f32);
    for i in 0..6000 {
        if i % 64 == 0 {
            target = 2.0 * noise.unit() - 0.2;
            slide = [noise.about(0.05), noise.about(0.05)];
            spin = noise.about(0.02);
            told.push(Request::Factor(0.5 + noise.unit()));
        }
        depth += 0.1 * (target - depth);
        let vibration = if i % 128 < 64 { 0.01 * (0.7 * i as f32).sin() } else { 0.0 };
        told.push(step(
            depth + noise.about(0.005) + vibration,
            slide[0] + noise.about(0.002),
            slide[1] + noise.about(0.002),
            spin + noise.about(0.001),
        ));
        told.extend(now_and_then(i, pitch_deg, noise));
    }
}

/// What interrupts a disturbed path at step `i`.
fn now_and_then(i: u32, pitch_deg: f32, noise: &mut Noise) -> Vec<Request> {
    let mut told = Vec::new();
    if i % 150 == 40 {
        told.push(Request::Pose([pitch_deg + noise.about(10.0), noise.about(12.0)]));
    }
    if i % 600 == 500 {
        told.push(Request::Pose([pitch_deg, 0.0]));
    }
    if i % 700 == 350 {
        let near = |noise: &mut Noise| 0.8 + 0.4 * noise.unit();
        told.push(Request::Tune([near(noise), near(noise), near(noise), 0.002 * noise.unit()]));
    }
    if i % 97 == 50 {
        told.push(Request::Save);
        told.push(Request::Gradient([noise.about(1.0), noise.about(1.0), noise.about(1.0)]));
        told.push(Request::Grip([noise.about(0.5), noise.about(0.5), 0.5 * noise.unit(), 0.5 + noise.unit()]));
    }
    if i % 53 == 20 {
        told.push(Request::Driven {
            by_normal_force: i % 2 == 0,
            by_friction: i % 3 == 0,
            numbers: [
                1.0 + noise.about(0.3),
                0.3 + noise.about(0.29),
                noise.about(0.05),
                noise.about(0.05),
                noise.about(0.2),
                noise.about(0.2),
                noise.about(0.01),
                DT_S,
            ],
        });
    }
    if i % 401 == 200 {
        let (nan, temperature_c) = (f32::NAN, 32.0 + noise.about(4.0));
        let (hydration_au, series_s) = (35.0 + noise.about(30.0), i as f32);
        let finger_width_mm = 16.0 + noise.about(2.0);
        // Voltages within the table's range, beyond it, and none.
        let voltage_v = if i % 1203 == 200 { nan } else { 100.0 + noise.about(130.0) };
        let own = [voltage_v, 0.0, 0.0, 0.0];
        let [hydration, width] = [hydration_au, finger_width_mm];
        let state = [hydration, temperature_c, width, series_s, nan, nan, nan];
        told.push(Request::Around(std::array::from_fn(|k| if k < 7 { state[k] } else { own[k - 7] })));
    }
    if i % 211 == 100 {
        told.extend(nonsense(noise));
    }
    told
}

/// What no caller should say and some will.
fn nonsense(noise: &mut Noise) -> [Request; 9] {
    let wild = f32::from_bits(noise.bits());
    [
        step(f32::NAN, 0.01, 0.0, 0.0),
        step(0.8, f32::NAN, 0.125, f32::INFINITY),
        step(0.8, wild, -0.01, wild),
        step(9.0, 0.0, 1e30, 1e9),
        Request::Step([0.7, 0.0, 0.01, 0.0, -1.0]),
        Request::Factor(f32::NAN),
        Request::Pose([5.0, 0.0]),
        Request::Tune([1.0, f32::NAN, 1.0, 0.0]),
        Request::Grip([f32::NAN, 0.1, 0.2, 1.0]),
    ]
}
