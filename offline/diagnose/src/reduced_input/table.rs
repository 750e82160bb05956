//! Diagnosis of a table of kinetic states: friction against load and area.
//!
//! Main function: [`diagnose_table`].

use crate::reduced_input::{Plot, ReducedDiagnosis, empty_report};
use crate::schema::{CandidateLaw, EffectFound, FittedParameter, NextExperiment, PlannedRun, Verdict, minutes};
use crate::statistics::tails::minus_ln_p;

/// A row of a table of kinetic states: depth mm, normal force N, friction coefficient, contact area mm².
pub type TableRow = [f64; 4];

/// Relative standard deviation of each force; a table has no spread of its own.
const ERROR: f64 = 0.02;
/// Gain over F proportional to N^(2/3) from which on the table disagrees with it, in 2 log likelihood.
const DISAGREES: f64 = 6.0;
/// Depths of the strokes that are proposed, mm.
const NEXT_DEPTHS_MM: [f64; 15] =
    [0.4, 0.5, 0.625, 0.75, 0.875, 1.0, 1.125, 1.25, 1.375, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0];

/// F = tau_0 A + a N by least squares of relative errors over points of N, A, F: tau_0, a, and the logarithms left.
fn constant_strength(points: &[[f64; 3]]) -> (f64, f64, Vec<f64>) {
    let (mut s, mut t) = ([[0.0; 2]; 2], [0.0; 2]);
    for [n, a, f] in points {
        let w = f.powi(-2);
        let x = [*a, *n];
        for i in 0..2 {
            t[i] += w * x[i] * f;
            for j in 0..2 {
                s[i][j] += w * x[i] * x[j];
            }
        }
    }
    let det = s[0][0] * s[1][1] - s[0][1] * s[1][0];
    let tau0 = (s[1][1] * t[0] - s[0][1] * t[1]) / det;
    let slope = (s[0][0] * t[1] - s[1][0] * t[0]) / det;
    let left = points.iter().map(|[n, a, f]| (f / (tau0 * a + slope * n)).max(1e-9).ln()).collect();
    (tau0, slope, left)
}

/// Least-squares slope of y over x.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let m = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / m, y.iter().sum::<f64>() / m);
    x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
}

/// Constant and residuals of y over x for a given slope.
fn with_slope(x: &[f64], y: &[f64], slope: f64) -> (f64, Vec<f64>) {
    let c = x.iter().zip(y).map(|(x, y)| y - slope * x).sum::<f64>() / x.len() as f64;
    (c, x.iter().zip(y).map(|(x, y)| y - c - slope * x).collect())
}

/// Squared residuals of logarithms over the error.
fn chi_squared(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| (r / ERROR).powi(2)).sum()
}

/// Fits to a table. Fields `ln_` are logarithms of its columns, residuals are of ln F.
struct TableFits<'a> {
    rows: &'a [TableRow],
    ln_n: Vec<f64>,
    ln_f: Vec<f64>,
    ln_d: Vec<f64>,
    ln_a: Vec<f64>,
    /// Normal force, area, friction of each row.
    measured: Vec<[f64; 3]>,
    /// Residuals of F proportional to N^(2/3).
    two_thirds: Vec<f64>,
    /// F = exp(k) N^exponent: exponent, k, residuals.
    free: (f64, f64, Vec<f64>),
    /// F = tau_0 A + slope N: tau_0, slope, residuals.
    constant_strength: (f64, f64, Vec<f64>),
    /// F = c N^beta A^(1 - beta) with the measured area in place of A ~ N^(2/3): beta, ln c, residuals.
    geometry: (f64, f64, Vec<f64>),
}

impl<'a> TableFits<'a> {
    fn new(rows: &'a [TableRow]) -> Self {
        let ln = |of: fn(&TableRow) -> f64| -> Vec<f64> { rows.iter().map(|r| of(r).ln()).collect() };
        let (ln_n, ln_f, ln_d, ln_a) = (ln(|r| r[1]), ln(|r| r[1] * r[2]), ln(|r| r[0]), ln(|r| r[3]));
        let (_, two_thirds) = with_slope(&ln_n, &ln_f, 2.0 / 3.0);
        let exponent = slope(&ln_n, &ln_f);
        let (k, free) = with_slope(&ln_n, &ln_f, exponent);
        let measured: Vec<[f64; 3]> = rows.iter().map(|r| [r[1], r[3], r[1] * r[2]]).collect();
        let constant_strength = constant_strength(&measured);
        let (pressure, stress) = over_area(&ln_n, &ln_f, &ln_a);
        let beta = slope(&pressure, &stress);
        let (c, shaped) = with_slope(&pressure, &stress, beta);
        let (free, geometry) = ((exponent, k, free), (beta, c, shaped));
        Self { rows, ln_n, ln_f, ln_d, ln_a, measured, two_thirds, free, constant_strength, geometry }
    }

    /// Gain of the free exponent, in 2 log likelihood.
    fn gain(&self) -> f64 {
        chi_squared(&self.two_thirds) - chi_squared(&self.free.2)
    }

    /// The row whose depth would have to be off, and by how much, mm, for a smooth power law of the normal force through
    /// the others.
    fn kink(&self) -> (usize, f64) {
        let mut kink = (f64::INFINITY, 0, 0.0);
        for i in 0..self.rows.len() {
            let keep = |v: &[f64]| v.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, v)| *v).collect::<Vec<_>>();
            let (x, y) = (keep(&self.ln_d), keep(&self.ln_n));
            let m = slope(&x, &y);
            let (c, left) = with_slope(&x, &y, m);
            let wanted = ((self.ln_n[i] - c) / m).exp();
            if chi_squared(&left) < kink.0 {
                kink = (chi_squared(&left), i, wanted - self.rows[i][0]);
            }
        }
        (kink.1, kink.2)
    }

    /// Root mean square of residuals of ln F as a force, N.
    fn rms_n(&self, residuals: &[f64]) -> [f64; 3] {
        let sum: f64 = residuals.iter().zip(self.rows).map(|(r, row)| (r * row[1] * row[2]).powi(2)).sum();
        [0.0, (sum / self.rows.len() as f64).sqrt(), 0.0]
    }

    /// The free exponent as an effect, with the explanations that the table cannot exclude.
    fn effect(&self) -> EffectFound {
        let (exponent, _, free) = &self.free;
        let own = chi_squared(free);
        let candidate = |name: &str, other: f64| CandidateLaw {
            law: name.into(),
            family: name.into(),
            delta_2ll: other - own,
            lambda_rival: (other - own).abs(),
        };
        let mean = self.ln_n.iter().sum::<f64>() / self.ln_n.len() as f64;
        let sxx: f64 = self.ln_n.iter().map(|x| (x - mean).powi(2)).sum();
        let half = 1.96 * ERROR / sxx.sqrt();
        let mut candidates = vec![
            candidate("load_exponent", own),
            candidate("tau_0", chi_squared(&self.constant_strength.2)),
            candidate("geometry", chi_squared(&self.geometry.2)),
        ];
        candidates.retain(|c| c.delta_2ll < 10.0);
        EffectFound {
            law: "load_exponent".into(),
            family: "load_exponent".into(),
            parameters: vec![FittedParameter {
                name: "exponent".into(),
                value: *exponent,
                unit: String::new(),
                ci95: [exponent - half, exponent + half],
            }],
            size_p90_relative: self.two_thirds.iter().map(|r| r.abs()).fold(0.0, f64::max),
            gain_2ll: self.gain(),
            p_model: (-minus_ln_p(self.gain(), 1)).exp(),
            p_runs: 1.0,
            against_calibration: false,
            outside_calibration: false,
            lambda_detect: self.gain(),
            candidates,
        }
    }

    /// Strokes at further depths, and what they are expected to add to the separation of exponent and constant strength.
    fn next_experiment(&self) -> NextExperiment {
        let (exponent, k, _) = self.free;
        // Friction by the free exponent at those depths, with load and area as powers of depth.
        let power = |y: &[f64]| {
            let m = slope(&self.ln_d, y);
            let (c, _) = with_slope(&self.ln_d, y, m);
            move |depth: f64| (c + m * depth.ln()).exp()
        };
        let (load, area) = (power(&self.ln_n), power(&self.ln_a));
        let planned = NEXT_DEPTHS_MM.iter().map(|&d| [load(d), area(d), k.exp() * load(d).powf(exponent)]);
        let expected: Vec<[f64; 3]> = self.measured.iter().copied().chain(planned).collect();
        let stroke = |d: &f64| PlannedRun {
            depth_mm: Some(*d),
            rest_before_s: Some(60.0),
            new_block: Some(true),
            ..PlannedRun::default()
        };
        let runs: Vec<_> = NEXT_DEPTHS_MM.iter().map(stroke).collect();
        NextExperiment {
            // Where load and area are powers of depth, exponent and geometry are one curve: strokes at other depths do
            // not separate them.
            separates: vec![["load_exponent".into(), "tau_0".into()]],
            factor: "depth_mm".into(),
            lambda_rival_expected: chi_squared(&constant_strength(&expected).2),
            minutes: minutes(&runs),
            prices: Vec::new(),
            runs,
        }
    }

    fn sentences(&self, disagrees: bool) -> Vec<String> {
        let percent =
            |r: &[f64]| r.iter().map(|r| format!("{:+.1}", 100.0 * r.exp_m1())).collect::<Vec<_>>().join(", ");
        let (exponent, k, free) = &self.free;
        let (tau0, slope_n, adhesive) = &self.constant_strength;
        let (beta, _, shaped) = &self.geometry;
        let (row, off_mm) = self.kink();
        vec![
            format!(
                "Against F proportional to N^(2/3) the table is off by {} % from light to heavy: {}.",
                percent(&self.two_thirds),
                if disagrees { "a trend, not scatter" } else { "within 2 %" }
            ),
            format!("A free exponent, F = {:.3} N^{exponent:.3}, leaves {} %.", k.exp(), percent(free)),
            format!(
                "A constant strength, F = {:.2} kPa A + {slope_n:.3} N, leaves {} %.",
                1000.0 * tau0,
                percent(adhesive)
            ),
            format!("The measured area in place of A ~ N^(2/3) with tau ~ p^{beta:.2} leaves {} %.", percent(shaped)),
            format!(
                "Normal force over depth has a kink; a depth at {} mm that is off by {off_mm:+.2} mm would remove it. It \
                 does not enter F over N.",
                self.rows[row][0]
            ),
            "Four means without their spread (2 % is assumed) do not separate exponent, constant strength, geometry and a \
             depth error. Loads from 0.03 to 5 N with the area measured at each, and the same depth approached several \
             times, would: a constant strength shows below 0.1 N, the exponent above 1 N, a depth error in the repeats."
                .to_owned(),
        ]
    }

    /// Friction coefficients: ratios show what forces over a decade would hide.
    fn plot(&self) -> Plot {
        let n = &self.ln_n;
        let area_slope = slope(n, &self.ln_a);
        let (area_at_one, _) = with_slope(n, &self.ln_a, area_slope);
        let curve = |ln_force: &dyn Fn(f64, f64) -> f64| -> Vec<[f64; 2]> {
            let (low, high) = (n[0].min(n[n.len() - 1]), n[0].max(n[n.len() - 1]));
            (0..=60)
                .map(|k| low - 0.3 + (high - low + 0.6) * f64::from(k) / 60.0)
                .map(|ln_n| [ln_n.exp(), (ln_force(ln_n, area_at_one + area_slope * ln_n) - ln_n).exp()])
                .collect()
        };
        let (two_thirds, _) = with_slope(n, &self.ln_f, 2.0 / 3.0);
        let (exponent, k, _) = self.free;
        let (tau0, slope_n, _) = self.constant_strength;
        let (beta, c, _) = self.geometry;
        Plot {
            title: "Friction coefficient over the normal force".into(),
            caption: "The table's rows and what is fitted to them; the area between rows is a power of the load."
                .into(),
            x: "Normal force, N".into(),
            y: "Friction over normal force".into(),
            square: false,
            points: vec![("the table".into(), self.rows.iter().map(|r| [r[1], r[2]]).collect())],
            curves: vec![
                ("N^(2/3)".into(), curve(&|ln_n, _| two_thirds + 2.0 / 3.0 * ln_n)),
                ("free exponent".into(), curve(&|ln_n, _| k + exponent * ln_n)),
                (
                    "constant strength".into(),
                    curve(&|ln_n, ln_a| (tau0 * ln_a.exp() + slope_n * ln_n.exp()).max(1e-9).ln()),
                ),
                ("measured area".into(), curve(&|ln_n, ln_a| c + beta * (ln_n - ln_a) + ln_a)),
            ],
        }
    }
}

/// Logarithms of mean pressure and mean shear stress.
fn over_area(ln_n: &[f64], ln_f: &[f64], ln_a: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let less = |x: &[f64]| x.iter().zip(ln_a).map(|(x, a)| x - a).collect();
    (less(ln_n), less(ln_f))
}

/// Diagnosis of a table of kinetic states against F proportional to N^(2/3).
///
/// The table has no spread; 2 % of each force is taken as its error, and said so.
pub fn diagnose_table(rows: &[TableRow]) -> ReducedDiagnosis {
    let fits = TableFits::new(rows);
    let disagrees = fits.gain() > DISAGREES;
    let verdict = if disagrees { Verdict::Ambiguous } else { Verdict::None };
    let before = fits.rms_n(&fits.two_thirds);
    let after = if disagrees { fits.rms_n(&fits.free.2) } else { before };
    let mean_square = rows.iter().map(|r| (r[1] * r[2]).powi(2)).sum::<f64>() / rows.len() as f64;
    let floor = [0.0, ERROR * mean_square.sqrt(), 0.0];
    let mut report =
        empty_report(verdict, "F proportional to N^(2/3)", [before, after], floor, "none: all rows fitted", rows.len());
    report.noise.multiplicative = ERROR;
    if disagrees {
        report.effects.push(fits.effect());
        report.next_experiment = Some(fits.next_experiment());
    }
    ReducedDiagnosis { report, sentences: fits.sentences(disagrees), plot: Some(fits.plot()) }
}
