//! The procedure from a measured table to the constants of the friction law, step by step.

use std::cell::RefCell;
use std::time::Instant;

use cpu_time::ProcessTime;
use sha2::{Digest, Sha256};

use super::settings::Settings;
use super::{
    Evaluator, FeModel, FingerPoint, Hooks, IdentifyError, LawPoint, Outcome, Point, SimplexRun, StateCache, Steady,
    Table,
    bounded_least_squares::{Solution, Stop},
    calibrate::{calibrate, finger_fit, joint},
    comparison::compare,
    direct_search,
    fe_friction::FeFriction,
    force_zero::against_force_zero,
    friction_fit::{Mapping, Target, fit, solution_at, space_mapping},
    law_uncertainty::{LawFit, law_uncertainty},
    outcome::*,
    predict, published, sensitivity,
    surrogate::{AlignedSurrogate, log_slopes},
    tau0::tau0_test,
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::{Config, ConfigError};
use fingerpad_fe::load_path::BoneKind;
use fingerpad_fe::load_path::Clearance;

/// An identification problem: table, finger and settings.
pub struct Input<'a> {
    /// Finger and numerics.
    pub config: &'a Config,
    /// Calibration and identification.
    pub settings: &'a Settings,
    /// Name of the table, for messages.
    pub table_name: String,
    /// Measured rows.
    pub points: Vec<Point>,
    /// Run the published constants only; search for nothing.
    pub published: bool,
    /// Threads.
    pub jobs: usize,
}

/// Hash of settings and table.
///
/// # Errors
/// [`ConfigError`] if there is no such shape.
pub fn settings_hash(input: &Input) -> Result<String, ConfigError> {
    let all = (input.config.hash()?, &input.settings, &input.points, input.published);
    let text = serde_json::to_string(&all).expect("plain values");
    Ok(Sha256::digest(text).iter().take(8).map(|b| format!("{b:02x}")).collect())
}

/// Stages of a run with their times.
struct Clock<'a> {
    evaluator: &'a Evaluator<'a>,
    stages: RefCell<Vec<Stage>>,
}

impl Clock<'_> {
    fn time<T>(&self, name: &str, work: impl FnOnce() -> Result<T, IdentifyError>) -> Result<T, IdentifyError> {
        (self.evaluator.hooks.report_progress)(name, "");
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        let (states, effort) = (self.evaluator.computed(), self.evaluator.effort());
        let result = work();
        self.stages.borrow_mut().push(Stage {
            name: name.to_owned(),
            wall_s: wall.elapsed().as_secs_f64(),
            cpu_s: cpu.elapsed().as_secs_f64(),
            states: self.evaluator.computed() - states,
            effort: self.evaluator.effort().since(&effort),
        });
        result
    }
}

/// Identifies the friction law from a table: calibrates the finger, searches the law's constants by the fast route and
/// by the paper's simplex, quantifies their uncertainty and predicts.
///
/// # Errors
/// [`IdentifyError`]; the states computed until then are in `cache`.
pub fn identify(input: &Input, cache: StateCache, hooks: &Hooks) -> Result<Outcome, IdentifyError> {
    let (config, settings) = (input.config, input.settings);
    settings.validate()?;
    let table = Table::new(&input.table_name, input.points.clone())?;
    let evaluator = Evaluator::new(config, settings, cache, hooks, input.jobs);
    let clock = Clock { evaluator: &evaluator, stages: RefCell::default() };
    let given = FingerPoint::of(config.fingertip_shape()?);
    let deepest_mm = evaluator.deepest_mm(&table.depths_mm);
    let finger = evaluator.finger(&given.shape, deepest_mm)?;
    check_depths(&table, Clearance::of(&finger).depth_mm)?;
    let problem = config.problem(&finger);
    let mut fe_model = FeModel::new(&evaluator, &given.shape, &problem);

    let published_before = clock.time("published constants, finger as given", || {
        let law = published_law();
        let mut fit = finger_fit("published", &evaluator, &mut fe_model, &table, &given, &law, None);
        let states = fit.states(&fit.point(&[]))?;
        Ok(compare(&table, &law, &config.friction, &states))
    })?;
    let first_law = table.mean_field(&settings.region, &config.friction).unwrap_or(LawPoint::of(&config.friction));
    let calibration = if settings.calibration.enabled && !settings.calibration.vary.is_empty() {
        let run = || calibrate(&evaluator, &mut fe_model, &table, &given, &first_law);
        Some(clock.time("calibration", run)?)
    } else {
        None
    };
    let calibrated = calibration.as_ref().map_or(&given, |c| &c.finger).clone();
    let outcome = Outcome {
        provenance: provenance(input, finger.mesh.nodes.len())?,
        table: table.points.clone(),
        published_before,
        calibration,
        ..Outcome::default()
    };

    let identify_law =
        |fe_model: &mut FeModel| LawSearch::new(input, &table, &clock, &calibrated, fe_model).run(outcome, &first_law);
    let mut outcome = if calibrated.shape == given.shape {
        identify_law(&mut fe_model)?
    } else {
        let finger = evaluator.finger(&calibrated.shape, deepest_mm)?;
        let problem = config.problem(&finger);
        identify_law(&mut FeModel::new(&evaluator, &calibrated.shape, &problem))?
    };
    if settings.force_zero && !input.published {
        outcome.force_zero =
            Some(clock.time("beta against the force zero", || {
                against_force_zero(&evaluator, &mut fe_model, &table, &given)
            })?);
    }
    outcome.stages = clock.stages.into_inner();
    Ok(outcome)
}

/// The constants of Yoshida et al. 2011, without tau_0.
fn published_law() -> LawPoint {
    LawPoint::of(&RubberFriction { tau0_mpa: 0.0, ..RubberFriction::default() })
}

fn provenance(input: &Input, nodes: usize) -> Result<Provenance, IdentifyError> {
    let config = input.config;
    let bones = match config.tissue.bone.kind {
        BoneKind::Fixed => "fixed",
        BoneKind::Floating => "floating",
        BoneKind::Deformable => "deformable",
    };
    Ok(Provenance {
        table: input.table_name.clone(),
        shape: config.shape.0.clone(),
        bones: bones.into(),
        mesh_preset: format!("{:?}", config.mesh_preset).to_lowercase(),
        nodes,
        settings_hash: settings_hash(input)?,
        program_version: env!("CARGO_PKG_VERSION").into(),
    })
}

fn check_depths(table: &Table, room_mm: f64) -> Result<(), IdentifyError> {
    match table.depths_mm.last() {
        Some(&deepest) if !(deepest < 0.8 * room_mm) => Err(IdentifyError::Table(format!(
            "depth_mm {deepest} is too near to the bone, whose lowest point is {room_mm:.2} mm above first touch \
             (at most 80 % of that); are columns or units mixed up?"
        ))),
        _ => Ok(()),
    }
}

/// The steps that follow the calibration: the friction law on the calibrated finger.
struct LawSearch<'a, 'r, 'm> {
    input: &'a Input<'a>,
    table: &'a Table,
    clock: &'a Clock<'a>,
    finger: &'a FingerPoint,
    target: Target,
    /// Finite elements of the calibrated finger.
    fe: FeFriction<'r, 'm>,
}

/// The law that the fast route found, with the linearised fit there.
struct FastRoute {
    law: LawPoint,
    solution: Solution,
    outcome: FastOutcome,
}

impl<'a, 'r, 'm> LawSearch<'a, 'r, 'm> {
    fn new(
        input: &'a Input<'a>,
        table: &'a Table,
        clock: &'a Clock<'a>,
        finger: &'a FingerPoint,
        fe_model: &'r mut FeModel<'m>,
    ) -> Self {
        let settings = input.settings;
        let depths_mm = table.depths_mm.iter().map(|d| d + finger.depth_offset_mm).collect();
        let (stiffness, base) = (finger.stiffness, input.config.friction);
        let fe = FeFriction { fe_model, depths_mm, stiffness, base, evaluations: 0 };
        let target = Target::of(table, settings.friction_coefficient_percent, settings.region, settings.free_tau0);
        Self { input, table, clock, finger, target, fe }
    }

    /// All steps in their order; completes `outcome`.
    fn run(mut self, mut outcome: Outcome, first_law: &LawPoint) -> Result<Outcome, IdentifyError> {
        let settings = self.input.settings;
        (outcome.published, outcome.penetration_mm) = self.published_constants()?;
        if self.input.published {
            return Ok(outcome);
        }
        // The simplex starts near the published constants, at the finger's present state.
        let starts = if settings.simplex.enabled { settings.simplex.starts.len() } else { 0 };
        let mut beside: Vec<FeModel> = (0..starts).map(|_| self.fe.fe_model.beside()).collect();
        let FastRoute { law, solution, outcome: fast } = self.fast_route(first_law)?;
        outcome.fast = Some(fast);
        let states = self.fe.states(&law)?;
        let slopes = log_slopes(&mut self.fe, &law, settings.free_tau0)?;
        outcome.penetration_mm = deepest_penetration_mm(&states, outcome.penetration_mm);
        if settings.simplex.enabled {
            (outcome.simplex, outcome.refined) = self.simplex_route(&mut beside)?;
            outcome.routes_differ = outcome.refined.as_ref().map(|run| direct_search::routes_differ(run, &law));
        }

        let mut surrogate = AlignedSurrogate::new(&states, self.fe.base, law, &slopes);
        let fit = LawFit { table: self.table, target: &self.target, law, solution: &solution, states: &states };
        outcome.law = Some(self.clock.time("uncertainty", || {
            law_uncertainty(&fit, settings, self.input.config.mesh_preset, &mut surrogate, &mut self.fe)
        })?);
        if !settings.free_tau0 {
            outcome.tau0 = Some(self.test_of_tau0(&law, &states)?);
        }
        let searches: Vec<_> = outcome.simplex.iter().chain(&outcome.refined).cloned().collect();
        outcome.surface = Some(direct_search::surface(self.table, &searches, &law, &mut surrogate));
        outcome.left_out = self.clock.time("leave one depth out", || {
            predict::leave_one_out(self.table, &self.target, &law, &mut surrogate, &mut self.fe)
        })?;
        if settings.joint.enabled {
            outcome.joint = Some(self.joint_fit(&law)?);
        }
        if settings.prediction.curve {
            let (curve, checks) = self.curve_and_checks(&law, &states)?;
            (outcome.curve, outcome.checks) = (Some(curve), checks);
        }
        if settings.prediction.sensitivities {
            outcome.sensitivities = self.clock.time("sensitivities", || {
                let (evaluator, base) = (self.clock.evaluator, &self.fe.base);
                sensitivity::sensitivities(evaluator, self.table, self.finger, &law, base)
            })?;
        }
        Ok(outcome)
    }

    /// Published constants on the calibrated finger beside the table; largest penetration, mm.
    fn published_constants(&mut self) -> Result<(ModelDataComparison, f64), IdentifyError> {
        self.clock.time("published constants, finger calibrated", || {
            let law = published_law();
            let states = self.fe.states(&law)?;
            Ok((compare(self.table, &law, &self.fe.base, &states), deepest_penetration_mm(&states, 0.0)))
        })
    }

    /// Space mapping, Gauss–Newton from its end and, with tau_0 held, a direct search from there.
    fn fast_route(&mut self, first_law: &LawPoint) -> Result<FastRoute, IdentifyError> {
        let (settings, target) = (&self.input.settings.fast, &self.target);
        let first = LawPoint { tau0_share: published_law().tau0_share, ..*first_law };
        let (mappings, _) = self.clock.time("fast route: space mapping", || {
            let (tolerance, most, base) = (settings.tolerance, settings.max_mappings, self.fe.base);
            space_mapping(&mut |law| self.fe.states(law), base, target, &first, tolerance, most)
        })?;
        let mapped = mappings.last().expect("at least the start").law;
        let before = self.fe.evaluations;
        let (law, solution) = self.clock.time("fast route: Gauss–Newton", || {
            let stop = Stop { tolerance: settings.gauss_newton_tolerance, evaluations: 40 };
            fit("Gauss–Newton", &mut self.fe, target, &mapped, &[], stop)
        })?;
        let sum_of_squares = solution.residuals.iter().map(|r| r * r).sum();
        let outcome = FastOutcome {
            mappings,
            gauss_newton_evaluations: self.fe.evaluations - before,
            gauss_newton: Mapping { law, sum_of_squares },
            direct_evaluations: 0,
            law,
            sum_of_squares,
        };
        let fitted = FastRoute { law, solution, outcome };
        if self.input.settings.free_tau0 { Ok(fitted) } else { self.search_directly(fitted) }
    }

    /// Continues Gauss–Newton by a search without derivatives: derivatives across a kink of the mesh mislead it
    /// slightly.
    fn search_directly(&mut self, fitted: FastRoute) -> Result<FastRoute, IdentifyError> {
        let name = "fast route: direct search";
        self.clock.time(name, || {
            let hooks = self.clock.evaluator.hooks;
            let run = direct_search::continued(name, self.input.settings, &self.target, &fitted.law, &self.fe, hooks)?;
            let law = LawPoint { tau0_share: fitted.law.tau0_share, ..direct_search::end(&run) };
            let (direct_evaluations, sum_of_squares) = (run.visits.len(), run.sum_of_squares);
            let evaluations = fitted.solution.evaluations + direct_evaluations;
            let solution = solution_at(&mut self.fe, &self.target, &law, run.stopped, evaluations)?;
            let outcome = FastOutcome { direct_evaluations, law, sum_of_squares, ..fitted.outcome };
            Ok(FastRoute { law, solution, outcome })
        })
    }

    /// The paper's simplex from every start, each on a model of its own, and its best end continued.
    fn simplex_route(
        &mut self,
        beside: &mut [FeModel],
    ) -> Result<(Vec<SimplexRun>, Option<SimplexRun>), IdentifyError> {
        let (settings, hooks) = (self.input.settings, self.clock.evaluator.hooks);
        let runs =
            self.clock.time("simplex", || direct_search::searches(settings, self.table, &self.fe, beside, hooks))?;
        let Some(best) = direct_search::best(&runs) else { return Ok((runs, None)) };
        let name = "simplex continued from the best end";
        let unweighted = Target::of(self.table, None, settings.region, false);
        let refined =
            self.clock.time(name, || direct_search::continued(name, settings, &unweighted, &best, &self.fe, hooks))?;
        Ok((runs, Some(refined)))
    }

    /// Whether the table can distinguish tau_0 from beta.
    fn test_of_tau0(&mut self, law: &LawPoint, states: &[Steady]) -> Result<Tau0Outcome, IdentifyError> {
        self.clock.time("test of tau_0", || {
            let slopes = log_slopes(&mut self.fe, law, true)?;
            let mut surrogate = AlignedSurrogate::new(states, self.fe.base, *law, &slopes);
            tau0_test(self.input.settings, &self.target, law, &mut surrogate)
        })
    }

    /// Finger, depths and law fitted at once.
    fn joint_fit(&mut self, law: &LawPoint) -> Result<FingerOutcome, IdentifyError> {
        let evaluator = self.clock.evaluator;
        self.clock.time("joint fit", || joint(evaluator, self.fe.fe_model, self.table, self.finger, law))
    }

    /// F/N over the normal force, and published findings that were not fitted beside it.
    fn curve_and_checks(
        &mut self,
        law: &LawPoint,
        states: &[Steady],
    ) -> Result<(Curve, Vec<Published>), IdentifyError> {
        let (config, evaluator) = (self.input.config, self.clock.evaluator);
        let (friction, wanted) = (law.friction(&config.friction), &self.input.settings.prediction);
        self.clock.time("curve and published checks", || {
            let curve = predict::curve(evaluator, self.finger, &friction, wanted, self.fe.fe_model, states)?;
            let checks = published::checks(config, self.finger, &friction, self.table, &curve, evaluator.hooks)?;
            Ok((curve, checks))
        })
    }
}

/// Largest penetration of the states, mm; at least `so_far`.
fn deepest_penetration_mm(states: &[Steady], so_far: f64) -> f64 {
    states.iter().map(|s| s.penetration_mm).fold(so_far, f64::max)
}
