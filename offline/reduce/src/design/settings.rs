//! Settings of the design of experiments: section `[design]` of a configuration file.

use serde::{Deserialize, Serialize};

use super::{Kind, Tip};
use crate::ReduceError;

/// Depth range over the margin of drawn depths from its ends.
const MARGIN_PARTS: f64 = 44.0;
/// Least depth, mm: 1.5 times the largest fixed amplitude of a vibration of the depth, so that a vibration does not end the contact.
const LEAST_DEPTH_MM: f64 = 0.15;
/// Poses that a path may have, degrees: pitch, roll.
const POSES_DEG: [[f64; 2]; 2] = [[10.0, 70.0], [-30.0, 30.0]];
/// Largest number of paths of a kind in one half of the design.
const MOST_PATHS: usize = 1000;
/// Largest seed; sequences of different seeds do not overlap.
const LARGEST_SEED: u64 = u32::MAX as u64;

/// Section `[design]`: size of the design, by default that for the shipped finger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DesignSettings {
    /// Selects the part of Halton's sequence for the drawn parameters. Another seed gives another design of the same size.
    pub seed: u64,
    /// Least and largest depth, mm.
    pub depth_mm: [f64; 2],
    /// Slide after which a contact 1 mm deep is in full slip, mm: an upper estimate, to which all slides are proportional.
    pub slide_mm: f64,
    /// Spin after which a contact 1 mm deep is in full slip, degrees: an upper estimate, to which all spins are proportional.
    pub spin_deg: f64,
    /// Least and largest pitch (angle between the finger's axis and the plane) of near poses, degrees.
    pub pitch_deg: [f64; 2],
    /// Least and largest roll of near poses, degrees.
    pub roll_deg: [f64; 2],
    /// Least and largest pitch of wide poses, degrees.
    pub wide_pitch_deg: [f64; 2],
    /// Least and largest roll of wide poses, degrees.
    pub wide_roll_deg: [f64; 2],
    /// Largest depth of paths in a pose, mm; there the fixed section of the finger is closer to the plane.
    pub pose_depth_max_mm: f64,
    /// Least and largest normal force of paths driven by it, N.
    pub normal_force_n: [f64; 2],
    /// Least and largest depth of deep paths, mm.
    pub deep_mm: [f64; 2],
    /// Depths at which there is a straight slide along +x, +y, -x and -y each, for calibration, mm.
    pub axis_depths_mm: Vec<f64>,
    /// Number of drawn paths of each kind.
    pub paths: PathNumbers,
    /// The tip whose sizes the paths follow; see [`Self::for_tip`].
    #[serde(skip)]
    pub tip: Tip,
}

/// Section `[design.paths]`: how many drawn paths of each kind are for calibration, and how many are held out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PathNumbers {
    /// [`Kind::Press`].
    pub press: [usize; 2],
    /// [`Kind::Straight`], those along the axes not counted.
    pub straight: [usize; 2],
    /// [`Kind::Reversal`].
    pub reversal: [usize; 2],
    /// [`Kind::Turn`].
    pub turn: [usize; 2],
    /// [`Kind::Depth`].
    pub depth: [usize; 2],
    /// [`Kind::Oblique`].
    pub oblique: [usize; 2],
    /// [`Kind::Random`].
    pub random: [usize; 2],
    /// [`Kind::Vibration`]: four paths each differ only in the amplitude.
    pub vibration: [usize; 2],
    /// [`Kind::Spin`].
    pub spin: [usize; 2],
    /// [`Kind::SpinSlide`].
    pub spin_slide: [usize; 2],
    /// [`Kind::SpinReversal`].
    pub spin_reversal: [usize; 2],
    /// [`Kind::Pose`].
    pub pose: [usize; 2],
    /// [`Kind::PoseChange`].
    pub pose_change: [usize; 2],
    /// [`Kind::Force`].
    pub force: [usize; 2],
    /// [`Kind::ForceStep`].
    pub force_step: [usize; 2],
    /// [`Kind::WidePose`].
    pub wide_pose: [usize; 2],
    /// [`Kind::WidePoseChange`].
    pub wide_pose_change: [usize; 2],
    /// [`Kind::Deep`].
    pub deep: [usize; 2],
    /// [`Kind::Combined`].
    pub combined: [usize; 2],
    /// [`Kind::Body`].
    pub body: [usize; 2],
}

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            depth_mm: [0.3, 2.5],
            slide_mm: 3.2,
            spin_deg: 40.0,
            pitch_deg: [20.0, 50.0],
            roll_deg: [-15.0, 15.0],
            wide_pitch_deg: [10.0, 70.0],
            wide_roll_deg: [-30.0, 30.0],
            pose_depth_max_mm: 1.5,
            normal_force_n: [0.1, 1.2],
            deep_mm: [2.6, 5.2],
            axis_depths_mm: vec![0.3, 0.6, 1.0, 1.5, 2.0, 2.5],
            paths: PathNumbers::default(),
            tip: Tip::default(),
        }
    }
}

impl Default for PathNumbers {
    fn default() -> Self {
        Self {
            press: [3, 3],
            straight: [8, 12],
            reversal: [12, 12],
            turn: [10, 12],
            depth: [12, 12],
            oblique: [8, 10],
            random: [10, 12],
            vibration: [24, 24],
            spin: [4, 4],
            spin_slide: [9, 9],
            spin_reversal: [4, 4],
            pose: [9, 6],
            pose_change: [6, 6],
            force: [6, 6],
            force_step: [4, 4],
            wide_pose: [48, 30],
            wide_pose_change: [24, 16],
            deep: [0, 0],
            combined: [0, 0],
            body: [0, 0],
        }
    }
}

impl PathNumbers {
    /// Numbers of drawn paths of a kind, for calibration and held out.
    pub fn of(&self, kind: Kind) -> [usize; 2] {
        match kind {
            Kind::Press => self.press,
            Kind::Straight => self.straight,
            Kind::Reversal => self.reversal,
            Kind::Turn => self.turn,
            Kind::Depth => self.depth,
            Kind::Oblique => self.oblique,
            Kind::Random => self.random,
            Kind::Vibration => self.vibration,
            Kind::Spin => self.spin,
            Kind::SpinSlide => self.spin_slide,
            Kind::SpinReversal => self.spin_reversal,
            Kind::Pose => self.pose,
            Kind::PoseChange => self.pose_change,
            Kind::Force => self.force,
            Kind::ForceStep => self.force_step,
            Kind::WidePose => self.wide_pose,
            Kind::WidePoseChange => self.wide_pose_change,
            Kind::Deep => self.deep,
            Kind::Combined => self.combined,
            Kind::Body => self.body,
        }
    }
}

impl DesignSettings {
    /// The same for a tip: depths, slides, spins and forces, which are those of the shipped finger by default, are scaled to it. Lengths or
    /// forces that a file states are kept as they are.
    #[must_use]
    pub fn for_tip(self, tip: Tip) -> Self {
        let Self { seed, pitch_deg, roll_deg, wide_pitch_deg, wide_roll_deg, paths, .. } = self.clone();
        let default = Self::default();
        let plain = Self { seed, pitch_deg, roll_deg, wide_pitch_deg, wide_roll_deg, paths, ..default };
        if self == plain { Self { tip, ..self } } else { self }
    }

    /// The same with the paths that the bed of springs does not represent: large forces, combined motion, rigid bodies.
    #[must_use]
    pub fn beyond_springs(self) -> Self {
        Self { paths: PathNumbers { deep: [8, 16], combined: [0, 40], body: [0, 12], ..self.paths }, ..self }
    }

    /// The same ranges with some twenty paths, half of them held out. They suffice for the numbers of a pad that do not follow from the
    /// finger's compliance, and for a bed of springs that is fitted to runs of the pad as well.
    #[must_use]
    pub fn quick(self) -> Self {
        let paths = PathNumbers {
            press: [1, 0],
            straight: [1, 1],
            reversal: [1, 1],
            turn: [0, 0],
            depth: [1, 0],
            oblique: [1, 1],
            random: [1, 1],
            vibration: [0, 0],
            spin: [1, 0],
            spin_slide: [1, 1],
            spin_reversal: [0, 0],
            pose: [0, 0],
            pose_change: [1, 1],
            force: [0, 0],
            force_step: [0, 0],
            wide_pose: [2, 2],
            wide_pose_change: [0, 0],
            deep: [1, 1],
            combined: [0, 0],
            body: [0, 0],
        };
        Self { axis_depths_mm: Vec::new(), paths, ..self }
    }

    /// Refuses invalid settings.
    ///
    /// # Errors
    /// [`ReduceError::Design`] names the key and its value.
    pub fn check(&self) -> Result<(), ReduceError> {
        let refuse = |key: &str, value: String, problem: &str| {
            Err(ReduceError::Design { key: key.to_owned(), value, problem: problem.to_owned() })
        };
        if self.seed > LARGEST_SEED {
            return refuse("seed", self.seed.to_string(), "must be at most 4294967295");
        }
        let [shallow, deep] = self.depth_mm;
        if !(shallow >= LEAST_DEPTH_MM && deep.is_finite()) {
            let problem = format!("must be finite and from {LEAST_DEPTH_MM} mm, or vibrations of 0.1 mm lose contact");
            return refuse("depth_mm", format!("{:?}", self.depth_mm), &problem);
        }
        for (key, range) in [
            ("depth_mm", self.depth_mm),
            ("pitch_deg", self.pitch_deg),
            ("roll_deg", self.roll_deg),
            ("wide_pitch_deg", self.wide_pitch_deg),
            ("wide_roll_deg", self.wide_roll_deg),
            ("normal_force_n", self.normal_force_n),
            ("deep_mm", self.deep_mm),
        ] {
            if !(range[0] < range[1] && range.iter().all(|bound| bound.is_finite())) {
                return refuse(key, format!("{range:?}"), "must be [least, largest]");
            }
        }
        for (key, range, [least, most]) in [
            ("pitch_deg", self.pitch_deg, POSES_DEG[0]),
            ("roll_deg", self.roll_deg, POSES_DEG[1]),
            ("wide_pitch_deg", self.wide_pitch_deg, POSES_DEG[0]),
            ("wide_roll_deg", self.wide_roll_deg, POSES_DEG[1]),
        ] {
            if range[0] < least || range[1] > most {
                return refuse(key, format!("{range:?}"), &format!("must lie between {least} and {most}"));
            }
        }
        if self.normal_force_n[0] <= 0.0 {
            return refuse("normal_force_n", format!("{:?}", self.normal_force_n), "must be above 0");
        }
        if self.deep_mm[0] <= shallow {
            return refuse("deep_mm", format!("{:?}", self.deep_mm), &format!("must be above {shallow} mm"));
        }
        if !(self.pose_depth_max_mm > shallow && self.pose_depth_max_mm <= deep) {
            let value = self.pose_depth_max_mm.to_string();
            return refuse("pose_depth_max_mm", value, &format!("must lie within depth_mm {:?}", self.depth_mm));
        }
        for (key, value) in [("slide_mm", self.slide_mm), ("spin_deg", self.spin_deg)] {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(key, value.to_string(), "must be a finite number above 0");
            }
        }
        if self.axis_depths_mm.iter().any(|depth| !(shallow..=deep).contains(depth)) {
            let value = format!("{:?}", self.axis_depths_mm);
            return refuse("axis_depths_mm", value, &format!("must lie within depth_mm {:?}", self.depth_mm));
        }
        for kind in Kind::ALL {
            let numbers = self.paths.of(kind);
            if numbers.iter().any(|&number| number > MOST_PATHS) {
                let key = format!("paths.{}", kind.as_str());
                return refuse(&key, format!("{numbers:?}"), "at most 1000 paths of a kind in either half");
            }
        }
        Ok(())
    }

    /// Ranges of pitch and roll of near and of wide poses, degrees.
    pub(super) fn near_poses_deg(&self) -> [[f64; 2]; 2] {
        [self.pitch_deg, self.roll_deg]
    }

    pub(super) fn wide_poses_deg(&self) -> [[f64; 2]; 2] {
        [self.wide_pitch_deg, self.wide_roll_deg]
    }

    /// Least and largest depth of paths whose depth is drawn, mm; the largest is at most `most_mm`.
    pub(super) fn drawn_depths_mm(&self, most_mm: f64) -> [f64; 2] {
        let [shallow, deep] = self.depth_mm;
        let margin = (deep - shallow) / MARGIN_PARTS;
        [shallow + margin, (deep - margin).min(most_mm)]
    }

    /// Upper estimate of the slide after which a contact at that depth is in full slip, mm.
    pub(super) fn slip_slide_mm(&self, depth_mm: f64) -> f64 {
        self.slide_mm / 3.2 * (0.3 + 2.9 * depth_mm.powf(0.75))
    }

    /// Upper estimate of the spin after which a contact at that depth is in full slip, degrees. The rim then moves as far as in the slide to
    /// full slip; its radius grows with the square root of the depth.
    pub(super) fn slip_spin_deg(&self, depth_mm: f64) -> f64 {
        self.spin_deg * (0.3 + 2.9 * depth_mm.powf(0.75)) / (3.2 * depth_mm.sqrt())
    }
}
