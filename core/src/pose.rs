//! Pitch and roll of the finger against the plane.
//!
//! Main types: [`Pose`], [`PoseTable`]. Uses math.
//!
//! The contact in another pose is that of the fitted one with other factors, smooth in the pose: normal force, area, strength,
//! stiffness and the arms of the springs are multiplied, the limit is tilted, and pressing slides the pad another way. A change
//! of pose in contact rolls the finger: skin that leaves the contact takes its stretch along, and what takes its place touches
//! without any.

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
pub const POSE_ROWS: usize = 21;

/// Number of coefficients of each.
pub const POSE_TERMS: usize = 6;

/// Roll from which the contact changes with its magnitude rather than its square, rad: a pad is flat in its middle.
const FLAT_RAD: f32 = 0.05;

/// Largest x of a factor (1 + x/16)^16.
const FACTOR_MAX: f32 = 3.0;

/// Largest x of the factors on the ratio of the stiffnesses and on that of the strengths.
const RATIO_MAX: f32 = 0.7;

/// How the contact depends on the pose: each quantity a function of p and r, pitch less that of the fitted pose and roll,
/// both in rad, and of e = √(r² + w²) − w with w = 0.05, the roll's magnitude. All zeros is a model of one pose.
///
/// Rows:
///
/// * 0 to 2, normal force: x of the factors (1 + x/16)^16 at touch and at the deepest press of the poses; the shape between
///   them, s: over the share d of that depth the factor goes from one to the other as d (1 + s (1 − d)), s held within −1 and 1.
/// * 3 to 5, area, likewise.
/// * 6, strength: x of the factor beyond the one that normal force and area imply, N^beta A^(1 − beta).
/// * 7, depth at which the contact begins, mm, 0 where the row is negative: skin that is held at the nail bears nothing.
/// * 8 to 10, x of the factors on stiffness, beyond a fourth of the area's two, by which the springs' arms change as well; on stiffness
///   along y over that along x; on strength along y over that along x.
/// * 11 to 15, along x: slide per depth; tilt of the limit; place of the pressure, mm, and from it that of friction; slide that the
///   pose amounts to, mm, as the plane turns about a point beside the contact.
/// * 16 to 20, the same along y.
///
/// With coefficients a to g a row is p (a + b p + c p²) + e (d + f p + g e), in the shapes and the depth of touch a + p (b + c p) +
/// e (d + f p + g e), and along y r (a + p (b + c p) + e (d + f p + g e)).
///
/// Places are those against the fitted pose: spins go about the point under first touch in the fitted pose, from which springs
/// and centre of pressure then lie away.
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
    /// Deepest press in another pose that the model was fitted to, mm: factors stay as they are beyond.
    pub depth_max_mm: T,
    /// The coefficients of each row.
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
            depth_max_mm: T::of(1.0),
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
            depth_max_mm: of(self.depth_max_mm),
            rows: self.rows.map(|row| row.map(of)),
            rolling_length: of(self.rolling_length),
            band: self.band.map(of),
        }
    }

    /// All numbers, in the file's order.
    pub(crate) fn numbers(self) -> impl Iterator<Item = T> {
        let [least, most] = self.pitch_range_deg;
        let range = [self.pitch_deg, least, most, self.roll_max_deg, self.depth_max_mm];
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
        if !(self.depth_max_mm >= T::of(0.1) && self.depth_max_mm <= T::of(20.0)) {
            return Err(bad(0, self.depth_max_mm));
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
    pub(crate) fn factors(&self, pose: Pose, beta: T) -> Result<PoseFactors<T>, Error> {
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
        let flat = T::of(FLAT_RAD);
        let e = (r * r + flat * flat).sqrt() - flat;
        let rolled = |[.., d, f, g]: [T; POSE_TERMS]| d + f * p + g * e;
        let even = |row: [T; POSE_TERMS]| p * (row[0] + p * (row[1] + row[2] * p)) + e * rolled(row);
        let free = |row: [T; POSE_TERMS]| row[0] + p * (row[1] + row[2] * p) + e * rolled(row);
        let odd = |row: [T; POSE_TERMS]| r * (row[0] + p * (row[1] + row[2] * p) + e * rolled(row));
        let [normal, normal_deep, normal_shape, area, area_deep, area_shape, limit, touch, ..] = self.rows;
        let touch_mm = free(touch).not_negative();
        let [
            ..,
            stiffness,
            ratio,
            strength,
            press_x,
            tilt_x,
            pressure_x,
            friction_x,
            slide_x,
            press_y,
            tilt_y,
            pressure_y,
            friction_y,
            slide_y,
        ] = self.rows;
        let normal = [even(normal), even(normal_deep)];
        let area = [even(area), even(area_deep)];
        let beyond = even(limit);
        let limit = [0, 1].map(|i| beyond + beta * normal[i] + (T::of(1.0) - beta) * area[i]);
        let per = T::of(1.0) / self.depth_max_mm;
        let over_depth = |x: [T; 2], row: [T; POSE_TERMS]| {
            let [touch, deep] = x.map(factor);
            let (rise, shape) = ((deep - touch) * per, held(free(row), T::of(1.0)));
            let bend = -(rise * shape * per);
            // Counted from the depth at which the contact begins.
            let slope = rise + rise * shape - (bend + bend) * touch_mm;
            [touch - touch_mm * (slope + bend * touch_mm), slope, bend]
        };
        let size = T::of(0.25) * (area[0] + area[1]);
        let stiffness = even(stiffness) + size;
        let (normal, area) = (over_depth(normal, normal_shape), over_depth(area, area_shape));
        let limit = self.limit_over_depth(limit.map(factor), normal, area, beta, touch_mm);
        let most = T::of(RATIO_MAX);
        let [pressure_x, pressure_y] = [even(pressure_x), odd(pressure_y)];
        Ok(PoseFactors {
            normal,
            area,
            limit,
            touch_mm,
            depth_max_mm: self.depth_max_mm + touch_mm,
            arm: factor(size),
            stiffness: factor(stiffness),
            stiffness_ratio: factor(held(even(ratio), most)),
            strength_ratio: factor(held(even(strength), most)),
            tilt: [even(tilt_x), odd(tilt_y)],
            press: [even(press_x), odd(press_y)],
            slide: [even(slide_x), odd(slide_y)],
            pressure_place: [pressure_x, pressure_y],
            friction_place: [pressure_x + even(friction_x), pressure_y + odd(friction_y)],
            band: if is_another { self.band } else { [T::of(0.0); 2] },
            status: if is_fitted { Status::OK } else { Status::POSE_OUT_OF_RANGE },
        })
    }
}

impl<T: Scalar> PoseTable<T> {
    /// The factor on the strength as a parabola over depth: its ends, and half-way between those of normal force and area in their
    /// shares, less what the mean of these is above the ends.
    fn limit_over_depth(&self, [touch, deep]: [T; 2], normal: [T; 3], area: [T; 3], beta: T, touch_mm: T) -> [T; 3] {
        let mean = |share: f32| {
            let depth = touch_mm + T::of(share) * self.depth_max_mm;
            let at = |x: [T; 3]| x[0] + depth * (x[1] + x[2] * depth);
            let (normal, area) = (at(normal), at(area));
            area + beta * (normal - area)
        };
        let half = T::of(0.5);
        let middle = mean(0.5) * half * (touch / mean(0.0) + deep / mean(1.0));
        let per = T::of(1.0) / self.depth_max_mm;
        let bend = T::of(2.0) * (touch + deep - middle - middle) * per * per;
        let slope = (deep - touch) * per - bend * (self.depth_max_mm + touch_mm + touch_mm);
        [touch - touch_mm * (slope + bend * touch_mm), slope, bend]
    }
}

/// A number held within ±most.
fn held<T: Scalar>(x: T, most: T) -> T {
    if x < -most { -most } else { x.at_most(most) }
}

/// (1 + x/16)^16, near e^x, positive and rising.
fn factor<T: Scalar>(x: T) -> T {
    let root = T::of(1.0) + held(x, T::of(FACTOR_MAX)) * T::of(1.0 / 16.0);
    let square = root * root;
    let fourth = square * square;
    let eighth = fourth * fourth;
    eighth * eighth
}

/// What a pose makes of the fitted contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFactors<T> {
    /// Factors at touch, and the factors of depth, 1/mm, and of its square.
    pub(crate) normal: [T; 3],
    pub(crate) area: [T; 3],
    pub(crate) limit: [T; 3],
    /// Depth at which the contact begins, mm.
    pub(crate) touch_mm: T,
    /// Depth beyond which the factors stay as they are, mm.
    pub(crate) depth_max_mm: T,
    /// Factor on the springs' arms.
    pub(crate) arm: T,
    pub(crate) stiffness: T,
    pub(crate) stiffness_ratio: T,
    pub(crate) strength_ratio: T,
    pub(crate) tilt: [T; 2],
    pub(crate) press: [T; 2],
    /// Slide that the pose amounts to, mm.
    pub(crate) slide: [T; 2],
    pub(crate) pressure_place: [T; 2],
    pub(crate) friction_place: [T; 2],
    pub(crate) band: [T; 2],
    pub(crate) status: Status,
}
