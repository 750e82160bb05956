//! Lack-of-fit test: structure that no law explains, by smooth bases of every column, and the scatter between runs.
//!
//! The score of a group of bases is tested by sign flips over runs like that of a law.
//!
//! Main type: [`LackOfFit`].

use fingerpad_smooth::Parameter;

use crate::data::runs::RunSet;
use crate::laws::Place;
use crate::model::active_law::ActiveLaw;
use crate::model::random_effects::{PerEffect, RandomEffect};
use crate::schema::STRUCTURE_P;
use crate::selection::bases::{BasisGroup, basis_groups};
use crate::selection::discrepancy::ModelDiscrepancy;
use crate::statistics::derivatives::Derivatives;
use crate::statistics::fit::Fit;
use crate::statistics::products::dot;
use crate::statistics::projection::{ProjectedColumn, Projection};
use crate::statistics::sign_flips::{Score, SignFlips};
use crate::statistics::tails::{LEAST_GAIN, f_tail, minus_ln_p};
use crate::statistics::task::Task;

/// Structure and scatter that are left after the accepted effects.
#[derive(Clone, Debug, Default)]
pub struct LackOfFit {
    /// Whether it counts.
    pub significant: bool,
    /// Column of the strongest structure.
    pub column: String,
    /// Channel of the readings that it modulates: `normal` or `friction`.
    pub channel: String,
    /// Gain in 2 log likelihood of that structure.
    pub gain: f64,
    /// Model-based p over all bases.
    pub p_model: f64,
    /// Sign-flip p over all bases.
    pub p_runs: f64,
    /// Variance between runs over that of the calibration: of stiffness and strength.
    pub scatter_ratio: [f64; 2],
    /// p of the larger ratio that is above twice the expected.
    pub p_scatter: f64,
    /// Whether it counts as structure: it is large, or the accepted laws left most of it.
    pub is_scattered: bool,
    /// Size of what was found, root mean square over the rows in contact, N.
    pub size_n: f64,
    /// The same over the root mean square of that force.
    pub size_relative: f64,
    /// Smallest size that counts: of the model's form, or of the form of a law that was accepted.
    pub least_size: f64,
    /// Whether structure stands out from chance that is smaller than that.
    pub is_too_small: bool,
}

/// Smallest effect or structure that counts, as a share of the set's forces (root mean squares): the baseline's form is no more exact
/// than that. Row by row a cross-talk would be any share of a friction that is still about zero.
pub const LEAST_SIZE: f64 = 0.005;
/// Share of the largest effect up to which another one, or structure, is small beside it: the form of an effect is no more exact.
pub const SMALL_BESIDE: f64 = 0.25;

/// Numbers and runs that the test compares a fit with.
pub struct Expectations<'a> {
    /// The effect-free runs, in which errors of the baseline's form show too.
    pub effect_free: (&'a ModelDiscrepancy<'a>, &'a RunSet),
    /// Variances between runs that the calibration and reading errors explain.
    pub variances: &'a PerEffect,
    /// Number of calibration runs.
    pub calibration_runs: usize,
    /// Variances between runs of the baseline alone.
    pub null_variances: &'a PerEffect,
    /// Gain of the accepted laws, against which structure is weighed.
    pub explained_2ll: f64,
    /// What each accepted law changes, as a share of the forces.
    pub shares: &'a [f64],
}

/// Scatter over the expected, as variances, that no error of an accepted law's form excuses.
const LARGE_SCATTER: f64 = 8.0;
/// Smallest standard deviation between runs that is resolved, a share of the force.
const LEAST_SCATTER: f64 = 0.004;

impl Expectations<'_> {
    /// Smallest structure that is neither an error of the baseline's form nor of an accepted law's, as a share of the forces.
    fn least_size(&self) -> f64 {
        self.shares.iter().map(|share| SMALL_BESIDE * share).fold(LEAST_SIZE, f64::max)
    }
}

/// Tests a fit for structure and scatter that it does not explain.
pub fn lack_of_fit_test(
    task: &Task<'_>,
    set: &RunSet,
    fit: &Fit,
    derivatives: &Derivatives,
    expected: &Expectations<'_>,
    seed: u64,
) -> LackOfFit {
    let projection = Projection::at(task, fit, derivatives);
    let groups = basis_groups(task, set, derivatives, false);
    let mut out = LackOfFit { p_model: 1.0, p_runs: 1.0, p_scatter: 1.0, ..LackOfFit::default() };
    strongest_structure(&mut out, task, &projection, &groups, expected, seed);
    compare_scatter(&mut out, task, fit, derivatives, expected);
    let stands_out = out.gain > (0.15 * expected.explained_2ll).max(LEAST_GAIN)
        && ((out.p_runs <= 0.01 && out.p_model <= 3e-4) || (out.p_model <= 1e-6 && out.p_runs <= 0.1));
    out.least_size = expected.least_size();
    out.is_too_small = stands_out && out.size_relative < out.least_size;
    let structure = stands_out && !out.is_too_small;
    let between_runs = out.is_scattered || is_uneven(task, fit, &projection, expected);
    out.significant = structure || between_runs;
    if !structure {
        left_in_direction(&mut out, task, fit);
    }
    if between_runs && !structure {
        let (effect, channel) = match out.scatter_ratio {
            [normal, friction] if normal > friction => (RandomEffect::Stiffness, "normal"),
            _ => (RandomEffect::Strength, "friction"),
        };
        out.column = "run_id".to_owned();
        out.channel = channel.to_owned();
        let excess = fit.variances[effect.index()] - expected.variances[effect.index()];
        out.size_relative = excess.max(0.0).sqrt();
        out.size_n = out.size_relative * force_n(task, channel);
    }
    out
}

/// Root mean square of a channel's readings over the rows in contact, N.
pub fn force_n(task: &Task<'_>, channel: &str) -> f64 {
    in_contact_n(task, channel, &task.readings_n)
}

/// Root mean square over the rows in contact of three values a row, N: of the normal force, or of both frictions together.
fn in_contact_n(task: &Task<'_>, channel: &str, values_n: &[f64]) -> f64 {
    let (mut sum, mut rows) = (0.0, 0.0);
    let contact = task.runs.iter().flat_map(|run| &run.rows).map(|row| row.depth_mm > 0.0);
    for (v, _) in values_n.chunks_exact(3).zip(contact).filter(|(_, contact)| *contact) {
        let square = if channel == "normal" { v[0] * v[0] } else { v[1] * v[1] + v[2] * v[2] };
        if square.is_finite() {
            sum += square;
            rows += 1.0;
        }
    }
    f64::sqrt(sum / f64::max(rows, 1.0))
}

/// Standard deviations of what the calibration and the allowed drift leave, by which a finger's own forward-backward
/// difference can have changed. Laws that are accepted leave up to five in it, effects of the direction ten and more.
const LARGEST_TURN: f64 = 7.0;

/// Counts as structure a forward-backward difference of the strength that the calibration rules out: the baseline has one
/// of its own, which takes up an effect of the direction where the runs lie on few axes.
fn left_in_direction(out: &mut LackOfFit, task: &Task<'_>, fit: &Fit) {
    let known = task.prior.root.transpose() * &task.prior.root;
    let Some(covariance) = known.cholesky().map(|c| c.inverse()) else { return };
    let change = |p: Parameter| (fit.parameters[p] - task.prior.mean[p]) / covariance[(p.index(), p.index())].sqrt();
    let largest = [Parameter::OddDirectionCos, Parameter::OddDirectionSin]
        .map(|p| change(p).abs())
        .into_iter()
        .fold(0.0, f64::max);
    if largest > LARGEST_TURN {
        out.significant = true;
        "direction_deg".clone_into(&mut out.column);
        "friction".clone_into(&mut out.channel);
        out.gain = largest * largest;
        let turned =
            [Parameter::OddDirectionCos, Parameter::OddDirectionSin].map(|p| fit.parameters[p] - task.prior.mean[p]);
        out.size_relative = turned[0].hypot(turned[1]) * std::f64::consts::FRAC_1_SQRT_2;
        out.size_n = out.size_relative * force_n(task, "friction");
        out.p_model = (2.0 * (-minus_ln_p(out.gain, 1)).exp()).min(1.0);
    }
}

/// Finds the group of bases with the least p, errors of the baseline's form taken off.
fn strongest_structure(
    out: &mut LackOfFit,
    task: &Task<'_>,
    projection: &Projection<'_>,
    groups: &[BasisGroup],
    expected: &Expectations<'_>,
    seed: u64,
) {
    let scores = group_scores(projection, groups);
    let (free, free_set) = expected.effect_free;
    let free_groups = basis_groups(&free.task, free_set, &free.derivatives, true);
    let free_scores = group_scores(&Projection::at(&free.task, &free.fit, &free.derivatives), &free_groups);
    let of_form = |group: &BasisGroup| {
        let number = group.along_stroke?;
        free_scores.iter().find(|s| free_groups[s.0].along_stroke == Some(number)).map(|s| &s.1)
    };
    let excess = |s: &(usize, Score)| s.1.excess(of_form(&groups[s.0]));
    let size = |s: &(usize, Score)| minus_ln_p(excess(s), s.1.columns());
    let list: Vec<Score> = scores.iter().map(|s| s.1.clone()).collect();
    let flips = SignFlips::of(&list, task.layout.runs(), seed ^ 0x55);
    if let Some(best) = scores.iter().max_by(|a, b| size(a).total_cmp(&size(b))) {
        let (i, score) = best;
        out.column.clone_from(&groups[*i].column);
        groups[*i].channel.clone_into(&mut out.channel);
        out.gain = excess(best);
        out.p_model = (list.len() as f64 * (-size(best)).exp()).min(1.0);
        out.p_runs = flips.p(score);
        let share = (out.gain.max(0.0) / score.gain().max(1e-12)).sqrt();
        out.size_n = share * size_n(task, projection, &groups[*i], score);
        out.size_relative = out.size_n / force_n(task, &out.channel).max(1e-12);
    }
}

/// What a group of bases changes at its linear estimate: root mean square over the rows in contact, N.
fn size_n(task: &Task<'_>, projection: &Projection<'_>, group: &BasisGroup, score: &Score) -> f64 {
    let projected = projection.project_all(group.columns.iter());
    let seen = group.columns.iter().zip(&projected).filter(|(_, own)| Projection::is_seen(own, least_size(group)));
    let mut change_n = vec![0.0; task.sigma_n.len()];
    for ((column, _), estimate) in seen.zip(score.estimate().0.iter()) {
        for ((change, value), sigma) in change_n.iter_mut().zip(column).zip(&task.sigma_n) {
            *change += estimate * value * sigma;
        }
    }
    in_contact_n(task, group.channel, &change_n)
}

/// Least squared norm of a projected column of the group. A smaller one is numerical noise and is left out.
fn least_size(group: &BasisGroup) -> f64 {
    0.02 * group.columns.iter().map(|c| dot(c, c)).fold(0.0, f64::max)
}

/// Scores of the groups that carry something beyond the nuisance, by number of the group.
fn group_scores(projection: &Projection<'_>, groups: &[BasisGroup]) -> Vec<(usize, Score)> {
    let mut scores: Vec<(usize, Score)> = Vec::new();
    let mut projected = projection.project_all(groups.iter().flat_map(|g| &g.columns)).into_iter();
    for (i, group) in groups.iter().enumerate() {
        let own: Vec<ProjectedColumn> = projected.by_ref().take(group.columns.len()).collect();
        if let Some(score) = projection.score(&own.iter().collect::<Vec<_>>(), least_size(group)) {
            scores.push((i, score));
        }
    }
    scores
}

/// Compares the variances between runs of stiffness and strength with those expected, by an F test.
///
/// Scatter that a twentieth of the runs makes by itself is reported and is no structure: rows that a logger lost or garbled in
/// single runs do that, and nothing can be said of their cause.
fn compare_scatter(
    out: &mut LackOfFit,
    task: &Task<'_>,
    fit: &Fit,
    derivatives: &Derivatives,
    expected: &Expectations<'_>,
) {
    let scaled = fit.residual_n.iter().zip(&task.sigma_n).map(|(r, s)| r / s).collect();
    let columns = &derivatives.random_effects;
    let predicted = columns.best_predictions(&fit.variances, &columns.observed(scaled));
    let degrees = |runs: usize| (runs as f64 - 3.0).max(1.0);
    let (n1, n2) = (degrees(task.layout.runs()), degrees(expected.calibration_runs));
    // Where no law changes the load, its scatter is something else, and may be small beside what they change.
    let on_load = |active: &ActiveLaw| matches!(active.law.place, Place::Stiffness | Place::Depth | Place::Rim);
    let loads = fit.laws[task.finger_laws.len()..].iter().any(on_load);
    for (slot, effect) in [RandomEffect::Stiffness, RandomEffect::Strength].into_iter().enumerate() {
        let k = effect.index();
        let (found, wanted) = (fit.variances[k], expected.variances[k]);
        let floor = LEAST_SCATTER.powi(2);
        let ratio = (found + floor) / (wanted + floor);
        out.scatter_ratio[slot] = ratio;
        let p = 2.0 * f_tail(ratio, n1, n2);
        let of_most = ratio.min(ratio * share_of_most(predicted.iter().map(|u| u[k])));
        // Of the scatter that the laws were to explain, most must be gone; a law's form is never exact.
        let (left, before) = (found - wanted, expected.null_variances[k] - wanted);
        if ratio > 2.0 {
            out.p_scatter = out.p_scatter.min(p);
            let all = of_most > 2.0 && 2.0 * f_tail(of_most, n1, n2) < STRUCTURE_P;
            let small = slot == 0 && !loads && left.sqrt() < expected.least_size();
            out.is_scattered |= all && !small && (left > 0.3 * before || of_most > LARGE_SCATTER);
        }
    }
}

/// Runs that may lie off by themselves, as a share.
const FEW: f64 = 0.05;
/// Share of a normal distribution's variance that its middle 95 % has: 0.95 − 2 z φ(z) at z = 1.96.
const WITHIN_MOST: f64 = 0.72;

/// Variance of values without their outermost twentieth over that of all, 1 for a normal distribution.
fn share_of_most(values: impl Iterator<Item = f64>) -> f64 {
    let mut squares: Vec<f64> = values.map(|v| v * v).collect();
    squares.sort_by(f64::total_cmp);
    let all: f64 = squares.iter().sum();
    let few = (FEW * squares.len() as f64).ceil() as usize;
    squares[..squares.len() - few.min(squares.len())].iter().sum::<f64>() / (WITHIN_MOST * all).max(1e-300)
}

/// Whether the size of an accepted law differs from run to run by more than its form's error: then it stands for something that
/// is not recorded. A law that is small beside another one may be that one's error of form, and proves nothing.
fn is_uneven(task: &Task<'_>, fit: &Fit, projection: &Projection<'_>, expected: &Expectations<'_>) -> bool {
    let columns = task.law_columns_of(fit);
    let (own, accepted) = fit.laws.split_at(task.finger_laws.len());
    let mut place: usize = own.iter().map(|active| active.values.len()).sum();
    accepted.iter().zip(expected.shares).any(|(active, share)| {
        let sizes = &active.values[..active.law.linear];
        let size = sizes.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut dispersions = columns[place..place + sizes.len()].iter().map(|column| projection.dispersion(column));
        place += active.values.len();
        *share >= expected.least_size()
            && dispersions.any(|(variance, deviations)| deviations > 6.0 && variance.max(0.0).sqrt() > 0.2 * size)
    })
}
