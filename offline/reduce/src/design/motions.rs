//! Paths of the design without turns: depth or normal force, and slide.

use std::f64::consts::PI;

use fingerpad_fe::load_path::Path;

use super::DesignSettings;
use super::halton::HaltonPoint;
use super::path_builder::PathBuilder;

/// Number of amplitudes of a vibration.
pub(super) const AMPLITUDES: usize = 4;
/// Fixed amplitudes, mm; the last is a share of the depth.
const AMPLITUDES_MM: [f64; 3] = [0.001, 0.01, 0.1];
const AMPLITUDE_SHARE: f64 = 0.1;
/// Number of periods of a vibration. The first follows the slide; the later ones show the periodic response.
const PERIODS: usize = 3;
/// Slides before a vibration over that to full slip: nearly full stick, partial slip, full slip.
const HELD_SLIDES: [[f64; 2]; 3] = [[0.02, 0.08], [0.25, 0.65], [1.0, 1.15]];

/// A drawn depth, mm, whose square root is uniformly distributed.
pub(super) fn drawn_depth_mm(settings: &DesignSettings, point: &mut HaltonPoint) -> f64 {
    drawn_depth_to_mm(settings, f64::INFINITY, point)
}

/// The same, at most `most_mm`.
pub(super) fn drawn_depth_to_mm(settings: &DesignSettings, most_mm: f64, point: &mut HaltonPoint) -> f64 {
    let [least, most] = settings.drawn_depths_mm(most_mm);
    point.between(least.sqrt(), most.sqrt()).powi(2)
}

/// Press, lift part of the way, press deeper, lift off.
pub(super) fn press(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let mut path = PathBuilder::new();
    path.press(depth);
    path.press(depth * point.between(0.3, 0.8));
    path.press(drawn_depth_mm(settings, point).max(depth));
    path.lift();
    path.finish()
}

/// Press, slide straight to full slip.
pub(super) fn straight(settings: &DesignSettings, depth: f64, angle: f64) -> Path {
    let mut path = PathBuilder::new();
    path.press(depth);
    path.slide(angle, 1.15 * settings.slip_slide_mm(depth));
    path.finish()
}

/// The same at a drawn depth in a drawn direction.
pub(super) fn drawn_straight(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    straight(settings, depth, point.angle())
}

/// There and back three times, some nested.
pub(super) fn reversal(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::new();
    path.press(depth);
    let angle = point.angle();
    let mut length = full * point.between(0.4, 1.1);
    path.slide(angle, length);
    let shrink = point.between(0.55, 1.0);
    for turn in 1..4 {
        length *= if turn == 1 { point.between(0.4, 1.6) } else { shrink };
        path.slide(angle + f64::from(turn % 2) * PI, length);
    }
    path.finish()
}

/// Four sides with corners of one angle.
pub(super) fn turn(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::new();
    path.press(depth);
    let mut angle = point.angle();
    let corner = point.between(0.6, 2.6) * point.sign();
    for _ in 0..4 {
        path.slide(angle, full * point.between(0.25, 0.75));
        angle += corner;
    }
    path.finish()
}

/// Slide, change the depth at fixed slide and back, slide on, lift off.
pub(super) fn depth(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::new();
    path.press(depth);
    let angle = point.angle();
    path.slide(angle, full * point.between(0.1, 1.0));
    let other = drawn_depth_mm(settings, point);
    path.press(other);
    path.press(depth);
    path.slide(angle + point.between(-1.6, 1.6), full * point.between(0.1, 0.4));
    path.press(drawn_depth_mm(settings, point).min(other));
    path.lift();
    path.finish()
}

/// Depth and slide together, lift off.
pub(super) fn oblique(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::new();
    path.press(0.3 * depth);
    let angle = point.angle();
    for _ in 0..3 {
        let turn = angle + point.between(-1.0, 1.0);
        let length = full * point.between(0.15, 0.6);
        path.oblique(drawn_depth_mm(settings, point), turn, length);
    }
    path.lift();
    path.finish()
}

/// Six random corners in the plane; at every second one the depth changes as well.
pub(super) fn random(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let full = settings.slip_slide_mm(depth);
    let mut path = PathBuilder::new();
    path.press(depth);
    for corner in 0..6 {
        let (angle, length) = (point.angle(), full * point.between(0.1, 0.6));
        let to = if corner % 2 == 0 { path.here().normal } else { drawn_depth_mm(settings, point) };
        path.oblique(to, angle, length);
    }
    path.finish()
}

/// The depth vibrates at a constant slide, then the slide continues.
///
/// * `number`: selects amplitude and slide; paths of one point and four successive numbers have press and slide in common
pub(super) fn vibration(settings: &DesignSettings, number: usize, point: &mut HaltonPoint) -> Path {
    let depth = drawn_depth_mm(settings, point);
    let full = settings.slip_slide_mm(depth);
    let amplitude = AMPLITUDES_MM.get(number % AMPLITUDES).copied().unwrap_or(AMPLITUDE_SHARE * depth);
    let [least, most] = HELD_SLIDES[(number / AMPLITUDES) % HELD_SLIDES.len()];
    let angle = point.angle();
    let mut path = PathBuilder::new();
    path.press(depth);
    path.slide(angle, full * point.between(least, most));
    let held = path.here().normal;
    for _ in 0..PERIODS {
        path.press(held + amplitude);
        path.press(held - amplitude);
    }
    path.press(held);
    path.slide(angle, full * point.between(0.1, 0.3));
    path.finish()
}

/// A slide with one corner under constant normal force.
pub(super) fn force(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let [least, most] = settings.normal_force_n;
    let mut path = PathBuilder::by_force();
    path.press(point.between(least, most));
    // The depth is a result of the force; the slide is that for the middle of the range.
    let full = middle_slide_mm(settings);
    let angle = point.angle();
    path.slide(angle, full * point.between(0.5, 1.0));
    path.slide(angle + point.between(1.0, 3.1) * point.sign(), full * point.between(0.3, 0.8));
    path.finish()
}

/// Steps of the normal force at a constant slide, from stick to slip, then the slide continues.
pub(super) fn force_step(settings: &DesignSettings, point: &mut HaltonPoint) -> Path {
    let [least, most] = settings.normal_force_n;
    let mut path = PathBuilder::by_force();
    path.press(point.between(least, most));
    let full = middle_slide_mm(settings);
    let angle = point.angle();
    path.slide(angle, full * point.between(0.05, 0.8));
    for _ in 0..3 {
        path.press(point.between(least, most));
    }
    path.slide(angle, full * point.between(0.2, 0.5));
    path.press(point.between(least, most));
    path.finish()
}

fn middle_slide_mm(settings: &DesignSettings) -> f64 {
    settings.slip_slide_mm(0.5 * (settings.depth_mm[0] + settings.depth_mm[1]))
}
