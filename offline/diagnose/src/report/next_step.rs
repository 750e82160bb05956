//! What to do next, in one sentence for every verdict.
//!
//! Main function: [`next_step`].

use crate::schema::{Confirmed, Diagnosis, IMPLAUSIBLE, Verdict};

/// Laws whose test needs a column that is missing or constant are named up to so many.
const NAMED: usize = 3;

/// The next step after a diagnosis, with what was found so far: confirmation and corrected model among it.
pub fn next_step(report: &Diagnosis) -> String {
    if report.cautions.iter().any(|caution| ["exchanged", "unit", IMPLAUSIBLE].contains(&caution.kind.as_str())) {
        return "Settle the warnings first: the verdict may rest on a mistake in the files.".into();
    }
    match report.verdict {
        Verdict::None => after_none(report),
        Verdict::Named => after_named(report),
        Verdict::Ambiguous => match &report.next_experiment {
            Some(plan) => format!(
                "Run the {} strokes of next_experiment.csv and repeat the command with their file behind --append.",
                plan.runs.len()
            ),
            None => {
                "Record runs that vary the drivers of the candidates one by one, and append them with --append.".into()
            }
        },
        Verdict::UnexplainedStructure => after_unexplained(report),
    }
}

fn after_none(report: &Diagnosis) -> String {
    let blind = report.tests.iter().filter(|t| !t.testable).take(NAMED).map(|t| t.law.replace('_', " "));
    let blind: Vec<String> = blind.collect();
    if blind.is_empty() {
        return "Use the model as calibrated; --power says how small an effect these runs would have shown.".into();
    }
    format!(
        "Use the model as calibrated; these runs could not test {}: record and vary the columns of those that matter.",
        blind.join(", ")
    )
}

fn after_named(report: &Diagnosis) -> String {
    let text = if report.holdout.refused_after_n.is_some() {
        "Do not correct the model yet: record more runs over the driver of the effect, and append them with --append."
    } else if report.effects.iter().all(|effect| effect.law == "force_lag") {
        "Mend the lag at its source, or keep forces and positions on one clock, and record the runs again."
    } else {
        match report.fe_confirmation.as_ref().map(|fe| fe.confirmed) {
            Some(Confirmed::Yes) => "Use corrected.fpm, and the effect with these numbers in the finite elements.",
            Some(Confirmed::Open) => {
                "Use corrected.fpm; whether the finite elements follow needs a finger of its own shape (--shape, --config) or strokes with \
                 more of the effect."
            }
            Some(Confirmed::InPart | Confirmed::No) => {
                "Use corrected.fpm; give the finite elements the finger's own shape (--shape, --config) before the effect is used there."
            }
            None if report.holdout.method == "file" => {
                "Use corrected.fpm; --confirm-fe tests whether the effect does the same inside the finite elements."
            }
            None => {
                "Record further runs over the driver of the effect and give them to --holdout: the runs behind this number helped to choose \
                 the effect."
            }
        }
    };
    text.into()
}

fn after_unexplained(report: &Diagnosis) -> String {
    match report.unexplained.column.as_str() {
        "run_id" | "" => "Record what differed from run to run (moisture, temperature, load, rest, who and when) as columns, and repeat the \
                          command."
            .into(),
        "t_s" => "Repeat the first conditions at the end of a session: what changes with the clock alone is wear, run-in or drying.".into(),
        column => format!(
            "Record runs that vary {} by itself, or write a law of your own over it (--laws).",
            column.replace(" x ", " and ").replace("slide_x_mm,slide_y_mm", "the place on the plate")
        ),
    }
}

#[cfg(test)]
mod tests {
    use crate::schema::{Confirmed, FeConfirmation};

    fn confirmation(before: f64, after: f64) -> FeConfirmation {
        let rms_n = |ratio: f64| [0.01 * ratio, 0.004, 0.003];
        FeConfirmation {
            confirmed: Confirmed::default(),
            mesh: "coarse".into(),
            rms_before_n: rms_n(before),
            rms_after_n: rms_n(after),
            floor_rms_n: [0.01; 3],
            shape: "d".into(),
            set: "holdout".into(),
            runs: vec!["a".into()],
            without_equilibrium: Vec::new(),
            calibration_runs: Vec::new(),
            calibration_rms_n: [0.01; 3],
            stiffness: 1.0,
            strength: 1.0,
            reduced_before_n: rms_n(before),
            reduced_after_n: rms_n(after),
        }
        .judged()
    }

    /// A gap that was as small before, or that hardly falls, confirms nothing, however near the floor it is.
    #[test]
    fn a_confirmation_counts_where_the_gap_falls() {
        for (before, after, wanted) in [
            (2.70, 1.44, Confirmed::Yes),
            (0.92, 0.92, Confirmed::Open),
            (1.26, 1.23, Confirmed::Open),
            (9.77, 9.51, Confirmed::Open),
            (9.77, 5.0, Confirmed::InPart),
            (1.0, 1.3, Confirmed::No),
        ] {
            assert_eq!(confirmation(before, after).confirmed, wanted, "{before} to {after}");
        }
    }
}
