//! Friction coefficients of a friction law by finite elements, on a finger whose parameters are held.

use super::{FeModel, IdentifyError, LawPoint, Query, Steady, evaluator::Missing, surrogate};
use fingerpad_fe::contact::RubberFriction;

/// Finite-element slides of one finger at the depths of a table, as a function of the friction law.
pub struct FeFriction<'r, 'a> {
    /// The finger.
    pub fe_model: &'r mut FeModel<'a>,
    /// Depth of every slot, offset included, mm.
    pub depths_mm: Vec<f64>,
    /// Factor on every stiffness.
    pub stiffness: f64,
    /// Elastic slip and regularisation.
    pub base: RubberFriction,
    /// Evaluations of all slots so far.
    pub evaluations: usize,
}

impl FeFriction<'_, '_> {
    /// This function on another model of the same finger, for a search in another thread.
    pub fn beside<'r, 'b>(&self, fe_model: &'r mut FeModel<'b>) -> FeFriction<'r, 'b> {
        FeFriction { fe_model, depths_mm: self.depths_mm.clone(), evaluations: 0, ..*self }
    }

    /// Steady states per slot (index of the depth) under a law.
    ///
    /// # Errors
    /// [`IdentifyError`].
    pub fn states(&mut self, law: &LawPoint) -> Result<Vec<Steady>, IdentifyError> {
        self.slides(law.friction(&self.base))
    }

    /// Steady states per slot under a law whose regularisation is given.
    ///
    /// # Errors
    /// [`IdentifyError`].
    pub fn slides(&mut self, law: RubberFriction) -> Result<Vec<Steady>, IdentifyError> {
        self.evaluations += 1;
        let query = |(slot, &depth_mm): (usize, &f64)| (slot, vec![Query { depth_mm, law, stiffness: self.stiffness }]);
        let queries: Vec<_> = self.depths_mm.iter().enumerate().map(query).collect();
        Ok(self.fe_model.steady(&queries)?.into_iter().flatten().collect())
    }

    /// F/N per depth under every law; none for a depth without a slide, which is treated by `missing`. Between two
    /// laws, no depth waits for another one.
    ///
    /// # Errors
    /// [`IdentifyError`] if it is not of one slide.
    pub fn found(&mut self, laws: &[LawPoint], missing: Missing) -> Result<Vec<Option<Vec<f64>>>, IdentifyError> {
        self.evaluations += laws.len();
        let slides = self.fe_model.slides(&self.queries(laws), missing)?;
        let coefficient = |slide: &Option<Steady>| slide.as_ref().map(Steady::friction_coefficient);
        Ok((0..laws.len()).map(|k| slides.iter().map(|of_depth| coefficient(&of_depth[k])).collect()).collect())
    }

    fn queries(&self, laws: &[LawPoint]) -> Vec<(usize, Vec<Query>)> {
        let query =
            |depth_mm, law: &LawPoint| Query { depth_mm, law: law.friction(&self.base), stiffness: self.stiffness };
        let depths = self.depths_mm.iter().enumerate();
        depths.map(|(slot, &depth_mm)| (slot, laws.iter().map(|law| query(depth_mm, law)).collect())).collect()
    }
}

impl surrogate::FrictionModel for FeFriction<'_, '_> {
    fn coefficients(&mut self, law: &LawPoint) -> Result<Vec<f64>, IdentifyError> {
        Ok(self.states(law)?.iter().map(Steady::friction_coefficient).collect())
    }

    /// No depth waits for another one between two laws.
    fn prepare(&mut self, laws: &[LawPoint]) {
        // Found states are in the cache; a slide that failed fails again when its value is computed, and is reported
        // there.
        let _ = self.fe_model.steady(&self.queries(laws));
    }
}
