//! What a change of pose in contact does to the springs.
//!
//! Main type: [`Rolled`]. Uses math.
//!
//! A finger that is pitched or rolled in contact rolls: the contact moves over its skin and over the plane alike. Skin that
//! leaves takes its stretch along, and what touches in its place has none. So the stretch that is left goes with the share of
//! the contact that has touched throughout, which falls with the range over which the contact has rolled: rolling to and
//! fro within a range costs once, as a cycle of depth does. What touched without stretch gets its own as the plane slides on;
//! the range therefore shrinks with the slide, to nothing where that slips fully.

use crate::math::Scalar;
use crate::pose::ROLLED_MM;

/// Slide below which the range stays as it is, mm: that of vibration and noise.
const NOTICED_MM: f32 = 0.025;

/// Where the contact has rolled.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Rolled<T> {
    /// Least and largest place of the contact along x and y, mm.
    pub(crate) range: [[T; 2]; 2],
    /// Its last place.
    pub(crate) place: [T; 2],
    /// Slide at which the range last shrank, mm.
    pub(crate) slide: [T; 2],
}

impl<T: Scalar> Rolled<T> {
    /// A contact that has not rolled.
    #[inline(always)]
    pub(crate) fn at(place: [T; 2], slide: [T; 2]) -> Self {
        Self { range: place.map(|mm| [mm; 2]), place, slide }
    }

    /// Whether the contact is where it was.
    #[inline(always)]
    pub(crate) fn is_at(&self, [x, y]: [T; 2]) -> bool {
        (x == self.place[0]) & (y == self.place[1])
    }

    /// The range over which the contact has rolled over [`ROLLED_MM`], at most 1.
    #[inline(always)]
    pub(crate) fn share(&self) -> T {
        let [x, y] = self.range.map(|[least, most]| (most - least) * T::of(1.0 / ROLLED_MM));
        let range = (x * x + y * y).magnitude().sqrt();
        if range < T::of(1.0) { range } else { T::of(1.0) }
    }

    /// Rolls to a place and returns the share of the stretch that is left: 1 within the range.
    ///
    /// * `slide`: of the plane, mm
    /// * `full`: slide of full slip, mm
    /// * `length`: range at which nothing is left, mm
    #[inline(never)]
    pub(crate) fn roll_to(&mut self, place: [T; 2], slide: [T; 2], full: T, length: T) -> T {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let [dx, dy] = [slide[0] - self.slide[0], slide[1] - self.slide[1]];
        let gone = (dx * dx + dy * dy).magnitude().sqrt();
        if gone > T::of(NOTICED_MM) {
            let shrunk = (gone / full).at_most(one);
            for (range, place) in self.range.iter_mut().zip(self.place) {
                *range = range.map(|end| end + shrunk * (place - end));
            }
            self.slide = slide;
        }
        let mut kept = one;
        for (range, place) in self.range.iter_mut().zip(place) {
            let [least, most] = *range;
            *range = [least.at_most(place), if most < place { place } else { most }];
            let left = (length - (range[1] - range[0])).not_negative();
            kept *= if left > zero { left / (length - (most - least)) } else { zero };
        }
        self.place = place;
        if !(kept > zero) {
            *self = Self::at(place, slide);
            return zero;
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: f64 = 6.0;
    const FULL: f64 = 1.0;

    fn roll(rolled: &mut Rolled<f64>, places: impl IntoIterator<Item = f64>, slide: f64) -> f64 {
        places.into_iter().map(|x| rolled.roll_to([x, 0.5 * x], [slide, 0.0], FULL, LENGTH)).product()
    }

    /// What is lost depends on where the contact has been, not on the number of steps.
    #[test]
    fn many_small_steps_lose_what_a_large_one_does() {
        let [mut small, mut large] = [Rolled::at([0.0; 2], [0.0; 2]); 2];
        let kept = roll(&mut small, (1..=1000).map(|i| 2e-3 * f64::from(i)), 0.0);
        let at_once = roll(&mut large, [2.0], 0.0);
        assert!((kept - at_once).abs() < 1e-12, "{kept} {at_once}");
        // 2 of 6 mm along x, 1 of 6 mm along y.
        assert!((at_once - 4.0 / 6.0 * 5.0 / 6.0).abs() < 1e-12, "{at_once}");
    }

    #[test]
    fn to_and_fro_costs_once() {
        let mut rolled = Rolled::at([0.0; 2], [0.0; 2]);
        assert!(roll(&mut rolled, [0.7, -0.4], 0.0) < 0.9);
        // With 10 um of vibration of the slide.
        for i in 0..1000 {
            let slide = if i % 2 == 0 { 0.01 } else { -0.01 };
            assert_eq!(roll(&mut rolled, [0.7, 0.1, -0.4, 0.0], slide), 1.0);
        }
    }

    #[test]
    fn a_slide_lets_the_contact_roll_on_at_a_cost() {
        let mut rolled = Rolled::at([0.0; 2], [0.0; 2]);
        roll(&mut rolled, [1.0, 0.0], 0.0);
        assert_eq!(roll(&mut rolled, [1.0], 0.0), 1.0);
        assert!(roll(&mut rolled, [0.0], 0.5) < 0.9);
    }

    #[test]
    fn beyond_the_length_nothing_is_left() {
        let mut rolled = Rolled::at([0.0; 2], [0.0; 2]);
        assert_eq!(roll(&mut rolled, [LENGTH + 1.0], 0.0), 0.0);
        assert_eq!(roll(&mut rolled, [f64::MAX.sqrt()], 0.0), 0.0);
        let there = f64::MAX.sqrt();
        assert_eq!(rolled, Rolled::at([there, 0.5 * there], [0.0; 2]), "a new contact");
    }
}
