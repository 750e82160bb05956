//! The memory of a contact with effects: the plain state, clocks and paths.

use super::{Conditions, Surroundings};
use crate::math::sqrt;
use crate::{Motion, StateOf};

/// Shorter motions are none, mm.
const LEAST_MM: f32 = 1e-6;

/// A contact with its effects: the plain state and the clocks that the laws read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<const M: usize> {
    /// The plain state. Its strength factor is the caller's; the laws' comes on top of it.
    pub state: StateOf<M>,
    contact_s: f32,
    dwell_s: f32,
    occlusion_s: f32,
    path_mm: f32,
    turn_mm: f32,
    /// Direction of the last motion.
    along: [f32; 2],
}

impl<const M: usize> Default for Contact<M> {
    fn default() -> Self {
        Self {
            state: StateOf::default(),
            contact_s: 0.0,
            dwell_s: 0.0,
            occlusion_s: 0.0,
            path_mm: 0.0,
            turn_mm: 0.0,
            along: [0.0; 2],
        }
    }
}

impl<const M: usize> Contact<M> {
    /// Counts times and paths up to the end of a motion, and tells what the laws may then read.
    pub(super) fn advance(&mut self, surroundings: &Surroundings, motion: &Motion) -> Conditions<f32> {
        let speed_mm_s = self.count(surroundings.speed_mm_s, motion);
        let [cos, sin] = self.along;
        Conditions {
            t_s: surroundings.series_s,
            depth_mm: motion.depth_mm,
            contact_time_s: self.contact_s,
            speed_mm_s,
            double_angle: [cos * cos - sin * sin, 2.0 * cos * sin],
            along: self.along,
            path_mm: self.path_mm,
            turn_mm: self.turn_mm,
            dwell_s: surroundings.dwell_s.unwrap_or(self.dwell_s),
            occlusion_s: surroundings.occlusion_s.unwrap_or(self.occlusion_s),
            hydration_au: surroundings.hydration_au,
            temperature_c: surroundings.temperature_c,
            width_mm: surroundings.finger_width_mm,
        }
    }

    /// Counts times and paths up to the end of a motion; returns the speed of the plane, mm/s, 0 where it does not slide.
    fn count(&mut self, nominal_mm_s: Option<f32>, motion: &Motion) -> f32 {
        let [x, y] = motion.slide_increment_mm;
        let moved = sqrt(x * x + y * y);
        let dt = if motion.dt_s > 0.0 && motion.dt_s < 1e3 { motion.dt_s } else { 0.0 };
        if !(motion.depth_mm > 0.0) {
            (self.contact_s, self.dwell_s, self.path_mm, self.turn_mm) = (0.0, 0.0, 0.0, 0.0);
            self.along = [0.0; 2];
            return 0.0;
        }
        self.contact_s += dt;
        self.occlusion_s += dt;
        if moved > LEAST_MM && moved < 1e3 {
            let along = [x / moved, y / moved];
            if along[0] * self.along[0] + along[1] * self.along[1] < 0.0 {
                self.turn_mm = 0.0;
            }
            self.along = along;
            self.path_mm += moved;
            self.turn_mm += moved;
            return nominal_mm_s.unwrap_or(if dt > 0.0 { moved / dt } else { 0.0 });
        }
        if self.path_mm <= 0.0 && motion.depth_mm <= self.state.depth_mm() {
            self.dwell_s += dt;
        }
        0.0
    }

    /// The finger has rested in the air: what builds up under occlusion starts anew.
    pub(super) fn rested(&mut self) {
        self.occlusion_s = 0.0;
    }
}
