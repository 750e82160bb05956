//! From a table to its diagnosis, step by step.
//!
//! Main function: [`diagnose`].

use fingerpad_fe::experiment::{Config, ConfigError};
use fingerpad_fe::load_path::Clearance;

use super::corrected::CorrectedFinger;
use super::effects::{EFFECTS, Effect, Parameter, Values, effect_named};
use super::finite_elements::FiniteElements;
use super::fit::Task;
use super::measured::MeasuredTable;
use super::reading::Surface;
use super::report::{Before, Results};
use super::search::{search, weigh};
use super::section::{FiniteElementsUsed, TableReport};
use super::surface::FittedSurface;
use crate::{Evaluator, FeModel, Hooks, IdentifyError, LawPoint, Settings, StateCache};

/// Deepest place as a share of the clearance under the bone.
const ROOM: f64 = 0.8;

/// A table to be diagnosed, and the finger that is simulated.
pub struct Input<'a> {
    /// Finger, numerics and published law.
    pub config: &'a Config,
    /// Numerics of the steady slide.
    pub settings: &'a Settings,
    /// The table.
    pub table: MeasuredTable,
    /// Threads.
    pub jobs: usize,
}

/// Result of a diagnosis of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The report, its input and times still empty.
    pub report: TableReport,
    /// The result in sentences.
    pub sentences: Vec<String>,
    /// Finger and law of the best explanation.
    pub corrected: CorrectedFinger,
    /// The table without the effects of the instruments, as CSV for `identify` and `build`.
    pub corrected_csv: String,
    /// Measured, modelled before and after, side by side, as CSV.
    pub side_by_side_csv: String,
}

/// Diagnoses a table. Finished slides are stored in `cache` and read from there.
///
/// # Errors
/// [`IdentifyError`]; `Interrupted` if the caller requested the end.
pub fn diagnose(input: &Input, cache: StateCache, hooks: &Hooks) -> Result<Finding, IdentifyError> {
    let (config, table) = (input.config, &input.table);
    if config.volume.is_some() || config.imported.is_some() {
        return Err(IdentifyError::Table(
            "the table is compared with a parametric finger (--shape): of a volume or a mesh neither size nor bone \
             clearance can be varied"
                .into(),
        ));
    }
    config.friction.check().map_err(ConfigError::Friction)?;
    let shape = config.fingertip_shape()?;
    let evaluator = Evaluator::new(config, input.settings, cache, hooks, input.jobs);
    let finger = evaluator.finger(&shape, f64::INFINITY)?;
    let problem = config.problem(&finger);
    let mut fe = FiniteElements {
        evaluator: &evaluator,
        fe_model: FeModel::new(&evaluator, &shape, &problem),
        deepest_mm: ROOM * Clearance::of(&finger).depth_mm,
        expected: 0,
        requested: 0,
    };
    if let Some(deepest) = table.depths_mm.last().filter(|deepest| !(**deepest < fe.deepest_mm)) {
        return Err(IdentifyError::Table(format!(
            "depth_mm {deepest} is too near to the bone (at most {:.2} mm on this finger); are columns or units mixed up, or is \
             the finger another (--shape)?",
            fe.deepest_mm
        )));
    }
    let law = LawPoint::of(&config.friction);
    let fitted = fe.surface(&law, &table.depths_mm)?;
    let surface = |place: &_| fitted.at(place);
    let published = Values::without_effects(table.depths_mm.len(), &law);
    let calibrated = calibrate(table, &surface, &published)?;
    let task = Task::all(table, &surface, calibrated.clone(), published.clone());
    let untested = untestable(table, &fitted);
    let testable: Vec<_> = EFFECTS.iter().filter(|effect| untested.iter().all(|(no, _)| no != effect)).collect();
    // Three rounds for each single effect, and as many for the best pairs.
    fe.expected = fe.requested + 3 * (testable.len() + 8) * table.depths_mm.len();
    let candidates = search(&task, &testable, &mut |values| fe.at_values(&table.depths_mm, values))?;
    let mut before = |values: Values| -> Result<Before, IdentifyError> {
        let exact = fe.at_values(&table.depths_mm, &values)?;
        let task = exact.map_or_else(|| task.clone(), |exact| task.shifted(&values, &exact));
        let readings = task.predict(&values);
        Ok((values, readings))
    };
    let (published, calibrated) = (before(published)?, before(calibrated)?);
    let used = FiniteElementsUsed {
        shape: config.shape.0.clone(),
        mesh_preset: format!("{:?}", config.mesh_preset).to_lowercase(),
        nodes: finger.mesh.nodes.len(),
        computed: evaluator.computed(),
        regression_percent: fitted.rms.map(|r| 100.0 * r),
    };
    let (verdict, contenders) = weigh(table, &candidates);
    let results = Results { input, task: &task, candidates, verdict, contenders, published, calibrated, untested };
    Ok(results.finding(used, &shape))
}

/// Effects that the table or the finger does not allow to test, and why.
fn untestable(table: &MeasuredTable, surface: &FittedSurface) -> Vec<(&'static Effect, String)> {
    let rigid = "the finger's geometry has no bone clearance that can be varied";
    let reason = |effect: &'static Effect| match effect.name {
        "geometry" if !surface.has_bone_terms() => Some((effect, rigid.to_owned())),
        _ => Some((effect, effect.lacks(|quantity| table.has(quantity))?)),
    };
    EFFECTS.iter().filter_map(reason).collect()
}

/// Stiffness and touch point from normal force and area, under the power law through the table's mean stresses: as
/// `identify` calibrates. If the table has neither, the finger is unchanged.
fn calibrate(table: &MeasuredTable, surface: &Surface, published: &Values) -> Result<Values, IdentifyError> {
    let start = table.mean_field().map_or_else(
        || published.clone(),
        |law| {
            Values::without_effects(table.depths_mm.len(), &LawPoint { tau0_share: published.law().tau0_share, ..law })
        },
    );
    let mut task = Task::all(table, surface, start.clone(), start.clone());
    task.numbers.retain(|m| m.quantity < 2);
    if task.numbers.len() < 3 {
        return Ok(published.clone());
    }
    let constants = ["tissue_stiffness", "depth_zero"].map(effect_named);
    let found = task.fit_from(&constants, false, start)?.values;
    let taken = [Parameter::LN_STIFFNESS, Parameter::DEPTH_OFFSET];
    Ok(taken.into_iter().fold(published.clone(), |values, p| values.with(p, found[p])))
}
