//! Evidence behind a report: what figures, the corrected model and the confirmation by finite elements need.
//!
//! Main type: [`Evidence`].

use fingerpad_smooth::Parameters;

use crate::data::covariates::Correction;
use crate::data::own_columns::with_ranges_of;
use crate::data::runs::RunSet;
use crate::laws::LawsFile;
use crate::model::active_law::ActiveLaw;
use crate::model::random_effects::PerEffect;
use crate::report::driver_plot::DriverPlot;
use crate::report::regions::Maps;
use crate::report::traces::{ForceTrace, worst_traces};
use crate::statistics::calibration::Calibration;
use crate::verdict::calibrated::Calibrated;
use crate::verdict::concluded::Concluded;
use crate::verdict::cross_validation::noise_floor_n;
use crate::verdict::selected::Selected;

/// Fits, sets and maps of a diagnosis, beyond its report.
pub struct Evidence {
    /// Where simulation and measurement disagree, without and with the claimed effects.
    pub maps: Maps,
    /// For each claimed effect the residual without it, and the fitted law, along its driver.
    pub drivers: Vec<DriverPlot>,
    /// Forces of the worst runs beside the models.
    pub traces: Vec<ForceTrace>,
    /// The smooth model's parameters, fitted with the claimed laws.
    pub parameters: Parameters,
    /// The laws in force: the finger's own, then the claimed ones.
    pub laws: Vec<ActiveLaw>,
    /// The smooth model's parameters, fitted without the claimed laws.
    pub parameters_before: Parameters,
    /// The laws in force then: the finger's own.
    pub laws_before: Vec<ActiveLaw>,
    /// Laws of the user's own, with the ranges of their drivers in these sets.
    pub own: LawsFile,
    /// Noise, scatter and parameters of the calibration.
    pub calibration: Calibration,
    /// Variances between runs that calibration and reading errors explain.
    pub expected_variances: PerEffect,
    /// How columns with reading errors were corrected.
    pub corrections: Vec<Correction>,
    /// The measured runs as they were decided, columns with errors corrected, without a lag of their own.
    pub decided_set: RunSet,
    /// The calibration runs.
    pub calibration_set: RunSet,
    /// The held-out runs, or the measured ones where there are none; columns with errors corrected.
    pub checked_set: RunSet,
    /// Which of the two: `holdout` or `measured`.
    pub checked: String,
}

impl Evidence {
    /// The evidence of a conclusion.
    ///
    /// * `own`: laws of the user's file
    /// * `drivers`: the plots of the claimed effects, with the maps
    pub fn new(
        calibrated: &Calibrated,
        selected: &Selected<'_, '_>,
        concluded: Concluded,
        own: &LawsFile,
        (drivers, maps): (Vec<DriverPlot>, Maps),
    ) -> Self {
        let Selected { decision, .. } = *selected;
        let Concluded { verdict, held_out, calibration, .. } = concluded;
        let (null, full) = (&decision.selection.null, selected.fit(verdict));
        let floor_n = noise_floor_n(&decision.task, &null.parameters, &null.laws, &decision.expected_variances);
        let mut sets = vec![&calibrated.calibration_set, decision.set];
        sets.extend(held_out.as_ref());
        Self {
            own: with_ranges_of(own, &sets),
            traces: worst_traces(&decision.task, decision.set, &calibration.fit, [null, full], &floor_n, 3),
            maps,
            drivers,
            parameters: full.parameters,
            laws: full.laws.clone(),
            parameters_before: null.parameters,
            laws_before: null.laws.clone(),
            expected_variances: decision.expected_variances,
            decided_set: calibrated.measured.clone(),
            checked: if held_out.is_some() { "holdout" } else { "measured" }.into(),
            checked_set: held_out.unwrap_or_else(|| decision.set.clone()),
            calibration_set: calibrated.calibration_set.clone(),
            calibration,
            corrections: calibrated.corrections.clone(),
        }
    }

    /// Whether any law is claimed.
    pub fn has_claims(&self) -> bool {
        self.laws.len() > self.laws_before.len()
    }
}
