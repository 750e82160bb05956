//! A deformed body turned as a whole: forces turn along, energy stays, forces have no moment.

use fingerpad_fe::assembly::{Body, Joint, Material};
use fingerpad_fe::material::{Ogden, SaintVenantKirchhoff};
use fingerpad_fe::mesh::{Region, block::coordinates};
use fingerpad_tests::{
    problems::blocks::{all_held, tied_block},
    random::Random,
    verify,
};
use nalgebra::{Rotation3, Vector3};

use crate::hyperelastic::laws;

#[test]
fn forces_turn_with_the_body() {
    let line = coordinates(0.0, 3.0, 3, 1.0);
    let nail = coordinates(0.4, 2.7, 2, 1.0);
    let mesh = tied_block([&line, &line, &line], &nail, &nail, 2, 0.5);
    let soft = Material::Ogden(Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 });
    let stiff = Material::Linear(SaintVenantKirchhoff { young_mpa: 100.0, poisson: 0.3 });
    let fixed = [("Ogden hexes, SVK tets", soft, stiff), ("SVK hexes, Ogden tets", stiff, soft)];
    for (case, lower, upper) in laws().into_iter().map(|(case, law)| (case, law, law)).chain(fixed) {
        let material = |region| Some(if region == Region::Nail { upper } else { lower });
        let body = Body::new(&mesh, material, &all_held(&mesh), Vector3::zeros(), Joint::default()).unwrap();
        let mut random = Random::new(2);
        let mut at = body.undeformed().clone();
        at.x.iter_mut().for_each(|x| *x += 0.08 * random.vector());
        let (forces, energy) = (body.nodal_forces(&at), body.energy(&at).0);
        let scale = forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
        assert!(energy > 0.0 && scale > 0.0);
        let moment: Vector3<f64> = forces.iter().zip(&at.x).map(|(f, x)| x.cross(f)).sum();
        let resultant: Vector3<f64> = forces.iter().sum();
        let (mut worst_force, mut worst_energy) = (0.0f64, 0.0f64);
        for turn in [[0.1, 0.0, 0.0], [1.2, -2.0, 0.7], [0.0, std::f64::consts::PI, 0.0]] {
            let rotation = Rotation3::new(Vector3::from(turn));
            let mut turned = at.clone();
            turned.x.iter_mut().for_each(|x| *x = rotation * *x + Vector3::new(3.0, -20.0, 7.0));
            for (force, before) in body.nodal_forces(&turned).iter().zip(&forces) {
                worst_force = worst_force.max((force - rotation * before).norm() / scale);
            }
            worst_energy = worst_energy.max((body.energy(&turned).0 / energy - 1.0).abs());
        }
        verify(&format!("rigid rotation, {case}"), "force error", worst_force, 1e-9);
        verify(&format!("rigid rotation, {case}"), "energy error", worst_energy, 1e-9);
        verify(&format!("balance, {case}"), "resultant over the largest force", resultant.norm() / scale, 1e-9);
        verify(&format!("balance, {case}"), "moment over the largest force, mm", moment.norm() / scale, 1e-9);
    }
}
