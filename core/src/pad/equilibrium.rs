//! The bulk in equilibrium with what the patches bear.
//!
//! Main type: [`Equations`]. Uses patch and vector.

use heapless::Vec;

use crate::math::{Elementary, Scalar};

use super::body::{Surface, mean, point};
use super::patch::Compressed;
use super::vector::{
    Bulk, Mat3, Packed, Rounded, Vec3, add_diagonal, add_square, along, cross, dot, factor, minus, plus, solve,
    symmetric, times, turned, turned_back, zeros,
};
use super::{Law, MODES, Numbers, PadState, Patch};

/// Most rounds of a step, and most halvings of a round.
const ROUNDS: usize = 16;
const HALVINGS: usize = 6;
/// Change of the bulk below which it is in equilibrium, over its size, and the least size that counts, roots of mJ.
const TOLERANCE: f32 = 2e-4;
const LEAST_SIZE: f32 = 3e-3;
/// Longest way of a round beyond the size of the bulk, roots of mJ.
const LONGEST: f32 = 2.0;
/// Change below which a step that runs out of rounds is still near enough.
const MET: f32 = 3e-3;
/// A round that leaves more than this share of the misfit before it needs a new factor of the stiffness. A step computes at most
/// `FACTORS` of them.
const KEPT: f32 = 0.4;
const FACTORS: usize = 2;

/// Where the body is: from the finger's frame to that of the body.
pub(crate) struct Frame<T> {
    pub axes: Mat3<T>,
    /// The same for displacements, softened.
    pub soft: Mat3<T>,
    /// The body's apex in that frame's axes from the pivot.
    pub apex: Vec3<T>,
    pub pivot: Vec3<T>,
}

/// A patch that may touch in a step.
pub(crate) struct Awake<'a, T> {
    /// Its place among the patches of the pad.
    pub index: usize,
    pub patch: &'a Patch<T>,
    pub placed: Placed<T>,
    pub acting: Acting<T>,
}

/// A patch in a place of the body: what does not change within a step.
pub(crate) struct Placed<T> {
    pub compressed: Compressed<T>,
    /// Place of the undeformed patch, body's frame, mm.
    pub place: Vec3<T>,
    /// Where it is held and the direction into the body there.
    pub anchor: Vec3<T>,
    pub inward: Vec3<T>,
}

/// A patch in a state of the bulk.
pub(crate) struct Acting<T> {
    /// Whether it touches; the rest is read only then, but for place and overlap.
    pub touches: bool,
    pub place: Vec3<T>,
    pub overlap: T,
    /// Slope of the overlap: the direction into the body, the mean of it on a curved one.
    pub inward: Vec3<T>,
    pub force: T,
    pub slope: T,
    pub strength: T,
    /// See [`super::patch::Borne::below`].
    pub below: T,
    /// From the skin to the anchor along the surface, mm, and its length.
    pub stretch: Vec3<T>,
    pub length: T,
    /// Stretch at which friction meets the strength, mm.
    pub bound: T,
    /// Friction over stretch, N/mm.
    pub grip: T,
    /// Force on the skin through the softened axes of the finger, N.
    pub pull: Vec3<T>,
}

impl<T: Scalar> Acting<T> {
    pub fn nothing() -> Self {
        let zero = T::of(0.0);
        Self {
            touches: false,
            place: zeros(),
            overlap: zero,
            inward: zeros(),
            force: zero,
            slope: zero,
            strength: zero,
            below: zero,
            stretch: zeros(),
            length: zero,
            bound: zero,
            grip: zero,
            pull: zeros(),
        }
    }
}

/// Equations of the bulk in a place of the body.
pub(crate) struct Equations<'a, T, B> {
    pub numbers: &'a Numbers<T>,
    pub body: &'a B,
    pub frame: Frame<T>,
    pub strength_factor: T,
}

impl<T: Elementary, B: Surface<T>> Equations<'_, T, B> {
    fn law(&self) -> &Law<T> {
        &self.numbers.law
    }

    /// What is missing to equilibrium: the gradient of the energy. Fills in what the patches do.
    pub fn misfit(&self, bulk: &Bulk<T>, awake: &mut [Awake<'_, T>]) -> Bulk<T> {
        let numbers = self.numbers;
        let law = self.law();
        let motion: [T; 6] = numbers.rigid.each_ref().map(|row| along(row, bulk));
        let turn = [motion[3], motion[4], motion[5]];
        let lift = common_lift(law, &motion);
        let half_turn = T::of(0.5) * law.turn;
        let swept = swept(&turn, half_turn);
        // Force on the skin, finger's axes, and the sum of the products of a patch's arm and force.
        let mut whole = zeros::<T, 3>();
        let mut products: Mat3<T> = [zeros(); 3];
        for Awake { patch, placed, acting, .. } in awake.iter_mut() {
            let linear = patch.modes.each_ref().map(|row| along(row, bulk));
            let arm = minus(&patch.middle_mm, &numbers.middle_mm);
            let second = plus(&lift, &turned(&swept, &arm));
            acting.place = plus(&placed.place, &turned(&self.frame.soft, &plus(&linear, &second)));
            let (overlap, inward) = if self.body.is_plane() {
                self.body.overlap(&acting.place)
            } else {
                mean(self.body, &acting.place, &self.frame.sides(patch))
            };
            acting.overlap = overlap;
            acting.touches = placed.compressed.touches(overlap);
            if !acting.touches {
                continue;
            }
            let borne = placed.compressed.press(overlap, law);
            acting.inward = inward;
            acting.force = borne.force;
            acting.slope = borne.slope;
            acting.strength = borne.strength * self.strength_factor;
            acting.below = borne.below;
            let across = minus(&placed.anchor, &acting.place);
            acting.stretch = if self.body.is_plane() {
                [across[0], across[1], T::of(0.0)]
            } else {
                minus(&across, &times(&placed.inward, dot(&across, &placed.inward)))
            };
            acting.length = (dot(&acting.stretch, &acting.stretch) + T::of(f32::MIN_POSITIVE)).magnitude().sqrt();
            let compliance = patch.compliance_mm_per_n[1];
            acting.bound = acting.strength * compliance;
            acting.grip =
                if acting.length > acting.bound { acting.strength / acting.length } else { T::of(1.0) / compliance };
            let force = minus(&times(&acting.stretch, acting.grip), &times(&inward, borne.force));
            let force = turned_back(&self.frame.soft, &force);
            acting.pull = force;
            whole = plus(&whole, &force);
            for (row, arm) in products.iter_mut().zip(&arm) {
                *row = plus(row, &times(&force, *arm));
            }
        }
        let mut gradient = *bulk;
        for Awake { patch, acting, .. } in awake.iter().filter(|patch| patch.acting.touches) {
            for k in 0..MODES {
                for (modes, force) in patch.modes.iter().zip(&acting.pull) {
                    gradient[k] -= modes[k] * *force;
                }
            }
        }
        // d/dr of r x (r x a), transposed: a (r.F) + (r.a) F − 2 r (a.F).
        let trace = products[0][0] + products[1][1] + products[2][2];
        let by_turn = plus(&turned(&products, &turn), &turned_back(&products, &turn));
        let by_turn = minus(&by_turn, &times(&turn, T::of(2.0) * trace));
        let slopes = lift_slopes(law, &motion);
        let mut on_motion: [T; 6] = zeros();
        for (slope, force) in slopes.iter().zip([whole[2], whole[0]]) {
            for (on, slope) in on_motion.iter_mut().zip(slope) {
                *on += *slope * force;
            }
        }
        for (on, turn) in on_motion[3..].iter_mut().zip(by_turn) {
            *on += turn * half_turn;
        }
        for (row, on) in numbers.rigid.iter().zip(on_motion) {
            for (gradient, share) in gradient.iter_mut().zip(row) {
                *gradient -= *share * on;
            }
        }
        let stiffening = Stiffening::at(&numbers.squash, bulk, law);
        for (gradient, share) in gradient.iter_mut().zip(&stiffening.direction) {
            *gradient += *share * stiffening.first;
        }
        gradient
    }

    /// Factor of the tangent stiffness, without the curvature of the body and of the bulk's second order, and with friction of a
    /// bounded patch that turns.
    fn factor(&self, bulk: &Bulk<T>, awake: &[Awake<'_, T>]) -> Packed<T> {
        let numbers = self.numbers;
        let stiffening = Stiffening::at(&numbers.squash, bulk, self.law());
        let mut stiffness = numbers.squash.map(|x| x * stiffening.per_size);
        add_square(&mut stiffness, &stiffening.direction, stiffening.second - stiffening.per_size);
        add_diagonal(&mut stiffness, T::of(1.0));
        let motion: [T; 6] = numbers.rigid.each_ref().map(|row| along(row, bulk));
        let slopes = lift_slopes(self.law(), &motion);
        let mut lifts: [Bulk<T>; 2] = [zeros(); 2];
        for (lift, slope) in lifts.iter_mut().zip(&slopes) {
            for (row, slope) in numbers.rigid.iter().zip(slope) {
                for (lift, share) in lift.iter_mut().zip(row) {
                    *lift += *share * *slope;
                }
            }
        }
        let soft = &self.frame.soft;
        for Awake { patch, placed, acting, .. } in awake {
            if !acting.touches {
                continue;
            }
            // Displacement in the body's frame per coordinate.
            let mut modes: [Bulk<T>; 3] = [zeros(); 3];
            for k in 0..MODES {
                let moved = [patch.modes[0][k] + lifts[1][k], patch.modes[1][k], patch.modes[2][k] + lifts[0][k]];
                let moved = turned(soft, &moved);
                for (row, moved) in modes.iter_mut().zip(moved) {
                    row[k] = moved;
                }
            }
            let in_direction = |d: &Vec3<T>| -> Bulk<T> {
                core::array::from_fn(|k| modes[0][k] * d[0] + modes[1][k] * d[1] + modes[2][k] * d[2])
            };
            add_square(&mut stiffness, &in_direction(&acting.inward), acting.slope);
            // Two directions along the surface: that of the stretch and the other.
            let one = T::of(1.0) / acting.length;
            let (first, second) = if acting.length > T::of(1e-9) {
                let first = times(&acting.stretch, one);
                (first, cross(&placed.inward, &first))
            } else {
                tangents(&placed.inward)
            };
            if acting.length <= acting.bound {
                add_square(&mut stiffness, &in_direction(&first), acting.grip);
            }
            add_square(&mut stiffness, &in_direction(&second), acting.grip);
        }
        factor(&mut stiffness);
        stiffness
    }

    /// Brings the bulk to equilibrium by Newton's method, with the factor of an earlier step as long as that serves, and with secants
    /// over the last rounds (Anderson 1965): the factor knows nothing of how strength follows pressure.
    ///
    /// Returns whether it is met.
    pub fn solve<const P: usize>(&self, state: &mut PadState<P, T>, awake: &mut [Awake<'_, T>]) -> bool {
        let mut bulk = state.bulk;
        let mut misfit = self.misfit(&bulk, awake);
        let mut secants = Secants::none();
        let mut factors = 0;
        let mut before = T::of(f32::MAX);
        let mut is_met = false;
        let mut best = (T::of(f32::MAX), bulk);
        for _ in 0..ROUNDS {
            if !state.is_factored() {
                state.factor = Rounded::of(&self.factor(&bulk, awake));
                state.set_factored(true);
                factors += 1;
                secants = Secants::none();
            }
            let step = solve(&state.factor, &misfit);
            let off = along(&step, &misfit).magnitude();
            let size = along(&bulk, &bulk) + T::of(LEAST_SIZE * LEAST_SIZE);
            is_met = off <= T::of(MET * MET) * size;
            if off < best.0 {
                best = (off, bulk);
            }
            if !(off > T::of(TOLERANCE * TOLERANCE) * size) {
                break;
            }
            // Squares of misfits.
            if off > T::of(KEPT * KEPT) * before && factors < FACTORS && !secants.is_new() {
                state.set_factored(false);
                before = T::of(f32::MAX);
                continue;
            }
            before = off;
            let mut way = secants.shorten(&bulk, &step);
            // No round goes farther than from a finger in the air to a deep press.
            let long = along(&way, &way);
            let longest = size + T::of(LONGEST * LONGEST);
            if long > longest {
                let share = (longest / long).magnitude().sqrt();
                way = way.map(|x| x * share);
            }
            let from = bulk;
            for _ in 0..HALVINGS {
                bulk = core::array::from_fn(|k| from[k] - way[k]);
                misfit = self.misfit(&bulk, awake);
                // Not far beyond the least energy along this direction.
                if !(along(&step, &misfit) < T::of(-0.5) * off) {
                    break;
                }
                way = way.map(|x| x * T::of(0.5));
            }
        }
        if !is_met {
            // What came nearest, and the friction that belongs to it.
            bulk = best.1;
            self.misfit(&bulk, awake);
            state.set_factored(false);
        }
        state.bulk = bulk;
        is_met
    }
}

/// Rounds that secants reach back.
const DEPTH: usize = 3;

/// Changes of step and bulk over the last rounds, those of the step orthonormal.
struct Secants<T> {
    pairs: Vec<[Bulk<T>; 2], DEPTH>,
    last: Option<[Bulk<T>; 2]>,
}

impl<T: Elementary> Secants<T> {
    fn none() -> Self {
        Self { pairs: Vec::new(), last: None }
    }

    fn is_new(&self) -> bool {
        self.pairs.is_empty()
    }

    /// The way to go from `bulk`, down, of which `step` is the one by the factor alone.
    fn shorten(&mut self, bulk: &Bulk<T>, step: &Bulk<T>) -> Bulk<T> {
        if let Some([last_step, last_bulk]) = &self.last {
            if self.pairs.is_full() {
                self.pairs.clear();
            }
            let mut change: Bulk<T> = core::array::from_fn(|k| step[k] - last_step[k]);
            let mut moved: Bulk<T> = core::array::from_fn(|k| bulk[k] - last_bulk[k]);
            let whole = along(&change, &change);
            for [old, by] in &self.pairs {
                let share = along(old, &change);
                for k in 0..MODES {
                    change[k] -= share * old[k];
                    moved[k] -= share * by[k];
                }
            }
            let left = along(&change, &change);
            if left > T::of(1e-4) * whole {
                let one = T::of(1.0) / left.magnitude().sqrt();
                // There is room: a full one was emptied.
                let _ = self.pairs.push([change.map(|x| x * one), moved.map(|x| x * one)]);
            }
        }
        self.last = Some([*step, *bulk]);
        let mut way = *step;
        for [old, by] in &self.pairs {
            let share = along(old, step);
            for k in 0..MODES {
                way[k] -= share * (old[k] - by[k]);
            }
        }
        way
    }
}

/// Two unit vectors across a direction that points down, more or less.
fn tangents<T: Elementary>(inward: &Vec3<T>) -> (Vec3<T>, Vec3<T>) {
    let zero = T::of(0.0);
    // Across the direction and y; never short, since the direction is not y itself on the bodies' upper sides.
    let raw = [-inward[2], zero, inward[0]];
    let length = (dot(&raw, &raw) + T::of(1e-12)).magnitude().sqrt();
    let first = times(&raw, T::of(1.0) / length);
    (first, cross(inward, &first))
}

/// The matrix of r x (r x a) times a factor, of a rotation vector r.
fn swept<T: Elementary>(r: &Vec3<T>, factor: T) -> Mat3<T> {
    let [x, y, z] = times(r, factor);
    let [xx, yy, zz] = [x * r[0], y * r[1], z * r[2]];
    let [xy, xz, yz] = [x * r[1], x * r[2], y * r[2]];
    [[-(yy + zz), xy, xz], [xy, -(xx + zz), yz], [xz, yz, -(xx + yy)]]
}

/// Of a rigid motion the parts that a mirror image about y = 0 leaves, and those that it turns round: (t_x, t_z, r_y), (t_y, r_x, r_z).
fn parts<T: Elementary>(m: &[T; 6]) -> [Vec3<T>; 2] {
    [[m[0], m[2], m[4]], [m[1], m[3], m[5]]]
}

/// The six numbers of either part.
fn numbers<T: Elementary>(lift: &[T; 12]) -> [[T; 6]; 2] {
    let half = |half: &[T]| half.first_chunk().copied().unwrap_or(zeros());
    let (even, odd) = lift.split_at(6);
    [half(even), half(odd)]
}

/// The part of the second order that is the same for all patches, mm.
fn common_lift<T: Elementary>(law: &Law<T>, motion: &[T; 6]) -> Vec3<T> {
    let parts = parts(motion);
    let [z, x] = law.lift.each_ref().map(|lift| {
        let mut sum = T::of(0.0);
        for ([a, b, c], n) in parts.iter().zip(numbers(lift)) {
            sum += n[0] * (*a * *a);
            sum += n[1] * (*b * *b);
            sum += n[2] * (*c * *c);
            sum += n[3] * (*a * *b);
            sum += n[4] * (*a * *c);
            sum += n[5] * (*b * *c);
        }
        sum
    });
    [x, T::of(0.0), z]
}

/// Its derivatives over the rigid motion, along z and along x.
fn lift_slopes<T: Elementary>(law: &Law<T>, motion: &[T; 6]) -> [[T; 6]; 2] {
    let parts = parts(motion);
    law.lift.each_ref().map(|lift| {
        let [even, odd] = numbers(lift);
        let slope = |[a, b, c]: &Vec3<T>, n: &[T; 6]| -> Vec3<T> {
            let twice = |n: T, x: T| n * x + n * x;
            [
                twice(n[0], *a) + n[3] * *b + n[4] * *c,
                twice(n[1], *b) + n[3] * *a + n[5] * *c,
                twice(n[2], *c) + n[4] * *a + n[5] * *b,
            ]
        };
        let (e, o) = (slope(&parts[0], &even), slope(&parts[1], &odd));
        [e[0], o[0], e[1], o[1], e[2], o[2]]
    })
}

/// Largest exponent of the stiffening, far beyond any contact: no number overflows.
const MOST_GROWTH: f32 = 20.0;

/// Stiffening of the bulk: rate q³ exp(growth q²) of the mean squash q.
pub(crate) struct Stiffening<T> {
    pub energy: T,
    /// Slope over the squash, the same over the squash, and the slope's slope.
    first: T,
    per_size: T,
    second: T,
    /// Derivative of the squash over the bulk.
    direction: Bulk<T>,
}

impl<T: Elementary> Stiffening<T> {
    pub fn at(squash: &Packed<T>, bulk: &Bulk<T>, law: &Law<T>) -> Self {
        let pulled = symmetric(squash, bulk);
        let q = (along(&pulled, bulk).not_negative() + T::of(1e-18)).magnitude().sqrt();
        let one = T::of(1.0) / q;
        let [rate, growth] = law.stiffening;
        let y = (growth * q * q).at_most(T::of(MOST_GROWTH));
        let scale = rate * q * y.exp();
        let per_size = scale * (T::of(3.0) + T::of(2.0) * y);
        Self {
            energy: scale * q * q,
            first: per_size * q,
            per_size,
            second: scale * (T::of(6.0) + y * (T::of(14.0) + T::of(4.0) * y)),
            direction: pulled.map(|p| p * one),
        }
    }
}

/// The point of the body's surface at which a patch is held and the direction into the body there.
#[inline(always)]
pub(crate) fn held<T: Elementary>(body: &impl Surface<T>, anchor: [T; 2]) -> (Vec3<T>, Vec3<T>) {
    let at = point(body, anchor);
    let (_, inward) = body.overlap(&at);
    (at, inward)
}
