//! Stick ratio of a contact from the displacement since the last reversal.
//!
//! Main types: [`SlipHistory`], [`SlipPath`]. Uses math.
//!
//! A spring represents a share of the contact area. Of this share p² (1 − e + e p²) slips. p is the displacement of the spring since
//! the last reversal over the displacement from there to its limit (Masing's rule for parallel springs: Iwan 1966, J. Appl.
//! Mech. 33:893): 0 right after a reversal, 1 on the limit.
//!
//! A reversal counts once the plane has moved by [`REVERSAL_DEADBAND_MM`]. A smaller motion is noise, or elastic slip of the skin. A
//! growth or fall of the limit counts once it is that of a depth of [`GROWTH_DEADBAND_MM`]. A slide with an equivalent but smaller growth
//! waits until one of the two exceeds its threshold. Noise of ±10 µm on depth and on each axis of the slide therefore causes neither a
//! reversal nor growth.
//!
//! * **Turns.** A motion at an acute angle to the path continues the path. A motion at an obtuse angle theta unloads: the component
//!   of the path against the motion is discarded, and of the remainder a share −cos theta, so all of it in a reversal. The part of a
//!   slide beyond full slip never belongs to the path.
//! * **Growth.** A growing contact gains strength everywhere, and all of it sticks as long as friction grows less than k times as fast
//!   as the limit. A small share of the path is kept, so that stuck parts slip again as springs meet their limits when the
//!   contact shrinks. The old path continues once the limit has returned to its value before the growth (wiping out, as in a cycle
//!   of slide). (With Coulomb's law between half-spaces k is 1: Mindlin and Deresiewicz 1953, J. Appl. Mech. 20:327. In a law
//!   tau ~ sigma^beta the strength grows beta times as fast as the pressure.) In their cases the earlier slip also returns
//!   once a slide has increased friction by as much as the limit has grown. This rule is used for growths of the limit by up to a
//!   tenth. After larger ones the contacts of the finite elements stay stuck, and the next slide discards the old path.
//! * **Shrinking.** A contact that is lifted while it moves back continues to slip at its rim. The path is kept as long as
//!   friction falls less than k times as fast as the limit.
//! * **Direction.** The slipping share S becomes S (1 + c cos(2 phi) (1 − S)) for a path at an angle phi to x, with c from a line over
//!   depth ([`crate::build::ParamsOf::slip_lead`]).

use crate::Regime;
use crate::math::Scalar;
use crate::spring::DIV_EPS;

/// Least slide that counts as a reversal, mm: more than the diagonal of a square of ±10 µm.
pub(crate) const REVERSAL_DEADBAND_MM: f32 = 0.029;
/// Least change of depth whose effect on the limit counts, mm.
pub(crate) const GROWTH_DEADBAND_MM: f32 = 0.025;
/// k: growth of friction over growth of the limit, up to which a growing contact sticks.
const GROWTH: f32 = 0.8;
/// A limit up to this multiple of the limit before the growth counts as equal to it.
const SAME: f32 = 1.01;
/// A limit up to this multiple of the limit before the growth keeps the old path.
const REMEMBERED: f32 = 1.1;
/// Share of the path that is kept when a contact grows; of a path to full slip at most.
const LEFT: f32 = 0.03;

/// What a contact remembers of its slip. `Default` is a contact that starts at the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct SlipHistory<T> {
    /// Slide, mm, and angle, rad, at the last reversal.
    pub(crate) turn: [T; 3],
    /// Last recorded position on the path from there.
    pub(crate) reached: [T; 3],
    /// Friction limit there, N; the least one since.
    pub(crate) limit_reached: T,
    /// Origin of the path before the contact grew.
    pub(crate) turn_before: [T; 3],
    /// Friction limit before the growth, N; 0 if the contact has not grown or has slid on since.
    pub(crate) limit_before: T,
}

/// What a step remembers of the slip of a contact: a [`SlipHistory`], or nothing where no stick ratio is asked for.
pub(crate) trait Remembers<T> {
    /// Starts at a position, with a contact that is new.
    fn start(&mut self, here: [T; 3]);
    /// Moves the origin of all positions to `origin`.
    fn move_origin(&mut self, origin: [T; 3]);
    /// The path since the last reversal, before the springs move.
    ///
    /// * `stretch`: displacement, mm, of the spring that touches first and slips last, as the direction of friction
    fn path<const P: usize>(
        &mut self,
        contact: impl FnOnce() -> ContactPoint<T>,
        stretch: impl Fn() -> [T; 2],
    ) -> SlipPath<T>;
    /// Forgets all.
    fn reset(&mut self);
}

impl<T: Scalar> Remembers<T> for SlipHistory<T> {
    #[inline(always)]
    fn start(&mut self, here: [T; 3]) {
        self.turn = here;
        self.reached = here;
    }

    #[inline(always)]
    fn move_origin(&mut self, origin: [T; 3]) {
        for place in [&mut self.turn, &mut self.reached, &mut self.turn_before] {
            *place = less::<2, T>(*place, origin);
        }
    }

    #[inline(always)]
    fn path<const P: usize>(
        &mut self,
        contact: impl FnOnce() -> ContactPoint<T>,
        stretch: impl Fn() -> [T; 2],
    ) -> SlipPath<T> {
        self.follow::<P>(&contact(), stretch)
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

impl<T: Scalar> Remembers<T> for () {
    #[inline(always)]
    fn start(&mut self, _: [T; 3]) {}

    #[inline(always)]
    fn move_origin(&mut self, _: [T; 3]) {}

    #[inline(always)]
    fn path<const P: usize>(&mut self, _: impl FnOnce() -> ContactPoint<T>, _: impl Fn() -> [T; 2]) -> SlipPath<T> {
        SlipPath([T::of(0.0); 3])
    }

    fn reset(&mut self) {}
}

/// Path since the last reversal: slide along x and y, mm, and angle, rad.
pub(crate) struct SlipPath<T>(pub(crate) [T; 3]);

impl<T: Scalar> SlipPath<T> {
    /// The path times a factor; the same without one.
    #[inline(always)]
    pub(crate) fn scaled(&self, factor: Option<T>) -> Self {
        Self(factor.map_or(self.0, |factor| self.0.map(|way| factor * way)))
    }
}

/// Position and load of a contact.
pub(crate) struct ContactPoint<T> {
    /// Slide, mm, and angle, rad, without the slide equivalent to the press: a contact that is only pressed and lifted sticks.
    pub(crate) here: [T; 3],
    /// Friction in full slip, N.
    pub(crate) limit: T,
    /// Least growth of the limit that counts, N.
    pub(crate) growth_deadband_n: T,
    /// Least slide that counts as a reversal, mm.
    pub(crate) reversal_deadband_mm: T,
    /// Stiffness of all springs along x, N/mm.
    pub(crate) stiffness: T,
    /// Mean arm of the springs, which converts angles to lengths.
    pub(crate) gyration_mm: T,
}

impl<T: Scalar> ContactPoint<T> {
    /// Scalar product of two paths, mm²; without spin (P is 1) of their slides alone.
    #[inline(always)]
    fn dot<const P: usize>(&self, a: [T; 3], b: [T; 3]) -> T {
        let plane = a[0] * b[0] + a[1] * b[1];
        if P == 1 { plane } else { plane + self.gyration_mm * self.gyration_mm * (a[2] * b[2]) }
    }

    /// Whether a change of the limit, N, exceeds the change of friction along a path of this square, mm².
    #[inline(always)]
    fn outweighs(&self, grown: T, square: T) -> bool {
        grown * grown > square * self.stiffness * self.stiffness
    }

    /// Share of a path that leads to full slip, at most 1. Full slip is assumed where the mean of the springs slips.
    #[inline(always)]
    fn share_to_full_slip(&self, [x, y, _]: [T; 3]) -> T {
        let full = self.limit / self.stiffness;
        (full * full / (x * x + y * y + T::of(DIV_EPS))).at_most(T::of(1.0)).sqrt()
    }
}

/// Difference of two paths, or of a position and a path; without spin (P is 1) the angle is that of `a`.
#[inline(always)]
fn less<const P: usize, T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], if P == 1 { a[2] } else { a[2] - b[2] }]
}

impl<T: Scalar> SlipHistory<T> {
    /// Updates the path by the motion; see [`Remembers::path`].
    #[inline(always)]
    fn follow<const P: usize>(&mut self, contact: &ContactPoint<T>, stretch: impl Fn() -> [T; 2]) -> SlipPath<T> {
        let &ContactPoint { here, limit, reversal_deadband_mm: noticed, .. } = contact;
        let nothing = T::of(0.0);
        let moved = less::<P, T>(here, self.reached);
        let square = contact.dot::<P>(moved, moved);
        let grown = limit - self.limit_reached;
        let weighed = T::of(GROWTH) * grown;
        let is_far = square > noticed * noticed;
        if is_far || grown > contact.growth_deadband_n {
            let grows = grown > nothing && contact.outweighs(weighed, square);
            // Both are kept while the larger of growth and slide is below its threshold.
            let is_clear = if grows { grown > contact.growth_deadband_n } else { is_far };
            if is_clear {
                if grows {
                    self.grow::<P>(contact);
                } else {
                    if self.limit_before > nothing {
                        self.restore::<P>(contact);
                    }
                    let path = less::<P, T>(self.reached, self.turn);
                    let ahead = contact.dot::<P>(moved, path);
                    if ahead < nothing {
                        if contact.outweighs(weighed, square) && points_along(stretch(), path) {
                            self.turn = less::<P, T>(here, path);
                        } else {
                            self.reverse::<P>(contact, moved, [square, ahead], path);
                        }
                        self.limit_before = nothing;
                    }
                }
                self.reached = here;
                self.limit_reached = limit;
            }
        } else if grown < nothing {
            if grown < -contact.growth_deadband_n {
                let path = less::<P, T>(self.reached, self.turn);
                if contact.dot::<P>(moved, path) < nothing
                    && contact.outweighs(weighed, square)
                    && points_along(stretch(), path)
                {
                    self.turn = less::<P, T>(here, path);
                    self.reached = here;
                }
                self.limit_reached = limit;
            }
            if limit < self.limit_before {
                self.turn = self.turn_before;
                self.limit_before = nothing;
            }
        }
        SlipPath(less::<P, T>(here, self.turn))
    }

    /// The contact moves back, straight or at an obtuse angle theta to its path. The component against the motion is discarded, and of
    /// the component across the motion a share 1 + cos theta is kept.
    ///
    /// * `square`, `ahead`: square of the motion since the last recorded position, and its scalar product with the path, mm²
    #[inline(always)]
    fn reverse<const P: usize>(
        &mut self,
        contact: &ContactPoint<T>,
        moved: [T; 3],
        [square, ahead]: [T; 2],
        path: [T; 3],
    ) {
        let back = ahead / square;
        let cosine = (ahead * back / (contact.dot::<P>(path, path) + T::of(DIV_EPS))).magnitude().sqrt();
        let left = (T::of(1.0) - cosine) * contact.share_to_full_slip(path);
        let across = less::<P, T>(path, moved.map(|m| back * m));
        self.turn = less::<P, T>(self.reached, across.map(|w| left * w));
    }

    /// The contact grows while it sticks: its slip path restarts except for a small share, and the old one is stored.
    #[inline(always)]
    fn grow<const P: usize>(&mut self, contact: &ContactPoint<T>) {
        if !(self.limit_before > T::of(0.0)) {
            self.turn_before = self.turn;
            self.limit_before = self.limit_reached;
        }
        let path = less::<P, T>(contact.here, self.turn_before);
        let left = T::of(LEFT) * contact.share_to_full_slip(path);
        self.turn = less::<P, T>(contact.here, path.map(|w| left * w));
    }

    /// The contact has grown and now slides. Its old path continues if the limit has returned to its value or friction has grown by as
    /// much as a small growth; after a large growth the old path is discarded.
    #[inline(always)]
    fn restore<const P: usize>(&mut self, contact: &ContactPoint<T>) {
        let before = self.limit_before;
        if contact.limit <= T::of(REMEMBERED) * before {
            let since = less::<P, T>(contact.here, self.turn);
            let is_back = contact.limit <= T::of(SAME) * before;
            if !is_back && contact.outweighs(contact.limit - before, contact.dot::<P>(since, since)) {
                return;
            }
            self.turn = self.turn_before;
        }
        self.limit_before = T::of(0.0);
    }
}

/// Whether friction, by the displacement of a spring, still points along the path. A contact that shrinks faster than it moves back
/// then continues to slip at its rim, and the path is kept.
#[inline(always)]
fn points_along<T: Scalar>([x, y]: [T; 2], path: [T; 3]) -> bool {
    x * path[0] + y * path[1] > T::of(0.0)
}

/// Stick ratio of a contact in which slip spreads sooner along x than along y.
#[inline(always)]
pub(crate) fn directional_correction<T: Scalar>(stick_ratio: T, slip_lead: T, SlipPath([x, y, _]): &SlipPath<T>) -> T {
    let (along, across) = (*x * *x, *y * *y);
    let lead = slip_lead * (along - across) / (along + across + T::of(DIV_EPS));
    stick_ratio * (T::of(1.0) - lead * (T::of(1.0) - stick_ratio))
}

/// p of a spring, from the `square` of its path since the last reversal, the scalar product `ahead` of the path and its displacement v
/// from the middle of its limit, and the excess `over` of v² over the squared limit, at most 0.
///
/// p solves |v − path + path/p| = limit. It is at most 1, as the root is at least `ahead` after rounding as well.
#[inline(always)]
pub(crate) fn share_of_path<T: Scalar>(square: T, ahead: T, over: T) -> T {
    let root = (ahead * ahead - square * over).magnitude().sqrt();
    square / (square + T::of(DIV_EPS) + (root - ahead))
}

/// [`Regime::classify`] of a contact, for a stick ratio within 0 and 1.
#[inline(always)]
pub(crate) fn regime_of<T: Scalar>(stick_ratio: T) -> Regime {
    let number = 1 + u8::from(stick_ratio < T::of(0.99)) + u8::from(stick_ratio <= T::of(0.01));
    bytemuck::checked::try_cast(number).unwrap_or(Regime::NoContact)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_lead_keeps_order_and_ends() {
        for lead in [-1.0f32, -0.4, 0.0, 0.7, 1.0] {
            for way in [[1.0, 0.0], [0.0, 2.0], [0.3, -0.3], [0.0, 0.0]] {
                let of =
                    |ratio: f32| super::directional_correction(ratio, lead, &super::SlipPath([way[0], way[1], 0.0]));
                assert_eq!([of(0.0), of(1.0)], [0.0, 1.0]);
                for k in 0..100 {
                    assert!(of(k as f32 / 100.0) <= of((k + 1) as f32 / 100.0) + 1e-6, "{lead} {way:?} {k}");
                }
            }
        }
    }
}
