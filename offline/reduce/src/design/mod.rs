//! The design of experiments: the paths of the finite-element runs, and the division into paths for the fit and held-out paths.
//!
//! Main types: [`DesignSettings`], [`Experiment`]; [`design`] lists the paths, [`batches`] and [`share`] divide them
//! among machines. Parameters of the paths come from Halton's sequence, so that a few paths fill depth, direction and
//! slide evenly and the design is the same on every machine.

mod bodies;
mod combined_motions;
mod deep_motions;
mod halton;
mod motions;
mod path_builder;
mod settings;
mod shares;
mod tip;
mod turned_motions;

use fingerpad_fe::experiment::RigidBodySettings;
use fingerpad_fe::load_path::{Drive, Path};

pub use halton::halton;
pub use settings::{DesignSettings, PathNumbers};
pub use shares::{Batch, batches, share};
pub use tip::{Tip, outline};

use crate::ReduceError;
use halton::HaltonPoint;

/// Kind of a path's motion. The order is that of the numbers in stored runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Press and lift, no slide.
    Press,
    /// Press, slide straight to full slip.
    Straight,
    /// Press, slide there and back, some nested.
    Reversal,
    /// Press, slide round corners.
    Turn,
    /// Press, slide, change the depth at fixed slide, slide on, lift.
    Depth,
    /// Depth and slide change together.
    Oblique,
    /// Random corners in the plane and in depth.
    Random,
    /// Press, slide to stick, partial or full slip, let the depth vibrate while the slide is held, slide on.
    Vibration,
    /// Press, spin, lift.
    Spin,
    /// Spin before, after and during a slide.
    SpinSlide,
    /// Spin there and back, some nested.
    SpinReversal,
    /// A slide at constant pitch and roll, every second one with a spin.
    Pose,
    /// Pitch and roll change in contact, without and with a slide.
    PoseChange,
    /// A slide under constant normal force.
    Force,
    /// Steps of the normal force while the slide is held.
    ForceStep,
    /// Slides at two depths, at a constant pitch and roll from the whole range, with a slide back or a spin.
    WidePose,
    /// As [`Self::PoseChange`], over the whole range.
    WidePoseChange,
    /// Large forces, as in a grip: presses, slides, spins and poses at depths beyond those of the other kinds.
    Deep,
    /// Several coordinates at once, as in movements of the hand: rolling under load, knobs, regrasps, wobbles, taps, strokes, vibration.
    Combined,
    /// Slides, spins and turns on a sphere, a cylinder and an edge.
    Body,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 20] = [
        Self::Press,
        Self::Straight,
        Self::Reversal,
        Self::Turn,
        Self::Depth,
        Self::Oblique,
        Self::Random,
        Self::Vibration,
        Self::Spin,
        Self::SpinSlide,
        Self::SpinReversal,
        Self::Pose,
        Self::PoseChange,
        Self::Force,
        Self::ForceStep,
        Self::WidePose,
        Self::WidePoseChange,
        Self::Deep,
        Self::Combined,
        Self::Body,
    ];

    /// Whether such paths have a constant pitch and roll.
    pub fn is_in_pose(self) -> bool {
        matches!(self, Self::Pose | Self::WidePose)
    }

    /// Whether pitch and roll change on such paths.
    pub fn changes_pose(self) -> bool {
        matches!(self, Self::PoseChange | Self::WidePoseChange)
    }

    /// Whether the bed of springs is fitted to such paths and scored on them. It represents neither deep paths nor bodies other than a plane.
    pub fn is_for_springs(self) -> bool {
        !matches!(self, Self::Deep | Self::Combined | Self::Body)
    }

    /// Index of the part of Halton's sequence from which such paths are drawn. Two kinds may share a part; they use its points differently.
    fn sequence(self) -> usize {
        (match self {
            Self::WidePose => Self::Pose,
            Self::WidePoseChange => Self::PoseChange,
            kind => kind,
        }) as usize
    }

    /// The spelling used in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Straight => "straight",
            Self::Reversal => "reversal",
            Self::Turn => "turn",
            Self::Depth => "depth",
            Self::Oblique => "oblique",
            Self::Random => "random",
            Self::Vibration => "vibration",
            Self::Spin => "spin",
            Self::SpinSlide => "spin_slide",
            Self::SpinReversal => "spin_reversal",
            Self::Pose => "pose",
            Self::PoseChange => "pose_change",
            Self::Force => "force",
            Self::ForceStep => "force_step",
            Self::WidePose => "wide_pose",
            Self::WidePoseChange => "wide_pose_change",
            Self::Deep => "deep",
            Self::Combined => "combined",
            Self::Body => "body",
        }
    }
}

/// Whether the bed of springs represents the motion of a path: depth or normal force, slide or friction, and spin, in one pose.
pub fn is_representable(path: &Path) -> bool {
    let turns = &path.turns;
    let by_angle = turns.spin.as_ref().is_none_or(|spin| spin.drive == Drive::Displacement);
    by_angle && turns.pitch.is_none() && turns.roll.is_none()
}

/// One path of the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Unique name, `straight-07`; held-out ones end in `h`.
    pub name: String,
    /// Kind of motion.
    pub kind: Kind,
    /// Whether the path is excluded from the fit.
    pub held_out: bool,
    /// The body that moves.
    pub body: RigidBodySettings,
    /// Its motion.
    pub path: Path,
}

impl Experiment {
    /// Whether the fit's initial guess is read from this path.
    pub fn is_for_initial_guess(&self) -> bool {
        !self.held_out && matches!(self.kind, Kind::Press | Kind::Straight)
    }
}

/// Distance in Halton's sequence between the points of two kinds, and of two seeds.
const KIND_STRIDE: usize = 50;
const SEED_STRIDE: usize = 100_003;

/// All paths of a design: those for the fit and held-out ones.
///
/// # Errors
/// [`ReduceError::Design`] for invalid settings.
pub fn design(settings: &DesignSettings) -> Result<Vec<Experiment>, ReduceError> {
    settings.check()?;
    let mut all = Vec::new();
    for &depth in &settings.axis_depths_mm {
        for quarter in 0..4 {
            let angle = f64::from(quarter) * std::f64::consts::FRAC_PI_2;
            let path = |_| (RigidBodySettings::default(), motions::straight(settings, depth, angle));
            add(&mut all, Kind::Straight, false, path);
        }
    }
    for kind in Kind::ALL {
        let [calibration, held_out] = settings.paths.of(kind);
        let paths = calibration + held_out;
        for i in 0..paths {
            // Fit and held-out paths alternate along the sequence, so that both fill the ranges.
            let late = i * held_out / paths != (i + 1) * held_out / paths;
            let in_turn = |i: usize| if calibration == held_out { in_turn(i) } else { i };
            add(&mut all, kind, late, |number| {
                let drawn = match kind {
                    // Four paths that differ only in the amplitude share the other parameters.
                    Kind::Vibration => in_turn(2 * (number / motions::AMPLITUDES) + usize::from(late)),
                    _ => in_turn(i),
                };
                let index = 1 + drawn + KIND_STRIDE * kind.sequence() + SEED_STRIDE * settings.seed as usize;
                let point = &mut HaltonPoint::new(index);
                let body = if kind == Kind::Body { bodies::body(number) } else { RigidBodySettings::default() };
                (body, one(settings, kind, number, point))
            });
        }
    }
    let depths_mm = [settings.depth_mm[1], settings.deep_mm[1]];
    all.iter_mut().for_each(|e| settings.tip.adapt(&mut e.path, depths_mm));
    Ok(all)
}

/// Index in the sequence of the `i`-th path where fit and held-out paths alternate: the paths of every second pair are exchanged. In base 2
/// small and large numbers alternate as well, so that otherwise one half of the design would get all small ones.
fn in_turn(i: usize) -> usize {
    i ^ (i >> 1 & 1)
}

/// Appends a path.
///
/// * `of`: returns its body and its motion from its number within kind and half
fn add(all: &mut Vec<Experiment>, kind: Kind, held_out: bool, of: impl FnOnce(usize) -> (RigidBodySettings, Path)) {
    let number = all.iter().filter(|e| e.kind == kind && e.held_out == held_out).count();
    let name = format!("{}-{number:02}{}", kind.as_str(), if held_out { "h" } else { "" });
    let (body, path) = of(number);
    all.push(Experiment { name, kind, held_out, body, path });
}

/// The path of a kind with drawn parameters.
///
/// * `number`: number within its kind and half
fn one(settings: &DesignSettings, kind: Kind, number: usize, point: &mut HaltonPoint) -> Path {
    match kind {
        Kind::Press => motions::press(settings, point),
        Kind::Straight => motions::drawn_straight(settings, point),
        Kind::Reversal => motions::reversal(settings, point),
        Kind::Turn => motions::turn(settings, point),
        Kind::Depth => motions::depth(settings, point),
        Kind::Oblique => motions::oblique(settings, point),
        Kind::Random => motions::random(settings, point),
        Kind::Vibration => motions::vibration(settings, number, point),
        Kind::Spin => turned_motions::spin(settings, point),
        Kind::SpinSlide => turned_motions::spin_slide(settings, number, point),
        Kind::SpinReversal => turned_motions::spin_reversal(settings, point),
        Kind::Pose => turned_motions::pose(settings, number, point),
        Kind::PoseChange => turned_motions::pose_change(settings, settings.near_poses_deg(), point),
        Kind::WidePose => turned_motions::wide_pose(settings, number, point),
        Kind::WidePoseChange => turned_motions::pose_change(settings, settings.wide_poses_deg(), point),
        Kind::Force => motions::force(settings, point),
        Kind::ForceStep => motions::force_step(settings, point),
        Kind::Deep => deep_motions::deep(settings, number, point),
        Kind::Combined => combined_motions::combined(settings, number, point),
        Kind::Body => bodies::path(settings, number, point),
    }
}

#[cfg(test)]
mod tests;
