//! Models, paths and disturbances for the tests.
#![allow(dead_code)]

pub mod books;
pub mod golden;
pub mod golden_pad;
pub mod law_vectors;
pub mod vectors;

use fingerpad::build::{Data, Params, ParamsOf};
use fingerpad::host::PadModelFile;
use fingerpad::pad::{Numbers, Pad, Patch};
use fingerpad::{Error, FileOf, Motion, Response, State, Tuning, step};
use proptest::prelude::*;

pub fn example() -> Data {
    Params::example().try_build().unwrap()
}

/// The models that tests run on: the example and the shipped file. That the file reads is the matter of `file.rs`.
pub fn models() -> Vec<(&'static str, Data)> {
    let shipped = read(include_bytes!("../data/fingertip.fpm")).ok();
    [("example", example())].into_iter().chain(shipped.map(|data| ("shipped", data))).collect()
}

/// The shipped model.
pub fn shipped() -> Data {
    read(include_bytes!("../data/fingertip.fpm")).unwrap()
}

/// The pad that ships.
pub fn shipped_pad() -> PadModelFile {
    PadModelFile::new(include_bytes!("../data/fingertip-pad.fpm")).unwrap()
}

/// The shipped pad in double precision.
pub struct Double {
    pub numbers: Numbers<f64>,
    pub patches: Vec<Patch<f64>>,
}

impl Double {
    pub fn new() -> Self {
        let file = shipped_pad();
        let pad = file.file().pad;
        Self { numbers: pad.numbers.cast(), patches: pad.patches.iter().map(|p| p.cast()).collect() }
    }
    pub fn pad(&self) -> Pad<'_, f64> {
        Pad::new(&self.patches, &self.numbers)
    }
}

/// The model of a file, from a copy that is aligned as the reader requires.
fn read(bytes: &[u8]) -> Result<Data, Error> {
    let words: Vec<u64> =
        bytes.chunks(8).map(|c| u64::from_ne_bytes(core::array::from_fn(|i| c.get(i).copied().unwrap_or(0)))).collect();
    FileOf::from_bytes(&bytemuck::cast_slice(&words)[..bytes.len()]).map(|file| *file.model.data())
}

pub fn motion(depth: f32, x: f32, y: f32) -> Motion {
    Motion { depth_mm: depth, slide_increment_mm: [x, y], spin_increment_rad: 0.0, dt_s: 1e-3 }
}

/// Numbers that look random and are the same every time.
#[derive(Clone, Copy)]
pub struct Noise(pub u64);

impl Noise {
    /// Uniform in −1 to 1.
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// A path as absolute positions of the plane: depth, slide x, slide y.
#[derive(Clone)]
pub struct Path(pub Vec<[f64; 3]>);

impl core::fmt::Debug for Path {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} positions, first {:?}", self.0.len(), &self.0[..self.0.len().min(4)])
    }
}

impl core::ops::Deref for Path {
    type Target = [[f64; 3]];
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

/// Corners of a path that starts and ends in the air at the same place, with the length of the steps between them.
pub fn closed_path() -> impl Strategy<Value = Path> {
    let corner = (-0.2f64..2.5, -4.0f64..4.0, -4.0f64..4.0);
    (prop::collection::vec(corner, 2..8), 0.004f64..0.15).prop_map(|(corners, length)| {
        let mut path = Path(vec![[-0.05, 0.0, 0.0]]);
        let mut here = path[0];
        for (d, x, y) in corners {
            walk(&mut path, here, [d, x, y], length);
            here = [d, x, y];
        }
        walk(&mut path, here, [-0.05, 0.0, 0.0], length);
        path
    })
}

/// Appends the straight way from `from` to `to` in steps of about `length`, without `from`.
pub fn walk(path: &mut Path, from: [f64; 3], to: [f64; 3], length: f64) {
    let span = (0..3).map(|i| (to[i] - from[i]).abs()).fold(0.0, f64::max);
    let n = (span / length).ceil().max(1.0) as usize;
    for k in 1..=n {
        let s = k as f64 / n as f64;
        path.0.push(core::array::from_fn(|i| from[i] + s * (to[i] - from[i])));
    }
}

/// Runs a path and calls `each` with the step's displacement and response.
pub fn run(data: &Data, path: &[[f64; 3]], mut each: impl FnMut([f64; 3], &Response)) -> State {
    let model = data.model().unwrap();
    let mut state = State::default();
    for pair in path.windows(2) {
        let by: [f64; 3] = core::array::from_fn(|i| pair[1][i] - pair[0][i]);
        let response = step(&model, &mut state, motion(pair[1][0] as f32, by[1] as f32, by[2] as f32));
        each(by, &response);
    }
    state
}

/// One step of a disturbed path: what is changed before it, and the motion.
#[derive(Clone, Copy, Debug)]
pub struct Disturbed {
    pub factor: f32,
    pub tuning: Tuning,
    pub motion: Motion,
}

/// A path on which depth, slide and angle are noisy and strength factor and tuning change now and then, or in every step.
#[derive(Clone)]
pub struct DisturbedPath(pub Vec<Disturbed>);

impl core::fmt::Debug for DisturbedPath {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} steps, first {:?}", self.0.len(), &self.0[..self.0.len().min(3)])
    }
}

pub fn any_tuning() -> impl Strategy<Value = Tuning> {
    let log = |low: f32, high: f32| (low.ln()..high.ln()).prop_map(f32::exp);
    let ranges = (log(0.5, 2.0), log(0.2, 5.0), log(0.1, 10.0));
    ranges.prop_map(|(size, stiffness, lambda)| Tuning { size, stiffness, lambda })
}

/// Disturbed paths; `turns` with spin, `tuned` with changes of the tuning.
pub fn disturbed_path(turns: bool, tuned: bool) -> impl Strategy<Value = DisturbedPath> {
    let angle = if turns { -0.6f32..0.6 } else { 0.0..0.0001 };
    let tuning = if tuned { prop::option::of(any_tuning()).boxed() } else { Just(None).boxed() };
    let factor = prop::option::of((0.1f32.ln()..5.0f32.ln()).prop_map(f32::exp));
    let corner = ((-0.2f32..2.6, -4.0f32..4.0, -4.0f32..4.0, angle), factor, tuning);
    let noise = prop_oneof![Just(0.0f32), Just(1e-6), Just(1e-3), Just(0.02)];
    (prop::collection::vec(corner, 2..8), 0.004f32..0.3, noise, any::<bool>(), any::<u64>()).prop_map(
        move |(corners, length, noise, every_step, seed)| {
            let mut noisy = Noise(seed);
            let (mut steps, mut here) = (vec![], [-0.05f32, 0.0, 0.0, 0.0]);
            let (mut factor, mut tuning) = (1.0f32, Tuning::default());
            for ((d, x, y, angle), new_factor, new_tuning) in corners {
                let to = [d, x, y, if turns { angle } else { 0.0 }];
                let span = (0..4).map(|i| (to[i] - here[i]).abs()).fold(0.0, f32::max);
                let n = (span / length).ceil().max(1.0);
                let by = [0, 1, 2, 3].map(|i| (to[i] - here[i]) / n);
                factor = new_factor.unwrap_or(factor);
                if let Some(new) = new_tuning {
                    tuning = new;
                }
                for k in 1..=n as usize {
                    let depth_mm = here[0] + by[0] * k as f32 + noise * noisy.next();
                    let slide_increment_mm = [by[1], by[2]].map(|s| s + noise * noisy.next());
                    let spin_increment_rad = if turns { by[3] + 0.1 * noise * noisy.next() } else { 0.0 };
                    let wave = if every_step { 1.0 + 0.3 * noisy.next() } else { 1.0 };
                    steps.push(Disturbed {
                        factor: factor * wave,
                        tuning: Tuning { lambda: (tuning.lambda * wave).clamp(0.1, 10.0), ..tuning },
                        motion: Motion { depth_mm, slide_increment_mm, spin_increment_rad, dt_s: 1e-3 },
                    });
                }
                here = to;
            }
            DisturbedPath(steps)
        },
    )
}

/// A model that prints briefly.
#[derive(Clone)]
pub struct AnyModel(pub Data);

impl core::fmt::Debug for AnyModel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "odd {} {:?} {:?}", self.0.odd, self.0.springs, self.0.rows[10])
    }
}

impl core::ops::Deref for AnyModel {
    type Target = Data;
    fn deref(&self) -> &Data {
        &self.0
    }
}

/// Models of all kinds that pass the check: the example with its freedoms drawn up to the limits, tables wavy over depth.
pub fn any_model() -> impl Strategy<Value = AnyModel> {
    let tables = (0.4f32..1.6, 0.6f32..1.5, -0.05f32..0.05, -0.1f32..0.1, 0.0f32..0.3, 0.0f32..6.0);
    let springs = prop::array::uniform4((0.1f32..1.0, 0.0f32..1.2, 0.0f32..1.0, -3.0f32..3.0, 0.5f32..6.0));
    let slopes = (-0.02f32..0.02, -0.02f32..0.02, -0.2f32..0.2);
    (tables, springs, slopes).prop_filter_map("passive", |(tables, springs, (slope_x, slope_y, odd))| {
        let (ratio, strength, press, tilt, wave, phase) = tables;
        let all: f32 = springs.iter().map(|s| s.0).sum();
        let mut params = ParamsOf::example_with(springs.map(|s| (s.0 / all, s.1)));
        params.stiffness_n_mm[1] = params.stiffness_n_mm[0] * ratio;
        params.odd_per_mm = odd;
        for (j, (spring, s)) in params.springs.iter_mut().zip(springs).enumerate() {
            (spring.sharpness, spring.centre_mm) = (s.2, s.3);
            spring.arm_mm = if j % 2 == 0 { [s.4, 0.3] } else { [0.2, s.4] };
        }
        for (i, node) in params.nodes.iter_mut().enumerate() {
            let up = |by: f32| 1.0 + wave * (phase + by + 0.4 * i as f32).sin();
            node.strength_ratio = strength * up(1.0);
            node.press_coupling = press * up(2.0);
            node.stiffness_slope_n_mm2 = [slope_x * up(3.0), slope_y * up(4.0)];
            node.tilt_x *= tilt / 0.05;
        }
        params.try_build().ok().map(AnyModel)
    })
}
