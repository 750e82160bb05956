//! Conditions that a model's numbers must satisfy before a step may read them.
//!
//! [`DataOf::check`] is run on parameters and on files alike. Uses model, table, error.

use crate::build::DataOf;
use crate::error::Field;
use crate::math::Scalar;
use crate::spring::ODD_MAX;
use crate::table::{Line, Parabola, Row};
use crate::{Error, Relaxation};

fn in_range<T: Scalar>(what: Field, index: usize, value: T, low: f32, high: f32) -> Result<(), Error> {
    let value = value.to_f32();
    if value >= low && value <= high { Ok(()) } else { Err(Error::Range { what, index: index as u16, value }) }
}

/// Longest slide at which a spring may start to slip, mm: a slide that is limited to 64 mm still exceeds it at the largest strength.
const RADIUS_MAX_MM: f32 = 10.0;

/// The same with branches, whose fast presses raise the limits: the slope of the force is at least a tenth of that without shear.
const ODD_MAX_RELAXING: f32 = 0.45;

/// Strength factor up to which a model must keep its normal force positive, and with it its energy.
const STRENGTH: f32 = 2.0;

impl<const M: usize, const N: usize, T: Scalar> DataOf<M, N, T> {
    /// Refuses numbers with which a step could leave its range or a closed path could create energy.
    ///
    /// # Why a model that passes is passive
    ///
    /// The contact's energy is U = N0's integral over depth + kx Φ_x + ky Φ_y, Φ_x = Σ k_j φ(u_jx), Φ_y = Σ k_j u_jy²/2, φ the
    /// integral of u − q u², which is convex within the limits, where |q u| < 0.4. N, F and M_z are its derivatives over depth, slide and
    /// angle at fixed anchors; the positions of the springs do not depend on depth. A step first changes depth and slide, then lets springs
    /// slip. It remains to show:
    ///
    /// * slip: anchors move along the friction (`slip_loses_energy` in `spring.rs`); a spring touches with u = 0 and leaves with
    ///   u = 0. Limits that shrink or shift with depth, strength or tuning only make springs slip.
    /// * a finite step takes the forces at its end. The work is then at least U's gain if U is convex along the step: over
    ///   depth alone N0' must outweigh C'' F + kx'' Φ_x + ky'' Φ_y, and over depth and slide together (kx')² Σ k u²/kx and
    ///   the same along y as well. `check_passive` requires it at both ends of every cell, for limits at the nominal strength.
    /// * the normal force stays positive up to twice the nominal strength. Beyond that a step replaces a negative one by 0.
    /// * nodes: kx, ky and C are integrals of straight lines, so that N does not jump there.
    ///
    /// A change of strength does work only through q, which is inversely proportional to the strength: kx Σ k_j u_jx³/3 times the decrease
    /// of q. For an increase of strength it is evaluated at the displacement before the change, for a decrease at the displacement on the
    /// smaller limit. A change of tuning or stiffness at a given displacement does the work of the new energy minus the old one.
    pub fn check(&self) -> Result<(), Error> {
        in_range(Field::DepthMax, 0, self.depth_max, 0.1, 20.0)?;
        let last = T::of((N - 1) as f32);
        let cell = self.depth_max / last;
        in_range(Field::DepthMax, 1, self.cells_per_mm * cell, 1.0 - 1e-6, 1.0 + 1e-6)?;
        in_range(Field::OddStiffness, 0, self.odd, -2.0, 2.0)?;
        in_range(Field::AreaTilt, 0, self.area_tilt, -0.5, 0.5)?;
        for (i, per_n) in self.pressure_centre_per_n.into_iter().enumerate() {
            in_range(Field::PressureCentre, N + i, per_n, -100.0, 100.0)?;
        }
        in_range(Field::SpinCross, 0, self.spin_cross, 0.0, 1.0)?;
        let [touch, change] = self.slip_lead;
        in_range(Field::SlipLead, 0, touch, -1.0, 1.0)?;
        in_range(Field::SlipLead, 1, touch + change * last, -1.0 - 1e-6, 1.0 + 1e-6)?;
        in_range(Field::SpringArm, M, self.gyration, 0.0, 100.0)?;
        for (what, [slip, rate, bend]) in
            [(Field::BandSlip, self.band_normal), (Field::BandFriction, self.band_friction)]
        {
            let [slip, rate, bend] = [slip, rate, bend].map(Scalar::to_f32);
            in_range(what, 0, slip, 0.0, 20.0)?;
            in_range(what, 1, slip + rate + bend, 0.0, 20.0)?;
            in_range(what, 2, bend.abs(), 0.0, 200.0)?;
            let lowest = (-0.5 * rate / bend).clamp(0.0, 1.0);
            if bend != 0.0 {
                in_range(what, 3, slip + lowest * (rate + lowest * bend), 0.0, 100.0)?;
            }
        }
        in_range(Field::PressureExponent, 0, self.pressure_exponent, -1.0, 2.0)?;
        let [pitch, roll] = self.pose_deg;
        in_range(Field::Pose, 0, pitch, 10.0, 70.0)?;
        in_range(Field::Pose, 1, roll, -30.0, 30.0)?;
        let mut stiffness = T::of(0.0);
        for (j, spring) in self.springs.iter().enumerate() {
            in_range(Field::StiffnessShare, j, spring.stiffness, 0.0, 1.0)?;
            in_range(Field::Sharpness, j, spring.sharpness, 0.0, 1.0)?;
            for length in [spring.centre_mm, spring.arm_mm[0], spring.arm_mm[1]] {
                in_range(Field::SpringArm, j, length, -100.0, 100.0)?;
            }
            stiffness += spring.stiffness;
        }
        in_range(Field::StiffnessShare, M, stiffness, 1.0 - 1e-5, 1.0 + 1e-5)?;
        for (i, row) in self.rows.iter().enumerate() {
            row.check(i)?;
            for radius in &row.radius {
                in_range(Field::OddStiffness, i + 1, T::of(1.29) * radius.value * self.odd.magnitude(), 0.0, ODD_MAX)?;
            }
            let next = self.rows.get(i + 1);
            row.check_joins(i, next)?;
            if next.is_some() {
                for t in [0.0, 1.0] {
                    if i > 0 || t > 0.0 {
                        self.check_passive(row, i, T::of(t), cell)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Refuses numbers with which tissue of these branches could create energy.
    ///
    /// The pressure of a fast press is up to s = 1 + the sum of the shares times that of relaxed tissue, and the limits up to s to the power of the
    /// exponent. The inequalities of [`DataOf::check`] keep their order for exponents up to 1: normal force and stiffness grow by s.
    pub(crate) fn check_relaxation(&self, relaxation: &Relaxation<T>) -> Result<(), Error> {
        in_range(Field::PressureExponent, 0, self.pressure_exponent, 0.0, 1.0)?;
        let stiff = relaxation.branches().iter().fold(T::of(1.0), |sum, branch| sum + branch.share);
        let strength = stiff.power(self.pressure_exponent);
        for (i, row) in self.rows.iter().enumerate() {
            for radius in &row.radius {
                let odd = T::of(1.29) * radius.value * strength * self.odd.magnitude();
                in_range(Field::OddStiffness, i + 1, odd, 0.0, ODD_MAX_RELAXING)?;
            }
        }
        Ok(())
    }

    /// The inequalities of [`DataOf::check`] at one end of a cell.
    fn check_passive(&self, row: &Row<M, T>, i: usize, t: T, cell: T) -> Result<(), Error> {
        let at = |what, value: T, limit: T| {
            let (value, limit) = (value.to_f32(), limit.to_f32());
            if value <= limit { Ok(()) } else { Err(Error::NotPassive { what, index: i as u16, value, limit }) }
        };
        let half = T::of(0.5);
        // A tilted limit reaches 1.28 radii along x; along y it is stretched by the anisotropy.
        let (mut square_x, mut square_y) = (T::of(0.0), T::of(0.0));
        for (spring, radius) in self.springs.iter().zip(&row.radius) {
            let radius = radius.at(t);
            square_x += T::of(1.64) * spring.stiffness * radius * radius;
            square_y += spring.stiffness * radius * radius;
        }
        let anisotropy = row.anisotropy.at(t);
        square_y = square_y * T::of(1.07) / (anisotropy * anisotropy);
        let friction = T::of(1.3) * row.limit.at(t);
        let per = T::of(1.0) / cell;
        let [(kx, dkx, ddkx), (ky, dky, ddky)] =
            [&row.stiffness_x, &row.stiffness_y].map(|k| (k.at(t), k.slope_at(t) * per, (k.bend + k.bend) * per * per));
        let press = row.press_slide;
        let (coupling, bend) = (press.slope_at(t) * per, (press.bend + press.bend) * per * per);
        let normal = row.normal.at(t);
        let coupled = coupling.magnitude() * friction;
        at(Field::PressCoupling, coupled, normal)?;
        let taken = half * ((-dkx).not_negative() * square_x + (-dky).not_negative() * square_y);
        let strong = T::of(STRENGTH);
        at(Field::StiffnessSlope, strong * (coupled + strong * taken), normal)?;
        let rises = row.normal.change * per;
        let bent = bend.magnitude() * friction;
        at(Field::PressCoupling, bent, rises)?;
        let bent = bent + half * (ddkx.magnitude() * square_x + ddky.magnitude() * square_y);
        let crossed = dkx * dkx * square_x / kx + dky * dky * square_y / ky;
        at(Field::StiffnessSlope, bent + crossed, rises)
    }
}

/// A curve must reach the next node's value, up to rounding.
fn joins<T: Scalar>(what: Field, index: usize, end: T, next: T, scale: T) -> Result<(), Error> {
    let (end, next, scale) = (end.to_f32(), next.to_f32(), scale.to_f32().abs());
    if (end - next).abs() <= 4e-6 * next.abs().max(scale) + 1e-9 {
        Ok(())
    } else {
        Err(Error::Range { what, index: index as u16, value: end })
    }
}

impl<const M: usize, T: Scalar> Row<M, T> {
    /// Its lines, by name.
    fn lines(&self) -> impl Iterator<Item = (Field, &Line<T>)> {
        let named = [
            (Field::NormalForce, &self.normal),
            (Field::ContactArea, &self.area),
            (Field::StrengthRatio, &self.anisotropy),
            (Field::TiltX, &self.yield_shift),
            (Field::FrictionLimit, &self.limit),
            (Field::StrengthRatio, &self.limit_ratio),
            (Field::TiltX, &self.limit_shift),
            (Field::SpinLimit, &self.spin_limit),
            (Field::SpringArm, &self.friction_centre),
            (Field::PressureCentre, &self.pressure_centre),
            (Field::BandNormal, &self.band_normal),
        ];
        let springs = self.radius.iter().map(|l| (Field::YieldSlide, l));
        named.into_iter().chain(springs).chain(self.area_share.iter().map(|l| (Field::AreaShare, l)))
    }

    fn parabolas(&self) -> [(Field, &Parabola<T>); 3] {
        [
            (Field::StiffnessSlope, &self.stiffness_x),
            (Field::StiffnessSlope, &self.stiffness_y),
            (Field::PressCoupling, &self.press_slide),
        ]
    }

    /// Continuity with the next row; the last row is flat.
    fn check_joins(&self, i: usize, next: Option<&Self>) -> Result<(), Error> {
        let zero = T::of(0.0);
        let one = T::of(1.0);
        let Some(next) = next else {
            for (what, line) in self.lines() {
                if line.change != zero {
                    return Err(Error::Range { what, index: i as u16, value: line.change.to_f32() });
                }
            }
            for (what, p) in self.parabolas() {
                if p.slope != zero || p.bend != zero {
                    return Err(Error::Range { what, index: i as u16, value: p.slope.to_f32() });
                }
            }
            return Ok(());
        };
        for ((what, line), (_, then)) in self.lines().zip(next.lines()) {
            joins(what, i, line.value + line.change, then.value, line.value)?;
        }
        for ((what, p), (_, then)) in self.parabolas().into_iter().zip(next.parabolas()) {
            joins(what, i, p.at(one), then.value, p.value)?;
        }
        Ok(())
    }

    fn check(&self, i: usize) -> Result<(), Error> {
        in_range(Field::NormalForce, i, self.normal.value, 0.0, 1e3)?;
        in_range(Field::ContactArea, i, self.area.value, 1e-12, 1e4)?;
        in_range(Field::FrictionLimit, i, self.limit.value, 1e-12, 1e3)?;
        for end in [0.0, 1.0].map(T::of) {
            let (kx, ky) = (self.stiffness_x.at(end), self.stiffness_y.at(end));
            in_range(Field::TangentialStiffness, i, kx, 1e-6, 1e3)?;
            in_range(Field::StiffnessRatio, i, ky / kx, 0.25, 4.0)?;
            in_range(Field::StrengthRatio, i, ky / (kx * self.anisotropy.at(end)), 0.5 - 1e-4, 2.0 + 1e-4)?;
        }
        in_range(Field::StrengthRatio, i, self.limit_ratio.value, 0.25, 4.0)?;
        in_range(Field::TiltX, i, self.yield_shift.value, -0.25, 0.25)?;
        in_range(Field::TiltX, i, self.limit_shift.value, -1.0, 1.0)?;
        in_range(Field::PressCoupling, i, self.press_slide.slope, -20.0, 20.0)?;
        in_range(Field::PressCoupling, i, self.press_slide.value, -20.0, 20.0)?;
        in_range(Field::SpinLimit, i, self.spin_limit.value, 0.0, 1e6)?;
        in_range(Field::SpringArm, i, self.friction_centre.value, -100.0, 100.0)?;
        in_range(Field::PressureCentre, i, self.pressure_centre.value, -100.0, 100.0)?;
        in_range(Field::BandNormal, i, self.band_normal.value, 0.0, 1e3)?;
        let mut shares = T::of(0.0);
        for (j, (radius, share)) in self.radius.iter().zip(&self.area_share).enumerate() {
            in_range(Field::YieldSlide, j, radius.value, 0.0, RADIUS_MAX_MM)?;
            in_range(Field::AreaShare, j, share.value, 0.0, 1.0)?;
            shares += share.value;
            if !(radius.change >= T::of(0.0)) {
                return Err(Error::NotMonotone { what: Field::YieldSlide, index: i as u16 });
            }
        }
        in_range(Field::AreaShare, M, shares, 1.0 - 1e-5, 1.0 + 1e-5)?;
        for (what, line) in [(Field::NormalForce, &self.normal), (Field::ContactArea, &self.area)] {
            if !(line.change >= T::of(0.0)) {
                return Err(Error::NotMonotone { what, index: i as u16 });
            }
        }
        Ok(())
    }
}
