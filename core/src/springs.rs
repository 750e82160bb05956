//! The springs of a contact side by side, and what they bear together.
//!
//! Main function: [`carry`]. Uses data, spring, stick_ratio and math.

use crate::ModelOf;
use crate::at_depth::AtDepth;
use crate::math::Arithmetic;
use crate::plane::carried;
use crate::rescaling::Scaling;
use crate::spring::{Limit, Odd, Sums};
use crate::stick_ratio::{Way, led, share_of_way};

/// Makes the square of a way of more than 1e9 mm, of which a state cannot consist, larger than any number.
const ENDLESS: f32 = 1e20;

/// What a contact bears.
#[derive(Clone, Copy)]
pub(crate) struct Load<T> {
    /// N.
    pub(crate) normal: T,
    pub(crate) friction: [T; 2],
    /// What the forces along x and y add to the moment, over the stiffness, mm²; 0 without spin.
    pub(crate) moment: [T; 2],
    pub(crate) stick_ratio: T,
}

/// A number that is not finite if any of the load is not, or if the way is so long that the square of a way is not: then the stick
/// ratio is none. The stick ratio itself is not read, so that it costs nothing where it is not used.
#[inline(always)]
pub(crate) fn check_sum<const P: usize, T: Arithmetic>(load: &Load<T>, Way([x, y, angle]): &Way<T>) -> T {
    let mut square = *x * *x + *y * *y;
    if P > 1 {
        square += *angle * *angle;
    }
    load.normal + load.friction[1] + T::of(ENDLESS) * square
}

/// Moves every spring and adds up what they bear.
#[inline(always)]
pub(crate) fn carry<const M: usize, const N: usize, const P: usize, T: Arithmetic, S: Scaling<T>>(
    model: &ModelOf<'_, M, N, S, T>,
    anchor: &mut [[[T; 2]; P]; M],
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    way: &Way<T>,
) -> Load<T> {
    let (data, scale) = (model.data, &model.scale);
    let odd = Odd(data.odd / at.radius);
    let bed = move_springs(anchor, model, at, here, way, &odd);
    let ([x, y], [energy_x, energy_y]) = (bed.sums.force(&odd), bed.sums.energy(&odd));
    let friction = [at.stiffness[0] * x, at.stiffness[1] * y];
    let (coupling, slope) = (at.press_coupling(data.cells_per_mm), at.stiffness_slope(data.cells_per_mm, scale));
    let mut normal =
        scale.normal(at.row.normal.at(at.t)) + coupling * friction[0] + slope[0] * energy_x + slope[1] * energy_y;
    if S::RESCALED {
        // The odd term changes with depth where the strength grows otherwise than that of the fitted finger.
        let [_, energy] = bed.sums.odd_rates();
        normal += at.stiffness[0] * energy * (odd.0 * -at.growth);
    }
    Load { normal, friction, moment: bed.moment, stick_ratio: bed.stick_ratio }
}

/// Does the same for every spring: without spin for the four of the default model, written out one after the other, which
/// spares a loop's registers and counters.
macro_rules! springs_in_turn {
    ($count:ident, $index:ident, $what:block) => {
        if P == 1 && $count == 4 {
            springs_in_turn!($index, $what, 0, 1, 2, 3);
        } else {
            #[allow(clippy::needless_range_loop, reason = "the same block stands for written-out springs")]
            for $index in 0..$count $what
        }
    };
    ($index:ident, $what:block, $($number:literal),*) => {
        $({
            let $index = $number;
            $what
        })*
    };
}

/// What the springs carry together.
struct Carried<T> {
    /// Sums over the springs.
    sums: Sums<T>,
    /// What the forces along x and y add to the moment, over the stiffness, mm²; 0 without spin.
    moment: [T; 2],
    stick_ratio: T,
}

/// A spring's displacement along x, that along y times the anisotropy, and by how much it is over its limit, at most 0.
type Placed<T> = [T; 3];

/// Moves every spring and returns those that slip to their limit; the state keeps their anchors.
///
/// Anchors are stored on slip alone, so that a contact at rest keeps its bits. What slips is found afterwards without spin, which
/// needs fewer registers at a time, and along with each pair with spin, which needs fewer numbers to be kept.
#[inline(always)]
fn move_springs<const M: usize, const N: usize, const P: usize, T: Arithmetic, S: Scaling<T>>(
    anchors: &mut [[[T; 2]; P]; M],
    model: &ModelOf<'_, M, N, S, T>,
    at: &AtDepth<'_, M, T>,
    here: [T; 3],
    way: &Way<T>,
    odd: &Odd<T>,
) -> Carried<T> {
    let (data, scale) = (model.data, &model.scale);
    let limit = Limit::new(at.row.yield_shift.at(at.t), at.row.anisotropy.at(at.t), at.stiffness[1] / at.stiffness[0]);
    let (none, share) = (T::of(-0.0), T::of(1.0 / P as f32));
    let mut bed = Carried { sums: Sums::new(), moment: [none; 2], stick_ratio: T::of(1.0) };
    let mut levered = none;
    let mut alone: [Placed<T>; M] = [[none; 3]; M];
    springs_in_turn!(M, j, {
        let (pair, spring) = (&mut anchors[j], data.springs[j]);
        let radius = at.row.radius[j].at(at.t) * at.radius;
        let mut slipping = none;
        let (to, gone) = (carried::<P, T, S>(here, &spring, scale), carried::<P, T, S>(way.0, &spring, scale));
        for (k, anchor) in pair.iter_mut().enumerate() {
            let ([ux, uy], placed) = move_spring(anchor, to[k], &limit, radius);
            let [along, bent, across] = bed.sums.add(spring.stiffness, [ux, uy]);
            if P == 1 {
                alone[j] = placed;
            } else {
                slipping += slip_of(&limit, radius, gone[k], placed, spring.sharpness);
                let (x, [arm_x, arm_y]) = (spring.centre(scale), spring.arm(scale));
                let lever = if k == 0 { [x + arm_x, arm_y] } else { [x - arm_x, -arm_y] };
                bed.moment[0] += lever[1] * along;
                bed.moment[1] += lever[0] * across;
                levered += lever[1] * bent;
            }
        }
        if P > 1 {
            bed.stick_ratio -= at.row.area_share[j].at(at.t) * (share * slipping);
        }
    });
    if P == 1 {
        let [x, y, _] = way.0;
        springs_in_turn!(M, j, {
            let radius = at.row.radius[j].at(at.t) * at.radius;
            let slipping = slip_of(&limit, radius, [x, y], alone[j], data.springs[j].sharpness);
            bed.stick_ratio -= at.row.area_share[j].at(at.t) * slipping;
        });
    } else {
        // Each of a pair has its share of the stiffness.
        bed.sums = bed.sums.times(share);
        bed.moment = [share * (bed.moment[0] - odd.0 * levered), share * bed.moment[1]];
    }
    let slip_lead = data.slip_lead[0] + data.slip_lead[1] * at.cells;
    bed.stick_ratio = led(bed.stick_ratio.not_negative(), slip_lead, way);
    bed
}

/// A spring that is carried to a place: its displacement, mm, and how that lies in its limit. One that slips is held elsewhere
/// afterwards.
#[inline(always)]
fn move_spring<T: Arithmetic>(anchor: &mut [T; 2], to: [T; 2], limit: &Limit<T>, radius: T) -> ([T; 2], Placed<T>) {
    let u = [to[0] - anchor[0], to[1] - anchor[1]];
    let seen = limit.see(u, radius);
    let ([mut ux, mut uy], mut w, mut over) = (u, seen.w, seen.over);
    let [held_x, held_y] = anchor;
    seen.over.where_positive([held_x, held_y, &mut ux, &mut uy, &mut w, &mut over], || {
        let (u, w) = limit.return_map(u, seen.w, radius);
        [to[0] - u[0], to[1] - u[1], u[0], u[1], w, T::of(0.0)]
    });
    ([ux, uy], [ux, w, over])
}

/// Share of a spring's area that slips, after a way since the motion last turned back.
#[inline(always)]
fn slip_of<T: Arithmetic>(
    limit: &Limit<T>,
    radius: T,
    [way_x, way_y]: [T; 2],
    [ux, w, over]: Placed<T>,
    sharpness: T,
) -> T {
    let way = [way_x, way_y * limit.anisotropy];
    let ahead = way[0] * ux + way[1] * w - limit.shift * way[0] * radius;
    let p = share_of_way(way[0] * way[0] + way[1] * way[1], ahead, over);
    let square = p * p;
    square - square * (sharpness * (T::of(1.0) - square))
}
