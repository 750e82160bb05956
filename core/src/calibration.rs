//! Calibration on the device: which finger is this, from a few presses and a slide with measured forces.
//!
//! Main types: [`Calibration`] (fed at step rate), [`Measured`], [`Calibrated`], [`NotCalibrated`]. Uses the step and the rules
//! of retuning.
//!
//! Readings are averaged into blocks while the plane moves by [`BLOCK_MM`]. Five contacts then go over the blocks again and again,
//! one block a step: one of the finger as estimated so far, and one more for each unknown with that one changed a little. Their
//! differences are the derivatives of the forces over the unknowns, through stick, slip and turns alike; at the end of each round
//! stands one step of the method of Gauss and Newton with what is known of fingers beforehand. So every step costs the same, and
//! nothing that was learnt with a bad estimate stays.
//!
//! What makes an unknown visible: the normal force the stiffness, its growth with depth the zero of the depth, friction while
//! the contact sticks beside the normal force the size (tangential stiffness goes as e size, normal force as e size²), friction
//! in full slip lambda.

use heapless::Vec;

use crate::math::{Arithmetic, Scalar, sqrt};
use crate::rescaling::Scaled;
use crate::{Error, ModelOf, Motion, Response, StateOf, Tuning, step};

/// Unknowns: size, stiffness, lambda, zero of the depth.
const UNKNOWNS: usize = 4;
/// The unknown that is a length, and the length in which it is counted, mm. The others are counted as logarithms.
const OFFSET: usize = 3;
const OFFSET_UNIT_MM: f32 = 0.1;
/// Change of an unknown in its twin.
const SHIFT: f32 = 0.02;
/// Blocks that are kept unless said otherwise.
pub const BLOCKS: usize = 160;
/// Way of depth or slide over which readings are averaged at first, mm. It doubles, and every second block goes, when there is no
/// more room.
pub const BLOCK_MM: f32 = 0.02;
/// Way over which the model's own error stays the same: blocks within it count as one, mm.
const CORRELATED_MM: f32 = 0.3;
/// Readings after which a block takes no more: the plane rests.
const READINGS_MAX: f32 = 4096.0;
/// Blocks from which on there is something to estimate.
const BLOCKS_LEAST: usize = 8;
/// Residuals beyond so many of their standard deviations weigh less (Huber 1964, Ann. Math. Statist. 35:73).
const SURPRISE: f32 = 3.0;
/// Largest change of an unknown in one round, and the share of its standard error below which it has settled.
const CHANGE_MAX: f32 = 0.3;
const SETTLED: f32 = 0.2;
/// Slip margin below which the contact counts as slipping, and the slide that it has to go so, mm.
const SLIPS: f32 = 0.05;
const SLIPPED_MM: f32 = 0.2;
/// The deepest depth has to be so many times the shallowest.
const DEPTHS: f32 = 1.5;
/// Depth at which a finger is in the air whatever the zero, mm.
const AIR_MM: f32 = -1.0;

/// How well the finger is known beforehand, and the resolution of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Standard deviation of fingers' size, share; 0 if the size is known to be that of the model.
    pub size: f32,
    /// That of the tissue's stiffness, share.
    pub stiffness: f32,
    /// That of lambda, share.
    pub lambda: f32,
    /// That of the depth at which the finger touches, mm; 0 if the zero of the depth is known. Otherwise three presses are asked
    /// for instead of two.
    pub depth_offset_mm: f32,
    /// Error of the force readings that no averaging takes away, N.
    pub force_error_n: f32,
    /// That of the depth readings, mm.
    pub depth_error_mm: f32,
    /// Largest standard error, share, with which [`Calibration::result`] is content.
    pub wanted: f32,
}

impl Default for Settings {
    /// Size within 25 %, stiffness and lambda within a factor of two, touch within 0.1 mm; errors of 2 mN and 5 µm; content with
    /// 15 %.
    fn default() -> Self {
        Self {
            size: 0.25,
            stiffness: 0.7,
            lambda: 0.7,
            depth_offset_mm: 0.1,
            force_error_n: 2e-3,
            depth_error_mm: 5e-3,
            wanted: 0.15,
        }
    }
}

/// Forces that the plane exerts on the finger, as measured at the end of a step, N; signs as in [`Response`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Measured {
    /// Normal force.
    pub normal_force_n: f32,
    /// Friction along x and y.
    pub friction_n: [f32; 2],
}

/// What is to be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Unknown {
    /// [`Tuning::size`].
    Size,
    /// [`Tuning::stiffness`].
    Stiffness,
    /// [`Tuning::lambda`].
    Lambda,
    /// [`Calibrated::depth_offset_mm`].
    DepthOffset,
}

const NAMES: [Unknown; UNKNOWNS] = [Unknown::Size, Unknown::Stiffness, Unknown::Lambda, Unknown::DepthOffset];

/// A finger found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Calibrated {
    /// For [`ModelOf::tuned`].
    pub tuning: Tuning,
    /// To be added to the depths as given, mm: negative if the finger touches later than they say.
    pub depth_offset_mm: f32,
    /// Standard errors of size, stiffness and lambda, shares of them. Size and stiffness err against each other; the forces are
    /// known better than either.
    pub tuning_error: [f32; 3],
    /// Standard error of the depth offset, mm.
    pub depth_offset_error_mm: f32,
}

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum NotCalibrated {
    /// No reading with contact.
    NoContact,
    /// Contact at one depth only, or nearly.
    OneDepth {
        /// Shallowest depth with a reading, mm.
        shallowest_mm: f32,
        /// Deepest, mm.
        deepest_mm: f32,
    },
    /// Fewer presses from the air than are needed: two, three if the zero of the depth is unknown.
    FewPresses {
        /// Presses seen.
        presses: u8,
        /// Presses needed.
        needed: u8,
    },
    /// No slide in full slip that was long enough.
    NoSlip {
        /// Slide in full slip, mm.
        slipped_mm: f32,
    },
    /// The estimate still changes: go on with [`Calibration::step`] or [`Calibration::work`].
    Unsettled,
    /// An unknown at the end of its range: not a finger like the model's, or forces in other units.
    OutOfRange {
        /// Which.
        what: Unknown,
        /// Its value: a factor, or mm.
        value: f32,
    },
    /// An unknown is not known well enough.
    Uncertain {
        /// Which.
        what: Unknown,
        /// Its standard error: a share, or mm.
        standard_error: f32,
    },
}

impl core::fmt::Display for NotCalibrated {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::NoContact => f.write_str("no reading with contact"),
            Self::OneDepth { shallowest_mm, deepest_mm } => {
                write!(f, "readings from {shallowest_mm} to {deepest_mm} mm of depth only: press to different depths")
            }
            Self::FewPresses { presses, needed } => {
                write!(f, "{presses} presses from the air where {needed} are needed")
            }
            Self::NoSlip { slipped_mm } => {
                write!(f, "{slipped_mm} mm of slide in full slip where {SLIPPED_MM} mm are needed: slide on")
            }
            Self::Unsettled => f.write_str("the estimate still changes"),
            Self::OutOfRange { what, value } => write!(f, "{what:?} is at the end of its range: {value}"),
            Self::Uncertain { what, standard_error } => {
                write!(f, "{what:?} is uncertain: standard error {standard_error}")
            }
        }
    }
}

impl core::error::Error for NotCalibrated {}

/// Where the plane was, and what was measured there. Of a block, where it ended, and the mean of what was measured on its way.
#[derive(Clone, Copy, Debug, Default)]
struct Reading {
    depth_mm: f32,
    /// Since touch.
    slide_mm: [f32; 2],
    normal_n: f32,
    friction_n: [f32; 2],
}

impl Reading {
    const AIR: Self = Self { depth_mm: AIR_MM, slide_mm: [0.0; 2], normal_n: 0.0, friction_n: [0.0; 2] };

    fn is_air(&self) -> bool {
        self.depth_mm <= AIR_MM
    }

    /// The way from another place, mm: depth, slide.
    fn way_from(&self, other: &Self) -> [f32; 3] {
        let [x, y] = [self.slide_mm[0] - other.slide_mm[0], self.slide_mm[1] - other.slide_mm[1]];
        [self.depth_mm - other.depth_mm, x, y]
    }

    /// Its square, mm².
    fn square_from(&self, other: &Self) -> f32 {
        let [deeper, x, y] = self.way_from(other);
        x * x + y * y + deeper * deeper
    }

    /// This block and the next in one, if neither is the air and the plane goes straight on in between.
    fn with(&self, before: &Self, next: &Self) -> Option<Self> {
        let (came, goes) = (self.way_from(before), next.way_from(self));
        let ahead: f32 = came.iter().zip(goes).map(|(a, b)| a * b).sum();
        let straight = ahead > 0.0 && ahead * ahead > 0.8 * self.square_from(before) * next.square_from(self);
        let mean = |a: f32, b: f32| 0.5 * (a + b);
        let friction_n = [0, 1].map(|i| mean(self.friction_n[i], next.friction_n[i]));
        let together = Self { normal_n: mean(self.normal_n, next.normal_n), friction_n, ..*next };
        (straight && !self.is_air() && !next.is_air()).then_some(together)
    }
}

/// Readings on their way into a block.
#[derive(Clone, Copy, Debug, Default)]
struct Gathering {
    /// The last two readings.
    last: [Reading; 2],
    /// How many there are since touch; counts to 2.
    seen: u8,
    /// Slide since touch, mm.
    slide_mm: [f32; 2],
    /// The block's first reading, its sum and number.
    first: Reading,
    sum: Reading,
    readings: f32,
    /// The farthest way from the first, squared, mm², and the block up to there.
    farthest: f32,
    block: Reading,
}

impl Gathering {
    /// Takes a reading; gives a block if the plane has moved by `way_mm` since its first, or has turned back by half of it.
    fn take(&mut self, reading: Reading, way_mm: f32) -> Option<Reading> {
        let [before, last] = self.last;
        self.last = [last, reading];
        if self.seen < 2 {
            self.seen += 1;
            self.first = reading;
            return None;
        }
        // The median of three takes single spikes away; the place is that of the middle reading.
        let median = |a: f32, b: f32, c: f32| a.max(b).min(c.max(a.min(b)));
        let normal_n = median(before.normal_n, last.normal_n, reading.normal_n);
        let friction_n = [0, 1].map(|i| median(before.friction_n[i], last.friction_n[i], reading.friction_n[i]));
        if self.readings < READINGS_MAX {
            self.sum.normal_n += normal_n;
            self.sum.friction_n = [0, 1].map(|i| self.sum.friction_n[i] + friction_n[i]);
            self.readings += 1.0;
        }
        let square = last.square_from(&self.first);
        if square >= self.farthest {
            self.farthest = square;
            let mean = |sum: f32| sum / self.readings;
            self.block =
                Reading { normal_n: mean(self.sum.normal_n), friction_n: self.sum.friction_n.map(mean), ..last };
        }
        let back = sqrt(self.farthest) - 0.5 * way_mm;
        if self.farthest < way_mm * way_mm && !(back > 0.0 && square < back * back) {
            return None;
        }
        (self.first, self.sum) = (self.block, Reading::default());
        (self.readings, self.farthest) = (0.0, 0.0);
        Some(self.block)
    }
}

/// A finger that goes over the blocks.
#[derive(Clone, Copy, Debug)]
struct Twin<'a, const M: usize, const N: usize> {
    model: ModelOf<'a, M, N, Scaled>,
    depth_offset_mm: f32,
    state: StateOf<M>,
}

/// How far the readings of one kind lie from the estimate, shares.
#[derive(Clone, Copy, Debug)]
struct Scatter {
    /// Variance, and the part of it that changes from block to block, as of the last round.
    all: f32,
    white: f32,
    /// The last residual, and sums of the present round.
    last: f32,
    squares: f32,
    steps: f32,
    number: f32,
}

impl Scatter {
    const UNKNOWN: Self = Self { all: 0.01, white: 1e-4, last: 0.0, squares: 0.0, steps: 0.0, number: 0.0 };

    /// Counts a residual; returns what it weighs, if its error from the model's side has the variance `model` and `blocks` share
    /// it.
    fn weigh(&mut self, residual: f32, model: f32, blocks: f32) -> f32 {
        let most = SURPRISE * sqrt(self.all);
        let held = residual.max(-most).min(most);
        self.squares += held * held;
        self.steps += 0.5 * (held - self.last) * (held - self.last);
        (self.last, self.number) = (held, self.number + 1.0);
        let weight = 1.0 / (self.white + (model + (self.all - self.white).not_negative()) * blocks);
        if residual.magnitude() > most { weight * most / residual.magnitude() } else { weight }
    }

    fn end_round(&mut self) {
        if self.number > 0.0 {
            // What the readings cannot tell apart, shares squared.
            let least = 1e-6;
            self.all = (self.squares / self.number).max(least);
            self.white = (self.steps / self.number).max(least).at_most(self.all);
        }
        (self.last, self.squares, self.steps, self.number) = (0.0, 0.0, 0.0, 0.0);
    }
}

type Vector = [f32; UNKNOWNS];
type Matrix = [[f32; UNKNOWNS]; UNKNOWNS];

/// One round over the blocks: the normal equations.
#[derive(Clone, Copy, Debug, Default)]
struct Round {
    /// The next block.
    next: usize,
    /// The last one, and the forces of the twins there, N: normal, along x and y.
    last: Reading,
    forces: [[f32; 3]; UNKNOWNS + 1],
    information: Matrix,
    pull: Vector,
    slipped_mm: f32,
}

impl Round {
    fn add(&mut self, slopes: &Vector, residual: f32, weight: f32) {
        if !(residual.is_number() && weight.is_number()) {
            return;
        }
        for ((row, pull), a) in self.information.iter_mut().zip(&mut self.pull).zip(slopes) {
            *pull += weight * a * residual;
            for (cell, b) in row.iter_mut().zip(slopes) {
                *cell += weight * a * b;
            }
        }
    }
}

/// Finds size, stiffness, lambda and the zero of the depth of a finger while it presses and slides. No allocation, no panic.
///
/// Press from the air to a shallow and to a deep depth, then to one between and slide until the friction stays, and back: the
/// guide, `docs/my-firmware.md`, has the depths. Spikes of single readings are left out, readings and motions that are no number as
/// well; noise is averaged. The finger may be far from the model's: by 3 in stiffness and lambda at least.
///
/// It keeps `B` blocks of 24 bytes. A step costs about five steps of a retuned model (`cargo xtask thumb count`).
///
/// ```
/// use fingerpad::calibration::{Calibration, Measured, NotCalibrated, Settings};
/// use fingerpad::{Motion, Params};
///
/// let data = Params::example().try_build()?;
/// let mut calibration = Calibration::<4, 37>::new(&data.model()?, Settings::default())?;
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
    /// Whether the last round changed little, its slide in full slip, mm, and the blocks that it saw.
    settled: bool,
    slipped_mm: f32,
    seen: usize,
}

/// Ends of the unknowns' ranges: those of [`Tuning`], and 0.5 mm to either side.
const RANGES: [[f32; 2]; UNKNOWNS] = [[0.5, 2.0], [0.2, 5.0], [0.1, 10.0], [-0.5, 0.5]];

impl<'a, const M: usize, const N: usize, const B: usize> Calibration<'a, M, N, B> {
    /// A calibration that begins with the model's own finger, in the air.
    ///
    /// Errors: those of [`ModelOf::tuned`], which a model that loads does not have here.
    pub fn new(model: &ModelOf<'a, M, N>, settings: Settings) -> Result<Self, Error> {
        let twin = Twin { model: model.tuned(Tuning::default())?, depth_offset_mm: 0.0, state: StateOf::default() };
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
        Ok(this)
    }

    /// Takes in one step, the motion with the depth as the device has it and the forces measured at its end, and works on one
    /// block. What is no number is left out.
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

    /// Keeps a block; without room two each become one.
    fn keep(&mut self, block: Reading) {
        if self.blocks.is_full() {
            self.merge();
            self.block_mm *= 2.0;
            self.begin_round();
        }
        // Full of presses alone: there is no room left to learn anything.
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

    /// Goes over one block; at the end of a round improves the estimate. For idle time as well: a round takes as many calls as there
    /// are blocks, an estimate some ten rounds.
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

    /// All twins step to a block; its residuals go into the normal equations.
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
        // On the way of the block, from its begin to its end: friction as a line, the normal force as the square of one.
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

    /// The residual is that of the logarithm, 2 (m − p)/(m + p) in place of ln(m/p): the unknowns are factors, so that even one of
    /// five is found in a few rounds.
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

    /// The residual along the friction expected, over the limit: near full slip that of the logarithm, as above.
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

    /// The end of a round: a step of Gauss and Newton, held to a length, with what is known beforehand.
    fn improve(&mut self) {
        let Settings { size, stiffness, lambda, depth_offset_mm, .. } = self.settings;
        let beforehand = [size, stiffness, lambda, depth_offset_mm / OFFSET_UNIT_MM];
        let (mut information, mut pull) = (self.round.information, self.round.pull);
        let diagonal = information.iter_mut().enumerate().filter_map(|(i, row)| row.get_mut(i));
        for (((cell, pull), error), value) in diagonal.zip(&mut pull).zip(beforehand).zip(self.estimate) {
            // An unknown that is known beforehand stays.
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

    /// Brings the twins to the estimate.
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

    /// The finger as estimated so far, whether or not the motions sufficed.
    pub fn so_far(&self) -> Calibrated {
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
            *error = row.get(i).map_or(0.0, |variance| sqrt(variance.not_negative()));
        }
        errors
    }

    /// The finger, or what is missing: a motion, work, or a model that can be tuned to it.
    pub fn result(&self) -> Result<Calibrated, NotCalibrated> {
        self.motions_suffice()?;
        if !self.settled || self.seen < self.blocks.len() {
            return Err(NotCalibrated::Unsettled);
        }
        let found = self.so_far();
        let Tuning { size, stiffness, lambda, .. } = found.tuning;
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
    pub fn model(&self) -> Result<ModelOf<'a, M, N, Scaled>, NotCalibrated> {
        let [estimated, ..] = self.twins;
        self.result().map(|_| estimated.model)
    }
}

/// What the unknowns say: the tuning, held within its range, and the zero of the depth, mm.
fn finger(estimate: Vector) -> (Tuning, f32) {
    let [s, e, l, offset] = estimate;
    let [[size, _], [stiffness, _], [lambda, _], [zero, _]] = RANGES;
    let factor = |logarithm: f32, low: f32, high: f32| core::f32::consts::E.power(logarithm).clamp(low, high);
    let tuning = Tuning {
        size: factor(s, size, RANGES[0][1]),
        stiffness: factor(e, stiffness, RANGES[1][1]),
        lambda: factor(l, lambda, RANGES[2][1]),
        tau0_mpa: 0.0,
    };
    (tuning, (offset * OFFSET_UNIT_MM).clamp(zero, RANGES[OFFSET][1]))
}

/// The inverse of a symmetric positive definite matrix (Gauss and Jordan, without exchanges).
fn inverse(mut m: Matrix) -> Option<Matrix> {
    for k in 0..UNKNOWNS {
        let pivot = m.get_mut(k)?;
        let per_pivot = 1.0 / core::mem::replace(pivot.get_mut(k)?, 1.0);
        if !(per_pivot > 0.0 && per_pivot <= f32::MAX) {
            return None;
        }
        *pivot = pivot.map(|cell| cell * per_pivot);
        let pivot = *pivot;
        for (_, row) in m.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = core::mem::take(row.get_mut(k)?);
            for (cell, of_pivot) in row.iter_mut().zip(pivot) {
                *cell -= factor * of_pivot;
            }
        }
    }
    Some(m)
}
