//! Columns of the model at a point: of its freedoms, of the random effects, of the laws' parameters.
//!
//! Main type: [`Tangents`], reused between fits that start nearby.

use nalgebra::DMatrix;

use super::base::FREEDOMS;
use super::fit::{Fit, Task, is_log, set_fitted, to_fitted};
use super::metric::Block;
use super::mixed::{PerRun, Scatter};
use super::walk::{Active, Modes, Nudge};

/// Columns of the baseline's freedoms and of the random effects, divided by the row noise.
#[derive(Clone)]
pub struct Tangents {
    /// One column per freedom.
    pub freedoms: Block,
    /// The random effects.
    pub scatter: Scatter,
}

impl Task<'_> {
    /// Difference of two predictions over row noise and step.
    pub fn column(&self, after: &[f64], before: &[f64], step: f64) -> Vec<f64> {
        after.iter().zip(before).zip(&self.sigma_n).map(|((a, b), s)| (a - b) / (s * step)).collect()
    }

    /// Columns at a fit.
    pub fn tangents_of(&self, fit: &Fit) -> Tangents {
        let prediction = self.predict_at(&fit.theta, &fit.laws, &fit.modes);
        self.tangents(&fit.theta, &fit.laws, &fit.modes, &prediction)
    }

    /// Columns at a point; `prediction` is that of the point.
    pub fn tangents(&self, theta: &[f64], laws: &[Active], modes: &Modes, prediction: &[f64]) -> Tangents {
        let scatter = self.run_columns(theta, laws, modes, prediction);
        let mut t = theta.to_vec();
        let plan = self.plan(laws, modes, Nudge::default());
        let path = plan.path(&self.reference.with(theta));
        let freedoms = (0..FREEDOMS)
            .map(|k| {
                let step = 2e-4;
                t[k] += step;
                let base = self.reference.with(&t);
                t[k] = theta[k];
                let after = if plan.path_depends_on(k) { plan.predict(&base) } else { plan.readings(&base, &path) };
                scatter.seen(self.column(&after, prediction, step))
            })
            .collect();
        Tangents { freedoms: Block::new(freedoms), scatter }
    }

    /// Columns of the random effects at a point.
    pub fn run_columns(&self, theta: &[f64], laws: &[Active], modes: &Modes, prediction: &[f64]) -> Scatter {
        let base = self.reference.with(theta);
        let nudged =
            |nudge: Nudge, step: f64| self.column(&self.plan(laws, modes, nudge).predict(&base), prediction, step);
        let mut columns = vec![
            nudged(Nudge { stiffness: 1.001, ..Nudge::default() }, 1e-3),
            nudged(Nudge { strength: 1.001, ..Nudge::default() }, 1e-3),
            nudged(Nudge { depth_mm: 2e-4, ..Nudge::default() }, 2e-4),
        ];
        for channel in 0..3 {
            columns.push(
                self.sigma_n.iter().enumerate().map(|(i, s)| if i % 3 == channel { 1.0 / s } else { 0.0 }).collect(),
            );
        }
        Scatter::new(self.layout.clone(), columns)
    }

    /// Information of the runs on the freedoms.
    pub fn information(&self, tangents: &Tangents, v: &PerRun) -> DMatrix<f64> {
        tangents.freedoms.weighed(&tangents.scatter.metric(v)).gram
    }

    /// Columns of the laws' parameters at a fit.
    pub fn law_columns_of(&self, fit: &Fit) -> Vec<Vec<f64>> {
        let prediction = self.predict_at(&fit.theta, &fit.laws, &fit.modes);
        self.law_columns(&fit.theta, &fit.laws, &fit.modes, &prediction)
    }

    /// Columns of the laws' parameters at a point.
    pub fn law_columns(&self, theta: &[f64], laws: &[Active], modes: &Modes, prediction: &[f64]) -> Vec<Vec<f64>> {
        let mut columns = Vec::new();
        let mut moved = laws.to_vec();
        for (i, active) in laws.iter().enumerate() {
            for k in 0..active.values.len() {
                let q = to_fitted(active, k);
                let mut step = if k < active.law.linear { 2e-3 * active.law.parameters[k].typical.abs() } else { 2e-3 };
                if !is_log(active, k) && k >= active.law.linear {
                    step = 0.02;
                }
                set_fitted(&mut moved[i], k, q + step);
                if to_fitted(&moved[i], k) == q {
                    step = -step;
                    set_fitted(&mut moved[i], k, q + step);
                }
                columns.push(self.column(&self.predict_at(theta, &moved, modes), prediction, step));
                moved[i] = active.clone();
            }
        }
        columns
    }
}
