//! Cases with a closed form: Hertz, Cattaneo-Mindlin, full slip.

use fingerpad_fe::contact::{Friction, NodeState, PenaltySettings, Plane, RigidBody, RubberFriction, plane::DEPTH};
use fingerpad_fe::solve::{Solver, State};

use super::{Effort, Failure};
use crate::{
    Check,
    half_space::{Mindlin, PointLoads},
    problems::sphere::{Elements, Layout, Part, Sphere},
};

/// Contact radius over curvature is 1/500: strains of 0.2 %.
const CURVATURE_MM: f64 = 500.0;

/// Hertz: force, radius and peak pressure at a prescribed approach.
pub fn hertz(effort: Effort) -> Result<Vec<Check>, Failure> {
    // The area depends on the edge between two nodes; forces do not.
    let meshes: &[(Elements, usize, [f64; 2])] = match effort {
        Effort::Quick => &[(Elements::Hexes, 10, [0.005, 0.02]), (Elements::Tets, 10, [0.01, 0.02])],
        Effort::Full => &[
            (Elements::Hexes, 20, [0.005, 0.01]),
            (Elements::Tets, 20, [0.01, 0.01]),
            (Elements::Hexes, 32, [0.005, 0.007]),
        ],
    };
    let mut checks = Vec::new();
    for &(elements, per_radius, [bound, area_bound]) in meshes {
        let growth = if elements == Elements::Hexes { 1.2 } else { 1.35 };
        let layout = Layout { elements, part: Part::Quarter, per_radius, extent: 4.0, growth };
        let sphere = Sphere::new(&layout, 0.4, CURVATURE_MM)?;
        let label = |what: &str| format!("{what}, {elements:?}, a/h {per_radius}, {} nodes", sphere.mesh.nodes.len());
        let mut solver = sphere.solver(sphere.penalty(1e-3));
        let state = sphere.press(&mut solver)?;
        let [force, radius] = against_hertz(&sphere, &solver, &state, label, [bound, area_bound], &mut checks);
        if per_radius == meshes[0].1 {
            let mut soft = sphere.solver(sphere.penalty(2e-3));
            let force_soft = sphere.copies * sphere.press(&mut soft)?.totals.force.z;
            checks.push(Check::relative(label("force at half the penalty (N)"), force_soft, force, 0.003));
            for factor in [0.75, 1.25] {
                let penalty = sphere.penalty(1e-3);
                let edge_constant = factor * penalty.edge_constant;
                let mut solver = sphere.solver(PenaltySettings { edge_constant, ..penalty });
                let state = sphere.press(&mut solver)?;
                let changed = (sphere.area_radius_mm(&solver, &state) / radius).powi(2);
                let quantity = label(&format!("area, edge constant {edge_constant} over the default's"));
                checks.push(Check::relative(quantity, changed, 1.0, 0.025));
            }
        }
    }
    Ok(checks)
}

/// Checks of force, radius of the contact and peak pressure; returns the force, N, and the radius, mm.
fn against_hertz(
    sphere: &Sphere,
    solver: &Solver,
    state: &State,
    label: impl Fn(&str) -> String,
    [bound, area_bound]: [f64; 2],
    checks: &mut Vec<Check>,
) -> [f64; 2] {
    let hertz = &sphere.hertz;
    let peak = state.contact.nodes.iter().map(NodeState::pressure_mpa).fold(0.0, f64::max);
    let force = sphere.copies * state.totals.force.z;
    let radius = sphere.area_radius_mm(solver, state);
    checks.push(Check::relative(label("force (N)"), force, hertz.force_n(), bound));
    checks.push(Check::relative(label("radius from area (mm)"), radius, hertz.radius_mm, area_bound));
    checks.push(Check::relative(label("peak pressure (MPa)"), peak, hertz.peak_mpa(), bound));
    [force, radius]
}

/// Hertz on curved rigid bodies: a half-space and a sphere on a sphere, crossed cylinders.
pub fn hertz_curved(effort: Effort) -> Result<Vec<Check>, Failure> {
    let (per_radius, [bound, area_bound]) =
        if effort == Effort::Quick { (10, [0.01, 0.02]) } else { (32, [0.005, 0.01]) };
    let layout = Layout { elements: Elements::Hexes, part: Part::Quarter, per_radius, extent: 4.0, growth: 1.2 };
    let mut checks = Vec::new();
    for (name, share, rigid) in [
        ("half-space on a sphere", [0.0, 0.0], RigidBody::Sphere { radius_mm: CURVATURE_MM }),
        (
            "sphere on a sphere of half its curvature",
            [2.0 / 3.0; 2],
            RigidBody::Sphere { radius_mm: 3.0 * CURVATURE_MM },
        ),
        ("sphere in a bowl of half its curvature", [2.0; 2], RigidBody::Sphere { radius_mm: -CURVATURE_MM }),
        ("crossed cylinders", [1.0, 0.0], RigidBody::Cylinder { radius_mm: CURVATURE_MM, axis_deg: 0.0 }),
        ("crossed cylinders, turned", [0.0, 1.0], RigidBody::Cylinder { radius_mm: CURVATURE_MM, axis_deg: 90.0 }),
    ] {
        let sphere = Sphere::sharing(&layout, 0.4, CURVATURE_MM, share)?;
        let mut solver = sphere.solver(sphere.penalty(1e-3));
        solver.set_rigid_body(rigid, None, &Plane::default());
        let state = sphere.press(&mut solver)?;
        let label = |what: &str| format!("{name}: {what}, a/h {per_radius}");
        against_hertz(&sphere, &solver, &state, label, [bound, area_bound], &mut checks);
    }
    Ok(checks)
}

/// Cattaneo-Mindlin and, back and forth, Mindlin-Deresiewicz: tangential force and stick radius over displacement at
/// constant approach.
pub fn mindlin(effort: Effort) -> Result<Vec<Check>, Failure> {
    if effort == Effort::Quick {
        let mut checks = mindlin_on(Elements::Hexes, 8, [0.03, 0.005, 0.02])?;
        checks.extend(mindlin_on(Elements::Tets, 8, [0.05, 0.02, 0.06])?);
        return Ok(checks);
    }
    let mut checks = mindlin_on(Elements::Hexes, 24, [0.01, 0.005, 0.01])?;
    checks.extend(mindlin_on(Elements::Tets, 16, [0.03, 0.02, 0.03])?);
    checks.extend(mindlin_on(Elements::Hexes, 32, [0.01, 0.005, 0.01])?);
    Ok(checks)
}

/// Turns of the path over the slide to full slip: up to 0.8, back to -0.4, forth and on to 0.9.
fn swings() -> Vec<Vec<f64>> {
    let first = [0.02, 0.1, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8].map(|s| vec![s]);
    let back = [0.6, 0.4, 0.2, -0.1, -0.4].map(|s| vec![0.8, s]);
    let forth = [0.0, 0.2, 0.6].map(|s| vec![0.8, -0.4, s]);
    [&first[..], &back, &forth, &[vec![0.9]]].concat()
}

fn mindlin_on(
    elements: Elements,
    per_radius: usize,
    [compliance_bound, force_bound, radius_bound]: [f64; 3],
) -> Result<Vec<Check>, Failure> {
    let layout = Layout { elements, part: Part::Half, per_radius, extent: 4.0, growth: 1.3 };
    let sphere = Sphere::new(&layout, 0.499, CURVATURE_MM)?;
    let label = |what: String| format!("{what}, {elements:?}, a/h {per_radius}");
    let mindlin = Mindlin { hertz: sphere.hertz, mu: 0.5 };
    let mut solver = sphere.solver(sphere.penalty(1e-3));
    let mut state = sphere.press(&mut solver)?;
    let force = sphere.copies * state.totals.force.z;
    let exact = sphere.hertz.force_n();
    let mut checks = vec![Check::relative(label("normal force (N)".into()), force, exact, compliance_bound)];
    let law = RubberFriction::coulomb(mindlin.mu, 1e-3 * mindlin.full_slip_mm());
    solver.set_friction(Friction::On(law));
    let depth = state.contact.plane.at[DEPTH];
    for shares in swings() {
        let turns: Vec<f64> = shares.iter().map(|share| share * mindlin.full_slip_mm()).collect();
        let s = turns[turns.len() - 1];
        let loads = PointLoads::mindlin(&mindlin, &turns);
        state = sphere.step(&mut solver, &state, [s, 0.0, depth, 0.0, 0.0, 0.0], &loads)?;
        let tangential = sphere.copies * state.totals.force.x;
        if shares == [0.02] {
            let reference = mindlin.force_n(&turns);
            checks.push(Check::relative(
                label("compliance s/Q (mm/N)".into()),
                s / tangential,
                s / reference,
                compliance_bound,
            ));
            continue;
        }
        let way = shares.iter().map(|s| s.to_string()).collect::<Vec<_>>().join(" to ");
        checks.push(Check::absolute(
            label(format!("Q/(mu P) at s/s_full {way}")),
            tangential / (mindlin.mu * force),
            mindlin.force_n(&turns) / mindlin.limit_n(),
            force_bound,
        ));
        let quantity = label(format!("stick radius (mm, a = 1) at s/s_full {way}"));
        let (ours, exact) = (sphere.stick_radius_mm(&state), mindlin.stick_radius_mm(&turns));
        checks.push(Check::absolute(quantity, ours, exact, radius_bound));
    }
    Ok(checks)
}

/// Full slip: the friction force is the integral of the law over the Hertz pressure.
pub fn full_slip(effort: Effort) -> Result<Vec<Check>, Failure> {
    let (per_radius, bound) = if effort == Effort::Quick { (10, 0.02) } else { (16, 0.01) };
    let layout = Layout { elements: Elements::Hexes, part: Part::Half, per_radius, extent: 4.0, growth: 1.3 };
    let sphere = Sphere::new(&layout, 0.499, CURVATURE_MM)?;
    let (a, p0, beta) = (sphere.hertz.radius_mm, sphere.hertz.peak_mpa(), 0.46);
    // Largest strength 0.005 G.
    let lambda = 0.005 / p0.powf(beta);
    let law =
        RubberFriction { lambda, beta, gamma_crit_mm: 1e-4, regular_pressure_mpa: 1e-3 * p0, ..Default::default() };
    let mut solver = sphere.solver(sphere.penalty(1e-3));
    let mut state = sphere.press(&mut solver)?;
    solver.set_friction(Friction::On(law));
    let depth = state.contact.plane.at[DEPTH];
    let loads = PointLoads::hertz(&sphere.hertz)
        .disc(a, |r| [lambda * p0.powf(beta) * (1.0 - (r / a).powi(2)).max(0.0).powf(0.5 * beta), 0.0, 0.0]);
    for s in [0.002, 0.004, 0.006, 0.008] {
        state = sphere.step(&mut solver, &state, [s, 0.0, depth, 0.0, 0.0, 0.0], &loads)?;
    }
    let exact = 2.0 * std::f64::consts::PI * a * a * lambda * p0.powf(beta) / (beta + 2.0);
    Ok(vec![
        Check::relative("quadrature of the far field against the closed integral", loads.force_n().x, exact, 1e-6),
        Check::at_most("stuck area (mm²)", state.totals.stuck_area, 0.0),
        Check::relative(format!("friction (N), a/h {per_radius}"), sphere.copies * state.totals.force.x, exact, bound),
    ])
}
