//! Poses in, wrenches out: the same as increments, the slopes of the energy, the same from everywhere, and nothing from nowhere.

use core::f64::consts::{PI, TAU};

use crate::common::{Double, Noise, shipped, shipped_pad};
use fingerpad::frames::{Finger, FrameContact, FrameResponse, RoundBed, Shape, Wrench};
use fingerpad::nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use fingerpad::pad::{Body, Cylinder, Edge, Pad, PadState, Sphere};
use fingerpad::{Elementary, Error, Motion, Regime, Response, SpinState, State, Status, Tuning, step};

const P: usize = 40;
/// Neutral pitch of the shipped models, degrees.
const NEUTRAL_DEG: f64 = 30.0;

/// A place of the body by the coordinates of a path: slide x and y of its apex (of a plane, of a place on it), depth, mm, spin, pitch and
/// roll, degrees.
type Coordinates = [f64; 6];

fn own_from_level(neutral_deg: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::y_axis(), (-neutral_deg).to_radians())
}

/// The axes of the plane in the finger's frame, whose x axis is the long axis of the finger.
fn plane_axes(neutral_deg: f64, [.., pitch, roll]: Coordinates) -> Matrix3<f64> {
    let rad = PI / 180.0;
    // The finger is rolled about the x axis that is level in the neutral pose, then pitched; the plane gets the inverse.
    let finger = Rotation3::from_axis_angle(&Vector3::y_axis(), (pitch - neutral_deg) * rad)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), roll * rad);
    let own_from_level = own_from_level(neutral_deg);
    (own_from_level * finger.inverse()).into_inner()
}

/// Pose of the apex and the axes of a body in the finger's frame.
fn apex_pose<T: Elementary>(pad: &Pad<'_, T>, at: Coordinates) -> Isometry3<f64> {
    let [x, y, depth, spin, pitch, roll] = at;
    let neutral_deg = pad.numbers.neutral_pitch_deg.to_f64();
    let (axes, own_from_level) = (plane_axes(neutral_deg, at), own_from_level(neutral_deg));
    let touch = Vector3::from(pad.first_touch_point_mm([pitch, roll].map(|angle| T::near(angle))).map(|x| x.to_f64()));
    let normal = Vector3::from(axes.column(2));
    let height = -normal.dot(&(own_from_level * touch)) - depth;
    let place = axes.column(0) * x + axes.column(1) * y - normal * height;
    let rotation =
        Rotation3::from_matrix_unchecked(axes) * Rotation3::from_axis_angle(&Vector3::z_axis(), spin.to_radians());
    Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The place along the plane's axes under the point that touches first in a pose.
fn under(pad: &Pad<'_, f64>, pose_deg: [f64; 2]) -> [f64; 2] {
    let neutral_deg = pad.numbers.neutral_pitch_deg;
    let touch = own_from_level(neutral_deg) * Vector3::from(pad.first_touch_point_mm(pose_deg));
    let place = plane_axes(neutral_deg, [0.0, 0.0, 0.0, 0.0, pose_deg[0], pose_deg[1]]).tr_mul(&touch);
    [place.x, place.y]
}

/// Shapes, the same bodies for increments, and the pose of the shape's frame in that of its apex.
fn bodies() -> [(Shape, Body<f64>, Isometry3<f64>); 4] {
    let below = |radius: f64| Translation3::new(0.0, 0.0, -radius);
    let axis_along_x = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI / 2.0);
    [
        (Shape::plane(), Body::Plane, Isometry3::identity()),
        (
            Shape::sphere(10.0).unwrap(),
            Body::Sphere(Sphere::new(10.0).unwrap()),
            Isometry3::from_parts(below(10.0), UnitQuaternion::identity()),
        ),
        (
            Shape::cylinder(12.0, 100.0).unwrap(),
            Body::Cylinder(Cylinder::new(12.0, 0.0).unwrap()),
            Isometry3::from_parts(below(12.0), axis_along_x),
        ),
        (Shape::edge(4.0, 110.0).unwrap(), Body::Edge(Edge::new(4.0, 0.0, 110.0).unwrap()), Isometry3::identity()),
    ]
}

/// A path of random motions in small steps, from the air.
fn path(seed: u64, neutral_deg: f64) -> Vec<Coordinates> {
    let mut random = Noise(seed);
    let mut at = [0.0, 0.0, -0.05, 0.0, neutral_deg, 0.0];
    let mut path = vec![at];
    for leg in 0..6 {
        let mut draw = |size: f64| size * f64::from(random.next());
        let to = [draw(1.5), draw(1.5), 0.9 + draw(0.7), draw(30.0), neutral_deg + draw(12.0), draw(12.0)];
        let from = at;
        let to = if leg == 0 { [0.0, 0.0, 0.5, 0.0, neutral_deg, 0.0] } else { to };
        for k in 1..=40 {
            at = core::array::from_fn(|i| from[i] + f64::from(k) / 40.0 * (to[i] - from[i]));
            path.push(at);
        }
    }
    path
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Force and moment in the finger's frame from a response along the axes of the plane.
fn expected(pad: &Pad<'_, f64>, at: Coordinates, r: &Response<f64>) -> Wrench<f64> {
    let axes = plane_axes(pad.numbers.neutral_pitch_deg, at);
    let pose = apex_pose(pad, [0.0, 0.0, at[2], 0.0, at[4], at[5]]);
    let force = axes * Vector3::new(r.friction_n[0], r.friction_n[1], r.normal_force_n);
    let about_foot = axes * Vector3::new(r.tilt_moment_n_mm[0], r.tilt_moment_n_mm[1], r.spin_moment_n_mm);
    let moment = about_foot + pose.translation.vector.cross(&force);
    Wrench { force_n: force.into(), moment_n_mm: moment.into() }
}

/// Slides of a plane are those of its foot, so that a path of the increments of a plane is one of poses only if it is integrated.
fn plane_pose(pad: &Pad<'_, f64>, path: &[Coordinates]) -> Vec<Isometry3<f64>> {
    let (mut x, mut y) = (0.0, 0.0);
    let mut before = path[0];
    path.iter()
        .map(|&at| {
            // The origin of the plane goes round the foot.
            let spin = (at[3] - before[3]).to_radians();
            let (half_sin, half_cos) = (0.5 * spin).sin_cos();
            let (dx, dy) = (at[0] - before[0], at[1] - before[1]);
            (x, y) = (
                spin.cos() * x - spin.sin() * y + half_cos * dx - half_sin * dy,
                spin.sin() * x + spin.cos() * y + half_sin * dx + half_cos * dy,
            );
            before = at;
            apex_pose(pad, [x, y, at[2], at[3], at[4], at[5]])
        })
        .collect()
}

/// Poses give the same response as increments, and its force and moment in both frames.
fn poses_like_increments(pad: Pad<'_, f64>) {
    let neutral_deg = pad.numbers.neutral_pitch_deg;
    for (k, (shape, body, to_shape)) in bodies().into_iter().enumerate() {
        for seed in 0..4 {
            let path = path(10 * k as u64 + seed, neutral_deg);
            let poses =
                if k == 0 { plane_pose(&pad, &path) } else { path.iter().map(|&at| apex_pose(&pad, at)).collect() };
            let mut contact = FrameContact::<PadState<P, f64>>::new(&pad, shape).unwrap();
            let mut state = PadState::<P, f64>::new(&pad).unwrap();
            let mut before = path[0];
            let mut seen = 0;
            for (&at, pose) in path.iter().zip(&poses) {
                let here = pose * to_shape;
                let felt = contact.step(&pad, &here, 1e-3);
                let motion = Motion {
                    depth_mm: at[2],
                    slide_increment_mm: [at[0] - before[0], at[1] - before[1]],
                    spin_increment_rad: (at[3] - before[3]).to_radians(),
                    dt_s: 1e-3,
                };
                before = at;
                let r = pad.step(&mut state, &body, motion, [at[4], at[5]]);
                if r.regime == Regime::NoContact {
                    assert_eq!(felt.on_finger, Wrench::default());
                    continue;
                }
                seen += 1;
                let expected = expected(&pad, at, &r);
                // A ball's apex is where the finger touches it first and not that of the path; anchors are found to first order from there.
                let tolerance = if k == 1 { 2e-4 } else { 1e-6 };
                let size = r.normal_force_n.abs() + 0.1;
                let off = largest(&felt.on_finger.force_n, &expected.force_n) / size;
                let turned = largest(&felt.on_finger.moment_n_mm, &expected.moment_n_mm) / (10.0 * size);
                assert!(off < tolerance && turned < tolerance, "{body:?} {at:?}: {off} {turned} {felt:?} {expected:?}");
                assert!((felt.response.stick_ratio - r.stick_ratio).abs() < 100.0 * tolerance, "{body:?} {at:?}");
                balanced(&felt, &here);
            }
            assert!(seen > 100, "{body:?}: {seen}");
        }
    }
}

#[test]
fn poses_are_the_same_as_increments() {
    poses_like_increments(Double::new().pad());
}

/// Another tip: small, stiff, and fitted in another pose.
#[test]
fn poses_of_another_tip_are_the_same_as_increments() {
    let mut other = Double::new();
    other.numbers.neutral_pitch_deg = 48.0;
    poses_like_increments(other.pad().tuned(Tuning { size: 0.7, stiffness: 4.0, lambda: 0.5 }).unwrap());
}

/// A block stands on a table of its own, a spring and dampers, and a finger presses and drags it. Driven by the wrenches of the frames it
/// goes as it does driven by increments.
#[test]
fn a_block_on_a_table_is_dragged_as_by_increments() {
    const STIFFNESS_N_MM: f64 = 2.0;
    const DAMPING_N_S_MM: f64 = 0.05;
    let double = Double::new();
    let pad = double.pad();
    let level = own_from_level(NEUTRAL_DEG);
    let mut contact =
        FrameContact::<PadState<P, f64>>::new(&pad, Shape::cuboid([20.0, 20.0, 10.0], 2.0).unwrap()).unwrap();
    let mut state = PadState::<P, f64>::new(&pad).unwrap();
    // Place of the block along and up, mm, by frames and by increments.
    let (mut by_frames, mut by_steps, mut before) = ([0.0f64; 2], [0.0f64; 2], 0.0);
    let dt = 1e-3;
    let table = |at: &mut [f64; 2], along: f64, up: f64| {
        at[0] += dt * along / DAMPING_N_S_MM;
        at[1] += dt * (up - STIFFNESS_N_MM * at[1]) / DAMPING_N_S_MM;
    };
    let (mut least, mut slid) = (f64::INFINITY, 0.0f64);
    for k in 0..1500 {
        let t = f64::from(k) / 500.0;
        let (x, down) = (1.5 * (t - 1.0).max(0.0).sin(), (2.0 * t - 0.1).min(1.1));
        let place = level * Vector3::new(by_frames[0] - x, 0.0, down + by_frames[1] - 10.0);
        let body = Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_rotation_matrix(&level));
        let [along, _, up] = contact.step(&pad, &body, dt).on_body.force_n;
        table(&mut by_frames, along, up);
        let motion = Motion {
            depth_mm: down + by_steps[1] - pad.first_touch_mm(&[0.0, 0.0, 1.0]),
            slide_increment_mm: [by_steps[0] - x - before, 0.0],
            spin_increment_rad: 0.0,
            dt_s: dt,
        };
        before = by_steps[0] - x;
        let r = pad.step(&mut state, &Body::Plane, motion, [NEUTRAL_DEG, 0.0]);
        table(&mut by_steps, -r.friction_n[0], -r.normal_force_n);
        assert!(largest(&by_frames, &by_steps) < 1e-9, "{k}: {by_frames:?} {by_steps:?}");
        least = least.min(by_steps[1]);
        slid = slid.max(by_steps[0]);
    }
    assert!(least < -0.05 && slid > 1.0, "it sinks by {least} and goes {slid} mm");
}

/// What acts on the body is the opposite of what acts on the finger.
fn balanced(felt: &FrameResponse<f64>, body: &Isometry3<f64>) {
    let force = body.rotation * Vector3::from(felt.on_body.force_n);
    let moment = body.rotation * Vector3::from(felt.on_body.moment_n_mm) + body.translation.vector.cross(&force);
    assert!((force + Vector3::from(felt.on_finger.force_n)).norm() < 1e-9, "{felt:?}");
    assert!((moment + Vector3::from(felt.on_finger.moment_n_mm)).norm() < 1e-7, "{felt:?}");
}

/// Force and moment are the slopes of the stored energy over the six small motions of the body, in poses within and beyond the range.
#[test]
fn wrenches_are_the_slopes_of_the_energy() {
    let double = Double::new();
    let pad = double.pad();
    let mut checked = 0;
    for (shape, body, to_shape) in bodies() {
        let poses = [[30.0, 0.0], [22.0, 10.0], [45.0, -14.0], [60.0, 8.0], [76.0, 5.0], [40.0, 37.0]];
        for (k, [pitch, roll]) in poses.into_iter().enumerate() {
            // The apex lies under the point that touches first.
            let [x, y] = under(&pad, [pitch, roll]);
            let start = apex_pose(&pad, [x, y, 0.9, 20.0, pitch, roll]) * to_shape;
            let mut contact = FrameContact::<PadState<P, f64>>::new(&pad, shape).unwrap();
            // Nothing slips in the small motions.
            contact.state_mut().set_strength_factor(5.0);
            contact.step(&pad, &start, 1e-3);
            let aside = Translation3::new(0.01, -0.005, 0.0) * start;
            let felt = contact.step(&pad, &aside, 1e-3);
            // A patch on a steep flank may slip all the same; then energy is lost.
            if pad.patch_states(contact.state(), &body).iter().any(|patch| patch.used > 0.98) {
                continue;
            }
            checked += 1;
            let scale = felt.on_finger.force_n.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            for axis in 0..6 {
                let energy = |by: f64| {
                    let mut shift = Vector3::zeros();
                    let mut turn = Vector3::zeros();
                    (if axis < 3 { &mut shift } else { &mut turn })[axis % 3] = by;
                    let moved = Isometry3::new(shift, turn) * aside;
                    let mut there = contact;
                    there.step(&pad, &moved, 1e-3);
                    pad.energy_mj(there.state(), &body)
                };
                let size = if axis < 3 { 1e-4 } else { 1e-5 };
                let slope = (energy(size) - energy(-size)) / (2.0 * size);
                let (found, of) = if axis < 3 {
                    (felt.on_finger.force_n[axis], scale)
                } else {
                    (felt.on_finger.moment_n_mm[axis - 3], 10.0 * scale)
                };
                assert!(
                    (slope - found).abs() < 1e-3 * of,
                    "{body:?} pose {k} axis {axis}: slope {slope}, found {found}"
                );
            }
        }
    }
    assert!(checked >= 18, "{checked}");
}

/// Finger and body, moved and turned together, feel the same.
#[test]
fn a_full_turn_of_both_frames_together_changes_nothing() {
    let file = shipped_pad();
    let pad = file.file().pad;
    for (shape, _, to_shape) in bodies() {
        let relative = apex_pose(&pad, [0.0, 0.0, 0.8, 10.0, 38.0, 6.0]) * to_shape;
        let mut contact = FrameContact::<PadState<P>>::new(&pad, shape).unwrap();
        let mut first = None;
        for k in 0..=400 {
            let turn = TAU * f64::from(k) / 400.0;
            let world = Isometry3::new(
                Vector3::new(3000.0 * turn, -500.0, 40.0),
                Vector3::new(0.3, 0.9, -0.4).normalize() * turn,
            );
            let (finger, body) = (world, world * relative);
            let felt = contact.step(&pad, &(finger.inverse() * body), 1e-3);
            let first = first.get_or_insert(felt);
            let off = |a: [f32; 3], b: [f32; 3]| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
            let size = first.response.normal_force_n;
            assert!(
                size > 0.03 && off(felt.on_finger.force_n, first.on_finger.force_n) < 1e-6 + 1e-5 * size,
                "{k}: {felt:?} {first:?}"
            );
            assert!(
                off(felt.on_finger.moment_n_mm, first.on_finger.moment_n_mm) < 1e-5 + 1e-4 * size,
                "{k}: {felt:?} {first:?}"
            );
        }
    }
}

/// A ball that spins about its own middle changes no pressure, and loops of slide and spin close.
#[test]
fn a_ball_spins_about_itself() {
    let double = Double::new();
    let pad = double.pad();
    let body = Body::Sphere(Sphere::new(8.0).unwrap());
    let mut state = PadState::<P, f64>::new(&pad).unwrap();
    // Hardly any friction.
    state.set_strength_factor(0.1);
    let mut go = |depth: f64, x: f64, spin_deg: f64| {
        let motion = Motion {
            depth_mm: depth,
            slide_increment_mm: [x, 0.0],
            spin_increment_rad: spin_deg.to_radians(),
            dt_s: 1e-3,
        };
        pad.step(&mut state, &body, motion, [NEUTRAL_DEG, 0.0])
    };
    let turned = |go: &mut dyn FnMut(f64, f64, f64) -> Response<f64>, deg: f64| {
        let mut last = Response::default();
        for _ in 0..90 {
            last = go(1.0, 0.0, deg / 90.0);
        }
        last
    };
    let mut last = go(1.0, 0.0, 0.0);
    for _ in 0..20 {
        last = go(1.0, 0.05, 0.0);
    }
    let slid = last;
    let spun = turned(&mut go, 180.0);
    // Friction of a tenth turns with the skin; a ball that goes round would change sides: the centre by 2 mm.
    assert!((spun.pressure_centre_mm[0] - slid.pressure_centre_mm[0]).abs() < 0.1, "{slid:?} {spun:?}");
    assert!((spun.normal_force_n / slid.normal_force_n - 1.0).abs() < 0.02, "{slid:?} {spun:?}");
    for _ in 0..20 {
        last = go(1.0, -0.05, 0.0);
    }
    assert!(last.pressure_centre_mm[1].abs() < 0.1, "{last:?}");
}

/// A finger that comes into a box from its side feels nothing of a depth that it never passed, and gains no energy.
#[test]
fn a_contact_begins_near_the_surface() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let shape = Shape::cuboid([25.0; 3], 2.0).unwrap();
    // The finger lies level and looks down on the top of the box.
    let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (-NEUTRAL_DEG).to_radians());
    for below_mm in [10.0, 16.0, 24.0] {
        for per_step_mm in [0.05, 0.4, 3.0] {
            let mut contact = FrameContact::<PadState<P>>::new(&pad, shape).unwrap();
            let (mut work, mut most, mut x) = (0.0, 0.0f32, 40.0);
            while x > -10.0 {
                x -= per_step_mm;
                // The middle of the box from the finger, along level axes.
                let pose =
                    Isometry3::from_parts(Translation3::from(level * Vector3::new(-x, 0.0, below_mm - 25.0)), level);
                let felt = contact.step(&pad, &pose, 1e-3);
                let push = level.inverse() * Vector3::from(felt.on_finger.force_n.map(f64::from));
                work += push.x * -per_step_mm;
                most = most.max(felt.depth_mm);
                if felt.response.regime != Regime::NoContact {
                    assert!(felt.response.status.contains(Status::BEGAN_INSIDE), "{felt:?}");
                }
            }
            assert!(most <= 1.0 && work < 1e-3, "{below_mm} {per_step_mm}: {most} {work}");
            // It comes out at the top and touches as every finger does.
            for depth in [0.0, -0.5, -0.2, 0.1, 0.4] {
                let pose =
                    Isometry3::from_parts(Translation3::from(level * Vector3::new(10.0, 0.0, depth - 25.0)), level);
                let felt = contact.step(&pad, &pose, 1e-3);
                if depth > 0.0 {
                    assert!(
                        (f64::from(felt.depth_mm) - depth).abs() < 0.05 && felt.response.status == Status::OK,
                        "{felt:?}"
                    );
                }
            }
        }
    }
}

/// Loss that counts against a later gain, mJ: that of the slip just before.
const COUNTS_MJ: f64 = 2e-3;

/// The most that contacts with some bodies store along a path beyond what its motion brings, mJ, and what was felt in the last step.
///
/// * `bodies`: shapes, and their poses in the frame of the first one
/// * `path`: poses of the first body in the finger's frame
fn most_gain_mj(
    pad: &Pad<'_, f64>,
    bodies: &[(Shape, Isometry3<f64>)],
    path: &[Isometry3<f64>],
) -> (f64, Vec<FrameResponse<f64>>) {
    let mut contacts: Vec<_> =
        bodies.iter().map(|(shape, _)| FrameContact::<PadState<P, f64>>::new(pad, *shape).unwrap()).collect();
    let mut felt = vec![FrameResponse::default(); bodies.len()];
    let (mut most, mut balance, mut stored) = (0.0f64, 0.0f64, 0.0);
    for (k, pose) in path.iter().enumerate() {
        let way = pose * path[k.max(1) - 1].inverse();
        let (shift, turn) = (way.translation.vector, way.rotation.scaled_axis());
        let work = |felt: &[FrameResponse<f64>]| -> f64 {
            let of = |r: &FrameResponse<f64>| {
                Vector3::from(r.on_finger.force_n).dot(&shift) + Vector3::from(r.on_finger.moment_n_mm).dot(&turn)
            };
            felt.iter().map(of).sum()
        };
        let before = work(&felt);
        let mut now = 0.0;
        for ((contact, (_, at)), felt) in contacts.iter_mut().zip(bodies).zip(&mut felt) {
            *felt = contact.step(pad, &(pose * at), 1e-3);
            if felt.response.regime != Regime::NoContact {
                let is_edge = felt.face > 6;
                let edge = Body::Edge(Edge::new(2.0, 0.0, 90.0).unwrap());
                now += pad.energy_mj(contact.state(), if is_edge { &edge } else { &Body::Plane });
            }
        }
        let gain = now - stored - 0.5 * (before + work(&felt));
        balance = (balance + gain).max(-COUNTS_MJ);
        most = most.max(balance);
        stored = now;
    }
    (most, felt)
}

/// A finger goes round a body of fifteen faces, each a box of its own, and over the edge of one box. It comes to each next face from the side
/// and below the surface, stores no more than the motion brings, and slip raises it.
#[test]
fn a_finger_that_slides_from_face_to_face_gains_no_energy() {
    let double = Double::new();
    let pad = double.pad();
    let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (-NEUTRAL_DEG).to_radians());
    let (out_mm, turn) = (37.0, TAU / 15.0);
    let half = [10.0, out_mm * (0.5 * turn).tan(), 10.0];
    // The axis of the body goes along the finger; its faces pass across. Rounded so wide, the boxes have no edges, as for a bed.
    let face_at = |k: f64| {
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), k * turn);
        (
            Shape::cuboid(half, 9.0).unwrap(),
            Isometry3::from_parts(Translation3::from(turned * Vector3::new(0.0, 0.0, out_mm - 10.0)), turned),
        )
    };
    let faces: Vec<_> = (0..4).map(|k| face_at(f64::from(k))).collect();
    for depth in [0.5f64, 0.9, 1.6] {
        for per_step in [0.02, 0.1] {
            let steps = (3.45 * turn * out_mm / per_step) as usize;
            let path: Vec<_> = (0..=steps + 20)
                .map(|k| {
                    let down = depth.min(0.05 * k as f64 - 0.1);
                    let angle = (k.max(20) - 20) as f64 * per_step / out_mm;
                    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -angle);
                    Isometry3::from_parts(
                        Translation3::from(level * Vector3::new(0.0, 0.0, down - out_mm)),
                        level * turned,
                    )
                })
                .collect();
            let (most, felt) = most_gain_mj(&pad, &faces, &path);
            assert!(most < 5e-3 * per_step, "{depth} mm deep, steps of {per_step} mm: {most} mJ");
            // A first step takes the pose as it is.
            let mut fresh = FrameContact::<PadState<P, f64>>::new(&pad, faces[3].0).unwrap();
            let (last, here) = (felt[3], fresh.step(&pad, &(path[path.len() - 1] * faces[3].1), 1e-3));
            // At the middle of the face the finger touched it first, as much below the surface as it is deep there.
            let lower = here.depth_mm - last.depth_mm;
            assert!(last.face == 3 && lower < 0.8 * depth, "{depth} {per_step}: {lower} {last:?}");
        }
    }
    // Over the edge of a box, rolled more and more.
    let shape = Shape::cuboid([25.0; 3], 2.0).unwrap();
    for deep in [0.6f64, 1.2] {
        let path: Vec<_> = (0..900)
            .map(|k| {
                let s = f64::from(k) / 900.0;
                let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -1.2 * s);
                let aside = 15.0 + 14.0 * s;
                let place = roll * Vector3::new(0.0, -aside, deep.min(0.05 * f64::from(k) - 0.1) - 25.0);
                Isometry3::from_parts(Translation3::from(level * place), level * roll)
            })
            .collect();
        let (most, _) = most_gain_mj(&pad, &[(shape, Isometry3::identity())], &path);
        assert!(most < 1e-3, "{deep} mm deep: {most} mJ");
    }
}

/// A finger far below the surface is not raised by slip: it stays where its contact began.
#[test]
fn slip_does_not_raise_a_finger_from_the_depth() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let shape = Shape::cuboid([25.0; 3], 2.0).unwrap();
    let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (-NEUTRAL_DEG).to_radians());
    let mut contact = FrameContact::<PadState<P>>::new(&pad, shape).unwrap();
    for k in 0..300 {
        let (aside, pressed) = (26.0 - 0.1 * f64::from(k), (0.01 * f64::from(k)).min(0.5));
        let place = level * Vector3::new(-aside, 0.0, 12.0 + pressed - 25.0);
        let felt = contact.step(&pad, &Isometry3::from_parts(Translation3::from(place), level), 1e-3);
        assert!(felt.depth_mm < 0.51, "{k}: {felt:?}");
        if k > 60 {
            assert!(felt.depth_mm > 0.3 && felt.response.status.contains(Status::BEGAN_INSIDE), "{k}: {felt:?}");
        }
    }
}

/// A body that is known near the finger alone: its shape changes in the air, in frames of its own, and the rule of how a contact begins holds.
#[test]
fn a_shape_that_changes_in_the_air_is_touched_as_any() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let ball = Shape::sphere(10.0).unwrap();
    // The frame of the ball in that of the body, and back.
    let moved = Isometry3::new(Vector3::new(3.0, -2.0, -14.0), Vector3::new(0.4, 0.2, -0.3));
    let body_at = |depth: f64| {
        let apex = apex_pose(&pad, [0.0, 0.0, depth, 0.0, NEUTRAL_DEG, 0.0]);
        apex * Translation3::new(0.0, 0.0, -10.0) * moved.inverse()
    };
    let mut known = FrameContact::<PadState<P>>::new(&pad, ball).unwrap();
    let mut found = FrameContact::<PadState<P>>::new(&pad, Shape::cylinder(3.0, 5.0).unwrap()).unwrap();
    let mut frame = Isometry3::identity();
    for (k, depth) in [-5.0, -0.4, -0.1, 0.1, 0.3, 0.7, 1.0, 0.4, -0.2, -3.0, 2.5, 2.7].into_iter().enumerate() {
        if k == 1 || depth == 2.5 {
            found.reshape(ball, &(frame.inverse() * moved));
            frame = moved;
        }
        let body = body_at(depth);
        let (one, other) = (known.step(&pad, &(body * moved), 1e-3), found.step(&pad, &(body * frame), 1e-3));
        if k == 0 {
            continue;
        }
        assert!((one.depth_mm - other.depth_mm).abs() < 1e-5, "{depth}: {one:?} {other:?}");
        assert_eq!(
            one.response.status.contains(Status::BEGAN_INSIDE),
            other.response.status.contains(Status::BEGAN_INSIDE)
        );
        assert_eq!(other.response.status.contains(Status::BEGAN_INSIDE), depth >= 2.5, "{depth}");
        let apart = |a: [f32; 3], b: [f32; 3]| (Vector3::from(a) - Vector3::from(b)).norm();
        assert!(apart(one.on_finger.force_n, other.on_finger.force_n) < 1e-4, "{depth}: {one:?} {other:?}");
    }
}

/// A blow of 3 mm in one step begins 1 mm deep; a first step takes the pose as it is.
#[test]
fn a_fast_finger_begins_a_millimetre_deep() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let at = |depth: f64| apex_pose(&pad, [0.0, 0.0, depth, 0.0, NEUTRAL_DEG, 0.0]);
    let mut contact = FrameContact::<PadState<P>>::new(&pad, Shape::plane()).unwrap();
    contact.step(&pad, &at(-1.0), 1e-3);
    let felt = contact.step(&pad, &at(2.0), 1e-3);
    assert!((felt.depth_mm - 1.0).abs() < 1e-5 && felt.response.status == Status::BEGAN_INSIDE, "{felt:?}");
    let felt = contact.step(&pad, &at(2.5), 1e-3);
    assert!((felt.depth_mm - 1.5).abs() < 1e-5, "{felt:?}");
    contact.step(&pad, &at(-0.1), 1e-3);
    let felt = contact.step(&pad, &at(0.5), 1e-3);
    assert!((felt.depth_mm - 0.5).abs() < 1e-5 && felt.response.status == Status::OK, "{felt:?}");
    let mut fresh = FrameContact::<PadState<P>>::new(&pad, Shape::plane()).unwrap();
    let felt = fresh.step(&pad, &at(2.0), 1e-3);
    assert!((felt.depth_mm - 2.0).abs() < 1e-5 && felt.response.status == Status::OK, "{felt:?}");
}

/// Poses that are none are flagged and not taken.
#[test]
fn bad_poses_are_flagged() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let at = |depth: f64| apex_pose(&pad, [0.0, 0.0, depth, 0.0, 34.0, 5.0]);
    let bad = [
        Isometry3::from_parts(Translation3::new(f64::NAN, 0.0, 0.0), UnitQuaternion::identity()),
        Isometry3::from_parts(Translation3::new(0.0, f64::INFINITY, 0.0), UnitQuaternion::identity()),
        Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::new_unchecked(Quaternion::new(2.0, 0.0, 0.0, 0.0)),
        ),
        Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 0.0)),
        ),
        Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 1.0)),
        ),
    ];
    for pose in &bad {
        let mut contact = FrameContact::<PadState<P>>::new(&pad, Shape::plane()).unwrap();
        let felt = contact.step(&pad, pose, 1e-3);
        assert_eq!((felt.response.regime, felt.response.status), (Regime::NoContact, Status::BAD_INPUT));
        for depth in [-0.1, 0.3, 0.6] {
            contact.step(&pad, &at(depth), 1e-3);
        }
        let before = contact.step(&pad, &at(0.6), 1e-3);
        let felt = contact.step(&pad, pose, 1e-3);
        assert_eq!(felt.on_finger, before.on_finger, "{pose:?}");
        assert_eq!(felt.response.status, Status::BAD_INPUT, "{pose:?}");
        assert_eq!(contact.step(&pad, &at(0.6), 1e-3), before, "{pose:?}");
    }
}

/// A robot goes through poses at 1 kHz with the noise of its encoders: no drift, nothing lost, friction within its limit.
#[test]
fn a_cycle_through_poses_with_noise_does_not_drift() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let mut random = Noise(7);
    for (shape, body, to_shape) in bodies() {
        let mut contact = FrameContact::<PadState<P>>::new(&pad, shape).unwrap();
        let mut after = vec![];
        for cycle in 0..4 {
            for k in 0..500 {
                let turn = TAU * f64::from(k) / 500.0;
                let at = [
                    0.3 * turn.sin(),
                    0.3 - 0.3 * turn.cos(),
                    0.8 + 0.2 * turn.sin(),
                    5.0 * turn.sin(),
                    34.0 + 4.0 * turn.cos(),
                    6.0 * turn.sin(),
                ];
                let mut draw = |size: f64| size * f64::from(random.next());
                let noisy = Isometry3::new(
                    Vector3::new(draw(1e-3), draw(1e-3), draw(1e-3)),
                    Vector3::new(draw(5e-5), draw(5e-5), draw(5e-5)),
                );
                let felt = contact.step(&pad, &(noisy * apex_pose(&pad, at) * to_shape), 1e-3);
                let r = &felt.response;
                assert_eq!(r.status.difference(Status::BEYOND_EDGE), Status::OK, "{body:?} {k}: {felt:?}");
                let [x, y] = r.tangential_friction_n;
                assert!(x.hypot(y) <= 1.001 * r.friction_limit_n, "{body:?} {k}: {felt:?}");
                assert!(r.normal_force_n > 0.02 && felt.face == 1, "{body:?} {k}: {felt:?}");
                if k == 499 && cycle > 0 {
                    after.push(felt);
                }
            }
        }
        let [first, .., last] = &after[..] else { panic!("cycles") };
        for k in 0..3 {
            let off = (first.on_finger.force_n[k] - last.on_finger.force_n[k]).abs();
            assert!(off < 0.02 * first.response.friction_limit_n, "{body:?}: {first:?} {last:?}");
        }
    }
}

/// A bed on the faces of a box: the forces of its increments, in its own pose and tilted; it refuses what it cannot touch.
#[test]
fn a_bed_touches_planes_and_boxes() {
    let data = shipped();
    let model = data.model().unwrap();
    let bed = RoundBed::new(model);
    let curved = FrameContact::<SpinState>::new(&bed, Shape::<f64>::sphere(10.0).unwrap());
    assert_eq!(curved.err(), Some(Error::Curved));
    let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (-NEUTRAL_DEG).to_radians());
    let mut contact = FrameContact::<State>::new(&bed, Shape::cuboid([40.0, 30.0, 10.0], 2.0).unwrap()).unwrap();
    let mut state = State::default();
    for k in 0..200 {
        let (depth, x) = ((0.01 * f64::from(k) - 0.1).min(1.0), 0.005 * f64::from((k - 110).max(0)));
        let pose = Isometry3::from_parts(Translation3::from(level * Vector3::new(x, 0.0, depth - 10.0)), level);
        let felt = contact.step(&bed, &pose, 1e-3);
        let slide = if k > 110 { 0.005 } else { 0.0 };
        let r = step(
            &model,
            &mut state,
            Motion { depth_mm: depth as f32, slide_increment_mm: [slide, 0.0], dt_s: 1e-3, ..Motion::default() },
        );
        assert!(
            (felt.response.normal_force_n - r.normal_force_n).abs() < 1e-4 && felt.face == 3,
            "{k}: {felt:?} {r:?}"
        );
        assert!((felt.response.friction_n[0] - r.friction_n[0]).abs() < 1e-4, "{k}: {felt:?} {r:?}");
        let force = level.inverse() * Vector3::from(felt.on_finger.force_n.map(f64::from));
        assert!(
            (force.x - f64::from(r.friction_n[0])).abs() < 1e-4 && (force.z - f64::from(r.normal_force_n)).abs() < 1e-4
        );
    }
    let tilted = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (-40.0f64).to_radians());
    let pose = Isometry3::from_parts(Translation3::from(tilted * Vector3::new(0.5, 0.0, 1.0 - 10.0)), tilted);
    let felt = contact.step(&bed, &pose, 1e-3);
    assert!((felt.pose_deg[0] - 40.0).abs() < 1e-3, "{felt:?}");
    assert!((f64::from(felt.depth_mm) - (1.0 + 21.0 * (1.0 - 10.0f64.to_radians().cos()))).abs() < 1e-4, "{felt:?}");
}

/// Faces, edges and ends of boxes, capsules and cylinders.
#[test]
fn shapes_are_met_where_the_finger_comes_to_them() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let neutral = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (-NEUTRAL_DEG).to_radians());
    let quarter = |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis * (PI / 2.0));
    let none = UnitQuaternion::identity();
    let boxed = Shape::cuboid([12.0, 14.0, 10.0], 3.0).unwrap();
    let capsule = Shape::capsule(8.0, 20.0).unwrap();
    let cylinder = Shape::cylinder(9.0, 15.0).unwrap();
    // Shape; turn of the shape; distance of its middle from the surface; face; place of the middle along y.
    for (shape, turn, under_mm, face, y) in [
        (boxed, none, 10.0, 3, 0.0),
        (boxed, quarter(Vector3::x()), 14.0, 2, 0.0),
        (boxed, quarter(-Vector3::y()), 12.0, 1, 0.0),
        (
            boxed,
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI / 4.0),
            24.0 / 2.0f64.sqrt() - 3.0 * (2.0f64.sqrt() - 1.0),
            7,
            -2.0 * 2.0f64.sqrt(),
        ),
        (capsule, quarter(Vector3::y()), 8.0, 1, 0.0),
        (capsule, none, 28.0, 2, 0.0),
        (capsule, quarter(Vector3::x()) * quarter(Vector3::x()), 28.0, 3, 0.0),
        (cylinder, quarter(Vector3::x()), 9.0, 1, 0.0),
        (cylinder, none, 15.0, 2, 0.0),
        (Shape::ellipsoid([12.0, 10.0, 6.0]).unwrap(), none, 6.0, 1, 0.0),
    ] {
        let mut contact = FrameContact::<PadState<P>>::new(&pad, shape).unwrap();
        let mut felt = FrameResponse::default();
        for k in 0..60 {
            let depth = -0.2 + 0.02 * f64::from(k);
            let place = neutral * Vector3::new(0.0, y, depth - under_mm);
            felt = contact.step(&pad, &Isometry3::from_parts(Translation3::from(place), neutral * turn), 1e-3);
        }
        let force = neutral.inverse() * Vector3::from(felt.on_finger.force_n.map(f64::from));
        assert_eq!(felt.face, face, "{shape:?} {felt:?}");
        assert!(
            (f64::from(felt.depth_mm) - 0.98).abs() < 0.05 && force.z > 0.03 && force.y.abs() < 0.3 * force.z,
            "{shape:?} {felt:?}"
        );
    }
}

#[test]
fn sizes_are_checked() {
    for shape in [
        Shape::sphere(f64::NAN),
        Shape::sphere(0.0),
        Shape::capsule(5.0, -1.0),
        Shape::cylinder(f64::INFINITY, 1.0),
        Shape::edge(1.0, 180.0),
        Shape::cuboid([1.0, 2.0, 0.0], 1.0),
        Shape::ellipsoid([1.0, 2e7, 1.0]),
    ] {
        assert!(matches!(shape, Err(Error::Range { .. })), "{shape:?}");
    }
    let file = shipped_pad();
    assert!(matches!(
        FrameContact::<PadState<8>>::new(&file.file().pad, Shape::<f64>::plane()),
        Err(Error::Shape { .. })
    ));
    fn takes<S, F: Finger<S>>(_: &F) {}
    takes::<PadState<P>, _>(&file.file().pad);
}
