//! What the tissue of a pad remembers, where it relaxes.
//!
//! Main types: [`Memory`], [`PadMemory`]. Uses relaxation.

use core::fmt::Debug;

use nalgebra::Vector3;

use crate::math::Elementary;
use crate::relaxation::{BRANCHES, Clock, Perhaps, Relaxation, towards};

use super::vector::{Bulk, zeros};

/// Memory of the tissue in a [`super::PadState`]: `()` for none, [`PadMemory`] for branches. Sealed.
pub trait Memory<const P: usize, T>: Copy + Debug + PartialEq + sealed::Sealed {
    /// Its part in the equations of a step.
    #[doc(hidden)]
    type Weights: Perhaps<Weights<P, T>>;
    /// A finger that was never touched.
    #[doc(hidden)]
    fn fresh() -> Self;
    #[doc(hidden)]
    fn get(&mut self) -> Option<&mut PadMemory<P, T>>;
    #[doc(hidden)]
    fn weights(&self, relaxation: &Relaxation<T>) -> Self::Weights;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for () {}
    impl<const P: usize, T> Sealed for super::PadMemory<P, T> {}
}

/// The branches in the equations of a step.
#[derive(Clone, Copy)]
pub struct Weights<const P: usize, T> {
    /// s: 1 plus the sum of g_i e_i.
    pub(super) stiff: T,
    /// h of the bulk: the sum of g_i e_i nu_i, sqrt(mJ).
    pub(super) bulk: Bulk<T>,
    /// h of each patch along its normal, N.
    normal: [T; P],
    /// h of the stretch of each patch along the body's axes x and y, mm.
    across: [[T; 2]; P],
}

impl<const P: usize, T: Elementary> Weights<P, T> {
    /// h of a patch along its normal, N.
    #[inline(always)]
    pub(super) fn normal(&self, patch: usize) -> T {
        self.normal.get(patch).copied().unwrap_or(T::of(0.0))
    }

    /// h of the stretch of a patch along x and y, mm.
    #[inline(always)]
    pub(super) fn across_of(&self, patch: usize) -> [T; 2] {
        self.across.get(patch).copied().unwrap_or([T::of(0.0); 2])
    }

    /// h of the stretch of a patch, mm, in the tangent plane at its anchor.
    ///
    /// * `inward`: direction into the body there
    #[inline(always)]
    pub(super) fn across(&self, patch: usize, inward: &Vector3<T>) -> Vector3<T> {
        let [x, y] = self.across_of(patch);
        Vector3::new(x, y, -(inward.x * x + inward.y * y) / inward.z)
    }
}

impl<const P: usize, T: Copy> Perhaps<Self> for Weights<P, T> {
    #[inline(always)]
    fn get(&self) -> Option<&Self> {
        Some(self)
    }
}

/// What the branches of a pad remember.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct PadMemory<const P: usize, T = f32> {
    /// Force of the bulk over its coordinates, sqrt(mJ).
    bulk: [Bulk<T>; BRANCHES],
    /// Normal force of each patch, N.
    normal: [[T; P]; BRANCHES],
    /// Stretch of each patch along the body's axes x and y, mm.
    across: [[[T; 2]; P]; BRANCHES],
    pub(super) clock: Clock<T>,
    /// Bits of the branches that did not change when they were last moved on.
    settled: u32,
}

// SAFETY: `repr(C)` over 32-bit floats and a u32: no padding, and any bits are a value.
#[allow(unsafe_code)]
mod plain {
    use super::PadMemory;
    unsafe impl<const P: usize> bytemuck::Zeroable for PadMemory<P> {}
    unsafe impl<const P: usize> bytemuck::Pod for PadMemory<P> {}
}

impl<const P: usize, T: Elementary> Memory<P, T> for () {
    type Weights = ();
    fn fresh() -> Self {}
    #[inline(always)]
    fn get(&mut self) -> Option<&mut PadMemory<P, T>> {
        None
    }
    #[inline(always)]
    fn weights(&self, _: &Relaxation<T>) {}
}

impl<const P: usize, T: Elementary> Memory<P, T> for PadMemory<P, T> {
    type Weights = Weights<P, T>;

    fn fresh() -> Self {
        Self {
            bulk: [zeros(); BRANCHES],
            normal: [zeros(); BRANCHES],
            across: [[zeros(); P]; BRANCHES],
            clock: Clock::new(),
            settled: 0,
        }
    }

    fn get(&mut self) -> Option<&mut Self> {
        Some(self)
    }

    fn weights(&self, relaxation: &Relaxation<T>) -> Weights<P, T> {
        let shares = self.clock.shares(relaxation);
        let stiff = shares.iter().fold(T::of(1.0), |sum, share| sum + *share);
        let (mut bulk, mut normal, mut across) = (zeros(), [T::of(0.0); P], [[T::of(0.0); 2]; P]);
        for (i, share) in shares.into_iter().enumerate() {
            add(&mut bulk, &self.bulk[i], share);
            add(&mut normal, &self.normal[i], share);
            for (sum, stretch) in across.iter_mut().zip(&self.across[i]) {
                add(sum, stretch, share);
            }
        }
        Weights { stiff, bulk, normal, across }
    }
}

/// Adds a multiple of a vector.
fn add<const N: usize, T: Elementary>(sum: &mut [T; N], vector: &[T; N], factor: T) {
    for (sum, x) in sum.iter_mut().zip(vector) {
        *sum += factor * *x;
    }
}

impl<const P: usize, T: Elementary> PadMemory<P, T> {
    /// Moves the memory of the branches that are due on to the end of a step.
    ///
    /// * `bulk`: relaxed force of the bulk
    /// * `patch`: relaxed normal force, N, and stretch, mm, of a patch
    pub(super) fn move_on(
        &mut self,
        relaxation: &Relaxation<T>,
        bulk: &Bulk<T>,
        patches: usize,
        mut patch: impl FnMut(usize) -> (T, [T; 2]),
    ) {
        let due = self.clock.due(relaxation);
        let mut is_changed = [false; BRANCHES];
        let mut follow = |branch: usize, memory: &mut T, present: T, share: T| {
            let next = towards(*memory, present, share);
            is_changed[branch] |= next != *memory;
            *memory = next;
        };
        for index in 0..patches.min(P) {
            let (force, stretch) = patch(index);
            for (i, share) in due.iter().enumerate() {
                let Some(share) = *share else { continue };
                follow(i, &mut self.normal[i][index], force, share);
                for (memory, present) in self.across[i][index].iter_mut().zip(stretch) {
                    follow(i, memory, present, share);
                }
            }
        }
        for (i, share) in due.iter().enumerate() {
            let Some(share) = *share else { continue };
            for (memory, present) in self.bulk[i].iter_mut().zip(bulk) {
                follow(i, memory, *present, share);
            }
        }
        for (i, share) in due.iter().enumerate() {
            if share.is_some() {
                self.clock.moved_on(i);
                self.settled = self.settled & !(1 << i) | u32::from(!is_changed[i]) << i;
            }
        }
    }

    /// The finger moved: every memory may change again.
    pub(super) fn unsettle(&mut self) {
        self.settled = 0;
    }

    /// Whether no memory changes while the finger stands still.
    pub(super) fn is_settled(&self, relaxation: &Relaxation<T>) -> bool {
        let branches = relaxation.branches.iter().enumerate();
        branches.filter(|(_, branch)| branch.share != T::of(0.0)).all(|(i, _)| self.settled & (1 << i) != 0)
    }
}
