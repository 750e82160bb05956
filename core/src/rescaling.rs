//! The same model for another finger: size, stiffness and friction changed at run time, without a rebuild.
//!
//! Main type: [`Tuning`]. Uses model and math.

use crate::error::Field;
use crate::math::{Arithmetic, Scalar};
use crate::pose::{Pose, PoseFactors};
use crate::{Error, ModelOf, Status};

/// How a finger differs from the one the model was fitted to.
///
/// Lengths scale with `size`, pressures with `stiffness` (e), local friction as tau_0 + lambda sigma^beta:
///
/// ```text
/// N ~ e size²    A ~ size²    K ~ e size    L ~ lambda e^beta size² + tau_0 A
/// ```
///
/// with beta the model's exponent. The first three are exact for geometrically similar fingers and linear tissue;
/// the lambda rule takes the pressure profile as unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tuning {
    /// Factor on all lengths, 0.5 to 2.
    pub size: f32,
    /// Factor on the tissue's stiffness, 0.2 to 5.
    pub stiffness: f32,
    /// Factor on lambda, 0.1 to 10.
    pub lambda: f32,
    /// Shear strength at zero pressure, MPa, 0 to 0.1.
    pub tau0_mpa: f32,
}

impl Default for Tuning {
    /// The finger the model was fitted to.
    fn default() -> Self {
        Self { size: 1.0, stiffness: 1.0, lambda: 1.0, tau0_mpa: 0.0 }
    }
}

/// Range of the factor on the tissue's stiffness.
pub(crate) const STIFFNESS_FACTOR: core::ops::RangeInclusive<f32> = 0.2..=5.0;

/// Largest tilt of a limit along x or y.
const TILT_MAX: f32 = 0.25;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Fitted {}
    impl<T, const POSED: bool> Sealed for super::Scaled<T, POSED> {}
}

/// What a step makes of the tables' numbers: [`Fitted`] takes them as they are, [`Scaled`] multiplies them for another
/// finger. Sealed. The choice is made when compiling, so that a finger that is not retuned pays nothing for it.
#[doc(hidden)]
pub trait Scaling<T: Arithmetic>: Copy + sealed::Sealed {
    /// The same with the tissue's stiffness changed.
    type Stiffened: Scaling<T>;
    /// Cells of the tables per mm, from that of the fitted finger.
    fn per_mm(&self, cells: T) -> T;
    /// A length within the contact, mm.
    fn length(&self, mm: T) -> T;
    /// A depth, mm, or a slide that pressing amounts to.
    fn depth(&self, mm: T) -> T;
    /// Whether the strength may change over depth otherwise than that of the fitted finger.
    const RESCALED: bool;
    /// Whether the finger is in another pose than the fitted one.
    const POSED: bool;
    /// Tilt of a limit along x and y, from that along x in the fitted pose.
    fn tilt(&self, fitted: T) -> [T; 2];
    /// What is to be remarked about the pose.
    fn status(&self) -> Status;
    /// What the pose adds to the bands: shares of the normal force and of the limit.
    fn band(&self) -> [T; 2];
    /// Slides along x and y, mm/mm, that a depth increment amounts to in the pose, beyond that of the fitted one.
    fn press(&self) -> [T; 2];
    /// Where the contact lies in the pose, mm along x and y from where it lies in the fitted one.
    fn offset(&self) -> [T; 2];
    /// An area at a depth, mm², mm.
    fn area(&self, mm2: T, depth: T) -> T;
    /// A force along the normal at a depth, N, mm.
    fn normal(&self, n: T, depth: T) -> T;
    /// A tangential stiffness, N/mm.
    fn stiffness(&self, n_mm: T) -> T;
    /// The strength at a depth, N, mm, from that of the fitted finger and the scaled area.
    fn limit(&self, n: T, area_mm2: T, depth: T) -> T;
    /// What the pose adds to the change with depth, N/mm: of the normal force, and of the strength on `area_mm2`, both of the
    /// fitted finger.
    fn normal_slope(&self, n: T) -> T;
    fn limit_slope(&self, n: T, area_mm2: T) -> T;
    /// Factor on the slides at which springs slip, from the strength of the fitted finger and the scaled one.
    fn radius(&self, fitted_n: T, scaled_n: T) -> T;
    /// One over a force, 1/N.
    fn per_newton(&self, x: T) -> T;
    /// The same finger with the tissue's stiffness times `factor`; `beta` is the exponent of the friction law.
    fn stiffened(&self, factor: T, beta: T) -> Self::Stiffened
    where
        T: Scalar;
}

/// What eight contacts can share. Sealed.
#[doc(hidden)]
pub trait Wide: Scaling<f32> {
    /// The same for eight contacts side by side.
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes: Scaling<crate::lanes::Lanes>;
    /// The same for eight contacts side by side.
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Self::InLanes;
}

impl Wide for Fitted {
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes = Fitted;
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Fitted {
        Fitted
    }
}

impl<const POSED: bool> Wide for Scaled<f32, POSED> {
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes = Scaled<crate::lanes::Lanes, POSED>;
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Self::InLanes {
        let of = <crate::lanes::Lanes as Arithmetic>::of;
        Scaled {
            per_length: of(self.per_length),
            length: of(self.length),
            area: of(self.area),
            normal: of(self.normal),
            stiffness: of(self.stiffness),
            limit: of(self.limit),
            tau0: of(self.tau0),
            per_newton: of(self.per_newton),
            softness: of(self.softness),
            depth: of(self.depth),
            area_slope: of(self.area_slope),
            normal_slope: of(self.normal_slope),
            limit_slope: of(self.limit_slope),
            tilt: self.tilt.map(of),
            press: self.press.map(of),
            offset: self.offset.map(of),
            band: self.band.map(of),
            status: self.status,
        }
    }
}

/// What may still be brought into another pose: a finger in the fitted one. Sealed.
#[doc(hidden)]
pub trait Unposed<T: Scalar>: Scaling<T> {
    /// The same finger in a pose.
    fn posed(&self, pose: &PoseFactors<T>) -> Scaled<T, true>;
}

/// The finger that the model was fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fitted;

impl<T: Arithmetic> Scaling<T> for Fitted {
    type Stiffened = Scaled<T>;
    const RESCALED: bool = false;
    const POSED: bool = false;

    #[inline(always)]
    fn per_mm(&self, cells: T) -> T {
        cells
    }
    #[inline(always)]
    fn length(&self, mm: T) -> T {
        mm
    }
    #[inline(always)]
    fn depth(&self, mm: T) -> T {
        mm
    }
    #[inline(always)]
    fn tilt(&self, fitted: T) -> [T; 2] {
        [fitted, T::of(0.0)]
    }
    #[inline(always)]
    fn status(&self) -> Status {
        Status::OK
    }
    #[inline(always)]
    fn band(&self) -> [T; 2] {
        [T::of(0.0); 2]
    }
    #[inline(always)]
    fn press(&self) -> [T; 2] {
        [T::of(0.0); 2]
    }
    #[inline(always)]
    fn offset(&self) -> [T; 2] {
        [T::of(0.0); 2]
    }
    #[inline(always)]
    fn area(&self, mm2: T, _: T) -> T {
        mm2
    }
    #[inline(always)]
    fn normal(&self, n: T, _: T) -> T {
        n
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: T) -> T {
        n_mm
    }
    #[inline(always)]
    fn limit(&self, n: T, _: T, _: T) -> T {
        n
    }
    fn normal_slope(&self, _: T) -> T {
        T::of(0.0)
    }
    fn limit_slope(&self, _: T, _: T) -> T {
        T::of(0.0)
    }
    #[inline(always)]
    fn radius(&self, _: T, _: T) -> T {
        T::of(1.0)
    }
    #[inline(always)]
    fn per_newton(&self, x: T) -> T {
        x
    }
    fn stiffened(&self, factor: T, beta: T) -> Scaled<T>
    where
        T: Scalar,
    {
        Scaled::<T>::same().stiffened(factor, beta)
    }
}

impl<T: Scalar> Unposed<T> for Fitted {
    fn posed(&self, pose: &PoseFactors<T>) -> Scaled<T, true> {
        Scaled::<T>::same().posed(pose)
    }
}

/// Factors for another finger, made by [`ModelOf::tuned`], or, `POSED`, for another pose, by [`ModelOf::posed`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scaled<T = f32, const POSED: bool = false> {
    per_length: T,
    length: T,
    area: T,
    normal: T,
    stiffness: T,
    limit: T,
    tau0: T,
    per_newton: T,
    /// One over `stiffness`.
    softness: T,
    /// One over `per_length`.
    depth: T,
    /// Change of the factors on area, normal force and limit with depth, 1/mm.
    area_slope: T,
    normal_slope: T,
    limit_slope: T,
    tilt: [T; 2],
    press: [T; 2],
    offset: [T; 2],
    band: [T; 2],
    status: Status,
}

impl<T: Arithmetic, const POSED: bool> Scaled<T, POSED> {
    /// The fitted finger.
    fn same() -> Self {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        Self {
            per_length: one,
            length: one,
            area: one,
            normal: one,
            stiffness: one,
            limit: one,
            tau0: zero,
            per_newton: one,
            softness: one,
            depth: one,
            area_slope: zero,
            normal_slope: zero,
            limit_slope: zero,
            tilt: [zero; 2],
            press: [zero; 2],
            offset: [zero; 2],
            band: [zero; 2],
            status: Status::OK,
        }
    }

    /// A factor at a depth, mm.
    #[inline(always)]
    fn line(&self, touch: T, slope: T, depth: T) -> T {
        if POSED { touch + slope * depth } else { touch }
    }

    fn new(tuning: &Tuning, beta: T) -> Self
    where
        T: Scalar,
    {
        let Tuning { size, stiffness, lambda, tau0_mpa } = *tuning;
        let [size, e, lambda, tau0] = [size, stiffness, lambda, tau0_mpa].map(T::of);
        let area = size * size;
        let strength = if stiffness == 1.0 { lambda } else { lambda * e.power(beta) };
        let one = T::of(1.0);
        Self {
            per_length: one / size,
            length: size,
            area,
            normal: e * area,
            stiffness: e * size,
            limit: strength * area,
            tau0,
            per_newton: one / (e * area),
            softness: one / (e * size),
            depth: size,
            ..Self::same()
        }
    }
}

impl<T: Arithmetic, const POSED: bool> Scaling<T> for Scaled<T, POSED> {
    type Stiffened = Self;
    const RESCALED: bool = true;
    const POSED: bool = POSED;

    #[inline(always)]
    fn per_mm(&self, cells: T) -> T {
        cells * self.per_length
    }
    #[inline(always)]
    fn length(&self, mm: T) -> T {
        mm * self.length
    }
    #[inline(always)]
    fn depth(&self, mm: T) -> T {
        mm * self.depth
    }
    #[inline(always)]
    fn tilt(&self, fitted: T) -> [T; 2] {
        let most = T::of(TILT_MAX);
        let held = |tilt: T| -(-tilt.at_most(most)).at_most(most);
        if POSED { [held(fitted + self.tilt[0]), held(self.tilt[1])] } else { [fitted, T::of(0.0)] }
    }
    #[inline(always)]
    fn status(&self) -> Status {
        if POSED { self.status } else { Status::OK }
    }
    #[inline(always)]
    fn band(&self) -> [T; 2] {
        self.band
    }
    #[inline(always)]
    fn press(&self) -> [T; 2] {
        self.press
    }
    #[inline(always)]
    fn offset(&self) -> [T; 2] {
        self.offset
    }
    #[inline(always)]
    fn area(&self, mm2: T, depth: T) -> T {
        mm2 * self.line(self.area, self.area_slope, depth)
    }
    #[inline(always)]
    fn normal(&self, n: T, depth: T) -> T {
        n * self.line(self.normal, self.normal_slope, depth)
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: T) -> T {
        n_mm * self.stiffness
    }
    #[inline(always)]
    fn limit(&self, n: T, area_mm2: T, depth: T) -> T {
        n * self.line(self.limit, self.limit_slope, depth) + area_mm2 * self.tau0
    }
    fn normal_slope(&self, n: T) -> T {
        n * self.normal_slope
    }
    fn limit_slope(&self, n: T, area_mm2: T) -> T {
        n * self.limit_slope + area_mm2 * self.area_slope * self.tau0
    }
    #[inline(always)]
    fn radius(&self, fitted_n: T, scaled_n: T) -> T {
        scaled_n / fitted_n * self.softness
    }
    #[inline(always)]
    fn per_newton(&self, x: T) -> T {
        x * self.per_newton
    }
    fn stiffened(&self, factor: T, beta: T) -> Self
    where
        T: Scalar,
    {
        if factor == T::of(1.0) {
            return *self;
        }
        Self {
            normal: self.normal * factor,
            normal_slope: self.normal_slope * factor,
            stiffness: self.stiffness * factor,
            limit: self.limit * factor.power(beta),
            limit_slope: self.limit_slope * factor.power(beta),
            per_newton: self.per_newton / factor,
            softness: self.softness / factor,
            ..*self
        }
    }
}

impl<T: Scalar> Unposed<T> for Scaled<T> {
    fn posed(&self, pose: &PoseFactors<T>) -> Scaled<T, true> {
        let [normal, area, limit] = [pose.normal, pose.area, pose.limit];
        Scaled {
            per_length: self.per_length,
            depth: self.depth,
            area: self.area * area[0],
            area_slope: self.area * area[1] * self.per_length,
            normal: self.normal * normal[0],
            normal_slope: self.normal * normal[1] * self.per_length,
            stiffness: self.stiffness * pose.stiffness,
            limit: self.limit * limit[0],
            limit_slope: self.limit * limit[1] * self.per_length,
            tau0: self.tau0,
            length: self.length,
            band: pose.band,
            status: pose.status,
            per_newton: self.per_newton,
            softness: self.softness / pose.stiffness,
            tilt: pose.tilt,
            press: pose.press,
            offset: pose.offset.map(|mm| mm * self.length),
        }
    }
}

impl<'a, const M: usize, const N: usize, T: Scalar, S: Scaling<T>> ModelOf<'a, M, N, S, T> {
    /// The same model for another finger, counted from the fitted one. A state may be carried over: springs keep their
    /// displacement.
    ///
    /// Costs about 100 instructions, 200 with a stiffness other than 1.
    pub fn tuned(&self, tuning: Tuning) -> Result<ModelOf<'a, M, N, Scaled<T>, T>, Error> {
        let ranges = [
            (Field::Size, tuning.size, 0.5, 2.0),
            (Field::Stiffness, tuning.stiffness, 0.2, 5.0),
            (Field::Lambda, tuning.lambda, 0.1, 10.0),
            (Field::Tau0, tuning.tau0_mpa, 0.0, 0.1),
        ];
        for (what, value, low, high) in ranges {
            if !(value >= low && value <= high) {
                return Err(Error::Range { what, index: 0, value });
            }
        }
        let scale = Scaled::new(&tuning, self.data.pressure_exponent);
        Ok(ModelOf { data: self.data, scale })
    }

    /// The same finger with the tissue's stiffness times `factor`, which is held within [`STIFFNESS_FACTOR`].
    pub(crate) fn stiffened(&self, factor: T) -> ModelOf<'a, M, N, S::Stiffened, T> {
        let [least, most] = [*STIFFNESS_FACTOR.start(), *STIFFNESS_FACTOR.end()].map(T::of);
        let factor = if factor < least { least } else { factor.at_most(most) };
        let scale = self.scale.stiffened(factor, self.data.pressure_exponent);
        ModelOf { data: self.data, scale }
    }
}

impl<'a, const M: usize, const N: usize, T: Scalar, S: Unposed<T>> ModelOf<'a, M, N, S, T> {
    /// The same finger in another pose: pitch and roll of the finger against the plane; see [`Pose`]. A state may be
    /// carried over.
    ///
    /// Errors: [`Error::Range`] for a pose out of range, or if the model was fitted in one pose alone.
    pub fn posed(&self, pose: Pose) -> Result<ModelOf<'a, M, N, Scaled<T, true>, T>, Error> {
        let factors = self.data.pose.factors(pose, self.data.pressure_exponent, self.data.depth_max)?;
        Ok(ModelOf { data: self.data, scale: self.scale.posed(&factors) })
    }
}
