//! The bulk stiffness that the solver factorises.

use super::linear::NotPositiveDefinite;
use super::{
    Solver,
    equilibrium::go_on,
    increment::{Damping, SolveError, Stats, Watch},
    solver::FactorOrigin,
};
use crate::assembly::Configuration;
use crate::contact::{ContactState, Parts, Plane, Tangential};

impl Solver<'_> {
    /// Diagonal of the undeformed stiffness, which viscous forces and the rounding error of the residual are shares of.
    pub(super) fn diagonal_of_undeformed(&mut self) {
        if self.viscosity.is_empty() {
            let mut values = Vec::new();
            self.body.tangent(self.body.undeformed(), &mut values);
            let start = &self.body.dofs.pattern.column_start;
            self.viscosity = start[..start.len() - 1].iter().map(|&k| values[k]).collect();
            for &dof in &self.body.dofs.held {
                self.viscosity[dof] = 0.0;
            }
            let norm = self.viscosity.iter().map(|k| k * k).sum::<f64>().sqrt();
            self.rounding_n = f64::EPSILON * norm * self.surface.size_mm();
        }
    }

    /// Factorises the tangent at `at`.
    ///
    /// If the bulk alone is not stable (only the contact supports it), the factor gets a spring on every touching
    /// contact dof, which the contact problem subtracts again. If even that is indefinite, the stiffness is mixed with
    /// the undeformed body's.
    pub(super) fn refresh(
        &mut self,
        at: &Configuration,
        last: &ContactState,
        plane: &Plane,
        damping: Option<Damping>,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<(), SolveError> {
        self.factor_is_set = false;
        self.look_ahead(at, last, plane);
        let pattern = &self.body.dofs.pattern;
        self.body.tangent((at, self.tissue.as_ref()), &mut self.values);
        if let Some(damping) = damping {
            for (dof, k) in self.viscosity.iter().enumerate() {
                self.values[pattern.column_start[dof]] += damping.coefficient * k;
            }
        }
        self.shift.fill(0.0);
        go_on(watch, stats)?;
        let mut result = self.factor.factorise(pattern, &self.values);
        stats.factorisations += 1;
        if result.is_err() {
            result = self.factorise_with_springs(at, last, plane, stats, watch)?;
        }
        if result.is_err() {
            result = self.factorise_mixed(stats, watch)?;
        }
        self.factor_is_set = result.is_ok();
        self.factor_origin = damping.is_none().then(|| FactorOrigin {
            configuration: at.clone(),
            last: last.clone(),
            plane: *plane,
            tissue: self.tissue.clone(),
        });
        Ok(result?)
    }

    /// Factorises with increasingly stiff springs on the touching contact dofs.
    fn factorise_with_springs(
        &mut self,
        at: &Configuration,
        last: &ContactState,
        plane: &Plane,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<Result<(), NotPositiveDefinite>, SolveError> {
        let pattern = &self.body.dofs.pattern;
        let first = self.body.dofs.first_contact_dof;
        let positions = self.surface_positions(at);
        let evaluation =
            self.surface.evaluate(&self.friction, last, Parts::Followed, &positions, plane, Tangential::Law, false);
        // If the plane yields, nothing touches at a guess that does not follow it.
        let touching: Vec<usize> = evaluation
            .residual
            .iter()
            .zip(&last.nodes)
            .zip(&self.slots)
            .filter(|((force, before), _)| force.norm_squared() > 0.0 || before.normal_force_n > 0.0)
            .flat_map(|(_, slots)| slots.iter().flat_map(|&(s, _)| s..s + 3))
            .filter(|&j| !self.held[j])
            .collect();
        let touching: std::collections::BTreeSet<usize> = touching.into_iter().collect();
        let diagonal = |j: usize| pattern.column_start[first + j];
        let mean = touching.iter().map(|&j| self.values[diagonal(j)].abs()).sum::<f64>() / touching.len().max(1) as f64;
        let mut result = Ok(());
        for factor in [1.0, 10.0, 100.0] {
            for &j in &touching {
                self.values[diagonal(j)] += factor * mean - self.shift[j];
                self.shift[j] = factor * mean;
            }
            go_on(watch, stats)?;
            result = self.factor.factorise(pattern, &self.values);
            stats.factorisations += 1;
            if result.is_ok() {
                break;
            }
        }
        Ok(result)
    }

    /// Factorises with increasing shares of the undeformed body's stiffness.
    fn factorise_mixed(
        &mut self,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<Result<(), NotPositiveDefinite>, SolveError> {
        if self.undeformed_stiffness.is_empty() {
            self.body.tangent(self.body.undeformed(), &mut self.undeformed_stiffness);
        }
        let mut result = Ok(());
        for share in [0.1, 0.3, 1.0] {
            let mixed: Vec<f64> =
                self.values.iter().zip(&self.undeformed_stiffness).map(|(k, k0)| k + share * k0).collect();
            go_on(watch, stats)?;
            result = self.factor.factorise(&self.body.dofs.pattern, &mixed);
            stats.factorisations += 1;
            stats.mixed += 1;
            if result.is_ok() {
                break;
            }
        }
        Ok(result)
    }
}
