//! Normal force of a grip: torque with tangential force, curved surfaces.

use fingerpad_fe::experiment::{BodyKind, RigidBodySettings};
use fingerpad_fe::load_path::{Drive, Path, Turn, Turns};
use fingerpad_tests::problems::fingers::path;

use super::Finding;
use super::lab::{Failure, Lab, Line, at, chart, depths_mm, exponent, friction_n, line};

/// Longest travel of the plane in full slip, mm, and the arm by which a spin counts as travel, mm.
const TRAVEL_MM: f64 = 8.0;
const ARM_MM: f64 = 4.0;

/// Largest friction (N) and moment (N mm) of a motion under constant normal force: `share` is the part of spin in it.
fn limit(lab: &Lab, force_n: f64, share: f64) -> Result<[f64; 2], Failure> {
    let drives = [Drive::Force, Drive::Displacement, Drive::Displacement];
    let angle = share * std::f64::consts::FRAC_PI_2;
    let along = TRAVEL_MM * angle.cos();
    let straight = path(drives, &[[0.0; 3], [force_n, 0.0, 0.0], [force_n, along, 0.0]]);
    let spin_deg = (TRAVEL_MM / ARM_MM * angle.sin()).to_degrees();
    let spin = Turn { drive: Drive::Displacement, values: vec![0.0, 0.0, spin_deg] };
    let turns = if share > 0.0 { Turns { spin: Some(spin), ..Turns::default() } } else { Turns::default() };
    let run = lab.follow(&Path { turns, ..straight })?;
    let last = run.responses.last().ok_or("a run without rows")?;
    // The moment about the centre of pressure, as it acts on a grip.
    let [cx, cy] = last.centre_of_pressure_mm;
    let moment = last.moment_n_mm[2] - (cx * last.friction_y_n - cy * last.friction_x_n);
    Ok([friction_n(last), moment.abs()])
}

/// Normal force that holds force and torque.
pub fn torque(lab: &Lab) -> Result<Finding, Failure> {
    let (mut friction, mut moment) = (Vec::new(), Vec::new());
    let mut ends = [[0.0; 2]; 2];
    for force_n in [0.5, 1.0, 2.0] {
        ends = [limit(lab, force_n, 0.0)?, limit(lab, force_n, 1.0)?];
        friction.push([force_n, ends[0][0]]);
        moment.push([force_n, ends[1][1]]);
    }
    let between = [0.25, 0.5, 0.75].map(|share| limit(lab, 2.0, share));
    let mut surface = vec![ends[0]];
    for point in between {
        surface.push(point?);
    }
    surface.push(ends[1]);
    let powers = [exponent(&friction, [0.501, 1.999]), exponent(&moment, [0.501, 1.999])];
    let [largest, turning] = [surface[0][0], surface[4][1]];
    let relative: Vec<[f64; 2]> = surface.iter().map(|[f, m]| [f / largest, m / turning]).collect();
    // Remaining share of the moment where friction uses half of its limit; an additive rule would leave a half.
    let mut falling = relative.clone();
    falling.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let left = falling
        .windows(2)
        .find(|p| p[0][0] <= 0.5 && p[1][0] >= 0.5)
        .map_or(f64::NAN, |p| p[0][1] + (0.5 - p[0][0]) / (p[1][0] - p[0][0]) * (p[1][1] - p[0][1]));
    let ellipse = (0..=40).map(|k| f64::from(k) / 40.0).map(|f| [f, (1.0 - f * f).sqrt()]).collect();
    Ok(Finding {
        title: "Limit of friction and torsional moment",
        source: "Kinoshita, Bäckström, Flanagan and Johansson 1997, J. Neurophysiol. 78:1619",
        published: "the normal force at which a grip slips grows in proportion to the torque without tangential force, and in proportion to \
                    the tangential force without torque; together they are mainly additive, and the more tangential force there is, the \
                    less a torque adds",
        lines: vec![
            Line::new("exponent of the tangential force in the normal force", 2, powers[0], [0.9, 1.1]),
            Line::new("exponent of the torque in the normal force", 2, powers[1], [0.9, 1.1]),
            Line::new("share of the torque left at half of the tangential force", 2, left, [0.5, 0.87]),
        ],
        remark: "The published friction law has an exponent of 0.46 in the pressure, from 0.1 to 0.5 N on acrylic. The experiment used \
                 rayon, suede and sandpaper, whose friction is nearer to proportional. The torque is about the centre of pressure. A share of \
                 0.5 would be additive, 0.87 an ellipse. Each number is taken after 8 mm of travel; the contact at 2 N does not quite slip as a whole by then."
            .into(),
        charts: vec![
            chart(
                "Largest tangential force and torque",
                ["normal force (N)", "N; N mm / 4"],
                vec![
                    line("tangential force", friction),
                    line("torque / 4 mm", moment.iter().map(|[n, m]| [*n, m / 4.0]).collect()),
                ],
            ),
            chart(
                "Both together at 2 N",
                ["tangential force over its largest", "torque over its largest"],
                vec![
                    line("finite elements", relative),
                    line("ellipse", ellipse),
                    line("additive", vec![[0.0, 1.0], [1.0, 0.0]]),
                ],
            ),
        ],
    })
}

/// Slip force on spherically curved surfaces.
pub fn curvature(lab: &Lab) -> Result<Finding, Failure> {
    let sphere = |radius_mm: f64| RigidBodySettings {
        kind: BodyKind::Sphere,
        radius_mm: Some(radius_mm),
        ..RigidBodySettings::default()
    };
    let bodies = [
        ("concave, 40 mm", sphere(-40.0)),
        ("flat", RigidBodySettings::default()),
        ("convex, 20 mm", sphere(20.0)),
        ("convex, 10 mm", sphere(10.0)),
        ("convex, 5 mm", sphere(5.0)),
    ];
    // Half of the weight of the lightest object hangs on each finger.
    const LOAD_N: f64 = 0.5 * 9.81 * 0.168;
    let (mut traces, mut slip) = (Vec::new(), Vec::new());
    for (name, body) in bodies {
        let presses = lab.press(&body, &depths_mm(if name.starts_with("concave") { 2.3 } else { 5.5 }, 28))?;
        let by_friction: Vec<[f64; 2]> = presses.iter().map(|p| [p.friction_limit_n, p.normal_force_n]).collect();
        slip.push((name, at(&by_friction, LOAD_N)));
        traces.push(line(name, by_friction.iter().map(|&[f, n]| [n, f]).filter(|p| p[0] < 6.0).collect()));
    }
    let flat = slip[1].1;
    let curved = slip.iter().filter(|(name, _)| *name != "flat");
    let change = |&(name, force_n): &(&str, f64)| {
        let name = format!("slip force of 168 g against flat, {name}, %");
        Line::new(name, 0, 100.0 * (force_n / flat - 1.0), [-50.0, 0.0])
    };
    let lines = curved.map(change).collect();
    Ok(Finding {
        title: "Slip force against curvature",
        source: "Jenmalm, Goodwin and Johansson 1998, J. Neurophysiol. 79:1643",
        published: "the grip force at which an object of 168 to 705 g slips is smaller for larger curvatures, concave and convex, than for \
                    flatter surfaces; the changes are moderate (spheres of radius 20 and 40 mm concave, 20, 10 and 5 mm convex)",
        lines,
        remark: "With an exponent below 1, more area means more friction, so a convex surface, with less area, slips earlier. The \
                 measurement shows the opposite on convex surfaces. Another mechanism beside the area acts there, such as the slope of \
                 the surface against the load, which the integral of the law over the pressure omits. The concave surface of 20 mm is \
                 missing, because a bowl of this radius without a rim touches the held end of the finger before the pad. A dash means \
                 that the friction limit stays below the load in the computed depths. The band of half the force is our reading of \
                 `moderate`."
            .into(),
        charts: vec![chart("Friction at its limit", ["normal force (N)", "friction (N)"], traces)],
    })
}
