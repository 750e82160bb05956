//! What sticks after a small reversal: everything.

use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Turn, Turns};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::{
    problems::fingers::{follow, placed},
    verify,
};

/// Stick ratio at the end of a path.
fn stick(preset: MeshPreset, path: &Path) -> f64 {
    let config = Config { mesh_preset: preset, ..Config::default() };
    let finger = config.finger_for(&[path]).unwrap().0;
    let run = follow(&config.problem(&finger), path).unwrap();
    assert_eq!(run.cost.cutbacks, 0, "no step has to be cut");
    run.responses.last().unwrap().stick_ratio
}

fn spun(depth: f64, angles: [f64; 4]) -> Path {
    let flat = placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, 0.0, 0.0], [depth, 0.0, 0.0]]);
    let spin = Turn { drive: Drive::Displacement, values: angles.to_vec() };
    Path { turns: Turns { spin: Some(spin), ..Turns::default() }, ..flat }
}

/// `most_from_10_um`: largest slipping share after reversals of 10 and 100 µm. By then nodes at the rim that lose pressure have slipped on by
/// more than counts as stick, and after 100 µm a rim slips back (Mindlin and Deresiewicz 1953: 1 % of a Hertz contact at 1.2 mm).
fn sticks_after_reversals(preset: MeshPreset, depth: f64, most_from_10_um: f64) {
    for (back, most) in [(1e-3, 5e-3), (1e-2, most_from_10_um), (1e-1, most_from_10_um)] {
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
            let slip = 1.0 - stick(preset, &path);
            let case = format!("{preset:?}, {depth} mm, {name}, {back} mm back");
            verify(&case, "1 - stick ratio", slip, most);
        }
    }
    let slip = 1.0 - stick(preset, &spun(depth, [0.0, 0.0, 25.0, 24.98]));
    verify(&format!("{preset:?}, {depth} mm, spin, 0.02 degrees back"), "1 - stick ratio", slip, 5e-3);
}

#[test]
fn everything_sticks_after_a_small_reversal() {
    sticks_after_reversals(MeshPreset::Coarse, 0.8, 5e-3);
    sticks_after_reversals(MeshPreset::Coarse, 1.2, 5e-3);
}

#[test]
#[ignore = "slow: `cargo xtask test --slow`"]
fn everything_sticks_after_a_small_reversal_on_a_medium_mesh() {
    sticks_after_reversals(MeshPreset::Medium, 0.8, 5e-3);
    sticks_after_reversals(MeshPreset::Medium, 1.2, 3e-2);
}
