//! Pitch and roll of the finger against the plane.
//!
//! Main types: [`Pose`], [`PoseTable`]. Uses math.
//!
//! The contact in another pose is that of the fitted one with other factors, smooth in the pose: normal force, area, strength,
//! stiffness and the arms of the springs are multiplied, the limit is tilted, and pressing slides the pad another way. A change
//! of pose in contact rolls the finger: it amounts to a slide, skin that leaves the contact takes its stretch along, and what touches
//! anew has none (`rolling.rs`).

use crate::Error;
use crate::error::Field;
use crate::math::{Arithmetic, Scalar};
use crate::step::rare;

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

/// Number of coefficients by which a model depends on the pose.
pub const POSE_COEFFICIENTS: usize = 57;

/// Range over which a contact has rolled from which on a change of pose counts in full in the bands, mm.
pub(crate) const ROLLED_MM: f32 = 1.0;

/// Roll at which the contact is about to leave the flat of the pad for its edge, rad.
const EDGE_RAD: f32 = 0.12;

/// Largest x of a factor (1 + x/16)^16.
const FACTOR_MAX: f32 = 5.0;

/// Largest x of the factor on the ratio of the stiffnesses.
const RATIO_MAX: f32 = 0.7;

/// Largest tilt of a limit along x or y.
pub(crate) const TILT_MAX: f32 = 0.25;

/// How the contact depends on the pose. All coefficients 0 is a model of one pose.
///
/// With p the pitch less that of the fitted pose and r the roll, both in rad and held within what the model was fitted in, each
/// quantity is a sum of these terms times a coefficient. Of the roll's magnitude there are e = √(r² + w²) − w, which grows on, and
/// s = 1 − w/√(r² + w²), which goes from 0 to 1 as the contact moves from the flat of the pad to its edge, with w = 0.12.
///
/// | coefficients | quantity | terms |
/// |---|---|---|
/// | 0 to 5, 6 to 11 | normal force: x of the factors (1 + x/16)^16 at touch and at the deepest press of the poses | p, p², p³, p⁴, s, s p |
/// | 12 to 17 | area: the same at touch | p, p², p³, p⁴, s, s p |
/// | 18 to 24 | and at the deepest press | p, p², p³, p⁴, e, e p, s |
/// | 25 to 27 | stiffness: x of the factor beyond a fourth of the area's two, by which the springs' arms change as well | p, p², s |
/// | 28, 29 | stiffness along y over that along x: x of the factor | p, s |
/// | 30; 31 | along x, slide per depth; tilt of the limit | p; p |
/// | 32 to 35 | place of the contact along x, mm | p, p², s, s p |
/// | 36 to 38 | along y, slide per depth | r, r s, r p |
/// | 39, 40 | tilt of the limit | r, r p |
/// | 41 to 44 | place of the contact along y, mm | r, r s, r p, r p² |
/// | 45 to 48; 49, 50 | slide along x, mm, that pitching amounts to, per rad; that rolling does | 1, p, p², s; r, r p |
/// | 51 to 54; 55, 56 | slide along y, mm, that rolling amounts to, per rad; that pitching does | 1, p, p², s; r, r p |
///
/// Over the share d of the deepest press a factor goes from its value at touch to that at the deepest as d (2 − d). The factor on the
/// strength is the one that those on normal force and area imply, N^beta A^(1 − beta). Turning amounts to a slide as the plane turns
/// about a point beside the contact; as a ball that rolls, a finger that is pitched and rolled around a closed way need not end where it
/// began. There and back the same way it does.
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
    /// The coefficients.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    #[cfg_attr(feature = "serde", serde(bound(serialize = "T: serde::Serialize")))]
    #[cfg_attr(feature = "serde", serde(bound(deserialize = "T: Scalar + serde::Deserialize<'de>")))]
    pub coefficients: [T; POSE_COEFFICIENTS],
    /// Length by which the contact rolls on until 1/e of its stretch is left, over the radius of a circle of its area; 0 for a
    /// finger that keeps its stretch.
    pub rolling_length: T,
    /// What another pose than the fitted one adds to the half-widths of the bands: shares of the normal force and of the
    /// friction limit, each a parabola in the stick ratio: in full slip, and the factors of the ratio and of its square.
    pub band: [[T; 3]; 2],
    /// What a change of pose in contact adds to these parabolas, in full once the contact has rolled over a range of
    /// 1 mm, in its share below.
    pub band_rolled: [[T; 3]; 2],
}

impl<T: Scalar> PoseTable<T> {
    /// A model of the pose of this pitch and no roll alone.
    pub fn of_one_pose(pitch_deg: f32) -> Self {
        Self {
            pitch_deg: T::of(pitch_deg),
            pitch_range_deg: [T::of(pitch_deg); 2],
            roll_max_deg: T::of(0.0),
            depth_max_mm: T::of(1.0),
            coefficients: [T::of(0.0); POSE_COEFFICIENTS],
            rolling_length: T::of(0.0),
            band: [[T::of(0.0); 3]; 2],
            band_rolled: [[T::of(0.0); 3]; 2],
        }
    }

    /// Whether the model knows other poses than the fitted one.
    #[inline(never)]
    pub fn knows_poses(&self) -> bool {
        self.coefficients.iter().any(|x| *x != T::of(0.0))
    }

    /// The same table with `of` of every number.
    pub fn map<U>(&self, of: impl Fn(T) -> U + Copy) -> PoseTable<U> {
        PoseTable {
            pitch_deg: of(self.pitch_deg),
            pitch_range_deg: self.pitch_range_deg.map(of),
            roll_max_deg: of(self.roll_max_deg),
            depth_max_mm: of(self.depth_max_mm),
            coefficients: self.coefficients.map(of),
            rolling_length: of(self.rolling_length),
            band: self.band.map(|parabola| parabola.map(of)),
            band_rolled: self.band_rolled.map(|parabola| parabola.map(of)),
        }
    }

    /// All numbers, in the file's order.
    pub(crate) fn numbers(self) -> impl Iterator<Item = T> {
        let [least, most] = self.pitch_range_deg;
        let range = [self.pitch_deg, least, most, self.roll_max_deg, self.depth_max_mm];
        range
            .into_iter()
            .chain(self.coefficients)
            .chain([self.rolling_length])
            .chain(self.band.into_iter().chain(self.band_rolled).flatten())
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
        // What knows one pose alone must not answer as if it knew others.
        let is_of_one = least == self.pitch_deg && most == self.pitch_deg && self.roll_max_deg == T::of(0.0);
        if !(is_of_one || self.knows_poses()) {
            return Err(bad(0, most));
        }
        let sum = |[a, b, c]: [T; 3], [d, e, f]: [T; 3]| [a + d, b + e, c + f];
        let ([normal, friction], [normal_rolled, friction_rolled]) = (self.band, self.band_rolled);
        for [slip, rate, bend] in [normal, friction, sum(normal, normal_rolled), sum(friction, friction_rolled)] {
            for stick in [0.0, 0.25, 0.5, 0.75, 1.0].map(T::of) {
                let share = slip + stick * (rate + stick * bend);
                if !(share >= T::of(0.0) && share <= T::of(10.0)) {
                    return Err(bad(0, share));
                }
            }
        }
        if !(self.rolling_length >= T::of(0.0)) {
            return Err(bad(0, self.rolling_length));
        }
        let numbers = self.coefficients.iter().chain([&self.rolling_length]).enumerate();
        numbers
            .filter(|(_, x)| !(x.magnitude() <= T::of(1000.0)))
            .map(|(i, x)| bad(i + 1, *x))
            .next()
            .map_or(Ok(()), Err)
    }

    /// Whether the model was fitted in a pose.
    #[inline(always)]
    pub(crate) fn holds(&self, [pitch, roll]: [T; 2]) -> bool {
        let [least, most] = self.pitch_range_deg;
        pitch >= least && pitch <= most && roll.magnitude() <= self.roll_max_deg
    }

    /// The quantities at a pitch and a roll, degrees, that the model was fitted in.
    ///
    /// * `beta`: exponent of the friction law, −1 to 2, for which the root of the factor on the strength stays above 0
    #[inline(always)]
    pub(crate) fn factors(&self, [pitch, roll]: [T; 2], beta: T) -> PoseFactors<T> {
        let turned = pitch - self.pitch_deg;
        let away_bits = turned.to_f32().to_bits() | roll.to_f32().to_bits();
        let rad = T::of(core::f32::consts::PI / 180.0);
        let (p, r) = (turned * rad, roll * rad);
        let (one, edge) = (T::of(1.0), T::of(EDGE_RAD));
        let root = (r * r + edge * edge).sqrt();
        let (e, s) = (root - edge, one - edge / root);
        let c = &self.coefficients;
        // What goes into factors is a 16th throughout, which is exact.
        let [p16, e16, s16] = [p, e, s].map(|x| x * T::of(1.0 / 16.0));
        let quartic = |[a, b, c, d]: [T; 4]| p16 * (a + p * (b + p * (c + p * d)));
        let mut x = [
            quartic([c[0], c[1], c[2], c[3]]) + s16 * (c[4] + c[5] * p),
            quartic([c[6], c[7], c[8], c[9]]) + s16 * (c[10] + c[11] * p),
            quartic([c[12], c[13], c[14], c[15]]) + s16 * (c[16] + c[17] * p),
            quartic([c[18], c[19], c[20], c[21]]) + e16 * (c[22] + c[23] * p) + s16 * c[24],
            p16 * (c[25] + c[26] * p) + c[27] * s16,
            c[28] * p16 + c[29] * s16,
        ];
        // None is beyond the most where the root of all squares is not.
        let scaled_ratio = x[5] * T::of(FACTOR_MAX / RATIO_MAX);
        let squares = x[1..5].iter().fold(x[0] * x[0], |sum, x| sum + *x * *x) + scaled_ratio * scaled_ratio;
        if !(squares <= T::of(FACTOR_MAX * FACTOR_MAX / 256.0)) {
            x = all_held(x);
        }
        let [normal, area] = [[one + x[0], one + x[1]], [one + x[2], one + x[3]]];
        let limit = [0, 1].map(|i| area[i] + beta * (normal[i] - area[i]));
        let size = T::of(0.25) * (x[2] + x[3]);
        let over_depth = |roots: [T; 2]| {
            let [touch, deep] = roots.map(sixteenth_power);
            [touch, deep - touch]
        };
        PoseFactors {
            normal: over_depth(normal),
            area: over_depth(area),
            limit: over_depth(limit),
            per_depth_max: one / self.depth_max_mm,
            arm_root: one + size,
            stiffness: sixteenth_power(one + (x[4] + size)),
            stiffness_ratio: sixteenth_power(one + x[5]),
            tilt: [c[31] * p, held(r * (c[39] + c[40] * p), T::of(TILT_MAX))],
            press: [c[30] * p, r * (c[36] + c[37] * s + c[38] * p)],
            angles: [p, r],
            place: [p * (c[32] + c[33] * p + c[35] * s) + c[34] * s, r * (c[41] + c[42] * s + p * (c[43] + c[44] * p))],
            away_bits,
        }
    }

    /// Slide along x and y, mm, that turning from a pitch against the fitted pose and a roll to others amounts to, rad: by the rates
    /// half way.
    #[inline(always)]
    pub(crate) fn slide(&self, from: [T; 2], to: [T; 2]) -> [T; 2] {
        let [pitched, rolled] = [to[0] - from[0], to[1] - from[1]];
        let [p, r] = [0, 1].map(|k| T::of(0.5) * (from[k] + to[k]));
        let edge = T::of(EDGE_RAD);
        let s = T::of(1.0) - edge / (r * r + edge * edge).sqrt();
        let c = &self.coefficients;
        let even = |c: [T; 4]| c[0] + p * (c[1] + c[2] * p) + c[3] * s;
        let odd = |c: [T; 2]| r * (c[0] + c[1] * p);
        [
            pitched * even([c[45], c[46], c[47], c[48]]) + rolled * odd([c[49], c[50]]),
            rolled * even([c[51], c[52], c[53], c[54]]) + pitched * odd([c[55], c[56]]),
        ]
    }

    /// Pitch and roll, degrees, nearest to a pose among those that the model was fitted in.
    #[cold]
    #[inline(never)]
    pub(crate) fn nearest(&self, [pitch, roll]: [T; 2]) -> Result<[T; 2], Error> {
        let refuse = |index, value: T| Err(Error::Range { what: Field::Pose, index, value: value.to_f32() });
        if !(pitch >= T::of(10.0) && pitch <= T::of(70.0) && self.knows_poses()) {
            return refuse(0, pitch);
        }
        let within = |x: T, [least, most]: [T; 2]| if x < least { least } else { x.at_most(most) };
        let nearest = [within(pitch, self.pitch_range_deg), within(roll, [-self.roll_max_deg, self.roll_max_deg])];
        // A table whose ranges are no numbers holds no pose at all.
        if !(roll.magnitude() <= T::of(30.0) && self.holds(nearest)) {
            return refuse(1, roll);
        }
        Ok(nearest)
    }
}

/// A number held within ±most.
fn held<T: Scalar>(x: T, most: T) -> T {
    if x.magnitude() > most {
        rare();
        return if x < -most { -most } else { most };
    }
    x
}

/// Numbers that go into factors, the last into that on the ratio of the stiffnesses, each held within its most.
#[cold]
#[inline(never)]
fn all_held<T: Scalar>(mut x: [T; 6]) -> [T; 6] {
    for (k, x) in x.iter_mut().enumerate() {
        *x = held(*x, T::of(if k < 5 { FACTOR_MAX } else { RATIO_MAX } / 16.0));
    }
    x
}

/// (1 + x)^16 of 1 + x, near e^(16 x), positive and rising for x held within a 16th of [`FACTOR_MAX`].
#[inline(always)]
pub(crate) fn sixteenth_power<T: Arithmetic>(root: T) -> T {
    let square = root * root;
    let fourth = square * square;
    let eighth = fourth * fourth;
    eighth * eighth
}

/// What a pose makes of the fitted contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFactors<T> {
    /// Factors at touch, and what they change by to the deepest press.
    pub(crate) normal: [T; 2],
    pub(crate) area: [T; 2],
    pub(crate) limit: [T; 2],
    /// One over the depth beyond which the factors stay as they are, 1/mm.
    pub(crate) per_depth_max: T,
    /// 16th root of the factor on the springs' arms.
    pub(crate) arm_root: T,
    pub(crate) stiffness: T,
    pub(crate) stiffness_ratio: T,
    /// What the pose adds to the tilt along x, and the tilt along y.
    pub(crate) tilt: [T; 2],
    pub(crate) press: [T; 2],
    /// Pitch against the fitted pose and roll, rad.
    pub(crate) angles: [T; 2],
    /// Where the contact lies, mm along x and y from where it does in the fitted pose.
    pub(crate) place: [T; 2],
    /// All bits but the first are 0 in the fitted pose alone.
    pub(crate) away_bits: u32,
}
