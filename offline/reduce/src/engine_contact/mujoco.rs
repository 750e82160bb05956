//! MuJoCo's static normal force at a penetration r is s d(r)² r / (d_w² (1 − d(r)) A), with the stiffness s of `solref`, the impedance d of `solimp`,
//! which goes from d_0 at r = 0 to d_w at the width w, and the inverse mass A of both bodies (`body_invweight0`). It stiffens with depth as d grows.
//! The fit takes d_w = 0.5 and w from the pad, s such that the force at the load is the pad's, and d_0 such that the error around the load is least.

use serde::Serialize;

use fingerpad::pad::Pad;

use super::{AtLoad, CREEP_SHARE, EngineContactError, Errors, LOADS, Loaded, critical_damping, json};

/// First line of the MJCF, by which it is recognised.
pub const MJCF_HEAD: &str = "<!-- The contact of MuJoCo's own nearest to a fingertip; made by `fingerpad export`.";

/// Impedance at the width, and the exponent of its growth. A contact with a smaller impedance creeps no less.
const IMPEDANCE: f64 = 0.5;
/// Least impedance that MuJoCo takes.
const LEAST_IMPEDANCE: f64 = 1e-4;
/// Radius of the sphere that touches, m.
const RADIUS_M: f64 = 0.008;
/// Of the option that goes with it.
const IMPRATIO: f64 = 10.0;
/// What such a contact cannot do.
const LACKS: &str = "Such a contact cannot stick: under any load along the face it creeps. It has no partial slip, so no slip margin, and no memory \
                     of where it was loaded. Its friction over the normal force is the same at every load.";

/// Parameters of MuJoCo's contact of one sphere, and its errors against the pad over 0.5 to 1.5 of the load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MujocoContact {
    engine: &'static str,
    /// The load, N, and the depth that it presses the finger, mm.
    pub load_n: f64,
    /// See `load_n`.
    pub depth_mm: f64,
    /// 1 over the mass that moves against the contact: the sum of `body_invweight0` of both bodies, 1/kg.
    pub inverse_mass_per_kg: f64,
    /// `solref`: minus stiffness, 1/s², proportional to the inverse mass, and minus damping, 1/s, proportional to its root.
    pub solref: [f64; 2],
    /// `solimp`: impedance at no depth and at the width; width, m; midpoint and power.
    pub solimp: [f64; 5],
    /// `friction`: sliding, torsional, m, and rolling, m.
    pub friction: [f64; 3],
    /// `condim`.
    pub condim: u32,
    /// Slope of the normal force at the load, N/m, and damping of its depth, N s/m: critical for the mass.
    pub stiffness_n_per_m: f64,
    /// See `stiffness_n_per_m`.
    pub damping_n_s_per_m: f64,
    /// Creep along the face under half of the friction limit, with elliptic cones, impratio 10, without the solver against slip, m/s.
    pub creep_at_half_limit_m_per_s: f64,
    /// Against the pad.
    #[serde(flatten)]
    pub errors: Errors,
    lacks: &'static str,
}

impl MujocoContact {
    /// The nearest contact of a pad in a pose on a plane.
    ///
    /// * `load_n`: normal force, 0.02 N to two thirds of what the pad was fitted for
    /// * `inverse_mass_per_kg`: as the field, 1e-3 to 1e5
    /// * `pose_deg`: pitch and roll
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
        let width_mm = loaded.pads[LOADS - 1].depth_mm;
        let curve = Curve::fit(&loaded, load_n, width_mm);
        let [sliding, torsional_mm] = loaded.coefficients();
        let impedance = curve.impedance(there.depth_mm);
        let stiffness_n_per_m = 1e3 * curve.slope(there.depth_mm);
        let damping_n_s_per_m = critical_damping(stiffness_n_per_m, inverse_mass_per_kg);
        let rate = damping_n_s_per_m * (1.0 - impedance) * inverse_mass_per_kg / impedance * IMPEDANCE;
        Ok(Self {
            engine: "mujoco",
            load_n,
            depth_mm: there.depth_mm,
            inverse_mass_per_kg,
            solref: [-1e3 * curve.scale * inverse_mass_per_kg, -rate],
            solimp: [curve.first, IMPEDANCE, 1e-3 * width_mm, 0.5, 1.0],
            friction: [sliding, 1e-3 * torsional_mm, 1e-4],
            condim: 4,
            stiffness_n_per_m,
            damping_n_s_per_m,
            creep_at_half_limit_m_per_s: CREEP_SHARE * there.friction_n / (damping_n_s_per_m * IMPRATIO),
            errors: loaded.errors(|depth_mm| curve.force(depth_mm), |_, load_n| torsional_mm * load_n),
            lacks: LACKS,
        })
    }

    /// The parameters as a class of geoms in MJCF, with the errors in a comment.
    pub fn mjcf(&self) -> String {
        let words = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(" ");
        let [stiffness, damping] = self.solref;
        format!(
            "{MJCF_HEAD}\n\
             Load {:.4} N at a depth of {:.4} mm; {:.0} N/m and {:.3} N s/m there.\n\
             {}\n\
             Creep under half of the friction limit: {:.3} mm/s with this option.\n\
             {LACKS}\n\
             solref is that of bodies whose body_invweight0 add up to {} 1/kg: its stiffness is proportional to this sum, its damping to the root.\n\
             The class is one sphere: its lowest point lies at the origin of the geom's body, where the undeformed pad touches first. -->\n\
             <mujoco>\n  <option cone=\"elliptic\" impratio=\"{IMPRATIO:.0}\"/>\n  <default>\n    <default class=\"fingertip\">\n      \
             <geom type=\"sphere\" size=\"{RADIUS_M}\" pos=\"0 0 {RADIUS_M}\" priority=\"1\" condim=\"{}\" friction=\"{}\"\n            \
             solref=\"{stiffness:.3} {damping:.3}\" solimp=\"{}\"/>\n    </default>\n  </default>\n</mujoco>\n",
            self.load_n,
            self.depth_mm,
            self.stiffness_n_per_m,
            self.damping_n_s_per_m,
            self.errors.sentence(),
            1e3 * self.creep_at_half_limit_m_per_s,
            self.inverse_mass_per_kg,
            self.condim,
            words(&self.friction),
            words(&self.solimp),
        )
    }

    /// All numbers as JSON.
    pub fn json(&self) -> String {
        json(self)
    }
}

/// MuJoCo's static normal force over depth: scale (d / d_w)² r / (1 − d) with d = first + (d_w − first) r / width.
struct Curve {
    /// N/mm.
    scale: f64,
    first: f64,
    width_mm: f64,
}

impl Curve {
    /// The curve through the load with the least largest error at the other loads.
    fn fit(loaded: &Loaded, load_n: f64, width_mm: f64) -> Self {
        let depth_mm = loaded.there().depth_mm;
        let through = |first: f64| {
            let unit = Self { scale: 1.0, first, width_mm };
            Self { scale: load_n / unit.force(depth_mm), ..unit }
        };
        let worst = |curve: &Self| {
            let error = |(load, pad): (&f64, &AtLoad)| (curve.force(pad.depth_mm) / load - 1.0).abs();
            loaded.loads_n.iter().zip(&loaded.pads).map(error).fold(0.0, f64::max)
        };
        let candidates =
            (0..=1000).map(|k| through(LEAST_IMPEDANCE + (IMPEDANCE - LEAST_IMPEDANCE) * f64::from(k) / 1e3));
        candidates.min_by(|a, b| worst(a).total_cmp(&worst(b))).expect("a thousand curves")
    }

    fn impedance(&self, depth_mm: f64) -> f64 {
        self.first + (IMPEDANCE - self.first) * (depth_mm / self.width_mm).min(1.0)
    }

    fn force(&self, depth_mm: f64) -> f64 {
        let impedance = self.impedance(depth_mm);
        self.scale * (impedance / IMPEDANCE).powi(2) * depth_mm / (1.0 - impedance)
    }

    /// N/mm.
    fn slope(&self, depth_mm: f64) -> f64 {
        let by = 1e-4 * depth_mm;
        (self.force(depth_mm + by) - self.force(depth_mm - by)) / (2.0 * by)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check_through_the_load, with_pad};
    use super::*;

    /// Exact at the load, near around it; stiffness and damping follow the mass.
    #[test]
    fn the_contact_goes_through_the_load() {
        let contact = |load, mass| with_pad(|pad, pose| MujocoContact::of_pad(pad, load, mass, pose).unwrap());
        let load_n = 1.0;
        let found = contact(load_n, 20.0);
        check_through_the_load(&found.errors, load_n, 0.04, Some(0.4));
        let heavy = contact(load_n, 5.0);
        let [stiffness, damping] = [0, 1].map(|k| heavy.solref[k] / found.solref[k]);
        // The damping is critical for the mass: it grows with its root.
        assert!((stiffness - 0.25).abs() < 1e-9 && (damping - 0.5).abs() < 1e-9, "{stiffness} {damping}");
    }
}
