//! The same model for another finger: size, stiffness and friction changed at run time, without a rebuild.
//!
//! Main type: [`Tuning`]. Uses model and math.

use crate::error::Field;
use crate::math::{Arithmetic, Scalar};
use crate::pose::{Pose, PoseFactors, TILT_MAX, sixteenth_power};
use crate::rolling::Posture;
pub use crate::scaling::{Fitted, Scaling, Unposed, Wide};
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

impl<const POSED: bool> Wide for Scaled<f32, POSED> {
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    type InLanes = Scaled<crate::lanes::Lanes, POSED>;
    #[cfg(all(feature = "lanes", target_feature = "avx"))]
    fn in_lanes(&self) -> Self::InLanes {
        let of = <crate::lanes::Lanes as Arithmetic>::of;
        Scaled {
            per_length: of(self.per_length),
            length: of(self.length),
            area: self.area.map(of),
            normal: self.normal.map(of),
            stiffness: of(self.stiffness),
            limit: self.limit.map(of),
            tau0: of(self.tau0),
            per_newton: of(self.per_newton),
            softness: of(self.softness),
            per_depth_max: of(self.per_depth_max),
            stiffness_ratio: of(self.stiffness_ratio),
            tilt: self.tilt.map(of),
            press: self.press.map(of),
            angles: self.angles.map(of),
            pose_stiffness: of(self.pose_stiffness),
            arm_root: of(self.arm_root),
            place: self.place.map(of),
            away_bits: self.away_bits,
            status: self.status,
        }
    }
}

/// Factors for another finger, made by [`ModelOf::tuned`], or, `POSED`, for another pose, by [`ModelOf::posed`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scaled<T = f32, const POSED: bool = false> {
    per_length: T,
    length: T,
    per_newton: T,
    tau0: T,
    /// Factors at touch, and what they change by to the deepest press of the poses.
    area: [T; 2],
    normal: [T; 2],
    stiffness: T,
    limit: [T; 2],
    /// One over `stiffness`.
    softness: T,
    /// One over the depth beyond which these factors stay as they are, 1/mm.
    per_depth_max: T,
    /// Stiffness along y over that along x.
    stiffness_ratio: T,
    /// What a pose adds to the tilt along x, and the tilt along y.
    tilt: [T; 2],
    press: [T; 2],
    /// Pitch against the fitted pose and roll, rad.
    angles: [T; 2],
    /// Factor of the pose on the stiffness.
    pose_stiffness: T,
    /// 16th root of the factor on the springs' arms in a pose.
    arm_root: T,
    place: [T; 2],
    /// All bits but the first are 0 in the fitted pose alone.
    away_bits: u32,
    status: Status,
}

impl<T: Arithmetic, const POSED: bool> Scaled<T, POSED> {
    /// The fitted finger.
    pub(crate) fn same() -> Self {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        Self {
            per_length: one,
            length: one,
            per_newton: one,
            tau0: zero,
            area: [one, zero],
            normal: [one, zero],
            stiffness: one,
            limit: [one, zero],
            softness: one,
            per_depth_max: one,
            stiffness_ratio: one,
            tilt: [zero; 2],
            press: [zero; 2],
            angles: [zero; 2],
            pose_stiffness: one,
            arm_root: one,
            place: [zero; 2],
            away_bits: 0,
            status: Status::OK,
        }
    }

    /// A factor at a depth, mm: over the share d of the deepest press it goes as d (2 − d).
    #[inline(always)]
    fn over_depth(&self, [touch, change]: [T; 2], depth: T) -> T {
        if !POSED {
            return touch;
        }
        let share = (depth * self.per_depth_max).at_most(T::of(1.0));
        touch + change * (share * (T::of(2.0) - share))
    }

    /// Its change with depth, 1/mm.
    #[inline(always)]
    fn rise(&self, [_, change]: [T; 2], depth: T) -> T
    where
        T: Scalar,
    {
        let share = depth * self.per_depth_max;
        let is_rising = POSED && share < T::of(1.0);
        if is_rising { change * (T::of(2.0) * (T::of(1.0) - share) * self.per_depth_max) } else { T::of(0.0) }
    }

    fn new(tuning: &Tuning, beta: T) -> Self
    where
        T: Scalar,
    {
        let Tuning { size, stiffness, lambda, tau0_mpa } = *tuning;
        let [size, e, lambda, tau0] = [size, stiffness, lambda, tau0_mpa].map(T::of);
        let area = size * size;
        let strength = if stiffness == 1.0 { lambda } else { lambda * e.power(beta) };
        let (zero, one) = (T::of(0.0), T::of(1.0));
        Self {
            per_length: one / size,
            length: size,
            area: [area, zero],
            normal: [e * area, zero],
            stiffness: e * size,
            limit: [strength * area, zero],
            tau0,
            per_newton: one / (e * area),
            softness: one / (e * size),
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
        mm * self.length
    }
    #[inline(always)]
    fn tilt(&self, fitted: T) -> [T; 2] {
        if !POSED {
            return [fitted, T::of(0.0)];
        }
        let most = T::of(TILT_MAX);
        [-(-(fitted + self.tilt[0]).at_most(most)).at_most(most), self.tilt[1]]
    }
    #[inline(always)]
    fn status(&self) -> Status {
        if POSED { self.status } else { Status::OK }
    }
    #[inline(always)]
    fn elsewhere(&self) -> T {
        T::of(if self.away_bits << 1 == 0 { 0.0 } else { 1.0 })
    }
    #[inline(always)]
    fn press(&self) -> [T; 2] {
        self.press
    }
    #[inline(always)]
    fn arm(&self, mm: T) -> T {
        mm * if POSED { sixteenth_power(self.arm_root) * self.length } else { self.length }
    }
    #[inline(always)]
    fn posture(&self) -> Posture<T> {
        Posture { place: self.place, angles: self.angles, stiffness: self.pose_stiffness }
    }
    #[inline(always)]
    fn place(&self) -> [T; 2] {
        self.place
    }
    #[inline(always)]
    fn area(&self, mm2: T, depth: T) -> T {
        mm2 * self.over_depth(self.area, depth)
    }
    #[inline(always)]
    fn normal(&self, n: T, depth: T) -> T {
        n * self.over_depth(self.normal, depth)
    }
    #[inline(always)]
    fn stiffness(&self, n_mm: T) -> T {
        n_mm * self.stiffness
    }
    #[inline(always)]
    fn stiffnesses(&self, [x, y]: [T; 2]) -> [T; 2] {
        let across = if POSED { self.stiffness * self.stiffness_ratio } else { self.stiffness };
        [x * self.stiffness, y * across]
    }
    #[inline(always)]
    fn anisotropy(&self, fitted: T) -> T {
        if POSED { fitted * self.stiffness_ratio } else { fitted }
    }
    #[inline(always)]
    fn limit(&self, n: T, area_mm2: T, depth: T) -> T {
        n * self.over_depth(self.limit, depth) + area_mm2 * self.tau0
    }
    fn normal_slope(&self, n: T, depth: T) -> T
    where
        T: Scalar,
    {
        n * self.rise(self.normal, depth)
    }
    fn limit_slope(&self, n: T, area_mm2: T, depth: T) -> T
    where
        T: Scalar,
    {
        n * self.rise(self.limit, depth) + area_mm2 * self.rise(self.area, depth) * self.tau0
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
        let strength = factor.power(beta);
        Self {
            normal: self.normal.map(|x| x * factor),
            stiffness: self.stiffness * factor,
            limit: self.limit.map(|x| x * strength),
            per_newton: self.per_newton / factor,
            softness: self.softness / factor,
            ..*self
        }
    }
}

impl<T: Scalar> Unposed<T> for Scaled<T> {
    fn posed(&self, pose: &PoseFactors<T>) -> Scaled<T, true> {
        let scaled = |of: T, factor: [T; 2]| factor.map(|x| of * x);
        Scaled {
            per_length: self.per_length,
            length: self.length,
            per_newton: self.per_newton,
            tau0: self.tau0,
            area: scaled(self.area[0], pose.area),
            normal: scaled(self.normal[0], pose.normal),
            stiffness: self.stiffness * pose.stiffness,
            limit: scaled(self.limit[0], pose.limit),
            softness: self.softness / pose.stiffness,
            per_depth_max: pose.per_depth_max * self.per_length,
            stiffness_ratio: pose.stiffness_ratio,
            tilt: pose.tilt,
            press: pose.press,
            angles: pose.angles,
            pose_stiffness: pose.stiffness,
            arm_root: pose.arm_root,
            place: pose.place.map(|mm| mm * self.length),
            away_bits: pose.away_bits,
            status: Status::OK,
        }
    }
}

impl<'a, const M: usize, const N: usize, T: Scalar, S: Scaling<T>> ModelOf<'a, M, N, S, T> {
    /// The same model for another finger, counted from the fitted one. A state may be carried over: springs keep their
    /// displacement.
    ///
    /// Costs about 150 instructions, 250 with a stiffness other than 1.
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
    ///
    /// Costs 246 instructions on a Cortex-M4F, in every pose of the fit. The factor on the springs' arms is left to steps with spin,
    /// what the pose adds to the bands to who asks for those.
    #[inline]
    pub fn posed(&self, pose: Pose) -> Result<ModelOf<'a, M, N, Scaled<T, true>, T>, Error> {
        self.posed_at([T::of(pose.pitch_deg), T::of(pose.roll_deg)])
    }

    #[inline(never)]
    fn posed_at(&self, angles_deg: [T; 2]) -> Result<ModelOf<'a, M, N, Scaled<T, true>, T>, Error> {
        if !self.data.pose.holds(angles_deg) {
            return self.posed_nearby(angles_deg);
        }
        let factors = self.data.pose.factors(angles_deg, self.data.pressure_exponent);
        Ok(ModelOf { data: self.data, scale: self.scale.posed(&factors) })
    }

    /// The finger in the nearest pose that the model was fitted in, flagged.
    #[cold]
    #[inline(never)]
    fn posed_nearby(&self, angles_deg: [T; 2]) -> Result<ModelOf<'a, M, N, Scaled<T, true>, T>, Error> {
        let mut posed = self.posed_at(self.data.pose.nearest(angles_deg)?)?;
        posed.scale.status = Status::POSE_OUT_OF_RANGE;
        posed.scale.away_bits = 1;
        Ok(posed)
    }
}
