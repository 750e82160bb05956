//! The half of a symmetric finger gives what the whole does, to the tolerance of equilibrium.

use std::ops::ControlFlow;

use fingerpad_fe::load_path::{BoneKind, Drive, Finger, Path, Problem, Snapshot, Trajectory, follow_path};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::problems::fingers::{finger, path, placed, problem};
use fingerpad_tests::verify;

const D: Drive = Drive::Displacement;
const F: Drive = Drive::Force;
/// Residual over contact force, less than by default.
const TOLERANCE: f64 = 1e-6;

fn run(problem: &Problem, path: &Path, snapshots: &[usize]) -> Trajectory {
    follow_path(problem, path, snapshots, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"))
}

/// Both runs along `path` with fields at these rows: by the whole, by the half.
fn both(finger: &Finger, path: &Path, rows: &[usize]) -> [Trajectory; 2] {
    let mut whole = problem(&finger.body, &finger.mesh.pad_faces);
    whole.settings.tolerance = TOLERANCE;
    let half = Problem { half: Some(finger.half.as_ref().expect("a parametric finger is symmetric")), ..whole.clone() };
    [whole, half].map(|problem| run(&problem, path, rows))
}

/// A path through corners in rows so small that whole and half take the same increments, and the rows of the corners.
///
/// * `steps`: travel or force of a row
fn in_increments(drives: [Drive; 3], corners: &[[f64; 3]], steps: [f64; 3]) -> (Path, Vec<usize>) {
    let (mut points, mut rows) = (vec![corners[0]], vec![]);
    for pair in corners.windows(2) {
        let count = (0..3).map(|k| ((pair[1][k] - pair[0][k]).abs() / steps[k]).ceil()).fold(1.0, f64::max);
        let mix = |share: f64| [0, 1, 2].map(|k| pair[0][k] + share * (pair[1][k] - pair[0][k]));
        points.extend((1..=count as usize).map(|i| mix(i as f64 / count)));
        rows.push(points.len() - 1);
    }
    (path(drives, &points), rows)
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

#[test]
fn the_half_finger_gives_what_the_whole_does() {
    let slides = [[0.0; 3], [0.8, 0.0, 0.0], [0.8, 0.5, 0.0], [0.8, -0.3, 0.0], [0.5, -0.3, 0.0], [0.9, 0.0, 0.0]];
    let slides = in_increments([D; 3], &slides, [0.04, 0.1, 1.0]);
    let forces = in_increments([F, D, D], &[[0.0; 3], [0.2, 0.0, 0.0], [0.2, 0.6, 0.0]], [0.02, 0.1, 1.0]);
    for (shape, bone, (path, rows)) in
        [("e", BoneKind::Floating, &slides), ("a", BoneKind::Fixed, &slides), ("b", BoneKind::Floating, &forces)]
    {
        let finger = finger(shape, MeshPreset::Coarse, bone, 1.0).unwrap();
        let [whole, half] = both(&finger, path, rows);
        let what = format!("{shape} {bone:?}");
        assert_eq!(whole.responses.len(), half.responses.len(), "{what}");
        let largest = whole.responses.iter().map(|r| r.normal_force_n).fold(0.0, f64::max);
        let mut worst = [0.0f64; 5];
        for (a, b) in whole.responses.iter().zip(&half.responses) {
            let centre =
                if a.normal_force_n > 0.0 { a.centre_of_pressure_mm[0] - b.centre_of_pressure_mm[0] } else { 0.0 };
            let differences = [
                (a.normal_force_n - b.normal_force_n) / largest,
                (a.friction_x_n - b.friction_x_n) / largest,
                a.contact_area_mm2 - b.contact_area_mm2,
                a.stick_ratio - b.stick_ratio,
                centre,
            ];
            for (worst, difference) in worst.iter_mut().zip(differences) {
                *worst = worst.max(difference.abs());
            }
            assert_eq!((a.t_s, b.friction_y_n), (b.t_s, 0.0));
            assert!(a.friction_y_n.abs() < 1e-4 * largest, "{what}: {}", a.friction_y_n);
            assert!(b.normal_force_n == 0.0 || b.centre_of_pressure_mm[1] == 0.0);
        }
        let names =
            ["N over the largest", "F over the largest N", "area, mm²", "stick ratio", "centre of pressure, mm"];
        for ((name, worst), bound) in names.into_iter().zip(worst).zip([1e-4, 1e-4, 0.02, 1e-3, 5e-3]) {
            verify(&format!("half against whole, {what}"), name, worst, bound);
        }
        for (a, b) in [(whole.work.plane_mj, half.work.plane_mj), (whole.work.friction_mj, half.work.friction_mj)] {
            assert!((a - b).abs() < 1e-3 * a.abs(), "{what}: {a} {b}");
        }
        for (a, b) in whole.snapshots.iter().zip(&half.snapshots) {
            let difference = field_difference(a, b);
            assert!(difference.iter().all(|&d| d < 2e-3), "{what}: {difference:?}");
        }
        println!("{what}: CPU {:.2} s whole, {:.2} s half", whole.cost.cpu_s, half.cost.cpu_s);
    }
}

#[test]
fn a_path_along_y_is_followed_with_the_whole() {
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
