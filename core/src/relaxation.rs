//! Tissue that relaxes: branches of a generalised Maxwell model on every elastic element of a finger.
//!
//! Main types: [`Relaxation`], [`Branch`], [`Clock`]. Uses error and math.
//!
//! An element with the convex energy phi(u) of its own coordinate u has the relaxed force phi'(u). Branch i adds the share g_i of that
//! stiffness and forgets with the time tau_i. It remembers a force nu_i:
//!
//! ```text
//! E     = phi(u) + sum_i g_i [phi(u) + phi*(nu_i) − nu_i u]        nu_i' = (phi'(u) − nu_i) / tau_i
//! force = phi'(u) + sum_i g_i (phi'(u) − nu_i)
//! ```
//!
//! phi* is the convex conjugate of phi; the bracket is never negative. A time t after the memory was last moved on, the branch acts with
//! e_i = exp(−t / tau_i):
//!
//! ```text
//! E     = phi(u) + sum_i g_i e_i [phi(u) + phi*(nu_i) − nu_i u]
//! force = s phi'(u) − h,       s = 1 + sum_i g_i e_i,       h = sum_i g_i e_i nu_i
//! ```
//!
//! **No work is gained**, whatever the time steps: at fixed u and nu the energy falls with e_i; at fixed e_i the force at the end of a step
//! is the slope of a convex energy, so that it does at least the work by which the energy rises; and moving the memory on to
//! nu_i + (phi'(u) − nu_i)(1 − e_i) with e_i = 1 does not raise the energy, since the bracket is convex in nu_i and zero at phi'(u).
//!
//! Sources: Simo and Hughes, *Computational Inelasticity* (1998), section 10 (branches and their integration); Pawluk and Howe, *J. Biomech.
//! Eng.* 121 (1999) 178 (the times of a fingertip).

use crate::Error;
use crate::error::Field;
use crate::math::{Elementary, Scalar};

/// Most branches of a finger.
pub const BRANCHES: usize = 3;
/// Largest share, and least and largest time, s, of a branch.
const SHARE_MAX: f32 = 100.0;
const TIME_S: [f32; 2] = [1e-5, 1e5];
/// Beyond this many times its own a branch has forgotten.
const FORGOTTEN: f32 = 80.0;
/// The memory of a branch is moved on after this part of its time at the earliest. In single precision it would stop if it was moved on by
/// less.
const PART: f32 = 1.0 / 1024.0;

/// One branch of the tissue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Branch<T = f32> {
    /// Its stiffness over that of the relaxed tissue.
    pub share: T,
    /// The time in which it forgets, s.
    pub time_s: T,
}

/// The branches of a finger's tissue; a share of 0 marks one that is not used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Relaxation<T = f32> {
    pub(crate) branches: [Branch<T>; BRANCHES],
}

// SAFETY: `repr(C)` structs of 32-bit floats: no padding, and any bits are a number.
#[allow(unsafe_code)]
mod plain {
    use super::{Branch, Relaxation};
    unsafe impl bytemuck::Zeroable for Branch {}
    unsafe impl bytemuck::Pod for Branch {}
    unsafe impl bytemuck::Zeroable for Relaxation {}
    unsafe impl bytemuck::Pod for Relaxation {}
}

impl Relaxation {
    /// A human fingertip. The times are those of Pawluk and Howe (1999). **The shares are assumed**: no text at hand gives them.
    pub const HUMAN_ASSUMED: Self = Self {
        branches: [
            Branch { share: 1.0, time_s: 4e-3 },
            Branch { share: 0.6, time_s: 70e-3 },
            Branch { share: 0.6, time_s: 1.4 },
        ],
    };

    /// The branches, in any order.
    ///
    /// # Errors
    /// [`Error::Shape`] for more than [`BRANCHES`]; [`Error::Range`] for a share outside 0 to 100 and a time outside 10 us to 1e5 s.
    pub fn new(branches: &[Branch]) -> Result<Self, Error> {
        let mut out = Self::none();
        if branches.len() > BRANCHES {
            return Err(Error::Shape { elements: branches.len() as u32, nodes: BRANCHES as u32 });
        }
        for (slot, branch) in out.branches.iter_mut().zip(branches) {
            *slot = *branch;
        }
        out.check()
    }

    /// The branches if all numbers are within their ranges.
    pub(crate) fn check(self) -> Result<Self, Error> {
        for (index, Branch { share, time_s }) in self.branches.iter().enumerate() {
            let bad = |what, value| Err(Error::Range { what, index: index as u16, value });
            if !(*share >= 0.0 && *share <= SHARE_MAX) {
                return bad(Field::RelaxationShare, *share);
            }
            if !time_s.is_between(TIME_S[0], TIME_S[1]) {
                return bad(Field::RelaxationTime, *time_s);
            }
        }
        Ok(self)
    }

    /// The same in another scalar.
    pub fn cast<U: Scalar>(&self) -> Relaxation<U> {
        Relaxation { branches: self.branches.map(|b| Branch { share: U::of(b.share), time_s: U::of(b.time_s) }) }
    }
}

impl<T: Scalar> Relaxation<T> {
    /// Tissue that does not relax.
    pub fn none() -> Self {
        Self { branches: [Branch { share: T::of(0.0), time_s: T::of(1.0) }; BRANCHES] }
    }

    /// The branches.
    pub fn branches(&self) -> &[Branch<T>; BRANCHES] {
        &self.branches
    }

    /// Whether it has a branch.
    pub fn is_some(&self) -> bool {
        self.branches.iter().any(|branch| branch.share != T::of(0.0))
    }
}

/// A value, or none, by its type.
pub trait Perhaps<X>: Copy {
    #[doc(hidden)]
    fn get(&self) -> Option<&X>;
}

impl<X> Perhaps<X> for () {
    #[inline(always)]
    fn get(&self) -> Option<&X> {
        None
    }
}

/// How far the memory of the branches lies behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub(crate) struct Clock<T> {
    /// Time since each memory was moved on, s.
    since_s: [T; BRANCHES],
    /// exp(−since / time).
    kept: [T; BRANCHES],
}

impl<T: Scalar> Clock<T> {
    /// Whether it is one that time leads to.
    pub fn is_consistent(&self) -> bool {
        self.since_s.iter().all(|since| *since >= T::of(0.0))
            && self.kept.iter().all(|kept| *kept >= T::of(0.0) && *kept <= T::of(1.0))
    }
}

impl<T: Elementary> Clock<T> {
    pub fn new() -> Self {
        Self { since_s: [T::of(0.0); BRANCHES], kept: [T::of(1.0); BRANCHES] }
    }

    /// Time goes on, s; 0 for a step without one.
    pub fn go_on(&mut self, dt_s: T, relaxation: &Relaxation<T>) {
        for ((since, kept), branch) in self.since_s.iter_mut().zip(&mut self.kept).zip(&relaxation.branches) {
            *since += dt_s;
            let parts = *since / branch.time_s;
            *kept = if parts > T::of(FORGOTTEN) { T::of(0.0) } else { (-parts).exp() };
        }
    }

    /// g_i e_i of each branch.
    #[inline(always)]
    pub fn shares(&self, relaxation: &Relaxation<T>) -> [T; BRANCHES] {
        core::array::from_fn(|i| relaxation.branches[i].share * self.kept[i])
    }

    /// The same for memories that may have been moved on since: those by their whole share.
    pub fn shares_left(&self, relaxation: &Relaxation<T>) -> [T; BRANCHES] {
        let zero = T::of(0.0);
        core::array::from_fn(|i| {
            relaxation.branches[i].share * if self.since_s[i] > zero { self.kept[i] } else { T::of(1.0) }
        })
    }

    /// The share of its way to the present force by which each memory is to be moved on now; none if it is too early.
    pub fn due(&self, relaxation: &Relaxation<T>) -> [Option<T>; BRANCHES] {
        core::array::from_fn(|i| {
            let Branch { share, time_s } = relaxation.branches[i];
            let due = share != T::of(0.0) && self.since_s[i] >= time_s * T::of(PART);
            due.then(|| T::of(1.0) - self.kept[i])
        })
    }

    /// The memories that are due are moved on. What is kept of a step stays until the next one, for derivatives.
    #[inline(always)]
    pub fn restart(&mut self, due: &[Option<T>; BRANCHES]) {
        for (since, due) in self.since_s.iter_mut().zip(due) {
            if due.is_some() {
                *since = T::of(0.0);
            }
        }
    }

    /// The memory of a branch was moved on.
    pub fn moved_on(&mut self, branch: usize) {
        (self.since_s[branch], self.kept[branch]) = (T::of(0.0), T::of(1.0));
    }
}

/// Part of a memory that rounding of the present force may be, and that is no change.
const ROUNDING: f32 = 2e-6;

/// A remembered force moved on by a share of its way to the present one. The last bits of the way, which rounding would leave, it goes at once.
#[inline(always)]
pub(crate) fn towards<T: Scalar>(memory: T, present: T, share: T) -> T {
    let away = present - memory;
    if away.magnitude() <= T::of(ROUNDING) * memory.magnitude() {
        return memory;
    }
    let next = memory + away * share;
    if next == memory { present } else { next }
}
