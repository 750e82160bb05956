//! The whole route, deck to `ccx` to numbers. These tests need `ccx` and fail without it, naming the package.

use std::time::Duration;

use nalgebra::Vector3;

use super::deck::law_lines;
use super::*;
use crate::material::{Material, MooneyRivlin, NeoHooke, Ogden, OgdenSeries, OgdenTerm, SaintVenantKirchhoff, Yeoh};
use crate::mesh::{Hex, Mesh, Region, Tet, Tie, set};

fn laws(region: Region) -> Option<Material> {
    Some(match region {
        Region::Skin => Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 }),
        Region::Nail => Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 }),
        _ => Material::Ogden(Ogden { mu_mpa: 0.00684, alpha: 1.4, d_per_mpa: 10.0 }),
    })
}

/// A block of n x n x m hexahedra, 12 mm wide, with a bottom curved by a radius of 10 mm and its top at z = 6 mm.
fn curved_block(n: usize, m: usize) -> Mesh {
    let index = |i: usize, j: usize, k: usize| ((k * (n + 1) + j) * (n + 1) + i) as u32;
    let layer = |k: usize| (0..=n).flat_map(move |j| (0..=n).map(move |i| index(i, j, k)));
    let mut mesh = Mesh::default();
    for k in 0..=m {
        for j in 0..=n {
            for i in 0..=n {
                let [x, y] = [i, j].map(|i| -6.0 + 12.0 * i as f64 / n as f64);
                let bottom = (x * x + y * y) / 20.0;
                mesh.nodes.push(Vector3::new(x, y, bottom + (6.0 - bottom) * k as f64 / m as f64));
            }
        }
    }
    for k in 0..m {
        for j in 0..n {
            for i in 0..n {
                let ring = |k| [index(i, j, k), index(i + 1, j, k), index(i + 1, j + 1, k), index(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (ring(k), ring(k + 1));
                let region = if k == 0 { Region::Skin } else { Region::Subcutaneous };
                mesh.hexes.push(Hex { nodes: [a, b, c, d, e, f, g, h], region });
                if k == 0 {
                    mesh.pad_faces.push([a, d, c, b]);
                }
            }
        }
    }
    mesh.node_sets.insert(set::PROXIMAL_FIX.into(), layer(m).collect());
    mesh
}

fn block_deck(mesh: &Mesh, friction: Option<Friction>, steps: Vec<Step>) -> Deck<'_> {
    Deck::finger(mesh, laws, Contact { penalty_mpa_mm: 20.0, friction }, steps)
}

/// First Piola stress along the axes for axial stretches: differences of the energy as the manuals write it.
fn axial_stress(law: &Material, stretch: [f64; 3]) -> [f64; 3] {
    let energy = |stretch: [f64; 3]| {
        let volume: f64 = stretch.iter().product();
        let l = stretch.map(|l| l * volume.powf(-1.0 / 3.0));
        let i1 = l.iter().map(|l| l * l).sum::<f64>() - 3.0;
        let i2 = l.iter().map(|l| 1.0 / (l * l)).sum::<f64>() - 3.0;
        let term =
            |mu: f64, alpha: f64| 2.0 * mu / (alpha * alpha) * (l.iter().map(|l| l.powf(alpha)).sum::<f64>() - 3.0);
        let (isochoric, d) = match law {
            Material::NeoHooke(law) => (0.5 * law.mu_mpa * i1, law.d_per_mpa),
            Material::MooneyRivlin(law) => (law.c10_mpa * i1 + law.c01_mpa * i2, law.d_per_mpa),
            Material::Yeoh(law) => {
                (law.c10_mpa * i1 + law.c20_mpa * i1.powi(2) + law.c30_mpa * i1.powi(3), law.d_per_mpa)
            }
            Material::OgdenSeries(law) => (law.terms().iter().map(|t| term(t.mu_mpa, t.alpha)).sum(), SERIES_D),
            Material::Ogden(law) => (term(law.mu_mpa, law.alpha), law.d_per_mpa),
            Material::Linear(_) => unreachable!("not among the cases"),
        };
        isochoric + (volume - 1.0).powi(2) / d
    };
    [0, 1, 2].map(|i| {
        let central = |h: f64| {
            let moved = |h: f64| std::array::from_fn(|k| if k == i { stretch[k] + h } else { stretch[k] });
            (energy(moved(h)) - energy(moved(-h))) / (2.0 * h)
        };
        (4.0 * central(5e-4) - central(1e-3)) / 3.0
    })
}

const SERIES_D: f64 = 0.5;

fn series(count: usize) -> Material {
    let terms = [(0.4, 1.3), (0.003, 5.0), (0.01, -2.0)].map(|(mu_mpa, alpha)| OgdenTerm { mu_mpa, alpha });
    Material::OgdenSeries(OgdenSeries::new(&terms[..count], SERIES_D).unwrap())
}

#[test]
fn one_element_has_our_laws() {
    let ogden = |mu_mpa, alpha, d_per_mpa| Material::Ogden(Ogden { mu_mpa, alpha, d_per_mpa });
    let cases = [
        (ogden(0.034, 1.4, 1.0), [1.3, 0.9, 0.8]),
        (ogden(0.00684, 1.4, 10.0), [0.7, 1.1, 1.1]),
        (ogden(0.034, 3.0, 1.0), [1.3, 0.9, 0.8]),
        (ogden(0.034, 2.0, 0.2), [0.8, 1.2, 1.1]),
        (Material::NeoHooke(NeoHooke { mu_mpa: 0.6, d_per_mpa: 0.5 }), [1.3, 0.9, 0.8]),
        (Material::MooneyRivlin(MooneyRivlin { c10_mpa: 0.3, c01_mpa: 0.05, d_per_mpa: 0.5 }), [1.3, 0.9, 0.8]),
        (Material::Yeoh(Yeoh { c10_mpa: 0.3, c20_mpa: -0.02, c30_mpa: 0.01, d_per_mpa: 0.5 }), [1.5, 0.9, 0.7]),
        (series(2), [1.3, 0.9, 0.8]),
        (series(3), [0.7, 1.2, 1.1]),
    ];
    for (law, stretch) in cases {
        let lines = law_lines(&law).unwrap();
        let mut text = format!(
            "*NODE, NSET=ALL\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
             *ELEMENT, TYPE=C3D8R, ELSET=E\n1,1,2,3,4,5,6,7,8\n*MATERIAL, NAME=M\n{lines}\
             *SOLID SECTION, ELSET=E, MATERIAL=M\n*NSET, NSET=X0\n1,4,5,8\n*NSET, NSET=Y0\n1,2,5,6\n*NSET, NSET=Z0\n1,2,3,4\n\
             *NSET, NSET=X1\n2,3,6,7\n*NSET, NSET=Y1\n3,4,7,8\n*NSET, NSET=Z1\n5,6,7,8\n\
             *STEP, NLGEOM\n*STATIC\n0.2, 1., 1e-5, 0.2\n*BOUNDARY\n"
        );
        for (axis, name) in ["X", "Y", "Z"].iter().enumerate() {
            text += &format!("{name}0,{0},{0},0.\n{name}1,{0},{0},{1:.12e}\n", axis + 1, stretch[axis] - 1.0);
        }
        for name in ["X1", "Y1", "Z1"] {
            text += &format!("*NODE PRINT, NSET={name}, TOTALS=ONLY\nRF\n");
        }
        let raw = Runner::default().run_text(&(text + "*END STEP\n")).unwrap();
        let blocks = dat::parse("job.dat", &raw.dat).unwrap();
        let expected = axial_stress(&law, stretch);
        for (axis, name) in ["X1", "Y1", "Z1"].into_iter().enumerate() {
            let last = blocks.iter().rfind(|b| b.set == name).unwrap_or_else(|| panic!("no {name}: {}", raw.log));
            assert_eq!(last.time, 1.0);
            let found = last.rows[0].1[axis];
            let scale = expected.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            assert!(
                (found - expected[axis]).abs() < 2e-6 * scale,
                "{law:?}, axis {axis}: {found} instead of {}",
                expected[axis]
            );
        }
    }
}

#[test]
fn press_and_slide_of_a_curved_block() {
    let mesh = curved_block(6, 3);
    let runner = Runner { timeout: Duration::from_secs(120), ..Runner::default() };
    let frictionless = runner.run(&block_deck(&mesh, None, vec![Step::press(&[0.5, 0.75, 1.0])])).unwrap();
    let forces: Vec<f64> = frictionless.points.iter().map(|p| p.force_n.z).collect();
    assert!(forces.windows(2).all(|w| 0.0 < w[0] && w[0] < w[1]), "{forces:?}");
    assert!(frictionless.points.iter().all(|p| p.force_n.xy().norm() < 1e-9 * p.force_n.z));
    assert!(frictionless.cpu_s > 0.0 && frictionless.cpu_s < frictionless.wall_s + 0.1);
    assert!(frictionless.increments >= 3 && frictionless.iterations > frictionless.increments);
    // The node above first touch moves with the plane, less its penetration, which is some kPa over the penalty.
    let middle = mesh.nodes.iter().position(|p| p.norm() < 1e-12).unwrap() as u32;
    let deck = block_deck(&mesh, None, vec![Step::press(&[1.0])]);
    let at = deck.pad_nodes().iter().position(|n| *n == middle).unwrap();
    let up = frictionless.points[2].pad_displacement_mm[at].z;
    assert!((0.99..1.05).contains(&up), "{up}");

    // Full slip: the Coulomb limit, along the plane's motion.
    let friction = Some(Friction { mu: 0.3, stick_slope_mpa_mm: 2.0 });
    let steps = vec![Step::press(&[0.75]), Step::slide_x(0.75, &[0.25, 1.5])];
    let slid = runner.run(&block_deck(&mesh, friction, steps)).unwrap();
    assert_eq!(slid.points.len(), 3);
    let (sticking, slipping) = (&slid.points[1], &slid.points[2]);
    assert_eq!(slipping.plane_mm, Vector3::new(1.5, 0.0, 0.75));
    assert!(sticking.force_n.x > 0.0 && sticking.force_n.x < 0.3 * sticking.force_n.z, "{:?}", sticking.force_n);
    assert!((slipping.force_n.x / slipping.force_n.z - 0.3).abs() < 1e-4, "{:?}", slipping.force_n);
    assert!(slipping.mean_pad_displacement_mm().x > 0.0);
}

#[test]
fn ties_hold_a_nail_to_the_tissue() {
    // A cube hung from a stiff tetrahedron: its four upper nodes' mean follows the held nail.
    let mut mesh = curved_block(2, 2);
    let top = mesh.node_sets.remove(set::PROXIMAL_FIX).unwrap();
    let first = mesh.nodes.len() as u32;
    for corner in [[0.0, 0.0, 6.0], [1.0, 0.0, 7.0], [0.0, 1.0, 7.0], [0.0, 0.0, 8.0]] {
        mesh.nodes.push(Vector3::from(corner));
    }
    mesh.tets.push(Tet { nodes: [first, first + 1, first + 2, first + 3], region: Region::Nail });
    mesh.node_sets.insert(set::NAIL_FIX.into(), vec![first + 1, first + 2, first + 3]);
    mesh.node_sets.insert(set::PROXIMAL_FIX.into(), top.iter().copied().filter(|n| n % 9 != 4).collect());
    let middle = top.iter().copied().find(|n| n % 9 == 4).unwrap();
    let press = || vec![Step::press(&[0.5])];
    let runner = Runner { timeout: Duration::from_secs(60), ..Runner::default() };
    let free = runner.run(&block_deck(&mesh, None, press())).unwrap().points[0].force_n.z;
    mesh.ties.push(Tie { slave: first, masters: vec![(middle, 1.0)] });
    let tied = runner.run(&block_deck(&mesh, None, press())).unwrap().points[0].force_n.z;
    mesh.node_sets.insert(set::PROXIMAL_FIX.into(), top);
    mesh.ties.clear();
    let held = runner.run(&block_deck(&mesh, None, press())).unwrap().points[0].force_n.z;
    assert!(free < 0.99 * tied, "free {free}, tied {tied}");
    assert!((tied / held - 1.0).abs() < 2e-3, "tied {tied}, held {held}");
}

#[test]
fn a_missing_program_names_its_package() {
    let mesh = curved_block(2, 1);
    let runner = Runner { program: "ccx-that-is-not-there".into(), ..Runner::default() };
    let error = runner.run(&block_deck(&mesh, None, vec![Step::press(&[0.5])])).unwrap_err().to_string();
    assert!(error.contains("`ccx-that-is-not-there`") && error.contains("`calculix-ccx`"), "{error}");
}

#[test]
fn a_time_limit_keeps_what_was_printed() {
    let mesh = curved_block(10, 5);
    let runner = Runner { timeout: Duration::from_millis(100), ..Runner::default() };
    let error = runner.run(&block_deck(&mesh, None, vec![Step::press(&[0.1, 1.5])])).unwrap_err();
    assert!(error.to_string().contains("time limit of 0.1 s"), "{error}");
    let Error::Stopped { expected: 2, partial, .. } = error else { panic!("{error}") };
    assert!(partial.points.len() < 2 && partial.wall_s < 5.0);
}

#[test]
fn an_error_of_calculix_is_passed_on() {
    let mesh = curved_block(2, 1);
    let settings = Settings { hex_type: "C3D8X".into(), ..Settings::default() };
    let deck = Deck { settings, ..block_deck(&mesh, None, vec![Step::press(&[0.5])]) };
    let error = Runner { timeout: Duration::from_secs(60), ..Runner::default() }.run(&deck).unwrap_err().to_string();
    assert!(error.contains("stopped after 0 of 1 outputs") && error.contains("*ERROR"), "{error}");
}

#[test]
fn no_field_of_a_deck_is_too_long_for_the_peer() {
    let mesh = curved_block(7, 3);
    let friction = Some(Friction { mu: 1.0 / 3.0, stick_slope_mpa_mm: 1e-11 / 3.0 });
    let steps = vec![Step::press(&[1.0 / 3.0, 0.1 + 0.2 + 0.4]), Step::slide_x(0.1 + 0.2 + 0.4, &[2.0 / 3.0])];
    let text = block_deck(&mesh, friction, steps).to_text().unwrap();
    let numbers = text.lines().filter(|line| !line.starts_with('*') && !line.contains("mm, N"));
    let longest = numbers.flat_map(|line| line.split(',')).map(|word| word.trim().len()).max();
    assert!(longest <= Some(20), "{longest:?}");
}

#[test]
fn what_a_deck_cannot_say_is_named() {
    let mesh = curved_block(2, 1);
    let good = block_deck(&mesh, None, vec![Step::press(&[0.5])]);
    let refused = |deck: Deck| deck.to_text().unwrap_err().to_string();
    let mut bad = good.clone();
    bad.materials.remove(&Region::Skin);
    assert_eq!(refused(bad), "deck: region `skin` has elements but no material");
    let mut bad = good.clone();
    let terms = [OgdenTerm { mu_mpa: 0.1, alpha: 2.0 }; 4];
    bad.materials.insert(Region::Skin, Some(Material::OgdenSeries(OgdenSeries::new(&terms, 1.0).unwrap())));
    assert_eq!(refused(bad), "deck: region `skin`: an Ogden law of 4 terms; CalculiX has 3 at most");
    let bad = Deck { fixed_sets: vec!["bones".into()], ..good.clone() };
    assert_eq!(refused(bad), "deck: the fixed node set `bones` is empty or missing");
    let bad = Deck { steps: vec![Step::press(&[1.0, 0.5])], ..good.clone() };
    assert!(refused(bad).starts_with("deck: step 0: outputs must be increasing"));
    let bad = Deck { steps: vec![Step::slide_x(0.5, &[1.0])], ..good };
    assert!(refused(bad).starts_with("deck: step 0 moves 1.118"));
}
