//! Adaptive load stepping along a line: longer steps after quick convergence, cut steps without equilibrium, and a
//! passage of a limit point if cutting does not help.

use crate::solve::SolveError;

/// Rule of the step sizes, which are in the unit of the line's length.
#[derive(Clone, Copy, Debug)]
pub struct StepRule {
    /// A step that took no more equilibrium iterations than this is followed by a longer one.
    pub easy_iterations: u32,
    /// Factor on the size of a step that took more than `FAIR_ITERATIONS`, for the next one.
    pub after_hard: f64,
    /// Factor on the size of a step that failed.
    pub cut: f64,
    /// A step size below which cutting is interpreted as a limit point.
    pub limit_point_below: f64,
    /// Size after a limit point.
    pub after_limit_point: f64,
}

/// Equilibrium iterations up to which a step keeps its size.
const FAIR_ITERATIONS: u32 = 14;
/// Factor on the size of an easy step, for the next one.
const AFTER_EASY: f64 = 1.5;

/// A system that is loaded along a line.
pub trait LoadSteps {
    /// Why it may end.
    type Error;

    /// Seeks equilibrium at `share` (0 to 1) of the line, `size` from the present state, and takes it.
    ///
    /// Returns the equilibrium iterations.
    ///
    /// # Errors
    /// [`SolveError`]; the state is then unchanged.
    fn try_step(&mut self, share: f64, size: f64) -> Result<u32, SolveError>;

    /// Largest size of the next step.
    fn largest_size(&self) -> f64 {
        1.0
    }

    /// Called after a failed step; an error ends the run at once.
    ///
    /// # Errors
    /// Of the system.
    fn failed(&mut self, share: f64, error: &SolveError) -> Result<(), Self::Error>;

    /// Whether smaller steps would not help.
    fn exceeds_iteration_budget(&self) -> bool;

    /// Steps past a limit point to `share`; false, and nothing changed, if it cannot.
    ///
    /// # Errors
    /// Of the system.
    fn pass_limit_point(&mut self, share: f64) -> Result<bool, Self::Error>;

    /// Decides whether to end the run after a failed step.
    ///
    /// # Errors
    /// Of the system, to end the run.
    fn give_up(&mut self, step: FailedStep) -> Result<(), Self::Error>;

    /// Called after a step that was taken: `standing` is the new state of the line.
    ///
    /// # Errors
    /// Of the system, to end the run.
    fn accepted(&mut self, standing: Standing) -> Result<(), Self::Error>;
}

/// A step that found no equilibrium.
#[derive(Clone, Copy, Debug)]
pub struct FailedStep {
    /// Share of the line that it led to, 0 to 1.
    pub share: f64,
    /// Its size.
    pub size: f64,
    /// Size of the next attempt.
    pub next_size: f64,
    /// Whether cutting has met a limit point, which was not passed.
    pub at_limit_point: bool,
    /// Why it failed.
    pub error: SolveError,
}

/// State of the stepping on its line.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Standing {
    /// Length done.
    pub done: f64,
    /// Size of the next step.
    pub size: f64,
}

/// Loads `system` along a line of `length` from `standing` to its end; returns the size for a next line.
///
/// # Errors
/// Of the system.
pub fn load_along<S: LoadSteps>(
    system: &mut S,
    rule: &StepRule,
    length: f64,
    mut standing: Standing,
) -> Result<f64, S::Error> {
    while standing.done < length {
        let wanted = standing.size;
        let size = even_size(length - standing.done, wanted);
        let is_last = size >= length - standing.done;
        let share = if is_last { 1.0 } else { (standing.done + size) / length };
        let done = if share == 1.0 { length } else { standing.done + size };
        match system.try_step(share, size) {
            Ok(iterations) => {
                let size = next_size(rule, iterations, size, wanted).min(system.largest_size());
                standing = Standing { done, size };
                system.accepted(standing)?;
            }
            Err(error) => {
                system.failed(share, &error)?;
                standing.size = rule.cut * size;
                let at_limit = standing.size < rule.limit_point_below || system.exceeds_iteration_budget();
                if at_limit && system.pass_limit_point(share)? {
                    standing = Standing { done, size: rule.after_limit_point };
                    system.accepted(standing)?;
                } else {
                    system.give_up(FailedStep {
                        share,
                        size,
                        next_size: standing.size,
                        at_limit_point: at_limit,
                        error,
                    })?;
                }
            }
        }
    }
    Ok(standing.size)
}

/// The size, at most `wanted`, that divides the remaining length evenly, so that no last step is tiny.
fn even_size(left: f64, wanted: f64) -> f64 {
    if wanted >= left { left } else { left / (left / wanted - 1e-9).ceil() }
}

/// The preferred size after a step of `size`, with `wanted` preferred before, that took so many iterations.
fn next_size(rule: &StepRule, iterations: u32, size: f64, wanted: f64) -> f64 {
    if iterations <= rule.easy_iterations {
        (AFTER_EASY * size).max(wanted)
    } else if iterations <= FAIR_ITERATIONS {
        wanted
    } else {
        rule.after_hard * size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Finds equilibrium by steps of at most `bearable`, but none between `gap.0` and `gap.1`.
    struct Line {
        bearable: f64,
        gap: (f64, f64),
        at: f64,
        sizes: Vec<f64>,
        passages: usize,
    }

    impl LoadSteps for Line {
        type Error = SolveError;

        fn try_step(&mut self, share: f64, size: f64) -> Result<u32, SolveError> {
            if size > self.bearable || (share > self.gap.0 && share < self.gap.1) {
                return Err(SolveError::Stalled { iterations: 1, residual: 1.0, tolerance: 1e-5 });
            }
            self.at = share;
            self.sizes.push(size);
            Ok(5)
        }
        fn failed(&mut self, _: f64, _: &SolveError) -> Result<(), SolveError> {
            Ok(())
        }
        fn exceeds_iteration_budget(&self) -> bool {
            false
        }
        fn pass_limit_point(&mut self, share: f64) -> Result<bool, SolveError> {
            self.at = share.max(self.gap.1);
            self.gap = (2.0, 2.0);
            self.passages += 1;
            Ok(true)
        }
        fn give_up(&mut self, step: FailedStep) -> Result<(), SolveError> {
            if step.next_size < 1e-4 { Err(step.error) } else { Ok(()) }
        }
        fn accepted(&mut self, _: Standing) -> Result<(), SolveError> {
            Ok(())
        }
    }

    const RULE: StepRule =
        StepRule { easy_iterations: 6, after_hard: 0.6, cut: 0.4, limit_point_below: 5e-3, after_limit_point: 0.2 };

    #[test]
    fn steps_are_cut_to_the_solvable_size_and_evened_out() {
        let mut line = Line { bearable: 0.3, gap: (2.0, 2.0), at: 0.0, sizes: Vec::new(), passages: 0 };
        load_along(&mut line, &RULE, 2.5, Standing { done: 0.0, size: 1.0 }).unwrap();
        assert_eq!(line.at, 1.0);
        assert!((line.sizes.iter().sum::<f64>() - 2.5).abs() < 1e-12);
        assert!(line.sizes.iter().all(|&s| s <= 0.3 && s > 0.05), "{:?}", line.sizes);
        assert_eq!(line.passages, 0);
    }

    #[test]
    fn a_limit_point_is_passed_where_cutting_does_not_help() {
        let mut line = Line { bearable: 1.0, gap: (0.5, 0.7), at: 0.0, sizes: Vec::new(), passages: 0 };
        load_along(&mut line, &RULE, 1.0, Standing { done: 0.0, size: 0.3 }).unwrap();
        assert_eq!((line.at, line.passages), (1.0, 1));
    }
}
