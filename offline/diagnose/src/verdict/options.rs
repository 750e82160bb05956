//! Choices of a diagnosis.

use crate::data::covariates::CovariateError;
use crate::laws::LawsFile;
use crate::plan::candidate_designs::PlanConstraints;
use crate::selection::acceptance::SelectionSettings;

/// Choices of a diagnosis beside the data.
#[derive(Clone, Debug)]
pub struct Options {
    /// Level and seed of the tests.
    pub settings: SelectionSettings,
    /// Declared errors of state columns.
    pub errors: Vec<CovariateError>,
    /// Name of the model file that the baseline starts from.
    pub model: String,
    /// What the next experiment may do.
    pub plan: PlanConstraints,
    /// Laws of the user's own; `settings.laws` has them as well.
    pub own: LawsFile,
}
