//! A rigid cylinder that rolls on a slab with creep, against Carter's theory of tractive rolling.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::{problems::blocks::body_of, verify};
use fingerpad_fe::assembly::{Material, Supports};
use fingerpad_fe::contact::{Friction, Outline, PenaltySettings, Plane, RigidBody, RubberFriction};
use fingerpad_fe::material::Ogden;
use fingerpad_fe::mesh::block::{block, coordinates};
use fingerpad_fe::solve::{Guess, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::Vector3;

const RADIUS_MM: f64 = 10.0;
/// Half the width of the contact that the depth gives, about, mm, and faces in it.
const HALF_WIDTH_MM: f64 = 0.86;
const FACES: f64 = 6.0;
/// Way of the cylinder's axis and of one increment, mm.
const WAY_MM: f64 = 12.0;
const STEP_MM: f64 = 0.1;
const DEPTH_MM: f64 = 0.11;
const MU: f64 = 0.5;
const SHEAR_MPA: f64 = 0.05;
const POISSON: f64 = 0.495;

/// The place of a cylinder along y whose axis is at `along` over x, `DEPTH_MM` deep, and that has turned by `turn`, its surface
/// towards +x.
fn place(along: f64, turn: f64) -> [f64; 6] {
    let tilt = Plane::new([0.0, 0.0, 0.0, 0.0, -turn, 0.0]).tilt();
    let axis = Vector3::new(along, 0.0, DEPTH_MM - RADIUS_MM);
    let (x, up) = (tilt * Vector3::x(), tilt * Vector3::z());
    [axis.dot(&x), 0.0, axis.dot(&up) + RADIUS_MM, 0.0, -turn, 0.0]
}

/// The state after a way of the axis on which the surface runs ahead of it by `creep`.
fn rolled(creep: f64) -> State {
    let face_mm = HALF_WIDTH_MM / FACES;
    let count = ((WAY_MM + 8.0 * HALF_WIDTH_MM) / face_mm).round() as usize;
    let from = -4.0 * HALF_WIDTH_MM;
    let xs = coordinates(from, from + count as f64 * face_mm, count, 1.0);
    // One cell along y, whose sides keep their y: plane strain.
    let mesh = block(&xs, &[-0.5 * face_mm, 0.5 * face_mm], &coordinates(0.0, 8.0, 20, 1.15));
    let sides = ["y0", "y1"].iter().flat_map(|set| mesh.node_set(set)).map(|&node| (node, 1)).collect();
    let supports = Supports {
        fixed: mesh.node_set("z1").to_vec(),
        fixed_components: sides,
        contact: mesh.node_set("z0").to_vec(),
        ..Supports::default()
    };
    let bulk_mpa = 2.0 * SHEAR_MPA * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON));
    let soft = Material::Ogden(Ogden { mu_mpa: SHEAR_MPA, alpha: 2.0, d_per_mpa: 2.0 / bulk_mpa });
    let body = body_of(&mesh, soft, &supports);
    let law = Friction::On(RubberFriction { regular_pressure_mpa: 1e-6, ..RubberFriction::coulomb(MU, 2e-4) });
    let mut solver = Solver::new(&body, &mesh.pad_faces, law, PenaltySettings::default(), SolverSettings::default());
    let cylinder = RigidBody::Cylinder { radius_mm: RADIUS_MM, axis_deg: 90.0 };
    // Poses turn about the origin, from which depth counts in all of them.
    let outline = Outline::Smooth(Arc::new(|_: &Vector3<f64>| Vector3::zeros()));
    solver.set_rigid_body(cylinder, Some(outline), &Plane::default());
    let mut state = solver.initial_state(Plane::default());
    let press = (1..=4).map(|k| [0.0, 0.0, DEPTH_MM * f64::from(k) / 4.0, 0.0, 0.0, 0.0]);
    let steps = (WAY_MM / STEP_MM).round() as usize;
    let roll = (1..=steps).map(|k| {
        let along = STEP_MM * k as f64;
        place(along, -along * (1.0 - creep) / RADIUS_MM)
    });
    for to in press.chain(roll) {
        let guess = Guess { plane: state.contact.plane.moved_to(to), ..Guess::at(&state) };
        state = solver.step(&state, Target::place(to), guess, &mut Stats::default(), &mut unwatched).unwrap();
    }
    state
}

/// Friction over its limit at a creep, `1 - (1 - creep R/(mu a))²` [Carter 1926; K. L. Johnson, Contact Mechanics, 1985, section
/// 8.3]. The slab is 8 mm deep and the way 12 mm, which explain some per cent: without creep a hundredth is left.
pub fn a_cylinder_that_rolls_creeps_as_carter_found() {
    let shares = |creep: f64| {
        let end = rolled(creep);
        let force = end.contact.plane.tilt() * end.totals.force;
        // Hertz's a² = 4 N R/(pi E*), N the force per width.
        let width_mm = HALF_WIDTH_MM / FACES;
        let modulus = 2.0 * SHEAR_MPA / (1.0 - POISSON);
        let by_force = (4.0 * force.z / width_mm * RADIUS_MM / (PI * modulus)).sqrt();
        (force.x / (MU * force.z), by_force)
    };
    verify("a rolling cylinder without creep", "friction over its limit", shares(0.0).0.abs(), 0.03);
    for creep in [0.01, 0.02, 0.03] {
        let (share, half_width_mm) = shares(creep);
        let carter = 1.0 - (1.0 - creep * RADIUS_MM / (MU * half_width_mm)).powi(2);
        println!("creep {creep}: {share:.3}, Carter {carter:.3}");
        verify(&format!("a rolling cylinder, creep {creep}"), "friction over its limit", (share - carter).abs(), 0.05);
    }
}
