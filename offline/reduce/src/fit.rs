//! The fit: the model's numbers that make its replay of the runs least wrong, in the sense of weighted least squares.
//!
//! Main types: [`Settings`], [`fit`]. First what normal force and friction depend on, from several starts, then stick ratio
//! and area, then what only a spin shows. Minimiser: Levenberg–Marquardt after MINPACK (crate `levenberg-marquardt`).
//! Uses initial_guess, parameterisation, residuals.

use fingerpad::Error;
use fingerpad::build::ParamsOf;
use fingerpad_least_squares::{
    LevenbergMarquardt, MinimizationReport, Problem, TerminationReason, minimise, objective,
};

use super::initial_guess::initial_guess;
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
    /// Error of the normal force that counts 1, share of the largest of its run.
    pub normal_share: f64,
    /// Error of friction, and of the spin moment over 3 mm, that counts 1, share of the limit at the depth.
    pub friction_share: f64,
    /// Error of the stick ratio that counts 1.
    pub stick: f64,
    /// Error of the stick ratio that counts 1 where everything sticks or everything slips.
    pub stick_end: f64,
    /// Error of the area that counts 1, share of the largest of its run.
    pub area_share: f64,
    /// Error of the centre of pressure that counts 1, mm, under the largest normal force of its run.
    pub centre_mm: f64,
    /// Change of a number of the fit that counts 1: holds what the runs do not determine at its start.
    pub prior: f64,
    /// The same for the bends of the yield slides over depth.
    pub bend_prior: f64,
    /// Largest number of iterations.
    pub iterations: usize,
    /// Further fits of the forces from springs that touch at other depths, the best of which is kept: the sum of squares has
    /// many minima.
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
    /// Why the last minimisation of the forces stopped, in the minimiser's words.
    pub ended: String,
}

/// Largest depth of the tables over that of the runs: at the last node itself the tables have no slope.
const BEYOND: f64 = 1.005;
/// Depth at which the second spring touches, mm, in the first start and in the further ones.
const SECOND_TOUCHES_MM: [f64; 4] = [0.12, 0.03, 0.3, 0.01];
/// What a row of a run of another model counts, over one of the finite elements. With an equal count friction along held-out runs
/// erred by 4.8 % of its limit, with a tenth by 2.9 %, with a thirtieth by 2.7 % (no correction over depth).
const BESIDE: f64 = 0.1;
/// Depth between whose half and which the others do, share of the largest.
const LAST_TOUCHES: f64 = 0.5;

/// Minimisations of [`fit`].
pub(super) fn minimisations(springs: usize, settings: &Settings) -> usize {
    let of_forces = SECOND_TOUCHES_MM.len().min(1 + settings.restarts) + 1;
    // Contact; springs in turn, two ways, and each spring turned.
    of_forces + 1 + 2 + springs
}

/// Fits the form with `M` springs and `N` table nodes to those `runs` that are not held out.
///
/// * `beside`: runs of another model of the same finger, of which each row counts a tenth as much
/// * `pressure_exponent`: beta of the runs' friction law
///
/// # Errors
/// [`ReduceError::Runs`] if the runs do not suffice for a start, [`ReduceError::Model`] if the core refuses the end's numbers,
/// [`ReduceError::Fit`] if the minimiser gave up.
pub fn fit<const M: usize, const N: usize>(
    runs: &[Run],
    beside: &[Run],
    pressure_exponent: f64,
    settings: &Settings,
    progress: &FitProgress<'_>,
) -> Result<Fitted<M, N>, ReduceError> {
    let all: Vec<&Run> = runs.iter().chain(beside).collect();
    let deepest = BEYOND * all.iter().flat_map(|r| &r.samples).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let guess = initial_guess(&all.into_iter().filter(|r| !r.held_out).collect::<Vec<_>>())?;
    let weight = if beside.is_empty() { 1.0 } else { 1.0 / BESIDE };
    let weighted = runs.iter().map(|run| (run, weight)).chain(beside.iter().map(|run| (run, 1.0)));
    let (spinning, planar): (Vec<_>, Vec<_>) = weighted.filter(|(r, _)| !r.held_out).partition(|(r, _)| r.spins());
    let layout = Parameterisation::new(settings.rising_knots, settings.gentle_knots, deepest, pressure_exponent);
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
    SpinLimit::of(&params.build_unchecked(), &spinning).put(&mut params);
    let (params, given_up) = accepted(&params)?;
    let ended = match given_up {
        0.0 => ended,
        share => format!("{ended}; {:.2} % of what couples depth and slide given up to be passive", 100.0 * share),
    };
    Ok(Fitted { params, theta: stages.theta, cost: stages.cost, evaluations: stages.evaluations, ended })
}

/// Share of what couples depth and slide that may be given up at a depth for a model that is passive, and the part of it that is
/// given up at a time.
const GIVEN_UP: f64 = 0.9;
const PART: f64 = 0.01;
/// Depths to either side of one where it is not passive that give up less and less: a sudden change would bend the curves.
const NEIGHBOURS: usize = 6;

/// The parameters in the numbers of the target, and the share of what couples depth and slide that was given up, the mean over
/// depth. A fit that ends beyond the bound of what is passive is brought to it: about the depths where it is beyond, the stiffness
/// changes with depth by as much less, and pressing amounts to as much less slide, as it takes.
fn accepted<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>) -> Result<(ParamsOf<M, N>, f64), Error> {
    let mut kept = [1.0; N];
    loop {
        let less = less_coupled(params, &kept);
        let beyond = match less.validate() {
            Ok(()) => return Ok((less, 1.0 - kept.iter().sum::<f64>() / N as f64)),
            Err(Error::NotPassive { index, .. }) => usize::from(index),
            Err(error) => return Err(error),
        };
        for (node, kept) in kept.iter_mut().enumerate() {
            let away = node.abs_diff(beyond) as f64 / NEIGHBOURS as f64;
            *kept *= 1.0 - PART * (1.0 - away * away).max(0.0);
        }
        if kept.iter().any(|kept| *kept < 1.0 - GIVEN_UP) {
            return evenly(params);
        }
    }
}

/// The same with one share given up at all depths, which bends no curve.
fn evenly<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>) -> Result<(ParamsOf<M, N>, f64), Error> {
    let mut share = PART;
    loop {
        let less = less_coupled(params, &[1.0 - share; N]);
        match less.validate() {
            Ok(()) => return Ok((less, share)),
            Err(Error::NotPassive { .. }) if share < GIVEN_UP => share += PART,
            Err(error) => return Err(error),
        }
    }
}

/// Parameters of which a share of what couples depth and slide is kept at each depth, in the numbers of the target.
fn less_coupled<const M: usize, const N: usize>(params: &ParamsOf<M, N, f64>, kept: &[f64; N]) -> ParamsOf<M, N> {
    let mut less = *params;
    for (node, kept) in less.nodes.iter_mut().zip(kept) {
        let [x, y] = &mut node.stiffness_slope_n_mm2;
        [x, y, &mut node.press_coupling].into_iter().for_each(|number| *number *= *kept);
    }
    rounded(&less)
}

/// The fit's stages and what they have found so far.
struct Stages<'a, const M: usize, const N: usize> {
    /// Runs and what a row of them counts.
    planar: Vec<(&'a Run, f64)>,
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
    /// Minimises over the part of the vector that `compared` stands for, from `theta`; returns the vector and the report.
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
        // The first step may change a number by about as much as it measures: farther off lie other minima.
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
        // Once more from the best end: what the prior held near its start goes on.
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

    /// Places of the pairs, and the centre of pressure: from pairs that lie along x and y in turn, then with one of them turned
    /// if that is better.
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

    /// Numbers that couple too much near the deepest press are brought to what is passive there; shallow ones stay as they are.
    #[test]
    fn what_is_not_passive_is_given_up_about_its_depth() {
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
        let (found, share) = evenly(&coupled).unwrap();
        assert!(found.validate().is_ok() && share > 0.0 && share <= GIVEN_UP, "{share}");
        // What would take more than is allowed is refused.
        coupled.nodes.iter_mut().for_each(|node| node.press_coupling = 5.0);
        assert!(matches!(accepted(&coupled), Err(Error::NotPassive { .. })));
    }
}
