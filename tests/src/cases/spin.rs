//! A sphere that spins on the plane: full, small and partial slip against closed forms.

use fingerpad_fe::contact::{Friction, FrictionLaw, RubberFriction, plane::DEPTH};
use fingerpad_fe::element::gauss_legendre;
use fingerpad_fe::solve::{Solver, State};

use super::{Effort, Failure};
use crate::{
    Check,
    half_space::{PointLoads, Torsion},
    problems::sphere::{Elements, Layout, Part, Sphere},
};

/// Contact radius over curvature is 1/500: strains of 0.2 %.
const CURVATURE_MM: f64 = 500.0;
/// Coefficient of friction.
const MU: f64 = 0.5;
/// Radii of the disc that sticks, over the contact's; in full slip a point at the centre is left.
const STICK: [f64; 4] = [0.9, 0.7, 0.5, 0.3];
const FULL: f64 = 0.01;
/// Share by which a small spin may be too stiff with five to ten faces to the radius, and with sixteen and more.
const SMALL_SPIN: [f64; 2] = [0.1, 0.02];

/// Moment over spin at constant approach under Coulomb's and the rubber law.
pub fn spin(effort: Effort) -> Result<Vec<Check>, Failure> {
    // Coulomb's limit is the normal force's; the rubber law depends on the edge, which lies between nodes.
    let meshes: &[(usize, [f64; 2])] =
        if effort == Effort::Quick { &[(6, [0.005, 0.02])] } else { &[(6, [0.005, 0.02]), (12, [0.01, 0.02])] };
    let mut checks = Vec::new();
    let mut rubber = Vec::new();
    for &(per_radius, bounds) in meshes {
        let (of_mesh, ratio) = on_mesh(&layout(per_radius), bounds[0], bounds[1])?;
        let named = |c: Check| Check { quantity: format!("{}, a/h {per_radius}", c.quantity), ..c };
        checks.extend(of_mesh.into_iter().map(named));
        rubber.push([1.0 / per_radius as f64, ratio]);
    }
    if effort == Effort::Full {
        checks.push(Check::relative(
            "rubber law: Mz over that of Hertz's contact, h to 0",
            at_zero(&rubber),
            1.0,
            0.01,
        ));
        checks.extend(small(&[5, 6, 7, 8, 9, 10, 16, 20, 24])?);
    } else {
        checks.extend(small(&[6])?);
    }
    Ok(checks)
}

fn layout(per_radius: usize) -> Layout {
    let (extent, growth) = if per_radius > 6 { (4.0, 1.4) } else { (3.0, 1.5) };
    Layout { part: Part::Whole, elements: Elements::Hexes, per_radius, extent, growth }
}

/// Value at 0 of the straight line that fits points (x, y) best.
fn at_zero(points: &[[f64; 2]]) -> f64 {
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(&|p| p[0]), mean(&|p| p[1]));
    y - x * mean(&|p| (p[0] - x) * (p[1] - y)) / mean(&|p| (p[0] - x).powi(2))
}

/// The checks of one mesh, and Mz in full spin under the rubber law over that of Hertz's contact.
fn on_mesh(layout: &Layout, force_bound: f64, slip_bound: f64) -> Result<(Vec<Check>, f64), Failure> {
    let sphere = Sphere::new(layout, 0.4, CURVATURE_MM)?;
    let mut solver = sphere.solver(sphere.penalty(1e-3));
    let pressed = sphere.press(&mut solver)?;
    let mut checks = vec![
        Check::relative("normal force (N)", pressed.totals.force.z, sphere.hertz.force_n(), force_bound),
        Check::reported("radius from area (mm)", sphere.area_radius_mm(&solver, &pressed)),
        Check::reported("nodes", sphere.mesh.nodes.len() as f64),
    ];
    checks.extend(coulomb(&sphere, &mut solver, &pressed, [force_bound, slip_bound])?);
    let (of_rubber, ratio) = rubber(&sphere, &mut solver, &pressed)?;
    checks.extend(of_rubber);
    Ok((checks, ratio))
}

/// The plane turned to `spin_rad` under the far field of `loads`.
fn turned(
    sphere: &Sphere,
    solver: &mut Solver,
    from: &State,
    spin_rad: f64,
    loads: &PointLoads,
) -> Result<State, Failure> {
    let to = [0.0, 0.0, from.contact.plane.at[DEPTH], spin_rad, 0.0, 0.0];
    Ok(sphere.step(solver, from, to, loads)?)
}

/// Everything sticks: 16 G a³/3 per radian. The traction is singular at the rim, so that the outermost nodes in contact
/// carry most of the moment: it is too stiff by an error in proportion to the face, varying with the position of the
/// rim between nodes.
fn small(per_radius: &[usize]) -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    let mut errors = Vec::new();
    for &per_radius in per_radius {
        let sphere = Sphere::new(&layout(per_radius), 0.4, CURVATURE_MM)?;
        let mut solver = sphere.solver(sphere.penalty(1e-3));
        let pressed = sphere.press(&mut solver)?;
        let (a, shear) = (sphere.hertz.radius_mm, sphere.hertz.half_space.shear_mpa);
        let turn = 1e-4;
        solver.set_friction(Friction::On(RubberFriction::coulomb(100.0, 1e-4)));
        let loads = PointLoads::hertz(&sphere.hertz)
            .disc(a, |r| [0.0, 4.0 / std::f64::consts::PI * shear * turn * r / (a * a - r * r).sqrt(), 0.0]);
        let state = turned(&sphere, &mut solver, &pressed, turn, &loads)?;
        let ratio = state.totals.moment.z / turn / (16.0 / 3.0 * shear * a.powi(3));
        let name = format!("small spin: Mz over that of a stuck disc, a/h {per_radius}");
        let bound = SMALL_SPIN[usize::from(per_radius >= 16)];
        checks.push(Check::absolute(name, ratio, 1.0, bound));
        errors.push([1.0 / per_radius as f64, ratio - 1.0]);
    }
    if per_radius.len() > 1 {
        let list = per_radius.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(", ");
        let name = format!("small spin: error for h to 0 by the line that fits a/h {list} best");
        checks.push(Check::reported(name, at_zero(&errors)));
    }
    Ok(checks)
}

/// Partial slip to full slip and back to where half of the radius sticks throughout the swing.
fn coulomb(sphere: &Sphere, solver: &mut Solver, pressed: &State, bounds: [f64; 2]) -> Result<Vec<Check>, Failure> {
    let torsion = Torsion { hertz: sphere.hertz, mu: MU };
    let limit = torsion.limit_nmm();
    let a = sphere.hertz.radius_mm;
    solver.set_friction(Friction::On(RubberFriction::coulomb(MU, 1e-3 * torsion.spin_rad(0.5 * a) * a)));
    let mut state = pressed.clone();
    let mut checks = Vec::new();
    for share in STICK {
        let stick = share * a;
        let loads = PointLoads::torsion(&torsion, stick);
        state = turned(sphere, solver, &state, torsion.spin_rad(stick), &loads)?;
        let name = |what: &str| format!("{what} where {share} of the radius sticks");
        let moment = state.totals.moment.z;
        checks.push(Check::absolute(
            name("Mz over its limit"),
            moment / limit,
            torsion.moment_nmm(stick) / limit,
            bounds[1],
        ));
        let radius = sphere.stick_radius_mm(&state);
        checks.push(Check::absolute(name("stick radius (mm, a = 1)"), radius, stick, bounds[1]));
    }
    let loads = PointLoads::torsion(&torsion, FULL * a);
    let state = turned(sphere, solver, &state, torsion.spin_rad(FULL * a), &loads)?;
    checks.push(Check::relative("full spin, Coulomb: Mz (N mm)", state.totals.moment.z, limit, bounds[0]));
    checks.push(Check::absolute("full spin: Fx (N)", state.totals.force.x, 0.0, 1e-3 * limit / a));
    Ok(checks)
}

/// Full spin under `lambda sigma^beta`: the integral of r times the law over the pressure.
fn rubber(sphere: &Sphere, solver: &mut Solver, pressed: &State) -> Result<(Vec<Check>, f64), Failure> {
    let (a, p0) = (sphere.hertz.radius_mm, sphere.hertz.peak_mpa());
    let coulomb = Torsion { hertz: sphere.hertz, mu: MU };
    let beta = 0.46;
    let law = RubberFriction {
        lambda: MU * p0.powf(1.0 - beta),
        beta,
        gamma_crit_mm: 1e-3 * coulomb.spin_rad(0.5 * a) * a,
        regular_pressure_mpa: 1e-3 * p0,
        ..Default::default()
    };
    solver.set_friction(Friction::On(law));
    let strength = |r: f64| law.strength(p0 * (1.0 - (r / a).powi(2)).max(0.0).sqrt()).0;
    let loads = PointLoads::hertz(&sphere.hertz).disc(a, |r| [0.0, strength(r), 0.0]);
    let mut state = pressed.clone();
    for share in [0.5, 1.0, 1.5, 2.0] {
        state = turned(sphere, solver, &state, share * coulomb.spin_rad(FULL * a), &loads)?;
    }
    // r = a sin(theta): the pressure is even in cos(theta).
    let exact: f64 = gauss_legendre(12)
        .into_iter()
        .map(|(x, weight)| {
            let theta = 0.25 * std::f64::consts::PI * (x + 1.0);
            let r = a * theta.sin();
            0.25 * std::f64::consts::PI * weight * a * theta.cos() * 2.0 * std::f64::consts::PI * r * r * strength(r)
        })
        .sum();
    let moment = state.totals.moment.z;
    let contact = state.contact.nodes.iter().zip(&state.contact.position);
    let own: f64 = contact.map(|(n, y)| n.area * y.xy().norm() * law.strength(n.pressure_mpa()).0).sum();
    let checks = vec![
        Check::relative("full spin, rubber law: Mz over the FE's pressure (N mm)", moment, own, 0.01),
        Check::reported("full spin, rubber law: Mz over that of Hertz's pressure", moment / exact),
        Check::at_most("full spin, rubber law: stuck area (mm²)", state.totals.stuck_area, 0.01 * state.totals.area),
    ];
    Ok((checks, moment / exact))
}
