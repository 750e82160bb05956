//! How much of a contact sticks, by how far it has moved since the motion last turned back.
//!
//! Main type: [`Way`]. Uses state and math.
//!
//! A spring slips for a share p² (1 − e + e p²) of the area that it stands for, where p is the way that its displacement has
//! gone since the motion last turned back over that from there to its limit (Masing's rule for springs side by side: Iwan
//! 1966, J. Appl. Mech. 33:893): 0 right after a turn, 1 on the limit.
//!
//! A turn counts once the plane has moved by [`NOTICED_MM`]: less is noise, or elastic slip of the skin. A growth or fall of the limit
//! counts once it is that of a depth of [`NOTICED_DEPTH_MM`]. A slide that is outweighed by a smaller growth waits until one of the two
//! is clear. Noise of ±5 µm on depth and on each axis of the slide therefore causes neither turn nor growth.
//!
//! * **Turns.** A move at an acute angle to the way goes on with it. One at an obtuse angle theta unloads: of the way what
//!   goes back is forgotten, and of the rest a share −cos theta: all of it where the motion turns round. What was slid beyond full
//!   slip is none of it.
//! * **Growth.** A contact that grows adds strength everywhere, and all of it sticks as long as friction grows less than k
//!   times as fast as the limit. A small share of the way is left, so that what sticks slips again as springs meet their limits
//!   when the contact shrinks; the old way goes on once the limit is back where it was before (wiping out, as in a cycle
//!   of slide). (With Coulomb's law between half-spaces k is 1: Mindlin and Deresiewicz 1953, J. Appl. Mech. 20:327. In a law
//!   tau ~ sigma^beta a rising pressure lets the strength grow beta times as fast.) In their cases the slip of before is there again
//!   as well once a slide has let friction grow by as much as the limit. So it is after growths of the limit by up to a tenth;
//!   after larger ones the finite elements' contacts stick on, and the old way is forgotten with the next slide.
//! * **Shrinking.** A contact that is lifted while it is moved back goes on slipping at its rim: the way stays as long as
//!   friction falls less than k times as fast as the limit.
//! * **Direction.** The share S that slips is S (1 + c cos(2 phi) (1 − S)) for a way at an angle phi to x, with c from a line over
//!   depth ([`crate::ParamsOf::slip_lead`]).

use crate::math::{Arithmetic, Scalar};
use crate::spring::NOTHING;
use crate::{Regime, StateOf};

/// Slide of the plane that is taken note of, mm: more than the diagonal of a square of ±5 µm.
pub(crate) const NOTICED_MM: f32 = 0.0145;
/// Change of the depth whose effect on the limit is taken note of, mm.
pub(crate) const NOTICED_DEPTH_MM: f32 = 0.0125;
/// k: growth of friction over that of the limit up to which a growing contact sticks.
const GROWTH: f32 = 0.8;
/// A limit up to this share of the one before the contact grew is that one again.
const SAME: f32 = 1.01;
/// A limit up to this share of the one before the contact grew has not forgotten it.
const REMEMBERED: f32 = 1.1;
/// Share of the way that is left when a contact grows; of a way of full slip at most.
const LEFT: f32 = 0.03;

/// The way since the last turn: slide along x and y, mm, and angle, rad.
pub(crate) struct Way<T>(pub(crate) [T; 3]);

/// Where a contact is and what it bears there.
pub(crate) struct Course<T> {
    /// Slide, mm, and angle, rad. The slide that pressing amounts to is none of the way: a contact that is only pressed and
    /// lifted sticks.
    pub(crate) here: [T; 3],
    /// Friction in full slip, N.
    pub(crate) limit: T,
    /// Growth of it that is taken note of, N.
    pub(crate) noticed_growth: T,
    /// Of all springs together along x, N/mm.
    pub(crate) stiffness: T,
    /// Mean arm of the springs, which makes angles lengths.
    pub(crate) gyration_mm: T,
}

impl<T: Scalar> Course<T> {
    /// Scalar product of two ways, mm²; without spin (P is 1) of their slides alone.
    #[inline(always)]
    fn dot<const P: usize>(&self, a: [T; 3], b: [T; 3]) -> T {
        let plane = a[0] * b[0] + a[1] * b[1];
        if P == 1 { plane } else { plane + self.gyration_mm * self.gyration_mm * (a[2] * b[2]) }
    }

    /// Whether a change of the limit, N, is more than what friction changes by along a way of this square, mm².
    #[inline(always)]
    fn outweighs(&self, grown: T, square: T) -> bool {
        grown * grown > square * self.stiffness * self.stiffness
    }

    /// Share of a way that leads to full slip, at most 1: what the plane slides beyond it changes nothing. Full slip is taken to
    /// be where the mean of the springs slips.
    #[inline(always)]
    fn share_to_full_slip(&self, [x, y, _]: [T; 3]) -> T {
        let full = self.limit / self.stiffness;
        (full * full / (x * x + y * y + T::of(NOTHING))).at_most(T::of(1.0)).sqrt()
    }
}

/// A way less another, or a place less a way; without spin (P is 1) the angle is left alone.
#[inline(always)]
fn less<const P: usize, T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], if P == 1 { a[2] } else { a[2] - b[2] }]
}

impl<T: Scalar> Way<T> {
    /// Follows the motion, before the springs move.
    ///
    /// * `stretch`: displacement, mm, of the spring that touches first, which slips last: the direction of friction
    #[inline(always)]
    pub(crate) fn follow<const M: usize, const P: usize>(
        state: &mut StateOf<M, P, T>,
        course: &Course<T>,
        stretch: impl Fn(&StateOf<M, P, T>) -> [T; 2],
    ) -> Self {
        let &Course { here, limit, .. } = course;
        let (noticed, nothing) = (T::of(NOTICED_MM), T::of(0.0));
        let moved = less::<P, T>(here, state.reached);
        let square = course.dot::<P>(moved, moved);
        let grown = limit - state.limit_reached;
        let weighed = T::of(GROWTH) * grown;
        let is_far = square > noticed * noticed;
        if is_far || grown > course.noticed_growth {
            let grows = grown > nothing && course.outweighs(weighed, square);
            // As long as the larger of growth and slide is below its threshold, both are kept.
            let is_clear = if grows { grown > course.noticed_growth } else { is_far };
            if is_clear {
                if grows {
                    grow(state, course);
                } else {
                    if state.limit_before > nothing {
                        recall(state, course);
                    }
                    let way = less::<P, T>(state.reached, state.turn);
                    let ahead = course.dot::<P>(moved, way);
                    if ahead < nothing {
                        if course.outweighs(weighed, square) && points_along(stretch(state), way) {
                            state.turn = less::<P, T>(here, way);
                        } else {
                            turn(state, course, moved, [square, ahead], way);
                        }
                        state.limit_before = nothing;
                    }
                }
                state.reached = here;
                state.limit_reached = limit;
            }
        } else if grown < nothing {
            if grown < -course.noticed_growth {
                let way = less::<P, T>(state.reached, state.turn);
                if course.dot::<P>(moved, way) < nothing
                    && course.outweighs(weighed, square)
                    && points_along(stretch(state), way)
                {
                    state.turn = less::<P, T>(here, way);
                    state.reached = here;
                }
                state.limit_reached = limit;
            }
            if limit < state.limit_before {
                state.turn = state.turn_before;
                state.limit_before = nothing;
            }
        }
        Self(less::<P, T>(here, state.turn))
    }
}

/// Whether friction, by the stretch of a spring, still points along the way. A contact that shrinks faster than it is moved back
/// then goes on slipping at its rim, and the way stays.
#[inline(always)]
fn points_along<T: Scalar>([x, y]: [T; 2], way: [T; 3]) -> bool {
    x * way[0] + y * way[1] > T::of(0.0)
}

/// The contact is moved back, straight or at an obtuse angle theta to its way: what goes back is forgotten, and of the rest, across
/// the motion, a share 1 + cos theta is left.
///
/// * `square`, `ahead`: square of what was moved since the last one taken note of, and its scalar product with the way, mm²
#[inline(always)]
fn turn<const M: usize, const P: usize, T: Scalar>(
    state: &mut StateOf<M, P, T>,
    course: &Course<T>,
    moved: [T; 3],
    [square, ahead]: [T; 2],
    way: [T; 3],
) {
    let back = ahead / square;
    let cosine = (ahead * back / (course.dot::<P>(way, way) + T::of(NOTHING))).magnitude().sqrt();
    let left = (T::of(1.0) - cosine) * course.share_to_full_slip(way);
    let across = less::<P, T>(way, moved.map(|m| back * m));
    state.turn = less::<P, T>(state.reached, across.map(|w| left * w));
}

/// The contact grows while it sticks: its way begins anew but for a small share, and the old one is kept.
#[inline(always)]
fn grow<const M: usize, const P: usize, T: Scalar>(state: &mut StateOf<M, P, T>, course: &Course<T>) {
    if !(state.limit_before > T::of(0.0)) {
        state.turn_before = state.turn;
        state.limit_before = state.limit_reached;
    }
    let way = less::<P, T>(course.here, state.turn_before);
    let left = T::of(LEFT) * course.share_to_full_slip(way);
    state.turn = less::<P, T>(course.here, way.map(|w| left * w));
}

/// The contact has grown and now slides: its old way goes on where the limit is what it was or friction has made up for a small
/// growth; after a large one it is forgotten.
#[inline(always)]
fn recall<const M: usize, const P: usize, T: Scalar>(state: &mut StateOf<M, P, T>, course: &Course<T>) {
    let before = state.limit_before;
    if course.limit <= T::of(REMEMBERED) * before {
        let since = less::<P, T>(course.here, state.turn);
        let is_back = course.limit <= T::of(SAME) * before;
        if !is_back && course.outweighs(course.limit - before, course.dot::<P>(since, since)) {
            return;
        }
        state.turn = state.turn_before;
    }
    state.limit_before = T::of(0.0);
}

/// The stick ratio of a contact in which slip leads along x and lags along y.
#[inline(always)]
pub(crate) fn led<T: Arithmetic>(stick_ratio: T, slip_lead: T, Way([x, y, _]): &Way<T>) -> T {
    let (along, across) = (*x * *x, *y * *y);
    let lead = slip_lead * (along - across) / (along + across + T::of(NOTHING));
    stick_ratio * (T::of(1.0) - lead * (T::of(1.0) - stick_ratio))
}

/// p of a spring: `way` since the last turn and its square, the scalar product `ahead` of the way and the place v where the spring
/// is now, from the middle of its limit, and by how much v is `over` the limit's square, at most 0.
///
/// p solves |v − way + way/p| = limit. It is at most 1, as the root is at least `ahead` after rounding as well.
#[inline(always)]
pub(crate) fn share_of_way<T: Arithmetic>(square: T, ahead: T, over: T) -> T {
    let root = (ahead * ahead - square * over).magnitude().sqrt();
    square / (square + T::of(NOTHING) + (root - ahead))
}

/// [`Regime::classify`] of a contact, for a stick ratio within 0 and 1.
#[inline(always)]
pub(crate) fn regime_of<T: Scalar>(stick_ratio: T) -> Regime {
    let number = 1 + u8::from(stick_ratio < T::of(0.99)) + u8::from(stick_ratio <= T::of(0.01));
    bytemuck::checked::try_cast(number).unwrap_or(Regime::NoContact)
}

#[cfg(test)]
mod tests {
    use crate::{Motion, Params, Regime, Response, State};

    /// Steps to a depth and by a slide along x, in steps of 5 µm; the answers on the way.
    fn go(state: &mut State, depth_mm: f32, slide_mm: f32) -> std::vec::Vec<Response> {
        go_along(state, depth_mm, slide_mm, 0.0)
    }

    /// The same with a slide at an angle to x, degrees.
    fn go_along(state: &mut State, depth_mm: f32, slide_mm: f32, degrees: f32) -> std::vec::Vec<Response> {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let from = state.depth_mm();
        let steps = ((depth_mm - from).abs().max(slide_mm.abs()) / 0.005).ceil();
        (1..=steps as u32)
            .map(|k| {
                let depth_mm = from + (depth_mm - from) * (k as f32 / steps);
                let (sin, cos) = degrees.to_radians().sin_cos();
                let slide_increment_mm = [slide_mm / steps * cos, slide_mm / steps * sin];
                model.step(state, Motion { depth_mm, slide_increment_mm, dt_s: 1e-3, ..Motion::default() })
            })
            .collect()
    }

    #[test]
    fn a_press_and_a_lift_stick() {
        let mut state = State::default();
        for r in go(&mut state, 1.5, 0.0).into_iter().chain(go(&mut state, 0.05, 0.0)) {
            assert_eq!(r.regime, Regime::Stick, "{r:?}");
        }
    }

    /// A contact that grows sticks; back where it was the old stick ratio comes back with the next slide, below it at once.
    #[test]
    fn what_a_growth_hid_comes_back() {
        let mut state = State::default();
        go(&mut state, 1.0, 0.0);
        let before = go(&mut state, 1.0, 1.0).pop().unwrap().stick_ratio;
        assert!(before > 0.2 && before < 0.8, "{before}");
        assert!(go(&mut state, 1.2, 0.0).pop().unwrap().stick_ratio > 0.99);
        assert!(go(&mut state, 1.02, 0.0).pop().unwrap().stick_ratio > 0.95);
        let mut lower = state;
        let after = go(&mut state, 1.0, 0.03).pop().unwrap().stick_ratio;
        assert!((after - before).abs() < 0.04, "{after} after {before}");
        let below = go(&mut lower, 0.98, 0.0).pop().unwrap().stick_ratio;
        assert!((below - before).abs() < 0.06, "{below} after {before}");
    }

    /// After a small growth the stick ratio is that of a slide at the new depth once friction has grown by as much as the limit
    /// (Mindlin and Deresiewicz 1953), before it the contact sticks; also where the depth trembles meanwhile by a micrometre. After a
    /// large growth it is not.
    #[test]
    fn a_slide_brings_back_what_a_small_growth_hid() {
        for (degrees, tremble_mm) in [(0.0, 0.0), (180.0, 0.0), (90.0, 0.0), (0.0, 0.001)] {
            let slide = |state: &mut State, depth_mm: f32, slide_mm: f32| {
                let mut last = 0.0;
                for k in 0..4 {
                    let depth_mm = depth_mm + if k % 2 == 0 { tremble_mm } else { -tremble_mm };
                    last = go_along(state, depth_mm, 0.25 * slide_mm, degrees).pop().unwrap().stick_ratio;
                }
                last
            };
            let after = |grown_mm: f32, slide_mm: f32| {
                let [mut grown, mut plain] = [State::default(); 2];
                go(&mut grown, 1.0, 0.0);
                go(&mut plain, 1.0 + grown_mm, 0.0);
                let before = slide(&mut grown, 1.0, 0.8);
                assert!(before > 0.05 && before < 0.95, "{degrees}: {before}");
                slide(&mut plain, 1.0 + grown_mm, 0.8);
                let hidden = go_along(&mut grown, 1.0 + grown_mm, 0.0, degrees).pop().unwrap().stick_ratio;
                let [grown, plain] = [&mut grown, &mut plain].map(|state| slide(state, 1.0 + grown_mm, slide_mm));
                (hidden, grown, plain)
            };
            let (hidden, grown, plain) = after(0.02, 0.08);
            assert!(hidden > 0.99 && (grown - plain).abs() < 0.02, "{degrees} {hidden} {grown} {plain}");
            let (_, grown, plain) = after(0.2, 0.08);
            assert!(grown > plain + 0.1, "{degrees} {grown} {plain}");
        }
    }

    /// Finite-element contacts that turn by 120 degrees or more stick by 0.7 to 1 afterwards, whatever slipped before; by less
    /// than 80 degrees they slip on. From full slip the model lets less stick than that up to 140 degrees.
    #[test]
    fn an_obtuse_turn_sticks_and_an_acute_one_does_not() {
        for (degrees, least, most) in
            [(180.0, 0.97, 1.0), (150.0, 0.8, 1.0), (135.0, 0.5, 1.0), (70.0, 0.0, 0.1), (40.0, 0.0, 0.1)]
        {
            for sign in [1.0, -1.0] {
                let mut state = State::default();
                go(&mut state, 1.0, 0.0);
                assert!(go(&mut state, 1.0, 3.0).pop().unwrap().stick_ratio <= 0.01);
                let after = go_along(&mut state, 1.0, 0.1, sign * degrees).pop().unwrap().stick_ratio;
                assert!((least..=most).contains(&after), "{degrees} degrees: {after}");
            }
        }
    }

    /// What stuck when the contact grew while it slid slips as the contact shrinks, all of it once friction is at its limit and
    /// over several steps of 5 µm; nothing waits until the limit is what it was before the growth.
    #[test]
    fn a_contact_that_shrinks_slips_where_friction_meets_its_limit() {
        let mut state = State::default();
        go(&mut state, 0.6, 0.6);
        let grown = go(&mut state, 1.4, 0.5).pop().unwrap();
        assert!(grown.stick_ratio > 0.9, "{grown:?}");
        let mut last = grown.stick_ratio;
        for r in go(&mut state, 0.3, 0.0) {
            assert!((r.stick_ratio - last).abs() < 0.6, "{last} then {r:?}");
            assert!(r.slip_margin > 1e-3 || r.stick_ratio < 0.1, "{r:?}");
            last = r.stick_ratio;
        }
        assert!(last < 1e-3, "{last}");
    }

    /// Lifted while it is moved back a contact goes on slipping at its rim; moved back at its depth it sticks.
    #[test]
    fn a_contact_that_is_lifted_as_it_turns_slips_on() {
        let mut state = State::default();
        go(&mut state, 1.5, 0.0);
        let before = go(&mut state, 1.5, 1.2).pop().unwrap().stick_ratio;
        assert!(before > 0.2 && before < 0.8, "{before}");
        let mut held = state;
        let lifted = go(&mut state, 1.3, -0.06).pop().unwrap().stick_ratio;
        assert!((lifted - before).abs() < 0.2, "{lifted} after {before}");
        let turned = go(&mut held, 1.5, -0.06).pop().unwrap().stick_ratio;
        assert!(turned > 0.98, "{turned} after {before}");
    }

    #[test]
    fn the_lead_keeps_order_and_ends() {
        for lead in [-1.0f32, -0.4, 0.0, 0.7, 1.0] {
            for way in [[1.0, 0.0], [0.0, 2.0], [0.3, -0.3], [0.0, 0.0]] {
                let of = |ratio: f32| super::led(ratio, lead, &super::Way([way[0], way[1], 0.0]));
                assert_eq!([of(0.0), of(1.0)], [0.0, 1.0]);
                for k in 0..100 {
                    assert!(of(k as f32 / 100.0) <= of((k + 1) as f32 / 100.0) + 1e-6, "{lead} {way:?} {k}");
                }
            }
        }
    }
}
