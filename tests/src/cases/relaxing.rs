//! Tissue that relaxes, in the finite elements: closed forms at a point, derivatives, work, press and hold.

use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::{Branch, Relaxation, pad};
use fingerpad_fe::assembly::{Body, Configuration, TissueMemory};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{BoneKind, Drive, Finger, Path, Problem, Response, Tissue, Trajectory, Waypoint};
use fingerpad_fe::material::relaxation::text;
use fingerpad_fe::material::{Material, Ogden};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, fingertip};
use fingerpad_reduce::pad::{branches_of_force, simulate_path_on_pad};
use fingerpad_reduce::{Tip, simulate_path};
use nalgebra::{Matrix3, Vector3};

use super::energy::error as energy_error;
use super::hyperelastic::{laws, unit_cube};
use super::tangents::{body_error, composite, disturbed, free};
use crate::differences::unit_directions;
use crate::problems::{
    blocks::{all_held, body_of},
    fingers::{follow, problem},
};
use crate::random::Random;
use crate::verify;

/// G(t) of the branches.
fn relaxed_by(t_s: f64) -> f64 {
    let branches = Relaxation::HUMAN_ASSUMED.cast::<f64>();
    1.0 + branches.branches().iter().map(|b| b.share * (-t_s / b.time_s).exp()).sum::<f64>()
}

fn memory_of(body: &Body) -> TissueMemory {
    body.memory(&Relaxation::HUMAN_ASSUMED).expect("soft elements")
}

/// The unit cube under a homogeneous deformation.
fn moved(body: &Body, f: &Matrix3<f64>) -> Configuration {
    let mut at = body.undeformed().clone();
    at.x.iter_mut().for_each(|x| *x = f * *x);
    at
}

/// Stress of the cube's element, MPa.
fn stress(body: &Body, at: &Configuration, memory: &TissueMemory) -> [f64; 6] {
    body.stresses((at, Some(&memory.present())))[0].cauchy_mpa
}

pub fn a_step_and_hold_relaxes_as_the_sum_of_the_branches() {
    let mesh = unit_cube();
    let (mut worst, mut turned) = (0.0f64, 0.0f64);
    for (_, law) in laws() {
        let body = body_of(&mesh, law, &all_held(&mesh));
        for stretch in [0.5f64, 0.9, 1.2, 3.0] {
            let pull = Matrix3::from_diagonal(&Vector3::new(stretch, stretch.powf(-0.5), stretch.powf(-0.5)));
            let at = moved(&body, &pull);
            let relaxed = body.stresses(&at)[0].cauchy_mpa;
            let mut memory = memory_of(&body);
            body.remember(&mut memory, 0.0, &at);
            let mut t_s = 0.0;
            for dt_s in [0.0, 1e-4, 3e-3, 0.02, 0.02, 0.4, 1.5, 40.0] {
                let of_step = body.stresses((&at, Some(&memory.step(dt_s))))[0].cauchy_mpa;
                body.remember(&mut memory, dt_s, &at);
                t_s += dt_s;
                let now = stress(&body, &at, &memory);
                let ratio = |s: &[f64; 6]| (s[0] - s[1]) / (relaxed[0] - relaxed[1]);
                for stress in [of_step, now] {
                    worst = worst.max((ratio(&stress) / relaxed_by(t_s) - 1.0).abs());
                }
            }
            // The memory turns with the body, and acts along the axes of the undeformed frame.
            let turn = nalgebra::Rotation3::new(Vector3::new(0.4, -1.0, 0.6)).into_inner();
            let mut memory = memory_of(&body);
            body.remember(&mut memory, 0.0, &at);
            let forces = |at: &Configuration| body.nodal_forces((at, Some(&memory.step(0.01))));
            let scale = forces(&at).iter().map(|f| f.norm()).fold(0.0, f64::max);
            for (a, b) in forces(&at).iter().zip(forces(&moved(&body, &(turn * pull)))) {
                turned = turned.max((turn * a - b).norm() / scale);
            }
        }
    }
    verify("relaxing tissue, step and hold", "error of the stress over 1 + sum g exp(-t/tau)", worst, 1e-10);
    verify("relaxing tissue, turned after a step", "error of the forces", turned, 1e-9);
}

pub fn a_ramp_has_an_error_of_second_order_in_the_time_step() {
    let mesh = unit_cube();
    let (_, law) = laws().swap_remove(0);
    let body = body_of(&mesh, law, &all_held(&mesh));
    // Stress at the end of a ramp of the logarithmic strain in 0.1 s.
    let end = |steps: u32| {
        let mut memory = memory_of(&body);
        let mut difference = 0.0;
        for k in 0..=steps {
            let l = (0.4 * f64::from(k) / f64::from(steps)).exp();
            let at = moved(&body, &Matrix3::from_diagonal(&Vector3::new(l, l.powf(-0.5), l.powf(-0.5))));
            body.remember(&mut memory, if k == 0 { 0.0 } else { 0.1 / f64::from(steps) }, &at);
            let [axial, lateral, ..] = stress(&body, &at, &memory);
            difference = axial - lateral;
        }
        difference
    };
    let exact = (4.0 * end(3200) - end(1600)) / 3.0;
    let errors = [100, 200].map(|steps| (end(steps) / exact - 1.0).abs());
    verify("relaxing tissue, ramp of 0.1 s", "error of the stress, 100 steps", errors[0], 1e-3);
    verify(
        "relaxing tissue, ramp of 0.1 s",
        "error with twice the steps over a quarter",
        4.0 * errors[1] / errors[0],
        1.2,
    );
}

pub fn no_closed_path_yields_work_at_any_pace() {
    let mesh = unit_cube();
    let mut random = Random::new(17);
    let mut least = f64::INFINITY;
    for (_, law) in laws() {
        let body = body_of(&mesh, law, &all_held(&mesh));
        for path in 0..40 {
            let mut memory = memory_of(&body);
            // Principal logarithmic strains at constant volume; stretches up to 5, as the second Piola form loses work there.
            let reach = [0.05, 0.4, 1.6][path % 3];
            let corners: Vec<[f64; 2]> =
                (0..5).map(|_| std::array::from_fn(|_| 0.5 * reach * random.list(1)[0])).collect();
            let (mut from, mut work, mut exchanged) = ([0.0; 2], 0.0, 0.0f64);
            for to in corners.iter().copied().chain([[0.0; 2]]) {
                let steps = 1 + (8.0 * random.list(1)[0].abs()) as u32;
                let dt_s = [0.0, 1e-5, 1e-3, 0.03, 1.0, 1e8][(6.0 * random.list(1)[0].abs()) as usize % 6];
                for k in 1..=steps {
                    let share = f64::from(k) / f64::from(steps);
                    let e: [f64; 2] = std::array::from_fn(|i| from[i] + share * (to[i] - from[i]));
                    let f = Vector3::new(e[0].exp(), e[1].exp(), (-e[0] - e[1]).exp());
                    let at = moved(&body, &Matrix3::from_diagonal(&f));
                    body.remember(&mut memory, dt_s, &at);
                    // The volume is constant, so that this is the Kirchhoff stress.
                    let tau = stress(&body, &at, &memory);
                    let by: [f64; 2] = std::array::from_fn(|i| (to[i] - from[i]) / f64::from(steps));
                    let done = (tau[0] - tau[2]) * by[0] + (tau[1] - tau[2]) * by[1];
                    work += done;
                    exchanged += done.abs();
                }
                from = to;
            }
            assert!(exchanged > 0.0);
            least = least.min(work / exchanged);
        }
    }
    println!("least work over what is exchanged: {least:+.3}");
    verify("relaxing tissue, 360 closed paths", "work gained over what is exchanged", (-least).max(0.0), 1e-9);
}

/// A memory after two disturbances of the body.
fn disturbed_memory(body: &Body, amplitude: f64) -> TissueMemory {
    let mut memory = memory_of(body);
    for (seed, dt_s) in [(31, 0.01), (32, 0.05)] {
        body.remember(&mut memory, dt_s, &disturbed(body, amplitude, seed));
    }
    memory
}

pub fn tangent_and_forces_of_a_step_are_derivatives() {
    let body = composite();
    let step = disturbed_memory(&body, 0.1).step(0.02);
    let at = disturbed(&body, 0.1, 4);
    let directions = free(&body, unit_directions(body.dofs.count));
    let case = "relaxing tissue, block with rigid bone and tied nail";
    verify(case, "error of the tangent, every dof", body_error(&body, &at, Some(&step), 1e-3, &directions), 1e-6);
    verify(case, "error of the forces, every dof", energy_error(&body, &at, Some(&step), 1e-3, &directions), 1e-6);
    // Equal stretches, of which the quotients are series: a cube of one element about an isotropic state.
    let mesh = unit_cube();
    let mut worst = 0.0f64;
    for (_, law) in laws() {
        let body = body_of(&mesh, law, &all_held(&mesh));
        let mut memory = memory_of(&body);
        let shear = Matrix3::new(1.1, 0.3, -0.2, 0.1, 0.9, 0.25, -0.1, 0.2, 1.05);
        body.remember(&mut memory, 0.01, &moved(&body, &shear));
        let step = memory.step(0.02);
        for [a, b] in [[0.0, 0.0], [1e-9, 1e-5], [1e-4, 4e-3], [6e-3, 0.012], [0.02, 0.3], [0.0, 0.4]] {
            let turn = nalgebra::Rotation3::new(Vector3::new(0.5, -0.3, 0.8)).into_inner();
            let f = turn
                * Matrix3::from_diagonal(&Vector3::new(1.1, 1.1 * f64::exp(a), 1.1 * f64::exp(b)))
                * turn.transpose();
            let gradient = |d: &[f64]| Matrix3::from_column_slice(d);
            let forces = body.nodal_forces((&moved(&body, &f), Some(&step)));
            // A force that may vanish is measured against at least 0.01 N.
            let work = |d: &[f64]| {
                let along = body.undeformed().x.iter().zip(&forces).map(|(x, force)| force.dot(&(gradient(d) * x)));
                vec![along.sum(), 0.01]
            };
            let energy =
                |d: &[f64], s: f64| vec![body.energy((&moved(&body, &(f + gradient(d) * s)), Some(&step))).0, 0.01 * s];
            worst = worst.max(crate::differences::worst_error(1e-3, &unit_directions(9), energy, work));
        }
    }
    verify("relaxing tissue, nearly equal stretches", "error of the forces against the energy", worst, 1e-6);
}

/// A press to a depth in a time, and a hold.
fn press_and_hold(depth_mm: f64, press_s: f64, holds_s: &[f64]) -> Path {
    let corner = |t_s, normal| Waypoint { t_s, normal, x: 0.0, y: 0.0 };
    let mut corners = vec![corner(0.0, 0.0), corner(press_s, depth_mm)];
    corners.extend(holds_s.iter().map(|t_s| corner(press_s + t_s, depth_mm)));
    Path::new([Drive::Displacement; 3], corners)
}

pub fn without_branches_and_after_a_long_time_the_finger_is_as_ever() {
    let finger = coarse(BoneKind::Floating, 1.0);
    let of = |relaxation: Relaxation, step_s: f64| -> Trajectory {
        let corner = |t_s: f64, normal, x| Waypoint { t_s: t_s * step_s, normal, x, y: 0.0 };
        let path = Path::new(
            [Drive::Displacement; 3],
            vec![corner(0.0, 0.0, 0.0), corner(5.0, 0.3, 0.0), corner(8.0, 0.3, 0.3)],
        );
        let problem =
            Problem { relaxation, half: finger.half.as_ref(), ..problem(&finger.body, &finger.mesh.pad_faces) };
        follow(&problem, &path).unwrap()
    };
    let (plain, slow) = (of(Relaxation::none(), 1.0), of(Relaxation::HUMAN_ASSUMED, 1e5));
    let zero = Relaxation::new(&[Branch { share: 0.0, time_s: 0.1 }]).unwrap();
    assert_eq!(format!("{plain:?}").replace(&format!("{:?}", plain.cost), ""), {
        let other = of(zero, 1.0);
        format!("{other:?}").replace(&format!("{:?}", other.cost), "")
    });
    assert_eq!(plain.responses.len(), slow.responses.len());
    let mut worst = 0.0f64;
    for (a, b) in plain.responses.iter().zip(&slow.responses) {
        for (a, b) in [(a.normal_force_n, b.normal_force_n), (a.friction_x_n, b.friction_x_n)] {
            worst = worst.max((a - b).abs());
        }
    }
    verify("relaxing tissue, 1e4 s an increment", "difference from tissue without branches, N", worst, 1e-7);
}

/// The coarse finger with soft tissue of `factor` times the bulk modulus.
fn coarse(kind: BoneKind, factor: f64) -> Finger {
    let tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
    let mut tissue = Tissue { relaxation: Relaxation::HUMAN_ASSUMED, ..Tissue::default() };
    tissue.bone.kind = kind;
    for law in [&mut tissue.skin, &mut tissue.subcutaneous] {
        let Material::Ogden(Ogden { d_per_mpa, .. }) = law else { panic!("an Ogden law of one term") };
        *d_per_mpa /= factor;
    }
    Finger::new(tip, &tissue).unwrap()
}

/// Largest errors of the force over that of relaxed tissue against G(t), and of the area, in a press of 1 mm and a hold.
fn hold_errors(finger: &Finger) -> [f64; 2] {
    let problem = Problem {
        friction: None,
        relaxation: finger.relaxation,
        half: finger.half.as_ref(),
        ..problem(&finger.body, &finger.mesh.pad_faces)
    };
    let run = follow(&problem, &press_and_hold(1.0, 1e-6, &[140.0])).unwrap();
    let last = *run.responses.last().unwrap();
    let (mut worst, mut area) = (0.0f64, 0.0f64);
    for r in run.responses.iter().filter(|r| r.depth_mm >= 1.0) {
        let error = r.normal_force_n / last.normal_force_n / relaxed_by(r.t_s - 1e-6) - 1.0;
        let change = r.contact_area_mm2 / last.contact_area_mm2 - 1.0;
        println!("{:.4} s: force {:+.2} %, area {:+.2} %", r.t_s, 100.0 * error, 100.0 * change);
        (worst, area) = (worst.max(error.abs()), area.max(change.abs()));
    }
    [worst, area]
}

/// The pressure in the tissue is elastic, so that tissue that can be compressed relaxes by less. The pass line of 1 % holds for tissue that
/// cannot; the published tissue, with its bulk modulus of 30 to 60 shear moduli, and the joint of the bone, which is elastic, miss it, and
/// so does their area, whose line is 0.3 %.
pub fn a_finger_pressed_and_held_relaxes_as_its_tissue() {
    for (case, kind, factor, bounds) in [
        ("bone fixed, 30 times the bulk modulus", BoneKind::Fixed, 30.0, [0.01, 0.003]),
        ("bone fixed", BoneKind::Fixed, 1.0, [0.08, 0.045]),
        ("bone on its joint", BoneKind::Floating, 1.0, [0.1, 0.06]),
    ] {
        println!("{case}");
        let [force, area] = hold_errors(&coarse(kind, factor));
        let case = format!("relaxing tissue, press and hold, {case}");
        verify(&case, "error of the force over that of relaxed tissue", force, bounds[0]);
        verify(&case, "change of the area", area, bounds[1]);
    }
}

/// Presses, slides and lifts on a closed path at several paces: the plane puts work in.
pub fn a_closed_path_of_the_plane_takes_work_at_any_pace() {
    let finger = coarse(BoneKind::Floating, 1.0);
    for pace_s in [1e-4, 0.02, 1.0] {
        let corner = |t_s: f64, normal, x| Waypoint { t_s: t_s * pace_s, normal, x, y: 0.0 };
        let corners = vec![
            corner(0.0, -0.05, 0.0),
            corner(1.0, 0.4, 0.0),
            corner(2.0, 0.4, 0.3),
            corner(3.0, 0.3, 0.0),
            corner(4.0, -0.05, 0.0),
        ];
        let problem = Problem {
            relaxation: finger.relaxation,
            half: finger.half.as_ref(),
            ..problem(&finger.body, &finger.mesh.pad_faces)
        };
        let run = follow(&problem, &Path::new([Drive::Displacement; 3], corners)).unwrap();
        let (work, friction) = (run.work.plane_mj, run.work.friction_mj);
        println!("pace {pace_s} s: work {work:.4} mJ, friction {friction:.4} mJ");
        verify(
            &format!("relaxing tissue, closed path, {pace_s} s a part"),
            "work gained over friction's",
            (friction - work) / friction,
            0.0,
        );
    }
}

/// The shipped models.
const PAD: &[u8] = include_bytes!("../../../data/models/fingertip-pad.fpm");
const BED: &[u8] = include_bytes!("../../../data/models/fingertip.fpm");

/// Rows of the shipped pad and of the shipped bed along a path of tissue whose force has these branches.
fn rows_of_models(of_force: &Relaxation, path: &Path) -> [Vec<Response>; 2] {
    let file = PadModelFile::new(PAD).unwrap();
    let pad = simulate_path_on_pad(&file.file().pad.with_relaxation(*of_force), &pad::Body::Plane, path).unwrap();
    let file = ModelFile::new(BED).unwrap();
    let bed = simulate_path(&file.file().model.with_relaxation(of_force).unwrap(), path).unwrap();
    [pad, bed].map(|rows| rows.iter().map(|row| row.response).collect())
}

/// Largest error of the normal force and root mean square error of the friction, over the largest of each in the reference.
fn errors(reference: &[Response], rows: &[Response]) -> [f64; 2] {
    // Of the model at a time, linear between its rows.
    let at = |t_s: f64| {
        let after = rows.partition_point(|row| row.t_s < t_s).clamp(1, rows.len() - 1);
        let [a, b] = [&rows[after - 1], &rows[after]];
        let share = ((t_s - a.t_s) / (b.t_s - a.t_s)).clamp(0.0, 1.0);
        [(a.normal_force_n, b.normal_force_n), (a.friction_x_n, b.friction_x_n)].map(|(a, b)| a + share * (b - a))
    };
    let (mut normal, mut squares, mut most) = (0.0f64, 0.0, [0.0f64; 2]);
    for r in reference {
        let [n, f] = at(r.t_s);
        normal = normal.max((n - r.normal_force_n).abs());
        squares += (f - r.friction_x_n).powi(2);
        most = [most[0].max(r.normal_force_n), most[1].max(r.friction_x_n.abs())];
    }
    let rms = (squares / reference.len() as f64).sqrt();
    [normal / most[0], rms / most[1]]
}

/// Corners of a sine of the depth about 1 mm, two periods of `period_s`, after a press that was held.
fn vibration(period_s: f64) -> Vec<[f64; 3]> {
    let of_period = |k: u32| f64::from(k) / 16.0;
    let sine = (0..=32).map(|k| {
        let depth_mm = 1.0 + 0.1 * (std::f64::consts::TAU * of_period(k)).sin();
        [1.0 + period_s * of_period(k), depth_mm, 0.0]
    });
    [[0.1, 1.0, 0.0]].into_iter().chain(sine).collect()
}

/// Pad and bed relax as a whole, with the branches of the force that the finite elements give them.
pub fn the_reduced_models_follow_the_finite_elements_in_time() {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let finger = config.finger().unwrap().0;
    let tip = Tip::of(&finger, &config.tissue, &config.friction).unwrap();
    let of_tissue = Relaxation::HUMAN_ASSUMED;
    let of_force = branches_of_force(&config.problem(&finger), &tip, &of_tissue).unwrap();
    println!("branches of the force: {}", text(&of_force));
    let (pressed, slides) = ([0.1, 1.0, 0.0], [[0.2, 1.0, 0.0], [0.4, 1.0, 1.0], [1.4, 1.0, 1.0], [1.6, 1.0, 2.0]]);
    let cases: [(&str, Vec<[f64; 3]>); 12] = [
        ("press of 10 ms, hold of 60 s", vec![[0.01, 1.0, 0.0], [60.01, 1.0, 0.0]]),
        ("ramp to 1.5 mm, 1 mm/s", vec![[1.5, 1.5, 0.0]]),
        ("ramp to 1.5 mm, 10 mm/s", vec![[0.15, 1.5, 0.0]]),
        ("ramp to 1.5 mm, 100 mm/s", vec![[0.015, 1.5, 0.0]]),
        ("ramp to 1.5 mm, 1000 mm/s", vec![[0.0015, 1.5, 0.0]]),
        ("ramp to 2.6 mm, 10 mm/s", vec![[0.26, 2.6, 0.0]]),
        ("tap of 10 ms, 1.5 mm", vec![[0.005, 1.5, 0.0], [0.01, 0.0, 0.0]]),
        ("unloading after 1 s, 10 mm/s", vec![[0.15, 1.5, 0.0], [1.15, 1.5, 0.0], [1.3, 0.0, 0.0]]),
        ("sine, 1 Hz", vibration(1.0)),
        ("sine, 20 Hz", vibration(0.05)),
        ("slides that start and stop", [&[pressed], &slides[..], &[[2.6, 1.0, 2.0]]].concat()),
        ("slide to and back while pressed deeper", vec![pressed, [0.6, 1.4, 1.0], [1.1, 1.0, -0.5], [3.1, 1.0, -0.5]]),
    ];
    let mut found = Vec::new();
    for (case, corners) in cases {
        let corner = |&[t_s, normal, x]: &[f64; 3]| Waypoint { t_s, normal, x, y: 0.0 };
        let path = Path::new([Drive::Displacement; 3], [[0.0; 3]].iter().chain(&corners).map(corner).collect());
        let [of_time, without] = [[of_tissue, of_force], [Relaxation::none(); 2]].map(|[of_tissue, of_force]| {
            let problem = Problem { relaxation: of_tissue, ..config.problem(&finger) };
            let reference = follow(&problem, &path).unwrap().responses;
            rows_of_models(&of_force, &path).map(|rows| errors(&reference, &rows))
        });
        for (model, of_time, without) in [("pad", of_time[0], without[0]), ("bed", of_time[1], without[1])] {
            let percent = |[n, f]: [f64; 2]| format!("normal force {:.1} %, friction {:.1} %", 100.0 * n, 100.0 * f);
            println!("{case}, {model}: {}; without branches {}", percent(of_time), percent(without));
            found.push((case, model, of_time));
        }
    }
    for (case, model, [normal, friction]) in found {
        // The lines are 5 and 6 % for the pad and 8 % for the bed; two misses are known.
        let lines = match (model, case) {
            ("pad", "ramp to 2.6 mm, 10 mm/s") => [0.06; 2],
            ("pad", _) => [0.05, 0.06],
            (_, "unloading after 1 s, 10 mm/s") => [0.09; 2],
            _ => [0.08; 2],
        };
        let what = format!("{model} against finite elements in time, {case}");
        verify(&what, "error of the normal force over the largest", normal, lines[0]);
        if case.starts_with("slide") {
            verify(&what, "root mean square error of the friction over the largest", friction, lines[1]);
        }
    }
}
