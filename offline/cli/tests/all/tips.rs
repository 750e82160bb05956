//! Tips of many sizes, materials and friction laws: each ends with pad and bed, or with a sentence that says what to change.

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
/// Human shapes, the cushion of an imported mesh, and a flat pad on a plate.
const OTHERS: [&str; 7] = [
    "--shape a",
    "--shape b",
    "--shape d",
    "--shape e",
    "--shape base",
    "--config meshes/cushion.toml",
    "--flat 20,16,4 --young 0.3 --mu 0.8",
];

#[test]
#[ignore = "weekly"]
fn every_tip_has_models_or_a_reason() {
    let domes = DOMES.map(|(name, [radius, core, young, poisson, lambda, beta])| {
        let law = format!("[friction]\nlambda = {lambda:?}\nbeta = {beta:?}\n");
        (name, format!("--dome {radius} --core {core} --young {young} --poisson {poisson} --config law.toml"), law)
    });
    let others = OTHERS.map(|source| (source, source.to_owned(), String::new()));
    for (name, source, law) in domes.into_iter().chain(others) {
        let folder = Folder::with(&[("law.toml", &law)]);
        std::fs::create_dir(folder.path("meshes")).unwrap();
        folder.write("meshes/cushion.toml", include_str!("../../data/meshes/cushion.toml"));
        folder.write("meshes/cushion.msh", include_bytes!("../../data/meshes/cushion.msh"));
        let (code, stdout, stderr) = folder.run(&format!("finger {source} --mesh-preset coarse --out made"));
        let verdict = stdout.split("\nverdict").nth(1).unwrap_or_default();
        println!("{name}: exit code {code:?}{verdict}{}", stderr.lines().last().unwrap_or_default());
        match code {
            Some(0) => assert!(folder.exists("made/pad.fpm") && folder.exists("made/model.fpm"), "{name}"),
            Some(4) => assert!(stderr.contains("not usable in the neutral pose and not written"), "{name}: {stderr}"),
            code => panic!("{name}: {code:?}: {stderr}"),
        }
    }
}
