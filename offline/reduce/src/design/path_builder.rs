//! A path of the design under construction, corner by corner.

use fingerpad_fe::load_path::{Drive, Path, Turn, Turns, Waypoint};

/// Speed of the plane, mm/s; sets the time column only.
const SPEED_MM_S: f64 = 2.0;
/// Distance from the axis of a rotation at which the plane moves with that speed, mm.
const TURN_ARM_MM: f64 = 5.0;
/// Change of a driven force in the time of a slide by 1 mm, N/mm; sets the time column only.
const STIFFNESS_N_MM: f64 = 0.5;
/// Depth at which the plane starts and ends without contact, mm.
const AIR_MM: f64 = -0.02;

/// A place of the plane: depth (mm) or normal force (N), slide (mm), and turns (degrees).
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Depth, mm, or normal force, N.
    pub(super) normal: f64,
    /// Slide, mm.
    pub(super) slide: [f64; 2],
    /// Spin, pitch, roll, degrees.
    pub(super) turns: [f64; 3],
}

/// A path under construction; it starts without contact.
pub(super) struct PathBuilder {
    normal_drive: Drive,
    times_s: Vec<f64>,
    corners: Vec<Corner>,
    /// Whether spin, and whether pitch and roll are part of the path.
    spins: bool,
    has_pose: bool,
}

impl PathBuilder {
    /// A path by depth in the neutral pose.
    pub(super) fn new() -> Self {
        let air = Corner { normal: AIR_MM, slide: [0.0; 2], turns: [0.0; 3] };
        Self {
            normal_drive: Drive::Displacement,
            times_s: vec![0.0],
            corners: vec![air],
            spins: false,
            has_pose: false,
        }
    }

    /// A path by normal force in the neutral pose.
    pub(super) fn by_force() -> Self {
        let mut path = Self::new();
        path.normal_drive = Drive::Force;
        path.corners[0].normal = 0.0;
        path
    }

    /// A path by depth that starts at this pitch and roll, degrees.
    pub(super) fn in_pose(pose: [f64; 2]) -> Self {
        let mut path = Self::new();
        path.has_pose = true;
        path.corners[0].turns = [0.0, hundredth(pose[0]), hundredth(pose[1])];
        path
    }

    /// Last corner of the path.
    pub(super) fn here(&self) -> Corner {
        self.corners[self.corners.len() - 1]
    }

    /// Adds a straight segment to `corner`.
    pub(super) fn to(&mut self, corner: Corner) {
        let from = self.here();
        // Rounding to micrometres, millinewtons and hundredths of a degree keeps the files readable.
        let to = Corner {
            normal: thousandth(corner.normal),
            slide: corner.slide.map(thousandth),
            turns: corner.turns.map(hundredth),
        };
        let depth = to.normal - from.normal;
        let normal = if self.normal_drive == Drive::Force { depth / STIFFNESS_N_MM } else { depth };
        let slide = (to.slide[0] - from.slide[0]).hypot(to.slide[1] - from.slide[1]);
        let turns = (0..3).map(|k| (to.turns[k] - from.turns[k]).powi(2)).sum::<f64>().sqrt();
        let length = normal.hypot(slide).hypot(TURN_ARM_MM * turns.to_radians());
        if length > 0.0 {
            let t_s = self.times_s[self.times_s.len() - 1] + length / SPEED_MM_S;
            self.times_s.push((t_s * 1e6).round() / 1e6);
            self.corners.push(to);
        }
    }

    /// Changes depth or normal force alone.
    pub(super) fn press(&mut self, normal: f64) {
        self.to(Corner { normal, ..self.here() });
    }

    /// Slides by `length`, mm, in the direction `angle`, rad.
    pub(super) fn slide(&mut self, angle: f64, length: f64) {
        self.oblique(self.here().normal, angle, length);
    }

    /// Slides while depth or normal force change to `normal`.
    pub(super) fn oblique(&mut self, normal: f64, angle: f64, length: f64) {
        let here = self.here();
        self.to(Corner { normal, slide: moved(here.slide, angle, length), ..here });
    }

    /// Spins by `spin_deg`, and slides at the same time.
    pub(super) fn spin(&mut self, spin_deg: f64, angle: f64, length: f64) {
        self.spins = true;
        let here = self.here();
        let turns = [here.turns[0] + spin_deg, here.turns[1], here.turns[2]];
        self.to(Corner { slide: moved(here.slide, angle, length), turns, ..here });
    }

    /// Goes to this pitch and roll, degrees, and slides at the same time.
    pub(super) fn pose(&mut self, pose: [f64; 2], angle: f64, length: f64) {
        let here = self.here();
        let turns = [here.turns[0], pose[0], pose[1]];
        self.to(Corner { slide: moved(here.slide, angle, length), turns, ..here });
    }

    /// Lifts the plane off the finger.
    pub(super) fn lift(&mut self) {
        self.press(AIR_MM);
    }

    /// The path.
    pub(super) fn finish(self) -> Path {
        let waypoint = |(t_s, corner): (&f64, &Corner)| Waypoint {
            t_s: *t_s,
            normal: corner.normal,
            x: corner.slide[0],
            y: corner.slide[1],
        };
        let turn = |k: usize, is_part: bool| {
            let values = || self.corners.iter().map(|corner| corner.turns[k]).collect();
            is_part.then(|| Turn { drive: Drive::Displacement, values: values() })
        };
        let turns = Turns { spin: turn(0, self.spins), pitch: turn(1, self.has_pose), roll: turn(2, self.has_pose) };
        Path {
            drives: [self.normal_drive, Drive::Displacement, Drive::Displacement],
            waypoints: self.times_s.iter().zip(&self.corners).map(waypoint).collect(),
            turns,
        }
    }
}

fn moved(slide: [f64; 2], angle: f64, length: f64) -> [f64; 2] {
    [slide[0] + length * angle.cos(), slide[1] + length * angle.sin()]
}

fn thousandth(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

fn hundredth(value: f64) -> f64 {
    (value * 1e2).round() / 1e2
}
