//! Settings of an identification: section `[identify]` of a configuration file.

use serde::{Deserialize, Serialize};

use super::{CalibrationParameter, IdentifyError, Region};

/// Section `[identify]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Residual over contact force of a steady state; finer than along a path, because derivatives are taken.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub tolerance: f64,
    /// Whether tau_0 is searched for beside lambda and beta; without, it keeps its value of `[friction]`.
    pub free_tau0: bool,
    /// Whether finger and law are also fitted to the table without a zero of the normal force, for several zeros.
    pub force_zero: bool,
    /// Confidence level of regions and intervals, 0 to 1.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub confidence: f64,
    /// Known standard error of a measured friction coefficient, % of it. Without it the coefficients have equal weights
    /// and their error is estimated from the misfit.
    pub friction_coefficient_percent: Option<f64>,
    /// Search region of the law's constants.
    pub region: Region,
    /// Calibration of the finger.
    pub calibration: Calibration,
    /// The paper's procedure.
    pub simplex: Simplex,
    /// The fast route.
    pub fast: Fast,
    /// Fit of everything at once.
    pub joint: Joint,
    /// Predictions.
    pub prediction: Prediction,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            free_tau0: false,
            force_zero: false,
            confidence: 0.95,
            friction_coefficient_percent: None,
            region: Region::default(),
            calibration: Calibration::default(),
            simplex: Simplex::default(),
            fast: Fast::default(),
            joint: Joint::default(),
            prediction: Prediction::default(),
        }
    }
}

/// Model state that the table's normal forces and areas are compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Compared {
    /// The steady slide: a friction coefficient is a ratio of forces of the same moment.
    #[default]
    Slide,
    /// The press before it, without friction.
    Press,
}

/// Calibration of the finger on normal force and contact area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Calibration {
    /// Whether the finger is calibrated at all.
    pub enabled: bool,
    /// Parameters that may vary.
    pub vary: Vec<VariedParameter>,
    /// Model state that is compared.
    pub compared: Compared,
    /// Standard error of a measured normal force, % (sets its weight).
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub normal_force_percent: f64,
    /// Standard error of a measured area, %.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub contact_area_percent: f64,
    /// Most evaluations of all depths, derivatives not counted.
    pub max_evaluations: usize,
}

impl Default for Calibration {
    /// Stiffness and depth offset: the two that eight numbers of a table determine without bending the shape.
    fn default() -> Self {
        let varied = |name| VariedParameter { name, min: None, max: None };
        Self {
            enabled: true,
            vary: vec![varied(CalibrationParameter::Stiffness), varied(CalibrationParameter::DepthOffsetMm)],
            compared: Compared::Slide,
            normal_force_percent: 5.0,
            contact_area_percent: 5.0,
            max_evaluations: 20,
        }
    }
}

/// A parameter of the finger that varies in the calibration, with its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VariedParameter {
    /// The parameter.
    pub name: CalibrationParameter,
    /// Least value; its own default if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}

/// Downhill simplex [Nelder & Mead 1965] on (lambda, beta), the sum of squared differences of the friction
/// coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Simplex {
    /// Whether it runs.
    pub enabled: bool,
    /// Starts: pairs of lambda (MPa^(1 - beta)) and beta.
    pub starts: Vec<[f64; 2]>,
    /// Side of the first simplex, as a share of the start's value.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub first_side: f64,
    /// Largest distance of a vertex from the best one, in lambda and in beta, at the stop.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub tolx: f64,
    /// Largest difference of a vertex' sum of squares from the best one's at the stop.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub tolf: f64,
    /// Evaluations after which a start is abandoned.
    pub max_evaluations: usize,
}

impl Default for Simplex {
    /// The published constants, a weak and a strong law as starts; the paper's tolerances; the first simplex of
    /// MATLAB's `fminsearch`.
    fn default() -> Self {
        Self {
            enabled: true,
            starts: vec![[0.086, 0.46], [0.02, 0.2], [0.3, 0.7]],
            first_side: 0.05,
            tolx: 1e-3,
            tolf: 1e-3,
            max_evaluations: 400,
        }
    }
}

/// Space mapping, then Gauss–Newton.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fast {
    /// Change of ln(tau at 5 kPa) and beta below which it is done.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub tolerance: f64,
    /// Most finite-element evaluations of the space mapping.
    pub max_mappings: usize,
    /// Relative tolerance of Gauss–Newton (Levenberg–Marquardt).
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub gauss_newton_tolerance: f64,
}

impl Default for Fast {
    fn default() -> Self {
        Self { tolerance: 1e-3, max_mappings: 8, gauss_newton_tolerance: 1e-6 }
    }
}

/// Fit of finger, depths and law together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Joint {
    /// Whether it runs.
    pub enabled: bool,
    /// Standard error of a measured depth, mm: each point's depth may move by as much.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub depth_mm: f64,
    /// Standard error of a measured friction coefficient, %, unless that of `[identify]` is given.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub friction_coefficient_percent: f64,
    /// Most evaluations of all depths, derivatives not counted.
    pub max_evaluations: usize,
}

impl Default for Joint {
    fn default() -> Self {
        Self { enabled: false, depth_mm: 0.1, friction_coefficient_percent: 2.0, max_evaluations: 25 }
    }
}

/// Predictions with the constants found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Prediction {
    /// F/N over these normal forces, N, as far as the finite elements get.
    pub normal_force_n: [f64; 2],
    /// Depths of that curve.
    pub points: usize,
    /// Whether the curve and the published checks are computed.
    pub curve: bool,
    /// Whether the sensitivities are computed.
    pub sensitivities: bool,
}

impl Default for Prediction {
    fn default() -> Self {
        Self { normal_force_n: [0.05, 5.0], points: 14, curve: true, sensitivities: true }
    }
}

/// Largest normal force of a predicted curve, N: far beyond any load of a fingertip's pad.
const MOST_FORCE_N: f64 = 100.0;
/// Most points of a predicted curve.
const MOST_POINTS: usize = 1000;

impl Settings {
    /// Refuses settings that contradict each other or are impossible for a finger.
    ///
    /// # Errors
    /// [`IdentifyError::Setting`] with key and problem.
    pub fn validate(&self) -> Result<(), IdentifyError> {
        let refuse = |key: &str, problem: String| Err(IdentifyError::Setting { key: key.into(), problem });
        self.region.validate()?;
        if !(self.confidence < 1.0) {
            return refuse("confidence", format!("{} must be below 1", self.confidence));
        }
        if let Some(percent) = self.friction_coefficient_percent
            && !(percent > 0.0 && percent.is_finite())
        {
            return refuse("friction_coefficient_percent", format!("{percent} must be above 0"));
        }
        let [a, b] = self.prediction.normal_force_n;
        if !(a > 0.0 && b > a && b <= MOST_FORCE_N) {
            let problem = format!("[{a}, {b}] must be two rising numbers above 0 and up to {MOST_FORCE_N} N");
            return refuse("prediction.normal_force_n", problem);
        }
        if !(2..=MOST_POINTS).contains(&self.prediction.points) {
            let problem = format!("{} must be between 2 and {MOST_POINTS}", self.prediction.points);
            return refuse("prediction.points", problem);
        }
        for (k, varied) in self.calibration.vary.iter().enumerate() {
            let ([low, high], [least, most]) = (varied.bounds(), varied.name.limits());
            if !(high > low) {
                return refuse("calibration.vary", format!("{:?}: bounds {low}, {high} do not rise", varied.name));
            }
            if !(low >= least && high <= most) {
                let problem = format!("{:?}: bounds {low}, {high} must lie between {least} and {most}", varied.name);
                return refuse("calibration.vary", problem);
            }
            if self.calibration.vary[..k].iter().any(|other| other.name == varied.name) {
                return refuse("calibration.vary", format!("{:?} is given twice", varied.name));
            }
        }
        for start in &self.simplex.starts {
            let law = fingerpad_fe::contact::RubberFriction { lambda: start[0], beta: start[1], ..Default::default() };
            if let Some(reason) = self.region.leaves(&law) {
                return refuse("simplex.starts", format!("[{}, {}]: {reason}", start[0], start[1]));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_beyond_a_finger_are_refused_with_their_key() {
        assert!(Settings::default().validate().is_ok());
        let vary = |name, min, max| Settings {
            calibration: Calibration { vary: vec![VariedParameter { name, min, max }], ..Calibration::default() },
            ..Settings::default()
        };
        let predict = |normal_force_n, points| Settings {
            prediction: Prediction { normal_force_n, points, ..Prediction::default() },
            ..Settings::default()
        };
        let start =
            |start| Settings { simplex: Simplex { starts: vec![start], ..Simplex::default() }, ..Settings::default() };
        for (settings, key) in [
            (vary(CalibrationParameter::Stiffness, Some(-1.0), None), "calibration.vary"),
            (vary(CalibrationParameter::HalfWidthMm, None, Some(1e6)), "calibration.vary"),
            (vary(CalibrationParameter::DepthOffsetMm, Some(f64::NAN), None), "calibration.vary"),
            (predict([0.05, 300.0], 14), "prediction.normal_force_n"),
            (predict([0.05, 5.0], 1), "prediction.points"),
            (start([1e9, 0.4]), "simplex.starts"),
            (start([0.086, -5.0]), "simplex.starts"),
        ] {
            let message = settings.validate().unwrap_err().to_string();
            assert!(message.starts_with(&format!("identify.{key}")), "{message}");
        }
    }
}
