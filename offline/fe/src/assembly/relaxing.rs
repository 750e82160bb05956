//! Tissue that relaxes: branches at every integration point of the soft regions.
//!
//! Main types: [`TissueMemory`], [`TissueStep`]. `core/src/relaxation.rs` has the model; here u is the logarithmic strain `E`, phi the
//! isochoric energy, which is convex in `E` for every law that is stable, and phi'(u) the relaxed stress `T` of the undeformed frame. The
//! pressure stays elastic. In a step of dt the overstress q_i = g_i (T − nu_i) of a branch with the share g_i and the time tau_i becomes
//!
//! ```text
//! q_i <- e_i q_i + g_i c_i (T − T_before),     e_i = exp(−dt/tau_i),   c_i = exp(−dt/(2 tau_i))
//! ```
//!
//! so that the stress of the step is `s T − back` with constant `s` and `back`, the derivative of an energy: the tangent is symmetric. The
//! middle of the step, c_i, makes the error of second order in dt [Simo & Hughes 1998, section 10.3].
//!
//! **No work is gained**, at any dt: nu_i becomes the mean of T, T_before and nu_i with the weights 1 − c_i, c_i − e_i and e_i. With the
//! Bregman distance B of phi the work of the stress at the end of the step, less what is stored, is then at least
//! `sum g_i c_i B(E_before, E) >= 0`. A step without time is elastic; beyond 80 times tau_i a branch has forgotten.
//!
//! May use: material.

use fingerpad::Relaxation;
use wide::f64x8;

use super::Configuration;
use crate::element::{Constitutive, Gradient};
use crate::material::Sym;
use crate::material::logarithmic::Stretches;

/// A symmetric tensor at eight points, MPa.
type Lanes = [[f64; 8]; 6];

/// What the tissue remembers, at every eight points of the soft regions.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TissueMemory {
    branches: Vec<Memory>,
    /// Stress of the relaxed tissue in the undeformed frame.
    relaxed: Vec<Lanes>,
}

/// The memory of a branch.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Memory {
    share: f64,
    time_s: f64,
    overstress: Vec<Lanes>,
}

impl Memory {
    /// Factors of a step on the overstress and on the change of the relaxed stress.
    fn factors(&self, dt_s: f64) -> [f64; 2] {
        let parts = dt_s / self.time_s;
        [(-parts).exp(), self.share * (-0.5 * parts).exp()]
    }
}

/// The stress of a step: `stiffness` times that of the law, less `back` of each point.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TissueStep {
    stiffness: f64,
    back: Vec<Lanes>,
    stiffening: f64,
}

impl TissueMemory {
    /// Of undeformed tissue; None if it does not relax.
    ///
    /// * `points`: number of groups of eight points
    pub(super) fn new(relaxation: &Relaxation, points: usize) -> Option<Self> {
        let zero = vec![[[0.0; 8]; 6]; points];
        let branch = |b: &fingerpad::Branch<f64>| Memory { share: b.share, time_s: b.time_s, overstress: zero.clone() };
        let branches = relaxation.cast();
        let branches: Vec<Memory> = branches.branches().iter().filter(|b| b.share != 0.0).map(branch).collect();
        (!branches.is_empty()).then_some(Self { branches, relaxed: zero })
    }

    /// The stress of a step of `dt_s` (>= 0).
    pub fn step(&self, dt_s: f64) -> TissueStep {
        let of_step: Vec<[f64; 2]> = self.branches.iter().map(|branch| branch.factors(dt_s)).collect();
        self.with(1.0 + of_step.iter().map(|[_, share]| share).sum::<f64>(), &of_step)
    }

    /// The present stress, as a step without motion and time.
    pub fn present(&self) -> TissueStep {
        self.with(1.0, &vec![[1.0, 0.0]; self.branches.len()])
    }

    /// The stress of a step with these [`Memory::factors`] of the branches.
    fn with(&self, stiffness: f64, of_step: &[[f64; 2]]) -> TissueStep {
        let mut step = TissueStep { stiffness, back: vec![[[0.0; 8]; 6]; self.relaxed.len()], stiffening: stiffness };
        let [mut stress, mut relaxed_stress] = [0.0; 2];
        for (point, (back, relaxed)) in step.back.iter_mut().zip(&self.relaxed).enumerate() {
            let mut now = *relaxed;
            for (branch, [kept, share]) in self.branches.iter().zip(of_step) {
                let lanes = back.as_flattened_mut().iter_mut().zip(now.as_flattened_mut());
                for ((back, now), (relaxed, q)) in lanes.zip(both(relaxed, &branch.overstress[point])) {
                    *back += share * relaxed - kept * q;
                    *now += kept * q;
                }
            }
            let norm = |lanes: &Lanes| lanes.as_flattened().iter().map(|s| s * s).sum::<f64>();
            stress += norm(&now);
            relaxed_stress += norm(relaxed);
        }
        if relaxed_stress > 0.0 {
            step.stiffening = (stress / relaxed_stress).sqrt();
        }
        step
    }

    /// Moves on by a step of `dt_s` to the relaxed stress `relaxed` of each eight points.
    pub(super) fn move_on(&mut self, dt_s: f64, relaxed: Vec<Lanes>) {
        for branch in &mut self.branches {
            let [kept, share] = branch.factors(dt_s);
            for ((q, before), after) in branch.overstress.iter_mut().zip(&self.relaxed).zip(&relaxed) {
                for (q, (before, after)) in q.as_flattened_mut().iter_mut().zip(both(before, after)) {
                    *q = kept * *q + share * (after - before);
                }
            }
        }
        self.relaxed = relaxed;
    }

    /// Least and greatest time of a branch, s.
    pub fn times_s(&self) -> [f64; 2] {
        let times = self.branches.iter().map(|b| b.time_s);
        [times.clone().fold(f64::INFINITY, f64::min), times.fold(0.0, f64::max)]
    }
}

fn both<'a>(a: &'a Lanes, b: &'a Lanes) -> impl Iterator<Item = (&'a f64, &'a f64)> {
    a.as_flattened().iter().zip(b.as_flattened())
}

/// Positions of the body, and the stress of its step if the tissue relaxes.
#[derive(Clone, Copy)]
pub struct Deformed<'a> {
    /// Positions.
    pub at: &'a Configuration,
    /// None for tissue that does not relax, or is relaxed.
    pub step: Option<&'a TissueStep>,
}

impl<'a> From<&'a Configuration> for Deformed<'a> {
    fn from(at: &'a Configuration) -> Self {
        Self { at, step: None }
    }
}

impl<'a> From<(&'a Configuration, Option<&'a TissueStep>)> for Deformed<'a> {
    fn from((at, step): (&'a Configuration, Option<&'a TissueStep>)) -> Self {
        Self { at, step }
    }
}

/// The stress of a step at the points of a batch.
#[derive(Clone, Copy)]
pub(super) struct PointSteps<'a> {
    stiffness: f64,
    back: &'a [Lanes],
}

impl TissueStep {
    /// Stress at the start of the step, after its time without motion, over that of relaxed tissue: root mean squares over the soft
    /// regions. Of tissue without stress, that of the step's motion.
    pub fn stiffening(&self) -> f64 {
        self.stiffening
    }

    /// Of the `count` points from `first` on.
    pub(super) fn of(&self, first: usize, count: usize) -> PointSteps<'_> {
        PointSteps { stiffness: self.stiffness, back: &self.back[first..first + count] }
    }
}

/// A law in a step.
#[derive(Clone, Copy)]
pub(super) struct Relaxing<'a, L> {
    pub law: L,
    pub steps: PointSteps<'a>,
}

impl<L> Relaxing<'_, L> {
    fn back(&self, q: usize) -> Sym<f64x8> {
        self.steps.back[q].map(f64x8::new)
    }
}

impl<L: Constitutive> Constitutive for Relaxing<'_, L> {
    fn energy(&self, b: &[f64x8; 6], j: f64x8) -> f64x8 {
        self.law.energy(b, j)
    }
    fn stress(&self, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6] {
        self.law.stress(b, j)
    }
    fn moduli(&self, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        self.law.moduli(b, j)
    }
    fn volumetric(&self, ratio: f64x8) -> (f64x8, f64x8, f64x8) {
        self.law.volumetric(ratio)
    }
    fn energy_at(&self, q: usize, f: &Gradient, b: &[f64x8; 6], j: f64x8) -> f64x8 {
        let energy = self.law.energy(b, j) * f64x8::splat(self.steps.stiffness);
        energy - Stretches::new(f, b).energy(&self.back(q))
    }
    fn stress_at(&self, q: usize, f: &Gradient, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6] {
        let (law, back) = (self.law.stress(b, j), Stretches::new(f, b).stress(&self.back(q)));
        let stiffness = f64x8::splat(self.steps.stiffness);
        std::array::from_fn(|k| law[k] * stiffness - back[k])
    }
    fn moduli_at(&self, q: usize, f: &Gradient, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        let (tau, c) = self.law.moduli(b, j);
        let back = Stretches::new(f, b).moduli(&self.back(q));
        let stiffness = f64x8::splat(self.steps.stiffness);
        (
            std::array::from_fn(|k| tau[k] * stiffness - back.tau[k]),
            std::array::from_fn(|i| std::array::from_fn(|k| c[i][k] * stiffness - back.c[i][k])),
        )
    }
}
