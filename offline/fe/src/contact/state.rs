//! Settings, history and totals of a contact.

use nalgebra::Vector3;

use super::{FrictionLaw, Orthotropy, Plane, RubberFriction, Sliding};

/// Enforcement of the non-penetration condition, and position of the edge of the contact.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PenaltySettings {
    /// Pressure per penetration, MPa/mm, > 0. In a configuration it is that of a finger as stiff and as thick as the human one;
    /// fingers more than ten times softer or a hundred times stiffer take it in proportion to stiffness over thickness.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub penalty_mpa_per_mm: f64,
    /// Whether converged increments are augmented until the penetration tolerance holds.
    pub augment: bool,
    /// Largest penetration at convergence, mm (with `augment`).
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub penetration_tolerance_mm: f64,
    /// Gap of an open node as a negative pressure, per plane-strain modulus and gap over face size: it positions the
    /// edge of the contact between the last node that touches and the first that does not. Fracture mechanics gives 1.5
    /// for any body that is even over the size of a face (see `Surface`).
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub edge_constant: f64,
}

impl Default for PenaltySettings {
    fn default() -> Self {
        Self { penalty_mpa_per_mm: 100.0, augment: true, penetration_tolerance_mm: 1e-3, edge_constant: 1.5 }
    }
}

/// Whether friction acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// No tangential traction; contact nodes count as stuck.
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

    fn orthotropy(&self) -> Option<Orthotropy> {
        match self {
            Self::Off => None,
            Self::On(law) => law.orthotropy(),
        }
    }
}

/// History of a contact node. Vectors are along the surface of the rigid body, in its material frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NodeState {
    /// Elastic slip (body minus skin), mm.
    pub elastic_slip: Vector3<f64>,
    /// Slip since first contact, mm.
    pub slip: Vector3<f64>,
    /// Length of the plastic slip since it last stuck, mm.
    pub slip_since_stick_mm: f64,
    /// Direction in which the body last moved past it; zero before the first motion.
    pub direction: Vector3<f64>,
    /// Lagrange multiplier of the augmentation, MPa.
    pub multiplier: f64,
    /// Normal force, N, > 0 in contact.
    pub normal_force_n: f64,
    /// Tangential force on the finger, N.
    pub tangential_force_n: Vector3<f64>,
    /// Part of the contact area that belongs to it, mm².
    pub area: f64,
    /// In contact and below its strength.
    pub stuck: bool,
}

impl NodeState {
    /// Mean pressure over the node's part of the contact area, MPa.
    pub fn pressure_mpa(&self) -> f64 {
        if self.area > 0.0 { self.normal_force_n / self.area } else { 0.0 }
    }
}

/// State of the whole contact at the end of an increment.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactState {
    /// Surface nodes.
    pub nodes: Vec<NodeState>,
    /// Positions of the surface nodes in the rigid body's material frame, mm.
    pub position: Vec<Vector3<f64>>,
    /// Closest points of the rigid body's surface, mm, same frame.
    pub point: Vec<Vector3<f64>>,
    /// Place of the plane.
    pub plane: Plane,
}

/// Sums over the contact, along the plane's axes, which spin does not turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Totals {
    /// Force that the plane exerts on the finger, N.
    pub force: Vector3<f64>,
    /// Its moment about the plane's foot, N mm.
    pub moment: Vector3<f64>,
    /// Contact area, mm².
    pub area: f64,
    /// Stuck part of `area`.
    pub stuck_area: f64,
    /// Energy dissipated by slip in the increment, mJ.
    pub dissipation: f64,
    /// Smallest product of force and plastic slip over all nodes, mJ; never negative.
    pub min_dissipation_mj: f64,
    /// Elastic slip energy that is stored, mJ.
    pub elastic_energy: f64,
    /// Energy that the changes of pressure and of area put into the elastic slip in the increment, mJ: it is not work
    /// of a motion.
    pub elastic_energy_by_pressure: f64,
    /// Largest penetration, mm.
    pub penetration: f64,
}
