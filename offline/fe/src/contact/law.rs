//! Friction laws of a contact point: strength over pressure, traction over elastic slip.

use super::Orthotropy;

/// Local friction law with elastic slip: the interface between a contact point and its friction.
///
/// To add a law: implement this trait and add a variant to [`super::Friction`], the one place that distinguishes the
/// laws.
pub trait FrictionLaw {
    /// Strength `tau_crit` (MPa, >= 0) at pressure `pressure_mpa` (compression positive) and its slope
    /// d tau_crit / d pressure. Zero without pressure.
    fn strength(&self, pressure_mpa: f64) -> (f64, f64);

    /// Return map of the elastic slip.
    ///
    /// * `trial_mm`: elastic slip of the last increment plus the slip since, mm.
    /// * `pressure_mpa`: pressure, compression positive.
    /// * `force_stick`: leaves the elastic slip unbounded (for a predictor).
    fn return_map(&self, trial_mm: [f64; 2], pressure_mpa: f64, force_stick: bool) -> Sliding;

    /// Constants of orthotropic friction, of which strength and return map are those along the axis; none if it is isotropic.
    fn orthotropy(&self) -> Option<Orthotropy>;
}

/// Result of a friction law for a trial slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sliding {
    /// Traction that the plane exerts on the skin, MPa, along the elastic slip.
    pub traction: [f64; 2],
    /// Elastic slip after the return, mm.
    pub elastic_slip: [f64; 2],
    /// Whether the point was left to stick: its trial slip is within the limit, or it was forced to.
    pub stuck: bool,
    /// Whether the point is at rest: its elastic slip stays below the limit. A point at its limit is not.
    pub at_rest: bool,
    /// Derivative of the traction over the trial slip, MPa/mm, `by_slip[i][k] = d traction_i / d trial_k`.
    pub by_slip: [[f64; 2]; 2],
    /// Derivative of the traction over the pressure.
    pub by_pressure: [f64; 2],
    /// Derivative of the traction over the turn of [`Self::turned`], MPa/rad.
    pub by_turn: [f64; 2],
    /// Derivative of the traction over the angle of the skin's axis, MPa/rad; zero if friction is isotropic.
    pub by_axis: [f64; 2],
}

impl Sliding {
    /// A point without tangential traction, counted as stuck.
    pub const FRICTIONLESS: Self = Self {
        traction: [0.0; 2],
        elastic_slip: [0.0; 2],
        stuck: true,
        at_rest: true,
        by_slip: [[0.0; 2]; 2],
        by_pressure: [0.0; 2],
        by_turn: [0.0; 2],
        by_axis: [0.0; 2],
    };

    /// The result for a slip whose direction turned evenly over the increment, by `turn_rad` in all
    /// (counter-clockwise).
    ///
    /// The return map takes the slip along its chord, which is its direction half way. Of the elastic slip, the part
    /// that is new since then, `1 - |elastic slip|/|trial|`, is rotated to the direction at the end by half of the
    /// turn. The elastic slip of a sticking point turns with the plane and is not changed. In steady slip on a plane
    /// that spins, the friction then lags by the angle `gamma_crit/r` alone that the law gives at `r` from the pole, at
    /// any length of the increment.
    ///
    /// * `trial_mm`: the trial slip that was given to the return map
    /// * `self`: its result, with the elastic slip along the trial slip, at a bound that does not depend on it
    pub fn turned(mut self, trial_mm: [f64; 2], turn_rad: f64) -> Self {
        let length = trial_mm[0].hypot(trial_mm[1]);
        if self.stuck || !(length > 0.0) {
            return self;
        }
        let old = self.elastic_slip[0].hypot(self.elastic_slip[1]) / length;
        let (sin, cos) = (0.5 * turn_rad * (1.0 - old)).sin_cos();
        let turn = |v: [f64; 2]| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]];
        self.elastic_slip = turn(self.elastic_slip);
        self.traction = turn(self.traction);
        self.by_pressure = turn(self.by_pressure);
        let across = [-self.traction[1], self.traction[0]];
        self.by_turn = across.map(|t| 0.5 * (1.0 - old) * t);
        // The part that is new grows with the trial slip.
        let per_slip = trial_mm.map(|g| 0.5 * turn_rad * old * g / (length * length));
        let columns = [0, 1].map(|k| turn([self.by_slip[0][k], self.by_slip[1][k]]));
        self.by_slip = [0, 1].map(|i| [0, 1].map(|k| columns[k][i] + across[i] * per_slip[k]));
        self
    }
}

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
    /// Strength across an axis of the skin over the strength along it, 0.1 to 10. 1 is isotropic friction.
    #[serde(deserialize_with = "fingerpad_formats::units::positive", skip_serializing_if = "is_one")]
    pub across_over_along: f64,
    /// Angle of that axis from x towards y in the undeformed finger, degrees. The axis moves with the skin.
    #[serde(deserialize_with = "fingerpad_formats::units::finite", skip_serializing_if = "is_zero")]
    pub skin_axis_deg: f64,
}

// Isotropic friction is written as it was before it could be orthotropic.
fn is_one(x: &f64) -> bool {
    *x == 1.0
}
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Bounds of the exponent, the upper one excluded.
const LEAST_BETA: f64 = -1.0;
const MOST_BETA: f64 = 2.0;
/// Pressure of a pressed fingertip, MPa, at which the strength is held against [`MOST_COEFFICIENT`].
const TYPICAL_MPA: f64 = 0.01;
/// Largest strength over pressure there.
const MOST_COEFFICIENT: f64 = 20.0;

/// A constant that no friction law of skin has.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value}: must be {bound}")]
pub struct LawError {
    /// Name of the constant.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// The required condition.
    pub bound: &'static str,
}

/// Share of the elastic slip's limit within which a point counts as held at the limit.
const AT_LIMIT: f64 = 1e-6;

impl Default for RubberFriction {
    /// The constants published by Yoshida et al. 2011, regularised below 1e-4 MPa.
    fn default() -> Self {
        Self {
            lambda: 0.086,
            beta: 0.46,
            tau0_mpa: 0.0,
            gamma_crit_mm: 0.006,
            regular_pressure_mpa: 1e-4,
            across_over_along: 1.0,
            skin_axis_deg: 0.0,
        }
    }
}

impl RubberFriction {
    /// Coulomb's law with coefficient `mu` and elastic slip `gamma_crit_mm`.
    pub fn coulomb(mu: f64, gamma_crit_mm: f64) -> Self {
        Self { lambda: mu, beta: 1.0, gamma_crit_mm, ..Self::default() }
    }

    /// Refuses constants that are implausible for skin: with them the search for equilibrium is long and rarely
    /// converges.
    ///
    /// # Errors
    /// [`LawError`] with the value and its bound.
    pub fn check(&self) -> Result<(), LawError> {
        let refuse = |name, value, bound| Err(LawError { name, value, bound });
        if !(self.beta >= LEAST_BETA) {
            return refuse(
                "beta",
                self.beta,
                "at least -1; contact theory of rubber gives 0 to 1 [Yoshida et al. 2011]",
            );
        }
        if !(self.beta < MOST_BETA) {
            return refuse("beta", self.beta, "below 2, where the strength starts with a slope of zero");
        }
        if !(self.gamma_crit_mm > 0.0 && self.gamma_crit_mm.is_finite()) {
            return refuse("gamma_crit_mm", self.gamma_crit_mm, "greater than 0");
        }
        if !(self.regular_pressure_mpa > 0.0 && self.regular_pressure_mpa.is_finite()) {
            return refuse("regular_pressure_mpa", self.regular_pressure_mpa, "greater than 0");
        }
        if !(0.1..=10.0).contains(&self.across_over_along) {
            return refuse("across_over_along", self.across_over_along, "0.1 to 10; 1 is isotropic friction");
        }
        if !self.skin_axis_deg.is_finite() {
            return refuse("skin_axis_deg", self.skin_axis_deg, "a finite angle in degrees");
        }
        for (name, value, law) in [
            ("lambda", self.lambda, Self { tau0_mpa: 0.0, ..*self }),
            ("tau0_mpa", self.tau0_mpa, Self { lambda: 0.0, ..*self }),
        ] {
            let coefficient = law.strength(TYPICAL_MPA).0 / TYPICAL_MPA;
            if !(value >= 0.0 && coefficient <= MOST_COEFFICIENT) {
                let bound = "a strength of 0 to 20 times the pressure at 0.01 MPa, a fingertip's; skin has 0.1 to 5";
                return refuse(name, value, bound);
            }
        }
        Ok(())
    }

    /// The law that acts on this tissue as `strength` times this law would on a tissue `stiffness` times as stiff.
    ///
    /// With all moduli times `stiffness` the same motion gives `stiffness` times all stresses. A stiffer finger can
    /// therefore be computed on the unchanged tissue under the law
    ///
    /// `tau_scaled(p) = strength tau_crit(stiffness p) / stiffness`,
    ///
    /// exactly, at every pressure p (the regularisation pressure is a stress and scales too); every force found is
    /// then to be multiplied by `stiffness`.
    pub fn scaled(&self, strength: f64, stiffness: f64) -> Self {
        Self {
            lambda: self.lambda * strength * stiffness.powf(self.beta - 1.0),
            tau0_mpa: self.tau0_mpa * strength / stiffness,
            regular_pressure_mpa: self.regular_pressure_mpa / stiffness,
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

    /// Derivative of the traction over the trial slip, MPa/mm, shape (2, 2).
    fn slip_stiffness(&self, trial: [f64; 2], tau_crit: f64, stuck: bool) -> [[f64; 2]; 2] {
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

impl FrictionLaw for RubberFriction {
    fn strength(&self, pressure_mpa: f64) -> (f64, f64) {
        if !(pressure_mpa > 0.0) {
            return (0.0, 0.0);
        }
        let (power, power_slope) = self.regular_power(pressure_mpa, self.beta);
        let (constant, constant_slope) =
            if self.tau0_mpa > 0.0 { self.regular_power(pressure_mpa, 0.0) } else { (0.0, 0.0) };
        (self.lambda * power + self.tau0_mpa * constant, self.lambda * power_slope + self.tau0_mpa * constant_slope)
    }

    fn return_map(&self, trial_mm: [f64; 2], pressure_mpa: f64, force_stick: bool) -> Sliding {
        let (tau_crit, slope) = self.strength(pressure_mpa);
        let length = trial_mm[0].hypot(trial_mm[1]);
        let stuck = length <= self.gamma_crit_mm || force_stick;
        let elastic_slip = if stuck { trial_mm } else { trial_mm.map(|g| g * (self.gamma_crit_mm / length)) };
        Sliding {
            traction: elastic_slip.map(|g| g * (tau_crit / self.gamma_crit_mm)),
            elastic_slip,
            stuck,
            at_rest: elastic_slip[0].hypot(elastic_slip[1]) < self.gamma_crit_mm * (1.0 - AT_LIMIT),
            by_slip: self.slip_stiffness(trial_mm, tau_crit, stuck),
            by_pressure: elastic_slip.map(|g| g / self.gamma_crit_mm * slope),
            by_turn: [0.0; 2],
            by_axis: [0.0; 2],
        }
    }

    fn orthotropy(&self) -> Option<Orthotropy> {
        let Self { across_over_along, skin_axis_deg, .. } = *self;
        (across_over_along != 1.0).then_some(Orthotropy { across_over_along, skin_axis_deg })
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
    fn a_scaled_law_is_the_law_of_a_stiffer_tissue_at_every_pressure() {
        let laws = [
            RubberFriction { tau0_mpa: 5e-4, ..Default::default() },
            RubberFriction { beta: 1.3, regular_pressure_mpa: 2e-3, ..Default::default() },
            RubberFriction { beta: -0.3, tau0_mpa: 1e-3, ..Default::default() },
            RubberFriction::coulomb(0.8, 0.006),
        ];
        for law in laws {
            for (strength, stiffness) in [(1.0, 1.0), (1.3, 1.0), (0.8, 1.7), (1.1, 0.4)] {
                for pressure in [1e-6, 2e-5, 9e-5, 1.1e-4, 5e-4, 4e-3, 0.1] {
                    let (tau, slope) = law.scaled(strength, stiffness).strength(pressure);
                    let (wanted, wanted_slope) = law.strength(pressure * stiffness);
                    let wanted = wanted * strength / stiffness;
                    assert!((tau - wanted).abs() < 1e-13 * wanted, "{law:?} {strength} {stiffness} {pressure}");
                    let wanted_slope = wanted_slope * strength;
                    assert!((slope - wanted_slope).abs() < 1e-12 * wanted_slope.abs().max(1e-3), "{law:?} {pressure}");
                }
            }
        }
    }

    #[test]
    fn constants_that_are_no_friction_of_skin_are_refused_by_name_and_value() {
        RubberFriction::default().check().unwrap();
        RubberFriction::coulomb(5.0, 1e-4).check().unwrap();
        let base = RubberFriction::default();
        for (law, what) in [
            (RubberFriction { lambda: 50.0, ..base }, "lambda = 50:"),
            (RubberFriction { lambda: 1e9, ..base }, "lambda = 1000000000:"),
            (RubberFriction { beta: -5.0, ..base }, "beta = -5:"),
            (RubberFriction { beta: 2.0, ..base }, "beta = 2:"),
            (RubberFriction { beta: f64::NAN, ..base }, "beta = NaN:"),
            (RubberFriction { tau0_mpa: 3.0, ..base }, "tau0_mpa = 3:"),
            (RubberFriction { lambda: f64::INFINITY, ..base }, "lambda = inf:"),
            (RubberFriction { across_over_along: 0.0, ..base }, "across_over_along = 0:"),
            (RubberFriction { across_over_along: f64::NAN, ..base }, "across_over_along = NaN:"),
            (RubberFriction { skin_axis_deg: f64::NAN, ..base }, "skin_axis_deg = NaN:"),
        ] {
            let message = law.check().unwrap_err().to_string();
            assert!(message.starts_with(what), "{message}");
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
    fn return_map_follows_the_published_law_on_a_straight_path_and_its_derivatives_are_its_slopes() {
        let law = RubberFriction::default();
        let pressure = 0.004;
        let tau = law.strength(pressure).0;
        let at = law.return_map([0.003, 0.0], pressure, false);
        assert!(at.stuck && at.at_rest && (at.traction[0] - 0.5 * tau).abs() < 1e-15 && at.elastic_slip[0] == 0.003);
        let at = law.return_map([0.3, 0.4], pressure, false);
        assert!(!at.stuck && !at.at_rest && (at.traction[0] - 0.6 * tau).abs() < 1e-15);
        assert!((at.elastic_slip[1] - 0.0048).abs() < 1e-15);
        assert_eq!(law.return_map([0.3, 0.4], pressure, true).elastic_slip, [0.3, 0.4]);
        for (trial, turn) in
            [([0.002, -0.001], 0.0), ([0.02, 0.07], 0.0), ([0.002, -0.001], 0.3), ([0.006, 0.002], -0.3)]
        {
            let turned = |trial, pressure, turn| law.return_map(trial, pressure, false).turned(trial, turn);
            let exact = turned(trial, pressure, turn);
            let traction = |trial, pressure| turned(trial, pressure, turn).traction;
            for i in 0..2 {
                for k in 0..2 {
                    let (mut up, mut down) = (trial, trial);
                    up[k] += 1e-8;
                    down[k] -= 1e-8;
                    let numeric = (traction(up, pressure)[i] - traction(down, pressure)[i]) / 2e-8;
                    assert!((numeric - exact.by_slip[i][k]).abs() < 1e-6 * 0.01 / 0.006);
                }
                let numeric = (traction(trial, pressure + 1e-8)[i] - traction(trial, pressure - 1e-8)[i]) / 2e-8;
                assert!((numeric - exact.by_pressure[i]).abs() < 1e-6);
                let by_turn = |h: f64| turned(trial, pressure, turn + h).traction[i];
                assert!(((by_turn(1e-6) - by_turn(-1e-6)) / 2e-6 - exact.by_turn[i]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn friction_of_a_steady_spin_lags_by_the_law_s_own_angle_in_increments_of_any_length() {
        let law = RubberFriction::default();
        let pressure = 0.004;
        for (radius, turn) in [(1.0, 0.2), (1.0, -0.01), (0.05, 0.02), (0.2, -0.3)] {
            let mut elastic = [0.0; 2];
            // In the plane's frame the slip at a place turns back; its direction after the last increment is `angle`.
            let mut angle: f64 = 0.3;
            let mut lag = 0.0;
            for _ in 0..4000 {
                let chord = 2.0 * radius * f64::sin(0.5 * f64::abs(turn));
                let (sin, cos) = (angle - 0.5 * turn).sin_cos();
                let trial = [elastic[0] + chord * cos, elastic[1] + chord * sin];
                let at = law.return_map(trial, pressure, false).turned(trial, -turn);
                assert!((at.elastic_slip[0].hypot(at.elastic_slip[1]) - law.gamma_crit_mm).abs() < 1e-15 || at.stuck);
                (elastic, angle) = (at.elastic_slip, angle - turn);
                lag = (elastic[1].atan2(elastic[0]) - angle).rem_euclid(std::f64::consts::TAU);
            }
            let lag = if lag > std::f64::consts::PI { lag - std::f64::consts::TAU } else { lag };
            let own = (law.gamma_crit_mm / radius).asin().copysign(turn);
            assert!((lag - own).abs() < 0.02 * turn.abs(), "{radius} mm, {turn} rad: {lag}, the law's {own}");
        }
    }
}
