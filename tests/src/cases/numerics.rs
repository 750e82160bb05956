//! Results that must not depend on numerics, and the energy balance, on the coarse shape A with fixed bone.

use fingerpad_fe::contact::RigidBody;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{BoneKind, Finger, LoadSettings, MeshError, Problem, Response, Trajectory, face_mm};
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
    // The shear after a press has an error of first order in its increments, which matters over the first slide, of 0.2
    // mm.
    let bound = 0.006;
    for &factor in factors {
        let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
        problem.penalty.penalty_mpa_per_mm *= factor;
        let name = |what: &str| format!("relative change of {what}, penalty {}", problem.penalty.penalty_mpa_per_mm);
        let whole = press_and_slide(&problem)?;
        let slides_finer =
            LoadSettings { max_slide_step_mm: 0.25 * problem.load_steps.max_slide_step_mm, ..problem.load_steps };
        let all_finer = LoadSettings {
            max_depth_step_with_friction_mm: 0.25 * problem.load_steps.max_depth_step_with_friction_mm,
            ..slides_finer
        };
        let with = |load_steps| press_and_slide(&Problem { load_steps, ..problem.clone() });
        let (slides, quarter) = (with(slides_finer)?, with(all_finer)?);
        let by_slides = friction_change(&whole, &slides);
        checks.push(Check::at_most(name("friction over s, slides alone finer"), by_slides, 0.001));
        checks.push(Check::at_most(name("friction over s"), friction_change(&whole, &quarter), bound));
        checks.push(Check::at_most(name("normal force"), normal_change(&whole, &quarter), bound));
        checks.push(Check::reported("increments", whole.cost.increments.into()));
        checks.push(Check::reported("increments, finer", quarter.cost.increments.into()));
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
        Check::reported("largest relative change of friction, penalty x10", friction_change(&stiff, &default)),
        Check::at_most("largest penetration, default penalty (mm)", default.cost.max_penetration_mm, 1e-3),
        Check::at_most("largest penetration, penalty x10 (mm)", stiff.cost.max_penetration_mm, 1e-3),
        Check::at_most("largest penetration, penalty x0.1, augmented (mm)", soft.cost.max_penetration_mm, 1e-3),
        Check::reported("relative change of normal force, penalty x0.1", normal_change(&soft, &default)),
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

/// Work that the plane puts in over the increments in which it puts in any, mJ.
fn put_in_mj(run: &Trajectory) -> f64 {
    let force = |r: &Response| [r.normal_force_n, r.friction_x_n, r.friction_y_n];
    let place = |r: &Response| [r.depth_mm, r.slide_x_mm, r.slide_y_mm];
    let step = |pair: &[Response]| -> f64 {
        let (a, b) = (&pair[0], &pair[1]);
        (0..3).map(|k| 0.5 * (force(a)[k] + force(b)[k]) * (place(b)[k] - place(a)[k])).sum()
    };
    run.responses.windows(2).map(step).filter(|work| *work > 0.0).sum()
}

/// Closed paths from air to air: slip dissipates the net work of the plane.
pub fn loops(effort: Effort) -> Result<Vec<Check>, Failure> {
    let finger = coarse()?;
    let mut problem = problem(&finger.body, &finger.mesh.pad_faces);
    problem.half = finger.half.as_ref();
    let air = -0.2;
    let paths: [(&str, f64, &[[f64; 3]]); 5] = [
        ("press, lift", 0.0, &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [air, 0.0, 0.0]]),
        ("tiny slide", 0.0, &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.05, 0.0], [1.0, 0.0, 0.0], [air, 0.0, 0.0]]),
        (
            "slide, lift, back",
            0.3,
            &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [air, 2.0, 0.0], [air, 0.0, 0.0]],
        ),
        (
            "reversal",
            0.3,
            &[[air, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 3.0, 0.0], [1.0, -2.0, 0.0], [1.0, 0.0, 0.0], [air, 0.0, 0.0]],
        ),
        ("skew", 0.05, &[[air, 0.0, 0.0], [0.5, 0.5, 0.5], [1.0, 1.0, -1.0], [0.4, -1.0, 0.0], [air, 0.0, 0.0]]),
    ];
    // The work is a trapezoidal sum; over the default increments its own error is larger than the bound.
    let finer = if effort == Effort::Quick { 4.0 } else { 8.0 };
    problem.load_steps.max_depth_step_with_friction_mm = 0.25 / finer;
    problem.load_steps.max_slide_step_mm /= finer;
    problem.load_steps.max_steady_slide_step_mm = problem.load_steps.max_slide_step_mm;
    let mut checks = Vec::new();
    for (name, least, corners) in paths {
        let run = follow(&problem, &placed(corners))?;
        let (work, put_in) = (run.work, put_in_mj(&run));
        let balance = work.plane_mj + work.pressure_mj - work.friction_mj - work.stabilisation_mj;
        checks.extend([
            Check::absolute(
                format!("{name}: work less dissipation, over the work put in"),
                balance / put_in,
                0.0,
                0.005,
            ),
            Check::at_least(format!("{name}: dissipated, over the work put in"), work.friction_mj / put_in, least),
            Check::at_least(format!("{name}: smallest dissipation (mJ)"), run.cost.min_dissipation_mj, 0.0),
            Check::reported(format!("{name}: work put in (mJ)"), put_in),
            Check::reported(format!("{name}: put into elastic slip by pressure, over it"), work.pressure_mj / put_in),
        ]);
    }
    Ok(checks)
}

/// Under Coulomb's law every force scales with the stiffness: to the penetration that is allowed where the penalty stays as it is, and
/// better in fingers so soft that it scales with them. A press after a lift converges to a tight tolerance, down to the rounding of the
/// residual.
pub fn scales(_: Effort) -> Result<Vec<Check>, Failure> {
    let run = |stiffness: f64, tolerance: f64| -> Result<Trajectory, Failure> {
        let mut config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
        config.tissue.stiffen(stiffness);
        (config.friction.lambda, config.friction.beta) = (0.5, 1.0);
        config.numerics.solver.tolerance = tolerance;
        let finger = config.finger()?.0;
        let again = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-0.2, 1.0, 0.0], [1.0, 1.0, 0.0]];
        Ok(follow(&config.problem(&finger), &placed(&again))?)
    };
    let usual = run(1.0, 1e-5)?;
    let apart = |run: &Trajectory, stiffness: f64| {
        let [normal, friction] = [1, 2, 4]
            .map(|k| {
                let (a, b) = (at_corner(run, k), at_corner(&usual, k));
                [a.normal_force_n / stiffness - b.normal_force_n, a.friction_x_n / stiffness - b.friction_x_n]
            })
            .into_iter()
            .fold([0.0f64; 2], |most, off| [0, 1].map(|k| most[k].max(off[k].abs())));
        normal.max(friction) / at_corner(&usual, 1).normal_force_n
    };
    let mut checks = Vec::new();
    for (stiffness, line) in [(0.01, 1e-5), (25.0, 1e-3)] {
        let off = apart(&run(stiffness, 1e-5)?, stiffness);
        checks.push(Check::at_most(format!("forces over stiffness, times {stiffness}"), off, line));
    }
    for tolerance in [1e-6, 1e-7] {
        let tight = run(1.0, tolerance)?;
        // Friction depends on the increments. The rounding of the processor may decide how many there are.
        let same = tight.responses.len() == usual.responses.len();
        let line = if same { 2e-5 } else { 1e-3 };
        checks.push(Check::at_most(format!("forces, tolerance {tolerance:e}"), apart(&tight, 1.0), line));
    }
    Ok(checks)
}

/// Errors of responses by their mesh against the bounds that are printed: medium against default on the plane, coarse against medium on
/// bodies. In nine of ten cases they hold, and half of the time they are at most four times too large.
pub fn mesh_errors(_: Effort) -> Result<Vec<Check>, Failure> {
    let corners = [[0.0; 3], [0.3, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 3.0, 0.0], [1.0, 3.0, 1.0]];
    let (plane, coarse, medium, default) =
        (RigidBody::Plane, MeshPreset::Coarse, MeshPreset::Medium, MeshPreset::Default);
    let mut parts = Vec::new();
    for (rigid_body, preset, finer) in [
        (plane.clone(), coarse, default),
        (plane, medium, default),
        (RigidBody::Sphere { radius_mm: 10.0 }, coarse, medium),
        (RigidBody::Cylinder { radius_mm: 8.0, axis_deg: 30.0 }, coarse, medium),
    ] {
        let run = |preset| -> Result<(Trajectory, Option<f64>), Failure> {
            let mut finger = Config { mesh_preset: preset, ..Config::default() }.finger()?.0;
            finger.rigid_body = rigid_body.clone();
            let size_mm = face_mm(&finger.mesh);
            Ok((follow(&Config::default().problem(&finger), &placed(&corners))?, size_mm))
        };
        let ((run, size_mm), (finer, _)) = (run(preset)?, run(finer)?);
        for k in 1..corners.len() {
            let (a, b) = (at_corner(&run, k), at_corner(&finer, k));
            let bound = MeshError::of(a, size_mm.ok_or("faces of four corners")?);
            let friction = |r: &Response| [r.friction_x_n, r.friction_y_n];
            let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let [mx, my, mz] = [0, 1, 2].map(|i| a.moment_n_mm[i] - b.moment_n_mm[i]);
            parts.extend([
                (a.normal_force_n - b.normal_force_n).abs() / bound.normal_force_n,
                apart(friction(a), friction(b)) / bound.friction_n,
                (a.contact_area_mm2 - b.contact_area_mm2).abs() / bound.contact_area_mm2,
                apart(a.centre_of_pressure_mm, b.centre_of_pressure_mm) / bound.centre_mm,
                mx.hypot(my) / bound.moment_n_mm,
            ]);
            if k > 2 {
                parts.extend([(a.stick_ratio - b.stick_ratio).abs() / bound.stick_ratio, mz.abs() / bound.moment_n_mm]);
            }
        }
    }
    parts.sort_by(f64::total_cmp);
    let beyond = parts.iter().filter(|part| **part > 1.0).count() as f64;
    Ok(vec![
        Check::reported("errors compared", parts.len() as f64),
        Check::at_most("share of errors beyond their bound", beyond / parts.len() as f64, 0.1),
        Check::at_least("median of the errors over their bound", parts[parts.len() / 2], 0.25),
    ])
}
