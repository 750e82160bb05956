//! Calibration and measured runs in each other's place.
//!
//! Calibration runs are taken under reference conditions, so that what drives an effect varies less in them than in the
//! measured runs. Where it is the other way round for some columns and for none as it ought to be, the files are diagnosed in
//! exchanged roles: a law along such a column is evidence that the calibration has an effect, and the files are refused.
//! Files that differ in no condition give no evidence either way.
//!
//! Main functions: [`varied_in_calibration`], [`look`].

use fingerpad_smooth::ReferenceCurves;

use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::laws::run_columns::{self, RunColumn};
use crate::laws::{Column, LawsFile};
use crate::schema::Caution;
use crate::statistics::tails::LEAST_GAIN;
use crate::verdict::calibrated::Calibrated;
use crate::verdict::checked::Checked;
use crate::verdict::decision::Decision;
use crate::verdict::options::Options;

/// Factor between two standard deviations over runs from which one set varies a column and the other does not.
const MUCH_MORE: f64 = 4.0;
/// Factor from which on the measured set varies a column more.
const MORE: f64 = 1.5;

/// Least standard deviation of a column of a user's own, as a share of its range.
const LEAST_OF_RANGE: f64 = 0.05;

fn spread(set: &RunSet, column: Column, by_logarithm: bool) -> Option<f64> {
    if !set.has(column) {
        return None;
    }
    let values = set.runs.iter().map(|r| r.value(column));
    let values: Vec<f64> =
        if by_logarithm { values.filter(|v| *v > 0.0).map(f64::ln).collect() } else { values.collect() };
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (n > 2.0).then(|| (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

/// Columns that the calibration varies and the measured runs do not; none where the measured runs vary another one more.
pub fn varied_in_calibration(calibration: &RunSet, measured: &RunSet, own: &LawsFile) -> Vec<Column> {
    let of_own = own.own_columns().into_iter().zip(&own.columns);
    let of_own = of_own.map(|(column, c)| (column, false, LEAST_OF_RANGE * (c.range[1] - c.range[0])));
    let condition = |(column, known): (Column, &RunColumn)| {
        known.condition.map(|(by_logarithm, least)| (column, by_logarithm, least))
    };
    let conditions = run_columns::law_columns().filter_map(condition);
    let mut out = Vec::new();
    for (column, by_logarithm, least) in conditions.chain(of_own) {
        let [a, b] = [calibration, measured].map(|set| spread(set, column, by_logarithm));
        let (Some(a), Some(b)) = (a, b) else { continue };
        if b > least && b > MORE * a {
            return Vec::new();
        }
        if a > least && a > MUCH_MORE * b {
            out.push(column);
        }
    }
    out
}

/// Diagnoses the files in exchanged roles where their conditions suggest an exchange; returns a caution, if any.
///
/// # Errors
/// [`DiagnoseError::Unusable`] where the calibration runs show a law along a column that only they vary.
pub fn look(
    Checked { calibration, measured, .. }: &Checked<'_>,
    reference: &ReferenceCurves,
    options: &Options,
) -> Result<Option<Caution>, DiagnoseError> {
    let columns = varied_in_calibration(calibration, measured, &options.own);
    if columns.is_empty() {
        return Ok(None);
    }
    let names = columns.iter().map(|c| c.name()).collect::<Vec<_>>().join(", ");
    let [c, m] = [calibration, measured].map(|set| set.path.display());
    let found = in_exchanged_roles(calibration, measured, reference, options, &columns);
    if let Some((law, gain)) = found {
        return Err(DiagnoseError::Unusable {
            path: calibration.path.clone(),
            problem: format!(
                "line {}: --calibration and --measured are exchanged, or these calibration runs have an effect: they vary \
                 {names}, which {m} does not, and taken as the measured runs they show {law} (gain {gain:.0}); runs under \
                 reference conditions belong to --calibration",
                calibration.runs[0].line
            ),
        });
    }
    Ok(Some(Caution {
        kind: "exchanged".into(),
        role: "calibration".into(),
        column: columns[0].name().into(),
        text: format!(
            "The calibration runs ({c}) vary {names}, and the measured runs ({m}) do not; it ought to be the other way \
             round: are --calibration and --measured exchanged? Calibration runs are taken under reference conditions."
        ),
    }))
}

/// The strongest law along one of the columns that the diagnosis in exchanged roles claims, with its gain.
fn in_exchanged_roles(
    calibration: &RunSet,
    measured: &RunSet,
    reference: &ReferenceCurves,
    options: &Options,
    columns: &[Column],
) -> Option<(&'static str, f64)> {
    let exchanged = Checked { calibration: measured.clone(), measured: calibration, cautions: Vec::new() };
    let calibrated = Calibrated::new(&exchanged, reference, options).ok()?;
    let Decision { verdict, selection, hypotheses, .. } =
        calibrated.basis(reference, &options.settings).decide(&calibrated.measured);
    if !verdict.is_claim() {
        return None;
    }
    let laws = selection.accepted().iter().zip(&hypotheses).map(|(active, h)| (active.law, h.gain_2ll));
    let along = laws.filter(|(law, gain)| *gain >= LEAST_GAIN && law.drivers.iter().any(|d| columns.contains(d)));
    along.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(law, gain)| (law.name, gain))
}
