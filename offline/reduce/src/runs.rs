//! Storage of a path's finite-element response, with the hash of its settings.
//!
//! Numbers are 32-bit floats; their relative rounding of 6e-8 is far below the error of the finite-element solution. The module stored_run
//! writes and reads the file.

use std::path::Path as FilePath;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::stored_run;
use super::{Experiment, Kind, ReduceError, is_representable};
use fingerpad::Regime;
use fingerpad_fe::experiment::{Config, ConfigError, RigidBodySettings};
use fingerpad_fe::load_path::{Drive, Path, Response, Waypoint};

/// One row of a stored response; signs and units as in [`Response`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub t_s: f32,
    /// Travel of the plane from first touch, mm.
    pub depth_mm: f32,
    /// Slide of the plane, mm.
    pub slide_mm: [f32; 2],
    /// Normal force, N.
    pub normal_force_n: f32,
    /// Friction, N.
    pub friction_n: [f32; 2],
    /// Contact area, mm².
    pub contact_area_mm2: f32,
    /// Stuck area over contact area.
    pub stick_ratio: f32,
    /// Regime of the contact.
    pub regime: Regime,
    /// Pose of the plane and moments; None in older stored runs.
    pub turned: Option<Turned>,
}

/// Pose of the plane and the moments that it exerts on the finger; signs, axes and point as in [`Response`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turned {
    /// Spin, degrees.
    pub spin_deg: f32,
    /// Pitch, degrees.
    pub pitch_deg: f32,
    /// Roll, degrees.
    pub roll_deg: f32,
    /// Moments about x, y and z, N mm.
    pub moment_n_mm: [f32; 3],
}

impl From<&Response> for Sample {
    fn from(r: &Response) -> Self {
        Self {
            t_s: r.t_s as f32,
            depth_mm: r.depth_mm as f32,
            slide_mm: [r.slide_x_mm as f32, r.slide_y_mm as f32],
            normal_force_n: r.normal_force_n as f32,
            friction_n: [r.friction_x_n as f32, r.friction_y_n as f32],
            contact_area_mm2: r.contact_area_mm2 as f32,
            stick_ratio: r.stick_ratio as f32,
            regime: r.regime,
            turned: Some(Turned {
                spin_deg: r.spin_deg as f32,
                pitch_deg: r.pitch_deg as f32,
                roll_deg: r.roll_deg as f32,
                moment_n_mm: r.moment_n_mm.map(|m| m as f32),
            }),
        }
    }
}

impl Sample {
    /// Whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let turned = self.turned.unwrap_or_default();
        let [sx, sy] = self.slide_mm;
        let [fx, fy] = self.friction_n;
        let [mx, my, mz] = turned.moment_n_mm;
        let of_contact = [self.t_s, self.depth_mm, sx, sy, self.normal_force_n, fx, fy, self.contact_area_mm2];
        let of_pose = [self.stick_ratio, turned.spin_deg, turned.pitch_deg, turned.roll_deg, mx, my, mz];
        of_contact.iter().chain(&of_pose).all(|v| v.is_finite())
    }
}

/// The finite-element response along one path of the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the experiment.
    pub name: String,
    /// Kind of the path's motion.
    pub kind: Kind,
    /// Whether the run is excluded from the fit.
    pub held_out: bool,
    /// Hash of the settings, [`settings_hash`].
    pub settings_hash: String,
    /// The body that the finger touches.
    pub body: RigidBodySettings,
    /// The prescribed path.
    pub path: Path,
    /// The increments, the start included.
    pub samples: Vec<Sample>,
    /// Why the run ended before the path's end, if it did.
    pub ended_early: Option<String>,
    /// CPU time, s; of a path that shares its beginning with others, that of the beginning included.
    pub cpu_s: f64,
}

/// Hash of all settings on which a run's response depends besides its path.
///
/// # Errors
/// As [`Config::hash`].
pub fn settings_hash(config: &Config) -> Result<String, ConfigError> {
    // The depths of `build` have no influence on a run.
    Config { experiment: Default::default(), ..config.clone() }.hash()
}

/// The parts of a path without turns that determine its file name.
#[derive(Serialize)]
struct PlainPath<'a> {
    drives: [Drive; 3],
    waypoints: &'a [Waypoint],
}

impl Run {
    /// Pitch and roll of the finger along the run, degrees to three digits; None where they change or the run does not contain them.
    pub fn pose_deg(&self) -> Option<[f32; 2]> {
        let mut poses = self
            .samples
            .iter()
            .filter_map(|sample| sample.turned)
            .map(|turned| [turned.pitch_deg, turned.roll_deg].map(|deg| (1e3 * deg).round() / 1e3));
        let first = poses.next()?;
        poses.all(|pose| pose == first).then_some(first)
    }

    /// Whether the run is in the neutral pose of a finger throughout.
    pub fn is_neutral(&self, neutral_pitch_deg: f64) -> bool {
        let near = |pose: [f32; 2]| (f64::from(pose[0]) - neutral_pitch_deg).abs() < 0.01 && pose[1].abs() < 0.01;
        self.pose_deg().is_some_and(near)
    }

    /// Whether the bed of springs represents the motion of its path, [`is_representable`], and is fitted to such paths.
    pub fn is_representable(&self) -> bool {
        self.kind.is_for_springs() && is_representable(&self.path)
    }

    /// Whether the plane turns about its normal along its path.
    pub fn spins(&self) -> bool {
        self.path.turns.spin.is_some()
    }

    /// Name of the file of a run of `experiment`. It depends on path and settings, so that outdated files are not found.
    pub fn file_name(experiment: &Experiment, settings_hash: &str) -> String {
        // The name of a path without turns is the same as before turns were introduced.
        let plain = PlainPath { drives: experiment.path.drives, waypoints: &experiment.path.waypoints };
        let key = if !experiment.body.is_plane() {
            serde_json::to_string(&(settings_hash, &experiment.body, &experiment.path))
        } else if experiment.path.turns.is_none() {
            serde_json::to_string(&(settings_hash, plain))
        } else {
            serde_json::to_string(&(settings_hash, &experiment.path))
        };
        let key = key.expect("plain numbers");
        let digest: String = Sha256::digest(key).iter().take(4).map(|b| format!("{b:02x}")).collect();
        format!("{}.{digest}.fprun", experiment.name)
    }

    /// Largest differences to `responses` of the same path at equal times, of normal force and of friction, each over the largest value of
    /// this run. Both are interpolated linearly.
    pub fn difference(&self, responses: &[Response]) -> [f64; 2] {
        let forces = |r: &Response| [r.normal_force_n, r.friction_x_n, r.friction_y_n];
        let (mut apart, mut most) = ([0.0f64; 2], [0.0f64; 2]);
        for s in &self.samples {
            let t = f64::from(s.t_s);
            let after = responses.partition_point(|r| r.t_s < t).min(responses.len() - 1);
            let (a, b) = (&responses[after.saturating_sub(1)], &responses[after]);
            let share = if b.t_s > a.t_s { ((t - a.t_s) / (b.t_s - a.t_s)).clamp(0.0, 1.0) } else { 1.0 };
            let (a, b) = (forces(a), forces(b));
            let [n, x, y]: [f64; 3] = std::array::from_fn(|i| a[i] + share * (b[i] - a[i]));
            let (normal, [fx, fy]) = (f64::from(s.normal_force_n), s.friction_n.map(f64::from));
            apart = [apart[0].max((normal - n).abs()), apart[1].max((fx - x).hypot(fy - y))];
            most = [most[0].max(normal), most[1].max(fx.hypot(fy))];
        }
        std::array::from_fn(|i| if most[i] > 0.0 { apart[i] / most[i] } else { apart[i] })
    }

    /// The file's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        stored_run::to_bytes(self)
    }

    /// A run from the bytes of its file.
    ///
    /// * `path`: path of the file, for the message of an error
    ///
    /// # Errors
    /// [`ReduceError::Run`] if the file is not a stored run, is damaged, or contains numbers that are not finite.
    pub fn from_bytes(bytes: &[u8], path: &FilePath) -> Result<Self, ReduceError> {
        let refuse = |problem: String| ReduceError::Run { path: path.to_path_buf(), problem };
        let run = stored_run::from_bytes(bytes).map_err(refuse)?;
        if let Some(row) = run.samples.iter().position(|s| !s.is_finite()) {
            return Err(refuse(format!("row {row} holds a number that is not finite: {:?}", run.samples[row])));
        }
        Ok(run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DesignSettings, design};
    use fingerpad_fe::experiment::{BodyKind, RigidBodySettings};

    fn run() -> Run {
        let e = &design(&DesignSettings::default()).unwrap()[5];
        let sample = Sample::from(&Response { t_s: 0.1, depth_mm: 1.0, normal_force_n: 0.3, ..Default::default() });
        Run {
            name: e.name.clone(),
            kind: e.kind,
            held_out: e.held_out,
            settings_hash: settings_hash(&Config::default()).unwrap(),
            body: e.body.clone(),
            path: e.path.clone(),
            samples: vec![sample; 70],
            ended_early: None,
            cpu_s: 1.5,
        }
    }

    #[test]
    fn what_was_stored_comes_back_and_damage_is_refused() {
        let bytes = run().to_bytes();
        assert_eq!(Run::from_bytes(&bytes, FilePath::new("r")).unwrap(), run());
        let mut without_pose = run();
        without_pose.samples.iter_mut().for_each(|s| s.turned = None);
        assert_eq!(Run::from_bytes(&without_pose.to_bytes(), FilePath::new("r")).unwrap(), without_pose);
        for length in [0, 7, 8, 20, bytes.len() - 9] {
            assert!(Run::from_bytes(&bytes[..length], FilePath::new("r")).is_err(), "{length}");
        }
        let mut bad = run();
        bad.samples[3].turned = Some(Turned { moment_n_mm: [0.0, f32::NAN, 0.0], ..Turned::default() });
        let message = Run::from_bytes(&bad.to_bytes(), FilePath::new("a.fprun")).unwrap_err().to_string();
        assert!(message.starts_with("a.fprun: row 3 "), "{message}");
    }

    /// Runs of an earlier program keep their meaning, or are refused: a curved body then spun about the foot.
    #[test]
    fn earlier_physics_is_refused_where_it_differs() {
        let mut ball = run();
        ball.body = RigidBodySettings { kind: BodyKind::Sphere, radius_mm: Some(8.0), ..RigidBodySettings::default() };
        let turned = |spin_deg| Some(Turned { spin_deg, ..Turned::default() });
        ball.samples.iter_mut().for_each(|s| s.turned = turned(0.0));
        for aside_mm in [0.0, 0.5] {
            for sample in &mut ball.samples[30..] {
                (sample.turned, sample.slide_mm) = (turned(10.0), [aside_mm, 0.0]);
            }
            let mut bytes = ball.to_bytes();
            assert!(Run::from_bytes(&bytes, FilePath::new("r")).is_ok());
            bytes[..8].copy_from_slice(b"FPRUN003");
            assert_eq!(Run::from_bytes(&bytes, FilePath::new("r")).is_ok(), aside_mm == 0.0);
        }
    }

    #[test]
    fn settings_and_path_change_the_file_name() {
        let all = design(&DesignSettings::default()).unwrap();
        let mut config = Config::default();
        let hash = settings_hash(&config).unwrap();
        config.experiment.slide_mm = 3.0;
        assert_eq!(settings_hash(&config).unwrap(), hash);
        config.friction.lambda *= 1.01;
        let other = settings_hash(&config).unwrap();
        assert_ne!(other, hash);
        let mut moved = all[0].clone();
        moved.path.waypoints[1].normal += 1e-3;
        let names = [Run::file_name(&all[0], &hash), Run::file_name(&all[0], &other), Run::file_name(&moved, &hash)];
        assert!(names[0] != names[1] && names[0] != names[2], "{names:?}");
    }
}
