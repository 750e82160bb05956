//! Elastic half-space: contact of a rigid plane with a paraboloid, and displacements far from it.
//!
//! Hertz's contact, the tangential loading of Cattaneo and Mindlin and the point loads of Boussinesq and Cerruti,
//! all as in K. L. Johnson, Contact Mechanics (1985), sections 3.2, 3.6, 4.2 and 7.2.

use std::f64::consts::PI;

use fingerpad_fe::element::gauss_legendre;
use nalgebra::Vector3;

/// Isotropic half-space z >= 0.
#[derive(Clone, Copy, Debug)]
pub struct HalfSpace {
    /// Shear modulus, MPa.
    pub shear_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

/// Hertz's contact of a paraboloid z = r²/(2 R) with a rigid plane, without friction.
#[derive(Clone, Copy, Debug)]
pub struct Hertz {
    /// The body.
    pub half_space: HalfSpace,
    /// Radius of curvature R, mm.
    pub curvature_mm: f64,
    /// Contact radius a, mm.
    pub radius_mm: f64,
}

impl Hertz {
    /// Approach a²/R, mm.
    pub fn approach_mm(&self) -> f64 {
        self.radius_mm * self.radius_mm / self.curvature_mm
    }

    /// E* = 2 G/(1 − nu), MPa.
    fn modulus(&self) -> f64 {
        2.0 * self.half_space.shear_mpa / (1.0 - self.half_space.poisson)
    }

    /// Normal force 4 E* a³/(3 R), N.
    pub fn force_n(&self) -> f64 {
        4.0 / 3.0 * self.modulus() * self.radius_mm.powi(3) / self.curvature_mm
    }

    /// Largest pressure 2 E* a/(pi R), MPa; the pressure is p0 sqrt(1 − r²/a²).
    pub fn peak_mpa(&self) -> f64 {
        2.0 * self.modulus() * self.radius_mm / (PI * self.curvature_mm)
    }
}

/// Tangential loading of a Hertz contact with Coulomb's friction at constant normal force.
///
/// Exact for the tractions along the load; for nu = 0.5 it does not disturb the pressure on a rigid plane.
#[derive(Clone, Copy, Debug)]
pub struct Mindlin {
    /// The contact.
    pub hertz: Hertz,
    /// Coefficient of friction.
    pub mu: f64,
}

impl Mindlin {
    /// Rigid displacement at which the whole contact slips, 3 mu P (2 − nu)/(16 G a), mm.
    pub fn full_slip_mm(&self) -> f64 {
        let HalfSpace { shear_mpa, poisson } = self.hertz.half_space;
        3.0 * self.limit_n() * (2.0 - poisson) / (16.0 * shear_mpa * self.hertz.radius_mm)
    }

    /// mu P, N.
    pub fn limit_n(&self) -> f64 {
        self.mu * self.hertz.force_n()
    }

    /// Tangential force at displacement `s` <= full slip, N: mu P (1 − (1 − s/s_full)^(3/2)).
    pub fn force_n(&self, s: f64) -> f64 {
        self.limit_n() * (1.0 - (1.0 - s / self.full_slip_mm()).max(0.0).powf(1.5))
    }

    /// Radius of the stuck disc at displacement `s`, a sqrt(1 − s/s_full), mm.
    pub fn stick_radius_mm(&self, s: f64) -> f64 {
        self.hertz.radius_mm * (1.0 - s / self.full_slip_mm()).max(0.0).sqrt()
    }
}

/// Point loads on the surface z = 0: place (x, y) and force (x, z).
#[derive(Clone, Debug, Default)]
pub struct PointLoads(Vec<([f64; 2], [f64; 2])>);

impl PointLoads {
    /// Adds tractions `[along x, along z]` (MPa, as functions of r) on the disc of radius `radius_mm`.
    ///
    /// r = radius sin(theta), Gauss-Legendre in theta, even steps around: exact to rounding at some radii away.
    pub fn disc(mut self, radius_mm: f64, traction: impl Fn(f64) -> [f64; 2]) -> Self {
        const AROUND: usize = 32;
        for (t, weight) in gauss_legendre(16) {
            let theta = 0.25 * PI * (t + 1.0);
            let r = radius_mm * theta.sin();
            let area = 0.25 * PI * weight * radius_mm * theta.cos() * r * 2.0 * PI / AROUND as f64;
            let force = traction(r).map(|q| q * area);
            for k in 0..AROUND {
                let (sin, cos) = (2.0 * PI * (k as f64 + 0.5) / AROUND as f64).sin_cos();
                self.0.push(([r * cos, r * sin], force));
            }
        }
        self
    }

    /// Hertz's pressure.
    pub fn hertz(hertz: &Hertz) -> Self {
        let (a, p0) = (hertz.radius_mm, hertz.peak_mpa());
        Self::default().disc(a, |r| [0.0, p0 * (1.0 - (r / a).powi(2)).max(0.0).sqrt()])
    }

    /// Hertz's pressure with the tractions of Cattaneo and Mindlin at displacement `s`.
    pub fn mindlin(mindlin: &Mindlin, s: f64) -> Self {
        let (a, p0) = (mindlin.hertz.radius_mm, mindlin.hertz.peak_mpa());
        let q0 = mindlin.mu * p0;
        let c = mindlin.stick_radius_mm(s);
        let loads = Self::hertz(&mindlin.hertz).disc(a, |r| [q0 * (1.0 - (r / a).powi(2)).max(0.0).sqrt(), 0.0]);
        if c == 0.0 {
            return loads;
        }
        loads.disc(c, |r| [-q0 * c / a * (1.0 - (r / c).powi(2)).max(0.0).sqrt(), 0.0])
    }

    /// Sum of the forces (x, z), N.
    pub fn force_n(&self) -> [f64; 2] {
        self.0.iter().fold([0.0; 2], |sum, (_, f)| [sum[0] + f[0], sum[1] + f[1]])
    }

    /// Displacement at `at`, mm, away from the loads.
    pub fn displacement_mm(&self, body: &HalfSpace, at: Vector3<f64>) -> Vector3<f64> {
        let HalfSpace { shear_mpa, poisson } = *body;
        let k = 1.0 - 2.0 * poisson;
        let mut sum = Vector3::zeros();
        for (place, [fx, fz]) in &self.0 {
            let (x, y, z) = (at.x - place[0], at.y - place[1], at.z);
            let rho = (x * x + y * y + z * z).sqrt();
            let (r3, plus) = (rho.powi(3), rho + z);
            sum += Vector3::new(
                x * z / r3 - k * x / (rho * plus),
                y * z / r3 - k * y / (rho * plus),
                z * z / r3 + 2.0 * (1.0 - poisson) / rho,
            ) * *fz;
            sum += Vector3::new(
                1.0 / rho + x * x / r3 + k * (1.0 / plus - x * x / (rho * plus * plus)),
                x * y / r3 - k * x * y / (rho * plus * plus),
                x * z / r3 + k * x / (rho * plus),
            ) * *fx;
        }
        sum / (4.0 * PI * shear_mpa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: HalfSpace = HalfSpace { shear_mpa: 1.3, poisson: 0.31 };

    fn hertz() -> Hertz {
        Hertz { half_space: BODY, curvature_mm: 400.0, radius_mm: 0.9 }
    }

    /// Divergence of the stress of a displacement field, by differences.
    fn imbalance(field: impl Fn(Vector3<f64>) -> Vector3<f64>, at: Vector3<f64>, h: f64) -> Vector3<f64> {
        let e = |k: usize| Vector3::ith(k, h);
        let second = |i: usize, k: usize, m: usize| {
            if k == m {
                (field(at + e(k))[i] - 2.0 * field(at)[i] + field(at - e(k))[i]) / (h * h)
            } else {
                let (a, b) = (e(k), e(m));
                (field(at + a + b)[i] - field(at + a - b)[i] - field(at - a + b)[i] + field(at - a - b)[i])
                    / (4.0 * h * h)
            }
        };
        Vector3::from_fn(|i, _| {
            let laplace: f64 = (0..3).map(|k| second(i, k, k)).sum();
            let gradient: f64 = (0..3).map(|k| second(k, k, i)).sum();
            laplace + gradient / (1.0 - 2.0 * BODY.poisson)
        })
    }

    #[test]
    fn loads_sum_to_the_forces() {
        let mindlin = Mindlin { hertz: hertz(), mu: 0.4 };
        let s = 0.3 * mindlin.full_slip_mm();
        let [fx, fz] = PointLoads::mindlin(&mindlin, s).force_n();
        assert!((fz / mindlin.hertz.force_n() - 1.0).abs() < 1e-12);
        assert!((fx / mindlin.force_n(s) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn displacements_are_in_equilibrium() {
        let loads = PointLoads::default().disc(1.0, |r| [1.0 + r, 0.7 - 0.2 * r]);
        let field = |p| loads.displacement_mm(&BODY, p);
        for at in [Vector3::new(1.0, 2.0, 1.5), Vector3::new(-2.0, 0.3, 0.8)] {
            let size = field(at).norm() / at.norm_squared();
            assert!(imbalance(field, at, 1e-3).norm() < 1e-4 * size);
        }
    }

    #[test]
    fn surface_of_the_hertz_contact_far_out() {
        // Johnson eq. 3.42a outside the circle.
        let hertz = hertz();
        let (a, r) = (hertz.radius_mm, 3.1);
        let q = (1.0 - BODY.poisson) / BODY.shear_mpa * hertz.peak_mpa() / (4.0 * a);
        let exact = q * ((2.0 * a * a - r * r) * (a / r).asin() + r * a * (1.0 - (a / r).powi(2)).sqrt());
        let ours = PointLoads::hertz(&hertz).displacement_mm(&BODY, Vector3::new(r * 0.6, r * 0.8, 0.0)).z;
        assert!((ours / exact - 1.0).abs() < 1e-9, "{ours} {exact}");
    }
}
