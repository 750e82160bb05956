//! Pitch and roll of the finger against the plane.
//!
//! Main types: [`Pose`], [`PoseTable`]. Uses math.
//!
//! The contact in another pose is that of the fitted one with other factors, smooth in the pose: depth is stretched (the
//! pad that touches is rounder or flatter), normal force, area, strength and stiffness are multiplied, the limit is tilted,
//! and pressing slides the pad another way.

use crate::Error;
use crate::error::Field;
use crate::math::Scalar;

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
pub const POSE_ROWS: usize = 11;

/// How the contact depends on the pose: each quantity a quadratic in p and r, pitch less that of the fitted pose and roll,
/// both in rad. All zeros is a model of one pose.
///
/// Rows: factors on depth, normal force, area, strength and stiffness less 1, then tilt of the limit, slide along x per depth
/// and place of the contact along x, mm, each a p + b p² + c r²; then slide along y per depth, place of the contact along y, mm,
/// and tilt of the limit along y, each a r + b p r + c r³. The place is that against the fitted pose: spins go about the point
/// under first touch in the fitted pose, from which springs and centre of pressure then lie away.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PoseTable<T = f32> {
    /// Pitch of the fitted pose, degrees.
    pub pitch_deg: T,
    /// The coefficients a, b, c of each row.
    pub rows: [[T; 3]; POSE_ROWS],
    /// What another pose than the fitted one adds to the half-widths of the bands: shares of the normal force and of the
    /// friction limit.
    pub band: [T; 2],
}

impl<T: Scalar> PoseTable<T> {
    /// A model of the pose of this pitch and no roll alone.
    pub fn of_one_pose(pitch_deg: f32) -> Self {
        Self { pitch_deg: T::of(pitch_deg), rows: [[T::of(0.0); 3]; POSE_ROWS], band: [T::of(0.0); 2] }
    }

    /// Whether the model knows other poses than the fitted one.
    pub fn knows_poses(&self) -> bool {
        self.rows.iter().flatten().any(|x| *x != T::of(0.0))
    }

    /// Refuses what is not finite or too large.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let bad =
            |index: usize, value: T| Error::Range { what: Field::Pose, index: index as u16, value: value.to_f32() };
        if !(self.pitch_deg >= T::of(10.0) && self.pitch_deg <= T::of(70.0)) {
            return Err(bad(0, self.pitch_deg));
        }
        if let Some(share) = self.band.iter().find(|share| !(**share >= T::of(0.0) && **share <= T::of(10.0))) {
            return Err(bad(0, *share));
        }
        let numbers = self.rows.iter().flatten().enumerate();
        numbers
            .filter(|(_, x)| !(x.magnitude() <= T::of(1000.0)))
            .map(|(i, x)| bad(i + 1, *x))
            .next()
            .map_or(Ok(()), Err)
    }

    /// The quantities in a pose.
    pub(crate) fn factors(&self, pose: Pose) -> Result<PoseFactors<T>, Error> {
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
        let (p, r) = ((T::of(pitch_deg) - self.pitch_deg) * rad, T::of(roll_deg) * rad);
        let square = r * r;
        let even = |[a, b, c]: [T; 3]| p * (a + b * p) + c * square;
        let odd = |[a, b, c]: [T; 3]| r * (a + b * p + c * square);
        let [least, most] = [0.1, 10.0].map(T::of);
        let factor = |row: [T; 3]| {
            let factor = (T::of(1.0) + even(row)).at_most(most);
            if factor < least { least } else { factor }
        };
        let [depth, normal, area, limit, stiffness, tilt, press_x, place_x, press_y, place_y, tilt_y] = self.rows;
        Ok(PoseFactors {
            depth: factor(depth),
            normal: factor(normal),
            area: factor(area),
            limit: factor(limit),
            stiffness: factor(stiffness),
            tilt: [even(tilt), odd(tilt_y)],
            press: [even(press_x), odd(press_y)],
            offset: [even(place_x), odd(place_y)],
            band: if is_another { self.band } else { [T::of(0.0); 2] },
        })
    }
}

/// What a pose makes of the fitted contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFactors<T> {
    pub(crate) depth: T,
    pub(crate) normal: T,
    pub(crate) area: T,
    pub(crate) limit: T,
    pub(crate) stiffness: T,
    pub(crate) tilt: [T; 2],
    pub(crate) press: [T; 2],
    pub(crate) offset: [T; 2],
    pub(crate) band: [T; 2],
}
