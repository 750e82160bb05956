//! Skin that comes to the rigid body beside the faces that may touch it.

use super::Model;
use crate::contact::Surface;
use crate::solve::State;

/// How far skin beside the pad may be inside the rigid body, mm: what its bending between nodes makes of a rim.
pub const BESIDE_PAD_MM: f64 = 3e-3;

/// How far the rigid body has come into skin that cannot bear contact, mm; 0 if it has not.
///
/// * `beside_pad`: nodes of the skin's outside that are not of the pad
/// * `model`: what `state` is of; of a half, nodes of the other half do not count, which do not move
pub fn below_beside_pad_mm(beside_pad: &[u32], model: &Model, surface: &Surface, state: &State) -> f64 {
    let frame = surface.frame(&state.contact.plane);
    let moves = |node: &&u32| model.half.is_none_or(|half| half.mesh.node[**node as usize] == **node);
    let depth = |&node: &u32| -surface.body().spot(&frame.to_plane(&state.configuration.x[node as usize])).gap_mm;
    let beside = beside_pad.iter().filter(moves).map(depth).fold(0.0, f64::max);
    beside.max(surface.unborne_penetration_mm(&state.contact))
}
