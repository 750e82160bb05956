//! How much of a contact sticks, by how far friction has gone since it last reversed.
//!
//! Main type: [`Reversal`]. Uses state and math.
//!
//! The stick ratio is (1 − p²/p1²) (1 − e v (1 + v)/2). p is the path that the resultant m = F/L has gone since its last
//! reversal at m0, as a share of the path from there to the limit; at p1 nothing would stick; v is the yield function at
//! m0, which is 1 on the limit, so that e is the slip right after a reversal from full slip. A reversal forgets that part
//! of the path which it goes back. Nothing sticks either once most of the path has been gone and the last element yields.
//!
//! A contact that grows adds strength everywhere, and all of it sticks as long as friction grows less than k times as
//! fast as the limit: then the path is forgotten. (With Coulomb's law between half-spaces k is 1: Mindlin and Deresiewicz
//! 1953, J. Appl. Mech. 20:327. In a law tau ~ sigma^beta a rising pressure lets the strength grow beta times as fast.)
//! Growth otherwise shortens the path as the limit's square grows.

use crate::math::{not_negative, sqrt};
use crate::step::NOTHING;
use crate::{DataOf, Regime, StateOf};

/// k: growth of friction over that of the limit up to which a growing contact sticks. Of the finite-element rows of the
/// design (beta 0.46) 4 in 5 or more stick below 0.4, a third to a half from 0.45 to 0.6, hardly any above.
const GROWTH: f32 = 0.5;
/// Share of the path to full slip beyond which nothing sticks once the last element is on its limit; a reversal may leave
/// it there.
const MOST: f32 = 0.8;
/// How much more of the path it takes for each bit by which that element's yield function is less than 1.
const SHARPNESS: f32 = 16.0;

/// Where the resultant last reversed, seen from the present step.
pub(crate) struct Reversal {
    from: [f32; 2],
    /// Yield function there.
    yield_at_reversal: f32,
    /// Yield function of the last element.
    level: f32,
}

/// Follows the point of the last reversal through a step, before the elements move.
///
/// * `from_x`, `from_y`: the resultant after the step before, over the limit then
/// * `slide`: where the slide would take the resultant if none yielded, less where it was
/// * `retained`: share of the resultant that a change of depth leaves
/// * `limit_ratio`: limit before over limit now
#[inline(always)]
pub(crate) fn follow_reversal<const M: usize>(
    state: &StateOf<M>,
    [mut from_x, mut from_y]: [f32; 2],
    [slide_x, slide_y]: [f32; 2],
    retained: f32,
    limit_ratio: f32,
    shift_twice: f32,
) -> Reversal {
    let [mut path_x, mut path_y] = state.path_since_reversal;
    let (mut to_x, mut to_y) = (slide_x, slide_y);
    let square;
    if limit_ratio < 1.0 {
        let grown = GROWTH - GROWTH * limit_ratio;
        square = NOTHING + to_x * to_x + to_y * to_y;
        let kept = if square < grown * grown { 0.0 } else { limit_ratio * limit_ratio };
        from_x *= limit_ratio;
        from_y *= limit_ratio;
        path_x *= kept;
        path_y *= kept;
    } else {
        // A limit that shrinks leaves the resultant nearer to it.
        let nearer = retained - 1.0;
        to_x += nearer * from_x;
        to_y += nearer * from_y;
        square = NOTHING + to_x * to_x + to_y * to_y;
    }
    let ahead = to_x * path_x + to_y * path_y;
    if ahead < 0.0 {
        let back = ahead / square;
        path_x -= back * to_x;
        path_y -= back * to_y;
    }
    from_x -= path_x;
    from_y -= path_y;
    let yield_at_reversal = from_y * from_y + from_x * (from_x - shift_twice);
    Reversal { from: [from_x, from_y], yield_at_reversal, level: 0.0 }
}

impl Reversal {
    /// Takes note of an element with this value of the yield function; the last one counts, which yields last.
    #[inline(always)]
    pub(crate) fn note(&mut self, level: f32) {
        self.level = level;
    }

    /// The stick ratio with the resultant at `resultant`; the state remembers the path there.
    #[inline(always)]
    pub(crate) fn stick_ratio<const M: usize, const N: usize>(
        self,
        state: &mut StateOf<M>,
        resultant: [f32; 2],
        yield_shift: f32,
        data: &DataOf<M, N>,
    ) -> f32 {
        let [from_x, from_y] = self.from;
        let path = [resultant[0] - from_x, resultant[1] - from_y];
        let used = share_of_path(path, [from_x - yield_shift, from_y], (1.0 - self.yield_at_reversal).abs());
        let slip = data.slip_rate * used;
        state.path_since_reversal = path;
        if slip + SHARPNESS * self.level >= MOST + SHARPNESS {
            state.path_since_reversal = resultant;
            return 0.0;
        }
        let stuck = 1.0 - slip * slip;
        // Inside the limit the yield function may be a little below 0.
        let level = self.yield_at_reversal.abs();
        not_negative(stuck - stuck * (data.half_turn_slip * (level + level * level)))
    }
}

/// How much of the path to the limit a resultant has gone, 0 to 1; at the limit it may be a little off 1.
///
/// p solves |from + path/p| = limit, a circle around alpha. `from` is counted from there, `room` is 1 less the yield
/// function there, not negative but for rounding.
#[inline(always)]
fn share_of_path(path: [f32; 2], from: [f32; 2], room: f32) -> f32 {
    let [x, y] = path;
    let square = x * x + y * y;
    let ahead = x * from[0] + y * from[1];
    let root = sqrt(ahead * ahead + square * room);
    square / (root - ahead + NOTHING)
}

/// [`Regime::classify`] of a contact, for a stick ratio within 0 and 1. Without a branch.
#[inline(always)]
pub(crate) fn regime_of(stick_ratio: f32) -> Regime {
    // Whole numbers, which order like the floats; a difference below 0 has the highest bit.
    let below = |threshold: f32| stick_ratio.to_bits().wrapping_sub(threshold.to_bits()) >> 31;
    let number = 1 + below(0.99) + below(0.01f32.next_up());
    bytemuck::checked::try_cast(number as u8).unwrap_or(Regime::NoContact)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Motion, Params, State, step};

    /// Pressed deeper after full slip, a contact sticks while the slide is slow against the growth, and slips on while
    /// it is fast; held at its depth it remembers nothing of the slip.
    #[test]
    fn growth_decides_between_stick_and_slip() {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let regime_after = |slide: f32| {
            let mut state = State::default();
            let mut go = |depth_mm: f32, x: f32| {
                step(&model, &mut state, Motion { depth_mm, slide_increment_mm: [x, 0.0], dt_s: 1e-3 })
            };
            (0..400).for_each(|_| _ = go(0.5, 0.01));
            assert_eq!(go(0.5, 0.01).regime, Regime::Slip);
            (1..=1000).map(|i| go(0.5 + 0.001 * i as f32, slide)).last().unwrap()
        };
        let still = regime_after(0.0);
        assert_eq!(still.regime, Regime::Stick, "{still:?}");
        let fast = regime_after(0.01);
        assert_eq!(fast.regime, Regime::Slip, "{fast:?}");
        let [a, b, c] = [0.0005, 0.002, 0.005].map(|slide| regime_after(slide).stick_ratio);
        assert!(a > 0.95 && a >= b && b >= c, "{a} {b} {c}");
    }

    #[test]
    fn regime_is_that_of_the_ratio() {
        for (low, high) in
            [(0.0f32, 1e-30f32), (0.009_999, 0.010_001), (0.4, 0.400_1), (0.989_99, 0.990_01), (0.999_9, 1.0)]
        {
            for bits in low.to_bits()..=high.to_bits().min(low.to_bits() + 100_000) {
                let ratio = f32::from_bits(bits);
                assert_eq!(regime_of(ratio), Regime::classify(true, ratio), "{ratio}");
            }
        }
        for ratio in [0.01, 0.99, 1.0f32] {
            assert_eq!(regime_of(ratio), Regime::classify(true, ratio), "{ratio}");
        }
    }
}
