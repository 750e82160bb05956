//! Paths of the design on which the plane turns: spin, pitch and roll.

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

/// A slide with a corner in a pitch and roll that stay; in every second, by `number`, a spin takes the corner's place.
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

/// In a pitch and roll that stay: a slide, then, by `number` in turn, a slide back or a spin, another depth, a slide elsewhere.
pub(super) fn wide_pose(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let mut path = PathBuilder::in_pose(drawn_pose_deg(settings.wide_poses_deg(), point));
    let depth = drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point);
    let full = settings.slip_slide_mm(depth);
    path.press(depth);
    let angle = point.angle();
    path.slide(angle, full * point.between(0.5, 1.1));
    if number.is_multiple_of(2) {
        path.slide(angle + PI + point.between(-0.8, 0.8), full * point.between(0.4, 1.0));
    } else {
        path.spin(point.sign() * settings.slip_spin_deg(depth) * point.between(0.3, 0.7), 0.0, 0.0);
    }
    let other = drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point);
    path.press(other);
    path.slide(point.angle(), settings.slip_slide_mm(other) * point.between(0.3, 0.8));
    path.lift();
    path.finish()
}

/// Pitch and roll change in contact: at a fixed slide, then during a slide, then back.
pub(super) fn pose_change(settings: &DesignSettings, poses_deg: [[f64; 2]; 2], point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_to_mm(settings, settings.pose_depth_max_mm, point);
    let full = settings.slip_slide_mm(depth);
    let first = drawn_pose_deg(poses_deg, point);
    let mut path = PathBuilder::in_pose(first);
    path.press(depth);
    path.pose(drawn_pose_deg(poses_deg, point), 0.0, 0.0);
    path.pose(drawn_pose_deg(poses_deg, point), point.angle(), full * point.between(0.3, 0.8));
    path.pose(first, 0.0, 0.0);
    path.lift();
    path.finish()
}

/// Pitch and roll, degrees, within these ranges.
fn drawn_pose_deg(poses_deg: [[f64; 2]; 2], point: &mut HaltonPoint) -> [f64; 2] {
    poses_deg.map(|[least, most]| point.between(least, most))
}
