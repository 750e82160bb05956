//! Press and slide of the experiment.

use super::{Config, Experiment};
use crate::load_path::{
    Checkpoint, Drive, Finger, LoadPathError, OnProgress, Path, PathEnd, PressLimit, RunOptions, Trajectory, Waypoint,
    follow, press_limits,
};

/// Slides at which fields are kept, mm, if the slide is as long.
const SNAPSHOT_SLIDES_MM: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 6.0];

/// Presses to `depth_mm` through the lesser depths of the experiment, as a press on all of them does. `from` is the end
/// of an earlier press to a lesser depth, from which it continues.
///
/// # Errors
/// [`LoadPathError`], with the rows up to there.
pub fn press(
    config: &Config,
    finger: &Finger,
    depth_mm: f64,
    from: Option<&PathEnd>,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<PathEnd, LoadPathError> {
    let path = Path::new([Drive::Displacement; 3], press_waypoints(&config.experiment, depth_mm));
    let options = RunOptions { from, checkpoint, ..RunOptions::default() };
    follow(&config.problem(finger), &path, options, progress)
}

/// Presses to `depth_mm` as [`press`] does, then slides from proximal to distal; fields at five slides. `from` is the
/// end of an earlier press; the numbers are the same. With a checkpoint the run continues from the saved state.
///
/// # Errors
/// [`LoadPathError`], with the rows up to there.
pub fn press_and_slide(
    config: &Config,
    finger: &Finger,
    depth_mm: f64,
    from: Option<&PathEnd>,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<Trajectory, LoadPathError> {
    let experiment = &config.experiment;
    let mut waypoints = press_waypoints(experiment, depth_mm);
    let pressed = waypoints.len() - 1;
    let press_s = waypoints[pressed].t_s;
    let mut slides: Vec<f64> =
        SNAPSHOT_SLIDES_MM.into_iter().filter(|&s| s > 0.0 && s < experiment.slide_mm - 1e-9).collect();
    slides.push(experiment.slide_mm);
    waypoints.extend(slides.iter().map(|&x| Waypoint {
        t_s: press_s + x / experiment.speed_mm_s,
        normal: depth_mm,
        x,
        y: 0.0,
    }));
    let snapshots: Vec<usize> = (pressed..waypoints.len()).collect();
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let problem = config.problem(finger);
    let options = RunOptions { snapshots: &snapshots, from, checkpoint, ..RunOptions::default() };
    follow(&problem, &path, options, progress).map(PathEnd::into_trajectory)
}

/// Corners of a press to `depth_mm` through the lesser depths of the experiment.
fn press_waypoints(experiment: &Experiment, depth_mm: f64) -> Vec<Waypoint> {
    let lesser = experiment.depths_mm.iter().copied().filter(|&depth| depth < depth_mm - 1e-9);
    let depths = [0.0].into_iter().chain(lesser).chain([depth_mm]);
    depths.map(|depth| Waypoint { t_s: depth / experiment.speed_mm_s, normal: depth, x: 0.0, y: 0.0 }).collect()
}

/// Normal force, area and the law's integral over the frictionless pressure at each depth.
///
/// # Errors
/// [`LoadPathError`].
pub fn frictionless(
    config: &Config,
    finger: &Finger,
    checkpoint: Option<Checkpoint>,
    progress: OnProgress,
) -> Result<Vec<PressLimit>, LoadPathError> {
    let problem = config.problem(finger);
    press_limits(&problem, &config.friction, &config.experiment.depths_mm, checkpoint, progress)
}
