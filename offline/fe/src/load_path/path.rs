//! Paths of the plane: the driven coordinates and the corners.

use crate::Rounded;
use crate::contact::{Coordinates, plane};

/// Largest moment that may be driven, N mm: a fingertip's weight at many times its width.
const LARGEST_MOMENT_N_MM: f64 = 1000.0;
/// Largest force that may be driven, N. The hardest press of a fingertip is some 50 N, and long before it the pulp is
/// flat on the bone.
const LARGEST_FORCE_N: f64 = 100.0;
/// Longest slide that may be driven, mm.
const LONGEST_SLIDE_MM: f64 = 1000.0;

/// How one coordinate of the plane is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// The value of a waypoint is the plane's travel, mm, or its turn, degrees.
    Displacement,
    /// The value of a waypoint is the force that the plane exerts on the finger, N (normal force positive when it
    /// presses), or the moment, N mm.
    Force,
}

/// A corner of a path; straight lines between corners.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Waypoint {
    /// Time, s, strictly increasing along a path.
    pub t_s: f64,
    /// Depth (mm) or normal force (N), by the drive of axis 0.
    pub normal: f64,
    /// Slide (mm) or friction (N) along x, by the drive of axis 1.
    pub x: f64,
    /// Slide (mm) or friction (N) along y, by the drive of axis 2.
    pub y: f64,
}

/// Driving of one rotation along a path, a value a corner.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Turn {
    /// By angle or by moment.
    pub drive: Drive,
    /// Angles, degrees, or moments, N mm.
    pub values: Vec<f64>,
}

/// Rotations along a path; one that is absent keeps its value of the neutral pose.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Turns {
    /// Spin of the plane about its normal, counter-clockwise seen from +z; moment about z.
    pub spin: Option<Turn>,
    /// Angle between the finger's axis and the plane, tip down; moment about y.
    pub pitch: Option<Turn>,
    /// Turn of the finger about the neutral x axis, done before the pitch; moment about x.
    pub roll: Option<Turn>,
}

impl Turns {
    /// Whether nothing turns.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Spin, pitch and roll.
    fn each(&self) -> [Option<&Turn>; 3] {
        [self.spin.as_ref(), self.pitch.as_ref(), self.roll.as_ref()]
    }
}

/// A motion of the plane relative to the finger's fixed base.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Path {
    /// Drives of the normal, x and y axis.
    pub drives: [Drive; 3],
    /// At least two corners; the first is where the run starts (out of contact or at first touch).
    pub waypoints: Vec<Waypoint>,
    /// Turns, a value a corner.
    pub turns: Turns,
}

impl Path {
    /// A path without turns.
    pub fn new(drives: [Drive; 3], waypoints: Vec<Waypoint>) -> Self {
        Self { drives, waypoints, turns: Turns::default() }
    }

    /// Drives of the plane's coordinates.
    pub fn coordinate_drives(&self) -> [Drive; 6] {
        let of_turn = |turn: Option<&Turn>| turn.map_or(Drive::Displacement, |turn| turn.drive);
        let [spin, pitch, roll] = self.turns.each().map(of_turn);
        let [normal, x, y] = self.drives;
        [x, y, normal, spin, pitch, roll]
    }

    /// Values of the plane's coordinates at a corner: mm and rad from the neutral pose, N and N mm if driven by force.
    /// `neutral_pitch_deg` is the finger's angle to the plane in the neutral pose.
    pub fn coordinates(&self, row: usize, neutral_pitch_deg: f64) -> Coordinates {
        let Waypoint { normal, x, y, .. } = self.waypoints[row];
        let mut values = [x, y, normal, 0.0, 0.0, 0.0];
        let neutral = [0.0, neutral_pitch_deg, 0.0];
        for (k, turn) in self.turns.each().into_iter().enumerate() {
            let Some(turn) = turn else { continue };
            let value = turn.values[row];
            values[plane::SPIN + k] = match turn.drive {
                Drive::Displacement => (value - neutral[k]).to_radians(),
                Drive::Force => value,
            };
        }
        values
    }

    /// Why no fingertip can follow a row: its pose, or a force, a moment or a slide beyond all fingers. None if it can.
    pub fn refused(&self, row: usize) -> Option<String> {
        let bounds = [("spin", f64::NEG_INFINITY, f64::INFINITY), ("pitch", 10.0, 70.0), ("roll", -30.0, 30.0)];
        for (turn, (name, least, most)) in self.turns.each().into_iter().zip(bounds) {
            let Some(turn) = turn else { continue };
            let value = turn.values[row];
            match turn.drive {
                Drive::Displacement if !(least..=most).contains(&value) => {
                    let value = Rounded(value);
                    return Some(format!("{name}_deg {value}: must be from {least} to {most}"));
                }
                Drive::Force if !(value.abs() <= LARGEST_MOMENT_N_MM) => {
                    let value = Rounded(value);
                    return Some(format!("moment of the {name} {value} N mm: at most {LARGEST_MOMENT_N_MM} N mm"));
                }
                _ => {}
            }
        }
        let Waypoint { normal, x, y, .. } = self.waypoints[row];
        let forces = [("normal_force_n", normal), ("friction_x_n", x), ("friction_y_n", y)];
        for ((key, value), drive) in forces.into_iter().zip(self.drives) {
            if drive == Drive::Force && !(value.abs() <= LARGEST_FORCE_N) {
                let value = Rounded(value);
                return Some(format!(
                    "{key} {value} N: at most {LARGEST_FORCE_N} N, beyond which the pulp is pressed to the bone"
                ));
            }
        }
        for ((key, value), drive) in [("slide_x_mm", x), ("slide_y_mm", y)].into_iter().zip(&self.drives[1..]) {
            if *drive == Drive::Displacement && !(value.abs() <= LONGEST_SLIDE_MM) {
                let value = Rounded(value);
                return Some(format!(
                    "{key} {value} mm: at most {LONGEST_SLIDE_MM} mm; a slide is steady after some millimetres"
                ));
            }
        }
        None
    }

    /// Whether it leads a finger that is symmetric about y = 0 through symmetric states only: no motion and no driven
    /// force along y, no spin and no roll.
    pub fn is_symmetric(&self) -> bool {
        let y = self.waypoints[0].y;
        let straight = self.drives[2] == Drive::Displacement && self.waypoints.iter().all(|point| point.y == y);
        straight && self.turns.spin.is_none() && self.turns.roll.is_none()
    }
}
