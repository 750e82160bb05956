//! The compliance at rest against the whole solver: the pressures of a small press move the skin as the press does.

use std::time::Instant;

use crate::verify;
use fingerpad_fe::contact::{Friction, PenaltySettings, Plane, RubberFriction};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::BoneKind;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_fe::solve::{Guess, RestCompliance, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::{DVector, Vector3};

/// Root mean square error of the compliance over the skin's motion, after a press and slide with friction of `scale`
/// times 0.1 mm.
fn left(preset: MeshPreset, bone: BoneKind, scale: f64) -> f64 {
    let mut config = Config { mesh_preset: preset, ..Config::default() };
    config.tissue.bone.kind = bone;
    let finger = config.finger().unwrap().0;
    let started = Instant::now();
    let compliance = RestCompliance::of(&finger.body).unwrap();
    println!("{preset:?}: {} nodes in {:.1} s", compliance.nodes.len(), started.elapsed().as_secs_f64());
    assert_eq!(compliance.bone_is_free, bone == BoneKind::Floating);
    let asymmetry = (&compliance.matrix - compliance.matrix.transpose()).amax();
    assert_eq!(asymmetry, 0.0);
    assert!(compliance.matrix.clone().cholesky().is_some(), "positive definite");

    let settings = SolverSettings { tolerance: 1e-7, max_iterations: 100, ..Default::default() };
    let penalty = PenaltySettings { augment: false, ..Default::default() };
    let law = Friction::On(RubberFriction::default());
    let mut solver = Solver::new(&finger.body, &finger.mesh.pad_faces, law, penalty, settings);
    let mut state = solver.initial_state(Plane::default());
    for to in [[0.0, 0.0, 0.05, 0.0, 0.0, 0.0], [0.0, 0.0, 0.1, 0.0, 0.0, 0.0], [0.02, 0.01, 0.1, 0.0, 0.0, 0.0]] {
        let to = to.map(|v: f64| scale * v);
        let guess = Guess { plane: state.contact.plane.moved_to(to), ..Guess::at(&state) };
        state = solver.step(&state, Target::place(to), guess, &mut Stats::default(), &mut unwatched).unwrap();
    }
    let State { configuration, contact, .. } = &state;
    let surface = solver.surface();
    let frame = surface.frame(&contact.plane);
    let rows = compliance.matrix.nrows();
    let mut force = DVector::zeros(rows);
    for (node, loaded) in surface.nodes.iter().zip(&contact.nodes) {
        let Some(place) = compliance.nodes.iter().position(|n| n == node) else { continue };
        let of_node = loaded.tangential_force_n + Vector3::z() * loaded.normal_force_n;
        let of_node = frame.to_finger(&of_node);
        (0..3).for_each(|k| force[3 * place + k] = of_node[k]);
    }
    let by_compliance = &compliance.matrix * force;
    let (mut off, mut all) = (0.0, 0.0);
    for (place, &node) in compliance.nodes.iter().enumerate() {
        let moved = configuration.x[node as usize] - finger.mesh.nodes[node as usize];
        let by_matrix =
            Vector3::new(by_compliance[3 * place], by_compliance[3 * place + 1], by_compliance[3 * place + 2]);
        off += (moved - by_matrix).norm_squared();
        all += moved.norm_squared();
    }
    (off / all).sqrt()
}

pub fn a_small_press_moves_the_skin_by_the_compliance() {
    for bone in [BoneKind::Floating, BoneKind::Fixed] {
        let (whole, half) = (left(MeshPreset::Coarse, bone, 1.0), left(MeshPreset::Coarse, bone, 0.5));
        println!("{bone:?}: {whole:.2e}, at half the press {half:.2e}");
        verify(&format!("compliance at rest, {bone:?}"), "skin's motion that is left, share", half, 0.03);
        assert!(half < 0.75 * whole, "the error is of second order: {whole:.2e} {half:.2e}");
    }
}

pub fn a_small_press_moves_the_skin_by_the_compliance_on_a_medium_mesh() {
    let left = left(MeshPreset::Medium, BoneKind::Floating, 0.5);
    verify("compliance at rest, medium", "skin's motion that is left, share", left, 0.03);
}
