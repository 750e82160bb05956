//! How sure the law is: errors, intervals, region, and what to say of them.

use super::{
    IdentifyError, LawPoint, REFERENCE_MPA, Region, Settings, Steady, Table,
    against::against,
    bounded_least_squares::Solution,
    friction_fit::Target,
    on_rig::OnRig,
    outcome::{Constant, LawOutcome, Regularisation},
    surrogate::{Aligned, Friction},
    uncertainty::{Growth, Interval, Linear, linear, map, profile},
};
use fingerpad_fe::contact::RubberFriction;

/// A law that fits, with the fit.
pub struct Fitted<'a> {
    /// Table that it fits.
    pub table: &'a Table,
    /// What was fitted.
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
/// Where standard errors are so large that a surrogate would have to reach too far, the ring is drawn closer.
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

/// Errors, intervals and region of a fitted law.
///
/// `aligned` is the surrogate at the law; it is bent to the finite elements around it.
///
/// # Errors
/// [`IdentifyError`] of a fit, or of the finite elements where it is not of one law.
pub fn certainty(
    fitted: &Fitted,
    settings: &Settings,
    aligned: &mut Aligned,
    fe: &mut OnRig,
) -> Result<LawOutcome, IdentifyError> {
    let Fitted { table, target, law, solution, states } = *fitted;
    let rows = target.coefficients.len();
    let least: f64 = solution.residuals.iter().map(|r| r * r).sum();
    let growth = Growth::of(least, rows, target.constants(), target.known, settings.confidence);
    let errors = linear(&solution.jacobian, growth.map_or(f64::NAN, |g| g.variance));
    if let Some(growth) = growth {
        let mut known = Vec::new();
        let ring = ring(&law, &errors, (growth.two / growth.variance).sqrt(), &settings.region);
        fe.prepare(&ring);
        for around in ring {
            if let Some(coefficients) = found(fe, &around)? {
                known.push((around, coefficients));
            }
        }
        aligned.bend(&known);
    }
    let mut remarks = Vec::new();
    let mut constants = Vec::new();
    let mut region_check_percent = Vec::new();
    let mut beta_ends = None;
    let mut profiles = Vec::new();
    for k in 0..target.constants() {
        let error = Some(errors.standard_errors[k]).filter(|e| e.is_finite());
        let profiled = match growth {
            Some(growth) => Some(profile(aligned, target, &law, k, error.unwrap_or(0.1), growth.one)?),
            None => None,
        };
        profiles.push((error, profiled));
    }
    let ends: Vec<LawPoint> = profiles.iter().flat_map(|(_, p)| p.iter().flat_map(|(_, ends)| *ends)).collect();
    fe.prepare(&ends);
    for (k, (error, profiled)) in profiles.into_iter().enumerate() {
        let interval = match profiled {
            Some((interval, ends)) => {
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
        let constant = constant(k, &law, target, error, interval);
        remarks.extend(constant.interval.as_ref().and_then(|i| remark(&constant.name, i)));
        constants.push(constant);
    }
    if growth.is_none() {
        remarks.push(format!(
            "{rows} coefficients for {} constants leave no degree of freedom: no error can be told.",
            target.constants()
        ));
    }
    let map = match growth {
        Some(growth) => {
            let [tau_ref_kpa, beta] = [0, 1].map(|k| around(&constants[k], settings, k));
            Some(map(aligned, target, &law, growth.two, tau_ref_kpa, beta, 61)?)
        }
        None => None,
    };
    Ok(LawOutcome {
        law,
        constants,
        lambda: law.lambda(),
        lambda_range: beta_ends.map(|ends| ends.map(|end| end.lambda())),
        correlation: errors.correlation[0][1],
        correlation_of_lambda: correlation_of_lambda(&errors),
        regularisation: regularisation(&law, fe, states)?,
        coefficient_error: growth.map(|g| if target.known { 0.0 } else { g.variance.sqrt() }).filter(|e| *e > 0.0),
        error_is_known: target.known,
        confidence: settings.confidence,
        map,
        region_check_percent,
        against: against(table, &law, &fe.base, states),
        remarks,
    })
}

/// A constant as it is told: strength and tau_0 in kPa.
fn constant(k: usize, law: &LawPoint, target: &Target, error: Option<f64>, interval: Option<Interval>) -> Constant {
    let (name, unit) = [("strength at 5 kPa", "kPa"), ("beta", ""), ("tau_0", "kPa")][k];
    let told = |value: f64| match k {
        0 => value.exp(),
        1 => value,
        _ => value * law.tau_ref_kpa,
    };
    let scale = [law.tau_ref_kpa, 1.0, law.tau_ref_kpa][k];
    Constant {
        name: name.into(),
        unit: unit.into(),
        value: told(law.coordinates(target.free_tau0)[k]),
        standard_error: error.map(|e| e * scale),
        interval: interval.map(|i| Interval { low: told(i.low), high: told(i.high), ..i }),
    }
}

fn remark(name: &str, interval: &Interval) -> Option<String> {
    if interval.is_flat() {
        return Some(format!("The table says nothing of {name}: no value in the search region is excluded."));
    }
    let side = if interval.bounded[0] { "above" } else { "below" };
    (interval.bounded != [true, true])
        .then(|| format!("The table does not bound {name} from {side} inside the search region."))
}

/// What a map shows of a constant: its interval and almost half as much on either side.
fn around(constant: &Constant, settings: &Settings, k: usize) -> [f64; 2] {
    let [low, high] = [settings.region.tau_ref_kpa, settings.region.beta][k];
    constant.interval.as_ref().map_or([low, high], |i| {
        let reach = 0.45 * (i.high - i.low);
        [(i.low - reach).max(low), (i.high + reach).min(high)]
    })
}

/// Correlation of ln lambda and beta: ln lambda = ln tau_ref - beta ln p_ref.
fn correlation_of_lambda(errors: &Linear) -> f64 {
    let (a, b) = (errors.standard_errors[0], errors.standard_errors[1]);
    let correlation = errors.correlation[0][1];
    let lever = REFERENCE_MPA.ln();
    let lambda_error = (a * a - 2.0 * lever * correlation * a * b + lever * lever * b * b).sqrt();
    (correlation * a * b - lever * b * b) / (lambda_error * b)
}

/// Finite elements at a law; none where there is no slide.
fn found(fe: &mut OnRig, law: &LawPoint) -> Result<Option<Vec<f64>>, IdentifyError> {
    match fe.coefficients(law) {
        Ok(coefficients) => Ok(Some(coefficients)),
        Err(error) if error.is_local() => Ok(None),
        Err(error) => Err(error),
    }
}

/// Largest difference of the surrogate from finite elements at a law, % of F/N; none where there is no slide.
fn checked(aligned: &mut Aligned, fe: &mut OnRig, law: &LawPoint) -> Result<Option<f64>, IdentifyError> {
    let Some(exact) = found(fe, law)? else { return Ok(None) };
    Ok(Some(100.0 * largest_difference(&aligned.coefficients(law)?, &exact)))
}

/// What the law's regularisation is worth: less of it, by finite elements.
fn regularisation(law: &LawPoint, fe: &mut OnRig, states: &[Steady]) -> Result<Regularisation, IdentifyError> {
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
