//! Branches of a finger's force from those of its tissue.
//!
//! Main function: [`branches_of_force`]. Uses fe.

use std::ops::ControlFlow;

use fingerpad::{Branch, Relaxation};
use fingerpad_fe::load_path::{self, Drive, Path, Problem, RunOptions, Waypoint};

use crate::{ReduceError, Tip};

/// Depth of the press that compares the forces, on a tip of the shipped finger's size, mm.
const DEPTH_MM: f64 = 1.0;
/// Time of a branch that never forgets, s: the press takes 1 s.
const NEVER_S: f32 = 1e5;

/// Branches with which the force of a finger relaxes whose tissue has the branches `tissue`.
///
/// A pad and a bed relax as a whole. In the finite elements pressure, nail, bone and its joint are elastic, so that the finger's force
/// relaxes by less than the tissue's shear stress.
///
/// Take the branches by falling time. In a press that is quick for the first k of them and slow for the others, the first k act and the
/// others have relaxed. Its force over that of relaxed tissue is 1 plus the first k shares of the force. The finite elements compute it with
/// one branch that never forgets and has the first k shares of the tissue.
///
/// * `problem`: the finger on a plane; its own branches do not count
///
/// # Errors
/// [`ReduceError::Model`] for shares above 100 in all, [`ReduceError::Fit`] for a press without equilibrium.
pub fn branches_of_force(problem: &Problem, tip: &Tip, tissue: &Relaxation) -> Result<Relaxation, ReduceError> {
    let mut branches: Vec<Branch> = tissue.branches().iter().copied().filter(|branch| branch.share > 0.0).collect();
    branches.sort_by(|a, b| b.time_s.total_cmp(&a.time_s));
    let relaxed_n = force_n(problem, tip, 0.0)?;
    let (mut of_tissue, mut of_force) = (0.0, 0.0);
    for branch in &mut branches {
        of_tissue += branch.share;
        let share = (force_n(problem, tip, of_tissue)? / relaxed_n - 1.0) as f32;
        (branch.share, of_force) = (share - of_force, share);
    }
    branches.reverse();
    Ok(Relaxation::new(&branches)?)
}

/// Force of a press of tissue that is stiffer by a share of its relaxed stiffness, N.
fn force_n(problem: &Problem, tip: &Tip, share: f32) -> Result<f64, ReduceError> {
    let relaxation = Relaxation::new(&[Branch { share, time_s: NEVER_S }])?;
    let corner = |t_s, normal| Waypoint { t_s, normal, x: 0.0, y: 0.0 };
    let path = Path::new([Drive::Displacement; 3], vec![corner(0.0, 0.0), corner(1.0, DEPTH_MM * tip.length)]);
    let problem = Problem { relaxation, observed: None, ..problem.clone() };
    let end = load_path::follow(&problem, &path, RunOptions::default(), &mut |_| ControlFlow::Continue(()))
        .map_err(|e| ReduceError::Fit(format!("press of tissue that relaxes: {e}")))?;
    Ok(end.into_trajectory().responses.last().expect("the row of the depth").normal_force_n)
}
