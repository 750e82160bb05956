//! The two CalculiX rows of the verification table: frictionless press, Coulomb slide.
#![cfg(unix)]

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use fingerpad_offline::mesh::MeshPreset;
use fingerpad_offline::peer::Runner;
use fingerpad_tests::peer_cases::*;

/// Holds our runs against CalculiX on the same mesh; fails if a row does.
#[derive(Parser)]
struct Arguments {
    /// Coarse meshes only (the limits are those of the default meshes).
    #[arg(long)]
    quick: bool,
    /// Time limit of each run of the peer by the clock, s.
    #[arg(long, default_value_t = 3600)]
    timeout_s: u64,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let limit = Duration::from_secs(arguments.timeout_s);
    println!("peer: {}", Runner::default().version().unwrap_or_else(|e| panic!("{e}")));
    println!("hexes: mean dilatation in ours, C3D8R in the peer; penalty {PENALTY_MPA_PER_MM} MPa/mm, no augmentation");
    let mut failed = 0;
    let presets: &[MeshPreset] =
        if arguments.quick { &[MeshPreset::Coarse] } else { &[MeshPreset::Coarse, MeshPreset::Default] };
    for preset in presets {
        for shape in ["base", "a"] {
            let case = Case::new(shape, *preset);
            let finger = case.finger();
            println!("\nfrictionless press, {}", case.line(&finger));
            println!("depth mm       ours N       peer N  difference   limit");
            for row in press_rows(&case, &finger, limit) {
                println!("{row}");
                failed += u32::from(*preset == MeshPreset::Default && !row.passes());
            }
            if *preset == MeshPreset::Coarse {
                println!("(coarse: for information; what is over the limit comes from the element types)");
            }
        }
    }

    let case = Case::new("a", MeshPreset::Coarse);
    let finger = case.finger();
    let (gamma, slope) = (1e-3, 5.0);
    println!(
        "\nCoulomb slide, mu {MU}, depth {SLIDE_DEPTH_MM} mm, friction from first touch on in both, {}",
        case.line(&finger)
    );
    let ours = slide_ours(&finger, gamma);
    let peer = slide_peer(&case, &finger, slope, limit);
    println!("ours: gamma_crit {gamma} mm; peer: stick slope {slope} MPa/mm");
    println!("          friction                                        |   mean pad displacement: peer's length, its length + distance to ours");
    println!("slide mm       ours N       peer N  difference   limit    |");
    for [friction, displacement] in slide_rows(&ours, &peer) {
        println!("{friction}  | {displacement}");
        failed += u32::from(!friction.passes()) + u32::from(!displacement.passes());
    }
    println!("do the elastic slips matter? friction with gamma_crit halved and with the stick slope doubled:");
    let halved = slide_ours(&finger, 0.5 * gamma);
    let doubled = slide_peer(&case, &finger, 2.0 * slope, limit);
    for (k, s) in SLIDES_MM.iter().enumerate() {
        let change = |new: &[SlidePoint], old: &[SlidePoint]| 100.0 * (new[k].friction_n / old[k].friction_n - 1.0);
        println!("{s:>8.2}  ours {:+.3} %   peer {:+.3} %", change(&halved, &ours), change(&doubled, &peer));
    }
    println!("\n{}", if failed == 0 { "all rows pass".to_owned() } else { format!("{failed} rows fail") });
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
