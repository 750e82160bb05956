//! Input, result and errors of an increment.

use std::ops::ControlFlow;

use super::linear::NotPositiveDefinite;
use crate::assembly::{BodyError, Configuration};
use crate::contact::{ContactState, Coordinates, Plane, Totals};

/// How equilibrium is sought.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSettings {
    /// Residual over contact force (norms over all dofs) at convergence.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub tolerance: f64,
    /// Forces below this count as zero, N.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub force_floor_n: f64,
    /// Equilibrium iterations before an increment is abandoned.
    pub max_iterations: usize,
    /// Contact iterations per equilibrium iteration.
    pub max_contact_iterations: usize,
    /// Consecutive contact problems without a solution before an increment is abandoned; set by callers that have an
    /// alternative, not in a configuration.
    #[serde(skip)]
    pub max_unsolved_contacts: usize,
    /// Consecutive equilibrium iterations without progress of the residual after which an increment is abandoned;
    /// smaller in callers that have an alternative.
    #[serde(skip)]
    pub max_idle_iterations: u32,
    /// The bulk factor is renewed when more iterations than this are to be expected with the old one.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub refresh_cost_iterations: f64,
    /// Growth of the residual in one iteration above which the iteration's step is shortened.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub growth: f64,
    /// Augmentations per increment.
    pub max_augmentations: usize,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-5,
            force_floor_n: 1e-6,
            max_iterations: 30,
            max_contact_iterations: 40,
            max_unsolved_contacts: 30,
            max_idle_iterations: u32::MAX,
            refresh_cost_iterations: 9.0,
            growth: 1.0,
            max_augmentations: 8,
        }
    }
}

/// How a coordinate of the plane is driven in an increment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axis {
    /// Value of the coordinate, mm or rad.
    Displacement(f64),
    /// Force of the plane on the finger along the axis, N, or its moment about the foot of the plane, N mm.
    Force(f64),
}

/// Where an increment leads: the coordinates of the plane in the order of [`Coordinates`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target(pub [Axis; 6]);

impl From<[Axis; 3]> for Target {
    /// Axes x, y and depth in the neutral pose.
    fn from([x, y, depth]: [Axis; 3]) -> Self {
        let rest = Axis::Displacement(0.0);
        Self([x, y, depth, rest, rest, rest])
    }
}

impl Target {
    /// Every coordinate at its value.
    pub fn place(at: Coordinates) -> Self {
        Self(at.map(Axis::Displacement))
    }
}

/// Component of the plane's wrench (forces along x, y and z, moments about them) that a coordinate is driven by.
pub(super) const WRENCH_OF: [usize; 6] = [0, 1, 2, 5, 4, 3];

/// Statistics of an increment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stats {
    /// Equilibrium iterations.
    pub iterations: u32,
    /// Contact iterations.
    pub contact_iterations: u32,
    /// Factorisations of the bulk.
    pub factorisations: u32,
    /// Factorisations that had to be mixed with the undeformed stiffness.
    pub mixed: u32,
    /// Last residual over contact force.
    pub residual: f64,
}

/// Receives the effort so far, many times within an increment; may stop the search.
pub type Watch<'w> = &'w mut dyn FnMut(&Stats) -> ControlFlow<()>;

/// A [`Watch`] that never stops a search.
pub fn unwatched(_: &Stats) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Why an increment failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The residual did not fall.
    #[error(
        "no equilibrium after {iterations} iterations: residual {residual:.3e} of the contact force, tolerance {tolerance:.1e}"
    )]
    Stalled {
        /// Iterations done.
        iterations: u32,
        /// Residual over contact force.
        residual: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
    /// An equilibrium was found, but beyond a limit point.
    #[error(
        "the equilibrium found lies beyond a limit point: {lost_mj:.3e} mJ of the plane's work are unaccounted for"
    )]
    LimitPoint {
        /// Work that neither the finger nor friction has.
        lost_mj: f64,
    },
    /// A force-driven body without contact.
    #[error("the rigid body leaves the finger, or does not reach it, under the driven forces")]
    OutOfContact,
    /// Driven coordinates that could not be released to their forces.
    #[error("the contact does not carry the driven forces: the rigid body would slip off the finger")]
    NotReleased,
    /// A driven load that was not tried.
    #[error("friction at the present pressures does not hold the driven load")]
    BeyondStrength,
    /// The body failed.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The bulk stiffness is not positive definite even when mixed with that of the undeformed body.
    #[error(transparent)]
    Stiffness(#[from] NotPositiveDefinite),
    /// The watch stopped the search.
    #[error("interrupted")]
    Interrupted,
}

/// Viscous forces against the motion of the body in one increment: `coefficient * stiffness diagonal * motion`.
///
/// They replace the inertia and viscosity that a quasi-static model lacks when the structure snaps from one equilibrium
/// to another.
#[derive(Clone, Copy, Debug)]
pub struct Damping<'a> {
    /// Share of the undeformed stiffness' diagonal, > 0.
    pub coefficient: f64,
    /// Origin of the motion.
    pub from: &'a Configuration,
}

/// Where a search for equilibrium starts.
#[derive(Clone, Debug)]
pub struct Guess {
    /// Positions; fixed nodes hold their prescribed ones.
    pub configuration: Configuration,
    /// Place of the plane; of its displacement-driven coordinates the target counts.
    pub plane: Plane,
    /// The configuration already follows the plane's motion (extrapolation), so that points in contact need not be
    /// predicted to stick.
    pub follows_plane: bool,
}

impl Guess {
    /// State before the increment.
    pub fn at(state: &State) -> Self {
        Self { configuration: state.configuration.clone(), plane: state.contact.plane, follows_plane: false }
    }
}

/// A state in equilibrium.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct State {
    /// Positions of all nodes.
    pub configuration: Configuration,
    /// Contact points.
    pub contact: ContactState,
    /// Sums over the contact.
    pub totals: Totals,
}
