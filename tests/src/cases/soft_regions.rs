//! A soft region with a name and a law of its own, on the mesh of another program.

use std::ops::ControlFlow;
use std::path::Path;

use crate::verify;
use fingerpad_fe::experiment::{Config, ConfigError, frictionless};
use fingerpad_fe::material::{Material, NeoHooke, Ogden};

const PULP: NeoHooke = NeoHooke { mu_mpa: 0.01, d_per_mpa: 5.0 };

/// The cushion with its pulp as subcutaneous tissue.
fn cushion() -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/meshes/cushion.toml");
    let mut config = Config::read(&file).unwrap();
    config.tissue.subcutaneous = Material::Ogden(Ogden { mu_mpa: PULP.mu_mpa, alpha: 2.0, d_per_mpa: PULP.d_per_mpa });
    // The error of a solution must lie below the bound on the difference of the two laws.
    config.numerics.solver.tolerance *= 0.01;
    config
}

/// The cushion with a law for the region `pulp`, whose elements are nothing else.
fn named(law: Material) -> Config {
    let mut config = cushion();
    config.imported.as_mut().unwrap().regions.subcutaneous = vec![];
    config.tissue.regions.insert("pulp".into(), law);
    config
}

/// Normal force of a frictionless press at the greatest depth, N.
fn force(config: &Config) -> f64 {
    let (finger, _) = config.finger().unwrap();
    let presses = frictionless(config, &finger, None, &mut |_| ControlFlow::Continue(())).unwrap();
    presses.last().unwrap().normal_force_n
}

pub fn a_named_region_presses_as_the_tissue_with_its_law() {
    let reference = force(&cushion());
    let same = force(&named(Material::NeoHooke(PULP)));
    verify("soft region", "force error, neo-Hooke against Ogden with alpha = 2", (same / reference - 1.0).abs(), 1e-7);
    let stiff = force(&named(Material::NeoHooke(PULP).stiffened(3.0)));
    println!("three times as stiff: {stiff:.4} N instead of {reference:.4} N");
    assert!(stiff > 1.3 * reference && stiff < 3.0 * reference);
}

pub fn a_geometry_without_named_regions_refuses_them() {
    let config = Config { imported: None, ..named(Material::NeoHooke(PULP)) };
    let error = config.fingertip().unwrap_err();
    assert!(matches!(&error, ConfigError::NoSuchRegion(name, _) if name == "pulp"), "{error}");
    assert!(error.to_string().starts_with("tissue.regions.pulp: a parametric fingertip has"), "{error}");
}
