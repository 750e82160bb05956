//! A finger and runs that only look right, to develop and test the figures with. No physics.

use std::f64::consts::PI;

use fingerpad::{Regime, Status};
use nalgebra::Vector3;

use super::*;
use fingerpad_fe::element::ElementStress;
use fingerpad_fe::load_path::{Cost, FaceState, Response, Snapshot, Work};
use fingerpad_fe::mesh::{Hex, Region, Tet};
use fingerpad_reduce::Agreement;

const N: [usize; 3] = [26, 12, 10];

/// A bent box of hexes with an inner bone, a plate of tets on its back, and a pad.
pub fn mesh() -> Mesh {
    let mut mesh = Mesh::default();
    let index = |i: usize, j: usize, k: usize| (i * (N[1] + 1) * (N[2] + 1) + j * (N[2] + 1) + k) as u32;
    let tilt = |p: Vector3<f64>| {
        let (s, c) = (PI / 6.0).sin_cos();
        Vector3::new(c * p.x + s * p.z, p.y, -s * p.x + c * p.z)
    };
    for i in 0..=N[0] {
        let u = 25.0 * i as f64 / N[0] as f64;
        let taper = (1.0 - ((u - 12.0).max(0.0) / 13.6).powf(2.4)).powf(1.0 / 2.4);
        for j in 0..=N[1] {
            for k in 0..=N[2] {
                let (v, w) = (2.0 * j as f64 / N[1] as f64 - 1.0, 2.0 * k as f64 / N[2] as f64 - 1.0);
                let (y, z) = (v * (1.0 - w * w / 2.0).sqrt(), w * (1.0 - v * v / 2.0).sqrt());
                mesh.nodes.push(tilt(Vector3::new(
                    u - 14.0,
                    8.5 * taper * y,
                    7.5 * taper * z + 0.15 * (u - 8.0).max(0.0),
                )));
            }
        }
    }
    for i in 0..N[0] {
        for j in 0..N[1] {
            for k in 0..N[2] {
                let edge = j == 0 || j == N[1] - 1 || k == 0 || k == N[2] - 1 || i == N[0] - 1;
                let core = (4..8).contains(&j) && (4..8).contains(&k);
                let region = match i {
                    _ if edge => Region::Skin,
                    0..=4 if core => Region::ProximalBone,
                    6..=20 if core => Region::DistalBone,
                    _ => Region::Subcutaneous,
                };
                let n = |a: usize, b: usize, c: usize| index(i + a, j + b, k + c);
                let nodes =
                    [n(0, 0, 0), n(1, 0, 0), n(1, 1, 0), n(0, 1, 0), n(0, 0, 1), n(1, 0, 1), n(1, 1, 1), n(0, 1, 1)];
                mesh.hexes.push(Hex { nodes, region });
                if k == 0 && i > 6 {
                    mesh.pad_faces.push([nodes[0], nodes[3], nodes[2], nodes[1]]);
                }
            }
        }
    }
    let lowest = mesh.nodes.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    mesh.nodes.iter_mut().for_each(|p| p.z -= lowest);
    let up = tilt(Vector3::new(0.0, 0.0, 0.5));
    let mut plate = std::collections::BTreeMap::new();
    for i in 13..24 {
        for j in 2..10 {
            let mut at = |a: usize, b: usize, c: usize| {
                *plate.entry((i + a, j + b, c)).or_insert_with(|| {
                    mesh.nodes.push(mesh.nodes[index(i + a, j + b, N[2]) as usize] + up * c as f64);
                    (mesh.nodes.len() - 1) as u32
                })
            };
            let c: Vec<_> = (0..8).map(|q| at(q & 1, (q >> 1) & 1, q >> 2)).collect();
            for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                mesh.tets.push(Tet { nodes: [c[0], c[a], c[b], c[7]], region: Region::Nail });
            }
        }
    }
    mesh
}

/// Four depths with a press and 6 mm of slide each; the deepest may be kept from slipping.
pub fn report(mesh: &Mesh, all_slip: bool) -> BuildReport {
    let table = [
        (0.75, 0.120, 2.46, 49.4, 0.161, 1.80, 45.9),
        (1.00, 0.198, 2.00, 62.8, 0.257, 1.60, 58.6),
        (1.25, 0.384, 1.53, 83.2, 0.370, 1.54, 79.7),
        (1.50, 0.454, 1.42, 97.7, 0.504, 1.44, 95.3),
    ];
    let depth = |(depth_mm, n, mu, a, model_n, model_mu, model_a): (f64, f64, f64, f64, f64, f64, f64)| {
        let slip_at = if !all_slip && depth_mm > 1.4 { 9.0 } else { 1.0 + 2.6 * (depth_mm - 0.4) };
        DepthResult {
            depth_mm,
            trajectory: trajectory(mesh, depth_mm, model_n, model_mu, model_a, slip_at),
            kinetic: Steady { normal_force_n: model_n, friction_coefficient: model_mu, contact_area_mm2: model_a },
            frictionless_friction_coefficient: Some(model_mu * 0.96),
            measured: Some(Steady { normal_force_n: n, friction_coefficient: mu, contact_area_mm2: a }),
        }
    };
    let check = |name: &str, value, unit: &str, bound, passed| Check {
        name: name.to_owned(),
        value,
        unit: unit.to_owned(),
        bound,
        passed,
    };
    let stage = |name: &str, wall_s, cpu_s| Stage { name: name.to_owned(), wall_s, cpu_s };
    let quantity = |name: &str, value, unit: &str| Quantity { name: name.to_owned(), value, unit: unit.to_owned() };
    BuildReport {
        reduced: Some(ReducedModel { name: "fingertip.fpm".to_owned(), depths: vec![Agreement::default(); 4] }),
        provenance: Provenance {
            shape: "E".to_owned(),
            bones: "floating".to_owned(),
            mesh_preset: "default".to_owned(),
            settings_hash: "3f9a01c27d5e".to_owned(),
            program_version: "0.1.0".to_owned(),
            mesh: MeshCounts {
                nodes: mesh.nodes.len(),
                hexes: mesh.hexes.len(),
                tets: mesh.tets.len(),
                pad_faces: mesh.pad_faces.len(),
                free_dofs: 3 * mesh.nodes.len() - 421,
            },
            quality: vec![quantity("worst scaled Jacobian", 0.213, ""), quantity("volume of the skin", 812.4, "mm³")],
            friction: FrictionConstants {
                lambda: 0.086,
                beta: 0.46,
                tau0_mpa: 0.0,
                gamma_crit_mm: 0.006,
                ..Default::default()
            },
            stages: vec![stage("mesh", 0.4, 0.4), stage("four depths", 61.2, 118.7), stage("report", 1.3, 1.3)],
        },
        depths: table.into_iter().map(depth).collect(),
        checks: vec![
            check("largest penetration", 4.1e-4, "mm", 1e-3, true),
            check("penalty x10: change of the normal force", 0.21, "%", 0.5, true),
            check("finer contact quadrature: change of the friction", 1.34, "%", 1.0, false),
        ],
        continuous: Vec::new(),
        left_out: vec!["This <test> invents its \"numbers\".".to_owned()],
    }
}

fn response(depth_mm: f64, slide: f64, n: f64, friction: f64, area: f64, stick_ratio: f64) -> Response {
    Response {
        t_s: depth_mm + slide,
        depth_mm,
        slide_x_mm: slide,
        slide_y_mm: 0.0,
        normal_force_n: n,
        friction_x_n: friction,
        friction_y_n: 0.0,
        contact_area_mm2: area,
        stick_ratio,
        regime: Regime::classify(area > 0.0, stick_ratio as f32),
        status: Status::OK,
        centre_of_pressure_mm: [0.0; 2],
        ..Response::default()
    }
}

fn trajectory(mesh: &Mesh, depth: f64, n: f64, mu: f64, area: f64, slip_at: f64) -> Trajectory {
    let press = |i: u32| {
        let s = f64::from(i) / 12.0;
        response(depth * s, 0.0, n * s.powf(1.7), 0.02 * n * s, area * s, if i == 0 { 0.0 } else { 1.0 })
    };
    let slide = |s: f64| {
        let q = (s / slip_at).min(1.0);
        let f = n * mu * (1.0 - (1.0 - q).powf(2.2)).max(0.02);
        response(depth, s, n * (1.0 - 0.02 * q), f, area * (1.0 - 0.08 * q), (1.0 - q).powf(0.8))
    };
    let mut responses: Vec<_> = (0..=12).map(press).collect();
    responses.extend((1..=48).map(|i| slide(f64::from(i) / 8.0)));
    let snapshots = [0.0, 0.5, 1.0, 2.0, 6.0].map(|s| snapshot(mesh, slide(s), slip_at)).to_vec();
    let cost =
        Cost { increments: 60, cutbacks: 1, iterations: 311, factorisations: 14, cpu_s: 17.25, ..Cost::default() };
    let work = Work { plane_mj: 3.2134, friction_mj: 2.9071, pressure_mj: 0.0012, stabilisation_mj: 0.0 };
    Trajectory { responses, snapshots, cost, work, ..Trajectory::default() }
}

fn snapshot(mesh: &Mesh, response: Response, slip_at: f64) -> Snapshot {
    let (depth, slide) = (response.depth_mm, response.slide_x_mm);
    let drag = slide.min(slip_at) * 0.8;
    let move_node = |p: &Vector3<f64>| {
        let s = (1.0 - p.z / 8.0).clamp(0.0, 1.0);
        Vector3::new(drag * s * s, 0.0, (depth - p.z).max(0.0) * (1.0 - p.z.max(0.0) / 9.0))
    };
    let displacement_mm: Vec<_> = mesh.nodes.iter().map(move_node).collect();
    let lowest = mesh.nodes.iter().min_by(|a, b| a.z.total_cmp(&b.z)).copied().unwrap_or_default();
    let radius = (response.contact_area_mm2 / PI).sqrt();
    let peak = 1.5 * response.normal_force_n / response.contact_area_mm2;
    let face = |nodes: &[u32; 4]| {
        let centre = nodes.iter().map(|n| mesh.nodes[*n as usize]).sum::<Vector3<f64>>() / 4.0;
        let r = (centre - lowest).xy().norm() / radius;
        let stuck = ((response.stick_ratio.sqrt() - r) * 6.0 + 0.5).clamp(0.0, 1.0);
        FaceState {
            pressure_mpa: peak * (1.0 - r * r).max(0.0).sqrt(),
            contact_fraction: ((1.0 - r) * 8.0).clamp(0.0, 1.0),
            stick_fraction: stuck,
            ..FaceState::default()
        }
    };
    Snapshot {
        response,
        displacement_mm,
        faces: mesh.pad_faces.iter().map(face).collect(),
        strain_energy_density_mpa: vec![0.0; mesh.hexes.len() + mesh.tets.len()],
        stresses: vec![ElementStress::default(); mesh.hexes.len() + mesh.tets.len()],
    }
}
