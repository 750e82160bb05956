//! Responses and fields of a state.

use fingerpad::{Regime, Status};

use super::{FaceState, Response, Snapshot};
use crate::assembly::Body;
use crate::contact::PointState;
use crate::solve::{Solver, State};

/// The row of a state.
pub(super) fn response(solver: &Solver, state: &State, t_s: f64, status: Status) -> Response {
    let totals = &state.totals;
    let [slide_x_mm, slide_y_mm, depth_mm] = state.contact.plane;
    let contact_area_mm2 = solver.surface().contact_areas(&state.contact).iter().map(|a| a[0]).sum();
    let in_contact = totals.area > 0.0;
    let stick_ratio = if in_contact { totals.stuck_area / totals.area } else { 0.0 };
    let centre = |k: usize| if in_contact { totals.pressure_moment[k] / totals.force.z } else { f64::NAN };
    Response {
        t_s,
        depth_mm,
        slide_x_mm,
        slide_y_mm,
        normal_force_n: totals.force.z,
        friction_x_n: totals.force.x,
        friction_y_n: totals.force.y,
        contact_area_mm2,
        stick_ratio,
        regime: Regime::classify(in_contact, stick_ratio as f32),
        status,
        centre_of_pressure_mm: [centre(0), centre(1)],
    }
}

/// The field of a state.
pub(super) fn snapshot(body: &Body, solver: &Solver, state: &State, response: Response) -> Snapshot {
    let areas = solver.surface().contact_areas(&state.contact);
    let per_face = solver.surface().points_per_face();
    let faces = state
        .contact
        .points
        .chunks(per_face)
        .zip(areas)
        .map(|(points, [inside, whole])| {
            let area: f64 = points.iter().map(|p| p.area).sum();
            let mean = |value: &dyn Fn(&PointState) -> f64| {
                if area > 0.0 { points.iter().map(|p| p.area * value(p)).sum::<f64>() / area } else { 0.0 }
            };
            let over_face = if whole > 0.0 { area / whole } else { 0.0 };
            FaceState {
                pressure_mpa: mean(&|p| p.pressure) * over_face,
                traction_mpa: [mean(&|p| p.traction[0]) * over_face, mean(&|p| p.traction[1]) * over_face],
                slip_mm: [mean(&|p| p.slip[0]), mean(&|p| p.slip[1])],
                contact_fraction: if whole > 0.0 { inside / whole } else { 0.0 },
                stick_fraction: mean(&|p| f64::from(u8::from(p.stuck))),
            }
        })
        .collect();
    let undeformed = &body.undeformed().x;
    Snapshot {
        response,
        displacement_mm: state.configuration.x.iter().zip(undeformed).map(|(x, x0)| x - x0).collect(),
        faces,
        strain_energy_density_mpa: body.energy(&state.configuration).1,
        stresses: body.stresses(&state.configuration),
    }
}
