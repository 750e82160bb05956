//! The pad: errors along finite-element runs, memory, energy, steps, and what a step costs against the bed's.

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::pad::{Body, Pad, PadState, Plane};
use fingerpad::{Motion, SpinState, step};
use fingerpad_fe::contact::Outline;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::pad::{PadModel, PadScores, replay, score_depths, score_runs};
use fingerpad_reduce::{Kind, Run};
use fingerpad_tests::pads::{PATCHES, Ride, held_load, least_dissipations_f64};

#[derive(Parser)]
#[command(about = "The pad: errors along finite-element runs, memory, energy, steps, cost", name = "bench_pad")]
struct Args {
    /// Folder of runs
    #[arg(long, default_value = "data/runs")]
    runs: PathBuf,
    /// Model file of a pad
    #[arg(long, default_value = "data/models/fingertip-pad.fpm")]
    model: PathBuf,
    /// Kind of runs of which each has a line of its own
    #[arg(long, value_name = "KIND")]
    each: Option<String>,
    /// Name of a run: print its rows beside those of the pad, and nothing else
    #[arg(long, value_name = "RUN")]
    rows: Option<String>,
    /// Cycles of a held load
    #[arg(long, default_value_t = 1000)]
    cycles: usize,
    /// Closed paths that the search for a gain of work tries on all four bodies together
    #[arg(long, default_value_t = 500)]
    paths: usize,
}

/// Depths between which the rows of deep runs are scored, mm.
const DEPTHS_MM: [f64; 6] = [0.0, 1.5, 2.6, 3.6, 4.6, 5.3];

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args = Args::parse();
    let file = PadModelFile::new(&std::fs::read(&args.model)?)?;
    let pad = file.file().pad;
    println!(
        "{}: {} patches, {} bytes; memory of a contact {} bytes and {} a patch",
        args.model.display(),
        pad.patches.len(),
        file.bytes().len(),
        size_of::<PadState<0>>(),
        (size_of::<PadState<40>>() - size_of::<PadState<0>>()) / 40
    );
    let model = PadModel::of(&pad);
    if let Some(name) = &args.rows {
        return rows(&args, &model, name);
    }
    errors(&args, &model)?;
    memory(&pad, args.cycles)?;
    energy(&model.pad(), args.paths)?;
    steps(&model.pad())?;
    cost(&pad)
}

/// A line of the table of errors.
fn line(name: &str, s: &PadScores) -> String {
    format!(
        "{name:<22} {:>4} {:>7.2} {:>7.2} {:>7.2} {:>7.3} {:>7.3} {:>7.2} {:>7.2} {:>7.1} {:>7.1} {:>6.1}",
        s.runs,
        100.0 * s.normal,
        100.0 * s.friction,
        100.0 * s.friction_of_limit,
        s.stick,
        s.centre_mm,
        100.0 * s.moment,
        100.0 * s.area,
        100.0 * s.regime_right,
        100.0 * s.in_band[0],
        100.0 * s.in_band[1]
    )
}

/// Stored runs that `wanted` takes, by name, and the outline of their finger.
fn stored(args: &Args, wanted: impl Fn(&Run) -> bool) -> Result<(Vec<Run>, Outline), Failure> {
    let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
    let mut runs = Vec::new();
    for entry in std::fs::read_dir(&args.runs)? {
        let file = entry?.path();
        if file.extension().is_some_and(|e| e == "fprun") {
            let run = Run::from_bytes(&std::fs::read(&file)?, &file)?;
            if wanted(&run) && run.samples.len() > 3 {
                runs.push(run);
            }
        }
    }
    runs.sort_by(|a, b| a.name.cmp(&b.name));
    Ok((runs, config.finger()?.0.outline.ok_or("a smooth finger")?))
}

/// The rows of one run: motion, then the finite elements' and the pad's answers.
fn rows(args: &Args, model: &PadModel, name: &str) -> Result<(), Failure> {
    let (runs, outline) = stored(args, |run| run.name == name)?;
    let run = runs.first().ok_or_else(|| format!("no run `{name}` in {}", args.runs.display()))?;
    println!("{:?}", run.body);
    println!(
        "{:>6} {:>6} {:>6} {:>6} {:>6} {:>6} | {:>7} {:>7} {:>7} {:>7} {:>5} {:>5} | pad, limit last",
        "depth", "x mm", "y mm", "spin", "pitch", "roll", "N", "F x", "F y", "M z", "stick", "area"
    );
    for (s, a) in run.samples.iter().zip(replay(model, run, &outline)) {
        let [spin, pitch, roll, moment] =
            s.turned.map_or([0.0, 30.0, 0.0, 0.0], |t| [t.spin_deg, t.pitch_deg, t.roll_deg, t.moment_n_mm[2]]);
        println!(
            "{:>6.3} {:>6.2} {:>6.2} {spin:>6.2} {pitch:>6.2} {roll:>6.2} | {:>7.4} {:>7.4} {:>7.4} {moment:>7.3} {:>5.2} {:>5.0} | {:>7.4} {:>7.4} {:>7.4} {:>7.3} {:>5.2} {:>5.0} {:>7.4}",
            s.depth_mm,
            s.slide_mm[0],
            s.slide_mm[1],
            s.normal_force_n,
            s.friction_n[0],
            s.friction_n[1],
            s.stick_ratio,
            s.contact_area_mm2,
            a.normal_force_n,
            a.friction_n[0],
            a.friction_n[1],
            a.spin_moment_n_mm,
            a.stick_ratio,
            a.contact_area_mm2,
            a.friction_limit_n
        );
    }
    Ok(())
}

fn errors(args: &Args, model: &PadModel) -> Result<(), Failure> {
    let (runs, outline) = stored(args, |run| run.held_out)?;
    let law = Config::default().friction;
    println!(
        "\nerrors along held-out runs, RMS: normal force, friction over the path's largest and over the present limit,"
    );
    println!(
        "stick ratio, centre of pressure, moment over the largest friction times 3 mm, area; rows with the right regime;"
    );
    println!("rows within the bands of 95 %, normal force and friction");
    println!(
        "{:<22} {:>4} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>14}",
        "kind", "runs", "N %", "F %", "F lim %", "stick", "cop mm", "M %", "A %", "regime", "within bands"
    );
    for kind in Kind::ALL {
        let own: Vec<&Run> = runs.iter().filter(|r| r.kind == kind).collect();
        if own.is_empty() {
            continue;
        }
        println!("{}", line(kind.as_str(), &score_runs(model, &own, &outline, &law)));
        if args.each.as_deref() == Some(kind.as_str()) {
            for run in own {
                let name = format!("  {} {:?}", run.name, run.body.kind);
                println!("{}", line(&name, &score_runs(model, &[run], &outline, &law)));
            }
        }
    }
    let deep: Vec<&Run> = runs.iter().filter(|run| run.kind == Kind::Deep).collect();
    println!("\ndeep runs by depth: normal force over its own value (RMS and mean), friction over the path's largest");
    for range in DEPTHS_MM.windows(2).map(|pair| [pair[0], pair[1]]) {
        let s = score_depths(model, &deep, &outline, &law, range);
        println!(
            "{:.1} to {:.1} mm {:>6} rows {:>7.2} {:>+7.2} {:>7.2}",
            range[0],
            range[1],
            s.rows,
            100.0 * s.normal,
            100.0 * s.normal_mean,
            100.0 * s.friction
        );
    }
    Ok(())
}

/// What a held load keeps under cycles of everything, in single precision.
fn memory(pad: &Pad<'_>, cycles: usize) -> Result<(), Failure> {
    println!("\na load held at 1 mm, friction kept over that before, after 1, 10 and {cycles} cycles of 8 steps:");
    let rad = f64::to_radians;
    // Depth, slides, spin, pitch and roll: mm and rad.
    let cases: [(&str, [f64; 6]); 11] = [
        ("depth 1 um", [0.0, 0.0, 1e-3, 0.0, 0.0, 0.0]),
        ("depth 10 um", [0.0, 0.0, 1e-2, 0.0, 0.0, 0.0]),
        ("depth 100 um", [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]),
        ("slides 5 um", [5e-3, 5e-3, 0.0, 0.0, 0.0, 0.0]),
        ("poses 0.05 degrees", [0.0, 0.0, 0.0, 0.0, rad(0.05), rad(0.05)]),
        ("spin 0.6 degrees", [0.0, 0.0, 0.0, rad(0.6), 0.0, 0.0]),
        ("spin 3 degrees", [0.0, 0.0, 0.0, rad(3.0), 0.0, 0.0]),
        ("circle of 0.5 degrees", [0.0, 0.0, 0.0, 0.0, rad(0.5), rad(0.5)]),
        ("circle of 2 degrees", [0.0, 0.0, 0.0, 0.0, rad(2.0), rad(2.0)]),
        ("all, small", [5e-3, 5e-3, 1e-2, rad(0.6), rad(0.5), rad(0.5)]),
        ("all, large", [1e-2, 1e-2, 0.1, rad(3.0), rad(2.0), rad(2.0)]),
    ];
    for (name, size) in cases {
        let (after, _) = held_load(*pad, size, cycles)?;
        let length = |k: usize| after[k.min(cycles)][0].hypot(after[k.min(cycles)][1]);
        let kept = [1, 10, cycles].map(|k| length(k) / length(0));
        let kept: Vec<String> = kept.iter().map(|k| format!("{k:.4}")).collect();
        println!("{name:<24} {}", kept.join("  "));
    }
    Ok(())
}

/// Random closed paths in all six coordinates, the strength changing: work of the body over what goes in and out.
fn energy(pad: &Pad<'_, f64>, paths: usize) -> Result<(), Failure> {
    println!("\nleast dissipated share of the exchanged work, closed paths in six coordinates found by a search:");
    for (name, least) in least_dissipations_f64(*pad, paths, 40)? {
        println!("{name}: {least:+.1e}");
    }
    Ok(())
}

/// The same path in more and fewer steps, and a rest.
fn steps(pad: &Pad<'_, f64>) -> Result<(), Failure> {
    let corners = [
        [0.0, 0.0, 1.2, 0.0, 0.0, 0.0],
        [1.5, 0.5, 1.0, 0.1, 0.05, 0.0],
        [0.5, 1.5, 1.3, -0.1, 0.0, 0.08],
        [0.8, 1.0, 0.9, 0.0, -0.05, 0.05],
    ];
    let ends = |count: usize| -> Result<Vec<[f64; 3]>, Failure> {
        let mut ride = Ride::new(*pad, Body::Plane)?;
        Ok(corners
            .iter()
            .map(|corner| {
                ride.to(*corner, count);
                [ride.last.friction_n[0], ride.last.friction_n[1], ride.last.friction_limit_n]
            })
            .collect())
    };
    let fine = ends(10_000)?;
    println!("\nlargest change of friction over the limit at four corners against 10 000 steps a leg:");
    for count in [10, 100, 1000] {
        let off =
            ends(count)?.iter().zip(&fine).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) / b[2]).fold(0.0, f64::max);
        println!("{count:>5} steps: {:.2} %", 100.0 * off);
    }
    Ok(())
}

/// ns of a step, the bed and the pad in turns.
fn cost(pad: &Pad<'_>) -> Result<(), Failure> {
    let bed_file = ModelFile::new(&std::fs::read("data/models/fingertip.fpm")?)?;
    let bed = bed_file.file().model;
    let count = 20_000;
    let motion = |k: usize| {
        let t = k as f32 * 1e-3;
        Motion {
            depth_mm: 1.0 + 0.3 * (3.0 * t).sin(),
            slide_increment_mm: [0.02 * (2.0 * t).cos(), 0.01 * (1.3 * t).sin()],
            spin_increment_rad: 5e-4 * (1.7 * t).cos(),
            dt_s: 1e-3,
        }
    };
    let mut fastest = [f64::INFINITY; 2];
    for _ in 0..5 {
        let mut state = SpinState::default();
        let start = Instant::now();
        for k in 0..count {
            black_box(step(&bed, &mut state, motion(k)));
        }
        fastest[0] = fastest[0].min(start.elapsed().as_secs_f64());
        let mut state = PadState::<PATCHES>::new(pad)?;
        let start = Instant::now();
        for k in 0..count {
            black_box(pad.step(&mut state, &Plane, motion(k), [30.0, 0.0]));
        }
        fastest[1] = fastest[1].min(start.elapsed().as_secs_f64());
    }
    let ns = fastest.map(|s| 1e9 * s / count as f64);
    println!(
        "\na step of strokes with spin on one core: bed {:.0} ns, pad {:.0} ns, {:.0} times",
        ns[0],
        ns[1],
        ns[1] / ns[0]
    );
    Ok(())
}
