//! The two CalculiX rows of the verification table: frictionless press, Coulomb slide.
#![cfg(unix)]

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use fingerpad_fe::compare_ccx::Runner;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::calculix::*;

/// Elastic slip of our Coulomb run, mm.
const GAMMA_CRIT_MM: f64 = 1e-3;
/// Stick slope of CalculiX's, MPa/mm.
const STICK_SLOPE: f64 = 5.0;

/// Holds our runs against CalculiX on the same mesh; fails if a row does in which both have the same element.
#[derive(Parser)]
struct Arguments {
    /// Coarse meshes only.
    #[arg(long)]
    quick: bool,
    /// Time limit of each run of CalculiX by the clock, s.
    #[arg(long, default_value_t = 3600)]
    timeout_s: u64,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let limit = Duration::from_secs(arguments.timeout_s);
    println!("CalculiX: {}, C3D8R", Runner::default().version().unwrap_or_else(|e| panic!("{e}")));
    println!("penalty {PENALTY_MPA_PER_MM} MPa/mm in both, no augmentation");
    let presets: &[MeshPreset] =
        if arguments.quick { &[MeshPreset::Coarse] } else { &[MeshPreset::Coarse, MeshPreset::Medium] };
    let mut failed = 0;
    for preset in presets {
        for shape in ["base", "a"] {
            failed += press(&Case::new(shape, *preset), limit);
        }
    }
    failed += sphere(presets, limit);
    failed += slide(&Case::new("a", MeshPreset::Coarse), limit);
    println!(
        "\n{}",
        if failed == 0 { "all rows with the same element pass".into() } else { format!("{failed} rows fail") }
    );
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Rows that fail with CalculiX's element.
fn press(case: &Case, limit: Duration) -> usize {
    let calculix = press_calculix(case, &case.finger(), limit);
    let mut failed = 0;
    for element in [Element::C3d8r, Element::MeanDilatation] {
        let case = case.clone().with(element);
        let finger = case.finger();
        println!("\nfrictionless press, {}", case.line(&finger));
        println!("depth mm       ours N   CalculiX N  difference   limit");
        for row in press_rows(&finger, &calculix) {
            if element == Element::C3d8r {
                println!("{row}");
                failed += usize::from(!row.passes());
            } else {
                println!("{}", WithoutVerdict(row));
            }
        }
    }
    println!(
        "(no limit with mean dilatation: the difference is the element's, and falls with the mesh: `cargo xtask verify elements`)"
    );
    failed
}

/// Rows that fail with CalculiX's element.
fn sphere(presets: &[MeshPreset], limit: Duration) -> usize {
    println!(
        "\nfrictionless press on a rigid sphere of {SPHERE_MM} mm; it bulges between the nodes, where ours touches"
    );
    let (mut failed, mut same) = (0, Vec::new());
    for preset in presets {
        let case = Case::new("a", *preset);
        for (element, rows) in sphere_rows(&case, limit) {
            let case = case.clone().with(element);
            println!("\n{}", case.line(&case.finger()));
            println!("depth mm       ours N   CalculiX N  difference   limit");
            if element == Element::C3d8r {
                failed += show(&rows);
                same.push(rows);
            } else {
                rows.iter().for_each(|row| println!("{}", WithoutVerdict(*row)));
            }
        }
    }
    if let [coarse, medium] = &same[..] {
        println!("\nextrapolated to elements of no length");
        failed += show(&extrapolated(coarse, medium));
    }
    failed
}

/// Prints rows; returns the number of failures.
fn show(rows: &[Row]) -> usize {
    rows.iter().for_each(|row| println!("{row}"));
    rows.iter().filter(|row| !row.passes()).count()
}

/// Rows that fail with CalculiX's element.
fn slide(case: &Case, limit: Duration) -> usize {
    println!("\nCoulomb slide, mu {MU}, depth {SLIDE_DEPTH_MM} mm, friction from first touch on in both");
    println!("ours: gamma_crit {GAMMA_CRIT_MM} mm; CalculiX: stick slope {STICK_SLOPE} MPa/mm");
    let same = case.clone().with(Element::C3d8r).finger();
    let calculix = slide_calculix(case, &same, STICK_SLOPE, limit);
    let ours = slide_ours(&same, GAMMA_CRIT_MM);
    let mut failed = 0;
    for element in [Element::C3d8r, Element::MeanDilatation] {
        let case = case.clone().with(element);
        let finger = case.finger();
        println!("\n{}", case.line(&finger));
        println!(
            "friction, N                                              | mean pad displacement, mm: CalculiX's length"
        );
        println!(
            "                                                         | plus its distance to ours, and its length"
        );
        println!("slide mm         ours     CalculiX  difference   limit   |");
        for [friction, displacement] in slide_rows(&slide_ours(&finger, GAMMA_CRIT_MM), &calculix) {
            if element == Element::C3d8r {
                println!("{friction} | {displacement}");
                failed += [friction, displacement].iter().filter(|row| !row.passes()).count();
            } else {
                println!("{}                  | {}", WithoutVerdict(friction), WithoutVerdict(displacement));
            }
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
