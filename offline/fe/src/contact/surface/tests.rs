//! A patch of 4 x 4 faces on planes and curved bodies in all poses: its forces, their derivatives and their energies.

use super::*;
use crate::contact::{Coordinates, Friction, Parts, RubberFriction};

const PENALTY: PenaltySettings =
    PenaltySettings { penalty_mpa_per_mm: 2.0, augment: false, penetration_tolerance_mm: 1.0, edge_constant: 1.5 };

/// A square of 4 x 4 mm around the origin that faces downwards.
fn patch() -> Surface {
    let node = |i: u32, j: u32| 5 * i + j;
    let faces = (0..16).map(|k| (k / 4, k % 4));
    let quads: Vec<[u32; 4]> =
        faces.map(|(i, j)| [node(i, j), node(i, j + 1), node(i + 1, j + 1), node(i + 1, j)]).collect();
    let undeformed: Vec<Vector3<f64>> =
        (0..25).map(|n| Vector3::new(f64::from(n / 5) - 2.0, f64::from(n % 5) - 2.0, 0.0)).collect();
    let pad =
        Pad { quads: &quads, triangles: &[], undeformed: &undeformed, modulus_mpa: &[0.1; 25], can_carry: &|_| true };
    Surface::new(&pad, &PENALTY)
}

/// The patch at `height` over a plane, each node displaced by `noise`; finger's frame.
fn over(surface: &Surface, plane: &Plane, height: f64, noise: impl Fn(usize, usize) -> f64) -> Vec<Vector3<f64>> {
    let frame = surface.frame(plane);
    (0..25)
        .map(|n| {
            let flat = Vector3::new((n / 5) as f64 - 2.0, (n % 5) as f64 - 2.0, height);
            frame.from_plane(&(flat + Vector3::from_fn(|k, _| noise(n, k))))
        })
        .collect()
}

/// Even in (-1, 1), without a pattern.
fn scatter(n: usize, k: usize) -> f64 {
    ((n * 3 + k) as f64 * 78.233 + 1.0).sin() * 43_758.545 % 1.0
}

fn rubber() -> Friction {
    Friction::On(RubberFriction { lambda: 0.3, tau0_mpa: 0.002, gamma_crit_mm: 0.05, ..RubberFriction::default() })
}

fn orthotropic(across_over_along: f64, skin_axis_deg: f64) -> RubberFriction {
    let base = RubberFriction { lambda: 0.3, tau0_mpa: 0.002, gamma_crit_mm: 0.05, ..RubberFriction::default() };
    RubberFriction { across_over_along, skin_axis_deg, ..base }
}

const POSES: [Coordinates; 3] = [[0.0; 6], [0.2, -0.1, 0.3, 0.0, 0.0, 0.0], [0.2, -0.1, 0.3, 0.7, 0.3, -0.2]];

#[test]
fn a_flat_patch_carries_pressure_times_area_and_friction_at_its_strength() {
    let surface = patch();
    let law = rubber();
    for at in POSES {
        let plane = Plane::new(at);
        let pressed = over(&surface, &plane, -0.01, |_, _| 0.0);
        let start = surface.initial_state(&pressed, plane);
        let areas = surface.areas(&start, &pressed, &plane);
        let (held, totals) = surface.commit(&law, &start, &areas, &pressed, plane);
        assert!((totals.force - Vector3::new(0.0, 0.0, 0.32)).norm() < 1e-12, "{totals:?}");
        assert!((totals.area - 16.0).abs() < 1e-12 && (totals.stuck_area - 16.0).abs() < 1e-12, "{totals:?}");
        // The middle of the patch is at the plane's material origin, so that the normal force has no moment.
        let frame = surface.frame(&plane);
        let middle = frame.along_axes(&(frame.from_plane(&Vector3::zeros()) - frame.foot()));
        let moment = middle.cross(&totals.force);
        assert!((totals.moment - moment).norm() < 1e-12, "{totals:?} {moment}");

        // The plane slides from under it, by less than gamma_crit and by far more.
        let [tx, ty] = [0.6, -0.8];
        let strength = law.strength(0.02).0;
        let slid = |way: f64| {
            let mut to = at;
            to[0] += tx * way;
            to[1] += ty * way;
            let to = plane.moved_to(to);
            surface.commit(&law, &held, &areas, &pressed, to).1
        };
        let [a, b] = [slid(0.02), slid(3.0)];
        let force = |share: f64| Vector3::new(tx, ty, 0.0) * (16.0 * share * strength) + Vector3::z() * 0.32;
        assert!((a.force - force(0.4)).norm() < 1e-12 && a.stuck_area == a.area, "{a:?}");
        assert!((b.force - force(1.0)).norm() < 1e-12 && b.stuck_area == 0.0, "{b:?}");
        assert!((a.elastic_energy - 0.5 * 16.0 * 0.4 * strength * 0.02).abs() < 1e-12, "{a:?}");
        // The force rises linearly to its strength over gamma_crit and is constant from there: trapezoidal over the
        // increment.
        assert!((b.dissipation - 0.5 * 16.0 * strength * (3.0 - 0.05)).abs() < 1e-12, "{b:?}");
    }
}

/// After a turn of the slide, friction points along the new slide within several gamma_crit, for any earlier direction;
/// after a reversal it first passes through zero.
#[test]
fn friction_forgets_the_slide_of_before() {
    let surface = patch();
    let law = rubber();
    for at in POSES {
        let pressed = over(&surface, &Plane::new(at), -0.01, |_, _| 0.0);
        let start = surface.initial_state(&pressed, Plane::new(at));
        let areas = surface.areas(&start, &pressed, &Plane::new(at));
        let strength = 16.0 * law.strength(0.02).0;
        let (mut state, mut to) = (surface.commit(&law, &start, &areas, &pressed, Plane::new(at)).0, at);
        let mut slide = |x: f64, y: f64, steps: usize| {
            let mut force = [0.0; 2];
            for _ in 0..steps {
                to[0] += x;
                to[1] += y;
                let (next, totals) = surface.commit(&law, &state, &areas, &pressed, state.plane.moved_to(to));
                state = next;
                force = [totals.force.x / strength, totals.force.y / strength];
            }
            force
        };
        let along = slide(0.02, 0.0, 100);
        let across = slide(0.0, 0.02, 40);
        let back = slide(0.0, -0.02, 5);
        for ([x, y], wanted) in [(along, [1.0, 0.0]), (across, [0.0, 1.0]), (back, [0.0, -1.0])] {
            assert!((x - wanted[0]).hypot(y - wanted[1]) < 1e-4, "{x} {y}: {wanted:?}");
        }
    }
}

#[test]
fn a_plane_that_spins_turns_the_finger_along() {
    let surface = patch();
    let law = Friction::On(RubberFriction::coulomb(0.5, 1e-4));
    for (pose, sign) in [(POSES[0], 1.0), (POSES[0], -1.0), ([0.0, 0.0, 0.0, 0.4, 0.3, -0.2], 1.0)] {
        let plane = Plane::new(pose);
        let pressed = over(&surface, &plane, -0.01, |_, _| 0.0);
        let start = surface.initial_state(&pressed, plane);
        let areas = surface.areas(&start, &pressed, &plane);
        let (held, _) = surface.commit(&law, &start, &areas, &pressed, plane);
        let mut to = pose;
        to[3] += sign * 0.3;
        let (_, totals) = surface.commit(&law, &held, &areas, &pressed, plane.moved_to(to));
        // Sum of arm times mu N over the nodes; edges and corners of the patch carry a half and a quarter.
        let arm = |n: usize| ((n / 5) as f64 - 2.0).hypot((n % 5) as f64 - 2.0);
        let rim = |i: usize| if i.is_multiple_of(4) { 0.5 } else { 1.0 };
        let moment: f64 = (0..25).map(|n| 0.5 * 0.02 * rim(n / 5) * rim(n % 5) * arm(n)).sum();
        assert!((totals.moment.z - sign * moment).abs() < 1e-5 * moment, "{} {moment}", totals.moment.z);
        assert!(totals.force.xy().norm() < 1e-12);
    }
}

#[test]
fn the_work_of_the_tangential_forces_is_stored_dissipated_or_put_in_by_pressure() {
    [rubber(), Friction::On(orthotropic(1.8, 30.0))].iter().for_each(work_of_tangential_forces);
}

fn work_of_tangential_forces(law: &Friction) {
    let surface = patch();
    let plane = Plane::new(POSES[2]);
    let start = over(&surface, &plane, -0.004, |n, k| 0.008 * scatter(n, k));
    let mut state = surface.initial_state(&start, plane);
    let mut stored = 0.0;
    let (mut dissipated, mut left) = (0.0, 0);
    for step in 1..30 {
        let mut to = POSES[2];
        to[0] += 0.1 * (step as f64 * 0.5).sin();
        to[3] += 0.02 * step as f64;
        to[4] += 0.01 * (step as f64).cos();
        let plane = state.plane.moved_to(to);
        let place = over(&surface, &plane, -0.004, |n, k| 0.02 * scatter(n + 40 * step, k));
        let areas = surface.areas(&state, &place, &plane);
        let (next, totals) = surface.commit(law, &state, &areas, &place, plane);
        let mut work = 0.0;
        for n in 0..25 {
            let (a, b) = (&state.nodes[n], &next.nodes[n]);
            for k in 0..2 {
                let passed = state.position[n][k] - next.position[n][k];
                work += 0.5 * (a.tangential_force_n[k] + b.tangential_force_n[k]) * passed;
            }
            left += usize::from(a.normal_force_n > 0.0 && !(b.normal_force_n > 0.0));
        }
        let kept = totals.elastic_energy - stored;
        let balance = work + totals.elastic_energy_by_pressure - kept - totals.dissipation;
        // A node that comes into contact has no earlier elastic slip: its first displacement is elastic slip as a
        // whole.
        assert!(balance.abs() < 1e-12, "step {step}: {balance:e} of {work:e}");
        assert!(totals.min_dissipation_mj >= 0.0, "step {step}: {:e} mJ", totals.min_dissipation_mj);
        (stored, dissipated) = (totals.elastic_energy, dissipated + totals.dissipation);
        state = next;
    }
    assert!(left > 10 && dissipated > 1e-5, "{left} nodes left, {dissipated:e} mJ");
}

/// Bodies with a curvature that matters over the patch.
fn curved() -> Vec<RigidBody> {
    let waves = |i: i32, j: i32| 0.05 * (0.3 * f64::from(i)).sin() * (0.2 * f64::from(j)).cos();
    let heights = (0..41).flat_map(|j| (0..41).map(move |i| waves(i, j))).collect();
    vec![
        RigidBody::Sphere { radius_mm: 10000.0 },
        RigidBody::Sphere { radius_mm: 5.0 },
        RigidBody::Sphere { radius_mm: -12.0 },
        RigidBody::Cylinder { radius_mm: 4.0, axis_deg: 25.0 },
        RigidBody::Edge { radius_mm: 1.5, axis_deg: -40.0, angle_deg: 120.0 },
        RigidBody::Heights(crate::contact::HeightField::new([41; 2], [0.2; 2], [-4.0; 2], heights).unwrap()),
    ]
}

/// The patch on `body`, laid around it: each node at a gap of -4 to 4 micrometres.
fn around(surface: &Surface, plane: &Plane, noise: impl Fn(usize, usize) -> f64) -> Vec<Vector3<f64>> {
    let frame = surface.frame(plane);
    (0..25)
        .map(|n| {
            let flat = Vector3::new((n / 5) as f64 - 2.0 + noise(n, 0), (n % 5) as f64 - 2.0 + noise(n, 1), 0.0);
            frame.from_plane(&surface.body().spot(&flat).at_gap(noise(n, 2) - 0.002))
        })
        .collect()
}

/// On curved bodies too, in all six coordinates, with parts of the area that are held and with parts that follow the nodes.
#[test]
fn derivatives_on_curved_bodies_are_those_of_the_forces() {
    let stick = Friction::On(RubberFriction { gamma_crit_mm: 10.0, ..RubberFriction::default() });
    let slip = Friction::On(RubberFriction { gamma_crit_mm: 1e-4, ..RubberFriction::default() });
    for body in curved() {
        let orthotropic = Friction::On(orthotropic(0.6, 35.0));
        for (law, name) in [(stick, "stick"), (slip, "slip"), (rubber(), "both"), (orthotropic, "orthotropic")] {
            let areas = vec![0.9; 25];
            for (pose, parts) in
                POSES.into_iter().flat_map(|pose| [(pose, Parts::Held(&areas)), (pose, Parts::Followed)])
            {
                let mut surface = patch();
                let before = Plane::new(pose);
                surface.set_rigid_body(body.clone(), None, &before);
                let start = around(&surface, &before, |n, k| 0.004 * scatter(n, k));
                let state = surface.initial_state(&start, before);
                let (last, _) = surface.commit(&law, &state, &areas, &start, before);
                let way = [0.02, 0.01, 0.0, 0.03, 0.002, -0.003];
                let plane = before.moved_to(std::array::from_fn(|k| pose[k] + way[k]));
                let place = around(&surface, &plane, |n, k| 0.005 * scatter(n + 7, k));
                let forces = |place: &[Vector3<f64>], plane: &Plane, tangent: bool| {
                    surface.evaluate(&law, &last, parts, place, plane, Tangential::Law, tangent)
                };
                let exact = forces(&place, &plane, true);
                let touching = exact.residual.iter().filter(|force| force.norm() > 0.0).count();
                assert!(touching > 5, "{name}, {body:?}: {touching} nodes touch");
                let name = format!("{name}, {parts:?}");
                let foot = surface.frame(&plane).foot();
                const H: f64 = 1e-6;
                let compare = |what: &str, numeric: &dyn Fn(f64) -> Vec<Vector3<f64>>, exact: &[Vector3<f64>]| {
                    let (up, down) = (numeric(H), numeric(-H));
                    let scale = exact.iter().map(|e| e.norm()).fold(1e-3, f64::max);
                    for n in 0..25 {
                        let slope = (up[n] - down[n]) / (2.0 * H);
                        let off = (slope - exact[n]).norm() / scale;
                        assert!(off < 2e-4, "{name}, {body:?}, {pose:?}, {what}, node {n}: {off:e}");
                    }
                };
                for k in 0..6 {
                    let numeric = |h: f64| {
                        let mut at = plane.at;
                        at[k] += h;
                        forces(&place, &plane.moved_to(at), false).residual
                    };
                    let column = surface.change_with_plane(&exact, &place, &foot, &plane.twist(k, &surface.reach));
                    compare(&format!("coordinate {k}"), &numeric, &column);
                }
                for k in 0..3 {
                    let numeric = |h: f64| {
                        let moved: Vec<Vector3<f64>> = place.iter().map(|x| x + Vector3::ith(k, h)).collect();
                        forces(&moved, &plane, false).residual
                    };
                    let mut column = vec![Vector3::zeros(); 25];
                    exact.tangents.iter().for_each(|t| column[t.node] += t.block.column(k));
                    compare(&format!("nodes along {k}"), &numeric, &column);
                }
                for by in 0..25 {
                    let way = Vector3::from_fn(|k, _| scatter(by + 100, k));
                    let numeric = |h: f64| {
                        let mut moved = place.clone();
                        moved[by] += way * h;
                        forces(&moved, &plane, false).residual
                    };
                    let mut column = vec![Vector3::zeros(); 25];
                    exact.tangents.iter().filter(|t| t.by == by).for_each(|t| column[t.node] += t.block * way);
                    compare(&format!("node {by}"), &numeric, &column);
                }
            }
        }
    }
}

#[test]
fn derivatives_over_nodes_and_plane_are_those_of_the_forces() {
    let surface = patch();
    let stick = Friction::On(RubberFriction { gamma_crit_mm: 10.0, ..RubberFriction::default() });
    let slip = Friction::On(RubberFriction { gamma_crit_mm: 1e-4, ..RubberFriction::default() });
    let orthotropic = Friction::On(orthotropic(1.7, -50.0));
    let laws = [(stick, "stick"), (slip, "slip"), (rubber(), "both"), (orthotropic, "orthotropic")];
    for (law, name) in laws.into_iter().chain([(Friction::Off, "no friction")]) {
        let held = vec![0.9; 25];
        for (pose, parts) in POSES.into_iter().flat_map(|pose| [(pose, Parts::Held(&held)), (pose, Parts::Followed)]) {
            let name = format!("{name}, {parts:?}");
            let before = Plane::new(pose);
            let start = over(&surface, &before, -0.004, |n, k| 0.008 * scatter(n, k));
            let areas = vec![0.9; 25];
            let (last, _) = surface.commit(&law, &surface.initial_state(&start, before), &areas, &start, before);
            let plane = before.moved_to(std::array::from_fn(|k| pose[k] + [0.05, 0.02, 0.0, 0.03, 0.01, -0.02][k]));
            let place = over(&surface, &plane, -0.004, |n, k| 0.009 * scatter(n, k));
            let forces = |place: &[Vector3<f64>], plane: &Plane, tangent: bool| {
                surface.evaluate(&law, &last, parts, place, plane, Tangential::Law, tangent)
            };
            let exact = forces(&place, &plane, true);
            let touching = exact.residual.iter().filter(|force| force.norm() > 0.0).count();
            assert!(touching > 5 && touching < 25, "{name}: {touching} nodes touch");
            let foot = surface.frame(&plane).foot();
            const H: f64 = 1e-7;
            let compare = |what: &str, numeric: &dyn Fn(f64) -> Vec<Vector3<f64>>, exact: &[Vector3<f64>]| {
                let (up, down) = (numeric(H), numeric(-H));
                let scale = exact.iter().map(|e| e.norm()).fold(1e-3, f64::max);
                for n in 0..25 {
                    let slope = (up[n] - down[n]) / (2.0 * H);
                    assert!((slope - exact[n]).norm() < 1e-5 * scale, "{name}, {what}: {slope} {}", exact[n]);
                }
            };
            for k in 0..6 {
                let numeric = |h: f64| {
                    let mut at = plane.at;
                    at[k] += h;
                    forces(&place, &plane.moved_to(at), false).residual
                };
                let column = surface.change_with_plane(&exact, &place, &foot, &plane.twist(k, &surface.reach));
                compare(&format!("coordinate {k}"), &numeric, &column);
            }
            for k in 0..3 {
                let numeric = |h: f64| {
                    let moved: Vec<Vector3<f64>> = place.iter().map(|x| x + Vector3::ith(k, h)).collect();
                    forces(&moved, &plane, false).residual
                };
                let mut column = vec![Vector3::zeros(); 25];
                exact.tangents.iter().for_each(|t| column[t.node] += t.block.column(k));
                compare(&format!("nodes along {k}"), &numeric, &column);
            }
            for by in 0..25 {
                let way = Vector3::from_fn(|k, _| scatter(by + 100, k));
                let numeric = |h: f64| {
                    let mut moved = place.clone();
                    moved[by] += way * h;
                    forces(&moved, &plane, false).residual
                };
                let mut column = vec![Vector3::zeros(); 25];
                exact.tangents.iter().filter(|t| t.by == by).for_each(|t| column[t.node] += t.block * way);
                compare(&format!("node {by}"), &numeric, &column);
            }
        }
    }
}

/// The block on a plane: while it slides along `v`, the traction is `D² v / |D v|` times the strength, D = diag(1, r) along and
/// across the axis. It is on the ellipse, and its slip is normal to it. The axis turns with the skin.
#[test]
fn an_orthotropic_block_slides_at_the_ellipse_along_its_normal() {
    let surface = patch();
    for ((ratio, axis_deg), at) in
        [(0.5, 0.0), (0.7, 30.0), (1.8, -65.0)].into_iter().flat_map(|o| POSES.map(|at| (o, at)))
    {
        let constants = orthotropic(ratio, axis_deg);
        let law = Friction::On(constants);
        let plane = Plane::new(at);
        let pressed = over(&surface, &plane, -0.01, |_, _| 0.0);
        let start = surface.initial_state(&pressed, plane);
        let areas = surface.areas(&start, &pressed, &plane);
        let (held, _) = surface.commit(&law, &start, &areas, &pressed, plane);
        let strength = 16.0 * law.strength(0.02).0;
        // The patch lies on the plane turned by its spin.
        let turned = axis_deg.to_radians() + at[3];
        for direction in (0..24).map(|k| f64::from(k) * 15f64.to_radians() + 0.01) {
            let v = [direction.cos(), direction.sin()];
            let (along, across) = ((direction - turned).cos(), (direction - turned).sin());
            let slide = |way: f64| {
                let mut to = at;
                (to[0], to[1]) = (to[0] + way * v[0], to[1] + way * v[1]);
                surface.commit(&law, &held, &areas, &pressed, plane.moved_to(to)).1
            };
            let scaled = along.hypot(ratio * across);
            let axes = |force: Vector3<f64>| {
                let (sin, cos) = turned.sin_cos();
                [force.x * cos + force.y * sin, force.y * cos - force.x * sin].map(|f| f / strength)
            };
            // Within the elastic slip the work is stored, and after it all further work is dissipated.
            let limit = constants.gamma_crit_mm / scaled;
            let (stick, slip) = (slide(0.9 * limit), slide(limit + 2.0));
            assert!(stick.stuck_area == stick.area && slip.stuck_area == 0.0, "{stick:?} {slip:?}");
            let wanted = [along / scaled, ratio * ratio * across / scaled];
            for (share, found) in [(0.9, axes(stick.force)), (1.0, axes(slip.force))] {
                assert!(
                    (0..2).all(|k| (found[k] - share * wanted[k]).abs() < 1e-9),
                    "{ratio} {direction}: {found:?} {wanted:?}"
                );
            }
            assert!((wanted[0].hypot(wanted[1] / ratio) - 1.0).abs() < 1e-12);
            let work = 0.5 * strength * scaled * 2.0;
            assert!((slip.dissipation - work).abs() < 1e-9 * work, "{} {work}", slip.dissipation);
            assert!((stick.elastic_energy - 0.5 * 0.81 * strength * constants.gamma_crit_mm).abs() < 1e-12);
            // The axis is the skin's: a plane that spins under it takes no part of it along.
            let (mut state, mut to, mut last) = (held.clone(), at, slip);
            for [way, spin] in [[0.0, 0.8], [20.0, 0.0], [20.0, 0.0], [20.0, 0.0]] {
                to = [to[0] + way * v[0], to[1] + way * v[1], to[2], to[3] + spin, to[4], to[5]];
                (state, last) = surface.commit(&law, &state, &areas, &pressed, state.plane.moved_to(to));
            }
            assert!((0..2).all(|k| (axes(last.force)[k] - wanted[k]).abs() < 1e-5), "{ratio} {direction}: {last:?}");
        }
    }
}

/// On random and closed paths, with the skin moving at random too, no node's friction yields work, none is outside its ellipse, and
/// turning body, skin and motion together only turns the forces.
#[test]
fn orthotropic_friction_dissipates_on_every_path_and_turns_with_the_finger() {
    let surface = patch();
    let law = Friction::On(orthotropic(0.4, 20.0));
    let turn = 0.9;
    let run = |spin: f64| {
        let at = |x: f64, y: f64, more: f64| {
            [x * spin.cos() - y * spin.sin(), x * spin.sin() + y * spin.cos(), 0.3, spin + more, 0.0, 0.0]
        };
        let mut plane = Plane::new(at(0.0, 0.0, 0.0));
        let height = |n: usize, k: usize| 0.004 * scatter(n, k);
        let turned = |noise: &dyn Fn(usize, usize) -> f64| over(&surface, &Plane::new(at(0.0, 0.0, 0.0)), -0.02, noise);
        let mut state = surface.initial_state(&turned(&height), plane);
        let mut forces = Vec::new();
        for step in 0..60 {
            let [x, y, more] = if step % 20 == 19 { [0.0; 3] } else { [0, 1, 2].map(|k| 0.1 * scatter(step + 50, k)) };
            plane = plane.moved_to(at(x, y, more));
            let place = turned(&|n, k| height(n, k) + if k < 2 { 0.02 * scatter(n + step, k) } else { 0.0 });
            let areas = vec![0.9; 25];
            let (next, totals) = surface.commit(&law, &state, &areas, &place, plane);
            assert!(totals.min_dissipation_mj >= -1e-15, "step {step}: {} mJ", totals.min_dissipation_mj);
            for node in next.nodes.iter().filter(|node| node.normal_force_n > 0.0) {
                let used = node.tangential_force_n.norm() / (law.strength(node.pressure_mpa()).0 * node.area);
                assert!(used < 1.0 + 1e-12 && (node.stuck || used > 0.4 - 1e-6), "step {step}: {used}");
            }
            state = next;
            let f = totals.force;
            forces.push([
                f.x * spin.cos() + f.y * spin.sin(),
                f.y * spin.cos() - f.x * spin.sin(),
                f.z,
                totals.dissipation,
            ]);
        }
        forces
    };
    for (still, turned) in run(0.0).iter().zip(run(turn)) {
        assert!(still.iter().zip(turned).all(|(a, b)| (a - b).abs() < 1e-9), "{still:?} {turned:?}");
    }
}
