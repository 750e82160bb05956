//! Pitch and roll of the finger against the plane.
//!
//! Main types: [`Pose`], [`PoseTable`]. Uses math.
//!
//! The contact in another pose is that of the fitted one with other factors, smooth in the pose: depth is stretched (the
//! pad that touches is rounder or flatter), normal force, area, strength and stiffness are multiplied, the limit is tilted,
//! and pressing slides the pad another way. A change of pose in contact rolls the finger: skin that leaves the contact takes
//! its stretch along, and what takes its place touches without any.

use crate::error::Field;
use crate::math::Scalar;
use crate::{Error, Status};

/// Pitch and roll of the finger against the plane, degrees.
///
/// Pitch is the angle of the finger's long axis with the plane, 10 to 70; roll turns the finger about that axis, −30 to 30,
/// positive towards +y. The depth in a pose counts along the plane's normal from first touch in that pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Pitch, degrees.
    pub pitch_deg: f32,
    /// Roll, degrees.
    pub roll_deg: f32,
}

/// Number of quantities that depend on the pose.
pub const POSE_ROWS: usize = 12;

/// Number of coefficients of each.
pub const POSE_TERMS: usize = 4;

/// Roll from which the contact changes with its magnitude rather than its square, rad: a pad is flat in its middle.
const FLAT_RAD: f32 = 0.05;

/// Largest logarithm of a factor.
const LOGARITHM_MAX: f32 = 2.0;

/// How the contact depends on the pose: each quantity a function of p and r, pitch less that of the fitted pose and roll,
/// both in rad. All zeros is a model of one pose.
///
/// Rows: logarithms of the factors on depth, normal force and area, of what strength and stiffness have beyond the factors that
/// normal force and area imply (N^beta A^(1 − beta) and the root of A), then tilt of the limit, slide along x per depth
/// and place of the contact along x, mm, each a p + b p² + c r² + d (√(r² + w²) − w) with w = 0.05; then slide along y per depth,
/// place of the contact along y, mm, and tilt of the limit along y, each a r + b p r + c r³ + d p² r. The place is that against
/// the fitted pose: spins go about the point under first touch in the fitted pose, from which springs and centre of pressure
/// then lie away.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PoseTable<T = f32> {
    /// Pitch of the fitted pose, degrees.
    pub pitch_deg: T,
    /// Least and largest pitch that the model was fitted in, degrees.
    pub pitch_range_deg: [T; 2],
    /// Largest roll to either side that the model was fitted in, degrees.
    pub roll_max_deg: T,
    /// The coefficients a, b, c, d of each row.
    pub rows: [[T; POSE_TERMS]; POSE_ROWS],
    /// Length by which the contact rolls on until nothing of it is left of what touched before, over the radius of a circle
    /// of its area; 0 for a finger that keeps its stretch.
    pub rolling_length: T,
    /// What another pose than the fitted one adds to the half-widths of the bands: shares of the normal force and of the
    /// friction limit.
    pub band: [T; 2],
}

impl<T: Scalar> PoseTable<T> {
    /// A model of the pose of this pitch and no roll alone.
    pub fn of_one_pose(pitch_deg: f32) -> Self {
        Self {
            pitch_deg: T::of(pitch_deg),
            pitch_range_deg: [T::of(pitch_deg); 2],
            roll_max_deg: T::of(0.0),
            rows: [[T::of(0.0); POSE_TERMS]; POSE_ROWS],
            rolling_length: T::of(0.0),
            band: [T::of(0.0); 2],
        }
    }

    /// Whether the model knows other poses than the fitted one.
    pub fn knows_poses(&self) -> bool {
        self.rows.iter().flatten().any(|x| *x != T::of(0.0))
    }

    /// The same table with `of` of every number.
    pub fn map<U>(&self, of: impl Fn(T) -> U + Copy) -> PoseTable<U> {
        PoseTable {
            pitch_deg: of(self.pitch_deg),
            pitch_range_deg: self.pitch_range_deg.map(of),
            roll_max_deg: of(self.roll_max_deg),
            rows: self.rows.map(|row| row.map(of)),
            rolling_length: of(self.rolling_length),
            band: self.band.map(of),
        }
    }

    /// All numbers, in the file's order.
    pub(crate) fn numbers(self) -> impl Iterator<Item = T> {
        let [least, most] = self.pitch_range_deg;
        let range = [self.pitch_deg, least, most, self.roll_max_deg];
        range.into_iter().chain(self.rows.into_iter().flatten()).chain([self.rolling_length]).chain(self.band)
    }

    /// Refuses what is not finite or too large.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let bad =
            |index: usize, value: T| Error::Range { what: Field::Pose, index: index as u16, value: value.to_f32() };
        if !(self.pitch_deg >= T::of(10.0) && self.pitch_deg <= T::of(70.0)) {
            return Err(bad(0, self.pitch_deg));
        }
        let [least, most] = self.pitch_range_deg;
        if !(least >= T::of(10.0) && least <= self.pitch_deg && self.pitch_deg <= most && most <= T::of(70.0)) {
            return Err(bad(0, least));
        }
        if !(self.roll_max_deg >= T::of(0.0) && self.roll_max_deg <= T::of(30.0)) {
            return Err(bad(0, self.roll_max_deg));
        }
        if let Some(share) = self.band.iter().find(|share| !(**share >= T::of(0.0) && **share <= T::of(10.0))) {
            return Err(bad(0, *share));
        }
        if !(self.rolling_length >= T::of(0.0)) {
            return Err(bad(0, self.rolling_length));
        }
        let numbers = self.rows.iter().flatten().chain([&self.rolling_length]).enumerate();
        numbers
            .filter(|(_, x)| !(x.magnitude() <= T::of(1000.0)))
            .map(|(i, x)| bad(i + 1, *x))
            .next()
            .map_or(Ok(()), Err)
    }

    /// The quantities in a pose.
    pub(crate) fn factors(&self, pose: Pose, beta: T, depth_max: T) -> Result<PoseFactors<T>, Error> {
        let Pose { pitch_deg, roll_deg } = pose;
        let refuse = |index, value| Err(Error::Range { what: Field::Pose, index, value });
        let is_another = pitch_deg != self.pitch_deg.to_f32() || roll_deg != 0.0;
        if !(10.0..=70.0).contains(&pitch_deg) || (is_another && !self.knows_poses()) {
            return refuse(0, pitch_deg);
        }
        if !(-30.0..=30.0).contains(&roll_deg) {
            return refuse(1, roll_deg);
        }
        let rad = T::of(core::f32::consts::PI / 180.0);
        let within = |x: T, [least, most]: [T; 2]| if x < least { least } else { x.at_most(most) };
        let pitch = within(T::of(pitch_deg), self.pitch_range_deg);
        let roll = within(T::of(roll_deg), [-self.roll_max_deg, self.roll_max_deg]);
        let is_fitted = pitch == T::of(pitch_deg) && roll == T::of(roll_deg);
        let (p, r) = ((pitch - self.pitch_deg) * rad, roll * rad);
        let square = r * r;
        let flat = T::of(FLAT_RAD);
        let edge = (square + flat * flat).magnitude().sqrt() - flat;
        let even = |[a, b, c, d]: [T; POSE_TERMS]| p * (a + b * p) + c * square + d * edge;
        let odd = |[a, b, c, d]: [T; POSE_TERMS]| r * (a + p * (b + d * p) + c * square);
        let least = T::of(-LOGARITHM_MAX);
        let factor = |row: [T; POSE_TERMS]| {
            let logarithm = even(row).at_most(T::of(LOGARITHM_MAX));
            T::of(core::f32::consts::E).power(if logarithm < least { least } else { logarithm })
        };
        let [normal, normal_deep, area, area_deep, limit, stiffness, tilt, press_x, place_x, press_y, place_y, tilt_y] =
            self.rows;
        let normal = [normal, normal_deep].map(factor);
        let area = [area, area_deep].map(factor);
        let limit = factor(limit);
        let pressed = [0, 1].map(|i| limit * (normal[i] / area[i]).power(beta) * area[i]);
        let line = |[touch, deep]: [T; 2]| [touch, (deep - touch) / depth_max];
        Ok(PoseFactors {
            normal: line(normal),
            area: line(area),
            limit: line(pressed),
            stiffness: (area[0] * area[1]).magnitude().sqrt().magnitude().sqrt() * factor(stiffness),
            tilt: [even(tilt), odd(tilt_y)],
            press: [even(press_x), odd(press_y)],
            offset: [even(place_x), odd(place_y)],
            band: if is_another { self.band } else { [T::of(0.0); 2] },
            status: if is_fitted { Status::OK } else { Status::POSE_OUT_OF_RANGE },
        })
    }
}

/// What a pose makes of the fitted contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFactors<T> {
    /// Factors at touch, and their change over depth, 1/mm.
    pub(crate) normal: [T; 2],
    pub(crate) area: [T; 2],
    pub(crate) limit: [T; 2],
    pub(crate) stiffness: T,
    pub(crate) tilt: [T; 2],
    pub(crate) press: [T; 2],
    pub(crate) offset: [T; 2],
    pub(crate) band: [T; 2],
    pub(crate) status: Status,
}
