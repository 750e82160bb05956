//! Paths of the design at large forces, as in a grip: depths beyond those of the other kinds.

use std::f64::consts::PI;

use fingerpad_fe::load_path::Path;

use super::DesignSettings;
use super::halton::HaltonPoint;
use super::path_builder::PathBuilder;

/// Longest slide, mm. Deep contacts do not slip as a whole within it.
const LONGEST_SLIDE_MM: f64 = 6.0;
/// Poses of deep paths, degrees. In flatter or steeper poses the plane meets the fixed section of the finger at a smaller depth.
const POSES_DEG: [[f64; 2]; 2] = [[22.0, 58.0], [-20.0, 20.0]];
/// Depth at which the plane meets the fixed section or the bone of the shipped finger, mm, for pitches of 10 to 70 degrees in steps of 10,
/// without roll.
const REACH_MM: [f64; 7] = [1.6, 3.7, 6.5, 7.4, 6.3, 5.2, 4.1];
/// Largest depth of a path over that depth, and the reduction of this share by a roll of 30 degrees.
const USED: f64 = 0.85;
const LOST_BY_ROLL: f64 = 0.4;

/// The path of that number: eight motions in turn.
pub(super) fn deep(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let [least, most] = settings.deep_mm;
    let depth = point.between(least, most);
    let other = point.between(least, most);
    let angle = point.angle();
    let slide = slide_mm(settings, depth);
    let spin_deg = point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.7);
    let mut path = PathBuilder::new();
    match number % 8 {
        0 => {
            path.press(depth);
            path.press(depth * point.between(0.4, 0.8));
            path.press(depth.max(other));
            path.lift();
        }
        1 => {
            path.press(depth);
            path.slide(angle, slide);
        }
        2 => {
            path.press(depth);
            path.slide(angle, 0.7 * slide);
            path.slide(angle + PI, slide);
            path.slide(angle, 0.6 * slide);
        }
        3 => {
            path.press(depth);
            path.spin(spin_deg, 0.0, 0.0);
            path.slide(angle, 0.6 * slide);
            path.spin(-spin_deg, angle + 1.5, 0.3 * slide);
        }
        4 => {
            path.press(depth);
            path.slide(angle, 0.5 * slide);
            path.press(0.5 * depth);
            path.oblique(other, angle + point.between(-1.5, 1.5), 0.6 * slide);
            path.lift();
        }
        5 => {
            let pose = drawn_pose_deg(point);
            let depth = clear_depth_mm(depth, pose);
            path = PathBuilder::in_pose(pose);
            path.press(depth);
            path.slide(angle, 0.7 * slide);
            path.press(0.7 * depth);
            path.slide(angle + point.between(1.6, 4.7), 0.5 * slide);
            path.lift();
        }
        6 => {
            let poses = [(); 2].map(|()| drawn_pose_deg(point));
            let depth = poses.into_iter().fold(depth, clear_depth_mm);
            path = PathBuilder::in_pose(poses[0]);
            path.press(depth);
            path.pose(poses[1], 0.0, 0.0);
            path.pose(poses[0], angle, 0.5 * slide);
            path.lift();
        }
        _ => {
            let force = |depth: f64| 0.25 * depth.powf(2.05);
            path = PathBuilder::by_force();
            path.press(force(depth));
            path.slide(angle, 0.6 * slide);
            path.oblique(force(other), angle + point.between(1.0, 3.1) * point.sign(), 0.4 * slide);
        }
    }
    path.finish()
}

/// A slide after which a contact of that depth is in full slip, mm, limited to the longest slide.
pub(super) fn slide_mm(settings: &DesignSettings, depth_mm: f64) -> f64 {
    settings.slip_slide_mm(depth_mm).min(LONGEST_SLIDE_MM)
}

/// The depth, mm, limited so that the plane stays clear of the fixed section and the bone of the shipped finger.
pub(super) fn clear_depth_mm(depth_mm: f64, [pitch_deg, roll_deg]: [f64; 2]) -> f64 {
    let place = ((pitch_deg - 10.0) / 10.0).clamp(0.0, 5.999);
    let (below, share) = (place as usize, place.fract());
    let reach = REACH_MM[below] + share * (REACH_MM[below + 1] - REACH_MM[below]);
    depth_mm.min(USED * reach * (1.0 - LOST_BY_ROLL * roll_deg.abs() / 30.0))
}

fn drawn_pose_deg(point: &mut HaltonPoint) -> [f64; 2] {
    POSES_DEG.map(|[least, most]| point.between(least, most))
}
