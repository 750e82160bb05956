//! What must not depend on numerics, and the energy balance, on the coarse shape A with fixed bone.

use fingerpad_fe::load_path::{BoneKind, Finger, LoadSettings, Problem, Trajectory};
use fingerpad_fe::mesh::MeshPreset;

use super::{Effort, Failure};
use crate::{
    Check,
    problems::fingers::{at_corner, finger, follow, placed, problem},
};

const DEPTH_MM: f64 = 1.0;
const SLIDES: usize = 15;

fn coarse() -> Result<Finger, Failure> {
    finger("a", MeshPreset::Coarse, BoneKind::Fixed, 1.0)
}

/// Press in steps of 0.25 mm, slide in steps of 0.2 mm.
fn press_and_slide(problem: &Problem) -> Result<Trajectory, Failure> {
    let mut corners: Vec<[f64; 3]> = (0..=4).map(|k| [0.25 * DEPTH_MM * k as f64, 0.0, 0.0]).collect();
    corners.extend((1..=SLIDES).map(|k| [DEPTH_MM, 0.2 * k as f64, 0.0]));
    Ok(follow(problem, &placed(&corners))?)
}

/// Largest relative change of friction over the slide.
fn friction_change(a: &Trajectory, b: &Trajectory) -> f64 {
    let friction = |t: &Trajectory, k: usize| at_corner(t, k).friction_x_n;
    (5..5 + SLIDES).map(|k| (friction(a, k) / friction(b, k) - 1.0).abs()).fold(0.0, f64::max)
}

/// Largest relative change of normal force over press and slide.
fn normal_change(a: &Trajectory, b: &Trajectory) -> f64 {
    let normal = |t: &Trajectory, k: usize| at_corner(t, k).normal_force_n;
    (1..5 + SLIDES).map(|k| (normal(a, k) / normal(b, k) - 1.0).abs()).fold(0.0, f64::max)
}

/// Increments a quarter as large, with the default penalty and (in full) ten times it.
pub fn step_size(effort: Effort) -> Result<Vec<Check>, Failure> {
    let finger = coarse()?;
    let mut checks = Vec::new();
    let factors: &[f64] = if effort == Effort::Quick { &[1.0] } else { &[1.0, 10.0] };
    let bound = 0.005;
    for &factor in factors {
        let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
        problem.penalty.penalty_mpa_per_mm *= factor;
        let name = |what: &str| format!("relative change of {what}, penalty {}", problem.penalty.penalty_mpa_per_mm);
        let whole = press_and_slide(&problem)?;
        let load_steps = LoadSettings {
            max_depth_step_with_friction_mm: 0.25 * problem.load_steps.max_depth_step_with_friction_mm,
            max_slide_step_mm: 0.25 * problem.load_steps.max_slide_step_mm,
            ..problem.load_steps
        };
        let quarter = press_and_slide(&Problem { load_steps, ..problem.clone() })?;
        checks.push(Check::at_most(name("friction over s"), friction_change(&whole, &quarter), bound));
        checks.push(Check::at_most(name("normal force"), normal_change(&whole, &quarter), bound));
        checks.push(Check::told("increments", whole.cost.increments.into()));
        checks.push(Check::told("increments, finer", quarter.cost.increments.into()));
    }
    Ok(checks)
}

/// Penalty ten times as large; penetration.
pub fn penalty(_: Effort) -> Result<Vec<Check>, Failure> {
    let finger = coarse()?;
    let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
    let default = press_and_slide(&problem)?;
    problem.penalty.penalty_mpa_per_mm *= 10.0;
    let stiff = press_and_slide(&problem)?;
    problem.penalty.penalty_mpa_per_mm *= 0.01;
    let soft = press_and_slide(&problem)?;
    Ok(vec![
        Check::at_most("largest relative change of normal force, penalty x10", normal_change(&stiff, &default), 0.005),
        Check::told("largest relative change of friction, penalty x10", friction_change(&stiff, &default)),
        Check::at_most("largest penetration, default penalty (mm)", default.cost.max_penetration_mm, 1e-3),
        Check::at_most("largest penetration, penalty x10 (mm)", stiff.cost.max_penetration_mm, 1e-3),
        Check::at_most("largest penetration, penalty x0.1, augmented (mm)", soft.cost.max_penetration_mm, 1e-3),
        Check::told("relative change of normal force, penalty x0.1", normal_change(&soft, &default)),
    ])
}

/// Regularisation pressure a tenth.
pub fn regularisation(_: Effort) -> Result<Vec<Check>, Failure> {
    let finger = coarse()?;
    let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
    let default = press_and_slide(&problem)?;
    let mut law = problem.friction.ok_or("friction is on")?;
    law.regular_pressure_mpa *= 0.1;
    problem.friction = Some(law);
    let changed = press_and_slide(&problem)?;
    Ok(vec![Check::at_most(
        "largest relative change of friction, regular pressure x0.1",
        friction_change(&changed, &default),
        0.002,
    )])
}

/// Closed paths from air to air: the plane cannot gain more than the elastic slip stores.
pub fn loops(_: Effort) -> Result<Vec<Check>, Failure> {
    let finger = coarse()?;
    let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
    let air = -0.2;
    let paths: [(&str, &[[f64; 3]]); 5] = [
        ("press, lift", &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [air, 0.0, 0.0]]),
        ("tiny slide", &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.05, 0.0], [1.0, 0.0, 0.0], [air, 0.0, 0.0]]),
        ("slide, lift, back", &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [air, 2.0, 0.0], [air, 0.0, 0.0]]),
        (
            "reversal",
            &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, -1.0, 0.0], [1.0, 0.0, 0.0], [air, 0.0, 0.0]],
        ),
        ("skew", &[[air, 0.0, 0.0], [0.5, 0.5, 0.5], [1.0, 1.0, -1.0], [0.4, -1.0, 0.0], [air, 0.0, 0.0]]),
    ];
    let gamma = problem.friction.ok_or("friction is on")?.gamma_crit_mm;
    // The work is a trapezoidal sum; over the default increments its own error is larger than the bound.
    problem.load_steps.max_depth_step_with_friction_mm = 0.0625;
    problem.load_steps.max_slide_step_mm *= 0.25;
    let mut checks = Vec::new();
    for (name, corners) in paths {
        let run = follow(&problem, &placed(corners))?;
        // Friction never exceeds the sum of the strengths, so this bound is on the strict side.
        let peak = run.responses.iter().map(|r| r.friction_x_n.hypot(r.friction_y_n)).fold(0.0, f64::max);
        let work = run.work;
        checks.push(Check::at_least(format!("{name}: work of the plane (mJ)"), work.plane_mj, -0.5 * gamma * peak));
        checks.push(Check::at_least(
            format!("{name}: smallest dissipation (MPa mm)"),
            run.cost.min_dissipation_mj,
            0.0,
        ));
        checks.push(Check::told(format!("{name}: dissipated by slip (mJ)"), work.friction_mj));
    }
    Ok(checks)
}
