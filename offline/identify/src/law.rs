//! The friction law's constants in the coordinates of the search, and the region they are searched in.

use serde::{Deserialize, Serialize};

use super::IdentifyError;
use fingerpad_fe::contact::RubberFriction;

/// Pressure at which strengths are compared, MPa: a middle value under a lightly pressed finger.
pub const REFERENCE_MPA: f64 = 0.005;

/// Steepest onset of a law, strength over pressure: that of the published constants, regularised below 0.1 kPa, is 19.
pub const STEEPEST_ONSET: f64 = 20.0;

/// Constants of a law: strength at 5 kPa, exponent, and the share of that strength that does not depend on pressure.
///
/// lambda's unit depends on beta, so the pair (lambda, beta) is strongly correlated; this one hardly is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawPoint {
    /// Strength at 5 kPa, tau_0 included, kPa, > 0.
    pub tau_ref_kpa: f64,
    /// Exponent of the pressure.
    pub beta: f64,
    /// tau_0 over the strength at 5 kPa, 0 to 1.
    pub tau0_share: f64,
}

impl LawPoint {
    /// Constants of a law.
    pub fn of(law: &RubberFriction) -> Self {
        let tau_ref_mpa = law.tau0_mpa + law.lambda * REFERENCE_MPA.powf(law.beta);
        Self { tau_ref_kpa: 1e3 * tau_ref_mpa, beta: law.beta, tau0_share: law.tau0_mpa / tau_ref_mpa }
    }

    /// The law with these constants; elastic slip as in `base`, regularisation by [`Self::regular_pressure_mpa`].
    pub fn friction(&self, base: &RubberFriction) -> RubberFriction {
        let tau_ref_mpa = 1e-3 * self.tau_ref_kpa;
        let tau0_mpa = tau_ref_mpa * self.tau0_share;
        let lambda = (tau_ref_mpa - tau0_mpa) / REFERENCE_MPA.powf(self.beta);
        let regular_pressure_mpa = self.regular_pressure_mpa(base.regular_pressure_mpa);
        RubberFriction { lambda, beta: self.beta, tau0_mpa, regular_pressure_mpa, ..*base }
    }

    /// Pressure below which the power is regularised, MPa: `usual_mpa`, or more if the law would begin too steeply.
    ///
    /// A contact point that hardly touches and yet is dragged strongly along is lifted off the plane by its own
    /// friction: where strength over pressure at the onset, `(2 - beta) lambda p^(beta - 1)`, is large, points of the
    /// rim can neither touch nor open, and there is no steady slide. It is therefore at most 20, which does not change
    /// the law of the published constants; with 7 kPa at 5 kPa the regular pressure is 0.4 kPa for beta = 0.2, 0.7 kPa
    /// for 0 and 1.2 kPa for -0.3.
    pub fn regular_pressure_mpa(&self, usual_mpa: f64) -> f64 {
        let at_reference = 1e-3 * self.tau_ref_kpa * (1.0 - self.tau0_share) / REFERENCE_MPA;
        let onset = |p: f64| (2.0 - self.beta) * at_reference * (p / REFERENCE_MPA).powf(self.beta - 1.0);
        if !(onset(usual_mpa) > STEEPEST_ONSET) || self.beta >= 1.0 {
            return usual_mpa;
        }
        REFERENCE_MPA * (STEEPEST_ONSET / ((2.0 - self.beta) * at_reference)).powf(1.0 / (self.beta - 1.0))
    }

    /// lambda, MPa^(1 - beta).
    pub fn lambda(&self) -> f64 {
        self.friction(&RubberFriction::default()).lambda
    }

    /// As coordinates of a search: ln(tau_ref/kPa), beta and, if `free_tau0`, tau_0's share.
    pub fn coordinates(&self, free_tau0: bool) -> Vec<f64> {
        let mut x = vec![self.tau_ref_kpa.ln(), self.beta];
        if free_tau0 {
            x.push(self.tau0_share);
        }
        x
    }

    /// The law at these coordinates; without a third one tau_0's share is unchanged.
    pub fn at(&self, x: &[f64]) -> Self {
        Self { tau_ref_kpa: x[0].exp(), beta: x[1], tau0_share: x.get(2).copied().unwrap_or(self.tau0_share) }
    }
}

/// Strengths at 5 kPa beyond which no dry or moist skin, rubber or gel lies, kPa.
const TAU_REF_LIMITS_KPA: [f64; 2] = [1e-3, 1e3];

/// Search region of the law's constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Region {
    /// Least and largest strength at 5 kPa, kPa.
    pub tau_ref_kpa: [f64; 2],
    /// Least and largest exponent. Below 0, friction falls while pressure grows.
    pub beta: [f64; 2],
}

impl Default for Region {
    fn default() -> Self {
        Self { tau_ref_kpa: [0.5, 40.0], beta: [-1.0, 1.5] }
    }
}

impl Region {
    /// Refuses bounds that are not numbers in order.
    ///
    /// # Errors
    /// [`IdentifyError::Setting`].
    pub fn validate(&self) -> Result<(), IdentifyError> {
        let refuse = |key: &str, [a, b]: [f64; 2], rule: &str| {
            let problem = format!("[{a}, {b}]: {rule}");
            Err(IdentifyError::Setting { key: format!("region.{key}"), problem })
        };
        let [a, b] = self.tau_ref_kpa;
        if !(a >= TAU_REF_LIMITS_KPA[0] && b > a && b <= TAU_REF_LIMITS_KPA[1]) {
            let [least, most] = TAU_REF_LIMITS_KPA;
            let rule = format!("must be two rising numbers between {least} and {most} kPa");
            return refuse("tau_ref_kpa", self.tau_ref_kpa, &rule);
        }
        let [a, b] = self.beta;
        if !(a > -2.0 && b > a && b < 2.0) {
            return refuse("beta", self.beta, "must be two rising numbers between -2 and 2");
        }
        Ok(())
    }

    /// The reason why a law is outside the region; none inside.
    pub fn leaves(&self, law: &RubberFriction) -> Option<String> {
        let point = LawPoint::of(law);
        let inside = |[a, b]: [f64; 2], v: f64| a <= v && v <= b;
        if !(law.lambda > 0.0) {
            return Some(format!("lambda {:.4e} is not positive", law.lambda));
        }
        if !inside(self.beta, law.beta) {
            return Some(format!("beta {:.4} is outside {} to {}", law.beta, self.beta[0], self.beta[1]));
        }
        if !inside(self.tau_ref_kpa, point.tau_ref_kpa) {
            let [a, b] = self.tau_ref_kpa;
            return Some(format!("strength at 5 kPa {:.4e} kPa is outside {a} to {b}", point.tau_ref_kpa));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad_fe::contact::FrictionLaw;

    #[test]
    fn constants_go_there_and_back() {
        for (lambda, beta, tau0_mpa) in [(0.086, 0.46, 0.0), (2e-4, -0.4, 0.0), (0.3, 0.9, 0.001)] {
            let law = RubberFriction { lambda, beta, tau0_mpa, ..Default::default() };
            let back = LawPoint::of(&law).friction(&law);
            assert!((back.lambda / lambda - 1.0).abs() < 1e-12 && (back.tau0_mpa - tau0_mpa).abs() < 1e-15);
            let point = LawPoint::of(&law);
            let again = point.at(&point.coordinates(true));
            assert!((again.tau_ref_kpa / point.tau_ref_kpa - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn no_law_begins_too_steeply_and_none_changes_at_the_reference_pressure() {
        let base = RubberFriction::default();
        let law = |beta| LawPoint { tau_ref_kpa: 7.0, beta, tau0_share: 0.0 }.friction(&base);
        for beta in [1.2, 0.8, 0.46, 0.2, 0.0, -0.2, -0.5, -1.0] {
            let onset = law(beta).strength(1e-12).1;
            assert!(onset < 1.0001 * STEEPEST_ONSET, "{beta}: {onset}");
            assert_eq!(law(beta).regular_pressure_mpa > base.regular_pressure_mpa, beta < 0.4, "{beta}");
            assert!((law(beta).strength(REFERENCE_MPA).0 / 0.007 - 1.0).abs() < 1e-12, "{beta}");
        }
        let published = LawPoint::of(&base).friction(&base);
        assert_eq!(published.regular_pressure_mpa, base.regular_pressure_mpa);
        assert!((law(0.2).regular_pressure_mpa - 3.8e-4).abs() < 2e-5);
        assert!((law(-0.3).regular_pressure_mpa - 1.23e-3).abs() < 3e-5);
    }

    #[test]
    fn the_region_says_what_is_outside() {
        let region = Region::default();
        let law = |lambda, beta| RubberFriction { lambda, beta, ..Default::default() };
        assert_eq!(region.leaves(&law(0.086, 0.46)), None);
        assert!(region.leaves(&law(-0.1, 0.46)).unwrap().contains("lambda"));
        assert!(region.leaves(&law(f64::NAN, 0.46)).unwrap().contains("lambda"));
        assert!(region.leaves(&law(0.086, 1.6)).unwrap().contains("beta"));
        assert!(region.leaves(&law(0.086, -0.9)).unwrap().contains("strength"));
        assert!(Region { beta: [0.5, f64::NAN], ..region }.validate().is_err());
        for tau_ref_kpa in [[0.0, 1.0], [1e-9, 1.0], [1.0, 1e9], [2.0, 1.0], [1.0, f64::INFINITY]] {
            let message = Region { tau_ref_kpa, ..region }.validate().unwrap_err().to_string();
            assert!(message.contains("region.tau_ref_kpa") && message.contains("0.001 and 1000"), "{message}");
        }
        assert!(Region { beta: [-5.0, 1.0], ..region }.validate().is_err());
    }
}
