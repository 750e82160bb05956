//! What a perfect analyst could separate: separations by the simulator's own readings and true noise.
//!
//! It is given the finger's shape up to two per cent, its scales not, the noise, the scatter between runs, the error of the
//! moisture readings, the formulas of all laws, and the readings that the logger wrote: those that it lost and its spikes are
//! not used. The diagnosis plays no part.
//!
//! Main type: [`Separation`]; main function: [`separation`].

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use fingerpad_diagnose::laws::Column;

use super::effects::{Effect, LIBRARY};
use super::laboratory::Scatter;
use super::rivals::{Rival, rivals};
use super::sets::Case;
use super::simulator::{Simulator, all_readings};

/// Separations of a case with one hidden effect.
#[derive(Clone, Copy, Debug)]
pub struct Separation {
    /// Of the truth from nothing.
    pub detect: f64,
    /// Of a law from the nearest other family; of what the library does not have from the nearest two laws together.
    pub rival: f64,
    /// Standard deviation of the amplitude's best estimate, as a share of it, with the law's shape unknown.
    pub amplitude_sd: f64,
}

impl Separation {
    /// Whether a perfect analyst could name it alone.
    pub fn required(&self) -> bool {
        self.detect > 40.0 && self.rival > 25.0
    }

    /// Whether no analyst could separate it from another family.
    pub fn indistinguishable(&self) -> bool {
        self.detect > 40.0 && self.rival < 4.0
    }
}

/// Rivals of one law, and of two, whose readings are fitted; by the tangents the others are farther off.
const NEAREST: usize = 2;
/// Gauss–Newton steps of a fit.
const STEPS: usize = 6;
/// Standard deviation of a reading that was lost or is a spike, N.
const UNREAD_N: f64 = 1e6;
/// Step of a parameter by which a derivative is taken.
const STEP: f64 = 0.01;

/// Separations of the case's first effect.
pub fn separation(case: &Case) -> Separation {
    let truth = &case.truth[0];
    let analyst = Analyst::new(case);
    let hidden = analyst.readings(&analyst.calibrated(), std::slice::from_ref(truth));
    let detect = analyst.left(&hidden, Rival::nothing());
    let in_library = case.dropped.is_none() && LIBRARY.iter().any(|l| l.0 == truth.name);
    let nearest = analyst.nearest(&hidden, &rivals(truth, !in_library), !in_library);
    let rival = nearest.into_iter().map(|rival| analyst.left(&hidden, rival)).fold(detect, f64::min);
    Separation { detect, rival, amplitude_sd: analyst.amplitude_sd(truth, &hidden) }
}

/// An analyst who has the finger, the noise and the rows.
struct Analyst<'a> {
    case: &'a Case,
    /// Readings without an effect, N: three a row, run after run.
    plain: Vec<f64>,
    /// Of each run: where its readings begin, how many they are, and the root of their covariance.
    factors: Vec<(usize, usize, Cholesky<f64, Dyn>)>,
    /// Tangents of the finger's freedoms, whitened, below them one row a freedom of what is known of it.
    basis: DMatrix<f64>,
    solver: Cholesky<f64, Dyn>,
}

fn flat(readings: Vec<Vec<[f64; 3]>>) -> Vec<f64> {
    readings.into_iter().flatten().flatten().collect()
}

fn difference(after: &[f64], before: &[f64], step: f64) -> Vec<f64> {
    after.iter().zip(before).map(|(a, b)| (a - b) / step).collect()
}

impl<'a> Analyst<'a> {
    fn new(case: &'a Case) -> Self {
        let plain = flat(all_readings(&*case.finger, &case.strokes, &[]));
        let freedoms = case.finger.freedoms();
        let factors = covariance_roots(case, &plain);
        let n = freedoms.len();
        let mut out = Self {
            case,
            plain,
            factors,
            basis: DMatrix::zeros(0, 0),
            solver: DMatrix::identity(0, 0).cholesky().expect("an empty matrix has a root"),
        };
        let tangents: Vec<DVector<f64>> = (0..n)
            .map(|k| {
                let moved = flat(all_readings(&*case.finger.vary(k, STEP), &case.strokes, &[]));
                let mut known = vec![0.0; n];
                known[k] = 1.0 / freedoms[k];
                out.whiten(&difference(&moved, &out.plain, STEP), &known)
            })
            .collect();
        out.basis = DMatrix::from_columns(&tangents);
        out.solver = (out.basis.transpose() * &out.basis).cholesky().expect("rows of what is known");
        out
    }

    /// The finger's freedoms as the calibration left them.
    fn calibrated(&self) -> DVector<f64> {
        DVector::zeros(self.case.finger.freedoms().len())
    }

    fn readings(&self, freedoms: &DVector<f64>, effects: &[Effect]) -> Vec<f64> {
        let mut finger: Box<dyn Simulator> = self.case.finger.vary(0, freedoms[0]);
        for k in (1..freedoms.len()).filter(|k| freedoms[*k] != 0.0) {
            finger = finger.vary(k, freedoms[k]);
        }
        flat(all_readings(&*finger, &self.case.strokes, effects))
    }

    /// A column over the root of the covariance, and rows below it.
    fn whiten(&self, column: &[f64], below: &[f64]) -> DVector<f64> {
        let mut out = Vec::with_capacity(column.len() + below.len());
        for (at, n, factor) in &self.factors {
            let part = DVector::from_column_slice(&column[*at..at + n]);
            out.extend(factor.l_dirty().solve_lower_triangular(&part).expect("positive diagonal").iter());
        }
        out.extend_from_slice(below);
        DVector::from_vec(out)
    }

    fn column(&self, after: &[f64], before: &[f64], step: f64) -> DVector<f64> {
        self.whiten(&difference(after, before, step), self.calibrated().as_slice())
    }

    /// Without its part along the finger's freedoms.
    fn clean(&self, v: DVector<f64>) -> DVector<f64> {
        &v - &self.basis * self.solver.solve(&(self.basis.transpose() * &v))
    }

    /// The rivals that come nearest to the hidden readings by their tangents, with the amplitudes that these give.
    fn nearest(&self, hidden: &[f64], rivals: &[Rival], in_pairs: bool) -> Vec<Rival> {
        let effect = self.clean(self.column(hidden, &self.plain, 1.0));
        let mut columns = Vec::new();
        let places: Vec<std::ops::Range<usize>> = rivals
            .iter()
            .map(|rival| {
                let first = columns.len();
                columns.extend(rival.effects.iter().map(|e| {
                    let with = self.readings(&self.calibrated(), std::slice::from_ref(e));
                    self.clean(self.column(&with, &self.plain, 1.0))
                }));
                first..columns.len()
            })
            .collect();
        let x = DMatrix::from_columns(&columns);
        let (gram, product) = (x.transpose() * &x, x.transpose() * effect);
        let mut lists: [Vec<(f64, Rival)>; 2] = [Vec::new(), Vec::new()];
        let mut consider = |laws: usize, own: Vec<usize>, mut rival: Rival| {
            let mut part = gram.select_rows(&own).select_columns(&own);
            (0..own.len()).for_each(|k| part[(k, k)] = part[(k, k)] * (1.0 + 1e-6) + 1e-9);
            let products = product.select_rows(&own);
            if let Some(root) = part.cholesky() {
                let sizes = root.solve(&products);
                rival.set_amplitudes(sizes.as_slice());
                lists[laws - 1].push((products.dot(&sizes), rival));
            }
        };
        for i in 0..rivals.len() {
            consider(1, places[i].clone().collect(), rivals[i].clone());
            for j in (0..i).filter(|_| in_pairs) {
                consider(2, places[i].clone().chain(places[j].clone()).collect(), rivals[i].and(&rivals[j]));
            }
        }
        lists.iter_mut().for_each(|list| list.sort_by(|a, b| b.0.total_cmp(&a.0)));
        lists.into_iter().flat_map(|list| list.into_iter().take(NEAREST)).map(|(_, rival)| rival).collect()
    }

    /// What a rival leaves of the hidden readings, with the finger's freedoms and the rival's numbers fitted: a squared
    /// distance in standard deviations.
    fn left(&self, hidden: &[f64], mut rival: Rival) -> f64 {
        let mut freedoms = self.calibrated();
        let known = self.case.finger.freedoms();
        let lack = |freedoms: &DVector<f64>, now: &[f64]| {
            let from_known: Vec<f64> = freedoms.iter().zip(known).map(|(x, sd)| -x / sd).collect();
            self.whiten(&difference(hidden, now, 1.0), &from_known)
        };
        let mut now = self.readings(&freedoms, &rival.effects);
        let mut here = lack(&freedoms, &now);
        for _ in 0..STEPS {
            let jacobian = self.jacobian(&freedoms, &rival, &now);
            let mut normal = jacobian.transpose() * &jacobian;
            (0..normal.nrows()).for_each(|k| normal[(k, k)] = normal[(k, k)] * (1.0 + 1e-6) + 1e-9);
            let Some(step) = normal.cholesky().map(|c| c.solve(&(jacobian.transpose() * &here))) else { break };
            let before = here.norm_squared();
            for share in [1.0, 0.5, 0.2, 0.05] {
                let by = &step * share;
                let moved = &freedoms + by.rows(0, freedoms.len());
                let other = rival.moved(by.rows(freedoms.len(), rival.knobs.len()).as_slice());
                let then = self.readings(&moved, &other.effects);
                let there = lack(&moved, &then);
                if there.norm_squared() < here.norm_squared() {
                    (freedoms, rival, now, here) = (moved, other, then, there);
                    break;
                }
            }
            if before - here.norm_squared() < 0.5 {
                break;
            }
        }
        here.norm_squared()
    }

    /// Tangents of the finger's freedoms and of a rival's numbers.
    fn jacobian(&self, freedoms: &DVector<f64>, rival: &Rival, now: &[f64]) -> DMatrix<f64> {
        let mut out = self.basis.clone().resize_horizontally(self.basis.ncols() + rival.knobs.len(), 0.0);
        for k in 0..rival.knobs.len() {
            let mut by = vec![0.0; rival.knobs.len()];
            by[k] = STEP;
            let with = self.readings(freedoms, &rival.moved(&by).effects);
            out.set_column(self.basis.ncols() + k, &self.column(&with, now, STEP));
        }
        out
    }

    /// Standard deviation of a hidden law's amplitude as a share of it, all else that is unknown fitted too.
    fn amplitude_sd(&self, truth: &Effect, hidden: &[f64]) -> f64 {
        let rival = Rival::truth(truth);
        let jacobian = self.jacobian(&self.calibrated(), &rival, hidden);
        let columns: Vec<DVector<f64>> =
            (self.basis.ncols()..jacobian.ncols()).map(|k| self.clean(jacobian.column(k).into_owned())).collect();
        let x = DMatrix::from_columns(&columns);
        let mut information = x.transpose() * &x;
        // The other numbers are known to about an e-fold.
        (1..information.nrows()).for_each(|k| information[(k, k)] += 1.0);
        information.cholesky().map_or(f64::NAN, |c| c.inverse()[(0, 0)].sqrt() / rival.amplitude().abs())
    }
}

/// Roots of the covariance of each run's readings: row noise, what a run draws once, and the error of the moisture reading
/// where the hidden law reads it.
fn covariance_roots(case: &Case, plain: &[f64]) -> Vec<(usize, usize, Cholesky<f64, Dyn>)> {
    let strokes = &case.strokes;
    let scattered = |s: Scatter, step: f64| {
        let readings = flat(strokes.iter().map(|k| case.finger.readings(k, &[], &s)).collect());
        difference(&readings, plain, step)
    };
    let none = Scatter::default();
    let mut random = vec![
        (scattered(Scatter { stiffness: 1.01, ..none }, 0.01), case.noise.gain[0]),
        (scattered(Scatter { strength: 1.01, ..none }, 0.01), case.noise.gain[1]),
        (scattered(Scatter { depth_mm: 2e-3, ..none }, 2e-3), case.noise.depth_mm),
    ];
    for channel in 0..3 {
        let column = (0..plain.len()).map(|i| f64::from(u8::from(i % 3 == channel))).collect();
        random.push((column, case.noise.offset_n));
    }
    if case.truth[0].name == "hydration_bell" && case.dropped != Some(Column::Hydration) {
        let mut moister = strokes.clone();
        moister.iter_mut().for_each(|s| s.plan.hydration_au += 1.0);
        let [with, without] = [&moister, strokes].map(|s| flat(all_readings(&*case.finger, s, &case.truth)));
        random.push((difference(&with, &without, 1.0), case.noise.hydration_au));
    }
    let read: Vec<bool> = case.read.iter().flatten().flatten().copied().collect();
    let mut at = 0;
    let root_of = |rows: usize| {
        let n = 3 * rows;
        let row_noise = |i: usize| case.noise.additive_n.powi(2) + (case.noise.multiplicative * plain[at + i]).powi(2);
        let variance = |i: usize| if read[at + i] { row_noise(i) } else { UNREAD_N.powi(2) };
        let mut s = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| variance(i)));
        for (column, sd) in &random {
            let z = DVector::from_column_slice(&column[at..at + n]) * *sd;
            s += &z * z.transpose();
        }
        let root = (at, n, s.cholesky().expect("noise has a floor"));
        at += n;
        root
    };
    strokes.iter().map(|s| s.rows.len()).map(root_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic_truth::effects::{OUTSIDE, place};
    use crate::synthetic_truth::loggers::Protocol;
    use crate::synthetic_truth::sets::{Hide, Wanted, make};
    use crate::synthetic_truth::simulator::SimulatorKind;

    fn case(protocol: Protocol, hide: Hide, level: usize) -> Case {
        let (simulator, seed, size, runs) = (SimulatorKind::First, 77, 0.1, 12);
        make(Wanted { simulator, protocol, seed, hide, size, level, runs, exact_form: true })
    }

    #[test]
    fn a_strength_that_is_rescaled_as_a_whole_is_no_effect() {
        // Along one axis an anisotropy is one factor on all strengths, whatever its size.
        let case = case(Protocol::OneAxis, Hide::Law(place("anisotropy")), 0);
        let found = separation(&case);
        assert!(found.detect < 1.0, "{found:?}");
    }

    #[test]
    fn an_unrecorded_dwell_of_one_value_is_a_static_peak() {
        let case = case(Protocol::Plane, Hide::Unrecorded(place("contact_ageing")), 2);
        let found = separation(&case);
        assert!(found.detect > 40.0 && found.rival < 5.0, "{found:?}");
    }

    #[test]
    fn lost_readings_take_from_the_separation_and_no_others_do() {
        let hide = Hide::Outside(OUTSIDE.iter().position(|o| *o == "slow_clock").unwrap());
        let mut case = case(Protocol::Plane, hide, 0);
        let whole = separation(&case).detect;
        case.read.iter_mut().step_by(2).flatten().for_each(|r| *r = [false; 3]);
        let half = separation(&case).detect;
        case.read.iter_mut().flatten().for_each(|r| *r = [false; 3]);
        let none = separation(&case).detect;
        assert!(half < 0.9 * whole && half > 0.1 * whole && none < 1e-3, "{whole} {half} {none}");
    }
}
