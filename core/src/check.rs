//! What a model's numbers must satisfy before a step may read them.
//!
//! [`DataOf::check`] is run on parameters and on files alike. Uses model, table, error.

use crate::error::Field;
use crate::table::{Line, Row};
use crate::{DataOf, Error};

fn in_range(what: Field, index: usize, value: f32, low: f32, high: f32) -> Result<(), Error> {
    if value >= low && value <= high { Ok(()) } else { Err(Error::Range { what, index: index as u16, value }) }
}

/// Largest ratio of the slip lengths (friction limit over tangential stiffness) at two table nodes that a model may have.
pub const SLIP_LENGTH_RATIO_MAX: f32 = 50.0;

/// Largest odd part of the elastic displacement at the limit, slip lengths: a slide along x stiffens or softens by less
/// than 1.3 times 2 of these.
const ODD_MAX: f32 = 0.25;

impl<const M: usize, const N: usize> DataOf<M, N> {
    /// Refuses numbers with which a step could leave its range or a closed path could create energy.
    ///
    /// # Why what passes here is passive
    ///
    /// Energy E = (P_x + P_y)/2K + 2/3 q F_x³ + H/2 with P_x = L² Σ w y u_x², P_y = (s²L²/rho) Σ w y u_y² and H >= 0, which is
    /// what the contact holds beyond its elements. E is 0 in the air and never negative, since Σ w y u² >= m² by
    /// Cauchy–Schwarz (Σ w/y = 1) and |q| K F_x <= 0.33, which is checked. In each step the plane's work is at least what E
    /// gains:
    ///
    /// * growth at given forces: H takes what P/K loses, so that E stays; q is one number for all depths.
    /// * shrinking by dK < 0 to K' = r K: elements keep their displacement, which takes (1 − r) P/2K off, and move on by a
    ///   slide b = lag |dK|/K' without the plane, which adds r F·b + K' b²/2 at most. With P >= F² what is missing is at most
    ///   |dK| lag²/2r; that is taken from H/2, and where H is less, the slide is less in proportion, so that its square
    ///   suffices.
    /// * N = ... + G P on a change of depth dd: forces times 1 + g, g = G K dd, add (2g + g²) P/2K to E. The work of that
    ///   part of N at the step's end is (1 + g)² G P dd, more by (3/2 g² + g³) P/K, and |g| < 1/2 is checked.
    /// * slide: elements that stick gain L² Σ w u du y = F · dx K/K, a quadratic, whose end value times the increment is
    ///   more than its gain; what else moves the elements in the same step adds at most what it would alone. The odd
    ///   compliance lies in series with all of this and is solved for its end. The return to the yield surface is slip along the
    ///   friction and loses energy. Limits that shrink or shift with depth return to the yield surface in the same way.
    /// * C: F_x C'(d) dd is the work of the slide dC. In a finite step C' at its end is off by C'' dd, and N₀, which grows
    ///   with depth, is checked to outweigh that.
    ///
    /// Nothing of this asks how stiffness ratio, strength ratio or yield shift go with depth: P_y is counted in what the
    /// elements carry along y whatever the ratio, and their displacement along y follows.
    pub fn check(&self) -> Result<(), Error> {
        in_range(Field::DepthMax, 0, self.depth_max, 0.1, 20.0)?;
        let cell = self.depth_max / (N - 1) as f32;
        in_range(Field::DepthMax, 1, self.cells_per_mm * cell, 1.0 - 1e-6, 1.0 + 1e-6)?;
        in_range(Field::DepthMax, 2, 2.0 * self.half_cell / cell, 1.0 - 1e-6, 1.0 + 1e-6)?;
        in_range(Field::TurnSlip, 0, self.half_turn_slip, 0.0, 0.25)?;
        in_range(Field::SlipRange, 0, 1.0 / self.slip_rate, 0.8, 1.2)?;
        in_range(Field::AreaTilt, 0, self.area_tilt, -0.5, 0.5)?;
        for (what, [slip, rate, bend]) in
            [(Field::BandSlip, self.band_normal), (Field::BandFriction, self.band_friction)]
        {
            in_range(what, 0, slip, 0.0, 20.0)?;
            in_range(what, 1, slip + rate + bend, 0.0, 20.0)?;
            in_range(what, 2, bend.abs(), 0.0, 200.0)?;
            let lowest = (-0.5 * rate / bend).clamp(0.0, 1.0);
            if bend != 0.0 {
                in_range(what, 3, slip + lowest * (rate + lowest * bend), 0.0, 100.0)?;
            }
        }
        in_range(Field::PressureExponent, 0, self.pressure_exponent, -1.0, 2.0)?;
        let (mut strength, mut softness, mut energy) = (0.0, 0.0, 0.0);
        for (j, element) in self.elements.iter().enumerate() {
            in_range(Field::YieldPosition, j, element.inverse_yield, 0.1, 20.0)?;
            in_range(Field::StrengthShare, j, element.strength, 0.0, 1.0)?;
            in_range(Field::YieldPosition, j, element.energy * element.inverse_yield / element.strength, 0.999, 1.001)?;
            strength += element.strength;
            energy += element.energy;
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
        in_range(Field::SlipLengthRatio, 0, longest / shortest, 1.0, SLIP_LENGTH_RATIO_MAX)?;
        for (i, row) in self.rows.iter().enumerate() {
            row.check(i)?;
            // Both rise with depth, so that no cell exceeds its ends.
            let odd = 0.5 * self.twice_odd * row.stiffness.value * row.limit.value;
            in_range(Field::OddCompliance, i, odd, -ODD_MAX, ODD_MAX)?;
            let next = self.rows.get(i + 1).unwrap_or(row);
            for (what, now, then) in [
                (Field::NormalForce, &row.normal, &next.normal),
                (Field::ContactArea, &row.area, &next.area),
                (Field::FrictionLimit, &row.limit, &next.limit),
                (Field::TangentialStiffness, &row.stiffness, &next.stiffness),
                (Field::StiffnessRatio, &row.stiffness_anisotropy, &next.stiffness_anisotropy),
                (Field::StrengthRatio, &row.strength_anisotropy, &next.strength_anisotropy),
                (Field::NormalShearX, &row.normal_shear_x, &next.normal_shear_x),
                (Field::NormalShearY, &row.normal_shear_y, &next.normal_shear_y),
                (Field::TiltX, &row.yield_shift, &next.yield_shift),
                (Field::BandNormal, &row.band_normal, &next.band_normal),
                (Field::PressCoupling, &row.press_coupling, &next.press_coupling),
            ] {
                let last = i + 1 == N;
                joins(what, i, now, if last { now.value } else { then.value })?;
                if last && now.change != 0.0 {
                    return Err(Error::Range { what, index: i as u16, value: now.change });
                }
            }
            let press_slide = row.press_slide + 2.0 * row.press_coupling.value + row.press_coupling.change;
            if i + 1 < N && !((next.press_slide - press_slide).abs() <= 1e-5 * (N as f32)) {
                return Err(Error::Range { what: Field::PressCoupling, index: i as u16, value: next.press_slide });
            }
            if i + 1 < N {
                for t in [0.0, 1.0] {
                    if i > 0 || t > 0.0 {
                        row.check_passive(i, t, cell, self.depth_max, energy)?;
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
        in_range(Field::StiffnessRatio, i, self.stiffness_anisotropy.value, 0.5, 2.0)?;
        in_range(
            Field::StrengthRatio,
            i,
            self.stiffness_anisotropy.value / self.strength_anisotropy.value,
            0.5 - 1e-6,
            2.0 + 1e-6,
        )?;
        in_range(Field::PressCoupling, i, self.press_coupling.value, -1.0, 1.0)?;
        in_range(Field::PressCoupling, i, self.press_slide, -4096.0, 4096.0)?;
        in_range(Field::NormalShearX, i, self.normal_shear_x.value, -1e6, 1e6)?;
        in_range(Field::NormalShearY, i, self.normal_shear_y.value, -1e6, 1e6)?;
        in_range(Field::TiltX, i, self.yield_shift.value, -0.25, 0.25)?;
        in_range(Field::BandNormal, i, self.band_normal.value, 0.0, 1e3)?;
        // Slip length: neither so short nor so long that a step would overflow.
        let slip_length = self.limit.value / self.stiffness.value.max(tiny);
        in_range(Field::SlipLength, i, slip_length, 1e-3, 1e3)?;
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

    /// The inequalities of [`DataOf::check`] at one end of a cell; `energy` is Σ w y.
    fn check_passive(&self, i: usize, t: f32, cell: f32, depth_max: f32, energy: f32) -> Result<(), Error> {
        let at = |what, value: f32, limit: f32| {
            if value <= limit { Ok(()) } else { Err(Error::NotPassive { what, index: i as u16, value, limit }) }
        };
        let (k, l, strength_anisotropy) = (self.stiffness.at(t), self.limit.at(t), self.strength_anisotropy.at(t));
        let (shear_x, shear_y) = (self.normal_shear_x.at(t), self.normal_shear_y.at(t));
        let most = 0.5 / (k * depth_max);
        at(Field::NormalShearX, shear_x.abs(), most)?;
        at(Field::NormalShearY, shear_y.abs(), most)?;
        // The normal force stays positive, and its stiffness outweighs the coupling's error in a finite step. The
        // largest element forces are 1.29 along x and 1.04 along y.
        let coupled = self.press_coupling.at(t).abs() * l * 1.3;
        let normal = self.normal.at(t);
        at(Field::PressCoupling, coupled, normal)?;
        let taken_x = (-shear_x).max(0.0) * l * l * 1.7 * energy;
        let taken_y = (-shear_y).max(0.0) * l * l * 1.1 * energy / (strength_anisotropy * strength_anisotropy);
        at(Field::NormalShearX, coupled + taken_x.max(taken_y), normal)?;
        let dpress = self.press_coupling.change.abs() / cell;
        at(Field::PressCoupling, dpress * l * 1.3, self.normal.change / cell)
    }
}
