//! A shallow arch pushed at its crown has a limit point under force control: it snaps through.

use std::ops::ControlFlow;

use fingerpad::Status;
use fingerpad_offline::{
    assembly::{Body, Joint, Material, Supports},
    contact::PenaltySettings,
    material::Ogden,
    mesh::block::{coordinates, curved_block},
    slide::{Drive, MarchSettings, Path, Problem, Waypoint, march},
    solve::Settings,
};
use nalgebra::Vector3;

#[test]
fn arch_snaps_through_under_force_control_and_says_so() {
    // Length 20, rise 2, thickness 0.6 mm, crown toward the plane, both ends held.
    let (half, rise, thickness) = (10.0, 2.0, 0.6);
    let mut mesh = curved_block(
        &coordinates(-half, half, 32, 1.0),
        &coordinates(-1.0, 1.0, 3, 1.0),
        &coordinates(0.0, thickness, 3, 1.0),
        |x| Vector3::new(x.x, x.y, x.z + rise * (x.x / half).powi(2)),
    );
    // The plane passes beside the ends.
    let nodes = mesh.nodes.clone();
    mesh.pad_faces.retain(|face| face.iter().all(|&n| nodes[n as usize].x.abs() < 0.3 * half));
    let mut fixed = mesh.node_set("x0").to_vec();
    fixed.extend(mesh.node_set("x1"));
    let mut contact: Vec<u32> = mesh.pad_faces.iter().flatten().copied().collect();
    contact.sort_unstable();
    contact.dedup();
    let law = Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 };
    let body = Body::new(
        &mesh,
        |_| Some(Material::Ogden(law)),
        &Supports { fixed, contact, ..Default::default() },
        Vector3::zeros(),
        Joint::default(),
    )
    .unwrap();
    let problem = Problem {
        body: &body,
        pad_faces: &mesh.pad_faces,
        friction: None,
        penalty: PenaltySettings::default(),
        settings: Settings::default(),
        march: MarchSettings { max_force_step_n: 2e-4, ..Default::default() },
    };
    let corner = |t_s: f64, normal: f64| Waypoint { t_s, normal, x: 0.0, y: 0.0 };

    // Under displacement control the force passes a maximum; that is the limit load.
    let path = Path { drives: [Drive::Displacement; 3], waypoints: vec![corner(0.0, 0.0), corner(1.0, 2.0 * rise)] };
    let run = march(&problem, &path, &[], &mut |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    let limit = run.responses.iter().map(|r| r.normal_force_n).fold(0.0, f64::max);
    let after = run.responses.iter().skip_while(|r| r.normal_force_n < limit).map(|r| r.normal_force_n);
    let lowest = after.fold(limit, f64::min);
    println!("verify: arch limit load = {limit:.4} N, then down to {lowest:.4} N");
    assert!(lowest < 0.9 * limit, "the arch has no limit point: {limit} {lowest}");

    // Under force control it must be jumped over.
    let path = Path {
        drives: [Drive::Force, Drive::Displacement, Drive::Displacement],
        waypoints: vec![corner(0.0, 0.0), corner(1.0, 1.15 * limit)],
    };
    let run = march(&problem, &path, &[], &mut |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    let end = run.responses.last().unwrap();
    let stabilised = run.responses.iter().filter(|r| r.status.contains(Status::STABILISED)).count();
    let share = run.work.stabilisation_mj / run.work.plane_mj;
    println!(
        "verify: arch snapped to depth {:.2} mm in {stabilised} stabilised increments, viscous work {share:.2e}",
        end.depth_mm
    );
    assert!((end.normal_force_n - 1.15 * limit).abs() < 1e-4 * limit);
    assert!(stabilised >= 1 && end.depth_mm > 1.5 * rise);
    assert!(run.work.stabilisation_mj > 0.0);
}
