//! What a simulator of a finger must be able to do, and which there are. The physics of each is its own; this file has what they
//! share: the steps along a stroke, and what the sensor adds to the forces.
//!
//! Main types: [`Simulator`], [`Stepped`], [`SimulatorKind`].

use super::Random;
use super::brush_finger::BrushFinger;
use super::continuum_finger::ContinuumFinger;
use super::effects::{Effect, Influence};
use super::finger::Finger;
use super::half_space_finger::HalfSpaceFinger;
use super::laboratory::Scatter;
use super::protocol::{Moment, Stroke};

/// A finger on a plate.
pub trait Simulator: Send + Sync {
    /// Readings along a stroke: normal, x, y per row, N.
    fn readings(&self, stroke: &Stroke, effects: &[Effect], scatter: &Scatter) -> Vec<[f64; 3]>;

    /// How far a perfect analyst lets each of the finger's numbers move from the calibration: scales of normal force and
    /// friction freely (a pure rescale is never an effect), then that of the tangential stiffness, then the shape.
    fn freedoms(&self) -> &'static [f64];

    /// The finger with one of its freedoms moved.
    fn vary(&self, freedom: usize, by: f64) -> Box<dyn Simulator>;

    /// Families of laws that the finger itself follows, in the calibration too. Runs whose conditions vary show them, so that naming them is
    /// a true statement about the finger, planted or not.
    fn own_families(&self) -> &'static [&'static str] {
        &[]
    }
}

/// A step of the plate against a finger in contact.
pub struct Step<'a> {
    /// Depth at its end, above 0, mm.
    pub depth_mm: f64,
    /// Slide, with what pressing pushes aside, mm.
    pub slide_mm: [f64; 2],
    /// Time that it takes, s.
    pub time_s: f64,
    /// What holds at the end of the row that it belongs to.
    pub moment: &'a Moment,
    /// What effects and scatter do to that row.
    pub influence: &'a Influence,
}

/// A finger that is moved in steps.
pub trait Stepped {
    /// What it remembers.
    type State;

    /// The state in the air.
    fn in_the_air(&self) -> Self::State;
    /// Load at a depth, N.
    fn load(&self, depth_mm: f64) -> f64;
    /// Contact area at a depth, mm².
    fn area(&self, depth_mm: f64) -> f64;
    /// Slide per depth while pressing, x and y.
    fn press(&self) -> [f64; 2];
    /// Steps of a row, from its change of depth and its slide, mm.
    fn steps(&self, sunk_mm: f64, slide_mm: f64) -> f64;
    /// Makes a step.
    fn step(&self, state: &mut Self::State, step: &Step<'_>);
    /// Normal force without adhesion, and friction along x and y, at a depth above 0, N.
    fn forces(&self, state: &Self::State, depth_mm: f64, influence: &Influence) -> (f64, [f64; 2]);
}

/// Readings of a finger along a stroke: normal, x, y per row, N.
pub fn readings<F: Stepped>(finger: &F, stroke: &Stroke, effects: &[Effect], scatter: &Scatter) -> Vec<[f64; 3]> {
    let mut state = finger.in_the_air();
    let (mut depth_before, mut at_before, mut t_before) = (0.0f64, [0.0f64; 2], f64::NAN);
    let mut row = |moment: &Moment| {
        let mut influence = moment.influence(stroke, effects, finger.load(moment.depth_mm.max(0.0)));
        influence.stiffness *= scatter.stiffness;
        influence.strength *= scatter.strength;
        let touching = moment.depth_mm > 0.0;
        let depth = if touching { moment.depth_mm + influence.depth_mm + scatter.depth_mm } else { 0.0 }.max(0.0);
        let sunk = depth - depth_before;
        let slide = [0, 1].map(|k| moment.position_mm[k] - at_before[k] + finger.press()[k] * sunk);
        let steps = finger.steps(sunk.abs(), slide[0].hypot(slide[1])).max(1.0);
        let time_s = if t_before.is_nan() { 0.0 } else { moment.t_s - t_before } / steps;
        for k in 1..=steps as usize {
            let depth_mm = depth_before + k as f64 / steps * sunk;
            if depth_mm > 0.0 {
                let slide_mm = slide.map(|s| s / steps);
                finger.step(&mut state, &Step { depth_mm, slide_mm, time_s, moment, influence: &influence });
            } else {
                state = finger.in_the_air();
            }
        }
        (depth_before, at_before, t_before) = (depth, moment.position_mm, moment.t_s);
        let (normal, friction) = if depth > 0.0 { finger.forces(&state, depth, &influence) } else { (0.0, [0.0; 2]) };
        let area = if depth > 0.0 { finger.area(depth) } else { 0.0 };
        sensed(normal, friction, area, moment, &influence, scatter)
    };
    stroke.moments().iter().map(&mut row).collect()
}

/// What the sensor reads of the normal force and of friction, N, at a contact area, mm²: with adhesion, drag, cross-talk and bias.
pub fn sensed(
    normal_n: f64,
    friction_n: [f64; 2],
    area_mm2: f64,
    moment: &Moment,
    influence: &Influence,
    scatter: &Scatter,
) -> [f64; 3] {
    let area = area_mm2 / 63.5;
    let normal = normal_n - influence.adhesion_n * area.sqrt();
    let drag = influence.drag_n_s_mm * moment.speed_mm_s * area * (1.0 - (-moment.turn_mm / 0.2).exp());
    let (sin, cos) = moment.direction.sin_cos();
    let [bias, offset] = [influence.bias_n, scatter.offset_n];
    [
        normal + bias[0] + offset[0],
        friction_n[0] + drag * cos + influence.cross[0] * normal + bias[1] + offset[1],
        friction_n[1] + drag * sin + influence.cross[1] * normal + bias[2] + offset[2],
    ]
}

/// Which simulator makes the sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum, serde::Serialize, serde::Deserialize)]
pub enum SimulatorKind {
    /// Bristles on one spring, strength a power of the pressure.
    First,
    /// An elastic half-space under an elliptic contact, strength tau_0 + alpha p.
    Second,
    /// A brush of bristles that ages, relaxes and has a weak law of speed in every file.
    Third,
    /// A grid of cells with coupled pressures on a tissue that relaxes in every file.
    Fourth,
}

impl SimulatorKind {
    /// Those of the score, whose fingers follow no law of their own.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// A finger of a seed.
    pub fn finger(self, random: &mut Random) -> Box<dyn Simulator> {
        match self {
            Self::First => Box::new(Finger::random(random)),
            Self::Second => Box::new(HalfSpaceFinger::random(random)),
            Self::Third => Box::new(BrushFinger::random(random)),
            Self::Fourth => Box::new(ContinuumFinger::random(random)),
        }
    }
}

/// Noise-free readings of all strokes.
pub fn all_readings(finger: &dyn Simulator, strokes: &[Stroke], effects: &[Effect]) -> Vec<Vec<[f64; 3]>> {
    strokes.iter().map(|s| finger.readings(s, effects, &Scatter::default())).collect()
}
