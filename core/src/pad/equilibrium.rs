//! Equilibrium of the bulk with the forces on the patches.
//!
//! Main type: [`Equations`]. Uses patch and vector.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use crate::math::{Elementary, Scalar};
use crate::relaxation::Perhaps;

use super::body::{Surface, mean, point};
use super::memory::{Memory, Weights};
use super::orthotropy::SkinAxis;
use super::patch::Compressed;
use super::touch::Approach;
use super::vector::{Bulk, Packed, Rounded, add_diagonal, add_square, along, factor, solve, symmetric, zeros};
use super::{Law, MODES, Numbers, PadState, Patch};

/// Largest number of halvings in the line search of an iteration.
const HALVINGS: usize = 6;
/// Lower bound of the size of the bulk in quotients, sqrt(mJ).
const LEAST_SIZE: f32 = 3e-3;
/// Longest step of an iteration beyond the size of the bulk, sqrt(mJ).
const LONGEST: f32 = 2.0;
/// Relative change below which a solution is accepted when the evaluations are used up.
const ACCEPTED: f32 = 3e-3;
/// An iteration that leaves more than this share of the residual requires a new factor of the stiffness.
const SLOW: f32 = 0.4;
/// Largest number of factors that a step computes.
const FACTORS: usize = 2;
/// Square of a change of the bulk over that of the first iterate, below which an iterate is better.
const BETTER: f32 = 0.25;
/// Evaluations that cost as much as a factor.
const FACTOR_COST: u32 = 4;

/// Transformation from the finger's frame to that of the body.
pub(crate) struct Frame<T> {
    /// Rotation.
    pub axes: Matrix3<T>,
    /// Rotation of displacements, times the softness of the bulk.
    pub soft: Matrix3<T>,
    /// The body's apex relative to the pivot, body's axes, mm.
    pub apex: Vector3<T>,
    /// Centre of rotation of poses, finger's frame, mm.
    pub pivot: Vector3<T>,
    /// The part of the apex's place that only holds near first touch.
    pub approach: Approach<T>,
}

/// A patch that may touch in a step.
pub(crate) struct ActivePatch<'a, T> {
    /// Its index in the pad.
    pub index: usize,
    pub patch: &'a Patch<T>,
    pub placed: PlacedPatch<T>,
    pub contact: PatchContact<T>,
}

/// The quantities of a patch that are constant within a step.
pub(crate) struct PlacedPatch<T> {
    pub compressed: Compressed<T>,
    /// Place of the undeformed patch, body's frame, mm.
    pub place: Vector3<T>,
    /// Anchor, body's frame, mm.
    pub anchor: Vector3<T>,
    /// Direction into the body at the anchor.
    pub inward: Vector3<T>,
}

/// The contact of a patch at given coordinates of the bulk.
pub(crate) struct PatchContact<T> {
    /// Whether it touches. If not, only place and overlap are valid.
    pub touches: bool,
    /// Place of the middle, body's frame, mm.
    pub place: Vector3<T>,
    /// Mean overlap, mm.
    pub overlap: T,
    /// Gradient of the overlap: the direction into the body, on a curved body the mean over the patch.
    pub inward: Vector3<T>,
    /// Normal force, N, and its derivative over the overlap, N/mm.
    pub force: T,
    pub slope: T,
    /// Normal force of the relaxed tissue at this overlap, N.
    pub relaxed: T,
    /// Strength, N; along the axis of the skin if friction is orthotropic.
    pub strength: T,
    /// See [`super::patch::PatchForce::below`].
    pub below: T,
    /// Vector from the skin to the anchor along the surface, mm, times s less h where the tissue relaxes, and its length.
    pub stretch: Vector3<T>,
    pub length: T,
    /// Length of the stretch at which friction reaches the strength in its direction, mm.
    pub bound: T,
    /// Friction over stretch, N/mm.
    pub grip: T,
    /// Generalised force on the skin in the finger's frame: the force on it times the transpose of [`Frame::soft`], N.
    pub pull: Vector3<T>,
}

impl<T: Scalar> PatchContact<T> {
    pub fn without_contact() -> Self {
        let zero = T::of(0.0);
        Self {
            touches: false,
            place: Vector3::zeros(),
            overlap: zero,
            inward: Vector3::zeros(),
            force: zero,
            slope: zero,
            relaxed: zero,
            strength: zero,
            below: zero,
            stretch: Vector3::zeros(),
            length: zero,
            bound: zero,
            grip: zero,
            pull: Vector3::zeros(),
        }
    }
}

/// Equations of equilibrium of the bulk at a given pose of the body.
pub(crate) struct Equations<'a, const P: usize, T, B, W> {
    pub numbers: &'a Numbers<T>,
    pub body: &'a B,
    pub frame: Frame<T>,
    pub strength_factor: T,
    /// See [`super::Effort::tolerance`].
    pub tolerance: f32,
    /// The branches of the tissue; none by type where it does not relax.
    pub weights: W,
    /// Axis of the skin; none if friction is isotropic.
    pub axis: Option<SkinAxis<T>>,
}

impl<const P: usize, T: Elementary, B: Surface<T>, W: Perhaps<Weights<P, T>>> Equations<'_, P, T, B, W> {
    fn law(&self) -> &Law<T> {
        &self.numbers.law
    }

    /// Stiffness over that of the relaxed tissue.
    #[inline(always)]
    pub fn stiff(&self) -> Option<T> {
        self.weights.get().map(|weights| weights.stiff)
    }

    /// Residual of equilibrium: the gradient of the energy over the bulk, sqrt(mJ). Also updates the contact of each patch.
    pub fn residual(&self, bulk: &Bulk<T>, active: &mut [ActivePatch<'_, T>]) -> Bulk<T> {
        let numbers = self.numbers;
        let law = self.law();
        let motion: [T; 6] = numbers.rigid.each_ref().map(|row| along(row, bulk));
        let turn = Vector3::new(motion[3], motion[4], motion[5]);
        let lift = common_lift(law, &motion);
        let half_turn = T::of(0.5) * law.turn;
        let double_cross = double_cross(&turn, half_turn);
        // Total force on the skin, finger's axes, and the sum over the patches of the outer products of arm and force.
        let mut total = Vector3::zeros();
        let mut products = Matrix3::zeros();
        for ActivePatch { index, patch, placed, contact } in active.iter_mut() {
            let linear = Vector3::from(patch.modes.each_ref().map(|row| along(row, bulk)));
            let arm = Vector3::from(patch.middle_mm) - Vector3::from(numbers.middle_mm);
            let second = lift + double_cross * arm;
            contact.place = placed.place + self.frame.soft * (linear + second);
            let (overlap, inward) = if self.body.is_plane() {
                self.body.overlap(&contact.place)
            } else {
                mean(self.body, &contact.place, &self.frame.sides(patch))
            };
            contact.overlap = overlap;
            contact.touches = placed.compressed.touches(overlap);
            if let Some(weights) = self.weights.get() {
                // Without contact the skin comes back as its branches let go.
                contact.relaxed = weights.normal(*index) / weights.stiff;
            }
            if !contact.touches {
                continue;
            }
            let branches = self.weights.get().map(|weights| [weights.stiff, weights.normal(*index)]);
            let load = placed.compressed.press(overlap, law, branches);
            if branches.is_some() {
                contact.touches = load.force > T::of(0.0);
                if !contact.touches {
                    // The skin lags behind the body.
                    continue;
                }
                contact.relaxed = load.relaxed;
            }
            contact.inward = inward;
            contact.force = load.force;
            contact.slope = load.slope;
            contact.strength = load.strength * self.strength_factor;
            contact.below = load.below;
            let across = placed.anchor - contact.place;
            contact.stretch = if self.body.is_plane() {
                Vector3::new(across.x, across.y, T::of(0.0))
            } else {
                across - placed.inward * across.dot(&placed.inward)
            };
            if let Some(weights) = self.weights.get() {
                contact.stretch = contact.stretch * weights.stiff - weights.across(*index, &placed.inward);
            }
            contact.length = (contact.stretch.dot(&contact.stretch) + T::of(f32::MIN_POSITIVE)).magnitude().sqrt();
            let compliance = patch.compliance_mm_per_n[1];
            let strength = match &self.axis {
                None => contact.strength,
                Some(axis) => axis.strength(contact, compliance, &placed.inward),
            };
            contact.bound = strength * compliance;
            contact.grip =
                if contact.length > contact.bound { strength / contact.length } else { T::of(1.0) / compliance };
            let force = contact.stretch * contact.grip - inward * load.force;
            let force = self.frame.soft.tr_mul(&force);
            contact.pull = force;
            total += force;
            products += arm * force.transpose();
        }
        let mut gradient = match self.weights.get() {
            None => *bulk,
            Some(weights) => core::array::from_fn(|k| weights.stiff * bulk[k] - weights.bulk[k]),
        };
        for ActivePatch { patch, contact, .. } in active.iter().filter(|patch| patch.contact.touches) {
            for k in 0..MODES {
                for (modes, force) in patch.modes.iter().zip(&contact.pull) {
                    gradient[k] -= modes[k] * *force;
                }
            }
        }
        // Derivative of F . (r x (r x a)) over r: a (r.F) + (r.a) F − 2 r (a.F).
        let trace = products.trace();
        let by_turn = products * turn + products.tr_mul(&turn);
        let by_turn = by_turn - turn * (T::of(2.0) * trace);
        let slopes = lift_slopes(law, &motion);
        let mut on_motion: [T; 6] = zeros();
        for (slope, force) in slopes.iter().zip([total.z, total.x]) {
            for (on, slope) in on_motion.iter_mut().zip(slope) {
                *on += *slope * force;
            }
        }
        for (on, turn) in on_motion[3..].iter_mut().zip(&by_turn) {
            *on += *turn * half_turn;
        }
        for (row, on) in numbers.rigid.iter().zip(on_motion) {
            for (gradient, share) in gradient.iter_mut().zip(row) {
                *gradient -= *share * on;
            }
        }
        let stiffening = Stiffening::at(&numbers.squash, bulk, law);
        let first = self.stiff().map_or(stiffening.first, |stiff| stiff * stiffening.first);
        for (gradient, share) in gradient.iter_mut().zip(&stiffening.direction) {
            *gradient += *share * first;
        }
        gradient
    }

    /// Factor of the tangent stiffness. It leaves out the curvature of the body and the second derivatives of the bulk's rigid motion.
    /// Friction of a slipping patch resists a change of its direction only.
    fn factor(&self, bulk: &Bulk<T>, active: &[ActivePatch<'_, T>]) -> Packed<T> {
        let numbers = self.numbers;
        let stiffening = Stiffening::at(&numbers.squash, bulk, self.law());
        let mut stiffness = numbers.squash.map(|x| x * stiffening.per_size);
        add_square(&mut stiffness, &stiffening.direction, stiffening.second - stiffening.per_size);
        add_diagonal(&mut stiffness, T::of(1.0));
        if let Some(stiff) = self.stiff() {
            stiffness = stiffness.map(|x| x * stiff);
        }
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
        for ActivePatch { patch, placed, contact, .. } in active {
            if !contact.touches {
                continue;
            }
            // Displacement in the body's frame per coordinate of the bulk.
            let mut modes: [Bulk<T>; 3] = [zeros(); 3];
            for k in 0..MODES {
                let [x, y, z] = patch.modes.each_ref().map(|row| row[k]);
                let moved = soft * Vector3::new(x + lifts[1][k], y, z + lifts[0][k]);
                for (row, moved) in modes.iter_mut().zip(&moved) {
                    row[k] = *moved;
                }
            }
            let in_direction = |d: &Vector3<T>| -> Bulk<T> {
                core::array::from_fn(|k| modes[0][k] * d[0] + modes[1][k] * d[1] + modes[2][k] * d[2])
            };
            add_square(&mut stiffness, &in_direction(&contact.inward), contact.slope);
            // Two directions along the surface: that of the stretch, and the one perpendicular to it.
            let one = T::of(1.0) / contact.length;
            let (first, second) = if contact.length > T::of(1e-9) {
                let first = contact.stretch * one;
                (first, placed.inward.cross(&first))
            } else {
                tangents(&placed.inward)
            };
            let grip = self.stiff().map_or(contact.grip, |stiff| stiff * contact.grip);
            if contact.length <= contact.bound {
                add_square(&mut stiffness, &in_direction(&first), grip);
            } else if let Some(axis) = &self.axis {
                let (direction, share) = axis.along_limit(contact, &placed.inward);
                add_square(&mut stiffness, &in_direction(&direction), grip * share);
                continue;
            }
            add_square(&mut stiffness, &in_direction(&second), grip);
        }
        factor(&mut stiffness);
        stiffness
    }

    /// Finds the equilibrium of the bulk by Newton's method.
    ///
    /// The factor of the stiffness is kept over steps while the residual decreases fast enough. Anderson's acceleration (Anderson 1965)
    /// over the last iterations corrects it; in particular the factor leaves out the dependence of strength on pressure.
    ///
    /// Uses up to `evaluations`, but one at least, and counts them down. Returns whether the solution is accepted.
    pub fn solve<M: Memory<P, T>>(
        &self,
        state: &mut PadState<P, T, M>,
        active: &mut [ActivePatch<'_, T>],
        evaluations: &mut u32,
    ) -> bool {
        let tolerance = T::of(self.tolerance);
        let mut bulk = state.bulk;
        *evaluations = evaluations.saturating_sub(1);
        let mut residual = self.residual(&bulk, active);
        let mut acceleration = Acceleration::none();
        let mut factors = 0;
        let mut before = T::of(f32::MAX);
        let mut converged;
        let mut start = T::of(0.0);
        let mut best = (T::of(f32::MAX), bulk);
        loop {
            if !state.is_factored() {
                state.factor = Rounded::of(&self.factor(&bulk, active));
                state.set_factored(true);
                factors += 1;
                *evaluations = evaluations.saturating_sub(FACTOR_COST);
                acceleration = Acceleration::none();
            }
            let newton_step = solve(&state.factor, &residual);
            // Square of the change of the bulk, in the norm of the energy.
            let decrement = along(&newton_step, &residual).magnitude();
            let size = along(&bulk, &bulk) + T::of(LEAST_SIZE * LEAST_SIZE);
            converged = decrement <= T::of(ACCEPTED * ACCEPTED) * size;
            if best.0 == T::of(f32::MAX) {
                start = decrement;
            }
            if decrement < best.0 {
                best = (decrement, bulk);
            }
            if !(decrement > tolerance * tolerance * size) || *evaluations == 0 {
                break;
            }
            // Both sides are squares.
            if decrement > T::of(SLOW * SLOW) * before
                && factors < FACTORS
                && *evaluations > FACTOR_COST
                && !acceleration.is_new()
            {
                state.set_factored(false);
                before = T::of(f32::MAX);
                continue;
            }
            before = decrement;
            let mut change = acceleration.accelerated(&bulk, &newton_step);
            // No iteration changes the bulk by more than a deep press does.
            let square = along(&change, &change);
            let largest = size + T::of(LONGEST * LONGEST);
            if square > largest {
                let share = (largest / square).magnitude().sqrt();
                change = change.map(|x| x * share);
            }
            let start = bulk;
            for _ in 0..HALVINGS {
                bulk = core::array::from_fn(|k| start[k] - change[k]);
                residual = self.residual(&bulk, active);
                *evaluations = evaluations.saturating_sub(1);
                // Accept a step that is not far beyond the minimum of the energy along this direction.
                if *evaluations == 0 || !(along(&newton_step, &residual) < T::of(-0.5) * decrement) {
                    break;
                }
                change = change.map(|x| x * T::of(0.5));
            }
        }
        if !converged {
            // The best iterate, with the contacts that belong to it; the last one where that is hardly better than the first one, since the
            // next steps would end there again.
            if best.0 < T::of(BETTER) * start {
                bulk = best.1;
                self.residual(&bulk, active);
            }
            state.set_factored(false);
        }
        state.bulk = bulk;
        converged
    }
}

/// Number of earlier iterations that the acceleration uses.
const DEPTH: usize = 3;

/// Memory of Anderson's acceleration: changes of the Newton step and of the bulk over the last iterations. Those of the step are
/// orthonormal.
struct Acceleration<T> {
    pairs: Vec<[Bulk<T>; 2], DEPTH>,
    last: Option<[Bulk<T>; 2]>,
}

impl<T: Elementary> Acceleration<T> {
    fn none() -> Self {
        Self { pairs: Vec::new(), last: None }
    }

    fn is_new(&self) -> bool {
        self.pairs.is_empty()
    }

    /// The accelerated step from `bulk`, to be subtracted.
    ///
    /// * `step`: Newton step by the factor of the stiffness
    fn accelerated(&mut self, bulk: &Bulk<T>, step: &Bulk<T>) -> Bulk<T> {
        if let Some([last_step, last_bulk]) = &self.last {
            if self.pairs.is_full() {
                self.pairs.clear();
            }
            let mut change: Bulk<T> = core::array::from_fn(|k| step[k] - last_step[k]);
            let mut moved: Bulk<T> = core::array::from_fn(|k| bulk[k] - last_bulk[k]);
            let total = along(&change, &change);
            for [old, by] in &self.pairs {
                let share = along(old, &change);
                for k in 0..MODES {
                    change[k] -= share * old[k];
                    moved[k] -= share * by[k];
                }
            }
            let left = along(&change, &change);
            if left > T::of(1e-4) * total {
                let one = T::of(1.0) / left.magnitude().sqrt();
                // Cannot fail: a full list was cleared above.
                let _ = self.pairs.push([change.map(|x| x * one), moved.map(|x| x * one)]);
            }
        }
        self.last = Some([*step, *bulk]);
        let mut accelerated = *step;
        for [old, by] in &self.pairs {
            let share = along(old, step);
            for k in 0..MODES {
                accelerated[k] -= share * (old[k] - by[k]);
            }
        }
        accelerated
    }
}

/// Two unit vectors that are perpendicular to `inward` and to each other.
fn tangents<T: Elementary>(inward: &Vector3<T>) -> (Vector3<T>, Vector3<T>) {
    let zero = T::of(0.0);
    // Perpendicular to `inward` and to y. It is not short: on the upper side of a body `inward` is not along y.
    let raw = Vector3::new(-inward.z, zero, inward.x);
    let length = (raw.dot(&raw) + T::of(1e-12)).magnitude().sqrt();
    let first = raw * (T::of(1.0) / length);
    (first, inward.cross(&first))
}

/// The matrix that maps a to r x (r x a) times a factor, for a rotation vector r.
fn double_cross<T: Elementary>(r: &Vector3<T>, factor: T) -> Matrix3<T> {
    let [x, y, z] = (r * factor).into();
    let [xx, yy, zz] = [x * r.x, y * r.y, z * r.z];
    let [xy, xz, yz] = [x * r.y, x * r.z, y * r.z];
    Matrix3::new(-(yy + zz), xy, xz, xy, -(xx + zz), yz, xz, yz, -(xx + yy))
}

/// The components of a rigid motion that are symmetric about the plane y = 0, (t_x, t_z, r_y), and antisymmetric, (t_y, r_x, r_z).
fn parts<T: Elementary>(m: &[T; 6]) -> [[T; 3]; 2] {
    [[m[0], m[2], m[4]], [m[1], m[3], m[5]]]
}

/// The six coefficients of either part.
fn numbers<T: Elementary>(lift: &[T; 12]) -> [[T; 6]; 2] {
    let half = |half: &[T]| half.first_chunk().copied().unwrap_or(zeros());
    let (even, odd) = lift.split_at(6);
    [half(even), half(odd)]
}

/// The second-order displacement that is the same for all patches, mm; see [`Law::lift`].
fn common_lift<T: Elementary>(law: &Law<T>, motion: &[T; 6]) -> Vector3<T> {
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
    Vector3::new(x, T::of(0.0), z)
}

/// Derivatives of [`common_lift`] over the rigid motion, along z and along x.
fn lift_slopes<T: Elementary>(law: &Law<T>, motion: &[T; 6]) -> [[T; 6]; 2] {
    let parts = parts(motion);
    law.lift.each_ref().map(|lift| {
        let [even, odd] = numbers(lift);
        let slope = |[a, b, c]: &[T; 3], n: &[T; 6]| -> [T; 3] {
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

/// Largest exponent of the stiffening, against overflow; far beyond that of any contact.
const MOST_GROWTH: f32 = 20.0;

/// Stiffening of the bulk: the energy rate q³ exp(growth q²) of the root q of the squash, see [`Numbers::squash`].
pub(crate) struct Stiffening<T> {
    /// Energy, mJ.
    pub energy: T,
    /// First derivative of the energy over q.
    pub first: T,
    /// First derivative over q, divided by q.
    per_size: T,
    /// Second derivative over q.
    second: T,
    /// Gradient of q over the bulk.
    pub direction: Bulk<T>,
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

/// The anchor of a patch on the body's surface, mm, from its place in the tangent plane; and the direction into the body there.
#[inline(always)]
pub(crate) fn anchor_at<T: Elementary>(body: &impl Surface<T>, anchor: [T; 2]) -> (Vector3<T>, Vector3<T>) {
    let at = point(body, anchor);
    let (_, inward) = body.overlap(&at);
    (at, inward)
}
