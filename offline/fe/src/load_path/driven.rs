//! Increments with driven forces: a force has a place only where finger and body touch, so contact is made before the
//! coordinates are released to their forces.

use crate::contact::plane::DEPTH;
use crate::solve::{Axis, Guess, SolveError, Solver, State, Stats, Target, Watch};

/// Penetration at which contact is made before a normal force is sought, mm.
const FIRST_PENETRATION_MM: f64 = 0.02;

/// Motions towards the nearest point of a body before it counts as out of reach.
const APPROACHES: usize = 100;
/// Gap at which the nearest point counts as reached, mm.
const REACHED_MM: f64 = 1e-9;

/// Whether finger and body touch.
pub(super) fn touches(state: &State) -> bool {
    state.contact.nodes.iter().any(|node| node.normal_force_n > 0.0)
}

/// Equilibria on the way to a target, and whether coordinates driven by a force or moment are still held.
pub(super) struct Step {
    /// One, or up to three where contact is made first.
    pub states: Vec<State>,
    pub is_held: bool,
}

/// Steps from `last`, at which driven coordinates are held if `is_held` or if nothing touches, to `target`.
///
/// Without contact, coordinates driven by a force or moment are held: all but the depth until there is contact that can carry
/// them, the depth at first touch if its force presses. A state without contact fulfils no force, so that a body that leaves
/// the finger sideways is no equilibrium.
///
/// # Errors
/// As [`Solver::step`]; [`SolveError::OutOfContact`] where a body leaves the finger, or does not reach it.
pub(super) fn step(
    solver: &mut Solver,
    last: &State,
    is_held: bool,
    target: Target,
    guess: Guess,
    stats: &mut Stats,
    watch: Watch,
) -> Result<Step, SolveError> {
    if target.0.iter().all(|axis| matches!(axis, Axis::Displacement(_))) {
        return Ok(Step { states: vec![solver.step(last, target, guess, stats, watch)?], is_held: false });
    }
    if touches(last) && !is_held {
        let state = released(solver, last, target, guess, stats, watch)?;
        return Ok(Step { is_held: !touches(&state), states: vec![state] });
    }
    let pressed = held(last, target);
    let mut touched = pressed;
    let mut must_touch = false;
    if let Axis::Force(force) = target.0[DEPTH]
        && !touches(last)
    {
        let mut depth = last.contact.plane.at[DEPTH];
        must_touch = force != 0.0;
        if must_touch {
            depth = touching_depth_mm(solver, last).ok_or(SolveError::OutOfContact)? + FIRST_PENETRATION_MM;
        }
        touched.0[DEPTH] = Axis::Displacement(depth);
    }
    let mut states = vec![solver.step(last, touched, guess, stats, watch)?];
    match (touches(&states[0]), must_touch) {
        (true, _) => {}
        (false, true) => return Err(SolveError::OutOfContact),
        (false, false) => return Ok(Step { states, is_held: true }),
    }
    let mut done = touched;
    for next in [pressed, target] {
        if next != done {
            let from = states.last().expect("touched before");
            let guess = Guess { follows_plane: true, ..Guess::at(from) };
            match released(solver, from, next, guess, stats, watch) {
                Ok(state) => states.push(state),
                Err(SolveError::Interrupted) => return Err(SolveError::Interrupted),
                // A few points in contact resist no moment, and the top of a body no force: more of them may.
                Err(_) if done == pressed => return Ok(Step { states, is_held: true }),
                Err(error) => return Err(error),
            }
            done = next;
        }
    }
    Ok(Step { is_held: !states.last().is_some_and(touches), states })
}

/// An equilibrium at `target` after `last`, which touches.
fn released(
    solver: &mut Solver,
    last: &State,
    target: Target,
    guess: Guess,
    stats: &mut Stats,
    watch: Watch,
) -> Result<State, SolveError> {
    let next = solver.step(last, target, guess, stats, watch)?;
    let held = held(last, target);
    if touches(&next) || held == target {
        return Ok(next);
    }
    // A finger that is lifted leaves the body in any case.
    let lifted = solver.step(last, held, Guess::at(last), stats, watch)?;
    if touches(&lifted) { Err(SolveError::OutOfContact) } else { Ok(lifted) }
}

/// The target with the driven coordinates but the depth at their values of `last`.
fn held(last: &State, target: Target) -> Target {
    Target(std::array::from_fn(|k| match target.0[k] {
        Axis::Force(_) if k != DEPTH => Axis::Displacement(last.contact.plane.at[k]),
        axis => axis,
    }))
}

/// Depth at which the body meets the first of the finger's nodes, mm; None if it passes beside them all.
fn touching_depth_mm(solver: &Solver, last: &State) -> Option<f64> {
    let surface = solver.surface();
    let before = surface.frame(&last.contact.plane);
    let places: Vec<_> = last.contact.position.iter().map(|y| before.from_plane(y)).collect();
    let mut at = last.contact.plane.at;
    for _ in 0..APPROACHES {
        let frame = surface.frame(&last.contact.plane.moved_to(at));
        let gaps = places.iter().map(|x| surface.body().spot(&frame.to_plane(x)).gap_mm);
        let least = gaps.fold(f64::INFINITY, f64::min);
        at[DEPTH] += least;
        if least.abs() < REACHED_MM {
            return Some(at[DEPTH]);
        }
    }
    None
}
