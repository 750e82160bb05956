//! How much of a contact sticks, by how far it has moved since the motion last turned back.
//!
//! Main type: [`Way`]. Uses state and math.
//!
//! A spring slips for a share p² (1 − e + e p²) of the area that it stands for, where p is the way that its displacement has
//! gone since the motion last turned back over that from there to its limit (Masing's rule for springs side by side: Iwan
//! 1966, J. Appl. Mech. 33:893): 0 right after a turn, 1 on the limit.
//!
//! A turn counts once the plane has moved by [`NOTICED_MM`]: less is noise, or elastic slip of the skin. A move back forgets
//! that part of the way which it goes back. A contact that grows adds strength everywhere, and all of it sticks as long as
//! friction grows less than k times as fast as the limit: then the way begins anew, and the old one goes on once the limit is
//! back where it was before (wiping out, as in a cycle of slide). (With Coulomb's law between half-spaces
//! k is 1: Mindlin and Deresiewicz 1953, J. Appl. Mech. 20:327. In a law tau ~ sigma^beta a rising pressure lets the strength
//! grow beta times as fast.)

use crate::math::{Arithmetic, Scalar};
use crate::spring::NOTHING;
use crate::{Regime, StateOf};

/// Slide of the plane, or slide that would be needed to make up for a growth of the limit, that is taken note of, mm.
pub(crate) const NOTICED_MM: f32 = 0.01;
/// k: growth of friction over that of the limit up to which a growing contact sticks.
const GROWTH: f32 = 0.8;
/// A limit up to this share of the one before the contact grew is that one again.
const SAME: f32 = 1.01;

/// The way since the last turn: slide along x and y, mm, and angle, rad.
pub(crate) struct Way<T>(pub(crate) [T; 3]);

impl<T: Scalar> Way<T> {
    /// Follows the motion to `here` (slide, angle), before the springs move. The slide that pressing amounts to is none of the
    /// way: a contact that is only pressed and lifted sticks.
    ///
    /// * `limit`, `stiffness`: of the contact at its depth, N and N/mm
    /// * `gyration_mm`: what makes angles lengths
    #[inline(always)]
    pub(crate) fn follow<const M: usize, const P: usize>(
        state: &mut StateOf<M, P, T>,
        here: [T; 3],
        limit: T,
        stiffness: T,
        gyration_mm: T,
    ) -> Self {
        let lever = if P == 1 { T::of(0.0) } else { gyration_mm * gyration_mm };
        let noticed = T::of(NOTICED_MM);
        let dot = |a: [T; 3], b: [T; 3]| {
            let plane = a[0] * b[0] + a[1] * b[1];
            if P == 1 { plane } else { plane + lever * (a[2] * b[2]) }
        };
        let less = |a: [T; 3], b: [T; 3]| [a[0] - b[0], a[1] - b[1], if P == 1 { a[2] } else { a[2] - b[2] }];
        let moved = less(here, state.reached);
        let square = dot(moved, moved);
        let grown = limit - state.limit_reached;
        let nothing = T::of(0.0);
        if square > noticed * noticed || grown > noticed * stiffness {
            let growth = T::of(GROWTH) * grown;
            if growth > nothing && growth * growth > square * stiffness * stiffness {
                if !(state.limit_before > nothing) {
                    state.turn_before = state.turn;
                    state.limit_before = state.limit_reached;
                }
                state.turn = here;
            } else {
                if limit <= T::of(SAME) * state.limit_before {
                    state.turn = state.turn_before;
                }
                state.limit_before = nothing;
                let way = less(state.reached, state.turn);
                let ahead = dot(moved, way);
                if ahead < nothing {
                    let back = ahead / square;
                    let left = [way[0] - back * moved[0], way[1] - back * moved[1], way[2] - back * moved[2]];
                    state.turn = less(state.reached, left);
                }
            }
            state.reached = here;
            state.limit_reached = limit;
        } else {
            state.limit_reached = state.limit_reached.at_most(limit);
            if limit < state.limit_before {
                state.turn = state.turn_before;
                state.limit_before = nothing;
            }
        }
        Self(less(here, state.turn))
    }
}

/// p of a spring: `way` since the last turn, `v` where it is now, both from the middle of its limit, and
/// the `room` that is left of the limit's square, 0 where it slips.
///
/// p solves |v − way + way/p| = limit.
#[inline(always)]
pub(crate) fn share_of_way<T: Arithmetic>(way: [T; 2], v: [T; 2], room: T) -> T {
    let square = way[0] * way[0] + way[1] * way[1];
    let ahead = way[0] * v[0] + way[1] * v[1];
    let root = (ahead * ahead + square * room).magnitude().sqrt();
    (square / (square - ahead + root + T::of(NOTHING))).at_most(T::of(1.0))
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
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let from = state.depth_mm();
        let steps = ((depth_mm - from).abs().max(slide_mm.abs()) / 0.005).ceil();
        (1..=steps as u32)
            .map(|k| {
                let depth_mm = from + (depth_mm - from) * (k as f32 / steps);
                let slide_increment_mm = [slide_mm / steps, 0.0];
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
        assert_eq!(go(&mut state, 1.2, 0.0).pop().unwrap().stick_ratio, 1.0);
        assert_eq!(go(&mut state, 1.0, 0.0).pop().unwrap().stick_ratio, 1.0);
        let mut lower = state;
        let after = go(&mut state, 1.0, 0.03).pop().unwrap().stick_ratio;
        assert!((after - before).abs() < 0.04, "{after} after {before}");
        let below = go(&mut lower, 0.98, 0.0).pop().unwrap().stick_ratio;
        assert!((below - before).abs() < 0.06, "{below} after {before}");
    }
}
