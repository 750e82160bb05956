//! Possible differences between the simulated and the real experiment: constants of the finger, and effects.
//!
//! Main types: [`Parameter`], [`Values`] (one number for each), [`Effect`] (a named group of them).

use std::ops::Index;

use serde::{Serialize, Serializer};

use super::measured::QUANTITIES;
use crate::LawPoint;

/// A number that a fit may move: its place in [`Values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter(usize);

impl Parameter {
    /// Natural logarithm of the factor on every stiffness of the finger.
    pub const LN_STIFFNESS: Self = Self(0);
    /// Added to every depth, mm.
    pub const DEPTH_OFFSET: Self = Self(1);
    /// Natural logarithm of the strength at 5 kPa over 1 kPa.
    pub const LN_STRENGTH: Self = Self(2);
    /// Exponent beta of the pressure.
    pub const EXPONENT: Self = Self(3);
    /// Share of the strength at 5 kPa that is tau_0.
    pub const TAU0_SHARE: Self = Self(4);
    /// Natural logarithm of the factor on every length of the finger.
    pub const LN_SIZE: Self = Self(5);
    /// Added to the clearance under the bone, mm, on a finger of size 1.
    pub const BONE_CLEARANCE: Self = Self(6);
    /// Rate a of the factor e^(a (depth - 0.8 mm)) on the stiffness, 1/mm.
    pub const STRAIN_STIFFENING: Self = Self(7);
    /// Pull-off W: the sensor reads W sqrt(A/63.5 mm²) less than the elastic load, N.
    pub const PULL_OFF: Self = Self(8);
    /// Reading of the normal force's sensor without load, N.
    pub const NORMAL_FORCE_OFFSET: Self = Self(9);
    /// Angle of the sensor's normal axis to the plane's, degrees; positive where friction lowers the normal reading.
    pub const TILT: Self = Self(10);

    /// Error of the depth of a slot, mm.
    pub const fn depth_error(slot: usize) -> Self {
        Self(DEPTH_ERROR + slot)
    }

    /// The slot whose depth it corrects.
    pub fn slot(self) -> Option<usize> {
        self.0.checked_sub(DEPTH_ERROR)
    }

    /// What is known of it.
    pub fn known(self) -> &'static Known {
        &PARAMETERS[self.0.min(DEPTH_ERROR)]
    }

    /// Its name in a report, with the unit at its end.
    pub fn name(self) -> String {
        self.slot().map_or_else(|| self.known().name.into(), |slot| format!("depth_error_{}_mm", slot + 1))
    }
}

/// A kind of parameter.
pub struct Known {
    name: &'static str,
    /// Empty for a pure number.
    pub unit: &'static str,
    /// Standard deviation about the value without the effect, before the table is read.
    pub prior_sd: f64,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
}

const fn known(name: &'static str, unit: &'static str, prior_sd: f64, bounds: [f64; 2]) -> Known {
    Known { name, unit, prior_sd, bounds }
}

/// Place of the first slot's depth error.
const DEPTH_ERROR: usize = 11;

/// All kinds of parameters in the order of [`Values`].
///
/// The differences of stiffness and strength between subjects are far larger than their error after a fit. The exponents of
/// fingers lie between F ~ N^(2/3) and F ~ N (Dzidek et al. 2014), that is beta between 0 and 1. Pull-off forces of fingertips
/// up to 15 mN were found (Spinner, Wiechert & Gorb 2016). Normal zeros of force plates in use drift by 0.1 N.
const PARAMETERS: [Known; DEPTH_ERROR + 1] = [
    known("ln_stiffness_factor", "", 0.7, [-1.6, 1.6]),
    known("depth_offset_mm", "mm", 0.1, [-0.4, 0.4]),
    known("ln_strength_at_5_kpa_in_kpa", "", 0.7, [-1.2, 3.4]),
    known("beta", "", 0.3, [-0.6, 1.2]),
    known("tau0_share_of_strength_at_5_kpa", "", 0.4, [0.0, 0.9]),
    known("ln_size_factor", "", 0.1, [-0.25, 0.25]),
    known("bone_clearance_change_mm", "mm", 0.5, [-1.2, 1.2]),
    known("rate_per_mm", "1/mm", 0.3, [-1.5, 1.5]),
    known("pull_off_n", "N", 0.015, [0.0, 0.15]),
    known("normal_force_offset_n", "N", 0.05, [-0.3, 0.3]),
    known("tilt_deg", "deg", 2.0, [-10.0, 10.0]),
    known("depth_error_mm", "mm", 0.05, [-0.25, 0.25]),
];

/// Constants that differ from finger to finger and are refitted beside every effect: stiffness, touch point, strength.
pub const CONSTANTS: [Parameter; 3] = [Parameter::LN_STIFFNESS, Parameter::DEPTH_OFFSET, Parameter::LN_STRENGTH];

/// A value for every parameter; all zero, apart from the law, is the finger as it was modelled.
#[derive(Clone, Debug, PartialEq)]
pub struct Values(Vec<f64>);

impl Values {
    /// No effect, under a law, for a table of `slots` depths.
    pub fn without_effects(slots: usize, law: &LawPoint) -> Self {
        Self(vec![0.0; DEPTH_ERROR + slots])
            .with(Parameter::LN_STRENGTH, law.tau_ref_kpa.ln())
            .with(Parameter::EXPONENT, law.beta)
            .with(Parameter::TAU0_SHARE, law.tau0_share)
    }

    /// The same with another value of one parameter.
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self.0[parameter.0] = value;
        self
    }

    /// The friction law.
    pub fn law(&self) -> LawPoint {
        LawPoint {
            tau_ref_kpa: self[Parameter::LN_STRENGTH].exp(),
            beta: self[Parameter::EXPONENT],
            tau0_share: self[Parameter::TAU0_SHARE],
        }
    }

    /// Depth of a slot whose measured depth is given, mm.
    pub fn depth_mm(&self, measured_mm: f64, slot: usize) -> f64 {
        measured_mm + self[Parameter::DEPTH_OFFSET] + self[Parameter::depth_error(slot)]
    }
}

impl Index<Parameter> for Values {
    type Output = f64;

    fn index(&self, parameter: Parameter) -> &f64 {
        &self.0[parameter.0]
    }
}

/// A candidate explanation of the gap between simulation and measurement. A report holds its name.
#[derive(Debug, PartialEq)]
pub struct Effect {
    /// Its name.
    pub name: &'static str,
    /// The parameters that it moves; of the errors of single depths the first.
    moves: &'static [Parameter],
    /// Columns (indices of [`QUANTITIES`]) one of which the table must have.
    needs: &'static [usize],
    /// The experiment that would show it, as a sentence.
    pub experiment: &'static str,
}

impl Effect {
    /// The parameters that it moves, in a table of `slots` depths.
    pub fn parameters(&self, slots: usize) -> Vec<Parameter> {
        match self.moves {
            [first] if first.slot().is_some() => (0..slots).map(Parameter::depth_error).collect(),
            moves => moves.to_vec(),
        }
    }

    /// Whether it is one of the constants that every table of another finger needs, and that no model is judged without.
    pub fn is_constant(&self) -> bool {
        self.moves.iter().all(|p| CONSTANTS.contains(p))
    }

    /// The columns that a table lacks to show it.
    pub fn lacks(&self, has: impl Fn(usize) -> bool) -> Option<String> {
        let names: Vec<&str> = self.needs.iter().map(|q| QUANTITIES[*q]).collect();
        (!names.is_empty() && !self.needs.iter().any(|q| has(*q))).then(|| format!("no column {}", names.join(" or ")))
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name)
    }
}

const fn effect(
    name: &'static str,
    moves: &'static [Parameter],
    needs: &'static [usize],
    experiment: &'static str,
) -> Effect {
    Effect { name, moves, needs, experiment }
}

const LAW: &str = "slide at smaller depths with the area measured; tau_0 shows as F over area that stays finite at the least loads, \
                   the exponent in the slope above 1 N";
const PRESS: &str = "press without sliding from first touch on in steps of 0.1 mm, with the touch point from the sensor's own first \
                     reading";

/// All candidates.
pub static EFFECTS: [Effect; 10] = [
    effect(
        "normal_force_zero",
        &[Parameter::NORMAL_FORCE_OFFSET],
        &[0, 2],
        "read the unloaded sensor before and after every stroke, and slide with as little load as holds contact: near N = 0 the \
         reading of F/N then runs away or changes sign, while a right zero lets F vanish with N",
    ),
    effect(
        "depth_errors",
        &[Parameter::depth_error(0)],
        &[],
        "approach each depth at least three times from the air: the errors show as a scatter of the normal force that friction \
         over normal force does not share",
    ),
    effect("depth_zero", &[Parameter::DEPTH_OFFSET], &[], PRESS),
    effect("tissue_stiffness", &[Parameter::LN_STIFFNESS], &[0], PRESS),
    effect("strain_stiffening", &[Parameter::STRAIN_STIFFENING], &[0], PRESS),
    effect("tau0", &[Parameter::TAU0_SHARE], &[2], LAW),
    effect("exponent", &[Parameter::EXPONENT], &[2], LAW),
    effect(
        "geometry",
        &[Parameter::LN_SIZE, Parameter::BONE_CLEARANCE],
        &[],
        "measure the finger's width and the pulp's thickness (ultrasound or a press to the bone)",
    ),
    effect(
        "adhesion",
        &[Parameter::PULL_OFF],
        &[0, 2],
        "lift off slowly: a pull-off force is below zero of an unloaded sensor that reads zero, and grows with the hold before the \
         lift, which a zero of the sensor does not",
    ),
    effect(
        "sensor_tilt",
        &[Parameter::TILT],
        &[2],
        "slide back and forth: its share turns its sign with the motion, a zero does not",
    ),
];

/// The effect of a name.
///
/// # Panics
/// If there is none.
pub fn effect_named(name: &str) -> &'static Effect {
    EFFECTS.iter().find(|e| e.name == name).expect("a name of the list")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_moves_parameters_of_its_own_from_within_their_bounds() {
        let start = Values::without_effects(4, &LawPoint { tau_ref_kpa: 5.0, beta: 0.46, tau0_share: 0.0 });
        let mut moved: Vec<String> = Vec::new();
        for parameter in EFFECTS.iter().flat_map(|effect| effect.parameters(4)) {
            let [low, high] = parameter.known().bounds;
            assert!((low..=high).contains(&start[parameter]), "{}", parameter.name());
            assert!(!moved.contains(&parameter.name()), "{} is moved twice", parameter.name());
            moved.push(parameter.name());
        }
        assert_eq!(moved.len(), 10 + 4);
    }
}
