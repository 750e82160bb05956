//! Steady slip: everything slips and nothing changes any more, so that a slide may go on in longer steps.

use super::{Drive, Path};
use crate::solve::State;

/// Change of friction, normal force and area over one increment below which slip is steady, share of the friction, the
/// normal force and the area.
const STEADY_CHANGE: f64 = 5e-4;

/// Whether the whole contact slipped in both of two states in succession and bears what it bore.
pub(super) fn slips_steadily(before: &State, after: &State) -> bool {
    let (a, b) = (&before.totals, &after.totals);
    let all_slips = |state: &State| state.totals.area > 0.0 && state.totals.stuck_area == 0.0;
    let same = |change: f64, of: f64| change.abs() <= STEADY_CHANGE * of;
    all_slips(before)
        && all_slips(after)
        && same((b.force - a.force).xy().norm(), b.force.xy().norm())
        && same(b.force.z - a.force.z, b.force.z)
        && same(b.area - a.area, b.area)
}

/// Whether the way to `row` is a straight slide under constant depth or normal force.
pub(super) fn is_slide(path: &Path, row: usize) -> bool {
    let (a, b) = (&path.waypoints[row - 1], &path.waypoints[row]);
    path.drives[1..] == [Drive::Displacement; 2] && a.normal == b.normal && (a.x != b.x || a.y != b.y)
}

/// Whether the way to `row` goes on as the way to the row before it: a slide in the same direction.
pub(super) fn goes_on_straight(path: &Path, row: usize) -> bool {
    let direction = |row: usize| {
        let (a, b) = (&path.waypoints[row - 1], &path.waypoints[row]);
        let (x, y) = (b.x - a.x, b.y - a.y);
        let length = x.hypot(y);
        [x / length, y / length]
    };
    let goes_on = || {
        let ([ax, ay], [bx, by]) = (direction(row - 1), direction(row));
        (ax - bx).hypot(ay - by) < 1e-9
    };
    row > 1 && is_slide(path, row - 1) && is_slide(path, row) && goes_on()
}
