//! Forces against CalculiX's: frictionless presses on a plane and on a sphere, a Coulomb slide.

use std::time::Duration;

use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::calculix::*;

/// Elastic slip of our Coulomb run, mm.
const GAMMA_CRIT_MM: f64 = 1e-3;
/// Stick slope of CalculiX's, MPa/mm.
const STICK_SLOPE: f64 = 5.0;
const ELEMENTS: [Element; 2] = [Element::C3d8r, Element::MeanDilatation];

/// Whether all rows with the same element pass.
pub fn run(presets: &[MeshPreset], limit: Duration) -> bool {
    let mut failed = 0;
    for preset in presets {
        for shape in ["base", "a"] {
            let case = Case::new(shape, *preset);
            let calculix = press_calculix(&case, &case.finger(), limit);
            for case in ELEMENTS.map(|element| case.clone().with(element)) {
                println!("\nfrictionless press, {}", case.line(&case.finger()));
                failed += show(&press_rows(&case, &calculix));
            }
        }
    }
    println!(
        "(with mean dilatation the difference is the element's, and falls with the mesh: `cargo xtask verify elements`)"
    );
    failed += sphere(presets, limit) + slide(&Case::new("a", MeshPreset::Coarse), limit);
    println!("\n{failed} rows with the same element fail");
    failed == 0
}

/// Prints rows of normal forces; returns the number of failures.
fn show(rows: &[Row]) -> usize {
    println!("depth mm       ours N   CalculiX N  difference   limit");
    rows.iter().for_each(|row| println!("{row}"));
    rows.iter().filter(|row| !row.passes()).count()
}

fn sphere(presets: &[MeshPreset], limit: Duration) -> usize {
    println!(
        "\nfrictionless press on a rigid sphere of {SPHERE_MM} mm; it bulges between the nodes, where ours touches"
    );
    let (mut failed, mut same) = (0, Vec::new());
    for case in presets.iter().map(|preset| Case::new("a", *preset)) {
        for (element, rows) in sphere_rows(&case, limit) {
            let case = case.clone().with(element);
            println!("\n{}", case.line(&case.finger()));
            failed += show(&rows);
            same.extend((element == Element::C3d8r).then_some(rows));
        }
    }
    if let [coarse, medium] = &same[..] {
        println!("\nextrapolated to elements of no length");
        failed += show(&extrapolated(coarse, medium));
    }
    failed
}

fn slide(case: &Case, limit: Duration) -> usize {
    println!("\nCoulomb slide, mu {MU}, depth {SLIDE_DEPTH_MM} mm, friction from first touch on in both");
    println!("ours: gamma_crit {GAMMA_CRIT_MM} mm; CalculiX: stick slope {STICK_SLOPE} MPa/mm");
    let same = case.clone().with(Element::C3d8r).finger();
    let calculix = slide_calculix(case, &same, STICK_SLOPE, limit);
    let ours = slide_ours(&same, GAMMA_CRIT_MM);
    let mut failed = 0;
    for element in ELEMENTS {
        let case = case.clone().with(element);
        let finger = case.finger();
        println!("\n{}", case.line(&finger));
        println!(
            "left: friction, N; right: CalculiX's mean pad displacement plus its distance to ours, and its length, mm"
        );
        println!("slide mm         ours     CalculiX  difference   limit   |");
        for [friction, displacement] in slide_rows(element, &slide_ours(&finger, GAMMA_CRIT_MM), &calculix) {
            println!("{friction} | {displacement}");
            failed += [friction, displacement].iter().filter(|row| !row.passes()).count();
        }
    }
    println!("\nfriction with gamma_crit halved and with the stick slope doubled: neither matters");
    let halved = slide_ours(&same, 0.5 * GAMMA_CRIT_MM);
    let doubled = slide_calculix(case, &same, 2.0 * STICK_SLOPE, limit);
    for (k, s) in SLIDES_MM.iter().enumerate() {
        let change = |new: &[SlidePoint], old: &[SlidePoint]| new[k].friction_n / old[k].friction_n - 1.0;
        let (a, b) = (change(&halved, &ours), change(&doubled, &calculix));
        println!("{s:>8.2}  ours {:+.3} %   CalculiX {:+.3} %", 100.0 * a, 100.0 * b);
        failed += [a, b].iter().filter(|change| !(change.abs() < 0.2 * SLIDE_PASS)).count();
    }
    failed
}
