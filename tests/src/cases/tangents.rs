//! Every tangent against finite differences: materials, elements, whole bodies, contact in stick and slip.

use crate::{
    differences::{unit_directions, worst_error},
    equilibrium::multiply_symmetric,
    problems::blocks::{paraboloid, tied_block},
    random::Random,
    verify,
};
use fingerpad_fe::assembly::{Body, Configuration, Joint, Material, Supports, TissueStep};
use fingerpad_fe::contact::{
    Coordinates, Evaluation, Friction, NodeTangent, Parts, PenaltySettings, Plane, RubberFriction, Surface, Tangential,
};
use fingerpad_fe::element::{Batch, Constitutive, Hex8, Tangent, Tet4, Tet10};
use fingerpad_fe::load_path::{BoneKind, Finger, Tissue};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, Region, block::coordinates, fingertip};
use fingerpad_fe::solve::{Guess, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::{Matrix3, Rotation3, Vector3};
use wide::f64x8;

use super::hyperelastic::{laws, pack, unpack};

const BOUND: f64 = 1e-6;

fn ogden(alpha: f64) -> Ogden {
    Ogden { mu_mpa: 0.034, alpha, d_per_mpa: 1.0 }
}

fn svk() -> SaintVenantKirchhoff {
    SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 }
}

/// Error of the stress against the energy and of the moduli against the stress, at `f`.
///
/// With the velocity gradient l: dU = tau : l, and the Lie derivative d tau − l tau − tau l^T = c : sym(l).
/// The stress, which may vanish, is measured against at least `modulus_mpa` times 1 %.
fn material_errors(law: &impl Constitutive, modulus_mpa: f64, f: &Matrix3<f64>) -> [f64; 2] {
    let at = |l: &[f64], s: f64| {
        let f = (Matrix3::identity() + Matrix3::from_column_slice(l) * s) * f;
        (pack(&(f * f.transpose())), f64x8::splat(f.determinant()))
    };
    let (b, j) = at(&[0.0; 9], 0.0);
    let (tau, c) = law.moduli(&b, j);
    assert!((unpack(&tau) - unpack(&law.stress(&b, j))).norm() <= 1e-12 * unpack(&tau).norm());
    let tau = unpack(&tau);
    let directions = unit_directions(9);
    // The stress in one list, so that each component is measured against the largest.
    let energy = worst_error(
        1e-3,
        &[vec![0.0]],
        |_, s| {
            let value = |d: &Vec<f64>| {
                let (b, j) = at(d, s);
                law.energy(&b, j).to_array()[0]
            };
            directions.iter().map(value).chain([0.01 * modulus_mpa * s]).collect()
        },
        |_| tau.iter().copied().chain([0.01 * modulus_mpa]).collect(),
    );
    let moduli = worst_error(
        1e-3,
        &directions,
        |l, s| {
            let (b, j) = at(l, s);
            unpack(&law.stress(&b, j)).as_slice().to_vec()
        },
        |l| {
            let l = Matrix3::from_column_slice(l);
            let d = (l + l.transpose()) * 0.5;
            let strain = [d[(0, 0)], d[(1, 1)], d[(2, 2)], 2.0 * d[(0, 1)], 2.0 * d[(1, 2)], 2.0 * d[(0, 2)]];
            let row = |k: usize| (0..6).map(|m| c[k][m].to_array()[0] * strain[m]).sum::<f64>();
            let lie = unpack(&std::array::from_fn(|k| f64x8::splat(row(k))));
            (lie + l * tau + tau * l.transpose()).as_slice().to_vec()
        },
    );
    [energy, moduli]
}

/// [`material_errors`] of any material.
fn errors_of(material: &Material, f: &Matrix3<f64>) -> [f64; 2] {
    let modulus_mpa = material.shear_mpa();
    match material {
        Material::NeoHooke(law) => material_errors(law, modulus_mpa, f),
        Material::MooneyRivlin(law) => material_errors(law, modulus_mpa, f),
        Material::Yeoh(law) => material_errors(law, modulus_mpa, f),
        Material::OgdenSeries(law) => material_errors(law, modulus_mpa, f),
        Material::Ogden(law) => material_errors(law, modulus_mpa, f),
        Material::Linear(law) => material_errors(law, modulus_mpa, f),
    }
}

pub fn material_tangents() {
    let turn = Rotation3::new(Vector3::new(0.5, -0.3, 0.8)).into_inner();
    let principal = |a: f64, b: f64, c: f64| turn * Matrix3::from_diagonal(&Vector3::new(a, b, c)) * turn.transpose();
    let shear = Matrix3::new(1.1, 0.8, -0.2, 0.1, 0.9, 0.3, -0.1, 0.2, 1.05);
    let mut worst = [[0.0f64; 2]; 3];
    let mut note = |slot: usize, errors: [f64; 2]| {
        for (w, e) in worst[slot].iter_mut().zip(errors) {
            *w = if e > *w || e.is_nan() { e } else { *w };
        }
    };
    for alpha in [1.4, 2.0, -3.0, 8.0] {
        for f in [shear, principal(0.5, 1.2, 1.9), principal(0.3, 0.31, 3.0)] {
            note(0, material_errors(&ogden(alpha), 0.034, &f));
        }
        // Equal and nearly equal stretches, on both sides of the limit below which the quotient is evaluated as a
        // series.
        for gap in [0.0, 1e-14, 1e-10, 1e-7, 1e-4, 2.4e-3, 2.6e-3, 1e-2] {
            for f in [principal(1.2, 1.2 + gap, 0.8), principal(1.2, 1.2 + gap, 1.2 - gap)] {
                note(1, material_errors(&ogden(alpha), 0.034, &(f * (1.0 + 1e-3 * shear[(0, 1)]))));
            }
        }
    }
    for f in [shear, principal(0.9, 1.05, 1.05), principal(0.97, 1.0, 1.1)] {
        note(2, material_errors(&svk(), 100.0, &f));
    }
    for (case, law) in laws().into_iter().filter(|(case, _)| *case != "Ogden") {
        let mut worst = [0.0f64; 2];
        for f in [shear, principal(0.5, 1.2, 1.9), principal(1.2, 1.2, 0.8), principal(1.2, 1.2003, 1.2), 1.01 * shear]
        {
            let errors = errors_of(&law, &f);
            assert!(errors.iter().all(|e| e.is_finite()));
            (0..2).for_each(|k| worst[k] = worst[k].max(errors[k]));
        }
        verify(&format!("tangent {case}"), "stress against energy", worst[0], BOUND);
        verify(&format!("tangent {case}"), "moduli against stress", worst[1], BOUND);
    }
    for (slot, case) in ["Ogden", "Ogden, equal and near-equal stretches", "Saint Venant-Kirchhoff"].iter().enumerate()
    {
        verify(&format!("tangent {case}"), "stress against energy", worst[slot][0], BOUND);
        verify(&format!("tangent {case}"), "moduli against stress", worst[slot][1], BOUND);
    }
}

/// Errors of forces and tangent of eight elements whose nodes are disturbed, each lane by itself.
fn element_errors<const N: usize, const Q: usize>(
    batch: &Batch<N, Q>,
    law: &impl Constitutive,
    x: &[Vector3<f64>],
) -> [f64; 2] {
    let mut tangent = Tangent::new();
    batch.tangent(law, x, &mut tangent);
    let mut worst = [0.0f64; 2];
    for lane in 0..batch.len {
        let nodes: [usize; N] = std::array::from_fn(|a| batch.nodes[a][lane] as usize);
        let moved = |d: &[f64], s: f64| {
            let mut x = x.to_vec();
            for a in 0..N {
                x[nodes[a]] += Vector3::new(d[3 * a], d[3 * a + 1], d[3 * a + 2]) * s;
            }
            x
        };
        let forces = |x: &[Vector3<f64>]| -> Vec<f64> {
            batch.forces(law, x).force.iter().flatten().map(|f| f.to_array()[lane]).collect()
        };
        let exact_force = forces(x);
        let energies = worst_error(
            1e-3,
            &[vec![]],
            |_, s| unit_directions(3 * N).iter().map(|d| batch.energies(law, &moved(d, s))[lane]).collect(),
            |_| exact_force.clone(),
        );
        let product = |d: &[f64]| -> Vec<f64> {
            let entry = |row: usize, column: usize| {
                let (row, column) = if row / 3 >= column / 3 { (row, column) } else { (column, row) };
                tangent.block[row / 3][column / 3][row % 3][column % 3].to_array()[lane]
            };
            (0..3 * N).map(|row| (0..3 * N).map(|column| entry(row, column) * d[column]).sum()).collect()
        };
        let stiffness = worst_error(1e-3, &unit_directions(3 * N), |d, s| forces(&moved(d, s)), product);
        worst = [worst[0].max(energies), worst[1].max(stiffness)];
    }
    worst
}

pub fn element_tangents() {
    // Three elements (not eight: the unused lanes must not matter), distorted and deformed by up to 0.15.
    let corners: Vec<Vector3<f64>> =
        (0..32).map(|n| Vector3::new(f64::from(n / 8), f64::from((n / 4) % 2), f64::from((n / 2) % 2))).collect();
    let mut random = Random::new(21);
    let node = |i: u32, j: u32, k: u32| 8 * i + 4 * j + 2 * k;
    let hexes: Vec<[u32; 8]> = (0..3)
        .map(|i| {
            let level = |k| [node(i, 0, k), node(i + 1, 0, k), node(i + 1, 1, k), node(i, 1, k)];
            let ([a, b, c, d], [e, f, g, h]) = (level(0), level(1));
            [a, b, c, d, e, f, g, h]
        })
        .collect();
    let tets: Vec<[u32; 4]> = hexes.iter().map(|h| [h[0], h[1], h[2], h[6]]).collect();
    let undeformed: Vec<Vector3<f64>> = corners.iter().map(|p| p + 0.1 * random.vector()).collect();
    let x: Vec<Vector3<f64>> = undeformed.iter().map(|p| p * 1.1 + 0.15 * random.vector()).collect();
    let (hex, tet) = (Hex8::new(&hexes, &undeformed).unwrap(), Tet4::new(&tets, &undeformed).unwrap());
    let second_order = second_order(&tets, &corners, &mut random);
    let tet10 = Tet10::new(&second_order.0, &second_order.1).unwrap();
    let x10: Vec<Vector3<f64>> = second_order.1.iter().map(|p| p * 1.1 + 0.08 * random.vector()).collect();
    let cases = [
        ("hexahedron Ogden", element_errors(&hex, &ogden(1.4), &x)),
        ("hexahedron Saint Venant-Kirchhoff", element_errors(&hex, &svk(), &x)),
        ("tetrahedron Ogden", element_errors(&tet, &ogden(1.4), &x)),
        ("tetrahedron Saint Venant-Kirchhoff", element_errors(&tet, &svk(), &x)),
        ("10-node tetrahedron Ogden", element_errors(&tet10, &ogden(1.4), &x10)),
        ("10-node tetrahedron Saint Venant-Kirchhoff", element_errors(&tet10, &svk(), &x10)),
    ];
    for (case, [forces, stiffness]) in cases {
        verify(&format!("tangent {case}"), "forces against energy", forces, BOUND);
        verify(&format!("tangent {case}"), "stiffness against forces", stiffness, BOUND);
    }
}

/// Tetrahedra with a node near the middle of each edge of their own.
fn second_order(
    tets: &[[u32; 4]],
    corners: &[Vector3<f64>],
    random: &mut Random,
) -> (Vec<[u32; 10]>, Vec<Vector3<f64>>) {
    let mut positions = corners.to_vec();
    let elements = tets.iter().map(|&[a, b, c, d]| {
        let first = positions.len() as u32;
        for [m, n] in [[a, b], [b, c], [a, c], [a, d], [b, d], [c, d]] {
            let middle = (corners[m as usize] + corners[n as usize]) / 2.0;
            positions.push(middle + 0.03 * random.vector());
        }
        std::array::from_fn(|n| if n < 4 { [a, b, c, d][n] } else { first + n as u32 - 4 })
    });
    (elements.collect(), positions)
}

/// A soft block with a rigid cell in it, a tied plate whose upper face is fixed, two held components.
pub fn composite() -> Body {
    let line = coordinates(0.0, 3.0, 3, 1.0);
    let nail = coordinates(0.4, 2.7, 2, 1.0);
    let mesh = tied_block([&line, &line, &line], &nail, &nail, 2, 0.6);
    let inner = |p: &Vector3<f64>| p.iter().all(|c| *c > 0.5 && *c < 2.5);
    let rigid = (0..64u32).filter(|&n| inner(&mesh.nodes[n as usize])).collect();
    let supports = Supports {
        fixed: mesh.node_set("nail_fix").to_vec(),
        fixed_components: vec![(0, 0), (3, 2)],
        rigid,
        contact: mesh.node_set("z0").to_vec(),
        ..Supports::default()
    };
    let material = |region| {
        Some(match region {
            Region::Nail => Material::Linear(SaintVenantKirchhoff { young_mpa: 0.1, poisson: 0.3 }),
            _ => Material::Ogden(ogden(1.4)),
        })
    };
    let joint = Joint { translation_n_per_mm: 0.05, rotation_nmm_per_rad: 0.2 };
    Body::new(&mesh, material, &supports, Vector3::new(0.7, 1.6, 1.9), joint).unwrap()
}

/// The body moved at random by up to `amplitude` (mm; rad times two for the rigid body's rotation).
pub fn disturbed(body: &Body, amplitude: f64, seed: u64) -> Configuration {
    let mut step = Random::new(seed).list(body.dofs.count);
    step.iter_mut().for_each(|s| *s *= amplitude);
    if let Some(dof) = body.dofs.rigid_dof() {
        step[dof + 3..dof + 6].iter_mut().for_each(|s| *s *= 2.0);
    }
    body.dofs.held.iter().for_each(|&dof| step[dof] = 0.0);
    body.advance(body.undeformed(), &step, 1.0)
}

/// The directions without motion of held dofs.
pub fn free(body: &Body, mut directions: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    directions.iter_mut().for_each(|d| body.dofs.held.iter().for_each(|&dof| d[dof] = 0.0));
    directions.retain(|d| d.iter().any(|v| *v != 0.0));
    directions
}

/// Error of the tangent against differences of the residual.
///
/// The tangent is the Hessian along rotation vectors phi; the residual's moment m is spatial. From
/// dE/dphi = J_l(phi)^T m and J_l = I + [phi]/2 + ..., the moment's derivative is the Hessian's minus m x phi/2.
pub fn body_error(
    body: &Body,
    at: &Configuration,
    tissue: Option<&TissueStep>,
    h: f64,
    directions: &[Vec<f64>],
) -> f64 {
    let (mut values, mut residual) = (Vec::new(), Vec::new());
    body.tangent((at, tissue), &mut values);
    body.residual((at, tissue), &mut residual).unwrap();
    let along = |d: &[f64], s: f64| {
        let mut out = Vec::new();
        body.residual((&body.advance(at, d, s), tissue), &mut out).unwrap();
        out
    };
    let exact = |d: &[f64]| {
        let mut product = multiply_symmetric(&body.dofs.pattern, &values, d);
        if let Some(dof) = body.dofs.rigid_dof() {
            let part = |v: &[f64]| Vector3::new(v[dof + 3], v[dof + 4], v[dof + 5]);
            let skew = part(&residual).cross(&part(d)) * 0.5;
            (0..3).for_each(|i| product[dof + 3 + i] -= skew[i]);
        }
        product
    };
    worst_error(h, directions, along, exact)
}

pub fn body_tangents() {
    let body = composite();
    assert!(body.dofs.rigid_dof().is_some());
    let at = disturbed(&body, 0.1, 4);
    verify(
        "tangent block with rigid bone and tied nail",
        "error, every dof",
        body_error(&body, &at, None, 1e-3, &free(&body, unit_directions(body.dofs.count))),
        BOUND,
    );
    for kind in [BoneKind::Floating, BoneKind::Deformable] {
        let tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
        let mut tissue = Tissue::default();
        tissue.bone.kind = kind;
        // As soft as the skin, so that the error of the skin's part is not hidden behind a stiff part.
        tissue.nail.young_mpa = 0.1;
        tissue.bone.elastic.young_mpa = 0.1;
        let finger = Finger::new(tip, &tissue).unwrap();
        let at = disturbed(&finger.body, 0.02, 6);
        let mut random = Random::new(9);
        let directions = free(&finger.body, (0..6).map(|_| random.list(finger.body.dofs.count)).collect());
        verify(
            &format!("tangent coarse finger, bone {kind:?}"),
            "error, 6 random directions",
            body_error(&finger.body, &at, None, 1e-4, &directions),
            BOUND,
        );
    }
}

/// Moves the plane in one increment.
fn moved(solver: &mut Solver, last: &State, to: Coordinates) -> State {
    let guess = Guess { plane: last.contact.plane.moved_to(to), ..Guess::at(last) };
    solver.step(last, Target::place(to), guess, &mut Stats::default(), &mut unwatched).unwrap()
}

/// The derivative of `exact` at `position`, applied to a motion of the nodes (mm) and of the six coordinates.
fn product(surface: &Surface, exact: &Evaluation, position: &[Vector3<f64>], plane: &Plane, d: &[f64]) -> Vec<f64> {
    let (moves, rates) = d.split_at(3 * position.len());
    let mut out = vec![Vector3::zeros(); position.len()];
    for NodeTangent { node, by, block } in &exact.tangents {
        out[*node] += block * Vector3::from_column_slice(&moves[3 * by..3 * by + 3]);
    }
    let foot = surface.frame(plane).foot();
    for (k, rate) in rates.iter().enumerate() {
        let column = surface.change_with_plane(exact, position, &foot, &plane.twist(k, &surface.reach));
        out.iter_mut().zip(column).for_each(|(sum, c)| *sum += c * *rate);
    }
    out.iter().flat_map(|f| [f.x, f.y, f.z]).collect()
}

pub fn contact_tangents() {
    // A paraboloid of radius 6 mm on a plane that is pitched, rolled and spun, pressed and then moved in all six
    // coordinates: by less than the elastic slip, part of the way, far.
    let (mesh, body) = paraboloid(&Rotation3::identity());
    let rubber = Friction::On(RubberFriction::default());
    for (case, friction, slides) in [
        ("without friction", Friction::Off, vec![0.1]),
        ("stick", rubber, vec![0.002]),
        ("stick and slip", rubber, vec![0.02, 0.1]),
        ("slip", rubber, (1..=8).map(|k| 0.1 * f64::from(k)).collect()),
    ] {
        let penalty = PenaltySettings::default();
        let mut solver = Solver::new(&body, &mesh.pad_faces, friction, penalty, SolverSettings::default());
        let place = |depth: f64, s: f64| [s, 0.3 * s, depth, 0.4 + 0.05 * s, 0.1 - 0.02 * s, 0.03 * s - 0.06];
        let mut last = solver.initial_state(Plane::new(place(0.0, 0.0)));
        for depth in [0.05, 0.1, 0.2] {
            last = moved(&mut solver, &last, place(depth, 0.0));
        }
        let mut before = last.clone();
        for slide in slides {
            before = last;
            last = moved(&mut solver, &before, place(0.2, slide));
        }
        let touching: Vec<bool> =
            last.contact.nodes.iter().filter(|n| n.normal_force_n > 0.0).map(|n| n.stuck).collect();
        let stuck = touching.iter().filter(|s| **s).count();
        println!("contact {case}: {stuck} of {} nodes stick", touching.len());
        match case {
            "without friction" => assert!(touching.len() > 5),
            "stick" => assert!(stuck > touching.len() / 2),
            "slip" => assert_eq!(stuck, 0),
            _ => assert!(stuck > 0 && stuck < touching.len()),
        }
        // The increment from `before` to `last`.
        let surface = solver.surface();
        let position: Vec<Vector3<f64>> = surface.nodes.iter().map(|&n| last.configuration.x[n as usize]).collect();
        let plane = last.contact.plane;
        let evaluate = |x: &[Vector3<f64>], plane: &Plane, tangent: bool| {
            surface.evaluate(&friction, &before.contact, Parts::Followed, x, plane, Tangential::Law, tangent)
        };
        let exact = evaluate(&position, &plane, true);
        let n = 3 * position.len();
        let mut random = Random::new(31);
        let mut directions: Vec<Vec<f64>> = (0..12).map(|_| random.list(n + 6)).collect();
        // Without friction nothing changes along the plane.
        let coordinates = if friction == Friction::Off { Vec::new() } else { unit_directions(6) };
        directions.extend(coordinates.into_iter().map(|d| [vec![0.0; n], d].concat()));
        let along = |d: &[f64], s: f64| {
            let (moves, rates) = d.split_at(n);
            let x: Vec<Vector3<f64>> =
                position.iter().zip(moves.chunks(3)).map(|(x, d)| x + Vector3::from_column_slice(d) * s).collect();
            let plane = plane.moved_to(std::array::from_fn(|k| plane.at[k] + rates[k] * s));
            evaluate(&x, &plane, false).residual.iter().flat_map(|f| [f.x, f.y, f.z]).collect()
        };
        let exact = |d: &[f64]| product(surface, &exact, &position, &plane, d);
        // Small enough that no node changes between stick and slip or leaves the plane within it. If all slip, the
        // rounding of the penalty's force is comparable to friction's small slope.
        let bound = if case == "slip" { 1e-5 } else { BOUND };
        verify(&format!("tangent contact, {case}"), "error", worst_error(1e-7, &directions, along, exact), bound);
    }
}
