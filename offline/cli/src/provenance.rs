//! Provenance of finite-element runs for reports: the settings, and whether the numerical errors stayed in bounds.

use fingerpad_fe::contact::FrictionLaw;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{BoneKind, Finger, Trajectory};
use fingerpad_report::{Check, FrictionConstants, MeshCounts, Provenance};

/// The settings of the runs; mesh quality and stages are left empty.
pub fn provenance(config: &Config, finger: &Finger, settings_hash: &str) -> Provenance {
    let law = &config.friction;
    Provenance {
        shape: config.geometry_name(),
        bones: bones(config).into(),
        mesh_preset: format!("{:?}", config.mesh_preset).to_lowercase(),
        settings_hash: settings_hash.into(),
        program_version: env!("CARGO_PKG_VERSION").into(),
        mesh: MeshCounts {
            nodes: finger.mesh.nodes.len(),
            hexes: finger.mesh.hexes.len(),
            tets: finger.mesh.tets.len() + finger.mesh.tets10.len(),
            pad_faces: finger.mesh.pad_faces.len() + finger.mesh.pad_triangles.len(),
            free_dofs: finger.body.dofs.count,
        },
        friction: FrictionConstants {
            lambda: law.lambda,
            beta: law.beta,
            tau0_mpa: law.tau0_mpa,
            gamma_crit_mm: law.gamma_crit_mm,
            across_over_along: law.orthotropy().map(|o| o.across_over_along),
            skin_axis_deg: law.orthotropy().map(|o| o.skin_axis_deg),
        },
        ..Provenance::default()
    }
}

/// How the bones are held.
pub fn bones(config: &Config) -> &'static str {
    match config.tissue.bone.kind {
        BoneKind::Fixed => "fixed",
        BoneKind::Floating => "floating",
        BoneKind::Deformable => "deformable",
    }
}

/// A check with its verdict.
pub fn check(name: &str, value: f64, unit: &str, bound: f64, passed: bool) -> Check {
    Check { name: name.into(), value, unit: unit.into(), bound, passed }
}

/// Checks on the numerics of runs of one configuration: the worst of all.
pub fn checks(config: &Config, runs: &[&Trajectory]) -> Vec<Check> {
    let costs = || runs.iter().map(|run| run.cost);
    let penetration = costs().map(|c| c.max_penetration_mm).fold(0.0, f64::max);
    let tolerance = config.numerics.contact.penetration_tolerance_mm;
    let residual = costs().map(|c| c.max_residual).fold(0.0, f64::max);
    let dissipation = costs().map(|c| c.min_dissipation_mj).fold(0.0, f64::min);
    let stabilised =
        runs.iter().map(|run| run.work.stabilisation_mj.abs() / run.work.plane_mj.abs()).fold(0.0, f64::max);
    vec![
        check("largest penetration", penetration * 1e3, "µm", tolerance * 1e3, penetration <= tolerance),
        check(
            "largest residual over contact force",
            residual,
            "",
            config.numerics.solver.tolerance,
            residual <= config.numerics.solver.tolerance,
        ),
        check("least dissipation at any contact node", dissipation, "mJ", 0.0, dissipation >= 0.0),
        check("work of stabilisation", stabilised * 100.0, "%", 1.0, stabilised <= 0.01),
    ]
}
