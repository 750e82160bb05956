//! The residual of a body is the derivative of its energy, rigid body, joint and ties included.

use fingerpad_fe::assembly::{Body, Configuration};
use fingerpad_fe::load_path::{BoneKind, Finger, Tissue};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, fingertip};
use fingerpad_tests::{
    differences::{unit_directions, worst_error},
    random::Random,
    verify,
};

use crate::tangents::{composite, disturbed, free};

/// Largest error of the residual against differences of the energy along `directions`.
fn error(body: &Body, at: &Configuration, h: f64, directions: &[Vec<f64>]) -> f64 {
    let mut residual = Vec::new();
    body.residual(at, &mut residual).unwrap();
    // Each direction against the largest possible entry, not its own: a dof without force has no scale.
    let largest = residual.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    let energy = |direction: &[f64], s: f64| vec![body.energy(&body.advance(at, direction, s)).0, largest * s];
    let exact = |d: &[f64]| vec![residual.iter().zip(d).map(|(r, d)| r * d).sum(), largest];
    worst_error(h, directions, energy, exact)
}

#[test]
fn residual_is_the_derivative_of_the_energy() {
    let body = composite();
    let at = disturbed(&body, 0.1, 4);
    verify(
        "energy, block with rigid bone and tied nail",
        "error of the residual, every dof",
        error(&body, &at, 1e-3, &free(&body, unit_directions(body.dofs.count))),
        1e-6,
    );
    for kind in [BoneKind::Floating, BoneKind::Deformable] {
        let tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
        let mut tissue = Tissue::default();
        tissue.bone.kind = kind;
        let finger = Finger::new(tip, &tissue).unwrap();
        let at = disturbed(&finger.body, 0.02, 6);
        let mut random = Random::new(8);
        let directions = (0..6).map(|_| random.list(finger.body.dofs.count)).collect();
        verify(
            &format!("energy, coarse finger, bone {kind:?}"),
            "error of the residual, 6 random directions",
            error(&finger.body, &at, 1e-4, &free(&finger.body, directions)),
            1e-6,
        );
    }
}
