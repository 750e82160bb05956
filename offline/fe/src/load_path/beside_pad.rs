//! Skin that reaches the rigid body beside the faces that may touch it.

use super::Model;
use crate::contact::Surface;
use crate::solve::State;

/// Depth that skin beside the pad may have inside the rigid body, mm: the size of the error by bending between nodes at
/// a rim.
pub const BESIDE_PAD_MM: f64 = 3e-3;

/// Depth of the rigid body inside skin that cannot carry contact, mm; 0 without any.
///
/// * `beside_pad`: nodes of the skin's outside that are not of the pad
/// * `model`: the model of `state`; of a half, the nodes of the other half are excluded, because they do not move
pub fn below_beside_pad_mm(beside_pad: &[u32], model: &Model, surface: &Surface, state: &State) -> f64 {
    let frame = surface.frame(&state.contact.plane);
    let moves = |node: &&u32| model.half.is_none_or(|half| half.mesh.node[**node as usize] == **node);
    let depth = |&node: &u32| -surface.body().spot(&frame.to_plane(&state.configuration.x[node as usize])).gap_mm;
    let beside = beside_pad.iter().filter(moves).map(depth).fold(0.0, f64::max);
    beside.max(surface.penetration_beside_pad_mm(&state.contact))
}
