//! Nanoseconds of a step in Rust over the disturbed path, and that path for the bindings' own programs: `bench MODEL.fpm PATH`
//! writes PATH (depth, slide x, slide y, spin; one step a line) and prints `call ns` lines, the least of twenty rounds.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use fingerpad::{Model, ModelFile, Motion, StateOf, step};

#[path = "../paths.rs"]
#[allow(dead_code)]
mod paths;
#[path = "../told.rs"]
#[allow(dead_code)]
mod told;

const ROUNDS: usize = 20;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, path] = &arguments[..] else { return Err("usage: bench MODEL.fpm PATH".into()) };
    let file = ModelFile::new(&std::fs::read(model)?)?;
    let motions: Vec<Motion> = paths::disturbed_story(&file)
        .iter()
        .filter_map(|request| match *request {
            told::Request::Step([depth_mm, x, y, spin_increment_rad, dt_s]) => {
                Some(Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s })
            }
            _ => None,
        })
        // What is no number is rare in use and has a path of its own through the step.
        .filter(|m| m.depth_mm.abs() < 5.0 && m.slide_increment_mm.iter().all(|x| x.abs() < 1.0))
        .filter(|m| m.spin_increment_rad.abs() < 1.0 && m.dt_s > 0.0)
        .collect();
    let mut text = String::new();
    for m in &motions {
        let [x, y] = m.slide_increment_mm;
        writeln!(text, "{} {x} {y} {}", m.depth_mm, m.spin_increment_rad)?;
    }
    std::fs::write(path, text)?;
    let plain: Vec<Motion> = motions.iter().map(|m| Motion { spin_increment_rad: 0.0, ..*m }).collect();
    println!("step {:.2}", least_ns::<1>(&file.file().model, &plain));
    println!("spin_step {:.2}", least_ns::<2>(&file.file().model, &motions));
    Ok(())
}

fn least_ns<const P: usize>(model: &Model<'_>, motions: &[Motion]) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut state = StateOf::<{ fingerpad::SPRINGS }, P>::default();
        let start = Instant::now();
        for motion in motions {
            black_box(step(black_box(model), &mut state, *motion));
        }
        least = least.min(start.elapsed().as_secs_f64());
    }
    1e9 * least / motions.len() as f64
}
