//! What the tissue of a bed of springs remembers, where it relaxes.
//!
//! Main types: [`Memory`], [`BedMemory`]. Uses relaxation.
//!
//! The elements of a bed are its normal force and its springs; [`crate::relaxation`] has the equations of an element.
//!
//! **Normal force.** Its coordinate is the depth and its relaxed force N0(d). With branches it is T = s N0 − h, h the sum of g_i e_i nu_i.
//! A plane does not pull: where T is not positive the skin lags behind the plane and does not touch it, and comes back with N0 = h / s. The
//! strength follows the present pressure, the area does not: limits scale with (T / N0)^beta.
//!
//! **Springs.** A spring remembers displacements w_i. Its displacement u from the anchor pulls with v = s u − h, h the sum of g_i e_i w_i. Limit
//! and slip act on v as without branches, the force is that of v, and the anchor follows from u = (v + h) / s. Memory is linear, and the
//! law of force v − q v² comes after it: friction keeps to its limit whatever is remembered. The energy over the stiffness is
//!
//! ```text
//! v² / 2s − q v³ / 3s  +  1/2 sum g_i e_i w_i² − h² / 2s  −  q h³ / (3 s (s − 1)²)
//! ```
//!
//! **No work is gained** in any sequence of time steps. Let K be the matrix of the v that unit steps of u leave. It falls with the time since a
//! step, and its logarithm is convex in that time, as for every sum of falling exponentials with positive shares. Its inverse then has no
//! positive numbers beside the diagonal, and no negative sums of a row or a column (Kaluza 1928). For such a matrix the sum of f(v) du is not
//! negative for any rising f with f(0) = 0 (Willems and Brockett 1968). With q = 0 the energy above is exact, with q and one branch too; with
//! more branches its last term stands for their mean, and enters only the change of the normal force by a change of the stiffness with depth.
//! As without branches, a normal force below 0 counts as 0; near lift-off of a sheared contact that gives away up to 2e-5 of the work.
//! All 48 000 closed paths of the test lost at least 1.4 %.

use core::fmt::Debug;

use crate::math::{Elementary, Scalar};
use crate::relaxation::{BRANCHES, Clock, Perhaps, Relaxation};

/// Stiffness of the branches over that of the relaxed tissue, below which their part in the third order of the energy counts as 0.
const LEAST_MORE: f32 = 1e-9;
/// Pressure over that of the relaxed tissue from which on the skin touches.
const LEAST_PRESSURE: f32 = 1e-6;

/// Memory of the tissue in a [`crate::StateOf`]: `()` for none, [`BedMemory`] for branches. Sealed.
pub trait Memory<const M: usize, const P: usize, T>: Copy + Debug + Default + PartialEq + sealed::Sealed {
    /// Its part in the equations of a step.
    #[doc(hidden)]
    type Weights: Perhaps<Weights<T>>;
    #[doc(hidden)]
    fn get(&mut self) -> Option<&mut BedMemory<M, P, T>>;
    /// Time goes on, s; 0 for a step without one.
    #[doc(hidden)]
    fn go_on(&mut self, relaxation: Option<&Relaxation<T>>, dt_s: T) -> Self::Weights;
    /// The weights with which the memory that the last step left gives the forces of that step; and its s, for derivatives.
    #[doc(hidden)]
    fn of_last_step(&self, relaxation: Option<&Relaxation<T>>) -> (Self::Weights, T);
    /// The pressure at this relaxed normal force, N; none by type where nothing relaxes. In contact the memory follows the force.
    #[doc(hidden)]
    fn press(&mut self, weights: &Self::Weights, relaxed_n: T, exponent: T) -> Option<Pressure<T>>;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for () {}
    impl<const M: usize, const P: usize, T> Sealed for super::BedMemory<M, P, T> {}
}

/// The branches in the equations of a step.
#[derive(Clone, Copy)]
pub struct Weights<T> {
    /// g_i e_i.
    shares: [T; BRANCHES],
    /// Share of its way to the present by which each memory is moved on; 0 if it is too early.
    due: [T; BRANCHES],
    /// s: 1 plus the sum of g_i e_i.
    pub(crate) stiff: T,
    /// 1 / s.
    pub(crate) per_stiff: T,
}

impl<T: Copy> Perhaps<Self> for Weights<T> {
    #[inline(always)]
    fn get(&self) -> Option<&Self> {
        Some(self)
    }
}

/// Normal pressure over that of the relaxed tissue.
pub struct Pressure<T> {
    /// T / N0.
    pub(crate) share: T,
    /// Strength over that of the relaxed tissue; 0 without contact.
    pub(crate) strength: T,
}

impl<T: Scalar> Pressure<T> {
    /// Whether the skin touches the plane.
    #[inline(always)]
    pub(crate) fn touches(&self) -> bool {
        self.share >= T::of(LEAST_PRESSURE)
    }
}

/// What the branches of a bed remember.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct BedMemory<const M: usize, const P: usize = 1, T = f32> {
    /// Normal force, N.
    normal: [T; BRANCHES],
    /// Displacement of each spring, mm.
    stretch: [[[[T; 2]; BRANCHES]; P]; M],
    clock: Clock<T>,
}

// SAFETY: `repr(C)` over 32-bit floats: no padding, and any bits are a number.
#[allow(unsafe_code)]
mod plain {
    use super::BedMemory;
    unsafe impl<const M: usize, const P: usize> bytemuck::Zeroable for BedMemory<M, P> {}
    unsafe impl<const M: usize, const P: usize> bytemuck::Pod for BedMemory<M, P> {}
}

impl<const M: usize, const P: usize, T: Elementary> Default for BedMemory<M, P, T> {
    fn default() -> Self {
        let zero = T::of(0.0);
        Self { normal: [zero; BRANCHES], stretch: [[[[zero; 2]; BRANCHES]; P]; M], clock: Clock::new() }
    }
}

impl<const M: usize, const P: usize, T: Scalar> Memory<M, P, T> for () {
    type Weights = ();
    #[inline(always)]
    fn get(&mut self) -> Option<&mut BedMemory<M, P, T>> {
        None
    }
    #[inline(always)]
    fn go_on(&mut self, _: Option<&Relaxation<T>>, _: T) {}
    #[inline(always)]
    fn of_last_step(&self, _: Option<&Relaxation<T>>) -> ((), T) {
        ((), T::of(1.0))
    }
    #[inline(always)]
    fn press(&mut self, (): &(), _: T, _: T) -> Option<Pressure<T>> {
        None
    }
}

impl<const M: usize, const P: usize, T: Elementary> Memory<M, P, T> for BedMemory<M, P, T> {
    type Weights = Weights<T>;

    #[inline(always)]
    fn get(&mut self) -> Option<&mut Self> {
        Some(self)
    }

    #[inline(always)]
    fn go_on(&mut self, relaxation: Option<&Relaxation<T>>, dt_s: T) -> Weights<T> {
        let none = Relaxation::none();
        let relaxation = relaxation.unwrap_or(&none);
        self.clock.go_on(dt_s, relaxation);
        let (shares, due) = (self.clock.shares(relaxation), self.clock.due(relaxation));
        self.clock.restart(&due);
        Weights::new(shares, due.map(|share| share.unwrap_or(T::of(0.0))))
    }

    fn of_last_step(&self, relaxation: Option<&Relaxation<T>>) -> (Weights<T>, T) {
        let none = Relaxation::none();
        let relaxation = relaxation.unwrap_or(&none);
        let Weights { stiff, .. } = Weights::new(self.clock.shares(relaxation), [T::of(0.0); BRANCHES]);
        (Weights::new(self.clock.shares_left(relaxation), [T::of(0.0); BRANCHES]), stiff)
    }

    #[inline(always)]
    fn press(&mut self, weights: &Weights<T>, relaxed_n: T, exponent: T) -> Option<Pressure<T>> {
        let share = weights.stiff - weights.held(&self.normal) / relaxed_n;
        let mut pressure = Pressure { share, strength: T::of(0.0) };
        if pressure.touches() {
            weights.follow(&mut self.normal, relaxed_n);
            pressure.strength = (exponent * share.ln()).exp();
        }
        Some(pressure)
    }
}

impl<const M: usize, const P: usize, T: Scalar> BedMemory<M, P, T> {
    /// Without contact skin and springs come back as their branches let go.
    pub(crate) fn let_go(&mut self, weights: &Weights<T>) {
        let free = weights.held(&self.normal) * weights.per_stiff;
        weights.follow(&mut self.normal, free);
        for stretch in self.stretch.as_flattened_mut() {
            let free = weights.held_by(stretch).map(|held| held * weights.per_stiff);
            weights.stretch(stretch, free);
        }
    }

    /// What the branches of a spring, of a pair, hold.
    #[inline(always)]
    pub(crate) fn hold(&self, weights: &Weights<T>, spring: usize, of_pair: usize) -> Hold<T> {
        let none = [[T::of(0.0); 2]; BRANCHES];
        let stretch = self.stretch.get(spring).and_then(|pair| pair.get(of_pair)).unwrap_or(&none);
        let (mut shift, mut square) = ([T::of(-0.0); 2], [T::of(-0.0); 2]);
        for (share, stretch) in weights.shares.iter().zip(stretch) {
            for k in 0..2 {
                let held = *share * stretch[k];
                shift[k] += held;
                square[k] += held * stretch[k];
            }
        }
        Hold { stiff: weights.stiff, per_stiff: weights.per_stiff, shift, square }
    }

    /// The memory of a spring follows its displacement, mm.
    #[inline(always)]
    pub(crate) fn stretch(&mut self, weights: &Weights<T>, spring: usize, of_pair: usize, to: [T; 2]) {
        if let Some(stretch) = self.stretch.get_mut(spring).and_then(|pair| pair.get_mut(of_pair)) {
            weights.stretch(stretch, to);
        }
    }

    /// Whether a step can leave such clocks.
    pub(crate) fn is_consistent(&self) -> bool {
        self.clock.is_consistent()
    }
}

impl<T: Scalar> Weights<T> {
    #[inline(always)]
    fn new(shares: [T; BRANCHES], due: [T; BRANCHES]) -> Self {
        let stiff = shares.iter().fold(T::of(1.0), |sum, share| sum + *share);
        Self { shares, due, stiff, per_stiff: T::of(1.0) / stiff }
    }

    /// h of a remembered number.
    #[inline(always)]
    fn held(&self, memory: &[T; BRANCHES]) -> T {
        self.shares.iter().zip(memory).fold(T::of(-0.0), |sum, (share, memory)| sum + *share * *memory)
    }

    /// h of a spring, mm.
    #[inline(always)]
    fn held_by(&self, memory: &[[T; 2]; BRANCHES]) -> [T; 2] {
        [0, 1].map(|k| self.held(&memory.map(|stretch| stretch[k])))
    }

    #[inline(always)]
    fn follow(&self, memory: &mut [T; BRANCHES], to: T) {
        for (memory, share) in memory.iter_mut().zip(&self.due) {
            *memory += (to - *memory) * *share;
        }
    }

    #[inline(always)]
    fn stretch(&self, memory: &mut [[T; 2]; BRANCHES], to: [T; 2]) {
        for (memory, share) in memory.iter_mut().zip(&self.due) {
            *memory = [0, 1].map(|k| memory[k] + (to[k] - memory[k]) * *share);
        }
    }

    /// Energy of all springs along x and y over the stiffness, mm².
    ///
    /// * `pulled`: the part of v, as without branches
    /// * `held`: sums of [`Hold::energy`]
    #[inline(always)]
    pub(crate) fn energy(&self, [x, y]: [T; 2], [held_x, held_y, cubic]: [T; 3], odd: T) -> [T; 2] {
        let more = self.stiff - T::of(1.0);
        let mean = if more > T::of(LEAST_MORE) { T::of(1.0 / 3.0) * odd * cubic / (more * more) } else { T::of(0.0) };
        let half = T::of(0.5);
        [(x - mean) * self.per_stiff + half * held_x, y * self.per_stiff + half * held_y]
    }
}

/// What the branches of a spring hold.
pub(crate) struct Hold<T> {
    stiff: T,
    per_stiff: T,
    /// h, mm.
    shift: [T; 2],
    /// Sum of g_i e_i w_i², mm².
    square: [T; 2],
}

impl<T: Scalar> Hold<T> {
    /// The displacement v that pulls, at a displacement u from the anchor, mm.
    #[inline(always)]
    pub(crate) fn pulling(&self, u: [T; 2]) -> [T; 2] {
        [self.stiff * u[0] - self.shift[0], self.stiff * u[1] - self.shift[1]]
    }

    /// The displacement u from the anchor that pulls by v, mm.
    #[inline(always)]
    pub(crate) fn displacement(&self, v: [T; 2]) -> [T; 2] {
        [(v[0] + self.shift[0]) * self.per_stiff, (v[1] + self.shift[1]) * self.per_stiff]
    }

    /// Twice the energy of the branches along x and y that v leaves out, over the stiffness, mm², and the cube of h along x, mm³.
    #[inline(always)]
    pub(crate) fn energy(&self) -> [T; 3] {
        let [x, y] = self.shift;
        let square = x * x;
        [self.square[0] - square * self.per_stiff, self.square[1] - y * y * self.per_stiff, square * x]
    }
}

#[cfg(all(test, feature = "std"))]
mod tests;
