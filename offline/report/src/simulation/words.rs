//! Sentences about a run along a path.

use fingerpad::{Regime, Status};

use super::{Marks, SimulationReport};
use crate::numbers::{fixed, significant};
use fingerpad_fe::load_path::Response;

fn friction(r: &Response) -> f64 {
    r.friction_x_n.hypot(r.friction_y_n)
}

/// Row with the largest value.
fn largest(rows: &[Response], of: impl Fn(&Response) -> f64) -> Option<&Response> {
    rows.iter().filter(|r| of(r).is_finite()).max_by(|a, b| of(a).total_cmp(&of(b)))
}

/// The first sentences of the page: the main events of the run.
pub fn verdict(rows: &[Response]) -> String {
    let Some(first) = rows.iter().find(|r| r.regime != Regime::NoContact) else {
        return "The body never touches the finger on this path.".to_owned();
    };
    let mut text = format!("The body touches after {} s.", fixed(first.t_s, 2));
    if let Some(r) = largest(rows, |r| r.normal_force_n) {
        text += &format!(
            " The largest normal force is {} N, at {} s, depth {} mm, with {} mm² of contact.",
            significant(r.normal_force_n, 3),
            fixed(r.t_s, 2),
            fixed(r.depth_mm, 3),
            fixed(r.contact_area_mm2, 1)
        );
    }
    if let Some(r) = largest(rows, friction).filter(|r| friction(r) > 0.0) {
        text += &format!(
            " The largest friction is {} N, at {} s, {} times the normal force there.",
            significant(friction(r), 3),
            fixed(r.t_s, 2),
            fixed(friction(r) / r.normal_force_n, 2)
        );
    }
    text += &match rows.iter().find(|r| r.regime == Regime::Slip) {
        Some(r) => format!(" All of the contact slips first at {} s.", fixed(r.t_s, 2)),
        None => " There is never full slip: some of the contact always sticks.".to_owned(),
    };
    text
}

/// Warnings for users of the numbers.
pub fn warnings(report: &SimulationReport) -> Vec<String> {
    let rows = &report.trajectory.responses;
    let mut found: Vec<String> = Vec::new();
    if let Some(reason) = &report.ended_early {
        found.push(format!("The run ended before its path did, and the page shows the rows up to there: {reason}"));
    }
    for check in report.checks.iter().filter(|c| !c.passed) {
        found.push(format!(
            "A check failed: {} is {} {} (bound {}).",
            check.name,
            significant(check.value, 3),
            check.unit,
            significant(check.bound, 3)
        ));
    }
    let stabilised: Vec<_> = rows.iter().filter(|r| r.status.contains(Status::STABILISED)).collect();
    if let Some(first) = stabilised.first() {
        found.push(format!(
            "{} of {} rows, the first at {} s, passed a limit point with viscous stabilisation: the finger snapped there, \
             and its way through is not quasi-static.",
            stabilised.len(),
            rows.len(),
            fixed(first.t_s, 3)
        ));
    }
    if rows.iter().all(|r| r.regime == Regime::NoContact) {
        found.push("No row touches. depth_mm counts from first touch into the finger.".to_owned());
    }
    if report.provenance.mesh_preset == "coarse" {
        found.push("The coarse mesh is for trying; results are for the default one.".to_owned());
    }
    found
}

/// The figure along the path.
pub fn along_caption(marks: &Marks) -> String {
    let mut text =
        "Forces are those that the body exerts on the finger; friction points along the body's motion. Shades are \
                    the regimes: stick where at least 0.99 of the contact sticks, full slip where at most 0.01 does."
            .to_owned();
    if !marks.0.is_empty() {
        text += " Letters mark the rows whose contact is drawn below.";
    }
    text
}

/// The figure of loops.
pub fn loops_caption() -> String {
    "Arrows show the direction of the path. The areas inside the loops of all panels together are the work that the \
     path costs; a way back that lies on the way there costs none."
        .to_owned()
}

/// The maps of all rows.
pub const MAPS: &str = "Faces of the pad at their current places, seen along the normal at the body's apex, x from proximal to distal; a \
    face that touches in part is paler. Slip is how far the body has gone ahead of the skin since the face came into contact; \
    traction is what the body exerts on the skin; their arrows are as long as the values are large. The scales are those of \
    all rows.";
