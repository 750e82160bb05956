//! The contact of a physics engine's own that comes nearest to a pad at a load.
//!
//! Main types: [`MujocoContact`], [`NewtonContact`], [`DrakeContact`], each exact at the load, with its [`Errors`] around it. Uses limit_surface for
//! the pad's limits.

mod drake;
mod mujoco;
mod newton;

use serde::Serialize;

use fingerpad::pad::Pad;

use crate::limit_surface::{LimitPoint, LimitSurfaceError, limit_points_of_pad};

pub use drake::{DrakeContact, SDF_HEAD};
pub use mujoco::{MJCF_HEAD, MujocoContact};
pub use newton::{NewtonContact, PYTHON_HEAD};

/// First line of the JSON of every engine, by which it is recognised.
pub const JSON_HEAD: &str = "{\n  \"engine\": \"";

/// The loads around the given one over which errors count, over it.
const AROUND: [f64; 2] = [0.5, 1.5];
/// Loads between these ends.
const LOADS: usize = 11;
/// The load itself among them.
const THERE: usize = LOADS / 2;
/// Share of the friction limit for which the creep is stated.
const CREEP_SHARE: f64 = 0.5;

/// Errors of a contact against the pad over 0.5 to 1.5 of the load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Loads, N.
    pub loads_n: Vec<f64>,
    /// Depth of the pad at these loads, mm, and the normal force of the contact there over the load, less 1.
    pub depths_mm: Vec<f64>,
    /// See `depths_mm`.
    pub normal_force_errors: Vec<f64>,
    /// The pad's friction limit, N, mean over four directions, and the contact's over it, less 1.
    pub friction_limits_n: Vec<f64>,
    /// See `friction_limits_n`.
    pub friction_limit_errors: Vec<f64>,
    /// The pad's limit of the moment about the normal, N mm, and the contact's over it, less 1.
    pub torsional_limits_n_mm: Vec<f64>,
    /// See `torsional_limits_n_mm`.
    pub torsional_limit_errors: Vec<f64>,
}

impl Errors {
    /// The largest errors of normal force, friction limit and torsional limit, as a sentence.
    fn sentence(&self) -> String {
        let percent = |errors: &[f64]| 100.0 * errors.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        format!(
            "Largest error against the pad from {:.4} to {:.4} N: normal force {:.1} %, friction limit {:.1} %, torsional limit {:.1} %.",
            self.loads_n[0],
            self.loads_n[LOADS - 1],
            percent(&self.normal_force_errors),
            percent(&self.friction_limit_errors),
            percent(&self.torsional_limit_errors),
        )
    }
}

/// Why there is no such contact.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EngineContactError {
    /// A load or an inverse mass out of its range.
    #[error("{what} {value}: the allowed range is {least} to {most:.4}")]
    Range {
        /// Name and unit.
        what: &'static str,
        /// The value given.
        value: f64,
        /// Ends of the range.
        least: f64,
        /// See `least`.
        most: f64,
    },
    /// A pose out of its range.
    #[error(transparent)]
    Limit(#[from] LimitSurfaceError),
}

/// What a pad does at a load.
struct AtLoad {
    depth_mm: f64,
    friction_n: f64,
    moment_n_mm: f64,
}

/// A pad in a pose on a plane, at the loads around the given one.
struct Loaded {
    loads_n: Vec<f64>,
    pads: Vec<AtLoad>,
}

impl Loaded {
    /// * `load_n`: normal force, 0.02 N to two thirds of what the pad was fitted for
    /// * `inverse_mass_per_kg`: 1e-3 to 1e5
    /// * `pose_deg`: pitch and roll
    ///
    /// # Errors
    /// [`EngineContactError`] for a number or a pose out of its range.
    fn new(
        pad: &Pad<'_>,
        load_n: f64,
        inverse_mass_per_kg: f64,
        pose_deg: [f64; 2],
    ) -> Result<Self, EngineContactError> {
        let points = |depth_mm: f64| -> Result<Vec<LimitPoint>, LimitSurfaceError> {
            let directions = [
                [1.0, 0.0, 0.0],
                [-1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, -1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.0, 0.0, -1.0],
            ];
            limit_points_of_pad(pad, depth_mm, pose_deg, &directions)
        };
        let most_mm = f64::from(pad.depth_max_mm());
        let most_n = points(most_mm)?[0].normal_force_n / AROUND[1];
        within("load in N", load_n, 0.02, most_n)?;
        within("inverse mass in 1/kg", inverse_mass_per_kg, 1e-3, 1e5)?;
        let at_load = |load_n: f64| -> Result<AtLoad, LimitSurfaceError> {
            let (mut low, mut high) = (0.1, most_mm);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                // Without contact the force is below any load.
                let force = points(middle).map_or(0.0, |points| points[0].normal_force_n);
                *(if force < load_n { &mut low } else { &mut high }) = middle;
            }
            let found = points(high)?;
            let friction_n = found[..4].iter().map(|p| p.friction_n[0].hypot(p.friction_n[1])).sum::<f64>() / 4.0;
            let moment_n_mm = found[4..].iter().map(|p| p.spin_moment_n_mm.abs()).sum::<f64>() / 2.0;
            Ok(AtLoad { depth_mm: high, friction_n, moment_n_mm })
        };
        let step = (AROUND[1] - AROUND[0]) / (LOADS - 1) as f64;
        let loads_n: Vec<f64> = (0..LOADS).map(|k| load_n * (AROUND[0] + step * k as f64)).collect();
        let pads = loads_n.iter().map(|&load| at_load(load)).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { loads_n, pads })
    }

    fn there(&self) -> &AtLoad {
        &self.pads[THERE]
    }

    /// Limits of friction and, mm, of the moment at the load, over it.
    fn coefficients(&self) -> [f64; 2] {
        [self.there().friction_n / self.loads_n[THERE], self.there().moment_n_mm / self.loads_n[THERE]]
    }

    /// Errors of a contact: its normal force, N, and torsional limit, N mm, at the depth of a pad at a load; its friction limit is proportional to the
    /// load, and exact at the given one.
    fn errors(&self, force_n: impl Fn(f64) -> f64, moment_n_mm: impl Fn(f64, f64) -> f64) -> Errors {
        let over = |contact: &dyn Fn(&AtLoad, f64) -> f64, pad: &dyn Fn(&AtLoad, f64) -> f64| -> Vec<f64> {
            self.pads.iter().zip(&self.loads_n).map(|(at, &load)| contact(at, load) / pad(at, load) - 1.0).collect()
        };
        let [sliding, _] = self.coefficients();
        Errors {
            depths_mm: self.pads.iter().map(|pad| pad.depth_mm).collect(),
            normal_force_errors: over(&|at, _| force_n(at.depth_mm), &|_, load| load),
            friction_limits_n: self.pads.iter().map(|pad| pad.friction_n).collect(),
            friction_limit_errors: over(&|_, load| sliding * load, &|at, _| at.friction_n),
            torsional_limits_n_mm: self.pads.iter().map(|pad| pad.moment_n_mm).collect(),
            torsional_limit_errors: over(&|at, load| moment_n_mm(at.depth_mm, load), &|at, _| at.moment_n_mm),
            loads_n: self.loads_n.clone(),
        }
    }
}

/// Damping, N s/m, that is critical for a stiffness, N/m, and a mass.
fn critical_damping(stiffness_n_per_m: f64, inverse_mass_per_kg: f64) -> f64 {
    2.0 * (stiffness_n_per_m / inverse_mass_per_kg).sqrt()
}

fn json(contact: &impl Serialize) -> String {
    serde_json::to_string_pretty(contact).expect("plain numbers") + "\n"
}

fn within(what: &'static str, value: f64, least: f64, most: f64) -> Result<(), EngineContactError> {
    if value >= least && value <= most {
        return Ok(());
    }
    Err(EngineContactError::Range { what, value, least, most })
}

#[cfg(test)]
mod tests {
    use fingerpad::host::PadModelFile;

    use super::*;

    /// A contact with the shipped pad at pitch 30°.
    pub fn with_pad<C>(of_pad: impl Fn(&Pad<'_>, [f64; 2]) -> C) -> C {
        let file = PadModelFile::new(include_bytes!("../../data/models/fingertip-pad.fpm")).unwrap();
        of_pad(&file.file().pad, [30.0, 0.0])
    }

    /// The forces, and the torsional limit of a contact that has one, are the pad's at the load and within the given shares around it.
    pub fn check_through_the_load(errors: &Errors, load_n: f64, largest: f64, torsional: Option<f64>) {
        assert!((errors.loads_n[THERE] - load_n).abs() < 1e-9);
        let forces = [(&errors.normal_force_errors, largest), (&errors.friction_limit_errors, 0.4)];
        let torsion = torsional.map(|largest| (&errors.torsional_limit_errors, largest));
        for (errors, largest) in forces.into_iter().chain(torsion) {
            assert!(errors[THERE].abs() < 1e-3 && errors.iter().all(|error| error.abs() < largest), "{errors:?}");
        }
    }

    #[test]
    fn ranges_are_named() {
        let refused = |load: f64, mass: f64| {
            with_pad(|pad, pose| Loaded::new(pad, load, mass, pose).err().map(|error| error.to_string())).unwrap()
        };
        assert!(
            refused(9.0, 20.0).starts_with("load in N 9: the allowed range is 0.02 to 4.3"),
            "{}",
            refused(9.0, 20.0)
        );
        assert!(refused(f64::NAN, 20.0).starts_with("load in N NaN"));
        assert!(refused(1.0, 0.0).starts_with("inverse mass in 1/kg 0: the allowed range is 0.001 to 100000"));
    }
}
