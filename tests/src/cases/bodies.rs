//! The finger on rigid bodies other than a plane.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::{
    problems::blocks::paraboloid,
    problems::fingers::{at_corner, follow, placed},
    verify,
};
use fingerpad_fe::contact::{Friction, Outline, PenaltySettings, Plane, RigidBody, RubberFriction};
use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};
use fingerpad_fe::load_path::{Drive, Path, Trajectory, Turn, Turns};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_fe::solve::{Guess, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::{Rotation3, Vector3};

fn on(body: RigidBodySettings, path: &Path) -> Trajectory {
    let config = Config { mesh_preset: MeshPreset::Coarse, rigid_body: body, ..Config::default() };
    let finger = config.finger_for(&[path]).unwrap().0;
    config.check_path(path, &finger).unwrap();
    follow(&config.problem(&finger), path).unwrap()
}

fn round(kind: BodyKind, radius_mm: f64, axis_deg: Option<f64>) -> RigidBodySettings {
    RigidBodySettings { kind, radius_mm: Some(radius_mm), axis_deg, ..RigidBodySettings::default() }
}

/// The curvature of a sphere of 10 m is 0.2 % of the finger's, so that its results differ a little from the plane's. With a sphere of
/// 100 m the difference must be a tenth of that.
pub fn a_huge_sphere_is_the_plane() {
    let path = placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.5]]);
    let plane = on(RigidBodySettings::default(), &path);
    let apart = |radius_mm: f64| {
        let sphere = on(round(BodyKind::Sphere, radius_mm, None), &path);
        let pairs = [1, 2].map(|corner| (*at_corner(&plane, corner), *at_corner(&sphere, corner)));
        pairs.iter().fold([0.0f64; 3], |worst, (a, b)| {
            let force = (a.normal_force_n - b.normal_force_n).abs() / a.normal_force_n;
            let friction = (a.friction_x_n - b.friction_x_n).hypot(a.friction_y_n - b.friction_y_n) / a.normal_force_n;
            let area = (a.contact_area_mm2 - b.contact_area_mm2).abs() / a.contact_area_mm2;
            [worst[0].max(force), worst[1].max(friction), worst[2].max(area)]
        })
    };
    let (near, far) = (apart(1e4), apart(1e5));
    println!("10 m: {near:?}, 100 m: {far:?}");
    for (quantity, k) in [("normal force", 0), ("friction over normal force", 1), ("area", 2)] {
        verify("a sphere of 100 m against the plane", quantity, far[k], 1e-3);
        verify("a sphere of 10 m against the plane", quantity, near[k], 1e-2);
    }
    assert!(far[0] < 0.2 * near[0], "the difference falls with the radius: {near:?} {far:?}");
}

/// A body of a heading of its own is that body turned by a spin.
pub fn a_turned_axis_is_a_spin() {
    let straight = placed(&[[0.0; 3], [0.6, 0.0, 0.0], [0.6, 0.5, 0.0]]);
    let spin = Turn { drive: Drive::Displacement, values: vec![40.0; 3] };
    let spun = Path { turns: Turns { spin: Some(spin), ..Turns::default() }, ..straight.clone() };
    let (a, b) = (
        on(round(BodyKind::Cylinder, 8.0, Some(70.0)), &straight),
        on(round(BodyKind::Cylinder, 8.0, Some(30.0)), &spun),
    );
    for corner in [1, 2] {
        let (a, b) = (at_corner(&a, corner), at_corner(&b, corner));
        verify("axis or spin", "normal force", (a.normal_force_n / b.normal_force_n - 1.0).abs(), 1e-3);
        let apart = (a.friction_x_n - b.friction_x_n).hypot(a.friction_y_n - b.friction_y_n);
        verify("axis or spin", "friction over normal force", apart / a.normal_force_n, 1e-3);
    }
}

/// The states of a paraboloid of half a millimetre pressed on `rigid` and led through places of it.
fn led(rigid: &RigidBody, places: &[[f64; 6]]) -> Vec<State> {
    let (mesh, body) = paraboloid(&Rotation3::identity());
    let settings = SolverSettings { tolerance: 1e-9, max_iterations: 100, ..Default::default() };
    let penalty = PenaltySettings { penalty_mpa_per_mm: 20.0, augment: false, ..Default::default() };
    let mut solver = Solver::new(&body, &mesh.pad_faces, Friction::On(RubberFriction::default()), penalty, settings);
    // Poses turn about the origin, from which depth counts in all of them.
    let outline = Outline::Smooth(Arc::new(|_: &Vector3<f64>| Vector3::zeros()));
    solver.set_rigid_body(rigid.clone(), Some(outline), &Plane::default());
    let mut state = solver.initial_state(Plane::default());
    let mut states = Vec::new();
    for &to in places {
        let guess = Guess { plane: state.contact.plane.moved_to(to), ..Guess::at(&state) };
        state = solver.step(&state, Target::place(to), guess, &mut Stats::default(), &mut unwatched).unwrap();
        states.push(state.clone());
    }
    states
}

/// The place of a cylinder along y that was turned by `turn` about its own axis, its surface towards +x, at this depth.
fn turned_in_place(radius_mm: f64, turn: f64, depth_mm: f64) -> [f64; 6] {
    let axis = depth_mm - radius_mm;
    // The plane turns against the pitch.
    let tilt = Plane::new([0.0, 0.0, 0.0, 0.0, -turn, 0.0]).tilt();
    let (x, up) = (tilt * Vector3::x(), tilt * Vector3::z());
    [axis * x.z, 0.0, axis * up.z + radius_mm, 0.0, -turn, 0.0]
}

/// A cylinder that turns about its own axis drags the finger like a plane that slides by the arc, and after a full turn
/// it drags as before: friction has no preferred direction.
pub fn a_cylinder_that_turns_in_place_slides() {
    const DEPTH: f64 = 0.2;
    let way: Vec<f64> = (0..=20).map(|k| 0.02 * f64::from(k)).collect();
    let press = [[0.0, 0.0, 0.5 * DEPTH, 0.0, 0.0, 0.0], [0.0, 0.0, DEPTH, 0.0, 0.0, 0.0]];
    let slides: Vec<[f64; 6]> = way.iter().map(|s| [*s, 0.0, DEPTH, 0.0, 0.0, 0.0]).collect();
    let on_plane = led(&RigidBody::Plane, &[&press[..], &slides].concat());
    let mut last = f64::INFINITY;
    for radius_mm in [200.0, 2000.0] {
        let cylinder = RigidBody::Cylinder { radius_mm, axis_deg: 90.0 };
        let turns: Vec<[f64; 6]> = way.iter().map(|s| turned_in_place(radius_mm, s / radius_mm, DEPTH)).collect();
        let turned = led(&cylinder, &[&press[..], &turns].concat());
        let scale = on_plane.iter().map(|s| s.totals.force.norm()).fold(0.0, f64::max);
        let in_space = |state: &State| state.contact.plane.tilt() * state.totals.force;
        let pairs = on_plane.iter().zip(&turned);
        let worst = pairs.map(|(a, b)| (in_space(a) - in_space(b)).norm() / scale).fold(0.0, f64::max);
        println!("radius {radius_mm} mm: {worst:.2e}");
        assert!(worst < 0.5 * last);
        last = worst;
    }
    verify("a cylinder of 2 m that turns in place against a plane that slides", "force", last, 5e-3);

    let radius_mm = 2.0;
    let cylinder = RigidBody::Cylinder { radius_mm, axis_deg: 90.0 };
    let turns: Vec<[f64; 6]> =
        (0..=120).map(|k| turned_in_place(radius_mm, 1.1 * TAU * f64::from(k) / 120.0, DEPTH)).collect();
    let states = led(&cylinder, &[&press[..], &turns].concat());
    let force = |turn: f64| {
        let state = &states[2 + (turn * 120.0 / 1.1).round() as usize];
        state.contact.plane.tilt() * state.totals.force
    };
    let scale = force(0.2).norm();
    assert!(force(0.2).x > 0.1 * force(0.2).z, "it drags: {}", force(0.2));
    for turn in [0.3, 0.5, 0.77, 1.1] {
        let apart = (force(turn) - force(0.2)).norm() / scale;
        verify(&format!("a cylinder after {turn} turns in place"), "change of the steady force", apart, 1e-6);
    }
}

/// Over a loop from air to air the work of the body is the dissipation by friction, less the change of the elastic slip
/// energy with the pressure: in all six coordinates, on every kind of body.
pub fn the_work_of_closed_paths_is_dissipated() {
    let turn = |values: [f64; 7]| Some(Turn { drive: Drive::Displacement, values: values.to_vec() });
    let corners = [
        [0.0, 0.0, 0.0],
        [0.5, 0.0, 0.0],
        [0.8, 0.6, 0.2],
        [0.7, 0.6, -0.3],
        [0.9, 0.1, -0.2],
        [0.6, 0.0, 0.0],
        [-0.3, 0.0, 0.0],
    ];
    let flat = placed(&corners);
    let turns = Turns {
        spin: turn([0.0, 0.0, 4.0, 4.0, -3.0, 0.0, 0.0]),
        pitch: turn([30.0, 30.0, 30.0, 33.0, 33.0, 30.0, 30.0]),
        roll: turn([0.0, 0.0, 0.0, 2.0, -2.0, 0.0, 0.0]),
    };
    let path = Path { turns, ..flat };
    for body in [
        round(BodyKind::Sphere, 10.0, None),
        round(BodyKind::Cylinder, 10.0, Some(30.0)),
        RigidBodySettings { angle_deg: Some(120.0), ..round(BodyKind::Edge, 4.0, Some(60.0)) },
    ] {
        let off = |step: f64| {
            let mut config = Config { mesh_preset: MeshPreset::Coarse, rigid_body: body.clone(), ..Config::default() };
            let steps = &mut config.numerics.load_steps;
            steps.max_slide_step_mm *= step;
            steps.max_depth_step_with_friction_mm *= step;
            let finger = config.finger_for(&[&path]).unwrap().0;
            let run = follow(&config.problem(&finger), &path).unwrap();
            let end = run.responses.last().unwrap();
            assert_eq!(end.contact_area_mm2, 0.0);
            let work = run.work;
            assert!(work.friction_mj > 0.0);

            (work.plane_mj + work.pressure_mj - work.friction_mj - work.stabilisation_mj) / work.friction_mj
        };
        let (whole, quarter) = (off(1.0), off(0.25));
        println!("{:?}: {:.3} %, in quarter steps {:.3} %", body.kind, 100.0 * whole, 100.0 * quarter);
        verify(&format!("closed path on {:?}, quarter steps", body.kind), "work that is nowhere", quarter.abs(), 5e-3);
    }
}

pub fn bodies_without_their_numbers_are_refused() {
    let refused = |body: RigidBodySettings| {
        let config = Config { mesh_preset: MeshPreset::Coarse, rigid_body: body, ..Config::default() };
        config.finger_for(&[&placed(&[[0.0; 3], [0.5, 0.0, 0.0]])]).map(|_| ()).unwrap_err().to_string()
    };
    let kind = |kind: BodyKind| RigidBodySettings { kind, ..RigidBodySettings::default() };
    assert!(refused(kind(BodyKind::Sphere)).contains("radius_mm is missing"));
    assert!(refused(kind(BodyKind::Heights)).contains("file is missing"));
    assert!(refused(round(BodyKind::Sphere, 5.0, Some(10.0))).contains("axis_deg = 10"));
    assert!(refused(round(BodyKind::Groove, -5.0, None)).contains("radius_mm = -5"));
}
