use fingerpad_offline::{assembly::*, contact::*, material::*, mesh::*, slide::*, solve::Settings};
use nalgebra::Vector3;
use std::ops::ControlFlow;

fn dome(nx: usize, nz: usize) -> Mesh {
    let (l, h, r) = (14.0, 7.0, 14.0);
    let mut m = Mesh::default();
    let id = |i: usize, j: usize, k: usize| ((k * (nx + 1) + j) * (nx + 1) + i) as u32;
    for k in 0..=nz {
        for j in 0..=nx {
            for i in 0..=nx {
                let (x, y) = ((i as f64 / nx as f64 - 0.5) * l, (j as f64 / nx as f64 - 0.5) * l);
                let low = (x * x + y * y) / (2.0 * r);
                let t = k as f64 / nz as f64;
                m.nodes.push(Vector3::new(x, y, low + (h - low) * t));
            }
        }
    }
    for k in 0..nz {
        for j in 0..nx {
            for i in 0..nx {
                m.hexes.push(Hex {
                    nodes: [
                        id(i, j, k),
                        id(i + 1, j, k),
                        id(i + 1, j + 1, k),
                        id(i, j + 1, k),
                        id(i, j, k + 1),
                        id(i + 1, j, k + 1),
                        id(i + 1, j + 1, k + 1),
                        id(i, j + 1, k + 1),
                    ],
                    region: if k == 0 { Region::Skin } else { Region::Subcutaneous },
                });
                if k == 0 {
                    m.pad_faces.push([id(i, j, 0), id(i, j + 1, 0), id(i + 1, j + 1, 0), id(i + 1, j, 0)]);
                }
                if k == nz - 1 {
                    for n in [id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1)] {
                        m.node_sets.entry("top".into()).or_default().push(n);
                    }
                }
            }
        }
    }
    m
}

fn main() {
    let args: Vec<f64> = std::env::args().skip(1).map(|a| a.parse().unwrap()).collect();
    let mesh = dome(args[0] as usize, args[1] as usize);
    let mut contact: Vec<u32> = mesh.pad_faces.iter().flatten().copied().collect();
    contact.sort();
    contact.dedup();
    let supports = Supports { fixed: mesh.node_set("top").to_vec(), contact, ..Default::default() };
    let law = |r| {
        Some(Material::Ogden(if r == Region::Skin {
            Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 }
        } else {
            Ogden { mu_mpa: 0.00684, alpha: 1.4, d_per_mpa: 10.0 }
        }))
    };
    let body = Body::new(
        &mesh,
        law,
        &supports,
        Vector3::zeros(),
        Joint { translation_n_per_mm: 0.0, rotation_nmm_per_rad: 0.0 },
    )
    .unwrap();
    println!(
        "nodes {} dofs {} contact {}",
        mesh.nodes.len(),
        body.dofs.count,
        body.dofs.count - body.dofs.first_contact_dof
    );
    let problem = Problem {
        body: &body,
        pad_faces: &mesh.pad_faces,
        friction: Some(RubberFriction::default()),
        penalty: PenaltySettings::default(),
        settings: Settings::default(),
        march: MarchSettings::default(),
    };
    let wp = |t, d, x, y| Waypoint { t_s: t, normal: d, x, y };
    let path = Path {
        drives: [Drive::Displacement; 3],
        waypoints: vec![wp(0.0, 0.0, 0.0, 0.0), wp(1.0, args[2], 0.0, 0.0), wp(2.0, args[2], args[3], 0.0)],
    };
    let r = march(&problem, &path, &[], &mut |p| {
        println!(
            "{:.3} N {:.4} F {:.4} A {:.2} stick {:.3} slide {:.3} {:?}",
            p.share,
            p.response.normal_force_n,
            p.response.friction_x_n,
            p.response.contact_area_mm2,
            p.response.stick_ratio,
            p.response.slide_x_mm,
            p.cost
        );
        ControlFlow::Continue(())
    });
    match r {
        Ok(t) => println!("{:?} {:?}", t.cost, t.work),
        Err(e) => println!("{e}"),
    }
}
