//! Rows of a path that get a contact map.

use fingerpad_fe::contact::{Coordinates, plane};
use fingerpad_fe::load_path::Path;

/// Most rows that are picked unasked.
const MOST: usize = 6;

/// At most six rows of a path, from 0: the end of the first press, the rows where the plane turns by 45 degrees or
/// more, and the last row that presses.
///
/// If there are too many turns, first and last are kept and the turns between are thinned out evenly.
pub fn default_map_rows(path: &Path) -> Vec<usize> {
    let points: Vec<Coordinates> = (0..path.waypoints.len()).map(|row| path.coordinates(row, 0.0)).collect();
    let presses = |row: &usize| points[*row][plane::DEPTH] > 0.0;
    let inner = 1..points.len().saturating_sub(1);
    let Some(last) = (0..points.len()).rev().find(presses) else { return Vec::new() };
    let mut rows: Vec<usize> = inner.filter(presses).filter(|row| turns(&points, *row)).collect();
    rows.retain(|row| *row < last);
    rows.push(last);
    if rows.len() > MOST {
        let pick = |k: usize| rows[k * (rows.len() - 1) / (MOST - 1)];
        rows = (0..MOST).map(pick).collect();
    }
    rows
}

/// Whether the press ends or begins at a row, a slide or a turn of finger or plane starts or reverses there, or a slide
/// changes its direction by 45 degrees or more.
fn turns(points: &[Coordinates], row: usize) -> bool {
    let step = |k: usize| -> Coordinates { std::array::from_fn(|c| points[k][c] - points[k - 1][c]) };
    let (before, after) = (step(row), step(row + 1));
    let slide = |s: Coordinates| s[plane::X].hypot(s[plane::Y]);
    let along = before[plane::X] * after[plane::X] + before[plane::Y] * after[plane::Y];
    let slides = [slide(before), slide(after)];
    let slide_turns = if slides[0] > 0.0 && slides[1] > 0.0 {
        along <= (0.5f64.sqrt() + 1e-9) * slides[0] * slides[1]
    } else {
        slides[0] != slides[1]
    };
    let goes_back = |k: usize| before[k] * after[k] < 0.0;
    let starts = |k: usize| (before[k] == 0.0) != (after[k] == 0.0);
    slide_turns || goes_back(plane::DEPTH) || (plane::SPIN..6).any(|k| goes_back(k) || starts(k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad_fe::load_path::{Drive, Waypoint};

    fn rows(corners: &[[f64; 3]]) -> Vec<usize> {
        let point = |(k, &[normal, x, y]): (usize, &[f64; 3])| Waypoint { t_s: k as f64, normal, x, y };
        let waypoints = corners.iter().enumerate().map(point).collect();
        default_map_rows(&Path::new([Drive::Displacement; 3], waypoints))
    }

    #[test]
    fn press_reversals_turns_and_end() {
        let air = [0.0; 3];
        assert_eq!(rows(&[air, [1.0, 0.0, 0.0]]), [1]);
        assert_eq!(rows(&[air, [0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 3.0, 0.0]]), [2, 4]);
        // Slide, reversal, turn, lift to the air.
        let path = [air, [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
        assert_eq!(rows(&path), [1, 2, 3, 4]);
        // A decrease and increase of the depth.
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
