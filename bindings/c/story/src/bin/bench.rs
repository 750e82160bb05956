//! Nanoseconds of a step in Rust, and the paths over which every binding's own program is timed.
//!
//! `bench paths MODEL.fpm FOLDER` writes `clean.txt` and `disturbed.txt` (depth, slide x, slide y, spin; one step a line).
//! `bench one MODEL.fpm < path` and `bench batch MODEL.fpm < path` print `call ns` lines, the least of twenty rounds: one contact
//! after the other, and 4096 in a batch, each of them elsewhere on the path.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use fingerpad::host::{Forces, ModelFile, Motions};
use fingerpad::{Model, Motion, Regime, SPRINGS, StateOf, Status, step};

#[path = "../paths.rs"]
#[allow(dead_code)]
mod paths;
#[path = "../requests.rs"]
#[allow(dead_code)]
mod requests;

type Failure = Box<dyn std::error::Error>;

const DT_S: f32 = 1e-3;
const ROUNDS: usize = 20;
const CONTACTS: usize = 4096;
/// Rounds over the whole path and steps of each round of a batch, which has many contacts to average over.
const BATCH: (usize, usize) = (5, 400);
/// The clean path is a short one.
const REPEATED: usize = 14;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let [what, model, ref rest @ ..] = words[..] else {
        return Err("usage: bench paths|one|batch MODEL.fpm [FOLDER]".into());
    };
    let file = ModelFile::new(&std::fs::read(model)?)?;
    let model = &file.file().model;
    match (what, rest) {
        ("paths", [folder]) => write_paths(Path::new(folder)),
        ("one", []) => {
            let path = read_path()?;
            println!("step {:.2}", one_ns::<1>(model, &path, 0.0));
            println!("spin_step {:.2}", one_ns::<2>(model, &path, 1.0));
            Ok(())
        }
        ("batch", []) => {
            let path = read_path()?;
            println!("step {:.2}", batch_ns::<1>(model, &path)?);
            println!("spin_step {:.2}", batch_ns::<2>(model, &path)?);
            Ok(())
        }
        _ => Err(format!("not understood: {words:?}").into()),
    }
}

fn write_paths(folder: &Path) -> Result<(), Failure> {
    let clean: Vec<requests::Request> = (0..REPEATED).flat_map(|_| paths::clean_story()).collect();
    for (name, requests) in [("clean.txt", clean), ("disturbed.txt", paths::disturbed_story())] {
        let mut text = String::new();
        for request in requests {
            let requests::Request::Step([depth_mm, x, y, spin, dt_s]) = request else { continue };
            // A motion that is not a number is rare in use and has a path of its own through the step.
            let usual = depth_mm.abs() < 5.0 && x.abs() < 1.0 && y.abs() < 1.0 && spin.abs() < 1.0 && dt_s > 0.0;
            if usual {
                writeln!(text, "{depth_mm} {x} {y} {spin}")?;
            }
        }
        std::fs::write(folder.join(name), text)?;
    }
    Ok(())
}

/// Depth, slide x, slide y, spin of each step.
fn read_path() -> Result<Vec<[f32; 4]>, Failure> {
    let row = |line: &str| {
        let numbers = line.split(' ').map(str::parse).collect::<Result<Vec<f32>, _>>()?;
        numbers.try_into().map_err(|_| format!("not four numbers: {line}").into())
    };
    std::io::read_to_string(std::io::stdin())?.lines().map(row).collect()
}

/// Least time of a step, ns; `turning` multiplies the spin.
fn one_ns<const P: usize>(model: &Model<'_>, path: &[[f32; 4]], turning: f32) -> f64 {
    let motion = |&[depth_mm, x, y, spin]: &[f32; 4]| Motion {
        depth_mm,
        slide_increment_mm: [x, y],
        spin_increment_rad: turning * spin,
        dt_s: DT_S,
    };
    let motions: Vec<Motion> = path.iter().map(motion).collect();
    let mut least_s = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut state = StateOf::<SPRINGS, P>::default();
        let start = Instant::now();
        for motion in &motions {
            black_box(step(black_box(model), &mut state, *motion));
        }
        least_s = least_s.min(start.elapsed().as_secs_f64());
    }
    1e9 * least_s / motions.len() as f64
}

/// Least time of a contact's step in a batch, ns. Contact `i` begins at row 17 i of the path.
fn batch_ns<const P: usize>(model: &Model<'_>, path: &[[f32; 4]]) -> Result<f64, Failure> {
    let column =
        |k: usize, row: usize| (0..CONTACTS).map(move |i| path[(row + 17 * i) % path.len()][k]).collect::<Vec<f32>>();
    let (rounds, steps) = BATCH;
    let motions: Vec<[Vec<f32>; 4]> = (0..steps).map(|row| std::array::from_fn(|k| column(k, row))).collect();
    let mut numbers = std::array::from_fn::<_, 6, _>(|_| vec![0.0; CONTACTS]);
    let (mut regime, mut status) = (vec![Regime::NoContact; CONTACTS], vec![Status::OK; CONTACTS]);
    let mut least_s = f64::INFINITY;
    for _ in 0..rounds {
        let mut states = vec![StateOf::<SPRINGS, P>::default(); CONTACTS];
        let start = Instant::now();
        for [depth_mm, slide_x_mm, slide_y_mm, spin_rad] in &motions {
            let spin_rad = if P > 1 { &spin_rad[..] } else { &[] };
            let motions = Motions { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s: DT_S };
            let mut forces = Forces::of(numbers.each_mut().map(|of_kind| &mut of_kind[..]), &mut regime, &mut status);
            model.step_batch(&mut states, motions, &mut forces)?;
        }
        least_s = least_s.min(start.elapsed().as_secs_f64());
    }
    Ok(1e9 * least_s / (CONTACTS * steps) as f64)
}
