//! Tips of many sizes, materials and friction laws: each ends with pad and bed, or with a sentence that says what to change.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use crate::common::{Folder, package};

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

/// A dome of 10 mm on a core of 5 mm, E 0.1 MPa, Coulomb 0.8: pad and bed from its stored runs, and friction in full slip over the normal
/// force at three loads and, of the pad, in three poses.
#[test]
fn a_tip_from_stored_runs_obeys_coulombs_law() {
    let folder = Folder::new();
    let runs = package().join("tests/tip_runs");
    let tip = "--dome 10 --core 5 --young 0.1 --mu 0.8 --mesh-preset coarse";
    let (printed, _) = folder.done(&format!("finger {tip} --design stored --runs {} --out made", runs.display()));
    assert!(printed.contains("verdict") && printed.contains("bed   neutral pose"), "{printed}");
    the_page_shows_coulombs_law(&folder);
    // Between the axes the limit of a bed is an ellipse.
    for (model, poses, oblique) in [("pad", &[[45, 0], [25, 0], [60, 20]][..], 0.003), ("model", &[[45, 0]], 0.015)] {
        for [pitch, roll] in poses {
            for depth in [0.4, 0.9, 1.6] {
                for direction in 0..8 {
                    let (sin, cos) = (TAU * f64::from(direction) / 8.0).sin_cos();
                    let mut path = "t_s,depth_mm,slide_x_mm,slide_y_mm,pitch_deg,roll_deg\n".to_owned();
                    for (t, depth, slide) in [(0.0, 0.0, 0.0), (1.0, depth, 0.0), (5.0, depth, 12.0)] {
                        writeln!(path, "{t},{depth},{},{},{pitch},{roll}", slide * cos, slide * sin).unwrap();
                    }
                    folder.write("p.csv", path);
                    folder.done(&format!("eval --model made/{model}.fpm --path p.csv --out r.csv"));
                    let [n, x, y] =
                        ["normal_force_n", "friction_x_n", "friction_y_n"].map(|name| folder.last("r.csv", name));
                    let most = if direction % 2 == 0 { 0.003 } else { oblique };
                    let ratio = x.hypot(y) / n / 0.8;
                    assert!((ratio - 1.0).abs() < most, "{model}, {pitch} {roll}, {depth} mm, {direction}: {ratio}");
                }
            }
        }
    }
}

/// Every figure stands in the page; along the axes the curves of pad and bed, and the ends of the finite elements' slides, obey the law.
fn the_page_shows_coulombs_law(folder: &Folder) {
    let html = folder.text("made/reduced.html");
    assert!(html.contains("In the neutral pose: pad ") && html.contains("The bed is "), "the verdict stands in words");
    for figure in ["tip_section", "tip_loads", "tip_slides", "tip_limits", "tip_unseen", "tip_stick"] {
        assert!(html.contains(&format!("<figure id=\"{figure}\">")) && folder.exists(&format!("made/{figure}.svg")));
    }
    assert!(!html.contains("NaN") && !html.contains("skin"));
    let json: serde_json::Value = serde_json::from_str(&folder.text("made/reduced.json")).unwrap();
    let loads = json["groups"].as_array().unwrap().iter().find(|group| group["name"] == "tip_loads").unwrap();
    let full_slip = loads["charts"].as_array().unwrap().iter().find(|chart| chart["title"] == "Full slip").unwrap();
    let mut shown = [0, 0];
    for trace in full_slip["traces"].as_array().unwrap() {
        let is_dots = trace["is_dots"] == true;
        for point in trace["points"].as_array().unwrap() {
            let coefficient = point[1].as_f64().unwrap();
            // At the end of a slide of the finite elements up to 2 % of the contact sticks.
            assert!((coefficient / 0.8 - 1.0).abs() < if is_dots { 0.02 } else { 0.003 }, "{trace}");
            shown[usize::from(is_dots)] += 1;
        }
    }
    assert!(shown[0] > 50 && shown[1] > 0, "{shown:?}");
}

/// Flags that a shape needs, and numbers that make none.
#[test]
fn tips_by_dimensions_are_refused_by_name_and_value() {
    let folder = Folder::new();
    for (flags, parts) in [
        ("--dome 12 --core 7 --mu 0.8", &["missing --material NAME or --young-mpa E"][..]),
        ("--dome 12 --core 7 --young 0.3", &["missing --mu MU"]),
        ("--dome 12 --core 13 --young 0.3 --mu 1", &["core_mm = 13", "must leave a layer under 12 mm"]),
        ("--dome 12 --young 0.3 --mu 1", &["--core-mm"]),
        ("--dome 12 --core 7 --material foam --mu 1", &["foam", "dragon-skin-10"]),
        ("--flat 20,16 --young 0.3 --mu 1", &["flat:20,16", "2 numbers", "thickness"]),
        ("--flat 20,16,4,9 --young 0.3 --mu 1", &["crown of 9 mm"]),
        ("--dome 12 --core 7 --young 0.3 --mu 1 --poisson 0.5", &["between 0 and 0.5"]),
        ("--shape e --poisson 0.4", &["--poisson without --young-mpa"]),
    ] {
        folder.refused(&format!("mesh {flags} --mesh-preset coarse --out m.vtu"), parts);
    }
    folder.refused("phantom --flat 20,16,4.5 --young 0.3 --mu 1 --out p.nrrd", &["flat:20,16,4.5", "needs a dome"]);
    assert!(folder.names("").is_empty());
    folder.write("o.toml", "[friction]\nacross_over_along = 0.7\nskin_axis_deg = 20.0\n");
    let parts = ["across_over_along = 0.7", "isotropic friction only"];
    folder.refused("finger --config o.toml --mesh-preset coarse --out made", &parts);
    // What scripts read holds no remarks.
    let (json, _) =
        folder.done("mesh --dome 12 --core 7 --material sylgard-184 --mu 1 --mesh-preset coarse --out m.vtu --json");
    serde_json::from_str::<serde_json::Value>(&json).unwrap();
    let (config, _) = folder.done("build --dome 12 --core 7 --young 0.3 --mu 1 --print-config");
    assert!(config.contains("shape = \"dome:12,7\"") && config.starts_with("shape"), "{config}");
    // No skin and no phalanx in the words on a robot's fingertip.
    let (printed, _) =
        folder.done("mesh --dome 12 --core 7 --young 0.3 --mu 0.8 --mesh-preset coarse --out m.vtu --picture m.svg");
    let words = printed + &folder.text("m.svg");
    assert!(words.contains("soft material") && !words.contains("skin") && !words.contains("phalanx"), "{words}");
}
