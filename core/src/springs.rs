//! The parallel springs of a contact and their total load.
//!
//! Main function: [`step_springs`]. Uses data, memory, spring, stick_ratio and math.

use crate::ForceStateOf;
use crate::at_depth::AtDepth;
use crate::build::DataOf;
use crate::math::Scalar;
use crate::memory::{Hold, Memory};
use crate::plane::spring_positions;
use crate::relaxation::Perhaps;
use crate::spring::{DIV_EPS, Limit, QuadraticStiffness, Sums};
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
pub(crate) fn step_springs<const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    data: &DataOf<M, N, T>,
    state: &mut ForceStateOf<M, P, T, R>,
    at: &AtDepth<'_, M, T>,
    weights: &R::Weights,
    here: [T; 3],
    slip_path: &SlipPath<T>,
) -> Load<T> {
    // The pressure changes the limits and not q, whose change would do work.
    let odd = QuadraticStiffness(data.odd / at.strength);
    let bed = move_springs(state, data, at, weights, here, slip_path, &odd);
    let [x, y] = bed.sums.force(&odd);
    let energy = bed.sums.energy(&odd);
    let [energy_x, energy_y] = weights.get().map_or(energy, |weights| weights.energy(energy, bed.held, odd.0));
    let friction = [at.stiffness[0] * x, at.stiffness[1] * y];
    let (coupling, slope) = (at.press_coupling(data.cells_per_mm), at.stiffness_slope(data.cells_per_mm));
    let normal =
        at.row.normal.at(at.t) * at.pressure + coupling * friction[0] + slope[0] * energy_x + slope[1] * energy_y;
    Load { normal, friction, moment: bed.moment, stick_ratio: bed.stick_ratio }
}

/// Sums of the bed.
struct BedLoad<T> {
    /// Sums over the springs.
    sums: Sums<T>,
    /// Sums over the springs of [`Hold::energy`].
    held: [T; 3],
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
fn move_springs<const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    state: &mut ForceStateOf<M, P, T, R>,
    data: &DataOf<M, N, T>,
    at: &AtDepth<'_, M, T>,
    weights: &R::Weights,
    here: [T; 3],
    slip_path: &SlipPath<T>,
    odd: &QuadraticStiffness<T>,
) -> BedLoad<T> {
    let limit = Limit::new(at.row.yield_shift.at(at.t), at.row.anisotropy.at(at.t), at.stiffness[1] / at.stiffness[0]);
    let (none, share) = (T::of(-0.0), T::of(1.0 / P as f32));
    let mut bed = BedLoad { sums: Sums::new(), held: [none; 3], moment: [none; 2], stick_ratio: T::of(1.0) };
    let mut levered = none;
    let slip_path = &slip_path.scaled(pull_per_stretch(state, data, weights, here));
    for (j, (pair, spring)) in state.anchor.iter_mut().zip(&data.springs).enumerate() {
        let radius = at.row.radius[j].at(at.t) * at.radius;
        let mut slipping = none;
        let (to, gone) = (spring_positions::<P, T>(here, spring), spring_positions::<P, T>(slip_path.0, spring));
        for (k, anchor) in pair.iter_mut().enumerate() {
            let hold = match (weights.get(), state.memory.get()) {
                (Some(weights), Some(memory)) => Some(memory.hold(weights, j, k)),
                _ => None,
            };
            let Moved { pulling, displacement, placed } = move_spring(anchor, to[k], hold.as_ref(), &limit, radius);
            let [along, bent, across] = bed.sums.add(spring.stiffness, pulling);
            if let (Some(weights), Some(memory), Some(hold)) = (weights.get(), state.memory.get(), hold) {
                memory.stretch(weights, j, k, displacement);
                for (sum, energy) in bed.held.iter_mut().zip(hold.energy()) {
                    *sum += spring.stiffness * energy;
                }
            }
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
    bed.held = bed.held.map(|sum| share * sum);
    bed.moment = [share * (bed.moment[0] - odd.0 * levered), share * bed.moment[1]];
    let slip_lead = data.slip_lead[0] + data.slip_lead[1] * at.cells;
    bed.stick_ratio = directional_correction(bed.stick_ratio.not_negative(), slip_lead, slip_path);
    bed
}

/// A spring at its new position.
struct Moved<T> {
    /// Displacement that pulls, mm: that from the anchor, or v where the tissue relaxes.
    pulling: [T; 2],
    /// Displacement from the anchor, mm.
    displacement: [T; 2],
    placed: Placed<T>,
}

/// Moves a spring to a position, with what its branches hold. Slip moves the anchor.
#[inline(always)]
fn move_spring<T: Scalar>(
    anchor: &mut [T; 2],
    to: [T; 2],
    hold: Option<&Hold<T>>,
    limit: &Limit<T>,
    radius: T,
) -> Moved<T> {
    let mut displacement = [to[0] - anchor[0], to[1] - anchor[1]];
    let mut pulling = hold.map_or(displacement, |hold| hold.pulling(displacement));
    let seen = limit.yield_check(pulling, radius);
    let (mut w, mut over) = (seen.w, seen.over);
    if seen.over > T::of(0.0) {
        (pulling, w) = limit.return_map(pulling, seen.w, radius);
        displacement = hold.map_or(pulling, |hold| hold.displacement(pulling));
        *anchor = [to[0] - displacement[0], to[1] - displacement[1]];
        over = T::of(0.0);
    }
    Moved { pulling, displacement, placed: [pulling[0], w, over] }
}

/// How much farther springs pull than they are displaced, on a way of the plane: of the first spring, which slips last, 1 to s; 1 where
/// nothing relaxes. Converts slip paths.
#[inline(always)]
fn pull_per_stretch<const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    state: &mut ForceStateOf<M, P, T, R>,
    data: &DataOf<M, N, T>,
    weights: &R::Weights,
    here: [T; 3],
) -> Option<T> {
    let (weights, memory) = (weights.get()?, state.memory.get()?);
    let to = spring_positions::<P, T>(here, &data.springs[0])[0];
    let anchor = state.anchor[0][0];
    let u = [to[0] - anchor[0], to[1] - anchor[1]];
    let v = memory.hold(weights, 0, 0).pulling(u);
    let square = |[x, y]: [T; 2]| x * x + y * y + T::of(DIV_EPS);
    let (one, most) = (T::of(1.0), weights.stiff);
    let scale = (square(v) / square(u)).at_most(most * most).sqrt();
    Some(if scale > one { scale } else { one })
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
