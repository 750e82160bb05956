//! The contact of a physics engine's own that comes nearest to a pad at a load.
//!
//! Main type: [`MujocoContact`]. Uses limit_surface for the pad's limits.
//!
//! MuJoCo's static normal force at a penetration r is s d(r)² r / (d_w² (1 − d(r)) A), with the stiffness s of `solref`, the impedance d of `solimp`,
//! which goes from d_0 at r = 0 to d_w at the width w, and the inverse mass A of both bodies (`body_invweight0`). It stiffens with depth as d grows.
//! The fit takes d_w = 0.5 and w from the pad, s such that the force at the load is the pad's, and d_0 such that the error around the load is least.

use serde::Serialize;

use fingerpad::pad::Pad;

use crate::limit_surface::{LimitPoint, LimitSurfaceError, limit_points_of_pad};

/// First lines of the files, by which they are recognised.
pub const MJCF_HEAD: &str = "<!-- The contact of MuJoCo's own nearest to a fingertip; made by `fingerpad export`.";
/// See [`MJCF_HEAD`].
pub const JSON_HEAD: &str = "{\n  \"engine\": \"mujoco\"";

/// Impedance at the width, and the exponent of its growth. A contact with a smaller impedance creeps no less.
const IMPEDANCE: f64 = 0.5;
/// The loads around the given one over which errors count, over it.
const AROUND: [f64; 2] = [0.5, 1.5];
/// Loads between these ends.
const LOADS: usize = 11;
/// Least impedance that MuJoCo takes.
const LEAST_IMPEDANCE: f64 = 1e-4;
/// Radius of the sphere that touches, m.
const RADIUS_M: f64 = 0.008;
/// Of the option that goes with it.
const IMPRATIO: f64 = 10.0;
/// Share of the friction limit for which the creep is stated.
const CREEP_SHARE: f64 = 0.5;
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
    lacks: &'static str,
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
        let there = &pads[LOADS / 2];
        let width_mm = pads[LOADS - 1].depth_mm;
        let curve = Curve::fit(&loads_n, &pads, load_n, there.depth_mm, width_mm);
        let errors = |contact: &dyn Fn(usize) -> f64, pad: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..LOADS).map(|k| contact(k) / pad(k) - 1.0).collect()
        };
        let [sliding, torsional_mm] = [there.friction_n / load_n, there.moment_n_mm / load_n];
        let impedance = curve.impedance(there.depth_mm);
        let stiffness_n_per_m = 1e3 * curve.slope(there.depth_mm);
        let damping_n_s_per_m = 2.0 * (stiffness_n_per_m / inverse_mass_per_kg).sqrt();
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
            depths_mm: pads.iter().map(|pad| pad.depth_mm).collect(),
            normal_force_errors: errors(&|k| curve.force(pads[k].depth_mm), &|k| loads_n[k]),
            friction_limits_n: pads.iter().map(|pad| pad.friction_n).collect(),
            friction_limit_errors: errors(&|k| sliding * loads_n[k], &|k| pads[k].friction_n),
            torsional_limits_n_mm: pads.iter().map(|pad| pad.moment_n_mm).collect(),
            torsional_limit_errors: errors(&|k| torsional_mm * loads_n[k], &|k| pads[k].moment_n_mm),
            loads_n,
            lacks: LACKS,
        })
    }

    /// The parameters as a class of geoms in MJCF, with the errors in a comment.
    pub fn mjcf(&self) -> String {
        let words = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(" ");
        let percent = |errors: &[f64]| 100.0 * errors.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let [stiffness, damping] = self.solref;
        format!(
            "{MJCF_HEAD}\n\
             Load {:.4} N at a depth of {:.4} mm; {:.0} N/m and {:.3} N s/m there.\n\
             Largest error against the pad from {:.4} to {:.4} N: normal force {:.1} %, friction limit {:.1} %, torsional limit {:.1} %.\n\
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
            self.loads_n[0],
            self.loads_n[LOADS - 1],
            percent(&self.normal_force_errors),
            percent(&self.friction_limit_errors),
            percent(&self.torsional_limit_errors),
            1e3 * self.creep_at_half_limit_m_per_s,
            self.inverse_mass_per_kg,
            self.condim,
            words(&self.friction),
            words(&self.solimp),
        )
    }

    /// All numbers as JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain numbers") + "\n"
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
    fn fit(loads_n: &[f64], pads: &[AtLoad], load_n: f64, depth_mm: f64, width_mm: f64) -> Self {
        let through = |first: f64| {
            let unit = Self { scale: 1.0, first, width_mm };
            Self { scale: load_n / unit.force(depth_mm), ..unit }
        };
        let worst = |curve: &Self| {
            loads_n
                .iter()
                .zip(pads)
                .map(|(load, pad)| (curve.force(pad.depth_mm) / load - 1.0).abs())
                .fold(0.0, f64::max)
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

    fn contact(load_n: f64, inverse_mass_per_kg: f64) -> Result<MujocoContact, EngineContactError> {
        let file = PadModelFile::new(include_bytes!("../data/models/fingertip-pad.fpm")).unwrap();
        MujocoContact::of_pad(&file.file().pad, load_n, inverse_mass_per_kg, [30.0, 0.0])
    }

    /// Exact at the load, near around it; stiffness and damping follow the mass.
    #[test]
    fn the_contact_goes_through_the_load() {
        for load_n in [0.2, 1.0, 3.0] {
            let found = contact(load_n, 20.0).unwrap();
            let middle = LOADS / 2;
            assert!((found.loads_n[middle] - load_n).abs() < 1e-9);
            for errors in [&found.normal_force_errors, &found.friction_limit_errors, &found.torsional_limit_errors] {
                assert!(errors[middle].abs() < 1e-3 && errors.iter().all(|error| error.abs() < 0.4), "{errors:?}");
            }
            assert!(
                found.normal_force_errors.iter().all(|error| error.abs() < 0.04),
                "{:?}",
                found.normal_force_errors
            );
            let heavy = contact(load_n, 5.0).unwrap();
            let [stiffness, damping] = [0, 1].map(|k| heavy.solref[k] / found.solref[k]);
            // The damping is critical for the mass: it grows with its root.
            assert!((stiffness - 0.25).abs() < 1e-9 && (damping - 0.5).abs() < 1e-9, "{stiffness} {damping}");
        }
    }

    #[test]
    fn ranges_are_named() {
        let refused = |load: f64, mass: f64| contact(load, mass).unwrap_err().to_string();
        assert!(
            refused(9.0, 20.0).starts_with("load in N 9: the allowed range is 0.02 to 4.3"),
            "{}",
            refused(9.0, 20.0)
        );
        assert!(refused(f64::NAN, 20.0).starts_with("load in N NaN"));
        assert!(refused(1.0, 0.0).starts_with("inverse mass in 1/kg 0: the allowed range is 0.001 to 100000"));
    }
}
