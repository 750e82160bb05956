//! The paths: a clean one (press, slide, hold, lift) and a disturbed one (noise, vibration, reversals, changing strength, spin,
//! nonsense), with every request on the way; then the same of a pad on every kind of body, in every pose.

use fingerpad::host::PadModelFile;

use crate::requests::Request;

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

/// Clean and disturbed with the shipped model, then both with the other one, which has effects and tables over a voltage, then
/// both with each pad.
pub fn story(pads: &[PadModelFile]) -> Vec<Request> {
    let mut requests = vec![Request::Model(0)];
    clean(&mut requests);
    requests.push(Request::Model(0));
    disturbed(&mut requests, &mut Noise(SEED));
    requests.push(Request::Model(1));
    clean(&mut requests);
    disturbed(&mut requests, &mut Noise(SEED + 1));
    requests.push(Request::Model(0));
    bed_frames(&mut requests, &mut Noise(SEED + 8));
    for (k, pad) in pads.iter().enumerate() {
        hand_over(&mut requests, pad.bytes());
        requests.push(Request::PadLoad(k));
        pad_clean(&mut requests);
        pad_frames(&mut requests, &mut Noise(SEED + 4 + k as u32));
        pad_disturbed(&mut requests, &mut Noise(SEED + 2 + k as u32));
    }
    requests
}

/// A pad's file, word by word.
fn hand_over(requests: &mut Vec<Request>, bytes: &[u8]) {
    let word = |four: &[u8]| u32::from_le_bytes(std::array::from_fn(|i| four.get(i).copied().unwrap_or(0)));
    for piece in bytes.chunks(44) {
        let mut words = [0; 11];
        let count = piece.len().div_ceil(4);
        words.iter_mut().zip(piece.chunks(4)).for_each(|(to, four)| *to = word(four));
        requests.push(Request::PadWords { words, count });
    }
}

/// The clean path alone.
pub fn clean_story() -> Vec<Request> {
    let mut requests = Vec::new();
    clean(&mut requests);
    requests
}

/// The disturbed path alone.
pub fn disturbed_story() -> Vec<Request> {
    let mut requests = Vec::new();
    disturbed(&mut requests, &mut Noise(SEED));
    requests
}

fn step(depth_mm: f32, x: f32, y: f32, spin: f32) -> Request {
    Request::Step([depth_mm, x, y, spin, DT_S])
}

/// Press to 1 mm, slide 2 mm obliquely, hold, lift.
fn clean(requests: &mut Vec<Request>) {
    requests.extend((1..=100).map(|k| step(0.01 * k as f32, 0.0, 0.0, 0.0)));
    requests.extend((0..200).map(|_| step(1.0, 0.01, 0.002, 0.0)));
    requests.extend((0..20).map(|_| step(1.0, 0.0, 0.0, 0.0)));
    requests.extend([Request::Gradient([0.0, 1.0, 0.2]), Request::Grip([0.1, 0.05, 0.2, 1.0]), Request::Save]);
    requests.extend((0..=100).map(|k| step(1.0 - 0.01 * k as f32, 0.0, 0.0, 0.0)));
}

fn disturbed(requests: &mut Vec<Request>, noise: &mut Noise) {
    let (mut depth, mut target, mut slide, mut spin) = (0.0f32, 1.0f32, [0.0f32; 2], 0.0f32);
    for i in 0..6000 {
        if i % 64 == 0 {
            target = 2.0 * noise.unit() - 0.2;
            slide = [noise.about(0.05), noise.about(0.05)];
            spin = noise.about(0.02);
            requests.push(Request::Factor(0.5 + noise.unit()));
        }
        depth += 0.1 * (target - depth);
        let vibration = if i % 128 < 64 { 0.01 * (0.7 * i as f32).sin() } else { 0.0 };
        requests.push(step(
            depth + noise.about(0.005) + vibration,
            slide[0] + noise.about(0.002),
            slide[1] + noise.about(0.002),
            spin + noise.about(0.001),
        ));
        requests.extend(now_and_then(i, noise));
    }
}

/// What interrupts a disturbed path at step `i`.
fn now_and_then(i: u32, noise: &mut Noise) -> Vec<Request> {
    let mut requests = Vec::new();
    if i % 700 == 350 {
        let near = |noise: &mut Noise| 0.8 + 0.4 * noise.unit();
        requests.push(Request::Tune([near(noise), near(noise), near(noise)]));
    }
    if i % 97 == 50 {
        requests.push(Request::Save);
        requests.push(Request::Gradient([noise.about(1.0), noise.about(1.0), noise.about(1.0)]));
        requests.push(Request::Grip([noise.about(0.5), noise.about(0.5), 0.5 * noise.unit(), 0.5 + noise.unit()]));
    }
    if i % 53 == 20 {
        requests.push(Request::Driven {
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
        requests.push(Request::Around(std::array::from_fn(|k| if k < 7 { state[k] } else { own[k - 7] })));
    }
    if i % 211 == 100 {
        requests.extend(nonsense(noise));
    }
    requests
}

/// What no caller should say and some will.
fn nonsense(noise: &mut Noise) -> [Request; 8] {
    let wild = f32::from_bits(noise.bits());
    [
        step(f32::NAN, 0.01, 0.0, 0.0),
        step(0.8, f32::NAN, 0.125, f32::INFINITY),
        step(0.8, wild, -0.01, wild),
        step(9.0, 0.0, 1e30, 1e9),
        Request::Step([0.7, 0.0, 0.01, 0.0, -1.0]),
        Request::Factor(f32::NAN),
        Request::Tune([1.0, f32::NAN, 1.0]),
        Request::Grip([f32::NAN, 0.1, 0.2, 1.0]),
    ]
}

/// A body of each kind in turn.
fn body(k: u32, [pitch, roll]: [f32; 2]) -> Request {
    let numbers = match k % 6 {
        1 => [20.0, 0.0, 0.0],
        2 => [4.0, 90.0, 0.0],
        3 => [2.0, -30.0, 90.0],
        4 => [-60.0, 0.0, 0.0],
        5 => [12.0, 25.0, 0.0],
        _ => [0.0; 3],
    };
    let [radius_mm, axis_deg, angle_deg] = numbers;
    let kind = [0, 1, 2, 3, 1, 2][k as usize % 6];
    Request::Body { kind, numbers: [radius_mm, axis_deg, angle_deg, pitch, roll] }
}

/// On each body: press to 1 mm, slide, turn and roll the finger, hold, lift.
fn pad_clean(requests: &mut Vec<Request>) {
    requests.push(Request::Pad([1.0; 3]));
    for k in 0..6 {
        requests.push(body(k, [30.0, 0.0]));
        let step = |depth: f32, x: f32, spin: f32, pitch: f32, roll: f32| {
            Request::PadStep([depth, x, 0.2 * x, spin, pitch, roll, DT_S])
        };
        requests.extend((1..=50).map(|i| step(0.02 * i as f32, 0.0, 0.0, 30.0, 0.0)));
        requests.extend((0..50).map(|_| step(1.0, 0.01, 0.0, 30.0, 0.0)));
        requests.extend((1..=50).map(|i| step(1.0, 0.0, 0.002, 30.0 + 0.2 * i as f32, -0.2 * i as f32)));
        requests.extend((0..10).map(|_| step(1.0, 0.0, 0.0, 40.0, -10.0)));
        requests.extend([Request::Patches, Request::PadSave]);
        // A hold, which tissue that relaxes does not stand, in steps from 10 us to longer than any time of it; steps of no time among them.
        let hold = |dt_s| Request::PadStep([1.0, 0.0, 0.0, 0.0, 40.0, -10.0, dt_s]);
        requests.extend((0..60).map(|i| hold(1e-5 * 1.3f32.powi(i))));
        requests.extend([0.0, -1.0, f32::NAN, f32::INFINITY, 1e9, 2e9].map(hold));
        requests.extend([Request::Patches, Request::PadSave]);
        requests.extend((0..=50).map(|i| step(1.0 - 0.02 * i as f32, 0.0, 0.0, 40.0, -10.0)));
    }
}

/// Shapes that come down on the finger, slide, turn and go, with noise; then nonsense.
fn pad_frames(requests: &mut Vec<Request>, noise: &mut Noise) {
    // Kind, sizes, edge, angle; distance of the origin below the surface, mm.
    let shapes: [(u32, [f32; 5], f32); 7] = [
        (0, [0.0; 5], 0.0),
        (1, [10.0, 0.0, 0.0, 0.0, 0.0], 10.0),
        (2, [14.0, 12.0, 8.0, 0.0, 0.0], 8.0),
        (3, [9.0, 20.0, 0.0, 0.0, 0.0], 9.0),
        (4, [12.0, 15.0, 0.0, 0.0, 0.0], 15.0),
        (5, [3.0, 0.0, 0.0, 0.0, 100.0], 0.0),
        (6, [20.0, 15.0, 6.0, 2.0, 0.0], 6.0),
    ];
    for (kind, numbers, under_mm) in shapes {
        requests.push(Request::Shape { kind, numbers });
        for i in 0..120u32 {
            let part = (i as f32 - 40.0).max(0.0);
            let depth = if i < 110 { 0.02 * i.min(50) as f32 - 0.1 } else { -0.5 };
            let (half, roll) = (-0.261_8 + 0.001 * part, 0.0005 * part);
            // A capsule lies along the finger's y axis.
            let lies: [f64; 4] =
                if kind == 3 { [0.5f64.sqrt(), 0.5f64.sqrt(), 0.0, 0.0] } else { [1.0, 0.0, 0.0, 0.0] };
            let turn =
                [f64::from(half).cos() * f64::from(roll).cos(), f64::from(roll).sin(), f64::from(half).sin(), 0.0];
            let [w, x, y, z] = product(turn, lies);
            let (sin, cos) = (-2.0 * half).sin_cos();
            let below = depth - under_mm + noise.about(0.002);
            requests.push(Request::Pose([
                -sin * below + 0.01 * part,
                0.004 * part + noise.about(0.002),
                cos * below,
                w as f32,
                x as f32,
                y as f32,
                z as f32,
                DT_S,
            ]));
        }
        let (wild, nan) = (f32::from_bits(noise.bits()), f32::NAN);
        requests.extend([
            Request::Pose([wild, wild, wild, 1.0, 0.0, 0.0, 0.0, DT_S]),
            Request::Pose([nan, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, DT_S]),
            Request::Pose([0.0, 0.0, 0.0, 2.0, 0.0, nan, 0.0, wild]),
            Request::Shape { kind: 7, numbers },
            Request::Shape { kind: 6, numbers: [nan, 1.0, 1.0, 1.0, 1.0] },
        ]);
    }
}

/// The same of a bed, in steps from 10 us to a second. It refuses curved shapes; the poses of one then go to the contact before.
fn bed_frames(requests: &mut Vec<Request>, noise: &mut Noise) {
    let mut framed = Vec::new();
    pad_frames(&mut framed, noise);
    requests.extend(framed.into_iter().enumerate().map(|(i, request)| match request {
        Request::Shape { kind, numbers } => Request::BedShape { kind, numbers },
        Request::Pose([place @ .., _]) => {
            let [x, y, z, w, a, b, c] = place;
            Request::BedPose([x, y, z, w, a, b, c, [1e-5, DT_S, 0.03, 1.0][i % 4]])
        }
        other => other,
    }));
}

/// Product of two quaternions, w first.
fn product([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

/// On bodies that change: noise, reversals, spin, rolling, changing strength and finger, and nonsense.
fn pad_disturbed(requests: &mut Vec<Request>, noise: &mut Noise) {
    let (mut depth, mut target, mut slide, mut spin) = (0.0f32, 1.0f32, [0.0f32; 2], 0.0f32);
    let (mut pose, mut toward) = ([30.0f32, 0.0], [30.0f32, 0.0]);
    for i in 0..3000u32 {
        if i % 64 == 0 {
            target = 2.5 * noise.unit() - 0.2;
            slide = [noise.about(0.05), noise.about(0.05)];
            spin = noise.about(0.02);
            toward = [40.0 + noise.about(35.0), noise.about(35.0)];
            requests.push(Request::PadFactor(0.5 + noise.unit()));
        }
        if i % 500 == 300 {
            let near = |noise: &mut Noise| 0.8 + 0.4 * noise.unit();
            requests.push(Request::Pad([near(noise), near(noise), near(noise)]));
        }
        if i % 250 == 50 || i % 500 == 300 {
            requests.push(body(noise.bits() >> 20, pose));
        }
        depth += 0.1 * (target - depth);
        for (at, to) in pose.iter_mut().zip(toward) {
            *at += 0.05 * (to - *at);
        }
        requests.push(Request::PadStep([
            depth + noise.about(0.005),
            slide[0] + noise.about(0.002),
            slide[1] + noise.about(0.002),
            spin + noise.about(0.001),
            pose[0] + noise.about(0.05),
            pose[1] + noise.about(0.05),
            DT_S,
        ]));
        if i % 97 == 50 {
            requests.extend([Request::PadSave, Request::Patches]);
        }
        if i % 211 == 100 {
            requests.extend(pad_nonsense(noise));
        }
    }
}

fn pad_nonsense(noise: &mut Noise) -> [Request; 11] {
    let wild = f32::from_bits(noise.bits());
    let nan = f32::NAN;
    let body = |kind, numbers| Request::Body { kind, numbers };
    [
        Request::PadStep([nan, 0.01, 0.0, 0.0, 30.0, 0.0, DT_S]),
        Request::PadStep([0.8, nan, 0.125, f32::INFINITY, 30.0, nan, DT_S]),
        Request::PadStep([0.8, wild, -0.01, wild, wild, wild, wild]),
        Request::PadStep([9.0, 0.0, 1e30, 1e9, -500.0, 500.0, -1.0]),
        Request::PadFactor(nan),
        Request::Pad([1.0, nan, 1.0]),
        body(4, [10.0, 0.0, 0.0, 30.0, 0.0]),
        body(1, [nan, 0.0, 0.0, 30.0, 0.0]),
        body(1, [0.0, 0.0, 0.0, 30.0, 0.0]),
        body(2, [10.0, 200.0, 0.0, 30.0, 0.0]),
        body(3, [-10.0, 0.0, 90.0, 30.0, 0.0]),
    ]
}
