//! Division of the design among machines.
//!
//! Paths with a common beginning form a batch, whose beginning is computed once. Batches are distributed so that all shares cost about the
//! same.

use fingerpad_fe::load_path::{Drive, Path, Waypoint};

use super::Experiment;

/// Increments in the estimate of the cost: of a slide, mm, of the depth, mm, of a force, N, and of an angle, degrees.
const STEPS: [f64; 4] = [0.1, 0.08, 0.1, 1.0];
/// Least number of increments of a segment.
const LEAST_STEPS: f64 = 2.0;
/// Cost of an increment on half of a symmetric finger over that on the whole finger.
const HALF_COST: f64 = 0.35;

/// Paths with a common beginning, or a single path.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch<'a> {
    /// The paths.
    pub experiments: Vec<&'a Experiment>,
    /// Number of corners that all paths have in common and that are computed once; 0 for a single path.
    pub common: usize,
}

impl Batch<'_> {
    /// The common beginning as a path of its own; None for a single path.
    pub fn beginning(&self) -> Option<Path> {
        let first = &self.experiments.first().filter(|_| self.common > 1)?.path;
        Some(Path::new(first.drives, first.waypoints[..self.common].to_vec()))
    }

    /// Estimated cost, in increments of a contact 1 mm deep.
    pub fn cost(&self) -> f64 {
        let whole = |e: &&Experiment| cost(&e.path, 0);
        let (Some(first), common) = (self.experiments.first(), self.common) else { return 0.0 };
        if common == 0 {
            return self.experiments.iter().map(whole).sum();
        }
        let rest = |e: &&Experiment| cost(&e.path, common - 1);
        whole(first) - rest(first) + self.experiments.iter().map(rest).sum::<f64>()
    }
}

/// The design in batches, in its order. Only paths without rotations share a beginning, and only if either all or none of them keep the
/// symmetry of the finger.
pub fn batches(design: &[Experiment]) -> Vec<Batch<'_>> {
    let mut batches: Vec<Batch> = Vec::new();
    for experiment in design {
        let mate = batches.iter_mut().find_map(|batch| {
            let common = common_corners(batch, experiment);
            (common > 1).then_some((batch, common))
        });
        match mate {
            Some((batch, common)) => {
                batch.experiments.push(experiment);
                batch.common = common;
            }
            None => batches.push(Batch { experiments: vec![experiment], common: 0 }),
        }
    }
    batches
}

/// Number of corners that an experiment has in common with all paths of a batch; 0 if they cannot share a beginning.
fn common_corners(batch: &Batch, experiment: &Experiment) -> usize {
    let (mate, path) = (&batch.experiments[0].path, &experiment.path);
    let is_alike = batch.experiments[0].body == experiment.body
        && mate.drives == path.drives
        && mate.turns.is_none()
        && path.turns.is_none()
        && mate.is_symmetric() == path.is_symmetric();
    if !is_alike {
        return 0;
    }
    let same = mate.waypoints.iter().zip(&path.waypoints).take_while(|(a, b)| a == b).count();
    // A batch that shares a slide is not joined by a path that shares the press alone.
    if same < batch.common {
        0
    } else if batch.common > 0 {
        batch.common
    } else {
        same
    }
}

/// The batches of share `index` (from 1) of `of`: each batch, the most costly first, goes to the share with the least so
/// far. In the order of `batches`.
pub fn share<'a>(batches: &[Batch<'a>], index: usize, of: usize) -> Vec<Batch<'a>> {
    let costs: Vec<f64> = batches.iter().map(Batch::cost).collect();
    let mut order: Vec<usize> = (0..batches.len()).collect();
    order.sort_by(|&a, &b| costs[b].total_cmp(&costs[a]).then(a.cmp(&b)));
    let mut loads = vec![0.0f64; of];
    let mut own = Vec::new();
    for i in order {
        let least = (0..of).min_by(|&a, &b| loads[a].total_cmp(&loads[b])).expect("at least one share");
        loads[least] += costs[i];
        if least == index - 1 {
            own.push(i);
        }
    }
    own.sort_unstable();
    own.into_iter().map(|i| batches[i].clone()).collect()
}

/// Estimated cost of a path from corner `from` on.
fn cost(path: &Path, from: usize) -> f64 {
    let [slide, depth, force, turn] = STEPS;
    let by_force = path.drives[0] == Drive::Force;
    let normal = if by_force { force } else { depth };
    let turns = [&path.turns.spin, &path.turns.pitch, &path.turns.roll];
    let segment = |row: usize| {
        let (a, b): (&Waypoint, &Waypoint) = (&path.waypoints[row], &path.waypoints[row + 1]);
        let slides = (b.x - a.x).hypot(b.y - a.y) / slide;
        let turned = turns.iter().copied().flatten().map(|t| (t.values[row + 1] - t.values[row]).abs() / turn);
        let steps = turned.fold(slides.max((b.normal - a.normal).abs() / normal), f64::max).max(LEAST_STEPS);
        // The number of unknowns grows with the contact area. Under a driven force the depth is unknown.
        let depth_mm = if by_force { 1.0 } else { 0.5 * (a.normal + b.normal).max(0.0) };
        steps * (0.5 + 0.5 * depth_mm)
    };
    let cost: f64 = (from..path.waypoints.len() - 1).map(segment).sum();
    if path.is_symmetric() { HALF_COST * cost } else { cost }
}
