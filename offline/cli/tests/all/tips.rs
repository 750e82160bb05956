//! Tips of many sizes, materials and friction laws: each ends with pad and bed, or with a sentence that says what to change.

use std::fmt::Write as _;

use crate::common::Folder;

/// Radius of the dome, radius of its core, mm; Young's modulus, MPa; Poisson's ratio; lambda and beta.
const DOMES: [(&str, [f64; 6]); 14] = [
    ("small and soft", [5.0, 3.5, 0.03, 0.49, 0.8, 1.0]),
    ("small", [5.0, 2.5, 0.1, 0.495, 0.3, 0.85]),
    ("small and stiff", [5.0, 3.0, 3.0, 0.45, 0.3, 1.0]),
    ("of the pages", [8.0, 4.0, 0.6, 0.49, 0.3, 0.85]),
    ("of the pages, rough", [8.0, 4.0, 0.6, 0.49, 1.5, 1.0]),
    ("soft", [8.0, 3.0, 0.03, 0.45, 0.8, 1.0]),
    ("thin", [8.0, 6.5, 0.3, 0.49, 0.8, 1.0]),
    ("stiff", [8.0, 5.0, 3.0, 0.495, 0.3, 0.85]),
    ("hand", [10.0, 5.0, 0.1, 0.49, 0.8, 1.0]),
    ("large core", [12.0, 7.0, 0.59, 0.49, 1.0, 1.0]),
    ("thick", [12.0, 4.0, 0.1, 0.45, 0.3, 1.0]),
    ("large and soft", [20.0, 12.0, 0.03, 0.45, 1.5, 1.0]),
    ("large", [20.0, 14.0, 0.6, 0.49, 0.8, 1.0]),
    ("large and stiff", [20.0, 13.0, 3.0, 0.49, 0.3, 0.85]),
];
/// Human shapes, and the cushion of an imported mesh.
const OTHERS: [&str; 6] =
    ["--shape a", "--shape b", "--shape d", "--shape e", "--shape base", "--config meshes/cushion.toml"];

/// A half-sphere on a core, as `data/geometry/hemisphere.toml`.
fn write_dome(folder: &Folder, [radius, core, young, poisson, lambda, beta]: [f64; 6]) {
    let layer = radius - core;
    let lengths = [
        ("half_width", radius),
        ("half_thickness", radius),
        ("length", 2.0 * radius),
        ("cap_length", radius),
        ("taper_start", radius),
        ("taper_blend", 0.5 * radius),
        ("skin_thickness", 0.15 * layer),
        ("bone_half_width", core),
        ("bone_half_thickness", core),
        ("bone_cap_length", core),
        ("bone_dorsal_offset", 0.0),
        ("bone_distal_clearance", layer),
        ("joint_start", 0.375 * radius),
        ("joint_end", 0.5 * radius),
        ("nail_start", 0.5 * radius),
        ("nail_end", 0.75 * radius),
        ("pad_height", layer + 0.5),
    ];
    let mut shape = String::from("taper_slope = 0.0\nnail = \"none\"\ninclination_deg = 45.0\n");
    lengths.iter().for_each(|(name, mm)| writeln!(shape, "{name}_mm = {mm:?}").unwrap());
    ["", "bone_"]
        .iter()
        .for_each(|of| write!(shape, "{of}section_exponent = 2.0\n{of}profile_exponent = 2.0\n").unwrap());
    folder.write("dome.toml", shape);
    let law = format!("kind = \"elastic\"\nyoung_mpa = {young:?}\npoisson = {poisson:?}\n");
    let tissue = format!("[tissue.skin]\n{law}[tissue.subcutaneous]\n{law}[tissue.bone]\nkind = \"fixed\"\n");
    folder.write(
        "tip.toml",
        format!("shape = \"dome.toml\"\n{tissue}[friction]\nlambda = {lambda:?}\nbeta = {beta:?}\n"),
    );
}

#[test]
#[ignore = "weekly"]
fn every_tip_has_models_or_a_reason() {
    let domes = DOMES.map(|(name, numbers)| (name, "--config tip.toml", Some(numbers)));
    for (name, source, numbers) in domes.into_iter().chain(OTHERS.map(|source| (source, source, None))) {
        let folder = Folder::new();
        std::fs::create_dir(folder.path("meshes")).unwrap();
        folder.write("meshes/cushion.toml", include_str!("../../data/meshes/cushion.toml"));
        folder.write("meshes/cushion.msh", include_bytes!("../../data/meshes/cushion.msh"));
        numbers.into_iter().for_each(|numbers| write_dome(&folder, numbers));
        let (code, stdout, stderr) = folder.run(&format!("finger {source} --mesh-preset coarse --out made"));
        let verdict = stdout.split("\nverdict").nth(1).unwrap_or_default();
        println!("{name}: exit code {code:?}{verdict}{}", stderr.lines().last().unwrap_or_default());
        match code {
            Some(0) => assert!(folder.exists("made/pad.fpm") && folder.exists("made/model.fpm"), "{name}"),
            Some(4) => assert!(stderr.contains("--accept") && !folder.exists("made/pad.fpm"), "{name}: {stderr}"),
            code => panic!("{name}: {code:?}: {stderr}"),
        }
    }
}
