//! Whether the reduced model can hold the slip lengths of a finger with its friction law.
//!
//! The slip length is the friction limit over the tangential stiffness: the slide, in mm, over which the friction of a
//! contact builds up. The model's table may span a factor of [`fingerpad::SLIP_LENGTH_RATIO_MAX`] of it from its first
//! node to its deepest. Uses initial_guess, parameterisation.

use fingerpad::{ELEMENTS, Error, Field, NODES, SLIP_LENGTH_RATIO_MAX};

use super::initial_guess::initial_guess;
use super::parameterisation::{InitialGuess, Parameterisation};
use super::{ReduceError, Run, Settings};

/// Refuses a friction law under which the slip length of a round pad would span too large a factor, before any run.
///
/// By Hertz, contact radius and pressure grow with the square root of the depth. The limit, strength `p^beta` times
/// area, then grows as `depth^(1 + beta/2)` and the tangential stiffness as the radius, so that the slip length grows as
/// `depth^((1 + beta)/2)`.
///
/// * `pressure_exponent`: beta of the friction law
///
/// # Errors
/// [`ReduceError::SlipLengthOfLaw`].
pub fn check_law(pressure_exponent: f64) -> Result<(), ReduceError> {
    let (depths, most) = ((NODES - 1) as f64, f64::from(SLIP_LENGTH_RATIO_MAX));
    let ratio = depths.powf(0.5 * (1.0 + pressure_exponent));
    if ratio > most {
        let largest_exponent = 2.0 * most.ln() / depths.ln() - 1.0;
        return Err(ReduceError::SlipLengthOfLaw { pressure_exponent, ratio, largest_exponent });
    }
    Ok(())
}

/// Refuses runs whose slip lengths span too large a factor; presses and straight slides suffice.
///
/// Runs that are too few to show it pass.
///
/// * `pressure_exponent`: beta of the runs' friction law
///
/// # Errors
/// [`ReduceError::SlipLengthOfRuns`].
pub fn check_runs(runs: &[Run], pressure_exponent: f64) -> Result<(), ReduceError> {
    let runs: Vec<&Run> = runs.iter().filter(|r| !r.held_out && r.is_representable()).collect();
    let Ok(guess) = initial_guess(&runs) else { return Ok(()) };
    let settings = Settings::default();
    let deepest = runs.iter().flat_map(|r| &r.samples).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let parameterisation =
        Parameterisation::new(settings.rising_knots, settings.gentle_knots, deepest, pressure_exponent);
    let theta = parameterisation.start(ELEMENTS, &guess);
    match parameterisation.params::<ELEMENTS, NODES>(&theta).try_build() {
        Err(error @ Error::Range { what: Field::SlipLengthRatio, .. }) => {
            Err(explained(error, &guess, pressure_exponent))
        }
        _ => Ok(()),
    }
}

/// The core's refusal of the initial guess, with what the runs show where it is about slip lengths.
pub fn explained(error: Error, guess: &InitialGuess, pressure_exponent: f64) -> ReduceError {
    match error {
        Error::Range { what: Field::SlipLengthRatio, value, .. } => ReduceError::SlipLengthOfRuns {
            ratio: value.into(),
            limit_exponent: guess.limit[1],
            stiffness_exponent: guess.stiffness[1],
            pressure_exponent,
        },
        other => ReduceError::Model(other),
    }
}

#[cfg(test)]
mod tests {
    use fingerpad::Regime;

    use super::*;
    use crate::{DesignSettings, Kind, Sample, design, fit};

    /// Runs of a contact with limit `d^limit_exponent` N and stiffness `sqrt(d)` N/mm, made without finite elements.
    fn runs(limit_exponent: f64) -> Vec<Run> {
        let all = design(&DesignSettings::default()).unwrap();
        let design = all.into_iter().filter(|e| matches!(e.kind, Kind::Press | Kind::Straight));
        design
            .map(|e| {
                let (mut at, mut force, mut samples) = ([0.0; 3], [0.0; 2], Vec::new());
                for pair in e.path.waypoints.windows(2) {
                    let [from, to] = [&pair[0], &pair[1]].map(|w| [w.normal, w.x, w.y]);
                    for k in 1..=40 {
                        let before = at;
                        at = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * f64::from(k) / 40.0);
                        let depth = at[0].max(0.0);
                        let (limit, stiffness) = (depth.powf(limit_exponent), depth.sqrt());
                        force = [0, 1].map(|i| force[i] + stiffness * (at[i + 1] - before[i + 1]));
                        let share = limit / force[0].hypot(force[1]).max(1e-12);
                        force = force.map(|f| f * share.min(1.0));
                        samples.push(Sample {
                            t_s: 0.0,
                            depth_mm: at[0] as f32,
                            slide_mm: [at[1] as f32, at[2] as f32],
                            normal_force_n: depth.powf(1.5) as f32,
                            friction_n: force.map(|f| f as f32),
                            contact_area_mm2: (30.0 * depth) as f32,
                            stick_ratio: if share < 1.0 { 0.0 } else { 0.9 },
                            regime: if depth > 0.0 { Regime::PartialSlip } else { Regime::NoContact },
                            turned: None,
                        });
                    }
                }
                Run {
                    name: e.name,
                    kind: e.kind,
                    held_out: e.held_out,
                    settings_hash: "power laws".into(),
                    path: e.path,
                    samples,
                    ended_early: None,
                    cpu_s: 0.0,
                }
            })
            .collect()
    }

    #[test]
    fn a_law_and_runs_with_too_wide_slip_lengths_are_refused_in_words() {
        assert!(check_law(0.46).is_ok() && check_law(1.0).is_ok());
        let message = check_law(1.5).unwrap_err().to_string();
        assert!(message.contains("friction.beta = 1.5") && message.contains("at most 50"), "{message}");

        assert!(check_runs(&runs(1.5), 1.0).is_ok());
        let wide = runs(2.3);
        let message = check_runs(&wide, 1.0).unwrap_err().to_string();
        for part in ["slip length", "at most 50", "friction.beta = 1", "depth^2.3", "depth^0.5"] {
            assert!(message.contains(part), "no `{part}` in: {message}");
        }
        assert_eq!(fit::<ELEMENTS, NODES>(&wide, 1.0, &Settings::default()).unwrap_err().to_string(), message);
        assert!(check_runs(&wide[..2], 1.0).is_ok(), "too few runs show nothing");
    }
}
