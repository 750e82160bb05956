//! Depths and paths that no finger can follow are refused before a run.

use super::{Config, ConfigError};
use crate::load_path::{Clearance, Drive, Finger, Path};

/// Largest force that may be driven, N. The hardest press of a fingertip is some 50 N, and long before it the pulp is
/// flat on the bone.
const LARGEST_FORCE_N: f64 = 100.0;
/// Longest slide that may be driven, mm.
const LONGEST_SLIDE_MM: f64 = 1000.0;

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
                return refuse(format!("{depth} mm after {last} mm: depths must be numbers that rise from 0"));
            }
            last = depth;
        }
        Clearance::of(finger).refusal(last).map_or(Ok(()), refuse)
    }

    /// Refuses a path that leads to what holds the finger, or to numbers that no fingertip bears.
    ///
    /// # Errors
    /// [`ConfigError::Path`] names the first such row.
    pub fn check_path(&self, path: &Path, finger: &Finger) -> Result<(), ConfigError> {
        let clearance = Clearance::of(finger);
        for (k, point) in path.waypoints.iter().enumerate() {
            let refuse = |problem| Err(ConfigError::Path { row: k + 1, problem });
            if let Some(problem) = path.refused_pose(k) {
                return refuse(problem);
            }
            let by_depth = path.drives[0] == Drive::Displacement;
            if by_depth
                && path.turns.is_none()
                && let Some(problem) = clearance.refusal(point.normal)
            {
                return refuse(format!("depth_mm {problem}"));
            }
            if by_depth
                && !path.turns.is_none()
                && let Some(problem) = Clearance::refusal_in_pose(finger, path, k)
            {
                return refuse(problem);
            }
            let keys = [("normal_force_n", point.normal), ("friction_x_n", point.x), ("friction_y_n", point.y)];
            for ((key, value), drive) in keys.into_iter().zip(path.drives) {
                if drive == Drive::Force && !(value.abs() <= LARGEST_FORCE_N) {
                    return refuse(format!(
                        "{key} {value} N: at most {LARGEST_FORCE_N} N, beyond which the pulp is pressed to the bone"
                    ));
                }
            }
            for ((key, value), drive) in
                [("slide_x_mm", point.x), ("slide_y_mm", point.y)].into_iter().zip(&path.drives[1..])
            {
                if *drive == Drive::Displacement && !(value.abs() <= LONGEST_SLIDE_MM) {
                    return refuse(format!(
                        "{key} {value} mm: at most {LONGEST_SLIDE_MM} mm; a slide is steady after some millimetres"
                    ));
                }
            }
        }
        Ok(())
    }
}
