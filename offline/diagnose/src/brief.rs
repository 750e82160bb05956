//! Diagnoses without depth or without runs: forces alone, and a table of four points.

use super::force_only::{TareFit, TraceRow, fit_tare};
use super::heldout::Gap;
use super::laws::LAWS;
use super::schema::{
    Baseline, BaselineParameter, CandidateLaw, Diagnosis, Disagreement, EffectFound, FittedParameter, LawTest,
    NoiseFound, Rescale, ScatterRatio, UnexplainedFound,
};
use super::verdict::Verdict;
use super::{NextExperiment, PlannedRun};

/// A diagnosis that has sentences and one figure.
pub struct Brief {
    /// The report.
    pub report: Diagnosis,
    /// The page's sentences.
    pub sentences: Vec<String>,
    /// The figure.
    pub plot: Option<Plot>,
}

/// Points and curves of a figure.
pub struct Plot {
    /// Over the figure.
    pub title: String,
    /// Under it.
    pub caption: String,
    /// Name of the axis to the right.
    pub x: String,
    /// Name of the axis upwards.
    pub y: String,
    /// Whether both axes have one scale.
    pub square: bool,
    /// Names and places of points.
    pub points: Vec<(String, Vec<[f64; 2]>)>,
    /// Names and corners of curves.
    pub curves: Vec<(String, Vec<[f64; 2]>)>,
}

/// A row of a table of kinetic states: depth mm, normal force N, friction coefficient, contact area mm².
pub type TableRow = [f64; 4];

fn bare(verdict: Verdict, model: &str, rms: [[f64; 3]; 2], floor: [f64; 3], method: &str, runs: usize) -> Diagnosis {
    let ratio = |r: [f64; 3]| (0..3).map(|k| if floor[k] > 0.0 { r[k] / floor[k] } else { 0.0 }).fold(0.0, f64::max);
    Diagnosis {
        schema: "fingerpad-diagnosis/1".into(),
        verdict,
        effects: Vec::new(),
        disagreement: Disagreement {
            rms_n: rms[0],
            floor_rms_n: floor,
            ratio: std::array::from_fn(|k| if floor[k] > 0.0 { rms[0][k] / floor[k] } else { 0.0 }),
            regions: Vec::new(),
        },
        baseline: Baseline {
            model: model.into(),
            parameters: Vec::new(),
            rescale: Rescale { stiffness: 1.0, strength: 1.0 },
            calibration_misfit: [0.0; 3],
        },
        noise: NoiseFound {
            additive_n: 0.0,
            multiplicative: 0.0,
            run_gain_normal: 0.0,
            run_gain_friction: 0.0,
            run_offset_n: 0.0,
            depth_zero_mm: 0.0,
            source: "residual".into(),
        },
        tests: Vec::new(),
        unexplained: UnexplainedFound {
            significant: false,
            column: String::new(),
            channel: String::new(),
            gain: 0.0,
            p_model: 1.0,
            p_runs: 1.0,
            scatter_ratio: ScatterRatio { normal: 1.0, friction: 1.0 },
            partial: Vec::new(),
        },
        holdout: Gap {
            method: method.into(),
            runs,
            rms_before_n: rms[0],
            rms_after_n: rms[1],
            floor_rms_n: floor,
            ratio_before: ratio(rms[0]),
            ratio_after: ratio(rms[1]),
            refused_after_n: None,
        },
        fe_confirmation: None,
        next_experiment: None,
        corrected_model: None,
        corrected_rms_n: None,
        input: Vec::new(),
        seed: 0,
        version: env!("CARGO_PKG_VERSION").into(),
        elapsed_s: 0.0,
    }
}

/// Diagnosis of a trace of forces.
pub fn force_only(trace: &[TraceRow], alpha: f64) -> Brief {
    let Some(fit) = fit_tare(trace) else {
        let report = bare(Verdict::None, "ring", [[0.0; 3]; 2], [0.0; 3], "none", 1);
        let sentences = vec!["Too few rows in firm contact to say anything about the tare.".into()];
        return Brief { report, sentences, plot: None };
    };
    let carries = fit.half_n[1].max(fit.half_n[2]) < 0.5;
    let found = fit.p < alpha;
    let verdict = if found && carries { Verdict::Named } else { Verdict::None };
    let rms = fit.rms_n.map(|r| [0.0, r, r]);
    let rms = if verdict == Verdict::Named { rms } else { [rms[0]; 2] };
    let mut report =
        bare(verdict, "ring |F - b| = k (N - b_n)^m", rms, [0.0, fit.noise_n, fit.noise_n], "none: one trace", 1);
    report.noise.additive_n = fit.noise_n;
    report.baseline.parameters = vec![
        parameter("friction_at_1_n", "N", fit.friction[0], f64::NAN),
        parameter("load_exponent", "", fit.friction[1], fit.exponent_sd),
    ];
    for law in LAWS {
        let own = law.name == "tare_bias";
        report.tests.push(LawTest {
            law: law.name.into(),
            family: law.family.into(),
            gain_2ll: if own { fit.gain_2ll } else { 0.0 },
            p_model: if own { fit.p } else { 1.0 },
            p_runs: if own { fit.p } else { 1.0 },
            significant: own && found,
            testable: own,
            reason: if own { String::new() } else { "forces alone: no depth, no path of the plate".into() },
        });
    }
    let inseparable = fit.normal_exponent_correlation.abs() > 0.7 || fit.half_n[0] > 0.15;
    if verdict == Verdict::Named {
        report.effects.push(tare_effect(&fit));
    }
    let sentences = sentences(&fit, verdict, carries, inseparable);
    Brief { report, sentences, plot: Some(ring_plot(trace, &fit)) }
}

/// Friction of a trace in the sensor's plane, rings of the fit around the tare.
fn ring_plot(trace: &[TraceRow], fit: &TareFit) -> Plot {
    let place = |i: usize| [trace[i].force_n[1], trace[i].force_n[2]];
    let (slides, rests): (Vec<usize>, Vec<usize>) = (0..trace.len()).partition(|i| fit.rows.contains(i));
    let ring = |load: f64| -> Vec<[f64; 2]> {
        let turn = |k: i32| std::f64::consts::TAU * f64::from(k) / 72.0;
        (0..=72)
            .map(|k| {
                let radius = fit.radius_n(load, turn(k));
                [fit.tare_n[1] + radius * turn(k).cos(), fit.tare_n[2] + radius * turn(k).sin()]
            })
            .collect()
    };
    let (w, h) = (fit.half_n[1], fit.half_n[2]);
    let ellipse = (0..=48)
        .map(|k| std::f64::consts::TAU * f64::from(k) / 48.0)
        .map(|a| [fit.tare_n[1] + w * a.cos(), fit.tare_n[2] + h * a.sin()])
        .collect();
    Plot {
        title: "Friction in the sensor's plane".into(),
        caption: format!(
            "Readings of the sensor along x and y. Rows in firm contact are fitted; the others (before touch, light \
             contact) are not. Rings: fitted friction at the 5 and 95 % of the load as read ({:.2} and {:.2} N). Without a \
             tare they would lie around zero.",
            fit.load_n[0], fit.load_n[1]
        ),
        x: "Friction along x, N".into(),
        y: "Friction along y, N".into(),
        square: true,
        points: vec![
            ("in firm contact".into(), slides.into_iter().map(place).collect()),
            ("other rows".into(), rests.into_iter().map(place).collect()),
        ],
        curves: vec![
            ("ring, light".into(), ring(fit.load_n[0])),
            ("ring, heavy".into(), ring(fit.load_n[1])),
            ("tare, 95 %".into(), ellipse),
        ],
    }
}

fn parameter(name: &str, unit: &str, value: f64, sd: f64) -> BaselineParameter {
    let sd = if sd.is_finite() { sd } else { 0.0 };
    BaselineParameter { name: name.into(), unit: unit.into(), value, sd, calibrated: value, calibrated_sd: sd }
}

fn tare_effect(fit: &TareFit) -> EffectFound {
    let names = ["normal_n", "x_n", "y_n"];
    EffectFound {
        law: "tare_bias".into(),
        family: "tare".into(),
        parameters: (0..3)
            .map(|k| FittedParameter {
                name: names[k].into(),
                value: fit.tare_n[k],
                unit: "N".into(),
                ci95: [fit.tare_n[k] - fit.half_n[k], fit.tare_n[k] + fit.half_n[k]],
            })
            .collect(),
        size_p90_relative: fit.tare_n[1].hypot(fit.tare_n[2])
            / (fit.friction[0] * fit.load_n[0].max(0.05).powf(fit.friction[1])),
        gain_2ll: fit.gain_2ll,
        p_model: fit.p,
        p_runs: fit.p,
        against_calibration: false,
        lambda_detect: fit.gain_2ll,
        candidates: vec![CandidateLaw {
            law: "tare_bias".into(),
            family: "tare".into(),
            delta_2ll: 0.0,
            lambda_rival: 0.0,
        }],
    }
}

fn sentences(fit: &TareFit, verdict: Verdict, carries: bool, inseparable: bool) -> Vec<String> {
    let mut out = Vec::new();
    let value = |k: usize| format!("{:+.2} ± {:.2} N", fit.tare_n[k], fit.half_n[k]);
    if verdict == Verdict::Named {
        out.push(format!(
            "Missing: the sensor's tare, x {}, y {} (95 %), from {} rows in firm contact.",
            value(1),
            value(2),
            fit.rows.len()
        ));
        out.push(format!(
            "Median friction coefficient: {:.2} as read, {:.2} with the tangential tare taken off.",
            fit.friction_coefficient[0], fit.friction_coefficient[1]
        ));
    } else if !carries {
        out.push(format!("This trace carries too little to tell a tare: x {}, y {}.", value(1), value(2)));
    } else {
        out.push(format!("No tangential tare that these rows could show: x {}, y {}.", value(1), value(2)));
    }
    out.push(if inseparable {
        format!(
            "The normal tare ({}) cannot be separated from the exponent of friction in the load ({:.2} ± {:.2}; correlation {:.2}): it is not claimed. A row in the air would tell it.",
            value(0), fit.friction[1], 2.57 * fit.exponent_sd, fit.normal_exponent_correlation
        )
    } else {
        format!("Normal tare {}.", value(0))
    });
    out
}

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

/// Diagnosis of a table of kinetic states against F proportional to N^(2/3).
///
/// The table has no spread; 2 % of each force is taken as its error, and said so.
pub fn table(rows: &[TableRow]) -> Brief {
    const ERROR: f64 = 0.02;
    let n: Vec<f64> = rows.iter().map(|r| r[1].ln()).collect();
    let f: Vec<f64> = rows.iter().map(|r| (r[1] * r[2]).ln()).collect();
    let d: Vec<f64> = rows.iter().map(|r| r[0].ln()).collect();
    let a: Vec<f64> = rows.iter().map(|r| r[3].ln()).collect();
    let with_slope = |x: &[f64], y: &[f64], slope: f64| -> (f64, Vec<f64>) {
        let c = x.iter().zip(y).map(|(x, y)| y - slope * x).sum::<f64>() / x.len() as f64;
        (c, x.iter().zip(y).map(|(x, y)| y - c - slope * x).collect())
    };
    let slope = |x: &[f64], y: &[f64]| {
        let m = x.len() as f64;
        let (mx, my) = (x.iter().sum::<f64>() / m, y.iter().sum::<f64>() / m);
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
    };
    let chi2 = |r: &[f64]| r.iter().map(|r| (r / ERROR).powi(2)).sum::<f64>();
    let (_, plain) = with_slope(&n, &f, 2.0 / 3.0);
    let exponent = slope(&n, &f);
    let (k, free) = with_slope(&n, &f, exponent);
    let measured: Vec<[f64; 3]> = rows.iter().map(|r| [r[1], r[3], r[1] * r[2]]).collect();
    let (tau0, slope_n, adhesive) = constant_strength(&measured);
    // Geometry: the measured area instead of A ~ N^(2/3), with a free beta: F = c N^beta A^(1 - beta).
    let pressure: Vec<f64> = n.iter().zip(&a).map(|(n, a)| n - a).collect();
    let stress: Vec<f64> = f.iter().zip(&a).map(|(f, a)| f - a).collect();
    let beta = slope(&pressure, &stress);
    let (_, shaped) = with_slope(&pressure, &stress, beta);
    // N over depth: which single depth would have to be off, for a smooth power law through the others.
    let mut kink = (f64::INFINITY, 0, 0.0);
    for i in 0..rows.len() {
        let keep = |v: &[f64]| v.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, v)| *v).collect::<Vec<_>>();
        let (x, y) = (keep(&d), keep(&n));
        let m = slope(&x, &y);
        let (c, left) = with_slope(&x, &y, m);
        let wanted = ((n[i] - c) / m).exp();
        if chi2(&left) < kink.0 {
            kink = (chi2(&left), i, wanted - rows[i][0]);
        }
    }
    let gain = chi2(&plain) - chi2(&free);
    let rms = |r: &[f64]| {
        let sum: f64 = r.iter().zip(rows).map(|(r, row)| (r * row[1] * row[2]).powi(2)).sum();
        [0.0, (sum / rows.len() as f64).sqrt(), 0.0]
    };
    let floor =
        [0.0, ERROR * (rows.iter().map(|r| (r[1] * r[2]).powi(2)).sum::<f64>() / rows.len() as f64).sqrt(), 0.0];
    let disagrees = gain > 6.0;
    let verdict = if disagrees { Verdict::Ambiguous } else { Verdict::None };
    let after = if disagrees { rms(&free) } else { rms(&plain) };
    let mut report =
        bare(verdict, "F proportional to N^(2/3)", [rms(&plain), after], floor, "none: all rows fitted", rows.len());
    report.noise.multiplicative = ERROR;
    if disagrees {
        let own = chi2(&free);
        let candidate = |name: &str, other: f64| CandidateLaw {
            law: name.into(),
            family: name.into(),
            delta_2ll: other - own,
            lambda_rival: (other - own).abs(),
        };
        let sxx: f64 = n.iter().map(|x| (x - n.iter().sum::<f64>() / n.len() as f64).powi(2)).sum();
        let half = 1.96 * ERROR / sxx.sqrt();
        let mut candidates = vec![
            candidate("load_exponent", own),
            candidate("tau_0", chi2(&adhesive)),
            candidate("geometry", chi2(&shaped)),
        ];
        candidates.retain(|c| c.delta_2ll < 10.0);
        report.effects.push(EffectFound {
            law: "load_exponent".into(),
            family: "load_exponent".into(),
            parameters: vec![FittedParameter {
                name: "exponent".into(),
                value: exponent,
                unit: String::new(),
                ci95: [exponent - half, exponent + half],
            }],
            size_p90_relative: plain.iter().map(|r| r.abs()).fold(0.0, f64::max),
            gain_2ll: gain,
            p_model: (-super::chance::surprise(gain, 1)).exp(),
            p_runs: 1.0,
            against_calibration: false,
            lambda_detect: gain,
            candidates,
        });
        let depths: [f64; 15] = [0.4, 0.5, 0.625, 0.75, 0.875, 1.0, 1.125, 1.25, 1.375, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0];
        // What the free exponent would give there, with load and area as powers of depth.
        let power = |y: &[f64]| {
            let m = slope(&d, y);
            let (c, _) = with_slope(&d, y, m);
            move |depth: f64| (c + m * depth.ln()).exp()
        };
        let (load, area) = (power(&n), power(&a));
        let planned = depths.iter().map(|&d| [load(d), area(d), k.exp() * load(d).powf(exponent)]);
        let expected: Vec<[f64; 3]> = measured.iter().copied().chain(planned).collect();
        report.next_experiment = Some(NextExperiment {
            // Where load and area are powers of depth, exponent and geometry are one curve: strokes at other depths do
            // not separate them.
            separates: vec![["load_exponent".into(), "tau_0".into()]],
            factor: "depth_mm".into(),
            lambda_rival_expected: chi2(&constant_strength(&expected).2),
            runs: depths
                .iter()
                .map(|d| PlannedRun {
                    depth_mm: Some(*d),
                    rest_before_s: Some(60.0),
                    new_block: Some(true),
                    ..PlannedRun::default()
                })
                .collect(),
        });
    }
    let percent = |r: &[f64]| r.iter().map(|r| format!("{:+.1}", 100.0 * r.exp_m1())).collect::<Vec<_>>().join(", ");
    let sentences = vec![
        format!("Against F proportional to N^(2/3) the table is off by {} % from light to heavy: {}.", percent(&plain), if disagrees { "a trend, not scatter" } else { "within 2 %" }),
        format!("A free exponent, F = {:.3} N^{exponent:.3}, leaves {} %.", k.exp(), percent(&free)),
        format!("A constant strength, F = {:.2} kPa A + {slope_n:.3} N, leaves {} %.", 1000.0 * tau0, percent(&adhesive)),
        format!("The measured area in place of A ~ N^(2/3) with tau ~ p^{beta:.2} leaves {} %.", percent(&shaped)),
        format!("Normal force over depth has a kink; a depth at {} mm that is off by {:+.2} mm would remove it. It does not enter F over N.", rows[kink.1][0], kink.2),
        "Four means without their spread (2 % is assumed) do not separate exponent, constant strength, geometry and a depth error. Loads from 0.03 to 5 N with the area measured at each, and the same depth approached several times, would: a constant strength shows below 0.1 N, the exponent above 1 N, a depth error in the repeats.".to_owned(),
    ];
    // Ratios show what forces over a decade would hide.
    let over = |x: &dyn Fn(f64, f64) -> f64| -> Vec<[f64; 2]> {
        let (low, high) = (n[0].min(n[n.len() - 1]), n[0].max(n[n.len() - 1]));
        let area = |ln_n: f64| {
            let m = slope(&n, &a);
            let (c, _) = with_slope(&n, &a, m);
            c + m * ln_n
        };
        (0..=60)
            .map(|k| low - 0.3 + (high - low + 0.6) * f64::from(k) / 60.0)
            .map(|ln_n| [ln_n.exp(), (x(ln_n, area(ln_n)) - ln_n).exp()])
            .collect()
    };
    let (c_plain, _) = with_slope(&n, &f, 2.0 / 3.0);
    let (c_shaped, _) = with_slope(&pressure, &stress, beta);
    let plot = Plot {
        title: "Friction coefficient over the normal force".into(),
        caption: "The table's rows and what is fitted to them; the area between rows is a power of the load.".into(),
        x: "Normal force, N".into(),
        y: "Friction over normal force".into(),
        square: false,
        points: vec![("the table".into(), rows.iter().map(|r| [r[1], r[2]]).collect())],
        curves: vec![
            ("N^(2/3)".into(), over(&|ln_n, _| c_plain + 2.0 / 3.0 * ln_n)),
            ("free exponent".into(), over(&|ln_n, _| k + exponent * ln_n)),
            ("constant strength".into(), over(&|ln_n, ln_a| (tau0 * ln_a.exp() + slope_n * ln_n.exp()).max(1e-9).ln())),
            ("measured area".into(), over(&|ln_n, ln_a| c_shaped + beta * (ln_n - ln_a) + ln_a)),
        ],
    };
    Brief { report, sentences, plot: Some(plot) }
}
