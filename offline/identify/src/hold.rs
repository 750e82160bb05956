//! Branches of relaxing tissue from a ramp and hold of a finger, and from sines after it: shares and times with their intervals.
//!
//! The force of tissue with the relaxed force `N0(d)` is `N = N0 + sum_i g_i Q_i`, `Q_i` the part of the changes of `N0` that branch i
//! still remembers [Fung 1993, section 7.6]. With `N0 = c d^p exp(r d)` and for given times it is linear in `c` and in every `c g_i`, which
//! are fitted with the sign that they must have; `p`, `r` and the times are fitted around this [Golub & Pereyra 2003].
//! Main types: [`Hold`], [`Fit`]. May use: formats and least-squares.

use std::ops::Range;
use std::path::Path;

use fingerpad_formats::{Columns, Error};
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};
use nalgebra::{DMatrix, DVector};

use super::confidence;

/// Columns of a file.
pub const KNOWN: [&str; 3] = ["t_s", "depth_mm", "normal_force_n"];
/// Share of the largest depth within which the finger is held.
const HELD_SHARE: f64 = 5e-3;
/// Depth, over that of the hold, below which the finger leaves: later rows do not count.
const LEAVES: f64 = 0.5;
/// Rows that ramp and hold have at least.
const LEAST_ROWS: usize = 8;
/// Durations of the ramp that the hold lasts at least.
const LEAST_HOLD: f64 = 3.0;
/// Normal quantile of an interval of 95 %.
const QUANTILE: f64 = 1.96;
/// Half-width of an interval, over the value, above which the value is poorly determined.
const POOR: f64 = 0.1;

/// A ramp and hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// Times (s), depths (mm) and forces (N), from the last row in the air or the first row on.
    rows: Vec<[f64; 3]>,
    /// The rows of the hold; those after it are of sines or other motions.
    held: Range<usize>,
}

/// A value with the half-width of its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Half-width.
    pub half_width: f64,
}

impl Estimate {
    /// Whether the interval is wider than 10 % of the value to each side.
    pub fn is_poor(&self) -> bool {
        !(self.half_width <= POOR * self.value)
    }
}

/// A fitted branch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedBranch {
    /// Share of the relaxed stiffness.
    pub share: Estimate,
    /// Time, s.
    pub time_s: Estimate,
}

/// The branches of a ramp and hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Branches by rising time; fewer than requested if others have no share.
    pub branches: Vec<FittedBranch>,
    /// Exponent of the depth in the relaxed force.
    pub exponent: f64,
    /// Rate of the exponential in the relaxed force, 1/mm.
    pub rate_per_mm: f64,
    /// Relaxed force at the end, N.
    pub relaxed_force_n: f64,
    /// Root mean square of the residuals, N.
    pub rms_n: f64,
    /// Number of rows.
    pub rows: usize,
    /// Duration of the hold, s.
    pub hold_s: f64,
}

impl Hold {
    /// Reads a file with the columns of [`KNOWN`].
    ///
    /// # Errors
    /// [`Error`] with line and value: a file without a ramp, without a hold, or with too short a hold, and a force that rises while the
    /// finger is held.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::of(&Columns::read(path, &KNOWN)?)
    }

    fn of(table: &Columns) -> Result<Self, Error> {
        let columns = [table.need(KNOWN[0])?, table.need(KNOWN[1])?, table.need(KNOWN[2])?];
        table.need_rows(2 * LEAST_ROWS)?;
        let mut rows: Vec<[f64; 3]> = Vec::new();
        for row in &table.rows {
            let mut read = [0.0; 3];
            for (read, column) in read.iter_mut().zip(columns) {
                *read = table.number(row, column)?;
            }
            if let Some(before) = rows.last().filter(|before| read[0] <= before[0]) {
                return Err(table.refuse(row, columns[0], format!("does not follow {}: times must grow", before[0])));
            }
            rows.push(read);
        }
        let deepest = deepest(&rows);
        let held = longest_hold(&rows, HELD_SHARE * deepest);
        let (held_from, last) = (held.start, held.end.max(1) - 1);
        if !(deepest > 0.0) {
            return Err(table.refuse(
                &table.rows[last],
                columns[1],
                "no depth of the file is greater than 0: there is no ramp",
            ));
        }
        let start = rows[..held_from].iter().rposition(|row| row[1] <= 0.0).unwrap_or(0);
        let problem =
            |at: usize, column: usize, text: String| Err(table.refuse(&table.rows[at], columns[column], text));
        let hold_s = rows[last][0] - rows[held_from][0];
        let deepest = self::deepest(&rows[..=last]);
        if rows[last][1] < (1.0 - HELD_SHARE) * deepest {
            return problem(
                last,
                1,
                format!("is the end, below the largest depth of {deepest}: there is no hold after the ramp"),
            );
        }
        if held_from <= start + 2 {
            return problem(
                start,
                1,
                format!("is followed by {} row(s) of a ramp; at least 3 needed", held_from - start),
            );
        }
        if rows[start][1] > HELD_SHARE * deepest {
            return problem(
                start,
                1,
                "is where the file begins: it must begin before the finger touches, at 0 mm or less".into(),
            );
        }
        if let Some(back) = (start + 1..=held_from).find(|&k| rows[k][1] < rows[k - 1][1] - HELD_SHARE * deepest) {
            return problem(back, 1, format!("is less than {} before it: a ramp rises", rows[back - 1][1]));
        }
        if last - held_from < LEAST_ROWS {
            return problem(
                last,
                1,
                format!("ends a hold of {} row(s); at least {LEAST_ROWS} needed", last + 1 - held_from),
            );
        }
        let ramp_s = rows[held_from][0] - rows[start][0];
        if hold_s < LEAST_HOLD * ramp_s {
            return problem(
                last,
                0,
                format!(
                    "ends a hold of {hold_s:.4} s, too short after a ramp of {ramp_s:.4} s: at least {LEAST_HOLD} times that"
                ),
            );
        }
        // Means of the first and the last quarter of the hold, against noise.
        let quarter = (last + 1 - held_from) / 4;
        let mean = |from: usize| rows[from..from + quarter].iter().map(|row| row[2]).sum::<f64>() / quarter as f64;
        let (first, end) = (mean(held_from), mean(last + 1 - quarter));
        if end > first {
            return problem(
                last,
                2,
                format!("ends a hold in which the force rises from {first:.4} to {end:.4} N: a share would be below 0"),
            );
        }
        if !(end > 0.0) {
            return problem(last, 2, format!("ends a hold at a mean force of {end:.4} N: it must press"));
        }
        let leaves = (last..rows.len()).find(|&k| rows[k][1] < LEAVES * rows[last][1]);
        rows.truncate(leaves.unwrap_or(rows.len()));
        rows.drain(..start);
        Ok(Self { rows, held: held_from - start..last + 1 - start })
    }

    /// The branches that fit best.
    ///
    /// * `count`: most branches, 1 to 3
    pub fn fit(&self, count: usize) -> Fit {
        let ramp_s = self.rows[self.held.start][0] - self.rows[0][0];
        let interval_s = self.rows[1..].iter().zip(&self.rows).map(|(b, a)| b[0] - a[0]).fold(f64::INFINITY, f64::min);
        let hold_s = self.hold_s();
        let minimiser = LevenbergMarquardt::new().with_patience(200).with_ftol(1e-12).with_xtol(1e-10);
        let mut best: Option<(f64, Vec<f64>)> = None;
        for shortest_s in [0.3 * ramp_s, ramp_s, 3.0 * ramp_s] {
            let (low, high) = (shortest_s.max(2.0 * interval_s).ln(), (0.2 * hold_s).ln());
            let spread = |k: usize| if count == 1 { 0.5 } else { k as f64 / (count - 1) as f64 };
            let mut start = vec![1.5, 0.1];
            start.extend((0..count).map(|k| low + spread(k) * (high - low)));
            let (at, report) = minimise(&mut Search { hold: self }, &start, &minimiser);
            if best.as_ref().is_none_or(|(least, _)| report.objective_function < *least) {
                best = Some((report.objective_function, at));
            }
        }
        let (_, at) = best.expect("three starts");
        self.report(&at)
    }

    fn hold_s(&self) -> f64 {
        self.rows[self.held.end - 1][0] - self.rows[self.held.start][0]
    }

    /// Relaxed force of unit factor, and what each branch still remembers of it, at every row.
    fn columns(&self, at: &[f64]) -> Vec<Vec<f64>> {
        let (exponent, rate) = (at[0], at[1]);
        let deepest = self.rows[self.held.end - 1][1];
        // Relative to the depth of the hold, so that factor and exponent are hardly correlated.
        let relaxed: Vec<f64> = self
            .rows
            .iter()
            .map(|[_, d, _]| (d.max(0.0) / deepest).powf(exponent) * (rate * (d - deepest)).exp())
            .collect();
        let mut columns = vec![relaxed.clone()];
        for time in &at[2..] {
            let time_s = time.exp();
            let mut memory = 0.0;
            let mut column = vec![0.0];
            for (rows, n) in self.rows.windows(2).zip(relaxed.windows(2)) {
                let parts = (rows[1][0] - rows[0][0]) / time_s;
                // Exact where the relaxed force is linear in time between the rows.
                memory = memory * (-parts).exp() - (n[1] - n[0]) * (-parts).exp_m1() / parts;
                column.push(memory);
            }
            columns.push(column);
        }
        columns
    }

    /// Factors of the columns, none below zero, and the residuals of the rows, N.
    fn factors(&self, columns: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
        let forces: Vec<f64> = self.rows.iter().map(|row| row[2]).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let count = columns.len();
        let mut best = (f64::INFINITY, vec![0.0; count]);
        // All sets of branches beside the relaxed force: the best set without a factor below zero is the minimum.
        for set in 0..1u32 << (count - 1) {
            let used: Vec<usize> = (0..count).filter(|&k| k == 0 || set & (1 << (k - 1)) != 0).collect();
            let normal = DMatrix::from_fn(used.len(), used.len(), |i, k| dot(&columns[used[i]], &columns[used[k]]));
            let right = DVector::from_iterator(used.len(), used.iter().map(|&k| dot(&columns[k], &forces)));
            let Some(factor) = normal.cholesky() else { continue };
            let solved = factor.solve(&right);
            let sum = dot(&forces, &forces) - solved.dot(&right);
            if solved.iter().all(|f| *f >= 0.0) && sum < best.0 {
                let mut factors = vec![0.0; count];
                used.iter().zip(solved.iter()).for_each(|(&k, f)| factors[k] = *f);
                best = (sum, factors);
            }
        }
        let residual = |k: usize| columns.iter().zip(&best.1).map(|(c, f)| c[k] * f).sum::<f64>() - forces[k];
        let residuals = (0..forces.len()).map(residual).collect();
        (best.1, residuals)
    }

    fn report(&self, at: &[f64]) -> Fit {
        let columns = self.columns(at);
        let (factors, residuals) = self.factors(&columns);
        let used: Vec<usize> = (1..factors.len()).filter(|&k| factors[k] > 0.0).collect();
        let c = factors[0];
        // Derivatives over c, the shares, exponent, rate and the logarithms of the times.
        let mut jacobian: Vec<Vec<f64>> = vec![
            (0..self.rows.len())
                .map(|row| (0..factors.len()).map(|k| columns[k][row] * factors[k]).sum::<f64>() / c)
                .collect(),
        ];
        jacobian.extend(used.iter().map(|&k| columns[k].iter().map(|q| q * c).collect()));
        for k in [0, 1].into_iter().chain(used.iter().map(|k| k + 1)) {
            let side = |sign: f64| {
                let mut moved = at.to_vec();
                moved[k] += sign * STEP;
                self.columns(&moved)
            };
            let (up, down) = (side(1.0), side(-1.0));
            let slope = |row: usize| {
                (0..factors.len()).map(|k| factors[k] * (up[k][row] - down[k][row])).sum::<f64>() / (2.0 * STEP)
            };
            jacobian.push((0..self.rows.len()).map(slope).collect());
        }
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let freedom = self.rows.len().saturating_sub(jacobian.len()).max(1) as f64;
        let errors = confidence::linear(&jacobian, squares / freedom).standard_errors;
        let mut branches: Vec<FittedBranch> = used
            .iter()
            .enumerate()
            .map(|(place, &k)| {
                let time_s = at[k + 1].exp();
                FittedBranch {
                    share: Estimate { value: factors[k] / c, half_width: QUANTILE * errors[1 + place] },
                    time_s: Estimate { value: time_s, half_width: QUANTILE * time_s * errors[3 + used.len() + place] },
                }
            })
            .collect();
        branches.sort_by(|a, b| a.time_s.value.total_cmp(&b.time_s.value));
        Fit {
            branches,
            exponent: at[0],
            rate_per_mm: at[1],
            relaxed_force_n: c,
            rms_n: (squares / self.rows.len() as f64).sqrt(),
            rows: self.rows.len(),
            hold_s: self.hold_s(),
        }
    }
}

fn deepest(rows: &[[f64; 3]]) -> f64 {
    rows.iter().map(|row| row[1]).fold(f64::NEG_INFINITY, f64::max)
}

/// The longest time in which the finger stays at one depth.
fn longest_hold(rows: &[[f64; 3]], tolerance_mm: f64) -> Range<usize> {
    let (mut longest, mut from) = (0..0, 0);
    let duration_s = |range: &Range<usize>| rows[range.end - 1][0] - rows[range.start][0];
    while from < rows.len() {
        let leaves = |row: &[f64; 3]| (row[1] - rows[from][1]).abs() > tolerance_mm;
        let to = rows[from..].iter().position(leaves).map_or(rows.len(), |count| from + count);
        let this = from..to;
        if rows[from][1] > 0.0 && (longest.is_empty() || duration_s(&this) >= duration_s(&longest)) {
            longest = this;
        }
        from = to;
    }
    longest
}

/// Step of the finite differences.
const STEP: f64 = 1e-5;

/// The search for exponent, rate and logarithms of the times.
struct Search<'a> {
    hold: &'a Hold,
}

impl Problem for Search<'_> {
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        let in_range = (0.2..6.0).contains(&at[0]) && at[1].abs() < 20.0 && at[2..].iter().all(|t| t.abs() < 14.0);
        in_range.then(|| self.hold.factors(&self.hold.columns(at)).1)
    }

    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        let column = |k: usize| {
            let mut side = |sign: f64| {
                let mut moved = at.to_vec();
                moved[k] += sign * STEP;
                self.residuals(&moved)
            };
            let (up, down) = (side(1.0)?, side(-1.0)?);
            Some(up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * STEP)).collect())
        };
        (0..at.len()).map(column).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// End of the hold, s.
    const HELD_S: f64 = 20.0;

    /// A ramp to 1 mm in `ramp_s` and a hold, every millisecond and later every hundredth of the time, then two seconds of a vibration of 50
    /// um and `sine_hz`, every millisecond, with noise.
    fn synthetic(noise_n: f64, ramp_s: f64, sine_hz: f64) -> String {
        let (c, p, r) = (0.6, 1.6, 0.25);
        let branches = [(1.0, 4e-3), (0.6, 70e-3), (0.6, 1.4)];
        let relaxed = |d: f64| c * d.max(0.0).powf(p) * (r * d).exp();
        let wave = |t: f64| 0.05 * (std::f64::consts::TAU * sine_hz * (t - HELD_S).max(0.0)).sin();
        let depth = |t: f64| (t / ramp_s).clamp(0.0, 1.0) + wave(t);
        let mut memory = [0.0; 3];
        let mut text = String::from("t_s,depth_mm,normal_force_n\n");
        let (fine, mut state, mut next) = (1e-4, 0x1234_5678_9abc_def0u64, 0.0);
        let mut uniform = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for k in 0..=220_000u32 {
            if sine_hz == 0.0 && k > 200_000 {
                break;
            }
            let t = f64::from(k) * fine;
            let (a, b) = (relaxed(depth(t - fine)), relaxed(depth(t)));
            for (memory, (_, tau)) in memory.iter_mut().zip(branches) {
                let x: f64 = fine / tau;
                *memory = *memory * (-x).exp() - (b - a) * (-x).exp_m1() / x;
            }
            if t >= next {
                next = t + if t < HELD_S { (1e-3f64).max(2e-3 * t) } else { 1e-3 } - 0.5 * fine;
                let noise: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let force = b + memory.iter().zip(branches).map(|(q, (g, _))| g * q).sum::<f64>() + noise_n * noise;
                text += &format!("{t:.5},{:.6},{force:.6}\n", depth(t));
            }
        }
        text
    }

    fn read(text: &str) -> Result<Hold, Error> {
        Hold::of(&Columns::parse(Path::new("hold.csv"), text, &KNOWN)?)
    }

    #[test]
    fn shares_and_times_come_back_and_a_branch_shorter_than_the_ramp_is_poorly_determined() {
        let exact = read(&synthetic(0.0, 0.01, 0.0)).unwrap().fit(3);
        for (branch, (share, time)) in exact.branches.iter().zip([(1.0, 4e-3), (0.6, 70e-3), (0.6, 1.4)]) {
            println!("{branch:?}");
            assert!((branch.share.value / share - 1.0).abs() < 0.01 && (branch.time_s.value / time - 1.0).abs() < 0.01);
        }
        let noisy = read(&synthetic(5e-3, 0.05, 0.0)).unwrap().fit(3);
        println!("{noisy:#?}");
        assert!((noisy.rms_n / 5e-3 - 1.0).abs() < 0.1);
        let [short, middle, long] = noisy.branches[..] else { panic!("three branches") };
        assert!(short.share.is_poor() || short.time_s.is_poor(), "{short:?}");
        for (branch, time) in [(middle, 70e-3), (long, 1.4)] {
            assert!((branch.share.value / 0.6 - 1.0).abs() < 0.03, "{branch:?}");
            assert!((branch.time_s.value / time - 1.0).abs() < 0.05, "{branch:?}");
            assert!(!branch.share.is_poor() && !branch.time_s.is_poor());
        }
    }

    /// The vibration meets the branch that the ramp of 50 ms hides.
    #[test]
    fn a_vibration_after_the_hold_determines_the_short_branch() {
        let fit = read(&synthetic(5e-3, 0.05, 40.0)).unwrap().fit(3);
        println!("{fit:#?}");
        for (branch, (share, time)) in fit.branches.iter().zip([(1.0, 4e-3), (0.6, 70e-3), (0.6, 1.4)]) {
            assert!((branch.share.value / share - 1.0).abs() < 0.03, "{branch:?}");
            assert!((branch.time_s.value / time - 1.0).abs() < 0.05, "{branch:?}");
        }
        assert!(fit.branches.len() == 3 && (fit.hold_s - (HELD_S - 0.05)).abs() < 0.1, "{}", fit.hold_s);
    }

    #[test]
    fn what_is_no_ramp_and_hold_is_refused_with_line_and_value() {
        let rows = |f: &dyn Fn(f64) -> (f64, f64)| {
            let row = |k: u32| {
                let t = f64::from(k) * 0.05;
                let (d, n) = f(t);
                format!("{t},{d},{n}\n")
            };
            String::from("t_s,depth_mm,normal_force_n\n") + &(0..60).map(row).collect::<String>()
        };
        let cases: [(&str, String); 6] = [
            ("hold.csv:2: column `depth_mm`: `1`", rows(&|_| (1.0, 1.0))),
            ("no depth of the file is greater than 0", rows(&|_| (0.0, 0.0))),
            ("ends a hold of 1 row(s)", rows(&|t| (0.3 * t, 0.3 * t))),
            ("there is no hold after the ramp", rows(&|t| (if t < 1.0 { t } else { 0.5 }, 1.0))),
            ("too short after a ramp of", rows(&|t| (t.min(2.0), t.min(2.0) - 0.01 * t))),
            ("a share would be below 0", rows(&|t| ((2.0 * t).min(1.0), t))),
        ];
        for (expected, text) in cases {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}\nexpected: {expected}");
        }
    }
}
