//! Stick after a reversal: everything sticks that does not lose pressure.

use std::ops::ControlFlow;

use crate::{
    problems::fingers::{follow, placed},
    verify,
};
use fingerpad_fe::experiment::{BodyKind, Config, RigidBodySettings};
use fingerpad_fe::load_path::{Drive, FaceState, Path, Turn, Turns, follow_path};
use fingerpad_fe::mesh::MeshPreset;

/// Shares of the contact area that slip at the end of a path.
struct Slipping {
    whole: f64,
    /// On faces whose pressure is at least that at the last turn.
    without_loss_of_pressure: f64,
}

fn slipping(preset: MeshPreset, path: &Path) -> Slipping {
    let config = Config { mesh_preset: preset, ..Config::default() };
    let finger = config.finger_for(&[path]).unwrap().0;
    let end = path.waypoints.len() - 1;
    let run = follow_path(&config.problem(&finger), path, &[end - 1, end], &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(run.cost.cutbacks, 0, "no step has to be cut");
    let [turn, end] = run.snapshots.as_slice() else { panic!("{} snapshots", run.snapshots.len()) };
    let share = |(before, face): (&FaceState, &FaceState)| {
        if face.pressure_mpa < before.pressure_mpa { 0.0 } else { face.contact_fraction * (1.0 - face.stick_fraction) }
    };
    let touching: f64 = end.faces.iter().map(|face| face.contact_fraction).sum();
    Slipping {
        whole: 1.0 - end.response.stick_ratio,
        without_loss_of_pressure: turn.faces.iter().zip(&end.faces).map(share).sum::<f64>() / touching,
    }
}

fn spun(depth: f64, angles: [f64; 4]) -> Path {
    let flat = placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, 0.0, 0.0], [depth, 0.0, 0.0]]);
    let spin = Turn { drive: Drive::Displacement, values: angles.to_vec() };
    Path { turns: Turns { spin: Some(spin), ..Turns::default() }, ..flat }
}

/// After 1 µm everything sticks. Later the finger rolls back under the smaller friction, and the side with decreasing
/// pressure loses strength faster than shear: there it slips on. Faces that keep their pressure stick, except for a rim
/// that slips back after 100 µm (Mindlin and Deresiewicz 1953: 1 % of a Hertz contact at 1.2 mm).
fn sticks_after_reversals(preset: MeshPreset, depth: f64) {
    for back in [1e-3, 1e-2, 1e-1] {
        let cases = [
            ("x", placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, 5.0, 0.0], [depth, 5.0 - back, 0.0]])),
            ("y", placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, 0.0, 5.0], [depth, 0.0, 5.0 - back]])),
            ("45 degrees", {
                let (far, near) = (3.5, 3.5 - back / 2f64.sqrt());
                placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, far, far], [depth, near, near]])
            }),
            ("y after x", {
                let turn = [depth, 4.0, 0.0];
                placed(&[[0.0; 3], [depth, 0.0, 0.0], turn, [depth, 4.0, 4.0], [depth, 4.0, 4.0 - back]])
            }),
        ];
        for (name, path) in cases {
            let slipping = slipping(preset, &path);
            let case = format!("{preset:?}, {depth} mm, {name}, {back} mm back");
            println!("{case}: {:.2e} of the contact slips", slipping.whole);
            let most = if back < 0.1 { 5e-3 } else { 1.5e-2 };
            verify(&case, "slips without loss of pressure", slipping.without_loss_of_pressure, most);
            if back <= 1e-3 {
                verify(&case, "1 - stick ratio", slipping.whole, 5e-3);
            }
        }
    }
    let slipping = slipping(preset, &spun(depth, [0.0, 0.0, 25.0, 24.98])).whole;
    verify(&format!("{preset:?}, {depth} mm, spin, 0.02 degrees back"), "1 - stick ratio", slipping, 5e-3);
}

pub fn everything_that_keeps_its_pressure_sticks_after_a_reversal() {
    sticks_after_reversals(MeshPreset::Coarse, 0.8);
    sticks_after_reversals(MeshPreset::Coarse, 1.2);
}

/// On curved bodies 1 µm back, or 0.02 degrees: along y, x, 45 degrees, y after x and after a spin.
pub fn everything_sticks_after_a_reversal_on_curved_bodies() {
    let round = |kind, radius_mm, axis_deg| RigidBodySettings {
        kind,
        radius_mm: Some(radius_mm),
        axis_deg,
        ..RigidBodySettings::default()
    };
    for body in [round(BodyKind::Sphere, 10.0, None), round(BodyKind::Cylinder, 8.0, Some(30.0))] {
        for depth in [0.8, 1.2] {
            let press = [[0.0; 3], [depth, 0.0, 0.0]];
            let slides = |corners: &[[f64; 2]]| {
                let slides: Vec<[f64; 3]> = corners.iter().map(|&[x, y]| [depth, x, y]).collect();
                placed(&[&press[..], &slides].concat())
            };
            let cases = [
                ("x", slides(&[[4.0, 0.0], [3.999, 0.0]])),
                ("-x", slides(&[[-4.0, 0.0], [-3.999, 0.0]])),
                ("y", slides(&[[0.0, 5.0], [0.0, 4.999]])),
                ("-y", slides(&[[0.0, -5.0], [0.0, -4.999]])),
                ("45 degrees", slides(&[[3.0, 3.0], [2.9993, 2.9993]])),
                ("y after x", slides(&[[4.0, 0.0], [4.0, 4.0], [4.0, 3.999]])),
                ("spin", spun(depth, [0.0, 0.0, 25.0, 24.98])),
            ];
            for (name, path) in cases {
                let config = Config { mesh_preset: MeshPreset::Coarse, rigid_body: body.clone(), ..Config::default() };
                let finger = config.finger_for(&[&path]).unwrap().0;
                let end = *follow(&config.problem(&finger), &path).unwrap().responses.last().unwrap();
                let case = format!("{:?}, {depth} mm, {name}, 1 um back", body.kind);
                verify(&case, "1 - stick ratio", 1.0 - end.stick_ratio, 1e-2);
            }
        }
    }
}

pub fn everything_that_keeps_its_pressure_sticks_after_a_reversal_on_a_medium_mesh() {
    sticks_after_reversals(MeshPreset::Medium, 0.8);
    sticks_after_reversals(MeshPreset::Medium, 1.2);
}
