//! The limit surface (friction along x and y, moment about the normal) of the default finger, by slides in every direction.

use std::f64::consts::FRAC_PI_6;
use std::ops::ControlFlow;

use fingerpad_fe::contact::{FrictionLaw, NodeState, RubberFriction};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{
    self, Drive, LoadPathError, LoadSettings, Path, PathEnd, Problem, RunOptions, Turn, Turns, Waypoint,
};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_fe::solve::State;
use nalgebra::{Rotation2, Vector2, Vector3};

use super::{Effort, Failure};
use crate::Check;

/// Arm by which a spin counts as travel, mm: about the moment's limit over friction's.
pub const ARM_MM: f64 = 3.0;
/// Travel along a direction over the depth, and the share of it after which nothing may change any more. The pulp
/// yields by some millimetres, and turns into the plane's direction over several times as many.
const TRAVEL_OVER_DEPTH: f64 = 40.0;
const STEADY_FROM: f64 = 0.9;

/// Distance from the pole, about which the plane turns, up to which it carries a node of the skin round instead of
/// passing it, mm: the skin's displacement under a node's strength. Friction there turns with the plane.
const CARRIED_MM: f64 = 0.1;

/// Where a slide in one direction ends.
#[derive(Clone, Copy, Debug)]
pub struct LimitPoint {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Friction along x and y (N) and moment about the plane's normal under first touch (N mm) in full slip, nodes at the
    /// pole left out.
    pub load: Vector3<f64>,
    /// The same at nine tenths of the path.
    pub earlier: Vector3<f64>,
    /// Load of the nodes at the pole, which the plane carries round.
    pub at_pole: Vector3<f64>,
    /// Integral of the law over the pressure of the slide, each point slipping as the rigid plane passes it.
    pub over_pressure: Vector3<f64>,
    /// Integral of the law over the pressure of the press without friction.
    pub over_press: Vector3<f64>,
    /// Stuck share of the area.
    pub stick_ratio: f64,
}

/// A fan of directions over half of the sphere of motions: slides to both sides, spin to one, from none to spin alone.
///
/// The finger is its own mirror image about y = 0, so that slide along y and spin of the other sign give the mirrored load.
pub fn fan(per_circle: usize) -> Vec<Vector3<f64>> {
    let mut directions = Vec::new();
    let azimuths = (0..per_circle).map(|k| 2.0 * std::f64::consts::PI * k as f64 / per_circle as f64);
    for azimuth in azimuths {
        for rise in [0.0, FRAC_PI_6, 2.0 * FRAC_PI_6] {
            if rise > 0.0 || azimuth <= std::f64::consts::PI {
                directions.push(Vector3::new(rise.cos() * azimuth.cos(), rise.cos() * azimuth.sin(), rise.sin()));
            }
        }
    }
    directions.push(Vector3::z());
    directions
}

/// The loads in full slip of shape E on a mesh, at these depths (rising) and along these directions.
///
/// # Errors
/// [`Failure`] of a press or slide.
pub fn limit_points(
    preset: MeshPreset,
    depths_mm: &[f64],
    directions: &[Vector3<f64>],
) -> Result<Vec<LimitPoint>, Failure> {
    let config = Config { mesh_preset: preset, ..Config::default() };
    let deepest = depths_mm.last().copied().ok_or("no depth")?;
    let (finger, _) = config.finger_for(&[&press_to(deepest)])?;
    let problem = Problem {
        half: None,
        // In full slip the shear of a press has vanished.
        load_steps: LoadSettings { friction_while_pressing: false, ..config.numerics.load_steps },
        ..config.problem(&finger)
    };
    let law = problem.friction.ok_or("friction is on")?;
    let mut points = Vec::new();
    for &depth_mm in depths_mm {
        let pressed = follow(&problem, &press_to(depth_mm), None)?;
        for direction in directions {
            let travel_mm = TRAVEL_OVER_DEPTH * depth_mm;
            let ends_mm = [STEADY_FROM * travel_mm, travel_mm];
            let earlier = follow(&problem, &slide_at(depth_mm, direction, &ends_mm[..1]), Some(&pressed))?;
            let end = follow(&problem, &slide_at(depth_mm, direction, &ends_mm), Some(&earlier))?;
            let last = end.responses().last().ok_or("no response")?;
            let at_pole = carried(end.state(), direction);
            points.push(LimitPoint {
                depth_mm,
                load: load(end.state()) - at_pole,
                at_pole,
                earlier: load(earlier.state()) - carried(earlier.state(), direction),
                over_pressure: integral(&law, end.state(), direction),
                over_press: integral(&law, pressed.state(), direction),
                stick_ratio: last.stick_ratio,
            });
        }
    }
    Ok(points)
}

fn press_to(depth_mm: f64) -> Path {
    let corner = |t_s, normal| Waypoint { t_s, normal, x: 0.0, y: 0.0 };
    let turns = Turns { spin: Some(Turn { drive: Drive::Displacement, values: vec![0.0; 2] }), ..Turns::default() };
    Path { turns, ..Path::new([Drive::Displacement; 3], vec![corner(0.0, 0.0), corner(1.0, depth_mm)]) }
}

/// The press, and the states at these distances along `direction`, mm from its start.
fn slide_at(depth_mm: f64, direction: &Vector3<f64>, ways_mm: &[f64]) -> Path {
    let mut path = press_to(depth_mm);
    let spin = path.turns.spin.as_mut().expect("spin is driven");
    for way_mm in ways_mm {
        let way = *way_mm * direction;
        path.waypoints.push(Waypoint { t_s: 1.0 + way_mm, normal: depth_mm, x: way.x, y: way.y });
        spin.values.push((way.z / ARM_MM).to_degrees());
    }
    path
}

fn follow(problem: &Problem, path: &Path, from: Option<&PathEnd>) -> Result<PathEnd, LoadPathError> {
    let options = RunOptions { from, ..RunOptions::default() };
    load_path::follow(problem, path, options, &mut |_| ControlFlow::Continue(()))
}

fn load(state: &State) -> Vector3<f64> {
    Vector3::new(state.totals.force.x, state.totals.force.y, state.totals.moment.z)
}

/// A node that touches, under a plane that moves in one direction.
struct Passed<'a> {
    node: &'a NodeState,
    /// Place from first touch along the plane's unspun axes, mm.
    arm: Vector2<f64>,
    /// Motion of the rigid plane there.
    passing: Vector2<f64>,
    /// Whether the plane carries the node round.
    carried: bool,
}

/// The nodes of a state that touch.
fn passed<'a>(state: &'a State, direction: &Vector3<f64>) -> impl Iterator<Item = Passed<'a>> {
    // Pitch and roll are those of the neutral pose: the plane's frame is reached by slide and spin alone.
    let frame = state.contact.plane.frame(&Default::default());
    let (slide, spin) = (direction.xy(), direction.z / ARM_MM);
    state.contact.nodes.iter().zip(&state.contact.position).filter(|(node, _)| node.area > 0.0).map(
        move |(node, place)| {
            let arm = frame.from_plane(place).xy();
            let passing = slide + Rotation2::new(std::f64::consts::FRAC_PI_2) * arm * spin;
            Passed { node, arm, passing, carried: passing.norm() <= CARRIED_MM * spin.abs() }
        },
    )
}

/// Friction along x and y (N) and its moment about the normal (N mm) of a force at `arm` (mm).
fn of_force(arm: &Vector2<f64>, force: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(force.x, force.y, arm.perp(force))
}

/// Force of the nodes that the plane carries round.
fn carried(state: &State, direction: &Vector3<f64>) -> Vector3<f64> {
    let frame = state.contact.plane.frame(&Default::default());
    let at_pole = passed(state, direction).filter(|at| at.carried);
    at_pole.map(|at| of_force(&at.arm, &Vector2::from(frame.unspun(&at.node.tangential_force_n)))).sum()
}

/// Integral of the law's strength over the pressure of a state, each point that is not carried slipping as the plane passes it
/// that moves in this direction.
fn integral(law: &RubberFriction, state: &State, direction: &Vector3<f64>) -> Vector3<f64> {
    let slips = passed(state, direction).filter(|at| !at.carried);
    slips
        .map(|Passed { node, arm, passing, .. }| {
            of_force(&arm, &(passing.normalize() * law.strength(node.pressure_mpa()).0 * node.area))
        })
        .sum()
}

/// Semi-axes of a load in units of which a limit surface is about a sphere: friction along x, along y, moment.
fn axes(points: &[LimitPoint]) -> Vector3<f64> {
    let largest = |k: usize| points.iter().map(|p| p.load[k].abs()).fold(0.0, f64::max);
    Vector3::from_fn(|k, _| largest(k))
}

/// Loads in full slip against the law over the pressure, and their distance from an ellipsoid.
pub fn limit_surface(effort: Effort) -> Result<Vec<Check>, Failure> {
    let (preset, depths, per_circle, bound): (_, &[f64], _, _) = match effort {
        Effort::Quick => (MeshPreset::Coarse, &[0.5], 3, 0.01),
        Effort::Full => (MeshPreset::Medium, &[0.5, 1.0, 1.5, 2.0], 6, 0.02),
    };
    let directions = fan(per_circle);
    let points = limit_points(preset, depths, &directions)?;
    let mut checks = Vec::new();
    for at_depth in points.chunks(directions.len()) {
        let axes = axes(at_depth);
        let over = |a: &Vector3<f64>| a.component_div(&axes);
        let apart = |of: &dyn Fn(&LimitPoint) -> Vector3<f64>| {
            at_depth.iter().map(|p| over(&(p.load - of(p))).norm() / over(&p.load).norm()).fold(0.0, f64::max)
        };
        let radii = || at_depth.iter().map(|p| over(&p.load).norm());
        let name =
            |what: &str| format!("{:?}, {} mm, {} directions: {what}", preset, at_depth[0].depth_mm, directions.len());
        checks.extend([
            Check::at_most(name("stick ratio"), at_depth.iter().map(|p| p.stick_ratio).fold(0.0, f64::max), 1e-3),
            Check::at_most(name("largest change over the last tenth of the path"), apart(&|p| p.earlier), 0.005),
            Check::at_most(name("off the law over the slide's pressure"), apart(&|p| p.over_pressure), bound),
            Check::reported(name("off the law over the press's pressure"), apart(&|p| p.over_press)),
            Check::reported(
                name("largest load of nodes that the plane carries round at its pole"),
                at_depth.iter().map(|p| over(&p.at_pole).norm() / over(&p.load).norm()).fold(0.0, f64::max),
            ),
            Check::reported(name("friction along x, largest (N)"), axes.x),
            Check::reported(name("friction along y, largest (N)"), axes.y),
            Check::reported(name("moment, largest (N mm)"), axes.z),
            Check::reported(
                name("nearest point, over an ellipsoid of these axes"),
                radii().fold(f64::INFINITY, f64::min),
            ),
            Check::reported(name("farthest point, over that ellipsoid"), radii().fold(0.0, f64::max)),
        ]);
    }
    Ok(checks)
}

/// Normal force (N) and moment about the normal (N mm) of the index finger's tip and pulp in six precision grips [Sci. Rep. 12,
/// 2022, doi 10.1038/s41598-022-16962-1, Table 2, measured].
const HELD_BY_INDEX: [[f64; 2]; 6] =
    [[2.64, -1.1], [8.08, -1.6], [4.94, -6.6], [3.79, -6.9], [4.09, 2.9], [3.44, -7.7]];
/// Largest torque that two fingers held in precision grip [Kinoshita et al., J. Neurophysiol. 78, 1997], N mm.
const LARGEST_TORQUE_N_MM: f64 = 50.0;

/// Travel under a held force, mm.
const HELD_TRAVEL_MM: f64 = 20.0;

/// Deeper than the finger is pressed by the forces below, mm.
const DEEPEST_MM: f64 = 2.4;

/// The largest moment over a constant normal force, alone and with friction, against measurements of fingers.
pub fn twist(effort: Effort) -> Result<Vec<Check>, Failure> {
    let (preset, forces_n): (_, &[f64]) = match effort {
        Effort::Quick => (MeshPreset::Coarse, &[0.1, 0.3]),
        Effort::Full => (MeshPreset::Medium, &[0.1, 0.2, 0.3, 0.5, 0.7, 1.0]),
    };
    let motions = [("spin", Vector3::z()), ("slide", Vector3::x()), ("both", Vector3::new(0.8, 0.0, 0.6))];
    let mut loads = Vec::new();
    let mut checks = Vec::new();
    for &force_n in forces_n {
        let found =
            motions.iter().map(|(_, motion)| held_limit(preset, force_n, motion)).collect::<Result<Vec<_>, _>>()?;
        let name = |what: &str| format!("{force_n} N: {what}");
        checks.push(Check::reported(name("largest moment (N mm)"), found[0].z));
        checks.push(Check::reported(name("largest moment over N (mm)"), found[0].z / force_n));
        checks.push(Check::reported(name("friction in full slip along +x (N)"), found[1].x));
        checks.push(Check::reported(name("both at once: friction (N)"), found[2].x));
        checks.push(Check::reported(name("both at once: moment (N mm)"), found[2].z));
        loads.push(found);
    }
    // N over a load, between and beyond the forces by a power of it.
    let of = |k: usize, component: usize| -> Vec<[f64; 2]> {
        forces_n.iter().zip(&loads).map(|(&n, found)| [found[k][component], n]).collect()
    };
    let (by_moment, by_friction) = (of(0, 2), of(1, 0));
    for (&force_n, found) in forces_n.iter().zip(&loads) {
        let additive = power_between(&by_friction, found[2].x) + power_between(&by_moment, found[2].z);
        checks.push(Check::at_most(
            format!("{force_n} N: held normal force over the sum of what moment and friction need alone"),
            force_n / additive,
            1.0,
        ));
    }
    let growth = (by_moment[by_moment.len() - 1][0] / by_moment[0][0]).ln()
        / (by_moment[by_moment.len() - 1][1] / by_moment[0][1]).ln();
    checks.push(Check::reported("power of the largest moment over N (measured: 1)", growth));
    let needed = power_between(&by_moment, 0.5 * LARGEST_TORQUE_N_MM);
    checks.push(Check::reported("N of each of two fingers for 50 N mm, continued (N)", needed));
    let moments: Vec<[f64; 2]> = by_moment.iter().map(|[m, n]| [*n, *m]).collect();
    for [force_n, moment] in HELD_BY_INDEX {
        let quantity = format!("index finger, {force_n} N: moment held, over the largest of the model, continued");
        checks.push(Check::at_most(quantity, moment.abs() / power_between(&moments, force_n), 1.0));
    }
    Ok(checks)
}

/// Largest component of the load in its own direction while a plane that presses with `force_n` moves along `motion`.
fn held_limit(preset: MeshPreset, force_n: f64, motion: &Vector3<f64>) -> Result<Vector3<f64>, Failure> {
    let config = Config { mesh_preset: preset, ..Config::default() };
    let way = HELD_TRAVEL_MM * motion;
    let rows = [[0.0, 0.0], [force_n, 0.0], [force_n, 1.0]];
    let corner = |(t, [normal, share]): (usize, [f64; 2])| Waypoint { t_s: t as f64, normal, x: share * way.x, y: 0.0 };
    let spin = rows.map(|[_, share]| (share * way.z / ARM_MM).to_degrees()).to_vec();
    let mut path = Path::new(
        [Drive::Force, Drive::Displacement, Drive::Displacement],
        rows.into_iter().enumerate().map(corner).collect(),
    );
    if way.z != 0.0 {
        path.turns.spin = Some(Turn { drive: Drive::Displacement, values: spin });
    }
    let (finger, _) = config.finger_for(&[&press_to(DEEPEST_MM)])?;
    let problem = Problem {
        load_steps: LoadSettings { friction_while_pressing: false, ..config.numerics.load_steps },
        ..config.problem(&finger)
    };
    let end = follow(&problem, &path, None)?;
    let last = end.responses().last().ok_or("no response")?;
    let largest =
        |of: &dyn Fn(&fingerpad_fe::load_path::Response) -> f64| end.responses().iter().map(of).fold(0.0, f64::max);
    // A moment alone: the largest along the path. Together: both at the end.
    Ok(if motion.x == 0.0 {
        Vector3::new(0.0, 0.0, largest(&|r| r.moment_n_mm[2]))
    } else if motion.z == 0.0 {
        Vector3::new(largest(&|r| r.friction_x_n), 0.0, 0.0)
    } else {
        Vector3::new(last.friction_x_n, last.friction_y_n, last.moment_n_mm[2])
    })
}

/// Value at `x` of a curve through rising points (x, y > 0), a power of x between two of them and beyond the last.
fn power_between(points: &[[f64; 2]], x: f64) -> f64 {
    let next = points.partition_point(|p| p[0] < x).clamp(1, points.len() - 1);
    let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
    y0 * (x / x0).powf((y1 / y0).ln() / (x1 / x0).ln())
}
