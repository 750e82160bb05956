//! The measured runs of a finger beside its calibration: both files cleaned, the lag of the instrument taken out, columns with reading
//! errors corrected.
//!
//! Main type: [`Calibrated`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::covariates::{Correction, CovariateError};
use crate::data::lag::{Lag, with_lag};
use crate::data::outliers::{Flags, count, without};
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::schema::Caution;
use crate::selection::acceptance::SelectionSettings;
use crate::selection::finger_laws::with_finger_laws;
use crate::statistics::calibration::{Calibration, calibrate};
use crate::statistics::fit::FitStart;
use crate::statistics::lag::{LagEstimate, estimate};
use crate::verdict::basis::Basis;
use crate::verdict::checked::Checked;
use crate::verdict::cleaning::{before_lift_off, few_runs_cautions, off_rails, spike_caution, spikes_of};
use crate::verdict::options::Options;

/// Rounds in which the spikes of a calibration are looked for: spikes make the noise look larger than it is.
const ROUNDS: usize = 4;

/// A calibrated finger with the runs that are to be explained.
pub struct Calibrated {
    /// Runs without an effect, cleaned.
    pub calibration_set: RunSet,
    /// Runs to be explained, cleaned, with columns corrected.
    pub measured: RunSet,
    /// The calibration, the finger's own laws in it.
    pub calibration: Calibration,
    /// The lag of the forces in the calibration, which the sets above have.
    pub lag: Option<LagEstimate>,
    /// How columns with reading errors were corrected.
    pub corrections: Vec<Correction>,
    /// What was left out.
    pub cautions: Vec<Caution>,
}

impl Calibrated {
    /// Cleans both files and calibrates the finger.
    ///
    /// # Errors
    /// [`DiagnoseError`] where too little is left, or the calibration has no likelihood.
    pub fn new(checked: &Checked<'_>, reference: &ReferenceCurves, options: &Options) -> Result<Self, DiagnoseError> {
        let mut cautions: Vec<Caution> = few_runs_cautions(&checked.calibration, checked.measured).collect();
        let set = before_lift_off(&checked.calibration, "calibration", &mut cautions);
        let set = off_rails(&set, "calibration", &mut cautions)?;
        let (calibration_set, calibration, flagged) = without_spikes(&set, reference);
        cautions.extend(spike_caution("calibration", &flagged, &set));
        let (calibration_set, calibration, lag) = without_lag(calibration_set, calibration, reference);
        let calibration = with_finger_laws(&calibration_set, reference, calibration, &options.settings);
        if !calibration.fit.minus_2ll.is_finite() {
            let (path, problem) = (calibration_set.path, "the likelihood is not finite".into());
            return Err(DiagnoseError::Calibration { path, problem });
        }
        let measured = cleaned(checked.measured, "measured", lag, &calibration, reference, &mut cautions)?;
        let corrections = learn_corrections(&measured, &options.errors);
        let measured = corrected(measured, &corrections);
        Ok(Self { calibration_set, measured, calibration, lag, corrections, cautions })
    }

    /// The lag of the instrument; zero where none was found.
    pub fn lag(&self) -> Lag {
        lag_of(self.lag)
    }

    /// Held-out runs, cleaned and corrected as the measured ones.
    ///
    /// # Errors
    /// [`DiagnoseError`] where too little is left.
    pub fn held_out(
        &self,
        set: &RunSet,
        reference: &ReferenceCurves,
        cautions: &mut Vec<Caution>,
    ) -> Result<RunSet, DiagnoseError> {
        let clean = cleaned(set, "holdout", self.lag, &self.calibration, reference, cautions)?;
        Ok(corrected(clean, &self.corrections))
    }

    /// What a set of this finger is decided on.
    pub fn basis<'a>(&'a self, reference: &'a ReferenceCurves, settings: &'a SelectionSettings) -> Basis<'a> {
        Basis::new(&self.calibration_set, reference, self.calibration.clone(), &self.corrections, settings)
    }
}

/// The calibration runs without spikes, their calibration, and which readings were spikes.
fn without_spikes(set: &RunSet, reference: &ReferenceCurves) -> (RunSet, Calibration, Flags) {
    let mut clean = set.clone();
    let mut found = calibrate(&clean, reference, &[]);
    let mut flagged = Flags::new();
    for _ in 0..ROUNDS {
        let now = spikes_of(set, &found, reference);
        if now == flagged || (flagged.is_empty() && count(&now) == 0) {
            break;
        }
        clean = without(set, &now);
        found = calibrate(&clean, reference, &[]);
        flagged = now;
    }
    (clean, found, flagged)
}

/// The calibration runs with the lag that they show, and their calibration with it.
fn without_lag(
    set: RunSet,
    calibration: Calibration,
    reference: &ReferenceCurves,
) -> (RunSet, Calibration, Option<LagEstimate>) {
    let start = FitStart::from(&calibration.fit);
    let lag = estimate(&set, &calibration, reference, &Calibration::before(reference), start);
    match lag {
        None => (set, calibration, None),
        Some(found) => {
            let set = with_lag(&set, found.lag);
            let calibration = calibrate(&set, reference, &[]);
            (set, calibration, lag)
        }
    }
}

fn lag_of(lag: Option<LagEstimate>) -> Lag {
    lag.map_or_else(Lag::default, |found| found.lag)
}

/// A set measured after the calibration, with its lag, without lift-offs, readings at a rail and spikes.
fn cleaned(
    set: &RunSet,
    role: &str,
    lag: Option<LagEstimate>,
    calibration: &Calibration,
    reference: &ReferenceCurves,
    cautions: &mut Vec<Caution>,
) -> Result<RunSet, DiagnoseError> {
    let pressed = before_lift_off(set, role, cautions);
    let off = off_rails(&with_lag(&pressed, lag_of(lag)), role, cautions)?;
    let flagged = spikes_of(&off, calibration, reference);
    cautions.extend(spike_caution(role, &flagged, &off));
    Ok(without(&off, &flagged))
}

/// The corrections of columns with declared errors, as learnt on a measured set.
fn learn_corrections(set: &RunSet, errors: &[CovariateError]) -> Vec<Correction> {
    errors.iter().filter_map(|e| Correction::learn(set, *e)).collect()
}

fn corrected(mut set: RunSet, corrections: &[Correction]) -> RunSet {
    corrections.iter().for_each(|c| c.apply(&mut set));
    set
}
