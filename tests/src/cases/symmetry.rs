//! The half of a symmetric finger gives the results of the whole, to the tolerance of equilibrium.

use std::ops::ControlFlow;

use crate::problems::fingers::{finger, path, placed, problem};
use fingerpad_fe::load_path::{BoneKind, Drive, Finger, Path, Problem, Response, Snapshot, Trajectory, follow_path};
use fingerpad_fe::mesh::MeshPreset;

const D: Drive = Drive::Displacement;
const F: Drive = Drive::Force;
/// Residual over contact force, less than by default.
const TOLERANCE: f64 = 1e-6;

fn run(problem: &Problem, path: &Path, snapshots: &[usize]) -> Trajectory {
    follow_path(problem, path, snapshots, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"))
}

/// Both runs along `path` with fields at all rows but the start: by the whole, by the half.
fn both(finger: &Finger, path: &Path) -> [Trajectory; 2] {
    let rows: Vec<usize> = (1..path.waypoints.len()).collect();
    let mut whole = problem(&finger.body, &finger.mesh.pad_faces);
    whole.settings.tolerance = TOLERANCE;
    // The shear after a press has an error of first order in its increments, whose number may differ by one.
    whole.load_steps.friction_while_pressing = false;
    let half = Problem { half: Some(finger.half.as_ref().expect("a parametric finger is symmetric")), ..whole.clone() };
    [whole, half].map(|problem| run(&problem, path, &rows))
}

/// Largest difference of the fields, over their largest values.
fn field_difference(a: &Snapshot, b: &Snapshot) -> [f64; 3] {
    let over = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
        let (difference, largest) =
            pairs.fold((0.0f64, 0.0f64), |(d, l), (a, b)| (d.max((a - b).abs()), l.max(a.abs())));
        if largest > 0.0 { difference / largest } else { difference }
    };
    let displacements = a.displacement_mm.iter().zip(&b.displacement_mm);
    let faces = a.faces.iter().zip(&b.faces);
    let density = a.strain_energy_density_mpa.iter().zip(&b.strain_energy_density_mpa);
    assert!(a.displacement_mm.len() == b.displacement_mm.len() && a.faces.len() == b.faces.len());
    assert_eq!(a.strain_energy_density_mpa.len(), b.strain_energy_density_mpa.len());
    [
        over(&mut displacements.flat_map(|(u, v)| (0..3).map(move |k| (u[k], v[k])))),
        over(&mut faces.flat_map(|(f, g)| (0..2).map(move |k| (f.traction_mpa[k], g.traction_mpa[k])))),
        over(&mut density.map(|(&p, &q)| (p, q))),
    ]
}

pub fn the_half_finger_gives_what_the_whole_does() {
    let slides =
        placed(&[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 0.5, 0.0], [0.8, -0.3, 0.0], [0.5, -0.3, 0.0], [0.9, 0.0, 0.0]]);
    let forces = path([F, D, D], &[[0.0; 3], [0.2, 0.0, 0.0], [0.2, 0.6, 0.0]]);
    for (shape, bone, path) in
        [("e", BoneKind::Floating, &slides), ("a", BoneKind::Fixed, &slides), ("b", BoneKind::Floating, &forces)]
    {
        let finger = finger(shape, MeshPreset::Coarse, bone, 1.0).unwrap();
        let [whole, half] = both(&finger, path);
        let what = format!("{shape} {bone:?}");
        // Steps may differ by one where an increment takes an iteration more; rows at the same time are compared.
        let same_time = |a: &&Response| half.responses.iter().find(|b| b.t_s == a.t_s).map(|b| (**a, *b));
        let pairs: Vec<(Response, Response)> = whole.responses.iter().filter_map(|a| same_time(&a)).collect();
        assert!(pairs.len() >= path.waypoints.len(), "{what}");
        let largest = whole.responses.iter().map(|r| r.normal_force_n).fold(0.0, f64::max);
        let mut worst = 0.0f64;
        for (a, b) in &pairs {
            let t_s = a.t_s;
            let close = |of: &str, a: f64, b: f64, tolerance: f64| {
                assert!((a - b).abs() < tolerance, "{what}, {of}: {a} {b} at {t_s:.3} s");
            };
            worst = worst.max((a.normal_force_n - b.normal_force_n).abs() / largest);
            worst = worst.max((a.friction_x_n - b.friction_x_n).abs() / largest);
            close("time", a.t_s, b.t_s, 1e-12);
            close("N", a.normal_force_n, b.normal_force_n, 5e-4 * largest);
            // The shear of a press is of first order in its increments, of which one may have one more.
            close("F", a.friction_x_n, b.friction_x_n, 1e-3 * largest);
            close("Fy", a.friction_y_n, 0.0, 1e-4 * largest);
            close("area", a.contact_area_mm2, b.contact_area_mm2, 0.1);
            close("stick ratio", a.stick_ratio, b.stick_ratio, 0.02);
            assert_eq!(b.friction_y_n, 0.0);
            if a.normal_force_n > 0.0 {
                close("centre x", a.centre_of_pressure_mm[0], b.centre_of_pressure_mm[0], 5e-3);
                assert_eq!(b.centre_of_pressure_mm[1], 0.0);
            }
        }
        for (a, b) in [(whole.work.plane_mj, half.work.plane_mj), (whole.work.friction_mj, half.work.friction_mj)] {
            // The trapezoidal rule of the work is of the increments: a first step to a driven force is a long one.
            let bound = if path.drives[0] == F { 0.1 } else { 1e-3 };
            assert!((a - b).abs() < bound * whole.work.plane_mj, "{what}: {a} {b}");
        }
        for (a, b) in whole.snapshots.iter().zip(&half.snapshots) {
            let difference = field_difference(a, b);
            assert!(difference.iter().zip([1e-2, 0.1, 1e-2]).all(|(&d, bound)| d < bound), "{what}: {difference:?}");
        }
        println!(
            "{what}: forces within {worst:.1e}; CPU {:.2} s whole, {:.2} s half",
            whole.cost.cpu_s, half.cost.cpu_s
        );
    }
}

/// Rows so near to each other that each is one increment, of the whole as of the half: the difference is the tolerance
/// of equilibrium.
pub fn in_the_same_increments_the_half_finger_gives_the_same_to_the_tolerance() {
    /// Distance of the rows, mm.
    const ROW_MM: f64 = 0.04;
    let legs: [[f64; 2]; 6] = [[0.0, 0.0], [0.6, 0.0], [0.6, 0.4], [0.6, 0.2], [0.4, 0.2], [0.5, 0.4]];
    let mut corners = vec![[0.0; 3]];
    for leg in legs.windows(2) {
        let ([z0, x0], [z1, x1]) = (leg[0], leg[1]);
        let count = ((z1 - z0).abs().max((x1 - x0).abs()) / ROW_MM).ceil();
        corners.extend((1..=count as usize).map(|k| {
            let share = k as f64 / count;
            [z0 + share * (z1 - z0), x0 + share * (x1 - x0), 0.0]
        }));
    }
    let path = placed(&corners);
    for (shape, bone) in [("e", BoneKind::Floating), ("e", BoneKind::Fixed), ("b", BoneKind::Floating)] {
        let finger = finger(shape, MeshPreset::Coarse, bone, 1.0).unwrap();
        let mut whole = problem(&finger.body, &finger.mesh.pad_faces);
        whole.settings.tolerance = TOLERANCE;
        let steps = &mut whole.load_steps;
        // A row shorter than the shortest first step is one increment.
        for largest in
            [&mut steps.max_depth_step_mm, &mut steps.max_depth_step_with_friction_mm, &mut steps.max_slide_step_mm]
        {
            *largest = 20.0 * ROW_MM;
        }
        let half = Problem { half: finger.half.as_ref(), ..whole.clone() };
        let [whole, half] = [&whole, &half].map(|problem| run(problem, &path, &[]));
        for of in [&whole, &half] {
            assert_eq!(of.cost.increments as usize, corners.len() - 1, "{shape}");
        }
        let largest = |of: &dyn Fn(&Response) -> f64| whole.responses.iter().map(of).fold(0.0, f64::max);
        let apart = |of: &dyn Fn(&Response) -> f64| {
            whole.responses.iter().zip(&half.responses).map(|(a, b)| (of(a) - of(b)).abs()).fold(0.0, f64::max)
        };
        for (what, of, bound) in [
            ("N", (&|r: &Response| r.normal_force_n) as &dyn Fn(&Response) -> f64, 5e-6),
            ("F", &|r: &Response| r.friction_x_n, 5e-6),
            ("area", &|r: &Response| r.contact_area_mm2, 5e-6),
            ("stick ratio", &|r: &Response| r.stick_ratio, 1e-5),
        ] {
            let share = apart(of) / largest(of);
            println!("{shape}, {what}: {share:.1e} of the largest");
            assert!(share < bound, "{shape}, {what}: {share:.1e} of the largest");
        }
        for (a, b) in [(whole.work.plane_mj, half.work.plane_mj), (whole.work.friction_mj, half.work.friction_mj)] {
            assert!((a - b).abs() < 1e-5 * whole.work.plane_mj, "{shape}: work {a} {b}");
        }
    }
}

pub fn a_path_along_y_is_followed_with_the_whole() {
    let finger = finger("e", MeshPreset::Coarse, BoneKind::Floating, 1.0).unwrap();
    let whole = problem(&finger.body, &finger.mesh.pad_faces);
    let half = Problem { half: finger.half.as_ref(), ..whole.clone() };
    for path in [
        placed(&[[0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.1, 0.1]]),
        path([D, D, F], &[[0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.1, 0.01]]),
    ] {
        let [a, b] = [&whole, &half].map(|problem| run(problem, &path, &[]));
        assert!(a.responses[1..] == b.responses[1..] && b.responses.last().unwrap().friction_y_n > 1e-3);
    }
}
