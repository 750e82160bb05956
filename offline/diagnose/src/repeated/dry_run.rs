//! What the files of a diagnosis can test, without a diagnosis.
//!
//! Main function: [`preflight_report`].

use fingerpad_formats::significant;

use crate::data::outliers::rails;
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::laws::LawsFile;
use crate::laws::run_columns;
use crate::report::calibrated_range::CalibratedRange;
use crate::report::exchanged::varied_in_calibration;
use crate::selection::scan::why_untestable;
use crate::verdict::checked::Checked;
use crate::verdict::cleaning::{FORCES, before_lift_off};

/// Lines on the ranges of both sets, on what the calibration does not cover, and on the laws that can be tested.
///
/// # Errors
/// [`DiagnoseError`] for sets that cannot carry a diagnosis.
pub fn preflight_report(calibration: &RunSet, measured: &RunSet, own: &LawsFile) -> Result<Vec<String>, DiagnoseError> {
    let checked = Checked::new(calibration, measured, own)?;
    let mut cautions = checked.cautions;
    for (role, set) in [("calibration", calibration), ("measured", measured)] {
        before_lift_off(set, role, &mut cautions);
    }
    let mut out: Vec<String> = cautions.into_iter().map(|c| c.text).collect();
    let exchanged = varied_in_calibration(calibration, measured, own);
    if !exchanged.is_empty() {
        let names: Vec<&str> = exchanged.iter().map(|c| c.name()).collect();
        out.push(format!(
            "The calibration runs vary {}, and the measured runs do not: are --calibration and --measured exchanged?",
            names.join(", ")
        ));
    }
    let of_own = own.own_columns().into_iter().zip(own.columns.iter().map(|c| c.unit.as_str()));
    for (column, unit) in run_columns::law_columns().map(|(c, known)| (c, known.unit)).chain(of_own) {
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
            out.push(format!(
                "{}: {} ends at {} N in {} rows of {} runs: readings at a sensor's rail",
                set.path.display(),
                FORCES[rail.channel],
                significant(rail.force_n, 4),
                rail.rows,
                rail.runs
            ));
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
