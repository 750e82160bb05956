//! Identification on data of the model itself: planted parameters must be recovered.

use std::ops::ControlFlow;

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::{Config, press_and_slide, press_to};
use fingerpad_fe::load_path::BoneKind;
use fingerpad_fe::mesh::{FingertipShape, MeshPreset};
use fingerpad_identify::{
    Evaluator, FeModel, FingerPoint, Hooks, LawPoint, Point, Region, Settings, Simplex, StateCache, Steady, Table,
    bounded_least_squares::Stop,
    confidence::{Growth, linear},
    fe_friction::FeFriction,
    friction_fit::{Target, fit, space_mapping},
    law_uncertainty::ring,
    simplex,
    surrogate::{AlignedSurrogate, FrictionModel, log_slopes},
};

use super::{Effort, Failure};
use crate::{Check, random::Random};

const PLANTED: [f64; 2] = [0.086, 0.46];

fn coarse(shape: &str, bone: BoneKind) -> Config {
    let mut config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    config.shape.0 = shape.into();
    config.tissue.bone.kind = bone;
    config
}

fn with_fe_model<T>(
    config: &Config,
    depths_mm: &[f64],
    work: impl FnOnce(&mut FeFriction) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let hooks = Hooks { go_on: &|| true, report_progress: &|_, _| {} };
    // Rounding at the contact's penalty leaves residuals of some 1e-9.
    let settings = Settings { tolerance: 5e-8, ..Settings::default() };
    let evaluator = Evaluator::new(config, &settings, StateCache::default(), &hooks, 2);
    let shape = FingertipShape::named(&config.shape.0)?;
    let finger = evaluator.finger(&shape, depths_mm.iter().copied().fold(0.0, f64::max))?;
    let problem = config.problem(&finger);
    let mut fe_model = FeModel::new(&evaluator, &shape, &problem);
    let stiffness = FingerPoint::of(shape).stiffness;
    let depths_mm = depths_mm.to_vec();
    work(&mut FeFriction { fe_model: &mut fe_model, depths_mm, stiffness, base: config.friction, evaluations: 0 })
}

fn planted() -> LawPoint {
    LawPoint::of(&RubberFriction { lambda: PLANTED[0], beta: PLANTED[1], ..RubberFriction::default() })
}

fn table_of(states: &[Steady]) -> Result<Table, Failure> {
    let point = |s: &Steady| Point {
        depth_mm: s.depth_mm,
        normal_force_n: s.normal_force_n,
        friction_coefficient: s.friction_coefficient(),
        contact_area_mm2: Some(s.contact_area_mm2),
    };
    Ok(Table::new("planted", states.iter().map(point).collect())?)
}

/// The state that is solved for directly against the end of a long slide.
pub fn direct_slip(effort: Effort) -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    let depths: &[f64] = if effort == Effort::Quick { &[0.75] } else { &[0.75, 1.5] };
    let mut config = coarse("e", BoneKind::Floating);
    config.numerics.contact.augment = false;
    config.numerics.solver.tolerance = 5e-8;
    config.experiment.slide_mm = 10.0;
    let deepest = press_to(depths.iter().copied().fold(0.0, f64::max));
    let (finger, _) = config.finger_for(&[&deepest])?;
    let direct = with_fe_model(&config, depths, |fe| Ok(fe.states(&planted())?))?;
    for (state, &depth) in direct.iter().zip(depths) {
        let slide = press_and_slide(&config, &finger, depth, None, None, &mut |_| ControlFlow::Continue(()))?;
        let end = slide.responses.last().ok_or("an empty trajectory")?;
        let named = |what: &str| format!("{what} at {depth} mm: direct state, end of a 10 mm slide");
        checks.push(Check::relative(named("N (N)"), state.normal_force_n, end.normal_force_n, 1e-4));
        checks.push(Check::relative(named("F (N)"), state.friction_x_n, end.friction_x_n, 1e-4));
        checks.push(Check::relative(named("A (mm²)"), state.contact_area_mm2, end.contact_area_mm2, 1e-3));
    }
    Ok(checks)
}

/// Constants planted in finite-element data, by both routes, tolerances 1e-8.
pub fn twin(effort: Effort) -> Result<Vec<Check>, Failure> {
    let config = coarse("a", BoneKind::Fixed);
    let depths: &[f64] = if effort == Effort::Quick { &[0.5, 1.0] } else { &[0.75, 1.0, 1.25, 1.5] };
    let starts: &[[f64; 2]] =
        if effort == Effort::Quick { &[[0.05, 0.3]] } else { &[[0.05, 0.3], [0.3, 0.7], [0.02, 0.2]] };
    with_fe_model(&config, depths, |fe| {
        let table = table_of(&fe.states(&planted())?)?;
        let region = Region::default();
        let target = Target::of(&table, None, region, false);
        let mut checks = Vec::new();
        let mut compare = |route: &str, law: LawPoint| {
            checks.push(Check::relative(format!("{route}: lambda"), law.lambda(), PLANTED[0], 1e-3));
            checks.push(Check::relative(format!("{route}: beta"), law.beta, PLANTED[1], 1e-3));
            let tau = planted().tau_ref_kpa;
            checks.push(Check::relative(format!("{route}: strength at 5 kPa (kPa)"), law.tau_ref_kpa, tau, 1e-3));
        };
        let mut numbers = Vec::new();
        let start = LawPoint::of(&RubberFriction { lambda: 0.05, beta: 0.3, ..RubberFriction::default() });
        let before = fe.evaluations;
        let (path, _) = space_mapping(&mut |law| fe.states(law), config.friction, &target, &start, 1e-8, 30)?;
        let mapped = path.last().ok_or("no mapping")?.law;
        numbers.push(Check::reported("evaluations: space mapping", (fe.evaluations - before) as f64));
        compare("space mapping", mapped);
        let before = fe.evaluations;
        let (law, _) = fit("Gauss–Newton", fe, &target, &start, &[], Stop { tolerance: 5e-8, evaluations: 60 })?;
        numbers.push(Check::reported("evaluations: Gauss–Newton", (fe.evaluations - before) as f64));
        compare("Gauss–Newton", law);
        for &start in starts {
            let settings = Simplex { tolx: 1e-8, tolf: 1e-8, ..Simplex::default() };
            let run = search(&settings, start, &target, &config.friction, fe)?;
            numbers.push(Check::reported(format!("evaluations: simplex from {start:?}"), run.visits.len() as f64));
            let end = RubberFriction { lambda: run.end[0], beta: run.end[1], ..config.friction };
            compare(&format!("simplex from {start:?}"), LawPoint::of(&end));
        }
        if effort == Effort::Full {
            for &start in starts {
                let run = search(&Simplex::default(), start, &target, &config.friction, fe)?;
                let name = |what: &str| format!("tolerances of the paper, from {start:?}: {what}");
                numbers.push(Check::reported(name("lambda"), run.end[0]));
                numbers.push(Check::reported(name("beta"), run.end[1]));
                numbers.push(Check::reported(name("evaluations"), run.visits.len() as f64));
            }
        }
        checks.extend(numbers);
        Ok(checks)
    })
}

fn search(
    settings: &Simplex,
    start: [f64; 2],
    target: &Target,
    base: &RubberFriction,
    fe: &mut FeFriction,
) -> Result<simplex::SimplexRun, Failure> {
    Ok(simplex::search(settings, start, &mut |[lambda, beta]| {
        let law = RubberFriction { lambda, beta, ..*base };
        if let Some(reason) = target.region.leaves(&law) {
            return Ok(Err(reason));
        }
        match fe.coefficients(&LawPoint::of(&law)) {
            Ok(model) => Ok(Ok(target.sum_of_squares(&model))),
            Err(error) if error.is_local() => Ok(Err(error.to_string())),
            Err(error) => Err(error),
        }
    })?)
}

/// Seed of the noise.
const SEED: u64 = 20_110_801;

/// A normally distributed number (sum of twelve uniform ones: kurtosis −0.1, its tails end at 6).
fn normal(random: &mut Random) -> f64 {
    (0..12).map(|_| 0.5 * random.number()).sum()
}

/// 1 % of noise on the coefficients: how often the planted pair lies in the 95 % region, out of 100.
///
/// In full every noisy table is fitted by finite elements; a test fits on the surrogate that is corrected by them
/// around the planted pair. F/N of a mesh is not smooth to a part in a thousand (contact points touch or open), and the
/// error of the surrogate is of that size.
pub fn noise(effort: Effort) -> Result<Vec<Check>, Failure> {
    let config = coarse("a", BoneKind::Fixed);
    let depths = [0.75, 1.0, 1.25, 1.5];
    with_fe_model(&config, &depths, |fe| {
        let states = fe.states(&planted())?;
        let slopes = log_slopes(fe, &planted(), false)?;
        let mut aligned = AlignedSurrogate::new(&states, config.friction, planted(), &slopes);
        let exact = Target::of(&table_of(&states)?, Some(1.0), Region::default(), false);
        let stop = Stop { tolerance: 1e-10, evaluations: 200 };
        let (_, at_planted) = fit("noise", &mut aligned, &exact, &planted(), &[], stop)?;
        let around = ring(&planted(), &linear(&at_planted.jacobian, 1.0), 2.5, &Region::default());
        let known =
            around.into_iter().map(|law| Ok((law, fe.coefficients(&law)?))).collect::<Result<Vec<_>, Failure>>()?;
        let bent = aligned.correct_at(&known);
        println!("noise: seed {SEED}");
        let mut random = Random::new(SEED);
        let (mut inside, mut inside_estimated) = (0, 0);
        let mut fits = Vec::new();
        for _ in 0..100 {
            let mut table = table_of(&states)?;
            for point in &mut table.points {
                point.friction_coefficient *= 1.0 + 0.01 * normal(&mut random);
            }
            for known in [true, false] {
                let target = Target::of(&table, known.then_some(1.0), Region::default(), false);
                let stop = Stop { tolerance: 1e-10, evaluations: 200 };
                let (law, mut solution) = fit("noise", &mut aligned, &target, &planted(), &[], stop)?;
                let mut truth = target.sum_of_squares(&aligned.coefficients(&planted())?);
                if known && effort == Effort::Full {
                    let stop = Stop { tolerance: 1e-5, evaluations: 12 };
                    (_, solution) = fit("noise", fe, &target, &law, &[], stop)?;
                    truth = target.sum_of_squares(&fe.coefficients(&planted())?);
                }
                let least: f64 = solution.residuals.iter().map(|r| r * r).sum();
                let growth = Growth::of(least, 4, 2, known, 0.95).ok_or("no degrees of freedom")?;
                let held = usize::from(truth - least <= growth.two);
                if known {
                    inside += held;
                    fits.push(law);
                } else {
                    inside_estimated += held;
                }
            }
        }
        let far = |law: &LawPoint| (law.beta - PLANTED[1]).abs();
        fits.sort_by(|a, b| far(b).total_cmp(&far(a)));
        let mut worst = 0.0f64;
        let checked = if effort == Effort::Quick { 1 } else { 6 };
        for law in fits.iter().take(checked) {
            let exact = fe.coefficients(law)?;
            let of_surrogate = aligned.coefficients(law)?;
            worst = of_surrogate.iter().zip(&exact).map(|(a, b)| (a / b - 1.0).abs()).fold(worst, f64::max);
        }
        Ok(vec![
            Check::at_least("planted pair in the 95 % region, of 100, noise known", f64::from(inside as u32), 90.0),
            Check::at_most("the same", f64::from(inside as u32), 99.0),
            Check::reported("the same, noise estimated from the misfit", f64::from(inside_estimated as u32)),
            Check::reported("beta that is farthest out", fits[0].beta),
            Check::reported("surrogate less finite elements on the ring before it was bent to them, relative", bent),
            // A tenth of the noise.
            Check::at_most("surrogate less finite elements at the farthest fits, relative", worst, 1e-3),
        ])
    })
}
