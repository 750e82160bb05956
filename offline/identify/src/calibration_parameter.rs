//! Parameters of a finger that a calibration may vary: stiffness, depth offset and numbers of the shape.

use serde::{Deserialize, Serialize};

use super::settings::VariedParameter;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::FingertipShape;

/// A parameter of the finger that a calibration may vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationParameter {
    /// Factor on every stiffness: tissue, nail, joint, and the contact's penalty.
    Stiffness,
    /// Added to every measured depth, mm: error of the touch point.
    DepthOffsetMm,
    /// Pad flatness: slope of the shear that turns the pad's flat to the plane.
    TaperSlope,
    /// Pad flatness across: exponent of the outer section.
    SectionExponent,
    /// Pad size: half width, mm.
    HalfWidthMm,
    /// Pad size: half thickness, mm.
    HalfThicknessMm,
    /// Bone clearance: dorsal offset of the bone's axis from the shaft's, mm.
    BoneDorsalOffsetMm,
    /// Bone clearance at the tip, mm.
    BoneDistalClearanceMm,
    /// Thickness of the skin, mm.
    SkinThicknessMm,
}

impl CalibrationParameter {
    /// All that change the shape.
    pub const SHAPE: [Self; 7] = [
        Self::TaperSlope,
        Self::SectionExponent,
        Self::HalfWidthMm,
        Self::HalfThicknessMm,
        Self::BoneDorsalOffsetMm,
        Self::BoneDistalClearanceMm,
        Self::SkinThicknessMm,
    ];

    /// Its name in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness factor",
            Self::DepthOffsetMm => "depth offset",
            Self::TaperSlope => "pad slope",
            Self::SectionExponent => "section exponent",
            Self::HalfWidthMm => "half width",
            Self::HalfThicknessMm => "half thickness",
            Self::BoneDorsalOffsetMm => "bone's dorsal offset",
            Self::BoneDistalClearanceMm => "bone's distal clearance",
            Self::SkinThicknessMm => "skin thickness",
        }
    }

    /// Its unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Stiffness | Self::TaperSlope | Self::SectionExponent => "",
            _ => "mm",
        }
    }

    /// Step of finite differences, in its unit (of the value, for the stiffness): large enough that remeshing does
    /// not matter, nor that the contact area grows by one contact point after the other (0.5 % on the default mesh;
    /// 0.05 mm of depth to both sides change it by a tenth).
    pub fn step(self) -> f64 {
        match self {
            Self::Stiffness => 0.05,
            Self::DepthOffsetMm => 0.05,
            Self::TaperSlope => 0.01,
            Self::SectionExponent => 0.05,
            _ => 0.05,
        }
    }

    /// Its change in a sensitivity study: about as much as a subject's value is uncertain.
    pub fn spread(self) -> f64 {
        match self {
            Self::Stiffness => 0.1,
            Self::DepthOffsetMm | Self::SkinThicknessMm => 0.1,
            Self::TaperSlope => 0.05,
            Self::SectionExponent => 0.2,
            _ => 0.5,
        }
    }

    /// Possible values for a finger: bounds of a fit must lie within.
    pub fn limits(self) -> [f64; 2] {
        match self {
            Self::Stiffness => [0.01, 100.0],
            Self::DepthOffsetMm => [-2.0, 2.0],
            Self::TaperSlope => [0.0, 2.0],
            Self::SectionExponent => [1.0, 10.0],
            Self::HalfWidthMm | Self::HalfThicknessMm => [2.0, 30.0],
            Self::BoneDorsalOffsetMm => [0.0, 15.0],
            Self::BoneDistalClearanceMm => [0.5, 30.0],
            Self::SkinThicknessMm => [0.05, 5.0],
        }
    }

    /// Its place in a shape, if it is of the shape.
    pub fn of_shape(self, shape: &mut FingertipShape) -> Option<&mut f64> {
        match self {
            Self::Stiffness | Self::DepthOffsetMm => None,
            Self::TaperSlope => Some(&mut shape.taper_slope),
            Self::SectionExponent => Some(&mut shape.section_exponent),
            Self::HalfWidthMm => Some(&mut shape.half_width_mm),
            Self::HalfThicknessMm => Some(&mut shape.half_thickness_mm),
            Self::BoneDorsalOffsetMm => Some(&mut shape.bone_dorsal_offset_mm),
            Self::BoneDistalClearanceMm => Some(&mut shape.bone_distal_clearance_mm),
            Self::SkinThicknessMm => Some(&mut shape.skin_thickness_mm),
        }
    }
}

impl VariedParameter {
    /// Bounds in force.
    pub fn bounds(&self) -> [f64; 2] {
        let [low, high] = match self.name {
            CalibrationParameter::Stiffness => [0.1, 5.0],
            CalibrationParameter::DepthOffsetMm => [-0.4, 0.4],
            CalibrationParameter::TaperSlope => [0.0, 0.6],
            CalibrationParameter::SectionExponent => [2.0, 4.0],
            CalibrationParameter::HalfWidthMm => [6.5, 10.5],
            CalibrationParameter::HalfThicknessMm => [5.5, 9.0],
            CalibrationParameter::BoneDorsalOffsetMm => [0.5, 4.0],
            CalibrationParameter::BoneDistalClearanceMm => [3.0, 8.0],
            CalibrationParameter::SkinThicknessMm => [0.3, 1.5],
        };
        [self.min.unwrap_or(low), self.max.unwrap_or(high)]
    }
}

/// A finger at one point of the calibration's parameter space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerPoint {
    /// Shape.
    pub shape: FingertipShape,
    /// Factor on every stiffness.
    pub stiffness: f64,
    /// Added to every measured depth, mm.
    pub depth_offset_mm: f64,
}

impl FingerPoint {
    /// A shape as it is.
    pub fn of(shape: FingertipShape) -> Self {
        Self { shape, stiffness: 1.0, depth_offset_mm: 0.0 }
    }

    /// Puts the finger into a configuration: its stiffness into tissue, nail, joint and penalty. Shape and depth
    /// offset have no place there.
    pub fn apply(&self, config: &mut Config) {
        config.tissue.stiffen(self.stiffness);
        config.numerics.contact.penalty_mpa_per_mm *= self.stiffness;
    }

    /// Value of a calibration parameter, in its unit.
    pub fn get(&self, parameter: CalibrationParameter) -> f64 {
        match parameter {
            CalibrationParameter::Stiffness => self.stiffness,
            CalibrationParameter::DepthOffsetMm => self.depth_offset_mm,
            other => *other.of_shape(&mut self.shape.clone()).expect("of the shape"),
        }
    }

    /// This finger with another value of a calibration parameter.
    pub fn with(&self, parameter: CalibrationParameter, value: f64) -> Self {
        let mut out = self.clone();
        match parameter {
            CalibrationParameter::Stiffness => out.stiffness = value,
            CalibrationParameter::DepthOffsetMm => out.depth_offset_mm = value,
            other => *other.of_shape(&mut out.shape).expect("of the shape") = value,
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_changes_what_it_says_and_starts_inside_its_bounds() {
        let finger = FingerPoint::of(FingertipShape::default());
        for kind in CalibrationParameter::SHAPE
            .into_iter()
            .chain([CalibrationParameter::Stiffness, CalibrationParameter::DepthOffsetMm])
        {
            let value = finger.get(kind);
            let [low, high] = VariedParameter { name: kind, min: None, max: None }.bounds();
            assert!(low <= value && value <= high, "{kind:?}");
            let [least, most] = kind.limits();
            assert!(least <= low && high <= most, "{kind:?}");
            let changed = finger.with(kind, value + kind.step());
            assert!((changed.get(kind) - value - kind.step()).abs() < 1e-12 && changed != finger, "{kind:?}");
        }
    }
}
