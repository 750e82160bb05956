//! From CAD to a finger: the recipe that meshes STEP and STL with Gmsh, and the shipped hemispherical fingertip.

use std::f64::consts::FRAC_1_SQRT_2;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::{check, quality, set};
use fingerpad_tests::verify;

/// Volume between two cylinders of 8 and 16 mm that are 8 mm long and the half balls on them, mm³.
const VOLUME_MM3: f64 = std::f64::consts::PI * (8.0 * (64.0 - 16.0) + 2.0 / 3.0 * (512.0 - 64.0));

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn shipped(name: &str) -> PathBuf {
    root().join("data/geometry/hemisphere").join(name)
}

/// A Python with Gmsh, as `cargo xtask test` installs it.
fn python() -> PathBuf {
    let candidates = [PathBuf::from("python3"), root().join("target/gmsh/bin/python")];
    let has_gmsh = |python: &PathBuf| {
        Command::new(python).args(["-c", "import gmsh"]).output().is_ok_and(|done| done.status.success())
    };
    let found = candidates.into_iter().find(has_gmsh);
    found.expect("Gmsh for Python: `cargo xtask test --only tests` installs it, or `pip install gmsh`")
}

fn recipe(folder: &Path, arguments: &[&str]) -> Output {
    let script = root().join("tools/cad_to_mesh.py");
    Command::new(python()).current_dir(folder).arg(script).args(arguments).output().expect("a Python that starts")
}

/// Numbers of the flat surfaces at the end and of those of the core, as `--list` prints them.
fn surfaces(file: &str, folder: &Path) -> [String; 2] {
    let listing = recipe(folder, &[file, "--list"]);
    let listing = String::from_utf8(listing.stdout).expect("text");
    println!("{listing}");
    let (mut held, mut core) = (Vec::new(), Vec::new());
    for line in listing.lines().filter_map(|line| line.strip_prefix("surface ")) {
        let words: Vec<&str> = line.split([' ', ',']).collect();
        // "N (Kind): x A to B, y A to B, z A to B mm"; a kind may be two words.
        let bounds: Vec<f64> = words[1..].iter().filter_map(|word| word.parse().ok()).collect();
        let [x0, x1, y0, y1, ..] = bounds[..] else { panic!("{line}") };
        if x1 - x0 < 0.01 {
            held.push(words[0]);
        } else if y0 > -4.01 && y1 < 4.01 {
            core.push(words[0]);
        }
    }
    [held.join(","), core.join(",")]
}

#[test]
fn step_and_stl_become_fingers() {
    for name in ["fingertip.step", "fingertip.stl"] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(shipped(name), folder.path().join(name)).unwrap();
        let [held, core] = surfaces(name, folder.path());
        let sizes = ["--incline-deg", "45", "--size-mm", "3", "--pad-size-mm", "1.6", "--pad-height-mm", "4"];
        let groups = ["--held", &held, "--core", &core, "--out", "finger.msh"];
        let done = recipe(folder.path(), &[&[name][..], &sizes, &groups].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let config = Config::read(&folder.path().join("finger.toml")).unwrap();
        let (fingertip, _) = config.fingertip().unwrap();
        let mesh = &fingertip.mesh;
        check(mesh).unwrap();
        let report = quality(mesh);
        println!("{name}: {report:?}");
        verify(name, "error of the volume", (report.volume_mm3() / VOLUME_MM3 - 1.0).abs(), 0.01);
        assert!(report.worst_tet_scaled_jacobian > 0.05 && mesh.pad_triangles.len() > 40, "{name}");
        let lowest = mesh.nodes.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        assert!((0.0..0.1).contains(&lowest), "{name}: lowest node at {lowest} mm");
        // Nodes on the core are on its wall, from which a straightened edge of 3 mm is 0.28 mm off.
        let touch = fingertip.touch;
        for node in mesh.node_set(set::DISTAL_BONE) {
            let place = touch.rotation.transpose() * mesh.nodes[*node as usize] + touch.point_mm;
            let from_axis = nalgebra::Vector3::new((place.x - 8.0).max(0.0), place.y, place.z);
            let radius = from_axis.norm();
            assert!((radius - 4.0).abs() < 0.3, "{name}: node {node} of the core at radius {radius} mm");
        }
        let expected = nalgebra::Vector3::new(8.0 + 8.0 * FRAC_1_SQRT_2, 0.0, -8.0 * FRAC_1_SQRT_2);
        verify(name, "distance of first touch, mm", (touch.point_mm - expected).norm(), 0.05);
    }
}

#[test]
fn an_stl_with_a_hole_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let mut stl = std::fs::read(shipped("fingertip.stl")).unwrap();
    // Removes the last facet and corrects the count.
    let count = u32::from_le_bytes(stl[80..84].try_into().unwrap()) - 1;
    stl[80..84].copy_from_slice(&count.to_le_bytes());
    let corner = |n: usize, k: usize| {
        let at = stl.len() - 50 + 12 + 12 * n + 4 * k;
        f64::from(f32::from_le_bytes(stl[at..at + 4].try_into().unwrap()))
    };
    let middle: Vec<f64> = (0..3).map(|k| (corner(0, k) + corner(1, k) + corner(2, k)) / 3.0).collect();
    stl.truncate(stl.len() - 50);
    std::fs::write(folder.path().join("holed.stl"), &stl).unwrap();
    let refused = recipe(folder.path(), &["holed.stl", "--held", "1"]);
    let message = String::from_utf8(refused.stderr).unwrap();
    println!("{message}");
    assert_eq!(refused.status.code(), Some(2), "{message}");
    let stated = message.split("has 1 hole(s): around (").nth(1).expect("the hole and its place").split(')').next();
    let stated: Vec<f64> = stated.unwrap().split(", ").map(|c| c.parse().unwrap()).collect();
    assert!(stated.iter().zip(&middle).all(|(a, b)| (a - b).abs() < 2e-3), "{stated:?} {middle:?}");
    assert!(message.contains("with 3 corners, beside facet "), "{message}");
}

#[test]
fn an_stl_in_metres_is_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let mut stl = std::fs::read(shipped("fingertip.stl")).unwrap();
    for facet in stl[84..].chunks_exact_mut(50) {
        for number in facet[12..48].chunks_exact_mut(4) {
            let scaled = 1e-3 * f32::from_le_bytes(number.try_into().unwrap());
            number.copy_from_slice(&scaled.to_le_bytes());
        }
    }
    std::fs::write(folder.path().join("metres.stl"), &stl).unwrap();
    let refused = recipe(folder.path(), &["metres.stl", "--list"]);
    let message = String::from_utf8(refused.stderr).unwrap();
    assert!(message.contains("is 0.016 mm long, which no fingertip is; in metres? Give --unit-mm 1000"), "{message}");
    assert!(recipe(folder.path(), &["metres.stl", "--list", "--unit-mm", "1000"]).status.success());
}

/// CAD models with details of micrometres, of which a mesh makes slivers: edges that miss each other, a step between two faces.
#[test]
fn details_of_micrometres_make_no_slivers() {
    // Each fills the shape of 16 mm over z = 0, and its largest flat face lies on top.
    let shapes = [
        (
            "cylinders",
            "a = o.addCylinder(0, 0, 1, 0, 0, 4, 8); b = o.addCylinder(0.003, 0, 0, 0, 0, 1, 8); o.fuse([(3, a)], [(3, b)])",
            1005.3,
        ),
        (
            "step",
            "a = o.addBox(-8, -8, 1, 16, 16, 4); b = o.addBox(-8.0004, -8.002, 0, 16, 16, 1); o.fuse([(3, a)], [(3, b)])",
            1280.0,
        ),
    ];
    for (name, shape, volume_mm3) in shapes {
        let folder = tempfile::tempdir().unwrap();
        let make = format!(
            "import gmsh; gmsh.initialize(interruptible=False); gmsh.option.setNumber('General.Terminal', 0); o = gmsh.model.occ\n\
             {shape}; o.synchronize(); gmsh.write('finger.step')"
        );
        let made = Command::new(python()).current_dir(folder.path()).args(["-c", &make]).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let listing = String::from_utf8(recipe(folder.path(), &["finger.step", "--list"]).stdout).unwrap();
        let top = listing.lines().find(|line| line.starts_with("surface") && line.ends_with("z 5.00 to 5.00 mm"));
        let top = top.expect(&listing).split(' ').nth(1).unwrap();
        let sizes = ["--flat", "--pad-size-mm", "2", "--size-mm", "3", "--held", top, "--out", "finger.msh"];
        let done = recipe(folder.path(), &[&["finger.step"][..], &sizes].concat());
        let said = String::from_utf8(done.stdout).unwrap();
        assert!(done.status.success(), "{name}: {said}{}", String::from_utf8_lossy(&done.stderr));
        let stated: f64 =
            said.split("least scaled Jacobian ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap();
        let (fingertip, _) = Config::read(&folder.path().join("finger.toml")).unwrap().fingertip().unwrap();
        check(&fingertip.mesh).unwrap();
        let report = quality(&fingertip.mesh);
        println!("{name}: {said}{report:?}");
        // The script prints the number of the importer.
        assert!(
            (stated - report.worst_tet_scaled_jacobian).abs() < 6e-4 && stated > 0.1,
            "{name}: {stated} {report:?}"
        );
        assert!(said.contains("details smaller than"), "{name}: {said}");
        verify(name, "error of the volume", (report.volume_mm3() / volume_mm3 - 1.0).abs(), 0.01);
        // The held face is whole.
        let held = fingertip.mesh.node_set(set::PROXIMAL_FIX);
        assert!(held.iter().all(|n| (fingertip.mesh.nodes[*n as usize].z - 5.0).abs() < 0.01), "{name}");
        assert!(report.pad_area_mm2 > 0.97 * 201.0, "{name}: {} mm2", report.pad_area_mm2);
    }
}
