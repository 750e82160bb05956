//! Diagnosis of a trace of forces: the tare of the sensor.

use crate::data::trace_csv::TraceRow;
use crate::laws::LAWS;
use crate::reduced_input::tare::{TareFit, fit_tare};
use crate::reduced_input::{Plot, ReducedDiagnosis, reduced_report};
use crate::schema::{BaselineParameter, CandidateLaw, EffectFound, FittedParameter, LawTest, Verdict};

/// Diagnosis of a trace of forces.
pub fn diagnose_forces(trace: &[TraceRow], alpha: f64) -> ReducedDiagnosis {
    let Some(fit) = fit_tare(trace) else {
        let report = reduced_report(Verdict::None, "ring", [[0.0; 3]; 2], [0.0; 3], "none", 1);
        let sentences = vec!["Too few rows in firm contact to say anything about the tare.".into()];
        return ReducedDiagnosis { report, sentences, plot: None };
    };
    let carries = fit.half_n[1].max(fit.half_n[2]) < 0.5;
    let found = fit.p < alpha && (excludes_zero(&fit, 1) || excludes_zero(&fit, 2));
    let verdict = if found && carries { Verdict::Named } else { Verdict::None };
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
    if verdict == Verdict::Named {
        report.effects.push(tare_effect(&fit));
    }
    let sentences = sentences(&fit, trace, verdict, carries);
    ReducedDiagnosis { report, sentences, plot: Some(ring_plot(trace, &fit)) }
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

/// Whether the normal tare cannot be told from the exponent of friction in the load.
fn is_normal_inseparable(fit: &TareFit) -> bool {
    fit.normal_exponent_correlation.abs() > 0.7 || fit.half_n[0] > 0.15
}

/// Whether the 95 % interval of a component of the tare (normal, x, y) leaves out zero.
fn excludes_zero(fit: &TareFit, k: usize) -> bool {
    fit.tare_n[k].abs() > fit.half_n[k]
}

fn sentences(fit: &TareFit, trace: &[TraceRow], verdict: Verdict, carries: bool) -> Vec<String> {
    let value = |k: usize| format!("{:+.2} ± {:.2} N", fit.tare_n[k], fit.half_n[k]);
    let named = |k: usize| format!("{} {}", ["normal", "x", "y"][k], value(k));
    let mut out = Vec::new();
    if verdict == Verdict::Named {
        let list = |claimed: bool| -> Vec<String> {
            [1, 2].into_iter().filter(|k| excludes_zero(fit, *k) == claimed).map(named).collect()
        };
        let rest = list(false);
        let rest = if rest.is_empty() {
            String::new()
        } else {
            format!(" Not claimed, because its interval holds zero: {}.", rest.join(", "))
        };
        let rows = fit.rows.len();
        let claimed = list(true).join(", ");
        out.push(format!("Missing: the sensor's tare, {claimed} (95 %), from {rows} rows in firm contact.{rest}"));
        out.push(format!(
            "Median friction coefficient: {:.2} as read, {:.2} with the tangential tare taken off.",
            fit.friction_coefficient[0], fit.friction_coefficient[1]
        ));
    } else if !carries {
        out.push(format!("This trace carries too little to tell a tare: x {}, y {}.", value(1), value(2)));
    } else {
        out.push(format!("No tangential tare that these rows could show: x {}, y {}.", value(1), value(2)));
    }
    out.push(if is_normal_inseparable(fit) {
        format!(
            "The normal tare ({}) cannot be separated from the exponent of friction in the load ({:.2} ± {:.2}; correlation \
             {:.2}): it is not claimed. {}",
            value(0),
            fit.friction[1],
            2.57 * fit.exponent_sd,
            fit.normal_exponent_correlation,
            rows_in_air(fit, trace)
        )
    } else {
        format!("Normal tare {}.", value(0))
    });
    out
}

/// A sentence on the rows in the air that would tell the normal tare: those with which the trace begins, if it does.
fn rows_in_air(fit: &TareFit, trace: &[TraceRow]) -> String {
    const FEWEST: usize = 3;
    let leading = fit.rows.first().copied().unwrap_or(0);
    if leading < FEWEST {
        return "A row in the air would tell it.".into();
    }
    let mean = trace[..leading].iter().map(|r| r.force_n[0]).sum::<f64>() / leading as f64;
    format!(
        "The {leading} rows before the first firm contact read {mean:+.2} N on average: where the finger did not touch yet, \
         that is the tare."
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::data::trace_csv;

    fn trace(name: &str) -> Vec<TraceRow> {
        let path = format!("{}/../../data/human_texture_exploration/{name}.csv", env!("CARGO_MANIFEST_DIR"));
        trace_csv::read(Path::new(&path), Some("normal=-Fz,x=Fx,y=Fy,t=Timestamp")).unwrap()
    }

    #[test]
    fn a_component_whose_interval_holds_zero_is_not_claimed() {
        let found = diagnose_forces(&trace("July3_2_force_data_2"), 0.01);
        assert_eq!(found.report.verdict, Verdict::Named);
        let [low, high] = found.report.effects[0].parameters[1].ci95;
        assert!(low < 0.0 && high > 0.0, "{low} {high}");
        let (claimed, rest) = found.sentences[0].split_once("Not claimed").unwrap();
        assert!(
            claimed.contains(" y -0.46") && !claimed.contains(" x ") && rest.contains(" x -0.21"),
            "{}",
            found.sentences[0]
        );
        let both = diagnose_forces(&trace("July3_1_force_data_1"), 0.01);
        assert!(!both.sentences[0].contains("Not claimed") && both.sentences[0].contains(" x -0.94"));
    }

    #[test]
    fn rows_in_the_air_are_asked_for_only_where_there_are_none() {
        let whole = trace("July3_1_force_data_1");
        let told = |trace: &[TraceRow]| diagnose_forces(trace, 0.01).sentences.pop().unwrap();
        assert!(told(&whole).contains("rows before the first firm contact"), "{}", told(&whole));
        let first = fit_tare(&whole).unwrap().rows[0];
        let pressed: Vec<TraceRow> = whole[first..].to_vec();
        assert!(told(&pressed).contains("A row in the air would tell it"), "{}", told(&pressed));
    }
}
