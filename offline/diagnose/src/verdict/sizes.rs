//! How much laws change the forces of a set.

use crate::data::runs::RunSet;

/// The larger of the 90th percentiles of |ΔN|/N and |ΔF|/F over contact rows whose force stands above the noise.
pub fn size_p90(set: &RunSet, without: &[f64], with: &[f64]) -> f64 {
    let (mut normal, mut friction) = (Vec::new(), Vec::new());
    let mut at = 0;
    for run in &set.runs {
        for row in &run.rows {
            let (a, b) = (&without[at..at + 3], &with[at..at + 3]);
            at += 3;
            if !(row.depth_mm > 0.0) {
                continue;
            }
            if a[0] > 0.01 {
                normal.push((b[0] - a[0]).abs() / a[0]);
            }
            let f = a[1].hypot(a[2]);
            if f > 0.02 {
                friction.push((b[1] - a[1]).hypot(b[2] - a[2]) / f);
            }
        }
    }
    let p90 = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v.get((0.9 * v.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0)
    };
    p90(normal).max(p90(friction))
}

/// The larger of the root mean squares of ΔN and of ΔF over those of N and of F, over all contact rows.
pub fn share_of_forces(set: &RunSet, without: &[f64], with: &[f64]) -> f64 {
    let (mut change, mut force) = ([0.0f64; 2], [0.0f64; 2]);
    let contact = set.runs.iter().flat_map(|run| &run.rows).map(|row| row.depth_mm > 0.0);
    for ((a, b), _) in without.chunks(3).zip(with.chunks(3)).zip(contact).filter(|(_, contact)| *contact) {
        for k in 0..3 {
            let channel = usize::from(k > 0);
            change[channel] += (b[k] - a[k]).powi(2);
            force[channel] += a[k] * a[k];
        }
    }
    [0, 1].map(|k| (change[k] / force[k].max(1e-12)).sqrt()).into_iter().fold(0.0, f64::max)
}
