//! Initial guess of the fit: power laws over depth, read directly from presses and straight slides.
//!
//! Uses runs and [`InitialGuess`].

use super::parameterisation::InitialGuess;
use super::{Kind, ReduceError, Run, Sample};

/// Least-squares power law `factor d^exponent` through positive points (depth, value).
fn power_law(points: &[(f64, f64)], what: &str) -> Result<[f64; 2], ReduceError> {
    let logs: Vec<(f64, f64)> =
        points.iter().filter(|(d, v)| *d > 0.0 && *v > 0.0).map(|(d, v)| (d.ln(), v.ln())).collect();
    let n = logs.len() as f64;
    let (sx, sy) = logs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    let (sxx, sxy) = logs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 * p.0, s.1 + p.0 * p.1));
    let exponent = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    if !(logs.len() >= 3 && exponent.is_finite()) {
        return Err(ReduceError::Runs(format!(
            "{} points of different depth for {what}; at least 3 are needed: run more of the design (--design full)",
            logs.len()
        )));
    }
    Ok([((sy - exponent * sx) / n).exp(), exponent.clamp(0.2, 3.0)])
}

/// Reads normal force and area from presses; friction limit, stiffness and its ratio from straight slides.
///
/// # Errors
/// [`ReduceError::Runs`] if there are too few of them.
pub fn initial_guess(runs: &[&Run]) -> Result<InitialGuess, ReduceError> {
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
        let (Some(first), Some(last)) = (slides.first(), slides.last()) else { continue };
        let before = run.samples[run.samples.len() - slides.len() - 1];
        let depth = f64::from(last.depth_mm);
        let [x, y] = first.slide_mm.map(f64::from);
        let [fx, fy] = [0, 1].map(|k| f64::from(first.friction_n[k] - before.friction_n[k]));
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
    if limit.len() < 3 || power_law(&limit, "").is_err() {
        // Slides that end too early still give the exponent of the limit; the fit corrects the factor.
        limit.append(&mut below_limit);
    }
    let x = power_law(&stiffness_x, "the stiffness along x (slides within 11° of it)")?;
    let y = power_law(&stiffness_y, "the stiffness along y (slides within 11° of it)")?;
    Ok(InitialGuess {
        normal: power_law(&normal, "the normal force (presses)")?,
        area: power_law(&area, "the contact area (presses)")?,
        limit: power_law(&limit, "the friction limit (slides until everything slips)")?,
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
        let [factor, exponent] = power_law(&points, "x").unwrap();
        assert!((factor - 0.3).abs() < 1e-12 && (exponent - 1.7).abs() < 1e-12);
        assert!(power_law(&points[..2], "the area").unwrap_err().to_string().contains("2 points"));
        assert!(power_law(&[(1.0, 2.0); 9], "the area").is_err());
    }
}
