//! Steady slip: everything slips and nothing changes any more, so that a slide may go on in longer steps.

use nalgebra::Vector3;

use super::{Drive, Path};
use crate::contact::plane;
use crate::solve::State;

/// Change of friction, normal force and area over one increment below which slip is steady, share of the friction, the
/// normal force and the area.
const STEADY_CHANGE: f64 = 5e-4;

/// Stuck share of the area up to which the contact counts as slipping wholly: a corner of the rim that is about to.
const STUCK_SHARE: f64 = 1e-3;

/// Arm at which the moment about the normal is held against the friction, mm.
const MOMENT_ARM_MM: f64 = 4.0;

/// Whether the whole contact slipped in both of two successive states, with the same load.
pub(super) fn slips_steadily(before: &State, after: &State) -> bool {
    let (a, b) = (&before.totals, &after.totals);
    let all_slips =
        |state: &State| state.totals.area > 0.0 && state.totals.stuck_area <= STUCK_SHARE * state.totals.area;
    let same = |change: f64, of: f64| change.abs() <= STEADY_CHANGE * of;
    all_slips(before)
        && all_slips(after)
        && same((b.force - a.force).xy().norm(), b.force.xy().norm())
        && same(b.moment.z - a.moment.z, b.force.xy().norm() * MOMENT_ARM_MM)
        && same(b.force.z - a.force.z, b.force.z)
        && same(b.area - a.area, b.area)
}

/// Slide and spin of the plane on the segment to `row`, mm and rad, if it has no other motion.
pub(super) fn slide(path: &Path, row: usize) -> Option<[f64; 3]> {
    let (a, b) = (path.coordinates(row - 1, 0.0), path.coordinates(row, 0.0));
    let drives = path.coordinate_drives();
    let moves = [plane::X, plane::Y, plane::SPIN];
    let is_driven = moves.iter().all(|&k| drives[k] == Drive::Displacement);
    let rests = [plane::DEPTH, plane::PITCH, plane::ROLL].iter().all(|&k| a[k] == b[k]);
    let way = moves.map(|k| b[k] - a[k]);
    (is_driven && rests && way != [0.0; 3]).then_some(way)
}

/// Whether the path to `row` continues that to the row before it: a slide in the same direction, at the same spin.
pub(super) fn continues_straight(path: &Path, row: usize) -> bool {
    let direction = |row: usize| {
        let way = Vector3::from(slide(path, row)?);
        Some(way / way.norm())
    };
    match (row > 1).then(|| (direction(row - 1), direction(row))) {
        Some((Some(a), Some(b))) => (a - b).norm() < 1e-9,
        _ => false,
    }
}
