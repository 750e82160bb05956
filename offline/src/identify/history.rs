//! States found before, and what they say of a place nearby.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use crate::assembly::{Body, Configuration, rotation_vector};

/// States that are kept.
const KEPT: usize = 10;
/// Distance below which two places are the same, in steps.
const SAME: f64 = 1e-4;

/// The last equilibria of a finger with their places: depth, strength, exponent, in steps that converge.
#[derive(Clone, Default)]
pub struct History {
    states: Vec<([f64; 3], Configuration)>,
}

impl History {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.states.clear();
    }

    /// Keeps a state.
    pub fn keep(&mut self, at: [f64; 3], configuration: &Configuration) {
        self.states.retain(|(place, _)| distance(place, &at) > SAME);
        if self.states.len() == KEPT {
            self.states.remove(0);
        }
        self.states.push((at, configuration.clone()));
    }

    /// How far from known a place is, in steps; infinite if nothing is known.
    pub fn distance(&self, to: &[f64; 3]) -> f64 {
        self.weights(to).map_or(f64::INFINITY, |(_, far)| far)
    }

    /// Whether a prediction is more than the one state that is known.
    pub fn is_led(&self) -> bool {
        self.states.len() > 1
    }

    /// A guess of the state at a place; none if nothing is known.
    pub fn predict(&self, body: &Body, to: &[f64; 3]) -> Option<Configuration> {
        let (weights, _) = self.weights(to)?;
        let (_, last) = self.states.last()?;
        let mut guess = last.clone();
        let mut turn = Vector3::zeros();
        for (weight, (_, state)) in weights.iter().zip(&self.states) {
            for ((x, a), b) in guess.x.iter_mut().zip(&state.x).zip(&last.x) {
                *x += (a - b) * *weight;
            }
            guess.rigid_centre += (state.rigid_centre - last.rigid_centre) * *weight;
            turn += rotation_vector(&(state.rigid_rotation * last.rigid_rotation.inverse())) * *weight;
        }
        guess.rigid_rotation = Rotation3::new(turn) * last.rigid_rotation;
        body.follow(&mut guess);
        Some(guess)
    }

    /// Weights (sum 1) of the states that predict a place, and the error to be expected, in steps.
    ///
    /// The mixture of places should be the place wanted, and far states, whose mixture errs by the square of their
    /// distance, should count little: least |sum w dz|² + sum w² |dz|⁴.
    fn weights(&self, to: &[f64; 3]) -> Option<(DVector<f64>, f64)> {
        let n = self.states.len();
        let away: Vec<[f64; 3]> = self.states.iter().map(|(at, _)| std::array::from_fn(|k| at[k] - to[k])).collect();
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let dot: f64 = (0..3).map(|k| away[i][k] * away[j][k]).sum();
            dot + if i == j { dot * dot + 1e-10 } else { 0.0 }
        });
        let ones = DVector::from_element(n, 1.0);
        let solved = matrix.cholesky().filter(|_| n > 0)?.solve(&ones);
        let sum = solved.sum();
        (sum > 0.0).then(|| (solved / sum, sum.recip().sqrt()))
    }
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(places: &[[f64; 3]]) -> History {
        let mut history = History::default();
        for &at in places {
            let configuration =
                Configuration { x: vec![], rigid_centre: Vector3::zeros(), rigid_rotation: Rotation3::identity() };
            history.keep(at, &configuration);
        }
        history
    }

    #[test]
    fn two_states_are_continued_along_their_line_and_four_span_the_places_between() {
        let history = known(&[[0.0; 3], [0.3, 0.0, 0.0]]);
        let (weights, far) = history.weights(&[0.5, 0.0, 0.0]).unwrap();
        assert!((weights[0] * 0.0 + weights[1] * 0.3 - 0.5).abs() < 0.05 && far < 0.3, "{weights} {far}");
        let history = known(&[[0.0; 3], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]]);
        let (weights, far) = history.weights(&[0.1, 0.05, 0.05]).unwrap();
        let mixed = |k: usize| weights.iter().zip(&history.states).map(|(w, (at, _))| w * at[k]).sum::<f64>();
        assert!((weights.sum() - 1.0).abs() < 1e-12 && far < 0.03, "{weights} {far}");
        assert!((mixed(0) - 0.1).abs() < 0.01 && (mixed(1) - 0.05).abs() < 0.01, "{weights}");
    }

    #[test]
    fn a_known_place_is_its_own_prediction_and_nothing_is_known_of_no_states() {
        let history = known(&[[0.0; 3], [0.4, 0.1, 0.0]]);
        let (weights, far) = history.weights(&[0.4, 0.1, 0.0]).unwrap();
        assert!((weights[1] - 1.0).abs() < 1e-4 && far < 1e-4);
        assert!(History::default().distance(&[0.0; 3]).is_infinite());
    }
}
