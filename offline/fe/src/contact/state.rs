//! What a contact is set by, what it remembers, what it sums up to.

use nalgebra::Vector3;

use super::{FrictionLaw, RubberFriction, Sliding};
use crate::element::gauss_legendre;

/// Place of the plane, mm: displacement along x and y, height z (equal to the depth).
pub type Plane = [f64; 3];

/// How the non-penetration condition is kept.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PenaltySettings {
    /// Pressure per penetration, MPa/mm, > 0.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub penalty_mpa_per_mm: f64,
    /// Whether converged increments are augmented until the penetration tolerance holds.
    pub augment: bool,
    /// Largest penetration at convergence, mm (with `augment`).
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub penetration_tolerance_mm: f64,
    /// Where in a face contact is asked for.
    pub quadrature: Quadrature,
}

/// Points of a face at which gap and traction are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quadrature {
    /// 3 x 3 Gauss-Lobatto points (Simpson's rule), corners among them.
    ///
    /// In a face that the edge of the contact cuts, hardly a point but the corners that touch lies below the plane, since
    /// the gap is bilinear there: a rule without corners ends the contact at these corners, most of half a face too early
    /// in the mean. The corners' share of Simpson's rule nearly makes up for it.
    #[default]
    Lobatto,
    /// 4 x 4 Gauss-Legendre points, all inside the face.
    Gauss,
}

impl Quadrature {
    /// Points and weights of the one-dimensional rule on [−1, 1].
    pub(super) fn rule(self) -> Vec<(f64, f64)> {
        match self {
            Self::Lobatto => vec![(-1.0, 1.0 / 3.0), (0.0, 4.0 / 3.0), (1.0, 1.0 / 3.0)],
            Self::Gauss => gauss_legendre(4),
        }
    }
}

impl Default for PenaltySettings {
    fn default() -> Self {
        Self {
            penalty_mpa_per_mm: 100.0,
            augment: true,
            penetration_tolerance_mm: 1e-3,
            quadrature: Quadrature::default(),
        }
    }
}

/// Whether friction acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// No tangential traction; contact points count as stuck.
    Off,
    /// The law acts.
    On(RubberFriction),
}

impl FrictionLaw for Friction {
    fn strength(&self, pressure_mpa: f64) -> (f64, f64) {
        match self {
            Self::Off => (0.0, 0.0),
            Self::On(law) => law.strength(pressure_mpa),
        }
    }

    fn return_map(&self, trial_mm: [f64; 2], pressure_mpa: f64, force_stick: bool) -> Sliding {
        match self {
            Self::Off => Sliding::FRICTIONLESS,
            Self::On(law) => law.return_map(trial_mm, pressure_mpa, force_stick),
        }
    }
}

/// What a contact point remembers from increment to increment.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PointState {
    /// Elastic slip (plane minus skin), mm.
    pub elastic_slip: [f64; 2],
    /// Slip since it came into contact, mm.
    pub slip: [f64; 2],
    /// Lagrange multiplier of the augmentation, MPa.
    pub multiplier: f64,
    /// Pressure, MPa.
    pub pressure: f64,
    /// Tangential traction on the finger, MPa.
    pub traction: [f64; 2],
    /// Area that the point stands for, on the plane, mm².
    pub area: f64,
    /// In contact and below its strength.
    pub stuck: bool,
}

/// State of the whole contact at the end of an increment.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactState {
    /// Points, face by face.
    pub points: Vec<PointState>,
    /// Positions of the surface nodes, mm.
    pub position: Vec<Vector3<f64>>,
    /// Place of the plane.
    pub plane: Plane,
}

/// Sums over the contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Totals {
    /// Force that the plane exerts on the finger, N.
    pub force: Vector3<f64>,
    /// Moment arm sums for the centre of pressure: pressure times position, N mm.
    pub pressure_moment: [f64; 2],
    /// Area of contact points and of stuck ones, mm².
    pub area: f64,
    /// Stuck part of `area`.
    pub stuck_area: f64,
    /// Energy dissipated by slip in the increment, mJ.
    pub dissipation: f64,
    /// Smallest product of traction and plastic slip over all points, MPa mm; never negative.
    pub min_dissipation_density: f64,
    /// Elastic slip energy that is stored, mJ.
    pub elastic_energy: f64,
    /// Largest penetration, mm.
    pub penetration: f64,
}
