//! The finger on rigid bodies other than a plane.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::{
    problems::blocks::paraboloid,
    problems::fingers::{at_corner, follow, path, placed},
    verify,
};
use fingerpad::Status;
use fingerpad_fe::contact::{Friction, HeightField, Outline, PenaltySettings, Plane, RigidBody, RubberFriction};
use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};
use fingerpad_fe::load_path::{Drive, LoadPathError, Path, Problem, Trajectory, Turn, Turns};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_fe::solve::{Guess, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::{Rotation3, Vector3};

fn on(body: RigidBodySettings, path: &Path) -> Trajectory {
    try_on(body, path).unwrap()
}

fn try_on(body: RigidBodySettings, path: &Path) -> Result<Trajectory, LoadPathError> {
    let config = Config { mesh_preset: MeshPreset::Coarse, rigid_body: body, ..Config::default() };
    let finger = config.finger_for(&[path]).unwrap().0;
    config.check_path(path, &finger).unwrap();
    follow(&config.problem(&finger), path)
}

/// The path of places with a spin, and the same with `driven` coordinates (slides x and y, depth, spin) driven by the forces and
/// the moment that it leads to.
fn driven_by_forces(body: &RigidBodySettings, driven: [bool; 4]) {
    let places = placed(&[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 0.1, 0.05]]);
    let turn = |drive, values: Vec<f64>| Turns { spin: Some(Turn { drive, values }), ..Turns::default() };
    let places = Path { turns: turn(Drive::Displacement, vec![0.0, 0.0, 1.0]), ..places };
    let found = on(body.clone(), &places);
    let rows: Vec<[f64; 8]> = (0..3)
        .map(|k| {
            let r = at_corner(&found, k);
            let forces = [r.friction_x_n, r.friction_y_n, r.normal_force_n, r.moment_n_mm[2]];
            let at = [r.slide_x_mm, r.slide_y_mm, r.depth_mm, r.spin_deg];
            std::array::from_fn(|k| if k < 4 { at[k] } else { forces[k - 4] })
        })
        .collect();
    let drive = |k: usize| if driven[k] { Drive::Force } else { Drive::Displacement };
    let value = |row: usize, k: usize| rows[row][if driven[k] { 4 + k } else { k }];
    let corners: Vec<[f64; 3]> = (0..3).map(|row| [value(row, 2), value(row, 0), value(row, 1)]).collect();
    let flat = path([drive(2), drive(0), drive(1)], &corners);
    let spins = (0..3).map(|row| value(row, 3)).collect();
    let forced = on(body.clone(), &Path { turns: turn(drive(3), spins), ..flat });
    for row in 1..3 {
        let r = at_corner(&forced, row);
        let at = [r.slide_x_mm, r.slide_y_mm, r.depth_mm, r.spin_deg.to_radians() * 3.0];
        let wanted = [rows[row][0], rows[row][1], rows[row][2], rows[row][3].to_radians() * 3.0];
        let apart = (0..4).map(|k| (at[k] - wanted[k]).abs()).fold(0.0, f64::max);
        assert_eq!(r.status, Status::OK);
        // The two paths lead there in increments of their own, in which a little of the contact slips. A moment that grows evenly
        // with the depth turns a small contact on a cylinder, which is weak at first, by a degree.
        let most = if driven[3] && !driven[2] { 0.1 } else { 0.01 };
        verify(&format!("{:?} driven by forces {driven:?}, row {row}", body.kind), "place (mm)", apart, most);
    }
}

/// The equilibrium that is found by places is found by the forces and the moment that hold it there.
pub fn forces_find_the_places_of_a_ball_and_of_the_plane() {
    driven_by_forces(&round(BodyKind::Sphere, 10.0, None), [true, true, true, true]);
    driven_by_forces(&RigidBodySettings::default(), [true, true, true, true]);
}

/// With one, two and three axes and the moment. On an edge a slide force that grows from first touch on ends at a limit point.
pub fn forces_find_the_places_of_every_body() {
    for body in
        [RigidBodySettings::default(), round(BodyKind::Sphere, 10.0, None), round(BodyKind::Cylinder, 8.0, Some(30.0))]
    {
        for driven in [
            [true, false, false, false],
            [false, true, true, false],
            [true, true, false, false],
            [true, true, true, false],
            [false, false, true, true],
            [true, true, false, true],
            [true, true, true, true],
        ] {
            driven_by_forces(&body, driven);
        }
    }
}

/// A force or a moment that friction does not hold is an error that states both, before the increments are cut to nothing; without
/// contact friction holds nothing.
pub fn loads_beyond_friction_are_refused_on_every_body() {
    let pull = path([Drive::Force, Drive::Force, Drive::Displacement], &[[0.0; 3], [0.1, 0.0, 0.0], [0.1, 0.5, 0.0]]);
    let spin = Turn { drive: Drive::Force, values: vec![0.0, 0.0, 5.0] };
    let press =
        path([Drive::Force, Drive::Displacement, Drive::Displacement], &[[0.0; 3], [0.1, 0.0, 0.0], [0.1, 0.0, 0.0]]);
    let twist = Path { turns: Turns { spin: Some(spin), ..Turns::default() }, ..press };
    let (ball, edge) = (round(BodyKind::Sphere, 10.0, None), round(BodyKind::Edge, 4.0, Some(90.0)));
    for (body, path, about) in [(&ball, &pull, 0.134), (&ball, &twist, 0.208), (&edge, &pull, 0.11)] {
        let mut error = try_on(body.clone(), path).unwrap_err();
        let cost = error.take_reached().cost;
        let (wanted, holds) = match error {
            LoadPathError::BeyondFriction { wanted_n, holds_n, row: 2, .. } => (wanted_n / 0.5, holds_n),
            LoadPathError::BeyondFrictionMoment { wanted_n_mm, holds_n_mm, row: 2, .. } => {
                (wanted_n_mm / 5.0, holds_n_mm)
            }
            other => panic!("{other}"),
        };
        assert_eq!(wanted, 1.0);
        let case = format!("{:?}, a load beyond friction", body.kind);
        verify(&case, "off the load that friction holds at a larger force", (holds / about - 1.0).abs(), 0.05);
        verify(&case, "iterations", f64::from(cost.iterations), 400.0);
    }
    let in_air = path([Drive::Displacement, Drive::Force, Drive::Displacement], &[[-1.0, 0.0, 0.0], [-0.5, 0.05, 0.0]]);
    let error = try_on(round(BodyKind::Sphere, 10.0, None), &in_air).unwrap_err().to_string();
    assert!(error.contains("0.0500 N, beyond what friction holds here (0.0000 N"), "{error}");
}

/// A ball between the nodes passes through a face, which ends the run; where faces are larger than its radius the rows say so.
/// A contact that leaves the heights says so too.
pub fn bodies_too_sharp_or_too_small_are_flagged() {
    let press = placed(&[[0.0; 3], [0.6, 0.0, 0.0]]);
    let error = try_on(round(BodyKind::Sphere, 0.5, None), &press).unwrap_err();
    assert!(matches!(error, LoadPathError::InsideOut { row: 1, .. }), "{error}");
    let flags = |trajectory: &Trajectory| at_corner(trajectory, 1).status;
    assert_eq!(flags(&on(round(BodyKind::Sphere, 1.0, None), &press)), Status::BODY_TOO_SHARP);
    assert_eq!(flags(&on(round(BodyKind::Sphere, 3.0, None), &press)), Status::OK);
    // The rounding of an edge across y lies between two rows of nodes.
    assert_eq!(flags(&on(round(BodyKind::Edge, 0.5, Some(90.0)), &press)), Status::BODY_TOO_SHARP);

    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let finger = config.finger_for(&[&press]).unwrap().0;
    for (half_mm, expected) in [(1.0, Status::BEYOND_EDGE), (10.0, Status::OK)] {
        let place = |k: usize| half_mm * (k as f64 / 10.0 - 1.0);
        let heights = (0..21 * 21).map(|k| -(place(k % 21).powi(2) + place(k / 21).powi(2)) / 40.0).collect();
        let field = HeightField::new([21; 2], [half_mm / 10.0; 2], [-half_mm; 2], heights).unwrap();
        let problem = Problem { rigid_body: RigidBody::Heights(field), ..config.problem(&finger) };
        assert_eq!(flags(&follow(&problem, &press).unwrap()), expected, "{half_mm} mm");
    }
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

/// Input deck of a flat block of 4 x 4 x 3 cells of 1 mm, held at its top, whose bottom may touch.
fn flat_block() -> String {
    let node = |i: usize, j: usize, k: usize| 1 + i + 5 * (j + 5 * k);
    let mut deck = String::from("*NODE\n");
    for (k, j, i) in (0..4).flat_map(|k| (0..25).map(move |n| (k, n / 5, n % 5))) {
        deck += &format!("{}, {}.0, {}.0, {k}.0\n", node(i, j, k), i as i32 - 2, j as i32 - 2);
    }
    deck += "*ELEMENT, TYPE=C3D8, ELSET=skin\n";
    for (n, (k, j, i)) in (0..3).flat_map(|k| (0..16).map(move |n| (k, n / 4, n % 4))).enumerate() {
        let face = |k: usize| {
            format!("{}, {}, {}, {}", node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k))
        };
        deck += &format!("{}, {}, {}\n", n + 1, face(k), face(k + 1));
    }
    let list = |from: usize, to: usize| (from..=to).map(|n| format!("{n},\n")).collect::<String>();
    deck + "*NSET, NSET=proximal_fix\n"
        + &list(76, 100)
        + "*ELSET, ELSET=BOT\n"
        + &list(1, 16)
        + "*SURFACE, NAME=PAD, TYPE=ELEMENT\nBOT, S1\n"
}

/// All nodes of a flat pad touch at once; a force that presses it finds the depth that gives this force, and a moment its spin.
pub fn a_flat_pad_is_pressed_and_turned_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let (deck, settings) = (folder.path().join("block.inp"), folder.path().join("block.toml"));
    std::fs::write(&deck, flat_block()).unwrap();
    let soft = "[imported]\nfile = \"block.inp\"\n[imported.sets]\npad = \"PAD\"\n[tissue.bone]\nkind = \"fixed\"\n\
                [tissue.skin]\nkind = \"elastic\"\nyoung_mpa = 0.3\npoisson = 0.45\n";
    std::fs::write(&settings, soft).unwrap();
    let config = Config::read(&settings).unwrap();
    let run = |path: &Path| follow(&config.problem(&config.finger_for(&[path]).unwrap().0), path).unwrap();
    let by_depth = run(&placed(&[[0.0; 3], [0.262, 0.0, 0.0], [0.262, 0.3, 0.0]]));
    let force_n = [1, 2].map(|row| at_corner(&by_depth, row).normal_force_n);
    let drives = [Drive::Force, Drive::Displacement, Drive::Displacement];
    let pressed = path(drives, &[[0.0; 3], [force_n[0], 0.0, 0.0], [force_n[1], 0.3, 0.0]]);
    let by_force = run(&pressed);
    for row in [1, 2] {
        let (a, b) = (at_corner(&by_depth, row), at_corner(&by_force, row));
        verify("a flat pad by force and by depth", "depth (mm)", (a.depth_mm - b.depth_mm).abs(), 1e-3);
        verify("a flat pad by force and by depth", "friction (N)", (a.friction_x_n - b.friction_x_n).abs(), 2e-3);
    }
    let spin = Turn { drive: Drive::Force, values: vec![0.0, 0.0, 0.2] };
    let pressed = path(drives, &[[0.0; 3], [0.6, 0.0, 0.0], [0.6, 0.0, 0.0]]);
    let turned = run(&Path { turns: Turns { spin: Some(spin), ..Turns::default() }, ..pressed });
    let end = at_corner(&turned, 2);
    assert_eq!((end.status, end.spin_deg > 1.0), (Status::OK, true), "{} degrees", end.spin_deg);
    verify("a flat pad under a moment", "moment off (N mm)", (end.moment_n_mm[2] - 0.2).abs(), 1e-4);
}
