//! Contact of a body's surface with a rigid plane: gap, pressure, rubber friction with elastic slip, node by node.
//!
//! Main types: [`FrictionLaw`], [`RubberFriction`], [`Surface`], [`ContactState`], [`Plane`].
//! May use: nothing of this crate.

mod area;
mod contour;
mod law;
pub mod plane;
mod state;
mod surface;

pub use area::Parts;
pub use contour::Facet;
pub use law::{FrictionLaw, LawError, RubberFriction, Sliding};
pub use plane::{Coordinates, Frame, Plane, Reach, Twist};
pub use state::{ContactState, Friction, NodeState, PenaltySettings, Totals};
pub use surface::{Evaluation, NodeTangent, Pad, Surface};
