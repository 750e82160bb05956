//! Differences between a finished model and finite-element runs that it was not fitted to.
//!
//! Main type: [`Agreement`]. Uses replay.

use fingerpad::ModelOf;
use fingerpad_fe::experiment::RigidBodySettings;
use fingerpad_fe::load_path::{Drive, Path, Response, Waypoint};
use serde::{Deserialize, Serialize};

use super::{Kind, Run, Sample, replay};

/// Differences of normal force and friction over all rows of a run, N.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Of the normal force.
    pub normal: Difference,
    /// Of friction, length of the difference.
    pub friction: Difference,
}

/// Root mean square and largest difference of a quantity, and its largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Root mean square, N.
    pub rms_n: f64,
    /// Largest, N.
    pub largest_n: f64,
    /// Largest value of the quantity in the finite elements, N.
    pub of_n: f64,
}

impl Difference {
    /// From pairs of the magnitude of the difference and the magnitude of the quantity.
    fn over(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let count = pairs.clone().count().max(1) as f64;
        Self {
            rms_n: (pairs.clone().map(|(apart, _)| apart * apart).sum::<f64>() / count).sqrt(),
            largest_n: pairs.clone().map(|(apart, _)| apart).fold(0.0, f64::max),
            of_n: pairs.map(|(_, of)| of).fold(0.0, f64::max),
        }
    }

    /// Root mean square and largest difference, percent of the largest value; NaN if that is 0.
    pub fn percent(&self) -> [f64; 2] {
        [self.rms_n, self.largest_n].map(|n| 100.0 * n / self.of_n)
    }
}

/// Replays the motion of a finite-element run through a model and compares the forces row by row.
pub fn agreement<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, responses: &[Response]) -> Agreement {
    let corner = |r: &Response| Waypoint { t_s: r.t_s, normal: r.depth_mm, x: r.slide_x_mm, y: r.slide_y_mm };
    let run = Run {
        name: String::new(),
        kind: Kind::Straight,
        held_out: true,
        settings_hash: String::new(),
        body: RigidBodySettings::default(),
        path: Path::new([Drive::Displacement; 3], responses.iter().map(corner).collect()),
        samples: responses.iter().map(Sample::from).collect(),
        ended_early: None,
        cpu_s: 0.0,
    };
    let replayed = replay(model, &run);
    let pairs = || responses.iter().zip(&replayed);
    let normal = pairs().map(|(fe, r)| ((f64::from(r.normal_force_n) - fe.normal_force_n).abs(), fe.normal_force_n));
    let friction = pairs().map(|(fe, r)| {
        let [x, y] = r.friction_n.map(f64::from);
        ((x - fe.friction_x_n).hypot(y - fe.friction_y_n), fe.friction_x_n.hypot(fe.friction_y_n))
    });
    Agreement { normal: Difference::over(normal), friction: Difference::over(friction) }
}

#[cfg(test)]
mod tests {
    use fingerpad::build::Params;
    use fingerpad_fe::load_path::Waypoint;

    use super::*;
    use crate::simulate_path;

    #[test]
    fn a_model_agrees_with_itself_and_a_scaled_one_differs_by_the_scale() {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let corner = |t_s, normal, x| Waypoint { t_s, normal, x, y: 0.0 };
        let path = Path::new(
            [Drive::Displacement; 3],
            vec![corner(0.0, 0.0, 0.0), corner(0.5, 1.0, 0.0), corner(2.0, 1.0, 3.0)],
        );
        let mut rows: Vec<Response> = simulate_path(&model, &path).unwrap().iter().map(|row| row.response).collect();
        let same = agreement(&model, &rows);
        assert!(same.normal.percent()[1] < 0.01 && same.friction.percent()[1] < 0.1, "{same:?}");
        rows.iter_mut().for_each(|r| (r.normal_force_n, r.friction_x_n) = (2.0 * r.normal_force_n, 0.0));
        let other = agreement(&model, &rows);
        assert!((other.normal.percent()[1] - 50.0).abs() < 0.1, "{other:?}");
        assert!(other.friction.of_n < 1e-6 && other.friction.largest_n > 0.1, "{other:?}");
    }
}
