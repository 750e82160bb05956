//! A pad along a path of waypoints, driven by displacements or forces, in every pose and on every body.

use fingerpad::pad::{Body, Memory, Pad, PadState, RelaxingPadState, Surface};
use fingerpad::{Error, Motion, Response, Status};
use fingerpad_fe::load_path::{Drive, Path};

use super::MOST_PATCHES;
use crate::TrajectoryRow;
use crate::trajectory::{PathError, Place, Position, along, check_drives, in_time};

/// Largest number of iterations of a step that is driven by force.
const ITERATIONS: usize = 25;
/// Tolerance of the force: share of the largest prescribed force, and N.
const TOLERANCE: [f64; 2] = [2e-4, 2e-5];
/// Step of the finite differences of the force, mm.
const PROBE_MM: f64 = 2e-3;
/// Longest motion of an iteration, mm.
const LONGEST_MM: f64 = 0.2;

/// Simulates `path` in steps of at most 0.02 mm, 0.4° or 5 mN; returns a row at every waypoint and at every fifth step between.
///
/// * `body`: on a curved body the depth is that of the plane through its apex, from where this plane would first touch
///
/// Tissue that relaxes has more rows: in each segment they begin 1 ms apart and grow apart to a two-hundredth of it.
///
/// If a prescribed force cannot be reached, the row has the nearest state and a flag; if a pose is outside the range of the fit, the state
/// in the nearest pose and a flag.
///
/// # Errors
/// [`PathError`] for one slide driven by displacement and the other by force, for moments, and for a row that no finger can follow.
pub fn simulate_path_on_pad(pad: &Pad<'_>, body: &Body, path: &Path) -> Result<Vec<TrajectoryRow>, PathError> {
    check_drives(path)?;
    if let Some((k, problem)) = (0..path.waypoints.len()).find_map(|k| path.refused(k).map(|problem| (k, problem))) {
        return Err(PathError::Row { row: k + 1, problem });
    }
    let neutral = f64::from(pad.numbers.neutral_pitch_deg);
    let first = [&path.turns.pitch, &path.turns.roll].map(|turn| turn.as_ref().and_then(|t| t.values.first()).copied());
    let start = [first[0].unwrap_or(neutral) as f32, first[1].unwrap_or(0.0) as f32];
    let too_many =
        |e: Error| PathError::Row { row: 1, problem: format!("the pad has more than {MOST_PATCHES} patches: {e}") };
    if pad.relaxation().is_some() {
        let state = RelaxingPadState::<MOST_PATCHES>::relaxing_over(pad, start).map_err(too_many)?;
        return Ok(follow(pad, body, &in_time(path, &[]).0, state));
    }
    let state = if body.is_plane() { PadState::new(pad) } else { PadState::over(pad, start) };
    Ok(follow(pad, body, path, state.map_err(too_many)?))
}

/// The rows of a path from a state in the air.
fn follow<M: Memory<MOST_PATCHES, f32>>(
    pad: &Pad<'_>,
    body: &Body,
    path: &Path,
    mut state: PadState<MOST_PATCHES, f32, M>,
) -> Vec<TrajectoryRow> {
    let neutral = f64::from(pad.numbers.neutral_pitch_deg);
    let forced: Vec<usize> = (0..3).filter(|&k| path.drives[k] == Drive::Force).collect();
    along(path, neutral, &mut |Place { target, dt, .. }: Place, at: &mut Position| {
        let pose = [target[4] as f32, target[5] as f32];
        // Tries a step to a depth and slides, with the rotations of this step, from a copy of the state.
        let go = |to: [f64; 3]| {
            let mut state = state;
            let motion = Motion {
                depth_mm: to[0] as f32,
                slide_increment_mm: [(to[1] - at[1]) as f32, (to[2] - at[2]) as f32],
                spin_increment_rad: (target[3] - at[3]).to_radians() as f32,
                dt_s: dt.max(1e-6) as f32,
            };
            let response = pad.step(&mut state, body, motion, pose);
            (state, response)
        };
        let start: [f64; 3] = std::array::from_fn(|k| if forced.contains(&k) { at[k] } else { target[k] });
        let wanted: Vec<f64> = forced.iter().map(|&k| target[k]).collect();
        let (to, (next, response)) = reach_forces(go, start, &forced, &wanted);
        state = next;
        *at = [to[0], to[1], to[2], target[3], target[4], target[5]];
        response
    })
}

/// State and response at the end of a step.
type Stepped<M> = (PadState<MOST_PATCHES, f32, M>, Response);

/// Finds the depth and slides of a step at which the forces have their prescribed values, by Newton's method with finite differences.
/// Returns them with the result of the step; a flag marks forces that are not reached.
///
/// * `go`: makes the step to a depth and slides, mm
/// * `to`: depth and slides of the first attempt, mm
/// * `forced`: coordinates that are driven by force; without any the first attempt is returned
/// * `wanted`: prescribed forces of these coordinates, N
fn reach_forces<M>(
    go: impl Fn([f64; 3]) -> Stepped<M>,
    mut to: [f64; 3],
    forced: &[usize],
    wanted: &[f64],
) -> ([f64; 3], Stepped<M>) {
    let mut best = go(to);
    let tolerance = wanted.iter().fold(0.0, |most: f64, f| most.max(f.abs())) * TOLERANCE[0] + TOLERANCE[1];
    let missing = |r: &Response| -> Vec<f64> { forced.iter().zip(wanted).map(|(&k, w)| w - force(r, k)).collect() };
    let size = |m: &[f64]| m.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    for _ in 0..ITERATIONS {
        let missed = missing(&best.1);
        if size(&missed) <= tolerance {
            break;
        }
        let column = |&k: &usize| -> Vec<f64> {
            let mut probe = to;
            probe[k] += PROBE_MM;
            let left = missing(&go(probe).1);
            missed.iter().zip(&left).map(|(a, b)| (a - b) / PROBE_MM).collect()
        };
        let columns: Vec<Vec<f64>> = forced.iter().map(column).collect();
        let count = forced.len();
        let matrix = nalgebra::DMatrix::from_fn(count, count, |row, column| columns[column][row]);
        let change = matrix.lu().solve(&nalgebra::DVector::from_vec(missed.clone()));
        // A singular matrix: without contact the depth increases; in full slip a longer slide does not increase friction.
        let change = change.unwrap_or_else(|| {
            nalgebra::DVector::from_fn(count, |k, _| if forced[k] == 0 { 0.1 * missed[k].signum() } else { 0.0 })
        });
        let mut share = 1.0;
        let mut better = None;
        while share > 0.02 && better.is_none() {
            let mut next = to;
            for (change, &k) in change.iter().zip(forced) {
                next[k] += (share * change).clamp(-LONGEST_MM, LONGEST_MM);
            }
            let tried = go(next);
            let no_contact = size(&missing(&tried.1)) == size(&missed) && tried.1.normal_force_n == 0.0;
            if size(&missing(&tried.1)) < size(&missed) || no_contact {
                better = Some((next, tried));
            }
            share *= 0.4;
        }
        let Some((next, tried)) = better else { break };
        (to, best) = (next, tried);
    }
    if size(&missing(&best.1)) > tolerance {
        best.1.status = best.1.status.with(Status::LOAD_NOT_REACHED);
    }
    (to, best)
}

/// Component of the force that belongs to depth, slide x or slide y.
fn force(r: &Response, axis: usize) -> f64 {
    if axis == 0 { r.normal_force_n.into() } else { r.friction_n[axis - 1].into() }
}
