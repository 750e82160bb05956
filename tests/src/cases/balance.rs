//! Balance of a pressed and slid finger: load of the joint, centre of pressure.

use crate::{
    problems::fingers::{placed, problem},
    verify,
};
use fingerpad_fe::assembly::{Configuration, Joint};
use fingerpad_fe::load_path::{Finger, Snapshot, Tissue};
use fingerpad_fe::mesh::{FingertipShape, Mesh, MeshPreset, fingertip, set};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

const JOINT: Joint = Joint { translation_n_per_mm: 0.7, rotation_nmm_per_rad: 30.0 };

/// The coarse finger E with this joint, pressed and slid askew, and the field there.
fn pressed() -> (Finger, Snapshot) {
    let tip = fingertip(&FingertipShape::named("e").unwrap(), &MeshPreset::Coarse.divisions()).unwrap();
    let mut tissue = Tissue::default();
    tissue.bone.joint = JOINT;
    let finger = Finger::new(tip, &tissue).unwrap();
    let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
    problem.settings.tolerance = 1e-7;
    let path = placed(&[[0.0; 3], [0.9, 0.0, 0.0], [0.9, 0.6, 0.5]]);
    let last = path.waypoints.len() - 1;
    let mut run =
        fingerpad_fe::load_path::follow_path(&problem, &path, &[last], &mut |_| std::ops::ControlFlow::Continue(()))
            .unwrap();
    let snapshot = run.snapshots.pop().unwrap();
    (finger, snapshot)
}

fn middle(x: &[Vector3<f64>], nodes: &[u32]) -> Vector3<f64> {
    nodes.iter().map(|&n| x[n as usize]).sum::<Vector3<f64>>() / nodes.len() as f64
}

/// Rotation that maps the earlier places of the nodes to the present ones, by least squares [Kabsch 1976].
fn rotation(mesh: &Mesh, x: &[Vector3<f64>], nodes: &[u32]) -> Rotation3<f64> {
    let (before, after) = (middle(&mesh.nodes, nodes), middle(x, nodes));
    let sum: Matrix3<f64> =
        nodes.iter().map(|&n| (x[n as usize] - after) * (mesh.nodes[n as usize] - before).transpose()).sum();
    let svd = sum.svd(true, true);
    let (u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
    let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Rotation3::from_matrix_unchecked(u * sign * v_t)
}

pub fn the_joint_carries_the_load_of_the_tissue_on_the_bone() {
    let (finger, snapshot) = pressed();
    let mesh = &finger.mesh;
    let x: Vec<Vector3<f64>> = mesh.nodes.iter().zip(&snapshot.displacement_mm).map(|(p, u)| p + u).collect();
    let forces = finger.body.nodal_forces(&Configuration { x: x.clone(), ..finger.body.undeformed().clone() });
    // The nodes inside the bone, which no element of tissue has, are not moved along.
    let bone = mesh.node_set(set::DISTAL_BONE).iter().copied().filter(|&n| forces[n as usize] != Vector3::zeros());
    let bone = &bone.collect::<Vec<u32>>();
    let turn = rotation(mesh, &x, bone);
    let joint = finger.body.undeformed().rigid_centre;
    let moved = middle(&x, bone) + turn * (joint - middle(&mesh.nodes, bone));
    // The bone carries the forces of the tissue and those of the joint's springs.
    let force: Vector3<f64> = bone.iter().map(|&n| forces[n as usize]).sum();
    let moment: Vector3<f64> = bone.iter().map(|&n| (x[n as usize] - moved).cross(&forces[n as usize])).sum();
    let exact_force = (joint - moved) * 0.7;
    let exact_moment = UnitQuaternion::from_rotation_matrix(&turn).scaled_axis() * -30.0;
    println!("joint: {exact_force:?} N, {exact_moment:?} N mm");
    assert!(exact_force.norm() > 0.005 && exact_moment.norm() > 0.02);
    verify("joint", "error of the force", (force - exact_force).norm() / exact_force.norm(), 1e-4);
    verify("joint", "error of the moment", (moment - exact_moment).norm() / exact_moment.norm(), 1e-4);
}

pub fn contact_force_and_centre_of_pressure_are_those_of_the_tissue_on_the_plane() {
    let (finger, snapshot) = pressed();
    let mesh = &finger.mesh;
    let x: Vec<Vector3<f64>> = mesh.nodes.iter().zip(&snapshot.displacement_mm).map(|(p, u)| p + u).collect();
    let forces = finger.body.nodal_forces(&Configuration { x: x.clone(), ..finger.body.undeformed().clone() });
    let pad = mesh.node_set(set::PAD);
    let force: Vector3<f64> = pad.iter().map(|&n| forces[n as usize]).sum();
    let arm = |k: usize| pad.iter().map(|&n| x[n as usize][k] * forces[n as usize].z).sum::<f64>() / force.z;
    let stated = snapshot.response;
    let exact = Vector3::new(stated.friction_x_n, stated.friction_y_n, stated.normal_force_n);
    println!("{force:?} N at {:?} mm", [arm(0), arm(1)]);
    verify("contact force", "error against the tissue's", (force - exact).norm() / exact.norm(), 1e-5);
    for k in 0..2 {
        let error = (stated.centre_of_pressure_mm[k] - arm(k)).abs();
        verify("centre of pressure", &format!("error of component {k}, mm"), error, 1e-3);
        assert!(arm(k).abs() > 0.1, "off the foot: {}", arm(k));
    }
}
