//! Choice of representative runs of a set: far from each other in depth, direction and the driver of the effect.

use crate::data::runs::RunSet;
use crate::laws::Column;

/// Rank of each value among all, 0 to 1; equal values share it.
fn ranks(values: &[f64]) -> Vec<f64> {
    let below = |v: f64| values.iter().filter(|w| **w < v).count() as f64;
    let same = |v: f64| values.iter().filter(|w| **w == v).count() as f64;
    values.iter().map(|v| (below(*v) + 0.5 * (same(*v) - 1.0)) / (values.len().max(2) - 1) as f64).collect()
}

/// Indices of `count` runs, rising: first the shallowest, then each time the one that is farthest from those chosen,
/// by ranks of depth, of each driver, and by half the direction's unit vector.
pub fn spread(set: &RunSet, drivers: &[Column], count: usize) -> Vec<usize> {
    let mut places: Vec<Vec<f64>> = vec![Vec::new(); set.runs.len()];
    let mut columns = vec![Column::Depth];
    for d in drivers {
        let varies = set.has(*d) && !matches!(d, Column::Direction | Column::Slide | Column::ContactTime);
        if varies && !columns.contains(d) {
            columns.push(*d);
        }
    }
    for column in columns {
        let values: Vec<f64> = set.runs.iter().map(|r| r.value(column)).collect();
        if values.iter().all(|v| v.is_finite()) {
            places.iter_mut().zip(ranks(&values)).for_each(|(p, r)| p.push(r));
        }
    }
    for (p, run) in places.iter_mut().zip(&set.runs) {
        let along = run.rows.last().map_or([0.0; 2], |r| r.along);
        p.extend(along.map(|a| 0.25 * a));
    }
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let shallow = |a: &usize, b: &usize| set.runs[*a].depth_mm().total_cmp(&set.runs[*b].depth_mm());
    let mut chosen: Vec<usize> = (0..set.runs.len()).min_by(shallow).into_iter().collect();
    while chosen.len() < count.min(set.runs.len()) {
        let nearest = |i: usize| chosen.iter().map(|&c| far(&places[i], &places[c])).fold(f64::INFINITY, f64::min);
        let free = (0..set.runs.len()).filter(|i| !chosen.contains(i));
        // The first of equals, so that the choice does not depend on the order of comparison.
        let next = free.map(|i| (i, nearest(i))).fold((0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
        chosen.push(next.0);
    }
    chosen.sort_unstable();
    chosen
}
