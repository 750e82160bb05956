//! The friction law in time: no creep under a constant load, elastic slip as a length of the law.

use fingerpad_fe::contact::{Friction, PenaltySettings, RubberFriction, plane::DEPTH};
use fingerpad_fe::load_path::{Drive, LoadSettings, Problem, Trajectory};
use fingerpad_fe::solve::{Axis, Guess, Solver, SolverSettings, State, Stats, unwatched};

use super::{Effort, Failure};
use crate::{
    Check,
    problems::dome::Dome,
    problems::fingers::{at_corner, follow, path, placed, problem},
};

const MU: f64 = 0.5;
/// Normal force on the half dome, N.
const HELD_N: f64 = 0.1;

/// A held load below the limit: the plane must not creep.
pub fn creep(effort: Effort) -> Result<Vec<Check>, Failure> {
    let dome = Dome::new(0.4)?;
    let (increments, perturbed) = if effort == Effort::Quick { (1000, 50) } else { (1000, 1000) };
    let law = RubberFriction::coulomb(MU, 0.006);
    let held = 0.8 * MU * HELD_N;
    let mut checks = Vec::new();

    let mut corners = vec![[0.0; 3], [HELD_N, 0.0, 0.0], [HELD_N, held, 0.0]];
    corners.extend(std::iter::repeat_n([HELD_N, held, 0.0], increments));
    let problem = Problem { friction: Some(law), ..problem(&dome.body, &dome.mesh.pad_faces) };
    let run = follow(&problem, &path([Drive::Force, Drive::Force, Drive::Displacement], &corners))?;
    let start = at_corner(&run, 2);
    let drift = |k: usize| {
        let now = at_corner(&run, k);
        (now.slide_x_mm - start.slide_x_mm).hypot(now.depth_mm - start.depth_mm)
    };
    checks.push(Check::relative("held friction over the limit", start.friction_x_n / (MU * HELD_N), 0.8, 1e-4));
    checks.push(Check::at_least("stuck part of the contact", start.stick_ratio, 0.01));
    let largest = (3..corners.len()).map(drift).fold(0.0, f64::max);
    checks.push(Check::at_most(format!("drift in {increments} increments (mm)"), largest, 1e-9));

    // The same with every increment solved again from a disturbed guess, at a tolerance that resolves the bound; with
    // the default penalty rounding alone leaves residuals of 1e-9.
    let settings = SolverSettings { tolerance: 3e-10, ..Default::default() };
    let penalty = PenaltySettings { augment: false, penalty_mpa_per_mm: 20.0, ..Default::default() };
    let mut solver = Solver::new(&dome.body, &dome.mesh.pad_faces, Friction::On(law), penalty, settings);
    let mut state = solver.initial_state([0.0; 3]);
    let step = |solver: &mut Solver, from: &State, [normal, load]: [f64; 2], noise: f64, seed: usize| {
        let mut guess = from.configuration.clone();
        for (n, x) in guess.x.iter_mut().enumerate() {
            if dome.body.dofs.node_dof(n as u32).is_some() {
                x.z += noise * ((n * 7919 + seed * 104_729) as f64).sin();
            }
        }
        let mut plane = from.contact.plane;
        if from.totals.force.z <= 0.0 {
            plane.at[DEPTH] += 0.02;
        }
        let target = [Axis::Force(load), Axis::Displacement(0.0), Axis::Force(normal)];
        let guess = Guess { configuration: guess, plane, follows_plane: false };
        solver.step(from, target, guess, &mut Stats::default(), &mut unwatched)
    };
    for share in [0.1, 0.3, 0.6, 1.0] {
        state = step(&mut solver, &state, [share * HELD_N, 0.0], 0.0, 0)?;
    }
    for share in [0.2, 0.4, 0.6, 0.7, 0.8] {
        state = step(&mut solver, &state, [HELD_N, share * MU * HELD_N], 0.0, 0)?;
    }
    let start = state.clone();
    let mut largest = 0.0f64;
    for seed in 0..perturbed {
        state = step(&mut solver, &state, [HELD_N, held], 1e-4, seed)?;
        let moved = |k: usize| state.contact.plane.at[k] - start.contact.plane.at[k];
        largest = largest.max(moved(0).hypot(moved(DEPTH)));
    }
    checks.push(Check::at_most(format!("drift in {perturbed} increments re-solved from noise (mm)"), largest, 1e-9));
    Ok(checks)
}

const DEPTH_MM: f64 = 0.6;
const GAMMA_MM: f64 = 0.006;

/// The elastic slip is a length of the law: it moves the onset of full slip by itself, and the mesh does not.
pub fn elastic_slip(effort: Effort) -> Result<Vec<Check>, Failure> {
    let size = if effort == Effort::Quick { 0.4 } else { 0.3 };
    let domes = [Dome::new(size)?, Dome::new(0.5 * size)?];
    let mut checks = Vec::new();
    const STEP_MM: f64 = 0.01;
    const STEPS: usize = 40;
    let run = |dome: &Dome, gamma_mm: f64, slides: &[f64]| {
        let mut corners = vec![[0.0; 3], [DEPTH_MM, 0.0, 0.0]];
        corners.extend(slides.iter().map(|&s| [DEPTH_MM, s, 0.0]));
        let load_steps = LoadSettings { friction_while_pressing: false, ..Default::default() };
        let friction = Some(RubberFriction::coulomb(0.2, gamma_mm));
        follow(&Problem { friction, load_steps, ..problem(&dome.body, &dome.mesh.pad_faces) }, &placed(&corners))
    };
    let grid: Vec<f64> = (1..=STEPS).map(|k| k as f64 * STEP_MM).collect();
    let coarse = [run(&domes[0], GAMMA_MM, &grid)?, run(&domes[0], 0.1 * GAMMA_MM, &grid)?];
    // Onset of full slip: the last sticking point slips; searched again in finer steps where the grid's steps find it.
    let onset = |on_grid: &Trajectory, gamma_mm: f64| -> Result<f64, Failure> {
        let first = (0..STEPS).find(|&k| at_corner(on_grid, k + 2).stick_ratio == 0.0).ok_or("no full slip")?;
        let mut slides: Vec<f64> = grid[..first].to_vec();
        let from = slides.last().copied().unwrap_or(0.0);
        slides.extend((1..=50).map(|k| from + STEP_MM * k as f64 / 50.0));
        let fine = run(&domes[0], gamma_mm, &slides)?;
        let k = (0..slides.len()).find(|&k| at_corner(&fine, k + 2).stick_ratio == 0.0).ok_or("no full slip")?;
        Ok(slides[k])
    };
    let shift = onset(&coarse[0], GAMMA_MM)? - onset(&coarse[1], 0.1 * GAMMA_MM)?;
    checks.push(Check::absolute("shift of full slip, gamma_crit less a tenth of it (mm)", shift, 0.9 * GAMMA_MM, 4e-4));

    let curves = [&coarse[0], &run(&domes[1], GAMMA_MM, &grid)?]
        .map(|run| (0..STEPS).map(|k| at_corner(run, k + 2).friction_x_n).collect::<Vec<f64>>());
    let relative = |mesh: usize, k: usize| curves[mesh][k] / curves[mesh][STEPS - 1];
    let largest = (0..STEPS).map(|k| (relative(0, k) - relative(1, k)).abs()).fold(0.0, f64::max);
    checks.push(Check::at_most(format!("largest change of F/F_limit over s, mesh {size} mm halved"), largest, 0.01));
    checks.push(Check::reported("limit force, coarse over fine", curves[0][STEPS - 1] / curves[1][STEPS - 1]));
    Ok(checks)
}
