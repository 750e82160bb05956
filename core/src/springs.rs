//! The parallel springs of a contact and their total load.
//!
//! Main function: [`step_springs`]. Uses data, spring, stick_ratio and math.

use crate::at_depth::AtDepth;
use crate::build::DataOf;
use crate::math::Scalar;
use crate::plane::spring_positions;
use crate::spring::{Limit, QuadraticStiffness, Sums};
use crate::stick_ratio::{SlipPath, directional_correction, share_of_path};

/// Factor that makes the square of a path of more than 1e9 mm, which no valid state has, overflow.
const ENDLESS: f32 = 1e20;

/// Load of a contact.
#[derive(Clone, Copy)]
pub(crate) struct Load<T> {
    /// N.
    pub(crate) normal: T,
    pub(crate) friction: [T; 2],
    /// Contributions of the forces along x and y to the moment, over the stiffness, mm²; only with spin.
    pub(crate) moment: [T; 2],
    pub(crate) stick_ratio: T,
}

/// A sum that is not finite if a component of the load is not, or if the path is so long that its square overflows and the stick
/// ratio is invalid. The stick ratio itself is not read, so that it costs nothing where it is not used.
#[inline(always)]
pub(crate) fn check_sum<const P: usize, T: Scalar>(load: &Load<T>, SlipPath([x, y, angle]): &SlipPath<T>) -> T {
    let mut square = *x * *x + *y * *y;
    if P > 1 {
        square += *angle * *angle;
    }
    load.normal + load.friction[1] + T::of(ENDLESS) * square
}

/// Moves every spring and adds up their loads.
#[inline(always)]
pub(crate) fn step_springs<const M: usize, const N: usize, const P: usize, T: Scalar>(
    data: &DataOf<M, N, T>,
    anchor: &mut [[[T; 2]; P]; M],
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    slip_path: &SlipPath<T>,
) -> Load<T> {
    let odd = QuadraticStiffness(data.odd / at.radius);
    let bed = move_springs(anchor, data, at, here, slip_path, &odd);
    let ([x, y], [energy_x, energy_y]) = (bed.sums.force(&odd), bed.sums.energy(&odd));
    let friction = [at.stiffness[0] * x, at.stiffness[1] * y];
    let (coupling, slope) = (at.press_coupling(data.cells_per_mm), at.stiffness_slope(data.cells_per_mm));
    let normal = at.row.normal.at(at.t) + coupling * friction[0] + slope[0] * energy_x + slope[1] * energy_y;
    Load { normal, friction, moment: bed.moment, stick_ratio: bed.stick_ratio }
}

/// Sums of the bed.
struct BedLoad<T> {
    /// Sums over the springs.
    sums: Sums<T>,
    /// Contributions of the forces along x and y to the moment, over the stiffness, mm²; only with spin.
    moment: [T; 2],
    stick_ratio: T,
}

/// Displacement of a spring along x, displacement along y times the anisotropy, and excess over the limit, at most 0.
type Placed<T> = [T; 3];

/// Moves every spring, returns slipping springs to their limit and stores their anchors.
///
/// Anchors are stored on slip alone, so a contact at rest keeps its bits. Without spin the moment is not read, and the compiler leaves
/// it out.
#[inline(always)]
fn move_springs<const M: usize, const N: usize, const P: usize, T: Scalar>(
    anchors: &mut [[[T; 2]; P]; M],
    data: &DataOf<M, N, T>,
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    slip_path: &SlipPath<T>,
    odd: &QuadraticStiffness<T>,
) -> BedLoad<T> {
    let limit = Limit::new(at.row.yield_shift.at(at.t), at.row.anisotropy.at(at.t), at.stiffness[1] / at.stiffness[0]);
    let (none, share) = (T::of(-0.0), T::of(1.0 / P as f32));
    let mut bed = BedLoad { sums: Sums::new(), moment: [none; 2], stick_ratio: T::of(1.0) };
    let mut levered = none;
    for (j, (pair, spring)) in anchors.iter_mut().zip(&data.springs).enumerate() {
        let radius = at.row.radius[j].at(at.t) * at.radius;
        let mut slipping = none;
        let (to, gone) = (spring_positions::<P, T>(here, spring), spring_positions::<P, T>(slip_path.0, spring));
        for (k, anchor) in pair.iter_mut().enumerate() {
            let ([ux, uy], placed) = move_spring(anchor, to[k], &limit, radius);
            let [along, bent, across] = bed.sums.add(spring.stiffness, [ux, uy]);
            slipping += slip_of(&limit, radius, gone[k], placed, spring.sharpness);
            let (x, [arm_x, arm_y]) = (spring.centre_mm, spring.arm_mm);
            let lever = if k == 0 { [x + arm_x, arm_y] } else { [x - arm_x, -arm_y] };
            bed.moment[0] += lever[1] * along;
            bed.moment[1] += lever[0] * across;
            levered += lever[1] * bent;
        }
        bed.stick_ratio -= at.row.area_share[j].at(at.t) * (share * slipping);
    }
    // Each spring of a pair has half of the stiffness.
    bed.sums = bed.sums.times(share);
    bed.moment = [share * (bed.moment[0] - odd.0 * levered), share * bed.moment[1]];
    let slip_lead = data.slip_lead[0] + data.slip_lead[1] * at.cells;
    bed.stick_ratio = directional_correction(bed.stick_ratio.not_negative(), slip_lead, slip_path);
    bed
}

/// Moves a spring to a position. Returns its displacement, mm, and the position within its limit. Slip moves the anchor.
#[inline(always)]
fn move_spring<T: Scalar>(anchor: &mut [T; 2], to: [T; 2], limit: &Limit<T>, radius: T) -> ([T; 2], Placed<T>) {
    let u = [to[0] - anchor[0], to[1] - anchor[1]];
    let seen = limit.yield_check(u, radius);
    let (mut u, mut w, mut over) = (u, seen.w, seen.over);
    if seen.over > T::of(0.0) {
        (u, w) = limit.return_map(u, seen.w, radius);
        *anchor = [to[0] - u[0], to[1] - u[1]];
        over = T::of(0.0);
    }
    (u, [u[0], w, over])
}

/// Share of a spring's area that slips, after a path since the last reversal.
#[inline(always)]
fn slip_of<T: Scalar>(
    limit: &Limit<T>,
    radius: T,
    [path_x, path_y]: [T; 2],
    [ux, w, over]: Placed<T>,
    sharpness: T,
) -> T {
    let slip_path = [path_x, path_y * limit.anisotropy];
    let ahead = slip_path[0] * ux + slip_path[1] * w - limit.shift * slip_path[0] * radius;
    let p = share_of_path(slip_path[0] * slip_path[0] + slip_path[1] * slip_path[1], ahead, over);
    let square = p * p;
    square - square * (sharpness * (T::of(1.0) - square))
}
