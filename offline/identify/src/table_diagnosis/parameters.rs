//! Possible differences between the simulated and the real experiment: constants of the finger, and effects.
//!
//! Main types: [`Parameter`], [`Values`] (one number for each), [`Effect`] (a named group of them).

use serde::{Deserialize, Serialize};

/// A number that a fit may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Natural logarithm of the factor on every stiffness of the finger.
    LnStiffness,
    /// Added to every depth, mm.
    DepthOffset,
    /// Natural logarithm of the strength at 5 kPa over 1 kPa.
    LnStrength,
    /// Exponent beta of the pressure.
    Exponent,
    /// Share of the strength at 5 kPa that is tau_0.
    Tau0Share,
    /// Natural logarithm of the factor on every length of the finger.
    LnSize,
    /// Added to the clearance under the bone, mm, on a finger of size 1.
    BoneClearance,
    /// Rate a of the factor e^(a (depth - 0.8 mm)) on the stiffness, 1/mm.
    StrainStiffening,
    /// Pull-off W: the sensor reads W sqrt(A/63.5 mm²) less than the elastic load, N.
    PullOff,
    /// Reading of the normal force's sensor without load, N.
    NormalForceOffset,
    /// Angle of the sensor's normal axis to the plane's, degrees; positive where friction lowers the normal reading.
    Tilt,
    /// Error of one depth (index of the slot), mm.
    DepthError(usize),
}

use Parameter::*;

/// Parameters before those of single depths.
const SCALARS: [Parameter; 11] = [
    LnStiffness,
    DepthOffset,
    LnStrength,
    Exponent,
    Tau0Share,
    LnSize,
    BoneClearance,
    StrainStiffening,
    PullOff,
    NormalForceOffset,
    Tilt,
];

/// Knowledge of a parameter before the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Standard deviation about the value without the effect.
    pub sd: f64,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
}

impl Parameter {
    /// The prior before the table is read.
    ///
    /// The differences of stiffness and strength between subjects are far larger than their error after a fit. The
    /// exponents of fingers lie between F ~ N^(2/3) and F ~ N (Dzidek et al. 2014), that is beta between 0 and 1.
    /// Pull-off forces of fingertips up to 15 mN were found (Spinner, Wiechert & Gorb 2016). Normal zeros of force
    /// plates in use drift by 0.1 N. Depth errors have their column.
    pub fn prior(self) -> Prior {
        let (sd, bounds) = match self {
            LnStiffness => (0.7, [-1.6, 1.6]),
            DepthOffset => (0.1, [-0.4, 0.4]),
            LnStrength => (0.7, [-1.2, 3.4]),
            Exponent => (0.3, [-0.6, 1.2]),
            Tau0Share => (0.4, [0.0, 0.9]),
            LnSize => (0.1, [-0.25, 0.25]),
            BoneClearance => (0.5, [-1.2, 1.2]),
            StrainStiffening => (0.3, [-1.5, 1.5]),
            PullOff => (0.015, [0.0, 0.15]),
            NormalForceOffset => (0.05, [-0.3, 0.3]),
            Tilt => (2.0, [-10.0, 10.0]),
            DepthError(_) => (0.05, [-0.25, 0.25]),
        };
        Prior { sd, bounds }
    }

    /// Its name in a report, with the unit at its end.
    pub fn name(self) -> &'static str {
        match self {
            LnStiffness => "ln_stiffness_factor",
            DepthOffset => "depth_offset_mm",
            LnStrength => "ln_strength_at_5_kpa_in_kpa",
            Exponent => "beta",
            Tau0Share => "tau0_share_of_strength_at_5_kpa",
            LnSize => "ln_size_factor",
            BoneClearance => "bone_clearance_change_mm",
            StrainStiffening => "rate_per_mm",
            PullOff => "pull_off_n",
            NormalForceOffset => "normal_force_offset_n",
            Tilt => "tilt_deg",
            DepthError(_) => "depth_error_mm",
        }
    }

    /// Its unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            DepthOffset | BoneClearance | DepthError(_) => "mm",
            StrainStiffening => "1/mm",
            PullOff | NormalForceOffset => "N",
            Tilt => "deg",
            _ => "",
        }
    }
}

/// A value for every parameter; all zero, apart from the law, is the finger as it was modelled.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    scalars: [f64; SCALARS.len()],
    /// Error of each slot's depth, mm.
    pub depth_errors_mm: Vec<f64>,
}

impl Values {
    /// No effect, under a law.
    ///
    /// * `strength_kpa`: strength at 5 kPa
    pub fn without_effects(slots: usize, strength_kpa: f64, beta: f64, tau0_share: f64) -> Self {
        let none = Self { scalars: [0.0; SCALARS.len()], depth_errors_mm: vec![0.0; slots] };
        none.with(LnStrength, strength_kpa.ln()).with(Exponent, beta).with(Tau0Share, tau0_share)
    }

    /// Value of a parameter.
    pub fn get(&self, parameter: Parameter) -> f64 {
        match parameter {
            DepthError(slot) => self.depth_errors_mm[slot],
            other => self.scalars[place(other)],
        }
    }

    /// The same with another value of one parameter.
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        match parameter {
            DepthError(slot) => self.depth_errors_mm[slot] = value,
            other => self.scalars[place(other)] = value,
        }
        self
    }
}

fn place(parameter: Parameter) -> usize {
    SCALARS.iter().position(|p| *p == parameter).expect("every other parameter is listed")
}

/// A candidate explanation of the gap between simulation and measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// The sensor of the normal force does not read zero without load.
    NormalForceZero,
    /// Single depths are off.
    DepthErrors,
    /// The touch point is off: all depths by the same.
    DepthZero,
    /// The tissue is stiffer or softer.
    TissueStiffness,
    /// The tissue stiffens with depth more, or less, than by its law.
    StrainStiffening,
    /// Strength at zero pressure.
    Tau0,
    /// Another exponent beta.
    Exponent,
    /// Another size of the finger, another clearance under the bone.
    Geometry,
    /// Pull-off at the contact's rim.
    Adhesion,
    /// The sensor's axes are not the plane's.
    SensorTilt,
}

impl Effect {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::NormalForceZero,
        Self::DepthErrors,
        Self::DepthZero,
        Self::TissueStiffness,
        Self::StrainStiffening,
        Self::Tau0,
        Self::Exponent,
        Self::Geometry,
        Self::Adhesion,
        Self::SensorTilt,
    ];

    /// Its name in `report.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::NormalForceZero => "normal_force_zero",
            Self::DepthErrors => "depth_errors",
            Self::DepthZero => "depth_zero",
            Self::TissueStiffness => "tissue_stiffness",
            Self::StrainStiffening => "strain_stiffening",
            Self::Tau0 => "tau0",
            Self::Exponent => "exponent",
            Self::Geometry => "geometry",
            Self::Adhesion => "adhesion",
            Self::SensorTilt => "sensor_tilt",
        }
    }

    /// Its name in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::NormalForceZero => "zero of the normal force",
            Self::DepthErrors => "errors of single depths",
            Self::DepthZero => "touch point",
            Self::TissueStiffness => "stiffness of the tissue",
            Self::StrainStiffening => "strain stiffening",
            Self::Tau0 => "strength tau_0 at zero pressure",
            Self::Exponent => "exponent beta",
            Self::Geometry => "size and bone clearance",
            Self::Adhesion => "adhesion",
            Self::SensorTilt => "tilt of the sensor",
        }
    }

    /// The parameters that it moves, in a table of `slots` depths.
    pub fn parameters(self, slots: usize) -> Vec<Parameter> {
        match self {
            Self::NormalForceZero => vec![NormalForceOffset],
            Self::DepthErrors => (0..slots).map(DepthError).collect(),
            Self::DepthZero => vec![DepthOffset],
            Self::TissueStiffness => vec![LnStiffness],
            Self::StrainStiffening => vec![StrainStiffening],
            Self::Tau0 => vec![Tau0Share],
            Self::Exponent => vec![Exponent],
            Self::Geometry => vec![LnSize, BoneClearance],
            Self::Adhesion => vec![PullOff],
            Self::SensorTilt => vec![Tilt],
        }
    }

    /// Whether it is one of the constants that every table of another finger needs, and that no model is judged without.
    pub fn is_constant(self) -> bool {
        matches!(self, Self::DepthZero | Self::TissueStiffness)
    }
}

/// Constants that differ from finger to finger and are refitted beside every effect: stiffness, touch point, strength.
pub const CONSTANTS: [Parameter; 3] = [LnStiffness, DepthOffset, LnStrength];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_moves_parameters_of_its_own() {
        let mut seen = Vec::new();
        let none = Values::without_effects(4, 7.5, 0.46, 0.0);
        for effect in Effect::ALL {
            for parameter in effect.parameters(4) {
                assert!(!seen.contains(&parameter), "{parameter:?}");
                seen.push(parameter);
                let [low, high] = parameter.prior().bounds;
                let value = none.get(parameter);
                assert!(low <= value && value <= high, "{parameter:?}");
                let moved = none.clone().with(parameter, value + 0.01);
                assert!(moved != none && (moved.get(parameter) - value - 0.01).abs() < 1e-15);
            }
            let written = serde_json_name(effect);
            assert_eq!(written, effect.name());
        }
        assert_eq!(seen.len(), 14);
    }

    /// The name under which serde writes an effect.
    fn serde_json_name(effect: Effect) -> String {
        serde_json::to_value(effect).unwrap().as_str().unwrap().to_owned()
    }
}
