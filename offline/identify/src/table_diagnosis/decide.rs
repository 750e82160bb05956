//! Constants and effects that the table does not determine, and the experiment that would.

use fingerpad_diagnose::{NextExperiment, PlannedRun, minutes};

use super::fit::Fitted;
use super::measured::MeasuredTable;
use super::parameters::{Effect, Parameter, Values};
use super::reading::{Surface, predict};

/// Depths from which the plan chooses, as shares of the table's least and largest, and their number.
const RANGE: [f64; 2] = [0.6, 1.15];
const DEPTHS: usize = 12;
/// Depths of the plan, and the number of approaches to each.
const CHOSEN: usize = 3;
const REPEATS: usize = 3;
/// Error of a reading in the plan, as a share, and of an unloaded reading, N.
const READING: f64 = 0.03;
const UNLOADED_N: f64 = 0.003;

/// Rival fits and their surface.
pub struct Rivals<'a> {
    /// The table.
    pub table: &'a MeasuredTable,
    /// The regression.
    pub surface: &'a dyn Surface,
    /// The best fit first.
    pub fits: Vec<&'a Fitted>,
}

/// A fit's values without errors of single depths, which another experiment does not repeat.
fn repeatable(fitted: &Fitted) -> Values {
    let mut values = fitted.values.clone();
    values.depth_errors_mm.iter_mut().for_each(|e| *e = 0.0);
    values
}

/// Separation of two sets of readings in units of the plan's error, squared.
fn separation(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|q| ((a[q] / b[q]).ln() / READING).powi(2)).sum()
}

impl Rivals<'_> {
    /// Depths, mm, that are tried.
    fn depths_mm(&self) -> Vec<f64> {
        let depths = &self.table.depths_mm;
        let [least, most] = [depths[0] * RANGE[0], depths[depths.len() - 1] * RANGE[1]];
        (0..DEPTHS).map(|k| least * (most / least).powf(k as f64 / (DEPTHS - 1) as f64)).collect()
    }

    /// Strokes at the depths where best fit and nearest rival differ most, each several times and in blocks of their own.
    pub fn next_experiment(&self) -> Option<NextExperiment> {
        let best = self.fits.first()?;
        let rivals = &self.fits[1..];
        if rivals.is_empty() {
            return None;
        }
        let depths = self.depths_mm();
        let readings = |fitted: &Fitted| -> Vec<[f64; 3]> {
            let values = repeatable(fitted);
            depths.iter().map(|d| predict(self.surface, &values, &[*d])[0]).collect()
        };
        let own = readings(best);
        let others: Vec<Vec<[f64; 3]>> = rivals.iter().map(|r| readings(r)).collect();
        // The least separation from any rival counts at each depth.
        let least = |k: usize| others.iter().map(|o| separation(&own[k], &o[k])).fold(f64::INFINITY, f64::min);
        let mut order: Vec<usize> = (0..depths.len()).collect();
        order.sort_by(|a, b| least(*b).total_cmp(&least(*a)));
        let mut chosen: Vec<usize> = Vec::new();
        for k in order {
            // Neighbours give the same information.
            if chosen.len() < CHOSEN && chosen.iter().all(|c| c.abs_diff(k) > 2) {
                chosen.push(k);
            }
        }
        let unloaded = |other: &Fitted| {
            let apart = best.values.get(Parameter::NormalForceOffset) - other.values.get(Parameter::NormalForceOffset);
            (apart / UNLOADED_N).powi(2)
        };
        let expected = |i: usize| {
            let strokes: f64 = chosen.iter().map(|k| separation(&own[*k], &others[i][*k])).sum();
            REPEATS as f64 * (strokes + unloaded(rivals[i]))
        };
        let lambda = (0..rivals.len()).map(expected).fold(f64::INFINITY, f64::min);
        let zero = self.fits.iter().any(|f| f.model.effects.contains(&Effect::NormalForceZero));
        let stroke = |k: &usize| PlannedRun {
            depth_mm: Some((20.0 * depths[*k]).round() / 20.0),
            rest_before_s: Some(60.0),
            new_block: Some(true),
            ..PlannedRun::default()
        };
        let runs: Vec<PlannedRun> = (0..REPEATS).flat_map(|_| chosen.iter().map(stroke)).collect();
        Some(NextExperiment {
            separates: rivals.iter().map(|r| [best.model.name(), r.model.name()]).collect(),
            factor: if zero { "unloaded_reading" } else { "depth_mm" }.into(),
            lambda_rival_expected: lambda,
            minutes: minutes(&runs),
            prices: Vec::new(),
            runs,
        })
    }

    /// The experiment in sentences, one for each effect in question.
    pub fn sentences(&self) -> Vec<String> {
        let mut effects: Vec<Effect> = self.fits.iter().flat_map(|f| f.model.effects.clone()).collect();
        effects.sort();
        effects.dedup();
        let mut out: Vec<String> = effects.iter().map(|e| self.decides(*e)).collect();
        out.dedup();
        if effects.is_empty() {
            out.push("A table with the spread of every cell, and each depth approached three times, would show smaller effects.".into());
        }
        out
    }

    fn decides(&self, effect: Effect) -> String {
        let least = self.table.depths_mm[0];
        let value = |p: Parameter| {
            self.fits.iter().find(|f| f.model.effects.contains(&effect)).map_or(0.0, |f| f.values.get(p))
        };
        match effect {
            Effect::NormalForceZero => format!(
                "Zero of the normal force: read the unloaded sensor before and after every stroke ({:+.0} mN is expected), and \
                 slide with as little load as holds contact: near N = 0 the reading of F/N then runs away or changes sign, \
                 while a right zero lets F vanish with N.",
                1e3 * value(Parameter::NormalForceOffset)
            ),
            Effect::Adhesion => format!(
                "Adhesion: lift off slowly; a pull-off force of {:.0} mN at 63.5 mm² is expected, below zero of an unloaded sensor \
                 that reads zero. It grows with the hold before the lift, which a zero of the sensor does not.",
                1e3 * value(Parameter::PullOff)
            ),
            Effect::DepthErrors => format!(
                "Errors of single depths: approach each depth at least three times from the air; errors of {:.0} µm show as a \
                 scatter of the normal force that friction over normal force does not share.",
                1e3 * self.table.depth_sd_mm.iter().copied().fold(0.0, f64::max)
            ),
            Effect::Tau0 | Effect::Exponent => format!(
                "Law of friction: slide at depths from {:.2} mm on with the area measured; tau_0 shows as F over area that \
                 stays finite at the least loads, the exponent in the slope above 1 N.",
                0.5 * least
            ),
            Effect::SensorTilt => format!(
                "Tilt of the sensor ({:+.1} degrees): slide back and forth; it turns its sign with the motion, a zero does not.",
                value(Parameter::Tilt)
            ),
            Effect::StrainStiffening | Effect::TissueStiffness | Effect::DepthZero => {
                "Load over depth: press without sliding from first touch on in steps of 0.1 mm, with the touch point from \
                 the sensor's own first reading."
                    .into()
            }
            Effect::Geometry => "Size and bone clearance: measure the finger's width and the pulp's thickness (ultrasound \
                                 or a press to the bone)."
                .into(),
        }
    }
}
