//! Paths of the design with rotations: spin, pitch and roll.

use std::f64::consts::PI;

use fingerpad_fe::load_path::Path;

use super::DesignSettings;
use super::halton::HaltonPoint;
use super::motions::{drawn_depth_mm, drawn_depth_to_mm};
use super::path_builder::PathBuilder;

/// Press, spin, lift half of the way, lift off.
pub(super) fn spin(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let mut path = PathBuilder::new();
    path.press(depth);
    path.spin(point.sign() * settings.slip_spin_deg(depth) * point.between(0.4, 1.1), 0.0, 0.0);
    path.press(0.5 * depth);
    path.lift();
    path.finish()
}

/// Spin before, after or during a slide, by `number` in turn.
pub(super) fn spin_slide(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let angle = point.angle();
    let length = settings.slip_slide_mm(depth) * point.between(0.3, 1.0);
    let spin_deg = point.sign() * settings.slip_spin_deg(depth) * point.between(0.2, 0.8);
    let mut path = PathBuilder::new();
    path.press(depth);
    match number % 3 {
        0 => {
            path.spin(spin_deg, 0.0, 0.0);
            path.slide(angle, length);
        }
        1 => {
            path.slide(angle, length);
            path.spin(spin_deg, 0.0, 0.0);
        }
        _ => {
            path.spin(spin_deg, angle, length);
            path.spin(-spin_deg * point.between(0.2, 1.0), angle + point.between(-1.6, 1.6), 0.6 * length);
        }
    }
    path.finish()
}

/// Spin there and back three times, some nested.
pub(super) fn spin_reversal(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let mut path = PathBuilder::new();
    path.press(depth);
    let mut spin_deg = point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.8);
    path.spin(spin_deg, 0.0, 0.0);
    let shrink = point.between(0.5, 0.9);
    for turn in 1..4 {
        spin_deg *= -if turn == 1 { point.between(0.4, 1.6) } else { shrink };
        path.spin(spin_deg, 0.0, 0.0);
    }
    path.finish()
}

/// A slide with a corner at constant pitch and roll.
///
/// * `number`: paths of odd numbers have a spin in place of the corner
pub(super) fn pose(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::in_pose(drawn_pose_deg(settings.near_poses_deg(), point));
    path.press(depth);
    let angle = point.angle();
    path.slide(angle, full * point.between(0.5, 1.1));
    if number.is_multiple_of(2) {
        path.slide(angle + point.sign() * point.between(0.6, 3.1), full * point.between(0.3, 0.7));
    } else {
        path.spin(point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.7), 0.0, 0.0);
    }
    path.lift();
    path.finish()
}

/// At constant pitch and roll: a slide, then a slide back or a spin, another depth, and a slide in another direction.
///
/// * `number`: selects slide back or spin in turn
pub(super) fn wide_pose(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let pose = drawn_pose_deg(settings.wide_poses_deg(), point);
    let mut path = PathBuilder::in_pose(pose);
    let depth = clear_depth_mm(drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point), pose);
    let full = settings.slip_slide_mm(depth);
    path.press(depth);
    let angle = point.angle();
    path.slide(angle, full * point.between(0.5, 1.1));
    if number.is_multiple_of(2) {
        path.slide(angle + PI + point.between(-0.8, 0.8), full * point.between(0.4, 1.0));
    } else {
        path.spin(point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.7), 0.0, 0.0);
    }
    let other = clear_depth_mm(drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point), pose);
    path.press(other);
    path.slide(point.angle(), settings.slip_slide_mm(other) * point.between(0.3, 0.8));
    path.lift();
    path.finish()
}

/// Pitch and roll change in contact: at a fixed slide, then during a slide, then back.
pub(super) fn pose_change(settings: &DesignSettings, poses_deg: [[f64; 2]; 2], point: &mut HaltonPoint) -> Path {
    let drawn = drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point);
    let [first, second, third] = [(); 3].map(|()| drawn_pose_deg(poses_deg, point));
    let depth = [first, second, third].into_iter().fold(drawn, clear_depth_mm);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::in_pose(first);
    path.press(depth);
    path.pose(second, 0.0, 0.0);
    path.pose(third, point.angle(), full * point.between(0.3, 0.8));
    path.pose(first, 0.0, 0.0);
    path.lift();
    path.finish()
}

/// The depth, mm, limited so that the plane stays clear of the fixed section of the shipped finger. Flat and at the largest roll the plane
/// meets that section at 0.98 mm; with each degree of pitch this depth grows by 0.18 mm.
fn clear_depth_mm(depth_mm: f64, [pitch_deg, roll_deg]: [f64; 2]) -> f64 {
    depth_mm.min(0.9 + 0.16 * (pitch_deg - 10.0) + 0.03 * (30.0 - roll_deg.abs()))
}

/// Pitch and roll, degrees, within these ranges.
fn drawn_pose_deg(poses_deg: [[f64; 2]; 2], point: &mut HaltonPoint) -> [f64; 2] {
    poses_deg.map(|[least, most]| point.between(least, most))
}
