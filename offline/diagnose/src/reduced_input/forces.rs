//! Diagnosis of a trace of forces: the tare of the sensor.

use crate::data::suspicions::of_trace;
use crate::data::trace_csv::{Trace, TraceRow};
use crate::laws::{LAWS, find};
use crate::reduced_input::tare::{LEAST_ROWS, Sliding, TARE_SD_N, TareFit, fit_tare, sliding_rows};
use crate::reduced_input::{Plot, ReducedDiagnosis, reduced_report};
use crate::schema::{BaselineParameter, CandidateLaw, Caution, EffectFound, FittedParameter, LawTest, Verdict};

/// Diagnosis of a trace of forces; what its readings call into doubt comes first.
pub fn diagnose_forces(trace: &Trace, alpha: f64) -> ReducedDiagnosis {
    let mut found = diagnose_rows(&trace.rows, alpha);
    let caution =
        |kind: &str, text: String| Caution { kind: kind.into(), role: "measured".into(), column: String::new(), text };
    let doubts = of_trace(&trace.rows).into_iter().map(|text| caution("unit", text));
    found.report.cautions =
        doubts.chain(trace.notes.iter().map(|note| caution("reading", format!("{note}.")))).collect();
    found.report.next_step = next_step(found.report.verdict).into();
    found
}

/// What to do next: forces alone show a tare and nothing else.
fn next_step(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Named => {
            "Take this tare off the forces; record depth and slides beside them to look for anything else."
        }
        Verdict::Ambiguous => "Record a second in the air before touch, which shows the tare by itself.",
        _ => "Record depth and slides beside the forces to look for anything else than a tare.",
    }
}

fn diagnose_rows(trace: &[TraceRow], alpha: f64) -> ReducedDiagnosis {
    let Some(fit) = fit_tare(trace) else { return too_few_rows(sliding_rows(trace).len()) };
    let carries = fit.carries();
    let claimable = if fit.air.is_some() { 0..3 } else { 1..3 };
    let found = carries && fit.p < alpha && claimable.into_iter().any(|k| excludes_zero(&fit, k));
    let verdict = match (found, carries) {
        (true, _) => Verdict::Named,
        (false, true) => Verdict::None,
        // A tare and none are both possible.
        (false, false) => Verdict::Ambiguous,
    };
    let rms = fit.rms_n.map(|r| [0.0, r, r]);
    let rms = if verdict == Verdict::Named { rms } else { [rms[0]; 2] };
    let mut report = reduced_report(
        verdict,
        "ring |F - b| = k (N - b_n)^m",
        rms,
        [0.0, fit.noise_n, fit.noise_n],
        "none: one trace",
        1,
    );
    report.noise.additive_n = fit.noise_n;
    if fit.sliding == Sliding::Shown {
        report.baseline.parameters = vec![
            parameter("friction_at_1_n", "N", fit.friction[0], f64::NAN),
            parameter("load_exponent", "", fit.friction[1], fit.exponent_sd),
        ];
    }
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
    match verdict {
        Verdict::Named => report.effects.push(tare_effect(&fit)),
        Verdict::Ambiguous => report.effects.push(tare_or_nothing(tare_effect(&fit))),
        _ => {}
    }
    let sentences = sentences(&fit, verdict);
    ReducedDiagnosis { report, sentences, plot: Some(ring_plot(trace, &fit)) }
}

/// What is said of a trace without a fit: a tare is as likely as before.
fn too_few_rows(rows: usize) -> ReducedDiagnosis {
    let mut report = reduced_report(Verdict::Ambiguous, "ring", [[0.0; 3]; 2], [0.0; 3], "none", 1);
    let half_n = TARE_SD_N.map(|sd| NORMAL_95 * sd);
    report.effects.push(tare_or_nothing(effect([0.0; 3], half_n, 0.0, 0.0, 1.0)));
    let sentences = vec![format!(
        "Too few rows in firm contact to say whether there is a tare: {rows}, where at least {LEAST_ROWS} are needed."
    )];
    ReducedDiagnosis { report, sentences, plot: None }
}

/// Standard deviations to the end of a 95 % interval.
const NORMAL_95: f64 = 1.96;

/// The effect beside the hypothesis that nothing is missing, where the trace cannot separate the two.
fn tare_or_nothing(mut effect: EffectFound) -> EffectFound {
    effect.candidates.push(CandidateLaw {
        law: "no_effect".into(),
        family: "no_effect".into(),
        delta_2ll: effect.gain_2ll,
        lambda_rival: effect.gain_2ll,
    });
    effect
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
    let friction_n = fit.friction[0] * fit.load_n[0].max(0.05).powf(fit.friction[1]);
    effect(fit.tare_n, fit.half_n, fit.tare_n[1].hypot(fit.tare_n[2]) / friction_n, fit.gain_2ll, fit.p)
}

/// A tare with the half-widths of its 95 % intervals, N.
///
/// * `size`: the tangential tare as a share of the friction
fn effect(tare_n: [f64; 3], half_n: [f64; 3], size: f64, gain_2ll: f64, p: f64) -> EffectFound {
    let names = ["normal_n", "x_n", "y_n"];
    EffectFound {
        law: "tare_bias".into(),
        family: "tare".into(),
        formula: find("tare_bias").map_or_else(String::new, |law| law.formula.into()),
        parameters: (0..3)
            .map(|k| FittedParameter {
                name: names[k].into(),
                value: tare_n[k],
                unit: "N".into(),
                ci95: [tare_n[k] - half_n[k], tare_n[k] + half_n[k]],
            })
            .collect(),
        size_p90_relative: size,
        gain_2ll,
        p,
        p_model: p,
        p_runs: p,
        lambda_detect: gain_2ll,
        candidates: vec![CandidateLaw { law: "tare_bias".into(), family: "tare".into(), ..CandidateLaw::default() }],
        ..EffectFound::default()
    }
}

/// Whether the normal tare cannot be separated from the exponent of friction in the load.
fn is_normal_inseparable(fit: &TareFit) -> bool {
    fit.normal_exponent_correlation.abs() > 0.7 || fit.half_n[0] > 0.15
}

/// Whether the 95 % interval of a component of the tare (normal, x, y) leaves out zero.
fn excludes_zero(fit: &TareFit, k: usize) -> bool {
    fit.tare_n[k].abs() > fit.half_n[k]
}

fn sentences(fit: &TareFit, verdict: Verdict) -> Vec<String> {
    let value = |k: usize| format!("{:+.2} ± {:.2} N", fit.tare_n[k], fit.half_n[k]);
    let named = |k: usize| format!("{} {}", ["normal", "x", "y"][k], value(k));
    let mut out = Vec::new();
    let known = if fit.air.is_some() { 0..3 } else { 1..3 };
    if verdict == Verdict::Named {
        let list = |claimed: bool| -> Vec<String> {
            known.clone().filter(|k| excludes_zero(fit, *k) == claimed).map(named).collect()
        };
        let rest = list(false);
        let rest = if rest.is_empty() {
            String::new()
        } else {
            format!(" Not claimed, because its interval holds zero: {}.", rest.join(", "))
        };
        let from = match &fit.air {
            Some(air) => format!("the {} rows before touch", air.rows),
            None => format!("{} rows in firm contact", fit.rows.len()),
        };
        out.push(format!("Missing: the sensor's tare, {} (95 %), from {from}.{rest}", list(true).join(", ")));
    } else if verdict == Verdict::Ambiguous {
        out.push(format!("This trace shows too little to separate a tare from none: x {}, y {}.", value(1), value(2)));
    } else {
        out.push(format!(
            "No tangential tare that these rows could show: x {}, y {}. Nothing but a tare was looked for: the laws of the finger need \
             its depth and the path of the plate.",
            value(1),
            value(2)
        ));
    }
    out.push(match (fit.sliding, fit.friction_tared) {
        (Sliding::OneDirection, _) => {
            "No friction coefficient: friction keeps one direction, as where a finger holds a weight, and nothing shows that it slides. Let the \
             finger slide back and forth."
                .into()
        }
        (Sliding::OffRing, _) => {
            "No friction coefficient: the forces do not show that the finger slides, because half the rows lie more than a quarter of the radius \
             off the ring around the tare."
                .into()
        }
        (Sliding::NotWithLoad, _) => {
            "No friction coefficient: friction turns but does not follow the normal force, as that of a held object that is turned does, and \
             nothing shows that the finger slides. Let it slide under loads that differ."
                .into()
        }
        (Sliding::Shown, Some([tared, open])) => format!(
            "Median friction coefficient: {:.2} as read, {tared:.2} ± {open:.2} with the whole tare taken off, the normal \
             force's included.",
            fit.friction_as_read
        ),
        (Sliding::Shown, None) => format!(
            "Median friction coefficient: {:.2} as read; without the tare it is not given, because the tare's intervals \
             leave more than 5 % of it open.",
            fit.friction_as_read
        ),
    });
    out.push(if fit.air.is_some() {
        format!("Normal tare {}, from the same rows.", value(0))
    } else if is_normal_inseparable(fit) {
        format!(
            "The normal tare ({}) cannot be separated from the exponent of friction in the load ({:.2} ± {:.2}; correlation \
             {:.2}): it is not claimed. A few rows in the air before the first touch would show it.",
            value(0),
            fit.friction[1],
            2.57 * fit.exponent_sd,
            fit.normal_exponent_correlation,
        )
    } else {
        format!("Normal tare {}.", value(0))
    });
    out
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::data::column_map::ColumnMap;
    use crate::data::median::median;
    use crate::data::trace_csv;
    use crate::reduced_input::air::RowsInAir;

    fn trace(name: &str) -> Vec<TraceRow> {
        let path = format!("{}/data/human_texture_exploration/{name}.csv", env!("CARGO_MANIFEST_DIR"));
        let map = ColumnMap::parse(Some("normal=-Fz,x=Fx,y=Fy,t=Timestamp"), None).unwrap();
        trace_csv::read(Path::new(&path), &map).unwrap().rows
    }

    #[test]
    fn a_component_whose_interval_holds_zero_is_not_claimed() {
        let whole = trace("July3_2_force_data_2");
        let pressed = &whole[fit_tare(&whole).unwrap().air.unwrap().rows..];
        let found = diagnose_rows(pressed, 0.01);
        for effect in &found.report.effects {
            let held = |k: usize| effect.parameters[k].ci95[0] <= 0.0 && effect.parameters[k].ci95[1] >= 0.0;
            let claimed = found.sentences[0].split("Not claimed").next().unwrap();
            for (k, name) in [(1, " x "), (2, " y ")] {
                assert!(!(held(k) && claimed.contains(name)), "{claimed}");
            }
        }
        if found.report.verdict == Verdict::None {
            assert!(found.report.tests.iter().all(|t| !t.significant));
        }
    }

    /// Forces of a finger on a plate, 20 a second, as a function of the time.
    fn made(rows: usize, force_n: impl Fn(f64) -> [f64; 3]) -> Vec<TraceRow> {
        logged(20.0, rows, 0.01, force_n)
    }

    /// The same at a rate and with a noise.
    fn logged(hz: f64, rows: usize, noise_n: f64, force_n: impl Fn(f64) -> [f64; 3]) -> Vec<TraceRow> {
        let row = |k: usize| {
            let t_s = k as f64 / hz;
            // A pattern of the size of the noise that has no period in common with the motion.
            let (k, t) = (k as f64 / 20.0, |c: usize| (c + 3) as f64);
            let noise = |c: usize| noise_n * ((7.3 * k * t(c) + c as f64).sin() + (91.7 * k).cos());
            let f = force_n(t_s);
            TraceRow { t_s, force_n: [0, 1, 2].map(|c| f[c] + noise(c)) }
        };
        (0..rows).map(row).collect()
    }

    /// Rows with which a trace begins are a tare only where the finger is off the sensor in them.
    #[test]
    fn a_trace_that_starts_in_contact_has_no_rows_before_touch() {
        let slides = |load: f64, angle: f64| [load, 0.7 * load * angle.cos(), 0.7 * load * angle.sin()];
        let tared = |f: [f64; 3]| [f[0] + 0.3, f[1] - 0.2, f[2] + 0.1];
        // A load that swells later, under which the finger moves from the start, or after a second and a half.
        let load =
            |t: f64| 0.36 + 0.04 * (9.0 * t).sin() + if t < 3.0 { 0.0 } else { 0.6 * (1.0 - (0.7 * (t - 3.0)).cos()) };
        let moving = |t: f64| slides(load(t), 2.2 * (2.9 * t).sin());
        let waiting = |t: f64| slides(if t < 1.5 { 0.36 } else { load(t) }, 2.2 * (1.3 * (t - 1.5).max(0.0)).sin());
        // The same finger from the air, and one that comes down slowly.
        let from_air = |t: f64| slides(load(t) * (t - 1.0).clamp(0.0, 1.0), 2.2 * (1.3 * t).sin());
        let slowly = |t: f64| slides(0.1 * (t - 3.0).max(0.0), 0.5 * t);
        for (hz, noise_n) in [(20.0, 0.01), (100.0, 0.002), (500.0, 0.0005)] {
            let rows = (30.0 * hz) as usize;
            for (name, touch_s, trace) in [
                ("moving", None, logged(hz, rows, noise_n, |t| tared(moving(t)))),
                ("moving, no tare", None, logged(hz, rows, noise_n, moving)),
                ("waiting", None, logged(hz, rows, noise_n, |t| tared(waiting(t)))),
                ("from air", Some(1.0), logged(hz, rows, noise_n, |t| tared(from_air(t)))),
                ("slowly", Some(3.0), logged(hz, rows, noise_n, |t| tared(slowly(t)))),
            ] {
                let air = RowsInAir::of(&trace);
                assert_eq!(air.is_some(), touch_s.is_some(), "{name} at {hz} Hz");
                if let (Some(air), Some(touch_s)) = (air, touch_s) {
                    let off: Vec<f64> = (0..3).map(|k| air.mean_n[k] - tared([0.0; 3])[k]).collect();
                    assert!(off.iter().all(|v| v.abs() < 0.02), "{name} at {hz} Hz: {off:?}");
                    assert!(
                        (0.9 * hz * touch_s..1.4 * hz * touch_s).contains(&(air.rows as f64)),
                        "{name}: {}",
                        air.rows
                    );
                }
                if hz < 50.0 {
                    let text = diagnose_rows(&trace, 0.01).sentences.join(" ");
                    assert_eq!(text.contains("rows before touch"), touch_s.is_some(), "{name}: {text}");
                }
            }
        }
    }

    /// Objects of half a newton that are turned in the hand without slip, under a constant grip and grips that change.
    #[test]
    fn a_held_object_that_is_turned_has_no_friction_coefficient() {
        let turned = |t: f64| 2.2 * (0.8 * t).sin();
        let once = |t: f64| std::f64::consts::PI * ((t - 8.0) / 15.0).clamp(0.0, 1.0);
        let grips: [(fn(f64) -> f64, fn(f64) -> f64, f64); 4] = [
            (|_| 2.0, turned, 2.0),
            (|t| 2.5 + 1.5 * (1.7 * t).sin(), turned, 2.0),
            (|t| 2.0 + 0.2 * (3.0 * t).sin(), once, 2.0),
            (|t| 2.0 + 0.2 * (3.0 * t).sin(), turned, -1.0),
        ];
        for (k, (grip, angle, air_s)) in grips.into_iter().enumerate() {
            let trace = logged(25.0, 750, 0.007, |t| {
                let on = ((t - air_s) / 0.5).clamp(0.0, 1.0);
                [on * grip(t), on * 0.5 * angle(t).cos(), on * 0.5 * angle(t).sin()]
            });
            let found = diagnose_rows(&trace, 0.01);
            let text = found.sentences.join(" ");
            assert!(text.contains("No friction coefficient") && !text.contains("Median"), "{k}: {text}");
            assert!(found.report.baseline.parameters.is_empty(), "{k}");
        }
    }

    /// A finger that circles on the plate has a friction coefficient. One that holds a weight has none, however constant its ratio of forces
    /// is, nor has one that is pushed about while it sticks.
    #[test]
    fn a_friction_coefficient_needs_a_finger_that_slides() {
        let load = |t: f64| 1.0 + 0.4 * (0.9 * t).sin();
        let circling = made(400, |t| [load(t), 0.6 * load(t) * (2.0 * t).cos(), 0.6 * load(t) * (2.0 * t).sin()]);
        let holding = made(400, |t| [load(t), 0.2 * load(t), 0.13 * load(t)]);
        let sticking =
            made(400, |t| [load(t), 0.5 * (0.7 * t).sin() * (1.9 * t).cos(), 0.4 * (1.3 * t).sin() * (0.4 * t).cos()]);
        for (trace, slides) in [(circling, true), (holding, false), (sticking, false)] {
            let found = diagnose_rows(&trace, 0.01);
            let text = found.sentences.join(" ");
            println!("{text}");
            assert_eq!(text.contains("Median friction coefficient: 0.6"), slides, "{text}");
            assert_eq!(text.contains("No friction coefficient"), !slides, "{text}");
            assert_eq!(found.report.baseline.parameters.is_empty(), !slides);
        }
    }

    /// A trace that is too short, or does not show that the finger slides, leaves open whether there is a tare.
    #[test]
    fn too_little_is_not_called_none() {
        let load = |t: f64| 1.0 + 0.4 * (0.9 * t).sin();
        let short = made(30, |t| [load(t), 0.6 * load(t) * (2.0 * t).cos(), 0.6 * load(t) * (2.0 * t).sin()]);
        let holding = made(400, |t| [load(t), 0.2 * load(t), 0.13 * load(t)]);
        for (trace, word) in [(short, "Too few rows in firm contact"), (holding, "too little to separate")] {
            let ReducedDiagnosis { report, sentences, .. } = diagnose_rows(&trace, 0.01);
            assert_eq!(report.verdict, Verdict::Ambiguous, "{sentences:?}");
            assert!(sentences[0].contains(word), "{sentences:?}");
            let families: Vec<&str> = report.effects[0].candidates.iter().map(|c| c.family.as_str()).collect();
            assert_eq!(families, ["tare", "no_effect"]);
        }
        let circling = made(400, |t| [load(t), 0.6 * load(t) * (2.0 * t).cos(), 0.6 * load(t) * (2.0 * t).sin()]);
        assert_ne!(diagnose_rows(&circling, 0.01).report.verdict, Verdict::Ambiguous);
    }

    /// Rows before touch are the tare: friction is that of the trace with their mean taken off, or it is not given.
    #[test]
    fn rows_before_touch_fix_the_whole_tare() {
        for name in ["July3_1_force_data_1", "July3_2_force_data_1", "July3_2_force_data_2", "July5_1_force_data_2"] {
            let whole = trace(name);
            let fit = fit_tare(&whole).unwrap();
            let air = fit.air.clone().unwrap_or_else(|| panic!("{name}: no rows before touch"));
            let truth: [f64; 3] = std::array::from_fn(|k| whole[..4].iter().map(|r| r.force_n[k]).sum::<f64>() / 4.0);
            for k in 0..3 {
                assert!((air.mean_n[k] - truth[k]).abs() < 0.12, "{name}: {air:?}, first rows {truth:?}");
            }
            let found = diagnose_rows(&whole, 0.01);
            assert!(found.sentences[0].contains("rows before touch"), "{:?}", found.sentences);
            let slides = |tare: [f64; 3]| {
                let of = |i: &usize| {
                    let f: [f64; 3] = std::array::from_fn(|k| whole[*i].force_n[k] - tare[k]);
                    f[1].hypot(f[2]) / f[0].max(0.02)
                };
                median(fit.rows.iter().map(of)).unwrap()
            };
            println!("{name}: {air:?} read {:.3} tared {:?}", fit.friction_as_read, fit.friction_tared);
            if let Some([tared, _]) = fit.friction_tared {
                assert!((tared / slides(truth) - 1.0).abs() < 0.05, "{name}: {tared} against {}", slides(truth));
            }
            // The rows in contact alone: within 5 % of it, or nothing.
            let alone = fit_tare(&whole[air.rows..]).unwrap();
            if let Some([tared, _]) = alone.friction_tared {
                assert!((tared / slides(truth) - 1.0).abs() < 0.05, "{name}: {tared} against {}", slides(truth));
            }
        }
    }
}
