//! Files that can carry a diagnosis together.
//!
//! Main type: [`Checked`].

use crate::data::checks::{check, check_distinct};
use crate::data::own_columns::{at_reference, require};
use crate::data::runs::RunSet;
use crate::data::suspicions::suspicions;
use crate::data::yardsticks::check_units;
use crate::error::DiagnoseError;
use crate::laws::LawsFile;
use crate::schema::Caution;

/// What the runs of one file are that stand in another too.
const IN_CALIBRATION: &str = "are calibration runs too, and a run is used once";
const IN_FIT: &str = "were part of the fit, so that they are not held out";

/// A calibration and measured runs, both plausible by themselves and beside each other.
pub struct Checked<'a> {
    /// Runs without an effect, with columns of the user's own at their reference where they have none.
    pub calibration: RunSet,
    /// Runs to be explained.
    pub measured: &'a RunSet,
    /// What the reader did to the files, and what their readings call into doubt.
    pub cautions: Vec<Caution>,
}

impl<'a> Checked<'a> {
    /// Checks two files.
    ///
    /// # Errors
    /// [`DiagnoseError`] for files that cannot carry a diagnosis.
    pub fn new(calibration: &RunSet, measured: &'a RunSet, own: &LawsFile) -> Result<Self, DiagnoseError> {
        check(calibration)?;
        check(measured)?;
        check_distinct(measured, calibration, IN_CALIBRATION)?;
        require(measured, own)?;
        // A unit of one file alone is found beside the other one, before a column of the same file contradicts it.
        let mut cautions: Vec<Caution> = units([calibration, measured], "measured", false)?.into_iter().collect();
        cautions.extend(cautions_of(calibration, "calibration")?);
        cautions.extend(cautions_of(measured, "measured")?);
        Ok(Self { calibration: at_reference(calibration, own), measured, cautions })
    }

    /// Checks held-out runs beside these files; what is to be said of them.
    ///
    /// # Errors
    /// [`DiagnoseError`] for runs that these files have as well, or of other units.
    pub fn held_out(&self, set: &RunSet, own: &LawsFile) -> Result<Vec<Caution>, DiagnoseError> {
        for fitted in [self.measured, &self.calibration] {
            check_distinct(set, fitted, IN_FIT)?;
        }
        require(set, own)?;
        let unit = units([&self.calibration, set], "holdout", true)?;
        Ok(unit.into_iter().chain(cautions_of(set, "holdout")?).collect())
    }
}

/// What is said of the units of a set beside the calibration's.
fn units(sets: [&RunSet; 2], role: &str, judged: bool) -> Result<Option<Caution>, DiagnoseError> {
    let found = check_units(sets, ["calibration", role], judged)?;
    Ok(found.map(|caution| Caution { role: role.into(), ..caution }))
}

fn cautions_of(set: &RunSet, role: &str) -> Result<Vec<Caution>, DiagnoseError> {
    let all = set.cautions.iter().cloned().chain(suspicions(set)?);
    Ok(all.map(|caution| Caution { role: role.into(), ..caution }).collect())
}
