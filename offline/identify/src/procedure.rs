//! The whole way from a table to constants.

use std::time::Instant;

use cpu_time::ProcessTime;
use sha2::{Digest, Sha256};

use super::settings::Settings;
use super::{
    Bench, FingerPoint, Hooks, IdentifyError, LawPoint, Memo, Outcome, Point, Rig, Table,
    against::against,
    calibrate::{calibrate, finger_fit, joint},
    certainty::{Fitted, certainty},
    friction_fit::{Mapping, Target, fit, solution_at, space_mapping},
    least_squares::Stop,
    on_rig::OnRig,
    outcome::*,
    predict, published, search, sensitivity,
    surrogate::{Aligned, log_slopes},
    tau0::tau0_test,
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::{Config, ConfigError};
use fingerpad_fe::load_path::BoneKind;
use fingerpad_fe::load_path::Clearance;

/// What is identified from what.
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

/// Stages with their times.
struct Clock<'a> {
    bench: &'a Bench<'a>,
    stages: Vec<Stage>,
}

impl Clock<'_> {
    fn time<T>(&mut self, name: &str, work: impl FnOnce() -> Result<T, IdentifyError>) -> Result<T, IdentifyError> {
        (self.bench.hooks.tell)(name, "");
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        let (states, effort) = (self.bench.computed(), self.bench.effort());
        let result = work();
        self.stages.push(Stage {
            name: name.to_owned(),
            wall_s: wall.elapsed().as_secs_f64(),
            cpu_s: cpu.elapsed().as_secs_f64(),
            states: self.bench.computed() - states,
            effort: self.bench.effort().since(&effort),
        });
        result
    }
}

/// Identifies: calibrates the finger, searches the law by both routes, says how sure it is, predicts.
///
/// # Errors
/// [`IdentifyError`]; what was computed until then is in `memo`.
pub fn identify(input: &Input, memo: Memo, hooks: &Hooks) -> Result<Outcome, IdentifyError> {
    let (config, settings) = (input.config, input.settings);
    settings.validate()?;
    let table = Table::new(&input.table_name, input.points.clone())?;
    let bench = Bench::new(config, settings, memo, hooks, input.jobs);
    let mut clock = Clock { bench: &bench, stages: Vec::new() };
    let shape = config.fingertip_shape()?;
    let start = FingerPoint::of(shape);
    let published_law = LawPoint::of(&RubberFriction { tau0_mpa: 0.0, ..RubberFriction::default() });

    // What is made for a calibrated shape, should the calibration change it.
    let (made_finger, made_problem);
    let mut made_rig;
    let finger = bench.finger(&start.shape)?;
    check_depths(&table, Clearance::of(&finger).depth_mm)?;
    let nodes = finger.mesh.nodes.len();
    let problem = config.problem(&finger);
    let mut rig = Rig::new(&bench, &start.shape, &problem);

    let published_before = clock.time("published constants, finger as given", || {
        let mut fit = finger_fit("published", &bench, &mut rig, &table, &start, &published_law, None);
        let states = fit.states(&fit.place(&[]))?;
        Ok(against(&table, &published_law, &config.friction, &states))
    })?;

    let mut penetration_mm = 0.0f64;
    let first_law = table.mean_field(&settings.region, &config.friction).unwrap_or(LawPoint::of(&config.friction));
    let calibration = if settings.calibration.enabled && !settings.calibration.vary.is_empty() {
        Some(clock.time("calibration", || calibrate(&bench, &mut rig, &table, &start, &first_law))?)
    } else {
        None
    };
    let finger_point = calibration.as_ref().map_or(start.clone(), |c| c.finger.clone());

    let rig = if finger_point.shape == start.shape {
        &mut rig
    } else {
        made_finger = bench.finger(&finger_point.shape)?;
        made_problem = config.problem(&made_finger);
        made_rig = Rig::new(&bench, &finger_point.shape, &made_problem);
        &mut made_rig
    };
    let depths_mm = table.depths_mm.iter().map(|d| d + finger_point.depth_offset_mm).collect();
    let mut fe = OnRig { rig, depths_mm, stiffness: finger_point.stiffness, base: config.friction, evaluations: 0 };
    let target = Target::of(&table, settings.friction_coefficient_percent, settings.region, settings.free_tau0);

    let published = clock.time("published constants, finger calibrated", || {
        let states = fe.states(&published_law)?;
        penetration_mm = states.iter().map(|s| s.penetration_mm).fold(penetration_mm, f64::max);
        Ok(against(&table, &published_law, &config.friction, &states))
    })?;

    let mut outcome = Outcome {
        provenance: Provenance {
            table: input.table_name.clone(),
            shape: config.shape.0.clone(),
            bones: match config.tissue.bone.kind {
                BoneKind::Fixed => "fixed",
                BoneKind::Floating => "floating",
                BoneKind::Deformable => "deformable",
            }
            .into(),
            mesh_preset: format!("{:?}", config.mesh_preset).to_lowercase(),
            nodes,
            settings_hash: settings_hash(input)?,
            program_version: env!("CARGO_PKG_VERSION").into(),
        },
        table: table.points.clone(),
        published_before,
        published,
        calibration,
        simplex: Vec::new(),
        refined: None,
        fast: None,
        routes_differ: None,
        law: None,
        tau0: None,
        surface: None,
        joint: None,
        left_out: Vec::new(),
        curve: None,
        checks: Vec::new(),
        sensitivities: Vec::new(),
        penetration_mm,
        stages: Vec::new(),
    };
    if input.published {
        outcome.stages = clock.stages;
        return Ok(outcome);
    }

    // The searches start near the published constants, where the finger stands now.
    let mut beside: Vec<Rig> = match settings.simplex.enabled {
        true => settings.simplex.starts.iter().map(|_| fe.rig.beside()).collect(),
        false => Vec::new(),
    };
    let first = LawPoint { tau0_share: published_law.tau0_share, ..first_law };
    let fast = clock.time("fast route: space mapping", || {
        space_mapping(
            &mut |law| fe.states(law),
            config.friction,
            &target,
            &first,
            settings.fast.tolerance,
            settings.fast.max_mappings,
        )
    })?;
    let mapped = fast.0.last().expect("at least the start").law;
    let (fitted, solution) = clock.time("fast route: Gauss–Newton", || {
        let stop = Stop { tolerance: settings.fast.gauss_newton_tolerance, evaluations: 40 };
        let before = fe.evaluations;
        let (law, solution) = fit("Gauss–Newton", &mut fe, &target, &mapped, &[], stop)?;
        let sum_of_squares = solution.residuals.iter().map(|r| r * r).sum();
        outcome.fast = Some(FastOutcome {
            mappings: fast.0.clone(),
            gauss_newton_evaluations: fe.evaluations - before,
            gauss_newton: Mapping { law, sum_of_squares },
            direct_evaluations: 0,
            law,
            sum_of_squares,
        });
        Ok((law, solution))
    })?;
    // Derivatives across a kink of the mesh lead Gauss–Newton a little astray.
    let (law, solution) = if settings.free_tau0 {
        (fitted, solution)
    } else {
        let name = "fast route: direct search";
        clock.time(name, || {
            let run = search::continued(name, settings, &target, &fitted, &fe, hooks)?;
            let law = LawPoint { tau0_share: fitted.tau0_share, ..search::end(&run) };
            if let Some(fast) = &mut outcome.fast {
                fast.direct_evaluations = run.visits.len();
                (fast.law, fast.sum_of_squares) = (law, run.sum_of_squares);
            }
            let evaluations = solution.evaluations + run.visits.len();
            Ok((law, solution_at(&mut fe, &target, &law, run.stopped, evaluations)?))
        })?
    };
    let states = fe.states(&law)?;
    let slopes = log_slopes(&mut fe, &law, settings.free_tau0)?;
    outcome.penetration_mm = states.iter().map(|s| s.penetration_mm).fold(outcome.penetration_mm, f64::max);

    if settings.simplex.enabled {
        outcome.simplex = clock.time("simplex", || search::searches(settings, &table, &fe, &mut beside, hooks))?;
        if let Some(best) = search::best(&outcome.simplex) {
            let name = "simplex continued from the best end";
            let plain = Target::of(&table, None, settings.region, false);
            outcome.refined = Some(clock.time(name, || search::continued(name, settings, &plain, &best, &fe, hooks))?);
        }
        outcome.routes_differ = outcome.refined.as_ref().map(|run| search::routes_differ(run, &law));
    }

    let mut aligned = Aligned::new(&states, config.friction, law, &slopes);
    let law_outcome = clock.time("uncertainty", || {
        let fitted = Fitted { table: &table, target: &target, law, solution: &solution, states: &states };
        certainty(&fitted, settings, &mut aligned, &mut fe)
    })?;
    outcome.law = Some(law_outcome);
    if !settings.free_tau0 {
        outcome.tau0 = Some(clock.time("test of tau_0", || {
            let slopes = log_slopes(&mut fe, &law, true)?;
            tau0_test(settings, &target, &law, &mut Aligned::new(&states, config.friction, law, &slopes))
        })?);
    }
    let walked: Vec<_> = outcome.simplex.iter().chain(&outcome.refined).cloned().collect();
    outcome.surface = Some(search::surface(&table, &walked, &law, &mut aligned));
    outcome.left_out =
        clock.time("leave one depth out", || predict::leave_one_out(&table, &target, &law, &mut aligned, &mut fe))?;

    if settings.joint.enabled {
        outcome.joint = Some(clock.time("joint fit", || joint(&bench, fe.rig, &table, &finger_point, &law))?);
    }
    if settings.prediction.curve {
        let (curve, checks) = clock.time("curve and published checks", || {
            let friction = law.friction(&config.friction);
            let curve = predict::curve(&bench, &finger_point, &friction, &settings.prediction, fe.rig, &states)?;
            let checks = published::checks(config, &finger_point, &friction, &table, &curve, hooks)?;
            Ok((curve, checks))
        })?;
        outcome.curve = Some(curve);
        outcome.checks = checks;
    }
    if settings.prediction.sensitivities {
        outcome.sensitivities = clock.time("sensitivities", || {
            sensitivity::sensitivities(&bench, &table, &finger_point, &law, &config.friction)
        })?;
    }
    outcome.stages = clock.stages;
    Ok(outcome)
}

fn check_depths(table: &Table, room_mm: f64) -> Result<(), IdentifyError> {
    match table.depths_mm.last() {
        Some(&deepest) if !(deepest < 0.8 * room_mm) => Err(IdentifyError::Table(format!(
            "depth_mm {deepest} comes too near to the bone, whose lowest point is {room_mm:.2} mm above first touch \
             (at most 80 % of that); are columns or units mixed up?"
        ))),
        _ => Ok(()),
    }
}
