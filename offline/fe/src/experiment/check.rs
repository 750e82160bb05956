//! Depths and paths that no finger can follow are refused before a run.

use super::{Config, ConfigError};
use crate::Rounded;
use crate::load_path::{Clearance, Drive, Finger, Path};

impl Config {
    /// Refuses depths that are not numbers, do not rise, or reach the bone or the held section.
    ///
    /// # Errors
    /// [`ConfigError::Depths`].
    pub fn check_depths(&self, depths_mm: &[f64], finger: &Finger) -> Result<(), ConfigError> {
        let refuse = |message: String| Err(ConfigError::Depths(message));
        if depths_mm.is_empty() {
            return refuse("no depth given".into());
        }
        let mut last = 0.0;
        for &depth in depths_mm {
            if !(depth.is_finite() && depth > last) {
                let [depth, last] = [depth, last].map(Rounded);
                return refuse(format!("{depth} mm after {last} mm: depths must be numbers that rise from 0"));
            }
            last = depth;
        }
        Clearance::of(finger).refusal(last).map_or(Ok(()), refuse)
    }

    /// Refuses a path that leads to the finger's supports, or to values that are impossible for a fingertip.
    ///
    /// # Errors
    /// [`ConfigError::Path`] names the first such row.
    pub fn check_path(&self, path: &Path, finger: &Finger) -> Result<(), ConfigError> {
        let clearance = Clearance::of(finger);
        for (k, point) in path.waypoints.iter().enumerate() {
            let refuse = |problem| Err(ConfigError::Path { row: k + 1, problem });
            if let Some(problem) = path.refused(k) {
                return refuse(problem);
            }
            let by_depth = path.drives[0] == Drive::Displacement;
            if by_depth
                && path.turns.is_none()
                && finger.rigid_body.is_plane()
                && let Some(problem) = clearance.refusal(point.normal)
            {
                return refuse(format!("depth_mm {problem}"));
            }
            if by_depth
                && !(path.turns.is_none() && finger.rigid_body.is_plane())
                && let Some(problem) = Clearance::refusal_in_pose(finger, path, k)
            {
                return refuse(problem);
            }
        }
        Ok(())
    }
}
