//! The fit: weighted least squares of the model's parameters to the differences between its replay and the runs.
//!
//! Main types: [`Settings`], [`fit`]. The stages fit the parameters of normal force and friction from several starts, then those of
//! stick ratio and area, then those that act under spin only. Minimiser: Levenberg–Marquardt after MINPACK (crate
//! `levenberg-marquardt`).
//! Uses initial_guess, parameterisation, residuals.

use fingerpad::Error;
use fingerpad::build::ParamsOf;
use fingerpad_fe::contact::RubberFriction;
use fingerpad_least_squares::{
    LevenbergMarquardt, MinimizationReport, Problem, TerminationReason, minimise, objective,
};

use super::full_slip::FullSlipLaw;
use super::initial_guess::initial_guess;
use super::pad::is_free;
use super::parameterisation::{InitialGuess, Parameterisation, rounded};
use super::residuals::{Compared, Replay};
use super::spin_limit::SpinLimit;
use super::{FitProgress, ReduceError, Run};

/// Settings of the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Knots of normal force and area.
    pub rising_knots: usize,
    /// Knots of the other tables.
    pub gentle_knots: usize,
    /// Error of the normal force that has a residual of 1, share of the largest of its run.
    pub normal_share: f64,
    /// Error of friction, and of the spin moment over 3 mm, that has a residual of 1, share of the limit at the depth.
    pub friction_share: f64,
    /// Error of the stick ratio that has a residual of 1.
    pub stick: f64,
    /// The same in full stick and in full slip.
    pub stick_end: f64,
    /// Error of the area that has a residual of 1, share of the largest of its run.
    pub area_share: f64,
    /// Error of the centre of pressure that has a residual of 1, mm, under the largest normal force of its run.
    pub centre_mm: f64,
    /// Change of a number of the fit that has a residual of 1. This prior keeps numbers that the runs do not determine near their start.
    pub prior: f64,
    /// The same for the bends of the yield slides over depth.
    pub bend_prior: f64,
    /// Largest number of iterations.
    pub iterations: usize,
    /// Number of further fits of the forces, from springs that touch at other depths. The best is kept; the sum of squares has many minima.
    pub restarts: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rising_knots: 12,
            gentle_knots: 4,
            normal_share: 0.005,
            friction_share: 0.01,
            stick: 0.03,
            stick_end: 0.01,
            area_share: 0.03,
            centre_mm: 0.1,
            prior: 2.0,
            bend_prior: 0.5,
            iterations: 15,
            restarts: 1,
        }
    }
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub struct Fitted<const M: usize, const N: usize> {
    /// The parameters; bands are 0.
    pub params: ParamsOf<M, N>,
    /// The parameter vector behind them.
    pub theta: Vec<f64>,
    /// Half the sum of squared residuals of normal force and friction at the start and at the end.
    pub cost: [f64; 2],
    /// Evaluations of all runs, those for derivatives not counted.
    pub evaluations: usize,
    /// Why the last minimisation of the forces stopped: text of the minimiser.
    pub ended: String,
}

/// Largest depth of the tables over that of the runs. It is above 1 because the tables have no slope at the last node.
const BEYOND: f64 = 1.005;
/// Depth at which the second spring touches, mm, in the first start and in the further ones.
const SECOND_TOUCHES_MM: [f64; 4] = [0.12, 0.03, 0.3, 0.01];
/// Weight of a row of a run of another model over that of a row of the finite elements. Along held-out runs the error of friction was
/// 4.8 % of its limit with equal weights, 2.9 % with a tenth, and 2.7 % with a thirtieth (without a correction over depth).
const BESIDE: f64 = 0.1;
/// The other springs touch between half of this depth and this depth, share of the largest.
const LAST_TOUCHES: f64 = 0.5;

/// Most repetitions of binding friction in full slip and making the bed passive.
const BINDINGS: usize = 20;

/// Number of minimisations of [`fit`].
pub(super) fn minimisations(springs: usize, settings: &Settings) -> usize {
    let of_forces = SECOND_TOUCHES_MM.len().min(1 + settings.restarts) + 1;
    // Contact; springs in turn, two ways, and each spring turned.
    of_forces + 1 + 2 + springs
}

/// Fits the form with `M` springs and `N` table nodes to those `runs` that are not held out.
///
/// * `beside`: runs of another model of the same finger; each row has a tenth of the weight
/// * `friction`: friction law of the runs. Under Coulomb's law the strengths of the springs follow from the normal force
///
/// # Errors
/// [`ReduceError::Runs`] if there are too few runs for an initial guess, [`ReduceError::Model`] if the core refuses the fitted numbers,
/// [`ReduceError::Fit`] if the minimiser fails.
pub fn fit<const M: usize, const N: usize>(
    runs: &[Run],
    beside: &[Run],
    friction: &RubberFriction,
    settings: &Settings,
    progress: &FitProgress<'_>,
) -> Result<Fitted<M, N>, ReduceError> {
    let all: Vec<&Run> = runs.iter().chain(beside).collect();
    let deepest = BEYOND * all.iter().flat_map(|r| &r.samples).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let coulomb = (!is_free(friction)).then_some(friction.lambda);
    let guess = initial_guess(&all.into_iter().filter(|r| !r.held_out).collect::<Vec<_>>(), coulomb)?;
    let weight = if beside.is_empty() { 1.0 } else { 1.0 / BESIDE };
    let weighted = runs.iter().map(|run| (run, weight)).chain(beside.iter().map(|run| (run, 1.0)));
    let (spinning, planar): (Vec<_>, Vec<_>) = weighted.filter(|(r, _)| !r.held_out).partition(|(r, _)| r.spins());
    let layout = Parameterisation::new(settings.rising_knots, settings.gentle_knots, deepest, friction.beta);
    let mut stages = Stages::<M, N> {
        planar,
        spinning,
        guess,
        layout,
        settings,
        progress,
        theta: vec![],
        evaluations: 0,
        cost: [0.0; 2],
    };
    let ended = stages.fit_forces()?;
    stages.fit_contact()?;
    stages.fit_spin()?;
    let mut params = stages.layout.params::<M, N>(&stages.theta);
    let spinning: Vec<&Run> = stages.spinning.iter().map(|(run, _)| *run).collect();
    let law = match friction {
        _ if !is_free(friction) => Some(FullSlipLaw::coulomb(friction.lambda)),
        // Runs of another model beside few of the finite elements: both have the same friction in full slip.
        _ if !beside.is_empty() => FullSlipLaw::of(&stages.planar),
        _ => None,
    };
    if let Some(law) = law {
        // A bed that is made passive has another normal force in full slip.
        let (fitted, mut kept) = (params, [1.0; N]);
        for _ in 0..BINDINGS {
            params = less_coupled(&fitted, &kept);
            law.bind(&mut params);
            let more = passive_shares(&params)?;
            if more == [1.0; N] {
                break;
            }
            kept.iter_mut().zip(more).for_each(|(kept, more)| *kept *= more);
        }
    }
    SpinLimit::of(&params.build_unchecked(), &spinning).put(&mut params);
    let (params, given_up) = accepted(&params)?;
    let ended = match given_up {
        0.0 => ended,
        share => format!("{ended}; coupling of depth and slide reduced by {:.2} % for passivity", 100.0 * share),
    };
    Ok(Fitted { params, theta: stages.theta, cost: stages.cost, evaluations: stages.evaluations, ended })
}

/// Reduction of the coupling between depth and slide in one iteration, share of the fitted coupling.
const PART: f64 = 0.01;
/// Least share of it that a reduction around some depths keeps. A larger reduction is the same at all depths.
const LEAST_KEPT: f64 = 0.1;
/// Number of nodes to either side of a node that is not passive over which the reduction decreases to 0. It keeps the curves smooth.
const NEIGHBOURS: usize = 6;

/// The parameters in single precision, and the mean reduction over depth of the coupling between depth and slide.
fn accepted<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>) -> Result<(ParamsOf<M, N>, f64), Error> {
    let kept = passive_shares(params)?;
    Ok((rounded(&less_coupled(params, &kept)), 1.0 - kept.iter().sum::<f64>() / N as f64))
}

/// The share of the coupling between depth and slide that is kept at each depth.
///
/// A fit that is not passive is made passive: around the depths where it is not, the slope of the stiffness over depth and the press
/// coupling are reduced as far as necessary.
fn passive_shares<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>) -> Result<[f64; N], Error> {
    let mut kept = [1.0; N];
    loop {
        let beyond = match rounded(&less_coupled(params, &kept)).validate() {
            Ok(()) => return Ok(kept),
            Err(Error::NotPassive { index, .. }) => usize::from(index),
            Err(error) => return Err(error),
        };
        for (node, kept) in kept.iter_mut().enumerate() {
            let away = node.abs_diff(beyond) as f64 / NEIGHBOURS as f64;
            *kept *= 1.0 - PART * (1.0 - away * away).max(0.0);
        }
        if kept.iter().any(|kept| *kept < LEAST_KEPT) {
            return evenly(params);
        }
    }
}

/// The same with an equal reduction at all depths, which keeps the shape of all curves. A bed without coupling is passive.
fn evenly<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>) -> Result<[f64; N], Error> {
    let mut share = PART;
    loop {
        let kept = [(1.0 - share).max(0.0); N];
        match rounded(&less_coupled(params, &kept)).validate() {
            Ok(()) => return Ok(kept),
            Err(Error::NotPassive { .. }) if share < 1.0 => share += PART,
            Err(error) => return Err(error),
        }
    }
}

/// The parameters with the given share of the coupling between depth and slide at each depth.
fn less_coupled<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>, kept: &[f64; N]) -> ParamsOf<M, N, f64> {
    let mut less = *params;
    for (node, kept) in less.nodes.iter_mut().zip(kept) {
        let [x, y] = &mut node.stiffness_slope_n_mm2;
        [x, y, &mut node.press_coupling].into_iter().for_each(|number| *number *= *kept);
    }
    less
}

/// The stages of the fit and their results so far.
struct Stages<'a, const M: usize, const N: usize> {
    /// Runs without spin, each with the weight of its rows.
    planar: Vec<(&'a Run, f64)>,
    /// Runs with spin, with the same weights.
    spinning: Vec<(&'a Run, f64)>,
    guess: InitialGuess,
    layout: Parameterisation,
    settings: &'a Settings,
    progress: &'a FitProgress<'a>,
    theta: Vec<f64>,
    evaluations: usize,
    cost: [f64; 2],
}

impl<const M: usize, const N: usize> Stages<'_, M, N> {
    /// Minimises over the part of the vector that belongs to `compared`, from `theta`; returns the vector and the report.
    fn minimised(
        &mut self,
        compared: Compared,
        theta: &[f64],
    ) -> Result<(Vec<f64>, f64, MinimizationReport<f64>), ReduceError> {
        let runs = if compared == Compared::Spin { &self.spinning } else { &self.planar };
        let range = compared.range(&self.layout, M);
        let mut problem = Replay::<M, N> {
            runs,
            limit: self.guess.limit,
            layout: &self.layout,
            settings: self.settings,
            compared,
            theta: theta.to_vec(),
            progress: self.progress,
        };
        let origin = theta[range.clone()].to_vec();
        let before = problem.residuals(&origin).ok_or_else(|| ReduceError::Fit("no residuals".into()))?;
        // The first step changes a number by about its own size at most, so that the search stays near this minimum.
        let minimiser = LevenbergMarquardt::new()
            .with_ftol(3e-5)
            .with_xtol(1e-6)
            .with_gtol(0.0)
            .with_stepbound(1.0)
            .with_patience(self.settings.iterations);
        let (found, report) = minimise(&mut problem, &origin, &minimiser);
        if !(report.termination.was_successful() || matches!(report.termination, TerminationReason::LostPatience)) {
            return Err(ReduceError::Fit(format!("{:?}", report.termination)));
        }
        self.evaluations += report.number_of_evaluations;
        self.progress.finish_one();
        let mut theta = theta.to_vec();
        theta[range].copy_from_slice(&found);
        Ok((theta, objective(&before), report))
    }

    /// Normal force and friction of the paths without spin; returns why the last minimisation ended.
    fn fit_forces(&mut self) -> Result<String, ReduceError> {
        for second in SECOND_TOUCHES_MM.iter().take(1 + self.settings.restarts) {
            let last = LAST_TOUCHES * self.layout.depth_max_mm;
            let touch: [f64; M] = std::array::from_fn(|j| match j {
                0 => 0.0,
                1 => *second,
                _ => last * (j as f64 - 1.0) / (M as f64 - 1.5),
            });
            let origin = self.layout.start(&touch, &self.guess);
            let (theta, before, report) = self.minimised(Compared::Forces, &origin)?;
            if self.theta.is_empty() || report.objective_function < self.cost[1] {
                self.theta = theta;
                self.cost = [before, report.objective_function];
            }
        }
        // Repeats the minimisation from the best result, with the prior around it.
        let (theta, _, report) = self.minimised(Compared::Forces, &self.theta.clone())?;
        if report.objective_function < self.cost[1] {
            self.theta = theta;
            self.cost[1] = report.objective_function;
        }
        Ok(format!("{:?}", report.termination))
    }

    /// Stick ratio and area of the same paths.
    fn fit_contact(&mut self) -> Result<(), ReduceError> {
        self.theta = self.minimised(Compared::Contact, &self.theta.clone())?.0;
        Ok(())
    }

    /// Positions of the pairs, and the centre of pressure. The fit starts from pairs along x and y in turn, then tries each pair along the
    /// other axis and keeps the best.
    fn fit_spin(&mut self) -> Result<(), ReduceError> {
        if self.spinning.is_empty() {
            return Ok(());
        }
        let all = (1 << M) - 1;
        let origin = self.theta.clone();
        let mut best = f64::INFINITY;
        let mut chosen = self.layout.along_y;
        let mut tried = vec![];
        let in_turn = [0x5555_5555_5555_5555, 0xAAAA_AAAA_AAAA_AAAA_usize].map(|bits| bits & all);
        for round in 0..2 {
            let from = chosen;
            let next: Vec<usize> =
                if round == 0 { in_turn.to_vec() } else { (0..M).map(|j| from ^ (1 << j)).collect() };
            for along_y in next {
                if tried.contains(&along_y) {
                    continue;
                }
                tried.push(along_y);
                self.layout.along_y = along_y;
                let (theta, _, report) = self.minimised(Compared::Spin, &origin)?;
                if report.objective_function < best {
                    best = report.objective_function;
                    self.theta = theta;
                    chosen = along_y;
                }
            }
        }
        self.layout.along_y = chosen;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A coupling that is not passive near the deepest press is reduced there and kept at small depths.
    #[test]
    fn coupling_that_is_not_passive_is_reduced_around_its_depth() {
        let layout = Parameterisation::new(9, 4, 2.5, 0.4);
        let passive = layout.params::<3, 37>(&layout.start(&[0.0, 0.1, 0.8], &InitialGuess::of_a_finger()));
        assert_eq!(accepted(&passive).unwrap(), (rounded(&passive), 0.0));
        let mut coupled = passive;
        while rounded(&coupled).validate().is_ok() {
            for (k, node) in coupled.nodes.iter_mut().enumerate().skip(25) {
                node.press_coupling += 0.002 * (k - 25) as f64;
            }
        }
        assert!(matches!(rounded(&coupled).validate(), Err(Error::NotPassive { .. })));
        let (found, share) = accepted(&coupled).unwrap();
        assert!(share > 0.0 && share < 0.1, "{share}");
        assert_eq!(found.nodes[..15], rounded(&coupled).nodes[..15]);
        assert!(found.nodes[30].press_coupling.abs() > 0.5 * coupled.nodes[30].press_coupling.abs() as f32);
        let kept = evenly(&coupled).unwrap();
        let is_even = kept.iter().all(|share| *share == kept[0]) && kept[0] < 1.0 && kept[0] > 0.0;
        assert!(rounded(&less_coupled(&coupled, &kept)).validate().is_ok() && is_even, "{kept:?}");
        // However strong the coupling is, a passive bed is left.
        coupled.nodes.iter_mut().for_each(|node| node.press_coupling = 5.0);
        assert!(accepted(&coupled).unwrap().1 > 0.5);
    }
}
