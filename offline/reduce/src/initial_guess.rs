//! Initial guess of the fit: power laws over depth, read directly from presses and straight slides.
//!
//! Uses runs and [`InitialGuess`].

use super::parameterisation::InitialGuess;
use super::{Kind, ReduceError, Run, Sample};

/// Least-squares power law `factor d^exponent` through positive points (depth, value).
///
/// * `usual`: exponent of contacts of this kind, which points at nearly one depth leave where it is
fn power_law(points: &[(f64, f64)], usual: f64, what: &str) -> Result<[f64; 2], ReduceError> {
    let logs: Vec<(f64, f64)> =
        points.iter().filter(|(d, v)| *d > 0.0 && *v > 0.0).map(|(d, v)| (d.ln(), v.ln())).collect();
    if logs.len() < 3 {
        return Err(ReduceError::Runs(format!(
            "{} points for {what}; at least 3 are needed: run more of the design (--design full)",
            logs.len()
        )));
    }
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let [x, y] = [mean(|p| p.0), mean(|p| p.1)];
    let (sxx, sxy) = logs.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x).powi(2), s.1 + (p.0 - x) * (p.1 - y)));
    let prior = PRIOR * n;
    let exponent = ((sxy + prior * usual) / (sxx + prior)).clamp(usual - MOST_UNUSUAL, usual + MOST_UNUSUAL).max(0.2);
    Ok([(y - exponent * x).exp(), exponent])
}

/// Weight of the usual exponent: variance of the logarithm of the depth of points that determine it as well.
const PRIOR: f64 = 0.002;
/// Friction of a row that the stiffness is read from, share of that of the last row.
const SEEN: f64 = 0.2;
/// Largest distance of an exponent from the usual one.
const MOST_UNUSUAL: f64 = 1.5;

/// Reads normal force and area from presses; friction limit, stiffness and its ratio from straight slides.
///
/// * `coulomb`: friction over normal force in full slip, where it is the same at every depth
///
/// # Errors
/// [`ReduceError::Runs`] if there are too few of them.
pub fn initial_guess(runs: &[&Run], coulomb: Option<f64>) -> Result<InitialGuess, ReduceError> {
    let (mut normal, mut area, mut limit, mut stiffness_x, mut stiffness_y) = (vec![], vec![], vec![], vec![], vec![]);
    let mut below_limit = vec![];
    for run in runs {
        let still = |s: &&Sample| s.slide_mm == [0.0; 2];
        let mut deepest = 0.0;
        for s in run.samples.iter().take_while(still).filter(|s| s.depth_mm > 0.05) {
            if s.depth_mm > deepest {
                deepest = s.depth_mm;
                normal.push((f64::from(s.depth_mm), f64::from(s.normal_force_n)));
                area.push((f64::from(s.depth_mm), f64::from(s.contact_area_mm2)));
            }
        }
        if run.kind != Kind::Straight {
            continue;
        }
        let slides: Vec<&Sample> = run.samples.iter().skip_while(still).collect();
        let Some(last) = slides.last() else { continue };
        let before = run.samples[run.samples.len() - slides.len() - 1];
        let depth = f64::from(last.depth_mm);
        let rise = |s: &Sample| [0, 1].map(|k| f64::from(s.friction_n[k] - before.friction_n[k]));
        let size = |s: &Sample| rise(s).into_iter().fold(0.0, f64::hypot);
        // The first row may hold a slide so small that its friction is noise.
        let Some(first) = slides.iter().find(|s| size(s) > SEEN * size(last)) else { continue };
        let [x, y] = first.slide_mm.map(f64::from);
        let [fx, fy] = rise(first);
        if x.abs() > 5.0 * y.abs() {
            stiffness_x.push((depth, fx / x));
        } else if y.abs() > 5.0 * x.abs() {
            stiffness_y.push((depth, fy / y));
        }
        let friction = f64::from(last.friction_n[0].hypot(last.friction_n[1]));
        if last.stick_ratio < 0.05 {
            limit.push((depth, friction));
        } else {
            below_limit.push((depth, friction));
        }
    }
    if limit.len() < 3 {
        // Slides that end too early still give the exponent of the limit; the fit corrects the factor.
        limit.append(&mut below_limit);
    }
    let normal = power_law(&normal, 1.7, "the normal force (presses)")?;
    let limit = match coulomb {
        Some(lambda) => [lambda * normal[0], normal[1]],
        None => power_law(&limit, normal[1], "the friction limit (slides until everything slips)")?,
    };
    let x = power_law(&stiffness_x, 0.7, "the stiffness along x (slides within 11° of it)")?;
    let y = power_law(&stiffness_y, 0.7, "the stiffness along y (slides within 11° of it)")?;
    Ok(InitialGuess {
        normal,
        area: power_law(&area, 1.0, "the contact area (presses)")?,
        limit,
        stiffness: x,
        ratio: (y[0] / x[0]).clamp(0.3, 3.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_and_too_little_is_refused() {
        let points: Vec<_> = (1..20).map(|i| (0.1 * f64::from(i), 0.3 * (0.1 * f64::from(i)).powf(1.7))).collect();
        let [factor, exponent] = power_law(&points, 1.5, "x").unwrap();
        assert!((factor - 0.3).abs() < 1e-3 && (exponent - 1.7).abs() < 2e-3, "{factor} {exponent}");
        assert!(power_law(&points[..2], 1.0, "the area").unwrap_err().to_string().contains("2 points"));
        // Points at one depth have the value there, and the usual exponent.
        let [factor, exponent] = power_law(&[(0.5, 2.0); 9], 1.5, "the area").unwrap();
        assert!(exponent == 1.5 && (factor * 0.5_f64.powf(1.5) - 2.0).abs() < 1e-12);
    }
}
