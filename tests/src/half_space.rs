//! Elastic half-space: contact of a rigid plane with a paraboloid, and displacements far from it.
//!
//! Hertz's contact, the tangential loading of Cattaneo and Mindlin with its unloading and reloading, torsion, and the
//! point loads of Boussinesq and Cerruti, as in K. L. Johnson, Contact Mechanics (1985), sections 3.2, 3.6, 3.9, 4.2, 7.2
//! and 7.3.

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

    /// Tractions after a tangential displacement to each of `turns` in turn (mm, the last is the present one), each
    /// swing within the one before: discs of radius c (mm) with weights w, traction `w mu p0 sqrt(c² - r²)/a` along x
    /// in each.
    ///
    /// The first swing is Cattaneo's; every later one is one of twice the strength, over what was there [Mindlin &
    /// Deresiewicz 1953].
    fn discs(&self, turns: &[f64]) -> Vec<[f64; 2]> {
        let a = self.hertz.radius_mm;
        let mut from = 0.0;
        let mut discs = Vec::new();
        for (k, &to) in turns.iter().enumerate() {
            let strength = if k == 0 { 1.0 } else { 2.0 };
            let weight = f64::copysign(strength, to - from);
            discs.extend([[a, weight], [self.swing_radius_mm(to - from, strength), -weight]]);
            from = to;
        }
        discs
    }

    /// Radius of the zone that sticks throughout a swing of this length, mm.
    fn swing_radius_mm(&self, swing_mm: f64, strength: f64) -> f64 {
        self.hertz.radius_mm * (1.0 - swing_mm.abs() / (strength * self.full_slip_mm())).max(0.0).sqrt()
    }

    /// Tangential force after `turns`, N: mu P (1 - (1 - s/s_full)^(3/2)) on first loading.
    pub fn force_n(&self, turns: &[f64]) -> f64 {
        let cube = |[c, weight]: [f64; 2]| weight * (c / self.hertz.radius_mm).powi(3);
        self.limit_n() * self.discs(turns).into_iter().map(cube).sum::<f64>()
    }

    /// Radius of the stuck disc after `turns`, mm: a sqrt(1 - s/s_full) on first loading.
    pub fn stick_radius_mm(&self, turns: &[f64]) -> f64 {
        self.discs(turns).last().map_or(self.hertz.radius_mm, |disc| disc[0])
    }
}

/// Torsion of a Hertz contact with Coulomb's friction [Lubkin 1951].
///
/// With `q_t(r) = 4 G r/(pi sqrt(t² - r²))` the traction that turns the disc of radius t rigidly by one radian
/// [Reissner & Sagoci 1944], q is the sum of q_t with weights phi(t) dt. The stick zone turns rigidly, so that phi = 0
/// within it; outside q = mu p, which Abel's equation turns into `phi(t) = mu p0 E(k)/(2 G t)`, `k² = 1 - t²/a²` [after
/// Jaeger 1995].
#[derive(Clone, Copy, Debug)]
pub struct Torsion {
    /// The contact.
    pub hertz: Hertz,
    /// Coefficient of friction.
    pub mu: f64,
}

impl Torsion {
    /// Turn per radius of the discs, rad/mm.
    fn density(&self, t: f64) -> f64 {
        let k2 = (1.0 - (t / self.hertz.radius_mm).powi(2)).max(0.0);
        self.mu * self.hertz.peak_mpa() * elliptic(k2).1 / (2.0 * self.hertz.half_space.shear_mpa * t)
    }

    /// Radii of discs from `stick_mm` to a, mm, and the turns that they take, rad.
    fn discs(&self, stick_mm: f64) -> Vec<[f64; 2]> {
        let (low, high) = (stick_mm.ln(), self.hertz.radius_mm.ln());
        let disc = |(x, weight): (f64, f64)| {
            let t = (0.5 * (low + high) + 0.5 * (high - low) * x).exp();
            [t, 0.5 * (high - low) * weight * t * self.density(t)]
        };
        gauss_legendre(12).into_iter().map(disc).collect()
    }

    /// Turn of the plane at which a disc of radius `stick_mm` still sticks, rad: mu p0 (K - E)/(2 G).
    pub fn spin_rad(&self, stick_mm: f64) -> f64 {
        let (k, e) = elliptic(1.0 - (stick_mm / self.hertz.radius_mm).powi(2));
        self.mu * self.hertz.peak_mpa() / (2.0 * self.hertz.half_space.shear_mpa) * (k - e)
    }

    /// Moment then, N mm: each disc carries 16 G t³/3 times its turn.
    pub fn moment_nmm(&self, stick_mm: f64) -> f64 {
        let of_disc = |[t, turn]: [f64; 2]| 16.0 / 3.0 * self.hertz.half_space.shear_mpa * t.powi(3) * turn;
        self.discs(stick_mm).into_iter().map(of_disc).sum()
    }

    /// Moment in full slip, 3 pi mu P a/16, N mm.
    pub fn limit_nmm(&self) -> f64 {
        3.0 * PI / 16.0 * self.mu * self.hertz.force_n() * self.hertz.radius_mm
    }
}

/// Complete elliptic integrals K and E of the parameter k² < 1, by the arithmetic-geometric mean.
fn elliptic(k2: f64) -> (f64, f64) {
    let (mut a, mut b, mut c2, mut power, mut sum) = (1.0f64, (1.0 - k2).sqrt(), k2, 0.5, 0.0);
    while c2 > 1e-32 {
        sum += power * c2;
        (a, b, c2, power) = (0.5 * (a + b), (a * b).sqrt(), (0.5 * (a - b)).powi(2), 2.0 * power);
    }
    let k = PI / (2.0 * a);
    (k, k * (1.0 - sum))
}

/// Point loads on the surface z = 0: place (x, y), mm, and force, N.
#[derive(Clone, Debug, Default)]
pub struct PointLoads(Vec<([f64; 2], Vector3<f64>)>);

impl PointLoads {
    /// Adds tractions `[along x, around, along z]` (MPa, as functions of r) on the disc of radius `radius_mm`.
    ///
    /// r = radius sin(theta), Gauss-Legendre in theta, even steps around: exact to rounding at some radii away.
    pub fn disc(mut self, radius_mm: f64, traction: impl Fn(f64) -> [f64; 3]) -> Self {
        const AROUND: usize = 32;
        for (t, weight) in gauss_legendre(16) {
            let theta = 0.25 * PI * (t + 1.0);
            let r = radius_mm * theta.sin();
            let area = 0.25 * PI * weight * radius_mm * theta.cos() * r * 2.0 * PI / AROUND as f64;
            let [along, around, normal] = traction(r).map(|q| q * area);
            for k in 0..AROUND {
                let (sin, cos) = (2.0 * PI * (k as f64 + 0.5) / AROUND as f64).sin_cos();
                self.0.push(([r * cos, r * sin], Vector3::new(along - around * sin, around * cos, normal)));
            }
        }
        self
    }

    /// Hertz's pressure.
    pub fn hertz(hertz: &Hertz) -> Self {
        let (a, p0) = (hertz.radius_mm, hertz.peak_mpa());
        Self::default().disc(a, |r| [0.0, 0.0, p0 * (1.0 - (r / a).powi(2)).max(0.0).sqrt()])
    }

    /// Hertz's pressure with the tractions along x after the tangential displacements `turns`.
    pub fn mindlin(mindlin: &Mindlin, turns: &[f64]) -> Self {
        let q0 = mindlin.mu * mindlin.hertz.peak_mpa() / mindlin.hertz.radius_mm;
        let discs = mindlin.discs(turns).into_iter().filter(|[c, _]| *c > 0.0);
        discs.fold(Self::hertz(&mindlin.hertz), |loads, [c, weight]| {
            loads.disc(c, |r| [weight * q0 * (c * c - r * r).max(0.0).sqrt(), 0.0, 0.0])
        })
    }

    /// Hertz's pressure with the tractions of a turn at which a disc of radius `stick_mm` sticks.
    pub fn torsion(torsion: &Torsion, stick_mm: f64) -> Self {
        let shear = torsion.hertz.half_space.shear_mpa;
        torsion.discs(stick_mm).into_iter().fold(Self::hertz(&torsion.hertz), |loads, [t, turn]| {
            loads.disc(t, |r| [0.0, 4.0 / PI * shear * turn * r / (t * t - r * r).sqrt(), 0.0])
        })
    }

    /// Sum of the forces, N.
    pub fn force_n(&self) -> Vector3<f64> {
        self.0.iter().map(|(_, force)| force).sum()
    }

    /// Moment about the z axis, N mm.
    pub fn moment_nmm(&self) -> f64 {
        self.0.iter().map(|([x, y], force)| x * force.y - y * force.x).sum()
    }

    /// Displacement of the half-space at `at`, mm, under the loads.
    pub fn displacement_mm(&self, body: &HalfSpace, at: Vector3<f64>) -> Vector3<f64> {
        let HalfSpace { shear_mpa, poisson } = *body;
        let k = 1.0 - 2.0 * poisson;
        let mut sum = Vector3::zeros();
        for (place, force) in &self.0 {
            let (x, y, z) = (at.x - place[0], at.y - place[1], at.z);
            let rho = (x * x + y * y + z * z).sqrt();
            let (r3, plus) = (rho.powi(3), rho + z);
            sum += Vector3::new(
                x * z / r3 - k * x / (rho * plus),
                y * z / r3 - k * y / (rho * plus),
                z * z / r3 + 2.0 * (1.0 - poisson) / rho,
            ) * force.z;
            // Cerruti's solution along x and, with x and y exchanged, along y.
            let along = |s: f64| 1.0 / rho + s * s / r3 + k * (1.0 / plus - s * s / (rho * plus * plus));
            let across = x * y / r3 - k * x * y / (rho * plus * plus);
            let down = |s: f64| s * z / r3 + k * s / (rho * plus);
            sum += Vector3::new(along(x), across, down(x)) * force.x;
            sum += Vector3::new(across, along(y), down(y)) * force.y;
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
        let full = mindlin.full_slip_mm();
        for turns in [vec![0.3 * full], vec![0.8 * full, -0.5 * full, 0.1 * full]] {
            let force = PointLoads::mindlin(&mindlin, &turns).force_n();
            assert!((force.z / mindlin.hertz.force_n() - 1.0).abs() < 1e-12);
            assert!((force.x / mindlin.force_n(&turns) - 1.0).abs() < 1e-12 && force.y.abs() < 1e-15);
        }
        let torsion = Torsion { hertz: hertz(), mu: 0.4 };
        for stick in [0.8, 0.3] {
            let loads = PointLoads::torsion(&torsion, stick);
            assert!((loads.moment_nmm() / torsion.moment_nmm(stick) - 1.0).abs() < 1e-12);
            assert!(loads.force_n().xy().norm() < 1e-12);
        }
    }

    #[test]
    fn displacements_are_in_equilibrium() {
        let loads = PointLoads::default().disc(1.0, |r| [1.0 + r, 0.3, 0.7 - 0.2 * r]);
        let field = |p| loads.displacement_mm(&BODY, p);
        for at in [Vector3::new(1.0, 2.0, 1.5), Vector3::new(-2.0, 0.3, 0.8)] {
            let size = field(at).norm() / at.norm_squared();
            assert!(imbalance(field, at, 1e-3).norm() < 1e-4 * size);
        }
    }

    #[test]
    fn a_swing_there_and_back_to_full_slip_closes_the_loop() {
        let mindlin = Mindlin { hertz: hertz(), mu: 0.4 };
        let full = mindlin.full_slip_mm();
        for peak in [0.3 * full, 0.8 * full] {
            // Back to the other side, force and stick radius are those of first loading.
            let force = mindlin.force_n(&[peak]);
            assert!((mindlin.force_n(&[peak, -peak]) / force + 1.0).abs() < 1e-12);
            assert!((mindlin.stick_radius_mm(&[peak, -peak]) / mindlin.stick_radius_mm(&[peak]) - 1.0).abs() < 1e-12);
            assert!((mindlin.force_n(&[peak, -peak, peak]) / force - 1.0).abs() < 1e-12);
            // Just after a turn everything sticks again, with the stiffness 8 G a/(2 - nu).
            let step = 1e-6 * full;
            let stiffness = (force - mindlin.force_n(&[peak, peak - step])) / step;
            assert!((stiffness / (8.0 * 1.3 * 0.9 / (2.0 - 0.31)) - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn torsion_has_the_limits_of_small_and_of_full_spin_and_moves_what_sticks_rigidly() {
        let torsion = Torsion { hertz: hertz(), mu: 0.4 };
        let a = torsion.hertz.radius_mm;
        let full = torsion.moment_nmm(1e-6 * a) / torsion.limit_nmm() - 1.0;
        assert!(full.abs() < 2e-4, "the discs' quadrature: {full:e}");
        let small = 0.9999 * a;
        let rigid = 16.0 / 3.0 * BODY.shear_mpa * a.powi(3) * torsion.spin_rad(small);
        assert!((torsion.moment_nmm(small) / rigid - 1.0).abs() < 1e-3);
        let sum: f64 = torsion.discs(0.4 * a).iter().map(|d| d[1]).sum();
        assert!((sum / torsion.spin_rad(0.4 * a) - 1.0).abs() < 1e-9);
        // Outside a disc that turns rigidly by one radian: (2/pi) (r asin(t/r) - t sqrt(1 - t²/r²)).
        let (t, r) = (0.7, 2.5);
        let disc =
            PointLoads::default().disc(t, |r| [0.0, 4.0 / PI * BODY.shear_mpa * r / (t * t - r * r).sqrt(), 0.0]);
        let exact = 2.0 / PI * (r * f64::asin(t / r) - t * (1.0 - (t / r) * (t / r)).sqrt());
        let ours = disc.displacement_mm(&BODY, Vector3::new(0.0, r, 0.0));
        assert!((ours.x / -exact - 1.0).abs() < 1e-9 && ours.yz().norm() < 1e-9, "{ours} {exact}");
        // The traction in the slip annulus is mu p.
        let (stick, at) = (0.4 * a, 0.7 * a);
        let sum = |n: usize| -> f64 {
            // t = at cosh(u) removes the singularity of dt/sqrt(t² - r²).
            let end = (a / at).acosh();
            let step = end / n as f64;
            let q = |u: f64| 4.0 / PI * BODY.shear_mpa * at * torsion.density(at * u.cosh());
            (0..n).map(|k| q((k as f64 + 0.5) * step) * step).sum()
        };
        let exact = 0.4 * torsion.hertz.peak_mpa() * (1.0 - (at / a).powi(2)).sqrt();
        assert!(stick < at && (sum(4000) / exact - 1.0).abs() < 1e-6);
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
