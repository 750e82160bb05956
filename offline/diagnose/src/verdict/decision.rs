//! From the selection to a decision: the drift of the baseline, competing hypotheses, lack of fit, and what may be claimed.
//!
//! Main types: [`Basis`], [`Decision`].

use crate::data::covariates::Correction;
use crate::data::runs::RunSet;
use crate::laws::{Change, Column, Law, Place};
use crate::model::active_law::ActiveLaw;
use crate::model::prior::Drift;
use crate::model::random_effects::{PerEffect, RandomEffect};
use crate::schema::Verdict;
use crate::selection::acceptance::{SelectionSettings, against_calibration, decisive_p};
use crate::selection::alternative_drift::AlternativeDrift;
use crate::selection::competing::{CompetingHypotheses, competing_hypotheses};
use crate::selection::forward::{LawEvidence, ROUNDS, Selection, SingleLawTest, same_axis, select};
use crate::selection::lack_of_fit::{Expectations, LEAST_SIZE, LackOfFit, SMALL_BESIDE, lack_of_fit_test};
use crate::selection::scan::why_untestable;
use crate::statistics::fit::FitStart;
use crate::statistics::tails::{LEAST_GAIN, minus_ln_p};
use crate::statistics::task::Task;
use crate::verdict::basis::Basis;
use crate::verdict::in_air::gain_in_air;
use crate::verdict::intervals::without_amplitude;
use crate::verdict::sizes::share_of_forces;

/// Everything that a verdict rests on.
pub struct Decision<'a> {
    /// The set, with corrected columns.
    pub set: &'a RunSet,
    /// The task of the measured set, for further questions.
    pub task: Task<'a>,
    /// The selection, after swaps and eliminations.
    pub selection: Selection,
    /// The hypotheses for the place of each accepted law.
    pub hypotheses: Vec<CompetingHypotheses>,
    /// Structure that the accepted laws leave.
    pub lack_of_fit: LackOfFit,
    /// The verdict.
    pub verdict: Verdict,
    /// Variances between runs that the calibration and the errors of state columns explain.
    pub expected_variances: PerEffect,
    /// How much the shape of the curves has changed since the calibration.
    pub drift: Drift,
    /// Laws that stand out from chance and are too small to be named.
    pub too_small: Vec<LawWeight>,
}

/// Families among the candidates for one place, the accepted law's first.
pub fn families(hypotheses: &CompetingHypotheses) -> Vec<&'static str> {
    let mut list: Vec<&'static str> = Vec::new();
    for c in &hypotheses.candidates {
        if !list.contains(&c.active.law.family) {
            list.push(c.active.law.family);
        }
    }
    list
}

impl<'a> Basis<'a> {
    /// Decides what a set (with corrected columns) misses.
    pub fn decide<'s>(&self, set: &'s RunSet) -> Decision<'s>
    where
        'a: 's,
    {
        let (mut settling, drift) = Settling::new(set, self);
        settling.swap_for_better();
        settling.drop_weak();
        settling.drop_without_amplitude();
        let too_small = settling.drop_too_small(self);
        settling.renew_evidence();
        let (lack_of_fit, expected_variances) = settling.left(self);
        let is_open = settling.is_open();
        let Settling { task, selection, hypotheses, .. } = settling;
        // Evidence for a law that no refit confirms is structure too, unless a law that is too small to be named explains it.
        let stands_out = |t: &SingleLawTest| t.significant && t.gain_2ll >= least_gain(t.law, t.p_runs.by_calibration);
        let unclaimed = hypotheses.is_empty() && too_small.is_empty() && selection.tests.iter().any(stands_out);
        let verdict = Verdict::of(lack_of_fit.significant || unclaimed, !hypotheses.is_empty(), is_open);
        Decision { set, task, selection, hypotheses, lack_of_fit, verdict, expected_variances, drift, too_small }
    }
}

/// The least gain of a law. The calibration's runs have all depths, and where it determines the strength over direction better
/// than the measured runs do, a law of the direction is judged against it as well; laws of the sensor have no driver.
fn least_gain(law: &Law, by_calibration: bool) -> f64 {
    let known = |driver: &Column| *driver == Column::Depth || (by_calibration && *driver == Column::Direction);
    if law.drivers.iter().all(known) { 0.0 } else { LEAST_GAIN }
}

/// Share of another law's gain below which a law may be no more than an error of that one's form.
const LITTLE_BESIDE: f64 = 0.005;

/// What a law changes, and by how much it is needed.
pub struct LawWeight {
    /// The law.
    pub law: &'static Law,
    /// What it would change, as a share of the forces.
    pub share: f64,
    /// Whether the rows in the air show it by themselves: then it is no error of the finger's form.
    of_sensor: bool,
    /// Its gain in 2 log likelihood.
    pub gain_2ll: f64,
    /// A larger effect whose error of form it may be.
    pub beside: Option<&'static Law>,
}

impl LawWeight {
    /// Whether it may be an error of the form of another one that has more evidence: it is small on the same axis of the protocol, or has
    /// hardly any beside it.
    fn is_form_of(&self, other: &Self) -> bool {
        let small = same_axis(self.law, other.law) && self.share < SMALL_BESIDE * other.share;
        let most = if small { other.gain_2ll } else { LITTLE_BESIDE * other.gain_2ll };
        self.law != other.law && !self.of_sensor && self.gain_2ll < most
    }
}

/// A selection that is weighed against its competitors.
struct Settling<'a> {
    set: &'a RunSet,
    task: Task<'a>,
    selection: Selection,
    hypotheses: Vec<CompetingHypotheses>,
    /// The wider drift, which laws of depth must beat where it is not allowed.
    alternative: Option<AlternativeDrift<'a>>,
    settings: SelectionSettings,
}

impl<'a> Settling<'a> {
    /// Selects with the small drift, and again with the allowed one where that alone explains the runs better.
    fn new<'b: 'a>(set: &'a RunSet, basis: &Basis<'b>) -> (Self, Drift) {
        let Basis { reference, calibration, settings, discrepancy, .. } = basis;
        let mut task = calibration.task(set, reference);
        let mut selection = select(&task, set, settings.laws, Some(discrepancy), settings);
        let null = &selection.null;
        let alternative = AlternativeDrift::new(set, reference, calibration, &task, null, &selection.null_derivatives);
        // Without a law both are the same fit.
        let starts = [null, &selection.fit];
        let drifted = starts[..1 + usize::from(!selection.accepted().is_empty())]
            .iter()
            .map(|fit| alternative.minus_2ll(FitStart::from(*fit), &selection.derivatives))
            .fold(f64::INFINITY, f64::min);
        let drift = if drifted < selection.fit.minus_2ll { Drift::Allowed } else { Drift::Small };
        let alternative = (drift == Drift::Small).then_some(alternative);
        if drift == Drift::Allowed {
            task = calibration.drifting(drift).task(set, reference);
            selection = select(&task, set, settings.laws, Some(discrepancy), settings);
        }
        (Self { set, task, selection, hypotheses: Vec::new(), alternative, settings: **settings }, drift)
    }

    fn compare(&mut self) {
        let (task, selection) = (&self.task, &self.selection);
        let testable: Vec<&Law> =
            self.settings.laws.iter().copied().filter(|law| why_untestable(law, self.set).is_none()).collect();
        let of_place = |i: usize| {
            competing_hypotheses(
                task,
                &selection.fit,
                &selection.derivatives,
                selection.finger_laws + i,
                (&selection.grid, &selection.of_form),
                &testable,
                self.alternative.as_ref(),
            )
        };
        self.hypotheses = (0..selection.accepted().len()).map(of_place).collect();
    }

    fn refit(&mut self, start: FitStart) {
        (self.selection.fit, self.selection.derivatives) = self.task.fit(start, ROUNDS);
    }

    /// Puts another law in an accepted one's place where it does better there, now that the others are in force.
    fn swap_for_better(&mut self) {
        for _ in 0..3 {
            self.compare();
            let Some(i) = self.hypotheses.iter().position(|h| h.better.is_some()) else { break };
            let better = self.hypotheses[i].better.take().expect("just found");
            let evidence = self.selection.evidence.remove(i);
            self.selection.evidence.push(evidence);
            self.refit(FitStart::from(&better));
        }
    }

    /// Drops laws that would not be accepted any more: they came in by a swap, or beside a law that has gone.
    fn drop_weak(&mut self) {
        while let Some(i) = weakest(&self.selection, &self.hypotheses, &self.settings) {
            self.drop_law(i);
        }
    }

    /// Drops laws whose size may be zero by their own intervals: they have no name to give.
    fn drop_without_amplitude(&mut self) {
        let ln_area_sd = self.task.reference.ln_area_sd;
        loop {
            let gains: Vec<f64> = self.hypotheses.iter().map(|h| h.gain_2ll).collect();
            let weak = without_amplitude(&self.selection, &gains, self.set.runs.len(), ln_area_sd);
            let Some(i) = weak.last() else { break };
            self.drop_law(*i);
        }
    }

    /// What each accepted law changes.
    fn weights(&self) -> Vec<LawWeight> {
        let fit = &self.selection.fit;
        let with_n = self.task.predict(&fit.parameters, &fit.laws);
        let weigh = |(i, hypotheses): (usize, &CompetingHypotheses)| {
            let (others, ActiveLaw { law, .. }) = self.selection.laws_without(i);
            let without_n = self.task.predict(&fit.parameters, &others);
            let share = share_of_forces(self.set, &without_n, &with_n);
            let in_air = minus_ln_p(gain_in_air(self.set, &without_n, &with_n), law.parameters.len());
            let of_sensor = in_air > -against_calibration(&self.settings).ln();
            LawWeight { law, share, of_sensor, gain_2ll: hypotheses.gain_2ll, beside: None }
        };
        let mut out: Vec<LawWeight> = self.hypotheses.iter().enumerate().map(weigh).collect();
        for i in 0..out.len() {
            out[i].beside = out.iter().find(|other| out[i].is_form_of(other)).map(|other| other.law);
        }
        out
    }

    /// Whether candidates that these runs cannot tell apart leave the answer open. They do not where what they change is small beside an
    /// effect of the finger with a name.
    fn is_open(&self) -> bool {
        let (mut open, mut named) = (0.0f64, 0.0f64);
        for (weight, hypotheses) in self.weights().iter().zip(&self.hypotheses) {
            if families(hypotheses).len() > 1 {
                open = open.max(weight.share);
            } else if weight.law.place != Place::Reading {
                named = named.max(weight.share);
            }
        }
        open > SMALL_BESIDE * named
    }

    /// Drops laws smaller than the model can be trusted to be exact, or of less evidence than an error of its form may have,
    /// and reports them: with hundreds of runs an error of the baseline's form stands out from chance as a law does. A law of
    /// little evidence stays where it is all that explains a structure.
    fn drop_too_small(&mut self, basis: &Basis<'_>) -> Vec<LawWeight> {
        let mut out = Vec::new();
        let mut needed: Vec<&Law> = Vec::new();
        loop {
            let by_calibration = |i: usize| self.selection.evidence[i].p_runs.by_calibration;
            let weights = self.weights().into_iter().enumerate().filter(|(_, s)| !needed.contains(&s.law));
            let small = weights.filter(|(i, s)| {
                (s.share < LEAST_SIZE && !s.of_sensor)
                    || s.gain_2ll < least_gain(s.law, by_calibration(*i))
                    || s.beside.is_some()
            });
            let Some((i, least)) = small.min_by(|a, b| a.1.gain_2ll.total_cmp(&b.1.gain_2ll)) else { break };
            if least.share >= LEAST_SIZE && self.is_needed(i, basis) {
                needed.push(least.law);
                continue;
            }
            out.push(least);
            self.drop_law(i);
        }
        out
    }

    /// Whether the runs are explained with a law, and structure is left without it.
    fn is_needed(&mut self, i: usize, basis: &Basis<'_>) -> bool {
        if self.left(basis).0.significant {
            return false;
        }
        let Selection { fit, derivatives, evidence, tests, .. } = &self.selection;
        let with = (fit.clone(), derivatives.clone(), evidence.clone(), tests.clone(), self.hypotheses.clone());
        self.drop_law(i);
        let needed = self.left(basis).0.significant;
        let Selection { fit, derivatives, evidence, tests, .. } = &mut self.selection;
        (*fit, *derivatives, *evidence, *tests, self.hypotheses) = with;
        needed
    }

    /// The structure and scatter that the accepted laws leave, and the variances between runs that calibration and reading
    /// errors explain.
    fn left(&self, basis: &Basis<'_>) -> (LackOfFit, PerEffect) {
        let Self { set, task, selection: Selection { null, fit, derivatives, .. }, .. } = self;
        let mut variances = basis.calibration.fit.variances;
        let of_readings = reading_variances(task, &fit.laws, basis.corrections);
        for (effect, variance) in [RandomEffect::Stiffness, RandomEffect::Strength].into_iter().zip(of_readings) {
            variances[effect.index()] += variance;
        }
        let shares: Vec<f64> = self.weights().iter().map(|w| w.share).collect();
        let expected = Expectations {
            shares: &shares,
            effect_free: (&basis.discrepancy, basis.effect_free),
            variances: &variances,
            calibration_runs: basis.calibration.runs,
            null_variances: &null.variances,
            explained_2ll: null.minus_2ll - fit.minus_2ll,
        };
        (lack_of_fit_test(task, set, fit, derivatives, &expected, self.settings.seed), variances)
    }

    fn drop_law(&mut self, i: usize) {
        let (laws, dropped) = self.selection.laws_without(i);
        self.selection.evidence.remove(i);
        for test in self.selection.tests.iter_mut().filter(|t| t.law == dropped.law) {
            test.significant = false;
        }
        self.refit(FitStart { laws, ..FitStart::from(&self.selection.fit) });
        self.compare();
    }

    /// Takes the gain of each law over leaving it out as its evidence.
    fn renew_evidence(&mut self) {
        let Selection { evidence, fit, finger_laws, cells, .. } = &mut self.selection;
        for ((LawEvidence { gain_2ll, p_model, p_runs }, hypotheses), active) in
            evidence.iter_mut().zip(&self.hypotheses).zip(&fit.laws[*finger_laws..])
        {
            *gain_2ll = hypotheses.gain_2ll;
            *p_model = cells.p(hypotheses.gain_2ll, active.law.parameters.len(), p_runs.by_calibration);
        }
    }
}

/// The law with the largest p, where that would not have been accepted.
fn weakest(selection: &Selection, hypotheses: &[CompetingHypotheses], settings: &SelectionSettings) -> Option<usize> {
    let p = |i: usize| {
        let parameters = selection.accepted()[i].law.parameters.len();
        let p_runs = selection.evidence[i].p_runs;
        decisive_p(selection.cells.p(hypotheses[i].gain_2ll, parameters, p_runs.by_calibration), p_runs)
    };
    (0..hypotheses.len()).filter(|&i| p(i) > settings.alpha).max_by(|&a, &b| p(a).total_cmp(&p(b)))
}

/// Variances of stiffness and strength between runs that the errors of the state's columns cause through the laws.
fn reading_variances(task: &Task<'_>, laws: &[ActiveLaw], corrections: &[Correction]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for correction in corrections {
        for active in laws.iter().filter(|a| a.law.drivers.contains(&correction.column())) {
            for run in task.runs {
                let Some(row) = run.rows.last() else { continue };
                let at = |by: f64| {
                    let mut moved = *row;
                    correction.shift(&mut moved, by);
                    let mut change = Change::default();
                    active.law.apply(&active.values, &moved, &mut change);
                    change
                };
                let (low, high) = (at(-correction.left_sd), at(correction.left_sd));
                let k = usize::from(active.law.place == Place::Strength);
                let pair = if k == 0 { [low.stiffness, high.stiffness] } else { [low.strength, high.strength] };
                sum[k] += (0.5 * (pair[1] / pair[0]).ln()).powi(2) / task.runs.len() as f64;
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::find;

    #[test]
    fn six_standard_deviations_are_asked_of_what_the_calibration_does_not_know() {
        let least = |law: &str, by_calibration| least_gain(find(law).expect("a law of the library"), by_calibration);
        for (law, by_runs, by_calibration) in [
            ("anisotropy", LEAST_GAIN, 0.0),
            ("strain_stiffening", 0.0, 0.0),
            ("tare_bias", 0.0, 0.0),
            ("speed_log", LEAST_GAIN, LEAST_GAIN),
            ("viscous_drag", LEAST_GAIN, LEAST_GAIN),
        ] {
            assert_eq!([least(law, false), least(law, true)], [by_runs, by_calibration], "{law}");
        }
    }

    #[test]
    fn a_law_of_little_evidence_beside_another_or_small_on_its_axis_may_be_that_ones_error_of_form() {
        let weigh = |law: &str, share, gain_2ll, of_sensor| LawWeight {
            law: find(law).expect("a law of the library"),
            share,
            of_sensor,
            gain_2ll,
            beside: None,
        };
        let speed = weigh("speed_log", 0.12, 640.0, false);
        let ageing = weigh("contact_ageing", 0.17, 76_000.0, false);
        for (law, share, gain, of_sensor, beside, expected) in [
            ("viscous_drag", 0.019, 200.0, false, &speed, true),
            ("viscous_drag", 0.04, 200.0, false, &speed, false),
            ("viscous_drag", 0.019, 700.0, false, &speed, false),
            // Another axis: neither size nor a gain of this order speaks against it.
            ("hydration_bell", 0.019, 200.0, false, &speed, false),
            ("adhesion", 0.016, 24.0, false, &ageing, true),
            ("adhesion", 0.016, 400.0, false, &ageing, false),
            // What the rows in the air show is none of the finger's form.
            ("tare_bias", 0.016, 24.0, true, &ageing, false),
        ] {
            let found = weigh(law, share, gain, of_sensor).is_form_of(beside);
            assert_eq!(found, expected, "{law} {share} beside {}", beside.law.name);
        }
        assert!(!speed.is_form_of(&speed));
    }
}
