//! What a change of pose in contact does to the springs.
//!
//! Main type: [`Rolled`]. Uses math.
//!
//! A finger that is pitched or rolled in contact rolls: the contact moves over its skin and over the plane alike.
//!
//! * **What leaves** takes its stretch along, and what touches in its place has none: as the contact rolls on, the stretch that is left
//!   falls by a share of what is there. Within a range behind the place, over which the contact has rolled, it has touched
//!   without stretch already: rolling to and fro within it costs nothing, as a cycle of depth does. What touched without stretch
//!   gets its own as the plane slides on; the range therefore shrinks with the slide, to nothing where that slips fully. Slides to and
//!   fro are remembered alike, in a circle that widens with them and shrinks as the contact rolls on: within it, and by up to
//!   [`NOTICED_MM`], nothing is stretched anew. A held load therefore stays while both slide and pose vibrate, by any amplitude
//!   below full slip: the first cycles cost, the others nothing.
//! * **What comes on top.** A contact that grows with the pose is stiffer, but what touches anew bears nothing until the plane slides on:
//!   friction stays as it is while the pose stiffens the contact, and comes back as it was when the pose is turned back. Only from the
//!   stiffness at which it was last stretched downwards does it fall with the stiffness.

use crate::math::Scalar;
use crate::pose::{ROLLED_MM, sixteenth_power};

/// Slide to and fro that stretches nothing anew, mm to either side, from the start. With 0.025 errors against the finite
/// elements are within 0.2 % of the limit of the same.
const NOTICED_MM: f32 = 0.1;

/// What touched without stretch comes to bear this many times sooner than in a slide of full slip.
const SOON: f32 = 8.0;

/// Share of the stiffness below which nothing is missing.
const MISSING: f32 = 1e-6;

/// Longest range behind the place, over the length by which the contact rolls on until 1/e of the stretch is left: for the
/// finger that ships about a diameter of the contact, as what is farther has left it altogether. Between 0.1 and 1 errors against the
/// finite elements are within 0.5 % of the limit of the same.
const RANGE: f32 = 0.5;

/// Bounds of the factor of a pose on the stiffness, beyond those of any pose.
const BEARING_MIN: f32 = 1e-5;
const STIFFNESS_MAX: f32 = 1e3;

/// Where the contact has rolled.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Rolled<T> {
    /// Least and largest place of the contact along x and y, mm.
    pub(crate) range: [[T; 2]; 2],
    /// Its last place.
    pub(crate) place: [T; 2],
    /// Middle of the circle within which the plane has slid to and fro, mm, and its radius: what leads out of it counts as slide.
    pub(crate) slide: [T; 2],
    pub(crate) play: T,
    /// Pitch against the fitted pose and roll, rad.
    pub(crate) angles: [T; 2],
    /// Factor of the pose on the stiffness, and the part of it that bears.
    pub(crate) stiffness: T,
    pub(crate) bearing: T,
}

/// A contact's pose as rolling sees it.
#[derive(Clone, Copy)]
pub struct Posture<T> {
    /// Where the contact lies, mm from where it does in the fitted pose.
    pub(crate) place: [T; 2],
    /// Pitch against the fitted pose and roll, rad.
    pub(crate) angles: [T; 2],
    /// Factor on the stiffness.
    pub(crate) stiffness: T,
}

impl<T: Scalar> Rolled<T> {
    /// A contact that has not rolled.
    #[inline(always)]
    pub(crate) fn at(posture: Posture<T>, slide: [T; 2]) -> Self {
        let Posture { place, angles, stiffness } = posture;
        Self {
            range: place.map(|mm| [mm; 2]),
            place,
            slide,
            play: T::of(NOTICED_MM),
            angles,
            stiffness,
            bearing: stiffness,
        }
    }

    /// Whether the contact is in the pose that it was in, and all of it bears.
    #[inline(always)]
    pub(crate) fn rests_at(&self, [pitch, roll]: [T; 2]) -> bool {
        (pitch == self.angles[0]) & (roll == self.angles[1]) & (self.bearing == self.stiffness)
    }

    /// Whether the share of the stiffness that bears is within what poses can leave. A step checks this, as it divides by the share.
    #[inline(always)]
    pub(crate) fn bears(&self) -> bool {
        (self.bearing >= T::of(BEARING_MIN))
            & (self.bearing <= self.stiffness)
            & (self.stiffness <= T::of(STIFFNESS_MAX))
    }

    /// Share of the stiffness that bears.
    #[inline(always)]
    pub(crate) fn bearing_share(&self) -> T {
        if self.bearing < self.stiffness { self.bearing / self.stiffness } else { T::of(1.0) }
    }

    /// The range over which the contact has rolled over [`ROLLED_MM`], at most 1.
    #[inline(always)]
    pub(crate) fn share(&self) -> T {
        let [x, y] = self.range.map(|[least, most]| (most - least) * T::of(1.0 / ROLLED_MM));
        let range = (x * x + y * y).magnitude().sqrt();
        if range < T::of(1.0) { range } else { T::of(1.0) }
    }

    /// Rolls to another pose and returns the factor on the stretch: 1 within the range.
    ///
    /// * `slide`: of the plane, mm
    /// * `full`: slide of full slip, mm
    /// * `length`: way on which 1/e of the stretch is left, mm
    #[inline(never)]
    pub(crate) fn roll_to(&mut self, posture: Posture<T>, slide: [T; 2], full: T, length: T) -> T {
        let one = T::of(1.0);
        let mut kept = one;
        let [dx, dy] = [slide[0] - self.slide[0], slide[1] - self.slide[1]];
        let gone = (dx * dx + dy * dy).magnitude().sqrt();
        if gone > self.play {
            let noticed = gone - self.play;
            // The circle reaches to where the plane is now, and not much farther back than full slip to either side.
            let widened = self.play + T::of(0.5) * noticed;
            self.play = widened.at_most(full + T::of(NOTICED_MM));
            let behind = self.play / gone;
            self.slide = [slide[0] - behind * dx, slide[1] - behind * dy];
            let shrunk = (noticed / full).at_most(one);
            for (range, place) in self.range.iter_mut().zip(self.place) {
                // Rounding must not carry an end past the place.
                let [least, most] = range.map(|end| end + shrunk * (place - end));
                *range = [least.at_most(place), if most < place { place } else { most }];
            }
            // The slide stretches what touched without stretch: more of it bears, the same force.
            let missing = self.stiffness - self.bearing;
            let recovered = self.bearing + (T::of(SOON) * shrunk).at_most(one) * missing;
            let bearing = if missing > T::of(MISSING) * self.stiffness { recovered } else { self.stiffness };
            kept = self.bearing / bearing;
            self.bearing = bearing;
        }
        let longest = T::of(RANGE) * length;
        let mut beyond = T::of(0.0);
        for (range, place) in self.range.iter_mut().zip(posture.place) {
            let [least, most] = *range;
            // Beyond the range its other end follows.
            if place < least {
                beyond += least - place;
                *range = [place, most.at_most(place + longest)];
            } else if most < place {
                beyond += place - most;
                let behind = place - longest;
                *range = [if least < behind { behind } else { least }, place];
            }
        }
        if beyond > T::of(0.0) {
            kept = kept / sixteenth_power(one + T::of(1.0 / 16.0) * (beyond / length));
            // Skin that touches anew knows nothing of the slide to and fro.
            let anew = (beyond / longest).at_most(one);
            let [ahead, aside] = [0, 1].map(|k| anew * (slide[k] - self.slide[k]));
            self.slide = [self.slide[0] + ahead, self.slide[1] + aside];
            self.play += anew * (T::of(NOTICED_MM) - self.play);
        }
        self.place = posture.place;
        self.angles = posture.angles;
        self.stiffness = posture.stiffness;
        self.bearing = self.bearing.at_most(posture.stiffness);
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: f64 = 6.0;
    const FULL: f64 = 1.0;

    fn posture(x: f64, stiffness: f64) -> Posture<f64> {
        Posture { place: [x, 0.5 * x], angles: [0.1 * x, 0.0], stiffness }
    }

    fn begun() -> Rolled<f64> {
        Rolled::at(posture(0.0, 1.0), [0.0; 2])
    }

    /// Rolls from place to place and returns the factor on the stretch.
    fn roll(rolled: &mut Rolled<f64>, places: impl IntoIterator<Item = f64>, slide: f64) -> f64 {
        places.into_iter().map(|x| rolled.roll_to(posture(x, 1.0), [slide, 0.0], FULL, LENGTH)).product()
    }

    /// What is lost depends on where the contact has been, not on the number of steps.
    #[test]
    fn many_small_steps_lose_what_a_large_one_does() {
        let [mut small, mut large] = [begun(); 2];
        let kept = roll(&mut small, (1..=1000).map(|i| 2e-3 * f64::from(i)), 0.0);
        let at_once = roll(&mut large, [2.0], 0.0);
        // 2 mm along x and 1 mm along y.
        assert!((kept - f64::exp(-3.0 / LENGTH)).abs() < 1e-5, "{kept}");
        assert!((kept - at_once).abs() < 0.01, "{kept} {at_once}");
    }

    #[test]
    fn to_and_fro_costs_once() {
        let mut rolled = begun();
        assert!(roll(&mut rolled, [0.7, -0.4], 0.0) < 0.9);
        // While the slide vibrates.
        for i in 0..1000 {
            let slide = if i % 2 == 0 { 0.09 } else { -0.09 };
            assert_eq!(roll(&mut rolled, [0.7, 0.1, -0.4, 0.0], slide), 1.0);
        }
    }

    /// With a slide to and fro of any length below full slip: after the first cycles nothing is lost any more.
    #[test]
    fn to_and_fro_costs_once_while_the_slide_vibrates_far() {
        for mm in [0.15, 0.3, 0.6] {
            let mut rolled = begun();
            let mut cycle = || {
                roll(&mut rolled, [0.7, 0.0], mm) * roll(&mut rolled, [0.1, -0.4], -mm) * roll(&mut rolled, [-0.4], mm)
            };
            let first: f64 = (0..5).map(|_| cycle()).product();
            let others: f64 = (0..1000).map(|_| cycle()).product();
            assert!(first > 0.4 && first < 0.9 && others > 0.98, "{mm}: {first} {others}");
        }
    }

    #[test]
    fn a_slide_lets_the_contact_roll_on_at_a_cost() {
        let mut rolled = begun();
        roll(&mut rolled, [1.0, 0.0], 0.0);
        assert_eq!(roll(&mut rolled, [1.0], 0.0), 1.0);
        assert!(roll(&mut rolled, [0.0], 0.8) < 0.9);
    }

    /// Far from where it touched nothing is left, and the range behind the place is no longer than its share of the length.
    #[test]
    fn far_away_nothing_is_left() {
        let mut rolled = begun();
        assert!(roll(&mut rolled, (1..=100).map(f64::from), 0.0) < 1e-9);
        let [least, most] = rolled.range[0];
        assert!(most == 100.0 && (most - least - f64::from(RANGE) * LENGTH).abs() < 1e-6, "{least} {most}");
        assert!(roll(&mut begun(), [f64::from(f32::MAX)], 0.0) >= 0.0);
    }

    /// Stiffness that comes on top bears nothing until the plane slides; what goes takes its force along.
    #[test]
    fn what_comes_on_top_bears_nothing() {
        let mut rolled = begun();
        let mut stretch = 1.0;
        let mut to = |rolled: &mut Rolled<f64>, stiffness: f64, slide: f64| {
            stretch *= rolled.roll_to(posture(0.0, stiffness), [slide, 0.0], FULL, LENGTH);
            stretch * stiffness * rolled.bearing_share()
        };
        assert_eq!(to(&mut rolled, 2.0, 0.0), 1.0);
        assert_eq!(to(&mut rolled, 1.5, 0.0), 1.0);
        assert_eq!(to(&mut rolled, 1.0, 0.0), 1.0);
        assert_eq!(to(&mut rolled, 0.5, 0.0), 0.5);
        assert_eq!(to(&mut rolled, 2.0, 0.0), 0.5, "what has gone does not come back");
        assert!(!rolled.rests_at([0.0; 2]));
        // A slide stretches all that touches: the same force from all of it. One to and fro does not.
        for slide in [0.09, -0.09].repeat(100) {
            for stiffness in [1.9, 2.0] {
                let force = to(&mut rolled, stiffness, slide);
                assert!((force - 0.5).abs() < 1e-12, "{force}");
            }
        }
        assert!(!rolled.rests_at([0.0; 2]));
        assert_eq!(to(&mut rolled, 2.0, 0.3), 0.5);
        assert!(rolled.rests_at([0.0; 2]));
        assert_eq!(to(&mut rolled, 1.0, 0.3), 0.25);
    }
}
