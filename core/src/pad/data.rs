//! The fitted numbers of a pad.
//!
//! Main types: [`Patch`], [`Numbers`], [`Law`], [`Pad`].

use bytemuck::{Pod, Zeroable};

use crate::math::Scalar;
use crate::tuning::Units;
use crate::{Error, Relaxation, Tuning};

use super::body::{LeastRadii, Surface};
use super::vector::{Bulk, Packed, along};
use super::{FIRST_TOUCH_TERMS, MODES, Orthotropy};

/// One patch of skin.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Patch<T = f32> {
    /// Position of its middle in the undeformed finger, mm.
    pub middle_mm: [T; 3],
    /// Its area, mm².
    pub area_mm2: T,
    /// Cholesky factor L of the second moment L L' of its points about the middle, per area, mm: the lower triangle, row by row.
    pub spread_mm: [T; 6],
    /// Displacement along x, y and z per unit of each coordinate of the bulk, mm/sqrt(mJ).
    pub modes: [Bulk<T>; 3],
    /// Local compliance along its normal and across, mm/N: the part of its compliance that the bulk does not represent.
    pub compliance_mm_per_n: [T; 2],
}

/// Numbers of the finger as a whole.
///
/// The energy of the bulk at small loads is half the sum of the squares of its coordinates, mJ; its stiffness is in the scale of the modes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Numbers<T = f32> {
    /// Translation (mm) and rotation vector (rad) of the rigid motion that is closest to the motion of the patches, per coordinate of the
    /// bulk.
    pub rigid: [Bulk<T>; 6],
    /// Weighted mean square of the skin's displacement (squash) as a quadratic form of the bulk's coordinates, mm²/mJ: the lower triangle,
    /// row by row. The bulk stiffens with it. Displacement along the skin's normal has the largest weight, and skin near the middle of the
    /// fingertip has more than skin at its rim.
    pub squash: Packed<T>,
    /// Upper bound of [`Patch::reach`] over all patches, mm/sqrt(mJ).
    pub reach: T,
    /// Centre of the rotation of `rigid`, mm.
    pub middle_mm: [T; 3],
    /// Height of the plane at first touch, mm: coefficients of [`super::first_touch_terms`].
    pub first_touch_mm: [T; FIRST_TOUCH_TERMS],
    /// Pitch at which the axes of the finger are parallel to those of the plane, degrees.
    pub neutral_pitch_deg: T,
    /// Least and largest pitch of the fit, degrees.
    pub pitch_range_deg: [T; 2],
    /// Largest roll of the fit to either side, degrees.
    pub roll_max_deg: T,
    /// Largest depth of the fit, mm.
    pub depth_max_mm: T,
    /// Half-width of the 95 % band of the normal force over the force: a parabola in the stick ratio (constant, factors of the ratio and
    /// of its square). First for the neutral pose, then the addition for other poses.
    pub band_normal: [[T; 3]; 2],
    /// Half-width of the 95 % band of friction over the strength, in the same form.
    pub band_friction: [[T; 3]; 2],
    /// Addition to both bands (normal force, friction) on a curved body, per slope of its surface 2 mm beside the apex.
    pub band_body: [T; 2],
    /// Addition to both bands per mm of depth beyond 2.6 mm.
    pub band_deep: [T; 2],
    /// Constant addition to both bands (normal force, friction), N; it dominates in light contacts. First for the neutral pose, then the
    /// addition for other poses.
    pub band_light_n: [[T; 2]; 2],
    /// The numbers that are fitted to nonlinear runs.
    pub law: Law<T>,
}

/// The numbers that are fitted to nonlinear runs of the finite elements.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Law<T = f32> {
    /// Square root of the bulk's compliance over that at small loads: across the body's normal and along it.
    pub softness: [T; 2],
    /// Energy of stiffening, rate q³ exp(growth q²) of the root q of the squash, mm: rate, mJ/mm³, and growth, 1/mm².
    pub stiffening: [T; 2],
    /// Pressure at which the whole patch touches, MPa: a constant, and a factor of the spread of the gaps over the size of the patch.
    pub flattening_mpa: [T; 2],
    /// Area of a patch in contact: its largest value over the patch's own area; the force at which it is reached over the force at which
    /// the whole patch touches; the exponent of the force below that.
    pub area: [T; 3],
    /// Strength lambda sigma^beta of friction: lambda, MPa^(1 - beta), and beta.
    pub friction: [T; 2],
    /// Exponent n of the slipping share u^n of a patch under growing load, where u is friction over strength.
    pub onset: T,
    /// Second-order displacement of all patches along z and along x due to the rigid motion of the bulk: coefficients of the six products
    /// of (t_x, t_z, r_y) and of (t_y, r_x, r_z), each in the order 00, 11, 22, 01, 02, 12; 1/mm, 1 or mm.
    pub lift: [[T; 12]; 2],
    /// Factor of the second-order term of the bulk's rotation in the displacement of the patches.
    pub turn: T,
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
    /// Bound of its displacement per change of the bulk: the Frobenius norm of its modes, mm/sqrt(mJ).
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

/// How hard a step searches for its equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Effort {
    /// Most evaluations of the forces on the patches in one step, at least 2; a factorisation of the stiffness counts as four, which is what
    /// it costs. A step that needs more ends with [`crate::Status::NOT_CONVERGED`], and the next one goes on from there.
    pub evaluations: u32,
    /// Change of the bulk in the last iteration over its size. Below it the bulk is in equilibrium.
    pub tolerance: f32,
}

impl Effort {
    /// Bounds every step at 250 000 instructions of a Cortex-M4F for a pad of 37 patches. A jump then takes up to three steps.
    pub const REAL_TIME: Self = Self { evaluations: 11, tolerance: 2e-4 };
}

impl Default for Effort {
    /// Enough for equilibrium in all but absurd steps.
    fn default() -> Self {
        Self { evaluations: 200, tolerance: 2e-4 }
    }
}

/// Least radii over the square root of the mean area of a patch. A cylinder has steeper flanks than an edge: they push patches aside.
const SPHERE_PER_PATCH: f32 = 0.92;
const CYLINDER_PER_PATCH: f32 = 0.45;
const EDGE_PER_PATCH: f32 = 0.37;

/// Patches and bulk of a finger, read in place.
#[derive(Clone, Copy, Debug)]
pub struct Pad<'a, T = f32> {
    /// The patches.
    pub patches: &'a [Patch<T>],
    /// Numbers of the finger as a whole.
    pub numbers: &'a Numbers<T>,
    /// Units of the finger over those of the numbers; see [`Pad::tuned`].
    pub(crate) units: Units<T>,
    pub(crate) effort: Effort,
    pub(crate) relaxation: Relaxation<T>,
    pub(crate) orthotropy: Orthotropy<T>,
}

impl<'a, T: Scalar> Pad<'a, T> {
    /// The pad of the fitted finger.
    pub fn new(patches: &'a [Patch<T>], numbers: &'a Numbers<T>) -> Self {
        let (effort, relaxation, orthotropy) = (Effort::default(), Relaxation::none(), Orthotropy::isotropic());
        Self { patches, numbers, units: Units::fitted(), effort, relaxation, orthotropy }
    }

    /// The same pad with another bound on the time and on the error of a step.
    #[must_use]
    pub fn with_effort(self, effort: Effort) -> Self {
        Self { effort, ..self }
    }

    /// The same pad with tissue that relaxes. A [`super::PadState`] follows the relaxed tissue, and a [`super::RelaxingPadState`] follows it
    /// in time.
    #[must_use]
    pub fn with_relaxation(self, relaxation: Relaxation<T>) -> Self {
        Self { relaxation, ..self }
    }

    /// The branches of the tissue.
    pub fn relaxation(&self) -> &Relaxation<T> {
        &self.relaxation
    }

    /// The same pad with a strength that depends on the direction. The strength of the model is that along the axis.
    #[must_use]
    pub fn with_orthotropy(self, orthotropy: Orthotropy<T>) -> Self {
        Self { orthotropy, ..self }
    }

    /// The dependence of the strength on the direction.
    pub fn orthotropy(&self) -> &Orthotropy<T> {
        &self.orthotropy
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

    /// Radii below which a body digs in between the patches, which then answer late or not at all: a step takes the least radius instead
    /// and says so ([`crate::Status::BODY_TOO_SHARP`]). They follow from the mean area of a patch. At these radii a body whose apex is
    /// within 1 mm of the place of first touch meets a patch of the shipped finger less than 1.25 mm deep in every pose.
    pub fn least_radii_mm(&self) -> LeastRadii<T> {
        let (mut area, mut count) = (T::of(0.0), T::of(0.0));
        for patch in self.patches {
            area += patch.area_mm2;
            count += T::of(1.0);
        }
        let size = (area / count).magnitude().sqrt() * self.units.length;
        LeastRadii {
            sphere_mm: size * T::of(SPHERE_PER_PATCH),
            cylinder_mm: size * T::of(CYLINDER_PER_PATCH),
            edge_mm: size * T::of(EDGE_PER_PATCH),
        }
    }

    /// The body that a step takes instead of one that is too sharp.
    #[inline(always)]
    pub(crate) fn blunted<B: Surface<T>>(&self, body: &B) -> Option<B> {
        if body.is_plane() { None } else { body.blunted(self.least_radii_mm()) }
    }
}

const _: () = assert!(size_of::<Patch>() == 4 * (12 + 3 * MODES));
