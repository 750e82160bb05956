//! The finger with a pad of the faces that may touch on given paths.

use nalgebra::{Matrix3, Vector3};

use super::{Config, ConfigError};
use crate::contact::{Coordinates, Plane, Reach, plane};
use crate::load_path::{Drive, Finger, Path, neutral_pitch_deg, outline};
use crate::mesh::FirstTouch;

/// Height up to which skin may touch, share of the deepest press, with a margin, mm: the rim of a contact lies at half
/// the depth, since the skin around it yields. A run in which other skin is reached ends with an error.
const PAD_SHARE: f64 = 0.8;
const PAD_MARGIN_MM: f64 = 0.2;
/// Turn between two poses whose pads are united, rad.
const POSE_STEP_RAD: f64 = 0.09;
/// Turn that a driven moment may give, rad.
const MOMENT_TURN_RAD: f64 = 0.17;

impl Config {
    /// As [`Self::finger`], with a pad of the faces that may touch on these paths: the fewer, the faster.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn finger_for(&self, paths: &[&Path]) -> Result<(Finger, FirstTouch), ConfigError> {
        self.finger_reaching(paths, 1.0)
    }

    /// As [`Self::finger_for`], with a pad that reaches `factor` times as high: for paths on which skin beside the pad
    /// reaches the plane.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn finger_reaching(&self, paths: &[&Path], factor: f64) -> Result<(Finger, FirstTouch), ConfigError> {
        self.friction.check().map_err(ConfigError::Friction)?;
        let (fingertip, _) = self.fingertip()?;
        let touch = fingertip.touch;
        // A driven force leaves the depth open: the height of the pad is then that of the geometry, which covers any
        // pose. A flat pad has none.
        let height_mm = deepest_mm(paths).map_or(fingertip.pad_height_mm().max(PAD_MARGIN_MM), pad_height_mm);
        let body = self.rigid_body.read()?;
        if body.is_plane() {
            let rotations = rotations(paths, neutral_pitch_deg(&touch));
            let fingertip = fingertip.with_pad_for(&rotations, factor * height_mm);
            return Ok((Finger::new(fingertip, &self.tissue)?, touch));
        }
        let outline = outline(&fingertip);
        let places = places(paths, neutral_pitch_deg(&touch));
        let frames = places.into_iter().map(|[start, at]| {
            let reach = Reach::new(outline.clone(), body.clone(), &Plane::new(start));
            Plane::new(at).frame(&reach)
        });
        let views: Vec<_> = frames
            .map(|frame| {
                let body = &body;
                move |x: &Vector3<f64>| {
                    let spot = body.spot(&frame.to_plane(x));
                    (spot.gap_mm, frame.to_finger(&spot.normal))
                }
            })
            .collect();
        let fingertip = fingertip.with_pad_near(&views, factor * height_mm);
        Ok((self.touching(Finger::new(fingertip, &self.tissue)?)?, touch))
    }
}

/// Slide between two places whose pads are united, mm.
const SLIDE_STEP_MM: f64 = 0.5;

/// Places of the rigid body along paths at first touch of their poses, each after the place where its path starts.
fn places(paths: &[&Path], neutral_pitch_deg: f64) -> Vec<[Coordinates; 2]> {
    let mut places = Vec::new();
    for path in paths {
        let drives = path.coordinate_drives();
        let at_touch = |row: usize| {
            let mut at = path.coordinates(row, neutral_pitch_deg);
            at[plane::DEPTH] = 0.0;
            std::array::from_fn(|k| if drives[k] == Drive::Displacement { at[k] } else { 0.0 })
        };
        let start = at_touch(0);
        places.push([start, start]);
        for row in 1..path.waypoints.len() {
            let (from, to): (Coordinates, Coordinates) = (at_touch(row - 1), at_touch(row));
            let way = |k: usize| to[k] - from[k];
            let slide = way(plane::X).hypot(way(plane::Y)) / SLIDE_STEP_MM;
            let turn = way(plane::PITCH).hypot(way(plane::ROLL)).max(way(plane::SPIN).abs()) / POSE_STEP_RAD;
            let steps = slide.max(turn).ceil().max(1.0) as usize;
            let between = |step: usize| std::array::from_fn(|k| from[k] + way(k) * step as f64 / steps as f64);
            places.extend((1..=steps).map(|step| [start, between(step)]));
        }
    }
    places.dedup();
    places
}

/// Height over first touch up to which skin may touch in a press this deep, mm.
pub fn pad_height_mm(deepest_mm: f64) -> f64 {
    PAD_SHARE * deepest_mm + PAD_MARGIN_MM
}

/// The deepest press of paths, mm; None if a driven force leaves the depth open.
fn deepest_mm(paths: &[&Path]) -> Option<f64> {
    let is_open = paths.iter().any(|path| path.drives[0] == Drive::Force);
    let depths = paths.iter().flat_map(|path| &path.waypoints).map(|point| point.normal);
    (!is_open).then(|| depths.fold(0.0, f64::max))
}

/// Rotations of the finger along paths.
fn rotations(paths: &[&Path], neutral_pitch_deg: f64) -> Vec<Matrix3<f64>> {
    let mut rotations = Vec::new();
    for path in paths {
        let drives = path.coordinate_drives();
        let mut turns: Vec<[f64; 2]> = Vec::new();
        for at in (0..path.waypoints.len()).map(|row| path.coordinates(row, neutral_pitch_deg)) {
            let [pitch, roll] = [plane::PITCH, plane::ROLL].map(|k| match drives[k] {
                Drive::Displacement => [at[k], at[k]],
                Drive::Force => [-MOMENT_TURN_RAD, MOMENT_TURN_RAD],
            });
            for turn in [[pitch[0], roll[0]], [pitch[1], roll[1]]] {
                let from = *turns.last().unwrap_or(&turn);
                let steps = ((turn[0] - from[0]).hypot(turn[1] - from[1]) / POSE_STEP_RAD).ceil().max(1.0);
                turns.extend((1..=steps as usize).map(|i| {
                    let share = i as f64 / steps;
                    [0, 1].map(|k| from[k] + share * (turn[k] - from[k]))
                }));
            }
        }
        turns.dedup();
        rotations.extend(
            turns
                .into_iter()
                .map(|[pitch, roll]| Plane::new([0.0, 0.0, 0.0, 0.0, pitch, roll]).tilt().inverse().into_inner()),
        );
    }
    rotations
}
