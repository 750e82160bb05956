//! A path (press, slide, lift) becomes a trajectory of responses, by adaptive load steps.
//!
//! Main types: [`Finger`], [`Problem`], [`Path`], [`Response`], [`Snapshot`], [`Trajectory`]; [`follow_path`] runs one.
//! [`LoadSteps`] with [`load_along`] is the load stepping itself, [`pass_limit_point`] passes limit points. May use:
//! solve, assembly, contact, material, element, mesh.

mod beside_pad;
mod checkpoint;
mod clearance;
mod driven;
mod finger;
mod follow;
mod friction_limit;
mod half;
mod limit_point;
mod mesh_error;
mod observed;
mod path;
pub mod path_csv;
mod path_end;
pub mod readings_csv;
mod response;
pub mod response_csv;
mod run;
mod settings;
mod steady_slip;
mod stepping;
pub mod vtu;

use fingerpad::{Regime, Status};
use nalgebra::Vector3;

use crate::element::ElementStress;

pub use beside_pad::{BESIDE_PAD_MM, below_beside_pad_mm};
pub use checkpoint::Checkpoint;
pub use clearance::{Clearance, Obstacle};
pub use finger::{Bone, BoneKind, Finger, Numerics, Tissue, neutral_pitch_deg, outline};
pub use follow::{follow_path, press_limits};
pub use half::{HalfFinger, Model, Symmetry};
pub use limit_point::{LimitPointRule, Passage, pass_limit_point};
pub use mesh_error::{MeshError, face_mm};
pub use observed::{Observed, Probe, ProbeError, ProbeReading, Reaction, Reading, SUPPORTS, papillae, probes};
pub use path::{Drive, Path, Turn, Turns, Waypoint};
pub use path_end::{PathEnd, RunOptions, follow};
pub use settings::{LoadPathError, LoadSettings, OnProgress, Problem, Progress};
pub use stepping::{FailedStep, LoadSteps, Standing, StepRule, load_along};

/// One row of a response file: forces that the plane exerts on the finger.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Response {
    /// Time, s.
    pub t_s: f64,
    /// Travel of the plane from first touch, mm, positive into the finger.
    pub depth_mm: f64,
    /// Displacement of the plane along x, mm.
    pub slide_x_mm: f64,
    /// Displacement of the plane along y, mm.
    pub slide_y_mm: f64,
    /// Normal force, N, >= 0 when the plane presses.
    pub normal_force_n: f64,
    /// Friction along x, N.
    pub friction_x_n: f64,
    /// Friction along y, N.
    pub friction_y_n: f64,
    /// Current area under pressure, mm².
    pub contact_area_mm2: f64,
    /// Stuck area over contact area; 1 in a fresh contact, 0 without contact.
    pub stick_ratio: f64,
    /// Regime of the contact.
    pub regime: Regime,
    /// Flags, `ok` if none.
    pub status: Status,
    /// Centre of pressure, mm, along the plane's axes x and y from the plane's point under first touch in the neutral pose;
    /// NaN without contact.
    pub centre_of_pressure_mm: [f64; 2],
    /// Turn of the plane about its normal, degrees, counter-clockwise seen from +z.
    #[serde(default)]
    pub spin_deg: f64,
    /// Angle between the finger's axis and the plane, tip down, degrees.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Turn of the finger about the neutral x axis, degrees.
    #[serde(default)]
    pub roll_deg: f64,
    /// Moments that the plane exerts on the finger about the same point, along the plane's axes x, y and z, N mm; that
    /// about z is positive as the plane turns the finger counter-clockwise seen from +z.
    #[serde(default)]
    pub moment_n_mm: [f64; 3],
}

/// State of one pad face, averaged over its contact points.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FaceState {
    /// Mean contact pressure over the face's current area, MPa, >= 0.
    pub pressure_mpa: f64,
    /// Mean tangential traction that the plane exerts on the skin, MPa.
    pub traction_mpa: [f64; 2],
    /// Mean slip (plane minus skin) accumulated since the face came into contact, mm.
    pub slip_mm: [f64; 2],
    /// Part of the face's area under pressure, 0 to 1.
    pub contact_fraction: f64,
    /// Part of the face's contact area that sticks, 0 to 1.
    pub stick_fraction: f64,
}

/// The whole field at one response, for pictures and ParaView.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Snapshot {
    /// The response that this field belongs to.
    pub response: Response,
    /// Displacement of every mesh node, mm.
    pub displacement_mm: Vec<Vector3<f64>>,
    /// One entry per pad face of the mesh.
    pub faces: Vec<FaceState>,
    /// Strain energy density of every element, MPa (mJ/mm³), mean over its undeformed volume; hexahedra first, then
    /// tetrahedra; 0 in rigid bones.
    pub strain_energy_density_mpa: Vec<f64>,
    /// Mean stress and strain of every element, in the same order; 0 in rigid bones.
    pub stresses: Vec<ElementStress>,
}

/// Cost of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cost {
    /// Accepted increments.
    pub increments: u32,
    /// Increments that failed and were cut.
    pub cutbacks: u32,
    /// Equilibrium iterations.
    pub iterations: u32,
    /// Factorisations of the bulk stiffness.
    pub factorisations: u32,
    /// CPU time of the thread that ran it, s.
    pub cpu_s: f64,
    /// Largest penetration of any increment, mm.
    pub max_penetration_mm: f64,
    /// Smallest product of friction and plastic slip of any contact node in an increment, mJ; never negative.
    pub min_dissipation_mj: f64,
    /// Largest residual of an accepted increment, over its contact force.
    pub max_residual: f64,
}

/// Work done since the start of the path, mJ.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Work {
    /// Work of the plane on the finger, normal plus tangential.
    pub plane_mj: f64,
    /// Dissipated by slip.
    pub friction_mj: f64,
    /// Put into the elastic slip by changes of pressure and contact area; it is not work of a motion.
    pub pressure_mj: f64,
    /// Dissipated by viscous stabilisation; 0 unless a limit point was passed.
    pub stabilisation_mj: f64,
}

/// Everything that a run along a path yields.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Trajectory {
    /// One row per accepted increment, the start included.
    pub responses: Vec<Response>,
    /// Fields at the requested waypoints.
    pub snapshots: Vec<Snapshot>,
    /// Observed quantities, one for each response; empty if none were requested.
    pub readings: Vec<Reading>,
    /// Cost.
    pub cost: Cost,
    /// Work.
    pub work: Work,
}

/// Limits of friction computed from a frictionless press.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PressLimit {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Normal force, N.
    pub normal_force_n: f64,
    /// Contact area, mm².
    pub contact_area_mm2: f64,
    /// Integral of the friction law over the frictionless pressure, N.
    pub friction_limit_n: f64,
    /// Largest penetration, mm.
    pub penetration_mm: f64,
}
