//! What the observer takes: the readings of a step and the facts about finger, surface and sensors.
//!
//! Main types: [`Reading`], [`Settings`]. Uses error and math.

use crate::error::Field;
use crate::math::{Scalar, sqrt};
use crate::{Error, Status};

/// Forces and motion as measured at the end of a step, each with its covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reading {
    /// Normal force of the surface on the finger, N.
    pub normal_force_n: f32,
    /// Friction of the surface on the finger along x and y, N.
    pub friction_n: [f32; 2],
    /// Measured slide of the surface against the finger's base since the last reading, mm.
    pub slide_increment_mm: [f32; 2],
    /// Variance of the normal force's noise, N².
    pub normal_variance_n2: f32,
    /// Covariance of friction's noise, N²: xx, yy, xy.
    pub friction_covariance_n2: [f32; 3],
    /// Covariance of the noise of the measured position (not of the increment), mm²: xx, yy, xy.
    pub slide_covariance_mm2: [f32; 3],
    /// Share of the contact area that sticks, from the shear field of a tactile skin. It counts where friction is larger than before.
    pub stick_ratio: f32,
    /// Variance of its noise; 0 where it is not measured.
    pub stick_variance: f32,
    /// Measured turn of the surface against the finger's base about the normal since the last reading, rad. A pad follows it; a bed, whose
    /// twins have no spin, leaves this and the moment out.
    pub spin_increment_rad: f32,
    /// Moment about the normal, N mm, as [`crate::Response::spin_moment_n_mm`].
    pub spin_moment_n_mm: f32,
    /// Variance of its noise, N² mm²; 0 where it is not measured.
    pub spin_variance_n2_mm2: f32,
    /// Time since the last reading, s.
    pub dt_s: f32,
}

/// The larger variance of a covariance; `None` unless it is finite and positive definite.
fn largest_variance([xx, yy, xy]: [f32; 3]) -> Option<f32> {
    let half = 0.5 * (xx - yy);
    let largest = 0.5 * (xx + yy) + sqrt((half * half + xy * xy).magnitude());
    (xx > 0.0 && yy > 0.0 && xx * yy > xy * xy && largest <= VARIANCE_MAX).then_some(largest)
}

/// Largest variance, of any unit, and largest force, N, increment, mm, turn, rad, and stick ratio, that count as a reading. A moment may be
/// as large as the number of a force.
const VARIANCE_MAX: f32 = 1e6;
const FORCE_MAX: f32 = 1e4;
const INCREMENT_MAX: f32 = 64.0;
const TURN_MAX: f32 = 3.2;
const STICK_MAX: f32 = 10.0;
/// Longest time between two readings, s.
const DT_MAX: f32 = 1.0;

/// Variances of a sound reading: normal force, friction, position, stick ratio (0 where it is not measured).
pub(super) struct Variances {
    pub(super) normal: f32,
    pub(super) friction: f32,
    pub(super) slide: f32,
    pub(super) stick: f32,
}

impl Reading {
    /// The variances of the reading, or what is wrong with it.
    ///
    /// * `turns`: whether turn and moment are used
    #[inline]
    pub(super) fn check(&self, turns: bool) -> Result<Variances, Status> {
        let [x, y] = self.friction_n;
        let [by_x, by_y] = self.slide_increment_mm;
        let within = |value: f32, most: f32| value.magnitude() <= most;
        let numbers = within(self.normal_force_n, FORCE_MAX)
            && within(x, FORCE_MAX)
            && within(y, FORCE_MAX)
            && within(by_x, INCREMENT_MAX)
            && within(by_y, INCREMENT_MAX)
            && (self.stick_variance == 0.0 || within(self.stick_ratio, STICK_MAX))
            && (0.0..=VARIANCE_MAX).contains(&self.stick_variance)
            && (!turns
                || within(self.spin_increment_rad, TURN_MAX)
                    && (self.spin_variance_n2_mm2 == 0.0 || within(self.spin_moment_n_mm, FORCE_MAX))
                    && (0.0..=VARIANCE_MAX).contains(&self.spin_variance_n2_mm2));
        let mut status = if numbers { Status::OK } else { Status::BAD_INPUT };
        if !(self.dt_s > 1e-7 && self.dt_s <= DT_MAX) {
            status = status.with(Status::BAD_TIME_STEP);
        }
        let normal = self.normal_variance_n2;
        let sound = normal > 0.0 && normal <= VARIANCE_MAX;
        match (largest_variance(self.friction_covariance_n2), largest_variance(self.slide_covariance_mm2)) {
            (Some(friction), Some(slide)) if sound && status == Status::OK => {
                Ok(Variances { normal, friction, slide, stick: self.stick_variance })
            }
            (Some(_), Some(_)) if sound => Err(status),
            _ => Err(status.with(Status::BAD_INPUT)),
        }
    }
}

/// Prior of surface and finger, errors of model and sensors, and what is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Standard deviation of the logarithm of the strength factor among the surfaces to expect, 0.05 to 1; its median is 1.
    pub strength: f32,
    /// Standard deviation of the finger's tangential stiffness, share, 0.01 to 0.3.
    pub stiffness: f32,
    /// Standard deviation of the model's friction, share of the limit, 0.001 to 0.5.
    pub model_error: f32,
    /// Mean of that error where friction is 0, 1/4, 1/2, 3/4 of the limit and all of it, share of the model's friction, −0.2 to 0.2.
    pub curve: [f32; 5],
    /// Slide over which that error is correlated, over the slip length (limit over stiffness), 0.01 to 10.
    pub correlation: f32,
    /// Standard deviation of the model's stick ratio at a share of the limit, 0.005 to 1, for readings with a stick ratio.
    pub stick_error: f32,
    /// Standard deviation of the error that the model's friction gains while the normal force changes by a factor of e, share of
    /// friction, 0 to 1.
    pub press_error: f32,
    /// Time constant of the force sensor, s, 0 to 1. The measured slide is delayed by the same.
    pub force_lag_s: f32,
    /// Play of the measured slide, mm, 0 to 10: its error after a turn back.
    pub play_mm: f32,
    /// Drift of the measured slide, share of the slide, 0 to 0.5.
    pub drift: f32,
    /// Standard deviation of the zero of friction at first touch, N, 0 to 10. In the air it is measured.
    pub tare_n: f32,
    /// Its drift: standard deviation after a second, N, 0 to 10. It grows with the root of time.
    pub tare_drift_n: f32,
    /// Probability of the band of strength and margin, 0.5 to 0.999. The lower bound of the margin is exceeded with half of the rest.
    pub confidence: f32,
    /// Time ahead for which the chance of full slip is given, s, 0 to 10.
    pub ahead_s: f32,
}

impl Default for Settings {
    /// Surfaces within a factor of 2, stiffness within 15 %, the errors of the shipped model, sensors without lag, play and drift, a band
    /// of 95 %, 50 ms ahead.
    fn default() -> Self {
        Self {
            strength: 0.7,
            stiffness: 0.15,
            model_error: 0.018,
            curve: [-0.02, 0.013, 0.018, 0.015, 0.02],
            correlation: 0.25,
            stick_error: 0.06,
            press_error: 0.1,
            force_lag_s: 0.0,
            play_mm: 0.0,
            drift: 0.0,
            tare_n: 2e-3,
            tare_drift_n: 0.0,
            confidence: 0.95,
            ahead_s: 0.05,
        }
    }
}

impl Settings {
    /// The default for a pad: the errors of the shipped one in other poses than the neutral one, against finite elements of its fit.
    #[must_use]
    pub fn for_pad() -> Self {
        Self { model_error: 0.035, curve: [-0.09, -0.06, -0.025, 0.02, 0.0], ..Self::default() }
    }
}

/// A value of five, from 0 to all of the limit, at a share of it.
pub(super) fn along(five: &[f32; 5], used: f32) -> f32 {
    let place = 4.0 * used.not_negative().at_most(1.0);
    let cell = (place as u32).min(3) as usize;
    let [a, b] = [five[cell], five[cell + 1]];
    a + (b - a) * (place - cell as f32)
}

impl Settings {
    /// Factor that corrects the model's friction at a share of its limit.
    pub(super) fn curve_at(&self, used: f32) -> f32 {
        1.0 + along(&self.curve, used)
    }

    /// # Errors
    /// [`Error::Range`] with the first value out of its range.
    pub(super) fn check(&self) -> Result<(), Error> {
        let ranges = [(self.strength, 0.05, 1.0), (self.stiffness, 0.01, 0.3), (self.model_error, 1e-3, 0.5)]
            .into_iter()
            .chain(self.curve.map(|error| (error, -0.2, 0.2)))
            .chain([
                (self.correlation, 0.01, 10.0),
                (self.stick_error, 5e-3, 1.0),
                (self.press_error, 0.0, 1.0),
                (self.force_lag_s, 0.0, 1.0),
                (self.play_mm, 0.0, 10.0),
                (self.drift, 0.0, 0.5),
                (self.tare_n, 0.0, 10.0),
                (self.tare_drift_n, 0.0, 10.0),
                (self.confidence, 0.5, 0.999),
                (self.ahead_s, 0.0, 10.0),
            ]);
        for (index, (value, least, most)) in (0u16..).zip(ranges) {
            if !(value >= least && value <= most) {
                return Err(Error::Range { what: Field::Observer, index, value });
            }
        }
        Ok(())
    }
}
