//! Gauss–Newton steps with a damped Hessian.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

/// Each damping with its step (H + damping diag H)⁻¹ g; ends where the damped Hessian is not positive definite.
///
/// The first step that lowers the objective is the one to take (Levenberg 1944, Marquardt 1963).
pub fn damped_steps<D: Dim>(
    hessian: &OMatrix<f64, D, D>,
    gradient: &OVector<f64, D>,
    dampings: impl IntoIterator<Item = f64>,
) -> impl Iterator<Item = (f64, OVector<f64, D>)>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D>,
{
    dampings.into_iter().map_while(move |damping| {
        let mut damped = hessian.clone();
        for k in 0..damped.nrows() {
            damped[(k, k)] *= 1.0 + damping;
        }
        Some((damping, damped.cholesky()?.solve(gradient)))
    })
}
