//! Fit of baseline and laws together: Gauss–Newton inside the model, runs as the unit, variances re-estimated.
//!
//! Main types: [`Task`] (what is fitted to what), [`Fit`] (the optimum).

use nalgebra::{DMatrix, DVector};

use super::base::{FREEDOMS, Reference};
use super::course::Course;
use super::laws::Reported;
use super::metric::{Block, Metric, Weighed};
use super::mixed::{Column, Layout, PerRun, Scatter};
use super::products::dot;
use super::runs::Run;
use super::tangents::Tangents;
use super::walk::{Active, Modes, Nudge, Plan};

/// A normal distribution of the freedoms.
#[derive(Clone, Debug)]
pub struct Prior {
    /// Mean.
    pub mean: Vec<f64>,
    /// R with Rᵀ R = covariance⁻¹.
    pub root: DMatrix<f64>,
}

impl Prior {
    /// From mean and covariance.
    pub fn new(mean: Vec<f64>, covariance: &DMatrix<f64>) -> Self {
        let inverse = covariance.clone().cholesky().expect("a covariance with drift is positive definite").inverse();
        let root = inverse.cholesky().expect("an inverse of a covariance is positive definite").l().transpose();
        Self { mean, root }
    }
}

/// What is to be fitted.
pub struct Task<'a> {
    /// The runs.
    pub runs: &'a [Run],
    /// Curves of the model.
    pub reference: &'a Reference,
    /// What is known of the freedoms.
    pub prior: Prior,
    /// Row noise, N, per observation.
    pub sigma_n: Vec<f64>,
    /// What is known of the run-level variances.
    pub variances: PerRun,
    /// How many runs that knowledge weighs.
    pub variance_weight: f64,
    /// Degrees of freedom that the freedoms take from the runs.
    pub lost: f64,
    /// Where the runs lie.
    pub layout: Layout,
    /// Readings, three per row, N.
    pub readings_n: Vec<f64>,
    course: Course,
}

/// An optimum.
#[derive(Clone)]
pub struct Fit {
    /// Freedoms.
    pub theta: Vec<f64>,
    /// Laws with their parameters.
    pub laws: Vec<Active>,
    /// Run-level variances.
    pub variances: PerRun,
    /// −2 log posterior, up to a constant of the task.
    pub minus_2ll: f64,
    /// What the runs drew, about which the model is linear; empty where the draws are small.
    pub modes: Modes,
    /// Readings less prediction, N, to first order in the draws about their modes.
    pub residual_n: Vec<f64>,
    /// Covariance of freedoms and then the laws' parameters (logarithms where [`is_log`]).
    pub covariance: DMatrix<f64>,
}

/// Draws beyond which the model is not taken as linear from 0: logarithms of stiffness and strength, depth in mm.
const FAR: [f64; 3] = [0.08, 0.08, 0.08];

/// Where a fit starts.
#[derive(Clone, Debug)]
pub struct Start {
    /// Freedoms.
    pub theta: Vec<f64>,
    /// Laws.
    pub laws: Vec<Active>,
    /// Run-level variances.
    pub variances: PerRun,
    /// What the runs drew.
    pub modes: Modes,
}

impl From<&Fit> for Start {
    fn from(fit: &Fit) -> Self {
        Self { theta: fit.theta.clone(), laws: fit.laws.clone(), variances: fit.variances, modes: fit.modes.clone() }
    }
}

/// Whether a parameter of a law is fitted by its logarithm.
pub fn is_log(active: &Active, index: usize) -> bool {
    active.law.parameters[index].positive
}

/// Mean and standard deviation of a parameter's weak prior, in the space in which it is fitted. For sizes it only
/// keeps a direction that the protocol cannot see from running away.
fn weak_prior(active: &Active, index: usize) -> (f64, f64) {
    let p = &active.law.parameters[index];
    if index < active.law.linear {
        (0.0, 20.0 * p.typical.abs())
    } else if is_log(active, index) {
        (p.typical.ln(), 1.5)
    } else {
        (p.typical, 30.0)
    }
}

/// A parameter of a law as it is fitted.
pub fn to_fitted(active: &Active, index: usize) -> f64 {
    if is_log(active, index) { active.values[index].ln() } else { active.values[index] }
}

/// Sets it, within its bounds.
pub fn set_fitted(active: &mut Active, index: usize, q: f64) {
    let p = &active.law.parameters[index];
    let bounds = match active.law.reported {
        Reported::AsFitted => p,
        Reported::AmplitudeAndAxis => &active.law.parameters[0],
    };
    let value = if is_log(active, index) { q.exp() } else { q };
    debug_assert!(p.low < p.high);
    active.values[index] = value.clamp(bounds.low, bounds.high);
}

impl<'a> Task<'a> {
    /// A task whose row noise is taken at the given prediction.
    pub fn new(runs: &'a [Run], reference: &'a Reference, prior: Prior, sigma_n: Vec<f64>, variances: PerRun) -> Self {
        let layout = Layout::of(runs.iter().map(|r| r.rows.len()));
        let readings_n = runs.iter().flat_map(|r| r.force_n.iter().flatten().copied()).collect();
        let course = Course::of(runs);
        Self { runs, reference, prior, sigma_n, variances, variance_weight: 0.0, lost: 3.0, layout, readings_n, course }
    }

    /// The runs with laws and draws.
    pub fn plan(&self, laws: &[Active], modes: &Modes, nudge: Nudge) -> Plan<'_> {
        Plan::new(&self.course, laws, modes, nudge, self.runs)
    }

    /// Predicted readings of runs that drew nothing, N.
    pub fn predict(&self, theta: &[f64], laws: &[Active]) -> Vec<f64> {
        self.predict_at(theta, laws, &Modes::new())
    }

    /// Predicted readings with what the runs drew, N.
    pub fn predict_at(&self, theta: &[f64], laws: &[Active], modes: &Modes) -> Vec<f64> {
        self.plan(laws, modes, Nudge::default()).predict(&self.reference.with(theta))
    }

    /// Readings less the prediction of runs that drew nothing, N.
    pub fn plain_residual_n(&self, fit: &Fit) -> Vec<f64> {
        let prediction = self.predict(&fit.theta, &fit.laws);
        self.readings_n.iter().zip(&prediction).map(|(y, p)| y - p).collect()
    }

    /// Readings less prediction over row noise, the draws about their modes to first order.
    fn scaled_residual(&self, prediction: &[f64], modes: &Modes, scatter: &Scatter) -> Column {
        let mut out: Vec<f64> =
            self.readings_n.iter().zip(prediction).zip(&self.sigma_n).map(|((y, p), s)| (y - p) / s).collect();
        scatter.add(modes, &mut out);
        scatter.seen(out)
    }

    fn prior_residual(&self, theta: &[f64], laws: &[Active]) -> Vec<f64> {
        let d = DVector::from_iterator(FREEDOMS, (0..FREEDOMS).map(|k| self.prior.mean[k] - theta[k]));
        let mut rows: Vec<f64> = (&self.prior.root * d).iter().copied().collect();
        for active in laws {
            for k in 0..active.values.len() {
                let (mean, sd) = weak_prior(active, k);
                rows.push((mean - to_fitted(active, k)) / sd);
            }
        }
        rows
    }

    /// How far a point is pulled from the prior's mean, in squared standard deviations.
    pub fn pull(&self, theta: &[f64]) -> f64 {
        let rows = self.prior_residual(theta, &[]);
        dot(&rows, &rows)
    }

    fn objective(&self, metric: &Metric, v: &PerRun, scaled: &Column, prior: &[f64]) -> f64 {
        metric.square(scaled) + metric.log_det + dot(prior, prior) + self.variance_2ll(v)
    }

    fn variance_2ll(&self, v: &PerRun) -> f64 {
        if self.variance_weight > 0.0 { Scatter::prior_2ll(v, &self.variances, self.variance_weight) } else { 0.0 }
    }

    /// Fits from a start. `tangents`: those of a nearby point; they are renewed first if `None`, and after each step
    /// if `renew`.
    pub fn fit(&self, start: Start, tangents: Option<&Tangents>, renew: bool, most: usize) -> Fit {
        let Start { mut theta, mut laws, variances: mut v, mut modes } = start;
        let mut prediction = self.predict_at(&theta, &laws, &modes);
        let mut own: Option<Tangents> = tangents.is_none().then(|| self.tangents(&theta, &laws, &modes, &prediction));
        let mut last = f64::INFINITY;
        let known = self.prior.root.transpose() * &self.prior.root;
        let mut hessian = DMatrix::zeros(0, 0);
        let mut cache: Option<(PerRun, Weighed)> = None;
        for round in 0..most {
            let current = own.as_ref().or(tangents).expect("one of them is there");
            let scaled = self.scaled_residual(&prediction, &modes, &current.scatter);
            if round % 3 == 0 || renew || !modes.is_empty() {
                let rounds = if round == 0 { 6 } else { 4 };
                v = current.scatter.variances(v, &scaled, &self.variances, self.variance_weight, self.lost, rounds);
            }
            let metric = current.scatter.metric(&v);
            let prior = self.prior_residual(&theta, &laws);
            let here = self.objective(&metric, &v, &scaled, &prior);
            if cache.as_ref().is_none_or(|c| renew || c.0 != v) {
                cache = Some((v, current.freedoms.weighed(&metric)));
            }
            let (_, weighed) = cache.as_ref().expect("just filled");
            let more = self.law_columns(&theta, &laws, &modes, &prediction);
            let more = Block::new(more.into_iter().map(|c| current.scatter.seen(c)).collect());
            let (plain, gradient) = normal_equations(&current.freedoms, weighed, &more, &metric, &scaled);
            let gradient = gradient + self.prior_gradient(&prior, &laws);
            hessian = self.with_prior(plain, &known, &laws);
            let mut damping = 0.0;
            let mut moved = false;
            for _ in 0..5 {
                let mut damped = hessian.clone();
                for k in 0..damped.nrows() {
                    damped[(k, k)] *= 1.0 + damping;
                }
                let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else { break };
                let (mut t, mut l) = (theta.clone(), laws.clone());
                for k in 0..FREEDOMS {
                    t[k] += step[k].clamp(-0.6, 0.6);
                }
                let mut at = FREEDOMS;
                for active in &mut l {
                    for k in 0..active.values.len() {
                        let q = to_fitted(active, k);
                        let reach = if is_log(active, k) {
                            0.8
                        } else if k >= active.law.linear {
                            15.0
                        } else {
                            f64::INFINITY
                        };
                        set_fitted(active, k, q + step[at].clamp(-reach, reach));
                        at += 1;
                    }
                }
                let p = self.predict_at(&t, &l, &modes);
                let scaled = self.scaled_residual(&p, &modes, &current.scatter);
                let there = self.objective(&metric, &v, &scaled, &self.prior_residual(&t, &l));
                if there < here {
                    (theta, laws, prediction) = (t, l, p);
                    moved = true;
                    break;
                }
                damping = if damping == 0.0 { 0.1 } else { damping * 10.0 };
            }
            let shifted = self.follow_modes(current, &v, &prediction, &mut modes);
            if shifted > 0.0 {
                prediction = self.predict_at(&theta, &laws, &modes);
            }
            let done = (!moved || (last - here).abs() < 0.05) && shifted < 0.02;
            last = here;
            if done {
                break;
            }
            if renew {
                own = Some(self.tangents(&theta, &laws, &modes, &prediction));
            }
        }
        let current = own.as_ref().or(tangents).expect("one of them is there");
        let scaled = self.scaled_residual(&prediction, &modes, &current.scatter);
        v = current.scatter.variances(v, &scaled, &self.variances, self.variance_weight, self.lost, 6);
        let metric = current.scatter.metric(&v);
        let minus_2ll = self.objective(&metric, &v, &scaled, &self.prior_residual(&theta, &laws));
        let n = hessian.nrows();
        let covariance = hessian.cholesky().map_or_else(|| DMatrix::identity(n, n) * f64::NAN, |c| c.inverse());
        let residual_n = scaled.values.iter().zip(&self.sigma_n).map(|(r, s)| r * s).collect();
        Fit { theta, laws, variances: v, minus_2ll, modes, residual_n, covariance }
    }

    /// Moves the modes to where the draws most likely lie; the largest shift, 0 while all draws are so small that the
    /// model is linear in them from 0.
    ///
    /// A law that is still missing makes the runs draw far apart. About 0 the model's curvature there would look like
    /// evidence within the runs [conditional linearisation: Lindstrom & Bates 1990].
    fn follow_modes(&self, tangents: &Tangents, v: &PerRun, prediction: &[f64], modes: &mut Modes) -> f64 {
        let scaled = self.scaled_residual(prediction, modes, &tangents.scatter);
        let draws = tangents.scatter.draws(v, &scaled);
        let far = draws.iter().any(|u| u[0].abs() > FAR[0] || u[1].abs() > FAR[1] || u[2].abs() > FAR[2]);
        if modes.is_empty() {
            if !far {
                return 0.0;
            }
            modes.resize(draws.len(), [0.0; 3]);
        }
        let mut most = 0.0f64;
        for (mode, u) in modes.iter_mut().zip(&draws) {
            for k in 0..3 {
                let reach = [0.3, 0.3, 0.1][k];
                let to = (mode[k] + (u[k] - mode[k]).clamp(-reach, reach)).clamp(-1.5, 1.5);
                most = most.max((to - mode[k]).abs());
                mode[k] = to;
            }
        }
        most
    }

    /// Adds what the priors say: of the freedoms, RᵀR, and of each parameter of the laws.
    fn with_prior(&self, mut hessian: DMatrix<f64>, known: &DMatrix<f64>, laws: &[Active]) -> DMatrix<f64> {
        let mut freedoms = hessian.view_mut((0, 0), (FREEDOMS, FREEDOMS));
        freedoms += known;
        let sds = laws.iter().flat_map(|a| (0..a.values.len()).map(|k| weak_prior(a, k).1));
        for (i, sd) in sds.enumerate() {
            hessian[(FREEDOMS + i, FREEDOMS + i)] += 1.0 / (sd * sd);
        }
        hessian
    }

    /// The priors' part of the gradient.
    fn prior_gradient(&self, prior: &[f64], laws: &[Active]) -> DVector<f64> {
        let pull = self.prior.root.transpose() * DVector::from_column_slice(&prior[..FREEDOMS]);
        let sds = laws.iter().flat_map(|a| (0..a.values.len()).map(|k| weak_prior(a, k).1));
        let laws = prior[FREEDOMS..].iter().zip(sds).map(|(p, sd)| p / sd);
        DVector::from_iterator(prior.len(), pull.iter().copied().chain(laws))
    }
}

/// Products of all columns, those of the freedoms first, and with the residual.
fn normal_equations(
    freedoms: &Block,
    weighed: &Weighed,
    more: &Block,
    metric: &Metric,
    residual: &Column,
) -> (DMatrix<f64>, DVector<f64>) {
    let (n, m) = (freedoms.columns.len(), more.columns.len());
    let right: Vec<&Column> = std::iter::once(residual).chain(&more.columns).collect();
    let across = freedoms.times(weighed, metric, &right);
    let (mut hessian, mut gradient) = (DMatrix::zeros(n + m, n + m), DVector::zeros(n + m));
    hessian.view_mut((0, 0), (n, n)).copy_from(&weighed.gram);
    gradient.rows_mut(0, n).copy_from(&across.column(0));
    if m > 0 {
        let own = more.weighed(metric);
        gradient.rows_mut(n, m).copy_from(&more.times(&own, metric, &[residual]).column(0));
        hessian.view_mut((0, n), (n, m)).copy_from(&across.columns(1, m));
        hessian.view_mut((n, 0), (m, n)).copy_from(&across.columns(1, m).transpose());
        hessian.view_mut((n, n), (m, m)).copy_from(&own.gram);
    }
    (hessian, gradient)
}
