//! The finger and the law of a fit, as a configuration that every command with finite elements takes.
//!
//! Main type: [`CorrectedFinger`].

use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::FingertipShape;

use super::parameters::{Parameter, Values};
use super::reading::{law_of, place_of};
use crate::{CalibrationParameter, FingerPoint};

/// Finger, law and depths of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectedFinger {
    /// Shape, if it differs from the given one.
    pub shape: Option<FingertipShape>,
    /// Configuration with stiffness, law and depths of the fit; its shape is still the given one.
    pub config: Config,
    /// Fitted effects that a configuration cannot represent, in sentences.
    pub left_out: Vec<String>,
}

impl CorrectedFinger {
    /// The configuration `config`, whose finger has the shape `shape`, with the values of a fit.
    ///
    /// * `depths_mm`: the table's
    pub fn new(config: &Config, shape: &FingertipShape, values: &Values, depths_mm: &[f64]) -> Self {
        let mut config = config.clone();
        let middle = depths_mm.len() / 2;
        let size = values.get(Parameter::LnSize).exp();
        // Stiffening with depth is no constant of the tissue: the file has its stiffness at the middle depth.
        let stiffness = place_of(values, depths_mm[middle], middle).1.stiffness;
        let point = FingerPoint { shape: shape.clone(), stiffness, depth_offset_mm: 0.0 };
        point.apply(&mut config);
        config.numerics.contact.penalty_mpa_per_mm /= size;
        config.tissue.bone.joint.translation_n_per_mm *= size;
        config.tissue.bone.joint.rotation_nmm_per_rad *= size.powi(3);
        config.friction = law_of(values).friction(&config.friction);
        config.experiment.depths_mm = (depths_mm.iter().enumerate())
            .map(|(slot, depth)| depth + values.get(Parameter::DepthOffset) + values.get(Parameter::DepthError(slot)))
            .collect();
        let bone_mm = values.get(Parameter::BoneClearance);
        let changed = size != 1.0 || bone_mm != 0.0;
        Self { shape: changed.then(|| scaled(shape, size, bone_mm)), config, left_out: left_out(values) }
    }
}

/// A shape with another clearance under the bone and then all lengths times `size`.
fn scaled(shape: &FingertipShape, size: f64, bone_mm: f64) -> FingertipShape {
    let mut out = shape.clone();
    *CalibrationParameter::BoneDorsalOffsetMm.of_shape(&mut out).expect("of the shape") += bone_mm;
    let lengths = [
        &mut out.half_width_mm,
        &mut out.half_thickness_mm,
        &mut out.length_mm,
        &mut out.cap_length_mm,
        &mut out.taper_start_mm,
        &mut out.taper_blend_mm,
        &mut out.skin_thickness_mm,
        &mut out.bone_half_width_mm,
        &mut out.bone_half_thickness_mm,
        &mut out.bone_cap_length_mm,
        &mut out.bone_dorsal_offset_mm,
        &mut out.bone_distal_clearance_mm,
        &mut out.joint_start_mm,
        &mut out.joint_end_mm,
        &mut out.nail_start_mm,
        &mut out.nail_end_mm,
        &mut out.nail_thickness_mm,
        &mut out.pad_height_mm,
    ];
    lengths.into_iter().for_each(|length| *length *= size);
    out
}

/// Effects of the instruments, and effects that change with depth.
fn left_out(values: &Values) -> Vec<String> {
    let mut out = Vec::new();
    let mut add = |parameter: Parameter, text: &str| {
        let value = values.get(parameter);
        if value != 0.0 {
            out.push(format!("{} = {value:.4}: {text}", parameter.name()));
        }
    };
    add(Parameter::NormalForceOffset, "the sensor reads this much more than presses the finger");
    add(Parameter::PullOff, "the sensor reads this much less at 63.5 mm², as the root of the area");
    add(Parameter::Tilt, "of the sensor's axes");
    add(Parameter::StrainStiffening, "the stiffness here is that at the middle depth of the table");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_become_a_finger() {
        let (config, shape) = (Config::default(), FingertipShape::default());
        let depths = [0.75, 1.0, 1.25, 1.5];
        let none = Values::without_effects(4, 7.516, 0.46, 0.0);
        let same = CorrectedFinger::new(&config, &shape, &none, &depths);
        assert!(same.shape.is_none() && same.left_out.is_empty() && same.config.tissue == config.tissue);
        assert_eq!(same.config.experiment.depths_mm, depths);
        let values = none
            .with(Parameter::LnSize, 0.1)
            .with(Parameter::BoneClearance, 0.2)
            .with(Parameter::DepthOffset, -0.05)
            .with(Parameter::DepthError(1), 0.02)
            .with(Parameter::NormalForceOffset, -0.05);
        let other = CorrectedFinger::new(&config, &shape, &values, &depths);
        let made = other.shape.unwrap();
        assert!((made.bone_dorsal_offset_mm - 0.1f64.exp() * 3.4).abs() < 1e-12);
        assert!((made.half_width_mm / shape.half_width_mm - 0.1f64.exp()).abs() < 1e-12);
        assert_eq!(made.inclination_deg, shape.inclination_deg);
        assert!((other.config.experiment.depths_mm[1] - 0.97).abs() < 1e-12);
        assert_eq!(other.left_out.len(), 1);
    }
}
