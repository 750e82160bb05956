//! The numbers of a pad.
//!
//! Main types: [`Patch`], [`Numbers`], [`Law`], [`Pad`].

use bytemuck::{Pod, Zeroable};

use crate::math::Scalar;
use crate::tuning::Units;
use crate::{Error, Tuning};

use super::vector::{Bulk, Packed, Vec3, along};
use super::{FIRST_TOUCH_TERMS, MODES};

/// One patch of skin.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Patch<T = f32> {
    /// Its middle in the undeformed finger, mm.
    pub middle_mm: Vec3<T>,
    /// Its area, mm².
    pub area_mm2: T,
    /// Root L of the second moment L L' of its points about the middle, over its area, mm: the lower triangle, row by row.
    pub spread_mm: [T; 6],
    /// How it moves along x, y and z with each coordinate of the bulk, mm per root of mJ.
    pub modes: [Bulk<T>; 3],
    /// What the bulk leaves of its compliance along its normal and across, mm/N.
    pub compliance_mm_per_n: [T; 2],
}

/// What holds for the finger as a whole.
///
/// The bulk's energy at rest is half the sum of the squares of its coordinates, mJ: the modes carry the stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Numbers<T = f32> {
    /// Translation (mm) and rotation vector (rad) of the rigid motion nearest to that of the patches, per coordinate of the bulk.
    pub rigid: [Bulk<T>; 6],
    /// Mean square of the skin's displacement, mm² per mJ, by which the bulk stiffens: the lower triangle, row by row. Displacement along
    /// the skin's normal counts most, and skin near the middle of the fingertip more than skin at its rim.
    pub squash: Packed<T>,
    /// Largest displacement of a patch per change of the bulk, at most, mm per root of mJ: see [`Patch::reach`].
    pub reach: T,
    /// Point about which the rotation of `rigid` is taken, mm.
    pub middle_mm: Vec3<T>,
    /// Height of the plane at first touch, mm: coefficients of [`first_touch_terms`].
    pub first_touch_mm: [T; FIRST_TOUCH_TERMS],
    /// Pitch in which the axes of the finger are those of the plane, degrees.
    pub neutral_pitch_deg: T,
    /// Least and largest pitch of the fit, degrees.
    pub pitch_range_deg: [T; 2],
    /// Largest roll of the fit to either side, degrees.
    pub roll_max_deg: T,
    /// Largest depth of the fit, mm.
    pub depth_max_mm: T,
    /// Half-width of the normal force's 95 % band over the force, a parabola in the stick ratio (in full slip, and the factors of the
    /// ratio and of its square), in the neutral pose; and what another pose adds to it.
    pub band_normal: [[T; 3]; 2],
    /// Half-width of friction's band over the strength, likewise.
    pub band_friction: [[T; 3]; 2],
    /// What a curved body adds to both bands (normal force, friction), per slope of its surface 2 mm beside the apex.
    pub band_body: [T; 2],
    /// What depth adds to both bands, per mm beyond 2.6 mm.
    pub band_deep: [T; 2],
    /// What is added to both bands (normal force, friction) in any case, N: it decides where the contact is light. In the neutral pose, and
    /// what another pose adds to it.
    pub band_light_n: [[T; 2]; 2],
    /// What was fitted.
    pub law: Law<T>,
}

/// What is fitted to nonlinear runs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Law<T = f32> {
    /// Root of the bulk's compliance across and along the body's normal over that at rest.
    pub softness: [T; 2],
    /// The bulk's energy grows with the cube of the mean squash q, mJ/mm³, times exp(growth q²): rate and growth, 1/mm².
    pub stiffening: [T; 2],
    /// Pressure at which a patch touches as a whole, MPa: constant, and per spread over size.
    pub flattening_mpa: [T; 2],
    /// Area in contact of a patch: over its own at most; force at which it reaches that, over the force at which it touches as a whole;
    /// exponent of the force below.
    pub area: [T; 3],
    /// Strength of friction lambda sigma^beta: lambda, MPa^(1 - beta), and beta.
    pub friction: [T; 2],
    /// Exponent of the slipping share of a patch whose load grows.
    pub onset: T,
    /// What the rigid motion of the bulk adds in second order to the place of every patch, along z and along x: of the six products of
    /// (t_x, t_z, r_y) and of (t_y, r_x, r_z), each in the order 00, 11, 22, 01, 02, 12; 1/mm, 1 or mm.
    pub lift: [[T; 12]; 2],
    /// Share of the second order of the bulk's rotation that patches follow.
    pub turn: T,
}

/// Terms of the height of first touch: products of the normal's x and of the square of its y, in the finger's frame.
pub fn first_touch_terms<T: Scalar>(x: T, y: T) -> [T; FIRST_TOUCH_TERMS] {
    let one = T::of(1.0);
    let y = y * y;
    let (x2, y2) = (x * x, y * y);
    let (x3, x4, x6) = (x2 * x, x2 * x2, x2 * x2 * x2);
    [
        one,
        x,
        x2,
        x3,
        x4,
        x4 * x,
        x6,
        y,
        y * x,
        y * x2,
        y * x3,
        y * x4,
        y2,
        y2 * x,
        y2 * x2,
        y2 * y,
        y2 * y * x,
        x6 * x,
        y2 * x3,
        y2 * y2,
    ]
}

// SAFETY: `repr(C)` structs of 32-bit floats and arrays of them throughout: no padding, and any bits are a number.
#[allow(unsafe_code)]
mod plain {
    use super::{Law, Numbers, Patch, Pod, Zeroable};
    unsafe impl Zeroable for Patch<f32> {}
    unsafe impl Pod for Patch<f32> {}
    unsafe impl Zeroable for Law<f32> {}
    unsafe impl Pod for Law<f32> {}
    unsafe impl Zeroable for Numbers<f32> {}
    unsafe impl Pod for Numbers<f32> {}
}

impl<T: Scalar> Patch<T> {
    /// Bound of its displacement per change of the bulk: the root of the sum of the squares of its modes, mm per root of mJ.
    pub fn reach(&self) -> T {
        self.modes.iter().fold(T::of(0.0), |sum, row| sum + along(row, row)).magnitude().sqrt()
    }
}

impl Patch {
    /// The same in another scalar.
    pub fn cast<U: Scalar>(&self) -> Patch<U> {
        let of = U::of;
        Patch {
            middle_mm: self.middle_mm.map(of),
            area_mm2: of(self.area_mm2),
            spread_mm: self.spread_mm.map(of),
            modes: self.modes.map(|row| row.map(of)),
            compliance_mm_per_n: self.compliance_mm_per_n.map(of),
        }
    }
}

impl Numbers {
    /// The same in another scalar.
    pub fn cast<U: Scalar>(&self) -> Numbers<U> {
        let of = U::of;
        let law = &self.law;
        Numbers {
            rigid: self.rigid.map(|row| row.map(of)),
            squash: self.squash.map(of),
            reach: of(self.reach),
            middle_mm: self.middle_mm.map(of),
            first_touch_mm: self.first_touch_mm.map(of),
            neutral_pitch_deg: of(self.neutral_pitch_deg),
            pitch_range_deg: self.pitch_range_deg.map(of),
            roll_max_deg: of(self.roll_max_deg),
            depth_max_mm: of(self.depth_max_mm),
            band_normal: self.band_normal.map(|band| band.map(of)),
            band_friction: self.band_friction.map(|band| band.map(of)),
            band_body: self.band_body.map(of),
            band_deep: self.band_deep.map(of),
            band_light_n: self.band_light_n.map(|band| band.map(of)),
            law: Law {
                softness: law.softness.map(of),
                stiffening: law.stiffening.map(of),
                flattening_mpa: law.flattening_mpa.map(of),
                area: law.area.map(of),
                friction: law.friction.map(of),
                onset: of(law.onset),
                lift: law.lift.map(|axis| axis.map(of)),
                turn: of(law.turn),
            },
        }
    }
}

/// Patches and bulk of a finger, read in place.
#[derive(Clone, Copy, Debug)]
pub struct Pad<'a, T = f32> {
    /// The patches.
    pub patches: &'a [Patch<T>],
    /// What holds for all of them.
    pub numbers: &'a Numbers<T>,
    /// Units of the finger over those of the numbers; see [`Pad::tuned`].
    pub(crate) units: Units<T>,
}

impl<'a, T: Scalar> Pad<'a, T> {
    /// A pad on these numbers, as they are.
    pub fn new(patches: &'a [Patch<T>], numbers: &'a Numbers<T>) -> Self {
        Self { patches, numbers, units: Units::fitted() }
    }

    /// The same pad for another finger, relative to the fitted one. A state belongs to one tuning.
    ///
    /// # Errors
    /// [`Error::Range`] with the factor that is out of its range.
    pub fn tuned(&self, tuning: Tuning) -> Result<Self, Error> {
        let [_, beta] = self.numbers.law.friction;
        Ok(Self { units: Units::new(&tuning, beta)?, ..*self })
    }

    /// Largest depth for which the pad was fitted, mm.
    pub fn depth_max_mm(&self) -> T {
        self.numbers.depth_max_mm * self.units.length
    }

    /// Height of the plane at first touch over the origin, along its normal (finger's frame), mm.
    pub fn first_touch_mm(&self, normal: &[T; 3]) -> T {
        self.fitted_first_touch_mm(normal) * self.units.length
    }

    /// The same of the fitted finger.
    pub(crate) fn fitted_first_touch_mm(&self, normal: &[T; 3]) -> T {
        let terms = first_touch_terms(normal[0], normal[1]);
        let mut sum = T::of(0.0);
        for (term, coefficient) in terms.iter().zip(&self.numbers.first_touch_mm) {
            sum += *term * *coefficient;
        }
        sum
    }
}

const _: () = assert!(size_of::<Patch>() == 4 * (12 + 3 * MODES));
