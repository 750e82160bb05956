//! Test whether a table distinguishes tau_0, the strength without pressure, from beta.

use super::{
    IdentifyError, LawPoint, Settings,
    bounded_least_squares::Stop,
    confidence::{Growth, Interval},
    friction_fit::{Target, fit},
    outcome::Tau0Outcome,
    surrogate::{AlignedSurrogate, FrictionModel},
};

/// Frees tau_0 on the surrogate.
pub fn tau0_test(
    settings: &Settings,
    held: &Target,
    law: &LawPoint,
    aligned: &mut AlignedSurrogate,
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
        Interval { low, high, bounded: [low > 0.0, high < 0.9] }
    });
    let percent = format!("{:.0} %", 100.0 * settings.confidence);
    let sentence = match &allowed {
        None => format!(
            "With tau_0 free, {} coefficients leave no degree of freedom for three constants: tau_0 cannot be distinguished from beta.",
            held.coefficients.len()
        ),
        Some(i) if i.bounded[0] => format!(
            "The table contains a strength that does not depend on pressure: tau_0 is {:.0} to {:.0} % of the strength at 5 kPa ({percent}).",
            100.0 * i.low,
            100.0 * i.high
        ),
        Some(i) if i.bounded[1] => {
            format!("tau_0 is at most {:.0} % of the strength at 5 kPa ({percent}); 0 is not excluded.", 100.0 * i.high)
        }
        Some(_) => {
            let (first, last) = (rows.first().expect("19 rows"), rows.last().expect("19 rows"));
            format!(
                "The table cannot distinguish tau_0 from beta: any tau_0 from 0 to 90 % of the strength at 5 kPa is allowed ({percent}), \
                 with beta going from {:.2} to {:.2}.",
                first[2], last[2]
            )
        }
    };
    Ok(Tau0Outcome { law: best, sum_of_squares, sum_of_squares_held, profile: rows, allowed, sentence })
}
