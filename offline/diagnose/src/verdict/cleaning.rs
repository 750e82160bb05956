//! Rows that no force explains are left out of a file, with a caution for each kind, and what few runs cannot support is put into
//! words.

use fingerpad_formats::significant;
use fingerpad_smooth::ReferenceCurves;

use crate::data::lift_off::lift_off;
use crate::data::outliers::{Flags, at_rail, count, rails, spikes, without};
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::model::prediction::predict_runs;
use crate::model::row_noise::sigma_of;
use crate::schema::Caution;
use crate::selection::acceptance::LARGEST_P_ALONG_STROKE;
use crate::statistics::calibration::Calibration;

/// Names of the channels' columns.
pub const FORCES: [&str; 3] = ["normal_force_n", "friction_x_n", "friction_y_n"];

/// Readings far off the rows on both sides, by the residual from a calibrated finger.
pub fn spikes_of(set: &RunSet, Calibration { fit, noise, .. }: &Calibration, reference: &ReferenceCurves) -> Flags {
    let prediction = predict_runs(&reference.model(&fit.parameters), &set.runs, &fit.laws);
    let readings = set.runs.iter().flat_map(|r| r.force_n.iter().flatten());
    let residual: Vec<f64> = readings.zip(&prediction).map(|(y, p)| y - p).collect();
    spikes(set, &residual, &sigma_of(noise, &prediction))
}

/// A number of things in words, the thing in the singular where there is one.
fn counted(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// What is said of spikes that were left out.
pub fn spike_caution(role: &str, flags: &Flags, set: &RunSet) -> Option<Caution> {
    let (readings, rows) = (count(flags), set.rows());
    (readings > 0).then(|| Caution {
        kind: "spikes".into(),
        role: role.into(),
        column: String::new(),
        text: format!(
            "{} in {} of the {role} set {} far off the rows on both sides; {} left out.",
            counted(readings, "reading"),
            counted(rows, "row"),
            if readings == 1 { "lies" } else { "lie" },
            if readings == 1 { "it is" } else { "they are" }
        ),
    })
}

/// The set without the readings of the lift-off of each contact.
pub fn before_lift_off(set: &RunSet, role: &str, cautions: &mut Vec<Caution>) -> RunSet {
    let flags = lift_off(set);
    let runs = flags.iter().filter(|run| run.iter().flatten().any(|flag| *flag)).count();
    if runs == 0 {
        return set.clone();
    }
    cautions.push(Caution {
        kind: "lift_off".into(),
        role: role.into(),
        column: "depth_mm".into(),
        text: format!(
            "{} of {} of the {role} set after the last hold, in which the finger is unloaded, {} left out: tissue that has relaxed \
             unloads along another path.",
            counted(count(&flags) / 3, "row"),
            counted(runs, "run"),
            if count(&flags) == 3 { "is" } else { "are" }
        ),
    });
    without(set, &flags)
}

/// Runs from which on flips of whole runs reach p = 1 %.
const RUNS_FOR_FLIPS: usize = 8;

/// What so few runs cannot support.
pub fn few_runs_cautions(calibration: &RunSet, measured: &RunSet) -> impl Iterator<Item = Caution> {
    let caution = |role: &str, text: String| Caution {
        kind: "few_runs".into(),
        role: role.into(),
        column: "run_id".into(),
        text,
    };
    let few = |set: &RunSet| (set.runs.len() < RUNS_FOR_FLIPS).then_some(set.runs.len());
    let of_calibration = few(calibration).map(|runs| {
        let text = format!(
            "{runs} calibration runs: the scatter between runs, against which every effect is weighed, rests on {} degrees \
             of freedom.",
            runs - 3
        );
        caution("calibration", text)
    });
    let of_measured = few(measured).map(|runs| {
        let flips = 0.5f64.powi(runs as i32 - 1);
        let along_stroke = if flips > LARGEST_P_ALONG_STROKE {
            " Laws that fade along the stroke (static_peak, contact_ageing) cannot be named."
        } else {
            ""
        };
        let text = format!(
            "{runs} measured runs: signs of whole runs can be flipped in {} ways only, so that p_runs is {flips:.3} at least \
             where 0.01 is asked of {RUNS_FOR_FLIPS} runs and more; a law or a structure then needs evidence by the likelihood \
             that is stronger by orders of magnitude (p_model 1e-4, 1e-6).{along_stroke}",
            1usize << (runs - 1)
        );
        caution("measured", text)
    });
    of_calibration.into_iter().chain(of_measured)
}

/// The set without readings at a sensor's rail.
///
/// # Errors
/// [`DiagnoseError::Unusable`] where most readings lie there.
pub fn off_rails(set: &RunSet, role: &str, cautions: &mut Vec<Caution>) -> Result<RunSet, DiagnoseError> {
    let rails = rails(set);
    if rails.is_empty() {
        return Ok(set.clone());
    }
    cautions.extend(rails.iter().map(|rail| Caution {
        kind: "sensor_rail".into(),
        role: role.into(),
        column: FORCES[rail.channel].into(),
        text: format!(
            "The sensor, not the finger: {} of the {role} set ends at {} N in {} of {}, the sensor's rail. These \
             readings are left out; a sensor with a larger range is needed for what lies there.",
            FORCES[rail.channel],
            significant(rail.force_n, 4),
            counted(rail.rows, "row"),
            counted(rail.runs, "run")
        ),
    }));
    let left = without(set, &at_rail(set, &rails));
    let in_contact = || set.runs.iter().flat_map(|r| &r.rows).filter(|r| r.depth_mm > 0.0).count();
    match rails.iter().find(|r| r.rows > in_contact() / 2) {
        None => Ok(left),
        Some(rail) => Err(DiagnoseError::Unusable {
            path: set.path.clone(),
            problem: format!(
                "line {}, column {}: {} N, the sensor's rail, in {} of {} rows in contact: what is left carries no diagnosis",
                set.runs[0].line,
                FORCES[rail.channel],
                significant(rail.force_n, 4),
                rail.rows,
                in_contact()
            ),
        }),
    }
}
