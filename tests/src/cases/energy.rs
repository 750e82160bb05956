//! Energies: the residual of a body is the derivative of its energy, rigid body, joint and ties included; the work of the
//! plane in all six coordinates is stored or dissipated.

use crate::{
    differences::{unit_directions, worst_error},
    problems::blocks::paraboloid,
    random::Random,
    verify,
};
use fingerpad_fe::assembly::{Body, Configuration, TissueStep};
use fingerpad_fe::contact::{Coordinates, Friction, PenaltySettings, RubberFriction};
use fingerpad_fe::load_path::{BoneKind, Finger, Tissue};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, fingertip};
use fingerpad_fe::solve::{Guess, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::Rotation3;

use super::tangents::{composite, disturbed, free};

/// Largest error of the residual against differences of the energy along `directions`.
pub fn error(body: &Body, at: &Configuration, tissue: Option<&TissueStep>, h: f64, directions: &[Vec<f64>]) -> f64 {
    let mut residual = Vec::new();
    body.residual((at, tissue), &mut residual).unwrap();
    // Each direction against the largest possible entry, not its own: a dof without force has no scale.
    let largest = residual.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    let energy =
        |direction: &[f64], s: f64| vec![body.energy((&body.advance(at, direction, s), tissue)).0, largest * s];
    let exact = |d: &[f64]| vec![residual.iter().zip(d).map(|(r, d)| r * d).sum(), largest];
    worst_error(h, directions, energy, exact)
}

pub fn residual_is_the_derivative_of_the_energy() {
    let body = composite();
    let at = disturbed(&body, 0.1, 4);
    verify(
        "energy, block with rigid bone and tied nail",
        "error of the residual, every dof",
        error(&body, &at, None, 1e-3, &free(&body, unit_directions(body.dofs.count))),
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
            error(&finger.body, &at, None, 1e-4, &free(&finger.body, directions)),
            1e-6,
        );
    }
}

const PENALTY: PenaltySettings =
    PenaltySettings { penalty_mpa_per_mm: 20.0, augment: false, penetration_tolerance_mm: 1.0, edge_constant: 1.5 };

/// Stored energy of body, penalty and elastic slip, mJ.
fn stored(body: &Body, state: &State) -> f64 {
    let nodes = state.contact.nodes.iter().zip(&state.contact.position);
    let penalty: f64 = nodes.map(|(node, x)| 0.5 * node.normal_force_n * (-x.z).max(0.0)).sum();
    body.energy(&state.configuration).0 + penalty + state.totals.elastic_energy
}

/// Corners of a closed path from air to air through all six coordinates, with increments to each.
const CORNERS: [(Coordinates, usize); 9] = [
    ([0.0, 0.0, 0.25, 0.0, 0.0, 0.0], 40),
    ([0.6, 0.0, 0.25, 0.0, 0.0, 0.0], 60),
    ([0.6, 0.0, 0.25, 0.5, 0.0, 0.0], 60),
    ([0.6, 0.0, 0.3, 0.5, 0.08, -0.06], 40),
    ([-0.3, 0.2, 0.3, -0.4, 0.08, -0.06], 120),
    ([-0.3, 0.2, 0.2, -0.4, -0.05, 0.0], 40),
    ([0.0, 0.0, 0.25, 0.0, 0.0, 0.0], 60),
    ([0.0, 0.0, -0.02, 0.0, 0.0, 0.0], 50),
    ([0.0, 0.0, -0.1, 0.0, 0.0, 0.0], 1),
];

pub fn work_of_the_plane_is_stored_or_dissipated() {
    work_is_stored_or_dissipated("rubber law", RubberFriction { gamma_crit_mm: 0.02, ..Default::default() });
}

pub fn work_of_the_plane_is_stored_or_dissipated_under_coulombs_law() {
    work_is_stored_or_dissipated("Coulomb", RubberFriction::coulomb(0.6, 0.02));
}

fn work_is_stored_or_dissipated(case: &str, law: RubberFriction) {
    let (mesh, body) = paraboloid(&Rotation3::identity());
    let settings = SolverSettings { tolerance: 1e-7, ..Default::default() };
    let mut solver = Solver::new(&body, &mesh.pad_faces, Friction::On(law), PENALTY, settings);
    let mut state = solver.initial_state([0.0; 3]);
    let (mut work, mut put_in, mut dissipated, mut by_pressure) = (0.0, 0.0, 0.0, 0.0);
    let mut worst = 0.0f64;
    for (corner, increments) in CORNERS {
        let from = state.contact.plane.at;
        for k in 1..=increments {
            let share = k as f64 / increments as f64;
            let to: Coordinates = std::array::from_fn(|c| from[c] + share * (corner[c] - from[c]));
            let guess = Guess { plane: state.contact.plane.moved_to(to), ..Guess::at(&state) };
            let next = solver.step(&state, Target::place(to), guess, &mut Stats::default(), &mut unwatched).unwrap();
            let forces = [&state, &next].map(|s| solver.surface().generalised_forces(&s.contact.plane, &s.totals));
            let step: f64 =
                (0..6).map(|c| 0.5 * (forces[0][c] + forces[1][c]) * (to[c] - state.contact.plane.at[c])).sum();
            work += step;
            put_in += step.max(0.0);
            dissipated += next.totals.dissipation;
            by_pressure += next.totals.elastic_energy_by_pressure;
            state = next;
            worst = worst.max((work + by_pressure - dissipated - stored(&body, &state)).abs());
        }
    }
    assert!(state.totals.force.z == 0.0 && stored(&body, &state) < 1e-9, "the path ends in air");
    println!(
        "{case}: {put_in:.4e} mJ put in, {dissipated:.4e} dissipated, {by_pressure:.1e} by pressure, {work:.4e} in all"
    );
    assert!(dissipated > 0.2 * put_in);
    verify(
        &format!("closed path, six coordinates, {case}"),
        "imbalance on the way over the work",
        worst / put_in,
        5e-3,
    );
    let balance = (work + by_pressure - dissipated).abs();
    verify(
        &format!("closed path, six coordinates, {case}"),
        "work less dissipation over the work",
        balance / put_in,
        2e-3,
    );
}
