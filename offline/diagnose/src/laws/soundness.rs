//! What a law of the user's own must be before it is tried: linear in its size, finite over its ranges, of a size that a model
//! can bear, and without free energy.
//!
//! Main function: [`check_law`].

use fingerpad::effects::tables;
use fingerpad_formats::significant;

use super::drivers::is_contact_clock;
use super::formula::{DIGITS, Problem};
use super::own_law::OwnLaw;

/// Values of a driver or a shape at which a law is tried.
const PLACES: usize = 9;
/// Largest number of combinations of them.
const MOST_TRIALS: usize = 20_000;

/// Checks a law; returns how many of its first parameters it is linear in.
///
/// # Errors
/// What is wrong, with the place in the formula.
pub fn check_law(law: &OwnLaw) -> Result<usize, Problem> {
    if law.drivers.is_empty() {
        return Err(whole("it reads no driver: a constant is the model's own, not a law"));
    }
    let trials = Trials::of(law);
    trials.finite()?;
    let linear = trials.linear()?;
    trials.bearable()?;
    trials.passive()?;
    Ok(linear)
}

/// A problem of the formula as a whole.
fn whole(text: &str) -> Problem {
    Problem { character: 1, text: text.to_owned() }
}

/// Evenly spaced values of a range, with 0 among them where the range holds it.
fn places([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let mut out: Vec<f64> = (0..count).map(|k| low + (high - low) * k as f64 / (count.max(2) - 1) as f64).collect();
    if low < 0.0 && high > 0.0 && !out.contains(&0.0) {
        out.push(0.0);
    }
    out
}

/// All combinations of one value from each list.
fn combinations(lists: &[Vec<f64>]) -> Vec<Vec<f64>> {
    lists.iter().fold(vec![Vec::new()], |so_far, list| {
        let with = |head: &Vec<f64>| {
            let head = head.clone();
            list.iter().map(move |v| [head.clone(), vec![*v]].concat())
        };
        so_far.iter().flat_map(with).collect()
    })
}

/// Parameters and drivers at which a law is tried.
struct Trials<'a> {
    law: &'a OwnLaw,
    /// Typical values of the parameters.
    typical: Vec<f64>,
    /// Parameters: typical ones, and the ends of the others' ranges.
    parameters: Vec<Vec<f64>>,
    drivers: Vec<Vec<f64>>,
}

impl<'a> Trials<'a> {
    fn of(law: &'a OwnLaw) -> Self {
        let typical: Vec<f64> = law.parameters.iter().map(|p| p.typical).collect();
        let lists: Vec<Vec<f64>> = law.parameters.iter().map(|p| vec![p.low, p.typical, p.high]).collect();
        let parameters = combinations(&lists);
        let mut count = PLACES;
        let number = |count: usize| parameters.len() * (count + 1).pow(law.drivers.len().min(8) as u32);
        while count > 2 && number(count) > MOST_TRIALS {
            count -= 1;
        }
        let drivers = combinations(&law.drivers.iter().map(|d| places(d.range, count)).collect::<Vec<_>>());
        Self { law, typical, parameters, drivers }
    }

    /// Where a driver stands, in words.
    fn place(&self, drivers: &[f64]) -> String {
        let one = |(d, v): (&super::own_law::LawDriver, &f64)| {
            format!("{} = {} {}", d.name, significant(*v, DIGITS), d.unit).trim_end().to_owned()
        };
        self.law.drivers.iter().zip(drivers).map(one).collect::<Vec<_>>().join(", ")
    }

    /// Refuses a formula that divides by zero or takes the logarithm of nothing anywhere in its ranges.
    fn finite(&self) -> Result<(), Problem> {
        for parameters in &self.parameters {
            for drivers in &self.drivers {
                self.law.checked_value(parameters, drivers).map_err(|problem| {
                    let with: Vec<String> = self
                        .law
                        .parameters
                        .iter()
                        .zip(parameters)
                        .map(|(p, v)| format!("{} = {}", p.name, significant(*v, DIGITS)))
                        .collect();
                    let at = format!("{} with {}", self.place(drivers), with.join(", "));
                    let text = format!(
                        "{} at {at}; keep it finite over the ranges of its parameters and columns, as with max(x, 0.1)",
                        problem.text
                    );
                    Problem { text, ..problem }
                })?;
            }
        }
        Ok(())
    }

    /// The number of first parameters in which the law is linear: it doubles with them and vanishes without.
    fn linear(&self) -> Result<usize, Problem> {
        let scale = self.largest(&self.typical).1.max(1e-12);
        let is_linear = |count: usize| {
            let moved = |factor: [f64; 2]| -> Vec<f64> {
                let of = |(k, v): (usize, &f64)| if k < count { v * factor[k % 2] } else { *v };
                self.typical.iter().enumerate().map(of).collect()
            };
            let [zero, one, two, both] = [[0.0, 0.0], [0.7, 0.0], [0.0, -1.9], [0.7, -1.9]].map(moved);
            let double = moved([1.4, -3.8]);
            self.drivers.iter().all(|d| {
                let [zero, one, two, both, double] = [&zero, &one, &two, &both, &double].map(|p| self.law.value(p, d));
                let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * scale;
                near(zero, 0.0) && near(one + two, both) && near(2.0 * both, double)
            })
        };
        let count = self.typical.len();
        (1..=count).rev().find(|n| is_linear(*n)).ok_or_else(|| {
            let name = &self.law.parameters[0].name;
            let (drivers, _) = self.largest(&self.typical);
            let mut without = self.typical.clone();
            without[0] = 0.0;
            whole(&format!(
                "it must be proportional to its first parameter, its size: with {name} = 0 it is {} at {}, with {name} = {} \
                 it is {}",
                self.law.value(&without, &drivers),
                self.place(&drivers),
                self.typical[0],
                self.law.value(&self.typical, &drivers)
            ))
        })
    }

    /// Drivers at which the law's value is largest, and its size there.
    fn largest(&self, parameters: &[f64]) -> (Vec<f64>, f64) {
        let sizes = self.drivers.iter().map(|d| (d.clone(), self.law.value(parameters, d).abs()));
        sizes.fold((Vec::new(), f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a })
    }

    /// Refuses a law that at its typical size leaves what a model can bear, or does nothing.
    fn bearable(&self) -> Result<(), Problem> {
        let [least, most] = self.law.target.0.range().map(f64::from);
        let (at, size) = self.largest(&self.typical);
        if !(size > 0.0) {
            return Err(whole("it does nothing at its parameters' typical sizes"));
        }
        for drivers in &self.drivers {
            let value = self.law.value(&self.typical, drivers);
            if !(value >= least && value <= most) {
                return Err(whole(&format!(
                    "at its typical size it is {value:.4} at {}; {} allows {least} to {most} ({})",
                    self.place(drivers),
                    self.law.target.name(),
                    if self.law.target.unit() == super::units::Unit::default() {
                        "the factor is 1 + formula".to_owned()
                    } else {
                        self.law.target.unit().to_string()
                    }
                )));
            }
        }
        debug_assert!(!at.is_empty());
        Ok(())
    }

    /// Refuses a law by which a closed path yields work: stiffness or depth that depend on the motion in the plane, or that
    /// grow while the contact is held. Strength cannot: friction only takes.
    ///
    /// A finger pressed at a stiffness s and released at s' gives back s'/s of the work that pressing took.
    fn passive(&self) -> Result<(), Problem> {
        if !matches!(self.law.target.0, tables::Target::Stiffness | tables::Target::Depth) {
            return Ok(());
        }
        let sizes = [self.law.parameters[0].low, self.law.parameters[0].high];
        for sign in [1.0, -1.0].into_iter().filter(|s| sizes.iter().any(|v| v * s * self.typical[0] > 0.0)) {
            let mut parameters = self.typical.clone();
            parameters[0] *= sign;
            for (k, driver) in self.law.drivers.iter().enumerate() {
                let (moves, clock) = (driver.moves, is_contact_clock(driver.number));
                if !(moves || clock) {
                    continue;
                }
                if let Some(problem) = self.gain(&parameters, k, clock && !moves) {
                    return Err(problem);
                }
            }
        }
        Ok(())
    }

    /// The largest rise of the law along one driver, all others kept; where that creates energy, the refusal.
    fn gain(&self, parameters: &[f64], k: usize, rising_only: bool) -> Option<Problem> {
        let driver = &self.law.drivers[k];
        let mut largest: Option<(f64, Vec<f64>, Vec<f64>)> = None;
        for from in &self.drivers {
            let low = self.law.value(parameters, from);
            for place in places(driver.range, 2 * PLACES) {
                let mut to = from.clone();
                to[k] = place;
                let rise = self.law.value(parameters, &to) - low;
                let counts = rise > 1e-9 && (!rising_only || place > from[k]);
                if counts && largest.as_ref().is_none_or(|l| rise > l.0) {
                    largest = Some((rise, from.clone(), to));
                }
            }
        }
        let (rise, from, to) = largest?;
        let (low, high) = (self.law.value(parameters, &from), self.law.value(parameters, &to));
        let name = self.law.target.name();
        let yields = if self.law.target.0 == tables::Target::Stiffness {
            format!("gives back {:.1} % more work than pressing took", 100.0 * ((1.0 + high) / (1.0 + low) - 1.0))
        } else {
            format!("is {rise:.4} mm deeper than it was pressed, whose work is free")
        };
        Some(whole(&format!(
            "it makes the model active (free energy): {name} is {low:.4} at {} and {high:.4} at {}, so that a finger pressed \
             at the first and released at the second {yields}; let {name} depend on depth, state of the skin, or a fall with \
             time in contact, or let the law act on strength",
            self.place(&from),
            self.place(&to)
        )))
    }
}
