//! The finger and the law of a fit, as a configuration that every command with finite elements takes.
//!
//! Main type: [`CorrectedFinger`].

use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::FingertipShape;

use super::effects::{Parameter, Values};
use super::finite_elements::with_bone;
use super::reading::stiffness_at;
use crate::FingerPoint;

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
        let (size, bone_mm) = (values[Parameter::LN_SIZE].exp(), values[Parameter::BONE_CLEARANCE]);
        // Stiffening with depth is no constant of the tissue: the file has its stiffness at the middle depth.
        let stiffness = stiffness_at(values, values.depth_mm(depths_mm[middle], middle));
        FingerPoint { shape: shape.clone(), stiffness, depth_offset_mm: 0.0 }.apply(&mut config);
        config.numerics.contact.penalty_mpa_per_mm /= size;
        config.tissue.bone.joint.translation_n_per_mm *= size;
        config.tissue.bone.joint.rotation_nmm_per_rad *= size.powi(3);
        config.friction = values.law().friction(&config.friction);
        config.experiment.depths_mm =
            depths_mm.iter().enumerate().map(|(slot, depth)| values.depth_mm(*depth, slot)).collect();
        let changed = size != 1.0 || bone_mm != 0.0;
        Self { shape: changed.then(|| with_bone(shape, bone_mm).scaled(size)), config, left_out: left_out(values) }
    }
}

/// Effects of the instruments, and effects that change with depth.
fn left_out(values: &Values) -> Vec<String> {
    let texts = [
        (Parameter::NORMAL_FORCE_OFFSET, "the sensor reads this much more than presses the finger"),
        (Parameter::PULL_OFF, "the sensor reads this much less at 63.5 mm², as the root of the area"),
        (Parameter::TILT, "of the sensor's axes"),
        (Parameter::STRAIN_STIFFENING, "the stiffness here is that at the middle depth of the table"),
    ];
    let moved = texts.into_iter().filter(|(p, _)| values[*p] != 0.0);
    moved.map(|(p, text)| format!("{} = {:.4}: {text}", p.name(), values[p])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LawPoint;

    #[test]
    fn values_become_a_finger() {
        let (config, shape) = (Config::default(), FingertipShape::default());
        let depths = [0.75, 1.0, 1.25, 1.5];
        let none = Values::without_effects(4, &LawPoint::of(&config.friction));
        let same = CorrectedFinger::new(&config, &shape, &none, &depths);
        assert!(same.shape.is_none() && same.left_out.is_empty() && same.config.tissue == config.tissue);
        assert_eq!(same.config.experiment.depths_mm, depths);
        let values = none
            .with(Parameter::LN_SIZE, 0.1)
            .with(Parameter::BONE_CLEARANCE, 0.2)
            .with(Parameter::DEPTH_OFFSET, -0.05)
            .with(Parameter::depth_error(1), 0.02)
            .with(Parameter::NORMAL_FORCE_OFFSET, -0.05);
        let other = CorrectedFinger::new(&config, &shape, &values, &depths);
        let made = other.shape.unwrap();
        assert!((made.bone_dorsal_offset_mm - 0.1f64.exp() * 3.4).abs() < 1e-12);
        assert!((made.half_width_mm / shape.half_width_mm - 0.1f64.exp()).abs() < 1e-12);
        assert_eq!(made.inclination_deg, shape.inclination_deg);
        assert!((other.config.experiment.depths_mm[1] - 0.97).abs() < 1e-12);
        assert_eq!(other.left_out.len(), 1);
    }
}
