//! Contact of pad faces with a rigid plane: gap, pressure, rubber friction with elastic slip.
//!
//! Main types: [`FrictionLaw`], [`RubberFriction`], [`Surface`], [`ContactState`], [`Plane`].
//! May use: nothing of this crate but the face quadrature of element.

mod law;
mod point;
mod state;
mod surface;

pub use law::{FrictionLaw, LawError, RubberFriction, Sliding};
pub use state::{ContactState, Friction, PenaltySettings, Plane, PointState, Quadrature, Totals};
pub use surface::{Evaluation, FaceTangent, Surface};
