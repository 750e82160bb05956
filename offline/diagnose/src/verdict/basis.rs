//! What a verdict on a set of runs rests on: the finger's calibration and what its own runs show of the model's form.
//!
//! Main type: [`Basis`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::covariates::Correction;
use crate::data::runs::RunSet;
use crate::selection::acceptance::SelectionSettings;
use crate::selection::discrepancy::ModelDiscrepancy;
use crate::statistics::calibration::Calibration;

/// What the sets of a finger are decided on: its calibration, and how exact that is.
pub struct Basis<'a> {
    /// The effect-free runs.
    pub effect_free: &'a RunSet,
    /// Reference curves.
    pub reference: &'a ReferenceCurves,
    /// The calibration, from whose small drift a decision starts.
    pub calibration: Calibration,
    /// How columns with reading errors were corrected.
    pub corrections: &'a [Correction],
    /// Level, seed and laws.
    pub settings: &'a SelectionSettings,
    /// The effect-free runs at their optimum.
    pub discrepancy: ModelDiscrepancy<'a>,
}

impl<'a> Basis<'a> {
    /// The basis of a calibration of these runs; arguments as the fields.
    pub fn new(
        effect_free: &'a RunSet,
        reference: &'a ReferenceCurves,
        calibration: Calibration,
        corrections: &'a [Correction],
        settings: &'a SelectionSettings,
    ) -> Self {
        let task = calibration.own_task(effect_free, reference);
        let fit = calibration.fit.clone();
        let derivatives = task.derivatives_of(&fit);
        let discrepancy = ModelDiscrepancy { task, fit, derivatives };
        Self { effect_free, reference, calibration, corrections, settings, discrepancy }
    }
}
