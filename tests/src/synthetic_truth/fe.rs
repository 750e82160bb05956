//! Hidden effects inside the finite-element finger: its law of friction, its stiffness, its depth, its readings.
//!
//! The finger, its mesh and its contact are those of the program; what the effects do to them is written here from the
//! formulas of [`super::effects`], apart from the diagnosis.

use std::ops::ControlFlow;

use fingerpad::{Branch, Relaxation};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::load_path::{Drive, LoadPathError, Path, Problem, RunOptions, Waypoint, follow};

use super::effects::Effect;
use super::laboratory::Scatter;
use super::protocol::{Moment, Stroke};
use super::simulator::sensed;

/// Between two rows; what holds for the motion is that of the row at its end.
fn between(rows: &[Moment], t_s: f64) -> Moment {
    let next = rows.partition_point(|m| m.t_s < t_s).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[next - 1], &rows[next]);
    let share = ((t_s - a.t_s) / (b.t_s - a.t_s)).clamp(0.0, 1.0);
    let mix = |from: f64, to: f64| from + share * (to - from);
    let left = (1.0 - share) * (b.path_mm - a.path_mm);
    Moment {
        t_s,
        contact_s: mix(a.contact_s, b.contact_s),
        occlusion_s: mix(a.occlusion_s, b.occlusion_s),
        depth_mm: mix(a.depth_mm, b.depth_mm),
        path_mm: b.path_mm - left,
        turn_mm: b.turn_mm - left,
        position_mm: [0, 1].map(|k| mix(a.position_mm[k], b.position_mm[k])),
        ..*b
    }
}

/// Readings of the finite-element finger along a stroke: normal, x, y per row, N.
///
/// A relaxation by a fraction is that of its tissue: a branch, and the rest of the stiffness is 1 less the fraction.
///
/// # Errors
/// Those of the run along the path.
pub fn readings(
    problem: &Problem<'_>,
    stroke: &Stroke,
    effects: &[Effect],
    scatter: &Scatter,
) -> Result<Vec<[f64; 3]>, LoadPathError> {
    let (relaxing, effects): (Vec<_>, Vec<_>) =
        effects.iter().cloned().partition(|effect| effect.name == "normal_relaxation");
    let fraction: f64 = relaxing.iter().map(|effect| effect.amplitude).sum();
    let relaxed = 1.0 - fraction;
    let branch = |e: &Effect| Branch { share: (e.amplitude / relaxed) as f32, time_s: e.shape[0] as f32 };
    let branches: Vec<Branch> = relaxing.iter().map(branch).collect();
    let relaxation = Relaxation::new(&branches).expect("a fraction below 0.9");
    let (problem, effects) = (&Problem { relaxation, ..problem.clone() }, &effects);
    let rows = stroke.moments();
    let law = problem.friction.unwrap_or_default();
    let factors = |m: &Moment| {
        let i = m.influence(stroke, effects, f64::NAN);
        (i.strength * scatter.strength, i.stiffness * relaxed * scatter.stiffness)
    };
    let law_at = |t_s: f64| -> RubberFriction {
        let (strength, stiffness) = factors(&between(&rows, t_s));
        law.scaled(strength, stiffness)
    };
    let waypoints = rows
        .iter()
        .map(|m| {
            let more = m.influence(stroke, effects, f64::NAN).depth_mm + scatter.depth_mm;
            let depth = if m.depth_mm > 0.0 { m.depth_mm + more } else { m.depth_mm };
            Waypoint { t_s: m.t_s, normal: depth, x: m.position_mm[0], y: m.position_mm[1] }
        })
        .collect();
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let options = RunOptions { law_at: Some(&law_at), ..RunOptions::default() };
    let responses = follow(problem, &path, options, &mut |_| ControlFlow::Continue(()))?.into_trajectory().responses;
    Ok(rows
        .iter()
        .map(|m| {
            let r = responses.iter().rfind(|r| r.t_s == m.t_s).expect("a response at every corner");
            let i = m.influence(stroke, effects, f64::NAN);
            let (_, stiffness) = factors(m);
            let friction = [r.friction_x_n, r.friction_y_n].map(|f| f * stiffness);
            sensed(r.normal_force_n * stiffness, friction, r.contact_area_mm2, m, &i, scatter)
        })
        .collect())
}
