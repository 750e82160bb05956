//! The margin to slip on a surface of unknown friction, from measured force and motion.
//!
//! Main types: [`Observer`] (called at step rate; [`MarginObserver`] of a bed, [`PadObserver`] of a pad), [`Reading`], [`Settings`],
//! [`Margin`]. Uses the step of forces and the pad.
//!
//! A soft finger warns before it slips: partial slip bends the curve of friction over slide long before the limit. The observer compares
//! the measured curve with those of a bank of contacts (twins) of different strength. Readings are averaged into blocks; at the end of
//! each all twins move by the measured slide, at the depth at which the model has the measured normal force.
//!
//! The forces of a finger whose tangential stiffness is `s` times that of the model, on a surface of strength factor `f`, are `s` times
//! those of the twin of strength `f/s`. The twins differ by that ratio; the stiffness factor under each is a normal distribution in
//! closed form. What model, zero and drift of the sensors have in common, an error that changes slowly along the slide, is one state of
//! a Kalman filter whose gain is the same for all twins.
//!
//! The share of the contact that sticks, which a tactile skin can measure, tells how much of the limit is used, whatever the
//! surface is, while friction grows. After a turn back all sticks under a large friction; what the share told before then counts on.
//!
//! Bed and pad share all of this; [`Observable`] is what differs. A pad is observed in its own pose and on a curved body. Its twins also
//! turn, and the moment about the normal is a third component of the evidence.

mod bed;
mod finger;
mod gathered;
mod input;
mod outcome;
mod pad;
mod posterior;
mod stick;
mod turn;

pub use finger::{Observable, TwinForces};
use gathered::{Gathered, Load, SMOOTH_S};
use input::Variances;
pub use input::{Reading, Settings};
pub use outcome::{Known, Margin};
pub use pad::PadTwin;
use posterior::{Evidence, Normal, Posterior};
use stick::Stick;
use turn::{ARM_MM, Turn, Turned};

use crate::math::{Elementary, Scalar, sqrt};
use crate::pad::PadOn;
use crate::{Error, ForceStateOf, ModelOf, Motion, Status};

/// The observer of a bed: [`Observer`] with 33 twins.
pub type MarginObserver<'a, const M: usize, const N: usize> = Observer<ModelOf<'a, M, N>, ForceStateOf<M>, 33>;

/// The observer of a pad of up to `P` patches on a body in a pose.
///
/// * `TWINS`: contacts that it compares, each with a state of the pad. With 17 the steps between their strengths are twice those of the bed's
///   observer; with 9 the band may miss the strength.
///
/// An observer with 17 twins of the shipped pad keeps 25 kB. [`Observer::new`] presses and pulls the pad some hundred steps.
///
/// ```
/// use fingerpad::margin::{Known, PadObserver, Reading, Settings};
/// use fingerpad::pad::{EXAMPLE_PATCHES, ExamplePad, PadOn, Plane};
///
/// let example = ExamplePad::new();
/// let finger = PadOn { pad: example.pad(), body: &Plane, pose_deg: [45.0, 0.0] };
/// let observer = PadObserver::<_, EXAMPLE_PATCHES>::new(&finger, Settings::for_pad())?;
/// # Ok::<(), fingerpad::Error>(())
/// ```
pub type PadObserver<'a, B, const P: usize, const TWINS: usize = 17> = Observer<PadOn<'a, B>, PadTwin<P>, TWINS>;

/// Longest time of a block, s.
const BLOCK_S: f32 = 0.1;
/// Least travel of a block over the slip length, and least change of the normal force over its value.
const BLOCK_TRAVEL: f32 = 0.01;
const BLOCK_CHANGE: f32 = 0.05;
/// Standard errors by which a mean must differ before the twins follow it.
const NOTICED: f32 = 3.0;
/// Normal force of a contact beside three standard errors, N.
const TOUCH_N: f32 = 2e-3;
/// Share of the evidence that is forgotten per slip length, and with each reading that is left out.
const FORGOTTEN: f32 = 0.05;
const FORGOTTEN_WITHOUT: f32 = 0.01;
/// Square of the innovation, in standard deviations, that fits no surface if two blocks in a row have it, or if one does.
const SURPRISE: f32 = 25.0;
const SURPRISE_ALONE: f32 = 64.0;
/// Error of the model over friction where little of the limit is used, over that over the limit in full slip.
const STEEP: f32 = 3.0;
/// Error of the slide that a turn amounts to, share: where the finger's middle is, is not exactly known.
const PIVOT: f32 = 0.1;
/// Slope of the stick ratio over the share of the limit that is used.
const STICK_SLOPE: f32 = 1.2;
/// Share of the largest friction by which it falls where the slide turns back, and a rise of the stick ratio beside its noise.
const FALLS: f32 = 0.1;
const RISES: f32 = 0.05;
/// Standard deviation of the error of the expected stick ratio after the normal force has changed by a factor of e under the slide.
const PRESSES: f32 = 0.1;
/// Least variance of a force that counts, N².
const LEAST_N2: f32 = 1e-10;

/// A contact of the bank.
#[derive(Clone, Copy, Debug)]
struct Twin<S> {
    state: S,
    /// Its share of the common error.
    error_n: [f32; 2],
}

/// Finds the margin to slip on an unknown surface while the finger is loaded. No allocation, no panic; any bits in, bounded values out.
///
/// * `F`: the finger, a bed or a pad on a body in a pose
/// * `S`: the state of a twin
///
/// ```
/// use fingerpad::build::Params;
/// use fingerpad::margin::{Known, MarginObserver, Reading, Settings};
///
/// let data = Params::example().try_build()?;
/// let mut observer = MarginObserver::<4, 37>::new(&data.model()?, Settings::default())?;
/// let air = Reading {
///     normal_variance_n2: 25e-6,
///     friction_covariance_n2: [25e-6, 25e-6, 0.0],
///     slide_covariance_mm2: [25e-6, 25e-6, 0.0],
///     dt_s: 1e-3,
///     ..Reading::default()
/// };
/// assert_eq!(observer.step(air).known, Known::NoContact);
/// # Ok::<(), fingerpad::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Observer<F: Observable<S>, S, const TWINS: usize> {
    finger: F,
    tables: F::Tables,
    settings: Settings,
    twins: [Twin<S>; TWINS],
    evidence: [Evidence; TWINS],
    posterior: Posterior<TWINS>,
    /// The stick ratio of the last block, if it was measured.
    stick: Option<Stick>,
    /// Largest friction since the touch or a change of the surface, N, and whether friction grows from there.
    largest_n: f32,
    grows: bool,
    /// Change of the logarithm of the normal force along the slide.
    pressed: f32,
    /// Prior of the stiffness factor, which earlier contacts improve.
    stiffness: Normal,
    /// The common error: its part of the measured friction, N, and its variance, N².
    error_n: [f32; 2],
    error_n2: f32,
    /// Largest friction of late, N.
    peak_n: f32,
    gathered: Gathered,
    turned: Turned,
    /// Position since the last block, mm: measured, and delayed as the force.
    here_mm: [f32; 2],
    delayed_mm: [f32; 2],
    /// Direction of the last slide.
    ahead: [f32; 2],
    load: Load,
    /// Zero of friction, N, and the number of readings in the air.
    tare_n: [f32; 2],
    in_air: f32,
    touches: bool,
    /// Normal force that the twins follow, N, and the part of it that is shear's.
    normal_n: f32,
    of_shear_n: f32,
    depth_mm: f32,
    /// Whether the model has the normal force.
    in_range: bool,
    surprised: bool,
    band: [f32; 2],
    last: Margin,
}

impl<F: Observable<S>, S: Copy, const TWINS: usize> Observer<F, S, TWINS> {
    /// An observer without contact.
    ///
    /// * `finger`: the finger, as calibrated. Its twins have relaxed tissue.
    ///
    /// # Errors
    /// [`Error::Range`] with a setting that is out of its range, [`Error::Shape`] for a pad of more patches than a twin has.
    pub fn new(finger: &F, settings: Settings) -> Result<Self, Error> {
        settings.check()?;
        let stiffness = Normal { mean: 1.0, variance: settings.stiffness * settings.stiffness };
        let tables = finger.tables()?;
        let twin = Twin { state: finger.twin(1.0), error_n: [0.0; 2] };
        let evidence = [Evidence::default(); TWINS];
        let mut this = Self {
            finger: *finger,
            tables,
            settings,
            twins: [twin; TWINS],
            evidence,
            posterior: Posterior::new(&evidence, stiffness, settings.strength, None),
            stick: None,
            largest_n: 0.0,
            grows: true,
            pressed: 0.0,
            stiffness,
            error_n: [0.0; 2],
            error_n2: 0.0,
            peak_n: 0.0,
            gathered: Gathered::default(),
            turned: Turned::default(),
            here_mm: [0.0; 2],
            delayed_mm: [0.0; 2],
            ahead: [0.0; 2],
            load: Load::default(),
            tare_n: [0.0; 2],
            in_air: 0.0,
            touches: false,
            normal_n: 0.0,
            of_shear_n: 0.0,
            depth_mm: 0.0,
            in_range: true,
            surprised: false,
            band: [0.0; 2],
            last: Margin::default(),
        };
        this.leave();
        Ok(this)
    }

    /// The finger leaves the surface, or begins: the next contact starts from the prior of the strength. What is known of the finger's
    /// stiffness stays.
    fn leave(&mut self) {
        self.keep_part_of_stiffness();
        for (twin, (_, ratio)) in self.twins.iter_mut().zip(posterior::ratios::<TWINS>()) {
            *twin = Twin { state: self.finger.twin(ratio), error_n: [0.0; 2] };
        }
        (self.touches, self.in_range) = (false, true);
        (self.of_shear_n, self.depth_mm, self.normal_n, self.peak_n) = (0.0, 0.0, 0.0, 0.0);
        self.gathered = Gathered::default();
        self.turned.leave();
        (self.here_mm, self.delayed_mm, self.ahead) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        self.reopen(self.settings.tare_n * self.settings.tare_n);
    }

    /// Keeps half of what was gained on the finger's stiffness: the place on the finger may be another.
    fn keep_part_of_stiffness(&mut self) {
        let most = self.settings.stiffness * self.settings.stiffness;
        let known = self.posterior.stiffness;
        self.stiffness = Normal { mean: known.mean, variance: (2.0 * known.variance).at_most(most) };
    }

    /// Forgets what is known of the strength.
    fn reopen(&mut self, error_n2: f32) {
        self.evidence = [Evidence::default(); TWINS];
        for twin in &mut self.twins {
            twin.error_n = [0.0; 2];
        }
        (self.error_n, self.error_n2) = ([0.0; 2], error_n2);
        (self.stick, self.largest_n, self.grows, self.pressed) = (None, 0.0, true, 0.0);
        self.judge();
    }

    /// Updates the distribution of the strength and its band.
    fn judge(&mut self) {
        self.posterior = Posterior::new(&self.evidence, self.stiffness, self.settings.strength, self.stick.as_ref());
        let rest = 0.5 * (1.0 - self.settings.confidence);
        self.band = [self.posterior.quantile(rest), self.posterior.quantile(1.0 - rest)];
    }

    /// Takes a reading and returns what is known after it.
    ///
    /// A reading with a number or a covariance that is unsound, or with a clock that stands still, is left out and flagged. The bounds
    /// then widen.
    pub fn step(&mut self, reading: Reading) -> Margin {
        let margin = match reading.check(F::TURNS) {
            Ok(variances) => self.take(&reading, &variances),
            Err(status) => self.without(status),
        };
        self.last = margin;
        margin
    }

    /// A reading that is left out.
    fn without(&mut self, status: Status) -> Margin {
        let [low, high] = self.band;
        self.fade(1.0 - FORGOTTEN_WITHOUT);
        self.judge();
        self.band = [self.band[0].at_most(low), self.band[1].max(high)];
        let last = self.last;
        let now = self.margin(status);
        Margin {
            margin_low: now.margin_low.at_most(last.margin_low),
            margin_high: now.margin_high.max(last.margin_high),
            slip_chance: now.slip_chance.max(last.slip_chance),
            ..now
        }
    }

    fn fade(&mut self, kept: f32) {
        for evidence in &mut self.evidence {
            evidence.add(kept, 0.0, 0.0);
        }
        if let Some(stick) = &mut self.stick {
            stick.per_variance *= kept;
        }
    }

    fn take(&mut self, reading: &Reading, variances: &Variances) -> Margin {
        let Reading { normal_force_n, friction_n, slide_increment_mm, dt_s, .. } = *reading;
        let [x, y] = friction_n;
        let now = [normal_force_n, x - self.tare_n[0], y - self.tare_n[1]];
        self.load.follow(now, dt_s, !self.touches);
        let filtered_n = sqrt((variances.normal * dt_s / (2.0 * SMOOTH_S + dt_s)).magnitude());
        let least_n = 3.0 * filtered_n + TOUCH_N;
        if self.touches && self.load.now[0] < 0.5 * least_n {
            self.leave();
            self.in_air = 0.0;
        } else if !self.touches && self.load.now[0] > least_n {
            self.touches = true;
            let measured = variances.friction / self.in_air.max(1.0);
            let before = self.settings.tare_n * self.settings.tare_n;
            self.error_n2 = if self.in_air > 0.0 { before.at_most(measured) } else { before };
        }
        if !self.touches {
            self.in_air = (self.in_air + 1.0).at_most(1000.0);
            for (tare, force) in self.tare_n.iter_mut().zip(friction_n) {
                *tare += (force - *tare) / self.in_air;
            }
            if F::TURNS {
                self.turned.tare(reading);
            }
            return self.margin(Status::OK);
        }
        let share = dt_s / (self.settings.force_lag_s + dt_s);
        for ((here, delayed), by) in self.here_mm.iter_mut().zip(&mut self.delayed_mm).zip(slide_increment_mm) {
            *here += by;
            *delayed += share * (*here - *delayed);
        }
        if F::TURNS {
            self.turned.add(reading, share);
        }
        self.gathered.add(now, self.delayed_mm, reading.stick_ratio, variances, dt_s);
        let surface_changed = self.block_is_full() && self.follow_block();
        let status = if self.in_range { Status::OK } else { Status::DEPTH_ABOVE_RANGE };
        Margin { surface_changed, ..self.margin(status) }
    }

    /// Limit over stiffness at the estimate, mm.
    fn slip_length_mm(&self) -> f32 {
        let depth = self.depth_mm.max(0.05);
        let strength = Elementary::exp(self.posterior.logarithm.mean);
        let stiffness = self.finger.stiffness_at(&self.tables, depth) * self.posterior.stiffness.mean;
        (self.finger.limit_at(&self.tables, depth) * strength / stiffness.max(1e-6)).max(1e-3).at_most(100.0)
    }

    fn block_is_full(&self) -> bool {
        let g = &self.gathered;
        let [normal, _, slide] = g.errors();
        let [x, y] = g.mean_position();
        let travel = BLOCK_TRAVEL * self.slip_length_mm();
        let change = (g.normal_n / g.number - self.normal_n).magnitude();
        x * x + y * y >= (travel * travel).max(NOTICED * NOTICED * slide)
            || change >= (BLOCK_CHANGE * self.normal_n).max(NOTICED * sqrt(normal.magnitude()))
            || g.time_s >= BLOCK_S
            || F::TURNS && ARM_MM * self.turned.by(g.number).magnitude() >= travel
    }

    /// Moves the twins by the block and weighs them by its friction. Returns whether that fits no surface.
    fn follow_block(&mut self) -> bool {
        let g = core::mem::take(&mut self.gathered);
        let [normal_n2, friction_n2, slide_mm2] = g.errors();
        let per_number = 1.0 / g.number;
        let friction = g.friction_n.map(|f| f * per_number);
        let [x, y] = g.mean_position();
        let travel = sqrt((x * x + y * y).magnitude());
        // Noise must not shake the twins.
        let moves = x * x + y * y > NOTICED * NOTICED * slide_mm2;
        let by = if moves { [x, y] } else { [0.0; 2] };
        for ((here, delayed), by) in self.here_mm.iter_mut().zip(&mut self.delayed_mm).zip(by) {
            *here -= by;
            *delayed -= by;
        }
        let normal = g.normal_n * per_number;
        let before_n = self.normal_n;
        if (normal - self.normal_n).magnitude() > NOTICED * sqrt(normal_n2.magnitude()) {
            self.normal_n = normal;
        }
        let plain = (self.normal_n - self.of_shear_n).max(0.2 * self.normal_n);
        self.depth_mm = self.finger.depth_for_normal(&self.tables, plain);
        self.in_range = self.depth_mm < (1.0 - 1e-4) * self.finger.depth_max_mm();
        let in_range = self.in_range;
        let turn = if F::TURNS { self.turned.take(g.number) } else { Turn::default() };
        let spin_increment_rad = turn.by_rad;
        let motion = Motion { depth_mm: self.depth_mm, slide_increment_mm: by, spin_increment_rad, dt_s: g.time_s };

        // The common error.
        let (length, stiffness) = (self.slip_length_mm(), self.finger.stiffness_at(&self.tables, self.depth_mm));
        let mut travel = if moves { travel } else { 0.0 };
        let turned = if F::TURNS { ARM_MM * turn.by_rad.magnitude() } else { 0.0 };
        if F::TURNS {
            travel += turned;
        }
        let Settings { model_error, correlation, drift, play_mm, tare_drift_n, .. } = self.settings;
        let kept = 1.0 / (1.0 + travel / (correlation * length));
        let amount = sqrt((friction[0] * friction[0] + friction[1] * friction[1]).magnitude());
        self.peak_n = (self.peak_n * kept).max(amount);
        if let Some((moment, _)) = turn.moment {
            self.peak_n = self.peak_n.max(moment.magnitude() * (1.0 / ARM_MM));
        }
        // The model errs by a share of the limit, and by less where little of it is used.
        let limit = stiffness * self.posterior.stiffness.mean * length;
        let changed = ((self.normal_n - before_n).magnitude() / self.normal_n.max(TOUCH_N)).at_most(1.0);
        let error = model_error * limit.at_most(STEEP * self.peak_n);
        self.error_n2 = kept * kept * self.error_n2
            + (1.0 - kept * kept) * error * error
            + stiffness * stiffness * drift * drift * travel * length
            + self.settings.press_error * self.settings.press_error * amount * amount * changed
            + tare_drift_n * tare_drift_n * g.time_s;
        let turns = moves && self.ahead[0] * by[0] + self.ahead[1] * by[1] < 0.0;
        if moves {
            self.ahead = by;
            self.pressed = (self.pressed + changed).at_most(1.0);
        }
        if F::TURNS {
            self.error_n2 += stiffness * stiffness * PIVOT * PIVOT * turned * length;
        }
        if turns {
            self.error_n2 += stiffness * stiffness * play_mm * play_mm;
        }
        let by_normal = amount / self.normal_n.max(TOUCH_N);
        let noise = friction_n2 + stiffness * stiffness * slide_mm2 + by_normal * by_normal * normal_n2;
        let total = (self.error_n2 + noise).max(LEAST_N2).at_most(1e12);
        let (per_total, gain) = (1.0 / total, (self.error_n2 / total).at_most(1.0));
        self.error_n2 = (self.error_n2 * (1.0 - gain)).not_negative().at_most(1e12);

        let measured = [friction[0] - kept * self.error_n[0], friction[1] - kept * self.error_n[1]];
        self.error_n = [0, 1].map(|k| kept * self.error_n[k] + gain * measured[k]);
        let remembered = if in_range { 1.0 - FORGOTTEN * (travel / length).at_most(1.0) } else { 1.0 - FORGOTTEN };
        let posterior = &self.posterior;
        // The error of the moment counts as new only as far as the common error has changed.
        let (moment, per_moment) = turn.moment.map_or((0.0, 0.0), |(moment, noise)| {
            let error = ARM_MM * ARM_MM * error * error / (1.0 - kept * kept).max(1e-6);
            (moment, 1.0 / (noise + error).max(LEAST_N2))
        });
        // The least innovation among those that were possible.
        let mut surprise = f32::MAX;
        for (k, (twin, evidence)) in self.twins.iter_mut().zip(&mut self.evidence).enumerate() {
            let forces = self.finger.step_twin(&mut twin.state, motion);
            let corrected = self.settings.curve_at(1.0 - forces.slip_margin);
            let [x, y] = [0, 1].map(|k| forces.friction_n[k] * corrected - kept * twin.error_n[k]);
            let m = forces.spin_moment_n_mm * corrected;
            twin.error_n = [kept * twin.error_n[0] + gain * x, kept * twin.error_n[1] + gain * y];
            if let Some(strength) = posterior.possible(k) {
                let factor = strength / F::strength_factor(&twin.state);
                let [u, v] = [measured[0] - factor * x, measured[1] - factor * y];
                let mut square = (u * u + v * v) * per_total;
                if F::TURNS {
                    let w = moment - factor * m;
                    square += w * w * per_moment;
                }
                surprise = surprise.min(square);
            }
            if k == posterior.best {
                self.of_shear_n = forces.normal_force_n - self.finger.normal_at(&self.tables, self.depth_mm);
            }
            let by = if in_range { [per_total, per_moment] } else { [0.0; 2] };
            let (mut cross, mut square) = ((measured[0] * x + measured[1] * y) * by[0], (x * x + y * y) * by[0]);
            if F::TURNS {
                (cross, square) = (cross + moment * m * by[1], square + m * m * by[1]);
            }
            evidence.add(remembered, cross, square);
        }
        self.follow_stick(&g, friction_n2, amount, turns);
        let changed = surprise > SURPRISE_ALONE || surprise > SURPRISE && self.surprised;
        self.surprised = surprise > SURPRISE;
        let [low, high] = self.band;
        if changed {
            self.keep_part_of_stiffness();
            self.reopen(error * error + self.settings.tare_n * self.settings.tare_n);
        } else {
            self.judge();
        }
        if !in_range {
            self.band = [self.band[0].at_most(low), self.band[1].max(high)];
        }
        changed
    }

    /// Takes the mean stick ratio of a block, if friction grows beyond all before. Noise and zero of friction count as its errors.
    ///
    /// * `friction_n2`, `amount_n`: variance of the block's friction and its size
    fn follow_stick(&mut self, block: &Gathered, friction_n2: f32, amount_n: f32, turns: bool) {
        let [number, sum, variances] = block.stick;
        let (ratio, noise2) = (sum / number, variances / (number * number));
        let falls_n = (FALLS * self.largest_n).max(NOTICED * sqrt(friction_n2.magnitude()));
        // A share that sticks again tells of a turn that the encoders do not yet.
        let rises = self.stick.as_ref().is_some_and(|s| ratio - s.ratio > NOTICED * sqrt(noise2.magnitude()) + RISES);
        if turns || rises || amount_n < self.largest_n - falls_n {
            self.grows = false;
        }
        if amount_n > self.largest_n + if self.grows { 0.0 } else { falls_n } {
            (self.largest_n, self.grows) = (amount_n, true);
        }
        if number == 0.0 || !self.in_range || !self.grows {
            return;
        }
        let Settings { stick_error, tare_n, .. } = self.settings;
        let limit_n = (self.finger.limit_at(&self.tables, self.depth_mm)
            * Elementary::exp(self.posterior.logarithm.mean))
        .max(1e-4);
        let of_press = PRESSES * self.pressed;
        let of_force = STICK_SLOPE * STICK_SLOPE * (friction_n2 + tare_n * tare_n) / (limit_n * limit_n);
        self.stick = Some(Stick {
            ratio,
            per_variance: 1.0 / (noise2 + stick_error * stick_error + of_press * of_press + of_force),
            used: self.used(self.load.now),
            curve: self.finger.stick_ratios_at(&self.tables, self.depth_mm),
        });
    }

    /// Friction over that of full slip at a strength factor of 1.
    fn used(&self, forces_n: [f32; 3]) -> f32 {
        let best = self.posterior.best;
        let twin = self.twins.get(best).map(|twin| (&twin.state, self.posterior.possible(best).unwrap_or(1.0)));
        self.finger.used(&self.tables, twin, forces_n, self.of_shear_n).not_negative().at_most(1e6)
    }

    /// The margin of the present forces.
    fn margin(&self, status: Status) -> Margin {
        let [strength_low, strength_high] = self.band;
        let Normal { mean, variance } = self.posterior.logarithm;
        let strength_factor = Elementary::exp(mean).max(strength_low).at_most(strength_high);
        let prior = self.settings.strength * self.settings.strength + self.settings.stiffness * self.settings.stiffness;
        let information = (1.0 - sqrt((variance / prior).magnitude())).not_negative();
        let mut margin = Margin {
            strength_factor,
            strength_low,
            strength_high,
            stiffness_factor: self.posterior.stiffness.mean,
            information,
            status,
            ..Margin::default()
        };
        if !self.touches {
            return margin;
        }
        let used = self.used(self.load.now);
        let left = |strength: f32| (1.0 - used / strength).not_negative();
        let rates = self.load.per_s.map(|rate| rate * self.settings.ahead_s);
        let [normal, x, y] = self.load.now;
        let later = self.used([(normal + rates[0]).max(0.0), x + rates[1], y + rates[2]]);
        margin.slip_margin = left(strength_factor);
        margin.margin_low = left(strength_low);
        margin.margin_high = left(strength_high);
        margin.slip_chance = self.posterior.below(later.max(used));
        margin.known = if information < 0.15 {
            Known::Prior
        } else if information < 0.5 {
            Known::Part
        } else {
            Known::Strength
        };
        margin
    }
}
