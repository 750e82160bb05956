//! The whole way from a table to constants.

use std::time::Instant;

use cpu_time::ProcessTime;
use sha2::{Digest, Sha256};

use super::{
    Bench, Compared, FingerPoint, Hooks, IdentifyError, LawPoint, Memo, Outcome, Point, Rig, Settings, Steady, Table,
    finger_fit::{Errors, FingerFit, OnRig, Place},
    friction_fit::{Target, fit, space_mapping},
    least_squares::{Solution, Stop},
    outcome::*,
    predict, sensitivity, simplex,
    surrogate::{Aligned, Friction, log_slopes},
    uncertainty::{self, Growth, linear, profile},
};
use crate::{
    contact::RubberFriction,
    experiment::{Config, ConfigError, bone_height_mm, press_and_slide},
    slide::BoneKind,
};

/// What is identified from what.
pub struct Input<'a> {
    /// Finger, numerics and the section `[identify]`.
    pub config: &'a Config,
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
    let all = (input.config.hash()?, &input.config.identify, &input.points, input.published);
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
    let (config, settings) = (input.config, &input.config.identify);
    settings.validate()?;
    let table = Table::new(&input.table_name, input.points.clone())?;
    let bench = Bench::new(config, memo, hooks, input.jobs);
    let mut clock = Clock { bench: &bench, stages: Vec::new() };
    let shape = config.fingertip_shape()?;
    let start = FingerPoint::of(shape);
    let published_law = LawPoint::of(&RubberFriction { tau0_mpa: 0.0, ..RubberFriction::default() });

    // What is made for a calibrated shape, should the calibration change it.
    let (made_finger, made_problem);
    let mut made_rig;
    let finger = bench.finger(&start.shape)?;
    check_depths(&table, bone_height_mm(&finger))?;
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
    let (law, solution, states, slopes) = clock.time("fast route: Gauss–Newton", || {
        let before = fe.evaluations;
        let stop = Stop { tolerance: settings.fast.gauss_newton_tolerance, evaluations: 40 };
        let (law, solution) = fit("Gauss–Newton", &mut fe, &target, &mapped, &[], stop)?;
        let states = fe.states(&law)?;
        let slopes = log_slopes(&mut fe, &law, settings.free_tau0)?;
        let coefficients: Vec<f64> = states.iter().map(Steady::friction_coefficient).collect();
        outcome.fast = Some(FastOutcome {
            mappings: fast.0.clone(),
            gauss_newton_evaluations: fe.evaluations - before,
            law,
            sum_of_squares: target.sum_of_squares(&coefficients),
        });
        Ok((law, solution, states, slopes))
    })?;
    outcome.penetration_mm = states.iter().map(|s| s.penetration_mm).fold(outcome.penetration_mm, f64::max);

    if settings.simplex.enabled {
        for start in &settings.simplex.starts {
            let name = format!("simplex from lambda {}, beta {}", start[0], start[1]);
            let run =
                clock.time(&name, || search(&name, settings, &table, &config.friction, *start, &mut fe, hooks))?;
            outcome.simplex.push(run);
        }
        outcome.routes_differ = routes_differ(&outcome.simplex, &law);
    }

    let mut aligned = Aligned::new(&states, config.friction, law, &slopes);
    let law_outcome = clock.time("uncertainty", || {
        uncertain(&table, &target, settings, &law, &solution, &mut aligned, &mut fe, &states)
    })?;
    outcome.law = Some(law_outcome);
    if !settings.free_tau0 {
        outcome.tau0 = Some(clock.time("test of tau_0", || {
            let slopes = log_slopes(&mut fe, &law, true)?;
            tau0_test(settings, &target, &law, &mut Aligned::new(&states, config.friction, law, &slopes))
        })?);
    }
    outcome.surface = Some(surface(&table, &outcome.simplex, &law, &mut aligned));
    outcome.left_out =
        clock.time("leave one depth out", || predict::leave_one_out(&table, &target, &law, &mut aligned, &mut fe))?;

    if settings.joint.enabled {
        outcome.joint = Some(clock.time("joint fit", || joint(&bench, fe.rig, &table, &finger_point, &law))?);
    }
    if settings.prediction.curve {
        let (curve, checks) = clock.time("curve and published checks", || {
            let friction = law.friction(&config.friction);
            let curve = predict::curve(&bench, &finger_point, &friction, &settings.prediction, fe.rig, &states)?;
            let checks = checks(config, &finger_point, &friction, &table, &curve, hooks)?;
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

fn finger_fit<'a, 'r>(
    stage: &'static str,
    bench: &'a Bench<'a>,
    rig: &'a mut Rig<'r>,
    table: &'a Table,
    finger: &FingerPoint,
    law: &LawPoint,
    joint: Option<Errors>,
) -> FingerFit<'a, 'r> {
    let settings = &bench.config.identify;
    let calibration = &settings.calibration;
    let errors = joint.unwrap_or(Errors {
        normal_force: 0.01 * calibration.normal_force_percent,
        contact_area: 0.01 * calibration.contact_area_percent,
        friction: None,
        depth_mm: None,
    });
    let vary: &[super::Knob] = if stage == "published" { &[] } else { &calibration.vary };
    let compared = if stage == "calibration" { calibration.compared } else { Compared::Slide };
    FingerFit::new(stage, bench, rig, table, vary, compared, errors, finger.clone(), *law, calibration.max_evaluations)
}

fn calibrate(
    bench: &Bench,
    rig: &mut Rig,
    table: &Table,
    start: &FingerPoint,
    law: &LawPoint,
) -> Result<FingerOutcome, IdentifyError> {
    let mut fit = finger_fit("calibration", bench, rig, table, start, law, None);
    finger_outcome(&mut fit, bench, table)
}

fn joint(
    bench: &Bench,
    rig: &mut Rig,
    table: &Table,
    start: &FingerPoint,
    law: &LawPoint,
) -> Result<FingerOutcome, IdentifyError> {
    let settings = &bench.config.identify;
    let percent = settings.friction_coefficient_percent.unwrap_or(settings.joint.friction_coefficient_percent);
    let errors = Errors {
        normal_force: 0.01 * settings.calibration.normal_force_percent,
        contact_area: 0.01 * settings.calibration.contact_area_percent,
        friction: Some(0.01 * percent),
        depth_mm: Some(settings.joint.depth_mm),
    };
    let mut fit = finger_fit("joint fit", bench, rig, table, start, law, Some(errors));
    fit.evaluations = settings.joint.max_evaluations;
    finger_outcome(&mut fit, bench, table)
}

fn finger_outcome(fit: &mut FingerFit, bench: &Bench, table: &Table) -> Result<FingerOutcome, IdentifyError> {
    use super::least_squares::Model;
    let before = fit.start_values();
    let rms = |residuals: &[f64]| (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
    let rms_before = rms(&fit.residuals(&before)?);
    let (place, solution): (Place, Solution) = fit.run()?;
    // The stated errors weigh; how large they are is taken from the misfit where that is larger.
    let freedom = solution.residuals.len().saturating_sub(solution.values.len());
    let sum: f64 = solution.residuals.iter().map(|r| r * r).sum();
    let variance = if freedom > 0 { (sum / freedom as f64).max(1.0) } else { 1.0 };
    let errors = linear(&solution.jacobian, variance);
    let (names, bounds) = fit.names_and_bounds();
    let fitted = names
        .into_iter()
        .zip(bounds)
        .enumerate()
        .map(|(k, ((name, unit), bounds))| {
            let value = solution.values[k];
            let margin = 0.002 * (bounds[1] - bounds[0]);
            Fitted {
                name,
                unit,
                start: before[k],
                value,
                standard_error: Some(errors.standard_errors[k]).filter(|e| e.is_finite()),
                bounds,
                at_bound: value - bounds[0] < margin || bounds[1] - value < margin,
            }
        })
        .collect();
    let states = fit.slides(&place)?;
    Ok(FingerOutcome {
        fitted,
        correlation: errors.correlation,
        against: against(table, &place.law, &bench.config.friction, &states),
        depth_shifts_mm: place.shifts_mm.clone(),
        finger: place.finger,
        law: place.law,
        rms: rms(&solution.residuals),
        rms_before,
        evaluations: solution.evaluations,
        ended: solution.ended,
    })
}

/// States of all slots beside the table.
fn against(table: &Table, law: &LawPoint, base: &RubberFriction, states: &[Steady]) -> Against {
    let percent = |model: f64, measured: f64| 100.0 * (model / measured - 1.0);
    let rows: Vec<Modelled> = table
        .points
        .iter()
        .zip(&table.slot)
        .map(|(point, &slot)| {
            let state = &states[slot];
            let mu = state.friction_coefficient();
            Modelled {
                depth_mm: point.depth_mm,
                model_depth_mm: state.depth_mm,
                normal_force_n: state.normal_force_n,
                contact_area_mm2: state.contact_area_mm2,
                friction_coefficient: mu,
                normal_force_difference_percent: percent(state.normal_force_n, point.normal_force_n),
                contact_area_difference_percent: point.contact_area_mm2.map(|a| percent(state.contact_area_mm2, a)),
                friction_coefficient_difference_percent: percent(mu, point.friction_coefficient),
            }
        })
        .collect();
    let difference = |(row, point): (&Modelled, &Point)| row.friction_coefficient - point.friction_coefficient;
    let sum_of_squares = rows.iter().zip(&table.points).map(difference).map(|d| d * d).sum();
    let friction = law.friction(base);
    Against { lambda: friction.lambda, beta: friction.beta, tau0_mpa: friction.tau0_mpa, rows, sum_of_squares }
}

/// The paper's procedure from one start.
fn search(
    name: &str,
    settings: &Settings,
    table: &Table,
    base: &RubberFriction,
    start: [f64; 2],
    fe: &mut OnRig,
    hooks: &Hooks,
) -> Result<simplex::SimplexRun, IdentifyError> {
    let plain = Target::of(table, None, settings.region, false);
    let mut count = 0;
    simplex::search(&settings.simplex, start, &mut |[lambda, beta]| {
        let law = RubberFriction { lambda, beta, ..*base };
        if let Some(reason) = settings.region.leaves(&law) {
            return Ok(Err(reason));
        }
        count += 1;
        match fe.coefficients(&LawPoint::of(&law)) {
            Ok(coefficients) => {
                let value = plain.sum_of_squares(&coefficients);
                (hooks.tell)(name, &format!("{count} evaluations, sum of squares {value:.3e}"));
                Ok(Ok(value))
            }
            Err(error) if error.is_local() => Ok(Err(error.to_string())),
            Err(error) => Err(error),
        }
    })
}

/// Difference of the best simplex run from the fast route: relative in strength at 5 kPa, absolute in beta.
fn routes_differ(runs: &[simplex::SimplexRun], law: &LawPoint) -> Option<[f64; 2]> {
    let best = runs.iter().min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    let [lambda, beta] = best.end;
    let end = LawPoint::of(&RubberFriction { lambda, beta, ..Default::default() });
    Some([end.tau_ref_kpa / law.tau_ref_kpa - 1.0, end.beta - law.beta])
}

#[expect(clippy::too_many_arguments, reason = "each is a finished piece")]
fn uncertain(
    table: &Table,
    target: &Target,
    settings: &Settings,
    law: &LawPoint,
    solution: &Solution,
    aligned: &mut Aligned,
    fe: &mut OnRig,
    states: &[Steady],
) -> Result<LawOutcome, IdentifyError> {
    let rows = target.coefficients.len();
    let least: f64 = solution.residuals.iter().map(|r| r * r).sum();
    let growth = Growth::of(least, rows, target.constants(), target.known, settings.confidence);
    let errors = linear(&solution.jacobian, growth.map_or(f64::NAN, |g| g.variance));
    let mut remarks = Vec::new();
    let mut constants = Vec::new();
    let mut region_check_percent = Vec::new();
    let x = law.coordinates(settings.free_tau0);
    let mut beta_ends = None;
    for k in 0..target.constants() {
        let error = Some(errors.standard_errors[k]).filter(|e| e.is_finite());
        let interval = match growth {
            Some(growth) => {
                let (interval, ends) = profile(aligned, target, law, k, error.unwrap_or(0.1), growth.one)?;
                for end in &ends {
                    region_check_percent.push(checked(aligned, fe, end)?);
                }
                if k == 1 {
                    beta_ends = Some(ends);
                }
                Some(interval)
            }
            None => None,
        };
        let (name, unit) = [("strength at 5 kPa", "kPa"), ("beta", ""), ("tau_0", "kPa")][k];
        // Coordinates to the constants as they are told.
        let told = |value: f64| match k {
            0 => value.exp(),
            1 => value,
            _ => value * law.tau_ref_kpa,
        };
        let scale = [law.tau_ref_kpa, 1.0, law.tau_ref_kpa][k];
        let interval = interval.map(|i| uncertainty::Interval { low: told(i.low), high: told(i.high), ..i });
        if let Some(i) = &interval {
            if i.is_flat() {
                remarks.push(format!("The table says nothing of {name}: no value in the search region is excluded."));
            } else if i.bounded != [true, true] {
                let side = if i.bounded[0] { "above" } else { "below" };
                remarks.push(format!("The table does not bound {name} from {side} inside the search region."));
            }
        }
        constants.push(Constant {
            name: name.into(),
            unit: unit.into(),
            value: told(x[k]),
            standard_error: error.map(|e| e * scale),
            interval,
        });
    }
    if growth.is_none() {
        remarks.push(format!(
            "{rows} coefficients for {} constants leave no degree of freedom: no error can be told.",
            target.constants()
        ));
    }
    // ln lambda = ln tau_ref - beta ln p_ref.
    let (a, b) = (errors.standard_errors[0], errors.standard_errors[1]);
    let correlation = errors.correlation[0][1];
    let lever = super::REFERENCE_MPA.ln();
    let lambda_error = (a * a - 2.0 * lever * correlation * a * b + lever * lever * b * b).sqrt();
    let correlation_of_lambda = (correlation * a * b - lever * b * b) / (lambda_error * b);
    let map = match growth {
        Some(growth) => {
            let around = |k: usize| match &constants[k].interval {
                Some(i) => {
                    let reach = 0.45 * (i.high - i.low);
                    let [low, high] = [settings.region.tau_ref_kpa, settings.region.beta][k];
                    [(i.low - reach).max(low), (i.high + reach).min(high)]
                }
                None => [settings.region.tau_ref_kpa, settings.region.beta][k],
            };
            Some(uncertainty::map(aligned, target, law, growth.two, around(0), around(1), 61)?)
        }
        None => None,
    };
    Ok(LawOutcome {
        law: *law,
        constants,
        lambda: law.lambda(),
        lambda_range: beta_ends.map(|ends| ends.map(|end| end.lambda())),
        correlation,
        correlation_of_lambda,
        coefficient_error: growth.map(|g| if target.known { 0.0 } else { g.variance.sqrt() }).filter(|e| *e > 0.0),
        error_is_known: target.known,
        confidence: settings.confidence,
        map,
        region_check_percent,
        against: against(table, law, &fe.base, states),
        remarks,
    })
}

/// Largest difference of the surrogate from finite elements at a law, % of F/N; none where there is no slide.
fn checked(aligned: &mut Aligned, fe: &mut OnRig, law: &LawPoint) -> Result<Option<f64>, IdentifyError> {
    match fe.coefficients(law) {
        Ok(exact) => {
            let told = aligned.coefficients(law)?;
            let worst = told.iter().zip(&exact).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
            Ok(Some(100.0 * worst))
        }
        Err(error) if error.is_local() => Ok(None),
        Err(error) => Err(error),
    }
}

/// Frees tau_0 on the surrogate.
fn tau0_test(
    settings: &Settings,
    held: &Target,
    law: &LawPoint,
    aligned: &mut Aligned,
) -> Result<Tau0Outcome, IdentifyError> {
    let target = Target { free_tau0: true, ..held.clone() };
    let stop = Stop { tolerance: 1e-9, evaluations: 300 };
    let mut best: Option<(LawPoint, f64)> = None;
    for share in [0.0, 0.3, 0.7] {
        let start = LawPoint { tau0_share: share, ..*law };
        let (found, solution) = fit("tau_0", aligned, &target, &start, &[], stop)?;
        let sum: f64 = solution.residuals.iter().map(|r| r * r).sum();
        if best.is_none_or(|(_, least)| sum < least) {
            best = Some((found, sum));
        }
    }
    let (mut best, mut sum_of_squares) = best.expect("three fits");
    let mut rows = Vec::new();
    let mut from = *law;
    for i in 0..=18 {
        let share = 0.05 * f64::from(i);
        let (found, solution) = fit("tau_0", aligned, &target, &from, &[None, None, Some(share)], stop)?;
        let sum: f64 = solution.residuals.iter().map(|r| r * r).sum();
        if sum < sum_of_squares {
            (best, sum_of_squares) = (found, sum);
        }
        from = found;
        rows.push([share, sum, found.beta]);
    }
    let sum_of_squares_held = held.sum_of_squares(&aligned.coefficients(law)?);
    let growth = Growth::of(sum_of_squares, held.coefficients.len(), 3, held.known, settings.confidence);
    let allowed = growth.map(|growth| {
        let inside = |row: &[f64; 3]| row[1] - sum_of_squares <= growth.one;
        let shares: Vec<f64> = rows.iter().filter(|r| inside(r)).map(|r| r[0]).collect();
        let fold = |f: fn(f64, f64) -> f64, start: f64| shares.iter().copied().fold(start, f);
        let (low, high) = (fold(f64::min, best.tau0_share), fold(f64::max, best.tau0_share));
        uncertainty::Interval { low, high, bounded: [low > 0.0, high < 0.9] }
    });
    let percent = format!("{:.0} %", 100.0 * settings.confidence);
    let sentence = match &allowed {
        None => format!(
            "With tau_0 free, {} coefficients leave no degree of freedom for three constants: tau_0 cannot be told from beta.",
            held.coefficients.len()
        ),
        Some(i) if i.bounded[0] => format!(
            "The table wants a strength that does not depend on pressure: tau_0 is {:.0} to {:.0} % of the strength at 5 kPa ({percent}).",
            100.0 * i.low,
            100.0 * i.high
        ),
        Some(i) if i.bounded[1] => {
            format!("tau_0 is at most {:.0} % of the strength at 5 kPa ({percent}); 0 is not excluded.", 100.0 * i.high)
        }
        Some(_) => {
            let (first, last) = (rows.first().expect("19 rows"), rows.last().expect("19 rows"));
            format!(
                "The table cannot tell tau_0 from beta: any tau_0 from 0 to 90 % of the strength at 5 kPa is allowed ({percent}), \
                 with beta going from {:.2} to {:.2}.",
                first[2], last[2]
            )
        }
    };
    Ok(Tau0Outcome { law: best, sum_of_squares, sum_of_squares_held, profile: rows, allowed, sentence })
}

/// The sum of squares around the searches' paths.
fn surface(table: &Table, runs: &[simplex::SimplexRun], law: &LawPoint, aligned: &mut Aligned) -> Surface {
    let plain = Target::of(table, None, super::Region::default(), false);
    let visited = runs.iter().flat_map(|r| r.visits.iter().filter(|v| v.turned_back.is_none()));
    let mut points: Vec<[f64; 2]> = visited.map(|v| [v.lambda.ln(), v.beta]).collect();
    points.extend([[law.lambda().ln(), law.beta], [0.086f64.ln(), 0.46]]);
    let along = |k: usize, margin: f64| -> Vec<f64> {
        let low = points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min) - margin;
        let high = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + margin;
        (0..81).map(|i| low + (high - low) * f64::from(i) / 80.0).collect()
    };
    let (ln_lambda, betas) = (along(0, 0.6), along(1, 0.15));
    let value = |l: f64, beta: f64, aligned: &mut Aligned| {
        let law = LawPoint::of(&RubberFriction { lambda: l.exp(), beta, ..Default::default() });
        aligned.coefficients(&law).map_or(f64::NAN, |c| plain.sum_of_squares(&c))
    };
    let sum_of_squares = betas.iter().map(|&b| ln_lambda.iter().map(|&l| value(l, b, aligned)).collect()).collect();
    Surface { ln_lambda, beta: betas, sum_of_squares }
}

/// Published findings that were not fitted, beside ours.
fn checks(
    config: &Config,
    finger: &FingerPoint,
    law: &RubberFriction,
    table: &Table,
    curve: &Curve,
    hooks: &Hooks,
) -> Result<Vec<Published>, IdentifyError> {
    let mut out = Vec::new();
    let (first, last) = (curve.points.first(), curve.points.last());
    if let (Some(first), Some(last)) = (first, last) {
        let range = format!("{:.2} to {:.2} N", first.normal_force_n, last.normal_force_n);
        let at = |n: f64, of: fn(&CurvePoint) -> f64| -> Option<f64> {
            let upper = curve.points.iter().position(|p| p.normal_force_n >= n).filter(|&i| i > 0)?;
            let (a, b) = (&curve.points[upper - 1], &curve.points[upper]);
            let share = (n / a.normal_force_n).ln() / (b.normal_force_n / a.normal_force_n).ln();
            Some((of(a).ln() + share * (of(b) / of(a)).ln()).exp())
        };
        let top = last.normal_force_n;
        if top > 1.2 {
            // Their ratio over a decade, brought to our range as a power.
            let exponent = 0.60f64.ln() / 0.1f64.ln();
            if let Some(one) = at(1.0, |p| p.contact_area_mm2) {
                out.push(Published {
                    finding: format!("contact area at 1 N over that at {top:.2} N"),
                    source: "Serina et al. 1998: A(1 N)/A(10 N) = 0.60, as a power brought to our range".into(),
                    published: (1.0 / top).powf(exponent),
                    ours: one / last.contact_area_mm2,
                    conditions: format!("steady slide, finite elements reach {top:.2} N"),
                });
            }
            if let Some(one) = at(1.0, |p| p.friction_coefficient) {
                out.push(Published {
                    finding: format!("fall of the friction coefficient from 1 to {top:.2} N, %"),
                    source: "Seo et al. 2009: -46 % from 1 to 20 N, as a power brought to our range".into(),
                    published: 100.0 * (top.powf(0.54f64.ln() / 20f64.ln()) - 1.0),
                    ours: 100.0 * (last.friction_coefficient / one - 1.0),
                    conditions: format!("steady slide, finite elements reach {top:.2} N"),
                });
            }
        }
        let logs: Vec<[f64; 2]> = curve
            .points
            .iter()
            .map(|p| [p.normal_force_n.ln(), (p.friction_coefficient * p.normal_force_n).ln()])
            .collect();
        let within: Vec<[f64; 2]> = {
            let forces = || table.points.iter().map(|p| p.normal_force_n);
            let (low, high) = (forces().fold(f64::INFINITY, f64::min), forces().fold(0.0, f64::max));
            logs.iter().copied().filter(|l| l[0].exp() > 0.7 * low && l[0].exp() < 1.4 * high).collect()
        };
        let measured: Vec<[f64; 2]> =
            table.points.iter().map(|p| [p.normal_force_n.ln(), p.friction_n().ln()]).collect();
        for (logs, where_) in [(&within, "over the loads of the table".to_owned()), (&logs, format!("over {range}"))] {
            if let (Some((ours, _)), Some((table, _))) = (super::table::line(logs), super::table::line(&measured)) {
                out.push(Published {
                    finding: "power n of friction over normal force, F ~ N^n".into(),
                    source: "the table itself (Yoshida et al. 2011 state 2/3 for theirs)".into(),
                    published: table,
                    ours,
                    conditions: format!("steady slide, {where_}"),
                });
            }
        }
    }
    if let Some(check) = stick_line(config, finger, law, table, hooks)? {
        out.extend(check);
    }
    Ok(out)
}

/// Stick ratio over tangential load during one press and slide: how far from the straight line that was observed.
fn stick_line(
    config: &Config,
    finger: &FingerPoint,
    law: &RubberFriction,
    table: &Table,
    hooks: &Hooks,
) -> Result<Option<Vec<Published>>, IdentifyError> {
    use std::ops::ControlFlow;
    let mut config = config.clone();
    config.friction = *law;
    finger.apply(&mut config);
    let fingertip = {
        let made = crate::mesh::fingertip(&finger.shape, &config.mesh_preset.divisions())?;
        crate::slide::Finger::new(made, &config.tissue)?
    };
    let depth_mm = table.depths_mm[table.depths_mm.len() / 2] + finger.depth_offset_mm;
    (hooks.tell)("stick ratio over load", &format!("slide at depth {depth_mm:.3} mm"));
    let result = press_and_slide(&config, &fingertip, depth_mm, &mut |_| {
        if (hooks.go_on)() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    let trajectory = match result {
        Ok(trajectory) => trajectory,
        Err(crate::slide::MarchError::Interrupted { .. }) => return Err(IdentifyError::Interrupted),
        Err(_) => return Ok(None),
    };
    let slide: Vec<_> = trajectory.responses.iter().filter(|r| r.slide_x_mm > 0.0).collect();
    let limit = slide.iter().map(|r| r.friction_x_n / r.normal_force_n).fold(0.0, f64::max);
    // The line runs from 1 without load to 0 at the limit.
    let points: Vec<[f64; 2]> = slide
        .iter()
        .map(|r| [r.friction_x_n / r.normal_force_n / limit, r.stick_ratio])
        .take_while(|p| p[1] > 0.0)
        .filter(|p| p[0] > 0.05)
        .collect();
    if points.len() < 4 {
        return Ok(None);
    }
    let worst = points.iter().map(|p| (p[1] - (1.0 - p[0])).abs()).fold(0.0, f64::max);
    let source = "André, Lévesque, Hayward, Lefèvre & Thonnard 2011: the ratio falls in a straight line with load";
    let conditions = format!("press and slide at depth {depth_mm:.2} mm, load over its largest");
    let half = predict_half(&points);
    Ok(Some(vec![
        Published {
            finding: "largest distance of the stick ratio from the straight line 1 - F/F_limit".into(),
            source: source.into(),
            published: 0.0,
            ours: worst,
            conditions: conditions.clone(),
        },
        Published {
            finding: "stick ratio at half of the largest load".into(),
            source: source.into(),
            published: 0.5,
            ours: half,
            conditions,
        },
    ]))
}

fn predict_half(points: &[[f64; 2]]) -> f64 {
    let Some(i) = points.iter().position(|p| p[0] >= 0.5).filter(|&i| i > 0) else { return f64::NAN };
    let ([x0, y0], [x1, y1]) = (points[i - 1].into(), points[i].into());
    let (x0, y0, x1, y1): (f64, f64, f64, f64) = (x0, y0, x1, y1);
    y0 + (y1 - y0) * (0.5 - x0) / (x1 - x0)
}
