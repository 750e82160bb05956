//! Rows of a path whose contact is worth a map.

use fingerpad_fe::load_path::{Path, Waypoint};

/// Most rows that are picked unasked.
const MOST: usize = 6;

/// At most six rows of a path, from 0: the end of the first press, where the plane turns back or aside by 45 degrees or
/// more, and the last row that presses.
///
/// Where the path turns more often, first and last stay and the turns between are thinned out evenly.
pub fn default_map_rows(path: &Path) -> Vec<usize> {
    let points = &path.waypoints;
    let presses = |row: &usize| points[*row].normal > 0.0;
    let inner = 1..points.len().saturating_sub(1);
    let Some(last) = (0..points.len()).rev().find(presses) else { return Vec::new() };
    let mut rows: Vec<usize> = inner.filter(presses).filter(|row| turns(points, *row)).collect();
    rows.retain(|row| *row < last);
    rows.push(last);
    if rows.len() > MOST {
        let pick = |k: usize| rows[k * (rows.len() - 1) / (MOST - 1)];
        rows = (0..MOST).map(pick).collect();
    }
    rows
}

/// Whether the press ends or begins at a row, the slide starts there, or turns by 45 degrees or more.
fn turns(points: &[Waypoint], row: usize) -> bool {
    let step = |k: usize| {
        let (a, b) = (&points[k - 1], &points[k]);
        [b.normal - a.normal, b.x - a.x, b.y - a.y]
    };
    let (before, after) = (step(row), step(row + 1));
    let slide = |s: [f64; 3]| s[1].hypot(s[2]);
    let along = before[1] * after[1] + before[2] * after[2];
    let slides = [slide(before), slide(after)];
    let slide_turns = if slides[0] > 0.0 && slides[1] > 0.0 {
        along <= (0.5f64.sqrt() + 1e-9) * slides[0] * slides[1]
    } else {
        slides[0] != slides[1]
    };
    slide_turns || before[0] * after[0] < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad_fe::load_path::Drive;

    fn rows(corners: &[[f64; 3]]) -> Vec<usize> {
        let point = |(k, &[normal, x, y]): (usize, &[f64; 3])| Waypoint { t_s: k as f64, normal, x, y };
        let waypoints = corners.iter().enumerate().map(point).collect();
        default_map_rows(&Path { drives: [Drive::Displacement; 3], waypoints })
    }

    #[test]
    fn press_reversals_turns_and_end() {
        let air = [0.0; 3];
        assert_eq!(rows(&[air, [1.0, 0.0, 0.0]]), [1]);
        assert_eq!(rows(&[air, [0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 3.0, 0.0]]), [2, 4]);
        // Slide, reversal, turn, lift to the air.
        let path = [air, [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
        assert_eq!(rows(&path), [1, 2, 3, 4]);
        // Depth that goes down and up again.
        assert_eq!(rows(&[air, [1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]), [1, 2, 3]);
        assert_eq!(rows(&[air, [-1.0, 0.0, 0.0]]), [] as [usize; 0]);
    }

    #[test]
    fn many_turns_are_thinned_out() {
        let swing = |k: u32| [1.0, f64::from(k % 2), 0.0];
        let corners: Vec<_> = std::iter::once([0.0; 3]).chain((0..40).map(swing)).collect();
        let rows = rows(&corners);
        assert_eq!((rows.len(), rows[0], rows[5]), (6, 1, 40));
        assert!(rows.is_sorted_by(|a, b| a < b));
    }
}
