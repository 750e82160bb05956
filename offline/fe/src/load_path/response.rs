//! Responses and fields of a state.

use fingerpad::{Regime, Status};
use nalgebra::Vector3;

use super::{FaceState, Model, Problem, Response, Snapshot};
use crate::assembly::TissueStep;
use crate::contact::{NodeState, plane};
use crate::solve::{Solver, State};

/// The row of a state.
pub(super) fn response(problem: &Problem, model: &Model, state: &State, t_s: f64, status: Status) -> Response {
    let copies = model.copies();
    let totals = &state.totals;
    let at = &state.contact.plane.at;
    let in_contact = totals.area > 0.0;
    let stick_ratio = if in_contact { totals.stuck_area / totals.area } else { 0.0 };
    let centre = |moment: f64| if in_contact { moment / totals.force.z } else { f64::NAN };
    // Forces along y, and moments about the other axes, of the two halves cancel.
    let across = |whole: f64| if model.half.is_some() { 0.0 } else { whole };
    Response {
        t_s,
        depth_mm: at[plane::DEPTH],
        slide_x_mm: at[plane::X],
        slide_y_mm: at[plane::Y],
        normal_force_n: copies * totals.force.z,
        friction_x_n: copies * totals.force.x,
        friction_y_n: across(totals.force.y),
        contact_area_mm2: copies * totals.area,
        stick_ratio,
        regime: Regime::classify(in_contact, stick_ratio as f32),
        status,
        centre_of_pressure_mm: [centre(-totals.moment.y), centre(across(totals.moment.x))],
        spin_deg: at[plane::SPIN].to_degrees(),
        pitch_deg: problem.neutral_pitch_deg + at[plane::PITCH].to_degrees(),
        roll_deg: at[plane::ROLL].to_degrees(),
        moment_n_mm: [across(totals.moment.x), copies * totals.moment.y, across(totals.moment.z)],
    }
}

/// The field of a state.
///
/// * `tissue`: the present stress of tissue that relaxes
pub(super) fn snapshot(
    model: &Model,
    solver: &Solver,
    state: &State,
    tissue: Option<&TissueStep>,
    response: Response,
) -> Snapshot {
    let faces = faces(solver, state);
    let undeformed = &model.body.undeformed().x;
    let field = Snapshot {
        response,
        displacement_mm: state.configuration.x.iter().zip(undeformed).map(|(x, x0)| x - x0).collect(),
        faces,
        strain_energy_density_mpa: model.body.energy(&state.configuration).1,
        stresses: model.body.stresses((&state.configuration, tissue)),
    };
    match model.half {
        Some(half) => half.whole(&field),
        None => field,
    }
}

/// The state of every face from that of its corners.
fn faces(solver: &Solver, state: &State) -> Vec<FaceState> {
    let surface = solver.surface();
    let nodes = &state.contact.nodes;
    let contact = surface.contact_areas(&state.contact);
    let stuck = surface.stuck_areas(solver.friction(), &state.contact);
    let frame = surface.frame(&state.contact.plane);
    // Each face carries a part of its corners' loads, in proportion to its part of the area around them.
    let mut around = vec![0.0; nodes.len()];
    for (facet, [_, whole]) in surface.facets.iter().zip(&contact) {
        let corners = facet.corners();
        corners.iter().for_each(|&n| around[n] += whole / corners.len() as f64);
    }
    let of_face = |((facet, &[inside, whole]), stuck): ((&crate::contact::Facet, &[f64; 2]), &f64)| {
        let corners = facet.corners();
        let mean = |value: &dyn Fn(&NodeState) -> f64| {
            let of_corner = |&n: &usize| if around[n] > 0.0 { value(&nodes[n]) / around[n] } else { 0.0 };
            corners.iter().map(of_corner).sum::<f64>() / corners.len() as f64
        };
        let touching: Vec<&NodeState> = corners.iter().map(|&n| &nodes[n]).filter(|n| n.normal_force_n > 0.0).collect();
        let slip = touching.iter().map(|n| n.slip).sum::<Vector3<f64>>() / touching.len().max(1) as f64;
        let traction = Vector3::from_fn(|k, _| mean(&|n| n.tangential_force_n[k]));
        FaceState {
            pressure_mpa: mean(&|n| n.normal_force_n),
            traction_mpa: frame.unspun(&traction),
            slip_mm: frame.unspun(&slip),
            contact_fraction: if whole > 0.0 { inside / whole } else { 0.0 },
            stick_fraction: if inside > 0.0 { (stuck / inside).min(1.0) } else { 0.0 },
        }
    };
    surface.facets.iter().zip(&contact).zip(&stuck).map(of_face).collect()
}
