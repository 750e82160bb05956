//! Contact of pad faces with a rigid plane: gap, pressure, rubber friction with elastic slip.
//!
//! Main types: [`RubberFriction`], [`Surface`], [`ContactState`], [`Plane`].
//! May use: nothing of this crate but the face quadrature of element.

mod law;
mod state;
mod surface;

pub use law::RubberFriction;
pub use state::{ContactState, Friction, PenaltySettings, Plane, PointState, Quadrature, Totals};
pub use surface::{Evaluation, FaceTangent, Surface};
