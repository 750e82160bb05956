//! Inputs of a run along a path, and the reasons for its early end.

use std::ops::ControlFlow;

use fingerpad::Relaxation;
use nalgebra::Vector3;

use super::{Cost, HalfFinger, Model, Observed, Path, Response, Trajectory};
use crate::assembly::Body;
use crate::contact::{FrictionLaw, Outline, PenaltySettings, RigidBody, RubberFriction};
use crate::solve::{PadFaces, SolveError, SolverSettings};

/// Sizes of the increments.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoadSettings {
    /// Largest increment of depth without friction, mm.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_depth_step_mm: f64,
    /// Largest increment of depth while friction acts, mm: the shear after a press has an error of first order in it.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_depth_step_with_friction_mm: f64,
    /// Largest increment of slide, mm.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_slide_step_mm: f64,
    /// Largest increment of slide in steady full slip, mm. Left out of the settings' hash if it is the default.
    #[serde(deserialize_with = "fingerpad_formats::units::positive", skip_serializing_if = "is_default_steady_step")]
    pub max_steady_slide_step_mm: f64,
    /// Largest increment of a driven force, N.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub max_force_step_n: f64,
    /// An increment is not cut below this share of the largest.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub min_step_share: f64,
    /// Whether friction acts from the first touch on, or only from the first row of the path that slides.
    pub friction_while_pressing: bool,
}

impl Default for LoadSettings {
    fn default() -> Self {
        Self {
            max_depth_step_mm: 0.25,
            max_depth_step_with_friction_mm: 0.08,
            max_slide_step_mm: 0.2,
            max_steady_slide_step_mm: 2.0,
            max_force_step_n: 0.1,
            min_step_share: 1e-4,
            friction_while_pressing: true,
        }
    }
}

fn is_default_steady_step(step_mm: &f64) -> bool {
    *step_mm == LoadSettings::default().max_steady_slide_step_mm
}

/// Everything that a run needs besides body and path.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The body.
    pub body: &'a Body,
    /// Faces that may touch the rigid body, as mesh node numbers.
    pub pad_faces: PadFaces<'a>,
    /// The rigid body that the finger touches.
    pub rigid_body: RigidBody,
    /// The undeformed surface, from which depth counts; None for the nodes of the faces.
    pub outline: Option<Outline>,
    /// The half of the body that replaces the whole on symmetric paths; None to follow all paths with the whole.
    pub half: Option<&'a HalfFinger>,
    /// Friction law; None presses and slides without friction.
    pub friction: Option<RubberFriction>,
    /// Contact.
    pub penalty: PenaltySettings,
    /// Equilibrium.
    pub settings: SolverSettings,
    /// Increments.
    pub load_steps: LoadSettings,
    /// Angle between the finger's axis and the plane in the neutral pose, tip down, degrees.
    pub neutral_pitch_deg: f64,
    /// Points of the finger's supports, mm: a pose in which the plane would meet one ends the run.
    pub obstacles: &'a [Vector3<f64>],
    /// Nodes of the skin's outside that are not of the pad: a run in which the plane reaches one ends.
    pub beside_pad: &'a [u32],
    /// Depth at which a plane reaches the finger's supports, mm; a run on a plane ends before. Infinite if there is no
    /// such depth.
    pub clearance_mm: f64,
    /// Branches of the soft tissue.
    pub relaxation: Relaxation,
    /// Quantities observed at every increment; None for none.
    pub observed: Option<&'a Observed>,
}

impl<'a> Problem<'a> {
    /// Model of a run along `path`.
    pub(super) fn model(&self, path: &Path) -> Model<'a> {
        if path.is_symmetric() { self.symmetric_model() } else { self.whole_model() }
    }

    /// Model for states that are symmetric about y = 0: the half, if there is one, the rigid body is symmetric too and friction is
    /// isotropic.
    pub fn symmetric_model(&self) -> Model<'a> {
        let is_isotropic = self.friction.is_none_or(|law| law.orthotropy().is_none());
        match self.half.filter(|_| self.rigid_body.is_symmetric() && is_isotropic) {
            Some(half) => Model { body: &half.body, pad_faces: (&half.mesh.mesh).into(), half: Some(half) },
            None => self.whole_model(),
        }
    }

    fn whole_model(&self) -> Model<'a> {
        Model { body: self.body, pad_faces: self.pad_faces, half: None }
    }
}

/// Progress of a run, reported after every increment and, with the effort so far, many times within.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Done share of the path, 0 to 1, by length.
    pub share: f64,
    /// Cost so far, that of the present increment included.
    pub cost: Cost,
    /// Last response.
    pub response: Response,
}

/// Receives the progress of a run; may end it.
pub type OnProgress<'p> = &'p mut dyn FnMut(Progress) -> ControlFlow<()>;

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum LoadPathError {
    /// The path cannot be followed.
    #[error("path: {0}")]
    Path(String),
    /// An increment failed however small.
    #[error(
        "no equilibrium beyond t = {t_s:.4} s (depth {depth_mm:.4} mm, slide {slide_x_mm:.4}, {slide_y_mm:.4} mm, row {row}): \
         increment {increment} of {step_share:.1e} of the largest step failed: {cause}"
    )]
    NoEquilibrium {
        /// Time of the last equilibrium, s.
        t_s: f64,
        /// Depth there, mm.
        depth_mm: f64,
        /// Slide there, mm.
        slide_x_mm: f64,
        /// Slide there, mm.
        slide_y_mm: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Number of the increment.
        increment: u32,
        /// Size of the last attempt.
        step_share: f64,
        /// The last failure.
        cause: SolveError,
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
    /// A driven friction force is more than friction holds.
    #[error(
        "row {row} drives a friction force of {wanted_n:.4} N, beyond what friction holds here \
         ({holds_n:.4} N at this load, {normal_force_n:.4} N; t = {t_s:.4} s)"
    )]
    BeyondFriction {
        /// Time of the last equilibrium, s.
        t_s: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Friction force that the row prescribes, N.
        wanted_n: f64,
        /// Largest force in its direction that the strengths of all contact points carry, N.
        holds_n: f64,
        /// Normal force, N.
        normal_force_n: f64,
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
    /// A driven moment about the plane's normal, alone or with a driven friction force, is more than friction holds.
    #[error(
        "row {row} drives a spin moment of {wanted_n_mm:.4} N mm{}, beyond what friction holds here ({holds_n_mm:.4} N mm \
         at this load, {normal_force_n:.4} N; t = {t_s:.4} s)",
        with_force(*with_n)
    )]
    BeyondFrictionMoment {
        /// Time of the last equilibrium, s.
        t_s: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Moment that the row prescribes, N mm.
        wanted_n_mm: f64,
        /// Friction force that the row drives with it, N.
        with_n: f64,
        /// Largest moment that the strengths of all contact points carry together with the row's share of the force, N
        /// mm.
        holds_n_mm: f64,
        /// Normal force, N.
        normal_force_n: f64,
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
    /// The plane reached the finger's supports.
    #[error(
        "row {row}: the plane meets the held section of the finger or its bone at a depth of {clearance_mm:.3} mm \
         (t = {t_s:.4} s, {normal_force_n:.3} N)"
    )]
    NotClear {
        /// Time of the last equilibrium, s.
        t_s: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Depth at which they meet, mm.
        clearance_mm: f64,
        /// Normal force at the last equilibrium, N.
        normal_force_n: f64,
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
    /// The plane reached skin that is not of the pad.
    #[error(
        "row {row}: the plane reaches {below_mm:.4} mm into skin beside the faces that may touch (t = {t_s:.4} s, depth \
         {depth_mm:.3} mm)"
    )]
    BesidePad {
        /// Time of the last equilibrium, s.
        t_s: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Depth there, mm.
        depth_mm: f64,
        /// Depth of the skin behind the plane, mm.
        below_mm: f64,
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
    /// A face of the finger is inside out on the rigid body.
    #[error(
        "row {row}: the rigid body, whose radius is {radius_mm:.2} mm there, has passed through a face of {face_mm:.2} mm \
         between its nodes (t = {t_s:.4} s); take a finer mesh, whose faces are at most half as large as the radius"
    )]
    InsideOut {
        /// Time of the last row, s.
        t_s: f64,
        /// Row of the path that was being approached (0 is the start).
        row: usize,
        /// Size of the face, mm.
        face_mm: f64,
        /// Radius of the body's curvature, mm.
        radius_mm: f64,
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
    /// The state of the run cannot be saved.
    #[error(transparent)]
    Checkpoint(#[from] fingerpad_formats::Error),
    /// The caller requested the end.
    #[error("interrupted")]
    Interrupted {
        /// The rows up to there.
        reached: Box<Trajectory>,
    },
}

fn with_force(force_n: f64) -> String {
    if force_n > 0.0 { format!(" with a friction force of {force_n:.4} N") } else { String::new() }
}

impl LoadPathError {
    /// The rows before the run ended; empty if there are none.
    pub fn take_reached(&mut self) -> Trajectory {
        match self {
            Self::NoEquilibrium { reached, .. }
            | Self::BeyondFriction { reached, .. }
            | Self::BeyondFrictionMoment { reached, .. }
            | Self::NotClear { reached, .. }
            | Self::BesidePad { reached, .. }
            | Self::InsideOut { reached, .. }
            | Self::Interrupted { reached } => std::mem::take(reached),
            Self::Path(_) | Self::Checkpoint(_) => Trajectory::default(),
        }
    }
}
