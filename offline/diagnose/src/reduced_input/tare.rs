//! The tare of a sensor from the forces of a finger that slides freely on it.
//!
//! While it slides, friction lies on a ring around the tare: |F − b| = k (N − b_n)^m (1 + harmonics of the direction).
//! The harmonics (another friction towards one side) move a ring like a tare does, at each load in proportion; only
//! the spread of loads separates the two, so they are fitted together, with a wide prior: no ratio between a
//! fingertip's directions was found published. Weights are Student's, because presses and starts are among the rows.
//! The covariance allows for residuals that follow each other (Newey & West 1987), parts of the trace are left out in
//! turn, and what was chosen without evidence (priors, which rows count as sliding) is varied.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use crate::data::median::{median, noise_from_neighbours};
use crate::data::trace_csv::TraceRow;
use crate::reduced_input::air::{RowsInAir, low_and_usual_load};
use crate::statistics::damped_steps::damped_steps;
use crate::statistics::tails::minus_ln_p;

/// Parameters: tare x, y, normal; ln k; m; first harmonic cos, sin; second harmonic cos, sin.
const P: usize = 9;
type Vector = SVector<f64, P>;
type Matrix = SMatrix<f64, P, P>;

/// Mean and standard deviation of a parameter before the trace.
type Prior = [(f64, f64); P];
/// Sensors drift by up to 1 N, m lies between 0.5 and 1, a side may have up to twice the friction of the other.
const PRIOR: Prior =
    [(0.0, 3.0), (0.0, 3.0), (0.0, 0.7), (0.0, 2.0), (0.8, 0.15), (0.0, 0.60), (0.0, 0.60), (0.0, 0.25), (0.0, 0.25)];
/// Standard deviations of the tare of normal, x, y before the trace, N.
pub const TARE_SD_N: [f64; 3] = [PRIOR[2].1, PRIOR[0].1, PRIOR[1].1];
/// Degrees of freedom of Student's weights.
const NU: f64 = 4.0;
/// Rows over which residuals follow each other, s: about half a turn of a finger that explores.
const MEMORY_S: f64 = 1.5;
/// Half-width of the tare's interval from which on a trace shows nothing about it, N.
const LARGEST_HALF_N: f64 = 0.5;
/// Fewest sliding rows.
pub const LEAST_ROWS: usize = 40;

/// The fitted ring and tare of a trace.
#[derive(Clone, Debug)]
pub struct TareFit {
    /// Tare of normal, x, y, N.
    pub tare_n: [f64; 3],
    /// Half-widths of the 95 % intervals.
    pub half_n: [f64; 3],
    /// Friction at 1 N and its exponent in the load.
    pub friction: [f64; 2],
    /// Standard deviation of the exponent.
    pub exponent_sd: f64,
    /// Correlation of normal tare and exponent.
    pub normal_exponent_correlation: f64,
    /// Gain in 2 log likelihood over no tangential tare.
    pub gain_2ll: f64,
    /// p of no tangential tare, by the covariance.
    pub p: f64,
    /// Root mean square distance from the ring, N, without and with the tare.
    pub rms_n: [f64; 2],
    /// Row noise, N.
    pub noise_n: f64,
    /// Indices of the rows that slide.
    pub rows: Vec<usize>,
    /// Whether the finger slides in these rows; without that they have no friction coefficient.
    pub sliding: Sliding,
    /// Median |F|/N of the rows in firm contact as read.
    pub friction_as_read: f64,
    /// The same with the whole tare taken off, the normal force's included, and what the tare's intervals leave of it open;
    /// `None` where that is more than 5 % of it.
    pub friction_tared: Option<[f64; 2]>,
    /// Rows before touch, where the trace begins with some: then the tare is theirs.
    pub air: Option<RowsInAir>,
    /// 5 and 95 % of the load of the sliding rows, N.
    pub load_n: [f64; 2],
    /// Harmonics of the friction over the direction: first cos, sin, second cos, sin.
    pub harmonics: [f64; 4],
}

/// Evidence for sliding in a trace of forces alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sliding {
    /// Friction turns, stays on the ring while it does, and follows the load: the finger slides.
    Shown,
    /// Friction keeps one direction, as a held object's weight does.
    OneDirection,
    /// Friction lies inside the ring as often as on it, as that of a finger that sticks.
    OffRing,
    /// Friction turns without following the load, as that of a held object that is turned does.
    NotWithLoad,
}

/// Length of the mean unit vector of friction from which on it keeps one direction.
const ONE_DIRECTION: f64 = 0.9;
/// Median distance from the ring, as a share of its radius, from which on friction is not that of a sliding finger.
const OFF_RING: f64 = 0.25;
/// Exponent of friction in the load from which on it follows the load: fingers have 0.5 to 1.
const LEAST_EXPONENT: f64 = 0.3;
/// Standard deviations by which that exponent must be known to be above zero.
const KNOWN: f64 = 2.0;
/// Smallest radius at which a ring can be distinguished from a point, in standard deviations of the row noise.
const LEAST_RADIUS: f64 = 5.0;

impl Sliding {
    /// Of rows with a tare taken off.
    fn of(trace: &[TraceRow], rows: &[usize], p: &Vector, noise_n: f64) -> Self {
        let of = |i: &usize| {
            let f = &trace[*i].force_n;
            let (radius, wanted) = ring(p, f);
            let unit = [(f[1] - p[0]) / radius.max(1e-12), (f[2] - p[1]) / radius.max(1e-12)];
            (radius, (radius / wanted - 1.0).abs(), unit)
        };
        let all: Vec<(f64, f64, [f64; 2])> = rows.iter().map(of).collect();
        let mean = |k: usize| all.iter().map(|a| a.2[k]).sum::<f64>() / all.len() as f64;
        if mean(0).hypot(mean(1)) > ONE_DIRECTION {
            Self::OneDirection
        } else if median(all.iter().map(|a| a.1)).is_some_and(|off| off > OFF_RING)
            || median(all.iter().map(|a| a.0)).is_none_or(|radius| radius < LEAST_RADIUS * noise_n)
        {
            Self::OffRing
        } else {
            let [exponent, sd] = load_exponent(trace, rows, p);
            if exponent > LEAST_EXPONENT.max(KNOWN * sd) { Self::Shown } else { Self::NotWithLoad }
        }
    }
}

/// Exponent of friction in the load by a straight line through their logarithms, without a prior, and its standard deviation between
/// parts of the trace.
fn load_exponent(trace: &[TraceRow], rows: &[usize], p: &Vector) -> [f64; 2] {
    let pair = |i: &usize| {
        let [n, x, y] = trace[*i].force_n;
        ((n - p[2]).max(0.02).ln(), (x - p[0]).hypot(y - p[1]).max(1e-6).ln())
    };
    let pairs: Vec<(f64, f64)> = rows.iter().map(pair).collect();
    let slope = |left_out: Range<usize>| {
        let kept = || pairs.iter().enumerate().filter(|(k, _)| !left_out.contains(k)).map(|(_, pair)| *pair);
        let count = (pairs.len() - left_out.len()) as f64;
        let mean = kept().fold((0.0, 0.0), |a, b| (a.0 + b.0 / count, a.1 + b.1 / count));
        let (both, own) =
            kept().fold((0.0, 0.0), |sum, (n, f)| (sum.0 + (n - mean.0) * (f - mean.1), sum.1 + (n - mean.0).powi(2)));
        both / own.max(1e-12)
    };
    let without: Vec<f64> = parts(pairs.len()).map(slope).collect();
    let mean = without.iter().sum::<f64>() / PARTS as f64;
    let square = without.iter().map(|s| (s - mean).powi(2)).sum::<f64>();
    [slope(0..0), (square * (PARTS - 1) as f64 / PARTS as f64).sqrt()]
}

/// The rows of each part of a trace that is left out in turn.
fn parts(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..PARTS).map(move |part| part * rows / PARTS..(part + 1) * rows / PARTS)
}

impl TareFit {
    /// Whether the tangential tare is known well enough to be named or denied: its intervals' half-widths lie below 0.5 N and below half the
    /// friction at the largest load. Without rows before touch, the finger must slide as well.
    pub fn carries(&self) -> bool {
        let friction_n = self.friction[0] * self.load_n[1].max(0.02).powf(self.friction[1]);
        let has_source = self.air.is_some() || self.sliding == Sliding::Shown;
        has_source && self.half_n[1].max(self.half_n[2]) < LARGEST_HALF_N.min(0.5 * friction_n)
    }

    /// Fitted friction at a load as read and a direction from the tare, N.
    pub fn radius_n(&self, load_n: f64, angle: f64) -> f64 {
        let (s, c) = angle.sin_cos();
        let [a, b, d, e] = self.harmonics;
        let round = 1.0 + a * c + b * s + d * (c * c - s * s) + e * 2.0 * s * c;
        self.friction[0] * (load_n - self.tare_n[0]).max(0.02).powf(self.friction[1]) * round.max(0.1)
    }
}

/// Rows in firm contact: a load well above the lightest one. The level of the tare does not enter.
pub fn sliding_rows(rows: &[TraceRow]) -> Vec<usize> {
    firm_rows(rows, 0.35)
}

/// Rows whose load lies above the lightest by a share of the way to the usual one.
fn firm_rows(rows: &[TraceRow], share: f64) -> Vec<usize> {
    let [low, usual] = low_and_usual_load(rows);
    (0..rows.len()).filter(|i| rows[*i].force_n[0] > low + share * (usual - low)).collect()
}

fn ring(p: &Vector, f: &[f64; 3]) -> (f64, f64) {
    let (x, y) = (f[1] - p[0], f[2] - p[1]);
    let radius = x.hypot(y);
    let (s, c) = y.atan2(x).sin_cos();
    let round = 1.0 + p[5] * c + p[6] * s + p[7] * (c * c - s * s) + p[8] * 2.0 * s * c;
    (radius, p[3].exp() * (f[0] - p[2]).max(0.02).powf(p[4]) * round.max(0.1))
}

struct Ring<'a> {
    rows: Vec<&'a [f64; 3]>,
    free: [bool; P],
    prior: Prior,
}

impl Ring<'_> {
    fn residuals(&self, p: &Vector, sigma: f64) -> Vec<f64> {
        self.rows
            .iter()
            .map(|f| {
                let (radius, wanted) = ring(p, f);
                (radius - wanted) / sigma.hypot(0.12 * wanted)
            })
            .collect()
    }

    fn objective(&self, p: &Vector, sigma: f64) -> f64 {
        let mut sum = 0.0;
        for f in &self.rows {
            let (radius, wanted) = ring(p, f);
            let s = sigma.hypot(0.12 * wanted);
            sum += (NU + 1.0) * (((radius - wanted) / s).powi(2) / NU).ln_1p() + 2.0 * s.ln();
        }
        sum + (0..P).map(|k| ((p[k] - self.prior[k].0) / self.prior[k].1).powi(2)).sum::<f64>()
    }

    /// Minimum from a start; returns parameters and the information with Student's weights.
    fn fit(&self, start: Vector, sigma: f64) -> (Vector, Matrix, Vec<Vector>) {
        let mut p = start;
        let mut best = self.objective(&p, sigma);
        let mut out = self.linear(&p, sigma);
        let (mut damping, mut tries) = (1e-2, 0..80);
        loop {
            let rising = std::iter::successors(Some(damping), |d| Some(10.0 * d)).take_while(|d| *d <= 1e8);
            let steps = damped_steps(&out.0, &out.1, rising);
            let lower = tries.by_ref().zip(steps).find_map(|(_, (damping, step))| {
                let next = p + step.map(|s| s.clamp(-0.3, 0.3));
                let there = self.objective(&next, sigma);
                (there < best).then_some((next, there, damping))
            });
            let Some((next, there, used)) = lower else { break };
            let gain = best - there;
            (p, best, damping) = (next, there, 0.3 * used);
            out = self.linear(&p, sigma);
            if gain < 1e-6 {
                break;
            }
        }
        (p, out.0, out.2)
    }

    /// Information, descent direction and each row's share of the score.
    fn linear(&self, p: &Vector, sigma: f64) -> (Matrix, Vector, Vec<Vector>) {
        let e = self.residuals(p, sigma);
        let mut slopes = vec![Vector::zeros(); e.len()];
        for k in (0..P).filter(|k| self.free[*k]) {
            let mut q = *p;
            q[k] += 1e-5;
            for (slope, (a, b)) in slopes.iter_mut().zip(self.residuals(&q, sigma).iter().zip(&e)) {
                slope[k] = (a - b) / 1e-5;
            }
        }
        let (mut information, mut gradient, mut shares) = (Matrix::zeros(), Vector::zeros(), Vec::new());
        for (slope, e) in slopes.iter().zip(&e) {
            let w = (NU + 1.0) / (NU + e * e);
            information += slope * slope.transpose() * w;
            let share = slope * (-w * e);
            gradient += share;
            shares.push(share);
        }
        for k in 0..P {
            let precision = self.prior[k].1.powi(-2);
            if self.free[k] {
                information[(k, k)] += precision;
                gradient[k] -= (p[k] - self.prior[k].0) * precision;
            } else {
                information[(k, k)] = 1.0;
                gradient[k] = 0.0;
            }
        }
        (information, gradient, shares)
    }
}

/// An optimum of the ring.
struct RingFit {
    objective: f64,
    parameters: Vector,
    information: Matrix,
    /// Each row's share of the score.
    shares: Vec<Vector>,
}

/// The best fit of all parameters, from several starts of the tare.
fn best_fit(trace: &[TraceRow], rows: &[usize], ring: &Ring<'_>, noise_n: f64) -> Option<RingFit> {
    let middle = |k: usize| median(rows.iter().map(|i| trace[*i].force_n[k])).unwrap_or(0.0);
    let lightest = trace.iter().map(|r| r.force_n[0]).fold(f64::INFINITY, f64::min);
    let mut best: Option<RingFit> = None;
    for (x, y) in [(0.0, 0.0), (middle(1), middle(2)), (0.5 * middle(1), 0.5 * middle(2))] {
        for normal in [0.0, lightest] {
            let start = Vector::from([x, y, normal, -0.2, 0.8, 0.0, 0.0, 0.0, 0.0]);
            let (parameters, information, shares) = ring.fit(start, noise_n);
            let objective = ring.objective(&parameters, noise_n);
            if best.as_ref().is_none_or(|b| objective < b.objective) {
                best = Some(RingFit { objective, parameters, information, shares });
            }
        }
    }
    best
}

/// Parameters with the tare that rows before touch have.
fn fit_around(air: &RowsInAir, trace: &[TraceRow], rows: &[usize], noise_n: f64) -> RingFit {
    let free = std::array::from_fn(|k| k > 2);
    let ring = Ring { rows: rows.iter().map(|i| &trace[*i].force_n).collect(), free, prior: PRIOR };
    let [normal, x, y] = air.mean_n;
    let start = Vector::from([x, y, normal, -0.2, 0.8, 0.0, 0.0, 0.0, 0.0]);
    let (parameters, information, shares) = ring.fit(start, noise_n);
    RingFit { objective: ring.objective(&parameters, noise_n), parameters, information, shares }
}

/// Squared distance of the tangential tare from zero under its covariance, grown to the given standard deviations.
fn wald_statistic(covariance: &Matrix, p: &Vector, sd: impl Fn(usize) -> f64) -> f64 {
    let block = covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let b = p.fixed_rows::<2>(0).into_owned();
    let grown = SMatrix::<f64, 2, 2>::from_fn(|i, j| {
        block[(i, j)] * (sd(i) * sd(j)) / (covariance[(i, i)] * covariance[(j, j)]).sqrt().max(1e-12)
    });
    grown.cholesky().map_or(0.0, |c| b.dot(&c.solve(&b)))
}

/// Root mean square distance of rows from the ring, N.
fn rms_distance_n(trace: &[TraceRow], rows: &[usize], p: &Vector) -> f64 {
    let square = |i: &usize| {
        let (radius, wanted) = ring(p, &trace[*i].force_n);
        (radius - wanted).powi(2)
    };
    (rows.iter().map(square).sum::<f64>() / rows.len() as f64).sqrt()
}

/// Median |F|/N of rows with a tare taken off.
fn friction_coefficient(trace: &[TraceRow], rows: &[usize], tare_n: [f64; 3]) -> f64 {
    let of = |i: &usize| {
        let [n, x, y]: [f64; 3] = std::array::from_fn(|k| trace[*i].force_n[k] - tare_n[k]);
        x.hypot(y) / n.max(0.02)
    };
    median(rows.iter().map(of)).unwrap_or(0.0)
}

/// Largest part of the friction coefficient that the tare's intervals may leave open.
const OPEN: f64 = 0.05;

/// The friction coefficient with the whole tare taken off, and the half-width that the tare's intervals give it.
fn friction_tared(trace: &[TraceRow], rows: &[usize], tare_n: [f64; 3], half_n: [f64; 3]) -> [f64; 2] {
    let of = |tare_n| friction_coefficient(trace, rows, tare_n);
    let middle = of(tare_n);
    let change = |k: usize| {
        let at = |sign: f64| of(std::array::from_fn(|j| tare_n[j] + if j == k { sign * half_n[k] } else { 0.0 }));
        (0.5 * (at(1.0) - at(-1.0))).abs().max((at(1.0) - middle).abs()).max((at(-1.0) - middle).abs())
    };
    let open = (0..3).map(|k| change(k).powi(2)).sum::<f64>().sqrt();
    [middle, open]
}

/// Fits the tare to the sliding rows of a trace.
///
/// `None` where fewer than [`LEAST_ROWS`] rows slide.
pub fn fit_tare(trace: &[TraceRow]) -> Option<TareFit> {
    fit_with(trace, RowsInAir::of(trace))
}

/// The fit with the tare of rows before touch, where there are some, and of the ring otherwise.
fn fit_with(trace: &[TraceRow], air: Option<RowsInAir>) -> Option<TareFit> {
    let rows = sliding_rows(trace);
    if rows.len() < LEAST_ROWS {
        return None;
    }
    let noise_n = noise(trace, &rows);
    let ring_of = |free| Ring { rows: rows.iter().map(|i| &trace[*i].force_n).collect(), free, prior: PRIOR };
    let with = match &air {
        Some(air) => fit_around(air, trace, &rows, noise_n),
        None => best_fit(trace, &rows, &ring_of([true; P]), noise_n)?,
    };
    let p = with.parameters;
    let covariance = robust(&with.information, &with.shares, spacing(trace, &rows));
    let without_tare = ring_of([false, false, true, true, true, true, true, true, true]);
    let (without, _, _) = without_tare.fit(Vector::from([0.0, 0.0, p[2], p[3], p[4], 0.0, 0.0, 0.0, 0.0]), noise_n);
    let gain_2ll = (without_tare.objective(&without, noise_n) - with.objective).max(0.0);
    let parts = between_parts(&rows, trace, &p, noise_n);
    let choices = between_forms(&rows, trace, &p, noise_n);
    // Friction and lean of a finger wander: the parts of a trace disagree by more than their rows do.
    let sd = |k: usize| covariance[(k, k)].max(0.0).sqrt().max(parts[k]).hypot(choices[k]);
    let mut loads: Vec<f64> = rows.iter().map(|i| trace[*i].force_n[0]).collect();
    loads.sort_by(f64::total_cmp);
    // What the sensor reads before touch is its tare; the ring shows it less well.
    let of_ring = ([p[2], p[0], p[1]], [T_95 * sd(2), T_95 * sd(0), T_95 * sd(1)]);
    let (tare_n, half_n) = air.as_ref().map_or(of_ring, |air| (air.mean_n, air.half_n));
    let of_air = air.as_ref().map(|air| (0..3).map(|k| (2.0 * air.mean_n[k] / air.half_n[k]).powi(2)).sum::<f64>());
    let p_value = match of_air {
        Some(square) => (-minus_ln_p(square, 3)).exp(),
        None => (-minus_ln_p(wald_statistic(&covariance, &p, sd), 2)).exp(),
    };
    Some(TareFit {
        tare_n,
        half_n,
        friction: [p[3].exp(), p[4]],
        exponent_sd: sd(4),
        normal_exponent_correlation: covariance[(2, 4)] / (sd(2) * sd(4)),
        gain_2ll: of_air.unwrap_or(gain_2ll),
        p: p_value,
        rms_n: [rms_distance_n(trace, &rows, &without), rms_distance_n(trace, &rows, &p)],
        noise_n,
        sliding: Sliding::of(trace, &rows, &p, noise_n),
        friction_as_read: friction_coefficient(trace, &rows, [0.0; 3]),
        friction_tared: Some(friction_tared(trace, &rows, tare_n, half_n))
            .filter(|[middle, open]| *open < OPEN * middle),
        air,
        load_n: [loads[loads.len() / 20], loads[loads.len() - 1 - loads.len() / 20]],
        harmonics: std::array::from_fn(|k| p[5 + k]),
        rows,
    })
}

/// Contiguous parts of a trace that are left out in turn.
const PARTS: usize = 6;
/// 97.5 % of Student's distribution with one degree of freedom less.
const T_95: f64 = 2.57;

/// Standard deviations by leaving out each part in turn (jackknife).
fn between_parts(rows: &[usize], trace: &[TraceRow], p: &Vector, noise_n: f64) -> Vector {
    let fits: Vec<Vector> = parts(rows.len())
        .map(|part| {
            let kept = (0..rows.len()).filter(|i| !part.contains(i)).map(|i| &trace[rows[i]].force_n).collect();
            Ring { rows: kept, free: [true; P], prior: PRIOR }.fit(*p, noise_n).0
        })
        .collect();
    let mean = fits.iter().sum::<Vector>() / PARTS as f64;
    let square: Vector = fits.iter().map(|f| (f - mean).map(|d| d * d)).sum();
    square.map(|s| (s * (PARTS - 1) as f64 / PARTS as f64).sqrt())
}

/// Root mean square changes of the parameters under other choices that nothing in the trace decides between: harmonics half and twice as
/// free, an exponent near 0.6 and near 1, fewer and more rows taken as sliding.
fn between_forms(rows: &[usize], trace: &[TraceRow], p: &Vector, noise_n: f64) -> Vector {
    let harmonics = |factor: f64| -> Prior {
        std::array::from_fn(|k| (PRIOR[k].0, if k > 4 { PRIOR[k].1 * factor } else { PRIOR[k].1 }))
    };
    let exponent = |m: f64| -> Prior { std::array::from_fn(|k| if k == 4 { (m, 0.05) } else { PRIOR[k] }) };
    let few = firm_rows(trace, 0.5);
    let many = firm_rows(trace, 0.2);
    let choices: [(&[usize], Prior); 6] = [
        (rows, harmonics(0.5)),
        (rows, harmonics(2.0)),
        (rows, exponent(0.6)),
        (rows, exponent(1.0)),
        (&few, PRIOR),
        (&many, PRIOR),
    ];
    let mut square = Vector::zeros();
    for (rows, prior) in choices {
        let kept = rows.iter().map(|i| &trace[*i].force_n).collect();
        let other = Ring { rows: kept, free: [true; P], prior }.fit(*p, noise_n).0;
        square += (other - p).map(|d| d * d) / choices.len() as f64;
    }
    square.map(f64::sqrt)
}

/// Covariance that allows for residuals that follow each other over `lags` rows; never below the one without.
fn robust(information: &Matrix, shares: &[Vector], lags: usize) -> Matrix {
    let Some(inverse) = information.try_inverse() else { return Matrix::identity() * 1e6 };
    let mut middle = Matrix::zeros();
    for lag in 0..=lags {
        let weight = 1.0 - lag as f64 / (lags + 1) as f64;
        for i in lag..shares.len() {
            let product = shares[i] * shares[i - lag].transpose();
            middle += if lag == 0 { product } else { (product + product.transpose()) * weight };
        }
    }
    for k in 0..P {
        middle[(k, k)] += PRIOR[k].1.powi(-2);
    }
    let sandwich = inverse * middle * inverse;
    let mut out = sandwich;
    for k in 0..P {
        // A sandwich of few turns can be too thin by chance.
        let grow = (inverse[(k, k)] / sandwich[(k, k)].max(1e-12)).max(1.0).sqrt();
        for j in 0..P {
            out[(k, j)] *= grow;
            out[(j, k)] *= grow;
        }
    }
    out
}

fn spacing(trace: &[TraceRow], rows: &[usize]) -> usize {
    let span = trace[rows[rows.len() - 1]].t_s - trace[rows[0]].t_s;
    let step = span / (rows.len() - 1) as f64;
    ((MEMORY_S / step.max(1e-6)).round() as usize).clamp(1, rows.len() / 4)
}

/// Row noise of the readings, N.
fn noise(trace: &[TraceRow], rows: &[usize]) -> f64 {
    let mut d = Vec::new();
    for w in rows.windows(3).filter(|w| w[2] - w[0] == 2) {
        for k in 0..3 {
            let f = |i: usize| trace[w[i]].force_n[k];
            d.push((f(1) - 0.5 * (f(0) + f(2))).abs());
        }
    }
    noise_from_neighbours(d).max(0.01)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The four public traces: normal is −Fz. The rows before touch are not in the fit of the ring; their mean is the truth.
    #[test]
    fn tares_of_the_public_traces_lie_in_their_intervals() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/human_texture_exploration/");
        let mut inside = 0;
        for name in ["July3_1_force_data_1", "July3_2_force_data_1", "July3_2_force_data_2", "July5_1_force_data_2"] {
            let text = std::fs::read_to_string(format!("{folder}{name}.csv")).unwrap();
            let trace: Vec<TraceRow> = text
                .lines()
                .skip(1)
                .map(|line| {
                    let c: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
                    TraceRow { t_s: c[6], force_n: [-c[2], c[0], c[1]] }
                })
                .collect();
            let truth: [f64; 3] = std::array::from_fn(|k| trace[..5].iter().map(|r| r.force_n[k]).sum::<f64>() / 5.0);
            let fit = fit_with(&trace, None).unwrap();
            assert!(!fit.rows.iter().any(|i| *i < 5), "{name}: rows before touch were used");
            // The friction of this finger differs by a factor from side to side, more than the ring's harmonics follow.
            let shown = if name.starts_with("July5") { Sliding::OffRing } else { Sliding::Shown };
            assert_eq!(fit.sliding, shown, "{name}");
            println!(
                "{name}: truth {truth:.3?} fit {:.3?} ± {:.3?} exponent {:.2} corr {:.2} gain {:.1} rms {:.3?} mu {:.2?} {:.2?} noise {:.3}",
                fit.tare_n,
                fit.half_n,
                fit.friction[1],
                fit.normal_exponent_correlation,
                fit.gain_2ll,
                fit.rms_n,
                fit.friction_as_read,
                fit.friction_tared,
                fit.noise_n
            );
            let covers = (1..3).all(|k| (fit.tare_n[k] - truth[k]).abs() < fit.half_n[k]);
            inside += usize::from(covers);
            for k in 1..3 {
                let half = fit.half_n[k];
                assert!(half > 0.12 || (fit.tare_n[k] - truth[k]).abs() < 0.12, "{name} {k}");
            }
        }
        assert!(inside >= 3, "{inside} of 4");
    }

    #[test]
    fn the_distance_from_a_ring_is_that_of_its_rows() {
        let mut p = Vector::zeros();
        (p[0], p[1]) = (0.1, -0.2);
        let row = |x: f64, y: f64| TraceRow { t_s: 0.0, force_n: [1.0, x, y] };
        let wanted = ring(&p, &row(1.0, 0.0).force_n).1;
        let at = |off: f64, angle: f64| row(0.1 + (wanted + off) * angle.cos(), -0.2 + (wanted + off) * angle.sin());
        let trace = [at(0.03, 0.0), at(-0.04, 0.0), at(9.0, 0.0)];
        let found = rms_distance_n(&trace, &[0, 1], &p);
        assert!((found - (0.5f64 * 0.0025).sqrt()).abs() < 1e-9, "{found} {wanted}");
    }
}
