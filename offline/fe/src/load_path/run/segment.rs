//! The segment of a path to a row: its length in steps, the places on it, and the start of the search for one.

use nalgebra::Rotation3;

use super::Run;
use crate::assembly::{Body, Configuration, rotation_vector};
use crate::contact::{Coordinates, Friction, plane};
use crate::load_path::settings::LoadPathError;
use crate::load_path::steady_slip::{slide, slips_steadily};
use crate::load_path::{Drive, Path};
use crate::solve::{Axis, Guess, State, Target};

/// Distance from the foot at which turns count as travel, mm: about the radius of a contact.
const TURN_ARM_MM: f64 = 4.0;

/// Largest spin of an increment in steady slip, rad, as that of a spin before it.
const STEADY_SPIN_RAD: f64 = 0.15;

/// Increments of a hold of tissue that relaxes, in which the time since its start grows by a factor of e.
const HOLD_STEPS: f64 = 2.0;

/// A place on the segment to a row.
pub(super) struct Point {
    pub t_s: f64,
    /// Values of the plane's coordinates: mm, rad, N or N mm.
    pub at: Coordinates,
}

impl Run<'_, '_> {
    /// Values of the plane's coordinates at a row.
    pub(super) fn corner(&self, row: usize) -> Coordinates {
        self.path.coordinates(row, self.problem.neutral_pitch_deg)
    }

    /// Length of the segment to a row, in largest steps.
    pub(super) fn length_of(&self, row: usize) -> f64 {
        let (a, b) = (self.corner(row - 1), self.corner(row));
        let drives = self.path.coordinate_drives();
        let largest = &self.problem.load_steps;
        let depth_step = match self.friction_of(row) {
            Friction::On(_) => largest.max_depth_step_with_friction_mm,
            Friction::Off => largest.max_depth_step_mm,
        };
        let slide_step = largest.max_slide_step_mm;
        let steps = |k: usize| {
            let travel = if k == plane::DEPTH { depth_step } else { slide_step };
            let change = b[k] - a[k];
            match (drives[k], k < plane::SPIN) {
                (Drive::Displacement, true) => change / travel,
                (Drive::Displacement, false) => change * TURN_ARM_MM / travel,
                (Drive::Force, true) => change / largest.max_force_step_n,
                (Drive::Force, false) => change / (largest.max_force_step_n * TURN_ARM_MM),
            }
        };
        let along = steps(plane::X).hypot(steps(plane::Y)).hypot(steps(plane::SPIN));
        let moves = steps(plane::DEPTH).abs().max(along).max(steps(plane::PITCH).hypot(steps(plane::ROLL)));
        moves.max(self.growth_of_hold(row).map_or(1e-3, |growth| HOLD_STEPS * growth))
    }

    /// Logarithm of the ratio of the last to the first interval of a hold of tissue that relaxes; None for other segments.
    fn growth_of_hold(&self, row: usize) -> Option<f64> {
        let [least_s, _] = self.run.tissue.as_ref()?.times_s();
        let waypoints = &self.path.waypoints;
        let time_s = waypoints[row].t_s - waypoints[row - 1].t_s;
        (self.corner(row) == self.corner(row - 1)).then(|| (time_s / least_s).ln_1p())
    }

    /// Largest size of a step after one that led to `next`: in steady slip longer slides are allowed than before it.
    pub(super) fn largest_size_after(&self, next: &State) -> f64 {
        let steps = &self.problem.load_steps;
        match slide(self.path, self.run.row) {
            // On a curved body a slide moves the contact on.
            Some([.., spin])
                if self.problem.rigid_body.is_plane()
                    && self.law_at.is_none()
                    && self.run.tissue.is_none()
                    && slips_steadily(&self.run.state, next) =>
            {
                let by_slide = steps.max_steady_slide_step_mm / steps.max_slide_step_mm;
                by_slide.min(STEADY_SPIN_RAD * self.row_length / spin.abs()).max(1.0)
            }
            _ => 1.0,
        }
    }

    /// The point at `share` of the segment to the row being approached.
    pub(super) fn point(&self, share: f64) -> Point {
        let (row, waypoints) = (self.run.row, &self.path.waypoints);
        let (a, b) = (self.corner(row - 1), self.corner(row));
        if share >= 1.0 {
            return Point { t_s: waypoints[row].t_s, at: b };
        }
        let mix = |a: f64, b: f64| a + share * (b - a);
        let passed = match self.growth_of_hold(row) {
            Some(growth) => (share * growth).exp_m1() / growth.exp_m1(),
            None => share,
        };
        let t_s = waypoints[row - 1].t_s + passed * (waypoints[row].t_s - waypoints[row - 1].t_s);
        Point { t_s, at: std::array::from_fn(|k| mix(a[k], b[k])) }
    }

    pub(super) fn target(&self, point: &Point) -> Target {
        let drives = self.path.coordinate_drives();
        Target(std::array::from_fn(|k| match drives[k] {
            Drive::Displacement => Axis::Displacement(point.at[k]),
            Drive::Force => Axis::Force(point.at[k] / self.model.copies()),
        }))
    }

    /// Start of the search for a step of `size`: the last motion continued, if it was not much shorter.
    pub(super) fn guess(&self, size: f64) -> Guess {
        let run = &self.run;
        let mut guess = Guess::at(&run.state);
        if let Some((before, plane_before, last_size)) = &run.before
            && size <= 2.0 * last_size
        {
            let ratio = size / last_size;
            for (place, before) in guess.plane.at.iter_mut().zip(plane_before.at) {
                *place += (*place - before) * ratio;
            }
            guess.configuration = extrapolate(self.model.body, before, &run.state.configuration, ratio);
            guess.follows_plane = true;
        }
        guess
    }
}

/// Refuses a path without motion or with a time that does not grow.
pub(super) fn check(path: &Path) -> Result<(), LoadPathError> {
    if path.waypoints.len() < 2 {
        return Err(LoadPathError::Path(format!("{} rows; at least 2 are needed", path.waypoints.len())));
    }
    for (row, pair) in path.waypoints.windows(2).enumerate() {
        if !(pair[1].t_s > pair[0].t_s) {
            return Err(LoadPathError::Path(format!("time does not grow at row {}: {}", row + 1, pair[1].t_s)));
        }
    }
    Ok(())
}

/// `to` continued by `ratio` times the motion from `from`.
fn extrapolate(body: &Body, from: &Configuration, to: &Configuration, ratio: f64) -> Configuration {
    let mut next = to.clone();
    for (x, (a, b)) in next.x.iter_mut().zip(from.x.iter().zip(&to.x)) {
        *x += (b - a) * ratio;
    }
    next.rigid_centre += (to.rigid_centre - from.rigid_centre) * ratio;
    let turn = rotation_vector(&(to.rigid_rotation * from.rigid_rotation.inverse()));
    next.rigid_rotation = Rotation3::new(turn * ratio) * to.rigid_rotation;
    body.follow(&mut next);
    next
}
