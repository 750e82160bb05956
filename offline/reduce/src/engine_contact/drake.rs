//! Drake's hydroelastic contact of a compliant sphere with a rigid half space. The pressure within the sphere is linear in the radius
//! (`geometry/proximity/make_sphere_field.h`): "The pressure at a point with distance r from the origin is defined as E * e(r) ... The extent is defined as
//! e(r) = 1 - r / R". The contact surface is the disk in which the plane, at a distance h = R − depth from the centre, cuts the sphere, and the traction there
//! is p (1 + d v) along the normal, with the dissipation d and the speed of approach v, and at most mu p along the face. So
//!
//! N = 2π E ∫ (1 − r/R) r dr = 2π E ((R² − h²)/2 − (R³ − h³)/(3R)),  M = 2π mu E ∫ √(r² − h²) (1 − r/R) r dr,  both from h to R.
//!
//! The fit takes R such that the torsional limit at the load is the pad's, and E such that the normal force is. The radius is therefore not that of the finger.
//! Simulated, a sphere has the depths of these formulas to the error of Drake's mesh (`bindings/mujoco/tests/test_drake_contact.py`).

use std::f64::consts::PI;

use serde::Serialize;

use fingerpad::pad::Pad;

use super::{EngineContactError, Errors, Loaded, critical_damping, json};

/// First line of the SDF, by which it is recognised.
pub const SDF_HEAD: &str = "<!-- The hydroelastic contact of Drake nearest to a fingertip; made by `fingerpad export`.";
/// Radii that the fit takes, over the largest depth.
const RADII: [f64; 2] = [1.01, 1000.0];
/// Edge length of the sphere's mesh over the radius of the contact at the load.
const MESH: f64 = 0.2;
/// What such a contact cannot do.
const LACKS: &str = "Such a contact has no tangential compliance: it sticks up to Drake's stiction tolerance (1 mm/s by default), at which it creeps, or slips. It has no \
                     slip margin and no memory of where it was loaded. Its friction over the normal force is the same at every load.";

/// Parameters of Drake's hydroelastic sphere, and its errors against the pad over 0.5 to 1.5 of the load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DrakeContact {
    engine: &'static str,
    /// The load, N, and the depth that it presses the finger, mm.
    pub load_n: f64,
    /// See `load_n`.
    pub depth_mm: f64,
    /// 1 over the mass that moves against the contact, 1/kg.
    pub inverse_mass_per_kg: f64,
    /// Radius of the sphere, m.
    pub radius_m: f64,
    /// `drake:mesh_resolution_hint`, m.
    pub resolution_hint_m: f64,
    /// `drake:hydroelastic_modulus`, Pa.
    pub hydroelastic_modulus_pa: f64,
    /// `drake:hunt_crossley_dissipation`, s/m: critical for the mass at the load.
    pub hunt_crossley_dissipation_s_per_m: f64,
    /// `drake:mu_static` and `drake:mu_dynamic`.
    pub mu: f64,
    /// Against the pad.
    #[serde(flatten)]
    pub errors: Errors,
    lacks: &'static str,
}

impl DrakeContact {
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
        let [mu, torsional_mm] = loaded.coefficients();
        // The arm of friction grows with the radius.
        let deepest_mm = loaded.pads.iter().fold(0.0, |a: f64, pad| a.max(pad.depth_mm));
        let [mut low, mut high] = RADII.map(|times| times * deepest_mm);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let is_short = mu * Sphere { radius_mm: middle }.arm_mm(there.depth_mm) < torsional_mm;
            *(if is_short { &mut low } else { &mut high }) = middle;
        }
        let sphere = Sphere { radius_mm: high };
        let modulus_mpa = load_n / sphere.volume_mm2(there.depth_mm);
        let by_mm = 1e-4 * there.depth_mm;
        let rise_mm2 = sphere.volume_mm2(there.depth_mm + by_mm) - sphere.volume_mm2(there.depth_mm - by_mm);
        let stiffness_n_per_m = 1e3 * modulus_mpa * rise_mm2 / (2.0 * by_mm);
        Ok(Self {
            engine: "drake",
            load_n,
            depth_mm: there.depth_mm,
            inverse_mass_per_kg,
            radius_m: 1e-3 * sphere.radius_mm,
            resolution_hint_m: 1e-3 * MESH * sphere.contact_mm(there.depth_mm),
            hydroelastic_modulus_pa: 1e6 * modulus_mpa,
            hunt_crossley_dissipation_s_per_m: critical_damping(stiffness_n_per_m, inverse_mass_per_kg) / load_n,
            mu,
            errors: loaded.errors(
                |depth_mm| modulus_mpa * sphere.volume_mm2(depth_mm),
                |depth_mm, load_n| mu * load_n * sphere.arm_mm(depth_mm),
            ),
            lacks: LACKS,
        })
    }

    /// The parameters as a collision geometry in SDF, with the errors in a comment.
    pub fn sdf(&self) -> String {
        format!(
            "{SDF_HEAD}\n\
             Load {:.4} N at a depth of {:.4} mm.\n\
             {}\n\
             {LACKS}\n\
             The dissipation is critical for an inverse mass of {} 1/kg. The other geometry is rigid and has the same mu_static and mu_dynamic.\n\
             The radius gives the torsional limit and is not that of the finger; the lowest point of the sphere lies at the origin of the link. -->\n\
             <collision name=\"fingertip\" xmlns:drake=\"http://drake.mit.edu\">\n  <pose>0 0 {radius:.6} 0 0 0</pose>\n  \
             <geometry><sphere><radius>{radius:.6}</radius></sphere></geometry>\n  <drake:proximity_properties>\n    \
             <drake:compliant_hydroelastic/>\n    \
             <drake:mesh_resolution_hint>{:.6}</drake:mesh_resolution_hint>\n    \
             <drake:hydroelastic_modulus>{:.1}</drake:hydroelastic_modulus>\n    \
             <drake:hunt_crossley_dissipation>{:.4}</drake:hunt_crossley_dissipation>\n    \
             <drake:mu_static>{mu:.5}</drake:mu_static>\n    <drake:mu_dynamic>{mu:.5}</drake:mu_dynamic>\n  \
             </drake:proximity_properties>\n</collision>\n",
            self.load_n,
            self.depth_mm,
            self.errors.sentence(),
            self.inverse_mass_per_kg,
            self.resolution_hint_m,
            self.hydroelastic_modulus_pa,
            self.hunt_crossley_dissipation_s_per_m,
            radius = self.radius_m,
            mu = self.mu,
        )
    }

    /// All numbers as JSON.
    pub fn json(&self) -> String {
        json(self)
    }
}

/// The disk of contact of a sphere with a plane.
struct Sphere {
    radius_mm: f64,
}

impl Sphere {
    /// Distance of the plane from the centre.
    fn height_mm(&self, depth_mm: f64) -> f64 {
        (self.radius_mm - depth_mm).max(0.0)
    }

    /// Radius of the contact.
    fn contact_mm(&self, depth_mm: f64) -> f64 {
        (self.radius_mm.powi(2) - self.height_mm(depth_mm).powi(2)).sqrt()
    }

    /// Normal force over the modulus.
    fn volume_mm2(&self, depth_mm: f64) -> f64 {
        let (r, h) = (self.radius_mm, self.height_mm(depth_mm));
        2.0 * PI * ((r * r - h * h) / 2.0 - (r.powi(3) - h.powi(3)) / (3.0 * r))
    }

    /// Torsional limit over mu and the normal force: the mean distance from the middle, weighted by the pressure.
    fn arm_mm(&self, depth_mm: f64) -> f64 {
        const RINGS: usize = 400;
        let (h, contact) = (self.height_mm(depth_mm), self.contact_mm(depth_mm));
        let ring = |k: usize| {
            let s = (k as f64 + 0.5) / RINGS as f64 * contact;
            let pressure = 1.0 - h.hypot(s) / self.radius_mm;
            [pressure * s, pressure * s * s]
        };
        let [force, moment] = (0..RINGS).map(ring).fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        moment / force
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check_through_the_load, with_pad};
    use super::*;

    /// Exact at the load; around it the stated errors are those of the pressure summed over the disk of contact.
    #[test]
    fn the_contact_goes_through_the_load_with_the_stated_errors() {
        for load_n in [0.2, 3.0] {
            let found = with_pad(|pad, pose| DrakeContact::of_pad(pad, load_n, 20.0, pose).unwrap());
            let errors = &found.errors;
            // Force grows at most with the depth squared, that of a lightly loaded pad faster.
            check_through_the_load(errors, load_n, 0.25, Some(0.25));
            let (radius_mm, modulus_mpa) = (1e3 * found.radius_m, 1e-6 * found.hydroelastic_modulus_pa);
            for (k, (depth_mm, load_n)) in errors.depths_mm.iter().zip(&errors.loads_n).enumerate() {
                let height_mm = radius_mm - depth_mm;
                let contact_mm = (radius_mm.powi(2) - height_mm.powi(2)).sqrt();
                let ring_mm = contact_mm / 2000.0;
                let [force_n, moment_n_mm] = (0..2000).fold([0.0; 2], |[force, moment], ring| {
                    let at_mm = (f64::from(ring) + 0.5) * ring_mm;
                    let pressure_mpa = modulus_mpa * (1.0 - at_mm.hypot(height_mm) / radius_mm);
                    let ring_n = pressure_mpa * 2.0 * PI * at_mm * ring_mm;
                    [force + ring_n, moment + found.mu * ring_n * at_mm]
                });
                // The moment is that of the pad's load, as friction is.
                let moment_n_mm = moment_n_mm / force_n * load_n;
                let close =
                    |stated: f64, ratio: f64| assert!((stated - (ratio - 1.0)).abs() < 1e-3, "{stated} {ratio}");
                close(errors.normal_force_errors[k], force_n / load_n);
                close(errors.torsional_limit_errors[k], moment_n_mm / errors.torsional_limits_n_mm[k]);
            }
        }
    }

    /// A shallow contact has the pressure of a paraboloid: N = π E R (depth/R)² R, and an arm of 8/15 of the radius of contact.
    #[test]
    fn shallow_contacts_are_parabolic() {
        let (sphere, depth_mm) = (Sphere { radius_mm: 1000.0 }, 0.1);
        assert!((sphere.volume_mm2(depth_mm) / (PI * depth_mm * depth_mm) - 1.0).abs() < 1e-3);
        assert!((sphere.arm_mm(depth_mm) / sphere.contact_mm(depth_mm) - 8.0 / 15.0).abs() < 1e-3);
    }
}
