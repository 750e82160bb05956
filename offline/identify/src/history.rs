//! Equilibria found before, and the first guess of a new one that they give by interpolation.
//!
//! A place is a depth with a friction law; places are compared in coordinates (depth, strength, exponent) that are
//! scaled to the steps over which Newton's method converges.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use super::Place;
use fingerpad_fe::assembly::{Body, Configuration, rotation_vector};

/// Number of equilibria that are kept.
const KEPT: usize = 40;
/// Number of equilibria that a prediction interpolates.
const MIXED: usize = 8;
/// Distance below which two places are the same, in steps.
const SAME: f64 = 1e-4;

/// An equilibrium with its place and the place's scaled coordinates.
#[derive(Clone)]
struct Known {
    at: [f64; 3],
    place: Place,
    configuration: Configuration,
}

/// The last equilibria of a finger.
#[derive(Clone, Default)]
pub struct History {
    states: Vec<Known>,
}

impl History {
    /// Removes all equilibria.
    pub fn clear(&mut self) {
        self.states.clear();
    }

    /// Adds an equilibrium; one at the same place is replaced, and the oldest makes room.
    pub fn keep(&mut self, at: [f64; 3], place: Place, configuration: &Configuration) {
        self.states.retain(|known| distance(&known.at, &at) > SAME);
        if self.states.len() == KEPT {
            self.states.remove(0);
        }
        self.states.push(Known { at, place, configuration: configuration.clone() });
    }

    /// Error to be expected of [`Self::predict`] at a place, in steps; infinite without any equilibrium.
    pub fn distance(&self, to: &[f64; 3]) -> f64 {
        self.weights(to).map_or(f64::INFINITY, |(.., far)| far)
    }

    /// The equilibrium nearest to a place, with its own place and the distance in steps.
    pub fn nearest(&self, to: &[f64; 3]) -> Option<(Place, Configuration, f64)> {
        let near = self.states.iter().min_by(|a, b| distance(&a.at, to).total_cmp(&distance(&b.at, to)))?;
        Some((near.place, near.configuration.clone(), distance(&near.at, to)))
    }

    /// Configuration interpolated at a place, and whether it comes from more than one equilibrium.
    pub fn predict(&self, body: &Body, to: &[f64; 3]) -> Option<(Configuration, bool)> {
        let (near, weights, _) = self.weights(to)?;
        let first = &near.first()?.configuration;
        let mut guess = first.clone();
        let mut turn = Vector3::zeros();
        for (weight, Known { configuration: state, .. }) in weights.iter().zip(&near) {
            for ((x, a), b) in guess.x.iter_mut().zip(&state.x).zip(&first.x) {
                *x += (a - b) * *weight;
            }
            guess.rigid_centre += (state.rigid_centre - first.rigid_centre) * *weight;
            turn += rotation_vector(&(state.rigid_rotation * first.rigid_rotation.inverse())) * *weight;
        }
        guess.rigid_rotation = Rotation3::new(turn) * first.rigid_rotation;
        body.follow(&mut guess);
        Some((guess, near.len() > 1))
    }

    /// The nearest states, their weights (sum 1) in a prediction of a place, and the expected error, in steps.
    ///
    /// The weighted mean of the places should be the requested place, and far states, whose interpolation error grows
    /// with the square of their distance, should have little weight: least |sum w dz|² + sum w² |dz|⁴.
    fn weights(&self, to: &[f64; 3]) -> Option<(Vec<&Known>, DVector<f64>, f64)> {
        let mut near: Vec<&Known> = self.states.iter().collect();
        near.sort_by(|a, b| distance(&a.at, to).total_cmp(&distance(&b.at, to)));
        near.truncate(MIXED);
        let n = near.len();
        let away: Vec<[f64; 3]> = near.iter().map(|known| std::array::from_fn(|k| known.at[k] - to[k])).collect();
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let dot: f64 = (0..3).map(|k| away[i][k] * away[j][k]).sum();
            dot + if i == j { dot * dot + 1e-10 } else { 0.0 }
        });
        let ones = DVector::from_element(n, 1.0);
        let solved = matrix.cholesky().filter(|_| n > 0)?.solve(&ones);
        let sum = solved.sum();
        (sum > 0.0).then(|| (near, solved / sum, sum.recip().sqrt()))
    }
}

/// Distance of two places, in steps.
pub fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad_fe::contact::RubberFriction;

    fn known(places: &[[f64; 3]]) -> History {
        let mut history = History::default();
        for &at in places {
            let configuration =
                Configuration { x: vec![], rigid_centre: Vector3::zeros(), rigid_rotation: Rotation3::identity() };
            history.keep(at, Place { depth_mm: 0.5, law: RubberFriction::default() }, &configuration);
        }
        history
    }

    #[test]
    fn two_states_are_continued_along_their_line_and_four_span_the_places_between() {
        let mixed = |history: &History, to: [f64; 3]| -> ([f64; 3], f64, f64) {
            let (near, weights, far) = history.weights(&to).unwrap();
            let place = |k: usize| weights.iter().zip(&near).map(|(w, known)| w * known.at[k]).sum::<f64>();
            ([0, 1, 2].map(place), weights.sum(), far)
        };
        let (place, _, far) = mixed(&known(&[[0.0; 3], [0.3, 0.0, 0.0]]), [0.5, 0.0, 0.0]);
        assert!((place[0] - 0.5).abs() < 0.1 && far < 0.4, "{place:?} {far}");
        let history = known(&[[0.0; 3], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]]);
        let (place, sum, far) = mixed(&history, [0.1, 0.05, 0.05]);
        assert!((sum - 1.0).abs() < 1e-12 && far < 0.03, "{far}");
        assert!((place[0] - 0.1).abs() < 0.01 && (place[1] - 0.05).abs() < 0.01, "{place:?}");
    }

    #[test]
    fn a_known_place_is_its_own_prediction_and_nothing_is_known_of_no_states() {
        let history = known(&[[0.0; 3], [0.4, 0.1, 0.0]]);
        let (near, weights, far) = history.weights(&[0.4, 0.1, 0.0]).unwrap();
        assert!(near[0].at == [0.4, 0.1, 0.0] && (weights[0] - 1.0).abs() < 1e-4 && far < 1e-4);
        assert!(history.nearest(&[0.3, 0.0, 0.0]).unwrap().2 < 0.15);
        assert!(History::default().distance(&[0.0; 3]).is_infinite());
        assert!(History::default().nearest(&[0.0; 3]).is_none());
    }
}
