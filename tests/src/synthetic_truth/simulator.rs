//! What a simulator of a finger must be able to do, and which there are.
//!
//! Main types: [`Simulator`], [`SimulatorKind`].

use super::Random;
use super::brush_finger::BrushFinger;
use super::effects::Effect;
use super::finger::Finger;
use super::half_space_finger::HalfSpaceFinger;
use super::laboratory::Scatter;
use super::protocol::Stroke;

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

/// Which simulator makes the sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum, serde::Serialize, serde::Deserialize)]
pub enum SimulatorKind {
    /// Bristles on one spring, strength a power of the pressure.
    First,
    /// An elastic half-space under an elliptic contact, strength tau_0 + alpha p.
    Second,
    /// A brush of bristles that ages, relaxes and has a weak law of speed in every file.
    Third,
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
        }
    }
}

/// Noise-free readings of all strokes.
pub fn all_readings(finger: &dyn Simulator, strokes: &[Stroke], effects: &[Effect]) -> Vec<Vec<[f64; 3]>> {
    strokes.iter().map(|s| finger.readings(s, effects, &Scatter::default())).collect()
}
