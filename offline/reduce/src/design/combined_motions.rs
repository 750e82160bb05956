//! Paths of the design on which several coordinates change at once, as in movements of the hand.

use std::f64::consts::{PI, TAU};

use fingerpad_fe::load_path::Path;

use super::DesignSettings;
use super::deep_motions::{clear_depth_mm, slide_mm};
use super::halton::HaltonPoint;
use super::path_builder::{Corner, PathBuilder};

/// Least and largest depth, mm.
const DEPTHS_MM: [f64; 2] = [0.4, 3.5];
/// Range of the mean pitch and roll of such paths, degrees.
const POSES_DEG: [[f64; 2]; 2] = [[24.0, 52.0], [-16.0, 16.0]];
/// Largest deviation from the mean pitch and roll, degrees.
const LARGEST_TURN_DEG: f64 = 13.0;
/// Number of corners of a circle of the pose, and of a stroke.
const CORNERS: usize = 12;

/// The path of that number: eight motions in turn.
pub(super) fn combined(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let [least, most] = DEPTHS_MM;
    let pose = POSES_DEG.map(|[least, most]| point.between(least, most));
    let depth = point.between(least.sqrt(), most.sqrt()).powi(2);
    // The plane stays clear of the bone in every pose that the path may reach.
    let depth = [-1.0, 1.0].iter().fold(depth, |depth, side| {
        clear_depth_mm(depth, [pose[0] + side * LARGEST_TURN_DEG, pose[1].abs() + LARGEST_TURN_DEG])
    });
    let motion = Motion {
        pose,
        depth,
        angle: point.angle(),
        slide: slide_mm(settings, depth),
        spin_deg: point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.8),
    };
    let mut path = PathBuilder::in_pose(pose);
    path.press(depth);
    match number % 8 {
        0 => motion.roll(&mut path, point),
        1 => motion.knob(&mut path, point),
        2 => motion.regrasp(&mut path, point),
        3 => motion.wobble(&mut path, point),
        4 => motion.taps(&mut path, point),
        5 => motion.stroke(&mut path, point),
        6 => motion.vibration(&mut path, point),
        _ => motion.random(&mut path, point),
    }
    path.finish()
}

/// Quantities that the motions of a path share.
struct Motion {
    /// Pitch and roll, degrees.
    pose: [f64; 2],
    depth: f64,
    angle: f64,
    slide: f64,
    spin_deg: f64,
}

impl Motion {
    /// Rolls on the table under load, to one side and across to the other, with as much slide as a round pad needs to roll, or more.
    fn roll(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        let turn = LARGEST_TURN_DEG * point.between(0.5, 1.0) * point.sign();
        let toward = point.between(-0.6, 0.6);
        let arm_mm = point.between(-9.0, 9.0);
        for share in [1.0, -1.0, 0.0] {
            let from = path.here();
            let pose = [self.pose[0] + share * turn * toward.sin(), self.pose[1] + share * turn * toward.cos()];
            let way = arm_mm * (pose[1] - from.turns[2]).to_radians();
            path.pose(pose, 0.5 * PI, way);
        }
        path.lift();
    }

    /// Turns a knob under a load that changes, and lets it turn back.
    fn knob(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        for (share, depth) in [(1.0, point.between(0.7, 1.0)), (-1.4, 1.0), (0.6, point.between(0.4, 0.9))] {
            path.spin(share * self.spin_deg, 0.0, 0.0);
            let here = path.here();
            let turns = [here.turns[0] + 0.3 * share * self.spin_deg, here.turns[1], here.turns[2]];
            path.to(Corner { normal: depth * self.depth, turns, ..here });
        }
        path.lift();
    }

    /// Slides, releases, grips elsewhere in another pose, and slides again.
    fn regrasp(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        path.slide(self.angle, 0.6 * self.slide);
        path.oblique(0.15 * self.depth, self.angle + 1.0, 0.2 * self.slide);
        path.lift();
        path.pose(self.turned(point), point.angle(), 0.4 * self.slide);
        path.press(self.depth * point.between(0.6, 1.0));
        path.spin(0.5 * self.spin_deg, point.angle(), 0.6 * self.slide);
        path.lift();
    }

    /// Circles of pitch and roll, twice, with the spin of a wobbling grip in every second path.
    fn wobble(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        let radius = LARGEST_TURN_DEG * point.between(0.15, 0.7);
        let spins = if point.between(0.0, 1.0) < 0.5 { 0.0 } else { point.between(1.0, 4.0) };
        path.slide(self.angle, point.between(0.0, 0.5) * self.slide);
        path.spin(0.0, 0.0, 0.0);
        let first = path.here();
        for corner in 1..=2 * CORNERS {
            let phase = TAU * corner as f64 / CORNERS as f64;
            let turns = [
                first.turns[0] + spins * (2.0 * phase).sin(),
                self.pose[0] + radius * phase.sin(),
                self.pose[1] + radius * (1.0 - phase.cos()) * 0.5,
            ];
            path.to(Corner { turns, ..first });
        }
        path.slide(self.angle, 0.3 * self.slide);
    }

    /// Taps while it slides: the plane leaves the finger and returns three times.
    fn taps(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        let turn = point.between(-0.5, 0.5);
        for tap in 0..3 {
            let angle = self.angle + turn * f64::from(tap);
            path.oblique(-0.02, angle, 0.15 * self.slide);
            path.oblique(self.depth * point.between(0.5, 1.0), angle, 0.2 * self.slide);
        }
        path.slide(self.angle, 0.3 * self.slide);
        path.lift();
    }

    /// A stroke of least jerk out and back that lifts to a share of the depth where it turns back (Flash and Hogan 1985).
    fn stroke(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        let lowest = point.between(0.1, 0.6);
        let bow = point.between(-0.4, 0.4) * self.slide;
        let first = path.here();
        for corner in 1..=2 * CORNERS {
            let tau = corner as f64 / CORNERS as f64;
            let along = if tau <= 1.0 { least_jerk(tau) } else { least_jerk(2.0 - tau) };
            let lifted = (1.0 - (tau - 1.0).abs() / 0.5).max(0.0);
            let (way, aside) = (along * self.slide, bow * (PI * tau).sin());
            let slide = [
                first.slide[0] + way * self.angle.cos() - aside * self.angle.sin(),
                first.slide[1] + way * self.angle.sin() + aside * self.angle.cos(),
            ];
            path.to(Corner { slide, normal: self.depth * (1.0 - (1.0 - lowest) * lifted), ..first });
        }
        path.lift();
    }

    /// Spin and pose vibrate at a constant slide, then the slide continues.
    fn vibration(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        path.slide(self.angle, self.slide * point.between(0.2, 0.9));
        let [spin, pitch, roll] = [(0.3, 3.0), (0.0, 1.5), (0.0, 1.5)].map(|(a, b)| point.between(a, b));
        path.spin(0.0, 0.0, 0.0);
        let held = path.here();
        for quarter in 1..=12 {
            let sides = [f64::from(quarter % 2), f64::from((quarter + 1) / 2 % 2), f64::from(quarter % 3) - 1.0];
            let turns = [
                held.turns[0] + spin * (2.0 * sides[0] - 1.0),
                held.turns[1] + pitch * (2.0 * sides[1] - 1.0),
                held.turns[2] + roll * sides[2],
            ];
            path.to(Corner { turns, ..held });
        }
        path.to(held);
        path.slide(self.angle, 0.3 * self.slide);
    }

    /// Random corners in all six coordinates.
    fn random(&self, path: &mut PathBuilder, point: &mut HaltonPoint) {
        path.spin(0.0, 0.0, 0.0);
        for _ in 0..5 {
            let here = path.here();
            let [pitch, roll] = self.turned(point);
            let (angle, length) = (point.angle(), self.slide * point.between(0.1, 0.5));
            path.to(Corner {
                normal: self.depth * point.between(0.3, 1.0),
                slide: [here.slide[0] + length * angle.cos(), here.slide[1] + length * angle.sin()],
                turns: [self.spin_deg * point.between(-0.7, 0.7), pitch, roll],
            });
        }
        path.lift();
    }

    /// A pose near the mean pose of the path, from the sequence.
    fn turned(&self, point: &mut HaltonPoint) -> [f64; 2] {
        self.pose.map(|angle| angle + LARGEST_TURN_DEG * point.between(-1.0, 1.0))
    }
}

/// Finished share of a minimum-jerk motion after the share `tau` of its time.
fn least_jerk(tau: f64) -> f64 {
    tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau)
}
