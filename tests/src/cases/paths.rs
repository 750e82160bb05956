//! Paths that stall a naive Newton, and deep ones.

use fingerpad_fe::load_path::{BoneKind, Drive, Finger, Path, Problem, Trajectory};
use fingerpad_fe::mesh::MeshPreset;

use super::{Effort, Failure};
use crate::{
    Check,
    problems::fingers::{at_corner, finger, follow, path, placed, problem},
};

const D: Drive = Drive::Displacement;
const F: Drive = Drive::Force;

/// Paths of the issue with their names.
pub fn hard() -> Vec<(&'static str, Path)> {
    vec![
        ("-x", placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, -4.0, 0.0]])),
        ("+y", placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 4.0]])),
        (
            "square",
            placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 2.0], [1.0, 0.0, 2.0], [1.0, 0.0, 0.0]]),
        ),
        (
            "press-slide-lift-press",
            placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.5, 0.0], [-0.2, 1.5, 0.0], [1.0, 1.5, 0.0], [-0.2, 1.5, 0.0]]),
        ),
        ("0.3 N, slide", path([F, D, D], &[[0.0; 3], [0.3, 0.0, 0.0], [0.3, 4.0, 0.0]])),
        ("friction 0.3 N", path([D, F, D], &[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.3, 0.0], [1.0, 0.3, 0.0]])),
        ("three forces", path([F, F, F], &[[0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.3, 0.1]])),
        ("depth decreasing", placed(&[[0.0; 3], [1.5, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 1.0, 0.0]])),
        ("depth and slide", placed(&[[0.0; 3], [0.75, 0.0, 0.0], [1.25, 2.0, 0.0], [0.5, 3.0, 1.0], [1.0, 2.0, 0.0]])),
        ("reversal", placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 3.0, 0.0], [1.0, -3.0, 0.0]])),
    ]
}

/// All hard paths on the coarse shape E with floating bone.
pub fn hard_paths(_: Effort) -> Result<Vec<Check>, Failure> {
    let finger = finger("e", MeshPreset::Coarse, BoneKind::Floating, 1.0)?;
    let mut checks = Vec::new();
    for (name, path) in hard() {
        checks.extend(run(&finger, name, &path));
    }
    Ok(checks)
}

/// Cycles of the depth, 1 to 0.9 mm and back, after a slide of 0.5 mm: friction decreases where the rim opens, less in
/// each cycle.
pub fn depth_cycles(effort: Effort) -> Result<Vec<Check>, Failure> {
    const CYCLES: usize = 8;
    let preset = if effort == Effort::Quick { MeshPreset::Coarse } else { MeshPreset::Default };
    let mut checks = Vec::new();
    for (shape, bone) in [("e", BoneKind::Floating), ("a", BoneKind::Fixed)] {
        let finger = finger(shape, preset, bone, 1.0)?;
        let problem = Problem { half: finger.half.as_ref(), ..problem(&finger.body, &finger.mesh.pad_faces) };
        let mut corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.5, 0.0]];
        corners.extend((0..CYCLES).flat_map(|_| [[0.9, 0.5, 0.0], [1.0, 0.5, 0.0]]));
        let run = follow(&problem, &placed(&corners))?;
        let friction = |cycle: usize| at_corner(&run, 2 + 2 * cycle).friction_x_n;
        let name = |what: String| format!("{shape} {bone:?}, {preset:?}: {what}");
        checks.push(Check::reported(name("F before the cycles (N)".into()), friction(0)));
        for cycle in [1, 2, 4, 8] {
            checks.push(Check::reported(
                name(format!("F after {cycle} cycles over that before")),
                friction(cycle) / friction(0),
            ));
        }
        let lost = |from: usize, to: usize| (friction(from) - friction(to)) / friction(0);
        checks.push(Check::at_least(name("lost in the first cycle".into()), lost(0, 1), 0.0));
        let last = name("change in the last cycle, over that of the first".into());
        checks.push(Check::at_most(last, (lost(7, 8) / lost(0, 1)).abs(), 0.1));
    }
    Ok(checks)
}

/// 2.5 mm and 6 mm of slide, default mesh.
pub fn deep(_: Effort) -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    for (shape, bone, stiffness, depth) in
        [("a", BoneKind::Fixed, 1.0, 2.5), ("e", BoneKind::Floating, 1.0, 2.5), ("b", BoneKind::Fixed, 0.5, 1.5)]
    {
        let finger = finger(shape, MeshPreset::Default, bone, stiffness)?;
        let name = format!("{shape} {bone:?} x{stiffness} {depth} mm, {} nodes", finger.mesh.nodes.len());
        checks.extend(run(&finger, &name, &placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, 6.0, 0.0]])));
    }
    Ok(checks)
}

/// A slide that turns in full slip, on the medium mesh: friction must not vanish in any increment. Within one increment
/// it changes by no more than the sticking contact's stiffness times the displacement.
///
/// The contact opens for an iteration when the plane turns. When the parts of the contact area were held from there,
/// the search once ended in an equilibrium without friction.
pub fn turn_in_full_slip(_: Effort) -> Result<Vec<Check>, Failure> {
    let finger = finger("e", MeshPreset::Medium, BoneKind::Floating, 1.0)?;
    let turn = [0.556, 0.381, -2.267];
    let back = [0.556, 0.349, -2.075];
    let trajectory =
        follow(&problem(&finger.body, &finger.mesh.pad_faces), &placed(&[[0.0; 3], [0.556, 0.0, 0.0], turn, back]))?;
    let change = |pair: &[fingerpad_fe::load_path::Response]| {
        let [a, b] = pair else { return [0.0; 2] };
        let way = (b.slide_x_mm - a.slide_x_mm).hypot(b.slide_y_mm - a.slide_y_mm);
        [(b.friction_x_n - a.friction_x_n).hypot(b.friction_y_n - a.friction_y_n), way]
    };
    let slides: Vec<[f64; 2]> = trajectory.responses.windows(2).map(change).filter(|[_, way]| *way > 1e-3).collect();
    let stiffness = slides.first().map_or(0.0, |[force, way]| force / way);
    let steepest = slides.iter().map(|[force, way]| force / way).fold(0.0, f64::max);
    Ok(vec![
        Check::reported("stiffness at the first slide (N/mm)", stiffness),
        Check::at_most("largest change of friction over displacement (N/mm)", steepest, 1.2 * stiffness),
    ])
}

/// Convergence, tolerances and energy of one run.
fn run(finger: &Finger, name: &str, path: &Path) -> Vec<Check> {
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    let (trajectory, failure) = match follow(&problem, path) {
        Ok(trajectory) => (trajectory, None),
        Err(error) => (Trajectory::default(), Some(error)),
    };
    let mut checks = vec![Check::at_most(
        match &failure {
            None => format!("{name}: failures"),
            Some(error) => format!("{name}: {error}"),
        },
        f64::from(u8::from(failure.is_some())),
        0.0,
    )];
    if failure.is_some() {
        return checks;
    }
    let Trajectory { responses, cost, work, .. } = &trajectory;
    let end = responses.last().expect("the start is recorded");
    let peak = responses.iter().map(|r| r.friction_x_n.hypot(r.friction_y_n)).fold(0.0, f64::max);
    let gamma = problem.friction.map_or(0.0, |law| law.gamma_crit_mm);
    checks.extend([
        Check::at_most(format!("{name}: largest residual"), cost.max_residual, problem.settings.tolerance),
        Check::at_most(
            format!("{name}: largest penetration (mm)"),
            cost.max_penetration_mm,
            problem.penalty.penetration_tolerance_mm,
        ),
        Check::at_least(format!("{name}: smallest dissipation (mJ)"), cost.min_dissipation_mj, 0.0),
        Check::at_least(
            format!("{name}: work less slip's and stabilisation's (mJ)"),
            work.plane_mj + work.pressure_mj - work.friction_mj - work.stabilisation_mj,
            -0.5 * gamma * peak,
        ),
        Check::at_most(
            format!("{name}: work of stabilisation over that of the plane"),
            work.stabilisation_mj / work.plane_mj,
            0.01,
        ),
        Check::reported(format!("{name}: N at the end (N)"), end.normal_force_n),
        Check::reported(format!("{name}: friction at the end (N)"), end.friction_x_n.hypot(end.friction_y_n)),
        Check::reported(format!("{name}: increments"), cost.increments.into()),
        Check::reported(format!("{name}: cuts"), cost.cutbacks.into()),
        Check::reported(format!("{name}: CPU (s)"), cost.cpu_s),
    ]);
    checks
}
