//! Makes the hidden sets of `tests/data/fe_sets`: strokes of the finite-element finger with an effect in its law.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use cpu_time::ThreadTime;
use fingerpad_diagnose::RunSet;
use fingerpad_fe::load_path::Problem;
use fingerpad_tests::synthetic_truth::effects::Effect;
use fingerpad_tests::synthetic_truth::fe_sets::config;
use fingerpad_tests::synthetic_truth::laboratory::Noise;
use fingerpad_tests::synthetic_truth::protocol::{self, Plan};
use fingerpad_tests::synthetic_truth::sets::record;
use fingerpad_tests::synthetic_truth::{Random, csv, fe};

#[derive(Parser)]
#[command(about = "Hidden sets from the finite-element finger", name = "make_fe_sets")]
struct Args {
    /// Folder to write to
    #[arg(long, default_value = "tests/data/fe_sets")]
    out: PathBuf,
    /// Strokes of a set
    #[arg(long, default_value_t = 18)]
    strokes: usize,
    /// Rows of a stroke
    #[arg(long, default_value_t = 24)]
    rows: usize,
    /// Seed
    #[arg(long, default_value_t = 2026)]
    seed: u64,
    /// Threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Factor on noise and scatter; 0 shows the error of the baseline's form
    #[arg(long, default_value_t = 1.0)]
    noise: f64,
    /// Only the first sets of the list, beside the calibrations
    #[arg(long, default_value_t = HIDDEN.len())]
    sets: usize,
}

/// Shapes of the fingers, none of them the shipped model's.
const SHAPES: [&str; 2] = ["b", "d"];

/// A law, its amplitude and shape; 10 to 30 % of the force.
const HIDDEN: [(&str, f64, [f64; 2]); 20] = [
    ("", 0.0, [0.0, 0.0]),
    ("", 0.0, [0.0, 0.0]),
    ("hydration_bell", 0.35, [55.0, 15.0]),
    ("speed_log", 0.06, [0.0, 0.0]),
    ("speed_stribeck", 0.35, [5.0, 0.0]),
    ("viscous_drag", 0.005, [0.0, 0.0]),
    ("anisotropy", 0.15, [35.0, 0.0]),
    ("normal_relaxation", 0.2, [1.4, 0.0]),
    ("contact_ageing", 0.15, [0.3, 0.8]),
    ("static_peak", 0.3, [0.8, 0.0]),
    ("occlusion_growth", 0.4, [20.0, 0.0]),
    ("adhesion", 0.03, [0.0, 0.0]),
    ("depth_zero_offset", 0.08, [0.0, 0.0]),
    ("tare_bias", 0.03, [-0.8, 0.6]),
    ("cross_talk", 0.08, [-0.7, 0.0]),
    ("stiffness_drift", -1.0, [0.0, 0.0]),
    ("subject_size", 1.5, [0.0, 0.0]),
    ("strain_stiffening", 0.4, [0.0, 0.0]),
    ("temperature", -0.04, [0.0, 0.0]),
    ("periodic_texture", 0.25, [1.6, 1.0]),
];

fn write(out: &Path, name: &str, set: &RunSet) -> Result<(), std::io::Error> {
    let file = std::fs::File::create(out.join(name))?;
    let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::best());
    encoder.write_all(csv::text(set).as_bytes())?;
    encoder.finish()?.sync_all()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    std::fs::create_dir_all(&args.out)?;
    let fingers = SHAPES.map(|s| config(s).finger().expect("a shape of the program").0);
    let problems: Vec<Problem<'_>> = SHAPES.iter().zip(&fingers).map(|(s, f)| config(s).problem(f)).collect();
    let noise = Noise {
        additive_n: 0.003 * args.noise,
        multiplicative: 0.015 * args.noise,
        gain: [0.015 * args.noise; 2],
        depth_mm: 0.008 * args.noise,
        offset_n: 0.002 * args.noise,
        hydration_au: 2.0 * args.noise,
        ..Noise::default()
    };
    let jobs = SHAPES.len() + args.sets.min(HIDDEN.len());
    let (next, cpu_s) = (AtomicUsize::new(0), Mutex::new(0.0));
    let truth = Mutex::new(vec![serde_json::Value::Null; HIDDEN.len()]);
    std::thread::scope(|scope| {
        for _ in 0..args.threads {
            scope.spawn(|| {
                let clock = ThreadTime::now();
                loop {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    if job >= jobs {
                        break;
                    }
                    let mut random = Random::new(args.seed + job as u64);
                    let (shape, name, plans, effects): (usize, String, Vec<Plan>, Vec<Effect>) = if job < SHAPES.len() {
                        let plans = protocol::calibration(args.strokes, &mut random);
                        (job, format!("calibration_{}.csv.gz", SHAPES[job]), plans, Vec::new())
                    } else {
                        let index = job - SHAPES.len();
                        let (law, amplitude, form) = HIDDEN[index];
                        let shape = index % SHAPES.len();
                        let effects = (!law.is_empty())
                            .then_some(Effect { name: law, amplitude, shape: form, form: 1.0 })
                            .into_iter()
                            .collect();
                        let file = format!("set_{index:02}.csv.gz");
                        truth.lock().expect("no thread panics with it")[index] = serde_json::json!({
                            "file": file,
                            "calibration": format!("calibration_{}.csv.gz", SHAPES[shape]),
                            "shape": SHAPES[shape],
                            "law": law,
                            "amplitude": amplitude,
                            "form": form,
                        });
                        (shape, file, protocol::measured(args.strokes, 0, &mut random), effects)
                    };
                    let strokes = protocol::strokes(&plans, args.rows);
                    let set = record(&strokes, &noise, &mut random, "run", None, &mut |stroke, scatter| {
                        fe::readings(&problems[shape], stroke, &effects, scatter).expect("the finger slides")
                    });
                    write(&args.out, &name, &set).expect("the folder can be written to");
                    eprintln!("{name}: {:.0} s CPU of this thread", clock.elapsed().as_secs_f64());
                }
                *cpu_s.lock().expect("no thread panics with it") += clock.elapsed().as_secs_f64();
            });
        }
    });
    let hashes: Vec<_> = SHAPES.iter().map(|s| (s.to_string(), config(s).hash().expect("no file").into())).collect();
    let out = serde_json::json!({
        "command": format!(
            "cargo run --release -p fingerpad-tests --bin make_fe_sets -- --strokes {} --rows {} --seed {}",
            args.strokes, args.rows, args.seed
        ),
        "settings_hash": serde_json::Value::Object(hashes.into_iter().collect()),
        "cpu_s": cpu_s.into_inner()?,
        "sets": truth.into_inner()?,
    });
    std::fs::write(args.out.join("truth.json"), serde_json::to_string_pretty(&out)? + "\n")?;
    Ok(())
}
