//! Contact of a body's surface with a rigid body: gap, pressure, rubber friction with elastic slip, node by node.
//!
//! Main types: [`FrictionLaw`], [`RubberFriction`], [`Surface`], [`ContactState`], [`RigidBody`], [`Plane`].
//! May use: nothing of this crate.

mod area;
mod contour;
mod heights;
mod law;
mod orthotropy;
pub mod plane;
mod reach;
mod rigid;
mod sharpness;
mod state;
mod surface;

pub use area::Parts;
pub use contour::Facet;
pub use heights::HeightField;
pub use law::{FrictionLaw, LawError, RubberFriction, Sliding};
pub use orthotropy::Orthotropy;
pub use plane::{Coordinates, Frame, Plane, Twist};
pub use reach::{Outline, Reach};
pub use rigid::{BodyShapeError, RIGHT_ANGLE_DEG, RigidBody, Spot};
pub use sharpness::Sharpness;
pub use state::{ContactState, Friction, NodeState, PenaltySettings, Totals};
pub use surface::{Evaluation, NodeTangent, Pad, Surface, Tangential};
