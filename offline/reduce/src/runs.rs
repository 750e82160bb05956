//! Storage of a path's finite-element response, with the hash of the settings that made it.
//!
//! File: the eight bytes `FPRUN001`, then a DEFLATE stream of postcard. Numbers are 32-bit floats, a relative rounding
//! of 6e-8, far below what the finite-element solution resolves.

use std::io::{Read, Write};
use std::path::Path as FilePath;

use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Experiment, Kind, ReduceError};
use fingerpad::Regime;
use fingerpad_fe::experiment::{Config, ConfigError};
use fingerpad_fe::load_path::{Path, Response};

const MAGIC: &[u8; 8] = b"FPRUN001";

/// One row of a stored response; signs and units as in [`Response`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
        }
    }
}

/// The finite-element response along one path of the design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of the experiment.
    pub name: String,
    /// Kind of the path's motion.
    pub kind: Kind,
    /// Whether the fit must not see it.
    pub held_out: bool,
    /// Hash of the settings, [`settings_hash`].
    pub settings_hash: String,
    /// The path that was asked for.
    pub path: Path,
    /// The increments, the start included.
    pub samples: Vec<Sample>,
    /// Why the run ended before the path's end, if it did.
    pub ended_early: Option<String>,
    /// CPU time, s.
    pub cpu_s: f64,
}

/// Hash of all that a run's response depends on besides its path.
///
/// # Errors
/// As [`Config::hash`].
pub fn settings_hash(config: &Config) -> Result<String, ConfigError> {
    // The depths of the main job have no influence here.
    Config { experiment: Default::default(), ..config.clone() }.hash()
}

impl Run {
    /// Name of the file that holds a run of `experiment`: changes with path and settings, so that what is stale is
    /// not found.
    pub fn file_name(experiment: &Experiment, settings_hash: &str) -> String {
        let key = serde_json::to_string(&(settings_hash, &experiment.path)).expect("plain numbers");
        let digest: String = Sha256::digest(key).iter().take(4).map(|b| format!("{b:02x}")).collect();
        format!("{}.{digest}.fprun", experiment.name)
    }

    /// Largest difference to `responses` of the same path at equal times, of normal force and of friction, each over the
    /// largest of this run. Both are taken as straight between their rows.
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
        let plain = postcard::to_stdvec(self).expect("plain data");
        let mut encoder = DeflateEncoder::new(MAGIC.to_vec(), Compression::best());
        encoder.write_all(&plain).expect("writing to memory");
        encoder.finish().expect("writing to memory")
    }

    /// A run from its file's bytes; `path` is for the message.
    ///
    /// # Errors
    /// [`ReduceError::Run`] if it is not such a file, damaged, or holds numbers that are not finite.
    pub fn from_bytes(bytes: &[u8], path: &FilePath) -> Result<Self, ReduceError> {
        let refuse = |problem: String| ReduceError::Run { path: path.to_path_buf(), problem };
        let body = bytes.strip_prefix(MAGIC).ok_or_else(|| refuse("not a stored run (no FPRUN001)".into()))?;
        let mut plain = Vec::new();
        // A run is at most some thousand rows; more is damage, not data.
        DeflateDecoder::new(body)
            .take(64 << 20)
            .read_to_end(&mut plain)
            .map_err(|e| refuse(format!("damaged: {e}")))?;
        let run: Self = postcard::from_bytes(&plain).map_err(|e| refuse(format!("damaged: {e}")))?;
        let finite = |s: &Sample| {
            let [sx, sy] = s.slide_mm;
            let [fx, fy] = s.friction_n;
            [s.t_s, s.depth_mm, sx, sy, s.normal_force_n, fx, fy, s.contact_area_mm2, s.stick_ratio]
                .iter()
                .all(|v| v.is_finite())
        };
        if let Some(row) = run.samples.iter().position(|s| !finite(s)) {
            return Err(refuse(format!("row {row} holds a number that is not finite: {:?}", run.samples[row])));
        }
        Ok(run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design;

    fn run() -> Run {
        let e = &design()[5];
        let sample = Sample::from(&Response { t_s: 0.1, depth_mm: 1.0, normal_force_n: 0.3, ..Default::default() });
        Run {
            name: e.name.clone(),
            kind: e.kind,
            held_out: e.held_out,
            settings_hash: settings_hash(&Config::default()).unwrap(),
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
        for length in [0, 7, 8, 20, bytes.len() - 9] {
            assert!(Run::from_bytes(&bytes[..length], FilePath::new("r")).is_err(), "{length}");
        }
        let mut bad = run();
        bad.samples[3].normal_force_n = f32::NAN;
        let message = Run::from_bytes(&bad.to_bytes(), FilePath::new("a.fprun")).unwrap_err().to_string();
        assert!(message.starts_with("a.fprun: row 3 "), "{message}");
    }

    #[test]
    fn settings_and_path_change_the_file_name() {
        let all = design();
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
