//! Meshes: nodes, hexahedra, tetrahedra, named sets, ties.
//!
//! Main types: [`Mesh`], [`Region`], [`Tie`]; [`FingertipShape`] and [`Divisions`] make a [`Fingertip`];
//! [`quality`] measures and [`check`] refuses; [`block`] makes the simple meshes of tests.
//! Every mesh is given in the frame of the plane (mm): `z` out of the plane into the finger, `x` the
//! direction in which the plane is moved from proximal to distal, `y` to the left of it; `z = 0` is the
//! height of the plane at first touch with the analytic surface (not with its facets).
//! May use: `fingerpad-formats`, `fingerpad-least-squares`.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(x > 0.0)` refuses NaN by its shape")]

pub mod block;
mod boundary;
mod boundary_curves;
mod check;
mod closest_point;
mod divisions;
mod error;
mod first_touch;
mod first_touch_of_points;
mod flat_pad;
mod grid;
pub mod imported;
mod locate;
mod mapping;
mod nail;
mod parametric;
mod quality;
mod refinement;
mod shape;
mod skin;
mod surface;
mod symmetry;
mod touching;
pub mod volume;

pub use check::{FACE_TRIANGLES, HEX_FACES, TET_FACES, TET10_FACES, check};
pub use fingerpad_formats::mesh::{Hex, Mesh, Region, Tet, Tet10, Tie, set};

pub use divisions::{Divisions, MeshPreset};
pub use error::MeshError;
pub use first_touch::FirstTouch;
pub use flat_pad::FlatPad;
pub use locate::{Located, below_skin, element_corners, locate};
pub use parametric::{Fingertip, fingertip};
pub use quality::{QualityReport, RegionQuality, quality};
pub use shape::{FingertipShape, Nail};
pub use skin::Skin;
pub use symmetry::HalfMesh;
pub use touching::touching_faces;

/// Corners of the reference hexahedron in VTK_HEXAHEDRON order.
pub const HEX_CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];
