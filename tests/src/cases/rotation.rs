//! A deformed body turned as a whole: forces turn along, energy is constant, forces have no moment. Body, plane and
//! path turned together: the contact is unchanged.

use fingerpad_fe::assembly::{Body, Joint, Material};
use std::sync::Arc;

use crate::{
    problems::blocks::{all_held, paraboloid, tied_block},
    random::Random,
    verify,
};
use fingerpad_fe::contact::{Coordinates, Friction, Outline, PenaltySettings, Plane, RigidBody, RubberFriction};
use fingerpad_fe::load_path::{Finger, Tissue};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{FingertipShape, Mesh, MeshPreset, Region, block::coordinates, fingertip};
use fingerpad_fe::solve::{Guess, SolveError, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::{Rotation3, Vector3};

use super::hyperelastic::laws;

pub fn forces_turn_with_the_body() {
    let line = coordinates(0.0, 3.0, 3, 1.0);
    let nail = coordinates(0.4, 2.7, 2, 1.0);
    let mesh = tied_block([&line, &line, &line], &nail, &nail, 2, 0.5);
    let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let stiff = Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 });
    let fixed = [("Ogden hexes, SVK tets", soft, stiff), ("SVK hexes, Ogden tets", stiff, soft)];
    for (case, lower, upper) in laws().into_iter().map(|(case, law)| (case, law, law)).chain(fixed) {
        let material = |region| Some(if region == Region::Nail { upper } else { lower });
        let body = Body::new(&mesh, material, &all_held(&mesh), Vector3::zeros(), Joint::default()).unwrap();
        let mut random = Random::new(2);
        let mut at = body.undeformed().clone();
        at.x.iter_mut().for_each(|x| *x += 0.08 * random.vector());
        let (forces, energy) = (body.nodal_forces(&at), body.energy(&at).0);
        let scale = forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
        assert!(energy > 0.0 && scale > 0.0);
        let moment: Vector3<f64> = forces.iter().zip(&at.x).map(|(f, x)| x.cross(f)).sum();
        let resultant: Vector3<f64> = forces.iter().sum();
        let (mut worst_force, mut worst_energy) = (0.0f64, 0.0f64);
        for turn in [[0.1, 0.0, 0.0], [1.2, -2.0, 0.7], [0.0, std::f64::consts::PI, 0.0]] {
            let rotation = Rotation3::new(Vector3::from(turn));
            let mut turned = at.clone();
            turned.x.iter_mut().for_each(|x| *x = rotation * *x + Vector3::new(3.0, -20.0, 7.0));
            for (force, before) in body.nodal_forces(&turned).iter().zip(&forces) {
                worst_force = worst_force.max((force - rotation * before).norm() / scale);
            }
            worst_energy = worst_energy.max((body.energy(&turned).0 / energy - 1.0).abs());
        }
        verify(&format!("rigid rotation, {case}"), "force error", worst_force, 1e-9);
        verify(&format!("rigid rotation, {case}"), "energy error", worst_energy, 1e-9);
        verify(&format!("balance, {case}"), "resultant over the largest force", resultant.norm() / scale, 1e-9);
        verify(&format!("balance, {case}"), "moment over the largest force, mm", moment.norm() / scale, 1e-9);
    }
}

/// A body that is turned with its plane.
struct Turned {
    name: &'static str,
    /// The body, turned about the point of first touch.
    body: fn(&Rotation3<f64>) -> (Mesh, Body),
    /// The rigid body.
    rigid: RigidBody,
    /// Residual over contact force.
    tolerance: f64,
    /// Largest relative difference of any response.
    bound: f64,
}

/// The coarse mesh of the default finger, turned about the point of first touch.
fn coarse_finger(turn: &Rotation3<f64>) -> (Mesh, Body) {
    let mut tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
    tip.mesh.nodes.iter_mut().for_each(|p| *p = turn * *p);
    let Finger { mesh, body, .. } = Finger::new(tip, &Tissue::default()).unwrap();
    (mesh, body)
}

/// The states along a path of slide, depth and spin of a body turned by `heading` about z and then to this pitch and
/// roll against the plane; the path turned along, each of its lines in `parts` increments.
fn along_path([heading, pitch, roll]: [f64; 3], parts: u32, case: &Turned) -> Result<Vec<State>, SolveError> {
    let turned = |[x, y, depth, spin]: [f64; 4], height: f64| -> Coordinates {
        let (sin, cos) = heading.sin_cos();
        [cos * x - sin * y, sin * x + cos * y, depth + height, spin + heading, pitch, roll]
    };
    let tilt = Plane::new(turned([0.0; 4], 0.0)).tilt();
    let (mesh, body) = (case.body)(&(tilt * Rotation3::from_axis_angle(&Vector3::z_axis(), heading)));
    let settings = SolverSettings { tolerance: case.tolerance, max_iterations: 200, ..Default::default() };
    let penalty = PenaltySettings { penalty_mpa_per_mm: 20.0, augment: false, ..Default::default() };
    let law = Friction::On(RubberFriction::default());
    let mut solver = Solver::new(&body, &mesh.pad_faces, law, penalty, settings);
    // A rigid body that turns along turns about the point of first touch, to which depth counts here in any pose.
    if !case.rigid.is_plane() {
        let outline = Outline::Smooth(Arc::new(|_: &Vector3<f64>| Vector3::zeros()));
        solver.set_rigid_body(case.rigid.clone(), Some(outline), &Plane::default());
    }
    // Depth counts from first touch of a body whose neutral pose is that of the mesh, which this one's is not.
    let height = -solver.surface().reach.height_mm(&tilt);
    let mut state = solver.initial_state(Plane::new(turned([0.0; 4], height)));
    let path = [
        [0.0, 0.0, 0.1, 0.0],
        [0.0, 0.0, 0.15, 0.0],
        [0.0, 0.0, 0.2, 0.0],
        [0.05, -0.02, 0.2, 0.0],
        [0.1, -0.05, 0.2, 0.0],
        [0.15, -0.075, 0.2, 0.0],
        [0.2, -0.1, 0.2, 0.0],
        [0.2, -0.1, 0.2, 0.1],
        [0.2, -0.1, 0.2, 0.2],
        [0.1, 0.1, 0.18, 0.1],
    ];
    let mut states = Vec::new();
    let mut from = [0.0; 4];
    for end in path {
        for part in 1..=parts {
            let share = f64::from(part) / f64::from(parts);
            let to = turned(std::array::from_fn(|k| from[k] + share * (end[k] - from[k])), height);
            let guess = Guess { plane: state.contact.plane.moved_to(to), ..Guess::at(&state) };
            state = solver.step(&state, Target::place(to), guess, &mut Stats::default(), &mut unwatched)?;
        }
        states.push(state.clone());
        from = end;
    }
    Ok(states)
}

pub fn body_plane_and_path_turned_together_give_the_same_contact() {
    let (spun, pitched, all) = ([0.8, 0.0, 0.0], [0.0, 0.5, 0.0], [-0.6, 0.4, -0.3]);
    let plane = RigidBody::Plane;
    let small = Turned { name: "paraboloid", body: paraboloid, rigid: plane.clone(), tolerance: 1e-11, bound: 1e-9 };
    small.keeps_its_contact(&[("spun", spun), ("pitched", pitched), ("all three", all)]);
    // Rounding of places gives a larger residual in a body of 30 mm.
    let large = Turned { name: "finger", body: coarse_finger, rigid: plane, tolerance: 1e-8, bound: 1e-6 };
    large.keeps_its_contact(&[("all three", all)]);
    for (name, rigid) in [
        ("paraboloid on a sphere", RigidBody::Sphere { radius_mm: 5.0 }),
        ("paraboloid on a cylinder", RigidBody::Cylinder { radius_mm: 3.0, axis_deg: 35.0 }),
        ("paraboloid on an edge", RigidBody::Edge { radius_mm: 2.0, axis_deg: -20.0, angle_deg: 120.0 }),
    ] {
        // The distance from a curved body rounds more than that from a plane.
        let curved = Turned { name, body: paraboloid, rigid, tolerance: 1e-10, bound: 1e-6 };
        curved.keeps_its_contact(&[("spun", spun), ("all three", all)]);
    }
}

impl Turned {
    /// The states along the path, straight and turned. An increment for which no equilibrium is found is cut, in both, as
    /// friction depends on the increments: whether Newton's method finds one after a long slide hangs on rounding.
    fn both(&self, pose: [f64; 3]) -> (Vec<State>, Vec<State>) {
        for parts in [1, 2, 4] {
            match (along_path([0.0; 3], parts, self), along_path(pose, parts, self)) {
                (Ok(straight), Ok(turned)) => return (straight, turned),
                (straight, turned) => {
                    let errors = [straight.err(), turned.err()];
                    println!("{} {pose:?} in {parts} increments a line: {errors:?}", self.name);
                }
            }
        }
        panic!("{} {pose:?}: no equilibrium", self.name);
    }

    fn keeps_its_contact(&self, poses: &[(&str, [f64; 3])]) {
        for &(case, pose) in poses {
            let (straight, turned) = self.both(pose);
            let back = Rotation3::from_axis_angle(&Vector3::z_axis(), -pose[0]);
            let mut worst = 0.0f64;
            for (a, b) in straight.iter().zip(&turned) {
                let (t, u) = (&a.totals, &b.totals);
                let scale = t.force.norm();
                assert!(scale > 1e-3 && t.area > 0.5);
                let differences = [
                    (t.force - back * u.force).norm() / scale,
                    (t.moment - back * u.moment).norm() / scale,
                    (t.area / u.area - 1.0).abs(),
                    (t.stuck_area - u.stuck_area).abs() / t.area,
                    (t.dissipation - u.dissipation).abs() / (scale * 0.1),
                    (t.elastic_energy - u.elastic_energy).abs() / (scale * 0.1),
                ];
                println!("{case}: {}", differences.map(|d| format!("{d:.0e}")).join(" "));
                worst = differences.into_iter().fold(worst, f64::max);
            }
            verify(
                &format!("{} turned together, {case}", self.name),
                "largest relative difference of any response",
                worst,
                self.bound,
            );
        }
    }
}
