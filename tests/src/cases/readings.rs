//! Reactions and probes: equilibrium, uniform strain, and the strain under a Hertz contact.

use crate::problems::fingers::{finger, follow, placed, problem};
use crate::problems::sphere::{Elements, Layout, Part, Sphere};
use crate::verify;
use fingerpad_fe::assembly::Configuration;
use fingerpad_fe::load_path::{BoneKind, Model, Observed, Problem, papillae, probes};
use fingerpad_fe::mesh::MeshPreset;
use nalgebra::{Matrix3, Vector3};

fn named(points: &[[f64; 3]]) -> Vec<(String, Vector3<f64>)> {
    points.iter().enumerate().map(|(k, &point)| (format!("p{k}"), Vector3::from(point))).collect()
}

/// The supports of the finger carry the force and moment of the plane, for the whole and for the half, on a bone that
/// floats or is held; two of the three supports carry some load.
pub fn reactions_balance_the_plane() {
    let straight = placed(&[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 1.5, 0.0]]);
    let oblique = placed(&[[0.0; 3], [0.8, 0.0, 0.0], [0.9, 0.8, 1.0]]);
    for (bone, path) in [(BoneKind::Floating, &straight), (BoneKind::Floating, &oblique), (BoneKind::Fixed, &oblique)] {
        let finger = finger("e", MeshPreset::Coarse, bone, 1.0).unwrap();
        let observed = Observed::new(&finger.mesh, true, Vec::new());
        let mut tight = problem(&finger.body, &finger.mesh.pad_faces);
        tight.settings.tolerance = 1e-7;
        let problem = Problem { half: finger.half.as_ref(), observed: Some(&observed), ..tight };
        let run = follow(&problem, path).unwrap();
        assert_eq!(run.readings.len(), run.responses.len());
        let mut apart = [0.0f64; 2];
        for (response, reading) in run.responses.iter().zip(&run.readings) {
            let mut force = Vector3::new(response.friction_x_n, response.friction_y_n, response.normal_force_n);
            // The plane's moments are about its point, which rises with it.
            let risen = Vector3::new(0.0, 0.0, response.depth_mm);
            let mut moment = Vector3::from(response.moment_n_mm) + risen.cross(&force);
            for reaction in &reading.reactions {
                force += Vector3::from(reaction.force_n);
                moment += Vector3::from(reaction.moment_n_mm);
            }
            let largest = response.normal_force_n.max(0.01);
            apart = [apart[0].max(force.norm() / largest), apart[1].max(moment.norm() / (largest * 10.0))];
        }
        let last = &run.readings[run.readings.len() - 1].reactions;
        println!("{bone:?}: {last:?}");
        assert!(last[..2].iter().all(|r| r.force_n[2].abs() > 0.01), "nail and bone carry the press: {last:?}");
        verify("reactions", &format!("force against the plane's, {bone:?}"), apart[0], 1e-5);
        verify("reactions", &format!("moment against the plane's, {bone:?}"), apart[1], 1e-5);
    }
}

/// Under a uniform gradient of displacement every probe reads its strain and the law's energy, in the whole and in the half.
pub fn probes_read_a_uniform_strain() {
    let finger = finger("e", MeshPreset::Coarse, BoneKind::Deformable, 1.0).unwrap();
    let gradient = Matrix3::new(0.05, 0.0, 0.02, 0.0, -0.03, 0.0, 0.01, 0.0, -0.02);
    let f = Matrix3::identity() + gradient;
    let strain = 0.5 * (f.transpose() * f - Matrix3::identity());
    let points = named(&[[0.0, 0.0, 1.0], [0.5, 1.2, 1.5], [0.5, -1.2, 1.5], [1.0, 0.0, 4.0]]);
    let all = probes(&finger.mesh, &finger.body, &points).unwrap();
    let observed = Observed::new(&finger.mesh, false, all);
    let moved = |undeformed: &Configuration| {
        let mut at = undeformed.clone();
        at.x.iter_mut().for_each(|x| *x = f * *x);
        at
    };
    let half = finger.half.as_ref().unwrap();
    let whole = Model { body: &finger.body, pad_faces: (&finger.mesh).into(), half: None };
    let halved = Model { body: &half.body, pad_faces: (&half.mesh.mesh).into(), half: Some(half) };
    for model in [whole, halved] {
        let reading = observed.read(&model, &moved(model.body.undeformed()));
        for ((_, point), read) in points.iter().zip(&reading.probes) {
            let expected = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|at| strain[at]);
            let apart = read.strain.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-12, "{point}: {:?} for {expected:?}", read.strain);
            assert!((Vector3::from(read.place_mm) - f * point).norm() < 1e-12);
            assert!(read.strain_energy_density_mpa > 0.0);
        }
        let [left, right] = [1, 2].map(|k| reading.probes[k].strain_energy_density_mpa);
        assert!((left - right).abs() < 1e-12 * left, "{left} {right}");
    }
    let outside = probes(&finger.mesh, &finger.body, &named(&[[0.0, 0.0, -3.0]])).unwrap_err().to_string();
    assert!(outside.contains("probe `p0` at (0, 0, -3) mm lies outside"), "{outside}");
}

/// A grid of receptors has the same names and places on all meshes of a parametric fingertip.
pub fn papillae_are_the_same_points_on_every_mesh() {
    let presets = [MeshPreset::Coarse, MeshPreset::Medium, MeshPreset::Default];
    for depth_mm in [0.3, 0.7, 1.5] {
        let [first, others @ ..] =
            presets.map(|preset| papillae(&finger("e", preset, BoneKind::Floating, 1.0).unwrap(), depth_mm));
        assert!((100..500).contains(&first.len()), "{}", first.len());
        for other in others {
            assert_eq!(first.len(), other.len());
            for ((name, at), (other_name, other_at)) in first.iter().zip(&other) {
                assert_eq!(name, other_name);
                assert!((at - other_at).norm() < 1e-9, "{name} {depth_mm}: {at} {other_at}");
            }
        }
    }
}

/// Strain at receptors, within 5 mm of first touch, on the default mesh against the fine one, in shares of the peak at their depth: the
/// layers under the skin, just below its border and deeper, after a press and after a slide.
pub fn strain_at_papillae_has_converged_on_the_default_mesh() {
    let read = |preset: MeshPreset| {
        let finger = finger("e", preset, BoneKind::Floating, 1.0).unwrap();
        let points = |depth| papillae(&finger, depth).into_iter().filter(|(_, at)| at.xy().norm() < 5.1);
        let points: Vec<Vec<_>> = [0.7, 1.5].into_iter().map(|depth| points(depth).collect()).collect();
        let all = probes(&finger.mesh, &finger.body, &points.concat()).unwrap();
        let observed = Observed::new(&finger.mesh, false, all);
        let problem = problem(&finger.body, &finger.mesh.pad_faces);
        let problem = Problem { half: finger.half.as_ref(), observed: Some(&observed), ..problem };
        let run = follow(&problem, &placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 3.0, 0.0]])).unwrap();
        let at_time = |t_s: f64| {
            let row = run.responses.iter().position(|r| r.t_s == t_s).unwrap();
            let strains: Vec<[f64; 6]> = run.readings[row].probes.iter().map(|probe| probe.strain).collect();
            let (near, deep) = strains.split_at(points[0].len());
            [near.to_vec(), deep.to_vec()]
        };
        [1.0, 2.0].map(at_time)
    };
    let [default, fine] = [MeshPreset::Default, MeshPreset::Fine].map(read);
    for (when, default, fine) in [("press", &default[0], &fine[0]), ("slide", &default[1], &fine[1])] {
        for (depth, default, fine) in [("0.7 mm", &default[0], &fine[0]), ("1.5 mm", &default[1], &fine[1])] {
            let peak = fine.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
            let off =
                default.iter().flatten().zip(fine.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            verify("receptors", &format!("strain at {depth}, {when}, over the peak"), off / peak, 0.05);
        }
    }
}

/// Strain and energy on the axis below a Hertz contact (Johnson 1985, Contact Mechanics, equations 3.45).
pub fn probes_read_the_strain_under_a_hertz_contact() {
    let layout = Layout { elements: Elements::Hexes, part: Part::Quarter, per_radius: 20, extent: 4.0, growth: 1.1 };
    let (poisson, shear_mpa) = (0.4, 1.0);
    let sphere = Sphere::new(&layout, poisson, 500.0).unwrap();
    let mut solver = sphere.solver(sphere.penalty(1e-3));
    let state = sphere.press(&mut solver).unwrap();
    let depths = [0.3, 0.5, 0.8, 1.2];
    let points = named(&depths.map(|z| [0.0, 0.0, z]));
    let observed = Observed::new(&sphere.mesh, false, probes(&sphere.mesh, &sphere.body, &points).unwrap());
    let model = Model { body: &sphere.body, pad_faces: (&sphere.mesh).into(), half: None };
    let reading = observed.read(&model, &state.configuration);
    let (peak, young) = (sphere.hertz.peak_mpa(), 2.0 * shear_mpa * (1.0 + poisson));
    let mut apart = [0.0f64; 3];
    for (z, read) in depths.into_iter().zip(&reading.probes) {
        let fall = 1.0 / (1.0 + z * z);
        let along = -peak * fall;
        let across = peak * (0.5 * fall - (1.0 + poisson) * (1.0 - z * (1.0 / z).atan()));
        let strain = [(along - 2.0 * poisson * across) / young, ((1.0 - poisson) * across - poisson * along) / young];
        let energy = 0.5 * (along * strain[0] + 2.0 * across * strain[1]);
        println!("z {z}: {:?} for {strain:?}; {} for {energy}", read.strain, read.strain_energy_density_mpa);
        let off = [
            read.strain[2] / strain[0] - 1.0,
            (read.strain[0] - strain[1]) / strain[0],
            read.strain_energy_density_mpa / energy - 1.0,
        ];
        (0..3).for_each(|k| apart[k] = apart[k].max(off[k].abs()));
    }
    verify("probes under a Hertz contact", "strain along the axis", apart[0], 0.015);
    verify("probes under a Hertz contact", "strain across the axis", apart[1], 0.015);
    verify("probes under a Hertz contact", "strain energy density", apart[2], 0.02);
}
