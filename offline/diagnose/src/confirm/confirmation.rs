//! Confirmation of a diagnosis: residuals of the finite elements along measured strokes, without and with the effect.
//!
//! Main types: [`Prepared`], [`Confirmation`].

use fingerpad_fe::contact::RubberFriction;
use fingerpad_smooth::{MIDDLE_MM, Parameters, ReferenceCurves};

use crate::confirm::choice::spread;
use crate::confirm::scale::{FingerScale, FittedRow, Refit};
use crate::confirm::stroke::{FeRow, FeStroke, kept_rows};
use crate::data::runs::RunSet;
use crate::laws::{Change, Column, Place, Row};
use crate::model::active_law::ActiveLaw;
use crate::model::residual_sums::ResidualSums;
use crate::report::evidence::Evidence;
use crate::schema::{Confirmed, FeConfirmation};
use crate::verdict::cross_validation::noise_floor_n;

/// Rounds of calibration at most.
pub const ROUNDS: usize = 4;
/// The finger is calibrated where no coefficient moves by more than this share of its standard deviation between fingers.
const SETTLED: f64 = 0.01;

/// Results of a list of strokes: one entry per stroke, `None` if the finite elements found no equilibrium.
pub type Ran = Vec<Option<Vec<FeRow>>>;

/// Runs of one set that are to be repeated by the finite elements.
struct Part {
    set: RunSet,
    rows: Vec<Vec<usize>>,
}

impl Part {
    fn of(set: &RunSet, chosen: &[usize]) -> Self {
        let set = set.subset(|i| chosen.contains(&i));
        let rows = set.runs.iter().map(kept_rows).collect();
        Self { set, rows }
    }

    fn names(&self) -> Vec<String> {
        self.set.runs.iter().map(|r| r.labels.run.clone()).collect()
    }
}

/// The strokes to be run.
pub struct Prepared<'a> {
    reference: &'a ReferenceCurves,
    evidence: &'a Evidence,
    law: RubberFriction,
    calibration: Part,
    strokes: Part,
}

/// The finite-element side of a diagnosis.
pub struct Confirmation {
    /// For the report.
    pub report: FeConfirmation,
    /// Readings, before, after, of every kept row in turn, N; for the figure.
    pub rows: Vec<[[f64; 3]; 3]>,
}

/// The finite-element finger after its calibration.
struct Calibrated {
    scale: FingerScale,
    /// Area under which the laws were fitted over that of the finite elements.
    area_ratio: f64,
    /// Residuals of the calibration strokes, N.
    rms_n: [f64; 3],
}

/// Residuals on the strokes that were run.
#[derive(Default)]
struct Residuals {
    /// Of the finite elements before and after the effect, the noise floor, of the smooth model before and after.
    sums: [ResidualSums; 5],
    /// Readings, before, after, of every kept row in turn, N.
    rows: Vec<[[f64; 3]; 3]>,
    runs: Vec<String>,
    without_equilibrium: Vec<String>,
}

impl<'a> Prepared<'a> {
    /// Chooses `count` strokes of the calibration and of the held-out set (of the measured one without a held-out set).
    ///
    /// * `law`: the law of friction of the finite-element finger
    pub fn new(reference: &'a ReferenceCurves, evidence: &'a Evidence, law: RubberFriction, count: usize) -> Self {
        let mut drivers: Vec<Column> = Vec::new();
        evidence.laws.iter().for_each(|a| drivers.extend(a.law.drivers));
        let calibration = Part::of(&evidence.calibration_set, &spread(&evidence.calibration_set, &[], count));
        let strokes = Part::of(&evidence.checked_set, &spread(&evidence.checked_set, &drivers, count));
        Self { reference, evidence, law, calibration, strokes }
    }

    /// Strokes to be run: at least and at most.
    pub fn strokes(&self) -> [usize; 2] {
        let (a, b) = (self.calibration.set.runs.len(), self.strokes.set.runs.len());
        [2 * a + 2 * b, ROUNDS * a + 2 * b]
    }

    /// Largest depth that the plane is driven to, mm.
    pub fn depth_mm(&self) -> f64 {
        let runs = self.calibration.set.runs.iter().chain(&self.strokes.set.runs);
        let of_row = |row: &Row| {
            let mut change = Change::default();
            let laws = self.evidence.laws.iter().filter(|a| a.law.place == Place::Depth);
            laws.for_each(|a| a.law.apply(&a.values, row, &mut change));
            row.depth_mm + change.depth_mm.max(0.0)
        };
        runs.flat_map(|r| &r.rows).map(of_row).fold(0.0, f64::max)
    }

    /// Calibrates the finite-element finger on its strokes and runs the others without and with the effect.
    ///
    /// `run` receives a description of the current activity and the strokes to be run.
    ///
    /// # Errors
    /// Those of `run`.
    pub fn confirm<E>(
        &self,
        mesh: &str,
        shape: &str,
        run: &mut dyn FnMut(&str, &[FeStroke<'_>]) -> Result<Ran, E>,
    ) -> Result<Confirmation, E> {
        let Calibrated { scale, area_ratio, rms_n } = self.calibrate(run)?;
        let evidence = self.evidence;
        let refit = |parameters: &Parameters| Refit {
            from: self.reference.model(&evidence.calibration.fit.parameters),
            to: self.reference.model(parameters),
            beta: self.law.beta,
        };
        let (null, full) = (refit(&evidence.parameters_before), refit(&evidence.parameters));
        let before = strokes(&self.strokes, &evidence.laws_before, &scale, Some(&null), self.law);
        let after = strokes(&self.strokes, &evidence.laws, &scale, Some(&full), self.law);
        let ran = [run("without the effect", &before)?, run("with the effect", &after)?];
        let residuals = self.residuals([&before, &after], &ran, area_ratio);
        let [rms_before_n, rms_after_n, floor_rms_n, reduced_before_n, reduced_after_n] =
            residuals.sums.map(|s| s.rms());
        let report = FeConfirmation {
            confirmed: Confirmed::default(),
            mesh: mesh.to_owned(),
            rms_before_n,
            rms_after_n,
            floor_rms_n,
            shape: shape.to_owned(),
            set: evidence.checked.clone(),
            runs: residuals.runs,
            without_equilibrium: residuals.without_equilibrium,
            calibration_runs: self.calibration.names(),
            calibration_rms_n: rms_n,
            stiffness: scale.stiffness(MIDDLE_MM),
            strength: scale.strength(MIDDLE_MM, &Default::default()),
            reduced_before_n,
            reduced_after_n,
        };
        Ok(Confirmation { report: report.judged(), rows: residuals.rows })
    }

    /// Fits the finite-element finger to the calibration strokes, in rounds until it settles.
    fn calibrate<E>(&self, run: &mut dyn FnMut(&str, &[FeStroke<'_>]) -> Result<Ran, E>) -> Result<Calibrated, E> {
        let calibrated = &self.evidence.calibration.fit;
        let sigma = self.floor(&self.calibration, &calibrated.parameters, &calibrated.laws);
        let mut out = Calibrated { scale: FingerScale::default(), area_ratio: 1.0, rms_n: [0.0; 3] };
        for round in 0..ROUNDS {
            let strokes = strokes(&self.calibration, &calibrated.laws, &out.scale, None, self.law);
            let ran = run("calibrating", &strokes)?;
            let rows = fitted_rows(&self.calibration, &strokes, &ran, &sigma);
            out.area_ratio = self.area_ratio(&self.calibration, &ran);
            let mut sums = ResidualSums::default();
            sums.add(rows.iter().flat_map(|s| (0..3).map(|k| s.reading_n[k] - s.predicted_n[k])));
            out.rms_n = sums.rms();
            let mut improved = out.scale;
            if round + 1 == ROUNDS || improved.improve(&rows, self.law.beta) < SETTLED {
                break;
            }
            out.scale = improved;
        }
        Ok(out)
    }

    /// Residuals of the finite elements and of the smooth model before and after the effect, with the noise floor, on the
    /// strokes that found an equilibrium both times.
    fn residuals(&self, strokes: [&[FeStroke<'_>]; 2], ran: &[Ran; 2], area_ratio: f64) -> Residuals {
        let evidence = self.evidence;
        let task = evidence.calibration.task(&self.strokes.set, self.reference);
        let without = task.predict(&evidence.parameters_before, &evidence.laws_before);
        let with_laws = task.predict(&evidence.parameters, &evidence.laws);
        let floor = self.floor(&self.strokes, &evidence.parameters, &evidence.laws);
        let mut out = Residuals::default();
        let mut at = 0;
        for (k, measured) in self.strokes.set.runs.iter().enumerate() {
            let start = at;
            at += measured.rows.len();
            let (Some(plain), Some(with)) = (&ran[0][k], &ran[1][k]) else {
                out.without_equilibrium.push(measured.labels.run.clone());
                continue;
            };
            out.runs.push(measured.labels.run.clone());
            let (plain, with) = (strokes[0][k].readings(plain, area_ratio), strokes[1][k].readings(with, area_ratio));
            for ((&i, plain), with) in self.strokes.rows[k].iter().zip(plain).zip(with) {
                let reading = measured.force_n[i];
                let of = |list: &[f64]| -> [f64; 3] { std::array::from_fn(|c| list[3 * (start + i) + c]) };
                let less = |p: [f64; 3]| (0..3).map(move |c| reading[c] - p[c]);
                out.sums[0].add(less(plain));
                out.sums[1].add(less(with));
                out.sums[2].add(of(&floor).into_iter());
                out.sums[3].add(less(of(&without)));
                out.sums[4].add(less(of(&with_laws)));
                out.rows.push([reading, plain, with]);
            }
        }
        out
    }

    /// Standard deviation of every observation of a part, N.
    fn floor(&self, part: &Part, parameters: &Parameters, laws: &[ActiveLaw]) -> Vec<f64> {
        let task = self.evidence.calibration.task(&part.set, self.reference);
        noise_floor_n(&task, parameters, laws, &self.evidence.expected_variances)
    }

    /// Area under which the laws were fitted over the area of the finite elements, where it is pressed deepest.
    fn area_ratio(&self, part: &Part, ran: &Ran) -> f64 {
        let model = self.reference.model(&self.evidence.calibration.fit.parameters);
        let (mut fitted, mut found) = (0.0, 0.0);
        for ((run, kept), rows) in part.set.runs.iter().zip(&part.rows).zip(ran) {
            for (&i, fe) in kept.iter().zip(rows.iter().flatten()) {
                let depth = run.rows[i].depth_mm;
                if depth > 0.8 * run.depth_mm() && fe.area_mm2 > 0.0 {
                    fitted += model.at_depth(depth).area_mm2;
                    found += fe.area_mm2;
                }
            }
        }
        if found > 0.0 { fitted / found } else { 1.0 }
    }
}

fn strokes<'s>(
    part: &'s Part,
    laws: &'s [ActiveLaw],
    scale: &'s FingerScale,
    refit: Option<&'s Refit>,
    law: RubberFriction,
) -> Vec<FeStroke<'s>> {
    part.set.runs.iter().zip(&part.rows).map(|(r, kept)| FeStroke::new(r, kept, laws, scale, refit, law)).collect()
}

/// Observations of the strokes that were run; in the air there is nothing to fit.
fn fitted_rows(part: &Part, strokes: &[FeStroke<'_>], ran: &Ran, sigma_n: &[f64]) -> Vec<FittedRow> {
    let mut out = Vec::new();
    let mut start = 0;
    for (((run, kept), stroke), rows) in part.set.runs.iter().zip(&part.rows).zip(strokes).zip(ran) {
        if let Some(rows) = rows {
            for ((&i, fe), predicted_n) in kept.iter().zip(rows).zip(stroke.readings(rows, 1.0)) {
                let row = run.rows[i];
                if row.depth_mm > 0.0 {
                    out.push(FittedRow {
                        row,
                        depth_mm: row.depth_mm,
                        reading_n: run.force_n[i],
                        predicted_n,
                        sigma_n: std::array::from_fn(|c| sigma_n[3 * (start + i) + c]),
                        slips: 1.0 - fe.stick_ratio,
                    });
                }
            }
        }
        start += run.rows.len();
    }
    out
}
