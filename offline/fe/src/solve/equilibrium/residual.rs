//! The residual: internal forces, contact forces, and driven forces that are off their targets.

use super::{Increment, Iterate};
use crate::contact::Tangential;
use crate::solve::Solver;
use crate::solve::increment::WRENCH_OF;

/// The residual, N.
pub(in crate::solve) struct Residual {
    /// All dofs.
    pub total: Vec<f64>,
    /// The contact's own part, contact dofs.
    pub contact: Vec<f64>,
    /// Norm of `total` and of the imbalance of driven forces.
    pub norm: f64,
    /// Contact force that `norm` is held against: the norm of `contact`, or the least force that the tolerance can resolve.
    pub reference: f64,
}

impl Solver<'_> {
    /// The residual at an iterate.
    pub(super) fn residual(&self, iterate: &Iterate, increment: &Increment) -> Residual {
        let Iterate { at, plane, internal, .. } = iterate;
        let first = self.body.dofs.first_contact_dof;
        let positions = self.surface_positions(at);
        let parts = iterate.parts();
        let evaluation =
            self.surface.evaluate(&self.friction, increment.last, parts, &positions, plane, Tangential::Law, false);
        let mut contact = vec![0.0; internal.len() - first];
        for (f, slots) in evaluation.residual.iter().zip(&self.slots) {
            for &(s, weight) in slots {
                for k in (0..3).filter(|&k| !self.held[s + k]) {
                    contact[s + k] += weight * f[k];
                }
            }
        }
        let mut total = internal.clone();
        for (total, f) in total[first..].iter_mut().zip(&contact) {
            *total += f;
        }
        let mut sum: f64 = total.iter().map(|r| r * r).sum();
        for imbalance in imbalance(&evaluation.wrench, &increment.force_target, self.surface.size_mm()) {
            sum += imbalance * imbalance;
        }
        let contact_norm = contact.iter().map(|f| f * f).sum::<f64>().sqrt();
        let least = self.settings.force_floor_n.max(self.rounding_n / self.settings.tolerance);
        Residual { total, contact, norm: sum.sqrt(), reference: contact_norm.max(least) }
    }
}

/// Differences of driven forces and moments from their targets, N; moments over `length_mm`.
pub(in crate::solve) fn imbalance(wrench: &[f64; 6], target: &[Option<f64>; 6], length_mm: f64) -> [f64; 6] {
    std::array::from_fn(|k| {
        let component = WRENCH_OF[k];
        let length = if component < 3 { 1.0 } else { length_mm };
        target[k].map_or(0.0, |target| (wrench[component] - target) / length)
    })
}
