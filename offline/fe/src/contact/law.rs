//! Rubber friction: the local shear strength as a power of the pressure.

/// Local friction law `tau_crit = tau_0 + lambda sigma^beta` with elastic slip.
///
/// While the elastic slip `|gamma| <= gamma_crit` the traction is `tau_crit gamma/gamma_crit`, beyond it the
/// traction is `tau_crit` along the slip [Yoshida, Tada & Mochimaru 2011]. `beta = 1`, `tau_0 = 0` is Coulomb's
/// law with coefficient `lambda`.
///
/// Below `regular_pressure_mpa` both terms are replaced by the parabola through the origin that continues
/// them with their slope, because `sigma^beta` with `beta < 1` has an infinite slope at zero; `beta = 1` is not
/// changed by it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RubberFriction {
    /// Factor of the power law, MPa^(1 − beta), >= 0.
    #[serde(deserialize_with = "fingerpad_formats::units::non_negative")]
    pub lambda: f64,
    /// Exponent of the pressure, below 2; may be negative.
    #[serde(deserialize_with = "fingerpad_formats::units::finite")]
    pub beta: f64,
    /// Pressure-independent strength, MPa, >= 0.
    #[serde(deserialize_with = "fingerpad_formats::units::non_negative")]
    pub tau0_mpa: f64,
    /// Elastic slip at which the strength is reached, mm, > 0. A length of the law, not of the mesh.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub gamma_crit_mm: f64,
    /// Pressure below which the power is regularised, MPa, > 0.
    #[serde(deserialize_with = "fingerpad_formats::units::positive")]
    pub regular_pressure_mpa: f64,
}

impl Default for RubberFriction {
    /// The constants published by Yoshida et al. 2011, regularised below 1e-4 MPa.
    fn default() -> Self {
        Self { lambda: 0.086, beta: 0.46, tau0_mpa: 0.0, gamma_crit_mm: 0.006, regular_pressure_mpa: 1e-4 }
    }
}

impl RubberFriction {
    /// Coulomb's law with coefficient `mu` and elastic slip `gamma_crit_mm`.
    pub fn coulomb(mu: f64, gamma_crit_mm: f64) -> Self {
        Self { lambda: mu, beta: 1.0, gamma_crit_mm, ..Self::default() }
    }

    /// Strength `tau_crit` (MPa) at pressure `sigma` (MPa, compression positive) and its slope d tau/d sigma.
    ///
    /// Zero without pressure.
    pub fn strength(&self, sigma: f64) -> (f64, f64) {
        if !(sigma > 0.0) {
            return (0.0, 0.0);
        }
        let (power, power_slope) = self.regular_power(sigma, self.beta);
        let (constant, constant_slope) = if self.tau0_mpa > 0.0 { self.regular_power(sigma, 0.0) } else { (0.0, 0.0) };
        (self.lambda * power + self.tau0_mpa * constant, self.lambda * power_slope + self.tau0_mpa * constant_slope)
    }

    /// The law of a finger whose strength is `strength` and whose tissue is `stiffness` times that of this one, as the
    /// unchanged tissue sees it: with all moduli times s the same motion gives s times all stresses, so that
    /// tau_crit(s sigma) / s acts on the unchanged tissue, and every force it returns is to be multiplied by s.
    pub fn scaled(&self, strength: f64, stiffness: f64) -> Self {
        Self {
            lambda: self.lambda * strength * stiffness.powf(self.beta - 1.0),
            tau0_mpa: self.tau0_mpa * strength / stiffness,
            ..*self
        }
    }

    /// `sigma^beta` with its slope, a parabola below the regularisation pressure.
    fn regular_power(&self, sigma: f64, beta: f64) -> (f64, f64) {
        let s = sigma / self.regular_pressure_mpa;
        if s < 1.0 {
            let at = self.regular_pressure_mpa.powf(beta);
            let value = at * s * ((2.0 - beta) + (beta - 1.0) * s);
            let slope = at / self.regular_pressure_mpa * ((2.0 - beta) + 2.0 * (beta - 1.0) * s);
            (value, slope)
        } else {
            let value = sigma.powf(beta);
            (value, beta * value / sigma)
        }
    }

    /// Traction (MPa) along the elastic slip after a return map.
    ///
    /// * `trial`: elastic slip of the last increment plus the slip since, mm.
    /// * `tau_crit`: strength, MPa.
    /// * `force_stick`: leave the elastic slip unbounded (predictor).
    ///
    /// Returns traction, elastic slip (mm) and whether the point sticks.
    pub fn return_map(&self, trial: [f64; 2], tau_crit: f64, force_stick: bool) -> ([f64; 2], [f64; 2], bool) {
        let length = trial[0].hypot(trial[1]);
        let stuck = length <= self.gamma_crit_mm || force_stick;
        let elastic = if stuck { trial } else { trial.map(|g| g * (self.gamma_crit_mm / length)) };
        (elastic.map(|g| g * (tau_crit / self.gamma_crit_mm)), elastic, stuck)
    }

    /// Derivative of the traction of [`Self::return_map`] over the trial slip, MPa/mm, shape (2, 2).
    pub fn slip_stiffness(&self, trial: [f64; 2], tau_crit: f64, stuck: bool) -> [[f64; 2]; 2] {
        if stuck {
            let k = tau_crit / self.gamma_crit_mm;
            return [[k, 0.0], [0.0, k]];
        }
        let length = trial[0].hypot(trial[1]);
        let n = trial.map(|g| g / length);
        let k = tau_crit / length;
        [[k * (1.0 - n[0] * n[0]), -k * n[0] * n[1]], [-k * n[0] * n[1], k * (1.0 - n[1] * n[1])]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strength_is_the_power_law_above_the_regularisation_and_smooth_through_it() {
        let law = RubberFriction { tau0_mpa: 0.001, ..Default::default() };
        let (tau, _) = law.strength(0.005);
        assert!((tau - (0.001 + 0.086 * 0.005f64.powf(0.46))).abs() < 1e-15);
        let p = law.regular_pressure_mpa;
        let (below, above) = (law.strength(p * (1.0 - 1e-9)), law.strength(p * (1.0 + 1e-9)));
        assert!((below.0 - above.0).abs() < 1e-9 && (below.1 - above.1).abs() < 1e-6 * above.1.abs());
        assert_eq!(law.strength(0.0), (0.0, 0.0));
        assert_eq!(law.strength(f64::NAN), (0.0, 0.0));
    }

    #[test]
    fn slope_is_the_derivative_of_the_strength() {
        for beta in [-0.3, 0.46, 1.0, 1.3] {
            let law = RubberFriction { beta, tau0_mpa: 2e-4, ..Default::default() };
            for sigma in [1e-5, 9e-5, 2e-4, 5e-3, 0.2] {
                let h = 1e-6 * sigma;
                let numeric = (law.strength(sigma + h).0 - law.strength(sigma - h).0) / (2.0 * h);
                let slope = law.strength(sigma).1;
                assert!((numeric - slope).abs() <= 1e-6 * slope.abs().max(1e-3), "beta {beta} sigma {sigma}");
            }
        }
    }

    #[test]
    fn a_scaled_law_is_the_law_of_a_stiffer_tissue() {
        let law = RubberFriction { tau0_mpa: 5e-4, ..Default::default() };
        for (strength, stiffness) in [(1.0, 1.0), (1.3, 1.0), (0.8, 1.7), (1.1, 0.4)] {
            let there = law.scaled(strength, stiffness).strength(0.004).0 * stiffness;
            let here = law.strength(0.004 * stiffness).0 * strength;
            assert!((there - here).abs() < 1e-15, "{strength} {stiffness}");
        }
    }

    #[test]
    fn coulomb_is_exactly_linear() {
        let law = RubberFriction::coulomb(1.5, 1e-3);
        for sigma in [1e-7, 5e-5, 1e-4, 0.02] {
            assert!((law.strength(sigma).0 - 1.5 * sigma).abs() < 1e-16);
        }
    }

    #[test]
    fn return_map_follows_the_published_law_on_a_straight_path_and_its_stiffness_is_its_derivative() {
        let law = RubberFriction::default();
        let (traction, elastic, stuck) = law.return_map([0.003, 0.0], 0.01, false);
        assert!(stuck && (traction[0] - 0.005).abs() < 1e-15 && elastic[0] == 0.003);
        let (traction, elastic, stuck) = law.return_map([0.3, 0.4], 0.01, false);
        assert!(!stuck && (traction[0] - 0.006).abs() < 1e-15 && (elastic[1] - 0.0048).abs() < 1e-15);
        for trial in [[0.002, -0.001], [0.02, 0.07]] {
            let (_, _, stuck) = law.return_map(trial, 0.01, false);
            let stiffness = law.slip_stiffness(trial, 0.01, stuck);
            for k in 0..2 {
                let (mut up, mut down) = (trial, trial);
                up[k] += 1e-8;
                down[k] -= 1e-8;
                for i in 0..2 {
                    let numeric =
                        (law.return_map(up, 0.01, false).0[i] - law.return_map(down, 0.01, false).0[i]) / 2e-8;
                    assert!((numeric - stiffness[i][k]).abs() < 1e-6 * 0.01 / 0.006);
                }
            }
        }
    }
}
