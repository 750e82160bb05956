//! What a model's numbers must satisfy before a step may read them.
//!
//! [`DataOf::check`] is run on parameters and on files alike. Uses model, table, error.

use crate::error::Field;
use crate::table::{Line, Row};
use crate::{DataOf, Error};

fn in_range(what: Field, index: usize, value: f32, low: f32, high: f32) -> Result<(), Error> {
    if value >= low && value <= high { Ok(()) } else { Err(Error::Range { what, index: index as u16, value }) }
}

impl<const M: usize, const N: usize> DataOf<M, N> {
    /// Refuses numbers with which a step could leave its range or a closed path could create energy.
    ///
    /// # Why what passes here is passive
    ///
    /// Free energy E = (L²/R) ½ Σ w_j y_j (u_jx² + u_jy²/rho) with the reference stiffness R <= K of the part of the
    /// contact that holds the forces, and Σ w/y = 1, so that Σ w y u² >= m² (Cauchy–Schwarz). In small steps:
    ///
    /// * slide: with P = Σ w y u² the elastic work is L² (P₁ − P₀)/2K, and dE is at most that because
    ///   (1/R − 1/K) falls like m₀²/m₁² or faster while m grows, and stays while m shrinks. The plastic slip goes
    ///   along u_j: its work is never negative. The same holds when the limits shrink or shift with depth.
    /// * C: F_x C'(d) dd is the work of the slide dC in the first item.
    /// * growth keeps forces, and R grows by `growth_loss` K' so that rho R grows: dE falls by at least
    ///   (F_x²/2K) `growth_loss` K'/K per depth and (F_y²/(2 rho K)) (`growth_loss` K'/K + rho'/rho). G >= 0 adds work;
    ///   G < 0 must not take more than that.
    /// * fall keeps R while R < K, and forces but for the loss: dE falls by (F_x²/R) `fall_loss` K'/K per depth and by
    ///   (F_y²/(rho R)) (`fall_loss` K'/K − ½ rho'/rho); G_x F_x² + G_y F_y² must not give back more, whatever the
    ///   strength. At R = K it keeps displacements and E falls like K.
    ///
    /// In finite steps the work with the force at the end of the step only adds, since N0 grows with depth, and by more
    /// than C' or a G < 0 with the step's friction in place of its start's can take.
    pub fn check(&self) -> Result<(), Error> {
        in_range(Field::DepthMax, 0, self.depth_max, 0.1, 20.0)?;
        let cell = self.depth_max / (N - 1) as f32;
        in_range(Field::DepthMax, 1, self.cells_per_mm * cell, 1.0 - 1e-6, 1.0 + 1e-6)?;
        in_range(Field::DepthMax, 2, 2.0 * self.half_cell / cell, 1.0 - 1e-6, 1.0 + 1e-6)?;
        in_range(Field::TurnSlip, 0, self.turn_slip, 0.0, 1.0)?;
        in_range(Field::DepthLoss, 0, self.growth_loss, 0.0, 1.0)?;
        in_range(Field::DepthLoss, 1, self.fall_loss, 0.0, 0.5)?;
        in_range(Field::AreaTilt, 0, self.area_tilt, -0.5, 0.5)?;
        in_range(Field::BandSlip, 0, self.band_normal_top, 0.0, 20.0)?;
        in_range(Field::BandSlip, 1, self.band_normal_top - self.band_normal_slip, 1.0 - 1e-5, 1.0 + 1e-5)?;
        in_range(Field::BandFriction, 0, self.band_friction_top, 0.0, 10.0)?;
        in_range(Field::BandFriction, 1, self.band_friction_top - self.band_friction_slip, 0.0, 10.0)?;
        in_range(Field::PressureExponent, 0, self.pressure_exponent, -1.0, 2.0)?;
        let (mut strength, mut softness) = (0.0, 0.0);
        for (j, element) in self.elements.iter().enumerate() {
            in_range(Field::YieldPosition, j, element.inverse_yield, 0.1, 20.0)?;
            in_range(Field::StrengthShare, j, element.strength, 0.0, 1.0)?;
            strength += element.strength;
            softness += element.strength * element.inverse_yield;
        }
        // A little below 1: an element's yield function reaches YIELD, and no resultant may exceed its limit.
        in_range(Field::StrengthShare, M, strength, 1.0 - 2e-5, 1.0 - 6e-6)?;
        in_range(Field::YieldPosition, M, softness, 1.0 - 1e-4, 1.0 + 1e-4)?;
        let slip_length = |row: &Row| row.limit.value / row.stiffness.value;
        let (mut shortest, mut longest) = (f32::MAX, 0.0f32);
        for row in &self.rows {
            shortest = shortest.min(slip_length(row));
            longest = longest.max(slip_length(row));
        }
        // A jump from any depth to any other must not overflow.
        in_range(Field::TangentialStiffness, N, longest / shortest, 1.0, 50.0)?;
        for (i, row) in self.rows.iter().enumerate() {
            row.check(i)?;
            let next = self.rows.get(i + 1).unwrap_or(row);
            for (what, now, then) in [
                (Field::NormalForce, &row.normal, &next.normal),
                (Field::ContactArea, &row.area, &next.area),
                (Field::FrictionLimit, &row.limit, &next.limit),
                (Field::TangentialStiffness, &row.stiffness, &next.stiffness),
                (Field::StiffnessRatio, &row.ratio, &next.ratio),
                (Field::NormalShearX, &row.shear_x, &next.shear_x),
                (Field::NormalShearY, &row.shear_y, &next.shear_y),
                (Field::TiltX, &row.tilt, &next.tilt),
                (Field::BandNormal, &row.band_normal, &next.band_normal),
                (Field::PressCoupling, &row.press, &next.press),
            ] {
                let last = i + 1 == N;
                joins(what, i, now, if last { now.value } else { then.value })?;
                if last && now.change != 0.0 {
                    return Err(Error::Range { what, index: i as u16, value: now.change });
                }
            }
            let pressed = row.pressed + 2.0 * row.press.value + row.press.change;
            if i + 1 < N && !((next.pressed - pressed).abs() <= 1e-5 * (N as f32)) {
                return Err(Error::Range { what: Field::PressCoupling, index: i as u16, value: next.pressed });
            }
            if i + 1 < N {
                row.check_shear(i, cell, self.growth_loss, self.fall_loss)?;
                for t in [0.0, 1.0] {
                    if i > 0 || t > 0.0 {
                        row.check_passive(i, t, cell, self.growth_loss)?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// A line must reach the next node's value, up to rounding and never beyond.
fn joins(what: Field, index: usize, line: &Line, next: f32) -> Result<(), Error> {
    let end = line.value + line.change;
    if (end - next).abs() <= 1e-6 * next.abs().max(line.value.abs()) {
        Ok(())
    } else {
        Err(Error::Range { what, index: index as u16, value: line.change })
    }
}

impl Row {
    fn check(&self, i: usize) -> Result<(), Error> {
        let tiny = f32::MIN_POSITIVE;
        in_range(Field::NormalForce, i, self.normal.value, 0.0, 1e3)?;
        in_range(Field::ContactArea, i, self.area.value, 1e-12, 1e4)?;
        in_range(Field::FrictionLimit, i, self.limit.value, 1e-9, 1e3)?;
        in_range(Field::TangentialStiffness, i, self.stiffness.value, 1e-9, 1e3)?;
        in_range(Field::StiffnessRatio, i, self.ratio.value, 0.25, 4.0)?;
        in_range(Field::PressCoupling, i, self.press.value, -1.0, 1.0)?;
        in_range(Field::PressCoupling, i, self.pressed, -4096.0, 4096.0)?;
        in_range(Field::NormalShearX, i, self.shear_x.value, -1e6, 1e6)?;
        in_range(Field::NormalShearY, i, self.shear_y.value, -1e6, 1e6)?;
        in_range(Field::TiltX, i, self.tilt.value, -0.25, 0.25)?;
        in_range(Field::BandNormal, i, self.band_normal.value, 0.0, 1e3)?;
        // Slip length: neither so short nor so long that a step would overflow.
        let slip_length = self.limit.value / self.stiffness.value.max(tiny);
        in_range(Field::TangentialStiffness, i, slip_length, 1e-3, 1e3)?;
        for (what, line) in [
            (Field::NormalForce, &self.normal),
            (Field::ContactArea, &self.area),
            (Field::FrictionLimit, &self.limit),
            (Field::TangentialStiffness, &self.stiffness),
        ] {
            if !(line.change >= 0.0) {
                return Err(Error::NotMonotone { what, index: i as u16 });
            }
        }
        Ok(())
    }

    /// What shear may add to the normal force or take off it anywhere in a cell: that at its ends with the stiffness of
    /// the deeper one.
    fn check_shear(&self, i: usize, cell: f32, growth_loss: f32, fall_loss: f32) -> Result<(), Error> {
        let at = |what, value: f32, limit: f32| {
            if value <= limit { Ok(()) } else { Err(Error::NotPassive { what, index: i as u16, value, limit }) }
        };
        let k = self.stiffness.value + self.stiffness.change;
        let dk = self.stiffness.change / (k * cell);
        let smallest = self.ratio.value.min(self.ratio.value + self.ratio.change);
        let drho = (self.ratio.change / (smallest * cell)).max(0.0);
        let fall = (-self.ratio.change / (smallest * cell)).max(0.0);
        let softest = self.ratio.value.max(self.ratio.value + self.ratio.change);
        for t in [0.0, 1.0] {
            at(Field::NormalShearX, self.shear_x.at(t), fall_loss * dk / k)?;
            at(Field::NormalShearY, self.shear_y.at(t), (fall_loss * dk - 0.5 * drho) / (softest * k))?;
            at(Field::NormalShearX, -self.shear_x.at(t), 0.5 * growth_loss * dk / k)?;
            at(Field::NormalShearY, -self.shear_y.at(t), 0.5 * (growth_loss * dk - fall) / (softest * k))?;
            // Twice G times the largest friction, against the stiffnesses along the normal and the plane.
            let least = self.shear_x.at(t).min(self.shear_y.at(t)).min(0.0);
            let most = 2.6 * least * (self.limit.value + self.limit.change);
            at(Field::NormalShearX, most * most * k * softest.max(1.0), self.normal.change / cell)?;
        }
        Ok(())
    }

    /// The other inequalities of [`DataOf::check`] at one end of a cell.
    fn check_passive(&self, i: usize, t: f32, cell: f32, growth_loss: f32) -> Result<(), Error> {
        let at = |what, value: f32, limit: f32| {
            if value <= limit { Ok(()) } else { Err(Error::NotPassive { what, index: i as u16, value, limit }) }
        };
        let (k, l, rho) = (self.stiffness.at(t), self.limit.at(t), self.ratio.at(t));
        let dk = self.stiffness.change / (k * cell);
        let drho = self.ratio.change / (rho * cell);
        at(Field::StiffnessRatio, -drho, growth_loss * dk)?;
        // The normal force stays positive and its stiffness outweighs the coupling's error in a finite step.
        at(Field::PressCoupling, self.press.at(t).abs() * l * 1.3, self.normal.at(t))?;
        let dpress = self.press.change.abs() / cell;
        at(Field::PressCoupling, dpress * l * 1.3, self.normal.change / cell)
    }
}
