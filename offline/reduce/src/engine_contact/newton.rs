//! Newton's `SolverSemiImplicit` and `SolverFeatherstone` take contact as a linear spring with a damper and a viscous friction that is bounded
//! (`newton/_src/solvers/semi_implicit/kernels_contact.py`, `_eval_body_contact`, version 1.8): at a penetration r, fn = ke r, fd = kd times the speed of
//! approach, and friction kf |v_t|, at most mu (fn + fd). ke, kd, kf and mu are the means of both shapes; there is no moment about the normal.
//! Simulated, a sphere has the depths, limits and creep of these formulas (`bindings/warp/tests/test_newton.py`).

use serde::Serialize;

use fingerpad::pad::Pad;

use super::{CREEP_SHARE, EngineContactError, Errors, Loaded, critical_damping, json};

/// First line of the Python, by which it is recognised.
pub const PYTHON_HEAD: &str = "# The contact of Newton's own nearest to a fingertip; made by `fingerpad export`.";
/// Friction gain over the damping of the depth.
const FRICTION_GAIN: f64 = 10.0;
/// What such a contact cannot do.
const LACKS: &str = "Such a contact is linear in depth, has no torsional friction and cannot stick: under any load along the face it creeps. It has no partial slip, so no \
                     slip margin, and no memory of where it was loaded. SolverMuJoCo reads ke and kd per kilogram instead: export mujoco-contact for it.";

/// Parameters of Newton's contact, and its errors against the pad over 0.5 to 1.5 of the load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NewtonContact {
    engine: &'static str,
    /// The load, N, and the depth that it presses the finger, mm.
    pub load_n: f64,
    /// See `load_n`.
    pub depth_mm: f64,
    /// 1 over the mass that moves against the contact, 1/kg.
    pub inverse_mass_per_kg: f64,
    /// Stiffness, N/m: that of the line from no depth to the load.
    pub ke: f64,
    /// Damping, N s/m: critical for the mass.
    pub kd: f64,
    /// Friction gain, N s/m: ten times the damping.
    pub kf: f64,
    /// Friction coefficient.
    pub mu: f64,
    /// Creep along the face under half of the friction limit, m/s.
    pub creep_at_half_limit_m_per_s: f64,
    /// Time in which the friction gain stops a slide of the mass, s: explicit steps must be shorter.
    pub friction_time_s: f64,
    /// Against the pad.
    #[serde(flatten)]
    pub errors: Errors,
    lacks: &'static str,
}

impl NewtonContact {
    /// The nearest contact of a pad in a pose on a plane; arguments and errors as for [`MujocoContact::of_pad`](super::MujocoContact::of_pad), where the
    /// inverse mass is that of both bodies together.
    ///
    /// # Errors
    /// [`EngineContactError`] for a number or a pose out of its range.
    pub fn of_pad(
        pad: &Pad<'_>,
        load_n: f64,
        inverse_mass_per_kg: f64,
        pose_deg: [f64; 2],
    ) -> Result<Self, EngineContactError> {
        let loaded = Loaded::new(pad, load_n, inverse_mass_per_kg, pose_deg)?;
        let there = loaded.there();
        let [mu, _] = loaded.coefficients();
        let ke = 1e3 * load_n / there.depth_mm;
        let kd = critical_damping(ke, inverse_mass_per_kg);
        let kf = FRICTION_GAIN * kd;
        Ok(Self {
            engine: "newton",
            load_n,
            depth_mm: there.depth_mm,
            inverse_mass_per_kg,
            ke,
            kd,
            kf,
            mu,
            creep_at_half_limit_m_per_s: CREEP_SHARE * there.friction_n / kf,
            friction_time_s: 1.0 / (kf * inverse_mass_per_kg),
            errors: loaded.errors(|depth_mm| 1e-3 * ke * depth_mm, |_, _| 0.0),
            lacks: LACKS,
        })
    }

    /// The parameters as a `ShapeConfig` in Python, with the errors in a comment.
    pub fn python(&self) -> String {
        format!(
            "{PYTHON_HEAD}\n\
             # Load {:.4} N at a depth of {:.4} mm.\n\
             # {}\n\
             # Creep under half of the friction limit: {:.3} mm/s. Explicit steps must be shorter than {:.3} ms.\n\
             # {LACKS}\n\
             # kd is critical for an inverse mass of {} 1/kg, kf ten times kd. Newton takes the mean of both shapes: give both this configuration.\n\
             import newton\n\n\
             fingertip = newton.ModelBuilder.ShapeConfig(ke={:.3}, kd={:.4}, kf={:.4}, mu={:.5})\n",
            self.load_n,
            self.depth_mm,
            self.errors.sentence(),
            1e3 * self.creep_at_half_limit_m_per_s,
            1e3 * self.friction_time_s,
            self.inverse_mass_per_kg,
            self.ke,
            self.kd,
            self.kf,
            self.mu,
        )
    }

    /// All numbers as JSON.
    pub fn json(&self) -> String {
        json(self)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check_through_the_load, with_pad};
    use super::*;

    #[test]
    fn the_contact_goes_through_the_load() {
        for load_n in [0.2, 3.0] {
            let found = with_pad(|pad, pose| NewtonContact::of_pad(pad, load_n, 20.0, pose).unwrap());
            check_through_the_load(&found.errors, load_n, 0.45, None);
            assert!(found.errors.torsional_limit_errors.iter().all(|error| *error == -1.0));
            assert!((found.ke * 1e-3 * found.depth_mm - load_n).abs() < 1e-9);
            assert!((found.kd * found.kd * 20.0 - 4.0 * found.ke).abs() < 1e-6 * found.ke);
        }
    }
}
