//! The finger's own laws: what the effect-free runs themselves follow beside the smooth model.
//!
//! A finger may relax, age or depend on speed in every file. The calibration shows it, and the baseline has no parameter for it:
//! without a law of its own it would weaken all evidence as an error of form, and would be taken for a missing effect of the
//! measured runs, or stand in the place of one.
//!
//! Main function: [`with_finger_laws`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::runs::RunSet;
use crate::laws::{Column, Law};
use crate::selection::acceptance::SelectionSettings;
use crate::selection::forward::{Selection, select};
use crate::statistics::calibration::{Calibration, calibrate};

/// Least gain in 2 log likelihood of a law of the finger.
const LEAST_GAIN: f64 = 20.0;

/// Whether a law may be the finger's own. What depends on depth and direction alone is in the baseline's parameters.
fn is_habit(law: &Law) -> bool {
    let of_time =
        |column: &Column| matches!(column, Column::ContactTime | Column::Dwell | Column::Slide | Column::Speed);
    !law.drivers.is_empty() && law.drivers.iter().all(of_time)
}

/// Adds the laws that the calibration runs follow to their calibration.
pub fn with_finger_laws(
    set: &RunSet,
    reference: &ReferenceCurves,
    calibration: Calibration,
    settings: &SelectionSettings,
) -> Calibration {
    let mut habits: Vec<&'static Law> = settings.laws.iter().copied().filter(|law| is_habit(law)).collect();
    // Where all holds are equal, a peak that fades along the slide is the same as ageing, and only that says what other
    // holds do.
    if set.has(Column::Dwell) {
        habits.retain(|law| law.family != "static_peak");
    }
    let task = calibration.own_task(set, reference);
    let Selection { fit, evidence, .. } = select(&task, set, &habits, None, settings);
    let gains = evidence.iter().map(|e| e.gain_2ll);
    let (laws, law_gains_2ll): (Vec<_>, Vec<_>) =
        fit.laws.into_iter().zip(gains).filter(|(_, gain)| *gain >= LEAST_GAIN).unzip();
    if laws.is_empty() { calibration } else { Calibration { law_gains_2ll, ..calibrate(set, reference, &laws) } }
}
