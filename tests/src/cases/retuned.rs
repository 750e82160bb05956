//! The shipped reduced model, retuned at run time, against finite-element fingers that it was not fitted to.

use fingerpad::host::ModelFile;
use fingerpad::{Model, Motion, State, Tuning};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Finger, Trajectory};
use fingerpad_fe::mesh::{MeshPreset, fingertip};
use fingerpad_identify::FingerPoint;
use fingerpad_reduce::{STEP_MM, halton, settings_hash};
use rayon::prelude::*;

use super::{Effort, Failure};
use crate::{
    Check,
    problems::fingers::{follow, placed},
};

/// The model that ships.
const SHIPPED: &[u8] = include_bytes!("../../../data/models/fingertip.fpm");

/// Largest local strength over the shear modulus below the skin, at a pressure of 5 kPa per unit of stiffness.
const STRENGTH_MOST: f64 = 1.5;

/// Size, stiffness and lambda by Halton's sequence, those left out where the skin would be stronger than the tissue.
fn fingers(config: &Config, count: usize) -> Vec<[f64; 3]> {
    let law = config.friction;
    (1..)
        .map(|i| {
            let doubled = |x: f64| 0.5 * 4f64.powf(x);
            [0.8 + 0.4 * halton(i, 2), doubled(halton(i, 3)), doubled(halton(i, 5))]
        })
        .filter(|[_, e, lambda]| {
            let strength = law.lambda * lambda * (0.005 * e).powf(law.beta);
            strength <= STRENGTH_MOST * e * config.tissue.subcutaneous.shear_mpa()
        })
        .take(count)
        .collect()
}

/// RMS errors of the tuned model along a response: normal force over its range, friction over the limit.
fn errors(model: &Model<'_>, trajectory: &Trajectory) -> [f64; 2] {
    let mut state = State::default();
    let (mut normal, mut friction, mut rows, mut most) = (0.0, 0.0, 0, 0.0f64);
    for pair in trajectory.responses.windows(2) {
        let at = |r: &fingerpad_fe::load_path::Response| [r.depth_mm, r.slide_x_mm, r.slide_y_mm];
        let (from, to) = (at(&pair[0]), at(&pair[1]));
        let by: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
        let steps = (by[1].hypot(by[2]).max(by[0].abs()) / f64::from(STEP_MM)).ceil().max(1.0);
        let mut answer = fingerpad::Response::default();
        for k in 1..=steps as u32 {
            let motion = Motion {
                depth_mm: (from[0] + by[0] * f64::from(k) / steps) as f32,
                slide_increment_mm: [(by[1] / steps) as f32, (by[2] / steps) as f32],
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            answer = model.step(&mut state, motion);
        }
        let fe = &pair[1];
        if fe.normal_force_n > 0.0 {
            let [x, y] = answer.friction_n.map(f64::from);
            normal += (f64::from(answer.normal_force_n) - fe.normal_force_n).powi(2);
            let limit = f64::from(answer.friction_limit_n);
            friction += ((x - fe.friction_x_n).hypot(y - fe.friction_y_n) / limit).powi(2);
            most = most.max(fe.normal_force_n);
            rows += 1;
        }
    }
    let rms = |sum: f64| (sum / f64::from(rows)).sqrt();
    [rms(normal) / most, rms(friction)]
}

/// Press, slide along 30 degrees until nearly everything slips, half of the slide back, half a millimetre deeper.
fn corners(size: f64, way: f64) -> [[f64; 3]; 5] {
    let (x, y) = (way * 30f64.to_radians().cos(), way * 30f64.to_radians().sin());
    [[0.0; 3], [size, 0.0, 0.0], [size, x, y], [size, 0.5 * x, 0.5 * y], [1.4 * size, 0.5 * x, 0.5 * y]]
}

/// One finger: how it differs from the fitted one, and its errors.
struct Fresh {
    name: String,
    /// Normal force over its range, friction over the limit.
    errors: [f64; 2],
}

/// Runs a finger of another size, stiffness and lambda through finite elements and the tuned model.
fn fresh(model: &Model<'_>, config: &Config, [size, stiffness, lambda]: [f64; 3]) -> Result<Fresh, Failure> {
    let mut config = config.clone();
    let shape = config.fingertip_shape()?.scaled(size);
    let point = FingerPoint { stiffness, ..FingerPoint::of(shape.clone()) };
    point.apply(&mut config);
    // The joint of a larger finger of the same tissue.
    config.tissue.bone.joint.translation_n_per_mm *= size;
    config.tissue.bone.joint.rotation_nmm_per_rad *= size.powi(3);
    config.friction.lambda *= lambda;
    let finger = Finger::new(fingertip(&shape, &config.mesh_preset.divisions())?, &config.tissue)?;
    let way = 3.6 * size * (lambda * stiffness.powf(config.friction.beta - 1.0)).min(1.5);
    let trajectory = follow(&config.problem(&finger), &placed(&corners(size, way)))?;
    let tuning = Tuning { size: size as f32, stiffness: stiffness as f32, lambda: lambda as f32 };
    let errors = errors(&model.tuned(tuning).map_err(|e| e.to_string())?, &trajectory);
    Ok(Fresh { name: format!("size {size:.2}, stiffness {stiffness:.2}, lambda {lambda:.2}"), errors })
}

/// The settings that the model's runs were made with: the default ones on one of the meshes.
fn settings_of(meta: &serde_json::Value) -> Result<Config, Failure> {
    let stated = meta["settings_hash"].as_str().unwrap_or_default();
    for mesh_preset in MeshPreset::ALL {
        let config = Config { mesh_preset, ..Config::default() };
        if settings_hash(&config)? == stated {
            return Ok(config);
        }
    }
    Err(format!("the shipped model's runs have settings {stated:?}, which are the default ones on no mesh").into())
}

/// Ten fingers and the fitted one.
pub fn retuned(effort: Effort) -> Result<Vec<Check>, Failure> {
    let file = ModelFile::new(SHIPPED)?;
    let model: Model<'_> = file.file().model;
    let config = settings_of(&serde_json::from_str(file.file().meta)?)?;
    let count = if effort == Effort::Quick { 2 } else { 10 };
    let mut places = vec![[1.0; 3]];
    places.extend(fingers(&config, count));
    let ran: Vec<Fresh> = places
        .par_iter()
        .map(|place| fresh(&model, &config, *place).map_err(|e| format!("{place:?}: {e}")))
        .collect::<Result<_, _>>()?;
    let mut checks = Vec::new();
    for Fresh { name, errors: [normal, friction] } in &ran {
        checks.push(Check::reported(format!("{:?} mesh, {name}: N (% of range)", config.mesh_preset), 100.0 * normal));
        checks
            .push(Check::reported(format!("{:?} mesh, {name}: F (% of limit)", config.mesh_preset), 100.0 * friction));
    }
    let rms = |k: usize| (ran[1..].iter().map(|f| f.errors[k].powi(2)).sum::<f64>() / count as f64).sqrt();
    checks.push(Check::at_most("all fresh fingers, RMS: N (% of range)", 100.0 * rms(0), 5.0));
    checks.push(Check::at_most("all fresh fingers, RMS: F (% of limit)", 100.0 * rms(1), 5.0));
    Ok(checks)
}
