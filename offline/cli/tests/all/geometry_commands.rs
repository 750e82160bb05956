//! The commands around volumes and imported meshes, as a user calls them.

use std::{
    path::Path,
    process::{Command, Output},
};

fn run(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fingerpad")).current_dir(folder).args(args).output().unwrap()
}

fn done(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// Checks that the command prints the expected text on standard error and exits with 2.
fn refused(folder: &Path, args: &[&str], expected: &[&str]) {
    let output = run(folder, args);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {errors}");
    assert!(expected.iter().all(|e| errors.contains(e)), "{args:?}: {errors}\nshould contain {expected:?}");
}

const PHANTOM: [&str; 9] = ["phantom", "--voxels", "80", "60", "60", "--extent-mm", "32", "24", "24"];

#[test]
fn a_phantom_becomes_a_mesh_and_bad_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let printed = done(folder, &[&PHANTOM[..], &["--out", "p.nii.gz"]].concat());
    assert!(printed.contains("80 x 60 x 60 voxels of 0.4000 x 0.4000 x 0.4000 mm"), "{printed}");
    std::fs::write(folder.join("v.toml"), "mesh_preset = \"coarse\"\n[volume]\nfile = \"p.nii.gz\"\n").unwrap();
    let printed = done(folder, &["mesh", "--config", "v.toml", "--out", "p.vtu", "--picture", "p.png", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&printed).unwrap();
    let rms = json["geometry"]["volume"]["skin"]["border_rms_mm"].as_f64().unwrap();
    assert!(rms > 0.0 && rms < 0.2, "{rms}");
    assert!((json["geometry"]["template"]["half_width_mm"].as_f64().unwrap() - 8.5).abs() < 0.05);
    assert!(json["worst_hex_scaled_jacobian"].as_f64().unwrap() > 0.3);
    assert!(std::fs::read(folder.join("p.png")).unwrap().starts_with(b"\x89PNG"));

    let whole = std::fs::read(folder.join("p.nii.gz")).unwrap();
    std::fs::write(folder.join("cut.nii.gz"), &whole[..whole.len() / 2]).unwrap();
    refused(folder, &["mesh", "--volume", "cut.nii.gz", "--out", "c.vtu"], &["cut.nii.gz"]);
    refused(folder, &["mesh", "--volume", "none.nrrd", "--out", "c.vtu"], &["none.nrrd"]);
    refused(folder, &["mesh", "--volume", "p.dcm", "--out", "c.vtu"], &["p.dcm", ".nrrd"]);
    std::fs::write(folder.join("l.toml"), "[volume]\nfile = \"p.nii.gz\"\nlabels = { nail = [9] }\n").unwrap();
    refused(folder, &["mesh", "--config", "l.toml", "--out", "c.vtu"], &["p.nii.gz", "label 3", "volume.labels"]);
    std::fs::write(folder.join("k.toml"), "[volume]\nfil = \"p.nii.gz\"\n").unwrap();
    refused(folder, &["mesh", "--config", "k.toml", "--out", "c.vtu"], &["k.toml", "line 2", "fil"]);
    let both = "[volume]\nfile = \"p.nii.gz\"\n[imported]\nfile = \"a.msh\"\n";
    std::fs::write(folder.join("b.toml"), both).unwrap();
    refused(folder, &["mesh", "--config", "b.toml", "--out", "c.vtu"], &["`volume` and `imported`"]);
    refused(folder, &[&PHANTOM[..], &["--out", "p.png"]].concat(), &["p.png"]);
    refused(folder, &["phantom", "--extent-mm", "10", "24", "24", "--out", "p.nrrd"], &["extent_mm = 10", "axis 0"]);
    refused(folder, &["phantom", "--config", "v.toml", "--out", "p.nrrd"], &["--shape"]);
}

#[test]
fn our_files_and_gmsh_s_are_imported() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    for name in ["f.inp", "f.msh"] {
        done(folder, &["mesh", "--mesh-preset", "coarse", "--out", name]);
        let printed = done(folder, &["mesh", "--imported", name, "--out", "back.vtu"]);
        assert!(printed.contains("0 elements turned") && printed.contains("0 unused nodes dropped"), "{printed}");
        // A .msh file has no ties: the nail's nodes become the skin's.
        assert_eq!(printed.contains(", 0 nodes merged"), name == "f.inp", "{printed}");
    }
    let cushion = concat!(env!("CARGO_MANIFEST_DIR"), "/data/meshes/cushion.toml");
    let printed = done(folder, &["mesh", "--config", cushion, "--out", "cushion.msh"]);
    assert!(printed.contains("nail"), "{printed}");
    std::fs::write(folder.join("m.toml"), "[imported]\nfile = \"f.msh\"\nregions = { skin = [\"peau\"] }\n").unwrap();
    let expected = ["f.msh", "imported.regions.skin: the file has no `peau`", "subcutaneous"];
    refused(folder, &["mesh", "--config", "m.toml", "--out", "c.vtu"], &expected);
    std::fs::write(folder.join("m.inp"), "*NODE\n1, 0, 0, zero\n").unwrap();
    refused(folder, &["mesh", "--imported", "m.inp", "--out", "c.vtu"], &["m.inp:2: *NODE: `zero`"]);
    refused(folder, &["mesh", "--imported", "m.stl", "--out", "c.vtu"], &["m.stl", ".inp or .msh"]);
}
