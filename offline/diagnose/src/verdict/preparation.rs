//! Before the diagnosis: rows that no force explains are left out, and what the files cannot support is put into words.
//!
//! Main types: [`Prepared`], [`Cautions`].

use fingerpad_formats::significant;
use fingerpad_smooth::ReferenceCurves;

use crate::data::lag::{Lag, with_lag};
use crate::data::outliers::{Flags, at_rail, count, rails, spikes, without};
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::model::prediction::predict_runs;
use crate::model::row_noise::{RowNoise, sigma_of};
use crate::schema::Caution;
use crate::selection::acceptance::{LARGEST_P_ALONG_STROKE, SelectionSettings};
use crate::selection::finger_laws::with_finger_laws;
use crate::statistics::calibration::{Calibration, calibrate};
use crate::statistics::fit::{Fit, FitStart};
use crate::statistics::lag::{LagEstimate, estimate};

/// Names of the channels' columns.
pub const FORCES: [&str; 3] = ["normal_force_n", "friction_x_n", "friction_y_n"];
/// Rounds in which the spikes of a calibration are looked for: spikes make the noise look larger than it is.
const ROUNDS: usize = 4;

/// The sets without rows that no force explains, and the calibration.
pub struct Prepared {
    /// Runs without an effect.
    pub calibration_set: RunSet,
    /// Runs to be explained.
    pub measured: RunSet,
    /// The calibration.
    pub calibration: Calibration,
    /// The lag of the forces in the calibration, which the sets above have.
    pub lag: Option<LagEstimate>,
    /// What was left out.
    pub cautions: Vec<Caution>,
}

/// Leaves out readings at a rail and spikes, and calibrates, the finger's own laws among what is calibrated.
///
/// # Errors
/// [`DiagnoseError`] where too little is left, or the calibration has no likelihood.
pub fn prepare(
    calibration: &RunSet,
    measured: &RunSet,
    reference: &ReferenceCurves,
    settings: &SelectionSettings,
) -> Result<Prepared, DiagnoseError> {
    let mut cautions: Vec<Caution> = few_runs_cautions(calibration, measured).collect();
    let railed_off = off_rails(calibration, "calibration", &mut cautions)?;
    let mut calibration_set = railed_off.clone();
    let mut found = calibrate(&calibration_set, reference, &[]);
    let mut flagged = Flags::new();
    for _ in 0..ROUNDS {
        let now = spikes_of(&railed_off, &found.fit, &found.noise, reference);
        if now == flagged || (flagged.is_empty() && count(&now) == 0) {
            break;
        }
        calibration_set = without(&railed_off, &now);
        found = calibrate(&calibration_set, reference, &[]);
        flagged = now;
    }
    cautions.extend(spike_caution("calibration", count(&flagged), railed_off.rows()));
    let lag = lag_of_calibration(&calibration_set, &found, reference);
    if let Some(found_lag) = &lag {
        calibration_set = with_lag(&calibration_set, found_lag.lag);
        found = calibrate(&calibration_set, reference, &[]);
    }
    found = with_finger_laws(&calibration_set, reference, found, settings);
    let measured = clean(&with_lag(measured, lag_of(&lag)), "measured", &found, reference, &mut cautions)?;
    Ok(Prepared { calibration_set, measured, calibration: found, lag, cautions })
}

/// The lag of an estimate; no lag where none was found.
pub fn lag_of(lag: &Option<LagEstimate>) -> Lag {
    lag.map_or_else(Lag::default, |found| found.lag)
}

/// The lag of the forces in effect-free runs.
fn lag_of_calibration(set: &RunSet, calibration: &Calibration, reference: &ReferenceCurves) -> Option<LagEstimate> {
    estimate(set, calibration, reference, &Calibration::before(reference), FitStart::from(&calibration.fit))
}

/// A set measured after the calibration, without readings at a rail and spikes.
///
/// * `role`: `measured` or `holdout`
///
/// # Errors
/// [`DiagnoseError`] where too little is left.
pub fn clean(
    set: &RunSet,
    role: &str,
    calibration: &Calibration,
    reference: &ReferenceCurves,
    cautions: &mut Vec<Caution>,
) -> Result<RunSet, DiagnoseError> {
    let off = off_rails(set, role, cautions)?;
    let flagged = spikes_of(&off, &calibration.fit, &calibration.noise, reference);
    cautions.extend(spike_caution(role, count(&flagged), off.rows()));
    Ok(without(&off, &flagged))
}

fn spikes_of(set: &RunSet, fit: &Fit, noise: &[RowNoise; 3], reference: &ReferenceCurves) -> Flags {
    let prediction = predict_runs(&reference.model(&fit.parameters), &set.runs, &fit.laws);
    let readings = set.runs.iter().flat_map(|r| r.force_n.iter().flatten());
    let residual: Vec<f64> = readings.zip(&prediction).map(|(y, p)| y - p).collect();
    spikes(set, &residual, &sigma_of(noise, &prediction))
}

/// A number of things in words, the thing in the singular where there is one.
fn counted(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

fn spike_caution(role: &str, readings: usize, rows: usize) -> Option<Caution> {
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

/// Runs from which on flips of whole runs reach p = 1 %.
const RUNS_FOR_FLIPS: usize = 8;

/// What so few runs cannot support.
fn few_runs_cautions(calibration: &RunSet, measured: &RunSet) -> impl Iterator<Item = Caution> {
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

fn off_rails(set: &RunSet, role: &str, cautions: &mut Vec<Caution>) -> Result<RunSet, DiagnoseError> {
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
