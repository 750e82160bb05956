//! A shallow arch that snaps: the limit point of a structure under a force that grows.
//!
//! Here the snap is the whole event, so that its work is a large share; that of the fingers is held under 1 % by `deep`.

use fingerpad_fe::assembly::{Body, BodyError, Joint, Material, Supports};
use fingerpad_fe::load_path::{Drive, Problem, Response, follow_path};
use fingerpad_fe::material::Ogden;
use fingerpad_fe::mesh::{
    Mesh,
    block::{coordinates, curved_block},
};
use std::ops::ControlFlow;

use fingerpad::Status;
use nalgebra::Vector3;

use super::{Effort, Failure};
use crate::{
    Check,
    problems::fingers::{follow, path, placed, problem},
};

const HALF_SPAN_MM: f64 = 10.0;

struct Arch {
    mesh: Mesh,
    body: Body,
}

impl Arch {
    /// A strip in plane strain, clamped at both ends, its crown toward the plane.
    fn new(rise_mm: f64, thickness_mm: f64) -> Result<Self, BodyError> {
        let xs = coordinates(-HALF_SPAN_MM, HALF_SPAN_MM, 60, 1.0);
        let up = coordinates(0.0, thickness_mm, 3, 1.0);
        let mut mesh = curved_block(&xs, &[0.0, 0.5], &up, |p| {
            p + Vector3::z() * (rise_mm * (std::f64::consts::FRAC_PI_2 * p.x / HALF_SPAN_MM).sin().powi(2))
        });
        mesh.pad_faces.retain(|face| face.iter().all(|&n| mesh.nodes[n as usize].x.abs() < 3.0));
        let mut contact: Vec<u32> = mesh.pad_faces.iter().flatten().copied().collect();
        contact.sort_unstable();
        contact.dedup();
        let mut fixed = mesh.node_set("x0").to_vec();
        fixed.extend(mesh.node_set("x1"));
        let sides = mesh.node_set("y0").iter().chain(mesh.node_set("y1"));
        let supports =
            Supports { fixed, fixed_components: sides.map(|&n| (n, 1)).collect(), contact, ..Default::default() };
        let law = Ogden { mu_mpa: 1.0, alpha: 2.0, d_per_mpa: 0.5 };
        let body = Body::new(&mesh, |_| Some(Material::Ogden(law)), &supports, Vector3::zeros(), Joint::default())?;
        Ok(Self { mesh, body })
    }

    fn problem(&self) -> Problem<'_> {
        Problem { friction: None, ..problem(&self.body, &self.mesh.pad_faces) }
    }

    /// The arch under twice the force that it can carry; `depth_mm` is its equilibrium depth under it.
    fn snap(&self, driven: &Problem<'_>, limit_n: f64, depth_mm: f64) -> Result<Vec<Check>, Failure> {
        let drives = [Drive::Force, Drive::Displacement, Drive::Displacement];
        let force_path = path(drives, &[[0.0; 3], [2.0 * limit_n, 0.0, 0.0]]);
        let run = follow_path(driven, &force_path, &[1], &mut |_| ControlFlow::Continue(()))?;
        let snaps: Vec<&Response> = run.responses.iter().filter(|r| r.status == Status::STABILISED).collect();
        let snap = snaps.first().ok_or("the limit point was not noticed")?;
        let end = run.responses.last().ok_or("no response")?;
        let mut configuration = self.body.undeformed().clone();
        for (x, u) in configuration.x.iter_mut().zip(&run.snapshots[0].displacement_mm) {
            *x += u;
        }
        let energy = self.body.energy(&configuration).0;
        Ok(vec![
            Check::reported("step of the force over the limit", driven.load_steps.max_force_step_n / limit_n),
            Check::at_most("increments that were stabilised", snaps.len() as f64, 2.0),
            Check::relative("force at the snap over the limit", snap.normal_force_n / limit_n, 1.0, 0.06),
            Check::relative(
                "depth at twice the limit against the arch pressed by displacement",
                end.depth_mm,
                depth_mm,
                0.005,
            ),
            Check::reported("work of stabilisation (mJ)", run.work.stabilisation_mj),
            Check::reported("work of the plane (mJ)", run.work.plane_mj),
            Check::reported("elastic energy at the end (mJ)", energy),
            Check::relative(
                "elastic energy and work of stabilisation over the work of the plane",
                (energy + run.work.stabilisation_mj) / run.work.plane_mj,
                1.0,
                0.01,
            ),
        ])
    }
}

/// Steps of the force, shares of the limit: the shorter meets the limit point so closely that an unstable equilibrium lies
/// near the end of every step beyond it.
const FORCE_STEPS: [f64; 2] = [0.05, 0.02];

/// The arch under a force that exceeds its limit, against the same arch pressed by displacement.
pub fn arch(_: Effort) -> Result<Vec<Check>, Failure> {
    let arch = Arch::new(2.0, 0.6)?;
    let problem = arch.problem();
    let corners: Vec<[f64; 3]> = (0..=44).map(|k| [0.1 * k as f64, 0.0, 0.0]).collect();
    let placed = follow(&problem, &placed(&corners))?.responses;
    let rising = placed.windows(2).take_while(|pair| pair[1].normal_force_n > pair[0].normal_force_n).count();
    let limit_n = placed[rising].normal_force_n;
    let least_n = placed[rising..].iter().map(|r| r.normal_force_n).fold(f64::INFINITY, f64::min);
    let target_n = 2.0 * limit_n;

    // Row at which the arch that is pressed by displacement carries the same force, on its last branch.
    let above = placed.iter().rposition(|r| r.normal_force_n < target_n).ok_or("the force is not reached")?;
    let (a, b) = (&placed[above], &placed[above + 1]);
    let share = (target_n - a.normal_force_n) / (b.normal_force_n - a.normal_force_n);
    let depth_mm = a.depth_mm + share * (b.depth_mm - a.depth_mm);

    let mut checks = vec![Check::at_most("least force after the limit point over the limit", least_n / limit_n, 0.9)];
    for step in FORCE_STEPS {
        let mut driven = problem.clone();
        driven.load_steps.max_force_step_n = step * limit_n;
        // Near the limit point a force that is 1e-5 off moves the crown by hundredths of a millimetre.
        driven.settings.tolerance = 1e-7;
        checks.extend(arch.snap(&driven, limit_n, depth_mm)?);
    }
    Ok(checks)
}
