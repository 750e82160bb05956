//! From a diagnosis to the finite elements' own gap before and after the effect.

use super::choice::spread;
use super::scale::{Refit, Scale, Seen};
use super::stroke::{FeRow, FeStroke, few};
use fingerpad_diagnose::base::Reference;
use fingerpad_diagnose::evidence::Evidence;
use fingerpad_diagnose::heldout::{Squares, floor_n};
use fingerpad_diagnose::laws::{Column, Place};
use fingerpad_diagnose::runs::{Run, RunSet};
use fingerpad_diagnose::schema::FeConfirmation;
use fingerpad_diagnose::verdict::task_of;
use fingerpad_diagnose::walk::Active;
use fingerpad_fe::contact::RubberFriction;

/// Rounds of calibration at most.
pub const ROUNDS: usize = 4;
/// Calibrated where no freedom moves by more than this share of its standard deviation between fingers.
const SETTLED: f64 = 0.01;

/// What running a list of strokes gave: one entry per stroke, `None` where the finite elements found no equilibrium.
pub type Ran = Vec<Option<Vec<FeRow>>>;

/// Runs of one set that are to be repeated by the finite elements.
struct Part {
    set: RunSet,
    rows: Vec<Vec<usize>>,
}

impl Part {
    fn of(set: &RunSet, chosen: &[usize]) -> Self {
        let set = set.subset(|i| chosen.contains(&i));
        let rows = set.runs.iter().map(few).collect();
        Self { set, rows }
    }

    fn names(&self) -> Vec<String> {
        self.set.runs.iter().map(|r| r.labels.run.clone()).collect()
    }
}

/// What is to be run.
pub struct Prepared<'a> {
    reference: &'a Reference,
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

impl<'a> Prepared<'a> {
    /// Chooses `count` strokes of the calibration and of the held-out set (of the measured one, where there is none).
    ///
    /// * `law`: the law of friction of the finite-element finger
    pub fn new(reference: &'a Reference, evidence: &'a Evidence, law: RubberFriction, count: usize) -> Self {
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
        let offset: f64 =
            self.evidence.laws.iter().filter(|a| a.law.place == Place::Depth).map(|a| a.values[0].max(0.0)).sum();
        runs.map(Run::depth_mm).fold(0.0, f64::max) + offset
    }

    /// Calibrates the finite-element finger on its strokes and runs the others without and with the effect.
    ///
    /// `run` is given what is being done and the strokes to be run.
    ///
    /// # Errors
    /// Those of `run`.
    pub fn confirm<E>(
        &self,
        mesh: &str,
        shape: &str,
        run: &mut dyn FnMut(&str, &[FeStroke<'_>]) -> Result<Ran, E>,
    ) -> Result<Confirmation, E> {
        let evidence = self.evidence;
        let beta = self.law.beta;
        let fit = |theta: &[f64]| Refit {
            from: self.reference.with(&evidence.theta_calibrated),
            to: self.reference.with(theta),
            beta,
        };
        let sigma = self.floor(&self.calibration, &evidence.theta_calibrated, &[]);
        let mut scale = Scale::default();
        let mut area = 1.0;
        let mut calibrated = Squares::default();
        for round in 0..ROUNDS {
            let strokes = strokes(&self.calibration, &[], &scale, None, self.law);
            let ran = run("calibrating", &strokes)?;
            let seen = seen(&self.calibration, &strokes, &ran, &sigma);
            area = self.area(&self.calibration, &ran);
            calibrated = Squares::default();
            calibrated.add(seen.iter().flat_map(|s| (0..3).map(|k| s.reading_n[k] - s.predicted_n[k])));
            if round + 1 == ROUNDS {
                break;
            }
            let last = scale;
            if scale.improve(&seen, beta) < SETTLED {
                scale = last;
                break;
            }
        }
        let (null, full) = (fit(&evidence.theta_null), fit(&evidence.theta));
        let before = strokes(&self.strokes, &[], &scale, Some(&null), self.law);
        let after = strokes(&self.strokes, &evidence.laws, &scale, Some(&full), self.law);
        let ran = [run("without the effect", &before)?, run("with the effect", &after)?];

        let task = task_of(&self.strokes.set, self.reference, &evidence.calibration);
        let reduced = [task.predict(&evidence.theta_null, &[]), task.predict(&evidence.theta, &evidence.laws)];
        let floor = self.floor(&self.strokes, &evidence.theta, &evidence.laws);
        let mut sums = [Squares::default(); 5];
        let (mut rows, mut names, mut at, mut failed) = (Vec::new(), Vec::new(), 0, Vec::new());
        for (k, measured) in self.strokes.set.runs.iter().enumerate() {
            let start = at;
            at += measured.rows.len();
            let (Some(plain), Some(with)) = (&ran[0][k], &ran[1][k]) else {
                failed.push(measured.labels.run.clone());
                continue;
            };
            names.push(measured.labels.run.clone());
            let (plain, with) = (before[k].readings(plain, area), after[k].readings(with, area));
            for ((&i, plain), with) in self.strokes.rows[k].iter().zip(plain).zip(with) {
                let reading = measured.force_n[i];
                let of = |list: &[f64]| -> [f64; 3] { std::array::from_fn(|c| list[3 * (start + i) + c]) };
                let less = |p: [f64; 3]| (0..3).map(move |c| reading[c] - p[c]);
                sums[0].add(less(plain));
                sums[1].add(less(with));
                sums[2].add(of(&floor).into_iter());
                sums[3].add(less(of(&reduced[0])));
                sums[4].add(less(of(&reduced[1])));
                rows.push([reading, plain, with]);
            }
        }
        let [rms_before_n, rms_after_n, floor_rms_n, reduced_before_n, reduced_after_n] = sums.map(|s| s.rms());
        let report = FeConfirmation {
            mesh: mesh.to_owned(),
            rms_before_n,
            rms_after_n,
            floor_rms_n,
            shape: shape.to_owned(),
            set: evidence.checked.clone(),
            runs: names,
            without_equilibrium: failed,
            calibration_runs: self.calibration.names(),
            calibration_rms_n: calibrated.rms(),
            stiffness: scale.stiffness(fingerpad_diagnose::base::MIDDLE_MM),
            strength: scale.strength(fingerpad_diagnose::base::MIDDLE_MM, &Default::default()),
            reduced_before_n,
            reduced_after_n,
        };
        Ok(Confirmation { report, rows })
    }

    /// Standard deviation of every observation of a part, N.
    fn floor(&self, part: &Part, theta: &[f64], laws: &[Active]) -> Vec<f64> {
        let task = task_of(&part.set, self.reference, &self.evidence.calibration);
        floor_n(&task, theta, laws, &self.evidence.scatter)
    }

    /// Area under which the laws were fitted over the area of the finite elements, where it is pressed deepest.
    fn area(&self, part: &Part, ran: &Ran) -> f64 {
        let base = self.reference.with(&self.evidence.theta_calibrated);
        let (mut fitted, mut found) = (0.0, 0.0);
        for ((run, kept), rows) in part.set.runs.iter().zip(&part.rows).zip(ran) {
            for (&i, fe) in kept.iter().zip(rows.iter().flatten()) {
                let depth = run.rows[i].depth_mm;
                if depth > 0.8 * run.depth_mm() && fe.area_mm2 > 0.0 {
                    fitted += base.at(depth).area_mm2;
                    found += fe.area_mm2;
                }
            }
        }
        if found > 0.0 { fitted / found } else { 1.0 }
    }
}

fn strokes<'s>(
    part: &'s Part,
    laws: &'s [Active],
    scale: &'s Scale,
    refit: Option<&'s Refit>,
    law: RubberFriction,
) -> Vec<FeStroke<'s>> {
    part.set.runs.iter().zip(&part.rows).map(|(r, kept)| FeStroke::new(r, kept, laws, scale, refit, law)).collect()
}

/// Observations of the strokes that were run; in the air there is nothing to fit.
fn seen(part: &Part, strokes: &[FeStroke<'_>], ran: &Ran, sigma_n: &[f64]) -> Vec<Seen> {
    let mut out = Vec::new();
    let mut start = 0;
    for (((run, kept), stroke), rows) in part.set.runs.iter().zip(&part.rows).zip(strokes).zip(ran) {
        if let Some(rows) = rows {
            for ((&i, fe), predicted_n) in kept.iter().zip(rows).zip(stroke.readings(rows, 1.0)) {
                let row = run.rows[i];
                if row.depth_mm > 0.0 {
                    out.push(Seen {
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
