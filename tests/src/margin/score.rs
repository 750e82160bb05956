//! The observer and three thresholds on the same readings: errors, bounds, announcements.
//!
//! Main types: [`Lab`], [`Errors`], [`Announced`]. Uses truth and the core.

use super::truth::{DT_S, Measured, Ride, SLIPS, Sensors, Truth, measure};
use crate::synthetic_truth::Random;
use fingerpad::Model;
use fingerpad::margin::{Margin, MarginObserver, Settings};

/// True margins at which the estimate is compared.
pub const MARGINS: [f64; 6] = [0.65, 0.5, 0.35, 0.25, 0.15, 0.05];
/// Strengths of the surfaces; the observer expects 1.
pub const STRENGTHS: [f64; 5] = [0.4, 0.7, 1.0, 1.5, 2.0];
/// Readings that must announce slip, one after the other.
const DEBOUNCE: usize = 10;
/// Friction of full slip for which the lines of the table hold, N: from and to.
pub const LIMITS_N: [f64; 2] = [0.4, 9.0];
/// Standard deviation of the fingers' stiffness.
const STIFFNESS: f64 = 0.15;

/// Runs, and a random finger, surface and speed for each experiment.
pub struct Lab<'a> {
    model: Model<'a>,
    runs: Vec<Truth>,
    random: Random,
    limits_n: [f64; 2],
}

/// One experiment: a run of a random finger on a surface.
pub struct Experiment {
    /// The run of the finite elements.
    pub run: Truth,
    /// How it is traversed.
    pub ride: Ride,
}

impl<'a> Lab<'a> {
    /// Experiments with a friction in full slip within `limits_n`.
    pub fn new(model: Model<'a>, runs: Vec<Truth>, limits_n: [f64; 2], seed: u64) -> Self {
        Self { model, runs, random: Random::new(seed), limits_n }
    }

    /// The k-th experiment, to full slip, on a surface of one of [`STRENGTHS`]. The finger is stiffer or softer by some 15 %.
    pub fn experiment(&mut self, k: usize) -> Experiment {
        for tries in 0.. {
            // Not every strength has runs with such a limit.
            let k = if tries < 20 { k } else { self.random.pick(STRENGTHS.len()) };
            let run = &self.runs[self.random.pick(self.runs.len())];
            let factor = (STIFFNESS * self.random.normal()).exp().clamp(0.7, 1.4);
            let speed_mm_s = 2.0 * 5.0f64.powf(self.random.unit());
            // Finite elements of the strength itself are taken as they are.
            let strength = if run.lambda == 1.0 { STRENGTHS[k % STRENGTHS.len()] } else { 1.0 };
            let run = run.strengthened(&self.model, strength).stiffened(&self.model, factor);
            let last = run.rows.last().expect("rows").friction_n;
            if (self.limits_n[0]..self.limits_n[1]).contains(&last[0].hypot(last[1])) {
                let ride = Ride { speed_mm_s, until: (run.rows.len() - 1) as f64, hold_s: 0.0 };
                return Experiment { run, ride };
            }
            assert!(tries < 10_000, "no run has a limit within {:?} N", self.limits_n);
        }
        unreachable!("an endless loop")
    }

    /// What the sensors measure in an experiment.
    pub fn readings(&mut self, experiment: &Experiment, sensors: &Sensors) -> Vec<Measured> {
        measure(&experiment.run, experiment.ride, sensors, &mut self.random)
    }

    /// A random share, uniform in 0 to 1.
    pub fn share(&mut self) -> f64 {
        self.random.unit()
    }
}

/// Settings with the facts of the sensors.
pub fn settings(sensors: &Sensors, others: Settings) -> Settings {
    Settings {
        force_lag_s: sensors.lag_s as f32,
        play_mm: sensors.play_mm as f32,
        drift: sensors.drift as f32,
        tare_n: sensors.tare_n as f32,
        ..others
    }
}

/// The observer with the facts of the sensors.
pub fn observer<'a>(model: &Model<'a>, sensors: &Sensors) -> MarginObserver<'a, 4, 37> {
    MarginObserver::new(model, settings(sensors, Settings::default())).expect("settings within their ranges")
}

/// Answers along readings.
pub fn observe(model: &Model<'_>, sensors: &Sensors, readings: &[Measured]) -> Vec<Margin> {
    let mut observer = observer(model, sensors);
    readings.iter().map(|m| observer.step(m.reading)).collect()
}

/// Errors at one true margin.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// Number of rows.
    pub number: f64,
    /// Sum of the logarithmic error of the strength.
    pub sum: f64,
    /// Sum of the squares of the logarithmic error of the strength.
    pub square: f64,
    /// Rows whose band of the strength, and of the margin, covers the truth.
    pub covered: [f64; 2],
    /// Rows whose lower bound of the margin is at most the truth.
    pub safe: f64,
    /// Sum of the logarithm of the band's upper over its lower end.
    pub width: f64,
}

impl Errors {
    /// Adds an answer at a true strength and margin.
    pub fn add(&mut self, strength: f64, truth: f64, m: &Margin) {
        let error = (f64::from(m.strength_factor) / strength).ln();
        let within = |low: f32, x: f64, high: f32| f64::from(low) <= x && x <= f64::from(high);
        self.number += 1.0;
        self.sum += error;
        self.square += error * error;
        self.covered[0] += f64::from(u8::from(within(m.strength_low, strength, m.strength_high)));
        self.covered[1] += f64::from(u8::from(within(m.margin_low, truth, m.margin_high)));
        self.safe += f64::from(u8::from(f64::from(m.margin_low) <= truth));
        self.width += f64::from(m.strength_high / m.strength_low).ln();
    }
    /// Mean logarithmic error of the strength.
    pub fn bias(&self) -> f64 {
        self.sum / self.number
    }
    /// Bias and scatter together.
    pub fn rms(&self) -> f64 {
        (self.square / self.number).sqrt()
    }
}

/// Errors of `number` experiments at [`MARGINS`].
pub fn errors(lab: &mut Lab<'_>, sensors: &Sensors, number: usize, test_motion: bool) -> [Errors; 6] {
    let mut all = [Errors::default(); 6];
    for k in 0..number {
        let mut experiment = lab.experiment(k);
        if test_motion {
            experiment.run = experiment.run.with_test_motion();
            experiment.ride.until = (experiment.run.rows.len() - 1) as f64;
        }
        let readings = lab.readings(&experiment, sensors);
        let answers = observe(&lab.model, sensors, &readings);
        let slides = readings.iter().position(|m| m.way_mm > if test_motion { 0.6 } else { 0.01 }).unwrap_or(0);
        for (errors, margin) in all.iter_mut().zip(MARGINS) {
            if let Some(i) = (slides..readings.len()).find(|&i| readings[i].truth.margin < margin) {
                errors.add(experiment.run.strength, readings[i].truth.margin, &answers[i]);
            }
        }
    }
    all
}

/// What announces slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alarm {
    /// Lower bound of the margin at 0.
    Observer,
    /// Chance of slip in the time ahead above a half.
    Chance,
    /// The rate of friction falls below a share of its largest.
    Rate(f64),
    /// Friction over normal force.
    Ratio(f64),
    /// Vibration of friction over its noise.
    Vibration(f64),
}

impl Alarm {
    /// The reading at which slip is announced.
    pub fn at(self, readings: &[Measured], answers: &[Margin], sensors: &Sensors) -> Option<usize> {
        let (mut run, mut smooth, mut slow, mut most, mut shaking) = (0, 0.0, 0.0, 0.0f64, 0.0);
        for (i, m) in readings.iter().enumerate() {
            let r = &m.reading;
            let [x, y] = r.friction_n.map(f64::from);
            let friction = x.hypot(y);
            smooth += DT_S / (0.01 + DT_S) * (friction - smooth);
            let high = friction - smooth;
            slow += DT_S / (0.05 + DT_S) * (smooth - slow);
            let rate = (smooth - slow) / 0.05;
            shaking += DT_S / (0.02 + DT_S) * (high * high - shaking);
            let loaded = friction > 5.0 * sensors.force_n + 0.02 && i > 400;
            if loaded {
                most = most.max(rate);
            }
            let alarm = match self {
                Self::Observer => {
                    answers[i].known != fingerpad::margin::Known::NoContact && answers[i].margin_low <= 0.0
                }
                Self::Chance => answers[i].slip_chance > 0.5,
                Self::Rate(share) => loaded && rate < share * most,
                Self::Ratio(ratio) => loaded && friction > ratio * f64::from(r.normal_force_n),
                Self::Vibration(times) => i > 400 && shaking.sqrt() > times * sensors.force_n,
            };
            run = if alarm { run + 1 } else { 0 };
            if run >= DEBOUNCE {
                return Some(i);
            }
        }
        None
    }
}

impl core::fmt::Display for Alarm {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Observer => write!(f, "lower bound of the margin at 0"),
            Self::Chance => write!(f, "chance of slip in 50 ms above 1/2"),
            Self::Rate(share) => write!(f, "dF/dt below {share} of its largest"),
            Self::Ratio(ratio) => write!(f, "F/N above {ratio}"),
            Self::Vibration(times) => write!(f, "vibration above {times} times the noise"),
        }
    }
}

/// Announcements of slips and in holds.
#[derive(Clone, Debug, Default)]
pub struct Announced {
    /// Rides that end in full slip.
    pub slips: usize,
    /// Those of them that were announced before.
    pub before: usize,
    /// Travel from the announcement to full slip, mm.
    pub lead_mm: Vec<f64>,
    /// Rides that end in a hold.
    pub holds: usize,
    /// Those of them in which a slip was announced.
    pub false_ones: usize,
}

impl Announced {
    /// Median travel from the announcement to full slip, mm; NaN without any.
    pub fn median_lead_mm(&self) -> f64 {
        let mut leads = self.lead_mm.clone();
        leads.sort_by(f64::total_cmp);
        leads.get(leads.len() / 2).copied().unwrap_or(f64::NAN)
    }
    /// Announced slips less false announcements, shares.
    pub fn score(&self) -> f64 {
        self.before as f64 / self.slips as f64 - self.false_ones as f64 / self.holds as f64
    }
}

/// `number` slips and as many holds at a true margin of 0.35 to 0.8, with every alarm.
pub fn announcements(lab: &mut Lab<'_>, sensors: &Sensors, number: usize, alarms: &[Alarm]) -> Vec<Announced> {
    let mut all = vec![Announced::default(); alarms.len()];
    for k in 0..2 * number {
        let mut experiment = lab.experiment(k / 2);
        let holds = k % 2 == 1;
        if holds {
            experiment.ride.until = experiment.run.place_of(0.35 + 0.45 * lab.share());
            experiment.ride.hold_s = 1.0;
        }
        let readings = lab.readings(&experiment, sensors);
        let answers = observe(&lab.model, sensors, &readings);
        let slip = readings.iter().position(|m| m.way_mm > 0.01 && m.truth.stick < SLIPS);
        for (alarm, announced) in alarms.iter().zip(&mut all) {
            let at = alarm.at(&readings, &answers, sensors);
            if holds {
                announced.holds += 1;
                announced.false_ones += usize::from(at.is_some());
            } else if let Some(slip) = slip {
                announced.slips += 1;
                if let Some(at) = at.filter(|at| *at <= slip) {
                    announced.before += 1;
                    announced.lead_mm.push(readings[slip].way_mm - readings[at].way_mm);
                }
            }
        }
    }
    all
}

/// The thresholds that score best on other runs.
pub fn tuned_thresholds(lab: &mut Lab<'_>, sensors: &Sensors, number: usize) -> [Alarm; 3] {
    let grid = |of: fn(f64) -> Alarm, values: &[f64]| values.iter().map(|&v| of(v)).collect::<Vec<_>>();
    let rates = grid(Alarm::Rate, &[-0.2, -0.1, 0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5]);
    let ratios = grid(Alarm::Ratio, &[0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.6]);
    let shakes = grid(Alarm::Vibration, &[1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 5.0]);
    let all: Vec<Alarm> = [rates, ratios, shakes].concat();
    let scores = announcements(lab, sensors, number, &all);
    let best = |kind: fn(&Alarm) -> bool| {
        let of_kind = all.iter().zip(&scores).filter(|(alarm, _)| kind(alarm));
        *of_kind.max_by(|a, b| a.1.score().total_cmp(&b.1.score())).expect("a grid").0
    };
    [
        best(|a| matches!(a, Alarm::Rate(_))),
        best(|a| matches!(a, Alarm::Ratio(_))),
        best(|a| matches!(a, Alarm::Vibration(_))),
    ]
}
