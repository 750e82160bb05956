//! Calibration on the device: size, stiffness, lambda and depth offset of a finger from a few presses and a slide with measured forces.
//!
//! Main types: [`Calibration`] (called at step rate), [`Measured`], [`Calibrated`], [`NotCalibrated`]. Uses the step and the rules
//! of retuning.
//!
//! Readings are averaged into blocks while the plane moves by [`BLOCK_MM`]. Five contacts (twins) repeatedly follow all blocks, one
//! block per step: one with the present estimate, and one for each unknown with a small change of it. Their differences are the
//! derivatives of the forces over the unknowns, in stick, in slip and after turns. Each round over the blocks ends with one Gauss-Newton
//! step, which includes a prior for the unknowns. Every step therefore has the same cost, and a round depends on the blocks and the
//! last estimate only.
//!
//! Each unknown follows from other readings: the stiffness from the normal force; the zero of the depth from the growth of the normal
//! force with depth; the size from friction in stick together with the normal force (tangential stiffness is proportional to e size,
//! normal force to e size²); lambda from friction in full slip.

mod estimate;
mod outcome;
mod readings;

use estimate::{Matrix, Round, Scatter, Vector, inverse};
use heapless::Vec;
use outcome::NAMES;
pub use outcome::{Calibrated, Measured, NotCalibrated, Settings, Unknown};
use readings::{Gathering, Reading};

use crate::math::{Scalar, sqrt};
use crate::{ModelOf, Motion, Response, StateOf, Tuning, step};

/// Unknowns: size, stiffness, lambda, zero of the depth.
const UNKNOWNS: usize = 4;
/// Index of the unknown that is a length, and its unit, mm. The other unknowns are logarithms.
const OFFSET: usize = 3;
const OFFSET_UNIT_MM: f32 = 0.1;
/// Change of an unknown in its twin.
const SHIFT: f32 = 0.02;
/// Default number of blocks.
pub const BLOCKS: usize = 160;
/// Initial travel of a block, depth and slide, over which readings are averaged, mm. When all blocks are in use, the travel doubles and
/// pairs of blocks are joined.
pub const BLOCK_MM: f32 = 0.02;
/// Travel over which the error of the model is fully correlated, mm: blocks within it share one weight.
const CORRELATED_MM: f32 = 0.3;
/// Least number of blocks for an estimate.
const BLOCKS_LEAST: usize = 8;
/// Largest change of an unknown in one round, and the share of its standard error below which it has settled.
const CHANGE_MAX: f32 = 0.3;
const SETTLED: f32 = 0.2;
/// Slip margin below which the contact counts as slipping, and the necessary slide in this state, mm.
const SLIPS: f32 = 0.05;
const SLIPPED_MM: f32 = 0.2;
/// Least quotient of the largest and the smallest depth of the presses.
const DEPTHS: f32 = 1.5;

/// A finger that follows the blocks.
#[derive(Clone, Copy, Debug)]
struct Twin<'a, const M: usize, const N: usize> {
    model: ModelOf<'a, M, N>,
    depth_offset_mm: f32,
    state: StateOf<M>,
}

/// Finds size, stiffness, lambda and the zero of the depth of a finger while it presses and slides. No allocation, no panic.
///
/// Press from the air to a small and to a large depth, then to one between, slide until friction is constant, and slide back;
/// `docs/my-firmware.md` has the depths. Single spikes of the readings and values that are not finite are left out; noise is averaged. The
/// finger may differ from the model's by a factor of 3 in stiffness and lambda at least.
///
/// It keeps `B` blocks of 24 bytes. A step costs about five steps of a retuned model (`cargo xtask thumb count`).
///
/// ```
/// use fingerpad::calibration::{Calibration, Measured, NotCalibrated, Settings};
/// use fingerpad::build::Params;
/// use fingerpad::Motion;
///
/// let data = Params::example().try_build()?;
/// let mut calibration = Calibration::<4, 37>::new(&data.model()?, Settings::default());
/// let air = Motion { depth_mm: -0.1, dt_s: 1e-3, ..Motion::default() };
/// calibration.step(air, Measured::default());
/// assert_eq!(calibration.result(), Err(NotCalibrated::NoContact));
/// # Ok::<(), fingerpad::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Calibration<'a, const M: usize, const N: usize, const B: usize = BLOCKS> {
    fitted: ModelOf<'a, M, N>,
    settings: Settings,
    gathering: Gathering,
    block_mm: f32,
    blocks: Vec<Reading, B>,
    twins: [Twin<'a, M, N>; UNKNOWNS + 1],
    round: Round,
    /// Of normal force and friction.
    scatter: [Scatter; 2],
    /// Logarithms of the factors on size, stiffness and lambda; zero of the depth in [`OFFSET_UNIT_MM`].
    estimate: Vector,
    covariance: Matrix,
    /// Of the last round: whether the estimate changed little, the slide in full slip, mm, and the number of blocks.
    settled: bool,
    slipped_mm: f32,
    seen: usize,
}

/// Ends of the unknowns' ranges: those of [`Tuning`], and 0.5 mm to either side.
const RANGES: [[f32; 2]; UNKNOWNS] = [[0.5, 2.0], [0.2, 5.0], [0.1, 10.0], [-0.5, 0.5]];

impl<'a, const M: usize, const N: usize, const B: usize> Calibration<'a, M, N, B> {
    /// A calibration that starts with the model's own finger, without contact.
    pub fn new(model: &ModelOf<'a, M, N>, settings: Settings) -> Self {
        let twin = Twin { model: *model, depth_offset_mm: 0.0, state: StateOf::default() };
        let mut this = Self {
            fitted: *model,
            settings,
            gathering: Gathering::default(),
            block_mm: BLOCK_MM,
            blocks: Vec::new(),
            twins: [twin; UNKNOWNS + 1],
            round: Round::default(),
            scatter: [Scatter::UNKNOWN; 2],
            estimate: [0.0; UNKNOWNS],
            covariance: [[0.0; UNKNOWNS]; UNKNOWNS],
            settled: false,
            slipped_mm: 0.0,
            seen: 0,
        };
        this.retune();
        this
    }

    /// Records one step and processes one block. Values that are not finite are left out.
    ///
    /// * `motion`: motion of the step, with the depth as the device measures it
    /// * `measured`: forces at its end
    pub fn step(&mut self, motion: Motion, measured: Measured) {
        self.record(motion, measured);
        self.work();
    }

    /// The first half of [`Calibration::step`], for an interrupt that leaves the work to another task.
    pub fn record(&mut self, motion: Motion, measured: Measured) {
        let Measured { normal_force_n, friction_n } = measured;
        let [by_x, by_y] = motion.slide_increment_mm;
        let numbers = [motion.depth_mm, by_x, by_y, normal_force_n, friction_n[0], friction_n[1]];
        if !numbers.iter().all(|number| number.is_number()) {
            return;
        }
        if motion.depth_mm <= 0.0 && normal_force_n <= 4.0 * self.settings.force_error_n {
            self.gathering = Gathering::default();
            if self.blocks.last().is_some_and(|block| !block.is_air()) {
                self.keep(Reading::AIR);
            }
            return;
        }
        let [x, y] = self.gathering.slide_mm;
        self.gathering.slide_mm = [x + by_x, y + by_y];
        let slide_mm = self.gathering.slide_mm;
        let reading = Reading { depth_mm: motion.depth_mm, slide_mm, normal_n: normal_force_n, friction_n };
        if let Some(block) = self.gathering.take(reading, self.block_mm) {
            self.keep(block);
        }
    }

    /// Stores a block; if there is no room, pairs of blocks are joined first.
    fn keep(&mut self, block: Reading) {
        if self.blocks.is_full() {
            self.merge();
            self.block_mm *= 2.0;
            self.begin_round();
        }
        // All blocks are ends of presses and cannot be joined: the new block is discarded.
        let _ = self.blocks.push(block);
    }

    fn merge(&mut self) {
        let mut merged: Vec<Reading, B> = Vec::new();
        let mut left = self.blocks.iter().peekable();
        let mut before = Reading::AIR;
        while let Some(block) = left.next() {
            let together = left.peek().and_then(|next| block.with(&before, next));
            if together.is_some() {
                left.next();
            }
            before = together.unwrap_or(*block);
            let _ = merged.push(before);
        }
        self.blocks = merged;
    }

    /// Processes one block, and updates the estimate at the end of a round. May also be called in idle time: a round takes one call per
    /// block, and an estimate some ten rounds.
    pub fn work(&mut self) {
        if let Some(block) = self.blocks.get(self.round.next).copied() {
            self.go_over(block);
            self.round.next += 1;
        } else if self.blocks.len() >= BLOCKS_LEAST {
            self.improve();
            self.begin_round();
        }
    }

    fn begin_round(&mut self) {
        self.round = Round { last: Reading::AIR, ..Round::default() };
        for twin in &mut self.twins {
            twin.state = StateOf::default();
        }
    }

    /// Steps all twins to a block and adds its residuals to the normal equations.
    fn go_over(&mut self, block: Reading) {
        let [from, to] = [self.round.last.slide_mm, block.slide_mm];
        self.round.last = block;
        let slide_increment_mm = [to[0] - from[0], to[1] - from[1]];
        let responses = self.twins.each_mut().map(|twin| {
            let depth_mm = block.depth_mm + twin.depth_offset_mm;
            step(
                &twin.model,
                &mut twin.state,
                Motion { depth_mm, slide_increment_mm, spin_increment_rad: 0.0, dt_s: 1e-3 },
            )
        });
        let [expected, ..] = responses;
        let ends = responses.map(|r| [r.normal_force_n, r.friction_n[0], r.friction_n[1]]);
        // Means over the block, from its start to its end: friction is linear, the root of the normal force is linear.
        let mut means = ends;
        for (mean, begin) in means.iter_mut().zip(self.round.forces) {
            let root = sqrt((mean[0] * begin[0]).magnitude());
            *mean = [(mean[0] + root + begin[0]) * (1.0 / 3.0), 0.5 * (mean[1] + begin[1]), 0.5 * (mean[2] + begin[2])];
        }
        self.round.forces = ends;
        let least = self.settings.force_error_n;
        if !(means.iter().all(|[normal, ..]| *normal > least) && block.normal_n > least) {
            return;
        }
        if expected.slip_margin < SLIPS {
            let [x, y] = slide_increment_mm;
            self.round.slipped_mm += sqrt(x * x + y * y);
        }
        let alike = CORRELATED_MM / self.block_mm;
        self.compare_normal(&block, &means, expected.band_normal_n, alike);
        self.compare_friction(&block, &means, &expected, alike);
    }

    /// The residual is 2 (m − p)/(m + p) in place of ln(m/p). Since the unknowns are factors, the iteration converges in a few rounds even
    /// for a factor of five.
    fn compare_normal(&mut self, block: &Reading, forces: &[[f32; 3]; UNKNOWNS + 1], band_n: f32, alike: f32) {
        let [[expected, ..], others @ ..] = *forces;
        let per_force = 1.0 / expected;
        let slopes = others.map(|[force, ..]| (force - expected) * per_force * (1.0 / SHIFT));
        let residual = 2.0 * (block.normal_n - expected) / (block.normal_n + expected);
        // The band's half-width is 1.96 standard deviations.
        let model = 0.51 * band_n * per_force;
        let force = self.settings.force_error_n * per_force;
        let depth = slopes[OFFSET] * self.settings.depth_error_mm * (1.0 / OFFSET_UNIT_MM);
        let weight = self.scatter[0].weigh(residual, model * model + force * force + depth * depth, alike);
        self.round.add(&slopes, residual, weight);
    }

    /// The residual along the expected friction, over the limit; near full slip that of the logarithm, as above.
    fn compare_friction(
        &mut self,
        block: &Reading,
        forces: &[[f32; 3]; UNKNOWNS + 1],
        response: &Response,
        alike: f32,
    ) {
        let [[_, x, y], others @ ..] = *forces;
        let expected = sqrt(x * x + y * y);
        let limit = response.friction_limit_n;
        if !(expected > self.settings.force_error_n) {
            return;
        }
        let along = |[u, v]: [f32; 2]| (u * x + v * y) / expected;
        let slopes = others.map(|[_, u, v]| (along([u, v]) - expected) / limit * (1.0 / SHIFT));
        let measured = along(block.friction_n);
        let residual = 2.0 * (measured - expected) / (limit + measured.magnitude());
        let model = 0.51 * response.band_friction_n / limit;
        let force = self.settings.force_error_n / limit;
        let weight = self.scatter[1].weigh(residual, model * model + force * force, alike);
        self.round.add(&slopes, residual, weight);
    }

    /// The end of a round: a Gauss-Newton step of limited length, with the prior.
    fn improve(&mut self) {
        let Settings { size, stiffness, lambda, depth_offset_mm, .. } = self.settings;
        let beforehand = [size, stiffness, lambda, depth_offset_mm / OFFSET_UNIT_MM];
        let (mut information, mut pull) = (self.round.information, self.round.pull);
        let diagonal = information.iter_mut().enumerate().filter_map(|(i, row)| row.get_mut(i));
        for (((cell, pull), error), value) in diagonal.zip(&mut pull).zip(beforehand).zip(self.estimate) {
            // An unknown with a standard deviation of 0 in the prior keeps its value.
            let certainty = 1.0 / (error * error + 1e-10);
            *cell += certainty;
            *pull -= certainty * value;
        }
        self.scatter.iter_mut().for_each(Scatter::end_round);
        (self.slipped_mm, self.seen) = (self.round.slipped_mm, self.blocks.len());
        let Some(covariance) = inverse(information) else { return };
        self.covariance = covariance;
        let step = covariance.map(|row| row.iter().zip(&pull).map(|(a, b)| a * b).sum::<f32>());
        self.settled =
            step.iter().zip(self.standard_errors()).all(|(by, error)| by.magnitude() <= SETTLED * error + 1e-6);
        let longest = step.iter().fold(0.0, |most: f32, by| most.max(by.magnitude()));
        let held = if longest > CHANGE_MAX { CHANGE_MAX / longest } else { 1.0 };
        for (value, by) in self.estimate.iter_mut().zip(step) {
            *value += held * by;
        }
        self.retune();
    }

    /// Sets the twins to the estimate.
    fn retune(&mut self) {
        for (i, twin) in self.twins.iter_mut().enumerate() {
            let mut at = self.estimate;
            // The first twin is the estimate itself.
            if let Some(value) = i.checked_sub(1).and_then(|k| at.get_mut(k)) {
                *value += SHIFT;
            }
            let (tuning, depth_offset_mm) = finger(at);
            twin.depth_offset_mm = depth_offset_mm;
            if let Ok(model) = self.fitted.tuned(tuning) {
                twin.model = model;
            }
        }
    }

    /// The present estimate of the finger, also if the motions did not suffice.
    pub fn estimate(&self) -> Calibrated {
        let (tuning, depth_offset_mm) = finger(self.estimate);
        let [size, stiffness, lambda, offset] = self.standard_errors();
        Calibrated {
            tuning,
            depth_offset_mm,
            tuning_error: [size, stiffness, lambda],
            depth_offset_error_mm: offset * OFFSET_UNIT_MM,
        }
    }

    /// In the units of the unknowns.
    fn standard_errors(&self) -> Vector {
        let mut errors = [0.0; UNKNOWNS];
        for (i, (error, row)) in errors.iter_mut().zip(&self.covariance).enumerate() {
            *error = row.get(i).map_or(0.0, |variance| sqrt(variance.not_negative().magnitude()));
        }
        errors
    }

    /// The finger, or the reason why there is no result yet: a missing motion, missing rounds, or a finger out of range.
    pub fn result(&self) -> Result<Calibrated, NotCalibrated> {
        self.motions_suffice()?;
        if !self.settled || self.seen < self.blocks.len() {
            return Err(NotCalibrated::Unsettled);
        }
        let found = self.estimate();
        let Tuning { size, stiffness, lambda } = found.tuning;
        let values = [size, stiffness, lambda, found.depth_offset_mm];
        for ((what, value), [low, high]) in NAMES.into_iter().zip(values).zip(RANGES) {
            if value <= low || value >= high {
                return Err(NotCalibrated::OutOfRange { what, value });
            }
        }
        if self.slipped_mm < SLIPPED_MM {
            return Err(NotCalibrated::NoSlip { slipped_mm: self.slipped_mm });
        }
        for (what, standard_error) in NAMES.into_iter().zip(found.tuning_error) {
            if !(standard_error <= self.settings.wanted) {
                return Err(NotCalibrated::Uncertain { what, standard_error });
            }
        }
        Ok(found)
    }

    /// Whether there were presses enough, to different depths.
    fn motions_suffice(&self) -> Result<(), NotCalibrated> {
        let (mut presses, mut in_air) = (0u8, true);
        let (mut shallowest_mm, mut deepest_mm) = (f32::MAX, 0.0f32);
        let offset = self.estimate[OFFSET] * OFFSET_UNIT_MM;
        for block in &self.blocks {
            if in_air && !block.is_air() {
                presses = presses.saturating_add(1);
            }
            in_air = block.is_air();
            if block.normal_n > self.settings.force_error_n {
                shallowest_mm = shallowest_mm.min((block.depth_mm + offset).max(0.0));
                deepest_mm = deepest_mm.max(block.depth_mm + offset);
            }
        }
        let needed = if self.settings.depth_offset_mm > 0.0 { 3 } else { 2 };
        if !(deepest_mm > 0.0) {
            return Err(NotCalibrated::NoContact);
        }
        if deepest_mm < DEPTHS * shallowest_mm {
            return Err(NotCalibrated::OneDepth { shallowest_mm, deepest_mm });
        }
        if presses < needed { Err(NotCalibrated::FewPresses { presses, needed }) } else { Ok(()) }
    }

    /// The model of the finger found. Depths are then to be given with [`Calibrated::depth_offset_mm`] added.
    pub fn model(&self) -> Result<ModelOf<'a, M, N>, NotCalibrated> {
        let [estimated, ..] = self.twins;
        self.result().map(|_| estimated.model)
    }
}

/// The tuning of the unknowns, clamped to its range, and the zero of the depth, mm.
fn finger(estimate: Vector) -> (Tuning, f32) {
    let [s, e, l, offset] = estimate;
    let [[size, _], [stiffness, _], [lambda, _], [zero, _]] = RANGES;
    let factor = |logarithm: f32, low: f32, high: f32| core::f32::consts::E.power(logarithm).clamp(low, high);
    let tuning = Tuning {
        size: factor(s, size, RANGES[0][1]),
        stiffness: factor(e, stiffness, RANGES[1][1]),
        lambda: factor(l, lambda, RANGES[2][1]),
    };
    (tuning, (offset * OFFSET_UNIT_MM).clamp(zero, RANGES[OFFSET][1]))
}
