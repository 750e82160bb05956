//! Sizes of a tip that the paths of its design and the start of its fit follow from.
//!
//! Main type: [`Tip`]. Uses the finite elements' finger.

use fingerpad_fe::contact::{Outline, RubberFriction};
use fingerpad_fe::load_path::{BoneKind, Clearance, Drive, Finger, Path, Tissue};
use nalgebra::Vector3;

use crate::ReduceError;
use crate::pad::tilt;

/// Thickness of the soft layer at first touch, mm, from which on a tip is pressed as deep as the shipped finger.
const THICK_MM: f64 = 6.0;
/// Deepest press of a design over the thickness of the layer. A phalanx on its joint yields, a fixed core does not.
const FLOATING_SHARE: f64 = 0.85;
const FIXED_SHARE: f64 = 0.55;
/// Radius of the contact over the thickness of the layer up to which a layer on a fixed core is pressed to that share. A wider contact
/// cannot displace the material to its sides.
const WIDE: f64 = 2.2;
/// Depth of a press in another pose over the depth at which the plane reaches a support there.
const POSE_SHARE: f64 = 0.95;
/// Poses in which that depth is known, degrees: pitch and roll from the first to the last, in these steps.
const PITCHES_DEG: [f64; 3] = [10.0, 70.0, 5.0];
const ROLLS_DEG: [f64; 3] = [-30.0, 30.0, 10.0];
/// Angle for the curvature of the surface, degrees.
const CURVED_DEG: f64 = 4.0;
/// Pressure in the contact of the shipped finger, MPa.
const PRESSURE_MPA: f64 = 0.005;
/// Range of the slides of a tip over those of the shipped finger.
const SLIDES: [f64; 2] = [0.05, 4.0];
/// Least depth between the deepest of the shallow paths and the deepest of all, over the former.
const DEEPER: f64 = 0.1;

/// Sizes of a tip over those of the shipped finger, and the depths that it allows.
#[derive(Clone, Debug, PartialEq)]
pub struct Tip {
    /// Lengths: 1 from a layer of 6 mm on.
    pub length: f64,
    /// Stiffness of the soft tissue.
    pub pressure: f64,
    /// Friction over normal force, at the pressure of a press of that stiffness.
    pub friction: f64,
    /// Depth of the deepest press in the neutral pose, mm.
    pub deepest_mm: f64,
    /// Whether the core is fixed.
    pub is_fixed: bool,
    /// Largest depth in each of the poses, mm; empty for the shipped finger.
    reach_mm: Vec<Vec<f64>>,
}

/// The shipped finger.
impl Default for Tip {
    fn default() -> Self {
        Self {
            length: 1.0,
            pressure: 1.0,
            friction: 1.0,
            deepest_mm: f64::INFINITY,
            is_fixed: false,
            reach_mm: Vec::new(),
        }
    }
}

fn steps([first, last, step]: [f64; 3]) -> impl Iterator<Item = f64> {
    (0..=((last - first) / step).round() as usize).map(move |k| first + step * k as f64)
}

/// Strength over pressure.
fn coefficient(law: &RubberFriction, pressure_mpa: f64) -> f64 {
    law.lambda * pressure_mpa.powf(law.beta - 1.0) + law.tau0_mpa / pressure_mpa
}

impl Tip {
    /// The tip of a finger.
    ///
    /// # Errors
    /// [`ReduceError::Runs`] for a finger whose neutral pose is out of the range of a pad, and for one without a layer to press.
    pub fn of(finger: &Finger, tissue: &Tissue, law: &RubberFriction) -> Result<Self, ReduceError> {
        let neutral = finger.neutral_pitch_deg;
        let [least, most, _] = PITCHES_DEG;
        if !(least..=most).contains(&(1e-6 * (1e6 * neutral).round())) {
            return Err(ReduceError::Runs(format!(
                "the finger touches the plane at a pitch of {neutral:.1}°, but a pad has pitches from {least}° to {most}°: \
                 change its inclination (inclination_deg of a shape, axis of a mesh)"
            )));
        }
        let outline = outline(finger);
        let layer = Clearance::of(finger).depth_mm;
        if !(layer > 0.1) {
            return Err(ReduceError::Runs(format!(
                "a support lies {layer:.2} mm above first touch: there is no soft layer to press"
            )));
        }
        let length = (layer / THICK_MM).min(1.0);
        let pressure = tissue.stiffness();
        let is_fixed = tissue.bone.kind == BoneKind::Fixed;
        let share = if is_fixed { FIXED_SHARE * confined(finger, &outline, layer) } else { FLOATING_SHARE };
        let in_pose = if is_fixed { share } else { POSE_SHARE };
        let reach_in = |pitch: f64, roll: f64| {
            let normal = tilt((pitch - neutral).to_radians(), roll.to_radians()) * Vector3::z();
            let reach = finger.obstacles.iter().map(|x| x.dot(&normal)).fold(f64::INFINITY, f64::min);
            in_pose * (reach - outline.lowest(&normal).map_or(0.0, |lowest| lowest.dot(&normal)))
        };
        let reach_mm = steps(PITCHES_DEG).map(|pitch| steps(ROLLS_DEG).map(|roll| reach_in(pitch, roll)).collect());
        let human = RubberFriction::default();
        Ok(Self {
            length,
            pressure,
            friction: coefficient(law, PRESSURE_MPA * pressure) / coefficient(&human, PRESSURE_MPA),
            deepest_mm: share * layer,
            is_fixed,
            reach_mm: reach_mm.collect(),
        })
    }

    /// Largest depth in a pose, mm.
    fn clear_mm(&self, [pitch, roll]: [f64; 2]) -> f64 {
        let place = |x: f64, [first, last, step]: [f64; 3]| {
            let place = (x.clamp(first, last) - first) / step;
            let cell = place.floor().min((last - first) / step - 1.0);
            (cell as usize, place - cell)
        };
        let ((row, a), (column, b)) = (place(pitch, PITCHES_DEG), place(roll, ROLLS_DEG));
        let along = |row: usize| (1.0 - b) * self.reach_mm[row][column] + b * self.reach_mm[row][column + 1];
        (1.0 - a) * along(row) + a * along(row + 1)
    }

    /// Factor on forces.
    pub fn force(&self) -> f64 {
        self.pressure * self.length * self.length
    }

    /// Factor on slides.
    fn slide(&self) -> f64 {
        (self.length * self.friction).clamp(SLIDES[0], SLIDES[1])
    }

    /// A depth of this tip for one of the shipped finger, mm.
    ///
    /// * `[shallow, deep]`: largest depths of the shallow and of all paths of the shipped finger, mm
    fn depth_mm(&self, depth_mm: f64, [shallow, deep]: [f64; 2]) -> f64 {
        // A plane without contact stays where it is.
        if depth_mm <= 0.0 {
            return depth_mm;
        }
        let deepest = self.deepest_mm.min(self.length * deep);
        let knee = (self.length * shallow).min(deepest / (1.0 + DEEPER));
        if depth_mm <= shallow {
            knee / shallow * depth_mm
        } else {
            (knee + (depth_mm - shallow) * (deepest - knee) / (deep - shallow)).min(deepest)
        }
    }

    /// Makes a path of the shipped finger one of this tip: depths, slides, spins and forces are scaled, and depths in other poses stay clear
    /// of the supports. The time of each row is kept.
    pub(super) fn adapt(&self, path: &mut Path, depths_mm: [f64; 2]) {
        if self.reach_mm.is_empty() {
            return;
        }
        let by_depth = path.drives[0] == Drive::Displacement;
        let pose = [&path.turns.pitch, &path.turns.roll].map(|turn| turn.as_ref().map(|turn| &turn.values));
        for (k, point) in path.waypoints.iter_mut().enumerate() {
            let clear_mm = match pose {
                [Some(pitch), Some(roll)] => self.clear_mm([pitch[k], roll[k]]),
                _ => f64::INFINITY,
            };
            point.normal = thousandth(if by_depth {
                self.depth_mm(point.normal, depths_mm).min(clear_mm)
            } else {
                self.force() * point.normal
            });
            (point.x, point.y) = (thousandth(self.slide() * point.x), thousandth(self.slide() * point.y));
        }
        // The rim of the contact moves as far as in a slide, and its radius is a length.
        if let Some(spin) = &mut path.turns.spin {
            spin.values.iter_mut().for_each(|deg| *deg = (1e2 * self.slide() / self.length * *deg).round() / 1e2);
        }
    }
}

fn thousandth(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// The undeformed surface of a finger.
pub fn outline(finger: &Finger) -> Outline {
    finger.outline.clone().unwrap_or_else(|| {
        let pad = finger.mesh.pad_nodes().into_iter().map(|node| finger.mesh.nodes[node as usize]).collect();
        Outline::of_points(pad, &finger.mesh.nodes)
    })
}

/// Share of the depth of a layer that remains where the contact is wide: its radius follows from the curvature at first touch, up to that of
/// the whole pad.
fn confined(finger: &Finger, outline: &Outline, layer_mm: f64) -> f64 {
    let height = |[pitch, roll]: [f64; 2]| {
        let normal = tilt(pitch.to_radians(), roll.to_radians()) * Vector3::z();
        outline.lowest(&normal).map_or(0.0, |lowest| lowest.dot(&normal))
    };
    // The support function h of a circle of radius R has h + h'' = R.
    let radius = |turn: [f64; 2]| {
        let [here, ahead, back] = [0.0, 1.0, -1.0].map(|side| height(turn.map(|deg| side * deg)));
        let bend = (ahead + back - 2.0 * here) / CURVED_DEG.to_radians().powi(2);
        (-here - bend).clamp(0.1, 1e3)
    };
    let radius_mm = (radius([CURVED_DEG, 0.0]) * radius([0.0, CURVED_DEG])).sqrt();
    let wide = WIDE * layer_mm;
    let by_curvature = wide * wide / (2.0 * radius_mm) / (FIXED_SHARE * layer_mm);
    let xs = || finger.mesh.pad_nodes().into_iter().map(|node| finger.mesh.nodes[node as usize]);
    let extent = |of: fn(&Vector3<f64>) -> f64| {
        let (least, most) = xs().map(|x| of(&x)).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        0.5 * (most - least)
    };
    let half_width = (extent(|x| x.x) * extent(|x| x.y)).max(0.01).sqrt();
    let by_width = (wide / half_width).powi(2);
    by_curvature.max(by_width).min(1.0)
}
