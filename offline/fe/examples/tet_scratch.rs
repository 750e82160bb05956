#![allow(dead_code)]
#[path = "../../../tests/src/half_space.rs"]
mod half_space;
#[path = "../../../tests/src/problems/sphere.rs"]
mod sphere;
use fingerpad_fe::contact::{Friction, RubberFriction};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::*;
use half_space::*;
use sphere::*;
use std::ops::ControlFlow;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    match args[1].as_str() {
        "hertz" => {
            for (elements, n, g) in [(Elements::Hexes, 10, 1.2), (Elements::Tets, 10, 1.35)] {
                let t = std::time::Instant::now();
                let s = Sphere::new(
                    &Layout { elements, part: Part::Quarter, per_radius: n, extent: 4.0, growth: g },
                    0.4,
                    500.0,
                )
                .unwrap();
                let mut solver = s.solver(s.penalty(1e-3));
                let state = s.press(&mut solver).unwrap();
                let surface = solver.surface();
                let area: f64 = surface.contact_areas(&state.contact).iter().map(|a| a[0]).sum();
                let a = (s.copies * area / std::f64::consts::PI).sqrt();
                let peak = state
                    .contact
                    .nodes
                    .iter()
                    .zip(reference(surface, &s.mesh.nodes))
                    .map(|(n, d)| n.normal_force_n / d)
                    .fold(0.0, f64::max);
                println!(
                    "hertz {elements:?} n {n} nodes {}: F {:.4} a {:.4} p0 {:.4} ({:.1} s)",
                    s.mesh.nodes.len(),
                    s.copies * state.totals.force.z / s.hertz.force_n(),
                    a / s.hertz.radius_mm,
                    peak / s.hertz.peak_mpa(),
                    t.elapsed().as_secs_f64()
                );
                // pressure noise inside 0.7 a
                let mut worst = (0.0f64, 0.0f64, 0);
                for ((node, st), d) in
                    surface.nodes.iter().zip(&state.contact.nodes).zip(reference(surface, &s.mesh.nodes))
                {
                    let r = s.mesh.nodes[*node as usize].xy().norm();
                    if r < 0.7 {
                        let e = st.normal_force_n / d / (s.hertz.peak_mpa() * (1.0 - r * r).sqrt()) - 1.0;
                        worst.0 = worst.0.max(e.abs());
                        worst.1 += e * e;
                        worst.2 += 1;
                    }
                }
                println!("   pressure inside 0.7 a: max {:.4} rms {:.4}", worst.0, (worst.1 / worst.2 as f64).sqrt());
            }
        }
        "mindlin" => {
            for elements in [Elements::Hexes, Elements::Tets] {
                let s = Sphere::new(
                    &Layout { elements, part: Part::Half, per_radius: 8, extent: 4.0, growth: 1.35 },
                    0.499,
                    500.0,
                )
                .unwrap();
                let mindlin = Mindlin { hertz: s.hertz, mu: 0.5 };
                let mut solver = s.solver(s.penalty(1e-3));
                let mut state = s.press(&mut solver).unwrap();
                let force = s.copies * state.totals.force.z;
                println!("mindlin {elements:?} nodes {}: F {:.4}", s.mesh.nodes.len(), force / s.hertz.force_n());
                solver.set_friction(Friction::On(RubberFriction::coulomb(0.5, 1e-3 * mindlin.full_slip_mm())));
                for share in [0.02, 0.1, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9] {
                    let x = share * mindlin.full_slip_mm();
                    state = s
                        .step(&mut solver, &state, [x, 0.0, s.hertz.approach_mm()], &PointLoads::mindlin(&mindlin, x))
                        .unwrap();
                    let q = s.copies * state.totals.force.x;
                    println!(
                        "  {share}: Q/(mu P) {:.4} exact {:.4}; stick radius {:.4} exact {:.4}; compliance {:.4}",
                        q / (0.5 * force),
                        mindlin.force_n(x) / mindlin.limit_n(),
                        s.stick_radius_mm(&state),
                        mindlin.stick_radius_mm(x),
                        (x / q) / (x / mindlin.force_n(x))
                    );
                }
            }
        }
        _ => {
            let config = Config::read(std::path::Path::new(&args[1])).unwrap();
            let (finger, touch) = config.finger().unwrap();
            println!(
                "{} nodes, pad {} quads {} triangles, touch {touch:?}",
                finger.mesh.nodes.len(),
                finger.mesh.pad_faces.len(),
                finger.mesh.pad_triangles.len()
            );
            let path = Path {
                drives: [Drive::Displacement; 3],
                waypoints: [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 3.0]]
                    .iter()
                    .enumerate()
                    .map(|(k, p)| Waypoint { t_s: k as f64, normal: p[0], x: p[1], y: 0.0 })
                    .collect(),
            };
            let t = std::time::Instant::now();
            let run = follow_path(&config.problem(&finger), &path, &[], &mut |_| ControlFlow::Continue(())).unwrap();
            for k in 0..6 {
                let r = run.responses.iter().rfind(|r| r.t_s <= k as f64).unwrap();
                println!(
                    "t {k}: depth {} slide {} N {:.5} Fx {:.5} area {:.4} stick {:.4}",
                    r.depth_mm, r.slide_x_mm, r.normal_force_n, r.friction_x_n, r.contact_area_mm2, r.stick_ratio
                );
            }
            println!("{:.1} s", t.elapsed().as_secs_f64());
        }
    }
}
fn reference(surface: &fingerpad_fe::contact::Surface, x: &[nalgebra::Vector3<f64>]) -> Vec<f64> {
    let mut out = vec![0.0; surface.nodes.len()];
    for f in &surface.facets {
        let c = f.corners();
        let p: Vec<_> = c.iter().map(|n| x[surface.nodes[*n] as usize]).collect();
        let area = 0.5 * (p[2] - p[0]).cross(&(p[c.len() - 1] - p[1])).norm();
        c.iter().for_each(|n| out[*n] += area / c.len() as f64);
    }
    out
}
