//! How laboratories move the plate and what their loggers do to the rows.
//!
//! Main types: [`Protocol`], [`Logger`].

use std::f64::consts::{FRAC_PI_2, TAU};

use fingerpad_diagnose::{RawRow, RunSet};

use super::Random;
use super::laboratory::Noise;
use super::protocol::Plan;

/// A way to run the experiments.
#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum, serde::Serialize, serde::Deserialize)]
pub enum Protocol {
    /// Directions over the whole plane, a logger without faults.
    Plane,
    /// All slides along ±x and ±y.
    FourDirections,
    /// All slides along +x, as in Yoshida et al. 2011.
    OneAxis,
    /// The calibration along +x, the measured runs over the whole plane.
    AxisThenPlane,
    /// A logger with a coarse clock, spikes, dropped rows and two rates.
    Operator,
    /// A normal force that ends at the sensor's rail in the measured runs.
    Clipped,
    /// 20 rows a second; turns lie between rows.
    Uniform20,
    /// 100 rows a second.
    Uniform100,
    /// 1000 rows a second.
    Uniform1000,
    /// 100 rows a second, forces 0 to 20 ms late, another lag for each set of files.
    Lag,
    /// 100 rows a second, forces through a first-order filter of 5 to 50 Hz, another one for each set of files.
    Filter,
    /// 100 rows a second, forces of the measured and held-out runs 5 to 20 ms late, those of the calibration not.
    LagDiffers,
    /// In 5 % of the runs of each file the scatter is five times as large.
    OutlierRuns,
    /// Forces in steps of 12 bit over 20 N.
    Quantised,
    /// The finger's depth trembles by 5 um (root mean square, 8 to 12 Hz), and the file does not have it.
    Tremor,
    /// 50 rows a second from touch to lift-off; 1 % of cross-talk, offsets that walk, a filter of 30 Hz, forces 4 ms late, a play of 12 um,
    /// steps of 16 bit over 20 N.
    Instrument,
}

/// Step of a force that 12 bit have over 20 N, N.
const STEP_N: f64 = 20.0 / 4096.0;

/// A logger of a constant rate.
#[derive(Clone, Copy, Debug)]
pub struct Rate {
    /// Rows a second.
    pub rate_hz: f64,
    /// By which forces are late, s.
    pub lag_s: f64,
    /// Time constant of the forces' first-order filter, s.
    pub filter_s: f64,
    /// Whether a run goes on until the finger has lifted off.
    pub lifts: bool,
}

impl Rate {
    /// Mean time by which the forces come late, s.
    pub fn total_lag_s(&self) -> f64 {
        self.lag_s + self.filter_s
    }

    /// What comes out of the logger's channels of force, at rows at these times.
    pub fn through(&self, times_s: &[f64], readings: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        let late = |k: usize| {
            let at = times_s[k] - self.lag_s;
            let i = times_s.partition_point(|t| *t <= at).clamp(1, times_s.len() - 1);
            let share = ((at - times_s[i - 1]) / (times_s[i] - times_s[i - 1])).clamp(0.0, 1.0);
            [0, 1, 2].map(|c| readings[i - 1][c] + share * (readings[i][c] - readings[i - 1][c]))
        };
        let late: Vec<[f64; 3]> = (0..readings.len()).map(late).collect();
        if self.filter_s == 0.0 {
            return late;
        }
        // Small Euler steps between the rows, so that nothing is taken from the filter that the diagnosis has.
        let mut filtered = late[0];
        let mut out = vec![filtered];
        for k in 1..late.len() {
            let step_s = times_s[k] - times_s[k - 1];
            let parts = (step_s / (0.01 * self.filter_s)).ceil().max(1.0);
            for part in 0..parts as usize {
                let share = (part as f64 + 0.5) / parts;
                for c in 0..3 {
                    let input = late[k - 1][c] + share * (late[k][c] - late[k - 1][c]);
                    filtered[c] += step_s / parts / self.filter_s * (input - filtered[c]);
                }
            }
            out.push(filtered);
        }
        out
    }
}

impl Protocol {
    /// Turns the strokes into the protocol's directions.
    pub fn turn(self, plans: &mut [Plan], calibration: bool) {
        if self == Self::OneAxis || (self == Self::AxisThenPlane && calibration) {
            plans.iter_mut().for_each(|p| p.direction = 0.0);
        }
        if self == Self::FourDirections {
            plans.iter_mut().for_each(|p| p.direction = (p.direction / FRAC_PI_2).round() * FRAC_PI_2);
        }
    }

    /// The noise of a laboratory under this protocol.
    pub fn noise(self, noise: Noise) -> Noise {
        match self {
            Self::OutlierRuns => Noise { outlier_runs: 0.05, ..noise },
            Self::Tremor => Noise { tremor_mm: 5e-3, ..noise },
            Self::Instrument => Noise { backlash_mm: 12e-3, cross_talk: 0.01, walk_n: 5e-4, ..noise },
            _ => noise,
        }
    }

    /// The logger's constant rate, of a protocol that has one.
    ///
    /// * `seed`: that of the set, from which its lag is drawn
    pub fn rate(self, seed: u64, calibration: bool) -> Option<Rate> {
        let mut random = Random::new(seed ^ 0x0001_A600);
        let rate = |rate_hz, lag_s, filter_s| Some(Rate { rate_hz, lag_s, filter_s, lifts: self == Self::Instrument });
        match self {
            Self::Uniform20 => rate(20.0, 0.0, 0.0),
            Self::Uniform100 => rate(100.0, 0.0, 0.0),
            Self::Uniform1000 => rate(1000.0, 0.0, 0.0),
            Self::Lag => rate(100.0, random.between(0.0, 20e-3), 0.0),
            Self::Filter => rate(100.0, 0.0, 1.0 / (TAU * 5.0 * 10f64.powf(random.unit()))),
            Self::LagDiffers if calibration => rate(100.0, 0.0, 0.0),
            Self::LagDiffers => rate(100.0, random.between(5e-3, 20e-3), 0.0),
            Self::Instrument => rate(50.0, 4e-3, 1.0 / (TAU * 30.0)),
            _ => None,
        }
    }

    /// The set as the protocol's logger writes it.
    pub fn log(self, set: RunSet, calibration: bool, random: &mut Random) -> Logged {
        match self {
            Self::Operator => Logger::OPERATOR.logged(&set, random),
            Self::Clipped if !calibration => {
                let mut peaks: Vec<f64> =
                    set.runs.iter().map(|r| r.force_n.iter().map(|f| f[0]).fold(0.0, f64::max)).collect();
                peaks.sort_by(f64::total_cmp);
                // A rail that the deepest third of the runs reaches.
                Logger { rail_n: peaks[peaks.len() * 2 / 3], ..Logger::FAULTLESS }.logged(&set, random)
            }
            Self::Quantised | Self::Instrument => {
                let step_n = if self == Self::Instrument { STEP_N / 16.0 } else { STEP_N };
                let mut set = set;
                let forces_n = set.runs.iter_mut().flat_map(|run| &mut run.force_n).flatten();
                forces_n.for_each(|force_n| *force_n = (*force_n / step_n).round() * step_n);
                Logged { read: all_read(&set), set }
            }
            _ => Logged { read: all_read(&set), set },
        }
    }
}

/// What a logger wrote.
pub struct Logged {
    /// The set.
    pub set: RunSet,
    /// Which readings (normal, x, y) of each row of each stroke it holds; spikes and the sensor's rail are none.
    pub read: Vec<Vec<[bool; 3]>>,
}

fn all_read(set: &RunSet) -> Vec<Vec<[bool; 3]>> {
    set.runs.iter().map(|run| vec![[true; 3]; run.rows.len()]).collect()
}

/// Faults of a logger.
#[derive(Clone, Copy, Debug)]
pub struct Logger {
    /// Step of its clock, s; 0 is exact.
    pub clock_s: f64,
    /// Share of the readings that are spikes of 0.1 to 1 N either way.
    pub spikes: f64,
    /// Share of the rows that are lost.
    pub lost: f64,
    /// Share of the runs that are written at half the rate.
    pub half_rate: f64,
    /// Largest normal force that the sensor can read, N.
    pub rail_n: f64,
}

impl Logger {
    /// No faults.
    pub const FAULTLESS: Self = Self { clock_s: 0.0, spikes: 0.0, lost: 0.0, half_rate: 0.0, rail_n: f64::INFINITY };
    /// The faults of an operator's logger.
    pub const OPERATOR: Self = Self { clock_s: 0.1, spikes: 0.02, lost: 0.15, half_rate: 0.33, rail_n: f64::INFINITY };

    /// A set as this logger writes it; the time since touch is not among its columns where the clock is coarse.
    pub fn log(&self, set: &RunSet, random: &mut Random) -> RunSet {
        self.logged(set, random).set
    }

    /// The same with what it read of every row.
    pub fn logged(&self, set: &RunSet, random: &mut Random) -> Logged {
        let mut read = all_read(set);
        let runs = set.runs.iter().zip(&mut read).map(|(run, read)| {
            let stride = if random.unit() < self.half_rate { 2 } else { 1 };
            let rows = (0..run.rows.len()).filter_map(|i| {
                let (row, mut force_n) = (&run.rows[i], run.force_n[i]);
                for (f, read) in force_n.iter_mut().zip(&mut read[i]) {
                    if random.unit() < self.spikes {
                        *read = false;
                        *f += random.between(0.1, 1.0) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                    }
                }
                read[i][0] &= force_n[0] < self.rail_n;
                force_n[0] = force_n[0].min(self.rail_n);
                let kept = random.unit() >= self.lost && i % stride == 0;
                if !kept {
                    read[i] = [false; 3];
                }
                let exact = self.clock_s == 0.0;
                kept.then_some(RawRow {
                    line: 2 + i,
                    t_s: if exact { row.t_s } else { (row.t_s / self.clock_s).floor() * self.clock_s },
                    depth_mm: row.depth_mm,
                    slide_mm: run.slide_mm[i],
                    force_n,
                    contact_time_s: if exact { row.contact_time_s } else { f64::NAN },
                    speed_mm_s: f64::NAN,
                    direction_deg: f64::NAN,
                    dwell_s: row.dwell_s,
                    occlusion_time_s: row.occlusion_s,
                    hydration_au: row.hydration_au,
                    temperature_c: row.temperature_c,
                    finger_width_mm: row.width_mm,
                    own: row.own,
                })
            });
            (run.labels.clone(), rows.collect())
        });
        let runs = runs.collect();
        Logged { set: RunSet::from_rows(set.path.clone(), runs).expect("a logger's clock never falls"), read }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic_truth::sets::{Hide, case_of};

    #[test]
    fn a_quantised_logger_writes_steps_of_12_bit_over_20_n() {
        let made = case_of(Protocol::Quantised, 5, Hide::Nothing, 0.0, 0, 5, true);
        let plain = case_of(Protocol::Plane, 5, Hide::Nothing, 0.0, 0, 5, true);
        for (set, plain) in [(&made.calibration, &plain.calibration), (&made.measured, &plain.measured)] {
            let forces =
                |set: &RunSet| -> Vec<f64> { set.runs.iter().flat_map(|r| &r.force_n).flatten().copied().collect() };
            for (step, force_n) in forces(set).into_iter().zip(forces(plain)) {
                let steps = step / (20.0 / 4096.0);
                assert!((steps - steps.round()).abs() < 1e-9 && (step - force_n).abs() <= 0.5 * STEP_N + 1e-12);
            }
        }
    }
}
