//! What the files of a diagnosis can tell, without one.
//!
//! Main function: [`understand`].

use crate::data::checks::{check, check_pair};
use crate::data::outliers::rails;
use crate::data::own_columns::require;
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::laws::LawsFile;
use crate::selection::scan::why_untestable;
use crate::verdict::calibrated_range::CalibratedRange;
use crate::verdict::regions::COLUMNS;

/// Lines on the ranges of both sets, on what the calibration does not cover, and on the laws that can be tested.
///
/// Errors: [`DiagnoseError`] for sets that cannot carry a diagnosis.
pub fn understand(calibration: &RunSet, measured: &RunSet, own: &LawsFile) -> Result<Vec<String>, DiagnoseError> {
    check(calibration)?;
    check(measured)?;
    check_pair(calibration, measured)?;
    require(measured, own)?;
    let mut out = Vec::new();
    let of_own = own.own_columns().into_iter().zip(own.columns.iter().map(|c| c.unit.as_str()));
    for (column, unit) in COLUMNS.into_iter().chain(of_own) {
        let range = |set: &RunSet| {
            let values: Vec<f64> = set.runs.iter().map(|r| r.value(column)).filter(|v| v.is_finite()).collect();
            if values.is_empty() || !set.has(column) {
                return "not recorded".to_owned();
            }
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{low:.3} to {high:.3} {unit}")
        };
        out.push(format!("{}: calibration {}; measured {}", column.name(), range(calibration), range(measured)));
    }
    for set in [calibration, measured] {
        for rail in rails(set) {
            out.push(format!("{}: {rail:?}: readings at a sensor's rail", set.path.display()));
        }
    }
    out.extend(CalibratedRange::of(calibration).cautions(measured).into_iter().map(|c| c.text));
    for law in own.with_library() {
        out.push(match why_untestable(law, measured) {
            None => format!("{}: can be tested", law.name),
            Some(reason) => format!("{}: cannot be tested: {reason}", law.name),
        });
    }
    Ok(out)
}
