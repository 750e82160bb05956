//! The parameters by which the smooth model of one finger and device differs from the model file it starts from.
//!
//! Main types: [`Parameter`] (the name of one), [`Parameters`] (values of all, indexed by name).

use std::ops::{Index, IndexMut};

/// One parameter of the smooth model. The order is that of the parameter vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Logarithm of the factor on the normal force.
    NormalScale,
    /// Added to the exponent of the normal force N over depth.
    NormalDepthExponent,
    /// Added to the coefficient of the depth in ln N, 1/mm.
    NormalDepthSlope,
    /// Added to the coefficient of (depth - 0.9 mm)² in ln N, 1/mm².
    NormalDepthCurvature,
    /// Logarithm of the factor on the strength L, the friction in full slip.
    StrengthScale,
    /// Added to the exponent of the strength over depth.
    StrengthDepthExponent,
    /// Added to the coefficient of the depth in ln L, 1/mm.
    StrengthDepthSlope,
    /// Logarithm of the factor on the tangential stiffness K.
    TangentialScale,
    /// Added to the exponent of the tangential stiffness over depth.
    TangentialDepthExponent,
    /// Added to the coefficient of the depth in ln K, 1/mm.
    TangentialDepthSlope,
    /// Logarithm of the tangential stiffness along y over that along x.
    StiffnessRatioY,
    /// Logarithm of the exponent that spreads the elements' yield positions.
    YieldSpread,
    /// Tilt of the elements' shares over their yield positions.
    YieldTilt,
    /// Curvature of the shares.
    YieldBow,
    /// Slide along x that pressing amounts to, mm per mm of depth.
    PressCoupling,
    /// Change of that with depth, 1/mm.
    PressCouplingSlope,
    /// Normal force per friction along x.
    NormalPerFrictionX,
    /// Normal force per friction along y.
    NormalPerFrictionY,
    /// Share by which full shear along x raises the normal force.
    NormalShearX,
    /// The same along y.
    NormalShearY,
    /// Part of the friction along x that is odd in the direction, per mm of depth.
    OddXPerMm,
    /// Exponent of the strength in the tissue's stiffness at fixed depth.
    LoadExponent,
    /// Strength over direction: share in proportion to cos 2θ.
    EvenDirectionCos,
    /// The same with sin 2θ.
    EvenDirectionSin,
    /// Added to the coefficient of (depth - 0.9 mm)² in ln L, 1/mm².
    StrengthDepthCurvature,
    /// Third-order change of the elements' shares over their yield positions.
    YieldTwist,
    /// Strength over direction: share in proportion to cos θ.
    OddDirectionCos,
    /// The same with sin θ.
    OddDirectionSin,
    /// Change of the share of cos 2θ with u = ln(depth / 0.9 mm).
    EvenDirectionCosSlope,
    /// Change of the logarithm of the stiffness ratio with u.
    StiffnessRatioYExponent,
    /// Slide along y that pressing amounts to, mm per mm of depth: a finger or a sensor that is not quite straight.
    PressCouplingY,
}

/// Description and prior of a parameter.
#[derive(Clone, Copy, Debug)]
pub struct ParameterInfo {
    /// The parameter.
    pub parameter: Parameter,
    /// Name in reports, with its unit if it has one.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Standard deviation between fingers and devices, before any calibration.
    pub sd_between_fingers: f64,
    /// Standard deviation of the change between two measurements of one finger on one device.
    pub sd_drift: f64,
}

const fn info(
    parameter: Parameter,
    name: &'static str,
    unit: &'static str,
    sd_between_fingers: f64,
    sd_drift: f64,
) -> ParameterInfo {
    ParameterInfo { parameter, name, unit, sd_between_fingers, sd_drift }
}

use Parameter as P;

/// Drift of the exponent, slope and curvature of a curve over depth: with the first two, two per cent between 0.45 and 1.55 mm.
const SHAPE_DRIFT: f64 = 0.014;

/// All parameters, in the order of the vector. All are 0 for the finger of the model file, except where
/// [`ReferenceCurves::mean`](crate::ReferenceCurves::mean) takes a value from it.
static INFO: [ParameterInfo; Parameter::COUNT] = [
    info(P::NormalScale, "ln_normal_scale", "", 1.0, 0.10),
    info(P::NormalDepthExponent, "normal_depth_exponent", "", 0.5, SHAPE_DRIFT),
    info(P::NormalDepthSlope, "normal_depth_slope", "1/mm", 0.5, SHAPE_DRIFT),
    info(P::NormalDepthCurvature, "normal_depth_curvature", "1/mm2", 0.05, SHAPE_DRIFT),
    info(P::StrengthScale, "ln_strength_scale", "", 1.0, 0.10),
    info(P::StrengthDepthExponent, "strength_depth_exponent", "", 0.4, SHAPE_DRIFT),
    info(P::StrengthDepthSlope, "strength_depth_slope", "1/mm", 0.4, SHAPE_DRIFT),
    info(P::TangentialScale, "ln_tangential_stiffness", "", 1.0, 0.05),
    info(P::TangentialDepthExponent, "tangential_depth_exponent", "", 0.4, 0.02),
    info(P::TangentialDepthSlope, "tangential_depth_slope", "1/mm", 0.3, 0.02),
    info(P::StiffnessRatioY, "ln_stiffness_ratio_y", "", 0.5, 0.03),
    info(P::YieldSpread, "ln_yield_spread", "", 0.7, 0.05),
    info(P::YieldTilt, "yield_tilt", "", 0.8, 0.10),
    info(P::YieldBow, "yield_bow", "", 0.8, 0.10),
    info(P::PressCoupling, "press_coupling", "mm/mm", 0.05, 0.002),
    info(P::PressCouplingSlope, "press_coupling_slope", "1/mm", 0.02, 0.001),
    info(P::NormalPerFrictionX, "normal_per_friction_x", "", 0.1, 0.004),
    info(P::NormalPerFrictionY, "normal_per_friction_y", "", 0.03, 0.004),
    info(P::NormalShearX, "normal_shear_x", "", 0.1, 0.006),
    info(P::NormalShearY, "normal_shear_y", "", 0.1, 0.006),
    info(P::OddXPerMm, "odd_x_per_mm", "1/mm", 0.03, 0.003),
    info(P::LoadExponent, "load_exponent_at_fixed_depth", "", 0.10, 0.02),
    info(P::EvenDirectionCos, "even_direction_cos", "", 0.020, 0.002),
    info(P::EvenDirectionSin, "even_direction_sin", "", 0.010, 0.002),
    info(P::StrengthDepthCurvature, "strength_depth_curvature", "1/mm2", 0.04, SHAPE_DRIFT),
    info(P::YieldTwist, "yield_twist", "", 0.8, 0.10),
    info(P::OddDirectionCos, "odd_direction_cos", "", 0.020, 0.002),
    info(P::OddDirectionSin, "odd_direction_sin", "", 0.010, 0.002),
    info(P::EvenDirectionCosSlope, "even_direction_cos_slope", "", 0.030, 0.004),
    info(P::StiffnessRatioYExponent, "stiffness_ratio_y_exponent", "", 0.15, 0.02),
    info(P::PressCouplingY, "press_coupling_y", "mm/mm", 0.03, 0.002),
];

impl Parameter {
    /// Number of parameters.
    pub const COUNT: usize = Self::PressCouplingY as usize + 1;

    /// All parameters, in the order of the vector.
    pub fn all() -> impl ExactSizeIterator<Item = Self> {
        INFO.iter().map(|info| info.parameter)
    }

    /// Place of the parameter in the vector.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Name, unit and prior standard deviations.
    pub fn info(self) -> &'static ParameterInfo {
        &INFO[self.index()]
    }

    /// Whether the parameter has no influence on the elements: the normal force's curve, and the contributions of
    /// friction to the readings.
    pub fn acts_on_readings_only(self) -> bool {
        matches!(
            self,
            Self::NormalScale
                | Self::NormalDepthExponent
                | Self::NormalDepthSlope
                | Self::NormalDepthCurvature
                | Self::NormalPerFrictionX
                | Self::NormalPerFrictionY
                | Self::NormalShearX
                | Self::NormalShearY
                | Self::OddXPerMm
        )
    }
}

/// Values of all parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters([f64; Parameter::COUNT]);

impl Parameters {
    /// All parameters 0.
    pub const ZERO: Self = Self([0.0; Parameter::COUNT]);

    /// The values in the order of the vector.
    pub fn as_slice(&self) -> &[f64] {
        &self.0
    }
}

impl Index<Parameter> for Parameters {
    type Output = f64;

    fn index(&self, parameter: Parameter) -> &f64 {
        &self.0[parameter.index()]
    }
}

impl IndexMut<Parameter> for Parameters {
    fn index_mut(&mut self, parameter: Parameter) -> &mut f64 {
        &mut self.0[parameter.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_names() {
        for (place, parameter) in Parameter::all().enumerate() {
            assert_eq!(place, parameter.index(), "{}", parameter.info().name);
        }
    }
}
