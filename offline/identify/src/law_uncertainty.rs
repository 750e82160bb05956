//! Uncertainty of the identified friction law: standard errors, intervals, confidence region, and remarks on them.

use super::{
    IdentifyError, LawPoint, REFERENCE_MPA, Region, Settings, Steady, Table,
    bounded_least_squares::Solution,
    comparison::compare,
    confidence::{Growth, Interval, Linear, linear, map, profile},
    evaluator::Missing,
    fe_friction::FeFriction,
    friction_fit::Target,
    outcome::{Constant, LawOutcome, Regularisation},
    surrogate::{AlignedSurrogate, FrictionModel},
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::mesh::MeshPreset;

/// A fitted law with its table, its fit and its finite-element states.
pub struct LawFit<'a> {
    /// Table that it fits.
    pub table: &'a Table,
    /// Coefficients that were fitted.
    pub target: &'a Target,
    /// Law.
    pub law: LawPoint,
    /// Fit.
    pub solution: &'a Solution,
    /// Finite-element states at the law.
    pub states: &'a [Steady],
}

/// Farthest laws of a ring: differences of ln strength and beta.
const FARTHEST: [f64; 2] = [0.4, 0.5];

/// Eight laws around one, at `radius` standard errors; those outside `region` are left out.
///
/// If standard errors are so large that a surrogate would have to reach too far, the ring is smaller.
pub fn ring(law: &LawPoint, errors: &Linear, radius: f64, region: &Region) -> Vec<LawPoint> {
    let correlation = errors.correlation[0][1].clamp(-0.9999, 0.9999);
    let [a, b] = [errors.standard_errors[0], errors.standard_errors[1]].map(|e| if e.is_finite() { e } else { 1e3 });
    let reach = (radius * a / FARTHEST[0]).max(radius * b / FARTHEST[1]).max(1.0);
    let x = law.coordinates(false);
    let laws = (0..8).map(|i| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
        let along = radius / reach;
        let across = correlation * cos + (1.0 - correlation * correlation).sqrt() * sin;
        law.at(&[x[0] + along * a * cos, x[1] + along * b * across])
    });
    laws.filter(|law| region.leaves(&law.friction(&Default::default())).is_none()).collect()
}

/// Standard errors, intervals and confidence region of a fitted law, and sentences about them.
///
/// * `surrogate`: aligned at the law; corrected here to the finite elements around it
///
/// # Errors
/// [`IdentifyError`] of a fit, or an error of the finite elements that is not of one law.
pub fn law_uncertainty(
    fit: &LawFit,
    settings: &Settings,
    mesh_preset: MeshPreset,
    surrogate: &mut AlignedSurrogate,
    fe: &mut FeFriction,
) -> Result<LawOutcome, IdentifyError> {
    let LawFit { table, target, law, solution, states } = *fit;
    let rows = target.coefficients.len();
    let least: f64 = solution.residuals.iter().map(|r| r * r).sum();
    let growth = Growth::of(least, rows, target.constants(), target.known, settings.confidence);
    let errors = linear(&solution.jacobian, growth.map_or(f64::NAN, |g| g.variance));
    if let Some(growth) = &growth {
        align_around(&law, &errors, growth, settings, surrogate, fe)?;
    }
    let profiles = profiles(fit, &errors, growth.as_ref(), surrogate)?;
    let ends: Vec<LawPoint> = profiles.iter().flat_map(|(_, ends)| ends.iter().flatten().copied()).collect();
    let region_check_percent = checked(surrogate, fe, &ends)?;
    let beta_ends = profiles[1].1;
    let constants: Vec<Constant> = profiles
        .into_iter()
        .enumerate()
        .map(|(k, (interval, _))| constant(k, &law, target, &errors, interval))
        .collect();
    let map = match growth {
        Some(growth) => {
            let [tau_ref_kpa, beta] = [0, 1].map(|k| map_range(&constants[k], settings, k));
            Some(map(surrogate, target, &law, growth.two, tau_ref_kpa, beta, 61)?)
        }
        None => None,
    };
    Ok(LawOutcome {
        law,
        remarks: remarks(&constants, target, growth.is_some(), mesh_preset),
        constants,
        lambda: law.lambda(),
        lambda_range: beta_ends.map(|ends| ends.map(|end| end.lambda())),
        correlation: errors.correlation[0][1],
        correlation_of_lambda: correlation_of_lambda(&scaled_errors(&errors, solution, growth.as_ref())),
        regularisation: regularisation(&law, fe, states)?,
        coefficient_error: growth.map(|g| if target.known { 0.0 } else { g.variance.sqrt() }).filter(|e| *e > 0.0),
        error_is_known: target.known,
        confidence: settings.confidence,
        map,
        region_check_percent,
        comparison: compare(table, &law, &fe.base, states),
    })
}

/// Corrects the surrogate to finite elements at a ring of laws on the border of the linearised confidence region.
fn align_around(
    law: &LawPoint,
    errors: &Linear,
    growth: &Growth,
    settings: &Settings,
    surrogate: &mut AlignedSurrogate,
    fe: &mut FeFriction,
) -> Result<(), IdentifyError> {
    let ring = ring(law, errors, (growth.two / growth.variance).sqrt(), &settings.region);
    let coefficients = fe.found(&ring, Missing::Sought)?;
    let known = ring.into_iter().zip(coefficients).filter_map(|(law, found)| Some((law, found?)));
    surrogate.correct_at(&known.collect::<Vec<_>>());
    Ok(())
}

/// A constant's interval and the laws at its ends; none without degrees of freedom.
type Profile = (Option<Interval>, Option<[LawPoint; 2]>);

/// Profile-likelihood interval of every constant.
fn profiles(
    fit: &LawFit,
    errors: &Linear,
    growth: Option<&Growth>,
    surrogate: &mut AlignedSurrogate,
) -> Result<Vec<Profile>, IdentifyError> {
    let Some(growth) = growth else { return Ok(vec![(None, None); fit.target.constants()]) };
    (0..fit.target.constants())
        .map(|k| {
            let step = Some(errors.standard_errors[k]).filter(|e| e.is_finite()).unwrap_or(0.1);
            let (interval, ends) = profile(surrogate, fit.target, &fit.law, k, step, growth.one)?;
            Ok((Some(interval), Some(ends)))
        })
        .collect()
}

/// Share of a search region's width within which an estimate counts as standing at the region's bound.
const AT_BOUND: f64 = 0.002;

/// Constant `k` in the units of a report: strength and tau_0 in kPa.
fn constant(k: usize, law: &LawPoint, target: &Target, errors: &Linear, interval: Option<Interval>) -> Constant {
    let (name, unit) = [("strength at 5 kPa", "kPa"), ("beta", ""), ("tau_0", "kPa")][k];
    let reported = |coordinate: f64| match k {
        0 => coordinate.exp(),
        1 => coordinate,
        _ => coordinate * law.tau_ref_kpa,
    };
    let scale = [law.tau_ref_kpa, 1.0, law.tau_ref_kpa][k];
    let (value, [low, high]) = (law.coordinates(target.free_tau0)[k], target.bounds()[k]);
    let margin = AT_BOUND * (high - low);
    let bound = if value - low < margin {
        Some(low)
    } else if high - value < margin {
        Some(high)
    } else {
        None
    };
    Constant {
        name: name.into(),
        unit: unit.into(),
        value: reported(value),
        at_bound: bound.map(reported),
        standard_error: Some(errors.standard_errors[k]).filter(|e| e.is_finite()).map(|e| e * scale),
        interval: interval.map(|i| Interval { low: reported(i.low), high: reported(i.high), ..i }),
    }
}

/// Sentences about constants that the table does not determine.
fn remarks(constants: &[Constant], target: &Target, has_freedom: bool, mesh_preset: MeshPreset) -> Vec<String> {
    let at_bound = constants.iter().filter_map(|c| at_bound_remark(c, mesh_preset));
    let open = constants.iter().filter_map(|c| remark(&c.name, c.interval.as_ref()?));
    let without_freedom = (!has_freedom).then(|| {
        let (rows, number) = (target.coefficients.len(), target.constants());
        format!("{rows} coefficients for {number} constants leave no degree of freedom: errors cannot be estimated.")
    });
    at_bound.chain(open).chain(without_freedom).collect()
}

/// Warns of an estimate that the search region holds, not the table.
fn at_bound_remark(constant: &Constant, mesh_preset: MeshPreset) -> Option<String> {
    let (bound, unit) = (constant.at_bound?, &constant.unit);
    let space = if unit.is_empty() { "" } else { " " };
    let advice = match mesh_preset {
        MeshPreset::Coarse => {
            " The coarse mesh is for trying out: its F/N jumps where contact points touch or open. Identify on the \
             default mesh (leave out --mesh-preset coarse)."
        }
        _ => "",
    };
    Some(format!(
        "{} = {:.4}{space}{unit} is at the bound {bound:.4}{space}{unit} of its search region: the bound, not the table, \
         determines it.{advice}",
        constant.name, constant.value
    ))
}

fn remark(name: &str, interval: &Interval) -> Option<String> {
    if interval.is_flat() {
        return Some(format!("The table does not bound {name}: no value in the search region is excluded."));
    }
    let side = if interval.bounded[0] { "above" } else { "below" };
    (interval.bounded != [true, true])
        .then(|| format!("The table does not bound {name} from {side} inside the search region."))
}

/// Range of a constant in the likelihood map: its interval and almost half as much on either side.
fn map_range(constant: &Constant, settings: &Settings, k: usize) -> [f64; 2] {
    let [low, high] = [settings.region.tau_ref_kpa, settings.region.beta][k];
    constant.interval.as_ref().map_or([low, high], |i| {
        let reach = 0.45 * (i.high - i.low);
        [(i.low - reach).max(low), (i.high + reach).min(high)]
    })
}

/// The errors, or those of unit variance if the misfit gives no variance: correlations do not depend on it.
fn scaled_errors(errors: &Linear, solution: &Solution, growth: Option<&Growth>) -> Linear {
    if growth.is_some_and(|g| g.variance > 0.0) { errors.clone() } else { linear(&solution.jacobian, 1.0) }
}

/// Correlation of ln lambda and beta: ln lambda = ln tau_ref - beta ln p_ref. None if either error is infinite.
fn correlation_of_lambda(errors: &Linear) -> Option<f64> {
    let (a, b) = (errors.standard_errors[0], errors.standard_errors[1]);
    let correlation = errors.correlation[0][1];
    let lever = REFERENCE_MPA.ln();
    let lambda_error = (a * a - 2.0 * lever * correlation * a * b + lever * lever * b * b).sqrt();
    Some((correlation * a * b - lever * b * b) / (lambda_error * b)).filter(|r| r.is_finite())
}

/// Largest difference of the surrogate from finite elements at every law, % of F/N; none if no slide is near the
/// known ones. These laws check the result and do not change it.
fn checked(
    aligned: &mut AlignedSurrogate,
    fe: &mut FeFriction,
    laws: &[LawPoint],
) -> Result<Vec<Option<f64>>, IdentifyError> {
    let found = fe.found(laws, Missing::LeftOut)?;
    let mut difference = |(law, exact): (&LawPoint, Option<Vec<f64>>)| {
        let Some(exact) = exact else { return Ok(None) };
        Ok(Some(100.0 * largest_difference(&aligned.coefficients(law)?, &exact)))
    };
    laws.iter().zip(found).map(&mut difference).collect()
}

/// Influence of the law's regularisation on F/N: slides with less of it, by finite elements.
fn regularisation(law: &LawPoint, fe: &mut FeFriction, states: &[Steady]) -> Result<Regularisation, IdentifyError> {
    let friction = law.friction(&fe.base);
    let pressure_mpa = friction.regular_pressure_mpa;
    let mut probed = Regularisation { pressure_mpa, probed_share: 1.0, probed_percent: None };
    for probed_share in [0.5, 0.7, 0.85] {
        probed.probed_share = probed_share;
        match fe.slides(RubberFriction { regular_pressure_mpa: probed_share * pressure_mpa, ..friction }) {
            Ok(slides) => {
                let [a, b] =
                    [&slides[..], states].map(|s| s.iter().map(Steady::friction_coefficient).collect::<Vec<_>>());
                probed.probed_percent = Some(100.0 * largest_difference(&a, &b));
                break;
            }
            Err(error) if error.is_local() => {}
            Err(error) => return Err(error),
        }
    }
    Ok(probed)
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_at_a_bound_is_named_and_a_coarse_mesh_blamed() {
        let target = Target {
            coefficients: vec![2.0, 1.5, 1.4],
            slots: vec![0, 1, 2],
            weights: vec![1.0; 3],
            known: false,
            region: Region::default(),
            free_tau0: false,
        };
        let errors = Linear {
            standard_errors: vec![0.1, 0.2],
            correlation: vec![vec![1.0, 0.5], vec![0.5, 1.0]],
            conditioning: 1.0,
        };
        let remarks_at = |beta: f64, mesh_preset| {
            let law = LawPoint { tau_ref_kpa: 4.85, beta, tau0_share: 0.0 };
            let constants = [0, 1].map(|k| constant(k, &law, &target, &errors, None));
            (constants[1].at_bound, remarks(&constants, &target, true, mesh_preset))
        };
        let (bound, printed) = remarks_at(-0.9994, MeshPreset::Coarse);
        assert_eq!((bound, printed.len()), (Some(-1.0), 1), "{printed:?}");
        for part in ["beta = -0.9994", "bound -1.0000", "default mesh"] {
            assert!(printed[0].contains(part), "no `{part}` in {printed:?}");
        }
        let (bound, printed) = remarks_at(1.4999, MeshPreset::Default);
        assert_eq!((bound, printed[0].contains("mesh")), (Some(1.5), false), "{printed:?}");
        assert_eq!(remarks_at(0.46, MeshPreset::Coarse), (None, vec![]));
    }

    #[test]
    fn the_correlation_of_lambda_needs_no_variance() {
        let solution =
            |jacobian| Solution { values: vec![], residuals: vec![], jacobian, evaluations: 0, ended: String::new() };
        let two_rows = solution(vec![vec![1.0, 1.2], vec![-0.5, 0.1]]);
        let without = scaled_errors(&linear(&two_rows.jacobian, f64::NAN), &two_rows, None);
        let with = linear(&two_rows.jacobian, 0.3);
        let [a, b] = [without, with].map(|errors| correlation_of_lambda(&errors).unwrap());
        assert!((a - b).abs() < 1e-12 && a.abs() <= 1.0, "{a} {b}");
        let flat = solution(vec![vec![1.0, 1.0], vec![2.0, 2.0]]);
        assert_eq!(correlation_of_lambda(&scaled_errors(&linear(&flat.jacobian, f64::NAN), &flat, None)), None);
    }

    #[test]
    fn a_ring_follows_the_correlation_and_stays_near_and_inside() {
        let law = LawPoint { tau_ref_kpa: 6.0, beta: 0.2, tau0_share: 0.0 };
        let errors = |a: f64, b: f64, r: f64| Linear {
            standard_errors: vec![a, b],
            correlation: vec![vec![1.0, r], vec![r, 1.0]],
            conditioning: 1.0,
        };
        let x = law.coordinates(false);
        let away = |laws: &[LawPoint]| -> Vec<[f64; 2]> {
            laws.iter().map(|l| [l.tau_ref_kpa.ln() - x[0], l.beta - x[1]]).collect()
        };
        let narrow = away(&ring(&law, &errors(0.01, 0.04, 0.9), 2.0, &Region::default()));
        assert_eq!(narrow.len(), 8);
        assert!((narrow[0][0] - 0.02).abs() < 1e-12 && (narrow[0][1] - 0.072).abs() < 1e-12, "{narrow:?}");
        let wide = away(&ring(&law, &errors(0.3, f64::INFINITY, 0.0), 4.0, &Region::default()));
        assert!(wide.iter().all(|d| d[0].abs() <= 0.4 + 1e-12 && d[1].abs() <= 0.5 + 1e-12), "{wide:?}");
        let cut = ring(&law, &errors(0.01, 0.04, 0.0), 2.0, &Region { beta: [0.19, 1.0], ..Region::default() });
        assert!(cut.len() < 8 && cut.iter().all(|l| l.beta >= 0.19));
    }
}
