//! From a table to its diagnosis, step by step.
//!
//! Main function: [`diagnose`].

use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::Clearance;

use super::TableError;
use super::corrected::CorrectedFinger;
use super::finding_builder::{Before, FindingBuilder};
use super::finite_elements::FiniteElements;
use super::fit::{Model, Task};
use super::measured::MeasuredTable;
use super::outcome::{FiniteElementsUsed, TableReport};
use super::parameters::{Effect, Parameter, Values};
use super::reading::{Elastic, Surface, place_of, predict, read};
use super::search::{Search, exact, testable};
use super::surface::FittedSurface;
use super::verdict::Answer;
use crate::{Evaluator, FeModel, Hooks, LawPoint, Settings, StateCache};

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
/// [`TableError`]; [`TableError::Fe`] with `Interrupted` if the caller requested the end.
pub fn diagnose(input: &Input, cache: StateCache, hooks: &Hooks) -> Result<Finding, TableError> {
    let config = input.config;
    if config.volume.is_some() || config.imported.is_some() {
        return Err(TableError::Geometry(
            "the table is compared with a parametric finger (--shape): of a volume or a mesh neither size nor bone \
             clearance can be varied"
                .into(),
        ));
    }
    config.friction.check().map_err(fingerpad_fe::experiment::ConfigError::Friction)?;
    let shape = config.fingertip_shape()?;
    let evaluator = Evaluator::new(config, input.settings, cache, hooks, input.jobs);
    let finger = evaluator.finger(&shape, f64::INFINITY)?;
    let deepest_mm = ROOM * Clearance::of(&finger).depth_mm;
    let table = &input.table;
    check_depths(table, deepest_mm)?;
    let problem = config.problem(&finger);
    let mut fe = FiniteElements {
        evaluator: &evaluator,
        fe_model: FeModel::new(&evaluator, &shape, &problem),
        shape: shape.clone(),
        base: config.friction,
        deepest_mm,
        expected: 0,
        requested: 0,
    };
    let law = LawPoint::of(&config.friction);
    let surface = fe.surface(&law, &table.depths_mm, true)?;
    let published = Values::without_effects(table.depths_mm.len(), law.tau_ref_kpa, law.beta, law.tau0_share);
    let calibrated = calibrate(table, &surface, &published)?;
    let (effects, untested) = testable(table, &surface);
    let search = Search { task: Task::all(table, calibrated.clone(), published.clone()), surface: &surface, effects };
    // Three rounds for each single effect, and as many for the best pairs.
    fe.expected = fe.requested + 3 * (search.effects.len() + 8) * table.depths_mm.len();
    let candidates = search.run(&mut |values| exact(&mut fe, &table.depths_mm, values))?;
    let answer = Answer::of(table, &candidates);
    let before = Before {
        as_given: readings(&mut fe, &surface, &table.depths_mm, &published)?,
        calibrated: readings(&mut fe, &surface, &table.depths_mm, &calibrated)?,
        published,
        calibration: calibrated,
    };
    let used = FiniteElementsUsed {
        shape: config.shape.0.clone(),
        mesh_preset: format!("{:?}", config.mesh_preset).to_lowercase(),
        nodes: finger.mesh.nodes.len(),
        computed: evaluator.computed(),
        regression_percent: surface.rms.map(|r| 100.0 * r),
    };
    let finding_builder = FindingBuilder {
        input,
        shape: &shape,
        surface: &surface,
        candidates: &candidates,
        answer: &answer,
        before: &before,
    };
    Ok(finding_builder.finding(used, &untested))
}

fn check_depths(table: &MeasuredTable, deepest_mm: f64) -> Result<(), TableError> {
    match table.depths_mm.last() {
        Some(&deepest) if !(deepest < deepest_mm) => Err(TableError::TooLittle(format!(
            "depth_mm {deepest} is too near to the bone (at most {deepest_mm:.2} mm on this finger); are columns or \
             units mixed up, or is the finger another (--shape)?"
        ))),
        _ => Ok(()),
    }
}

/// Stiffness and touch point from normal force and area, under the power law through the table's mean stresses: as
/// `identify` calibrates. If the table has neither, the finger is unchanged.
fn calibrate(table: &MeasuredTable, surface: &dyn Surface, published: &Values) -> Result<Values, TableError> {
    let law = mean_field(table);
    let start = law.map_or_else(
        || published.clone(),
        |[strength_kpa, beta]| {
            published.clone().with(Parameter::LnStrength, strength_kpa.ln()).with(Parameter::Exponent, beta)
        },
    );
    let mut task = Task::all(table, start.clone(), start);
    task.numbers.retain(|m| m.quantity < 2);
    if task.numbers.len() < 3 {
        return Ok(published.clone());
    }
    let fitted = task.fit(surface, &Model::alone(&[Effect::TissueStiffness, Effect::DepthZero]))?;
    let taken = [Parameter::LnStiffness, Parameter::DepthOffset];
    Ok(taken.iter().fold(published.clone(), |values, p| values.with(*p, fitted.values.get(*p))))
}

/// Strength at 5 kPa (kPa) and exponent of the power law through mean shear stress over mean pressure of the table's rows.
fn mean_field(table: &MeasuredTable) -> Option<[f64; 2]> {
    let stresses: Vec<[f64; 2]> = (table.rows.iter())
        .filter_map(|r| {
            let (n, a, mu) = (r.normal_force_n?.value, r.contact_area_mm2?.value, r.friction_coefficient?.value);
            Some([(200.0 * n / a).ln(), (1e3 * mu * n / a).ln()])
        })
        .collect();
    let count = stresses.len() as f64;
    let mean = |k: usize| stresses.iter().map(|s| s[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let spread: f64 = stresses.iter().map(|s| (s[0] - x).powi(2)).sum();
    let beta = stresses.iter().map(|s| (s[0] - x) * (s[1] - y)).sum::<f64>() / spread;
    (stresses.len() > 1 && spread > 1e-6 && beta.is_finite()).then(|| {
        let beta = beta.clamp(-0.2, 0.9);
        [(y - beta * x).exp(), beta]
    })
}

/// Readings by the finite elements, or by the regression if a slide is not found.
fn readings(
    fe: &mut FiniteElements,
    surface: &FittedSurface,
    depths_mm: &[f64],
    values: &Values,
) -> Result<Vec<[f64; 3]>, TableError> {
    let Some(exact) = exact(fe, depths_mm, values)? else { return Ok(predict(surface, values, depths_mm)) };
    let one =
        |(slot, elastic): (usize, &Elastic)| read(values, &place_of(values, depths_mm[slot], slot).1.apply(elastic));
    Ok(exact.iter().enumerate().map(one).collect())
}
