//! Which other law could stand in an accepted law's place: by the data, and by what the protocol can separate.

use super::fit::{Fit, Start, Task};
use super::laws::{Change, Law, Place};
use super::runs::Run;
use super::scan::{Candidate, columns_of, scored};
use super::select::{priced, refine, space_at, starts};
use super::space::{Clean, Space};
use super::tangents::Tangents;
use super::walk::Active;
use super::wider::Wider;

/// A law that may stand in the place of an accepted one.
#[derive(Clone, Debug)]
pub struct Rival {
    /// The law with its best parameters.
    pub active: Active,
    /// −2 log likelihood above the best law's.
    pub delta_2ll: f64,
    /// Separation that the protocol can be expected to give.
    pub lambda_rival: f64,
}

/// The rivals of one accepted law.
#[derive(Clone)]
pub struct Contest {
    /// Gain of the law over leaving it out.
    pub gain_2ll: f64,
    /// Expected gain of the law under this protocol.
    pub lambda_detect: f64,
    /// Those that cannot be excluded; the law itself comes first with a separation of 0.
    pub candidates: Vec<Rival>,
    /// The best model with another law in the place, where it beats the accepted one.
    pub better: Option<Fit>,
}

/// Contest for the place of law `index` of a fit.
pub fn contest(
    task: &Task<'_>,
    fit: &Fit,
    tangents: &Tangents,
    index: usize,
    grid: &[Candidate],
    testable: &[&'static Law],
    wider: Option<&Wider<'_>>,
) -> Contest {
    let own = fit.laws[index].clone();
    let mut others = fit.laws.clone();
    others.remove(index);
    let start = Start { laws: others.clone(), ..Start::from(fit) };
    let without = task.fit(start, Some(tangents), false, 9);
    let wider = wider.filter(|_| Wider::concerns(own.law));
    let drifted = wider.map_or(f64::INFINITY, |w| w.minus_2ll(Start::from(&without), tangents));
    let gain_2ll = without.minus_2ll.min(drifted) - fit.minus_2ll;

    // The protocol's view: what the law does to the readings, against what others could do instead. The scatter is
    // that of the full model.
    let mut bare = without.clone();
    bare.variances = fit.variances;
    bare.theta.clone_from(&fit.theta);
    bare.modes.clone_from(&fit.modes);
    let space = space_at(task, &bare, tangents);
    let with = task.predict_at(&fit.theta, &fit.laws, &fit.modes);
    let plain = task.predict_at(&fit.theta, &others, &fit.modes);
    let effect = space.clean(&task.column(&with, &plain, 1.0));
    let lambda_detect = Space::size(&effect);
    let seen = scored(&space, grid);

    // The data's view starts where the law was left out.
    let space_without = space_at(task, &without, tangents);
    let scores = scored(&space_without, grid);
    let reach = |law: &Law| {
        seen.iter()
            .filter(|s| grid[s.candidate].start.law == law && s.score.is_some())
            .map(|s| Space::explained(&effect, &s.clean.iter().collect::<Vec<_>>()))
            .fold(0.0, f64::max)
    };
    // What a law does at its size, which for a large one its tangent at none does not tell.
    let apart_at_size = |active: &Active| {
        let mut laws = others.clone();
        laws.push(active.clone());
        let does = space.clean(&task.column(&task.predict_at(&fit.theta, &laws, &fit.modes), &plain, 1.0));
        lambda_detect - Space::explained(&effect, &[&does])
    };
    let mut candidates = vec![Rival { active: own.clone(), delta_2ll: 0.0, lambda_rival: 0.0 }];
    let mut better: Option<Fit> = None;
    for &law in testable.iter().filter(|l| **l != own.law && others.iter().all(|o| o.law != **l)) {
        let alike = alike(&own, law, task.runs);
        let separation = alike.as_ref().map_or(f64::INFINITY, apart_at_size).min(lambda_detect - reach(law));
        let list = starts(grid, &scores, law, 2);
        let score = list.first().map_or(0.0, |s| s.0);
        // Neither near in the data nor near by design: no refit needed.
        if score < 0.4 * gain_2ll - 10.0 && separation > (0.3 * lambda_detect).max(30.0) {
            continue;
        }
        let near = list.into_iter().map(|(_, start)| refine(task, &without, tangents, &start, 7));
        let alike = alike.map(|start| {
            let from = Fit { laws: others.clone(), ..fit.clone() };
            refine(task, &from, tangents, &start, 7)
        });
        let Some(refit) = near.chain(alike).min_by(|a, b| a.minus_2ll.total_cmp(&b.minus_2ll)) else {
            continue;
        };
        let active = refit.laws[refit.laws.len() - 1].clone();
        let wider = wider.filter(|_| Wider::concerns(law));
        let drifted = wider.map_or(f64::INFINITY, |w| w.minus_2ll(Start::from(&refit), tangents));
        let delta_2ll = refit.minus_2ll.min(drifted) - fit.minus_2ll;
        // The grid's shapes may miss the rival's best one; its refit knows it.
        let near = columns_of(task, &bare, &plain, &zero_size(&active));
        let near: Vec<Clean> = near.iter().map(|c| space.clean(c)).collect();
        let separation = separation.min(lambda_detect - Space::explained(&effect, &near.iter().collect::<Vec<_>>()));
        let separation = separation.min(apart_at_size(&active)).max(0.0);
        // The less a protocol can separate, the more of a difference may be the error of a form.
        let inseparable = 1.0 - separation / (0.035 * lambda_detect).max(10.0);
        if delta_2ll < 6.0 + 0.15 * gain_2ll * inseparable.max(0.0) {
            candidates.push(Rival { active, delta_2ll, lambda_rival: separation });
        }
        if priced(&refit) < priced(fit) - 1.0 && better.as_ref().is_none_or(|b| priced(&refit) < priced(b)) {
            better = Some(refit);
        }
    }
    candidates[1..].sort_by(|a, b| a.delta_2ll.total_cmp(&b.delta_2ll));
    Contest { gain_2ll, lambda_detect, candidates, better }
}

/// A law that does as nearly as it can what another one does in its place, row by row; shape parameters of one name are
/// one.
///
/// Two laws that a protocol cannot tell apart end at the same likelihood, but a refit that starts without either of a
/// large pair may stop on its way.
fn alike(own: &Active, law: &'static Law, runs: &[Run]) -> Option<Active> {
    let acts: fn(&Change) -> f64 = match (own.law.place, law.place) {
        (Place::Strength, Place::Strength) => |c| c.strength - 1.0,
        (Place::Stiffness, Place::Stiffness) => |c| c.stiffness - 1.0,
        _ => return None,
    };
    if law.linear != 1 {
        return None;
    }
    let values = law.parameters.iter().map(|p| {
        let same = own.law.parameters.iter().position(|o| o.name == p.name);
        same.map_or(p.typical, |k| own.values[k].clamp(p.low, p.high))
    });
    let mut out = Active { law, values: values.collect() };
    out.values[0] = 1e-3 * law.parameters[0].typical;
    let (mut product, mut square) = (0.0, 0.0);
    for row in runs.iter().flat_map(|r| &r.rows) {
        let change = |active: &Active| {
            let mut change = Change::default();
            active.law.apply(&active.values, row, &mut change);
            acts(&change)
        };
        let one = change(&out) / out.values[0];
        product += one * change(own);
        square += one * one;
    }
    let size = product / square;
    out.values[0] = size.clamp(law.parameters[0].low, law.parameters[0].high);
    (size.is_finite() && size != 0.0).then_some(out)
}

/// The law with its shape and no size.
fn zero_size(active: &Active) -> Active {
    let mut zero = active.clone();
    zero.values[..active.law.linear].fill(0.0);
    zero
}
