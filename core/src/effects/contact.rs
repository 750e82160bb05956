//! The state of a contact with effects: the plain state, clocks and paths.

use super::{Conditions, Surroundings};
use crate::math::{add, sqrt};
use crate::memory::Memory;
use crate::{Motion, StateOf};

/// Shorter motions are none, mm.
const LEAST_MM: f32 = 1e-6;

/// A compensated sum: high and low part. A clock in one 32-bit float would not advance beyond 2048 s at 10 kHz.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Sum([f32; 2]);

impl Sum {
    fn add(&mut self, increment: f32) {
        let [sum, low] = self.0;
        let (sum, low) = add(sum, low, increment);
        self.0 = [sum, low];
    }

    fn value(self) -> f32 {
        self.0[0]
    }
}

/// A contact with its effects: the plain state, and the clocks and paths that the laws read, which are compensated sums.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound(serialize = "StateOf<M, P, f32, R>: serde::Serialize")))]
#[cfg_attr(feature = "serde", serde(bound(deserialize = "StateOf<M, P, f32, R>: serde::Deserialize<'de>")))]
pub struct Contact<const M: usize, const P: usize = 1, R = ()> {
    /// The plain state, with spin where `P` is 2. Its strength factor is the caller's; the laws' comes on top of it. `R` is the memory of the
    /// tissue, as in [`StateOf`].
    pub state: StateOf<M, P, f32, R>,
    contact_s: Sum,
    dwell_s: Sum,
    occlusion_s: Sum,
    path_mm: Sum,
    turn_mm: Sum,
    /// Direction of the last motion.
    along: [f32; 2],
}

impl<const M: usize, const P: usize, R: Default> Default for Contact<M, P, R> {
    fn default() -> Self {
        Self {
            state: StateOf::default(),
            contact_s: Sum::default(),
            dwell_s: Sum::default(),
            occlusion_s: Sum::default(),
            path_mm: Sum::default(),
            turn_mm: Sum::default(),
            along: [0.0; 2],
        }
    }
}

impl<const M: usize, const P: usize, R: Memory<M, P, f32>> Contact<M, P, R> {
    /// Advances times and paths to the end of a motion, and returns the conditions that the laws read.
    pub(super) fn advance(&mut self, surroundings: &Surroundings, motion: &Motion) -> Conditions<f32> {
        let speed_mm_s = self.count(surroundings.speed_mm_s, motion);
        self.conditions(surroundings, motion.depth_mm, speed_mm_s)
    }

    /// The present conditions, which laws read.
    pub(super) fn conditions(&self, surroundings: &Surroundings, depth_mm: f32, speed_mm_s: f32) -> Conditions<f32> {
        let [cos, sin] = self.along;
        Conditions {
            t_s: surroundings.series_s,
            depth_mm,
            contact_time_s: self.contact_s.value(),
            speed_mm_s,
            double_angle: [cos * cos - sin * sin, 2.0 * cos * sin],
            along: self.along,
            path_mm: self.path_mm.value(),
            turn_mm: self.turn_mm.value(),
            dwell_s: surroundings.dwell_s.unwrap_or(self.dwell_s.value()),
            occlusion_s: surroundings.occlusion_s.unwrap_or(self.occlusion_s.value()),
            hydration_au: surroundings.hydration_au,
            temperature_c: surroundings.temperature_c,
            width_mm: surroundings.finger_width_mm,
            own: surroundings.own,
        }
    }

    /// Advances times and paths to the end of a motion; returns the speed of the plane, mm/s, 0 without a slide.
    fn count(&mut self, nominal_mm_s: Option<f32>, motion: &Motion) -> f32 {
        let [x, y] = motion.slide_increment_mm;
        let moved = sqrt(x * x + y * y);
        let dt = if motion.dt_s > 0.0 && motion.dt_s < 1e3 { motion.dt_s } else { 0.0 };
        if !(motion.depth_mm > 0.0) {
            for sum in [&mut self.contact_s, &mut self.dwell_s, &mut self.path_mm, &mut self.turn_mm] {
                *sum = Sum::default();
            }
            self.along = [0.0; 2];
            return 0.0;
        }
        self.contact_s.add(dt);
        self.occlusion_s.add(dt);
        if moved > LEAST_MM && moved < 1e3 {
            let along = [x / moved, y / moved];
            if along[0] * self.along[0] + along[1] * self.along[1] < 0.0 {
                self.turn_mm = Sum::default();
            }
            self.along = along;
            self.path_mm.add(moved);
            self.turn_mm.add(moved);
            return nominal_mm_s.unwrap_or(if dt > 0.0 { moved / dt } else { 0.0 });
        }
        if self.path_mm.value() <= 0.0 && motion.depth_mm <= self.state.depth_mm() {
            self.dwell_s.add(dt);
        }
        0.0
    }

    /// Records a rest of the finger without contact: the time of occlusion restarts at zero.
    pub(super) fn record_rest(&mut self) {
        self.occlusion_s = Sum::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 10 kHz a clock in one 32-bit float stops at 2048 s, and a path in steps of 10 nm at 0.25 mm.
    #[test]
    fn clocks_and_paths_do_not_stall() {
        let mut contact = Contact::<1>::default();
        let still = Motion { depth_mm: 1.0, dt_s: 1e-4, ..Motion::default() };
        contact.contact_s = Sum([4096.0, 0.0]);
        contact.path_mm = Sum([1000.0, 0.0]);
        for _ in 0..100_000 {
            contact.advance(&Surroundings::default(), &still);
        }
        let slow = Motion { slide_increment_mm: [6e-6, 8e-6], ..still };
        let mut at = Conditions::default();
        for _ in 0..100_000 {
            at = contact.advance(&Surroundings::default(), &slow);
        }
        assert!((at.contact_time_s - 4116.0).abs() < 1e-3, "{}", at.contact_time_s);
        assert!((at.path_mm - 1001.0).abs() < 1e-3 && (at.turn_mm - 1.0).abs() < 1e-5, "{at:?}");
    }
}
